//! meshoptimizer's simplifiers that take attributes into the cost.

use decimate::attributes::{Attributes, Channel, Kind, NumberType};
use decimate::clean::clean;
use decimate::error::Result;
use decimate::indexed_mesh::IndexedMesh;
use glam::{DVec3, Vec3};
use meshopt::{
    SimplifyOptions, VertexDataAdapter, simplify_with_attributes_and_locks, simplify_with_update,
    typed_to_bytes,
};

use crate::cli::Method;

/// A mesh with attributes in meshoptimizer's own types: a vertex a wedge, so that a vertex on an
/// attribute seam stands there several times, at the same position.
pub struct AttributedArrays {
    /// Three a triangle.
    indices: Vec<u32>,
    /// Relative to `origin`.
    positions: Vec<[f32; 3]>,
    origin: DVec3,
    /// All numbers of a vertex side by side; those of whole-number colours as shares of their range.
    values: Vec<f32>,
    /// One for each of those numbers.
    weights: Vec<f32>,
    /// What the numbers are; without rows.
    channels: Vec<Channel>,
}

impl AttributedArrays {
    /// The arrays of a mesh, which is welded and cleaned as ours are: meshoptimizer's own advice is to
    /// merge vertices that are the same first.
    ///
    /// # Errors
    /// As [`clean`].
    pub fn of(mesh: IndexedMesh) -> Result<Self> {
        let (mesh, _) = clean(mesh, true)?;
        let attributes = mesh.attributes();
        let corners = if attributes.channels.is_empty() {
            mesh.triangles()
        } else {
            &attributes.corners[..]
        };
        let mut indices = Vec::new();
        let vertices = corners
            .as_flattened()
            .iter()
            .max()
            .map_or(0, |&v| v as usize + 1);
        let mut positions = vec![[0.0; 3]; vertices];
        for (i, (triangle, &[a, b, c])) in mesh.triangles().iter().zip(corners).enumerate() {
            indices.extend([a, b, c]);
            if mesh.is_double_sided(i) {
                indices.extend([a, c, b]);
            }
            for (&v, wedge) in triangle.iter().zip([a, b, c]) {
                positions[wedge as usize] = mesh.positions()[v as usize].to_array();
            }
        }
        let channels = &attributes.channels;
        let row = |wedge| channels.iter().flat_map(move |c| shares(c, wedge));
        let values = (0..vertices).flat_map(row).collect();
        let weights = channels
            .iter()
            .flat_map(|c| vec![weight(c.kind); c.width()]);
        let empty = |c: &Channel| Channel {
            is_by_corner: false,
            ..Channel::new(c.kind, c.components.clone())
        };
        Ok(Self {
            indices,
            positions,
            origin: mesh.origin(),
            values,
            weights: weights.collect(),
            channels: channels.iter().map(empty).collect(),
        })
    }

    /// Simplifies to `triangles`, in place, with no option and no limit of the error.
    ///
    /// Stops above that count where meshoptimizer finds nothing more to collapse.
    pub fn simplify(&mut self, triangles: usize, method: Method) {
        let stride = size_of::<f32>() * self.weights.len();
        match method {
            Method::Update => {
                let kept = simplify_with_update(
                    &mut self.indices,
                    &mut self.positions,
                    &mut self.values,
                    &self.weights,
                    stride,
                    None,
                    3 * triangles,
                    f32::MAX,
                    SimplifyOptions::None,
                    None,
                );
                self.indices.truncate(kept);
            }
            Method::Attributes => {
                let bytes = typed_to_bytes(&self.positions);
                let vertices = VertexDataAdapter::new(bytes, size_of::<[f32; 3]>(), 0)
                    .expect("the positions are whole");
                self.indices = simplify_with_attributes_and_locks(
                    &self.indices,
                    &vertices,
                    &self.values,
                    &self.weights,
                    stride,
                    &vec![false; self.positions.len()],
                    3 * triangles,
                    f32::MAX,
                    SimplifyOptions::None,
                    None,
                );
            }
        }
    }

    /// The mesh of these arrays, without the vertices that no triangle uses: normals of length 1,
    /// colours in their range, whole numbers where the types are.
    ///
    /// # Errors
    /// As [`IndexedMesh::with_origin`].
    pub fn into_mesh(self) -> Result<IndexedMesh> {
        let mut new_ids = vec![None; self.positions.len()];
        let mut positions: Vec<Vec3> = Vec::new();
        let mut channels = self.channels;
        let width = self.weights.len();
        let mut new_id = |v: u32| {
            *new_ids[v as usize].get_or_insert_with(|| {
                positions.push(self.positions[v as usize].into());
                let mut values = &self.values[v as usize * width..];
                for channel in &mut channels {
                    let (row, rest) = values.split_at(channel.width());
                    values = rest;
                    push(channel, row);
                }
                positions.len() as u32 - 1
            })
        };
        let corners: Vec<u32> = self.indices.iter().map(|&v| new_id(v)).collect();
        let triangles = corners.as_chunks().0.to_vec();
        let corners = if channels.is_empty() {
            Vec::new()
        } else {
            triangles.clone()
        };
        let attributes = Attributes {
            corners,
            channels,
            ..Attributes::default()
        };
        IndexedMesh::with_origin(self.origin, positions, triangles)?.with_attributes(attributes)
    }
}

/// The weight of each of a channel's numbers, as meshoptimizer's documents have it: half for normals,
/// one for what goes from 0 to 1.
fn weight(kind: Kind) -> f32 {
    match kind {
        Kind::Normal => 0.5,
        _ => 1.0,
    }
}

/// What a colour's numbers are shares of.
fn range(kind: Kind, number: NumberType) -> f64 {
    match number.range() {
        Some((_, max)) if kind == Kind::Color => max,
        _ => 1.0,
    }
}

fn shares(channel: &Channel, wedge: usize) -> impl Iterator<Item = f32> {
    let numbers = channel.row(wedge).zip(&channel.components);
    numbers.map(|(x, property)| (x / range(channel.kind, property.number)) as f32)
}

/// Adds a row of numbers as [`shares`] gives them.
fn push(channel: &mut Channel, row: &[f32]) {
    let length = row.iter().map(|x| x * x).sum::<f32>().sqrt();
    for (&x, property) in row.iter().zip(&channel.components) {
        let x = match channel.kind {
            Kind::Normal if length > 0.0 => x / length,
            Kind::Color => x.clamp(0.0, 1.0),
            _ => x,
        };
        let x = f64::from(x) * range(channel.kind, property.number);
        channel.values.push(property.number.nearest(x));
    }
}

#[cfg(test)]
mod tests {
    use decimate::attributes::Property;

    use super::*;

    /// A strip with a seam across its middle: six vertices, eight wedges, and back again the same.
    #[test]
    fn arrays_have_a_vertex_a_wedge() {
        let place = |i: u32| Vec3::new((i / 2) as f32, (i % 2) as f32, 0.0);
        let triangles = vec![[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]];
        let corners = vec![[0, 2, 3], [0, 3, 1], [4, 6, 7], [4, 7, 5]];
        let red = Property {
            name: "red".into(),
            number: NumberType::U8,
        };
        let mut channel = Channel::new(Kind::Color, vec![red]);
        (0..8).for_each(|i| channel.values.push(f64::from(30 * i)));
        let attributes = Attributes {
            corners,
            channels: vec![channel],
            ..Attributes::default()
        };
        let mesh = IndexedMesh::new((0..6).map(place).collect(), triangles).unwrap();
        let mesh = mesh.with_attributes(attributes).unwrap();
        let arrays = AttributedArrays::of(mesh.clone()).unwrap();
        assert_eq!((arrays.positions.len(), arrays.values.len()), (8, 8));
        let colors = |mesh: &IndexedMesh| -> Vec<f64> {
            let attributes = mesh.attributes();
            let wedges = attributes.corners.as_flattened().iter();
            wedges
                .map(|&w| attributes.channels[0].values.get(w as usize))
                .collect()
        };
        let back = arrays.into_mesh().unwrap();
        assert_eq!(back.positions().len(), 8);
        assert_eq!(colors(&back), colors(&mesh));
    }
}
