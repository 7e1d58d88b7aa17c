//! What decimation promises, on meshes that others made: `MESHES=folder cargo test --test meshes`,
//! where the folder has `meshes/` and `malformed/`. Without `MESHES` these tests say so and pass.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use decimate::clean::clean;
use decimate::decimate::{Options, Report, StopReason, Targets, TierChoice, decimate};
use decimate::indexed_mesh::IndexedMesh;
use decimate::io::{self, ReadOptions, WriteOptions};
use decimate::mesh::{EdgeId, EdgeStore, Full, Medium, Mesh, Small, Tier, VertexSplit};
use decimate::metrics::{Info, info, info_of_file};
use decimate::repair::cut;
use glam::Vec3;
use rayon::prelude::*;

/// The fractions to keep.
const RATIOS: [f64; 3] = [0.5, 0.1, 0.02];
/// Above this many triangles one ratio is enough: the million alone would take a minute.
const LARGE: usize = 500_000;
/// Below this many triangles a run verifies every invariant after every collapse, which is
/// quadratic.
const CHECKED: usize = 10_000;
/// No vertex leaves the input's box by more than this.
const OUTSIDE_OF_DIAGONAL: f64 = 0.1;

/// The files of a folder within `MESHES`, the largest first so that the cores finish together.
fn files(name: &str) -> Option<Vec<PathBuf>> {
    let Some(meshes) = std::env::var_os("MESHES") else {
        eprintln!("skipped: MESHES names no folder with {name}/");
        return None;
    };
    let folder = Path::new(&meshes).join(name);
    let entries = folder
        .read_dir()
        .unwrap_or_else(|error| panic!("MESHES: {}: {error}", folder.display()));
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    assert!(!files.is_empty(), "{} is empty", folder.display());
    files.sort_by_key(|file| std::cmp::Reverse(file.metadata().unwrap().len()));
    Some(files)
}

#[test]
fn decimation_keeps_its_promises_on_every_mesh() {
    let Some(files) = files("meshes") else {
        return;
    };
    let is_ours = |file: &&PathBuf| file.extension().is_some_and(|e| e != "glb");
    let files: Vec<&PathBuf> = files.iter().filter(is_ours).collect();
    // Threads of their own, or the other tests here would wait for the longest mesh.
    let pool = rayon::ThreadPoolBuilder::new().build().unwrap();
    let broken: Vec<String> = pool.install(|| {
        let files = files.par_iter().with_max_len(1);
        files.flat_map_iter(|file| broken_promises(file)).collect()
    });
    assert!(broken.is_empty(), "\n{}", broken.join("\n"));
}

/// Every promise that does not hold for a file, at any ratio or in any tier.
fn broken_promises(file: &Path) -> Vec<String> {
    let name = file.file_name().unwrap().display();
    let input = io::read(file, &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let before = info(input.clone(), true).unwrap();
    let ratios = if input.triangle_count() > LARGE {
        &RATIOS[..1]
    } else {
        &RATIOS[..]
    };
    let mut broken = Vec::new();
    for &ratio in ratios {
        // Fewer triangles begin with the same collapses: checking the last ratio checks all.
        let check = input.triangle_count() < CHECKED && ratio == RATIOS[2];
        let (output, report) = run(&input, ratio, Tier::Small, check);
        let mut say = |what: String| broken.push(format!("{name} at {ratio}: {what}"));
        compare(&input, &before, &output, &report, &mut say);
        for tier in [Tier::Medium, Tier::Full] {
            if !is_same(&run(&input, ratio, tier, false).0, &output) {
                say(format!("the {} tier gives another mesh", tier.name()));
            }
        }
    }
    broken
}

fn run(input: &IndexedMesh, ratio: f64, tier: Tier, check: bool) -> (IndexedMesh, Report) {
    let options = Options {
        targets: Targets {
            ratio: Some(ratio),
            ..Targets::default()
        },
        tier: TierChoice::Fixed(tier),
        check,
        ..Options::default()
    };
    decimate(input.clone(), &options).unwrap_or_else(|error| panic!("{error}"))
}

/// Whether two meshes are equal to the bit, −0 apart from 0.
fn is_same(a: &IndexedMesh, b: &IndexedMesh) -> bool {
    let bits = |m: &IndexedMesh| -> Vec<[u32; 3]> {
        let all = m.positions().iter();
        all.map(|p| p.to_array().map(f32::to_bits)).collect()
    };
    a == b && bits(a) == bits(b)
}

/// Says what is promised and does not hold between an input and its output.
fn compare(
    input: &IndexedMesh,
    before: &Info,
    output: &IndexedMesh,
    report: &Report,
    say: &mut dyn FnMut(String),
) {
    let after = info(output.clone(), true).unwrap();
    let mut equal = |what: &str, before: i64, after: i64| {
        if before != after {
            say(format!("{what} went from {before} to {after}"));
        }
    };
    equal(
        "the report's triangles_out",
        report.triangles_out as i64,
        output.triangle_count() as i64,
    );
    equal(
        "components",
        before.components as i64,
        after.components as i64,
    );
    equal(
        "the Euler characteristic",
        before.euler_characteristic,
        after.euler_characteristic,
    );
    equal(
        "orientable",
        i64::from(before.is_orientable),
        i64::from(after.is_orientable),
    );
    let is_manifold = before.non_manifold_edges == 0 && before.non_manifold_vertices == 0;
    if is_manifold && before.inconsistent_edges == 0 {
        equal(
            "boundary loops",
            before.boundary_loops as i64,
            after.boundary_loops as i64,
        );
        equal(
            "the genus",
            before.genus.unwrap_or(-1),
            after.genus.unwrap_or(-1),
        );
        equal("inconsistent edges", 0, after.inconsistent_edges as i64);
    }
    for (what, before, after) in [
        (
            "non-manifold edges",
            before.non_manifold_edges,
            after.non_manifold_edges,
        ),
        (
            "non-manifold vertices",
            before.non_manifold_vertices,
            after.non_manifold_vertices,
        ),
        (
            "boundary edges",
            before.boundary_edges,
            after.boundary_edges,
        ),
    ] {
        if after > before {
            say(format!("{what} grew from {before} to {after}"));
        }
    }
    reaches_its_target(input, output, report, is_manifold, say);
    is_a_complex(output, say);
    stays_in_the_box(input, output, say);
}

/// At the target, or below by what one collapse took more; above only where it says why.
fn reaches_its_target(
    input: &IndexedMesh,
    output: &IndexedMesh,
    report: &Report,
    is_manifold: bool,
    say: &mut dyn FnMut(String),
) {
    // A collapse takes the faces at its edge, each side of a double-sided one counted.
    let most = if is_manifold {
        2
    } else {
        most_faces_at_an_edge(input).max(most_faces_at_an_edge(output))
    };
    let (out, target) = (report.triangles_out, report.target_triangles);
    if out + most <= target {
        say(format!(
            "{out} triangles are far below the {target} asked for"
        ));
    }
    let is_short = out > target;
    if is_short != (report.stop_reason != StopReason::Target)
        || is_short != report.stopped_short
        || is_short != report.blocked.is_some()
    {
        say(format!(
            "{out} triangles of {target} asked for, stopped by {:?}, short {}, blocked {:?}",
            report.stop_reason, report.stopped_short, report.blocked
        ));
    }
}

fn most_faces_at_an_edge(mesh: &IndexedMesh) -> usize {
    let mut faces: HashMap<[u32; 2], usize> = HashMap::new();
    for [a, b, c] in mesh.sides() {
        for [v, w] in [[a, b], [b, c], [c, a]] {
            *faces.entry([v.min(w), v.max(w)]).or_default() += 1;
        }
    }
    faces.into_values().max().unwrap_or(0)
}

/// No face with a repeated vertex, none twice, no vertex without a face.
fn is_a_complex(mesh: &IndexedMesh, say: &mut dyn FnMut(String)) {
    let mut faces: Vec<[u32; 3]> = mesh.triangles().to_vec();
    let mut used = vec![false; mesh.positions().len()];
    for face in &mut faces {
        face.iter().for_each(|&v| used[v as usize] = true);
        face.sort_unstable();
        if face[0] == face[1] || face[1] == face[2] {
            say(format!("face {face:?} has a vertex twice"));
        }
    }
    faces.sort_unstable();
    for same in faces.windows(2).filter(|pair| pair[0] == pair[1]) {
        say(format!("face {:?} is there twice", same[0]));
    }
    if let Some(v) = used.iter().position(|used| !used) {
        say(format!("vertex {v} has no face"));
    }
}

fn stays_in_the_box(input: &IndexedMesh, output: &IndexedMesh, say: &mut dyn FnMut(String)) {
    let (min, max) = input.bounds().unwrap();
    let room = (input.diagonal() * OUTSIDE_OF_DIAGONAL) as f32;
    for p in output.positions() {
        if !p.is_finite() || p.cmplt(min - room).any() || p.cmpgt(max + room).any() {
            say(format!("a vertex at {p} is outside of {min} to {max}"));
        }
    }
}

/// A collapse that can be undone: the split, and where both vertices were.
struct Undo {
    split: VertexSplit,
    positions: [Vec3; 2],
}

/// Collapses the shortest edges onto their middles, down to so many triangles.
fn collapse_shortest<S: EdgeStore>(
    mesh: &mut Mesh<S>,
    positions: &mut [Vec3],
    triangles: usize,
) -> Vec<Undo> {
    let length = |mesh: &Mesh<S>, positions: &[Vec3], e: EdgeId| {
        let [a, b] = mesh.edge_vertices(e).map(|v| positions[v.index()]);
        a.distance_squared(b).to_bits()
    };
    let mut queue: BinaryHeap<Reverse<(u32, EdgeId)>> = mesh
        .edges()
        .map(|e| Reverse((length(mesh, positions, e), e)))
        .collect();
    let mut undo = Vec::new();
    while mesh.face_count() > triangles {
        let Some(Reverse((cost, e))) = queue.pop() else {
            break;
        };
        let is_current = mesh.is_live_face(e.face()) && length(mesh, positions, e) == cost;
        if !is_current || !mesh.link_condition(e) {
            continue;
        }
        let split = mesh.split_undoing(e);
        let ends = [split.kept, split.removed].map(|v| v.index());
        let middle = positions[ends[0]].midpoint(positions[ends[1]]);
        undo.push(Undo {
            positions: ends.map(|v| positions[v]),
            split,
        });
        let kept = mesh.collapse(e).kept;
        positions[kept.index()] = middle;
        for e in mesh.vertex_edges(kept) {
            queue.push(Reverse((length(mesh, positions, e), e)));
        }
    }
    undo
}

fn bunny_and_back<S: EdgeStore>(input: &IndexedMesh) -> usize {
    let mut mesh = Mesh::<S>::from_triangles(input.positions().len(), input.triangles());
    let mut positions = input.positions().to_vec();
    let undo = collapse_shortest(&mut mesh, &mut positions, 500);
    assert!(mesh.face_count() <= 500, "{} faces", mesh.face_count());
    mesh.check().unwrap();
    assert_ne!(positions, input.positions());
    let collapses = undo.len();
    for Undo {
        split,
        positions: [kept, removed],
    } in undo.into_iter().rev()
    {
        mesh.split_vertex(&split);
        positions[split.kept.index()] = kept;
        positions[split.removed.index()] = removed;
    }
    mesh.check().unwrap();
    assert_eq!(mesh.triangles(), input.triangles());
    assert_eq!(positions, input.positions());
    collapses
}

/// The bunny down to 500 triangles and back by vertex splits, in each tier: the same triangles and
/// positions in the same order.
#[test]
fn the_bunny_comes_back_from_500_triangles() {
    let Some(files) = files("meshes") else {
        return;
    };
    let is_bunny = |file: &&PathBuf| file.ends_with("stanford-bunny.obj");
    let Some(file) = files.iter().find(is_bunny) else {
        eprintln!("skipped: no stanford-bunny.obj among the meshes");
        return;
    };
    let input = io::read(file, &ReadOptions::default()).unwrap();
    let (input, _) = clean(input, true).unwrap();
    let collapses = [
        bunny_and_back::<Full>(&input),
        bunny_and_back::<Medium>(&input),
        bunny_and_back::<Small>(&input),
    ];
    println!(
        "{} triangles, {collapses:?} collapses undone",
        input.triangles().len()
    );
}

/// Nothing is non-manifold after a cut, also when read back; every face is where it was, and what was
/// manifold is not cut. The table is printed.
#[test]
fn a_cut_makes_every_mesh_manifold() {
    let Some(files) = files("meshes") else {
        return;
    };
    let is_ours = |file: &&PathBuf| file.extension().is_some_and(|e| e != "glb");
    for file in files.iter().filter(is_ours) {
        let name = file.file_name().unwrap().display();
        let input = io::read(file, &ReadOptions::default()).unwrap();
        let (output, report) = cut(input.clone(), true).unwrap();
        println!(
            "{name}: edges {} -> {}, vertices {} -> {}, {} copied of {}, components {} -> {}",
            report.non_manifold_edges_in,
            report.non_manifold_edges_out,
            report.non_manifold_vertices_in,
            report.non_manifold_vertices_out,
            report.vertices_copied,
            report.cleaning.kept_vertices,
            report.components_in,
            report.components_out,
        );
        assert_eq!(report.non_manifold_edges_out, 0, "{name}");
        assert_eq!(report.non_manifold_vertices_out, 0, "{name}");
        let was_manifold = report.non_manifold_vertices_in == 0;
        assert_eq!(report.vertices_copied == 0, was_manifold, "{name}");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out.ply");
        io::write(&path, &output, &WriteOptions::default()).unwrap();
        let written = io::read(&path, &ReadOptions::default()).unwrap();
        assert!(info_of_file(written).unwrap().is_manifold(), "{name}");
        let (before, _) = clean(input, report.cleaning.welded_vertices > 0).unwrap();
        let corners = |mesh: &IndexedMesh| -> Vec<[[u32; 3]; 3]> {
            let at = |v: u32| mesh.positions()[v as usize].to_array().map(f32::to_bits);
            mesh.triangles().iter().map(|t| t.map(at)).collect()
        };
        assert!(corners(&output) == corners(&before), "{name}");
    }
}

/// Read or refused by the command itself: no panic, no hang, the file named, nothing left behind.
#[test]
fn malformed_files_are_decimated_or_refused() {
    let Some(files) = files("malformed") else {
        return;
    };
    // On an idle machine each takes milliseconds.
    let limit = Duration::from_secs(5);
    for file in files {
        let name = file.file_name().unwrap().to_str().unwrap();
        for command in ["decimate", "info", "repair"] {
            let folder = tempfile::tempdir().unwrap();
            let output = folder.path().join("out.ply");
            let mut run = Command::new(env!("CARGO_BIN_EXE_decimate"));
            match command {
                "info" => run.arg("info").arg(&file),
                "repair" => run
                    .arg("repair")
                    .arg(&file)
                    .args(["--cut", "-o"])
                    .arg(&output),
                _ => run.arg(&file).args(["--ratio", "0.5", "-o"]).arg(&output),
            };
            let start = Instant::now();
            let ran = run.output().unwrap();
            let elapsed = start.elapsed();
            let stderr = String::from_utf8_lossy(&ran.stderr);
            let what = format!("{command} {name}: {stderr}");
            assert!(!stderr.contains("panicked"), "{what}");
            assert!(elapsed < limit, "{what}: took {elapsed:?}");
            let left = folder.path().read_dir().unwrap().count();
            match ran.status.code() {
                Some(0) if command != "info" => {
                    let small = io::read(&output, &ReadOptions::default())
                        .unwrap_or_else(|e| panic!("{what}: {e}"));
                    assert!(small.positions().iter().all(|p| p.is_finite()), "{what}");
                    is_a_complex(&small, &mut |wrong| {
                        // A double-sided face is written as two.
                        assert!(wrong.ends_with("is there twice"), "{what}: {wrong}");
                    });
                    assert_eq!(left, 1, "{what}: files beside the output");
                }
                Some(0) => {}
                Some(1) => {
                    assert!(stderr.starts_with("error: "), "{what}");
                    assert!(stderr.contains(name), "{what}: does not name the file");
                    assert!(ran.stdout.is_empty(), "{what}");
                    assert_eq!(left, 0, "{what}: files left behind");
                }
                status => panic!("{what}: exit status {status:?}"),
            }
        }
    }
}

/// A check that cannot fail is none: each damage to a cube is said.
#[test]
fn broken_promises_are_found() {
    let cube = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/cube_quads.obj");
    let positions_alone = ReadOptions {
        attributes: false,
        ..ReadOptions::default()
    };
    let cube = io::read(&cube, &positions_alone).unwrap();
    let before = info(cube.clone(), true).unwrap();
    let (same, report) = run(&cube, 1.0, Tier::Small, true);
    let said = |positions: &[glam::Vec3], triangles: &[[u32; 3]]| {
        let output = IndexedMesh::new(positions.to_vec(), triangles.to_vec()).unwrap();
        let mut said = Vec::new();
        compare(&cube, &before, &output, &report, &mut |what| {
            said.push(what)
        });
        said.join("; ")
    };
    let (positions, triangles) = (same.positions(), same.triangles());
    assert_eq!(said(positions, triangles), "");

    let open = said(positions, &triangles[1..]);
    for what in [
        "triangles_out",
        "Euler",
        "boundary loops",
        "boundary edges grew",
    ] {
        assert!(open.contains(what), "no {what} in {open}");
    }
    let mut moved = positions.to_vec();
    for (x, is_outside) in [(1.1, false), (1.3, true), (f32::NAN, true)] {
        moved[1].x = x;
        let said = said(&moved, triangles);
        assert_eq!(said.contains("outside"), is_outside, "{x}: {said}");
    }
    let with = |face: [u32; 3]| {
        let mut more = triangles.to_vec();
        more.push(face);
        said(positions, &more)
    };
    assert!(with([0, 1, 1]).contains("has a vertex twice"));
    let [a, b, c] = triangles[0];
    assert!(with([b, c, a]).contains("is there twice"));
    assert!(with([0, 1, 6]).contains("non-manifold edges grew"));
    let mut isolated = positions.to_vec();
    isolated.push(isolated[0]);
    assert!(said(&isolated, triangles).contains("has no face"));
    let mut turned = triangles.to_vec();
    turned[0].swap(0, 1);
    assert!(said(positions, &turned).contains("inconsistent edges"));

    let mut nearly = same.clone().into_parts().positions;
    nearly[0].x = -0.0;
    let nearly = IndexedMesh::new(nearly, triangles.to_vec()).unwrap();
    assert!(nearly == same && !is_same(&nearly, &same), "−0 is not 0");
}
