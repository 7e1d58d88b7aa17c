//! The *fast* cost: quadrics of the original's planes, added up (Garland & Heckbert 1997), with
//! area weights and boundary lines.

use glam::{DVec3, Vec3};
use wide::f32x4;

use super::attributes::{AttributeForms, carried, corrected};
use super::form::{Form, Least, Number, cross, dot, plus};
use super::{
    BOUNDARY_WEIGHT, Cost, Evaluation, LANES, LINE_WEIGHT, between, boundary_weight, crease_weight,
    doubles, each, list_touched, part, places, singular_weight,
};
use crate::decimate::options::{Options, Placement};
use crate::decimate::queue::LazyHeap;
use crate::decimate::surface::{Merged, Surface};
use crate::decimate::symmetric::Symmetric;
use crate::decimate::wedges::Carried;
use crate::mesh::{BUSY, Collapse, EdgeId, EdgeStore, FaceId, VertexId};
use crate::progress::{self, Meter};

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

    #[inline]
    fn add(&mut self, other: &Self) {
        for (number, &term) in self.0.iter_mut().zip(&other.0) {
            *number += term;
        }
    }

    /// A, b and c as seen from a point at `d` from the vertex.
    #[inline(always)]
    fn seen_from(&self, d: DVec3) -> (Symmetric, DVec3, f64) {
        let [xx, xy, xz, yy, yz, zz, x, y, z, c] = doubles(&self.0);
        let (a, b) = (Symmetric([xx, xy, xz, yy, yz, zz]), DVec3::new(x, y, z));
        let along = a.times(d);
        (a, b - along, c - 2.0 * b.dot(d) + d.dot(along))
    }
}

/// By how much an end may cost more than the optimum and still be taken, relative to the tensor's
/// trace times the squared edge length: single precision's noise.
const AS_GOOD: f64 = 1e-6;

/// Where the energy of two quadrics' vertices is least, `along` the edge from the first to the second.
/// `add` adds what is not of planes and lines.
#[inline(always)]
fn least<T: Number>(
    at_v: &[T; 10],
    at_w: &[T; 10],
    along: [T; 3],
    placement: Placement,
    add: impl FnOnce(&mut Form<T>),
) -> Least<T> {
    let [xx, xy, xz, yy, yz, zz, bx, by, bz, c_v] = *at_v;
    let (a_v, b_v) = ([xx, xy, xz, yy, yz, zz], [bx, by, bz]);
    let [xx, xy, xz, yy, yz, zz, bx, by, bz, c_w] = *at_w;
    let (a_w, b_w) = ([xx, xy, xz, yy, yz, zz], [bx, by, bz]);
    let mut form = Form::of_ends(&a_v, &a_w, along);
    form.b = plus(&form.b, &plus(&b_v, &b_w));
    let b_along = dot(&b_w, &form.along);
    form.at_tail = form.at_tail + (b_along + b_along) + (c_v + c_w);
    add(&mut form);
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
    attributes: Option<AttributeForms>,
    placement: Placement,
}

/// Adds the planes of the first faces of four to their corners' quadrics.
#[inline]
fn add_planes<S: EdgeStore>(
    surface: &Surface<S>,
    faces: [FaceId; LANES],
    count: usize,
    quadrics: &mut [Quadric],
) {
    let corners = each(faces, |f| surface.mesh.face_vertices(f));
    let scale = f32x4::splat(surface.geometry.scale() as f32);
    let at = |k: usize| places(surface, each(corners, |corners| corners[k]));
    let (a, b, c) = (at(0), at(1), at(2));
    let normal = cross(&between(&a, &b, scale), &between(&a, &c, scale));
    let length = dot(&normal, &normal).sqrt();
    let [x, y, z] = normal;
    let weight = (f32x4::HALF / length) & length.simd_gt(f32x4::ZERO);
    let [wx, wy, wz] = [x * weight, y * weight, z * weight];
    let first = f32x4::transpose([wx * x, wx * y, wx * z, wy * y]);
    let second = f32x4::transpose([wy * z, wz * z, f32x4::ZERO, f32x4::ZERO]);
    let planes = first.into_iter().zip(second);
    for (corners, (first, second)) in corners.into_iter().zip(planes).take(count) {
        for v in corners {
            let quadric = &mut quadrics[v.index()].0;
            for (i, terms) in [(0, first), (4, second)] {
                let numbers: &mut [f32; 4] = quadric[i..].first_chunk_mut().expect("ten numbers");
                *numbers = (f32x4::new(*numbers) + terms).to_array();
            }
        }
    }
}

impl Accumulated {
    /// The numbers of vertices' quadrics.
    #[inline(always)]
    fn numbers(&self, vertices: [VertexId; LANES]) -> [f32x4; 10] {
        let quadrics = each(vertices, |v| &self.quadrics[v.index()].0);
        let ([a, b, c, d], [e, f, g, h], [_, _, i, j]) =
            (part(quadrics, 0), part(quadrics, 4), part(quadrics, 6));
        [a, b, c, d, e, f, g, h, i, j]
    }

    /// [`costs`](Cost::costs); `add` adds what is not of planes and lines.
    #[inline(always)]
    fn together<S: EdgeStore>(
        &self,
        surface: &Surface<S>,
        edges: &[EdgeId; LANES],
        add: impl FnOnce(&mut Form<f32x4>),
    ) -> [f32; LANES] {
        let tails = each(*edges, |e| surface.mesh.tail(e));
        let heads = each(*edges, |e| surface.mesh.head(e));
        let scale = f32x4::splat(surface.geometry.scale() as f32);
        let along = between(&places(surface, tails), &places(surface, heads), scale);
        let (at_tail, at_head) = (self.numbers(tails), self.numbers(heads));
        let least = least(&at_tail, &at_head, along, self.placement, add);
        least.costs().to_array()
    }

    /// [`costs`](Cost::costs), apart from where there are no attributes, which it would slow down.
    #[inline(never)]
    fn with_attributes<S: EdgeStore>(
        &self,
        attributes: &AttributeForms,
        surface: &Surface<S>,
        edges: &[EdgeId; LANES],
    ) -> [f32; LANES] {
        let alone = |e| {
            let evaluation = self.evaluate(surface, e, [false; 2]);
            evaluation.map_or(f32::NAN, |evaluation| evaluation.cost as f32)
        };
        if edges[1..] == [edges[0]; LANES - 1] {
            // Most edges are popped alone, and four lanes are more work than one number.
            return [alone(edges[0]); LANES];
        }
        let mut is_too_much = [false; LANES];
        let costs = self.together(surface, edges, |form| {
            is_too_much = attributes.add_to_lanes(form, surface, edges);
        });
        corrected(costs, is_too_much, edges, alone)
    }
}

impl<S: EdgeStore> Cost<S> for Accumulated {
    /// Costs only grow: what an edge cost once is a lower bound.
    const IS_LAZY: bool = true;

    type Queue = LazyHeap;
    type State = Quadric;

    fn new(surface: &Surface<S>, options: &Options, meter: &mut Meter) -> progress::Result<Self> {
        let mesh = &surface.mesh;
        let mut quadrics = vec![Quadric::default(); mesh.vertex_slots()];
        let mut faces = mesh.faces();
        while let Some(first) = faces.next() {
            let mut four = [first; LANES];
            let mut count = 1;
            for (place, f) in four[1..].iter_mut().zip(&mut faces) {
                *place = f;
                count += 1;
            }
            add_planes(surface, four, count, &mut quadrics);
            meter.work(3 * count)?;
        }
        let boundary = boundary_weight(options.boundary);
        for e in mesh.faces().flat_map(FaceId::edges) {
            if mesh.mate(e).is_some() && !surface.curves.are_kept() {
                continue;
            }
            // A crease is met from both of its faces.
            let of_crease = Some(crease_weight(surface) / 2.0).filter(|_| surface.is_crease(e));
            let of_singular = || singular_weight(mesh, e, boundary).filter(|_| !surface.is_rim(e));
            if let Some(weight) = of_crease.or_else(of_singular) {
                let [v, w] = mesh.edge_vertices(e);
                let mut line = Symmetric::default();
                line.add_line(surface.geometry.between(v, w), LINE_WEIGHT * weight);
                let line = Quadric::new(line, DVec3::ZERO, 0.0);
                for end in [v, w] {
                    quadrics[end.index()].add(&line);
                }
            }
        }
        meter.work(mesh.face_count())?;
        if !surface.weights.is_empty() {
            for (v, quadric) in quadrics.iter_mut().enumerate() {
                let weight = surface.weight(VertexId::new(v)) as f32;
                quadric.0.iter_mut().for_each(|number| *number *= weight);
            }
        }
        Ok(Self {
            quadrics,
            attributes: AttributeForms::new(surface),
            placement: options.placement,
        })
    }

    fn with_states(
        surface: &Surface<S>,
        options: &Options,
        states: Vec<Quadric>,
        _: &mut Meter,
    ) -> progress::Result<Self> {
        Ok(Self {
            quadrics: states,
            attributes: AttributeForms::new(surface),
            placement: options.placement,
        })
    }

    fn into_states(self) -> Vec<Quadric> {
        self.quadrics
    }

    fn line(options: &Options, along: DVec3, is_boundary: bool, weight: f64) -> Quadric {
        let of_edge = if is_boundary {
            boundary_weight(options.boundary)
        } else {
            BOUNDARY_WEIGHT
        };
        let mut a = Symmetric::default();
        a.add_line(along, LINE_WEIGHT * of_edge * weight);
        Quadric::new(a, DVec3::ZERO, 0.0)
    }

    fn join(state: &mut Quadric, part: &Quadric) {
        state.add(part);
    }

    #[inline]
    fn evaluate(&self, surface: &Surface<S>, e: EdgeId, held: [bool; 2]) -> Option<Evaluation> {
        let [v, w] = surface.mesh.edge_vertices(e);
        let along = surface.geometry.between(v, w).to_array();
        let at_v = doubles(&self.quadrics[v.index()].0);
        let at_w = doubles(&self.quadrics[w.index()].0);
        let least = least(&at_v, &at_w, along, self.placement, |form| {
            if let Some(attributes) = &self.attributes {
                attributes.add_to(form, surface, e);
            }
        });
        least.evaluation(surface, [v, w], held, self.placement)
    }

    #[inline]
    fn costs(&self, surface: &Surface<S>, edges: &[EdgeId; LANES]) -> [f32; LANES] {
        match &self.attributes {
            None => self.together(surface, edges, |_| {}),
            Some(attributes) => self.with_attributes(attributes, surface, edges),
        }
    }

    fn carried(&self, surface: &Surface<S>, e: EdgeId, position: Vec3) -> Carried {
        carried(
            self.attributes.as_ref(),
            surface,
            e,
            self.placement,
            position,
        )
    }

    fn after_collapse(
        &mut self,
        surface: &Surface<S>,
        merged: &Merged,
        changed: &mut Vec<VertexId>,
    ) {
        let Collapse { kept, removed, .. } = merged.collapse;
        let moved = merged.from.map(|from| surface.geometry.vector(from, kept));
        let (a, b, c) = self.quadrics[removed.index()].seen_from(moved[0]);
        let (a2, b2, c2) = self.quadrics[kept.index()].seen_from(moved[1]);
        self.quadrics[kept.index()] = Quadric::new(a.plus(a2), b + b2, (c + c2).max(0.0));
        changed.clear();
        if let Some(attributes) = &mut self.attributes {
            list_touched(&surface.mesh, merged, changed);
            attributes.update(surface, changed, BUSY);
            changed.clear();
        }
    }

    fn after_change(
        &mut self,
        surface: &Surface<S>,
        cut: [[VertexId; 2]; 3],
        changed: &mut Vec<VertexId>,
    ) {
        for [old, new] in cut {
            self.quadrics[new.index()] = self.quadrics[old.index()];
        }
        changed.clear();
        if let Some(attributes) = &mut self.attributes {
            changed.extend(cut.as_flattened());
            let around = cut.as_flattened().iter();
            changed.extend(around.flat_map(|&v| surface.mesh.neighbours(v)));
            changed.sort_unstable();
            changed.dedup();
            attributes.update(surface, changed, usize::MAX);
            changed.clear();
        }
        changed.extend(cut.as_flattened());
    }

    fn exact_below(&self) -> usize {
        usize::MAX
    }

    fn moves_vertices(&self) -> bool {
        self.placement == Placement::Optimal
    }

    fn bytes(&self) -> usize {
        let attributes = self.attributes.as_ref().map_or(0, AttributeForms::bytes);
        self.quadrics.capacity() * size_of::<Quadric>() + attributes
    }
}
