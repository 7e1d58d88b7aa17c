//! What is written is read back: every format, binary and text.

use std::path::Path;

use decimate::indexed_mesh::IndexedMesh;
use decimate::io::{self, Format, ReadOptions, WriteOptions};
use glam::{DVec3, Vec3};

/// Every way to write a mesh, with the name of the file.
const WAYS: [(&str, Format, bool); 8] = [
    ("binary.ply", Format::Ply, false),
    ("ascii.ply", Format::Ply, true),
    ("text.obj", Format::Obj, false),
    ("binary.stl", Format::Stl, false),
    ("ascii.stl", Format::Stl, true),
    ("text.off", Format::Off, false),
    ("text.gltf", Format::Gltf, false),
    ("binary.glb", Format::Glb, false),
];

fn write_and_read(mesh: &IndexedMesh, name: &str, options: &WriteOptions) -> IndexedMesh {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(name);
    io::write(&path, mesh, options).unwrap();
    io::read(&path, &ReadOptions::default()).unwrap()
}

/// A mesh's triangles as the bits of their corners, which STL keeps as well.
fn corner_bits(mesh: &IndexedMesh) -> Vec<[[u32; 3]; 3]> {
    let bits = |v: u32| mesh.positions()[v as usize].to_array().map(f32::to_bits);
    mesh.sides().map(|triangle| triangle.map(bits)).collect()
}

/// Zero of both signs, the smallest and the largest floats, and what no decimal shows exactly.
fn awkward() -> IndexedMesh {
    let numbers = [
        0.1,
        -0.0,
        0.0,
        f32::MIN_POSITIVE,
        f32::from_bits(1),
        f32::MAX,
        f32::MIN,
    ];
    let more = [
        1.0e-30,
        123_456.79,
        1.0 / 3.0,
        -7.0e9,
        16_777_216.0,
        1.0e-5,
        9.999_999e-6,
    ];
    let all: Vec<f32> = numbers.into_iter().chain(more).collect();
    let positions: Vec<Vec3> = (0..all.len())
        .map(|i| Vec3::new(all[i], all[(i + 1) % 14], all[(i + 5) % 14]))
        .collect();
    let triangles = (0..12).map(|i| [i, i + 1, i + 2]).collect();
    IndexedMesh::new(positions, triangles).unwrap()
}

/// What a name says of a file, it says of bytes that come from elsewhere.
#[test]
fn bytes_are_written_and_read_as_files_are() {
    let mesh = awkward();
    for (name, _, ascii) in WAYS {
        let options = WriteOptions {
            ascii,
            ..Default::default()
        };
        let mut bytes = Vec::new();
        io::write_to(Path::new(name), &mut bytes, &mesh, &options).unwrap();
        let length = Some(bytes.len() as u64);
        let source = std::io::Cursor::new(bytes);
        let back = io::read_from(Path::new(name), source, length, &ReadOptions::default());
        assert_eq!(corner_bits(&back.unwrap()), corner_bits(&mesh), "{name}");
    }
    let empty = io::read_from(
        Path::new("a.obj"),
        std::io::empty(),
        None,
        &ReadOptions::default(),
    );
    assert_eq!(
        empty.unwrap_err().to_string(),
        "a.obj: the file is empty; expected a mesh"
    );
}

#[test]
fn every_format_keeps_every_bit() {
    let mesh = awkward();
    for (name, _, ascii) in WAYS {
        let back = write_and_read(
            &mesh,
            name,
            &WriteOptions {
                ascii,
                ..Default::default()
            },
        );
        assert_eq!(corner_bits(&back), corner_bits(&mesh), "{name}");
        if !name.ends_with("stl") {
            assert_eq!(back.triangles(), mesh.triangles(), "{name}");
            assert_eq!(back.positions().len(), mesh.positions().len(), "{name}");
        }
    }
}

/// Vertices that no triangle uses are written too, so that numbers stay; but STL and glTF have
/// none.
#[test]
fn isolated_vertices_and_empty_meshes_pass() {
    let isolated = IndexedMesh::new(vec![Vec3::X, Vec3::Y, Vec3::Z], Vec::new()).unwrap();
    for (name, format, ascii) in WAYS {
        let back = write_and_read(
            &isolated,
            name,
            &WriteOptions {
                ascii,
                ..Default::default()
            },
        );
        let has_triangles_alone = matches!(format, Format::Stl | Format::Gltf | Format::Glb);
        let vertices = if has_triangles_alone { 0 } else { 3 };
        assert_eq!(
            (back.positions().len(), back.triangle_count()),
            (vertices, 0),
            "{name}"
        );
    }
}

#[test]
fn both_sides_of_a_double_sided_triangle_are_written() {
    let mesh = IndexedMesh::new(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
    let mesh = mesh.with_double_sided(vec![true]).unwrap();
    for (name, _, ascii) in WAYS {
        let back = write_and_read(
            &mesh,
            name,
            &WriteOptions {
                ascii,
                ..Default::default()
            },
        );
        assert_eq!(back.triangle_count(), 2, "{name}");
        assert_eq!(corner_bits(&back), corner_bits(&mesh), "{name}");
    }
}

/// Millimetres, five thousand kilometres away: half a metre is all that floats can tell there.
#[test]
fn a_far_mesh_keeps_its_precision() {
    let origin = DVec3::new(5_000_000.0, 400_000.0, 0.0);
    let positions = vec![
        Vec3::ZERO,
        Vec3::new(0.001, 0.0, 0.0),
        Vec3::new(0.0, 1.002, 0.003),
    ];
    let mesh = IndexedMesh::with_origin(origin, positions, vec![[0, 1, 2]]).unwrap();
    for (name, format, ascii) in WAYS {
        if (format, ascii) == (Format::Stl, false) {
            continue;
        }
        let back = write_and_read(
            &mesh,
            name,
            &WriteOptions {
                ascii,
                ..Default::default()
            },
        );
        assert_ne!(back.origin(), DVec3::ZERO, "{name}");
        for (p, q) in back.points().zip(mesh.points()) {
            assert!((p - q).length() < 1.0e-6, "{name}: {p} is not {q}");
        }
    }
}

#[test]
fn precision_is_significant_digits() {
    let position = Vec3::new(1234.5678, 0.000_123_456, -1.0 / 3.0);
    let mesh = IndexedMesh::new(vec![position, Vec3::ZERO], Vec::new()).unwrap();
    let options = WriteOptions {
        precision: Some(3),
        ..Default::default()
    };
    let back = write_and_read(&mesh, "a.obj", &options);
    assert_eq!(back.positions()[0].to_array(), [1230.0, 0.000_123, -0.333]);
    for precision in [Some(0), Some(18)] {
        let options = WriteOptions {
            precision,
            ..Default::default()
        };
        assert!(io::write(Path::new("/dev/null"), &mesh, &options).is_err());
    }
}

/// An explicit format wins over the name when writing; the content does when reading.
#[test]
fn the_name_need_not_tell_the_format() {
    let mesh = awkward();
    for format in [Format::Ply, Format::Stl, Format::Off] {
        let options = WriteOptions {
            format: Some(format),
            ascii: true,
            precision: None,
        };
        let back = write_and_read(&mesh, "mesh.obj", &options);
        assert_eq!(corner_bits(&back), corner_bits(&mesh), "{format}");
    }
    let error = io::write(Path::new("a.xyz"), &mesh, &WriteOptions::default()).unwrap_err();
    assert!(
        error
            .to_string()
            .contains("expected ply, obj, stl, off, gltf or glb"),
        "{error}"
    );
    let error = io::write(Path::new("-"), &mesh, &WriteOptions::default()).unwrap_err();
    assert!(error.to_string().contains("--output-format"), "{error}");
    assert_eq!("STL".parse::<Format>().unwrap(), Format::Stl);
    assert!("xyz".parse::<Format>().is_err());
}

/// `f32` numbers are written as such, not as the `f64` that they are exactly.
#[test]
fn text_is_short() {
    let mesh = IndexedMesh::new(vec![Vec3::new(0.1, 1.0e-20, -2.0)], Vec::new()).unwrap();
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.obj");
    io::write(&path, &mesh, &WriteOptions::default()).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "v 0.1 1e-20 -2\n");
}

/// Each file cut off after every byte, and with bytes replaced: read or refused, never a panic.
#[test]
fn damaged_files_never_panic() {
    let mesh = awkward();
    let directory = tempfile::tempdir().unwrap();
    let mut random = 0x2545_F491_4F6C_DD1D_u64;
    let mut next = |below: usize| {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        (random % below as u64) as usize
    };
    let mut refused = 0;
    for (name, format, ascii) in WAYS {
        let path = directory.path().join(name);
        io::write(
            &path,
            &mesh,
            &WriteOptions {
                ascii,
                ..Default::default()
            },
        )
        .unwrap();
        let whole = std::fs::read(&path).unwrap();
        let mut damaged: Vec<Vec<u8>> = (0..whole.len()).map(|n| whole[..n].to_vec()).collect();
        for _ in 0..2000 {
            let mut bytes = whole.clone();
            for _ in 0..=next(4) {
                let wild = [
                    next(256) as u8,
                    b'0' + next(10) as u8,
                    b"\n\r -.#/\\"[next(8)],
                    255,
                ];
                let i = next(bytes.len());
                bytes[i] = wild[next(4)];
            }
            damaged.push(bytes);
        }
        for bytes in damaged {
            std::fs::write(&path, bytes).unwrap();
            let options = ReadOptions {
                format: Some(format),
                ..ReadOptions::default()
            };
            refused += usize::from(io::read(&path, &options).is_err());
        }
    }
    assert!(
        refused > 1000,
        "damage goes unnoticed: only {refused} files refused"
    );
}
