//! The curves that are kept, and how many of their edges meet at each vertex.

use smallvec::SmallVec;

use crate::mesh::{Collapse, EdgeId, EdgeStore, FaceId, Mesh, VertexId};

/// Which edges are part of a curve that collapses keep: creases, and with them boundaries and
/// non-manifold edges. Says nothing of any edge where no creases are asked for.
///
/// A vertex may have 100 000 edges, and each of them asks how many curves meet there: so that is
/// counted once, and followed from then on.
#[derive(Debug, Default)]
pub struct Curves {
    /// One flag a directed edge that is a crease, or nothing where none is kept.
    creases: Vec<bool>,
    /// The edges at each vertex that are part of a curve, or nothing where none is kept.
    counts: Vec<u32>,
    /// Whether curves may shift sideways, where that costs little: those that the surface does not
    /// turn at, but that attributes do.
    may_shift: bool,
}

/// What a collapse will make of the curves.
pub struct Merging {
    /// The dying faces that have a crease beside the edge.
    creased: SmallVec<[FaceId; 2]>,
    /// The edges of curves at the vertex that is left.
    count: u32,
}

impl Curves {
    /// The curves of a mesh, given one flag a directed edge that is a crease; none without flags.
    /// Linear time.
    pub fn of<S: EdgeStore>(mesh: &Mesh<S>, creases: Vec<bool>, may_shift: bool) -> Self {
        let mut curves = Self {
            creases,
            counts: Vec::new(),
            may_shift,
        };
        curves.counts = curves.counted(mesh);
        curves
    }

    fn counted<S: EdgeStore>(&self, mesh: &Mesh<S>) -> Vec<u32> {
        if !self.are_kept() {
            return Vec::new();
        }
        let mut counts = vec![0; mesh.vertex_slots()];
        for e in mesh.edges().filter(|&e| self.has(mesh, e)) {
            for v in mesh.edge_vertices(e) {
                counts[v.index()] += 1;
            }
        }
        counts
    }

    /// Whether any are kept.
    #[inline]
    pub fn are_kept(&self) -> bool {
        !self.creases.is_empty()
    }

    /// Whether they may shift sideways.
    #[inline]
    pub fn may_shift(&self) -> bool {
        self.may_shift
    }

    /// One flag a directed edge that is a crease, or nothing where none is kept.
    pub fn creases(&self) -> &[bool] {
        &self.creases
    }

    /// Whether the edge is kept though the surface goes on across it.
    #[inline]
    pub fn is_crease(&self, e: EdgeId) -> bool {
        self.creases.get(e.index()) == Some(&true)
    }

    /// Whether the edge is a crease, a boundary or non-manifold.
    #[inline]
    fn has<S: EdgeStore>(&self, mesh: &Mesh<S>, e: EdgeId) -> bool {
        self.is_crease(e) || mesh.mate(e).is_none()
    }

    /// Whether the vertex lies on a curve that is kept.
    #[inline]
    pub fn touch(&self, v: VertexId) -> bool {
        self.counts.get(v.index()).is_some_and(|&count| count > 0)
    }

    /// Which ends of `e` stay where they are if it collapses, tail first: along a curve those where it
    /// ends or meets another; off a curve all that lie on one, but those on curves that may shift and
    /// that do not meet another by it.
    #[inline]
    pub fn held<S: EdgeStore>(&self, mesh: &Mesh<S>, e: EdgeId) -> [bool; 2] {
        if !self.are_kept() {
            return [false; 2];
        }
        let [tail, head] = mesh.edge_vertices(e).map(|v| self.counts[v.index()]);
        if self.has(mesh, e) {
            return [tail != 2, head != 2];
        }
        let shifts = |count, other| self.may_shift && count == 2 && other == 0;
        [(tail, head), (head, tail)].map(|(count, other)| count != 0 && !shifts(count, other))
    }

    /// Whether collapsing `e` makes no two curves one. (That none is pinched or pulled off its ends
    /// follows from what is [held](Self::held).)
    #[inline]
    pub fn stay_apart<S: EdgeStore>(&self, mesh: &Mesh<S>, e: EdgeId) -> bool {
        if !self.are_kept() {
            return true;
        }
        let mut star = mesh.edge_star(e).into_iter();
        !star.any(|d| self.has(mesh, mesh.next(d)) && self.has(mesh, mesh.prev(d)))
    }

    /// What the collapse of `e` will make of the curves, which must [stay apart](Self::stay_apart).
    #[inline]
    pub fn before_collapse<S: EdgeStore>(&self, mesh: &Mesh<S>, e: EdgeId) -> Option<Merging> {
        if !self.are_kept() {
            return None;
        }
        let is_creased = |d: &EdgeId| {
            let beside = [mesh.next(*d), mesh.prev(*d)];
            beside.into_iter().any(|e| self.is_crease(e))
        };
        let star = mesh.edge_star(e).into_iter();
        // Beside each dying face one edge of a curve at most, which one end or the apex keeps.
        let [tail, head] = mesh.edge_vertices(e).map(|v| self.counts[v.index()]);
        Some(Merging {
            creased: star.filter(is_creased).map(EdgeId::face).collect(),
            count: tail + head - 2 * u32::from(self.has(mesh, e)),
        })
    }

    /// Follows a collapse.
    pub fn after_collapse<S: EdgeStore>(
        &mut self,
        mesh: &Mesh<S>,
        collapse: &Collapse,
        merging: &Merging,
    ) {
        self.counts[collapse.kept.index()] = merging.count;
        if merging.creased.is_empty() {
            return;
        }
        for (f, &merged) in collapse.dead_faces.iter().zip(&collapse.merged_edges) {
            if merging.creased.contains(f) {
                for d in mesh.edge_star(merged) {
                    self.creases[d.index()] = true;
                }
            }
        }
    }

    /// Follows the flip of an edge of no curve: each directed edge beside it before and after.
    pub fn after_flip(&mut self, sides: [(EdgeId, EdgeId); 4]) {
        if self.are_kept() {
            let creased = sides.map(|(old, _)| self.creases[old.index()]);
            for ((_, new), creased) in sides.into_iter().zip(creased) {
                self.creases[new.index()] = creased;
            }
        }
    }

    /// Whether all is counted as a recount does, and both sides of every edge say the same. Linear
    /// time.
    ///
    /// # Errors
    /// What is wrong.
    pub fn check<S: EdgeStore>(&self, mesh: &Mesh<S>) -> Result<(), String> {
        let counts = self.counted(mesh);
        let mut vertices = mesh.vertices();
        let is_wrong = |v: &VertexId| self.counts.get(v.index()) != counts.get(v.index());
        if let Some(v) = vertices.find(is_wrong) {
            return Err(format!("the curves at {v:?} are miscounted"));
        }
        let mut edges = mesh.faces().flat_map(FaceId::edges);
        let differs = |&e: &EdgeId| self.is_crease(e) != self.is_crease(mesh.canonical(e));
        match edges.find(differs) {
            Some(e) => Err(format!("{e:?} is a crease from one side")),
            None => Ok(()),
        }
    }

    /// The bytes held.
    pub fn bytes(&self) -> usize {
        self.creases.capacity() + self.counts.capacity() * size_of::<u32>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Small;
    use crate::shapes;

    /// Random collapses, along and off random curves that end, meet, and touch boundaries and
    /// non-manifold edges: all is counted as a recount does after each.
    #[test]
    fn the_count_is_that_of_a_recount() {
        let mut collapses = 0;
        for (seed, (positions, triangles)) in (1u64..).zip([
            shapes::grid(9, 9),
            shapes::torus(9, 7),
            shapes::icosphere(2),
            shapes::three_fins(7),
            shapes::moebius(12),
        ]) {
            let mut mesh = Mesh::<Small>::from_triangles(positions.len(), &triangles);
            let mut state = seed;
            let mut random = |n: usize| {
                state = state
                    .wrapping_mul(6364136223846793005)
                    .wrapping_add(1442695040888963407);
                (state >> 33) as usize % n
            };
            let mut creases = vec![false; 3 * mesh.face_slots()];
            for e in mesh.edges().filter(|&e| mesh.mate(e).is_some()) {
                let is_crease = random(5) == 0;
                for d in mesh.edge_star(e) {
                    creases[d.index()] = is_crease;
                }
            }
            let mut curves = Curves::of(&mesh, creases, false);
            for _ in 0..2000 {
                let edges: Vec<EdgeId> = mesh.edges().collect();
                let Some(&e) = edges.get(random(edges.len().max(1))) else {
                    break;
                };
                if mesh.link_condition(e) && curves.stay_apart(&mesh, e) {
                    let merging = curves.before_collapse(&mesh, e).expect("curves are kept");
                    let collapse = mesh.collapse(e);
                    curves.after_collapse(&mesh, &collapse, &merging);
                    let wrong = |wrong| panic!("seed {seed}, after {collapse:?}: {wrong}");
                    curves.check(&mesh).unwrap_or_else(wrong);
                    collapses += 1;
                }
            }
        }
        assert!(collapses > 200, "{collapses}");
    }

    /// A count of one too many, and a crease that its other side knows nothing of.
    #[test]
    fn check_finds_what_is_wrong() {
        let (positions, triangles) = shapes::grid(3, 3);
        let mesh = Mesh::<Small>::from_triangles(positions.len(), &triangles);
        let curves = || Curves::of(&mesh, vec![false; 3 * mesh.face_slots()], false);
        curves().check(&mesh).unwrap();
        let mut miscounted = curves();
        miscounted.counts[5] += 1;
        assert!(miscounted.check(&mesh).is_err());
        let inner = mesh.edges().find(|&e| mesh.mate(e).is_some()).unwrap();
        let mut one_sided = curves();
        one_sided.creases[mesh.mate(inner).unwrap().index()] = true;
        assert!(one_sided.check(&mesh).is_err());
    }
}
