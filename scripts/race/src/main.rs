//! The `race` program: times simplifiers on meshes and makes such meshes. The only place that prints
//! and exits.

mod against;
mod attributed;
mod cli;
mod fast_simplification;
mod generate;
mod measure;
mod meshoptimizer;
mod random;
mod shuffle;
mod subdivide;
mod table;

use std::path::Path;
use std::process::ExitCode;

use clap::Parser;
use decimate::error::{Error, Result};
use decimate::indexed_mesh::IndexedMesh;
use decimate::io::{self, ReadOptions, WriteOptions};

use against::{Case, Contest};
use attributed::AttributedArrays;
use cli::{AgainstArgs, AttributesArgs, Cli, Command, GenerateArgs, ShuffleArgs, SimplifyArgs};
use measure::{Measured, measure};
use subdivide::subdivide;

fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Simplify(args) => simplify(&args),
        Command::Attributes(args) => simplify_attributed(&args),
        Command::Against(args) => race(&args),
        Command::Generate(args) => generate(&args),
        Command::Shuffle(args) => shuffle(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn simplify(args: &SimplifyArgs) -> Result<()> {
    let mut arrays = meshoptimizer::Arrays::from(&read(&args.mesh)?);
    let ((), measured) = measure(|| arrays.simplify_with_update(args.triangles));
    write(&args.output, &arrays.into_mesh()?)?;
    print_measured(&measured);
    Ok(())
}

fn simplify_attributed(args: &AttributesArgs) -> Result<()> {
    let mut arrays = AttributedArrays::of(io::read(&args.mesh, &ReadOptions::default())?)?;
    let ((), measured) = measure(|| arrays.simplify(args.triangles, args.method));
    write(&args.output, &arrays.into_mesh()?)?;
    print_measured(&measured);
    Ok(())
}

fn print_measured(measured: &Measured) {
    let numbers = serde_json::to_string(measured).expect("two numbers are JSON");
    println!("{numbers}");
}

fn race(args: &AgainstArgs) -> Result<()> {
    let settings = against::settings(args)?;
    let python = args.fast_simplification.as_ref();
    let mut cases = Vec::new();
    println!("{}", table::head(python.is_some()));
    for path in &args.meshes {
        let contest = Contest::new(path, &settings, python)?;
        for &ratio in &args.ratios {
            let case = contest.run(ratio, args.runs)?;
            print!("{}", table::Rows(&case));
            cases.push(case);
        }
    }
    args.json
        .as_ref()
        .map_or(Ok(()), |path| write_json(path, &cases))
}

fn write_json(path: &Path, cases: &[Case]) -> Result<()> {
    let text = serde_json::to_string_pretty(cases).expect("names and numbers are JSON");
    std::fs::write(path, text + "\n").map_err(|source| Error::Io {
        path: path.into(),
        action: "cannot write",
        source,
    })
}

fn generate(args: &GenerateArgs) -> Result<()> {
    write(
        &args.output,
        &args.kind.generate(args.triangles as usize, args.seed)?,
    )
}

fn shuffle(args: &ShuffleArgs) -> Result<()> {
    let mesh = (0..args.subdivide).try_fold(read(&args.mesh)?, |mesh, _| subdivide(mesh))?;
    write(&args.output, &shuffle::shuffle(&mesh, args.seed)?)
}

/// Positions and triangles alone: what the others are given.
fn read(path: &Path) -> Result<IndexedMesh> {
    let options = ReadOptions {
        attributes: false,
        ..ReadOptions::default()
    };
    io::read(path, &options)
}

fn write(path: &Path, mesh: &IndexedMesh) -> Result<()> {
    io::write(path, mesh, &WriteOptions::default())?;
    eprintln!("{}: {} triangles", path.display(), mesh.triangle_count());
    Ok(())
}
