//! Makes a simplicial complex of whatever a file held: welds, drops, folds, and counts.

use glam::Vec3;
use serde::Serialize;

use crate::error::Result;
use crate::indexed_mesh::{IndexedMesh, Parts};

/// What cleaning found and did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
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

/// The mesh as a simplicial complex: no repeated vertex in a face, no face twice, every vertex used
/// and finite; `weld` merges vertices at equal positions first.
///
/// Vertices and faces keep their order, the first of equals stays, with the largest of the welded
/// vertices' weights. Needs 12 bytes a vertex and 4 a
/// face beside the mesh. Expected linear time, but for a logarithm in the faces at a vertex.
///
/// # Errors
/// None today; the sizes of the result are checked like those of any mesh.
pub fn clean(mesh: IndexedMesh, weld: bool) -> Result<(IndexedMesh, Cleaning)> {
    let mut counts = Cleaning::default();
    let Parts {
        origin,
        mut positions,
        mut triangles,
        mut double_sided,
        mut weights,
    } = mesh.into_parts();
    if weld {
        counts.welded_vertices = weld_positions(&positions, &mut triangles, &mut weights);
    }

    let mut keep: Vec<bool> = Vec::with_capacity(triangles.len());
    for &t in &triangles {
        let is_finite = t.iter().all(|&v| positions[v as usize].is_finite());
        let is_proper = t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        counts.dropped_non_finite_faces += usize::from(!is_finite);
        counts.dropped_degenerate_faces += usize::from(is_finite && !is_proper);
        keep.push(is_finite && is_proper);
    }
    fold_duplicates(
        positions.len(),
        &triangles,
        &mut keep,
        &mut double_sided,
        &mut counts,
    );
    if keep.contains(&false) {
        retain(&keep, &mut triangles);
        retain(&keep, &mut double_sided);
    }

    let mut used = vec![false; positions.len()];
    triangles
        .iter()
        .flatten()
        .for_each(|&v| used[v as usize] = true);
    let kept = used.iter().filter(|&&u| u).count();
    if kept < positions.len() {
        counts.dropped_isolated_vertices = positions.len() - kept - counts.welded_vertices;
        let mut new = 0;
        let renamed: Vec<u32> = used
            .iter()
            .map(|&u| {
                new += u32::from(u);
                new.wrapping_sub(1)
            })
            .collect();
        triangles
            .iter_mut()
            .flatten()
            .for_each(|v| *v = renamed[*v as usize]);
        retain(&used, &mut positions);
        retain(&used, &mut weights);
    }
    counts.kept_vertices = positions.len();
    counts.kept_faces = triangles.len();
    let mesh = IndexedMesh::with_origin(origin, positions, triangles)?
        .with_double_sided(double_sided)?
        .with_weights(weights)?;
    Ok((mesh, counts))
}

/// Keeps the elements whose flag is set; an empty list stays empty.
fn retain<T>(keep: &[bool], values: &mut Vec<T>) {
    let mut keep = keep.iter();
    values.retain(|_| keep.next().is_some_and(|&k| k));
    values.shrink_to_fit();
}

/// Lets every triangle name the first vertex at each position, which takes the largest weight there,
/// and returns how many others there were. Positions that are not finite are left alone.
fn weld_positions(positions: &[Vec3], triangles: &mut [[u32; 3]], weights: &mut [f32]) -> usize {
    // Open addressing over vertex ids; slots hold id + 1, 0 is free.
    let capacity = (2 * positions.len()).next_power_of_two().max(2);
    let mut slots = vec![0u32; capacity];
    let mut first: Vec<u32> = Vec::with_capacity(positions.len());
    let mut welded = 0;
    for (v, p) in positions.iter().enumerate() {
        let v = v as u32;
        if !p.is_finite() {
            first.push(v);
            continue;
        }
        let mut slot = hash(p) as usize & (capacity - 1);
        let representative = loop {
            match slots[slot] {
                0 => {
                    slots[slot] = v + 1;
                    break v;
                }
                taken if positions[taken as usize - 1] == *p => break taken - 1,
                _ => slot = (slot + 1) & (capacity - 1),
            }
        };
        welded += usize::from(representative != v);
        first.push(representative);
    }
    if welded > 0 {
        triangles
            .iter_mut()
            .flatten()
            .for_each(|v| *v = first[*v as usize]);
        for v in 0..weights.len() {
            let at_first = first[v] as usize;
            weights[at_first] = weights[at_first].max(weights[v]);
        }
    }
    welded
}

/// A hash of a position as numbers: adding zero turns −0 into 0.
fn hash(p: &Vec3) -> u64 {
    let [x, y, z] = (*p + Vec3::ZERO).to_array().map(|c| u64::from(c.to_bits()));
    // Steele, Lea, Flood 2014 (SplitMix), the finaliser, over both halves.
    let mix = |mut h: u64| {
        h = (h ^ (h >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        h = (h ^ (h >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        h ^ (h >> 31)
    };
    mix(mix(x | y << 32).wrapping_add(z))
}

/// Finds faces with the same three vertices among those kept. The first stays; the first that runs
/// the other way is folded into it; the others are dropped.
fn fold_duplicates(
    vertices: usize,
    triangles: &[[u32; 3]],
    keep: &mut [bool],
    double_sided: &mut Vec<bool>,
    counts: &mut Cleaning,
) {
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
    let mut end_of_bucket = vec![0u32; vertices + 1];
    let kept = || (0..triangles.len() as u32).filter(|&i| keep[i as usize]);
    for i in kept() {
        end_of_bucket[turned(i)[0] as usize + 1] += 1;
    }
    for v in 0..vertices {
        end_of_bucket[v + 1] += end_of_bucket[v];
    }
    let mut bucketed = vec![0u32; end_of_bucket[vertices] as usize];
    for i in kept() {
        let slot = &mut end_of_bucket[turned(i)[0] as usize];
        bucketed[*slot as usize] = i;
        *slot += 1;
    }
    let mut bucket: Vec<([u32; 2], u32, bool)> = Vec::new();
    let mut begin = 0;
    for &end in &end_of_bucket[..vertices] {
        let end = end as usize;
        bucket.clear();
        bucket.extend(bucketed[begin..end].iter().map(|&i| {
            let [_, b, c] = turned(i);
            ([b.min(c), b.max(c)], i, b < c)
        }));
        begin = end;
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
                keep[i as usize] = false;
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
}

#[cfg(test)]
mod tests {
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
}
