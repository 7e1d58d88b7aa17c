//! Files that others made: `MESHES=folder cargo test --test io_shared`, where the folder has
//! `meshes/` and `malformed/`. Without `MESHES` these tests say so and pass.

use std::path::{Path, PathBuf};
use std::time::Instant;

use decimate::indexed_mesh::IndexedMesh;
use decimate::io::{self, ReadOptions, WriteOptions};

/// The vertices and triangles that each file holds, before any welding.
const COUNTS: [(&str, usize, usize); 19] = [
    ("camelhead.off", 11_381, 22_704),
    ("conrod.stl", 3 * 6_442, 6_442),
    ("cycloidal.ply", 21_384, 43_368),
    ("face000.ply", 85_849, 166_259),
    ("fandisk.obj", 6_475, 12_946),
    ("gears.stl", 3 * 19_426, 19_426),
    ("igea.ply", 134_345, 268_686),
    ("Laurana50k.ply", 27_861, 49_954),
    ("nefertiti.obj", 49_971, 99_938),
    ("office_chair.obj", 3_476, 6_893),
    ("ogre.obj", 62_194, 124_008),
    ("pirate.obj", 2_889, 5_010),
    ("rocker-arm.obj", 10_044, 20_088),
    ("scallop.glb", 60_002, 120_000),
    ("screwdriver.ply", 6_789, 13_574),
    ("spot.obj", 2_930, 5_856),
    ("stanford-bunny.obj", 35_947, 69_451),
    ("thingi10k_99865.stl", 3 * 71_974, 71_974),
    ("igea_sub_1m.ply", 537_374, 1_074_744),
];

/// What each malformed file gives: vertices and triangles, or `None` where it is refused.
const MALFORMED: [(&str, Option<(usize, usize)>); 45] = [
    ("20mmbox-CR.stl", Some((36, 12))),
    ("20mmbox-nonstandard.stl", Some((36, 12))),
    ("BoxWithInfinites.glb", Some((24, 12))),
    ("CubeInvalidUnicode.stl", Some((36, 12))),
    ("IndexOutOfRange.bin", None),
    ("IndexOutOfRange.gltf", None),
    ("OutOfMemory.off", None),
    ("admesh_block_normal-directions-bad.stl", Some((36, 12))),
    ("admesh_block_remove-unconnected-bad.stl", Some((75, 25))),
    ("afl_000009.obj", None),
    ("afl_000014.obj", None),
    ("binary_says_solid_472042.stl", Some((10_896, 3_632))),
    ("box_UTF16BE.obj", Some((8, 12))),
    ("comments.off", Some((8, 12))),
    ("concave_polygon.obj", Some((64, 64))),
    ("cube-shuffled.off", Some((8, 12))),
    ("cube_binary_header_with_RN_newline.ply", Some((8, 12))),
    ("deg_faces.obj", Some((6, 4))),
    ("degenerated.obj", Some((7, 24))),
    ("degtri_sliding.off", Some((8, 8))),
    ("empty_solid.stl", Some((0, 0))),
    ("empty_zero_bytes.ply", None),
    ("fan3.obj", Some((5, 3))),
    ("git_lfs_pointer.ply", None),
    ("inf_nan.obj", Some((3, 1))),
    ("invalid-face-definition.obj", Some((8, 0))),
    ("issue-140-zero-face-idx.obj", None),
    ("issue623.ply", None),
    ("joined_tetrahedra.obj", Some((5, 8))),
    ("malformed.obj", None),
    ("mni-surface-mesh.obj", None),
    ("moebius.obj", Some((280, 448))),
    ("multibody.stl", Some((96, 32))),
    ("negative_indices.obj", Some((8, 12))),
    ("non_manifold_wrap.obj", Some((10, 12))),
    ("number_formats.obj", None),
    ("ply_empty_header.ply", Some((0, 0))),
    ("points_bin.ply", Some((5, 0))),
    ("polygonfaces.obj", Some((5, 3))),
    ("prim.off", Some((11, 12))),
    ("soup.stl", Some((300, 100))),
    ("test-nan.obj", Some((76, 36))),
    ("test_extra_whitespace.ply", Some((3, 1))),
    ("truncated_chunk_data.glb", None),
    ("wallhole.obj", Some((92, 66))),
];

fn folder(name: &str) -> Option<PathBuf> {
    let meshes = std::env::var_os("MESHES");
    if meshes.is_none() {
        eprintln!("skipped: MESHES names no folder with {name}/");
    }
    meshes.map(|meshes| Path::new(&meshes).join(name))
}

#[test]
fn every_mesh_has_the_counts_of_its_manifest() {
    let Some(folder) = folder("meshes") else {
        return;
    };
    for (name, vertices, triangles) in COUNTS {
        let mesh =
            io::read(&folder.join(name), &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(
            (mesh.positions().len(), mesh.triangles().len()),
            (vertices, triangles),
            "{name}"
        );
        assert_eq!(mesh.origin().to_array(), [0.0; 3], "{name}");
    }
}

/// Within a second and without a panic, whatever their headers promise.
/// Polygons that are read whole and cut afterwards are the triangles that are read at once.
#[test]
fn polygons_are_cut_the_same_sooner_or_later() {
    for name in ["meshes", "malformed"] {
        let Some(folder) = folder(name) else {
            return;
        };
        for entry in folder.read_dir().unwrap() {
            let path = entry.unwrap().path();
            // Polygons carry nothing, so that nothing of it can be wrong.
            let options = ReadOptions {
                attributes: false,
                ..ReadOptions::default()
            };
            let at_once = io::read(&path, &options);
            let later = io::read_polygons(&path, &options);
            match (at_once, later.and_then(|mesh| mesh.fanned())) {
                (Ok(at_once), Ok(later)) => {
                    // By their bits, since not every coordinate is a number.
                    assert_eq!(at_once.triangles(), later.triangles(), "{}", path.display());
                    let bits = |p: &glam::Vec3| p.to_array().map(f32::to_bits);
                    let at_once = at_once.positions().iter().map(bits);
                    assert!(
                        at_once.eq(later.positions().iter().map(bits)),
                        "{}",
                        path.display()
                    );
                }
                (Err(at_once), Err(later)) => assert_eq!(at_once.to_string(), later.to_string()),
                (at_once, later) => panic!(
                    "{}: {:?}, {:?}",
                    path.display(),
                    at_once.map(|mesh| mesh.triangle_count()),
                    later.map(|mesh| mesh.triangle_count())
                ),
            }
        }
    }
}

/// The values at a triangle's corner: position, then every channel.
fn corner(mesh: &IndexedMesh, triangle: usize, k: usize) -> Vec<u64> {
    let attributes = mesh.attributes();
    let v = mesh.triangles()[triangle][k] as usize;
    let wedge = attributes.corners[triangle][k] as usize;
    let position = mesh.positions()[v].to_array().map(f64::from);
    let values = attributes.channels.iter().flat_map(|c| c.row(wedge));
    position
        .into_iter()
        .chain(values)
        .map(f64::to_bits)
        .collect()
}

/// Normals and colours of a scan, written and read again, have the same bits at every corner.
#[test]
fn gltf_attributes_come_back() {
    let Some(folder) = folder("meshes") else {
        return;
    };
    let mesh = io::read(&folder.join("scallop.glb"), &ReadOptions::default()).unwrap();
    assert_eq!(mesh.attributes().channels.len(), 2);
    for name in ["a.glb", "a.gltf"] {
        let mut bytes = Vec::new();
        let path = Path::new(name);
        io::write_to(path, &mut bytes, &mesh, &WriteOptions::default()).unwrap();
        let source = std::io::Cursor::new(bytes);
        let back = io::read_from(path, source, None, &ReadOptions::default()).unwrap();
        let (before, after) = (mesh.attributes(), back.attributes());
        assert_eq!(back.triangles().len(), mesh.triangles().len());
        assert_eq!(after.assets, before.assets);
        assert_eq!(after.groups, before.groups);
        assert_eq!(after.group_of, before.group_of);
        for (a, b) in after.channels.iter().zip(&before.channels) {
            assert_eq!((a.kind, &a.components), (b.kind, &b.components));
        }
        for triangle in 0..mesh.triangles().len() {
            for k in 0..3 {
                assert_eq!(
                    corner(&back, triangle, k),
                    corner(&mesh, triangle, k),
                    "{name}"
                );
            }
        }
    }
}

#[test]
fn malformed_files_are_read_or_refused_at_once() {
    let Some(folder) = folder("malformed") else {
        return;
    };
    for (name, expected) in MALFORMED {
        let start = Instant::now();
        let result = io::read(&folder.join(name), &ReadOptions::default());
        let seconds = start.elapsed().as_secs_f64();
        let found = result
            .as_ref()
            .ok()
            .map(|mesh| (mesh.positions().len(), mesh.triangles().len()));
        assert_eq!(
            found,
            expected,
            "{name}: {:?}",
            result.err().map(|e| e.to_string())
        );
        assert!(seconds < 1.0, "{name} took {seconds} s");
    }
}
