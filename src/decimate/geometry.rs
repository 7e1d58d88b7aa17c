//! Where the vertices are, and the unit box in which costs are evaluated.

use glam::{DVec3, Vec3};

use crate::mesh::{EdgeId, EdgeStore, Mesh, VertexId};

/// Positions in the file's bits, and the power of two that brings the mesh into the unit box.
///
/// Differences are taken in `f64`, where they are exact, and then scaled by a power of two, which is
/// exact too: so a mesh scaled by 2^k decimates to the same triangles.
pub struct Geometry {
    positions: Vec<Vec3>,
    scale: f64,
}

impl Geometry {
    /// The geometry of these positions, at a scale.
    pub fn new(positions: Vec<Vec3>, scale: f64) -> Self {
        Self { positions, scale }
    }

    /// The stored position of `v`.
    #[inline(always)]
    pub fn position(&self, v: VertexId) -> Vec3 {
        self.positions[v.index()]
    }

    /// Moves `v`.
    pub fn set_position(&mut self, v: VertexId, position: Vec3) {
        self.positions[v.index()] = position;
    }

    /// The positions, one a vertex slot.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// The positions, one a vertex slot.
    pub fn into_positions(self) -> Vec<Vec3> {
        self.positions
    }

    /// Unit-box lengths per model unit: a power of two.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// The vector from a stored position to `v`, in the unit box.
    #[inline(always)]
    pub fn vector(&self, from: Vec3, v: VertexId) -> DVec3 {
        (self.position(v).as_dvec3() - from.as_dvec3()) * self.scale
    }

    /// The vector from one vertex to another, in the unit box.
    #[inline(always)]
    pub fn between(&self, from: VertexId, to: VertexId) -> DVec3 {
        self.vector(self.position(from), to)
    }

    /// The stored position nearest to `v` plus a vector in the unit box.
    #[inline(always)]
    pub fn point_near(&self, v: VertexId, offset: DVec3) -> Vec3 {
        (self.position(v).as_dvec3() + offset * self.scale.recip()).as_vec3()
    }

    /// A difference of positions, in the unit box.
    #[inline(always)]
    pub fn scaled(&self, difference: Vec3) -> Vec3 {
        difference * self.scale as f32
    }

    /// The normal of the face of `e`, twice its area long, in the unit box.
    #[inline(always)]
    pub fn normal<S: EdgeStore>(&self, mesh: &Mesh<S>, e: EdgeId) -> DVec3 {
        let p = self.position(mesh.tail(e));
        self.vector(p, mesh.head(e))
            .cross(self.vector(p, mesh.apex(e)))
    }

    /// The bytes that the positions hold.
    pub fn bytes(&self) -> usize {
        self.positions.capacity() * size_of::<Vec3>()
    }
}

/// The power of two that brings a length into [0.5, 1); 1 for no length.
pub fn scale_to_unit(length: f64) -> f64 {
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
