//! What decimation reaches on surfaces that are known: counts exact, distances at most so much, in
//! every quality; standard's the same in every tier. A bound that could be a third of itself is reported.

use decimate::decimate::{Options, Quality, Targets, TierChoice, decimate};
use decimate::indexed_mesh::IndexedMesh;
use decimate::io::{self, ReadOptions};
use decimate::mesh::Tier;
use decimate::metrics::{CompareOptions, Distances, Reference};
use glam::Vec3;

/// A surface over a grid of parameters in [0, 1)², closed in the directions that wrap.
fn parametric(n: u32, m: u32, wrap: [bool; 2], at: impl Fn(f64, f64) -> [f64; 3]) -> IndexedMesh {
    let (columns, rows) = (n + u32::from(!wrap[0]), m + u32::from(!wrap[1]));
    let mut positions = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            let p = at(f64::from(i) / f64::from(n), f64::from(j) / f64::from(m));
            positions.push(Vec3::from(p.map(|x| x as f32)));
        }
    }
    let id = |i: u32, j: u32| (j % rows) * columns + i % columns;
    let mut triangles = Vec::new();
    for j in 0..m {
        for i in 0..n {
            let [a, b, c, d] = [id(i, j), id(i + 1, j), id(i + 1, j + 1), id(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    IndexedMesh::new(positions, triangles).unwrap()
}

/// A sphere as a cube's six grids of `n` × `n` squares blown up; welded where the grids meet.
fn sphere(n: u32, scale: [f64; 3]) -> IndexedMesh {
    let side = |t: f64| (2.0 * t - 1.0) * std::f64::consts::FRAC_PI_4;
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let grid = parametric(n, n, [false; 2], |u, v| {
                let (a, b) = (side(u).tan(), side(v).tan());
                let mut p = [0.0; 3];
                // Rounded, so that equal points of neighbouring grids have equal bits.
                let round = |x: f64| (x * 1e12).round() / 1e12;
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (sign, round(a), round(sign * b));
                let length = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
                [0, 1, 2].map(|i| p[i] / length * scale[i])
            });
            let first = positions.len() as u32;
            positions.extend_from_slice(grid.positions());
            triangles.extend(grid.triangles().iter().map(|t| t.map(|v| v + first)));
        }
    }
    IndexedMesh::new(positions, triangles).unwrap()
}

fn turn(t: f64) -> (f64, f64) {
    (t * std::f64::consts::TAU).sin_cos()
}

/// A cube of six flat grids.
fn cube(n: u32) -> IndexedMesh {
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for side in [0.0, 1.0] {
            let grid = parametric(n, n, [false; 2], |u, v| {
                let mut p = [0.0; 3];
                let v = if side > 0.0 { v } else { 1.0 - v };
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, u, v);
                p
            });
            let first = positions.len() as u32;
            positions.extend_from_slice(grid.positions());
            triangles.extend(grid.triangles().iter().map(|t| t.map(|v| v + first)));
        }
    }
    IndexedMesh::new(positions, triangles).unwrap()
}

struct Case {
    name: &'static str,
    mesh: IndexedMesh,
    /// Triangles asked for, and got.
    asked: usize,
    got: usize,
    /// Upper bounds, of the diagonal.
    rms: f64,
    hausdorff: f64,
}

/// Nothing but rounding.
const EXACT: [f64; 2] = [1e-12, 1e-12];

fn cases(quality: Quality) -> Vec<Case> {
    // The count, and the bounds on rms and Hausdorff distance: of fast, standard and best.
    let case = |name, mesh, asked, golden: [(usize, [f64; 2]); 3]| {
        let (got, [rms, hausdorff]) = golden[quality as usize];
        Case {
            name,
            mesh,
            asked,
            got,
            rms,
            hausdorff,
        }
    };
    // n equilateral triangles fitted to a sphere leave 0.2705/n of the diagonal in rms.
    let limit = 0.2705 / 2000.0;
    let torus = parametric(160, 80, [true; 2], |u, v| {
        let ((su, cu), (sv, cv)) = (turn(u), turn(v));
        [(2.0 + 0.7 * cv) * cu, (2.0 + 0.7 * cv) * su, 0.7 * sv]
    });
    let cylinder = parametric(96, 60, [true, false], |u, v| {
        let (s, c) = turn(u);
        [c, s, 2.0 * v]
    });
    let field = parametric(120, 120, [false; 2], |u, v| {
        let waves = 0.05 * (9.0 * u).sin() * (7.0 * v).cos() + 0.01 * (40.0 * u * v).sin();
        [u, v, waves]
    });
    let sample = io::read("data/sample.ply".as_ref(), &ReadOptions::default()).unwrap();
    let round = |rms: f64, hausdorff| (2000, [rms * limit, hausdorff]);
    vec![
        case(
            "sphere",
            sphere(64, [1.0; 3]),
            2000,
            [
                round(2.36, 1.2e-3),
                round(1.4, 1.25e-3),
                round(1.22, 1.1e-3),
            ],
        ),
        case(
            "ellipsoid",
            sphere(64, [3.0, 2.0, 1.0]),
            2000,
            [
                (2000, [2.3e-4, 1.05e-3]),
                (2000, [1.42e-4, 1.25e-3]),
                (2000, [1.2e-4, 1.1e-3]),
            ],
        ),
        case(
            "torus",
            torus,
            1200,
            [
                (1200, [6.2e-4, 2.7e-3]),
                (1200, [4.5e-4, 2.7e-3]),
                (1200, [3.95e-4, 2.5e-3]),
            ],
        ),
        case("cylinder with open rims", cylinder, 192, [(192, EXACT); 3]),
        case(
            "height field",
            field,
            1500,
            [
                (1500, [2.25e-4, 1.6e-3]),
                (1499, [1.57e-4, 1.5e-3]),
                (1499, [1.36e-4, 1.2e-3]),
            ],
        ),
        case("cube grid", cube(24), 12, [(12, EXACT); 3]),
        case(
            "sample",
            sample,
            9996,
            [
                (9995, [1.2e-4, 5.5e-3]),
                (9995, [8.9e-5, 2.2e-3]),
                (9995, [7.6e-5, 1e-3]),
            ],
        ),
    ]
}

fn run(case: &Case, quality: Quality, tier: Tier) -> IndexedMesh {
    let targets = Targets {
        triangles: Some(case.asked),
        ..Targets::default()
    };
    let options = Options {
        targets,
        quality,
        tier: TierChoice::Fixed(tier),
        ..Options::default()
    };
    decimate(case.mesh.clone(), &options).unwrap().0
}

fn distances(case: &Case, reference: &Reference, small: IndexedMesh) -> Distances {
    let measure = CompareOptions {
        samples: 100_000,
        intersections: false,
    };
    let c = reference.compare(small, &measure).unwrap();
    let new = (c.new_boundary_edges, c.new_non_manifold_edges);
    assert_eq!(new, (0, 0), "{}", case.name);
    c.surface.two_sided_of_diagonal
}

/// Asserts them for one quality, and that these tiers give the same as the full one.
fn known_surfaces_keep_their_bounds(quality: Quality, tiers: &[Tier]) {
    let mut failures = Vec::new();
    for case in cases(quality) {
        let name = case.name;
        let reference = Reference::new(case.mesh.clone()).unwrap();
        let small = run(&case, quality, Tier::Full);
        for &tier in tiers {
            let other = run(&case, quality, tier);
            assert!(other == small, "{name}: {tier:?} differs");
        }
        let got = small.triangle_count();
        if got != case.got {
            failures.push(format!("{name}: {got} triangles, not {}", case.got));
        }
        let reached = distances(&case, &reference, small);
        for (what, x, bound) in [
            ("rms", reached.rms, case.rms),
            ("Hausdorff", reached.max, case.hausdorff),
        ] {
            println!("{name}: {what} {x:.4e}, at most {bound:.4e}");
            if x > bound {
                failures.push(format!("{name}: {what} {x:e} is over {bound:e}"));
            }
            if 3.0 * x < bound && bound > 1e-7 {
                println!("{name}: the bound on {what} can be tightened");
            }
        }
    }
    assert!(failures.is_empty(), "{quality:?}: {failures:#?}");
}

#[test]
fn fast_keeps_its_bounds() {
    known_surfaces_keep_their_bounds(Quality::Fast, &[]);
}

#[test]
fn standard_keeps_its_bounds_in_every_tier() {
    known_surfaces_keep_their_bounds(Quality::Standard, &[Tier::Medium, Tier::Small]);
}

#[test]
fn best_keeps_its_bounds() {
    known_surfaces_keep_their_bounds(Quality::Best, &[]);
}
