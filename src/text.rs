//! What the command says, as text for a person.

use std::path::Path;

use decimate::decimate::{Report, StopReason};
use decimate::metrics::{
    AttributeComparison, ChannelComparison, Comparison, Info, TextureComparison, TwoSided, Unit,
};
use decimate::repair::CutReport;
use decimate::structures::{Cost, Measured, Query, Row};
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
        if report.stopped_short && report.attribute_seam_edges > 0 {
            text += &format!(
                "attribute seams and borders of materials are kept ({} edges); --attributes carry lets \
                 the seams go, ignore both\n",
                report.attribute_seam_edges
            );
        }
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
    attribute_rows(compared, &mut row);
    let names = compared
        .iter()
        .map(|c| format!(" {:>width$}", file_name(c)));
    let header = format!("{:36}{}\n", "", names.collect::<String>());
    let first_row = text.find('\n').map_or(0, |end| end + 1);
    text.insert_str(first_row, &header);
    text
}

/// Adds a row: its name, and what stands in a mesh's column.
type AddRow<'a> = &'a mut dyn FnMut(&str, &dyn Fn(&Comparison) -> String);

/// The rows of the attributes that one of the meshes shares with the reference, in the order in which
/// they are met, and of those that have no partner.
fn attribute_rows(compared: &[Compared], row: AddRow) {
    let all = |c: &Comparison| c.attributes.clone();
    let comparisons: Vec<AttributeComparison> =
        compared.iter().filter_map(|c| all(&c.comparison)).collect();
    if comparisons.is_empty() {
        return;
    }
    let mut channels: Vec<&ChannelComparison> = Vec::new();
    for channel in comparisons.iter().flat_map(|c| &c.channels) {
        if !channels.iter().any(|c| c.name == channel.name) {
            channels.push(channel);
        }
    }
    for ChannelComparison {
        name,
        unit,
        texture,
        ..
    } in channels
    {
        let unit = match unit {
            Unit::Degrees => "degrees",
            Unit::TextureUnits => "texture units",
            Unit::OfFullRange => "of full range",
            _ => "its own units",
        };
        let cell = |of: &dyn Fn(&ChannelComparison) -> Option<String>, c: &Comparison| {
            let channels = c.attributes.iter().flat_map(|a| &a.channels);
            let found = channels.filter(|c| c.name == *name).find_map(of);
            found.unwrap_or("-".into())
        };
        let mut difference = |label: &str, of: fn(&ChannelComparison) -> f64| {
            row(label, &|c| {
                cell(&|channel| Some(format!("{:.4e}", of(channel))), c)
            });
        };
        difference(&format!("{name} ({unit}), rms"), |c| c.two_sided.rms);
        difference("  from reference", |c| c.from_reference.rms);
        difference("  from mesh", |c| c.from_mesh.rms);
        difference("  mean", |c| c.two_sided.mean);
        difference("  largest", |c| c.two_sided.max);
        if texture.is_some() {
            let mut count = |label: &str, of: fn(&TextureComparison) -> usize| {
                row(label, &|c| {
                    cell(
                        &|channel| channel.texture.as_ref().map(|t| of(t).to_string()),
                        c,
                    )
                });
            };
            count("  charts", |t| t.mesh_charts);
            count("  flipped chart triangles", |t| {
                t.mesh_flipped_chart_triangles
            });
            count("  turned against the reference", |t| {
                t.triangles_turned_against_reference
            });
        }
    }
    let names = |names: &[String]| match names {
        [] => "none".into(),
        names => names.join(", "),
    };
    let mut only = |label: &str, of: fn(&AttributeComparison) -> &[String]| {
        if comparisons.iter().any(|c| !of(c).is_empty()) {
            row(label, &|c| {
                c.attributes.as_ref().map_or("-".into(), |a| names(of(a)))
            });
        }
    };
    only("attributes of the reference alone", |c| {
        &c.only_in_reference
    });
    only("attributes of the mesh alone", |c| &c.only_in_mesh);
}

/// The structures as two tables, a row each: the paper's Table 1 with what was measured beside it,
/// and times; then why a row is empty.
pub fn structures(measured: &Measured) -> String {
    let face = measured.face_name;
    let mut text = format!(
        "{} {face}s, {} vertices, {} edges ({} boundary, {} non-manifold)",
        measured.faces,
        measured.vertices,
        measured.edges,
        measured.boundary_edges,
        measured.non_manifold_edges,
    );
    if measured.dropped_faces > 0 {
        text += &format!("; {} {face}s left out", measured.dropped_faces);
    }
    text += &format!("\n\n{}\n{}", bytes(measured), times(measured));
    let refused = measured.structures.iter().filter_map(|row| {
        let why = row.cannot_carry.as_ref()?;
        Some(format!("{} cannot carry it: {why}\n", row.structure))
    });
    let refused: String = refused.collect();
    if !refused.is_empty() {
        text += &format!(
            "\n{refused}Vertices are counted from 0, those that cleaning drops left out.\n"
        );
    }
    text
}

/// What the structures store.
fn bytes(measured: &Measured) -> String {
    let face = measured.face_name;
    let note = format!(
        "Bytes. Formula: a large closed mesh by the words that are stored. Stated: by the paper a {face}, \
         by the chapter a vertex.\nM stored, C computed in constant time, - neither.\n"
    );
    let redundant = |row: &Row| {
        let share = row.redundancy_share;
        share.map_or("-".into(), |share| format!("{:.0} %", 100.0 * share))
    };
    let carries = |row: &Row| {
        String::from(if row.carries_non_manifold {
            "yes"
        } else {
            "no"
        })
    };
    let columns: [Column; 13] = [
        ("structure".into(), &|row| row.structure.into()),
        (format!("bytes/{face}"), &|row| number(row.per_face.bytes)),
        ("formula".into(), &|row| {
            number(Some(row.per_face.bytes_formula))
        }),
        ("stated".into(), &|row| whole(row.per_face.bytes_stated)),
        ("bytes/vertex".into(), &|row| number(row.bytes_per_vertex)),
        ("formula".into(), &|row| {
            number(Some(row.bytes_per_vertex_formula))
        }),
        ("stated".into(), &|row| whole(row.bytes_per_vertex_stated)),
        ("redundant".into(), &redundant),
        ("non-manifold".into(), &carries),
        ("neighbours".into(), &|row| {
            row.neighbourhood.symbol().into()
        }),
        ("point".into(), &|row| row.point_reference.symbol().into()),
        ("prev".into(), &|row| row.previous_edge.symbol().into()),
        ("next".into(), &|row| row.next_edge.symbol().into()),
    ];
    note + &table(&columns, &measured.structures)
}

/// What building, questions and modification take.
fn times(measured: &Measured) -> String {
    let face = measured.face_name;
    let note = format!(
        "Nanoseconds: build a {face}, queries and flips at random places. * looks at every {face}.\n"
    );
    let query = |query: Query| {
        move |row: &Row| {
            let time = row.queries.get(query);
            let mark = if time.cost == Cost::Search { "*" } else { "" };
            time.ns.map_or("-".into(), |ns| number(Some(ns)) + mark)
        }
    };
    let queries = Query::ALL.map(|q| (q.symbol().to_string(), query(q)));
    let mut columns: Vec<Column> = vec![
        ("structure".into(), &|row| row.structure.into()),
        ("build".into(), &|row| number(row.per_face.construct_ns)),
    ];
    for (name, cell) in &queries {
        columns.push((name.clone(), cell));
    }
    columns.push(("flip".into(), &|row| number(row.edge_flip_ns)));
    note + &table(&columns, &measured.structures)
}

/// A column: its name, and what stands in a row.
type Column<'a> = (String, &'a dyn Fn(&Row) -> String);

/// Columns side by side, as wide as they must be; the first to the left, the others to the right.
fn table(columns: &[Column], rows: &[Row]) -> String {
    let width = |(name, cell): &Column| {
        let cells = rows.iter().map(|row| cell(row).chars().count());
        cells.chain([name.chars().count()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = columns.iter().map(width).collect();
    let line = |cells: &mut dyn Iterator<Item = String>| {
        let mut line = String::new();
        for (i, (cell, width)) in cells.zip(&widths).enumerate() {
            line += &match i {
                0 => format!("{cell:width$}"),
                _ => format!("  {cell:>width$}"),
            };
        }
        line.trim_end().to_string() + "\n"
    };
    let mut text = line(&mut columns.iter().map(|(name, _)| name.clone()));
    for row in rows {
        text += &line(&mut columns.iter().map(|(_, cell)| cell(row)));
    }
    text
}

/// A measured number with as many places as it deserves.
fn number(x: Option<f64>) -> String {
    match x {
        None => "-".into(),
        Some(x) if x < 1000.0 => format!("{x:.1}"),
        Some(x) => format!("{x:.0}"),
    }
}

fn whole(x: Option<u32>) -> String {
    x.map_or("-".into(), |x| x.to_string())
}
