//! Every kind of triangle list that a file can hold, by name and on purpose; `properties` meets them
//! by chance and together.

use std::f32::consts::TAU;

use decimate::clean::Cleaning;
use decimate::decimate::{StopReason, Topology};
use decimate::error::Error;
use rayon::prelude::*;

use super::*;

/// Every invariant is verified after every collapse up to so many triangles: linear time each.
const MOST_CHECKED: usize = 400;

/// A list of triangles, and what is known of it.
struct Case {
    name: &'static str,
    shape: Shape,
    /// Whether vertices at one place are one.
    weld: bool,
    /// What cleaning finds; what it keeps is not looked at.
    found: Cleaning,
    /// The edges of three faces or more.
    non_manifold_edges: usize,
    /// Components, Euler characteristic, whether it is orientable: before and after.
    topology: (usize, i64, bool),
    /// The triangles that it comes down to, at most, if all that can go should.
    fewest: usize,
}

fn case(
    name: &'static str,
    shape: Shape,
    topology: (usize, i64, bool),
    fewest: usize,
    found: Cleaning,
) -> Case {
    Case {
        name,
        shape,
        weld: true,
        found,
        non_manifold_edges: 0,
        topology,
        fewest,
    }
}

/// The case, with one edge of many faces.
fn on_one_edge(case: Case) -> Case {
    Case {
        non_manifold_edges: 1,
        ..case
    }
}

/// A tube of `n` × `m` squares through itself, its ends joined turned over: closed, without an inside.
fn klein_bottle(n: u32, m: u32) -> Shape {
    let mut positions = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let (u, v) = (i as f32 / n as f32 * TAU, j as f32 / m as f32 * TAU);
            let (half_sin, half_cos) = (u / 2.0).sin_cos();
            let r = 2.0 + half_cos * v.sin() - half_sin * (2.0 * v).sin();
            let height = half_sin * v.sin() + half_cos * (2.0 * v).sin();
            positions.push(Vec3::new(r * u.cos(), r * u.sin(), height));
        }
    }
    let id = |i: u32, j: u32| match i == n {
        // Turned over: what ran forwards round the tube runs backwards.
        true => (m - j % m) % m,
        false => i * m + j % m,
    };
    (positions, squares(n, m, id))
}

/// So many vertices on a circle around a hub, and the triangles between.
fn wheel(spokes: u32, is_closed: bool) -> Shape {
    let on_rim = |i: u32| {
        let angle = f64::from(i) / f64::from(spokes) * std::f64::consts::TAU;
        Vec3::new(angle.cos() as f32, angle.sin() as f32, 0.0)
    };
    let mut positions = vec![Vec3::new(0.0, 0.0, 0.3)];
    positions.extend((0..spokes).map(on_rim));
    let around = |hub: u32| {
        let triangle = move |i| [hub, 1 + i, 1 + (i + 1) % spokes];
        (0..spokes).map(triangle)
    };
    let mut triangles: Vec<_> = around(0).collect();
    if is_closed {
        positions.push(Vec3::new(0.0, 0.0, -0.3));
        let below = around(spokes + 1).map(|[a, b, c]| [a, c, b]);
        triangles.extend(below);
    }
    (positions, triangles)
}

/// So many triangles on the one edge from 0 to 1, each a page divided in `rows`.
fn book(pages: u32, rows: u32) -> Shape {
    let mut positions = vec![Vec3::ZERO, Vec3::Z];
    let mut triangles = Vec::new();
    for page in 0..pages {
        let angle = page as f32 / pages as f32 * TAU;
        let out = Vec3::new(angle.cos(), angle.sin(), 0.5);
        let mut base = [0, 1];
        for row in 1..rows {
            let share = row as f32 / rows as f32;
            let first = positions.len() as u32;
            positions.extend([Vec3::ZERO.lerp(out, share), Vec3::Z.lerp(out, share)]);
            let [a, b] = base;
            triangles.extend([[a, first, b], [b, first, first + 1]]);
            base = [first, first + 1];
        }
        triangles.push([base[0], positions.len() as u32, base[1]]);
        positions.push(out);
    }
    (positions, triangles)
}

/// So many sheets, of 8 triangles each, that share one corner.
fn sheets_at_one_vertex(sheets: u32) -> Shape {
    let (sheet, faces) = shapes::grid(2, 2);
    let mut positions = vec![Vec3::ZERO];
    let mut triangles = Vec::new();
    for k in 0..sheets {
        let angle = k as f32 / sheets as f32 * TAU;
        let first = positions.len() as u32 - 1;
        let turn = glam::Quat::from_rotation_z(angle) * glam::Quat::from_rotation_x(1.2);
        positions.extend(sheet[1..].iter().map(|&p| turn * p));
        let renamed = faces
            .iter()
            .map(|t| t.map(|v| if v == 0 { 0 } else { first + v }));
        triangles.extend(renamed);
    }
    (positions, triangles)
}

fn lone_triangles(n: u32) -> Shape {
    let mut positions = Vec::new();
    for i in 0..n {
        let at = Vec3::new((i % 1000) as f32, (i / 1000) as f32, 0.0);
        positions.extend([at, at + 0.5 * Vec3::X, at + 0.5 * Vec3::Y]);
    }
    let triangles = (0..n).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    (positions, triangles.collect())
}

/// What cleaning counts, with some of it set.
fn found(set: impl FnOnce(&mut Cleaning)) -> Cleaning {
    let mut counts = Cleaning::default();
    set(&mut counts);
    counts
}

/// The shape with a change to its positions.
fn with_positions(mut shape: Shape, change: impl FnOnce(&mut [Vec3])) -> Shape {
    change(&mut shape.0);
    shape
}

fn cases() -> Vec<Case> {
    let none = Cleaning::default();
    let (positions, triangles) = potato(2);
    let faces = triangles.len();
    let backs: Vec<_> = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let turned: Vec<_> = triangles.iter().map(|&[a, b, c]| [c, a, b]).collect();
    let with = |more: &[&[[u32; 3]]]| {
        let all = std::iter::once(&triangles[..]).chain(more.iter().copied());
        (positions.clone(), all.collect::<Vec<_>>().concat())
    };
    let sphere = (1, 2, true);
    let disk = (1, 1, true);
    let mut cases = vec![
        case("one triangle", lone_triangles(1), disk, 1, none),
        case(
            "a hundred of them",
            lone_triangles(100),
            (100, 100, true),
            100,
            none,
        ),
        case(
            "six faces around a vertex that is no number",
            with_positions(shapes::grid(8, 8), |p| p[40].x = f32::NAN),
            // A hole is left.
            (1, 0, true),
            6,
            found(|c| {
                c.dropped_non_finite_faces = 6;
                c.dropped_isolated_vertices = 1
            }),
        ),
        case(
            "a corner at infinity",
            with_positions(shapes::grid(8, 8), |p| p[8].y = f32::NEG_INFINITY),
            disk,
            1,
            found(|c| {
                c.dropped_non_finite_faces = 1;
                c.dropped_isolated_vertices = 1
            }),
        ),
        case(
            "isolated vertices",
            (
                [&positions[..], &[Vec3::ONE, Vec3::NAN]].concat(),
                triangles.clone(),
            ),
            sphere,
            4,
            found(|c| c.dropped_isolated_vertices = 2),
        ),
        case(
            "every face three times",
            with(&[&triangles, &turned]),
            sphere,
            4,
            found(|c| c.dropped_duplicate_faces = 2 * faces),
        ),
        case(
            "every face and its opposite",
            with(&[&backs]),
            sphere,
            // Of two sides each.
            8,
            found(|c| c.folded_faces = faces),
        ),
        case(
            "every face and its opposite, twice",
            with(&[&backs, &backs, &turned]),
            sphere,
            8,
            found(|c| {
                c.folded_faces = faces;
                c.dropped_duplicate_faces = 2 * faces
            }),
        ),
        case(
            "faces that name a vertex twice, or only one",
            with(&[&[[0, 0, 1], [5, 6, 5], [3, 3, 3]]]),
            sphere,
            4,
            found(|c| c.dropped_degenerate_faces = 3),
        ),
        case(
            "nothing but collinear vertices",
            with_positions(shapes::grid(10, 10), |p| {
                for (i, p) in p.iter_mut().enumerate() {
                    *p = Vec3::X * i as f32;
                }
            }),
            disk,
            1,
            none,
        ),
        case(
            "a row of zero area amid a sheet",
            with_positions(shapes::grid(10, 10), |p| {
                for v in 44..55 {
                    p[v].y = p[v - 11].y;
                    p[v].x += 0.03;
                }
            }),
            disk,
            1,
            none,
        ),
        on_one_edge(case(
            "three hundred pages of one triangle",
            book(300, 1),
            disk,
            300,
            none,
        )),
        on_one_edge(case(
            "thirty pages of five triangles",
            book(30, 3),
            disk,
            30,
            none,
        )),
        case(
            "thirty sheets at one vertex",
            sheets_at_one_vertex(30),
            disk,
            30,
            none,
        ),
        case(
            "two balls at one vertex",
            (0..2).fold(shapes::bow_tie(), |shape, _| shapes::subdivided(shape)),
            (1, 3, true),
            8,
            none,
        ),
        case(
            "a Möbius strip",
            shapes::moebius(60),
            (1, 0, false),
            6,
            none,
        ),
        case(
            "a Klein bottle",
            klein_bottle(12, 8),
            (1, 0, false),
            18,
            none,
        ),
        case(
            "a wheel of a hundred spokes",
            wheel(100, false),
            disk,
            1,
            none,
        ),
        case("a closed one", wheel(100, true), sphere, 4, none),
        case(
            "one vertex so far out that the rest is a point beside it",
            with_positions(potato(2), |p| p[17] = Vec3::new(1e30, -1e30, 0.0)),
            sphere,
            4,
            none,
        ),
        case(
            "as large as numbers go",
            with_positions(potato(2), |p| p.iter_mut().for_each(|p| *p *= 2e38)),
            sphere,
            4,
            none,
        ),
    ];
    for (name, scale) in [("at 1e30", 1e30), ("at 1e-30", 1e-30)] {
        let scaled = with_positions(potato(2), |p| p.iter_mut().for_each(|p| *p *= scale));
        cases.push(case(name, scaled, sphere, 4, none));
    }
    for (name, to) in [
        ("edges without length", 1),
        ("stars of edges without length", 6),
    ] {
        let (mut positions, triangles) = potato(2);
        // A vertex, or all around it, where one of its neighbours is.
        let mut is_done = vec![false; positions.len()];
        for center in (0..positions.len()).step_by(20) {
            let around = triangles.iter().filter(|t| t.contains(&(center as u32)));
            let mut around: Vec<u32> = around.flatten().copied().collect();
            around.sort_unstable();
            around.dedup();
            for &v in around.iter().filter(|&&v| v as usize != center).take(to) {
                if !std::mem::replace(&mut is_done[v as usize], true) {
                    positions[v as usize] = positions[center];
                }
            }
        }
        cases.push(Case {
            weld: false,
            ..case(name, (positions, triangles), sphere, 4, none)
        });
    }
    cases
}

/// Whatever the list, in every quality and tier, as a whole and in chunks: what is wrong is counted,
/// the topology is kept, nothing new is non-manifold or open, every place is a number, and it comes
/// down to what it can come down to.
#[test]
fn any_list_of_triangles_is_taken_and_kept() {
    cases().into_par_iter().for_each(|case| {
        let Case { name, weld, .. } = case;
        let input = mesh(case.shape);
        let before = info(input.clone(), weld).unwrap();
        assert_eq!(topology_of(&before), case.topology, "{name}");
        assert_eq!(before.non_manifold_edges, case.non_manifold_edges, "{name}");
        let keeps = |quality, wanted, chunks| {
            let options = Options {
                weld,
                chunks,
                check: input.triangle_count() <= MOST_CHECKED,
                ..to_triangles(quality, wanted)
            };
            let what = format!("{name}, {quality:?} to {wanted}, {chunks:?}");
            let (small, report) = run_in_every_tier(&input, &options);
            let mut counted = report.cleaning;
            (counted.kept_vertices, counted.kept_faces) = (0, 0);
            assert_eq!(counted, case.found, "{what}");
            if before.is_orientable {
                let edges = report.non_manifold_edges_in;
                assert_eq!(edges, case.non_manifold_edges, "{what}");
            }
            let after = info(small.clone(), false).unwrap();
            assert_eq!(topology_of(&after), case.topology, "{what}");
            assert_is_no_worse(&after, &before, &what);
            assert!(small.positions().iter().all(|p| p.is_finite()), "{what}");
            assert_eq!(after.cleaning.kept_faces, small.triangles().len(), "{what}");
            assert_eq!(small.triangle_count(), report.triangles_out, "{what}");
            assert!(
                report.triangles_out <= case.fewest.max(wanted),
                "{what}: {} are left, {:?}",
                report.triangles_out,
                report.blocked
            );
        };
        for quality in QUALITIES {
            for chunks in [Chunks::Off, Chunks::Triangles(50)] {
                keeps(quality, 0, chunks);
                keeps(quality, input.triangle_count() / 2, chunks);
            }
        }
    });
}

fn topology_of(info: &Info) -> (usize, i64, bool) {
    (
        info.components,
        info.euler_characteristic,
        info.is_orientable,
    )
}

fn assert_is_no_worse(after: &Info, before: &Info, what: &str) {
    let of = |info: &Info| {
        [
            info.non_manifold_edges,
            info.non_manifold_vertices,
            info.boundary_edges,
        ]
    };
    let (now, then) = (of(after), of(before));
    assert!(
        (0..3).all(|i| now[i] <= then[i]),
        "{what}: {then:?} became {now:?}"
    );
}

/// The same lists where topology may change: nothing is torn, and something is left.
#[test]
fn any_list_of_triangles_may_be_simplified() {
    cases().into_par_iter().for_each(|case| {
        let Case { name, weld, .. } = case;
        let input = mesh(case.shape);
        let before = info(input.clone(), weld).unwrap();
        for quality in QUALITIES {
            let options = Options {
                weld,
                topology: Topology::Simplify,
                check: input.triangle_count() <= MOST_CHECKED,
                ..to_triangles(quality, 6)
            };
            let what = format!("{name}, {quality:?}");
            let (small, report) = run_in_every_tier(&input, &options);
            assert!(report.triangles_out > 0, "{what}");
            assert_is_no_worse(&info(small.clone(), false).unwrap(), &before, &what);
            assert!(small.positions().iter().all(|p| p.is_finite()), "{what}");
        }
    });
}

/// What holds no proper triangle is an error that counts why, in every quality and tier.
#[test]
fn lists_without_a_proper_triangle_are_errors() {
    let sheet = || shapes::grid(3, 3);
    for (name, shape, expected) in [
        ("points", (sheet().0, vec![]), "no triangle in it"),
        (
            "no number",
            with_positions(sheet(), |p| p.fill(Vec3::NAN)),
            "of 18: 18 use coordinates that are not finite, 0 name a vertex twice",
        ),
        (
            "infinite in one direction",
            with_positions(sheet(), |p| p.iter_mut().for_each(|p| p.z = f32::INFINITY)),
            "of 18: 18 use coordinates that are not finite, 0 name a vertex twice",
        ),
        (
            "one point",
            with_positions(sheet(), |p| p.fill(Vec3::ONE)),
            "of 18: 0 use coordinates that are not finite, 18 name a vertex twice",
        ),
    ] {
        let input = mesh(shape);
        for quality in QUALITIES {
            for tier in TIERS {
                let options = Options {
                    tier: TierChoice::Fixed(tier),
                    ..to_triangles(quality, 4)
                };
                match decimate(input.clone(), &options) {
                    Err(Error::InvalidMesh(why)) => {
                        assert!(why.contains(expected), "{name}: {why}");
                    }
                    other => panic!("{name}: {other:?}"),
                }
            }
        }
    }
}

/// The corners of every face, in no order.
fn places(mesh: &IndexedMesh) -> Vec<[Bits; 3]> {
    let at = bits(mesh.positions());
    let corners = mesh.triangles().iter().map(|t| t.map(|v| at[v as usize]));
    let mut corners: Vec<_> = corners.collect();
    corners.sort_unstable();
    corners
}

/// A million separate triangles: each is a component and stays, and every edge says why.
#[test]
fn a_million_separate_triangles_stay() {
    let million = mesh(lone_triangles(1_000_000));
    let (same, report) = run(&million, &to_triangles(Quality::Fast, 1000));
    assert_eq!(report.stop_reason, StopReason::Blocked);
    assert_eq!(report.blocked.unwrap().link, 3_000_000);
    assert!(places(&same) == places(&million));
}

/// At a vertex of valence 100 000 a collapse does not walk around it: 10 000 000 000 steps would not
/// end.
#[test]
fn a_vertex_of_valence_100_000_takes_no_quadratic_time() {
    let wheel = mesh(wheel(100_000, true));
    let wanted = wheel.triangle_count() / 2;
    for quality in [Quality::Fast, Quality::Standard] {
        let (_, report) = run(&wheel, &to_triangles(quality, wanted));
        assert_eq!(report.triangles_out, wanted, "{quality:?}");
    }
}

/// A hundred thousand triangles on one edge: what cannot go is refused once each, not once for each of
/// the others.
#[test]
fn an_edge_of_100_000_triangles_takes_no_quadratic_time() {
    let book = mesh(book(100_000, 1));
    for quality in QUALITIES {
        let (same, report) = run(&book, &to_triangles(quality, 1000));
        assert!(places(&same) == places(&book), "{quality:?}");
        assert_eq!(report.stop_reason, StopReason::Blocked, "{quality:?}");
    }
}
