//! Nearest points on a few ten thousand triangles that fit into the cache, in single precision.
//!
//! The triangles come in an order in which neighbours are near, and stay in it: every four make a
//! leaf, every four leaves a node, and so on. So the hierarchy is built by one pass over the boxes,
//! in a thirtieth of the time of [`Triangles`](super::Triangles).

use glam::{Vec3, Vec4};

use super::lanes::{Faces, Points};

/// Four boxes.
#[derive(Clone, Copy, Debug)]
struct Boxes {
    min: Points,
    max: Points,
}

impl Boxes {
    const EMPTY: Self = Self {
        min: Points {
            x: Vec4::INFINITY,
            y: Vec4::INFINITY,
            z: Vec4::INFINITY,
        },
        max: Points {
            x: Vec4::NEG_INFINITY,
            y: Vec4::NEG_INFINITY,
            z: Vec4::NEG_INFINITY,
        },
    };

    fn of(corners: &[Points; 3]) -> Self {
        let [a, b, c] = corners;
        Self {
            min: a.min(b).min(c),
            max: a.max(b).max(c),
        }
    }

    /// The box around all four.
    fn around(&self) -> (Vec3, Vec3) {
        let Self { min, max } = self;
        (
            Vec3::new(
                min.x.min_element(),
                min.y.min_element(),
                min.z.min_element(),
            ),
            Vec3::new(
                max.x.max_element(),
                max.y.max_element(),
                max.z.max_element(),
            ),
        )
    }

    fn set(&mut self, lane: usize, (min, max): (Vec3, Vec3)) {
        self.min.set(lane, min);
        self.max.set(lane, max);
    }

    /// The squared distances from a box.
    #[inline(always)]
    fn distances_squared(&self, min: &Points, max: &Points) -> Vec4 {
        let away = |low: Vec4, high: Vec4, from: Vec4, to: Vec4| {
            (low - to).max(from - high).max(Vec4::ZERO)
        };
        let x = away(self.min.x, self.max.x, min.x, max.x);
        let y = away(self.min.y, self.max.y, min.y, max.y);
        let z = away(self.min.z, self.max.z, min.z, max.z);
        x * x + y * y + z * z
    }
}

/// What rounding may add to the squared distance of a box, relatively.
const SLACK: f32 = 1.0 + 1e-5;

/// The nearest triangle of a patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// The squared distance.
    pub squared: f32,
    /// The triangle's index: a guess for the next search nearby.
    pub triangle: u32,
}

/// Triangles that lie near each other.
#[derive(Default)]
pub struct Patch {
    corners: Vec<[Points; 3]>,
    /// The levels of the hierarchy, the lowest first; the last has one element.
    nodes: Vec<Boxes>,
    /// Where each level begins.
    levels: Vec<u32>,
}

impl Patch {
    /// The hierarchy over these triangles, which may be degenerate, in their order. Needs 46 bytes a
    /// triangle.
    pub fn new(triangles: impl ExactSizeIterator<Item = [Vec3; 3]>) -> Self {
        let mut patch = Self::default();
        patch.fill(triangles);
        patch
    }

    /// Becomes the hierarchy over other triangles, in the memory that it has.
    pub fn fill(&mut self, mut triangles: impl ExactSizeIterator<Item = [Vec3; 3]>) {
        let count = triangles.len();
        let leaves = count.div_ceil(4);
        self.corners.clear();
        self.corners.reserve(leaves);
        self.nodes.clear();
        self.levels.clear();
        let mut last = [Vec3::ZERO; 3];
        for _ in 0..leaves {
            // The last triangle fills what is left of the last leaf.
            let four: [[Vec3; 3]; 4] = std::array::from_fn(|_| {
                last = triangles.next().unwrap_or(last);
                last
            });
            self.corners
                .push(std::array::from_fn(|k| Points::of(four.map(|t| t[k]))));
        }
        let mut below = leaves;
        while below > 0 {
            let begin = self.nodes.len();
            self.levels.push(begin as u32);
            for first in (0..below).step_by(4) {
                let mut boxes = Boxes::EMPTY;
                for child in first..below.min(first + 4) {
                    let around = match self.levels.len() {
                        1 => Boxes::of(&self.corners[child]).around(),
                        level => self.nodes[self.levels[level - 2] as usize + child].around(),
                    };
                    boxes.set(child - first, around);
                }
                self.nodes.push(boxes);
            }
            below = self.nodes.len() - begin;
            if below == 1 {
                break;
            }
        }
    }

    /// Whether there is no triangle.
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// The bytes held.
    pub fn bytes(&self) -> usize {
        self.corners.capacity() * size_of::<[Points; 3]>()
            + self.nodes.capacity() * size_of::<Boxes>()
    }

    /// A triangle's corners.
    pub fn corners(&self, triangle: u32) -> [Vec3; 3] {
        let four = &self.corners[triangle as usize / 4];
        [0, 1, 2].map(|k| four[k].lane(triangle as usize % 4))
    }

    /// The triangle nearest to `p`, beginning from a guess; nothing in an empty patch. Of those
    /// equally near it may be any, though always the same with the same guess.
    pub fn nearest(&self, p: Vec3, guess: Option<u32>) -> Option<Near> {
        if self.is_empty() {
            return None;
        }
        let p = Points::splat(p);
        let mut best = Near {
            squared: f32::INFINITY,
            triangle: 0,
        };
        let leaf_of_guess = guess.map(|guess| guess / 4);
        if let Some(leaf) = leaf_of_guess {
            self.try_leaf(&p, leaf, &mut best);
        }
        self.descend(&p, &p, best.squared, |leaf| {
            if Some(leaf) != leaf_of_guess {
                self.try_leaf(&p, leaf, &mut best);
            }
            best.squared
        });
        Some(best)
    }

    #[inline(always)]
    fn try_leaf(&self, p: &Points, leaf: u32, best: &mut Near) {
        let squared = Faces::of(&self.corners[leaf as usize]).feet(p).squared;
        let least = squared.min_element();
        if least < best.squared {
            let lane = squared.cmpeq(Vec4::splat(least)).bitmask().trailing_zeros();
            *best = Near {
                squared: least,
                triangle: 4 * leaf + lane,
            };
        }
    }

    /// Visits the leaves whose boxes are within a distance of a box, nearer ones sooner; a visit says
    /// which squared distance holds from then on.
    #[inline(always)]
    fn descend(&self, min: &Points, max: &Points, within: f32, mut visit: impl FnMut(u32) -> f32) {
        let mut limit = within * SLACK;
        // Three wait at each level, and there are at most 15 levels.
        let mut stack = [(0.0f32, 0u32, 0u32); 64];
        stack[0] = (0.0, self.levels.len() as u32 - 1, 0);
        let mut depth = 1;
        while depth > 0 {
            depth -= 1;
            let (distance, level, node) = stack[depth];
            if distance > limit {
                continue;
            }
            let boxes = &self.nodes[(self.levels[level as usize] + node) as usize];
            let distances = boxes.distances_squared(min, max);
            let mut bits = distances.cmple(Vec4::splat(limit)).bitmask();
            let distances = distances.to_array();
            let first = depth;
            while bits != 0 {
                let lane = bits.trailing_zeros();
                bits &= bits - 1;
                let distance = distances[lane as usize];
                if distance == f32::INFINITY {
                    continue;
                }
                // The nearest on top.
                let mut i = depth;
                while i > first && stack[i - 1].0 < distance {
                    stack[i] = stack[i - 1];
                    i -= 1;
                }
                stack[i] = (distance, level.wrapping_sub(1), 4 * node + lane);
                depth += 1;
            }
            if level == 0 {
                while depth > first {
                    depth -= 1;
                    if stack[depth].0 <= limit {
                        limit = visit(stack[depth].2) * SLACK;
                    }
                }
            }
        }
    }

    /// The triangles nearest to some points that lie together: one descent for all. `reach` is a
    /// distance, squared, within which they are likely to be found.
    pub fn nearest_of_group(&self, points: &[Points], reach: f32, found: &mut [[Near; 4]]) {
        debug_assert!(!self.is_empty());
        let (mut min, mut max) = (points[0], points[0]);
        for p in points {
            (min, max) = (min.min(p), max.max(p));
        }
        let (low, high) = Boxes { min, max }.around();
        let (min, max) = (Points::splat(low), Points::splat(high));
        // A little farther than the last time, rather than once more.
        let size = low.distance(high);
        let mut within = reach.max(size * size * LEAST);
        loop {
            let mut best = [(Vec4::INFINITY, [0u32; 4]); GROUP];
            self.descend(&min, &max, within, |leaf| {
                let four = &self.corners[leaf as usize];
                let near = Boxes::of(four).distances_squared(&min, &max);
                let mut bits = near.cmple(Vec4::splat(within * SLACK)).bitmask();
                while bits != 0 {
                    let lane = bits.trailing_zeros();
                    bits &= bits - 1;
                    let corners = [0, 1, 2].map(|k| four[k].lane(lane as usize));
                    let [a, b, c] = corners;
                    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
                    let around = Boxes {
                        min: Points::splat(low),
                        max: Points::splat(high),
                    };
                    let mut faces = None;
                    for (p, best) in points.iter().zip(&mut best) {
                        let bound = around.distances_squared(p, p);
                        if !bound.cmplt(best.0).any() {
                            continue;
                        }
                        let faces = faces.get_or_insert_with(|| Faces::splat(corners));
                        let squared = faces.feet(p).squared;
                        let mut nearer = squared.cmplt(best.0).bitmask();
                        best.0 = best.0.min(squared);
                        while nearer != 0 {
                            best.1[nearer.trailing_zeros() as usize] = 4 * leaf + lane;
                            nearer &= nearer - 1;
                        }
                    }
                }
                within
            });
            let farthest = best[..points.len()]
                .iter()
                .fold(0.0f32, |m, b| m.max(b.0.max_element()));
            if farthest <= within {
                for (found, (squared, triangles)) in found.iter_mut().zip(&best[..points.len()]) {
                    *found = std::array::from_fn(|lane| Near {
                        squared: squared[lane],
                        triangle: triangles[lane],
                    });
                }
                return;
            }
            let wider = 4.0 * within;
            within = if farthest < f32::INFINITY {
                // Step by step, as one sample may be far off; from nothing no step leads on.
                if wider > 0.0 {
                    farthest.min(wider)
                } else {
                    farthest
                }
            } else if wider > 0.0 && wider < size * size {
                wider
            } else {
                // Nobody near: one search says how far all can be.
                let near = self.nearest(points[0].lane(0), None).expect("not empty");
                let far = near.squared.sqrt() + size;
                far * far * SLACK
            };
        }
    }
}

/// The share of its squared size within which a group looks at first.
const LEAST: f32 = 1e-3;

/// Fours of points that [`Patch::nearest_of_group`] takes at most.
pub const GROUP: usize = 8;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nearest::nearest_on_triangle;

    /// A seeded generator (Marsaglia 2003, xorshift) of numbers in [-1, 1).
    fn random(seed: u64) -> impl FnMut() -> Vec3 {
        let mut state = seed;
        let mut next = move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 40) as f32 / (1 << 23) as f32 - 1.0
        };
        move || Vec3::new(next(), next(), next())
    }

    fn triangles(n: usize, random: &mut impl FnMut() -> Vec3) -> Vec<[Vec3; 3]> {
        let one = |i: usize| {
            let a = random();
            match i % 5 {
                0 => [a, a, a],
                1 => [a, a + 0.3 * random(), a],
                _ => [a, a + 0.2 * random(), a + 0.2 * random()],
            }
        };
        (0..n).map(one).collect()
    }

    /// One by one and four by four the hierarchy finds the distance that comparing all finds in
    /// double precision.
    #[test]
    fn nearest_equals_brute_force() {
        for (seed, n) in [(1, 1), (2, 3), (3, 17), (4, 300), (5, 1000)] {
            let mut random = random(seed);
            let list = triangles(n, &mut random);
            let patch = Patch::new(list.iter().copied());
            let to = |p: Vec3, t: &[Vec3; 3]| {
                let p = p.as_dvec3();
                nearest_on_triangle(p, &t.map(Vec3::as_dvec3)).distance(p)
            };
            let mut guess = None;
            for i in 0..200 {
                let center = 1.5 * random();
                let group: [Points; 2] = std::array::from_fn(|_| {
                    Points::of(std::array::from_fn(|_| center + 0.05 * random()))
                });
                let mut found = [[Near {
                    squared: 0.0,
                    triangle: 0,
                }; 4]; 2];
                patch.nearest_of_group(&group, [0.0, 1e-3, 1.0][i % 3], &mut found);
                for (p, near) in (0..8).map(|i| (group[i / 4].lane(i % 4), found[i / 4][i % 4])) {
                    let brute = list.iter().map(|t| to(p, t)).fold(f64::INFINITY, f64::min);
                    let one = patch.nearest(p, guess).unwrap();
                    guess = Some(one.triangle);
                    for near in [near, one] {
                        let index = (near.triangle as usize).min(n - 1);
                        assert!(
                            (to(p, &list[index]) - brute).abs() < 1e-6,
                            "seed {seed}, {i}"
                        );
                        let distance = f64::from(near.squared).sqrt();
                        assert!((distance - brute).abs() < 1e-6, "seed {seed}, {i}");
                    }
                }
            }
        }
        assert_eq!(Patch::new([].into_iter()).nearest(Vec3::ZERO, None), None);
    }
}
