//! Components: faces that hang together through vertices.

use super::link::{Opposite, Outgoing};
use super::{EdgeStore, FaceId, Mesh, OppositeWord, VertexId};

/// What was met.
struct Seen {
    faces: Vec<bool>,
    vertices: Vec<bool>,
}

impl Seen {
    /// Says of each face once that it is new.
    fn is_new_face(&mut self, f: FaceId) -> bool {
        !std::mem::replace(&mut self.faces[f.index()], true)
    }

    /// Says of each vertex once that it is new.
    fn is_new_vertex(&mut self, v: VertexId) -> bool {
        !std::mem::replace(&mut self.vertices[v.index()], true)
    }
}

impl<S: EdgeStore> Mesh<S> {
    /// The faces that hang together, through vertices, component by component. Linear time.
    pub fn components(&self) -> Vec<Vec<FaceId>> {
        let mut components = Vec::new();
        let mut seen = Seen {
            faces: vec![false; self.face_slots()],
            vertices: vec![false; self.vertex_slots()],
        };
        for f in self.faces() {
            if seen.is_new_face(f) {
                components.push(self.flood(f, &mut seen));
            }
        }
        components
    }

    /// The faces that hang together with `f`. Walks around each vertex once.
    fn flood(&self, f: FaceId, seen: &mut Seen) -> Vec<FaceId> {
        let mut component = vec![f];
        let mut at = 0;
        while let Some(&f) = component.get(at) {
            at += 1;
            for v in self.face_vertices(f) {
                if seen.is_new_vertex(v) {
                    component.extend(self.vertex_faces(v).filter(|&g| seen.is_new_face(g)));
                }
            }
        }
        component
    }

    /// Removes faces that hang together with no others.
    pub fn remove_component(&mut self, faces: &[FaceId]) {
        for e in faces.iter().flat_map(|f| f.edges()) {
            let v = self.tail(e);
            if let Outgoing::Fans(row) = self.outgoing(v) {
                self.fan_rows.remove(row);
            }
            self.live_vertices -= usize::from(self.outgoing(v) != Outgoing::None);
            self.set_outgoing(v, Outgoing::None);
            if let Opposite::NonManifold(row) = self.opposite(e) {
                for e in self.edge_rows.remove(row) {
                    self.set_opposite(e, Opposite::Boundary);
                }
            }
        }
        for e in faces.iter().flat_map(|f| f.edges()) {
            self.store.set_opposite_word(e, OppositeWord::DEAD);
        }
        self.live_faces -= faces.len();
    }
}
