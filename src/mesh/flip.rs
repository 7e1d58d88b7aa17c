//! The flip of an edge: the other diagonal of the two faces beside it.

use smallvec::SmallVec;

use super::link::{Opposite, Outgoing, RowId};
use super::{EdgeId, EdgeStore, Mesh};

impl<S: EdgeStore> Mesh<S> {
    /// Whether flipping `e` gives a complex of the same topology: two faces lie at it, and no edge
    /// joins their apexes yet.
    ///
    /// Costs one walk around an apex.
    pub fn flip_condition(&self, e: EdgeId) -> bool {
        self.mate(e).is_some_and(|o| {
            let (c, d) = (self.apex(e), self.apex(o));
            c != d && !self.neighbours(c).any(|x| x == d)
        })
    }

    /// Flips `e`.
    ///
    /// ```text
    ///        c                    c
    ///      /   \                / | \
    ///     a ─e→ b     →        a  e  b      e then runs from d to c, and lies in the face with a
    ///      \   /                \ | /
    ///        d                    d
    /// ```
    ///
    /// Returns the directed edges of the four sides, each before and after, for what is carried
    /// along by them. Needs [`flip_condition(e)`](Self::flip_condition). Constant time.
    pub fn flip(&mut self, e: EdgeId) -> [(EdgeId, EdgeId); 4] {
        debug_assert!(self.flip_condition(e), "flip of {e:?} would fold the mesh");
        let Opposite::Edge(o) = self.opposite(e) else {
            unreachable!("the flip condition asks for two faces")
        };
        let [a, b] = self.edge_vertices(e);
        let (bc, ca) = (self.next(e), self.prev(e));
        let (ad, db) = (self.next(o), self.prev(o));
        let (c, d) = (self.head(bc), self.head(ad));
        // Each side's link moves to the directed edge that takes its place.
        let sides = [(ca, bc), (ad, ca), (db, ad), (bc, db)];
        let links = sides.map(|(old, _)| self.opposite(old));
        let renamed = |e: EdgeId| {
            let side = sides.iter().find(|(old, _)| *old == e);
            side.map_or(e, |&(_, new)| new)
        };
        let mut rows: SmallVec<[RowId; 4]> = SmallVec::new();
        for ((_, new), link) in sides.into_iter().zip(links) {
            match link {
                // A side may lie across from another side.
                Opposite::Edge(across) => {
                    self.set_opposite(new, Opposite::Edge(renamed(across)));
                    self.set_opposite(renamed(across), Opposite::Edge(new));
                }
                Opposite::Boundary => self.set_opposite(new, link),
                Opposite::NonManifold(row) => {
                    self.set_opposite(new, link);
                    rows.push(row);
                }
            }
        }
        rows.sort_unstable();
        rows.dedup();
        for row in rows {
            self.edge_rows.rename_row(row, renamed);
        }
        for (edge, tail) in [(e, d), (bc, c), (ca, a), (o, c), (ad, d), (db, b)] {
            self.store.set_tail(edge, tail);
        }
        for (v, gone, new) in [
            (a, [e, ad], ca),
            (b, [bc, o], db),
            (c, [ca, ca], bc),
            (d, [db, db], ad),
        ] {
            match self.outgoing(v) {
                Outgoing::Fan(start) if gone.contains(&start) => {
                    self.set_outgoing(v, Outgoing::Fan(new));
                }
                Outgoing::Fans(row) => {
                    let rename = |e| if gone.contains(&e) { new } else { e };
                    self.fan_rows.rename_row(row, rename);
                }
                _ => {}
            }
        }
        sides
    }
}
