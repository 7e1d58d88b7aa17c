//! A surface cut into chunks: pieces of neighbouring vertices with the faces around them.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use super::flat::Flat;
use crate::progress::{self, Meter};
use crate::spatial::Grid;

/// A chunk ends at a multiple of this, where it is much larger.
const GROUP: usize = 64;

/// The faces that are sorted by chunk at a time, at least; and the most such blocks.
const BLOCK_FACES: usize = 1 << 16;
const MOST_BLOCKS: usize = 256;
/// The blocks that are sorted between two words about it.
const AT_A_TIME: usize = 8;

/// A cut of a surface whose vertices are in Morton order, into ranges of them. A face belongs to
/// the chunk in which most of its corners lie (the middle one, where they lie in three).
pub struct Cut {
    /// The first vertex of each chunk, and the end of the last.
    begins: Vec<u32>,
    /// The vertices of a group.
    group: usize,
    /// The chunk of each group of vertices.
    chunk_of_group: Vec<u32>,
    /// The faces of a block.
    block_faces: usize,
    /// Where each chunk's faces begin in each block, and the end of the last.
    begins_in_block: Vec<Vec<u32>>,
    /// The vertices that have a face in a chunk other than theirs.
    shared: Vec<AtomicBool>,
}

impl Cut {
    /// Sorts the vertices by the Morton order of a grid shifted by so much of the box, and the faces,
    /// block by block, by chunk. A chunk has so many vertices, at least and at most.
    ///
    /// Takes 30 bytes a vertex while it runs, 2 a vertex after. Told to a meter: 4 units a vertex, 2 a
    /// face.
    pub fn new<V: Clone + Send + Sync>(
        flat: &mut Flat<V>,
        shift: f32,
        chunk_vertices: &Range<usize>,
        meter: &mut Meter,
    ) -> progress::Result<Self> {
        let grid = Grid::over(&flat.positions, shift);
        let order = grid.order_with(&flat.positions, meter)?;
        permute(&mut flat.positions, &order);
        permute(&mut flat.locked, &order);
        permute(&mut flat.weights, &order);
        permute(&mut flat.deviation, &order);
        permute(&mut flat.states, &order);
        meter.detour(order.len())?;
        let mut renamed = vec![0u32; order.len()];
        for (new, &old) in order.iter().enumerate() {
            renamed[old as usize] = new as u32;
        }
        drop(order);
        let group = if chunk_vertices.start < 4 * GROUP {
            1
        } else {
            GROUP
        };
        let begins = cuts(&flat.positions, &grid, chunk_vertices, group);
        let mut cut = Self {
            group,
            chunk_of_group: Vec::with_capacity(renamed.len().div_ceil(group)),
            block_faces: flat.triangles.len().div_ceil(MOST_BLOCKS).max(BLOCK_FACES),
            begins_in_block: Vec::new(),
            shared: Vec::new(),
            begins,
        };
        for (chunk, range) in cut.begins.windows(2).enumerate() {
            let groups = (range[1] as usize).div_ceil(group);
            cut.chunk_of_group.resize(groups, chunk as u32);
        }
        cut.shared
            .resize_with(renamed.len(), || AtomicBool::new(false));
        let has_more = !flat.flags.is_empty() || !flat.wedges.is_nothing();
        let mut orders = Vec::new();
        for blocks in flat.triangles.chunks_mut(AT_A_TIME * cut.block_faces) {
            let (begins, now) = blocks
                .par_chunks_mut(cut.block_faces)
                .map(|block| {
                    for v in block.as_flattened_mut() {
                        *v = renamed[*v as usize];
                    }
                    let (begins, order) = cut.sort_block(block);
                    (begins, Some(order).filter(|_| has_more))
                })
                .unzip::<_, _, Vec<_>, Vec<_>>();
            cut.begins_in_block.extend(begins);
            orders.extend(now);
            meter.work(2 * blocks.len())?;
        }
        permute_blocks(&mut flat.flags, &orders, cut.block_faces);
        permute_blocks(&mut flat.wedges.corners, &orders, cut.block_faces);
        permute_blocks(&mut flat.wedges.groups, &orders, cut.block_faces);
        Ok(cut)
    }

    /// Sorts faces by chunk, and marks the vertices of other chunks. Where each chunk's faces begin,
    /// and the order.
    fn sort_block(&self, block: &mut [[u32; 3]]) -> (Vec<u32>, Vec<u32>) {
        let mut begins = vec![0u32; self.len() + 1];
        let mut chunks: Vec<u32> = Vec::with_capacity(block.len());
        for t in &*block {
            let [a, b, c] = *t;
            let middle = a.min(b).max(a.max(b).min(c));
            let chunk = self.chunk_of(middle);
            for &v in t {
                if self.chunk_of(v) != chunk {
                    self.shared[v as usize].store(true, Ordering::Relaxed);
                }
            }
            chunks.push(chunk);
            begins[chunk as usize + 1] += 1;
        }
        for chunk in 0..self.len() {
            begins[chunk + 1] += begins[chunk];
        }
        let mut at = begins.clone();
        let mut order = vec![0u32; block.len()];
        for (i, &chunk) in chunks.iter().enumerate() {
            let slot = &mut at[chunk as usize];
            order[*slot as usize] = i as u32;
            *slot += 1;
        }
        let sorted: Vec<[u32; 3]> = order.iter().map(|&i| block[i as usize]).collect();
        block.copy_from_slice(&sorted);
        (begins, order)
    }

    fn chunk_of(&self, v: u32) -> u32 {
        self.chunk_of_group[v as usize / self.group]
    }

    /// The number of chunks.
    pub fn len(&self) -> usize {
        self.begins.len() - 1
    }

    /// The vertices of a chunk.
    pub fn vertices(&self, chunk: usize) -> Range<usize> {
        self.begins[chunk] as usize..self.begins[chunk + 1] as usize
    }

    /// Whether a vertex has a face in a chunk other than its own.
    pub fn is_shared(&self, v: usize) -> bool {
        self.shared[v].load(Ordering::Relaxed)
    }

    /// Where the faces of a chunk stand: a range in each block.
    pub fn faces(&self, chunk: usize) -> impl Iterator<Item = Range<usize>> + '_ {
        let blocks = self.begins_in_block.iter().enumerate();
        blocks.map(move |(block, begins)| {
            let first = block * self.block_faces;
            first + begins[chunk] as usize..first + begins[chunk + 1] as usize
        })
    }

    /// The bytes that the cut holds.
    pub fn bytes(&self) -> usize {
        let words = self.begins.len() * (1 + self.begins_in_block.len());
        (words + self.chunk_of_group.len()) * size_of::<u32>() + self.shared.len()
    }
}

/// Where chunks begin and end: within the bounds of their size, where the largest cubes of the grid
/// meet.
fn cuts(positions: &[Vec3], grid: &Grid, chunk_vertices: &Range<usize>, group: usize) -> Vec<u32> {
    let mut begins = vec![0];
    let mut begin = 0;
    while positions.len() - begin > chunk_vertices.end {
        let first = begin + chunk_vertices.start.next_multiple_of(group);
        let last = begin + chunk_vertices.end.next_multiple_of(group);
        let step_at = |&at: &usize| grid.code(positions[at - 1]) ^ grid.code(positions[at]);
        let ends = (first..=last.min(positions.len() - 1)).step_by(group);
        let end = ends.max_by_key(step_at).expect("more than one group");
        begins.push(end as u32);
        begin = end;
    }
    begins.push(positions.len() as u32);
    begins
}

/// Puts the elements of each block in an order.
fn permute_blocks<T: Copy + Send + Sync>(
    values: &mut [T],
    orders: &[Option<Vec<u32>>],
    block: usize,
) {
    let blocks = values.par_chunks_mut(block).zip(orders);
    blocks.for_each(|(block, order)| {
        let sorted: Vec<T> = order.iter().flatten().map(|&i| block[i as usize]).collect();
        block.copy_from_slice(&sorted);
    });
}

fn permute<T: Clone + Send + Sync>(values: &mut Vec<T>, order: &[u32]) {
    if !values.is_empty() {
        let permuted = order.par_iter().map(|&old| values[old as usize].clone());
        *values = permuted.collect();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::unheard;
    use crate::shapes;

    /// Every face is in one chunk, with most of its corners; a vertex is shared exactly if one of its
    /// faces is elsewhere; the chunks' sizes keep their bounds.
    #[test]
    fn a_cut_deals_out_every_face_once() {
        let (positions, triangles) = shapes::icosphere(6);
        let mut flat = Flat::<()> {
            positions,
            triangles,
            ..Flat::default()
        };
        let corners = |flat: &Flat<()>| {
            let at =
                |t: &[u32; 3]| t.map(|v| flat.positions[v as usize].to_array().map(f32::to_bits));
            let mut corners: Vec<_> = flat.triangles.iter().map(at).collect();
            corners.sort_unstable();
            corners
        };
        let before = corners(&flat);
        let cut = unheard(|meter| Cut::new(&mut flat, 0.3, &(2048..4096), meter));
        assert_eq!(corners(&flat), before);
        assert!(cut.len() > 5);
        let mut seen = vec![0; flat.triangles.len()];
        let mut shared = vec![false; flat.positions.len()];
        for chunk in 0..cut.len() {
            let vertices = cut.vertices(chunk);
            assert!(vertices.len() <= 4096);
            for f in cut.faces(chunk).flatten() {
                seen[f] += 1;
                let inside = |v: &u32| vertices.contains(&(*v as usize));
                let corners = flat.triangles[f];
                assert!(corners.iter().any(inside));
                for &v in corners.iter().filter(|v| !inside(v)) {
                    shared[v as usize] = true;
                }
            }
        }
        assert!(seen.iter().all(|&n| n == 1));
        assert!((0..shared.len()).all(|v| shared[v] == cut.is_shared(v)));
    }
}
