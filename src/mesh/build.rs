//! Builds connectivity from triangles in linear time: pairs opposites, finds the fans, fills the
//! side tables.

use super::link::{Opposite, Outgoing};
use super::{EdgeId, EdgeStore, Mesh, SideTable, VertexId};

impl<S: EdgeStore> Mesh<S> {
    /// The connectivity of these triangles over `vertices` vertices.
    ///
    /// Linear time, but for a logarithm in the number of edges at the busiest vertex. Needs 13
    /// bytes a triangle and 4 a vertex beside the mesh while it runs.
    ///
    /// # Panics
    /// Where a triangle names a vertex that is not there or one vertex twice, or 3m exceeds 2³¹−1.
    /// Duplicate triangles are allowed: their edges are non-manifold.
    pub fn from_triangles(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        assert!(
            triangles.len() <= i32::MAX as usize / 3,
            "too many triangles"
        );
        let proper = |t: &[u32; 3]| {
            t.iter().all(|&v| (v as usize) < vertices)
                && t[0] != t[1]
                && t[1] != t[2]
                && t[2] != t[0]
        };
        assert!(
            triangles.iter().all(proper),
            "a triangle needs three vertices of the mesh"
        );
        let mut mesh = Self {
            store: S::from_triangles(triangles),
            outgoing: vec![Outgoing::None.into(); vertices],
            edge_rows: SideTable::default(),
            fan_rows: SideTable::default(),
            live_faces: triangles.len(),
            live_vertices: 0,
        };
        mesh.pair_opposites(triangles);
        mesh.find_fans();
        mesh
    }

    fn pair_opposites(&mut self, triangles: &[[u32; 3]]) {
        for_each_edge(self.vertex_slots(), triangles, |edge| match *edge {
            [_] => {}
            [a, b] if self.tail(a) == self.head(b) => {
                self.set_opposite(a, Opposite::Edge(b));
                self.set_opposite(b, Opposite::Edge(a));
            }
            _ => {
                let row = Opposite::NonManifold(self.edge_rows.insert(edge.to_vec()));
                for &e in edge {
                    self.set_opposite(e, row);
                }
            }
        });
    }

    fn find_fans(&mut self) {
        let mut seen = vec![false; self.store.slots()];
        for e in (0..self.store.slots()).map(EdgeId::new) {
            if seen[e.index()] || self.store.opposite_word(e).is_dead() {
                continue;
            }
            let start = self.fan_start(e);
            for e in self.fan(start) {
                seen[e.index()] = true;
            }
            self.add_fan(self.tail(e), start);
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

/// Calls `visit` once for every edge with the ids of all directed edges along it, ascending.
///
/// Directed edge 3i+k runs from corner k of triangle i to corner k+1. A counting sort by the
/// smaller end, then a sort by the other end inside each (small) bucket.
pub(super) fn for_each_edge(
    vertices: usize,
    triangles: &[[u32; 3]],
    mut visit: impl FnMut(&[EdgeId]),
) {
    let ends = |e: usize| {
        let t = &triangles[e / 3];
        let (a, b) = (t[e % 3], t[(e + 1) % 3]);
        (a.min(b) as usize, a.max(b))
    };
    let edges = 3 * triangles.len();
    let mut end_of_bucket = vec![0u32; vertices + 1];
    for e in 0..edges {
        end_of_bucket[ends(e).0 + 1] += 1;
    }
    for v in 0..vertices {
        end_of_bucket[v + 1] += end_of_bucket[v];
    }
    // Filling moves each bucket's begin to its end, so that afterwards entry v is the end of v.
    let mut bucketed = vec![0u32; edges];
    for e in 0..edges {
        let slot = &mut end_of_bucket[ends(e).0];
        bucketed[*slot as usize] = e as u32;
        *slot += 1;
    }
    let mut bucket: Vec<(u32, u32)> = Vec::new();
    let mut group: Vec<EdgeId> = Vec::new();
    let mut begin = 0;
    for &end in &end_of_bucket[..vertices] {
        let end = end as usize;
        bucket.clear();
        bucket.extend(
            bucketed[begin..end]
                .iter()
                .map(|&e| (ends(e as usize).1, e)),
        );
        bucket.sort_unstable();
        for same_edge in bucket.chunk_by(|a, b| a.0 == b.0) {
            group.clear();
            group.extend(same_edge.iter().map(|&(_, e)| EdgeId::new(e as usize)));
            visit(&group);
        }
        begin = end;
    }
}
