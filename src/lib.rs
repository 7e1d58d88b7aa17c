//! Quadric edge-collapse mesh decimation on the directed-edge data structure of Campagna, Kobbelt
//! and Seidel (1998).
//!
//! ```
//! use decimate::decimate::{Options, Targets, decimate};
//! use decimate::io;
//!
//! # fn main() -> decimate::error::Result<()> {
//! let mesh = io::read("data/sample.ply".as_ref(), &io::ReadOptions::default())?;
//! let targets = Targets { ratio: Some(0.1), ..Targets::default() };
//! let (small, report) = decimate(mesh, &Options { targets, ..Options::default() })?;
//! assert_eq!(small.triangle_count(), report.triangles_out);
//! # let file = std::env::temp_dir().join("decimate_doctest.ply");
//! io::write(&file, &small, &io::WriteOptions::default())?;
//! # std::fs::remove_file(file).ok();
//! # Ok(())
//! # }
//! ```
//!
//! Data flows one way: [`io`] makes an [`indexed_mesh::IndexedMesh`], [`clean`] makes a simplicial
//! complex of it, [`decimate`] turns it into another over a [`mesh::Mesh`] in one of three memory
//! tiers, [`io`] writes it, [`metrics`] says what is in it, [`repair`] makes it manifold. [`spatial`]
//! puts positions in an order in which neighbours stand together. [`attributes`] are what a mesh
//! carries beside positions. [`structures`] holds the mesh structures that the paper compares, for
//! comparison and teaching. [`progress`] says how far a decimation is, which whoever asks may cancel.
//!
//! # Limits
//! At most 2³¹−1 directed edges (715 million triangles) and 2³¹−1 vertices. Coordinates are single
//! precision, relative to one double-precision origin. More is an [`error::Error`] where the mesh is
//! made; a memory limit is held against what decimation will need before it begins. Nothing here
//! prints or exits, and what the functions of [`mesh`] ask of their arguments is said at each.

pub mod attributes;
pub mod clean;
pub mod decimate;
pub mod error;
pub mod indexed_mesh;
pub mod io;
pub mod mesh;
pub mod metrics;
pub mod nearest;
pub mod progress;
pub mod repair;
#[cfg(test)]
mod shapes;
pub mod spatial;
pub mod structures;
