//! The split of a face: a vertex in its middle, and three faces around it.

use super::link::{Opposite, Outgoing};
use super::{EdgeStore, FaceId, Mesh, VertexId};

impl<S: EdgeStore> Mesh<S> {
    /// Whether `face` can be split with these slots: it is there, and they are free. Any face can.
    pub fn face_split_condition(&self, face: FaceId, vertex: VertexId, faces: [FaceId; 2]) -> bool {
        self.has_face(face) && self.is_free_vertex(vertex) && self.are_free_faces(&faces)
    }

    /// Splits a face in three at a new vertex.
    ///
    /// ```text
    ///         c
    ///       / | \          the face keeps its first edge, from a to b; the first new one has that
    ///      /  m  \         from b to c, the second that from c to a
    ///     / /   \ \
    ///    a ─────── b
    /// ```
    ///
    /// Needs [`face_split_condition`](Self::face_split_condition). Constant time.
    pub fn split_face(&mut self, face: FaceId, vertex: VertexId, faces: [FaceId; 2]) {
        debug_assert!(
            self.face_split_condition(face, vertex, faces),
            "{face:?} cannot be split at {vertex:?} into {faces:?}"
        );
        let [a, b, c] = self.face_vertices(face);
        let [_, bc, ca] = face.edges();
        let [[to_c, c_in, out_b], [to_a, a_in, out_c]] = faces.map(FaceId::edges);
        for (old, new, v) in [(bc, to_c, b), (ca, to_a, c)] {
            self.move_link(old, new);
            self.replace_fan(v, old, new);
        }
        let tails = [
            (ca, vertex),
            (to_c, b),
            (c_in, c),
            (out_b, vertex),
            (to_a, c),
            (a_in, a),
            (out_c, vertex),
        ];
        for (edge, tail) in tails {
            self.store.set_tail(edge, tail);
        }
        for (x, y) in [(bc, out_b), (ca, a_in), (c_in, out_c)] {
            self.set_opposite(x, Opposite::Edge(y));
            self.set_opposite(y, Opposite::Edge(x));
        }
        self.set_outgoing(vertex, Outgoing::Fan(ca));
        self.live_faces += 2;
        self.live_vertices += 1;
    }
}
