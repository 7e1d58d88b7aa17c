//! The `race` program: calls a simplifier on a mesh file and prints what the call took. The only
//! place that prints and exits.

mod measure;
mod meshoptimizer;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};
use decimate::error::Result;
use decimate::io::{self, ReadOptions, WriteOptions};

use measure::{Measured, measure};

/// Measures calls of simplifiers that are linked in.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Simplifies with meshoptimizer's simplifyWithUpdate and prints the seconds and megabytes of
    /// the call alone as JSON.
    Simplify(SimplifyArgs),
}

#[derive(Debug, Args)]
struct SimplifyArgs {
    /// The mesh, welded already: PLY, OBJ, STL or OFF.
    mesh: PathBuf,
    /// How many triangles to keep.
    triangles: usize,
    /// Where the result goes, without the vertices that no triangle uses.
    #[arg(value_name = "OUT.ply")]
    output: PathBuf,
}

fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Simplify(args) => simplify(&args.mesh, args.triangles, &args.output),
    };
    match done {
        Ok(measured) => {
            let numbers = serde_json::to_string(&measured).expect("two numbers are JSON");
            println!("{numbers}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn simplify(mesh: &Path, triangles: usize, output: &Path) -> Result<Measured> {
    let mut arrays = meshoptimizer::Arrays::from(io::read(mesh, &ReadOptions::default())?);
    let ((), measured) = measure(|| arrays.simplify_with_update(triangles));
    io::write(output, &arrays.into_mesh()?, &WriteOptions::default())?;
    Ok(measured)
}
