//! One orientation for all faces of a component, where there is one.

use super::link::Opposite;
use super::{EdgeId, EdgeStore, FaceId, Mesh};
use crate::progress::{self, Meter, unheard};

/// A mesh whose faces agree with their neighbours where they can.
#[non_exhaustive]
pub struct Oriented<S> {
    /// The connectivity.
    pub mesh: Mesh<S>,
    /// One flag a face: whether it was turned round; nothing where none was.
    pub flipped: Vec<bool>,
    /// The edges at which two faces disagreed before.
    pub disagreements: usize,
}

/// Turns the flagged triangles round.
pub fn turn_round(triangles: &mut [[u32; 3]], flipped: &[bool]) {
    for (triangle, _) in triangles
        .iter_mut()
        .zip(flipped)
        .filter(|(_, flipped)| **flipped)
    {
        triangle.swap(1, 2);
    }
}

impl<S: EdgeStore> Mesh<S> {
    /// [`from_triangles`](Self::from_triangles), neighbours turned to agree first.
    ///
    /// # Panics
    /// As [`from_triangles`](Self::from_triangles).
    pub fn oriented(vertices: usize, triangles: Vec<[u32; 3]>) -> Oriented<S> {
        unheard(|meter| Self::oriented_with(vertices, triangles, meter))
    }

    /// [`oriented`](Self::oriented), told to a meter, with the units of
    /// [`from_triangles_with`](Self::from_triangles_with); more where neighbours disagree.
    pub(crate) fn oriented_with(
        vertices: usize,
        mut triangles: Vec<[u32; 3]>,
        meter: &mut Meter,
    ) -> progress::Result<Oriented<S>> {
        let mesh = Self::from_triangles_with(vertices, &triangles, meter)?;
        let disagreements = mesh.same_way_pair_count();
        if disagreements == 0 {
            return Ok(Oriented {
                mesh,
                flipped: Vec::new(),
                disagreements,
            });
        }
        let flipped = mesh.faces_to_flip(meter)?;
        drop(mesh);
        turn_round(&mut triangles, &flipped);
        let mesh = Self::from_triangles_with(vertices, &triangles, meter)?;
        Ok(Oriented {
            mesh,
            flipped,
            disagreements,
        })
    }

    /// The number of edges that exactly two faces share and run along the same way.
    pub fn same_way_pair_count(&self) -> usize {
        self.same_way_pairs().count()
    }

    /// The edges that exactly two faces share and run along the same way, one directed edge each.
    pub fn same_way_pairs(&self) -> impl Iterator<Item = EdgeId> + '_ {
        let pairs = self.edge_rows.rows().filter(|row| row.len() == 2);
        pairs.map(|row| row[0])
    }

    /// Which faces to turn round so that neighbours agree: in each component (joined across edges
    /// with exactly two faces) the smaller part. Edges of a Möbius strip stay in conflict.
    ///
    /// One flag a face slot. Linear time.
    fn faces_to_flip(&self, meter: &mut Meter) -> progress::Result<Vec<bool>> {
        let mut flip = vec![false; self.face_slots()];
        let mut seen = vec![false; self.face_slots()];
        let mut component: Vec<FaceId> = Vec::new();
        for first in self.faces() {
            if std::mem::replace(&mut seen[first.index()], true) {
                continue;
            }
            component.clear();
            component.push(first);
            let mut done = 0;
            while let Some(&f) = component.get(done) {
                done += 1;
                meter.detour(2)?;
                for (other, agrees) in f.edges().into_iter().filter_map(|e| self.pair(e)) {
                    let g = other.face();
                    if !std::mem::replace(&mut seen[g.index()], true) {
                        flip[g.index()] = flip[f.index()] ^ !agrees;
                        component.push(g);
                    }
                }
            }
            let flipped = component.iter().filter(|f| flip[f.index()]).count();
            if 2 * flipped > component.len() {
                for f in &component {
                    flip[f.index()] ^= true;
                }
            }
        }
        Ok(flip)
    }

    /// The other directed edge of an edge with exactly two faces, and whether it runs the other way.
    fn pair(&self, e: EdgeId) -> Option<(EdgeId, bool)> {
        match self.opposite(e) {
            Opposite::Edge(o) => Some((o, true)),
            Opposite::Boundary => None,
            Opposite::NonManifold(row) => match *self.edge_rows.row(row) {
                [a, b] => Some((if a == e { b } else { a }, false)),
                _ => None,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    /// Three of twenty faces turned: the three are found, not the seventeen.
    fn the_smaller_part_is_flipped<S: EdgeStore>() {
        let (positions, mut triangles) = shapes::icosphere(0);
        for i in [2, 7, 11] {
            triangles[i].swap(1, 2);
        }
        let oriented = Mesh::<S>::oriented(positions.len(), triangles);
        assert!(oriented.disagreements > 0);
        assert_eq!(oriented.mesh.same_way_pair_count(), 0);
        let found: Vec<_> = (0..20).filter(|&i| oriented.flipped[i]).collect();
        assert_eq!(found, [2, 7, 11]);
    }

    /// A Möbius strip has no orientation: at least one edge stays in conflict.
    fn a_moebius_strip_keeps_a_conflict<S: EdgeStore>() {
        let (positions, triangles) = shapes::moebius(12);
        let mesh = Mesh::<S>::oriented(positions.len(), triangles).mesh;
        assert!(mesh.same_way_pair_count() > 0);
    }

    crate::for_each_tier!(
        the_smaller_part_is_flipped,
        a_moebius_strip_keeps_a_conflict
    );
}
