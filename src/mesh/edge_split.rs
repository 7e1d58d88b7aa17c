//! The split of an edge: a vertex in its middle, and each face at it becomes two.

use smallvec::SmallVec;

use super::link::Opposite;
use super::{EdgeId, EdgeStore, FaceId, Mesh, VertexId};

impl<S: EdgeStore> Mesh<S> {
    /// Whether `e` can be split with these slots: it is there, and they are free, one for each face
    /// at it.
    ///
    /// Any edge can: the complex is the same but for the new vertex, which is as manifold as the
    /// edge.
    pub fn edge_split_condition(&self, e: EdgeId, vertex: VertexId, faces: &[FaceId]) -> bool {
        self.has_face(e.face())
            && self.is_free_vertex(vertex)
            && faces.len() == self.edge_star(e).len()
            && self.are_free_faces(faces)
    }

    /// Splits `e` at a new vertex.
    ///
    /// ```text
    ///         x                    x
    ///       /   \                / | \
    ///      /     \      →       /  |  \         in each face at the edge d stays in the face of
    ///     s ──d──> t           s ─d→ m ─→ t     its tail; the other half is the new face
    /// ```
    ///
    /// The faces are taken in the order of [`edge_star(e)`](Self::edge_star). Needs
    /// [`edge_split_condition`](Self::edge_split_condition). Costs no walk.
    pub fn split_edge(&mut self, e: EdgeId, vertex: VertexId, faces: &[FaceId]) {
        debug_assert!(
            self.edge_split_condition(e, vertex, faces),
            "{e:?} cannot be split at {vertex:?} into {faces:?}"
        );
        let end = self.tail(e);
        let star = self.take_star(e);
        // The directed edges between the new vertex and `end`, and those beyond it.
        let mut halves: [SmallVec<[EdgeId; 2]>; 2] = Default::default();
        let mut outgoing: SmallVec<[EdgeId; 4]> = SmallVec::new();
        for (&d, new) in star.iter().zip(faces) {
            let (s, t, x) = (self.tail(d), self.head(d), self.apex(d));
            let behind = self.next(d);
            // m→t, t→x and x→m.
            let [to_t, to_x, to_m] = new.edges();
            for (edge, tail) in [(to_t, vertex), (to_x, t), (to_m, x)] {
                self.store.set_tail(edge, tail);
            }
            self.move_link(behind, to_x);
            self.replace_fan(t, behind, to_x);
            self.store.set_tail(behind, vertex);
            self.set_opposite(behind, Opposite::Edge(to_m));
            self.set_opposite(to_m, Opposite::Edge(behind));
            halves[usize::from(s != end)].push(d);
            halves[usize::from(s == end)].push(to_t);
            outgoing.extend([behind, to_t]);
        }
        for half in &halves {
            self.link_edge(half);
        }
        self.live_faces += faces.len();
        self.find_fans_among(vertex, &mut outgoing);
    }
}
