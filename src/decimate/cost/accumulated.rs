//! The *fast* cost: quadrics of the original's planes, added up (Garland & Heckbert 1997), with
//! area weights and boundary lines.

use glam::{DVec3, Vec3};

use super::form::{Form, Lanes, dot, plus};
use super::{
    BOUNDARY_WEIGHT, Choice, Cost, Evaluation, LANES, LINE_WEIGHT, boundary_weight, singular_weight,
};
use crate::decimate::options::{Options, Placement};
use crate::decimate::queue::Buckets;
use crate::decimate::surface::{Merged, Surface};
use crate::decimate::symmetric::Symmetric;
use crate::mesh::{Collapse, EdgeId, EdgeStore, VertexId};

/// The squared distances from the planes and lines that have met at a vertex: yᵀAy − 2bᵀy + c with
/// y from the vertex, where single precision has all its digits. 40 bytes.
///
/// The six numbers of A, three of b, and c.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quadric([f32; 10]);

impl Quadric {
    fn new(a: Symmetric, b: DVec3, c: f64) -> Self {
        let [xx, xy, xz, yy, yz, zz] = a.0;
        Self([xx, xy, xz, yy, yz, zz, b.x, b.y, b.z, c].map(|x| x as f32))
    }

    /// A, b and c as seen from a point at `d` from the vertex.
    #[inline(always)]
    fn seen_from(&self, d: DVec3) -> (Symmetric, DVec3, f64) {
        let [xx, xy, xz, yy, yz, zz, x, y, z, c] = self.0.map(f64::from);
        let (a, b) = (Symmetric([xx, xy, xz, yy, yz, zz]), DVec3::new(x, y, z));
        let along = a.times(d);
        (a, b - along, c - 2.0 * b.dot(d) + d.dot(along))
    }
}

/// By how much an end may cost more than the optimum and still be taken, relative to the tensor's
/// trace times the squared edge length: single precision's noise.
const AS_GOOD: f64 = 1e-6;

/// The numbers of all lanes, from each lane's.
#[inline(always)]
fn transposed<const N: usize>(lanes: [[f32; N]; LANES]) -> [Lanes; N] {
    std::array::from_fn(|i| Lanes::from([lanes[0][i], lanes[1][i], lanes[2][i], lanes[3][i]]))
}

/// The accumulated cost.
pub struct Accumulated {
    quadrics: Vec<Quadric>,
    placement: Placement,
}

impl<S: EdgeStore> Cost<S> for Accumulated {
    type Queue = Buckets;
    type State = Quadric;

    fn new(surface: &Surface<S>, options: &Options) -> Self {
        let (mesh, geometry) = (&surface.mesh, &surface.geometry);
        let mut sums = vec![Symmetric::default(); mesh.vertex_slots()];
        let boundary = boundary_weight(options.boundary);
        for f in mesh.faces() {
            let corners = mesh.face_vertices(f);
            let [a, b, c] = corners.map(|v| geometry.position(v));
            let normal = geometry.vector(a, corners[1]).cross(geometry.vector(a, corners[2]));
            let length = normal.length();
            if length > 0.0 {
                let mut plane = Symmetric::default();
                plane.add_outer(normal, 0.5 / length);
                for v in corners {
                    sums[v.index()] = sums[v.index()].plus(plane);
                }
            }
            for (e, along) in f.edges().into_iter().zip([b - a, c - b, a - c]) {
                if mesh.mate(e).is_some() && surface.creases.is_empty() {
                    continue;
                }
                // A crease is met from both of its faces.
                let of_crease = Some(BOUNDARY_WEIGHT / 2.0).filter(|_| surface.is_crease(e));
                let of_singular = || singular_weight(mesh, e, boundary).filter(|_| !surface.is_rim(e));
                if let Some(weight) = of_crease.or_else(of_singular) {
                    let along = along.as_dvec3() * geometry.scale();
                    for v in mesh.edge_vertices(e) {
                        sums[v.index()].add_line(along, LINE_WEIGHT * weight);
                    }
                }
            }
        }
        let quadric = |(v, sum): (usize, Symmetric)| {
            let weight = surface.weight(VertexId::new(v));
            Quadric::new(Symmetric(sum.0.map(|x| x * weight)), DVec3::ZERO, 0.0)
        };
        Self {
            quadrics: sums.into_iter().enumerate().map(quadric).collect(),
            placement: options.placement,
        }
    }

    fn with_states(_: &Surface<S>, options: &Options, states: Vec<Quadric>) -> Self {
        Self {
            quadrics: states,
            placement: options.placement,
        }
    }

    fn into_states(self) -> Vec<Quadric> {
        self.quadrics
    }

    fn line(options: &Options, along: DVec3, is_boundary: bool) -> Quadric {
        let weight = if is_boundary {
            boundary_weight(options.boundary)
        } else {
            BOUNDARY_WEIGHT
        };
        let mut a = Symmetric::default();
        a.add_line(along, LINE_WEIGHT * weight);
        Quadric::new(a, DVec3::ZERO, 0.0)
    }

    fn join(state: &mut Quadric, part: &Quadric) {
        state.0 = std::array::from_fn(|i| state.0[i] + part.0[i]);
    }

    #[inline]
    fn evaluate(
        &self,
        surface: &Surface<S>,
        edges: &[EdgeId; LANES],
        held: &[[bool; 2]; LANES],
    ) -> [Option<Evaluation>; LANES] {
        let ends = edges.map(|e| surface.mesh.edge_vertices(e));
        let at = |end: usize| ends.map(|ends| surface.geometry.position(ends[end]).to_array());
        let (from, to): ([Lanes; 3], [Lanes; 3]) = (transposed(at(0)), transposed(at(1)));
        let scale = Lanes::splat(surface.geometry.scale() as f32);
        let along = std::array::from_fn(|i| (to[i] - from[i]) * scale);
        let numbers = |end: usize| transposed(ends.map(|ends| self.quadrics[ends[end].index()].0));
        let (at_v, at_w): ([Lanes; 10], [Lanes; 10]) = (numbers(0), numbers(1));
        let [xx, xy, xz, yy, yz, zz, bx, by, bz, c_v] = at_v;
        let (a_v, b_v) = ([xx, xy, xz, yy, yz, zz], [bx, by, bz]);
        let [xx, xy, xz, yy, yz, zz, bx, by, bz, c_w] = at_w;
        let (a_w, b_w) = ([xx, xy, xz, yy, yz, zz], [bx, by, bz]);
        let mut form = Form::of_ends(&a_v, &a_w, along);
        form.b = plus(&form.b, &plus(&b_v, &b_w));
        let b_along = dot(&b_w, &form.along);
        form.at_tail = form.at_tail + (b_along + b_along) + (c_v + c_w);
        let least = form.compared(&form.least_near_middle(), AS_GOOD);
        let [x, y, z] = least.x.map(Lanes::to_array);
        let [at_tail, at_head, at_x, length_squared] =
            [least.at_tail, least.at_head, least.at_x, least.length_squared].map(Lanes::to_array);
        let [x_is_better, head_is_better] =
            [least.x_is_better, least.head_is_better].map(Lanes::to_bitmask);
        std::array::from_fn(|i| {
            let choice = Choice {
                x_is_better: x_is_better >> i & 1 != 0,
                head_is_better: head_is_better >> i & 1 != 0,
                energies: [at_tail[i].into(), at_head[i].into(), at_x[i].into()],
                x: Vec3::new(x[i], y[i], z[i]).as_dvec3(),
                length_squared: length_squared[i].into(),
            };
            choice.evaluation(surface, ends[i], held[i], self.placement)
        })
    }

    fn after_collapse(
        &mut self,
        surface: &Surface<S>,
        merged: &Merged,
        changed: &mut Vec<VertexId>,
    ) {
        let Collapse { kept, removed, .. } = merged.collapse;
        let sum = [removed, kept]
            .into_iter()
            .zip(merged.from)
            .map(|(v, from)| {
                let moved = surface.geometry.vector(from, kept);
                self.quadrics[v.index()].seen_from(moved)
            })
            .reduce(|(a, b, c), (a2, b2, c2)| (a.plus(a2), b + b2, c + c2));
        let (a, b, c) = sum.expect("two ends");
        self.quadrics[kept.index()] = Quadric::new(a, b, c.max(0.0));
        changed.clear();
        changed.push(kept);
    }

    fn after_change(
        &mut self,
        _: &Surface<S>,
        cut: [[VertexId; 2]; 3],
        changed: &mut Vec<VertexId>,
    ) {
        for [old, new] in cut {
            self.quadrics[new.index()] = self.quadrics[old.index()];
        }
        changed.clear();
        changed.extend(cut.as_flattened());
    }

    fn exact_below(&self) -> usize {
        usize::MAX
    }

    fn moves_vertices(&self) -> bool {
        self.placement == Placement::Optimal
    }

    fn bytes(&self) -> usize {
        self.quadrics.capacity() * size_of::<Quadric>()
    }
}
