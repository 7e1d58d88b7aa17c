//! The arguments of `race`.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use decimate::decimate::{Quality, TierChoice};
use decimate::mesh::Tier;

use crate::generate::Kind;

/// Races `decimate` against simplifiers that are linked in, and makes meshes to race on.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Simplifies with meshoptimizer's simplifyWithUpdate and prints the seconds and megabytes of
    /// the call alone as JSON.
    Simplify(SimplifyArgs),
    /// Simplifies with attributes in the cost, as meshoptimizer does it, and prints the same.
    Attributes(AttributesArgs),
    /// Runs ours and meshoptimizer's simplifyWithUpdate in turns, arrays in and arrays out, and
    /// prints a table of the times.
    Against(AgainstArgs),
    /// Makes a mesh of about so many triangles.
    Generate(GenerateArgs),
    /// Subdivides a mesh and puts its vertices, triangles and corners in a random order.
    Shuffle(ShuffleArgs),
}

/// The arguments of `race simplify`.
#[derive(Debug, Args)]
pub struct SimplifyArgs {
    /// The mesh, welded already: PLY, OBJ, STL or OFF.
    pub mesh: PathBuf,
    /// How many triangles to keep.
    pub triangles: usize,
    /// Where the result goes, without the vertices that no triangle uses.
    #[arg(value_name = "OUT.ply")]
    pub output: PathBuf,
}

/// The arguments of `race attributes`.
#[derive(Debug, Args)]
pub struct AttributesArgs {
    /// The mesh, in any format that the library reads with its attributes.
    pub mesh: PathBuf,
    /// How many triangles to keep.
    pub triangles: usize,
    /// Where the result goes, without the vertices that no triangle uses.
    #[arg(value_name = "OUT.ply")]
    pub output: PathBuf,
    /// Which of meshoptimizer's functions.
    #[arg(long, value_enum, default_value_t)]
    pub method: Method,
}

/// `--method`.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub enum Method {
    /// simplifyWithUpdate: vertices and attributes move
    #[default]
    Update,
    /// simplifyWithAttributes: vertices stay where they are, with what they have
    Attributes,
}

/// The arguments of `race against`. A list is given with commas or by repeating the option.
#[derive(Debug, Args)]
pub struct AgainstArgs {
    /// The meshes: PLY, OBJ, STL or OFF. Each is welded and cleaned once, before the clock.
    #[arg(required = true, value_name = "MESH")]
    pub meshes: Vec<PathBuf>,
    /// The fractions of the triangles to keep.
    #[arg(
        long = "ratio",
        value_name = "R",
        default_value = "0.1",
        value_delimiter = ','
    )]
    pub ratios: Vec<f64>,
    /// Our qualities.
    #[arg(long = "quality", default_value = "fast", value_delimiter = ',')]
    pub qualities: Vec<QualityArg>,
    /// Our memory tiers.
    #[arg(long = "tier", default_value = "full", value_delimiter = ',')]
    pub tiers: Vec<TierArg>,
    /// Our numbers of threads.
    #[arg(long, value_name = "N", default_value = "1", value_delimiter = ',')]
    pub threads: Vec<usize>,
    /// The turns that count; one more goes before them.
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = at_least_one)]
    pub runs: usize,
    /// Where every single run goes.
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// The Python that has the package fast-simplification, which then takes part: a process of its
    /// own each turn, of which the call alone is timed.
    #[arg(long, value_name = "PYTHON")]
    pub fast_simplification: Option<PathBuf>,
}

/// The arguments of `race generate`.
#[derive(Debug, Args)]
pub struct GenerateArgs {
    /// What to make.
    pub kind: Kind,
    /// About how many triangles.
    #[arg(value_parser = clap::value_parser!(u64).range(200..=100_000_000))]
    pub triangles: u64,
    /// Where it goes.
    #[arg(value_name = "OUT.ply")]
    pub output: PathBuf,
    /// Another seed, another mesh.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
}

/// The arguments of `race shuffle`.
#[derive(Debug, Args)]
pub struct ShuffleArgs {
    /// The mesh: PLY, OBJ, STL or OFF.
    pub mesh: PathBuf,
    /// Where it goes.
    #[arg(value_name = "OUT.ply")]
    pub output: PathBuf,
    /// How many times to subdivide it first (Loop 1987): four triangles of each.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub subdivide: usize,
    /// Another seed, another order.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
}

/// `--quality`.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum QualityArg {
    Fast,
    Standard,
    Best,
}

impl From<QualityArg> for Quality {
    fn from(quality: QualityArg) -> Self {
        match quality {
            QualityArg::Fast => Self::Fast,
            QualityArg::Standard => Self::Standard,
            QualityArg::Best => Self::Best,
        }
    }
}

/// `--tier`.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum TierArg {
    Auto,
    Full,
    Medium,
    Small,
}

impl From<TierArg> for TierChoice {
    fn from(tier: TierArg) -> Self {
        match tier {
            TierArg::Auto => Self::Auto,
            TierArg::Full => Self::Fixed(Tier::Full),
            TierArg::Medium => Self::Fixed(Tier::Medium),
            TierArg::Small => Self::Fixed(Tier::Small),
        }
    }
}

fn at_least_one(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("at least 1 is expected".into()),
        Ok(n) => Ok(n),
        Err(error) => Err(format!("{error}")),
    }
}
