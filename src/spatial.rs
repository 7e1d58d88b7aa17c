//! Morton order of positions: what lies near in space lies near in the list.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::progress::{self, Meter, unheard};

/// A grid of 1024³ cubic cells over the box of some positions, numbered in Morton order (Morton
/// 1966): the bits of the three cell coordinates take turns in the code, so that every cube of
/// 2^k cells a side, at a multiple of 2^k, is one range of codes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    corner: DVec3,
    cells_per_unit: f64,
}

/// Bits of a cell coordinate.
pub const AXIS_BITS: u32 = 10;
const CELLS_A_SIDE: u32 = 1 << AXIS_BITS;
/// The last cell, where positions that are not finite go.
const LAST_CODE: u32 = (1 << (3 * AXIS_BITS)) - 1;

/// Positions a task of the parallel passes takes.
const BLOCK: usize = 1 << 14;

impl Grid {
    /// The grid over the box of these positions, those that are not finite left aside.
    ///
    /// Its corner lies `shift` times the box's longest side before the box's smallest corner, on
    /// each axis, so that a second grid's cells do not coincide with the first's; its own side is
    /// longer by as much and covers the box. `shift` is finite, 0 or more.
    pub fn over(positions: &[Vec3], shift: f32) -> Self {
        debug_assert!(shift.is_finite() && shift >= 0.0, "shift {shift}");
        let empty = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (min, max) = positions
            .par_chunks(BLOCK)
            .map(|block| {
                let finite = block.iter().filter(|p| p.is_finite());
                finite.fold(empty, |(min, max), &p| (min.min(p), max.max(p)))
            })
            .reduce(|| empty, |a, b| (a.0.min(b.0), a.1.max(b.1)));
        if min.x > max.x {
            return Self {
                corner: DVec3::ZERO,
                cells_per_unit: 0.0,
            };
        }
        // In f64: the side of a box of f32 may overflow an f32, and its inverse does sooner.
        let (min, max) = (min.as_dvec3(), max.as_dvec3());
        let longest = (max - min).max_element();
        let shift = f64::from(shift);
        let side = longest * (1.0 + shift);
        Self {
            corner: min - DVec3::splat(longest * shift),
            cells_per_unit: if side > 0.0 {
                f64::from(CELLS_A_SIDE) / side
            } else {
                0.0
            },
        }
    }

    /// The cell of a position, counted along each axis; of a position outside of the grid the
    /// nearest.
    pub fn cell(&self, p: Vec3) -> [u32; 3] {
        let cell = (p.as_dvec3() - self.corner) * self.cells_per_unit;
        cell.to_array().map(|c| (c as u32).min(CELLS_A_SIDE - 1))
    }

    /// The Morton code of a cell.
    pub fn code_of(cell: [u32; 3]) -> u32 {
        let [x, y, z] = cell.map(spread);
        x | y << 1 | z << 2
    }

    /// The Morton code of the cell of a position: 30 bits, 10 an axis, x the lowest of each three.
    ///
    /// A position outside of the grid takes the nearest cell, one that is not finite the last.
    pub fn code(&self, p: Vec3) -> u32 {
        if !p.is_finite() {
            return LAST_CODE;
        }
        Self::code_of(self.cell(p))
    }

    /// The side of a cell; 0 where all positions are one.
    pub fn cell_side(&self) -> f64 {
        if self.cells_per_unit > 0.0 {
            self.cells_per_unit.recip()
        } else {
            0.0
        }
    }

    /// The ids of the positions in Morton order; within a cell by position (x, y, z, as numbers:
    /// −0 is 0), those that are not finite last; then by id.
    ///
    /// Takes 16 bytes a position while it runs, linear time, and O(n log n) for n positions in one
    /// cell. The order does not depend on the number of threads.
    pub fn order(&self, positions: &[Vec3]) -> Vec<u32> {
        unheard(|meter| self.order_with(positions, meter))
    }

    /// [`order`](Self::order), told to a meter: 4 units a position.
    pub(crate) fn order_with(
        &self,
        positions: &[Vec3],
        meter: &mut Meter,
    ) -> progress::Result<Vec<u32>> {
        let places = self.places(positions, meter)?;
        let ids = places.into_par_iter().map(id).with_min_len(BLOCK);
        Ok(ids.collect())
    }

    /// The [codes](Self::code) of the positions and their ids, in the [order](Self::order); told to
    /// a meter: 4 units a position.
    pub(crate) fn sorted(
        &self,
        positions: &[Vec3],
        meter: &mut Meter,
    ) -> progress::Result<impl Iterator<Item = (u32, u32)> + use<>> {
        let places = self.places(positions, meter)?;
        Ok(places.into_iter().map(|place| (code(place), id(place))))
    }

    fn places(&self, positions: &[Vec3], meter: &mut Meter) -> progress::Result<Vec<u64>> {
        let numbered = (0..positions.len() as u32).into_par_iter();
        let mut places: Vec<u64> = numbered
            .with_min_len(BLOCK)
            .map(|v| place(self.code(positions[v as usize]), v))
            .collect();
        meter.work(positions.len())?;
        sort_places(&mut places, positions, meter)?;
        Ok(places)
    }
}

/// A cell's code and the id of a position in it: as numbers they run by code, then by id.
fn place(code: u32, id: u32) -> u64 {
    u64::from(code) << 32 | u64::from(id)
}

fn code(place: u64) -> u32 {
    (place >> 32) as u32
}

fn id(place: u64) -> u32 {
    place as u32
}

/// The ten low bits, two zeros before each.
fn spread(x: u32) -> u32 {
    let x = (x | x << 16) & 0x0300_00FF;
    let x = (x | x << 8) & 0x0300_F00F;
    let x = (x | x << 4) & 0x030C_30C3;
    (x | x << 2) & 0x0924_9249
}

/// Sorts places, given by ascending id, by code, position and id.
///
/// A radix sort of our own, since it may rely on 30-bit codes and ids in order: one pass deals out
/// by the highest ten bits, and each bucket then is sorted in the cache, on any thread.
fn sort_places(
    places: &mut Vec<u64>,
    positions: &[Vec3],
    meter: &mut Meter,
) -> progress::Result<()> {
    let mut buckets = vec![0u64; places.len()];
    let ends = deal(places, &mut buckets, 2 * AXIS_BITS);
    meter.work(places.len())?;
    let mut tasks = Vec::new();
    let (mut bucket_rest, mut spare_rest) = (&mut buckets[..], &mut places[..]);
    let mut begin = 0;
    for end in ends {
        let (bucket, rest) = bucket_rest.split_at_mut((end - begin) as usize);
        bucket_rest = rest;
        let (spare, rest) = spare_rest.split_at_mut((end - begin) as usize);
        spare_rest = rest;
        begin = end;
        if bucket.len() > 1 {
            tasks.push((bucket, spare));
        }
    }
    let sort = |(bucket, spare): &mut (&mut [u64], &mut [u64])| {
        if bucket.len() < SHORT {
            bucket.sort_unstable();
        } else {
            deal(bucket, spare, 0);
            deal(spare, bucket, AXIS_BITS);
        }
        for cell in bucket.chunk_by_mut(|&a, &b| code(a) == code(b)) {
            let at = |&c: &u64| positions[id(c) as usize];
            // A vertex and its copies stand in order already.
            let first = at(&cell[0]);
            if cell[1..].iter().all(|c| at(c) == first) {
                continue;
            }
            let key = |c: &u64| by_position(at(c), id(*c));
            if cell.len() < SHORT {
                cell.sort_unstable_by_key(key);
            } else {
                cell.par_sort_unstable_by_key(key);
            }
        }
    };
    let mut tasks = &mut tasks[..];
    while !tasks.is_empty() {
        let mut sum = 0;
        let fits = |task: &&(&mut [u64], &mut [u64])| {
            let fits = sum < AT_A_TIME;
            sum += task.0.len();
            fits
        };
        let (now, later) = tasks.split_at_mut(tasks.iter().take_while(fits).count());
        now.par_iter_mut().for_each(sort);
        meter.work(2 * now.iter().map(|task| task.0.len()).sum::<usize>())?;
        tasks = later;
    }
    *places = buckets;
    Ok(())
}

/// The places that are sorted between two words about it, at least.
const AT_A_TIME: usize = 1 << 19;

/// Below this many places comparing is cbucketer than two deals over 1024 counts (measured).
const SHORT: usize = 256;

/// Deals places out by the ten bits of their codes from bit `low`, keeping the order within each
/// bucket, and returns where each bucket ends.
fn deal(from: &[u64], to: &mut [u64], low: u32) -> [u32; 1 << AXIS_BITS] {
    let bucket = |c: u64| (c >> (32 + low)) as usize & ((1 << AXIS_BITS) - 1);
    let mut ends = [0u32; 1 << AXIS_BITS];
    for &c in from {
        ends[bucket(c)] += 1;
    }
    let mut sum = 0;
    for slot in &mut ends {
        let count = *slot;
        *slot = sum;
        sum += count;
    }
    for &c in from {
        let slot = &mut ends[bucket(c)];
        to[*slot as usize] = c;
        *slot += 1;
    }
    ends
}

/// What orders the positions within a cell.
fn by_position(p: Vec3, id: u32) -> (bool, [i32; 3], u32) {
    if !p.is_finite() {
        return (true, [0; 3], id);
    }
    // Adding zero turns −0 into 0. The bits of a negative number grow with its size: turned round
    // but for the sign they compare like the number.
    let ordered = (p + Vec3::ZERO).to_array().map(|c| {
        let bits = c.to_bits().cast_signed();
        bits ^ (bits >> 31 & i32::MAX)
    });
    (false, ordered, id)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The order by one comparison sort over floats, codes bit by bit.
    fn naive_order(grid: &Grid, positions: &[Vec3]) -> Vec<u32> {
        let key = |&v: &u32| {
            let p = positions[v as usize];
            (grid.code(p), !p.is_finite())
        };
        let mut ids: Vec<u32> = (0..positions.len() as u32).collect();
        ids.sort_by(|a, b| {
            let (p, q) = (positions[*a as usize], positions[*b as usize]);
            let places = if p.is_finite() && q.is_finite() {
                p.to_array().partial_cmp(&q.to_array()).unwrap()
            } else {
                std::cmp::Ordering::Equal
            };
            key(a).cmp(&key(b)).then(places).then(a.cmp(b))
        });
        ids
    }

    fn is_as_naive(positions: &[Vec3], what: &str) {
        for shift in [0.0, 0.3] {
            let grid = Grid::over(positions, shift);
            let order = grid.order(positions);
            assert!(
                order == naive_order(&grid, positions),
                "{what}, shift {shift}"
            );
        }
    }

    /// Numbers in [−1, 1) (Steele, Lea, Flood 2014, SplitMix).
    fn random(seed: u64) -> impl FnMut() -> f32 {
        let mut state = seed;
        move || {
            state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut h = state;
            h = (h ^ (h >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            h = (h ^ (h >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
            ((h ^ (h >> 31)) >> 40) as f32 / (1 << 23) as f32 - 1.0
        }
    }

    fn cloud(seed: u64, n: usize) -> Vec<Vec3> {
        let mut random = random(seed);
        (0..n)
            .map(|_| Vec3::new(random(), random(), random()))
            .collect()
    }

    /// The eight corners of a cube are the eight first-level cells, in the order of the bits.
    #[test]
    fn a_code_interleaves_x_y_z() {
        let corners: Vec<Vec3> = (0..8)
            .map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32))
            .collect();
        let grid = Grid::over(&corners, 0.0);
        for (i, &p) in corners.iter().enumerate() {
            assert_eq!(grid.code(p) >> 27, i as u32, "{p}");
        }
        assert_eq!(grid.code(corners[7]), LAST_CODE);
        for bit in 0..AXIS_BITS {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
    }

    /// A flat box has cubic cells too: the short side takes few of them.
    #[test]
    fn cells_are_cubes() {
        let grid = Grid::over(&[Vec3::ZERO, Vec3::new(1024.0, 3.0, 0.0)], 0.0);
        assert_eq!(grid.code(Vec3::new(1.5, 2.5, 0.5)), 0b001 | 0b010_000);
    }

    /// Half a box further the corner of the box is cell 341 of 1024 on each axis.
    #[test]
    fn a_shifted_grid_covers_the_box() {
        let corners = [Vec3::ZERO, Vec3::ONE];
        let grid = Grid::over(&corners, 0.5);
        assert_eq!(grid.code(Vec3::ZERO), 7 * spread(341));
        assert_eq!(grid.code(Vec3::ONE), LAST_CODE);
    }

    #[test]
    fn the_order_is_that_of_a_naive_sort() {
        is_as_naive(&cloud(1, 20_000), "cloud of seed 1");
        let snapped: Vec<Vec3> = cloud(2, 20_000)
            .iter()
            .map(|p| (p * 4.0).round() * 0.25)
            .collect();
        is_as_naive(&snapped, "lattice of seed 2, with -0");
        let line: Vec<Vec3> = cloud(3, 5_000).iter().map(|p| Vec3::X * p.x).collect();
        is_as_naive(&line, "line of seed 3");
    }

    /// One position far away leaves all others in one cell: they are sorted by position there.
    #[test]
    fn all_in_one_cell_is_no_special_case() {
        let mut positions = cloud(4, 200_000);
        positions.push(Vec3::splat(3.0e38));
        is_as_naive(&positions, "cloud of seed 4 and one far away");
        let order = Grid::over(&positions, 0.0).order(&positions);
        assert_eq!(order.last(), Some(&200_000));
    }

    #[test]
    fn extreme_input_is_ordered() {
        let p = Vec3::new(0.5, -1.0, 2.0);
        is_as_naive(&[], "nothing");
        is_as_naive(&[p], "one");
        is_as_naive(&[p; 1000], "all equal");
        for scale in [1.0e-45, 1.0e-38, 1.0e38, 3.4e38] {
            let scaled: Vec<Vec3> = cloud(5, 3000).iter().map(|&p| p * scale).collect();
            is_as_naive(&scaled, &format!("cloud of seed 5 times {scale:e}"));
        }
        let mut wild = cloud(6, 3000);
        for (i, bad) in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -f32::NAN]
            .into_iter()
            .enumerate()
        {
            wild[700 * i].x = bad;
            wild[700 * i + 1] = Vec3::splat(bad);
        }
        is_as_naive(
            &wild,
            "cloud of seed 6 with coordinates that are not finite",
        );
        is_as_naive(&[Vec3::NAN; 3], "nothing finite");
    }

    #[test]
    fn the_order_does_not_depend_on_threads() {
        let positions = cloud(7, 100_000);
        let with = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let order = || Grid::over(&positions, 0.1).order(&positions);
            pool.build().unwrap().install(order)
        };
        assert!(with(1) == with(4));
    }
}
