//! Loop's subdivision (Loop 1987): four triangles of each, on a smoother surface.

use decimate::clean::clean;
use decimate::error::Result;
use decimate::indexed_mesh::IndexedMesh;
use glam::DVec3;

/// The mesh welded, cleaned and subdivided once.
///
/// Boundary and non-manifold edges are halved, and their curves smoothed as cubic splines.
///
/// # Errors
/// As [`clean`] and [`IndexedMesh::with_origin`].
pub fn subdivide(mesh: IndexedMesh) -> Result<IndexedMesh> {
    let (mesh, _) = clean(mesh, true)?;
    let triangles: Vec<[u32; 3]> = mesh.sides().collect();
    let at = |v: u32| mesh.positions()[v as usize].as_dvec3();
    let vertices = mesh.positions().len();
    let mut sums = vec![Sums::default(); vertices];
    let mut positions: Vec<_> = mesh.positions().to_vec();
    // The new vertex on the edge from corner k of a triangle to the next.
    let mut middles = vec![[0; 3]; triangles.len()];
    for edge in sides(&triangles).chunk_by(|a, b| a.ends == b.ends) {
        let [v, w] = edge[0].ends;
        let middle = (at(v) + at(w)) * 0.5;
        let across =
            |side: &Side| at(triangles[side.triangle as usize][(side.corner as usize + 2) % 3]);
        let (point, is_smooth) = match edge {
            [one, other] => (middle * 0.75 + (across(one) + across(other)) * 0.125, true),
            _ => (middle, false),
        };
        for side in edge {
            middles[side.triangle as usize][side.corner as usize] = positions.len() as u32;
        }
        positions.push(point.as_vec3());
        sums[v as usize].add(at(w), is_smooth);
        sums[w as usize].add(at(v), is_smooth);
    }
    for (v, sums) in sums.iter().enumerate() {
        positions[v] = sums.moved(at(v as u32)).as_vec3();
    }
    let triangles = triangles
        .iter()
        .zip(&middles)
        .flat_map(|(&[a, b, c], &[ab, bc, ca])| {
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        })
        .collect();
    IndexedMesh::with_origin(mesh.origin(), positions, triangles)
}

/// One triangle's side of an edge.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    /// The smaller first.
    ends: [u32; 2],
    triangle: u32,
    /// Where the side starts, 0 to 2.
    corner: u8,
}

/// All sides, those of an edge beside each other.
fn sides(triangles: &[[u32; 3]]) -> Vec<Side> {
    let mut sides: Vec<_> = (0..3 * triangles.len())
        .map(|i| {
            let (triangle, corner) = (i / 3, i % 3);
            let t = triangles[triangle];
            let (v, w) = (t[corner], t[(corner + 1) % 3]);
            Side {
                ends: [v.min(w), v.max(w)],
                triangle: triangle as u32,
                corner: corner as u8,
            }
        })
        .collect();
    sides.sort_unstable();
    sides
}

/// The neighbours of a vertex, added up.
#[derive(Clone, Default)]
struct Sums {
    all: DVec3,
    count: u32,
    /// Of these, those across an edge without exactly two triangles.
    sharp: DVec3,
    sharp_count: u32,
}

impl Sums {
    fn add(&mut self, neighbour: DVec3, is_smooth: bool) {
        self.all += neighbour;
        self.count += 1;
        if !is_smooth {
            self.sharp += neighbour;
            self.sharp_count += 1;
        }
    }

    /// Where the vertex goes; it stays where curves meet or end.
    fn moved(&self, p: DVec3) -> DVec3 {
        match self.sharp_count {
            0 => {
                // Warren's weights: Loop's own need a cosine.
                let n = f64::from(self.count);
                let beta = if self.count == 3 {
                    3.0 / 16.0
                } else {
                    3.0 / (8.0 * n)
                };
                p * (1.0 - n * beta) + self.all * beta
            }
            2 => p * 0.75 + self.sharp * 0.125,
            _ => p,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// A flat square of two triangles: its corners are cut as those of a cubic spline are, each to
    /// 3/4 of itself and 1/8 of both neighbours, and the new vertices halve the edges.
    #[test]
    fn a_square_is_rounded() {
        let corners = [[0.0, 0.0], [8.0, 0.0], [8.0, 8.0], [0.0, 8.0]];
        let positions = corners.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec();
        let square = IndexedMesh::new(positions, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let mesh = subdivide(square).unwrap();
        assert_eq!(mesh.triangle_count(), 8);
        assert_eq!(mesh.positions().len(), 9);
        assert_eq!(mesh.positions()[0], Vec3::new(1.0, 1.0, 0.0));
        assert!(mesh.positions().contains(&Vec3::new(4.0, 4.0, 0.0)));
        assert!(mesh.positions().contains(&Vec3::new(4.0, 0.0, 0.0)));
    }
}
