//! An open mesh file: where its bytes come from, what it is called, what its first bytes say.

use std::fs::File;
use std::io::{BufReader, Cursor, Read};
use std::path::{Path, PathBuf};

use crate::error::{Error, Place, Result};

use super::text::one_line;
use super::{Format, KNOWN_FORMATS, gltf, off, stl};

/// How much is read at a time.
const BLOCK_BYTES: usize = 1 << 18;
/// How much of a file is looked at to tell its format.
const HEAD_BYTES: u64 = 4096;

/// A mesh file, open for reading from its first byte.
pub(super) struct Input {
    /// What messages call it.
    pub file: PathBuf,
    /// Its bytes, in blocks.
    pub reader: BufReader<Box<dyn Read>>,
    /// A copy of its first bytes.
    pub head: Vec<u8>,
    /// Its length in bytes, where it is known before the end.
    pub length: Option<u64>,
    /// The folder it lies in, if it is a file that may name others.
    pub folder: Option<PathBuf>,
}

impl Input {
    /// Opens a file.
    pub fn open(path: &Path) -> Result<Self> {
        let cannot = |action| {
            move |source| Error::Io {
                path: path.to_path_buf(),
                action,
                source,
            }
        };
        let file = File::open(path).map_err(cannot("cannot open"))?;
        let metadata = file.metadata().map_err(cannot("cannot open"))?;
        let length = metadata.is_file().then_some(metadata.len());
        let mut input = Self::new(path.to_path_buf(), Box::new(file), length)?;
        input.folder = path.parent().map(Path::to_path_buf);
        Ok(input)
    }

    /// Standard input.
    pub fn stdin() -> Result<Self> {
        Self::new("<stdin>".into(), Box::new(std::io::stdin().lock()), None)
    }

    /// Any source of bytes. An empty one is an error.
    pub fn new(file: PathBuf, mut source: Box<dyn Read>, length: Option<u64>) -> Result<Self> {
        let mut head = Vec::new();
        if let Err(source) = (&mut source).take(HEAD_BYTES).read_to_end(&mut head) {
            return Err(Error::Io {
                path: file,
                action: "cannot read",
                source,
            });
        }
        let whole: Box<dyn Read> = Box::new(Cursor::new(head.clone()).chain(source));
        let reader = BufReader::with_capacity(BLOCK_BYTES, whole);
        let input = Input {
            file,
            reader,
            head,
            length,
            folder: None,
        };
        if input.head.is_empty() {
            return Err(input.error(Place::File, "the file is empty", "a mesh"));
        }
        Ok(input)
    }

    /// The format, by content where that is unmistakable, else by extension.
    pub fn detect_format(&self) -> Result<Format> {
        if let Some(format) = self.format_by_content() {
            return Ok(format);
        }
        if let Some(format) = Format::from_extension(&self.file) {
            return Ok(format);
        }
        Err(self.error(
            Place::File,
            "neither the content nor the name tells the format",
            &format!("{KNOWN_FORMATS}; --input-format names it"),
        ))
    }

    fn format_by_content(&self) -> Option<Format> {
        let head = self.head.as_slice();
        if head.starts_with(b"ply") && head.get(3).is_none_or(u8::is_ascii_whitespace) {
            Some(Format::Ply)
        } else if stl::is_binary_by_length(head, self.length) || stl::is_ascii(head) {
            Some(Format::Stl)
        } else if off::is_off(head) {
            Some(Format::Off)
        } else if gltf::is_binary(head) {
            Some(Format::Glb)
        } else if gltf::is_json(head) {
            Some(Format::Gltf)
        } else {
            None
        }
    }

    /// An error for what often lies where a mesh is expected and is none that we read.
    pub fn refuse_stand_ins(&self) -> Result<()> {
        if self.head.starts_with(b"version https://git-lfs") {
            let found = "this is a git-lfs pointer, not the mesh";
            return Err(self.error(Place::File, found, "the mesh itself (run `git lfs pull`)"));
        }
        Ok(())
    }

    /// A parse error in this file.
    pub fn error(&self, place: Place, found: &str, expected: &str) -> Error {
        Error::Parse {
            file: self.file.clone(),
            place,
            found: one_line(found),
            expected: one_line(expected),
        }
    }

    /// A read error in this file.
    pub fn io_error(&self, source: std::io::Error) -> Error {
        Error::Io {
            path: self.file.clone(),
            action: "cannot read",
            source,
        }
    }
}

#[cfg(test)]
impl Input {
    /// A file that lies in memory.
    pub fn from_bytes(name: &str, bytes: impl Into<Vec<u8>>) -> Result<Self> {
        let bytes = bytes.into();
        let length = Some(bytes.len() as u64);
        Self::new(name.into(), Box::new(Cursor::new(bytes)), length)
    }

    /// A stream whose length is not known beforehand and that gives one byte at a time.
    pub fn from_stream(name: &str, bytes: impl Into<Vec<u8>>) -> Result<Self> {
        struct Trickle(Cursor<Vec<u8>>);
        impl Read for Trickle {
            fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
                let n = buffer.len().min(1);
                self.0.read(&mut buffer[..n])
            }
        }
        Self::new(
            name.into(),
            Box::new(Trickle(Cursor::new(bytes.into()))),
            None,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn detect(name: &str, bytes: &[u8]) -> Result<Format> {
        Input::from_bytes(name, bytes)?.detect_format()
    }

    #[test]
    fn content_wins_over_the_extension() {
        assert_eq!(
            detect("a.stl", b"ply\nformat ascii 1.0\n").unwrap(),
            Format::Ply
        );
        assert_eq!(
            detect("a.obj", b"# a cube\nOFF\n8 6 12\n").unwrap(),
            Format::Off
        );
        assert_eq!(
            detect("a.ply", b"solid x\n facet normal 0 0 1\n").unwrap(),
            Format::Stl
        );
        let mut binary = vec![b'x'; 84 + 50];
        binary[80..84].copy_from_slice(&1u32.to_le_bytes());
        assert_eq!(detect("a.obj", &binary).unwrap(), Format::Stl);
    }

    /// A comment or a keyword says nothing about OBJ, so its name has to.
    #[test]
    fn the_extension_decides_in_any_case() {
        assert_eq!(detect("a.OBJ", b"# nothing\n").unwrap(), Format::Obj);
        assert_eq!(detect("a.Stl", b"solid\n").unwrap(), Format::Stl);
        assert!(detect("a", b"v 0 0 0\n").is_err());
    }

    #[test]
    fn a_stream_is_told_by_its_first_bytes() {
        let stream = Input::from_stream("<stdin>", *b"OFF 1 1 1\n").unwrap();
        assert_eq!(stream.detect_format().unwrap(), Format::Off);
        let error = Input::from_stream("<stdin>", *b"v 0 0 0\n")
            .unwrap()
            .detect_format();
        assert!(
            error
                .unwrap_err()
                .to_string()
                .ends_with("--input-format names it")
        );
    }
}
