//! What a collapse must not do to the faces around it, and how far it may move away from them.

use glam::{DVec3, Vec3};

use super::geometry::Geometry;
use crate::mesh::{EdgeId, EdgeStore, Mesh, Opposite};

/// A face this thin (twice its area against its longest squared edge) has no direction that single
/// precision could vouch for.
const THIN: f64 = 1e-6;

/// Whether a face would turn by 90° or more, or lose its area, if the ends of `e` moved to
/// `position`.
///
/// Costs one walk around each end that moves, in turns, until a face is found.
pub fn turns_a_face<S: EdgeStore>(
    mesh: &Mesh<S>,
    geometry: &Geometry,
    e: EdgeId,
    position: Vec3,
) -> bool {
    let turns = |d: EdgeId| {
        let (a, b) = (mesh.head(d), mesh.apex(d));
        let rim = geometry.between(a, b);
        let corner = geometry.position(mesh.tail(d));
        let before = shape(geometry.vector(corner, a), geometry.vector(corner, b), rim);
        let after = shape(
            geometry.vector(position, a),
            geometry.vector(position, b),
            rim,
        );
        match (before, after) {
            (None, _) => false,
            (Some(_), None) => true,
            (Some(before), Some(after)) => before.dot(after) <= 0.0,
        }
    };
    let [v, w] = mesh.edge_vertices(e);
    let mut faces = [(v, w), (w, v)].map(|(end, other)| {
        let moves = geometry.position(end) != position;
        let survives = move |&d: &EdgeId| mesh.head(d) != other && mesh.apex(d) != other;
        mesh.outgoing_edges(end)
            .filter(move |d| moves && survives(d))
    });
    loop {
        match [faces[0].next(), faces[1].next()] {
            [None, None] => return false,
            next if next.into_iter().flatten().any(turns) => return true,
            _ => {}
        }
    }
}

/// The normal of a triangle given by its sides, unless it is too thin to have one.
#[inline(always)]
fn shape(to_a: DVec3, to_b: DVec3, rim: DVec3) -> Option<DVec3> {
    let normal = to_a.cross(to_b);
    let longest = to_a
        .length_squared()
        .max(to_b.length_squared())
        .max(rim.length_squared());
    (normal.length_squared() > THIN * THIN * longest * longest).then_some(normal)
}

/// The largest distance of `position` from the planes of the faces and the lines of the boundary
/// edges at both ends of `e`, in the unit box.
pub fn distance_from_star<S: EdgeStore>(
    mesh: &Mesh<S>,
    geometry: &Geometry,
    e: EdgeId,
    position: Vec3,
) -> f64 {
    let mut largest = 0.0f64;
    let mut line = |d: EdgeId, along: DVec3, offset: DVec3| {
        let length_squared = along.length_squared();
        if matches!(mesh.opposite(d), Opposite::Boundary) && length_squared > 0.0 {
            largest = largest.max((along.cross(offset).length_squared() / length_squared).sqrt());
        }
    };
    let mut planes = 0.0f64;
    for v in mesh.edge_vertices(e) {
        let point = geometry.position(v);
        if point == position {
            continue;
        }
        let offset = (position.as_dvec3() - point.as_dvec3()) * geometry.scale();
        for d in mesh.outgoing_edges(v) {
            let to_head = geometry.vector(point, mesh.head(d));
            let to_apex = geometry.vector(point, mesh.apex(d));
            let normal = to_head.cross(to_apex);
            let length = normal.length();
            if length > 0.0 {
                planes = planes.max((normal.dot(offset) / length).abs());
            }
            line(d, to_head, offset);
            line(mesh.prev(d), to_apex, offset);
        }
    }
    largest.max(planes)
}
