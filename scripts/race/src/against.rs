//! The race: ours and the others in turns, in one process, from arrays to arrays.

use std::path::{Path, PathBuf};
use std::time::Instant;

use decimate::clean::clean;
use decimate::decimate::{Options, Targets, TierChoice, decimate};
use decimate::error::{Error, Result};
use decimate::indexed_mesh::IndexedMesh;
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde::Serialize;

use crate::cli::{AgainstArgs, QualityArg, TierArg};
use crate::fast_simplification::FastSimplification;
use crate::meshoptimizer;

/// One mesh at one ratio, with every turn that counts.
#[derive(Debug, Serialize)]
pub struct Case {
    /// The file's name.
    pub mesh: String,
    /// After welding and cleaning, as all others here.
    pub triangles_in: usize,
    pub vertices_in: usize,
    /// The fraction of the triangles to keep.
    pub ratio: f64,
    pub target_triangles: usize,
    pub turns: Vec<Turn>,
}

/// One run of everyone, one after the other.
#[derive(Debug, Serialize)]
pub struct Turn {
    pub meshoptimizer: Theirs,
    pub fast_simplification: Option<Theirs>,
    /// One for each setting, in the same order in every turn.
    pub ours: Vec<Ours>,
}

/// One call of another simplifier.
#[derive(Debug, Serialize)]
pub struct Theirs {
    /// The call alone.
    pub call_seconds: f64,
    pub triangles_out: usize,
}

/// One call of [`decimate`].
#[derive(Debug, Serialize)]
pub struct Ours {
    pub quality: String,
    pub tier: &'static str,
    pub threads: usize,
    pub clean_seconds: f64,
    pub build_seconds: f64,
    pub decimate_seconds: f64,
    /// The whole call, cleaning included.
    pub call_seconds: f64,
    pub triangles_out: usize,
}

/// One way to call ours.
pub struct Setting {
    quality: QualityArg,
    tier: TierChoice,
    threads: usize,
    pool: ThreadPool,
}

impl Setting {
    fn new(quality: QualityArg, tier: TierArg, threads: usize) -> Result<Self> {
        let pool = match threads {
            0 => return Err(invalid("--threads 0: at least 1 is expected")),
            n => ThreadPoolBuilder::new().num_threads(n).build(),
        };
        Ok(Self {
            quality,
            tier: tier.into(),
            threads,
            pool: pool.map_err(|error| invalid(format!("--threads {threads}: {error}")))?,
        })
    }

    fn run(&self, mesh: &IndexedMesh, triangles: usize) -> Result<Ours> {
        let targets = Targets {
            triangles: Some(triangles),
            ..Targets::default()
        };
        let options = Options {
            targets,
            quality: self.quality.into(),
            tier: self.tier,
            ..Options::default()
        };
        let mesh = mesh.clone();
        let start = Instant::now();
        let (output, report) = self.pool.install(|| decimate(mesh, &options))?;
        let call_seconds = start.elapsed().as_secs_f64();
        Ok(Ours {
            quality: format!("{:?}", self.quality).to_lowercase(),
            tier: report.tier.name(),
            threads: self.threads,
            clean_seconds: report.clean_seconds,
            build_seconds: report.build_seconds,
            decimate_seconds: report.decimate_seconds,
            call_seconds,
            triangles_out: output.triangle_count(),
        })
    }
}

/// Every quality in every tier with every number of threads, in this order.
///
/// # Errors
/// [`Error::InvalidOptions`] for a number of threads that is 0 or that the system refuses.
pub fn settings(args: &AgainstArgs) -> Result<Vec<Setting>> {
    let mut settings = Vec::new();
    for &quality in &args.qualities {
        for &tier in &args.tiers {
            for &threads in &args.threads {
                settings.push(Setting::new(quality, tier, threads)?);
            }
        }
    }
    Ok(settings)
}

/// A mesh in memory, and in the files of who needs them.
pub struct Contest<'a> {
    name: String,
    mesh: IndexedMesh,
    settings: &'a [Setting],
    fast_simplification: Option<FastSimplification>,
}

impl<'a> Contest<'a> {
    /// Reads, welds and cleans `path`.
    ///
    /// # Errors
    /// As `read` and [`clean`], and where the arrays for `python` cannot be written.
    pub fn new(path: &Path, settings: &'a [Setting], python: Option<&PathBuf>) -> Result<Self> {
        let (mesh, _) = clean(crate::read(path)?, true)?;
        let fast_simplification = python
            .map(|python| FastSimplification::new(python, &mesh))
            .transpose()?;
        Ok(Self {
            name: path.file_name().unwrap_or_default().display().to_string(),
            mesh,
            settings,
            fast_simplification,
        })
    }

    /// `runs` turns at one ratio, after one that does not count.
    ///
    /// # Errors
    /// As [`decimate`], and where a process beside fails.
    pub fn run(&self, ratio: f64, runs: usize) -> Result<Case> {
        let targets = Targets {
            ratio: Some(ratio),
            ..Targets::default()
        };
        let triangles_in = self.mesh.triangle_count();
        let target_triangles = targets.triangles_of(triangles_in)?;
        let mut turns = (0..=runs)
            .map(|_| self.turn(target_triangles))
            .collect::<Result<Vec<_>>>()?;
        turns.remove(0);
        Ok(Case {
            mesh: self.name.clone(),
            triangles_in,
            vertices_in: self.mesh.positions().len(),
            ratio,
            target_triangles,
            turns,
        })
    }

    fn turn(&self, triangles: usize) -> Result<Turn> {
        let mut arrays = meshoptimizer::Arrays::from(&self.mesh);
        let start = Instant::now();
        arrays.simplify_with_update(triangles);
        let meshoptimizer = Theirs {
            call_seconds: start.elapsed().as_secs_f64(),
            triangles_out: arrays.triangle_count(),
        };
        drop(arrays);
        let fast_simplification = self
            .fast_simplification
            .as_ref()
            .map(|peer| peer.run(triangles))
            .transpose()?;
        let ours = self
            .settings
            .iter()
            .map(|setting| setting.run(&self.mesh, triangles))
            .collect::<Result<_>>()?;
        Ok(Turn {
            meshoptimizer,
            fast_simplification,
            ours,
        })
    }
}

fn invalid(message: impl Into<String>) -> Error {
    Error::InvalidOptions(message.into())
}
