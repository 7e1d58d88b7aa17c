//! Writing: the file beside that takes its place when it is whole, and the formats but OBJ and glTF.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::error::{Error, Result};
use crate::indexed_mesh::IndexedMesh;

use super::ply_output;
use super::text::write_number;

/// How much is written at a time.
pub(super) const BLOCK_BYTES: usize = 1 << 20;

/// Has `write` fill the file at `path`, or standard output where that is `-`: under another name
/// beside its place, renamed when it is complete.
///
/// # Errors
/// [`Error::Io`] where that fails; what was at `path` is then as it was.
pub fn write_file(path: &Path, write: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
    let cannot = |action| {
        move |source| Error::Io {
            path: path.to_path_buf(),
            action,
            source,
        }
    };
    let buffered = |file: &mut dyn Write| {
        let mut writer = BufWriter::with_capacity(BLOCK_BYTES, file);
        write(&mut writer)?;
        writer.flush()
    };
    if path == Path::new("-") {
        return buffered(&mut io::stdout().lock()).map_err(|source| Error::Io {
            path: "<stdout>".into(),
            action: "cannot write",
            source,
        });
    }
    match fs::metadata(path) {
        Ok(there) if there.is_dir() => {
            let source = io::Error::from(io::ErrorKind::IsADirectory);
            Err(cannot("cannot write")(source))
        }
        Ok(there) if !there.is_file() => {
            let mut file = OpenOptions::new()
                .write(true)
                .open(path)
                .map_err(cannot("cannot open"))?;
            buffered(&mut file).map_err(cannot("cannot write"))
        }
        there => {
            // Through a link, so that the link stays and what it points to is replaced.
            let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
            let beside = Beside::create(&target).map_err(cannot("cannot create a file there"))?;
            buffered(&mut beside.file()).map_err(cannot("cannot write"))?;
            if let Ok(there) = there {
                let same = beside.file().set_permissions(there.permissions());
                same.map_err(cannot("cannot set permissions"))?;
            }
            beside.take_place(&target).map_err(cannot("cannot replace"))
        }
    }
}

/// Whether a file can be put at `path`: to be asked before the work that fills it.
///
/// # Errors
/// [`Error::Io`] where it is a folder, or no file can be created in its folder.
pub fn check_place(path: &Path) -> Result<()> {
    let cannot = |source| Error::Io {
        path: path.to_path_buf(),
        action: "cannot create a file there",
        source,
    };
    if path == Path::new("-") {
        return Ok(());
    }
    match fs::metadata(path) {
        Ok(there) if there.is_dir() => Err(cannot(io::ErrorKind::IsADirectory.into())),
        Ok(there) if !there.is_file() => Ok(()),
        _ => {
            let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
            Beside::create(&target).map(drop).map_err(cannot)
        }
    }
}

/// The files that are being written under names of their own.
static UNFINISHED: Mutex<Vec<tempfile::TempPath>> = Mutex::new(Vec::new());

fn unfinished() -> MutexGuard<'static, Vec<tempfile::TempPath>> {
    // A list of paths is as good after a panic as before.
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Deletes every file that this process has begun to write and not finished: for a program that was
/// interrupted and is about to exit.
///
/// Until what is returned is dropped, no file is begun or finished; whoever wants to, waits.
pub fn abandon_unfinished() -> Abandoned {
    let mut unfinished = unfinished();
    unfinished.clear();
    Abandoned {
        _unfinished: unfinished,
    }
}

/// While it lives, no file is begun or finished; see [`abandon_unfinished`].
#[must_use]
pub struct Abandoned {
    _unfinished: MutexGuard<'static, Vec<tempfile::TempPath>>,
}

/// A file beside another, on the same disk so that it can be renamed; gone again unless it is.
struct Beside {
    file: File,
    /// Its name, which deletes it when it is dropped, stands among the unfinished.
    name: PathBuf,
}

impl Beside {
    fn create(target: &Path) -> io::Result<Beside> {
        let directory = match target.parent() {
            Some(parent) if parent != Path::new("") => parent.to_path_buf(),
            _ => PathBuf::from("."),
        };
        let mut builder = tempfile::Builder::new();
        builder.prefix(".decimate-");
        // The usual permissions of a new file, from which the system takes the umask away.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let mut unfinished = unfinished();
        let created = builder.tempfile_in(directory);
        // Without the temporary name, which says nothing to the reader of a message.
        let (file, path) = created
            .map_err(|error| io::Error::from(error.kind()))?
            .into_parts();
        let name = path.to_path_buf();
        unfinished.push(path);
        Ok(Beside { file, name })
    }

    fn file(&self) -> &File {
        &self.file
    }

    /// Takes the place of `target`.
    fn take_place(self, target: &Path) -> io::Result<()> {
        let mut unfinished = unfinished();
        match self.find(&unfinished) {
            Some(i) => unfinished
                .swap_remove(i)
                .persist(target)
                .map_err(|e| e.error),
            None => Err(io::ErrorKind::Interrupted.into()),
        }
    }

    fn find(&self, unfinished: &[tempfile::TempPath]) -> Option<usize> {
        let is_this = |path: &tempfile::TempPath| path.as_os_str() == self.name.as_os_str();
        unfinished.iter().position(is_this)
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        let mut unfinished = unfinished();
        if let Some(i) = self.find(&unfinished) {
            drop(unfinished.swap_remove(i));
        }
    }
}

/// The scalar type that holds a mesh's coordinates: without an origin of its own a mesh is single
/// precision, and leaves with the bits it came with.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    Float,
    Double,
}

impl Scalar {
    pub fn of(mesh: &IndexedMesh) -> Scalar {
        if mesh.origin().to_array() == [0.0; 3] {
            Scalar::Float
        } else {
            Scalar::Double
        }
    }
}

/// A vertex in the file's coordinates. Adding an origin of zero would turn −0 into 0.
pub(super) fn point(mesh: &IndexedMesh, v: usize) -> [f64; 3] {
    let position = mesh.positions()[v].as_dvec3();
    match Scalar::of(mesh) {
        Scalar::Float => position.to_array(),
        Scalar::Double => (mesh.origin() + position).to_array(),
    }
}

/// Writes a vertex as text, its coordinates with blanks between.
pub(super) fn write_point(
    writer: &mut dyn Write,
    mesh: &IndexedMesh,
    v: usize,
    digits: Option<usize>,
) -> io::Result<()> {
    let single = Scalar::of(mesh) == Scalar::Float;
    for (axis, x) in point(mesh, v).into_iter().enumerate() {
        if axis > 0 {
            writer.write_all(b" ")?;
        }
        write_number(writer, x, single, digits)?;
    }
    Ok(())
}

fn ply_header(writer: &mut dyn Write, mesh: &IndexedMesh, encoding: &str) -> io::Result<()> {
    let scalar = match Scalar::of(mesh) {
        Scalar::Float => "float",
        Scalar::Double => "double",
    };
    write!(
        writer,
        "ply\nformat {encoding} 1.0\nelement vertex {}\nproperty {scalar} x\nproperty {scalar} y\n\
         property {scalar} z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.positions().len(),
        mesh.triangle_count()
    )
}

/// Binary little-endian PLY.
pub(super) fn ply_binary(writer: &mut dyn Write, mesh: &IndexedMesh) -> io::Result<()> {
    if !mesh.attributes().is_empty() {
        return ply_output::ply(writer, mesh, None);
    }
    ply_header(writer, mesh, "binary_little_endian")?;
    match Scalar::of(mesh) {
        Scalar::Float => write_records(
            writer,
            mesh.positions().iter(),
            |record: &mut [u8; 12], p| {
                record.copy_from_slice(p.to_array().map(f32::to_le_bytes).as_flattened());
            },
        ),
        Scalar::Double => write_records(writer, mesh.points(), |record: &mut [u8; 24], p| {
            record.copy_from_slice(p.to_array().map(f64::to_le_bytes).as_flattened());
        }),
    }?;
    let face = |record: &mut [u8; 13], corners: [u32; 3]| {
        record[0] = 3;
        record[1..].copy_from_slice(corners.map(u32::to_le_bytes).as_flattened());
    };
    write_sides(writer, mesh, face)
}

/// Writes a record of `N` bytes for each item, in blocks.
fn write_records<const N: usize, T>(
    writer: &mut dyn Write,
    mut items: impl Iterator<Item = T>,
    fill: impl Fn(&mut [u8; N], T),
) -> io::Result<()> {
    // As much as the writer behind it holds, which then hands it through.
    let most = items.size_hint().1.unwrap_or(usize::MAX);
    let mut block = vec![[0; N]; BLOCK_BYTES.div_ceil(N).min(most.saturating_add(1))];
    loop {
        let mut filled = 0;
        for (record, item) in block.iter_mut().zip(&mut items) {
            fill(record, item);
            filled += 1;
        }
        writer.write_all(block[..filled].as_flattened())?;
        if filled < block.len() {
            return Ok(());
        }
    }
}

/// Writes a record of `N` bytes for each triangle that a file of the mesh holds, in blocks.
fn write_sides<const N: usize>(
    writer: &mut dyn Write,
    mesh: &IndexedMesh,
    fill: impl Fn(&mut [u8; N], [u32; 3]),
) -> io::Result<()> {
    if mesh.double_sided().is_empty() {
        write_records(writer, mesh.triangles().iter().copied(), fill)
    } else {
        write_records(writer, mesh.sides(), fill)
    }
}

/// ASCII PLY.
pub(super) fn ply_ascii(
    writer: &mut dyn Write,
    mesh: &IndexedMesh,
    digits: Option<usize>,
) -> io::Result<()> {
    if !mesh.attributes().is_empty() {
        return ply_output::ply(writer, mesh, Some(digits));
    }
    ply_header(writer, mesh, "ascii")?;
    write_counted_lists(writer, mesh, digits)
}

/// OFF.
pub(super) fn off(
    writer: &mut dyn Write,
    mesh: &IndexedMesh,
    digits: Option<usize>,
) -> io::Result<()> {
    writeln!(
        writer,
        "OFF\n{} {} 0",
        mesh.positions().len(),
        mesh.triangle_count()
    )?;
    write_counted_lists(writer, mesh, digits)
}

/// A line `x y z` a vertex and a line `3 a b c` a triangle.
fn write_counted_lists(
    writer: &mut dyn Write,
    mesh: &IndexedMesh,
    digits: Option<usize>,
) -> io::Result<()> {
    for v in 0..mesh.positions().len() {
        write_point(writer, mesh, v, digits)?;
        writer.write_all(b"\n")?;
    }
    for [a, b, c] in mesh.sides() {
        writeln!(writer, "3 {a} {b} {c}")?;
    }
    Ok(())
}

/// Binary STL, which has single precision and no other.
pub(super) fn stl_binary(writer: &mut dyn Write, mesh: &IndexedMesh) -> io::Result<()> {
    let mut header = [0; 84];
    header[..16].copy_from_slice(b"made by decimate");
    let count = u32::try_from(mesh.triangle_count()).expect("2^31-1 edges are fewer triangles");
    header[80..].copy_from_slice(&count.to_le_bytes());
    writer.write_all(&header)?;
    write_sides(writer, mesh, |record: &mut [u8; 50], triangle| {
        let corners = triangle.map(|v| point(mesh, v as usize));
        let numbers = [normal(corners), corners[0], corners[1], corners[2]];
        let bytes = numbers.map(|numbers| numbers.map(|x| (x as f32).to_le_bytes()));
        record[..48].copy_from_slice(bytes.as_flattened().as_flattened());
    })
}

/// ASCII STL.
pub(super) fn stl_ascii(
    writer: &mut dyn Write,
    mesh: &IndexedMesh,
    digits: Option<usize>,
) -> io::Result<()> {
    writer.write_all(b"solid decimate\n")?;
    for triangle in mesh.sides() {
        let [x, y, z] = normal(triangle.map(|v| point(mesh, v as usize)));
        writeln!(
            writer,
            " facet normal {} {} {}\n  outer loop",
            x as f32, y as f32, z as f32
        )?;
        for v in triangle {
            writer.write_all(b"   vertex ")?;
            write_point(writer, mesh, v as usize, digits)?;
            writer.write_all(b"\n")?;
        }
        writer.write_all(b"  endloop\n endfacet\n")?;
    }
    writer.write_all(b"endsolid decimate\n")
}

/// The unit normal of a triangle, or zero where it has none.
fn normal([a, b, c]: [[f64; 3]; 3]) -> [f64; 3] {
    let minus = |p: [f64; 3], q: [f64; 3]| [p[0] - q[0], p[1] - q[1], p[2] - q[2]];
    let (u, v) = (minus(b, a), minus(c, a));
    let cross = [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ];
    let length = (cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]).sqrt();
    if length > 0.0 && length.is_finite() {
        cross.map(|x| x / length)
    } else {
        [0.0; 3]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_normal_follows_the_right_hand() {
        let corners = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];
        assert_eq!(normal(corners), [0.0, 0.0, 1.0]);
        assert_eq!(normal([corners[0], corners[1], corners[1]]), [0.0; 3]);
    }

    /// A writer that fails halfway leaves the old file and nothing beside it.
    #[test]
    fn no_half_file() {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("a.ply");
        fs::write(&path, "old").unwrap();
        let result = write_file(&path, |writer| {
            writer.write_all(b"new")?;
            Err(io::Error::other("disk full"))
        });
        let message = result.unwrap_err().to_string();
        assert!(
            message.ends_with("a.ply: cannot write: disk full"),
            "{message}"
        );
        assert_eq!(fs::read_to_string(&path).unwrap(), "old");
        assert_eq!(fs::read_dir(directory.path()).unwrap().count(), 1);
    }

    #[cfg(unix)]
    #[test]
    fn links_stay_links_and_permissions_stay() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().unwrap();
        let (file, link) = (
            directory.path().join("a.ply"),
            directory.path().join("link.ply"),
        );
        fs::write(&file, "old").unwrap();
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        write_file(&link, |writer| writer.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
        assert_eq!(
            fs::metadata(&file).unwrap().permissions().mode() & 0o777,
            0o640
        );
    }

    /// As any other program's: what the umask leaves of 0666, not a temporary file's 0600.
    #[cfg(unix)]
    #[test]
    fn a_new_file_has_the_usual_permissions() {
        use std::os::unix::fs::PermissionsExt;
        let directory = tempfile::tempdir().unwrap();
        let (ours, usual) = (directory.path().join("a"), directory.path().join("b"));
        write_file(&ours, |writer| writer.write_all(b"x")).unwrap();
        fs::write(&usual, "x").unwrap();
        let mode = |path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&usual));
    }

    #[test]
    fn a_directory_is_no_file() {
        let directory = tempfile::tempdir().unwrap();
        let error = write_file(directory.path(), |_| Ok(()))
            .unwrap_err()
            .to_string();
        assert!(error.contains("cannot write: "), "{error}");
    }

    #[cfg(unix)]
    #[test]
    fn a_device_is_written_to_directly() {
        write_file(Path::new("/dev/null"), |writer| writer.write_all(b"x")).unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }
}
