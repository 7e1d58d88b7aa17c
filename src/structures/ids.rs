//! References of four bytes, and four bytes too where there may be none.

use std::num::NonZeroU32;

macro_rules! reference {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
        #[repr(transparent)]
        pub struct $name(NonZeroU32);

        impl $name {
            /// The reference to slot `index`, which must lie below 2³²−1.
            #[inline(always)]
            pub fn new(index: usize) -> Self {
                debug_assert!(index < u32::MAX as usize, "{index} is no slot");
                // Counted from 1, so that zero is left to say that there is none.
                Self(NonZeroU32::MIN.saturating_add(index as u32))
            }

            /// The slot to index an array with.
            #[inline(always)]
            pub fn index(self) -> usize {
                self.0.get() as usize - 1
            }
        }
    };
}

reference! {
    /// A vertex by its index in the input; in individual triangles, which have none, any corner that
    /// lies there.
    Vertex
}
reference! {
    /// An edge under its structure's own name: a corner, a winged edge, a half-edge, a directed edge.
    Edge
}
reference! {
    /// A face by its index in the input.
    Face
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No structure pays for a link that may lead nowhere.
    #[test]
    fn no_reference_takes_no_room() {
        assert_eq!(size_of::<Option<Edge>>(), 4);
        for index in [0, 1, u32::MAX as usize - 1] {
            assert_eq!(Vertex::new(index).index(), index);
        }
    }
}
