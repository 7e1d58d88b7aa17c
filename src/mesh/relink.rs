//! Links made anew around what changed: what the operations have in common.

use smallvec::SmallVec;

use super::link::{Opposite, Outgoing};
use super::{EdgeId, EdgeStore, Mesh, VertexId};

impl<S: EdgeStore> Mesh<S> {
    /// A directed edge between two vertices, in either direction, if there is one. Costs a walk
    /// around the first.
    pub fn find_edge(&self, a: VertexId, b: VertexId) -> Option<EdgeId> {
        let sides = self.outgoing_edges(a).flat_map(|e| [e, self.prev(e)]);
        let mut between = sides.filter(|&e| self.tail(e) == b || self.head(e) == b);
        between.next()
    }

    /// Lets these directed edges, all there are of one edge, lie across from each other. Their row,
    /// if they had one, must have been [taken](Self::take_star).
    pub(super) fn link_edge(&mut self, star: &[EdgeId]) {
        match *star {
            [a] => self.set_opposite(a, Opposite::Boundary),
            [a, b] if self.tail(a) == self.head(b) => {
                self.set_opposite(a, Opposite::Edge(b));
                self.set_opposite(b, Opposite::Edge(a));
            }
            _ if star.is_empty() => {}
            _ => {
                let row = Opposite::NonManifold(self.edge_rows.insert(star.to_vec()));
                star.iter().for_each(|&e| self.set_opposite(e, row));
            }
        }
    }

    /// Every directed edge of the edge that `e` is part of; their row is freed, and they wait to be
    /// [linked](Self::link_edge).
    pub(super) fn take_star(&mut self, e: EdgeId) -> SmallVec<[EdgeId; 2]> {
        match self.opposite(e) {
            Opposite::NonManifold(row) => SmallVec::from_vec(self.edge_rows.remove(row)),
            Opposite::Edge(_) | Opposite::Boundary => self.edge_star(e),
        }
    }

    /// The outgoing edges of `v`, which has no fans after that, until they are
    /// [found](Self::find_fans_among).
    pub(super) fn take_fans(&mut self, v: VertexId) -> Vec<EdgeId> {
        let outgoing: Vec<EdgeId> = self.outgoing_edges(v).collect();
        self.free_fans(v);
        self.live_vertices -= usize::from(!outgoing.is_empty());
        self.set_outgoing(v, Outgoing::None);
        outgoing
    }

    /// Lets `new` lie where `old` lay: across from what it lay across from.
    pub(super) fn move_link(&mut self, old: EdgeId, new: EdgeId) {
        let link = self.opposite(old);
        match link {
            Opposite::Edge(o) => self.set_opposite(o, Opposite::Edge(new)),
            Opposite::Boundary => {}
            Opposite::NonManifold(row) => self.edge_rows.replace(row, old, new),
        }
        self.set_opposite(new, link);
    }
}
