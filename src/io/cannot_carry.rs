//! What a format has no place for.

use crate::attributes::{Channel, Group, Kind};
use crate::indexed_mesh::IndexedMesh;

use super::Format;
use super::gltf_write;
use super::obj_output::ObjChannels;
use super::ply_output::{Columns, listed};
use super::text::one_line;
use super::wedges::has_seam;

/// What a file of `format` will not have of a mesh, in short sentences.
pub fn cannot_carry(mesh: &IndexedMesh, format: Format) -> Vec<String> {
    let attributes = mesh.attributes();
    let mut lost = Vec::new();
    match format {
        Format::Ply => {
            let columns = Columns::of(attributes);
            if !columns.has_comments {
                lost.push("names that take so much room".to_string());
            }
            let properties = attributes.face_properties.iter().enumerate();
            let properties = properties.filter(|&(i, _)| !columns.has_value(i));
            lost.extend(properties.map(|(_, p)| format!("two face properties '{}'", p.name)));
        }
        Format::Obj => {
            let channels = ObjChannels::of(attributes);
            let others = attributes.channels.iter().filter(|c| !channels.contains(c));
            lost.extend(others.map(described));
            if let Some(alpha) = channels.colors.and_then(|c| c.components.get(3)) {
                lost.push(format!("vertex property '{}'", alpha.name));
            }
            lost.extend(face_properties(mesh));
            lost.extend(some(&attributes.textures, "texture files"));
        }
        Format::Gltf | Format::Glb => {
            lost.extend(gltf_write::lost(attributes));
            lost.extend(face_properties(mesh));
            let has_name = attributes.groups.iter().any(|g| !g.name.is_empty());
            lost.extend(has_name.then(|| "groups".to_string()));
            lost.extend(some(&attributes.material_libraries, "material libraries"));
            lost.extend(some(&attributes.textures, "texture files"));
        }
        Format::Stl | Format::Off => {
            lost.extend(attributes.channels.iter().map(described));
            lost.extend(face_properties(mesh));
            type Name = fn(&Group) -> &String;
            let names: [(Name, &str); 3] = [
                (|g| &g.object, "objects"),
                (|g| &g.name, "groups"),
                (|g| &g.material, "materials"),
            ];
            for (name, what) in names {
                let has_name = attributes.groups.iter().any(|g| !name(g).is_empty());
                lost.extend(has_name.then(|| what.to_string()));
            }
            lost.extend(some(&attributes.material_libraries, "material libraries"));
            lost.extend(some(&attributes.textures, "texture files"));
        }
    }
    if !matches!(format, Format::Gltf | Format::Glb) && attributes.assets.is_some() {
        lost.push("what materials look like".to_string());
    }
    let sentence = |what: &String| one_line(&format!("{format} has no place for {what}"));
    lost.iter().map(sentence).collect()
}

/// The mesh without what a file of `format` could have but with copies of vertices, as if it were cut
/// there; and what that is, in short sentences.
pub fn without_copies(mesh: IndexedMesh, format: Format) -> (IndexedMesh, Vec<String>) {
    let attributes = mesh.attributes();
    let list = (format == Format::Ply).then(|| listed(&mesh)).flatten();
    let of_obj = ObjChannels::of(attributes);
    let needs_copies = |i: usize, channel: &Channel| {
        let is_by_vertex = match format {
            Format::Ply => list != Some(i),
            Format::Obj => of_obj.colors.is_some_and(|c| std::ptr::eq(c, channel)),
            Format::Gltf | Format::Glb => true,
            Format::Stl | Format::Off => false,
        };
        is_by_vertex && has_seam(&mesh, channel)
    };
    let channels = attributes.channels.iter().enumerate();
    let is_lost: Vec<bool> = channels.map(|(i, c)| needs_copies(i, c)).collect();
    // A part of a glTF file has vertices of its own.
    let loses_groups = matches!(format, Format::Gltf | Format::Glb) && attributes.groups.len() > 1;
    let lost_channels = attributes.channels.iter().zip(&is_lost);
    let lost_channels = lost_channels.filter(|(_, lost)| **lost);
    let mut lost: Vec<String> = lost_channels
        .map(|(channel, _)| described(channel))
        .collect();
    lost.extend(loses_groups.then(|| "groups and materials".to_string()));
    let mut parts = mesh.into_parts();
    let attributes = &mut parts.attributes;
    let mut flags = is_lost.iter();
    attributes.channels.retain(|_| flags.next() == Some(&false));
    if attributes.channels.is_empty() {
        attributes.corners = Vec::new();
    }
    if loses_groups {
        attributes.groups = Vec::new();
        attributes.group_of = Vec::new();
        attributes.assets = None;
    }
    attributes.merge_equal_wedges(&parts.triangles);
    let sentence = |what: &String| {
        one_line(&format!(
            "{format} would have copies of vertices for {what}"
        ))
    };
    let lost = lost.iter().map(sentence).collect();
    (IndexedMesh::from_valid(parts), lost)
}

fn described(channel: &Channel) -> String {
    let names: Vec<&str> = channel.components.iter().map(|p| p.name.as_str()).collect();
    let what = match channel.kind {
        Kind::Normal => "normals",
        Kind::TextureCoordinate => "texture coordinates",
        Kind::Color => "colours",
        Kind::Scalar => return format!("vertex property '{}'", names.join(" ")),
    };
    format!("{what} ({})", names.join(", "))
}

fn face_properties(mesh: &IndexedMesh) -> impl Iterator<Item = String> + '_ {
    let properties = mesh.attributes().face_properties.iter();
    properties.map(|p| format!("face property '{}'", p.name))
}

fn some(list: &[String], what: &str) -> Option<String> {
    (!list.is_empty()).then(|| what.to_string())
}
