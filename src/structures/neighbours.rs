//! Shared vertex with neighbours, the face-based connectivity: each triangle names the three beside it.

use glam::Vec3;

use super::cannot_carry::paired_manifold;
use super::description::{Access, COSTS_OF_LINKS, Description, Words};
use super::{CannotCarry, Edge, Face, Flip, Structure, Vertex};
use crate::mesh::{EdgeStore, FaceId, Mesh, Outgoing, VertexId};

#[derive(Clone, Copy, Debug)]
struct Corner {
    position: Vec3,
    /// One of its faces; of an open fan the first, counter-clockwise.
    face: Option<Face>,
}

#[derive(Clone, Copy, Debug)]
struct Triangle {
    vertices: [Vertex; 3],
    /// What lies across the edge that leaves the vertex of the same place.
    neighbours: [Option<Face>; 3],
}

/// Shared vertices with neighbours (paper, section 1: 12m + 2m bytes more than shared vertices, Table
/// 1: 32 bytes a triangle; chapter, section 2.1: 24 bytes a face + 16 a vertex = 64 bytes a vertex).
///
/// It has no edges: an edge is the corner that it leaves, and each step around a vertex asks which
/// of the three corners that vertex is.
#[derive(Clone, Debug)]
pub struct SharedVertexWithNeighbours {
    vertices: Vec<Corner>,
    triangles: Vec<Triangle>,
}

impl SharedVertexWithNeighbours {
    /// Which corner of a face a vertex is.
    #[inline(always)]
    fn corner(&self, f: Face, v: Vertex) -> usize {
        let [a, b, _] = self.triangles[f.index()].vertices;
        if a == v {
            0
        } else if b == v {
            1
        } else {
            2
        }
    }

    /// Visits the faces around a vertex, counter-clockwise, with the vertex's corner in each and
    /// whether the walk ends there at the boundary.
    #[inline]
    fn turn(&self, v: Vertex, mut visit: impl FnMut(Face, usize, bool)) {
        let first = self.vertices[v.index()].face;
        let mut at = first;
        while let Some(f) = at {
            let k = self.corner(f, v);
            let beside = self.triangles[f.index()].neighbours[(k + 2) % 3];
            visit(f, k, beside.is_none());
            at = beside.filter(|_| beside != first);
        }
    }
}

fn edge(f: Face, k: usize) -> Edge {
    Edge::new(3 * f.index() + k)
}

fn face_and_corner(e: Edge) -> (Face, usize) {
    (Face::new(e.index() / 3), e.index() % 3)
}

impl Structure<3> for SharedVertexWithNeighbours {
    const DESCRIPTION: Description = Description {
        name: "shared vertex with neighbours",
        stated_bytes_per_face: Some(32),
        stated_bytes_per_vertex: Some(64),
        words: Words {
            vertex: 4,
            edge: 0,
            face: 6,
        },
        carries_non_manifold: false,
        neighbourhood: Access::Stored,
        point_reference: Access::Stored,
        previous_edge: Access::ByOrder,
        next_edge: Access::ByOrder,
        costs: COSTS_OF_LINKS,
    };

    fn build(positions: &[Vec3], faces: &[[u32; 3]]) -> Result<Self, CannotCarry> {
        let mesh = paired_manifold(positions.len(), faces)?;
        let vertices = positions.iter().enumerate().map(|(v, &position)| Corner {
            position,
            face: first_face(&mesh, VertexId::new(v)),
        });
        let triangles = faces.iter().enumerate().map(|(f, t)| Triangle {
            vertices: t.map(|v| Vertex::new(v as usize)),
            neighbours: FaceId::new(f)
                .edges()
                .map(|e| mesh.mate(e).map(|o| Face::new(o.face().index()))),
        });
        Ok(Self {
            vertices: vertices.collect(),
            triangles: triangles.collect(),
        })
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.vertices[..]) + size_of_val(&self.triangles[..])
    }

    fn position(&self, v: Vertex) -> Vec3 {
        self.vertices[v.index()].position
    }

    fn face_vertices(&self, f: Face) -> [Vertex; 3] {
        self.triangles[f.index()].vertices
    }

    fn face_edges(&self, f: Face) -> [Edge; 3] {
        [0, 1, 2].map(|k| edge(f, k))
    }

    fn edge_vertices(&self, e: Edge) -> [Vertex; 2] {
        let (f, k) = face_and_corner(e);
        let vertices = self.face_vertices(f);
        [vertices[k], vertices[(k + 1) % 3]]
    }

    fn edge_faces(&self, e: Edge, mut visit: impl FnMut(Face)) {
        let (f, k) = face_and_corner(e);
        visit(f);
        self.triangles[f.index()].neighbours[k]
            .into_iter()
            .for_each(visit);
    }

    fn vertex_faces(&self, v: Vertex, mut visit: impl FnMut(Face)) {
        self.turn(v, |f, _, _| visit(f));
    }

    fn vertex_edges(&self, v: Vertex, mut visit: impl FnMut(Edge)) {
        self.turn(v, |f, k, is_last| {
            visit(edge(f, k));
            if is_last {
                visit(edge(f, (k + 2) % 3));
            }
        });
    }

    fn one_ring(&self, v: Vertex, mut visit: impl FnMut(Vertex)) {
        self.turn(v, |f, k, is_last| {
            let vertices = self.face_vertices(f);
            visit(vertices[(k + 1) % 3]);
            if is_last {
                visit(vertices[(k + 2) % 3]);
            }
        });
    }

    fn boundary_step(&self, e: Edge) -> Option<Edge> {
        let [tail, _] = self.edge_vertices(e);
        let mut last = None;
        self.turn(tail, |f, k, is_last| {
            if is_last {
                last = Some(edge(f, (k + 2) % 3));
            }
        });
        last
    }
}

fn first_face<S: EdgeStore>(mesh: &Mesh<S>, v: VertexId) -> Option<Face> {
    match mesh.outgoing(v) {
        Outgoing::Fan(e) => Some(Face::new(e.face().index())),
        Outgoing::Fans(_) | Outgoing::None => None,
    }
}

impl Flip for SharedVertexWithNeighbours {
    fn flip(&mut self, e: Edge) {
        let (left, k) = face_and_corner(e);
        let Some(right) = self.triangles[left.index()].neighbours[k] else {
            return;
        };
        let [a, b] = self.edge_vertices(e);
        // The edge in the right face leaves b.
        let j = self.corner(right, b);
        let Triangle {
            vertices: of_left,
            neighbours: beside_left,
        } = self.triangles[left.index()];
        let Triangle {
            vertices: of_right,
            neighbours: beside_right,
        } = self.triangles[right.index()];
        let (c, d) = (of_left[(k + 2) % 3], of_right[(j + 2) % 3]);
        let (bc, ca) = (beside_left[(k + 1) % 3], beside_left[(k + 2) % 3]);
        let (ad, db) = (beside_right[(j + 1) % 3], beside_right[(j + 2) % 3]);
        // Two of the faces beside get another neighbour, across the edge that leaves c or d in them.
        for (face, to, at) in [(bc, right, c), (ad, left, d)] {
            if let Some(face) = face {
                let side = self.corner(face, at);
                self.triangles[face.index()].neighbours[side] = Some(to);
            }
        }
        // Each edge keeps its corner's place where it can: e first, as before, in both.
        let turned = |k: usize, vertices: [Vertex; 3], neighbours: [Option<Face>; 3]| {
            let mut triangle = Triangle {
                vertices,
                neighbours,
            };
            triangle.vertices.rotate_right(k);
            triangle.neighbours.rotate_right(k);
            triangle
        };
        self.triangles[left.index()] = turned(k, [d, c, a], [Some(right), ca, ad]);
        self.triangles[right.index()] = turned(j, [c, d, b], [Some(left), db, bc]);
        // Of an open fan the first face: of c and d it stays what it was.
        for (v, to) in [(a, left), (b, right)] {
            let face = &mut self.vertices[v.index()].face;
            if *face == Some(left) || *face == Some(right) {
                *face = Some(to);
            }
        }
    }
}
