//! What attributes add to the cost of a collapse, and what they become.
//!
//! On a face an attribute is linear: its gradient g says how it changes along the surface (Hoppe 1999,
//! section 3). A vertex at y with the number s misses what a face at the vertex p of number t says by
//! s − t − g·(y − p). Squared, times the face's area, added up over the faces around a wedge: of p and t
//! nothing is left but differences, since every face passes through them, so that a wedge's memory is
//! as short as the geometry's. For a given y the best number is their mean; what remains is a quadratic
//! form in y, which joins that of the planes.

use glam::{DVec3, Vec3};
use smallvec::{SmallVec, smallvec};

use super::form::{
    Form, LANES, Lanes, Matrix, Number, Vector, cross, dot, minus, plus, scaled, times,
};
use super::{between, doubles, each, each_ref};
use crate::decimate::options::{AttributeUse, Placement};
use crate::decimate::surface::Surface;
use crate::decimate::wedges::{Carried, Members, Pairs, Wedges};
use crate::mesh::{EdgeId, EdgeStore, FaceId, VertexId};

/// A face this thin, as twice its area against its longest squared edge, has its gradients taken as if
/// it were so thick: across a needle any difference is a cliff.
const THIN: f64 = 0.02;

/// The attributes around every wedge.
///
/// A row is Σ area · g for each number of the attributes, then Σ area · Σ g gᵀ, each number by its scale,
/// then Σ area, and zeros to the next four.
pub struct AttributeForms {
    rows: Vec<f32>,
    /// A row of no faces.
    nothing: Vec<f32>,
    /// One flag a vertex that is being brought up to date.
    is_listed: Vec<bool>,
    /// The corners at those; kept for its memory.
    corners: Vec<EdgeId>,
    /// What each of four faces adds to rows; kept for its memory.
    terms: Vec<Lanes>,
}

/// The length of the rows for so many numbers.
#[inline(always)]
pub fn stride(numbers: usize) -> usize {
    (3 * numbers + 7).next_multiple_of(LANES)
}

/// A list of numbers, or one for each of several edges.
trait Lists: Number {
    type List<'a>: Copy;

    /// The number at a place.
    fn one(list: Self::List<'_>, i: usize) -> Self;

    /// The numbers at four places in a row.
    fn four(list: Self::List<'_>, first: usize) -> [Self; 4];
}

impl Lists for f64 {
    type List<'a> = &'a [f32];

    #[inline(always)]
    fn one(list: &[f32], i: usize) -> Self {
        list[i].into()
    }

    #[inline(always)]
    fn four(list: &[f32], first: usize) -> [Self; 4] {
        doubles(list[first..].first_chunk().expect("as many numbers"))
    }
}

impl Lists for Lanes {
    type List<'a> = [&'a [f32]; LANES];

    #[inline(always)]
    fn one(lists: [&[f32]; LANES], i: usize) -> Self {
        Self::new(each(lists, |list| list[i]))
    }

    #[inline(always)]
    fn four(lists: [&[f32]; LANES], first: usize) -> [Self; 4] {
        let four = |list: &[f32]| Self::new(*list[first..].first_chunk().expect("as many numbers"));
        Self::transpose(each(lists, four))
    }
}

/// A wedge of an end of an edge, or one of each of several edges.
struct End<'a, T: Lists> {
    /// Its row.
    row: T::List<'a>,
    /// Its numbers.
    numbers: T::List<'a>,
    is_head: bool,
}

impl<T: Lists> End<'_, T> {
    #[inline(always)]
    fn slope(&self, i: usize) -> Vector<T> {
        let [x, y, z, _] = T::four(self.row, 3 * i);
        [x, y, z]
    }

    /// Σ area · Σ g gᵀ and Σ area, of so many numbers.
    #[inline(always)]
    fn spread_and_area(&self, width: usize) -> (Matrix<T>, T) {
        let [xx, xy, xz, _] = T::four(self.row, 3 * width);
        let [yy, yz, zz, area] = T::four(self.row, 3 * width + 3);
        ([xx, xy, xz, yy, yz, zz], area)
    }
}

/// What several wedges say of one number s at x from the tail: area · s² − 2 s (sum + slope·x) and what
/// does not depend on s, 2 pull·x + `at_tail`, with s from the first wedge's number.
struct Mean<T> {
    from: T,
    slope: Vector<T>,
    sum: T,
    pull: Vector<T>,
    at_tail: T,
}

impl<T: Lists> Mean<T> {
    /// What they say of the number at a place, `scale` times as large; `areas` are theirs. One that is
    /// no number is taken for the first's.
    #[inline(always)]
    fn of(ends: &[End<T>], areas: &[T], i: usize, along: &Vector<T>, scale: T) -> Self {
        let zero = T::splat(0.0);
        let mut mean = Self {
            from: T::one(ends[0].numbers, i),
            slope: [zero; 3],
            sum: zero,
            pull: [zero; 3],
            at_tail: zero,
        };
        for (end, &area) in ends.iter().zip(areas) {
            let slope = scaled(&end.slope(i), scale);
            let difference = (T::one(end.numbers, i) - mean.from) * scale;
            let is_finite = T::splat(f64::INFINITY).greater(difference * difference);
            let difference = T::choose(is_finite, difference, zero);
            let far = area * difference;
            mean.slope = plus(&mean.slope, &slope);
            mean.pull = plus(&mean.pull, &scaled(&slope, difference));
            if end.is_head {
                let across = dot(&slope, along);
                mean.sum = mean.sum + (far - across);
                mean.at_tail = mean.at_tail + difference * (far - (across + across));
            } else {
                mean.sum = mean.sum + far;
                mean.at_tail = mean.at_tail + difference * far;
            }
        }
        mean
    }
}

/// Adds to an energy what the wedges cost that become one.
#[inline(always)]
fn add_joined<T: Lists>(form: &mut Form<T>, scales: &[f64], ends: &[End<T>], areas: &mut [T]) {
    let (zero, along) = (T::splat(0.0), form.along);
    let mut area = zero;
    for (end, of_end) in ends.iter().zip(&mut *areas) {
        let spread;
        (spread, *of_end) = end.spread_and_area(scales.len());
        area = area + *of_end;
        form.m = plus(&form.m, &spread);
        if end.is_head {
            let across = times(&spread, &along);
            form.b = plus(&form.b, &across);
            form.at_tail = form.at_tail + dot(&along, &across);
        }
    }
    let inverse_area = T::choose(area.greater(zero), T::splat(1.0) / area, zero);
    for (i, &scale) in scales.iter().enumerate().filter(|(_, scale)| **scale > 0.0) {
        let mean = Mean::of(ends, areas, i, &along, T::splat(scale));
        let [x, y, z] = mean.slope;
        let [u, v, w] = scaled(&mean.slope, inverse_area);
        form.m = minus(&form.m, &[u * x, u * y, u * z, v * y, v * z, w * z]);
        form.b = plus(&form.b, &minus(&scaled(&[u, v, w], mean.sum), &mean.pull));
        form.at_tail = form.at_tail + (mean.at_tail - mean.sum * mean.sum * inverse_area);
    }
}

/// [`add_joined`], of four edges at once.
#[inline(never)]
fn add_joined_lanes(form: &mut Form<Lanes>, scales: &[f64], ends: &[End<Lanes>; 2]) {
    add_joined(form, scales, ends, &mut [Lanes::ZERO; 2]);
}

/// A face whose terms are to be added to rows.
#[derive(Clone, Copy)]
struct Face {
    /// Where its corners are.
    corners: [Vec3; 3],
    /// Their wedges.
    wedges: [u32; 3],
    /// Whether it is to be added to those of each.
    is_asked: [bool; 3],
}

impl Face {
    const NOTHING: Self = Self {
        corners: [Vec3::ZERO; 3],
        wedges: [0; 3],
        is_asked: [false; 3],
    };

    /// A face that is to be added to the wedges of the vertices that ask for it.
    #[inline(always)]
    fn of<S: EdgeStore>(
        surface: &Surface<S>,
        f: FaceId,
        is_asked: impl Fn(VertexId) -> bool,
    ) -> Self {
        let [a, b, c] = surface.mesh.face_vertices(f);
        let place = |v| surface.geometry.position(v);
        let wedges = surface.wedges.at[f.edges()[0].index()..].first_chunk();
        Self {
            corners: [place(a), place(b), place(c)],
            wedges: *wedges.expect("a face has three corners"),
            is_asked: [is_asked(a), is_asked(b), is_asked(c)],
        }
    }
}

/// The areas of four faces, and by what a number rises along them that is 1 more at the second and the
/// third corner than at the first; zeros where there is no area. In the unit box.
#[inline(always)]
fn areas_and_rises(faces: &[Face; LANES], scale: f32) -> (Lanes, [Vector<Lanes>; 2]) {
    let place = |p: Vec3| Lanes::new([p.x, p.y, p.z, 0.0]);
    let [a, b, c] = [0, 1, 2].map(|k| {
        let [x, y, z, _] = Lanes::transpose(each_ref(faces, |face| place(face.corners[k])));
        [x, y, z]
    });
    let scale = Lanes::splat(scale);
    let (ab, ac) = (between(&a, &b, scale), between(&a, &c, scale));
    let bc = minus(&ac, &ab);
    let normal = cross(&ab, &ac);
    let longest = dot(&ab, &ab).fast_max(dot(&ac, &ac));
    let longest = longest.fast_max(dot(&bc, &bc));
    let squared = dot(&normal, &normal);
    let thick = squared.fast_max(Lanes::splat((THIN * THIN) as f32) * longest * longest);
    let inverse = (Lanes::ONE / thick) & squared.greater(Lanes::ZERO);
    let rises = [cross(&ac, &normal), cross(&normal, &ab)];
    (
        squared.sqrt() * Lanes::HALF,
        rises.map(|rise| scaled(&rise, inverse)),
    )
}

impl AttributeForms {
    /// The forms of a surface; nothing where no attribute is to be optimized.
    pub fn new<S: EdgeStore>(surface: &Surface<S>) -> Option<Self> {
        let wedges = &surface.wedges;
        if wedges.is_empty() || wedges.layout.usage != AttributeUse::Optimize {
            return None;
        }
        let mesh = &surface.mesh;
        let stride = stride(wedges.layout.width());
        let mut forms = Self {
            rows: vec![0.0; stride * wedges.count()],
            nothing: vec![0.0; stride],
            is_listed: vec![false; mesh.vertex_slots()],
            corners: Vec::new(),
            terms: vec![Lanes::ZERO; stride],
        };
        let faces = mesh.faces().map(|f| Face::of(surface, f, |_| true));
        forms.add_all(surface, faces);
        forms.weigh(surface, mesh.vertices());
        Some(forms)
    }

    /// Multiplies the rows of vertices by their weights.
    fn weigh<S: EdgeStore>(
        &mut self,
        surface: &Surface<S>,
        vertices: impl Iterator<Item = VertexId>,
    ) {
        if surface.weights.is_empty() {
            return;
        }
        for v in vertices {
            let weight = surface.weight(v) as f32;
            for wedge in surface.wedges.at_vertex(&surface.mesh, v) {
                let row = self.row_mut(wedge);
                row.iter_mut().for_each(|number| *number *= weight);
            }
        }
    }

    /// Adds faces, four at a time.
    #[inline(always)]
    fn add_all<S: EdgeStore>(&mut self, surface: &Surface<S>, faces: impl Iterator<Item = Face>) {
        let (wedges, scale) = (&surface.wedges, surface.geometry.scale() as f32);
        let mut four = [Face::NOTHING; LANES];
        let mut count = 0;
        faces.for_each(|face| {
            four[count] = face;
            count += 1;
            if count == LANES {
                self.add_four(wedges, scale, &four);
                count = 0;
            }
        });
        if count > 0 {
            four[count..].fill(Face::NOTHING);
            self.add_four(wedges, scale, &four);
        }
    }

    /// Adds four faces to the wedges of those of their corners that ask for it.
    #[inline(never)]
    fn add_four(&mut self, wedges: &Wedges, scale: f32, faces: &[Face; LANES]) {
        // What the compiler knows it need not count: that takes two thirds of the instructions.
        match wedges.layout.width() {
            1 => self.add_four_of(1, wedges, scale, faces),
            2 => self.add_four_of(2, wedges, scale, faces),
            3 => self.add_four_of(3, wedges, scale, faces),
            4 => self.add_four_of(4, wedges, scale, faces),
            5 => self.add_four_of(5, wedges, scale, faces),
            6 => self.add_four_of(6, wedges, scale, faces),
            7 => self.add_four_of(7, wedges, scale, faces),
            8 => self.add_four_of(8, wedges, scale, faces),
            width => self.add_four_of(width, wedges, scale, faces),
        }
    }

    /// [`add_four`](Self::add_four), of so many numbers.
    #[inline(always)]
    fn add_four_of(&mut self, width: usize, wedges: &Wedges, scale: f32, faces: &[Face; LANES]) {
        let (area, rises) = areas_and_rises(faces, scale);
        let row = |wedge: u32| &wedges.values[wedge as usize * width..][..width];
        let a = each_ref(faces, |face| row(face.wedges[0]));
        let b = each_ref(faces, |face| row(face.wedges[1]));
        let c = each_ref(faces, |face| row(face.wedges[2]));
        let scales = &wedges.layout.scales[..width];
        let stride = stride(width);
        let terms = &mut self.terms[..stride];
        let mut spread = [Lanes::ZERO; 6];
        for i in 0..width {
            let start = Lanes::one(a, i);
            let (to_b, to_c) = (Lanes::one(b, i) - start, Lanes::one(c, i) - start);
            let slope = plus(&scaled(&rises[0], to_b), &scaled(&rises[1], to_c));
            let [x, y, z] = scaled(&slope, Lanes::splat(scales[i] as f32));
            // A number that is none, or too large, says nothing.
            let squared = dot(&[x, y, z], &[x, y, z]);
            let is_finite = Lanes::splat(f32::INFINITY).greater(squared);
            let [x, y, z] = [x & is_finite, y & is_finite, z & is_finite];
            spread = plus(&spread, &[x * x, x * y, x * z, y * y, y * z, z * z]);
            for k in 0..3 {
                terms[3 * i + k] = (slope[k] * area) & is_finite;
            }
        }
        for (k, number) in scaled(&spread, area).into_iter().enumerate() {
            terms[3 * width + k] = number;
        }
        terms[3 * width + 6] = area;
        terms[3 * width + 7..].fill(Lanes::ZERO);
        // From number by number to face by face.
        let (fours, _) = terms.as_chunks_mut::<LANES>();
        for four in fours.iter_mut() {
            *four = Lanes::transpose(*four);
        }
        for (i, face) in faces.iter().enumerate() {
            for k in 0..3 {
                if face.is_asked[k] {
                    let row = &mut self.rows[face.wedges[k] as usize * stride..][..stride];
                    let (sums, _) = row.as_chunks_mut::<LANES>();
                    for (sums, four) in sums.iter_mut().zip(&*fours) {
                        *sums = (Lanes::new(*sums) + four[i]).to_array();
                    }
                }
            }
        }
    }

    /// Brings the wedges of these vertices up to date, each vertex once; those of `many` faces or more
    /// stay as they are. Costs a walk around each.
    pub fn update<S: EdgeStore>(
        &mut self,
        surface: &Surface<S>,
        vertices: &[VertexId],
        many: usize,
    ) {
        let (mesh, wedges) = (&surface.mesh, &surface.wedges);
        let stride = self.terms.len();
        self.rows.resize(stride * wedges.count(), 0.0);
        let mut corners = std::mem::take(&mut self.corners);
        for &v in vertices {
            let begin = corners.len();
            corners.extend(mesh.outgoing_edges(v).take(many));
            if corners.len() - begin == many {
                corners.truncate(begin);
                continue;
            }
            self.is_listed[v.index()] = true;
            for corner in &corners[begin..] {
                self.row_mut(wedges.at[corner.index()]).fill(0.0);
                if !wedges.has_several(v) {
                    break;
                }
            }
        }
        let is_listed = std::mem::take(&mut self.is_listed);
        let is_asked = |x: VertexId| is_listed[x.index()];
        let is_first = |&&e: &&EdgeId| {
            // Each face once: from the first of its vertices that ask.
            let v = mesh.tail(e);
            let is_later = |x: VertexId| x > v || !is_asked(x);
            is_later(mesh.head(e)) && is_later(mesh.apex(e))
        };
        let firsts = corners.iter().filter(is_first);
        let faces = firsts.map(|e| Face::of(surface, e.face(), is_asked));
        self.add_all(surface, faces);
        self.weigh(surface, vertices.iter().copied().filter(|&v| is_asked(v)));
        corners.clear();
        (self.corners, self.is_listed) = (corners, is_listed);
        for &v in vertices {
            self.is_listed[v.index()] = false;
        }
    }

    fn row_mut(&mut self, wedge: u32) -> &mut [f32] {
        let stride = self.terms.len();
        &mut self.rows[wedge as usize * stride..][..stride]
    }

    #[inline(always)]
    fn row(&self, wedge: u32) -> &[f32] {
        let stride = self.terms.len();
        &self.rows[wedge as usize * stride..][..stride]
    }

    #[inline(always)]
    fn end<'a, S>(&'a self, surface: &'a Surface<S>, wedge: u32, is_head: bool) -> End<'a, f64> {
        End {
            row: self.row(wedge),
            numbers: surface.wedges.row(wedge),
            is_head,
        }
    }

    /// Adds to the energy of an edge what its attributes cost.
    pub fn add_to<S: EdgeStore>(&self, form: &mut Form<f64>, surface: &Surface<S>, e: EdgeId) {
        let (wedges, scales) = (&surface.wedges, &surface.wedges.layout.scales);
        if let Some([tail, head]) = wedges.only_at_ends(&surface.mesh, e) {
            let ends = [
                self.end(surface, tail, false),
                self.end(surface, head, true),
            ];
            add_joined(form, scales, &ends, &mut [0.0; 2]);
            return;
        }
        for members in wedges.joined_by(&surface.mesh, e) {
            let ends: SmallVec<[_; 4]> = self.ends(surface, &members).collect();
            let mut areas: SmallVec<[f64; 4]> = smallvec![0.0; ends.len()];
            add_joined(form, scales, &ends, &mut areas);
        }
    }

    fn ends<'a, S>(
        &'a self,
        surface: &'a Surface<S>,
        members: &'a Members,
    ) -> impl Iterator<Item = End<'a, f64>> {
        members
            .iter()
            .map(|&(wedge, is_head)| self.end(surface, wedge, is_head))
    }

    /// Adds to the energies of edges what their attributes cost. Says of which that is too much, where
    /// more than two wedges become one.
    #[inline(always)]
    pub fn add_to_lanes<S: EdgeStore>(
        &self,
        form: &mut Form<Lanes>,
        surface: &Surface<S>,
        edges: &[EdgeId; LANES],
    ) -> [bool; LANES] {
        let wedges = &surface.wedges;
        let [a, b, c, d] = each(*edges, |e| wedges.only_at_ends(&surface.mesh, e));
        if let (Some(a), Some(b), Some(c), Some(d)) = (a, b, c, d) {
            let end = |is_head: bool| {
                let at = each([a, b, c, d], |pair| pair[usize::from(is_head)]);
                End {
                    row: each(at, |wedge| self.row(wedge)),
                    numbers: each(at, |wedge| wedges.row(wedge)),
                    is_head,
                }
            };
            let ends = [end(false), end(true)];
            add_joined_lanes(form, &wedges.layout.scales, &ends);
            return [false; LANES];
        }
        self.add_pairs(form, surface, edges)
    }

    /// [`add_to_lanes`](Self::add_to_lanes) where an end has several wedges.
    #[inline(never)]
    fn add_pairs<S: EdgeStore>(
        &self,
        form: &mut Form<Lanes>,
        surface: &Surface<S>,
        edges: &[EdgeId; LANES],
    ) -> [bool; LANES] {
        let wedges = &surface.wedges;
        let pairs = edges.map(|e| match wedges.only_at_ends(&surface.mesh, e) {
            Some(pair) => Some(smallvec![pair.map(Some)]),
            None => wedges.pairs(&surface.mesh, e),
        });
        let most = pairs.iter().flatten().map(Pairs::len).max();
        for i in 0..most.unwrap_or(0) {
            // A wedge that is missing has no area, and takes the numbers of the one that is there.
            let pair = |pairs: &Option<Pairs>| {
                let pair = pairs.as_ref().and_then(|pairs| pairs.get(i));
                pair.copied().unwrap_or_default()
            };
            let four = each_ref(&pairs, pair);
            let end = |is_head: bool| {
                let at = each(four, |pair| pair[usize::from(is_head)]);
                let numbers = each(four, |[tail, head]| {
                    let [this, other] = if is_head { [head, tail] } else { [tail, head] };
                    wedges.row(this.or(other).unwrap_or(0))
                });
                End {
                    row: each(at, |wedge| wedge.map_or(&self.nothing[..], |w| self.row(w))),
                    numbers,
                    is_head,
                }
            };
            let ends = [end(false), end(true)];
            add_joined_lanes(form, &wedges.layout.scales, &ends);
        }
        each_ref(&pairs, Option::is_none)
    }

    /// The wedges of the vertex that is left of an edge, with the numbers that suit its place best.
    fn carried<S: EdgeStore>(&self, surface: &Surface<S>, e: EdgeId, position: Vec3) -> Carried {
        let [v, w] = surface.mesh.edge_vertices(e);
        let along = surface.geometry.between(v, w).to_array();
        let from = surface.geometry.position(v).as_dvec3();
        let way = (position.as_dvec3() - from) * surface.geometry.scale();
        let width = surface.wedges.layout.width();
        let mut carried = surface.interpolated(e, position);
        for joined in &mut carried {
            let ends: SmallVec<[_; 4]> = self.ends(surface, &joined.members).collect();
            let areas = ends.iter().map(|end| end.spread_and_area(width).1);
            let areas: SmallVec<[f64; 4]> = areas.collect();
            let area: f64 = areas.iter().sum();
            for (i, number) in joined.values.iter_mut().enumerate() {
                let mean = Mean::of(&ends, &areas, i, &along, 1.0);
                let best = mean.from + (mean.sum + dot(&mean.slope, &way.to_array())) / area;
                if best.is_finite() {
                    *number = best as f32;
                }
            }
        }
        carried
    }

    /// Lets the numbers of vertices that were moved follow them along the surface; `before` are the
    /// positions, one a slot, at which these forms were made.
    pub fn follow<S: EdgeStore>(&self, surface: &mut Surface<S>, before: &[Vec3]) {
        for (v, &from) in before.iter().enumerate() {
            let v = VertexId::new(v);
            let way = surface.geometry.vector(from, v);
            if way == DVec3::ZERO {
                continue;
            }
            let width = surface.wedges.layout.width();
            for wedge in surface.wedges.at_vertex(&surface.mesh, v) {
                let row = self.row(wedge);
                let area = f64::from(row[3 * width + 6]);
                let steps = row[..3 * width].chunks_exact(3).map(|slope| {
                    let slope = DVec3::new(slope[0].into(), slope[1].into(), slope[2].into());
                    slope.dot(way) / area
                });
                surface.wedges.shift(wedge, steps);
            }
        }
    }

    /// The bytes that the rows hold.
    pub fn bytes(&self) -> usize {
        self.rows.capacity() * size_of::<f32>() + self.is_listed.capacity()
    }
}

/// Costs that were computed [together](AttributeForms::add_to_lanes); where that was too
/// much, as `alone` says.
#[inline(always)]
pub fn corrected(
    mut costs: [f32; LANES],
    is_too_much: [bool; LANES],
    edges: &[EdgeId; LANES],
    alone: impl Fn(EdgeId) -> f32,
) -> [f32; LANES] {
    for i in 0..LANES {
        if is_too_much[i] || !costs[i].is_finite() {
            costs[i] = alone(edges[i]);
        }
    }
    costs
}

/// The wedges of the vertex that is left of an edge if it goes to `position`: with the numbers that
/// suit it best, but with those of an end where it has to be one.
pub fn carried<S: EdgeStore>(
    forms: Option<&AttributeForms>,
    surface: &Surface<S>,
    e: EdgeId,
    placement: Placement,
    position: Vec3,
) -> Carried {
    if surface.wedges.is_empty() {
        return Carried::new();
    }
    match forms {
        Some(forms) if placement == Placement::Optimal && surface.held(e) == [false; 2] => {
            forms.carried(surface, e, position)
        }
        _ => surface.interpolated(e, position),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::{Accumulated, Cost, Memoryless, tests::surface};
    use super::*;
    use crate::decimate::geometry::{Geometry, Room};
    use crate::decimate::options::Options;
    use crate::decimate::wedges::{FlatWedges, Layout};
    use crate::mesh::Full;
    use crate::progress::unheard;
    use crate::shapes::{self, Shape};

    /// A surface with so many numbers at each corner, of which those of every third face are other
    /// wedges: seams end, meet and cross.
    fn carrying((positions, triangles): Shape, width: usize) -> Surface<Full> {
        let count = positions.len() as u32;
        let corners = triangles.iter().enumerate();
        let corners = corners.map(|(f, t)| t.map(|v| if f % 3 == 0 { v + count } else { v }));
        let mut layout = Layout::default();
        layout.usage = AttributeUse::Optimize;
        layout.scales = (0..width).map(|i| 0.1 * i as f64).collect();
        let numbers = positions.iter().chain(&positions).enumerate();
        let flat = FlatWedges {
            corners: corners.collect(),
            values: numbers
                .flat_map(|(w, p)| {
                    (0..width).map(move |i| p[i % 3] * p.y + (w * i % 7) as f32 / 9.0)
                })
                .collect(),
            groups: Vec::new(),
            layout: Arc::new(layout),
        };
        // Room for any optimum: where there is none, lanes know nothing of it.
        let room = Room::around([Vec3::splat(-99.0), Vec3::splat(99.0)]);
        let geometry = Geometry::new(positions.clone(), room);
        let mut surface = surface::<Full>((positions, triangles));
        surface.geometry = geometry;
        surface.wedges = flat.into_wedges(&surface.mesh, &[]);
        surface
    }

    /// Of widths that the compiler knows, and one that it does not.
    fn surfaces() -> impl Iterator<Item = Surface<Full>> {
        [1, 2, 3, 4, 7, 11].into_iter().flat_map(|width| {
            [
                shapes::icosphere(2),
                shapes::torus(9, 7),
                shapes::grid(4, 5),
                shapes::three_fins(3),
            ]
            .map(|shape| carrying(shape, width))
        })
    }

    /// The row of a wedge, face by face and number by number in double precision.
    fn one_by_one(surface: &Surface<Full>, wedge: u32) -> Vec<f64> {
        let (mesh, wedges) = (&surface.mesh, &surface.wedges);
        let width = wedges.layout.width();
        let mut row = vec![0.0; stride(width)];
        for f in mesh.faces() {
            let at = f.edges().map(|e| wedges.at[e.index()]);
            if !at.contains(&wedge) {
                continue;
            }
            let [a, b, c] = mesh.face_vertices(f);
            let (ab, ac) = (
                surface.geometry.between(a, b),
                surface.geometry.between(a, c),
            );
            let normal = ab.cross(ac);
            let area = normal.length() / 2.0;
            for (i, scale) in wedges.layout.scales.iter().enumerate() {
                let [s, t, u] = at.map(|w| f64::from(wedges.row(w)[i]));
                // Along the face: rises by t − s towards b, by u − s towards c.
                let g = (ac.cross(normal) * (t - s) + normal.cross(ab) * (u - s))
                    / normal.length_squared();
                let scaled = g * *scale;
                for (k, x) in g.to_array().into_iter().enumerate() {
                    row[3 * i + k] += area * x;
                }
                let [x, y, z] = scaled.to_array();
                let products = [x * x, x * y, x * z, y * y, y * z, z * z];
                for (k, product) in products.into_iter().enumerate() {
                    row[3 * width + k] += area * product;
                }
            }
            row[3 * width + 6] += area;
        }
        row
    }

    fn assert_right(forms: &AttributeForms, surface: &Surface<Full>) {
        for wedge in 0..surface.wedges.count() as u32 {
            let expected = one_by_one(surface, wedge);
            let largest = expected.iter().fold(0.0, |max: f64, x| max.max(x.abs()));
            for (x, expected) in forms.row(wedge).iter().zip(expected) {
                let wrong = (f64::from(*x) - expected).abs();
                assert!(wrong <= 1e-5 * largest, "{wedge}: {x} for {expected}");
            }
        }
    }

    #[test]
    fn rows_add_up_what_their_faces_say() {
        for surface in surfaces() {
            assert_right(&AttributeForms::new(&surface).unwrap(), &surface);
        }
    }

    /// What moved and what lies around it is as if computed anew; with a weight, as many times as much.
    #[test]
    fn what_is_brought_up_to_date_is_right() {
        for mut surface in surfaces() {
            let mut forms = AttributeForms::new(&surface).unwrap();
            let v = VertexId::new(6);
            let position = surface.geometry.position(v) + Vec3::new(0.01, 0.02, 0.03);
            surface.geometry.set_position(v, position);
            let mut changed: Vec<VertexId> = surface.mesh.neighbours(v).chain([v]).collect();
            changed.sort_unstable();
            changed.dedup();
            forms.update(&surface, &changed, usize::MAX);
            assert_right(&forms, &surface);
            let before = forms
                .row(surface.wedges.at_vertex(&surface.mesh, v)[0])
                .to_vec();
            surface.weights = vec![2.0; surface.mesh.vertex_slots()];
            forms.update(&surface, &changed, usize::MAX);
            let after = forms.row(surface.wedges.at_vertex(&surface.mesh, v)[0]);
            assert!(before.iter().zip(after).all(|(x, y)| 2.0 * x == *y));
        }
    }

    /// The loop waits for a candidate that costs 5 % more than it was queued at.
    fn are_alike<C: Cost<Full>>(surface: &Surface<Full>) {
        let model = unheard(|meter| C::new(surface, &Options::default(), meter));
        let edges: Vec<EdgeId> = surface.mesh.edges().collect();
        for four in edges.windows(LANES) {
            let four = four.first_chunk().unwrap();
            for (lane, &e) in model.costs(surface, four).into_iter().zip(four) {
                let one = model.evaluate(surface, e, [false; 2]).unwrap().cost;
                let wrong = (f64::from(lane) - one).abs();
                let width = surface.wedges.layout.width();
                assert!(
                    wrong <= 0.02 * one + 1e-8,
                    "{width}, {e:?}: {lane} for {one}"
                );
            }
        }
    }

    #[test]
    fn costs_in_lanes_are_about_what_one_evaluation_says() {
        for surface in surfaces() {
            are_alike::<Accumulated>(&surface);
            are_alike::<Memoryless>(&surface);
        }
    }
}
