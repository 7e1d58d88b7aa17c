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
