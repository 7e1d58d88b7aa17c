//! Energies of edges and where they are least, in any kind of number: one edge in double precision
//! or four in single.

use std::ops::{Add, Div, Mul, Sub};

use wide::f32x4;

use super::TIE_BREAK;

/// Edges that are evaluated together.
pub const LANES: usize = 4;

/// One edge's number, or one of each of several edges.
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// A yes or no for each.
    type Mask: Copy;

    /// The same number for all.
    fn splat(x: f64) -> Self;

    /// Whether the first is greater. No, where one is no number.
    fn greater(self, other: Self) -> Self::Mask;

    /// The first where `yes`, elsewhere the second.
    fn choose(yes: Self::Mask, a: Self, b: Self) -> Self;
}

impl Number for f64 {
    type Mask = bool;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }

    #[inline(always)]
    fn greater(self, other: Self) -> bool {
        self > other
    }

    #[inline(always)]
    fn choose(yes: bool, a: Self, b: Self) -> Self {
        if yes { a } else { b }
    }
}

/// Four edges' numbers.
pub type Lanes = f32x4;

impl Number for Lanes {
    type Mask = Self;

    #[inline(always)]
    fn splat(x: f64) -> Self {
        f32x4::splat(x as f32)
    }

    #[inline(always)]
    fn greater(self, other: Self) -> Self {
        self.simd_gt(other)
    }

    #[inline(always)]
    fn choose(yes: Self, a: Self, b: Self) -> Self {
        yes.bitselect(a, b)
    }
}

/// x, y, z.
pub type Vector<T> = [T; 3];

/// A symmetric matrix: xx, xy, xz, yy, yz, zz.
pub type Matrix<T> = [T; 6];

#[inline(always)]
pub fn dot<T: Number>(a: &Vector<T>, b: &Vector<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub fn plus<T: Number, const N: usize>(a: &[T; N], b: &[T; N]) -> [T; N] {
    std::array::from_fn(|i| a[i] + b[i])
}

#[inline(always)]
pub fn cross<T: Number>(a: &Vector<T>, b: &Vector<T>) -> Vector<T> {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[inline(always)]
pub fn minus<T: Number, const N: usize>(a: &[T; N], b: &[T; N]) -> [T; N] {
    std::array::from_fn(|i| a[i] - b[i])
}

#[inline(always)]
pub fn scaled<T: Number, const N: usize>(a: &[T; N], s: T) -> [T; N] {
    std::array::from_fn(|i| a[i] * s)
}

#[inline(always)]
pub fn times<T: Number>(m: &Matrix<T>, v: &Vector<T>) -> Vector<T> {
    let [xx, xy, xz, yy, yz, zz] = *m;
    [
        xx * v[0] + xy * v[1] + xz * v[2],
        xy * v[0] + yy * v[1] + yz * v[2],
        xz * v[0] + yz * v[1] + zz * v[2],
    ]
}

/// An edge's energy, E(x) = xᵀMx − 2bᵀx + c, with x from the tail.
pub struct Form<T> {
    pub m: Matrix<T>,
    pub b: Vector<T>,
    pub at_tail: T,
    /// From the tail to the head.
    pub along: Vector<T>,
}

/// L D Lᵀ of a symmetric matrix with a ridge. Stable where the adjugate is not: the ridge may be as
/// small as the precision allows.
pub struct Factor<T> {
    l10: T,
    l20: T,
    l21: T,
    inverse_d: Vector<T>,
}

impl<T: Number> Factor<T> {
    /// Of m + ridge·I, m positive semidefinite: no pivot is below the ridge, whatever the noise.
    #[inline(always)]
    pub fn of(m: &Matrix<T>, ridge: T) -> Self {
        let [xx, xy, xz, yy, yz, zz] = *m;
        let inverse = |pivot: T| T::splat(1.0) / T::choose(pivot.greater(ridge), pivot, ridge);
        let inverse_d0 = inverse(xx + ridge);
        let l10 = xy * inverse_d0;
        let l20 = xz * inverse_d0;
        let inverse_d1 = inverse(yy + ridge - l10 * xy);
        let s21 = yz - l20 * xy;
        let l21 = s21 * inverse_d1;
        let inverse_d2 = inverse(zz + ridge - l20 * xz - l21 * s21);
        Self {
            l10,
            l20,
            l21,
            inverse_d: [inverse_d0, inverse_d1, inverse_d2],
        }
    }

    #[inline(always)]
    pub fn solve(&self, b: &Vector<T>) -> Vector<T> {
        let y = b[1] - self.l10 * b[0];
        let z = b[2] - self.l20 * b[0] - self.l21 * y;
        let z = z * self.inverse_d[2];
        let y = y * self.inverse_d[1] - self.l21 * z;
        let x = b[0] * self.inverse_d[0] - self.l10 * y - self.l20 * z;
        [x, y, z]
    }
}

/// Where an edge's energy is least.
pub struct Least<T: Number> {
    pub x: Vector<T>,
    pub at_x: T,
    pub at_tail: T,
    pub at_head: T,
    /// Whether the head is cheaper than the tail.
    pub head_is_better: T::Mask,
    /// Whether x is cheaper than both ends by more than noise.
    pub x_is_better: T::Mask,
    /// The squared length of the edge.
    pub length_squared: T,
}

impl<T: Number> Least<T> {
    /// What the collapse costs where no end is held.
    #[inline(always)]
    pub fn costs(&self) -> T {
        let at_end = T::choose(self.head_is_better, self.at_head, self.at_tail);
        let energy = T::choose(self.x_is_better, self.at_x, at_end);
        let zero = T::splat(0.0);
        let energy = T::choose(energy.greater(zero), energy, zero);
        energy + T::splat(TIE_BREAK) * self.length_squared
    }
}

/// How far the optimum may lie from the middle, in lengths of the edge.
const REACH: f64 = 3.0;

impl<T: Number> Form<T> {
    /// The sum of xᵀVx, centred at the tail, and the same of W, centred at the head.
    #[inline(always)]
    pub fn of_ends(v: &Matrix<T>, w: &Matrix<T>, along: Vector<T>) -> Self {
        let b = times(w, &along);
        Self {
            m: plus(v, w),
            at_tail: dot(&along, &b),
            b,
            along,
        }
    }

    #[inline(always)]
    fn energy(&self, x: &Vector<T>) -> T {
        let mx = times(&self.m, x);
        let twice_b = plus(&self.b, &self.b);
        dot(x, &minus(&mx, &twice_b)) + self.at_tail
    }

    #[inline(always)]
    pub fn trace(&self) -> T {
        self.m[0] + self.m[3] + self.m[5]
    }

    /// Where the energy is least, held near the middle where it is flat, by the adjugate: the ridge
    /// has to be some digits above the precision's noise. Not near where there is no such place.
    #[inline(always)]
    pub fn least_near_middle(&self) -> Vector<T> {
        /// Relative to the trace: what is this much flatter is taken to be flat.
        const RIDGE: f64 = 1e-4;
        // A trace of 1 keeps the determinant in range.
        let inverse_trace = T::splat(1.0) / self.trace();
        let [xx, xy, xz, yy, yz, zz] = scaled(&self.m, inverse_trace);
        let ridge = T::splat(RIDGE);
        let (xx, yy, zz) = (xx + ridge, yy + ridge, zz + ridge);
        let adjugate = [
            yy * zz - yz * yz,
            xz * yz - xy * zz,
            xy * yz - xz * yy,
            xx * zz - xz * xz,
            xy * xz - xx * yz,
            xx * yy - xy * xy,
        ];
        let determinant = xx * adjugate[0] + xy * adjugate[1] + xz * adjugate[2];
        let b = scaled(&self.b, inverse_trace);
        let b = plus(&b, &scaled(&self.along, T::splat(0.5) * ridge));
        scaled(&times(&adjugate, &b), T::splat(1.0) / determinant)
    }

    /// The energies at both ends and at `x`, or at the middle where `x` is not near.
    ///
    /// An end is as good as `x` where it costs no more than `as_good` more, relative to the trace
    /// times the squared length of the edge.
    #[inline(always)]
    pub fn compared(&self, x: &Vector<T>, as_good: f64) -> Least<T> {
        let length_squared = dot(&self.along, &self.along);
        let middle = scaled(&self.along, T::splat(0.5));
        let from_middle = minus(x, &middle);
        let reach = T::splat(REACH * REACH) * length_squared;
        let is_near = reach.greater(dot(&from_middle, &from_middle));
        let x = std::array::from_fn(|i| T::choose(is_near, x[i], middle[i]));
        let at_x = self.energy(&x);
        let (at_tail, at_head) = (self.at_tail, self.energy(&self.along));
        let head_is_better = at_tail.greater(at_head);
        let at_end = T::choose(head_is_better, at_head, at_tail);
        let margin = T::splat(as_good) * self.trace() * length_squared;
        Least {
            x,
            at_x,
            at_tail,
            at_head,
            head_is_better,
            x_is_better: at_end.greater(at_x + margin),
            length_squared,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two planes that meet in a line, and a third across: the least is where the three meet.
    fn the_least_lies_where_the_planes_meet<T: Number>(lane: impl Fn(T) -> f64) {
        // Through the tail: x = 0 and y = 0; through the head, at (1, 2, 3): z = 3.
        let v = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0].map(T::splat);
        let w = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0].map(T::splat);
        let form = Form::of_ends(&v, &w, [1.0, 2.0, 3.0].map(T::splat));
        let least = form.compared(&form.least_near_middle(), 1e-7);
        for (x, expected) in least.x.into_iter().zip([0.0, 0.0, 3.0]) {
            assert!((lane(x) - expected).abs() < 1e-3, "{}", lane(x));
        }
        assert!(lane(least.at_x).abs() < 1e-5, "{}", lane(least.at_x));
        assert!((lane(least.at_tail) - 9.0).abs() < 1e-5);
        assert!((lane(least.at_head) - 5.0).abs() < 1e-5);
    }

    #[test]
    fn the_least_lies_where_the_planes_meet_in_any_number() {
        the_least_lies_where_the_planes_meet::<f64>(|x| x);
        the_least_lies_where_the_planes_meet::<Lanes>(|x| x.to_array()[2].into());
    }
}
