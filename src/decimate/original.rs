//! The original surface, as samples to be near to and as triangles to be near.

use glam::{DVec3, Vec3};

use crate::mesh::{EdgeStore, Mesh};
use crate::nearest::Triangles;

/// Faces larger than the mean by this factor squared are sampled in as many rows.
const ROWS: f64 = 16.0;

/// A small mesh is sampled as if it had this many faces.
const FEWEST: usize = 10_000;

/// What a decimated mesh is fitted to: the original's faces and boundary edges, and samples on
/// both.
///
/// A sample stands for a piece of area or, behind those, of boundary length: its weight. A face
/// stands in its centroid with ¾ and in its corners with ¼ of its area, which is exact for squared
/// distances that vary as the square; a boundary edge in its middle and ends by Simpson's rule.
pub struct Original {
    pub(super) points: Vec<Vec3>,
    pub(super) weights: Vec<f32>,
    /// Where the samples of the boundary begin.
    pub(super) boundary_begin: usize,
    pub(super) faces: Triangles,
    /// The boundary edges, as degenerate triangles.
    pub(super) boundary: Triangles,
    /// Squared distances up to this are rounding.
    pub(super) noise_squared: f64,
}

impl Original {
    /// Samples a mesh: one and a half a face of about mean size. Needs 165 bytes a triangle.
    pub fn new<S: EdgeStore>(mesh: &Mesh<S>, positions: &[Vec3], with_boundary: bool) -> Self {
        let corners: Vec<[DVec3; 3]> = mesh
            .faces()
            .map(|f| {
                mesh.face_vertices(f)
                    .map(|v| positions[v.index()].as_dvec3())
            })
            .collect();
        let area = |[a, b, c]: &[DVec3; 3]| (*b - *a).cross(*c - *a).length() / 2.0;
        let total: f64 = corners.iter().map(area).sum();
        let typical = total / corners.len().max(FEWEST) as f64;
        let mut points = positions.to_vec();
        let mut weights = vec![0.0f32; points.len()];
        for (f, triangle) in mesh.faces().zip(&corners) {
            let area = area(triangle);
            let rows = (area / typical).sqrt().round().clamp(1.0, ROWS);
            let at_corner = area / (12.0 * rows);
            for v in mesh.face_vertices(f) {
                weights[v.index()] += at_corner as f32;
            }
            let weight = (area - 3.0 * at_corner) / (rows * rows);
            for point in centroids(triangle, rows as usize) {
                points.push(point.as_vec3());
                weights.push(weight as f32);
            }
        }
        let boundary_begin = points.len();
        let mut edges = Vec::new();
        if with_boundary {
            for e in mesh.edges().filter(|&e| mesh.is_boundary(e)) {
                let [a, b] = mesh
                    .edge_vertices(e)
                    .map(|v| positions[v.index()].as_dvec3());
                let length = a.distance(b);
                for (point, share) in [(a, 1.0 / 6.0), ((a + b) / 2.0, 2.0 / 3.0), (b, 1.0 / 6.0)] {
                    points.push(point.as_vec3());
                    weights.push((length * share) as f32);
                }
                edges.push([a, b, b]);
            }
        }
        let largest = positions
            .iter()
            .fold(0.0f32, |m, p| m.max(p.abs().max_element()));
        let noise = f64::from(largest) * f64::from(f32::EPSILON);
        Self {
            points,
            weights,
            boundary_begin,
            faces: Triangles::new(corners),
            boundary: Triangles::new(edges),
            noise_squared: noise * noise,
        }
    }

    /// The bytes held.
    pub fn bytes(&self) -> usize {
        self.points.capacity() * size_of::<Vec3>()
            + self.weights.capacity() * size_of::<f32>()
            + self.faces.bytes()
            + self.boundary.bytes()
    }
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
