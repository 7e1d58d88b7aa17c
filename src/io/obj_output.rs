//! Writing OBJ files.

use std::io::{self, Write};

use crate::attributes::{Attributes, Channel, Group, Kind};
use crate::indexed_mesh::IndexedMesh;

use super::output::write_point;
use super::text::{without_control, write_number};
use super::wedges::{DistinctRows, Vertices};

/// What an OBJ file has room for: of each kind one channel.
pub(super) struct ObjChannels<'a> {
    pub texture_coordinates: Option<&'a Channel>,
    pub normals: Option<&'a Channel>,
    pub colors: Option<&'a Channel>,
}

impl<'a> ObjChannels<'a> {
    /// The first of each kind.
    pub fn of(attributes: &'a Attributes) -> Self {
        let find = |kind: Kind, widths: std::ops::RangeInclusive<usize>| {
            let is_it = |c: &&Channel| c.kind == kind && widths.contains(&c.width());
            attributes.channels.iter().find(is_it)
        };
        ObjChannels {
            texture_coordinates: find(Kind::TextureCoordinate, 1..=3),
            normals: find(Kind::Normal, 3..=3),
            colors: find(Kind::Color, 3..=4),
        }
    }

    /// Whether a channel is one of them.
    pub fn contains(&self, channel: &Channel) -> bool {
        let all = [self.texture_coordinates, self.normals, self.colors];
        all.into_iter()
            .flatten()
            .any(|one| std::ptr::eq(one, channel))
    }
}

/// Writes an OBJ file. Faces keep their order, and what they belong to changes along it. Colours stand
/// behind positions, from 0 to 1; where they differ within a vertex, the file has copies of the vertex.
/// The back of a double-sided triangle has what the front has, its normals too.
pub(super) fn obj(
    writer: &mut dyn Write,
    mesh: &IndexedMesh,
    digits: Option<usize>,
) -> io::Result<()> {
    let attributes = mesh.attributes();
    if attributes.is_empty() {
        return bare(writer, mesh, digits);
    }
    for library in &attributes.material_libraries {
        write_name(writer, "mtllib", library)?;
    }
    let channels = ObjChannels::of(attributes);
    let colors: Vec<&Channel> = channels.colors.into_iter().collect();
    let vertices = Vertices::of(mesh, &colors);
    for (v, wedge) in vertices.iter(mesh.positions().len()) {
        writer.write_all(b"v ")?;
        write_point(writer, mesh, v, digits)?;
        if let Some(colors) = channels.colors {
            write_color(writer, colors, wedge, digits)?;
        }
        writer.write_all(b"\n")?;
    }
    let lists = [
        ("vt", channels.texture_coordinates),
        ("vn", channels.normals),
    ];
    let mut numbers = [Vec::new(), Vec::new()];
    for ((keyword, channel), numbers) in lists.into_iter().zip(&mut numbers) {
        if let Some(channel) = channel {
            let rows = DistinctRows::of(channel);
            for wedge in rows.wedges {
                writer.write_all(keyword.as_bytes())?;
                for (x, component) in channel.row(wedge as usize).zip(&channel.components) {
                    writer.write_all(b" ")?;
                    write_number(writer, x, component.number.fits_single(), digits)?;
                }
                writer.write_all(b"\n")?;
            }
            *numbers = rows.numbers;
        }
    }
    let mut last = &Group::default();
    for (i, corners) in vertices.triangles.iter().enumerate() {
        if let Some(&group) = attributes.group_of.get(i) {
            let group = &attributes.groups[group as usize];
            write_changes(writer, last, group)?;
            last = group;
        }
        let back = mesh.is_double_sided(i).then_some([0, 2, 1]);
        for order in std::iter::once([0, 1, 2]).chain(back) {
            writer.write_all(b"f")?;
            for k in order {
                let v = u64::from(corners[k]) + 1;
                let wedge = || attributes.corners[i][k] as usize;
                let [t, n] = &numbers;
                match (t.is_empty(), n.is_empty()) {
                    (true, true) => write!(writer, " {v}")?,
                    (false, true) => write!(writer, " {v}/{}", t[wedge()] + 1)?,
                    (true, false) => write!(writer, " {v}//{}", n[wedge()] + 1)?,
                    (false, false) => write!(writer, " {v}/{}/{}", t[wedge()] + 1, n[wedge()] + 1)?,
                }
            }
            writer.write_all(b"\n")?;
        }
    }
    Ok(())
}

/// Writes a mesh that carries nothing.
fn bare(writer: &mut dyn Write, mesh: &IndexedMesh, digits: Option<usize>) -> io::Result<()> {
    for v in 0..mesh.positions().len() {
        writer.write_all(b"v ")?;
        write_point(writer, mesh, v, digits)?;
        writer.write_all(b"\n")?;
    }
    for [a, b, c] in mesh.sides() {
        let from_one = |v| u64::from(v) + 1;
        writeln!(writer, "f {} {} {}", from_one(a), from_one(b), from_one(c))?;
    }
    Ok(())
}

/// Writes the lines that lead from one group to another.
fn write_changes(writer: &mut dyn Write, last: &Group, group: &Group) -> io::Result<()> {
    for (keyword, old, new) in [
        ("o", &last.object, &group.object),
        ("g", &last.name, &group.name),
        ("usemtl", &last.material, &group.material),
    ] {
        if old != new {
            write_name(writer, keyword, new)?;
        }
    }
    Ok(())
}

fn write_name(writer: &mut dyn Write, keyword: &str, name: &str) -> io::Result<()> {
    let name: String = without_control(name).collect();
    // A backslash at the end of the line would join it with the next one.
    let end = if name.ends_with('\\') { " " } else { "" };
    let blank = if name.is_empty() { "" } else { " " };
    writeln!(writer, "{keyword}{blank}{name}{end}")
}

fn write_color(
    writer: &mut dyn Write,
    colors: &Channel,
    wedge: Option<u32>,
    digits: Option<usize>,
) -> io::Result<()> {
    for (k, component) in colors.components.iter().enumerate().take(3) {
        let value = wedge.map_or(0.0, |w| colors.values.get(w as usize * colors.width() + k));
        let most = component.number.range().map_or(1.0, |(_, most)| most);
        writer.write_all(b" ")?;
        write_number(writer, value / most, component.number.fits_single(), digits)?;
    }
    Ok(())
}
