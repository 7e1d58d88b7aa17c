//! Squared distances, summed up.

use glam::{Vec3, Vec4};

use super::original::{area, centroids};
use crate::nearest::Patch;

/// Squared distances: their weighted sum, and the largest.
#[derive(Clone, Copy, Debug, Default)]
pub struct Measure {
    pub(super) sum: f64,
    pub(super) largest: f64,
}

impl Measure {
    #[inline(always)]
    pub(super) fn add(&mut self, squared: f64, weight: f64) {
        self.sum += weight * squared;
        self.largest = self.largest.max(squared);
    }

    pub(super) fn join(&mut self, other: &Self) {
        self.sum += other.sum;
        self.largest = self.largest.max(other.largest);
    }

    /// Whether this is better than `before`, where the largest may rise up to `allowed`.
    pub(super) fn is_better(&self, before: &Self, gain: f64, allowed: f64) -> bool {
        self.sum < before.sum * (1.0 - gain) && self.largest <= before.largest.max(allowed)
    }

    /// Adds the way from a face to the original: inner points and one corner, which stands for all
    /// that it is a corner of.
    #[inline(always)]
    pub(super) fn add_face(
        &mut self,
        triangle: &[Vec3; 3],
        face: FaceToOriginal,
        corner: f32,
        rows: usize,
    ) {
        let area = f64::from(area(triangle));
        let at_corner = area / (12 * rows) as f64;
        self.add(f64::from(face.mean), area - 3.0 * at_corner);
        self.largest = self.largest.max(f64::from(face.largest));
        self.add(f64::from(corner), at_corner);
    }
}

/// [`Measure`], four at a time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Measures {
    sum: Vec4,
    largest: Vec4,
}

impl Measures {
    #[inline(always)]
    pub(super) fn add(&mut self, squared: Vec4, weights: Vec4) {
        self.sum += weights * squared;
        self.largest = self.largest.max(squared);
    }

    pub(super) fn all(&self) -> Measure {
        let [a, b, c, d] = self.sum.to_array().map(f64::from);
        Measure {
            sum: (a + b) + (c + d),
            largest: f64::from(self.largest.max_element()),
        }
    }
}

/// A squared distance to the original, and the triangle that was nearest: a guess for the next time.
#[derive(Clone, Copy, Debug, Default)]
pub struct ToOriginal {
    pub(super) squared: f32,
    pub(super) near: Option<u32>,
}

impl ToOriginal {
    #[inline]
    pub(super) fn of(point: Vec3, patch: &Patch, guess: Option<u32>) -> Self {
        patch
            .nearest(point, guess)
            .map_or(Self::default(), |nearest| Self {
                squared: nearest.squared,
                near: Some(nearest.triangle),
            })
    }
}

/// The squared distances of a face's inner points to the original: their mean and the largest.
#[derive(Clone, Copy, Debug, Default)]
pub struct FaceToOriginal {
    pub(super) mean: f32,
    pub(super) largest: f32,
    pub(super) near: Option<u32>,
}

impl FaceToOriginal {
    /// Measured in the centroids of the triangles that so many rows cut it into.
    pub(super) fn of(
        triangle: &[Vec3; 3],
        rows: usize,
        guess: Option<u32>,
        to: impl Fn(Vec3, Option<u32>) -> ToOriginal,
    ) -> Self {
        if rows == 1 {
            let [a, b, c] = triangle;
            let there = to((a + b + c) / 3.0, guess);
            return Self {
                mean: there.squared,
                largest: there.squared,
                near: there.near,
            };
        }
        let mut face = Self {
            near: guess,
            ..Self::default()
        };
        for point in centroids(triangle, rows) {
            let there = to(point, face.near);
            face.near = there.near;
            face.mean += there.squared;
            face.largest = face.largest.max(there.squared);
        }
        face.mean /= (rows * rows) as f32;
        face
    }
}
