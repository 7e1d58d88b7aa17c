//! Where the vertices are, how far they may go, and the unit box in which costs are evaluated.

use glam::{DVec3, Vec3};

use crate::mesh::{EdgeId, EdgeStore, Mesh, VertexId};

/// How far outside of the input's box a vertex may go, of the box's diagonal. Where spikes stand on a
/// sheet, collapses alone would go 34 % out, and with a fit 58 %. On a sphere the corners of 20 faces
/// lie 6 % out with reason, those of 12 faces 11 to 13 %, those of 8 even 24 %.
const OUTSIDE_OF_DIAGONAL: f64 = 0.1;

/// The room that an input gives: the power of two that brings its box into the unit box, and the box,
/// grown, in which all vertices stay.
#[derive(Clone, Copy, Debug)]
pub struct Room {
    scale: f64,
    min: Vec3,
    max: Vec3,
}

impl Room {
    /// The room of an input with a box between these corners.
    pub fn around([min, max]: [Vec3; 2]) -> Self {
        let (min, max) = (min.as_dvec3(), max.as_dvec3());
        let diagonal = (max - min).length();
        let outside = DVec3::splat(OUTSIDE_OF_DIAGONAL * diagonal);
        Self {
            scale: scale_to_unit(diagonal),
            min: (min - outside).as_vec3(),
            max: (max + outside).as_vec3(),
        }
    }

    /// Unit-box lengths per model unit: a power of two.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// Whether a vertex may be there.
    #[inline(always)]
    pub fn contains(&self, p: Vec3) -> bool {
        p.cmpge(self.min).all() && p.cmple(self.max).all()
    }
}

/// Where a vertex is, and how far that may be from the original: aligned, so that both are one load.
#[derive(Clone, Copy)]
#[repr(align(16))]
struct Point([f32; 4]);

impl Point {
    #[inline(always)]
    fn position(&self) -> Vec3 {
        let [x, y, z, _] = self.0;
        Vec3::new(x, y, z)
    }
}

/// Positions in the file's bits, how far each may be from the original, and the room that they have.
///
/// Differences are taken in `f64`, where they are exact, and then scaled by a power of two, which is
/// exact too: so a mesh scaled by 2^k decimates to the same triangles.
pub struct Geometry {
    /// One a vertex slot.
    points: Vec<Point>,
    room: Room,
}

impl Geometry {
    /// The geometry of these positions, in a room; none is known to be away from the original.
    pub fn new(positions: Vec<Vec3>, room: Room) -> Self {
        let points = positions.into_iter().map(|p| Point([p.x, p.y, p.z, 0.0]));
        Self {
            points: points.collect(),
            room,
        }
    }

    /// The geometry of these positions with an estimate, in the unit box, of how far each is from the
    /// original; 0 behind the last estimate.
    pub fn with_deviations(positions: Vec<Vec3>, deviations: &[f32], room: Room) -> Self {
        let mut geometry = Self::new(positions, room);
        for (point, &deviation) in geometry.points.iter_mut().zip(deviations) {
            point.0[3] = deviation;
        }
        geometry
    }

    /// The room of the whole.
    pub fn room(&self) -> &Room {
        &self.room
    }

    /// The stored position of `v`.
    #[inline(always)]
    pub fn position(&self, v: VertexId) -> Vec3 {
        self.points[v.index()].position()
    }

    /// Moves `v`.
    #[inline(always)]
    pub fn set_position(&mut self, v: VertexId, position: Vec3) {
        self.points[v.index()].0[..3].copy_from_slice(&position.to_array());
    }

    /// How far `v` may be from the original, in the unit box.
    #[inline(always)]
    pub fn deviation(&self, v: VertexId) -> f32 {
        self.points[v.index()].0[3]
    }

    /// Sets how far `v` may be from the original, in the unit box.
    #[inline(always)]
    pub fn set_deviation(&mut self, v: VertexId, deviation: f32) {
        self.points[v.index()].0[3] = deviation;
    }

    /// The stored position of `v`, and a fourth number that says nothing of it.
    #[inline(always)]
    pub fn point(&self, v: VertexId) -> [f32; 4] {
        self.points[v.index()].0
    }

    /// The positions, one a vertex slot.
    pub fn positions(&self) -> impl Iterator<Item = Vec3> {
        self.points.iter().map(Point::position)
    }

    /// The deviations, one a vertex slot.
    pub fn deviations(&self) -> impl Iterator<Item = f32> {
        self.points.iter().map(|p| p.0[3])
    }

    /// Unit-box lengths per model unit: a power of two.
    pub fn scale(&self) -> f64 {
        self.room.scale
    }

    /// The vector from a stored position to `v`, in the unit box.
    #[inline(always)]
    pub fn vector(&self, from: Vec3, v: VertexId) -> DVec3 {
        (self.position(v).as_dvec3() - from.as_dvec3()) * self.room.scale
    }

    /// The vector from one vertex to another, in the unit box.
    #[inline(always)]
    pub fn between(&self, from: VertexId, to: VertexId) -> DVec3 {
        self.vector(self.position(from), to)
    }

    /// The stored position nearest to `v` plus a vector in the unit box.
    #[inline(always)]
    pub fn point_near(&self, v: VertexId, offset: DVec3) -> Vec3 {
        (self.position(v).as_dvec3() + offset * self.room.scale.recip()).as_vec3()
    }

    /// A difference of positions, in the unit box.
    #[inline(always)]
    pub fn scaled(&self, difference: Vec3) -> Vec3 {
        difference * self.room.scale as f32
    }

    /// The normal of the face of `e`, twice its area long, in the unit box.
    #[inline(always)]
    pub fn normal<S: EdgeStore>(&self, mesh: &Mesh<S>, e: EdgeId) -> DVec3 {
        let p = self.position(mesh.tail(e));
        self.vector(p, mesh.head(e))
            .cross(self.vector(p, mesh.apex(e)))
    }

    /// The bytes that the positions hold, without the deviations beside them.
    pub fn position_bytes(&self) -> usize {
        self.points.capacity() * size_of::<Vec3>()
    }

    /// The bytes that the deviations hold.
    pub fn deviation_bytes(&self) -> usize {
        self.points.capacity() * size_of::<f32>()
    }
}

/// The power of two that brings a length into [0.5, 1); 1 for no length.
fn scale_to_unit(length: f64) -> f64 {
    if length > 0.0 && length.is_finite() {
        let exponent = (length.to_bits() >> 52) as i64 - 1022;
        f64::from_bits(((1023 - exponent) as u64) << 52)
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A box of 3 × 4 has a diagonal of 5: half a unit is free on each side.
    #[test]
    fn a_room_ends_a_tenth_of_the_diagonal_outside_of_the_box() {
        let room = Room::around([Vec3::new(1.0, 2.0, 7.0), Vec3::new(4.0, 6.0, 7.0)]);
        assert_eq!(room.scale(), 0.125);
        for (x, y, z, is_in) in [
            (2.0, 3.0, 7.0, true),
            (0.5, 6.5, 7.5, true),
            (0.49, 3.0, 7.0, false),
            (2.0, 6.51, 7.0, false),
            (2.0, 3.0, 6.49, false),
            (f32::NAN, 3.0, 7.0, false),
        ] {
            assert_eq!(room.contains(Vec3::new(x, y, z)), is_in, "{x} {y} {z}");
        }
    }

    #[test]
    fn the_scale_is_the_power_of_two_that_fits() {
        for (length, scale) in [(1.0, 0.5), (0.75, 1.0), (100.0, 1.0 / 128.0), (0.0, 1.0)] {
            assert_eq!(scale_to_unit(length), scale, "{length}");
        }
        for length in [1e-45, 3e-39, 1e-20, 1e38, 6e38] {
            assert!(
                (0.5..1.0).contains(&(length * scale_to_unit(length))),
                "{length}"
            );
        }
    }
}
