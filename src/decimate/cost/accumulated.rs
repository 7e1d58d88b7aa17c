//! The *fast* cost: quadrics of the original's planes, added up (Garland & Heckbert 1997), with
//! area weights and boundary lines.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{
    BOUNDARY_WEIGHT, Cost, Evaluation, Form, LINE_WEIGHT, boundary_weight, singular_weight,
};
use crate::decimate::options::{Options, Placement};
use crate::decimate::queue::Buckets;
use crate::decimate::surface::{Merged, Surface};
use crate::decimate::symmetric::Symmetric;
use crate::mesh::{Collapse, EdgeId, EdgeStore, VertexId};

/// The squared distances from the planes and lines that have met at a vertex: yᵀAy − 2bᵀy + c with
/// y from the vertex, where single precision has all its digits. 40 bytes.
#[derive(Clone, Copy, Debug, Default)]
struct Quadric {
    a: [f32; 6],
    b: [f32; 3],
    c: f32,
}

impl Quadric {
    fn b(&self) -> DVec3 {
        Vec3::from(self.b).as_dvec3()
    }

    /// A, b and c as seen from a point at `d` from the vertex.
    #[inline(always)]
    fn seen_from(&self, d: DVec3) -> (Symmetric, DVec3, f64) {
        let a = Symmetric::from_single(self.a);
        let along = a.times(d);
        let b = self.b() - along;
        let c = f64::from(self.c) - 2.0 * self.b().dot(d) + d.dot(along);
        (a, b, c)
    }
}

/// The accumulated cost.
pub struct Accumulated {
    quadrics: Vec<Quadric>,
    placement: Placement,
}

/// The planes and lines at a vertex, all of which pass through it.
fn quadric_at<S: EdgeStore>(surface: &Surface<S>, v: VertexId, boundary_weight: f64) -> Quadric {
    let (mesh, geometry) = (&surface.mesh, &surface.geometry);
    let point = geometry.position(v);
    let mut a = Symmetric::default();
    let add_line = |a: &mut Symmetric, e: EdgeId, along: DVec3| {
        // A crease is met from both of its faces.
        let of_crease = Some(BOUNDARY_WEIGHT / 2.0).filter(|_| surface.is_crease(e));
        if let Some(weight) = of_crease.or_else(|| singular_weight(mesh, e, boundary_weight)) {
            let mut line = Symmetric::default();
            line.add_line(along, LINE_WEIGHT * weight);
            *a = a.plus(line);
        }
    };
    for e in mesh.outgoing_edges(v) {
        let (to_head, to_apex) = (
            geometry.vector(point, mesh.head(e)),
            geometry.vector(point, mesh.apex(e)),
        );
        let normal = to_head.cross(to_apex);
        let length = normal.length();
        if length > 0.0 {
            a.add_outer(normal, 0.5 / length);
        }
        add_line(&mut a, e, to_head);
        add_line(&mut a, mesh.prev(e), to_apex);
    }
    let weight = surface.weight(v);
    Quadric {
        a: a.0.map(|x| (x * weight) as f32),
        ..Quadric::default()
    }
}

impl<S: EdgeStore> Cost<S> for Accumulated {
    const MAY_FALL: bool = false;

    type Queue = Buckets;

    fn new(surface: &Surface<S>, options: &Options) -> Self {
        let weight = boundary_weight(options.boundary);
        let quadric = |v| quadric_at(surface, VertexId::new(v), weight);
        let slots = surface.mesh.vertex_slots();
        Self {
            quadrics: (0..slots).into_par_iter().map(quadric).collect(),
            placement: options.placement,
        }
    }

    fn evaluate(&self, surface: &Surface<S>, e: EdgeId, held: [bool; 2]) -> Option<Evaluation> {
        let ends = surface.mesh.edge_vertices(e);
        let [v, w] = ends;
        let half = surface.geometry.between(w, v) * 0.5;
        // From the middle, which lies at −h from the tail and at h from the head.
        let (a_v, b_v, c_v) = self.quadrics[v.index()].seen_from(-half);
        let (a_w, b_w, c_w) = self.quadrics[w.index()].seen_from(half);
        let form = Form {
            m: a_v.plus(a_w),
            b: b_v + b_w,
            at_middle: c_v + c_w,
            half,
        };
        form.place(surface, ends, held, self.placement, |_, y, _| y)
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
        self.quadrics[kept.index()] = Quadric {
            a: a.0.map(|x| x as f32),
            b: b.as_vec3().to_array(),
            c: c.max(0.0) as f32,
        };
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
