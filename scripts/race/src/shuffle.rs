//! The same mesh in a random order: what a file says of locality is lost.

use decimate::error::Result;
use decimate::indexed_mesh::IndexedMesh;

use crate::random::Random;

/// The mesh with its vertices, its triangles and the first corner of each in a random order.
///
/// # Errors
/// As [`IndexedMesh::with_origin`].
pub fn shuffle(mesh: &IndexedMesh, seed: u64) -> Result<IndexedMesh> {
    let mut random = Random::new(seed);
    let mut old_ids: Vec<u32> = (0..mesh.positions().len() as u32).collect();
    random.shuffle(&mut old_ids);
    let mut new_ids = vec![0; old_ids.len()];
    for (new, &old) in old_ids.iter().enumerate() {
        new_ids[old as usize] = new as u32;
    }
    let positions = old_ids
        .iter()
        .map(|&old| mesh.positions()[old as usize])
        .collect();
    let mut triangles: Vec<[u32; 3]> = mesh.sides().collect();
    random.shuffle(&mut triangles);
    for triangle in &mut triangles {
        *triangle = triangle.map(|v| new_ids[v as usize]);
        triangle.rotate_left(random.below(3));
    }
    IndexedMesh::with_origin(mesh.origin(), positions, triangles)
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    /// The same triangles, the same way round, at the same positions; only not in their places.
    #[test]
    fn a_shuffled_mesh_is_the_same_surface() {
        let positions: Vec<_> = (0..100).map(|i| Vec3::splat(i as f32)).collect();
        let triangles = (0..98).map(|i| [i, i + 1, i + 2]).collect();
        let mesh = IndexedMesh::new(positions, triangles).unwrap();
        let shuffled = shuffle(&mesh, 5).unwrap();
        assert_ne!(shuffled, mesh);
        assert_eq!(corners(&shuffled), corners(&mesh));
    }

    /// The corners' x of each triangle, from its least on; sorted.
    fn corners(mesh: &IndexedMesh) -> Vec<[u32; 3]> {
        let mut found: Vec<_> = mesh
            .triangles()
            .iter()
            .map(|t| {
                let mut t = t.map(|v| mesh.positions()[v as usize].x as u32);
                let least = (0..3).min_by_key(|&k| t[k]).unwrap();
                t.rotate_left(least);
                t
            })
            .collect();
        found.sort_unstable();
        found
    }
}
