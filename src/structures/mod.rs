//! The mesh structures that the paper and the chapter compare, side by side: what each stores, what
//! it answers, at what cost. For comparison and teaching; decimation does not use them.
//!
//! | structure | stored (4-byte words) | bytes per triangle | bytes per vertex | said by |
//! |---|---|---|---|---|
//! | [`IndividualTriangles`] | 9 a triangle | 36 | 72 | paper, section 1; chapter, 2.1 |
//! | [`SharedVertex`] | 3 a vertex, 3 a triangle | 18 | 36 | paper, section 1; chapter, 2.1 |
//! | [`SharedVertexWithNeighbours`] | 4 a vertex, 6 a triangle | 32 | 64 | paper, Table 1; chapter, 2.1 |
//! | [`WingedEdge`] | 4 a vertex, 8 an edge, 1 a triangle | 60 | 120 | paper, section 1; chapter, 2.2 |
//! | [`QuadEdge`] | 4 a vertex, 8 an edge, 1 a triangle | 60 | 120 | nobody: both name it only |
//! | [`HalfEdge`] | 4 a vertex, 10 an edge, 1 a triangle | 72 | 144 | chapter, 2.3 (a vertex) |
//! | [`PairedHalfEdge`] | 4 a vertex, 6 an edge, 1 a triangle | 48 | 96 | chapter, 2.3 (a vertex) |
//! | [`DirectedEdges<Full>`](DirectedEdges) | 4 a vertex, 15 a triangle | 68 | 136 | paper, section 3 (a triangle) |
//! | [`DirectedEdges<Medium>`](DirectedEdges) | 4 a vertex, 9 a triangle | 44 | 88 | paper, section 3 (a triangle) |
//! | [`DirectedEdges<Small>`](DirectedEdges) | 4 a vertex, 6 a triangle | 32 | 64 | paper, section 3; chapter, 2.4 |
//! | [`QuadDirectedEdges`] | 4 a vertex, 8 a quad | 48 (a quad) | 48 | nobody: "straightforward" (chapter, 2.4) |
//!
//! A large closed triangle mesh has twice as many triangles as vertices and three times as many
//! edges, a quad mesh as many quads as vertices ([`Words::limits`]).
//!
//! ```
//! use decimate::structures::{Structure, Vertex, WingedEdge};
//! use glam::Vec3;
//!
//! let corners = [[1., 1., 1.], [1., -1., -1.], [-1., 1., -1.], [-1., -1., 1.]].map(Vec3::from);
//! let tetrahedron = WingedEdge::build(&corners, &[[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])?;
//! let mut ring = Vec::new();
//! tetrahedron.one_ring(Vertex::new(0), |v| ring.push(v.index()));
//! ring.sort();
//! assert_eq!(ring, [1, 2, 3]);
//! // 16 bytes a vertex, 32 an edge, 4 a face.
//! assert_eq!(tetrahedron.bytes(), 16 * 4 + 32 * 6 + 4 * 4);
//! # Ok::<(), decimate::structures::CannotCarry>(())
//! ```
//!
//! Every structure with links across edges gets them from the one place that pairs edges,
//! [`Mesh::from_triangles`](crate::mesh::Mesh::from_triangles), so that building times differ by what
//! is made of the pairs.

mod cannot_carry;
mod description;
mod directed;
mod flip;
mod half_edge;
mod ids;
mod individual;
mod measure;
mod neighbours;
mod paired;
mod quad_edge;
mod quads;
mod search;
mod shared;
mod sides;
#[cfg(test)]
mod tests;
mod winged;

pub use cannot_carry::CannotCarry;
pub use description::{Access, Cost, Costs, Description, Query, Words};
pub use directed::{DirectedEdges, DirectedTier};
pub use flip::Flip;
pub use half_edge::HalfEdge;
pub use ids::{Edge, Face, Vertex};
pub use individual::IndividualTriangles;
pub use measure::{
    Measured, PerFace, QueryTime, QueryTimes, Row, measure, measure_polygons, measure_quads,
};
pub use neighbours::SharedVertexWithNeighbours;
pub use paired::PairedHalfEdge;
pub use quad_edge::QuadEdge;
pub use quads::QuadDirectedEdges;
pub use shared::SharedVertex;
pub use winged::WingedEdge;

use glam::Vec3;

/// A mesh whose faces have `CORNERS` corners each, in one structure.
///
/// Vertices, edges and faces go by the structure's own names, so that a question is asked as an
/// algorithm on that structure would ask it. Answers of different structures are comparable through
/// [`position`](Self::position) (positions differ between vertices), edges through
/// [`edge_vertices`](Self::edge_vertices), faces as they are. All that lies around a vertex is
/// visited once each, in an order of the structure's own.
pub trait Structure<const CORNERS: usize>: Sized {
    /// What the structure is, stores, and what its answers cost.
    const DESCRIPTION: Description;

    /// The mesh in this structure.
    ///
    /// # Errors
    /// [`CannotCarry`] names the first thing that it has no room for.
    ///
    /// # Panics
    /// Where a face names a vertex that is not there.
    fn build(positions: &[Vec3], faces: &[[u32; CORNERS]]) -> Result<Self, CannotCarry>;

    /// The bytes of all that it stores, positions among it.
    fn bytes(&self) -> usize;

    /// Where a vertex is.
    fn position(&self, v: Vertex) -> Vec3;

    /// The vertices of a face, counter-clockwise (FV). As given to [`build`](Self::build), until a
    /// flip turns them.
    fn face_vertices(&self, f: Face) -> [Vertex; CORNERS];

    /// The edges of a face (FE): each begins at the vertex of the same place in
    /// [`face_vertices`](Self::face_vertices).
    fn face_edges(&self, f: Face) -> [Edge; CORNERS];

    /// Both vertices of an edge (EV).
    fn edge_vertices(&self, e: Edge) -> [Vertex; 2];

    /// Visits the faces that share an edge (EF).
    fn edge_faces(&self, e: Edge, visit: impl FnMut(Face));

    /// Visits the faces that share a vertex (VF).
    fn vertex_faces(&self, v: Vertex, visit: impl FnMut(Face));

    /// Visits the edges that share a vertex (VE).
    fn vertex_edges(&self, v: Vertex, visit: impl FnMut(Edge));

    /// Visits the vertices next to a vertex.
    fn one_ring(&self, v: Vertex, visit: impl FnMut(Vertex));

    /// The boundary edge behind the boundary edge `e`, the hole on the left as in the chapter (section
    /// 2.3); nothing where the faces around the vertex in between end at a non-manifold edge.
    ///
    /// ```text
    ///      x ──> a ──e──> b       both run with their faces on the left; the hole is below, and along
    ///        ‾‾‾‾ ‾‾‾‾‾‾‾         it the way goes from b to a to x
    /// ```
    ///
    /// Takes and returns edges as [`face_edges`](Self::face_edges) names them.
    fn boundary_step(&self, e: Edge) -> Option<Edge>;

    /// Visits the edges of the boundary loop that the boundary edge `e` lies on, `e` first; of a run
    /// that ends at a non-manifold edge, those from `e` on.
    fn boundary_loop(&self, e: Edge, mut visit: impl FnMut(Edge)) {
        visit(e);
        let mut at = self.boundary_step(e);
        while let Some(next) = at.filter(|&next| next != e) {
            visit(next);
            at = self.boundary_step(next);
        }
    }
}
