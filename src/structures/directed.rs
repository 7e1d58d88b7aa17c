//! The directed-edge structure in its three tiers: the decimator's own mesh, with positions.

use glam::Vec3;

use super::cannot_carry::paired_in;
use super::description::{Access, COSTS_OF_LINKS, Description, Words};
use super::{CannotCarry, Edge, Face, Flip, Structure, Vertex};
use crate::mesh::{EdgeId, EdgeStore, FaceId, Full, Medium, Mesh, Small, VertexId};

/// Directed edges (paper, section 3; chapter, section 2.4): 16n + 60m, 36m or 24m bytes, which is 68,
/// 44 or 32 a triangle; the chapter describes the smallest, 64 a vertex. What is not manifold costs a
/// row of a side table.
#[derive(Clone, Debug)]
pub struct DirectedEdges<S> {
    positions: Vec<Vec3>,
    mesh: Mesh<S>,
}

/// A tier, and what Table 1 of the paper says of it.
pub trait DirectedTier: EdgeStore {
    /// What the structure is in this tier.
    const DESCRIPTION: Description;
}

/// What the tiers have in common, with the full tier's entries.
const FULL: Description = Description {
    name: "full directed-edge",
    stated_bytes_per_face: Some(68),
    stated_bytes_per_vertex: None,
    words: words(Full::TIER.words_per_edge()),
    carries_non_manifold: true,
    neighbourhood: Access::Stored,
    point_reference: Access::Stored,
    previous_edge: Access::Stored,
    next_edge: Access::Stored,
    costs: COSTS_OF_LINKS,
};

/// Three directed edges a face.
const fn words(per_edge: usize) -> Words {
    Words {
        vertex: 4,
        edge: 0,
        face: 3 * per_edge,
    }
}

impl DirectedTier for Full {
    const DESCRIPTION: Description = FULL;
}

impl DirectedTier for Medium {
    const DESCRIPTION: Description = Description {
        name: "medium directed-edge",
        stated_bytes_per_face: Some(44),
        words: words(Medium::TIER.words_per_edge()),
        point_reference: Access::Half,
        next_edge: Access::Computed,
        ..FULL
    };
}

impl DirectedTier for Small {
    const DESCRIPTION: Description = Description {
        name: "small directed-edge",
        stated_bytes_per_face: Some(32),
        stated_bytes_per_vertex: Some(64),
        words: words(Small::TIER.words_per_edge()),
        point_reference: Access::Half,
        previous_edge: Access::Computed,
        next_edge: Access::Computed,
        ..FULL
    };
}

#[inline(always)]
fn edge(e: EdgeId) -> Edge {
    Edge::new(e.index())
}

#[inline(always)]
fn edge_id(e: Edge) -> EdgeId {
    EdgeId::new(e.index())
}

#[inline(always)]
fn vertex(v: VertexId) -> Vertex {
    Vertex::new(v.index())
}

#[inline(always)]
fn vertex_id(v: Vertex) -> VertexId {
    VertexId::new(v.index())
}

#[inline(always)]
fn face(f: FaceId) -> Face {
    Face::new(f.index())
}

impl<S: DirectedTier> Structure<3> for DirectedEdges<S> {
    const DESCRIPTION: Description = S::DESCRIPTION;

    fn build(positions: &[Vec3], faces: &[[u32; 3]]) -> Result<Self, CannotCarry> {
        Ok(Self {
            mesh: paired_in(positions.len(), faces)?,
            positions: positions.to_vec(),
        })
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.positions[..]) + self.mesh.bytes()
    }

    fn position(&self, v: Vertex) -> Vec3 {
        self.positions[v.index()]
    }

    fn face_vertices(&self, f: Face) -> [Vertex; 3] {
        self.mesh.face_vertices(FaceId::new(f.index())).map(vertex)
    }

    fn face_edges(&self, f: Face) -> [Edge; 3] {
        FaceId::new(f.index()).edges().map(edge)
    }

    fn edge_vertices(&self, e: Edge) -> [Vertex; 2] {
        self.mesh.edge_vertices(edge_id(e)).map(vertex)
    }

    fn edge_faces(&self, e: Edge, mut visit: impl FnMut(Face)) {
        for e in self.mesh.edge_star(edge_id(e)) {
            visit(face(e.face()));
        }
    }

    fn vertex_faces(&self, v: Vertex, visit: impl FnMut(Face)) {
        self.mesh
            .vertex_faces(vertex_id(v))
            .map(face)
            .for_each(visit);
    }

    fn vertex_edges(&self, v: Vertex, visit: impl FnMut(Edge)) {
        let edges = self.mesh.vertex_edges(vertex_id(v));
        edges.into_iter().map(edge).for_each(visit);
    }

    fn one_ring(&self, v: Vertex, visit: impl FnMut(Vertex)) {
        let v = vertex_id(v);
        if self.mesh.is_non_manifold_vertex(v) {
            // Neighbours across non-manifold edges are met once for each fan that ends there.
            self.mesh
                .one_ring(v)
                .into_iter()
                .map(vertex)
                .for_each(visit);
        } else {
            self.mesh.neighbours(v).map(vertex).for_each(visit);
        }
    }

    fn boundary_step(&self, e: Edge) -> Option<Edge> {
        let e = edge_id(e);
        let last = self.mesh.fan(e).last()?;
        let before = self.mesh.prev(last);
        self.mesh.is_boundary(before).then(|| edge(before))
    }
}

impl<S: DirectedTier> Flip for DirectedEdges<S> {
    fn flip(&mut self, e: Edge) {
        self.mesh.flip(edge_id(e));
    }

    /// Of two faces that run along the edge the same way it is not fulfilled.
    fn flip_condition(&self, e: Edge) -> bool {
        self.mesh.flip_condition(edge_id(e))
    }
}
