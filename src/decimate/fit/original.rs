//! The original surface: whole, as its arrays and what finds a place in them; and a piece of it, as
//! samples to be near to and as triangles to be near.

use std::sync::OnceLock;

use glam::Vec3;

use super::cells::{Cells, Seen};
use super::measure::ToOriginal;
use super::{Number, index, number};
use crate::nearest::{Patch, foot_on_triangle};
use crate::progress::{self, BLOCK, Meter};
use crate::spatial::Grid;

/// Faces larger than the mean by this factor squared are sampled in as many rows.
const ROWS: f64 = 16.0;

/// A small mesh is sampled as if it had this many faces.
const FEWEST: usize = 10_000;

/// Faces to sample the original in, for each face that is to be left.
const ON_A_FACE: usize = 2;

/// The arrays of a mesh.
#[derive(Clone, Copy)]
pub struct Arrays<'a> {
    /// Where its vertices are.
    pub positions: &'a [Vec3],
    /// Three vertices each, which way round does not matter to the boundary.
    pub triangles: &'a [[u32; 3]],
}

/// The original, and where in it what lies.
pub struct Original<'a> {
    arrays: Arrays<'a>,
    /// What brings lengths into the unit box.
    scale: f64,
    pub(super) cells: Cells,
    boundary: Vec<[u32; 2]>,
    boundary_cells: Cells,
    /// The area to a sample in a face.
    typical: f64,
    /// Squared distances up to this are rounding.
    pub(super) noise_squared: f32,
}

impl<'a> Original<'a> {
    /// Sorts a mesh into cells, so that pieces of it can be sampled for fitting `target` faces: one
    /// and a half samples a face of about mean size, at least.
    pub fn new(
        arrays: Arrays<'a>,
        grid: Grid,
        scale: f64,
        target: usize,
        with_boundary: bool,
        meter: &mut Meter,
    ) -> progress::Result<Self> {
        let Arrays {
            positions,
            triangles,
        } = arrays;
        let corners = |i: usize| triangles[i].map(|v| positions[v as usize]);
        let boundary = if with_boundary {
            boundary_edges(positions.len(), triangles, meter)?
        } else {
            Vec::new()
        };
        let ends = |i: usize| {
            let [a, b]: [Vec3; 2] = boundary[i].map(|v: u32| positions[v as usize]);
            [a, b, b]
        };
        let total: f64 = (0..triangles.len())
            .map(|i| f64::from(area(&corners(i).map(|p| scaled(p, scale)))))
            .sum();
        meter.work(2 * triangles.len())?;
        let largest = positions
            .iter()
            .fold(0.0f32, |m, p| m.max(p.abs().max_element()));
        let noise = (f64::from(largest) * scale * f64::from(f32::EPSILON)) as f32;
        Ok(Self {
            cells: Cells::new(grid, triangles.len(), corners, meter)?,
            boundary_cells: Cells::new(grid, boundary.len(), ends, meter)?,
            boundary,
            typical: total / triangles.len().max(FEWEST).max(ON_A_FACE * target) as f64,
            noise_squared: noise * noise,
            arrays,
            scale,
        })
    }

    /// The number of faces.
    pub fn len(&self) -> usize {
        self.arrays.triangles.len()
    }

    /// The bytes held beside the arrays.
    pub fn bytes(&self) -> usize {
        self.cells.bytes()
            + self.boundary_cells.bytes()
            + self.boundary.capacity() * size_of::<[u32; 2]>()
    }

    fn at(&self, v: u32) -> Vec3 {
        scaled(self.arrays.positions[v as usize], self.scale)
    }
}

/// A position in the unit box.
pub(super) fn scaled(p: Vec3, scale: f64) -> Vec3 {
    (p.as_dvec3() * scale).as_vec3()
}

pub(super) fn area(&[a, b, c]: &[Vec3; 3]) -> f32 {
    (b - a).cross(c - a).length() / 2.0
}

/// The edges that one triangle alone has.
///
/// At a vertex inside, every neighbour stands in two of the triangles around: the exclusive or of
/// their numbers, each mixed, is zero. So only the triangles at other vertices are looked at in
/// earnest. Takes 4 bytes a vertex while it runs.
fn boundary_edges(
    vertices: usize,
    triangles: &[[u32; 3]],
    meter: &mut Meter,
) -> progress::Result<Vec<[u32; 2]>> {
    // Odd, so that numbers mix to different ones (Knuth 1998, vol. 3, 6.4); the high half is folded
    // in, so that no sum of four vanishes by their being neighbours.
    let mixed = |v: u32| {
        let product = (u64::from(v) + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        (product >> 32) as u32 ^ product as u32
    };
    let mut odd = vec![0u32; vertices];
    for block in triangles.chunks(BLOCK) {
        for &[a, b, c] in block {
            let [x, y, z] = [a, b, c].map(mixed);
            odd[a as usize] ^= y ^ z;
            odd[b as usize] ^= z ^ x;
            odd[c as usize] ^= x ^ y;
        }
        meter.work(block.len())?;
    }
    let is_odd = |v: u32| odd[v as usize] != 0;
    let mut edges = Vec::new();
    for block in triangles.chunks(BLOCK) {
        for &[a, b, c] in block {
            for [v, w] in [[a, b], [b, c], [c, a]] {
                if is_odd(v) && is_odd(w) {
                    edges.push([v.min(w), v.max(w)]);
                }
            }
        }
        meter.work(block.len())?;
    }
    edges.sort_unstable();
    meter.detour(2 * edges.len())?;
    let alone = edges.chunk_by(|a, b| a == b).filter(|same| same.len() == 1);
    Ok(alone.map(|same| same[0]).collect())
}

/// A piece of the original in the unit box: its faces and boundary edges, and samples on both.
///
/// A sample stands for a piece of area or, behind those, of boundary length: its weight. A face
/// stands in its centroid with ¾ and in its corners with ¼ of its area, which is exact for squared
/// distances that vary as the square; a boundary edge in its middle and ends by Simpson's rule.
#[derive(Default)]
pub struct Piece {
    pub(super) points: Vec<Vec3>,
    pub(super) weights: Vec<f32>,
    /// The direction that the surface faces at each sample; none on the boundary.
    pub(super) normals: Vec<Vec3>,
    /// A face at each sample that is none of the boundary's.
    pub(super) faces_at: Vec<u32>,
    /// Where the samples of the boundary begin.
    pub(super) boundary_begin: usize,
    /// The hierarchy over the faces, if anyone asked for it.
    faces: OnceLock<Patch>,
    /// The boundary edges, as degenerate triangles.
    pub(super) boundary: Patch,
    /// The vertices of each face, as the piece numbers them.
    corners: Vec<[u32; 3]>,
    /// The faces around each vertex, and where they begin.
    around: Vec<u32>,
    around_begins: Vec<u32>,
    /// The sample at each vertex.
    samples: Vec<u32>,
    /// The piece's number of each vertex of the original, while the piece is made.
    number_of: Vec<Option<Number>>,
}

impl Piece {
    /// Becomes what of the original lies near some boxes in model units.
    pub fn fill<I: Iterator<Item = [Vec3; 2]>>(
        &mut self,
        original: &Original,
        boxes: impl Fn() -> I,
        seen: &mut Seen,
    ) {
        let Arrays {
            positions,
            triangles,
        } = original.arrays;
        self.number_of.resize(positions.len(), None);
        self.points.clear();
        self.weights.clear();
        self.normals.clear();
        self.faces_at.clear();
        self.samples.clear();
        self.corners.clear();
        let near = original.cells.near(boxes(), seen);
        let triangle = |&i: &u32| triangles[i as usize].map(|v| original.at(v));
        self.faces = OnceLock::new();
        for (face, i) in (0u32..).zip(&near) {
            let corners = triangle(i);
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a);
            let area = f64::from(normal.length() / 2.0);
            let rows = (area / original.typical).sqrt().round().clamp(1.0, ROWS);
            let at_corner = area / (12.0 * rows);
            let mut numbers = [0; 3];
            for (k, v) in triangles[*i as usize].into_iter().enumerate() {
                let vertex = match self.number_of[v as usize] {
                    Some(vertex) => index(vertex),
                    None => {
                        self.number_of[v as usize] = Some(number(self.samples.len()));
                        self.samples.push(self.points.len() as u32);
                        self.push(corners[k], 0.0, Vec3::ZERO);
                        self.faces_at.push(face);
                        self.samples.len() - 1
                    }
                };
                let sample = self.samples[vertex] as usize;
                self.weights[sample] += at_corner as f32;
                self.normals[sample] += normal;
                numbers[k] = vertex as u32;
            }
            self.corners.push(numbers);
            let weight = (area - 3.0 * at_corner) / (rows * rows);
            if rows == 1.0 {
                self.push((a + b + c) / 3.0, weight as f32, normal);
            } else {
                for point in centroids(&corners, rows as usize) {
                    self.push(point, weight as f32, normal);
                }
            }
            self.faces_at.resize(self.points.len(), face);
        }
        for i in &near {
            for v in triangles[*i as usize] {
                self.number_of[v as usize] = None;
            }
        }
        self.list_around();
        self.boundary_begin = self.points.len();
        let near = original.boundary_cells.near(boxes(), seen);
        let ends = |&i: &u32| original.boundary[i as usize].map(|v| original.at(v));
        for [a, b] in near.iter().map(ends) {
            let length = a.distance(b);
            for (point, share) in [(a, 1.0 / 6.0), ((a + b) / 2.0, 2.0 / 3.0), (b, 1.0 / 6.0)] {
                self.push(point, length * share, Vec3::ZERO);
            }
        }
        let edge = |[a, b]: [Vec3; 2]| [a, b, b];
        self.boundary.fill(near.iter().map(ends).map(edge));
    }

    /// Lists the faces around each vertex.
    fn list_around(&mut self) {
        self.around_begins.clear();
        self.around_begins.resize(self.samples.len() + 1, 0);
        for v in self.corners.as_flattened() {
            self.around_begins[*v as usize + 1] += 1;
        }
        for v in 0..self.samples.len() {
            self.around_begins[v + 1] += self.around_begins[v];
        }
        self.around.clear();
        self.around.resize(3 * self.corners.len(), 0);
        for (f, corners) in self.corners.iter().enumerate().rev() {
            for v in corners {
                // From behind, so that each beginning is where it was when all are in.
                let end = &mut self.around_begins[*v as usize + 1];
                *end -= 1;
                self.around[*end as usize] = f as u32;
            }
        }
    }

    fn around(&self, v: u32) -> &[u32] {
        // The lists were filled from their ends down, each entry of the table now a beginning.
        let v = v as usize + 1;
        let end = self
            .around_begins
            .get(v + 1)
            .map_or(self.around.len(), |end| *end as usize);
        &self.around[self.around_begins[v] as usize..end]
    }

    #[inline(always)]
    fn triangle(&self, f: usize) -> [Vec3; 3] {
        let at = |v: u32| self.points[self.samples[v as usize] as usize];
        self.corners[f].map(at)
    }

    /// The distance from the original: by a walk, if one says from where and what it finds is nearer
    /// than `trusted`, squared; else by a search among all faces.
    pub(super) fn near(&self, point: Vec3, from: Option<u32>, trusted: f32) -> ToOriginal {
        let walked = from.map(|from| self.near_by(point, from));
        match walked {
            Some(walked) if walked.squared <= trusted => walked,
            _ => {
                let patch = || Patch::new((0..self.corners.len()).map(|f| self.triangle(f)));
                let guess = walked.and_then(|walked| walked.near);
                ToOriginal::of(point, self.faces.get_or_init(patch), guess)
            }
        }
    }

    /// The nearest point found by going from a face to its neighbours as long as those are nearer: a
    /// bound for the distance, and the distance itself unless the surface folds back within it.
    fn near_by(&self, point: Vec3, from: u32) -> ToOriginal {
        let p = point.as_dvec3();
        let foot = |f: u32| {
            let foot = foot_on_triangle(p, &self.triangle(f as usize).map(Vec3::as_dvec3));
            (foot.point.distance_squared(p), foot.weights)
        };
        let mut face = from;
        let (mut squared, mut weights) = foot(face);
        // Every step is nearer, so this ends.
        loop {
            let corners = self.corners[face as usize];
            // A side that the point lies across has its two ends; a corner, the faces around it.
            let Some(first) = (0..3).find(|&k| weights[k] > 0.0) else {
                break;
            };
            let others = (0..3).filter(|&k| k != first && weights[k] > 0.0);
            let mut others = others.map(|k| corners[k]);
            let (second, third) = (others.next(), others.next());
            if third.is_some() {
                break;
            }
            let here = face;
            for &beside in self.around(corners[first]) {
                let shares = second.is_none_or(|v| self.corners[beside as usize].contains(&v));
                if beside != here && shares {
                    let (there, weights_there) = foot(beside);
                    if there < squared {
                        (face, squared, weights) = (beside, there, weights_there);
                    }
                }
            }
            if face == here {
                break;
            }
        }
        ToOriginal {
            squared: squared as f32,
            near: Some(face),
        }
    }

    fn push(&mut self, point: Vec3, weight: f32, normal: Vec3) {
        self.points.push(point);
        self.weights.push(weight);
        self.normals.push(normal);
    }

    /// The bytes held.
    pub fn bytes(&self) -> usize {
        (self.points.capacity() + self.normals.capacity()) * size_of::<Vec3>()
            + (self.weights.capacity() + self.number_of.capacity()) * size_of::<f32>()
            + (self.around.capacity() + self.around_begins.capacity()) * size_of::<u32>()
            + (self.samples.capacity() + self.faces_at.capacity()) * size_of::<u32>()
            + self.corners.capacity() * size_of::<[u32; 3]>()
            + self.faces.get().map_or(0, Patch::bytes)
            + self.boundary.bytes()
    }
}

/// The centroids of the triangles that so many rows cut one into.
pub(super) fn centroids(&[a, b, c]: &[Vec3; 3], rows: usize) -> impl Iterator<Item = Vec3> {
    let n = 3.0 * rows as f32;
    let at = move |i: usize, j: usize, third: f32| {
        let (u, v) = ((3 * i) as f32 + third, (3 * j) as f32 + third);
        a + (b - a) * (u / n) + (c - a) * (v / n)
    };
    (0..rows).flat_map(move |i| {
        (0..rows - i).flat_map(move |j| {
            let upper = (i + j + 1 < rows).then(|| at(i, j, 2.0));
            std::iter::once(at(i, j, 1.0)).chain(upper)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::unheard;
    use crate::shapes;

    /// Four triangles: three corners' and the middle one, whose centroid is the whole's.
    #[test]
    fn rows_cut_a_triangle_into_their_square() {
        let triangle = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let middle = Vec3::new(1.0, 1.0, 0.0) / 3.0;
        for rows in 1..6 {
            let points: Vec<Vec3> = centroids(&triangle, rows).collect();
            assert_eq!(points.len(), rows * rows);
            let mean = points.iter().sum::<Vec3>() / points.len() as f32;
            assert!((mean - middle).length() < 1e-6);
        }
        let two: Vec<Vec3> = centroids(&triangle, 2).collect();
        assert!((two[1] - middle).length() < 1e-6);
    }

    /// The rim of a grid; nothing on a closed shape; three faces on an edge are no boundary.
    #[test]
    fn boundary_edges_have_one_triangle() {
        let count = |vertices, triangles: &[[u32; 3]]| {
            unheard(|meter| boundary_edges(vertices, triangles, meter)).len()
        };
        let (positions, triangles) = shapes::grid(5, 4);
        assert_eq!(count(positions.len(), &triangles), 18);
        let (positions, triangles) = shapes::icosphere(2);
        assert_eq!(count(positions.len(), &triangles), 0);
        let fins = [[0, 1, 2], [1, 0, 3], [0, 1, 4]];
        assert_eq!(count(5, &fins), 6);
    }
}
