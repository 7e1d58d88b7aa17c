//! The collapse of an edge, and the condition under which it keeps the topology.

use smallvec::SmallVec;

use super::disk::Disks;
use super::link::{Opposite, Outgoing};
use super::{EdgeId, EdgeStore, FaceId, Mesh, OppositeWord, VertexId};

/// What a collapse did.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Collapse {
    /// The vertex that is left (the collapsed edge's head).
    pub kept: VertexId,
    /// The vertex that is gone (its tail).
    pub removed: VertexId,
    /// The faces that are gone, one for each directed edge of the collapsed edge.
    pub dead_faces: SmallVec<[FaceId; 2]>,
    /// One surviving directed edge of each pair of edges that became one.
    pub merged_edges: SmallVec<[EdgeId; 2]>,
}

/// How far the surroundings of a vertex are from a disk (Dey et al. 1999, section 3).
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
enum Order {
    /// A disk.
    Disk,
    /// Sheets that meet along one curve through the vertex: a boundary (one sheet), a
    /// non-manifold curve (several).
    Curve,
    /// Anything else: a bow-tie, the end or branching of a non-manifold curve.
    Point,
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
    /// Costs one walk around each end.
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
        let star = self.edge_star(e);
        let is_singular = |e| self.mate(e).is_none();
        if star
            .iter()
            .any(|&d| is_singular(self.next(d)) && is_singular(self.prev(d)))
        {
            return false;
        }
        let (order_u, order_v) = (self.order(u), self.order(v));
        let limit = if is_singular(e) {
            Order::Point
        } else {
            Order::Curve
        };
        if order_u >= limit && order_v >= limit {
            return false;
        }
        let apexes: Neighbours = star.iter().map(|&d| self.apex(d)).collect();
        !self.has_other_common_neighbour(u, v, &apexes) && !self.has_common_link_edge(u, v, &star)
    }

    /// Whether a vertex other than the apexes lies next to both ends.
    ///
    /// Walks both ends in turns until one is done. Where the other end is busy, it is asked from
    /// the neighbours of the first instead, so that a vertex of valence 100 000 does not cost its
    /// valence for each of its edges.
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
        if !few.spilled() {
            let is_other = |x: &VertexId| !apexes.contains(x);
            let mut around_busy = self.neighbours(busy);
            let mut first = around_busy.by_ref().take(4 * few.len());
            if first.any(|x| few.contains(&x) && is_other(&x)) {
                return true;
            }
            let mut others = few.iter().filter(|x| is_other(x));
            return around_busy.next().is_some()
                && others.any(|&x| self.neighbours(x).any(|y| y == busy));
        }
        few.sort_unstable();
        let mut apexes = apexes.clone();
        apexes.sort_unstable();
        self.neighbours(busy)
            .any(|x| few.binary_search(&x).is_ok() && apexes.binary_search(&x).is_err())
    }

    /// Whether two apexes are joined by an edge that has a face with `u` and one with `v`.
    ///
    /// Such an edge lies across from `u` in one of the two faces beside a face at the edge; so only
    /// those are looked at.
    fn has_common_link_edge(&self, u: VertexId, v: VertexId, star: &[EdgeId]) -> bool {
        if star.len() < 2 {
            return false;
        }
        let mut apexes: SmallVec<[VertexId; 4]> = star.iter().map(|&d| self.apex(d)).collect();
        apexes.sort_unstable();
        // Pairs of apexes that have a face with `center`: across the side from `center` to an apex.
        let pairs_at = |center: VertexId| {
            let mut pairs: SmallVec<[[VertexId; 2]; 4]> = SmallVec::new();
            for &d in star {
                let [behind, before] = [self.next(d), self.prev(d)];
                let side = if self.tail(behind) == center {
                    behind
                } else {
                    before
                };
                let x = self.apex(d);
                for beside in self.edge_star(side) {
                    let y = self.apex(beside);
                    if y != x && apexes.binary_search(&y).is_ok() {
                        pairs.push([x.min(y), x.max(y)]);
                    }
                }
            }
            pairs.sort_unstable();
            pairs
        };
        let at_u = pairs_at(u);
        !at_u.is_empty()
            && pairs_at(v)
                .iter()
                .any(|pair| at_u.binary_search(pair).is_ok())
    }

    /// How far the surroundings of `v` are from a disk. Constant time at a single fan; else a walk,
    /// until two fans disagree.
    fn order(&self, v: VertexId) -> Order {
        if let Outgoing::Fan(start) = self.outgoing(v) {
            return match self.opposite(start) {
                Opposite::Edge(_) => Order::Disk,
                Opposite::Boundary => Order::Curve,
                // The fan ends where it began.
                Opposite::NonManifold(_) => Order::Point,
            };
        }
        let mut curve: Option<[VertexId; 2]> = None;
        for start in self.fans(v) {
            if self.mate(start).is_some() {
                return Order::Point;
            }
            let (a, b) = (self.head(start), self.tail(self.fan_end(start)));
            let ends = [a.min(b), a.max(b)];
            if a == b || curve.is_some_and(|c| c != ends) {
                return Order::Point;
            }
            curve = Some(ends);
        }
        Order::Curve
    }

    /// Collapses `e`: moves its tail onto its head.
    ///
    /// ```text
    ///        vl
    ///       /  \
    ///   tail ─e→ head      two faces, three edges and the tail go (one face at a boundary, all
    ///       \  /           faces at a non-manifold edge); next(e)'s and prev(e)'s edges become one
    ///        vr
    /// ```
    ///
    /// Needs [`link_condition(e)`](Self::link_condition). Costs a walk around both ends.
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
        let [removed, kept] = self.edge_vertices(e);
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
            let of_kept: SmallVec<[EdgeId; 24]> = self.outgoing_edges(kept).collect();
            survivors.extend(of_kept);
            self.free_fans(removed);
            self.free_fans(kept);
        }
        survivors.retain(|e| !is_dead(*e));
        let is_closed = fans_are_simple
            && [removed, kept].iter().all(|&v| match self.outgoing(v) {
                Outgoing::Fan(start) => self.mate(start).is_some(),
                _ => false,
            });

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
                self.fan_start(leaving)
            };
            self.set_outgoing(kept, Outgoing::Fan(start));
        } else {
            self.set_outgoing(kept, Outgoing::None);
            self.live_vertices -= 1;
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

    /// Finds the fans of `v`, whose outgoing edges are these.
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
            self.add_fan(v, start);
        }
        if let Outgoing::Fans(row) = self.outgoing(v) {
            self.fan_rows.sort(row);
        }
    }
}
