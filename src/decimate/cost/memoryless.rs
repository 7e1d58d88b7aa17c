//! The *standard* cost: memoryless and volume-constrained (Lindstrom & Turk 1998, 1999).
//!
//! A vertex carries a tensor of the planes and lines that meet at it now, and nothing of the
//! original, so it works on any intermediate mesh. A volume constraint keeps the surface from
//! shrinking.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::attributes::{AttributeForms, carried, corrected};
use super::form::{Factor, Form, Lanes, Least, Number, Vector, cross, dot, minus, plus};
use super::star::Star;
use super::{
    Cost, Evaluation, LANES, between, boundary_weight, doubles, each, list_touched, part, places,
};
use crate::decimate::options::{Options, Placement};
use crate::decimate::queue::LazyHeap;
use crate::decimate::surface::{Merged, Surface};
use crate::decimate::wedges::Carried;
use crate::mesh::{EdgeId, EdgeStore, Opposite, VertexId};
use crate::progress::{self, Meter};

/// The squared length that the sum of a star's normals must have for the volume constraint to say
/// something, relative to the squared trace: below, the star is a folded sheet.
const CONSTRAINED: f64 = 3e-7;

/// The planes and lines at a vertex: Σ n nᵀ/(2|n|) and line terms, and Σ n, with n twice a face's
/// area long. 36 bytes; no linear or constant term, since every plane and line passes through the
/// vertex. With it, how far it may lag behind the faces around, so that a vertex of valence 100 000
/// does not cost 100 000 faces for each collapse on its rim.
#[derive(Clone, Copy, Debug, Default)]
struct Tensor {
    /// The six numbers of the planes and lines, then the three of Σ n.
    numbers: [f32; 9],
    /// The changes around the vertex that pass before its tensor is computed again: one for every
    /// [`BUSY`] faces, none below.
    every: u16,
    /// How many of them are left.
    left: u16,
}

impl Tensor {
    /// Whether the planes and lines changed by more than [`CHANGE`].
    fn differs_from(&self, now: &Self) -> bool {
        let [xx, xy, xz, yy, yz, zz]: [f32; 6] =
            std::array::from_fn(|i| (now.numbers[i] - self.numbers[i]).abs());
        let trace = now.numbers[0] + now.numbers[3] + now.numbers[5];
        xx + yy + zz + 2.0 * (xy + xz + yz) > CHANGE * trace
    }

    /// Whether the vertex stays where it is when a collapse takes a neighbour in.
    fn is_heavy(&self) -> bool {
        self.every >= HEAVY
    }
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

/// What an evaluation's numbers are good for.
#[derive(Clone, Copy)]
struct Precision {
    /// The ridge against singular tensors, relative to the trace.
    ridge: f64,
    /// By how much an end may cost more than the optimum and still be taken, relative to the
    /// tensor's trace times the squared edge length.
    as_good: f64,
}

/// For the place. Larger ridges cost rms on CAD parts; an end may be dearer by the noise of the
/// tensors, which are stored in single precision: 3e-7 costs 1 % of rms on a bunny and a CAD part.
const DOUBLE: Precision = Precision {
    ridge: 1e-8,
    as_good: 1e-7,
};

/// For the cost alone, where no end need be preferred: 1e-6 makes what is flat look too dear and
/// costs 0.3 % of rms (8 meshes at three ratios). A ridge of 1e-7 lies within the noise of the sums
/// and costs 1 % on a bunny and a CAD part.
const SINGLE: Precision = Precision {
    ridge: 1e-6,
    as_good: 0.0,
};

/// The memoryless, volume-constrained cost.
pub struct Memoryless {
    tensors: Vec<Tensor>,
    attributes: Option<AttributeForms>,
    boundary_weight: f64,
    placement: Placement,
    exact_below: usize,
}

impl Memoryless {
    /// The tensors of as many vertices from the faces around them now, at most four.
    #[inline]
    fn tensors<S: EdgeStore>(
        &self,
        surface: &Surface<S>,
        vertices: &[VertexId],
    ) -> [Tensor; LANES] {
        Star::around(surface, vertices, self.boundary_weight).map(|star| {
            let every = (star.faces / BUSY).min(u16::MAX.into()) as u16;
            Tensor {
                numbers: star.numbers,
                every,
                left: every,
            }
        })
    }

    /// [`costs`](Cost::costs); `add` adds what is not of planes and lines.
    #[inline(always)]
    fn together<S: EdgeStore>(
        &self,
        surface: &Surface<S>,
        edges: &[EdgeId; LANES],
        add: impl FnOnce(&mut Form<Lanes>),
    ) -> [f32; LANES] {
        let tails = each(*edges, |e| surface.mesh.tail(e));
        let heads = each(*edges, |e| surface.mesh.head(e));
        let at_tails = each(tails, |v| &self.tensors[v.index()]);
        let at_heads = each(heads, |v| &self.tensors[v.index()]);
        let any_is_heavy =
            |tensors: [&Tensor; LANES]| tensors.iter().fold(false, |any, t| any | t.is_heavy());
        if any_is_heavy(at_tails) | any_is_heavy(at_heads) {
            return self.one_by_one(surface, edges);
        }
        let [a, b, c, d] = *edges;
        let (Some(a), Some(b), Some(c), Some(d)) = (
            apexes(surface, a),
            apexes(surface, b),
            apexes(surface, c),
            apexes(surface, d),
        ) else {
            return self.one_by_one(surface, edges);
        };
        let apexes = [a, b, c, d];
        let scale = Lanes::splat(surface.geometry.scale() as f32);
        let along = between(&places(surface, tails), &places(surface, heads), scale);
        let from = places(surface, each(apexes, |[_, b]| b));
        let across = between(&from, &places(surface, each(apexes, |[a, _]| a)), scale);
        let dying = Some(cross(&along, &across));
        let (at_v, at_w) = (numbers(at_tails), numbers(at_heads));
        let weight = if surface.weights.is_empty() {
            Lanes::splat(1.0)
        } else {
            let [tails, heads] = [tails, heads].map(|ends| ends.map(|v| surface.weight(v) as f32));
            Lanes::new(tails).fast_max(Lanes::new(heads))
        };
        let precision = match self.placement {
            Placement::Optimal => SINGLE,
            // Nothing is better than the better end.
            Placement::Endpoint => Precision {
                as_good: f64::INFINITY,
                ..SINGLE
            },
        };
        least(&at_v, &at_w, along, dying, weight, precision, add)
            .costs()
            .to_array()
    }

    /// [`costs`](Cost::costs), apart from where there are no attributes, which it would slow down.
    #[inline(never)]
    fn with_attributes<S: EdgeStore>(
        &self,
        attributes: &AttributeForms,
        surface: &Surface<S>,
        edges: &[EdgeId; LANES],
    ) -> [f32; LANES] {
        let mut is_too_much = [false; LANES];
        let costs = self.together(surface, edges, |form| {
            is_too_much = attributes.add_to_lanes(form, surface, edges);
        });
        corrected(costs, is_too_much, edges, |e| self.alone(surface, e))
    }

    /// [`costs`](Cost::costs), where an edge needs more than lanes have; seldom, and so kept out of the way.
    #[cold]
    fn one_by_one<S: EdgeStore>(
        &self,
        surface: &Surface<S>,
        edges: &[EdgeId; LANES],
    ) -> [f32; LANES] {
        edges.map(|e| self.alone(surface, e))
    }

    /// What the collapse of an edge costs; no number where it says nothing.
    fn alone<S: EdgeStore>(&self, surface: &Surface<S>, e: EdgeId) -> f32 {
        let evaluation = self.evaluate(surface, e, [false; 2]);
        evaluation.map_or(f32::NAN, |evaluation| evaluation.cost as f32)
    }
}

/// The numbers of tensors.
#[inline(always)]
fn numbers(tensors: [&Tensor; LANES]) -> [Lanes; 9] {
    let lists = each(tensors, |t| &t.numbers);
    let ([a, b, c, d], [e, f, g, h], [.., i]) = (part(lists, 0), part(lists, 4), part(lists, 5));
    [a, b, c, d, e, f, g, h, i]
}

/// Where an edge's energy is least among the places that keep the volume.
///
/// `dying` is the sum of the normals of the faces at the edge, nothing where the edge encloses no
/// one volume; `weight` the larger of the ends' weights. `add` adds what is not of planes and lines.
#[inline(always)]
fn least<T: Number>(
    at_v: &[T; 9],
    at_w: &[T; 9],
    along: Vector<T>,
    dying: Option<Vector<T>>,
    weight: T,
    precision: Precision,
    add: impl FnOnce(&mut Form<T>),
) -> Least<T> {
    let [xx, xy, xz, yy, yz, zz, x, y, z] = *at_v;
    let (quadratic_v, area_v) = ([xx, xy, xz, yy, yz, zz], [x, y, z]);
    let [xx, xy, xz, yy, yz, zz, x, y, z] = *at_w;
    let (quadratic_w, area_w) = ([xx, xy, xz, yy, yz, zz], [x, y, z]);
    let mut form = Form::of_ends(&quadratic_v, &quadratic_w, along);
    add(&mut form);
    let trace = form.trace();
    let factor = Factor::of(&form.m, T::splat(precision.ridge) * trace);
    let x = factor.solve(&form.b);
    // The volume that a point x from the tail would add is (g·x − k)/6; the faces at the edge, which
    // both areas contain, have no part in k, since their normals are at right angles to the edge.
    let around = plus(&area_v, &area_w);
    let g = dying.map_or([T::splat(0.0); 3], |dying| minus(&around, &dying));
    let k = dot(&area_w, &form.along);
    let direction = factor.solve(&g);
    let step = (k - dot(&g, &x)) / dot(&g, &direction);
    // The trace is weighted, the normals are not.
    let unweighted = trace / weight;
    let is_constrained = dot(&g, &g).greater(T::splat(CONSTRAINED) * unweighted * unweighted);
    let x = std::array::from_fn(|i| T::choose(is_constrained, x[i] + direction[i] * step, x[i]));
    form.compared(&x, precision.as_good)
}

/// The vertices that are looked at between two words about it.
const AT_A_TIME: usize = 1 << 17;

impl<S: EdgeStore> Cost<S> for Memoryless {
    const IS_LAZY: bool = false;

    type Queue = LazyHeap;
    type State = ();

    fn new(surface: &Surface<S>, options: &Options, meter: &mut Meter) -> progress::Result<Self> {
        let slots = surface.mesh.vertex_slots();
        let mut model = Self {
            tensors: Vec::new(),
            attributes: AttributeForms::new(surface),
            boundary_weight: boundary_weight(options.boundary),
            exact_below: if surface.seam.is_empty() {
                EXACT_BELOW
            } else {
                0
            },
            placement: options.placement,
        };
        let mut tensors = vec![Tensor::default(); slots];
        let four = |(i, four): (usize, &mut [Tensor])| {
            let vertices = [0, 1, 2, 3].map(|k| VertexId::new(LANES * i + k));
            let vertices = &vertices[..four.len()];
            four.copy_from_slice(&model.tensors(surface, vertices)[..four.len()]);
        };
        let mut first = 0;
        for part in tensors.chunks_mut(AT_A_TIME) {
            let fours = part.par_chunks_mut(LANES).enumerate();
            fours.for_each(|(i, vertices)| four((first / LANES + i, vertices)));
            first += part.len();
            // About two faces a vertex.
            meter.work(8 * part.len())?;
        }
        model.tensors = tensors;
        Ok(model)
    }

    fn with_states(
        surface: &Surface<S>,
        options: &Options,
        _: Vec<()>,
        meter: &mut Meter,
    ) -> progress::Result<Self> {
        Self::new(surface, options, meter)
    }

    fn into_states(self) -> Vec<()> {
        vec![(); self.tensors.len()]
    }

    fn line(_: &Options, _: DVec3, _: bool, _: f64) {}

    fn join((): &mut (), (): &()) {}

    #[inline]
    fn evaluate(&self, surface: &Surface<S>, e: EdgeId, held: [bool; 2]) -> Option<Evaluation> {
        let ends = surface.mesh.edge_vertices(e);
        let tensors = ends.map(|v| &self.tensors[v.index()]);
        let (at_v, at_w) = (doubles(&tensors[0].numbers), doubles(&tensors[1].numbers));
        let heavy = tensors.map(|t| t.is_heavy());
        let held = if held == [false; 2] && heavy != [true; 2] {
            heavy
        } else {
            held
        };
        let along = surface.geometry.between(ends[0], ends[1]).to_array();
        let dying = apexes(surface, e).map(|[a, b]| {
            let across = surface.geometry.between(b, a).to_array();
            cross(&along, &across)
        });
        let [weight_v, weight_w] = ends.map(|v| surface.weight(v));
        let weight = weight_v.max(weight_w);
        let least = least(&at_v, &at_w, along, dying, weight, DOUBLE, |form| {
            if let Some(attributes) = &self.attributes {
                attributes.add_to(form, surface, e);
            }
        });
        least.evaluation(surface, ends, held, self.placement)
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
        let kept = merged.collapse.kept;
        list_touched(&surface.mesh, merged, changed);
        let gained = merged.gained.as_deref();
        changed.retain(|&x| {
            let tensor = &mut self.tensors[x.index()];
            let lags = (x != kept || gained.is_some()) && tensor.left > 0;
            tensor.left -= u16::from(lags);
            !lags
        });
        if let Some(attributes) = &mut self.attributes {
            attributes.update(surface, changed, usize::MAX);
        }
        let is_exact = gained.is_some() || surface.mesh.face_count() < self.exact_below;
        let mut listed = 0;
        for first in (0..changed.len()).step_by(LANES) {
            let last = changed.len().min(first + LANES);
            let now = self.tensors(surface, &changed[first..last]);
            for i in first..last {
                let x = changed[i];
                let before = std::mem::replace(&mut self.tensors[x.index()], now[i - first]);
                // All that is listed lies before what is looked at.
                if is_exact || x == kept || before.differs_from(&now[i - first]) {
                    changed[listed] = x;
                    listed += 1;
                }
            }
        }
        changed.truncate(listed);
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
        // A hub beside a gap does not cost its valence for each face that closes some of it.
        changed.retain(|x| {
            let tensor = &mut self.tensors[x.index()];
            let is_beside = !cut.as_flattened().contains(x);
            let lags = is_beside && tensor.is_heavy() && tensor.left > 0;
            tensor.left -= u16::from(lags);
            !lags
        });
        if let Some(attributes) = &mut self.attributes {
            attributes.update(surface, changed, usize::MAX);
        }
        for four in changed.chunks(LANES) {
            let now = self.tensors(surface, four);
            for (x, tensor) in four.iter().zip(now) {
                self.tensors[x.index()] = tensor;
            }
        }
    }

    fn exact_below(&self) -> usize {
        self.exact_below
    }

    fn moves_vertices(&self) -> bool {
        self.placement == Placement::Optimal
    }

    fn bytes(&self) -> usize {
        let attributes = self.attributes.as_ref().map_or(0, AttributeForms::bytes);
        self.tensors.capacity() * size_of::<Tensor>() + attributes
    }
}

/// The apexes of the faces on both sides of an edge, its tail for a face that is missing; nothing at
/// a non-manifold edge. Their difference times the edge is the sum of both normals.
#[inline(always)]
fn apexes<S: EdgeStore>(surface: &Surface<S>, e: EdgeId) -> Option<[VertexId; 2]> {
    let mesh = &surface.mesh;
    match mesh.opposite(e) {
        Opposite::Edge(o) => Some([mesh.apex(e), mesh.apex(o)]),
        Opposite::Boundary => Some([mesh.apex(e), mesh.tail(e)]),
        Opposite::NonManifold(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::surface;
    use super::*;
    use crate::mesh::Full;
    use crate::progress::unheard;
    use crate::shapes;

    /// The loop waits for a candidate that costs 5 % more than it was queued at.
    #[test]
    fn costs_in_lanes_are_about_what_one_evaluation_says() {
        for shape in [
            shapes::icosphere(2),
            shapes::torus(16, 8),
            shapes::three_fins(3),
        ] {
            let surface = surface::<Full>(shape);
            let model = unheard(|meter| Memoryless::new(&surface, &Options::default(), meter));
            for e in surface.mesh.edges() {
                let lanes: [f32; LANES] = model.costs(&surface, &[e; LANES]);
                let one = model.evaluate(&surface, e, [false; 2]).unwrap().cost;
                let wrong = (f64::from(lanes[0]) - one).abs();
                assert!(wrong <= 0.02 * one + 1e-8, "{e:?}: {} for {one}", lanes[0]);
            }
        }
    }
}
