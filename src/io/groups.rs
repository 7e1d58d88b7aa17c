//! The groups of a file while it is read.

use std::collections::HashMap;
use std::hash::Hash;

use crate::attributes::Group;

/// How many bytes of names a group may have on average. A group repeats the names of its object and its
/// material, and a file that gives a million groups one long name must not take a million times its room.
const NAME_BYTES_A_GROUP: usize = 256;
/// Names of so many bytes in all are no harm.
const HARMLESS_NAME_BYTES: usize = 1 << 20;

/// Finds groups by what tells them apart.
pub(super) struct GroupTable<Key> {
    numbers: HashMap<Key, u32>,
    name_bytes: usize,
    is_given_up: bool,
}

impl<Key: Hash + Eq> GroupTable<Key> {
    pub fn new() -> Self {
        GroupTable {
            numbers: HashMap::new(),
            name_bytes: 0,
            is_given_up: false,
        }
    }

    /// The group of `key`, which `group` makes where it is new; none where groups were given up.
    pub fn find(
        &mut self,
        key: Key,
        groups: &mut Vec<Group>,
        group: impl FnOnce() -> Group,
    ) -> Option<u32> {
        if self.is_given_up {
            return None;
        }
        if let Some(&number) = self.numbers.get(&key) {
            return Some(number);
        }
        let number = groups.len() as u32;
        let group = group();
        self.name_bytes += group.object.len() + group.name.len() + group.material.len();
        if self.name_bytes > HARMLESS_NAME_BYTES.max(NAME_BYTES_A_GROUP * groups.len()) {
            self.give_up(groups);
            return None;
        }
        groups.push(group);
        self.numbers.insert(key, number);
        Some(number)
    }

    /// Has none from here on.
    pub fn give_up(&mut self, groups: &mut Vec<Group>) {
        *groups = Vec::new();
        self.numbers = HashMap::new();
        self.is_given_up = true;
    }

    /// Whether they were given up.
    pub fn is_given_up(&self) -> bool {
        self.is_given_up
    }
}

/// What a notice says where names were the reason to give groups up.
pub(super) const NAMES_TOO_LONG: &str =
    "groups are not carried: their names take more than 256 bytes each";

#[cfg(test)]
mod tests {
    use super::*;

    /// A long name is kept once or a few times, and not for every group.
    #[test]
    fn long_names_are_not_repeated_without_end() {
        let mut table = GroupTable::new();
        let mut groups = Vec::new();
        let named = |bytes: usize| Group {
            object: "x".repeat(bytes),
            ..Group::default()
        };
        assert_eq!(table.find(7, &mut groups, || named(1 << 19)), Some(0));
        assert_eq!(table.find(8, &mut groups, || named(1 << 19)), Some(1));
        assert_eq!(table.find(7, &mut groups, || unreachable!()), Some(0));
        assert!(!table.is_given_up());
        assert_eq!(table.find(9, &mut groups, || named(1)), None);
        assert_eq!(table.find(7, &mut groups, || unreachable!()), None);
        assert!(table.is_given_up() && groups.is_empty());
    }
}
