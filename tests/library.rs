//! The library as another program meets it: what it may send between threads, stop and get wrong.

use std::ops::ControlFlow;

use decimate::clean::{Cleaning, clean};
use decimate::decimate::{
    Boundary, Chunks, Options, Placement, Progress, Quality, Report, StopReason, Targets,
    TierChoice, Topology, decimate, decimate_with_progress,
};
use decimate::error::{Error, Place};
use decimate::indexed_mesh::{IndexedMesh, MeshBuilder, Parts, PolygonMesh};
use decimate::io::{self, Format, ReadOptions, WriteOptions};
use decimate::mesh::{
    Collapse, EdgeId, EdgeStore, FaceId, Full, Medium, Mesh, Small, Tier, VertexId,
};
use decimate::metrics::{CompareOptions, Comparison, Info, Reference, info};
use decimate::nearest::{Nearest, Triangles};
use decimate::repair::CutReport;
use decimate::spatial::Grid;
use decimate::structures::{Measured, measure, measure_quads};
use glam::{DVec3, Vec3};

/// A bumpy torus of `n` × `n` cells, closed: 2n² triangles, Euler characteristic 0.
fn torus(n: u32) -> IndexedMesh {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    let turn = |i: u32| i as f32 / n as f32 * std::f32::consts::TAU;
    for j in 0..n {
        for i in 0..n {
            let (u, v) = (turn(i), turn(j));
            let r = 1.0 + 0.1 * (5.0 * u + 3.0 * v).sin();
            let away = 3.0 + r * v.cos();
            positions.push(Vec3::new(away * u.cos(), away * u.sin(), r * v.sin()));
            let (right, above) = ((i + 1) % n, (j + 1) % n);
            let [a, b, c, d] = [j * n + i, j * n + right, above * n + right, above * n + i];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    IndexedMesh::new(positions, triangles).unwrap()
}

/// Meshes, reports and errors go from the thread that makes them to the one that needs them.
#[test]
fn what_is_public_may_be_sent_and_shared() {
    fn holds<T: Send + Sync + 'static>() {}
    holds::<Error>();
    holds::<Place>();
    holds::<IndexedMesh>();
    holds::<Parts>();
    holds::<PolygonMesh>();
    holds::<MeshBuilder>();
    holds::<Cleaning>();
    holds::<Options>();
    holds::<Report>();
    holds::<Progress>();
    holds::<ReadOptions>();
    holds::<WriteOptions>();
    holds::<Format>();
    holds::<Mesh<Full>>();
    holds::<Mesh<Medium>>();
    holds::<Mesh<Small>>();
    holds::<Collapse>();
    holds::<(VertexId, EdgeId, FaceId)>();
    holds::<Info>();
    holds::<Reference>();
    holds::<Comparison>();
    holds::<CutReport>();
    holds::<Triangles>();
    holds::<Nearest>();
    holds::<Grid>();
    holds::<Measured>();
}

/// The mesh is closed, a torus still, and every table of its connectivity is as a rebuild has it.
fn assert_is_torus(mesh: &IndexedMesh, what: &str) {
    let found = info(mesh.clone(), false).unwrap();
    assert_eq!(found.triangles, found.cleaning.kept_faces, "{what}");
    assert_eq!(found.cleaning.dropped_isolated_vertices, 0, "{what}");
    assert!(found.is_manifold() && found.is_orientable, "{what}");
    let (n, loops) = (found.components, found.boundary_edges);
    assert_eq!((n, loops, found.euler_characteristic), (1, 0, 0), "{what}");
    let rebuilt = Mesh::<Small>::from_triangles(mesh.positions().len(), mesh.triangles());
    rebuilt
        .check()
        .unwrap_or_else(|wrong| panic!("{what}: {wrong}"));
}

/// Whichever call is the one that breaks, in chunks or behind them or without, for every quality and
/// tier: no further call comes, the reason is given, and the mesh is whole.
#[test]
fn cancelling_at_any_call_gives_a_whole_mesh() {
    let original = torus(60);
    let mut stages = Vec::new();
    for quality in [Quality::Fast, Quality::Standard, Quality::Best] {
        for (chunks, tier) in [
            (Chunks::Off, Tier::Full),
            (Chunks::Triangles(800), Tier::Medium),
            (Chunks::Triangles(800), Tier::Small),
        ] {
            let options = Options {
                targets: Targets {
                    triangles: Some(400),
                    ..Targets::default()
                },
                quality,
                chunks,
                tier: TierChoice::Fixed(tier),
                ..Options::default()
            };
            for last in 1.. {
                let what = format!("{quality:?} {chunks:?} {tier:?}, call {last}");
                let mut calls = 0;
                let mut left = original.triangle_count();
                let mut on = |progress: Progress| {
                    calls += 1;
                    assert_eq!(progress.triangles_start, 7200);
                    assert_eq!(progress.triangles_target, 400);
                    assert!(progress.triangles <= left, "{what}: more than before");
                    left = progress.triangles;
                    if calls == last {
                        ControlFlow::Break(())
                    } else {
                        ControlFlow::Continue(())
                    }
                };
                let (mesh, report) =
                    decimate_with_progress(original.clone(), &options, &mut on).unwrap();
                assert_is_torus(&mesh, &what);
                assert_eq!(mesh.triangle_count(), report.triangles_out, "{what}");
                if calls < last {
                    assert_eq!(report.stop_reason, StopReason::Target, "{what}");
                    break;
                }
                assert_eq!(calls, last, "{what}: called again after it broke");
                assert_eq!(report.stop_reason, StopReason::Cancelled, "{what}");
                assert!(report.stopped_short && report.blocked.is_none(), "{what}");
                assert!(report.triangles_out > 400, "{what}");
                let is_before_the_whole = report.collapses_in_chunks == report.tally.collapses;
                stages.push((chunks == Chunks::Off, is_before_the_whole));
            }
        }
    }
    for stage in [(true, false), (false, true)] {
        assert!(
            stages.contains(&stage),
            "nothing was cancelled in {stage:?}: {stages:?}"
        );
    }
}

/// Whatever the numbers in the options are: a mesh, or an error that says which is wrong.
#[test]
fn extreme_options_are_kept_or_refused() {
    let original = torus(12);
    let numbers = [
        0.0,
        -0.0,
        1e-320,
        0.5,
        1.0,
        2.0,
        -1.0,
        f64::MAX,
        f64::INFINITY,
        f64::NAN,
    ];
    let run = |options: Options| match decimate(original.clone(), &options) {
        Ok((mesh, _)) => assert_is_torus(&mesh, &format!("{options:?}")),
        Err(Error::InvalidOptions(_) | Error::Memory { .. }) => {}
        Err(error) => panic!("{options:?}: {error}"),
    };
    let half = Targets {
        ratio: Some(0.5),
        ..Targets::default()
    };
    for x in numbers {
        for targets in [
            Targets {
                ratio: Some(x),
                ..Targets::default()
            },
            Targets {
                max_error: Some(x),
                ..Targets::default()
            },
        ] {
            run(Options {
                targets,
                ..Options::default()
            });
        }
        run(Options {
            targets: half,
            feature_angle_degrees: Some(x),
            boundary: Boundary::Lock,
            placement: Placement::Endpoint,
            ..Options::default()
        });
    }
    for n in [0, 1, 2, 3, usize::MAX - 1, usize::MAX] {
        for quality in [Quality::Fast, Quality::Standard, Quality::Best] {
            run(Options {
                targets: Targets {
                    triangles: Some(n),
                    ..Targets::default()
                },
                quality,
                ..Options::default()
            });
            run(Options {
                targets: half,
                chunks: Chunks::Triangles(n),
                quality,
                check: true,
                ..Options::default()
            });
        }
        run(Options {
            targets: half,
            memory_limit_bytes: Some(n as u64),
            topology: Topology::Preserve,
            ..Options::default()
        });
    }
}

/// Coordinates at the ends of their range, in whatever is public and takes them.
#[test]
fn extreme_coordinates_are_measured_or_refused() {
    let (positions, triangles) = {
        let parts = torus(6).into_parts();
        (parts.positions, parts.triangles)
    };
    let with = |origin: f64, times: f32| {
        let positions = positions.iter().map(|&p| p * times).collect();
        IndexedMesh::with_origin(DVec3::splat(origin), positions, triangles.clone()).unwrap()
    };
    let mut meshes = Vec::new();
    for times in [1.0, 0.0, 1e-44, 1e-30, 1e30, 1e38, f32::NAN] {
        for origin in [0.0, -1e30, 1.7e308, -1.7e308] {
            meshes.push(with(origin, times));
        }
    }
    let options = CompareOptions {
        samples: 10,
        intersections: true,
    };
    // Repeats until a clock has moved, so not for every mesh.
    for a in meshes.iter().step_by(16) {
        measure(a.clone()).unwrap();
    }
    let (mut measured, mut refused) = (0, 0);
    for a in &meshes {
        info(a.clone(), true).unwrap();
        info(a.clone(), false).unwrap();
        decimate::repair::cut(a.clone(), true).unwrap();
        Grid::over(a.positions(), 0.0).order(a.positions());
        let Ok(reference) = Reference::new(a.clone()) else {
            continue;
        };
        for b in &meshes {
            match reference.compare(b.clone(), &options) {
                Ok(_) => measured += 1,
                Err(error) => {
                    assert!(matches!(error, Error::InvalidMesh(_)), "{error}");
                    refused += 1;
                }
            }
        }
    }
    assert!(measured > 100 && refused > 100, "{measured} {refused}");
}

/// No samples, and faces that name what is not there.
#[test]
fn what_cannot_be_measured_is_said() {
    let none = CompareOptions {
        samples: 0,
        intersections: false,
    };
    let reference = Reference::new(torus(6)).unwrap();
    let of_vertices = reference.compare(torus(6), &none).unwrap();
    assert!(of_vertices.surface.two_sided.max < 1e-6);
    for quads in [[[0, 1, 2, 3]], [[0, 1, 2, u32::MAX]]] {
        let error = measure_quads(&[Vec3::ZERO; 3], &quads).unwrap_err();
        assert!(matches!(error, Error::InvalidMesh(_)), "{error}");
    }
    assert!(measure_quads(&[], &[]).is_ok());
    assert!(measure(IndexedMesh::default()).is_ok());
}

/// A point that is nowhere has no nearest one; a guess that names nothing is none.
#[test]
fn the_nearest_to_nowhere_is_nothing() {
    let mesh = torus(6);
    let corner = |v: u32| mesh.positions()[v as usize].as_dvec3();
    let set = Triangles::new(mesh.triangles().iter().map(|t| t.map(corner)).collect());
    for x in [f64::NAN, f64::INFINITY, -1e300] {
        assert!(set.nearest(DVec3::splat(x)).is_none(), "{x}");
    }
    let there = set.nearest(DVec3::ONE).unwrap();
    let guessed = set.nearest_from(DVec3::ONE, Some(u32::MAX)).unwrap();
    assert_eq!(there.triangle, guessed.triangle);
    assert!(Triangles::new(Vec::new()).nearest(DVec3::ONE).is_none());
}

/// Every tier says what cannot be built, since it is never handed on: an index that is not there is
/// an error where the mesh is made.
#[test]
fn indices_are_checked_where_a_mesh_is_made() {
    fn closes<S: EdgeStore>(mesh: &IndexedMesh) {
        let built = Mesh::<S>::from_triangles(mesh.positions().len(), mesh.triangles());
        assert!(built.edges().all(|e| !built.is_boundary(e)));
    }
    closes::<Full>(&torus(5));
    closes::<Medium>(&torus(5));
    closes::<Small>(&torus(5));
    for triangle in [[0, 1, 3], [u32::MAX, 0, 1], [3, 3, 3]] {
        let error = IndexedMesh::new(vec![Vec3::ZERO; 3], vec![triangle]).unwrap_err();
        assert!(error.to_string().contains("the mesh has 3"), "{error}");
        let mut builder = MeshBuilder::of_polygons();
        builder.push_polygon(&triangle);
        assert!(builder.finish_polygons().is_err());
    }
    let empty = clean(IndexedMesh::default(), true).unwrap().0;
    assert!(empty.triangles().is_empty());
}

/// A program that is interrupted leaves what was there, and a write that goes on regardless fails.
/// No other test here writes files: these would be abandoned as well.
#[test]
fn what_is_abandoned_is_gone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    std::fs::write(&path, "old").unwrap();
    let written = io::write_file(&path, |writer| {
        drop(io::abandon_unfinished());
        writer.write_all(b"new")
    });
    assert!(matches!(written, Err(Error::Io { .. })));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    io::write_file(&path, |writer| writer.write_all(b"new")).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "new");
}
