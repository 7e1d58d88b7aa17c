//! What a collapse must not do to the faces around it, and how far it may move away from them.

use glam::Vec3;
use wide::f32x4;

use super::cost::{cross, dot, minus};
use super::geometry::Geometry;
use crate::mesh::{Disks, EdgeId, EdgeStore, Mesh, Opposite, VertexId};

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
    let mut from_lines = 0.0f32;
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
            from_lines = from_lines.max(at_first).max(from_line(last.0, last.1));
        }
    }
    Some(faces.farthest().max(from_lines.sqrt()))
}

/// [`distance_from_star`] of an edge between two disks.
#[inline]
pub fn distance_from_disks(geometry: &Geometry, disks: &Disks, position: Vec3) -> Option<f32> {
    let mut faces = Faces::new(geometry);
    let [v, w] = disks.ends();
    let [x, y] = disks.apexes();
    let mut has_seen_dying = false;
    for (side, end, other, last) in [(0, v, w, y), (1, w, v, x)] {
        let point = geometry.position(end);
        if point == position {
            continue;
        }
        let mut around = disks.around(side).iter();
        let offset = geometry.scaled(position - point);
        if has_seen_dying {
            let first = around.next().map_or(last, |&first| first);
            faces.begin(point, offset, geometry.position(first), false);
        } else {
            faces.begin(point, offset, geometry.position(other), true);
        }
        for &v in around {
            faces.add(geometry.position(v), false)?;
        }
        faces.add(geometry.position(last), false)?;
        if !has_seen_dying {
            faces.add(geometry.position(other), true)?;
        }
        faces.look()?;
        has_seen_dying = true;
    }
    Some(faces.farthest())
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
    /// The coordinates of each vertex on the rim; and 1 where it is the edge's other end, so that the
    /// faces there go, else 0. Stored and loaded whole, or a load would wait for four stores.
    rim: [[f32; 4]; GATHERED + LANES],
    count: usize,
    /// The largest squared distance from their planes so far, in each lane.
    squared: f32x4,
}

impl Faces {
    #[inline(always)]
    fn new(geometry: &Geometry) -> Self {
        Self {
            point: Vec3::ZERO,
            offset: Vec3::ZERO,
            scale: geometry.scale() as f32,
            rim: [[0.0; 4]; GATHERED + LANES],
            count: 0,
            squared: f32x4::ZERO,
        }
    }

    #[inline(always)]
    fn put(&mut self, i: usize, position: Vec3, is_other: bool) {
        let mark = if is_other { 1.0 } else { 0.0 };
        self.rim[i.min(GATHERED)] = [position.x, position.y, position.z, mark];
    }

    /// A fan around a vertex at `point` that moves by `offset`, and the first vertex on its rim.
    #[inline(always)]
    fn begin(&mut self, point: Vec3, offset: Vec3, position: Vec3, is_other: bool) {
        (self.point, self.offset, self.count) = (point, offset, 0);
        self.put(0, position, is_other);
    }

    /// The next vertex on the rim, and so a face. Nothing where one before it turns.
    #[inline(always)]
    fn add(&mut self, position: Vec3, is_other: bool) -> Option<()> {
        if self.count == GATHERED {
            self.look()?;
            self.rim[0] = self.rim[GATHERED];
            self.count = 0;
        }
        self.count += 1;
        self.put(self.count, position, is_other);
        Some(())
    }

    /// Four vertices of the rim, as seen from the point, in the unit box; and the marks.
    #[inline(always)]
    fn vertices(&self, first: usize) -> [f32x4; 4] {
        let [x, y, z] = self.point.to_array();
        let four: &[_; LANES] = self.rim[first..].first_chunk().expect("as many");
        let [a, b, c, marks] = f32x4::transpose(four.map(f32x4::new));
        let from = |four, origin| (four - f32x4::splat(origin)) * f32x4::splat(self.scale);
        [from(a, x), from(b, y), from(c, z), marks]
    }

    /// The largest distance from the planes of those looked at.
    #[inline(always)]
    fn farthest(&self) -> f32 {
        let [p, q, r, s] = self.squared.to_array();
        p.max(q).max(r.max(s)).sqrt()
    }

    /// Looks at the faces gathered. Nothing where one turns.
    #[inline(always)]
    fn look(&mut self) -> Option<()> {
        // The lanes behind the last face hold faces that go.
        let last = self.count.min(GATHERED);
        let [x, y, z, _] = self.rim[last];
        self.rim[last + 1..last + LANES].fill([x, y, z, 1.0]);
        for first in (0..last).step_by(LANES) {
            let (from, to) = (self.vertices(first), self.vertices(first + 1));
            let squared = distance_squared(&from, &to, self.offset)?;
            self.squared = self.squared.fast_max(squared);
        }
        Some(())
    }
}

/// The squared distances of the place that the vertex moves to, by `offset`, from the planes of the
/// faces between it and `from` and `to`; nothing where one of the faces turns.
#[inline(always)]
fn distance_squared(from: &[f32x4; 4], to: &[f32x4; 4], offset: Vec3) -> Option<f32x4> {
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
    let turns = turns & stays;
    let is_turned = turns.any() && (turns & !is_thin(area_squared, &a, &b)).any();
    (!is_turned).then_some(squared)
}
