//! meshoptimizer's simplifier that moves vertices, and the arrays it works in.

use decimate::error::Result;
use decimate::indexed_mesh::IndexedMesh;
use glam::DVec3;
use meshopt::{SimplifyOptions, simplify_with_update};

/// A mesh in meshoptimizer's own types.
pub struct Arrays {
    /// Three a triangle.
    indices: Vec<u32>,
    /// Relative to `origin`.
    positions: Vec<[f32; 3]>,
    origin: DVec3,
}

impl From<&IndexedMesh> for Arrays {
    fn from(mesh: &IndexedMesh) -> Self {
        Self {
            indices: mesh.sides().flatten().collect(),
            positions: mesh.positions().iter().map(|p| p.to_array()).collect(),
            origin: mesh.origin(),
        }
    }
}

impl Arrays {
    /// Simplifies to `triangles`, in place, with no option and no limit of the error.
    ///
    /// Stops above that count where meshoptimizer finds nothing more to collapse.
    pub fn simplify_with_update(&mut self, triangles: usize) {
        let kept = simplify_with_update(
            &mut self.indices,
            &mut self.positions,
            &mut [],
            &[],
            0,
            None,
            3 * triangles,
            f32::MAX,
            SimplifyOptions::None,
            None,
        );
        self.indices.truncate(kept);
    }

    /// The number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.indices.len() / 3
    }

    /// The mesh of these arrays, without the vertices that no triangle uses.
    ///
    /// # Errors
    /// As [`IndexedMesh::with_origin`].
    pub fn into_mesh(self) -> Result<IndexedMesh> {
        let mut new_ids = vec![None; self.positions.len()];
        let mut positions = Vec::new();
        let corners: Vec<u32> = self
            .indices
            .iter()
            .map(|&v| {
                *new_ids[v as usize].get_or_insert_with(|| {
                    positions.push(self.positions[v as usize].into());
                    positions.len() as u32 - 1
                })
            })
            .collect();
        let triangles = corners.as_chunks().0.to_vec();
        IndexedMesh::with_origin(self.origin, positions, triangles)
    }
}
