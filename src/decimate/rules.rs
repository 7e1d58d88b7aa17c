//! What a collapse must not do to the faces around it, and how far it may move away from them.

use glam::Vec3;
use wide::{f32x4, i32x4};

use super::cost::{cross, dot, minus};
use super::geometry::Geometry;
use crate::mesh::{Disks, EdgeId, EdgeStore, Mesh, Opposite, VertexId};

/// A face this thin (twice its area against its longest squared edge) has no direction that single
/// precision could vouch for.
const THIN: f32 = 1e-6;

/// Faces that are looked at together.
const LANES: usize = 4;

/// Faces of a fan that are gathered at a time: all around an end of [`Disks`].
const GATHERED: usize = 20;

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
) -> Option<f32> {
    let [v, w] = mesh.edge_vertices(e);
    let mut faces = Faces::new(geometry, position);
    let mut from_lines = 0.0f32;
    for (end, other) in [(v, w), (w, v)] {
        let point = geometry.position(end);
        if point == position {
            continue;
        }
        faces.of(end, other);
        for start in mesh.fans(end) {
            let from_line = |e: EdgeId, neighbour: VertexId| {
                if mesh.opposite(e) == Opposite::Boundary {
                    let along = geometry.scaled(geometry.position(neighbour) - point);
                    distance_squared_from_line(along, geometry.scaled(position - point))
                } else {
                    0.0
                }
            };
            let first = mesh.head(start);
            let at_first = from_line(start, first);
            (faces.rim[0], faces.count) = (first, 0);
            let mut last = (start, first);
            for d in mesh.fan(start) {
                let before = mesh.prev(d);
                let apex = mesh.tail(before);
                faces.add(apex)?;
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
    let mut faces = Faces::new(geometry, position);
    let [v, w] = disks.ends();
    let [x, y] = disks.apexes();
    let [v_moves, w_moves] = [v, w].map(|end| geometry.position(end) != position);
    if v_moves {
        faces.of(v, w);
        faces.gather(disks, 0, y);
        faces.gather_dying(x);
        faces.look()?;
    }
    if w_moves {
        faces.of(w, v);
        faces.gather(disks, 1, x);
        if !v_moves {
            faces.gather_dying(y);
        }
        faces.look()?;
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
struct Faces<'a> {
    geometry: &'a Geometry,
    position: Vec3,
    point: Vec3,
    /// The edge's other end: the faces there go.
    other: VertexId,
    rim: [VertexId; GATHERED + LANES],
    count: usize,
    /// The largest squared distance from their planes so far, in each lane.
    squared: f32x4,
}

impl<'a> Faces<'a> {
    #[inline(always)]
    fn new(geometry: &'a Geometry, position: Vec3) -> Self {
        Self {
            geometry,
            position,
            point: position,
            other: VertexId::new(0),
            rim: [VertexId::new(0); GATHERED + LANES],
            count: 0,
            squared: f32x4::ZERO,
        }
    }

    /// Those of an end that moves.
    #[inline(always)]
    fn of(&mut self, end: VertexId, other: VertexId) {
        (self.point, self.other) = (self.geometry.position(end), other);
    }

    /// The faces around an end of an edge between disks but those that go, up to the apex before the
    /// edge.
    #[inline(always)]
    fn gather(&mut self, disks: &Disks, end: usize, last: VertexId) {
        let (around, count) = disks.around(end);
        self.rim[..around.len()].copy_from_slice(around);
        self.rim[count] = last;
        self.count = count;
    }

    /// And the two behind those that go.
    #[inline(always)]
    fn gather_dying(&mut self, first: VertexId) {
        self.rim[self.count + 1] = self.other;
        self.rim[self.count + 2] = first;
        self.count += 2;
    }

    /// The next vertex on the rim, and so a face. Nothing where one before it turns.
    fn add(&mut self, vertex: VertexId) -> Option<()> {
        if self.count == GATHERED {
            self.look()?;
            self.rim[0] = self.rim[GATHERED];
            self.count = 0;
        }
        self.count += 1;
        self.rim[self.count] = vertex;
        Some(())
    }

    /// Four points, as seen from the one that moves, in the unit box.
    #[inline(always)]
    fn seen(&self, points: [f32x4; LANES]) -> [f32x4; 3] {
        let [x, y, z] = self.point.to_array().map(f32x4::splat);
        let scale = f32x4::splat(self.geometry.scale() as f32);
        let [a, b, c, _] = f32x4::transpose(points);
        [(a - x) * scale, (b - y) * scale, (c - z) * scale]
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
        // The lanes behind the last face hold faces without area.
        let last = self.rim[self.count];
        self.rim[self.count + 1..][..LANES - 1].fill(last);
        let offset = self.geometry.scaled(self.position - self.point);
        for first in (0..self.count).step_by(LANES) {
            let &[a, b, c, d, e] = self.rim[first..].first_chunk().expect("as many");
            let at = |v| f32x4::new(self.geometry.point(v));
            let [p, q, r, s, t] = [at(a), at(b), at(c), at(d), at(e)];
            let (from, to) = (self.seen([p, q, r, s]), self.seen([q, r, s, t]));
            let is_other = |[a, b, c, d]: [VertexId; LANES]| {
                let id = |v: VertexId| v.index() as i32;
                let ids = i32x4::new([id(a), id(b), id(c), id(d)]);
                ids.simd_eq(i32x4::splat(id(self.other)))
            };
            let goes = f32x4::from_i32x4(is_other([a, b, c, d]) | is_other([b, c, d, e]));
            let squared = distance_squared(&from, &to, goes, offset)?;
            self.squared = self.squared.fast_max(squared);
        }
        Some(())
    }
}

/// The squared distances of the place that the vertex moves to, by `offset`, from the planes of the
/// faces between it and `a` and `b`; nothing where one of the faces turns that does not go.
#[inline(always)]
fn distance_squared(a: &[f32x4; 3], b: &[f32x4; 3], goes: f32x4, offset: Vec3) -> Option<f32x4> {
    let offset = offset.to_array().map(f32x4::splat);
    let rim = minus(b, a);
    let normal = cross(a, &rim);
    let area_squared = dot(&normal, &normal);
    let along = dot(&normal, &offset);
    let has_area = area_squared.simd_gt(f32x4::ZERO);
    let squared = has_area & (along * along / area_squared);
    let (a_after, b_after) = (minus(a, &offset), minus(b, &offset));
    let after = cross(&a_after, &rim);
    let rim_squared = dot(&rim, &rim);
    let is_thin = |area_squared: f32x4, a: &[f32x4; 3], b: &[f32x4; 3]| {
        let longest = dot(a, a).fast_max(dot(b, b)).fast_max(rim_squared);
        let thin = f32x4::splat(THIN) * longest;
        area_squared.simd_le(thin * thin)
    };
    let turns = dot(&normal, &after).simd_le(f32x4::ZERO)
        | is_thin(dot(&after, &after), &a_after, &b_after);
    let turns = turns & goes.simd_eq(f32x4::ZERO);
    // Both asked of all: whether a lane behind the last face turns, no branch would foresee.
    let is_turned = (turns & !is_thin(area_squared, a, b)).any();
    (!is_turned).then_some(squared)
}
