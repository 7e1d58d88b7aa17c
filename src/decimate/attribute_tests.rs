//! What decimation promises of attributes, on shapes small enough to know the answer.

use glam::Vec3;

use super::surface::{Plan, Way};
use super::*;
use crate::attributes::{Channel, Group, Kind};
use crate::for_each_tier;
use crate::mesh::EdgeId;
use crate::metrics::info;
use crate::progress::unheard;
use crate::shapes::{self, Shape};

const QUALITIES: [Quality; 3] = [Quality::Fast, Quality::Standard, Quality::Best];

/// A mesh whose corners carry what `row` says of their face's centroid and their vertex; equal rows at
/// a vertex are one wedge.
fn carrying(
    (positions, triangles): Shape,
    channels: Vec<Channel>,
    row: impl Fn(Vec3, Vec3) -> Vec<f32>,
) -> IndexedMesh {
    let mut attributes = Attributes {
        channels,
        ..Attributes::default()
    };
    for t in &triangles {
        let corners = t.map(|v| positions[v as usize]);
        let centroid = (corners[0] + corners[1] + corners[2]) / 3.0;
        let first = attributes.wedge_count() as u32;
        attributes.corners.push([first, first + 1, first + 2]);
        for corner in corners {
            let mut numbers = row(centroid, corner).into_iter();
            for channel in &mut attributes.channels {
                for x in numbers.by_ref().take(channel.width()) {
                    channel.values.push(x.into());
                }
            }
        }
    }
    attributes.merge_equal_wedges(&triangles);
    let mesh = IndexedMesh::new(positions, triangles).unwrap();
    mesh.with_attributes(attributes).unwrap()
}

fn texture() -> Channel {
    Channel::of_singles(Kind::TextureCoordinate, &["s", "t"])
}

fn color() -> Channel {
    Channel::of_singles(Kind::Color, &["red", "green", "blue"])
}

fn normal() -> Channel {
    Channel::of_singles(Kind::Normal, &["nx", "ny", "nz"])
}

fn keeping(ratio: f64, quality: Quality, attributes: AttributeUse) -> Options {
    Options {
        targets: Targets {
            ratio: Some(ratio),
            ..Targets::default()
        },
        quality,
        attributes,
        check: true,
        ..Options::default()
    }
}

/// Each face's corners: where they are, and their rows.
fn faces(mesh: &IndexedMesh) -> Vec<[(Vec3, Vec<f64>); 3]> {
    let attributes = mesh.attributes();
    let corner = |(v, wedge): (u32, u32)| {
        let rows = attributes.channels.iter();
        let row = rows.flat_map(|c| c.row(wedge as usize)).collect();
        (mesh.positions()[v as usize], row)
    };
    let faces = mesh.triangles().iter().zip(&attributes.corners);
    let face = |(t, w): (&[u32; 3], &[u32; 3])| [0, 1, 2].map(|k| corner((t[k], w[k])));
    faces.map(face).collect()
}

/// A flat square of 40 by 40 cells. Left of the middle it is black and at one place of the texture,
/// right of it white and at another.
fn two_tiles() -> IndexedMesh {
    carrying(shapes::grid(40, 40), vec![color(), texture()], tile)
}

fn tile(centroid: Vec3, corner: Vec3) -> Vec<f32> {
    if centroid.x < 0.5 {
        vec![0.0, 0.0, 0.0, corner.x, corner.y]
    } else {
        vec![1.0, 1.0, 1.0, corner.y + 2.0, 1.0 - corner.x]
    }
}

/// How far the rows of a mesh are from those of the two tiles, at most over the corners.
fn wrong_in_tiles(mesh: &IndexedMesh) -> f64 {
    let mut wrong = 0.0f64;
    for face in faces(mesh) {
        let centroid = (face[0].0 + face[1].0 + face[2].0) / 3.0;
        for (at, row) in face {
            for (found, expected) in row.iter().zip(tile(centroid, at)) {
                wrong = wrong.max((found - f64::from(expected)).abs());
            }
        }
    }
    wrong
}

/// Where geometry costs nothing, attributes alone decide: a sharp colour edge and a texture seam stay
/// where they are to the last, and all that is linear beside them is exact. Carried only, they smear.
#[test]
fn an_edge_in_color_and_texture_outlives_the_plane() {
    for quality in QUALITIES {
        let run = |usage| decimate(two_tiles(), &keeping(0.02, quality, usage)).unwrap();
        let (kept, report) = run(AttributeUse::Optimize);
        assert!(report.triangles_out <= 64, "{quality:?}: {report:?}");
        assert_eq!(report.attribute_seam_edges, 40);
        assert!(
            wrong_in_tiles(&kept) < 1e-5,
            "{quality:?}: {}",
            wrong_in_tiles(&kept)
        );
        let (carried, _) = run(AttributeUse::Carry);
        assert!(
            wrong_in_tiles(&carried) > 0.1,
            "{quality:?}: {}",
            wrong_in_tiles(&carried)
        );
        let (ignored, _) = run(AttributeUse::Ignore);
        assert!(ignored.attributes().is_empty());
    }
}

/// A colour that changes within one column of cells, without a seam: the ramp stays about as steep.
#[test]
fn a_ramp_stays_where_it_is() {
    let gray = |x: f32| ((x - 0.5) * 40.0).clamp(0.0, 1.0);
    let mesh = carrying(shapes::grid(40, 40), vec![color()], |_, p| {
        vec![gray(p.x); 3]
    });
    for quality in QUALITIES {
        let (kept, _) = decimate(
            mesh.clone(),
            &keeping(0.05, quality, AttributeUse::Optimize),
        )
        .unwrap();
        for (at, row) in faces(&kept).into_iter().flatten() {
            let expected = f64::from(gray(at.x));
            assert!(
                (row[0] - expected).abs() < 0.1,
                "{quality:?}: {} at {at}",
                row[0]
            );
        }
    }
}

/// A torus with normals and a texture with two seams, in every tier, by any number of threads, in
/// chunks: the same bytes; no crack, no chart turned over, normals of unit length near the true ones.
#[test]
fn a_torus_keeps_its_charts() {
    let mesh = torus(120, 60);
    let chart_of = |row: &[f64]| (row[3].floor(), row[4].floor());
    for (quality, chunks) in [
        (Quality::Fast, Chunks::Off),
        (Quality::Standard, Chunks::Off),
        (Quality::Best, Chunks::Off),
        (Quality::Fast, Chunks::Triangles(2000)),
        (Quality::Standard, Chunks::Triangles(2000)),
    ] {
        let run = |tier, threads| {
            let options = Options {
                chunks,
                check: false,
                tier: TierChoice::Fixed(tier),
                ..keeping(0.1, quality, AttributeUse::Optimize)
            };
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            let job = || decimate(mesh.clone(), &options).unwrap();
            pool.unwrap().install(job)
        };
        let (small, report) = run(Tier::Small, 1);
        assert_eq!(
            report.triangles_out, 1440,
            "{quality:?} {chunks:?}: {report:?}"
        );
        assert_eq!(report.chunks > 0, chunks != Chunks::Off);
        assert!(
            small == run(Tier::Full, 3).0,
            "{quality:?} {chunks:?}: tiers or threads"
        );
        assert!(
            small == run(Tier::Medium, 2).0,
            "{quality:?} {chunks:?}: tiers or threads"
        );
        let info = info(small.clone(), false).unwrap();
        assert_eq!((info.boundary_edges, info.non_manifold_edges), (0, 0));
        for face in faces(&small) {
            let [a, b, c] = face.each_ref().map(|(_, row)| [row[3], row[4]]);
            let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            assert!(area > 0.0, "{quality:?} {chunks:?}: a chart is turned over");
            let span = |i: usize| {
                let numbers = face.each_ref().map(|(_, row)| row[i]);
                numbers.iter().fold(f64::MIN, |m, &x| m.max(x))
                    - numbers.iter().fold(f64::MAX, |m, &x| m.min(x))
            };
            assert!(
                span(3).max(span(4)) < 0.5,
                "{quality:?} {chunks:?}: a face across a seam"
            );
            for (at, row) in face {
                let expected = torus_normal(at);
                let found = Vec3::new(row[0] as f32, row[1] as f32, row[2] as f32);
                assert!((found.length() - 1.0).abs() < 1e-5);
                let cosine = found.dot(expected);
                assert!(cosine > 0.97, "{quality:?} {chunks:?}: {cosine}");
                assert_eq!(
                    chart_of(&row.iter().map(|x| x.clamp(0.0, 0.999)).collect::<Vec<_>>()),
                    (0.0, 0.0)
                );
            }
        }
    }
}

/// The outward direction of a torus around z with radii 1 and a third, at a point near it.
fn torus_normal(at: Vec3) -> Vec3 {
    let middle = at.with_z(0.0).normalize();
    (at - middle).normalize()
}

/// A torus whose texture coordinates are the two angles, as shares of a turn.
fn torus(n: u32, m: u32) -> IndexedMesh {
    let turn = 2.0 * std::f32::consts::PI;
    let (_, triangles) = shapes::torus(n, m);
    let positions = (0..n * m).map(|i| {
        let (u, v) = (i / m, i % m);
        let (u, v) = (turn * u as f32 / n as f32, turn * v as f32 / m as f32);
        let r = 1.0 + v.cos() / 3.0;
        Vec3::new(r * u.cos(), r * u.sin(), v.sin() / 3.0)
    });
    let share = |y: f32, x: f32| y.atan2(x).rem_euclid(turn) / turn;
    let angles = move |p: Vec3| {
        let r = p.with_z(0.0).length();
        [share(p.y, p.x), share(p.z, r - 1.0)]
    };
    let mesh = carrying(
        (positions.collect(), triangles),
        vec![normal(), texture()],
        |centroid, corner| {
            let (at_centroid, at_corner) = (angles(centroid), angles(corner));
            // Behind the seam 0 is 1, and just before it rounding may have made 1 of 0.
            let beside = |near: f32, x: f32| x + (near - x).round();
            let [s, t] = [0, 1].map(|k| beside(at_centroid[k], at_corner[k]));
            let n = torus_normal(corner);
            vec![n.x, n.y, n.z, s, t]
        },
    );
    let turned = signed_areas(&mesh).iter().filter(|a| **a < 0.0).count();
    if turned > 0 {
        assert_eq!(
            turned,
            mesh.triangles().len(),
            "all charts run the same way"
        );
        let (positions, mut triangles) = (mesh.positions().to_vec(), mesh.triangles().to_vec());
        let mut attributes = mesh.attributes().clone();
        triangles
            .iter_mut()
            .chain(&mut attributes.corners)
            .for_each(|t| t.swap(1, 2));
        let turned = IndexedMesh::new(positions, triangles).unwrap();
        return turned.with_attributes(attributes).unwrap();
    }
    mesh
}

fn signed_areas(mesh: &IndexedMesh) -> Vec<f64> {
    let area = |face: [(Vec3, Vec<f64>); 3]| {
        let [a, b, c] = face.each_ref().map(|(_, row)| [row[3], row[4]]);
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    faces(mesh).into_iter().map(area).collect()
}

/// Three stripes of a square in three materials: no face changes sides, and the borders stay.
#[test]
fn groups_keep_their_area() {
    let (positions, triangles) = shapes::grid(30, 30);
    let centroid = |t: &[u32; 3]| t.iter().map(|&v| positions[v as usize].x).sum::<f32>() / 3.0;
    let group_of = triangles
        .iter()
        .map(|t| (3.0 * centroid(t)) as u32)
        .collect();
    let group = |i: u32| Group {
        material: format!("m{i}"),
        ..Group::default()
    };
    let attributes = Attributes {
        group_of,
        groups: (0..3).map(group).collect(),
        ..Attributes::default()
    };
    let mesh = IndexedMesh::new(positions.clone(), triangles.clone()).unwrap();
    let mesh = mesh.with_attributes(attributes).unwrap();
    for quality in QUALITIES {
        for usage in [AttributeUse::Optimize, AttributeUse::Carry] {
            let (small, _) = decimate(mesh.clone(), &keeping(0.03, quality, usage)).unwrap();
            let mut areas = [0.0; 3];
            for (t, &group) in small.triangles().iter().zip(&small.attributes().group_of) {
                let [a, b, c] = t.map(|v| small.positions()[v as usize]);
                areas[group as usize] += (b - a).cross(c - a).length() / 2.0;
            }
            for area in areas {
                assert!(
                    (area - 1.0 / 3.0).abs() < 1e-5,
                    "{quality:?} {usage:?}: {areas:?}"
                );
            }
        }
    }
}

/// Twenty islands of other materials on a sphere, of four faces each, and as few triangles as can be: no
/// island is ever gone, since the curve around its last face does not collapse.
fn islands_of_materials_stay<S: EdgeStore>() {
    let (positions, triangles) = shapes::icosphere(3);
    // The middle of the middle of each face of the icosahedron.
    let island = |i: usize| if i % 64 < 60 { 0 } else { 1 + i as u32 / 64 };
    let attributes = Attributes {
        group_of: (0..triangles.len()).map(island).collect(),
        groups: vec![Group::default(); 21],
        ..Attributes::default()
    };
    let mesh = IndexedMesh::new(positions, triangles).unwrap();
    let mesh = mesh.with_attributes(attributes).unwrap();
    for quality in QUALITIES {
        for usage in [AttributeUse::Optimize, AttributeUse::Carry] {
            let options = Options {
                tier: TierChoice::Fixed(S::TIER),
                check: false,
                ..keeping(0.0, quality, usage)
            };
            let (small, report) = decimate(mesh.clone(), &options).unwrap();
            let mut faces = [0; 21];
            for &group in &small.attributes().group_of {
                faces[group as usize] += 1;
            }
            let islands = &faces[1..];
            assert_eq!(islands, [1; 20], "{quality:?} {usage:?}");
            assert!(report.blocked.unwrap().link > 0, "{quality:?} {usage:?}");
        }
    }
}

/// A flat square wound up in the texture: the surface allows any collapse, and still no triangle turns
/// over in the texture.
fn no_triangle_turns_over_in_the_texture<S: EdgeStore>() {
    let wound = |p: Vec3| {
        let p = p - Vec3::new(0.5, 0.5, 0.0);
        let inside = (1.0 - 4.0 * p.length_squared()).max(0.0);
        let (sin, cos) = (2.0 * inside * inside).sin_cos();
        vec![cos * p.x - sin * p.y, sin * p.x + cos * p.y]
    };
    let mesh = carrying(shapes::grid(24, 24), vec![texture()], |_, p| wound(p));
    let areas = |mesh: &IndexedMesh| -> Vec<f64> {
        let area = |face: [(Vec3, Vec<f64>); 3]| {
            let [a, b, c] = face.each_ref().map(|(_, row)| [row[0], row[1]]);
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        faces(mesh).into_iter().map(area).collect()
    };
    assert!(areas(&mesh).iter().all(|&area| area > 0.0));
    for quality in QUALITIES {
        for usage in [AttributeUse::Optimize, AttributeUse::Carry] {
            let options = Options {
                tier: TierChoice::Fixed(S::TIER),
                check: false,
                ..keeping(0.1, quality, usage)
            };
            let (small, _) = decimate(mesh.clone(), &options).unwrap();
            let turned = areas(&small).iter().filter(|&&area| area <= 0.0).count();
            assert_eq!(turned, 0, "{quality:?} {usage:?}");
        }
    }
}

/// The surface of a mesh with its attributes, prepared as for a run.
fn surface_of<S: EdgeStore>(mesh: IndexedMesh, options: &Options) -> Surface<S> {
    let (min, max) = mesh.bounds().unwrap();
    let room = Room::around([min, max]);
    let mut parts = mesh.into_parts();
    let attributes = std::mem::take(&mut parts.attributes);
    let mut flat = Flat::<()>::of(parts);
    let geometry = (&flat.positions[..], &flat.triangles[..]);
    let left = flat.triangles.len() / 2;
    flat.wedges = FlatWedges::of(&attributes, geometry, room.scale(), left, options);
    let mesh = Mesh::from_triangles(flat.positions.len(), &flat.triangles);
    let (mut surface, _) = flat.into_surface(mesh, room, &[]);
    unheard(|meter| surface.prepare(options, meter));
    surface
}

/// A cost that followed collapses at random, along and off seams, says what one says that is made
/// afresh of what is left: of every edge, but for rounding.
fn a_cost_follows_what_collapses<S: EdgeStore>() {
    let options = keeping(0.0, Quality::Standard, AttributeUse::Optimize);
    let wave = |x: f32| 0.5 + 0.5 * (5.0 * x).sin();
    let mesh = carrying(
        shapes::torus(14, 9),
        vec![color(), texture()],
        |centroid, p| {
            let [s, t] = if centroid.x < 0.0 {
                [p.x, p.y]
            } else {
                [p.z + 3.0, p.y]
            };
            vec![wave(p.x), wave(p.y), wave(p.z), s, t]
        },
    );
    let mut surface = surface_of::<S>(mesh, &options);
    let fresh = |surface: &Surface<S>| unheard(|meter| Memoryless::new(surface, &options, meter));
    let mut cost = fresh(&surface);
    let mut state = 1u64;
    let mut random = |n: usize| {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 33) as usize % n
    };
    let (mut collapses, mut at_seams, mut changed) = (0, 0, Vec::new());
    for _ in 0..600 {
        let edges: Vec<EdgeId> = surface.mesh.edges().collect();
        let e = edges[random(edges.len())];
        let Some(evaluation) = cost.evaluate(&surface, e, surface.held(e)) else {
            continue;
        };
        let is_kept = surface.mesh.link_condition(e) && surface.curves.stay_apart(&surface.mesh, e);
        let way = Way::Collapse(None);
        let position = evaluation.position;
        let Some(deviation) = surface
            .deviation_after(e, &way, position)
            .filter(|_| is_kept)
        else {
            continue;
        };
        let carried = Cost::<S>::carried(&cost, &surface, e, position);
        let plan = Plan {
            way,
            deviation,
            carried,
        };
        at_seams += usize::from(plan.carried.len() > 1);
        let merged = surface.collapse(e, position, &plan);
        cost.after_collapse(&surface, &merged, &mut changed);
        collapses += 1;
        let fresh = fresh(&surface);
        for e in surface.mesh.edges() {
            let costs = [&cost, &fresh].map(|cost| cost.evaluate(&surface, e, surface.held(e)));
            let [Some(found), Some(expected)] = costs else {
                assert_eq!(costs[0].is_some(), costs[1].is_some(), "{e:?}");
                continue;
            };
            let wrong = (found.cost - expected.cost).abs();
            assert!(
                wrong <= 1e-3 * expected.cost + 1e-7,
                "{e:?} after {collapses}: {} for {}",
                found.cost,
                expected.cost
            );
        }
    }
    assert!(collapses > 50 && at_seams > 10, "{collapses}, {at_seams}");
}

for_each_tier!(
    islands_of_materials_stay,
    no_triangle_turns_over_in_the_texture,
    a_cost_follows_what_collapses,
);

/// A sphere that a program wrote with the direction of each face at its corners: smooth but for that,
/// so that it decimates as if it had no normals. A cube's edges stay.
#[test]
fn directions_of_faces_are_no_seams() {
    let faceted = |shape: Shape| {
        let (positions, triangles) = shape.clone();
        let of_face = |centroid: Vec3| {
            let near = |t: &&[u32; 3]| {
                let [a, b, c] = t.map(|v| positions[v as usize]);
                ((a + b + c) / 3.0 - centroid).length() < 1e-6
            };
            let [a, b, c] = triangles
                .iter()
                .find(near)
                .unwrap()
                .map(|v| positions[v as usize]);
            (b - a).cross(c - a).normalize()
        };
        carrying(shape, vec![normal()], |centroid, _| {
            of_face(centroid).to_array().to_vec()
        })
    };
    for (shape, ratio) in [(shapes::icosphere(3), 0.1), (shapes::icosphere(1), 0.3)] {
        let mesh = faceted(shape);
        assert!(mesh.attributes().wedge_count() > 4 * mesh.positions().len());
        for quality in QUALITIES {
            let options = keeping(ratio, quality, AttributeUse::Optimize);
            let (small, report) = decimate(mesh.clone(), &options).unwrap();
            assert_eq!(report.stop_reason, StopReason::Target, "{quality:?}");
            assert_eq!(small.attributes().wedge_count(), small.positions().len());
        }
    }
}

/// What is not decimated comes out as it was, in double precision and all.
#[test]
fn at_ratio_1_nothing_changes() {
    let mut channel = Channel::new(
        Kind::Scalar,
        vec![crate::attributes::Property {
            name: "time".into(),
            number: crate::attributes::NumberType::F64,
        }],
    );
    let (positions, triangles) = shapes::icosphere(2);
    (0..positions.len()).for_each(|i| channel.values.push(0.1 * i as f64));
    let attributes = Attributes {
        channels: vec![channel],
        corners: triangles.clone(),
        ..Attributes::default()
    };
    let mesh = IndexedMesh::new(positions, triangles).unwrap();
    let mesh = mesh.with_attributes(attributes).unwrap();
    for quality in QUALITIES {
        let (same, _) =
            decimate(mesh.clone(), &keeping(1.0, quality, AttributeUse::Optimize)).unwrap();
        assert!(same == mesh);
    }
}

/// The same mesh without attributes and with attributes that are ignored, or that weigh nothing and
/// have no seam: the same triangles.
#[test]
fn attributes_that_weigh_nothing_change_nothing() {
    let shape = shapes::icosphere(4);
    let plain = IndexedMesh::new(shape.0.clone(), shape.1.clone()).unwrap();
    let mesh = carrying(shape, vec![color()], |_, p| {
        vec![p.x.abs(), p.y.abs(), p.z.abs()]
    });
    for quality in QUALITIES {
        for usage in [AttributeUse::Ignore, AttributeUse::Carry] {
            let options = keeping(0.1, quality, usage);
            let (expected, _) = decimate(plain.clone(), &options).unwrap();
            let (found, _) = decimate(mesh.clone(), &options).unwrap();
            assert_eq!(found.triangles(), expected.triangles());
            assert_eq!(found.positions(), expected.positions());
        }
    }
}
