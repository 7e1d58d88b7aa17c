//! Symmetric 3×3 matrices: sums of planes and lines, and the systems that they pose.

use glam::DVec3;

/// A symmetric 3×3 matrix: xx, xy, xz, yy, yz, zz.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Symmetric(pub(super) [f64; 6]);

impl Symmetric {
    /// Adds w·v vᵀ.
    #[inline(always)]
    pub(super) fn add_outer(&mut self, v: DVec3, w: f64) {
        let s = v * w;
        let terms = [
            s.x * v.x,
            s.x * v.y,
            s.x * v.z,
            s.y * v.y,
            s.y * v.z,
            s.z * v.z,
        ];
        for (m, t) in self.0.iter_mut().zip(terms) {
            *m += t;
        }
    }

    /// Adds w·(|d|² I − d dᵀ): the squared distance from the line along d, times w·|d|².
    #[inline(always)]
    pub(super) fn add_line(&mut self, d: DVec3, w: f64) {
        let squared = w * d.length_squared();
        self.add_outer(d, -w);
        for i in [0, 3, 5] {
            self.0[i] += squared;
        }
    }

    #[inline(always)]
    pub(super) fn plus(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }

    #[inline(always)]
    pub(super) fn times(&self, v: DVec3) -> DVec3 {
        let [xx, xy, xz, yy, yz, zz] = self.0;
        DVec3::new(
            xx * v.x + xy * v.y + xz * v.z,
            xy * v.x + yy * v.y + yz * v.z,
            xz * v.x + yz * v.y + zz * v.z,
        )
    }
}

/// L D Lᵀ of a positive definite symmetric matrix. Stable where the adjugate is not: the ridge is
/// eight digits below the trace.
pub(super) struct Factor {
    l10: f64,
    l20: f64,
    l21: f64,
    inverse_d: DVec3,
}

impl Factor {
    #[inline(always)]
    pub(super) fn of(m: &Symmetric, ridge: f64) -> Option<Self> {
        let [xx, xy, xz, yy, yz, zz] = m.0;
        let d0 = xx + ridge;
        let inverse_d0 = d0.recip();
        let l10 = xy * inverse_d0;
        let l20 = xz * inverse_d0;
        let d1 = yy + ridge - l10 * xy;
        let inverse_d1 = d1.recip();
        let s21 = yz - l20 * xy;
        let l21 = s21 * inverse_d1;
        let d2 = zz + ridge - l20 * xz - l21 * s21;
        let is_positive = d0 > 0.0 && d1 > 0.0 && d2 > 0.0;
        is_positive.then(|| Self {
            l10,
            l20,
            l21,
            inverse_d: DVec3::new(inverse_d0, inverse_d1, d2.recip()),
        })
    }

    #[inline(always)]
    pub(super) fn solve(&self, b: DVec3) -> DVec3 {
        let y = b.y - self.l10 * b.x;
        let z = b.z - self.l20 * b.x - self.l21 * y;
        let scaled = DVec3::new(b.x, y, z) * self.inverse_d;
        let y = scaled.y - self.l21 * scaled.z;
        let x = scaled.x - self.l10 * y - self.l20 * scaled.z;
        DVec3::new(x, y, scaled.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A nearly singular matrix, eight digits between its eigenvalues, is solved to eight digits.
    #[test]
    fn the_factor_solves_badly_conditioned_systems() {
        let mut m = Symmetric::default();
        m.add_outer(DVec3::new(0.6, -0.48, 0.64), 1.0);
        let ridge = 1e-8;
        let x = DVec3::new(3.0, -1.0, 2.0);
        let b = m.times(x) + x * ridge;
        let solved = Factor::of(&m, ridge).unwrap().solve(b);
        assert!((solved - x).length() < 1e-6, "{solved}");
    }

    /// The line term is the squared distance from the line times the squared length.
    #[test]
    fn a_line_measures_the_distance_from_it() {
        let mut m = Symmetric::default();
        m.add_line(DVec3::new(0.0, 0.0, 2.0), 1.5);
        let p = DVec3::new(3.0, 4.0, 77.0);
        assert!((p.dot(m.times(p)) - 1.5 * 4.0 * 25.0).abs() < 1e-9);
    }
}
