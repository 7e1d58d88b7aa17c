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
///
/// A candidate is out of date from when something changed beside its edge until it is pushed again.
pub trait Queue: Send + Sync {
    /// An empty queue for so many directed edges.
    fn for_edges(edges: usize) -> Self;

    /// Adds a candidate, in the place of the one that its directed edge had.
    fn push(&mut self, candidate: Candidate, age: Age);

    /// Takes the cheapest candidate out; its cost may be given as a little more than it was.
    fn pop(&mut self) -> Option<(Candidate, Age)>;

    /// Whether a candidate goes by this directed edge.
    fn contains(&self, e: EdgeId) -> bool;

    /// [`contains`](Self::contains); and the candidate is out of date from now on.
    fn outdate(&mut self, e: EdgeId) -> bool;

    /// Drops the candidate, if there is one.
    fn remove(&mut self, e: EdgeId);

    /// The candidate of `old`, if there is one, goes by `new` from now on, which has none; and is out of
    /// date.
    fn rename(&mut self, old: EdgeId, new: EdgeId);

    /// The bytes that the queue holds.
    fn bytes(&self) -> usize;
}

/// Whether what a candidate costs was evaluated with everything beside its edge as it is now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Age {
    UpToDate,
    OutOfDate,
}

impl Age {
    #[inline(always)]
    fn of(is_marked: bool) -> Self {
        if is_marked {
            Self::OutOfDate
        } else {
            Self::UpToDate
        }
    }
}

/// A binary heap: exact order, ties by the smaller directed edge. A changed candidate is pushed
/// again and the old one stays until it is popped, or dropped with the others of its kind.
pub struct LazyHeap {
    heap: BinaryHeap<Entry, MinComparator>,
    /// The cost that each directed edge's candidate has now, as bits, and [`OUT_OF_DATE`];
    /// [`NO_COST`] for none.
    current: Vec<u32>,
    /// The entries that are no leftovers.
    candidates: usize,
}

/// No cost has these bits.
const NO_COST: u32 = u32::MAX;

/// The sign, which no cost has.
const OUT_OF_DATE: u32 = 1 << 31;

/// The bits of a cost, which order costs that are not negative, and the edge.
type Entry = (u32, EdgeId);

impl LazyHeap {
    fn is_current(current: &[u32], (cost, edge): Entry) -> bool {
        current[edge.index()] & !OUT_OF_DATE == cost
    }
}

impl Queue for LazyHeap {
    fn for_edges(edges: usize) -> Self {
        Self {
            heap: BinaryHeap::new_min(),
            current: vec![NO_COST; edges],
            candidates: 0,
        }
    }

    fn push(&mut self, Candidate { cost, edge }: Candidate, age: Age) {
        let cost = cost.max(0.0).to_bits();
        let mark = match age {
            Age::UpToDate => 0,
            Age::OutOfDate => OUT_OF_DATE,
        };
        let before = std::mem::replace(&mut self.current[edge.index()], cost | mark);
        if before & !OUT_OF_DATE != cost {
            self.heap.push((cost, edge));
            self.candidates += usize::from(before == NO_COST);
        }
        if self.heap.len() > 2 * self.candidates + 1024 {
            let mut entries = std::mem::replace(&mut self.heap, BinaryHeap::new_min()).into_vec();
            // An edge that came back to a cost of old may stand there twice.
            entries.retain(|&entry| Self::is_current(&self.current, entry));
            entries.sort_unstable();
            entries.dedup();
            self.heap = BinaryHeap::from_vec(entries);
        }
    }

    fn pop(&mut self) -> Option<(Candidate, Age)> {
        loop {
            let entry = self.heap.pop()?;
            if Self::is_current(&self.current, entry) {
                let (cost, edge) = entry;
                let bits = std::mem::replace(&mut self.current[edge.index()], NO_COST);
                self.candidates -= 1;
                let cost = f32::from_bits(cost);
                let age = Age::of(bits & OUT_OF_DATE != 0);
                return Some((Candidate { cost, edge }, age));
            }
        }
    }

    fn contains(&self, e: EdgeId) -> bool {
        self.current[e.index()] != NO_COST
    }

    fn outdate(&mut self, e: EdgeId) -> bool {
        // What has all bits set stays as it is.
        self.current[e.index()] |= OUT_OF_DATE;
        self.contains(e)
    }

    fn remove(&mut self, e: EdgeId) {
        let before = std::mem::replace(&mut self.current[e.index()], NO_COST);
        self.candidates -= usize::from(before != NO_COST);
    }

    fn rename(&mut self, old: EdgeId, new: EdgeId) {
        let bits = self.current[old.index()];
        if bits != NO_COST {
            self.remove(old);
            let cost = f32::from_bits(bits & !OUT_OF_DATE);
            self.push(Candidate { cost, edge: new }, Age::OutOfDate);
        }
    }

    fn bytes(&self) -> usize {
        self.heap.capacity() * size_of::<Entry>() + self.current.capacity() * size_of::<u32>()
    }
}

/// Buckets of candidates whose costs share the exponent and the first bits of the mantissa: constant
/// time, no order within a bucket but last in, first out. A candidate that is pushed again leaves the
/// old one where it is until it is popped or swept out with the others of its kind.
///
/// Two bytes a directed edge, and what is listed: the less a chunk's queue takes, the more of the
/// chunk stays in the cache.
pub struct Buckets {
    lists: Vec<Vec<u32>>,
    /// One bit a bucket: whether its list may hold something.
    filled: Vec<u64>,
    /// The bucket of each directed edge's candidate and [`OUT_OF_DATE_MARK`], or [`NOWHERE`].
    places: Vec<u16>,
    /// No bucket below is filled.
    lowest: usize,
    /// All that is listed.
    entries: usize,
    /// What the lists have room for.
    room: usize,
}

/// No bucket.
const NOWHERE: u16 = u16::MAX;

/// Beyond any bucket.
const OUT_OF_DATE_MARK: u16 = 1 << 15;

/// Beyond any bucket, too: marks what a sweep has met.
const MET: u16 = 1 << 14;

/// The bits of a cost that do not tell its bucket: four of the mantissa do, so that costs in a
/// bucket differ by 6 % at most.
const IGNORED_BITS: u32 = 23 - 4;

/// The entries that a list has room for from the start.
const LIST_ENTRIES: usize = 32;

fn bucket_of(cost: f32) -> usize {
    (cost.max(0.0).to_bits() >> IGNORED_BITS) as usize
}

/// The largest cost in a bucket.
fn ceiling(bucket: usize) -> f32 {
    f32::from_bits(((bucket as u32 + 1) << IGNORED_BITS) - 1)
}

impl Buckets {
    /// Drops what is listed in vain.
    fn sweep(&mut self) {
        self.entries = 0;
        for (bucket, list) in self.lists.iter_mut().enumerate() {
            // From the top, so that of an edge that came back the entry stays that was there last.
            list.reverse();
            list.retain(|&e| {
                let place = &mut self.places[e as usize];
                let is_current = *place & !OUT_OF_DATE_MARK == bucket as u16;
                *place |= if is_current { MET } else { 0 };
                is_current
            });
            list.reverse();
            for &e in &*list {
                self.places[e as usize] &= !MET;
            }
            self.entries += list.len();
        }
    }
}

impl Queue for Buckets {
    fn for_edges(edges: usize) -> Self {
        let buckets = bucket_of(f32::MAX) + 1;
        Self {
            lists: vec![Vec::new(); buckets],
            filled: vec![0; buckets.div_ceil(64)],
            places: vec![NOWHERE; edges],
            lowest: 0,
            entries: 0,
            room: 0,
        }
    }

    #[inline]
    fn push(&mut self, Candidate { cost, edge }: Candidate, age: Age) {
        let bucket = bucket_of(cost.min(f32::MAX));
        let mark = match age {
            Age::UpToDate => 0,
            Age::OutOfDate => OUT_OF_DATE_MARK,
        };
        self.places[edge.index()] = bucket as u16 | mark;
        let list = &mut self.lists[bucket];
        if list.len() == list.capacity() {
            list.reserve(list.len().max(LIST_ENTRIES));
            self.room += list.capacity() - list.len();
        }
        if list.is_empty() {
            self.filled[bucket / 64] |= 1 << (bucket % 64);
            self.lowest = self.lowest.min(bucket);
        }
        list.push(edge.index() as u32);
        self.entries += 1;
        if self.entries > self.places.len() + self.places.len() / 2 {
            self.sweep();
        }
    }

    #[inline]
    fn pop(&mut self) -> Option<(Candidate, Age)> {
        loop {
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
            let list = &mut self.lists[self.lowest];
            while let Some(e) = list.pop() {
                self.entries -= 1;
                let place = self.places[e as usize];
                if place & !OUT_OF_DATE_MARK == self.lowest as u16 {
                    self.places[e as usize] = NOWHERE;
                    let candidate = Candidate {
                        cost: ceiling(self.lowest),
                        edge: EdgeId::new(e as usize),
                    };
                    return Some((candidate, Age::of(place & OUT_OF_DATE_MARK != 0)));
                }
            }
            self.filled[word] &= !(1 << (self.lowest % 64));
        }
    }

    #[inline]
    fn contains(&self, e: EdgeId) -> bool {
        self.places[e.index()] != NOWHERE
    }

    #[inline]
    fn outdate(&mut self, e: EdgeId) -> bool {
        // What has all bits set stays as it is.
        self.places[e.index()] |= OUT_OF_DATE_MARK;
        self.contains(e)
    }

    #[inline]
    fn remove(&mut self, e: EdgeId) {
        self.places[e.index()] = NOWHERE;
    }

    #[inline]
    fn rename(&mut self, old: EdgeId, new: EdgeId) {
        let place = std::mem::replace(&mut self.places[old.index()], NOWHERE);
        if place != NOWHERE {
            let cost = ceiling((place & !OUT_OF_DATE_MARK).into());
            self.push(Candidate { cost, edge: new }, Age::OutOfDate);
        }
    }

    fn bytes(&self) -> usize {
        self.room * size_of::<u32>()
            + self.lists.capacity() * size_of::<Vec<u32>>()
            + self.places.capacity() * size_of::<u16>()
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
            queue.push(candidate(cost, edge), Age::UpToDate);
        }
        let order: Vec<_> = std::iter::from_fn(|| queue.pop())
            .map(|(c, _)| c.edge.index())
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
        let mut list: Vec<Option<(f32, Age)>> = vec![None; edges];
        for _ in 0..200_000 {
            let edge = random(edges as u64) as usize;
            match random(10) {
                9 => {
                    let other = random(edges as u64) as usize;
                    if list[other].is_none() {
                        queue.rename(EdgeId::new(edge), EdgeId::new(other));
                        list[other] = list[edge].take().map(|(cost, _)| (cost, Age::OutOfDate));
                    }
                }
                8 => {
                    queue.remove(EdgeId::new(edge));
                    list[edge] = None;
                }
                0..5 => {
                    let cost = match random(20) {
                        0 => 0.0,
                        1 => f32::MAX,
                        // Often a cost of old.
                        2..10 => random(4) as f32,
                        _ => f32::from_bits(random(0x7f00_0000) as u32),
                    };
                    let age = Age::of(random(2) == 0);
                    queue.push(candidate(cost, edge), age);
                    list[edge] = Some((cost, age));
                }
                5 => {
                    assert_eq!(queue.outdate(EdgeId::new(edge)), list[edge].is_some());
                    if let Some((_, age)) = &mut list[edge] {
                        *age = Age::OutOfDate;
                    }
                }
                _ => {
                    let least = list.iter().flatten().map(|(cost, _)| *cost);
                    let least = least.reduce(f32::min);
                    let popped = queue.pop();
                    assert_eq!(popped.is_some(), least.is_some());
                    let (Some((popped, age)), Some(least)) = (popped, least) else {
                        continue;
                    };
                    let (was, age_was) = list[popped.edge.index()].take().expect("it was pushed");
                    assert_eq!(age, age_was);
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
