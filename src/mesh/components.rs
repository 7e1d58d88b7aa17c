//! Components: faces that hang together through vertices.

use super::link::{Opposite, Outgoing};
use super::{EdgeStore, FaceId, Mesh, OppositeWord};

impl<S: EdgeStore> Mesh<S> {
    /// The faces that hang together, through vertices, component by component.
    pub fn components(&self) -> Vec<Vec<FaceId>> {
        let mut seen = vec![false; self.face_slots()];
        let mut components = Vec::new();
        for f in self.faces() {
            if !seen[f.index()] {
                components.push(self.flood(f, |g| !std::mem::replace(&mut seen[g.index()], true)));
            }
        }
        components
    }

    /// The faces that hang together with `f`; `is_new` says of each once that it is.
    fn flood(&self, f: FaceId, mut is_new: impl FnMut(FaceId) -> bool) -> Vec<FaceId> {
        is_new(f);
        let mut component = vec![f];
        let mut at = 0;
        while let Some(&f) = component.get(at) {
            at += 1;
            for v in self.face_vertices(f) {
                component.extend(self.vertex_faces(v).filter(|&g| is_new(g)));
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
