//! glTF 2.0, binary and as JSON: the meshes of a scene become one, each where its nodes put it.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3};
use gltf::json;
use gltf::json::accessor::ComponentType;
use gltf::json::mesh::{Mode, Semantic};
use gltf::json::validation::Checked;
use serde_json::{Map, Value};

use crate::attributes::{Assets, Attributes, Channel, Group, Kind, NumberType, Property};
use crate::error::Result;
use crate::indexed_mesh::{MAX_TRIANGLES, MAX_VERTICES, MeshBuilder};

use super::gltf_accessor::{Elements, Source, compressed_with, load_buffers};
use super::gltf_document::{
    Answer, Container, Document, MAGIC, Node, Placement, Wrong, out_of_range,
};
use super::input::Input;

/// An extension that keeps a primitive's geometry compressed.
const COMPRESSED_PRIMITIVE: &str = "KHR_draco_mesh_compression";
/// An extension that puts a node's mesh in several places.
const INSTANCES: &str = "EXT_mesh_gpu_instancing";
/// The most sets of texture coordinates, and of colours; clients read two, and one.
const MOST_SETS: u32 = 8;
/// The most channels of a number each: what a vertex takes stays in proportion to a file's bytes.
const MOST_SCALARS: usize = 32;

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
    }
    Ok(())
}

/// What the materials of a file are called, and which pairs of mesh and material there are.
#[derive(Default)]
struct Materials {
    names: Vec<String>,
    groups: Vec<Group>,
    group_of: BTreeMap<(String, String), u32>,
}

impl Materials {
    /// Each material has a name that no other has: its own, or that with its number.
    fn of(document: &Document) -> Self {
        let mut taken = BTreeSet::new();
        let names = document.materials.iter().enumerate().map(|(i, material)| {
            let own = material["name"].as_str().unwrap_or_default();
            let mut name = match own {
                "" => format!("material_{i}"),
                own if taken.contains(own) => format!("{own}_{i}"),
                own => own.to_string(),
            };
            while !taken.insert(name.clone()) {
                name.push('_');
            }
            name
        });
        Self {
            names: names.collect(),
            ..Self::default()
        }
    }

    /// The group of a mesh's faces of a material, by their names.
    fn group(&mut self, mesh: &str, material: &str) -> u32 {
        let next = self.groups.len() as u32;
        let group = self.group_of.entry((mesh.into(), material.into()));
        *group.or_insert_with(|| {
            self.groups.push(Group {
                object: mesh.into(),
                material: material.into(),
                ..Group::default()
            });
            next
        })
    }
}

fn is_nameless(group: &Group) -> bool {
    group.object.is_empty() && group.material.is_empty()
}

/// A primitive's place in the file.
#[derive(Clone, Copy)]
struct Origin {
    mesh: usize,
    primitive: usize,
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "meshes[{}].primitives[{}]", self.mesh, self.primitive)
    }
}

/// A primitive, its accessors checked.
struct Part<'a> {
    path: Origin,
    mode: Mode,
    indices: Option<Elements<'a>>,
    positions: Elements<'a>,
    /// Which of the mesh's parts was the first with these very attributes: its vertices are theirs.
    block: usize,
    attributes: BTreeMap<Slot, Elements<'a>>,
    /// What the primitive has that is not carried.
    left: Vec<String>,
    group: Option<u32>,
}

/// What a vertex attribute is, in the order in which channels stand.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Slot {
    Normal,
    TextureCoordinate(u32),
    Color(u32),
    Scalar(String),
}

/// The primitives of a mesh.
fn parts_of<'a>(
    mesh: usize,
    source: &mut Source<'a>,
    materials: &mut Materials,
    with_attributes: bool,
) -> Answer<Vec<Part<'a>>> {
    let document: &'a Document = source.document;
    let the_mesh = &document.meshes[mesh];
    let mut blocks = BTreeMap::new();
    let mut parts = Vec::new();
    for (i, primitive) in the_mesh.primitives.iter().enumerate() {
        let path = Origin { mesh, primitive: i };
        let material = match primitive.material {
            None => String::new(),
            Some(material) => {
                let names = &materials.names;
                let name = names.get(material.value()).cloned();
                let found = || format!("{path}.material is {material}");
                name.ok_or_else(|| out_of_range(found(), names.len()))?
            }
        };
        let name = the_mesh.name.as_deref().unwrap_or_default();
        let mut part = part_of(primitive, path, source, with_attributes)?;
        part.group = (part.triangle_count() > 0).then(|| materials.group(name, &material));
        part.block = *blocks.entry(&primitive.attributes).or_insert(parts.len());
        parts.push(part);
    }
    Ok(parts)
}

fn part_of<'a>(
    primitive: &json::mesh::Primitive,
    path: Origin,
    source: &mut Source<'a>,
    with_attributes: bool,
) -> Answer<Part<'a>> {
    let Checked::Valid(mode) = primitive.mode else {
        return Err(Wrong::new(format!("{path}.mode is none of glTF"), "0 to 6"));
    };
    let positions = primitive
        .attributes
        .get(&Checked::Valid(Semantic::Positions));
    let has_extension = |name| {
        let mut extensions = primitive.extensions.iter().flat_map(|e| e.others.keys());
        extensions.any(|extension| extension == name)
    };
    if has_extension(COMPRESSED_PRIMITIVE) {
        let document = source.document;
        let accessor = positions.and_then(|p| document.accessors.get(p.value()));
        let required = &document.extensions_required;
        let is_required = required.iter().any(|name| name == COMPRESSED_PRIMITIVE);
        if is_required || accessor.is_none_or(|a| a.buffer_view.is_none()) {
            return Err(compressed_with(&path.to_string(), COMPRESSED_PRIMITIVE));
        }
    }
    let Some(positions) = positions else {
        let found = format!("{path} has no POSITION");
        return Err(Wrong::new(found, "one"));
    };
    let user = || format!("{path}.attributes.POSITION");
    let positions = source.elements(positions.value(), &user)?;
    if positions.width != 3 {
        let found = format!("{} has {} numbers a vertex", user(), positions.width);
        return Err(Wrong::new(found, "3"));
    }
    let indices = match primitive.indices {
        None => None,
        Some(i) => Some(indices_of(i.value(), path, positions.count, source)?),
    };
    let mut part = Part {
        path,
        mode,
        indices,
        positions,
        block: 0,
        attributes: BTreeMap::new(),
        left: Vec::new(),
        group: None,
    };
    if with_attributes {
        read_attributes(primitive, &mut part, source)?;
    }
    Ok(part)
}

/// A primitive's indices, all of vertices that are there.
fn indices_of<'a>(
    accessor: usize,
    path: Origin,
    vertices: usize,
    source: &mut Source<'a>,
) -> Answer<Elements<'a>> {
    let user = || format!("{path}.indices");
    let indices = source.elements(accessor, &user)?;
    let is_index = matches!(
        indices.number,
        ComponentType::U8 | ComponentType::U16 | ComponentType::U32
    );
    if !is_index || indices.width != 1 {
        let found = format!("{} are no integers without sign, one a row", user());
        return Err(Wrong::new(
            found,
            "SCALAR of componentType 5121, 5123 or 5125",
        ));
    }
    let outside = (0..indices.count).find(|&i| indices.index(i) as usize >= vertices);
    match outside {
        None => Ok(indices),
        Some(i) => {
            let found = format!("{path}: indices[{i}] is {}", indices.index(i));
            Err(out_of_range(found, vertices))
        }
    }
}

/// Notes what of a primitive's attributes is carried, and what is not.
fn read_attributes<'a>(
    primitive: &json::mesh::Primitive,
    part: &mut Part<'a>,
    source: &mut Source<'a>,
) -> Answer<()> {
    let path = part.path;
    for (semantic, accessor) in &primitive.attributes {
        let name = semantic.to_string();
        let slot = match semantic {
            Checked::Valid(Semantic::Positions) => continue,
            Checked::Valid(Semantic::Normals) => Slot::Normal,
            Checked::Valid(Semantic::TexCoords(set)) if *set < MOST_SETS => {
                Slot::TextureCoordinate(*set)
            }
            Checked::Valid(Semantic::Colors(set)) if *set < MOST_SETS => Slot::Color(*set),
            Checked::Valid(Semantic::Extras(name)) => Slot::Scalar(name.clone()),
            _ => {
                part.left.push(name);
                continue;
            }
        };
        let user = || format!("{path}.attributes.{name}");
        let elements = source.elements(accessor.value(), &user)?;
        let (width, expected) = match slot {
            Slot::Normal => (elements.width == 3, "VEC3"),
            Slot::TextureCoordinate(_) => (elements.width == 2, "VEC2"),
            Slot::Color(_) => (matches!(elements.width, 3 | 4), "VEC3 or VEC4"),
            Slot::Scalar(_) => (true, ""),
        };
        if !width {
            let found = format!("{} has {} numbers a vertex", user(), elements.width);
            return Err(Wrong::new(found, expected));
        }
        if elements.count != part.positions.count {
            let found = format!("{} has {} rows", user(), elements.count);
            let expected = format!("{}, as POSITION has", part.positions.count);
            return Err(Wrong::new(found, expected));
        }
        if matches!(slot, Slot::Scalar(_)) && elements.width != 1 {
            part.left.push(name);
        } else {
            part.attributes.insert(slot, elements);
        }
    }
    if primitive.targets.as_ref().is_some_and(|t| !t.is_empty()) {
        part.left.push("morph targets".into());
    }
    Ok(())
}

impl Part<'_> {
    /// How many corners stand in a row.
    fn corners(&self) -> usize {
        self.indices.map_or(self.positions.count, |i| i.count)
    }

    fn triangle_count(&self) -> usize {
        match self.mode {
            Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => 0,
            Mode::Triangles => self.corners() / 3,
            Mode::TriangleStrip | Mode::TriangleFan => self.corners().saturating_sub(2),
        }
    }

    /// The triangles, by the rows of the primitive's attributes.
    fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        let corner = |i: usize| self.indices.map_or(i as u32, |indices| indices.index(i));
        let corners = |i: usize| match self.mode {
            // Every other triangle of a strip would lie upside down.
            Mode::TriangleStrip if i % 2 == 1 => [i, i + 2, i + 1],
            Mode::TriangleStrip => [i, i + 1, i + 2],
            Mode::TriangleFan => [i + 1, i + 2, 0],
            _ => [3 * i, 3 * i + 1, 3 * i + 2],
        };
        (0..self.triangle_count()).map(move |i| corners(i).map(corner))
    }
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

/// The channels that the primitives together have.
#[derive(Default)]
struct Slots {
    list: Vec<(Slot, usize, NumberType)>,
    notices: Vec<String>,
}

impl Slots {
    /// Normals, texture coordinates and colours are carried where any primitive has them, other
    /// numbers where all have them.
    fn of<'a, 'b: 'a>(parts: impl Iterator<Item = &'a Part<'b>>) -> Self {
        let mut found: BTreeMap<Slot, (usize, usize, NumberType)> = BTreeMap::new();
        let mut left: BTreeMap<String, usize> = BTreeMap::new();
        let (mut all, mut without) = (0, 0);
        for part in parts {
            if part.triangle_count() == 0 {
                without += 1;
                continue;
            }
            all += 1;
            for (slot, elements) in &part.attributes {
                let number = number_type(slot, elements);
                let (count, width, common) =
                    found
                        .entry(slot.clone())
                        .or_insert((0, elements.width, number));
                *count += 1;
                *width = elements.width.max(*width);
                *common = common_type(*common, number);
            }
            for name in &part.left {
                *left.entry(name.clone()).or_default() += 1;
            }
        }
        let mut slots = Self::default();
        let mut scalars = 0;
        for (slot, (count, width, number)) in found {
            let name = slot.to_string();
            if let Slot::Scalar(_) = slot {
                scalars += 1;
                if count < all || scalars > MOST_SCALARS {
                    left.insert(name, count);
                    continue;
                }
            } else if count < all {
                slots.notices.push(format!(
                    "{name} is on {count} of {all} primitives; the others get {}",
                    match slot {
                        Slot::Normal => "normals of their faces",
                        Slot::Color(_) => "white",
                        _ => "zeros",
                    }
                ));
            }
            slots.fill_gap(&slot);
            slots.list.push((slot, width, number));
        }
        let not_carried = |(name, count)| format!("{name} of {count} primitives is not carried");
        slots.notices.extend(left.into_iter().map(not_carried));
        if without > 0 {
            let notice = format!("{without} primitives have no triangles and are not carried");
            slots.notices.push(notice);
        }
        slots
    }

    /// Adds the sets that number up to this one's, which materials name by number.
    fn fill_gap(&mut self, slot: &Slot) {
        let (set, make): (u32, fn(u32) -> Slot) = match slot {
            Slot::TextureCoordinate(set) => (*set, Slot::TextureCoordinate),
            Slot::Color(set) => (*set, Slot::Color),
            Slot::Normal | Slot::Scalar(_) => return,
        };
        let width = if let Slot::Color(_) = slot { 4 } else { 2 };
        for set in 0..set {
            if !self.list.iter().any(|(there, ..)| *there == make(set)) {
                self.list.push((make(set), width, NumberType::F32));
            }
        }
    }

    /// Empty channels, by the names that a PLY file would have.
    fn channels(&self) -> Vec<Channel> {
        let channel = |(slot, width, number): &(Slot, usize, NumberType)| {
            let (kind, names, set): (_, &[&str], u32) = match slot {
                Slot::Normal => (Kind::Normal, &["nx", "ny", "nz"], 0),
                Slot::TextureCoordinate(set) => (Kind::TextureCoordinate, &["s", "t"], *set),
                Slot::Color(set) => (Kind::Color, &["red", "green", "blue", "alpha"], *set),
                Slot::Scalar(name) => (Kind::Scalar, &[name.as_str()], 0),
            };
            let property = |name: &&str| Property {
                name: match set {
                    0 => name.to_string(),
                    set => format!("{name}{set}"),
                },
                number: *number,
            };
            Channel::new(kind, names[..*width].iter().map(property).collect())
        };
        self.list.iter().map(channel).collect()
    }
}

impl fmt::Display for Slot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Slot::Normal => f.write_str("NORMAL"),
            Slot::TextureCoordinate(set) => write!(f, "TEXCOORD_{set}"),
            Slot::Color(set) => write!(f, "COLOR_{set}"),
            Slot::Scalar(name) => write!(f, "_{name}"),
        }
    }
}

/// The type that keeps an attribute's numbers: colours and other numbers stay integers.
fn number_type(slot: &Slot, elements: &Elements) -> NumberType {
    let is_color = matches!(slot, Slot::Color(_));
    let is_raw = match slot {
        Slot::Normal | Slot::TextureCoordinate(_) => false,
        Slot::Color(_) => elements.is_normalized,
        Slot::Scalar(_) => !elements.is_normalized,
    };
    match elements.number {
        ComponentType::U8 if is_raw => NumberType::U8,
        ComponentType::U16 if is_raw => NumberType::U16,
        ComponentType::I8 if is_raw && !is_color => NumberType::I8,
        ComponentType::I16 if is_raw && !is_color => NumberType::I16,
        ComponentType::U32 if is_raw && !is_color => NumberType::U32,
        _ => NumberType::F32,
    }
}

/// One type for numbers of two.
fn common_type(a: NumberType, b: NumberType) -> NumberType {
    if a == b {
        a
    } else if a.fits_single() && b.fits_single() {
        NumberType::F32
    } else {
        NumberType::F64
    }
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

/// The materials and what they name.
fn assets(source: &Source, material_names: Vec<String>) -> Answer<Option<Arc<Assets>>> {
    let document = source.document;
    if document.materials.is_empty() {
        return Ok(None);
    }
    let mut assets = Assets {
        material_names,
        ..Assets::default()
    };
    let mut blobs: BTreeMap<u64, usize> = BTreeMap::new();
    let mut bytes = 0;
    let mut images = document.images.clone();
    for (i, image) in images.iter_mut().enumerate() {
        let Some(view) = image.get_mut("bufferView") else {
            continue;
        };
        let Some(number) = view.as_u64() else {
            let found = format!("images[{i}].bufferView is {view}");
            return Err(Wrong::new(found, "the number of one"));
        };
        let blob = match blobs.get(&number) {
            Some(&blob) => blob,
            None => {
                let index = usize::try_from(number).unwrap_or(usize::MAX);
                let blob = source.view(index, &|| format!("images[{i}]"))?;
                bytes += blob.len();
                if bytes > source.bytes() {
                    let found = format!("images 0 to {i} have {bytes} bytes together");
                    let expected = format!("at most {}, as the buffers have", source.bytes());
                    return Err(Wrong::new(found, expected));
                }
                assets.blobs.push(blob.to_vec());
                blobs.insert(number, assets.blobs.len() - 1);
                assets.blobs.len() - 1
            }
        };
        *view = blob.into();
    }
    let mut used = BTreeSet::new();
    for (name, list) in [
        ("materials", &document.materials),
        ("textures", &document.textures),
        ("samplers", &document.samplers),
        ("images", &images),
    ] {
        if !list.is_empty() {
            list.iter()
                .for_each(|value| note_extensions(value, &mut used));
            assets.lists.insert(name.into(), list.clone().into());
        }
    }
    for (name, list) in [
        ("extensionsUsed", &document.extensions_used),
        ("extensionsRequired", &document.extensions_required),
    ] {
        let kept: Vec<Value> = list
            .iter()
            .filter(|extension| used.contains(extension.as_str()))
            .map(|extension| extension.as_str().into())
            .collect();
        if !kept.is_empty() {
            assets.lists.insert(name.into(), kept.into());
        }
    }
    Ok(Some(Arc::new(assets)))
}

/// Adds the names of the extensions in a value, which lies at most 128 levels deep.
fn note_extensions<'a>(value: &'a Value, used: &mut BTreeSet<&'a str>) {
    let object: &Map<String, Value> = match value {
        Value::Array(list) => return list.iter().for_each(|v| note_extensions(v, used)),
        Value::Object(object) => object,
        _ => return,
    };
    for (name, value) in object {
        if let ("extensions", Value::Object(extensions)) = (name.as_str(), value) {
            used.extend(extensions.keys().map(String::as_str));
        }
        note_extensions(value, used);
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
