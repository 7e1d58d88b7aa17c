//! The directed-edge data structure: connectivity and nothing else.
//!
//! ```text
//!             apex
//!             /  \
//!    prev(e) /    \ next(e)        triangle i owns the directed edges 3i, 3i+1, 3i+2
//!           /      \
//!       tail ──e──> head           opposite(e) runs from head to tail in the face below
//! ```
//!
//! A step around a vertex goes `e → opposite(prev(e))` (paper, section 3). Slots are stable: a
//! collapse kills faces, edges and a vertex, and moves none, until [`Mesh::compact`].
//!
//! | operation | allowed where | on non-manifold edges and vertices |
//! |---|---|---|
//! | [`collapse`](Mesh::collapse) | [`link_condition`](Mesh::link_condition): the topology stays | yes |
//! | [`split_vertex`](Mesh::split_vertex) | [`vertex_split_condition`](Mesh::vertex_split_condition): a collapse undoes it | yes |
//! | [`flip`](Mesh::flip) | [`flip_condition`](Mesh::flip_condition): two faces, apexes not joined | beside them |
//! | [`split_edge`](Mesh::split_edge) | [`edge_split_condition`](Mesh::edge_split_condition): everywhere | yes |
//! | [`split_face`](Mesh::split_face) | [`face_split_condition`](Mesh::face_split_condition): everywhere | yes |
//! | [`add_face`](Mesh::add_face) | [`add_condition`](Mesh::add_condition): no face is there twice | yes |
//! | [`remove_face`](Mesh::remove_face) | [`remove_condition`](Mesh::remove_condition): everywhere | yes |
//!
//! What they add goes into slots that are dead, of former faces and vertices or
//! [new](Mesh::new_face).

mod add;
pub(crate) mod build;
mod check;
mod collapse;
mod compact;
mod components;
mod contract;
mod cut;
mod disk;
mod edge_split;
mod face_split;
mod fill;
mod flip;
mod ids;
mod link;
#[cfg(test)]
mod modify_tests;
mod non_manifold;
mod orient;
mod pinch;
mod relink;
mod ring;
mod slots;
mod store;
#[cfg(test)]
mod tests;
mod vertex_split;

pub use collapse::Collapse;
pub use compact::Compaction;
pub use contract::Contraction;
pub use cut::Cut;
pub use disk::Disks;
pub use ids::{EdgeId, FaceId, VertexId};
pub use link::{Opposite, Outgoing, RowId};
pub use orient::{Oriented, turn_round};
pub(crate) use ring::BUSY;
pub use ring::{BoundaryCurve, Fan};
pub use store::{EdgeStore, Full, Medium, Small, Tier};
pub use vertex_split::VertexSplit;

pub(crate) use link::{OppositeWord, OutgoingWord};
pub(crate) use non_manifold::SideTable;
use smallvec::SmallVec;

/// A triangle mesh's connectivity in one memory tier.
#[derive(Clone, Debug)]
pub struct Mesh<S> {
    store: S,
    outgoing: Vec<OutgoingWord>,
    edge_rows: SideTable,
    fan_rows: SideTable,
    live_faces: usize,
    live_vertices: usize,
}

impl<S: EdgeStore> Mesh<S> {
    /// The vertex that `e` starts at.
    #[inline(always)]
    pub fn tail(&self, e: EdgeId) -> VertexId {
        self.store.tail(e)
    }

    /// The vertex that `e` ends at.
    #[inline(always)]
    pub fn head(&self, e: EdgeId) -> VertexId {
        self.store.head(e)
    }

    /// The directed edge behind `e` in its face.
    #[inline(always)]
    pub fn next(&self, e: EdgeId) -> EdgeId {
        self.store.next(e)
    }

    /// The directed edge before `e` in its face.
    #[inline(always)]
    pub fn prev(&self, e: EdgeId) -> EdgeId {
        self.store.prev(e)
    }

    /// What lies across `e`. Its face must be alive.
    #[inline(always)]
    pub fn opposite(&self, e: EdgeId) -> Opposite {
        self.store.opposite_word(e).decode()
    }

    /// The directed edge across `e`, if exactly one and running the other way.
    #[inline(always)]
    pub fn mate(&self, e: EdgeId) -> Option<EdgeId> {
        match self.opposite(e) {
            Opposite::Edge(o) => Some(o),
            Opposite::Boundary | Opposite::NonManifold(_) => None,
        }
    }

    /// Where the walk around `v` begins.
    #[inline(always)]
    pub fn outgoing(&self, v: VertexId) -> Outgoing {
        self.outgoing[v.index()].decode()
    }

    /// The corner of `e`'s face that `e` does not touch.
    #[inline(always)]
    pub fn apex(&self, e: EdgeId) -> VertexId {
        self.head(self.next(e))
    }

    /// Both vertices of an edge, tail first (EV).
    #[inline(always)]
    pub fn edge_vertices(&self, e: EdgeId) -> [VertexId; 2] {
        [self.tail(e), self.head(e)]
    }

    /// The vertices of a face in order (FV).
    #[inline(always)]
    pub fn face_vertices(&self, f: FaceId) -> [VertexId; 3] {
        let [a, b, c] = f.edges();
        [self.head(c), self.head(a), self.head(b)]
    }

    /// Every directed edge of the edge that `e` is part of, `e` among them, ascending but for a
    /// manifold pair, where `e` comes first.
    #[inline]
    pub fn edge_star(&self, e: EdgeId) -> SmallVec<[EdgeId; 2]> {
        match self.opposite(e) {
            Opposite::Edge(o) => SmallVec::from_buf([e, o]),
            Opposite::Boundary => std::iter::once(e).collect(),
            Opposite::NonManifold(row) => SmallVec::from_slice(self.edge_rows.row(row)),
        }
    }

    /// The number of faces at the edge that `e` is part of.
    fn edge_face_count(&self, e: EdgeId) -> usize {
        match self.opposite(e) {
            Opposite::Edge(_) => 2,
            Opposite::Boundary => 1,
            Opposite::NonManifold(row) => self.edge_rows.row(row).len(),
        }
    }

    /// All faces that share an edge (EF).
    pub fn edge_faces(&self, e: EdgeId) -> SmallVec<[FaceId; 2]> {
        self.edge_star(e).into_iter().map(EdgeId::face).collect()
    }

    /// The smallest directed edge of the edge that `e` is part of: its one name.
    #[inline]
    pub fn canonical(&self, e: EdgeId) -> EdgeId {
        match self.opposite(e) {
            Opposite::Edge(o) => e.min(o),
            Opposite::Boundary => e,
            Opposite::NonManifold(row) => self.edge_rows.row(row)[0],
        }
    }

    /// Whether `e` is the [name](Self::canonical) of its edge.
    #[inline]
    pub fn is_canonical(&self, e: EdgeId) -> bool {
        match self.opposite(e) {
            Opposite::Edge(o) => e < o,
            Opposite::Boundary => true,
            Opposite::NonManifold(row) => self.edge_rows.row(row)[0] == e,
        }
    }

    /// Whether exactly one face lies at `e`.
    pub fn is_boundary(&self, e: EdgeId) -> bool {
        self.opposite(e) == Opposite::Boundary
    }

    /// Whether `v` has more than one fan or touches a non-manifold edge.
    ///
    /// Constant time: a non-manifold edge ends several fans, or one at both of its ends.
    #[inline]
    pub fn is_non_manifold_vertex(&self, v: VertexId) -> bool {
        match self.outgoing(v) {
            Outgoing::Fans(_) => true,
            Outgoing::None => false,
            Outgoing::Fan(start) => matches!(self.opposite(start), Opposite::NonManifold(_)),
        }
    }

    /// Whether the face has not been collapsed away.
    #[inline(always)]
    pub fn is_live_face(&self, f: FaceId) -> bool {
        !self.store.opposite_word(f.edges()[0]).is_dead()
    }

    /// The live faces, ascending.
    pub fn faces(&self) -> impl Iterator<Item = FaceId> + '_ {
        (0..self.face_slots())
            .map(FaceId::new)
            .filter(|&f| self.is_live_face(f))
    }

    /// The live edges, one directed edge each (its smallest), ascending.
    pub fn edges(&self) -> impl Iterator<Item = EdgeId> + '_ {
        self.faces()
            .flat_map(FaceId::edges)
            .filter(|&e| self.is_canonical(e))
    }

    /// The vertices that have a face, ascending.
    pub fn vertices(&self) -> impl Iterator<Item = VertexId> + '_ {
        (0..self.vertex_slots())
            .map(VertexId::new)
            .filter(|&v| self.outgoing(v) != Outgoing::None)
    }

    /// The number of live faces.
    pub fn face_count(&self) -> usize {
        self.live_faces
    }

    /// The number of vertices that have a face.
    pub fn vertex_count(&self) -> usize {
        self.live_vertices
    }

    /// The number of face slots, dead ones included.
    pub fn face_slots(&self) -> usize {
        self.store.slots() / 3
    }

    /// The number of vertex slots, dead ones included.
    pub fn vertex_slots(&self) -> usize {
        self.outgoing.len()
    }

    /// The edges that three faces or more share, or two that run along it the same way.
    pub fn non_manifold_edge_count(&self) -> usize {
        self.edge_rows.len()
    }

    /// The vertices that have more than one fan.
    pub fn multi_fan_vertex_count(&self) -> usize {
        self.fan_rows.len()
    }

    /// The bytes that the connectivity holds: the tier's words, one word a vertex, and the side
    /// tables. Positions live elsewhere.
    pub fn bytes(&self) -> usize {
        self.store.bytes()
            + self.outgoing.capacity() * size_of::<OutgoingWord>()
            + self.edge_rows.bytes()
            + self.fan_rows.bytes()
    }

    fn set_opposite(&mut self, e: EdgeId, opposite: Opposite) {
        self.store.set_opposite_word(e, opposite.into());
    }

    fn set_outgoing(&mut self, v: VertexId, outgoing: Outgoing) {
        self.outgoing[v.index()] = outgoing.into();
    }
}

/// Calls each test function once a tier, as a test of its own named after tier and function.
#[cfg(test)]
#[macro_export]
macro_rules! for_each_tier {
    ($($name:ident),+ $(,)?) => {
        mod full { $(#[test] fn $name() { super::$name::<$crate::mesh::Full>() })+ }
        mod medium { $(#[test] fn $name() { super::$name::<$crate::mesh::Medium>() })+ }
        mod small { $(#[test] fn $name() { super::$name::<$crate::mesh::Small>() })+ }
    };
}
