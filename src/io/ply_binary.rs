//! The elements of a binary PLY file whose layout is plain, decoded from blocks: vertices of
//! numbers, faces of one list with numbers beside it, and whatever has one size and no meaning here.

use std::ops::Range;

use ply_rs_bw::ply::{ElementDef, PropertyType, ScalarType};

use crate::attributes::{MAX_COMPONENTS, Values};
use crate::error::{Error, Place, Result};

use super::blocks::Blocks;
use super::ply::{Fault, Sink};
use super::ply_attributes::Carried;
use super::ply_header::{AXES, CORNERS, Role, TEXTURE_COORDINATES, WEIGHT};

/// How the elements of one definition lie in the file.
pub(super) enum Plain {
    Vertices(Vertices),
    Faces(Faces),
    /// Elements of that many bytes each that the mesh does not take.
    Other(usize),
}

/// Vertices of numbers.
pub(super) struct Vertices {
    bytes: usize,
    axes: [Number; 3],
    weight: Option<Number>,
    /// Whether the coordinates are 32-bit floats.
    single: bool,
    /// The components of each channel.
    channels: Vec<Vec<Number>>,
}

/// Faces of one list with numbers before and behind it, or of two.
pub(super) struct Faces {
    bytes_before: usize,
    corners: List,
    bytes_behind: usize,
    /// Texture coordinates, and the bytes behind them.
    more: Option<(List, usize)>,
    /// What tells groups apart.
    groups: Vec<(Stretch, Number)>,
}

/// A list of numbers.
struct List {
    count: ScalarType,
    item: ScalarType,
}

/// Where in a face a number has its place: before the corners, behind them, behind texture coordinates.
#[derive(Clone, Copy)]
enum Stretch {
    Before,
    Behind,
    Last,
}

/// A number in an element: its type, and its distance from the element's first byte, or from where its
/// stretch begins.
struct Number {
    scalar: ScalarType,
    at: usize,
}

impl Plain {
    /// The layout of the elements that `def` defines, where it is plain.
    pub fn of(def: &ElementDef, vertex_weight: Option<&str>, carried: &Carried) -> Option<Plain> {
        let role = Role::of(def);
        if role == Role::Face {
            return Plain::faces(def, carried);
        }
        let types: Vec<_> = def.properties.values().map(|p| &p.data_type).collect();
        let bytes = size_of_numbers(&types)?;
        match role {
            Role::Vertex { single } => {
                let [x, y, z] = AXES.map(|axis| Number::of(def, axis));
                let weight = match vertex_weight {
                    Some(axis) if AXES.contains(&axis) => Some(Number::of(def, axis)?),
                    Some(_) => Some(Number::of(def, WEIGHT)?),
                    None => None,
                };
                let channel = |numbers: &Vec<usize>| {
                    let number = |&i: &usize| Number::at(def, 0, i);
                    numbers.iter().map(number).collect()
                };
                let channels: Option<_> = carried.channels.iter().map(channel).collect();
                Some(Plain::Vertices(Vertices {
                    bytes,
                    axes: [x?, y?, z?],
                    weight,
                    single,
                    channels: channels?,
                }))
            }
            Role::Face | Role::Strips => None,
            Role::Other => Some(Plain::Other(bytes)),
        }
    }

    fn faces(def: &ElementDef, carried: &Carried) -> Option<Plain> {
        let corners = def.properties.get_index_of(CORNERS)?;
        let more = if carried.has_texture_coordinates {
            let more = def.properties.get_index_of(TEXTURE_COORDINATES)?;
            Some(more).filter(|&more| more > corners)
        } else {
            None
        };
        let types: Vec<_> = def.properties.values().map(|p| &p.data_type).collect();
        let end = more.unwrap_or(types.len());
        let last = match more {
            Some(more) => Some((List::of(types[more])?, size_of_numbers(&types[more + 1..])?)),
            None => None,
        };
        let group = |&i: &usize| {
            let (stretch, first) = match more {
                _ if i < corners => (Stretch::Before, 0),
                Some(more) if i > more => (Stretch::Last, more + 1),
                _ => (Stretch::Behind, corners + 1),
            };
            Some((stretch, Number::at(def, first, i)?))
        };
        let groups: Option<_> = carried.groups.iter().map(group).collect();
        Some(Plain::Faces(Faces {
            bytes_before: size_of_numbers(&types[..corners])?,
            corners: List::of(types[corners])?,
            bytes_behind: size_of_numbers(&types[corners + 1..end])?,
            more: last,
            groups: groups?,
        }))
    }
}

impl List {
    fn of(data_type: &PropertyType) -> Option<List> {
        match data_type {
            PropertyType::List(count, item) => Some(List {
                count: count.clone(),
                item: item.clone(),
            }),
            PropertyType::Scalar(_) => None,
        }
    }

    /// Where the list that begins at `at` begins and ends behind its length.
    fn range<const BIG: bool>(
        &self,
        block: &[u8],
        at: usize,
    ) -> std::result::Result<Range<usize>, Stop> {
        let begin = at + size_of_scalar(&self.count);
        if block.len() < begin {
            return Err(Stop::Wanted(begin));
        }
        let count = integer::<BIG>(&self.count, &block[at..]);
        let count = usize::try_from(count).map_err(|_| Stop::Fault(Fault::NegativeLength))?;
        let end = count
            .saturating_mul(size_of_scalar(&self.item))
            .saturating_add(begin);
        Ok(begin..end)
    }
}

impl Number {
    /// The property of that name, where it and all before it are numbers.
    fn of(def: &ElementDef, name: &str) -> Option<Number> {
        Number::at(def, 0, def.properties.get_index_of(name)?)
    }

    /// Property `i` in the stretch that begins with property `first`, where all in between are numbers.
    fn at(def: &ElementDef, first: usize, i: usize) -> Option<Number> {
        let PropertyType::Scalar(scalar) = &def.properties[i].data_type else {
            return None;
        };
        let types: Vec<_> = def.properties.values().map(|p| &p.data_type).collect();
        Some(Number {
            scalar: scalar.clone(),
            at: size_of_numbers(&types[first..i])?,
        })
    }

    fn read<const BIG: bool>(&self, element: &[u8]) -> f64 {
        number::<BIG>(&self.scalar, &element[self.at..])
    }
}

/// Takes the elements of one definition from the file into the mesh.
pub(super) struct Decoder<'a, 'b> {
    pub def: &'a ElementDef,
    pub blocks: &'a mut Blocks,
    pub sink: &'a mut Sink<'b>,
}

impl Decoder<'_, '_> {
    /// Reads all of them, whose numbers have their highest byte first if `BIG`.
    ///
    /// # Errors
    /// Those of the decoder for every layout, in its words.
    pub fn read<const BIG: bool>(&mut self, plain: &Plain) -> Result<()> {
        match plain {
            Plain::Vertices(layout) => self.vertices::<BIG>(layout),
            Plain::Faces(layout) => self.faces::<BIG>(layout),
            Plain::Other(bytes) => self.in_blocks(*bytes, |_, _| Ok(())),
        }
    }

    /// Hands elements of `bytes` each to `take`, as many at a time as there are in a block; what it
    /// finds wrong is with the number of the element in the block.
    fn in_blocks(
        &mut self,
        bytes: usize,
        mut take: impl FnMut(&mut Sink, &[u8]) -> std::result::Result<(), (usize, Fault)>,
    ) -> Result<()> {
        let mut i = 0;
        while i < self.def.count {
            let block = self.blocks.peek(bytes)?;
            let n = (block.len() / bytes).min(self.def.count - i);
            if n == 0 {
                return Err(self.error(i, Fault::End));
            }
            if let Err((k, fault)) = take(self.sink, &block[..n * bytes]) {
                self.blocks.consume(k * bytes);
                return Err(self.error(i + k, fault));
            }
            self.blocks.consume(n * bytes);
            i += n;
        }
        Ok(())
    }

    fn vertices<const BIG: bool>(&mut self, layout: &Vertices) -> Result<()> {
        if let Some(left) = self.bytes_left() {
            let promised = self.def.count.min(left / layout.bytes);
            self.sink.builder.reserve_vertices(promised);
            for channel in &mut self.sink.builder.attributes().channels {
                channel.values.reserve(promised * channel.width());
            }
        }
        let [x, y, z] = layout.axes.each_ref().map(|axis| axis.at);
        let single = |bytes: &[u8]| f32::from_le_bytes(low_first::<BIG, 4>(bytes));
        self.in_blocks(layout.bytes, |sink, block| {
            let elements = block.chunks_exact(layout.bytes);
            if let Some(weight) = &layout.weight {
                for (k, element) in elements.clone().enumerate() {
                    let fault = |weight| (k, Fault::Weight(weight));
                    sink.push_weight(weight.read::<BIG>(element))
                        .map_err(fault)?;
                }
            }
            let channels = &mut sink.builder.attributes().channels;
            for (channel, numbers) in channels.iter_mut().zip(&layout.channels) {
                push_numbers::<BIG>(&mut channel.values, numbers, elements.clone());
            }
            if layout.single && [y, z] == [x + 4, x + 8] {
                sink.builder.push_singles(elements.map(|element| {
                    let xyz: &[u8; 12] = element[x..].first_chunk().expect("three numbers");
                    [0, 4, 8].map(|at| single(&xyz[at..]))
                }));
            } else if layout.single {
                let position = |element: &[u8]| [x, y, z].map(|at| single(&element[at..]));
                sink.builder.push_singles(elements.map(position));
            } else {
                for element in elements {
                    let position = layout.axes.each_ref().map(|axis| axis.read::<BIG>(element));
                    sink.builder.push_double(position);
                }
            }
            Ok(())
        })
    }

    fn faces<const BIG: bool>(&mut self, layout: &Faces) -> Result<()> {
        if let Some(left) = self.bytes_left()
            && layout.more.is_none()
        {
            let triangles = layout.triangles_in(self.def.count, left);
            self.sink.builder.reserve_triangles(triangles);
        }
        let Decoder { def, blocks, sink } = self;
        let mut face = Face::default();
        let (mut i, mut wanted) = (0, 1);
        while i < def.count {
            let block = blocks.peek(wanted)?;
            if block.len() < wanted {
                return Err(self.error(i, Fault::End));
            }
            let mut at = 0;
            let stop = loop {
                let triangles = layout.triangles::<BIG>(&block[at..], def.count - i, sink);
                at += triangles * layout.bytes_of_triangle();
                i += triangles;
                if i == def.count {
                    break Stop::Wanted(0);
                }
                match layout.polygon::<BIG>(&block[at..], sink, &mut face) {
                    Ok(bytes) => at += bytes,
                    Err(stop) => break stop,
                }
                i += 1;
            };
            blocks.consume(at);
            match stop {
                Stop::Wanted(bytes) => wanted = bytes,
                Stop::Fault(fault) => return Err(self.error(i, fault)),
            }
        }
        Ok(())
    }

    /// How many bytes follow, where that is known; what does not fit is more than enough.
    fn bytes_left(&self) -> Option<usize> {
        let left = self.blocks.bytes_left()?;
        Some(usize::try_from(left).unwrap_or(usize::MAX))
    }

    /// The error for element `i`, which begins at the next byte.
    fn error(&self, i: usize, fault: Fault) -> Error {
        let place = Place::Byte(self.blocks.position());
        let (found, expected) = fault.found_and_expected(self.def, i, self.sink.vertices);
        self.blocks.input().error(place, &found, &expected)
    }
}

/// Why no face can be taken.
enum Stop {
    /// It takes that many bytes.
    Wanted(usize),
    Fault(Fault),
}

impl Faces {
    /// The triangles of `count` faces in so many bytes, if these hold nothing else and no face has
    /// fewer than two corners.
    fn triangles_in(&self, count: usize, bytes: usize) -> usize {
        let beside = self.bytes_before + size_of_scalar(&self.corners.count) + self.bytes_behind;
        let lists = bytes.saturating_sub(count.saturating_mul(beside));
        (lists / size_of_scalar(&self.corners.item)).saturating_sub(count.saturating_mul(2))
    }

    fn bytes_of_triangle(&self) -> usize {
        let list = size_of_scalar(&self.corners.count) + 3 * size_of_scalar(&self.corners.item);
        self.bytes_before + list + self.bytes_behind
    }

    /// Takes the triangles without fault that `block` begins with, if they have the usual types and
    /// nothing else that matters, but no more than `most`; returns how many.
    fn triangles<const BIG: bool>(&self, block: &[u8], most: usize, sink: &mut Sink) -> usize {
        if self.more.is_some() || !self.groups.is_empty() {
            return 0;
        }
        let vertices = match (&self.corners.count, &self.corners.item) {
            // What is negative is 2^31 or more here.
            (ScalarType::UChar, ScalarType::Int) => sink.vertices.min(1 << 31) as u32,
            (ScalarType::UChar, ScalarType::UInt) => sink.vertices.min(u32::MAX as usize) as u32,
            _ => return 0,
        };
        let before = self.bytes_before;
        let faces = block.chunks_exact(self.bytes_of_triangle()).take(most);
        let corners = |face: &[u8]| -> [u32; 3] {
            let list: &[u8; 12] = face[before + 1..].first_chunk().expect("three corners");
            [0, 4, 8].map(|at| u32::from_le_bytes(low_first::<BIG, 4>(&list[at..])))
        };
        let is_triangle =
            |face: &[u8]| face[before] == 3 && corners(face).iter().all(|&v| v < vertices);
        let other = faces.clone().position(|face| !is_triangle(face));
        let n = other.unwrap_or(faces.len());
        sink.builder.push_triangles(faces.take(n).map(corners));
        n
    }

    /// Takes the face that `block` begins with, whatever it is, and returns its bytes.
    fn polygon<const BIG: bool>(
        &self,
        block: &[u8],
        sink: &mut Sink,
        face: &mut Face,
    ) -> std::result::Result<usize, Stop> {
        let corners = self.corners.range::<BIG>(block, self.bytes_before)?;
        let behind = corners.end;
        let mut end = behind.saturating_add(self.bytes_behind);
        if block.len() < end {
            return Err(Stop::Wanted(end));
        }
        let mut last = end;
        face.texture_coordinates.clear();
        if let Some((list, bytes_behind)) = &self.more {
            let range = list.range::<BIG>(block, end)?;
            last = range.end;
            end = last.saturating_add(*bytes_behind);
            if block.len() < end {
                return Err(Stop::Wanted(end));
            }
            let items = block[range].chunks_exact(size_of_scalar(&list.item));
            let numbers = items.map(|item| number::<BIG>(&list.item, item));
            face.texture_coordinates.extend(numbers);
        }
        face.corners.clear();
        for corner in block[corners].chunks_exact(size_of_scalar(&self.corners.item)) {
            let v = integer::<BIG>(&self.corners.item, corner);
            face.corners.push(sink.corner(v).map_err(Stop::Fault)?);
        }
        face.values.clear();
        face.values
            .extend(self.groups.iter().map(|(stretch, number)| {
                let begin = match stretch {
                    Stretch::Before => 0,
                    Stretch::Behind => behind,
                    Stretch::Last => last,
                };
                number.read::<BIG>(&block[begin..])
            }));
        sink.push_face(&face.corners, &face.values, &face.texture_coordinates);
        Ok(end)
    }
}

/// What a face has.
#[derive(Default)]
struct Face {
    corners: Vec<u32>,
    /// What tells groups apart.
    values: Vec<f64>,
    texture_coordinates: Vec<f64>,
}

/// Adds the numbers of each element; where they have one of the usual types, that is asked for once.
fn push_numbers<'a, const BIG: bool>(
    values: &mut Values,
    numbers: &[Number],
    elements: impl Iterator<Item = &'a [u8]>,
) {
    let is_all = |scalar: ScalarType| numbers.iter().all(|number| number.scalar == scalar);
    match values {
        Values::Singles(list) if is_all(ScalarType::Float) => {
            let single = |bytes: &[u8]| f32::from_le_bytes(low_first::<BIG, 4>(bytes));
            gather(list, numbers, elements, single);
        }
        Values::Singles(list) if is_all(ScalarType::UChar) => {
            gather(list, numbers, elements, |bytes: &[u8]| bytes[0].into());
        }
        values => {
            for element in elements {
                let all = numbers.iter().map(|number| number.read::<BIG>(element));
                all.for_each(|x| values.push(x));
            }
        }
    }
}

/// Adds what `read` finds at each number of each element.
fn gather<'a>(
    list: &mut Vec<f32>,
    numbers: &[Number],
    elements: impl Iterator<Item = &'a [u8]>,
    read: impl Fn(&[u8]) -> f32,
) {
    fn gather<'a, const N: usize>(
        list: &mut Vec<f32>,
        numbers: &[Number],
        elements: impl Iterator<Item = &'a [u8]>,
        read: impl Fn(&[u8]) -> f32,
    ) {
        let places: [usize; N] = std::array::from_fn(|k| numbers[k].at);
        list.extend(elements.flat_map(|element| places.map(|at| read(&element[at..]))));
    }
    match numbers.len() {
        1 => gather::<1>(list, numbers, elements, read),
        2 => gather::<2>(list, numbers, elements, read),
        3 => gather::<3>(list, numbers, elements, read),
        n => {
            assert_eq!(n, MAX_COMPONENTS, "components of a channel");
            gather::<MAX_COMPONENTS>(list, numbers, elements, read);
        }
    }
}

/// The bytes of properties that are all numbers.
fn size_of_numbers(types: &[&PropertyType]) -> Option<usize> {
    types.iter().try_fold(0, |sum, data_type| match data_type {
        PropertyType::Scalar(scalar) => Some(sum + size_of_scalar(scalar)),
        PropertyType::List(..) => None,
    })
}

fn size_of_scalar(scalar: &ScalarType) -> usize {
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// The first `N` bytes, the lowest first.
#[inline]
fn low_first<const BIG: bool, const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut bytes = *bytes.first_chunk().expect("a whole number");
    if BIG {
        bytes.reverse();
    }
    bytes
}

fn number<const BIG: bool>(scalar: &ScalarType, bytes: &[u8]) -> f64 {
    match scalar {
        ScalarType::Float => f32::from_le_bytes(low_first::<BIG, 4>(bytes)).into(),
        ScalarType::Double => f64::from_le_bytes(low_first::<BIG, 8>(bytes)),
        // At most 32 bits.
        integer => self::integer::<BIG>(integer, bytes) as f64,
    }
}

fn integer<const BIG: bool>(scalar: &ScalarType, bytes: &[u8]) -> i64 {
    match scalar {
        ScalarType::Char => i8::from_le_bytes(low_first::<BIG, 1>(bytes)).into(),
        ScalarType::UChar => bytes[0].into(),
        ScalarType::Short => i16::from_le_bytes(low_first::<BIG, 2>(bytes)).into(),
        ScalarType::UShort => u16::from_le_bytes(low_first::<BIG, 2>(bytes)).into(),
        ScalarType::Int => i32::from_le_bytes(low_first::<BIG, 4>(bytes)).into(),
        ScalarType::UInt => u32::from_le_bytes(low_first::<BIG, 4>(bytes)).into(),
        ScalarType::Float | ScalarType::Double => unreachable!("the header's types are checked"),
    }
}

#[cfg(test)]
mod tests {
    use super::super::input::Input;
    use super::super::ply::{self, Wanted};
    use super::*;
    use crate::indexed_mesh::{IndexedMesh, MeshBuilder};

    /// The mesh in a file in which `plain` finds the plain layouts.
    fn read_with(
        input: Input,
        vertex_weight: Option<&str>,
        plain: impl Fn(&ElementDef, Option<&str>, &Carried) -> Option<Plain>,
    ) -> Result<IndexedMesh> {
        let mut builder = MeshBuilder::default();
        let wanted = Wanted {
            vertex_weight,
            attributes: true,
        };
        ply::read_with(input, wanted, plain, &mut builder)?;
        builder.finish()
    }

    const TYPES: [&str; 8] = [
        "char", "uchar", "short", "ushort", "int", "uint", "float", "double",
    ];

    /// Marsaglia's xorshift.
    struct Random(u64);

    impl Random {
        fn below(&mut self, n: usize) -> usize {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 20) as usize % n
        }

        /// Once in `n` times.
        fn one_in(&mut self, n: usize) -> bool {
            self.below(n) == 0
        }
    }

    /// A binary file that is made property by property.
    struct Made {
        random: Random,
        big: bool,
        header: String,
        body: Vec<u8>,
    }

    impl Made {
        fn put(&mut self, data_type: &str, x: f64) {
            let mut bytes = match data_type {
                "char" | "uchar" => vec![x as i64 as u8],
                "short" | "ushort" => (x as i64 as u16).to_le_bytes().to_vec(),
                "int" | "uint" => (x as i64 as u32).to_le_bytes().to_vec(),
                "float" => (x as f32).to_le_bytes().to_vec(),
                _ => x.to_le_bytes().to_vec(),
            };
            if self.big {
                bytes.reverse();
            }
            self.body.extend(bytes);
        }

        fn any_type(&mut self) -> &'static str {
            TYPES[self.random.below(8)]
        }

        /// Names with types beside those that make the mesh.
        fn company(&mut self, most: usize) -> Vec<(String, String)> {
            let names = [
                "red", "green", "blue", "alpha", "nx", "ny", "nz", "s", "t", "quality", "flags",
                "label",
            ];
            let n = self.random.below(most + 1);
            let first = self.random.below(names.len());
            let same = self.random.one_in(2).then(|| self.any_type());
            let names = names.iter().cycle().skip(first).take(n);
            names
                .map(|name| {
                    let data_type = same.unwrap_or_else(|| self.any_type());
                    (name.to_string(), data_type.to_string())
                })
                .collect()
        }

        /// Adds the elements: `value` gives the numbers of a property, which are more than one in a
        /// list.
        fn element(
            &mut self,
            name: &str,
            count: usize,
            properties: &[(String, String)],
            value: impl Fn(&mut Random, &str, usize) -> Vec<f64>,
        ) {
            self.header += &format!("element {name} {count}\n");
            for (property, data_type) in properties {
                self.header += &format!("property {data_type} {property}\n");
            }
            for i in 0..count {
                for (property, data_type) in properties {
                    let numbers = value(&mut self.random, property, i);
                    if let ["list", length, item] = data_type.split(' ').collect::<Vec<_>>()[..] {
                        let negative = self.random.one_in(400);
                        self.put(length, if negative { -1.0 } else { numbers.len() as f64 });
                        for x in numbers {
                            self.put(item, x);
                        }
                    } else {
                        self.put(data_type, numbers[0]);
                    }
                }
            }
        }

        fn vertices(&mut self, count: usize) {
            let same = self.random.one_in(2).then_some("float");
            let mut properties = self.company(8);
            if self.random.one_in(3) {
                properties.clear();
            }
            if self.random.one_in(2) {
                let weight = ("w".to_string(), self.any_type().to_string());
                properties.push(weight);
            }
            for axis in ["z", "y", "x"] {
                let data_type = same.unwrap_or_else(|| self.any_type());
                let in_order = same.is_some() && self.random.below(4) > 0;
                let at = if in_order {
                    0
                } else {
                    self.random.below(properties.len() + 1)
                };
                properties.insert(at, (axis.to_string(), data_type.to_string()));
            }
            if self.random.one_in(5) {
                let at = self.random.below(properties.len() + 1);
                properties.insert(at, ("extra".to_string(), "list uchar short".to_string()));
            }
            self.element(
                "vertex",
                count,
                &properties,
                |random, property, i| match property {
                    "extra" => vec![1.0; random.below(3)],
                    "w" if random.one_in(200) => vec![f64::NAN],
                    "w" => vec![random.below(5) as f64],
                    _ => vec![
                        i as f64
                            + random.below(100) as f64 / if random.one_in(2) { 1.0 } else { 3.0 },
                    ],
                },
            );
        }

        fn faces(&mut self, count: usize, vertices: usize) {
            let usual = self.random.one_in(2);
            let (length, corner) = if usual {
                ("uchar", ["int", "uint"][self.random.below(2)])
            } else {
                (TYPES[self.random.below(6)], TYPES[self.random.below(6)])
            };
            let mut properties = self.company(4);
            let at = self.random.below(properties.len() + 1);
            let name = ["vertex_indices", "vertex_index"][self.random.below(2)];
            properties.insert(at, (name.to_string(), format!("list {length} {corner}")));
            if self.random.one_in(3) {
                let at = self.random.below(properties.len() + 1);
                properties.insert(at, ("texcoord".to_string(), "list uchar float".to_string()));
            }
            let all_triangles = self.random.one_in(2);
            self.element("face", count, &properties, |random, property, _| {
                if property == "texcoord" {
                    let numbers = [6, 6, 6, 6, 6, 6, 8, 0, 5][random.below(9)];
                    return (0..numbers).map(|_| random.below(4) as f64 / 3.0).collect();
                }
                if !property.starts_with("vertex") {
                    return vec![(random.below(100) / 60) as f64];
                }
                let corners = if all_triangles || random.below(3) > 0 {
                    3
                } else {
                    random.below(9)
                };
                (0..corners)
                    .map(|_| match random.below(900) {
                        0 => vertices as f64,
                        1 => -1.0,
                        _ => random.below(vertices) as f64,
                    })
                    .collect()
            });
        }

        /// A file with elements of many layouts and few faults.
        fn file(seed: u64) -> Vec<u8> {
            let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
            for _ in 0..8 {
                random.below(1);
            }
            let big = random.one_in(2);
            let order = if big { "big" } else { "little" };
            let header = format!("ply\nformat binary_{order}_endian 1.0\n");
            let mut made = Made {
                random,
                big,
                header,
                body: Vec::new(),
            };
            let vertices = 1 + made.random.below(60);
            let faces = made.random.below(60);
            let faces_first = made.random.one_in(6);
            if faces_first {
                made.faces(faces, vertices);
            }
            if made.random.one_in(3) {
                let mut properties = made.company(5);
                if made.random.one_in(3) {
                    properties.push(("list".to_string(), "list ushort double".to_string()));
                }
                let count = made.random.below(30);
                made.element("camera", count, &properties, |random, _, _| {
                    vec![1.0; 1 + random.below(4)]
                });
            }
            made.vertices(vertices);
            if !faces_first {
                made.faces(faces, vertices);
            }
            if made.random.one_in(5) {
                let strips = [("vertex_indices".to_string(), "list int int".to_string())];
                made.element("tristrips", 2, &strips, |random, _, _| {
                    (0..6).map(|_| random.below(vertices) as f64).collect()
                });
            }
            [made.header.as_bytes(), b"end_header\n", &made.body].concat()
        }
    }

    /// A mesh or a message, with every bit of it that matters.
    fn shown(result: Result<IndexedMesh>) -> String {
        match result {
            Ok(mesh) => format!("{mesh:?}"),
            Err(error) => error.to_string(),
        }
    }

    /// What our decoder makes of a file, once it is what ply-rs-bw makes of it, however it arrives.
    fn same(bytes: &[u8], weight: Option<&str>, case: &str) -> String {
        let from_file = || Input::from_bytes("a.ply", bytes).unwrap();
        let from_stream = || Input::from_stream("a.ply", bytes).unwrap();
        let expected = shown(read_with(from_file(), weight, |_, _, _| None));
        assert_eq!(
            shown(read_with(from_file(), weight, Plain::of)),
            expected,
            "{case}"
        );
        assert_eq!(
            shown(read_with(from_stream(), weight, Plain::of)),
            expected,
            "{case} as stream"
        );
        expected
    }

    #[test]
    fn both_decoders_say_the_same_of_any_layout() {
        let (mut meshes, mut faults) = (0, std::collections::BTreeSet::new());
        for seed in 0..1500 {
            let bytes = Made::file(seed);
            for weight in [None, Some("w"), Some("y")] {
                let found = same(&bytes, weight, &format!("seed {seed}, weight {weight:?}"));
                let faults_known = [
                    "negative length",
                    "uses vertex",
                    "has the weight",
                    "has no property",
                    "ends in",
                ];
                match faults_known
                    .into_iter()
                    .find(|&fault| found.contains(fault))
                {
                    Some(fault) => {
                        faults.insert(fault);
                    }
                    None => meshes += 1,
                }
            }
        }
        assert!(
            meshes > 1500 && faults.len() == 5,
            "{meshes} meshes, {faults:?}"
        );
    }

    /// A file that ends at any of its bytes, or has some too many.
    #[test]
    fn both_decoders_say_the_same_of_any_truncation() {
        for seed in 0..12 {
            let bytes = Made::file(seed);
            let body = bytes
                .windows(11)
                .position(|w| w == b"end_header\n")
                .unwrap()
                + 11;
            for end in body..bytes.len() {
                same(
                    &bytes[..end],
                    Some("x"),
                    &format!("seed {seed}, {end} bytes"),
                );
            }
            same(
                &[&bytes, &[7; 50][..]].concat(),
                None,
                &format!("seed {seed} and more"),
            );
        }
    }

    /// Any byte of any file may be wrong.
    #[test]
    fn both_decoders_say_the_same_of_damaged_files() {
        for seed in 0..1000 {
            let mut bytes = Made::file(seed);
            let mut random = Random(seed + 1);
            let body = bytes
                .windows(11)
                .position(|w| w == b"end_header\n")
                .unwrap()
                + 11;
            for _ in 0..3 {
                let at = body + random.below(bytes.len() - body);
                bytes[at] = random.below(256) as u8;
            }
            same(&bytes, None, &format!("seed {seed}"));
        }
    }

    /// The length of the file bounds what is set aside: as many triangles as the quads have.
    #[test]
    fn promises_are_held_against_the_length_of_the_file() {
        let header = |vertices: u64, faces: u64| {
            format!(
                "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\n\
                 property float y\nproperty float z\nelement face {faces}\n\
                 property list uchar int vertex_indices\nend_header\n"
            )
        };
        let quad: Vec<u8> = [4, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0].into();
        let read = |header: String| {
            let bytes = [header.into_bytes(), vec![0; 48], quad.repeat(500)].concat();
            read_with(Input::from_bytes("a.ply", bytes).unwrap(), None, Plain::of)
        };
        assert_eq!(read(header(4, 500)).unwrap().bytes(), 4 * 12 + 1000 * 12);
        for (vertices, faces) in [(1 << 31, 500), (4, 1 << 31), (u64::MAX, u64::MAX)] {
            let error = read(header(vertices, faces)).unwrap_err().to_string();
            assert!(error.contains("the file ends in"), "{error}");
        }
        let layout = Faces {
            bytes_before: 0,
            corners: List {
                count: ScalarType::UChar,
                item: ScalarType::Int,
            },
            bytes_behind: 0,
            more: None,
            groups: Vec::new(),
        };
        assert_eq!(layout.triangles_in(1000, 13_000), 1000);
        assert_eq!(layout.triangles_in(500, 17 * 500), 1000);
        assert_eq!(layout.triangles_in(usize::MAX, 13_000), 0);
    }
}
