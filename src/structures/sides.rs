//! Edges with two sides each, the boundary's outer sides among them: what winged edges, quad edges and
//! half-edges are made of.

use glam::Vec3;

use super::cannot_carry::paired_manifold;
use super::{CannotCarry, Edge, Face, Vertex};
use crate::mesh::{EdgeId, FaceId, Outgoing, VertexId};

/// One side of an edge. Side 2i and side 2i+1 are those of edge i.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    /// The vertex that it runs to.
    pub head: Vertex,
    /// The face on its left, if it is not a hole.
    pub face: Option<Face>,
    /// The side behind it in its face, or along its hole.
    pub next: usize,
    /// The side before it.
    pub prev: usize,
}

/// A vertex of all structures that have edges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    pub position: Vec3,
    /// One of its edges.
    pub edge: Option<Edge>,
}

/// Where a vertex has `gone` as its edge, gives it `new`.
pub(super) fn replace_edge(corners: &mut [Corner], v: Vertex, gone: Edge, new: Edge) {
    let edge = &mut corners[v.index()].edge;
    if *edge == Some(gone) {
        *edge = Some(new);
    }
}

/// The sides of an oriented manifold's edges.
#[derive(Debug)]
pub(super) struct Sides {
    /// Both of each edge.
    pub sides: Vec<Side>,
    /// The sides of each face's edges, in the order of its corners.
    pub of_faces: Vec<[u32; 3]>,
    /// A side that leaves each vertex, of a boundary vertex the first of its fan; nothing where it
    /// has no face.
    pub of_vertices: Vec<Option<u32>>,
}

/// What the largest name of a side is multiplied by to name the quad edge's directed edges.
const NAMES_A_SIDE: usize = 2;

impl Sides {
    /// The sides of these triangles' edges. Linear time.
    pub fn of(vertices: usize, faces: &[[u32; 3]]) -> Result<Self, CannotCarry> {
        let mesh = paired_manifold(vertices, faces)?;
        let mut of_faces = vec![[0; 3]; faces.len()];
        let numbers = of_faces.as_flattened_mut();
        let mut edges = 0usize;
        for e in mesh.edges() {
            numbers[e.index()] = (2 * edges) as u32;
            if let Some(o) = mesh.mate(e) {
                numbers[o.index()] = (2 * edges + 1) as u32;
            }
            edges += 1;
        }
        if 2 * NAMES_A_SIDE * edges >= u32::MAX as usize {
            return Err(CannotCarry::TooManyEdges { edges });
        }
        let number = |e: EdgeId| numbers[e.index()] as usize;
        let vertex = |v: VertexId| Vertex::new(v.index());
        let nowhere = Side {
            head: Vertex::new(0),
            face: None,
            next: 0,
            prev: 0,
        };
        let mut sides = vec![nowhere; 2 * edges];
        for e in mesh.faces().flat_map(FaceId::edges) {
            sides[number(e)] = Side {
                head: vertex(mesh.head(e)),
                face: Some(Face::new(e.face().index())),
                next: number(mesh.next(e)),
                prev: number(mesh.prev(e)),
            };
            if mesh.is_boundary(e) {
                sides[number(e) ^ 1].head = vertex(mesh.tail(e));
                // Along the hole the way goes back: from the edge behind to this one.
                if let Some(behind) = mesh.next_on_boundary(e) {
                    sides[number(behind) ^ 1].next = number(e) ^ 1;
                    sides[number(e) ^ 1].prev = number(behind) ^ 1;
                }
            }
        }
        let outgoing = |v| match mesh.outgoing(VertexId::new(v)) {
            Outgoing::Fan(e) => Some(numbers[e.index()]),
            Outgoing::Fans(_) | Outgoing::None => None,
        };
        let of_vertices = (0..vertices).map(outgoing).collect();
        Ok(Self {
            sides,
            of_faces,
            of_vertices,
        })
    }

    /// The vertices, each with the edge that `name` makes of a side that leaves it.
    pub fn corners(&self, positions: &[Vec3], name: impl Fn(usize) -> Edge) -> Vec<Corner> {
        let corner = |(&position, side): (&Vec3, &Option<u32>)| Corner {
            position,
            edge: side.map(|s| name(s as usize)),
        };
        positions
            .iter()
            .zip(&self.of_vertices)
            .map(corner)
            .collect()
    }

    /// The first edge of each face, as `name` makes it of a side.
    pub fn firsts(&self, name: impl Fn(usize) -> Edge) -> Vec<Edge> {
        let first = |sides: &[u32; 3]| name(sides[0] as usize);
        self.of_faces.iter().map(first).collect()
    }
}
