//! What a glTF file says of itself: its container, its JSON, and where its nodes stand.

use std::collections::BTreeMap;

use glam::{DAffine3, DMat3, DMat4, DQuat, DVec3, DVec4};
use gltf::json;
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::Value;

use crate::error::Place;

/// What is wrong with a file whose name the finder does not know.
#[derive(Debug)]
pub(super) struct Wrong {
    pub place: Place,
    pub found: String,
    pub expected: String,
}

pub(super) type Answer<T> = Result<T, Wrong>;

impl Wrong {
    pub fn new(found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self {
            place: Place::File,
            found: found.into(),
            expected: expected.into(),
        }
    }

    fn at(byte: usize, found: impl Into<String>, expected: impl Into<String>) -> Self {
        Self {
            place: Place::Byte(byte as u64),
            ..Self::new(found, expected)
        }
    }
}

/// A file taken apart.
pub(super) struct Container<'a> {
    pub json: &'a [u8],
    /// The bytes that the first buffer is, where it names none.
    pub chunk: Option<&'a [u8]>,
}

/// The first bytes of a binary file.
pub(super) const MAGIC: &[u8] = b"glTF";
/// Magic, version and length of a binary file.
const HEADER_BYTES: usize = 12;
/// Length and type of a chunk.
const CHUNK_HEADER_BYTES: usize = 8;
pub(super) const JSON_CHUNK: [u8; 4] = *b"JSON";
pub(super) const BINARY_CHUNK: [u8; 4] = *b"BIN\0";

impl<'a> Container<'a> {
    /// The parts of a binary file, or of one that is JSON alone.
    pub fn of(bytes: &'a [u8]) -> Answer<Self> {
        if !bytes.starts_with(MAGIC) {
            let json = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
            return Ok(Self { json, chunk: None });
        }
        let word = |at: usize| {
            let bytes = bytes.get(at..at + 4)?;
            Some(u32::from_le_bytes(bytes.try_into().ok()?))
        };
        if let Some(version) = word(4).filter(|&version| version != 2) {
            return Err(Wrong::at(4, format!("glTF version {version}"), "version 2"));
        }
        let length = word(8).map_or(HEADER_BYTES, |length| length as usize);
        let Some(whole) = bytes.get(..length).filter(|_| length >= HEADER_BYTES) else {
            let found = format!("the header says {length} bytes");
            return Err(Wrong::at(
                8,
                found,
                format!("{}, as the file has", bytes.len()),
            ));
        };
        let mut rest = whole.get(HEADER_BYTES..).unwrap_or_default();
        let mut next_chunk = || -> Answer<Option<([u8; 4], &'a [u8])>> {
            let at = length - rest.len();
            let Some((header, behind)) = rest.split_first_chunk::<CHUNK_HEADER_BYTES>() else {
                return Ok(None);
            };
            let [a, b, c, d, kind @ ..] = *header;
            let bytes = u32::from_le_bytes([a, b, c, d]) as usize;
            let Some(chunk) = behind.get(..bytes) else {
                let found = format!("a chunk of {bytes} bytes");
                let expected = format!("at most {}, as are left", behind.len());
                return Err(Wrong::at(at, found, expected));
            };
            rest = &behind[bytes..];
            Ok(Some((kind, chunk)))
        };
        let json = match next_chunk()? {
            Some((JSON_CHUNK, json)) => json,
            _ => return Err(Wrong::at(HEADER_BYTES, "no chunk of JSON", "one")),
        };
        let mut chunk = None;
        while let Some((kind, bytes)) = next_chunk()? {
            if kind == BINARY_CHUNK && chunk.is_none() {
                chunk = Some(bytes);
            }
        }
        Ok(Self { json, chunk })
    }
}

/// What of a glTF file's JSON makes a mesh and its materials.
///
/// Nodes and scenes are not the `gltf` crate's: its translations are single precision, and a scene
/// without nodes is an error to it.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document {
    pub asset: Asset,
    #[serde(default)]
    pub accessors: Vec<json::Accessor>,
    #[serde(default)]
    pub buffers: Vec<json::Buffer>,
    #[serde(default)]
    pub buffer_views: Vec<json::buffer::View>,
    #[serde(default)]
    pub meshes: Vec<json::Mesh>,
    #[serde(default)]
    pub nodes: Vec<Node>,
    pub scene: Option<usize>,
    #[serde(default)]
    pub scenes: Vec<Scene>,
    #[serde(default)]
    pub materials: Vec<Value>,
    #[serde(default)]
    pub textures: Vec<Value>,
    #[serde(default)]
    pub samplers: Vec<Value>,
    #[serde(default)]
    pub images: Vec<Value>,
    #[serde(default)]
    pub extensions_used: Vec<String>,
    #[serde(default)]
    pub extensions_required: Vec<String>,
    pub animations: Option<IgnoredAny>,
    pub cameras: Option<IgnoredAny>,
}

#[derive(Deserialize)]
pub(super) struct Asset {
    version: String,
}

#[derive(Deserialize)]
pub(super) struct Scene {
    #[serde(default)]
    nodes: Vec<usize>,
}

#[derive(Deserialize)]
pub(super) struct Node {
    pub mesh: Option<usize>,
    pub skin: Option<IgnoredAny>,
    pub extensions: Option<BTreeMap<String, IgnoredAny>>,
    #[serde(default)]
    children: Vec<usize>,
    // Behind pointers, since most nodes have none of them.
    matrix: Option<Box<[f64; 16]>>,
    translation: Option<Box<[f64; 3]>>,
    rotation: Option<Box<[f64; 4]>>,
    scale: Option<Box<[f64; 3]>>,
}

impl Node {
    /// From the node's coordinates to its parent's.
    fn transform(&self) -> DAffine3 {
        if let Some(matrix) = &self.matrix {
            return DAffine3::from_mat4(DMat4::from_cols_array(matrix));
        }
        let translation = self
            .translation
            .as_ref()
            .map_or(DVec3::ZERO, |t| (**t).into());
        let scale = self.scale.as_ref().map_or(DVec3::ONE, |s| (**s).into());
        // In single precision no quaternion has exactly unit length.
        let unit = |q: DVec4| Some(q / q.dot(q).sqrt()).filter(|q| q.is_finite());
        let rotation = self.rotation.as_ref().and_then(|q| unit((**q).into()));
        let turn = rotation.map_or(DMat3::IDENTITY, |q| DMat3::from_quat(DQuat::from_vec4(q)));
        DAffine3 {
            matrix3: turn * DMat3::from_diagonal(scale),
            translation,
        }
    }
}

/// A mesh where a node puts it.
pub(super) struct Placement {
    pub node: usize,
    pub mesh: usize,
    /// From the mesh's coordinates to the scene's.
    pub transform: DAffine3,
}

impl Document {
    pub fn parse(text: &[u8]) -> Answer<Self> {
        #[derive(Deserialize)]
        struct Head {
            asset: Asset,
        }
        let wrong_version = |asset: &Asset| {
            let found = format!("asset.version is '{}'", asset.version);
            Wrong::new(found, "2.0 or a later 2")
        };
        match serde_json::from_slice::<Self>(text) {
            Ok(document) if document.asset.is_ours() => Ok(document),
            Ok(document) => Err(wrong_version(&document.asset)),
            // An older version has another structure, which is not what is wrong with it.
            Err(error) => match serde_json::from_slice::<Head>(text) {
                Ok(head) if !head.asset.is_ours() => Err(wrong_version(&head.asset)),
                _ => Err(Wrong::new(format!("{error}"), "the JSON of glTF 2.0")),
            },
        }
    }

    /// Where meshes stand in the default scene, or in all where none is the default, or in all nodes
    /// where there is no scene; or each mesh as it is where there is no node. In the order of nodes.
    pub fn placements(&self) -> Answer<Vec<Placement>> {
        let placed = if self.nodes.is_empty() {
            let place = |mesh| Placement {
                node: 0,
                mesh,
                transform: DAffine3::IDENTITY,
            };
            (0..self.meshes.len()).map(place).collect()
        } else {
            self.placements_of_nodes()?
        };
        let meshes = self.meshes.len();
        if let Some(placement) = placed.iter().find(|p| p.mesh >= meshes) {
            let found = format!("nodes[{}].mesh is {}", placement.node, placement.mesh);
            return Err(out_of_range(found, meshes));
        }
        Ok(placed)
    }

    fn placements_of_nodes(&self) -> Answer<Vec<Placement>> {
        let n = self.nodes.len();
        let mut is_shown = self.shown_by_scenes()?;
        let mut has_parent = vec![false; n];
        for (i, node) in self.nodes.iter().enumerate() {
            for (k, &child) in node.children.iter().enumerate() {
                let found = || format!("nodes[{i}].children[{k}] is {child}");
                match has_parent.get_mut(child) {
                    None => return Err(out_of_range(found(), n)),
                    Some(true) => {
                        let found = format!("{}, which is a child already", found());
                        return Err(Wrong::new(found, "one parent a node"));
                    }
                    Some(has_parent) => *has_parent = true,
                }
            }
        }
        // From parents to children: each node has one parent at most, so each is met once.
        let mut transforms: Vec<Option<DAffine3>> = vec![None; n];
        let mut open: Vec<usize> = (0..n).filter(|&i| !has_parent[i]).collect();
        for &i in &open {
            transforms[i] = Some(self.nodes[i].transform());
        }
        while let Some(i) = open.pop() {
            let parent = transforms[i];
            for &child in &self.nodes[i].children {
                transforms[child] = parent.map(|parent| parent * self.nodes[child].transform());
                is_shown[child] |= is_shown[i];
                open.push(child);
            }
        }
        let mut placed = Vec::new();
        for (i, transform) in transforms.into_iter().enumerate() {
            let Some(transform) = transform else {
                let found = format!("nodes[{i}] stands below itself");
                return Err(Wrong::new(found, "nodes without a cycle"));
            };
            if let Some(mesh) = self.nodes[i].mesh.filter(|_| is_shown[i]) {
                placed.push(Placement {
                    node: i,
                    mesh,
                    transform,
                });
            }
        }
        Ok(placed)
    }

    /// Which nodes the scenes name.
    fn shown_by_scenes(&self) -> Answer<Vec<bool>> {
        let n = self.nodes.len();
        let mut is_shown = vec![self.scenes.is_empty(); n];
        if let Some(scene) = self.scene.filter(|&scene| scene >= self.scenes.len()) {
            return Err(out_of_range(format!("scene is {scene}"), self.scenes.len()));
        }
        for (s, scene) in self.scenes.iter().enumerate() {
            if self.scene.is_some_and(|default| default != s) {
                continue;
            }
            for (k, &node) in scene.nodes.iter().enumerate() {
                let Some(is_shown) = is_shown.get_mut(node) else {
                    let found = format!("scenes[{s}].nodes[{k}] is {node}");
                    return Err(out_of_range(found, n));
                };
                *is_shown = true;
            }
        }
        Ok(is_shown)
    }
}

impl Asset {
    fn is_ours(&self) -> bool {
        self.version.starts_with("2.")
    }
}

/// The error of an index into a list of so many.
pub(super) fn out_of_range(found: String, count: usize) -> Wrong {
    Wrong::new(found, format!("below {count}"))
}
