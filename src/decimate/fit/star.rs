//! What lies around a vertex: the faces and the samples on them, four at a time.

use glam::{DVec3, Vec3, Vec4};

use super::measure::{FaceToOriginal, Measure, Measures};
use super::{Number, number};
use crate::decimate::symmetric::{Factor, Symmetric};
use crate::mesh::FaceId;
use crate::nearest::{Faces, Points};

/// The ridge of a vertex's step, relative to the samples' weight. With 1e-2 a vertex hardly slides
/// along the surface, which costs 1.5 % of rms and on a sphere 10 %; with 1e-4 slivers appear.
const RIDGE: f64 = 3e-4;

/// Four samples on one face; where there are fewer, the first again, without a number and a weight.
#[derive(Clone, Copy)]
pub struct Four {
    pub(super) points: Points,
    pub(super) weights: Vec4,
    pub(super) samples: [Option<Number>; 4],
    /// Which of the faces around.
    pub(super) face: u32,
}

impl Four {
    fn of(point: Vec3, weight: f32, sample: usize, face: usize) -> Self {
        Self {
            points: Points::splat(point),
            weights: Vec4::new(weight, 0.0, 0.0, 0.0),
            samples: [Some(number(sample)), None, None, None],
            face: face as u32,
        }
    }
}

/// Samples face by face, four by four.
#[derive(Default)]
pub struct Fours {
    pub(super) list: Vec<Four>,
    filled: usize,
}

impl Fours {
    pub(super) fn clear(&mut self) {
        self.list.clear();
        self.filled = 4;
    }

    /// The samples that follow are on another face.
    pub(super) fn begin_face(&mut self) {
        self.filled = 4;
    }

    #[inline(always)]
    pub(super) fn push(&mut self, point: Vec3, weight: f32, sample: usize, face: usize) {
        if self.filled == 4 {
            self.list.push(Four::of(point, weight, sample, face));
            self.filled = 1;
        } else {
            let four = self.list.last_mut().expect("it is not filled");
            four.points.set(self.filled, point);
            four.weights[self.filled] = weight;
            four.samples[self.filled] = Some(number(sample));
            self.filled += 1;
        }
    }
}

/// A sample of the boundary near a vertex.
pub struct CurveItem {
    pub(super) sample: usize,
    pub(super) point: DVec3,
    pub(super) weight: f64,
    /// Which of the faces around.
    pub(super) face: usize,
}

/// The surroundings of a vertex; kept for its memory.
#[derive(Default)]
pub struct Star {
    pub(super) faces: Vec<FaceId>,
    /// The two other corners of each face: the first begins the rim of the next but one.
    pub(super) rim: Vec<[Vec3; 2]>,
    pub(super) is_closed: bool,
    /// Whether the side across from the vertex is a boundary.
    pub(super) rim_is_boundary: Vec<bool>,
    pub(super) fours: Fours,
    /// Samples of the boundary.
    pub(super) curve_items: Vec<CurveItem>,
    /// On which face each sample is after the step.
    pub(super) landed: Vec<[u32; 4]>,
    /// To the original after the step, face by face.
    pub(super) to_original: Vec<FaceToOriginal>,
    planes: Vec<Faces>,
}

impl Star {
    pub(super) fn clear(&mut self) {
        self.faces.clear();
        self.rim.clear();
        self.rim_is_boundary.clear();
        self.fours.clear();
        self.curve_items.clear();
    }

    fn set_planes(&mut self, at: Vec3) {
        self.planes.clear();
        let planes = self.rim.iter().map(|&[a, b]| Faces::splat([at, a, b]));
        self.planes.extend(planes);
    }

    /// The distances of the samples with the vertex `here`, and the equations for its step.
    pub(super) fn look(&mut self, here: Vec3) -> (Measure, System) {
        self.set_planes(here);
        let mut measures = Measures::default();
        let mut sums = Sums::default();
        for four in &self.fours.list {
            let plane = &self.planes[four.face as usize];
            let feet = plane.feet(&four.points);
            measures.add(feet.squared, four.weights);
            let length = Vec4::from(feet.squared.to_array().map(f32::sqrt));
            let is_plane = feet.is_inside | feet.squared.cmpeq(Vec4::ZERO);
            let per_length = Vec4::ONE / Vec4::select(is_plane, Vec4::ONE, length);
            let direction = Points {
                x: Vec4::select(is_plane, plane.normal.x, feet.offset.x * per_length),
                y: Vec4::select(is_plane, plane.normal.y, feet.offset.y * per_length),
                z: Vec4::select(is_plane, plane.normal.z, feet.offset.z * per_length),
            };
            let share = Vec4::ONE - feet.weights[0] - feet.weights[1];
            let away = feet.offset.dot(&direction);
            sums.add(&direction, away, share, four.weights);
        }
        (measures.all(), sums.system())
    }

    /// The distances of the samples with the vertex `there`, and on which face each lands: from its
    /// own across the spokes as long as that is nearer.
    pub(super) fn measure(&mut self, there: Vec3) -> Measure {
        self.set_planes(there);
        let faces = self.faces.len();
        let mut measures = Measures::default();
        self.landed.clear();
        for four in &self.fours.list {
            let own = four.face as usize;
            let feet = self.planes[own].feet(&four.points);
            let mut squared = feet.squared;
            let mut landed = [four.face; 4];
            if !feet.is_inside.all() {
                // Beyond the first spoke where the other's corner has no share, and so on.
                for (side, corner) in [(false, 1), (true, 0)] {
                    let mut at = own;
                    let mut lanes = !feet.is_inside;
                    let mut weights = feet.weights[corner];
                    for _ in 1..faces {
                        lanes &= weights.cmpeq(Vec4::ZERO);
                        let beside = match side {
                            false => at.checked_sub(1).or(self.is_closed.then_some(faces - 1)),
                            true => Some(at + 1)
                                .filter(|&f| f < faces)
                                .or(self.is_closed.then_some(0)),
                        };
                        let Some(beside) = beside.filter(|_| lanes.any()) else {
                            break;
                        };
                        let there = self.planes[beside].feet(&four.points);
                        lanes &= there.squared.cmplt(squared);
                        squared = Vec4::select(lanes, there.squared, squared);
                        let mut bits = lanes.bitmask();
                        while bits != 0 {
                            landed[bits.trailing_zeros() as usize] = beside as u32;
                            bits &= bits - 1;
                        }
                        lanes &= !there.is_inside;
                        (at, weights) = (beside, there.weights[corner]);
                    }
                }
            }
            measures.add(squared, four.weights);
            self.landed.push(landed);
        }
        measures.all()
    }
}

/// Sums towards a [`System`], four at a time.
#[derive(Default)]
struct Sums {
    m: [Vec4; 6],
    b: Points,
    weight: Vec4,
}

impl Sums {
    #[inline(always)]
    fn add(&mut self, direction: &Points, away: Vec4, share: Vec4, weights: Vec4) {
        let weighted = weights * share;
        let squared = weighted * share;
        self.weight += squared;
        let pull = direction.times(weighted * away);
        self.b.x += pull.x;
        self.b.y += pull.y;
        self.b.z += pull.z;
        let Points { x, y, z } = *direction;
        let by = direction.times(squared);
        let terms = [by.x * x, by.x * y, by.x * z, by.y * y, by.y * z, by.z * z];
        for (m, term) in self.m.iter_mut().zip(terms) {
            *m += term;
        }
    }

    fn system(&self) -> System {
        let sum = |v: Vec4| {
            let [a, b, c, d] = v.to_array().map(f64::from);
            (a + b) + (c + d)
        };
        System {
            m: Symmetric(self.m.map(sum)),
            b: DVec3::new(sum(self.b.x), sum(self.b.y), sum(self.b.z)),
            weight: sum(self.weight),
        }
    }
}

/// The normal equations of a vertex's step.
pub struct System {
    m: Symmetric,
    b: DVec3,
    weight: f64,
}

impl System {
    /// A sample at `offset` from its foot, of which the vertex has the share `share`, measured along
    /// `direction`.
    pub(super) fn add(&mut self, direction: DVec3, offset: DVec3, share: f64, weight: f64) {
        let squared_share = weight * share * share;
        self.weight += squared_share;
        self.b += direction * (weight * share * offset.dot(direction));
        self.m.add_outer(direction, squared_share);
    }

    /// The step.
    pub(super) fn solve(&self) -> Option<DVec3> {
        let step = Factor::of(&self.m, RIDGE * self.weight)?.solve(self.b);
        step.is_finite().then_some(step)
    }
}
