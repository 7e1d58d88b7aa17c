//! The side tables: rows of directed edges for what is not manifold (paper, section 3, Figure 6).

use super::ids::EdgeId;
use super::link::RowId;

/// Rows of directed edges, each in ascending order; freed rows are used again.
///
/// The same table serves non-manifold edges (a row lists every directed edge of the edge) and
/// non-manifold vertices (a row lists one outgoing edge of each fan).
#[derive(Clone, Debug, Default)]
pub struct SideTable {
    rows: Vec<Vec<EdgeId>>,
    free: Vec<RowId>,
}

impl SideTable {
    /// Adds a row.
    pub fn insert(&mut self, mut edges: Vec<EdgeId>) -> RowId {
        edges.sort_unstable();
        match self.free.pop() {
            Some(row) => {
                self.rows[row.index()] = edges;
                row
            }
            None => {
                self.rows.push(edges);
                RowId::new(self.rows.len() - 1)
            }
        }
    }

    /// Frees a row and returns what it held.
    pub fn remove(&mut self, row: RowId) -> Vec<EdgeId> {
        self.free.push(row);
        std::mem::take(&mut self.rows[row.index()])
    }

    /// The directed edges in a row, ascending.
    pub fn row(&self, row: RowId) -> &[EdgeId] {
        &self.rows[row.index()]
    }

    /// Adds one edge at the end of a row, which must be [sorted](Self::sort_all) before it is asked.
    pub fn push(&mut self, row: RowId, edge: EdgeId) {
        self.rows[row.index()].push(edge);
    }

    /// Puts every row in ascending order.
    pub fn sort_all(&mut self) {
        self.rows.iter_mut().for_each(|row| row.sort_unstable());
    }

    /// Puts `new` in the place of `old`, which must be in the row.
    pub fn replace(&mut self, row: RowId, old: EdgeId, new: EdgeId) {
        self.take(row, old);
        self.put(row, new);
    }

    /// Puts one edge more into a row, in its place.
    pub fn put(&mut self, row: RowId, new: EdgeId) {
        let edges = &mut self.rows[row.index()];
        let at = edges.partition_point(|&e| e < new);
        edges.insert(at, new);
    }

    /// Takes `old`, which must be in the row, out of it.
    pub fn take(&mut self, row: RowId, old: EdgeId) {
        let edges = &mut self.rows[row.index()];
        let at = edges
            .binary_search(&old)
            .expect("the row lists the edge that it is asked for");
        edges.remove(at);
    }

    /// The rows in use.
    pub fn rows(&self) -> impl Iterator<Item = &[EdgeId]> + '_ {
        self.rows
            .iter()
            .filter(|row| !row.is_empty())
            .map(Vec::as_slice)
    }

    /// Renames the edges of one row, and sorts it again.
    pub fn rename_row(&mut self, row: RowId, rename: impl Fn(EdgeId) -> EdgeId) {
        let edges = &mut self.rows[row.index()];
        edges.iter_mut().for_each(|e| *e = rename(*e));
        edges.sort_unstable();
    }

    /// Renames every edge, and sorts the rows again.
    pub fn rename(&mut self, rename: impl Fn(EdgeId) -> EdgeId) {
        for row in (0..self.rows.len()).map(RowId::new) {
            self.rename_row(row, &rename);
        }
    }

    /// The number of rows in use.
    pub fn len(&self) -> usize {
        self.rows.len() - self.free.len()
    }

    /// The bytes that the table holds: none while everything is manifold.
    pub fn bytes(&self) -> usize {
        let edges: usize = self.rows.iter().map(Vec::capacity).sum();
        self.rows.capacity() * size_of::<Vec<EdgeId>>()
            + edges * size_of::<EdgeId>()
            + self.free.capacity() * size_of::<RowId>()
    }
}
