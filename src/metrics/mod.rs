//! What is in a mesh, and how far it is from another.

mod attributes;
mod charts;
mod compare;
mod info;
mod surface;

pub use attributes::{AttributeComparison, ChannelComparison, TextureComparison, Unit};
pub use compare::{CompareOptions, Comparison, Distances, Reference, TwoSided, compare};
pub use info::{Info, info, info_of_file};
