//! Wedges of a file: put together while it is read, told apart by vertices again when it is written.

use std::borrow::Cow;
use std::collections::HashMap;

use crate::attributes::{Attributes, Channel, MAX_COMPONENTS};
use crate::indexed_mesh::IndexedMesh;

/// The rows that a corner names of two lists, such as texture coordinates and normals: counted from 1, 0
/// where it names none.
pub(super) type Rows = [u32; 2];

/// The wedges of a file whose corners name a vertex and rows.
///
/// The first wedge of a vertex has its number. The others, which only seams have, stand behind.
#[derive(Default)]
pub(super) struct Wedges {
    /// The rows of each vertex's first wedge.
    first: Vec<Option<Rows>>,
    /// The vertex and the rows of every other.
    others: Vec<(u32, Rows)>,
    numbers: HashMap<(u32, Rows), u32>,
}

/// Marks one of the others while it is not known how many vertices there are. All corners of the most
/// triangles are fewer.
const OTHER: u32 = 1 << 31;

impl Wedges {
    /// The wedge of a corner, where `vertices` have been read; to be [numbered](Self::number) when all
    /// have.
    pub fn of(&mut self, v: u32, rows: Rows, vertices: usize) -> u32 {
        // A vertex that is yet to come must not make room for itself: nothing says that it will.
        if (v as usize) < vertices && v < OTHER {
            if self.first.len() <= v as usize {
                self.first.resize(vertices, None);
            }
            if *self.first[v as usize].get_or_insert(rows) == rows {
                return v;
            }
        }
        let others = &mut self.others;
        let number = self.numbers.entry((v, rows)).or_insert_with(|| {
            others.push((v, rows));
            others.len() as u32 - 1
        });
        OTHER | *number
    }

    /// Gives `corners` the numbers of their wedges, and returns the vertex and the rows of each wedge of
    /// a file with so many vertices.
    pub fn number(self, vertices: usize, corners: &mut [[u32; 3]]) -> Vec<(u32, Rows)> {
        for wedge in corners.as_flattened_mut() {
            if *wedge & OTHER != 0 {
                *wedge = (*wedge ^ OTHER) + vertices as u32;
            }
        }
        drop(self.numbers);
        let rows_of = |v: u32| {
            let first = self.first.get(v as usize).copied().flatten();
            (v, first.unwrap_or_default())
        };
        let mut wedges = Vec::with_capacity(vertices + self.others.len());
        wedges.extend((0..vertices as u32).map(rows_of));
        wedges.extend(self.others);
        wedges
    }
}

/// The vertices of a file that holds some channels by vertices: where a channel differs within a vertex
/// of the mesh, copies of it stand behind all others.
pub(super) struct Vertices<'a> {
    /// The wedge of each vertex of the mesh, where it has one.
    first: Vec<Option<u32>>,
    /// The vertex and the wedge of each copy.
    copies: Vec<(u32, u32)>,
    /// The triangles as the file numbers their vertices.
    pub triangles: Cow<'a, [[u32; 3]]>,
}

impl<'a> Vertices<'a> {
    /// The vertices of a mesh with these channels of it.
    pub fn of(mesh: &'a IndexedMesh, channels: &[&Channel]) -> Self {
        let triangles = mesh.triangles();
        let mut vertices = Vertices {
            first: Vec::new(),
            copies: Vec::new(),
            triangles: Cow::Borrowed(triangles),
        };
        if channels.is_empty() {
            return vertices;
        }
        vertices.first = first_wedges(mesh);
        if channels.iter().any(|channel| has_seam(mesh, channel)) {
            vertices.copy_at_seams(mesh, channels);
        }
        vertices
    }

    fn copy_at_seams(&mut self, mesh: &IndexedMesh, channels: &[&Channel]) {
        let corners = &mesh.attributes().corners;
        let mut told_apart = Attributes {
            corners: corners.clone(),
            channels: channels.iter().map(|&channel| channel.clone()).collect(),
            ..Attributes::default()
        };
        told_apart.merge_equal_wedges(mesh.triangles());
        let mut numbers: Vec<Option<u32>> = vec![None; told_apart.wedge_count()];
        let mut is_taken = vec![false; mesh.positions().len()];
        let triangles = self.triangles.to_mut().as_flattened_mut();
        let wedges = told_apart.corners.as_flattened().iter();
        for ((v, &wedge), &copied) in triangles.iter_mut().zip(wedges).zip(corners.as_flattened()) {
            let (copies, vertices) = (&mut self.copies, is_taken.len());
            *v = *numbers[wedge as usize].get_or_insert_with(|| {
                if !std::mem::replace(&mut is_taken[*v as usize], true) {
                    return *v;
                }
                copies.push((*v, copied));
                (vertices + copies.len() - 1) as u32
            });
        }
    }

    /// The vertex of the mesh and the wedge of each, for a mesh of so many vertices.
    pub fn iter(&self, vertices: usize) -> impl Iterator<Item = (usize, Option<u32>)> + '_ {
        let own = move |v| (v, self.first.get(v).copied().flatten());
        let copies = self.copies.iter();
        (0..vertices)
            .map(own)
            .chain(copies.map(|&(v, wedge)| (v as usize, Some(wedge))))
    }

    /// How many there are, for a mesh of so many vertices.
    pub fn count(&self, vertices: usize) -> usize {
        vertices + self.copies.len()
    }
}

/// A wedge of each vertex: that of its first corner, or, where it has no corner, the wedge of its own
/// number unless that is another's.
fn first_wedges(mesh: &IndexedMesh) -> Vec<Option<u32>> {
    let attributes = mesh.attributes();
    let mut first = vec![None; mesh.positions().len()];
    let mut is_named = vec![false; attributes.wedge_count()];
    for (&v, &wedge) in corners(mesh) {
        first[v as usize].get_or_insert(wedge);
        is_named[wedge as usize] = true;
    }
    for (v, (first, is_named)) in first.iter_mut().zip(is_named).enumerate() {
        if !is_named {
            first.get_or_insert(v as u32);
        }
    }
    first
}

/// Whether a channel differs within a vertex.
pub(super) fn has_seam(mesh: &IndexedMesh, channel: &Channel) -> bool {
    let mut first = vec![None; mesh.positions().len()];
    let bits = |wedge: u32| channel.row(wedge as usize).map(f64::to_bits);
    corners(mesh).any(|(&v, &wedge)| {
        let first = *first[v as usize].get_or_insert(wedge);
        first != wedge && !bits(first).eq(bits(wedge))
    })
}

/// The vertex and the wedge of every corner.
fn corners(mesh: &IndexedMesh) -> impl Iterator<Item = (&u32, &u32)> {
    let wedges = mesh.attributes().corners.as_flattened();
    mesh.triangles().as_flattened().iter().zip(wedges)
}

/// The rows of a channel, each once.
pub(super) struct DistinctRows {
    /// A wedge that has each.
    pub wedges: Vec<u32>,
    /// Which of them each wedge has.
    pub numbers: Vec<u32>,
}

impl DistinctRows {
    /// Those of a channel, in the order in which wedges have them first.
    pub fn of(channel: &Channel) -> Self {
        let mut numbers = HashMap::new();
        let mut wedges = Vec::new();
        let number = |wedge: u32| {
            let mut bits = [0; MAX_COMPONENTS];
            let row = channel.row(wedge as usize).map(f64::to_bits);
            bits.iter_mut().zip(row).for_each(|(bits, x)| *bits = x);
            *numbers.entry(bits).or_insert_with(|| {
                wedges.push(wedge);
                wedges.len() as u32 - 1
            })
        };
        let numbers = (0..channel.rows() as u32).map(number).collect();
        DistinctRows { wedges, numbers }
    }
}
