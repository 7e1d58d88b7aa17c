//! An edge between two disks: the link condition and the collapse where nothing is singular, which
//! is almost everywhere.

use smallvec::SmallVec;

use super::collapse::Collapse;
use super::link::Outgoing;
use super::{EdgeId, EdgeStore, Mesh, OppositeWord, VertexId};

/// The most neighbours of an end that are compared; two more are not. Hardly a vertex of a mesh in
/// decimation has more, and 12 would take the same time.
const FEW: usize = 16;

impl<S: EdgeStore> Mesh<S> {
    /// The [link condition](Self::link_condition) of an edge between two disks of few neighbours;
    /// nothing of another edge.
    ///
    /// ```text
    ///         y
    ///      ↗  o  ↘           around u: from u→x to before u→y
    ///     u ──────→ v        around v: from v→y to before v→x
    ///      ↘  e  ↗
    ///         x
    /// ```
    #[inline]
    pub(super) fn link_condition_of_disks(&self, e: EdgeId) -> Option<bool> {
        let o = self.mate(e)?;
        let [u, v] = self.edge_vertices(e);
        if !self.has_one_fan(u) || !self.has_one_fan(v) {
            return None;
        }
        let (mut at_u, mut at_v) = (self.step(e)?, self.step(o)?);
        let (end_u, end_v) = (self.next(o), self.next(e));
        let are_on_each_other = at_u == end_u;
        // Places left over name the vertex itself, which is on neither way.
        let (mut around_u, mut around_v) = ([u; FEW], [v; FEW]);
        let (mut of_u, mut of_v) = (around_u.iter_mut(), around_v.iter_mut());
        // Both ways at once: each step waits for the one before it, but not for the other way's.
        while at_u != end_u && at_v != end_v {
            (*of_u.next()?, *of_v.next()?) = (self.head(at_u), self.head(at_v));
            (at_u, at_v) = (self.step(at_u)?, self.step(at_v)?);
        }
        while at_u != end_u {
            *of_u.next()? = self.head(at_u);
            at_u = self.step(at_u)?;
        }
        while at_v != end_v {
            *of_v.next()? = self.head(at_v);
            at_v = self.step(at_v)?;
        }
        let (left_u, left_v) = (of_u.len(), of_v.len());
        let is_around_u = |z| around_u.iter().fold(false, |any, &x| any | (x == z));
        let around_v = around_v[..FEW - left_v].iter();
        let is_common = around_v.fold(false, |any, &z| any | is_around_u(z));
        let is_tetrahedron = left_u.min(left_v) == FEW - 1 && !are_on_each_other;
        Some(!is_common && !is_tetrahedron)
    }

    /// [Collapses](Self::collapse) an edge between two disks; does nothing to another edge.
    #[inline]
    pub(super) fn collapse_disks(&mut self, e: EdgeId) -> Option<Collapse> {
        let o = self.mate(e)?;
        let [removed, kept] = self.edge_vertices(e);
        if !self.is_disk(removed) || !self.is_disk(kept) {
            return None;
        }
        let (first, last) = (self.step(e)?, self.next(o));
        // Two faces on each other are no disks.
        if first == last {
            return None;
        }
        let mut at = first;
        while at != last {
            self.store.set_tail(at, kept);
            at = self.step(at).expect("the fan of a disk is closed");
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
        Some(Collapse {
            kept,
            removed,
            dead_faces: SmallVec::from_buf(dead_faces),
            merged_edges: SmallVec::from_buf(merged_edges),
        })
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

    /// Whether `v` has one fan, and it is closed.
    #[inline(always)]
    fn is_disk(&self, v: VertexId) -> bool {
        matches!(self.outgoing(v), Outgoing::Fan(start) if self.mate(start).is_some())
    }
}
