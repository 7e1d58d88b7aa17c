//! How far a mesh is from another, and what is wrong with it.

use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;

use super::attributes::{self, AttributeComparison, Carried, Side};
use super::info::{Info, info_of_clean};
use super::surface::{Curves, Surface};
use crate::clean::clean;
use crate::error::{Error, Result};
use crate::indexed_mesh::IndexedMesh;

/// What to measure, and how finely.
#[derive(Clone, Copy, Debug)]
pub struct CompareOptions {
    /// Samples on each surface, spread by area; on boundary curves a tenth of it, by length.
    pub samples: usize,
    /// Whether to count pairs of triangles that cut each other.
    pub intersections: bool,
}

impl Default for CompareOptions {
    fn default() -> Self {
        Self {
            samples: 1_000_000,
            intersections: false,
        }
    }
}

/// Distances from the points of one thing to another, in model units; or differences of what they
/// carry.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Distances {
    /// The root of the mean square.
    pub rms: f64,
    /// The mean.
    pub mean: f64,
    /// The largest: one-sided Hausdorff distance, from samples and vertices; of attributes from
    /// samples alone.
    pub max: f64,
}

impl Distances {
    /// Those of both directions together.
    pub(super) fn both(a: Self, b: Self) -> Self {
        Self {
            rms: ((a.rms * a.rms + b.rms * b.rms) / 2.0).sqrt(),
            mean: (a.mean + b.mean) / 2.0,
            max: a.max.max(b.max),
        }
    }

    fn times(self, factor: f64) -> Self {
        Self {
            rms: self.rms * factor,
            mean: self.mean * factor,
            max: self.max * factor,
        }
    }
}

/// Distances in both directions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct TwoSided {
    /// Both together: the root of the mean of both mean squares, the mean of both means, the larger
    /// of both largest (the Hausdorff distance).
    pub two_sided: Distances,
    /// From the reference to the mesh.
    pub from_reference: Distances,
    /// From the mesh to the reference.
    pub from_mesh: Distances,
    /// The first again, as fractions of the diagonal of the reference's bounding box.
    pub two_sided_of_diagonal: Distances,
    /// From the reference to the mesh, as fractions of the diagonal.
    pub from_reference_of_diagonal: Distances,
    /// From the mesh to the reference, as fractions of the diagonal.
    pub from_mesh_of_diagonal: Distances,
}

impl TwoSided {
    fn of(from_reference: Distances, from_mesh: Distances, diagonal: f64) -> Self {
        let (a, b) = (from_reference, from_mesh);
        let two_sided = Distances::both(a, b);
        let share = 1.0 / diagonal;
        Self {
            two_sided,
            from_reference,
            from_mesh,
            two_sided_of_diagonal: two_sided.times(share),
            from_reference_of_diagonal: a.times(share),
            from_mesh_of_diagonal: b.times(share),
        }
    }
}

/// A mesh held against a reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Comparison {
    /// The diagonal of the reference's bounding box, in model units.
    pub diagonal: f64,
    /// Distances between the surfaces.
    pub surface: TwoSided,
    /// Distances between the boundary curves, where both have one.
    pub boundary: Option<TwoSided>,
    /// The mean angle between the normals at a sample and at its nearest point, both directions
    /// together, in degrees.
    pub normal_deviation_mean_degrees: f64,
    /// The angle that 99 % of the samples keep below, in degrees.
    pub normal_deviation_99th_percentile_degrees: f64,
    /// The mean of 4√3·area/Σ edge² over the mesh's triangles: 1 for equilateral ones, 0 for
    /// degenerate ones.
    pub triangle_quality_mean: f64,
    /// The share of the mesh's triangles whose quality is under 0.05.
    pub sliver_share: f64,
    /// Boundary edges of the mesh where the reference has no boundary: whose middle is farther from
    /// every boundary edge of the reference than the edge is long.
    pub new_boundary_edges: usize,
    /// Non-manifold edges of the mesh beyond the reference's number.
    pub new_non_manifold_edges: usize,
    /// Non-manifold vertices of the mesh beyond the reference's number.
    pub new_non_manifold_vertices: usize,
    /// Pairs of the mesh's triangles that cut each other without sharing a vertex, where asked for.
    /// Triangles that overlap in one plane do not count.
    pub intersecting_pairs: Option<usize>,
    /// How far what the mesh carries beside positions is from what the reference carries, where either
    /// carries anything.
    pub attributes: Option<AttributeComparison>,
    /// What is in the reference.
    pub reference: Info,
    /// What is in the mesh.
    pub mesh: Info,
}

/// The seed of all samples.
const SEED: u64 = 1998;

/// A reference, ready to be compared with any number of meshes.
pub struct Reference {
    info: Info,
    origin: DVec3,
    surface: Surface,
    curves: Curves,
    carried: Carried,
}

impl Reference {
    /// Prepares a reference: welds it and builds its hierarchy, m log m.
    ///
    /// # Errors
    /// [`Error::InvalidMesh`] where cleaning leaves no triangle.
    pub fn new(mesh: IndexedMesh) -> Result<Self> {
        let origin = mesh.origin();
        let (info, surface, curves, carried) = prepare(mesh, origin)?;
        Ok(Self {
            info,
            origin,
            surface,
            curves,
            carried,
        })
    }

    /// Measures a mesh against this reference. The same bytes with any number of threads. Runs to its
    /// end and tells nobody how far it is.
    ///
    /// # Errors
    /// [`Error::InvalidMesh`] where cleaning leaves no triangle, or the mesh lies so far away that
    /// squared distances are not finite (10¹⁵⁰).
    pub fn compare(&self, mesh: IndexedMesh, options: &CompareOptions) -> Result<Comparison> {
        let (info, surface, curves, carried) = prepare(mesh, self.origin)?;
        let diagonal = self.info.diagonal;
        let samples = options.samples;
        let mut angles = Vec::new();
        let from_reference = self
            .surface
            .distances_to(&surface, samples, SEED, &mut angles);
        let from_mesh = surface.distances_to(&self.surface, samples, SEED + 1, &mut angles);
        let boundary = (!self.curves.is_empty() && !curves.is_empty()).then(|| {
            let samples = samples.div_ceil(10);
            let from_reference = self.curves.distances_to(&curves, samples, SEED + 2);
            let from_mesh = curves.distances_to(&self.curves, samples, SEED + 3);
            TwoSided::of(from_reference, from_mesh, diagonal)
        });
        let (normal_deviation_mean_degrees, normal_deviation_99th_percentile_degrees) =
            mean_and_99th_percentile(&mut angles);
        let (reference, mesh) = (
            Side {
                surface: &self.surface,
                carried: &self.carried,
            },
            Side {
                surface: &surface,
                carried: &carried,
            },
        );
        let carries_any = !self.carried.is_empty() || !carried.is_empty();
        let attributes =
            carries_any.then(|| attributes::compare(reference, mesh, diagonal, samples, SEED));
        let (triangle_quality_mean, sliver_share) = surface.quality();
        let more = |of: fn(&Info) -> usize| of(&info).saturating_sub(of(&self.info));
        Ok(Comparison {
            diagonal,
            surface: TwoSided::of(from_reference, from_mesh, diagonal),
            boundary,
            normal_deviation_mean_degrees,
            normal_deviation_99th_percentile_degrees,
            triangle_quality_mean,
            sliver_share,
            new_boundary_edges: curves.edges_away_from(&self.curves),
            new_non_manifold_edges: more(|i| i.non_manifold_edges),
            new_non_manifold_vertices: more(|i| i.non_manifold_vertices),
            intersecting_pairs: options.intersections.then(|| surface.intersecting_pairs()),
            attributes,
            reference: self.info.clone(),
            mesh: info,
        })
    }
}

/// Measures one mesh against a reference.
///
/// # Errors
/// As [`Reference::new`] and [`Reference::compare`].
pub fn compare(
    reference: IndexedMesh,
    mesh: IndexedMesh,
    options: &CompareOptions,
) -> Result<Comparison> {
    Reference::new(reference)?.compare(mesh, options)
}

/// Squares of differences of coordinates below this are finite, and their sums too.
const TOO_FAR: f64 = 1e150;

fn prepare(mesh: IndexedMesh, origin: DVec3) -> Result<(Info, Surface, Curves, Carried)> {
    let (vertices, triangles) = (mesh.positions().len(), mesh.triangle_count());
    let (mesh, cleaning) = clean(mesh, true)?;
    if mesh.triangles().is_empty() {
        return Err(Error::InvalidMesh("no triangle to measure".into()));
    }
    let points: Vec<DVec3> = mesh.points().map(|p| p - origin).collect();
    let is_near = |p: &DVec3| p.abs().max_element() < TOO_FAR;
    if let Some(far) = points.iter().position(|p| !is_near(p)) {
        return Err(Error::InvalidMesh(format!(
            "vertex {far} lies at {} from the reference's {origin}: squares of such distances are not finite",
            points[far]
        )));
    }
    let curves = Curves::of_boundary(&points, mesh.triangles());
    let surface = Surface::new(points, mesh.triangles());
    let mut parts = mesh.into_parts();
    let attributes = std::mem::take(&mut parts.attributes);
    let carried = Carried::of(attributes, parts.positions.len(), &parts.triangles);
    let mesh = IndexedMesh::from_valid(parts);
    let info = info_of_clean(mesh, vertices, triangles, cleaning);
    Ok((info, surface, curves, carried))
}

fn mean_and_99th_percentile(angles: &mut [f32]) -> (f64, f64) {
    if angles.is_empty() {
        return (0.0, 0.0);
    }
    let blocks: Vec<f64> = angles
        .par_chunks(4096)
        .map(|c| c.iter().map(|&a| f64::from(a)).sum())
        .collect();
    let mean = blocks.iter().sum::<f64>() / angles.len() as f64;
    let at = (angles.len() * 99 / 100).min(angles.len() - 1);
    let (_, percentile, _) = angles.select_nth_unstable_by(at, f32::total_cmp);
    (mean, f64::from(*percentile))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;
    use glam::Vec3;

    fn mesh((positions, triangles): shapes::Shape) -> IndexedMesh {
        IndexedMesh::new(positions, triangles).unwrap()
    }

    const FEW: CompareOptions = CompareOptions {
        samples: 20_000,
        intersections: true,
    };

    /// A mesh against itself: no distance, no deviation, nothing new.
    #[test]
    fn a_mesh_is_at_no_distance_from_itself() {
        let c = compare(
            mesh(shapes::torus(20, 12)),
            mesh(shapes::torus(20, 12)),
            &FEW,
        )
        .unwrap();
        assert!(c.surface.two_sided.max < 1e-7, "{:?}", c.surface.two_sided);
        assert!(c.normal_deviation_mean_degrees < 0.1);
        assert_eq!(
            (c.new_boundary_edges, c.intersecting_pairs, c.boundary),
            (0, Some(0), None)
        );
    }

    /// Two parallel sheets: every distance is the gap, also between the rims.
    #[test]
    fn parallel_sheets_are_their_gap_apart() {
        let (mut positions, triangles) = shapes::grid(7, 5);
        positions.iter_mut().for_each(|p| p.z = 0.25);
        let c = compare(mesh(shapes::grid(4, 9)), mesh((positions, triangles)), &FEW).unwrap();
        let boundary = c.boundary.unwrap();
        for d in [c.surface.two_sided, c.surface.from_mesh, boundary.two_sided] {
            for x in [d.rms, d.mean, d.max] {
                assert!((x - 0.25).abs() < 1e-12, "{d:?}");
            }
        }
        let share = c.surface.two_sided_of_diagonal.rms;
        assert!((share - 0.25 / 2f64.sqrt()).abs() < 1e-12);
        assert!(c.normal_deviation_99th_percentile_degrees < 1e-3);
    }

    /// A sheet half as wide: nothing from it to the whole, up to half the width back.
    #[test]
    fn directions_are_told_apart() {
        let (mut positions, triangles) = shapes::grid(4, 4);
        positions.iter_mut().for_each(|p| p.x *= 0.5);
        let c = compare(mesh(shapes::grid(4, 4)), mesh((positions, triangles)), &FEW).unwrap();
        assert!(c.surface.from_mesh.max < 1e-12);
        assert!((c.surface.from_reference.max - 0.5).abs() < 1e-12);
        // Half of the samples are at a distance evenly spread over 0 to 1/2.
        assert!((c.surface.from_reference.mean - 0.125).abs() < 2e-3);
        assert!((c.surface.from_reference.rms - (1.0f64 / 24.0).sqrt()).abs() < 2e-3);
    }

    #[test]
    fn threads_give_the_same_bytes() {
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            pool.install(|| {
                let (a, b) = (mesh(shapes::icosphere(3)), mesh(shapes::icosphere(2)));
                compare(a, b, &FEW).unwrap()
            })
        };
        assert_eq!(with(1), with(3));
    }

    /// A grid on one triangle fewer has three boundary edges more where it was torn, and its rim is
    /// where it was.
    #[test]
    fn a_tear_is_told_from_the_rim() {
        let (positions, mut triangles) = shapes::grid(9, 9);
        triangles.remove(80);
        let torn = mesh((positions, triangles));
        let c = compare(mesh(shapes::grid(3, 3)), torn, &FEW).unwrap();
        assert_eq!((c.new_boundary_edges, c.mesh.boundary_edges), (3, 39));
    }

    /// Equilateral triangles have quality 1; a needle next to 0.
    #[test]
    fn quality_is_one_for_equilateral_triangles() {
        let c = compare(
            mesh(shapes::tetrahedron()),
            mesh(shapes::tetrahedron()),
            &FEW,
        )
        .unwrap();
        assert!((c.triangle_quality_mean - 1.0).abs() < 1e-6);
        assert_eq!(c.sliver_share, 0.0);
        let needle = vec![Vec3::ZERO, Vec3::X, Vec3::new(0.5, 0.001, 0.0)];
        let c = compare(
            mesh(shapes::tetrahedron()),
            mesh((needle, vec![[0, 1, 2]])),
            &FEW,
        )
        .unwrap();
        assert!(c.triangle_quality_mean < 0.01 && c.sliver_share == 1.0);
    }

    /// Two crossing squares of two triangles each cut in four, three or two pairs, never none.
    #[test]
    fn crossing_sheets_are_found() {
        let (mut positions, mut triangles) = shapes::grid(1, 1);
        positions.extend(
            [
                [0.3, -0.2, -0.5],
                [0.3, 1.2, -0.5],
                [0.35, 1.2, 0.5],
                [0.35, -0.2, 0.5],
            ]
            .map(Vec3::from),
        );
        triangles.extend([[4, 5, 6], [4, 6, 7]]);
        let c = compare(mesh(shapes::grid(1, 1)), mesh((positions, triangles)), &FEW).unwrap();
        assert!(
            (2..=4).contains(&c.intersecting_pairs.unwrap()),
            "{:?}",
            c.intersecting_pairs
        );
    }
}
