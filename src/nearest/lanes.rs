//! Nearest points of triangles, four at a time in single precision.
//!
//! All is computed from differences of the points given, so that what single precision loses is
//! relative to the triangle's size and not to where it is. Coordinates should be those of the unit
//! box: fourth powers of lengths are formed.

use glam::{BVec4A, Vec3, Vec4};

/// Four points or vectors.
#[derive(Clone, Copy, Debug, Default)]
pub struct Points {
    /// The first coordinates.
    pub x: Vec4,
    /// The second coordinates.
    pub y: Vec4,
    /// The third coordinates.
    pub z: Vec4,
}

impl Points {
    /// The same point four times.
    #[inline(always)]
    pub fn splat(p: Vec3) -> Self {
        Self {
            x: Vec4::splat(p.x),
            y: Vec4::splat(p.y),
            z: Vec4::splat(p.z),
        }
    }

    /// Four points.
    #[inline(always)]
    pub fn of(p: [Vec3; 4]) -> Self {
        Self {
            x: Vec4::from(p.map(|p| p.x)),
            y: Vec4::from(p.map(|p| p.y)),
            z: Vec4::from(p.map(|p| p.z)),
        }
    }

    /// The point in a lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> Vec3 {
        Vec3::new(self.x[lane], self.y[lane], self.z[lane])
    }

    /// Puts a point into a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, p: Vec3) {
        (self.x[lane], self.y[lane], self.z[lane]) = (p.x, p.y, p.z);
    }

    /// The smaller of each coordinate.
    #[inline(always)]
    pub fn min(&self, o: &Self) -> Self {
        Self {
            x: self.x.min(o.x),
            y: self.y.min(o.y),
            z: self.z.min(o.z),
        }
    }

    /// The larger of each coordinate.
    #[inline(always)]
    pub fn max(&self, o: &Self) -> Self {
        Self {
            x: self.x.max(o.x),
            y: self.y.max(o.y),
            z: self.z.max(o.z),
        }
    }

    /// The dot products.
    #[inline(always)]
    pub fn dot(&self, o: &Self) -> Vec4 {
        self.x * o.x + self.y * o.y + self.z * o.z
    }

    #[inline(always)]
    fn cross(&self, o: &Self) -> Self {
        Self {
            x: self.y * o.z - self.z * o.y,
            y: self.z * o.x - self.x * o.z,
            z: self.x * o.y - self.y * o.x,
        }
    }

    /// The differences.
    #[inline(always)]
    pub fn minus(&self, o: &Self) -> Self {
        Self {
            x: self.x - o.x,
            y: self.y - o.y,
            z: self.z - o.z,
        }
    }

    /// Each times a number of its own.
    #[inline(always)]
    pub fn times(&self, s: Vec4) -> Self {
        Self {
            x: self.x * s,
            y: self.y * s,
            z: self.z * s,
        }
    }

    #[inline(always)]
    fn select(mask: BVec4A, a: &Self, b: &Self) -> Self {
        Self {
            x: Vec4::select(mask, a.x, b.x),
            y: Vec4::select(mask, a.y, b.y),
            z: Vec4::select(mask, a.z, b.z),
        }
    }
}

/// Four triangles, ready to be asked for nearest points; degenerate ones are segments and points.
#[derive(Clone, Copy, Debug)]
pub struct Faces {
    origin: Points,
    sides: [Points; 2],
    /// Of length one.
    pub normal: Points,
    /// What gives the coordinates along the two sides.
    dual: [Points; 2],
    /// The inverse squared lengths of the sides and of the third.
    inverse: [Vec4; 3],
}

/// Nearest points.
#[derive(Clone, Copy, Debug)]
pub struct Feet {
    /// From the nearest point.
    pub offset: Points,
    /// The barycentric coordinates of the second and third corner; zero, exactly, for one that the
    /// point lies across from.
    pub weights: [Vec4; 2],
    /// Where the point lies above the triangle and not beside it.
    pub is_inside: BVec4A,
    /// The squared distances.
    pub squared: Vec4,
}

#[inline(always)]
fn inverse_or_zero(x: Vec4) -> Vec4 {
    Vec4::select(x.cmpgt(Vec4::ZERO), Vec4::ONE / x, Vec4::ZERO)
}

impl Faces {
    /// Triangles by their corners.
    #[inline(always)]
    pub fn of([a, b, c]: &[Points; 3]) -> Self {
        let sides = [b.minus(a), c.minus(a)];
        let normal = sides[0].cross(&sides[1]);
        let squared = normal.dot(&normal);
        // Where there is no plane, nothing is above it.
        let per_square = Vec4::select(
            squared.cmpgt(Vec4::ZERO),
            Vec4::ONE / squared,
            Vec4::splat(f32::NAN),
        );
        let third = sides[1].minus(&sides[0]);
        let length = Vec4::from(squared.to_array().map(f32::sqrt));
        Self {
            origin: *a,
            sides,
            normal: normal.times(inverse_or_zero(length)),
            dual: [
                sides[1].cross(&normal).times(per_square),
                normal.cross(&sides[0]).times(per_square),
            ],
            inverse: [
                inverse_or_zero(sides[0].dot(&sides[0])),
                inverse_or_zero(sides[1].dot(&sides[1])),
                inverse_or_zero(third.dot(&third)),
            ],
        }
    }

    /// One triangle four times.
    #[inline(always)]
    pub fn splat(corners: [Vec3; 3]) -> Self {
        Self::of(&corners.map(Points::splat))
    }

    /// The points of the triangles nearest to these.
    #[inline(always)]
    pub fn feet(&self, p: &Points) -> Feet {
        let q = p.minus(&self.origin);
        let [v, w] = [q.dot(&self.dual[0]), q.dot(&self.dual[1])];
        let zero = Vec4::ZERO;
        let is_inside = v.cmpgt(zero) & w.cmpgt(zero) & (v + w).cmplt(Vec4::ONE);
        let height = q.dot(&self.normal);
        let above = self.normal.times(height);
        if is_inside.all() {
            return Feet {
                offset: above,
                weights: [v, w],
                is_inside,
                squared: height * height,
            };
        }
        let clamp = |t: Vec4| t.max(zero).min(Vec4::ONE);
        let [first, second] = self.sides;
        let t = clamp(q.dot(&first) * self.inverse[0]);
        let mut offset = q.minus(&first.times(t));
        let mut squared = offset.dot(&offset);
        let mut weights = [t, zero];
        let mut take = |other: Points, at: [Vec4; 2]| {
            let there = other.dot(&other);
            let is_nearer = there.cmplt(squared);
            squared = Vec4::select(is_nearer, there, squared);
            offset = Points::select(is_nearer, &other, &offset);
            weights = [0, 1].map(|k| Vec4::select(is_nearer, at[k], weights[k]));
        };
        let t = clamp(q.dot(&second) * self.inverse[1]);
        take(q.minus(&second.times(t)), [zero, t]);
        let third = second.minus(&first);
        let from_second = q.minus(&first);
        let t = clamp(from_second.dot(&third) * self.inverse[2]);
        take(from_second.minus(&third.times(t)), [Vec4::ONE - t, t]);
        Feet {
            offset: Points::select(is_inside, &above, &offset),
            weights: [
                Vec4::select(is_inside, v, weights[0]),
                Vec4::select(is_inside, w, weights[1]),
            ],
            is_inside,
            squared: Vec4::select(is_inside, height * height, squared),
        }
    }
}
