//! What a collapse costs and where its vertex goes.
//!
//! The *standard* cost is memoryless (Lindstrom & Turk 1998, 1999): a vertex carries a tensor of
//! the planes and lines that meet at it now, and nothing of the original, so it works on any
//! intermediate mesh. A volume constraint keeps the surface from shrinking.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::geometry::Geometry;
use super::options::{Boundary, Placement};
use crate::mesh::{Collapse, EdgeId, EdgeStore, Mesh, Opposite, VertexId};

/// A collapse's cost, in the unit box, and where its vertex goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evaluation {
    /// Squared distances times areas, in the unit box.
    pub cost: f64,
    /// The stored position of the vertex that is left.
    pub position: Vec3,
}

/// A cost model: owns its state and follows the collapses.
pub trait Cost<S: EdgeStore>: Sync {
    /// The collapse of `e` with its tail or head held in place; nothing where both are held.
    fn evaluate(
        &self,
        mesh: &Mesh<S>,
        geometry: &Geometry,
        e: EdgeId,
        held: [bool; 2],
    ) -> Option<Evaluation>;

    /// Brings the state up to date after a collapse, and lists the vertices whose edges cost
    /// something else now.
    fn after_collapse(
        &mut self,
        mesh: &Mesh<S>,
        geometry: &Geometry,
        collapse: &Collapse,
        changed: &mut Vec<VertexId>,
    );

    /// The bytes that the state holds.
    fn bytes(&self) -> usize;
}

/// The weight of lines against planes: Lindstrom & Turk's ½ for boundaries and ⅓·⅓ for volume
/// bring lengths and areas to one scale; measured with it, 1 to 4 make no difference.
const LINE_WEIGHT: f64 = 2.25;

/// The weight of a boundary edge. 1 ties Lindstrom & Turk on the boundary; 16 makes the boundary's
/// error 2 to 6 times smaller for 0 to 4 % of surface rms.
const BOUNDARY_WEIGHT: f64 = 8.0;

/// The weight of a fold. Without it a thin double sheet is free to eat: one mesh 1.68 → 0.91 of the
/// best peer's rms at 2 %.
const FOLD_WEIGHT: f64 = 0.3;

/// Edges flatter than this, as (1 − cos θ)/2, are no folds.
const FLAT: f64 = 0.05;

/// The ridge against singular tensors, relative to the trace. Larger ones cost rms on CAD parts.
const RIDGE: f64 = 1e-8;

/// The squared length that the sum of a star's normals must have for the volume constraint to say
/// something, relative to the squared trace: below, the star is a folded sheet.
const CONSTRAINED: f64 = 3e-7;

/// Squared edge length enters with this weight, so that ties in flat regions go to short edges.
const TIE_BREAK: f64 = 1e-12;

/// How far the optimum may lie from the middle, in lengths of the edge.
const REACH: f64 = 3.0;

/// By how much an end may cost more than the optimum and still be taken, relative to the tensor's
/// trace times the squared edge length: single precision's noise in the tensors.
const AS_GOOD: f64 = 1e-7;

/// The planes and lines at a vertex: Σ n nᵀ/(2|n|) and line terms, and Σ n, with n twice a face's
/// area long. 36 bytes; no linear or constant term, since every plane and line passes through the
/// vertex.
#[derive(Clone, Copy, Debug, Default)]
struct Tensor {
    quadratic: [f32; 6],
    area: [f32; 3],
}

impl Tensor {
    fn area(&self) -> DVec3 {
        Vec3::from(self.area).as_dvec3()
    }
}

/// A symmetric 3×3 matrix: xx, xy, xz, yy, yz, zz.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Symmetric([f64; 6]);

impl Symmetric {
    fn from_single(m: [f32; 6]) -> Self {
        Self(m.map(f64::from))
    }

    /// Adds w·v vᵀ.
    #[inline(always)]
    fn add_outer(&mut self, v: DVec3, w: f64) {
        let s = v * w;
        let terms = [
            s.x * v.x,
            s.x * v.y,
            s.x * v.z,
            s.y * v.y,
            s.y * v.z,
            s.z * v.z,
        ];
        for (m, t) in self.0.iter_mut().zip(terms) {
            *m += t;
        }
    }

    /// Adds w·(|d|² I − d dᵀ): the squared distance from the line along d, times w·|d|².
    #[inline(always)]
    fn add_line(&mut self, d: DVec3, w: f64) {
        let squared = w * d.length_squared();
        self.add_outer(d, -w);
        for i in [0, 3, 5] {
            self.0[i] += squared;
        }
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }

    #[inline(always)]
    fn trace(&self) -> f64 {
        self.0[0] + self.0[3] + self.0[5]
    }

    #[inline(always)]
    fn times(&self, v: DVec3) -> DVec3 {
        let [xx, xy, xz, yy, yz, zz] = self.0;
        DVec3::new(
            xx * v.x + xy * v.y + xz * v.z,
            xy * v.x + yy * v.y + yz * v.z,
            xz * v.x + yz * v.y + zz * v.z,
        )
    }
}

/// L D Lᵀ of a positive definite symmetric matrix. Stable where the adjugate is not: the ridge is
/// eight digits below the trace.
struct Factor {
    l10: f64,
    l20: f64,
    l21: f64,
    inverse_d: DVec3,
}

impl Factor {
    #[inline(always)]
    fn of(m: &Symmetric, ridge: f64) -> Option<Self> {
        let [xx, xy, xz, yy, yz, zz] = m.0;
        let d0 = xx + ridge;
        let inverse_d0 = d0.recip();
        let l10 = xy * inverse_d0;
        let l20 = xz * inverse_d0;
        let d1 = yy + ridge - l10 * xy;
        let inverse_d1 = d1.recip();
        let s21 = yz - l20 * xy;
        let l21 = s21 * inverse_d1;
        let d2 = zz + ridge - l20 * xz - l21 * s21;
        let is_positive = d0 > 0.0 && d1 > 0.0 && d2 > 0.0;
        is_positive.then(|| Self {
            l10,
            l20,
            l21,
            inverse_d: DVec3::new(inverse_d0, inverse_d1, d2.recip()),
        })
    }

    #[inline(always)]
    fn solve(&self, b: DVec3) -> DVec3 {
        let y = b.y - self.l10 * b.x;
        let z = b.z - self.l20 * b.x - self.l21 * y;
        let scaled = DVec3::new(b.x, y, z) * self.inverse_d;
        let y = scaled.y - self.l21 * scaled.z;
        let x = scaled.x - self.l10 * y - self.l20 * scaled.z;
        DVec3::new(x, y, scaled.z)
    }
}

/// How far a busy vertex's tensor may lag behind the faces around it, so that a vertex of valence
/// 100 000 does not cost 100 000 faces for each collapse on its rim.
#[derive(Clone, Copy, Debug, Default)]
struct Lag {
    /// The changes around the vertex that pass before its tensor is computed again: one for every
    /// [`BUSY`] faces, none below.
    every: u16,
    /// How many of them are left.
    left: u16,
}

/// A vertex with this many faces or more may lag behind by one in as many of them.
const BUSY: usize = 24;

/// A vertex that lags by this many changes (with 192 faces or more) stays where it is when a
/// collapse takes a neighbour in: moving it would turn faces all around it.
const HEAVY: u16 = 8;

/// The memoryless, volume-constrained cost.
pub struct Memoryless {
    tensors: Vec<Tensor>,
    lag: Vec<Lag>,
    boundary_weight: f64,
    placement: Placement,
}

impl Memoryless {
    /// The model's state for a mesh, computed in parallel: 40 bytes a vertex.
    pub fn new<S: EdgeStore>(
        mesh: &Mesh<S>,
        geometry: &Geometry,
        boundary: Boundary,
        placement: Placement,
    ) -> Self {
        let boundary_weight = match boundary {
            Boundary::Keep | Boundary::Lock => BOUNDARY_WEIGHT,
            Boundary::Free => 0.0,
        };
        let slots = mesh.vertex_slots();
        let mut model = Self {
            tensors: Vec::new(),
            lag: Vec::new(),
            boundary_weight,
            placement,
        };
        let tensor = |v| model.tensor(mesh, geometry, VertexId::new(v));
        (model.tensors, model.lag) = (0..slots).into_par_iter().map(tensor).unzip();
        model
    }

    /// The tensor of `v` from the faces around it now, and how far it may lag behind them.
    fn tensor<S: EdgeStore>(
        &self,
        mesh: &Mesh<S>,
        geometry: &Geometry,
        v: VertexId,
    ) -> (Tensor, Lag) {
        let point = geometry.position(v);
        let mut quadratic = Symmetric::default();
        let mut area = DVec3::ZERO;
        let mut faces = 0;
        for start in mesh.fans(v) {
            let mut first = None;
            let mut last = None;
            let mut end = start;
            for e in mesh.fan(start) {
                let along = geometry.vector(point, mesh.head(e));
                let before = mesh.prev(e);
                let normal = along.cross(geometry.vector(point, mesh.tail(before)));
                let length = normal.length();
                if length > 0.0 {
                    quadratic.add_outer(normal, 0.5 / length);
                    area += normal;
                }
                let side = Side { normal, length };
                if let Some(previous) = last {
                    add_fold(&mut quadratic, along, previous, side);
                }
                first.get_or_insert((along, side));
                last = Some(side);
                end = before;
                faces += 1;
            }
            let (Some((along, side)), Some(last)) = (first, last) else {
                continue;
            };
            if mesh.mate(start).is_some() {
                add_fold(&mut quadratic, along, last, side);
            } else {
                self.add_singular(&mut quadratic, mesh, start, along);
                let along = geometry.vector(point, mesh.tail(end));
                self.add_singular(&mut quadratic, mesh, end, along);
            }
        }
        let tensor = Tensor {
            quadratic: quadratic.0.map(|x| x as f32),
            area: area.as_vec3().to_array(),
        };
        let every = (faces / BUSY).min(u16::MAX.into()) as u16;
        (tensor, Lag { every, left: every })
    }

    /// Adds the line of a boundary or non-manifold edge; the latter ends several fans and is added
    /// once, where its first directed edge stands.
    #[inline]
    fn add_singular<S: EdgeStore>(
        &self,
        quadratic: &mut Symmetric,
        mesh: &Mesh<S>,
        e: EdgeId,
        along: DVec3,
    ) {
        let weight = match mesh.opposite(e) {
            Opposite::Edge(_) => return,
            Opposite::Boundary => self.boundary_weight,
            Opposite::NonManifold(_) if mesh.canonical(e) == e => BOUNDARY_WEIGHT,
            Opposite::NonManifold(_) => return,
        };
        quadratic.add_line(along, LINE_WEIGHT * weight);
    }

    fn refresh<S: EdgeStore>(&mut self, mesh: &Mesh<S>, geometry: &Geometry, v: VertexId) {
        (self.tensors[v.index()], self.lag[v.index()]) = self.tensor(mesh, geometry, v);
    }
}

#[derive(Clone, Copy)]
struct Side {
    normal: DVec3,
    length: f64,
}

/// Adds the line of the edge between two faces if they fold there.
#[inline(always)]
fn add_fold(quadratic: &mut Symmetric, along: DVec3, a: Side, b: Side) {
    let lengths = a.length * b.length;
    if lengths > 0.0 {
        let fold = (1.0 - a.normal.dot(b.normal) / lengths) * 0.5;
        if fold >= FLAT {
            quadratic.add_line(along, LINE_WEIGHT * FOLD_WEIGHT * fold * fold);
        }
    }
}

impl<S: EdgeStore> Cost<S> for Memoryless {
    fn evaluate(
        &self,
        mesh: &Mesh<S>,
        geometry: &Geometry,
        e: EdgeId,
        held: [bool; 2],
    ) -> Option<Evaluation> {
        let [v, w] = mesh.edge_vertices(e);
        let (at_v, at_w) = (&self.tensors[v.index()], &self.tensors[w.index()]);
        let (quadratic_v, quadratic_w) = (
            Symmetric::from_single(at_v.quadratic),
            Symmetric::from_single(at_w.quadratic),
        );
        // E(y) = yᵀMy − 2bᵀy + hᵀMh, with y from the middle and the ends at ±h.
        let half = geometry.between(w, v) * 0.5;
        let m = quadratic_v.plus(quadratic_w);
        let b = quadratic_v.times(half) - quadratic_w.times(half);
        let at_middle = half.dot(m.times(half));
        let energy = |y: DVec3| y.dot(m.times(y)) - 2.0 * b.dot(y) + at_middle;
        let at_half = b.dot(half);
        let (energy_v, energy_w) = (2.0 * (at_middle - at_half), 2.0 * (at_middle + at_half));
        let length_squared = 4.0 * half.length_squared();

        let heavy = [v, w].map(|v| self.lag[v.index()].every >= HEAVY);
        let held = if held == [false; 2] && heavy != [true; 2] {
            heavy
        } else {
            held
        };
        let ends = match held {
            [true, true] => return None,
            [true, false] => (energy_v, geometry.position(v)),
            [false, true] => (energy_w, geometry.position(w)),
            [false, false] if energy_v <= energy_w => (energy_v, geometry.position(v)),
            [false, false] => (energy_w, geometry.position(w)),
        };
        let (energy, position) = if held != [false; 2] || self.placement == Placement::Endpoint {
            ends
        } else {
            let trace = m.trace();
            let optimum = Factor::of(&m, RIDGE * trace)
                .map(|factor| {
                    let mut y = factor.solve(b);
                    let g = self.area_around(mesh, geometry, e);
                    if g.length_squared() > CONSTRAINED * trace * trace {
                        let k = (at_v.area() - at_w.area()).dot(half);
                        let direction = factor.solve(g);
                        y += direction * ((k - g.dot(y)) / g.dot(direction));
                    }
                    y
                })
                .filter(|y| y.length_squared() <= REACH * REACH * length_squared);
            let y = optimum.unwrap_or(DVec3::ZERO);
            let at_y = energy(y);
            if ends.0 <= at_y + AS_GOOD * trace * length_squared {
                ends
            } else {
                (at_y, geometry.point_near_middle(v, w, y))
            }
        };
        let cost = energy.max(0.0) + TIE_BREAK * length_squared;
        (cost.is_finite() && position.is_finite()).then_some(Evaluation { cost, position })
    }

    fn after_collapse(
        &mut self,
        mesh: &Mesh<S>,
        geometry: &Geometry,
        collapse: &Collapse,
        changed: &mut Vec<VertexId>,
    ) {
        changed.clear();
        changed.push(collapse.kept);
        self.refresh(mesh, geometry, collapse.kept);
        changed.extend(mesh.neighbours(collapse.kept));
        if mesh.is_non_manifold_vertex(collapse.kept) {
            // A vertex where many fans end is met once for each.
            changed[1..].sort_unstable();
            changed.dedup();
        }
        let mut is_first = true;
        changed.retain(|x| {
            let lag = &mut self.lag[x.index()];
            let waits = lag.left > 0 && !is_first;
            lag.left -= u16::from(waits);
            is_first = false;
            !waits
        });
        for &x in &changed[1..] {
            self.refresh(mesh, geometry, x);
        }
    }

    fn bytes(&self) -> usize {
        self.tensors.capacity() * size_of::<Tensor>() + self.lag.capacity() * size_of::<Lag>()
    }
}

impl Memoryless {
    /// The sum of the normals around both ends, the faces at `e` counted once; nothing at a
    /// non-manifold edge, which encloses no one volume.
    fn area_around<S: EdgeStore>(&self, mesh: &Mesh<S>, geometry: &Geometry, e: EdgeId) -> DVec3 {
        let [v, w] = mesh.edge_vertices(e);
        let around = self.tensors[v.index()].area() + self.tensors[w.index()].area();
        match mesh.opposite(e) {
            Opposite::Edge(o) => around - geometry.normal(mesh, e) - geometry.normal(mesh, o),
            Opposite::Boundary => around - geometry.normal(mesh, e),
            Opposite::NonManifold(_) => DVec3::ZERO,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A nearly singular matrix, eight digits between its eigenvalues, is solved to eight digits.
    #[test]
    fn the_factor_solves_badly_conditioned_systems() {
        let mut m = Symmetric::default();
        m.add_outer(DVec3::new(0.6, -0.48, 0.64), 1.0);
        let ridge = 1e-8;
        let x = DVec3::new(3.0, -1.0, 2.0);
        let b = m.times(x) + x * ridge;
        let solved = Factor::of(&m, ridge).unwrap().solve(b);
        assert!((solved - x).length() < 1e-6, "{solved}");
    }

    /// The line term is the squared distance from the line times the squared length.
    #[test]
    fn a_line_measures_the_distance_from_it() {
        let mut m = Symmetric::default();
        m.add_line(DVec3::new(0.0, 0.0, 2.0), 1.5);
        let p = DVec3::new(3.0, 4.0, 77.0);
        assert!((p.dot(m.times(p)) - 1.5 * 4.0 * 25.0).abs() < 1e-9);
    }
}
