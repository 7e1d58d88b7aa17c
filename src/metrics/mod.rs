//! What is in a mesh, and how far it is from another.

mod compare;
mod info;
mod surface;

pub use compare::{CompareOptions, Comparison, Distances, Reference, TwoSided, compare};
pub use info::{Info, info, info_of_file};
