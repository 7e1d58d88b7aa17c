//! The command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use decimate::decimate::{
    AttributeUse, AttributeWeights, Boundary, Chunks, Options, Placement, Quality, Targets,
    TierChoice, Topology,
};
use decimate::io::Format;
use decimate::mesh::Tier;

/// Reduces triangle meshes by quadric edge collapse on the directed-edge data structure, keeping
/// shape, boundary and topology.
#[derive(Debug, Parser)]
#[command(
    version,
    max_term_width = 100,
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    override_usage = "decimate INPUT -o OUTPUT [--ratio R] [--triangles N] [--max-error E] [OPTIONS]\n       \
                      decimate info MESH [--json]\n       \
                      decimate compare REFERENCE MESH... [--json]\n       \
                      decimate repair INPUT -o OUTPUT --cut [OPTIONS]\n       \
                      decimate structures MESH [--json]",
    after_help = "Exit status: 0 done (also when stopped short, which is said), 1 a file or mesh could not be \
                  processed, 2 wrong usage, 3 stopped short under --strict, 130 interrupted (no half file is left).\n\n\
                  Examples:\n  \
                  decimate bunny.obj -o small.ply --ratio 0.1\n  \
                  decimate scan.ply -o small.ply --triangles 50000 --tier small\n  \
                  decimate part.stl -o part.ply --max-error 0.05"
)]
pub struct Cli {
    /// What to do instead of decimating.
    #[command(subcommand)]
    pub command: Option<Command>,
    /// Decimation.
    #[command(flatten)]
    pub run: Run,
}

/// The other commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Says what is in a mesh, and what each memory tier would need.
    Info(InfoArgs),
    /// Measures how far meshes are from a reference, and what is wrong with them.
    Compare(CompareArgs),
    /// Makes a mesh manifold.
    Repair(RepairArgs),
    /// Measures a mesh in the structures that the paper compares: bytes, building, queries, flips.
    Structures(StructuresArgs),
}

/// The arguments of `decimate repair`.
#[derive(Debug, Args)]
pub struct RepairArgs {
    /// The mesh to repair: PLY, OBJ, STL, OFF or glTF; - for standard input.
    pub input: PathBuf,
    /// The file to write, by its extension; - for standard output. Not STL, in which faces share no
    /// vertices: a cut would be lost.
    #[arg(short, long)]
    pub output: PathBuf,
    /// Cut along edges of three faces or more and at vertices whose faces are not one fan, with few
    /// copies of vertices; positions and faces stay as they are, and so do attributes, but those for
    /// which the output's format would have copies of vertices (OBJ has next to none). Decimating the
    /// output needs --no-weld, or the copies become one again.
    #[arg(long)]
    pub cut: bool,
    /// Keep vertices at equal positions apart (they are welded otherwise, unless that alone would
    /// make the mesh non-manifold).
    #[arg(long)]
    pub no_weld: bool,
    /// The input's format, where neither content nor extension says it.
    #[arg(long, value_name = "FORMAT")]
    pub input_format: Option<Format>,
    /// The output's format, where the extension does not say it.
    #[arg(long, value_name = "FORMAT")]
    pub output_format: Option<Format>,
    /// Write PLY as text.
    #[arg(long)]
    pub ascii: bool,
    /// Significant digits of the numbers in text files; as many as give the same number back where
    /// not given.
    #[arg(long, value_name = "DIGITS", value_parser = clap::value_parser!(u8).range(1..=17))]
    pub precision: Option<u8>,
    /// Write what was done as JSON; - for standard output.
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Say nothing but errors.
    #[arg(short, long)]
    pub quiet: bool,
}

/// The arguments of `decimate structures`.
#[derive(Debug, Args)]
pub struct StructuresArgs {
    /// The mesh: PLY, OBJ, STL, OFF or glTF; - for standard input. One of quads alone is measured in the
    /// structure for quads, others as triangles.
    pub mesh: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
    /// The mesh's format, where neither content nor extension says it.
    #[arg(long, value_name = "FORMAT")]
    pub input_format: Option<Format>,
}

/// The arguments of `decimate compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// The mesh to measure against: PLY, OBJ, STL, OFF or glTF.
    pub reference: PathBuf,
    /// The meshes to measure.
    #[arg(required = true)]
    pub meshes: Vec<PathBuf>,
    /// Samples on each surface, spread by area; vertices are added for the largest distance.
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..))]
    pub samples: usize,
    /// Count pairs of triangles that cut each other, too.
    #[arg(long)]
    pub intersections: bool,
    /// Compare normals, colours, texture coordinates and scalars at nearest points, too, and count the
    /// triangles that are turned over in the texture.
    #[arg(long)]
    pub attributes: bool,
    /// Print JSON: a list with an object for each mesh.
    #[arg(long)]
    pub json: bool,
    /// The threads to use; all processors where not given. The numbers do not depend on it.
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
}

/// The arguments of `decimate info`.
#[derive(Debug, Args)]
pub struct InfoArgs {
    /// The mesh: PLY, OBJ, STL, OFF or glTF; - for standard input.
    pub mesh: PathBuf,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
    /// The mesh's format, where neither content nor extension says it.
    #[arg(long, value_name = "FORMAT")]
    pub input_format: Option<Format>,
    /// Keep vertices at equal positions apart (they are welded otherwise, unless that alone would
    /// make the mesh non-manifold).
    #[arg(long)]
    pub no_weld: bool,
}

/// The arguments of a decimation.
#[derive(Debug, Args)]
pub struct Run {
    /// The mesh to decimate: PLY, OBJ, STL, OFF or glTF; - for standard input.
    #[arg(required = true)]
    pub input: Option<PathBuf>,
    /// The file to write, by its extension; - for standard output.
    #[arg(short, long, required = true)]
    pub output: Option<PathBuf>,

    /// The fraction of the triangles to KEEP: 0.1 keeps a tenth.
    #[arg(
        long,
        value_name = "R",
        allow_negative_numbers = true,
        help_heading = "Targets (the first that is reached stops)"
    )]
    pub ratio: Option<f64>,
    /// The number of triangles to keep.
    #[arg(
        long,
        value_name = "N",
        allow_negative_numbers = true,
        help_heading = "Targets (the first that is reached stops)"
    )]
    pub triangles: Option<usize>,
    /// Stop before the surface moves farther than this, in model units. An estimate, not a bound:
    /// distances to the planes around each collapse, added up.
    #[arg(
        long,
        value_name = "E",
        allow_negative_numbers = true,
        help_heading = "Targets (the first that is reached stops)"
    )]
    pub max_error: Option<f64>,

    /// How near to come to the original, for how much time.
    #[arg(long, value_enum, default_value_t, help_heading = "Surface")]
    pub quality: QualityArg,
    /// Keep edges at which the surface turns by more than this many degrees as curves.
    #[arg(
        long,
        value_name = "DEG",
        allow_negative_numbers = true,
        help_heading = "Surface"
    )]
    pub feature_angle: Option<f64>,
    /// The vertex property of a PLY input that multiplies the cost around each vertex: more is kept
    /// where it is larger. Numbers of 0 or more, of which only the ratios count; inf keeps a vertex
    /// where it is, bit for bit.
    #[arg(long, value_name = "PROPERTY", help_heading = "Surface")]
    pub vertex_weight: Option<String>,
    /// What may happen to boundaries.
    #[arg(long, value_enum, default_value_t, help_heading = "Surface")]
    pub boundary: BoundaryArg,
    /// What may happen to the topology.
    #[arg(long, value_enum, default_value_t, help_heading = "Surface")]
    pub topology: TopologyArg,
    /// Where merged vertices go.
    #[arg(long, value_enum, default_value_t, help_heading = "Surface")]
    pub placement: PlacementArg,
    /// What becomes of normals, colours, texture coordinates and materials.
    #[arg(long, value_enum, default_value_t, help_heading = "Surface")]
    pub attributes: AttributesArg,
    /// How much an attribute weighs against positions: normal, color, texture or scalar, and a share
    /// of the mesh's diagonal that weighs as much as a change by all of the attribute's range (what
    /// suits the number of triangles where not given). May be given several times.
    #[arg(long, value_name = "KIND=WEIGHT", value_parser = parse_weight, help_heading = "Surface")]
    pub weight: Vec<(WeightKind, f64)>,
    /// Keep vertices at equal positions apart (they are welded otherwise).
    #[arg(long, help_heading = "Surface")]
    pub no_weld: bool,

    /// The memory tier. The output is the same in all of them.
    #[arg(long, value_enum, default_value_t, help_heading = "Resources")]
    pub tier: TierArg,
    /// The memory that decimation may use, such as 2GB, 512MiB or a number of bytes; the memory
    /// that is free where not given.
    #[arg(long, value_name = "SIZE", value_parser = parse_size, help_heading = "Resources")]
    pub memory_limit: Option<u64>,
    /// The threads to use; all processors where not given. The output does not depend on it.
    #[arg(long, value_name = "N", help_heading = "Resources")]
    pub threads: Option<usize>,
    /// Decimate pieces of the mesh on their own first: auto where that is quicker, off, or pieces of
    /// about so many triangles. Changes the result a little.
    #[arg(long, value_name = "auto|off|TRIANGLES", default_value = "auto", value_parser = parse_chunks, help_heading = "Resources")]
    pub chunks: Chunks,

    /// The input's format, where neither content nor extension says it.
    #[arg(long, value_name = "FORMAT", help_heading = "Files")]
    pub input_format: Option<Format>,
    /// The output's format, where the extension does not say it.
    #[arg(long, value_name = "FORMAT", help_heading = "Files")]
    pub output_format: Option<Format>,
    /// Write PLY and STL as text.
    #[arg(long, help_heading = "Files")]
    pub ascii: bool,
    /// Significant digits of the numbers in text files; as many as give the same number back where
    /// not given.
    #[arg(long, value_name = "DIGITS", value_parser = clap::value_parser!(u8).range(1..=17), help_heading = "Files")]
    pub precision: Option<u8>,

    /// Write what was done as JSON; - for standard output.
    #[arg(long, value_name = "FILE", help_heading = "Reports")]
    pub report: Option<PathBuf>,
    /// Say nothing but errors.
    #[arg(short, long, help_heading = "Reports")]
    pub quiet: bool,
    /// Exit with 3 when the target could not be reached.
    #[arg(long, help_heading = "Reports")]
    pub strict: bool,
    /// Verify every invariant of the mesh after every collapse (slow).
    #[arg(long, help_heading = "Reports")]
    pub check: bool,
}

/// `--quality`.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub enum QualityArg {
    /// Half the time, twice the error
    Fast,
    /// Nearer than other simplifiers
    #[default]
    Standard,
    /// Fitted to the original: half as much time again for a fifth less error
    Best,
}

/// `--boundary`.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub enum BoundaryArg {
    /// Weigh boundary edges more than surface
    #[default]
    Keep,
    /// Leave boundary vertices where they are, bit for bit
    Lock,
    /// Weigh boundary edges nothing
    Free,
}

/// `--topology`.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub enum TopologyArg {
    /// Keep components, boundary loops and handles
    #[default]
    Preserve,
    /// Let tiny components vanish, pockets fall flat, gaps close, handles go, cheapest first
    Simplify,
}

/// `--placement`.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub enum PlacementArg {
    /// Where the cost is least
    #[default]
    Optimal,
    /// To one of the edge's ends, bit for bit
    Endpoint,
}

/// `--tier`.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
pub enum TierArg {
    /// The fastest by measurement of those that fit the memory limit
    #[default]
    Auto,
    /// 68 bytes per triangle
    Full,
    /// 44 bytes per triangle
    Medium,
    /// 32 bytes per triangle
    Small,
}

/// `--attributes`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum AttributesArg {
    /// They are dropped
    Ignore,
    /// They go along and cost nothing; seams may smear
    Carry,
    /// They count in the cost; seams stay, textures do not fold
    #[default]
    Optimize,
}

/// What `--weight` weighs.
#[derive(Clone, Copy, Debug, ValueEnum)]
#[allow(missing_docs)]
pub enum WeightKind {
    Normal,
    Color,
    Texture,
    Scalar,
}

/// A kind and its weight.
fn parse_weight(text: &str) -> Result<(WeightKind, f64), String> {
    let expected = "expected normal, color, texture or scalar, =, and a number of 0 or more";
    let (kind, weight) = text.split_once('=').ok_or(expected)?;
    let kind = WeightKind::from_str(kind, true).map_err(|_| expected)?;
    let weight: f64 = weight.parse().map_err(|_| expected)?;
    if weight.is_finite() && weight >= 0.0 {
        Ok((kind, weight))
    } else {
        Err(expected.into())
    }
}

impl Run {
    /// How much attributes weigh.
    fn attribute_weights(&self) -> AttributeWeights {
        let mut weights = AttributeWeights::default();
        for &(kind, weight) in &self.weight {
            *match kind {
                WeightKind::Normal => &mut weights.normal,
                WeightKind::Color => &mut weights.color,
                WeightKind::Texture => &mut weights.texture,
                WeightKind::Scalar => &mut weights.scalar,
            } = Some(weight);
        }
        weights
    }

    /// The library's options.
    pub fn options(&self) -> Options {
        Options {
            targets: Targets {
                ratio: self.ratio,
                triangles: self.triangles,
                max_error: self.max_error,
            },
            quality: match self.quality {
                QualityArg::Fast => Quality::Fast,
                QualityArg::Standard => Quality::Standard,
                QualityArg::Best => Quality::Best,
            },
            feature_angle_degrees: self.feature_angle,
            attributes: match self.attributes {
                AttributesArg::Ignore => AttributeUse::Ignore,
                AttributesArg::Carry => AttributeUse::Carry,
                AttributesArg::Optimize => AttributeUse::Optimize,
            },
            attribute_weights: self.attribute_weights(),
            boundary: match self.boundary {
                BoundaryArg::Keep => Boundary::Keep,
                BoundaryArg::Lock => Boundary::Lock,
                BoundaryArg::Free => Boundary::Free,
            },
            topology: match self.topology {
                TopologyArg::Preserve => Topology::Preserve,
                TopologyArg::Simplify => Topology::Simplify,
            },
            placement: match self.placement {
                PlacementArg::Optimal => Placement::Optimal,
                PlacementArg::Endpoint => Placement::Endpoint,
            },
            tier: match self.tier {
                TierArg::Auto => TierChoice::Auto,
                TierArg::Full => TierChoice::Fixed(Tier::Full),
                TierArg::Medium => TierChoice::Fixed(Tier::Medium),
                TierArg::Small => TierChoice::Fixed(Tier::Small),
            },
            chunks: self.chunks,
            memory_limit_bytes: self.memory_limit,
            weld: !self.no_weld,
            check: self.check,
        }
    }
}

/// `auto`, `off` or a number of triangles.
fn parse_chunks(text: &str) -> Result<Chunks, String> {
    match text {
        "auto" => Ok(Chunks::Auto),
        "off" => Ok(Chunks::Off),
        _ => match text.parse() {
            Ok(triangles) if triangles > 0 => Ok(Chunks::Triangles(triangles)),
            _ => Err("auto, off or a number of triangles is expected".into()),
        },
    }
}

/// A number of bytes: 1500000, 1.5MB (powers of 1000) or 1.5MiB (powers of 1024).
fn parse_size(text: &str) -> Result<u64, String> {
    let expected =
        || format!("'{text}' is no size; a number with B, KB, MB, GB, KiB, MiB or GiB is expected");
    let digits = text
        .find(|c: char| !c.is_ascii_digit() && c != '.')
        .unwrap_or(text.len());
    let number: f64 = text[..digits].parse().map_err(|_| expected())?;
    let unit = match text[digits..].trim().to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "k" | "kb" => 1e3,
        "m" | "mb" => 1e6,
        "g" | "gb" => 1e9,
        "t" | "tb" => 1e12,
        "kib" => 1024.0,
        "mib" => 1024.0 * 1024.0,
        "gib" => 1024.0 * 1024.0 * 1024.0,
        "tib" => 1024.0 * 1024.0 * 1024.0 * 1024.0,
        _ => return Err(expected()),
    };
    Ok((number * unit) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_arguments_are_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn sizes_have_units() {
        for (text, bytes) in [
            ("1500", 1500),
            ("1.5MB", 1_500_000),
            ("2 GiB", 2 << 30),
            ("512m", 512_000_000),
        ] {
            assert_eq!(parse_size(text), Ok(bytes), "{text}");
        }
        for text in ["", "MB", "1.2.3", "5 parsecs", "-1"] {
            assert!(parse_size(text).is_err(), "{text}");
        }
    }
}
