//! Energies of edges, four at a time, and where they are least.

use glam::DVec3;
use wide::f64x4;

use super::{AS_GOOD, Evaluation, REACH, TIE_BREAK};
use crate::decimate::options::Placement;
use crate::decimate::surface::Surface;
use crate::mesh::{EdgeStore, VertexId};

/// Edges that are evaluated together.
pub const LANES: usize = 4;

/// One number a lane.
pub type Lanes = f64x4;

/// One vector a lane: x, y, z.
pub type Vectors = [Lanes; 3];

/// One symmetric matrix a lane: xx, xy, xz, yy, yz, zz.
pub type Symmetrics = [Lanes; 6];

/// The numbers of all lanes, from each lane's.
#[inline(always)]
pub fn transposed<const N: usize>(lanes: [[f64; N]; LANES]) -> [Lanes; N] {
    std::array::from_fn(|i| Lanes::from(std::array::from_fn::<_, LANES, _>(|lane| lanes[lane][i])))
}

#[inline(always)]
pub fn dot(a: &Vectors, b: &Vectors) -> Lanes {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[inline(always)]
pub fn plus<const N: usize>(a: &[Lanes; N], b: &[Lanes; N]) -> [Lanes; N] {
    std::array::from_fn(|i| a[i] + b[i])
}

#[inline(always)]
pub fn minus(a: &Vectors, b: &Vectors) -> Vectors {
    std::array::from_fn(|i| a[i] - b[i])
}

#[inline(always)]
pub fn scaled(a: &Vectors, s: Lanes) -> Vectors {
    std::array::from_fn(|i| a[i] * s)
}

#[inline(always)]
pub fn times(m: &Symmetrics, v: &Vectors) -> Vectors {
    let [xx, xy, xz, yy, yz, zz] = *m;
    [
        xx * v[0] + xy * v[1] + xz * v[2],
        xy * v[0] + yy * v[1] + yz * v[2],
        xz * v[0] + yz * v[1] + zz * v[2],
    ]
}

/// Where `yes` is set, a, elsewhere b.
#[inline(always)]
pub fn select<const N: usize>(yes: Lanes, a: &[Lanes; N], b: &[Lanes; N]) -> [Lanes; N] {
    std::array::from_fn(|i| yes.bitselect(a[i], b[i]))
}

/// L D Lᵀ of positive definite symmetric matrices. Stable where the adjugate is not: the ridge may
/// be eight digits below the trace.
pub struct Factors {
    l10: Lanes,
    l20: Lanes,
    l21: Lanes,
    inverse_d: Vectors,
    is_positive: Lanes,
}

impl Factors {
    #[inline(always)]
    pub fn of(m: &Symmetrics, ridge: Lanes) -> Self {
        let (one, zero) = (Lanes::splat(1.0), Lanes::splat(0.0));
        let [xx, xy, xz, yy, yz, zz] = *m;
        let d0 = xx + ridge;
        let inverse_d0 = one / d0;
        let l10 = xy * inverse_d0;
        let l20 = xz * inverse_d0;
        let d1 = yy + ridge - l10 * xy;
        let inverse_d1 = one / d1;
        let s21 = yz - l20 * xy;
        let l21 = s21 * inverse_d1;
        let d2 = zz + ridge - l20 * xz - l21 * s21;
        Self {
            l10,
            l20,
            l21,
            inverse_d: [inverse_d0, inverse_d1, one / d2],
            is_positive: d0.simd_gt(zero) & d1.simd_gt(zero) & d2.simd_gt(zero),
        }
    }

    #[inline(always)]
    pub fn solve(&self, b: &Vectors) -> Vectors {
        let y = b[1] - self.l10 * b[0];
        let z = b[2] - self.l20 * b[0] - self.l21 * y;
        let [x, y, z] = [b[0], y, z];
        let [dx, dy, dz] = self.inverse_d;
        let (x, y, z) = (x * dx, y * dy, z * dz);
        let y = y - self.l21 * z;
        [x - self.l10 * y - self.l20 * z, y, z]
    }

    /// Where the matrix was positive definite.
    #[inline(always)]
    pub fn is_positive(&self) -> Lanes {
        self.is_positive
    }
}

/// The energies of edges, E(x) = xᵀMx − 2bᵀx + c, with x from the tail.
pub struct Forms {
    pub m: Symmetrics,
    pub b: Vectors,
    pub at_tail: Lanes,
    /// From the tail to the head.
    pub along: Vectors,
}

impl Forms {
    /// The sum of xᵀVx, centred at the tail, and the same of W, centred at the head.
    #[inline(always)]
    pub fn of_ends(v: &Symmetrics, w: &Symmetrics, along: Vectors) -> Self {
        let b = times(w, &along);
        Self {
            m: plus(v, w),
            at_tail: dot(&along, &b),
            b,
            along,
        }
    }

    #[inline(always)]
    fn energy(&self, x: &Vectors) -> Lanes {
        let mx = times(&self.m, x);
        let twice_b = plus(&self.b, &self.b);
        dot(x, &minus(&mx, &twice_b)) + self.at_tail
    }

    #[inline(always)]
    pub fn trace(&self) -> Lanes {
        self.m[0] + self.m[3] + self.m[5]
    }

    /// Where the energy is least, held near the middle where it is flat, by the adjugate: one
    /// division. (Its ridge has to be some digits above double precision's noise.) And where that
    /// is.
    #[inline(always)]
    pub fn least_near_middle(&self) -> (Vectors, Lanes) {
        /// Relative to the trace: what is this much flatter is taken to be flat.
        const RIDGE: f64 = 1e-5;
        let [xx, xy, xz, yy, yz, zz] = self.m;
        let ridge = Lanes::splat(RIDGE) * (xx + yy + zz);
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
        let b = plus(&self.b, &scaled(&self.along, Lanes::splat(0.5) * ridge));
        let x = scaled(&times(&adjugate, &b), Lanes::splat(1.0) / determinant);
        (x, determinant.simd_gt(Lanes::splat(0.0)))
    }

    /// The cheapest positions: what was found to be least, where that is anywhere near, or an end
    /// where that is as good, is held, or is all that may be.
    #[inline(always)]
    pub fn place<S: EdgeStore>(
        &self,
        surface: &Surface<S>,
        ends: &[[VertexId; 2]; LANES],
        held: &[[bool; 2]; LANES],
        placement: Placement,
        (least, is_found): (Vectors, Lanes),
    ) -> [Option<Evaluation>; LANES] {
        let length_squared = dot(&self.along, &self.along);
        let (at_tail, at_head) = (self.at_tail, self.energy(&self.along));
        let middle = scaled(&self.along, Lanes::splat(0.5));
        let from_middle = minus(&least, &middle);
        let reach = Lanes::splat(REACH * REACH) * length_squared;
        let is_near = is_found & dot(&from_middle, &from_middle).simd_le(reach);
        let x = select(is_near, &least, &middle);
        let at_x = self.energy(&x);
        let tail_is_better = at_tail.simd_le(at_head);
        let at_end = tail_is_better.bitselect(at_tail, at_head);
        let margin = Lanes::splat(AS_GOOD) * self.trace() * length_squared;
        let end_is_as_good = (at_x + margin).simd_ge(at_end);

        let tie_break = Lanes::splat(TIE_BREAK) * length_squared;
        let [at_tail, at_head, at_x, tie_break] =
            [at_tail, at_head, at_x, tie_break].map(Lanes::to_array);
        let [tail_is_better, end_is_as_good] =
            [tail_is_better, end_is_as_good].map(Lanes::to_bitmask);
        let [x, y, z] = x.map(Lanes::to_array);
        let geometry = &surface.geometry;
        std::array::from_fn(|i| {
            let bit = |mask: u32| mask >> i & 1 != 0;
            let take_tail = match held[i] {
                [true, true] => return None,
                [true, false] => true,
                [false, true] => false,
                [false, false] => bit(tail_is_better),
            };
            let is_free = held[i] == [false; 2] && placement == Placement::Optimal;
            let [v, w] = ends[i];
            let (energy, position) = if is_free && !bit(end_is_as_good) {
                (at_x[i], geometry.point_near(v, DVec3::new(x[i], y[i], z[i])))
            } else if take_tail {
                (at_tail[i], geometry.position(v))
            } else {
                (at_head[i], geometry.position(w))
            };
            let cost = energy.max(0.0) + tie_break[i];
            (cost.is_finite() && position.is_finite()).then_some(Evaluation { cost, position })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nearly singular matrices, eight digits between their eigenvalues, are solved to eight digits.
    #[test]
    fn the_factors_solve_badly_conditioned_systems() {
        let n = [0.6, -0.48, 0.64];
        let m = [
            n[0] * n[0],
            n[0] * n[1],
            n[0] * n[2],
            n[1] * n[1],
            n[1] * n[2],
            n[2] * n[2],
        ]
        .map(Lanes::splat);
        let ridge = Lanes::splat(1e-8);
        let x = [3.0, -1.0, 2.0].map(Lanes::splat);
        let b = plus(&times(&m, &x), &scaled(&x, ridge));
        let factors = Factors::of(&m, ridge);
        let solved = factors.solve(&b);
        assert_eq!(factors.is_positive().to_bitmask(), 0b1111);
        for (solved, expected) in solved.into_iter().zip([3.0, -1.0, 2.0]) {
            for lane in solved.to_array() {
                assert!((lane - expected).abs() < 1e-6, "{lane} {expected}");
            }
        }
    }

    /// Two planes that meet in a line, and a third across: the least is where the three meet.
    #[test]
    fn the_least_lies_where_the_planes_meet() {
        // Through the tail: x = 0 and y = 0; through the head, at (1, 2, 3): z = 3.
        let v = [1.0, 0.0, 0.0, 1.0, 0.0, 0.0].map(Lanes::splat);
        let w = [0.0, 0.0, 0.0, 0.0, 0.0, 1.0].map(Lanes::splat);
        let forms = Forms::of_ends(&v, &w, [1.0, 2.0, 3.0].map(Lanes::splat));
        let (x, is_found) = forms.least_near_middle();
        assert_eq!(is_found.to_bitmask(), 0b1111);
        for (x, expected) in x.into_iter().zip([0.0, 0.0, 3.0]) {
            assert!((x.to_array()[2] - expected).abs() < 1e-4, "{x:?}");
        }
    }
}
