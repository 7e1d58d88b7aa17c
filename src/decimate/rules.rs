//! What a collapse must not do to the faces around it, and how far it may move away from them.

use glam::Vec3;
use wide::f32x4;

use super::geometry::Geometry;
use crate::mesh::{EdgeId, EdgeStore, Mesh, Opposite, VertexId};

/// A face this thin (twice its area against its longest squared edge) has no direction that single
/// precision could vouch for.
const THIN: f32 = 1e-6;

/// Faces that are looked at together.
const LANES: usize = 4;

/// Faces of a fan that are gathered at a time.
const GATHERED: usize = 4 * LANES;

/// The largest distance of `position` from the planes of the faces and the lines of the boundary
/// edges at both ends of `e`, in the unit box; nothing where a face that stays would turn by 90° or
/// more, or lose its area, if the ends moved there.
///
/// Costs one walk around each end that moves.
#[inline]
pub fn distance_from_star<S: EdgeStore>(
    mesh: &Mesh<S>,
    geometry: &Geometry,
    e: EdgeId,
    position: Vec3,
) -> Option<f32> {
    let [v, w] = mesh.edge_vertices(e);
    let mut faces = Faces::new(geometry);
    for (end, other) in [(v, w), (w, v)] {
        let point = geometry.position(end);
        if point == position {
            continue;
        }
        let offset = geometry.scaled(position - point);
        for start in mesh.fans(end) {
            let from_line = |e: EdgeId, neighbour: VertexId| {
                if mesh.opposite(e) == Opposite::Boundary {
                    let along = geometry.scaled(geometry.position(neighbour) - point);
                    distance_squared_from_line(along, offset)
                } else {
                    0.0
                }
            };
            let first = mesh.head(start);
            let at_first = from_line(start, first);
            faces.begin(point, offset, geometry.position(first), first == other);
            let mut last = (start, first);
            for d in mesh.fan(start) {
                let before = mesh.prev(d);
                let apex = mesh.tail(before);
                faces.add(geometry.position(apex), apex == other)?;
                last = (before, apex);
            }
            faces.look()?;
            faces.squared = faces.squared.max(at_first).max(from_line(last.0, last.1));
        }
    }
    Some(faces.squared.sqrt())
}

fn distance_squared_from_line(along: Vec3, offset: Vec3) -> f32 {
    let length_squared = along.length_squared();
    if length_squared > 0.0 {
        along.cross(offset).length_squared() / length_squared
    } else {
        0.0
    }
}

/// The faces of a fan around a vertex that moves: face i lies between the vertices i and i + 1 of
/// the rim.
struct Faces {
    point: Vec3,
    offset: Vec3,
    scale: f32,
    /// From the vertex to those on the rim, in the unit box; and 1 where the one on the rim is the
    /// edge's other end, so that the faces there go, else 0.
    rim: [[f32; 4]; GATHERED + 1],
    count: usize,
    /// The largest squared distance from their planes so far.
    squared: f32,
}

impl Faces {
    #[inline]
    fn new(geometry: &Geometry) -> Self {
        Self {
            point: Vec3::ZERO,
            offset: Vec3::ZERO,
            scale: geometry.scale() as f32,
            rim: [[0.0; 4]; GATHERED + 1],
            count: 0,
            squared: 0.0,
        }
    }

    #[inline]
    fn place(&self, position: Vec3, is_other: bool) -> [f32; 4] {
        let [x, y, z] = ((position - self.point) * self.scale).to_array();
        [x, y, z, if is_other { 1.0 } else { 0.0 }]
    }

    /// A fan around a vertex at `point` that moves by `offset`, and the first vertex on its rim.
    #[inline]
    fn begin(&mut self, point: Vec3, offset: Vec3, position: Vec3, is_other: bool) {
        (self.point, self.offset, self.count) = (point, offset, 0);
        self.rim[0] = self.place(position, is_other);
    }

    /// The next vertex on the rim, and so a face. Nothing where one before it turns.
    #[inline]
    fn add(&mut self, position: Vec3, is_other: bool) -> Option<()> {
        if self.count == GATHERED {
            self.look()?;
            self.rim[0] = self.rim[GATHERED];
            self.count = 0;
        }
        let place = self.place(position, is_other);
        self.count += 1;
        self.rim[self.count.min(GATHERED)] = place;
        Some(())
    }

    /// Looks at the faces gathered. Nothing where one turns.
    #[inline]
    fn look(&mut self) -> Option<()> {
        // The lanes behind the last face hold faces without area.
        let [x, y, z, _] = self.rim[self.count];
        let padded = self.count.next_multiple_of(LANES);
        for i in self.count + 1..=padded {
            self.rim[i] = [x, y, z, 1.0];
        }
        for first in (0..padded).step_by(LANES) {
            let [a, b, c, d, e] = *self.rim[first..].first_chunk().expect("as many");
            let from = f32x4::transpose([a, b, c, d].map(f32x4::new));
            let to = f32x4::transpose([b, c, d, e].map(f32x4::new));
            self.squared = self.squared.max(distance_squared(&from, &to, self.offset)?);
        }
        Some(())
    }
}

/// The largest squared distance of the place that the vertex moves to, by `offset`, from the planes
/// of the faces between it and `from` and `to`; nothing where one of the faces turns.
#[inline]
fn distance_squared(from: &[f32x4; 4], to: &[f32x4; 4], offset: Vec3) -> Option<f32> {
    let ([ax, ay, az, a_is_other], [bx, by, bz, b_is_other]) = (*from, *to);
    let (a, b) = ([ax, ay, az], [bx, by, bz]);
    let offset = offset.to_array().map(f32x4::splat);
    let rim = minus(&b, &a);
    let normal = cross(&a, &rim);
    let area_squared = dot(&normal, &normal);
    let along = dot(&normal, &offset);
    let has_area = area_squared.simd_gt(f32x4::ZERO);
    let squared = has_area & (along * along / area_squared);
    let (a_after, b_after) = (minus(&a, &offset), minus(&b, &offset));
    let after = cross(&a_after, &rim);
    let rim_squared = dot(&rim, &rim);
    let is_thin = |area_squared: f32x4, a: &[f32x4; 3], b: &[f32x4; 3]| {
        let longest = dot(a, a).fast_max(dot(b, b)).fast_max(rim_squared);
        let thin = f32x4::splat(THIN) * longest;
        area_squared.simd_le(thin * thin)
    };
    let turns = dot(&normal, &after).simd_le(f32x4::ZERO)
        | is_thin(dot(&after, &after), &a_after, &b_after);
    let stays = (a_is_other + b_is_other).simd_eq(f32x4::ZERO);
    let had_shape = !is_thin(area_squared, &a, &b);
    let [p, q, r, s] = squared.to_array();
    let largest = p.max(q).max(r.max(s));
    (!(turns & stays & had_shape).any()).then_some(largest)
}

#[inline(always)]
fn cross(a: &[f32x4; 3], b: &[f32x4; 3]) -> [f32x4; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
fn dot(a: &[f32x4; 3], b: &[f32x4; 3]) -> f32x4 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
fn minus(a: &[f32x4; 3], b: &[f32x4; 3]) -> [f32x4; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}
