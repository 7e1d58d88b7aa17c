//! Directed edges for pure quad meshes: four to a face, numbered like those of triangles.

use glam::Vec3;
use smallvec::SmallVec;

use super::cannot_carry::check_faces;
use super::description::{Access, COSTS_OF_LINKS, Description, Words};
use super::{CannotCarry, Edge, Face, Structure, Vertex};
use crate::mesh::{EdgeId, Opposite, OppositeWord, Outgoing, OutgoingWord, SideTable};

/// Directed edges of quads, in the form of the small tier ("an adaption to pure quad meshes is
/// straightforward", chapter, section 2.4): quad i owns the directed edges 4i … 4i+3.
///
/// ```text
///       3 <──4i+2── 2        face(e) = e/4, next and prev by e%4
///       │           ↑
///     4i+3    i   4i+1       stored: head and opposite of each directed edge, position and one
///       ↓           │        outgoing edge of each vertex
///       0 ───4i───> 1
/// ```
///
/// 16 bytes a vertex and 32 a quad: 48 bytes a quad, and as many a vertex, since a large closed quad
/// mesh has as many of both. What is not manifold is in side tables, as the paper has it for triangles
/// (section 3, Figure 6): the same words, decoded by the same code.
#[derive(Clone, Debug)]
pub struct QuadDirectedEdges {
    positions: Vec<Vec3>,
    outgoing: Vec<OutgoingWord>,
    edges: Vec<Directed>,
    edge_rows: SideTable,
    fan_rows: SideTable,
}

#[derive(Clone, Copy, Debug)]
struct Directed {
    head: Vertex,
    opposite: OppositeWord,
}

/// The directed edge behind `e` in its quad.
#[inline(always)]
fn next(e: EdgeId) -> EdgeId {
    let e = e.index();
    EdgeId::new(if e % 4 == 3 { e - 3 } else { e + 1 })
}

/// The directed edge before `e` in its quad.
#[inline(always)]
fn prev(e: EdgeId) -> EdgeId {
    let e = e.index();
    EdgeId::new(if e.is_multiple_of(4) { e + 3 } else { e - 1 })
}

#[inline(always)]
fn face(e: EdgeId) -> Face {
    Face::new(e.index() / 4)
}

#[inline(always)]
fn edge(e: EdgeId) -> Edge {
    Edge::new(e.index())
}

#[inline(always)]
fn edge_id(e: Edge) -> EdgeId {
    EdgeId::new(e.index())
}

/// A directed edge from its smaller end: the larger end, whether it runs from there, its name.
type AtSmallerEnd = (u32, bool, u32);

/// The directed edges of these quads by the smaller of their ends, those of one edge side by side; and
/// where the list of each vertex ends.
fn by_smaller_end(vertices: usize, faces: &[[u32; 4]]) -> (Vec<AtSmallerEnd>, Vec<u32>) {
    let sides = |f: &[u32; 4]| {
        let [a, b, c, d] = *f;
        [[a, b], [b, c], [c, d], [d, a]]
    };
    let mut ends = vec![0u32; vertices];
    for [a, b] in faces.iter().flat_map(sides) {
        ends[a.min(b) as usize] += 1;
    }
    let mut begin = 0;
    for end in &mut ends {
        begin += std::mem::replace(end, begin);
    }
    let mut list = vec![(0, false, 0); 4 * faces.len()];
    // Filling moves each begin to its end.
    for ([a, b], e) in faces.iter().flat_map(sides).zip(0..) {
        let end = &mut ends[a.min(b) as usize];
        list[*end as usize] = (a.max(b), a > b, e);
        *end += 1;
    }
    let mut begin = 0;
    for &end in &ends {
        list[begin..end as usize].sort_unstable();
        begin = end as usize;
    }
    (list, ends)
}

impl QuadDirectedEdges {
    /// The most quads whose directed edges 31 bits can name.
    pub const MAX_QUADS: usize = i32::MAX as usize / 4;

    #[inline(always)]
    fn head(&self, e: EdgeId) -> Vertex {
        self.edges[e.index()].head
    }

    #[inline(always)]
    fn tail(&self, e: EdgeId) -> Vertex {
        self.head(prev(e))
    }

    #[inline(always)]
    fn opposite(&self, e: EdgeId) -> Opposite {
        self.edges[e.index()].opposite.decode()
    }

    /// The directed edge across `e`, if exactly one and running the other way.
    #[inline(always)]
    fn mate(&self, e: EdgeId) -> Option<EdgeId> {
        match self.opposite(e) {
            Opposite::Edge(o) => Some(o),
            Opposite::Boundary | Opposite::NonManifold(_) => None,
        }
    }

    /// Every directed edge of the edge that `e` is part of.
    fn edge_star(&self, e: EdgeId) -> SmallVec<[EdgeId; 2]> {
        match self.opposite(e) {
            Opposite::Edge(o) => SmallVec::from_buf([e, o]),
            Opposite::Boundary => std::iter::once(e).collect(),
            Opposite::NonManifold(row) => SmallVec::from_slice(self.edge_rows.row(row)),
        }
    }

    /// One edge of each fan of a vertex; of an open fan its first.
    fn fans(&self, v: Vertex) -> SmallVec<[EdgeId; 2]> {
        match self.outgoing[v.index()].decode() {
            Outgoing::Fan(e) => std::iter::once(e).collect(),
            Outgoing::Fans(row) => SmallVec::from_slice(self.fan_rows.row(row)),
            Outgoing::None => SmallVec::new(),
        }
    }

    /// The outgoing edges of the fan that begins at `start`, by the step e → opposite(prev(e)).
    fn fan(&self, start: EdgeId) -> impl Iterator<Item = EdgeId> + '_ {
        std::iter::successors(Some(start), move |&e| {
            self.mate(prev(e)).filter(|&o| o != start)
        })
    }

    /// The first edge of the fan that the outgoing edge `e` lies in; of a closed fan `e` itself.
    fn fan_start(&self, e: EdgeId) -> EdgeId {
        let mut start = e;
        while let Some(o) = self.mate(start) {
            start = next(o);
            if start == e {
                break;
            }
        }
        start
    }

    /// Pairs opposites; edges of three quads or more, and of two that run the same way, get a row.
    fn pair(&mut self, faces: &[[u32; 4]]) {
        let (list, ends) = by_smaller_end(self.positions.len(), faces);
        let id = |&(.., e): &AtSmallerEnd| EdgeId::new(e as usize);
        let mut begin = 0;
        for end in ends {
            let at_vertex = &list[begin..end as usize];
            begin = end as usize;
            for same in at_vertex.chunk_by(|a, b| a.0 == b.0) {
                match same {
                    [_] => {}
                    [a, b] if a.1 != b.1 => {
                        let [a, b] = [id(a), id(b)];
                        self.edges[a.index()].opposite = Opposite::Edge(b).into();
                        self.edges[b.index()].opposite = Opposite::Edge(a).into();
                    }
                    _ => {
                        let row = self.edge_rows.insert(same.iter().map(id).collect());
                        for e in same.iter().map(id) {
                            self.edges[e.index()].opposite = Opposite::NonManifold(row).into();
                        }
                    }
                }
            }
        }
    }

    /// Finds the fans of every vertex.
    fn find_fans(&mut self) {
        let mut seen = vec![false; self.edges.len()];
        for e in (0..self.edges.len()).map(EdgeId::new) {
            if seen[e.index()] {
                continue;
            }
            let start = self.fan_start(e);
            self.fan(start).for_each(|e| seen[e.index()] = true);
            let v = self.tail(e).index();
            let outgoing = match self.outgoing[v].decode() {
                Outgoing::None => Outgoing::Fan(start),
                Outgoing::Fan(first) => Outgoing::Fans(self.fan_rows.insert(vec![first, start])),
                Outgoing::Fans(row) => {
                    self.fan_rows.push(row, start);
                    continue;
                }
            };
            self.outgoing[v] = outgoing.into();
        }
        self.fan_rows.sort_all();
    }

    /// The edges, by their two ends.
    pub fn edge_count(&self) -> usize {
        let is_first = |&e: &EdgeId| match self.opposite(e) {
            Opposite::Edge(o) => e < o,
            Opposite::Boundary => true,
            Opposite::NonManifold(_) => false,
        };
        let edges = (0..self.edges.len()).map(EdgeId::new);
        edges.filter(is_first).count() + self.edge_rows.len()
    }

    /// Whether exactly one quad lies at `e`.
    pub fn is_boundary(&self, e: Edge) -> bool {
        self.opposite(edge_id(e)) == Opposite::Boundary
    }

    /// The edges that three quads or more share, or two that run along it the same way.
    pub fn non_manifold_edge_count(&self) -> usize {
        self.edge_rows.len()
    }

    /// Verifies that links lead back, that rows list whole edges, and that the fans of the vertices
    /// hold every directed edge once. Linear time.
    ///
    /// # Errors
    /// A sentence that names the first thing found wrong.
    pub fn check(&self) -> Result<(), String> {
        for e in (0..self.edges.len()).map(EdgeId::new) {
            let ends = [self.tail(e), self.head(e)];
            if let Some(o) = self.mate(e)
                && (self.mate(o) != Some(e) || [self.head(o), self.tail(o)] != ends)
            {
                return Err(format!(
                    "{e:?} and its opposite {o:?} are none of each other"
                ));
            }
            let star = self.edge_star(e);
            let same_ends = |&o: &EdgeId| {
                let other = [self.tail(o), self.head(o)];
                other == ends || other == [ends[1], ends[0]]
            };
            if !star.contains(&e) || !star.iter().all(same_ends) {
                return Err(format!("{e:?}: its edge has the directed edges {star:?}"));
            }
        }
        let mut fans_of = vec![0; self.edges.len()];
        for v in (0..self.outgoing.len()).map(Vertex::new) {
            for start in self.fans(v) {
                if self.mate(start).is_some() && self.fan_start(start) != start {
                    return Err(format!("{v:?}: {start:?} is not the first of its fan"));
                }
                for e in self.fan(start) {
                    if self.tail(e) != v {
                        return Err(format!("{v:?}: {e:?} of its fan does not leave it"));
                    }
                    fans_of[e.index()] += 1;
                }
            }
        }
        match fans_of.iter().position(|&n| n != 1) {
            Some(e) => Err(format!("directed edge {e} lies in {} fans", fans_of[e])),
            None => Ok(()),
        }
    }
}

impl Structure<4> for QuadDirectedEdges {
    const DESCRIPTION: Description = Description {
        name: "small directed-edge, quads",
        stated_bytes_per_face: None,
        stated_bytes_per_vertex: None,
        words: Words {
            vertex: 4,
            edge: 0,
            face: 8,
        },
        carries_non_manifold: true,
        neighbourhood: Access::Stored,
        point_reference: Access::Half,
        previous_edge: Access::Computed,
        next_edge: Access::Computed,
        costs: COSTS_OF_LINKS,
    };

    fn build(positions: &[Vec3], faces: &[[u32; 4]]) -> Result<Self, CannotCarry> {
        check_faces(faces)?;
        if faces.len() > Self::MAX_QUADS {
            let edges = 2 * faces.len();
            return Err(CannotCarry::TooManyEdges { edges });
        }
        let directed = |f: &[u32; 4]| {
            let [a, b, c, d] = f.map(|v| Vertex::new(v as usize));
            [b, c, d, a].map(|head| Directed {
                head,
                opposite: OppositeWord::BOUNDARY,
            })
        };
        let edges: Vec<_> = faces.iter().map(directed).collect();
        let mut mesh = Self {
            positions: positions.to_vec(),
            outgoing: vec![Outgoing::None.into(); positions.len()],
            edges: edges.into_flattened(),
            edge_rows: SideTable::default(),
            fan_rows: SideTable::default(),
        };
        mesh.pair(faces);
        mesh.find_fans();
        Ok(mesh)
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.positions[..])
            + size_of_val(&self.outgoing[..])
            + size_of_val(&self.edges[..])
            + self.edge_rows.bytes()
            + self.fan_rows.bytes()
    }

    fn position(&self, v: Vertex) -> Vec3 {
        self.positions[v.index()]
    }

    fn face_vertices(&self, f: Face) -> [Vertex; 4] {
        self.face_edges(f).map(|e| self.tail(edge_id(e)))
    }

    fn face_edges(&self, f: Face) -> [Edge; 4] {
        [0, 1, 2, 3].map(|k| Edge::new(4 * f.index() + k))
    }

    fn edge_vertices(&self, e: Edge) -> [Vertex; 2] {
        [self.tail(edge_id(e)), self.head(edge_id(e))]
    }

    fn edge_faces(&self, e: Edge, visit: impl FnMut(Face)) {
        self.edge_star(edge_id(e))
            .into_iter()
            .map(face)
            .for_each(visit);
    }

    fn vertex_faces(&self, v: Vertex, mut visit: impl FnMut(Face)) {
        for start in self.fans(v) {
            self.fan(start).map(face).for_each(&mut visit);
        }
    }

    fn vertex_edges(&self, v: Vertex, mut visit: impl FnMut(Edge)) {
        // Fans that end at one non-manifold edge both meet it; the first keeps it.
        let mut rows: SmallVec<[_; 4]> = SmallVec::new();
        let mut meet = |e| {
            let is_new = match self.opposite(e) {
                Opposite::NonManifold(row) if rows.contains(&row) => false,
                Opposite::NonManifold(row) => {
                    rows.push(row);
                    true
                }
                Opposite::Edge(_) | Opposite::Boundary => true,
            };
            if is_new {
                visit(edge(e));
            }
        };
        for start in self.fans(v) {
            for e in self.fan(start) {
                meet(e);
                let before = prev(e);
                if self.mate(before).is_none() {
                    meet(before);
                }
            }
        }
    }

    /// The other ends of the vertex's edges; not the corners across its quads.
    fn one_ring(&self, v: Vertex, mut visit: impl FnMut(Vertex)) {
        self.vertex_edges(v, |e| {
            let [tail, head] = self.edge_vertices(e);
            visit(if tail == v { head } else { tail });
        });
    }

    fn boundary_step(&self, e: Edge) -> Option<Edge> {
        let before = prev(self.fan(edge_id(e)).last()?);
        let is_boundary = self.opposite(before) == Opposite::Boundary;
        is_boundary.then(|| edge(before))
    }
}
