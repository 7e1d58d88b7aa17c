//! Answers of a structure that stores no neighbours: a look at every corner.

use glam::Vec3;
use smallvec::SmallVec;

use super::description::{Access, COSTS_OF_LISTS, Description, Words};
use super::{CannotCarry, Edge, Face, Structure, Vertex};

/// A list of triangles by their corners; corner 3i+k is the edge that leaves it, too.
pub trait Corners: Sized {
    /// What two corners at one vertex have in common.
    type Key: Copy + Ord;
    /// The structure's name.
    const NAME: &'static str;
    /// The paper's bytes a triangle and the chapter's bytes a vertex.
    const STATED: [u32; 2];
    /// What it stores.
    const WORDS: Words;
    /// Whether a vertex is stored once.
    const POINT_REFERENCE: Access;

    /// The list of these triangles.
    fn of(positions: &[Vec3], triangles: &[[u32; 3]]) -> Self;

    /// The bytes of the list.
    fn list_bytes(&self) -> usize;

    /// The number of corners.
    fn corner_count(&self) -> usize;

    /// The key of the vertex at a corner.
    fn corner_key(&self, corner: usize) -> Self::Key;

    /// The vertex at a corner.
    fn corner_vertex(&self, corner: usize) -> Vertex;

    /// The key of a vertex.
    fn vertex_key(&self, v: Vertex) -> Self::Key;

    /// Where a vertex is.
    fn vertex_position(&self, v: Vertex) -> Vec3;
}

/// The corner behind another in its triangle.
#[inline(always)]
fn next(corner: usize) -> usize {
    if corner % 3 == 2 {
        corner - 2
    } else {
        corner + 1
    }
}

/// The corner before another in its triangle.
#[inline(always)]
fn prev(corner: usize) -> usize {
    if corner.is_multiple_of(3) {
        corner + 2
    } else {
        corner - 1
    }
}

/// An edge at a vertex, in one of its faces.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Spoke<K> {
    /// The vertex at its other end,
    key: K,
    /// and a corner there.
    rim: usize,
    /// The edge.
    edge: usize,
}

/// The corners at a vertex.
fn corners_at<T: Corners>(list: &T, key: T::Key) -> impl Iterator<Item = usize> {
    (0..list.corner_count()).filter(move |&c| list.corner_key(c) == key)
}

/// The edges at a vertex, those of one other end side by side.
fn spokes<T: Corners>(list: &T, key: T::Key) -> SmallVec<[Spoke<T::Key>; 16]> {
    let spoke = |rim, edge| Spoke {
        key: list.corner_key(rim),
        rim,
        edge,
    };
    let both = |c| [spoke(next(c), c), spoke(prev(c), prev(c))];
    let mut spokes: SmallVec<_> = corners_at(list, key).flat_map(both).collect();
    spokes.sort_unstable();
    spokes
}

impl<T: Corners> Structure<3> for T {
    const DESCRIPTION: Description = Description {
        name: T::NAME,
        stated_bytes_per_face: Some(T::STATED[0]),
        stated_bytes_per_vertex: Some(T::STATED[1]),
        words: T::WORDS,
        carries_non_manifold: true,
        neighbourhood: Access::Searched,
        point_reference: T::POINT_REFERENCE,
        previous_edge: Access::ByOrder,
        next_edge: Access::ByOrder,
        costs: COSTS_OF_LISTS,
    };

    fn build(positions: &[Vec3], faces: &[[u32; 3]]) -> Result<Self, CannotCarry> {
        Ok(T::of(positions, faces))
    }

    fn bytes(&self) -> usize {
        self.list_bytes()
    }

    fn position(&self, v: Vertex) -> Vec3 {
        self.vertex_position(v)
    }

    fn face_vertices(&self, f: Face) -> [Vertex; 3] {
        [0, 1, 2].map(|k| self.corner_vertex(3 * f.index() + k))
    }

    fn face_edges(&self, f: Face) -> [Edge; 3] {
        [0, 1, 2].map(|k| Edge::new(3 * f.index() + k))
    }

    fn edge_vertices(&self, e: Edge) -> [Vertex; 2] {
        [e.index(), next(e.index())].map(|c| self.corner_vertex(c))
    }

    fn edge_faces(&self, e: Edge, visit: impl FnMut(Face)) {
        let [a, b] = [e.index(), next(e.index())].map(|c| self.corner_key(c));
        corners_at(self, a)
            .filter(|&c| self.corner_key(next(c)) == b || self.corner_key(prev(c)) == b)
            .map(|c| Face::new(c / 3))
            .for_each(visit);
    }

    fn vertex_faces(&self, v: Vertex, visit: impl FnMut(Face)) {
        corners_at(self, self.vertex_key(v))
            .map(|c| Face::new(c / 3))
            .for_each(visit);
    }

    fn vertex_edges(&self, v: Vertex, mut visit: impl FnMut(Edge)) {
        let spokes = spokes(self, self.vertex_key(v));
        for same in spokes.chunk_by(|a, b| a.key == b.key) {
            visit(Edge::new(same[0].edge));
        }
    }

    fn one_ring(&self, v: Vertex, mut visit: impl FnMut(Vertex)) {
        let spokes = spokes(self, self.vertex_key(v));
        for same in spokes.chunk_by(|a, b| a.key == b.key) {
            visit(self.corner_vertex(same[0].rim));
        }
    }

    fn boundary_step(&self, e: Edge) -> Option<Edge> {
        let spokes = spokes(self, self.corner_key(e.index()));
        let mut corner = e.index();
        // From face to face around the tail, no more often than there are faces.
        for _ in 0..spokes.len() {
            let before = prev(corner);
            let key = self.corner_key(before);
            let first = spokes.partition_point(|s| s.key < key);
            let same = spokes[first..].iter().take_while(|s| s.key == key);
            match *same.map(|s| s.edge).collect::<SmallVec<[_; 4]>>() {
                [_] => return Some(Edge::new(before)),
                [a, b] => {
                    corner = if a == before { b } else { a };
                    // One that runs the same way begins at the other end.
                    if self.corner_key(next(corner)) != key {
                        return None;
                    }
                }
                _ => return None,
            }
        }
        None
    }
}
