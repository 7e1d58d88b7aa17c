//! What decimation promises, on shapes small enough to know the answer.

use glam::{DVec3, Vec3};

use super::surface::Way;
use super::*;
use crate::for_each_tier;
use crate::indexed_mesh::MeshBuilder;
use crate::mesh::{EdgeId, FaceId, VertexId};
use crate::metrics::{CompareOptions, Comparison, compare, info};
use crate::nearest::Triangles;
use crate::shapes::{self, Shape};

const QUALITIES: [Quality; 3] = [Quality::Fast, Quality::Standard, Quality::Best];

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

/// The surface of a shape, of which nothing is kept.
fn surface_of<S: EdgeStore>(shape: Shape) -> Surface<S> {
    let original = mesh(shape);
    let (min, max) = original.bounds().unwrap();
    let parts = original.into_parts();
    let triangles = Mesh::from_triangles(parts.positions.len(), &parts.triangles);
    let flat = Flat::<()>::of(parts);
    flat.into_surface(triangles, Room::around([min, max]), &[])
        .0
}

/// [`to_triangles`], in a quality.
fn to_triangles_in(quality: Quality, triangles: usize) -> Options {
    Options {
        quality,
        ..to_triangles(triangles)
    }
}

/// How far a result is from its original.
fn measured(original: &IndexedMesh, small: &IndexedMesh) -> Comparison {
    let few = CompareOptions {
        samples: 100_000,
        intersections: false,
    };
    compare(original.clone(), small.clone(), &few).unwrap()
}

/// The distance of the farthest vertex from another mesh's faces, in model units.
fn farthest_vertex(of: &IndexedMesh, from: &IndexedMesh) -> f64 {
    let points: Vec<DVec3> = from.points().collect();
    let corners = from.triangles().iter();
    let faces = Triangles::new(corners.map(|t| t.map(|v| points[v as usize])).collect());
    let squared = |p| faces.nearest(p).unwrap().distance_squared;
    of.points().map(squared).fold(0.0, f64::max).sqrt()
}

/// The volume that a closed mesh encloses.
fn volume(mesh: &IndexedMesh) -> f64 {
    let points: Vec<DVec3> = mesh.points().collect();
    let corners = mesh
        .triangles()
        .iter()
        .map(|t| t.map(|v| points[v as usize]));
    corners.map(|[a, b, c]| a.dot(b.cross(c))).sum::<f64>() / 6.0
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
/// nothing, in every quality.
fn a_cube_comes_down_to_its_corners<S: EdgeStore>() {
    for quality in QUALITIES {
        let (small, report) = run_in::<S>(cube(4), to_triangles_in(quality, 12));
        assert_eq!((report.triangles_out, report.vertices_out), (12, 8));
        let estimate = report.max_error_estimate;
        assert!(estimate < 1e-7, "{quality:?}: {estimate}");
        for p in small.positions() {
            assert!(
                p.to_array().iter().all(|&c| c == 0.0 || c == 1.0),
                "{quality:?}: {p} is no corner"
            );
        }
    }
}

/// A turned cube has no coordinate in common with the axes: still its corners, to rounding.
fn a_turned_cube_comes_down_to_its_corners<S: EdgeStore>() {
    let (mut positions, triangles) = cube(4);
    let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.3, 1.1, -0.7);
    let corners: Vec<Vec3> = positions[..8].iter().map(|&p| turn * p).collect();
    positions.iter_mut().for_each(|p| *p = turn * *p);
    for quality in QUALITIES {
        let shape = (positions.clone(), triangles.clone());
        let (small, report) = run_in::<S>(shape.clone(), to_triangles_in(quality, 12));
        assert_eq!(report.triangles_out, 12);
        for p in small.positions() {
            let distances = corners.iter().map(|c| c.distance(*p));
            let nearest = distances.fold(f32::MAX, f32::min);
            assert!(
                nearest < 1e-6,
                "{quality:?}: {p} is {nearest} from a corner"
            );
        }
        let largest = measured(&mesh(shape), &small)
            .surface
            .two_sided_of_diagonal
            .max;
        assert!(largest < 1e-7, "{quality:?}: {largest}");
    }
}

/// A wall loses its rings and keeps its rims: 12 sides leave 24 triangles over the 24 rim vertices.
fn a_wall_comes_down_to_its_rims<S: EdgeStore>() {
    let shape = wall(12, 10);
    let is_on_rim = |p: &&Vec3| p.z == 0.0 || p.z == 1.0;
    let rims: Vec<Vec3> = shape.0.iter().filter(is_on_rim).copied().collect();
    for quality in QUALITIES {
        let (small, report) = run_in::<S>(shape.clone(), to_triangles_in(quality, 24));
        assert_eq!((report.triangles_out, report.vertices_out), (24, 24));
        assert!(
            small.positions().iter().all(|p| rims.contains(p)),
            "{quality:?}: a vertex left the rims"
        );
        let c = measured(&mesh(shape.clone()), &small);
        let boundary = c.boundary.unwrap().two_sided_of_diagonal.max;
        let largest = c.surface.two_sided_of_diagonal.max.max(boundary);
        assert!(largest < 1e-7, "{quality:?}: {largest}");
    }
}

/// A flat sheet of 10 000 triangles becomes two.
fn a_flat_sheet_becomes_two_triangles<S: EdgeStore>() {
    for quality in QUALITIES {
        let options = Options {
            tier: TierChoice::Fixed(S::TIER),
            ..to_triangles_in(quality, 2)
        };
        let (small, report) = decimate(mesh(shapes::grid(71, 71)), &options).unwrap();
        assert_eq!(report.triangles_out, 2, "{quality:?}");
        let at = |v: u32| small.positions()[v as usize];
        let doubled = |t: &[u32; 3]| (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).z;
        let area = small.triangles().iter().map(doubled).sum::<f32>() / 2.0;
        assert!((area - 1.0).abs() < 1e-6, "{quality:?}: area {area}");
    }
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

/// The bits of the positions on the rim of the unit square, sorted.
fn rim_of_square(positions: &[Vec3]) -> Vec<[u32; 3]> {
    let on_rim = |p: &&Vec3| [p.x, p.y].iter().any(|&c| c == 0.0 || c == 1.0);
    let on_rim = positions.iter().filter(on_rim);
    let mut rim: Vec<_> = on_rim.map(|p| p.to_array().map(f32::to_bits)).collect();
    rim.sort_unstable();
    rim
}

/// The boundary keeps its vertices where it is locked.
fn a_locked_boundary_keeps_its_bits<S: EdgeStore>() {
    let shape = bumpy(20);
    let before = rim_of_square(&shape.0);
    assert_eq!(before.len(), 80);
    let options = Options {
        boundary: Boundary::Lock,
        ..to_triangles(100)
    };
    let (small, report) = run_in::<S>(shape, options);
    assert_eq!(rim_of_square(small.positions()), before);
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
    for quality in QUALITIES {
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
    for quality in QUALITIES {
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

/// Wherever the ends of any edge go, a collapse is refused if and only if a face that stays turns by 90°
/// or more: by brute force over all faces, but where rounding decides.
fn what_turns_is_refused<S: EdgeStore>() {
    let mut state = 3u64;
    let mut random = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    let mut found = [0; 2];
    for shape in [bumpy(6), shapes::torus(9, 6), shapes::three_fins(3)] {
        let surface = surface_of::<S>(shape);
        let mesh = &surface.mesh;
        let at = |v: VertexId| surface.geometry.position(v).as_dvec3();
        for e in mesh.edges() {
            let ends = mesh.edge_vertices(e);
            let position = surface.geometry.position(ends[0])
                + 0.5 * Vec3::new(random() - 0.5, random() - 0.5, random() - 0.5);
            let to = position.as_dvec3();
            let cosine = |f: FaceId| {
                let corners = mesh.face_vertices(f);
                let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize();
                let is_at = ends.map(|end| corners.contains(&end));
                let moved = |v| if ends.contains(&v) { to } else { at(v) };
                (is_at[0] != is_at[1])
                    .then(|| normal(corners.map(at)).dot(normal(corners.map(moved))))
            };
            let least = mesh.faces().filter_map(cosine).fold(1.0, f64::min);
            if least.abs() < 1e-3 {
                continue;
            }
            let disks = mesh.disks(e);
            let between_disks = disks.as_ref().map(|disks| Way::Collapse(Some(disks)));
            for way in [Some(Way::Collapse(None)), between_disks]
                .into_iter()
                .flatten()
            {
                let is_allowed = surface.deviation_after(e, &way, position).is_some();
                assert_eq!(is_allowed, least > 0.0, "{e:?} to {position}: {least}");
                found[usize::from(is_allowed)] += 1;
            }
        }
    }
    assert!(found.iter().all(|&found| found > 100), "{found:?}");
}

/// The merged vertex is as far from the original as the farther end was, and what the collapse moves it
/// beside: whichever end that was, wherever it goes, between two disks or as any edge.
fn how_far_an_end_was_is_added<S: EdgeStore>() {
    let mut surface = surface_of::<S>(bumpy(5));
    let mut found = [0; 2];
    let edges: Vec<EdgeId> = surface.mesh.edges().collect();
    for e in edges {
        let ends = surface.mesh.edge_vertices(e);
        let [tail, head] = ends.map(|v| surface.geometry.position(v));
        for position in [tail, head, (tail + head) / 2.0] {
            let as_any_edge = Some(Way::Collapse(None));
            let disks = surface.mesh.disks(e);
            let between_disks = disks.as_ref().map(|disks| Way::Collapse(Some(disks)));
            for (way, found) in [as_any_edge, between_disks].iter().zip(&mut found) {
                let Some(way) = way else { continue };
                let Some(moved) = surface.deviation_after(e, way, position) else {
                    continue;
                };
                for far in ends {
                    surface.geometry.set_deviation(far, 0.25);
                    assert_eq!(
                        surface.deviation_after(e, way, position),
                        Some(0.25 + moved)
                    );
                    surface.geometry.set_deviation(far, 0.0);
                }
                *found += 1;
            }
        }
    }
    assert!(found.iter().all(|&found| found > 50), "{found:?}");
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

/// Nothing asked, nothing changed: best has nothing to fit either.
fn ratio_one_is_the_identity<S: EdgeStore>() {
    let targets = Targets {
        ratio: Some(1.0),
        ..Targets::default()
    };
    for quality in QUALITIES {
        for shape in [bumpy(8), shapes::three_fins(3), shapes::moebius(9)] {
            let options = Options {
                targets,
                quality,
                ..Options::default()
            };
            let (same, report) = run_in::<S>(shape.clone(), options);
            assert_eq!(same, mesh(shape), "{quality:?}");
            assert_eq!(report.tally.collapses, 0);
        }
    }
}

/// A cube whose sides are bumpy; the bumps vanish at the edges, which stay straight.
fn bumpy_cube() -> Shape {
    let (mut positions, triangles) = cube(4);
    let is_flush = |c: f32| c == 0.0 || c == 1.0;
    for p in &mut positions {
        let flush = p.to_array().map(is_flush);
        if let [axis] = (0..3).filter(|&i| flush[i]).collect::<Vec<_>>()[..] {
            let wave = |c: f32| (4.0 * std::f32::consts::PI * c).sin();
            p[axis] += 0.02 * wave(p[(axis + 1) % 3]) * wave(p[(axis + 2) % 3]);
        }
    }
    (positions, triangles)
}

/// The two ends of every edge at which a closed mesh turns by more than `degrees`.
fn sharp_edges(mesh: &IndexedMesh, degrees: f32) -> Vec<[Vec3; 2]> {
    let at = |v: u32| mesh.positions()[v as usize];
    let mut sides = std::collections::BTreeMap::<_, Vec<Vec3>>::new();
    for &[a, b, c] in mesh.triangles() {
        let normal = (at(b) - at(a)).cross(at(c) - at(a));
        for [v, w] in [[a, b], [b, c], [c, a]] {
            sides.entry([v.min(w), v.max(w)]).or_default().push(normal);
        }
    }
    let turn = |normals: &[Vec3]| normals[0].angle_between(normals[1]).to_degrees();
    let sharp = sides.iter().filter(|(_, normals)| turn(normals) > degrees);
    sharp.map(|(ends, _)| ends.map(at)).collect()
}

/// The eight corners that are there bit for bit.
fn corners_of_unit_cube(mesh: &IndexedMesh) -> usize {
    let is_corner = |p: &&Vec3| p.to_array().iter().all(|&c| c == 0.0 || c == 1.0);
    mesh.positions().iter().filter(is_corner).count()
}

/// A crease is a curve of its own and ends where curves meet: of a bumpy cube, which turns by 62° and
/// more at its edges and by under 28° elsewhere, the corners stay bit for bit and the edges stay
/// whole. Without the option, corners and edges are but expensive places: they move.
fn creases_stay_where_they_are<S: EdgeStore>() {
    for quality in QUALITIES {
        let run = |feature_angle_degrees| {
            let options = Options {
                feature_angle_degrees,
                ..to_triangles_in(quality, 400)
            };
            run_in::<S>(bumpy_cube(), options)
        };
        let (small, report) = run(Some(45.0));
        assert_eq!(report.triangles_out, 400, "{quality:?}");
        assert_eq!(corners_of_unit_cube(&small), 8, "{quality:?}");
        let sharp = sharp_edges(&small, 45.0);
        for p in sharp.iter().flatten() {
            let off = p.to_array().map(|c| c.abs().min((c - 1.0).abs()));
            let on_sides = off.iter().filter(|&&d| d < 1e-3).count();
            assert!(on_sides >= 2, "{quality:?}: {p} is off the edges");
        }
        let length: f32 = sharp.iter().map(|[a, b]| a.distance(*b)).sum();
        assert!((length - 12.0).abs() < 1e-3, "{quality:?}: {length}");

        let (plain, report) = run(None);
        assert_eq!(report.triangles_out, 400, "{quality:?}");
        assert!(corners_of_unit_cube(&plain) < 8, "{quality:?}");
    }
}

/// A sheet in which every quad of a third row and column is covered twice, by the two triangles of
/// either diagonal: a flat pocket of four faces on four vertices.
fn pocketed_sheet(n: u32) -> Shape {
    let (positions, mut triangles) = shapes::grid(n, n);
    for quad in (0..n * n).filter(|q| q % n % 3 == 1 && q / n % 3 == 1) {
        let quad = 2 * quad as usize;
        let ([a, b, c], d) = (triangles[quad], triangles[quad + 1][2]);
        triangles.extend([[a, b, d], [b, c, d]]);
    }
    (positions, triangles)
}

/// A pocket encloses something, so it stays, with its edges of three faces; where the topology may
/// change it falls flat, and what is left is a plain sheet: two triangles, as of any flat one.
fn pockets_in_a_sheet_fall_flat<S: EdgeStore>() {
    let original = mesh(pocketed_sheet(12));
    assert_eq!(
        info(original.clone(), true).unwrap().non_manifold_edges,
        16 * 4
    );
    for quality in QUALITIES {
        let run = |topology| {
            let options = Options {
                topology,
                ..to_triangles_in(quality, 2)
            };
            run_in::<S>(pocketed_sheet(12), options)
        };
        let (small, report) = run(Topology::Simplify);
        assert_eq!(report.triangles_out, 2, "{quality:?}: {report:?}");
        assert!(report.tally.contractions > 0, "{quality:?}");
        let after = info(small.clone(), true).unwrap();
        let bad = (after.non_manifold_edges, after.non_manifold_vertices);
        assert_eq!(bad, (0, 0), "{quality:?}");
        let largest = measured(&original, &small).surface.two_sided.max;
        // Fast has added up the lines of the pockets: they outweigh the rim when they have gone.
        assert!(
            largest < 1e-6 || quality == Quality::Fast,
            "{quality:?}: {largest}"
        );

        let (kept, report) = run(Topology::Preserve);
        assert_eq!(report.stop_reason, StopReason::Blocked, "{quality:?}");
        assert!(
            report.stopped_short && report.blocked.unwrap().link > 0,
            "{quality:?}"
        );
        assert!(report.triangles_out >= 16 * 4, "{quality:?}: {report:?}");
        assert!(
            info(kept, true).unwrap().non_manifold_edges > 0,
            "{quality:?}"
        );
    }
}

/// Every quad a pocket, and nothing else: edges of four faces, which become fewer as pockets fall
/// flat. Where they must stay, each keeps its four faces.
fn nothing_but_pockets_is_simplified_too<S: EdgeStore>() {
    let n = 8u32;
    let (positions, mut triangles) = shapes::grid(n, n);
    for quad in 0..(n * n) as usize {
        let ([a, b, c], d) = (triangles[2 * quad], triangles[2 * quad + 1][2]);
        triangles.extend([[a, d, b], [b, d, c]]);
    }
    let original = mesh((positions, triangles));
    let before = info(original.clone(), true).unwrap().non_manifold_edges;
    assert_eq!(before, 2 * (n * (n - 1)) as usize);
    for quality in QUALITIES {
        let run = |topology| {
            let options = tiered::<S>(Options {
                topology,
                ..to_triangles_in(quality, 128)
            });
            let (small, report) = decimate(original.clone(), &options).unwrap();
            let after = info(small, true).unwrap();
            (report, after.non_manifold_edges)
        };
        let (report, edges) = run(Topology::Simplify);
        assert_eq!(report.stop_reason, StopReason::Target, "{quality:?}");
        assert!(report.tally.contractions > 0, "{quality:?}");
        assert!(edges <= before / 2, "{quality:?}: {edges} of {before}");

        let (report, _) = run(Topology::Preserve);
        assert_eq!(report.stop_reason, StopReason::Blocked, "{quality:?}");
        assert!(report.blocked.unwrap().link > 0, "{quality:?}");
        assert_eq!(report.triangles_out, 4 * (n * n) as usize, "{quality:?}");
    }
}

/// A sphere and fifty tiny ones far from it, which have most of the vertices. A component costs four
/// triangles at least; where it may go, what is worth nothing goes first.
fn tiny_components_go_where_they_may<S: EdgeStore>() {
    let big = shapes::icosphere(3);
    let (mut positions, mut triangles) = big.clone();
    let (tiny, faces) = shapes::icosphere(1);
    for i in 0..50 {
        let first = positions.len() as u32;
        let angle = i as f32;
        let center = Vec3::new(4.0 * angle.cos(), 4.0 * angle.sin(), 0.1 * angle - 2.5);
        positions.extend(tiny.iter().map(|&p| center + 1e-3 * p));
        triangles.extend(faces.iter().map(|t| t.map(|v| v + first)));
    }
    for quality in QUALITIES {
        let run = |topology| {
            let options = Options {
                topology,
                check: false,
                tier: TierChoice::Fixed(S::TIER),
                ..to_triangles_in(quality, 320)
            };
            decimate(mesh((positions.clone(), triangles.clone())), &options).unwrap()
        };
        let (small, report) = run(Topology::Simplify);
        assert_eq!(
            info(small.clone(), true).unwrap().components,
            1,
            "{quality:?}"
        );
        assert!((316..=320).contains(&report.triangles_out), "{quality:?}");
        // A sphere's limit is 0.2705 over the number of triangles; its faces are 1280 to begin with.
        let rms = measured(&mesh(big.clone()), &small)
            .surface
            .two_sided_of_diagonal
            .rms;
        assert!(rms < 2.1 * 0.2705 / 320.0, "{quality:?}: {rms}");

        let (small, report) = run(Topology::Preserve);
        assert_eq!(info(small, true).unwrap().components, 51, "{quality:?}");
        assert_eq!(report.tally.removed_components, 0, "{quality:?}");
    }
}

/// A sheet cut in the middle but near both ends, the cut 1e-4 wide, so that it has two boundary loops.
/// Where the topology may change it is closed long before it stands in the way; where it may not,
/// three triangles are the fewest around two loops.
fn a_hairline_gap_closes_where_it_may<S: EdgeStore>() {
    let n = 24u32;
    let (mut positions, mut triangles) = bumpy(n);
    let mut across = std::collections::BTreeMap::new();
    for v in (2..n - 1).map(|y| y * (n + 1) + n / 2) {
        across.insert(v, positions.len() as u32);
        positions.push(positions[v as usize] + 1e-4 * Vec3::X);
    }
    let is_right = |t: &[u32; 3]| t.iter().any(|&v| v % (n + 1) > n / 2);
    for t in triangles.iter_mut().filter(|t| is_right(t)) {
        *t = t.map(|v| across.get(&v).copied().unwrap_or(v));
    }
    let original = mesh((positions, triangles));
    let before = info(original.clone(), true).unwrap();
    let sides = (4 * n + 2 * (n - 2)) as usize;
    assert_eq!((before.boundary_loops, before.boundary_edges), (2, sides));
    for quality in QUALITIES {
        let run = |topology, wanted| {
            let options = Options {
                topology,
                ..to_triangles_in(quality, wanted)
            };
            let (small, report) = decimate(original.clone(), &tiered::<S>(options)).unwrap();
            (info(small, true).unwrap(), report)
        };
        let (kept, report) = run(Topology::Preserve, 2);
        assert_eq!(kept.boundary_loops, 2, "{quality:?}");
        assert!(report.stopped_short, "{quality:?}");
        // Fast remembers where the boundaries were, and pays for leaving them: it closes late.
        let late = quality == Quality::Fast;
        for wanted in if late { vec![2] } else { vec![500, 2] } {
            let (closed, report) = run(Topology::Simplify, wanted);
            assert_eq!(closed.boundary_loops, 1, "{quality:?} {wanted}");
            assert!(
                late || report.tally.filled_faces >= 10,
                "{quality:?}: {report:?}"
            );
            assert!(!report.stopped_short, "{quality:?} {wanted}");
        }
    }
}

/// A triangle on its own goes and leaves its slot to a face that closes a gap elsewhere: when its component
/// is to be removed, that face is not.
fn a_slot_used_again_is_in_its_new_component<S: EdgeStore>() {
    let positions = [
        [0.0, 2.0, 2.0],
        [0.0, 2.0, 4.0178e-41],
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 2.0],
        [2.0, 2.0, 2.0],
        [2.0, 2.0003662, 0.0],
        [0.0, 2.0, 0.0],
        [2.0, 0.0, 2.0],
        [2.0, 0.0, 0.0],
        [2.0, 2.0, 0.0],
        [1.105521e-38, 0.0, 2.0],
        [1.2877817e-7, 5.828742e-10, 8.480118e-33],
        [1.5165264e-19, 3.2178946e-8, 2.387278e-6],
        [3.2180765e-8, 5.9680497e-7, 2.1596146],
        [2.0, 2.0, 2.0000138],
        [0.0078125, 2.0, 0.0],
    ];
    let triangles = [
        [0, 1, 2],
        [2, 3, 0],
        [4, 5, 6],
        [6, 0, 4],
        [7, 8, 9],
        [9, 4, 8],
        [3, 2, 8],
        [8, 7, 10],
        [11, 12, 13],
        [3, 7, 14],
        [8, 2, 15],
        [6, 9, 8],
    ];
    for quality in QUALITIES {
        let shape = (positions.map(Vec3::from).to_vec(), triangles.to_vec());
        let options = Options {
            topology: Topology::Simplify,
            weld: false,
            ..to_triangles_in(quality, 6)
        };
        let (out, report) = run_in::<S>(shape, options);
        assert!(report.tally.filled_faces > 0, "{quality:?}");
        assert_eq!(out.triangles().len(), 6, "{quality:?}");
    }
}

for_each_tier!(
    a_slot_used_again_is_in_its_new_component,
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
    what_turns_is_refused,
    how_far_an_end_was_is_added,
    double_sided_sheets_stay_double,
    turned_faces_do_not_stand_in_the_way,
    ratio_one_is_the_identity,
    creases_stay_where_they_are,
    pockets_in_a_sheet_fall_flat,
    nothing_but_pockets_is_simplified_too,
    tiny_components_go_where_they_may,
    a_hairline_gap_closes_where_it_may,
);

/// The tiers give the same mesh, bit for bit, in every quality.
#[test]
fn tiers_give_the_same_bits() {
    for quality in QUALITIES {
        for shape in [
            bumpy(20),
            shapes::three_fins(10),
            shapes::moebius(60),
            shapes::icosphere(3),
        ] {
            let options = to_triangles_in(quality, 60);
            let full = run_in::<Full>(shape.clone(), options.clone()).0;
            let medium = run_in::<Medium>(shape.clone(), options.clone()).0;
            let small = run_in::<Small>(shape, options).0;
            assert!(full == medium && full == small, "{quality:?}");
        }
    }
}

/// One thread or four, the same mesh.
#[test]
fn threads_give_the_same_bits() {
    let with = |threads: usize, quality| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| run_in::<Full>(bumpy(40), to_triangles_in(quality, 300)).0)
    };
    for quality in QUALITIES {
        assert!(with(1, quality) == with(4, quality), "{quality:?}");
    }
}

/// Scaling by a power of two is exact, so the triangles are the same and the positions scaled.
#[test]
fn scaling_by_a_power_of_two_scales_the_result() {
    let (positions, triangles) = bumpy(20);
    for quality in QUALITIES {
        let run = |positions| {
            let shape = (positions, triangles.clone());
            run_in::<Full>(shape, to_triangles_in(quality, 150)).0
        };
        let expected = run(positions.clone());
        for power in [-60, -20, 1, 30, 90] {
            let factor = 2f32.powi(power);
            let small = run(positions.iter().map(|&p| p * factor).collect());
            assert_eq!(
                small.triangles(),
                expected.triangles(),
                "{quality:?}, 2^{power}"
            );
            for (p, q) in small.positions().iter().zip(expected.positions()) {
                assert_eq!(*p, *q * factor, "{quality:?}, 2^{power}");
            }
        }
    }
}

/// Smaller, a millionth of a millionth of it or far away: the same count, and the same distance for
/// its size. Only rounding differs, so only by chance.
#[test]
fn scale_and_place_do_not_matter() {
    let (positions, triangles) = bumpy(60);
    let original = mesh((positions.clone(), triangles.clone()));
    let scaled = |factor: f32| {
        let positions = positions.iter().map(|&p| p * factor).collect();
        mesh((positions, triangles.clone()))
    };
    let mut far = MeshBuilder::default();
    let place = 1e6 * original.diagonal() * DVec3::new(1.0, -0.7, 0.3);
    for p in original.points() {
        far.push_double((p + place).to_array());
    }
    triangles.iter().for_each(|&t| far.push_triangle(t));
    let far = far.finish().unwrap();
    assert!(far.origin().length() > 1e6);
    for quality in QUALITIES {
        let run = |original: &IndexedMesh| {
            let options = to_triangles_in(quality, 700);
            let (small, report) = decimate(original.clone(), &options).unwrap();
            assert!((699..=700).contains(&report.triangles_out), "{quality:?}");
            (
                measured(original, &small).surface.two_sided_of_diagonal.rms,
                small,
            )
        };
        let (expected, near) = run(&original);
        for (name, moved) in [
            ("1e-6", scaled(1e-6)),
            ("1e-30", scaled(1e-30)),
            ("far", far.clone()),
        ] {
            let ratio = run(&moved).0 / expected;
            assert!((ratio - 1.0).abs() < 0.01, "{quality:?}, {name}: {ratio}");
        }
        // The origin alone is only carried along.
        let there = IndexedMesh::with_origin(place, positions.clone(), triangles.clone()).unwrap();
        let (_, small) = run(&there);
        assert_eq!(small.origin(), place);
        assert!(small.positions() == near.positions() && small.triangles() == near.triangles());
    }
}

/// Stretched, other collapses are cheap. Those of the original, stretched along, are there to be
/// found as well, and not much better: at most 8 % (bumpy grid; fast and best), on closed shapes 1 %.
#[test]
fn a_stretched_mesh_is_decimated_as_what_it_is() {
    let stretched = |mesh: &IndexedMesh| {
        let stretch = Vec3::new(30.0, 1.0, 1.0);
        let positions = mesh.positions().iter().map(|&p| p * stretch).collect();
        IndexedMesh::new(positions, mesh.triangles().to_vec()).unwrap()
    };
    for shape in [bumpy(50), shapes::icosphere(4), shapes::torus(60, 30)] {
        let plain = mesh(shape);
        let long = stretched(&plain);
        for quality in QUALITIES {
            let options = to_triangles_in(quality, 500);
            let run = |mesh: &IndexedMesh| decimate(mesh.clone(), &options).unwrap();
            let ((small, _), (round, _)) = (run(&long), run(&plain));
            let count = round.triangle_count();
            // At a boundary a collapse takes one.
            assert!(small.triangle_count().abs_diff(count) <= 1, "{quality:?}");
            let rms = |mesh: &IndexedMesh| measured(&long, mesh).surface.two_sided.rms;
            let ratio = rms(&small) / rms(&stretched(&round));
            assert!(ratio < 1.1, "{quality:?}: {ratio}");
        }
    }
}

/// Vertices on edges, where they belong to one side alone, make triangles of no area: the surface is
/// the same, and so is what is left of it. What fast adds up depends on the vertices it begins with:
/// 7 % by chance, whichever edges are split.
#[test]
fn triangles_of_no_area_do_no_harm() {
    let (mut positions, triangles) = bumpy(64);
    // On a grid, so that the middle of an edge is exactly on it.
    for p in &mut positions {
        p.z = (p.z * 4096.0).round() / 4096.0;
    }
    let plain = mesh((positions.clone(), triangles.clone()));
    let mut split = Vec::new();
    for (i, &[a, b, c]) in triangles.iter().enumerate() {
        if i % 4 == 1 && i < 8000 {
            let m = positions.len() as u32;
            positions.push((positions[a as usize] + positions[b as usize]) / 2.0);
            split.extend([[a, m, c], [m, b, c], [a, b, m]]);
        } else {
            split.push([a, b, c]);
        }
    }
    let split = mesh((positions, split));
    assert_eq!(info(split.clone(), true).unwrap().zero_area_faces, 2000);
    for (quality, within) in QUALITIES.into_iter().zip([0.1, 0.02, 0.02]) {
        let rms = |mesh: &IndexedMesh| {
            let options = to_triangles_in(quality, 800);
            let (small, report) = decimate(mesh.clone(), &options).unwrap();
            assert!((799..=800).contains(&report.triangles_out), "{quality:?}");
            measured(&plain, &small).surface.two_sided.rms
        };
        let ratio = rms(&split) / rms(&plain);
        assert!((ratio - 1.0).abs() < within, "{quality:?}: {ratio}");
    }
}

/// Shapes on which nothing is flat, with the triangles to come down to.
fn smooth() -> [(&'static str, IndexedMesh, usize); 3] {
    [
        ("bumpy grid", mesh(bumpy(60)), 500),
        ("icosphere", mesh(shapes::icosphere(4)), 400),
        ("torus", mesh(shapes::torus(80, 40)), 500),
    ]
}

/// Fitting lowers the distance that it is measured by, and does not pay for it with the largest.
#[test]
fn best_is_nearer_than_standard() {
    for (name, original, triangles) in smooth() {
        let run = |quality| {
            let options = to_triangles_in(quality, triangles);
            let (small, report) = decimate(original.clone(), &options).unwrap();
            let distances = measured(&original, &small).surface.two_sided;
            (report.triangles_out, distances)
        };
        let (standard, best) = (run(Quality::Standard), run(Quality::Best));
        assert_eq!(standard.0, best.0, "{name}");
        let rms = best.1.rms / standard.1.rms;
        let largest = best.1.max / standard.1.max;
        println!("{name}: rms {rms}, Hausdorff {largest}");
        assert!(rms < 0.95, "{name}: rms {rms}");
        assert!(largest < 1.01, "{name}: Hausdorff {largest}");
    }
}

/// Two bumpy sheets of 2·`n`² triangles, `gap` apart, closed at the rim.
fn double_sheet(n: u32, gap: f32, height: f32) -> IndexedMesh {
    let (mut positions, mut triangles) = bumpy(n);
    positions.iter_mut().for_each(|p| p.z *= height);
    let below = positions.len() as u32;
    positions.extend_from_within(..);
    for p in &mut positions[below as usize..] {
        p.z -= gap;
    }
    let turned = |&[a, b, c]: &[u32; 3]| [a, c, b].map(|v| v + below);
    triangles.extend(triangles.clone().iter().map(turned));
    let at = |x: u32, y: u32| y * (n + 1) + x;
    for i in 0..n {
        for [a, b] in [
            [at(i, 0), at(i + 1, 0)],
            [at(n, i), at(n, i + 1)],
            [at(i + 1, n), at(i, n)],
            [at(0, i + 1), at(0, i)],
        ] {
            triangles.extend([[a, b + below, b], [a, a + below, b + below]]);
        }
    }
    mesh((positions, triangles))
}

/// The nearest face is often the other side's: it must be neither fitted to nor collapsed onto. With
/// lower bumps the distance left is under the gap, and the sheets do not cut each other.
#[test]
fn a_thin_double_sheet_keeps_its_volume() {
    for (height, within, apart) in [(1.0, 0.06, false), (0.3, 5e-3, true)] {
        let original = double_sheet(80, 1e-3, height);
        let before = volume(&original);
        assert!((before - 1e-3).abs() < 1e-6, "{before}");
        for quality in QUALITIES {
            let wanted = original.triangle_count() / 10;
            let options = to_triangles_in(quality, wanted);
            let (small, report) = decimate(original.clone(), &options).unwrap();
            assert_eq!(report.triangles_out, wanted, "{quality:?}");
            let ratio = volume(&small) / before;
            println!("{height} {quality:?}: {ratio} of the volume");
            assert!(
                (ratio - 1.0).abs() < within,
                "{quality:?}: {ratio} of the volume"
            );
            if apart {
                let few = CompareOptions {
                    samples: 1000,
                    intersections: true,
                };
                let c = compare(original.clone(), small, &few).unwrap();
                assert_eq!(c.intersecting_pairs, Some(0), "{quality:?}");
            }
        }
    }
}

/// A vertex that shoots off is farther away than anyone estimated; smooth shapes and a stretched one.
#[test]
fn no_vertex_is_farther_than_three_estimates() {
    let stretch = |p: &Vec3| *p * Vec3::new(30.0, 1.0, 1.0);
    let (positions, triangles) = bumpy(50);
    let long = mesh((positions.iter().map(stretch).collect(), triangles));
    for (name, original, triangles) in smooth().into_iter().chain([("stretched", long, 500)]) {
        for quality in QUALITIES {
            let options = to_triangles_in(quality, triangles);
            let (small, report) = decimate(original.clone(), &options).unwrap();
            let farthest = farthest_vertex(&small, &original);
            let share = farthest / report.max_error_estimate;
            println!("{name}, {quality:?}: {share} of the estimate");
            assert!(
                farthest > 0.0 && share < 3.0,
                "{name}, {quality:?}: {share}"
            );
        }
    }
}

/// What is fitted is measured: on a closed smooth shape the error that stops it is nearly a bound.
#[test]
fn best_keeps_an_error_limit_as_measured() {
    for (name, original, _) in &smooth()[1..] {
        for share in [1e-3, 4e-3] {
            let limit = share * original.diagonal();
            let run = |quality| {
                let options = Options {
                    quality,
                    ..to_error(limit)
                };
                decimate(original.clone(), &options).unwrap()
            };
            let (small, report) = run(Quality::Best);
            assert_eq!(report.stop_reason, StopReason::MaxError, "{name}");
            let largest = measured(original, &small).surface.two_sided.max / limit;
            println!(
                "{name}, {share}: {largest} of the limit, {}",
                report.triangles_out
            );
            assert!(largest < 1.05, "{name}: {largest} of the limit");
            // Fitting makes room for more collapses.
            assert!(
                report.triangles_out < run(Quality::Standard).1.triangles_out,
                "{name}"
            );
        }
    }
}

/// Where the boundary is free nobody says where it should be; fitting must not let it, or what is
/// behind it, fly off after what has gone.
#[test]
fn a_free_boundary_is_not_fitted_away() {
    for (shape, triangles) in [(bumpy(50), 1000), (bumpy(50), 300), (wall(60, 20), 300)] {
        let original = mesh(shape);
        let farthest = |quality| {
            let options = Options {
                boundary: Boundary::Free,
                ..to_triangles_in(quality, triangles)
            };
            let (small, report) = decimate(original.clone(), &options).unwrap();
            let count = report.triangles_out;
            assert!((triangles - 1..=triangles).contains(&count), "{quality:?}");
            let hausdorff = measured(&original, &small).surface.two_sided.max;
            [farthest_vertex(&small, &original), hausdorff]
        };
        let (standard, best) = (farthest(Quality::Standard), farthest(Quality::Best));
        for (standard, best) in standard.into_iter().zip(best) {
            assert!(best <= 1.01 * standard, "{best} after {standard}");
        }
    }
}

/// An angle is none, or nobody can turn by it.
#[test]
fn a_feature_angle_out_of_range_is_an_error() {
    for (degrees, is_right) in [
        (f64::NAN, false),
        (-5.0, false),
        (720.0, false),
        (f64::INFINITY, false),
        (30.0, true),
        (90.0, true),
    ] {
        let options = Options {
            feature_angle_degrees: Some(degrees),
            ..to_triangles(100)
        };
        match decimate(mesh(bumpy(10)), &options) {
            Ok(_) => assert!(is_right, "{degrees}"),
            Err(Error::InvalidOptions(message)) => {
                assert!(
                    !is_right && message.contains("angle"),
                    "{degrees}: {message}"
                );
            }
            Err(error) => panic!("{degrees}: {error}"),
        }
    }
}

/// Only the ratios of the weights count: a power of two in all of them changes nothing, nor does the
/// same weight everywhere. 0 and what single precision cannot multiply are among them.
#[test]
fn scaling_the_weights_changes_nothing() {
    for quality in QUALITIES {
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
    for quality in QUALITIES {
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

/// A vertex of valence 100 000 does not cost its valence at every collapse on the rim, nor at every
/// spoke that is refused: with an even rim, and with a jagged one, whatever is asked to be kept.
#[test]
fn a_busy_vertex_takes_no_quadratic_time() {
    let n = 100_000u32;
    let cone = |jag: f64, height: f32| {
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
        mesh((positions, triangles))
    };
    let down = |mesh: IndexedMesh, options: Options| decimate(mesh, &options).unwrap().1;
    for (jag, height) in [(0.01, 0.5), (0.3, 0.0)] {
        let report = down(cone(jag, height), to_triangles(50_000));
        assert_eq!(report.triangles_out, 50_000);
    }
    let creased = Options {
        feature_angle_degrees: Some(20.0),
        ..to_triangles(50_000)
    };
    // Where spokes are sharp, they stay.
    assert!(down(cone(0.01, 0.5), creased).triangles_out < 90_000);
    let simplified = Options {
        topology: Topology::Simplify,
        ..to_triangles_in(Quality::Fast, 50_000)
    };
    assert_eq!(down(cone(0.01, 0.5), simplified).triangles_out, 50_000);
    let locked = Options {
        boundary: Boundary::Lock,
        ..to_triangles(50_000)
    };
    assert_eq!(down(cone(0.01, 0.5), locked).triangles_out, n as usize);
}

/// A book of 10 000 pages of five faces on one edge: the vertices of the spine are met once a collapse,
/// not once a page, and their edges are not all looked at again when a page collapses into them.
#[test]
fn a_busy_edge_takes_no_quadratic_time() {
    let pages = 10_000u32;
    for quality in [Quality::Fast, Quality::Standard] {
        let mut positions = vec![Vec3::ZERO, Vec3::Z];
        let mut triangles = Vec::new();
        for page in 0..pages {
            let angle = f64::from(page) / f64::from(pages) * std::f64::consts::TAU;
            let (x, y) = (angle.cos() as f32, angle.sin() as f32);
            let a = positions.len() as u32;
            positions.extend([0.1, 0.9].map(|z| Vec3::new(0.5 * x, 0.5 * y, z)));
            positions.extend([0.1, 0.8].map(|z| Vec3::new(x, y, z)));
            positions.push(Vec3::new(1.2 * x, 1.2 * y, 0.6));
            triangles.extend([
                [0, 1, a],
                [1, a + 1, a],
                [a, a + 1, a + 2],
                [a + 1, a + 3, a + 2],
                [a + 2, a + 3, a + 4],
            ]);
        }
        let options = to_triangles_in(quality, 2 * pages as usize);
        let (small, report) = decimate(mesh((positions, triangles)), &options).unwrap();
        assert_eq!(small.triangle_count(), report.triangles_out);
        assert_eq!(report.triangles_out, 2 * pages as usize);
    }
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

/// Pieces decimated on their own before the whole.
mod chunked {
    use super::*;

    /// [`to_triangles_in`], in chunks of so many triangles.
    fn in_chunks(quality: Quality, triangles: usize, chunks: Chunks) -> Options {
        Options {
            chunks,
            ..to_triangles_in(quality, triangles)
        }
    }

    /// A dense bumpy ball on a coarse block: a hundred triangles for each of the block's size.
    fn ball_on_a_block(levels: u32) -> Shape {
        let (mut positions, mut triangles) = shapes::icosphere(levels);
        for p in &mut positions {
            *p *= 1.0 + 0.05 * (9.0 * p.x).sin() * (8.0 * p.y).cos() * (7.0 * p.z).sin();
        }
        let (block, faces) = cube(2);
        let first = positions.len() as u32;
        positions.extend(
            block
                .iter()
                .map(|&p| (p - Vec3::splat(0.5)) * 6.0 - Vec3::Z * 4.2),
        );
        triangles.extend(faces.iter().map(|t| t.map(|v| v + first)));
        (positions, triangles)
    }

    /// Vertices, faces and corners in another order.
    fn shuffled((positions, triangles): &Shape) -> Shape {
        let mut state = 12345u64;
        let mut random = |n: usize| {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 33) as usize % n
        };
        let mut order: Vec<usize> = (0..positions.len()).collect();
        for i in (1..order.len()).rev() {
            order.swap(i, random(i + 1));
        }
        let mut places = vec![Vec3::ZERO; positions.len()];
        for (old, &new) in order.iter().enumerate() {
            places[new] = positions[old];
        }
        let mut faces: Vec<[u32; 3]> = triangles
            .iter()
            .map(|t| {
                let mut t = t.map(|v| order[v as usize] as u32);
                t.rotate_left(random(3));
                t
            })
            .collect();
        for i in (1..faces.len()).rev() {
            faces.swap(i, random(i + 1));
        }
        (places, faces)
    }

    /// Pieces of the mesh decimated on their own are as near to the original as the whole decimated at
    /// once, evenly sampled or not, in order or not, and hold the target.
    #[test]
    fn chunks_are_as_near_as_the_whole() {
        let even = bumpy(128);
        for (name, shape, within) in [
            ("torus", shapes::torus(240, 80), 1.03),
            ("shuffled", shuffled(&even), 1.04),
            ("even", even, 1.05),
            ("ball on a block", ball_on_a_block(6), 1.05),
        ] {
            let original = mesh(shape);
            for quality in [Quality::Fast, Quality::Standard] {
                let target = original.triangle_count() / 10;
                let run = |chunks| {
                    let options = in_chunks(quality, target, chunks);
                    let (small, report) = decimate(original.clone(), &options).unwrap();
                    assert!(
                        (target - 1..=target).contains(&report.triangles_out),
                        "{name}"
                    );
                    (measured(&original, &small).surface.two_sided.rms, report)
                };
                let chunks = Chunks::Triangles(original.triangle_count() / 6);
                let ((whole, off), (parts, on)) = (run(Chunks::Off), run(chunks));
                println!(
                    "{name}, {quality:?}: {}, {} chunks",
                    parts / whole,
                    on.chunks
                );
                assert_eq!(off.collapses_in_chunks, 0);
                assert!(on.chunks > 5 && on.chunk_rounds >= 2, "{name}");
                assert!(2 * on.collapses_in_chunks > on.tally.collapses, "{name}");
                assert!(
                    parts < within * whole,
                    "{name}, {quality:?}: {}",
                    parts / whole
                );
            }
        }
    }

    /// In chunks, too, the result is one, whatever the threads and the tier; it stays closed.
    fn chunks_are_the_same_bytes_with_any_number_of_threads<S: EdgeStore>() {
        let original = mesh(ball_on_a_block(5));
        let before = info(original.clone(), true).unwrap();
        for quality in QUALITIES {
            let run = |threads, tier| {
                let options = Options {
                    tier: TierChoice::Fixed(tier),
                    ..in_chunks(quality, 1500, Chunks::Triangles(1000))
                };
                let pool = rayon::ThreadPoolBuilder::new()
                    .num_threads(threads)
                    .build()
                    .unwrap();
                pool.install(|| decimate(original.clone(), &options))
                    .unwrap()
                    .0
            };
            let one = run(1, Tier::Full);
            for threads in [2, 5] {
                let other = run(threads, S::TIER);
                assert!(
                    one.positions() == other.positions() && one.triangles() == other.triangles()
                );
            }
            let after = info(one, true).unwrap();
            assert_eq!(after.components, before.components, "{quality:?}");
            assert_eq!(
                after.euler_characteristic, before.euler_characteristic,
                "{quality:?}"
            );
            assert_eq!(after.boundary_edges, 0, "{quality:?}");
        }
    }

    /// What only the whole can tell is found before the chunks are cut: boundaries that are locked,
    /// creases, faces that run the other way round than their neighbours.
    fn chunks_know_what_the_whole_knows<S: EdgeStore>() {
        let chunks = Chunks::Triangles(300);
        for quality in [Quality::Fast, Quality::Standard] {
            let (positions, triangles) = bumpy(40);
            let options = Options {
                boundary: Boundary::Lock,
                ..in_chunks(quality, 400, chunks)
            };
            let original = positions.clone();
            let (small, report) = run_in::<S>((positions, triangles), options);
            assert!(report.chunks > 2);
            assert!(
                rim_of_square(small.positions()) == rim_of_square(&original),
                "{quality:?}"
            );

            let options = Options {
                feature_angle_degrees: Some(45.0),
                ..in_chunks(quality, 12, chunks)
            };
            let (small, report) = run_in::<S>(cube(4), options);
            assert!(report.chunks > 2);
            assert_eq!((report.triangles_out, report.vertices_out), (12, 8));
            for p in small.positions() {
                assert!(p.to_array().iter().all(|&c| c == 0.0 || c == 1.0), "{p}");
            }

            let (positions, mut triangles) = shapes::torus(60, 30);
            for (i, t) in triangles.iter_mut().enumerate() {
                if i % 5 == 1 {
                    t.swap(1, 2);
                }
            }
            let (small, report) =
                run_in::<S>((positions, triangles), in_chunks(quality, 400, chunks));
            assert!(report.chunks > 2 && report.collapses_in_chunks > 0);
            assert_eq!(report.reoriented_faces, 720);
            assert_eq!(report.non_manifold_edges_in, 0);
            assert_eq!(info(small, true).unwrap().boundary_edges, 0);
        }
    }

    /// With an error alone as the target, each chunk goes as far as it may.
    fn chunks_stop_at_the_largest_error<S: EdgeStore>() {
        for quality in QUALITIES {
            let options = Options {
                quality,
                chunks: Chunks::Triangles(600),
                ..to_error(0.01)
            };
            let (small, report) = run_in::<S>(bumpy(50), options.clone());
            assert!(report.chunks > 2, "{quality:?}");
            assert!(report.max_error_estimate <= 0.01, "{quality:?}");
            let whole = Options {
                chunks: Chunks::Off,
                ..options
            };
            let (_, whole) = run_in::<S>(bumpy(50), whole);
            let ratio = small.triangle_count() as f64 / whole.triangles_out as f64;
            assert!((0.8..1.25).contains(&ratio), "{quality:?}: {ratio}");
        }
    }

    /// Non-manifold edges and vertices go on in chunks, and are counted once although chunks share them.
    fn chunks_count_what_is_not_manifold<S: EdgeStore>() {
        let (positions, triangles) = shapes::three_fins(24);
        for quality in [Quality::Fast, Quality::Standard] {
            let whole = in_chunks(quality, 300, Chunks::Off);
            let (_, whole) = run_in::<S>((positions.clone(), triangles.clone()), whole);
            let parts = in_chunks(quality, 300, Chunks::Triangles(200));
            let (small, parts) = run_in::<S>((positions.clone(), triangles.clone()), parts);
            assert!(parts.chunks > 2);
            assert!(whole.non_manifold_edges_in > 20);
            assert_eq!(parts.non_manifold_edges_in, whole.non_manifold_edges_in);
            let after = info(small, true).unwrap();
            assert!(after.non_manifold_edges > 0 && after.non_manifold_edges < 24);
        }
    }

    /// Where nothing costs anything no threshold stops a chunk, and all could go: the target does.
    fn chunks_stop_at_the_target<S: EdgeStore>() {
        for quality in QUALITIES {
            let options = in_chunks(quality, 1000, Chunks::Triangles(300));
            let (_, report) = run_in::<S>(shapes::grid(42, 42), options);
            assert!(report.chunks > 2 && report.collapses_in_chunks > 0);
            let left = report.triangles_out;
            assert!((999..=1000).contains(&left), "{quality:?}: {left}");
        }
    }

    /// Chunks in which nothing may collapse add up what they know of vertices, and to that the lines of
    /// the boundaries and non-manifold edges on a seam, times the weights of vertices: every edge costs
    /// what it costs in the whole, but for rounding.
    fn chunks_add_up_to_the_whole<S: EdgeStore>() {
        for (name, shape, weights) in [
            ("sheet", bumpy(24), &[1.0][..]),
            ("fins", shapes::three_fins(16), &[1.0]),
            ("weighted sheet", bumpy(24), &[1.0, 9.0, 0.5]),
        ] {
            let original = mesh(shape);
            let count = original.positions().len();
            let weights = weights.iter().copied().cycle().take(count).collect();
            let original = original.with_weights(weights).unwrap();
            let (min, max) = original.bounds().unwrap();
            let room = Room::around([min, max]);
            let options = in_chunks(Quality::Fast, 1, Chunks::Triangles(60));
            let mut flat = Flat::of(original.into_parts());
            flat.locked = vec![true; flat.positions.len()];
            let chunked = Chunked {
                options: &options,
                stop: Stop {
                    triangles: 1,
                    max_error: None,
                    max_cost: f32::INFINITY,
                },
                room,
            };
            let done = chunked.reduce::<S, Accumulated>(&mut flat, &mut Meter::unheard());
            assert!(done.unwrap().chunks > 20);
            let whole = Mesh::<S>::from_triangles(flat.positions.len(), &flat.triangles);
            let (surface, states) = flat.into_surface(whole, room, &[]);
            let meter = &mut Meter::unheard();
            let in_chunks = Accumulated::with_states(&surface, &options, states, meter).unwrap();
            let at_once = Accumulated::new(&surface, &options, meter).unwrap();
            for e in surface.mesh.edges() {
                let cost = |of: &Accumulated| of.evaluate(&surface, e, [true, false]).unwrap().cost;
                let (found, expected) = (cost(&in_chunks), cost(&at_once));
                assert!(
                    (found - expected).abs() <= 1e-4 * expected + 1e-9,
                    "{name}, {e:?}: {found} for {expected}"
                );
            }
        }
    }

    for_each_tier!(
        chunks_are_the_same_bytes_with_any_number_of_threads,
        chunks_know_what_the_whole_knows,
        chunks_stop_at_the_largest_error,
        chunks_stop_at_the_target,
        chunks_add_up_to_the_whole,
        chunks_count_what_is_not_manifold,
    );
}
