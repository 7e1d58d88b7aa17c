//! What a PLY file carries beside positions: which of its properties it is in, and what of it is not
//! there yet when a vertex or a face is read.

use std::collections::HashMap;

use ply_rs_bw::ply::{ElementDef, PropertyType, ScalarType};

use crate::attributes::{
    Attributes, Channel, Group, Kind, MAX_COMPONENTS, NumberType, Property, Values,
};
use crate::indexed_mesh::MeshBuilder;

use super::groups::{GroupTable, NAMES_TOO_LONG};
use super::ply_header::{AXES, CORNERS, Header, NAMED, Role, TEXTURE_COORDINATES, WEIGHT};
use super::text::{count, one_line};
use super::wedges::Wedges;

/// Face properties make groups where there are no more of them than this, or so many faces a group. No
/// collapse merges groups, so a file whose every face has a number or a colour of its own could not be
/// decimated at all, and one with few faces a group not by much: patches of 16 triangles can lose about
/// seven of eight.
const FACES_A_GROUP: usize = 16;

/// The properties of a vertex that make one channel, by their usual names; all but the last ones must be
/// there.
const VERTEX_CHANNELS: [(Kind, usize, &[&str]); 8] = [
    (Kind::Normal, 3, &["nx", "ny", "nz"]),
    (Kind::TextureCoordinate, 2, &["s", "t"]),
    (Kind::TextureCoordinate, 2, &["u", "v"]),
    (
        Kind::TextureCoordinate,
        1,
        &["texture_u", "texture_v", "texture_w"],
    ),
    (Kind::TextureCoordinate, 2, &["texture_s", "texture_t"]),
    (Kind::Color, 3, &["red", "green", "blue", "alpha"]),
    (Kind::Color, 3, &["r", "g", "b", "a"]),
    (
        Kind::Color,
        3,
        &[
            "diffuse_red",
            "diffuse_green",
            "diffuse_blue",
            "diffuse_alpha",
        ],
    ),
];

/// The integer properties of a face that say what it belongs to, without `_id`, `_index` or such behind.
const PARTS: [&str; 17] = [
    "texnumber",
    "material",
    "group",
    "label",
    "segment",
    "segmentation",
    "object",
    "part",
    "region",
    "category",
    "class",
    "component",
    "cluster",
    "patch",
    "instance",
    "body",
    "surface",
];

/// Where a file has what it carries.
#[derive(Default)]
pub(super) struct Carried {
    /// The properties of a vertex, by their numbers, that each channel of [`Attributes`] has.
    pub channels: Vec<Vec<usize>>,
    /// Whether faces have a list of texture coordinates.
    pub has_texture_coordinates: bool,
    /// The properties of a face that tell groups apart.
    pub groups: Vec<usize>,
}

impl Carried {
    /// What a file with this header carries, but not what is the weight of a vertex. Its channels, its
    /// face properties and what will be left behind are put into `attributes`.
    pub fn of(header: &mut Header, attributes: &mut Attributes) -> Self {
        let mut carried = Carried::default();
        attributes.textures = std::mem::take(&mut header.comments.textures);
        attributes.material_libraries = std::mem::take(&mut header.comments.material_libraries);
        let is_there = |def: &&ElementDef| def.count > 0;
        let mut there = header.elements.iter().filter(is_there);
        let has_strips = there.any(|def| Role::of(def) == Role::Strips);
        for (def, names) in header.elements.iter().zip(&header.names) {
            if def.count == 0 {
                continue;
            }
            match Role::of(def) {
                Role::Vertex { .. } => carried.take_vertex(def, names, attributes),
                // Strips have no faces that could have the properties of faces beside them.
                Role::Face if !has_strips => carried.take_face(def, names, attributes),
                Role::Face | Role::Strips => {
                    let others = def.properties.keys().zip(names);
                    let others = others.filter(|(key, _)| *key != CORNERS);
                    let element = if def.name == "face" { "face" } else { "strip" };
                    attributes
                        .notices
                        .extend(others.map(|(_, name)| not_carried(element, name)));
                }
                Role::Other => {
                    let notice = format!("element '{}' is not carried", def.name);
                    attributes.notices.push(one_line(&notice));
                }
            }
        }
        carried
    }

    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.channels.is_empty() && !self.has_texture_coordinates && self.groups.is_empty()
    }

    fn take_vertex(&mut self, def: &ElementDef, names: &[String], attributes: &mut Attributes) {
        let numbers = numbers_by_name(def, names);
        let mut is_taken = vec![false; names.len()];
        for (i, (key, property)) in def.properties.iter().enumerate() {
            if is_taken[i] || AXES.contains(&key.as_str()) || key == WEIGHT {
                continue;
            }
            if numbers.get(names[i].as_str()) != Some(&i) {
                let is_list = matches!(property.data_type, PropertyType::List(..));
                let notice = if is_list {
                    format!("vertex property '{}' is a list and not carried", names[i])
                } else {
                    format!(
                        "vertex property '{}' stands twice, one is carried",
                        names[i]
                    )
                };
                attributes.notices.push(one_line(&notice));
                continue;
            }
            let found = VERTEX_CHANNELS.iter().find_map(|&(kind, least, usual)| {
                if !usual.contains(&names[i].as_str()) {
                    return None;
                }
                let found = usual.iter().map_while(|&name| numbers.get(name).copied());
                let found: Vec<usize> = found.collect();
                (found.len() >= least).then_some((kind, found))
            });
            let (kind, found) = found.unwrap_or((Kind::Scalar, vec![i]));
            found.iter().for_each(|&i| is_taken[i] = true);
            let components = found.iter().map(|&i| property_of(def, names, i));
            let channel = Channel::new(kind, components.collect());
            attributes.channels.push(channel);
            self.channels.push(found);
        }
    }

    fn take_face(&mut self, def: &ElementDef, names: &[String], attributes: &mut Attributes) {
        let numbers = numbers_by_name(def, names);
        let has_color = ["red", "green", "blue"]
            .iter()
            .all(|name| numbers.contains_key(name));
        for (i, (key, property)) in def.properties.iter().enumerate() {
            let name = names[i].as_str();
            let is_part = match &property.data_type {
                PropertyType::List(..) if key == CORNERS => continue,
                PropertyType::List(..) if key == TEXTURE_COORDINATES => {
                    self.has_texture_coordinates = true;
                    continue;
                }
                PropertyType::List(..) => false,
                PropertyType::Scalar(_) if numbers.get(name) != Some(&i) => false,
                PropertyType::Scalar(scalar) => {
                    let is_integer = number_type(scalar).range().is_some();
                    let is_color = has_color && ["red", "green", "blue", "alpha"].contains(&name);
                    is_color || is_integer && is_part(name)
                }
            };
            if is_part {
                self.groups.push(i);
                attributes.face_properties.push(property_of(def, names, i));
            } else {
                attributes.notices.push(not_carried("face", name));
            }
        }
    }
}

fn not_carried(element: &str, name: &str) -> String {
    one_line(&format!("{element} property '{name}' is not carried"))
}

/// Whether an integer property of that name says what a face belongs to.
fn is_part(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    let endings = ["_indices", "_index", "_number", "_ids", "_id", "id", "s"];
    let is_part = |name: &str| PARTS.contains(&name);
    is_part(&name)
        || endings
            .iter()
            .any(|e| name.strip_suffix(e).is_some_and(is_part))
}

/// The properties that are numbers, the first of each name.
fn numbers_by_name<'a>(def: &ElementDef, names: &'a [String]) -> HashMap<&'a str, usize> {
    let mut numbers = HashMap::new();
    for (i, (property, name)) in def.properties.values().zip(names).enumerate() {
        if matches!(property.data_type, PropertyType::Scalar(_)) {
            numbers.entry(name.as_str()).or_insert(i);
        }
    }
    numbers
}

fn property_of(def: &ElementDef, names: &[String], i: usize) -> Property {
    let scalar = match &def.properties[i].data_type {
        PropertyType::Scalar(scalar) | PropertyType::List(_, scalar) => scalar,
    };
    Property {
        name: names[i].clone(),
        number: number_type(scalar),
    }
}

fn number_type(scalar: &ScalarType) -> NumberType {
    match scalar {
        ScalarType::Char => NumberType::I8,
        ScalarType::UChar => NumberType::U8,
        ScalarType::Short => NumberType::I16,
        ScalarType::UShort => NumberType::U16,
        ScalarType::Int => NumberType::I32,
        ScalarType::UInt => NumberType::U32,
        ScalarType::Float => NumberType::F32,
        ScalarType::Double => NumberType::F64,
    }
}

/// What faces carry, while they are read.
pub(super) struct FaceAttributes {
    groups: Option<FaceGroups>,
    texture_coordinates: Option<TextureCoordinates>,
    /// How many faces the file promises.
    faces: usize,
}

/// Groups by their values.
struct FaceGroups {
    /// What each value is of.
    parts: Vec<Part>,
    names: [HashMap<i64, String>; 3],
    table: GroupTable<Box<[u64]>>,
    /// The values of the last face.
    last: Vec<f64>,
}

/// What the value of a face property is.
#[derive(Clone, Copy)]
enum Part {
    /// One of [`Group::values`].
    Value,
    /// The number of a name, of [`NAMED`].
    Name(usize),
}

/// Texture coordinates at the corners of faces.
struct TextureCoordinates {
    number: NumberType,
    /// How many numbers a corner has, once a face has any.
    width: Option<usize>,
    /// Behind a row of zeros for corners that have none.
    rows: Vec<[f64; MAX_COMPONENTS]>,
    numbers: HashMap<[u64; MAX_COMPONENTS], u32>,
    corners_without: usize,
    wedges: Wedges,
    wedges_of_face: Vec<u32>,
}

impl FaceAttributes {
    /// What the faces of a file with this header carry.
    pub fn of(header: &mut Header, carried: &Carried, attributes: &mut Attributes) -> Self {
        let names = std::mem::take(&mut header.comments.names);
        let def = header
            .elements
            .iter()
            .find(|def| Role::of(def) == Role::Face);
        let parts = attributes.face_properties.iter().map(|property| {
            let named = NAMED.iter().position(|&(name, _)| name == property.name);
            match named.filter(|&i| !names[i].is_empty()) {
                Some(i) => Part::Name(i),
                None => Part::Value,
            }
        });
        let parts: Vec<Part> = parts.collect();
        let mut is_value = parts.iter().map(|part| matches!(part, Part::Value));
        attributes
            .face_properties
            .retain(|_| is_value.next() == Some(true));
        let list = def.and_then(|def| def.properties.get(TEXTURE_COORDINATES));
        let list = list.filter(|_| carried.has_texture_coordinates);
        FaceAttributes {
            faces: def.map_or(0, |def| def.count),
            groups: (!carried.groups.is_empty()).then(|| FaceGroups {
                parts,
                names,
                table: GroupTable::new(),
                last: Vec::new(),
            }),
            texture_coordinates: list.map(|list| TextureCoordinates {
                number: match &list.data_type {
                    PropertyType::List(_, scalar) | PropertyType::Scalar(scalar) => {
                        number_type(scalar)
                    }
                },
                width: None,
                rows: vec![[0.0; MAX_COMPONENTS]],
                numbers: HashMap::new(),
                corners_without: 0,
                wedges: Wedges::default(),
                wedges_of_face: Vec::new(),
            }),
        }
    }

    /// Adds a face with the values that tell its group and the list of its texture coordinates.
    pub fn push_face(
        &mut self,
        corners: &[u32],
        values: &[f64],
        list: &[f64],
        builder: &mut MeshBuilder,
    ) {
        if corners.len() < 3 {
            return;
        }
        if let Some(groups) = &mut self.groups {
            groups.begin(values, self.faces, builder);
        }
        match &mut self.texture_coordinates {
            Some(coordinates) => coordinates.push_face(corners, list, builder),
            None => builder.push_polygon(corners),
        }
    }

    /// Gives the mesh what its faces have.
    pub fn finish(self, builder: &mut MeshBuilder) {
        let vertices = builder.vertex_count();
        let attributes = builder.attributes();
        if let Some(groups) = self.groups {
            groups.finish(attributes);
        }
        if let Some(coordinates) = self.texture_coordinates {
            coordinates.finish(vertices, attributes);
        }
    }
}

/// Whether so many groups of faces are kept.
fn are_few(groups: usize, faces: usize) -> bool {
    groups <= FACES_A_GROUP.max(faces / FACES_A_GROUP)
}

impl FaceGroups {
    fn begin(&mut self, values: &[f64], faces: usize, builder: &mut MeshBuilder) {
        let is_same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
        if self.last.len() == values.len() && self.last.iter().zip(values).all(is_same) {
            return;
        }
        self.last.clear();
        self.last.extend(values);
        let groups = &mut builder.attributes().groups;
        let key = values.iter().map(|x| x.to_bits()).collect();
        let group = || {
            let mut group = Group::default();
            for (part, &value) in self.parts.iter().zip(values) {
                let Part::Name(i) = *part else {
                    group.values.push(value);
                    continue;
                };
                // An integer type's.
                let name = self.names[i].get(&(value as i64)).cloned();
                *[&mut group.object, &mut group.name, &mut group.material][i] =
                    name.unwrap_or_default();
            }
            group
        };
        let group = self.table.find(key, groups, group);
        if !self.has_names() && !are_few(groups.len(), faces) {
            self.table.give_up(groups);
        } else if let Some(group) = group {
            builder.begin_group(group);
        }
    }

    /// Whether somebody named the groups, which then are as many as they are.
    fn has_names(&self) -> bool {
        self.parts.iter().any(|part| matches!(part, Part::Name(_)))
    }

    fn finish(self, attributes: &mut Attributes) {
        if !self.table.is_given_up() {
            return;
        }
        let properties = std::mem::take(&mut attributes.face_properties);
        if self.has_names() {
            attributes.notices.push(NAMES_TOO_LONG.to_string());
            return;
        }
        let names: Vec<_> = properties.iter().map(|p| format!("'{}'", p.name)).collect();
        let notice = format!(
            "face property {} is not carried: there are fewer than {FACES_A_GROUP} faces of one value",
            names.join(", ")
        );
        attributes.notices.push(one_line(&notice));
    }
}

impl TextureCoordinates {
    fn push_face(&mut self, corners: &[u32], list: &[f64], builder: &mut MeshBuilder) {
        let is_whole = list.len().is_multiple_of(corners.len());
        let width = Some(list.len() / corners.len())
            .filter(|&width| is_whole && (1..MAX_COMPONENTS).contains(&width))
            .filter(|&width| *self.width.get_or_insert(width) == width);
        let vertices = builder.vertex_count();
        self.wedges_of_face.clear();
        for (k, &v) in corners.iter().enumerate() {
            let row = width.map_or(0, |width| self.row(&list[k * width..(k + 1) * width]));
            let wedge = self.wedges.of(v, [row, 0], vertices);
            self.wedges_of_face.push(wedge);
        }
        if width.is_none() {
            self.corners_without += corners.len();
        }
        builder.push_polygon_with(corners, &self.wedges_of_face);
    }

    /// The row of these numbers, counted from 1.
    fn row(&mut self, numbers: &[f64]) -> u32 {
        let mut row = [0.0; MAX_COMPONENTS];
        row[..numbers.len()].copy_from_slice(numbers);
        *self
            .numbers
            .entry(row.map(f64::to_bits))
            .or_insert_with(|| {
                self.rows.push(row);
                self.rows.len() as u32 - 1
            })
    }

    fn finish(self, vertices: usize, attributes: &mut Attributes) {
        let wedges = self.wedges.number(vertices, &mut attributes.corners);
        let vertex_of: Vec<u32> = wedges.iter().map(|&(v, _)| v).collect();
        for channel in &mut attributes.channels {
            channel.values = channel.values.rows(channel.width(), &vertex_of);
        }
        let Some(width) = self.width else {
            return;
        };
        if self.corners_without > 0 {
            let corners = count(self.corners_without, "corner", "corners");
            let notice = format!("{corners} without texture coordinate got zeros");
            attributes.notices.push(notice);
        }
        let component = Property {
            name: TEXTURE_COORDINATES.to_string(),
            number: self.number,
        };
        let mut channel = Channel::new(Kind::TextureCoordinate, vec![component; width]);
        channel.is_by_corner = true;
        let numbers = wedges
            .iter()
            .flat_map(|&(_, [row, _])| &self.rows[row as usize][..width]);
        match &mut channel.values {
            Values::Singles(list) => list.extend(numbers.map(|&x| x as f32)),
            Values::Doubles(list) => list.extend(numbers),
        }
        attributes.channels.push(channel);
    }
}
