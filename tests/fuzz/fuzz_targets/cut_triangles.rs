//! Any triangle list, cut until it is manifold.

#![no_main]

use arbitrary::Unstructured;
use decimate::clean::clean;
use decimate::repair::cut;
use decimate_fuzz::{decimating::assert_same, made, stay_on_one_thread};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    stay_on_one_thread();
    let mut bytes = Unstructured::new(bytes);
    let Ok(weld) = bytes.arbitrary() else {
        return;
    };
    let Ok(Some(mesh)) = made::mesh(&mut bytes) else {
        return;
    };
    let (out, report) = cut(mesh.clone(), weld).expect("there is room for copies");
    assert_eq!(report.non_manifold_edges_out, 0, "{report:?}");
    assert_eq!(report.non_manifold_vertices_out, 0, "{report:?}");
    assert_eq!(out.positions().len(), report.vertices_out);
    assert_eq!(out.triangle_count(), report.triangles_out);

    // The faces are those of the clean mesh, in its order, each where it was.
    let welds = weld && report.cleaning.welded_vertices > 0;
    let (cleaned, _) = clean(mesh, welds).expect("it was cut");
    let corners = |mesh: &decimate::indexed_mesh::IndexedMesh| -> Vec<[[u32; 3]; 3]> {
        let at = |v: u32| mesh.positions()[v as usize].to_array().map(f32::to_bits);
        mesh.sides().map(|triangle| triangle.map(at)).collect()
    };
    assert_eq!(corners(&out), corners(&cleaned));
    let added = out.positions().len() - cleaned.positions().len();
    assert_eq!(added, report.vertices_copied);

    let (again, report) = cut(out.clone(), weld).expect("there is room for copies");
    assert_same(&again, &out, "cut again");
    assert_eq!(report.vertices_copied, 0);
});
