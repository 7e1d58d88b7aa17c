//! What a collapse costs and where its vertex goes.
//!
//! Costs are squared distances times areas, in the unit box.

mod accumulated;
mod memoryless;

pub use accumulated::Accumulated;
pub use memoryless::Memoryless;

use glam::{DVec3, Vec3};

use super::options::{Boundary, Options, Placement};
use super::queue::Queue;
use super::surface::{Merged, Surface};
use super::symmetric::{Factor, Symmetric};
use crate::mesh::{EdgeId, EdgeStore, Mesh, Opposite, VertexId};

/// A collapse's cost, in the unit box, and where its vertex goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evaluation {
    /// Squared distances times areas, in the unit box.
    pub cost: f64,
    /// The stored position of the vertex that is left.
    pub position: Vec3,
}

/// A cost model: owns its state and follows the collapses.
pub trait Cost<S: EdgeStore>: Send + Sync {
    /// Whether a collapse can make what is left cheaper; else an old cost is a lower bound.
    const MAY_FALL: bool;

    /// What keeps the candidates in order.
    type Queue: Queue;

    /// What is known of a vertex beyond the surface around it.
    type State: Clone + Default + Send + Sync;

    /// The model of a surface, computed in parallel. Of a vertex on a seam it knows what the faces
    /// here say, without the [lines](Self::line) of the rim.
    fn new(surface: &Surface<S>, options: &Options) -> Self;

    /// The model of a surface whose states are known.
    fn with_states(surface: &Surface<S>, options: &Options, states: Vec<Self::State>) -> Self;

    /// The states, one a vertex slot.
    fn into_states(self) -> Vec<Self::State>;

    /// What a boundary or non-manifold edge adds to the state of each of its ends; `along` it, in
    /// the unit box.
    fn line(options: &Options, along: DVec3, is_boundary: bool) -> Self::State;

    /// Adds to a state what other faces or lines say.
    fn join(state: &mut Self::State, part: &Self::State);

    /// The collapse of `e` with its tail or head held in place; nothing where both are held.
    fn evaluate(&self, surface: &Surface<S>, e: EdgeId, held: [bool; 2]) -> Option<Evaluation>;

    /// Brings the state up to date after a collapse, and lists the vertices whose edges cost
    /// something else now; where costs never fall, the merged one alone.
    fn after_collapse(
        &mut self,
        surface: &Surface<S>,
        merged: &Merged,
        changed: &mut Vec<VertexId>,
    );

    /// Gives each second vertex the state of the first, from which it was cut (or which it is, where
    /// faces alone changed), brings all of them up to date, and lists the vertices whose edges cost
    /// something else now.
    fn after_change(
        &mut self,
        surface: &Surface<S>,
        cut: [[VertexId; 2]; 3],
        changed: &mut Vec<VertexId>,
    );

    /// Below so many faces `after_collapse` lists every vertex whose edges cost something else;
    /// above, it may leave out where that is little.
    fn exact_below(&self) -> usize;

    /// Whether vertices may go where none was.
    fn moves_vertices(&self) -> bool;

    /// The bytes that the state holds.
    fn bytes(&self) -> usize;
}

/// The weight of lines against planes: Lindstrom & Turk's ½ for boundaries and ⅓·⅓ for volume
/// bring lengths and areas to one scale; measured with it, 1 to 4 make no difference.
pub(super) const LINE_WEIGHT: f64 = 2.25;

/// The weight of a boundary edge. 1 ties Lindstrom & Turk on the boundary; 16 makes the boundary's
/// error 2 to 6 times smaller for 0 to 4 % of surface rms.
pub(super) const BOUNDARY_WEIGHT: f64 = 8.0;

/// The ridge against singular tensors, relative to the trace. Larger ones cost rms on CAD parts.
const RIDGE: f64 = 1e-8;

/// Squared edge length enters with this weight, so that ties in flat regions go to short edges.
const TIE_BREAK: f64 = 1e-12;

/// How far the optimum may lie from the middle, in lengths of the edge.
const REACH: f64 = 3.0;

/// By how much an end may cost more than the optimum and still be taken, relative to the tensor's
/// trace times the squared edge length: single precision's noise in the tensors.
const AS_GOOD: f64 = 1e-7;

/// The weight of a boundary edge's line, by what boundaries may do.
fn boundary_weight(boundary: Boundary) -> f64 {
    match boundary {
        Boundary::Keep | Boundary::Lock => BOUNDARY_WEIGHT,
        Boundary::Free => 0.0,
    }
}

/// The weight of the line of a boundary or non-manifold edge; of the latter once, where its first
/// directed edge stands, since it ends several fans.
#[inline]
fn singular_weight<S: EdgeStore>(mesh: &Mesh<S>, e: EdgeId, boundary_weight: f64) -> Option<f64> {
    match mesh.opposite(e) {
        Opposite::Edge(_) => None,
        Opposite::Boundary => Some(boundary_weight),
        Opposite::NonManifold(_) => (mesh.canonical(e) == e).then_some(BOUNDARY_WEIGHT),
    }
}

/// An edge's energy, E(x) = xᵀMx − 2bᵀx + c, with x from the tail.
struct Form {
    m: Symmetric,
    b: DVec3,
    at_tail: f64,
    /// From the tail to the head.
    along: DVec3,
}

impl Form {
    /// The sum of xᵀVx, centred at the tail, and the same of W, centred at the head.
    #[inline(always)]
    fn of_ends(v: &Symmetric, w: &Symmetric, along: DVec3) -> Self {
        let b = w.times(along);
        Self {
            m: v.plus(*w),
            b,
            at_tail: along.dot(b),
            along,
        }
    }

    #[inline(always)]
    fn energy(&self, x: DVec3) -> f64 {
        x.dot(self.m.times(x) - self.b - self.b) + self.at_tail
    }

    /// The cheapest position: where the energy is least, moved by `constrain`, or an end where that
    /// is as good, is held, or is all that may be.
    #[inline(always)]
    fn place<S: EdgeStore>(
        &self,
        surface: &Surface<S>,
        [v, w]: [VertexId; 2],
        held: [bool; 2],
        placement: Placement,
        constrain: impl FnOnce(&Factor, DVec3, f64) -> DVec3,
    ) -> Option<Evaluation> {
        let geometry = &surface.geometry;
        let length_squared = self.along.length_squared();
        let (at_tail, at_head) = (self.at_tail, self.energy(self.along));
        let take_tail = match held {
            [true, true] => return None,
            [true, false] => true,
            [false, true] => false,
            [false, false] => at_tail <= at_head,
        };
        let mut energy = if take_tail { at_tail } else { at_head };
        let mut inside = None;
        if held == [false; 2] && placement == Placement::Optimal {
            let trace = self.m.trace();
            let middle = self.along * 0.5;
            let x = Factor::of(&self.m, RIDGE * trace)
                .map(|factor| constrain(&factor, factor.solve(self.b), trace))
                .filter(|x| (*x - middle).length_squared() <= REACH * REACH * length_squared)
                .unwrap_or(middle);
            let at_x = self.energy(x);
            if energy > at_x + AS_GOOD * trace * length_squared {
                energy = at_x;
                inside = Some(x);
            }
        }
        let position = match inside {
            Some(x) => geometry.point_near(v, x),
            None => geometry.position(if take_tail { v } else { w }),
        };
        let cost = energy.max(0.0) + TIE_BREAK * length_squared;
        (cost.is_finite() && position.is_finite()).then_some(Evaluation { cost, position })
    }
}
