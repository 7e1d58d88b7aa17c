//! Counts that say what kind of mesh a file holds.

use serde::Serialize;
use smallvec::SmallVec;

use crate::clean::{Cleaning, clean};
use crate::error::Result;
use crate::indexed_mesh::{IndexedMesh, Parts};
use crate::mesh::{EdgeId, EdgeStore, Mesh, Opposite, Oriented, Outgoing, Small, Tier, VertexId};

/// What is in a mesh, after cleaning but for the first two numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Info {
    /// Vertices in the file.
    pub vertices: usize,
    /// Triangles in the file; polygons count as their fans.
    pub triangles: usize,
    /// What cleaning finds.
    #[serde(flatten)]
    pub cleaning: Cleaning,
    /// Pieces that share no vertex.
    pub components: usize,
    /// Edges of one face.
    pub boundary_edges: usize,
    /// Closed runs of boundary edges. A run that ends at non-manifold edges is none.
    pub boundary_loops: usize,
    /// Edges of three faces or more.
    pub non_manifold_edges: usize,
    /// Vertices on such an edge, or whose faces are not one fan.
    pub non_manifold_vertices: usize,
    /// Edges of two faces that run along it the same way.
    pub inconsistent_edges: usize,
    /// Whether all faces can be turned to agree.
    pub is_orientable: bool,
    /// Faces without area.
    pub zero_area_faces: usize,
    /// Vertices − edges + faces.
    pub euler_characteristic: i64,
    /// The sum of the components' handles, where the mesh is an orientable manifold.
    pub genus: Option<i64>,
    /// The diagonal of the bounding box, in model units.
    pub diagonal: f64,
    /// Bytes of the connectivity and positions in the full tier, side tables included.
    pub full_tier_bytes: usize,
    /// The same in the medium tier.
    pub medium_tier_bytes: usize,
    /// The same in the small tier.
    pub small_tier_bytes: usize,
}

/// Counts what is in a mesh; `weld` merges equal positions first, as decimation does.
///
/// Linear time; memory of the small tier.
///
/// # Errors
/// As [`clean`].
pub fn info(mesh: IndexedMesh, weld: bool) -> Result<Info> {
    let (vertices, triangles) = (mesh.positions().len(), mesh.triangle_count());
    let (mesh, cleaning) = clean(mesh, weld)?;
    Ok(info_of_clean(mesh, vertices, triangles, cleaning))
}

/// Counts what is in a mesh as its file means it: with equal positions welded, as decimation does,
/// unless the file's own numbering is a manifold that welding would spoil. That is what a
/// [cut](crate::repair::cut) leaves, or parts that touch.
///
/// A file in which no two faces share a vertex (STL) says nothing of neighbours; it is welded
/// whenever that gives it any.
///
/// # Errors
/// As [`clean`].
pub fn info_of_file(mesh: IndexedMesh) -> Result<Info> {
    let welded = info(mesh.clone(), true)?;
    if welded.is_manifold() || welded.cleaning.welded_vertices == 0 {
        return Ok(welded);
    }
    let numbered = info(mesh, false)?;
    let corners = 3 * numbered.cleaning.kept_faces;
    let is_soup = numbered.cleaning.kept_vertices == corners && welded.has_inner_edges();
    Ok(if numbered.is_manifold() && !is_soup {
        numbered
    } else {
        welded
    })
}

impl Info {
    /// Whether every edge has at most two faces and every vertex one fan.
    pub fn is_manifold(&self) -> bool {
        self.non_manifold_edges == 0 && self.non_manifold_vertices == 0
    }

    /// Whether two faces share an edge that has no others.
    fn has_inner_edges(&self) -> bool {
        let Cleaning {
            kept_vertices: vertices,
            kept_faces: faces,
            ..
        } = self.cleaning;
        let edges = (vertices + faces) as i64 - self.euler_characteristic;
        edges > (self.boundary_edges + self.non_manifold_edges) as i64
    }
}

/// [`info`] of a mesh that has been cleaned, and had so many vertices and triangles before.
pub(super) fn info_of_clean(
    mesh: IndexedMesh,
    vertices: usize,
    triangles: usize,
    cleaning: Cleaning,
) -> Info {
    let diagonal = mesh.diagonal();
    let zero_area_faces = mesh
        .triangles()
        .iter()
        .map(|t| t.map(|v| mesh.positions()[v as usize].as_dvec3()))
        .filter(|[a, b, c]| (*b - *a).cross(*c - *a).length_squared() == 0.0)
        .count();
    let Parts {
        positions,
        triangles: faces,
        ..
    } = mesh.into_parts();
    let face_count = faces.len();
    let Oriented {
        mesh,
        disagreements: inconsistent_edges,
        ..
    } = Mesh::<Small>::oriented(positions.len(), faces);
    let is_orientable = mesh.same_way_pair_count() == 0;
    let edges = mesh.edges().count();
    let boundary: Vec<EdgeId> = mesh.edges().filter(|&e| mesh.is_boundary(e)).collect();
    let mut loops = Loops::new(&boundary);
    let mut non_manifold_vertices = 0;
    for v in mesh.vertices() {
        let is_inner = matches!(mesh.outgoing(v), Outgoing::Fan(e) if mesh.mate(e).is_some());
        if !is_inner {
            let around = Around::of(&mesh, v);
            non_manifold_vertices += usize::from(around.is_crowded || around.pieces > 1);
            loops.join(&around.rims);
        }
    }
    let (boundary_edges, boundary_loops) = (boundary.len(), loops.closed());
    let non_manifold_edges = mesh.non_manifold_edge_count() - mesh.same_way_pair_count();
    let components = mesh.components().len();
    let euler_characteristic = mesh.vertex_count() as i64 - edges as i64 + mesh.face_count() as i64;
    let is_manifold = non_manifold_edges == 0 && non_manifold_vertices == 0;
    // χ = 2·components − 2·genus − loops.
    let genus = (is_manifold && is_orientable)
        .then(|| (2 * components as i64 - boundary_loops as i64 - euler_characteristic) / 2);
    let tables =
        mesh.bytes() + size_of_val(&positions[..]) - Tier::Small.bytes(positions.len(), face_count);
    let bytes = |tier: Tier| tier.bytes(positions.len(), face_count) + tables;
    Info {
        vertices,
        triangles,
        cleaning,
        components,
        boundary_edges,
        boundary_loops,
        non_manifold_edges,
        non_manifold_vertices,
        inconsistent_edges,
        is_orientable,
        zero_area_faces,
        euler_characteristic,
        genus,
        diagonal,
        full_tier_bytes: bytes(Tier::Full),
        medium_tier_bytes: bytes(Tier::Medium),
        small_tier_bytes: bytes(Tier::Small),
    }
}

/// What lies around a vertex. Fans that meet at an edge where their two faces disagree in direction
/// are one piece: no orientation makes such faces agree, yet the surface goes on there.
struct Around {
    /// Whether an edge of three faces or more ends here.
    is_crowded: bool,
    /// The pieces that share nothing here but the vertex.
    pieces: usize,
    /// The two boundary edges of each piece that has two.
    rims: SmallVec<[[EdgeId; 2]; 2]>,
}

impl Around {
    fn of<S: EdgeStore>(mesh: &Mesh<S>, v: VertexId) -> Self {
        let mut is_crowded = false;
        // The piece that each fan belongs to; the fans that meet at each seam and rim.
        let mut piece: SmallVec<[usize; 8]> = SmallVec::new();
        let mut seams: SmallVec<[(EdgeId, usize); 8]> = SmallVec::new();
        let mut rims: SmallVec<[(usize, EdgeId); 8]> = SmallVec::new();
        for start in mesh.fans(v) {
            let fan = piece.len();
            piece.push(fan);
            let last = mesh.fan(start).last().unwrap_or(start);
            for end in [start, mesh.prev(last)] {
                match mesh.opposite(end) {
                    Opposite::NonManifold(_) if mesh.edge_star(end).len() > 2 => is_crowded = true,
                    Opposite::NonManifold(_) => seams.push((mesh.canonical(end), fan)),
                    Opposite::Boundary => rims.push((fan, end)),
                    Opposite::Edge(_) => {}
                }
            }
        }
        seams.sort_unstable();
        let mut pieces = piece.len();
        for pair in seams.chunk_by(|a, b| a.0 == b.0).filter(|p| p.len() == 2) {
            let [a, b] = [pair[0].1, pair[1].1].map(|fan| root(&mut piece, fan));
            pieces -= usize::from(a != b);
            piece[a.max(b)] = a.min(b);
        }
        rims.iter_mut()
            .for_each(|(fan, _)| *fan = root(&mut piece, *fan));
        rims.sort_unstable();
        let pairs = rims.chunk_by(|a, b| a.0 == b.0).filter(|r| r.len() == 2);
        let rims = pairs.map(|r| [r[0].1, r[1].1]).collect();
        Self {
            is_crowded,
            pieces,
            rims,
        }
    }
}

/// Boundary edges, joined end to end.
struct Loops<'a> {
    edges: &'a [EdgeId],
    parent: Vec<usize>,
    joints: Vec<usize>,
}

impl<'a> Loops<'a> {
    /// These edges, ascending, each for itself.
    fn new(edges: &'a [EdgeId]) -> Self {
        Self {
            edges,
            parent: (0..edges.len()).collect(),
            joints: vec![0; edges.len()],
        }
    }

    fn join(&mut self, pairs: &[[EdgeId; 2]]) {
        for pair in pairs {
            let [a, b] = pair.map(|e| {
                let at = self
                    .edges
                    .binary_search(&e)
                    .expect("a rim is a boundary edge");
                root(&mut self.parent, at)
            });
            let (to, from) = (a.min(b), a.max(b));
            self.parent[from] = to;
            self.joints[to] += 1 + if a == b { 0 } else { self.joints[from] };
        }
    }

    /// The number of closed runs: those with as many joints as edges.
    fn closed(mut self) -> usize {
        let mut edges = vec![0; self.edges.len()];
        for i in 0..self.edges.len() {
            edges[root(&mut self.parent, i)] += 1;
        }
        edges
            .iter()
            .zip(&self.joints)
            .filter(|&(&n, &joints)| n > 0 && n == joints)
            .count()
    }
}

/// The representative of `i` in a forest of parents; shortens the way there.
fn root(parent: &mut [usize], mut i: usize) -> usize {
    while parent[i] != i {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    i
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{self, Shape};

    fn of((positions, triangles): Shape) -> Info {
        info(IndexedMesh::new(positions, triangles).unwrap(), true).unwrap()
    }

    #[test]
    fn closed_surfaces_have_their_genus() {
        let sphere = of(shapes::icosphere(2));
        assert_eq!((sphere.genus, sphere.euler_characteristic), (Some(0), 2));
        let torus = of(shapes::torus(9, 6));
        assert_eq!((torus.genus, torus.euler_characteristic), (Some(1), 0));
        assert_eq!((torus.boundary_edges, torus.components), (0, 1));
    }

    /// A disk has one loop and no handle.
    #[test]
    fn a_disk_has_one_loop() {
        let grid = of(shapes::grid(4, 3));
        assert_eq!(
            (grid.boundary_edges, grid.boundary_loops, grid.genus),
            (14, 1, Some(0))
        );
        assert_eq!(grid.full_tier_bytes, 60 * 24 + 16 * 20);
    }

    /// Three fins: 3 edges of three faces, their 4 vertices non-manifold, no genus.
    #[test]
    fn fins_are_not_manifold() {
        let fins = of(shapes::three_fins(3));
        assert_eq!(
            (fins.non_manifold_edges, fins.non_manifold_vertices),
            (3, 4)
        );
        assert_eq!(fins.genus, None);
        let bow_tie = of(shapes::bow_tie());
        assert_eq!(
            (bow_tie.non_manifold_edges, bow_tie.non_manifold_vertices),
            (0, 1)
        );
        assert_eq!(bow_tie.components, 1);
    }

    /// A Möbius strip is a manifold that has no orientation: one loop, χ = 0.
    #[test]
    fn a_moebius_strip_is_not_orientable() {
        let strip = of(shapes::moebius(12));
        assert!(!strip.is_orientable && strip.inconsistent_edges > 0);
        assert_eq!(
            (strip.non_manifold_edges, strip.non_manifold_vertices),
            (0, 0)
        );
        assert_eq!((strip.euler_characteristic, strip.genus), (0, None));
        assert_eq!((strip.boundary_loops, strip.boundary_edges), (1, 24));
    }

    /// Two squares, each of two faces, that touch in a corner or along a side: manifold as numbered,
    /// and counted so. Two faces a square that share nothing, a soup, are welded.
    #[test]
    fn what_welding_would_spoil_is_kept_apart() {
        let square = |x: f32, y: f32| [[x, y], [x + 1., y], [x + 1., y + 1.], [x, y + 1.]];
        let plane = |corners: &[[f32; 2]]| -> Vec<glam::Vec3> {
            corners.iter().map(|c| [c[0], c[1], 0.].into()).collect()
        };
        let (a, b) = (square(0., 0.), square(1., 1.));
        let faces = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        let count = |positions, faces| {
            let mesh = IndexedMesh::new(positions, faces).unwrap();
            let info = info_of_file(mesh).unwrap();
            (
                info.non_manifold_vertices,
                info.components,
                info.cleaning.welded_vertices,
            )
        };
        let positions = plane(&[a, b].concat());
        assert_eq!(count(positions.clone(), faces.clone()), (0, 2, 0));
        let soup: Vec<_> = faces
            .iter()
            .flatten()
            .map(|&v: &u32| positions[v as usize])
            .collect();
        let apart = vec![[0, 1, 2], [3, 4, 5], [6, 7, 8], [9, 10, 11]];
        assert_eq!(count(soup, apart), (1, 1, 5));
        // Along a side: welding makes one surface of them.
        let positions = plane(&[a, square(1., 0.)].concat());
        assert_eq!(count(positions, faces), (0, 1, 2));
    }

    /// One turned face: three of its edges disagree, and it can be turned back.
    #[test]
    fn a_turned_face_is_counted_by_its_edges() {
        let (positions, mut triangles) = shapes::icosphere(1);
        triangles[5].swap(0, 1);
        let sphere = of((positions, triangles));
        assert_eq!((sphere.inconsistent_edges, sphere.is_orientable), (3, true));
        assert_eq!(sphere.genus, Some(0));
    }
}
