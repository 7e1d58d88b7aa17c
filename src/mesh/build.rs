//! Builds connectivity from triangles in linear time: pairs opposites, finds the fans, fills the
//! side tables.

use super::link::{Opposite, OppositeWord, Outgoing, OutgoingWord};
use super::{EdgeId, EdgeStore, Mesh, SideTable, VertexId};
use crate::progress::{self, BLOCK, Meter, unheard};

impl<S: EdgeStore> Mesh<S> {
    /// The connectivity of these triangles over `vertices` vertices.
    ///
    /// Linear time, but for a logarithm in the number of edges at the vertices that are not
    /// manifold. Needs 48 bytes a triangle and 8 a vertex before the tier's words are made, 12 a
    /// triangle beside them, 3 where something is not manifold.
    ///
    /// # Panics
    /// Where a triangle names a vertex that is not there or one vertex twice, or 3m exceeds 2³¹−1.
    /// Duplicate triangles are allowed: their edges are non-manifold.
    pub fn from_triangles(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        unheard(|meter| Self::from_triangles_with(vertices, triangles, meter))
    }

    /// [`from_triangles`](Self::from_triangles), told to a meter: [`UNITS`] a triangle, more where
    /// it is not manifold.
    pub(crate) fn from_triangles_with(
        vertices: usize,
        triangles: &[[u32; 3]],
        meter: &mut Meter,
    ) -> progress::Result<Self> {
        assert!(
            triangles.len() <= i32::MAX as usize / 3,
            "too many triangles"
        );
        let corners = Corners::of(vertices, triangles, meter)?;
        let mut links = Links::of(&corners, meter)?;
        links.add_edge_rows(&corners, meter)?;
        let edges = links.edges_of_several_fans(&corners);
        drop(corners);
        meter.detour(edges.len())?;
        let mut mesh = Self {
            store: S::from_triangles(triangles, &links.opposites),
            outgoing: links.outgoing,
            edge_rows: links.edge_rows,
            fan_rows: SideTable::default(),
            live_faces: triangles.len(),
            live_vertices: links.settled,
        };
        drop(links.opposites);
        meter.work(triangles.len())?;
        mesh.add_fans(&edges, meter)?;
        Ok(mesh)
    }

    /// Adds the fans that these edges, ascending, lie in.
    fn add_fans(&mut self, edges: &[u32], meter: &mut Meter) -> progress::Result<()> {
        if edges.is_empty() {
            return Ok(());
        }
        let mut seen = vec![false; self.store.slots()];
        for e in edges.iter().map(|&e| EdgeId::new(e as usize)) {
            if seen[e.index()] {
                continue;
            }
            let start = self.fan_start(e);
            let mut around = 0;
            for e in self.fan(start) {
                seen[e.index()] = true;
                around += 1;
            }
            self.add_fan(self.tail(e), start);
            meter.detour(2 * around)?;
        }
        self.fan_rows.sort_all();
        Ok(())
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

/// The work that building takes, per triangle.
pub(crate) const UNITS: usize = 5;

/// The corners of each vertex, ascending.
///
/// Corner 3i+k of triangle i is the directed edge that goes out there.
struct Corners {
    list: Vec<Corner>,
    /// Where the corners of each vertex end in the list; they begin where those before end.
    ends: Vec<u32>,
}

/// A corner as its vertex v sees it.
///
/// ```text
///     x ──> v ──out──> y      the edge that comes in from x is the one before `out` in the face
/// ```
#[derive(Clone, Copy, Default)]
struct Corner {
    out: u32,
    x: u32,
    y: u32,
}

impl Corner {
    /// The edge that comes in.
    #[inline(always)]
    fn before(self) -> u32 {
        if self.out.is_multiple_of(3) {
            self.out + 2
        } else {
            self.out - 1
        }
    }
}

impl Corners {
    /// Sorts the corners by vertex, counting.
    fn of(vertices: usize, triangles: &[[u32; 3]], meter: &mut Meter) -> progress::Result<Self> {
        let mut ends = vec![0u32; vertices];
        let mut are_proper = true;
        for block in triangles.chunks(BLOCK) {
            for t in block {
                are_proper &= (t[0] != t[1]) & (t[1] != t[2]) & (t[2] != t[0]);
                for &v in t {
                    ends[v as usize] += 1;
                }
            }
            meter.work(block.len())?;
        }
        assert!(are_proper, "a triangle needs three different vertices");
        let mut begin = 0;
        for end in &mut ends {
            begin += std::mem::replace(end, begin);
        }
        // Filling moves each begin to its end.
        let mut list = vec![Corner::default(); 3 * triangles.len()];
        let mut first = 0;
        for block in triangles.chunks(BLOCK) {
            for &[a, b, c] in block {
                for (k, v, x, y) in [(0, a, c, b), (1, b, a, c), (2, c, b, a)] {
                    let end = &mut ends[v as usize];
                    list[*end as usize] = Corner {
                        out: first + k,
                        x,
                        y,
                    };
                    *end += 1;
                }
                first += 3;
            }
            meter.work(block.len())?;
        }
        Ok(Self { list, ends })
    }

    fn of_vertex(&self, v: u32) -> &[Corner] {
        let begin = v.checked_sub(1).map_or(0, |v| self.ends[v as usize]);
        &self.list[begin as usize..self.ends[v as usize] as usize]
    }

    /// The number of corners at the busiest vertex.
    fn most(&self) -> usize {
        let counts = self.ends.windows(2).map(|ends| ends[1] - ends[0]);
        let first = self.ends.first().copied();
        counts.chain(first).max().unwrap_or(0) as usize
    }
}

/// The words of all links, and what is left to do about them.
struct Links {
    opposites: Vec<OppositeWord>,
    outgoing: Vec<OutgoingWord>,
    edge_rows: SideTable,
    /// The number of vertices whose outgoing edge is found.
    settled: usize,
    /// The vertices that have corners and several fans, or fans that are not found yet.
    unsettled: Vec<u32>,
    /// The smaller end of every edge that is not manifold, some more than once.
    crowded: Vec<u32>,
}

impl Links {
    /// Pairs opposites vertex by vertex, and finds the fan of each vertex that has only one.
    ///
    /// ```text
    ///     x ──in──> v ──out──> y      of each corner of v: the edge that comes in, the one that goes
    ///                                 out; behind it in its fan comes the corner whose `out` is the
    ///                                 opposite of its `in`
    /// ```
    ///
    /// Each edge comes in at one vertex, and finds there the edge that goes out to where it comes
    /// from. An edge that is not manifold has two that go out to the same vertex: what is found at
    /// its ends is wrong, and its smaller end crowded.
    fn of(corners: &Corners, meter: &mut Meter) -> progress::Result<Self> {
        let Corners { list, ends } = corners;
        let mut links = Self {
            opposites: vec![OppositeWord::BOUNDARY; list.len()],
            outgoing: vec![Outgoing::None.into(); ends.len()],
            edge_rows: SideTable::default(),
            settled: 0,
            unsettled: Vec::new(),
            crowded: Vec::new(),
        };
        // Where in the list the corner is whose edge goes out to a vertex, counted from 1: what is
        // no greater than where the list of a vertex begins was left by a vertex before it.
        let mut going_to = vec![0u32; ends.len()];
        let mut behind = vec![0u32; corners.most()];
        let mut begin = 0;
        for (v, &end) in (0..).zip(ends) {
            let outs = &list[begin as usize..end as usize];
            let behind = &mut behind[..outs.len()];
            for (place, corner) in (begin + 1..).zip(outs) {
                if std::mem::replace(&mut going_to[corner.y as usize], place) > begin {
                    links.crowded.push(v.min(corner.y));
                }
            }
            let mut paired = 0;
            for (behind, corner) in behind.iter_mut().zip(outs) {
                *behind = going_to[corner.x as usize].wrapping_sub(begin + 1);
                if let Some(mate) = outs.get(*behind as usize) {
                    let mate = EdgeId::new(mate.out as usize);
                    links.opposites[corner.before() as usize] = Opposite::Edge(mate).into();
                    paired += 1;
                }
            }
            let first = if paired == outs.len() {
                Some(0)
            } else {
                close_open_fan(behind)
            };
            match first {
                Some(first) if is_one_cycle(behind, first) => {
                    let start = EdgeId::new(outs[first].out as usize);
                    links.outgoing[v as usize] = Outgoing::Fan(start).into();
                    links.settled += 1;
                }
                _ if outs.is_empty() => {}
                _ => links.unsettled.push(v),
            }
            begin = end;
            // About two triangles a vertex, each two units.
            if v as usize % BLOCK == BLOCK - 1 {
                meter.work(4 * BLOCK)?;
            }
        }
        Ok(links)
    }

    /// Gives every edge that is not manifold its row, in the order of their smaller ends, then of
    /// their larger ends; unsettles both.
    fn add_edge_rows(&mut self, corners: &Corners, meter: &mut Meter) -> progress::Result<()> {
        self.crowded.sort_unstable();
        self.crowded.dedup();
        let mut sides: Vec<(u32, bool, EdgeId)> = Vec::new();
        for &v in &self.crowded {
            sides.clear();
            for c in corners.of_vertex(v) {
                sides.push((c.x, false, EdgeId::new(c.before() as usize)));
                sides.push((c.y, true, EdgeId::new(c.out as usize)));
            }
            sides.sort_unstable();
            meter.detour(sides.len())?;
            for edge in sides.chunk_by(|a, b| a.0 == b.0) {
                let is_manifold = match *edge {
                    [_] => true,
                    [(_, a, _), (_, b, _)] => a != b,
                    _ => false,
                };
                let x = edge[0].0;
                if is_manifold || x < v {
                    continue;
                }
                let row = edge.iter().map(|&(.., e)| e).collect();
                let row = Opposite::NonManifold(self.edge_rows.insert(row));
                for (.., e) in edge {
                    self.opposites[e.index()] = row.into();
                }
                for end in [v, x] {
                    let outgoing = &mut self.outgoing[end as usize];
                    self.settled -= usize::from(outgoing.decode() != Outgoing::None);
                    *outgoing = Outgoing::None.into();
                    self.unsettled.push(end);
                }
            }
        }
        Ok(())
    }

    /// The edges that leave unsettled vertices, ascending.
    fn edges_of_several_fans(&mut self, corners: &Corners) -> Vec<u32> {
        self.unsettled.sort_unstable();
        self.unsettled.dedup();
        let of_all = self.unsettled.iter().flat_map(|&v| corners.of_vertex(v));
        let mut edges: Vec<u32> = of_all.map(|corner| corner.out).collect();
        edges.sort_unstable();
        edges
    }
}

/// Puts the first corner of the only open fan behind its last, and returns the first; nothing where
/// several fans are open.
///
/// `behind` names no corner behind the last of an open fan.
fn close_open_fan(behind: &mut [u32]) -> Option<usize> {
    let mut last = None;
    // What all corners but those behind another add up to.
    let mut first = 0u32;
    for (i, &next) in (0..).zip(&*behind) {
        first = first.wrapping_add(i);
        if (next as usize) < behind.len() {
            first = first.wrapping_sub(next);
        } else if last.replace(i).is_some() {
            return None;
        }
    }
    behind[last? as usize] = first;
    Some(first as usize)
}

/// Whether all corners follow each other on one cycle through `first`.
fn is_one_cycle(behind: &[u32], first: usize) -> bool {
    // As many steps as there are corners, whatever is found: a loop that ends where the walk does
    // would have the processor wait for the walk.
    let (mut at, mut returns) = (first, 0);
    for _ in behind {
        at = behind.get(at).map_or(at, |&next| next as usize);
        returns += u32::from(at == first);
    }
    returns == 1 && at == first
}
