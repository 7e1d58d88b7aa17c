//! The primitives of a glTF file, with their accessors checked.

use std::collections::BTreeMap;
use std::fmt;

use gltf::json;
use gltf::json::accessor::ComponentType;
use gltf::json::mesh::{Mode, Semantic};
use gltf::json::validation::Checked;

use super::gltf_accessor::{Elements, Source, compressed_with};
use super::gltf_document::{Answer, Document, Wrong, out_of_range};
use super::gltf_materials::Materials;

/// An extension that keeps a primitive's geometry compressed.
const COMPRESSED_PRIMITIVE: &str = "KHR_draco_mesh_compression";
/// The most sets of texture coordinates, and of colours; clients read two, and one.
const MOST_SETS: u32 = 8;

/// What a vertex attribute is, in the order in which channels stand.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Slot {
    Normal,
    TextureCoordinate(u32),
    Color(u32),
    Scalar(String),
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
pub(super) struct Part<'a> {
    path: Origin,
    mode: Mode,
    pub indices: Option<Elements<'a>>,
    pub positions: Elements<'a>,
    /// Which of the mesh's parts was the first with these very attributes: its vertices are theirs.
    pub block: usize,
    pub attributes: BTreeMap<Slot, Elements<'a>>,
    /// What the primitive has that is not carried.
    pub left: Vec<String>,
    pub group: Option<u32>,
}

/// The primitives of a mesh.
pub(super) fn parts_of<'a>(
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
    let has_triangles = matches!(
        mode,
        Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan
    );
    let indices = match primitive.indices.filter(|_| has_triangles) {
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
    if with_attributes && has_triangles {
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
    let is_outside = |&index: &u32| index as usize >= vertices;
    let greatest = source.greatest_index(accessor, &indices);
    if greatest.filter(is_outside).is_none() {
        return Ok(indices);
    }
    let mut all = (0..indices.count).map(|i| indices.index(i)).enumerate();
    let (i, index) = all
        .find(|(_, index)| is_outside(index))
        .expect("the greatest is");
    let found = format!("{path}: indices[{i}] is {index}");
    Err(out_of_range(found, vertices))
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
        let mut elements = source.elements(accessor.value(), &user)?;
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
        if let Slot::Color(_) = slot {
            // Integers are parts of 1 here, whether or not the accessor says so.
            elements.is_normalized = elements.number != ComponentType::F32;
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

    pub fn triangle_count(&self) -> usize {
        match self.mode {
            Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => 0,
            Mode::Triangles => self.corners() / 3,
            Mode::TriangleStrip | Mode::TriangleFan => self.corners().saturating_sub(2),
        }
    }

    /// The triangles, by the rows of the primitive's attributes.
    pub fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
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
