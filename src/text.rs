//! What the command says, as text for a person.

use std::path::Path;

use decimate::decimate::{Report, StopReason};
use decimate::metrics::{Comparison, Info, TwoSided};
use decimate::repair::CutReport;
use serde::Serialize;

/// A mesh held against the reference, with the names of both files.
#[derive(Serialize)]
pub struct Compared {
    /// The reference.
    pub reference_file: String,
    /// The mesh.
    pub mesh_file: String,
    /// What was measured.
    #[serde(flatten)]
    pub comparison: Comparison,
}

/// What was done, in a few lines for a person.
pub fn summary(input: &Path, output: &Path, report: &Report) -> String {
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

/// What a cut did, in a few lines for a person.
pub fn repair(input: &Path, output: &Path, report: &CutReport) -> String {
    format!(
        "{} -> {}: {} vertices copied ({} -> {})\n\
         non-manifold edges {} -> {}, non-manifold vertices {} -> {}, components {} -> {}, \
         boundary edges {} -> {}\n",
        input.display(),
        output.display(),
        report.vertices_copied,
        report.cleaning.kept_vertices,
        report.vertices_out,
        report.non_manifold_edges_in,
        report.non_manifold_edges_out,
        report.non_manifold_vertices_in,
        report.non_manifold_vertices_out,
        report.components_in,
        report.components_out,
        report.boundary_edges_in,
        report.boundary_edges_out,
    )
}

/// The counts of a mesh as a table.
pub fn info(info: &Info) -> String {
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
pub fn comparison(compared: &[Compared]) -> String {
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
