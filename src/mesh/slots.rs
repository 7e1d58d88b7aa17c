//! Slots: where new faces and vertices go. Those of dead ones are used again, or the mesh grows.

use super::link::{Outgoing, OutgoingWord};
use super::{EdgeStore, FaceId, Mesh, VertexId};

impl<S: EdgeStore> Mesh<S> {
    /// One more face slot, dead; nothing where 31 bits number no more directed edges.
    pub fn new_face(&mut self) -> Option<FaceId> {
        let face = self.face_slots();
        (face < i32::MAX as usize / 3).then(|| {
            self.store.push_face();
            FaceId::new(face)
        })
    }

    /// One more vertex slot, without a face; nothing where 31 bits number no more vertices.
    pub fn new_vertex(&mut self) -> Option<VertexId> {
        let vertex = self.vertex_slots();
        (vertex < i32::MAX as usize).then(|| {
            self.outgoing.push(OutgoingWord::from(Outgoing::None));
            VertexId::new(vertex)
        })
    }

    /// Whether a face is there.
    pub(super) fn has_face(&self, f: FaceId) -> bool {
        f.index() < self.face_slots() && self.is_live_face(f)
    }

    /// Whether these slots, each named once, can take new faces.
    pub(super) fn are_free_faces(&self, faces: &[FaceId]) -> bool {
        let is_free = |(i, f): (usize, &FaceId)| {
            f.index() < self.face_slots() && !self.is_live_face(*f) && !faces[..i].contains(f)
        };
        faces.iter().enumerate().all(is_free)
    }

    /// Whether this slot can take a new vertex.
    pub(super) fn is_free_vertex(&self, v: VertexId) -> bool {
        v.index() < self.vertex_slots() && self.outgoing(v) == Outgoing::None
    }
}
