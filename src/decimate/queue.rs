//! The candidates, cheapest first: one an edge at most.

use binary_heap_plus::{BinaryHeap, MinComparator};

use crate::mesh::EdgeId;

/// An edge and what its collapse cost when it was evaluated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Candidate {
    /// The cost, in the unit box; not negative.
    pub cost: f32,
    /// The edge, by one of its directed edges.
    pub edge: EdgeId,
}

/// Gives candidates back, cheapest first. Which of two comes first does not depend on the tier or
/// the number of threads.
pub trait Queue: Send + Sync {
    /// An empty queue for so many directed edges.
    fn for_edges(edges: usize) -> Self;

    /// Adds a candidate, in the place of the one that its directed edge had.
    fn push(&mut self, candidate: Candidate);

    /// Takes the cheapest candidate out; its cost may be given as a little more than it was.
    fn pop(&mut self) -> Option<Candidate>;

    /// Whether there may be one that costs no more than this.
    fn has_at_most(&self, cost: f32) -> bool;

    /// Whether a candidate goes by this directed edge.
    fn contains(&self, e: EdgeId) -> bool;

    /// The bytes that the queue holds.
    fn bytes(&self) -> usize;
}

/// A binary heap: exact order, ties by the smaller directed edge. A changed candidate is pushed
/// again and the old one stays until it is popped, or dropped with the others of its kind.
pub struct LazyHeap {
    heap: BinaryHeap<Entry, MinComparator>,
    /// The cost that each directed edge's candidate has now, as bits; [`NO_COST`] for none.
    current: Vec<u32>,
    /// The candidates that are not stale.
    fresh: usize,
}

/// No cost has these bits.
const NO_COST: u32 = u32::MAX;

/// The bits of a cost, which order costs that are not negative, and the edge.
type Entry = (u32, EdgeId);

impl LazyHeap {
    fn is_fresh(current: &[u32], (cost, edge): Entry) -> bool {
        current[edge.index()] == cost
    }
}

impl Queue for LazyHeap {
    fn for_edges(edges: usize) -> Self {
        Self {
            heap: BinaryHeap::new_min(),
            current: vec![NO_COST; edges],
            fresh: 0,
        }
    }

    fn push(&mut self, Candidate { cost, edge }: Candidate) {
        let cost = cost.max(0.0).to_bits();
        let before = std::mem::replace(&mut self.current[edge.index()], cost);
        if before != cost {
            self.heap.push((cost, edge));
            self.fresh += usize::from(before == NO_COST);
        }
        if self.heap.len() > 2 * self.fresh + 1024 {
            let mut entries = std::mem::replace(&mut self.heap, BinaryHeap::new_min()).into_vec();
            // An edge that came back to a cost of old may stand there twice.
            entries.retain(|&entry| Self::is_fresh(&self.current, entry));
            entries.sort_unstable();
            entries.dedup();
            self.heap = BinaryHeap::from_vec(entries);
        }
    }

    fn pop(&mut self) -> Option<Candidate> {
        loop {
            let entry = self.heap.pop()?;
            if Self::is_fresh(&self.current, entry) {
                let (cost, edge) = entry;
                self.current[edge.index()] = NO_COST;
                self.fresh -= 1;
                return Some(Candidate {
                    cost: f32::from_bits(cost),
                    edge,
                });
            }
        }
    }

    fn has_at_most(&self, cost: f32) -> bool {
        self.heap
            .peek()
            .is_some_and(|&(bits, _)| f32::from_bits(bits) <= cost)
    }

    fn contains(&self, e: EdgeId) -> bool {
        self.current[e.index()] != NO_COST
    }

    fn bytes(&self) -> usize {
        self.heap.capacity() * size_of::<Entry>() + self.current.capacity() * size_of::<u32>()
    }
}

/// Buckets of candidates whose costs share the exponent and the first bits of the mantissa, each a
/// list linked through the directed edges' slots: constant time, no order within a bucket but last
/// in, first out, and no stale candidates.
pub struct Buckets {
    /// The directed edge that each bucket's list begins with.
    first: Vec<u32>,
    /// One bit a bucket: whether its list is not empty.
    filled: Vec<u64>,
    /// One entry a directed edge.
    links: Vec<Link>,
    /// No bucket below is filled.
    lowest: usize,
}

/// The neighbours in a bucket's list, as directed edges, or [`NONE`].
#[derive(Clone, Copy)]
struct Link {
    /// The one before; for the first of a list, its bucket and [`FIRST`].
    before: u32,
    after: u32,
}

/// No directed edge.
const NONE: u32 = u32::MAX;

/// Marks a bucket in the place of a directed edge, which is less than 2³¹.
const FIRST: u32 = 1 << 31;

/// Not in any list.
const OUT: Link = Link {
    before: NONE,
    after: NONE,
};

/// The bits of a cost that do not tell its bucket: four of the mantissa do, so that costs in a
/// bucket differ by 6 % at most.
const IGNORED_BITS: u32 = 23 - 4;

fn bucket_of(cost: f32) -> usize {
    (cost.max(0.0).to_bits() >> IGNORED_BITS) as usize
}

/// The largest cost in a bucket.
fn ceiling(bucket: usize) -> f32 {
    f32::from_bits(((bucket as u32 + 1) << IGNORED_BITS) - 1)
}

impl Buckets {
    /// Puts `after` behind `before`, which may be a bucket.
    #[inline]
    fn link(&mut self, before: u32, after: u32) {
        if before & FIRST != 0 {
            let bucket = (before & !FIRST) as usize;
            self.first[bucket] = after;
            if after == NONE {
                self.filled[bucket / 64] &= !(1 << (bucket % 64));
            }
        } else {
            self.links[before as usize].after = after;
        }
        if after != NONE {
            self.links[after as usize].before = before;
        }
    }

    #[inline]
    fn take_out(&mut self, e: u32) {
        let Link { before, after } = std::mem::replace(&mut self.links[e as usize], OUT);
        if before != NONE {
            self.link(before, after);
        }
    }
}

impl Queue for Buckets {
    fn for_edges(edges: usize) -> Self {
        let buckets = bucket_of(f32::MAX) + 1;
        Self {
            first: vec![NONE; buckets],
            filled: vec![0; buckets.div_ceil(64)],
            links: vec![OUT; edges],
            lowest: 0,
        }
    }

    #[inline]
    fn push(&mut self, Candidate { cost, edge }: Candidate) {
        let (e, bucket) = (edge.index() as u32, bucket_of(cost.min(f32::MAX)));
        self.take_out(e);
        let second = self.first[bucket];
        self.link(bucket as u32 | FIRST, e);
        self.link(e, second);
        self.filled[bucket / 64] |= 1 << (bucket % 64);
        self.lowest = self.lowest.min(bucket);
    }

    #[inline]
    fn pop(&mut self) -> Option<Candidate> {
        let mut word = self.lowest / 64;
        let mut bits = *self.filled.get(word)? & (u64::MAX << (self.lowest % 64));
        while bits == 0 {
            word += 1;
            let Some(&next) = self.filled.get(word) else {
                self.lowest = 64 * word;
                return None;
            };
            bits = next;
        }
        self.lowest = 64 * word + bits.trailing_zeros() as usize;
        let e = self.first[self.lowest];
        self.take_out(e);
        Some(Candidate {
            cost: ceiling(self.lowest),
            edge: EdgeId::new(e as usize),
        })
    }

    #[inline]
    fn has_at_most(&self, cost: f32) -> bool {
        let bucket = bucket_of(cost);
        self.lowest < bucket || self.first[bucket] != NONE
    }

    #[inline]
    fn contains(&self, e: EdgeId) -> bool {
        self.links[e.index()].before != NONE
    }

    fn bytes(&self) -> usize {
        self.links.capacity() * size_of::<Link>()
            + self.first.capacity() * size_of::<u32>()
            + self.filled.capacity() * size_of::<u64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn candidate(cost: f32, edge: usize) -> Candidate {
        Candidate {
            cost,
            edge: EdgeId::new(edge),
        }
    }

    /// Equal costs come out by edge, whatever the order they went in; a changed one once.
    #[test]
    fn ties_go_to_the_smaller_edge() {
        let mut queue = LazyHeap::for_edges(10);
        let costs = [(2.0, 9), (7.0, 3), (1.0, 3), (0.5, 8), (1.0, 5), (1.0, 3)];
        for (cost, edge) in costs {
            queue.push(candidate(cost, edge));
        }
        let order: Vec<_> = std::iter::from_fn(|| queue.pop())
            .map(|c| c.edge.index())
            .collect();
        assert_eq!(order, [8, 3, 5, 9]);
    }

    /// Pushes, changes and pops at random: both queues hold the same edges as a plain list, and
    /// neither gives one back that is dearer than another by more than its bucket.
    fn agrees_with_a_list<Q: Queue>(coarseness: f32) {
        let mut state = 7u64;
        let mut random = move |n: u64| {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 33) % n
        };
        let edges = 500;
        let mut queue = Q::for_edges(edges);
        let mut list: Vec<Option<f32>> = vec![None; edges];
        for _ in 0..200_000 {
            if random(3) > 0 {
                let edge = random(edges as u64) as usize;
                let cost = match random(20) {
                    0 => 0.0,
                    1 => f32::MAX,
                    _ => f32::from_bits(random(0x7f00_0000) as u32),
                };
                queue.push(candidate(cost, edge));
                list[edge] = Some(cost);
            } else {
                let least = list.iter().flatten().copied().reduce(f32::min);
                let popped = queue.pop();
                assert_eq!(popped.is_some(), least.is_some());
                if let (Some(popped), Some(least)) = (popped, least) {
                    let was = list[popped.edge.index()].take().expect("it was pushed");
                    assert!(
                        was <= (least * coarseness).max(f32::MIN_POSITIVE),
                        "{was} {least}"
                    );
                    assert!(
                        was <= popped.cost
                            && popped.cost <= (was * coarseness).max(f32::MIN_POSITIVE)
                    );
                    assert!(!queue.contains(popped.edge));
                }
            }
        }
        for (e, cost) in list.iter().enumerate() {
            assert_eq!(queue.contains(EdgeId::new(e)), cost.is_some());
        }
    }

    #[test]
    fn the_heap_agrees_with_a_list() {
        agrees_with_a_list::<LazyHeap>(1.0);
    }

    #[test]
    fn the_buckets_agree_with_a_list() {
        agrees_with_a_list::<Buckets>(1.0625);
    }
}
