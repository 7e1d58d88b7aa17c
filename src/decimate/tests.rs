//! What decimation promises, on shapes small enough to know the answer.

use glam::Vec3;

use super::*;
use crate::for_each_tier;
use crate::metrics::info;
use crate::shapes::{self, Shape};

fn mesh((positions, triangles): Shape) -> IndexedMesh {
    IndexedMesh::new(positions, triangles).unwrap()
}

fn tiered<S: EdgeStore>(options: Options) -> Options {
    Options {
        tier: TierChoice::Fixed(S::TIER),
        check: true,
        ..options
    }
}

fn to_triangles(triangles: usize) -> Options {
    let targets = Targets {
        triangles: Some(triangles),
        ..Targets::default()
    };
    Options {
        targets,
        ..Options::default()
    }
}

fn to_error(max_error: f64) -> Options {
    let targets = Targets {
        max_error: Some(max_error),
        ..Targets::default()
    };
    Options {
        targets,
        ..Options::default()
    }
}

fn run_in<S: EdgeStore>(shape: Shape, options: Options) -> (IndexedMesh, Report) {
    decimate(mesh(shape), &tiered::<S>(options)).unwrap()
}

/// A bumpy height field over the unit square: nothing on it is flat.
fn bumpy(n: u32) -> Shape {
    let (mut positions, triangles) = shapes::grid(n, n);
    for p in &mut positions {
        p.z = 0.1 * (7.0 * p.x).sin() * (5.0 * p.y).cos() + 0.01 * (31.0 * p.x * p.y).sin();
    }
    (positions, triangles)
}

fn cube(levels: u32) -> Shape {
    let positions = (0..8)
        .map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32))
        .collect();
    #[rustfmt::skip]
    let triangles = vec![
        [0, 2, 3], [0, 3, 1], [4, 5, 7], [4, 7, 6], [0, 1, 5], [0, 5, 4],
        [2, 6, 7], [2, 7, 3], [0, 4, 6], [0, 6, 2], [1, 3, 7], [1, 7, 5],
    ];
    (0..levels).fold((positions, triangles), |shape, _| shapes::subdivided(shape))
}

/// An open cylinder wall of `n` × `m` squares, without rotation symmetry of the rounding.
fn wall(n: u32, m: u32) -> Shape {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for j in 0..=m {
        for i in 0..n {
            let angle = i as f32 / n as f32 * std::f32::consts::TAU;
            positions.push(Vec3::new(angle.cos(), angle.sin(), j as f32 / m as f32));
            if j < m {
                let (a, b) = (j * n + i, j * n + (i + 1) % n);
                triangles.extend([[a, b, b + n], [a, b + n, a + n]]);
            }
        }
    }
    (positions, triangles)
}

/// A subdivided cube comes down to its eight corners, exactly: flat walls and straight edges cost
/// nothing.
fn a_cube_comes_down_to_its_corners<S: EdgeStore>() {
    let (small, report) = run_in::<S>(cube(4), to_triangles(12));
    assert_eq!((report.triangles_out, report.vertices_out), (12, 8));
    assert!(
        report.max_error_estimate < 1e-7,
        "{}",
        report.max_error_estimate
    );
    for p in small.positions() {
        assert!(
            p.to_array().iter().all(|&c| c == 0.0 || c == 1.0),
            "{p} is no corner"
        );
    }
}

/// A turned cube has no coordinate in common with the axes: still its corners, to rounding.
fn a_turned_cube_comes_down_to_its_corners<S: EdgeStore>() {
    let (mut positions, triangles) = cube(4);
    let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
    let corners: Vec<Vec3> = positions[..8].iter().map(|&p| turn * p).collect();
    positions.iter_mut().for_each(|p| *p = turn * *p);
    let (small, report) = run_in::<S>((positions, triangles), to_triangles(12));
    assert_eq!(report.triangles_out, 12);
    for p in small.positions() {
        let nearest = corners
            .iter()
            .map(|c| c.distance(*p))
            .fold(f32::MAX, f32::min);
        assert!(nearest < 1e-6, "{p} is {nearest} from a corner");
    }
}

/// A wall loses its rings and keeps its rims: 12 sides leave 24 triangles over the 24 rim vertices.
fn a_wall_comes_down_to_its_rims<S: EdgeStore>() {
    let shape = wall(12, 10);
    let rims: Vec<Vec3> = shape
        .0
        .iter()
        .filter(|p| p.z == 0.0 || p.z == 1.0)
        .copied()
        .collect();
    let (small, report) = run_in::<S>(shape, to_triangles(24));
    assert_eq!((report.triangles_out, report.vertices_out), (24, 24));
    assert!(small.positions().iter().all(|p| rims.contains(p)));
}

/// A flat sheet of 10 000 triangles becomes two.
fn a_flat_sheet_becomes_two_triangles<S: EdgeStore>() {
    let options = Options {
        check: false,
        ..to_triangles(2)
    };
    let options = Options {
        tier: TierChoice::Fixed(S::TIER),
        ..options
    };
    let (small, report) = decimate(mesh(shapes::grid(71, 71)), &options).unwrap();
    assert_eq!(report.triangles_out, 2);
    let area: f32 = small
        .triangles()
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| small.positions()[v as usize]);
            (b - a).cross(c - a).z / 2.0
        })
        .sum();
    assert!((area - 1.0).abs() < 1e-6, "area {area}");
}

/// Each target stops where it should, and never more than one collapse below.
fn targets_are_reached_exactly_or_by_one_collapse<S: EdgeStore>() {
    for wanted in [500, 499, 37, 4] {
        let (small, report) = run_in::<S>(shapes::icosphere(3), to_triangles(wanted));
        assert_eq!(report.triangles_out, wanted - wanted % 2);
        assert_eq!(small.triangle_count(), report.triangles_out);
        assert_eq!(report.stop_reason, StopReason::Target);
        assert!(!report.stopped_short);
    }
}

/// What a homeomorphism keeps stays, down to the last collapse; the reasons are said.
fn topology_is_kept_to_the_end<S: EdgeStore>() {
    for (name, shape, fewest) in [
        ("sphere", shapes::icosphere(2), 4),
        ("torus", shapes::torus(16, 10), 14),
        (
            "bow tie",
            shapes::subdivided(shapes::subdivided(shapes::bow_tie())),
            8,
        ),
        ("three fins", shapes::three_fins(12), 3),
        ("sheet", bumpy(12), 1),
        ("moebius", shapes::moebius(40), 5),
    ] {
        let before = info(mesh(shape.clone()), true).unwrap();
        let (small, report) = run_in::<S>(shape, to_triangles(0));
        let after = info(small, true).unwrap();
        let kept = |i: &crate::metrics::Info| {
            (
                i.components,
                i.euler_characteristic,
                i.genus,
                i.is_orientable,
                i.boundary_loops,
            )
        };
        assert_eq!(kept(&before), kept(&after), "{name}");
        assert!(
            after.non_manifold_edges <= before.non_manifold_edges,
            "{name}"
        );
        assert!(
            report.stopped_short && report.stop_reason == StopReason::Blocked,
            "{name}"
        );
        let blocked = report.blocked.unwrap();
        assert!(blocked.link + blocked.flip > 0, "{name}");
        // Flips may stop it a little above what topology alone allows.
        assert!(
            report.triangles_out <= fewest + 8,
            "{name}: {}",
            report.triangles_out
        );
    }
}

/// Three fins on a fine grid come down to one triangle each: non-manifold is not locked.
fn three_fins_come_down_to_three_triangles<S: EdgeStore>() {
    let (small, report) = run_in::<S>(shapes::three_fins(16), to_triangles(0));
    assert_eq!(small.triangle_count(), 3);
    assert!(report.tally.collapses_non_manifold > 16);
}

/// The boundary keeps its vertices where it is locked.
fn a_locked_boundary_keeps_its_bits<S: EdgeStore>() {
    let shape = bumpy(20);
    let on_rim = |p: &&Vec3| p.x == 0.0 || p.x == 1.0 || p.y == 0.0 || p.y == 1.0;
    let sorted = |positions: &[Vec3]| {
        let mut rim: Vec<_> = positions
            .iter()
            .filter(on_rim)
            .map(|p| p.to_array().map(f32::to_bits))
            .collect();
        rim.sort_unstable();
        rim
    };
    let before = sorted(&shape.0);
    assert_eq!(before.len(), 80);
    let options = Options {
        boundary: Boundary::Lock,
        ..to_triangles(100)
    };
    let (small, report) = run_in::<S>(shape, options);
    assert_eq!(sorted(small.positions()), before);
    assert!(report.tally.rejected_lock >= 80);
    assert!(report.triangles_out <= 100);
}

/// A bumpy grid with the weight that `of` gives each of its vertices.
fn weighted(n: u32, of: impl Fn(Vec3) -> f32) -> IndexedMesh {
    let bumpy = mesh(bumpy(n));
    let weights = bumpy.positions().iter().map(|&p| of(p)).collect();
    bumpy.with_weights(weights).unwrap()
}

/// Of a grid, the middle column and the corners must not move: they are there afterwards, whatever
/// the quality and whether the boundary is locked beside.
fn an_infinite_weight_keeps_the_bits<S: EdgeStore>() {
    let is_kept = |p: &Vec3| p.x == 0.5 || (p.x * p.y == 0.0 && p.x + p.y == 1.0);
    let weigh = |p| if is_kept(&p) { f32::INFINITY } else { p.y };
    let kept = |mesh: &IndexedMesh| -> Vec<_> {
        let kept = mesh.positions().iter().filter(|p| is_kept(p));
        let mut kept: Vec<_> = kept.map(|p| p.to_array().map(f32::to_bits)).collect();
        kept.sort_unstable();
        kept
    };
    let before = weighted(16, weigh);
    assert_eq!(kept(&before).len(), 17 + 2);
    for quality in [Quality::Fast, Quality::Standard, Quality::Best] {
        for boundary in [Boundary::Keep, Boundary::Lock] {
            let options = tiered::<S>(Options {
                quality,
                boundary,
                ..to_triangles(160)
            });
            let (small, report) = decimate(before.clone(), &options).unwrap();
            assert!(report.triangles_out <= 160, "{quality:?} {boundary:?}");
            assert_eq!(kept(&small), kept(&before), "{quality:?} {boundary:?}");
        }
    }
}

/// With 100 times the weight, the left half of a grid keeps most of the triangles; with 1, half.
fn a_heavy_half_keeps_more<S: EdgeStore>() {
    let left = |heavy: f32, quality| {
        let weigh = |p: Vec3| if p.x < 0.5 { heavy } else { 1.0 };
        let options = Options {
            quality,
            ..to_triangles(200)
        };
        let (small, _) = decimate(weighted(24, weigh), &tiered::<S>(options)).unwrap();
        let sum_x = |t: &&[u32; 3]| {
            t.map(|v| small.positions()[v as usize].x)
                .iter()
                .sum::<f32>()
        };
        small.triangles().iter().filter(|t| sum_x(t) < 1.5).count()
    };
    for quality in [Quality::Fast, Quality::Standard, Quality::Best] {
        let (even, heavy) = (left(1.0, quality), left(100.0, quality));
        assert!((80..120).contains(&even), "{quality:?}: {even} of 200");
        assert!(heavy > 150, "{quality:?}: {heavy} of 200, {even} evenly");
    }
}

/// A free boundary costs nothing and so shrinks; a kept one stays.
fn a_free_boundary_moves_more_than_a_kept_one<S: EdgeStore>() {
    let area = |boundary| {
        let options = Options {
            boundary,
            ..to_triangles(60)
        };
        let (small, _) = run_in::<S>(bumpy(20), options);
        let project = |v: u32| small.positions()[v as usize].truncate();
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(project);
            (b - a).perp_dot(c - a) / 2.0
        };
        small.triangles().iter().map(area).sum::<f32>()
    };
    let (kept, free) = (area(Boundary::Keep), area(Boundary::Free));
    assert!((kept - 1.0).abs() < 0.01, "kept {kept}");
    assert!(
        (kept - 1.0).abs() < (free - 1.0).abs(),
        "kept {kept}, free {free}"
    );
}

/// Output vertices are input vertices, bit for bit.
fn endpoint_placement_takes_a_subset<S: EdgeStore>() {
    let shape = bumpy(16);
    let bits = |p: &Vec3| p.to_array().map(f32::to_bits);
    let input: std::collections::BTreeSet<_> = shape.0.iter().map(bits).collect();
    let options = Options {
        placement: Placement::Endpoint,
        ..to_triangles(80)
    };
    let (small, _) = run_in::<S>(shape, options);
    assert!(small.positions().iter().all(|p| input.contains(&bits(p))));
}

/// An error alone stops before it: a looser limit leaves fewer triangles, and the estimate keeps it.
fn an_error_limit_is_kept<S: EdgeStore>() {
    let mut last = usize::MAX;
    for limit in [1e-4, 1e-3, 1e-2, 1e-1] {
        let (_, report) = run_in::<S>(bumpy(24), to_error(limit));
        assert!(
            report.max_error_estimate <= limit,
            "{} > {limit}",
            report.max_error_estimate
        );
        assert!(report.triangles_out < last);
        assert_eq!(report.stop_reason, StopReason::MaxError);
        assert!(!report.stopped_short && report.tally.rejected_error > 0);
        last = report.triangles_out;
    }
}

/// A face and its opposite stay together, count as two, and come out as two.
fn double_sided_sheets_stay_double<S: EdgeStore>() {
    let (positions, mut triangles) = bumpy(10);
    triangles.extend(triangles.clone().iter().map(|&[a, b, c]| [a, c, b]));
    let (small, report) = run_in::<S>((positions, triangles), to_triangles(100));
    assert_eq!(report.cleaning.folded_faces, 200);
    assert_eq!(report.triangles_in, 400);
    assert!(
        (97..=100).contains(&report.triangles_out),
        "{}",
        report.triangles_out
    );
    assert_eq!(small.sides().count(), report.triangles_out);
    assert!((0..small.triangles().len()).all(|i| small.is_double_sided(i)));
}

/// Faces turned against their neighbours are decimated as if they agreed, and come out turned.
fn turned_faces_do_not_stand_in_the_way<S: EdgeStore>() {
    let (positions, triangles) = shapes::icosphere(3);
    let mut turned = triangles.clone();
    for t in turned.iter_mut().step_by(3) {
        t.swap(1, 2);
    }
    let (straight, _) = run_in::<S>((positions.clone(), triangles), to_triangles(200));
    let (small, report) = run_in::<S>((positions, turned), to_triangles(200));
    assert_eq!(report.reoriented_faces, 427);
    assert_eq!(small.positions(), straight.positions());
    let sorted = |mesh: &IndexedMesh| {
        let mut all: Vec<_> = mesh.triangles().to_vec();
        all.iter_mut().for_each(|t| t.sort_unstable());
        all
    };
    assert_eq!(sorted(&small), sorted(&straight));
    let differ = small
        .triangles()
        .iter()
        .zip(straight.triangles())
        .filter(|(a, b)| a != b);
    assert!((30..110).contains(&differ.count()));
}

/// Nothing asked, nothing changed.
fn ratio_one_is_the_identity<S: EdgeStore>() {
    let targets = Targets {
        ratio: Some(1.0),
        ..Targets::default()
    };
    for shape in [bumpy(8), shapes::three_fins(3), shapes::moebius(9)] {
        let (same, report) = run_in::<S>(
            shape.clone(),
            Options {
                targets,
                ..Options::default()
            },
        );
        assert_eq!(same, mesh(shape));
        assert_eq!(report.tally.collapses, 0);
    }
}

for_each_tier!(
    a_cube_comes_down_to_its_corners,
    a_turned_cube_comes_down_to_its_corners,
    a_wall_comes_down_to_its_rims,
    a_flat_sheet_becomes_two_triangles,
    targets_are_reached_exactly_or_by_one_collapse,
    topology_is_kept_to_the_end,
    three_fins_come_down_to_three_triangles,
    a_locked_boundary_keeps_its_bits,
    an_infinite_weight_keeps_the_bits,
    a_heavy_half_keeps_more,
    a_free_boundary_moves_more_than_a_kept_one,
    endpoint_placement_takes_a_subset,
    an_error_limit_is_kept,
    double_sided_sheets_stay_double,
    turned_faces_do_not_stand_in_the_way,
    ratio_one_is_the_identity,
);

/// The tiers give the same mesh, bit for bit.
#[test]
fn tiers_give_the_same_bits() {
    for shape in [
        bumpy(20),
        shapes::three_fins(10),
        shapes::moebius(60),
        shapes::icosphere(3),
    ] {
        let full = run_in::<Full>(shape.clone(), to_triangles(60)).0;
        assert_eq!(full, run_in::<Medium>(shape.clone(), to_triangles(60)).0);
        assert_eq!(full, run_in::<Small>(shape, to_triangles(60)).0);
    }
}

/// One thread or four, the same mesh.
#[test]
fn threads_give_the_same_bits() {
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| run_in::<Full>(bumpy(40), to_triangles(300)).0)
    };
    assert_eq!(with(1), with(4));
}

/// Scaling by a power of two is exact, so the triangles are the same and the positions scaled.
#[test]
fn scaling_by_a_power_of_two_scales_the_result() {
    let (positions, triangles) = bumpy(20);
    let (expected, _) = run_in::<Full>((positions.clone(), triangles.clone()), to_triangles(150));
    for power in [-60, -20, 1, 30, 90] {
        let factor = 2f32.powi(power);
        let scaled = positions.iter().map(|&p| p * factor).collect();
        let (small, _) = run_in::<Full>((scaled, triangles.clone()), to_triangles(150));
        assert_eq!(small.triangles(), expected.triangles(), "2^{power}");
        for (p, q) in small.positions().iter().zip(expected.positions()) {
            assert_eq!(*p, *q * factor, "2^{power}");
        }
    }
}

/// Only the ratios of the weights count: a power of two in all of them changes nothing, nor does the
/// same weight everywhere. 0 and what single precision cannot multiply are among them.
#[test]
fn scaling_the_weights_changes_nothing() {
    for quality in [Quality::Fast, Quality::Standard, Quality::Best] {
        let run = |mesh| {
            let options = Options {
                quality,
                ..to_triangles(150)
            };
            decimate(mesh, &options).unwrap().0
        };
        let weigh = |p: Vec3| match p.x {
            0.0 => 0.0,
            x if x < 0.2 => 1e25,
            x => x * x + p.y,
        };
        let expected = run(weighted(20, weigh));
        for power in [-60, -3, 1, 40] {
            let scaled = weighted(20, |p| weigh(p) * 2f32.powi(power));
            assert!(run(scaled) == expected, "{quality:?}, 2^{power}");
        }
        let even = run(mesh(bumpy(20)));
        assert!(even != expected, "the weights do nothing");
        for weight in [0.3, 1.0, 1e30] {
            assert!(run(weighted(20, |_| weight)) == even, "{weight}");
        }
    }
}

/// Beside a light sphere, which goes first, a heavy one keeps its volume like one alone: it is the
/// weights that grow, not the faces.
#[test]
fn a_heavy_sphere_keeps_its_volume() {
    let (mut positions, mut triangles) = shapes::icosphere(4);
    let light = positions.len();
    let (heavy, faces) = shapes::icosphere(3);
    positions.extend(heavy.iter().map(|&p| p + 4.0 * Vec3::X));
    triangles.extend(faces.iter().map(|t| t.map(|v| v + light as u32)));
    let volume = |positions: &[Vec3], triangles: &[[u32; 3]]| -> f32 {
        let corners = |t: &[u32; 3]| t.map(|v| positions[v as usize] - 4.0 * Vec3::X);
        let six = |[a, b, c]: [Vec3; 3]| a.dot(b.cross(c));
        let of_heavy = triangles.iter().map(corners).filter(|c| c[0].x > -2.0);
        of_heavy.map(six).sum::<f32>() / 6.0
    };
    let before = volume(&positions, &triangles);
    let mut weights = vec![1.0; positions.len()];
    weights[light..].fill(1e8);
    let pair = mesh((positions, triangles)).with_weights(weights).unwrap();
    let (small, _) = decimate(pair, &to_triangles(104)).unwrap();
    let ratio = volume(small.positions(), small.triangles()) / before;
    assert!((ratio - 1.0).abs() < 1e-3, "{ratio} of the volume");
}

/// Weights so small, so large or so far apart that their products leave single precision.
#[test]
fn extreme_weights_stop_nothing() {
    let weights = [0.0, f32::MIN_POSITIVE, 1e-20, 1.0, 1e20, f32::MAX];
    for quality in [Quality::Fast, Quality::Standard, Quality::Best] {
        for few in 1..=weights.len() {
            let mix = |p: Vec3| weights[(p.x * 97.0 + p.y * 31.0) as usize % few];
            let options = Options {
                quality,
                ..to_triangles(2)
            };
            let (_, report) = decimate(weighted(10, mix), &options).unwrap();
            assert!(
                report.triangles_out <= 8,
                "{quality:?}, {few} weights: {report:?}"
            );
        }
    }
}

/// A surface of a closed sphere stays close: n triangles cannot be better than 0.2705/n of the
/// diagonal in rms, and the volume term keeps them within twice that.
#[test]
fn a_sphere_is_near_its_limit() {
    let shape = shapes::icosphere(5);
    let (small, report) = decimate(mesh(shape), &to_triangles(1000)).unwrap();
    assert_eq!(report.triangles_out, 1000);
    // The rms distance of the faces from the sphere, by the points of a grid in each.
    let (mut sum, mut count) = (0.0, 0);
    for t in small.triangles() {
        let [a, b, c] = t.map(|v| small.positions()[v as usize].as_dvec3());
        for i in 0..8 {
            for j in 0..8 - i {
                let (u, v) = ((i as f64 + 0.33) / 8.0, (j as f64 + 0.33) / 8.0);
                let distance = (a * (1.0 - u - v) + b * u + c * v).length() - 1.0;
                sum += distance * distance;
                count += 1;
            }
        }
    }
    let rms_of_diagonal = (sum / f64::from(count)).sqrt() / 12f64.sqrt();
    let limit = 0.2705 / 1000.0;
    assert!(
        rms_of_diagonal < 1.6 * limit,
        "{rms_of_diagonal} is {} limits",
        rms_of_diagonal / limit
    );
}

/// A vertex of valence 20 000 does not cost its valence at every collapse on the rim, nor at every
/// spoke that is refused: with an even rim, and with a jagged one.
#[test]
fn a_busy_vertex_takes_no_quadratic_time() {
    let n = 20_000u32;
    for (jag, height) in [(0.01, 0.5), (0.3, 0.0)] {
        let rim = (0..n).map(|i| {
            let angle = f64::from(i) / f64::from(n) * std::f64::consts::TAU;
            let radius = 1.0 + jag * (f64::from(i * 7919 % 101) / 101.0);
            Vec3::new(
                (radius * angle.cos()) as f32,
                (radius * angle.sin()) as f32,
                0.0,
            )
        });
        let hub = Vec3::new(0.0, 0.0, height);
        let positions: Vec<Vec3> = std::iter::once(hub).chain(rim).collect();
        let triangles = (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect();
        let (_, report) = decimate(mesh((positions, triangles)), &to_triangles(10_000)).unwrap();
        assert_eq!(report.triangles_out, 10_000);
    }
}

/// A book of 500 pages on one edge: the vertices of the spine are met once, not once a page.
#[test]
fn a_busy_edge_takes_no_cubic_time() {
    let pages = 500u32;
    let mut positions = vec![Vec3::ZERO, Vec3::Z];
    let mut triangles = Vec::new();
    for page in 0..pages {
        let angle = f64::from(page) / f64::from(pages) * std::f64::consts::TAU;
        let (x, y) = (angle.cos() as f32, angle.sin() as f32);
        let a = positions.len() as u32;
        positions.extend([0.0, 1.0].map(|z| Vec3::new(x, y, z)));
        positions.push(Vec3::new(0.5 * x, 0.5 * y, 0.6));
        let middle = a + 2;
        triangles.extend([
            [0, a, middle],
            [a, a + 1, middle],
            [a + 1, 1, middle],
            [1, 0, middle],
        ]);
    }
    let (small, report) = decimate(mesh((positions, triangles)), &to_triangles(500)).unwrap();
    assert_eq!(small.triangle_count(), report.triangles_out);
    assert_eq!(report.triangles_out, 500);
}

#[test]
fn a_mesh_without_triangles_is_an_error() {
    let points = IndexedMesh::new(vec![Vec3::ZERO; 3], vec![]).unwrap();
    let error = decimate(points, &to_triangles(1)).unwrap_err().to_string();
    assert!(error.contains("no triangle"), "{error}");
    let one_point = IndexedMesh::new(vec![Vec3::ZERO; 3], vec![[0, 1, 2]]).unwrap();
    let error = decimate(one_point, &to_triangles(1))
        .unwrap_err()
        .to_string();
    assert!(error.contains("1 name a vertex twice"), "{error}");
}

/// Breaking stops with a whole mesh.
#[test]
fn cancelling_gives_the_mesh_so_far() {
    let mut calls = 0;
    let mut stop = |_: Progress| {
        calls += 1;
        ControlFlow::Break(())
    };
    let shape = bumpy(60);
    let (small, report) =
        decimate_with_progress(mesh(shape), &to_triangles(10), &mut stop).unwrap();
    assert_eq!(calls, 1);
    assert_eq!(report.stop_reason, StopReason::Cancelled);
    assert_eq!(small.triangle_count(), report.triangles_out);
    assert!(report.triangles_out > 10 && report.triangles_out < 7200);
}

/// Zero area everywhere, or nearly: no panic, no endless loop, nothing not finite.
#[test]
fn degenerate_geometry_is_input() {
    let (positions, triangles) = bumpy(12);
    let squeeze = |f: fn(Vec3) -> Vec3| positions.iter().map(|&p| f(p)).collect::<Vec<_>>();
    for flat in [
        squeeze(|p| Vec3::new(p.x + 3.0 * p.y, 0.0, 0.0)),
        squeeze(|p| p * 1e-38),
        squeeze(|p| p * 1e37),
        squeeze(|p| p + Vec3::splat(1e7)),
        squeeze(|p| Vec3::new(p.x * 1e30, p.y, p.z * 1e-30)),
    ] {
        let options = Options {
            weld: false,
            ..to_triangles(20)
        };
        let (small, _) = run_in::<Small>((flat, triangles.clone()), options);
        assert!(small.positions().iter().all(|p| p.is_finite()));
    }
}
