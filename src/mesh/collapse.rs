//! The collapse of an edge, and the condition under which it keeps the topology.

use smallvec::SmallVec;

use super::disk::Disks;
use super::link::{Opposite, Outgoing};
use super::{EdgeId, EdgeStore, FaceId, Mesh, OppositeWord, VertexId};

/// What a collapse did.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Collapse {
    /// The vertex that is left (the collapsed edge's head; its tail where that alone is
    /// [busy](Mesh::is_busy)).
    pub kept: VertexId,
    /// The vertex that is gone (its tail; its head).
    pub removed: VertexId,
    /// The faces that are gone, one for each directed edge of the collapsed edge.
    pub dead_faces: SmallVec<[FaceId; 2]>,
    /// One surviving directed edge of each pair of edges that became one.
    pub merged_edges: SmallVec<[EdgeId; 2]>,
}

type Neighbours = SmallVec<[VertexId; 24]>;

impl<S: EdgeStore> Mesh<S> {
    /// Whether collapsing `e` keeps the complex's topology: Dey, Edelsbrunner, Guha, Nekhayev
    /// 1999, *Topology preserving edge contraction*, the link condition for 2-complexes.
    ///
    /// With *singular* for an edge that is no manifold pair (a boundary or a non-manifold edge):
    /// - no face at `e` has two singular edges beside it: they would merge into one;
    /// - where `e` is regular, at most one end lies on a singular edge or is a singular point;
    /// - where `e` is singular, at most one end is a point where more than sheets along one
    ///   curve meet;
    /// - the common neighbours of both ends are the apexes of the faces at `e`;
    /// - no edge lies across from both ends (a tetrahedron, a pillow).
    ///
    /// Where an end and another vertex next to both are so busy that nobody knows whether both are next
    /// to each other, it says no.
    ///
    /// Costs one walk around the end with fewer neighbours and around its neighbours, or around both
    /// ends where neither is much busier; for a non-manifold edge around both.
    #[inline]
    pub fn link_condition(&self, e: EdgeId) -> bool {
        match self.disks(e) {
            Some(disks) => disks.link_condition(),
            None => self.general_link_condition(e),
        }
    }

    /// [`link_condition`](Self::link_condition), of any edge.
    pub(super) fn general_link_condition(&self, e: EdgeId) -> bool {
        let [u, v] = self.edge_vertices(e);
        let is_singular = |e| self.mate(e).is_none();
        // What costs little first: a walk around all fans of a busy vertex comes after one around the
        // only fan of the other end, and both before a look at all faces of the edge.
        let are_both_far = if is_singular(e) {
            let [first, second] = match self.outgoing(u) {
                Outgoing::Fans(_) => [v, u],
                _ => [u, v],
            };
            self.is_singular_point(first) && self.is_singular_point(second)
        } else {
            !self.is_disk(u) && !self.is_disk(v)
        };
        if are_both_far {
            return false;
        }
        let star = self.edge_star(e);
        if star
            .iter()
            .any(|&d| is_singular(self.next(d)) && is_singular(self.prev(d)))
        {
            return false;
        }
        let apexes: Neighbours = star.iter().map(|&d| self.apex(d)).collect();
        !self.has_other_common_neighbour(u, v, &apexes) && !self.has_common_link_edge(u, v, &star)
    }

    /// Whether a vertex other than the apexes lies next to both ends.
    ///
    /// Walks both ends in turns until one is done. Where the other end is busier by far, it is asked
    /// from the neighbours of the first instead, so that a vertex of valence 100 000 does not cost its
    /// valence for each of its edges. Says yes where nobody knows.
    fn has_other_common_neighbour(&self, u: VertexId, v: VertexId, apexes: &Neighbours) -> bool {
        let (mut at_u, mut at_v) = (self.neighbours(u), self.neighbours(v));
        let (mut around_u, mut around_v) = (Neighbours::new(), Neighbours::new());
        let (few, busy) = loop {
            match at_u.next() {
                Some(x) => around_u.push(x),
                None => break (&mut around_u, v),
            }
            match at_v.next() {
                Some(x) => around_v.push(x),
                None => break (&mut around_v, u),
            }
        };
        let mut apexes = apexes.clone();
        let is_sorted = few.spilled();
        if is_sorted {
            few.sort_unstable();
            apexes.sort_unstable();
        }
        let has = |list: &Neighbours, x: VertexId| {
            if is_sorted {
                list.binary_search(&x).is_ok()
            } else {
                list.contains(&x)
            }
        };
        let mut around_busy = self.neighbours(busy);
        let mut first = around_busy.by_ref().take(4 * few.len());
        if first.any(|x| has(few, x) && !has(&apexes, x)) {
            return true;
        }
        let mut others = few.iter().filter(|&&x| x != busy && !has(&apexes, x));
        around_busy.next().is_some() && others.any(|&x| self.are_joined(x, busy) != Some(false))
    }

    /// Whether two apexes are joined by an edge that has a face with `u` and one with `v`.
    ///
    /// Such an edge lies across from `u` in one of the two faces beside a face at the edge, and across
    /// from `v`; so only those at one end are looked at.
    fn has_common_link_edge(&self, u: VertexId, v: VertexId, star: &[EdgeId]) -> bool {
        if star.len() < 2 {
            return false;
        }
        let mut apexes: SmallVec<[VertexId; 4]> = star.iter().map(|&d| self.apex(d)).collect();
        apexes.sort_unstable();
        let sides_at = |center: VertexId| {
            star.iter().map(move |&d| {
                let [behind, before] = [self.next(d), self.prev(d)];
                if self.tail(behind) == center {
                    behind
                } else {
                    before
                }
            })
        };
        // From the end beside which fewer faces lie: a side may be the spine of a book.
        let [at_u, at_v] = [u, v].map(|center| {
            sides_at(center)
                .map(|e| self.edge_face_count(e))
                .sum::<usize>()
        });
        let [center, other] = if at_u <= at_v { [u, v] } else { [v, u] };
        sides_at(center).zip(star).any(|(side, &d)| {
            let x = self.apex(d);
            self.edge_star(side).into_iter().any(|beside| {
                // The face of `center`, x and y: has the edge across from `center` a face with the
                // other end, too?
                let y = self.apex(beside);
                let across = if self.tail(beside) == center {
                    self.next(beside)
                } else {
                    self.prev(beside)
                };
                y != x
                    && apexes.binary_search(&y).is_ok()
                    && self
                        .edge_star(across)
                        .into_iter()
                        .any(|d| self.apex(d) == other)
            })
        })
    }

    /// Whether the surroundings of `v` are a disk (Dey et al. 1999, section 3: of order 0).
    fn is_disk(&self, v: VertexId) -> bool {
        matches!(self.outgoing(v), Outgoing::Fan(start) if self.mate(start).is_some())
    }

    /// Whether the surroundings of `v` are neither a disk nor sheets that meet along one curve through
    /// it, a boundary (one sheet) or a non-manifold curve (several): a bow-tie, the end or branching of
    /// a non-manifold curve (of order 2).
    ///
    /// Constant time at a single fan; else a walk, until two fans disagree.
    fn is_singular_point(&self, v: VertexId) -> bool {
        if let Outgoing::Fan(start) = self.outgoing(v) {
            // A fan that begins at a non-manifold edge ends where it began.
            return matches!(self.opposite(start), Opposite::NonManifold(_));
        }
        let mut curve: Option<[VertexId; 2]> = None;
        for start in self.fans(v) {
            if self.mate(start).is_some() {
                return true;
            }
            let (a, b) = (self.head(start), self.tail(self.fan_end(start)));
            let ends = [a.min(b), a.max(b)];
            if a == b || curve.is_some_and(|c| c != ends) {
                return true;
            }
            curve = Some(ends);
        }
        false
    }

    /// The vertex that the collapse of `e` removes and the one that it leaves: the tail and the head,
    /// unless the tail alone is [busy](Self::is_busy).
    pub fn collapse_ends(&self, e: EdgeId) -> [VertexId; 2] {
        let [tail, head] = self.edge_vertices(e);
        if self.is_busy(tail) && !self.is_busy(head) {
            [head, tail]
        } else {
            [tail, head]
        }
    }

    /// Collapses `e`: moves its tail onto its head, or, where the tail alone is busy, its head onto its
    /// tail.
    ///
    /// ```text
    ///        vl
    ///       /  \
    ///   tail ─e→ head      two faces, three edges and the tail go (one face at a boundary, all
    ///       \  /           faces at a non-manifold edge); next(e)'s and prev(e)'s edges become one
    ///        vr
    /// ```
    ///
    /// Needs [`link_condition(e)`](Self::link_condition). Costs a walk around both ends, or around the
    /// one that is not busy, and around the fans at the other that lose a face.
    pub fn collapse(&mut self, e: EdgeId) -> Collapse {
        let disks = self.disks(e);
        self.collapse_between(e, disks.as_ref())
    }

    /// [`collapse`](Self::collapse) with what [`disks`](Self::disks) says of `e`.
    #[inline]
    pub fn collapse_between(&mut self, e: EdgeId, disks: Option<&Disks>) -> Collapse {
        debug_assert!(
            self.link_condition(e),
            "collapse of {e:?} would change the topology"
        );
        match disks {
            Some(disks) => self.collapse_disks(disks),
            None => self.general_collapse(e),
        }
    }

    /// [`collapse`](Self::collapse), of any edge.
    pub(super) fn general_collapse(&mut self, e: EdgeId) -> Collapse {
        let [removed, kept] = self.collapse_ends(e);
        let star = self.edge_star(e);
        let fans_are_simple = star.len() <= 2
            && !matches!(self.opposite(e), Opposite::NonManifold(_))
            && matches!(self.outgoing(removed), Outgoing::Fan(_))
            && matches!(self.outgoing(kept), Outgoing::Fan(_));
        // In ascending order wherever there are more than two.
        let dead_faces: SmallVec<[FaceId; 2]> = star.iter().map(|d| d.face()).collect();
        let is_dead = |e: EdgeId| match dead_faces.len() {
            0..=2 => dead_faces.contains(&e.face()),
            _ => dead_faces.binary_search(&e.face()).is_ok(),
        };
        let mut survivors: SmallVec<[EdgeId; 24]> = self.outgoing_edges(removed).collect();
        if !fans_are_simple {
            self.free_fans(removed);
            self.take_fans_beside(&star, kept, &mut survivors);
        }
        survivors.retain(|e| !is_dead(*e));
        let starts: SmallVec<[EdgeId; 2]> = if fans_are_simple {
            self.fans(removed).chain(self.fans(kept)).collect()
        } else {
            SmallVec::new()
        };
        let is_closed = starts.iter().all(|&start| self.mate(start).is_some());

        if let Opposite::NonManifold(row) = self.opposite(e) {
            self.edge_rows.remove(row);
        }
        let merged_edges: SmallVec<[EdgeId; 2]> =
            star.iter().map(|&d| self.close_face(d)).collect();
        for &e in &survivors {
            self.store.set_tail(e, kept);
        }
        for &d in &star {
            for dead in d.face().edges() {
                self.store.set_opposite_word(dead, OppositeWord::DEAD);
            }
        }
        self.live_faces -= star.len();
        self.live_vertices -= 1;
        self.set_outgoing(removed, Outgoing::None);
        if fans_are_simple {
            let merged = merged_edges[0];
            let leaving = if self.tail(merged) == kept {
                merged
            } else {
                self.next(merged)
            };
            let start = if is_closed {
                leaving
            } else {
                // Where the open fan of one end began, the one of both does.
                let begins = |e: &EdgeId| !is_dead(*e) && self.mate(*e).is_none();
                let before = starts.into_iter().find(begins);
                before.unwrap_or_else(|| self.fan_start(leaving))
            };
            self.set_outgoing(kept, Outgoing::Fan(start));
        } else {
            self.find_fans_among(kept, &mut survivors);
        }
        Collapse {
            kept,
            removed,
            dead_faces,
            merged_edges,
        }
    }

    pub(super) fn free_fans(&mut self, v: VertexId) {
        if let Outgoing::Fans(row) = self.outgoing(v) {
            self.fan_rows.remove(row);
        }
    }

    /// Takes from `v` the fans in which faces of `star` lie, and gives their outgoing edges; all fans
    /// where `v` is not busy, so that each begins at its smallest edge when it is found again.
    fn take_fans_beside(
        &mut self,
        star: &[EdgeId],
        v: VertexId,
        outgoing: &mut SmallVec<[EdgeId; 24]>,
    ) {
        let row = match self.outgoing(v) {
            Outgoing::Fans(row) if self.is_busy(v) => row,
            fans => {
                outgoing.extend(self.outgoing_edges(v).collect::<Vec<_>>());
                self.free_fans(v);
                self.live_vertices -= usize::from(fans != Outgoing::None);
                self.set_outgoing(v, Outgoing::None);
                return;
            }
        };
        for &d in star {
            let leaving = if self.tail(d) == v { d } else { self.next(d) };
            let start = self.fan_start(leaving);
            let named = self
                .fan(start)
                .find(|e| self.fan_rows.row(row).binary_search(e).is_ok());
            // Two faces may lie in one fan.
            if let Some(name) = named {
                outgoing.extend(self.fan(start).collect::<Vec<_>>());
                self.fan_rows.take(row, name);
            }
        }
        match *self.fan_rows.row(row) {
            [] => {
                self.fan_rows.remove(row);
                self.live_vertices -= 1;
                self.set_outgoing(v, Outgoing::None);
            }
            [only] => {
                self.fan_rows.remove(row);
                self.set_outgoing(v, Outgoing::Fan(only));
            }
            _ => {}
        }
    }

    /// Joins the two edges beside `d` in its dying face into one, and returns a directed edge of
    /// it that lives on.
    pub(super) fn close_face(&mut self, d: EdgeId) -> EdgeId {
        let (behind, before) = (self.next(d), self.prev(d));
        let (across_behind, across_before) = (self.opposite(behind), self.opposite(before));
        let (dying, survivor, link) = match (across_behind, across_before) {
            (Opposite::Edge(a), Opposite::Edge(b)) => {
                self.set_opposite(a, Opposite::Edge(b));
                (behind, b, Opposite::Edge(a))
            }
            (Opposite::Edge(a), singular) => (before, a, singular),
            (singular, Opposite::Edge(b)) => (behind, b, singular),
            _ => unreachable!("the link condition keeps singular edges apart"),
        };
        if let Opposite::NonManifold(row) = link {
            self.edge_rows.replace(row, dying, survivor);
        }
        self.set_opposite(survivor, link);
        // The apex may have begun its walk in the dying face.
        let apex = self.tail(before);
        if let Opposite::Edge(leaving) = across_behind {
            self.replace_fan(apex, before, leaving);
        }
        survivor
    }

    /// Where a fan of `v` is named by `old`, names it by `new`.
    pub(super) fn replace_fan(&mut self, v: VertexId, old: EdgeId, new: EdgeId) {
        match self.outgoing(v) {
            Outgoing::Fan(e) if e == old => self.set_outgoing(v, Outgoing::Fan(new)),
            Outgoing::Fans(row) if self.fan_rows.row(row).binary_search(&old).is_ok() => {
                self.fan_rows.replace(row, old, new);
            }
            _ => {}
        }
    }

    /// Finds the fans of `v` in which these edges lie, all that leave it but those of fans it has.
    pub(super) fn find_fans_among(&mut self, v: VertexId, outgoing: &mut [EdgeId]) {
        outgoing.sort_unstable();
        let mut seen: SmallVec<[bool; 24]> = SmallVec::from_elem(false, outgoing.len());
        for i in 0..outgoing.len() {
            if seen[i] {
                continue;
            }
            let start = self.fan_start(outgoing[i]);
            for e in self.fan(start) {
                let at = outgoing
                    .binary_search(&e)
                    .expect("a fan's edges leave its vertex");
                seen[at] = true;
            }
            match self.outgoing(v) {
                Outgoing::Fans(row) => self.fan_rows.put(row, start),
                _ => self.add_fan(v, start),
            }
        }
    }
}
