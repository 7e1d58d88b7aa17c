//! Builds connectivity from triangles in linear time: pairs opposites, finds the fans, fills the
//! side tables.

use super::link::{Opposite, Outgoing};
use super::{EdgeId, EdgeStore, Mesh, SideTable, VertexId};

impl<S: EdgeStore> Mesh<S> {
    /// The connectivity of these triangles over `vertices` vertices.
    ///
    /// Linear time, but for a logarithm in the number of edges at the vertices that are not
    /// manifold. Needs 12 bytes a triangle and 8 a vertex beside the mesh while it runs; 3 more a
    /// triangle where something is not manifold.
    ///
    /// # Panics
    /// Where a triangle names a vertex that is not there or one vertex twice, or 3m exceeds 2³¹−1.
    /// Duplicate triangles are allowed: their edges are non-manifold.
    pub fn from_triangles(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        assert!(
            triangles.len() <= i32::MAX as usize / 3,
            "too many triangles"
        );
        // Without a way out in the middle, so that several triangles are looked at at once.
        let are_proper = triangles.iter().fold(true, |all, &[a, b, c]| {
            let is_there = (a.max(b).max(c) as usize) < vertices;
            all & is_there & (a != b) & (b != c) & (c != a)
        });
        assert!(are_proper, "a triangle needs three vertices of the mesh");
        let mut mesh = Self {
            store: S::from_triangles(triangles),
            outgoing: vec![Outgoing::None.into(); vertices],
            edge_rows: SideTable::default(),
            fan_rows: SideTable::default(),
            live_faces: triangles.len(),
            live_vertices: 0,
        };
        let corners = Corners::of(vertices, triangles);
        let mut left = mesh.pair_opposites(&corners);
        mesh.add_edge_rows(&corners, &mut left);
        mesh.add_fans(&corners, left.fans);
        mesh
    }

    /// Pairs opposites vertex by vertex, and finds the fan of each vertex that has only one.
    ///
    /// ```text
    ///     x ──in──> v ──out──> y      of each corner of v: the edge that comes in, the one that goes
    ///                                 out; behind a corner in its fan comes the one whose `out` is
    ///                                 the opposite of `in`
    /// ```
    ///
    /// Each edge comes in at one vertex, and finds there the edge that goes out to where it comes
    /// from. An edge that is not manifold has two that go out to the same vertex: what is found at
    /// its ends is wrong.
    fn pair_opposites(&mut self, corners: &Corners) -> LeftOver {
        let mut left = LeftOver::default();
        // The place in the list of the corner whose edge goes out to a vertex, counted from 1: what
        // is no greater than where the list of a vertex begins was left by a vertex before it.
        let mut going_to = vec![0u32; self.vertex_slots()];
        let mut behind: Vec<u32> = Vec::new();
        let mut begin = 0;
        for (v, &end) in corners.ends.iter().enumerate() {
            let of_v = &corners.list[begin as usize..end as usize];
            for (place, &out) in (begin + 1..).zip(of_v) {
                let y = corners.tails[next(out)] as usize;
                if std::mem::replace(&mut going_to[y], place) > begin {
                    left.crowded.push(VertexId::new(v.min(y)));
                }
            }
            // An open fan is closed from its last corner to its first, which is what all places
            // but those behind another add up to.
            let (mut first, mut last, mut open_fans) = (0u32, 0, 0);
            behind.clear();
            for (i, &out) in (0..).zip(of_v) {
                let before = prev(out);
                let place = going_to[corners.tails[before] as usize];
                let mut next = 0;
                if place > begin {
                    next = place - begin - 1;
                    let mate = EdgeId::new(of_v[next as usize] as usize);
                    self.set_opposite(EdgeId::new(before), Opposite::Edge(mate));
                } else {
                    (last, open_fans) = (i as usize, open_fans + 1);
                }
                first = first.wrapping_add(i).wrapping_sub(next);
                behind.push(next);
            }
            if open_fans == 1 {
                behind[last] = first;
            }
            if open_fans < 2 && is_one_cycle(&behind, first) {
                let start = EdgeId::new(of_v[first as usize] as usize);
                self.add_fan(VertexId::new(v), start);
            } else if !of_v.is_empty() {
                left.fans.push(VertexId::new(v));
            }
            begin = end;
        }
        left
    }

    /// Gives every edge that is not manifold its row, in the order of their smaller ends, then of
    /// their larger ends; forgets the fans at both.
    fn add_edge_rows(&mut self, corners: &Corners, left: &mut LeftOver) {
        left.crowded.sort_unstable();
        left.crowded.dedup();
        let mut sides: Vec<(u32, EdgeId)> = Vec::new();
        for &v in &left.crowded {
            sides.clear();
            for &out in corners.of_vertex(v) {
                sides.push((corners.tails[next(out)], EdgeId::new(out as usize)));
                sides.push((corners.tails[prev(out)], EdgeId::new(prev(out))));
            }
            sides.sort_unstable();
            for edge in sides.chunk_by(|a, b| a.0 == b.0) {
                let other = VertexId::new(edge[0].0 as usize);
                let is_manifold = match *edge {
                    [_] => true,
                    [(_, a), (_, b)] => self.tail(a) == self.head(b),
                    _ => false,
                };
                if is_manifold || other < v {
                    continue;
                }
                let row = self
                    .edge_rows
                    .insert(edge.iter().map(|&(_, e)| e).collect());
                for &(_, e) in edge {
                    self.set_opposite(e, Opposite::NonManifold(row));
                }
                for end in [v, other] {
                    self.live_vertices -= usize::from(self.outgoing(end) != Outgoing::None);
                    self.set_outgoing(end, Outgoing::None);
                    left.fans.push(end);
                }
            }
        }
    }

    /// Finds the fans of these vertices by walking, in the order of their smallest edges.
    fn add_fans(&mut self, corners: &Corners, mut vertices: Vec<VertexId>) {
        if vertices.is_empty() {
            return;
        }
        vertices.sort_unstable();
        vertices.dedup();
        let of_vertex = |&v: &VertexId| corners.of_vertex(v).iter().map(|&e| e as usize);
        let mut edges: Vec<usize> = vertices.iter().flat_map(of_vertex).collect();
        edges.sort_unstable();
        let mut seen = vec![false; self.store.slots()];
        for e in edges {
            if seen[e] {
                continue;
            }
            let start = self.fan_start(EdgeId::new(e));
            for e in self.fan(start) {
                seen[e.index()] = true;
            }
            self.add_fan(self.tail(start), start);
        }
        self.fan_rows.sort_all();
    }

    /// Adds a fan, given by its first edge, to those of `v`; leaves the row of several unsorted.
    pub(super) fn add_fan(&mut self, v: VertexId, start: EdgeId) {
        let outgoing = match self.outgoing(v) {
            Outgoing::None => {
                self.live_vertices += 1;
                Outgoing::Fan(start)
            }
            Outgoing::Fan(first) => Outgoing::Fans(self.fan_rows.insert(vec![first, start])),
            Outgoing::Fans(row) => {
                self.fan_rows.push(row, start);
                return;
            }
        };
        self.set_outgoing(v, outgoing);
    }
}

/// What pairing vertex by vertex leaves to do.
#[derive(Default)]
struct LeftOver {
    /// The smaller end of every edge that is not manifold, some more than once.
    crowded: Vec<VertexId>,
    /// The vertices whose fans are not found yet.
    fans: Vec<VertexId>,
}

/// The corners of each vertex, ascending. Corner 3i+k of triangle i is also the edge that goes out
/// there.
struct Corners<'a> {
    /// The vertex of each corner: the tail of its edge.
    tails: &'a [u32],
    list: Vec<u32>,
    /// Where the corners of each vertex end in the list; they begin where those before end.
    ends: Vec<u32>,
}

impl<'a> Corners<'a> {
    /// Sorts the corners by vertex, counting.
    fn of(vertices: usize, triangles: &'a [[u32; 3]]) -> Self {
        let tails = triangles.as_flattened();
        let mut ends = vec![0u32; vertices];
        for &v in tails {
            ends[v as usize] += 1;
        }
        let mut begin = 0;
        for end in &mut ends {
            begin += std::mem::replace(end, begin);
        }
        // Filling moves each begin to its end.
        let mut list = vec![0u32; tails.len()];
        for (corner, &v) in (0..).zip(tails) {
            let end = &mut ends[v as usize];
            list[*end as usize] = corner;
            *end += 1;
        }
        Self { tails, list, ends }
    }

    fn of_vertex(&self, v: VertexId) -> &[u32] {
        let begin = v.index().checked_sub(1).map_or(0, |v| self.ends[v]);
        &self.list[begin as usize..self.ends[v.index()] as usize]
    }
}

/// The corner behind this one in its triangle.
#[inline(always)]
fn next(corner: u32) -> usize {
    (if corner % 3 == 2 {
        corner - 2
    } else {
        corner + 1
    }) as usize
}

/// The corner before this one in its triangle.
#[inline(always)]
fn prev(corner: u32) -> usize {
    (if corner.is_multiple_of(3) {
        corner + 2
    } else {
        corner - 1
    }) as usize
}

/// Whether all places follow each other on one cycle through `first`.
fn is_one_cycle(behind: &[u32], first: u32) -> bool {
    // As many steps as there are places, whatever is found: where a loop ends is guessed right
    // then, and costs no wait for the walk.
    let (mut at, mut returns) = (first as usize, 0);
    for _ in behind {
        at = behind.get(at).map_or(at, |&next| next as usize);
        returns += u32::from(at == first as usize);
    }
    returns == 1 && at == first as usize
}
