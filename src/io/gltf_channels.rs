//! The channels that the primitives of a glTF file together have.

use std::collections::BTreeMap;

use gltf::json::accessor::ComponentType;

use crate::attributes::{Channel, Kind, NumberType, Property};

use super::gltf_accessor::Elements;
use super::gltf_parts::{Part, Slot};

/// The most channels of a number each: what a vertex takes stays in proportion to a file's bytes.
const MOST_SCALARS: usize = 32;

/// The channels that the primitives together have.
#[derive(Default)]
pub(super) struct Slots {
    /// What each channel is, its width, and the type of its numbers.
    pub list: Vec<(Slot, usize, NumberType)>,
    /// What is not carried, or not everywhere.
    pub notices: Vec<String>,
}

impl Slots {
    /// Normals, texture coordinates and colours are carried where any primitive has them, other
    /// numbers where all have them.
    pub fn of<'a, 'b: 'a>(parts: impl Iterator<Item = &'a Part<'b>>) -> Self {
        let mut found: BTreeMap<Slot, (usize, usize, NumberType)> = BTreeMap::new();
        let mut left: BTreeMap<String, usize> = BTreeMap::new();
        let (mut all, mut without) = (0, 0);
        for part in parts {
            if part.triangle_count() == 0 {
                without += 1;
                continue;
            }
            all += 1;
            for (slot, elements) in &part.attributes {
                let number = number_type(slot, elements);
                let (count, width, common) =
                    found
                        .entry(slot.clone())
                        .or_insert((0, elements.width, number));
                *count += 1;
                *width = elements.width.max(*width);
                *common = common_type(*common, number);
            }
            for name in &part.left {
                *left.entry(name.clone()).or_default() += 1;
            }
        }
        let mut slots = Self::default();
        let mut scalars = 0;
        for (slot, (count, width, number)) in found {
            let name = slot.to_string();
            if let Slot::Scalar(_) = slot {
                scalars += 1;
                if count < all || scalars > MOST_SCALARS {
                    left.insert(name, count);
                    continue;
                }
            } else if count < all {
                slots.notices.push(format!(
                    "{name} is on {count} of {all} primitives; the others get {}",
                    match slot {
                        Slot::Normal => "normals of their faces",
                        Slot::Color(_) => "white",
                        _ => "zeros",
                    }
                ));
            }
            slots.fill_gap(&slot);
            slots.list.push((slot, width, number));
        }
        let not_carried = |(name, count)| format!("{name} of {count} primitives is not carried");
        slots.notices.extend(left.into_iter().map(not_carried));
        if without > 0 {
            let notice = format!("{without} primitives have no triangles and are not carried");
            slots.notices.push(notice);
        }
        slots
    }

    /// Adds the sets that number up to this one's, which materials name by number.
    fn fill_gap(&mut self, slot: &Slot) {
        let (set, make): (u32, fn(u32) -> Slot) = match slot {
            Slot::TextureCoordinate(set) => (*set, Slot::TextureCoordinate),
            Slot::Color(set) => (*set, Slot::Color),
            Slot::Normal | Slot::Scalar(_) => return,
        };
        let width = if let Slot::Color(_) = slot { 4 } else { 2 };
        for set in 0..set {
            if !self.list.iter().any(|(there, ..)| *there == make(set)) {
                self.list.push((make(set), width, NumberType::F32));
            }
        }
    }

    /// Empty channels, by the names that a PLY file would have.
    pub fn channels(&self) -> Vec<Channel> {
        let channel = |(slot, width, number): &(Slot, usize, NumberType)| {
            let (kind, names, set): (_, &[&str], u32) = match slot {
                Slot::Normal => (Kind::Normal, &["nx", "ny", "nz"], 0),
                Slot::TextureCoordinate(set) => (Kind::TextureCoordinate, &["s", "t"], *set),
                Slot::Color(set) => (Kind::Color, &["red", "green", "blue", "alpha"], *set),
                Slot::Scalar(name) => (Kind::Scalar, &[name.as_str()], 0),
            };
            let property = |name: &&str| Property {
                name: match set {
                    0 => name.to_string(),
                    set => format!("{name}{set}"),
                },
                number: *number,
            };
            Channel::new(kind, names[..*width].iter().map(property).collect())
        };
        self.list.iter().map(channel).collect()
    }
}

/// The type that keeps an attribute's numbers: colours and other numbers stay integers.
pub(super) fn number_type(slot: &Slot, elements: &Elements) -> NumberType {
    let is_color = matches!(slot, Slot::Color(_));
    let is_raw = match slot {
        Slot::Normal | Slot::TextureCoordinate(_) => false,
        Slot::Color(_) => elements.is_normalized,
        Slot::Scalar(_) => !elements.is_normalized,
    };
    match elements.number {
        ComponentType::U8 if is_raw => NumberType::U8,
        ComponentType::U16 if is_raw => NumberType::U16,
        ComponentType::I8 if is_raw && !is_color => NumberType::I8,
        ComponentType::I16 if is_raw && !is_color => NumberType::I16,
        ComponentType::U32 if is_raw && !is_color => NumberType::U32,
        _ => NumberType::F32,
    }
}

/// One type for numbers of two.
fn common_type(a: NumberType, b: NumberType) -> NumberType {
    if a == b {
        a
    } else if a.fits_single() && b.fits_single() {
        NumberType::F32
    } else {
        NumberType::F64
    }
}
