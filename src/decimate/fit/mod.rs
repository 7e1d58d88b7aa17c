//! Fits a decimated surface to the original: moves its vertices, flips its edges.
//!
//! Every step is measured before it is taken, both ways: samples of the original against the faces
//! around the step, and the centroids and corners of those faces against the original. It is taken
//! only if the sum of squares falls and the largest distance around does not rise above what is
//! allowed. So no step makes the whole worse.
//!
//! The direction of a vertex is that of Gauss and Newton for the samples on the faces around it,
//! each held by the point of the surface that is nearest to it now (Hoppe et al. 1993 fit so, with
//! conjugate gradients over all vertices).
//!
//! All this is done piece by piece: a piece is a range of the surface's vertices in Morton order, the
//! faces around them, and what lies near those of the original, which fits into the cache together
//! and is dropped when the piece is done. A vertex moves in its own piece, where all the samples on
//! the faces around it are; a face at the border of a piece is measured in each that it reaches into.

mod cells;
mod curve;
mod measure;
mod original;
mod star;
mod steps;

use glam::Vec3;

use super::surface::Surface;
use crate::mesh::{EdgeStore, FaceId, VertexId};
use crate::progress::{self, Meter, Stage};
use crate::spatial::Grid;
use cells::Cells;
pub use original::Arrays;
use original::Original;
use steps::Fit;

/// Faces of the original near a piece, about.
const PIECE: usize = 30_000;

/// A piece takes in what lies within so many times the estimated deviation of a face's corners.
/// Samples that lie farther from all faces take no part, and nobody measures how far they are.
const MARGIN: f32 = 2.0;

/// It takes in no more than lies within so many times a face's own size.
const WIDEST: f32 = 2.0;

/// Bytes a triangle that sorting into cells takes for a while.
const SORTING: usize = 32;

/// Sweeps over the vertices: the second saves 2 % of rms, the third 0.6 %. Fitting after each
/// halving of the triangles as well saves 0.9 % and takes 40 % longer; a second round of flips and
/// sweeps, with the samples' nearest faces found anew, saves 1.2 % and takes 60 % longer.
const SWEEPS: usize = 3;

/// Where more than one in this many faces is left, a sweep less: it would take longer than all the
/// collapses, for less.
const LIGHT: usize = 3;

/// The work that fitting takes, in units: to find what lies near a face or a sample of the original,
/// to look at an edge, and to look at a vertex and step.
const FINDING: usize = 30;
const LOOK: usize = 20;
const STEP: usize = 200;

/// What is fitted.
#[derive(Clone, Copy, Debug)]
pub struct Terms {
    /// The triangles that the decimation was to leave: so many are sampled for.
    pub target: usize,
    /// Whether boundary edges are fitted to the original's; else they stay where they are.
    pub with_boundary: bool,
    /// Whether vertices may move.
    pub moves: bool,
    /// No step moves the surface farther than this from the original, in model units, or than it is.
    pub max_error: Option<f64>,
}

/// Fits a surface to an original, and replaces the estimated deviation of every vertex by what was
/// measured around it. Returns the bytes that it held at most.
///
/// Takes 36 bytes a triangle of the original while it sorts them, 7 after; as much a triangle of the
/// surface; 8 a vertex slot and 4 a face slot of the surface, 4 a vertex of the original; and 200 for
/// each face of the original near one piece. All but the measuring of a piece is done on one thread;
/// the result does not depend on how many there are.
pub fn fit_to_original<S: EdgeStore>(
    surface: &mut Surface<S>,
    arrays: Arrays,
    terms: &Terms,
    meter: &mut Meter,
) -> progress::Result<usize> {
    let (left, of_original) = (surface.mesh.face_count(), arrays.triangles.len());
    let is_light = left * LIGHT > of_original;
    let sweeps = if is_light { SWEEPS - 1 } else { SWEEPS };
    let expected = FINDING * of_original + sweeps * STEP * left / 2 + FINDING * left;
    meter.begin(Stage::Fit, super::FIT, expected)?;
    let grid = Grid::over(arrays.positions, 0.0);
    let original = Original::new(
        arrays,
        grid,
        surface.geometry.scale(),
        terms.target,
        terms.with_boundary,
        meter,
    )?;
    let faces: Vec<u32> = surface.mesh.faces().map(|f| f.index() as u32).collect();
    let corners = |i: usize| {
        let f = FaceId::new(faces[i] as usize);
        let corners = surface.mesh.face_vertices(f);
        corners.map(|v| surface.geometry.position(v))
    };
    let cells = Cells::new(grid, faces.len(), corners, meter)?;
    let vertices = in_morton_order(surface, &grid, meter)?;
    let pieces = pieces(&vertices, |v| {
        original.cells.before(surface.geometry.position(v))
    });
    let listed = (faces.capacity() + vertices.capacity()) * size_of::<u32>();
    let held = original.bytes() + cells.bytes() + listed;
    let sorting = SORTING * original.len() + original.bytes();
    let mut fit = Fit::new(surface, &original, terms.max_error);
    let mut begin = 0;
    for end in pieces {
        let piece = &vertices[begin..end];
        fit.take_up(piece, &cells, &faces, meter)?;
        fit.flip_edges(meter)?;
        if terms.moves {
            (0..sweeps).try_for_each(|_| fit.move_vertices(meter))?;
        }
        fit.put_down();
        meter.work(piece.len())?;
        begin = end;
    }
    let bytes = sorting.max(held + fit.bytes());
    fit.finish();
    Ok(bytes)
}

fn in_morton_order<S: EdgeStore>(
    surface: &Surface<S>,
    grid: &Grid,
    meter: &mut Meter,
) -> progress::Result<Vec<VertexId>> {
    let vertices: Vec<VertexId> = surface.mesh.vertices().collect();
    let at = |v: &VertexId| surface.geometry.position(*v);
    let positions: Vec<Vec3> = vertices.iter().map(at).collect();
    let order = grid.order_with(&positions, meter)?;
    Ok(order.into_iter().map(|i| vertices[i as usize]).collect())
}

/// Where the pieces of a list of vertices end: each takes up about as many faces of the original.
fn pieces(vertices: &[VertexId], before: impl Fn(VertexId) -> usize) -> Vec<usize> {
    /// A piece of fewer vertices is mostly border.
    const FEWEST: usize = 500;
    let mut ends = Vec::new();
    let (mut begin, mut faces_begin) = (0, 0);
    for (i, &v) in vertices.iter().enumerate() {
        if i >= begin + FEWEST && i + FEWEST <= vertices.len() {
            let faces = before(v);
            if faces >= faces_begin + PIECE {
                ends.push(i);
                (begin, faces_begin) = (i, faces);
            }
        }
    }
    ends.push(vertices.len());
    ends
}

/// A number of something, from one, so that an optional one takes four bytes.
type Number = std::num::NonZeroU32;

fn number(index: usize) -> Number {
    Number::MIN.saturating_add(index as u32)
}

fn index(number: Number) -> usize {
    number.get() as usize - 1
}

#[cfg(test)]
mod tests {
    use rayon::ThreadPoolBuilder;

    use super::*;
    use crate::decimate::{Options, Quality, Targets, TierChoice, decimate};
    use crate::indexed_mesh::IndexedMesh;
    use crate::mesh::Tier;
    use crate::shapes;

    /// The bytes of a sphere's fit in several pieces do not depend on threads and tiers, and its rms
    /// is near the least that so many triangles can have (0.2705/n of the diagonal): no piece is left
    /// out, none spoils another.
    #[test]
    fn a_sphere_in_pieces_is_fitted_everywhere() {
        let (positions, triangles) = shapes::icosphere(6);
        assert!(triangles.len() > 2 * PIECE);
        let mesh = IndexedMesh::new(positions, triangles).unwrap();
        let run = |tier, threads| {
            let options = Options {
                quality: Quality::Best,
                tier: TierChoice::Fixed(tier),
                targets: Targets {
                    ratio: Some(0.05),
                    ..Targets::default()
                },
                ..Options::default()
            };
            let pool = ThreadPoolBuilder::new().num_threads(threads).build();
            let job = || decimate(mesh.clone(), &options).unwrap().0;
            pool.unwrap().install(job)
        };
        let small = run(Tier::Full, 1);
        assert!(small == run(Tier::Full, 3), "threads");
        assert!(small == run(Tier::Small, 1), "tiers");
        let radii = small.triangles().iter().map(|t| {
            let [a, b, c] = t.map(|v| small.positions()[v as usize].as_dvec3());
            ((a + b + c) / 3.0).length()
        });
        let radii: Vec<f64> = radii.collect();
        let mean = radii.iter().sum::<f64>() / radii.len() as f64;
        let farthest = radii.iter().map(|r| (r - mean).abs()).fold(0.0, f64::max);
        // A triangle of n bulges by 4π/(3√3·n) of the radius between corners and centroid.
        let bulge = 4.0 * std::f64::consts::PI / (3.0 * 3f64.sqrt() * radii.len() as f64);
        assert!(
            (mean - 1.0).abs() < bulge && farthest < bulge,
            "{mean}, {farthest}, {bulge}"
        );
    }
}
