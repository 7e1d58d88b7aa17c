//! What is in a mesh.

mod info;

pub use info::{Info, info};
