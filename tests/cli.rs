//! The command as a person or a script meets it: exit status, what stands on which stream, and
//! which files are there afterwards.

use std::collections::BTreeSet;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use decimate::attributes::Kind;
use decimate::decimate::{Quality, needed_bytes};
use decimate::indexed_mesh::IndexedMesh;
use decimate::io::{self, ReadOptions, WriteOptions};
use decimate::mesh::Tier;
use glam::Vec3;
use serde_json::Value;

/// A folder of its own, in which the command runs: every name is relative, messages are short.
struct Folder(tempfile::TempDir);

/// What a run left: exit status and both streams.
struct Ran {
    status: i32,
    stdout: Vec<u8>,
    stderr: String,
}

impl Folder {
    /// A folder with these files of `data/`.
    fn with(files: &[&str]) -> Folder {
        let folder = Folder(tempfile::tempdir().unwrap());
        let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
        for file in files {
            let name = Path::new(file).file_name().unwrap();
            fs::copy(data.join(file), folder.0.path().join(name)).unwrap();
        }
        folder
    }

    /// A folder with `hill.ply`: 800 triangles of a bumpy square, with one boundary.
    fn with_hill() -> Folder {
        let folder = Folder::with(&[]);
        folder.write_mesh("hill.ply", &hill(20));
        folder
    }

    /// Runs the command with arguments between blanks.
    fn run(&self, arguments: &str) -> Ran {
        self.run_with_input(arguments, b"")
    }

    /// Runs the command with `input` on standard input.
    fn run_with_input(&self, arguments: &str, input: &[u8]) -> Ran {
        let mut child = Command::new(env!("CARGO_BIN_EXE_decimate"))
            .args(arguments.split_whitespace())
            .current_dir(self.0.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut stdin = child.stdin.take().unwrap();
        let input = input.to_vec();
        // Beside, since a full pipe would wait for this test to read the other end. A command that
        // does not read its input closes it: no failure here.
        let writer = std::thread::spawn(move || stdin.write_all(&input).ok());
        let output = child.wait_with_output().unwrap();
        writer.join().unwrap();
        let ran = Ran::new(output);
        assert!(
            !ran.stderr.contains("panicked"),
            "{arguments}: {}",
            ran.stderr
        );
        ran
    }

    /// Runs the command with `--report -` and returns the report.
    fn report(&self, arguments: &str) -> Value {
        let ran = self.run(&format!("{arguments} --report -"));
        assert_eq!(ran.status, 0, "{arguments}: {}", ran.stderr);
        serde_json::from_slice(&ran.stdout).unwrap()
    }

    /// What `info --json` says.
    fn info(&self, arguments: &str) -> Value {
        let ran = self.run(&format!("info --json {arguments}"));
        assert_eq!(ran.status, 0, "{arguments}: {}", ran.stderr);
        serde_json::from_slice(&ran.stdout).unwrap()
    }

    fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.0.path().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    fn text(&self, name: &str) -> String {
        String::from_utf8(self.bytes(name)).unwrap()
    }

    fn write(&self, name: &str, content: &str) {
        fs::write(self.0.path().join(name), content).unwrap();
    }

    fn mesh(&self, name: &str) -> IndexedMesh {
        io::read(&self.0.path().join(name), &ReadOptions::default()).unwrap()
    }

    fn write_mesh(&self, name: &str, mesh: &IndexedMesh) {
        io::write(&self.0.path().join(name), mesh, &WriteOptions::default()).unwrap();
    }

    /// The names of the files, hidden ones among them.
    fn names(&self) -> BTreeSet<String> {
        let entries = fs::read_dir(self.0.path()).unwrap();
        entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect()
    }
}

impl Ran {
    fn new(output: Output) -> Ran {
        Ran {
            status: output.status.code().expect("not ended by a signal"),
            stdout: output.stdout,
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    /// Asserts the exit status, that a failure says `error: ` first and leaves stdout alone, and
    /// that `needle` is in the message.
    #[track_caller]
    fn failed(&self, status: i32, needle: &str) {
        assert_eq!(self.status, status, "{}", self.stderr);
        assert!(self.stderr.starts_with("error: "), "{}", self.stderr);
        assert!(
            self.stderr.contains(needle),
            "no {needle:?} in: {}",
            self.stderr
        );
        assert!(self.stdout.is_empty(), "a failure wrote to stdout");
    }
}

/// A bumpy square of `n` × `n` cells: nothing on it is flat, its rim has 4n edges.
fn hill(n: u32) -> IndexedMesh {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for j in 0..=n {
        for i in 0..=n {
            let (x, y) = (i as f32 / n as f32, j as f32 / n as f32);
            let z = 0.1 * (7.0 * x).sin() * (5.0 * y).cos() + 0.01 * (31.0 * x * y).sin();
            positions.push(Vec3::new(x, y, z));
            if i < n && j < n {
                let a = j * (n + 1) + i;
                let above = a + n + 1;
                triangles.extend([[a, a + 1, above + 1], [a, above + 1, above]]);
            }
        }
    }
    IndexedMesh::new(positions, triangles).unwrap()
}

type Bits = [u32; 3];

fn bits(p: &Vec3) -> Bits {
    p.to_array().map(f32::to_bits)
}

/// The positions of the vertices on edges that one triangle has.
fn rim(mesh: &IndexedMesh) -> BTreeSet<Bits> {
    let mut edges: Vec<[u32; 2]> = mesh
        .triangles()
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    let lonely = edges.chunk_by(|a, b| a == b).filter(|same| same.len() == 1);
    let vertices = lonely.flat_map(|same| same[0]);
    vertices
        .map(|v| bits(&mesh.positions()[v as usize]))
        .collect()
}

/// `--ratio` is what is kept; alone, each target is reached; together, the first that is reached
/// stops, which is the larger number or the error.
#[test]
fn the_first_target_that_is_reached_stops() {
    let folder = Folder::with_hill();
    for (arguments, target, reason) in [
        ("--ratio 0.25", 200, "target"),
        ("--triangles 100", 100, "target"),
        ("--ratio 0.25 --triangles 100", 200, "target"),
        ("--ratio 0.125 --triangles 300", 300, "target"),
        ("--ratio 0.5 --max-error 1000", 400, "target"),
        ("--triangles 10 --max-error 5e-3", 10, "max_error"),
        (
            "--ratio 0.01 --triangles 2 --max-error 5e-3",
            8,
            "max_error",
        ),
        ("--max-error 5e-3", 0, "max_error"),
    ] {
        let report = folder.report(&format!("hill.ply -o out.ply {arguments}"));
        assert_eq!(report["target_triangles"], target, "{arguments}");
        assert_eq!(report["stop_reason"], reason, "{arguments}");
        assert_eq!(report["triangles_in"], 800, "{arguments}");
        let out = report["triangles_out"].as_u64().unwrap();
        if reason == "target" {
            // At the rim a collapse takes one triangle, elsewhere two.
            assert!((target - 1..=target).contains(&out), "{arguments}: {out}");
        } else {
            assert!((target + 1..800).contains(&out), "{arguments}: {out}");
            let error = report["max_error_estimate"].as_f64().unwrap();
            assert!(error <= 5e-3, "{arguments}: {error}");
        }
        assert_eq!(folder.mesh("out.ply").triangles().len() as u64, out);
    }
}

/// Keeping everything changes nothing, bit for bit; so does a target above what is there.
#[test]
fn ratio_1_is_the_same_mesh() {
    let folder = Folder::with(&["sample.ply"]);
    for target in ["--ratio 1", "--triangles 100000"] {
        let ran = folder.run(&format!("sample.ply -o out.ply --strict {target}"));
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        let (before, after) = (folder.mesh("sample.ply"), folder.mesh("out.ply"));
        assert_eq!(after.triangles(), before.triangles(), "{target}");
        let all = |m: &IndexedMesh| m.positions().iter().map(bits).collect::<Vec<_>>();
        assert!(all(&after) == all(&before), "{target}: positions differ");
    }
}

#[test]
fn wrong_usage_is_2_and_says_what_is_wrong() {
    let folder = Folder::with_hill();
    for (arguments, needle) in [
        ("", "required"),
        ("hill.ply --ratio 0.5", "--output"),
        ("-o out.ply --ratio 0.5", "INPUT"),
        ("hill.ply -o out.ply", "no target"),
        ("hill.ply -o out.ply --ratio 1.5", "1.5"),
        ("hill.ply -o out.ply --ratio=-0.5", "-0.5"),
        ("hill.ply -o out.ply --ratio nan", "NaN"),
        ("hill.ply -o out.ply --ratio half", "half"),
        ("hill.ply -o out.ply --triangles=-7", "-7"),
        ("hill.ply -o out.ply --max-error=-1", "-1"),
        ("hill.ply -o out.ply --max-error inf", "inf"),
        ("hill.ply -o out.ply --ratio 0.5 --tier huge", "huge"),
        ("hill.ply -o out.ply --ratio 0.5 --boundary loose", "loose"),
        ("hill.ply -o out.ply --ratio 0.5 --placement here", "here"),
        ("hill.ply -o out.ply --ratio 0.5 --precision 0", "0"),
        ("hill.ply -o out.ply --ratio 0.5 --precision 18", "18"),
        (
            "hill.ply -o out.ply --ratio 0.5 --memory-limit lots",
            "lots",
        ),
        ("hill.ply -o out.ply --ratio 0.5 --output-format xyz", "xyz"),
        (
            "hill.ply -o out.ply --ratio 0.5 --frobnicate",
            "--frobnicate",
        ),
        (
            "hill.ply -o - --ratio 0.5 --output-format ply --report -",
            "standard output",
        ),
        ("hill.ply -o - --ratio 0.5", "--output-format"),
        ("info", "MESH"),
        ("info hill.ply --ratio 0.5", "--ratio"),
    ] {
        let ran = folder.run(arguments);
        ran.failed(2, needle);
    }
    assert_eq!(folder.names(), BTreeSet::from(["hill.ply".into()]));
}

/// Hours of work are not thrown away for an extension: the input, which is missing, is not asked for.
#[test]
fn an_unknown_output_format_is_said_before_the_input_is_read() {
    let folder = Folder::with(&[]);
    folder
        .run("missing.ply -o out.xyz --ratio 0.5")
        .failed(2, "out.xyz");
    folder
        .run("missing.ply -o out --ratio 0.5")
        .failed(2, "out");
}

#[test]
fn what_cannot_be_read_or_written_is_1_and_named() {
    let folder = Folder::with(&["sample.ply", "broken/letters.obj"]);
    folder.write("points.obj", "v 0 0 0\nv 1 0 0\n");
    folder.write("nothing.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    fs::create_dir(folder.0.path().join("folder.ply")).unwrap();
    for (arguments, needle) in [
        (
            "missing.ply -o out.ply --ratio 0.5",
            "missing.ply: cannot open",
        ),
        ("letters.obj -o out.ply --ratio 0.5", "letters.obj:2: "),
        (
            "points.obj -o out.ply --ratio 0.5",
            "points.obj: no triangle",
        ),
        (
            "nothing.obj -o out.ply --ratio 0.5",
            "nothing.obj: no triangle is left",
        ),
        ("folder.ply -o out.ply --ratio 0.5", "folder.ply: "),
        (
            "sample.ply -o folder.ply --ratio 0.9",
            "folder.ply: cannot create",
        ),
        (
            "sample.ply -o absent/out.ply --ratio 0.9",
            "absent/out.ply: ",
        ),
        (
            "sample.ply -o out.ply --ratio 0.9 --report absent/r.json",
            "absent/r.json: ",
        ),
        ("info missing.ply", "missing.ply: cannot open"),
        ("info letters.obj", "letters.obj:2: "),
    ] {
        folder.run(arguments).failed(1, needle);
    }
}

/// Where nothing can be written, that is said before the input is read.
#[test]
fn an_output_that_cannot_be_is_refused_before_the_work() {
    let folder = Folder::with(&[]);
    for arguments in [
        "missing.ply -o absent/out.ply --ratio 0.5",
        "missing.ply -o out.ply --ratio 0.5 --report absent/r.json",
    ] {
        let ran = folder.run(arguments);
        ran.failed(1, "cannot create");
        assert!(!ran.stderr.contains(".decimate-"), "{}", ran.stderr);
    }
}

/// A report in the place of a mesh would destroy it.
#[test]
fn a_report_overwrites_no_mesh() {
    let folder = Folder::with(&["tetrahedron.off"]);
    let before = folder.bytes("tetrahedron.off");
    for report in [
        "tetrahedron.off",
        "./tetrahedron.off",
        "out.off",
        "../x/../out.off",
    ] {
        let report = report.replace("../x/..", folder.0.path().to_str().unwrap());
        let arguments = format!("tetrahedron.off -o out.off --ratio 1 --report {report}");
        folder.run(&arguments).failed(2, "would overwrite");
    }
    assert_eq!(folder.bytes("tetrahedron.off"), before);
}

/// Distances as fractions of the diagonal and in model units, for each mesh, whatever the threads.
#[test]
fn compare_measures_each_mesh_against_the_reference() {
    let folder = Folder::with(&["sample.ply"]);
    let ran = folder.run("sample.ply -o small.ply --ratio 0.05 --quiet");
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let compare = "compare sample.ply sample.ply small.ply --samples 20000";
    let ran = folder.run(&format!("{compare} --json --threads 1"));
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    assert_eq!(
        ran.stdout,
        folder.run(&format!("{compare} --json --threads 4")).stdout
    );
    let found: Value = serde_json::from_slice(&ran.stdout).unwrap();
    let rms = |i: usize| {
        found[i]["surface"]["two_sided_of_diagonal"]["rms"]
            .as_f64()
            .unwrap()
    };
    assert!(rms(0) < 1e-9, "{}", rms(0));
    assert!((1e-5..1e-3).contains(&rms(1)), "{}", rms(1));
    let units = found[1]["surface"]["two_sided"]["rms"].as_f64().unwrap();
    let diagonal = found[1]["diagonal"].as_f64().unwrap();
    assert!((units / diagonal - rms(1)).abs() < 1e-12);
    assert_eq!(found[1]["new_boundary_edges"], 0);
    assert!(found[1]["boundary"]["two_sided"]["max"].as_f64().unwrap() > 0.0);
    let table = folder.run(&format!("{compare} --intersections"));
    let table = String::from_utf8_lossy(&table.stdout).into_owned();
    for word in [
        "small.ply",
        "Hausdorff",
        "boundary rms",
        "triangle quality",
        "intersecting pairs",
    ] {
        assert!(table.contains(word), "{word} is not in\n{table}");
    }
    folder.run("compare sample.ply").failed(2, "MESHES");
    folder
        .run("compare sample.ply absent.ply")
        .failed(1, "absent.ply: cannot open");
    folder
        .run("compare sample.ply small.ply --samples 0")
        .failed(2, "samples");
}

/// A square that is white and one of four fifths of it: a fifth of the full range apart, where asked for.
#[test]
fn compare_measures_attributes_where_asked() {
    let folder = Folder::with(&[]);
    for (name, shade) in [("white.ply", 255), ("grey.ply", 204)] {
        let corners = ["0 0 0", "1 0 0", "1 1 0", "0 1 0"];
        let vertices = corners
            .map(|p| format!("{p} {shade} {shade} {shade}\n"))
            .concat();
        let colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
        let ply = format!(
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
             property float z\n{colors}element face 2\n\
             property list uchar int vertex_indices\nend_header\n{vertices}3 0 1 2\n3 0 2 3\n"
        );
        folder.write(name, &ply);
    }
    let compare = "compare white.ply grey.ply --samples 1000";
    let json = |ran: Ran| -> Value { serde_json::from_slice(&ran.stdout).unwrap() };
    let found = json(folder.run(&format!("{compare} --attributes --json")));
    let color = &found[0]["attributes"]["channels"][0];
    assert_eq!(
        (&color["name"], &color["unit"]),
        (&"color".into(), &"of_full_range".into())
    );
    let rms = color["two_sided"]["rms"].as_f64().unwrap();
    assert!((rms - 0.2).abs() < 1e-12, "{rms}");
    let table = folder.run(&format!("{compare} --attributes"));
    let table = String::from_utf8_lossy(&table.stdout).into_owned();
    assert!(table.contains("color (of full range), rms"), "{table}");
    let found = json(folder.run(&format!("{compare} --json")));
    assert_eq!(found[0]["attributes"], Value::Null);
}

/// A thread has a stack; ten thousand of them would be the longest part of the work.
#[test]
fn any_number_of_threads_is_accepted() {
    let folder = Folder::with(&["tetrahedron.off"]);
    let ran = folder.run("tetrahedron.off -o out.off --ratio 1 --threads 100000");
    assert_eq!(ran.status, 0, "{}", ran.stderr);
}

#[test]
fn negative_targets_are_named_as_such() {
    let folder = Folder::with(&["tetrahedron.off"]);
    folder
        .run("tetrahedron.off -o out.off --ratio -0.5")
        .failed(2, "ratio -0.5");
    folder
        .run("tetrahedron.off -o out.off --max-error -1")
        .failed(2, "error -1");
    folder
        .run("tetrahedron.off -o out.off --triangles -3")
        .failed(2, "'-3'");
}

/// No edge of a tetrahedron may go. That is said, with the reason; only `--strict` makes it a failure.
#[test]
fn stopping_short_is_3_under_strict_and_said_in_any_case() {
    let folder = Folder::with(&["tetrahedron.off"]);
    for (strict, status) in [("", 0), ("--strict", 3)] {
        let ran = folder.run(&format!(
            "tetrahedron.off -o out.off --triangles 0 {strict} --report report.json"
        ));
        assert_eq!(ran.status, status, "{}", ran.stderr);
        assert!(ran.stderr.contains("stopped short"), "{}", ran.stderr);
        assert!(
            ran.stderr.contains("6 would change the topology"),
            "{}",
            ran.stderr
        );
        let report: Value = serde_json::from_slice(&folder.bytes("report.json")).unwrap();
        assert_eq!(report["stop_reason"], "blocked");
        assert_eq!(report["stopped_short"], true);
        assert_eq!(report["blocked"]["link"], 6);
        assert_eq!(folder.mesh("out.off").triangles().len(), 4, "is written");
    }
    // What was asked for is what there is: nothing is short.
    assert_eq!(
        folder
            .run("tetrahedron.off -o out.off --triangles 4 --strict")
            .status,
        0
    );
}

/// Reaching the largest error is what was asked for, not falling short.
#[test]
fn an_error_that_is_reached_is_not_short() {
    let folder = Folder::with_hill();
    let ran = folder.run("hill.ply -o out.ply --max-error 5e-3 --strict");
    assert_eq!(ran.status, 0, "{}", ran.stderr);
}

/// A pipe carries what the files would hold, in every pair of formats.
#[test]
fn pipes_carry_the_bytes_of_files() {
    let folder = Folder::with_hill();
    for from in ["ply", "obj", "stl", "off", "gltf", "glb"] {
        folder.run(&format!("hill.ply -o in.{from} --ratio 1"));
        let input = folder.bytes(&format!("in.{from}"));
        for to in ["ply", "obj", "stl", "off", "gltf", "glb"] {
            let by_file = folder.run(&format!("in.{from} -o out.{to} --ratio 0.3"));
            assert_eq!(by_file.status, 0, "{}", by_file.stderr);
            let by_pipe = folder.run_with_input(
                &format!("- -o - --ratio 0.3 --input-format {from} --output-format {to}"),
                &input,
            );
            assert_eq!(by_pipe.status, 0, "{}", by_pipe.stderr);
            assert!(
                by_pipe.stdout == folder.bytes(&format!("out.{to}")),
                "{from} to {to}"
            );
        }
    }
    // One end of each: a pipe in and a file out, a file in and a pipe out.
    let input = folder.bytes("hill.ply");
    folder.run("hill.ply -o out.ply --ratio 0.3");
    folder.run_with_input("- -o piped.ply --ratio 0.3", &input);
    let out = folder.run("hill.ply -o - --output-format ply --ratio 0.3");
    assert!(folder.bytes("piped.ply") == folder.bytes("out.ply"));
    assert!(out.stdout == folder.bytes("out.ply"));
    let info = folder.run_with_input("info - --json", &input);
    let info: Value = serde_json::from_slice(&info.stdout).unwrap();
    assert_eq!(info["triangles"], 800);
}

/// A file of text has no unmistakable beginning as OBJ: standard input needs the format's name.
#[test]
fn standard_input_without_a_telling_beginning_asks_for_the_format() {
    let folder = Folder::with(&["bow_tie.obj"]);
    let input = folder.bytes("bow_tie.obj");
    folder
        .run_with_input("- -o out.ply --ratio 1", &input)
        .failed(1, "--input-format");
    let named = folder.run_with_input("- -o out.ply --ratio 1 --input-format obj", &input);
    assert_eq!(named.status, 0, "{}", named.stderr);
}

/// A reader that goes away (`| head`) is an error of the file, not a panic.
#[test]
fn a_closed_pipe_is_a_failure_without_a_panic() {
    let folder = Folder::with(&["sample.ply"]);
    let mut child = Command::new(env!("CARGO_BIN_EXE_decimate"))
        .args("sample.ply -o - --output-format ply --ratio 0.9".split(' '))
        .current_dir(folder.0.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    Ran::new(child.wait_with_output().unwrap()).failed(1, "cannot write");
}

/// The promise of the whole design: neither tier nor threads reach the output.
#[test]
fn tiers_and_threads_give_the_same_bytes() {
    let folder = Folder::with(&["sample.ply"]);
    folder.run("sample.ply -o first.ply --ratio 0.1");
    let first = folder.bytes("first.ply");
    for arguments in [
        "--tier full --threads 1",
        "--tier full --threads 4",
        "--tier medium --threads 4",
        "--tier small --threads 1",
        "--tier small --threads 4",
    ] {
        let report = folder.report(&format!("sample.ply -o out.ply --ratio 0.1 {arguments}"));
        let tier = arguments.split(' ').nth(1).unwrap();
        assert_eq!(report["tier"], tier);
        assert_eq!(report["tier_reason"], "asked for");
        assert!(
            folder.bytes("out.ply") == first,
            "{arguments}: other bytes than by default"
        );
    }
}

/// What scripts read: no key goes without a test that fails, every second and byte has its unit.
#[test]
fn the_report_has_its_keys() {
    let folder = Folder::with(&["sample.ply"]);
    let report = folder.report("sample.ply -o out.ply --ratio 0.1 --chunks off");
    for key in [
        "chunks",
        "chunk_rounds",
        "collapses_in_chunks",
        "chunk_seconds",
        "vertices_in",
        "triangles_in",
        "vertices_out",
        "triangles_out",
        "target_triangles",
        "stop_reason",
        "stopped_short",
        "max_error_estimate",
        "tier",
        "tier_reason",
        "read_seconds",
        "clean_seconds",
        "build_seconds",
        "decimate_seconds",
        "write_seconds",
        "mesh_bytes",
        "peak_heap_bytes",
        "peak_rss_bytes",
        "rejected_link",
        "rejected_flip",
        "rejected_lock",
        "rejected_error",
        "collapses",
        "collapses_non_manifold",
        "non_manifold_edges_in",
        "reoriented_faces",
        "welded_vertices",
        "dropped_non_finite_faces",
        "dropped_degenerate_faces",
        "dropped_duplicate_faces",
        "dropped_isolated_vertices",
        "folded_faces",
        "kept_vertices",
        "kept_faces",
    ] {
        let value = report.get(key).unwrap_or_else(|| panic!("no {key}"));
        assert!(!value.is_null(), "{key} is null");
        if key.ends_with("_seconds") {
            assert!(value.as_f64().unwrap() >= 0.0, "{key} is {value}");
        }
    }
    assert_eq!(report["triangles_in"], 99_969);
    assert_eq!(report["vertices_in"], 50_074);
    assert_eq!(report["stop_reason"], "target");
    // 32 bytes a triangle at two triangles a vertex, and rows for one non-manifold edge.
    let mesh_bytes = report["mesh_bytes"].as_u64().unwrap();
    let of_table = Tier::Small.bytes(50_074, 99_969) as u64;
    assert!((of_table..of_table + 1000).contains(&mesh_bytes));
    let [heap, process] = ["heap", "rss"].map(|what| {
        let bytes = report[format!("peak_{what}_bytes")].as_f64().unwrap();
        assert!(bytes > mesh_bytes as f64);
        bytes
    });
    // Code, stacks and what the allocator keeps come on top.
    assert!(
        (process - heap).abs() < 0.1 * process + 16e6,
        "{heap} {process}"
    );
    // Two triangles and one vertex go with a collapse inside, one triangle at the rim.
    let gone = |what: &str| {
        report[format!("{what}_in")].as_u64().unwrap()
            - report[format!("{what}_out")].as_u64().unwrap()
    };
    assert_eq!(gone("vertices"), report["collapses"].as_u64().unwrap());
    assert!(gone("triangles") <= 2 * gone("vertices"));
}

/// The report as a file is the report on standard output, times and memory apart.
#[test]
fn the_report_goes_to_a_file_too() {
    let folder = Folder::with_hill();
    let to_stdout = folder.report("hill.ply -o out.ply --ratio 0.5");
    let ran = folder.run("hill.ply -o out.ply --ratio 0.5 --report report.json");
    assert!(ran.stdout.is_empty());
    let to_file: Value = serde_json::from_slice(&folder.bytes("report.json")).unwrap();
    let lasting = |report: &Value| {
        let all = report.as_object().unwrap().clone();
        let lasting = all.into_iter().filter(|(key, _)| {
            !key.ends_with("_seconds") && !key.starts_with("peak_") && key != "tier_reason"
        });
        lasting.collect::<serde_json::Map<_, _>>()
    };
    assert_eq!(lasting(&to_file), lasting(&to_stdout));
    assert!(folder.text("report.json").ends_with("}\n"));
}

/// Results on standard output, everything else on standard error; no bar where that is no terminal.
#[test]
fn only_results_stand_on_standard_output() {
    let folder = Folder::with_hill();
    let plain = folder.run("hill.ply -o out.ply --ratio 0.5");
    assert!(plain.stdout.is_empty());
    assert!(plain.stderr.contains("hill.ply -> out.ply: 800 -> "));
    assert!(!plain.stderr.contains('\u{1b}') && !plain.stderr.contains('\r'));

    let report = folder.run("hill.ply -o out.ply --ratio 0.5 --report -");
    assert!(serde_json::from_slice::<Value>(&report.stdout).is_ok());
    assert!(report.stderr.contains("800 -> "));

    let mesh = folder.run("hill.ply -o - --output-format ply --ratio 0.5");
    assert!(mesh.stdout == folder.bytes("out.ply"));
    assert!(mesh.stderr.contains("800 -> "));

    let info = folder.run("info hill.ply");
    assert!(!info.stdout.is_empty() && info.stderr.is_empty());
}

/// Not even that it stopped short: that is what the exit status is for.
#[test]
fn quiet_prints_nothing_but_errors() {
    let folder = Folder::with(&["tetrahedron.off"]);
    for (arguments, status) in [
        ("--ratio 1", 0),
        ("--ratio 0", 0),
        ("--ratio 0 --strict", 3),
    ] {
        let ran = folder.run(&format!("tetrahedron.off -o out.off --quiet {arguments}"));
        assert_eq!(ran.status, status);
        assert!(ran.stdout.is_empty());
        assert_eq!(ran.stderr, "");
    }
    folder
        .run("missing.off -o out.off --quiet --ratio 1")
        .failed(1, "missing.off");
}

#[test]
fn the_output_may_be_the_input() {
    let folder = Folder::with_hill();
    folder.run("hill.ply -o out.ply --ratio 0.5");
    let ran = folder.run("hill.ply -o hill.ply --ratio 0.5");
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    assert!(folder.bytes("hill.ply") == folder.bytes("out.ply"));
}

/// Whatever stops a run, what stood at the output's place stands there still, and nothing else does.
#[test]
fn a_failure_leaves_the_folder_as_it_was() {
    let folder = Folder::with(&["broken/truncated_face.ply", "tetrahedron.off"]);
    folder.write("out.ply", "old");
    let before = folder.names();
    for arguments in [
        "truncated_face.ply -o out.ply --ratio 0.5",
        "missing.ply -o out.ply --ratio 0.5",
        "tetrahedron.off -o out.ply --ratio 1.5",
        "tetrahedron.off -o out.ply --ratio 0.5 --memory-limit 10",
        "tetrahedron.off -o new.ply --ratio 0.5 --memory-limit 10",
        "tetrahedron.off -o absent/new.ply --ratio 0.5",
    ] {
        let ran = folder.run(arguments);
        assert_ne!(ran.status, 0, "{arguments}");
        assert_eq!(folder.text("out.ply"), "old", "{arguments}");
        assert_eq!(folder.names(), before, "{arguments}");
    }
}

#[test]
fn a_success_leaves_the_output_and_nothing_beside() {
    let folder = Folder::with_hill();
    for name in ["out.ply", "out.obj", "out.stl", "out.off", "out.ply"] {
        folder.run(&format!("hill.ply -o {name} --ratio 0.5"));
    }
    let expected = ["hill.ply", "out.obj", "out.off", "out.ply", "out.stl"];
    assert_eq!(folder.names(), expected.map(String::from).into());
}

/// A disk that is full while writing: said, and exit status 1.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error() {
    let folder = Folder::with_hill();
    folder
        .run("hill.ply -o /dev/full --output-format ply --ratio 0.5")
        .failed(1, "/dev/full: cannot write");
}

/// The same for the report, and for what goes through standard output.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_of_every_output() {
    let folder = Folder::with_hill();
    folder
        .run("hill.ply -o out.ply --ratio 0.5 --report /dev/full")
        .failed(1, "/dev/full: cannot write");
    folder
        .run("repair hill.ply -o /dev/full --output-format obj --cut")
        .failed(1, "/dev/full: cannot write");
    for arguments in [
        "hill.ply -o - --output-format ply --ratio 0.5",
        "info hill.ply",
        "info hill.ply --json",
    ] {
        let full = fs::OpenOptions::new().write(true).open("/dev/full");
        let output = Command::new(env!("CARGO_BIN_EXE_decimate"))
            .args(arguments.split(' '))
            .current_dir(folder.0.path())
            .stdout(full.unwrap())
            .output();
        Ran::new(output.unwrap()).failed(1, "<stdout>: cannot write");
    }
}

/// A file that may not grow to its whole length, as on a disk that fills up: an error that names it,
/// and nothing is left beside what was there. `ulimit` counts blocks of 512 bytes, or of 1024.
#[cfg(unix)]
#[test]
fn a_disk_that_fills_up_leaves_what_was_there() {
    let folder = Folder::with_hill();
    folder.write("out.ply", "old");
    let before = folder.names();
    for output in ["out.ply", "new.ply", "new.obj"] {
        let limited = format!(
            "trap '' XFSZ; ulimit -f 2; exec '{}' hill.ply -o {output} --ratio 0.9",
            env!("CARGO_BIN_EXE_decimate")
        );
        let ran = Command::new("sh")
            .args(["-c", &limited])
            .current_dir(folder.0.path())
            .output();
        Ran::new(ran.unwrap()).failed(1, &format!("{output}: cannot write"));
        assert_eq!(folder.text("out.ply"), "old", "{output}");
        assert_eq!(folder.names(), before, "{output}");
    }
}

/// Nothing can be created in the folder: said before the input is read, and nothing is touched. Not
/// asked of a user who may do anything.
#[cfg(unix)]
#[test]
fn a_read_only_folder_is_refused_before_the_work() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::with(&["tetrahedron.off"]);
    let locked = folder.0.path().join("locked");
    fs::create_dir(&locked).unwrap();
    fs::write(locked.join("out.ply"), "old").unwrap();
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o555)).unwrap();
    if fs::write(locked.join("probe"), "").is_ok() {
        eprintln!("skipped: this user may write to read-only folders");
    } else {
        for input in ["missing.off", "tetrahedron.off"] {
            for output in ["locked/out.ply", "locked/new.ply"] {
                folder
                    .run(&format!("{input} -o {output} --ratio 0.5"))
                    .failed(1, &format!("{output}: cannot create a file there"));
            }
        }
        assert_eq!(folder.text("locked/out.ply"), "old");
        assert_eq!(fs::read_dir(&locked).unwrap().count(), 1);
    }
    fs::set_permissions(&locked, fs::Permissions::from_mode(0o755)).unwrap();
}

/// A reader that takes some and goes away, as `head -c` does.
#[cfg(unix)]
#[test]
fn a_pipe_that_closes_in_the_middle_is_a_failure_without_a_panic() {
    use std::io::Read;
    let folder = Folder::with(&["sample.ply"]);
    for arguments in [
        "sample.ply -o - --output-format ply --ratio 1",
        "sample.ply -o /dev/stdout --output-format obj --ratio 1",
    ] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_decimate"))
            .args(arguments.split(' '))
            .current_dir(folder.0.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut first = [0; 1000];
        let mut pipe = child.stdout.take().unwrap();
        pipe.read_exact(&mut first).unwrap();
        drop(pipe);
        Ran::new(child.wait_with_output().unwrap()).failed(1, "cannot write");
    }
}

/// Whether a child of this process hears signals: a shell has those that it runs in the background
/// ignore Ctrl-C, and `nohup` the closing of the terminal.
#[cfg(target_os = "linux")]
fn signals_are_heard() -> bool {
    let status = fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|l| l.strip_prefix("SigIgn:"));
    let ignored = u64::from_str_radix(line.unwrap().trim(), 16).unwrap();
    let bits = [1, 2, 15].map(|signal| 1 << (signal - 1));
    bits.iter().all(|bit| ignored & bit == 0)
}

/// Ctrl-C and a request to end, before anything is written and in the middle of a file: the exit
/// status is 130, what stood at the output's place stands there still, and nothing else does. A run
/// that is done before the signal comes is none of these, and is tried again.
#[cfg(target_os = "linux")]
#[test]
fn an_interrupt_leaves_no_half_file() {
    use std::time::Duration;
    if !signals_are_heard() {
        eprintln!("skipped: signals are ignored here");
        return;
    }
    let folder = Folder::with(&[]);
    folder.write_mesh("hill.ply", &hill(400));
    let before = BTreeSet::from(["hill.ply", "out.obj"].map(String::from));
    let is_begun = || {
        let is_half = |entry: fs::DirEntry| {
            entry.file_name().to_string_lossy().starts_with(".decimate")
                && entry.metadata().is_ok_and(|there| there.len() > 0)
        };
        let mut entries = fs::read_dir(folder.0.path()).unwrap();
        entries.any(|entry| entry.is_ok_and(is_half))
    };
    for (signal, in_the_middle) in [("-INT", false), ("-INT", true), ("-TERM", true)] {
        let is_interrupted = (0..20).any(|_| {
            folder.write("out.obj", "old");
            let mut child = Command::new(env!("CARGO_BIN_EXE_decimate"))
                .args("hill.ply -o out.obj --ratio 0.99 --chunks off".split(' '))
                .current_dir(folder.0.path())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            // The handler is there a moment after the start.
            std::thread::sleep(Duration::from_millis(100));
            while in_the_middle && !is_begun() && child.try_wait().unwrap().is_none() {
                std::thread::sleep(Duration::from_millis(1));
            }
            let id = child.id().to_string();
            Command::new("kill").args([signal, &id]).status().unwrap();
            let ran = Ran::new(child.wait_with_output().unwrap());
            assert_eq!(folder.names(), before, "{signal}: {}", ran.stderr);
            if ran.status == 0 {
                assert!(folder.text("out.obj").starts_with("v "));
                return false;
            }
            ran.failed(130, "interrupted");
            assert_eq!(folder.text("out.obj"), "old");
            true
        });
        assert!(is_interrupted, "{signal} came too late, twenty times");
    }
}

#[test]
fn a_memory_limit_that_nothing_fits_says_what_is_needed() {
    let folder = Folder::with(&["sample.ply"]);
    let needed = |tier| needed_bytes(Quality::Standard, tier, 50_074, 99_969) as f64 / 1e6;
    let ran = folder.run("sample.ply -o out.ply --ratio 0.1 --chunks off --memory-limit 1KB");
    ran.failed(
        1,
        &format!("small tier needs {:.1} MB", needed(Tier::Small)),
    );
    let ran =
        folder.run("sample.ply -o out.ply --ratio 0.1 --chunks off --memory-limit 1KB --tier full");
    ran.failed(1, &format!("full tier needs {:.1} MB", needed(Tier::Full)));
}

/// The small tier is the fastest, and needs the least: it is taken at its need and above; the reason
/// has both numbers.
#[test]
fn auto_takes_the_fastest_tier_that_fits_and_says_why() {
    let folder = Folder::with(&["sample.ply"]);
    let needed = |tier| needed_bytes(Quality::Standard, tier, 50_074, 99_969);
    for limit in [needed(Tier::Small), needed(Tier::Full)] {
        let report = folder.report(&format!(
            "sample.ply -o out.ply --ratio 0.9 --memory-limit {limit}"
        ));
        assert_eq!(report["tier"], "small");
        let reason = report["tier_reason"].as_str().unwrap();
        let limit = format!("the memory limit is {:.1} MB", limit as f64 / 1e6);
        assert!(
            reason.contains("fastest that fits") && reason.contains(&limit),
            "{reason}"
        );
    }
}

/// Every boundary vertex of the sample is a boundary vertex of the output, bit for bit.
#[test]
fn a_locked_boundary_keeps_its_bits() {
    let folder = Folder::with(&["sample.ply"]);
    let ran = folder.run("sample.ply -o out.ply --ratio 0.02 --boundary lock");
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    let before = rim(&folder.mesh("sample.ply"));
    assert_eq!(before.len(), 176 + 3, "one hole of 176 edges, one fin");
    assert_eq!(rim(&folder.mesh("out.ply")), before);
    // Without the lock it gives way, or the test above would show nothing.
    folder.run("sample.ply -o out.ply --ratio 0.02");
    assert!(rim(&folder.mesh("out.ply")).len() < before.len());
}

/// `hill.ply` as text, with a property `kept` behind the coordinates of each vertex.
fn hill_with_property(of: impl Fn(&Vec3) -> &'static str) -> String {
    let hill = hill(20);
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nproperty double kept\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        hill.positions().len(),
        hill.triangles().len()
    );
    for p in hill.positions() {
        text += &format!("{} {} {} {}\n", p.x, p.y, p.z, of(p));
    }
    for [a, b, c] in hill.triangles() {
        text += &format!("3 {a} {b} {c}\n");
    }
    text
}

/// The vertices on a line across stay, to the bit; the output, a plain mesh, has no such property.
/// Where all weigh the same nothing changes.
#[test]
fn a_vertex_weight_is_read_from_a_property() {
    let folder = Folder::with_hill();
    let on_line = |p: &Vec3| p.x == 0.5;
    let lines = |name| -> BTreeSet<Bits> {
        let mesh = folder.mesh(name);
        let on_line = mesh.positions().iter().filter(|p| on_line(p));
        on_line.map(bits).collect()
    };
    folder.write(
        "line.ply",
        &hill_with_property(|p| if on_line(p) { "inf" } else { "1" }),
    );
    folder.write("even.ply", &hill_with_property(|_| "2.5"));
    for (input, output) in [
        ("line.ply --vertex-weight kept", "line_out.ply"),
        ("even.ply --vertex-weight kept", "even_out.ply"),
        ("hill.ply", "plain_out.ply"),
    ] {
        let ran = folder.run(&format!("{input} -o {output} --triangles 100"));
        assert_eq!(ran.status, 0, "{}", ran.stderr);
    }
    assert_eq!(lines("line_out.ply"), lines("hill.ply"));
    assert!(lines("plain_out.ply").len() < lines("hill.ply").len());
    assert!(folder.bytes("even_out.ply") == folder.bytes("plain_out.ply"));
    let header = String::from_utf8_lossy(&folder.bytes("line_out.ply")[..200]).into_owned();
    assert!(
        header.contains("end_header") && !header.contains("kept"),
        "{header}"
    );
}

#[test]
fn a_vertex_weight_that_is_not_there_is_1_and_named() {
    let folder = Folder::with_hill();
    folder.write("wrong.ply", &hill_with_property(|_| "-2"));
    folder.run("hill.ply -o hill.obj --ratio 1");
    for (arguments, needle) in [
        (
            "hill.ply --vertex-weight kept",
            "hill.ply: vertex has no property 'kept'; expected one of x, y, z",
        ),
        (
            "wrong.ply --vertex-weight kept",
            "wrong.ply:11: vertex 0 has the weight -2; expected 0 or more",
        ),
        (
            "hill.obj --vertex-weight kept",
            "hill.obj: obj has no vertex property 'kept'; expected ply",
        ),
    ] {
        let ran = folder.run(&format!("{arguments} -o out.ply --ratio 0.5"));
        ran.failed(1, needle);
    }
    assert!(!folder.names().contains("out.ply"));
}

/// A weight on the boundary keeps it where it is; without one it is cut short.
#[test]
fn a_free_boundary_is_not_a_kept_one() {
    let folder = Folder::with_hill();
    folder.run("hill.ply -o keep.ply --triangles 100 --boundary keep");
    folder.run("hill.ply -o default.ply --triangles 100");
    folder.run("hill.ply -o free.ply --triangles 100 --boundary free");
    assert!(folder.bytes("default.ply") == folder.bytes("keep.ply"));
    assert!(folder.bytes("free.ply") != folder.bytes("keep.ply"));
}

#[test]
fn endpoint_placement_gives_a_subset_of_the_vertices() {
    let folder = Folder::with(&["sample.ply"]);
    folder.run("sample.ply -o out.ply --ratio 0.05 --placement endpoint");
    let positions = |name| -> Vec<Bits> {
        let mesh = folder.mesh(name);
        mesh.positions().iter().map(bits).collect()
    };
    let before: BTreeSet<Bits> = positions("sample.ply").into_iter().collect();
    let after = positions("out.ply");
    assert!(after.len() < 3000);
    assert!(after.iter().all(|p| before.contains(p)));
    folder.run("sample.ply -o out.ply --ratio 0.05");
    let optimal = positions("out.ply");
    assert!(
        optimal.iter().any(|p| !before.contains(p)),
        "optimal moves vertices, or this test shows nothing"
    );
}

/// STL gives each facet three vertices of its own; left apart, no edge can go without its facet.
#[test]
fn without_welding_the_facets_of_an_stl_stay_apart() {
    let folder = Folder::with_hill();
    folder.run("hill.ply -o soup.stl --ratio 1");
    let ran = folder.run("soup.stl -o out.stl --ratio 0.5 --no-weld --strict");
    assert_eq!(ran.status, 3);
    assert!(
        ran.stderr.contains("stopped short")
            && ran.stderr.contains("2400 would change the topology"),
        "{}",
        ran.stderr
    );
    assert!(folder.bytes("out.stl") == folder.bytes("soup.stl"));

    let apart = folder.info("soup.stl --no-weld");
    assert_eq!(
        (&apart["components"], &apart["welded_vertices"]),
        (&800.into(), &0.into())
    );
    let welded = folder.info("soup.stl");
    assert_eq!(welded["components"], 1);
    assert_eq!(welded["welded_vertices"], 2400 - 441);
    let report = folder.report("soup.stl -o out.stl --ratio 0.5");
    let out = report["triangles_out"].as_u64().unwrap();
    assert!((399..=400).contains(&out), "{out}");
    assert_eq!(report["vertices_in"], 2400);
}

#[test]
fn every_format_becomes_every_other() {
    let folder = Folder::with_hill();
    for from in ["ply", "obj", "stl", "off", "gltf", "glb"] {
        folder.run(&format!("hill.ply -o a.{from} --ratio 1"));
        for to in ["ply", "obj", "stl", "off", "gltf", "glb"] {
            let report = folder.report(&format!("a.{from} -o b.{to} --ratio 1"));
            assert_eq!(report["triangles_out"], 800, "{from} to {to}");
            let info = folder.info(&format!("b.{to}"));
            assert_eq!(info["kept_faces"], 800, "{from} to {to}");
            assert_eq!(info["kept_vertices"], 441, "{from} to {to}");
            assert_eq!(info["boundary_edges"], 80, "{from} to {to}");
        }
    }
}

#[test]
fn ascii_is_text_of_the_same_mesh() {
    let folder = Folder::with_hill();
    for (name, beginning) in [
        ("a.ply", "ply\nformat ascii 1.0\n"),
        ("a.stl", "solid "),
        ("a.obj", "v "),
        ("a.off", "OFF\n"),
    ] {
        folder.run(&format!("hill.ply -o {name} --ratio 0.5 --ascii"));
        assert!(folder.text(name).starts_with(beginning), "{name}");
        let text = folder.mesh(name);
        folder.run(&format!("hill.ply -o b{name} --ratio 0.5"));
        assert_eq!(text, folder.mesh(&format!("b{name}")), "{name}");
    }
    assert!(folder.bytes("ba.ply").starts_with(b"ply\nformat binary"));
}

/// Three significant digits are within half a per cent of the number.
#[test]
fn precision_is_significant_digits() {
    let folder = Folder::with_hill();
    folder.run("hill.ply -o exact.off --ratio 0.5");
    folder.run("hill.ply -o short.off --ratio 0.5 --precision 3");
    let (exact, short) = (folder.mesh("exact.off"), folder.mesh("short.off"));
    assert_eq!(exact.triangles(), short.triangles());
    for (p, q) in exact.positions().iter().zip(short.positions()) {
        for (x, y) in p.to_array().into_iter().zip(q.to_array()) {
            assert!((x - y).abs() <= 0.005 * x.abs(), "{x} became {y}");
        }
    }
    let text = folder.text("short.off");
    let numbers = text.lines().skip(2).take(short.positions().len());
    for number in numbers.flat_map(str::split_whitespace) {
        let mantissa = number.split('e').next().unwrap();
        let digits: String = mantissa.chars().filter(char::is_ascii_digit).collect();
        assert!(digits.trim_start_matches('0').len() <= 3, "{number}");
    }
}

/// The hand-written meshes say in their comments what is in them; the sample's script does.
#[test]
fn info_counts_what_is_there() {
    let meshes = [
        "three_fins.obj",
        "bow_tie.obj",
        "cube_quads.obj",
        "tetrahedron.off",
        "sample.ply",
    ];
    let folder = Folder::with(&meshes);
    for (mesh, expected) in meshes.into_iter().zip([
        r#"{"vertices": 5, "triangles": 3, "components": 1, "boundary_edges": 6,
            "boundary_loops": 0, "non_manifold_edges": 1, "non_manifold_vertices": 2,
            "inconsistent_edges": 0, "euler_characteristic": 1, "genus": null,
            "is_orientable": true}"#,
        r#"{"vertices": 7, "triangles": 8, "components": 1, "boundary_edges": 0,
            "boundary_loops": 0, "non_manifold_edges": 0, "non_manifold_vertices": 1,
            "inconsistent_edges": 0, "euler_characteristic": 3, "genus": null,
            "is_orientable": true}"#,
        r#"{"vertices": 8, "triangles": 12, "components": 1, "boundary_edges": 0,
            "boundary_loops": 0, "non_manifold_edges": 0, "non_manifold_vertices": 0,
            "inconsistent_edges": 0, "euler_characteristic": 2, "genus": 0,
            "full_tier_bytes": 848, "medium_tier_bytes": 560, "small_tier_bytes": 416}"#,
        r#"{"vertices": 4, "triangles": 4, "components": 1, "boundary_edges": 0,
            "boundary_loops": 0, "non_manifold_edges": 0, "non_manifold_vertices": 0,
            "inconsistent_edges": 0, "euler_characteristic": 2, "genus": 0,
            "full_tier_bytes": 304, "medium_tier_bytes": 208, "small_tier_bytes": 160}"#,
        r#"{"vertices": 50074, "triangles": 99969, "components": 1, "boundary_edges": 178,
            "boundary_loops": 1, "non_manifold_edges": 1, "non_manifold_vertices": 2,
            "inconsistent_edges": 0, "euler_characteristic": 1, "genus": null,
            "zero_area_faces": 0}"#,
    ]) {
        let info = folder.info(mesh);
        let expected: Value = serde_json::from_str(expected).unwrap();
        for (key, value) in expected.as_object().unwrap() {
            assert_eq!(&info[key], value, "{mesh}: {key}");
        }
    }
}

/// Whatever is not manifold in the hand-written meshes is none after the cut, to `info` too, in each
/// format that can hold it; the faces keep their order and their corners' places.
#[test]
fn repair_cuts_what_is_not_manifold() {
    let folder = Folder::with(&["three_fins.obj", "bow_tie.obj", "cube_quads.obj"]);
    for (mesh, copies, edges, vertices) in [
        // Two run along the edge opposite ways and stay together.
        ("three_fins.obj", 2, 1, 2),
        ("bow_tie.obj", 1, 0, 1),
        ("cube_quads.obj", 0, 0, 0),
    ] {
        for output in ["out.ply", "out.obj", "out.off"] {
            let report = folder.report(&format!("repair {mesh} -o {output} --cut"));
            for (key, value) in [
                ("vertices_copied", copies),
                ("non_manifold_edges_in", edges),
                ("non_manifold_vertices_in", vertices),
                ("non_manifold_edges_out", 0),
                ("non_manifold_vertices_out", 0),
            ] {
                assert_eq!(report[key], value, "{mesh}, {output}: {key}");
            }
            let info = folder.info(output);
            for key in ["non_manifold_edges", "non_manifold_vertices"] {
                assert_eq!(info[key], 0, "{mesh}, {output}: {key}");
            }
            let (before, after) = (folder.mesh(mesh), folder.mesh(output));
            let count = before.positions().len();
            assert_eq!(after.positions()[..count], *before.positions());
            assert_eq!(after.positions().len(), count + copies);
            let corners = |mesh: &IndexedMesh| -> Vec<[Vec3; 3]> {
                let at = |v: u32| mesh.positions()[v as usize];
                mesh.triangles().iter().map(|t| t.map(at)).collect()
            };
            assert_eq!(corners(&after), corners(&before));
        }
    }
}

/// What a cut mesh carries is written wherever it takes no copies of vertices, and named where it would.
#[test]
fn repair_keeps_what_takes_no_copies_of_vertices() {
    let folder = Folder::with(&[]);
    // Two triangles that share a vertex and nothing else, each in a group of its own; texture
    // coordinates have a seam there, normals have none.
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 0\n\
               vt 0 0\nvt 1 0\nvt 0 1\nvt 0.5 0.5\nvn 0 0 1\n\
               g a\nf 1/1/1 2/2/1 3/3/1\ng b\nf 1/4/1 4/2/1 5/3/1\n";
    // A third across an edge, so that one edge is of three faces and the seam lies beside the cut.
    let obj = format!("{obj}v 0 0 1\ng a\nf 1/1/1 2/2/1 6/3/1\ng b\nf 2/2/1 1/1/1 5/3/1\n");
    fs::write(folder.0.path().join("in.obj"), obj).unwrap();
    let carried = |name: &str| {
        let mesh = folder.mesh(name);
        let kinds: Vec<Kind> = mesh.attributes().channels.iter().map(|c| c.kind).collect();
        (
            mesh.positions().len(),
            kinds,
            mesh.attributes().groups.len(),
        )
    };
    let all = vec![Kind::TextureCoordinate, Kind::Normal];
    for (output, kinds, groups, note) in [
        ("out.obj", &all, 2, ""),
        ("out.ply", &all, 2, ""),
        (
            "out.glb",
            &vec![Kind::Normal],
            1,
            "copies of vertices for texture",
        ),
        ("out.off", &vec![], 0, ""),
    ] {
        let ran = folder.run(&format!("repair in.obj -o {output} --cut"));
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        assert!(ran.stderr.contains(note), "{output}: {}", ran.stderr);
        assert_eq!(
            ran.stderr.contains("copies of vertices"),
            !note.is_empty(),
            "{}",
            ran.stderr
        );
        let (vertices, found, found_groups) = carried(output);
        let vertices_out =
            folder.report("repair in.obj -o again.obj --cut")["vertices_out"].clone();
        assert_eq!(vertices_out, vertices, "{output}");
        let has_all = kinds.iter().all(|kind| found.contains(kind));
        assert!(has_all && found.len() == kinds.len(), "{output}: {found:?}");
        assert!(
            found_groups.max(1) == groups.max(1),
            "{output}: {found_groups} groups"
        );
    }
}

/// The summary goes to people; what cannot be done is said before the input is read.
#[test]
fn repair_says_what_it_did_or_why_not() {
    let folder = Folder::with(&["bow_tie.obj"]);
    let ran = folder.run("repair bow_tie.obj -o out.ply --cut");
    assert_eq!((ran.status, ran.stdout.len()), (0, 0));
    assert!(
        ran.stderr.contains("1 vertices copied (7 -> 8)"),
        "{}",
        ran.stderr
    );
    assert!(
        ran.stderr.contains("non-manifold vertices 1 -> 0"),
        "{}",
        ran.stderr
    );
    let ran = folder.run("repair bow_tie.obj -o out.ply --cut --quiet");
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    let before = folder.names();
    for (arguments, needle) in [
        ("missing.ply -o other.ply", "--cut"),
        ("missing.ply -o other.stl --cut", "STL"),
        ("missing.ply -o other.xyz --cut", "extension"),
        (
            "missing.ply -o - --output-format off --cut --report -",
            "standard output",
        ),
        (
            "bow_tie.obj -o other.ply --cut --report bow_tie.obj",
            "overwrite",
        ),
    ] {
        folder.run(&format!("repair {arguments}")).failed(2, needle);
    }
    folder
        .run("repair missing.ply -o other.ply --cut")
        .failed(1, "missing.ply");
    assert_eq!(folder.names(), before);
}

/// The table for people has the numbers of the JSON.
#[test]
fn info_is_a_table_too() {
    let folder = Folder::with(&["three_fins.obj"]);
    let ran = folder.run("info three_fins.obj");
    assert_eq!(ran.status, 0);
    let text = String::from_utf8(ran.stdout).unwrap();
    for (name, value) in [
        ("vertices", "5"),
        ("triangles", "3"),
        ("boundary edges", "6"),
        ("non-manifold edges", "1"),
        ("non-manifold vertices", "2"),
        ("Euler characteristic", "1"),
        ("genus", "-"),
    ] {
        let row = text.lines().find(|line| line.starts_with(name));
        let row = row.unwrap_or_else(|| panic!("no row {name} in\n{text}"));
        assert_eq!(row[name.len()..].trim(), value, "{name}");
    }
}

/// The bytes of the paper's Table 1 and of the chapter beside those measured, on a mesh with a boundary;
/// on one with a non-manifold edge a reason where the paper's table says no.
#[test]
fn structures_measures_the_papers_table() {
    let folder = Folder::with(&["three_fins.obj"]);
    folder.write_mesh("hill.ply", &hill(60));
    let json = |arguments: &str| -> Value {
        let ran = folder.run(&format!("structures --json {arguments}"));
        assert_eq!(ran.status, 0, "{arguments}: {}", ran.stderr);
        serde_json::from_slice(&ran.stdout).unwrap()
    };
    let hill = json("hill.ply");
    for (key, value) in [
        ("face", Value::from("triangle")),
        ("faces", 7200.into()),
        ("vertices", 3721.into()),
        ("boundary_edges", 240.into()),
        ("non_manifold_edges", 0.into()),
    ] {
        assert_eq!(hill[key], value, "{key}");
    }
    let rows = hill["structures"].as_array().unwrap();
    for (row, (name, of_triangle, of_vertex)) in rows.iter().zip([
        ("individual triangles", Some(36), Some(72)),
        ("shared vertex", Some(18), Some(36)),
        ("shared vertex with neighbours", Some(32), Some(64)),
        ("winged-edge", Some(60), Some(120)),
        ("quad-edge", None, None),
        ("half-edge, all references", None, Some(144)),
        ("half-edge, paired opposites", None, Some(96)),
        ("full directed-edge", Some(68), None),
        ("medium directed-edge", Some(44), None),
        ("small directed-edge", Some(32), Some(64)),
    ]) {
        assert_eq!(row["structure"], name);
        assert_eq!(row["bytes_per_triangle_stated"], Value::from(of_triangle));
        assert_eq!(row["bytes_per_vertex_stated"], Value::from(of_vertex));
        let (found, limit) = (
            &row["bytes_per_triangle"],
            &row["bytes_per_triangle_formula"],
        );
        let ratio = found.as_f64().unwrap() / limit.as_f64().unwrap();
        // A boundary of 240 edges has more vertices and edges to a triangle.
        assert!((1.0..1.04).contains(&ratio), "{name}: {ratio}");
        assert!(row["construct_ns_per_triangle"].as_f64().unwrap() > 0.0);
        assert!((0.0..1.0).contains(&row["redundancy_share"].as_f64().unwrap()));
        let queries = row["queries"].as_object().unwrap();
        assert_eq!(queries.len(), 8);
        assert!(
            queries.values().all(|q| q["ns"].as_f64().unwrap() > 0.0),
            "{name}"
        );
        let is_searched = row["neighbourhood"] == "-";
        assert_eq!(
            queries["vertex_faces"]["cost"] == "search",
            is_searched,
            "{name}"
        );
        assert_eq!(row["edge_flip_ns"].is_null(), is_searched, "{name}");
    }
    assert_eq!(rows.len(), 10);

    let fins = json("three_fins.obj");
    for row in fins["structures"].as_array().unwrap() {
        let carries = row["carries_non_manifold"] == true;
        assert_eq!(row["cannot_carry"].is_null(), carries, "{row}");
        assert_eq!(row["bytes"].is_null(), !carries, "{row}");
    }
}

/// A file of quads is measured as such, whatever its format; one triangle more, and it is not.
#[test]
fn structures_takes_quads_as_they_are() {
    let folder = Folder::with(&["cube_quads.obj"]);
    let corners = "0 0 0\n1 0 0\n2 0 0\n0 1 0\n1 1 0\n2 1 0\n";
    let ply = format!(
        "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n\
         element face 2\nproperty list uchar int vertex_indices\nend_header\n{corners}4 0 1 4 3\n4 1 2 5 4\n"
    );
    folder.write("two.ply", &ply);
    folder.write(
        "two.off",
        &format!("OFF 6 2 0\n{corners}4 0 1 4 3\n4 1 2 5 4\n"),
    );
    folder.write(
        "mixed.off",
        &format!("OFF 6 2 0\n{corners}4 0 1 4 3\n3 1 2 5\n"),
    );
    for (mesh, face, faces, edges, boundary) in [
        ("cube_quads.obj", "quad", 6, 12, 0),
        ("two.ply", "quad", 2, 7, 6),
        ("two.off", "quad", 2, 7, 6),
        ("mixed.off", "triangle", 3, 8, 7),
    ] {
        let ran = folder.run(&format!("structures {mesh} --json"));
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        let measured: Value = serde_json::from_slice(&ran.stdout).unwrap();
        assert_eq!(measured["face"], face, "{mesh}");
        for (key, value) in [
            ("faces", faces),
            ("edges", edges),
            ("boundary_edges", boundary),
        ] {
            assert_eq!(measured[key], value, "{mesh}: {key}");
        }
        if face == "quad" {
            let row = &measured["structures"][0];
            assert_eq!(row["bytes_per_quad_formula"], 48.0, "{mesh}");
            let bytes = 16 * measured["vertices"].as_u64().unwrap() + 32 * faces as u64;
            assert_eq!(row["bytes"], bytes, "{mesh}");
            assert!(row["construct_ns_per_quad"].as_f64().unwrap() > 0.0);
        }
    }
    let ran = folder.run("structures cube_quads.obj");
    let text = String::from_utf8(ran.stdout).unwrap();
    assert!(
        text.starts_with("6 quads, 8 vertices, 12 edges (0 boundary, 0 non-manifold)\n"),
        "{text}"
    );
}

/// The tables for people have a row a structure, and say why one is empty.
#[test]
fn structures_is_a_table_too() {
    let folder = Folder::with(&["three_fins.obj", "tetrahedron.off"]);
    let text = |mesh: &str| {
        let ran = folder.run(&format!("structures {mesh}"));
        assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
        String::from_utf8(ran.stdout).unwrap()
    };
    let fins = text("three_fins.obj");
    for name in [
        "individual triangles ",
        "winged-edge ",
        "small directed-edge ",
    ] {
        assert_eq!(
            fins.lines().filter(|line| line.starts_with(name)).count(),
            2 + usize::from(name == "winged-edge "),
            "{fins}"
        );
    }
    let why = "winged-edge cannot carry it: the edge between vertices 0 and 1 has 3 faces, one or two fit";
    assert!(fins.contains(why), "{fins}");
    // 16 bytes a vertex and 24 a face: 40 a face where there are as many.
    let tetrahedron = text("tetrahedron.off");
    let row = tetrahedron
        .lines()
        .find(|line| line.starts_with("small directed-edge"));
    let cells: Vec<&str> = row.unwrap().split_whitespace().collect();
    assert_eq!(
        cells[2..],
        [
            "40.0", "32.0", "32", "40.0", "64.0", "64", "40", "%", "yes", "M", "M,C", "C", "C"
        ]
    );
    assert!(!tetrahedron.contains("cannot"), "{tetrahedron}");
    folder
        .run("structures missing.ply")
        .failed(1, "missing.ply");
}

/// Every invariant after every collapse, in each tier; and checking changes nothing.
#[test]
fn check_passes() {
    let folder = Folder::with_hill();
    folder.run("hill.ply -o out.ply --ratio 0.02");
    let unchecked = folder.bytes("out.ply");
    for tier in ["full", "medium", "small"] {
        let ran = folder.run(&format!(
            "hill.ply -o out.ply --ratio 0.02 --check --tier {tier}"
        ));
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        assert!(folder.bytes("out.ply") == unchecked, "{tier}");
    }
}

/// What people get wrong first: which fraction `--ratio` is, and what `--max-error` promises.
#[test]
fn help_says_what_ratio_and_max_error_mean() {
    let folder = Folder::with(&[]);
    let ran = folder.run("--help");
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    let help = String::from_utf8(ran.stdout).unwrap();
    // Lines are wrapped to the terminal: compare words.
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let help = words(&help);
    for phrase in [
        "fraction of the triangles to KEEP",
        "An estimate, not a bound",
        "in model units",
        "3 stopped short under --strict",
        "decimate info MESH",
        "decimate structures MESH",
    ] {
        assert!(help.contains(phrase), "no {phrase:?} in {help}");
    }
    let version = folder.run("--version");
    let expected = format!("decimate {}\n", env!("CARGO_PKG_VERSION"));
    assert_eq!(String::from_utf8(version.stdout).unwrap(), expected);
}

/// Each value of the options that choose a surface is taken, and does something.
#[test]
fn surface_options_are_accepted() {
    let folder = Folder::with(&["sample.ply"]);
    folder.run("sample.ply -o standard.ply --ratio 0.05");
    for arguments in [
        "--quality fast",
        "--quality best",
        "--topology simplify",
        "--feature-angle 30",
    ] {
        let ran = folder.run(&format!("sample.ply -o out.ply --ratio 0.05 {arguments}"));
        assert_eq!(ran.status, 0, "{arguments}: {}", ran.stderr);
        let triangles = folder.mesh("out.ply").triangle_count();
        assert!(
            (4996..=4998).contains(&triangles),
            "{arguments}: {triangles}"
        );
        let is_standard = folder.bytes("out.ply") == folder.bytes("standard.ply");
        // The sample has nothing that topology stands in the way of.
        assert_eq!(
            is_standard,
            arguments == "--topology simplify",
            "{arguments}"
        );
    }
    folder.run("sample.ply -o out.ply --ratio 0.05 --quality standard --topology preserve");
    assert!(folder.bytes("out.ply") == folder.bytes("standard.ply"));
}

/// What cannot be read is named by its flag, what cannot be meant by its name, the value with it.
#[test]
fn wrong_surface_options_are_named() {
    let folder = Folder::with_hill();
    for (flag, value, needle) in [
        ("--quality", "worst", "'worst' for '--quality"),
        ("--topology", "destroy", "'destroy' for '--topology"),
        ("--feature-angle", "sharp", "'sharp' for '--feature-angle"),
        ("--feature-angle", "-5", "feature angle -5"),
        ("--feature-angle", "720", "feature angle 720"),
        ("--feature-angle", "nan", "feature angle NaN"),
    ] {
        let arguments = format!("hill.ply -o out.ply --ratio 0.5 {flag} {value}");
        folder.run(&arguments).failed(2, needle);
    }
    assert!(!folder.names().contains("out.ply"));
}

/// A cube whose edges are all sharp in its normals has nothing to collapse, which is said with the way
/// out; to a format without normals they are no hindrance.
#[test]
fn normals_hold_a_cube_where_they_can_be_written() {
    let folder = Folder::with(&[]);
    let cube: String = (0..8)
        .map(|i| format!("v {} {} {}\n", i & 1, i >> 1 & 1, i >> 2))
        .collect();
    let normals = "vn 0 0 -1\nvn 0 0 1\nvn 0 -1 0\nvn 0 1 0\nvn -1 0 0\nvn 1 0 0\n";
    let faces = [
        "1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6",
    ];
    let face = |(i, corners): (usize, &str)| {
        let corners = corners.split(' ').map(|v| format!(" {v}//{}", i + 1));
        format!("f{}\n", corners.collect::<String>())
    };
    let faces: String = faces.into_iter().enumerate().map(face).collect();
    folder.write("cube.obj", &format!("{cube}{normals}{faces}"));
    let kept = folder.run("cube.obj -o kept.ply --triangles 6");
    assert!(
        kept.stderr.contains("12 -> 12 triangles"),
        "{}",
        kept.stderr
    );
    let hint = "attribute seams and borders of materials are kept (12 edges)";
    assert!(kept.stderr.contains(hint), "{}", kept.stderr);
    let free = folder.run("cube.obj -o free.stl --triangles 6");
    assert!(free.stderr.contains("12 -> 6 triangles"), "{}", free.stderr);
    let note = "note: stl has no place for normals";
    assert!(free.stderr.contains(note), "{}", free.stderr);
    let smeared = folder.run("cube.obj -o smeared.ply --triangles 6 --attributes carry");
    assert!(
        smeared.stderr.contains("12 -> 6 triangles"),
        "{}",
        smeared.stderr
    );
}
