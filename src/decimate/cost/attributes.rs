//! What attributes add to the cost of a collapse, and what they become.
//!
//! On a face an attribute is linear: its gradient g says how it changes along the surface (Hoppe 1999,
//! section 3). A vertex at y with the number s misses what a face at the vertex p of number t says by
//! s − t − g·(y − p). Squared, times the face's area, added up over the faces around a wedge: of p and t
//! nothing is left but differences, since every face passes through them, so that a wedge's memory is
//! as short as the geometry's. For a given y the best number is their mean; what remains is a quadratic
//! form in y, which joins that of the planes.

use glam::{DVec3, Vec3};

use super::form::{Form, Matrix, times};
use crate::decimate::options::{AttributeUse, Placement};
use crate::decimate::surface::Surface;
use crate::decimate::wedges::{Carried, Joined};
use crate::mesh::{EdgeId, EdgeStore, VertexId};

/// A face this thin, as twice its area against its longest squared edge, has its gradients taken as if
/// it were so thick: across a needle any difference is a cliff.
const THIN: f64 = 0.02;

/// Where the numbers of a wedge's row stand: Σ area, then Σ area · Σ g gᵀ, weighted, then Σ area · g for
/// each number of the attributes.
const AREA: usize = 0;
const SPREAD: usize = 1;
const SLOPES: usize = 7;

/// The attributes around every wedge.
pub struct AttributeForms {
    rows: Vec<f32>,
    /// The numbers of a row.
    stride: usize,
}

/// A face's area and the gradients of its numbers, in the unit box.
struct Gradients {
    area: f64,
    along: [DVec3; 2],
    corners: [EdgeId; 3],
}

impl Gradients {
    fn of<S: EdgeStore>(surface: &Surface<S>, e: EdgeId) -> Option<Self> {
        let (mesh, geometry) = (&surface.mesh, &surface.geometry);
        let corners = [e, mesh.next(e), mesh.prev(e)];
        let [a, b, c] = corners.map(|corner| mesh.tail(corner));
        let (ab, ac) = (geometry.between(a, b), geometry.between(a, c));
        let normal = ab.cross(ac);
        let longest = ab.length_squared().max(ac.length_squared());
        let longest = longest.max((ac - ab).length_squared());
        let squared = normal.length_squared();
        let thick = squared.max(THIN * THIN * longest * longest);
        (squared > 0.0).then(|| Self {
            area: squared.sqrt() / 2.0,
            along: [ac.cross(normal) / thick, normal.cross(ab) / thick],
            corners,
        })
    }
}

impl AttributeForms {
    /// The forms of a surface; nothing where no attribute is to be optimized.
    pub fn new<S: EdgeStore>(surface: &Surface<S>) -> Option<Self> {
        let wedges = &surface.wedges;
        if wedges.is_empty() || wedges.layout.usage != AttributeUse::Optimize {
            return None;
        }
        let stride = SLOPES + 3 * wedges.layout.width();
        let mut forms = Self {
            rows: vec![0.0; stride * wedges.count()],
            stride,
        };
        for f in surface.mesh.faces() {
            if let Some(gradients) = Gradients::of(surface, f.edges()[0]) {
                for corner in gradients.corners {
                    forms.add(surface, &gradients, corner);
                }
            }
        }
        Some(forms)
    }

    /// Adds a face to the wedge of one of its corners.
    fn add<S: EdgeStore>(&mut self, surface: &Surface<S>, face: &Gradients, corner: EdgeId) {
        let wedges = &surface.wedges;
        let [a, b, c] = face
            .corners
            .map(|corner| wedges.row(wedges.at[corner.index()]));
        let area = face.area * surface.weight(surface.mesh.tail(corner));
        let row = wedges.at[corner.index()] as usize * self.stride;
        let row = &mut self.rows[row..][..self.stride];
        row[AREA] += area as f32;
        let mut spread = [0.0; 6];
        let slopes = row[SLOPES..].chunks_exact_mut(3);
        for (i, (sums, &factor)) in slopes.zip(&wedges.layout.factors).enumerate() {
            let start = f64::from(a[i]);
            let slope = face.along[0] * (f64::from(b[i]) - start)
                + face.along[1] * (f64::from(c[i]) - start);
            if !slope.is_finite() {
                continue;
            }
            let [x, y, z] = slope.to_array();
            for (sum, component) in sums.iter_mut().zip([x, y, z]) {
                *sum += (area * component) as f32;
            }
            let products = [x * x, x * y, x * z, y * y, y * z, z * z];
            for (sum, product) in spread.iter_mut().zip(products) {
                *sum += factor * product;
            }
        }
        for (sum, product) in row[SPREAD..SLOPES].iter_mut().zip(spread) {
            *sum += (area * product) as f32;
        }
    }

    /// Brings the wedges of these vertices up to date, each vertex once.
    pub fn update<S: EdgeStore>(&mut self, surface: &Surface<S>, vertices: &[VertexId]) {
        self.rows.resize(self.stride * surface.wedges.count(), 0.0);
        let mesh = &surface.mesh;
        for &v in vertices {
            for wedge in surface.wedges.at_vertex(mesh, v) {
                self.rows[wedge as usize * self.stride..][..self.stride].fill(0.0);
            }
            for corner in mesh.outgoing_edges(v) {
                if let Some(gradients) = Gradients::of(surface, corner) {
                    self.add(surface, &gradients, corner);
                }
            }
        }
    }

    fn row(&self, wedge: u32) -> &[f32] {
        &self.rows[wedge as usize * self.stride..][..self.stride]
    }

    /// Adds to the energy of an edge what its attributes cost.
    pub fn add_to<S: EdgeStore>(&self, form: &mut Form<f64>, surface: &Surface<S>, e: EdgeId) {
        let along = DVec3::from(form.along);
        for joined in surface.wedges.joined_by(&surface.mesh, e) {
            let mut b = DVec3::ZERO;
            for &(wedge, is_head) in &joined.members {
                let spread: Matrix<f64> =
                    std::array::from_fn(|i| f64::from(self.row(wedge)[SPREAD + i]));
                for (sum, number) in form.m.iter_mut().zip(spread) {
                    *sum += number;
                }
                if is_head {
                    let across = DVec3::from(times(&spread, &form.along));
                    b += across;
                    form.at_tail += along.dot(across);
                }
            }
            let factors = surface.wedges.layout.factors.iter().enumerate();
            for (i, &factor) in factors.filter(|(_, factor)| **factor > 0.0) {
                let Some(mean) = self.mean(surface, &joined, i, along) else {
                    continue;
                };
                let Mean {
                    area,
                    slope,
                    sum,
                    pull,
                    at_tail,
                    ..
                } = mean;
                let [x, y, z] = slope.to_array();
                let products = [x * x, x * y, x * z, y * y, y * z, z * z];
                for (number, product) in form.m.iter_mut().zip(products) {
                    *number -= factor / area * product;
                }
                b += factor * (sum / area * slope - pull);
                form.at_tail += factor * (at_tail - sum * sum / area);
            }
            for (number, term) in form.b.iter_mut().zip(b.to_array()) {
                *number += term;
            }
        }
    }

    /// What the wedges that are joined say of a number; nothing where they have no area or it is none.
    fn mean<S: EdgeStore>(
        &self,
        surface: &Surface<S>,
        joined: &Joined,
        i: usize,
        along: DVec3,
    ) -> Option<Mean> {
        let number = |wedge: u32| f64::from(surface.wedges.row(wedge)[i]);
        let mut mean = Mean {
            area: 0.0,
            from: number(joined.members[0].0),
            slope: DVec3::ZERO,
            sum: 0.0,
            pull: DVec3::ZERO,
            at_tail: 0.0,
        };
        for &(wedge, is_head) in &joined.members {
            let row = self.row(wedge);
            let area = f64::from(row[AREA]);
            let [x, y, z] = [0, 1, 2].map(|k| f64::from(row[SLOPES + 3 * i + k]));
            let slope = DVec3::new(x, y, z);
            let difference = number(wedge) - mean.from;
            let at_tail = if is_head { slope.dot(along) } else { 0.0 };
            mean.area += area;
            mean.slope += slope;
            mean.sum += area * difference - at_tail;
            mean.pull += difference * slope;
            mean.at_tail += difference * (area * difference - 2.0 * at_tail);
        }
        (mean.area > 0.0 && mean.sum.is_finite()).then_some(mean)
    }

    /// The wedges of the vertex that is left of an edge, with the numbers that suit its place best.
    fn carried<S: EdgeStore>(&self, surface: &Surface<S>, e: EdgeId, position: Vec3) -> Carried {
        let [v, w] = surface.mesh.edge_vertices(e);
        let along = surface.geometry.between(v, w);
        let from = surface.geometry.position(v).as_dvec3();
        let way = (position.as_dvec3() - from) * surface.geometry.scale();
        let mut carried = surface.interpolated(e, position);
        for joined in &mut carried {
            for i in 0..joined.values.len() {
                if let Some(mean) = self.mean(surface, joined, i, along) {
                    let best = mean.from + (mean.sum + mean.slope.dot(way)) / mean.area;
                    joined.values[i] = best as f32;
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
            for wedge in surface.wedges.at_vertex(&surface.mesh, v) {
                let row = self.row(wedge);
                let slopes = row[SLOPES..].chunks_exact(3);
                let steps = slopes.map(|slope| {
                    let slope = DVec3::new(slope[0].into(), slope[1].into(), slope[2].into());
                    slope.dot(way) / f64::from(row[AREA])
                });
                surface.wedges.shift(wedge, steps);
            }
        }
    }

    /// The bytes that the rows hold.
    pub fn bytes(&self) -> usize {
        self.rows.capacity() * size_of::<f32>()
    }
}

/// What several wedges say of one number s at x from the tail: area · s² − 2 s (sum + slope·x) and what
/// does not depend on s, 2 pull·x + `at_tail`, with s from the first wedge's number.
struct Mean {
    area: f64,
    from: f64,
    slope: DVec3,
    sum: f64,
    pull: DVec3,
    at_tail: f64,
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
