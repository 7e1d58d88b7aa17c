//! What can go wrong, and where.

use std::fmt;
use std::path::PathBuf;

use crate::progress::Cancelled;

/// The result of everything here that can fail.
pub type Result<T> = std::result::Result<T, Error>;

/// What went wrong. The message names the file, the place, what was found and what was expected.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused to open, read, write or rename a file.
    #[error("{}: {action}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was being done: "cannot open", "cannot read", …
        action: &'static str,
        /// The operating system's word.
        source: std::io::Error,
    },
    /// A file is not what its format asks for.
    #[error("{}{place}: {found}; expected {expected}", file.display())]
    Parse {
        /// The file (`<stdin>` for standard input).
        file: PathBuf,
        /// Where in the file.
        place: Place,
        /// What stands there.
        found: String,
        /// What should stand there, or what to do.
        expected: String,
    },
    /// A list of positions and triangles is not a mesh.
    #[error("{0}")]
    InvalidMesh(String),
    /// A memory limit that no tier can keep.
    #[error(
        "the memory limit of {:.1} MB is too low: the {tier} tier needs {:.1} MB",
        *limit_bytes as f64 / 1e6, *needed_bytes as f64 / 1e6
    )]
    Memory {
        /// The tier that needs least, or the one asked for.
        tier: &'static str,
        /// What it needs.
        needed_bytes: u64,
        /// What it may use.
        limit_bytes: u64,
    },
    /// A mistake of this library's own, found by a check that was asked for.
    #[error("internal error: {0}; please report it with the mesh")]
    Internal(String),
    /// Options that contradict each other or lie outside their range.
    #[error("{0}")]
    InvalidOptions(String),
    /// Whoever [followed](crate::progress) the work cancelled it. Nothing came of it.
    #[error("cancelled")]
    Cancelled,
}

impl From<Cancelled> for Error {
    fn from(Cancelled: Cancelled) -> Self {
        Self::Cancelled
    }
}

/// A place in a file. Written right behind the file's name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Place {
    /// The file as a whole.
    File,
    /// A line, counted from 1.
    Line(usize),
    /// A byte offset, counted from 0.
    Byte(u64),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::File => Ok(()),
            Place::Line(line) => write!(f, ":{line}"),
            Place::Byte(byte) => write!(f, ": byte {byte}"),
        }
    }
}
