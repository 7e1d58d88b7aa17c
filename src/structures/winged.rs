//! The winged-edge structure: an edge knows its ends, its faces, and the four edges beside it.

use glam::Vec3;

use super::description::{Access, COSTS_OF_LINKED_BOUNDARIES, Description, Words};
use super::sides::{Corner, Sides, replace_edge};
use super::{CannotCarry, Edge, Face, Flip, Structure, Vertex};

/// One side of an edge.
#[derive(Clone, Copy, Debug)]
struct Wing {
    /// None beside a hole.
    face: Option<Face>,
    /// The edges behind and before in the face, or along the hole.
    next: Edge,
    prev: Edge,
}

/// ```text
///      prev       next
///          \ left /          left runs from the first end to the second, right back
///     end 0 ──────> end 1
///          / right\
///      next       prev
/// ```
#[derive(Clone, Copy, Debug)]
struct Winged {
    ends: [Vertex; 2],
    /// Left and right.
    wings: [Wing; 2],
}

/// Winged edges (Baumgart 1972; paper, section 1, Figure 3: 16n + 4m + 32·3m/2 ≈ 60m bytes; chapter,
/// section 2.2: 16 bytes a vertex + 32 an edge + 4 a face = 120 bytes a vertex).
///
/// Edges have no direction, so each step asks which end, or which side, it comes from.
#[derive(Clone, Debug)]
pub struct WingedEdge {
    vertices: Vec<Corner>,
    edges: Vec<Winged>,
    /// One edge of each face.
    faces: Vec<Edge>,
}

impl WingedEdge {
    #[inline(always)]
    fn edge(&self, e: Edge) -> &Winged {
        &self.edges[e.index()]
    }

    /// The side of an edge that a face lies on: 0 left, 1 right.
    #[inline(always)]
    fn side_in(&self, e: Edge, f: Face) -> usize {
        usize::from(self.edge(e).wings[0].face != Some(f))
    }

    /// The side that runs away from a vertex.
    #[inline(always)]
    fn side_from(&self, e: Edge, v: Vertex) -> usize {
        usize::from(self.edge(e).ends[0] != v)
    }

    /// Visits the edges at a vertex, clockwise, with the side that runs away from it.
    #[inline]
    fn turn(&self, v: Vertex, mut visit: impl FnMut(Edge, usize)) {
        let Some(first) = self.vertices[v.index()].edge else {
            return;
        };
        let mut at = first;
        loop {
            let side = self.side_from(at, v);
            visit(at, side);
            at = self.edge(at).wings[1 - side].next;
            if at == first {
                break;
            }
        }
    }

    /// Puts three edges, by their sides, around a face, the first as its own.
    fn close(&mut self, face: Option<Face>, ring: [(Edge, usize); 3]) {
        for k in 0..3 {
            let (e, side) = ring[k];
            self.edges[e.index()].wings[side] = Wing {
                face,
                next: ring[(k + 1) % 3].0,
                prev: ring[(k + 2) % 3].0,
            };
        }
        if let Some(f) = face {
            self.faces[f.index()] = ring[0].0;
        }
    }
}

impl Structure<3> for WingedEdge {
    const DESCRIPTION: Description = Description {
        name: "winged-edge",
        stated_bytes_per_face: Some(60),
        stated_bytes_per_vertex: Some(120),
        words: Words {
            vertex: 4,
            edge: 8,
            face: 1,
        },
        carries_non_manifold: false,
        neighbourhood: Access::Stored,
        point_reference: Access::Stored,
        previous_edge: Access::Stored,
        next_edge: Access::Stored,
        costs: COSTS_OF_LINKED_BOUNDARIES,
    };

    fn build(positions: &[Vec3], faces: &[[u32; 3]]) -> Result<Self, CannotCarry> {
        let sides = Sides::of(positions.len(), faces)?;
        let name = |side: usize| Edge::new(side / 2);
        let (pairs, _) = sides.sides.as_chunks::<2>();
        let edges = pairs.iter().map(|[left, right]| Winged {
            ends: [right.head, left.head],
            wings: [left, right].map(|side| Wing {
                face: side.face,
                next: name(side.next),
                prev: name(side.prev),
            }),
        });
        Ok(Self {
            vertices: sides.corners(positions, name),
            faces: sides.firsts(name),
            edges: edges.collect(),
        })
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.vertices[..])
            + size_of_val(&self.edges[..])
            + size_of_val(&self.faces[..])
    }

    fn position(&self, v: Vertex) -> Vec3 {
        self.vertices[v.index()].position
    }

    fn face_vertices(&self, f: Face) -> [Vertex; 3] {
        let edges = self.face_edges(f);
        edges.map(|e| self.edge(e).ends[self.side_in(e, f)])
    }

    fn face_edges(&self, f: Face) -> [Edge; 3] {
        let first = self.faces[f.index()];
        let Wing { next, prev, .. } = self.edge(first).wings[self.side_in(first, f)];
        [first, next, prev]
    }

    fn edge_vertices(&self, e: Edge) -> [Vertex; 2] {
        self.edge(e).ends
    }

    fn edge_faces(&self, e: Edge, visit: impl FnMut(Face)) {
        let faces = self.edge(e).wings.map(|wing| wing.face);
        faces.into_iter().flatten().for_each(visit);
    }

    fn vertex_faces(&self, v: Vertex, mut visit: impl FnMut(Face)) {
        self.turn(v, |e, side| {
            if let Some(f) = self.edge(e).wings[side].face {
                visit(f);
            }
        });
    }

    fn vertex_edges(&self, v: Vertex, mut visit: impl FnMut(Edge)) {
        self.turn(v, |e, _| visit(e));
    }

    fn one_ring(&self, v: Vertex, mut visit: impl FnMut(Vertex)) {
        self.turn(v, |e, side| visit(self.edge(e).ends[1 - side]));
    }

    fn boundary_step(&self, e: Edge) -> Option<Edge> {
        let hole = self.edge(e).wings.iter().find(|wing| wing.face.is_none());
        hole.map(|wing| wing.next)
    }
}

impl Flip for WingedEdge {
    fn flip(&mut self, e: Edge) {
        let Winged {
            ends: [a, b],
            wings: [left, right],
        } = *self.edge(e);
        let from = |e: Edge, v: Vertex| (e, self.side_from(e, v));
        // Each side by the vertex that it leaves.
        let (bc, ca) = (from(left.next, b), left.prev);
        let (ad, db) = (from(right.next, a), right.prev);
        let c = self.edge(bc.0).ends[1 - bc.1];
        let d = self.edge(ad.0).ends[1 - ad.1];
        let (ca, db) = (from(ca, c), from(db, d));
        self.edges[e.index()].ends = [d, c];
        self.close(left.face, [(e, 0), ca, ad]);
        self.close(right.face, [(e, 1), db, bc]);
        for (v, new) in [(a, ad.0), (b, bc.0)] {
            replace_edge(&mut self.vertices, v, e, new);
        }
    }
}
