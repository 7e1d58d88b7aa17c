//! What a mesh carries beside positions: values at the corners of its faces, and what faces belong to.

use std::cmp::Ordering;
use std::sync::Arc;

use serde_json::{Map, Value};

use crate::error::{Error, Result};

/// What a mesh carries beside positions and triangles.
///
/// A directed edge of the mesh is a corner of a face (Campagna, Kobbelt and Seidel 1998, Figure 8), and
/// a corner has a *wedge* (Hoppe 1999): one row of every channel. The corners of a vertex share one
/// wedge where the attributes are smooth. An edge whose two faces have different wedges at an end is an
/// *attribute seam*; it does not cut the mesh.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Attributes {
    /// The wedge of each triangle's corners; empty where there is no channel. A wedge belongs to one
    /// vertex.
    pub corners: Vec<[u32; 3]>,
    /// What is known of the wedges, channel by channel, all with as many rows.
    pub channels: Vec<Channel>,
    /// The group of each triangle, an index into [`groups`](Self::groups); empty where there are none.
    pub group_of: Vec<u32>,
    /// What triangles belong to.
    pub groups: Vec<Group>,
    /// The face properties that [`Group::values`] are of, by a PLY file's names.
    pub face_properties: Vec<Property>,
    /// The material libraries that an OBJ file names (`mtllib`), as it writes them.
    pub material_libraries: Vec<String>,
    /// The pictures that a PLY file names (`comment TextureFile`), which its face property `texnumber`
    /// counts.
    pub textures: Vec<String>,
    /// What a glTF file says of its materials.
    pub assets: Option<Arc<Assets>>,
    /// Whether the second texture coordinate grows downwards, as glTF's does; that of other formats
    /// grows upwards, and is 1 less it.
    pub v_is_down: bool,
    /// What the file held and is not here, in short sentences.
    pub notices: Vec<String>,
}

/// The materials of a glTF file with their textures and images, handed from reader to writer as the
/// file has them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Assets {
    /// The lists `materials`, `textures`, `samplers` and `images`, and the names of the extensions in
    /// them. The `bufferView` of an image counts in [`blobs`](Self::blobs).
    pub(crate) lists: Map<String, Value>,
    /// What groups call each material.
    pub(crate) material_names: Vec<String>,
    /// The files of images that lay in the mesh's own.
    pub(crate) blobs: Vec<Vec<u8>>,
}

/// One attribute: a few numbers a wedge.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// What the numbers are.
    pub kind: Kind,
    /// One property a component: 1 to [`MAX_COMPONENTS`] of them.
    pub components: Vec<Property>,
    /// Whether the file held it by corners of faces, not by vertices.
    pub is_by_corner: bool,
    /// The numbers, all components of a wedge side by side.
    pub values: Values,
}

/// The most components of a channel.
pub const MAX_COMPONENTS: usize = 4;

/// What the numbers of a channel are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Kind {
    /// A unit vector.
    Normal,
    /// A place in a texture.
    TextureCoordinate,
    /// Red, green and blue, maybe alpha: 0 to 1, or to the most that an integer type holds.
    Color,
    /// Anything else.
    Scalar,
}

/// A number by its name and type in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Property {
    /// Its name, as a PLY file has it.
    pub name: String,
    /// Its type.
    pub number: NumberType,
}

/// The type that a file holds a number in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum NumberType {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl NumberType {
    /// The least and the greatest number of an integer type.
    pub fn range(self) -> Option<(f64, f64)> {
        match self {
            Self::I8 => Some((i8::MIN.into(), i8::MAX.into())),
            Self::U8 => Some((0.0, u8::MAX.into())),
            Self::I16 => Some((i16::MIN.into(), i16::MAX.into())),
            Self::U16 => Some((0.0, u16::MAX.into())),
            Self::I32 => Some((i32::MIN.into(), i32::MAX.into())),
            Self::U32 => Some((0.0, u32::MAX.into())),
            Self::F32 | Self::F64 => None,
        }
    }

    /// Whether single precision holds every number of the type.
    pub fn fits_single(self) -> bool {
        !matches!(self, Self::I32 | Self::U32 | Self::F64)
    }

    /// The nearest number of the type, for one that was computed.
    pub fn nearest(self, x: f64) -> f64 {
        match self.range() {
            Some((min, max)) => x.round().clamp(min, max),
            None if self == Self::F32 => f64::from(x as f32),
            None => x,
        }
    }
}

/// Numbers, in the least precision that keeps them.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Single precision.
    Singles(Vec<f32>),
    /// Double precision.
    Doubles(Vec<f64>),
}

impl Values {
    /// An empty list for numbers of these properties.
    pub fn of(components: &[Property]) -> Self {
        if components.iter().all(|c| c.number.fits_single()) {
            Self::Singles(Vec::new())
        } else {
            Self::Doubles(Vec::new())
        }
    }

    /// How many numbers there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Singles(list) => list.len(),
            Self::Doubles(list) => list.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The number at a place.
    pub fn get(&self, i: usize) -> f64 {
        match self {
            Self::Singles(list) => list[i].into(),
            Self::Doubles(list) => list[i],
        }
    }

    /// Makes room for exactly so many more, if there is room for them.
    pub(crate) fn reserve(&mut self, numbers: usize) {
        // Without it the list grows as they come.
        let _ = match self {
            Self::Singles(list) => list.try_reserve_exact(numbers),
            Self::Doubles(list) => list.try_reserve_exact(numbers),
        };
    }

    /// Adds a number.
    pub fn push(&mut self, x: f64) {
        match self {
            Self::Singles(list) => list.push(x as f32),
            Self::Doubles(list) => list.push(x),
        }
    }

    /// The numbers of these rows, `width` each, in their order.
    #[must_use]
    pub fn rows(&self, width: usize, rows: &[u32]) -> Self {
        fn gather<T: Copy>(list: &[T], width: usize, rows: &[u32]) -> Vec<T> {
            let row = |&r: &u32| &list[r as usize * width..(r as usize + 1) * width];
            rows.iter().flat_map(row).copied().collect()
        }
        match self {
            Self::Singles(list) => Self::Singles(gather(list, width, rows)),
            Self::Doubles(list) => Self::Doubles(gather(list, width, rows)),
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Self::Singles(list) => list.capacity() * size_of::<f32>(),
            Self::Doubles(list) => list.capacity() * size_of::<f64>(),
        }
    }
}

impl Channel {
    /// A channel without a row yet.
    pub fn new(kind: Kind, components: Vec<Property>) -> Self {
        Self {
            kind,
            values: Values::of(&components),
            is_by_corner: false,
            components,
        }
    }

    /// A channel of single-precision numbers without a row yet, by the usual names of its kind.
    pub fn of_singles(kind: Kind, names: &[&str]) -> Self {
        let property = |&name: &&str| Property {
            name: name.to_string(),
            number: NumberType::F32,
        };
        Self::new(kind, names.iter().map(property).collect())
    }

    /// The numbers a row has.
    pub fn width(&self) -> usize {
        self.components.len()
    }

    /// The rows.
    pub fn rows(&self) -> usize {
        self.values.len() / self.width().max(1)
    }

    /// The numbers of a row.
    pub fn row(&self, i: usize) -> impl Iterator<Item = f64> + '_ {
        let width = self.width();
        (i * width..(i + 1) * width).map(|k| self.values.get(k))
    }
}

/// What a triangle belongs to. Empty names are none.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Group {
    /// The object (OBJ `o`, a glTF mesh).
    pub object: String,
    /// The groups (OBJ `g`), as the file writes them.
    pub name: String,
    /// The material (OBJ `usemtl`, a glTF material).
    pub material: String,
    /// The values of [`Attributes::face_properties`].
    pub values: Vec<f64>,
}

impl Attributes {
    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        self.channels.is_empty()
            && self.group_of.is_empty()
            && self.material_libraries.is_empty()
            && self.textures.is_empty()
            && self.assets.is_none()
    }

    /// The number of wedges.
    pub fn wedge_count(&self) -> usize {
        self.channels.first().map_or(0, Channel::rows)
    }

    /// The bytes that the arrays hold.
    pub fn bytes(&self) -> usize {
        let values = self.channels.iter().map(|c| c.values.bytes());
        let blobs = self.assets.iter().flat_map(|assets| &assets.blobs);
        self.corners.capacity() * size_of::<[u32; 3]>()
            + self.group_of.capacity() * size_of::<u32>()
            + values.sum::<usize>()
            + blobs.map(Vec::capacity).sum::<usize>()
    }

    /// Lets the second texture coordinate grow the other way.
    pub(crate) fn turn_v(&mut self) {
        self.v_is_down = !self.v_is_down;
        let is_texture = |channel: &&mut Channel| channel.kind == Kind::TextureCoordinate;
        for channel in self.channels.iter_mut().filter(is_texture) {
            let width = channel.width();
            let Some(v) = channel.components.get(1) else {
                continue;
            };
            let most = v.number.range().map_or(1.0, |(_, most)| most);
            match &mut channel.values {
                Values::Singles(list) => {
                    let all = list.iter_mut().skip(1).step_by(width);
                    all.for_each(|v| *v = (most - f64::from(*v)) as f32);
                }
                Values::Doubles(list) => {
                    let all = list.iter_mut().skip(1).step_by(width);
                    all.for_each(|v| *v = most - *v);
                }
            }
        }
    }

    /// Drops what the corners and triangles say, and keeps what it was about.
    pub(crate) fn forget_values(&mut self) {
        self.corners = Vec::new();
        self.group_of = Vec::new();
        for channel in &mut self.channels {
            channel.values = Values::of(&channel.components);
        }
    }

    /// Keeps the wedges that a corner names, in their order.
    pub fn drop_unused_wedges(&mut self) {
        let mut is_used = vec![false; self.wedge_count()];
        for &wedge in self.corners.as_flattened() {
            is_used[wedge as usize] = true;
        }
        if is_used.iter().all(|&used| used) {
            return;
        }
        let mut used = Vec::new();
        let mut new = vec![0; is_used.len()];
        for (wedge, _) in is_used.iter().enumerate().filter(|(_, used)| **used) {
            new[wedge] = used.len() as u32;
            used.push(wedge as u32);
        }
        for wedge in self.corners.as_flattened_mut() {
            *wedge = new[*wedge as usize];
        }
        for channel in &mut self.channels {
            channel.values = channel.values.rows(channel.width(), &used);
        }
    }

    /// Lets the corners of each vertex name one wedge where their wedges say the same, bit for bit.
    /// Takes a logarithm in the wedges at a vertex for each.
    pub fn merge_equal_wedges(&mut self, triangles: &[[u32; 3]]) {
        let compare = |channels: &[Channel], a: u32, b: u32| {
            let pairs = channels.iter().flat_map(|channel| {
                let (a, b) = (channel.row(a as usize), channel.row(b as usize));
                a.zip(b)
            });
            let mut orders = pairs.map(|(a, b)| a.total_cmp(&b));
            orders
                .find(|order| order.is_ne())
                .unwrap_or(Ordering::Equal)
        };
        let corners = triangles
            .as_flattened()
            .iter()
            .zip(self.corners.as_flattened());
        let mut wedges: Vec<(u32, u32)> = corners.map(|(&v, &wedge)| (v, wedge)).collect();
        wedges.sort_unstable();
        wedges.dedup();
        let mut first: Vec<u32> = (0..self.wedge_count() as u32).collect();
        for at_vertex in wedges
            .chunk_by_mut(|a, b| a.0 == b.0)
            .filter(|w| w.len() > 1)
        {
            at_vertex.sort_by(|a, b| compare(&self.channels, a.1, b.1).then(a.1.cmp(&b.1)));
            for same in at_vertex.chunk_by(|a, b| compare(&self.channels, a.1, b.1).is_eq()) {
                same.iter().for_each(|w| first[w.1 as usize] = same[0].1);
            }
        }
        for wedge in self.corners.as_flattened_mut() {
            *wedge = first[*wedge as usize];
        }
        self.drop_unused_wedges();
    }

    /// Gives each vertex wedges of its own, where corners of several name the same one.
    pub fn split_shared_wedges(&mut self, triangles: &[[u32; 3]]) {
        let corners = triangles
            .as_flattened()
            .iter()
            .zip(self.corners.as_flattened());
        let mut pairs: Vec<(u32, u32)> = corners.map(|(&v, &wedge)| (wedge, v)).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let is_shared = pairs.windows(2).any(|pair| pair[0].0 == pair[1].0);
        if !is_shared {
            return;
        }
        let corners = triangles
            .as_flattened()
            .iter()
            .zip(self.corners.as_flattened_mut());
        for (&v, wedge) in corners {
            let own = pairs.binary_search(&(*wedge, v)).expect("it was listed");
            *wedge = own as u32;
        }
        let rows: Vec<u32> = pairs.iter().map(|&(wedge, _)| wedge).collect();
        for channel in &mut self.channels {
            channel.values = channel.values.rows(channel.width(), &rows);
        }
    }

    /// Keeps the triangles whose flag is set.
    pub(crate) fn retain_triangles(&mut self, keep: &[bool]) {
        let mut flags = keep.iter();
        self.corners.retain(|_| flags.next() == Some(&true));
        let mut flags = keep.iter();
        self.group_of.retain(|_| flags.next() == Some(&true));
    }

    /// Whether this fits a mesh.
    pub(crate) fn check(&self, triangles: &[[u32; 3]]) -> Result<()> {
        let invalid = |what: String| Err(Error::InvalidMesh(what));
        let wedges = self.wedge_count();
        for (i, channel) in self.channels.iter().enumerate() {
            let (width, values) = (channel.width(), channel.values.len());
            if width == 0 || width > MAX_COMPONENTS || values != wedges * width {
                return invalid(format!(
                    "attribute {i} has {values} values of {width} components for {wedges} wedges"
                ));
            }
        }
        let expected = if self.channels.is_empty() {
            0
        } else {
            triangles.len()
        };
        if self.corners.len() != expected {
            let found = self.corners.len();
            return invalid(format!("wedges of {found} triangles where {expected} are"));
        }
        let mut vertex_of = vec![None; wedges];
        for (i, (triangle, corners)) in triangles.iter().zip(&self.corners).enumerate() {
            for (&v, &wedge) in triangle.iter().zip(corners) {
                let Some(vertex) = vertex_of.get_mut(wedge as usize) else {
                    return invalid(format!(
                        "triangle {i} uses wedge {wedge}; the mesh has {wedges} (counted from 0)"
                    ));
                };
                if *vertex.get_or_insert(v) != v {
                    return invalid(format!("wedge {wedge} is used at two vertices"));
                }
            }
        }
        if !self.group_of.is_empty() && self.group_of.len() != triangles.len() {
            let (found, expected) = (self.group_of.len(), triangles.len());
            return invalid(format!("groups of {found} triangles where {expected} are"));
        }
        let groups = self.groups.len();
        if let Some(group) = self.group_of.iter().find(|&&g| g as usize >= groups) {
            return invalid(format!(
                "a triangle is of group {group}; the mesh has {groups} (counted from 0)"
            ));
        }
        let properties = self.face_properties.len();
        if self.groups.iter().any(|g| g.values.len() != properties) {
            return invalid(format!(
                "a group has not one value for each of {properties} properties"
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> (Vec<[u32; 3]>, Attributes) {
        let mut channel = Channel::of_singles(Kind::TextureCoordinate, &["s", "t"]);
        (0..10).for_each(|x| channel.values.push(x.into()));
        let attributes = Attributes {
            corners: vec![[0, 1, 2], [0, 2, 4]],
            channels: vec![channel],
            group_of: vec![0, 0],
            groups: vec![Group::default()],
            ..Attributes::default()
        };
        (vec![[0, 1, 2], [0, 2, 3]], attributes)
    }

    #[test]
    fn what_does_not_fit_the_mesh_is_an_error() {
        let (triangles, attributes) = square();
        assert!(attributes.check(&triangles).is_ok());
        let wrong = |change: fn(&mut Attributes)| {
            let mut attributes = attributes.clone();
            change(&mut attributes);
            attributes.check(&triangles).unwrap_err().to_string()
        };
        let expected = "triangle 1 uses wedge 5; the mesh has 5";
        assert!(wrong(|a| a.corners[1][2] = 5).contains(expected));
        assert!(wrong(|a| a.corners[1][2] = 1).contains("wedge 1 is used at two vertices"));
        assert!(wrong(|a| a.corners.truncate(1)).contains("wedges of 1 triangles where 2 are"));
        assert!(wrong(|a| a.channels[0].values.push(1.0)).contains("11 values of 2 components"));
        assert!(wrong(|a| a.group_of[0] = 1).contains("of group 1; the mesh has 1"));
        assert!(wrong(|a| a.group_of.truncate(1)).contains("groups of 1 triangles"));
        assert!(wrong(|a| a.groups[0].values.push(1.0)).contains("not one value"));
    }

    #[test]
    fn wedges_that_no_corner_names_are_dropped() {
        let (_, mut attributes) = square();
        attributes.drop_unused_wedges();
        assert_eq!(attributes.corners, [[0, 1, 2], [0, 2, 3]]);
        let expected = Values::Singles(vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 8.0, 9.0]);
        assert_eq!(attributes.channels[0].values, expected);
    }

    /// Two vertices share a wedge until each has its own; two wedges of a vertex that say the same
    /// become one.
    #[test]
    fn wedges_are_split_and_merged() {
        let (triangles, mut attributes) = square();
        let before: Vec<Vec<f64>> = rows_of_corners(&attributes);
        attributes.merge_equal_wedges(&triangles);
        assert_eq!(attributes.wedge_count(), 4);
        attributes.corners = vec![[0, 1, 1], [0, 1, 3]];
        attributes.split_shared_wedges(&triangles);
        assert!(attributes.check(&triangles).is_ok());
        assert_eq!(attributes.wedge_count(), 4);
        let after = rows_of_corners(&attributes);
        assert_eq!(after[2], before[1]);
        assert_eq!(after[5], before[5]);
        attributes.corners = vec![[0, 1, 2], [3, 2, 0]];
        attributes.channels[0].values =
            Values::Singles(vec![1.0, 2.0, 5.0, 6.0, 7.0, 8.0, 1.0, 2.0]);
        let triangles = [[0, 1, 2], [0, 2, 3]];
        attributes.corners[1][2] = 1;
        attributes.split_shared_wedges(&triangles);
        attributes.merge_equal_wedges(&triangles);
        assert_eq!(attributes.wedge_count(), 4);
        assert_eq!(attributes.corners[0][0], attributes.corners[1][0]);
    }

    fn rows_of_corners(attributes: &Attributes) -> Vec<Vec<f64>> {
        let wedges = attributes.corners.as_flattened().iter();
        wedges
            .map(|&w| attributes.channels[0].row(w as usize).collect())
            .collect()
    }

    /// Integers of 32 bits and doubles do not fit single precision.
    #[test]
    fn values_keep_what_their_type_holds() {
        for (number, x) in [(NumberType::I32, 16_777_217.0), (NumberType::F64, 0.1)] {
            let name = "quality".into();
            let mut channel = Channel::new(Kind::Scalar, vec![Property { name, number }]);
            channel.values.push(x);
            assert_eq!(channel.row(0).next(), Some(x));
        }
        assert_eq!(NumberType::U8.nearest(254.6), 255.0);
        assert_eq!(NumberType::U8.nearest(300.0), 255.0);
        assert_eq!(NumberType::F64.nearest(0.1), 0.1);
    }
}
