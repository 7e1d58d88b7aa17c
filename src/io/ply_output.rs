//! Writing PLY files of meshes that carry more than positions.

use std::collections::HashSet;
use std::io::{self, Write};

use crate::attributes::{Attributes, Channel, Group, Kind, NumberType};
use crate::indexed_mesh::IndexedMesh;

use super::output::{BLOCK_BYTES, Scalar, point};
use super::ply_header::{
    AXES, MATERIAL_LIBRARY, MAX_HEADER_BYTES, NAMED, TEXTURE_COORDINATES, TEXTURE_FILE,
};
use super::text::{without_control, write_number};
use super::wedges::{Vertices, has_seam};

/// Writes a PLY file: with these digits as text, or binary.
///
/// Channels are properties of vertices, but texture coordinates with seams, which are MeshLab's list of
/// faces: their vertices stay shared. Where another channel differs within a vertex, the file has copies
/// of the vertex. Names of groups are comments, and faces have their numbers. The back of a double-sided
/// triangle has what the front has, its normals too.
pub(super) fn ply(
    writer: &mut dyn Write,
    mesh: &IndexedMesh,
    text: Option<Digits>,
) -> io::Result<()> {
    let attributes = mesh.attributes();
    let list = listed(mesh);
    let channels = attributes.channels.iter().enumerate();
    let channels = channels.filter(|&(i, _)| Some(i) != list);
    let channels: Vec<&Channel> = channels.map(|(_, channel)| channel).collect();
    let file = File {
        mesh,
        vertices: Vertices::of(mesh, &channels),
        channels,
        list: list.map(|i| &attributes.channels[i]),
        columns: Columns::of(attributes),
    };
    file.write_header(writer, text.is_some())?;
    let mut out = Out {
        writer,
        block: Vec::with_capacity(BLOCK_BYTES),
        text,
        begins: true,
    };
    file.write_vertices(&mut out)?;
    file.write_faces(&mut out)?;
    out.flush()
}

/// How many significant digits text has, where not as many as it takes.
pub(super) type Digits = Option<usize>;

/// The channel that is a list of faces: texture coordinates that were one, or else the first that cannot
/// be of vertices.
pub(super) fn listed(mesh: &IndexedMesh) -> Option<usize> {
    let channels = &mesh.attributes().channels;
    let find = |is_it: &dyn Fn(&Channel) -> bool| {
        let is_it = |c: &Channel| c.kind == Kind::TextureCoordinate && is_it(c);
        channels.iter().position(is_it)
    };
    let was_list = |c: &Channel| c.components.iter().all(|p| p.name == TEXTURE_COORDINATES);
    find(&was_list).or_else(|| find(&|channel| has_seam(mesh, channel)))
}

/// A mesh as a PLY file has it.
struct File<'a> {
    mesh: &'a IndexedMesh,
    vertices: Vertices<'a>,
    channels: Vec<&'a Channel>,
    list: Option<&'a Channel>,
    columns: Columns<'a>,
}

/// Names in the order of their numbers, and the number that each group has, if it has any.
type Numbered<'a> = (Vec<&'a str>, Vec<Option<u32>>);

/// The properties of faces.
pub(super) struct Columns<'a> {
    /// What each of [`NAMED`] numbers.
    names: [Option<Numbered<'a>>; 3],
    /// Which of [`Attributes::face_properties`] are there.
    values: Vec<usize>,
    /// Whether comments are: a header can be too long to be one.
    pub has_comments: bool,
    attributes: &'a Attributes,
}

impl<'a> Columns<'a> {
    /// Those that the groups of a mesh make.
    pub fn of(attributes: &'a Attributes) -> Self {
        let names: [fn(&Group) -> &str; 3] = [|g| &g.object, |g| &g.name, |g| &g.material];
        let names = names.map(|name| {
            let mut numbers = std::collections::HashMap::new();
            let mut list = Vec::new();
            let number = |group: &'a Group| {
                let name = name(group);
                let number = || {
                    list.push(name);
                    list.len() as u32 - 1
                };
                (!name.is_empty()).then(|| *numbers.entry(name).or_insert_with(number))
            };
            let of_groups: Vec<Option<u32>> = attributes.groups.iter().map(number).collect();
            (!list.is_empty()).then_some((list, of_groups))
        });
        let is_there = |name: &str| {
            let mut there = NAMED.iter().zip(&names);
            there.any(|(&(property, _), names)| property == name && names.is_some())
        };
        let properties = attributes.face_properties.iter().enumerate();
        let values = properties.filter(|(_, property)| !is_there(&property.name));
        let values = values.map(|(i, _)| i).collect();
        let mut columns = Columns {
            names,
            values,
            has_comments: true,
            attributes,
        };
        if columns.comment_bytes() > MAX_HEADER_BYTES / 2 {
            columns.names = [None, None, None];
            columns.has_comments = false;
        }
        columns
    }

    /// About how many bytes all comments take.
    fn comment_bytes(&self) -> usize {
        let lists = self.names.iter().flatten();
        let names = lists.flat_map(|(list, _)| list.iter().map(|name| name.len()));
        let libraries = self.attributes.material_libraries.iter();
        let others = libraries.chain(&self.attributes.textures).map(String::len);
        let beside = "comment material 1234567890 \n".len();
        names.chain(others).map(|bytes| bytes + beside).sum()
    }

    /// Whether a face property is there.
    pub fn has_value(&self, i: usize) -> bool {
        self.values.contains(&i)
    }
}

impl File<'_> {
    fn coordinate(&self) -> NumberType {
        match Scalar::of(self.mesh) {
            Scalar::Float => NumberType::F32,
            Scalar::Double => NumberType::F64,
        }
    }

    fn write_header(&self, writer: &mut dyn Write, text: bool) -> io::Result<()> {
        let attributes = self.mesh.attributes();
        let mut header = String::from("ply\nformat ");
        header += if text {
            "ascii 1.0\n"
        } else {
            "binary_little_endian 1.0\n"
        };
        let mut comment = |words: &str, name: &str| {
            if self.columns.has_comments {
                let name: String = without_control(name).collect();
                header += &format!("comment {words} {name}\n");
            }
        };
        attributes
            .textures
            .iter()
            .for_each(|name| comment(TEXTURE_FILE, name));
        let libraries = &attributes.material_libraries;
        libraries
            .iter()
            .for_each(|name| comment(MATERIAL_LIBRARY, name));
        for ((_, word), names) in NAMED.iter().zip(&self.columns.names) {
            for (i, name) in names.iter().flat_map(|(names, _)| names).enumerate() {
                comment(&format!("{word} {i}"), name);
            }
        }
        let vertices = self.vertices.count(self.mesh.positions().len());
        header += &format!("element vertex {vertices}\n");
        let mut used = HashSet::new();
        for axis in AXES {
            header += &property(&mut used, axis, self.coordinate());
        }
        for component in self.channels.iter().flat_map(|channel| &channel.components) {
            header += &property(&mut used, &component.name, component.number);
        }
        header += &format!("element face {}\n", self.mesh.triangle_count());
        header += "property list uchar int vertex_indices\n";
        used.clear();
        if let Some(list) = self.list {
            let number = type_name(number_of(list));
            header += &format!("property list uchar {number} {TEXTURE_COORDINATES}\n");
        }
        if !attributes.group_of.is_empty() {
            for &i in &self.columns.values {
                let value = &attributes.face_properties[i];
                header += &property(&mut used, &value.name, value.number);
            }
            for ((name, _), _) in NAMED
                .iter()
                .zip(&self.columns.names)
                .filter(|(_, names)| names.is_some())
            {
                header += &property(&mut used, name, NumberType::I32);
            }
        }
        header += "end_header\n";
        writer.write_all(header.as_bytes())
    }

    fn write_vertices(&self, out: &mut Out) -> io::Result<()> {
        let coordinate = self.coordinate();
        for (v, wedge) in self.vertices.iter(self.mesh.positions().len()) {
            for x in point(self.mesh, v) {
                out.number(x, coordinate)?;
            }
            for channel in &self.channels {
                match wedge {
                    Some(wedge) => out.row(channel, wedge)?,
                    None => out.zeros(channel)?,
                }
            }
            out.end()?;
        }
        Ok(())
    }

    fn write_faces(&self, out: &mut Out) -> io::Result<()> {
        let attributes = self.mesh.attributes();
        for (i, &corners) in self.vertices.triangles.iter().enumerate() {
            let front = [0, 1, 2];
            let back = self.mesh.is_double_sided(i).then_some([0, 2, 1]);
            for order in std::iter::once(front).chain(back) {
                out.number(3.0, NumberType::U8)?;
                for k in order {
                    out.number(corners[k].into(), NumberType::U32)?;
                }
                if let Some(list) = self.list {
                    out.number((3 * list.width()) as f64, NumberType::U8)?;
                    let number = number_of(list);
                    for k in order {
                        let row = list.row(attributes.corners[i][k] as usize);
                        row.into_iter().try_for_each(|x| out.number(x, number))?;
                    }
                }
                if let Some(&group) = attributes.group_of.get(i) {
                    self.write_group(group as usize, out)?;
                }
                out.end()?;
            }
        }
        Ok(())
    }

    fn write_group(&self, group: usize, out: &mut Out) -> io::Result<()> {
        let attributes = self.mesh.attributes();
        for &i in &self.columns.values {
            let value = attributes.groups[group].values[i];
            out.number(value, attributes.face_properties[i].number)?;
        }
        for (_, numbers) in self.columns.names.iter().flatten() {
            let number = numbers[group].map_or(NO_NAME, f64::from);
            out.number(number, NumberType::I32)?;
        }
        Ok(())
    }
}

/// The line of a property, whose name becomes one word that none of the element's before it is.
fn property(used: &mut HashSet<String>, name: &str, number: NumberType) -> String {
    let is_separator = |c: char| c.is_whitespace() || c.is_control();
    let mut name = name.replace(is_separator, "_");
    while name.is_empty() || !used.insert(name.clone()) {
        name.push('_');
    }
    format!("property {} {name}\n", type_name(number))
}

/// The number of no name.
const NO_NAME: f64 = -1.0;

/// The type that holds all components of a list.
fn number_of(list: &Channel) -> NumberType {
    let number = list.components[0].number;
    let is_same = list
        .components
        .iter()
        .all(|component| component.number == number);
    if is_same { number } else { NumberType::F64 }
}

fn type_name(number: NumberType) -> &'static str {
    match number {
        NumberType::I8 => "char",
        NumberType::U8 => "uchar",
        NumberType::I16 => "short",
        NumberType::U16 => "ushort",
        NumberType::I32 => "int",
        NumberType::U32 => "uint",
        NumberType::F32 => "float",
        NumberType::F64 => "double",
    }
}

/// Where numbers go, in blocks.
struct Out<'a> {
    writer: &'a mut dyn Write,
    block: Vec<u8>,
    text: Option<Digits>,
    /// Whether the next number is the first of its line.
    begins: bool,
}

impl Out<'_> {
    fn row(&mut self, channel: &Channel, wedge: u32) -> io::Result<()> {
        let row = channel.row(wedge as usize).zip(&channel.components);
        row.into_iter()
            .try_for_each(|(x, component)| self.number(x, component.number))
    }

    fn zeros(&mut self, channel: &Channel) -> io::Result<()> {
        let components = &channel.components;
        components
            .iter()
            .try_for_each(|component| self.number(0.0, component.number))
    }

    fn number(&mut self, x: f64, number: NumberType) -> io::Result<()> {
        let block = &mut self.block;
        if let Some(digits) = self.text {
            if !std::mem::take(&mut self.begins) {
                block.push(b' ');
            }
            return match number {
                NumberType::F32 => write_number(block, x, true, digits),
                NumberType::F64 => write_number(block, x, false, digits),
                _ => write!(block, "{}", x as i64),
            };
        }
        match number {
            NumberType::I8 => block.extend((x as i8).to_le_bytes()),
            NumberType::U8 => block.extend((x as u8).to_le_bytes()),
            NumberType::I16 => block.extend((x as i16).to_le_bytes()),
            NumberType::U16 => block.extend((x as u16).to_le_bytes()),
            NumberType::I32 => block.extend((x as i32).to_le_bytes()),
            NumberType::U32 => block.extend((x as u32).to_le_bytes()),
            NumberType::F32 => block.extend((x as f32).to_le_bytes()),
            NumberType::F64 => block.extend(x.to_le_bytes()),
        }
        Ok(())
    }

    /// Ends an element.
    fn end(&mut self) -> io::Result<()> {
        if self.text.is_some() {
            self.block.push(b'\n');
            self.begins = true;
        }
        if self.block.len() >= BLOCK_BYTES {
            self.flush()?;
        }
        Ok(())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.write_all(&self.block)?;
        self.block.clear();
        Ok(())
    }
}
