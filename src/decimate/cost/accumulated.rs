//! The *fast* cost: quadrics of the original's planes, added up (Garland & Heckbert 1997), with
//! area weights and boundary lines.

use glam::DVec3;
use wide::f32x4;

use super::form::{Form, Least, Number, dot, plus};
use super::{
    BOUNDARY_WEIGHT, Cost, Evaluation, LANES, LINE_WEIGHT, between, boundary_weight, doubles, each,
    places, singular_weight,
};
use crate::decimate::options::{Options, Placement};
use crate::decimate::queue::LazyHeap;
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

/// Where the energy of two quadrics' vertices is least, `along` the edge from the first to the second.
#[inline(always)]
fn least<T: Number>(
    at_v: &[T; 10],
    at_w: &[T; 10],
    along: [T; 3],
    placement: Placement,
) -> Least<T> {
    let [xx, xy, xz, yy, yz, zz, bx, by, bz, c_v] = *at_v;
    let (a_v, b_v) = ([xx, xy, xz, yy, yz, zz], [bx, by, bz]);
    let [xx, xy, xz, yy, yz, zz, bx, by, bz, c_w] = *at_w;
    let (a_w, b_w) = ([xx, xy, xz, yy, yz, zz], [bx, by, bz]);
    let mut form = Form::of_ends(&a_v, &a_w, along);
    form.b = plus(&form.b, &plus(&b_v, &b_w));
    let b_along = dot(&b_w, &form.along);
    form.at_tail = form.at_tail + (b_along + b_along) + (c_v + c_w);
    let as_good = match placement {
        Placement::Optimal => AS_GOOD,
        // Nothing is better than the better end.
        Placement::Endpoint => f64::INFINITY,
    };
    form.compared(&form.least_near_middle(), as_good)
}

/// The accumulated cost.
pub struct Accumulated {
    quadrics: Vec<Quadric>,
    placement: Placement,
}

/// Four of a quadric's numbers.
#[inline(always)]
fn part(quadric: &Quadric, first: usize) -> f32x4 {
    f32x4::new(*quadric.0[first..].first_chunk().expect("ten numbers"))
}

impl Accumulated {
    /// The numbers of vertices' quadrics.
    #[inline(always)]
    fn numbers(&self, vertices: [VertexId; LANES]) -> [f32x4; 10] {
        let quadrics = each(vertices, |v| &self.quadrics[v.index()]);
        let parts = |i| f32x4::transpose(each(quadrics, |quadric| part(quadric, i)));
        let ([a, b, c, d], [e, f, g, h], [_, _, i, j]) = (parts(0), parts(4), parts(6));
        [a, b, c, d, e, f, g, h, i, j]
    }
}

impl<S: EdgeStore> Cost<S> for Accumulated {
    /// Costs only grow: what an edge cost once is a lower bound.
    const IS_LAZY: bool = true;

    type Queue = LazyHeap;
    type State = Quadric;

    fn new(surface: &Surface<S>, options: &Options) -> Self {
        let (mesh, geometry) = (&surface.mesh, &surface.geometry);
        let mut sums = vec![Symmetric::default(); mesh.vertex_slots()];
        let boundary = boundary_weight(options.boundary);
        for f in mesh.faces() {
            let corners = mesh.face_vertices(f);
            let [a, b, c] = corners.map(|v| geometry.position(v));
            let normal = geometry
                .vector(a, corners[1])
                .cross(geometry.vector(a, corners[2]));
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
                let of_singular =
                    || singular_weight(mesh, e, boundary).filter(|_| !surface.is_rim(e));
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
    fn evaluate(&self, surface: &Surface<S>, e: EdgeId, held: [bool; 2]) -> Option<Evaluation> {
        let [v, w] = surface.mesh.edge_vertices(e);
        let along = surface.geometry.between(v, w).to_array();
        let at_v = doubles(&self.quadrics[v.index()].0);
        let at_w = doubles(&self.quadrics[w.index()].0);
        let least = least(&at_v, &at_w, along, self.placement);
        least.evaluation(surface, [v, w], held, self.placement)
    }

    #[inline]
    fn costs(&self, surface: &Surface<S>, edges: &[EdgeId; LANES]) -> [f32; LANES] {
        let tails = each(*edges, |e| surface.mesh.tail(e));
        let heads = each(*edges, |e| surface.mesh.head(e));
        let scale = f32x4::splat(surface.geometry.scale() as f32);
        let along = between(&places(surface, tails), &places(surface, heads), scale);
        let (at_tail, at_head) = (self.numbers(tails), self.numbers(heads));
        let least = least(&at_tail, &at_head, along, self.placement);
        least.costs().to_array()
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
