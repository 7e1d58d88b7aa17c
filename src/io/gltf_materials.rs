//! The materials of a glTF file: their names, and all that they name, as the file has it.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use serde_json::{Map, Value};

use crate::attributes::{Assets, Group};

use super::gltf_accessor::Source;
use super::gltf_document::{Answer, Document, Wrong};

/// What the materials of a file are called, and which pairs of mesh and material there are.
#[derive(Default)]
pub(super) struct Materials {
    pub names: Vec<String>,
    pub groups: Vec<Group>,
    group_of: BTreeMap<(String, String), u32>,
}

impl Materials {
    /// Each material has a name that no other has: its own, or that with its number.
    pub fn of(document: &Document) -> Self {
        let mut taken = BTreeSet::new();
        let names = document.materials.iter().enumerate().map(|(i, material)| {
            let own = material["name"].as_str().unwrap_or_default();
            let mut name = match own {
                "" => format!("material_{i}"),
                own if taken.contains(own) => format!("{own}_{i}"),
                own => own.to_string(),
            };
            while !taken.insert(name.clone()) {
                name.push('_');
            }
            name
        });
        Self {
            names: names.collect(),
            ..Self::default()
        }
    }

    /// The group of a mesh's faces of a material, by their names.
    pub fn group(&mut self, mesh: &str, material: &str) -> u32 {
        let next = self.groups.len() as u32;
        let group = self.group_of.entry((mesh.into(), material.into()));
        *group.or_insert_with(|| {
            self.groups.push(Group {
                object: mesh.into(),
                material: material.into(),
                ..Group::default()
            });
            next
        })
    }
}

pub(super) fn is_nameless(group: &Group) -> bool {
    group.object.is_empty() && group.material.is_empty()
}

/// The materials and what they name.
pub(super) fn assets(source: &Source, material_names: Vec<String>) -> Answer<Option<Arc<Assets>>> {
    let document = source.document;
    if document.materials.is_empty() {
        return Ok(None);
    }
    let mut assets = Assets {
        material_names,
        ..Assets::default()
    };
    let mut blobs: BTreeMap<u64, usize> = BTreeMap::new();
    let mut bytes = 0;
    let mut images = document.images.clone();
    for (i, image) in images.iter_mut().enumerate() {
        let Some(view) = image.get_mut("bufferView") else {
            continue;
        };
        let Some(number) = view.as_u64() else {
            let found = format!("images[{i}].bufferView is {view}");
            return Err(Wrong::new(found, "the number of one"));
        };
        let blob = match blobs.get(&number) {
            Some(&blob) => blob,
            None => {
                let index = usize::try_from(number).unwrap_or(usize::MAX);
                let blob = source.view(index, &|| format!("images[{i}]"))?;
                bytes += blob.len();
                if bytes > source.bytes() {
                    let found = format!("images 0 to {i} have {bytes} bytes together");
                    let expected = format!("at most {}, as the buffers have", source.bytes());
                    return Err(Wrong::new(found, expected));
                }
                assets.blobs.push(blob.to_vec());
                blobs.insert(number, assets.blobs.len() - 1);
                assets.blobs.len() - 1
            }
        };
        *view = blob.into();
    }
    let mut used = BTreeSet::new();
    for (name, list) in [
        ("materials", &document.materials),
        ("textures", &document.textures),
        ("samplers", &document.samplers),
        ("images", &images),
    ] {
        if !list.is_empty() {
            list.iter()
                .for_each(|value| note_extensions(value, &mut used));
            assets.lists.insert(name.into(), list.clone().into());
        }
    }
    for (name, list) in [
        ("extensionsUsed", &document.extensions_used),
        ("extensionsRequired", &document.extensions_required),
    ] {
        let kept: Vec<Value> = list
            .iter()
            .filter(|extension| used.contains(extension.as_str()))
            .map(|extension| extension.as_str().into())
            .collect();
        if !kept.is_empty() {
            assets.lists.insert(name.into(), kept.into());
        }
    }
    Ok(Some(Arc::new(assets)))
}

/// Adds the names of the extensions in a value, which lies at most 128 levels deep.
fn note_extensions<'a>(value: &'a Value, used: &mut BTreeSet<&'a str>) {
    let object: &Map<String, Value> = match value {
        Value::Array(list) => return list.iter().for_each(|v| note_extensions(v, used)),
        Value::Object(object) => object,
        _ => return,
    };
    for (name, value) in object {
        if let ("extensions", Value::Object(extensions)) = (name.as_str(), value) {
            used.extend(extensions.keys().map(String::as_str));
        }
        note_extensions(value, used);
    }
}
