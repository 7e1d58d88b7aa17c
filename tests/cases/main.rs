//! Cases with an answer that is known beforehand: those that other tools test themselves with
//! ([`peers`]), and runs whose results must agree ([`metamorphic`]).

mod any_triangles;
mod metamorphic;
mod peers;
#[allow(dead_code, reason = "the library's own tests use the others")]
#[path = "../../src/shapes.rs"]
mod shapes;

use decimate::decimate::{
    Chunks, Options, Placement, Quality, Report, Targets, TierChoice, decimate,
};
use decimate::indexed_mesh::IndexedMesh;
use decimate::mesh::Tier;
use decimate::metrics::{CompareOptions, Info, Reference, info};
use glam::Vec3;

use shapes::Shape;

const QUALITIES: [Quality; 3] = [Quality::Fast, Quality::Standard, Quality::Best];
const TIERS: [Tier; 3] = [Tier::Full, Tier::Medium, Tier::Small];

fn mesh((positions, triangles): Shape) -> IndexedMesh {
    IndexedMesh::new(positions, triangles).unwrap()
}

fn to_triangles(quality: Quality, triangles: usize) -> Options {
    Options {
        targets: Targets {
            triangles: Some(triangles),
            ..Targets::default()
        },
        quality,
        ..Options::default()
    }
}

fn to_error(quality: Quality, max_error: f64) -> Options {
    Options {
        targets: Targets {
            max_error: Some(max_error),
            ..Targets::default()
        },
        quality,
        ..Options::default()
    }
}

/// To so many triangles, every vertex one of the input's.
fn onto_own_vertices(quality: Quality, triangles: usize) -> Options {
    Options {
        placement: Placement::Endpoint,
        ..to_triangles(quality, triangles)
    }
}

fn in_chunks(triangles: usize, options: Options) -> Options {
    Options {
        chunks: Chunks::Triangles(triangles),
        ..options
    }
}

fn run(mesh: &IndexedMesh, options: &Options) -> (IndexedMesh, Report) {
    decimate(mesh.clone(), options).unwrap_or_else(|error| panic!("{error}"))
}

/// Runs in every tier, asserts that all give the same bits, and returns one.
#[track_caller]
fn run_in_every_tier(mesh: &IndexedMesh, options: &Options) -> (IndexedMesh, Report) {
    let [full, medium, small] = TIERS.map(|tier| {
        let options = Options {
            tier: TierChoice::Fixed(tier),
            ..options.clone()
        };
        run(mesh, &options)
    });
    assert_same(&full.0, &medium.0);
    assert_same(&full.0, &small.0);
    full
}

type Bits = [u32; 3];

fn bits(positions: &[Vec3]) -> Vec<Bits> {
    let of_one = |p: &Vec3| p.to_array().map(f32::to_bits);
    positions.iter().map(of_one).collect()
}

#[track_caller]
fn assert_same(a: &IndexedMesh, b: &IndexedMesh) {
    assert!(a.triangles() == b.triangles(), "other triangles");
    assert!(a.double_sided() == b.double_sided(), "other flags");
    assert!(a.origin() == b.origin(), "another origin");
    assert!(bits(a.positions()) == bits(b.positions()), "other bits");
}

/// Root mean square and largest distance, both ways, of the original's diagonal.
fn distances(original: &IndexedMesh, small: &IndexedMesh) -> (f64, f64) {
    distances_to(&Reference::new(original.clone()).unwrap(), small)
}

fn distances_to(reference: &Reference, small: &IndexedMesh) -> (f64, f64) {
    let options = CompareOptions {
        samples: 100_000,
        intersections: false,
    };
    let compared = reference.compare(small.clone(), &options).unwrap();
    let reached = compared.surface.two_sided_of_diagonal;
    (reached.rms, reached.max)
}

/// What decimation may not change. Without welding, since vertices may come to lie at one place.
fn topology(mesh: &IndexedMesh) -> (usize, i64, bool) {
    let of = info(mesh.clone(), false).unwrap();
    (of.components, of.euler_characteristic, of.is_orientable)
}

fn edge_count(info: &Info) -> i64 {
    let (vertices, faces) = (info.cleaning.kept_vertices, info.cleaning.kept_faces);
    vertices as i64 + faces as i64 - info.euler_characteristic
}

/// A height field over the unit square on which nothing is flat.
fn bumpy(n: u32) -> Shape {
    let (mut positions, triangles) = shapes::grid(n, n);
    for p in &mut positions {
        p.z = 0.1 * (7.0 * p.x).sin() * (5.0 * p.y).cos() + 0.01 * (31.0 * p.x * p.y).sin();
    }
    (positions, triangles)
}

/// A closed surface of genus 0 on which nothing is flat.
fn potato(levels: u32) -> Shape {
    let (mut positions, triangles) = shapes::icosphere(levels);
    for p in &mut positions {
        *p *= 1.0 + 0.1 * (5.0 * p.x).sin() * (4.0 * p.y).cos() + 0.05 * (9.0 * p.z).sin();
    }
    (positions, triangles)
}

/// A surface over `n` × `m` squares of parameters in [0, 1]², whose vertices `id` joins.
fn squares(n: u32, m: u32, id: impl Fn(u32, u32) -> u32) -> Vec<[u32; 3]> {
    let cells = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
    let split = cells.flat_map(|(i, j)| {
        let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
        [[a, b, c], [a, c, d]]
    });
    split.collect()
}
