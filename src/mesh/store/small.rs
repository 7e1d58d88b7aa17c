//! Head and opposite stored: 8 bytes a directed edge.

use super::{EdgeId, EdgeStore, OppositeWord, Tier, VertexId};

#[derive(Clone, Copy, Debug)]
struct Edge {
    head: VertexId,
    opposite: OppositeWord,
}

/// The small tier (paper, Figure 5 right): previous and next follow from the index.
#[derive(Clone, Debug)]
pub struct Small(Vec<Edge>);

impl EdgeStore for Small {
    const TIER: Tier = Tier::Small;

    fn from_triangles(triangles: &[[u32; 3]], opposites: &[OppositeWord]) -> Self {
        let (opposites, _) = opposites.as_chunks::<3>();
        let faces = triangles.iter().zip(opposites).map(|(t, opposites)| {
            [0, 1, 2].map(|k| Edge {
                head: VertexId::new(t[(k + 1) % 3] as usize),
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
        let i = e.index();
        EdgeId::new(if i % 3 == 2 { i - 2 } else { i + 1 })
    }

    #[inline(always)]
    fn prev(&self, e: EdgeId) -> EdgeId {
        let i = e.index();
        EdgeId::new(if i.is_multiple_of(3) { i + 2 } else { i - 1 })
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
        self.0.copy_within(3 * from..3 * from + 3, 3 * to);
    }

    fn push_face(&mut self) {
        let edge = Edge {
            head: VertexId::new(0),
            opposite: OppositeWord::DEAD,
        };
        self.0.extend([edge; 3]);
    }

    fn truncate(&mut self, faces: usize) {
        self.0.truncate(3 * faces);
        self.0.shrink_to_fit();
    }

    fn bytes(&self) -> usize {
        self.0.capacity() * size_of::<Edge>()
    }
}
