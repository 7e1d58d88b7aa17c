//! Makes a simplicial complex of whatever a file held: welds, drops, folds, and counts.

use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;

use crate::error::Result;
use crate::indexed_mesh::{IndexedMesh, Parts};
use crate::progress::{self, Meter, unheard};
use crate::spatial::Grid;

/// What cleaning found and did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Cleaning {
    /// Vertices merged into an earlier one at the same position (as numbers: −0 is 0).
    pub welded_vertices: usize,
    /// Faces dropped because a coordinate of theirs is not finite.
    pub dropped_non_finite_faces: usize,
    /// Faces dropped because they name a vertex twice, after welding.
    pub dropped_degenerate_faces: usize,
    /// Faces dropped because another has the same vertices in the same direction.
    pub dropped_duplicate_faces: usize,
    /// Faces folded into another with the same vertices in the opposite direction: a double-sided
    /// sheet, which counts as two and is unfolded on writing.
    pub folded_faces: usize,
    /// Vertices dropped because no face uses them.
    pub dropped_isolated_vertices: usize,
    /// Vertices kept.
    pub kept_vertices: usize,
    /// Faces kept, folded ones counted once.
    pub kept_faces: usize,
}

/// Elements that a task of a parallel pass takes, and that are visited between two words about it.
const BLOCK: usize = 1 << 14;

/// The mesh as a simplicial complex: no repeated vertex in a face, no face twice, every vertex used
/// and finite; `weld` merges vertices at equal positions first.
///
/// Vertices and faces keep their order, the first of equals stays, with the largest of the welded
/// vertices' weights. The corners keep their attributes, a face folded into another does not. Needs 5 bytes a vertex and 4 a face beside the mesh, and up to 16 a vertex
/// that has a twin and 10 a face that has one. Linear time, but for a logarithm in the vertices in
/// one cell of a [`Grid`] and in the faces at a vertex.
///
/// # Errors
/// None today.
pub fn clean(mesh: IndexedMesh, weld: bool) -> Result<(IndexedMesh, Cleaning)> {
    Ok(unheard(|meter| clean_with(mesh, weld, meter)))
}

/// [`clean`], told to a meter: 3 units a vertex and a triangle, more where many have twins.
pub(crate) fn clean_with(
    mesh: IndexedMesh,
    weld: bool,
    meter: &mut Meter,
) -> progress::Result<(IndexedMesh, Cleaning)> {
    let mut counts = Cleaning::default();
    let mut parts = mesh.into_parts();
    if weld {
        counts.welded_vertices = weld_positions(&mut parts, meter)?;
        if counts.welded_vertices > 0 {
            parts.attributes.merge_equal_wedges(&parts.triangles);
        }
    }
    let mut faces = Faces::sift(&parts, &mut counts, meter)?;
    faces.fold_duplicates(&mut parts, &mut counts, meter)?;
    let Faces { keep, used, .. } = faces;
    if !keep.is_empty() {
        retain(&keep, &mut parts.triangles);
        retain(&keep, &mut parts.double_sided);
        parts.attributes.retain_triangles(&keep);
        parts.attributes.drop_unused_wedges();
    }
    let kept = used.iter().filter(|&&u| u).count();
    meter.work(used.len())?;
    if kept < used.len() {
        counts.dropped_isolated_vertices = used.len() - kept - counts.welded_vertices;
        rename(&renumbered(&used), &mut parts.triangles);
        meter.detour(parts.triangles.len())?;
        retain(&used, &mut parts.positions);
        retain(&used, &mut parts.weights);
    }
    counts.kept_vertices = parts.positions.len();
    counts.kept_faces = parts.triangles.len();
    Ok((IndexedMesh::from_valid(parts), counts))
}

/// The new number of each element whose flag is set, when only those are kept; of no use for others.
pub(crate) fn renumbered(keep: &[bool]) -> Vec<u32> {
    let mut new = 0u32;
    let number = |&keep: &bool| {
        new += u32::from(keep);
        new.wrapping_sub(1)
    };
    keep.iter().map(number).collect()
}

/// Keeps the elements whose flag is set; an empty list stays empty.
pub(crate) fn retain<T>(keep: &[bool], values: &mut Vec<T>) {
    let mut keep = keep.iter();
    values.retain(|_| keep.next().is_some_and(|&k| k));
    values.shrink_to_fit();
}

/// Lets every corner name the new vertex instead of the old.
pub(crate) fn rename(new: &[u32], triangles: &mut [[u32; 3]]) {
    let blocks = triangles.par_chunks_mut(BLOCK);
    blocks.for_each(|block| {
        for v in block.iter_mut().flatten() {
            *v = new[*v as usize];
        }
    });
}

/// Finds which of many keys may be there twice, by a hash of each: most are told apart from all
/// others in two passes over a few bits a key, and only the rest need to be compared.
struct Sieve {
    seen: Vec<u64>,
    seen_again: Vec<u64>,
    /// How many keys found their bit taken.
    repeats: usize,
}

/// Of different keys 1 − e^(−1/16), 6 %, share a bit with another. 8 bits leave twice as many to
/// compare, 32 leave the cache earlier.
const SIEVE_BITS_A_KEY: usize = 16;

impl Sieve {
    fn for_keys(keys: usize) -> Self {
        let words = (keys * SIEVE_BITS_A_KEY).div_ceil(64);
        Self {
            seen: vec![0; words],
            seen_again: vec![0; words],
            repeats: 0,
        }
    }

    /// The word and the bit of a hash, whose high bits count.
    fn place(&self, hash: u64) -> (usize, u64) {
        let bits = 64 * self.seen.len() as u64;
        let bit = ((hash >> 32) * bits) >> 32;
        ((bit / 64) as usize, 1 << (bit % 64))
    }

    fn add(&mut self, hash: u64) {
        let (word, bit) = self.place(hash);
        if self.seen[word] & bit != 0 {
            self.seen_again[word] |= bit;
            self.repeats += 1;
        }
        self.seen[word] |= bit;
    }

    /// Whether a key with this hash was added twice; rarely also whether another one was.
    fn may_repeat(&self, hash: u64) -> bool {
        let (word, bit) = self.place(hash);
        self.seen_again[word] & bit != 0
    }
}

/// The numbers, in order, of the values that fulfil a condition on themselves and their number.
fn numbers_where<T: Sync>(values: &[T], is: impl Fn(usize, &T) -> bool + Sync) -> Vec<u32> {
    let blocks = values.par_chunks(BLOCK).enumerate();
    let numbers = blocks.flat_map_iter(|(b, block)| {
        let numbered = block.iter().zip(b * BLOCK..);
        numbered.filter_map(|(value, i)| is(i, value).then_some(i as u32))
    });
    numbers.collect()
}

/// Of these keys, given by their numbers, those that may be there twice by other bits of their hashes.
///
/// Of different keys 6 % of the 6 % are left: sieving again is cheaper than comparing those.
fn sieve_again(keys: &mut Vec<u32>, hash: impl Fn(u32) -> u64) {
    let other = |i: u32| {
        let hash = hash(i);
        (hash ^ hash >> 32).wrapping_mul(GOLDEN)
    };
    let mut sieve = Sieve::for_keys(keys.len());
    keys.iter().for_each(|&i| sieve.add(other(i)));
    keys.retain(|&i| sieve.may_repeat(other(i)));
}

/// An odd number whose bits look random: 2^64 over the golden ratio.
const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

/// A hash of a position as numbers: adding zero turns −0 into 0.
fn hash_of_position(p: Vec3) -> u64 {
    let [x, y, z] = (p + Vec3::ZERO).to_array().map(|c| u64::from(c.to_bits()));
    let xy = (x | y << 32).wrapping_mul(GOLDEN);
    (xy ^ xy >> 32).wrapping_add(z).wrapping_mul(GOLDEN)
}

/// A hash of three vertices in any order: the product is symmetric, and the summand lets it depend
/// on their sum and on the sum of their products too.
fn hash_of_face(t: [u32; 3]) -> u64 {
    let [a, b, c] = t.map(|v| GOLDEN.wrapping_add(v.into()));
    a.wrapping_mul(b).wrapping_mul(c)
}

/// Lets every triangle name the first vertex at each position, which takes the largest weight there,
/// and returns how many others there were. Positions that are not finite are left alone.
fn weld_positions(parts: &mut Parts, meter: &mut Meter) -> progress::Result<usize> {
    let positions = &parts.positions[..];
    let order = twins_in_order(positions, meter)?;
    let mut first: Vec<u32> = Vec::new();
    let mut welded = 0;
    let is_same = |&a: &u32, &b: &u32| positions[a as usize] == positions[b as usize];
    for same in order.chunk_by(is_same).filter(|same| same.len() > 1) {
        if !positions[same[0] as usize].is_finite() {
            continue;
        }
        if first.is_empty() {
            first = (0..positions.len() as u32).collect();
        }
        same.iter().for_each(|&v| first[v as usize] = same[0]);
        welded += same.len() - 1;
        meter.detour(same.len())?;
    }
    if welded > 0 {
        rename(&first, &mut parts.triangles);
        meter.detour(parts.triangles.len())?;
        let weights = &mut parts.weights;
        // Where there are weights at all.
        for (v, &at_first) in first.iter().enumerate().take(weights.len()) {
            let at_first = at_first as usize;
            weights[at_first] = weights[at_first].max(weights[v]);
        }
    }
    Ok(welded)
}

/// Vertices, those with equal positions side by side, the first in front: all that have a twin, and
/// some that have none.
///
/// Sorted and not hashed, so that no crafted input takes quadratic time.
fn twins_in_order(positions: &[Vec3], meter: &mut Meter) -> progress::Result<Vec<u32>> {
    // So many twins, as in a soup of triangles, are not worth being told apart.
    let many = positions.len() / 4;
    let mut sieve = Sieve::for_keys(positions.len());
    for block in positions.chunks(BLOCK) {
        block.iter().for_each(|&p| sieve.add(hash_of_position(p)));
        if sieve.repeats > many {
            drop(sieve);
            return Grid::over(positions, 0.0).order_with(positions, meter);
        }
        meter.work(block.len())?;
    }
    let mut candidates = numbers_where(positions, |_, &p| sieve.may_repeat(hash_of_position(p)));
    drop(sieve);
    meter.work(positions.len())?;
    sieve_again(&mut candidates, |v| hash_of_position(positions[v as usize]));
    let places: Vec<Vec3> = candidates.iter().map(|&v| positions[v as usize]).collect();
    let mut order = Grid::over(&places, 0.0).order_with(&places, meter)?;
    order.iter_mut().for_each(|i| *i = candidates[*i as usize]);
    Ok(order)
}

/// What is known of the faces: which stay, which vertices they use, and which may have a twin.
struct Faces {
    /// One flag a face, or nothing where all stay.
    keep: Vec<bool>,
    used: Vec<bool>,
    sieve: Sieve,
}

impl Faces {
    /// Drops the faces with a coordinate that is not finite or a vertex twice.
    fn sift(parts: &Parts, counts: &mut Cleaning, meter: &mut Meter) -> progress::Result<Self> {
        let Parts {
            positions,
            triangles,
            ..
        } = parts;
        let mut faces = Self {
            keep: Vec::new(),
            used: vec![false; positions.len()],
            sieve: Sieve::for_keys(triangles.len()),
        };
        // Asked for each vertex once, in order, and almost always enough.
        let all_finite = positions
            .par_chunks(BLOCK)
            .all(|block| block.iter().all(|p| p.is_finite()));
        for (i, &t) in triangles.iter().enumerate() {
            if i % BLOCK == BLOCK - 1 {
                meter.work(2 * BLOCK)?;
            }
            let is_finite = all_finite || t.iter().all(|&v| positions[v as usize].is_finite());
            let is_proper = t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
            if is_finite && is_proper {
                t.iter().for_each(|&v| faces.used[v as usize] = true);
                faces.sieve.add(hash_of_face(t));
            } else {
                counts.dropped_non_finite_faces += usize::from(!is_finite);
                counts.dropped_degenerate_faces += usize::from(is_finite);
                faces.drop(i, triangles.len());
            }
        }
        Ok(faces)
    }

    /// Drops face `i` of so many.
    fn drop(&mut self, i: usize, faces: usize) {
        if self.keep.is_empty() {
            self.keep = vec![true; faces];
        }
        self.keep[i] = false;
    }

    /// Finds faces with the same three vertices among those kept. The first stays; the first that
    /// runs the other way is folded into it; the others are dropped. All use the same vertices.
    fn fold_duplicates(
        &mut self,
        parts: &mut Parts,
        counts: &mut Cleaning,
        meter: &mut Meter,
    ) -> progress::Result<()> {
        let Parts {
            triangles,
            double_sided,
            ..
        } = parts;
        let triangles = &triangles[..];
        let Self { keep, sieve, .. } = &*self;
        let mut candidates = numbers_where(triangles, |i, &t| {
            sieve.may_repeat(hash_of_face(t)) && (keep.is_empty() || keep[i])
        });
        self.sieve = Sieve::for_keys(0);
        meter.work(triangles.len())?;
        sieve_again(&mut candidates, |i| hash_of_face(triangles[i as usize]));
        meter.detour(2 * candidates.len())?;

        // The corner with the smallest id first; the direction of the other two is the face's.
        let turned = |i: u32| {
            let [a, b, c] = triangles[i as usize];
            if a < b && a < c {
                [a, b, c]
            } else if b < c {
                [b, c, a]
            } else {
                [c, a, b]
            }
        };
        // A bucket for each few ids of the smallest corner, about as many as candidates.
        let vertices_a_candidate = self.used.len() / candidates.len().max(1);
        let shift = vertices_a_candidate.max(1).ilog2();
        let bucket_of = |i: u32| turned(i)[0] as usize >> shift;
        let buckets = (self.used.len() >> shift) + 1;
        let mut end_of_bucket = vec![0u32; buckets + 1];
        for &i in &candidates {
            end_of_bucket[bucket_of(i) + 1] += 1;
        }
        for b in 0..buckets {
            end_of_bucket[b + 1] += end_of_bucket[b];
        }
        let mut bucketed = vec![0u32; candidates.len()];
        for &i in &candidates {
            let slot = &mut end_of_bucket[bucket_of(i)];
            bucketed[*slot as usize] = i;
            *slot += 1;
        }
        meter.detour(2 * candidates.len())?;
        drop(candidates);
        let mut bucket: Vec<([u32; 3], u32, bool)> = Vec::new();
        let mut begin = 0;
        for &end in &end_of_bucket[..buckets] {
            let end = end as usize;
            let members = &bucketed[begin..end];
            begin = end;
            if members.len() < 2 {
                continue;
            }
            meter.detour(2 * members.len())?;
            bucket.clear();
            bucket.extend(members.iter().map(|&i| {
                let [a, b, c] = turned(i);
                ([a, b.min(c), b.max(c)], i, b < c)
            }));
            bucket.sort_unstable();
            for same in bucket
                .chunk_by(|a, b| a.0 == b.0)
                .filter(|same| same.len() > 1)
            {
                let (_, first, direction) = same[0];
                let is_double =
                    |flags: &[bool], i: u32| flags.get(i as usize).copied().unwrap_or(false);
                let mut folded = is_double(double_sided, first);
                for &(_, i, other) in &same[1..] {
                    self.drop(i as usize, triangles.len());
                    if !folded && (other != direction || is_double(double_sided, i)) {
                        folded = true;
                        counts.folded_faces += 1;
                        double_sided.resize(triangles.len(), false);
                        double_sided[first as usize] = true;
                    } else {
                        counts.dropped_duplicate_faces += 1;
                    }
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;

    fn mesh(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> IndexedMesh {
        let positions = positions.iter().map(|&p| p.into()).collect();
        IndexedMesh::new(positions, triangles.to_vec()).unwrap()
    }

    const SQUARE: [[f32; 3]; 4] = [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.]];

    /// Two triangles that share no index but an edge: six vertices become four. −0 is 0.
    #[test]
    fn equal_positions_are_welded_as_numbers() {
        let [a, b, c, d] = SQUARE;
        let positions = [a, b, c, [-0.0, 0.0, -0.0], c, d];
        let soup = mesh(&positions, &[[0, 1, 2], [3, 4, 5]]);
        let (welded, counts) = clean(soup.clone(), true).unwrap();
        assert_eq!(welded.triangles(), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(welded.positions().len(), 4);
        assert_eq!(
            (counts.welded_vertices, counts.dropped_isolated_vertices),
            (2, 0)
        );

        let (apart, counts) = clean(soup.clone(), false).unwrap();
        assert_eq!(apart, soup);
        assert_eq!(counts.welded_vertices, 0);
    }

    /// The soup above with a lone vertex in front: of 2 and 7 at one place 7 is left, wherever it
    /// stood, and the lone vertex takes its weight along.
    #[test]
    fn welded_vertices_keep_the_largest_weight() {
        let [a, b, c, d] = SQUARE;
        let soup = mesh(&[[9.; 3], a, b, c, a, c, d], &[[1, 2, 3], [4, 5, 6]])
            .with_weights(vec![5.0, 2.0, 3.0, f32::INFINITY, 7.0, 0.5, 0.0])
            .unwrap();
        let (welded, _) = clean(soup.clone(), true).unwrap();
        assert_eq!(welded.weights(), [7.0, 3.0, f32::INFINITY, 0.0]);
        let (apart, _) = clean(soup.clone(), false).unwrap();
        assert_eq!(apart.weights(), &soup.weights()[1..]);
    }

    /// One face of each kind: repeated vertex, not finite, same-way duplicate (rotated), opposite.
    #[test]
    fn each_kind_of_face_is_counted_where_it_belongs() {
        let mut positions = SQUARE.to_vec();
        positions.extend([[f32::NAN, 0., 0.], [5., 5., 5.]]);
        let triangles = [
            [0, 1, 2],
            [0, 0, 1],
            [0, 1, 4],
            [1, 2, 0],
            [0, 2, 1],
            [2, 1, 0],
            [0, 2, 3],
        ];
        let (kept, counts) = clean(mesh(&positions, &triangles), true).unwrap();
        assert_eq!(kept.triangles(), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(kept.double_sided(), [true, false]);
        assert_eq!(kept.triangle_count(), 3);
        let expected = Cleaning {
            welded_vertices: 0,
            dropped_non_finite_faces: 1,
            dropped_degenerate_faces: 1,
            dropped_duplicate_faces: 2,
            folded_faces: 1,
            dropped_isolated_vertices: 2,
            kept_vertices: 4,
            kept_faces: 2,
        };
        assert_eq!(counts, expected);
    }

    /// A clean mesh passes through, and so does the result of cleaning.
    #[test]
    fn cleaning_twice_changes_nothing() {
        let (positions, mut triangles) = crate::shapes::icosphere(2);
        triangles.push([triangles[3][0], triangles[3][2], triangles[3][1]]);
        let soup = IndexedMesh::new(positions, triangles).unwrap();
        let (once, first) = clean(soup, true).unwrap();
        let (twice, counts) = clean(once.clone(), true).unwrap();
        assert_eq!(first.folded_faces, 1);
        assert_eq!(once, twice);
        assert_eq!(counts.folded_faces + counts.dropped_duplicate_faces, 0);
    }

    /// 20 000 faces at one vertex, every one twice: no quadratic time.
    #[test]
    fn a_busy_vertex_is_cleaned_quickly() {
        let n = 20_000u32;
        let positions: Vec<[f32; 3]> = (0..=n).map(|i| [i as f32, (i % 7) as f32, 1.0]).collect();
        let cone = (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]);
        let triangles: Vec<_> = cone.clone().chain(cone).collect();
        let (_, counts) = clean(mesh(&positions, &triangles), true).unwrap();
        assert_eq!(counts.dropped_duplicate_faces, n as usize);
    }

    /// The triangles' positions after cleaning by hash maps, in order, and what was welded, dropped
    /// as degenerate, dropped as duplicate and folded.
    fn naive(positions: &[Vec3], triangles: &[[u32; 3]]) -> (Vec<[Vec3; 3]>, [usize; 4]) {
        let mut first = HashMap::new();
        let mut counts = [0; 4];
        let mut welded = Vec::new();
        for (v, &p) in positions.iter().enumerate() {
            let at = (p + Vec3::ZERO).to_array().map(f32::to_bits);
            welded.push(*first.entry(at).or_insert(v));
            counts[0] += usize::from(welded[v] != v);
        }
        // Of each three vertices the first face's direction, and whether another ran against it.
        let mut seen: HashMap<[usize; 3], (bool, bool)> = HashMap::new();
        let mut kept = Vec::new();
        for t in triangles {
            let [a, b, c] = t.map(|v| welded[v as usize]);
            let mut set = [a, b, c];
            set.sort_unstable();
            let is_even = [[a, b, c], [b, c, a], [c, a, b]].contains(&set);
            if a == b || b == c || c == a {
                counts[1] += 1;
            } else if let Some((first_is_even, folded)) = seen.get_mut(&set) {
                let folds = is_even != *first_is_even && !*folded;
                *folded |= folds;
                counts[if folds { 3 } else { 2 }] += 1;
            } else {
                seen.insert(set, (is_even, false));
                kept.push([a, b, c].map(|v| positions[v]));
            }
        }
        (kept, counts)
    }

    /// Vertices on a lattice of `side`³ points at random: the finer, the fewer twins.
    #[test]
    fn random_soups_are_cleaned_as_by_hash_maps() {
        for (side, seed) in [(2, 1), (5, 2), (20, 3), (60, 4), (1000, 5)] {
            let mut state: u64 = seed;
            let mut below = |n: u32| {
                state = state
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1);
                (state >> 33) as u32 % n
            };
            let positions: Vec<Vec3> = (0..20_000)
                .map(|_| [0; 3].map(|_| below(side) as f32 - 1.0).into())
                .map(|p: Vec3| p * Vec3::new(-1.0, 1.0, 0.1))
                .collect();
            // The second half anew as the first, every other one turned round.
            let mut triangles: Vec<[u32; 3]> =
                (0..15_000).map(|_| [0; 3].map(|_| below(20_000))).collect();
            for i in 0..15_000 {
                let [a, b, c] = triangles[i];
                triangles.push(if i % 2 == 0 { [b, c, a] } else { [a, c, b] });
            }
            let (kept, [welded, degenerate, duplicate, folded]) = naive(&positions, &triangles);
            let soup = IndexedMesh::new(positions, triangles).unwrap();
            let (cleaned, counts) = clean(soup, true).unwrap();
            let what = format!("side {side}, seed {seed}");
            assert_eq!(counts.welded_vertices, welded, "{what}");
            assert_eq!(counts.dropped_degenerate_faces, degenerate, "{what}");
            assert_eq!(counts.dropped_duplicate_faces, duplicate, "{what}");
            assert_eq!(counts.folded_faces, folded, "{what}");
            let faces = cleaned.triangles().iter();
            let corners = faces.map(|t| t.map(|v| cleaned.positions()[v as usize]));
            assert!(corners.eq(kept), "{what}");
        }
    }
}
