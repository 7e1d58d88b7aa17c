//! The same claims in every tier, against oracles too simple to be wrong.

use std::collections::{BTreeMap, BTreeSet};

use super::*;
use crate::for_each_tier;
use crate::shapes::{self, Shape};

/// A seeded generator (Marsaglia 2003, xorshift), so that every run is the same.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n as u64) as usize
    }
}

pub(super) fn named_shapes() -> Vec<(&'static str, Shape)> {
    vec![
        ("tetrahedron", shapes::tetrahedron()),
        ("grid", shapes::grid(7, 5)),
        ("icosphere", shapes::icosphere(2)),
        ("bow_tie", shapes::bow_tie()),
        (
            "subdivided bow_tie",
            shapes::subdivided(shapes::subdivided(shapes::bow_tie())),
        ),
        ("three_fins", shapes::three_fins(5)),
        ("moebius", shapes::moebius(24)),
        ("torus", shapes::torus(12, 8)),
    ]
}

/// A simplicial complex of random triangles over few vertices: everything touches everything.
pub(super) fn random_complex(seed: u64) -> (usize, Vec<[u32; 3]>) {
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    let vertices = 4 + random.below(14);
    let mut seen = BTreeSet::new();
    let mut triangles = Vec::new();
    for _ in 0..3 + random.below(40) {
        let t = [(); 3].map(|()| random.below(vertices) as u32);
        let mut key = t;
        key.sort_unstable();
        if key[0] != key[1] && key[1] != key[2] && seen.insert(key) {
            triangles.push(t);
        }
    }
    (vertices, triangles)
}

/// A fine surface with random faces glued on, so that collapses have room beside what is singular.
pub(super) fn random_surface(seed: u64) -> (usize, Vec<[u32; 3]>) {
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    let (positions, mut triangles) = [
        shapes::grid(6, 6),
        shapes::icosphere(1),
        shapes::torus(7, 5),
    ][random.below(3)]
    .clone();
    let mut seen: BTreeSet<_> = triangles.iter().map(sorted).collect();
    for _ in 0..random.below(6) {
        let t = [(); 3].map(|()| random.below(positions.len()) as u32);
        if t[0] != t[1] && t[1] != t[2] && t[2] != t[0] && seen.insert(sorted(&t)) {
            triangles.push(t);
        }
    }
    for _ in 0..random.below(4) {
        triangles.remove(random.below(triangles.len()));
    }
    (positions.len(), triangles)
}

fn sorted(t: &[u32; 3]) -> [u32; 3] {
    let mut t = *t;
    t.sort_unstable();
    t
}

/// What a homeomorphism keeps, counted the slow way from the triangles alone.
#[derive(Debug, PartialEq, Eq)]
struct Topology {
    euler: i64,
    components: usize,
    boundary_components: usize,
    /// By number of faces: how many connected pieces the edges with that many faces form.
    singular_pieces: BTreeMap<usize, usize>,
    surrounded: BTreeMap<Vec<usize>, usize>,
}

fn pieces(edges: impl IntoIterator<Item = (u32, u32)>) -> usize {
    let mut parent: BTreeMap<u32, u32> = BTreeMap::new();
    fn root(parent: &mut BTreeMap<u32, u32>, v: u32) -> u32 {
        let mut v = v;
        while let Some(&p) = parent.get(&v).filter(|&&p| p != v) {
            v = p;
        }
        parent.entry(v).or_insert(v);
        v
    }
    for (a, b) in edges {
        let (a, b) = (root(&mut parent, a), root(&mut parent, b));
        parent.insert(a, b);
    }
    parent.iter().filter(|(v, p)| v == p).count()
}

fn edges_of(triangles: &[[u32; 3]]) -> BTreeMap<(u32, u32), usize> {
    let mut edges = BTreeMap::new();
    for t in triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            *edges.entry((a.min(b), a.max(b))).or_insert(0) += 1;
        }
    }
    edges
}

fn topology(triangles: &[[u32; 3]]) -> Topology {
    let edges = edges_of(triangles);
    let vertices: BTreeSet<u32> = triangles.iter().flatten().copied().collect();
    let singular = |n: usize| edges.iter().filter(move |&(_, &m)| m == n).map(|(&e, _)| e);
    let counts: BTreeSet<usize> = edges.values().copied().filter(|&n| n != 2).collect();
    // A vertex that is more than a point of a surface or of one curve: the degrees in its link.
    let mut surrounded = BTreeMap::new();
    for &v in &vertices {
        let link: Vec<[u32; 3]> = triangles
            .iter()
            .filter(|t| t.contains(&v))
            .copied()
            .collect();
        let mut degrees: Vec<usize> = edges
            .iter()
            .filter(|&(&(a, b), &n)| n != 2 && (a == v || b == v))
            .map(|(_, &n)| n)
            .collect();
        degrees.sort_unstable();
        let rim: Vec<(u32, u32)> = link
            .iter()
            .map(|t| {
                let mut others = t.iter().filter(|&&x| x != v);
                (*others.next().unwrap(), *others.next().unwrap())
            })
            .collect();
        degrees.push(1000 * pieces(rim));
        let is_plain = degrees == [1000] || degrees == [1, 1, 1000];
        let is_on_curve = degrees.len() == 3 && degrees[0] == degrees[1] && degrees[2] == 1000;
        if !is_plain && !is_on_curve {
            *surrounded.entry(degrees).or_insert(0) += 1;
        }
    }
    Topology {
        euler: vertices.len() as i64 - edges.len() as i64 + triangles.len() as i64,
        components: pieces(edges.keys().copied()),
        boundary_components: pieces(singular(1)),
        singular_pieces: counts
            .into_iter()
            .map(|n| (n, pieces(singular(n))))
            .collect(),
        surrounded,
    }
}

pub(super) fn live_edges<S: EdgeStore>(mesh: &Mesh<S>) -> Vec<EdgeId> {
    mesh.edges().collect()
}

/// Collapses random edges that the link condition allows, `check` after each, until none is left.
fn collapse_at_random<S: EdgeStore>(mesh: &mut Mesh<S>, random: &mut Random) -> usize {
    let mut collapses = 0;
    loop {
        let mut edges = live_edges(mesh);
        let mut collapsed = false;
        while !edges.is_empty() {
            let e = edges.swap_remove(random.below(edges.len()));
            let star = mesh.edge_star(e);
            let e = star[random.below(star.len())];
            if !mesh.link_condition(e) {
                continue;
            }
            let (faces, vertices) = (mesh.face_count(), mesh.vertex_count());
            let record = mesh.collapse(e);
            mesh.check()
                .unwrap_or_else(|wrong| panic!("after collapse of {e:?}: {wrong}"));
            assert_eq!(mesh.face_count() + record.dead_faces.len(), faces);
            assert_eq!(mesh.vertex_count() + 1, vertices);
            assert!(
                record
                    .merged_edges
                    .iter()
                    .all(|&e| mesh.is_live_face(e.face()))
            );
            collapses += 1;
            collapsed = true;
            break;
        }
        if !collapsed {
            return collapses;
        }
    }
}

/// Every link equals the one found by comparing all pairs of directed edges.
fn opposites_equal_brute_force<S: EdgeStore>() {
    let random = (1..60).map(|seed| ("random", random_complex(seed)));
    let named = named_shapes()
        .into_iter()
        .map(|(name, (p, t))| (name, (p.len(), t)));
    for (name, (vertices, triangles)) in named.chain(random) {
        let mesh = Mesh::<S>::from_triangles(vertices, &triangles);
        let ends = |e: usize| (triangles[e / 3][e % 3], triangles[e / 3][(e + 1) % 3]);
        for e in 0..3 * triangles.len() {
            let (a, b) = ends(e);
            let along: Vec<usize> = (0..3 * triangles.len())
                .filter(|&o| ends(o) == (a, b) || ends(o) == (b, a))
                .collect();
            let id = EdgeId::new(e);
            match mesh.opposite(id) {
                Opposite::Boundary => assert_eq!(along, [e], "{name}"),
                Opposite::Edge(o) => {
                    assert_eq!(along.len(), 2, "{name}");
                    assert_eq!(ends(o.index()), (b, a), "{name}");
                }
                Opposite::NonManifold(_) => {
                    let is_pair = along.len() == 2 && ends(along[0]) == ends(along[1]);
                    assert!(is_pair || along.len() > 2, "{name}: {along:?}");
                    let star: Vec<_> = mesh.edge_star(id).iter().map(|e| e.index()).collect();
                    assert_eq!(star, along, "{name}");
                }
            }
        }
        mesh.check().unwrap();
    }
}

/// The six adjacency queries equal those read off the triangle list (FV, EV, VF, EF, FE, VE).
fn queries_equal_brute_force<S: EdgeStore>() {
    let random = (100..140).map(random_complex);
    let named = named_shapes().into_iter().map(|(_, (p, t))| (p.len(), t));
    for (vertices, triangles) in named.chain(random) {
        let mesh = Mesh::<S>::from_triangles(vertices, &triangles);
        for (i, t) in triangles.iter().enumerate() {
            let f = FaceId::new(i);
            assert_eq!(mesh.face_vertices(f).map(|v| v.index() as u32), *t);
            for (k, e) in f.edges().into_iter().enumerate() {
                let ends = mesh.edge_vertices(e).map(|v| v.index() as u32);
                assert_eq!(ends, [t[k], t[(k + 1) % 3]]);
                let mut faces: Vec<_> = mesh.edge_faces(e).iter().map(|f| f.index()).collect();
                faces.sort_unstable();
                let sharing = |t: &[u32; 3]| ends.iter().all(|v| t.contains(v));
                let expected: Vec<_> = (0..triangles.len())
                    .filter(|&i| sharing(&triangles[i]))
                    .collect();
                assert_eq!(faces, expected);
            }
        }
        let edges = edges_of(&triangles);
        for v in 0..vertices {
            let id = VertexId::new(v);
            let mut faces: Vec<_> = mesh.vertex_faces(id).map(|f| f.index()).collect();
            faces.sort_unstable();
            let at_v = |i: &usize| triangles[*i].contains(&(v as u32));
            assert_eq!(faces, (0..triangles.len()).filter(at_v).collect::<Vec<_>>());

            let mut ring: Vec<_> = mesh.one_ring(id).iter().map(|v| v.index() as u32).collect();
            ring.sort_unstable();
            let v = v as u32;
            let other = |&(a, b): &(u32, u32)| {
                if a == v {
                    Some(b)
                } else {
                    (b == v).then_some(a)
                }
            };
            let mut expected: Vec<_> = edges.keys().filter_map(other).collect();
            expected.sort_unstable();
            assert_eq!(ring, expected);
            assert_eq!(mesh.vertex_edges(id).len(), expected.len());
        }
    }
}

/// The step around a vertex is the same in every tier, so the rings are equal lists.
#[test]
fn rings_are_in_the_same_order_in_every_tier() {
    for (name, (positions, triangles)) in named_shapes() {
        let full = Mesh::<Full>::from_triangles(positions.len(), &triangles);
        let medium = Mesh::<Medium>::from_triangles(positions.len(), &triangles);
        let small = Mesh::<Small>::from_triangles(positions.len(), &triangles);
        for v in (0..positions.len()).map(VertexId::new) {
            let ring = full.one_ring(v);
            assert_eq!(ring, medium.one_ring(v), "{name}");
            assert_eq!(ring, small.one_ring(v), "{name}");
        }
    }
}

/// Random collapses down to the last allowed one keep every table true, and all that a
/// homeomorphism keeps.
fn collapses_keep_tables_and_topology<S: EdgeStore>() {
    let named = named_shapes().into_iter().map(|(_, (p, t))| (p.len(), t));
    let complexes = (1..150).map(random_complex);
    let surfaces = (1..60).map(random_surface);
    let mut collapses = 0;
    for (i, (vertices, triangles)) in named.chain(complexes).chain(surfaces).enumerate() {
        let before = topology(&triangles);
        let mut mesh = Mesh::<S>::from_triangles(vertices, &triangles);
        collapses += collapse_at_random(&mut mesh, &mut Random(i as u64 + 1));
        assert_eq!(
            topology(&mesh.triangles()),
            before,
            "case {i}: {triangles:?}"
        );
    }
    assert!(
        collapses > 2000,
        "only {collapses} collapses: the test has lost its force"
    );
}

/// Where the path for disks has an answer, it is the general one's; where it collapses, every word is
/// what the general path writes.
fn disks_are_treated_as_any_edge<S: EdgeStore>() {
    let (mut answers, mut collapses) = (0, 0);
    let named = named_shapes().into_iter().map(|(_, (p, t))| (p.len(), t));
    let complexes = (1..100).map(random_complex);
    let surfaces = (1..100).map(random_surface);
    for (i, (vertices, triangles)) in named.chain(complexes).chain(surfaces).enumerate() {
        let mut mesh = Mesh::<S>::from_triangles(vertices, &triangles);
        let words = |mesh: &Mesh<S>| {
            let edges = mesh.faces().flat_map(FaceId::edges);
            let edges = edges.map(|e| (mesh.edge_vertices(e), mesh.opposite(e)));
            let outgoing = (0..vertices).map(|v| mesh.outgoing(VertexId::new(v)));
            let counts = [mesh.live_faces, mesh.live_vertices];
            (
                edges.collect::<Vec<_>>(),
                outgoing.collect::<Vec<_>>(),
                counts,
            )
        };
        let mut random = Random(i as u64 + 1);
        for _ in 0..150 {
            let edges = live_edges(&mesh);
            if edges.is_empty() {
                break;
            }
            let star = mesh.edge_star(edges[random.below(edges.len())]);
            let e = star[random.below(star.len())];
            let answer = mesh.general_link_condition(e);
            let disks = mesh.disks(e);
            if let Some(disks) = &disks {
                assert_eq!(disks.link_condition(), answer, "case {i}: {e:?}");
                answers += 1;
            }
            if !answer {
                continue;
            }
            let mut general = mesh.clone();
            let expected = general.general_collapse(e);
            if let Some(disks) = disks {
                let record = mesh.collapse_disks(&disks);
                assert_eq!(record, expected, "case {i}: {e:?}");
                collapses += 1;
            } else {
                assert_eq!(mesh.general_collapse(e), expected);
            }
            assert_eq!(words(&mesh), words(&general), "case {i}: {e:?}");
        }
    }
    assert!(answers > 1000, "{answers}");
    assert!(collapses > 500, "{collapses}");
}

/// Collapse by collapse, the link condition says yes exactly where the triangles allow it: every
/// topological count stays, and no two faces become the same.
fn the_link_condition_refuses_only_what_changes_something<S: EdgeStore>() {
    let (mut refused, mut needlessly) = (0, 0);
    for (vertices, triangles) in (1..200).map(random_complex) {
        let mesh = Mesh::<S>::from_triangles(vertices, &triangles);
        let before = topology(&triangles);
        for e in live_edges(&mesh) {
            let [u, v] = mesh.edge_vertices(e).map(|v| v.index() as u32);
            let moved: Vec<[u32; 3]> = triangles
                .iter()
                .map(|t| t.map(|x| if x == u { v } else { x }))
                .filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
                .collect();
            let distinct: BTreeSet<_> = moved.iter().map(sorted).collect();
            let keeps = distinct.len() == moved.len()
                && topology(&moved) == before
                && edges_of(&moved).len() + 1 + mesh.edge_star(e).len()
                    == edges_of(&triangles).len();
            if mesh.link_condition(e) {
                assert!(keeps, "{e:?} of {triangles:?}");
            } else {
                refused += 1;
                needlessly += usize::from(keeps);
            }
        }
    }
    // The counts are coarser than a homeomorphism, so a few refusals look needless to them.
    assert!(
        needlessly * 20 < refused,
        "{needlessly} of {refused} refusals look needless"
    );
}

/// A fine surface comes down to the fewest faces that its topology allows.
fn surfaces_come_down_to_their_minimum<S: EdgeStore>() {
    for (name, (positions, triangles), fewest) in [
        ("sphere", shapes::icosphere(2), 4),
        ("disk", shapes::grid(6, 6), 1),
        ("three fins", shapes::three_fins(6), 3),
        (
            "two spheres at a point",
            shapes::subdivided(shapes::bow_tie()),
            8,
        ),
    ] {
        let mut mesh = Mesh::<S>::from_triangles(positions.len(), &triangles);
        // In the order of the ids, so that it does not depend on luck.
        while let Some(e) = live_edges(&mesh)
            .into_iter()
            .find(|&e| mesh.link_condition(e))
        {
            mesh.collapse(e);
            mesh.check().unwrap();
        }
        assert_eq!(mesh.face_count(), fewest, "{name}");
    }
}

/// Three faces on one edge: each finds the same row of the side table, and the vertices at its
/// ends have three fans.
fn three_fins_share_one_row<S: EdgeStore>() {
    let (positions, triangles) = shapes::three_fins(1);
    let mesh = Mesh::<S>::from_triangles(positions.len(), &triangles);
    assert_eq!(mesh.non_manifold_edge_count(), 1);
    assert_eq!(mesh.multi_fan_vertex_count(), 2);
    let star = mesh
        .edges()
        .find_map(|e| {
            matches!(mesh.opposite(e), Opposite::NonManifold(_)).then(|| mesh.edge_star(e))
        })
        .unwrap();
    assert_eq!(star.len(), 3);
    assert!(star.iter().all(|&e| mesh.edge_star(e) == star));
}

fn a_bow_tie_has_one_vertex_with_two_fans<S: EdgeStore>() {
    let (positions, triangles) = shapes::bow_tie();
    let mesh = Mesh::<S>::from_triangles(positions.len(), &triangles);
    assert_eq!(mesh.multi_fan_vertex_count(), 1);
    assert_eq!(mesh.fans(VertexId::new(0)).count(), 2);
    assert!(mesh.is_non_manifold_vertex(VertexId::new(0)));
}

/// 60m+16n, 36m+16n, 24m+16n with the positions' 12 bytes a vertex, and nothing else on a manifold.
fn bytes_are_the_tables<S: EdgeStore>() {
    let (positions, triangles) = shapes::icosphere(3);
    let (n, m) = (positions.len(), triangles.len());
    let mesh = Mesh::<S>::from_triangles(n, &triangles);
    assert_eq!(mesh.bytes() + 12 * n, S::TIER.bytes(n, m));
    let per_edge = match S::TIER {
        Tier::Full => 60,
        Tier::Medium => 36,
        Tier::Small => 24,
    };
    assert_eq!(S::TIER.bytes(n, m), per_edge * m + 16 * n);

    // Three fins: the tables, and no more than their rows and heads.
    let (positions, triangles) = shapes::three_fins(20);
    let (n, m) = (positions.len(), triangles.len());
    let mesh = Mesh::<S>::from_triangles(n, &triangles);
    let tables = mesh.bytes() + 12 * n - S::TIER.bytes(n, m);
    let rows = mesh.non_manifold_edge_count() + mesh.multi_fan_vertex_count();
    assert!(
        tables > 0 && tables < 80 * rows,
        "{tables} bytes for {rows} rows"
    );
}

/// The paper's figures: 68, 44 and 32 bytes per triangle at two triangles a vertex.
#[test]
fn the_papers_bytes_per_triangle() {
    assert_eq!(
        Tier::ALL.map(|tier| tier.bytes(500, 1000) / 1000),
        [68, 44, 32]
    );
}

/// A hole has one loop, a disk one; a torus none; a fin's boundary ends at the shared edge.
fn boundary_curves_are_loops_or_run_between_fins<S: EdgeStore>() {
    let (positions, triangles) = shapes::grid(4, 3);
    let mesh = Mesh::<S>::from_triangles(positions.len(), &triangles);
    let curves = mesh.boundary_curves();
    assert_eq!(curves.len(), 1);
    assert!(curves[0].is_closed);
    assert_eq!(curves[0].edges.len(), 14);
    for pair in curves[0].edges.windows(2) {
        assert_eq!(mesh.head(pair[0]), mesh.tail(pair[1]));
    }

    let (positions, triangles) = shapes::torus(5, 4);
    assert!(
        Mesh::<S>::from_triangles(positions.len(), &triangles)
            .boundary_curves()
            .is_empty()
    );

    let (positions, triangles) = shapes::three_fins(3);
    let mesh = Mesh::<S>::from_triangles(positions.len(), &triangles);
    let curves = mesh.boundary_curves();
    assert_eq!(curves.len(), 3);
    assert!(curves.iter().all(|c| !c.is_closed && c.edges.len() == 9));
}

/// Compacting renames everything and changes nothing.
fn compact_keeps_the_mesh<S: EdgeStore>() {
    for (name, (positions, triangles)) in named_shapes() {
        let mut mesh = Mesh::<S>::from_triangles(positions.len(), &triangles);
        let mut random = Random(7);
        for _ in 0..10 {
            let edges = live_edges(&mesh);
            let e = edges[random.below(edges.len())];
            if mesh.link_condition(e) {
                mesh.collapse(e);
            }
        }
        let before = mesh.triangles();
        let map = mesh.compact();
        mesh.check().unwrap();
        assert_eq!(mesh.face_slots(), mesh.face_count(), "{name}");
        assert_eq!(mesh.vertex_slots(), mesh.vertex_count(), "{name}");
        let new = |v: u32| map.vertices[v as usize].unwrap().index() as u32;
        let renamed: Vec<_> = before.iter().map(|t| t.map(new)).collect();
        assert_eq!(mesh.triangles(), renamed, "{name}");
        let mut names: Vec<usize> = (0..positions.len()).collect();
        Compaction::retain(&map.vertices, &mut names);
        assert!(
            names
                .iter()
                .enumerate()
                .all(|(to, &from)| new(from as u32) as usize == to)
        );
    }
}

/// A vertex with 20 000 faces around it, and 20 000 faces around one edge: no quadratic time.
fn busy_vertices_and_edges_are_built_and_checked<S: EdgeStore>() {
    let n = 20_000;
    let cone: Vec<[u32; 3]> = (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect();
    Mesh::<S>::from_triangles(n as usize + 1, &cone)
        .check()
        .unwrap();
    let book: Vec<[u32; 3]> = (0..n).map(|i| [0, 1, 2 + i]).collect();
    let mesh = Mesh::<S>::from_triangles(n as usize + 2, &book);
    mesh.check().unwrap();
    assert_eq!(mesh.non_manifold_edge_count(), 1);
}

/// A vertex with more than 192 faces in fans of every kind: two closed ones and two open ones, each
/// with a ring of faces around it, lone triangles, and pages of two faces on two edges.
fn hub_of_many_fans() -> (usize, Vec<[u32; 3]>) {
    let (mut vertices, mut triangles) = (1, Vec::new());
    for (spokes, is_closed) in [(60, true), (40, true), (50, false), (12, false)] {
        let rim = |i: u32| vertices + i % spokes;
        let outer = |i: u32| vertices + spokes + i % spokes;
        for i in 0..if is_closed { spokes } else { spokes - 1 } {
            triangles.extend([
                [0, rim(i), rim(i + 1)],
                [rim(i), outer(i), rim(i + 1)],
                [rim(i + 1), outer(i), outer(i + 1)],
            ]);
        }
        vertices += 2 * spokes;
    }
    for _ in 0..10 {
        triangles.push([0, vertices, vertices + 1]);
        vertices += 2;
    }
    for pages in [8, 25] {
        let spine = vertices;
        vertices += 1;
        for page in 0..pages {
            let (a, b) = (vertices, vertices + 1);
            let first = if page % 3 == 0 {
                [spine, 0, a]
            } else {
                [0, spine, a]
            };
            triangles.extend([first, [a, first[1], b]]);
            vertices += 2;
        }
    }
    (vertices as usize, triangles)
}

/// A collapse at a busy vertex leaves the fans alone that lose no face: all tables stay what a rebuild
/// gives, and all that a homeomorphism keeps. The busy vertex is the one that is left, whichever way
/// the edge runs.
fn collapses_at_a_busy_vertex_keep_tables_and_topology<S: EdgeStore>() {
    let (vertices, triangles) = hub_of_many_fans();
    let before = topology(&triangles);
    let hub = VertexId::new(0);
    let mesh = Mesh::<S>::from_triangles(vertices, &triangles);
    assert!(mesh.is_busy(hub) && mesh.multi_fan_vertex_count() > 0);
    let spokes = live_edges(&mesh).into_iter().filter(|&e| {
        let ends = mesh.edge_vertices(e);
        ends.contains(&hub) && mesh.link_condition(e)
    });
    let mut collapsed = 0;
    for e in spokes.flat_map(|e| mesh.edge_star(e)) {
        let mut after = mesh.clone();
        assert_eq!(after.collapse(e).kept, hub);
        after
            .check()
            .unwrap_or_else(|wrong| panic!("{e:?}: {wrong}"));
        assert_eq!(topology(&after.triangles()), before, "{e:?}");
        collapsed += 1;
    }
    assert!(collapsed > 100, "{collapsed}");
    for seed in 1..4 {
        let mut mesh = mesh.clone();
        collapse_at_random(&mut mesh, &mut Random(seed));
        assert_eq!(topology(&mesh.triangles()), before, "seed {seed}");
    }
}

/// 50 000 faces around each of two vertices: the components, the link condition of every spoke, which
/// has both next to its rim, and what a change of the topology would do take no quadratic time.
fn every_spoke_is_asked_quickly<S: EdgeStore>() {
    let n = 50_000;
    let (a, b) = (n, n + 1);
    let cones = (0..n).flat_map(|i| [[a, i, (i + 1) % n], [b, (i + 1) % n, i]]);
    let cones: Vec<[u32; 3]> = cones.collect();
    let mesh = Mesh::<S>::from_triangles(n as usize + 2, &cones);
    assert_eq!(mesh.components().len(), 1);
    for e in mesh.edges() {
        let ends = mesh.edge_vertices(e).map(|v| v.index() as u32);
        let is_spoke = ends.contains(&a) || ends.contains(&b);
        assert_eq!(mesh.link_condition(e), !is_spoke, "{e:?}");
        assert!(mesh.contraction(e).is_none() && mesh.open_loops(e).is_empty());
    }
}

/// `check` finds each kind of lie that a wrong collapse could leave.
fn check_finds_what_is_wrong<S: EdgeStore>() {
    let (positions, triangles) = shapes::three_fins(3);
    let good = Mesh::<S>::from_triangles(positions.len(), &triangles);
    good.check().unwrap();
    let regular = good.edges().find(|&e| good.mate(e).is_some()).unwrap();
    let mut lies: Vec<Mesh<S>> = Vec::new();
    let mut lie = |change: &dyn Fn(&mut Mesh<S>)| {
        let mut mesh = good.clone();
        change(&mut mesh);
        lies.push(mesh);
    };
    lie(&|m| m.set_opposite(regular, Opposite::Boundary));
    lie(&|m| m.set_opposite(regular, Opposite::Edge(EdgeId::new(0))));
    lie(&|m| m.set_opposite(regular, Opposite::NonManifold(RowId::new(0))));
    lie(&|m| m.set_outgoing(VertexId::new(0), Outgoing::None));
    lie(&|m| m.set_outgoing(VertexId::new(1), Outgoing::Fan(m.next(EdgeId::new(0)))));
    lie(&|m| {
        m.store
            .set_tail(regular, VertexId::new(positions.len() - 1))
    });
    lie(&|m| m.live_faces -= 1);
    lie(&|m| m.live_vertices += 1);
    lie(&|m| {
        m.edge_rows.remove(RowId::new(0));
    });
    for (i, mesh) in lies.iter().enumerate() {
        assert!(mesh.check().is_err(), "lie {i} was not found");
    }
}

/// Random flips among random collapses: every table stays what a rebuild gives, the edge joins the
/// apexes, and two flips give the same triangles back.
fn flips_keep_tables_and_topology<S: EdgeStore>() {
    let mut flips = 0;
    for seed in 0..300 {
        let (vertices, triangles) = if seed % 3 == 0 {
            random_complex(seed)
        } else {
            random_surface(seed)
        };
        let mut mesh = Mesh::<S>::from_triangles(vertices, &triangles);
        let mut random = Random(seed + 1);
        for step in 0..60 {
            let edges: Vec<EdgeId> = mesh.edges().collect();
            if edges.is_empty() {
                break;
            }
            let e = edges[random.below(edges.len())];
            if step % 6 == 5 && mesh.link_condition(e) {
                mesh.collapse(e);
            } else if mesh.flip_condition(e) {
                let apexes = [mesh.apex(mesh.mate(e).unwrap()), mesh.apex(e)];
                let counts = |m: &Mesh<S>| (m.vertex_count(), m.edges().count(), m.face_count());
                let counted = counts(&mesh);
                let before: BTreeSet<_> = mesh.triangles().iter().map(sorted).collect();
                mesh.flip(e);
                mesh.check()
                    .unwrap_or_else(|w| panic!("seed {seed}, {e:?}: {w}"));
                assert_eq!(mesh.edge_vertices(e), apexes, "seed {seed}");
                assert_eq!(counts(&mesh), counted, "seed {seed}");
                flips += 1;
                if step % 2 == 0 {
                    mesh.flip(e);
                    mesh.check().unwrap();
                    let after: BTreeSet<_> = mesh.triangles().iter().map(sorted).collect();
                    assert_eq!(after, before, "seed {seed}");
                }
            }
        }
    }
    assert!(flips > 3000, "{flips}");
}

/// Contractions of random edges, where the link condition forbids a collapse: every table stays
/// what a rebuild gives; no edge and no vertex is less manifold than it was, none becomes a boundary.
fn contractions_make_nothing_worse<S: EdgeStore>() {
    let mut contractions = 0;
    for seed in 0..600 {
        let (vertices, triangles) = if seed % 2 == 0 {
            random_complex(seed)
        } else {
            random_surface(seed)
        };
        let mut mesh = Mesh::<S>::from_triangles(vertices, &triangles);
        let mut random = Random(seed + 1);
        for _ in 0..80 {
            let edges = live_edges(&mesh);
            if edges.is_empty() {
                break;
            }
            let star = mesh.edge_star(edges[random.below(edges.len())]);
            let e = star[random.below(star.len())];
            if mesh.link_condition(e) {
                mesh.collapse(e);
                continue;
            }
            let Some(contraction) = mesh.contraction(e) else {
                continue;
            };
            let singular = |m: &Mesh<S>| {
                let edges = live_edges(m);
                let faces = |e: &EdgeId| m.edge_star(*e).len();
                let vertices = m.vertices().filter(|&v| m.is_non_manifold_vertex(v));
                let boundary = edges.iter().filter(|e| faces(e) == 1).count();
                let most = edges.iter().map(faces).max().unwrap_or(0);
                (
                    m.non_manifold_edge_count(),
                    vertices.count(),
                    boundary,
                    most.max(2),
                )
            };
            let (before, faces) = (singular(&mesh), mesh.face_count());
            let record = mesh.contract(&contraction);
            mesh.check()
                .unwrap_or_else(|w| panic!("seed {seed}, {e:?}, {record:?}: {w}"));
            let after = singular(&mesh);
            assert!(after.0 <= before.0, "seed {seed}: {before:?} -> {after:?}");
            assert!(after.1 <= before.1, "seed {seed}: {before:?} -> {after:?}");
            assert!(after.2 <= before.2, "seed {seed}: {before:?} -> {after:?}");
            assert!(after.3 <= before.3, "seed {seed}: {before:?} -> {after:?}");
            assert_eq!(mesh.face_count() + record.dead_faces.len(), faces);
            contractions += 1;
        }
    }
    assert!(contractions > 300, "{contractions}");
}

/// Components partition the faces, and each can be taken out alone.
fn a_component_is_removed_alone<S: EdgeStore>() {
    for seed in 0..60 {
        let (vertices, mut triangles) = random_complex(seed);
        let (more, others) = random_complex(seed + 100);
        triangles.extend(others.iter().map(|t| t.map(|v| v + vertices as u32)));
        let mut mesh = Mesh::<S>::from_triangles(vertices + more, &triangles);
        let components = mesh.components();
        let faces: usize = components.iter().map(Vec::len).sum();
        assert_eq!(faces, mesh.face_count());
        let parts = usize::from(!others.is_empty()) + usize::from(triangles.len() > others.len());
        assert!(components.len() >= parts, "seed {seed}");
        for component in &components {
            let faces = mesh.face_count();
            mesh.remove_component(component);
            mesh.check().unwrap();
            assert_eq!(mesh.face_count() + component.len(), faces, "seed {seed}");
        }
        assert_eq!(
            (mesh.vertex_count(), mesh.non_manifold_edge_count()),
            (0, 0)
        );
    }
}

/// Faces put between boundary edges at random, among collapses: every table stays what a rebuild
/// gives, each takes one boundary edge away, and nothing becomes less manifold.
fn filling_makes_nothing_worse<S: EdgeStore>() {
    let mut fills = 0;
    for seed in 0..200 {
        let (vertices, triangles) = random_surface(seed);
        let mut mesh = Mesh::<S>::from_triangles(vertices, &triangles);
        let mut random = Random(seed + 1);
        let mut dead = Vec::new();
        for _ in 0..60 {
            let edges = live_edges(&mesh);
            let e = edges[random.below(edges.len())];
            if let (Some(_), Some(&face)) = (mesh.fill_condition(e), dead.last()) {
                let count = |m: &Mesh<S>| {
                    let boundary = live_edges(m).into_iter().filter(|&e| m.is_boundary(e));
                    (
                        boundary.count(),
                        m.non_manifold_edge_count(),
                        m.multi_fan_vertex_count(),
                    )
                };
                let before = count(&mesh);
                mesh.fill(e, face);
                mesh.check()
                    .unwrap_or_else(|w| panic!("seed {seed}, {e:?}: {w}"));
                assert_eq!(
                    count(&mesh),
                    (before.0 - 1, before.1, before.2),
                    "seed {seed}"
                );
                dead.pop();
                fills += 1;
            } else if mesh.link_condition(e) {
                dead.extend(mesh.collapse(e).dead_faces);
            }
        }
    }
    assert!(fills > 100, "{fills}");
}

fn handle_loops<S: EdgeStore>(mesh: &Mesh<S>, e: EdgeId) -> Vec<[EdgeId; 3]> {
    let mut loops = mesh.open_loops(e).to_vec();
    loops.retain(|edges| mesh.is_around_handle(edges));
    loops
}

/// A torus that is three edges around its tube somewhere: pinching there leaves a sphere. Collapses
/// before give the slots.
fn pinching_a_torus_leaves_a_sphere<S: EdgeStore>() {
    let mut pinches = 0;
    for seed in 0..40 {
        let (positions, triangles) = shapes::torus(11, 7);
        let mut mesh = Mesh::<S>::from_triangles(positions.len(), &triangles);
        let mut random = Random(seed + 1);
        let (mut faces, mut vertices) = (Vec::new(), Vec::new());
        for _ in 0..400 {
            let edges = live_edges(&mesh);
            let e = edges[random.below(edges.len())];
            if mesh.link_condition(e) {
                let record = mesh.collapse(e);
                faces.extend(record.dead_faces);
                vertices.push(record.removed);
            } else if let Some(around) = handle_loops(&mesh, e).first() {
                let caps = [faces.pop().unwrap(), faces.pop().unwrap()];
                let new = [(); 3].map(|()| vertices.pop().unwrap());
                mesh.pinch(around, caps, new);
                mesh.check()
                    .unwrap_or_else(|w| panic!("seed {seed}, {around:?}: {w}"));
                let euler = mesh.vertex_count() + mesh.face_count();
                assert_eq!(euler, mesh.edges().count() + 2, "seed {seed}: a sphere");
                assert_eq!(mesh.components().len(), 1, "seed {seed}");
                pinches += 1;
                break;
            }
        }
    }
    assert!(pinches > 30, "{pinches}");
}

/// A loop around the neck of an hourglass separates: no handle to pinch.
fn a_neck_is_no_handle<S: EdgeStore>() {
    let (positions, triangles) = shapes::icosphere(2);
    let mut mesh = Mesh::<S>::from_triangles(positions.len(), &triangles);
    let mut random = Random(7);
    for _ in 0..2000 {
        let edges = live_edges(&mesh);
        let e = edges[random.below(edges.len())];
        assert!(handle_loops(&mesh, e).is_empty(), "{e:?}");
        if mesh.face_count() > 60 && mesh.link_condition(e) {
            mesh.collapse(e);
        }
    }
}

for_each_tier!(
    filling_makes_nothing_worse,
    pinching_a_torus_leaves_a_sphere,
    a_neck_is_no_handle,
    a_component_is_removed_alone,
    disks_are_treated_as_any_edge,
    contractions_make_nothing_worse,
    opposites_equal_brute_force,
    queries_equal_brute_force,
    collapses_keep_tables_and_topology,
    flips_keep_tables_and_topology,
    the_link_condition_refuses_only_what_changes_something,
    surfaces_come_down_to_their_minimum,
    three_fins_share_one_row,
    a_bow_tie_has_one_vertex_with_two_fans,
    bytes_are_the_tables,
    boundary_curves_are_loops_or_run_between_fins,
    compact_keeps_the_mesh,
    busy_vertices_and_edges_are_built_and_checked,
    collapses_at_a_busy_vertex_keep_tables_and_topology,
    every_spoke_is_asked_quickly,
    check_finds_what_is_wrong,
);
