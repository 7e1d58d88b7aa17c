//! The quad-edge structure: an edge and its dual, four directed edges in one record.

use glam::Vec3;

use super::description::{Access, COSTS_OF_LINKED_BOUNDARIES, Description, Words};
use super::sides::{Corner, Sides, replace_edge};
use super::{CannotCarry, Edge, Face, Flip, Structure, Vertex};

/// ```text
///                 left
///                  ↑ rot³         directed edge 4i+r of record i is e turned r times by 90°:
///     origin 0 ────e───> origin 1     r even from vertex to vertex, r odd from face to face
///                  ↓ …
///                right            onext(e): the next edge counter-clockwise with e's origin
/// ```
#[derive(Clone, Copy, Debug)]
struct Record {
    onext: [Edge; 4],
    /// Where e and e turned twice begin.
    vertices: [Vertex; 2],
    /// Where e turned once and three times begin: on its right and its left. None for a hole.
    faces: [Option<Face>; 2],
}

/// Quad edges (Guibas & Stolfi 1985), with vertices and faces as the winged edge has them: 16 bytes a
/// vertex, 32 an edge, 4 a face. Paper and chapter name the structure and state no number; by their
/// count of edges it is 60 bytes a triangle, 120 a vertex.
///
/// The mesh and its dual are one structure: what walks around a vertex walks around a face, turned by
/// 90°.
#[derive(Clone, Debug)]
pub struct QuadEdge {
    vertices: Vec<Corner>,
    edges: Vec<Record>,
    /// One directed edge with each face on its left.
    faces: Vec<Edge>,
}

#[inline(always)]
fn turned(e: Edge, quarters: usize) -> Edge {
    let e = e.index();
    Edge::new((e & !3) | ((e + quarters) & 3))
}

/// The dual edge from right to left.
#[inline(always)]
fn rot(e: Edge) -> Edge {
    turned(e, 1)
}

/// The same edge the other way.
#[inline(always)]
fn sym(e: Edge) -> Edge {
    turned(e, 2)
}

/// The dual edge from left to right.
#[inline(always)]
fn inv_rot(e: Edge) -> Edge {
    turned(e, 3)
}

/// The directed edge that is a side of an edge.
fn name(side: usize) -> Edge {
    Edge::new(2 * side)
}

impl QuadEdge {
    #[inline(always)]
    fn onext(&self, e: Edge) -> Edge {
        self.edges[e.index() / 4].onext[e.index() % 4]
    }

    /// The next edge counter-clockwise with the same left face.
    #[inline(always)]
    fn lnext(&self, e: Edge) -> Edge {
        rot(self.onext(inv_rot(e)))
    }

    /// The next edge clockwise with the same origin.
    #[inline(always)]
    fn oprev(&self, e: Edge) -> Edge {
        rot(self.onext(rot(e)))
    }

    #[inline(always)]
    fn origin(&self, e: Edge) -> Vertex {
        self.edges[e.index() / 4].vertices[e.index() / 2 % 2]
    }

    #[inline(always)]
    fn left(&self, e: Edge) -> Option<Face> {
        self.edges[e.index() / 4].faces[1 - e.index() / 2 % 2]
    }

    /// Visits the directed edges that leave a vertex, counter-clockwise.
    #[inline]
    fn turn(&self, v: Vertex, mut visit: impl FnMut(Edge)) {
        let Some(first) = self.vertices[v.index()].edge else {
            return;
        };
        let mut at = first;
        loop {
            visit(at);
            at = self.onext(at);
            if at == first {
                break;
            }
        }
    }

    fn set_left(&mut self, e: Edge, f: Option<Face>) {
        self.edges[e.index() / 4].faces[1 - e.index() / 2 % 2] = f;
    }

    fn swap_onext(&mut self, a: Edge, b: Edge) {
        let (of_a, of_b) = (self.onext(a), self.onext(b));
        self.edges[a.index() / 4].onext[a.index() % 4] = of_b;
        self.edges[b.index() / 4].onext[b.index() % 4] = of_a;
    }

    /// Joins the rings around two origins where they are different, parts them where they are one;
    /// likewise those around the left faces (Guibas & Stolfi 1985, section 4.2).
    fn splice(&mut self, a: Edge, b: Edge) {
        let (alpha, beta) = (rot(self.onext(a)), rot(self.onext(b)));
        self.swap_onext(a, b);
        self.swap_onext(alpha, beta);
    }
}

impl Structure<3> for QuadEdge {
    const DESCRIPTION: Description = Description {
        name: "quad-edge",
        stated_bytes_per_face: None,
        stated_bytes_per_vertex: None,
        words: Words {
            vertex: 4,
            edge: 8,
            face: 1,
        },
        carries_non_manifold: false,
        neighbourhood: Access::Stored,
        point_reference: Access::Stored,
        previous_edge: Access::Computed,
        next_edge: Access::Computed,
        costs: COSTS_OF_LINKED_BOUNDARIES,
    };

    fn build(positions: &[Vec3], faces: &[[u32; 3]]) -> Result<Self, CannotCarry> {
        let sides = Sides::of(positions.len(), faces)?;
        let (pairs, _) = sides.sides.as_chunks::<2>();
        let edges = pairs.iter().map(|[left, right]| Record {
            // Counter-clockwise around the origin comes the opposite of the side before; around the
            // face the side behind.
            onext: [
                name(left.prev ^ 1),
                inv_rot(name(right.next)),
                name(right.prev ^ 1),
                inv_rot(name(left.next)),
            ],
            vertices: [right.head, left.head],
            faces: [right.face, left.face],
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
        self.face_edges(f).map(|e| self.origin(e))
    }

    fn face_edges(&self, f: Face) -> [Edge; 3] {
        let first = self.faces[f.index()];
        let second = self.lnext(first);
        [first, second, self.lnext(second)]
    }

    fn edge_vertices(&self, e: Edge) -> [Vertex; 2] {
        [self.origin(e), self.origin(sym(e))]
    }

    fn edge_faces(&self, e: Edge, visit: impl FnMut(Face)) {
        let faces = [self.left(e), self.left(sym(e))];
        faces.into_iter().flatten().for_each(visit);
    }

    fn vertex_faces(&self, v: Vertex, mut visit: impl FnMut(Face)) {
        self.turn(v, |e| {
            if let Some(f) = self.left(e) {
                visit(f);
            }
        });
    }

    fn vertex_edges(&self, v: Vertex, visit: impl FnMut(Edge)) {
        self.turn(v, visit);
    }

    fn one_ring(&self, v: Vertex, mut visit: impl FnMut(Vertex)) {
        self.turn(v, |e| visit(self.origin(sym(e))));
    }

    fn boundary_step(&self, e: Edge) -> Option<Edge> {
        Some(sym(self.lnext(sym(e))))
    }
}

impl Flip for QuadEdge {
    /// Guibas & Stolfi's *swap* (section 5): two splices take the edge out, two put it back in turned.
    fn flip(&mut self, e: Edge) {
        let (ad, bc) = (self.oprev(e), self.oprev(sym(e)));
        let [a, b] = self.edge_vertices(e);
        let (left, right) = (self.left(e), self.left(sym(e)));
        self.splice(e, ad);
        self.splice(sym(e), bc);
        self.splice(e, self.lnext(ad));
        self.splice(sym(e), self.lnext(bc));
        let ends = [self.origin(sym(ad)), self.origin(sym(bc))];
        for (e, v) in [(e, ends[0]), (sym(e), ends[1])] {
            self.edges[e.index() / 4].vertices[e.index() / 2 % 2] = v;
        }
        self.set_left(ad, left);
        self.set_left(bc, right);
        for (f, e) in [(left, e), (right, sym(e))] {
            if let Some(f) = f {
                self.faces[f.index()] = e;
            }
        }
        for (v, gone, new) in [(a, e, ad), (b, sym(e), bc)] {
            replace_edge(&mut self.vertices, v, gone, new);
        }
    }
}
