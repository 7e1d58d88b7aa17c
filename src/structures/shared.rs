//! Shared vertex, the indexed face set: positions once, triangles that name them.

use glam::Vec3;

use super::Vertex;
use super::description::{Access, Words};
use super::search::Corners;

/// Shared vertices (paper, section 1, Figure 2; chapter, section 2.1: *indexed face set*): 12n + 12m ≈
/// 18m bytes, 36 a vertex; to the paper "a lower limit for storing triangle meshes with immediate
/// and random access to each triangle".
#[derive(Clone, Debug)]
pub struct SharedVertex {
    positions: Vec<Vec3>,
    triangles: Vec<[Vertex; 3]>,
}

impl Corners for SharedVertex {
    type Key = Vertex;
    const NAME: &'static str = "shared vertex";
    const STATED: [u32; 2] = [18, 36];
    const WORDS: Words = Words {
        vertex: 3,
        edge: 0,
        face: 3,
    };
    const POINT_REFERENCE: Access = Access::Stored;

    fn of(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self {
        let corners = |t: &[u32; 3]| t.map(|v| Vertex::new(v as usize));
        Self {
            positions: positions.to_vec(),
            triangles: triangles.iter().map(corners).collect(),
        }
    }

    fn list_bytes(&self) -> usize {
        size_of_val(&self.positions[..]) + size_of_val(&self.triangles[..])
    }

    fn corner_count(&self) -> usize {
        3 * self.triangles.len()
    }

    #[inline(always)]
    fn corner_key(&self, corner: usize) -> Vertex {
        self.triangles.as_flattened()[corner]
    }

    fn corner_vertex(&self, corner: usize) -> Vertex {
        self.corner_key(corner)
    }

    fn vertex_key(&self, v: Vertex) -> Vertex {
        v
    }

    fn vertex_position(&self, v: Vertex) -> Vec3 {
        self.positions[v.index()]
    }
}
