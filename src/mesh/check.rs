//! Every invariant, in linear time.

use super::link::{Opposite, Outgoing};
use super::{EdgeId, EdgeStore, Mesh, VertexId};

impl<S: EdgeStore> Mesh<S> {
    /// Verifies that every word and every table equals what a rebuild from the live triangles
    /// gives.
    ///
    /// Checked: the tier's words agree with each other; every face has three different live
    /// vertices; no two faces have the same three; opposites, side tables, fans and counts are
    /// those of the triangles; an open fan is named by its first edge. Linear time.
    ///
    /// # Errors
    /// A sentence that names the first thing found wrong.
    pub fn check(&self) -> Result<(), String> {
        let slots: Vec<_> = self.faces().collect();
        if slots.len() != self.live_faces {
            return Err(format!(
                "{} live faces, counted {}",
                slots.len(),
                self.live_faces
            ));
        }
        self.check_words()?;
        let triangles = self.triangles();
        let proper = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        if let Some(i) = triangles.iter().position(|t| !proper(t)) {
            return Err(format!(
                "{:?} has the vertices {:?}",
                slots[i], triangles[i]
            ));
        }
        let rebuilt = Mesh::<S>::from_triangles(self.vertex_slots(), &triangles);
        let old = |e: EdgeId| slots[e.face().index()].edges()[e.index() % 3];
        for e in (0..rebuilt.store.slots()).map(EdgeId::new) {
            self.check_edge(&rebuilt, e, old)?;
        }
        let mut fans = (Vec::new(), Vec::new());
        for v in (0..self.vertex_slots()).map(VertexId::new) {
            self.check_vertex(&rebuilt, v, old, &mut fans)?;
        }
        for (what, ours, theirs) in [
            ("vertices", self.live_vertices, rebuilt.live_vertices),
            (
                "non-manifold edges",
                self.edge_rows.len(),
                rebuilt.edge_rows.len(),
            ),
            (
                "vertices with several fans",
                self.fan_rows.len(),
                rebuilt.fan_rows.len(),
            ),
        ] {
            if ours != theirs {
                return Err(format!("{ours} {what}, a rebuild has {theirs}"));
            }
        }
        Ok(())
    }

    fn check_words(&self) -> Result<(), String> {
        for e in self.faces().flat_map(|f| f.edges()) {
            let (next, prev) = (self.next(e), self.prev(e));
            if next.face() != e.face() || self.prev(next) != e || self.next(prev) != e {
                return Err(format!("{e:?}: next is {next:?}, prev is {prev:?}"));
            }
            if self.next(next) != prev {
                return Err(format!("{e:?}: three steps do not close the face"));
            }
            if self.tail(next) != self.head(e) || self.head(prev) != self.tail(e) {
                return Err(format!("{e:?}: its ends are not its neighbours'"));
            }
        }
        Ok(())
    }

    fn check_edge(
        &self,
        rebuilt: &Self,
        e: EdgeId,
        old: impl Fn(EdgeId) -> EdgeId + Copy,
    ) -> Result<(), String> {
        let here = old(e);
        match (self.opposite(here), rebuilt.opposite(e)) {
            (Opposite::Edge(o), Opposite::Edge(r)) if o == old(r) => Ok(()),
            (Opposite::Boundary, Opposite::Boundary) => Ok(()),
            (Opposite::NonManifold(row), Opposite::NonManifold(right)) => {
                let (row, right) = (self.edge_rows.row(row), rebuilt.edge_rows.row(right));
                if row.iter().copied().eq(right.iter().map(|&e| old(e))) {
                    Ok(())
                } else {
                    Err(format!(
                        "{here:?}: its row lists {row:?}, the edge has {right:?}"
                    ))
                }
            }
            (ours, theirs) => Err(format!(
                "{here:?}: opposite {ours:?}, a rebuild has {theirs:?}"
            )),
        }
    }

    fn check_vertex(
        &self,
        rebuilt: &Self,
        v: VertexId,
        old: impl Fn(EdgeId) -> EdgeId + Copy,
        (ours, theirs): &mut (Vec<EdgeId>, Vec<EdgeId>),
    ) -> Result<(), String> {
        if matches!(self.outgoing(v), Outgoing::Fans(row) if self.fan_rows.row(row).len() < 2) {
            return Err(format!(
                "{v:?}: a row of the fan table with less than two fans"
            ));
        }
        for start in self.fans(v) {
            if !self.is_live_face(start.face()) || self.tail(start) != v {
                return Err(format!("{v:?}: its outgoing {start:?} does not leave it"));
            }
        }
        // A fan's name: the first edge where it is open, the smallest where it is closed.
        let names = |mesh: &Self, names: &mut Vec<EdgeId>, old: &dyn Fn(EdgeId) -> EdgeId| {
            names.clear();
            names.extend(mesh.fans(v).filter_map(|start| match mesh.mate(start) {
                None => Some(old(start)),
                Some(_) => mesh.fan(start).map(old).min(),
            }));
            names.sort_unstable();
        };
        names(self, ours, &|e| e);
        names(rebuilt, theirs, &old);
        if ours == theirs {
            Ok(())
        } else {
            Err(format!(
                "{v:?}: its fans begin at {ours:?}, a rebuild has {theirs:?}"
            ))
        }
    }
}
