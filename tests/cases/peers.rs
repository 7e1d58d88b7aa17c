//! The cases with which meshoptimizer, libigl, fast-simplification, OpenMesh and CGAL test their own
//! decimation, as facts about ours.

use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};

use decimate::decimate::{Boundary, StopReason};
use decimate::error::Error;
use decimate::indexed_mesh::MeshBuilder;
use glam::DVec3;

use super::*;

/// What counts as no distance: the rounding of the ruler, of the diagonal.
const ZERO: f64 = 1e-7;

/// meshoptimizer: the smallest closed surface is stuck, whatever is asked for.
#[test]
fn a_tetrahedron_is_stuck() {
    let tetrahedron = mesh(shapes::tetrahedron());
    for quality in QUALITIES {
        for wanted in [0, 2, 3] {
            let (same, report) = run_in_every_tier(&tetrahedron, &to_triangles(quality, wanted));
            assert_same(&same, &tetrahedron);
            assert_eq!(report.stop_reason, StopReason::Blocked, "{quality:?}");
            assert!(report.blocked.unwrap().link == 6, "{quality:?}: {report:?}");
        }
    }
}

/// meshoptimizer: three triangles in a strip become two, at no distance. Where the middle one runs
/// the other way its own result is stuck at three; ours agrees on a direction first and is not.
#[test]
fn a_strip_comes_down_to_two_also_where_its_middle_is_turned() {
    let positions = [[0., 0.], [1., 0.], [2., 0.], [0.5, 1.], [1.5, 1.]];
    let positions: Vec<Vec3> = positions.map(|[x, y]| Vec3::new(x, y, 0.0)).into();
    for (middle, turned) in [([3, 1, 4], 0), ([1, 3, 4], 1)] {
        let strip = mesh((positions.clone(), vec![[0, 1, 3], middle, [1, 2, 4]]));
        for quality in QUALITIES {
            let (small, report) = run_in_every_tier(&strip, &to_triangles(quality, 2));
            assert_eq!(report.triangles_out, 2, "{quality:?}, {middle:?}");
            assert_eq!(report.reoriented_faces, turned, "{quality:?}");
            let (_, largest) = distances(&strip, &small);
            assert!(largest < ZERO, "{quality:?}, {middle:?}: {largest}");
        }
    }
}

/// meshoptimizer: one square of two triangles cannot lose a corner within an error of a thousandth.
#[test]
fn a_square_keeps_its_corners() {
    let square = mesh(shapes::grid(1, 1));
    for quality in QUALITIES {
        let options = to_error(quality, 1e-3);
        let (same, report) = run_in_every_tier(&square, &options);
        assert_same(&same, &square);
        assert_eq!(report.stop_reason, StopReason::MaxError, "{quality:?}");
        assert!(!report.stopped_short, "{quality:?}");
    }
}

/// meshoptimizer: of 3 × 3 vertices with a locked border the one in the middle goes, which leaves the
/// octagon's 6 triangles.
#[test]
fn a_locked_border_leaves_the_middle_to_go() {
    let lattice = mesh(shapes::grid(2, 2));
    let middle = lattice.positions()[4];
    for quality in QUALITIES {
        let options = Options {
            boundary: Boundary::Lock,
            ..to_triangles(quality, 0)
        };
        let (small, report) = run_in_every_tier(&lattice, &options);
        assert_eq!(report.triangles_out, 6, "{quality:?}");
        let mut rim = lattice.positions().to_vec();
        rim.retain(|&p| p != middle);
        let of = |positions: &[Vec3]| bits(positions).into_iter().collect::<BTreeSet<_>>();
        assert_eq!(of(small.positions()), of(&rim), "{quality:?}");
    }
}

/// meshoptimizer: faces that name a vertex twice make no edges; the triangle of four comes down to
/// two as without them, and to one.
#[test]
fn faces_that_name_a_vertex_twice_are_no_faces() {
    let positions = [[0., 0.], [0., 1.], [0., 2.], [1., 0.], [2., 0.], [1., 1.]];
    let positions: Vec<Vec3> = positions.map(|[x, y]| Vec3::new(x, y, 0.0)).into();
    let proper = vec![[0, 1, 3], [3, 1, 5], [1, 2, 5], [3, 5, 4]];
    let mut soiled = proper.clone();
    soiled.extend([[1, 0, 1], [0, 3, 0]]);
    let (proper, soiled) = (mesh((positions.clone(), proper)), mesh((positions, soiled)));
    for quality in QUALITIES {
        for wanted in [2, 1] {
            let options = to_triangles(quality, wanted);
            let (small, report) = run_in_every_tier(&soiled, &options);
            assert_eq!(report.cleaning.dropped_degenerate_faces, 2);
            assert_eq!(report.triangles_out, wanted, "{quality:?}");
            let (_, largest) = distances(&proper, &small);
            assert!(largest < ZERO, "{quality:?}, {wanted}: {largest}");
            assert_same(&small, &run(&proper, &options).0);
        }
    }
}

/// meshoptimizer: along a seam of twin vertices nothing tears: the sheet comes down to two triangles
/// that share an edge, as without the seam.
#[test]
fn a_seam_does_not_tear() {
    let (mut positions, mut triangles) = shapes::grid(4, 4);
    // The column x = 1/2 has a twin, which the right half uses.
    let twin = |v: u32| 25 + v / 5;
    let column: Vec<Vec3> = (0..5).map(|row| positions[5 * row + 2]).collect();
    positions.extend(column);
    for (i, triangle) in triangles.iter_mut().enumerate() {
        let is_right = i % 8 >= 4;
        let on_seam = |v: u32| v < 25 && v % 5 == 2;
        *triangle = triangle.map(|v| if is_right && on_seam(v) { twin(v) } else { v });
    }
    let seamed = mesh((positions, triangles));
    assert_eq!(topology(&seamed).0, 2);
    for quality in QUALITIES {
        let (small, report) = run_in_every_tier(&seamed, &to_triangles(quality, 2));
        assert_eq!(report.cleaning.welded_vertices, 5);
        assert_eq!((report.triangles_out, report.vertices_out), (2, 4));
        let (_, largest) = distances(&seamed, &small);
        assert!(largest < ZERO, "{quality:?}: {largest}");
    }
}

/// meshoptimizer: nothing in, nothing out; ours says that there is nothing.
#[test]
fn nothing_is_an_error_that_says_so() {
    for quality in QUALITIES {
        for wanted in [0, 12] {
            let nothing = IndexedMesh::new(vec![], vec![]).unwrap();
            let error = decimate(nothing, &to_triangles(quality, wanted)).unwrap_err();
            assert!(matches!(&error, Error::InvalidMesh(why) if why.contains("no triangle")));
        }
    }
}

/// libigl: every closed mesh of genus 0 comes down to 4 vertices and 4 faces, if nothing else is
/// asked for.
#[test]
fn closed_meshes_of_genus_0_come_down_to_a_tetrahedron() {
    let octahedron = subdivided_octahedron(0);
    for (name, shape) in [
        ("icosahedron", shapes::icosphere(0)),
        ("octahedron", octahedron),
        ("sphere", shapes::icosphere(4)),
        ("potato", potato(4)),
        ("finer octahedron", subdivided_octahedron(3)),
        ("ball of rings", ball_of_rings(30, 20)),
    ] {
        let closed = mesh(shape);
        for quality in QUALITIES {
            let (small, report) = run_in_every_tier(&closed, &to_triangles(quality, 0));
            let counts = (report.vertices_out, report.triangles_out);
            assert_eq!(counts, (4, 4), "{quality:?}, {name}: {:?}", report.blocked);
            assert_eq!(topology(&small), (1, 2, true), "{quality:?}, {name}");
        }
    }
}

fn subdivided_octahedron(levels: u32) -> Shape {
    let positions = [
        Vec3::X,
        Vec3::Y,
        Vec3::NEG_X,
        Vec3::NEG_Y,
        Vec3::Z,
        Vec3::NEG_Z,
    ];
    let sides = (0..4).flat_map(|i| [[i, (i + 1) % 4, 4], [(i + 1) % 4, i, 5]]);
    let octahedron = (positions.into(), sides.collect());
    (0..levels).fold(octahedron, |shape, _| shapes::subdivided(shape))
}

/// libigl: a wall of 5 × 12 squares comes down to its 10 corners and 10 triangles: its own vertices,
/// so that nothing is between the two but rounding.
#[test]
fn a_cylinder_wall_keeps_ten_of_its_own_vertices() {
    let (around, along) = (5, 12);
    let mut positions = Vec::new();
    for j in 0..=along {
        for i in 0..around {
            let angle = f64::from(i) / f64::from(around) * TAU;
            let height = f64::from(j) / f64::from(along);
            positions.push(DVec3::new(angle.cos(), angle.sin(), height).as_vec3());
        }
    }
    let triangles = squares(around, along, |i, j| j * around + i % around);
    let wall = mesh((positions, triangles));
    let own: BTreeSet<Bits> = bits(wall.positions()).into_iter().collect();
    for quality in QUALITIES {
        for options in [to_triangles(quality, 10), onto_own_vertices(quality, 10)] {
            let (small, report) = run_in_every_tier(&wall, &options);
            let counts = (report.triangles_out, report.vertices_out);
            assert_eq!(counts, (10, 10), "{quality:?}");
            let (_, largest) = distances(&wall, &small);
            assert!(largest < ZERO, "{quality:?}: {largest}");
            if options.placement == Placement::Endpoint {
                assert!(bits(small.positions()).iter().all(|p| own.contains(p)));
            }
        }
    }
}

/// fast-simplification: a plane of 3 × 3 vertices at half is 4 triangles, and the same plane.
#[test]
fn a_plane_at_half_is_the_same_plane() {
    let plane = mesh(shapes::grid(2, 2));
    for quality in QUALITIES {
        let options = Options {
            targets: Targets {
                ratio: Some(0.5),
                ..Targets::default()
            },
            quality,
            ..Options::default()
        };
        let (small, report) = run_in_every_tier(&plane, &options);
        assert_eq!(report.triangles_out, 4, "{quality:?}");
        let (_, largest) = distances(&plane, &small);
        assert!(largest < ZERO, "{quality:?}: {largest}");
    }
}

/// fast-simplification: to keep all changes no bit, not of −0, nor of the smallest number, nor of a
/// mesh that is scaled on the way.
#[test]
fn ratio_one_is_equal_to_the_bit() {
    let (positions, triangles) = potato(2);
    for scale in [1.0, 3.0e-39, 1.0e-30, 1.0e30] {
        let mut positions: Vec<Vec3> = positions.iter().map(|&p| p * scale).collect();
        positions[7].x = -0.0;
        positions[8].y = 1.0e-45;
        let input = mesh((positions, triangles.clone()));
        for quality in QUALITIES {
            let options = to_triangles(quality, triangles.len());
            assert_same(&run_in_every_tier(&input, &options).0, &input);
        }
    }
}

/// fast-simplification: vertices without faces do not count, wherever they stand.
#[test]
fn isolated_vertices_change_nothing() {
    let (positions, triangles) = bumpy(12);
    let plain = mesh((positions.clone(), triangles.clone()));
    // In front, behind, and behind each third; one of them where no number is, one far away.
    let mut places = vec![Vec3::ONE, Vec3::NAN];
    let mut moved = Vec::new();
    for (v, &p) in positions.iter().enumerate() {
        moved.push(places.len() as u32);
        places.push(p);
        if v % 3 == 0 {
            places.push(p + Vec3::Z);
        }
    }
    places.extend([Vec3::splat(7.0), Vec3::INFINITY]);
    let isolated = places.len() - positions.len();
    let renamed = triangles.iter().map(|t| t.map(|v| moved[v as usize]));
    let strewn = mesh((places, renamed.collect()));
    for quality in QUALITIES {
        let options = to_triangles(quality, 60);
        let (small, report) = run_in_every_tier(&strewn, &options);
        assert_eq!(report.cleaning.dropped_isolated_vertices, isolated);
        assert_same(&small, &run(&plain, &options).0);
    }
}

/// fast-simplification: a plane of 20 × 20 squares with a border to preserve keeps its 80 points, and
/// comes down to the 100 triangles asked for without leaving the plane. (All 80 and no other would be
/// 78; that an order of collapses finds only by luck.)
#[test]
fn a_preserved_border_keeps_its_80_points() {
    let plane = mesh(shapes::grid(20, 20));
    let on_rim = |p: &&Vec3| [p.x, p.y].iter().any(|&c| c == 0.0 || c == 1.0);
    let rim: Vec<Vec3> = plane.positions().iter().filter(on_rim).copied().collect();
    assert_eq!(rim.len(), 80);
    for quality in QUALITIES {
        let options = Options {
            boundary: Boundary::Lock,
            ..to_triangles(quality, 100)
        };
        let (small, report) = run_in_every_tier(&plane, &options);
        let kept: BTreeSet<Bits> = bits(small.positions()).into_iter().collect();
        assert!(bits(&rim).iter().all(|p| kept.contains(p)), "{quality:?}");
        assert_eq!(report.triangles_out, 100, "{quality:?}");
        let (_, largest) = distances(&plane, &small);
        assert!(largest < ZERO, "{quality:?}: {largest}");
    }
}

/// A closed mesh of genus 0: two poles, and so many rings of vertices between them.
fn ball_of_rings(meridians: u32, rings: u32) -> Shape {
    let at = |around: f64, down: f64| {
        let (sin, cos) = (PI * down).sin_cos();
        let (y, x) = (TAU * around).sin_cos();
        DVec3::new(sin * x, sin * y, 1.3 * cos).as_vec3()
    };
    let mut positions = vec![at(0.0, 0.0)];
    for ring in 1..=rings {
        let down = f64::from(ring) / f64::from(rings + 1);
        positions.extend((0..meridians).map(|i| at(f64::from(i) / f64::from(meridians), down)));
    }
    positions.push(at(0.0, 1.0));
    let last = positions.len() as u32 - 1;
    let vertex = |i: u32, ring: u32| 1 + ring * meridians + i % meridians;
    let mut triangles = squares(meridians, rings - 1, vertex);
    // The squares run down; seen from outside that is clockwise.
    triangles.iter_mut().for_each(|t| t.swap(1, 2));
    for i in 0..meridians {
        triangles.push([0, vertex(i, 0), vertex(i + 1, 0)]);
        triangles.push([last, vertex(i + 1, rings - 1), vertex(i, rings - 1)]);
    }
    (positions, triangles)
}

/// OpenMesh: a closed mesh of 7526 vertices at 5000 has 14 994 edges and 9 996 faces.
#[test]
fn a_closed_mesh_has_the_edges_and_faces_of_its_5000_vertices() {
    let closed = mesh(ball_of_rings(99, 76));
    assert_eq!(closed.positions().len(), 7526);
    for quality in QUALITIES {
        let (small, _) = run_in_every_tier(&closed, &to_triangles(quality, 9996));
        let after = info(small.clone(), true).unwrap();
        assert_eq!(small.positions().len(), 5000, "{quality:?}");
        assert_eq!(edge_count(&after), 14_994, "{quality:?}");
        assert_eq!(small.triangles().len(), 9996, "{quality:?}");
        assert_eq!((after.boundary_edges, after.genus), (0, Some(0)));
        assert_eq!(after.inconsistent_edges, 0, "{quality:?}");
    }
}

/// CGAL: double coordinates far away give the result of the copy that lies near, translated: the
/// same triangles, where single precision alone would leave a few steps of a metre.
#[test]
fn far_doubles_give_the_translated_result() {
    // On a lattice of 2⁻¹², so that a translation by whole numbers is exact in doubles.
    let (mut positions, triangles) = bumpy(40);
    for p in &mut positions {
        *p = (*p * 4096.0).round() / 4096.0;
    }
    let far_away = DVec3::new(4_500_000.0, -5_400_000.0, 312.0);
    let moved_by = |offset: DVec3| {
        let mut builder = MeshBuilder::default();
        for p in &positions {
            builder.push_double((p.as_dvec3() + offset).to_array());
        }
        triangles.iter().for_each(|&t| builder.push_triangle(t));
        builder.finish().unwrap()
    };
    let (near, far) = (moved_by(DVec3::ZERO), moved_by(far_away));
    assert_ne!(far.origin(), DVec3::ZERO);
    for quality in QUALITIES {
        let (near_small, _) = run(&near, &onto_own_vertices(quality, 400));
        let (far_small, _) = run_in_every_tier(&far, &onto_own_vertices(quality, 400));
        assert!(
            near_small.triangles() == far_small.triangles(),
            "{quality:?}"
        );
        for (p, q) in near_small.points().zip(far_small.points()) {
            assert_eq!(p + far_away, q, "{quality:?}");
        }
        let options = to_triangles(quality, 400);
        let (expected, _) = distances(&near, &run(&near, &options).0);
        let (reached, _) = distances(&far, &run(&far, &options).0);
        let ratio = reached / expected;
        assert!((ratio - 1.0).abs() < 0.01, "{quality:?}: {ratio}");
    }
}

/// CGAL: edges without length, where welding is off, keep the genus: each fifth vertex of a torus lies
/// where its neighbour does.
#[test]
fn edges_without_length_keep_the_genus() {
    let (mut positions, triangles) = shapes::torus(20, 15);
    for v in (0..positions.len() - 1).step_by(5) {
        positions[v] = positions[v + 1];
    }
    let torus = mesh((positions, triangles));
    for quality in QUALITIES {
        for wanted in [300, 60, 0] {
            let options = Options {
                weld: false,
                check: true,
                ..to_triangles(quality, wanted)
            };
            let (small, report) = run_in_every_tier(&torus, &options);
            let after = info(small, false).unwrap();
            assert_eq!((after.genus, after.boundary_edges), (Some(1), 0));
            assert!(
                report.triangles_out <= wanted.max(40),
                "{quality:?}: {report:?}"
            );
        }
    }
}

/// CGAL: from spikes no vertex is flung away. Each stays in the input's box grown by 10 % of its
/// diagonal, whatever stands out, whole and in chunks, at every step down to the last face; and some
/// go halfway to there, so that it is not the shapes that hold them. (Without that bound, placements
/// went 58 % out.)
#[test]
fn spikes_fling_no_vertex_away() {
    let mut farthest = [0.0f64; 3];
    for seed in 1..=3 {
        for (name, shape) in spiky_shapes(seed) {
            let spiky = mesh(shape);
            for (quality, farthest) in QUALITIES.into_iter().zip(&mut farthest) {
                let mut wanted = spiky.triangles().len();
                while wanted > 1 {
                    wanted /= 2;
                    let options = to_triangles(quality, wanted);
                    for options in [in_chunks(40, options.clone()), options] {
                        let outside = outside_of_diagonal(&spiky, &run(&spiky, &options).0);
                        let chunks = options.chunks;
                        assert!(
                            outside <= 0.1 + 1e-6,
                            "{quality:?}, {chunks:?}, {name} of seed {seed} to {wanted}: {outside}"
                        );
                        *farthest = farthest.max(outside);
                    }
                }
            }
        }
    }
    assert!(farthest.iter().all(|&f| f > 0.05), "{farthest:?}");
}

/// Where the room ends does not depend on the unit of length: spikes scaled by 2^k give the same
/// triangles.
#[test]
fn scaled_spikes_give_the_same_triangles() {
    for (name, (positions, triangles)) in spiky_shapes(4) {
        let spiky = mesh((positions.clone(), triangles.clone()));
        for quality in QUALITIES {
            for wanted in [triangles.len() / 4, 8] {
                let options = to_triangles(quality, wanted);
                let (small, _) = run(&spiky, &options);
                for power in [40, -70] {
                    let factor = 2f32.powi(power);
                    let scaled: Vec<Vec3> = positions.iter().map(|&p| p * factor).collect();
                    let (scaled, _) = run(&mesh((scaled, triangles.clone())), &options);
                    let expected: Vec<Vec3> =
                        small.positions().iter().map(|&p| p * factor).collect();
                    let is_same =
                        scaled.triangles() == small.triangles() && scaled.positions() == expected;
                    assert!(is_same, "{quality:?}, {name} to {wanted}, 2^{power}");
                }
            }
        }
    }
}

/// Surfaces on which the planes around an edge may meet far away.
fn spiky_shapes(seed: u64) -> Vec<(String, Shape)> {
    // Marsaglia's xorshift, from 0 to 1.
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15);
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    let mut shapes = Vec::new();
    for length in [1.5, 3.0, 10.0] {
        let (mut positions, triangles) = shapes::icosphere(2);
        for p in &mut positions {
            *p *= match random() {
                x if x < 0.15 => length,
                x if x < 0.3 => 0.2,
                _ => 1.0,
            };
        }
        shapes.push((format!("ball × {length}"), (positions, triangles)));
    }
    for height in [1.0, 4.0, 20.0] {
        let (mut positions, triangles) = shapes::grid(14, 14);
        for p in &mut positions {
            let is_spike = random() < 0.2;
            p.z = if is_spike { height } else { 1e-4 * random() };
        }
        shapes.push((format!("sheet × {height}"), (positions, triangles)));
    }
    let (mut positions, triangles) = shapes::icosphere(2);
    for p in &mut positions {
        *p = Vec3::new(50.0 * p.x, p.y, p.z) * (0.5 + random());
    }
    shapes.push(("needle".into(), (positions, triangles)));
    // Slivers around a middle, every other of their ends far away.
    let ends = 100u32;
    let mut positions = vec![Vec3::ZERO];
    for i in 0..ends {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(ends)).sin_cos();
        let length = if i % 2 == 0 { 20.0 } else { random() };
        positions.push(DVec3::new(cos, sin, 0.0).as_vec3() * length + random() * Vec3::Z);
    }
    let slivers = (0..ends).map(|i| [0, 1 + i, 1 + (i + 1) % ends]);
    shapes.push(("star".into(), (positions, slivers.collect())));
    // Triangles between any vertices.
    let vertices = 30;
    let positions = (0..vertices).map(|_| Vec3::new(random(), random(), random()));
    let positions = positions.collect();
    let mut vertex = || (random() * vertices as f32) as u32;
    let any = (0..3 * vertices).map(|_| [vertex(), vertex(), vertex()]);
    let proper = any.filter(|[a, b, c]| a != b && b != c && c != a);
    shapes.push(("complex".into(), (positions, proper.collect())));
    shapes
}

/// How far the farthest vertex of a result lies outside of the box of an original, of its diagonal.
fn outside_of_diagonal(original: &IndexedMesh, small: &IndexedMesh) -> f64 {
    // Vertices without faces have no say.
    let used = original.triangles().as_flattened().iter();
    let used = used.map(|&v| original.positions()[v as usize].as_dvec3());
    let (min, max) = used.fold((DVec3::MAX, DVec3::MIN), |(min, max), p| {
        (min.min(p), max.max(p))
    });
    let outside = small.positions().iter().map(|p| {
        let p = p.as_dvec3();
        (min - p).max(p - max).max_element()
    });
    outside.fold(0.0, f64::max) / (max - min).length()
}
