//! A piece in work: which samples lie on which face, how far all is, and the steps that lessen it.

use glam::{Vec3, Vec4};
use rayon::prelude::*;

use super::cells::{Cells, Seen};
use super::curve::Curve;
use super::measure::{FaceToOriginal, Measure, Measures, ToOriginal};
use super::original::{self, Original, area, scaled};
use super::star::{CurveItem, Fours, Star};
use super::{FINDING, LOOK, MARGIN, Number, STEP, WIDEST, index, number};
use crate::decimate::surface::Surface;
use crate::mesh::{EdgeId, EdgeStore, FaceId, Opposite, Outgoing, VertexId};
use crate::nearest::{Faces, GROUP, Near, Patch, Points};
use crate::progress::{self, Meter};

/// A step may raise the largest distance around it up to this many times the rms of the whole: high
/// enough not to hinder, low enough to keep the Hausdorff distance. 3 costs 4 % of rms; from 8 on
/// nothing changes.
const ALLOWED: f64 = 8.0;

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
const SLIVER: f32 = 0.05;

/// No face may turn by more than 60° in a step.
const TURN: f32 = 0.5;

/// A step may not make a face thinner than this (twice its area against its longest squared side),
/// if it makes it thinner at all.
const THIN: f32 = 1e-3;

/// A walk on the original is believed to have found what is nearest where that is nearer, squared,
/// than this share of a face's area; no other sheet is that near. On a model of gears, where a few
/// faces span many of the original's, believing every walk costs 13 % of rms.
const TRUSTED: f32 = 1e-3;

/// Samples that a task of the parallel search takes, and queries of a parallel measuring.
const BLOCK: usize = 4096;

/// Samples or faces that are looked at between two words about it.
const AT_A_TIME: usize = 16 * BLOCK;

/// The samples on each face, as lists that share one array.
#[derive(Default)]
struct Lists {
    first: Vec<Option<Number>>,
    next: Vec<Option<Number>>,
}

impl Lists {
    fn clear(&mut self, faces: usize, samples: usize) {
        self.first.clear();
        self.first.resize(faces, None);
        self.next.clear();
        self.next.resize(samples, None);
    }

    fn on(&self, face: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(self.first[face], |&s| self.next[index(s)]).map(index)
    }

    fn push(&mut self, face: usize, i: usize) {
        self.next[i] = self.first[face].replace(number(i));
    }
}

/// A step of a vertex.
struct Step {
    position: Vec3,
    /// From there to the original.
    corner: ToOriginal,
    /// By how much it lowers the energy around, relatively.
    gain: f64,
}

/// A surface being fitted: what is known of the whole, and of the piece in work.
pub struct Fit<'a, 'b, S> {
    surface: &'a mut Surface<S>,
    original: &'a Original<'b>,
    max_error: Option<f64>,
    scale: f64,
    /// Each face is measured in the centroids of the triangles that so many rows cut it into.
    rows: usize,
    /// The weighted sum of squared distances so far, and the weights.
    total: [f64; 2],
    /// What the largest squared distance may rise to.
    allowed: f64,
    /// The squared distance measured at and around each vertex, by slot.
    measured: Vec<f32>,
    /// The numbers in the piece, by slot.
    place_of_face: Vec<Option<Number>>,
    place_of_vertex: Vec<Option<Number>>,
    piece: original::Piece,
    seen: Seen,
    lists: Lists,
    /// The faces around the piece's vertices.
    faces: Vec<FaceId>,
    to_original: Vec<FaceToOriginal>,
    /// The piece's own vertices and, behind them, the others of its faces.
    vertices: Vec<VertexId>,
    own: usize,
    corners: Vec<ToOriginal>,
    /// The vertices that have found no step since their surroundings changed.
    is_settled: Vec<bool>,
    star: Star,
}

impl<'a, 'b, S: EdgeStore> Fit<'a, 'b, S> {
    pub(super) fn new(
        surface: &'a mut Surface<S>,
        original: &'a Original<'b>,
        max_error: Option<f64>,
    ) -> Self {
        Self {
            scale: surface.geometry.scale(),
            rows: rows(surface.mesh.face_count(), original.len()),
            total: [0.0; 2],
            allowed: 0.0,
            measured: vec![0.0; surface.mesh.vertex_slots()],
            place_of_face: vec![None; surface.mesh.face_slots()],
            place_of_vertex: vec![None; surface.mesh.vertex_slots()],
            piece: original::Piece::default(),
            seen: Seen::default(),
            lists: Lists::default(),
            faces: Vec::new(),
            to_original: Vec::new(),
            vertices: Vec::new(),
            own: 0,
            corners: Vec::new(),
            is_settled: Vec::new(),
            star: Star::default(),
            surface,
            original,
            max_error,
        }
    }

    /// Takes up the piece that has these vertices: finds what of the original lies near, for every
    /// sample the nearest face, and how far every face is from the original. `cells` sorts the faces
    /// listed.
    pub(super) fn take_up(
        &mut self,
        vertices: &[VertexId],
        cells: &Cells,
        listed: &[u32],
        meter: &mut Meter,
    ) -> progress::Result<()> {
        self.name(vertices);
        let mut seen = std::mem::take(&mut self.seen);
        let mut piece = std::mem::take(&mut self.piece);
        let boxes = || self.faces.iter().map(|&f| self.box_around(f));
        piece.fill(self.original, boxes, &mut seen);
        let near = cells.near(boxes(), &mut seen);
        (self.seen, self.piece) = (seen, piece);
        meter.detour(4 * self.piece.points.len())?;
        let near = near
            .iter()
            .map(|&i| FaceId::new(listed[i as usize] as usize));
        let others: Vec<FaceId> = near
            .filter(|f| self.place_of_face[f.index()].is_none())
            .collect();
        self.assign(&others, meter)?;
        self.measure_to_original(meter)?;
        self.allowed = self.total[0] / self.total[1] * (ALLOWED * ALLOWED);
        if let Some(limit) = self.max_error {
            let limit = limit * self.scale;
            self.allowed = self.allowed.min(limit * limit);
        }
        Ok(())
    }

    /// Numbers the vertices and the faces around them.
    fn name(&mut self, vertices: &[VertexId]) {
        self.vertices.clear();
        self.vertices.extend_from_slice(vertices);
        self.own = vertices.len();
        self.faces.clear();
        for (i, v) in vertices.iter().enumerate() {
            self.place_of_vertex[v.index()] = Some(number(i));
        }
        for &v in vertices {
            for f in self.surface.mesh.vertex_faces(v) {
                if self.place_of_face[f.index()].is_some() {
                    continue;
                }
                self.place_of_face[f.index()] = Some(number(self.faces.len()));
                self.faces.push(f);
                for x in self.surface.mesh.face_vertices(f) {
                    if self.place_of_vertex[x.index()].is_none() {
                        self.place_of_vertex[x.index()] = Some(number(self.vertices.len()));
                        self.vertices.push(x);
                    }
                }
            }
        }
        self.is_settled.clear();
        self.is_settled.resize(self.vertices.len(), false);
    }

    /// The box around a face that has in it, in model units, what belongs to the face.
    fn box_around(&self, f: FaceId) -> [Vec3; 2] {
        let vertices = self.surface.mesh.face_vertices(f);
        let [a, b, c] = vertices.map(|v| self.surface.geometry.position(v));
        let (min, max) = (a.min(b).min(c), a.max(b).max(c));
        let deviations = vertices.map(|v| self.surface.geometry.deviation(v));
        let deviation = f64::from(deviations.into_iter().fold(0.0, f32::max)) / self.scale;
        let margin = (MARGIN * deviation as f32).min(WIDEST * (max - min).max_element());
        [min - margin, max + margin]
    }

    fn place(&self, f: FaceId) -> usize {
        index(self.place_of_face[f.index()].expect("a face of the piece"))
    }

    fn number_of(&self, v: VertexId) -> usize {
        index(self.place_of_vertex[v.index()].expect("a vertex of the piece"))
    }

    #[inline(always)]
    fn at(&self, v: VertexId) -> Vec3 {
        scaled(self.surface.geometry.position(v), self.scale)
    }

    #[inline(always)]
    fn triangle(&self, f: FaceId) -> [Vec3; 3] {
        self.surface.mesh.face_vertices(f).map(|v| self.at(v))
    }

    /// Lists the samples that are nearest to each face of the piece, while `others` lie around it.
    ///
    /// Those whose nearest face looks the other way lose their weight: the other side of a thin sheet
    /// is nothing to be fitted to, but not to be left farther behind either. (Searching for a face
    /// that looks the same way instead made one mesh 38 times worse.)
    fn assign(&mut self, others: &[FaceId], meter: &mut Meter) -> progress::Result<()> {
        let all: Vec<FaceId> = self.faces.iter().chain(others).copied().collect();
        let set = Patch::new(all.iter().map(|&f| self.triangle(f)));
        let begin = self.piece.boundary_begin;
        let mut owners: Vec<(Near, bool)> = Vec::with_capacity(begin);
        let points = self.piece.points[..begin].chunks(AT_A_TIME);
        for (points, normals) in points.zip(self.piece.normals[..begin].chunks(AT_A_TIME)) {
            let blocks = points.par_chunks(BLOCK).zip(normals.par_chunks(BLOCK));
            owners.par_extend(blocks.flat_map_iter(|(points, normals)| {
                let near = nearest_of_all(&set, points);
                near.into_iter().zip(normals).map(|(near, normal)| {
                    let [a, b, c] = set.corners(near.triangle);
                    (near, (b - a).cross(c - a).dot(*normal) < 0.0)
                })
            }));
            // About one and a half samples a face.
            meter.work(FINDING * points.len() * 2 / 3)?;
        }
        self.lists.clear(self.faces.len(), self.piece.points.len());
        self.assign_boundary(&all);
        for (i, (near, is_across)) in owners.into_iter().enumerate().rev() {
            if near.triangle as usize >= self.faces.len() {
                continue;
            }
            if is_across {
                self.piece.weights[i] = 0.0;
            }
            let weight = f64::from(self.piece.weights[i]);
            self.total[0] += weight * f64::from(near.squared);
            self.total[1] += weight;
            self.lists.push(near.triangle as usize, i);
        }
        Ok(())
    }

    /// A sample of the boundary belongs to a face at the nearest boundary edge.
    fn assign_boundary(&mut self, all: &[FaceId]) {
        let begin = self.piece.boundary_begin;
        if begin == self.piece.points.len() {
            return;
        }
        let mesh = &self.surface.mesh;
        let edges: Vec<(usize, EdgeId)> = all
            .iter()
            .enumerate()
            .flat_map(|(place, f)| f.edges().map(|e| (place, e)))
            .filter(|&(_, e)| mesh.is_boundary(e))
            .collect();
        let curves = Patch::new(edges.iter().map(|&(_, e)| {
            let [a, b] = mesh.edge_vertices(e).map(|v| self.at(v));
            [a, b, b]
        }));
        if curves.is_empty() {
            return;
        }
        let near = nearest_of_all(&curves, &self.piece.points[begin..]);
        for (i, near) in near.into_iter().enumerate().rev() {
            let [a, b, _] = curves.corners(near.triangle);
            let (place, _) = edges[near.triangle as usize];
            // A boundary that is gone must not pull at another.
            if near.squared <= a.distance_squared(b) && place < self.faces.len() {
                self.lists.push(place, begin + i);
            }
        }
    }

    fn measure_to_original(&mut self, meter: &mut Meter) -> progress::Result<()> {
        let this = &*self;
        let count = this.faces.len();
        let mut to_original: Vec<FaceToOriginal> = Vec::with_capacity(count);
        for first in (0..count).step_by(AT_A_TIME) {
            let last = count.min(first + AT_A_TIME);
            let places = (first..last).into_par_iter().with_min_len(BLOCK);
            to_original.par_extend(places.map(|place| {
                let from = this.face_of_original_at(place);
                let triangle = this.triangle(this.faces[place]);
                this.face_near(&triangle, from)
            }));
            meter.work(FINDING * (last - first))?;
        }
        let mut corners = vec![(None, 0.0); self.vertices.len()];
        for (&f, to_original) in self.faces.iter().zip(&to_original) {
            let trusted = TRUSTED * area(&self.triangle(f));
            for v in self.surface.mesh.face_vertices(f) {
                corners[self.number_of(v)] = (to_original.near, trusted);
            }
        }
        let corners = self
            .vertices
            .iter()
            .zip(corners)
            .map(|(&v, (from, trusted))| self.piece.near(self.at(v), from, trusted))
            .collect();
        (self.to_original, self.corners) = (to_original, corners);
        for (&f, to_original) in self.faces.iter().zip(&self.to_original) {
            let weight = f64::from(area(&self.triangle(f)));
            self.total[0] += weight * f64::from(to_original.mean);
            self.total[1] += weight;
        }
        Ok(())
    }

    /// A face of the original near a face of the piece, by the samples on it or beside it.
    fn face_of_original_at(&self, place: usize) -> Option<u32> {
        let mesh = &self.surface.mesh;
        let mates = self.faces[place]
            .edges()
            .into_iter()
            .filter_map(|e| mesh.mate(e));
        let beside = mates.filter_map(|o| self.place_of_face[o.face().index()].map(index));
        let mut samples = std::iter::once(place)
            .chain(beside)
            .flat_map(|place| self.lists.on(place));
        let is_facing = |&i: &usize| i < self.piece.boundary_begin && self.piece.weights[i] > 0.0;
        samples.find(is_facing).map(|i| self.piece.faces_at[i])
    }

    /// How far a face is from the original, starting from a face of that.
    fn face_near(&self, triangle: &[Vec3; 3], from: Option<u32>) -> FaceToOriginal {
        let trusted = TRUSTED * area(triangle);
        let to = |p, from| self.piece.near(p, from, trusted);
        FaceToOriginal::of(triangle, self.rows, from, to)
    }

    /// Moves each vertex once, if there is a better place for it.
    pub(super) fn move_vertices(&mut self, meter: &mut Meter) -> progress::Result<()> {
        for v in 0..self.own {
            self.move_vertex(self.vertices[v]);
            meter.work(STEP)?;
        }
        Ok(())
    }

    fn move_vertex(&mut self, v: VertexId) {
        let number = self.number_of(v);
        if self.is_settled[number] || self.surface.is_locked(v) {
            return;
        }
        let mut star = std::mem::take(&mut self.star);
        let step = if self.look_around(v, &mut star) {
            self.find_step(v, &mut star)
        } else {
            None
        };
        self.is_settled[number] = true;
        if let Some(step) = step {
            let position = (step.position.as_dvec3() / self.scale).as_vec3();
            self.surface.geometry.set_position(v, position);
            self.corners[number] = step.corner;
            for (&f, &to_original) in star.faces.iter().zip(&star.to_original) {
                let place = self.place(f);
                self.to_original[place] = to_original;
                self.lists.first[place] = None;
            }
            for (four, landed) in star.fours.list.iter().zip(&star.landed) {
                for (sample, &face) in four.samples.iter().flatten().zip(landed) {
                    let place = self.place(star.faces[face as usize]);
                    self.lists.push(place, index(*sample));
                }
            }
            for item in &star.curve_items {
                let place = self.place(star.faces[item.face]);
                self.lists.push(place, item.sample);
            }
            if step.gain > WORTHWHILE {
                self.is_settled[number] = false;
                for x in self.surface.mesh.neighbours(v) {
                    let x = index(self.place_of_vertex[x.index()].expect("beside its own"));
                    self.is_settled[x] = false;
                }
            }
        }
        self.star = star;
    }

    /// Puts the samples on a face behind those of other faces.
    fn collect(&self, f: FaceId, face: usize, fours: &mut Fours, curve: &mut Vec<CurveItem>) {
        fours.begin_face();
        for i in self.lists.on(self.place(f)) {
            let (point, weight) = (self.piece.points[i], self.piece.weights[i]);
            if i < self.piece.boundary_begin {
                fours.push(point, weight, i, face);
            } else {
                curve.push(CurveItem {
                    sample: i,
                    point: point.as_dvec3(),
                    weight: f64::from(weight),
                    face,
                });
            }
        }
    }

    /// Collects what lies around `v`; whether it may move at all.
    fn look_around(&self, v: VertexId, star: &mut Star) -> bool {
        let mesh = &self.surface.mesh;
        let Outgoing::Fan(start) = mesh.outgoing(v) else {
            return false;
        };
        star.is_closed = match mesh.opposite(start) {
            Opposite::Edge(_) => true,
            Opposite::Boundary => false,
            Opposite::NonManifold(_) => return false,
        };
        // Nothing here measures how far a crease, or a boundary that is free, strays.
        if self.surface.curves.touch(v) {
            return false;
        }
        if !star.is_closed && self.piece.boundary.is_empty() {
            return false;
        }
        star.clear();
        for e in mesh.fan(start) {
            star.rim
                .push([mesh.head(e), mesh.apex(e)].map(|v| self.at(v)));
            star.rim_is_boundary.push(mesh.is_boundary(mesh.next(e)));
            let face = star.faces.len();
            star.faces.push(e.face());
            self.collect(e.face(), face, &mut star.fours, &mut star.curve_items);
        }
        !star.fours.list.is_empty()
    }

    /// A better place for `v`.
    fn find_step(&self, v: VertexId, star: &mut Star) -> Option<Step> {
        let here = self.at(v);
        let corner = self.corners[self.number_of(v)];
        let (mut before, mut system) = star.look(here);
        let exactly_here = here.as_dvec3();
        let curve = (!star.is_closed).then(|| Curve::around(star, exactly_here));
        let mut curve_before = Measure::default();
        if let Some(curve) = &curve {
            for item in &star.curve_items {
                let (foot, along) = curve.foot(item.point, exactly_here);
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
            curve.add_to_original(&self.piece.boundary, exactly_here, &mut curve_before);
            before.join(&curve_before);
        }
        for (&f, &[a, b]) in star.faces.iter().zip(&star.rim) {
            let to_original = self.to_original[self.place(f)];
            before.add_face(&[here, a, b], to_original, corner.squared, self.rows);
        }
        if before.largest <= f64::from(self.original.noise_squared) {
            return None;
        }
        let mut step = system.solve()? * RELAXATION;
        for _ in 0..TRIALS {
            let there = (exactly_here + step).as_vec3();
            step *= 0.5;
            let position = (there.as_dvec3() / self.scale).as_vec3();
            if !position.is_finite() || there == here {
                return None;
            }
            let has_room = self.surface.geometry.room().contains(position);
            if !has_room || turns(&star.rim, here, there) {
                continue;
            }
            let mut after = star.measure(there);
            if let Some(curve) = &curve {
                let exactly_there = there.as_dvec3();
                let mut curve_after = Measure::default();
                for item in &star.curve_items {
                    let (foot, _) = curve.foot(item.point, exactly_there);
                    let squared = foot.point.distance_squared(item.point);
                    curve_after.add(squared, curve.weight * item.weight);
                }
                curve.add_to_original(&self.piece.boundary, exactly_there, &mut curve_after);
                // The boundary does not pay for the surface.
                if curve_after.sum > curve_before.sum {
                    continue;
                }
                after.join(&curve_after);
            }
            if !after.is_better(&before, GAIN, self.allowed) {
                continue;
            }
            let [a, b] = star.rim[0];
            let trusted = TRUSTED * area(&[there, a, b]);
            let corner = self.piece.near(there, corner.near, trusted);
            star.to_original.clear();
            for (&f, &[a, b]) in star.faces.iter().zip(&star.rim) {
                let triangle = [there, a, b];
                let guess = self.to_original[self.place(f)].near;
                let face = self.face_near(&triangle, guess);
                after.add_face(&triangle, face, corner.squared, self.rows);
                star.to_original.push(face);
                if !after.is_better(&before, GAIN, self.allowed) {
                    break;
                }
            }
            if after.is_better(&before, GAIN, self.allowed) {
                return Some(Step {
                    position: there,
                    corner,
                    gain: 1.0 - after.sum / before.sum,
                });
            }
        }
        None
    }

    /// Flips each edge of the piece once, if the other diagonal is nearer to the original.
    pub(super) fn flip_edges(&mut self, meter: &mut Meter) -> progress::Result<()> {
        for place in 0..self.faces.len() {
            meter.detour(3 * LOOK)?;
            for e in self.faces[place].edges() {
                if let Some(o) = self.surface.mesh.mate(e).filter(|&o| e < o)
                    && self.place_of_face[o.face().index()].is_some()
                {
                    self.flip_edge(e, o);
                }
            }
        }
        Ok(())
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
        let ([a, b], [c, d]) = (ends.map(|v| self.at(v)), apexes.map(|v| self.at(v)));
        let (old, new) = ([[a, b, c], [b, a, d]], [[d, c, a], [c, d, b]]);
        let Some(gain) = flip_gain(&old, &new) else {
            return;
        };
        let mut star = std::mem::take(&mut self.star);
        star.clear();
        for (k, &f) in faces.iter().enumerate() {
            self.collect(f, k, &mut star.fours, &mut star.curve_items);
        }
        let (old_planes, new_planes) = (old.map(Faces::splat), new.map(Faces::splat));
        let (mut before, mut after) = (Measures::default(), Measures::default());
        star.landed.clear();
        for four in &star.fours.list {
            let feet = old_planes[four.face as usize].feet(&four.points);
            before.add(feet.squared, four.weights);
            let [to_first, to_second] = [0, 1].map(|k| new_planes[k].feet(&four.points).squared);
            after.add(to_first.min(to_second), four.weights);
            let is_second = to_second.cmplt(to_first).bitmask();
            star.landed
                .push([0, 1, 2, 3].map(|lane| is_second >> lane & 1));
        }
        let (before, after) = (before.all(), after.all());
        let is_better = star.curve_items.is_empty()
            && before.largest > f64::from(self.original.noise_squared)
            && after.is_better(&before, gain, self.allowed)
            && self.surface.mesh.flip_condition(e)
            && self
                .surface
                .wedges
                .flip_keeps_charts(&self.surface.mesh, e, o)
            && self.flip_is_better(faces, &old, &new, gain, before, after);
        if is_better {
            self.surface.flip(e);
            let places = faces.map(|f| self.place(f));
            places.into_iter().for_each(|f| self.lists.first[f] = None);
            for (four, landed) in star.fours.list.iter().zip(&star.landed) {
                for (sample, &face) in four.samples.iter().flatten().zip(landed) {
                    self.lists.push(places[face as usize], index(*sample));
                }
            }
        }
        self.star = star;
    }

    /// Whether a flip is better also with the way to the original, which it then notes.
    fn flip_is_better(
        &mut self,
        faces: [FaceId; 2],
        old: &[[Vec3; 3]; 2],
        new: &[[Vec3; 3]; 2],
        gain: f64,
        mut before: Measure,
        mut after: Measure,
    ) -> bool {
        let places = faces.map(|f| self.place(f));
        let to_original = [0, 1].map(|k| {
            let here = self.to_original[places[k]];
            let there = self.face_near(&new[k], here.near);
            before.add_face(&old[k], here, 0.0, self.rows);
            after.add_face(&new[k], there, 0.0, self.rows);
            there
        });
        let is_better = after.is_better(&before, gain, self.allowed);
        if is_better {
            for (place, there) in places.into_iter().zip(to_original) {
                self.to_original[place] = there;
            }
        }
        is_better
    }

    /// Notes how far all is that the piece has, and forgets the piece.
    pub(super) fn put_down(&mut self) {
        let mut star = std::mem::take(&mut self.star);
        for (place, &f) in self.faces.iter().enumerate() {
            star.clear();
            self.collect(f, 0, &mut star.fours, &mut star.curve_items);
            let plane = Faces::splat(self.triangle(f));
            let mut measures = Measures::default();
            for four in &star.fours.list {
                measures.add(plane.feet(&four.points).squared, Vec4::ZERO);
            }
            for item in &star.curve_items {
                let point = Points::splat(item.point.as_vec3());
                measures.add(plane.feet(&point).squared, Vec4::ZERO);
            }
            let on_face = (measures.all().largest as f32).max(self.to_original[place].largest);
            for v in self.surface.mesh.face_vertices(f) {
                let measured = &mut self.measured[v.index()];
                *measured = measured.max(on_face);
            }
        }
        self.star = star;
        for (v, corner) in self.vertices.iter().zip(&self.corners) {
            let measured = &mut self.measured[v.index()];
            *measured = measured.max(corner.squared);
            self.place_of_vertex[v.index()] = None;
        }
        for f in &self.faces {
            self.place_of_face[f.index()] = None;
        }
    }

    /// Replaces the estimated deviation of every vertex by what was measured around it: where pieces
    /// meet, before or after the last step.
    pub(super) fn finish(self) {
        for (v, squared) in self.measured.into_iter().enumerate() {
            let v = VertexId::new(v);
            self.surface.geometry.set_deviation(v, squared.sqrt());
        }
    }

    /// The bytes held, without the original.
    pub(super) fn bytes(&self) -> usize {
        let slots = self.measured.capacity()
            + self.place_of_face.capacity()
            + self.place_of_vertex.capacity();
        let words = slots + self.lists.first.capacity() + self.lists.next.capacity();
        words * size_of::<u32>()
            + self.piece.bytes()
            + self.to_original.capacity() * size_of::<FaceToOriginal>()
            + self.corners.capacity() * size_of::<ToOriginal>()
            + self.is_settled.capacity()
            + (self.faces.capacity() + self.vertices.capacity()) * size_of::<u32>()
            // While samples are assigned: what is near each.
            + self.piece.points.capacity() * size_of::<(Near, bool)>()
    }
}

/// What is nearest to each of some points, neighbours of which lie together.
fn nearest_of_all(set: &Patch, points: &[Vec3]) -> Vec<Near> {
    const NONE: Near = Near {
        squared: 0.0,
        triangle: 0,
    };
    let mut all = Vec::with_capacity(points.len());
    let mut reach = 0.0;
    for group in points.chunks(4 * GROUP) {
        let at = |i: usize| group[i.min(group.len() - 1)];
        let fours: [Points; GROUP] =
            std::array::from_fn(|k| Points::of(std::array::from_fn(|lane| at(4 * k + lane))));
        let fours = &fours[..group.len().div_ceil(4)];
        let mut found = [[NONE; 4]; GROUP];
        set.nearest_of_group(fours, reach, &mut found);
        let found = &found.as_flattened()[..group.len()];
        reach = found.iter().fold(0.0, |m, near| near.squared.max(m));
        all.extend_from_slice(found);
    }
    all
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

/// Whether a face around would turn too far or become too thin if the vertex went there.
fn turns(rim: &[[Vec3; 2]], here: Vec3, there: Vec3) -> bool {
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
fn flip_gain(old: &[[Vec3; 3]; 2], new: &[[Vec3; 3]; 2]) -> Option<f64> {
    let normal = |&[a, b, c]: &[Vec3; 3]| (b - a).cross(c - a);
    let mean = old
        .iter()
        .map(|t| normal(t).normalize_or_zero())
        .sum::<Vec3>();
    let mean = mean.normalize_or_zero();
    let quality = |t: &[Vec3; 3]| {
        let [a, b, c] = *t;
        let edges = (b - a).length_squared() + (c - b).length_squared() + (a - c).length_squared();
        2.0 * 3f32.sqrt() * normal(t).length() / edges
    };
    let worst = |pair: &[[Vec3; 3]; 2]| quality(&pair[0]).min(quality(&pair[1]));
    let (worst_old, worst_new) = (worst(old), worst(new));
    let keeps_side = new
        .iter()
        .all(|t| normal(t).normalize_or_zero().dot(mean) >= TURN);
    let loss = (1.0 - worst_new / worst_old).max(0.0);
    (keeps_side && (worst_new >= SLIVER || loss == 0.0))
        .then_some(FLIP_GAIN + QUALITY_PRICE * f64::from(loss))
}
