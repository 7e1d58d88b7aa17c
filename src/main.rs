//! The `decimate` command: parse, read, decimate, write, report. The only place that prints and
//! exits.

mod cli;

use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser};
use decimate::decimate::{Progress, Report, StopReason, decimate_with_progress, peak_rss_bytes};
use decimate::error::Error;
use decimate::io::{self, WriteOptions};
use decimate::metrics::{CompareOptions, Comparison, Info, Reference, TwoSided, info};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use cli::{Cli, Command, CompareArgs, InfoArgs, Run};

/// Exit status of a run that stopped short under `--strict`.
const STOPPED_SHORT: u8 = 3;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match &cli.command {
        Some(Command::Info(args)) => show_info(args),
        Some(Command::Compare(args)) => show_comparison(args),
        None => run(&cli.run),
    };
    done.unwrap_or_else(|error| {
        if let Error::InvalidOptions(message) = error {
            Cli::command()
                .error(ErrorKind::ValueValidation, message)
                .exit();
        }
        eprintln!("error: {error}");
        ExitCode::FAILURE
    })
}

fn run(args: &Run) -> Result<ExitCode, Error> {
    let (Some(input), Some(output)) = (&args.input, &args.output) else {
        unreachable!("the command line requires both");
    };
    let report_to_stdout = args.report.as_deref() == Some(Path::new("-"));
    if report_to_stdout && output == Path::new("-") {
        return Err(Error::InvalidOptions(
            "-o - and --report - would both write to standard output".into(),
        ));
    }
    use_threads(args.threads)?;
    if let Some(report) = &args.report {
        for other in [input, output] {
            if is_same_file(report, other) {
                return Err(Error::InvalidOptions(format!(
                    "--report {} would overwrite the mesh of that name",
                    report.display()
                )));
            }
        }
        io::check_place(report)?;
    }
    let options = args.options();
    options.targets.triangles_of(0)?;
    let write_options = WriteOptions {
        format: args.output_format,
        ascii: args.ascii,
        precision: args.precision.map(usize::from),
    };
    io::output_format(output, &write_options)?;
    io::check_place(output)?;

    let start = Instant::now();
    let mesh = io::read(input, args.input_format)?;
    let read_seconds = start.elapsed().as_secs_f64();

    let bar = progress_bar(args.quiet);
    let (mesh, mut report) = decimate_with_progress(mesh, &options, &mut |progress| {
        advance(&bar, progress);
        ControlFlow::Continue(())
    })
    .map_err(|error| name_mesh(error, input))?;
    bar.finish_and_clear();

    let start = Instant::now();
    io::write(output, &mesh, &write_options)?;
    report.read_seconds = read_seconds;
    report.write_seconds = start.elapsed().as_secs_f64();
    report.peak_rss_bytes = peak_rss_bytes();
    if let Some(path) = &args.report {
        write_json(path, &report)?;
    }
    if !args.quiet {
        eprint!("{}", summary(input, output, &report));
    }
    let is_failure = args.strict && report.stopped_short;
    Ok(if is_failure {
        ExitCode::from(STOPPED_SHORT)
    } else {
        ExitCode::SUCCESS
    })
}

fn show_info(args: &InfoArgs) -> Result<ExitCode, Error> {
    let mesh = io::read(&args.mesh, args.input_format)?;
    let info = info(mesh, !args.no_weld).map_err(|error| name_mesh(error, &args.mesh))?;
    if args.json {
        write_json(Path::new("-"), &info)?;
    } else {
        io::write_file(Path::new("-"), |out| out.write_all(table(&info).as_bytes()))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A mesh held against the reference, with the names of both files.
#[derive(Serialize)]
struct Compared {
    reference_file: String,
    mesh_file: String,
    #[serde(flatten)]
    comparison: Comparison,
}

fn show_comparison(args: &CompareArgs) -> Result<ExitCode, Error> {
    use_threads(args.threads)?;
    let name = |error| name_mesh(error, &args.reference);
    let reference = Reference::new(io::read(&args.reference, None)?).map_err(name)?;
    let options = CompareOptions {
        samples: args.samples,
        intersections: args.intersections,
    };
    let mut compared = Vec::new();
    for path in &args.meshes {
        let comparison = reference
            .compare(io::read(path, None)?, &options)
            .map_err(|error| name_mesh(error, path))?;
        compared.push(Compared {
            reference_file: args.reference.display().to_string(),
            mesh_file: path.display().to_string(),
            comparison,
        });
    }
    if args.json {
        write_json(Path::new("-"), &compared)?;
    } else {
        io::write_file(Path::new("-"), |out| {
            out.write_all(comparison_table(&compared).as_bytes())
        })?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Sets the number of threads; more than eight a processor would only cost their stacks.
fn use_threads(threads: Option<usize>) -> Result<(), Error> {
    let Some(threads) = threads else {
        return Ok(());
    };
    let processors = std::thread::available_parallelism().map_or(1, usize::from);
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.min(8 * processors))
        .build_global()
        .map_err(|error| Error::InvalidOptions(format!("--threads {threads}: {error}")))
}

/// Whether two paths name one file; neither need be there yet.
fn is_same_file(a: &Path, b: &Path) -> bool {
    let place = |path: &Path| {
        path.canonicalize().ok().or_else(|| {
            let folder = path.parent().filter(|p| *p != Path::new(""));
            let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok()?;
            Some(folder.join(path.file_name()?))
        })
    };
    a != Path::new("-") && place(a).is_some_and(|a| place(b) == Some(a))
}

/// An error about a mesh, with the name of the file it came from.
fn name_mesh(error: Error, input: &Path) -> Error {
    match error {
        Error::InvalidMesh(message) => {
            Error::InvalidMesh(format!("{}: {message}", input.display()))
        }
        other => other,
    }
}

fn progress_bar(quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(0);
    let style =
        "{bar:40} {percent:>3}%  {human_pos}/{human_len} triangles removed, {per_sec}, {eta} left";
    bar.set_style(ProgressStyle::with_template(style).unwrap_or(ProgressStyle::default_bar()));
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

fn advance(bar: &ProgressBar, progress: Progress) {
    bar.set_length((progress.triangles_start - progress.triangles_target) as u64);
    bar.set_position((progress.triangles_start - progress.triangles) as u64);
}

fn write_json(path: &Path, value: &impl Serialize) -> Result<(), Error> {
    let mut text = serde_json::to_string_pretty(value)
        .map_err(|error| Error::Internal(format!("cannot write JSON: {error}")))?;
    text.push('\n');
    io::write_file(path, |file| file.write_all(text.as_bytes()))
}

/// What was done, in a few lines for a person.
fn summary(input: &Path, output: &Path, report: &Report) -> String {
    let Report {
        triangles_in,
        triangles_out,
        cleaning,
        ..
    } = report;
    let seconds = report.read_seconds
        + report.clean_seconds
        + report.build_seconds
        + report.decimate_seconds
        + report.write_seconds;
    let percent = 100.0 * *triangles_out as f64 / *triangles_in as f64;
    let mut text = format!(
        "{} -> {}: {triangles_in} -> {triangles_out} triangles ({percent:.1} %) in {seconds:.2} s, \
         estimated error {:.3e}\n{} tier: {}\n",
        input.display(),
        output.display(),
        report.max_error_estimate,
        report.tier.name(),
        report.tier_reason,
    );
    let found: Vec<String> = [
        (cleaning.welded_vertices, "vertices welded"),
        (
            cleaning.dropped_isolated_vertices,
            "isolated vertices dropped",
        ),
        (
            cleaning.dropped_non_finite_faces,
            "faces with coordinates that are not finite dropped",
        ),
        (
            cleaning.dropped_degenerate_faces,
            "faces with a repeated vertex dropped",
        ),
        (cleaning.dropped_duplicate_faces, "duplicate faces dropped"),
        (cleaning.folded_faces, "opposite faces folded"),
        (report.non_manifold_edges_in, "non-manifold edges"),
        (
            report.reoriented_faces,
            "faces run against their neighbours",
        ),
    ]
    .into_iter()
    .filter(|(count, _)| *count > 0)
    .map(|(count, what)| format!("{count} {what}"))
    .collect();
    if !found.is_empty() {
        text += &format!("found: {}\n", found.join(", "));
    }
    if let Some(blocked) = report.blocked {
        let why = match report.stop_reason {
            StopReason::MaxError => "stopped at the largest error",
            _ if report.stopped_short => "warning: stopped short of the target",
            _ => "no collapse is left",
        };
        text += &format!(
            "{why} ({} asked for); of the edges left, {} would change the topology, {} would turn a \
             face, {} are locked, {} would exceed the largest error\n",
            report.target_triangles, blocked.link, blocked.flip, blocked.lock, blocked.error
        );
    }
    text
}

/// The counts of a mesh as a table.
fn table(info: &Info) -> String {
    let yes_no = |b: bool| String::from(if b { "yes" } else { "no" });
    let cleaning = &info.cleaning;
    let rows = [
        ("vertices", info.vertices.to_string()),
        ("triangles", info.triangles.to_string()),
        ("  welded vertices", cleaning.welded_vertices.to_string()),
        (
            "  isolated vertices",
            cleaning.dropped_isolated_vertices.to_string(),
        ),
        (
            "  faces not finite",
            cleaning.dropped_non_finite_faces.to_string(),
        ),
        (
            "  faces with a repeated vertex",
            cleaning.dropped_degenerate_faces.to_string(),
        ),
        (
            "  duplicate faces",
            cleaning.dropped_duplicate_faces.to_string(),
        ),
        ("  opposite faces folded", cleaning.folded_faces.to_string()),
        ("  kept vertices", cleaning.kept_vertices.to_string()),
        ("  kept faces", cleaning.kept_faces.to_string()),
        ("components", info.components.to_string()),
        ("boundary edges", info.boundary_edges.to_string()),
        ("boundary loops", info.boundary_loops.to_string()),
        ("non-manifold edges", info.non_manifold_edges.to_string()),
        (
            "non-manifold vertices",
            info.non_manifold_vertices.to_string(),
        ),
        (
            "inconsistently oriented edges",
            info.inconsistent_edges.to_string(),
        ),
        ("orientable", yes_no(info.is_orientable)),
        ("zero-area faces", info.zero_area_faces.to_string()),
        (
            "Euler characteristic",
            info.euler_characteristic.to_string(),
        ),
        ("genus", info.genus.map_or("-".into(), |g| g.to_string())),
        ("diagonal (model units)", info.diagonal.to_string()),
        ("full tier (bytes)", info.full_tier_bytes.to_string()),
        ("medium tier (bytes)", info.medium_tier_bytes.to_string()),
        ("small tier (bytes)", info.small_tier_bytes.to_string()),
    ];
    rows.iter()
        .map(|(name, value)| format!("{name:30} {value:>14}\n"))
        .collect()
}

/// Comparisons as a table, a column a mesh. Distances are fractions of the diagonal.
fn comparison_table(compared: &[Compared]) -> String {
    let Some(Compared {
        reference_file,
        comparison,
        ..
    }) = compared.first()
    else {
        return String::new();
    };
    let diagonal = comparison.diagonal;
    let mut text = format!(
        "reference {reference_file}, diagonal {diagonal} model units; distances are fractions of it\n"
    );
    let file_name = |c: &Compared| {
        let name = Path::new(&c.mesh_file).file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    };
    let width = compared
        .iter()
        .map(|c| file_name(c).chars().count())
        .max()
        .unwrap_or(0)
        .max(12);
    let mut row = |name: &str, value: &dyn Fn(&Comparison) -> String| {
        text += &format!("{name:36}");
        for c in compared {
            text += &format!(" {:>width$}", value(&c.comparison));
        }
        text.push('\n');
    };
    let distance =
        |of: fn(&TwoSided) -> f64| move |c: &Comparison| format!("{:.4e}", of(&c.surface));
    let boundary = |of: fn(&TwoSided) -> f64| {
        move |c: &Comparison| {
            c.boundary
                .as_ref()
                .map_or("-".into(), |b| format!("{:.4e}", of(b)))
        }
    };
    row("triangles", &|c| c.mesh.triangles.to_string());
    row("rms", &distance(|d| d.two_sided_of_diagonal.rms));
    row(
        "  from reference",
        &distance(|d| d.from_reference_of_diagonal.rms),
    );
    row("  from mesh", &distance(|d| d.from_mesh_of_diagonal.rms));
    row("mean", &distance(|d| d.two_sided_of_diagonal.mean));
    row(
        "  from reference",
        &distance(|d| d.from_reference_of_diagonal.mean),
    );
    row("  from mesh", &distance(|d| d.from_mesh_of_diagonal.mean));
    row("Hausdorff", &distance(|d| d.two_sided_of_diagonal.max));
    row(
        "  from reference",
        &distance(|d| d.from_reference_of_diagonal.max),
    );
    row("  from mesh", &distance(|d| d.from_mesh_of_diagonal.max));
    row("boundary rms", &boundary(|d| d.two_sided_of_diagonal.rms));
    row(
        "boundary Hausdorff",
        &boundary(|d| d.two_sided_of_diagonal.max),
    );
    row("normal deviation, mean (degrees)", &|c| {
        format!("{:.3}", c.normal_deviation_mean_degrees)
    });
    row("normal deviation, 99 % (degrees)", &|c| {
        format!("{:.3}", c.normal_deviation_99th_percentile_degrees)
    });
    row("triangle quality, mean", &|c| {
        format!("{:.4}", c.triangle_quality_mean)
    });
    row("triangles of quality under 0.05", &|c| {
        format!("{:.2} %", 100.0 * c.sliver_share)
    });
    row("new boundary edges", &|c| c.new_boundary_edges.to_string());
    row("new non-manifold edges", &|c| {
        c.new_non_manifold_edges.to_string()
    });
    row("new non-manifold vertices", &|c| {
        c.new_non_manifold_vertices.to_string()
    });
    row("inconsistently oriented edges", &|c| {
        c.mesh.inconsistent_edges.to_string()
    });
    row("duplicate faces", &|c| {
        (c.mesh.cleaning.dropped_duplicate_faces + c.mesh.cleaning.folded_faces).to_string()
    });
    row("degenerate faces", &|c| {
        (c.mesh.cleaning.dropped_degenerate_faces + c.mesh.zero_area_faces).to_string()
    });
    row("components", &|c| c.mesh.components.to_string());
    row("Euler characteristic", &|c| {
        c.mesh.euler_characteristic.to_string()
    });
    row("intersecting pairs", &|c| {
        c.intersecting_pairs.map_or("-".into(), |n| n.to_string())
    });
    let names = compared
        .iter()
        .map(|c| format!(" {:>width$}", file_name(c)));
    let header = format!("{:36}{}\n", "", names.collect::<String>());
    let first_row = text.find('\n').map_or(0, |end| end + 1);
    text.insert_str(first_row, &header);
    text
}
