//! Mesh files: a path becomes an [`IndexedMesh`], and an [`IndexedMesh`] becomes a file.
//!
//! | format | read | written |
//! |---|---|---|
//! | PLY | ASCII, binary of both byte orders; polygons, triangle strips; properties of vertices, parts and texture coordinates of faces | binary little-endian, ASCII |
//! | OBJ | `v`, `vt`, `vn` and `f` lines; objects, groups and materials are one mesh | text |
//! | STL | binary, ASCII; every facet has three vertices of its own | binary, ASCII |
//! | OFF | OFF, COFF, NOFF, CNOFF, STOFF as text | text |
//! | glTF 2.0 | `.gltf` with data in itself or beside, `.glb`; the triangles of a scene are one mesh | the same, in one file |
//!
//! Files are read in blocks, from standard input as from disk. What a header promises sizes no
//! allocation beyond what the length of the file bears out. What a mesh carries beside positions are
//! its [attributes](IndexedMesh::attributes): what of a file is left behind is said there, and
//! [`cannot_carry`] says what a format has no place for, and [`without_copies`] what it has but at the
//! price of vertices that stand there several times.

mod blocks;
mod cannot_carry;
mod gltf;
mod gltf_accessor;
mod gltf_channels;
mod gltf_document;
mod gltf_materials;
mod gltf_parts;
#[cfg(test)]
mod gltf_tests;
mod gltf_write;
mod groups;
mod input;
mod obj;
mod obj_output;
mod off;
mod output;
mod ply;
mod ply_attributes;
mod ply_binary;
mod ply_header;
mod ply_output;
mod stl;
mod text;
mod wedges;

use std::fmt;
use std::io::{Read, Write};
use std::path::Path;
use std::str::FromStr;

use crate::error::{Error, Place, Result};
use crate::indexed_mesh::{IndexedMesh, MeshBuilder, PolygonMesh};

pub use cannot_carry::{cannot_carry, without_copies};
pub use output::{Abandoned, abandon_unfinished, check_place, write_file};

use input::Input;

/// A mesh file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, clap::ValueEnum)]
#[non_exhaustive]
pub enum Format {
    /// Stanford polygon format.
    Ply,
    /// Wavefront object.
    Obj,
    /// Stereolithography.
    Stl,
    /// Object file format (Geomview).
    Off,
    /// glTF 2.0 as JSON.
    Gltf,
    /// glTF 2.0, binary.
    Glb,
}

impl Format {
    /// Every format, in the order in which messages list them.
    pub const ALL: [Format; 6] = [
        Format::Ply,
        Format::Obj,
        Format::Stl,
        Format::Off,
        Format::Gltf,
        Format::Glb,
    ];

    /// The usual file name extension, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Format::Ply => "ply",
            Format::Obj => "obj",
            Format::Stl => "stl",
            Format::Off => "off",
            Format::Gltf => "gltf",
            Format::Glb => "glb",
        }
    }

    /// Whether it has room for what a mesh carries beside positions, if not for all of it.
    pub fn carries_attributes(self) -> bool {
        !matches!(self, Format::Stl | Format::Off)
    }

    /// The format that a path's extension names, in any letter case.
    pub fn from_extension(path: &Path) -> Option<Format> {
        path.extension()?.to_str()?.parse().ok()
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.extension())
    }
}

impl FromStr for Format {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Format::ALL
            .into_iter()
            .find(|format| name.eq_ignore_ascii_case(format.extension()))
            .ok_or_else(|| {
                Error::InvalidOptions(format!("no format '{name}'; expected {KNOWN_FORMATS}"))
            })
    }
}

/// What messages list where a format is none of ours.
const KNOWN_FORMATS: &str = "ply, obj, stl, off, gltf or glb";

/// How a mesh is read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReadOptions {
    /// The format, or `None` for the one that content or extension tell.
    pub format: Option<Format>,
    /// The scalar property of a PLY file's vertices that becomes their
    /// [weight](IndexedMesh::weights).
    pub vertex_weight: Option<String>,
    /// Whether to read what the mesh carries beside positions, too: normals, colours, texture
    /// coordinates, groups.
    pub attributes: bool,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            format: None,
            vertex_weight: None,
            attributes: true,
        }
    }
}

/// How a mesh is written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct WriteOptions {
    /// The format, or `None` for the one that the path's extension names.
    pub format: Option<Format>,
    /// Text where the format has both (PLY, STL).
    pub ascii: bool,
    /// Significant decimal digits of a coordinate in text, 1 to 17; `None` for as many as it takes
    /// to read back the same bits.
    pub precision: Option<usize>,
}

/// Reads a mesh from `path`, or from standard input where `path` is `-`.
///
/// Without a `format` the content decides where it is unmistakable (PLY's, OFF's and GLB's first word,
/// the length of a binary STL, `solid` … `facet`, `{` … `"asset"`), and the extension otherwise. A file
/// without faces is a mesh without triangles, not an error.
///
/// # Errors
/// [`Error::Io`] where the file cannot be read, [`Error::Parse`] where its content is not what its
/// format asks for, with the line or byte, or has not the weight asked for.
pub fn read(path: &Path, options: &ReadOptions) -> Result<IndexedMesh> {
    let mut builder = MeshBuilder::default();
    read_into(open(path)?, options, &mut builder)?;
    builder.finish()
}

/// Reads a mesh as [`read`] does, from any source of bytes: `name` stands for its path, in messages
/// and where an extension tells the format.
///
/// A source that counts its bytes tells how far reading is, and one that fails stops it.
///
/// `length` is how many bytes the source has, where that is known: it bounds what a header makes
/// room for, and tells a binary STL. A wrong one is found out as a wrong header is.
///
/// # Errors
/// As [`read`].
pub fn read_from(
    name: &Path,
    source: impl Read + 'static,
    length: Option<u64>,
    options: &ReadOptions,
) -> Result<IndexedMesh> {
    let mut builder = MeshBuilder::default();
    let input = Input::new(name.to_path_buf(), Box::new(source), length)?;
    read_into(input, options, &mut builder)?;
    builder.finish()
}

/// Reads a mesh as [`read`] does, its polygons left whole. Triangle strips are triangles; a vertex
/// weight is passed over.
///
/// # Errors
/// As [`read`].
pub fn read_polygons(path: &Path, options: &ReadOptions) -> Result<PolygonMesh> {
    let mut builder = MeshBuilder::of_polygons();
    let options = ReadOptions {
        attributes: false,
        ..options.clone()
    };
    read_into(open(path)?, &options, &mut builder)?;
    builder.finish_polygons()
}

/// The file at `path`, or standard input.
fn open(path: &Path) -> Result<Input> {
    if path == Path::new("-") {
        Input::stdin()
    } else {
        Input::open(path)
    }
}

/// Reads whatever the file holds into a mesh.
fn read_into(input: Input, options: &ReadOptions, builder: &mut MeshBuilder) -> Result<()> {
    input.refuse_stand_ins()?;
    let format = match options.format {
        Some(format) => format,
        None => input.detect_format()?,
    };
    let vertex_weight = options.vertex_weight.as_deref();
    if let Some(property) = vertex_weight.filter(|_| format != Format::Ply) {
        let found = format!("{format} has no vertex property '{property}'");
        return Err(input.error(
            Place::File,
            &found,
            "ply, where a vertex weight is asked for",
        ));
    }
    let attributes = options.attributes;
    match format {
        Format::Ply => {
            let wanted = ply::Wanted {
                vertex_weight,
                attributes,
            };
            ply::read(input, wanted, builder)
        }
        Format::Obj => obj::read(input, attributes, builder),
        Format::Stl => stl::read(input, builder),
        Format::Off => off::read(input, builder),
        Format::Gltf | Format::Glb => gltf::read(input, attributes, builder),
    }
}

/// Writes a mesh to `path`, or to standard output where `path` is `-`.
///
/// A file appears whole or not at all: it is written under another name beside its place and
/// renamed when it is complete. What is there already and no regular file (a device, a pipe) is
/// written to directly. A program that a signal ends calls [`abandon_unfinished`] before it exits,
/// or leaves the other name behind.
///
/// # Errors
/// [`Error::InvalidOptions`] where no format is given or named by the extension, or the precision
/// is out of range; [`Error::Io`] where writing fails.
pub fn write(path: &Path, mesh: &IndexedMesh, options: &WriteOptions) -> Result<()> {
    let format = output_format(path, options)?;
    output::write_file(path, |mut writer| {
        write_as(&mut writer, mesh, format, options)
    })
}

/// Writes a mesh as [`write()`] does, to any writer: `name` stands for its path, in messages and
/// where an extension tells the format. A writer that counts its bytes tells how far writing is, and
/// one that fails stops it.
///
/// # Errors
/// As [`write()`].
pub fn write_to(
    name: &Path,
    writer: &mut dyn Write,
    mesh: &IndexedMesh,
    options: &WriteOptions,
) -> Result<()> {
    let format = output_format(name, options)?;
    write_as(writer, mesh, format, options).map_err(|source| Error::Io {
        path: name.to_path_buf(),
        action: "cannot write",
        source,
    })
}

/// The format that [`write()`] would write to `path`: to be asked before the work that fills it.
///
/// # Errors
/// As [`write()`]'s [`Error::InvalidOptions`].
pub fn output_format(path: &Path, options: &WriteOptions) -> Result<Format> {
    let format = match options.format {
        Some(format) => format,
        None if path == Path::new("-") => {
            return Err(Error::InvalidOptions(format!(
                "standard output has no extension to tell the format; give --output-format \
                 {KNOWN_FORMATS}"
            )));
        }
        None => Format::from_extension(path).ok_or_else(|| {
            Error::InvalidOptions(format!(
                "{}: cannot tell the format to write from the extension; expected {KNOWN_FORMATS}, \
                 or --output-format",
                path.display()
            ))
        })?,
    };
    if options
        .precision
        .is_some_and(|digits| !(1..=17).contains(&digits))
    {
        return Err(Error::InvalidOptions(
            "precision is 1 to 17 significant digits".into(),
        ));
    }
    Ok(format)
}

/// Writes a mesh in `format`.
fn write_as(
    writer: &mut dyn Write,
    mesh: &IndexedMesh,
    format: Format,
    options: &WriteOptions,
) -> std::io::Result<()> {
    // What counts upwards in one format counts downwards in another.
    let v_is_down = matches!(format, Format::Gltf | Format::Glb);
    let turned = mesh.with_v_down(v_is_down);
    let mesh = turned.as_ref().unwrap_or(mesh);
    match format {
        Format::Ply if options.ascii => output::ply_ascii(writer, mesh, options.precision),
        Format::Ply => output::ply_binary(writer, mesh),
        Format::Obj => obj_output::obj(writer, mesh, options.precision),
        Format::Stl if options.ascii => output::stl_ascii(writer, mesh, options.precision),
        Format::Stl => output::stl_binary(writer, mesh),
        Format::Off => output::off(writer, mesh, options.precision),
        Format::Gltf => gltf_write::text(writer, mesh),
        Format::Glb => gltf_write::binary(writer, mesh),
    }
}

#[cfg(test)]
mod tests {
    use std::io::{Cursor, Read};

    use super::*;

    /// A quad and a triangle, 6 vertices, in every format and encoding that can be told by content or
    /// name.
    fn files() -> Vec<(&'static str, Vec<u8>)> {
        let positions = (0..6u8).map(|i| glam::Vec3::new(i.into(), f32::from(i * i), 0.5));
        let triangles = vec![[0, 1, 2], [0, 2, 3], [3, 4, 5]];
        let mesh = IndexedMesh::new(positions.collect(), triangles).unwrap();
        let encodings = [
            ("a.ply", false),
            ("b.ply", true),
            ("a.obj", false),
            ("a.stl", false),
            ("b.stl", true),
            ("a.off", false),
        ];
        let written = encodings.map(|(name, ascii)| {
            let options = WriteOptions {
                ascii,
                ..WriteOptions::default()
            };
            let mut bytes = Vec::new();
            let format = output_format(name.as_ref(), &options).unwrap();
            write_as(&mut bytes, &mesh, format, &options).unwrap();
            (name, bytes)
        });
        written.into()
    }

    fn read_as(name: &str, source: Box<dyn Read>, length: u64) -> Result<IndexedMesh> {
        let input = Input::new(name.into(), source, Some(length))?;
        let mut builder = MeshBuilder::default();
        read_into(input, &ReadOptions::default(), &mut builder)?;
        builder.finish()
    }

    /// Another program writes to the file while it is read, so that it has fewer bytes or more than it
    /// had when it was opened: the mesh that the bytes make, or an error of the file, in every format.
    #[test]
    fn a_file_may_grow_or_shrink_while_it_is_read() {
        for (name, bytes) in files() {
            let whole = bytes.len() as u64;
            for said in [
                0,
                1,
                84,
                whole / 2,
                whole - 1,
                whole + 1,
                3 * whole,
                1 << 20,
                u64::MAX,
            ] {
                let grown_or_shrunk = read_as(name, Box::new(Cursor::new(bytes.clone())), said);
                match grown_or_shrunk {
                    Ok(mesh) => assert_eq!(mesh.triangles().len(), 3, "{name}, {said}"),
                    Err(Error::Parse { .. }) => {}
                    Err(error) => panic!("{name}, {said} for {whole}: {error}"),
                }
            }
            for there in 0..bytes.len() {
                let shrunk = read_as(name, Box::new(Cursor::new(bytes[..there].to_vec())), whole);
                let is_well = match &shrunk {
                    Ok(mesh) => mesh.triangles().len() <= 3,
                    Err(error) => matches!(error, Error::Parse { .. }),
                };
                assert!(is_well, "{name}, {there} of {whole}: {shrunk:?}");
            }
        }
    }

    /// A disk that fails in the middle is an error of the file, with what the system said.
    #[test]
    fn a_file_that_cannot_be_read_to_its_end_is_an_error() {
        struct Broken;
        impl Read for Broken {
            fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
                Err(std::io::Error::other("bad sector"))
            }
        }
        for (name, bytes) in files() {
            let whole = bytes.len() as u64;
            for there in 0..bytes.len() {
                let source = Cursor::new(bytes[..there].to_vec()).chain(Broken);
                let error = read_as(name, Box::new(source), whole).unwrap_err();
                let message = error.to_string();
                assert_eq!(
                    message,
                    format!("{name}: cannot read: bad sector"),
                    "{there}"
                );
            }
        }
    }
}
