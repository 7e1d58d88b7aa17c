//! A face more, a face less: on an edge of any number of faces.

use super::{EdgeStore, FaceId, Mesh, OppositeWord, VertexId};

impl<S: EdgeStore> Mesh<S> {
    /// Whether a face of these vertices can be put into the slot `face`: the slot is free, the
    /// vertices are three, and no face has the same three.
    ///
    /// Edges and vertices may become non-manifold by it, or cease to be. Costs a walk around the
    /// first vertex.
    pub fn add_condition(&self, vertices: [VertexId; 3], face: FaceId) -> bool {
        let [a, b, c] = vertices;
        let are_three = a != b && b != c && c != a;
        let are_there = vertices.iter().all(|v| v.index() < self.vertex_slots());
        are_three && are_there && self.are_free_faces(&[face]) && {
            let is_same = |f| {
                let others = self.face_vertices(f);
                others.contains(&b) && others.contains(&c)
            };
            !self.vertex_faces(a).any(is_same)
        }
    }

    /// Adds a face of these vertices, in this order from its first directed edge on.
    ///
    /// ```text
    ///     a ────── b           an edge with one face more is manifold where it was boundary and the
    ///      \ face /            faces run along it both ways, else non-manifold: it gets a row of
    ///       \    /             the side table, or its row one entry more; the fans of all three
    ///         c                vertices are found anew
    /// ```
    ///
    /// Needs [`add_condition`](Self::add_condition). Costs a walk around each vertex.
    pub fn add_face(&mut self, vertices: [VertexId; 3], face: FaceId) {
        debug_assert!(
            self.add_condition(vertices, face),
            "{face:?} of {vertices:?} cannot be added"
        );
        let [a, b, c] = vertices;
        let beside = [[a, b], [b, c], [c, a]].map(|[s, t]| self.find_edge(s, t));
        let outgoing = vertices.map(|v| self.take_fans(v));
        let edges = face.edges();
        for (e, v) in edges.into_iter().zip(vertices) {
            self.store.set_tail(e, v);
        }
        for (e, beside) in edges.into_iter().zip(beside) {
            let mut star = beside.map_or_else(Default::default, |e| self.take_star(e));
            star.push(e);
            self.link_edge(&star);
        }
        self.live_faces += 1;
        for ((e, v), mut outgoing) in edges.into_iter().zip(vertices).zip(outgoing) {
            outgoing.push(e);
            self.find_fans_among(v, &mut outgoing);
        }
    }

    /// Whether `face` can be removed: it is there.
    pub fn remove_condition(&self, face: FaceId) -> bool {
        self.has_face(face)
    }

    /// Removes a face; a vertex that it leaves without any dies.
    ///
    /// Needs [`remove_condition`](Self::remove_condition). Costs a walk around each vertex.
    pub fn remove_face(&mut self, face: FaceId) {
        debug_assert!(self.remove_condition(face), "{face:?} is not there");
        let vertices = self.face_vertices(face);
        let outgoing = vertices.map(|v| self.take_fans(v));
        for e in face.edges() {
            let mut star = self.take_star(e);
            star.retain(|other| *other != e);
            self.link_edge(&star);
            self.store.set_opposite_word(e, OppositeWord::DEAD);
        }
        self.live_faces -= 1;
        for ((e, v), mut outgoing) in face.edges().into_iter().zip(vertices).zip(outgoing) {
            outgoing.retain(|other| *other != e);
            self.find_fans_among(v, &mut outgoing);
        }
    }
}
