//! Walks: fans, one-rings, boundary curves. The order is the same in every tier.

use std::slice;

use super::link::Outgoing;
use super::{EdgeId, EdgeStore, FaceId, Mesh, VertexId};
use smallvec::SmallVec;

/// The faces of a busy vertex, and more.
pub(crate) const BUSY: usize = 192;

/// The outgoing edges of one fan, in the order of the walk `e → opposite(prev(e))`.
///
/// ```text
///        e1   e2
///         \  /
///   e0 ──── v       an open fan of three faces: the walk yields e0, e1, e2; the edge from the last
///            \      face's apex to v is no outgoing edge, so the ring has one vertex more
///            (apex)
/// ```
#[derive(Clone, Debug)]
pub struct Fan<'a, S> {
    mesh: &'a Mesh<S>,
    start: EdgeId,
    at: Option<EdgeId>,
}

impl<S: EdgeStore> Iterator for Fan<'_, S> {
    type Item = EdgeId;

    #[inline]
    fn next(&mut self) -> Option<EdgeId> {
        let e = self.at?;
        self.at = self
            .mesh
            .mate(self.mesh.prev(e))
            .filter(|&o| o != self.start);
        Some(e)
    }
}

/// One edge of each fan of a vertex.
#[derive(Clone, Debug)]
struct Fans<'a> {
    only: Option<EdgeId>,
    row: slice::Iter<'a, EdgeId>,
}

impl Iterator for Fans<'_> {
    type Item = EdgeId;

    #[inline]
    fn next(&mut self) -> Option<EdgeId> {
        self.only.take().or_else(|| self.row.next().copied())
    }
}

/// The outgoing edges of a vertex, fan by fan.
#[derive(Clone, Debug)]
struct OutgoingEdges<'a, S> {
    fan: Fan<'a, S>,
    others: slice::Iter<'a, EdgeId>,
}

impl<S: EdgeStore> Iterator for OutgoingEdges<'_, S> {
    type Item = EdgeId;

    #[inline]
    fn next(&mut self) -> Option<EdgeId> {
        loop {
            if let Some(e) = self.fan.next() {
                return Some(e);
            }
            self.fan = self.fan.mesh.fan(*self.others.next()?);
        }
    }
}

/// The vertices next to a vertex, fan by fan.
#[derive(Clone, Debug)]
struct Neighbours<'a, S> {
    fan: Fan<'a, S>,
    /// The edge that comes in at the end of an open fan.
    end: Option<EdgeId>,
    others: slice::Iter<'a, EdgeId>,
}

impl<S: EdgeStore> Iterator for Neighbours<'_, S> {
    type Item = VertexId;

    #[inline]
    fn next(&mut self) -> Option<VertexId> {
        let mesh = self.fan.mesh;
        loop {
            if let Some(e) = self.fan.at {
                let before = mesh.prev(e);
                let mate = mesh.mate(before);
                if mate.is_none() {
                    self.end = Some(before);
                }
                self.fan.at = mate.filter(|&o| o != self.fan.start);
                return Some(mesh.head(e));
            }
            if let Some(end) = self.end.take() {
                return Some(mesh.tail(end));
            }
            self.fan = mesh.fan(*self.others.next()?);
        }
    }
}

/// A run of boundary edges, each beginning where the one before ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BoundaryCurve {
    /// The directed edges, in order.
    pub edges: Vec<EdgeId>,
    /// Whether the last edge ends where the first begins; a curve that is not closed runs between
    /// two non-manifold edges.
    pub is_closed: bool,
}

impl<S: EdgeStore> Mesh<S> {
    /// One edge of each fan of `v`; of an open fan its first.
    #[inline]
    pub fn fans(&self, v: VertexId) -> impl Iterator<Item = EdgeId> + Clone + '_ {
        match self.outgoing(v) {
            Outgoing::Fan(e) => Fans {
                only: Some(e),
                row: [].iter(),
            },
            Outgoing::Fans(row) => Fans {
                only: None,
                row: self.fan_rows.row(row).iter(),
            },
            Outgoing::None => Fans {
                only: None,
                row: [].iter(),
            },
        }
    }

    /// The outgoing edges of the fan that begins at `start`.
    #[inline]
    pub fn fan(&self, start: EdgeId) -> Fan<'_, S> {
        Fan {
            mesh: self,
            start,
            at: Some(start),
        }
    }

    /// The outgoing edges of `v`, fan by fan: one per face around `v`.
    #[inline]
    pub fn outgoing_edges(&self, v: VertexId) -> impl Iterator<Item = EdgeId> + '_ {
        self.walk(v)
    }

    /// All faces that share a vertex (VF), fan by fan.
    pub fn vertex_faces(&self, v: VertexId) -> impl Iterator<Item = FaceId> + '_ {
        self.outgoing_edges(v).map(EdgeId::face)
    }

    /// All edges that share a vertex (VE), one directed edge each: an outgoing one where there is
    /// one. Costs a sort at a non-manifold vertex.
    pub fn vertex_edges(&self, v: VertexId) -> SmallVec<[EdgeId; 16]> {
        let mut edges: SmallVec<[EdgeId; 16]> = SmallVec::new();
        for start in self.fans(v) {
            let mut last = start;
            for e in self.fan(start) {
                edges.push(e);
                last = e;
            }
            if self.mate(start).is_none() {
                edges.push(self.prev(last));
            }
        }
        if self.is_non_manifold_vertex(v) {
            // The ends of several fans can lie on one edge; the first that was met stays.
            let mut named: Vec<(EdgeId, usize)> = edges
                .iter()
                .enumerate()
                .map(|(i, &e)| (self.canonical(e), i))
                .collect();
            named.sort_unstable();
            named.dedup_by_key(|&mut (name, _)| name);
            named.sort_unstable_by_key(|&(_, i)| i);
            edges = named.into_iter().map(|(_, i)| edges[i]).collect();
        }
        edges
    }

    /// The vertices around `v`, each once, in the order of the walk.
    pub fn one_ring(&self, v: VertexId) -> SmallVec<[VertexId; 16]> {
        let other = |e| {
            if self.tail(e) == v {
                self.head(e)
            } else {
                self.tail(e)
            }
        };
        self.vertex_edges(v).into_iter().map(other).collect()
    }

    /// Every vertex next to `v`; those on a non-manifold edge at `v` once for each fan that ends
    /// there.
    #[inline]
    pub fn neighbours(&self, v: VertexId) -> impl Iterator<Item = VertexId> + '_ {
        let OutgoingEdges { fan, others } = self.walk(v);
        let end = None;
        Neighbours { fan, end, others }
    }

    /// Whether `v` has so many faces that not every edge at it can afford a walk around it. Looks at
    /// no more than that.
    pub fn is_busy(&self, v: VertexId) -> bool {
        self.outgoing_edges(v).nth(BUSY - 1).is_some()
    }

    /// Whether an edge joins `a` and `b`. Walks around both in turns until one is done; nothing where
    /// neither is after as many steps as a busy vertex has faces.
    pub(super) fn are_joined(&self, a: VertexId, b: VertexId) -> Option<bool> {
        let (mut at_a, mut at_b) = (self.neighbours(a), self.neighbours(b));
        for _ in 0..BUSY {
            match (at_a.next(), at_b.next()) {
                (Some(x), Some(y)) if x != b && y != a => {}
                (x, y) => return Some(x == Some(b) || y == Some(a)),
            }
        }
        None
    }

    /// The walk around `v`, before its first step.
    #[inline]
    fn walk(&self, v: VertexId) -> OutgoingEdges<'_, S> {
        let (at, others) = match self.outgoing(v) {
            Outgoing::Fan(start) => (Some(start), [].iter()),
            Outgoing::Fans(row) => (None, self.fan_rows.row(row).iter()),
            Outgoing::None => (None, [].iter()),
        };
        let start = at.unwrap_or(EdgeId::new(0));
        let mesh = self;
        let fan = Fan { mesh, start, at };
        OutgoingEdges { fan, others }
    }

    /// The first edge of the fan that the outgoing edge `e` lies in; of a closed fan `e` itself.
    pub(super) fn fan_start(&self, e: EdgeId) -> EdgeId {
        let mut start = e;
        while let Some(o) = self.mate(start) {
            start = self.next(o);
            if start == e {
                break;
            }
        }
        start
    }

    /// The edge at which the open fan that begins at `start` ends: the one before its last
    /// outgoing edge, which runs towards the vertex.
    pub(super) fn fan_end(&self, start: EdgeId) -> EdgeId {
        self.prev(self.fan(start).last().unwrap_or(start))
    }

    /// The boundary edge that begins where the boundary edge `e` ends, unless a non-manifold edge
    /// comes first.
    pub fn next_on_boundary(&self, e: EdgeId) -> Option<EdgeId> {
        debug_assert!(self.is_boundary(e), "{e:?} is no boundary edge");
        let start = self.fan_start(self.next(e));
        self.is_boundary(start).then_some(start)
    }

    /// The boundary, as curves: closed loops first by their smallest edge, then the runs between
    /// non-manifold edges. Linear time.
    pub fn boundary_curves(&self) -> Vec<BoundaryCurve> {
        let boundary = || {
            self.faces()
                .flat_map(FaceId::edges)
                .filter(|&e| self.is_boundary(e))
        };
        let mut has_previous = vec![false; self.store.slots()];
        for e in boundary() {
            if let Some(next) = self.next_on_boundary(e) {
                has_previous[next.index()] = true;
            }
        }
        let mut seen = vec![false; self.store.slots()];
        let mut curves = Vec::new();
        // Runs from their first edges; what is left then lies on loops.
        for from_first in [true, false] {
            for first in boundary() {
                let begins = !from_first || !has_previous[first.index()];
                if seen[first.index()] || !begins {
                    continue;
                }
                let mut edges = Vec::new();
                let mut at = Some(first);
                while let Some(e) = at.filter(|e| !seen[e.index()]) {
                    seen[e.index()] = true;
                    edges.push(e);
                    at = self.next_on_boundary(e);
                }
                curves.push(BoundaryCurve {
                    edges,
                    is_closed: at == Some(first),
                });
            }
        }
        curves.sort_by_key(|c| !c.is_closed);
        curves
    }
}
