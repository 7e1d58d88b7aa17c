//! The half-edge structure with every reference stored.

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
    prev: Edge,
    opposite: Edge,
}

/// Half-edges with all references (chapter, section 2.3): 16 bytes a vertex, 20 a half-edge, 4 a face
/// = 144 bytes a vertex; the paper states no number.
///
/// Boundaries have half-edges too, linked around their hole, so that no walk asks whether it ends.
#[derive(Clone, Debug)]
pub struct HalfEdge {
    vertices: Vec<Corner>,
    halves: Vec<Half>,
    /// One half-edge of each face.
    faces: Vec<Edge>,
}

impl HalfEdge {
    #[inline(always)]
    fn half(&self, e: Edge) -> &Half {
        &self.halves[e.index()]
    }

    #[inline(always)]
    fn half_mut(&mut self, e: Edge) -> &mut Half {
        &mut self.halves[e.index()]
    }

    /// Visits the half-edges that leave a vertex, clockwise, as the chapter's `enumerate_one_ring` does.
    #[inline]
    fn turn(&self, v: Vertex, mut visit: impl FnMut(Edge)) {
        let Some(first) = self.vertices[v.index()].edge else {
            return;
        };
        let mut at = first;
        loop {
            visit(at);
            at = self.half(self.half(at).opposite).next;
            if at == first {
                break;
            }
        }
    }

    /// Puts three half-edges around a face, the first as its own.
    fn close(&mut self, f: Option<Face>, ring: [Edge; 3]) {
        for k in 0..3 {
            let half = self.half_mut(ring[k]);
            half.face = f;
            half.next = ring[(k + 1) % 3];
            half.prev = ring[(k + 2) % 3];
        }
        if let Some(f) = f {
            self.faces[f.index()] = ring[0];
        }
    }
}

impl Structure<3> for HalfEdge {
    const DESCRIPTION: Description = Description {
        name: "half-edge, all references",
        stated_bytes_per_face: None,
        stated_bytes_per_vertex: Some(144),
        words: Words {
            vertex: 4,
            edge: 10,
            face: 1,
        },
        carries_non_manifold: false,
        neighbourhood: Access::Stored,
        point_reference: Access::Half,
        previous_edge: Access::Stored,
        next_edge: Access::Stored,
        costs: COSTS_OF_LINKED_BOUNDARIES,
    };

    fn build(positions: &[Vec3], faces: &[[u32; 3]]) -> Result<Self, CannotCarry> {
        let sides = Sides::of(positions.len(), faces)?;
        let halves = sides.sides.iter().enumerate().map(|(s, side)| Half {
            head: side.head,
            face: side.face,
            next: Edge::new(side.next),
            prev: Edge::new(side.prev),
            opposite: Edge::new(s ^ 1),
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
        let first = self.faces[f.index()];
        let Half { next, prev, .. } = *self.half(first);
        [first, next, prev]
    }

    fn edge_vertices(&self, e: Edge) -> [Vertex; 2] {
        let Half { head, opposite, .. } = *self.half(e);
        [self.half(opposite).head, head]
    }

    fn edge_faces(&self, e: Edge, visit: impl FnMut(Face)) {
        let Half { face, opposite, .. } = *self.half(e);
        let faces = [face, self.half(opposite).face];
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
        let along_hole = self.half(self.half(e).opposite).next;
        Some(self.half(along_hole).opposite)
    }
}

impl Flip for HalfEdge {
    fn flip(&mut self, e: Edge) {
        let o = self.half(e).opposite;
        let Half {
            next: bc, prev: ca, ..
        } = *self.half(e);
        let Half {
            next: ad, prev: db, ..
        } = *self.half(o);
        let [a, b] = self.edge_vertices(e);
        self.half_mut(e).head = self.half(bc).head;
        self.half_mut(o).head = self.half(ad).head;
        self.close(self.half(e).face, [e, ca, ad]);
        self.close(self.half(o).face, [o, db, bc]);
        for (v, gone, new) in [(a, e, ad), (b, o, bc)] {
            replace_edge(&mut self.vertices, v, gone, new);
        }
    }
}
