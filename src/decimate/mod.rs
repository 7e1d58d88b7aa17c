//! From one mesh to another with fewer triangles.

mod cost;
mod geometry;
mod greedy;
mod memory;
mod options;
mod queue;
mod report;
mod rules;

use std::ops::ControlFlow;
use std::time::Instant;

use crate::clean::{Cleaning, clean};
use crate::error::{Error, Result};
use crate::indexed_mesh::IndexedMesh;
use crate::mesh::{Compaction, EdgeStore, Full, Medium, Mesh, Oriented, Small, Tier, turn_round};

pub use memory::{available_bytes, needed_bytes, peak_rss_bytes};
pub use options::{Boundary, Options, Placement, Targets, TierChoice};
pub use report::{Blocked, Report, StopReason, Tally};

use cost::Memoryless;
use geometry::Geometry;
use greedy::{Greedy, Stop};
use queue::LazyHeap;

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
/// stay; nothing non-manifold is born; no face turns by more than 90°. The result depends on the
/// mesh and the options alone, not on the tier or the number of threads.
///
/// # Errors
/// [`Error::InvalidOptions`] for targets outside their range, [`Error::InvalidMesh`] where cleaning
/// leaves no triangle, [`Error::Memory`] where no tier fits a given limit.
pub fn decimate(mesh: IndexedMesh, options: &Options) -> Result<(IndexedMesh, Report)> {
    decimate_with_progress(mesh, options, &mut |_| ControlFlow::Continue(()))
}

/// [`decimate`], telling `progress` now and then how far it is; breaking stops it with the mesh as
/// it is by then.
///
/// # Errors
/// As [`decimate`].
pub fn decimate_with_progress(
    mesh: IndexedMesh,
    options: &Options,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<(IndexedMesh, Report)> {
    let (vertices_in, triangles_in) = (mesh.positions().len(), mesh.triangle_count());
    let target_triangles = options.targets.triangles_of(triangles_in)?;
    let start = Instant::now();
    let (mesh, cleaning) = clean(mesh, options.weld)?;
    let clean_seconds = start.elapsed().as_secs_f64();
    if mesh.triangles().is_empty() {
        return Err(no_triangle_left(triangles_in, &cleaning));
    }
    let (vertices, faces) = (mesh.positions().len(), mesh.triangles().len());
    let (tier, tier_reason) = memory::choose_tier(options, vertices, faces)?;
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
        read_seconds: 0.0,
        clean_seconds,
        build_seconds: 0.0,
        decimate_seconds: 0.0,
        write_seconds: 0.0,
        peak_rss_bytes: None,
    };
    let mesh = match tier {
        Tier::Full => run::<Full>(mesh, options, &mut report, progress),
        Tier::Medium => run::<Medium>(mesh, options, &mut report, progress),
        Tier::Small => run::<Small>(mesh, options, &mut report, progress),
    }?;
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

fn run<S: EdgeStore>(
    input: IndexedMesh,
    options: &Options,
    report: &mut Report,
    progress: &mut dyn FnMut(Progress) -> ControlFlow<()>,
) -> Result<IndexedMesh> {
    let start = Instant::now();
    let diagonal = input.diagonal();
    let (origin, positions, triangles, mut double_sided) = input.into_parts();
    let Oriented {
        mut mesh,
        mut flipped,
        ..
    } = Mesh::<S>::oriented(positions.len(), triangles);
    let mut geometry = Geometry::new(positions, diagonal);
    report.mesh_bytes = mesh.bytes() + geometry.bytes();
    report.non_manifold_edges_in = mesh.non_manifold_edge_count();
    report.reoriented_faces = flipped.iter().filter(|&&f| f).count();
    report.build_seconds = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let locked = match options.boundary {
        Boundary::Lock => boundary_vertices(&mesh),
        Boundary::Keep | Boundary::Free => Vec::new(),
    };
    let cost = Memoryless::new(&mesh, &geometry, options.boundary, options.placement);
    let scale = geometry.scale();
    let mut greedy =
        Greedy::<_, _, LazyHeap>::new(&mut mesh, &mut geometry, cost, locked, &double_sided);
    let stop = Stop {
        triangles: report.target_triangles,
        max_error: options.targets.max_error.map(|e| e * scale),
    };
    let triangles_start = greedy.triangles();
    let triangles_target = stop.triangles.min(triangles_start);
    let (reason, blocked) = greedy.run(stop, options.check, &mut |triangles| {
        progress(Progress {
            triangles_start,
            triangles,
            triangles_target,
        })
    })?;
    report.tally = greedy.tally();
    report.max_error_estimate = greedy.max_deviation() / scale;
    report.triangles_out = greedy.triangles();
    report.stop_reason = reason;
    report.blocked = blocked;
    // An error alone is no target to fall short of, and reaching it is no falling short.
    let wanted = options.targets.ratio.is_some() || options.targets.triangles.is_some();
    report.stopped_short = match reason {
        StopReason::Target | StopReason::MaxError => false,
        StopReason::Blocked => wanted,
        StopReason::Cancelled => true,
    };
    drop(greedy);

    let map = mesh.compact();
    let mut positions = geometry.into_positions();
    Compaction::retain(&map.vertices, &mut positions);
    Compaction::retain(&map.faces, &mut double_sided);
    Compaction::retain(&map.faces, &mut flipped);
    let mut triangles = mesh.triangles();
    drop(mesh);
    turn_round(&mut triangles, &flipped);
    report.vertices_out = positions.len();
    let output =
        IndexedMesh::with_origin(origin, positions, triangles)?.with_double_sided(double_sided)?;
    report.decimate_seconds = start.elapsed().as_secs_f64();
    Ok(output)
}

/// A flag for each vertex that lies on a boundary edge.
fn boundary_vertices<S: EdgeStore>(mesh: &Mesh<S>) -> Vec<bool> {
    let mut on_boundary = vec![false; mesh.vertex_slots()];
    for e in mesh.edges().filter(|&e| mesh.is_boundary(e)) {
        for v in mesh.edge_vertices(e) {
            on_boundary[v.index()] = true;
        }
    }
    on_boundary
}

#[cfg(test)]
mod tests;
