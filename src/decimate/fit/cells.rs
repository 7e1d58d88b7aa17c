//! Triangles sorted into the cells of a grid, to find those near a place.

use glam::Vec3;

use crate::progress::{self, BLOCK, Meter};
use crate::spatial::{AXIS_BITS, Grid};

/// Bits of a cell's coordinate at most: a set of cells takes 2 MB then.
const MOST_BITS: u32 = 8;

/// Triangles in a cell, at least, on the mean.
const FEWEST: usize = 24;

/// A triangle that reaches farther from its centroid, in cells, is kept aside.
const REACH: f64 = 0.25;

/// The bits of a cell's code that are of its first axis. Those of an axis alone order cells along it.
const AXIS: u32 = 0x0924_9249;

/// Triangles by the cells that their centroids lie in.
pub struct Cells {
    grid: Grid,
    /// Bits of a cell's coordinate.
    bits: u32,
    /// The triangles, by cell and within a cell in Morton order.
    order: Vec<u32>,
    /// The cells that hold any, and where each begins.
    occupied: Vec<(u32, u32)>,
    /// The triangles that reach far, with the boxes around them.
    large: Vec<(u32, [Vec3; 2])>,
}

impl Cells {
    /// Sorts triangles by the cells of a grid. Takes 36 bytes a triangle while it runs, 4 to 5 after.
    /// Told to a meter: 10 units a triangle.
    pub fn new(
        grid: Grid,
        count: usize,
        corners: impl Fn(usize) -> [Vec3; 3],
        meter: &mut Meter,
    ) -> progress::Result<Self> {
        let mut centroids = Vec::with_capacity(count);
        let mut extents = Vec::with_capacity(count);
        for i in 0..count {
            let [a, b, c] = corners(i);
            let center = a / 3.0 + b / 3.0 + c / 3.0;
            let extent = (a - center)
                .abs()
                .max((b - center).abs())
                .max((c - center).abs());
            centroids.push(center);
            extents.push(extent.max_element());
            if i % BLOCK == BLOCK - 1 {
                meter.work(2 * BLOCK)?;
            }
        }
        let sorted = grid.sorted(&centroids, meter)?;
        drop(centroids);
        let mut order = Vec::with_capacity(count);
        let mut codes = Vec::with_capacity(count);
        // How many more cells are occupied with one bit more.
        let mut more = [0usize; 11];
        let mut last = None;
        for (code, i) in sorted {
            let differ = last.map_or(0u32, |last: u32| last ^ code);
            if let Some(highest) = differ.checked_ilog2() {
                more[10 - highest as usize / 3] += 1;
            }
            last = Some(code);
            codes.push(code);
            order.push(i);
        }
        meter.work(2 * count)?;
        let (mut bits, mut cells) = (0, 1);
        while bits < MOST_BITS {
            cells += more[bits as usize + 1];
            if cells * FEWEST > count {
                break;
            }
            bits += 1;
        }
        let reach = (REACH * side(&grid, bits)) as f32;
        let mut large = Vec::new();
        let mut occupied: Vec<(u32, u32)> = Vec::new();
        let mut codes = codes.into_iter();
        let mut at = 0;
        order.retain(|&i| {
            let code = codes.next().expect("one a triangle");
            if extents[i as usize] > reach {
                let [a, b, c] = corners(i as usize);
                large.push((i, [a.min(b).min(c), a.max(b).max(c)]));
                return false;
            }
            let cell = code >> (30 - 3 * bits);
            if occupied.last().is_none_or(|last| last.0 != cell) {
                occupied.push((cell, at));
            }
            at += 1;
            true
        });
        order.shrink_to_fit();
        meter.work(2 * count)?;
        Ok(Self {
            grid,
            bits,
            order,
            occupied,
            large,
        })
    }

    /// About how many triangles come before a position in Morton order.
    pub fn before(&self, p: Vec3) -> usize {
        let cell = self.cell(p);
        let at = self.occupied.partition_point(|o| o.0 < cell);
        self.begin(at)
    }

    fn begin(&self, at: usize) -> usize {
        self.occupied
            .get(at)
            .map_or(self.order.len(), |o| o.1 as usize)
    }

    fn cell(&self, p: Vec3) -> u32 {
        self.grid.code(p) >> (30 - 3 * self.bits)
    }

    /// The triangles near some boxes: all those that meet one, and others. In Morton order, but for
    /// those that reach far.
    pub fn near(&self, boxes: impl Iterator<Item = [Vec3; 2]>, seen: &mut Seen) -> Vec<u32> {
        if self.order.is_empty() && self.large.is_empty() {
            return Vec::new();
        }
        let side = side(&self.grid, self.bits);
        let reach = Vec3::splat((REACH * side) as f32);
        seen.bits.resize(1 << (3 * self.bits).max(6) >> 6, 0);
        let mut cells = Vec::new();
        let mut meet = |cell: u32| {
            let word = &mut seen.bits[cell as usize >> 6];
            let bit = 1 << (cell & 63);
            if *word & bit == 0 {
                *word |= bit;
                cells.push(cell);
            }
        };
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for [min, max] in boxes {
            (low, high) = (low.min(min), high.max(max));
            let (min, max) = (min - reach, max + reach);
            let shift = AXIS_BITS - self.bits;
            let [first, last] = [min, max].map(|p| self.grid.cell(p).map(|c| c >> shift));
            let sides = [0, 1, 2].map(|k| last[k] as usize + 1 - first[k] as usize);
            if sides.into_iter().product::<usize>() > self.occupied.len() {
                // Of a vertex far away all else lies in a few of very many cells.
                let [first, last] = [first, last].map(Grid::code_of);
                let is_between = |cell: u32| {
                    let mut axes = [0, 1, 2].into_iter().map(|k| AXIS << k);
                    axes.all(|axis| (first & axis..=last & axis).contains(&(cell & axis)))
                };
                let occupied = self.occupied.iter().map(|o| o.0);
                occupied
                    .filter(|&cell| is_between(cell))
                    .for_each(&mut meet);
                continue;
            }
            for z in first[2]..=last[2] {
                for y in first[1]..=last[1] {
                    for x in first[0]..=last[0] {
                        meet(Grid::code_of([x, y, z]));
                    }
                }
            }
        }
        cells.sort_unstable();
        let mut found = Vec::new();
        for cell in cells {
            seen.bits[cell as usize >> 6] = 0;
            if let Ok(at) = self.occupied.binary_search_by_key(&cell, |o| o.0) {
                found.extend_from_slice(&self.order[self.begin(at)..self.begin(at + 1)]);
            }
        }
        let meets = |[min, max]: &[Vec3; 2]| min.cmple(high).all() && low.cmple(*max).all();
        found.extend(self.large.iter().filter(|l| meets(&l.1)).map(|l| l.0));
        found
    }

    /// The bytes held.
    pub fn bytes(&self) -> usize {
        self.order.capacity() * size_of::<u32>()
            + self.occupied.capacity() * size_of::<(u32, u32)>()
            + self.large.capacity() * size_of::<(u32, [Vec3; 2])>()
    }
}

/// One bit a cell; kept for its memory.
#[derive(Default)]
pub struct Seen {
    bits: Vec<u64>,
}

/// The side of a cell.
fn side(grid: &Grid, bits: u32) -> f64 {
    grid.cell_side() * f64::from(1 << (10 - bits))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::unheard;
    use crate::shapes;

    /// Every triangle whose box meets the box asked for is found, and none twice.
    #[test]
    fn what_meets_a_box_is_near() {
        let (mut positions, triangles) = shapes::icosphere(5);
        positions[7] *= 3.0;
        let corners = |i: usize| triangles[i].map(|v| positions[v as usize]);
        let grid = Grid::over(&positions, 0.0);
        let cells = unheard(|meter| Cells::new(grid, triangles.len(), corners, meter));
        assert!(cells.bits > 1 && !cells.large.is_empty());
        let mut seen = Seen::default();
        let all = [Vec3::splat(-9.0), Vec3::splat(9.0)];
        let found = cells.near([all].into_iter(), &mut seen);
        assert_eq!(found.len(), triangles.len());
        for i in 0..100 {
            let center = positions[i * 97];
            let size = Vec3::new(0.3, 0.02, 0.1) * (i % 10) as f32 * 0.3;
            let (low, high) = (center - size, center + size);
            let mut found = cells.near([[low, high]].into_iter(), &mut seen);
            found.sort_unstable();
            assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "{i}");
            for t in 0..triangles.len() {
                let [a, b, c] = corners(t);
                let (min, max) = (a.min(b).min(c), a.max(b).max(c));
                if min.cmple(high).all() && low.cmple(max).all() {
                    assert!(found.binary_search(&(t as u32)).is_ok(), "{i}: {t}");
                }
            }
        }
    }
}
