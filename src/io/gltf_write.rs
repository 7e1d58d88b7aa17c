//! Writing glTF 2.0: a mesh an object, a primitive a material, and the materials as they came.

use std::collections::BTreeMap;
use std::io::{self, Write};

use base64::engine::general_purpose::STANDARD;
use base64::write::EncoderWriter;
use gltf::json::accessor::ComponentType;
use gltf::json::buffer::Target;
use serde_json::{Map, Value, json};

use crate::attributes::{Attributes, Channel, Group, Kind, NumberType};
use crate::indexed_mesh::IndexedMesh;

use super::gltf_document::{BINARY_CHUNK, JSON_CHUNK, MAGIC};

/// How much is written at a time.
const BLOCK_BYTES: usize = 1 << 16;

/// Binary glTF: JSON and bytes in one file.
pub(super) fn binary(writer: &mut dyn Write, mesh: &IndexedMesh) -> io::Result<()> {
    let file = Layout::of(mesh);
    let mut document = file.document(mesh);
    if file.bytes > 0 {
        document.insert("buffers".into(), json!([{"byteLength": file.bytes}]));
    }
    let mut text = serde_json::to_vec(&document)?;
    text.resize(text.len().next_multiple_of(ALIGNMENT), b' ');
    let chunk = |bytes: usize| if bytes > 0 { 8 + bytes } else { 0 };
    let whole = 12 + chunk(text.len()) + chunk(file.bytes);
    let in_word = |n: usize| {
        let word = u32::try_from(n).map_err(|_| {
            let what = format!("{n} bytes; a .glb file holds at most 4294967295");
            io::Error::new(io::ErrorKind::FileTooLarge, what)
        })?;
        Ok::<_, io::Error>(word.to_le_bytes())
    };
    writer.write_all(MAGIC)?;
    writer.write_all(&2u32.to_le_bytes())?;
    writer.write_all(&in_word(whole)?)?;
    writer.write_all(&in_word(text.len())?)?;
    writer.write_all(&JSON_CHUNK)?;
    writer.write_all(&text)?;
    if file.bytes > 0 {
        writer.write_all(&in_word(file.bytes)?)?;
        writer.write_all(&BINARY_CHUNK)?;
        file.write_bytes(mesh, writer)?;
    }
    Ok(())
}

/// glTF as JSON, with its bytes as a data URI.
pub(super) fn text(writer: &mut dyn Write, mesh: &IndexedMesh) -> io::Result<()> {
    let file = Layout::of(mesh);
    let text = serde_json::to_string(&file.document(mesh))?;
    if file.bytes == 0 {
        return writeln!(writer, "{text}");
    }
    // The URI is written as it is made, behind all else.
    let open = text.strip_suffix('}').expect("the document is an object");
    write!(
        writer,
        "{open},\"buffers\":[{{\"byteLength\":{},\"uri\":\"data:application/octet-stream;base64,",
        file.bytes
    )?;
    let mut encoder = EncoderWriter::new(&mut *writer, &STANDARD);
    file.write_bytes(mesh, &mut encoder)?;
    encoder.finish()?;
    drop(encoder);
    writeln!(writer, "\"}}]}}")
}

/// The numbers of vertices that glTF has no place for, or not in their precision.
pub(super) fn lost(attributes: &Attributes) -> Vec<String> {
    let mut lost = Vec::new();
    let columns = columns_of(attributes);
    for channel in &attributes.channels {
        for (k, component) in channel.components.iter().enumerate() {
            let holds = |column: &Column| {
                std::ptr::eq(column.channel, channel) && column.components().contains(&k)
            };
            let name = &component.name;
            if !columns.iter().any(holds) {
                lost.push(format!("vertex property '{name}'"));
            } else if !component.number.fits_single() {
                let what = format!("more than single precision of vertex property '{name}'");
                lost.push(what);
            }
        }
    }
    lost
}

/// What every row and every view of the bytes begins at a multiple of.
const ALIGNMENT: usize = 4;

/// A file before it is written: what stands where in its bytes.
struct Layout<'a> {
    primitives: Vec<Primitive>,
    /// The triangles of the mesh, by group and then as they stand.
    order: Vec<u32>,
    columns: Vec<Column<'a>>,
    /// The vertex of each wedge; nothing where vertices have no wedges.
    vertex_of: Vec<u32>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    bytes: usize,
}

/// The triangles of one group.
struct Primitive {
    group: Option<u32>,
    /// Where they stand in the order.
    triangles: std::ops::Range<usize>,
    /// How many there are, both sides of double-sided ones counted.
    count: usize,
    /// Their wedges, or vertices, ascending.
    wedges: Vec<u32>,
    json: Value,
}

impl Primitive {
    /// The type of its indices. The greatest of 16 bits would mean that a strip ends.
    fn index_type(&self) -> ComponentType {
        if self.wedges.len() <= usize::from(u16::MAX) {
            ComponentType::U16
        } else {
            ComponentType::U32
        }
    }
}

/// An attribute of vertices as the file has it.
struct Column<'a> {
    /// As the format calls it.
    name: String,
    channel: &'a Channel,
    /// The first component, and how many there are; more than the channel has are zero.
    first: usize,
    width: usize,
    number: NumberType,
    is_color: bool,
}

impl Column<'_> {
    fn components(&self) -> std::ops::Range<usize> {
        self.first..self.first + self.width
    }

    fn row_bytes(&self) -> usize {
        (self.width * size_of_number(self.number)).next_multiple_of(ALIGNMENT)
    }

    /// Appends a row.
    fn write(&self, row: usize, to: &mut Vec<u8>) {
        let end = to.len() + self.row_bytes();
        for k in self.components() {
            let component = self.channel.components.get(k);
            let at = row * self.channel.width() + k;
            let x = component.map_or(0.0, |_| self.channel.values.get(at));
            match self.number {
                NumberType::I8 => to.extend((x as i8).to_le_bytes()),
                NumberType::U8 => to.extend((x as u8).to_le_bytes()),
                NumberType::I16 => to.extend((x as i16).to_le_bytes()),
                NumberType::U16 => to.extend((x as u16).to_le_bytes()),
                _ => {
                    let range = component.and_then(|c| c.number.range());
                    let most = range
                        .filter(|_| self.is_color)
                        .map_or(1.0, |(_, most)| most);
                    to.extend(((x / most) as f32).to_le_bytes());
                }
            }
        }
        to.resize(end, 0);
    }
}

fn size_of_number(number: NumberType) -> usize {
    match number {
        NumberType::I8 | NumberType::U8 => 1,
        NumberType::I16 | NumberType::U16 => 2,
        NumberType::I32 | NumberType::U32 | NumberType::F32 | NumberType::F64 => 4,
    }
}

fn component_type(number: NumberType) -> ComponentType {
    match number {
        NumberType::I8 => ComponentType::I8,
        NumberType::U8 => ComponentType::U8,
        NumberType::I16 => ComponentType::I16,
        NumberType::U16 => ComponentType::U16,
        NumberType::I32 | NumberType::U32 | NumberType::F32 | NumberType::F64 => ComponentType::F32,
    }
}

/// The channels as the format has them: the first normals, every set of texture coordinates and of
/// colours, everything else number by number.
fn columns_of(attributes: &Attributes) -> Vec<Column<'_>> {
    let mut columns: Vec<Column> = Vec::new();
    let (mut normals, mut textures, mut colors) = (0, 0, 0);
    for channel in &attributes.channels {
        let common = |allowed: &[NumberType]| {
            let number = channel.components[0].number;
            let is_common = channel.components.iter().all(|c| c.number == number);
            let is_kept = is_common && allowed.contains(&number);
            if is_kept { number } else { NumberType::F32 }
        };
        let mut whole = |name: String, width, number, is_color| {
            columns.push(Column {
                name,
                channel,
                first: 0,
                width,
                number,
                is_color,
            });
        };
        match (channel.kind, channel.width()) {
            (Kind::Normal, 3) if normals == 0 => {
                normals += 1;
                whole("NORMAL".into(), 3, NumberType::F32, false);
            }
            (Kind::Normal, 3) => {}
            (Kind::TextureCoordinate, _) => {
                whole(format!("TEXCOORD_{textures}"), 2, NumberType::F32, false);
                textures += 1;
            }
            (Kind::Color, width @ (3 | 4)) => {
                let number = common(&[NumberType::U8, NumberType::U16]);
                whole(format!("COLOR_{colors}"), width, number, true);
                colors += 1;
            }
            (_, width) => {
                for k in 0..width {
                    let component = &channel.components[k];
                    let name = format!("_{}", component.name);
                    if columns.iter().any(|column| column.name == name) {
                        continue;
                    }
                    let number = component.number;
                    let fits = size_of_number(number) < 4;
                    columns.push(Column {
                        name,
                        channel,
                        first: k,
                        width: 1,
                        number: if fits { number } else { NumberType::F32 },
                        is_color: false,
                    });
                }
            }
        }
    }
    columns
}

impl<'a> Layout<'a> {
    fn of(mesh: &'a IndexedMesh) -> Self {
        let attributes = mesh.attributes();
        let mut file = Self {
            primitives: Vec::new(),
            order: (0..mesh.triangles().len() as u32).collect(),
            columns: columns_of(attributes),
            vertex_of: Vec::new(),
            views: Vec::new(),
            accessors: Vec::new(),
            bytes: 0,
        };
        if !attributes.corners.is_empty() {
            file.vertex_of = vec![0; attributes.wedge_count()];
            let corners = attributes.corners.as_flattened();
            for (&wedge, &v) in corners.iter().zip(mesh.triangles().as_flattened()) {
                file.vertex_of[wedge as usize] = v;
            }
        }
        let group_of = &attributes.group_of;
        if !group_of.is_empty() {
            // Of equal groups the order stays.
            file.order.sort_by_key(|&t| group_of[t as usize]);
        }
        let group = |t: u32| group_of.get(t as usize).copied();
        let mut begin = 0;
        let mut is_used = vec![false; file.wedge_count(mesh)];
        let order = std::mem::take(&mut file.order);
        for triangles in order.chunk_by(|&a, &b| group(a) == group(b)) {
            let end = begin + triangles.len();
            file.add_primitive(mesh, triangles, begin..end, &mut is_used);
            begin = end;
        }
        file.order = order;
        for blob in attributes.assets.iter().flat_map(|assets| &assets.blobs) {
            file.add_view(blob.len(), None, None);
        }
        file
    }

    /// The number of wedges, or of vertices where they have none.
    fn wedge_count(&self, mesh: &IndexedMesh) -> usize {
        if self.vertex_of.is_empty() {
            mesh.positions().len()
        } else {
            self.vertex_of.len()
        }
    }

    fn vertex(&self, wedge: u32) -> usize {
        self.vertex_of.get(wedge as usize).map_or(wedge, |&v| v) as usize
    }

    /// Plans the bytes of one group's triangles. `is_used` is all false before and after.
    fn add_primitive(
        &mut self,
        mesh: &IndexedMesh,
        triangles: &[u32],
        range: std::ops::Range<usize>,
        is_used: &mut [bool],
    ) {
        let mut wedges = Vec::new();
        for wedge in triangles.iter().flat_map(|&t| corners(mesh, t)) {
            if !std::mem::replace(&mut is_used[wedge as usize], true) {
                wedges.push(wedge);
            }
        }
        wedges.sort_unstable();
        wedges
            .iter()
            .for_each(|&wedge| is_used[wedge as usize] = false);
        let is_double = |&&t: &&u32| mesh.is_double_sided(t as usize);
        let mut primitive = Primitive {
            group: mesh
                .attributes()
                .group_of
                .get(triangles[0] as usize)
                .copied(),
            triangles: range,
            count: triangles.len() + triangles.iter().filter(is_double).count(),
            wedges,
            json: Value::Null,
        };
        let (indices, rows) = (3 * primitive.count, primitive.wedges.len());
        let index_type = primitive.index_type();
        let view = self.add_view(
            indices * index_type.size(),
            None,
            Some(Target::ElementArrayBuffer),
        );
        let indices = self.add_accessor(view, index_type, indices, 1);
        let view = self.add_view(12 * rows, Some(12), Some(Target::ArrayBuffer));
        let positions = self.add_accessor(view, ComponentType::F32, rows, 3);
        let (min, max) = self.bounds(mesh, &primitive.wedges);
        self.accessors[positions]["min"] = json!(min);
        self.accessors[positions]["max"] = json!(max);
        let mut attributes = Map::new();
        attributes.insert("POSITION".into(), positions.into());
        for i in 0..self.columns.len() {
            let column = &self.columns[i];
            let (name, width, stride) = (column.name.clone(), column.width, column.row_bytes());
            let (number, is_color) = (column.number, column.is_color);
            let view = self.add_view(stride * rows, Some(stride), Some(Target::ArrayBuffer));
            let accessor = self.add_accessor(view, component_type(number), rows, width);
            if is_color && number != NumberType::F32 {
                self.accessors[accessor]["normalized"] = true.into();
            }
            attributes.insert(name, accessor.into());
        }
        primitive.json = json!({"attributes": attributes, "indices": indices});
        self.primitives.push(primitive);
    }

    /// The least and the greatest coordinates, of those that are finite.
    fn bounds(&self, mesh: &IndexedMesh, wedges: &[u32]) -> ([f64; 3], [f64; 3]) {
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for &wedge in wedges {
            let position = mesh.positions()[self.vertex(wedge)].to_array();
            for (k, x) in position.map(f64::from).into_iter().enumerate() {
                if x.is_finite() {
                    min[k] = min[k].min(x);
                    max[k] = max[k].max(x);
                }
            }
        }
        // JSON knows no infinity.
        let finite = |x: f64| if x.is_finite() { x } else { 0.0 };
        (min.map(finite), max.map(finite))
    }

    fn add_view(&mut self, bytes: usize, stride: Option<usize>, target: Option<Target>) -> usize {
        let mut view = json!({"buffer": 0, "byteOffset": self.bytes, "byteLength": bytes});
        if let Some(stride) = stride {
            view["byteStride"] = stride.into();
        }
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.views.push(view);
        self.bytes = (self.bytes + bytes).next_multiple_of(ALIGNMENT);
        self.views.len() - 1
    }

    fn add_accessor(
        &mut self,
        view: usize,
        number: ComponentType,
        count: usize,
        width: usize,
    ) -> usize {
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][width - 1];
        self.accessors.push(json!({
            "bufferView": view,
            "componentType": number,
            "count": count,
            "type": kind,
        }));
        self.accessors.len() - 1
    }

    /// The JSON, but for the buffer.
    fn document(&self, mesh: &IndexedMesh) -> Map<String, Value> {
        let mut document = Map::new();
        let mut materials = Vec::new();
        let mut names = Vec::new();
        if let Some(assets) = &mesh.attributes().assets {
            document.extend(assets.lists.clone());
            names.clone_from(&assets.material_names);
            if let Some(Value::Array(list)) = document.remove("materials") {
                materials = list;
            }
            // In front of the images stand the views of the meshes.
            let before = self.views.len() - assets.blobs.len();
            if let Some(Value::Array(images)) = document.get_mut("images") {
                let views = images
                    .iter_mut()
                    .filter_map(|image| image.get_mut("bufferView"));
                for view in views {
                    *view = (before + view.as_u64().unwrap_or(0) as usize).into();
                }
            }
        }
        let numbers: BTreeMap<&str, usize> = names
            .iter()
            .enumerate()
            .map(|(i, name)| (name.as_str(), i))
            .collect();
        let mut more: BTreeMap<&str, usize> = BTreeMap::new();
        let mut meshes: Vec<(&str, Vec<Value>)> = Vec::new();
        let mut mesh_of: BTreeMap<&str, usize> = BTreeMap::new();
        let none = Group::default();
        for primitive in &self.primitives {
            let group = primitive
                .group
                .map_or(&none, |g| &mesh.attributes().groups[g as usize]);
            let mut json = primitive.json.clone();
            let name = group.material.as_str();
            if !name.is_empty() {
                let known = numbers.get(name).copied();
                let number = known.unwrap_or_else(|| {
                    *more.entry(name).or_insert_with(|| {
                        materials.push(json!({"name": name}));
                        materials.len() - 1
                    })
                });
                json["material"] = number.into();
            }
            let at = *mesh_of.entry(&group.object).or_insert_with(|| {
                meshes.push((&group.object, Vec::new()));
                meshes.len() - 1
            });
            meshes[at].1.push(json);
        }
        let nodes: Vec<Value> = (0..meshes.len()).map(|i| self.node(mesh, i)).collect();
        let meshes = meshes.into_iter().map(|(name, primitives)| match name {
            "" => json!({"primitives": primitives}),
            name => json!({"name": name, "primitives": primitives}),
        });
        let meshes: Vec<Value> = meshes.collect();
        document.insert(
            "asset".into(),
            json!({"generator": "decimate", "version": "2.0"}),
        );
        if !nodes.is_empty() {
            let all: Vec<usize> = (0..nodes.len()).collect();
            document.insert("scene".into(), 0.into());
            document.insert("scenes".into(), json!([{"nodes": all}]));
        }
        // The format has no empty lists.
        for (name, list) in [
            ("accessors", self.accessors.clone()),
            ("bufferViews", self.views.clone()),
            ("materials", materials),
            ("meshes", meshes),
            ("nodes", nodes),
        ] {
            if !list.is_empty() {
                document.insert(name.into(), list.into());
            }
        }
        document
    }

    /// A node that puts a mesh where its origin is.
    fn node(&self, mesh: &IndexedMesh, i: usize) -> Value {
        let origin = mesh.origin().to_array();
        if origin == [0.0; 3] {
            json!({"mesh": i})
        } else {
            json!({"mesh": i, "translation": origin})
        }
    }

    /// Writes what the views say.
    fn write_bytes(&self, mesh: &IndexedMesh, writer: &mut dyn Write) -> io::Result<()> {
        let mut out = Aligned {
            writer,
            block: Vec::with_capacity(BLOCK_BYTES + 64),
            bytes: 0,
        };
        let mut local = vec![0u32; self.wedge_count(mesh)];
        for primitive in &self.primitives {
            for (i, &wedge) in primitive.wedges.iter().enumerate() {
                local[wedge as usize] = i as u32;
            }
            let is_short = primitive.index_type() == ComponentType::U16;
            for &t in &self.order[primitive.triangles.clone()] {
                let [a, b, c] = corners(mesh, t).map(|wedge| local[wedge as usize]);
                let back = mesh.is_double_sided(t as usize).then_some([a, c, b]);
                for i in std::iter::once([a, b, c]).chain(back).flatten() {
                    if is_short {
                        out.block.extend((i as u16).to_le_bytes());
                    } else {
                        out.block.extend(i.to_le_bytes());
                    }
                }
                out.write_full()?;
            }
            out.align()?;
            for &wedge in &primitive.wedges {
                let position = mesh.positions()[self.vertex(wedge)].to_array();
                out.block
                    .extend(position.map(f32::to_le_bytes).as_flattened());
                out.write_full()?;
            }
            for column in &self.columns {
                for &wedge in &primitive.wedges {
                    column.write(wedge as usize, &mut out.block);
                    out.write_full()?;
                }
                out.align()?;
            }
        }
        for blob in mesh
            .attributes()
            .assets
            .iter()
            .flat_map(|assets| &assets.blobs)
        {
            out.flush()?;
            out.writer.write_all(blob)?;
            out.bytes += blob.len();
            out.align()?;
        }
        out.flush()?;
        assert_eq!(out.bytes, self.bytes, "bytes as planned");
        Ok(())
    }
}

/// The wedges of a triangle's corners, or its vertices where they have none.
fn corners(mesh: &IndexedMesh, t: u32) -> [u32; 3] {
    let wedges = mesh.attributes().corners.get(t as usize);
    *wedges.unwrap_or(&mesh.triangles()[t as usize])
}

/// Bytes on their way out, in blocks.
struct Aligned<'a> {
    writer: &'a mut dyn Write,
    block: Vec<u8>,
    /// How many have left.
    bytes: usize,
}

impl Aligned<'_> {
    fn write_full(&mut self) -> io::Result<()> {
        if self.block.len() >= BLOCK_BYTES {
            self.flush()
        } else {
            Ok(())
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.write_all(&self.block)?;
        self.bytes += self.block.len();
        self.block.clear();
        Ok(())
    }

    /// Fills up with zeros to where the next view begins.
    fn align(&mut self) -> io::Result<()> {
        let end = (self.bytes + self.block.len()).next_multiple_of(ALIGNMENT);
        self.block.resize(end - self.bytes, 0);
        self.write_full()
    }
}
