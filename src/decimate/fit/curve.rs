//! The boundary around a vertex.

use glam::{DVec3, Vec3};

use super::measure::{Measure, ToOriginal};
use super::star::Star;
use crate::decimate::cost::{BOUNDARY_WEIGHT, LINE_WEIGHT};
use crate::nearest::{Foot, Patch, foot_on_triangle};

/// The boundary at a vertex of an open fan: two edges, and those across from it that are boundary
/// too.
pub struct Curve {
    /// The neighbours along the boundary.
    ends: [DVec3; 2],
    fixed: Vec<[DVec3; 2]>,
    /// The weight of a boundary's length against the surface's area: a length, times what boundary
    /// is worth.
    pub(super) weight: f64,
}

impl Curve {
    pub(super) fn around(star: &Star, here: DVec3) -> Self {
        let rim = |i: usize| star.rim[i].map(Vec3::as_dvec3);
        let last = star.rim.len() - 1;
        let ends = [rim(0)[0], rim(last)[1]];
        let length = ends[0].distance(here) + ends[1].distance(here);
        let is_fixed = |i: &usize| star.rim_is_boundary[*i];
        Self {
            ends,
            fixed: (0..=last).filter(is_fixed).map(rim).collect(),
            weight: LINE_WEIGHT * BOUNDARY_WEIGHT * length / 2.0,
        }
    }

    /// The point nearest to `p` while the vertex is `here`, and the direction of its edge; the first
    /// weight is the vertex's.
    pub(super) fn foot(&self, p: DVec3, here: DVec3) -> (Foot, DVec3) {
        let moving = self.ends.map(|end| [here, end]);
        let mut best: Option<(Foot, DVec3)> = None;
        for (i, [a, b]) in moving
            .into_iter()
            .chain(self.fixed.iter().copied())
            .enumerate()
        {
            let mut foot = foot_on_triangle(p, &[a, b, b]);
            if i >= moving.len() {
                foot.weights[0] = 0.0;
            }
            let is_nearer = best
                .as_ref()
                .is_none_or(|(f, _)| foot.point.distance_squared(p) < f.point.distance_squared(p));
            if is_nearer {
                best = Some((foot, (b - a).normalize_or_zero()));
            }
        }
        best.expect("two edges")
    }

    /// Adds the way from the two edges to the original's boundary, by Simpson's rule.
    pub(super) fn add_to_original(&self, boundary: &Patch, here: DVec3, measure: &mut Measure) {
        let squared = |p: DVec3| f64::from(ToOriginal::of(p.as_vec3(), boundary, None).squared);
        let at_vertex = squared(here);
        for end in self.ends {
            let weight = self.weight * here.distance(end);
            measure.add(at_vertex, weight / 6.0);
            measure.add(squared((here + end) / 2.0), weight * (2.0 / 3.0));
        }
    }
}
