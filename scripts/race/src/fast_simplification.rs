//! fast-simplification, which only Python has: a process for each run, through `scripts/peers.py`.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::Command;

use decimate::error::{Error, Result};
use decimate::indexed_mesh::IndexedMesh;
use decimate::io::{self, ReadOptions};
use serde::Deserialize;
use tempfile::TempDir;

use crate::against::Theirs;

/// The script that calls it and times the call alone.
const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../peers.py");

/// A Python, and a mesh's arrays in files that NumPy loads.
pub struct FastSimplification {
    python: PathBuf,
    folder: TempDir,
}

/// What the script prints, as far as it is wanted here.
#[derive(Deserialize)]
struct Said {
    seconds: f64,
}

impl FastSimplification {
    /// Writes the mesh's arrays into a folder that goes with the result.
    ///
    /// # Errors
    /// [`Error::Io`] where that fails.
    pub fn new(python: &Path, mesh: &IndexedMesh) -> Result<Self> {
        let temporary = std::env::temp_dir();
        let folder = TempDir::new().map_err(|e| cannot_write(&temporary, e))?;
        let positions = mesh.positions().iter().flat_map(|p| p.to_array());
        let indices = mesh.sides().flatten();
        let words = positions.map(f32::to_le_bytes);
        save(&folder.path().join("points.npy"), "<f4", words)?;
        let words = indices.map(u32::to_le_bytes);
        save(&folder.path().join("triangles.npy"), "<i4", words)?;
        Ok(Self {
            python: python.into(),
            folder,
        })
    }

    /// Simplifies to `triangles`.
    ///
    /// # Errors
    /// [`Error::InvalidOptions`] with what the process said, where it fails.
    pub fn run(&self, triangles: usize) -> Result<Theirs> {
        let folder = self.folder.path();
        let output = folder.join("out.ply");
        let done = Command::new(&self.python)
            .args([SCRIPT, "fast-simplification"])
            .args([folder.join("points.npy"), folder.join("triangles.npy")])
            .arg(triangles.to_string())
            .arg(&output)
            .output()
            .map_err(|error| self.failed(error.to_string()))?;
        if !done.status.success() {
            return Err(self.failed(String::from_utf8_lossy(&done.stderr).into_owned()));
        }
        let said: Said =
            serde_json::from_slice(&done.stdout).map_err(|e| self.failed(e.to_string()))?;
        let mesh = io::read(&output, &ReadOptions::default())?;
        Ok(Theirs {
            call_seconds: said.seconds,
            triangles_out: mesh.triangle_count(),
        })
    }

    fn failed(&self, why: String) -> Error {
        let python = self.python.display();
        Error::InvalidOptions(format!("{python}: fast-simplification failed: {why}"))
    }
}

/// Saves rows of three words in NumPy's format.
fn save(path: &Path, kind: &str, words: impl Iterator<Item = [u8; 4]>) -> Result<()> {
    let words: Vec<u8> = words.flatten().collect();
    let rows = words.len() / 12;
    let header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({rows}, 3), }}");
    // The magic, the version, the length and the header fill whole blocks of 64 bytes.
    let length = (10 + header.len() + 1).next_multiple_of(64) - 10;
    let write = || {
        let mut file = BufWriter::new(File::create(path)?);
        file.write_all(b"\x93NUMPY\x01\x00")?;
        file.write_all(&(length as u16).to_le_bytes())?;
        writeln!(file, "{header:<width$}", width = length - 1)?;
        file.write_all(&words)?;
        file.flush()
    };
    write().map_err(|error| cannot_write(path, error))
}

fn cannot_write(path: &Path, source: std::io::Error) -> Error {
    Error::Io {
        path: path.into(),
        action: "cannot write",
        source,
    }
}
