//! What a structure is, in the words of the paper's Table 1 and of the chapter's criteria.

use serde::{Serialize, Serializer};

/// How an entry of the paper's Table 1 is come by.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Access {
    /// M: stored.
    Stored,
    /// (M): not as an edge, but by the order of a face's corners.
    ByOrder,
    /// M,C: one of two stored, the other computed in constant time.
    Half,
    /// C: computed in constant time.
    Computed,
    /// –: takes more than constant time.
    Searched,
}

impl Access {
    /// The entry as the paper prints it.
    pub fn symbol(self) -> &'static str {
        match self {
            Access::Stored => "M",
            Access::ByOrder => "(M)",
            Access::Half => "M,C",
            Access::Computed => "C",
            Access::Searched => "-",
        }
    }
}

impl Serialize for Access {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.symbol())
    }
}

/// A question about neighbours.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Query {
    /// FV: the vertices of a face.
    FaceVertices,
    /// EV: both vertices of an edge.
    EdgeVertices,
    /// VF: all faces sharing a vertex.
    VertexFaces,
    /// EF: all faces sharing an edge.
    EdgeFaces,
    /// FE: the edges of a face.
    FaceEdges,
    /// VE: all edges sharing a vertex.
    VertexEdges,
    /// The vertices next to a vertex.
    OneRing,
    /// The boundary edge behind a boundary edge: a boundary loop is a run of these.
    BoundaryStep,
}

impl Query {
    /// Every query, in the order of the lecture notes.
    pub const ALL: [Query; 8] = [
        Query::FaceVertices,
        Query::EdgeVertices,
        Query::VertexFaces,
        Query::EdgeFaces,
        Query::FaceEdges,
        Query::VertexEdges,
        Query::OneRing,
        Query::BoundaryStep,
    ];

    /// The query's name in a table.
    pub fn symbol(self) -> &'static str {
        match self {
            Query::FaceVertices => "FV",
            Query::EdgeVertices => "EV",
            Query::VertexFaces => "VF",
            Query::EdgeFaces => "EF",
            Query::FaceEdges => "FE",
            Query::VertexEdges => "VE",
            Query::OneRing => "ring",
            Query::BoundaryStep => "boundary",
        }
    }
}

/// What an answer costs.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Cost {
    /// The same for every mesh.
    Constant,
    /// A step for each face around a vertex.
    Star,
    /// A look at every face of the mesh.
    Search,
}

/// The costs of the queries, in the order of [`Query::ALL`].
pub type Costs = [Cost; 8];

/// The costs of a list of faces: only FV, EV and FE need no search (lecture notes).
pub const COSTS_OF_LISTS: Costs = [
    Cost::Constant,
    Cost::Constant,
    Cost::Search,
    Cost::Search,
    Cost::Constant,
    Cost::Search,
    Cost::Search,
    Cost::Search,
];

/// The costs of links across edges; the next boundary edge is found by turning around a vertex, since
/// "there is no atomic operation to enumerate the next boundary edge" (chapter, section 2.4).
pub const COSTS_OF_LINKS: Costs = [
    Cost::Constant,
    Cost::Constant,
    Cost::Star,
    Cost::Constant,
    Cost::Constant,
    Cost::Star,
    Cost::Star,
    Cost::Star,
];

/// The costs of links across edges and along boundaries.
pub const COSTS_OF_LINKED_BOUNDARIES: Costs = {
    let mut costs = COSTS_OF_LINKS;
    costs[7] = Cost::Constant;
    costs
};

/// The 4-byte words that a structure stores of each kind of entity; positions are three of a vertex's.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Words {
    /// Words a vertex.
    pub vertex: usize,
    /// Words an edge (two sides together).
    pub edge: usize,
    /// Words a face.
    pub face: usize,
}

impl Words {
    /// The bytes of a mesh of so many entities, without what is paid for non-manifold ones.
    pub fn bytes(self, vertices: usize, edges: usize, faces: usize) -> usize {
        4 * (self.vertex * vertices + self.edge * edges + self.face * faces)
    }

    /// The bytes a face of a large closed mesh whose faces have so many corners, and a vertex.
    ///
    /// Every edge has two faces, so E = cF/2 for c corners, and by Euler V = E − F + 2(1 − genus),
    /// where the last term vanishes beside the others: triangles have E = 3F/2 and V = F/2, as the
    /// paper has it (section 1, m ≈ 2n), quads E = 2F and V = F.
    pub fn limits(self, corners: usize) -> (f64, f64) {
        let edges = corners as f64 / 2.0;
        let vertices = edges - 1.0;
        let words = self.vertex as f64 * vertices + self.edge as f64 * edges + self.face as f64;
        (4.0 * words, 4.0 * words / vertices)
    }
}

/// What a structure is.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Description {
    /// Its name, as in the paper's Table 1 where it stands there.
    pub name: &'static str,
    /// The bytes a triangle that the paper states (Table 1, section 1, section 3).
    pub stated_bytes_per_face: Option<u32>,
    /// The bytes a vertex that the chapter states.
    pub stated_bytes_per_vertex: Option<u32>,
    /// What it stores.
    pub words: Words,
    /// Whether it carries edges of three faces and vertices of several fans.
    pub carries_non_manifold: bool,
    /// Column "neighborhood" of the paper's Table 1.
    pub neighbourhood: Access,
    /// Column "point reference".
    pub point_reference: Access,
    /// Column "prev. edge".
    pub previous_edge: Access,
    /// Column "next edge".
    pub next_edge: Access,
    /// What the answers cost.
    pub costs: Costs,
}
