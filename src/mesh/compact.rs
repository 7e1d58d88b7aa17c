//! Closes the gaps that collapses leave.

use super::link::{Opposite, Outgoing};
use super::{EdgeId, EdgeStore, FaceId, Mesh, VertexId};

/// Where everything went: old slot → new slot. Corner 3f+k goes where its face goes.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Compaction {
    /// One entry a former vertex slot; nothing for a dead or isolated vertex.
    pub vertices: Vec<Option<VertexId>>,
    /// One entry a former face slot; nothing for a dead face.
    pub faces: Vec<Option<FaceId>>,
}

impl Compaction {
    /// The new name of a directed edge, which is also its tail's corner in its face.
    pub fn edge(&self, e: EdgeId) -> Option<EdgeId> {
        self.faces[e.face().index()].map(|f| f.edges()[e.index() % 3])
    }

    /// Keeps the entries of an array with one element a vertex (or a face, with the other map), in
    /// the new order.
    pub fn retain<T, I>(map: &[Option<I>], values: &mut Vec<T>) {
        let mut keep = map.iter().map(Option::is_some);
        values.retain(|_| keep.next().unwrap_or(false));
        values.shrink_to_fit();
    }
}

impl<S: EdgeStore> Mesh<S> {
    /// Moves live faces and vertices down into the dead slots, keeping their order, and says where
    /// each went. Linear time.
    pub fn compact(&mut self) -> Compaction {
        let mut faces = vec![None; self.face_slots()];
        for (to, f) in self.faces().enumerate() {
            faces[f.index()] = Some(FaceId::new(to));
        }
        let mut vertices = vec![None; self.vertex_slots()];
        for (to, v) in self.vertices().enumerate() {
            vertices[v.index()] = Some(VertexId::new(to));
        }
        let map = Compaction { vertices, faces };
        let edge = |e: EdgeId| map.edge(e).expect("a live link names a live edge");

        for (from, to) in map.faces.iter().enumerate() {
            let Some(to) = *to else { continue };
            self.store.move_face(from, to.index());
            for e in to.edges() {
                if let Opposite::Edge(o) = self.opposite(e) {
                    self.set_opposite(e, Opposite::Edge(edge(o)));
                }
                let head = map.vertices[self.head(e).index()].expect("a live face's vertex lives");
                // The tail of the next edge is the head of this one, in every tier.
                let next = self.next(e);
                self.store.set_tail(next, head);
            }
        }
        self.store.truncate(self.live_faces);
        self.edge_rows.rename(edge);
        self.fan_rows.rename(edge);
        for (from, to) in map.vertices.iter().enumerate() {
            let Some(to) = *to else { continue };
            let outgoing = match self.outgoing(VertexId::new(from)) {
                Outgoing::Fan(e) => Outgoing::Fan(edge(e)),
                other => other,
            };
            self.set_outgoing(to, outgoing);
        }
        self.outgoing.truncate(self.live_vertices);
        self.outgoing.shrink_to_fit();
        map
    }

    /// The live triangles in the order of their slots, three vertex slots each.
    pub fn triangles(&self) -> Vec<[u32; 3]> {
        let slots = |f| self.face_vertices(f).map(|v| v.index() as u32);
        let mut triangles = Vec::with_capacity(self.live_faces);
        triangles.extend(self.faces().map(slots));
        triangles
    }
}
