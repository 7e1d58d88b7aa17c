//! A face between two boundary edges that meet: a step towards closing a gap.

use super::link::Outgoing;
use super::{EdgeId, EdgeStore, FaceId, Mesh, VertexId};

impl<S: EdgeStore> Mesh<S> {
    /// The boundary edge behind `e`, where a face between both makes nothing less manifold: no edge
    /// joins their far ends yet, and all three vertices lie on one boundary only.
    ///
    /// Costs a walk around three vertices.
    pub fn fill_condition(&self, e: EdgeId) -> Option<EdgeId> {
        if !self.is_boundary(e) {
            return None;
        }
        let next = self.next_on_boundary(e)?;
        let (a, v, b) = (self.tail(e), self.head(e), self.head(next));
        let is_on_one = |x: VertexId| match self.outgoing(x) {
            Outgoing::Fan(start) => {
                self.is_boundary(start) && self.is_boundary(self.fan_end(start))
            }
            _ => false,
        };
        let may =
            a != b && [a, v, b].into_iter().all(is_on_one) && !self.neighbours(a).any(|x| x == b);
        may.then_some(next)
    }

    /// Puts the dead `face` between the boundary edge `e` and the one behind it.
    ///
    /// ```text
    ///        v                  v
    ///      ↗   ↘              ↗ | ↘        the face v a b; its edge a→b is boundary
    ///     a     b     →      a ──→ b
    /// ```
    ///
    /// Returns a, v and b. Needs [`fill_condition(e)`](Self::fill_condition). Costs a walk around
    /// each.
    pub fn fill(&mut self, e: EdgeId, face: FaceId) -> [VertexId; 3] {
        let next = self.next_on_boundary(e).expect("a boundary edge behind");
        let (a, v, b) = (self.tail(e), self.head(e), self.head(next));
        self.add_face([v, a, b], face);
        // The walk around v, closed now, begins where it did: sums along it stay what they were.
        self.set_outgoing(v, Outgoing::Fan(next));
        [a, v, b]
    }
}
