//! Decimation, and what must hold of its results.

use std::collections::BTreeSet;

use decimate::decimate::{Options, Report, Targets, TierChoice, Topology, decimate};
use decimate::error::{Error, Result};
use decimate::indexed_mesh::IndexedMesh;
use decimate::mesh::Tier;
use decimate::metrics::info;

/// Decimates in every tier, and checks the result against the mesh.
///
/// # Panics
/// Where it is not what it should be.
pub fn attack_decimation(mesh: &IndexedMesh, options: &Options) -> Option<IndexedMesh> {
    let [full, medium, small] = [Tier::Full, Tier::Medium, Tier::Small].map(|tier| {
        let options = Options {
            tier: TierChoice::Fixed(tier),
            ..options.clone()
        };
        decimate(mesh.clone(), &options)
    });
    // What a limit of memory lets pass differs by tier.
    for other in [medium, small] {
        if let (Ok((full, _)), Ok((other, _))) = (&full, &other) {
            assert_same(full, other, "in different tiers");
        }
        check_error(&other);
    }
    check_error(&full);
    let (out, report) = full.ok()?;
    check_result(mesh, &out, &report, options);
    Some(out)
}

fn check_error(answer: &Result<(IndexedMesh, Report)>) {
    match answer {
        Ok(_) | Err(Error::InvalidOptions(_) | Error::InvalidMesh(_) | Error::Memory { .. }) => {}
        Err(error) => panic!("{error}"),
    }
}

fn check_result(mesh: &IndexedMesh, out: &IndexedMesh, report: &Report, options: &Options) {
    assert_eq!(out.triangle_count(), report.triangles_out);
    assert_eq!(out.positions().len(), report.vertices_out);
    assert!(out.triangle_count() <= mesh.triangle_count() + report.tally.filled_faces);
    assert!(out.positions().iter().all(|p| p.is_finite()), "{out:?}");
    let mut seen = BTreeSet::new();
    for mut triangle in out.triangles().iter().copied() {
        triangle.sort_unstable();
        let [a, b, c] = triangle;
        assert!(a != b && b != c, "a vertex twice in {triangle:?}");
        assert!(seen.insert(triangle), "{triangle:?} twice");
    }

    let before = info(mesh.clone(), options.weld).expect("it was decimated");
    let after = info(out.clone(), false).expect("it is a mesh");
    assert_eq!(
        after.cleaning.kept_vertices,
        out.positions().len(),
        "an unused vertex"
    );
    assert!(after.non_manifold_edges <= before.non_manifold_edges);
    if before.boundary_edges == 0 {
        assert_eq!(after.boundary_edges, 0, "closed in, open out");
    }
    if options.topology == Topology::Preserve {
        assert_eq!(
            (
                after.components,
                after.euler_characteristic,
                after.boundary_loops
            ),
            (
                before.components,
                before.euler_characteristic,
                before.boundary_loops
            ),
            "components, Euler characteristic, boundary loops"
        );
        assert_eq!(after.is_orientable, before.is_orientable);
    }

    let keep_all = Options {
        targets: Targets {
            ratio: Some(1.0),
            ..Targets::default()
        },
        weld: false,
        ..options.clone()
    };
    match decimate(out.clone(), &keep_all) {
        Ok((again, _)) => assert_same(&again, out, "at ratio 1"),
        // Everything may be gone where that was allowed, and memory is none of this.
        Err(Error::InvalidMesh(_)) => assert!(out.triangles().is_empty()),
        Err(Error::Memory { .. }) => {}
        Err(error) => panic!("{error}"),
    }
}

/// Asserts that two meshes are one, by what they are written as: of what is no number, too.
///
/// # Panics
/// Where they are not.
pub fn assert_same(a: &IndexedMesh, b: &IndexedMesh, what: &str) {
    assert_eq!(format!("{a:?}"), format!("{b:?}"), "{what}");
}
