//! The *fast* cost: quadrics of the original's planes, added up (Garland & Heckbert 1997), with
//! area weights and boundary lines.

use glam::{DVec3, Vec3};

use super::form::{Forms, Lanes, dot, plus, transposed};
use super::{
    BOUNDARY_WEIGHT, Cost, Evaluation, LANES, LINE_WEIGHT, boundary_weight, singular_weight,
};
use crate::decimate::options::{Options, Placement};
use crate::decimate::queue::Buckets;
use crate::decimate::surface::{Merged, Surface};
use crate::decimate::symmetric::Symmetric;
use crate::mesh::{Collapse, EdgeId, EdgeStore, VertexId};

/// The squared distances from the planes and lines that have met at a vertex: yᵀAy − 2bᵀy + c with
/// y from the vertex, where single precision has all its digits. 40 bytes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Quadric {
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
            Quadric {
                a: sum.0.map(|x| (x * weight) as f32),
                ..Quadric::default()
            }
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
        Quadric {
            a: a.0.map(|x| x as f32),
            ..Quadric::default()
        }
    }

    fn join(state: &mut Quadric, part: &Quadric) {
        state.a = std::array::from_fn(|i| state.a[i] + part.a[i]);
        state.b = std::array::from_fn(|i| state.b[i] + part.b[i]);
        state.c += part.c;
    }

    #[inline]
    fn evaluate(
        &self,
        surface: &Surface<S>,
        edges: &[EdgeId; LANES],
        held: &[[bool; 2]; LANES],
    ) -> [Option<Evaluation>; LANES] {
        let ends = edges.map(|e| surface.mesh.edge_vertices(e));
        let along = ends.map(|[v, w]| surface.geometry.between(v, w).to_array());
        let at = |end: usize| ends.map(|ends| &self.quadrics[ends[end].index()]);
        let (at_v, at_w) = (at(0), at(1));
        let a_v = transposed(at_v.map(|q| q.a.map(f64::from)));
        let a_w = transposed(at_w.map(|q| q.a.map(f64::from)));
        let b_v = transposed(at_v.map(|q| q.b.map(f64::from)));
        let b_w = transposed(at_w.map(|q| q.b.map(f64::from)));
        let c = |at: [&Quadric; LANES]| Lanes::from(at.map(|q| f64::from(q.c)));
        let mut forms = Forms::of_ends(&a_v, &a_w, transposed(along));
        forms.b = plus(&forms.b, &plus(&b_v, &b_w));
        let b_along = dot(&b_w, &forms.along);
        forms.at_tail += b_along + b_along + c(at_v) + c(at_w);
        let least = forms.least_near_middle();
        forms.place(surface, &ends, held, self.placement, least)
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
