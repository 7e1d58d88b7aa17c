//! An edge between two disks: the link condition and the collapse where nothing is singular, which
//! is almost everywhere.

use smallvec::SmallVec;

use super::collapse::Collapse;
use super::link::Outgoing;
use super::{EdgeId, EdgeStore, Mesh, OppositeWord, VertexId};

/// The most neighbours of an end that are looked at; two more are not. Hardly a vertex of a mesh in
/// decimation has more, and 12 would take the same time.
const FEW: usize = 16;

/// An edge between two disks of few neighbours, and what lies around it. No edge between two faces
/// that lie on each other.
///
/// ```text
///         y
///      ↗  o  ↘           around u: x and on, to before y
///     u ──────→ v        around v: y and on, to before x
///      ↘  e  ↗
///         x
/// ```
pub struct Disks {
    /// e and o.
    sides: [EdgeId; 2],
    ends: [VertexId; 2],
    /// The edges that leave each end for the vertices around it.
    leaving: [[EdgeId; FEW]; 2],
    /// The vertices around each end; places left over name the end itself.
    around: [[VertexId; FEW]; 2],
    counts: [usize; 2],
}

impl Disks {
    /// The tail and the head of the edge.
    #[inline(always)]
    pub fn ends(&self) -> [VertexId; 2] {
        self.ends
    }

    /// The vertices around the tail (0) or the head (1), in the order of the walk, without the other
    /// end and the apex before it, and how many they are; places left over name the end itself.
    #[inline(always)]
    pub fn around(&self, end: usize) -> (&[VertexId; FEW], usize) {
        (&self.around[end], self.counts[end].min(FEW))
    }

    /// The apexes of the edge's two faces: what comes first around the tail, and around the head.
    #[inline(always)]
    pub fn apexes(&self) -> [VertexId; 2] {
        [self.around[0][0], self.around[1][0]]
    }

    /// The edges that leave the vertex that a [collapse](Mesh::collapse_between) leaves, in the order of
    /// its fan: those of the tail, then those of the head.
    #[inline(always)]
    pub fn spokes(&self) -> SmallVec<[EdgeId; 2 * FEW]> {
        let [of_tail, of_head] = self.counts.map(|count| count.min(FEW));
        let mut spokes = [self.sides[0]; 2 * FEW];
        // Copied whole, which takes no loop.
        spokes[..FEW].copy_from_slice(&self.leaving[0]);
        spokes[of_tail..][..FEW].copy_from_slice(&self.leaving[1]);
        SmallVec::from_buf_and_len(spokes, of_tail + of_head)
    }

    /// The [link condition](Mesh::link_condition).
    #[inline(always)]
    pub fn link_condition(&self) -> bool {
        let ((around_u, _), (around_v, count_v)) = (self.around(0), self.around(1));
        let is_around_u = |z| around_u.iter().fold(false, |any, &x| any | (x == z));
        let is_common = around_v[..count_v]
            .iter()
            .fold(false, |any, &z| any | is_around_u(z));
        let is_tetrahedron = self.counts[0].max(self.counts[1]) == 1;
        !is_common && !is_tetrahedron
    }
}

impl<S: EdgeStore> Mesh<S> {
    /// What lies around an edge between two disks of few neighbours; nothing of another edge.
    ///
    /// Costs one walk around both ends.
    #[inline]
    pub fn disks(&self, e: EdgeId) -> Option<Disks> {
        let o = self.mate(e)?;
        let [u, v] = self.edge_vertices(e);
        if !self.has_one_fan(u) || !self.has_one_fan(v) {
            return None;
        }
        let mut disks = Disks {
            sides: [e, o],
            ends: [u, v],
            leaving: [[e; FEW]; 2],
            around: [[u; FEW], [v; FEW]],
            counts: [0; 2],
        };
        let (mut at_u, mut at_v) = (self.step(e)?, self.step(o)?);
        let (end_u, end_v) = (self.next(o), self.next(e));
        let (mut count_u, mut count_v) = (0, 0);
        let [leaving_u, leaving_v] = &mut disks.leaving;
        let [around_u, around_v] = &mut disks.around;
        // Both ways at once: each step waits for the one before it, but not for the other way's. The one
        // that is through goes in circles, so that there is but one end to foresee.
        loop {
            let (goes_on_u, goes_on_v) = (at_u != end_u, at_v != end_v);
            // Added, since the compiler makes two branches of an or.
            let [way_u, way_v] =
                [(at_u, end_u), (at_v, end_v)].map(|(at, end)| at.index() ^ end.index());
            if way_u + way_v == 0 {
                break;
            }
            (*leaving_u.get_mut(count_u)?, around_u[count_u]) = (at_u, self.head(at_u));
            (*leaving_v.get_mut(count_v)?, around_v[count_v]) = (at_v, self.head(at_v));
            let (next_u, next_v) = (self.step(at_u)?, self.step(at_v)?);
            at_u = if goes_on_u { next_u } else { at_u };
            at_v = if goes_on_v { next_v } else { at_v };
            count_u += usize::from(goes_on_u);
            count_v += usize::from(goes_on_v);
        }
        for (around, count, end) in [(around_u, count_u, u), (around_v, count_v, v)] {
            if let Some(beyond) = around.get_mut(count) {
                *beyond = end;
            }
        }
        disks.counts = [count_u, count_v];
        // Two faces on each other have nothing else around them.
        (count_u > 0 && count_v > 0).then_some(disks)
    }

    /// [Collapses](Self::collapse) an edge between two disks.
    #[inline]
    pub(super) fn collapse_disks(&mut self, disks: &Disks) -> Collapse {
        let [e, o] = disks.sides;
        let [removed, kept] = disks.ends;
        let first = disks.leaving[0][0];
        for &leaving in &disks.leaving[0][..disks.counts[0].min(FEW)] {
            self.store.set_tail(leaving, kept);
        }
        let merged_edges = [e, o].map(|d| self.close_face(d));
        let dead_faces = [e, o].map(EdgeId::face);
        for dead in dead_faces.into_iter().flat_map(|f| f.edges()) {
            self.store.set_opposite_word(dead, OppositeWord::DEAD);
        }
        self.live_faces -= 2;
        self.live_vertices -= 1;
        self.set_outgoing(removed, Outgoing::None);
        self.set_outgoing(kept, Outgoing::Fan(first));
        Collapse {
            kept,
            removed,
            dead_faces: SmallVec::from_buf(dead_faces),
            merged_edges: SmallVec::from_buf(merged_edges),
        }
    }

    /// The edge behind `e` in the fan of its tail, of which the last has none.
    #[inline(always)]
    fn step(&self, e: EdgeId) -> Option<EdgeId> {
        self.mate(self.prev(e))
    }

    #[inline(always)]
    fn has_one_fan(&self, v: VertexId) -> bool {
        matches!(self.outgoing(v), Outgoing::Fan(_))
    }
}
