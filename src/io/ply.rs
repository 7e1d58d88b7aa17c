//! PLY, element by element: a face is on its way to the mesh before the next one is read. Plain
//! layouts of binary files are decoded in `ply_binary`; ply-rs-bw serves the others, and ASCII.

use std::io::{self, ErrorKind};

use ply_rs_bw::parser::{ParseError, Parser};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyDef, PropertyType,
};

use crate::error::{Error, Place, Result};
use crate::indexed_mesh::MeshBuilder;

use super::blocks::Blocks;
use super::input::Input;
use super::ply_attributes::{Carried, FaceAttributes};
use super::ply_binary::{Decoder, Plain};
use super::ply_header::{self, AXES, CORNERS, Header, Role, TEXTURE_COORDINATES, WEIGHT};
use super::text::{Lines, parse_number, quote, words};

/// What a PLY file is asked for beside positions and faces.
#[derive(Clone, Copy)]
pub(super) struct Wanted<'a> {
    /// The vertex property that becomes the weight, and is no attribute then.
    pub vertex_weight: Option<&'a str>,
    pub attributes: bool,
}

/// Reads a PLY file into a mesh: vertices, faces, triangle strips, and what is asked for.
pub(super) fn read(input: Input, wanted: Wanted, builder: &mut MeshBuilder) -> Result<()> {
    read_with(input, wanted, Plain::of, builder)
}

/// Reads a PLY file in which `plain` finds the layouts of binary elements that are plain.
pub(super) fn read_with(
    mut input: Input,
    wanted: Wanted,
    plain: impl Fn(&ElementDef, Option<&str>, &Carried) -> Option<Plain>,
    builder: &mut MeshBuilder,
) -> Result<()> {
    let mut header = ply_header::read(&mut input, wanted.vertex_weight)?;
    let attributes = builder.attributes();
    let carried = if wanted.attributes {
        Carried::of(&mut header, attributes)
    } else {
        Carried::default()
    };
    let faces = FaceAttributes::of(&mut header, &carried, attributes);
    let mut sink = Sink {
        builder,
        vertices: header.vertices(),
        faces,
    };
    if carried.is_empty() {
        read_elements::<false>(input, &header, wanted, plain, &carried, &mut sink)
    } else {
        read_elements::<true>(input, &header, wanted, plain, &carried, &mut sink)?;
        sink.faces.finish(sink.builder);
        Ok(())
    }
}

/// Reads the elements behind the header, with numbers beside positions only where it `CARRIES` some.
fn read_elements<const CARRIES: bool>(
    input: Input,
    header: &Header,
    wanted: Wanted,
    plain: impl Fn(&ElementDef, Option<&str>, &Carried) -> Option<Plain>,
    carried: &Carried,
    sink: &mut Sink,
) -> Result<()> {
    let vertex_weight = wanted.vertex_weight;
    let body = match header.encoding {
        Encoding::Ascii => Body::Ascii(Lines::after(input, header.lines)),
        encoding => Body::Binary {
            big: encoding == Encoding::BinaryBigEndian,
            blocks: Blocks::after(input, header.bytes),
        },
    };
    let mut reader = ElementReader::<CARRIES> {
        parser: Parser::new(),
        body,
        start: 0,
    };
    // Without properties there is nothing to read, so no number of them would ever end the file.
    for def in header
        .elements
        .iter()
        .filter(|def| !def.properties.is_empty())
    {
        if let Body::Binary { big, blocks } = &mut reader.body
            && let Some(plain) = plain(def, vertex_weight, carried)
        {
            let mut decoder = Decoder { def, blocks, sink };
            if *big {
                decoder.read::<true>(&plain)?;
            } else {
                decoder.read::<false>(&plain)?;
            }
        } else {
            reader.read_all(def, sink, vertex_weight, carried)?;
        }
    }
    Ok(())
}

/// The mesh while it is read.
pub(super) struct Sink<'a> {
    pub builder: &'a mut MeshBuilder,
    /// How many the header promises.
    pub vertices: usize,
    pub faces: FaceAttributes,
}

impl Sink<'_> {
    /// Takes the weight of the next vertex, or returns it where it is none.
    pub fn push_weight(&mut self, weight: f64) -> std::result::Result<(), f64> {
        self.builder.push_weight(single(weight).ok_or(weight)?);
        Ok(())
    }

    /// Takes what the next vertex carries: `number` gives its properties by their numbers.
    pub fn push_values(&mut self, carried: &Carried, number: impl Fn(usize) -> f64) {
        let channels = &mut self.builder.attributes().channels;
        for (channel, properties) in channels.iter_mut().zip(&carried.channels) {
            properties
                .iter()
                .for_each(|&i| channel.values.push(number(i)));
        }
    }

    /// Adds a face with the values that tell its group and the list of its texture coordinates.
    pub fn push_face(&mut self, corners: &[u32], values: &[f64], list: &[f64]) {
        self.faces.push_face(corners, values, list, self.builder);
    }

    /// A vertex number, if there is such a vertex.
    pub fn corner(&self, v: i64) -> std::result::Result<u32, Fault> {
        u32::try_from(v)
            .ok()
            .filter(|&v| (v as usize) < self.vertices && v != RESTART)
            .ok_or(Fault::Corner(v))
    }
}

/// What can be wrong with an element.
pub(super) enum Fault {
    /// The file ends in it.
    End,
    NegativeLength,
    /// A corner that names no vertex.
    Corner(i64),
    /// A weight that is none.
    Weight(f64),
}

impl Fault {
    /// What a message says about element `i` of those that `def` defines, in a file that promises
    /// so many vertices.
    pub fn found_and_expected(
        self,
        def: &ElementDef,
        i: usize,
        vertices: usize,
    ) -> (String, String) {
        let name = &def.name;
        match self {
            Fault::End => (
                format!("the file ends in {name} {i}"),
                format!("{} of them, as the header says", def.count),
            ),
            Fault::NegativeLength => (
                format!("{name} {i} has a list of negative length"),
                "a length of 0 or more".to_string(),
            ),
            Fault::Corner(v) => (
                format!("{name} {i} uses vertex {v}"),
                match vertices {
                    0 => "vertices in the file".to_string(),
                    n => format!("0 to {}", n - 1),
                },
            ),
            Fault::Weight(weight) => (
                format!("vertex {i} has the weight {weight}"),
                "0 or more".to_string(),
            ),
        }
    }
}

/// A weight in single precision, if it is one. Only what was infinite before is so behind, since that
/// locks.
fn single(weight: f64) -> Option<f32> {
    let single = if weight.is_finite() {
        (weight as f32).min(f32::MAX)
    } else {
        weight as f32
    };
    (single >= 0.0).then_some(single)
}

/// What stands between two strips of one list; more vertices than a mesh can have.
const RESTART: u32 = u32::MAX;

/// Adds the triangles of strips. Every other one runs the other way round; one that uses a vertex
/// twice is a joint of the strip and no triangle.
///
/// ```text
///   0 ── 2 ── 4
///    \  / \  /        012, 213, 234
///     1 ── 3
/// ```
fn push_strips(builder: &mut MeshBuilder, corners: &[u32]) {
    for strip in corners.split(|&v| v == RESTART) {
        for (i, window) in strip.windows(3).enumerate() {
            let &[a, b, c] = window else { continue };
            if a != b && b != c && c != a {
                builder.push_triangle(if i % 2 == 0 { [a, b, c] } else { [b, a, c] });
            }
        }
    }
}

/// What the mesh takes from one element.
#[derive(Default)]
struct Element<const CARRIES: bool> {
    position: [f64; 3],
    weight: f64,
    list: Option<Property>,
    /// If it carries any: all other numbers, in their order.
    numbers: Vec<f64>,
    texture_coordinates: Vec<f64>,
}

impl<const CARRIES: bool> PropertyAccess for Element<CARRIES> {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match name {
            CORNERS => {
                self.list = Some(property);
                return PropertyAccessResult::Set;
            }
            TEXTURE_COORDINATES if CARRIES => {
                self.texture_coordinates = numbers_of(property);
                return PropertyAccessResult::Set;
            }
            _ => {}
        }
        let number = match property {
            Property::Char(x) => x.into(),
            Property::UChar(x) => x.into(),
            Property::Short(x) => x.into(),
            Property::UShort(x) => x.into(),
            Property::Int(x) => x.into(),
            Property::UInt(x) => x.into(),
            Property::Float(x) => x.into(),
            Property::Double(x) => x,
            _ => return PropertyAccessResult::Ignored,
        };
        match name {
            "x" => self.position[0] = number,
            "y" => self.position[1] = number,
            "z" => self.position[2] = number,
            WEIGHT => self.weight = number,
            _ if CARRIES => self.numbers.push(number),
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

/// The numbers of a list.
fn numbers_of(property: Property) -> Vec<f64> {
    fn all<T: Into<f64>>(list: Vec<T>) -> Vec<f64> {
        list.into_iter().map(Into::into).collect()
    }
    match property {
        Property::ListChar(list) => all(list),
        Property::ListUChar(list) => all(list),
        Property::ListShort(list) => all(list),
        Property::ListUShort(list) => all(list),
        Property::ListInt(list) => all(list),
        Property::ListUInt(list) => all(list),
        Property::ListFloat(list) => all(list),
        Property::ListDouble(list) => list,
        _ => Vec::new(),
    }
}

/// Which of [`Element::numbers`] each property of `def` is, by its number; of no meaning for others.
fn places_of_numbers(def: &ElementDef) -> Vec<usize> {
    let mut next = 0;
    let place = |(name, property): (&String, &PropertyDef)| {
        let is_number = matches!(property.data_type, PropertyType::Scalar(_));
        let is_other = !AXES.contains(&name.as_str()) && name != WEIGHT;
        let place = next;
        next += usize::from(is_number && is_other);
        place
    };
    def.properties.iter().map(place).collect()
}

impl<const CARRIES: bool> Element<CARRIES> {
    /// The weight of a vertex, read from the property of this name in the file.
    fn weight(&self, property: &str) -> f64 {
        let axis = AXES.into_iter().position(|axis| axis == property);
        axis.map_or(self.weight, |axis| self.position[axis])
    }

    /// Fills `corners` from the list of whatever integers, up to the first that `corner` refuses.
    fn corners(
        &self,
        corners: &mut Vec<u32>,
        corner: impl Fn(i64) -> std::result::Result<u32, Fault>,
    ) -> std::result::Result<(), Fault> {
        corners.clear();
        let mut fill = |list: &mut dyn Iterator<Item = i64>| {
            for v in list {
                corners.push(corner(v)?);
            }
            Ok(())
        };
        match &self.list {
            Some(Property::ListChar(list)) => fill(&mut list.iter().map(|&v| v.into())),
            Some(Property::ListUChar(list)) => fill(&mut list.iter().map(|&v| v.into())),
            Some(Property::ListShort(list)) => fill(&mut list.iter().map(|&v| v.into())),
            Some(Property::ListUShort(list)) => fill(&mut list.iter().map(|&v| v.into())),
            Some(Property::ListInt(list)) => fill(&mut list.iter().map(|&v| v.into())),
            Some(Property::ListUInt(list)) => fill(&mut list.iter().map(|&v| v.into())),
            _ => Ok(()),
        }
    }
}

/// Where the elements come from.
enum Body {
    Ascii(Lines),
    Binary {
        /// Whether numbers have their highest byte first.
        big: bool,
        blocks: Blocks,
    },
}

struct ElementReader<const CARRIES: bool> {
    parser: Parser<Element<CARRIES>>,
    body: Body,
    /// The byte of a binary file where the last element began.
    start: u64,
}

impl<const CARRIES: bool> ElementReader<CARRIES> {
    /// Takes all elements that `def` defines into the mesh.
    fn read_all(
        &mut self,
        def: &ElementDef,
        sink: &mut Sink,
        vertex_weight: Option<&str>,
        carried: &Carried,
    ) -> Result<()> {
        let role = Role::of(def);
        let vertices = sink.vertices;
        let mut corners = Vec::new();
        let mut values = Vec::new();
        let places = places_of_numbers(def);
        for i in 0..def.count {
            let element = self.next(def, i)?;
            let fault = |fault: Fault| {
                let (found, expected) = fault.found_and_expected(def, i, vertices);
                self.error(&found, &expected)
            };
            match role {
                Role::Vertex { single } => {
                    if let Some(property) = vertex_weight {
                        let pushed = sink.push_weight(element.weight(property));
                        pushed.map_err(|weight| fault(Fault::Weight(weight)))?;
                    }
                    if CARRIES {
                        sink.push_values(carried, |i| element.numbers[places[i]]);
                    }
                    if single {
                        let position = element.position.map(|x| x as f32);
                        sink.builder.push_single(position);
                    } else {
                        sink.builder.push_double(element.position);
                    }
                }
                Role::Face => {
                    element
                        .corners(&mut corners, |v| sink.corner(v))
                        .map_err(fault)?;
                    if CARRIES {
                        values.clear();
                        let groups = carried.groups.iter();
                        values.extend(groups.map(|&i| element.numbers[places[i]]));
                        sink.push_face(&corners, &values, &element.texture_coordinates);
                    } else {
                        sink.builder.push_polygon(&corners);
                    }
                }
                Role::Strips => {
                    let corner = |v| match v {
                        -1 => Ok(RESTART),
                        _ => sink.corner(v),
                    };
                    element.corners(&mut corners, corner).map_err(fault)?;
                    push_strips(sink.builder, &corners);
                }
                Role::Other => {}
            }
        }
        Ok(())
    }

    /// Element `i` of those that `def` defines.
    fn next(&mut self, def: &ElementDef, i: usize) -> Result<Element<CARRIES>> {
        match &mut self.body {
            Body::Ascii(lines) => {
                while lines.advance()? {
                    if words(lines.line()).next().is_some() {
                        return parse_line(&self.parser, lines, def);
                    }
                }
                let found = format!("the file ends before {} {i}", def.name);
                let expected = format!("{} of them, as the header says", def.count);
                Err(lines.error_at_end(&found, &expected))
            }
            Body::Binary { big, blocks } => {
                self.start = blocks.position();
                let element = if *big {
                    self.parser.read_big_endian_element(blocks, def)
                } else {
                    self.parser.read_little_endian_element(blocks, def)
                };
                element.map_err(|e| binary_error(blocks, self.start, def, i, &e))
            }
        }
    }

    /// An error in the last element.
    fn error(&self, found: &str, expected: &str) -> Error {
        match &self.body {
            Body::Ascii(lines) => lines.error(found, expected),
            Body::Binary { blocks, .. } => {
                blocks
                    .input()
                    .error(Place::Byte(self.start), found, expected)
            }
        }
    }
}

/// Parses one line of an ASCII file.
fn parse_line<const CARRIES: bool>(
    parser: &Parser<Element<CARRIES>>,
    lines: &Lines,
    def: &ElementDef,
) -> Result<Element<CARRIES>> {
    let parse = |line: &str| parser.read_ascii_element(line, def).ok();
    std::str::from_utf8(lines.line())
        .ok()
        .and_then(parse)
        .or_else(|| parse_respelled(parse, lines.line()))
        .ok_or_else(|| {
            let names: Vec<_> = def.properties.keys().map(String::as_str).collect();
            let found = format!("{} {}", def.name, quote(lines.line()));
            lines.error(&found, &format!("numbers for {}", names.join(" ")))
        })
}

/// Parses a line with numbers that ply-rs-bw does not know. Among them is NaN, which nothing that it
/// knows can spell: two things stand for it, and a number that differs is NaN.
fn parse_respelled<const CARRIES: bool>(
    parse: impl Fn(&str) -> Option<Element<CARRIES>>,
    line: &[u8],
) -> Option<Element<CARRIES>> {
    let (above, below) = (respell(line, "1e999")?, respell(line, "-1e999")?);
    let mut element = parse(&above)?;
    if above != below {
        let other = parse(&below)?;
        let mark = |x: &mut f64, y: f64| *x = if *x == y { y } else { f64::NAN };
        for (x, y) in element.position.iter_mut().zip(other.position) {
            mark(x, y);
        }
        mark(&mut element.weight, other.weight);
        for (numbers, others) in [
            (&mut element.numbers, other.numbers),
            (&mut element.texture_coordinates, other.texture_coordinates),
        ] {
            for (x, y) in numbers.iter_mut().zip(others) {
                mark(x, y);
            }
        }
    }
    Some(element)
}

/// A line with its numbers spelled as ply-rs-bw wants them, which knows neither `1.` nor `.5` nor
/// `inf`, and with `nan` for NaN.
fn respell(line: &[u8], nan: &str) -> Option<String> {
    let mut text = String::new();
    for word in words(line) {
        match parse_number(word)? {
            x if x.is_nan() => text.push_str(nan),
            f64::INFINITY => text.push_str("1e999"),
            f64::NEG_INFINITY => text.push_str("-1e999"),
            x => text.push_str(&x.to_string()),
        }
        text.push(' ');
    }
    Some(text)
}

fn binary_error(blocks: &Blocks, start: u64, def: &ElementDef, i: usize, e: &ParseError) -> Error {
    let fault = match e.kind() {
        ErrorKind::UnexpectedEof => Fault::End,
        // All that can be wrong with bytes, once the header's types have been checked.
        ErrorKind::InvalidInput | ErrorKind::InvalidData => Fault::NegativeLength,
        kind => return blocks.input().io_error(io::Error::new(kind, e.to_string())),
    };
    // Neither fault is about vertices.
    let (found, expected) = fault.found_and_expected(def, i, 0);
    blocks.input().error(Place::Byte(start), &found, &expected)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::indexed_mesh::IndexedMesh;

    /// Without attributes.
    fn read(input: Input, vertex_weight: Option<&str>) -> Result<IndexedMesh> {
        let mut builder = MeshBuilder::default();
        let wanted = Wanted {
            vertex_weight,
            attributes: false,
        };
        super::read(input, wanted, &mut builder)?;
        builder.finish()
    }

    fn read_bytes(bytes: impl Into<Vec<u8>>) -> Result<IndexedMesh> {
        read(Input::from_bytes("a.ply", bytes)?, None)
    }

    fn read_weighted(bytes: impl Into<Vec<u8>>, property: &str) -> Result<IndexedMesh> {
        read(Input::from_bytes("a.ply", bytes)?, Some(property))
    }

    fn mesh(bytes: impl Into<Vec<u8>>) -> IndexedMesh {
        read_bytes(bytes).unwrap()
    }

    fn message(bytes: impl Into<Vec<u8>>) -> String {
        read_bytes(bytes).unwrap_err().to_string()
    }

    const HEADER: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n\
                          property float y\nproperty float z\nelement face 1\n\
                          property list uchar int vertex_indices\nend_header\n";
    const BODY: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

    fn square() -> IndexedMesh {
        mesh(format!("{HEADER}{BODY}"))
    }

    /// A small number as a binary file holds it.
    fn bytes_of(data_type: &str, x: i32, big: bool) -> Vec<u8> {
        let mut bytes = match data_type {
            "char" | "uint8" => vec![x as u8],
            "short" | "uint16" => (x as i16).to_le_bytes().to_vec(),
            "int" | "uint32" => x.to_le_bytes().to_vec(),
            "float" => (x as f32).to_le_bytes().to_vec(),
            _ => f64::from(x).to_le_bytes().to_vec(),
        };
        if big {
            bytes.reverse();
        }
        bytes
    }

    #[test]
    fn a_polygon_becomes_a_fan() {
        assert_eq!(square().triangles(), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(square().positions()[2].to_array(), [1.0, 1.0, 0.0]);
    }

    /// Faces first, properties and an element of no interest, other names and types.
    #[test]
    fn order_and_company_do_not_matter() {
        let text = "ply\nformat ascii 1.0\nelement face 1\nproperty float quality\n\
                    property list int uint vertex_index\nproperty list uchar float texcoord\n\
                    element camera 2\nproperty float x\nelement vertex 4\nproperty uchar red\n\
                    property double z\nproperty short x\nproperty list uchar uchar extra\n\
                    property int8 y\nend_header\n\
                    0.5 4 0 1 2 3 2 0.5 0.5\n7\n8\n\
                    255 0 0 1 9 0\n255 0 1 0 0\n255 0 1 2 8 9 1\n255 0 0 0 1\n";
        assert_eq!(mesh(text), square());
    }

    #[test]
    fn harmless_header_quirks_are_tidied() {
        let quirks = HEADER
            .replace("format ascii", " format \t  ascii")
            .replace("element face", "\telement\t face")
            .replace("float x", "float x  \ncomment caf\u{e9}\nobj_info x\n");
        assert_eq!(mesh(format!("{quirks}{BODY}")), square());
        for end in ["\r\n", "\r"] {
            assert_eq!(
                mesh(format!("{HEADER}{BODY}").replace('\n', end)),
                square(),
                "{end:?}"
            );
        }
        let latin = [
            b"ply\ncomment \xe9\n",
            &format!("{HEADER}{BODY}").as_bytes()[4..],
        ]
        .concat();
        assert_eq!(mesh(latin), square());
    }

    /// Two properties of one name are two numbers in each line; the first one counts.
    #[test]
    fn properties_of_one_name_are_not_merged() {
        let header = HEADER.replace(
            "float z\n",
            "float z\nproperty float z\nproperty float 9.k\n",
        );
        let body = BODY.replace(" 0\n", " 0 5 6\n");
        assert_eq!(mesh(format!("{header}{body}")), square());
    }

    /// A body that begins with the byte `\n`: only a header of `\r` alone leaves it there.
    #[test]
    fn the_first_byte_of_the_body_may_be_a_line_feed() {
        let header = "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty uchar x\n\
                      property uchar y\nproperty uchar z\nend_header\n";
        for end in ["\n", "\r\n", "\r"] {
            let bytes = [header.replace('\n', end).as_bytes(), &[10, 20, 30]].concat();
            assert_eq!(
                mesh(bytes).positions()[0].to_array(),
                [10.0, 20.0, 30.0],
                "{end:?}"
            );
        }
    }

    /// The square with every type of coordinate, count and index, in both byte orders.
    #[test]
    fn every_type_and_byte_order_reads_the_same() {
        let integers = ["char", "uint8", "short", "uint16", "int", "uint32"];
        for big in [false, true] {
            for (coordinate, count, index) in [
                integers,
                ["float", "double", "float", "double", "int", "char"],
            ]
            .concat()
            .into_iter()
            .enumerate()
            .map(|(i, name)| (name, integers[i % 6], integers[(i + i / 6) % 6]))
            {
                let order = if big { "big" } else { "little" };
                let header = HEADER
                    .replace("ascii", &format!("binary_{order}_endian"))
                    .replace("float", coordinate)
                    .replace("uchar int", &format!("{count} {index}"));
                let mut bytes = header.into_bytes();
                for x in [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0] {
                    bytes.extend(bytes_of(coordinate, x, big));
                }
                bytes.extend(bytes_of(count, 4, big));
                for v in 0..4 {
                    bytes.extend(bytes_of(index, v, big));
                }
                assert_eq!(
                    mesh(bytes),
                    square(),
                    "{coordinate} {count} {index} {order}"
                );
            }
        }
    }

    /// Two strips; the first has a joint (2 2) that keeps the turn of what follows.
    #[test]
    fn strips_turn_every_other_triangle() {
        let header = HEADER.replace("element face", "element tristrips");
        let text = format!("{header}{}9 0 1 2 2 3 -1 3 2 0\n", &BODY[..24]);
        assert_eq!(mesh(text).triangles(), [[0, 1, 2], [3, 2, 0]]);
        let text = format!("{header}{}7 0 1 2 3 -1 3 2\n", &BODY[..24]);
        assert_eq!(mesh(text).triangles(), [[0, 1, 2], [2, 1, 3]]);
    }

    #[test]
    fn numbers_that_the_grammar_of_ply_rs_does_not_know() {
        let mesh = mesh(format!(
            "{HEADER}nan -inf 0\n1. .5 -1.e0\n1 1 0\n0 1 0\n3 0 1 2\n"
        ));
        assert!(!mesh.positions()[0].x.is_finite() && !mesh.positions()[0].y.is_finite());
        assert_eq!(mesh.positions()[1].to_array(), [1.0, 0.5, -1.0]);
    }

    #[test]
    fn doubles_keep_what_floats_cannot_hold() {
        let text = format!("{HEADER}{BODY}")
            .replace("float", "double")
            .replace("1 1 0", "1 1 0.1");
        let far = text
            .replace("\n1 ", "\n5000000.001 ")
            .replace("\n0 ", "\n5000000 ");
        let mesh = mesh(far);
        assert!(
            mesh.points()
                .all(|p| (p.x - 5.0e6).abs() < 2.0e-3 && p.x >= 5.0e6)
        );
        assert!((mesh.points().nth(1).unwrap().x - 5000000.001).abs() < 1.0e-8);
    }

    /// The square with the weights 0 to 3 of every type, as text and in both byte orders, between
    /// properties that are passed over.
    #[test]
    fn weights_of_every_type_and_byte_order_read_the_same() {
        let weights = [0.0, 1.0, 2.0, 3.0];
        let types = [
            "char", "uint8", "short", "uint16", "int", "uint32", "float", "double",
        ];
        for data_type in types {
            let header = HEADER.replace(
                "float z\n",
                &format!("float z\nproperty uchar red\nproperty {data_type} w.1\n"),
            );
            let mut text = header.clone();
            for (v, line) in BODY.lines().enumerate() {
                let more = if v < 4 {
                    format!(" 7 {v}")
                } else {
                    String::new()
                };
                text.push_str(&format!("{line}{more}\n"));
            }
            let mesh = read_weighted(text, "w.1").unwrap();
            assert_eq!(mesh.weights(), weights, "{data_type}");
            for big in [false, true] {
                let order = if big { "big" } else { "little" };
                let header = header.replace("ascii", &format!("binary_{order}_endian"));
                let mut bytes = header.into_bytes();
                for (v, [x, y]) in [[0, 0], [1, 0], [1, 1], [0, 1]].into_iter().enumerate() {
                    for coordinate in [x, y, 0] {
                        bytes.extend(bytes_of("float", coordinate, big));
                    }
                    bytes.push(7);
                    bytes.extend(bytes_of(data_type, v as i32, big));
                }
                bytes.push(4);
                (0..4).for_each(|v| bytes.extend(bytes_of("int", v, big)));
                let mesh = read_weighted(bytes, "w.1").unwrap();
                assert_eq!(mesh.weights(), weights, "{data_type} {order}");
                assert_eq!(mesh.with_weights(Vec::new()).unwrap(), square());
            }
        }
    }

    /// The square with the property `w` behind its coordinates.
    fn weighted(data_type: &str, weights: [&str; 4]) -> String {
        let more = format!("float z\nproperty {data_type} w\n");
        let mut text = HEADER.replace("float z\n", &more);
        let corners = ["0 0 0", "1 0 0", "1 1 0", "0 1 0"];
        for (corner, weight) in corners.into_iter().zip(weights) {
            text.push_str(&format!("{corner} {weight}\n"));
        }
        text + "4 0 1 2 3\n"
    }

    /// A coordinate can be the weight, and still is a coordinate. A property that is not asked for
    /// is none, whatever its name.
    #[test]
    fn the_weight_is_the_property_asked_for() {
        let text = weighted("float", ["2", "3", "4", "5"]);
        let mesh = read_weighted(text.as_str(), "x").unwrap();
        assert_eq!(mesh.weights(), [0.0, 1.0, 1.0, 0.0]);
        assert_eq!(mesh.with_weights(Vec::new()).unwrap(), square());
        assert_eq!(self::mesh(text), square());
        for other in ["float", "list uchar int"] {
            let types = format!("{other} {WEIGHT}\nproperty float");
            let text = weighted(&types, ["0 2", "0 3", "0 4", "0 5"]);
            let mesh = read_weighted(text, "w").unwrap();
            assert_eq!(mesh.weights(), [2.0, 3.0, 4.0, 5.0], "{other}");
        }
    }

    /// 0 and infinity are weights. A finite double stays finite, since only infinity locks.
    #[test]
    fn extreme_weights_are_kept() {
        let text = weighted("double", ["0", "inf", "1e300", "1e-300"]);
        let expected = [0.0, f32::INFINITY, f32::MAX, 0.0];
        assert_eq!(read_weighted(text, "w").unwrap().weights(), expected);
    }

    #[test]
    fn a_weight_that_is_none_says_where() {
        for (weight, written) in [
            ("-1", "-1"),
            ("nan", "NaN"),
            ("-nan(ind)", "NaN"),
            ("-inf", "-inf"),
        ] {
            let error = read_weighted(weighted("float", ["1", "inf", weight, "1"]), "w");
            let expected =
                format!("a.ply:13: vertex 2 has the weight {written}; expected 0 or more");
            assert_eq!(error.unwrap_err().to_string(), expected);
        }
        let header = HEADER.replace("ascii", "binary_little_endian");
        let mut bytes = header.clone().into_bytes();
        for x in [0.0, 0.0, 1.0, 1.0, 0.0, f32::NAN] {
            bytes.extend(x.to_le_bytes());
        }
        let place = header.len() + 12;
        assert_eq!(
            read_weighted(bytes, "z").unwrap_err().to_string(),
            format!("a.ply: byte {place}: vertex 1 has the weight NaN; expected 0 or more")
        );
    }

    #[test]
    fn a_property_that_can_be_no_weight_is_named() {
        let text = weighted("list uchar float", ["0"; 4]);
        for (property, expected) in [
            (
                "W",
                "a.ply: vertex has no property 'W'; expected one of x, y, z, w",
            ),
            (
                "w",
                "a.ply: vertex property 'w' is a list; expected a number, where it is to be the \
                 weight",
            ),
        ] {
            let error = read_weighted(text.as_str(), property).unwrap_err();
            assert_eq!(error.to_string(), expected);
        }
    }

    /// More elements than any memory holds, of no bytes each.
    #[test]
    fn elements_without_properties_take_no_time() {
        let header = HEADER.replace("element face", "element void 99999999999999\nelement face");
        assert_eq!(mesh(format!("{header}{BODY}")), square());
        let binary = "ply\nformat binary_little_endian 1.0\nelement x 99999999999\nend_header\n";
        assert_eq!(mesh(binary).triangle_count(), 0);
    }

    #[test]
    fn errors_say_where() {
        let expected = "a.ply:14: face 0 uses vertex 9; expected 0 to 3";
        assert_eq!(
            message(format!("{HEADER}{}", BODY.replace("2 3\n", "2 9\n"))),
            expected
        );
        let binary = HEADER.replace("ascii", "binary_big_endian");
        let expected = format!(
            "a.ply: byte {}: the file ends in vertex 1; expected 4 of them, as the header says",
            binary.len() + 12
        );
        assert_eq!(message([binary.as_bytes(), &[0; 20]].concat()), expected);
    }
}
