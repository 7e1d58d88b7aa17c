//! The split of a vertex: a collapse undone (Hoppe 1996, *Progressive meshes*).

use smallvec::SmallVec;

use super::{EdgeId, EdgeStore, FaceId, Mesh, VertexId};

/// How a vertex becomes two, joined by an edge.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct VertexSplit {
    /// The vertex that is split, and stays.
    pub kept: VertexId,
    /// The new vertex: the one that the collapse removes.
    pub removed: VertexId,
    /// The new faces, one for each face at the edge between both, with their vertices in order.
    pub faces: SmallVec<[(FaceId, [VertexId; 3]); 2]>,
    /// The edges leaving the kept vertex that will leave the new one: one for each face that goes
    /// over to it.
    pub corners: SmallVec<[EdgeId; 8]>,
}

impl<S: EdgeStore> Mesh<S> {
    /// The split that undoes [`collapse(e)`](Self::collapse), to be asked for before it.
    ///
    /// Costs one walk around the tail. A collapse that nobody will undo need not be recorded.
    pub fn split_undoing(&self, e: EdgeId) -> VertexSplit {
        let [removed, kept] = self.edge_vertices(e);
        let star = self.edge_star(e);
        let faces = star
            .iter()
            .map(|d| (d.face(), self.face_vertices(d.face())));
        let touches_kept = |e: &EdgeId| self.head(*e) == kept || self.apex(*e) == kept;
        let corners = self.outgoing_edges(removed).filter(|e| !touches_kept(e));
        VertexSplit {
            kept,
            removed,
            faces: faces.collect(),
            corners: corners.collect(),
        }
    }

    /// Whether a split is the inverse of a collapse: its slots are free, its corners are there, and
    /// after it [`link_condition`](Self::link_condition) allows to collapse the new edge onto the
    /// kept vertex.
    ///
    /// Costs a walk around the kept vertex, sorted, and the connectivity of the faces there.
    pub fn vertex_split_condition(&self, split: &VertexSplit) -> bool {
        let VertexSplit {
            kept,
            removed,
            ref faces,
            ref corners,
        } = *split;
        let slots: SmallVec<[FaceId; 2]> = faces.iter().map(|&(f, _)| f).collect();
        if kept.index() >= self.vertex_slots()
            || !self.is_free_vertex(removed)
            || kept == removed
            || !self.are_free_faces(&slots)
        {
            return false;
        }
        let mut apexes: SmallVec<[VertexId; 2]> = SmallVec::new();
        for (_, vertices) in faces {
            match apex_beside(vertices, kept, removed) {
                Some(x) if !apexes.contains(&x) => apexes.push(x),
                _ => return false,
            }
        }
        let mut moved = corners.clone();
        moved.sort_unstable();
        let before = moved.len();
        moved.dedup();
        let mut found = 0;
        let mut triangles: Vec<[VertexId; 3]> = faces.iter().map(|&(_, t)| t).collect();
        for e in self.outgoing_edges(kept) {
            let is_moved = moved.binary_search(&e).is_ok();
            found += usize::from(is_moved);
            let tail = if is_moved { removed } else { kept };
            triangles.push([tail, self.head(e), self.apex(e)]);
        }
        before == found && {
            let (around, vertices) = Self::around(&triangles);
            let name = |v| VertexId::new(vertices.partition_point(|&x| x < v));
            let mut new = around.outgoing_edges(name(removed));
            new.find(|&e| around.head(e) == name(kept))
                .is_some_and(|e| around.link_condition(e))
        }
    }

    /// The connectivity of a few triangles, and the vertices that its own stand for, ascending.
    fn around(triangles: &[[VertexId; 3]]) -> (Self, Vec<VertexId>) {
        let mut vertices: Vec<VertexId> = triangles.iter().flatten().copied().collect();
        vertices.sort_unstable();
        vertices.dedup();
        let name = |v: VertexId| vertices.partition_point(|&x| x < v) as u32;
        let named: Vec<[u32; 3]> = triangles.iter().map(|t| t.map(name)).collect();
        (Self::from_triangles(vertices.len(), &named), vertices)
    }

    /// Splits a vertex in two.
    ///
    /// ```text
    ///        x                    x
    ///        |                  /   \
    ///     …  v  …      →    …  u ──> v  …      u takes its corners from v; each new face has the
    ///        |                  \   /          edge u v and, at its apex, lies between the two edges
    ///        y                    y            that one edge of v becomes
    /// ```
    ///
    /// After a collapse and the split [undoing](Self::split_undoing) it the triangles are the same
    /// in the same slots, from the same corners on. Needs
    /// [`vertex_split_condition`](Self::vertex_split_condition). Costs a walk around the vertex and
    /// around each apex.
    pub fn split_vertex(&mut self, split: &VertexSplit) {
        debug_assert!(
            self.vertex_split_condition(split),
            "{split:?} is no collapse undone"
        );
        let VertexSplit {
            kept,
            removed,
            ref faces,
            ref corners,
        } = *split;
        let apex = |t: &[VertexId; 3]| apex_beside(t, kept, removed).expect("a face at the edge");
        let apexes: SmallVec<[VertexId; 2]> = faces.iter().map(|(_, t)| apex(t)).collect();
        let between = |x: &VertexId| self.find_edge(kept, *x).expect("the apex is a neighbour");
        let joined: SmallVec<[EdgeId; 2]> = apexes.iter().map(between).collect();
        let mut around: Vec<(VertexId, Vec<EdgeId>)> = [kept, removed]
            .iter()
            .chain(&apexes)
            .map(|&v| (v, self.take_fans(v)))
            .collect();
        let stars: SmallVec<[SmallVec<[EdgeId; 2]>; 2]> =
            joined.iter().map(|&e| self.take_star(e)).collect();
        for &e in corners {
            self.store.set_tail(e, removed);
        }
        around[1].1.extend(corners);
        around[0].1.retain(|&e| self.store.tail(e) == kept);
        let mut edge: SmallVec<[EdgeId; 2]> = SmallVec::new();
        for ((face, vertices), star) in faces.iter().zip(&stars) {
            let mut sides: [SmallVec<[EdgeId; 2]>; 2] = Default::default();
            let touches = |mesh: &Self, e, v| mesh.tail(e) == v || mesh.head(e) == v;
            for (e, &v) in face.edges().into_iter().zip(vertices) {
                self.store.set_tail(e, v);
            }
            for &e in star.iter().chain(&face.edges()) {
                match (touches(self, e, kept), touches(self, e, removed)) {
                    (true, true) => edge.push(e),
                    (is_kept, _) => sides[usize::from(is_kept)].push(e),
                }
            }
            for side in &sides {
                self.link_edge(side);
            }
        }
        self.link_edge(&edge);
        self.live_faces += faces.len();
        for e in faces.iter().flat_map(|(f, _)| f.edges()) {
            let tail = self.tail(e);
            let leaving = around.iter_mut().find(|(v, _)| *v == tail);
            leaving.expect("a corner of a new face").1.push(e);
        }
        for (v, outgoing) in &mut around {
            self.find_fans_among(*v, outgoing);
        }
    }
}

/// The third vertex of a triangle that has these two.
fn apex_beside(triangle: &[VertexId; 3], a: VertexId, b: VertexId) -> Option<VertexId> {
    let [x, y, z] = *triangle;
    let others = [(x, [y, z]), (y, [z, x]), (z, [x, y])];
    let beside = others
        .into_iter()
        .find(|(_, o)| *o == [a, b] || *o == [b, a]);
    beside.map(|(v, _)| v).filter(|&v| v != a && v != b)
}
