//! The *standard* cost: memoryless and volume-constrained (Lindstrom & Turk 1998, 1999).
//!
//! A vertex carries a tensor of the planes and lines that meet at it now, and nothing of the
//! original, so it works on any intermediate mesh. A volume constraint keeps the surface from
//! shrinking.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::form::Form;
use super::{
    BOUNDARY_WEIGHT, Choice, Cost, Evaluation, LANES, LINE_WEIGHT, boundary_weight, singular_weight,
};
use crate::decimate::options::{Options, Placement};
use crate::decimate::queue::LazyHeap;
use crate::decimate::surface::{Merged, Surface};
use crate::decimate::symmetric::{Factor, Symmetric};
use crate::mesh::{EdgeId, EdgeStore, Mesh, Opposite, VertexId};

/// The weight of a fold. Without it a thin double sheet is free to eat: one mesh 1.68 → 0.91 of the
/// best peer's rms at 2 %.
const FOLD_WEIGHT: f64 = 0.3;

/// Edges flatter than this, as (1 − cos θ)/2, are no folds.
const FLAT: f64 = 0.05;

/// The squared length that the sum of a star's normals must have for the volume constraint to say
/// something, relative to the squared trace: below, the star is a folded sheet.
const CONSTRAINED: f64 = 3e-7;

/// The planes and lines at a vertex: Σ n nᵀ/(2|n|) and line terms, and Σ n, with n twice a face's
/// area long. 36 bytes; no linear or constant term, since every plane and line passes through the
/// vertex.
#[derive(Clone, Copy, Debug, Default)]
struct Tensor {
    quadratic: [f32; 6],
    area: [f32; 3],
}

impl Tensor {
    /// Whether the planes and lines changed by more than [`CHANGE`].
    fn differs_from(&self, now: &Self) -> bool {
        let [xx, xy, xz, yy, yz, zz]: [f32; 6] =
            std::array::from_fn(|i| (now.quadratic[i] - self.quadratic[i]).abs());
        let trace = now.quadratic[0] + now.quadratic[3] + now.quadratic[5];
        xx + yy + zz + 2.0 * (xy + xz + yz) > CHANGE * trace
    }

    fn area(&self) -> DVec3 {
        Vec3::from(self.area).as_dvec3()
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

/// A vertex around which a collapse changes less than this share of the tensor does not have its
/// edges evaluated at once: one that costs more now says so when it is popped. 0.1 to 0.5 differ by
/// chance alone (0.5 % of rms and of the Hausdorff distance over 12 meshes at five ratios); 0, which
/// evaluates all of them, takes 1.6 times as long for 0.2 % of rms.
const CHANGE: f32 = 0.35;

/// With fewer faces than this all edges are evaluated at once, unless they are part of a larger
/// mesh: there it costs nothing, and a few collapses decide how the result looks.
const EXACT_BELOW: usize = 8000;

/// The ridge against singular tensors, relative to the trace. Larger ones cost rms on CAD parts.
const RIDGE: f64 = 1e-8;

/// By how much an end may cost more than the optimum and still be taken, relative to the tensor's
/// trace times the squared edge length: single precision's noise in the tensors.
const AS_GOOD: f64 = 1e-7;

/// The memoryless, volume-constrained cost.
pub struct Memoryless {
    tensors: Vec<Tensor>,
    lag: Vec<Lag>,
    boundary_weight: f64,
    placement: Placement,
    exact_below: usize,
}

impl Memoryless {
    /// The tensor of `v` from the faces around it now, and how far it may lag behind them.
    fn tensor<S: EdgeStore>(&self, surface: &Surface<S>, v: VertexId) -> (Tensor, Lag) {
        let (mesh, geometry) = (&surface.mesh, &surface.geometry);
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
                    add_fold(&mut quadratic, along, previous, side, surface.is_crease(e));
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
                add_fold(&mut quadratic, along, last, side, surface.is_crease(start));
            } else {
                self.add_singular(&mut quadratic, mesh, start, along);
                let along = geometry.vector(point, mesh.tail(end));
                self.add_singular(&mut quadratic, mesh, end, along);
            }
        }
        let weight = surface.weight(v);
        let tensor = Tensor {
            quadratic: quadratic.0.map(|x| (x * weight) as f32),
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
        if let Some(weight) = singular_weight(mesh, e, self.boundary_weight) {
            quadratic.add_line(along, LINE_WEIGHT * weight);
        }
    }

    fn refresh<S: EdgeStore>(&mut self, surface: &Surface<S>, v: VertexId) {
        (self.tensors[v.index()], self.lag[v.index()]) = self.tensor(surface, v);
    }
}

#[derive(Clone, Copy)]
struct Side {
    normal: DVec3,
    length: f64,
}

/// Adds the line of the edge between two faces if they fold there, or if it is a crease.
#[inline(always)]
fn add_fold(quadratic: &mut Symmetric, along: DVec3, a: Side, b: Side, is_crease: bool) {
    let lengths = a.length * b.length;
    if is_crease {
        quadratic.add_line(along, LINE_WEIGHT * BOUNDARY_WEIGHT);
    } else if lengths > 0.0 {
        let fold = (1.0 - a.normal.dot(b.normal) / lengths) * 0.5;
        if fold >= FLAT {
            quadratic.add_line(along, LINE_WEIGHT * FOLD_WEIGHT * fold * fold);
        }
    }
}

impl<S: EdgeStore> Cost<S> for Memoryless {
    const IS_LAZY: bool = false;

    type Queue = LazyHeap;
    type State = ();

    fn new(surface: &Surface<S>, options: &Options) -> Self {
        let slots = surface.mesh.vertex_slots();
        let mut model = Self {
            tensors: Vec::new(),
            lag: Vec::new(),
            boundary_weight: boundary_weight(options.boundary),
            exact_below: if surface.seam.is_empty() {
                EXACT_BELOW
            } else {
                0
            },
            placement: options.placement,
        };
        let tensor = |v| model.tensor(surface, VertexId::new(v));
        (model.tensors, model.lag) = (0..slots).into_par_iter().map(tensor).unzip();
        model
    }

    fn with_states(surface: &Surface<S>, options: &Options, _: Vec<()>) -> Self {
        Self::new(surface, options)
    }

    fn into_states(self) -> Vec<()> {
        vec![(); self.tensors.len()]
    }

    fn line(_: &Options, _: DVec3, _: bool) {}

    fn join((): &mut (), (): &()) {}

    #[inline]
    fn evaluate(&self, surface: &Surface<S>, e: EdgeId, held: [bool; 2]) -> Option<Evaluation> {
        self.evaluate_one(surface, e, held)
    }

    #[inline]
    fn costs(&self, surface: &Surface<S>, edges: &[EdgeId; LANES]) -> [f32; LANES] {
        edges.map(|e| {
            let evaluation = self.evaluate_one(surface, e, [false; 2]);
            evaluation.map_or(f32::NAN, |evaluation| evaluation.cost as f32)
        })
    }

    fn after_collapse(
        &mut self,
        surface: &Surface<S>,
        merged: &Merged,
        changed: &mut Vec<VertexId>,
    ) {
        let kept = merged.collapse.kept;
        changed.clear();
        changed.push(kept);
        self.refresh(surface, kept);
        changed.extend(surface.mesh.neighbours(kept));
        changed.extend(&merged.around);
        if !merged.around.is_empty() || surface.mesh.is_non_manifold_vertex(kept) {
            // A vertex where many fans end is met once for each, one around maybe twice.
            changed[1..].sort_unstable();
            changed.dedup();
        }
        let is_exact = surface.mesh.face_count() < self.exact_below;
        let mut is_first = true;
        changed.retain(|&x| {
            if std::mem::take(&mut is_first) {
                return true;
            }
            let lag = &mut self.lag[x.index()];
            if lag.left > 0 {
                lag.left -= 1;
                return false;
            }
            let before = self.tensors[x.index()];
            self.refresh(surface, x);
            is_exact || before.differs_from(&self.tensors[x.index()])
        });
    }

    fn after_change(
        &mut self,
        surface: &Surface<S>,
        cut: [[VertexId; 2]; 3],
        changed: &mut Vec<VertexId>,
    ) {
        changed.clear();
        changed.extend(cut.as_flattened());
        let around = cut.as_flattened().iter();
        changed.extend(around.flat_map(|&v| surface.mesh.neighbours(v)));
        changed.sort_unstable();
        changed.dedup();
        for &x in &*changed {
            self.refresh(surface, x);
        }
    }

    fn exact_below(&self) -> usize {
        self.exact_below
    }

    fn moves_vertices(&self) -> bool {
        self.placement == Placement::Optimal
    }

    fn bytes(&self) -> usize {
        self.tensors.capacity() * size_of::<Tensor>() + self.lag.capacity() * size_of::<Lag>()
    }
}

impl Memoryless {
    #[inline]
    fn evaluate_one<S: EdgeStore>(
        &self,
        surface: &Surface<S>,
        e: EdgeId,
        held: [bool; 2],
    ) -> Option<Evaluation> {
        let ends = surface.mesh.edge_vertices(e);
        let [at_v, at_w] = ends.map(|v| &self.tensors[v.index()]);
        let [quadratic_v, quadratic_w] = [at_v, at_w].map(|t| t.quadratic.map(f64::from));
        let along = surface.geometry.between(ends[0], ends[1]);
        let form = Form::of_ends(&quadratic_v, &quadratic_w, along.to_array());
        let heavy = ends.map(|v| self.lag[v.index()].every >= HEAVY);
        let held = if held == [false; 2] && heavy != [true; 2] {
            heavy
        } else {
            held
        };
        let trace = form.trace();
        let x = Factor::of(&Symmetric(form.m), RIDGE * trace).map(|factor| {
            let x = factor.solve(DVec3::from(form.b));
            let g = self.area_around(surface, e);
            // The trace is weighted, the normals are not.
            let [weight_v, weight_w] = ends.map(|v| surface.weight(v));
            let trace = trace / weight_v.max(weight_w);
            if g.length_squared() > CONSTRAINED * trace * trace {
                // The volume that a point x from the tail would add is (g·x − k)/6.
                let k = (g - at_v.area() + at_w.area()).dot(along) * 0.5;
                let direction = factor.solve(g);
                x + direction * ((k - g.dot(x)) / g.dot(direction))
            } else {
                x
            }
        });
        let least = form.compared(&x.unwrap_or(DVec3::NAN).to_array(), AS_GOOD);
        let choice = Choice {
            x_is_better: least.x_is_better,
            head_is_better: least.head_is_better,
            energies: [least.at_tail, least.at_head, least.at_x],
            x: least.x.into(),
            length_squared: least.length_squared,
        };
        choice.evaluation(surface, ends, held, self.placement)
    }

    /// The sum of the normals around both ends, the faces at `e` counted once; nothing at a
    /// non-manifold edge, which encloses no one volume.
    #[inline]
    fn area_around<S: EdgeStore>(&self, surface: &Surface<S>, e: EdgeId) -> DVec3 {
        let (mesh, geometry) = (&surface.mesh, &surface.geometry);
        let [v, w] = mesh.edge_vertices(e);
        let around = self.tensors[v.index()].area() + self.tensors[w.index()].area();
        match mesh.opposite(e) {
            Opposite::Edge(o) => around - geometry.normal(mesh, e) - geometry.normal(mesh, o),
            Opposite::Boundary => around - geometry.normal(mesh, e),
            Opposite::NonManifold(_) => DVec3::ZERO,
        }
    }
}
