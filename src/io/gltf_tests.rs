//! Files of glTF made by hand, read and written.

use std::io::Cursor;
use std::sync::Arc;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DVec3, Vec3};
use serde_json::{Value, json};

use crate::attributes::{Assets, Attributes, Channel, Group, Kind, NumberType, Property, Values};
use crate::error::Result;
use crate::indexed_mesh::IndexedMesh;

use super::{Format, ReadOptions, WriteOptions, cannot_carry, read, read_from, write_to};

const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

/// A document with the bytes that its one buffer has.
struct Maker {
    json: Value,
    bytes: Vec<u8>,
}

impl Maker {
    fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"},
            "accessors": [], "bufferViews": [], "meshes": [],
        });
        Self {
            json,
            bytes: Vec::new(),
        }
    }

    /// The corners (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 2, 1), by two triangles and by mode.
    fn square() -> Self {
        let mut file = Self::new();
        let corners = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 1.0, 0.0],
            [0.0, 1.0, 0.0],
            [2.0, 2.0, 1.0],
        ];
        let positions = file.floats("VEC3", corners.as_flattened());
        let indices = file.shorts(&[0, 1, 2, 0, 2, 3]);
        let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices});
        file.json["meshes"] = json!([{"primitives": [primitive]}]);
        file
    }

    fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        self.bytes.extend(bytes);
        self.push("bufferViews", view)
    }

    fn accessor(&mut self, number: u32, kind: &str, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        let accessor =
            json!({"bufferView": view, "componentType": number, "type": kind, "count": count});
        self.push("accessors", accessor)
    }

    fn floats(&mut self, kind: &str, numbers: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            vector => vector[3..].parse().unwrap(),
        };
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(FLOAT, kind, numbers.len() / width, &bytes)
    }

    fn shorts(&mut self, numbers: &[u16]) -> usize {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        self.accessor(UNSIGNED_SHORT, "SCALAR", numbers.len(), &bytes)
    }

    fn attribute(&mut self, name: &str, accessor: usize) {
        self.json["meshes"][0]["primitives"][0]["attributes"][name] = accessor.into();
    }

    fn binary(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if json.get("buffers").is_none() {
            json["buffers"] = json!([{"byteLength": self.bytes.len()}]);
        }
        binary(json.to_string().as_bytes(), &self.bytes)
    }

    fn read(&self) -> IndexedMesh {
        read_bytes(&self.binary()).unwrap_or_else(|error| panic!("{error}"))
    }

    fn error(&self) -> String {
        read_bytes(&self.binary()).unwrap_err().to_string()
    }
}

fn binary(json: &[u8], bytes: &[u8]) -> Vec<u8> {
    let mut file = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
    for (kind, chunk) in [(b"JSON", json), (b"BIN\0", bytes)] {
        file.extend((chunk.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(chunk);
    }
    let length = file.len() as u32;
    file[8..12].copy_from_slice(&length.to_le_bytes());
    file
}

fn read_bytes(bytes: &[u8]) -> Result<IndexedMesh> {
    let length = Some(bytes.len() as u64);
    let source = Cursor::new(bytes.to_vec());
    read_from("a.glb".as_ref(), source, length, &ReadOptions::default())
}

fn written(mesh: &IndexedMesh, format: Format) -> Vec<u8> {
    let options = WriteOptions {
        format: Some(format),
        ..WriteOptions::default()
    };
    let mut bytes = Vec::new();
    write_to("b".as_ref(), &mut bytes, mesh, &options).unwrap();
    bytes
}

/// Writes in both formats, has another reader check what is written, and reads it.
fn round_trip(mesh: &IndexedMesh) -> IndexedMesh {
    let [binary, text] = [Format::Glb, Format::Gltf].map(|format| {
        let bytes = written(mesh, format);
        gltf::Gltf::from_slice(&bytes).unwrap_or_else(|error| panic!("{format}: {error}"));
        read_bytes(&bytes).unwrap()
    });
    assert_eq!(binary, text);
    binary
}

fn points(mesh: &IndexedMesh) -> Vec<[f64; 3]> {
    mesh.points().map(|p| p.to_array()).collect()
}

/// For every triangle and corner the position and all values, with the names of its group.
fn told(mesh: &IndexedMesh) -> Vec<(String, String, Vec<u64>)> {
    let attributes = mesh.attributes();
    let mut told = Vec::new();
    for (i, triangle) in mesh.triangles().iter().enumerate() {
        let group = attributes
            .group_of
            .get(i)
            .map(|&g| &attributes.groups[g as usize]);
        let (object, material) =
            group.map_or_else(Default::default, |g| (g.object.clone(), g.material.clone()));
        for (k, &v) in triangle.iter().enumerate() {
            let position = mesh.positions()[v as usize].to_array().map(f64::from);
            let mut row = position.to_vec();
            if let Some(corners) = attributes.corners.get(i) {
                let wedge = corners[k] as usize;
                attributes
                    .channels
                    .iter()
                    .for_each(|channel| row.extend(channel.row(wedge)));
            }
            let bits = row.into_iter().map(f64::to_bits).collect();
            told.push((object.clone(), material.clone(), bits));
        }
    }
    told
}

#[test]
fn every_type_of_index_makes_the_same_triangles() {
    let expected = [[0, 1, 2], [0, 2, 3]];
    assert_eq!(Maker::square().read().triangles(), expected);
    for (number, bytes) in [(UNSIGNED_BYTE, 1), (UNSIGNED_SHORT, 2), (UNSIGNED_INT, 4)] {
        let mut file = Maker::square();
        let indices = [0u32, 1, 2, 0, 2, 3].map(|i| i.to_le_bytes());
        let indices: Vec<u8> = indices.iter().flat_map(|i| &i[..bytes]).copied().collect();
        let accessor = file.accessor(number, "SCALAR", 6, &indices);
        file.json["meshes"][0]["primitives"][0]["indices"] = accessor.into();
        assert_eq!(file.read().triangles(), expected);
    }
    let mut file = Maker::square();
    file.json["meshes"][0]["primitives"][0]
        .as_object_mut()
        .unwrap()
        .remove("indices");
    assert_eq!(
        file.read().triangles(),
        [[0, 1, 2]],
        "five corners in a row"
    );
}

/// A zigzag in the plane, and spokes around a point: every triangle looks up.
#[test]
fn strips_and_fans_are_not_turned() {
    for (mode, corners) in [
        (
            5,
            [
                [0.0, 1.0],
                [0.0, 0.0],
                [1.0, 1.0],
                [1.0, 0.0],
                [2.0, 1.0],
                [2.0, 0.0],
            ],
        ),
        (
            6,
            [
                [0.0, 0.0],
                [1.0, 0.0],
                [1.0, 1.0],
                [0.0, 1.0],
                [-1.0, 1.0],
                [-1.0, 0.0],
            ],
        ),
    ] {
        let mut file = Maker::new();
        let corners: Vec<f32> = corners.iter().flat_map(|&[x, y]| [x, y, 0.0]).collect();
        let positions = file.floats("VEC3", &corners);
        let primitive = json!({"mode": mode, "attributes": {"POSITION": positions}});
        file.json["meshes"] = json!([{"primitives": [primitive]}]);
        let mesh = file.read();
        assert_eq!(mesh.triangles().len(), 4, "mode {mode}");
        for triangle in mesh.triangles() {
            let [a, b, c] = triangle.map(|v| mesh.positions()[v as usize]);
            assert_eq!((b - a).cross(c - a), Vec3::Z, "mode {mode}: {triangle:?}");
        }
    }
}

#[test]
fn points_and_lines_are_left_out_with_a_notice() {
    let mut file = Maker::square();
    file.json["meshes"][0]["primitives"][0]["mode"] = 1.into();
    let mesh = file.read();
    assert_eq!((mesh.positions().len(), mesh.triangles().len()), (0, 0));
    let notices = &mesh.attributes().notices;
    assert_eq!(
        notices,
        &["1 primitives have no triangles and are not carried"]
    );
}

/// Twice as large, turned about z by a right angle, moved; below a node that moves in doubles.
#[test]
fn nodes_put_meshes_in_their_place() {
    let mut file = Maker::square();
    let half = 0.5f64.sqrt();
    file.json["nodes"] = json!([
        {"mesh": 0, "rotation": [0, 0, half, half], "scale": [2, 2, 2], "translation": [10, 0, 0]},
        {"translation": [0, 0, 0.125], "children": [0]},
        {"matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 500000000.5, 0, 0, 1], "children": [1]},
    ]);
    let mesh = file.read();
    let expected = [
        [500000010.5, 0.0, 0.125],
        [500000010.5, 2.0, 0.125],
        [500000008.5, 2.0, 0.125],
        [500000008.5, 0.0, 0.125],
        [500000006.5, 4.0, 2.125],
    ];
    for (found, expected) in points(&mesh).into_iter().zip(expected) {
        let distance = (DVec3::from(found) - DVec3::from(expected)).length();
        assert!(distance < 1e-6, "{found:?} is not {expected:?}");
    }
}

/// Under any linear map a normal stays perpendicular to its triangle, on the side that is outside.
#[test]
fn normals_and_faces_follow_their_transform() {
    for scale in [
        [1.0, 2.0, 0.25],
        [-1.0, 3.0, 1.0],
        [-2.0, -1.0, -0.5],
        [-1.0, -1.0, 1.0],
    ] {
        let mut file = Maker::new();
        let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let positions = file.floats("VEC3", corners.as_flattened());
        let normals = file.floats("VEC3", &[1.0f32 / 3.0f32.sqrt(); 9]);
        let attributes = json!({"POSITION": positions, "NORMAL": normals});
        file.json["meshes"] = json!([{"primitives": [{"attributes": attributes}]}]);
        file.json["nodes"] =
            json!([{"mesh": 0, "rotation": [0.1, 0.7, -0.2, 0.3], "scale": scale}]);
        let mesh = file.read();
        let [a, b, c] = mesh.triangles()[0].map(|v| mesh.positions()[v as usize].as_dvec3());
        let outside = (b - a).cross(c - a).normalize();
        // Seen from zero, which is inside.
        assert!(outside.dot(a) > 0.0, "{scale:?}");
        let channel = &mesh.attributes().channels[0];
        for i in 0..3 {
            let row: Vec<f64> = channel.row(i).collect();
            let normal = DVec3::new(row[0], row[1], row[2]);
            assert!(
                (normal - outside).length() < 1e-6,
                "{scale:?}: {normal} is not {outside}"
            );
        }
    }
}

#[test]
fn the_default_scene_is_read_or_all_or_everything() {
    let counts = |change: fn(&mut Value)| {
        let mut file = Maker::square();
        file.json["nodes"] = json!([{"mesh": 0}, {"mesh": 0}, {"mesh": 0, "children": [1]}]);
        change(&mut file.json);
        file.read().triangles().len()
    };
    assert_eq!(counts(|_| {}), 6);
    assert_eq!(
        counts(|json| json["scenes"] = json!([{"nodes": [0]}, {"nodes": [0, 2]}])),
        6
    );
    assert_eq!(
        counts(|json| json["scenes"] = json!([{"nodes": [0]}, {}])),
        2
    );
    let one = |json: &mut Value| {
        json["scenes"] = json!([{"nodes": [0]}, {"nodes": [2]}]);
        json["scene"] = 1.into();
    };
    assert_eq!(counts(one), 4);
    let none = |json: &mut Value| {
        json["nodes"] = json!([]);
    };
    assert_eq!(counts(none), 2);
}

#[test]
fn a_long_chain_of_nodes_is_no_recursion() {
    let mut file = Maker::square();
    let n = 100_000;
    let nodes = (0..n).map(|i| match i + 1 < n {
        true => json!({"children": [i + 1], "translation": [1, 0, 0]}),
        false => json!({"mesh": 0}),
    });
    file.json["nodes"] = nodes.collect();
    assert_eq!(points(&file.read())[0], [f64::from(n - 1), 0.0, 0.0]);
}

#[test]
fn sparse_rows_stand_in_for_others_or_for_zeros() {
    for has_base in [true, false] {
        let mut file = Maker::square();
        let indices = file.view(&[1, 3]);
        let values: Vec<u8> = [7.0f32, 8.0, 9.0, 4.0, 5.0, 6.0]
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        let values = file.view(&values);
        file.json["accessors"][0]["sparse"] = json!({
            "count": 2,
            "indices": {"bufferView": indices, "componentType": UNSIGNED_BYTE},
            "values": {"bufferView": values},
        });
        let mut expected = [
            [0.0, 0.0, 0.0],
            [7.0, 8.0, 9.0],
            [1.0, 1.0, 0.0],
            [4.0, 5.0, 6.0],
            [2.0, 2.0, 1.0],
        ];
        if !has_base {
            file.json["accessors"][0]
                .as_object_mut()
                .unwrap()
                .remove("bufferView");
            (expected[2], expected[4]) = ([0.0; 3], [0.0; 3]);
        }
        assert_eq!(points(&file.read()), expected);
    }
}

/// Positions of 16 bits, a row every 8 bytes; as they are and as parts of 1.
#[test]
fn quantized_positions_and_strides() {
    for (number, most) in [(SHORT, 32767.0), (UNSIGNED_SHORT, 65535.0)] {
        for normalized in [false, true] {
            let mut file = Maker::new();
            let rows = [[0u16, 100, 200], [32767, 0, 5], [3, 32767, 1]];
            let rows = rows.map(|[x, y, z]| [x, y, z, 0xABCD]);
            let bytes: Vec<u8> = rows
                .as_flattened()
                .iter()
                .flat_map(|x| x.to_le_bytes())
                .collect();
            let positions = file.accessor(number, "VEC3", 3, &bytes);
            file.json["bufferViews"][positions]["byteStride"] = 8.into();
            file.json["accessors"][positions]["normalized"] = normalized.into();
            let primitive = json!({"attributes": {"POSITION": positions}});
            file.json["meshes"] = json!([{"primitives": [primitive]}]);
            let divisor = if normalized { most } else { 1.0 };
            for (found, row) in points(&file.read()).into_iter().zip(rows) {
                let expected = [row[0], row[1], row[2]].map(|x| f64::from(x) / divisor);
                let is_near = |(x, y): (f64, f64)| (x - y).abs() <= 1e-7 * y.abs();
                assert!(found.into_iter().zip(expected).all(is_near), "{found:?}");
            }
        }
    }
    let mut file = Maker::square();
    let normals: [u8; 15] = std::array::from_fn(|i| if i % 3 == 2 { 129 } else { 0 });
    let accessor = file.accessor(BYTE, "VEC3", 5, &normals);
    file.json["accessors"][accessor]["normalized"] = true.into();
    file.attribute("NORMAL", accessor);
    let row: Vec<f64> = file.read().attributes().channels[0].row(4).collect();
    assert_eq!(row, [0.0, 0.0, -1.0], "-127 of 127");
}

#[test]
fn buffers_are_data_or_files_beside() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    let file = Maker::square();
    let expected = file.read();
    std::fs::create_dir(folder.path().join("sub")).unwrap();
    std::fs::write(folder.path().join("sub/a b.bin"), &file.bytes).unwrap();
    std::fs::write(folder.path().join("short.bin"), &file.bytes[1..]).unwrap();
    let read_with = |uri: &str| {
        let mut json = file.json.clone();
        json["buffers"] = json!([{"byteLength": file.bytes.len(), "uri": uri}]);
        std::fs::write(&path, json.to_string()).unwrap();
        let answer = read(&path, &ReadOptions::default());
        answer.map_err(|error| {
            error
                .to_string()
                .replace(&path.display().to_string(), "a.gltf")
        })
    };
    let encoded = STANDARD.encode(&file.bytes);
    for kind in ["", "application/octet-stream", "application/gltf-buffer"] {
        let uri = format!("data:{kind};base64,{encoded}");
        assert_eq!(read_with(&uri).unwrap(), expected);
        assert_eq!(read_with(uri.trim_end_matches('=')).unwrap(), expected);
    }
    assert_eq!(read_with("sub/a%20b.bin").unwrap(), expected);
    for (uri, message) in [
        (
            "short.bin",
            "a.gltf: buffers[0].byteLength is 72; expected at most 71, as there are",
        ),
        ("data:;base64,????", "a.gltf: buffers[0].uri is no data: "),
        (
            "data:,AAAA",
            "a.gltf: buffers[0].uri is data that is not said to be base64",
        ),
        (
            "absent.bin",
            "a.gltf: buffers[0] is the file 'absent.bin', which cannot be read: ",
        ),
        (
            "/etc/passwd",
            "a.gltf: buffers[0] is the file '/etc/passwd'; expected a file beside",
        ),
        (
            "../a.bin",
            "a.gltf: buffers[0] is the file '../a.bin'; expected a file beside",
        ),
        (
            "%2e%2e/a.bin",
            "a.gltf: buffers[0] is the file '%2e%2e/a.bin'; expected a file",
        ),
        (
            "http://a/b.bin",
            "a.gltf: buffers[0] is the file 'http://a/b.bin'; expected a file",
        ),
        ("C:\\a.bin", "a.gltf: buffers[0] is the file"),
        (
            "",
            "a.gltf: buffers[0] is the file ''; expected a file beside this one, or data",
        ),
    ] {
        let error = read_with(uri).unwrap_err();
        assert!(error.starts_with(message), "{uri}: {error}");
    }
    let text = std::fs::read(&path).unwrap();
    let text = String::from_utf8(text)
        .unwrap()
        .replace("\"uri\":\"\"", "\"uri\":\"a.bin\"");
    let error = read_bytes(text.as_bytes()).unwrap_err().to_string();
    assert!(
        error.contains("'a.bin', beside a stream; expected a data URI"),
        "{error}"
    );
}

/// A number of the document put in the place of another, and what is said of it.
#[test]
fn what_is_out_of_range_is_named_by_its_place() {
    let wrong: [(&str, Value, &str); 34] = [
        (
            "/meshes/0/primitives/0/indices",
            json!(9),
            "meshes[0].primitives[0].indices is 9; expected below 2",
        ),
        (
            "/meshes/0/primitives/0/indices",
            json!(0),
            "meshes[0].primitives[0].indices are no integers without sign",
        ),
        (
            "/meshes/0/primitives/0/mode",
            json!(7),
            "meshes[0].primitives[0].mode is none of glTF",
        ),
        (
            "/meshes/0/primitives/0/attributes",
            json!({}),
            "meshes[0].primitives[0] has no POSITION",
        ),
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            json!(2),
            "meshes[0].primitives[0].attributes.POSITION is 2; expected below 2",
        ),
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            json!(1),
            "meshes[0].primitives[0].attributes.POSITION has 1 numbers a vertex; expected 3",
        ),
        (
            "/meshes/0/primitives/0/material",
            json!(0),
            "meshes[0].primitives[0].material is 0; expected below 0",
        ),
        (
            "/meshes/0/primitives/0/attributes/NORMAL",
            json!(1),
            "meshes[0].primitives[0].attributes.NORMAL has 1 numbers a vertex; expected VEC3",
        ),
        (
            "/accessors/0/count",
            json!(3),
            "meshes[0].primitives[0]: indices[5] is 3; expected below 3",
        ),
        (
            "/accessors/0/count",
            json!(6),
            "accessors[0] has 6 rows of 12 bytes from byte 0; expected 60 bytes, as bufferViews[0]",
        ),
        (
            "/accessors/0/count",
            json!(u64::MAX),
            "accessors[0] has 18446744073709551615 rows",
        ),
        (
            "/accessors/0/byteOffset",
            json!(4),
            "accessors[0] has 5 rows of 12 bytes from byte 4",
        ),
        (
            "/accessors/0/byteOffset",
            json!(u64::MAX),
            "accessors[0] has 5 rows of 12 bytes from byte 18446744073709551615",
        ),
        (
            "/accessors/0/componentType",
            json!(5124),
            "accessors[0].componentType is none of glTF",
        ),
        (
            "/accessors/0/type",
            json!("VEC5"),
            "accessors[0].type is none of glTF",
        ),
        (
            "/accessors/0/bufferView",
            json!(2),
            "accessors[0].bufferView is 2; expected below 2",
        ),
        (
            "/accessors/0/count",
            json!(-1),
            "invalid value: integer `-1`",
        ),
        (
            "/accessors/1/count",
            json!(7),
            "accessors[1] has 7 rows of 2 bytes",
        ),
        (
            "/bufferViews/0/buffer",
            json!(1),
            "bufferViews[0].buffer is 1; expected below 1",
        ),
        (
            "/bufferViews/0/byteLength",
            json!(73),
            "bufferViews[0] has 73 bytes from 0; expected an end at most at 72, as buffers[0]",
        ),
        (
            "/bufferViews/0/byteLength",
            json!(u64::MAX),
            "bufferViews[0] has 18446744073709551615 bytes",
        ),
        (
            "/bufferViews/0/byteOffset",
            json!(u64::MAX),
            "bufferViews[0] has 60 bytes from 18446744073709551615",
        ),
        (
            "/bufferViews/0/byteStride",
            json!(8),
            "bufferViews[0].byteStride is 8; expected 12 or more, as a row of accessors[0]",
        ),
        (
            "/bufferViews/0/byteStride",
            json!(16),
            "accessors[0] has 5 rows of 16 bytes",
        ),
        (
            "/buffers",
            json!([{"byteLength": 73}]),
            "buffers[0].byteLength is 73; expected at most 72, as there are",
        ),
        (
            "/buffers",
            json!([{"byteLength": 9}, {"byteLength": 9}]),
            "bufferViews[0] has 60 bytes",
        ),
        (
            "/nodes",
            json!([{"mesh": 1}]),
            "nodes[0].mesh is 1; expected below 1",
        ),
        (
            "/nodes",
            json!([{"children": [1]}]),
            "nodes[0].children[0] is 1; expected below 1",
        ),
        (
            "/nodes",
            json!([{"children": [0]}]),
            "nodes[0] stands below itself; expected nodes without a cycle",
        ),
        (
            "/nodes",
            json!([{"children": [2]}, {"children": [2]}, {}]),
            "nodes[1].children[0] is 2, which is a child already",
        ),
        (
            "/nodes",
            json!([{"mesh": 0}, {"children": [2]}, {"children": [1]}]),
            "nodes[1] stands below itself",
        ),
        (
            "/scenes",
            json!([{"nodes": [4]}]),
            "scenes[0].nodes[0] is 4; expected below 1",
        ),
        ("/scene", json!(3), "scene is 3; expected below 0"),
        (
            "/asset/version",
            json!("1.0"),
            "asset.version is '1.0'; expected 2.0 or a later 2",
        ),
    ];
    for (pointer, value, message) in wrong {
        let mut file = Maker::square();
        file.json["nodes"] = json!([]);
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        file.json.pointer_mut(parent).unwrap()[key] = value.clone();
        if pointer.starts_with("/scene") {
            file.json["nodes"] = json!([{"mesh": 0}]);
        }
        let error = file.error();
        assert!(
            error.starts_with(&format!("a.glb: {message}")),
            "{pointer} {value}: {error}"
        );
    }
}

#[test]
fn sparse_rows_are_checked() {
    let with = |change: fn(&mut Value)| {
        let mut file = Maker::square();
        let indices = file.view(&[1, 3]);
        let values = file.view(&[0; 24]);
        file.json["accessors"][0]["sparse"] = json!({
            "count": 2,
            "indices": {"bufferView": indices, "componentType": UNSIGNED_BYTE},
            "values": {"bufferView": values},
        });
        change(&mut file.json["accessors"][0]);
        file.error()
    };
    let error = with(|accessor| accessor["sparse"]["count"] = 3.into());
    assert!(
        error.contains("accessors[0].sparse.indices has 3 rows of 1 bytes"),
        "{error}"
    );
    let error = with(|accessor| accessor["sparse"]["values"]["byteOffset"] = 4.into());
    assert!(
        error.contains("accessors[0].sparse.values has 2 rows of 12 bytes"),
        "{error}"
    );
    let error = with(|accessor| accessor["count"] = 3.into());
    assert!(
        error.contains("sparse.indices: number 1 is 3; expected ascending"),
        "{error}"
    );
    let error = with(|accessor| accessor["sparse"]["values"] = json!({"bufferView": 9}));
    assert!(
        error.contains("accessors[0].sparse.values.bufferView is 9"),
        "{error}"
    );
    let error = with(|accessor| {
        accessor["count"] = 4_000_000_000u32.into();
        accessor.as_object_mut().unwrap().remove("bufferView");
    });
    assert!(
        error.contains("accessors[0] has 4000000000 zeros; expected at most 100"),
        "{error}"
    );
}

#[test]
fn containers_are_checked() {
    let whole = Maker::square().binary();
    let error = |bytes: &[u8]| read_bytes(bytes).unwrap_err().to_string();
    let with = |at: usize, byte: u8| {
        let mut bytes = whole.clone();
        bytes[at] = byte;
        error(&bytes)
    };
    assert!(with(4, 1).starts_with("a.glb: byte 4: glTF version 1; expected version 2"));
    assert!(with(11, 1).starts_with("a.glb: byte 8: the header says 16777"));
    assert!(with(15, 1).starts_with("a.glb: byte 12: a chunk of 16777"));
    assert!(with(16, b'j').starts_with("a.glb: byte 12: no chunk of JSON; expected one"));
    let mut none = whole.clone();
    none[8..12].fill(0);
    assert!(error(&none).starts_with("a.glb: byte 8: the header says 0 bytes"));
    for length in 4..whole.len() {
        assert!(error(&whole[..length]).starts_with("a.glb: byte 8: the header says"));
    }
    // What is behind is nobody's.
    let longer: Vec<u8> = whole.iter().copied().chain([1, 2, 3]).collect();
    assert_eq!(read_bytes(&longer).unwrap(), read_bytes(&whole).unwrap());
}

#[test]
fn compressed_geometry_is_refused_by_name() {
    let mut file = Maker::square();
    let draco = json!({"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {}}});
    file.json["meshes"][0]["primitives"][0]["extensions"] = draco;
    // What is there beside it uncompressed is read.
    assert_eq!(file.read().triangles().len(), 2);
    file.json["extensionsRequired"] = json!(["KHR_draco_mesh_compression"]);
    let expected = "is compressed with KHR_draco_mesh_compression; expected no compression; \
                    decompress it first, for example with gltf-transform";
    assert_eq!(
        file.error(),
        format!("a.glb: meshes[0].primitives[0] {expected}")
    );
    let mut file = Maker::square();
    let extension = json!({"EXT_meshopt_compression": {"buffer": 0}});
    file.json["bufferViews"][1]["extensions"] = extension;
    assert_eq!(file.read().triangles().len(), 2);
    file.json["extensionsRequired"] = json!(["EXT_meshopt_compression"]);
    assert!(
        file.error()
            .contains("bufferViews[1] is compressed with EXT_meshopt_compression")
    );
}

/// Two primitives that share their vertices, two with vertices of their own, of other attributes.
#[test]
fn primitives_may_have_different_attributes() {
    let mut file = Maker::square();
    let first = file.json["meshes"][0]["primitives"][0].clone();
    let normals = file.floats("VEC3", [[0.0, 0.0, 1.0]; 5].as_flattened());
    let colors = file.accessor(UNSIGNED_BYTE, "VEC4", 5, &[9; 20]);
    file.json["accessors"][colors]["normalized"] = true.into();
    let textures = file.floats("VEC2", &[0.5; 10]);
    let quality = file.floats("SCALAR", &[3.5, 4.5, 5.5, 6.5, 7.5]);
    let position = first["attributes"]["POSITION"].clone();
    let whole = json!({
        "POSITION": position, "NORMAL": normals, "COLOR_0": colors, "TEXCOORD_1": textures,
        "_QUALITY": quality, "TANGENT": colors,
    });
    let some = json!({"POSITION": position, "_QUALITY": quality});
    file.json["materials"] = json!([{"name": "red"}, {}, {"name": "red"}]);
    file.json["meshes"] = json!([{"name": "square", "primitives": [
        {"attributes": some, "indices": 1, "material": 0},
        {"attributes": whole, "indices": 1, "material": 1},
        {"attributes": some, "indices": 1, "material": 2},
    ]}]);
    let mesh = file.read();
    assert_eq!(
        mesh.positions().len(),
        10,
        "the first and the last share theirs"
    );
    let attributes = mesh.attributes();
    assert_eq!(attributes.group_of, [0, 0, 1, 1, 2, 2]);
    let materials: Vec<&str> = attributes
        .groups
        .iter()
        .map(|g| g.material.as_str())
        .collect();
    assert_eq!(materials, ["red", "material_1", "red_2"]);
    assert!(attributes.groups.iter().all(|g| g.object == "square"));
    let row = |channel: usize, row: usize| -> Vec<f64> {
        attributes.channels[channel].row(row).collect()
    };
    let names: Vec<&str> = attributes
        .channels
        .iter()
        .map(|c| c.components[0].name.as_str())
        .collect();
    assert_eq!(names, ["nx", "s", "s1", "red", "QUALITY"]);
    assert_eq!(attributes.channels[3].components[0].number, NumberType::U8);
    assert_eq!([row(0, 0), row(0, 5)], [[0.0, 0.0, 1.0]; 2], "by its faces");
    assert_eq!([row(2, 0), row(2, 5)], [[0.0; 2], [0.5; 2]]);
    assert_eq!([row(3, 0), row(3, 5)], [[255.0; 4], [9.0; 4]]);
    assert_eq!([row(4, 2), row(4, 7)], [[5.5], [5.5]]);
    let expected = [
        "NORMAL is on 1 of 3 primitives; the others get normals of their faces",
        "TEXCOORD_1 is on 1 of 3 primitives; the others get zeros",
        "COLOR_0 is on 1 of 3 primitives; the others get white",
        "TANGENT of 1 primitives is not carried",
    ];
    assert_eq!(attributes.notices, expected);
    let back = round_trip(&mesh);
    assert_eq!(told(&back), told(&mesh));
    assert_eq!(back.attributes().assets, attributes.assets);
    assert_eq!(back.attributes().channels.len(), 5);
    assert!(back.attributes().notices.is_empty());
}

#[test]
fn without_attributes_only_triangles_are_read() {
    let mut file = Maker::square();
    let normals = file.floats("VEC3", &[1.0; 15]);
    file.attribute("NORMAL", normals);
    file.json["meshes"][0]["name"] = "square".into();
    let bytes = file.binary();
    let options = ReadOptions {
        attributes: false,
        ..ReadOptions::default()
    };
    let bare = read_from("a".as_ref(), Cursor::new(bytes), None, &options).unwrap();
    assert_eq!(bare.attributes(), &Attributes::default());
    let whole = file.read();
    assert_eq!(bare.positions(), whole.positions());
    assert_eq!(bare.triangles(), whole.triangles());
    assert_eq!(whole.attributes().group_of, [0, 0]);
}

/// Images keep their bytes, lists their order, extensions their names; numbers their last bit.
#[test]
fn materials_pass_through() {
    let mut file = Maker::square();
    let image = file.view(b"a picture");
    let factor = json!([0.800000011920929, 0.1, 1e-7, 1.0]);
    file.json["materials"] = json!([{
        "name": "red",
        "extensions": {"KHR_materials_ior": {"ior": 1.4}},
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "baseColorFactor": factor},
    }]);
    file.json["textures"] = json!([{"source": 1, "sampler": 0}]);
    file.json["samplers"] = json!([{"wrapS": 33071}]);
    file.json["images"] = json!([{"uri": "a.png"}, {"bufferView": image, "mimeType": "image/png"}]);
    file.json["extensionsUsed"] = json!(["KHR_materials_ior", "KHR_lights_punctual"]);
    file.json["meshes"][0]["primitives"][0]["material"] = 0.into();
    let mesh = file.read();
    let assets = mesh.attributes().assets.clone().unwrap();
    assert_eq!(assets.blobs, [b"a picture"]);
    assert_eq!(assets.lists["extensionsUsed"], json!(["KHR_materials_ior"]));
    for name in ["materials", "textures", "samplers"] {
        assert_eq!(assets.lists[name], file.json[name]);
    }
    let back = round_trip(&mesh);
    assert_eq!(back.attributes().assets, mesh.attributes().assets);
    assert_eq!(told(&back), told(&mesh));
    file.json["images"][0] = json!({"bufferView": 99});
    assert!(
        file.error()
            .contains("images[0].bufferView is 99; expected below 3")
    );
    // The same bytes over and over are more than the file has.
    let view = json!({"buffer": 0, "byteLength": 50});
    let views: Vec<usize> = (0..3)
        .map(|_| file.push("bufferViews", view.clone()))
        .collect();
    file.json["images"] = views
        .iter()
        .map(|view| json!({"bufferView": view}))
        .collect();
    assert!(
        file.error()
            .contains("images 0 to 1 have 100 bytes together"),
        "{}",
        file.error()
    );
}

fn channel(kind: Kind, names: &[(&str, NumberType)], values: Vec<f32>) -> Channel {
    let property = |&(name, number): &(&str, NumberType)| Property {
        name: name.into(),
        number,
    };
    Channel {
        values: Values::Singles(values),
        ..Channel::new(kind, names.iter().map(property).collect())
    }
}

/// A square with a seam along its diagonal, of two objects and materials, with every kind of number.
fn square_with_everything() -> IndexedMesh {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y];
    let triangles = vec![[0, 1, 2], [0, 2, 3], [0, 3, 2]];
    let group = |object: &str, material: &str| Group {
        object: object.into(),
        material: material.into(),
        ..Group::default()
    };
    let numbers = |n: usize| -> Vec<f32> { (0..n as u8).map(|i| f32::from(i) / 32.0).collect() };
    let integers = |n: usize| -> Vec<f32> { (0..n as u8).map(|i| f32::from(10 * i)).collect() };
    let (f32, u8, u16) = (NumberType::F32, NumberType::U8, NumberType::U16);
    let attributes = Attributes {
        corners: vec![[0, 1, 2], [3, 4, 5], [3, 5, 4]],
        channels: vec![
            channel(
                Kind::Normal,
                &[("nx", f32), ("ny", f32), ("nz", f32)],
                numbers(18),
            ),
            channel(
                Kind::TextureCoordinate,
                &[("s", f32), ("t", f32)],
                numbers(12),
            ),
            channel(
                Kind::Color,
                &[("red", u8), ("green", u8), ("blue", u8)],
                integers(18),
            ),
            channel(
                Kind::Color,
                &[
                    ("red1", u16),
                    ("green1", u16),
                    ("blue1", u16),
                    ("alpha1", u16),
                ],
                integers(24),
            ),
            channel(Kind::Scalar, &[("label", NumberType::I16)], integers(6)),
            channel(Kind::Scalar, &[("quality", f32)], numbers(6)),
        ],
        group_of: vec![0, 1, 0],
        groups: vec![group("a", "red"), group("b", "blue")],
        assets: Some(Arc::new(Assets {
            lists: json!({"materials": [{"name": "blue", "doubleSided": true}]})
                .as_object()
                .unwrap()
                .clone(),
            material_names: vec!["blue".into()],
            blobs: Vec::new(),
        })),
        v_is_down: true,
        ..Attributes::default()
    };
    let mesh = IndexedMesh::new(positions, triangles).unwrap();
    mesh.with_attributes(attributes).unwrap()
}

#[test]
fn every_attribute_comes_back_with_its_type() {
    let mesh = square_with_everything();
    assert_eq!(cannot_carry(&mesh, Format::Glb), [""; 0]);
    let back = round_trip(&mesh);
    let (before, after) = (mesh.attributes(), back.attributes());
    let kinds = |a: &Attributes| -> Vec<(Kind, Vec<Property>)> {
        a.channels
            .iter()
            .map(|c| (c.kind, c.components.clone()))
            .collect()
    };
    assert_eq!(kinds(after), kinds(before));
    // By group: first both triangles of the first.
    let mut expected = told(&mesh);
    expected.sort_by_key(|(object, ..)| object.clone());
    assert_eq!(told(&back), expected);
    let materials = &after.assets.as_ref().unwrap().lists["materials"];
    assert_eq!(
        materials,
        &json!([{"name": "blue", "doubleSided": true}, {"name": "red"}])
    );
    // Once more nothing changes.
    assert_eq!(round_trip(&back), back);
}

/// What grows upwards elsewhere grows downwards in glTF.
#[test]
fn texture_coordinates_are_turned_on_their_way() {
    let mesh = square_with_everything();
    let mut attributes = mesh.attributes().clone();
    attributes.v_is_down = false;
    let upwards = mesh.clone().with_attributes(attributes).unwrap();
    let (down, up) = (round_trip(&mesh), round_trip(&upwards));
    let row = |mesh: &IndexedMesh, i: usize| -> Vec<f64> {
        mesh.attributes().channels[1].row(i).collect()
    };
    for i in 0..6 {
        assert!(up.attributes().v_is_down);
        assert_eq!(row(&up, i)[0], row(&down, i)[0]);
        assert_eq!(row(&up, i)[1], 1.0 - row(&down, i)[1]);
    }
}

#[test]
fn what_the_format_has_no_place_for_is_said() {
    let mesh = square_with_everything();
    let mut attributes = mesh.attributes().clone();
    attributes.groups[0].name = "g".into();
    attributes.material_libraries = vec!["a.mtl".into()];
    attributes.channels[4] = Channel {
        values: Values::Doubles(vec![0.1; 6]),
        ..Channel::new(
            Kind::Scalar,
            vec![Property {
                name: "height".into(),
                number: NumberType::F64,
            }],
        )
    };
    let more = attributes.channels[0].clone();
    attributes.channels.push(more);
    let mesh = mesh.with_attributes(attributes).unwrap();
    let expected = [
        "more than single precision of vertex property 'height'",
        "vertex property 'nx'",
        "vertex property 'ny'",
        "vertex property 'nz'",
        "groups",
        "material libraries",
    ]
    .map(|what| format!("gltf has no place for {what}"));
    assert_eq!(cannot_carry(&mesh, Format::Gltf), expected);
    let of_obj = cannot_carry(&mesh, Format::Obj);
    assert!(
        of_obj.contains(&"obj has no place for what materials look like".into()),
        "{of_obj:?}"
    );
    assert_eq!(round_trip(&mesh).attributes().channels.len(), 6);
}

/// 65 535 vertices have indices of 16 bits, and one more has not.
#[test]
fn indices_grow_where_they_must() {
    for (n, number) in [(65_535, "5123"), (65_536, "5125")] {
        let positions = (0..n).map(|i| Vec3::splat(i as f32)).collect();
        let triangles = (0..n - 2).map(|i| [i, i + 1, i + 2]).collect();
        let mesh = IndexedMesh::new(positions, triangles).unwrap();
        let bytes = written(&mesh, Format::Glb);
        let json = String::from_utf8_lossy(&bytes[..1000]).to_string();
        assert_eq!(
            json.matches(&format!("\"componentType\":{number}")).count(),
            1,
            "{json}"
        );
        assert_eq!(round_trip(&mesh), mesh);
    }
}

/// The bounds that a reader trusts are those of the vertices that are written.
#[test]
fn bounds_are_of_what_is_written() {
    let positions = vec![Vec3::X, Vec3::Y, Vec3::NEG_Z, Vec3::splat(1e9)];
    let mesh = IndexedMesh::new(positions, vec![[0, 1, 2]]).unwrap();
    let file = gltf::Gltf::from_slice(&written(&mesh, Format::Glb)).unwrap();
    let accessor = file.accessors().find(|a| a.min().is_some()).unwrap();
    assert_eq!(accessor.min(), Some(json!([0.0, 0.0, -1.0])));
    assert_eq!(accessor.max(), Some(json!([1.0, 1.0, 0.0])));
}

#[test]
fn an_empty_mesh_is_a_file() {
    for positions in [vec![], vec![Vec3::X]] {
        let mesh = IndexedMesh::new(positions, vec![]).unwrap();
        assert_eq!(round_trip(&mesh), IndexedMesh::default());
    }
}
