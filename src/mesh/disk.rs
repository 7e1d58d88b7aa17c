//! An edge between two disks: the link condition and the collapse where nothing is singular, which
//! is almost everywhere.

use smallvec::SmallVec;

use super::collapse::Collapse;
use super::link::Outgoing;
use super::{EdgeId, EdgeStore, Mesh, OppositeWord, VertexId};

/// The neighbours of the tail that are compared at once, beside the head and the apexes. Meshes
/// in decimation have hardly a vertex of valence above 15.
const FEW: usize = 12;

/// The neighbours of the head that are compared; more ask for a way that does not look at all.
const MANY: usize = 48;

impl<S: EdgeStore> Mesh<S> {
    /// The [link condition](Self::link_condition) of an edge between two disks of few neighbours;
    /// nothing of another edge.
    ///
    /// ```text
    ///         y
    ///      ↗  o  ↘           `others` of u: from behind u→x to before u→y,
    ///     u ──────→ v                of v: from behind v→y to before v→x
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
        // The places that are left name v, which is no neighbour of itself.
        let mut around_u = [v; FEW];
        let mut others_of_u = 0;
        let (to_x, to_y) = (self.step(e)?, self.next(o));
        let mut at = to_x;
        while at != to_y {
            at = self.step(at)?;
            if at != to_y {
                *around_u.get_mut(others_of_u)? = self.head(at);
                others_of_u += 1;
            }
        }
        let mut others_of_v = 0;
        let mut is_common = false;
        let last = self.next(e);
        let mut at = self.step(o)?;
        while at != last {
            at = self.step(at)?;
            if at != last {
                let z = self.head(at);
                is_common |= around_u.iter().fold(false, |any, &x| any | (x == z));
                others_of_v += 1;
                if others_of_v == MANY {
                    return None;
                }
            }
        }
        let is_tetrahedron = others_of_u + others_of_v == 0 && to_x != to_y;
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
