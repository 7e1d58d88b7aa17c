//! The cut along a loop of three edges, both sides capped: a handle less.

use smallvec::SmallVec;

use super::link::{Opposite, Outgoing};
use super::{EdgeId, EdgeStore, FaceId, Mesh, VertexId};

/// Faces looked at before a loop is taken for one that separates.
const PATIENCE: usize = 20_000;

impl<S: EdgeStore> Mesh<S> {
    /// The loops of three edges through `e` that no face fills: all three edges and their vertices
    /// manifold and off the boundary, each loop as directed edges in order, `e` first.
    ///
    /// None at or beside a [busy](Self::is_busy) vertex. Costs a walk around one end and around all of
    /// its neighbours.
    pub fn open_loops(&self, e: EdgeId) -> SmallVec<[[EdgeId; 3]; 1]> {
        let mut loops = SmallVec::new();
        let Some(o) = self.mate(e) else { return loops };
        let [u, v] = self.edge_vertices(e);
        let is_disk = |x: VertexId| matches!(self.outgoing(x), Outgoing::Fan(start) if self.mate(start).is_some());
        if !is_disk(u) || !is_disk(v) || self.is_busy(v) {
            return loops;
        }
        let apexes = [self.apex(e), self.apex(o)];
        for to_x in self.outgoing_edges(v) {
            let x = self.head(to_x);
            if x == u || apexes.contains(&x) || !is_disk(x) || self.is_busy(x) {
                continue;
            }
            let back = self.outgoing_edges(x).find(|&d| self.head(d) == u);
            if let Some(back) = back {
                loops.push([e, to_x, back]);
            }
        }
        loops
    }

    /// Whether a loop goes once around a handle: a way leads from the one side to the other.
    ///
    /// Costs a search from both sides until they meet, given up after 20 000 faces.
    pub fn is_around_handle(&self, edges: &[EdgeId; 3]) -> bool {
        let is_on_loop = |e: EdgeId| edges.iter().any(|&l| l == e || self.mate(l) == Some(e));
        let mut sides: Vec<(FaceId, bool)> = Vec::new();
        let mut seen = std::collections::BTreeMap::new();
        for &e in edges {
            for (e, is_left) in [(Some(e), true), (self.mate(e), false)] {
                if let Some(f) = e.map(EdgeId::face) {
                    if seen
                        .insert(f, is_left)
                        .is_some_and(|other| other != is_left)
                    {
                        return true;
                    }
                    sides.push((f, is_left));
                }
            }
        }
        let mut at = 0;
        while let Some(&(f, is_left)) = sides.get(at) {
            at += 1;
            if at > PATIENCE {
                return false;
            }
            for e in f.edges() {
                let across = self.mate(e).filter(|_| !is_on_loop(e)).map(EdgeId::face);
                let Some(g) = across else { continue };
                match seen.insert(g, is_left) {
                    Some(other) if other != is_left => return true,
                    Some(_) => {}
                    None => sides.push((g, is_left)),
                }
            }
        }
        false
    }

    /// The edges that leave each vertex of a loop on its right: from the mate of the edge that comes
    /// in to the one that goes out.
    pub fn right_of_loop(&self, edges: &[EdgeId; 3]) -> [Vec<EdgeId>; 3] {
        let mate = |e| self.mate(e).expect("a disk around each vertex of the loop");
        std::array::from_fn(|i| {
            let mut at = mate(edges[(i + 2) % 3]);
            let mut leaving = Vec::new();
            while at != edges[i] {
                leaving.push(at);
                at = mate(self.prev(at));
            }
            leaving
        })
    }

    /// Cuts along a loop and caps both sides, the right one on three new vertices.
    ///
    /// ```text
    ///    left │ right           left │   │ right
    ///       ──x──                  ──x   x'──
    ///         │           →         /│   │\        caps: v u x and u' v' x'
    ///       ──v──                  ──v   v'──
    ///         │                     \│   │/
    ///       ──u──                  ──u   u'──
    /// ```
    ///
    /// Needs a loop out of [`open_loops`](Self::open_loops), two dead faces and three dead
    /// vertices (for the tails of the edges, in order). Costs a walk around the three vertices.
    pub fn pinch(&mut self, edges: &[EdgeId; 3], caps: [FaceId; 2], vertices: [VertexId; 3]) {
        let mates = edges.map(|e| self.mate(e).expect("a loop of manifold edges"));
        let right = self.right_of_loop(edges);
        let tails = edges.map(|e| self.tail(e));
        for (i, leaving) in right.iter().enumerate() {
            for &e in leaving {
                self.store.set_tail(e, vertices[i]);
            }
            self.set_outgoing(vertices[i], Outgoing::Fan(leaving[0]));
            self.set_outgoing(tails[i], Outgoing::Fan(edges[i]));
            self.live_vertices += 1;
        }
        let [u, v, x] = tails;
        let [to_left, to_right] = caps.map(FaceId::edges);
        // v→u, u→x, x→v lie across from the loop's edges; u'→v', v'→x', x'→u' from their mates.
        let left = [(0, v), (2, u), (1, x)];
        let right = [(0, vertices[0]), (1, vertices[1]), (2, vertices[2])];
        for (cap, sides, across) in [(to_left, left, *edges), (to_right, right, mates)] {
            for (e, (side, tail)) in cap.into_iter().zip(sides) {
                self.store.set_tail(e, tail);
                self.set_opposite(e, Opposite::Edge(across[side]));
                self.set_opposite(across[side], Opposite::Edge(e));
            }
        }
        self.live_faces += 2;
    }
}
