//! The bytes that a glTF file names, and the numbers in them: buffers, buffer views, accessors.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use base64::Engine;
use base64::alphabet;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::json::accessor::ComponentType;
use gltf::json::validation::Checked;
use percent_encoding::percent_decode_str;

use super::gltf_document::{Answer, Document, Wrong, out_of_range};

/// Extensions that keep a buffer view's bytes compressed.
const COMPRESSED_VIEWS: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Of a buffer its bytes, or nothing where the file has none.
pub(super) type Buffers<'a> = Vec<Option<Cow<'a, [u8]>>>;

/// The bytes of every buffer: the file's own chunk, data URIs, and files in `folder`, where the file
/// lies in one. The data URIs are taken out of the document.
pub(super) fn load_buffers<'a>(
    document: &mut Document,
    chunk: Option<&'a [u8]>,
    folder: Option<&Path>,
) -> Answer<Buffers<'a>> {
    let mut buffers = Vec::new();
    for (i, buffer) in document.buffers.iter_mut().enumerate() {
        let length = usize::try_from(buffer.byte_length.0).unwrap_or(usize::MAX);
        let bytes = match buffer.uri.take() {
            Some(uri) => match uri.strip_prefix("data:") {
                Some(data) => Some(Cow::Owned(decode_data(data, i)?)),
                None => Some(Cow::Owned(read_beside(folder, &uri, length, i)?)),
            },
            // A buffer that an extension fills may have no bytes of its own.
            None => chunk.filter(|_| i == 0).map(Cow::Borrowed),
        };
        let Some(bytes) = bytes else {
            buffers.push(None);
            continue;
        };
        if bytes.len() < length {
            let found = format!("buffers[{i}].byteLength is {length}");
            let expected = format!("at most {}, as there are", bytes.len());
            return Err(Wrong::new(found, expected));
        }
        buffers.push(Some(match bytes {
            Cow::Borrowed(bytes) => Cow::Borrowed(&bytes[..length]),
            Cow::Owned(mut bytes) => {
                bytes.truncate(length);
                Cow::Owned(bytes)
            }
        }));
    }
    Ok(buffers)
}

/// What follows `data:` in a URI.
fn decode_data(data: &str, buffer: usize) -> Answer<Vec<u8>> {
    let wrong = |found: &str| Wrong::new(format!("buffers[{buffer}].uri {found}"), "base64");
    let engine = GeneralPurpose::new(
        &alphabet::STANDARD,
        GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
    );
    let (kind, data) = data.split_once(',').unwrap_or((data, ""));
    if !kind.ends_with(";base64") {
        return Err(wrong("is data that is not said to be base64"));
    }
    let decoded = engine.decode(data);
    decoded.map_err(|error| wrong(&format!("is no data: {error}")))
}

/// The first `length` bytes of a file beside the mesh or below.
fn read_beside(folder: Option<&Path>, uri: &str, length: usize, buffer: usize) -> Answer<Vec<u8>> {
    let wrong = |what: &str, expected: &str| {
        Wrong::new(
            format!("buffers[{buffer}] is the file '{uri}'{what}"),
            expected,
        )
    };
    let Some(folder) = folder else {
        return Err(wrong(", beside a stream", "a data URI, or .glb"));
    };
    let decoded = percent_decode_str(uri).decode_utf8();
    let name = decoded.map_err(|_| wrong(", which is not UTF-8", "a name"))?;
    let path = PathBuf::from(&*name);
    // A colon or a backslash may lead elsewhere on Windows, and a colon begins a URL's path.
    let is_beside = !name.contains([':', '\\', '\0'])
        && path.components().all(|c| matches!(c, Component::Normal(_)))
        && !name.is_empty();
    if !is_beside {
        return Err(wrong("", "a file beside this one, or data"));
    }
    let mut bytes = Vec::new();
    let read = File::open(folder.join(path))
        .and_then(|file| file.take(length as u64).read_to_end(&mut bytes));
    match read {
        Ok(_) => Ok(bytes),
        Err(error) => Err(wrong(
            &format!(", which cannot be read: {}", error.kind()),
            "it beside this one",
        )),
    }
}

/// The numbers of an accessor: rows of one to sixteen.
#[derive(Clone, Copy)]
pub(super) struct Elements<'a> {
    /// Where the rows lie; without, they are zero.
    values: Option<Rows<'a>>,
    sparse: Option<Sparse<'a>>,
    /// The number of rows.
    pub count: usize,
    /// The numbers in a row.
    pub width: usize,
    pub number: ComponentType,
    /// Whether integers stand for 0 to 1, or −1 to 1.
    pub is_normalized: bool,
}

#[derive(Clone, Copy)]
struct Rows<'a> {
    bytes: &'a [u8],
    stride: usize,
}

/// Rows that stand elsewhere than the others.
#[derive(Clone, Copy)]
struct Sparse<'a> {
    /// The numbers of the rows, ascending.
    indices: Rows<'a>,
    index: ComponentType,
    count: usize,
    values: Rows<'a>,
}

impl Sparse<'_> {
    fn index(&self, i: usize) -> usize {
        number_at(self.indices.bytes, i * self.indices.stride, self.index) as usize
    }

    /// Where among these a row stands.
    fn find(&self, row: usize) -> Option<usize> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low + (high - low) / 2;
            if self.index(middle) < row {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        (low < self.count && self.index(low) == row).then_some(low)
    }
}

impl Elements<'_> {
    /// The numbers of a row as the file has them: the first four, zero where it has fewer.
    pub fn row(&self, i: usize) -> [f64; 4] {
        let mut row = [0.0; 4];
        let (rows, i) = match self.sparse.and_then(|s| Some((s.values, s.find(i)?))) {
            Some((values, at)) => (values, at),
            None => match self.values {
                Some(values) => (values, i),
                None => return row,
            },
        };
        let begin = i * rows.stride;
        for (k, x) in row.iter_mut().enumerate().take(self.width) {
            *x = number_at(rows.bytes, begin + k * self.number.size(), self.number);
        }
        row
    }

    /// The numbers of a row as what they stand for.
    pub fn decoded(&self, i: usize) -> [f64; 4] {
        if !self.is_normalized {
            return self.row(i);
        }
        let most = match self.number {
            ComponentType::I8 => f64::from(i8::MAX),
            ComponentType::U8 => f64::from(u8::MAX),
            ComponentType::I16 => f64::from(i16::MAX),
            ComponentType::U16 => f64::from(u16::MAX),
            ComponentType::U32 => f64::from(u32::MAX),
            ComponentType::F32 => 1.0,
        };
        let has_sign = matches!(self.number, ComponentType::I8 | ComponentType::I16);
        let least = if has_sign { -1.0 } else { f64::NEG_INFINITY };
        self.row(i).map(|x| (x / most).max(least))
    }

    /// A row of one number as an index.
    pub fn index(&self, i: usize) -> u32 {
        self.row(i)[0] as u32
    }
}

/// The number that stands at a byte.
fn number_at(bytes: &[u8], at: usize, number: ComponentType) -> f64 {
    fn take<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
        *bytes[at..].first_chunk().expect("lengths were checked")
    }
    match number {
        ComponentType::I8 => i8::from_le_bytes(take(bytes, at)).into(),
        ComponentType::U8 => bytes[at].into(),
        ComponentType::I16 => i16::from_le_bytes(take(bytes, at)).into(),
        ComponentType::U16 => u16::from_le_bytes(take(bytes, at)).into(),
        ComponentType::U32 => u32::from_le_bytes(take(bytes, at)).into(),
        ComponentType::F32 => f32::from_le_bytes(take(bytes, at)).into(),
    }
}

/// A document with the bytes of its buffers.
pub(super) struct Source<'a> {
    pub document: &'a Document,
    buffers: &'a Buffers<'a>,
    /// Those that were asked for, checked.
    elements: Vec<Option<Elements<'a>>>,
    /// Of accessors of indices the greatest, once it was looked for.
    greatest: BTreeMap<usize, Option<u32>>,
    /// How many bytes all buffers have.
    bytes: usize,
}

impl<'a> Source<'a> {
    pub fn new(document: &'a Document, buffers: &'a Buffers<'a>) -> Self {
        Self {
            document,
            buffers,
            elements: vec![None; document.accessors.len()],
            greatest: BTreeMap::new(),
            bytes: buffers.iter().flatten().map(|bytes| bytes.len()).sum(),
        }
    }

    /// How many bytes all buffers have.
    pub fn bytes(&self) -> usize {
        self.bytes
    }

    /// The bytes of a buffer view, which `user` names.
    pub fn view(&self, i: usize, user: &dyn Fn() -> String) -> Answer<&'a [u8]> {
        let views = &self.document.buffer_views;
        let Some(view) = views.get(i) else {
            let found = format!("{}.bufferView is {i}", user());
            return Err(out_of_range(found, views.len()));
        };
        let buffer = view.buffer.value();
        let Some(bytes) = self.buffers.get(buffer) else {
            let found = format!("bufferViews[{i}].buffer is {buffer}");
            return Err(out_of_range(found, self.buffers.len()));
        };
        let used = view.extensions.iter().flat_map(|e| e.others.keys());
        let mut compressed = used.filter(|name| COMPRESSED_VIEWS.contains(&name.as_str()));
        if let Some(name) = compressed.next() {
            let is_required = self.document.extensions_required.contains(name);
            if is_required || bytes.is_none() {
                return Err(compressed_with(&format!("bufferViews[{i}]"), name));
            }
        }
        let Some(bytes) = bytes else {
            let found = format!("buffers[{buffer}] has no uri");
            return Err(Wrong::new(found, "one, or .glb"));
        };
        let offset = view.byte_offset.unwrap_or_default().0;
        let length = view.byte_length.0;
        slice(bytes, offset, length).ok_or_else(|| {
            let found = format!("bufferViews[{i}] has {length} bytes from {offset}");
            let expected = format!("an end at most at {}, as buffers[{buffer}]", bytes.len());
            Wrong::new(found, expected)
        })
    }

    /// The numbers of an accessor, which `user` names.
    pub fn elements(&mut self, i: usize, user: &dyn Fn() -> String) -> Answer<Elements<'a>> {
        match self.elements.get(i) {
            None => Err(out_of_range(
                format!("{} is {i}", user()),
                self.elements.len(),
            )),
            Some(Some(elements)) => Ok(*elements),
            Some(None) => {
                let elements = self.check(i)?;
                self.elements[i] = Some(elements);
                Ok(elements)
            }
        }
    }

    /// The greatest of an accessor's indices, if it has any.
    pub fn greatest_index(&mut self, i: usize, indices: &Elements) -> Option<u32> {
        let find = || (0..indices.count).map(|k| indices.index(k)).max();
        *self.greatest.entry(i).or_insert_with(find)
    }

    fn check(&self, i: usize) -> Answer<Elements<'a>> {
        let accessor = &self.document.accessors[i];
        let path = || format!("accessors[{i}]");
        let Checked::Valid(number) = accessor.component_type else {
            let found = format!("{}.componentType is none of glTF", path());
            return Err(Wrong::new(found, "5120 to 5123, 5125 or 5126"));
        };
        let Checked::Valid(kind) = accessor.type_ else {
            let found = format!("{}.type is none of glTF", path());
            return Err(Wrong::new(
                found,
                "SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3 or MAT4",
            ));
        };
        let (number, width) = (number.0, kind.multiplicity());
        let row_bytes = width * number.size();
        let count = usize::try_from(accessor.count.0).unwrap_or(usize::MAX);
        let values = match accessor.buffer_view {
            None => {
                // Zeros take no bytes, so that their number alone would make room for them.
                if count > self.bytes {
                    let found = format!("{} has {count} zeros", path());
                    let expected = format!("at most {}, as there are bytes", self.bytes);
                    return Err(Wrong::new(found, expected));
                }
                None
            }
            Some(view) => {
                let stride = self.document.buffer_views.get(view.value());
                let stride = stride.and_then(|view| view.byte_stride);
                let stride = stride.map_or(row_bytes, |stride| stride.0);
                let offset = accessor.byte_offset.unwrap_or_default().0;
                let rows = Block {
                    view: view.value(),
                    offset,
                    stride,
                    row_bytes,
                    count,
                };
                Some(self.rows(&rows, &path)?)
            }
        };
        let sparse = match &accessor.sparse {
            None => None,
            Some(sparse) => Some(self.sparse(sparse, row_bytes, count, &path)?),
        };
        Ok(Elements {
            values,
            sparse,
            count,
            width,
            number,
            is_normalized: accessor.normalized && number != ComponentType::F32,
        })
    }

    fn sparse(
        &self,
        sparse: &gltf::json::accessor::sparse::Sparse,
        row_bytes: usize,
        rows: usize,
        path: &dyn Fn() -> String,
    ) -> Answer<Sparse<'a>> {
        let Checked::Valid(index) = sparse.indices.component_type else {
            let found = format!("{}.sparse.indices.componentType is no index's", path());
            return Err(Wrong::new(found, "5121, 5123 or 5125"));
        };
        let index = index.0;
        let count = usize::try_from(sparse.count.0).unwrap_or(usize::MAX);
        let indices = Block {
            view: sparse.indices.buffer_view.value(),
            offset: sparse.indices.byte_offset.0,
            stride: index.size(),
            row_bytes: index.size(),
            count,
        };
        let values = Block {
            view: sparse.values.buffer_view.value(),
            offset: sparse.values.byte_offset.0,
            stride: row_bytes,
            row_bytes,
            count,
        };
        let sparse = Sparse {
            indices: self.rows(&indices, &|| format!("{}.sparse.indices", path()))?,
            index,
            count,
            values: self.rows(&values, &|| format!("{}.sparse.values", path()))?,
        };
        let mut least = 0;
        for i in 0..count {
            let row = sparse.index(i);
            if row < least || row >= rows {
                let found = format!("{}.sparse.indices: number {i} is {row}", path());
                return Err(Wrong::new(found, format!("ascending numbers below {rows}")));
            }
            least = row + 1;
        }
        Ok(sparse)
    }

    /// The bytes from the first row to the end of the view, which holds all of them.
    fn rows(&self, block: &Block, path: &dyn Fn() -> String) -> Answer<Rows<'a>> {
        let view = self.view(block.view, path)?;
        if block.stride < block.row_bytes {
            let found = format!("bufferViews[{}].byteStride is {}", block.view, block.stride);
            let expected = format!("{} or more, as a row of {}", block.row_bytes, path());
            return Err(Wrong::new(found, expected));
        }
        let before = block.count.saturating_sub(1) as u64;
        let needed = before
            .checked_mul(block.stride as u64)
            .and_then(|bytes| bytes.checked_add(block.row_bytes as u64))
            .filter(|_| block.count > 0)
            .unwrap_or(if block.count > 0 { u64::MAX } else { 0 });
        match slice(view, block.offset, needed) {
            Some(bytes) => Ok(Rows {
                bytes,
                stride: block.stride,
            }),
            None => {
                let found = format!(
                    "{} has {} rows of {} bytes from byte {}",
                    path(),
                    block.count,
                    block.stride,
                    block.offset
                );
                let expected = format!("{} bytes, as bufferViews[{}]", view.len(), block.view);
                Err(Wrong::new(found, expected))
            }
        }
    }
}

/// Rows as a file says they lie in a buffer view.
struct Block {
    view: usize,
    offset: u64,
    stride: usize,
    row_bytes: usize,
    count: usize,
}

/// So many bytes from an offset, if they are there.
fn slice(bytes: &[u8], offset: u64, length: u64) -> Option<&[u8]> {
    let begin = usize::try_from(offset).ok()?;
    let end = usize::try_from(offset.checked_add(length)?).ok()?;
    bytes.get(begin..end)
}

/// The error of bytes that an extension keeps compressed.
pub(super) fn compressed_with(path: &str, extension: &str) -> Wrong {
    Wrong::new(
        format!("{path} is compressed with {extension}"),
        "no compression; decompress it first, for example with gltf-transform",
    )
}
