//! The header of a PLY file, tidied line by line before ply-rs-bw parses it: its grammar takes one
//! blank between words and two properties of one name for one, and a name in Latin-1 stops it.

use std::collections::{HashMap, HashSet};
use std::io::{BufRead, Read};

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{DefaultElement, ElementDef, Encoding, PropertyType, ScalarType};

use crate::error::{Place, Result};

use super::input::Input;
use super::text::{name_of, quote, words};

/// What the list of a face's corners is called here, whichever name it has in the file.
pub(super) const CORNERS: &str = "vertex_indices";
/// What the vertex weight is called here, whichever name it has in the file; but a coordinate that
/// is the weight too keeps its name.
pub(super) const WEIGHT: &str = "vertex_weight";
/// What the list of a face's texture coordinates is called, here and in files; nothing else is so here.
pub(super) const TEXTURE_COORDINATES: &str = "texcoord";
/// The coordinates.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];
/// Longer than any header that anyone wrote.
pub(super) const MAX_HEADER_BYTES: usize = 1 << 24;

/// A parsed header.
pub(super) struct Header {
    pub encoding: Encoding,
    /// In the file's order.
    pub elements: Vec<ElementDef>,
    /// What the file calls the properties of each element.
    pub names: Vec<Vec<String>>,
    pub comments: Comments,
    /// How many lines it has.
    pub lines: usize,
    /// How many bytes it has.
    pub bytes: u64,
}

/// What comments say.
#[derive(Default)]
pub(super) struct Comments {
    /// `TextureFile`, as MeshLab writes it.
    pub textures: Vec<String>,
    /// `mtllib`.
    pub material_libraries: Vec<String>,
    /// What the numbers of each of [`NAMED`] stand for.
    pub names: [HashMap<i64, String>; 3],
}

/// The face properties whose numbers stand for names of objects, groups and materials where comments
/// say so: `comment object 0 chair`.
pub(super) const NAMED: [(&str, &str); 3] = [
    ("object", "object"),
    ("group", "group"),
    ("material_index", "material"),
];
/// The comment that names a picture.
pub(super) const TEXTURE_FILE: &str = "TextureFile";
/// The comment that names a material library.
pub(super) const MATERIAL_LIBRARY: &str = "mtllib";

impl Comments {
    /// Takes what stands behind the word `comment`.
    fn push(&mut self, comment: &str) {
        let split = |text: &str| {
            let (word, rest) = text
                .trim_ascii()
                .split_once(|c: char| c.is_ascii_whitespace())?;
            Some((word.to_string(), name_of(rest)))
        };
        let Some((keyword, rest)) = split(comment) else {
            return;
        };
        match keyword.as_str() {
            TEXTURE_FILE => self.textures.push(rest),
            MATERIAL_LIBRARY => self.material_libraries.push(rest),
            _ => {
                let named = NAMED.iter().position(|&(_, word)| word == keyword);
                if let Some(i) = named
                    && let Some((number, name)) = split(&rest)
                    && let Ok(number) = number.parse()
                {
                    self.names[i].insert(number, name);
                }
            }
        }
    }
}

impl Header {
    /// How many vertices it promises.
    pub fn vertices(&self) -> usize {
        self.elements
            .iter()
            .find(|def| def.name == "vertex")
            .map_or(0, |def| def.count)
    }
}

/// What an element is to the mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// A vertex; `single` where its coordinates are 32-bit floats.
    Vertex { single: bool },
    /// A polygon.
    Face,
    /// Triangle strips with −1 between them.
    Strips,
    /// Nothing.
    Other,
}

impl Role {
    /// The role of the elements that `def` defines.
    pub fn of(def: &ElementDef) -> Role {
        let is_float = |axis: &str| {
            def.properties.get(axis).map(|p| &p.data_type)
                == Some(&PropertyType::Scalar(ScalarType::Float))
        };
        match def.name.as_str() {
            "vertex" => Role::Vertex {
                single: AXES.into_iter().all(is_float),
            },
            "face" => Role::Face,
            "tristrips" => Role::Strips,
            _ => Role::Other,
        }
    }
}

/// Reads the header and leaves the input behind it. A vertex weight that is asked for is there.
pub(super) fn read(input: &mut Input, vertex_weight: Option<&str>) -> Result<Header> {
    let tidy = Tidy::read(input, vertex_weight)?;
    let text = tidy.text.as_bytes();
    let parsed = Parser::<DefaultElement>::new().read_header(&mut Reader::new(text));
    let parsed = parsed.map_err(|e| match e.line() {
        Some(line) => {
            let found = tidy.text.lines().nth(line - 1).unwrap_or_default();
            let expected = "a line of a PLY header: format, element, property or comment";
            input.error(Place::Line(line), &quote(found.as_bytes()), expected)
        }
        None => {
            let expected = "a line such as 'format ascii 1.0'";
            input.error(
                Place::File,
                "the header has no format line with a version",
                expected,
            )
        }
    })?;
    let header = Header {
        encoding: parsed.encoding,
        elements: parsed.elements.into_values().collect(),
        names: tidy.names,
        comments: tidy.comments,
        lines: tidy.lines,
        bytes: tidy.bytes,
    };
    check(&header, input)?;
    if let Some(property) = vertex_weight {
        check_weight(&header, property, input)?;
    }
    Ok(header)
}

/// Vertices have coordinates and faces have corners, of types that can hold them.
fn check(header: &Header, input: &Input) -> Result<()> {
    let fail = |found: String, expected: &str| Err(input.error(Place::File, &found, expected));
    for def in header.elements.iter().filter(|def| def.count > 0) {
        let name = &def.name;
        match Role::of(def) {
            Role::Vertex { .. } => {
                for axis in AXES {
                    if !def.properties.contains_key(axis) {
                        return fail(format!("{name} has no {axis}"), "properties x, y and z");
                    }
                }
            }
            Role::Face | Role::Strips => match def.properties.get(CORNERS).map(|p| &p.data_type) {
                Some(PropertyType::List(_, ScalarType::Float | ScalarType::Double)) => {
                    return fail(format!("{name} has a list of floats"), "a list of integers");
                }
                Some(_) => {}
                None => {
                    return fail(
                        format!("{name} has no list {CORNERS}"),
                        "the corners as a list",
                    );
                }
            },
            Role::Other => {}
        }
        for (property, p) in &def.properties {
            if let PropertyType::List(ScalarType::Float | ScalarType::Double, _) = p.data_type {
                let found = format!("{name} {property} counts its list in floats");
                return fail(found, "an integer type");
            }
        }
    }
    Ok(())
}

/// The vertices have a number for their weight.
fn check_weight(header: &Header, property: &str, input: &Input) -> Result<()> {
    let fail = |found: String, expected: &str| Err(input.error(Place::File, &found, expected));
    let is_axis = AXES.contains(&property);
    let name = if is_axis { property } else { WEIGHT };
    let vertices = header.elements.iter().position(|def| def.name == "vertex");
    let found = vertices.and_then(|i| header.elements[i].properties.get(name));
    match found.map(|p| &p.data_type) {
        Some(PropertyType::Scalar(_)) => Ok(()),
        Some(PropertyType::List(..)) => {
            let found = format!("vertex property '{property}' is a list");
            fail(found, "a number, where it is to be the weight")
        }
        None => {
            let found = format!("vertex has no property '{property}'");
            let there = vertices.map_or(&[][..], |i| &header.names[i]);
            let expected = match there {
                [] => "vertices with properties".to_string(),
                there => format!("one of {}", there.join(", ")),
            };
            fail(found, &expected)
        }
    }
}

/// A header as ply-rs-bw reads it, line for line.
#[derive(Default)]
struct Tidy<'a> {
    /// The vertex property to call [`WEIGHT`].
    vertex_weight: Option<&'a str>,
    /// What the file calls the properties of each element.
    names: Vec<Vec<String>>,
    comments: Comments,
    in_vertex: bool,
    text: String,
    lines: usize,
    bytes: u64,
    elements: HashSet<String>,
    properties: HashSet<String>,
}

impl<'a> Tidy<'a> {
    fn read(input: &mut Input, vertex_weight: Option<&'a str>) -> Result<Self> {
        let mut tidy = Tidy {
            vertex_weight,
            ..Tidy::default()
        };
        let mut line = Vec::new();
        let mut lone_cr = false;
        loop {
            line.clear();
            let end = tidy.read_line(input, &mut line)?;
            let Some(end) = end else {
                let found = "the header does not end";
                return Err(input.error(Place::Line(tidy.lines), found, "end_header"));
            };
            tidy.lines += 1;
            // Behind `\r` a `\n` belongs to the line end, unless the lines end with `\r` alone: then
            // it is the first byte of the body.
            if end == b'\r' && !lone_cr && peek(input)? == Some(b'\n') {
                input.reader.consume(1);
                tidy.bytes += 1;
            } else if end == b'\r' {
                lone_cr = true;
            }
            tidy.push(&line);
            if tidy.text.ends_with("\nend_header\n") {
                return Ok(tidy);
            }
            if tidy.lines == 1 && tidy.text != "ply\n" {
                return Err(input.error(Place::Line(1), &quote(&line), "ply"));
            }
        }
    }

    /// Reads a line and returns the byte that ended it, or `None` where none does.
    fn read_line(&mut self, input: &mut Input, line: &mut Vec<u8>) -> Result<Option<u8>> {
        while self.bytes < MAX_HEADER_BYTES as u64 {
            let mut byte = [0];
            match input.reader.read(&mut byte) {
                Ok(0) => break,
                Ok(_) => self.bytes += 1,
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => continue,
                Err(e) => return Err(input.io_error(e)),
            }
            match byte {
                [end @ (b'\n' | b'\r')] => return Ok(Some(end)),
                [b] => line.push(b),
            }
        }
        let found = words(line).next() == Some(b"end_header");
        Ok((found && self.bytes < MAX_HEADER_BYTES as u64).then_some(b'\n'))
    }

    /// Appends a line with single blanks, without the text of comments, and with names that differ.
    fn push(&mut self, line: &[u8]) {
        let line = String::from_utf8_lossy(line);
        if let Some(comment) = line.trim_ascii().strip_prefix("comment") {
            self.comments.push(comment);
        }
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words.as_slice() {
            [] | ["comment" | "obj_info", ..] => self.text.push_str("comment"),
            ["element", name, count] => {
                let name = self.unique(name, true);
                self.in_vertex = name == "vertex";
                self.properties.clear();
                self.names.push(Vec::new());
                self.text.push_str(&format!("element {name} {count}"));
            }
            ["property", types @ .., name] => {
                let list = types.first() == Some(&"list");
                let is_weight = self.in_vertex && self.vertex_weight == Some(name);
                if let Some(names) = self.names.last_mut() {
                    names.push(name.to_string());
                }
                let name = match *name {
                    "x" | "y" | "z" if list => "list",
                    name if is_weight && !AXES.contains(&name) => WEIGHT,
                    "vertex_index" if list => CORNERS,
                    CORNERS if !list => "scalar",
                    WEIGHT => "other",
                    TEXTURE_COORDINATES if !list => "scalar",
                    name => name,
                };
                let name = self.unique(name, false);
                self.text
                    .push_str(&format!("property {} {name}", types.join(" ")));
            }
            words => self.text.push_str(&words.join(" ")),
        }
        self.text.push('\n');
    }

    /// The name, or one of the line's own where the name is taken or no identifier.
    fn unique(&mut self, name: &str, element: bool) -> String {
        let names = if element {
            &mut self.elements
        } else {
            &mut self.properties
        };
        let begins = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
        let goes_on = name
            .chars()
            .all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
        let unique = if begins && goes_on && !names.contains(name) {
            name.to_string()
        } else {
            format!("of_line_{}", self.lines)
        };
        names.insert(unique.clone());
        unique
    }
}

fn peek(input: &mut Input) -> Result<Option<u8>> {
    let first = input.reader.fill_buf().map(|chunk| chunk.first().copied());
    first.map_err(|e| input.io_error(e))
}
