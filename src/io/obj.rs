//! Wavefront OBJ: `v` and `f` lines with the file's own vertex numbers, what their corners name of `vt`
//! and `vn`, and the `o`, `g` and `usemtl` that they stand behind.
//!
//! Line by line, not through tobj: that keeps more than 100 bytes a face until the end (room for
//! four corners of three `usize`), renumbers the vertices by first use, drops the unused ones, which
//! the report counts, and names no line in its errors. A test holds our numbers against its.

use std::collections::HashMap;

use crate::attributes::{Channel, Group, Kind, Values};
use crate::error::Result;
use crate::indexed_mesh::MeshBuilder;

use super::groups::{GroupTable, NAMES_TOO_LONG};
use super::input::Input;
use super::text::{Lines, count, name_of, parse_integer, parse_number, quote};
use super::wedges::{Rows, Wedges};

/// Reads an OBJ file into a mesh; of what it carries beside nothing unless `attributes`. A face of one or
/// two corners is none.
pub(super) fn read(input: Input, attributes: bool, builder: &mut MeshBuilder) -> Result<()> {
    let mut lines = Lines::new(input)?;
    let mut carried = attributes.then(Carried::new);
    let mut highest = Highest::default();
    let mut corners = Vec::new();
    let mut any = false;
    while lines.advance_continued()? {
        let mut words = lines.words();
        match words.next() {
            Some(b"v") => {
                any = true;
                builder.push_double(parse_vertex(&mut words, &lines)?);
                if let Some(carried) = &mut carried {
                    carried.take_color(words, builder.vertex_count());
                }
            }
            Some(b"f") => {
                any = true;
                let vertices = builder.vertex_count();
                corners.clear();
                let mut only_vertices = true;
                for word in words {
                    let (v, is_all) = parse_corner(word, vertices, &lines)?;
                    corners.push(v);
                    only_vertices &= is_all;
                }
                highest.see(&corners, lines.number());
                match &mut carried {
                    Some(carried) => carried.push_face(&lines, &corners, only_vertices, builder),
                    None => builder.push_polygon(&corners),
                }
            }
            Some(keyword) => {
                if let Some(carried) = &mut carried {
                    carried.take_line(keyword, &lines, builder)?;
                }
            }
            None => {}
        }
    }
    highest.check(builder.vertex_count(), &lines)?;
    if !any {
        return Err(lines.error_in_file("no line begins with v or f", "Wavefront OBJ"));
    }
    if let Some(carried) = carried {
        carried.finish(builder);
    }
    Ok(())
}

/// Three coordinates; `words` are left behind them.
fn parse_vertex<'a>(words: &mut impl Iterator<Item = &'a [u8]>, lines: &Lines) -> Result<[f64; 3]> {
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

/// A list of `vt` or `vn` lines.
struct List {
    keyword: &'static str,
    /// What it has rows of, in words.
    row: &'static str,
    /// The fewest numbers that a line must have.
    least: usize,
    /// The most numbers that a line had.
    width: usize,
    /// Behind the row of zeros for corners that name none.
    rows: Vec<[f32; 3]>,
}

impl List {
    fn new(keyword: &'static str, row: &'static str, least: usize) -> Self {
        List {
            keyword,
            row,
            least,
            width: least,
            rows: vec![[0.0; 3]],
        }
    }

    fn push(&mut self, lines: &Lines) -> Result<()> {
        let mut row = [0.0; 3];
        let mut width = 0;
        for (x, word) in row.iter_mut().zip(lines.words().skip(1)) {
            let Some(number) = parse_number(word) else {
                break;
            };
            *x = number as f32;
            width += 1;
        }
        let there = lines.words().skip(1).take(3).count();
        if width < self.least || width < there {
            let line: Vec<_> = lines.words().take(4).collect();
            let expected = match self.least {
                1 => "and one to three numbers",
                _ => "and three numbers",
            };
            let expected = format!("{} {expected}", self.keyword);
            return Err(lines.error(&quote(&line.join(&b' ')), &expected));
        }
        self.width = self.width.max(width);
        self.rows.push(row);
        Ok(())
    }

    /// The row of a corner, counted from 1; 0 where it names none that can be. A positive number may
    /// stand for a line to come.
    fn number(&self, word: Option<&[u8]>) -> u32 {
        let index = word.and_then(parse_integer).unwrap_or(0);
        let from_one = match index {
            0.. => index,
            _ => index.saturating_add(self.rows.len() as i64).max(0),
        };
        u32::try_from(from_one).unwrap_or(u32::MAX)
    }
}

/// What a file carries beside positions, while it is read.
struct Carried {
    texture_coordinates: List,
    normals: List,
    /// From the first corner on that names more than a vertex.
    wedges: Option<Wedges>,
    wedges_of_face: Vec<u32>,
    /// Those of the vertices so far, from the first that has one on.
    colors: Vec<[f32; 3]>,
    vertices_without_color: usize,
    names: Names,
    groups: Option<Groups>,
}

/// What the faces to come belong to.
struct Groups {
    /// The numbers of the names of object, groups and material.
    current: [u32; 3],
    /// Whether the last face was of that.
    is_begun: bool,
    table: GroupTable<[u32; 3]>,
}

/// Names by numbers; 0 is none.
struct Names {
    numbers: HashMap<String, u32>,
    list: Vec<String>,
}

impl Names {
    fn number(&mut self, name: String) -> u32 {
        let next = self.list.len() as u32;
        *self.numbers.entry(name).or_insert_with_key(|name| {
            self.list.push(name.clone());
            next
        })
    }
}

impl Carried {
    fn new() -> Self {
        let mut names = Names {
            numbers: HashMap::new(),
            list: Vec::new(),
        };
        names.number(String::new());
        Carried {
            texture_coordinates: List::new("vt", "texture coordinate", 1),
            normals: List::new("vn", "normal", 3),
            wedges: None,
            wedges_of_face: Vec::new(),
            colors: Vec::new(),
            vertices_without_color: 0,
            names,
            groups: None,
        }
    }

    /// Takes the colour behind the coordinates of the last of so many vertices. What is no three numbers
    /// is none, as a weight is.
    fn take_color<'a>(&mut self, words: impl Iterator<Item = &'a [u8]>, vertices: usize) {
        let mut words = words.peekable();
        if self.colors.is_empty() && words.peek().is_none() {
            return;
        }
        let mut color = [WHITE; 3];
        let mut numbers = words.take(3).map_while(parse_number);
        let found = color.iter_mut().zip(&mut numbers);
        let found = found.map(|(x, number)| *x = number as f32).count();
        if found == 3 {
            if self.colors.is_empty() {
                self.vertices_without_color = vertices - 1;
            }
            self.colors.resize(vertices - 1, [WHITE; 3]);
            self.colors.push(color);
        } else if !self.colors.is_empty() {
            self.vertices_without_color += 1;
        }
    }

    /// Takes a line that is neither vertex nor face.
    fn take_line(
        &mut self,
        keyword: &[u8],
        lines: &Lines,
        builder: &mut MeshBuilder,
    ) -> Result<()> {
        match keyword {
            b"vt" => self.texture_coordinates.push(lines)?,
            b"vn" => self.normals.push(lines)?,
            b"o" => self.begin(0, lines, builder),
            b"g" => self.begin(1, lines, builder),
            b"usemtl" => self.begin(2, lines, builder),
            b"mtllib" => {
                let libraries = &mut builder.attributes().material_libraries;
                let library = rest_of(lines);
                if !library.is_empty() && libraries.last() != Some(&library) {
                    libraries.push(library);
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Lets the faces to come be of the object (0), the groups (1) or the material (2) of this line.
    fn begin(&mut self, which: usize, lines: &Lines, builder: &mut MeshBuilder) {
        let name = self.names.number(rest_of(lines));
        let groups = self.groups.get_or_insert_with(|| {
            let mut groups = Groups {
                current: [0; 3],
                is_begun: false,
                table: GroupTable::new(),
            };
            if builder.face_count() > 0 {
                groups.begin(&self.names, builder);
            }
            groups
        });
        if groups.current[which] != name {
            groups.current[which] = name;
            groups.is_begun = false;
        }
    }

    /// Adds the face of the current line.
    fn push_face(
        &mut self,
        lines: &Lines,
        corners: &[u32],
        only_vertices: bool,
        builder: &mut MeshBuilder,
    ) {
        if corners.len() < 3 {
            return;
        }
        if let Some(groups) = &mut self.groups
            && !groups.is_begun
        {
            groups.begin(&self.names, builder);
        }
        let vertices = builder.vertex_count();
        if self.wedges.is_none() && !only_vertices {
            let mut wedges = Wedges::default();
            let mut of = |&v: &u32| wedges.of(v, [0; 2], vertices);
            let so_far = builder.triangles().iter();
            let so_far = so_far.map(|corners| corners.each_ref().map(&mut of));
            builder.attributes().corners = so_far.collect();
            self.wedges = Some(wedges);
        }
        let Some(wedges) = &mut self.wedges else {
            builder.push_polygon(corners);
            return;
        };
        self.wedges_of_face.clear();
        for (word, &v) in lines.words().skip(1).zip(corners) {
            let mut numbers = word.split(|&b| b == b'/').skip(1);
            let rows = [&self.texture_coordinates, &self.normals].map(|l| l.number(numbers.next()));
            self.wedges_of_face.push(wedges.of(v, rows, vertices));
        }
        builder.push_polygon_with(corners, &self.wedges_of_face);
    }

    /// Makes channels of what was found.
    fn finish(mut self, builder: &mut MeshBuilder) {
        let vertices = builder.vertex_count();
        let attributes = builder.attributes();
        let notices = &mut attributes.notices;
        let mut wedges: Vec<(u32, Rows)> = match self.wedges {
            Some(wedges) => wedges.number(vertices, &mut attributes.corners),
            None => (0..vertices as u32).map(|v| (v, [0; 2])).collect(),
        };
        let lists = [&self.texture_coordinates, &self.normals];
        for (k, list) in lists.into_iter().enumerate() {
            let is_there =
                |wedge: &(u32, Rows)| (1..list.rows.len()).contains(&(wedge.1[k] as usize));
            if !attributes
                .corners
                .as_flattened()
                .iter()
                .any(|&w| is_there(&wedges[w as usize]))
            {
                let is_named = wedges.iter().any(|wedge| wedge.1[k] != 0);
                if is_named {
                    let row = list.row;
                    notices.push(format!("faces name {row}s, but none that the file has"));
                }
                continue;
            }
            let corners = attributes.corners.as_flattened().iter();
            let without = corners.filter(|&&w| !is_there(&wedges[w as usize])).count();
            if without > 0 {
                let corners = count(without, "corner", "corners");
                notices.push(format!("{corners} without {} got zeros", list.row));
            }
            for wedge in wedges.iter_mut() {
                if !is_there(wedge) {
                    wedge.1[k] = 0;
                }
            }
            let (kind, names): (_, &[&str]) = match (k, list.width) {
                (0, 1) => (Kind::TextureCoordinate, &["texture_u"]),
                (0, 2) => (Kind::TextureCoordinate, &["s", "t"]),
                (0, _) => (
                    Kind::TextureCoordinate,
                    &["texture_u", "texture_v", "texture_w"],
                ),
                _ => (Kind::Normal, &["nx", "ny", "nz"]),
            };
            let mut channel = Channel::of_singles(kind, names);
            channel.is_by_corner = true;
            let row = |wedge: &(u32, Rows)| &list.rows[wedge.1[k] as usize][..list.width];
            channel.values = Values::Singles(wedges.iter().flat_map(row).copied().collect());
            attributes.channels.push(channel);
        }
        if !self.colors.is_empty() {
            self.colors.resize(vertices, [WHITE; 3]);
            if self.vertices_without_color > 0 {
                let without = count(self.vertices_without_color, "vertex", "vertices");
                notices.push(format!("{without} without colour became white"));
            }
            let mut channel = Channel::of_singles(Kind::Color, &["red", "green", "blue"]);
            let color = |wedge: &(u32, Rows)| self.colors[wedge.0 as usize];
            channel.values = Values::Singles(wedges.iter().flat_map(color).collect());
            attributes.channels.push(channel);
        }
        if self.groups.is_some_and(|groups| groups.table.is_given_up()) {
            notices.push(NAMES_TOO_LONG.to_string());
        }
    }
}

/// Each component of the colour of a vertex without one, as viewers have it.
const WHITE: f32 = 1.0;

impl Groups {
    /// Lets the faces to come be of the current names.
    fn begin(&mut self, names: &Names, builder: &mut MeshBuilder) {
        self.is_begun = true;
        let name = |i: usize| names.list[self.current[i] as usize].clone();
        let group = || Group {
            object: name(0),
            name: name(1),
            material: name(2),
            values: Vec::new(),
        };
        let groups = &mut builder.attributes().groups;
        if let Some(number) = self.table.find(self.current, groups, group) {
            builder.begin_group(number);
        }
    }
}

/// What stands behind the first word of the current line: a name, with the blanks that are in it. What is
/// no UTF-8 is taken for Latin-1.
fn rest_of(lines: &Lines) -> String {
    let line = lines.line().trim_ascii();
    let word = line.iter().position(u8::is_ascii_whitespace);
    let rest = line[word.unwrap_or(line.len())..].trim_ascii();
    match std::str::from_utf8(rest) {
        Ok(name) => name_of(name),
        Err(_) => name_of(&rest.iter().copied().map(char::from).collect::<String>()),
    }
}

/// The vertex of a corner `v`, `v/vt`, `v//vn` or `v/vt/vn`, counted from 0, and whether the word names no more.
///
/// A positive one may stand in a later line, so only the end of the file tells whether it is there.
fn parse_corner(word: &[u8], vertices: usize, lines: &Lines) -> Result<(u32, bool)> {
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
    let vertex = u32::try_from(from_zero).map_err(|_| {
        let expected = match vertices {
            0 => "a vertex before the face".to_string(),
            1 => "-1, the only vertex before the face".to_string(),
            n => format!("-1 to -{n}, the vertices before the face"),
        };
        lines.error(&format!("face uses vertex {index}"), &expected)
    })?;
    Ok((vertex, v.len() == word.len()))
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
        super::read(input, true, &mut builder)?;
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
