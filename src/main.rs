//! The `decimate` command: parse, read, decimate, write, report. The only place that prints and
//! exits.

mod cli;
mod text;

use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser};
use decimate::decimate::{AttributeUse, decimate_with_progress, peak_rss_bytes};
use decimate::error::Error;
use decimate::io::{self, Format, ReadOptions, WriteOptions};
use decimate::metrics::{CompareOptions, Reference, info, info_of_file};
use decimate::repair;
use decimate::structures::measure_polygons;
use indicatif::{ProgressBar, ProgressStyle};
use peak_alloc::PeakAlloc;
use serde::Serialize;

use cli::{Cli, Command, CompareArgs, InfoArgs, RepairArgs, Run, StructuresArgs};
use text::Compared;

/// Counts what is allocated, for the report.
#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

/// Exit status of a run that stopped short under `--strict`.
const STOPPED_SHORT: u8 = 3;

/// Exit status after Ctrl-C, as shells have it: 128 and the signal's number.
const INTERRUPTED: i32 = 130;

fn main() -> ExitCode {
    let cli = Cli::parse();
    let done = match &cli.command {
        Some(Command::Info(args)) => show_info(args),
        Some(Command::Compare(args)) => show_comparison(args),
        Some(Command::Repair(args)) => run_repair(args),
        Some(Command::Structures(args)) => show_structures(args),
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
    use_threads(args.threads)?;
    leave_nothing_half_written();
    check_report(args.report.as_deref(), input, output)?;
    let mut options = args.options();
    options.check()?;
    let write_options = WriteOptions {
        format: args.output_format,
        ascii: args.ascii,
        precision: args.precision.map(usize::from),
    };
    let output_format = io::output_format(output, &write_options)?;
    io::check_place(output)?;

    let start = Instant::now();
    let read_options = ReadOptions {
        format: args.input_format,
        vertex_weight: args.vertex_weight.clone(),
        attributes: args.attributes != cli::AttributesArg::Ignore,
    };
    let bar = progress_bar(args.quiet);
    bar.set_message("reading");
    let mesh = io::read(input, &read_options)?;
    bar.suspend(|| note(args.quiet, &mesh.attributes().notices));
    if !output_format.carries_attributes() {
        // What has no place in the output does not shape it either.
        bar.suspend(|| note(args.quiet, &io::cannot_carry(&mesh, output_format)));
        options.attributes = AttributeUse::Ignore;
    }
    let read_seconds = start.elapsed().as_secs_f64();

    let (mesh, mut report) = decimate_with_progress(mesh, &options, &mut |progress| {
        bar.set_message(progress.stage.name());
        bar.set_position((progress.fraction * BAR_STEPS as f64) as u64);
        ControlFlow::Continue(())
    })
    .map_err(|error| name_mesh(error, input))?;

    let start = Instant::now();
    bar.suspend(|| note(args.quiet, &io::cannot_carry(&mesh, output_format)));
    bar.set_message("writing");
    io::write(output, &mesh, &write_options)?;
    bar.finish_and_clear();
    report.read_seconds = read_seconds;
    report.write_seconds = start.elapsed().as_secs_f64();
    report.peak_heap_bytes = Some(HEAP.peak_usage() as u64);
    report.peak_rss_bytes = peak_rss_bytes();
    if let Some(path) = &args.report {
        write_json(path, &report)?;
    }
    if !args.quiet {
        eprint!("{}", text::summary(input, output, &report));
    }
    let is_failure = args.strict && report.stopped_short;
    Ok(if is_failure {
        ExitCode::from(STOPPED_SHORT)
    } else {
        ExitCode::SUCCESS
    })
}

fn show_info(args: &InfoArgs) -> Result<ExitCode, Error> {
    let read_options = ReadOptions {
        format: args.input_format,
        attributes: false,
        ..ReadOptions::default()
    };
    let mesh = io::read(&args.mesh, &read_options)?;
    let info = if args.no_weld {
        info(mesh, false)
    } else {
        info_of_file(mesh)
    }
    .map_err(|error| name_mesh(error, &args.mesh))?;
    if args.json {
        write_json(Path::new("-"), &info)?;
    } else {
        io::write_file(Path::new("-"), |out| {
            out.write_all(text::info(&info).as_bytes())
        })?;
    }
    Ok(ExitCode::SUCCESS)
}

fn run_repair(args: &RepairArgs) -> Result<ExitCode, Error> {
    if !args.cut {
        return Err(Error::InvalidOptions(
            "nothing to repair is named; --cut is expected".into(),
        ));
    }
    leave_nothing_half_written();
    let (input, output) = (&args.input, &args.output);
    check_report(args.report.as_deref(), input, output)?;
    let write_options = WriteOptions {
        format: args.output_format,
        ascii: args.ascii,
        precision: args.precision.map(usize::from),
    };
    let output_format = io::output_format(output, &write_options)?;
    if output_format == Format::Stl {
        return Err(Error::InvalidOptions(
            "in STL faces share no vertices, a cut would be lost; another format is expected"
                .into(),
        ));
    }
    io::check_place(output)?;
    let read_options = ReadOptions {
        format: args.input_format,
        attributes: output_format.carries_attributes(),
        ..ReadOptions::default()
    };
    let mesh = io::read(input, &read_options)?;
    note(args.quiet, &mesh.attributes().notices);
    let (mesh, report) =
        repair::cut(mesh, !args.no_weld).map_err(|error| name_mesh(error, input))?;
    let (mesh, lost) = io::without_copies(mesh, output_format);
    note(args.quiet, &lost);
    note(args.quiet, &io::cannot_carry(&mesh, output_format));
    io::write(output, &mesh, &write_options)?;
    if let Some(path) = &args.report {
        write_json(path, &report)?;
    }
    if !args.quiet {
        eprint!("{}", text::repair(input, output, &report));
    }
    Ok(ExitCode::SUCCESS)
}

fn show_comparison(args: &CompareArgs) -> Result<ExitCode, Error> {
    use_threads(args.threads)?;
    let name = |error| name_mesh(error, &args.reference);
    let read_options = ReadOptions {
        attributes: args.attributes,
        ..ReadOptions::default()
    };
    let read = |path| io::read(path, &read_options);
    let reference = Reference::new(read(&args.reference)?).map_err(name)?;
    let options = CompareOptions {
        samples: args.samples,
        intersections: args.intersections,
    };
    let mut compared = Vec::new();
    for path in &args.meshes {
        let comparison = reference
            .compare(read(path)?, &options)
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
            out.write_all(text::comparison(&compared).as_bytes())
        })?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Says what a file holds that the mesh or the next file does not.
fn note(quiet: bool, notices: &[String]) {
    for notice in notices.iter().filter(|_| !quiet) {
        eprintln!("note: {notice}");
    }
}

/// Refuses a report that would be written where a mesh is, or could not be written at all.
fn check_report(report: Option<&Path>, input: &Path, output: &Path) -> Result<(), Error> {
    let Some(report) = report else { return Ok(()) };
    if report == Path::new("-") && output == Path::new("-") {
        return Err(Error::InvalidOptions(
            "-o - and --report - would both write to standard output".into(),
        ));
    }
    for other in [input, output] {
        if is_same_file(report, other) {
            return Err(Error::InvalidOptions(format!(
                "--report {} would overwrite the mesh of that name",
                report.display()
            )));
        }
    }
    io::check_place(report)
}

fn show_structures(args: &StructuresArgs) -> Result<ExitCode, Error> {
    let read_options = ReadOptions {
        format: args.input_format,
        ..ReadOptions::default()
    };
    let mesh = io::read_polygons(&args.mesh, &read_options)?;
    let measured = measure_polygons(mesh).map_err(|error| name_mesh(error, &args.mesh))?;
    if args.json {
        write_json(Path::new("-"), &measured)?;
    } else {
        io::write_file(Path::new("-"), |out| {
            out.write_all(text::structures(&measured).as_bytes())
        })?;
    }
    Ok(ExitCode::SUCCESS)
}

/// From here on an interrupt (Ctrl-C, or the system's request to end) ends the command at once,
/// whatever it is doing, and deletes what is half written.
fn leave_nothing_half_written() {
    // Where the caller has one of these signals ignored, as nohup does, all stay as they are.
    let _ = ctrlc::try_set_handler(|| {
        // Held until the end, so that no other file is begun.
        let _abandoned = io::abandon_unfinished();
        eprintln!("error: interrupted");
        std::process::exit(INTERRUPTED);
    });
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

/// The steps of a full bar: a tenth of a percent.
const BAR_STEPS: u64 = 1000;

/// Where a terminal shows it, a bar with the stage at work.
fn progress_bar(quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(BAR_STEPS);
    let style = "{bar:40} {percent:>3}%  {msg}, {elapsed}, {eta} left";
    bar.set_style(ProgressStyle::with_template(style).unwrap_or(ProgressStyle::default_bar()));
    bar.enable_steady_tick(Duration::from_millis(200));
    bar
}

fn write_json(path: &Path, value: &impl Serialize) -> Result<(), Error> {
    let mut text = serde_json::to_string_pretty(value)
        .map_err(|error| Error::Internal(format!("cannot write JSON: {error}")))?;
    text.push('\n');
    io::write_file(path, |file| file.write_all(text.as_bytes()))
}
