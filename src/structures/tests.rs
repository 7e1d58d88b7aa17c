//! Every structure against brute force over the list of faces, on every mesh that it can carry.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;

use glam::Vec3;

use super::*;
use crate::clean::clean;
use crate::indexed_mesh::{IndexedMesh, Parts};
use crate::mesh::{Full, Medium, Mesh, Small, turn_round};
use crate::shapes::{self, Shape};

/// The answers of a list of faces, by the vertices' indices, each looked up in plain sets.
struct Oracle<const K: usize> {
    faces: Vec<[u32; K]>,
    faces_of_vertex: BTreeMap<u32, BTreeSet<usize>>,
    faces_of_edge: BTreeMap<[u32; 2], Vec<usize>>,
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl<const K: usize> Oracle<K> {
    fn of(faces: &[[u32; K]]) -> Self {
        let mut oracle = Self {
            faces: faces.to_vec(),
            faces_of_vertex: BTreeMap::new(),
            faces_of_edge: BTreeMap::new(),
        };
        for (f, face) in faces.iter().enumerate() {
            for (k, &v) in face.iter().enumerate() {
                oracle.faces_of_vertex.entry(v).or_default().insert(f);
                let edge = sorted([v, face[(k + 1) % K]]);
                oracle.faces_of_edge.entry(edge).or_default().push(f);
            }
        }
        oracle
    }

    fn edges_of_face(&self, f: usize) -> [[u32; 2]; K] {
        let face = self.faces[f];
        std::array::from_fn(|k| [face[k], face[(k + 1) % K]])
    }

    fn edges_of_vertex(&self, v: u32) -> BTreeSet<[u32; 2]> {
        let faces = &self.faces_of_vertex[&v];
        let edges = faces.iter().flat_map(|&f| self.edges_of_face(f));
        edges.map(sorted).filter(|e| e.contains(&v)).collect()
    }

    fn ring(&self, v: u32) -> BTreeSet<u32> {
        let other = |[a, b]: [u32; 2]| if a == v { b } else { a };
        self.edges_of_vertex(v).into_iter().map(other).collect()
    }

    /// The edge before (a, b) with the hole on the right, as its face runs: across edges at a, as long
    /// as exactly one other face lies there and runs the other way.
    fn boundary_step(&self, [a, b]: [u32; 2]) -> Option<[u32; 2]> {
        let mut f = self.faces_of_edge[&sorted([a, b])][0];
        loop {
            let into_a = self.edges_of_face(f).into_iter().find(|e| e[1] == a)?;
            match self.faces_of_edge[&sorted(into_a)][..] {
                [_] => return Some(into_a),
                [g, h] => {
                    f = if g == f { h } else { g };
                    let out_of_a = [a, into_a[0]];
                    if !self.edges_of_face(f).contains(&out_of_a) {
                        return None;
                    }
                }
                _ => return None,
            }
        }
    }

    fn boundary_loop(&self, e: [u32; 2]) -> Vec<[u32; 2]> {
        let mut edges = vec![e];
        let mut at = self.boundary_step(e);
        while let Some(next) = at.filter(|&next| next != e) {
            edges.push(next);
            at = self.boundary_step(next);
        }
        edges
    }
}

/// A face's vertices from the smallest on.
fn turned<const K: usize>(mut face: [u32; K]) -> [u32; K] {
    let smallest = (0..K).min_by_key(|&k| face[k]).unwrap();
    face.rotate_left(smallest);
    face
}

/// The bits of a position as a number.
fn bits(p: Vec3) -> [u32; 3] {
    (p + Vec3::ZERO).to_array().map(f32::to_bits)
}

/// Asks a structure everything at every `stride`-th face, and holds the answers against the oracle's.
fn agrees<S: Structure<K>, const K: usize>(
    structure: &S,
    positions: &[Vec3],
    oracle: &Oracle<K>,
    stride: usize,
    case: &str,
) {
    let index: HashMap<[u32; 3], u32> = (0..).zip(positions).map(|(i, &p)| (bits(p), i)).collect();
    let s = structure;
    let v_of = |v: Vertex| index[&bits(s.position(v))];
    let e_of = |e: Edge| s.edge_vertices(e).map(v_of);
    let case = format!("{case}, {}", S::DESCRIPTION.name);
    for f in (0..oracle.faces.len()).step_by(stride) {
        let face = Face::new(f);
        let vertices = s.face_vertices(face);
        let edges = s.face_edges(face);
        let found = vertices.map(v_of);
        assert_eq!(turned(found), turned(oracle.faces[f]), "{case}: FV of {f}");
        for k in 0..K {
            let (v, e) = (vertices[k], edges[k]);
            let ends = [found[k], found[(k + 1) % K]];
            // The winged edge's ends have no order.
            assert_eq!(sorted(e_of(e)), sorted(ends), "{case}: FE and EV of {f}");

            let mut faces = Vec::new();
            s.edge_faces(e, |f| faces.push(f.index()));
            faces.sort_unstable();
            let at_edge = &oracle.faces_of_edge[&sorted(ends)];
            assert_eq!(&faces, at_edge, "{case}: EF of {ends:?}");

            let mut faces = Vec::new();
            s.vertex_faces(v, |f| faces.push(f.index()));
            faces.sort_unstable();
            let expected = &oracle.faces_of_vertex[&found[k]];
            assert!(faces.iter().eq(expected), "{case}: VF of {}", found[k]);

            let mut around = Vec::new();
            s.vertex_edges(v, |e| around.push(sorted(e_of(e))));
            around.sort_unstable();
            let expected = oracle.edges_of_vertex(found[k]);
            assert!(around.iter().eq(&expected), "{case}: VE of {}", found[k]);

            let mut ring = Vec::new();
            s.one_ring(v, |v| ring.push(v_of(v)));
            ring.sort_unstable();
            let expected = oracle.ring(found[k]);
            assert!(ring.iter().eq(&expected), "{case}: ring of {}", found[k]);

            if at_edge.len() == 1 {
                let step = s.boundary_step(e).map(|e| sorted(e_of(e)));
                let expected = oracle.boundary_step(ends).map(sorted);
                assert_eq!(step, expected, "{case}: boundary step from {ends:?}");
            }
        }
    }
}

/// Holds whole boundary loops against the oracle's, from a few edges of each.
fn loops_agree<S: Structure<K>, const K: usize>(
    structure: &S,
    positions: &[Vec3],
    oracle: &Oracle<K>,
    case: &str,
) {
    let index: HashMap<[u32; 3], u32> = (0..).zip(positions).map(|(i, &p)| (bits(p), i)).collect();
    let s = structure;
    let e_of = |e: Edge| sorted(s.edge_vertices(e).map(|v| index[&bits(s.position(v))]));
    let boundary = oracle
        .faces_of_edge
        .iter()
        .filter(|(_, faces)| faces.len() == 1);
    for (&ends, faces) in boundary.step_by(7).take(40) {
        let edges = oracle.edges_of_face(faces[0]);
        let first = edges.into_iter().find(|&e| sorted(e) == ends).unwrap();
        let named = s.face_edges(Face::new(faces[0])).into_iter();
        let named = named.into_iter().find(|&e| e_of(e) == ends).unwrap();
        let mut found = Vec::new();
        s.boundary_loop(named, |e| found.push(e_of(e)));
        let expected = oracle.boundary_loop(first).into_iter().map(sorted);
        assert!(
            expected.eq(found),
            "{case}, {}: loop of {first:?}",
            S::DESCRIPTION.name
        );
    }
}

/// A mesh as the command hands it to the structures.
fn prepared(mesh: IndexedMesh) -> Shape {
    let Parts {
        positions,
        mut triangles,
        ..
    } = clean(mesh, true).unwrap().0.into_parts();
    let oriented = Mesh::<Small>::oriented(positions.len(), triangles.clone());
    turn_round(&mut triangles, &oriented.flipped);
    (positions, triangles)
}

fn small_meshes() -> Vec<(&'static str, Shape)> {
    let (positions, triangles) = shapes::three_fins(1);
    // Two edges of three faces meet a boundary between them, and one is run along the same way twice.
    let same_way = vec![[0, 1, 2], [0, 1, 3], [1, 4, 2], [2, 4, 5]];
    vec![
        ("tetrahedron", shapes::tetrahedron()),
        ("one triangle", (positions[..3].to_vec(), vec![[0, 1, 2]])),
        ("nothing", (Vec::new(), Vec::new())),
        ("grid", shapes::grid(5, 3)),
        ("icosphere", shapes::icosphere(2)),
        ("torus", shapes::torus(9, 6)),
        ("bow-tie", shapes::bow_tie()),
        ("three fins", (positions, triangles)),
        ("long fins", shapes::three_fins(3)),
        ("moebius", shapes::moebius(12)),
        ("same way", (shapes::icosphere(0).0[..6].to_vec(), same_way)),
        ("two holes", without(shapes::icosphere(2), &[7, 8, 200])),
        ("a pinched rim", without(shapes::grid(4, 4), &[10, 21])),
    ]
}

/// A shape without some of its faces.
fn without((positions, mut triangles): Shape, faces: &[usize]) -> Shape {
    let mut f = 0..;
    triangles.retain(|_| !faces.contains(&f.next().unwrap()));
    (positions, triangles)
}

/// Calls a function with each structure for triangles.
macro_rules! for_each_structure {
    ($function:ident($($argument:expr),*)) => {
        $function::<IndividualTriangles>($($argument),*);
        $function::<SharedVertex>($($argument),*);
        for_each_linked_structure!($function($($argument),*));
    };
}

/// Calls a function with each structure that has links, and so flips.
macro_rules! for_each_linked_structure {
    ($function:ident($($argument:expr),*)) => {
        $function::<SharedVertexWithNeighbours>($($argument),*);
        $function::<WingedEdge>($($argument),*);
        $function::<QuadEdge>($($argument),*);
        $function::<HalfEdge>($($argument),*);
        $function::<PairedHalfEdge>($($argument),*);
        $function::<DirectedEdges<Full>>($($argument),*);
        $function::<DirectedEdges<Medium>>($($argument),*);
        $function::<DirectedEdges<Small>>($($argument),*);
    };
}

/// Every answer is the oracle's, or building says why there is none: then the mesh is not manifold, and
/// the structure's description says that it does not carry such.
fn answers<S: Structure<3>>((positions, triangles): &Shape, oracle: &Oracle<3>, case: &str) {
    // What looks at every corner for an answer is asked less often.
    let is_searched = S::DESCRIPTION.neighbourhood == Access::Searched;
    let stride = if is_searched {
        triangles.len() / 40
    } else {
        triangles.len() / 20_000
    };
    match S::build(positions, triangles) {
        Ok(structure) => {
            for (f, &face) in triangles.iter().enumerate() {
                let found = structure
                    .face_vertices(Face::new(f))
                    .map(|v| structure.position(v));
                assert_eq!(
                    found,
                    face.map(|v| positions[v as usize]),
                    "{case}: face {f}"
                );
            }
            agrees(&structure, positions, oracle, stride.max(1), case);
            if !is_searched || triangles.len() < 1000 {
                loops_agree(&structure, positions, oracle, case);
            }
        }
        Err(why) => {
            let name = S::DESCRIPTION.name;
            assert!(
                !S::DESCRIPTION.carries_non_manifold,
                "{case}, {name}: {why}"
            );
            match why {
                CannotCarry::CrowdedEdge { ends, faces } => {
                    let at_edge = &oracle.faces_of_edge[&sorted(ends)];
                    assert!(at_edge.len() == faces && faces > 2, "{case}, {name}: {why}");
                }
                CannotCarry::SameWayEdge { ends } => {
                    let at_edge = &oracle.faces_of_edge[&sorted(ends)];
                    let same = at_edge
                        .iter()
                        .all(|&f| oracle.edges_of_face(f).contains(&ends));
                    assert!(at_edge.len() == 2 && same, "{case}, {name}: {why}");
                }
                CannotCarry::SeveralFans { vertex, fans } => {
                    let faces = oracle.faces_of_vertex[&vertex].len();
                    assert!(faces >= fans && fans > 1, "{case}, {name}: {why}");
                }
                CannotCarry::RepeatedVertex { .. } | CannotCarry::TooManyEdges { .. } => {
                    panic!("{case}, {name}: {why}")
                }
            }
        }
    }
}

#[test]
fn all_structures_give_the_answers_of_brute_force() {
    for (case, shape) in small_meshes() {
        let oracle = Oracle::of(&shape.1);
        for_each_structure!(answers(&shape, &oracle, case));
    }
}

/// The same on the meshes of others, where `MESHES` names a folder with them.
#[test]
fn all_structures_agree_on_the_meshes_of_others() {
    let Some(meshes) = std::env::var_os("MESHES") else {
        eprintln!("skipped: MESHES names no folder with meshes/");
        return;
    };
    let folder = Path::new(&meshes).join("meshes");
    for entry in folder.read_dir().unwrap() {
        let path = entry.unwrap().path();
        let Ok(mesh) = crate::io::read(&path, &crate::io::ReadOptions::default()) else {
            continue;
        };
        let shape = prepared(mesh);
        let oracle = Oracle::of(&shape.1);
        let case = path.file_name().unwrap().to_string_lossy();
        for_each_structure!(answers(&shape, &oracle, &case));
    }
}

/// Which small meshes those without non-manifold entities refuse, and why.
#[test]
fn what_is_not_manifold_is_refused_with_the_place() {
    let refused = |(positions, triangles): Shape| {
        let why = WingedEdge::build(&positions, &triangles).unwrap_err();
        let others = [
            SharedVertexWithNeighbours::build(&positions, &triangles).unwrap_err(),
            QuadEdge::build(&positions, &triangles).unwrap_err(),
            HalfEdge::build(&positions, &triangles).unwrap_err(),
            PairedHalfEdge::build(&positions, &triangles).unwrap_err(),
        ];
        assert_eq!(others, [why; 4]);
        why.to_string()
    };
    assert_eq!(
        refused(shapes::bow_tie()),
        "the faces around vertex 0 are 2 fans, one fits"
    );
    let fins = refused(shapes::three_fins(1));
    assert!(fins.ends_with("has 3 faces, one or two fit"), "{fins}");
    let strip = refused(shapes::moebius(12));
    assert!(
        strip.starts_with("both faces of the edge between"),
        "{strip}"
    );
    let twice = (shapes::tetrahedron().0, vec![[0, 1, 2], [0, 3, 0]]);
    assert_eq!(refused(twice.clone()), "face 1 has a vertex twice");
    assert!(DirectedEdges::<Small>::build(&twice.0, &twice.1).is_err());
}

/// Around a vertex inside, each neighbour and the one behind it have a face with the vertex.
fn rings_go_round<S: Structure<3>>((positions, triangles): &Shape) {
    let structure = S::build(positions, triangles).unwrap();
    let oracle = Oracle::of(triangles);
    for v in 0..positions.len() as u32 {
        let mut ring = Vec::new();
        structure.one_ring(Vertex::new(v as usize), |x| ring.push(x.index() as u32));
        for (i, &x) in ring.iter().enumerate() {
            let y = ring[(i + 1) % ring.len()];
            let mut faces = oracle.faces_of_vertex[&v].iter();
            let is_face = faces.any(|&f| [x, y].iter().all(|v| oracle.faces[f].contains(v)));
            assert!(is_face, "{}: {ring:?} around {v}", S::DESCRIPTION.name);
        }
    }
}

#[test]
fn links_lead_around_a_vertex_in_order() {
    for_each_linked_structure!(rings_go_round(&shapes::icosphere(2)));
    for_each_linked_structure!(rings_go_round(&shapes::torus(9, 6)));
}

/// By the words that are stored, a large closed mesh takes the bytes that paper and chapter state.
fn has_the_stated_size<S: Structure<3>>(shape: &Shape) {
    let (positions, triangles) = shape;
    let is = S::DESCRIPTION;
    let (a_face, a_vertex) = is.words.limits(3);
    assert_eq!(a_vertex, 2.0 * a_face, "{}", is.name);
    for (stated, limit) in [
        (is.stated_bytes_per_face, a_face),
        (is.stated_bytes_per_vertex, a_vertex),
    ] {
        if let Some(stated) = stated {
            assert_eq!(f64::from(stated), limit, "{}", is.name);
        }
    }
    // A closed mesh of any size: what is held is what the words say, within 2 % of what is stated.
    let bytes = S::build(positions, triangles).unwrap().bytes();
    let (v, f) = (positions.len(), triangles.len());
    assert_eq!(bytes, is.words.bytes(v, 3 * f / 2, f), "{}", is.name);
    for (bytes, limit) in [
        (bytes as f64 / f as f64, a_face),
        (bytes as f64 / v as f64, a_vertex),
    ] {
        assert!(
            (bytes / limit - 1.0).abs() < 0.02,
            "{}: {bytes} for {limit}",
            is.name
        );
    }
}

/// On a torus V = F/2 exactly; a sphere has two vertices more.
#[test]
fn bytes_are_those_of_the_paper_and_the_chapter() {
    for shape in [shapes::torus(30, 20), shapes::icosphere(3)] {
        for_each_structure!(has_the_stated_size(&shape));
    }
    assert_eq!(QuadEdge::DESCRIPTION.words.limits(3), (60.0, 120.0));
    assert_eq!(QuadDirectedEdges::DESCRIPTION.words.limits(4), (48.0, 48.0));
}

/// Marsaglia's xorshift.
fn random(seed: &mut u64, n: usize) -> usize {
    *seed ^= *seed << 13;
    *seed ^= *seed >> 7;
    *seed ^= *seed << 17;
    (*seed >> 16) as usize % n
}

/// Random flips, done to the list of faces too, leave the structure with the list's answers.
fn flips<S: Flip>((positions, triangles): &Shape, case: &str) {
    let Ok(mut structure) = S::build(positions, triangles) else {
        return;
    };
    let mut faces = triangles.clone();
    let mut seed = 0x5EED;
    let mut done = 0;
    for _ in 0..300 {
        let oracle = Oracle::of(&faces);
        let f = random(&mut seed, faces.len());
        let [a, b] = oracle.edges_of_face(f)[random(&mut seed, 3)];
        let at_edge = &oracle.faces_of_edge[&sorted([a, b])];
        let named = structure.face_edges(Face::new(f)).into_iter().find(|&e| {
            let ends = structure.edge_vertices(e).map(|v| v.index() as u32);
            sorted(ends) == sorted([a, b])
        });
        let named = named.unwrap();
        let apex = |f: usize| faces[f].into_iter().find(|v| ![a, b].contains(v)).unwrap();
        let expected = match at_edge[..] {
            [g, h] if oracle.edges_of_face(g + h - f).contains(&[b, a]) => {
                let (c, d) = (apex(f), apex(g + h - f));
                let is_free = c != d && !oracle.ring(c).contains(&d);
                is_free.then_some((g + h - f, c, d))
            }
            _ => None,
        };
        // Where two faces run the same way only their directed edges have no flip.
        let can = structure.flip_condition(named);
        assert_eq!(can, expected.is_some(), "{case}, {}", S::DESCRIPTION.name);
        if let Some((g, c, d)) = expected {
            structure.flip(named);
            (faces[f], faces[g]) = ([d, c, a], [c, d, b]);
            done += 1;
        }
    }
    assert!(done > 20 || faces.len() < 30, "{case}: {done} flips");
    agrees(&structure, positions, &Oracle::of(&faces), 1, case);
    loops_agree(&structure, positions, &Oracle::of(&faces), case);
}

#[test]
fn flips_keep_every_answer_right() {
    for (case, shape) in small_meshes() {
        if !shape.1.is_empty() {
            for_each_linked_structure!(flips(&shape, case));
        }
    }
}

/// A flip is a quarter turn.
fn four_flips_are_none<S: Flip>((positions, triangles): &Shape) {
    let mut structure = S::build(positions, triangles).unwrap();
    for f in (0..triangles.len()).map(Face::new) {
        for e in structure.face_edges(f) {
            if structure.flip_condition(e) {
                (0..4).for_each(|_| structure.flip(e));
            }
        }
    }
    agrees(
        &structure,
        positions,
        &Oracle::of(triangles),
        1,
        "four flips",
    );
}

#[test]
fn four_flips_of_an_edge_give_the_mesh_back() {
    for_each_linked_structure!(four_flips_are_none(&shapes::icosphere(2)));
    for_each_linked_structure!(four_flips_are_none(&shapes::grid(5, 4)));
}

/// A torus of `n` × `m` quads.
fn quad_torus(n: u32, m: u32) -> (Vec<Vec3>, Vec<[u32; 4]>) {
    let (positions, triangles) = shapes::torus(n, m);
    (positions, quads_of(&triangles))
}

/// The quads that pairs of triangles were cut from: [a, b, c], [a, c, d].
fn quads_of(triangles: &[[u32; 3]]) -> Vec<[u32; 4]> {
    let (pairs, _) = triangles.as_chunks::<2>();
    pairs
        .iter()
        .map(|&[[a, b, c], [.., d]]| [a, b, c, d])
        .collect()
}

/// Closed, open, of three fins, touching in a point, run along the same way.
#[test]
fn quads_give_the_answers_of_brute_force() {
    let of = |(positions, triangles): Shape| (positions, quads_of(&triangles));
    let (grid, quads) = of(shapes::grid(4, 4));
    let mut turned = quads.clone();
    turned[5].reverse();
    let diagonal = [quads[0], quads[5], quads[1]].to_vec();
    for (case, (positions, quads)) in [
        ("torus", quad_torus(9, 6)),
        ("grid", (grid.clone(), quads)),
        ("fins", of(shapes::three_fins(3))),
        ("turned", (grid.clone(), turned)),
        ("point", (grid.clone(), vec![diagonal[0], diagonal[1]])),
        ("corner", (grid, diagonal)),
        ("nothing", (Vec::new(), Vec::new())),
    ] {
        let mesh = QuadDirectedEdges::build(&positions, &quads).unwrap();
        mesh.check().unwrap();
        let oracle = Oracle::of(&quads);
        assert_eq!(mesh.edge_count(), oracle.faces_of_edge.len(), "{case}");
        agrees(&mesh, &positions, &oracle, 1, case);
        loops_agree(&mesh, &positions, &oracle, case);
    }
}

#[test]
fn quads_take_the_bytes_that_were_derived() {
    let (positions, quads) = quad_torus(30, 20);
    let mesh = QuadDirectedEdges::build(&positions, &quads).unwrap();
    assert_eq!(positions.len(), quads.len());
    assert_eq!(mesh.bytes(), 48 * quads.len());
    let twice = [[0, 1, 2, 0]];
    let why = QuadDirectedEdges::build(&positions, &twice).unwrap_err();
    assert_eq!(why, CannotCarry::RepeatedVertex { face: 0 });
}

/// The table has a row a structure, with numbers where the structure carries the mesh, and a reason
/// where it does not.
#[test]
fn measuring_fills_the_table() {
    let measured = |(positions, triangles): Shape| {
        measure(IndexedMesh::new(positions, triangles).unwrap()).unwrap()
    };
    let sphere = measured(shapes::icosphere(2));
    assert_eq!(
        (sphere.vertices, sphere.edges, sphere.faces),
        (162, 480, 320)
    );
    assert_eq!((sphere.boundary_edges, sphere.non_manifold_edges), (0, 0));
    assert_eq!(sphere.structures.len(), 10);
    for row in &sphere.structures {
        assert_eq!(row.cannot_carry, None);
        let limit = row.per_face.bytes_formula;
        assert!((row.per_face.bytes.unwrap() / limit - 1.0).abs() < 0.02);
        for query in Query::ALL {
            let is_answered = row.queries.get(query).ns.is_some_and(|ns| ns > 0.0);
            assert_eq!(is_answered, query != Query::BoundaryStep, "{query:?}");
        }
        let has_links = row.neighbourhood != Access::Searched;
        assert_eq!(row.edge_flip_ns.is_some(), has_links, "{}", row.structure);
    }
    let redundancy = |i: usize| sphere.structures[i].redundancy_share.unwrap();
    assert_eq!(redundancy(1), 0.0);
    assert!((redundancy(0) - 0.5).abs() < 0.01 && (redundancy(7) - 50.0 / 68.0).abs() < 0.01);

    let fins = measured(shapes::three_fins(2));
    let refused = fins
        .structures
        .iter()
        .filter(|row| row.cannot_carry.is_some());
    assert!(
        refused
            .clone()
            .all(|row| !row.carries_non_manifold && row.bytes.is_none())
    );
    assert_eq!(refused.count(), 5);
    let nothing = measured((Vec::new(), Vec::new()));
    assert!(
        nothing
            .structures
            .iter()
            .all(|row| row.per_face.bytes.is_none())
    );
}

#[test]
fn measuring_quads_leaves_out_what_is_none() {
    let (positions, mut quads) = quad_torus(9, 6);
    quads.push([0, 1, 1, 2]);
    let measured = measure_quads(&positions, &quads).unwrap();
    assert_eq!(
        (measured.faces, measured.dropped_faces, measured.edges),
        (54, 1, 108)
    );
    assert_eq!(measured.structures[0].per_face.bytes, Some(48.0));
    assert!(measure_quads(&positions, &[[0, 1, 2, 99]]).is_err());
    assert_eq!(measure_quads(&[], &[]).unwrap().faces, 0);
}
