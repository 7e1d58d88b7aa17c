//! Table 1 of the paper, measured, and beside it what the chapter's criteria ask: "(a) time to
//! construct it during preprocessing, (b) time to answer a specific query, (c) time to perform a
//! specific operation, and (d) memory consumption and redundancy" (chapter, opening).

use std::hint::black_box;
use std::time::{Duration, Instant};

use glam::Vec3;
use serde::ser::SerializeMap;
use serde::{Serialize, Serializer};

use super::{
    Access, CannotCarry, Cost, DirectedEdges, Edge, Face, Flip, HalfEdge, IndividualTriangles,
    PairedHalfEdge, QuadDirectedEdges, QuadEdge, Query, SharedVertex, SharedVertexWithNeighbours,
    Structure, Vertex, WingedEdge,
};
use crate::clean::clean;
use crate::error::{Error, Result};
use crate::indexed_mesh::{IndexedMesh, Parts, PolygonMesh};
use crate::mesh::{EdgeId, Full, Medium, Mesh, Oriented, Small, turn_round};

/// The places that queries are asked at, more than a processor's cache holds the surroundings of.
const SAMPLES: usize = 1 << 18;
/// The edges that are flipped, at most.
const FLIPS: usize = 1 << 16;
/// How long a query is asked: a search through a million triangles fits in several times, and eight
/// queries of ten structures take two seconds together.
const QUERY_BUDGET: Duration = Duration::from_millis(20);
/// How long a block of queries takes at least, so that reading the clock costs nothing beside it.
const BLOCK: Duration = Duration::from_millis(1);
/// How long a structure is built again and again; twice in any case, since the first run meets
/// memory that the system has yet to hand out.
const BUILD_BUDGET: Duration = Duration::from_millis(100);

/// A mesh in every structure.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Measured {
    /// What a face is.
    #[serde(rename = "face")]
    pub face_name: &'static str,
    /// Vertices that a face uses.
    pub vertices: usize,
    /// Edges, by their two ends.
    pub edges: usize,
    /// Faces.
    pub faces: usize,
    /// Faces that were left out: they name a vertex twice, repeat another, or are not finite.
    pub dropped_faces: usize,
    /// Edges of one face.
    pub boundary_edges: usize,
    /// Edges of three faces or more, or of two that run along it the same way.
    pub non_manifold_edges: usize,
    /// A row a structure, in the order of the paper's table.
    pub structures: Vec<Row>,
}

/// A structure in the table.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Row {
    /// Its name.
    pub structure: &'static str,
    /// Why it cannot carry this mesh; then nothing is measured. Vertices are counted from 0, those that
    /// cleaning drops left out.
    pub cannot_carry: Option<String>,
    /// What is counted by faces.
    #[serde(flatten)]
    pub per_face: PerFace,
    /// The bytes a vertex that the chapter states.
    pub bytes_per_vertex_stated: Option<u32>,
    /// Those of a large closed mesh, by the words that are stored.
    pub bytes_per_vertex_formula: f64,
    /// Those of this mesh.
    pub bytes_per_vertex: Option<f64>,
    /// All of this mesh.
    pub bytes: Option<usize>,
    /// The share of them beyond one position a vertex and one reference a corner, from which all else
    /// can be computed (shared vertices: the paper's "lower limit", section 1); 0 where there are fewer,
    /// as in individual triangles that share nothing.
    pub redundancy_share: Option<f64>,
    /// Whether it carries edges of three faces and vertices of several fans.
    pub carries_non_manifold: bool,
    /// Columns of the paper's Table 1: M stored, C computed in constant time, - neither.
    pub neighbourhood: Access,
    /// The vertices of an edge.
    pub point_reference: Access,
    /// The edge before another in its face.
    pub previous_edge: Access,
    /// The edge behind.
    pub next_edge: Access,
    /// What answers take at random places.
    pub queries: QueryTimes,
    /// What the flip of an edge at a random place takes, where the structure has one.
    pub edge_flip_ns: Option<f64>,
}

/// What is counted by faces; its keys name them.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct PerFace {
    /// What a face is.
    pub face_name: &'static str,
    /// The bytes that the paper states.
    pub bytes_stated: Option<u32>,
    /// Those of a large closed mesh, by the words that are stored.
    pub bytes_formula: f64,
    /// Those of this mesh.
    pub bytes: Option<f64>,
    /// Building from positions and faces.
    pub construct_ns: Option<f64>,
}

impl Serialize for PerFace {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let face = self.face_name;
        let mut map = serializer.serialize_map(Some(4))?;
        map.serialize_entry(&format!("bytes_per_{face}_stated"), &self.bytes_stated)?;
        map.serialize_entry(&format!("bytes_per_{face}_formula"), &self.bytes_formula)?;
        map.serialize_entry(&format!("bytes_per_{face}"), &self.bytes)?;
        map.serialize_entry(&format!("construct_ns_per_{face}"), &self.construct_ns)?;
        map.end()
    }
}

/// A query: what an answer costs, and took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct QueryTime {
    /// What it depends on.
    pub cost: Cost,
    /// Nothing where there was nothing to ask for, or no structure to ask.
    pub ns: Option<f64>,
}

/// All queries.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct QueryTimes {
    /// FV.
    pub face_vertices: QueryTime,
    /// EV.
    pub edge_vertices: QueryTime,
    /// VF.
    pub vertex_faces: QueryTime,
    /// EF.
    pub edge_faces: QueryTime,
    /// FE.
    pub face_edges: QueryTime,
    /// VE.
    pub vertex_edges: QueryTime,
    /// The vertices next to a vertex.
    pub one_ring: QueryTime,
    /// From one edge of a boundary loop to the next.
    pub boundary_step: QueryTime,
}

impl QueryTimes {
    /// The time of one query.
    pub fn get(&self, query: Query) -> QueryTime {
        match query {
            Query::FaceVertices => self.face_vertices,
            Query::EdgeVertices => self.edge_vertices,
            Query::VertexFaces => self.vertex_faces,
            Query::EdgeFaces => self.edge_faces,
            Query::FaceEdges => self.face_edges,
            Query::VertexEdges => self.vertex_edges,
            Query::OneRing => self.one_ring,
            Query::BoundaryStep => self.boundary_step,
        }
    }

    /// All times, in the order of [`Query::ALL`].
    fn of(times: [QueryTime; 8]) -> Self {
        let [
            face_vertices,
            edge_vertices,
            vertex_faces,
            edge_faces,
            face_edges,
            vertex_edges,
            one_ring,
            boundary_step,
        ] = times;
        Self {
            face_vertices,
            edge_vertices,
            vertex_faces,
            edge_faces,
            face_edges,
            vertex_edges,
            one_ring,
            boundary_step,
        }
    }
}

/// Measures a mesh in the structures for its faces: that for quads where all are quads, else those for
/// triangles, with polygons cut into fans.
///
/// # Errors
/// As [`measure`] and [`measure_quads`].
pub fn measure_polygons(mesh: PolygonMesh) -> Result<Measured> {
    match mesh.quads() {
        Some(quads) => measure_quads(mesh.positions(), &quads),
        None => measure(mesh.fanned()?),
    }
}

/// Measures a mesh in every structure for triangles. It is cleaned and turned to agree first, as
/// before a decimation; equal positions are one vertex.
///
/// Some seconds, for a million triangles too.
///
/// # Errors
/// As [`clean`].
pub fn measure(mesh: IndexedMesh) -> Result<Measured> {
    let in_file = mesh.triangles().len();
    let (mesh, _) = clean(mesh, true)?;
    let Parts {
        positions,
        mut triangles,
        ..
    } = mesh.into_parts();
    let Oriented {
        mesh: connectivity,
        flipped,
        ..
    } = Mesh::<Small>::oriented(positions.len(), triangles.clone());
    turn_round(&mut triangles, &flipped);
    let edges = connectivity.edges().count();
    let non_manifold_edges = connectivity.non_manifold_edge_count();
    let directed = DirectedEdges::<Small>::build(&positions, &triangles).map_err(not_cleaned)?;
    let places = Places::of(triangles.len(), 3, |(f, k)| {
        connectivity.is_boundary(EdgeId::new(3 * f.index() + k))
    });
    drop(connectivity);
    let flips = independent_flips(&directed, &places.sides, positions.len());
    let bench = Bench {
        face_name: "triangle",
        positions: &positions,
        faces: &triangles,
        places,
    };
    let structures = vec![
        bench.row::<IndividualTriangles>(),
        bench.row::<SharedVertex>(),
        bench.row_with_flips::<SharedVertexWithNeighbours>(&flips),
        bench.row_with_flips::<WingedEdge>(&flips),
        bench.row_with_flips::<QuadEdge>(&flips),
        bench.row_with_flips::<HalfEdge>(&flips),
        bench.row_with_flips::<PairedHalfEdge>(&flips),
        bench.row_with_flips::<DirectedEdges<Full>>(&flips),
        bench.row_with_flips::<DirectedEdges<Medium>>(&flips),
        bench.row_with_flips::<DirectedEdges<Small>>(&flips),
    ];
    Ok(Measured {
        face_name: bench.face_name,
        vertices: positions.len(),
        edges,
        faces: triangles.len(),
        dropped_faces: in_file - triangles.len(),
        boundary_edges: bench.places.boundary.len(),
        non_manifold_edges,
        structures,
    })
}

/// Measures a mesh of quads in the structure for quads. Quads that name a vertex twice and vertices
/// without a quad are left out; equal positions stay apart.
///
/// # Errors
/// [`Error::InvalidMesh`] where there are more than 2³¹−1 directed edges, or a quad names a vertex that
/// is not there.
pub fn measure_quads(positions: &[Vec3], quads: &[[u32; 4]]) -> Result<Measured> {
    if let Some(i) = quads
        .iter()
        .position(|q| q.iter().any(|&v| v as usize >= positions.len()))
    {
        let n = positions.len();
        return Err(Error::InvalidMesh(format!(
            "quad {i} uses vertices {:?}; the mesh has {n} (counted from 0)",
            quads[i]
        )));
    }
    let (positions, faces) = used_by_proper_quads(positions, quads);
    let mesh = QuadDirectedEdges::build(&positions, &faces)
        .map_err(|error| Error::InvalidMesh(error.to_string()))?;
    let bench = Bench {
        face_name: "quad",
        positions: &positions,
        faces: &faces,
        places: Places::of(faces.len(), 4, |(f, k)| {
            mesh.is_boundary(mesh.face_edges(f)[k])
        }),
    };
    Ok(Measured {
        face_name: bench.face_name,
        vertices: positions.len(),
        edges: mesh.edge_count(),
        faces: faces.len(),
        dropped_faces: quads.len() - faces.len(),
        boundary_edges: bench.places.boundary.len(),
        non_manifold_edges: mesh.non_manifold_edge_count(),
        structures: vec![bench.row::<QuadDirectedEdges>()],
    })
}

/// The quads of four different vertices, and those vertices.
fn used_by_proper_quads(positions: &[Vec3], quads: &[[u32; 4]]) -> (Vec<Vec3>, Vec<[u32; 4]>) {
    let is_proper = |q: &&[u32; 4]| (1..4).all(|k| !q[..k].contains(&q[k]));
    let mut faces: Vec<[u32; 4]> = quads.iter().filter(is_proper).copied().collect();
    let mut is_used = vec![false; positions.len()];
    for &v in faces.as_flattened() {
        is_used[v as usize] = true;
    }
    let new = crate::clean::renumbered(&is_used);
    for v in faces.as_flattened_mut() {
        *v = new[*v as usize];
    }
    let mut positions = positions.to_vec();
    crate::clean::retain(&is_used, &mut positions);
    (positions, faces)
}

/// A cleaned mesh has nothing that directed edges do not carry.
fn not_cleaned(error: CannotCarry) -> Error {
    Error::Internal(format!("a cleaned mesh is refused: {error}"))
}

/// A side of a face: an edge, and the vertex that it begins at.
type FaceSide = (Face, usize);

/// Where the structures are asked.
struct Places {
    /// Sides of random faces.
    sides: Vec<FaceSide>,
    /// The sides that are boundary edges, in random order.
    boundary: Vec<FaceSide>,
}

impl Places {
    /// Places in so many faces of so many corners, of whose sides some are boundary edges.
    fn of(faces: usize, corners: usize, is_boundary: impl Fn(FaceSide) -> bool) -> Self {
        let mut random = Random(0x0001_2345_6789_ABCD);
        let mut side = || (Face::new(random.below(faces)), random.below(corners));
        let sides = if faces == 0 {
            Vec::new()
        } else {
            (0..SAMPLES).map(|_| side()).collect()
        };
        let all = (0..faces).flat_map(|f| (0..corners).map(move |k| (Face::new(f), k)));
        let mut boundary: Vec<FaceSide> = all.filter(|&side| is_boundary(side)).collect();
        for i in (1..boundary.len()).rev() {
            boundary.swap(i, random.below(i + 1));
        }
        Self { sides, boundary }
    }
}

/// Edges whose flips have nothing to do with each other: no vertex of their faces is one of another's.
fn independent_flips(
    mesh: &DirectedEdges<Small>,
    candidates: &[FaceSide],
    vertices: usize,
) -> Vec<FaceSide> {
    // A crafted mesh can have a million candidates whose condition takes a walk around a million faces.
    let start = Instant::now();
    let mut is_taken = vec![false; vertices];
    let mut flips = Vec::new();
    for &(f, k) in candidates {
        let e = mesh.face_edges(f)[k];
        let mut around: Vec<Vertex> = Vec::with_capacity(6);
        mesh.edge_faces(e, |f| around.extend(mesh.face_vertices(f)));
        let is_free = around.iter().all(|v| !is_taken[v.index()]);
        if is_free && mesh.flip_condition(e) {
            around.iter().for_each(|v| is_taken[v.index()] = true);
            flips.push((f, k));
        }
        if flips.len() == FLIPS || start.elapsed() >= BUILD_BUDGET {
            break;
        }
    }
    flips
}

/// Marsaglia's xorshift.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 16) as usize % n
    }
}

/// The mesh that every structure is built from.
struct Bench<'a, const K: usize> {
    face_name: &'static str,
    positions: &'a [Vec3],
    faces: &'a [[u32; K]],
    places: Places,
}

impl<const K: usize> Bench<'_, K> {
    /// A structure's row, its modification left open.
    fn row<S: Structure<K>>(&self) -> Row {
        self.row_and_structure::<S>().0
    }

    fn row_and_structure<S: Structure<K>>(&self) -> (Row, Option<S>) {
        let is = S::DESCRIPTION;
        let (bytes_formula, bytes_per_vertex_formula) = is.words.limits(K);
        let mut row = Row {
            structure: is.name,
            cannot_carry: None,
            per_face: PerFace {
                face_name: self.face_name,
                bytes_stated: is.stated_bytes_per_face,
                bytes_formula,
                bytes: None,
                construct_ns: None,
            },
            bytes_per_vertex_stated: is.stated_bytes_per_vertex,
            bytes_per_vertex_formula,
            bytes_per_vertex: None,
            bytes: None,
            redundancy_share: None,
            carries_non_manifold: is.carries_non_manifold,
            neighbourhood: is.neighbourhood,
            point_reference: is.point_reference,
            previous_edge: is.previous_edge,
            next_edge: is.next_edge,
            queries: QueryTimes::of(is.costs.map(|cost| QueryTime { cost, ns: None })),
            edge_flip_ns: None,
        };
        let (structure, construct_ns) = match self.build::<S>() {
            Ok(built) => built,
            Err(why) => {
                row.cannot_carry = Some(why.to_string());
                return (row, None);
            }
        };
        let per = |amount: f64, count: usize| (count > 0).then(|| amount / count as f64);
        let bytes = structure.bytes();
        let least = size_of_val(self.positions) + size_of_val(self.faces);
        row.per_face.construct_ns = per(construct_ns, self.faces.len());
        row.per_face.bytes = per(bytes as f64, self.faces.len());
        row.bytes_per_vertex = per(bytes as f64, self.positions.len());
        row.bytes = Some(bytes);
        row.redundancy_share = per(bytes.saturating_sub(least) as f64, bytes);
        row.queries = self.query_times(&structure);
        (row, Some(structure))
    }

    /// Builds a structure, and says in how many nanoseconds: the fewest of several times, since
    /// other work only adds to them.
    fn build<S: Structure<K>>(&self) -> std::result::Result<(S, f64), CannotCarry> {
        let all = Instant::now();
        let mut fastest = Duration::MAX;
        let mut runs = 0;
        loop {
            let start = Instant::now();
            let structure = S::build(black_box(self.positions), black_box(self.faces))?;
            fastest = fastest.min(start.elapsed());
            runs += 1;
            if runs > 1 && all.elapsed() >= BUILD_BUDGET {
                return Ok((structure, fastest.as_secs_f64() * 1e9));
            }
        }
    }

    fn query_times<S: Structure<K>>(&self, structure: &S) -> QueryTimes {
        let s = structure;
        let sides = &self.places.sides[..];
        let edge = |&(f, k): &FaceSide| s.face_edges(f)[k];
        let faces: Vec<Face> = sides.iter().map(|&(f, _)| f).collect();
        let edges: Vec<Edge> = sides.iter().map(edge).collect();
        let vertices: Vec<Vertex> = sides.iter().map(|&(f, k)| s.face_vertices(f)[k]).collect();
        let boundary: Vec<Edge> = self.places.boundary.iter().map(edge).collect();
        let ns = [
            ns_a_call(&faces, |f| see(s.face_vertices(f))),
            ns_a_call(&edges, |e| see(s.edge_vertices(e))),
            ns_a_call(&vertices, |v| s.vertex_faces(v, see)),
            ns_a_call(&edges, |e| s.edge_faces(e, see)),
            ns_a_call(&faces, |f| see(s.face_edges(f))),
            ns_a_call(&vertices, |v| s.vertex_edges(v, see)),
            ns_a_call(&vertices, |v| s.one_ring(v, see)),
            ns_a_call(&boundary, |e| see(s.boundary_step(e))),
        ];
        let mut times = S::DESCRIPTION
            .costs
            .map(|cost| QueryTime { cost, ns: None });
        times.iter_mut().zip(ns).for_each(|(time, ns)| time.ns = ns);
        QueryTimes::of(times)
    }
}

impl Bench<'_, 3> {
    /// A structure's row with what flips take.
    fn row_with_flips<S: Flip>(&self, flips: &[FaceSide]) -> Row {
        let (mut row, structure) = self.row_and_structure::<S>();
        row.edge_flip_ns = structure.and_then(|mut s| flip_ns(&mut s, flips));
        row
    }
}

/// What the flip of an edge takes: each is flipped once, then each again, until they are back. The
/// fastest round counts.
fn flip_ns<S: Flip>(structure: &mut S, flips: &[FaceSide]) -> Option<f64> {
    const QUARTERS: usize = 4;
    let edge = |&(f, k): &FaceSide| structure.face_edges(f)[k];
    let edges: Vec<Edge> = flips.iter().map(edge).collect();
    let mut fastest = Duration::MAX;
    for _ in 0..QUARTERS {
        let start = Instant::now();
        edges.iter().for_each(|&e| structure.flip(black_box(e)));
        fastest = fastest.min(start.elapsed());
    }
    (!edges.is_empty()).then(|| fastest.as_secs_f64() * 1e9 / edges.len() as f64)
}

/// Takes an answer, so that it is not left out.
#[inline(always)]
fn see<T>(answer: T) {
    black_box(answer);
}

/// What a call takes on average over the samples, in their order: as many as the budget allows, one at
/// least, some more than once where they are few.
///
/// The average of the fastest block, since other work on the machine only adds to it.
fn ns_a_call<T: Copy>(samples: &[T], mut call: impl FnMut(T)) -> Option<f64> {
    if samples.is_empty() {
        return None;
    }
    let all = Instant::now();
    let (mut block, mut fastest) = (1, f64::INFINITY);
    let mut left = samples;
    while all.elapsed() < QUERY_BUDGET || fastest.is_infinite() {
        let start = Instant::now();
        let mut calls = block;
        while calls > 0 {
            if left.is_empty() {
                left = samples;
            }
            let (now, later) = left.split_at(calls.min(left.len()));
            now.iter().for_each(|&sample| call(black_box(sample)));
            left = later;
            calls -= now.len();
        }
        let elapsed = start.elapsed();
        if elapsed < BLOCK {
            block *= 2;
        } else {
            fastest = fastest.min(elapsed.as_secs_f64() * 1e9 / block as f64);
        }
    }
    Some(fastest)
}
