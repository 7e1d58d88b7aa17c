//! Readers, and what must hold of whatever they answer.

use std::io::{Cursor, Read};
use std::path::Path;

use decimate::attributes::Attributes;
use decimate::error::{Error, Result};
use decimate::indexed_mesh::IndexedMesh;
use decimate::io::{self, Format, ReadOptions};

pub use peak_alloc::PeakAlloc;

/// What a reader may hold: its buffers, and so many bytes for each of the file. A face list of
/// one-byte numbers makes a triangle of 12 bytes from each, in an array that doubles: 36 and the
/// list itself.
const BUFFER_BYTES: usize = 4 << 20;
const BYTES_A_BYTE: usize = 48;
/// The same of glTF, whose objects of three bytes, `{}` and a comma, become nodes and the like; what
/// its nodes make of a mesh comes on top, several times while it grows.
const GLTF_BYTES_A_BYTE: usize = 256;
const GLTF_BYTES_A_BYTE_OF_MESH: usize = 4;

/// In characters: two halves of at most a thousand each, and the file's name.
const LONGEST_MESSAGE: usize = 2100;

/// Reads bytes as a file of one format in every way there is, and compares the answers.
///
/// # Panics
/// Where an answer is not what it should be.
pub fn attack_reader(format: Format, bytes: &[u8], heap: &PeakAlloc) {
    let length = Some(bytes.len() as u64);
    let before = heap.current_usage();
    heap.reset_peak_usage();
    let whole = read(format, Cursor::new(bytes.to_vec()), length, None);
    let held = heap.peak_usage().saturating_sub(before);
    let most = match format {
        Format::Gltf | Format::Glb => {
            let mesh = whole.as_ref().map_or(0, IndexedMesh::bytes);
            BUFFER_BYTES + GLTF_BYTES_A_BYTE * bytes.len() + GLTF_BYTES_A_BYTE_OF_MESH * mesh
        }
        _ => BUFFER_BYTES + BYTES_A_BYTE * bytes.len(),
    };
    assert!(held <= most, "{held} bytes held for {}", bytes.len());
    check_answer(&whole, format);

    let stream = read(format, Pieces(Cursor::new(bytes.to_vec())), None, None);
    check_answer(&stream, format);
    // Only its length tells a binary STL that begins as text does.
    if format != Format::Stl {
        assert_eq!(told(&whole), told(&stream), "a file against a stream of it");
    }

    for weight in ["x", "quality"].map(|name| Some(name.to_string())) {
        let weighted = read(format, Cursor::new(bytes.to_vec()), length, weight);
        check_answer(&weighted, format);
        if let (Ok(weighted), Ok(plain)) = (&weighted, &whole) {
            assert_eq!(weighted.triangles(), plain.triangles());
        }
    }

    let options = ReadOptions {
        format: Some(format),
        attributes: false,
        ..ReadOptions::default()
    };
    let bare = io::read_from(
        Path::new(NAME),
        Cursor::new(bytes.to_vec()),
        length,
        &options,
    );
    check_answer(&bare, format);
    if let (Ok(bare), Ok(whole)) = (&bare, &whole) {
        assert_eq!(bare.triangles(), whole.triangles(), "without attributes");
        assert_eq!(bare.attributes(), &Attributes::default());
    }
}

fn read(
    format: Format,
    source: impl Read + 'static,
    length: Option<u64>,
    vertex_weight: Option<String>,
) -> Result<IndexedMesh> {
    let options = ReadOptions {
        format: Some(format),
        vertex_weight,
        ..ReadOptions::default()
    };
    io::read_from(Path::new(NAME), source, length, &options)
}

/// What messages call the file.
const NAME: &str = "some.file";

/// Gives seven bytes at a time, which no number, word or line fits.
struct Pieces(Cursor<Vec<u8>>);

impl Read for Pieces {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let n = buffer.len().min(7);
        self.0.read(&mut buffer[..n])
    }
}

/// A mesh has only vertices that are there, and an error is about the file: named, in one short line
/// that says what is expected.
///
/// # Panics
/// Otherwise.
pub fn check_answer(answer: &Result<IndexedMesh>, format: Format) {
    match answer {
        Ok(mesh) => {
            let n = mesh.positions().len();
            let is_there = |&v: &u32| (v as usize) < n;
            assert!(mesh.triangles().iter().flatten().all(is_there));
            let attributes = mesh.attributes().clone();
            let checked = mesh.clone().with_attributes(attributes);
            checked.expect("what a mesh carries fits it");
            for notice in &mesh.attributes().notices {
                assert!(!notice.contains(char::is_control), "{notice:?}");
                assert!(notice.chars().count() <= LONGEST_MESSAGE, "{notice:?}");
            }
        }
        Err(
            error @ Error::Parse {
                found, expected, ..
            },
        ) => {
            let message = error.to_string();
            assert!(message.starts_with(NAME), "{format}: {message:?}");
            assert!(!found.is_empty() && !expected.is_empty(), "{message:?}");
            assert!(!message.contains(char::is_control), "{message:?}");
            assert!(message.chars().count() <= LONGEST_MESSAGE, "{message:?}");
        }
        Err(error) => panic!("{format}: {error:?} is not about the file"),
    }
}

/// An answer in a form that is equal where it says the same: NaN is equal to itself.
fn told(
    answer: &Result<IndexedMesh>,
) -> std::result::Result<(Vec<[u32; 3]>, Vec<[u64; 3]>, String), String> {
    match answer {
        Ok(mesh) => {
            let bits = mesh.points().map(|p| p.to_array().map(f64::to_bits));
            let carried = format!("{:?}", mesh.attributes());
            Ok((mesh.triangles().to_vec(), bits.collect(), carried))
        }
        Err(error) => Err(error.to_string()),
    }
}
