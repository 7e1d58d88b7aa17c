//! Any bytes as a mesh file, decimated, written and read again.
//!
//! The first three bytes choose the format to read, how to decimate, and how to write.

#![no_main]

use std::io::Cursor;
use std::path::Path;

use decimate::decimate::{Boundary, Options, Placement, Quality, Targets, Topology};
use decimate::indexed_mesh::IndexedMesh;
use decimate::io::{Format, ReadOptions, WriteOptions, read_from, write_to};
use decimate_fuzz::{decimating, stay_on_one_thread};
use libfuzzer_sys::fuzz_target;

/// Checked after every collapse in linear time, in three tiers.
const MOST_TRIANGLES: usize = 400;

fuzz_target!(|bytes: &[u8]| {
    stay_on_one_thread();
    let &[format, how, way, ref file @ ..] = bytes else {
        return;
    };
    let format = Format::ALL[usize::from(format) % Format::ALL.len()];
    let Some(mesh) = read(file.to_vec(), format) else {
        return;
    };
    if mesh.triangle_count() > MOST_TRIANGLES {
        return;
    }
    if let Some(out) = decimating::attack_decimation(&mesh, &options(how)) {
        write_and_read(&mesh, way);
        write_and_read(&out, way);
    }
});

fn read(bytes: Vec<u8>, format: Format) -> Option<IndexedMesh> {
    let length = Some(bytes.len() as u64);
    let options = ReadOptions {
        format: Some(format),
        ..ReadOptions::default()
    };
    read_from(Path::new("a"), Cursor::new(bytes), length, &options).ok()
}

fn options(how: u8) -> Options {
    let bit = |i: u8| how >> i & 1 == 1;
    Options {
        targets: Targets {
            ratio: Some(if bit(0) { 0.0 } else { 0.5 }),
            ..Targets::default()
        },
        quality: [Quality::Fast, Quality::Standard, Quality::Best][usize::from(how >> 1 & 3) % 3],
        boundary: [Boundary::Keep, Boundary::Lock][usize::from(bit(3))],
        topology: [Topology::Preserve, Topology::Simplify][usize::from(bit(4))],
        placement: [Placement::Optimal, Placement::Endpoint][usize::from(bit(5))],
        feature_angle_degrees: bit(6).then_some(45.0),
        weld: !bit(7),
        check: true,
        ..Options::default()
    }
}

/// What is written is read back: the same triangles, with the same bits or, where the mesh lies far
/// from zero, the same to single precision.
fn write_and_read(mesh: &IndexedMesh, way: u8) {
    let format = Format::ALL[usize::from(way & 0x3F) % Format::ALL.len()];
    let options = WriteOptions {
        format: Some(format),
        ascii: way & 4 == 4,
        precision: None,
    };
    let mut bytes = Vec::new();
    write_to(Path::new("b"), &mut bytes, mesh, &options).expect("a vector takes it");
    let back = read(bytes, format).expect("what was written is a file of its format");
    assert_eq!(back.triangle_count(), mesh.triangle_count());
    let is_gltf = matches!(format, Format::Gltf | Format::Glb);
    if format != Format::Stl && !is_gltf {
        assert!(back.triangles().iter().copied().eq(mesh.sides()), "numbers");
        assert_eq!(back.positions().len(), mesh.positions().len());
    }
    let is_far = mesh.origin().to_array() != [0.0; 3];
    let is_single = format == Format::Stl && !options.ascii;
    // Positions relative to an origin, or that lose it, have the precision of what they span.
    let span = |mesh: &IndexedMesh| {
        let points = mesh.positions().iter().map(|p| p.as_dvec3());
        let finite = points.filter(|p| p.is_finite());
        finite.fold(0.0, |most: f64, p| most.max(p.abs().max_element()))
    };
    let step = f64::from(f32::EPSILON) * span(mesh).max(span(&back));
    let corners = |mesh: &IndexedMesh| -> Vec<[f64; 3]> {
        let points: Vec<_> = mesh.points().collect();
        let group_of = |i: usize| mesh.attributes().group_of.get(i);
        // glTF has the triangles of a group side by side.
        let mut order: Vec<usize> = (0..mesh.triangles().len()).collect();
        if is_gltf {
            order.sort_by_key(|&i| group_of(i));
        }
        let sides = order.into_iter().flat_map(|i| {
            let [a, b, c] = mesh.triangles()[i];
            let back = mesh.is_double_sided(i).then_some([a, c, b]);
            std::iter::once([a, b, c]).chain(back)
        });
        sides
            .flatten()
            .map(|v| points[v as usize].to_array())
            .collect()
    };
    for (p, q) in corners(mesh)
        .into_iter()
        .flatten()
        .zip(corners(&back).into_iter().flatten())
    {
        let is_equal = match () {
            () if p.is_nan() || !p.is_finite() => p.is_nan() == q.is_nan(),
            () if is_single => (p as f32).to_bits() == (q as f32).to_bits(),
            () if is_far => (p - q).abs() <= step,
            () => p.to_bits() == q.to_bits() || p == q,
        };
        assert!(is_equal, "{p} was read back as {q}");
    }
}
