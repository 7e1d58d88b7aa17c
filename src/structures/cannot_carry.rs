//! Why a structure has no room for a mesh, and where.

use smallvec::SmallVec;

use crate::mesh::{EdgeStore, FaceId, Mesh, Opposite, Small};

/// The first thing in a mesh that a structure cannot represent. Vertices are counted from 0.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CannotCarry {
    /// An edge of three faces or more.
    #[error("the edge between vertices {} and {} has {faces} faces, one or two fit", ends[0], ends[1])]
    CrowdedEdge {
        /// The edge.
        ends: [u32; 2],
        /// How many share it.
        faces: usize,
    },
    /// An edge whose two faces disagree about which side is outside.
    #[error("both faces of the edge between vertices {} and {} run along it the same way", ends[0], ends[1])]
    SameWayEdge {
        /// The edge.
        ends: [u32; 2],
    },
    /// A vertex at which several surfaces touch.
    #[error("the faces around vertex {vertex} are {fans} fans, one fits")]
    SeveralFans {
        /// The vertex.
        vertex: u32,
        /// How many.
        fans: usize,
    },
    /// A face that names a vertex twice.
    #[error("face {face} has a vertex twice")]
    RepeatedVertex {
        /// The face.
        face: usize,
    },
    /// More than four-byte references can tell apart.
    #[error("{edges} edges are more than four-byte references can name")]
    TooManyEdges {
        /// How many.
        edges: usize,
    },
}

/// Finds a face that names a vertex twice.
pub(super) fn check_faces<const CORNERS: usize>(
    faces: &[[u32; CORNERS]],
) -> Result<(), CannotCarry> {
    let repeats = |face: &[u32; CORNERS]| (1..CORNERS).any(|k| face[..k].contains(&face[k]));
    match faces.iter().position(repeats) {
        Some(face) => Err(CannotCarry::RepeatedVertex { face }),
        None => Ok(()),
    }
}

/// The directed edges of these triangles in a tier.
pub(super) fn paired_in<S: EdgeStore>(
    vertices: usize,
    faces: &[[u32; 3]],
) -> Result<Mesh<S>, CannotCarry> {
    check_faces(faces)?;
    Ok(Mesh::from_triangles(vertices, faces))
}

/// The directed edges of these triangles where they are an orientable manifold, oriented.
pub(super) fn paired_manifold(
    vertices: usize,
    faces: &[[u32; 3]],
) -> Result<Mesh<Small>, CannotCarry> {
    let mesh = paired_in(vertices, faces)?;
    check_edges(&mesh)?;
    check_vertices(&mesh)?;
    Ok(mesh)
}

fn check_edges(mesh: &Mesh<Small>) -> Result<(), CannotCarry> {
    if mesh.non_manifold_edge_count() == 0 {
        return Ok(());
    }
    let mut edges = mesh.faces().flat_map(FaceId::edges);
    let is_non_manifold = |&e: &_| matches!(mesh.opposite(e), Opposite::NonManifold(_));
    let Some(e) = edges.find(is_non_manifold) else {
        return Ok(());
    };
    let ends = mesh.edge_vertices(e).map(|v| v.index() as u32);
    Err(match mesh.edge_star(e).len() {
        2 => CannotCarry::SameWayEdge { ends },
        faces => CannotCarry::CrowdedEdge { ends, faces },
    })
}

fn check_vertices(mesh: &Mesh<Small>) -> Result<(), CannotCarry> {
    if mesh.multi_fan_vertex_count() == 0 {
        return Ok(());
    }
    for v in mesh.vertices() {
        let fans: SmallVec<[_; 4]> = mesh.fans(v).collect();
        if fans.len() > 1 {
            return Err(CannotCarry::SeveralFans {
                vertex: v.index() as u32,
                fans: fans.len(),
            });
        }
    }
    Ok(())
}
