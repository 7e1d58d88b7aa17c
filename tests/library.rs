//! The library as another program meets it: what it may send between threads, stop and get wrong.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use decimate::clean::{Cleaning, clean};
use decimate::decimate::{
    Boundary, Chunks, Options, Placement, Quality, Report, StopReason, Targets, TierChoice,
    Topology, decimate, decimate_with_progress,
};
use decimate::error::{Error, Place};
use decimate::indexed_mesh::{IndexedMesh, MeshBuilder, Parts, PolygonMesh};
use decimate::io::{self, Format, ReadOptions, WriteOptions};
use decimate::mesh::{
    Collapse, EdgeId, EdgeStore, FaceId, Full, Medium, Mesh, Small, Tier, VertexId,
};
use decimate::metrics::{CompareOptions, Comparison, Info, Reference, info};
use decimate::nearest::{Nearest, Triangles};
use decimate::progress::{Progress, Stage};
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
    holds::<(Progress, Stage)>();
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

/// What is told of a run, up to and with the call that cancels it, if one does.
fn told(
    mesh: &IndexedMesh,
    options: &Options,
    last: Option<usize>,
) -> (Vec<Progress>, Result<(IndexedMesh, Report), Error>) {
    let mut calls = Vec::new();
    let caller = std::thread::current().id();
    let mut follow = |progress: Progress| {
        assert_eq!(std::thread::current().id(), caller);
        calls.push(progress);
        if Some(calls.len()) == last {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let result = decimate_with_progress(mesh.clone(), options, &mut follow);
    (calls, result)
}

/// Asks that a run is told of evenly, and returns its stages, each once where it follows itself.
fn stages_of(calls: &[Progress], what: &str) -> Vec<Stage> {
    let fractions: Vec<f64> = calls.iter().map(|p| p.fraction).collect();
    assert!(fractions.is_sorted(), "{what}: {fractions:?}");
    assert!(fractions[0] >= 0.0, "{what}");
    let (last, before) = fractions.split_last().unwrap();
    assert!(*last == 1.0 && before.iter().all(|&f| f < 1.0), "{what}");
    let mut stages: Vec<Stage> = calls.iter().map(|p| p.stage).collect();
    stages.dedup();
    stages
}

/// In every quality and tier, in chunks and without: the stages come in order, none is silent for
/// long, and whichever call cancels is the last of the same calls. The bytes are as without.
#[test]
fn every_stage_tells_how_far_it_is_and_can_be_cancelled() {
    use Stage::{Assemble, Build, Chunks as InChunks, Clean, Collapse, Fit};
    let original = torus(100);
    for quality in [Quality::Fast, Quality::Standard, Quality::Best] {
        for (chunks, tier) in [
            (Chunks::Off, Tier::Full),
            (Chunks::Triangles(1500), Tier::Small),
        ] {
            let what = format!("{quality:?} {chunks:?} {tier:?}");
            let options = Options {
                targets: Targets {
                    triangles: Some(1000),
                    ..Targets::default()
                },
                quality,
                chunks,
                tier: TierChoice::Fixed(tier),
                ..Options::default()
            };
            let (calls, result) = told(&original, &options, None);
            let (mesh, report) = result.unwrap();
            let (unheard, _) = decimate(original.clone(), &options).unwrap();
            assert!(mesh == unheard, "{what}");
            assert_is_torus(&mesh, &what);
            assert_eq!(report.stop_reason, StopReason::Target, "{what}");

            let mut expected = vec![Clean, InChunks, Build, Collapse, Fit, Assemble];
            expected.retain(|&stage| match stage {
                InChunks => chunks != Chunks::Off,
                Fit => quality == Quality::Best,
                _ => true,
            });
            assert_eq!(stages_of(&calls, &what), expected);
            // A call every 65 536 units: 20 000 triangles take 20 units each at least.
            assert!(calls.len() > expected.len() + 5, "{what}: {calls:?}");
            let jumps = calls
                .windows(2)
                .map(|pair| pair[1].fraction - pair[0].fraction);
            let largest = jumps.fold(0.0, f64::max);
            assert!(largest < 0.35, "{what}: {largest}, {calls:?}");

            for last in 1..=calls.len() {
                let (up_to_there, result) = told(&original, &options, Some(last));
                assert_eq!(up_to_there, calls[..last], "{what}, call {last}");
                let is_cancelled = matches!(result, Err(Error::Cancelled));
                assert!(is_cancelled, "{what}, call {last}: {result:?}");
            }
        }
    }
}

/// The detours are told of as well, and end as they do unheard: faces that disagree, creases, a locked
/// boundary, a soup that is welded, a largest error, topology that may change, a check at every
/// collapse, nothing left to collapse.
#[test]
fn detours_are_told_of_and_can_be_cancelled() {
    let original = torus(40);
    let ratio = |ratio| Targets {
        ratio: Some(ratio),
        ..Targets::default()
    };
    let in_chunks = Options {
        targets: ratio(0.1),
        chunks: Chunks::Triangles(400),
        ..Options::default()
    };
    let with = |change: fn(&mut Options)| {
        let mut options = in_chunks.clone();
        change(&mut options);
        options
    };
    let mut disagreeing = original.clone().into_parts();
    disagreeing.triangles[1000..1400]
        .iter_mut()
        .for_each(|t| t.swap(1, 2));
    let disagreeing = IndexedMesh::new(disagreeing.positions, disagreeing.triangles).unwrap();
    let corners = original.triangles().as_flattened().iter();
    let positions = corners.map(|&v| original.positions()[v as usize]).collect();
    let soup = (0..original.triangles().len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    let soup = IndexedMesh::new(positions, soup.collect()).unwrap();
    let cases = [
        ("disagreeing", &disagreeing, in_chunks.clone()),
        ("soup", &soup, in_chunks.clone()),
        (
            "creases",
            &original,
            with(|o| o.feature_angle_degrees = Some(20.0)),
        ),
        ("locked", &original, with(|o| o.boundary = Boundary::Lock)),
        (
            "simplified",
            &original,
            with(|o| o.topology = Topology::Simplify),
        ),
        ("checked", &original, with(|o| o.check = true)),
        (
            "largest error",
            &original,
            with(|o| {
                o.quality = Quality::Best;
                o.targets = Targets {
                    max_error: Some(0.05),
                    ..Targets::default()
                };
            }),
        ),
        (
            "blocked",
            &original,
            with(|o| {
                o.chunks = Chunks::Off;
                o.targets.triangles = Some(0);
                o.targets.ratio = None;
            }),
        ),
    ];
    for (what, mesh, options) in cases {
        let (calls, result) = told(mesh, &options, None);
        let (unheard, _) = decimate(mesh.clone(), &options).unwrap();
        assert!(result.unwrap().0 == unheard, "{what}");
        let stages = stages_of(&calls, what);
        let builds = stages.iter().filter(|&&s| s == Stage::Build).count();
        let is_built_before = ["disagreeing", "creases", "locked"].contains(&what);
        assert_eq!(
            builds,
            1 + usize::from(is_built_before),
            "{what}: {stages:?}"
        );
        let most = if what == "checked" { 20 } else { calls.len() };
        for last in 1..=most {
            let (up_to_there, result) = told(mesh, &options, Some(last));
            assert_eq!(up_to_there, calls[..last], "{what}, call {last}");
            let is_cancelled = matches!(result, Err(Error::Cancelled));
            assert!(is_cancelled, "{what}, call {last}: {result:?}");
        }
    }
}

/// On a mesh of a million triangles and one thread a call comes every 0.1 s, whatever is done. Asks a
/// clock, so only when it is asked for, on a machine that does nothing else:
///
///     cargo test --release --test library -- --ignored --nocapture every_tenth
#[test]
#[ignore = "asks a clock"]
fn a_call_comes_every_tenth_of_a_second() {
    let original = torus(710);
    let mut longest_of_all = Duration::ZERO;
    for quality in [Quality::Fast, Quality::Standard, Quality::Best] {
        for chunks in [Chunks::Auto, Chunks::Off] {
            for ratio in [0.001, 0.1, 0.9] {
                let options = Options {
                    targets: Targets {
                        ratio: Some(ratio),
                        ..Targets::default()
                    },
                    quality,
                    chunks,
                    ..Options::default()
                };
                let mesh = original.clone();
                let run = || {
                    let start = Instant::now();
                    let (mut last, mut longest) = (start, (Duration::ZERO, Stage::Clean, 0.0));
                    let mut calls = 0;
                    let mut stage_before = Stage::Clean;
                    let mut follow = |progress: Progress| {
                        calls += 1;
                        let now = Instant::now();
                        if now - last > longest.0 {
                            longest = (now - last, stage_before, progress.fraction);
                        }
                        (last, stage_before) = (now, progress.stage);
                        ControlFlow::Continue(())
                    };
                    decimate_with_progress(mesh, &options, &mut follow).unwrap();
                    (calls, longest, start.elapsed())
                };
                let pool = rayon::ThreadPoolBuilder::new().num_threads(1);
                let (calls, longest, all) = pool.build().unwrap().install(run);
                println!("{quality:?} {chunks:?} {ratio}: {calls} calls in {all:?}, {longest:?}");
                longest_of_all = longest_of_all.max(longest.0);
            }
        }
    }
    assert!(
        longest_of_all < Duration::from_millis(100),
        "{longest_of_all:?}"
    );
}

/// Cancelled before anything is done, even with a mesh that would be refused; options are looked at
/// first.
#[test]
fn what_is_wrong_with_options_is_said_before_the_first_call() {
    let empty = IndexedMesh::default();
    let half = Options {
        targets: Targets {
            ratio: Some(0.5),
            ..Targets::default()
        },
        ..Options::default()
    };
    let (calls, result) = told(&empty, &half, Some(1));
    assert!(matches!(result, Err(Error::Cancelled)) && calls.len() == 1);
    assert!(calls[0].stage == Stage::Clean && calls[0].fraction == 0.0);
    let options = Options {
        targets: Targets {
            ratio: Some(-1.0),
            ..Targets::default()
        },
        ..Options::default()
    };
    let (calls, result) = told(&empty, &options, Some(1));
    assert!(matches!(result, Err(Error::InvalidOptions(_))) && calls.is_empty());
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
