//! Wavefront OBJ: the `v` and `f` lines, as one mesh with the file's own vertex numbers.
//!
//! tobj parses the vertices, in blocks of lines. Handed the whole file it would keep more than 100
//! bytes a face until the end (room for four corners of three `usize`), renumber the vertices by
//! first use, drop the unused ones, which the report counts, and name no line in its errors.

use crate::error::Result;
use crate::indexed_mesh::{IndexedMesh, MeshBuilder};

use super::input::Input;
use super::text::{Lines, count, not_finite, parse_integer, quote};

/// Reads an OBJ file. Groups, objects, materials, normals and texture coordinates are skipped;
/// a face of one or two corners is none.
pub(super) fn read(input: Input) -> Result<IndexedMesh> {
    let mut lines = Lines::new(input)?;
    let mut builder = MeshBuilder::default();
    let mut block = VertexBlock::default();
    let mut highest = Highest::default();
    let mut corners = Vec::new();
    let mut any = false;
    while lines.advance_continued()? {
        let mut words = lines.words();
        match words.next() {
            Some(b"v") => {
                any = true;
                block.push(words, lines.number());
                if block.lines.len() == BLOCK_LINES {
                    block.move_into(&mut builder, &lines)?;
                }
            }
            Some(b"f") => {
                any = true;
                let vertices = builder.vertex_count() + block.lines.len();
                corners.clear();
                for word in words {
                    corners.push(parse_corner(word, vertices, &lines)?);
                }
                highest.see(&corners, lines.number());
                builder.push_polygon(&corners);
            }
            _ => {}
        }
    }
    block.move_into(&mut builder, &lines)?;
    highest.check(builder.vertex_count(), &lines)?;
    if !any {
        return Err(lines.error_in_file("no line begins with v or f", "Wavefront OBJ"));
    }
    builder.finish()
}

/// The vertex of a corner `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 0.
///
/// A positive one may stand in a later line, so only the end of the file tells whether it is there.
fn parse_corner(word: &[u8], vertices: usize, lines: &Lines) -> Result<u32> {
    let v = word.split(|&b| b == b'/').next().unwrap_or_default();
    let index = parse_integer(v).ok_or_else(|| {
        lines.error(
            &format!("face corner {}", quote(word)),
            "a vertex number, such as 7 or 7/2/3",
        )
    })?;
    let from_zero = match index {
        1.. => index - 1,
        0 => {
            return Err(lines.error(
                "face uses vertex 0",
                "1 for the first vertex, -1 for the last",
            ));
        }
        _ => index.saturating_add(vertices as i64),
    };
    u32::try_from(from_zero).map_err(|_| {
        let expected = match vertices {
            0 => "a vertex before the face".to_string(),
            1 => "-1, the only vertex before the face".to_string(),
            n => format!("-1 to -{n}, the vertices before the face"),
        };
        lines.error(&format!("face uses vertex {index}"), &expected)
    })
}

/// The highest vertex that a face names, and where.
#[derive(Default)]
struct Highest {
    vertex: u32,
    line: usize,
}

impl Highest {
    fn see(&mut self, corners: &[u32], line: usize) {
        if let Some(&vertex) = corners.iter().max()
            && (vertex > self.vertex || self.line == 0)
        {
            *self = Highest { vertex, line };
        }
    }

    fn check(&self, vertices: usize, lines: &Lines) -> Result<()> {
        if self.line == 0 || (self.vertex as usize) < vertices {
            return Ok(());
        }
        let found = format!("face uses vertex {}", u64::from(self.vertex) + 1);
        let has = count(vertices, "vertex", "vertices");
        Err(lines.error_at(
            self.line,
            &found,
            &format!("one of the {has} that the file has"),
        ))
    }
}

/// How many vertices tobj gets at a time: enough that its set-up does not count, and few enough to
/// stay in the cache.
const BLOCK_LINES: usize = 4096;

/// Vertex lines on their way through tobj.
#[derive(Default)]
struct VertexBlock {
    /// An OBJ file of its own: each `v` line with its first three words, and behind it the face of
    /// one corner that makes tobj keep the vertex.
    text: Vec<u8>,
    /// The line in the file of each vertex.
    lines: Vec<usize>,
}

impl VertexBlock {
    /// Takes a vertex line in: three coordinates; a weight or a colour behind them is dropped.
    fn push<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>, line: usize) {
        self.text.push(b'v');
        for word in words.take(3) {
            self.text.push(b' ');
            match std::str::from_utf8(word).ok().and_then(not_finite) {
                Some(value) => self.text.extend_from_slice(value.to_string().as_bytes()),
                None => self.text.extend_from_slice(word),
            }
        }
        self.text.extend_from_slice(b"\nf -1\n");
        self.lines.push(line);
    }

    /// Hands the vertices over and is empty again.
    fn move_into(&mut self, builder: &mut MeshBuilder, lines: &Lines) -> Result<()> {
        let positions = parse_vertices(&self.text).ok_or_else(|| self.first_error(lines))?;
        for &position in positions.as_chunks().0 {
            builder.push_double(position);
        }
        self.text.clear();
        self.lines.clear();
        Ok(())
    }

    /// The error in the first line that tobj cannot parse.
    fn first_error(&self, lines: &Lines) -> crate::error::Error {
        let vertices = self.text.split(|&b| b == b'\n').step_by(2);
        let (line, text) = self
            .lines
            .iter()
            .zip(vertices)
            .find(|(_, text)| parse_vertices(&[text, b"\nf -1\n".as_slice()].concat()).is_none())
            .expect("a block that does not parse has a line that does not");
        lines.error_at(*line, &quote(text), "v and three numbers")
    }
}

/// The coordinates of a block's vertices, in its order.
fn parse_vertices(mut text: &[u8]) -> Option<Vec<f64>> {
    let options = tobj::LoadOptions::default();
    let no_materials = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut text, &options, no_materials).ok()?;
    models.into_iter().next().map(|model| model.mesh.positions)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(text: &str) -> IndexedMesh {
        read(Input::from_bytes("a.obj", text).unwrap()).unwrap()
    }

    fn message(text: impl Into<Vec<u8>>) -> String {
        read(Input::from_bytes("a.obj", text).unwrap())
            .unwrap_err()
            .to_string()
    }

    const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    #[test]
    fn corners_in_every_form_name_the_same_vertices() {
        for face in [
            "1 2 3",
            "1/9 2/9 3/9",
            "1//9 2//9 3//9",
            "1/9/9 2/9/9 3/9/9",
            "-4 -3 -2",
        ] {
            assert_eq!(
                mesh(&format!("{SQUARE}f {face}\n")).triangles(),
                [[0, 1, 2]],
                "{face}"
            );
        }
    }

    #[test]
    fn polygons_become_fans_and_shorter_faces_nothing() {
        let text = format!("{SQUARE}f 2 3 4 1\nf 1\nf 1 2\nl 1 2\np 1\n");
        assert_eq!(mesh(&text).triangles(), [[1, 2, 3], [1, 3, 0]]);
    }

    /// Negative numbers count back from the face's own line, in whatever group.
    #[test]
    fn groups_and_objects_share_vertices() {
        let text =
            format!("o a\n{SQUARE}g b\nusemtl x\nf 1 2 3\no c\nf -4 -2 -1\nv 5 5 5\nf 1 2 -1");
        let mesh = mesh(&text);
        assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3], [0, 1, 4]]);
        assert_eq!(mesh.positions().len(), 5);
    }

    /// tobj alone would number the vertices 2, 0 first and drop the unused ones.
    #[test]
    fn vertices_keep_their_order_and_the_unused_stay() {
        let mesh = mesh("v 9 9 9\nf 4 2 3\nv 1 0 0\nv 2 0 0\nv 3 0 0\nv 8 8 8\n");
        assert_eq!(mesh.triangles(), [[3, 1, 2]]);
        let x: Vec<_> = mesh.positions().iter().map(|p| p.x).collect();
        assert_eq!(x, [9.0, 1.0, 2.0, 3.0, 8.0]);
    }

    #[test]
    fn more_than_one_block_of_vertices_stays_in_order() {
        let n = 2 * BLOCK_LINES + 3;
        let text: String = (0..n).map(|i| format!("v {i} 0 0 0.5 0.5 0.5\n")).collect();
        let mesh = mesh(&format!("{text}f 1 -1 2\n"));
        assert!(
            mesh.positions()
                .iter()
                .enumerate()
                .all(|(i, p)| p.x == i as f32)
        );
        assert_eq!(mesh.triangles(), [[0, n as u32 - 1, 1]]);
    }

    #[test]
    fn layout_does_not_matter() {
        let text = format!(
            "\u{feff}# made by nobody\r\n  v\t0 0 \\\r\n 0 # here\r{}\r\n\r\nf 1 \\\n2 3 # there\n",
            SQUARE.replace('\n', "\r")
        );
        let mesh = mesh(&text);
        assert_eq!(mesh.positions().len(), 5);
        assert_eq!(mesh.triangles(), [[0, 1, 2]]);
    }

    #[test]
    fn names_in_latin_1_are_no_obstacle() {
        let bytes = [
            b"o caf\xe9\nmtllib \xff.mtl\n",
            SQUARE.as_bytes(),
            b"f 1 2 3\n",
        ]
        .concat();
        assert_eq!(
            read(Input::from_bytes("a.obj", bytes).unwrap())
                .unwrap()
                .triangle_count(),
            1
        );
    }

    #[test]
    fn what_is_not_finite_is_input() {
        let mesh = mesh("v nan -1.#IND 1.#INF\nv -inf +Inf infinity\nv 1 2 3 0\nf 1 2 3");
        assert!(mesh.positions()[0].x.is_nan() && mesh.positions()[0].y.is_nan());
        assert_eq!(mesh.positions()[0].z, f32::INFINITY);
        assert_eq!(
            mesh.positions()[1].to_array(),
            [f32::NEG_INFINITY, f32::INFINITY, f32::INFINITY]
        );
        assert_eq!(mesh.positions()[2].to_array(), [1.0, 2.0, 3.0]);
    }

    #[test]
    fn errors_name_the_line() {
        let expected =
            "a.obj:5: face uses vertex 5; expected one of the 4 vertices that the file has";
        assert_eq!(message(format!("{SQUARE}f 1 5 2\nf 1 2 3\n")), expected);
        let expected = "a.obj:2: 'v 1 x 0'; expected v and three numbers";
        assert_eq!(message("v 0 0 0\nv 1 x 0\nv 1 0\n"), expected);
        let expected = "a.obj:3: 'v \u{fffd} 0 0'; expected v and three numbers";
        assert_eq!(message(*b"#\n#\nv \xe9 0 0\n"), expected);
    }
}
