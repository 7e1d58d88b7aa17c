//! What decimation promises on any input: thousands of small random complexes, most of them as
//! dirty as triangles can be, under every combination of options.
//!
//! Each case is made from its number alone; a failure names it, and
//! `CASE=1234 cargo test --test properties` runs that one.

use std::collections::{BTreeMap, BTreeSet};
use std::panic::{AssertUnwindSafe, catch_unwind};

use decimate::attributes::{Attributes, Channel, Group, Kind, NumberType, Property};
use decimate::clean::clean;
use decimate::decimate::{
    AttributeUse, Boundary, Chunks, Options, Placement, Quality, Report, StopReason, Targets,
    TierChoice, Topology, decimate,
};
use decimate::error::Error;
use decimate::indexed_mesh::{IndexedMesh, Parts};
use decimate::io::{self, ReadOptions, WriteOptions};
use decimate::mesh::Tier;
use decimate::metrics::{Info, info, info_of_file};
use decimate::repair::cut;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Random complexes; each is decimated in every tier.
const CASES: u64 = 12_000;

/// Marsaglia's xorshift, seeded with the case.
struct Random(u64);

impl Random {
    fn of(case: u64) -> Random {
        // Neighbouring seeds begin alike: a multiplication and a few steps part them.
        let mut random = Random(case.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        (0..8).for_each(|_| _ = random.next());
        random
    }

    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, n: usize) -> usize {
        ((self.next() >> 11) % n as u64) as usize
    }

    fn one_in(&mut self, n: usize) -> bool {
        self.below(n) == 0
    }

    /// A number between −1 and 1.
    fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }

    fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }

    fn shuffle<T>(&mut self, values: &mut [T]) {
        for i in (1..values.len()).rev() {
            values.swap(i, self.below(i + 1));
        }
    }
}

/// A complex, and options to decimate it with.
struct Case {
    mesh: IndexedMesh,
    options: Options,
}

fn case_of(case: u64) -> Case {
    let random = &mut Random::of(case);
    let triangles = match random.below(4) {
        0 => random_triangles(random),
        1 => sheet(random),
        2 => book(random),
        _ => sphere(random),
    };
    let mut triangles = soiled(random, triangles);
    // Faces in any order, from any corner.
    random.shuffle(&mut triangles);
    for triangle in &mut triangles {
        triangle.rotate_left(random.below(3));
    }
    let vertices = 1 + triangles.iter().flatten().max().map_or(0, |&v| v as usize);
    let positions = positions(random, vertices);
    Case {
        mesh: IndexedMesh::new(positions, triangles).unwrap(),
        options: options(random),
    }
}

/// Any triangles over few vertices: most edges have three faces or more, most vertices many fans.
fn random_triangles(random: &mut Random) -> Vec<[u32; 3]> {
    let vertices = 3 + random.below(10);
    let count = 1 + random.below(3 * vertices);
    let mut corner = || random.below(vertices) as u32;
    (0..count).map(|_| [corner(), corner(), corner()]).collect()
}

/// A grid of squares, some joined at opposite sides (a tube, a Möbius strip, a torus) and some with
/// holes.
fn sheet(random: &mut Random) -> Vec<[u32; 3]> {
    let (n, m) = (3 + random.below(5), 3 + random.below(5));
    let (is_tube, is_torus, is_twisted) = (random.one_in(2), random.one_in(4), random.one_in(3));
    let vertex = |i: usize, j: usize| {
        let j = if i == n && is_tube && is_twisted {
            m - j
        } else {
            j
        };
        let i = if is_tube { i % n } else { i };
        let j = if is_torus { j % m } else { j };
        (j * (n + 1) + i) as u32
    };
    let mut triangles = Vec::new();
    for (i, j) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
        let [a, b, c, d] = [
            vertex(i, j),
            vertex(i + 1, j),
            vertex(i + 1, j + 1),
            vertex(i, j + 1),
        ];
        if !random.one_in(12) {
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles
}

/// Two to five pages on one spine: an edge of as many faces, and a line of them to walk along.
fn book(random: &mut Random) -> Vec<[u32; 3]> {
    let (pages, length, width) = (
        2 + random.below(4),
        1 + random.below(5),
        1 + random.below(3),
    );
    let vertex = |page: usize, i: usize, j: usize| match j {
        0 => i as u32,
        _ => ((length + 1) * (1 + page * width + j - 1) + i) as u32,
    };
    let mut triangles = Vec::new();
    for page in 0..pages {
        for (i, j) in (0..length).flat_map(|i| (0..width).map(move |j| (i, j))) {
            let [a, b] = [vertex(page, i, j), vertex(page, i + 1, j)];
            let [c, d] = [vertex(page, i + 1, j + 1), vertex(page, i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    triangles
}

/// An octahedron, refined by putting vertices into faces and on edges at random: closed, genus 0.
fn sphere(random: &mut Random) -> Vec<[u32; 3]> {
    let mut triangles: Vec<[u32; 3]> = vec![
        [0, 1, 2],
        [0, 2, 3],
        [0, 3, 4],
        [0, 4, 1],
        [5, 2, 1],
        [5, 3, 2],
        [5, 4, 3],
        [5, 1, 4],
    ];
    for new in 6..6 + random.below(24) as u32 {
        let i = random.below(triangles.len());
        let [a, b, c] = triangles[i];
        if random.one_in(2) {
            triangles.splice(i..=i, [[a, b, new], [b, c, new], [c, a, new]]);
            continue;
        }
        // The edge from b to a of the other face is split by the same vertex.
        let other = triangles
            .iter()
            .position(|t| (0..3).any(|k| (t[k], t[(k + 1) % 3]) == (b, a)));
        let other = other.expect("the surface is closed");
        let d = triangles[other].into_iter().find(|&v| v != a && v != b);
        let d = d.expect("a face has three corners");
        triangles[i] = [a, new, c];
        triangles[other] = [b, new, d];
        triangles.extend([[new, b, c], [new, a, d]]);
    }
    triangles
}

/// The triangles with some of what files hold: repeated, opposite, turned, degenerate and missing
/// faces, and two vertices made one.
fn soiled(random: &mut Random, mut triangles: Vec<[u32; 3]>) -> Vec<[u32; 3]> {
    if random.one_in(3) || triangles.is_empty() {
        return triangles;
    }
    for _ in 0..random.below(6) {
        let i = random.below(triangles.len());
        let [a, b, c] = triangles[i];
        match random.below(7) {
            0 => triangles.push([b, c, a]),
            1 => triangles.push([b, a, c]),
            2 => triangles[i] = [b, a, c],
            3 => triangles.push([a, b, b]),
            4 if triangles.len() > 1 => _ = triangles.swap_remove(i),
            4 => {}
            5 => {
                let vertices = triangles.iter().flatten().max().map_or(0, |&v| v + 1);
                let other = random.below(vertices as usize) as u32;
                triangles.iter_mut().flatten().for_each(|v| {
                    if *v == a {
                        *v = other;
                    }
                });
            }
            _ => {
                // Every face with its back: closed sheets of no thickness.
                let backs: Vec<_> = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
                triangles.extend(backs);
            }
        }
        if triangles.len() > 400 {
            break;
        }
    }
    triangles
}

/// Positions: mostly somewhere, sometimes on a coarse lattice (equal ones weld, areas are zero),
/// all huge, all tiny, far away, or with a few that are not finite.
fn positions(random: &mut Random, vertices: usize) -> Vec<Vec3> {
    let kind = random.below(8);
    let scale = match kind {
        0 => 1.0e30,
        1 => 1.0e-30,
        2 => random.pick(&[1.0e-3, 1.0e3, 1.0e38, 1.0e-44]),
        _ => 1.0,
    };
    let offset = if kind == 3 { 1.0e6 } else { 0.0 };
    let mut positions: Vec<Vec3> = (0..vertices)
        .map(|_| {
            let p = Vec3::new(random.unit(), random.unit(), random.unit());
            match kind {
                4 => (p * 2.0).round(),
                5 => Vec3::new(p.x, p.y, 0.0),
                _ => p * scale + offset,
            }
        })
        .collect();
    if kind == 6 {
        for _ in 0..1 + random.below(3) {
            let v = random.below(vertices);
            let odd = [f32::NAN, f32::INFINITY, f32::MAX, f32::MIN, -0.0, 1.0e-45];
            positions[v][random.below(3)] = random.pick(&odd);
        }
    }
    positions
}

fn options(random: &mut Random) -> Options {
    let mut targets = Targets::default();
    let kind = random.below(8);
    if kind < 5 || kind == 7 {
        targets.ratio = Some(random.pick(&[0.0, 0.0, 0.1, 0.5, 0.9]));
    }
    if kind == 5 || kind == 7 {
        targets.triangles = Some(random.below(40));
    }
    if kind >= 6 {
        targets.max_error = Some(random.pick(&[0.0, 1e-6, 0.05, 1.0, 1e30]));
    }
    Options {
        targets,
        boundary: random.pick(&[Boundary::Keep, Boundary::Lock, Boundary::Free]),
        placement: random.pick(&[Placement::Optimal, Placement::Endpoint]),
        quality: random.pick(&[Quality::Fast, Quality::Standard, Quality::Best]),
        feature_angle_degrees: random.pick(&[None, None, Some(30.0)]),
        weld: !random.one_in(3),
        chunks: random.pick(&[Chunks::Auto, Chunks::Triangles(6), Chunks::Triangles(30)]),
        check: true,
        ..Options::default()
    }
}

/// Runs a property on every case, and names those that fail.
fn for_each_case(cases: u64, property: impl Fn(u64) + Sync) {
    let range = match std::env::var("CASE") {
        Ok(case) => {
            let case: u64 = case.parse().expect("CASE is a number");
            case..case + 1
        }
        Err(_) => 0..cases,
    };
    let failed: Vec<String> = range
        .into_par_iter()
        .filter_map(|case| {
            let payload = catch_unwind(AssertUnwindSafe(|| property(case))).err()?;
            let message = payload.downcast_ref::<String>().map(String::as_str);
            let message = message.or(payload.downcast_ref::<&str>().copied());
            Some(format!("CASE={case}: {}", message.unwrap_or("a panic")))
        })
        .collect();
    assert!(
        failed.is_empty(),
        "{} cases fail, of which the first are\n{}",
        failed.len(),
        failed[..failed.len().min(5)].join("\n")
    );
}

fn run(mesh: &IndexedMesh, options: &Options, tier: Tier) -> Result<(IndexedMesh, Report), Error> {
    let options = Options {
        tier: TierChoice::Fixed(tier),
        ..options.clone()
    };
    decimate(mesh.clone(), &options)
}

/// The mesh and its report, or nothing where the input holds no proper triangle, which is said.
fn decimated(case: u64, mesh: &IndexedMesh, options: &Options) -> Option<(IndexedMesh, Report)> {
    match run(mesh, options, Tier::Small) {
        Ok(done) => Some(done),
        Err(Error::InvalidMesh(why)) => {
            let (cleaned, _) = clean(mesh.clone(), options.weld).unwrap();
            assert!(cleaned.triangles().is_empty(), "case {case}: {why}");
            None
        }
        Err(other) => panic!("case {case}: {other}"),
    }
}

type Bits = [u32; 3];

fn bits(mesh: &IndexedMesh) -> Vec<Bits> {
    let bits = |p: &Vec3| p.to_array().map(f32::to_bits);
    mesh.positions().iter().map(bits).collect()
}

#[track_caller]
fn assert_same(a: &IndexedMesh, b: &IndexedMesh, what: &str) {
    assert_eq!(a.triangles(), b.triangles(), "{what}: triangles");
    assert_eq!(a.double_sided(), b.double_sided(), "{what}: flags");
    assert_eq!(bits(a), bits(b), "{what}: positions");
    let (a, b) = (a.attributes(), b.attributes());
    assert_eq!(a.corners, b.corners, "{what}: wedges");
    assert_eq!(a.group_of, b.group_of, "{what}: groups");
    let bits = |attributes: &Attributes| -> Vec<u64> {
        let channels = attributes.channels.iter();
        let values = channels.flat_map(|c| (0..c.values.len()).map(|i| c.values.get(i)));
        values.map(f64::to_bits).collect()
    };
    assert_eq!(bits(a), bits(b), "{what}: attributes");
}

/// Counts that a collapse may not change.
fn topology(info: &Info) -> (usize, i64, bool) {
    (
        info.components,
        info.euler_characteristic,
        info.is_orientable,
    )
}

/// The vertex pairs that three faces or more share.
fn non_manifold_edges(mesh: &IndexedMesh) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = mesh
        .triangles()
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    let crowded = edges.chunk_by(|a, b| a == b).filter(|same| same.len() > 2);
    crowded.map(|same| same[0]).collect()
}

/// How many pieces edges form that are joined where they share a vertex. Of a manifold's boundary
/// they are its loops.
fn pieces(edges: impl IntoIterator<Item = [u32; 2]>) -> usize {
    let mut pieces: Vec<BTreeSet<u32>> = Vec::new();
    for edge in edges {
        let touches = |piece: &mut BTreeSet<u32>| edge.iter().any(|v| piece.contains(v));
        let mut joined: BTreeSet<u32> = pieces.extract_if(.., touches).flatten().collect();
        joined.extend(edge);
        pieces.push(joined);
    }
    pieces.len()
}

/// The vertices whose link (the edges across from them in their faces) is not one path or circle.
fn non_manifold_vertices(mesh: &IndexedMesh) -> Vec<u32> {
    let mut links: BTreeMap<u32, Vec<[u32; 2]>> = BTreeMap::new();
    for &[a, b, c] in mesh.triangles() {
        for (v, across) in [(a, [b, c]), (b, [c, a]), (c, [a, b])] {
            links.entry(v).or_default().push(across);
        }
    }
    let is_crowded_or_torn = |link: &Vec<[u32; 2]>| {
        let mut degrees: BTreeMap<u32, usize> = BTreeMap::new();
        link.iter()
            .flatten()
            .for_each(|&v| *degrees.entry(v).or_default() += 1);
        degrees.values().any(|&degree| degree > 2) || pieces(link.iter().copied()) > 1
    };
    let bad = links
        .into_iter()
        .filter(|(_, link)| is_crowded_or_torn(link));
    bad.map(|(v, _)| v).collect()
}

/// Whatever goes in, nothing is non-manifold after a cut: by brute force and as `info` counts; the
/// faces are those of before, corner by corner, the vertices too, and copies behind them; cutting
/// again changes nothing.
#[test]
fn a_cut_leaves_a_manifold_of_the_same_faces() {
    for_each_case(CASES, |case| {
        let Case { mesh, options } = case_of(case);
        let (after, report) = cut(mesh.clone(), options.weld).unwrap();
        let (before, _) = clean(mesh, report.cleaning.welded_vertices > 0).unwrap();
        assert_eq!(non_manifold_edges(&after), [[0; 2]; 0], "case {case}");
        assert_eq!(non_manifold_vertices(&after), [0; 0], "case {case}");
        for info in [
            info(after.clone(), false).unwrap(),
            info_of_file(after.clone()).unwrap(),
        ] {
            assert!(info.is_manifold(), "case {case}: {info:?}");
        }
        let count = before.positions().len();
        assert_eq!(bits(&after)[..count], bits(&before), "case {case}");
        assert_eq!(bits(&after).len(), count + report.vertices_copied);
        let corners = |mesh: &IndexedMesh| -> Vec<[Bits; 3]> {
            let at = bits(mesh);
            let faces = mesh.triangles().iter();
            faces.map(|t| t.map(|v| at[v as usize])).collect()
        };
        assert_eq!(corners(&after), corners(&before), "case {case}");
        assert_eq!(after.double_sided(), before.double_sided(), "case {case}");
        let was_manifold =
            report.non_manifold_edges_in == 0 && report.non_manifold_vertices_in == 0;
        assert_eq!(report.vertices_copied == 0, was_manifold, "case {case}");
        let (again, _) = cut(after.clone(), options.weld).unwrap();
        assert_same(&again, &after, &format!("case {case}"));
    });
}

/// How many volumes a complex encloses: its faces less the rank of their boundaries, modulo 2.
/// With components and Euler characteristic equal, so is then the number of independent loops.
fn second_betti_number(mesh: &IndexedMesh) -> usize {
    // Columns of the boundary matrix, each reduced until no other has its last edge.
    let mut columns: BTreeMap<[u32; 2], BTreeSet<[u32; 2]>> = BTreeMap::new();
    let mut enclosed = 0;
    for &[a, b, c] in mesh.triangles() {
        let edges = [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)]);
        let mut column = BTreeSet::from(edges);
        while let Some(last) = column.last() {
            match columns.get(last) {
                Some(other) => column = &column ^ other,
                None => break,
            }
        }
        match column.last() {
            Some(&last) => _ = columns.insert(last, column),
            None => enclosed += 1,
        }
    }
    enclosed
}

/// No face with a repeated vertex or twice, no vertex without a face, all of them finite.
fn assert_complex(case: u64, mesh: &IndexedMesh) {
    let mut faces = BTreeSet::new();
    let mut used = vec![false; mesh.positions().len()];
    for &face in mesh.triangles() {
        let mut sorted = face;
        sorted.sort_unstable();
        assert!(
            sorted[0] < sorted[1] && sorted[1] < sorted[2],
            "case {case}: face {face:?} has a vertex twice"
        );
        assert!(faces.insert(sorted), "case {case}: face {face:?} twice");
        face.iter().for_each(|&v| used[v as usize] = true);
    }
    assert!(!used.contains(&false), "case {case}: a vertex has no face");
    assert!(
        mesh.positions().iter().all(|p| p.is_finite()),
        "case {case}: a position is not finite"
    );
}

/// What the properties below are measured with, on complexes whose answers are known: a closed
/// tetrahedron; three triangles on one edge; two triangles at one vertex; the projective plane on
/// six vertices, whose rank modulo 2 counts it as enclosing.
#[test]
fn the_measures_know_small_complexes() {
    let tetrahedron = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let fins = [[0, 1, 2], [1, 0, 3], [0, 1, 4]];
    let bow_tie = [[0, 1, 2], [0, 3, 4]];
    let projective_plane = [
        [0, 1, 2],
        [0, 2, 3],
        [0, 3, 4],
        [0, 4, 5],
        [0, 5, 1],
        [1, 2, 4],
        [2, 3, 5],
        [3, 4, 1],
        [4, 5, 2],
        [5, 1, 3],
    ];
    let measured = |triangles: &[[u32; 3]]| {
        let mesh = IndexedMesh::new(vec![Vec3::ZERO; 6], triangles.to_vec()).unwrap();
        (
            second_betti_number(&mesh),
            pieces(rim_edges(&mesh)),
            non_manifold_edges(&mesh).len(),
            non_manifold_vertices(&mesh),
        )
    };
    assert_eq!(measured(&tetrahedron), (1, 0, 0, vec![]));
    assert_eq!(measured(&fins), (0, 1, 1, vec![0, 1]));
    assert_eq!(measured(&bow_tie), (0, 1, 0, vec![0]));
    assert_eq!(measured(&projective_plane), (1, 0, 0, vec![]));
}

/// The main one: whatever goes in, it does not panic, every invariant holds after every collapse,
/// each tier gives the same bits and counts, and the result is what was promised.
#[test]
fn any_input_keeps_its_topology_in_every_tier() {
    for_each_case(CASES, |case| {
        let Case { mesh, options } = case_of(case);
        keeps_its_topology(case, &mesh, &options);
    });
}

/// The same with attributes: normals, texture coordinates, colours and scalars that may differ at every
/// corner and be no numbers, and groups. What is carried is as valid as what was given.
#[test]
fn any_attributes_are_carried_in_every_tier() {
    for_each_case(CASES / 3, |case| {
        let Case { mesh, options } = case_of(case);
        let random = &mut Random::of(!case);
        let options = Options {
            attributes: random.pick(&[AttributeUse::Optimize, AttributeUse::Carry]),
            ..options
        };
        let mesh = attributed(random, mesh);
        let groups = mesh.attributes().groups.len();
        let has_strange = values(&mesh).any(|x| !x.is_finite());
        let Some(output) = keeps_its_topology(case, &mesh, &options) else {
            return;
        };
        let attributes = output.attributes();
        assert_eq!(attributes.groups.len(), groups, "case {case}");
        assert_eq!(attributes.channels.len(), mesh.attributes().channels.len());
        assert!(
            has_strange || values(&output).all(f64::is_finite),
            "case {case}: an attribute is no number any more"
        );
        for channel in attributes.channels.iter().filter(|c| c.kind == Kind::Color) {
            for wedge in 0..channel.rows() {
                let is_byte = |x: f64| x.fract() == 0.0 && (0.0..=255.0).contains(&x);
                assert!(
                    channel.row(wedge).all(is_byte),
                    "case {case}: a colour is none"
                );
            }
        }
    });
}

/// All numbers that a mesh carries.
fn values(mesh: &IndexedMesh) -> impl Iterator<Item = f64> {
    let channels = mesh.attributes().channels.iter();
    channels.flat_map(|c| (0..c.values.len()).map(|i| c.values.get(i)))
}

/// The mesh with random attributes: the same at all corners of a vertex, or one of two rows by the side
/// of a plane that the face lies on, or anything at any corner.
fn attributed(random: &mut Random, mesh: IndexedMesh) -> IndexedMesh {
    let property = |name: &str, number| Property {
        name: name.into(),
        number,
    };
    let all = [
        Channel::of_singles(Kind::Normal, &["nx", "ny", "nz"]),
        Channel::of_singles(Kind::TextureCoordinate, &["s", "t"]),
        Channel::new(
            Kind::Color,
            ["red", "green", "blue"]
                .map(|c| property(c, NumberType::U8))
                .into(),
        ),
        Channel::new(Kind::Scalar, vec![property("quality", NumberType::F64)]),
    ];
    let channels: Vec<Channel> = all.into_iter().filter(|_| random.one_in(2)).collect();
    let mut attributes = Attributes {
        channels,
        ..Attributes::default()
    };
    let kind = random.below(3);
    let strange = random.one_in(8);
    let seed = random.below(1000);
    for (i, triangle) in mesh.triangles().iter().enumerate() {
        if attributes.channels.is_empty() {
            break;
        }
        let first = 3 * i as u32;
        attributes.corners.push([first, first + 1, first + 2]);
        for (k, &v) in triangle.iter().enumerate() {
            let of = match kind {
                0 => v as usize,
                1 => 2 * v as usize + usize::from(triangle.iter().sum::<u32>() % 7 < 3),
                _ => 3 * i + k,
            };
            let row = &mut Random::of((1000 * of + seed) as u64);
            for channel in &mut attributes.channels {
                for _ in 0..channel.width() {
                    channel.values.push(match channel.kind {
                        Kind::Color => row.below(256) as f64,
                        _ if strange && row.one_in(5) => {
                            row.pick(&[f64::NAN, f64::INFINITY, 1e30, -0.0])
                        }
                        _ => f64::from(row.unit()),
                    });
                }
            }
        }
    }
    attributes.merge_equal_wedges(mesh.triangles());
    attributes.split_shared_wedges(mesh.triangles());
    if random.one_in(2) {
        attributes.groups = vec![Group::default(); 3];
        let group = |t: &[u32; 3]| t.iter().sum::<u32>() % 5 % 3;
        attributes.group_of = mesh.triangles().iter().map(group).collect();
    }
    mesh.with_attributes(attributes).unwrap()
}

/// Holds what decimation makes of a mesh, in every tier, against what was promised; the output, where
/// there is one.
fn keeps_its_topology(case: u64, mesh: &IndexedMesh, options: &Options) -> Option<IndexedMesh> {
    let (output, report) = decimated(case, mesh, options)?;
    assert_complex(case, &output);
    for tier in [Tier::Medium, Tier::Full] {
        let (other, other_report) = run(mesh, options, tier).unwrap();
        let what = format!("case {case}, {} against small", tier.name());
        assert_same(&other, &output, &what);
        let counts = |r: &Report| {
            (
                [
                    r.tally.rejected_link,
                    r.tally.rejected_flip,
                    r.tally.rejected_lock,
                    r.tally.rejected_error,
                ],
                [
                    r.tally.collapses,
                    r.tally.collapses_non_manifold,
                    r.triangles_out,
                ],
                r.max_error_estimate.to_bits(),
                (r.stop_reason, r.blocked, r.cleaning),
            )
        };
        assert_eq!(counts(&other_report), counts(&report), "{what}");
    }

    let (cleaned, _) = clean(mesh.clone(), options.weld).unwrap();
    // Without welding: an output's vertices may come to lie at one place, and stay apart.
    let before = info(cleaned.clone(), false).unwrap();
    let after = info(output.clone(), false).unwrap();
    assert_eq!(
        topology(&after),
        topology(&before),
        "case {case}: components, Euler characteristic, orientable"
    );
    assert_eq!(
        after.cleaning.kept_faces,
        output.triangles().len(),
        "case {case}"
    );
    assert_eq!(
        second_betti_number(&output),
        second_betti_number(&cleaned),
        "case {case}: enclosed volumes"
    );
    if before.non_manifold_edges == 0 && before.non_manifold_vertices == 0 {
        let loops = pieces(rim_edges(&cleaned));
        assert_eq!(pieces(rim_edges(&output)), loops, "case {case}: loops");
        assert_eq!(after.genus, before.genus, "case {case}: genus");
        // Without an orientation info's loops are cut where faces disagree.
        if before.is_orientable {
            assert_eq!(before.boundary_loops, loops, "case {case}: info's loops");
            assert_eq!(after.boundary_loops, loops, "case {case}: info's loops");
        }
    }
    let bad = (
        non_manifold_vertices(&cleaned),
        non_manifold_vertices(&output),
    );
    assert_eq!(
        (before.non_manifold_vertices, after.non_manifold_vertices),
        (bad.0.len(), bad.1.len()),
        "case {case}: info's non-manifold vertices {bad:?}"
    );
    assert!(
        after.boundary_edges <= before.boundary_edges
            && after.non_manifold_edges <= before.non_manifold_edges
            && bad.1.len() <= bad.0.len(),
        "case {case}: born from {before:?}: {after:?}"
    );
    let crowded = (non_manifold_edges(&cleaned), non_manifold_edges(&output));
    assert_eq!(
        (before.non_manifold_edges, after.non_manifold_edges),
        (crowded.0.len(), crowded.1.len()),
        "case {case}: info's non-manifold edges {crowded:?}"
    );
    if before.inconsistent_edges == 0 {
        assert_eq!(after.inconsistent_edges, 0, "case {case}");
    }
    assert_eq!(report.triangles_out, output.triangle_count(), "case {case}");
    assert_eq!(
        cleaned.positions().len() - output.positions().len(),
        report.tally.collapses,
        "case {case}: a vertex goes with a collapse"
    );
    // Above the target only with a reason.
    assert_eq!(
        report.triangles_out > report.target_triangles,
        report.stop_reason != StopReason::Target,
        "case {case}: {report:?}"
    );
    assert_eq!(
        report.blocked.is_some(),
        report.stop_reason != StopReason::Target,
        "case {case}: {report:?}"
    );
    Some(output)
}

/// Where the topology may change it becomes simpler: nothing tears, nothing becomes less manifold,
/// no component is born (but from one that hung on a vertex), something is left; and each tier gives the same bits.
#[test]
fn a_simplified_topology_is_no_worse() {
    for_each_case(CASES, |case| {
        let Case { mesh, mut options } = case_of(case);
        options.topology = Topology::Simplify;
        let Some((output, report)) = decimated(case, &mesh, &options) else {
            return;
        };
        assert_complex(case, &output);
        assert!(!output.triangles().is_empty(), "case {case}: nothing left");
        let (other, _) = run(&mesh, &options, Tier::Full).unwrap();
        assert_same(&other, &output, &format!("case {case}: full against small"));
        let (cleaned, _) = clean(mesh.clone(), options.weld).unwrap();
        let before = info(cleaned, false).unwrap();
        let after = info(output.clone(), false).unwrap();
        assert!(
            after.boundary_edges <= before.boundary_edges
                && after.non_manifold_edges <= before.non_manifold_edges
                && after.non_manifold_vertices <= before.non_manifold_vertices
                && (before.non_manifold_vertices > 0 || after.components <= before.components),
            "case {case}: born from {before:?}: {after:?}"
        );
        assert!(
            before.inconsistent_edges > 0 || after.inconsistent_edges == 0,
            "case {case}: runs against its neighbours"
        );
        assert_eq!(report.triangles_out, output.triangle_count(), "case {case}");
        assert_eq!(
            report.triangles_out > report.target_triangles,
            report.stop_reason != StopReason::Target,
            "case {case}: {report:?}"
        );
    });
}

/// With ends for places every vertex is one of the input's; with a locked boundary every boundary
/// vertex is one of the output's. Bit for bit.
#[test]
fn endpoints_and_locks_keep_bits() {
    for_each_case(CASES / 3, |case| {
        let Case { mesh, mut options } = case_of(case);
        options.check = false;
        let (cleaned, _) = clean(mesh.clone(), options.weld).unwrap();
        options.placement = Placement::Endpoint;
        options.boundary = Boundary::Keep;
        if let Some((output, _)) = decimated(case, &mesh, &options) {
            let before: BTreeSet<Bits> = bits(&cleaned).into_iter().collect();
            let is_old = |p: &Bits| before.contains(p);
            assert!(bits(&output).iter().all(is_old), "case {case}: a new place");
        }
        options.placement = Placement::Optimal;
        options.boundary = Boundary::Lock;
        if let Some((output, _)) = decimated(case, &mesh, &options) {
            let after: BTreeSet<Bits> = bits(&output).into_iter().collect();
            for p in rim(&cleaned) {
                assert!(after.contains(&p), "case {case}: {p:?} was locked");
            }
            assert_eq!(
                rim_edges(&output).len(),
                rim_edges(&cleaned).len(),
                "case {case}: a locked boundary edge went"
            );
        }
    });
}

/// The edges of one face.
fn rim_edges(mesh: &IndexedMesh) -> Vec<[u32; 2]> {
    let mut edges: Vec<[u32; 2]> = mesh
        .triangles()
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    let lonely = edges.chunk_by(|a, b| a == b).filter(|same| same.len() == 1);
    lonely.map(|same| same[0]).collect()
}

fn rim(mesh: &IndexedMesh) -> Vec<Bits> {
    let bits = bits(mesh);
    let vertices = rim_edges(mesh).into_iter().flatten();
    vertices.map(|v| bits[v as usize]).collect()
}

/// An output is clean, and to keep all of it changes nothing.
#[test]
fn the_output_of_the_output_is_equal() {
    for_each_case(CASES / 3, |case| {
        let Case { mesh, options } = case_of(case);
        let Some((once, _)) = decimated(case, &mesh, &options) else {
            return;
        };
        let all = Options {
            targets: Targets {
                ratio: Some(1.0),
                ..Targets::default()
            },
            weld: false,
            ..options
        };
        let (twice, report) = decimated(case, &once, &all).expect("has triangles");
        assert_same(&twice, &once, &format!("case {case}"));
        assert_eq!(report.tally.collapses, 0, "case {case}");
    });
}

/// The order of faces and the corner that each begins with may break ties otherwise: the shape of
/// the result may differ, its topology not.
#[test]
fn the_order_of_faces_does_not_reach_the_topology() {
    for_each_case(CASES / 3, |case| {
        let Case { mesh, options } = case_of(case);
        let Some((output, _)) = decimated(case, &mesh, &options) else {
            return;
        };
        let mut random = Random::of(!case);
        let Parts {
            origin,
            positions,
            mut triangles,
            ..
        } = mesh.into_parts();
        random.shuffle(&mut triangles);
        for triangle in &mut triangles {
            triangle.rotate_left(random.below(3));
        }
        let shuffled = IndexedMesh::with_origin(origin, positions, triangles).unwrap();
        let (other, _) = decimated(case, &shuffled, &options).expect("has triangles");
        let of = |mesh| topology(&info(mesh, false).unwrap());
        assert_eq!(of(other), of(output), "case {case}");
    });
}

/// A scale by a power of two is exact in every step: the same triangles at scaled places.
#[test]
fn scaling_by_a_power_of_two_scales_the_output() {
    for_each_case(CASES / 3, |case| {
        let Case { mesh, mut options } = case_of(case);
        options.check = false;
        // Scaled, the largest numbers overflow and the smallest lose bits.
        let is_ordinary = |x: f32| x == 0.0 || (1.0e-15..1.0e15).contains(&x.abs());
        let all = || mesh.positions().iter().flat_map(|p| p.to_array());
        if !all().all(is_ordinary) {
            return;
        }
        let Some((output, _)) = decimated(case, &mesh, &options) else {
            return;
        };
        let scaled = |mesh: &IndexedMesh| {
            let parts = mesh.clone().into_parts();
            let positions = parts.positions.into_iter().map(|p| p * 8.0).collect();
            let mesh = IndexedMesh::with_origin(parts.origin, positions, parts.triangles).unwrap();
            mesh.with_double_sided(parts.double_sided).unwrap()
        };
        options.targets.max_error = options.targets.max_error.map(|e| e * 8.0);
        let (other, _) = decimated(case, &scaled(&mesh), &options).expect("has triangles");
        assert_same(&other, &scaled(&output), &format!("case {case}"));
    });
}

/// What was decimated is written and read back in every format, its corners equal in single
/// precision: to the bit, but for text of a mesh far from zero, which is read as doubles around an
/// origin of its own.
#[test]
fn results_survive_every_format() {
    let folder = tempfile::tempdir().unwrap();
    for_each_case(CASES / 20, |case| {
        let Case { mesh, mut options } = case_of(case);
        options.check = false;
        let Some((output, _)) = decimated(case, &mesh, &options) else {
            return;
        };
        let corners = |mesh: &IndexedMesh| -> Vec<[Bits; 3]> {
            let bits = match mesh.origin() {
                DVec3::ZERO => bits(mesh),
                _ => {
                    let single = |p: DVec3| p.as_vec3().to_array().map(f32::to_bits);
                    mesh.points().map(single).collect()
                }
            };
            mesh.sides().map(|t| t.map(|v| bits[v as usize])).collect()
        };
        for (extension, ascii) in [
            ("ply", false),
            ("ply", true),
            ("obj", false),
            ("stl", false),
            ("stl", true),
            ("off", false),
        ] {
            let path = folder.path().join(format!("{case}-{ascii}.{extension}"));
            let write = WriteOptions {
                ascii,
                ..WriteOptions::default()
            };
            io::write(&path, &output, &write).unwrap();
            let back = io::read(&path, &ReadOptions::default()).unwrap();
            std::fs::remove_file(&path).unwrap();
            let what = format!("case {case}, {extension}, ascii {ascii}");
            assert_eq!(corners(&back), corners(&output), "{what}");
            if extension != "stl" {
                assert_eq!(back.positions().len(), output.positions().len(), "{what}");
            }
            let is_text = ascii || extension == "obj" || extension == "off";
            assert!(is_text || back.origin() == DVec3::ZERO, "{what}: moved");
        }
    });
}

/// The cases are what they are meant to be, or all of this shows little: each kind of dirt and of
/// stopping is among them, and many collapses next to something non-manifold.
#[test]
fn the_cases_cover_what_can_happen() {
    let mut found = BTreeMap::new();
    for case in 0..CASES / 12 {
        let Case { mesh, options } = case_of(case);
        let mut count = |what, n: usize| *found.entry(what).or_insert(0) += n;
        let Some((output, report)) = decimated(case, &mesh, &options) else {
            count("nothing left", 1);
            continue;
        };
        let before = info(mesh, options.weld).unwrap();
        count("collapses", report.tally.collapses);
        count(
            "collapses non-manifold",
            report.tally.collapses_non_manifold,
        );
        count("rejected for the link", report.tally.rejected_link);
        count("rejected for a flip", report.tally.rejected_flip);
        count("rejected for a lock", report.tally.rejected_lock);
        count("rejected for the error", report.tally.rejected_error);
        count("welded", report.cleaning.welded_vertices);
        count("degenerate", report.cleaning.dropped_degenerate_faces);
        count("duplicate", report.cleaning.dropped_duplicate_faces);
        count("not finite", report.cleaning.dropped_non_finite_faces);
        count("folded", report.cleaning.folded_faces);
        count("turned", report.reoriented_faces);
        count("not orientable", usize::from(!before.is_orientable));
        count("genus 1", usize::from(before.genus == Some(1)));
        count("closed", usize::from(before.boundary_edges == 0));
        count("non-manifold edges left", non_manifold_edges(&output).len());
        for reason in [
            StopReason::Target,
            StopReason::MaxError,
            StopReason::Blocked,
        ] {
            let name = match reason {
                StopReason::Target => "stopped at the target",
                StopReason::MaxError => "stopped at the error",
                _ => "blocked",
            };
            count(name, usize::from(report.stop_reason == reason));
        }
    }
    eprintln!("{found:#?}");
    for (what, n) in found {
        assert!(n >= 5, "{what}: only {n}");
    }
}
