//! What a mesh carries beside positions is read, written and read again unchanged: PLY and OBJ.
//!
//! Real files where `MESHES=folder` names one with `meshes/`.

use std::io::Cursor;
use std::path::{Path, PathBuf};

use decimate::attributes::{Attributes, Channel, Group, Kind, NumberType, Property, Values};
use decimate::clean::clean;
use decimate::indexed_mesh::IndexedMesh;
use decimate::io::{self, Format, ReadOptions, WriteOptions};

fn try_read(name: &str, bytes: impl Into<Vec<u8>>) -> Result<IndexedMesh, String> {
    let bytes = bytes.into();
    let length = Some(bytes.len() as u64);
    let options = ReadOptions::default();
    io::read_from(Path::new(name), Cursor::new(bytes), length, &options).map_err(|e| e.to_string())
}

fn read(name: &str, bytes: impl Into<Vec<u8>>) -> IndexedMesh {
    try_read(name, bytes).unwrap()
}

fn written(mesh: &IndexedMesh, format: Format, ascii: bool) -> Vec<u8> {
    let options = WriteOptions {
        format: Some(format),
        ascii,
        precision: None,
    };
    let mut bytes = Vec::new();
    io::write_to(Path::new("out"), &mut bytes, mesh, &options).unwrap();
    bytes
}

fn text(mesh: &IndexedMesh, format: Format) -> String {
    String::from_utf8(written(mesh, format, true)).unwrap()
}

/// The rows of a channel at the corners, each with the position that it is at, bit for bit.
fn rows(mesh: &IndexedMesh, channel: &Channel) -> Vec<([u32; 3], Vec<u64>)> {
    let corners = mesh.attributes().corners.as_flattened();
    let rows = mesh.triangles().as_flattened().iter().zip(corners);
    rows.map(|(&v, &wedge)| {
        let position = mesh.positions()[v as usize].to_array().map(f32::to_bits);
        let row = channel.row(wedge as usize).map(f64::to_bits);
        (position, row.collect())
    })
    .collect()
}

fn groups_of_triangles(mesh: &IndexedMesh) -> Vec<&Group> {
    let attributes = mesh.attributes();
    let group = |&g: &u32| &attributes.groups[g as usize];
    attributes.group_of.iter().map(group).collect()
}

/// Says what every corner and every triangle has, whatever wedges and groups are numbered.
fn assert_same(a: &IndexedMesh, b: &IndexedMesh, case: &str) {
    let (of_a, of_b) = (a.attributes(), b.attributes());
    assert_eq!(of_a.channels.len(), of_b.channels.len(), "{case}");
    for (channel, other) in of_a.channels.iter().zip(&of_b.channels) {
        assert_eq!(channel.kind, other.kind, "{case}");
        assert_eq!(channel.components, other.components, "{case}");
        assert_eq!(
            rows(a, channel),
            rows(b, other),
            "{case}, {:?}",
            channel.components
        );
    }
    assert_eq!(of_a.face_properties, of_b.face_properties, "{case}");
    assert_eq!(groups_of_triangles(a), groups_of_triangles(b), "{case}");
    assert_eq!(of_a.material_libraries, of_b.material_libraries, "{case}");
    assert_eq!(of_a.textures, of_b.textures, "{case}");
}

/// A binary file that says what a text file says.
fn binary(text: &str, big: bool) -> Vec<u8> {
    let (header, body) = text.split_once("end_header\n").unwrap();
    let order = if big {
        "binary_big_endian"
    } else {
        "binary_little_endian"
    };
    let mut bytes = format!("{}end_header\n", header.replace("ascii", order)).into_bytes();
    let mut words = body.split_ascii_whitespace();
    let mut put = |data_type: &str, x: f64| {
        let mut number = match data_type {
            "char" | "uchar" => vec![x as i64 as u8],
            "short" | "ushort" => (x as i64 as u16).to_le_bytes().into(),
            "int" | "uint" => (x as i64 as u32).to_le_bytes().into(),
            "float" => (x as f32).to_le_bytes().into(),
            _ => x.to_le_bytes().to_vec(),
        };
        if big {
            number.reverse();
        }
        bytes.extend(number);
    };
    let mut elements: Vec<(usize, Vec<Vec<&str>>)> = Vec::new();
    for line in header.lines() {
        match line.split(' ').collect::<Vec<_>>()[..] {
            ["element", _, count] => elements.push((count.parse().unwrap(), Vec::new())),
            ["property", ref types @ .., _] => elements.last_mut().unwrap().1.push(types.to_vec()),
            _ => {}
        }
    }
    let mut next = || words.next().unwrap().parse::<f64>().unwrap();
    for (count, properties) in elements {
        for types in properties.iter().cycle().take(count * properties.len()) {
            if let [_, length, item] = types[..] {
                let n = next();
                put(length, n);
                (0..n as usize).for_each(|_| put(item, next()));
            } else {
                put(types[0], next());
            }
        }
    }
    bytes
}

/// Every encoding of a PLY file reads the same, and what is written of it too; returns the mesh.
fn ply_in_every_encoding(text: &str) -> IndexedMesh {
    let mesh = read("a.ply", text);
    for big in [false, true] {
        assert_eq!(read("a.ply", binary(text, big)), mesh, "big-endian: {big}");
    }
    for ascii in [false, true] {
        let again = read("a.ply", written(&mesh, Format::Ply, ascii));
        assert_eq!(again.triangles(), mesh.triangles());
        assert_eq!(again.positions(), mesh.positions());
        assert_same(&again, &mesh, "written and read");
        assert_eq!(again.attributes().corners, mesh.attributes().corners);
        let values = |mesh: &IndexedMesh| -> Vec<Values> {
            let channels = mesh.attributes().channels.iter();
            channels.map(|channel| channel.values.clone()).collect()
        };
        assert_eq!(
            values(&again),
            values(&mesh),
            "of vertices without a face too"
        );
    }
    mesh
}

const VERTEX_PROPERTIES: &str = "property float nx\nproperty float ny\nproperty float nz\n\
    property float texture_u\nproperty double texture_v\nproperty uchar red\nproperty ushort green\n\
    property float blue\nproperty uchar alpha\nproperty float quality\nproperty char c\n\
    property short label\nproperty uint big\nproperty int low\nproperty double 1st\n";

/// Five vertices, the last of which no face uses, with a property of every type and kind.
fn full_ply() -> String {
    format!(
        "ply\nformat ascii 1.0\ncomment TextureFile wood grain.png\nelement vertex 5\n\
         property float x\nproperty float y\nproperty float z\n{VERTEX_PROPERTIES}\
         element face 2\nproperty list uchar int vertex_indices\nend_header\n\
         0 0 0 0 0 1 0.1 0.1 255 65535 0.5 1 7.25 -128 -32768 4294967295 -2147483648 0.1\n\
         1 0 0 0 1 0 0.2 0.2 254 65534 0.1 2 7.5 127 32767 4294967294 2147483647 1e300\n\
         1 1 0 1 0 0 -0.3 0.3 253 3 0.2 3 0.1 1 1 1 16777217 1e-300\n\
         0 1 0 0.6 0.8 -0 0.4 1 252 2 0.3 4 1e-30 0 0 0 0 0\n\
         5 5 5 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15\n\
         3 0 1 2\n3 0 2 3\n"
    )
}

#[test]
fn vertex_properties_keep_names_types_order_and_numbers() {
    let mesh = ply_in_every_encoding(&full_ply());
    let attributes = mesh.attributes();
    let kinds: Vec<_> = attributes
        .channels
        .iter()
        .map(|c| (c.kind, c.width()))
        .collect();
    let scalar = (Kind::Scalar, 1);
    let expected = [
        (Kind::Normal, 3),
        (Kind::TextureCoordinate, 2),
        (Kind::Color, 4),
    ];
    assert_eq!(kinds, [&expected[..], &[scalar; 6]].concat());
    assert_eq!(attributes.textures, ["wood grain.png"]);
    assert!(attributes.notices.is_empty(), "{:?}", attributes.notices);
    let row = |c: usize, v: usize| attributes.channels[c].row(v).collect::<Vec<f64>>();
    assert_eq!(row(1, 1), [f64::from(0.2_f32), 0.2]);
    assert_eq!(row(2, 0), [255.0, 65535.0, 0.5, 1.0]);
    assert_eq!(
        [row(4, 0), row(5, 0), row(6, 0)].concat(),
        [-128.0, -32768.0, 4294967295.0]
    );
    assert_eq!([row(7, 2), row(8, 1)].concat(), [16777217.0, 1e300]);
    assert!(text(&mesh, Format::Ply).contains(VERTEX_PROPERTIES));
}

/// As it was before there were attributes.
#[test]
fn who_wants_none_gets_none() {
    let options = ReadOptions {
        attributes: false,
        ..ReadOptions::default()
    };
    for (name, bytes) in [
        ("a.ply", full_ply()),
        ("b.ply", wedge_ply()),
        ("a.obj", FULL_OBJ.into()),
    ] {
        let all = read(name, bytes.as_str());
        assert!(!all.attributes().is_empty());
        let source = Cursor::new(bytes.into_bytes());
        let mesh = io::read_from(Path::new(name), source, None, &options).unwrap();
        assert_eq!(mesh.attributes(), &Attributes::default());
        assert_eq!(mesh.triangles(), all.triangles());
        assert_eq!(mesh.positions(), all.positions());
    }
}

#[test]
fn the_usual_names_make_channels() {
    for (names, kind) in [
        ("nx ny nz", Kind::Normal),
        ("s t", Kind::TextureCoordinate),
        ("u v", Kind::TextureCoordinate),
        ("texture_u texture_v", Kind::TextureCoordinate),
        ("texture_s texture_t", Kind::TextureCoordinate),
        ("red green blue", Kind::Color),
        ("r g b a", Kind::Color),
        ("diffuse_red diffuse_green diffuse_blue", Kind::Color),
        ("confidence", Kind::Scalar),
        ("nx", Kind::Scalar),
    ] {
        let names: Vec<&str> = names.split(' ').collect();
        let properties: String = names
            .iter()
            .map(|n| format!("property float {n}\n"))
            .collect();
        let row: String = (0..names.len()).map(|i| format!(" {i}")).collect();
        // Before the coordinates, which is no matter.
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 1\n{properties}property float x\n\
             property float y\nproperty float z\nend_header\n{row} 7 8 9\n"
        );
        let mesh = ply_in_every_encoding(&text);
        assert_eq!(mesh.positions()[0].to_array(), [7.0, 8.0, 9.0]);
        let [channel] = &mesh.attributes().channels[..] else {
            panic!("{names:?}: {:?}", mesh.attributes());
        };
        assert_eq!(channel.kind, kind, "{names:?}");
        let found: Vec<&str> = channel.components.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(found, names);
        let numbers: Vec<f64> = (0..names.len()).map(|i| i as f64).collect();
        assert_eq!(channel.row(0).collect::<Vec<_>>(), numbers);
    }
}

/// A square of two triangles and a third: at vertex 0 the first two have one texture coordinate, at
/// vertex 2 they differ. Twenty faces more, so that numbers of faces can be groups.
fn wedge_ply() -> String {
    let more = "3 0 1 2 6 0 0 0.25 0.5 1 1 0 7\n".repeat(20);
    format!(
        "ply\nformat ascii 1.0\ncomment TextureFile a.png\ncomment TextureFile b.png\n\
         element vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 22\n\
         property list uchar int vertex_indices\nproperty list uchar float texcoord\n\
         property int texnumber\nproperty uchar material_index\nend_header\n\
         0 0 0 1 2 3\n1 0 0 4 5 6\n1 1 0 7 8 9\n0 1 0 10 11 12\n\
         3 0 1 2 6 0 0 0.25 0.5 1 1 0 7\n3 0 2 3 6 0 0 0.125 0.25 -1 0.1 -1 7\n{more}"
    )
}

#[test]
fn texture_coordinates_of_wedges_are_a_channel_by_corner() {
    let mesh = ply_in_every_encoding(&wedge_ply());
    let attributes = mesh.attributes();
    assert_eq!(attributes.corners[..2], [[0, 1, 2], [0, 4, 3]]);
    assert_eq!(attributes.wedge_count(), 5);
    let [color, coordinates] = &attributes.channels[..] else {
        panic!("{attributes:?}");
    };
    assert_eq!(color.row(4).collect::<Vec<_>>(), [7.0, 8.0, 9.0]);
    assert!(coordinates.is_by_corner && !color.is_by_corner);
    assert_eq!(coordinates.kind, Kind::TextureCoordinate);
    let expected = [0.0, 0.0, 0.25, 0.5, 1.0, 1.0, -1.0, 0.1, 0.125, 0.25];
    assert_eq!(coordinates.values, Values::Singles(expected.into()));
    assert_eq!(attributes.textures, ["a.png", "b.png"]);
    let values: Vec<_> = groups_of_triangles(&mesh)
        .iter()
        .map(|g| g.values.clone())
        .collect();
    assert_eq!(
        values[..3],
        [vec![0.0, 7.0], vec![-1.0, 7.0], vec![0.0, 7.0]]
    );
    // The vertices stay shared, in MeshLab's words.
    let text = text(&mesh, Format::Ply);
    assert!(text.contains("element vertex 4\n"), "{text}");
    let faces = "property list uchar float texcoord\nproperty int texnumber\n\
                 property uchar material_index\nend_header\n";
    assert!(text.contains(faces), "{text}");
    assert!(
        text.contains("\n3 0 1 2 6 0 0 0.25 0.5 1 1 0 7\n"),
        "{text}"
    );
}

/// Faces that come before their vertices, polygons, and lists that are missing or of a wrong length.
#[test]
fn texture_coordinates_come_in_any_order_and_may_be_missing() {
    let text = "ply\nformat ascii 1.0\nelement face 4\nproperty list uchar int vertex_indices\n\
                property list uchar double texcoord\nelement vertex 4\nproperty float x\n\
                property float y\nproperty float z\nproperty float quality\nend_header\n\
                4 0 1 2 3 8 0 0.1 1 0.2 2 0.3 3 0.4\n3 0 1 2 0\n3 2 1 0 5 1 2 3 4 5\n2 0 1 4 1 2 3 4\n\
                0 0 0 10\n1 0 0 11\n1 1 0 12\n0 1 0 13\n";
    let mesh = read("a.ply", text);
    for big in [false, true] {
        assert_eq!(read("a.ply", binary(text, big)), mesh);
    }
    let notices = &mesh.attributes().notices;
    assert_eq!(
        notices[..],
        ["6 corners without texture coordinate got zeros"]
    );
    let [quality, coordinates] = &mesh.attributes().channels[..] else {
        panic!("{:?}", mesh.attributes());
    };
    let numbers = |channel| -> Vec<Vec<f64>> {
        let rows = rows(&mesh, channel).into_iter();
        rows.map(|(_, row)| row.into_iter().map(f64::from_bits).collect())
            .collect()
    };
    let [a, b, c, d, zero] = [[0.0, 0.1], [1.0, 0.2], [2.0, 0.3], [3.0, 0.4], [0.0, 0.0]];
    let expected = [[a, b, c], [a, c, d], [zero; 3], [zero; 3]];
    assert_eq!(numbers(coordinates), expected.as_flattened());
    let expected = [
        10.0, 11.0, 12.0, 10.0, 12.0, 13.0, 10.0, 11.0, 12.0, 12.0, 11.0, 10.0,
    ];
    assert_eq!(numbers(quality).concat(), expected);
    for ascii in [false, true] {
        assert_same(
            &read("a.ply", written(&mesh, Format::Ply, ascii)),
            &mesh,
            "again",
        );
    }
}

/// A strip of so many triangles; `face` says what stands behind the corners of each.
fn strip_ply(triangles: usize, properties: &str, face: impl Fn(usize) -> String) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nelement face {triangles}\n{properties}\
         property list uchar int vertex_indices\nend_header\n",
        triangles + 2
    );
    for v in 0..triangles + 2 {
        text += &format!("{} {} 0\n", v / 2, v % 2);
    }
    for f in 0..triangles {
        text += &format!("{} 3 {} {} {}\n", face(f), f, f + 1 + f % 2, f + 2 - f % 2);
    }
    text
}

/// Colours and numbers of parts are groups where few faces share none; else nothing could be removed.
#[test]
fn face_properties_are_groups_where_there_are_few() {
    let properties = "property uchar red\nproperty uchar green\nproperty uchar blue\n\
                      property int Region_ID\n";
    let few = strip_ply(400, properties, |f| format!("{} 0 9 {}", f / 100, f / 40));
    let mesh = ply_in_every_encoding(&few);
    assert_eq!(mesh.attributes().groups.len(), 12);
    assert_eq!(mesh.attributes().notices.len(), 0);
    let expected = [2.0, 0.0, 9.0, 6.0];
    assert_eq!(groups_of_triangles(&mesh)[279].values, expected);
    let written = text(&mesh, Format::Ply);
    assert!(written.contains(properties), "{written}");

    let all_differ = strip_ply(400, "property int label\n", |f| f.to_string());
    let mesh = ply_in_every_encoding(&all_differ);
    let attributes = mesh.attributes();
    assert!(attributes.groups.is_empty() && attributes.group_of.is_empty());
    assert!(attributes.face_properties.is_empty());
    let expected =
        "face property 'label' is not carried: there are fewer than 16 faces of one value";
    assert_eq!(attributes.notices, [expected]);
    // A die has six sides of two triangles.
    let die = strip_ply(12, "property int label\n", |f| (f / 2).to_string());
    assert_eq!(ply_in_every_encoding(&die).attributes().groups.len(), 6);
}

#[test]
fn what_is_left_behind_is_said() {
    let text = "ply\nformat ascii 1.0\nelement camera 1\nproperty float view\nelement vertex 3\n\
                property float x\nproperty float y\nproperty float z\nproperty float z\n\
                property list uchar int extra\nelement face 1\nproperty float quality\n\
                property list uchar int vertex_indices\nproperty int flags\n\
                property list uchar int more\nelement void 0\nproperty int n\nend_header\n\
                1\n0 0 0 5 0\n1 0 0 5 1 7\n1 1 0 5 0\n0.5 3 0 1 2 9 0\n";
    let mesh = read("a.ply", text);
    assert_eq!(
        mesh.attributes().notices,
        [
            "element 'camera' is not carried",
            "vertex property 'z' stands twice, one is carried",
            "vertex property 'extra' is a list and not carried",
            "face property 'quality' is not carried",
            "face property 'flags' is not carried",
            "face property 'more' is not carried",
        ]
    );
    assert!(mesh.attributes().is_empty());
}

/// A property that is the weight is no attribute.
#[test]
fn a_weight_is_not_carried_too() {
    let options = ReadOptions {
        vertex_weight: Some("quality".to_string()),
        ..ReadOptions::default()
    };
    let source = Cursor::new(full_ply().into_bytes());
    let mesh = io::read_from(Path::new("a.ply"), source, None, &options).unwrap();
    assert_eq!(mesh.weights()[..2], [7.25, 7.5]);
    let channels = &mesh.attributes().channels;
    assert!(
        channels
            .iter()
            .all(|channel| channel.components[0].name != "quality")
    );
    assert_eq!(channels.len(), 8);
}

/// Everything that OBJ holds: two objects, groups, materials, seams of both lists at vertex 3, a corner
/// that names less, numbers from the end.
const FULL_OBJ: &str = "mtllib a.mtl b.mtl\nv 0 0 0 1 0 0.5\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\n\
    v 0 1 0 0.1 0.2 0.3\nvt 0 0.25 0\nvt 1 0 0.5\nvt 1 1 0\nvt 0.1 0.2 0.3\nvn 0 0 1\nvn 0 1 0\n\
    f 1/1/1 2/2/1 3/3/1\no a b\nusemtl Material #25\ng left right\nf 1/1/1 3/-1/2 4/4/-2\n\
    usemtl wood\nf 1/1/1 2/2/1 4//1\ng\nf 4/4/1 2/2/1 3/3/1\n";

#[test]
fn obj_keeps_wedges_colours_groups_and_libraries() {
    let mesh = read("a.obj", FULL_OBJ);
    let attributes = mesh.attributes();
    assert_eq!(
        attributes.notices,
        ["1 corner without texture coordinate got zeros"]
    );
    assert_eq!(attributes.material_libraries, ["a.mtl b.mtl"]);
    assert_eq!(
        attributes.corners,
        [[0, 1, 2], [0, 4, 3], [0, 1, 5], [3, 1, 2]]
    );
    let [coordinates, normals, colors] = &attributes.channels[..] else {
        panic!("{attributes:?}");
    };
    assert_eq!(normals.kind, Kind::Normal);
    assert!(coordinates.is_by_corner && normals.is_by_corner && !colors.is_by_corner);
    let row = |channel: &Channel, i| -> Vec<f32> { channel.row(i).map(|x| x as f32).collect() };
    assert_eq!(row(coordinates, 4), [0.1, 0.2, 0.3]);
    assert_eq!(row(coordinates, 5), [0.0, 0.0, 0.0]);
    assert_eq!(row(normals, 4), [0.0, 1.0, 0.0]);
    assert_eq!(row(colors, 5), [0.1, 0.2, 0.3]);
    let group = |object: &str, name: &str, material: &str| Group {
        object: object.into(),
        name: name.into(),
        material: material.into(),
        values: Vec::new(),
    };
    let expected = [
        group("", "", ""),
        group("a b", "left right", "Material #25"),
        group("a b", "left right", "wood"),
        group("a b", "", "wood"),
    ];
    assert_eq!(groups_of_triangles(&mesh), expected.each_ref());
    let again = read("a.obj", written(&mesh, Format::Obj, false));
    let without_notices = |mesh: &IndexedMesh| Attributes {
        notices: Vec::new(),
        ..mesh.attributes().clone()
    };
    assert_eq!(without_notices(&again), without_notices(&mesh));
    assert_eq!(again.triangles(), mesh.triangles());
}

/// Each row once, groups where they change.
#[test]
fn obj_is_written_as_one_would() {
    let text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 0 1\nvt 1 0.1\nvn 0 0 1\n\
                o square\nusemtl wood\nf 1/1/1 2/2/1 3/3/1\nusemtl\nf 1/1/1 3/2/1 4/3/1\n";
    assert_eq!(self::text(&read("a.obj", text), Format::Obj), text);
    let text = "v 0 0 0 1 0.1 0\nv 1 0 0 0 0 1\nv 1 1 0 0 0 0\nf 1 2 3\n";
    assert_eq!(self::text(&read("a.obj", text), Format::Obj), text);
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvn 0 0 1\nf 1//1 2//1 3//1\n";
    assert_eq!(self::text(&read("a.obj", text), Format::Obj), text);
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0.5\nvt 0.25\nf 1/1 2/1 3/2\n";
    assert_eq!(self::text(&read("a.obj", text), Format::Obj), text);
    let mesh = read(
        "a.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0.123456 1\nf 1/1 2/1 3/1\n",
    );
    let options = WriteOptions {
        format: Some(Format::Obj),
        ascii: false,
        precision: Some(2),
    };
    let mut bytes = Vec::new();
    io::write_to(Path::new("a"), &mut bytes, &mesh, &options).unwrap();
    assert!(String::from_utf8(bytes).unwrap().contains("vt 0.12 1\n"));
}

/// What names no row is told and gets zeros, as in other readers: the geometry is fine.
#[test]
fn obj_corners_may_name_rows_that_are_not_there() {
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    for face in [
        "1/0 2/5 3/-9",
        "1/x 2/ 3",
        "1/99999999999999 2/-1 3/4294967295",
    ] {
        let mesh = read(
            "a.obj",
            format!("{square}f 1/1 3/2 4/3\nf {face}\nvt 1 2\nvt 3 4\nvt 5 6\n"),
        );
        let attributes = mesh.attributes();
        assert_eq!(
            attributes.notices,
            ["3 corners without texture coordinate got zeros"],
            "{face}"
        );
        let zeros = |&wedge: &u32| attributes.channels[0].row(wedge as usize).all(|x| x == 0.0);
        assert!(attributes.corners[1].iter().all(zeros), "{face}");
        let row: Vec<f64> = attributes.channels[0]
            .row(attributes.corners[0][2] as usize)
            .collect();
        assert_eq!(row, [5.0, 6.0], "a line behind the face");
    }
    let mesh = read("a.obj", format!("{square}vn 0 0 1\nf 1/1/2 2/1/3 3/1/0\n"));
    let attributes = mesh.attributes();
    let expected = [
        "faces name texture coordinates, but none that the file has",
        "faces name normals, but none that the file has",
    ];
    assert_eq!(attributes.notices, expected);
    assert!(attributes.is_empty() && attributes.corners.is_empty());
    assert!(
        read("a.obj", format!("{square}vn 0 0 1\nf 1 2 3\n"))
            .attributes()
            .is_empty()
    );
}

/// Faces before the vertices that they use, and before the first that names more than a vertex.
#[test]
fn obj_lines_come_in_any_order() {
    let text = "f 1 2 3\nv 0 0 0\nf 1 2 3\nf 1/1 2/2 3/1\nv 1 0 0\nv 1 1 0\ng late\nf 3/2 2/1 1/2\n\
                vt 1 2\nvt 3 4\n";
    let mesh = read("a.obj", text);
    let row = |w: &u32| {
        mesh.attributes().channels[0]
            .row(*w as usize)
            .collect::<Vec<_>>()
    };
    let rows: Vec<_> = mesh
        .attributes()
        .corners
        .as_flattened()
        .iter()
        .map(row)
        .collect();
    let [none, a, b] = [vec![0.0, 0.0], vec![1.0, 2.0], vec![3.0, 4.0]];
    let (first, second, third) = (vec![none; 6], vec![&a, &b, &a], vec![&b, &a, &b]);
    let expected = first.iter().chain(second).chain(third);
    assert!(rows.iter().eq(expected), "{rows:?}");
    let names: Vec<&str> = groups_of_triangles(&mesh)
        .iter()
        .map(|g| g.name.as_str())
        .collect();
    assert_eq!(names, ["", "", "", "late"]);
    let again = read("a.obj", written(&mesh, Format::Obj, false));
    assert_same(&again, &mesh, "written");
}

#[test]
fn obj_vertices_without_colour_are_white() {
    let mesh = read(
        "a.obj",
        "v 0 0 0\nv 1 0 0 0.5 0.5 0.25\nv 1 1 0 1\nf 1 2 3\nv 9 9 9 x y z\n",
    );
    let attributes = mesh.attributes();
    assert_eq!(
        attributes.notices,
        ["3 vertices without colour became white"]
    );
    let white = [1.0; 3];
    let expected = [white, [0.5, 0.5, 0.25], white, white];
    assert_eq!(
        attributes.channels[0].values,
        Values::Singles(expected.concat())
    );
}

/// Two sheets of one sheet's faces, each with a name of its own in Latin-1.
#[test]
fn names_that_are_no_utf_8_are_latin_1() {
    let bytes = [
        b"v 0 0 0\nusemtl caf\xe9\nf 1 1 1\n",
        &b"usemtl \xc3\xa9\\\n b\nf 1 1 1\n"[..],
    ];
    let mesh = read("a.obj", bytes.concat());
    let names: Vec<&str> = groups_of_triangles(&mesh)
        .iter()
        .map(|g| g.material.as_str())
        .collect();
    assert_eq!(names, ["café", "é  b"]);
    assert_same(
        &read("a.obj", written(&mesh, Format::Obj, false)),
        &mesh,
        "written",
    );
}

/// Names travel as comments, what OBJ has of vertices as properties.
#[test]
fn obj_goes_through_ply_and_back() {
    let mesh = read("a.obj", FULL_OBJ);
    for ascii in [false, true] {
        let through = read("a.ply", written(&mesh, Format::Ply, ascii));
        // A vertex with two normals stands there twice, until it is welded.
        assert_eq!(through.positions().len(), 5);
        let (welded, _) = clean(through.clone(), true).unwrap();
        assert_eq!(welded.positions().len(), 4);
        let back = read("a.obj", written(&welded, Format::Obj, false));
        assert_eq!(groups_of_triangles(&back), groups_of_triangles(&mesh));
        let (ours, theirs) = (back.attributes(), mesh.attributes());
        assert_eq!(ours.material_libraries, theirs.material_libraries);
        for channel in &theirs.channels {
            let is_same = |other: &&Channel| other.kind == channel.kind;
            let other = ours.channels.iter().find(is_same).unwrap();
            assert_eq!(
                rows(&back, other),
                rows(&mesh, channel),
                "{:?}",
                channel.kind
            );
        }
        assert_same(
            &read("a.ply", written(&through, Format::Ply, ascii)),
            &through,
            "PLY again",
        );
        assert!(io::cannot_carry(&mesh, Format::Ply).is_empty());
    }
    let text = text(&mesh, Format::Ply);
    assert!(text.contains("comment material 0 Material #25\n"), "{text}");
    assert!(text.contains("comment mtllib a.mtl b.mtl\n"), "{text}");
}

/// Bytes become numbers from 0 to 1, and these the same bytes.
#[test]
fn byte_colours_are_fractions_in_obj() {
    let mesh = read("a.ply", full_ply());
    let mut attributes = mesh.attributes().clone();
    let names = ["red", "green", "blue"].map(|name| Property {
        name: name.into(),
        number: NumberType::U8,
    });
    let mut colors = Channel::new(Kind::Color, names.into());
    (0..15).for_each(|i| colors.values.push((17 * i).into()));
    attributes.channels = vec![colors];
    let mesh = mesh.with_attributes(attributes).unwrap();
    let back = read("a.obj", written(&mesh, Format::Obj, false));
    let Values::Singles(colors) = &back.attributes().channels[0].values else {
        panic!("{back:?}");
    };
    let bytes: Vec<f32> = colors.iter().map(|x| (x * 255.0).round()).collect();
    let expected: Vec<f32> = (0..15).map(|i| (17 * i) as f32).collect();
    assert_eq!(bytes, expected);
}

/// The back has what the front has, corner by corner.
#[test]
fn both_sides_of_a_triangle_carry_the_same() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 1\nvt 2 3\nvt 4 5\nvn 0 0 1\nusemtl x\n\
                f 1/1/1 2/2/1 3/3/1\n";
    let mesh = read("a.obj", text).with_double_sided(vec![true]).unwrap();
    for (format, ascii) in [
        (Format::Obj, true),
        (Format::Ply, false),
        (Format::Ply, true),
    ] {
        let back = read(&format!("a.{format}"), written(&mesh, format, ascii));
        assert_eq!(back.triangles(), [[0, 1, 2], [0, 2, 1]], "{format}");
        assert_eq!(groups_of_triangles(&back).len(), 2);
        assert_eq!(back.attributes().corners, [[0, 1, 2], [0, 2, 1]]);
        assert_eq!(back.attributes().channels.len(), 2);
    }
}

#[test]
fn what_a_format_has_no_place_for_is_said() {
    let mesh = read("a.ply", full_ply());
    assert!(io::cannot_carry(&mesh, Format::Ply).is_empty());
    let says = |format| io::cannot_carry(&mesh, format).join("\n");
    let obj = says(Format::Obj);
    assert!(
        obj.starts_with("obj has no place for vertex property 'quality'\n"),
        "{obj}"
    );
    assert!(
        obj.contains("'alpha'") && obj.ends_with("texture files"),
        "{obj}"
    );
    assert_eq!(obj.lines().count(), 8);
    assert!(says(Format::Stl).starts_with("stl has no place for normals (nx, ny, nz)\n"));
    let mesh = read("a.obj", FULL_OBJ);
    assert!(io::cannot_carry(&mesh, Format::Obj).is_empty());
    let off = io::cannot_carry(&mesh, Format::Off);
    let what = [
        "texture coordinates",
        "normals",
        "colours",
        "objects",
        "groups",
        "materials",
    ];
    for (sentence, what) in off
        .iter()
        .zip(what.into_iter().chain(["material libraries"]))
    {
        assert!(
            sentence.starts_with(&format!("off has no place for {what}")),
            "{sentence}"
        );
    }
    assert_eq!(off.len(), 7);
    let mesh = read("a.ply", wedge_ply());
    let lost = io::cannot_carry(&mesh, Format::Obj);
    assert_eq!(lost[0], "obj has no place for face property 'texnumber'");
}

#[test]
fn a_bad_attribute_says_where() {
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\n";
    for (line, expected) in [
        ("vn 0 1", "a.obj:4: 'vn 0 1'; expected vn and three numbers"),
        ("vt", "a.obj:4: 'vt'; expected vt and one to three numbers"),
        (
            "vt 0,5 1",
            "a.obj:4: 'vt 0,5 1'; expected vt and one to three numbers",
        ),
    ] {
        let error = try_read("a.obj", format!("{square}{line}\nf 1 2 3\n"));
        assert_eq!(error.unwrap_err(), expected);
    }
    let error = try_read("a.ply", full_ply().replace("254 65534", "256 65534")).unwrap_err();
    assert!(
        error.starts_with("a.ply:27: vertex '1 0 0 0 1 0 0.2"),
        "{error}"
    );
    let error = try_read("a.ply", wedge_ply().replace("6 0 0 0.125", "7 0 0 0.125")).unwrap_err();
    assert!(error.starts_with("a.ply:23: face '3 0 2 3 7"), "{error}");
}

/// A million faces of a million names, each with a long one in front: told, and not kept.
#[test]
fn names_take_no_more_room_than_they_are_worth() {
    let mut text = format!("v 0 0 0\no {}\n", "x".repeat(1 << 20));
    (0..1000).for_each(|i| text += &format!("g {i}\nf 1 1 1\n"));
    let mesh = read("a.obj", text);
    let attributes = mesh.attributes();
    assert!(attributes.groups.is_empty() && attributes.group_of.is_empty());
    let expected = "groups are not carried: their names take more than 256 bytes each";
    assert_eq!(attributes.notices, [expected]);
}

/// A header that is as long as none is has no comments, and is read again.
#[test]
fn names_that_are_too_long_for_a_header_are_left_out() {
    let name = "x".repeat(9 << 20);
    let mesh = read(
        "a.obj",
        format!("mtllib {name}\nv 0 0 0\nusemtl a\nf 1 1 1\n"),
    );
    let expected = "ply has no place for names that take so much room";
    assert_eq!(io::cannot_carry(&mesh, Format::Ply), [expected]);
    let again = read("a.ply", written(&mesh, Format::Ply, false));
    assert!(again.attributes().is_empty());
    assert_eq!(again.triangle_count(), 1);
}

/// Vertices and faces may have colours of one name; a name that is taken gets another.
#[test]
fn names_are_those_of_the_element() {
    let text = strip_ply(
        20,
        "property uchar red\nproperty uchar green\nproperty uchar blue\n",
        |_| "1 2 3".to_string(),
    );
    let mesh = read("a.ply", text);
    let mut attributes = mesh.attributes().clone();
    for name in ["red", "red", "x", "a b"] {
        let mut channel = Channel::of_singles(Kind::Scalar, &[name]);
        (0..22).for_each(|i| channel.values.push(i.into()));
        attributes.channels.push(channel);
    }
    attributes.corners = mesh.triangles().to_vec();
    let mesh = mesh.with_attributes(attributes).unwrap();
    let again = read("a.ply", written(&mesh, Format::Ply, true));
    let channels = again.attributes().channels.iter();
    let names: Vec<&str> = channels.map(|c| c.components[0].name.as_str()).collect();
    assert_eq!(names, ["red", "red_", "x_", "a_b"]);
    assert_eq!(
        again.attributes().face_properties,
        mesh.attributes().face_properties
    );
}

/// Every file of `MESHES`, written in both formats and read again; the PLY with a seam in another channel
/// than texture coordinates is welded first.
#[test]
fn real_files_keep_what_they_carry() {
    let Some(meshes) = std::env::var_os("MESHES") else {
        eprintln!("skipped: MESHES names no folder with meshes/");
        return;
    };
    let folder = PathBuf::from(meshes).join("meshes");
    for (name, channels, groups) in [
        ("spot.obj", 1, 0),
        ("pirate.obj", 2, 7),
        ("office_chair.obj", 0, 11),
        ("Laurana50k.ply", 1, 0),
        ("cycloidal.ply", 1, 7),
        ("screwdriver.ply", 1, 0),
        ("face000.ply", 2, 0),
    ] {
        let mesh = io::read(&folder.join(name), &ReadOptions::default()).unwrap();
        let attributes = mesh.attributes();
        assert_eq!(
            (attributes.channels.len(), attributes.groups.len()),
            (channels, groups),
            "{name}"
        );
        let format = Format::from_extension(Path::new(name)).unwrap();
        for ascii in [false, true] {
            let again = read(name, written(&mesh, format, ascii));
            assert_same(&again, &mesh, name);
            assert_eq!(again.attributes().corners, attributes.corners, "{name}");
        }
        let ply = read("a.ply", written(&mesh, Format::Ply, false));
        for (channel, other) in attributes.channels.iter().zip(&ply.attributes().channels) {
            let is_same = |c: &&Channel| c.kind == channel.kind && c.kind != Kind::Scalar;
            let found = ply.attributes().channels.iter().find(is_same);
            assert_eq!(
                rows(&ply, found.unwrap_or(other)),
                rows(&mesh, channel),
                "{name}"
            );
        }
        assert_eq!(
            groups_of_triangles(&ply),
            groups_of_triangles(&mesh),
            "{name}"
        );
    }
}
