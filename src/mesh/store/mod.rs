//! The three memory tiers: which words of a directed edge are stored, which computed (paper,
//! section 3, Figure 5).
//!
//! | tier | stored per directed edge | computed | bytes per triangle |
//! |---|---|---|---|
//! | [`Full`] | tail, head, previous, next, opposite | – | 8 + 60 = 68 |
//! | [`Medium`] | head, previous, opposite | tail = head(prev), next = prev(prev) | 8 + 36 = 44 |
//! | [`Small`] | head, opposite | prev, next by e % 3; tail = head(prev) | 8 + 24 = 32 |
//!
//! The 8 bytes are the vertices': 12 for the position and 4 for one outgoing edge, at two
//! triangles a vertex.

mod full;
mod medium;
mod small;

pub use full::Full;
pub use medium::Medium;
pub use small::Small;

use super::ids::{EdgeId, VertexId};
use super::link::OppositeWord;

/// A memory tier. It changes memory and time, nothing else.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Tier {
    /// Head and opposite stored: 32 bytes per triangle.
    Small,
    /// Head, previous and opposite stored: 44 bytes per triangle.
    Medium,
    /// Tail, head, previous, next and opposite stored: 68 bytes per triangle.
    Full,
}

impl Tier {
    /// Every tier, the largest first.
    pub const ALL: [Self; 3] = [Self::Full, Self::Medium, Self::Small];

    /// The 4-byte words stored per directed edge.
    pub const fn words_per_edge(self) -> usize {
        match self {
            Self::Full => 5,
            Self::Medium => 3,
            Self::Small => 2,
        }
    }

    /// The bytes of a manifold mesh, its positions included: 60m+16n, 36m+16n or 24m+16n.
    pub const fn bytes(self, vertices: usize, triangles: usize) -> usize {
        3 * 4 * self.words_per_edge() * triangles + 16 * vertices
    }

    /// The tier's name as the command line spells it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Full => "full",
            Self::Medium => "medium",
            Self::Small => "small",
        }
    }
}

/// The words of all directed edges in one tier. Triangle `i` owns the edges 3i, 3i+1, 3i+2.
///
/// Only the three tiers are stores: the words that cross this trait have no name outside.
pub trait EdgeStore: Clone + Send + Sync + Sized {
    /// The tier that this store is.
    const TIER: Tier;

    /// The store of these triangles, with the word of what lies across each edge.
    fn from_triangles(triangles: &[[u32; 3]], opposites: &[OppositeWord]) -> Self;

    /// The directed edges, dead ones included.
    fn slots(&self) -> usize;

    /// The vertex that `e` starts at.
    fn tail(&self, e: EdgeId) -> VertexId;

    /// The vertex that `e` ends at.
    fn head(&self, e: EdgeId) -> VertexId;

    /// The directed edge behind `e` in its face.
    fn next(&self, e: EdgeId) -> EdgeId;

    /// The directed edge before `e` in its face.
    fn prev(&self, e: EdgeId) -> EdgeId;

    /// What lies across `e`, undecoded.
    fn opposite_word(&self, e: EdgeId) -> OppositeWord;

    /// Sets what lies across `e`.
    fn set_opposite_word(&mut self, e: EdgeId, word: OppositeWord);

    /// Makes `e` start at `v`, and the edge before it end there.
    fn set_tail(&mut self, e: EdgeId, v: VertexId);

    /// Moves the three edges of one face slot to another, a lower one, links untouched.
    fn move_face(&mut self, from: usize, to: usize);

    /// Adds a dead face slot.
    fn push_face(&mut self);

    /// Drops every face slot from `faces` on.
    fn truncate(&mut self, faces: usize);

    /// The bytes that the words hold.
    fn bytes(&self) -> usize;
}
