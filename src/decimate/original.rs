//! The original surface, as samples to be near to and as triangles to be near.

use glam::{DVec3, Vec3};

use super::surface::Surface;
use crate::mesh::EdgeStore;
use crate::nearest::Triangles;

/// Faces larger than the mean by this factor squared are sampled in as many rows.
const ROWS: f64 = 16.0;

/// A small mesh is sampled as if it had this many faces.
const FEWEST: usize = 10_000;

/// Faces to sample the original in, for each face that is to be left.
const ON_A_FACE: usize = 2;

/// What a decimated mesh is fitted to: the original's faces and boundary edges, and samples on
/// both.
///
/// A sample stands for a piece of area or, behind those, of boundary length: its weight. A face
/// stands in its centroid with ¾ and in its corners with ¼ of its area, which is exact for squared
/// distances that vary as the square; a boundary edge in its middle and ends by Simpson's rule.
pub struct Original {
    pub(super) points: Vec<Vec3>,
    pub(super) weights: Vec<f32>,
    /// The direction that the surface faces at each sample, roughly; none on the boundary.
    normals: Vec<[i8; 3]>,
    /// Where the samples of the boundary begin.
    pub(super) boundary_begin: usize,
    pub(super) faces: Triangles,
    /// The boundary edges, as degenerate triangles.
    pub(super) boundary: Triangles,
    /// Squared distances up to this are rounding.
    pub(super) noise_squared: f64,
}

impl Original {
    /// Samples a surface, so that some fall on each of `target` faces: one and a half a face of about
    /// mean size, at least. Needs 150 bytes a triangle.
    pub fn new<S: EdgeStore>(surface: &Surface<S>, target: usize, with_boundary: bool) -> Self {
        let (mesh, positions) = (&surface.mesh, surface.geometry.positions());
        let scale = surface.geometry.scale();
        let corners: Vec<[DVec3; 3]> = mesh
            .faces()
            .map(|f| {
                mesh.face_vertices(f)
                    .map(|v| positions[v.index()].as_dvec3())
            })
            .collect();
        let area = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a).length() / 2.0;
        let total: f64 = corners.iter().map(area).sum();
        let faces = corners.len().max(FEWEST).max(ON_A_FACE * target);
        let typical = total / faces as f64;
        let mut points = positions.to_vec();
        let mut weights = vec![0.0f32; points.len()];
        let mut normals = vec![DVec3::ZERO; points.len()];
        let mut face_normals = Vec::with_capacity(corners.len());
        for (f, triangle) in mesh.faces().zip(&corners) {
            let area = area(triangle);
            let rows = (area / typical).sqrt().round().clamp(1.0, ROWS);
            let area = area * scale * scale;
            let at_corner = area / (12.0 * rows);
            let [a, b, c] = triangle.map(|p| p * scale);
            let normal = (b - a).cross(c - a);
            for v in mesh.face_vertices(f) {
                weights[v.index()] += at_corner as f32;
                normals[v.index()] += normal;
            }
            let weight = (area - 3.0 * at_corner) / (rows * rows);
            for point in centroids(triangle, rows as usize) {
                points.push(point.as_vec3());
                weights.push(weight as f32);
                face_normals.push(pack(normal));
            }
        }
        let boundary_begin = points.len();
        let mut normals: Vec<[i8; 3]> = normals.into_iter().map(pack).collect();
        normals.extend(face_normals);
        let mut edges = Vec::new();
        if with_boundary {
            for e in mesh.edges().filter(|&e| mesh.is_boundary(e)) {
                let [a, b] = mesh
                    .edge_vertices(e)
                    .map(|v| positions[v.index()].as_dvec3());
                let length = a.distance(b);
                for (point, share) in [(a, 1.0 / 6.0), ((a + b) / 2.0, 2.0 / 3.0), (b, 1.0 / 6.0)] {
                    points.push(point.as_vec3());
                    weights.push((length * scale * share) as f32);
                }
                edges.push([a, b, b]);
            }
        }
        points.shrink_to_fit();
        weights.shrink_to_fit();
        normals.shrink_to_fit();
        let largest = positions
            .iter()
            .fold(0.0f32, |m, p| m.max(p.abs().max_element()));
        let noise = f64::from(largest) * f64::from(f32::EPSILON);
        Self {
            points,
            weights,
            normals,
            boundary_begin,
            faces: Triangles::new(corners),
            boundary: Triangles::new(edges),
            noise_squared: noise * noise,
        }
    }

    /// Whether the surface faces the same way at a sample as a triangle does: the other side of a
    /// thin sheet is near, but nothing to be fitted to.
    pub(super) fn faces_as(&self, sample: usize, &[a, b, c]: &[DVec3; 3]) -> bool {
        let [x, y, z] = self.normals[sample].map(f64::from);
        (b - a).cross(c - a).dot(DVec3::new(x, y, z)) >= 0.0
    }

    /// The bytes held.
    pub fn bytes(&self) -> usize {
        self.points.capacity() * size_of::<Vec3>()
            + self.weights.capacity() * size_of::<f32>()
            + self.normals.capacity() * size_of::<[i8; 3]>()
            + self.faces.bytes()
            + self.boundary.bytes()
    }
}

/// A direction to a hundredth.
fn pack(normal: DVec3) -> [i8; 3] {
    (normal.normalize_or_zero() * 127.0)
        .to_array()
        .map(|x| x as i8)
}

/// The centroids of the triangles that so many rows cut one into.
pub(super) fn centroids(&[a, b, c]: &[DVec3; 3], rows: usize) -> impl Iterator<Item = DVec3> {
    let n = 3.0 * rows as f64;
    let at = move |i: usize, j: usize, third: f64| {
        let (u, v) = ((3 * i) as f64 + third, (3 * j) as f64 + third);
        a + (b - a) * (u / n) + (c - a) * (v / n)
    };
    (0..rows).flat_map(move |i| {
        (0..rows - i).flat_map(move |j| {
            let upper = (i + j + 1 < rows).then(|| at(i, j, 2.0));
            std::iter::once(at(i, j, 1.0)).chain(upper)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four triangles: three corners' and the middle one, whose centroid is the whole's.
    #[test]
    fn rows_cut_a_triangle_into_their_square() {
        let triangle = [DVec3::ZERO, DVec3::X, DVec3::Y];
        for rows in 1..6 {
            let points: Vec<DVec3> = centroids(&triangle, rows).collect();
            assert_eq!(points.len(), rows * rows);
            let mean = points.iter().sum::<DVec3>() / points.len() as f64;
            assert!((mean - DVec3::new(1.0, 1.0, 0.0) / 3.0).length() < 1e-12);
        }
        let two: Vec<DVec3> = centroids(&triangle, 2).collect();
        assert!((two[1] - DVec3::new(1.0, 1.0, 0.0) / 3.0).length() < 1e-12);
    }
}
