//! The candidates, cheapest first.

use std::cmp::Ordering;

use binary_heap_plus::{BinaryHeap, MinComparator};

use crate::mesh::EdgeId;

/// An edge and what its collapse cost when it was evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// The cost, in the unit box.
    pub cost: f32,
    /// The edge, by its smallest directed edge.
    pub edge: EdgeId,
    /// The number of collapses before the evaluation.
    pub evaluated_at: u32,
}

impl Eq for Candidate {}

/// By cost, then by edge: a total order of the edges that depends on nothing else.
impl Ord for Candidate {
    #[inline]
    fn cmp(&self, other: &Self) -> Ordering {
        let by_cost = self.cost.total_cmp(&other.cost);
        by_cost
            .then(self.edge.cmp(&other.edge))
            .then(self.evaluated_at.cmp(&other.evaluated_at))
    }
}

impl PartialOrd for Candidate {
    #[inline]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Gives candidates back, cheapest first.
pub trait Queue: Sync {
    /// The queue of these candidates.
    fn from_candidates(candidates: Vec<Candidate>) -> Self;

    /// Adds a candidate.
    fn push(&mut self, candidate: Candidate);

    /// Takes the cheapest candidate out.
    fn pop(&mut self) -> Option<Candidate>;

    /// The number of candidates, stale ones included.
    fn len(&self) -> usize;

    /// Drops candidates.
    fn retain(&mut self, keep: impl FnMut(&Candidate) -> bool);

    /// The bytes that the queue holds.
    fn bytes(&self) -> usize;
}

/// A binary heap in which a changed candidate is pushed again and the old one stays until it is
/// popped or dropped: for costs that may fall.
pub struct LazyHeap(BinaryHeap<Candidate, MinComparator>);

impl Queue for LazyHeap {
    fn from_candidates(candidates: Vec<Candidate>) -> Self {
        Self(BinaryHeap::from_vec(candidates))
    }

    #[inline]
    fn push(&mut self, candidate: Candidate) {
        self.0.push(candidate);
    }

    #[inline]
    fn pop(&mut self) -> Option<Candidate> {
        self.0.pop()
    }

    fn len(&self) -> usize {
        self.0.len()
    }

    fn retain(&mut self, keep: impl FnMut(&Candidate) -> bool) {
        let mut candidates = std::mem::replace(&mut self.0, BinaryHeap::new_min()).into_vec();
        candidates.retain(keep);
        *self = Self::from_candidates(candidates);
    }

    fn bytes(&self) -> usize {
        self.0.capacity() * size_of::<Candidate>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(cost: f32, edge: usize) -> Candidate {
        Candidate {
            cost,
            edge: EdgeId::new(edge),
            evaluated_at: 0,
        }
    }

    /// Equal costs come out by edge, whatever the order they went in.
    #[test]
    fn ties_go_to_the_smaller_edge() {
        let mut queue = LazyHeap::from_candidates(vec![candidate(2.0, 9), candidate(1.0, 7)]);
        queue.push(candidate(1.0, 3));
        queue.push(candidate(0.5, 8));
        queue.push(candidate(1.0, 5));
        queue.retain(|c| c.edge != EdgeId::new(7));
        let order: Vec<_> = std::iter::from_fn(|| queue.pop())
            .map(|c| c.edge.index())
            .collect();
        assert_eq!(order, [8, 3, 5, 9]);
    }
}
