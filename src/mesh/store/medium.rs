//! Head, previous and opposite stored: 12 bytes a directed edge.

use super::{EdgeId, EdgeStore, OppositeWord, Tier, VertexId};

#[derive(Clone, Copy, Debug)]
struct Edge {
    head: VertexId,
    prev: EdgeId,
    opposite: OppositeWord,
}

/// The medium tier (paper, Figure 5 middle): the tail is the head of the previous edge, the next
/// edge the previous of the previous.
#[derive(Clone, Debug)]
pub struct Medium(Vec<Edge>);

impl EdgeStore for Medium {
    const TIER: Tier = Tier::Medium;

    fn from_triangles(triangles: &[[u32; 3]], opposites: &[OppositeWord]) -> Self {
        let (opposites, _) = opposites.as_chunks::<3>();
        let faces = triangles
            .iter()
            .zip(opposites)
            .enumerate()
            .map(|(i, (t, opposites))| {
                [0, 1, 2].map(|k| Edge {
                    head: VertexId::new(t[(k + 1) % 3] as usize),
                    prev: EdgeId::new(3 * i + (k + 2) % 3),
                    opposite: opposites[k],
                })
            });
        Self(faces.collect::<Vec<_>>().into_flattened())
    }

    #[inline(always)]
    fn slots(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    fn tail(&self, e: EdgeId) -> VertexId {
        self.head(self.prev(e))
    }

    #[inline(always)]
    fn head(&self, e: EdgeId) -> VertexId {
        self.0[e.index()].head
    }

    #[inline(always)]
    fn next(&self, e: EdgeId) -> EdgeId {
        self.prev(self.prev(e))
    }

    #[inline(always)]
    fn prev(&self, e: EdgeId) -> EdgeId {
        self.0[e.index()].prev
    }

    #[inline(always)]
    fn opposite_word(&self, e: EdgeId) -> OppositeWord {
        self.0[e.index()].opposite
    }

    #[inline(always)]
    fn set_opposite_word(&mut self, e: EdgeId, word: OppositeWord) {
        self.0[e.index()].opposite = word;
    }

    #[inline(always)]
    fn set_tail(&mut self, e: EdgeId, v: VertexId) {
        let prev = self.prev(e);
        self.0[prev.index()].head = v;
    }

    fn move_face(&mut self, from: usize, to: usize) {
        for k in 0..3 {
            let mut edge = self.0[3 * from + k];
            edge.prev = EdgeId::new(3 * to + edge.prev.index() % 3);
            self.0[3 * to + k] = edge;
        }
    }

    fn push_face(&mut self) {
        let first = self.0.len();
        self.0.extend([2, 0, 1].map(|prev| Edge {
            head: VertexId::new(0),
            prev: EdgeId::new(first + prev),
            opposite: OppositeWord::DEAD,
        }));
    }

    fn truncate(&mut self, faces: usize) {
        self.0.truncate(3 * faces);
        self.0.shrink_to_fit();
    }

    fn bytes(&self) -> usize {
        self.0.capacity() * size_of::<Edge>()
    }
}
