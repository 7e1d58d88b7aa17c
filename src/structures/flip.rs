//! The flip of an edge, the modification that every structure with links has a natural form of.

use smallvec::SmallVec;

use super::{Edge, Face, Structure, Vertex};

/// A triangle structure whose edges can be flipped.
///
/// ```text
///        c                    c
///      /   \                / | \
///     a ─e→ b     →        a  e  b      e then runs from d to c; the face on its left keeps its name
///      \   /                \ | /       and has a, the one on its right has b
///        d                    d
/// ```
///
/// A flip turns the edge by a quarter: four give the mesh back.
pub trait Flip: Structure<3> {
    /// Flips `e`, which must fulfil the [condition](Self::flip_condition). Constant time.
    fn flip(&mut self, e: Edge);

    /// Whether flipping `e` keeps the mesh a manifold: two faces lie at it, and no edge joins their
    /// apexes yet.
    ///
    /// Costs one walk around an apex.
    fn flip_condition(&self, e: Edge) -> bool {
        let ends = self.edge_vertices(e);
        let mut faces: SmallVec<[Face; 2]> = SmallVec::new();
        self.edge_faces(e, |f| faces.push(f));
        let apex = |&f: &Face| {
            self.face_vertices(f)
                .into_iter()
                .find(|v| !ends.contains(v))
        };
        let apexes: SmallVec<[Vertex; 2]> = faces.iter().filter_map(apex).collect();
        let &[c, d] = &apexes[..] else {
            return false;
        };
        let mut are_joined = c == d;
        self.one_ring(c, |v| are_joined |= v == d);
        !are_joined
    }
}
