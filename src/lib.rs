pub mod error;
pub mod indexed_mesh;
pub mod mesh;
#[cfg(test)]
mod shapes;
