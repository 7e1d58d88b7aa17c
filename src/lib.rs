pub mod clean;
pub mod decimate;
pub mod error;
pub mod indexed_mesh;
pub mod io;
pub mod mesh;
#[cfg(test)]
mod shapes;
