//! Ids of vertices, directed edges and faces. They never mix, and become `usize` only to index.

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
        #[repr(transparent)]
        pub struct $name(u32);

        impl $name {
            /// The id of slot `index`, which must lie below 2³¹.
            #[inline(always)]
            pub fn new(index: usize) -> Self {
                debug_assert!(index <= i32::MAX as usize, "{index} is no slot");
                Self(index as u32)
            }

            /// The slot to index an array with.
            #[inline(always)]
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}

id! {
    /// A vertex slot.
    VertexId
}
id! {
    /// A directed edge: the `e % 3`-th of face `e / 3`.
    EdgeId
}
id! {
    /// A face (triangle) slot.
    FaceId
}

impl EdgeId {
    /// The face that this directed edge lies in.
    #[inline(always)]
    pub fn face(self) -> FaceId {
        FaceId(self.0 / 3)
    }
}

impl FaceId {
    /// The three directed edges of this face: 3i, 3i+1, 3i+2 (FE).
    #[inline(always)]
    pub fn edges(self) -> [EdgeId; 3] {
        [0, 1, 2].map(|k| EdgeId(3 * self.0 + k))
    }
}
