//! The half-edge structure with opposites side by side and previous half-edges left out.

use glam::Vec3;

use super::description::{Access, COSTS_OF_LINKED_BOUNDARIES, Description, Words};
use super::sides::{Corner, Sides, replace_edge};
use super::{CannotCarry, Edge, Face, Flip, Structure, Vertex};

#[derive(Clone, Copy, Debug)]
struct Half {
    head: Vertex,
    /// None along a hole.
    face: Option<Face>,
    next: Edge,
}

/// Half-edges 2i and 2i+1 are opposite (chapter, section 2.3): 16 bytes a vertex, 12 a half-edge, 4 a
/// face = 96 bytes a vertex; the paper states no number.
///
/// The previous half-edge of a triangle is the next but one. Along a hole it would be all around, so
/// nothing here asks for it.
#[derive(Clone, Debug)]
pub struct PairedHalfEdge {
    vertices: Vec<Corner>,
    halves: Vec<Half>,
    /// One half-edge of each face.
    faces: Vec<Edge>,
}

#[inline(always)]
fn opposite(e: Edge) -> Edge {
    Edge::new(e.index() ^ 1)
}

impl PairedHalfEdge {
    #[inline(always)]
    fn half(&self, e: Edge) -> &Half {
        &self.halves[e.index()]
    }

    /// Visits the half-edges that leave a vertex, clockwise.
    #[inline]
    fn turn(&self, v: Vertex, mut visit: impl FnMut(Edge)) {
        let Some(first) = self.vertices[v.index()].edge else {
            return;
        };
        let mut at = first;
        loop {
            visit(at);
            at = self.half(opposite(at)).next;
            if at == first {
                break;
            }
        }
    }

    /// The half-edge and the two behind it in its triangle.
    #[inline(always)]
    fn ring(&self, e: Edge) -> [Edge; 3] {
        let next = self.half(e).next;
        [e, next, self.half(next).next]
    }

    /// Puts three half-edges around a face, the first as its own.
    fn close(&mut self, f: Option<Face>, ring: [Edge; 3]) {
        for k in 0..3 {
            let half = &mut self.halves[ring[k].index()];
            half.face = f;
            half.next = ring[(k + 1) % 3];
        }
        if let Some(f) = f {
            self.faces[f.index()] = ring[0];
        }
    }
}

impl Structure<3> for PairedHalfEdge {
    const DESCRIPTION: Description = Description {
        name: "half-edge, paired opposites",
        stated_bytes_per_face: None,
        stated_bytes_per_vertex: Some(96),
        words: Words {
            vertex: 4,
            edge: 6,
            face: 1,
        },
        carries_non_manifold: false,
        neighbourhood: Access::Computed,
        point_reference: Access::Half,
        previous_edge: Access::Computed,
        next_edge: Access::Stored,
        costs: COSTS_OF_LINKED_BOUNDARIES,
    };

    fn build(positions: &[Vec3], faces: &[[u32; 3]]) -> Result<Self, CannotCarry> {
        let sides = Sides::of(positions.len(), faces)?;
        let halves = sides.sides.iter().map(|side| Half {
            head: side.head,
            face: side.face,
            next: Edge::new(side.next),
        });
        Ok(Self {
            vertices: sides.corners(positions, Edge::new),
            faces: sides.firsts(Edge::new),
            halves: halves.collect(),
        })
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.vertices[..])
            + size_of_val(&self.halves[..])
            + size_of_val(&self.faces[..])
    }

    fn position(&self, v: Vertex) -> Vec3 {
        self.vertices[v.index()].position
    }

    fn face_vertices(&self, f: Face) -> [Vertex; 3] {
        let [a, b, c] = self.face_edges(f).map(|e| self.half(e).head);
        [c, a, b]
    }

    fn face_edges(&self, f: Face) -> [Edge; 3] {
        self.ring(self.faces[f.index()])
    }

    fn edge_vertices(&self, e: Edge) -> [Vertex; 2] {
        [opposite(e), e].map(|e| self.half(e).head)
    }

    fn edge_faces(&self, e: Edge, visit: impl FnMut(Face)) {
        let faces = [e, opposite(e)].map(|e| self.half(e).face);
        faces.into_iter().flatten().for_each(visit);
    }

    fn vertex_faces(&self, v: Vertex, mut visit: impl FnMut(Face)) {
        self.turn(v, |e| {
            if let Some(f) = self.half(e).face {
                visit(f);
            }
        });
    }

    fn vertex_edges(&self, v: Vertex, visit: impl FnMut(Edge)) {
        self.turn(v, visit);
    }

    fn one_ring(&self, v: Vertex, mut visit: impl FnMut(Vertex)) {
        self.turn(v, |e| visit(self.half(e).head));
    }

    fn boundary_step(&self, e: Edge) -> Option<Edge> {
        Some(opposite(self.half(opposite(e)).next))
    }
}

impl Flip for PairedHalfEdge {
    fn flip(&mut self, e: Edge) {
        let o = opposite(e);
        let ([_, bc, ca], [_, ad, db]) = (self.ring(e), self.ring(o));
        let [a, b] = self.edge_vertices(e);
        self.halves[e.index()].head = self.half(bc).head;
        self.halves[o.index()].head = self.half(ad).head;
        self.close(self.half(e).face, [e, ca, ad]);
        self.close(self.half(o).face, [o, db, bc]);
        for (v, gone, new) in [(a, e, ad), (b, o, bc)] {
            replace_edge(&mut self.vertices, v, gone, new);
        }
    }
}
