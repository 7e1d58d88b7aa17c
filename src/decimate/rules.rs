//! What a collapse must not do to the faces around it, and how far it may move away from them.

use glam::{DVec3, Vec3};

use super::geometry::Geometry;
use crate::mesh::{EdgeId, EdgeStore, Mesh, Opposite, VertexId};

/// A face this thin (twice its area against its longest squared edge) has no direction that single
/// precision could vouch for.
const THIN: f64 = 1e-6;

/// The largest distance of `position` from the planes of the faces and the lines of the boundary
/// edges at both ends of `e`, in the unit box; nothing where a face that stays would turn by 90° or
/// more, or lose its area, if the ends moved there.
///
/// Costs one walk around each end that moves.
pub fn distance_from_star<S: EdgeStore>(
    mesh: &Mesh<S>,
    geometry: &Geometry,
    e: EdgeId,
    position: Vec3,
) -> Option<f64> {
    let [v, w] = mesh.edge_vertices(e);
    let mut squared = 0.0f64;
    for (end, other) in [(v, w), (w, v)] {
        let point = geometry.position(end);
        if point == position {
            continue;
        }
        let moved = Moved {
            point: point.as_dvec3(),
            position: position.as_dvec3(),
            end,
            other,
        };
        for start in mesh.fans(end) {
            squared = squared.max(moved.distance_squared_from_fan(mesh, geometry, start)?);
        }
    }
    Some(squared.sqrt() * geometry.scale())
}

/// An end of an edge on its way to another place, in model units. (In double precision nothing here
/// overflows for what single precision can hold.)
struct Moved {
    point: DVec3,
    position: DVec3,
    end: VertexId,
    /// The other end.
    other: VertexId,
}

impl Moved {
    /// The largest squared distance from the planes and the boundary lines of a fan; nothing where a
    /// face turns.
    #[inline]
    fn distance_squared_from_fan<S: EdgeStore>(
        &self,
        mesh: &Mesh<S>,
        geometry: &Geometry,
        start: EdgeId,
    ) -> Option<f64> {
        let offset = self.position - self.point;
        let mut a = mesh.head(start);
        let mut at_a = geometry.position(a).as_dvec3();
        let mut largest = self.distance_squared_from_line(mesh, start, at_a);
        let mut last = start;
        for d in mesh.fan(start) {
            last = mesh.prev(d);
            let b = mesh.tail(last);
            let at_b = geometry.position(b).as_dvec3();
            let rim = at_b - at_a;
            let to_a = at_a - self.point;
            let normal = to_a.cross(rim);
            let area_squared = normal.length_squared();
            if area_squared > 0.0 {
                let along = normal.dot(offset);
                largest = largest.max(along * along / area_squared);
            }
            if a != self.other && b != self.other {
                debug_assert!(mesh.tail(d) == self.end);
                let to_a_after = at_a - self.position;
                let after = to_a_after.cross(rim);
                let rim_squared = rim.length_squared();
                let is_thin = |area_squared: f64, to_a: DVec3, to_b: DVec3| {
                    let longest = to_a
                        .length_squared()
                        .max(to_b.length_squared())
                        .max(rim_squared);
                    area_squared <= THIN * THIN * longest * longest
                };
                let turns = normal.dot(after) <= 0.0
                    || is_thin(after.length_squared(), to_a_after, at_b - self.position);
                if turns && !is_thin(area_squared, to_a, at_b - self.point) {
                    return None;
                }
            }
            (a, at_a) = (b, at_b);
        }
        Some(largest.max(self.distance_squared_from_line(mesh, last, at_a)))
    }

    /// The squared distance from the line of `e` between the end and a neighbour, if it is a boundary.
    #[inline]
    fn distance_squared_from_line<S: EdgeStore>(
        &self,
        mesh: &Mesh<S>,
        e: EdgeId,
        neighbour: DVec3,
    ) -> f64 {
        if mesh.opposite(e) != Opposite::Boundary {
            return 0.0;
        }
        let along = neighbour - self.point;
        let length_squared = along.length_squared();
        if length_squared > 0.0 {
            along.cross(self.position - self.point).length_squared() / length_squared
        } else {
            0.0
        }
    }
}
