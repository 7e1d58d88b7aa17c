//! A gyroid (Schoen 1970), meshed by marching tetrahedra (Doi & Koide 1991).

use std::f64::consts::TAU;

use glam::DVec3;

use super::Surface;
use crate::random::Random;

/// The gyroid's periods along each side of the cube.
const PERIODS: f64 = 4.0;

/// How near a vertex comes to a lattice point, in lattice edges: on it, triangles would have no area.
const NEAREST: f64 = 0.02;

/// The lattice that says how many triangles a finer one will have.
const PILOT_CELLS: usize = 48;

/// One of the gyroid's two sides, in the unit cube; the seed shifts it.
pub fn gyroid(triangles: usize, seed: u64) -> Surface {
    let solid = Solid::new(seed);
    let pilot = solid.surface(PILOT_CELLS).triangles.len() as f64;
    let cells = PILOT_CELLS as f64 * (triangles as f64 / pilot).sqrt();
    // A period wants a few cells, or the handles fall apart.
    solid.surface(cells.round().max(2.0 * PERIODS) as usize)
}

struct Solid {
    phase: DVec3,
}

impl Solid {
    fn new(seed: u64) -> Self {
        let mut random = Random::new(seed);
        Self {
            phase: DVec3::new(random.signed(), random.signed(), random.signed()) * TAU,
        }
    }

    /// The values at the lattice's points at one height: negative inside the solid.
    fn layer(&self, lattice: &Lattice, z: usize) -> Vec<f64> {
        let waves = |axis: usize| -> Vec<(f64, f64)> {
            (0..lattice.points)
                .map(|i| (lattice.coordinate(i) * PERIODS * TAU + self.phase[axis]).sin_cos())
                .collect()
        };
        let (along_x, along_y, (sin_z, cos_z)) = (waves(0), waves(1), waves(2)[z]);
        let mut values = Vec::with_capacity(lattice.points * lattice.points);
        for (y, (sin_y, cos_y)) in along_y.into_iter().enumerate() {
            for (x, &(sin_x, cos_x)) in along_x.iter().enumerate() {
                let gyroid = sin_x * cos_y + sin_y * cos_z + sin_z * cos_x;
                let farthest = [x, y, z]
                    .map(|i| (lattice.coordinate(i) - 0.5).abs())
                    .into_iter()
                    .fold(0.0, f64::max);
                // As steep as the gyroid, so that the walls meet it in a clean edge.
                values.push(gyroid.max((farthest - 0.5) * PERIODS * TAU));
            }
        }
        values
    }

    /// The surface, with `cells` lattice cells along each side of the cube.
    fn surface(&self, cells: usize) -> Surface {
        let lattice = Lattice::new(cells);
        let mut surface = Surface::default();
        let mut lower = Layer::new(self.layer(&lattice, 0));
        for z in 0..lattice.points - 1 {
            let upper = Layer::new(self.layer(&lattice, z + 1));
            let mut slab = Slab {
                lattice: &lattice,
                z,
                layers: [lower, upper],
                surface: &mut surface,
            };
            slab.march();
            let [_, next] = slab.layers;
            lower = next;
        }
        surface
    }
}

/// Points at equal distances, one cell more on each side than the unit cube has.
struct Lattice {
    points: usize,
    cell: f64,
}

impl Lattice {
    fn new(cells: usize) -> Self {
        Self {
            points: cells + 3,
            cell: 1.0 / cells as f64,
        }
    }

    /// Off the grid by a part of a cell, or walls would run through lattice points.
    fn coordinate(&self, i: usize) -> f64 {
        (i as f64 - 0.7) * self.cell
    }

    fn point(&self, place: [usize; 3]) -> DVec3 {
        DVec3::from(place.map(|i| self.coordinate(i)))
    }
}

/// The lattice points at one height, and the vertices on the edges that start at them.
struct Layer {
    values: Vec<f64>,
    /// By direction: an edge goes one step along one axis, two or all three, as bits.
    vertices: Vec<[Option<u32>; 8]>,
}

impl Layer {
    fn new(values: Vec<f64>) -> Self {
        Self {
            vertices: vec![[None; 8]; values.len()],
            values,
        }
    }
}

/// The cells between two layers.
struct Slab<'a> {
    lattice: &'a Lattice,
    z: usize,
    layers: [Layer; 2],
    surface: &'a mut Surface,
}

/// A corner of a cell: its steps along x, y and z from the first, as bits.
type Corner = usize;

/// The six tetrahedra around a cell's diagonal, positively oriented: their faces fit those of the
/// next cell's (Kuhn).
#[rustfmt::skip]
const TETRAHEDRA: [[Corner; 4]; 6] = [
    [0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7],
];

impl Slab<'_> {
    fn march(&mut self) {
        for y in 0..self.lattice.points - 1 {
            for x in 0..self.lattice.points - 1 {
                let is_inside = |corner| self.value(x, y, corner) < 0.0;
                let inside = (0..8).filter(|&corner| is_inside(corner)).count();
                if inside % 8 != 0 {
                    for tetrahedron in TETRAHEDRA {
                        self.cut(x, y, tetrahedron);
                    }
                }
            }
        }
    }

    fn point_index(&self, x: usize, y: usize, corner: Corner) -> (usize, usize) {
        let (x, y) = (x + (corner & 1), y + (corner >> 1 & 1));
        (corner >> 2, y * self.lattice.points + x)
    }

    fn value(&self, x: usize, y: usize, corner: Corner) -> f64 {
        let (layer, i) = self.point_index(x, y, corner);
        self.layers[layer].values[i]
    }

    /// The triangles in one tetrahedron, with the inside behind them.
    fn cut(&mut self, x: usize, y: usize, tetrahedron: [Corner; 4]) {
        let inside = tetrahedron.map(|corner| self.value(x, y, corner) < 0.0);
        let mut on = |i: usize, j: usize| self.vertex(x, y, tetrahedron[i], tetrahedron[j]);
        // The corners inside first, by an even permutation of the four.
        let (triangles, count): ([[u32; 3]; 2], usize) = match inside.map(u8::from) {
            [0, 0, 0, 0] | [1, 1, 1, 1] => return,
            [1, 0, 0, 0] => (one(&mut on, [0, 1, 2, 3]), 1),
            [0, 1, 0, 0] => (one(&mut on, [1, 0, 3, 2]), 1),
            [0, 0, 1, 0] => (one(&mut on, [2, 3, 0, 1]), 1),
            [0, 0, 0, 1] => (one(&mut on, [3, 2, 1, 0]), 1),
            [0, 1, 1, 1] => (one(&mut on, [0, 1, 3, 2]), 1),
            [1, 0, 1, 1] => (one(&mut on, [1, 0, 2, 3]), 1),
            [1, 1, 0, 1] => (one(&mut on, [2, 3, 1, 0]), 1),
            [1, 1, 1, 0] => (one(&mut on, [3, 2, 0, 1]), 1),
            [1, 1, 0, 0] => (two(&mut on, [0, 1, 2, 3]), 2),
            [1, 0, 1, 0] => (two(&mut on, [0, 2, 3, 1]), 2),
            [1, 0, 0, 1] => (two(&mut on, [0, 3, 1, 2]), 2),
            [0, 1, 1, 0] => (two(&mut on, [1, 2, 0, 3]), 2),
            [0, 1, 0, 1] => (two(&mut on, [1, 3, 2, 0]), 2),
            [0, 0, 1, 1] => (two(&mut on, [2, 3, 0, 1]), 2),
            _ => unreachable!("four bits"),
        };
        self.surface.triangles.extend(&triangles[..count]);
    }

    /// The vertex on an edge of the lattice whose ends lie on different sides.
    fn vertex(&mut self, x: usize, y: usize, a: Corner, b: Corner) -> u32 {
        // In every tetrahedron one corner's steps are among the other's.
        let (from, to) = (a.min(b), a.max(b));
        let (layer, i) = self.point_index(x, y, from);
        if let Some(vertex) = self.layers[layer].vertices[i][to - from] {
            return vertex;
        }
        let (v, w) = (self.value(x, y, from), self.value(x, y, to));
        let t = (v / (v - w)).clamp(NEAREST, 1.0 - NEAREST);
        let place = |c: Corner| {
            let steps = [c & 1, c >> 1 & 1, c >> 2];
            self.lattice
                .point([x + steps[0], y + steps[1], self.z + steps[2]])
        };
        let vertex = self.surface.positions.len() as u32;
        self.surface.positions.push(place(from).lerp(place(to), t));
        self.layers[layer].vertices[i][to - from] = Some(vertex);
        vertex
    }
}

/// The triangle that cuts off corner `a` of the positive tetrahedron `a b c d`.
fn one(on: &mut impl FnMut(usize, usize) -> u32, [a, b, c, d]: [usize; 4]) -> [[u32; 3]; 2] {
    [[on(a, b), on(a, c), on(a, d)]; 2]
}

/// The two that part `a` and `b` from `c` and `d`.
fn two(on: &mut impl FnMut(usize, usize) -> u32, [a, b, c, d]: [usize; 4]) -> [[u32; 3]; 2] {
    let [ac, ad, bc, bd] = [on(a, c), on(a, d), on(b, c), on(b, d)];
    [[ac, ad, bd], [ac, bd, bc]]
}
