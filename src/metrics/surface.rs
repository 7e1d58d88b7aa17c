//! A surface and its boundary curves, ready to be sampled and to be asked for nearest points.

use glam::DVec3;
use rayon::prelude::*;

use super::compare::Distances;
use crate::mesh::{Mesh, Small};
use crate::nearest::{Foot, Nearest, Triangles};

/// Samples a thread takes at a time; sums are added block by block, so they do not depend on the
/// number of threads.
const BLOCK: usize = 4096;

/// A sum over samples.
#[derive(Clone, Default)]
struct Sums {
    squares: f64,
    distances: f64,
    max_squared: f64,
    angles: Vec<f32>,
}

impl Sums {
    fn add(&mut self, nearest: &Nearest) {
        self.squares += nearest.distance_squared;
        self.distances += nearest.distance_squared.sqrt();
        self.max_squared = self.max_squared.max(nearest.distance_squared);
    }
}

/// A sample of a surface or of curves.
pub(super) struct Sample {
    /// The triangle or segment that it lies on, by its index in the caller's list.
    pub(super) triangle: u32,
    /// Where.
    pub(super) foot: Foot,
}

/// A surface: triangles in spatial order over vertices.
pub(super) struct Surface {
    set: Triangles,
    /// The vertices, in the order in which the corners first name them.
    vertices: Vec<DVec3>,
    /// The area up to and with each triangle.
    area_up_to: Vec<f64>,
    /// The unit normals in the caller's order; zero for degenerate triangles.
    normals: Vec<DVec3>,
}

impl Surface {
    pub(super) fn new(points: Vec<DVec3>, triangles: &[[u32; 3]]) -> Self {
        let corners = |t: &[u32; 3]| t.map(|v| points[v as usize]);
        let list: Vec<[DVec3; 3]> = triangles.iter().map(corners).collect();
        let normals = list.iter().map(|t| normal(t).normalize_or_zero()).collect();
        let set = Triangles::new(list);
        let mut seen = vec![false; points.len()];
        let mut vertices = Vec::with_capacity(points.len());
        for &name in set.names() {
            for v in triangles[name as usize].map(|v| v as usize) {
                if !std::mem::replace(&mut seen[v], true) {
                    vertices.push(points[v]);
                }
            }
        }
        let area_up_to = running_sum(set.corners().iter().map(|t| normal(t).length() / 2.0));
        Self {
            set,
            vertices,
            area_up_to,
            normals,
        }
    }

    /// The distances from samples spread over this surface by area (and for the largest also from
    /// its vertices) to another; the angles between the normals there, in degrees, are appended.
    pub(super) fn distances_to(
        &self,
        other: &Self,
        samples: usize,
        seed: u64,
        angles: &mut Vec<f32>,
    ) -> Distances {
        let sums = self.sample(other, samples, seed, &|sums: &mut Sums, sample, nearest| {
            sums.add(nearest);
            let here = self.normals[sample.triangle as usize];
            let there = other.normals[nearest.triangle as usize];
            let angle = here.dot(there).clamp(-1.0, 1.0).acos().to_degrees();
            sums.angles.push(angle as f32);
        });
        let largest = largest_squared(&self.vertices, &other.set);
        total(sums, samples, largest, angles)
    }

    /// Takes samples spread over this surface by area, the same for the same seed, and the points of
    /// another nearest to them; `add` adds them up, in blocks whose sums come back in order.
    pub(super) fn sample<T: Default + Send>(
        &self,
        other: &Self,
        samples: usize,
        seed: u64,
        add: &(dyn Fn(&mut T, &Sample, &Nearest) + Sync),
    ) -> Vec<T> {
        let place = |i: usize, slot: usize| {
            let [a, b, c] = self.set.corners()[slot];
            let (u, v) = (
                random(seed, 3 * i as u64 + 1),
                random(seed, 3 * i as u64 + 2),
            );
            let (u, v) = if u + v > 1.0 {
                (1.0 - u, 1.0 - v)
            } else {
                (u, v)
            };
            Sample {
                triangle: self.set.names()[slot],
                foot: Foot {
                    point: a + (b - a) * u + (c - a) * v,
                    weights: [1.0 - u - v, u, v],
                },
            }
        };
        sample_blocks(&self.area_up_to, samples, seed, &place, &other.set, add)
    }

    /// The triangles, ready to be asked for nearest points.
    pub(super) fn triangles(&self) -> &Triangles {
        &self.set
    }

    /// The area.
    pub(super) fn area(&self) -> f64 {
        self.area_up_to.last().copied().unwrap_or(0.0)
    }

    /// The mean quality 4√3·area/Σ edge² and the share of triangles under 0.05.
    pub(super) fn quality(&self) -> (f64, f64) {
        let quality = |t: &[DVec3; 3]| {
            let [a, b, c] = *t;
            let edges =
                (b - a).length_squared() + (c - b).length_squared() + (a - c).length_squared();
            if edges > 0.0 {
                2.0 * 3f64.sqrt() * normal(t).length() / edges
            } else {
                0.0
            }
        };
        let qualities = self.set.corners().iter().map(quality);
        let (sum, slivers) = qualities.fold((0.0, 0usize), |(sum, slivers), q| {
            (sum + q, slivers + usize::from(q < 0.05))
        });
        let n = self.set.corners().len() as f64;
        (sum / n, slivers as f64 / n)
    }

    /// The pairs of triangles that cut each other and share no vertex position.
    pub(super) fn intersecting_pairs(&self) -> usize {
        let mut at = vec![0u32; self.set.corners().len()];
        for (slot, &name) in self.set.names().iter().enumerate() {
            at[name as usize] = slot as u32;
        }
        let mut pairs = 0;
        self.set.for_each_overlapping_pair(|a, b| {
            let (s, t) = (
                &self.set.corners()[at[a as usize] as usize],
                &self.set.corners()[at[b as usize] as usize],
            );
            let share = s.iter().any(|p| t.contains(p));
            pairs += usize::from(!share && (pierces(s, t) || pierces(t, s)));
        });
        pairs
    }
}

/// Whether an edge of `s` passes through the inside of `t`.
fn pierces(s: &[DVec3; 3], t: &[DVec3; 3]) -> bool {
    let n = normal(t);
    (0..3).any(|i| {
        let (p, q) = (s[i], s[(i + 1) % 3]);
        let (above, below) = (n.dot(p - t[0]), n.dot(q - t[0]));
        if above * below >= 0.0 {
            return false;
        }
        let x = p + (q - p) * (above / (above - below));
        (0..3).all(|k| n.dot((t[(k + 1) % 3] - t[k]).cross(x - t[k])) > 0.0)
    })
}

/// Boundary curves: segments, kept as degenerate triangles.
pub(super) struct Curves {
    set: Triangles,
    length_up_to: Vec<f64>,
}

impl Curves {
    /// The edges that exactly one triangle has.
    pub(super) fn of_boundary(points: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let mesh = Mesh::<Small>::from_triangles(points.len(), triangles);
        let segment = |e| {
            let [a, b] = mesh.edge_vertices(e).map(|v| points[v.index()]);
            [a, b, b]
        };
        let list = mesh
            .edges()
            .filter(|&e| mesh.is_boundary(e))
            .map(segment)
            .collect();
        let set = Triangles::new(list);
        let length_up_to = running_sum(set.corners().iter().map(|[a, b, _]| a.distance(*b)));
        Self { set, length_up_to }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.set.is_empty()
    }

    /// The number of these curves' edges that run nowhere near others: whose middle is farther from
    /// them than the edge is long.
    pub(super) fn edges_away_from(&self, other: &Self) -> usize {
        let is_away = |[a, b, _]: &[DVec3; 3]| {
            let nearest = other.set.nearest((*a + *b) * 0.5);
            nearest.is_none_or(|n| n.distance_squared > a.distance_squared(*b))
        };
        self.set.corners().iter().filter(|s| is_away(s)).count()
    }

    /// The distances from samples spread over these curves by length to others.
    pub(super) fn distances_to(&self, other: &Self, samples: usize, seed: u64) -> Distances {
        let place = |i: usize, slot: usize| {
            let [a, b, _] = self.set.corners()[slot];
            let t = random(seed, 3 * i as u64 + 1);
            Sample {
                triangle: self.set.names()[slot],
                foot: Foot {
                    point: a + (b - a) * t,
                    weights: [1.0 - t, t, 0.0],
                },
            }
        };
        let add = |sums: &mut Sums, _: &Sample, nearest: &Nearest| sums.add(nearest);
        let sums = sample_blocks(&self.length_up_to, samples, seed, &place, &other.set, &add);
        let ends: Vec<DVec3> = self
            .set
            .corners()
            .iter()
            .flat_map(|&[a, b, _]| [a, b])
            .collect();
        total(
            sums,
            samples,
            largest_squared(&ends, &other.set),
            &mut Vec::new(),
        )
    }
}

fn normal(&[a, b, c]: &[DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

fn running_sum(sizes: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut sum = 0.0;
    sizes
        .map(|size| {
            sum += size;
            sum
        })
        .collect()
}

/// The `i`-th number in [0, 1) of a sequence (Steele, Lea, Flood 2014, SplitMix).
fn random(seed: u64, i: u64) -> f64 {
    let mut h = seed
        .wrapping_mul(0xD1B5_4A32_D192_ED03)
        .wrapping_add(i.wrapping_mul(0x9E37_79B9_7F4A_7C15));
    h = (h ^ (h >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    h = (h ^ (h >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((h ^ (h >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Takes stratified samples (the `i`-th in the `i`-th of equal parts of the size) and adds them up with
/// the points of a set nearest to them, in blocks.
fn sample_blocks<T: Default + Send>(
    size_up_to: &[f64],
    samples: usize,
    seed: u64,
    place: &(dyn Fn(usize, usize) -> Sample + Sync),
    to: &Triangles,
    add: &(dyn Fn(&mut T, &Sample, &Nearest) + Sync),
) -> Vec<T> {
    let size = size_up_to.last().copied().unwrap_or(0.0);
    let last = size_up_to.len().saturating_sub(1);
    (0..samples.div_ceil(BLOCK))
        .into_par_iter()
        .map(|block| {
            let mut sums = T::default();
            let mut guess = None;
            for i in block * BLOCK..samples.min((block + 1) * BLOCK) {
                let part = (i as f64 + random(seed, 3 * i as u64)) / samples as f64 * size;
                let slot = size_up_to.partition_point(|&s| s <= part).min(last);
                let sample = place(i, slot);
                let Some(nearest) = to.nearest_from(sample.foot.point, guess) else {
                    continue;
                };
                guess = Some(nearest.slot);
                add(&mut sums, &sample, &nearest);
            }
            sums
        })
        .collect()
}

/// The largest squared distance of these points from a set.
fn largest_squared(points: &[DVec3], to: &Triangles) -> f64 {
    let largest = |points: &[DVec3]| {
        let mut guess = None;
        points
            .iter()
            .fold(0.0f64, |largest, &p| match to.nearest_from(p, guess) {
                Some(nearest) => {
                    guess = Some(nearest.slot);
                    largest.max(nearest.distance_squared)
                }
                None => largest,
            })
    };
    points
        .par_chunks(BLOCK)
        .map(largest)
        .collect::<Vec<f64>>()
        .into_iter()
        .fold(0.0, f64::max)
}

fn total(blocks: Vec<Sums>, samples: usize, max_squared: f64, angles: &mut Vec<f32>) -> Distances {
    let mut sums = Sums {
        max_squared,
        ..Sums::default()
    };
    for block in blocks {
        sums.squares += block.squares;
        sums.distances += block.distances;
        sums.max_squared = sums.max_squared.max(block.max_squared);
        angles.extend(block.angles);
    }
    let n = samples.max(1) as f64;
    Distances {
        rms: (sums.squares / n).sqrt(),
        mean: sums.distances / n,
        max: sums.max_squared.sqrt(),
    }
}
