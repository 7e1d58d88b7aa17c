//! Operations at random, against a list of triangles; collapses undone.

use std::collections::{BTreeSet, VecDeque};

use super::tests::{Random, live_edges, named_shapes, random_complex, random_surface};
use super::*;
use crate::for_each_tier;
use crate::shapes;

/// What can be done to a mesh, in the order of the counts.
const OPERATIONS: [&str; 7] = [
    "flip",
    "edge split",
    "face split",
    "face added",
    "face removed",
    "collapse",
    "vertex split",
];

/// A mesh, the triangles that it should have, and the slots that are free, the oldest first.
struct Bench<S> {
    mesh: Mesh<S>,
    model: BTreeSet<[u32; 3]>,
    free_faces: VecDeque<FaceId>,
    free_vertices: VecDeque<VertexId>,
    /// Splits that undo former collapses, as long as nothing else happened there.
    records: Vec<VertexSplit>,
    done: [usize; OPERATIONS.len()],
    /// The same, of those at an edge, a vertex or a face beside an edge that is not manifold.
    done_at_singular: [usize; OPERATIONS.len()],
    grown: usize,
}

/// A triangle from its smallest vertex on.
fn turned(t: [u32; 3]) -> [u32; 3] {
    let [a, b, c] = t;
    [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap()
}

fn numbers(vertices: [VertexId; 3]) -> [u32; 3] {
    vertices.map(|v| v.index() as u32)
}

impl<S: EdgeStore> Bench<S> {
    fn new(vertices: usize, triangles: &[[u32; 3]]) -> Self {
        let mesh = Mesh::from_triangles(vertices, triangles);
        Self {
            model: triangles.iter().map(|&t| turned(t)).collect(),
            free_vertices: (0..vertices)
                .map(VertexId::new)
                .filter(|&v| mesh.outgoing(v) == Outgoing::None)
                .collect(),
            mesh,
            free_faces: VecDeque::new(),
            records: Vec::new(),
            done: [0; OPERATIONS.len()],
            done_at_singular: [0; OPERATIONS.len()],
            grown: 0,
        }
    }

    /// Slots for new faces: free ones, or the mesh grows.
    fn faces(&mut self, count: usize) -> Vec<FaceId> {
        while self.free_faces.len() < count {
            self.free_faces.push_back(self.mesh.new_face().unwrap());
            self.grown += 1;
        }
        self.free_faces.drain(..count).collect()
    }

    fn vertex(&mut self) -> VertexId {
        if self.free_vertices.is_empty() {
            self.free_vertices
                .push_back(self.mesh.new_vertex().unwrap());
            self.grown += 1;
        }
        self.free_vertices.pop_front().unwrap()
    }

    /// Any edge, from either side; every other time one of three faces or more, if there is one.
    fn edge(&self, random: &mut Random) -> Option<EdgeId> {
        let mut edges = live_edges(&self.mesh);
        let is_crowded = |e: &EdgeId| self.mesh.edge_star(*e).len() > 2;
        if random.below(2) == 0 && edges.iter().any(is_crowded) {
            edges.retain(is_crowded);
        }
        let e = *edges.get(random.below(edges.len().max(1)))?;
        let star = self.mesh.edge_star(e);
        Some(star[random.below(star.len())])
    }

    fn is_singular(&self, v: VertexId) -> bool {
        self.mesh.is_non_manifold_vertex(v)
    }

    /// Replaces triangles of the model by others.
    fn replace(&mut self, old: &[[u32; 3]], new: &[[u32; 3]]) {
        for &t in old {
            assert!(self.model.remove(&turned(t)), "{t:?} is not there");
        }
        for &t in new {
            assert!(self.model.insert(turned(t)), "{t:?} is there");
        }
    }

    /// Does one operation where it is allowed; says whether, and whether something was singular.
    fn try_one(&mut self, operation: usize, random: &mut Random) -> Option<bool> {
        match OPERATIONS[operation] {
            "flip" => self.flip(random),
            "edge split" => self.split_edge(random),
            "face split" => self.split_face(random),
            "face added" => self.add_face(random),
            "face removed" => self.remove_face(random),
            "collapse" => self.collapse(random),
            "vertex split" => self.split_vertex(random),
            other => unreachable!("{other}"),
        }
    }

    fn flip(&mut self, random: &mut Random) -> Option<bool> {
        let e = self.edge(random)?;
        // Not only at the edge itself, which cannot be flipped where it is crowded.
        let e = [e, self.mesh.next(e), self.mesh.prev(e)][random.below(3)];
        if !self.mesh.flip_condition(e) {
            return None;
        }
        let o = self.mesh.mate(e)?;
        let [a, b, c] = numbers([self.mesh.tail(e), self.mesh.head(e), self.mesh.apex(e)]);
        let d = self.mesh.apex(o).index() as u32;
        let sides = [e, o].map(|e| [self.mesh.next(e), self.mesh.prev(e)]);
        let sides = sides.into_iter().flatten();
        let is_singular = sides.into_iter().any(|s| self.mesh.edge_star(s).len() > 2);
        self.mesh.flip(e);
        self.replace(&[[a, b, c], [b, a, d]], &[[d, c, a], [c, d, b]]);
        Some(is_singular)
    }

    fn split_edge(&mut self, random: &mut Random) -> Option<bool> {
        let e = self.edge(random)?;
        let star = self.mesh.edge_star(e);
        let (vertex, faces) = (self.vertex(), self.faces(star.len()));
        assert!(self.mesh.edge_split_condition(e, vertex, &faces));
        assert!(!self.mesh.edge_split_condition(e, vertex, &faces[1..]));
        let [a, b] = self.mesh.edge_vertices(e).map(|v| v.index() as u32);
        let m = vertex.index() as u32;
        self.mesh.split_edge(e, vertex, &faces);
        let at_edge = |t: &&[u32; 3]| t.contains(&a) && t.contains(&b);
        let old: Vec<_> = self.model.iter().filter(at_edge).copied().collect();
        let with = |end: u32| {
            let put = move |v: u32| if v == end { m } else { v };
            old.iter().map(move |t| t.map(put))
        };
        let new: Vec<_> = with(a).chain(with(b)).collect();
        self.replace(&old, &new);
        Some(star.len() > 2)
    }

    fn split_face(&mut self, random: &mut Random) -> Option<bool> {
        let f = self.edge(random)?.face();
        let (vertex, faces) = (self.vertex(), self.faces(2));
        let faces = [faces[0], faces[1]];
        assert!(self.mesh.face_split_condition(f, vertex, faces));
        assert!(!self.mesh.face_split_condition(f, vertex, [f, faces[1]]));
        let vertices = self.mesh.face_vertices(f);
        let is_singular = vertices.iter().any(|&v| self.is_singular(v));
        let [a, b, c] = numbers(vertices);
        let m = vertex.index() as u32;
        self.mesh.split_face(f, vertex, faces);
        self.replace(&[[a, b, c]], &[[a, b, m], [b, c, m], [c, a, m]]);
        Some(is_singular)
    }

    /// Between two boundary edges, on any three neighbours, or anywhere.
    fn add_face(&mut self, random: &mut Random) -> Option<bool> {
        let mut any = || VertexId::new(random.below(self.mesh.vertex_slots()));
        let [a, b, c] = [any(), any(), any()];
        let vertices = match random.below(8) {
            0 => [a, b, c],
            1 | 2 => {
                let ring = self.mesh.one_ring(a);
                let mut next = || ring.get(random.below(ring.len().max(1))).copied();
                [a, next()?, next()?]
            }
            _ => {
                let e = self.edge(random)?;
                let ring = self.mesh.one_ring(self.mesh.tail(e));
                let c = ring[random.below(ring.len())];
                [self.mesh.head(e), self.mesh.tail(e), c]
            }
        };
        let face = self.faces(1)[0];
        if !self.mesh.add_condition(vertices, face) {
            self.free_faces.push_front(face);
            return None;
        }
        // What already has two faces gets more of them only now and then, or all would be crowded.
        let [a, b, c] = vertices;
        let sides = [[a, b], [b, c], [c, a]].map(|[a, b]| self.mesh.find_edge(a, b));
        let is_crowded = |e: &EdgeId| self.mesh.edge_star(*e).len() > 1;
        let is_singular = sides.iter().flatten().any(is_crowded);
        if is_singular && random.below(4) > 0 {
            self.free_faces.push_front(face);
            return None;
        }
        self.mesh.add_face(vertices, face);
        assert_eq!(self.mesh.face_vertices(face), vertices);
        self.free_vertices.retain(|v| !vertices.contains(v));
        self.replace(&[], &[numbers(vertices)]);
        Some(is_singular)
    }

    fn remove_face(&mut self, random: &mut Random) -> Option<bool> {
        let f = self.edge(random)?.face();
        assert!(self.mesh.remove_condition(f));
        let vertices = self.mesh.face_vertices(f);
        let is_crowded = |e: EdgeId| self.mesh.edge_star(e).len() > 2;
        let is_singular = f.edges().into_iter().any(is_crowded);
        self.mesh.remove_face(f);
        assert!(!self.mesh.remove_condition(f));
        self.free_faces.push_back(f);
        let dead = |v: &VertexId| self.mesh.outgoing(*v) == Outgoing::None;
        self.free_vertices
            .extend(vertices.iter().filter(|v| dead(v)));
        self.replace(&[numbers(vertices)], &[]);
        Some(is_singular)
    }

    fn collapse(&mut self, random: &mut Random) -> Option<bool> {
        let e = self.edge(random)?;
        if !self.mesh.link_condition(e) {
            return None;
        }
        let split = self.mesh.split_undoing(e);
        let is_singular = self.is_singular(split.kept) || self.is_singular(split.removed);
        let collapse = self.mesh.collapse(e);
        assert!(self.mesh.vertex_split_condition(&split), "{split:?}");
        let [u, v] = [collapse.removed, collapse.kept].map(|v| v.index() as u32);
        let (mut old, mut new) = (Vec::new(), Vec::new());
        for t in self.model.iter().filter(|t| t.contains(&u)) {
            old.push(*t);
            if !t.contains(&v) {
                new.push(t.map(|x| if x == u { v } else { x }));
            }
        }
        self.replace(&old, &new);
        self.free_faces.extend(collapse.dead_faces);
        self.free_vertices.push_back(collapse.removed);
        self.records.push(split);
        Some(is_singular)
    }

    /// A collapse of before undone, or part of a fan given to a new vertex.
    fn split_vertex(&mut self, random: &mut Random) -> Option<bool> {
        let split = if random.below(2) == 0 {
            let at = random.below(self.records.len().max(1));
            (at < self.records.len()).then(|| self.records.swap_remove(at))?
        } else {
            self.some_split(random)?
        };
        if !self.mesh.vertex_split_condition(&split) {
            return None;
        }
        let [u, v] = [split.removed, split.kept].map(|v| v.index() as u32);
        let face_of = |e: &EdgeId| numbers(self.mesh.face_vertices(e.face()));
        let old: Vec<[u32; 3]> = split.corners.iter().map(face_of).collect();
        let moved = old.iter().map(|t| t.map(|x| if x == v { u } else { x }));
        let new = split.faces.iter().map(|&(_, t)| numbers(t));
        let new: Vec<[u32; 3]> = moved.chain(new).collect();
        let before = self.mesh.triangles();
        self.mesh.split_vertex(&split);
        self.replace(&old, &new);
        self.free_vertices.retain(|&v| v != split.removed);
        let is_new = |f: &FaceId| split.faces.iter().any(|(g, _)| g == f);
        self.free_faces.retain(|f| !is_new(f));

        // The collapse takes it back.
        let mut mesh = self.mesh.clone();
        let between = |&e: &EdgeId| mesh.head(e) == split.kept;
        let e = mesh.outgoing_edges(split.removed).find(between).unwrap();
        assert!(mesh.link_condition(e), "{split:?}");
        mesh.collapse(e);
        assert_eq!(mesh.triangles(), before, "{split:?}");
        Some(self.is_singular(split.kept) || self.is_singular(split.removed))
    }

    /// A run of a fan's corners, with a face at each of its ends, or at one; sometimes another fan
    /// goes over too.
    fn some_split(&mut self, random: &mut Random) -> Option<VertexSplit> {
        let kept = self.mesh.tail(self.edge(random)?);
        let starts: Vec<EdgeId> = self.mesh.fans(kept).collect();
        let start = starts[random.below(starts.len())];
        let fan: Vec<EdgeId> = self.mesh.fan(start).collect();
        let first = random.below(fan.len());
        let count = random.below(fan.len() + 1);
        let is_closed = self.mesh.mate(start).is_some();
        let last = first + count;
        if !is_closed && last > fan.len() {
            return None;
        }
        let mut corners: SmallVec<[EdgeId; 8]> =
            (first..last).map(|i| fan[i % fan.len()]).collect();
        let (vertex, faces) = (self.vertex(), self.faces(2));
        self.free_vertices.push_front(vertex);
        faces.iter().for_each(|&f| self.free_faces.push_front(f));
        let x = self.mesh.head(fan[first]);
        let y = match fan.get(last) {
            Some(&e) => self.mesh.head(e),
            None if is_closed => self.mesh.head(fan[last % fan.len()]),
            None => self.mesh.apex(fan[last - 1]),
        };
        let mut new = SmallVec::new();
        let sides = random.below(4);
        if sides != 1 {
            new.push((faces[0], [kept, x, vertex]));
        }
        if sides != 2 {
            new.push((faces[1], [y, kept, vertex]));
        }
        if starts.len() > 1 && random.below(2) == 0 {
            let other = starts[random.below(starts.len())];
            if other != start {
                corners.extend(self.mesh.fan(other));
            }
        }
        Some(VertexSplit {
            kept,
            removed: vertex,
            faces: new,
            corners,
        })
    }

    /// The mesh is what its triangles say, and these are the model's.
    fn check(&self, what: &str) {
        self.mesh
            .check()
            .unwrap_or_else(|wrong| panic!("{what}: {wrong}"));
        let triangles = self.mesh.triangles().into_iter().map(turned);
        let triangles: BTreeSet<_> = triangles.collect();
        assert_eq!(triangles, self.model, "{what}");
        assert_eq!(self.mesh.face_count(), self.model.len(), "{what}");
    }
}

/// Meshes to begin with: manifold and not, closed and open, with and without orientation.
fn beginnings() -> Vec<(usize, Vec<[u32; 3]>)> {
    let small = [
        shapes::tetrahedron(),
        shapes::grid(4, 3),
        shapes::icosphere(0),
        shapes::bow_tie(),
        shapes::three_fins(2),
        shapes::moebius(9),
        shapes::torus(5, 4),
    ];
    let named = small.into_iter().map(|(p, t)| (p.len(), t));
    let complexes = (1..8).map(random_complex);
    let surfaces = (1..7).map(random_surface);
    named.chain(complexes).chain(surfaces).collect()
}

/// In all, in each tier.
const STEPS: usize = 100_000;
/// From one beginning, before the next.
const STEPS_AT_ONCE: usize = 500;
/// Above this many faces the mesh shrinks, below `FEW` it grows: checking is linear in them.
const MANY: usize = 70;
const FEW: usize = 12;

/// 100 000 operations at random: after each, every table is what a rebuild gives, and the triangles
/// are those that the operation's picture gives from a plain list of them.
fn operations_at_random_keep_the_tables_true<S: EdgeStore>() {
    let beginnings = beginnings();
    let (mut done, mut singular) = ([0; OPERATIONS.len()], [0; OPERATIONS.len()]);
    let (mut steps, mut grown) = (0, 0);
    for run in 0..STEPS / STEPS_AT_ONCE {
        let (vertices, triangles) = &beginnings[run % beginnings.len()];
        let mut bench = Bench::<S>::new(*vertices, triangles);
        let mut random = Random(run as u64 + 1);
        while bench.done.iter().sum::<usize>() < STEPS_AT_ONCE {
            let operation = match bench.mesh.face_count() {
                n if n > MANY => [0, 4, 5, 5, 5][random.below(5)],
                n if n < FEW => [1, 2, 3, 3, 6][random.below(5)],
                // The more often refused, the more often tried.
                _ => [0, 0, 0, 1, 2, 3, 3, 3, 3, 4, 5, 5, 6, 6, 6, 6][random.below(16)],
            };
            if let Some(is_singular) = bench.try_one(operation, &mut random) {
                let step = bench.done.iter().sum::<usize>();
                bench.done[operation] += 1;
                bench.done_at_singular[operation] += usize::from(is_singular);
                bench.check(&format!(
                    "run {run}, step {step}: {}",
                    OPERATIONS[operation]
                ));
            }
        }
        steps += bench.done.iter().sum::<usize>();
        grown += bench.grown;
        for i in 0..OPERATIONS.len() {
            done[i] += bench.done[i];
            singular[i] += bench.done_at_singular[i];
        }
    }
    let counts = OPERATIONS.iter().zip(done.iter().zip(&singular));
    let counts: Vec<String> = counts
        .map(|(name, (n, at_singular))| format!("{name} {n} ({at_singular})"))
        .collect();
    let tier = S::TIER.name();
    println!(
        "{tier}: {steps} operations (at what is not manifold): {}; {grown} new slots",
        counts.join(", ")
    );
    assert_eq!(steps, STEPS);
    for i in 0..OPERATIONS.len() {
        assert!(done[i] > 5_000, "{}: {counts:?}", OPERATIONS[i]);
        assert!(singular[i] > 1_000, "{}: {counts:?}", OPERATIONS[i]);
    }
    assert!(grown > 1_000, "{grown}");
}

/// Collapses down to the last allowed one, undone by vertex splits, the last first: the same
/// triangles in the same slots from the same corners on, and the same value at each vertex.
fn splits_undo_collapses<S: EdgeStore>() {
    let (mut collapses, mut at_singular) = (0, 0);
    let named = named_shapes().into_iter().map(|(_, (p, t))| (p.len(), t));
    let complexes = (1..200).map(random_complex);
    let surfaces = (1..60).map(random_surface);
    for (i, (vertices, triangles)) in named.chain(complexes).chain(surfaces).enumerate() {
        let mut mesh = Mesh::<S>::from_triangles(vertices, &triangles);
        let mut random = Random(i as u64 + 1);
        let before: Vec<usize> = (0..vertices).collect();
        let mut values = before.clone();
        let mut records = Vec::new();
        loop {
            let edges = live_edges(&mesh);
            let mut allowed = edges.iter().flat_map(|&e| mesh.edge_star(e));
            let skip = random.below(1 + edges.len());
            let first = allowed.clone().skip(skip).find(|&e| mesh.link_condition(e));
            let Some(e) = first.or_else(|| allowed.find(|&e| mesh.link_condition(e))) else {
                break;
            };
            let split = mesh.split_undoing(e);
            at_singular +=
                usize::from(split.faces.len() > 2 || mesh.is_non_manifold_vertex(split.kept));
            mesh.collapse(e);
            let ends = [split.kept, split.removed].map(|v| v.index());
            records.push((split, ends, ends.map(|v| values[v])));
            values[ends[0]] = vertices + records.len();
            values[ends[1]] = 0;
        }
        collapses += records.len();
        for (split, ends, old) in records.into_iter().rev() {
            assert!(mesh.vertex_split_condition(&split), "case {i}: {split:?}");
            mesh.split_vertex(&split);
            mesh.check()
                .unwrap_or_else(|wrong| panic!("case {i}: {split:?}: {wrong}"));
            (values[ends[0]], values[ends[1]]) = (old[0], old[1]);
        }
        assert_eq!(mesh.triangles(), triangles, "case {i}");
        assert_eq!(values, before, "case {i}");
    }
    println!(
        "{}: {collapses} collapses undone, {at_singular} at what is not manifold",
        S::TIER.name()
    );
    assert!(collapses > 2000, "{collapses}");
    assert!(at_singular > 200, "{at_singular}");
}

/// A split that no collapse undoes is refused, and one whose slots or corners are not there.
fn splits_that_no_collapse_undoes_are_refused<S: EdgeStore>() {
    let (positions, triangles) = shapes::icosphere(1);
    let mut mesh = Mesh::<S>::from_triangles(positions.len(), &triangles);
    let e = EdgeId::new(0);
    let split = mesh.split_undoing(e);
    assert!(!mesh.vertex_split_condition(&split), "the slots are taken");
    mesh.collapse(e);
    assert!(mesh.vertex_split_condition(&split));
    let mut wrong: Vec<VertexSplit> = Vec::new();
    let mut change = |change: &dyn Fn(&mut VertexSplit)| {
        let mut split = split.clone();
        change(&mut split);
        wrong.push(split);
    };
    change(&|s| s.removed = VertexId::new(1_000_000));
    change(&|s| s.kept = VertexId::new(1_000_000));
    change(&|s| s.kept = s.removed);
    change(&|s| s.faces[0].0 = FaceId::new(1_000_000));
    change(&|s| s.faces[0].0 = s.faces[1].0);
    change(&|s| s.faces[0].1 = s.faces[1].1);
    change(&|s| s.faces[0].1.swap(0, 1));
    change(&|s| s.faces.clear());
    change(&|s| s.faces.truncate(1));
    change(&|s| s.corners.clear());
    change(&|s| _ = s.corners.pop());
    change(&|s| s.corners.push(EdgeId::new(1_000_000)));
    change(&|s| s.corners[0] = mesh.next(s.corners[0]));
    change(&|s| s.corners.push(s.corners[0]));
    for split in &wrong {
        assert!(!mesh.vertex_split_condition(split), "{split:?}");
    }
}

/// Three fins made face by face, and unmade: the row comes with the third face and goes with it.
fn the_third_face_makes_the_row<S: EdgeStore>() {
    let mut mesh = Mesh::<S>::from_triangles(0, &[]);
    let [a, b, x, y, z] = [(); 5].map(|()| mesh.new_vertex().unwrap());
    let [f, g, h] = [(); 3].map(|()| mesh.new_face().unwrap());
    let mut states = Vec::new();
    for (face, vertices) in [(f, [a, b, x]), (g, [b, a, y]), (h, [a, b, z])] {
        assert!(mesh.add_condition(vertices, face));
        mesh.add_face(vertices, face);
        mesh.check().unwrap();
        assert!(!mesh.add_condition(vertices, face), "the slot is taken");
        let fans = mesh.fans(a).count();
        states.push((mesh.non_manifold_edge_count(), fans, mesh.vertex_count()));
    }
    assert_eq!(states, [(0, 1, 3), (0, 1, 4), (1, 3, 5)]);
    let free = mesh.new_face().unwrap();
    assert!(!mesh.add_condition([b, x, a], free), "the face is there");
    assert!(!mesh.add_condition([x, b, a], free), "so is its back");
    assert!(!mesh.add_condition([a, a, x], free));
    assert!(!mesh.add_condition([a, x, VertexId::new(99)], free));
    mesh.remove_face(f);
    mesh.check().unwrap();
    assert_eq!(mesh.non_manifold_edge_count(), 0);
    assert_eq!((mesh.fans(a).count(), mesh.vertex_count()), (1, 4));
    mesh.remove_face(g);
    mesh.remove_face(h);
    mesh.check().unwrap();
    assert_eq!((mesh.face_count(), mesh.vertex_count()), (0, 0));
}

for_each_tier!(
    operations_at_random_keep_the_tables_true,
    splits_undo_collapses,
    splits_that_no_collapse_undoes_are_refused,
    the_third_face_makes_the_row,
);
