//! Makes a mesh manifold, the geometry untouched.

use serde::Serialize;

use crate::clean::{Cleaning, clean};
use crate::error::Result;
use crate::indexed_mesh::{IndexedMesh, Parts};
use crate::mesh::{Mesh, Oriented, Small, turn_round};
use crate::metrics::{Info, info, info_of_file};

/// What a cut found and did; counted as [`info`] counts.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct CutReport {
    /// Vertices in the file.
    pub vertices_in: usize,
    /// Triangles in the file.
    pub triangles_in: usize,
    /// What cleaning found.
    #[serde(flatten)]
    pub cleaning: Cleaning,
    /// Edges of three faces or more, before.
    pub non_manifold_edges_in: usize,
    /// Vertices on such an edge, or whose faces are not one fan, before.
    pub non_manifold_vertices_in: usize,
    /// Pieces that share no vertex, before.
    pub components_in: usize,
    /// Edges of one face, before.
    pub boundary_edges_in: usize,
    /// Vertices that were added: copies of others.
    pub vertices_copied: usize,
    /// Vertices after the cut.
    pub vertices_out: usize,
    /// Triangles after the cut.
    pub triangles_out: usize,
    /// Edges of three faces or more, after: none.
    pub non_manifold_edges_out: usize,
    /// Vertices on such an edge, or whose faces are not one fan, after: none.
    pub non_manifold_vertices_out: usize,
    /// Pieces that share no vertex, after.
    pub components_out: usize,
    /// Edges of one face, after.
    pub boundary_edges_out: usize,
}

/// Cuts a mesh along its non-manifold edges and at its non-manifold vertices until there are none,
/// with few copies of vertices: [`Mesh::cut`] says which, and in what sense no fewer are possible.
///
/// The mesh is [cleaned](clean) first; `weld` merges vertices at equal positions where
/// [`info_of_file`] does. After that all positions, the order and the direction of faces and the
/// vertices in front stay as they are; the copies stand behind them, with the weights of their
/// originals. Faces are turned only to find out which agree: what has no orientation, as a Möbius
/// strip, is not cut for that.
///
/// Linear time, but for logarithms in what is not manifold.
///
/// # Errors
/// As [`info`], and where copies make more vertices than can be numbered.
pub fn cut(mesh: IndexedMesh, weld: bool) -> Result<(IndexedMesh, CutReport)> {
    let before = if weld {
        info_of_file(mesh.clone())
    } else {
        info(mesh.clone(), false)
    }?;
    let (mesh, cleaning) = clean(mesh, before.cleaning.welded_vertices > 0)?;
    let (mesh, vertices_copied) = cut_clean(mesh)?;
    let after = info(mesh.clone(), false)?;
    Ok((mesh, report(before, cleaning, vertices_copied, after)))
}

/// [`cut`] of a mesh that has been cleaned, and the number of copies.
fn cut_clean(mesh: IndexedMesh) -> Result<(IndexedMesh, usize)> {
    let Parts {
        origin,
        mut positions,
        triangles,
        double_sided,
        mut weights,
        mut attributes,
    } = mesh.into_parts();
    let Oriented { mesh, flipped, .. } = Mesh::<Small>::oriented(positions.len(), triangles);
    let cut = mesh.cut();
    let mut triangles = mesh.triangles();
    for &(corner, copy) in &cut.corners {
        triangles[corner.face().index()][corner.index() % 3] = copy.index() as u32;
    }
    turn_round(&mut triangles, &flipped);
    for v in cut.copies.iter().map(|v| v.index()) {
        positions.push(positions[v]);
        if !weights.is_empty() {
            weights.push(weights[v]);
        }
    }
    attributes.split_shared_wedges(&triangles);
    let mesh = IndexedMesh::with_origin(origin, positions, triangles)?
        .with_double_sided(double_sided)?
        .with_weights(weights)?
        .with_attributes(attributes)?;
    Ok((mesh, cut.copies.len()))
}

fn report(before: Info, cleaning: Cleaning, vertices_copied: usize, after: Info) -> CutReport {
    CutReport {
        vertices_in: before.vertices,
        triangles_in: before.triangles,
        cleaning,
        non_manifold_edges_in: before.non_manifold_edges,
        non_manifold_vertices_in: before.non_manifold_vertices,
        components_in: before.components,
        boundary_edges_in: before.boundary_edges,
        vertices_copied,
        vertices_out: after.vertices,
        triangles_out: after.triangles,
        non_manifold_edges_out: after.non_manifold_edges,
        non_manifold_vertices_out: after.non_manifold_vertices,
        components_out: after.components,
        boundary_edges_out: after.boundary_edges,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{self, Shape};

    fn of((positions, triangles): Shape) -> (IndexedMesh, CutReport) {
        let mesh = IndexedMesh::new(positions, triangles).unwrap();
        cut(mesh, true).unwrap()
    }

    /// Two tetrahedra at a point become two; the faces keep their order, the copy its place.
    #[test]
    fn a_bow_tie_becomes_two_tetrahedra() {
        let (positions, triangles) = shapes::bow_tie();
        let (mesh, report) = of((positions.clone(), triangles.clone()));
        assert_eq!((report.vertices_copied, report.vertices_out), (1, 8));
        assert_eq!((report.components_in, report.components_out), (1, 2));
        assert_eq!(
            (
                report.non_manifold_vertices_in,
                report.non_manifold_vertices_out
            ),
            (1, 0)
        );
        assert_eq!(mesh.positions()[..7], positions);
        assert_eq!(mesh.positions()[7], positions[0]);
        let original = |v: u32| if v == 7 { 0 } else { v };
        let faces = mesh.triangles().iter().map(|t| t.map(original));
        assert!(faces.eq(triangles));
    }

    /// What was cut is none the more cut the second time, though its vertices could be welded.
    #[test]
    fn a_cut_mesh_is_not_cut_again() {
        for shape in [
            shapes::bow_tie(),
            shapes::three_fins(3),
            // Two triangles at a point: after the cut no two faces share a vertex.
            (
                [
                    [0., 0., 0.],
                    [1., 0., 0.],
                    [0., 1., 0.],
                    [-1., 0., 0.],
                    [0., -1., 0.],
                ]
                .map(glam::Vec3::from)
                .to_vec(),
                vec![[0, 1, 2], [0, 3, 4]],
            ),
        ] {
            let (once, first) = of(shape);
            let (twice, second) = cut(once.clone(), true).unwrap();
            assert!(first.vertices_copied > 0);
            assert_eq!(once, twice);
            assert_eq!(
                (second.vertices_copied, second.non_manifold_vertices_in),
                (0, 0)
            );
        }
    }

    /// A sphere with a face turned, and a Möbius strip: manifold, and as they were.
    #[test]
    fn orientation_alone_asks_for_no_cut() {
        let (positions, mut triangles) = shapes::icosphere(1);
        triangles[5].swap(0, 1);
        for (positions, triangles) in [(positions, triangles), shapes::moebius(12)] {
            let (mesh, report) = of((positions.clone(), triangles.clone()));
            assert_eq!(
                (mesh.positions(), mesh.triangles()),
                (&positions[..], &triangles[..])
            );
            assert_eq!(report.vertices_copied, 0);
        }
    }
}
