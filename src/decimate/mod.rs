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
mod wedges;

use std::ops::ControlFlow;
use std::time::Instant;

use glam::Vec3;

use crate::attributes::Attributes;
use crate::clean::{Cleaning, clean_with};
use crate::error::{Error, Result};
use crate::indexed_mesh::IndexedMesh;
use crate::mesh::{EdgeStore, Full, Medium, Mesh, Oriented, Small, Tier, build, turn_round};
use crate::progress::{self, COLLAPSE, Meter, Progress, Stage};

pub use memory::{available_bytes, needed_bytes, peak_rss_bytes};
pub use options::{
    AttributeUse, AttributeWeights, Boundary, Chunks, Options, Placement, Quality, Targets,
    TierChoice, Topology,
};
pub use report::{Blocked, Report, StopReason, Tally};

use chunked::Chunked;
use cost::{Accumulated, AttributeForms, Cost, Memoryless};
use fit::{Arrays, Terms, fit_to_original};
use flat::Flat;
use geometry::Room;
use greedy::{Greedy, Stop};
use memory::Load;
use surface::Surface;
use wedges::FlatWedges;

/// Decimates a mesh to the first of its targets.
///
/// The mesh is cleaned first (see [`clean`](crate::clean::clean)); then the cheapest edge is collapsed, again and again.
/// Topology is kept: closed stays closed; components, boundary loops and the Euler characteristic
/// stay; nothing non-manifold is born; no face turns by more than 90°; no vertex leaves the box of
/// the cleaned mesh, grown by a tenth of its diagonal. Where the mesh has
/// [weights](IndexedMesh::weights), they multiply what a collapse costs; only their ratios count, and
/// an infinite one keeps its vertex, bit for bit. The result carries none. It depends on the
/// mesh and the options alone, not on the tier or the number of threads.
///
/// # Errors
/// [`Error::InvalidOptions`] for targets outside their range, [`Error::InvalidMesh`] where cleaning
/// leaves no triangle, [`Error::Memory`] where no tier fits a given limit.
pub fn decimate(mesh: IndexedMesh, options: &Options) -> Result<(IndexedMesh, Report)> {
    decimate_for(mesh, options, &mut Meter::unheard())
}

/// [`decimate`], telling `progress` how far it is; breaking cancels it.
///
/// It is called on this thread: where each [stage](Stage) begins, after about every 65 000 triangles
/// that a thread has visited or 3000 that it has removed (a tenth of a second of work, about), and
/// once when all is done. The result does not depend on it.
///
/// ```
/// use std::ops::ControlFlow;
/// use decimate::decimate::{Options, Targets, decimate_with_progress};
/// use decimate::error::Error;
/// # fn main() -> decimate::error::Result<()> {
/// # let mesh = decimate::io::read("data/sample.ply".as_ref(), &Default::default())?;
/// let targets = Targets { ratio: Some(0.1), ..Targets::default() };
/// let options = Options { targets, ..Options::default() };
/// let result = decimate_with_progress(mesh, &options, &mut |progress| {
///     println!("{} {:.0} %", progress.stage, 100.0 * progress.fraction);
///     if progress.fraction < 0.5 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
/// });
/// assert!(matches!(result, Err(Error::Cancelled)));
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// As [`decimate`], and [`Error::Cancelled`] where `progress` breaks, with no further call.
pub fn decimate_with_progress(
    mesh: IndexedMesh,
    options: &Options,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<(IndexedMesh, Report)> {
    decimate_for(mesh, options, &mut Meter::new(progress))
}

/// The share of the work that each stage takes of what is left when it begins, about, so that a
/// fraction runs evenly: as measured on meshes of a million triangles, to a tenth.
const CLEAN: f64 = 0.05;
const CHUNKS: f64 = 0.75;
const CHUNKS_OF_BEST: f64 = 0.4;
const BUILD: f64 = 0.1;
const WHOLE: f64 = 0.95;
const WHOLE_OF_BEST: f64 = 0.5;
const FIT: f64 = 0.95;
const ASSEMBLE: f64 = 0.9;

fn decimate_for(
    mesh: IndexedMesh,
    options: &Options,
    meter: &mut Meter,
) -> Result<(IndexedMesh, Report)> {
    let (vertices_in, triangles_in) = (mesh.positions().len(), mesh.triangle_count());
    options.check()?;
    let target_triangles = options.targets.triangles_of(triangles_in)?;
    let start = Instant::now();
    meter.begin(Stage::Clean, CLEAN, 3 * (vertices_in + triangles_in))?;
    let (mesh, cleaning) = clean_with(mesh, options.weld, meter)?;
    let clean_seconds = start.elapsed().as_secs_f64();
    if mesh.triangles().is_empty() {
        return Err(no_triangle_left(triangles_in, &cleaning));
    }
    let vertices = mesh.positions().len();
    let (tier, tier_reason) =
        memory::choose_tier(options, &Load::of(&mesh, options), target_triangles)?;
    let mut report = Report {
        vertices_in,
        triangles_in,
        cleaning,
        reoriented_faces: 0,
        attribute_seam_edges: 0,
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
    let mesh = run(mesh, options, &mut report, meter)?;
    meter.end()?;
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
    meter: &mut Meter,
) -> Result<IndexedMesh> {
    let start = Instant::now();
    let corners = input.bounds().map(|(min, max)| [min, max]);
    let mut corners = corners.unwrap_or_default();
    let scale = Room::around(corners).scale();
    let mut parts = input.into_parts();
    let origin = parts.origin;
    let mut attributes = std::mem::take(&mut parts.attributes);
    if options.attributes == AttributeUse::Ignore {
        attributes = Attributes::default();
    }
    let mut flat = Flat::<C::State>::of(parts);
    let triangles_start = flat.triangle_count();
    // What is not decimated keeps its attributes as they are, in whatever precision.
    let is_carried = report.target_triangles < triangles_start;
    if is_carried {
        let geometry = (&flat.positions[..], &flat.triangles[..]);
        // Where an error alone is asked for, nobody knows.
        let left = match report.target_triangles {
            0 => triangles_start / 10,
            target => target,
        };
        flat.wedges = FlatWedges::of(&attributes, geometry, scale, left, options);
        attributes.forget_values();
    }
    // Single precision has no room for the scale of a tiny mesh, and takes a larger one exactly.
    let unit = if scale > MODERATE { scale } else { 1.0 };
    rescale(&mut flat.positions, unit);
    rescale(&mut corners, unit);
    let room = Room::around(corners);
    let stop = Stop {
        triangles: report.target_triangles,
        max_error: options.targets.max_error.map(|e| e * scale),
        max_cost: f32::INFINITY,
    };
    let mut job = Job {
        options,
        tally: Tally::default(),
    };
    let original = match options.quality {
        Quality::Best => Some((flat.positions.clone(), flat.triangles.clone())),
        Quality::Fast | Quality::Standard => None,
    };
    let mut is_prepared = false;
    let chunked = Chunked {
        options,
        stop,
        room,
    };
    if chunked.is_worthwhile(&flat) {
        let needs_whole = options.boundary == Boundary::Lock
            || options.feature_angle_degrees.is_some()
            || !flat.wedges.is_nothing();
        is_prepared = needs_whole;
        if needs_whole {
            flat = prepared(flat, options, room, report, meter)?;
        }
        let share = match options.quality {
            Quality::Best => CHUNKS_OF_BEST,
            Quality::Fast | Quality::Standard => CHUNKS,
        };
        meter.begin(Stage::Chunks, share, chunked.work(&flat))?;
        let mut done = chunked.reduce::<S, C>(&mut flat, meter)?;
        if done.is_disoriented {
            is_prepared = true;
            flat = prepared(flat, options, room, report, meter)?;
            meter.begin(Stage::Chunks, share, chunked.work(&flat))?;
            done = chunked.reduce::<S, C>(&mut flat, meter)?;
        }
        if !is_prepared {
            report.non_manifold_edges_in = done.non_manifold_edges_in;
        }
        job.tally = done.tally;
        report.chunks = done.chunks;
        report.chunk_rounds = done.rounds;
        report.collapses_in_chunks = done.tally.collapses;
    }
    report.chunk_seconds = start.elapsed().as_secs_f64();

    let start = Instant::now();
    meter.begin(Stage::Build, BUILD, BUILD_UNITS * flat.triangles.len())?;
    let triangles = std::mem::take(&mut flat.triangles);
    let Oriented { mesh, flipped, .. } =
        Mesh::<S>::oriented_with(flat.positions.len(), triangles, meter)?;
    let (mut surface, states) = flat.into_surface(mesh, room, &flipped);
    meter.work(surface.mesh.face_count())?;
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
        report.attribute_seam_edges = surface.prepare(options, meter)?;
    }
    let (surface, (reason, blocked)) = match original {
        None => job.collapse::<S, C>(surface, states, stop, meter)?,
        Some(original) => job.collapse_and_fit(surface, &original, stop, meter)?,
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
    };

    let slots = surface.mesh.face_slots();
    meter.begin(Stage::Assemble, ASSEMBLE, 2 * slots)?;
    let Flat {
        mut positions,
        mut triangles,
        flags,
        mut wedges,
        ..
    } = surface.into_flat::<()>();
    meter.work(2 * slots)?;
    rescale(&mut positions, unit.recip());
    let (mut turned, mut double_sided) = (Vec::new(), Vec::new());
    if !flags.is_empty() {
        turned.extend(flags.iter().map(|f| f.is_turned()));
        double_sided.extend(flags.iter().map(|f| f.is_double_sided()));
    }
    turn_round(&mut triangles, &turned);
    turn_round(&mut wedges.corners, &turned);
    if is_carried {
        wedges.write_to(&mut attributes);
    }
    if report.tally.pinched_handles > 0 {
        attributes.split_shared_wedges(&triangles);
    }
    report.vertices_out = positions.len();
    let output = IndexedMesh::with_origin(origin, positions, triangles)?
        .with_double_sided(double_sided)?
        .with_attributes(attributes)?;
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
fn prepared<V>(
    mut flat: Flat<V>,
    options: &Options,
    room: Room,
    report: &mut Report,
    meter: &mut Meter,
) -> progress::Result<Flat<V>> {
    let faces = flat.triangles.len();
    meter.begin(Stage::Build, BUILD, (BUILD_UNITS + 2) * faces)?;
    let triangles = std::mem::take(&mut flat.triangles);
    let oriented = Mesh::<Small>::oriented_with(flat.positions.len(), triangles, meter)?;
    let (mut surface, _) = flat.into_surface(oriented.mesh, room, &oriented.flipped);
    report.non_manifold_edges_in = surface.mesh.non_manifold_edge_count();
    report.reoriented_faces = surface.turned.iter().filter(|&&f| f).count();
    meter.work(faces)?;
    report.attribute_seam_edges = surface.prepare(options, meter)?;
    let flat = surface.into_flat();
    meter.work(2 * faces)?;
    Ok(flat)
}

/// What it takes to build a surface, in units of work a face.
const BUILD_UNITS: usize = build::UNITS + 1;

type Stopped = (StopReason, Option<Blocked>);

/// What a run goes by, and what it counts.
struct Job<'a> {
    options: &'a Options,
    tally: Tally,
}

impl Job<'_> {
    /// Collapses under one cost.
    fn collapse<S: EdgeStore, C: Cost<S>>(
        &mut self,
        surface: Surface<S>,
        states: Vec<C::State>,
        stop: Stop,
        meter: &mut Meter,
    ) -> Result<(Surface<S>, Stopped)> {
        let options = self.options;
        let share = match options.quality {
            Quality::Best => WHOLE_OF_BEST,
            Quality::Fast | Quality::Standard => WHOLE,
        };
        let before = COST_UNITS * surface.mesh.face_slots();
        let collapsed = surface.triangles().saturating_sub(stop.triangles);
        meter.begin(Stage::Collapse, share, before + COLLAPSE * collapsed)?;
        let cost = if states.is_empty() {
            C::new(&surface, options, meter)?
        } else {
            C::with_states(&surface, options, states, meter)?
        };
        let mut greedy =
            Greedy::<S, C, C::Queue>::new(surface, cost, options.topology, self.tally, meter)?;
        let stopped = greedy.run(stop, options.check, meter)?;
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
        meter: &mut Meter,
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
            (surface, stopped) =
                self.collapse::<S, Memoryless>(surface, Vec::new(), stop, meter)?;
            let faces_before = std::mem::replace(&mut faces, surface.mesh.face_count());
            if faces == faces_before {
                return Ok((surface, stopped));
            }
            let forms = AttributeForms::new(&surface);
            let before: Option<Vec<Vec3>> = forms
                .as_ref()
                .map(|_| surface.geometry.positions().collect());
            let bytes = fit_to_original(&mut surface, original, &terms, meter)?;
            if let (Some(forms), Some(before)) = (forms, before) {
                forms.follow(&mut surface, &before);
            }
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

/// What it takes to make a cost model and to queue all candidates, in units of work a face.
const COST_UNITS: usize = 4 + greedy::EVALUATION;

/// Where a turn leaves more than this of the triangles, another is not worth its time.
const STUCK: f64 = 0.98;

#[cfg(test)]
mod attribute_tests;
#[cfg(test)]
mod tests;
