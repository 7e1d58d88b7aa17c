//! The planes, folds and lines around vertices, four fans at a time.

use super::form::{LANES, Lanes, Number, Vector, cross, dot, scaled};
use super::{LINE_WEIGHT, between, crease_weight, each, places, singular_weight};
use crate::decimate::surface::Surface;
use crate::decimate::symmetric::Symmetric;
use crate::mesh::{EdgeId, EdgeStore, Outgoing, VertexId};

/// The weight of a fold. Without it a thin double sheet is free to eat: one mesh 1.68 → 0.91 of the
/// best peer's rms at 2 %.
const FOLD_WEIGHT: f32 = 0.3;

/// Edges flatter than this, as (1 − cos θ)/2, are no folds.
const FLAT: f32 = 0.05;

/// What the faces and lines around a vertex say, in the unit box.
#[derive(Clone, Copy, Default)]
pub struct Star {
    /// Σ n nᵀ/(2|n|) over the faces, n twice a face's area long, and the lines of folds, creases,
    /// boundaries and non-manifold edges; then Σ n.
    pub numbers: [f32; 9],
    /// The faces that have an area.
    pub faces: usize,
}

impl Star {
    /// The stars of as many vertices; of what is behind four, nothing. Costs a walk around each, all
    /// at once, since a step is little but waiting for memory.
    #[inline]
    pub fn around<S: EdgeStore>(
        surface: &Surface<S>,
        vertices: &[VertexId],
        boundary_weight: f64,
    ) -> [Self; LANES] {
        let mesh = &surface.mesh;
        let mut stars = [Self::default(); LANES];
        let mut starts = [None; LANES];
        for (start, &v) in starts.iter_mut().zip(vertices) {
            if let Outgoing::Fan(e) = mesh.outgoing(v) {
                *start = Some(e);
            }
        }
        let some = starts.iter().flatten().next();
        if let Some(&any) = some {
            let fans = starts.map(|start| start.unwrap_or(any));
            let fans = Fans::walk(surface, &fans);
            let (numbers, faces) = (fans.by_fan(), fans.faces.to_array());
            for (i, star) in stars.iter_mut().enumerate() {
                if let Some(start) = starts[i] {
                    star.numbers = numbers[i];
                    star.faces = faces[i] as usize;
                    star.add_lines(surface, start, fans.ends[i], boundary_weight);
                }
            }
        }
        for (i, &v) in vertices.iter().enumerate().take(LANES) {
            if starts[i].is_none() {
                stars[i] = Self::of_fans(surface, v, boundary_weight);
            }
            if !surface.weights.is_empty() {
                let weight = surface.weight(v) as f32;
                stars[i].numbers[..6]
                    .iter_mut()
                    .for_each(|number| *number *= weight);
            }
        }
        stars
    }

    /// The star of a vertex of any number of fans.
    fn of_fans<S: EdgeStore>(surface: &Surface<S>, v: VertexId, boundary_weight: f64) -> Self {
        let mut star = Self::default();
        for start in surface.mesh.fans(v) {
            let fans = Fans::walk(surface, &[start; LANES]);
            let [numbers, ..] = fans.by_fan();
            for (sum, number) in star.numbers.iter_mut().zip(numbers) {
                *sum += number;
            }
            star.faces += fans.faces.to_array()[0] as usize;
            star.add_lines(surface, start, fans.ends[0], boundary_weight);
        }
        star
    }

    /// Adds the lines of the creases in a fan and of the edges at which an open one begins and ends.
    /// A non-manifold edge ends several fans and is added once, where its first directed edge stands.
    #[inline]
    fn add_lines<S: EdgeStore>(
        &mut self,
        surface: &Surface<S>,
        start: EdgeId,
        end: EdgeId,
        boundary_weight: f64,
    ) {
        let mesh = &surface.mesh;
        let is_open = mesh.mate(start).is_none();
        if !is_open && !surface.curves.are_kept() {
            return;
        }
        let mut lines = Symmetric::default();
        let mut add = |e: EdgeId, weight: Option<f64>| {
            if let Some(weight) = weight {
                let [from, to] = mesh.edge_vertices(e);
                lines.add_line(surface.geometry.between(from, to), LINE_WEIGHT * weight);
            }
        };
        if is_open {
            for e in [start, end] {
                add(e, singular_weight(mesh, e, boundary_weight));
            }
        }
        if surface.curves.are_kept() {
            let weight = crease_weight(surface);
            for e in mesh.fan(start) {
                let is_crease = mesh.mate(e).is_some() && surface.is_crease(e);
                add(e, is_crease.then_some(weight));
            }
        }
        for (number, line) in self.numbers.iter_mut().zip(lines.0) {
            *number += line as f32;
        }
    }
}

/// The planes and folds of four fans.
struct Fans {
    /// As in a [`Star`].
    numbers: [Lanes; 9],
    /// The faces that have an area.
    faces: Lanes,
    /// The last edge of each: it runs to the vertex.
    ends: [EdgeId; LANES],
}

/// A face's normal and its length.
#[derive(Clone, Copy)]
struct Side {
    normal: Vector<Lanes>,
    length: Lanes,
}

impl Side {
    #[inline(always)]
    fn between(a: &Vector<Lanes>, b: &Vector<Lanes>) -> Self {
        let normal = cross(a, b);
        let length = dot(&normal, &normal).sqrt();
        Self { normal, length }
    }
}

impl Fans {
    /// Walks around the tails of four edges, at which their fans begin.
    #[inline]
    fn walk<S: EdgeStore>(surface: &Surface<S>, starts: &[EdgeId; LANES]) -> Self {
        let mesh = &surface.mesh;
        let scale = Lanes::new([surface.geometry.scale() as f32; LANES]);
        let point = places(surface, each(*starts, |e| mesh.tail(e)));
        let from_point =
            |vertices: [VertexId; LANES]| between(&point, &places(surface, vertices), scale);
        let mut fans = Self {
            numbers: [Lanes::ZERO; 9],
            faces: Lanes::ZERO,
            ends: *starts,
        };
        let mut along = from_point(each(*starts, |e| mesh.head(e)));
        // The face before the first of a closed fan; without area where there is none.
        let across = each(*starts, |e| {
            mesh.mate(e).map_or(mesh.head(e), |o| mesh.apex(o))
        });
        let mut last = Side::between(&from_point(across), &along);
        let mut at = *starts;
        loop {
            // A fan that is through stays at its last face's last edge, and finds faces without area.
            fans.ends = each(at, |e| mesh.prev(e));
            let mut goes_on = false;
            for i in 0..LANES {
                let next = mesh.mate(fans.ends[i]).filter(|&o| o != starts[i]);
                goes_on |= next.is_some();
                at[i] = next.unwrap_or(at[i]);
            }
            let next = from_point(each(fans.ends, |e| mesh.tail(e)));
            let side = Side::between(&along, &next);
            let has_area = side.length.greater(Lanes::ZERO);
            fans.add_outer(&side.normal, (Lanes::HALF / side.length) & has_area);
            for (sum, x) in fans.numbers[6..].iter_mut().zip(side.normal) {
                *sum += x;
            }
            fans.faces += Lanes::ONE & has_area;
            fans.add_fold(&last, &side, &along);
            (last, along) = (side, next);
            if !goes_on {
                return fans;
            }
        }
    }

    /// Adds the lines along the edges between two faces where they fold.
    #[inline(always)]
    fn add_fold(&mut self, a: &Side, b: &Side, along: &Vector<Lanes>) {
        let lengths = a.length * b.length;
        let cosine = dot(&a.normal, &b.normal);
        let is_fold = (Lanes::new([1.0 - 2.0 * FLAT; LANES]) * lengths).greater(cosine);
        if is_fold.any() {
            let fold = Lanes::HALF - Lanes::HALF * cosine / lengths;
            let weight = Lanes::new([LINE_WEIGHT as f32 * FOLD_WEIGHT; LANES]) * fold * fold;
            let weight = weight & is_fold;
            let squared = weight * dot(along, along);
            self.add_outer(along, Lanes::ZERO - weight);
            for i in [0, 3, 5] {
                self.numbers[i] += squared;
            }
        }
    }

    /// Adds w·n nᵀ.
    #[inline(always)]
    fn add_outer(&mut self, n: &Vector<Lanes>, w: Lanes) {
        let s = scaled(n, w);
        let terms = [
            s[0] * n[0],
            s[0] * n[1],
            s[0] * n[2],
            s[1] * n[1],
            s[1] * n[2],
            s[2] * n[2],
        ];
        for (sum, term) in self.numbers.iter_mut().zip(terms) {
            *sum += term;
        }
    }

    /// The numbers of each fan.
    #[inline(always)]
    fn by_fan(&self) -> [[f32; 9]; LANES] {
        let [a, b, c, d, e, f, g, h, i] = self.numbers;
        let first = Lanes::transpose([a, b, c, d]).map(|four| four.to_array());
        let second = Lanes::transpose([e, f, g, h]).map(|four| four.to_array());
        let ninth = i.to_array();
        std::array::from_fn(|fan| {
            let ([a, b, c, d], [e, f, g, h]) = (first[fan], second[fan]);
            [a, b, c, d, e, f, g, h, ninth[fan]]
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::tests::surface;
    use super::*;
    use crate::decimate::cost::BOUNDARY_WEIGHT;
    use crate::mesh::Full;
    use crate::shapes;

    /// The planes, folds and boundary lines at a vertex, one by one in double precision.
    fn one_by_one(surface: &Surface<Full>, v: VertexId) -> ([f64; 6], DVec3) {
        let (mesh, geometry) = (&surface.mesh, &surface.geometry);
        let (mut sum, mut area) = (Symmetric::default(), DVec3::ZERO);
        for f in mesh.faces().filter(|&f| mesh.face_vertices(f).contains(&v)) {
            let normal = geometry.normal(mesh, f.edges()[0]);
            sum.add_outer(normal, 0.5 / normal.length());
            area += normal;
        }
        for e in mesh.edges().filter(|&e| mesh.edge_vertices(e).contains(&v)) {
            let [a, b] = mesh.edge_vertices(e);
            let weight = mesh.mate(e).map_or(BOUNDARY_WEIGHT, |o| {
                let [n, m] = [e, o].map(|e| geometry.normal(mesh, e).normalize());
                let fold = (1.0 - n.dot(m)) / 2.0;
                let is_fold = fold > f64::from(FLAT);
                if is_fold {
                    f64::from(FOLD_WEIGHT) * fold * fold
                } else {
                    0.0
                }
            });
            sum.add_line(geometry.between(a, b), LINE_WEIGHT * weight);
        }
        (sum.0, area)
    }

    /// Valences of 3 to 6, folds everywhere and nowhere, boundaries, and groups that are not full.
    #[test]
    fn a_star_adds_up_its_planes_folds_and_lines() {
        for shape in [
            shapes::tetrahedron(),
            shapes::icosphere(0),
            shapes::icosphere(2),
            shapes::torus(8, 5),
            shapes::grid(3, 4),
        ] {
            let surface = surface::<Full>(shape);
            let vertices: Vec<VertexId> = surface.mesh.vertices().collect();
            for four in vertices.chunks(LANES) {
                let stars = Star::around(&surface, four, BOUNDARY_WEIGHT);
                for (&v, star) in four.iter().zip(stars) {
                    assert_eq!(star.faces, surface.mesh.vertex_faces(v).count(), "{v:?}");
                    let (quadratic, area) = one_by_one(&surface, v);
                    let expected = quadratic.into_iter().chain(area.to_array());
                    let trace = quadratic[0] + quadratic[3] + quadratic[5];
                    for (x, expected) in star.numbers.into_iter().zip(expected) {
                        let wrong = (f64::from(x) - expected).abs();
                        assert!(wrong < 1e-6 * trace, "{v:?}: {x} for {expected}");
                    }
                }
            }
        }
    }
}
