//! Every word stored: 20 bytes a directed edge.

use super::{EdgeId, EdgeStore, OppositeWord, Tier, VertexId};

#[derive(Clone, Copy, Debug)]
struct Edge {
    tail: VertexId,
    head: VertexId,
    prev: EdgeId,
    next: EdgeId,
    opposite: OppositeWord,
}

/// The full tier (paper, Figure 5 left).
#[derive(Clone, Debug)]
pub struct Full(Vec<Edge>);

impl EdgeStore for Full {
    const TIER: Tier = Tier::Full;

    fn from_triangles(triangles: &[[u32; 3]], opposites: &[OppositeWord]) -> Self {
        let (opposites, _) = opposites.as_chunks::<3>();
        let faces = triangles
            .iter()
            .zip(opposites)
            .enumerate()
            .map(|(i, (t, opposites))| {
                [0, 1, 2].map(|k| Edge {
                    tail: VertexId::new(t[k] as usize),
                    head: VertexId::new(t[(k + 1) % 3] as usize),
                    prev: EdgeId::new(3 * i + (k + 2) % 3),
                    next: EdgeId::new(3 * i + (k + 1) % 3),
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
        self.0[e.index()].tail
    }

    #[inline(always)]
    fn head(&self, e: EdgeId) -> VertexId {
        self.0[e.index()].head
    }

    #[inline(always)]
    fn next(&self, e: EdgeId) -> EdgeId {
        self.0[e.index()].next
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
        self.0[e.index()].tail = v;
        self.0[prev.index()].head = v;
    }

    fn move_face(&mut self, from: usize, to: usize) {
        for k in 0..3 {
            let mut edge = self.0[3 * from + k];
            edge.prev = EdgeId::new(3 * to + edge.prev.index() % 3);
            edge.next = EdgeId::new(3 * to + edge.next.index() % 3);
            self.0[3 * to + k] = edge;
        }
    }

    fn push_face(&mut self) {
        let first = self.0.len();
        self.0
            .extend([(2, 1), (0, 2), (1, 0)].map(|(prev, next)| Edge {
                tail: VertexId::new(0),
                head: VertexId::new(0),
                prev: EdgeId::new(first + prev),
                next: EdgeId::new(first + next),
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
