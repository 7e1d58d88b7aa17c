//! glTF 2.0, binary and as JSON: the meshes of a scene become one, each where its nodes put it.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::path::Path;

use glam::{DAffine3, DMat3, DVec3};

use crate::attributes::{Attributes, Channel, Kind, NumberType, Property};
use crate::error::Result;
use crate::indexed_mesh::{MAX_TRIANGLES, MAX_VERTICES, MeshBuilder};

use super::gltf_accessor::{Elements, Source, load_buffers};
use super::gltf_channels::{Slots, number_type};
use super::gltf_document::{Answer, Container, Document, MAGIC, Node, Placement, Wrong};
use super::gltf_materials::{Materials, assets, is_nameless};
use super::gltf_parts::{Part, Slot, parts_of};
use super::input::Input;
use super::text::one_line;

/// An extension that puts a node's mesh in several places.
const INSTANCES: &str = "EXT_mesh_gpu_instancing";

/// Whether a file is binary glTF.
pub(super) fn is_binary(head: &[u8]) -> bool {
    head.starts_with(MAGIC)
}

/// Whether a file is glTF as JSON: an object with an `asset`.
pub(super) fn is_json(head: &[u8]) -> bool {
    let head = head.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(head);
    let asset = b"\"asset\"";
    head.trim_ascii_start().starts_with(b"{") && head.windows(asset.len()).any(|w| w == asset)
}

/// Reads a glTF file of either kind into a mesh. Vertices that the file holds twice, as it does at
/// seams, stay twice: welding is a later stage's work.
pub(super) fn read(
    mut input: Input,
    with_attributes: bool,
    builder: &mut MeshBuilder,
) -> Result<()> {
    let mut bytes = Vec::new();
    let read = input.reader.read_to_end(&mut bytes);
    read.map_err(|error| input.io_error(error))?;
    read_bytes(&bytes, input.folder.as_deref(), with_attributes, builder)
        .map_err(|wrong| input.error(wrong.place, &wrong.found, &wrong.expected))
}

fn read_bytes(
    bytes: &[u8],
    folder: Option<&Path>,
    with_attributes: bool,
    builder: &mut MeshBuilder,
) -> Answer<()> {
    let Container { json, chunk } = Container::of(bytes)?;
    let mut document = Document::parse(json)?;
    let buffers = load_buffers(&mut document, chunk, folder)?;
    let placements = document.placements()?;
    let mut source = Source::new(&document, &buffers);
    let mut materials = Materials::of(&document);
    let mut meshes = BTreeMap::new();
    let mut used: Vec<usize> = placements.iter().map(|p| p.mesh).collect();
    used.sort_unstable();
    used.dedup();
    for mesh in used {
        let parts = parts_of(mesh, &mut source, &mut materials, with_attributes)?;
        meshes.insert(mesh, parts);
    }
    if !with_attributes || materials.groups.iter().all(is_nameless) {
        // One group of everything says nothing.
        meshes
            .values_mut()
            .flatten()
            .for_each(|part| part.group = None);
        materials.groups.clear();
    }
    let slots = if with_attributes {
        Slots::of(meshes.values().flatten())
    } else {
        Slots::default()
    };
    // Before anything is made room for.
    let assets = if with_attributes {
        assets(&source, materials.names)?
    } else {
        None
    };
    check_sizes(&placements, &meshes, builder)?;
    let mut channels: Vec<Channel> = slots.channels();
    for placement in &placements {
        place(
            placement,
            &meshes[&placement.mesh],
            &slots,
            &mut channels,
            builder,
        );
    }
    if with_attributes {
        let attributes = builder.attributes();
        let mut kinds = channels.iter().map(|channel| channel.kind);
        attributes.v_is_down = kinds.any(|kind| kind == Kind::TextureCoordinate);
        attributes.channels = channels;
        attributes.groups = materials.groups;
        attributes.assets = assets;
        attributes.notices = slots.notices;
        say_what_is_left(&document, attributes);
        for notice in &mut attributes.notices {
            *notice = one_line(notice);
        }
    }
    Ok(())
}

/// Refuses more than a mesh can number, and makes room for what there is.
fn check_sizes(
    placements: &[Placement],
    meshes: &BTreeMap<usize, Vec<Part>>,
    builder: &mut MeshBuilder,
) -> Answer<()> {
    let size = |parts: &Vec<Part>| {
        let with_triangles = parts.iter().filter(|part| part.triangle_count() > 0);
        let blocks: BTreeSet<usize> = with_triangles.map(|part| part.block).collect();
        let vertices = blocks.iter().map(|&b| parts[b].positions.count as u64);
        let vertices: u64 = vertices.sum();
        let triangles: u64 = parts.iter().map(|part| part.triangle_count() as u64).sum();
        (vertices, triangles)
    };
    let sizes: BTreeMap<usize, (u64, u64)> = meshes
        .iter()
        .map(|(&mesh, parts)| (mesh, size(parts)))
        .collect();
    let (mut vertices, mut triangles) = (0u64, 0u64);
    for placement in placements {
        let (more_vertices, more_triangles) = sizes[&placement.mesh];
        vertices = vertices.saturating_add(more_vertices);
        triangles = triangles.saturating_add(more_triangles);
    }
    if vertices > MAX_VERTICES as u64 || triangles > MAX_TRIANGLES as u64 {
        let found = format!("the nodes hold {vertices} vertices and {triangles} triangles");
        let expected = format!("at most {MAX_VERTICES} and {MAX_TRIANGLES}");
        return Err(Wrong::new(found, expected));
    }
    builder.reserve_vertices(vertices as usize);
    builder.reserve_triangles(triangles as usize);
    Ok(())
}

/// Adds a mesh where a node puts it.
fn place(
    placement: &Placement,
    parts: &[Part],
    slots: &Slots,
    channels: &mut [Channel],
    builder: &mut MeshBuilder,
) {
    let transform = placement.transform;
    let is_mirrored = transform.matrix3.determinant() < 0.0;
    let mut begins: Vec<Option<u32>> = vec![None; parts.len()];
    for part in parts.iter().filter(|part| part.triangle_count() > 0) {
        let begin = *begins[part.block].get_or_insert_with(|| {
            let begin = builder.vertex_count() as u32;
            push_positions(part, &transform, builder);
            for ((slot, _, number), channel) in slots.list.iter().zip(channels.iter_mut()) {
                match part.attributes.get(slot) {
                    Some(elements) => push_values(slot, *number, elements, &transform, channel),
                    None => push_default(slot, part, parts, &transform, channel),
                }
            }
            begin
        });
        if let Some(group) = part.group {
            builder.begin_group(group);
        }
        builder.push_triangles(part.triangles().map(|triangle| {
            let [a, b, c] = triangle.map(|v| begin + v);
            if is_mirrored { [a, c, b] } else { [a, b, c] }
        }));
    }
}

fn push_positions(part: &Part, transform: &DAffine3, builder: &mut MeshBuilder) {
    let positions = &part.positions;
    for i in 0..positions.count {
        let [x, y, z, _] = positions.decoded(i);
        let position = DVec3::new(x, y, z);
        // Zero times infinity would be in the way where nothing is turned.
        let turned = if transform.matrix3 == DMat3::IDENTITY {
            position
        } else {
            transform.matrix3 * position
        };
        let moved = if transform.translation == DVec3::ZERO {
            turned
        } else {
            turned + transform.translation
        };
        builder.push_double(moved.to_array());
    }
}

fn push_values(
    slot: &Slot,
    number: NumberType,
    elements: &Elements,
    transform: &DAffine3,
    channel: &mut Channel,
) {
    let width = channel.width();
    let is_raw = number == number_type(slot, elements) && number != NumberType::F32;
    let turn = (*slot == Slot::Normal && transform.matrix3 != DMat3::IDENTITY)
        .then(|| normal_matrix(&transform.matrix3));
    for i in 0..elements.count {
        let mut row = if is_raw {
            elements.row(i)
        } else {
            elements.decoded(i)
        };
        if let Some(turn) = &turn {
            let normal = unit(*turn * DVec3::new(row[0], row[1], row[2]));
            row[..3].copy_from_slice(&normal.to_array());
        }
        if elements.width < width {
            // Only alpha may be missing.
            row[3] = number.range().map_or(1.0, |(_, most)| most);
        }
        row[..width].iter().for_each(|&x| channel.values.push(x));
    }
}

/// What vertices get whose primitive has no such attribute.
fn push_default(
    slot: &Slot,
    part: &Part,
    parts: &[Part],
    transform: &DAffine3,
    channel: &mut Channel,
) {
    let vertices = part.positions.count;
    if *slot == Slot::Normal {
        let turn = normal_matrix(&transform.matrix3);
        let mut normals = vec![DVec3::ZERO; vertices];
        let point = |v: u32| {
            let [x, y, z, _] = part.positions.decoded(v as usize);
            DVec3::new(x, y, z)
        };
        for other in parts.iter().filter(|other| other.block == part.block) {
            for triangle in other.triangles() {
                let [a, b, c] = triangle.map(point);
                let area = (b - a).cross(c - a);
                triangle.iter().for_each(|&v| normals[v as usize] += area);
            }
        }
        let normals = normals.into_iter().map(|n| unit(turn * n).to_array());
        normals.flatten().for_each(|x| channel.values.push(x));
        return;
    }
    let most = |property: &Property| property.number.range().map_or(1.0, |(_, most)| most);
    let row: Vec<f64> = match slot {
        Slot::Color(_) => channel.components.iter().map(most).collect(),
        _ => vec![0.0; channel.width()],
    };
    for _ in 0..vertices {
        row.iter().for_each(|&x| channel.values.push(x));
    }
}

/// The inverse transpose up to a positive factor, which turns normals; it exists for every matrix.
fn normal_matrix(matrix: &DMat3) -> DMat3 {
    let (x, y, z) = (matrix.x_axis, matrix.y_axis, matrix.z_axis);
    let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
    if matrix.determinant() < 0.0 {
        -cofactors
    } else {
        cofactors
    }
}

/// The vector at length 1, or as it is where it has no direction.
fn unit(n: DVec3) -> DVec3 {
    let length = n.dot(n).sqrt();
    if length > 0.0 && length.is_finite() {
        n / length
    } else {
        n
    }
}

/// Adds notices about what the document has beside meshes and materials.
fn say_what_is_left(document: &Document, attributes: &mut Attributes) {
    let has_node = |has: &dyn Fn(&Node) -> bool| document.nodes.iter().any(has);
    let has_instances = |extensions: &BTreeMap<String, _>| extensions.contains_key(INSTANCES);
    let left = [
        (document.animations.is_some(), "animations are not carried"),
        (document.cameras.is_some(), "cameras are not carried"),
        (
            has_node(&|node| node.skin.is_some()),
            "skins are not carried; meshes stand as they are without",
        ),
        (
            has_node(&|node| node.extensions.as_ref().is_some_and(has_instances)),
            "instances (EXT_mesh_gpu_instancing) are not carried; their meshes stand once",
        ),
    ];
    let left = left.into_iter().filter(|(is_there, _)| *is_there);
    attributes
        .notices
        .extend(left.map(|(_, notice)| notice.to_string()));
}
