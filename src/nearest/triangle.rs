//! The nearest point of one triangle.

use glam::DVec3;

/// A nearest point and where it is.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Nearest {
    /// The point.
    pub point: DVec3,
    /// Its squared distance.
    pub distance_squared: f64,
    /// The triangle that it lies on, by its index in the list.
    pub triangle: u32,
    /// Where the set keeps that triangle: a guess for the next search nearby.
    pub slot: u32,
}

impl Nearest {
    /// No point yet: farther than any.
    pub(super) fn none() -> Self {
        Self {
            point: DVec3::NAN,
            distance_squared: f64::INFINITY,
            triangle: u32::MAX,
            slot: u32::MAX,
        }
    }
}

/// The nearest point of one triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Foot {
    /// The point.
    pub point: DVec3,
    /// Its barycentric coordinates; zero, exactly, for a corner that it is across from.
    pub weights: [f64; 3],
}

impl Foot {
    /// Whether the point lies on no side of the triangle.
    pub fn is_inside(&self) -> bool {
        self.weights.iter().all(|&w| w > 0.0)
    }
}

/// The point of a triangle (or of the segment or point that it degenerates to) nearest to `p`.
#[inline]
pub fn nearest_on_triangle(p: DVec3, triangle: &[DVec3; 3]) -> DVec3 {
    foot_on_triangle(p, triangle).point
}

/// [`nearest_on_triangle`] with its barycentric coordinates (Ericson 2005, *Real-Time Collision
/// Detection*, 5.1.5).
#[inline(always)]
pub fn foot_on_triangle(p: DVec3, &[a, b, c]: &[DVec3; 3]) -> Foot {
    let foot = |point, weights| Foot { point, weights };
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return foot(a, [1.0, 0.0, 0.0]);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return foot(b, [0.0, 1.0, 0.0]);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return foot(a + ab * t, [1.0 - t, t, 0.0]);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return foot(c, [0.0, 0.0, 1.0]);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return foot(a + ac * t, [1.0 - t, 0.0, t]);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return foot(b + (c - b) * t, [0.0, 1.0 - t, t]);
    }
    let denominator = va + vb + vc;
    let (v, w) = (vb / denominator, vc / denominator);
    let point = a + ab * v + ac * w;
    if point.is_finite() {
        foot(point, [1.0 - v - w, v, w])
    } else {
        foot_on_sides(p, &[a, b, c])
    }
}

/// The nearest point of the three sides: for triangles so thin that their plane is noise.
#[cold]
fn foot_on_sides(p: DVec3, corners: &[DVec3; 3]) -> Foot {
    let mut best = Foot {
        point: corners[0],
        weights: [1.0, 0.0, 0.0],
    };
    for i in 0..3 {
        let j = (i + 1) % 3;
        let along = corners[j] - corners[i];
        let t = along.dot(p - corners[i]) / along.length_squared();
        let t = if t.is_finite() {
            t.clamp(0.0, 1.0)
        } else {
            0.0
        };
        let point = corners[i] + along * t;
        if point.distance_squared(p) < best.point.distance_squared(p) {
            let mut weights = [0.0; 3];
            (weights[i], weights[j]) = (1.0 - t, t);
            best = Foot { point, weights };
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One point before each corner, side and the inside of a right triangle.
    #[test]
    fn every_region_has_its_nearest_point() {
        let t = [DVec3::ZERO, DVec3::X, DVec3::Y];
        for (p, nearest) in [
            ([-1., -1., 2.], [0., 0., 0.]),
            ([2., -1., 0.], [1., 0., 0.]),
            ([-1., 3., 0.], [0., 1., 0.]),
            ([0.4, -1., 1.], [0.4, 0., 0.]),
            ([-2., 0.25, 0.], [0., 0.25, 0.]),
            ([1., 1., 5.], [0.5, 0.5, 0.]),
            ([0.25, 0.25, -3.], [0.25, 0.25, 0.]),
        ] {
            let found = nearest_on_triangle(p.into(), &t);
            assert!(
                (found - DVec3::from(nearest)).length() < 1e-15,
                "{p:?}: {found}"
            );
        }
    }

    /// A segment and a point are triangles too.
    #[test]
    fn degenerate_triangles_have_nearest_points() {
        let p = DVec3::new(0.5, 1.0, 0.0);
        for t in [
            [DVec3::ZERO, DVec3::X, DVec3::X],
            [DVec3::ZERO, DVec3::X, DVec3::ZERO],
        ] {
            assert_eq!(nearest_on_triangle(p, &t), DVec3::new(0.5, 0.0, 0.0));
        }
        assert_eq!(nearest_on_triangle(p, &[DVec3::Z; 3]), DVec3::Z);
    }
}
