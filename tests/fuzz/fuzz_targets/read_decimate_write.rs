//! Any bytes as a mesh file, decimated, written and read again.
//!
//! The first three bytes choose the format to read, how to decimate, and how to write.

#![no_main]

use std::io::Cursor;
use std::path::Path;

use decimate::attributes::{Attributes, Channel, Kind, NumberType, Property};
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
    let copies = back.positions().len() - mesh.positions().len().min(back.positions().len());
    let is_gltf = matches!(format, Format::Gltf | Format::Glb);
    if format != Format::Stl && !is_gltf && copies == 0 {
        assert!(back.triangles().iter().copied().eq(mesh.sides()), "numbers");
        assert_eq!(back.positions().len(), mesh.positions().len());
    }
    // A vertex stands more than once where something else than texture coordinates differs within it, and
    // in glTF in each group that has it.
    let attributes = mesh.attributes();
    let has_parts = is_gltf && attributes.groups.len() > 1;
    let may_copy = format == Format::Stl || has_parts || !attributes.channels.is_empty();
    assert!(copies == 0 || may_copy, "{copies} copies of vertices");
    // The digits that tell a single from others may say something else in double precision.
    let is_far = [mesh, &back]
        .iter()
        .any(|m| m.origin().to_array() != [0.0; 3]);
    let is_single = format == Format::Stl && !options.ascii;
    // Positions relative to an origin, or that lose it, have the precision of what they span.
    let span = |mesh: &IndexedMesh| {
        let points = mesh.positions().iter().map(|p| p.as_dvec3());
        let finite = points.filter(|p| p.is_finite());
        finite.fold(0.0, |most: f64, p| most.max(p.abs().max_element()))
    };
    let step = f64::from(f32::EPSILON) * span(mesh).max(span(&back));
    let corners = |mesh: &IndexedMesh, are_sorted: bool| -> Vec<[f64; 3]> {
        let points: Vec<_> = mesh.points().collect();
        let mut order: Vec<usize> = (0..mesh.triangles().len()).collect();
        if !are_sorted && !mesh.attributes().group_of.is_empty() {
            order.sort_by_key(|&i| side_by_side(mesh.attributes(), i));
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
    for (p, q) in corners(mesh, !is_gltf)
        .into_iter()
        .flatten()
        .zip(corners(&back, true).into_iter().flatten())
    {
        let is_equal = match () {
            () if p.is_nan() || !p.is_finite() => p.is_nan() == q.is_nan(),
            () if is_single => (p as f32).to_bits() == (q as f32).to_bits(),
            () if is_far => (p - q).abs() <= step,
            () => p.to_bits() == q.to_bits() || p == q,
        };
        assert!(is_equal, "{p} was read back as {q}");
    }
    check_carried(mesh, &back, format);
}

/// The place in a glTF file of a triangle's object, which is that of the first group with triangles, and
/// of its group: triangles of a group stand side by side there, and groups of an object.
fn side_by_side(attributes: &Attributes, i: usize) -> [u32; 2] {
    let object = |g: u32| &attributes.groups[g as usize].object;
    let group = attributes.group_of[i];
    let of_object = attributes
        .group_of
        .iter()
        .filter(|&&g| object(g) == object(group));
    [*of_object.min().expect("it is one"), group]
}

/// Each corner has the numbers that it had, of each channel that the format has a place for, and each
/// triangle its names and values.
fn check_carried(mesh: &IndexedMesh, back: &IndexedMesh, format: Format) {
    if !matches!(format, Format::Ply | Format::Obj) {
        return;
    }
    let names = |mesh: &IndexedMesh| -> Vec<[String; 3]> {
        let attributes = mesh.attributes();
        let sides = (0..mesh.triangles().len()).flat_map(|i| {
            let count = 1 + usize::from(mesh.is_double_sided(i));
            std::iter::repeat_n(i, count)
        });
        let group = |i: usize| Some(&attributes.groups[*attributes.group_of.get(i)? as usize]);
        let names = sides.map(|i| match group(i) {
            Some(g) => [&g.object, &g.name, &g.material].map(String::clone),
            None => Default::default(),
        });
        names.collect()
    };
    assert_eq!(names(mesh), names(back));
    // By one channel of a kind, since an OBJ file has no names for them. Bytes become fractions there, and
    // doubles singles.
    for channel in &mesh.attributes().channels {
        let is_same_kind = |c: &&Channel| c.kind == channel.kind;
        let count = mesh
            .attributes()
            .channels
            .iter()
            .filter(is_same_kind)
            .count();
        let is_single = |p: &Property| p.number == NumberType::F32;
        let is_kept = format == Format::Ply || channel.components.iter().all(is_single);
        let has_place = format == Format::Ply || channel.kind != Kind::Scalar;
        if count != 1 || !is_kept || !has_place || mesh.triangles().is_empty() {
            continue;
        }
        let other = back.attributes().channels.iter().find(is_same_kind);
        let Some(other) = other else {
            panic!("no {:?} was read back", channel.components);
        };
        let width = channel.width().min(other.width());
        let rows = |mesh: &IndexedMesh, channel: &Channel| -> Vec<Vec<Option<u64>>> {
            let corners = mesh.attributes().corners.iter().enumerate();
            let sides = corners.flat_map(|(i, &[a, b, c])| {
                let back = mesh.is_double_sided(i).then_some([a, c, b]);
                std::iter::once([a, b, c]).chain(back)
            });
            // Textures of glTF are turned over where they are written to a file that counts upwards.
            let is_down = mesh.attributes().v_is_down;
            let is_turned = is_down && channel.kind == Kind::TextureCoordinate;
            let upwards = move |(i, x): (usize, f64)| match channel.components[i].number {
                _ if i != 1 || !is_turned => x,
                NumberType::F32 => f64::from((1.0 - x) as f32),
                number => number.range().map_or(1.0, |(_, most)| most) - x,
            };
            let row = |wedge: u32| {
                let row = channel.row(wedge as usize).take(width);
                row.enumerate().map(upwards)
            };
            // Zero has no sign in integers.
            let bits = |x: f64| {
                if x.is_nan() {
                    None
                } else {
                    Some((x + 0.0).to_bits())
                }
            };
            sides
                .flatten()
                .map(|wedge| row(wedge).map(bits).collect())
                .collect()
        };
        assert_eq!(
            rows(mesh, channel),
            rows(back, other),
            "{:?}",
            channel.components
        );
    }
}
