//! Individual triangles, the face set: three positions each, and nothing that says which are equal.

use glam::Vec3;

use super::Vertex;
use super::description::{Access, Words};
use super::search::Corners;

/// Individual triangles (paper, section 1, Figure 1; chapter, section 2.1: *face set*): 3·3·4 = 36
/// bytes a triangle, 72 a vertex.
///
/// Corners lie at one vertex where their positions are equal as numbers. Each vertex is stored as
/// often as it has faces, six times on average.
#[derive(Clone, Debug)]
pub struct IndividualTriangles(Vec<[Vec3; 3]>);

impl Corners for IndividualTriangles {
    type Key = [u32; 3];
    const NAME: &'static str = "individual triangles";
    const STATED: [u32; 2] = [36, 72];
    const WORDS: Words = Words {
        vertex: 0,
        edge: 0,
        face: 9,
    };
    const POINT_REFERENCE: Access = Access::Searched;

    fn of(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let corners = |t: &[u32; 3]| t.map(|v| positions[v as usize]);
        Self(triangles.iter().map(corners).collect())
    }

    fn list_bytes(&self) -> usize {
        size_of_val(&self.0[..])
    }

    fn corner_count(&self) -> usize {
        3 * self.0.len()
    }

    /// The position's bits, those of −0 as those of 0.
    #[inline(always)]
    fn corner_key(&self, corner: usize) -> [u32; 3] {
        let p = self.0.as_flattened()[corner] + Vec3::ZERO;
        p.to_array().map(f32::to_bits)
    }

    fn corner_vertex(&self, corner: usize) -> Vertex {
        Vertex::new(corner)
    }

    fn vertex_key(&self, v: Vertex) -> [u32; 3] {
        self.corner_key(v.index())
    }

    fn vertex_position(&self, v: Vertex) -> Vec3 {
        self.0.as_flattened()[v.index()]
    }
}
