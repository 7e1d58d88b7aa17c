//! What a collapse costs and where its vertex goes.
//!
//! Costs are squared distances times areas, in the unit box.

mod accumulated;
mod attributes;
mod form;
mod memoryless;
mod star;

pub use accumulated::Accumulated;
pub use attributes::{AttributeForms, stride as attribute_stride};
pub use form::{LANES, cross, dot, minus};
use form::{Lanes, Least, Vector};
pub use memoryless::Memoryless;

use glam::{DVec3, Vec3};

use super::options::{Boundary, Options, Placement};
use super::queue::Queue;
use super::surface::{Merged, Surface};
use super::wedges::Carried;
use crate::mesh::{EdgeId, EdgeStore, Mesh, Opposite, VertexId};
use crate::progress::{self, Meter};

/// A collapse's cost, in the unit box, and where its vertex goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Evaluation {
    /// Squared distances times areas, in the unit box.
    pub cost: f64,
    /// The stored position of the vertex that is left.
    pub position: Vec3,
}

/// A cost model: owns its state and follows the collapses.
pub trait Cost<S: EdgeStore>: Send + Sync + Sized {
    /// Whether candidates are evaluated when they are popped, four at a time, and only the edges
    /// that have none after a collapse become candidates again: for costs that never fall.
    const IS_LAZY: bool;

    /// What keeps the candidates of a whole mesh in order.
    type Queue: Queue;

    /// What is known of a vertex beyond the surface around it.
    type State: Clone + Default + Send + Sync;

    /// The model of a surface, computed in parallel. Of a vertex on a seam it knows what the faces
    /// here say, without the [lines](Self::line) of the rim. Told to a meter: 4 units a face.
    fn new(surface: &Surface<S>, options: &Options, meter: &mut Meter) -> progress::Result<Self>;

    /// The model of a surface whose states are known.
    fn with_states(
        surface: &Surface<S>,
        options: &Options,
        states: Vec<Self::State>,
        meter: &mut Meter,
    ) -> progress::Result<Self>;

    /// The states, one a vertex slot.
    fn into_states(self) -> Vec<Self::State>;

    /// What a boundary or non-manifold edge adds to the state of an end of this weight; `along` it, in
    /// the unit box.
    fn line(options: &Options, along: DVec3, is_boundary: bool, weight: f64) -> Self::State;

    /// Adds to a state what other faces or lines say.
    fn join(state: &mut Self::State, part: &Self::State);

    /// The collapse of `e` with its tail or head held in place; nothing where both are held, or
    /// where the numbers fail.
    fn evaluate(&self, surface: &Surface<S>, e: EdgeId, held: [bool; 2]) -> Option<Evaluation>;

    /// What the collapses of edges of which no end is held cost, about as
    /// [`evaluate`](Self::evaluate) says, or less where the optimum has no room; not finite where it
    /// says nothing.
    fn costs(&self, surface: &Surface<S>, edges: &[EdgeId; LANES]) -> [f32; LANES];

    /// The wedges of the vertex that is left of `e` if it goes to `position`; none where nothing is
    /// carried by corners.
    fn carried(&self, surface: &Surface<S>, e: EdgeId, position: Vec3) -> Carried;

    /// Brings the state up to date after a collapse, and lists the vertices whose edges cost
    /// something else now.
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

/// The weight of a crease that may shift sideways: on the surface, that is, where the planes do not
/// care. On a textured cow at 50, 10 and 2 %, 8 costs 13, 34 and 120 % of rms, this 10, 20 and 90, a tenth
/// of it 6, 8 and 60; the texture's error, all of it where the seam has shifted, is then 0.8, 14 and 56
/// thousandths of the texture, 2, 22 and 59, or 8, 48 and 110 (the best peers': 0.8, 34, 73).
const SEAM_WEIGHT: f64 = 1.0;

/// The weight of the line of a crease.
fn crease_weight<S>(surface: &Surface<S>) -> f64 {
    if surface.curves.may_shift() {
        SEAM_WEIGHT
    } else {
        BOUNDARY_WEIGHT
    }
}

/// Squared edge length enters with this weight, so that ties in flat regions go to short edges.
const TIE_BREAK: f64 = 1e-12;

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
        Opposite::NonManifold(_) => mesh.is_canonical(e).then_some(BOUNDARY_WEIGHT),
    }
}

/// Lists the vertices that a collapse left with other faces around them, the merged one first, each
/// once. Of a busy vertex that took a neighbour in, those that it gained edges to.
fn list_touched<S: EdgeStore>(mesh: &Mesh<S>, merged: &Merged, touched: &mut Vec<VertexId>) {
    let kept = merged.collapse.kept;
    touched.clear();
    touched.push(kept);
    if let Some(gained) = &merged.gained {
        let ends = gained.iter().flat_map(|&e| mesh.edge_vertices(e));
        touched.extend(ends.filter(|&x| x != kept));
    } else {
        touched.extend(mesh.neighbours(kept));
        touched.extend(&merged.around);
    }
    let may_repeat = merged.gained.is_some() || !merged.around.is_empty();
    if may_repeat || mesh.is_non_manifold_vertex(kept) {
        // A vertex where many fans end is met once for each, one around maybe twice.
        touched[1..].sort_unstable();
        touched.dedup();
    }
}

/// `map`, which the compiler leaves as a call where it should not.
#[inline(always)]
fn each<T, U>(four: [T; LANES], f: impl Fn(T) -> U) -> [U; LANES] {
    let [a, b, c, d] = four;
    [f(a), f(b), f(c), f(d)]
}

/// [`each`], of what stays where it is.
#[inline(always)]
fn each_ref<'a, T, U>(four: &'a [T; LANES], f: impl Fn(&'a T) -> U) -> [U; LANES] {
    let [a, b, c, d] = four;
    [f(a), f(b), f(c), f(d)]
}

/// Numbers in double precision.
#[inline(always)]
fn doubles<const N: usize>(numbers: &[f32; N]) -> [f64; N] {
    let mut doubles = [0.0; N];
    for (double, &number) in doubles.iter_mut().zip(numbers) {
        *double = number.into();
    }
    doubles
}

/// Four of the numbers that each of four lists has, number by number.
#[inline(always)]
fn part<const N: usize>(lists: [&[f32; N]; LANES], first: usize) -> [Lanes; 4] {
    let four = |list: &[f32; N]| Lanes::new(*list[first..].first_chunk().expect("as many numbers"));
    Lanes::transpose(each(lists, four))
}

/// The coordinates of vertices.
#[inline(always)]
fn places<S: EdgeStore>(surface: &Surface<S>, vertices: [VertexId; LANES]) -> Vector<Lanes> {
    let place = |v| Lanes::new(surface.geometry.point(v));
    let [x, y, z, _] = Lanes::transpose(each(vertices, place));
    [x, y, z]
}

/// From some places to others, in the unit box.
#[inline(always)]
fn between(from: &Vector<Lanes>, to: &Vector<Lanes>, scale: Lanes) -> Vector<Lanes> {
    let [[a, b, c], [x, y, z]] = [from, to];
    [(*x - *a) * scale, (*y - *b) * scale, (*z - *c) * scale]
}

impl Least<f64> {
    /// The cheapest of both ends and x, of those that may be: x in the room.
    #[inline(always)]
    fn evaluation<S: EdgeStore>(
        &self,
        surface: &Surface<S>,
        [v, w]: [VertexId; 2],
        held: [bool; 2],
        placement: Placement,
    ) -> Option<Evaluation> {
        let takes_head = match held {
            [true, true] => return None,
            [true, false] => false,
            [false, true] => true,
            [false, false] => self.head_is_better,
        };
        let geometry = &surface.geometry;
        let is_free = held == [false; 2] && placement == Placement::Optimal;
        let optimum = (is_free && self.x_is_better)
            .then(|| (self.at_x, geometry.point_near(v, self.x.into())))
            .filter(|&(_, x)| geometry.room().contains(x));
        let (energy, position) = optimum.unwrap_or_else(|| {
            if takes_head {
                (self.at_head, geometry.position(w))
            } else {
                (self.at_tail, geometry.position(v))
            }
        });
        let cost = energy.max(0.0) + TIE_BREAK * self.length_squared;
        // A candidate holds its cost in single precision, which attributes may go beyond.
        let is_finite = (cost as f32).is_finite() && position.is_finite();
        is_finite.then_some(Evaluation { cost, position })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decimate::curves::Curves;
    use crate::decimate::geometry::{Geometry, Room};

    /// A surface of nothing but a shape.
    pub(super) fn surface<S: EdgeStore>(shape: (Vec<Vec3>, Vec<[u32; 3]>)) -> Surface<S> {
        let (positions, triangles) = shape;
        let corners = positions
            .iter()
            .fold([Vec3::MAX, Vec3::MIN], |[min, max], &p| {
                [min.min(p), max.max(p)]
            });
        Surface {
            mesh: Mesh::from_triangles(positions.len(), &triangles),
            geometry: Geometry::new(positions, Room::around(corners)),
            locked: Vec::new(),
            double_sided: Vec::new(),
            turned: Vec::new(),
            curves: Curves::default(),
            weights: Vec::new(),
            wedges: Default::default(),
            seam: Vec::new(),
            lost: 0.0,
        }
    }
}
