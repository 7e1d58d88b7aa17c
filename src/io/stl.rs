//! STL, binary and ASCII: facets with three vertices of their own each.

use crate::error::{Error, Place, Result};
use crate::indexed_mesh::MeshBuilder;

use super::blocks::Blocks;
use super::input::Input;
use super::text::{Lines, count, parse_number, quote, words};

/// 80 bytes of anything and a count of triangles.
const HEADER_BYTES: usize = 84;
/// A normal, three vertices, two bytes of attributes.
const FACET_BYTES: usize = 50;

/// Whether a file is binary STL because its length is the one that its count of triangles asks for,
/// whatever its header says.
pub(super) fn is_binary_by_length(head: &[u8], length: Option<u64>) -> bool {
    let promised = promised_facets(head);
    promised.is_some_and(|n| n > 0 && length == Some(binary_bytes(n)))
}

/// Whether a file is ASCII STL: `solid`, soon after it `facet` or `endsolid`, and no byte that text
/// does not have.
pub(super) fn is_ascii(head: &[u8]) -> bool {
    let text = head.to_ascii_lowercase();
    let mut found = words(&text);
    found.next() == Some(b"solid")
        && found.any(|word| word == b"facet" || word == b"endsolid")
        && !text.contains(&0)
}

fn promised_facets(head: &[u8]) -> Option<u32> {
    let count = head.get(80..HEADER_BYTES)?;
    Some(u32::from_le_bytes(count.try_into().ok()?))
}

fn binary_bytes(facets: u32) -> u64 {
    HEADER_BYTES as u64 + FACET_BYTES as u64 * u64::from(facets)
}

/// Reads an STL file into a mesh. Welding its vertices is a later stage's work.
pub(super) fn read(input: Input, builder: &mut MeshBuilder) -> Result<()> {
    // UTF-16 has zero bytes, so it is told by its mark alone.
    let utf16 = matches!(input.head.as_slice(), [0xFE, 0xFF, ..] | [0xFF, 0xFE, ..]);
    let first = words(&input.head).next().unwrap_or_default();
    let solid = first.eq_ignore_ascii_case(b"solid") && !input.head.contains(&0);
    if is_binary_by_length(&input.head, input.length) {
        read_binary(input, builder)
    } else if is_ascii(&input.head) || solid || utf16 {
        read_ascii(input, builder)
    } else {
        read_binary(input, builder)
    }
}

fn read_binary(input: Input, builder: &mut MeshBuilder) -> Result<()> {
    let Some(promised) = promised_facets(&input.head) else {
        let found = format!("{} bytes and no word 'solid'", input.head.len());
        return Err(input.error(
            Place::File,
            &found,
            "ASCII STL, or binary of 84 bytes and more",
        ));
    };
    let triangles = count(promised as usize, "triangle", "triangles");
    let wrong_length = |input: &Input, length: u64, more: &str| {
        let found = format!("the header promises {triangles}, the file has {length} bytes{more}");
        input.error(
            Place::File,
            &found,
            &format!("{} bytes", binary_bytes(promised)),
        )
    };
    if let Some(length) = input
        .length
        .filter(|&length| length != binary_bytes(promised))
    {
        return Err(wrong_length(&input, length, ""));
    }
    let known = input.length.is_some();
    let mut blocks = Blocks::after(input, 0);
    blocks.peek(HEADER_BYTES)?;
    blocks.consume(HEADER_BYTES);
    let promised_facets = promised as usize;
    if known {
        builder.reserve_vertices(promised_facets.saturating_mul(3));
        builder.reserve_triangles(promised_facets);
    }
    while builder.face_count() < promised_facets {
        let block = blocks.peek(FACET_BYTES)?;
        let facets = block.as_chunks::<FACET_BYTES>().0;
        let first = builder.face_count();
        let facets = &facets[..facets.len().min(promised_facets - first)];
        if facets.is_empty() {
            let rest = block.len() as u64;
            let length = blocks.position() + rest;
            return Err(wrong_length(blocks.input(), length, ""));
        }
        builder.push_singles(facets.iter().flat_map(facet_vertices));
        // More than 2^32 vertices are more than `finish` lets pass.
        let corners = |i: usize| [0, 1, 2].map(|k| (3 * i as u64 + k) as u32);
        builder.push_triangles((first..first + facets.len()).map(corners));
        let bytes = facets.len() * FACET_BYTES;
        blocks.consume(bytes);
    }
    if !blocks.peek(1)?.is_empty() {
        let length = binary_bytes(promised);
        return Err(wrong_length(blocks.input(), length, " and more"));
    }
    Ok(())
}

fn facet_vertices(facet: &[u8; FACET_BYTES]) -> [[f32; 3]; 3] {
    let number = |i: usize| f32::from_le_bytes(std::array::from_fn(|byte| facet[4 * i + byte]));
    [3, 6, 9].map(|i| [number(i), number(i + 1), number(i + 2)])
}

fn push_facet(builder: &mut MeshBuilder, vertices: [[f64; 3]; 3]) {
    let corners = vertices.map(|position| builder.push_double(position) as u32);
    builder.push_triangle(corners);
}

/// Reads ASCII STL by words, so that line breaks do not matter; `solid` and `endsolid` take the
/// rest of their line as a name, and words that say nothing are skipped.
fn read_ascii(input: Input, builder: &mut MeshBuilder) -> Result<()> {
    let mut lines = Lines::new(input)?;
    let mut facet: Option<Facet> = None;
    while lines.advance()? {
        for word in words(lines.line()) {
            if let Some(facet) = facet.as_mut().filter(|facet| facet.wants_number()) {
                let number = parse_number(word).ok_or_else(|| {
                    lines.error(&format!("vertex with {}", quote(word)), "three numbers")
                })?;
                facet.numbers.push(number);
                continue;
            }
            match Keyword::of(word) {
                Keyword::Facet => {
                    if facet.is_some() {
                        return Err(lines.error("a facet within a facet", "endfacet before it"));
                    }
                    facet = Some(Facet {
                        line: lines.number(),
                        ..Facet::default()
                    });
                }
                Keyword::Vertex => match &mut facet {
                    Some(facet) => facet.vertices += 1,
                    None => {
                        return Err(lines.error("a vertex outside of a facet", "facet before it"));
                    }
                },
                Keyword::EndFacet => match facet.take() {
                    Some(facet) => push_facet(builder, facet.vertices(&lines)?),
                    None => return Err(lines.error("endfacet without facet", "facet before it")),
                },
                Keyword::Solid => {
                    if let Some(facet) = &facet {
                        return Err(facet.unfinished(&lines));
                    }
                    break;
                }
                Keyword::None => {}
            }
        }
    }
    match facet {
        Some(facet) => Err(facet.unfinished(&lines)),
        None => Ok(()),
    }
}

/// The words of ASCII STL that say something.
enum Keyword {
    /// `solid` or `endsolid`: a name follows.
    Solid,
    Facet,
    Vertex,
    EndFacet,
    /// A number of a normal, `outer`, `loop`, or what somebody found useful there.
    None,
}

impl Keyword {
    /// The keyword that a word is, in any letter case.
    fn of(word: &[u8]) -> Keyword {
        let is = |keyword: &str| word.eq_ignore_ascii_case(keyword.as_bytes());
        if is("vertex") {
            Keyword::Vertex
        } else if is("facet") {
            Keyword::Facet
        } else if is("endfacet") {
            Keyword::EndFacet
        } else if is("solid") || is("endsolid") {
            Keyword::Solid
        } else {
            Keyword::None
        }
    }
}

/// A facet while it is read.
#[derive(Default)]
struct Facet {
    line: usize,
    vertices: usize,
    numbers: Vec<f64>,
}

impl Facet {
    /// Whether the last vertex still lacks coordinates.
    fn wants_number(&self) -> bool {
        self.numbers.len() < 3 * self.vertices
    }

    fn vertices(&self, lines: &Lines) -> Result<[[f64; 3]; 3]> {
        match self.numbers.as_chunks().0 {
            &[a, b, c] => Ok([a, b, c]),
            vertices => {
                let found = format!("a facet with {} vertices", vertices.len());
                Err(lines.error_at(self.line, &found, "three"))
            }
        }
    }

    fn unfinished(&self, lines: &Lines) -> Error {
        lines.error_at(
            self.line,
            "a facet without an end",
            "three vertices and endfacet",
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::indexed_mesh::IndexedMesh;

    const FACET: &str = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
                         vertex 0 1 0\nendloop\nendfacet\n";

    fn read(input: Input) -> Result<IndexedMesh> {
        let mut builder = MeshBuilder::default();
        super::read(input, &mut builder)?;
        builder.finish()
    }

    fn mesh(text: impl Into<Vec<u8>>) -> IndexedMesh {
        read(Input::from_bytes("a.stl", text).unwrap()).unwrap()
    }

    fn binary(header: &[u8], facets: u32) -> Vec<u8> {
        let mut bytes = header.to_vec();
        bytes.resize(80, b' ');
        bytes.extend(facets.to_le_bytes());
        for i in 0..facets {
            let numbers = [
                0.0, 0.0, 1.0, i as f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0,
            ];
            bytes.extend(numbers.iter().flat_map(|x: &f32| x.to_le_bytes()));
            bytes.extend([0, 0]);
        }
        bytes
    }

    #[test]
    fn ascii_in_any_layout() {
        let plain = mesh(format!("solid a\n{FACET}{FACET}endsolid a\n"));
        assert_eq!(plain.triangles(), [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(plain.positions()[1].to_array(), [1.0, 0.0, 0.0]);
        let text = format!("solid a\n{FACET}{FACET}endsolid a\n");
        let two_solids = format!("solid\n{FACET}endsolid facet\nsolid vertex\n{FACET}endsolid\n");
        let one_line = format!(
            "solid a\n{}\nendsolid",
            format!("{FACET}{FACET}").replace('\n', " ")
        );
        let trailing = text
            .replace("endloop", "endloop foo")
            .replace("endfacet", "endfacet bar ");
        for other in [
            text.replace('\n', "\r"),
            text.replace('\n', "\r\n"),
            text.to_uppercase(),
            text.replace(" 0 0\n", "\n0\n0\n"),
            text.replace(" normal 0 0 1", ""),
            two_solids,
            one_line,
            trailing,
        ] {
            assert_eq!(mesh(other.as_str()), plain, "{other}");
        }
    }

    /// 12000 facets are more than one block.
    #[test]
    fn binary_is_told_by_its_length() {
        for header in [
            b"solid facet endsolid".as_slice(),
            b" solid \xff\xfe",
            b"",
            b"OFF",
        ] {
            let mesh = mesh(binary(header, 12_000));
            assert_eq!(mesh.triangle_count(), 12_000);
            assert_eq!(mesh.positions().len(), 36_000);
            assert_eq!(
                mesh.positions()[3 * 11_999].to_array(),
                [11_999.0, 0.0, 0.0]
            );
        }
    }

    #[test]
    fn a_stream_needs_no_length() {
        let bytes = binary(b"solid part", 3);
        let stream = |bytes: &[u8]| read(Input::from_stream("<stdin>", bytes).unwrap());
        assert_eq!(stream(&bytes).unwrap().triangle_count(), 3);
        let error = stream(&bytes[..200]).unwrap_err().to_string();
        let expected = "<stdin>: the header promises 3 triangles, the file has 200 bytes; \
                        expected 234 bytes";
        assert_eq!(error, expected);
        assert!(stream(&[bytes, vec![0]].concat()).is_err());
    }

    #[test]
    fn an_empty_solid_is_a_mesh_without_triangles() {
        assert_eq!(mesh("solid Empty\nendsolid Empty").triangle_count(), 0);
        assert_eq!(mesh(binary(b"nothing", 0)).triangle_count(), 0);
    }
}
