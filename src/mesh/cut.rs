//! Non-manifold to manifold: the cut along edges of three faces or more, and at vertices of several
//! fans (Guéziec, Taubin, Lazarus, Horn 1998, *Converting sets of polygons to manifold surfaces by
//! cutting and stitching*).

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use smallvec::SmallVec;

use super::{EdgeId, EdgeStore, Mesh, VertexId};

/// How many partners a face at an edge is tried with before it is left alone: hardly one is refused,
/// and an edge may have 100 000 faces.
const PATIENCE: usize = 32;

/// Which corners get a copy of their vertex.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Cut {
    /// The vertex that each copy is one of, ascending. The copies are numbered on from the vertex
    /// slots.
    pub copies: Vec<VertexId>,
    /// The corners that go over to a copy, as the directed edges that leave there, and the copy.
    pub corners: Vec<(EdgeId, VertexId)>,
}

impl<S: EdgeStore> Mesh<S> {
    /// The cut that leaves no edge of three faces or more and no vertex of several fans, with few
    /// copies of vertices.
    ///
    /// ```text
    ///      \ | /              \   | /
    ///       \|/                \  |/        four faces along an edge, seen from its end: two pairs
    ///     ───v───      →     ───v v'        stay, each with its own copy of both ends
    /// ```
    ///
    /// Edges of two faces stay whole, also where no orientation makes the two agree. At each other
    /// edge faces are paired that run along it opposite ways, as long as that saves a copy and
    /// leaves no edge between two copies with three faces; first those whose sheets are joined
    /// at an end of the edge already, so that along a curve the same two sheets stay together.
    /// Then each vertex has one copy for each fan of its faces, of which that with the first
    /// corner keeps the vertex itself.
    ///
    /// Given the pairs, no fewer copies are possible: one that served two fans would be
    /// non-manifold. And no further pair is possible, among the first 32 partners of each face: the
    /// cut is minimal. The least number over all choices of pairs is not asked for. It would change
    /// partners along a curve, so that a vertex there holds all sheets together, for the price of a
    /// handle; of two neighbours only one can, so that it is a vertex cover of the curves, which is
    /// hard to find where they branch. Of tiny random complexes, crowded all over, 88 % get the
    /// least number, and all together 2.2 % more
    /// (`tiny_complexes_get_hardly_more_than_the_fewest_copies`).
    ///
    /// Linear time, but for logarithms in what is not manifold.
    pub fn cut(&self) -> Cut {
        let singular: Vec<VertexId> = self
            .vertices()
            .filter(|&v| self.is_non_manifold_vertex(v))
            .collect();
        if singular.is_empty() {
            return Cut::default();
        }
        let mut sheets = Sheets::of(self, &singular);
        sheets.pair_faces();
        sheets.cut(&singular)
    }
}

/// Corners that stay together, and the crowded edges (of three faces or more) that each such class
/// of corners touches.
struct Sheets<'a, S> {
    mesh: &'a Mesh<S>,
    /// A forest of corners; a corner has the number of the directed edge that leaves there.
    parent: Vec<u32>,
    /// Of each class's root: the directed edges of crowded edges that end at its vertex, each behind
    /// the [name](Mesh::canonical) of its edge.
    crowded: BTreeMap<usize, BTreeSet<(EdgeId, EdgeId)>>,
}

impl<'a, S: EdgeStore> Sheets<'a, S> {
    /// The fans of these vertices; those that meet at an edge of two faces that run the same way are
    /// one.
    fn of(mesh: &'a Mesh<S>, singular: &[VertexId]) -> Self {
        let mut sheets = Self {
            mesh,
            parent: (0..mesh.store.slots() as u32).collect(),
            crowded: BTreeMap::new(),
        };
        for &v in singular {
            for start in mesh.fans(v) {
                for e in mesh.fan(start) {
                    sheets.parent[e.index()] = start.index() as u32;
                }
            }
        }
        for row in mesh.edge_rows.rows() {
            if let [a, b] = *row {
                let [next_a, next_b] = [a, b].map(|e| mesh.next(e));
                for (x, y) in [(a, b), (next_a, next_b)] {
                    let (x, y) = (sheets.class(x), sheets.class(y));
                    sheets.parent[x.max(y)] = x.min(y) as u32;
                }
            }
        }
        for (name, e) in sheets.crowded_edges() {
            for corner in [e, mesh.next(e)] {
                let class = sheets.class(corner);
                sheets.crowded.entry(class).or_default().insert((name, e));
            }
        }
        sheets
    }

    /// The directed edges of all crowded edges, each with the name of its edge.
    fn crowded_edges(&self) -> Vec<(EdgeId, EdgeId)> {
        let rows = self.mesh.edge_rows.rows().filter(|row| row.len() > 2);
        let edges = rows.flat_map(|row| row.iter().map(|&e| (row[0], e)));
        edges.collect()
    }

    /// The class of a corner, by its root.
    fn class(&mut self, corner: EdgeId) -> usize {
        let mut i = corner.index();
        while self.parent[i] as usize != i {
            let up = self.parent[i] as usize;
            self.parent[i] = self.parent[up];
            i = up;
        }
        i
    }

    /// The class of the corner that `e`'s face has at an end of `e`.
    fn class_at(&mut self, e: EdgeId, v: VertexId) -> usize {
        let is_tail = self.mesh.tail(e) == v;
        self.class(if is_tail { e } else { self.mesh.next(e) })
    }

    /// Pairs faces at every crowded edge, along the curves that these edges form.
    fn pair_faces(&mut self) {
        let mut edges: Vec<EdgeId> = self.crowded_edges().iter().map(|&(name, _)| name).collect();
        edges.sort_unstable();
        edges.dedup();
        let mut at_vertex: Vec<(VertexId, EdgeId)> = edges
            .iter()
            .flat_map(|&e| self.mesh.edge_vertices(e).map(|v| (v, e)))
            .collect();
        at_vertex.sort_unstable();
        let mut is_waiting: BTreeSet<EdgeId> = edges.iter().copied().collect();
        let mut seen: BTreeSet<VertexId> = BTreeSet::new();
        let mut queue: VecDeque<EdgeId> = VecDeque::new();
        for first in edges {
            if is_waiting.remove(&first) {
                queue.push_back(first);
            }
            while let Some(e) = queue.pop_front() {
                self.pair_faces_at(e);
                for v in self.mesh.edge_vertices(e) {
                    if seen.insert(v) {
                        let begin = at_vertex.partition_point(|&(x, _)| x < v);
                        let here = at_vertex[begin..].iter().take_while(|&&(x, _)| x == v);
                        queue.extend(here.map(|&(_, e)| e).filter(|e| is_waiting.remove(e)));
                    }
                }
            }
        }
    }

    /// Pairs faces at one edge: those that hang together at an end, then any.
    fn pair_faces_at(&mut self, edge: EdgeId) {
        let mesh = self.mesh;
        let mut alone: Vec<EdgeId> = mesh.edge_star(edge).to_vec();
        for v in mesh.edge_vertices(edge) {
            let mut classes: Vec<(usize, EdgeId)> =
                alone.iter().map(|&e| (self.class_at(e, v), e)).collect();
            classes.sort_unstable();
            let mut paired: SmallVec<[EdgeId; 8]> = SmallVec::new();
            for ends in classes.chunk_by(|a, b| a.0 == b.0) {
                // A sheet comes to the edge at its two ends at most.
                if let [(_, a), (_, b)] = *ends
                    && mesh.tail(a) == mesh.head(b)
                    && self.join(a, b)
                {
                    paired.extend([a, b]);
                }
            }
            paired.sort_unstable();
            alone.retain(|e| paired.binary_search(e).is_err());
        }
        let tail = mesh.tail(edge);
        let (along, mut against): (Vec<EdgeId>, Vec<EdgeId>) =
            alone.into_iter().partition(|&e| mesh.tail(e) == tail);
        for a in along {
            let mut partners = against.iter().take(PATIENCE);
            if let Some(at) = partners.position(|&b| self.join(a, b)) {
                against.remove(at);
            }
        }
    }

    /// Keeps two faces at an edge together at both of its ends, unless an edge between two classes
    /// would have three faces.
    fn join(&mut self, a: EdgeId, b: EdgeId) -> bool {
        let [next_a, next_b] = [a, b].map(|e| self.mesh.next(e));
        let mut merges: SmallVec<[[usize; 2]; 2]> = SmallVec::new();
        for (x, y) in [(a, next_b), (next_a, b)] {
            let pair = [self.class(x), self.class(y)];
            if pair[0] != pair[1] {
                let size = |class: &usize| self.crowded.get(class).map_or(0, BTreeSet::len);
                // The smaller one into the larger, so that no entry moves often.
                let [x, y] = pair;
                merges.push(if size(&x) < size(&y) { [x, y] } else { [y, x] });
            }
        }
        if merges.iter().any(|merge| self.would_crowd(*merge, &merges)) {
            return false;
        }
        for [from, to] in merges {
            self.parent[from] = to as u32;
            let moved = self.crowded.remove(&from).unwrap_or_default();
            self.crowded.entry(to).or_default().extend(moved);
        }
        true
    }

    /// Whether a class that takes another in would have an edge of three faces, after all merges.
    fn would_crowd(&mut self, [from, to]: [usize; 2], merges: &[[usize; 2]]) -> bool {
        let merged = |class: usize| {
            let merge = merges.iter().find(|merge| merge[0] == class);
            merge.map_or(class, |merge| merge[1])
        };
        let entries = |class: &usize| self.crowded.get(class).into_iter().flatten();
        let mut names: Vec<EdgeId> = entries(&from).map(|&(name, _)| name).collect();
        names.dedup();
        for name in names {
            let [v, w] = self.mesh.edge_vertices(name);
            let range = (name, EdgeId::new(0))..=(name, EdgeId::new(i32::MAX as usize));
            let sets = [from, to].map(|class| self.crowded.get(&class));
            let faces: Vec<EdgeId> = sets
                .into_iter()
                .flatten()
                .flat_map(|set| set.range(range.clone()))
                .map(|&(_, e)| e)
                .collect();
            let mut ends: Vec<[usize; 2]> = Vec::with_capacity(faces.len());
            for e in faces {
                ends.push([v, w].map(|v| merged(self.class_at(e, v))));
            }
            ends.sort_unstable();
            if ends.chunk_by(|a, b| a == b).any(|same| same.len() > 2) {
                return true;
            }
        }
        false
    }

    /// A copy for each class of corners at a vertex but the first.
    fn cut(mut self, singular: &[VertexId]) -> Cut {
        let mut cut = Cut::default();
        for &v in singular {
            let mut corners: Vec<EdgeId> = self.mesh.outgoing_edges(v).collect();
            corners.sort_unstable();
            let mut copies: BTreeMap<usize, Option<VertexId>> = BTreeMap::new();
            for e in corners {
                let class = self.class(e);
                let is_first = copies.is_empty();
                let copy = *copies.entry(class).or_insert_with(|| {
                    (!is_first).then(|| {
                        cut.copies.push(v);
                        VertexId::new(self.mesh.vertex_slots() + cut.copies.len() - 1)
                    })
                });
                cut.corners.extend(copy.map(|copy| (e, copy)));
            }
        }
        cut
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::random_complex;
    use super::*;
    use crate::for_each_tier;
    use crate::shapes;

    /// The triangles after the cut, and the number of copies.
    fn cut_of<S: EdgeStore>(vertices: usize, triangles: &[[u32; 3]]) -> (Vec<[u32; 3]>, usize) {
        let cut = Mesh::<S>::from_triangles(vertices, triangles).cut();
        let mut triangles = triangles.to_vec();
        for (e, copy) in cut.corners {
            let corner = &mut triangles[e.face().index()][e.index() % 3];
            assert_eq!(cut.copies[copy.index() - vertices].index() as u32, *corner);
            *corner = copy.index() as u32;
        }
        (triangles, cut.copies.len())
    }

    /// Whether no edge has three faces and every vertex one fan, fans joined across edges of two
    /// faces whichever way these run.
    fn is_manifold(triangles: &[[u32; 3]]) -> bool {
        let mut links: BTreeMap<u32, Vec<[u32; 2]>> = BTreeMap::new();
        for &[a, b, c] in triangles {
            for (v, link) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
                links.entry(v).or_default().push(link);
            }
        }
        links.values().all(|link| {
            let degree = |v: u32| link.iter().flatten().filter(|&&x| x == v).count();
            let mut reached = BTreeSet::from([link[0][0]]);
            for _ in link {
                for edge in link {
                    if edge.iter().any(|v| reached.contains(v)) {
                        reached.extend(edge);
                    }
                }
            }
            let mut ends = link.iter().flatten();
            ends.all(|&v| degree(v) <= 2 && reached.contains(&v))
        })
    }

    fn renamed(triangles: &[[u32; 3]], from: u32, to: u32) -> Vec<[u32; 3]> {
        let rename = |v: u32| if v == from { to } else { v };
        triangles.iter().map(|t| t.map(rename)).collect()
    }

    /// The named shapes: a copy for each fan but the first, pairs where the faces agree.
    fn named_shapes_are_cut_as_expected<S: EdgeStore>() {
        // Two sheets that cross: four faces at each edge, of which two pairs agree.
        let mut cross = vec![];
        for [a, b] in [[0, 1], [1, 2], [2, 3]] {
            for (side, turned) in [(4, false), (8, true), (12, false), (16, true)] {
                let (c, d) = (a + side, b + side);
                let faces = if turned {
                    [[b, a, d], [a, c, d]]
                } else {
                    [[a, b, d], [a, d, c]]
                };
                cross.extend(faces);
            }
        }
        for (name, triangles, copies) in [
            ("sphere", shapes::icosphere(1).1, 0),
            ("bow tie", shapes::bow_tie().1, 1),
            // All fins run along the edge the same way: nothing to pair.
            ("three fins", shapes::three_fins(3).1, 8),
            // Manifold, though not orientable.
            ("Möbius strip", shapes::moebius(12).1, 0),
            ("crossing sheets", cross, 4),
        ] {
            let vertices = triangles
                .iter()
                .flatten()
                .max()
                .map_or(0, |&v| v as usize + 1);
            let (after, count) = cut_of::<S>(vertices, &triangles);
            assert_eq!(count, copies, "{name}");
            assert!(is_manifold(&after), "{name}");
        }
    }

    /// Random complexes: manifold after the cut; no two copies of a vertex can be one again, nor two
    /// faces that run opposite ways be joined at an edge.
    fn no_copy_can_be_spared<S: EdgeStore>() {
        let mut copied = 0;
        for seed in 0..400 {
            let (vertices, triangles) = random_complex(seed);
            let (after, copies) = cut_of::<S>(vertices, &triangles);
            assert!(is_manifold(&after), "seed {seed}: {triangles:?}");
            copied += copies;
            let count = vertices + copies;
            let mut original: Vec<u32> = (0..count as u32).collect();
            for (t, o) in after.iter().flatten().zip(triangles.iter().flatten()) {
                original[*t as usize] = *o;
            }
            let sides = |i: usize| [0, 1, 2].map(|k| [after[i][k], after[i][(k + 1) % 3]]);
            for (i, j) in (0..after.len()).flat_map(|i| (0..i).map(move |j| (i, j))) {
                for ([a, b], [c, d]) in sides(i).into_iter().flat_map(|s| sides(j).map(|t| (s, t)))
                {
                    let ends = |v: u32| original[v as usize];
                    if (a, b) != (d, c) && (ends(a), ends(b)) == (ends(d), ends(c)) {
                        let joined = renamed(&renamed(&after, d, a), c, b);
                        assert!(!is_manifold(&joined), "seed {seed}: {a} {b} and {c} {d}");
                    }
                }
            }
        }
        assert!(copied > 1000, "{copied}");
    }

    /// The fewest copies over all ways to pair faces at the edges, by trying all.
    fn fewest_copies(vertices: usize, triangles: &[[u32; 3]]) -> Option<usize> {
        let mesh = Mesh::<super::super::Small>::from_triangles(vertices, triangles);
        let singular: Vec<_> = mesh
            .vertices()
            .filter(|&v| mesh.is_non_manifold_vertex(v))
            .collect();
        let mut names: Vec<EdgeId> = Sheets::of(&mesh, &singular)
            .crowded_edges()
            .iter()
            .map(|&(name, _)| name)
            .collect();
        names.dedup();
        // Of each edge the ways to pair its faces.
        let mut ways: Vec<Vec<Vec<(EdgeId, EdgeId)>>> = Vec::new();
        let mut product = 1usize;
        for name in names {
            let tail = mesh.tail(name);
            let (along, against): (Vec<_>, Vec<_>) = mesh
                .edge_star(name)
                .into_iter()
                .partition(|&e| mesh.tail(e) == tail);
            let mut here: Vec<Vec<(EdgeId, EdgeId)>> = vec![vec![]];
            for a in along {
                for way in here.clone() {
                    for &b in against.iter().filter(|b| way.iter().all(|(_, c)| c != *b)) {
                        let mut way = way.clone();
                        way.push((a, b));
                        here.push(way);
                    }
                }
            }
            product = product.saturating_mul(here.len());
            ways.push(here);
        }
        if product > 1_000 {
            return None;
        }
        let fewest = (0..product).filter_map(|mut choice| {
            let mut sheets = Sheets::of(&mesh, &singular);
            for here in &ways {
                for &(a, b) in &here[choice % here.len()] {
                    for (x, y) in [(a, mesh.next(b)), (mesh.next(a), b)] {
                        let (x, y) = (sheets.class(x), sheets.class(y));
                        sheets.parent[x] = y as u32;
                    }
                }
                choice /= here.len();
            }
            let cut = sheets.cut(&singular);
            let mut after = triangles.to_vec();
            for &(e, copy) in &cut.corners {
                after[e.face().index()][e.index() % 3] = copy.index() as u32;
            }
            is_manifold(&after).then_some(cut.copies.len())
        });
        fewest.min()
    }

    /// Tiny complexes, against every way to pair: seldom more copies than the fewest.
    #[test]
    fn tiny_complexes_get_hardly_more_than_the_fewest_copies() {
        let (mut cases, mut equal, mut ours, mut fewest) = (0, 0, 0, 0);
        for seed in 0..1500 {
            let (vertices, mut triangles) = random_complex(seed);
            triangles.truncate(9);
            let (_, copies) = cut_of::<super::super::Small>(vertices, &triangles);
            let Some(least) = fewest_copies(vertices, &triangles).filter(|_| copies > 0) else {
                continue;
            };
            assert!(copies >= least, "seed {seed}: brute force misses a way");
            cases += 1;
            equal += usize::from(copies == least);
            ours += copies;
            fewest += least;
        }
        println!("{equal} of {cases} cut with the fewest copies; {ours} copies, {fewest} at least");
        assert!(cases > 1000, "{cases}");
        assert!(equal * 100 > cases * 85, "{equal} of {cases}");
        assert!(ours * 100 < fewest * 104, "{ours} and {fewest}");
    }

    /// 20 000 pages on one edge, every other one turned: no quadratic time, and pairs.
    fn a_thick_book_is_cut_quickly<S: EdgeStore>() {
        let n = 20_000;
        let page = |i: u32| {
            if i.is_multiple_of(2) {
                [0, 1, 2 + i]
            } else {
                [1, 0, 2 + i]
            }
        };
        let book: Vec<[u32; 3]> = (0..n).map(page).collect();
        let (after, copies) = cut_of::<S>(n as usize + 2, &book);
        assert_eq!(copies, n as usize - 2);
        assert!(Mesh::<S>::from_triangles(n as usize + 2 + copies, &after).cut() == Cut::default());
    }

    for_each_tier!(
        named_shapes_are_cut_as_expected,
        no_copy_can_be_spared,
        a_thick_book_is_cut_quickly,
    );
}
