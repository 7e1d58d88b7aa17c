//! Fits a decimated surface to the original: moves its vertices, flips its edges.
//!
//! Every step is measured before it is taken, both ways: samples of the original against the faces
//! around the step, and the centroids and corners of those faces against the original. It is taken
//! only if the sum of squares falls and the largest distance around does not rise above what is
//! allowed. So no step makes the whole worse.
//!
//! The direction of a vertex is that of Gauss and Newton for the samples on the faces around it,
//! each held by the point of the surface that is nearest to it now (Hoppe et al. 1993 fit so, with
//! conjugate gradients over all vertices).

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::cost::{BOUNDARY_WEIGHT, LINE_WEIGHT};
use super::original::{Original, centroids};
use super::surface::Surface;
use super::symmetric::{Factor, Symmetric};
use crate::mesh::{EdgeId, EdgeStore, FaceId, Opposite, Outgoing, VertexId};
use crate::nearest::{Foot, Triangles, foot_on_triangle, nearest_on_triangle};

/// A step may raise the largest distance around it up to this many times the rms of the whole: high
/// enough not to hinder, low enough to keep the Hausdorff distance. 3 costs 4 % of rms; from 8 on
/// nothing changes.
const ALLOWED: f64 = 8.0;

/// The ridge of a vertex's step, relative to the samples' weight. With 1e-2 a vertex hardly slides
/// along the surface, which costs 1.5 % of rms and on a sphere 10 %; with 1e-4 slivers appear.
const RIDGE: f64 = 3e-4;

/// A step goes this much farther than its neighbours' staying where they are would ask for
/// (successive over-relaxation, Young 1954). On a sphere 1.4 % of rms, elsewhere 0.3 %.
const RELAXATION: f64 = 1.3;

/// A vertex tries the whole step and its half.
const TRIALS: usize = 2;

/// By how much a step must lower the energy, relatively: smaller steps are not worth their time.
const GAIN: f64 = 1e-3;

/// A step that lowers the energy by less, relatively, does not make anyone look again: 0.1 saves a
/// seventh of the time, and costs a sphere 3 % of rms.
const WORTHWHILE: f64 = 0.05;

/// By how much a flip must lower the energy, relatively.
const FLIP_GAIN: f64 = 0.02;

/// By how much more it must where the worse of its two triangles becomes a worse one, per share of
/// quality lost. 0 gives triangles 1.5 % worse on the mean for 0.2 % of rms.
const QUALITY_PRICE: f64 = 0.7;

/// As 4√3·area/Σ edge²; a flip may not go below it, if it goes down at all.
const SLIVER: f64 = 0.05;

/// No face may turn by more than 60° in a step.
const TURN: f64 = 0.5;

/// A step may not make a face thinner than this (twice its area against its longest squared side),
/// if it makes it thinner at all.
const THIN: f64 = 1e-3;

/// Squared distances: their weighted sum, and the largest.
#[derive(Clone, Copy, Debug, Default)]
struct Measure {
    sum: f64,
    largest: f64,
}

impl Measure {
    #[inline(always)]
    fn add(&mut self, squared: f64, weight: f64) {
        self.sum += weight * squared;
        self.largest = self.largest.max(squared);
    }

    fn join(&mut self, other: &Self) {
        self.sum += other.sum;
        self.largest = self.largest.max(other.largest);
    }

    /// Whether this is better than `before`, where the largest may rise up to `allowed`.
    fn is_better(&self, before: &Self, gain: f64, allowed: f64) -> bool {
        self.sum < before.sum * (1.0 - gain) && self.largest <= before.largest.max(allowed)
    }
}

/// A squared distance to the original, and the slot that was nearest: a guess for the next time.
#[derive(Clone, Copy, Debug, Default)]
struct ToOriginal {
    squared: f64,
    slot: Option<u32>,
}

impl ToOriginal {
    #[inline]
    fn of(point: DVec3, set: &Triangles, guess: Option<u32>) -> Self {
        set.nearest_from(point, guess)
            .map_or(Self::default(), |nearest| Self {
                squared: nearest.distance_squared,
                slot: Some(nearest.slot),
            })
    }
}

/// The squared distances of a face's inner points to the original: their mean and the largest.
#[derive(Clone, Copy, Debug, Default)]
struct FaceToOriginal {
    mean: f64,
    largest: f64,
    slot: Option<u32>,
}

/// The samples on each face, as lists that share one array.
struct Lists {
    first: Vec<Option<Sample>>,
    next: Vec<Option<Sample>>,
    /// The samples whose nearest face looks the other way: the other side of a thin sheet, nothing to
    /// be fitted to, but not to be left farther behind either. (Searching for a face that looks the
    /// same way instead made one mesh 38 times worse.)
    is_across: Vec<bool>,
}

/// The number of a sample, from one, so that an optional one takes four bytes.
type Sample = std::num::NonZeroU32;

fn sample(index: usize) -> Sample {
    Sample::MIN.saturating_add(index as u32)
}

fn index(sample: Sample) -> usize {
    sample.get() as usize - 1
}

impl Lists {
    fn on(&self, f: FaceId) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(self.first[f.index()], |&s| self.next[index(s)]).map(index)
    }

    fn push(&mut self, f: FaceId, i: usize) {
        self.next[i] = self.first[f.index()].replace(sample(i));
    }

    fn clear(&mut self, f: FaceId) {
        self.first[f.index()] = None;
    }
}

/// A sample near a vertex, on one of the faces around.
#[derive(Clone, Copy)]
struct Item {
    sample: usize,
    point: DVec3,
    weight: f64,
    /// Which of the faces around.
    face: usize,
}

/// The surroundings of a vertex; kept for its memory.
#[derive(Default)]
struct Star {
    faces: Vec<FaceId>,
    /// The two other corners of each face: the first begins the rim of the next but one.
    rim: Vec<[DVec3; 2]>,
    is_closed: bool,
    /// Whether the side across from the vertex is a boundary.
    rim_is_boundary: Vec<bool>,
    items: Vec<Item>,
    /// Samples of the boundary.
    curve_items: Vec<Item>,
    /// Where each item is nearest after the step.
    landed: Vec<usize>,
    /// To the original after the step, face by face.
    to_original: Vec<FaceToOriginal>,
}

/// A step of a vertex.
struct Step {
    position: Vec3,
    /// From there to the original.
    corner: ToOriginal,
    /// By how much it lowers the energy around, relatively.
    gain: f64,
}

/// A surface being fitted.
pub struct Fit<'a, S> {
    surface: &'a mut Surface<S>,
    original: &'a Original,
    lists: Lists,
    /// Each face is measured in the centroids of the triangles that so many rows cut it into.
    rows: usize,
    to_original: Vec<FaceToOriginal>,
    corners: Vec<ToOriginal>,
    /// The vertices that have found no step since their surroundings changed.
    is_settled: Vec<bool>,
    /// What the largest squared distance may rise to.
    allowed: f64,
    star: Star,
}

impl<'a, S: EdgeStore> Fit<'a, S> {
    /// Finds for every sample the nearest face, in parallel: about a microsecond each. No step will
    /// move the surface farther from the original than `max_error` (in model units), or than it is.
    pub fn new(
        surface: &'a mut Surface<S>,
        original: &'a Original,
        max_error: Option<f64>,
    ) -> Self {
        let mut fit = Self {
            lists: assign(surface, original),
            rows: rows(surface.mesh.face_count(), original.faces.len()),
            to_original: Vec::new(),
            corners: Vec::new(),
            is_settled: vec![false; surface.mesh.vertex_slots()],
            allowed: 0.0,
            star: Star::default(),
            surface,
            original,
        };
        fit.measure_to_original();
        fit.allowed = fit.mean_square() * (ALLOWED * ALLOWED);
        if let Some(limit) = max_error {
            fit.allowed = fit.allowed.min(limit * limit);
        }
        fit
    }

    fn measure_to_original(&mut self) {
        let (mesh, geometry) = (&self.surface.mesh, &self.surface.geometry);
        let to = |point| ToOriginal::of(point, &self.original.faces, None);
        let at = |v: VertexId| geometry.position(v).as_dvec3();
        self.to_original = (0..mesh.face_slots())
            .into_par_iter()
            .map(FaceId::new)
            .map(|f| {
                if mesh.is_live_face(f) {
                    self.face_to_original(&self.triangle(f), None)
                } else {
                    FaceToOriginal::default()
                }
            })
            .collect();
        self.corners = (0..mesh.vertex_slots())
            .into_par_iter()
            .map(VertexId::new)
            .map(|v| {
                let is_untouched = geometry.position(v) == self.original.points[v.index()];
                match mesh.outgoing(v) {
                    Outgoing::None => ToOriginal::default(),
                    _ if is_untouched => ToOriginal::default(),
                    _ => to(at(v)),
                }
            })
            .collect();
    }

    fn face_to_original(&self, triangle: &[DVec3; 3], guess: Option<u32>) -> FaceToOriginal {
        let mut face = FaceToOriginal {
            slot: guess,
            ..FaceToOriginal::default()
        };
        for point in centroids(triangle, self.rows) {
            let there = ToOriginal::of(point, &self.original.faces, face.slot);
            face.slot = there.slot;
            face.mean += there.squared;
            face.largest = face.largest.max(there.squared);
        }
        face.mean /= (self.rows * self.rows) as f64;
        face
    }

    /// Adds the way from a face to the original: inner points and one corner, which stands for all
    /// that it is a corner of.
    #[inline(always)]
    fn add_face(&self, measure: &mut Measure, area: f64, face: FaceToOriginal, corner: f64) {
        let area = area * self.scale() * self.scale();
        let at_corner = area / (12 * self.rows) as f64;
        measure.add(face.mean, area - 3.0 * at_corner);
        measure.largest = measure.largest.max(face.largest);
        measure.add(corner, at_corner);
    }

    /// The weighted mean of the squared distances, both ways.
    fn mean_square(&self) -> f64 {
        let (mut sum, mut weights) = (0.0, 0.0);
        for f in self.surface.mesh.faces() {
            let triangle = self.triangle(f);
            for i in self
                .lists
                .on(f)
                .filter(|&i| i < self.original.boundary_begin)
            {
                let (point, weight) = self.sample(i);
                sum += weight * squared_distance(point, &triangle);
                weights += weight;
            }
            let weight = area(&triangle) * self.scale() * self.scale();
            sum += weight * self.to_original[f.index()].mean;
            weights += weight;
        }
        sum / weights
    }

    /// What brings lengths into the unit box, where weights are single precision.
    fn scale(&self) -> f64 {
        self.surface.geometry.scale()
    }

    fn triangle(&self, f: FaceId) -> [DVec3; 3] {
        let at = |v| self.surface.geometry.position(v).as_dvec3();
        self.surface.mesh.face_vertices(f).map(at)
    }

    fn sample(&self, i: usize) -> (DVec3, f64) {
        let weight = if self.lists.is_across[i] {
            0.0
        } else {
            f64::from(self.original.weights[i])
        };
        (self.original.points[i].as_dvec3(), weight)
    }

    /// Moves each vertex once, if there is a better place for it.
    pub fn move_vertices(&mut self) {
        for v in 0..self.surface.mesh.vertex_slots() {
            self.move_vertex(VertexId::new(v));
        }
    }

    fn move_vertex(&mut self, v: VertexId) {
        if self.is_settled[v.index()] || self.surface.is_locked(v) {
            return;
        }
        let mut star = std::mem::take(&mut self.star);
        let step = if self.look_around(v, &mut star) {
            self.find_step(v, &mut star)
        } else {
            None
        };
        self.is_settled[v.index()] = true;
        if let Some(step) = step {
            self.surface.geometry.set_position(v, step.position);
            self.corners[v.index()] = step.corner;
            for (&f, &to_original) in star.faces.iter().zip(&star.to_original) {
                self.to_original[f.index()] = to_original;
                self.lists.clear(f);
            }
            for (item, &face) in star.items.iter().zip(&star.landed).rev() {
                self.lists.push(star.faces[face], item.sample);
            }
            for item in &star.curve_items {
                self.lists.push(star.faces[item.face], item.sample);
            }
            if step.gain > WORTHWHILE {
                self.is_settled[v.index()] = false;
                for x in self.surface.mesh.neighbours(v) {
                    self.is_settled[x.index()] = false;
                }
            }
        }
        self.star = star;
    }

    /// Collects what lies around `v`; whether it may move at all.
    fn look_around(&self, v: VertexId, star: &mut Star) -> bool {
        let (mesh, geometry) = (&self.surface.mesh, &self.surface.geometry);
        let Outgoing::Fan(start) = mesh.outgoing(v) else {
            return false;
        };
        star.is_closed = match mesh.opposite(start) {
            Opposite::Edge(_) => true,
            Opposite::Boundary => false,
            Opposite::NonManifold(_) => return false,
        };
        // Nothing here measures how far a crease, or a boundary that is free, strays.
        if !self.surface.creases.is_empty() && self.surface.curves_at(v) > 0 {
            return false;
        }
        if !star.is_closed && self.original.boundary.is_empty() {
            return false;
        }
        star.faces.clear();
        star.rim.clear();
        star.rim_is_boundary.clear();
        star.items.clear();
        star.curve_items.clear();
        for e in mesh.fan(start) {
            let face = star.faces.len();
            let at = |v| geometry.position(v).as_dvec3();
            star.faces.push(e.face());
            star.rim.push([at(mesh.head(e)), at(mesh.apex(e))]);
            star.rim_is_boundary.push(mesh.is_boundary(mesh.next(e)));
            for i in self.lists.on(e.face()) {
                let (point, weight) = self.sample(i);
                let item = Item {
                    sample: i,
                    point,
                    weight,
                    face,
                };
                if i < self.original.boundary_begin {
                    star.items.push(item);
                } else {
                    star.curve_items.push(item);
                }
            }
        }
        !star.items.is_empty()
    }

    /// A better place for `v`.
    fn find_step(&self, v: VertexId, star: &mut Star) -> Option<Step> {
        let here = self.surface.geometry.position(v).as_dvec3();
        let corner = self.corners[v.index()];
        let mut system = System::default();
        let mut before = Measure::default();
        for item in &star.items {
            let [a, b] = star.rim[item.face];
            let foot = foot_on_triangle(item.point, &[here, a, b]);
            let offset = item.point - foot.point;
            before.add(offset.length_squared(), item.weight);
            let direction = if foot.is_inside() || offset == DVec3::ZERO {
                (a - here).cross(b - here)
            } else {
                offset
            };
            system.add(
                direction.normalize_or_zero(),
                offset,
                foot.weights[0],
                item.weight,
            );
        }
        let curve = (!star.is_closed).then(|| Curve::around(star, here, self.scale()));
        let mut curve_before = Measure::default();
        if let Some(curve) = &curve {
            for item in &star.curve_items {
                let (foot, along) = curve.foot(item.point, here);
                let offset = item.point - foot.point;
                let weight = curve.weight * item.weight;
                curve_before.add(offset.length_squared(), weight);
                // Off the line, whichever way: its length is the curve's own business.
                let off_line = offset - along * along.dot(offset);
                system.add(
                    off_line.normalize_or_zero(),
                    offset,
                    foot.weights[0],
                    weight,
                );
            }
            curve.add_to_original(&self.original.boundary, here, &mut curve_before);
            before.join(&curve_before);
        }
        for (&f, &[a, b]) in star.faces.iter().zip(&star.rim) {
            let area = area(&[here, a, b]);
            self.add_face(
                &mut before,
                area,
                self.to_original[f.index()],
                corner.squared,
            );
        }
        if before.largest <= self.original.noise_squared {
            return None;
        }
        let mut step = system.solve()? * RELAXATION;
        for _ in 0..TRIALS {
            let position = (here + step).as_vec3();
            step *= 0.5;
            let there = position.as_dvec3();
            if !position.is_finite() || there == here {
                return None;
            }
            if turns(&star.rim, here, there) {
                continue;
            }
            let mut after = measure_items(star, there);
            if let Some(curve) = &curve {
                let mut curve_after = Measure::default();
                for item in &star.curve_items {
                    let (foot, _) = curve.foot(item.point, there);
                    let squared = foot.point.distance_squared(item.point);
                    curve_after.add(squared, curve.weight * item.weight);
                }
                curve.add_to_original(&self.original.boundary, there, &mut curve_after);
                // The boundary does not pay for the surface.
                if curve_after.sum > curve_before.sum {
                    continue;
                }
                after.join(&curve_after);
            }
            if !after.is_better(&before, GAIN, self.allowed) {
                continue;
            }
            let corner = ToOriginal::of(there, &self.original.faces, corner.slot);
            star.to_original.clear();
            for (&f, &[a, b]) in star.faces.iter().zip(&star.rim) {
                let triangle = [there, a, b];
                let guess = self.to_original[f.index()].slot;
                let face = self.face_to_original(&triangle, guess);
                self.add_face(&mut after, area(&triangle), face, corner.squared);
                star.to_original.push(face);
                if !after.is_better(&before, GAIN, self.allowed) {
                    break;
                }
            }
            if after.is_better(&before, GAIN, self.allowed) {
                return Some(Step {
                    position,
                    corner,
                    gain: 1.0 - after.sum / before.sum,
                });
            }
        }
        None
    }

    /// Flips each edge once, if the other diagonal is nearer to the original.
    pub fn flip_edges(&mut self) {
        for f in (0..self.surface.mesh.face_slots()).map(FaceId::new) {
            if !self.surface.mesh.is_live_face(f) {
                continue;
            }
            for e in f.edges() {
                if let Some(o) = self.surface.mesh.mate(e).filter(|&o| e < o) {
                    self.flip_edge(e, o);
                }
            }
        }
    }

    fn flip_edge(&mut self, e: EdgeId, o: EdgeId) {
        let mesh = &self.surface.mesh;
        let faces = [e.face(), o.face()];
        let is_alike = self.surface.sides(faces[0]) == self.surface.sides(faces[1]);
        if !is_alike || self.surface.is_crease(e) {
            return;
        }
        let ends = mesh.edge_vertices(e);
        let apexes = [mesh.apex(e), mesh.apex(o)];
        let at = |v| self.surface.geometry.position(v).as_dvec3();
        let ([a, b], [c, d]) = (ends.map(at), apexes.map(at));
        let (old, new) = ([[a, b, c], [b, a, d]], [[d, c, a], [c, d, b]]);
        let Some(gain) = flip_gain(&old, &new) else {
            return;
        };
        let mut items = std::mem::take(&mut self.star.items);
        items.clear();
        let (mut before, mut after) = (Measure::default(), Measure::default());
        let mut has_boundary = false;
        for (k, f) in faces.into_iter().enumerate() {
            for i in self.lists.on(f) {
                has_boundary |= i >= self.original.boundary_begin;
                let (point, weight) = self.sample(i);
                before.add(squared_distance(point, &old[k]), weight);
                let [to_first, to_second] = [0, 1].map(|k| squared_distance(point, &new[k]));
                after.add(to_first.min(to_second), weight);
                items.push(Item {
                    sample: i,
                    point,
                    weight,
                    face: usize::from(to_second < to_first),
                });
            }
        }
        let is_better = !has_boundary
            && before.largest > self.original.noise_squared
            && after.is_better(&before, gain, self.allowed)
            && self.surface.mesh.flip_condition(e)
            && self.flip_is_better(faces, &old, &new, gain, before, after);
        if is_better {
            self.surface.flip(e);
            faces.into_iter().for_each(|f| self.lists.clear(f));
            for item in items.iter().rev() {
                self.lists.push(faces[item.face], item.sample);
            }
            for v in ends.into_iter().chain(apexes) {
                self.is_settled[v.index()] = false;
            }
        }
        self.star.items = items;
    }

    /// Whether a flip is better also with the way to the original, which it then notes.
    fn flip_is_better(
        &mut self,
        faces: [FaceId; 2],
        old: &[[DVec3; 3]; 2],
        new: &[[DVec3; 3]; 2],
        gain: f64,
        mut before: Measure,
        mut after: Measure,
    ) -> bool {
        let to_original = [0, 1].map(|k| {
            let here = self.to_original[faces[k].index()];
            let there = self.face_to_original(&new[k], here.slot);
            self.add_face(&mut before, area(&old[k]), here, 0.0);
            self.add_face(&mut after, area(&new[k]), there, 0.0);
            there
        });
        let is_better = after.is_better(&before, gain, self.allowed);
        if is_better {
            for (f, there) in faces.into_iter().zip(to_original) {
                self.to_original[f.index()] = there;
            }
        }
        is_better
    }

    /// Replaces the estimated deviation of every vertex by what was measured around it.
    pub fn finish(self) {
        let (mesh, scale) = (&self.surface.mesh, self.surface.geometry.scale());
        let mut largest: Vec<f64> = self.corners.iter().map(|c| c.squared).collect();
        for f in mesh.faces() {
            let triangle = self.triangle(f);
            let mut on_face = self.to_original[f.index()].largest;
            for i in self.lists.on(f) {
                let (point, _) = self.sample(i);
                on_face = on_face.max(squared_distance(point, &triangle));
            }
            for v in mesh.face_vertices(f) {
                largest[v.index()] = largest[v.index()].max(on_face);
            }
        }
        for (deviation, squared) in self.surface.deviation.iter_mut().zip(largest) {
            *deviation = (squared.sqrt() * scale) as f32;
        }
    }

    /// The bytes held, without the original.
    pub fn bytes(&self) -> usize {
        (self.lists.first.capacity() + self.lists.next.capacity()) * size_of::<Option<Sample>>()
            + self.lists.is_across.capacity()
            + self.to_original.capacity() * size_of::<FaceToOriginal>()
            + self.corners.capacity() * size_of::<ToOriginal>()
            + self.is_settled.capacity()
    }
}

/// The rows that faces are measured in: one, more where a few faces span the original or where
/// nearly all of its faces are left.
fn rows(faces: usize, of_original: usize) -> usize {
    const POINTS: f64 = 3_000.0;
    const ROWS: f64 = 8.0;
    const NEARLY_ALL: f64 = 0.7;
    let fewest = if faces as f64 > NEARLY_ALL * of_original as f64 {
        2.0
    } else {
        1.0
    };
    (POINTS / faces.max(1) as f64).sqrt().clamp(fewest, ROWS) as usize
}

/// The list of each face's samples: those that are nearest to it.
fn assign<S: EdgeStore>(surface: &Surface<S>, original: &Original) -> Lists {
    let (mesh, geometry) = (&surface.mesh, &surface.geometry);
    let faces: Vec<FaceId> = mesh.faces().collect();
    let at = |v| geometry.position(v).as_dvec3();
    let set = Triangles::new(
        faces
            .iter()
            .map(|&f| mesh.face_vertices(f).map(at))
            .collect(),
    );
    // A sample of the boundary belongs to a face at the nearest boundary edge.
    let edges: Vec<EdgeId> = if original.boundary.is_empty() {
        Vec::new()
    } else {
        mesh.edges().filter(|&e| mesh.is_boundary(e)).collect()
    };
    let segment = |&e: &EdgeId| {
        let [a, b] = mesh.edge_vertices(e).map(at);
        [a, b, b]
    };
    let curves = Triangles::new(edges.iter().map(segment).collect());
    const BLOCK: usize = 4096;
    let mut lists = Lists {
        first: vec![None; mesh.face_slots()],
        next: vec![None; original.points.len()],
        is_across: vec![false; original.points.len()],
    };
    let owners: Vec<Option<(FaceId, bool)>> = original
        .points
        .par_chunks(BLOCK)
        .enumerate()
        .flat_map_iter(|(block, points)| {
            let (mut guess, mut curve_guess) = (None, None);
            let (set, curves, faces, edges) = (&set, &curves, &faces, &edges);
            points.iter().enumerate().map(move |(k, point)| {
                let i = block * BLOCK + k;
                if original.weights[i] <= 0.0 {
                    return None;
                }
                if i < original.boundary_begin {
                    let nearest = set.nearest_from(point.as_dvec3(), guess)?;
                    guess = Some(nearest.slot);
                    let triangle = &set.corners()[nearest.slot as usize];
                    let is_across = !original.faces_as(i, triangle);
                    Some((faces[nearest.triangle as usize], is_across))
                } else {
                    let nearest = curves.nearest_from(point.as_dvec3(), curve_guess)?;
                    curve_guess = Some(nearest.slot);
                    let [a, b, _] = curves.corners()[nearest.slot as usize];
                    // A boundary that is gone must not pull at another.
                    let is_near = nearest.distance_squared <= a.distance_squared(b);
                    is_near.then(|| (edges[nearest.triangle as usize].face(), false))
                }
            })
        })
        .collect();
    for (i, owner) in owners.into_iter().enumerate().rev() {
        if let Some((f, is_across)) = owner {
            lists.push(f, i);
            lists.is_across[i] = is_across;
        }
    }
    lists
}

/// The boundary at a vertex of an open fan: two edges, and those across from it that are boundary
/// too.
struct Curve {
    /// The neighbours along the boundary.
    ends: [DVec3; 2],
    fixed: Vec<[DVec3; 2]>,
    /// The weight of a boundary's length against the surface's area: a length, times what boundary
    /// is worth.
    weight: f64,
    /// What brings lengths into the unit box.
    scale: f64,
}

impl Curve {
    fn around(star: &Star, here: DVec3, scale: f64) -> Self {
        let ends = [star.rim[0][0], star.rim[star.rim.len() - 1][1]];
        let length = ends[0].distance(here) + ends[1].distance(here);
        let fixed = star.rim.iter().zip(&star.rim_is_boundary);
        Self {
            ends,
            fixed: fixed.filter(|(_, is)| **is).map(|(rim, _)| *rim).collect(),
            weight: LINE_WEIGHT * BOUNDARY_WEIGHT * length * scale / 2.0,
            scale,
        }
    }

    /// The point nearest to `p` while the vertex is `here`, and the direction of its edge; the first
    /// weight is the vertex's.
    fn foot(&self, p: DVec3, here: DVec3) -> (Foot, DVec3) {
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
    fn add_to_original(&self, boundary: &Triangles, here: DVec3, measure: &mut Measure) {
        let squared = |p| ToOriginal::of(p, boundary, None).squared;
        let at_vertex = squared(here);
        for end in self.ends {
            let weight = self.weight * here.distance(end) * self.scale;
            measure.add(at_vertex, weight / 6.0);
            measure.add(squared((here + end) / 2.0), weight * (2.0 / 3.0));
        }
    }
}

/// The normal equations of a vertex's step.
#[derive(Default)]
struct System {
    m: Symmetric,
    b: DVec3,
    weight: f64,
}

impl System {
    /// A sample at `offset` from its foot, of which the vertex has the share `share`, measured along
    /// `direction`.
    #[inline(always)]
    fn add(&mut self, direction: DVec3, offset: DVec3, share: f64, weight: f64) {
        let squared_share = weight * share * share;
        self.weight += squared_share;
        self.b += direction * (weight * share * offset.dot(direction));
        self.m.add_outer(direction, squared_share);
    }

    /// The step.
    fn solve(&self) -> Option<DVec3> {
        let step = Factor::of(&self.m, RIDGE * self.weight)?.solve(self.b);
        step.is_finite().then_some(step)
    }
}

/// The distances of the items with the vertex `there`, and on which face each lands: from its own
/// across the spokes as long as that is nearer.
fn measure_items(star: &mut Star, there: DVec3) -> Measure {
    let faces = star.faces.len();
    let mut measure = Measure::default();
    star.landed.clear();
    for item in &star.items {
        let foot = |face: usize| {
            let [a, b] = star.rim[face];
            let foot = foot_on_triangle(item.point, &[there, a, b]);
            (foot, foot.point.distance_squared(item.point))
        };
        let mut face = item.face;
        let (mut at, mut squared) = foot(face);
        for _ in 0..faces {
            let beside = if at.weights[2] == 0.0 {
                face.checked_sub(1).or(star.is_closed.then_some(faces - 1))
            } else if at.weights[1] == 0.0 {
                Some(face + 1)
                    .filter(|&f| f < faces)
                    .or(star.is_closed.then_some(0))
            } else {
                None
            };
            let Some(beside) = beside else { break };
            let (there, nearer) = foot(beside);
            if nearer >= squared {
                break;
            }
            (face, at, squared) = (beside, there, nearer);
        }
        measure.add(squared, item.weight);
        star.landed.push(face);
    }
    measure
}

fn squared_distance(point: DVec3, triangle: &[DVec3; 3]) -> f64 {
    nearest_on_triangle(point, triangle).distance_squared(point)
}

fn area(&[a, b, c]: &[DVec3; 3]) -> f64 {
    (b - a).cross(c - a).length() / 2.0
}

/// Whether a face around would turn too far or become too thin if the vertex went there.
fn turns(rim: &[[DVec3; 2]], here: DVec3, there: DVec3) -> bool {
    rim.iter().any(|&[a, b]| {
        let before = (a - here).cross(b - here);
        let after = (a - there).cross(b - there);
        let (before_length, after_length) = (before.length(), after.length());
        let turned = before.dot(after) < TURN * before_length * after_length;
        let longest = (a - there)
            .length_squared()
            .max((b - there).length_squared())
            .max((a - b).length_squared());
        turned || (after_length < THIN * longest && after_length < before_length)
    })
}

/// By how much a flip must lower the energy, relatively; nothing where it would fold the surface or
/// make slivers.
fn flip_gain(old: &[[DVec3; 3]; 2], new: &[[DVec3; 3]; 2]) -> Option<f64> {
    let normal = |&[a, b, c]: &[DVec3; 3]| (b - a).cross(c - a);
    let mean = old
        .iter()
        .map(|t| normal(t).normalize_or_zero())
        .sum::<DVec3>();
    let mean = mean.normalize_or_zero();
    let quality = |t: &[DVec3; 3]| {
        let [a, b, c] = *t;
        let edges = (b - a).length_squared() + (c - b).length_squared() + (a - c).length_squared();
        2.0 * 3f64.sqrt() * normal(t).length() / edges
    };
    let worst = |pair: &[[DVec3; 3]; 2]| quality(&pair[0]).min(quality(&pair[1]));
    let (worst_old, worst_new) = (worst(old), worst(new));
    let keeps_side = new
        .iter()
        .all(|t| normal(t).normalize_or_zero().dot(mean) >= TURN);
    let loss = (1.0 - worst_new / worst_old).max(0.0);
    (keeps_side && (worst_new >= SLIVER || loss == 0.0)).then_some(FLIP_GAIN + QUALITY_PRICE * loss)
}
