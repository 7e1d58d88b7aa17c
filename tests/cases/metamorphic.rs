//! Runs whose results must agree, whatever they are.

use decimate::clean::clean;
use glam::DVec3;

use super::*;

/// Where nothing is decimated alone first, and in pieces of so many triangles.
fn both_ways(options: Options) -> [Options; 2] {
    let whole = Options {
        chunks: Chunks::Off,
        ..options.clone()
    };
    [whole, in_chunks(400, options)]
}

/// Scaled by a power of two, the triangles are the same and the positions scaled: closed and open,
/// as a whole and in chunks, to a number of triangles and to an error.
#[test]
fn a_power_of_two_scales_the_output() {
    for shape in [bumpy(40), potato(4)] {
        let plain = mesh(shape.clone());
        for quality in QUALITIES {
            for options in [to_triangles(quality, 700), to_error(quality, 0.002)]
                .into_iter()
                .flat_map(both_ways)
            {
                let (expected, report) = run(&plain, &options);
                assert_eq!(report.chunks > 1, options.chunks != Chunks::Off);
                for power in [-70, -3, 1, 40, 100] {
                    let factor = 2f32.powi(power);
                    let scaled = |mesh: &IndexedMesh| {
                        let scaled = mesh.positions().iter().map(|&p| p * factor);
                        IndexedMesh::new(scaled.collect(), mesh.triangles().to_vec()).unwrap()
                    };
                    let mut options = options.clone();
                    let error = &mut options.targets.max_error;
                    *error = error.map(|e| e * f64::from(factor));
                    let (small, _) = run(&scaled(&plain), &options);
                    assert!(
                        small.triangles() == expected.triangles()
                            && small.positions() == scaled(&expected).positions(),
                        "{quality:?}, 2^{power}, {:?}",
                        options.chunks
                    );
                }
            }
        }
    }
}

/// Translated without rounding, the triangles are the same and the positions translated: on a lattice,
/// where every vertex stays one of the lattice. Where vertices are placed between, only their rounding
/// differs, and with it the distance, by little.
#[test]
fn an_exact_translation_translates_the_output() {
    let (mut positions, triangles) = bumpy(40);
    for p in &mut positions {
        *p = (*p * 2048.0).round() / 2048.0;
    }
    let moved_by = |offset: Vec3| {
        let moved = positions.iter().map(|&p| p + offset);
        mesh((moved.collect(), triangles.clone()))
    };
    let plain = moved_by(Vec3::ZERO);
    for quality in QUALITIES {
        for options in both_ways(onto_own_vertices(quality, 500)) {
            let (expected, _) = run(&plain, &options);
            for offset in [Vec3::X, Vec3::new(-3.0, 8.0, 1.0), Vec3::splat(100.0)] {
                let (small, _) = run(&moved_by(offset), &options);
                let back: Vec<Vec3> = small.positions().iter().map(|&p| p - offset).collect();
                assert!(
                    small.triangles() == expected.triangles() && back == expected.positions(),
                    "{quality:?}, {offset}, {:?}",
                    options.chunks
                );
            }
        }
        let options = to_triangles(quality, 500);
        let (expected, _) = distances(&plain, &run(&plain, &options).0);
        let there = moved_by(Vec3::splat(100.0));
        let (reached, _) = distances(&there, &run(&there, &options).0);
        let ratio = reached / expected;
        assert!((ratio - 1.0).abs() < 0.02, "{quality:?}: {ratio}");
    }
}

/// Faces in another order, each begun at another corner, break ties otherwise: on a lattice, where
/// ties are many, in chunks and as a whole the distance stays within 2 %. (Of outputs of 3000
/// triangles chance alone makes 1 to 2 % of difference; here it makes 0.4 %.)
#[test]
fn the_order_of_faces_changes_little() {
    let (positions, triangles) = bumpy(250);
    // Marsaglia's xorshift.
    let mut state = 0x5eed_u64;
    let mut below = |n: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as usize % n
    };
    let mut permuted = triangles.clone();
    for i in (1..permuted.len()).rev() {
        permuted.swap(i, below(i + 1));
        permuted[i].rotate_left(below(3));
    }
    let [plain, permuted] = [triangles, permuted].map(|t| mesh((positions.clone(), t)));
    let reference = Reference::new(plain.clone()).unwrap();
    for quality in [Quality::Fast, Quality::Standard] {
        for chunks in [Chunks::Auto, Chunks::Off] {
            let options = Options {
                chunks,
                ..to_triangles(quality, plain.triangle_count() / 20)
            };
            let [expected, reached] = [&plain, &permuted].map(|mesh| {
                let (small, report) = run(mesh, &options);
                assert_eq!(report.chunks > 1, chunks == Chunks::Auto);
                distances_to(&reference, &small).0
            });
            let ratio = reached / expected;
            assert!(
                (ratio - 1.0).abs() < 0.02,
                "{quality:?}, {chunks:?}: {ratio}"
            );
        }
    }
}

/// The origin is carried along: the same bits wherever it is.
#[test]
fn an_origin_is_carried_along() {
    let (positions, triangles) = potato(3);
    let at =
        |origin| IndexedMesh::with_origin(origin, positions.clone(), triangles.clone()).unwrap();
    let there = DVec3::new(1e7, -0.3, 1e-3);
    for quality in QUALITIES {
        let options = to_triangles(quality, 100);
        let ((near, _), (far, _)) = (run(&at(DVec3::ZERO), &options), run(&at(there), &options));
        assert!(near.triangles() == far.triangles() && near.positions() == far.positions());
        assert_eq!(far.origin(), there);
    }
}

/// To keep all is to weld, drop and fold, and nothing else.
#[test]
fn ratio_one_is_the_identity_up_to_welding() {
    // A soup: three vertices of its own for each triangle, some faces twice, some from behind.
    let (positions, triangles) = potato(3);
    let mut soup = triangles.clone();
    soup.extend(triangles.iter().step_by(9).map(|&[a, b, c]| [b, c, a]));
    soup.extend(triangles.iter().step_by(7).map(|&[a, b, c]| [a, c, b]));
    let corners = soup.iter().flatten().map(|&v| positions[v as usize]);
    let corners: Vec<Vec3> = corners.collect();
    let faces = (0..soup.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    let soup = mesh((corners, faces.collect()));
    let (cleaned, counts) = clean(soup.clone(), true).unwrap();
    assert_eq!(counts.kept_vertices, positions.len());
    assert_eq!(counts.kept_faces, triangles.len());
    assert!(counts.folded_faces > 100 && counts.dropped_duplicate_faces > 100);
    for quality in QUALITIES {
        let all = Options {
            targets: Targets {
                ratio: Some(1.0),
                ..Targets::default()
            },
            quality,
            ..Options::default()
        };
        let (same, report) = run_in_every_tier(&soup, &all);
        assert_same(&same, &cleaned);
        assert_eq!(report.tally.collapses, 0, "{quality:?}");
    }
}

/// What a target or an error gave has reached it: once more changes no bit, also in chunks.
#[test]
fn the_output_of_the_output_is_the_output() {
    for shape in [
        bumpy(40),
        potato(4),
        shapes::three_fins(25),
        shapes::moebius(400),
    ] {
        let plain = mesh(shape);
        for quality in QUALITIES {
            for options in both_ways(to_triangles(quality, 300)) {
                let (once, report) = run(&plain, &options);
                assert!(report.triangles_out <= 300, "{quality:?}: {report:?}");
                for again in both_ways(options) {
                    assert_same(&run_in_every_tier(&once, &again).0, &once);
                }
            }
        }
    }
}

/// Whatever the tier, the number of threads and the quality, the same bytes: as a whole and in
/// chunks, closed, open and non-manifold.
#[test]
fn tiers_and_threads_give_the_same_bytes() {
    let pools = [1, 3].map(|threads| {
        let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
        builder.build().unwrap()
    });
    for shape in [bumpy(50), potato(4), shapes::three_fins(30)] {
        let plain = mesh(shape);
        for quality in QUALITIES {
            for options in both_ways(to_triangles(quality, 600)) {
                let [one, three] = pools
                    .each_ref()
                    .map(|pool| pool.install(|| run_in_every_tier(&plain, &options).0));
                assert_same(&one, &three);
            }
        }
    }
}

/// Components side by side, so long that one alone has the scale of all: what an error leaves of each
/// does not depend on the others, to the bit. (Not so with the best quality, whose fit samples the
/// whole and goes piece by piece of it; nor in chunks, which are cut and whose threshold is found for
/// the whole.)
#[test]
fn each_component_alone_is_as_in_the_whole() {
    let (sheet, squares) = bumpy(20);
    let sheet = sheet.iter().map(|&p| 2.0 * p - Vec3::ONE);
    let components = [
        potato(3),
        shapes::torus(24, 20),
        (sheet.collect(), squares),
        potato(2),
        shapes::moebius(300),
    ];
    let mut row = 0.0;
    let components = components.map(|(positions, triangles)| {
        row += 0.1;
        let place = |p: Vec3| p * Vec3::new(0.3, 0.03, 0.03) + row * Vec3::Y;
        mesh((positions.into_iter().map(place).collect(), triangles))
    });
    let together = |components: &[IndexedMesh]| {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for component in components {
            let first = positions.len() as u32;
            positions.extend_from_slice(component.positions());
            triangles.extend(component.triangles().iter().map(|t| t.map(|v| first + v)));
        }
        mesh((positions, triangles))
    };
    let whole = together(&components);
    for diagonal in components.iter().chain([&whole]).map(IndexedMesh::diagonal) {
        assert!((0.5..1.0).contains(&diagonal), "{diagonal}");
    }
    for quality in [Quality::Fast, Quality::Standard] {
        for max_error in [0.0, 1e-4, 1e-3] {
            let options = to_error(quality, max_error);
            let (all, report) = run_in_every_tier(&whole, &options);
            assert_eq!(report.tally.collapses > 0, max_error > 0.0);
            let alone = components.each_ref().map(|c| run(c, &options).0);
            assert_same(&together(&alone), &all);
        }
    }
}
