//! From one mesh to another with fewer triangles.

mod chunked;
mod cost;
mod curves;
mod cut;
mod fit;
mod flat;
mod geometry;
mod greedy;
mod memory;
mod options;
mod queue;
mod report;
mod rules;
mod surface;
mod symmetric;

use std::ops::ControlFlow;
use std::time::Instant;

use glam::Vec3;

use crate::clean::{Cleaning, clean};
use crate::error::{Error, Result};
use crate::indexed_mesh::IndexedMesh;
use crate::mesh::{EdgeStore, Full, Medium, Mesh, Oriented, Small, Tier, turn_round};

pub use memory::{available_bytes, needed_bytes, peak_rss_bytes};
pub use options::{Boundary, Chunks, Options, Placement, Quality, Targets, TierChoice, Topology};
pub use report::{Blocked, Report, StopReason, Tally};

use chunked::Chunked;
use cost::{Accumulated, Cost, Memoryless};
use fit::{Arrays, Terms, fit_to_original};
use flat::Flat;
use geometry::scale_to_unit;
use greedy::{Greedy, Stop};
use surface::Surface;

/// How far decimation has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Progress {
    /// The triangles at the start, after cleaning.
    pub triangles_start: usize,
    /// The triangles left.
    pub triangles: usize,
    /// The triangles to stop at.
    pub triangles_target: usize,
}

/// Decimates a mesh to the first of its targets.
///
/// The mesh is cleaned first (see [`clean`]); then the cheapest edge is collapsed, again and again.
/// Topology is kept: closed stays closed; components, boundary loops and the Euler characteristic
/// stay; nothing non-manifold is born; no face turns by more than 90°. Where the mesh has
/// [weights](IndexedMesh::weights), they multiply what a collapse costs; only their ratios count, and
/// an infinite one keeps its vertex, bit for bit. The result carries none. It depends on the
/// mesh and the options alone, not on the tier or the number of threads.
///
/// # Errors
/// [`Error::InvalidOptions`] for targets outside their range, [`Error::InvalidMesh`] where cleaning
/// leaves no triangle, [`Error::Memory`] where no tier fits a given limit.
pub fn decimate(mesh: IndexedMesh, options: &Options) -> Result<(IndexedMesh, Report)> {
    decimate_with_progress(mesh, options, &mut |_| ControlFlow::Continue(()))
}

/// [`decimate`], telling `progress` now and then how far it is; breaking stops it with the mesh as
/// it is by then, whole and with the topology that it had, and [`StopReason::Cancelled`].
///
/// Now and then is behind every 1024 collapses and every few dozen chunks. Cleaning, building,
/// looking for the threshold of the chunks, and fitting run to their end.
///
/// # Errors
/// As [`decimate`].
pub fn decimate_with_progress(
    mesh: IndexedMesh,
    options: &Options,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<(IndexedMesh, Report)> {
    let (vertices_in, triangles_in) = (mesh.positions().len(), mesh.triangle_count());
    options.check()?;
    let target_triangles = options.targets.triangles_of(triangles_in)?;
    let start = Instant::now();
    let (mesh, cleaning) = clean(mesh, options.weld)?;
    let clean_seconds = start.elapsed().as_secs_f64();
    if mesh.triangles().is_empty() {
        return Err(no_triangle_left(triangles_in, &cleaning));
    }
    let (vertices, faces) = (mesh.positions().len(), mesh.triangles().len());
    let (tier, tier_reason) = memory::choose_tier(options, vertices, faces, target_triangles)?;
    let mut report = Report {
        vertices_in,
        triangles_in,
        cleaning,
        reoriented_faces: 0,
        non_manifold_edges_in: 0,
        target_triangles,
        max_error: options.targets.max_error,
        vertices_out: vertices,
        triangles_out: triangles_in,
        stop_reason: StopReason::Target,
        stopped_short: false,
        blocked: None,
        tally: Tally::default(),
        max_error_estimate: 0.0,
        tier,
        tier_reason,
        mesh_bytes: 0,
        chunks: 0,
        chunk_rounds: 0,
        collapses_in_chunks: 0,
        chunk_seconds: 0.0,
        read_seconds: 0.0,
        clean_seconds,
        build_seconds: 0.0,
        decimate_seconds: 0.0,
        write_seconds: 0.0,
        peak_heap_bytes: None,
        peak_rss_bytes: None,
    };
    let is_fast = options.quality == Quality::Fast;
    let run = match (tier, is_fast) {
        (Tier::Full, true) => run::<Full, Accumulated>,
        (Tier::Medium, true) => run::<Medium, Accumulated>,
        (Tier::Small, true) => run::<Small, Accumulated>,
        (Tier::Full, false) => run::<Full, Memoryless>,
        (Tier::Medium, false) => run::<Medium, Memoryless>,
        (Tier::Small, false) => run::<Small, Memoryless>,
    };
    let mesh = run(mesh, options, &mut report, progress)?;
    Ok((mesh, report))
}

fn no_triangle_left(triangles_in: usize, cleaning: &Cleaning) -> Error {
    Error::InvalidMesh(if triangles_in == 0 {
        "no triangle in it; a surface mesh with faces is expected, not points or lines".into()
    } else {
        format!(
            "no triangle is left of {triangles_in}: {} use coordinates that are not finite, {} name \
             a vertex twice",
            cleaning.dropped_non_finite_faces, cleaning.dropped_degenerate_faces
        )
    })
}

fn run<S: EdgeStore, C: Cost<S>>(
    input: IndexedMesh,
    options: &Options,
    report: &mut Report,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<IndexedMesh> {
    let start = Instant::now();
    let scale = scale_to_unit(input.diagonal());
    let parts = input.into_parts();
    let origin = parts.origin;
    let mut flat = Flat::<C::State>::of(parts);
    // Single precision has no room for the scale of a tiny mesh, and takes a larger one exactly.
    let unit = if scale > MODERATE { scale } else { 1.0 };
    rescale(&mut flat.positions, unit);
    let scale_of_unit = scale / unit;
    let stop = Stop {
        triangles: report.target_triangles,
        max_error: options.targets.max_error.map(|e| e * scale),
        max_cost: f32::INFINITY,
    };
    let triangles_start = flat.triangle_count();
    let triangles_target = stop.triangles.min(triangles_start);
    let mut job = Job {
        options,
        tally: Tally::default(),
        progress: &mut |triangles| {
            progress(Progress {
                triangles_start,
                triangles,
                triangles_target,
            })
        },
    };
    let original = match options.quality {
        Quality::Best => Some((flat.positions.clone(), flat.triangles.clone())),
        Quality::Fast | Quality::Standard => None,
    };
    let mut is_cancelled = false;
    let mut is_prepared = false;
    let mut chunked = Chunked {
        options,
        stop,
        scale: scale_of_unit,
        progress: job.progress,
    };
    if chunked.is_worthwhile(&flat) {
        let needs_whole =
            options.boundary == Boundary::Lock || options.feature_angle_degrees.is_some();
        is_prepared = needs_whole;
        if needs_whole {
            flat = prepared(flat, options, scale_of_unit, report);
        }
        let mut done = chunked.reduce::<S, C>(&mut flat)?;
        if done.is_disoriented {
            is_prepared = true;
            flat = prepared(flat, options, scale_of_unit, report);
            done = chunked.reduce::<S, C>(&mut flat)?;
        }
        if !is_prepared {
            report.non_manifold_edges_in = done.non_manifold_edges_in;
        }
        is_cancelled = done.is_cancelled;
        job.tally = done.tally;
        report.chunks = done.chunks;
        report.chunk_rounds = done.rounds;
        report.collapses_in_chunks = done.tally.collapses;
    }
    report.chunk_seconds = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let Oriented { mesh, flipped, .. } =
        Mesh::<S>::oriented(flat.positions.len(), std::mem::take(&mut flat.triangles));
    let (mut surface, states) = flat.into_surface(mesh, scale_of_unit, &flipped);
    report.mesh_bytes = surface.mesh_bytes();
    if report.chunk_rounds == 0 {
        report.non_manifold_edges_in = surface.mesh.non_manifold_edge_count();
    }
    if !is_prepared {
        report.reoriented_faces = surface.turned.iter().filter(|&&f| f).count();
    }
    report.build_seconds = start.elapsed().as_secs_f64();

    let start = Instant::now();
    if !is_prepared {
        surface.prepare(options);
    }
    let (surface, (reason, blocked)) = match original {
        _ if is_cancelled => (surface, (StopReason::Cancelled, None)),
        None => job.collapse::<S, C>(surface, states, stop)?,
        Some(original) => job.collapse_and_fit(surface, &original, stop)?,
    };
    report.tally = job.tally;
    report.max_error_estimate = surface.max_deviation() / scale;
    report.triangles_out = surface.triangles();
    report.stop_reason = reason;
    report.blocked = blocked;
    // An error alone is no target to fall short of, and reaching it is no falling short.
    let wanted = options.targets.ratio.is_some() || options.targets.triangles.is_some();
    report.stopped_short = match reason {
        StopReason::Target | StopReason::MaxError => false,
        StopReason::Blocked => wanted,
        StopReason::Cancelled => true,
    };

    let Flat {
        mut positions,
        mut triangles,
        flags,
        ..
    } = surface.into_flat::<()>();
    rescale(&mut positions, unit.recip());
    let (mut turned, mut double_sided) = (Vec::new(), Vec::new());
    if !flags.is_empty() {
        turned.extend(flags.iter().map(|f| f.is_turned()));
        double_sided.extend(flags.iter().map(|f| f.is_double_sided()));
    }
    turn_round(&mut triangles, &turned);
    report.vertices_out = positions.len();
    let output =
        IndexedMesh::with_origin(origin, positions, triangles)?.with_double_sided(double_sided)?;
    report.decimate_seconds = start.elapsed().as_secs_f64() + report.chunk_seconds;
    Ok(output)
}

/// Up to this scale single precision has room for what is computed.
const MODERATE: f64 = (1u64 << 60) as f64;

/// Multiplies positions by a power of two, which is exact: of a tiny mesh to the unit box, and back.
fn rescale(positions: &mut [Vec3], factor: f64) {
    if factor != 1.0 {
        for p in positions {
            *p = (p.as_dvec3() * factor).as_vec3();
        }
    }
}

/// The arrays, oriented, with what only the whole can tell: what is locked, and the creases.
fn prepared<V>(mut flat: Flat<V>, options: &Options, scale: f64, report: &mut Report) -> Flat<V> {
    let triangles = std::mem::take(&mut flat.triangles);
    let oriented = Mesh::<Small>::oriented(flat.positions.len(), triangles);
    let (mut surface, _) = flat.into_surface(oriented.mesh, scale, &oriented.flipped);
    report.non_manifold_edges_in = surface.mesh.non_manifold_edge_count();
    report.reoriented_faces = surface.turned.iter().filter(|&&f| f).count();
    surface.prepare(options);
    surface.into_flat()
}

type Stopped = (StopReason, Option<Blocked>);

/// What a run goes by, and what it counts.
struct Job<'a> {
    options: &'a Options,
    tally: Tally,
    progress: &'a mut dyn FnMut(usize) -> ControlFlow<()>,
}

impl Job<'_> {
    /// Collapses under one cost.
    fn collapse<S: EdgeStore, C: Cost<S>>(
        &mut self,
        surface: Surface<S>,
        states: Vec<C::State>,
        stop: Stop,
    ) -> Result<(Surface<S>, Stopped)> {
        let cost = if states.is_empty() {
            C::new(&surface, self.options)
        } else {
            C::with_states(&surface, self.options, states)
        };
        let mut greedy =
            Greedy::<S, C, C::Queue>::new(surface, cost, self.options.topology, self.tally);
        let stopped = greedy.run(stop, self.options.check, self.progress)?;
        let (surface, _, tally) = greedy.into_parts();
        self.tally = tally;
        Ok((surface, stopped))
    }

    /// Collapses, and fits what is left to the original. Where an error stopped it, goes on with
    /// what was measured in the place of what was estimated.
    fn collapse_and_fit<S: EdgeStore>(
        &mut self,
        mut surface: Surface<S>,
        (positions, triangles): &(Vec<Vec3>, Vec<[u32; 3]>),
        stop: Stop,
    ) -> Result<(Surface<S>, Stopped)> {
        let options = self.options;
        let scale = surface.geometry.scale();
        let terms = Terms {
            target: stop.triangles,
            with_boundary: options.boundary == Boundary::Keep,
            moves: options.placement == Placement::Optimal,
            max_error: stop.max_error.map(|e| e / scale),
        };
        let mut faces = triangles.len();
        let original = Arrays {
            positions,
            triangles,
        };
        loop {
            let stopped;
            (surface, stopped) = self.collapse::<S, Memoryless>(surface, Vec::new(), stop)?;
            let faces_before = std::mem::replace(&mut faces, surface.mesh.face_count());
            if stopped.0 == StopReason::Cancelled || faces == faces_before {
                return Ok((surface, stopped));
            }
            let bytes = fit_to_original(&mut surface, original, &terms);
            self.tally.working_bytes = self.tally.working_bytes.max(bytes);
            if options.check {
                let wrong = |wrong| Error::Internal(format!("after fitting: {wrong}"));
                surface.mesh.check().map_err(wrong)?;
            }
            let is_stuck = faces as f64 > STUCK * faces_before as f64;
            if stopped.0 != StopReason::MaxError || is_stuck {
                return Ok((surface, stopped));
            }
        }
    }
}

/// Where a turn leaves more than this of the triangles, another is not worth its time.
const STUCK: f64 = 0.98;

#[cfg(test)]
mod tests;
