//! Wavefront OBJ: the `v` and `f` lines, as one mesh with the file's own vertex numbers.
//!
//! Line by line, not through tobj: that keeps more than 100 bytes a face until the end (room for
//! four corners of three `usize`), renumbers the vertices by first use, drops the unused ones, which
//! the report counts, and names no line in its errors. A test holds our numbers against its.

use crate::error::Result;
use crate::indexed_mesh::MeshBuilder;

use super::input::Input;
use super::text::{Lines, count, parse_integer, parse_number, quote};

/// Reads an OBJ file into a mesh. Groups, objects, materials, normals and texture coordinates are skipped;
/// a face of one or two corners is none.
pub(super) fn read(input: Input, builder: &mut MeshBuilder) -> Result<()> {
    let mut lines = Lines::new(input)?;
    let mut highest = Highest::default();
    let mut corners = Vec::new();
    let mut any = false;
    while lines.advance_continued()? {
        let mut words = lines.words();
        match words.next() {
            Some(b"v") => {
                any = true;
                builder.push_double(parse_vertex(words, &lines)?);
            }
            Some(b"f") => {
                any = true;
                let vertices = builder.vertex_count();
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
    highest.check(builder.vertex_count(), &lines)?;
    if !any {
        return Err(lines.error_in_file("no line begins with v or f", "Wavefront OBJ"));
    }
    Ok(())
}

/// Three coordinates; a weight or a colour behind them is dropped.
fn parse_vertex<'a>(words: impl Iterator<Item = &'a [u8]>, lines: &Lines) -> Result<[f64; 3]> {
    let mut position = [0.0; 3];
    let mut numbers = words.take(3).map(parse_number);
    for x in &mut position {
        *x = numbers.next().flatten().ok_or_else(|| {
            let vertex: Vec<_> = lines.words().take(4).collect();
            lines.error(&quote(&vertex.join(&b' ')), "v and three numbers")
        })?;
    }
    Ok(position)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::indexed_mesh::IndexedMesh;

    fn read(input: Input) -> Result<IndexedMesh> {
        let mut builder = MeshBuilder::default();
        super::read(input, &mut builder)?;
        builder.finish()
    }

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

    /// Numbered by first use they would come as 4, 2, 3.
    #[test]
    fn vertices_keep_their_order_and_the_unused_stay() {
        let mesh = mesh("v 9 9 9\nf 4 2 3\nv 1 0 0\nv 2 0 0\nv 3 0 0\nv 8 8 8\n");
        assert_eq!(mesh.triangles(), [[3, 1, 2]]);
        let x: Vec<_> = mesh.positions().iter().map(|p| p.x).collect();
        assert_eq!(x, [9.0, 1.0, 2.0, 3.0, 8.0]);
    }

    /// Numbers of every length and spelling; the face of one corner behind each vertex makes tobj
    /// keep it, in its order.
    #[test]
    fn tobj_reads_the_same_numbers() {
        let number = |i: usize| match i % 7 {
            0 => format!("{}", i as f64 / 7.0),
            1 => format!("-{}.{:03}", i % 11, i * 37 % 1000),
            2 => format!("{:e}", (i as f64).sqrt()),
            3 => format!("{i}."),
            4 => format!(".{i}"),
            5 => format!("+{}", i as f32 / 3.0),
            _ => format!("{:.20}", 1.0 / (1.0 + i as f64)),
        };
        let mut text = String::new();
        for v in 0..4000 {
            let [x, y, z] = [3 * v, 3 * v + 1, 3 * v + 2].map(number);
            text += &format!("v {x} {y} {z}\nf -1\n");
        }
        let no_materials = |_: &std::path::Path| Err(tobj::LoadError::OpenFileFailed);
        let options = tobj::LoadOptions::default();
        let theirs = tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials);
        let theirs = &theirs.unwrap().0[0].mesh.positions;
        let theirs = theirs.iter().map(|&x| (x as f32).to_bits());
        let ours = mesh(&text);
        let ours = ours.positions().iter().flat_map(|p| p.to_array());
        assert!(ours.map(f32::to_bits).eq(theirs));
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
