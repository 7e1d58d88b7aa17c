//! Signed words as enums: the only file that knows what a negative index means.
//!
//! The paper (section 3, Figure 6) uses the sign bit of an index for what is not manifold, so that
//! such entities cost memory only where they are.

use super::ids::EdgeId;

/// A row of a side table.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct RowId(u32);

impl RowId {
    /// The id of row `index`.
    pub fn new(index: usize) -> Self {
        debug_assert!(index < (i32::MAX - 1) as usize, "{index} is no row");
        Self(index as u32)
    }

    /// The row to index a table with.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// What lies across a directed edge.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Opposite {
    /// The mate: the one other directed edge, which runs the other way.
    Edge(EdgeId),
    /// Nothing.
    Boundary,
    /// More than one face, or one that runs along the edge the same way; the row lists all the
    /// directed edges of this edge.
    NonManifold(RowId),
}

/// Where the walk around a vertex begins.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Outgoing {
    /// An edge of the vertex's only fan; of an open fan the first.
    Fan(EdgeId),
    /// Several fans; the row lists one edge of each.
    Fans(RowId),
    /// The vertex is isolated or dead.
    None,
}

/// The stored word of an [`Opposite`], or the mark of a dead face.
///
/// `e ≥ 0` is the mate, −1 the boundary, `x ≤ −2` row `−x−2`, `i32::MIN` dead.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(transparent)]
pub struct OppositeWord(i32);

impl OppositeWord {
    /// The word of an edge whose face is gone.
    pub const DEAD: Self = Self(i32::MIN);
    /// The word of a boundary edge.
    pub const BOUNDARY: Self = Self(-1);

    /// Whether the face of this edge is gone.
    #[inline(always)]
    pub fn is_dead(self) -> bool {
        self.0 == i32::MIN
    }

    /// What the word says. The face must be alive.
    #[inline(always)]
    pub fn decode(self) -> Opposite {
        debug_assert!(!self.is_dead(), "the opposite of a dead edge was asked for");
        match self.0 {
            e if e >= 0 => Opposite::Edge(EdgeId::new(e as usize)),
            -1 => Opposite::Boundary,
            x => Opposite::NonManifold(RowId((-x - 2) as u32)),
        }
    }
}

impl From<Opposite> for OppositeWord {
    #[inline(always)]
    fn from(opposite: Opposite) -> Self {
        match opposite {
            Opposite::Edge(e) => Self(e.index() as i32),
            Opposite::Boundary => Self::BOUNDARY,
            Opposite::NonManifold(row) => Self(-(row.0 as i32) - 2),
        }
    }
}

/// The stored word of an [`Outgoing`].
///
/// `e ≥ 0` is an edge of the only fan, `x < 0` row `−x−1`, `i32::MIN` none.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(transparent)]
pub struct OutgoingWord(i32);

impl OutgoingWord {
    /// What the word says.
    #[inline(always)]
    pub fn decode(self) -> Outgoing {
        match self.0 {
            e if e >= 0 => Outgoing::Fan(EdgeId::new(e as usize)),
            i32::MIN => Outgoing::None,
            x => Outgoing::Fans(RowId((-x - 1) as u32)),
        }
    }
}

impl From<Outgoing> for OutgoingWord {
    #[inline(always)]
    fn from(outgoing: Outgoing) -> Self {
        match outgoing {
            Outgoing::Fan(e) => Self(e.index() as i32),
            Outgoing::Fans(row) => Self(-(row.0 as i32) - 1),
            Outgoing::None => Self(i32::MIN),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_link_comes_back_as_it_went() {
        for i in [0, 1, 2, 1_000_000, i32::MAX as usize - 2] {
            for link in [
                Opposite::Edge(EdgeId::new(i)),
                Opposite::NonManifold(RowId::new(i)),
            ] {
                assert_eq!(OppositeWord::from(link).decode(), link);
            }
            for link in [Outgoing::Fan(EdgeId::new(i)), Outgoing::Fans(RowId::new(i))] {
                assert_eq!(OutgoingWord::from(link).decode(), link);
            }
        }
        assert_eq!(
            OppositeWord::from(Opposite::Boundary).decode(),
            Opposite::Boundary
        );
        assert_eq!(OutgoingWord::from(Outgoing::None).decode(), Outgoing::None);
    }

    /// The paper's Figure 6: the entry −4 names row 3.
    #[test]
    fn the_papers_figure_6() {
        assert_eq!(OutgoingWord(-4).decode(), Outgoing::Fans(RowId::new(3)));
    }
}
