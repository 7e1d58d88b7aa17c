//! The one type handed between the stages: positions and the triangles that index them.

use glam::{DVec3, Vec3};

use crate::attributes::{Attributes, Kind};
use crate::error::{Error, Result};

/// The most triangles that three directed edges each can number with 31 bits.
pub const MAX_TRIANGLES: usize = (i32::MAX as usize) / 3;
/// The most vertices that a 31-bit id can number.
pub const MAX_VERTICES: usize = i32::MAX as usize;

/// A triangle mesh as positions and triangles that index them (the paper's *shared vertex* form).
///
/// Positions are `f32`, relative to one `f64` [`origin`](Self::origin): zero for every mesh whose
/// file holds floats or that lies near zero, so that its exact bits pass through, and a point near
/// the mesh for one that lies far away (georeferenced scans), so that it keeps its precision.
///
/// Indices are validated here, once, and trusted after that. Anything else (non-manifold edges,
/// degenerate or duplicate triangles, coordinates that are not finite) is input, not an error.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct IndexedMesh {
    origin: DVec3,
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    double_sided: Vec<bool>,
    weights: Vec<f32>,
    attributes: Attributes,
}

/// A mesh taken apart.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct Parts {
    /// [`IndexedMesh::origin`].
    pub origin: DVec3,
    /// [`IndexedMesh::positions`].
    pub positions: Vec<Vec3>,
    /// [`IndexedMesh::triangles`].
    pub triangles: Vec<[u32; 3]>,
    /// [`IndexedMesh::double_sided`].
    pub double_sided: Vec<bool>,
    /// [`IndexedMesh::weights`].
    pub weights: Vec<f32>,
    /// [`IndexedMesh::attributes`].
    pub attributes: Attributes,
}

impl IndexedMesh {
    /// A mesh from single-precision positions and triangles, with its origin at zero.
    ///
    /// # Errors
    /// [`Error::InvalidMesh`] where a triangle names a vertex that is not there, or there are more
    /// than 2³¹−1 vertices or directed edges.
    pub fn new(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self> {
        Self::with_origin(DVec3::ZERO, positions, triangles)
    }

    /// A mesh whose positions are relative to `origin`.
    ///
    /// # Errors
    /// As [`IndexedMesh::new`], and where the origin is not finite.
    pub fn with_origin(
        origin: DVec3,
        positions: Vec<Vec3>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self> {
        check_sizes(positions.len(), triangles.len())?;
        if !origin.is_finite() {
            return Err(Error::InvalidMesh(format!(
                "the origin {origin} is not finite"
            )));
        }
        let n = positions.len();
        let outside = |t: &[u32; 3]| t.iter().any(|&v| v as usize >= n);
        if let Some(i) = triangles.iter().position(outside) {
            let [a, b, c] = triangles[i];
            return Err(Error::InvalidMesh(format!(
                "triangle {i} uses vertices {a}, {b}, {c}; the mesh has {n} (counted from 0)"
            )));
        }
        Ok(Self {
            origin,
            positions,
            triangles,
            double_sided: Vec::new(),
            weights: Vec::new(),
            attributes: Attributes::default(),
        })
    }

    /// A mesh of parts known to be valid: taken from a mesh, fewer of them, and renamed.
    pub(crate) fn from_valid(parts: Parts) -> Self {
        let Parts {
            origin,
            positions,
            triangles,
            double_sided,
            weights,
            attributes,
        } = parts;
        if cfg!(debug_assertions) {
            Self::with_origin(origin, positions, triangles)
                .and_then(|mesh| mesh.with_double_sided(double_sided))
                .and_then(|mesh| mesh.with_weights(weights))
                .and_then(|mesh| mesh.with_attributes(attributes))
                .expect("the parts are those of a mesh")
        } else {
            Self {
                origin,
                positions,
                triangles,
                double_sided: some_or_none(double_sided, |&is_double| is_double),
                weights: some_or_none(weights, |&w| w != 1.0),
                attributes,
            }
        }
    }

    /// The point that [`positions`](Self::positions) are relative to.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The vertices, relative to [`origin`](Self::origin).
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// The triangles, three vertex indices each, counter-clockwise seen from outside. A folded
    /// double-sided pair stands here once; see [`sides`](Self::sides).
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Whether triangle `i` stands for itself and its opposite (a folded double-sided sheet).
    pub fn is_double_sided(&self, i: usize) -> bool {
        self.double_sided.get(i).copied().unwrap_or(false)
    }

    /// One flag a triangle, or nothing where no triangle is double-sided.
    pub fn double_sided(&self) -> &[bool] {
        &self.double_sided
    }

    /// Marks triangles as double-sided: one flag a triangle, or an empty list for none.
    ///
    /// # Errors
    /// [`Error::InvalidMesh`] where the list is neither empty nor as long as the triangles.
    pub fn with_double_sided(mut self, double_sided: Vec<bool>) -> Result<Self> {
        if !double_sided.is_empty() && double_sided.len() != self.triangles.len() {
            return Err(Error::InvalidMesh(format!(
                "{} double-sided flags for {} triangles",
                double_sided.len(),
                self.triangles.len()
            )));
        }
        self.double_sided = some_or_none(double_sided, |&is_double| is_double);
        Ok(self)
    }

    /// What a cost is multiplied by around each vertex, infinite for one that must stay where it is;
    /// or nothing where all weigh 1.
    pub fn weights(&self) -> &[f32] {
        &self.weights
    }

    /// Weighs the vertices: one weight each, 0 or more, or an empty list for 1 everywhere.
    ///
    /// # Errors
    /// [`Error::InvalidMesh`] where a weight is negative or no number, or the list is neither empty
    /// nor as long as the vertices.
    pub fn with_weights(mut self, weights: Vec<f32>) -> Result<Self> {
        if !weights.is_empty() && weights.len() != self.positions.len() {
            return Err(Error::InvalidMesh(format!(
                "{} weights for {} vertices",
                weights.len(),
                self.positions.len()
            )));
        }
        if let Some(v) = weights.iter().position(|w| w.is_nan() || *w < 0.0) {
            return Err(Error::InvalidMesh(format!(
                "vertex {v} has the weight {}; 0 or more is expected (counted from 0)",
                weights[v]
            )));
        }
        self.weights = some_or_none(weights, |&w| w != 1.0);
        Ok(self)
    }

    /// What the mesh carries beside positions: normals, colours, texture coordinates, groups.
    pub fn attributes(&self) -> &Attributes {
        &self.attributes
    }

    /// Gives the mesh what it carries, in the place of what it carried.
    ///
    /// # Errors
    /// [`Error::InvalidMesh`] where the lists do not fit the triangles or each other, or a wedge is
    /// used at two vertices.
    pub fn with_attributes(mut self, attributes: Attributes) -> Result<Self> {
        attributes.check(&self.triangles)?;
        self.attributes = attributes;
        Ok(self)
    }

    /// The mesh with its second texture coordinate growing the other way, where it has one that does
    /// not grow down, or up, as asked.
    pub(crate) fn with_v_down(&self, v_is_down: bool) -> Option<Self> {
        let channels = &self.attributes.channels;
        let has_one = channels.iter().any(|c| c.kind == Kind::TextureCoordinate);
        if !has_one || self.attributes.v_is_down == v_is_down {
            return None;
        }
        let mut turned = self.clone();
        turned.attributes.turn_v();
        Some(turned)
    }

    /// The number of triangles a file of this mesh holds: double-sided ones count as two.
    pub fn triangle_count(&self) -> usize {
        self.triangles.len() + self.double_sided.iter().filter(|&&d| d).count()
    }

    /// The triangles as a file holds them: behind each double-sided one stands its opposite, whose corners
    /// have the same wedges (normals are not turned).
    pub fn sides(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.triangles
            .iter()
            .enumerate()
            .flat_map(|(i, &[a, b, c])| {
                let back = self.is_double_sided(i).then_some([a, c, b]);
                std::iter::once([a, b, c]).chain(back)
            })
    }

    /// The vertices in the file's own coordinates.
    pub fn points(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.positions.iter().map(|p| self.origin + p.as_dvec3())
    }

    /// The corners of the box around all finite positions, relative to [`origin`](Self::origin).
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        bounds(self.positions.iter().map(|p| p.as_dvec3()))
            .map(|(min, max)| (min.as_vec3(), max.as_vec3()))
    }

    /// The diagonal of the box around all finite positions, in model units; 0 without any.
    pub fn diagonal(&self) -> f64 {
        self.bounds()
            .map_or(0.0, |(min, max)| (max.as_dvec3() - min.as_dvec3()).length())
    }

    /// The mesh taken apart.
    pub fn into_parts(self) -> Parts {
        let Self {
            origin,
            positions,
            triangles,
            double_sided,
            weights,
            attributes,
        } = self;
        Parts {
            origin,
            positions,
            triangles,
            double_sided,
            weights,
            attributes,
        }
    }

    /// The bytes that the arrays hold.
    pub fn bytes(&self) -> usize {
        self.positions.capacity() * size_of::<Vec3>()
            + self.triangles.capacity() * size_of::<[u32; 3]>()
            + self.double_sided.capacity()
            + self.weights.capacity() * size_of::<f32>()
            + self.attributes.bytes()
    }
}

/// The list where it says something of any element, else the empty list, which says the same.
fn some_or_none<T>(list: Vec<T>, says_something: impl Fn(&T) -> bool) -> Vec<T> {
    if list.iter().any(says_something) {
        list
    } else {
        Vec::new()
    }
}

/// The triangles that a polygon is cut into: the fan around its first corner; none where it has fewer
/// than three.
fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    let (&first, rest) = corners.split_first().unwrap_or((&0, &[]));
    rest.windows(2).map(move |pair| [first, pair[0], pair[1]])
}

/// A mesh with its polygons as a file has them, of three corners or more each.
///
/// For structures of other faces than triangles; everything else takes the triangles that
/// [`fanned`](Self::fanned) cuts them into.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PolygonMesh {
    origin: DVec3,
    positions: Vec<Vec3>,
    polygons: Polygons,
}

/// Lists of corners, one behind the other.
#[derive(Debug, Clone, Default, PartialEq)]
struct Polygons {
    corners: Vec<u32>,
    /// Where each polygon's corners end.
    ends: Vec<usize>,
}

impl Polygons {
    fn push(&mut self, corners: &[u32]) {
        if corners.len() >= 3 {
            self.corners.extend_from_slice(corners);
            self.ends.push(self.corners.len());
        }
    }

    fn iter(&self) -> impl Iterator<Item = &[u32]> + '_ {
        let begins = std::iter::once(0).chain(self.ends.iter().copied());
        begins
            .zip(&self.ends)
            .map(|(begin, &end)| &self.corners[begin..end])
    }
}

impl PolygonMesh {
    /// The vertices, relative to [`IndexedMesh::origin`].
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// The corners of each polygon.
    pub fn polygons(&self) -> impl Iterator<Item = &[u32]> + '_ {
        self.polygons.iter()
    }

    /// The polygons, where there are some and all have four corners.
    pub fn quads(&self) -> Option<Vec<[u32; 4]>> {
        let quad = |polygon: &[u32]| <[u32; 4]>::try_from(polygon).ok();
        let quads: Option<Vec<_>> = self.polygons().map(quad).collect();
        quads.filter(|quads| !quads.is_empty())
    }

    /// The mesh with each polygon cut into the fan of triangles around its first corner.
    ///
    /// # Errors
    /// As [`IndexedMesh::new`], where there are too many triangles.
    pub fn fanned(self) -> Result<IndexedMesh> {
        let triangles = self.polygons().flat_map(fan).collect();
        IndexedMesh::with_origin(self.origin, self.positions, triangles)
    }
}

fn check_sizes(vertices: usize, triangles: usize) -> Result<()> {
    if triangles > MAX_TRIANGLES {
        return Err(Error::InvalidMesh(format!(
            "{triangles} triangles have more than 2^31-1 directed edges; at most {MAX_TRIANGLES} fit"
        )));
    }
    if vertices > MAX_VERTICES {
        return Err(Error::InvalidMesh(format!(
            "{vertices} vertices; at most {MAX_VERTICES} can be numbered"
        )));
    }
    Ok(())
}

fn bounds(points: impl Iterator<Item = DVec3>) -> Option<(DVec3, DVec3)> {
    points.filter(|p| p.is_finite()).fold(None, |bounds, p| {
        let (min, max) = bounds.unwrap_or((p, p));
        Some((min.min(p), max.max(p)))
    })
}

/// Takes a mesh in element by element, as a reader finds it.
///
/// Keeps single precision as long as every coordinate is a single-precision number, and doubles
/// from the first one that is not, until [`finish`](Self::finish) has chosen the origin.
#[derive(Debug, Default)]
pub struct MeshBuilder {
    singles: Vec<Vec3>,
    doubles: Vec<DVec3>,
    faces: Faces,
    weights: Vec<f32>,
    /// What is carried beside; of the corners what was pushed with wedges.
    attributes: Attributes,
    /// Where runs of triangles of a group begin, and the group.
    groups: Vec<(usize, u32)>,
}

/// What becomes of the faces that a reader finds.
#[derive(Debug)]
enum Faces {
    /// They are cut into triangles.
    Triangles(Vec<[u32; 3]>),
    /// They stay as they are.
    Polygons(Polygons),
}

impl Default for Faces {
    fn default() -> Self {
        Faces::Triangles(Vec::new())
    }
}

/// How many times farther from zero than its own size a mesh of doubles must lie before it gets an
/// origin of its own: below, single precision keeps 20 bits of its size, finer than any scanner.
const FAR: f64 = 16.0;

impl MeshBuilder {
    /// A builder that leaves polygons whole, to be [finished](Self::finish_polygons) as such.
    pub fn of_polygons() -> Self {
        Self {
            faces: Faces::Polygons(Polygons::default()),
            ..Self::default()
        }
    }

    /// Makes room for exactly so many more vertices, if there is room for them.
    pub fn reserve_vertices(&mut self, vertices: usize) {
        // Without it the array grows as the vertices come.
        let _ = self.singles.try_reserve_exact(vertices.min(MAX_VERTICES));
    }

    /// Makes room for exactly so many more triangles, if there is room for them.
    pub fn reserve_triangles(&mut self, triangles: usize) {
        // Polygons are fewer than their triangles, and grow as they come.
        if let Faces::Triangles(list) = &mut self.faces {
            let _ = list.try_reserve_exact(triangles.min(MAX_TRIANGLES));
        }
    }

    /// Adds vertices with single-precision coordinates.
    pub fn push_singles(&mut self, positions: impl Iterator<Item = [f32; 3]>) {
        if self.doubles.is_empty() {
            self.singles.extend(positions.map(Vec3::from));
        } else {
            self.doubles
                .extend(positions.map(|p| DVec3::from(p.map(f64::from))));
        }
    }

    /// Adds a vertex with single-precision coordinates and returns its index.
    pub fn push_single(&mut self, position: [f32; 3]) -> usize {
        if self.doubles.is_empty() {
            self.singles.push(position.into());
            self.singles.len() - 1
        } else {
            self.push_double(position.map(f64::from))
        }
    }

    /// Adds a vertex with double-precision coordinates and returns its index.
    pub fn push_double(&mut self, position: [f64; 3]) -> usize {
        let exact = |x: f64| f64::from(x as f32) == x || x.is_nan();
        if self.doubles.is_empty() {
            if position.into_iter().all(exact) {
                return self.push_single(position.map(|x| x as f32));
            }
            let singles = std::mem::take(&mut self.singles);
            let _ = self.doubles.try_reserve_exact(singles.capacity());
            self.doubles.extend(singles.into_iter().map(Vec3::as_dvec3));
        }
        self.doubles.push(position.into());
        self.doubles.len() - 1
    }

    /// Adds a triangle. Its indices are checked by [`finish`](Self::finish); a reader that can name
    /// the place in its file checks them before.
    pub fn push_triangle(&mut self, triangle: [u32; 3]) {
        match &mut self.faces {
            Faces::Triangles(list) => list.push(triangle),
            Faces::Polygons(polygons) => polygons.push(&triangle),
        }
    }

    /// Adds triangles, as [`push_triangle`](Self::push_triangle) does.
    pub fn push_triangles(&mut self, triangles: impl Iterator<Item = [u32; 3]>) {
        match &mut self.faces {
            Faces::Triangles(list) => list.extend(triangles),
            Faces::Polygons(polygons) => triangles.for_each(|t| polygons.push(&t)),
        }
    }

    /// Adds a polygon, as the fan of triangles around its first corner unless polygons stay whole.
    /// One of less than three corners is none.
    pub fn push_polygon(&mut self, corners: &[u32]) {
        match &mut self.faces {
            Faces::Triangles(list) => list.extend(fan(corners)),
            Faces::Polygons(polygons) => polygons.push(corners),
        }
    }

    /// Adds a polygon as [`push_polygon`](Self::push_polygon) does, its corners with wedges: either all
    /// faces come with them, or none and the wedges are the vertices.
    pub fn push_polygon_with(&mut self, corners: &[u32], wedges: &[u32]) {
        debug_assert_eq!(corners.len(), wedges.len());
        self.push_polygon(corners);
        self.attributes.corners.extend(fan(wedges));
    }

    /// Lets the faces that come from now on be of this group.
    pub fn begin_group(&mut self, group: u32) {
        if self.groups.last().is_none_or(|&(_, last)| last != group) {
            self.groups.push((self.face_count(), group));
        }
    }

    /// What the mesh will carry beside: its channels and groups are the reader's to fill.
    pub fn attributes(&mut self) -> &mut Attributes {
        &mut self.attributes
    }

    /// Weighs the next vertex; see [`IndexedMesh::with_weights`].
    pub fn push_weight(&mut self, weight: f32) {
        self.weights.push(weight);
    }

    /// The triangles so far; none where polygons stay whole.
    pub fn triangles(&self) -> &[[u32; 3]] {
        match &self.faces {
            Faces::Triangles(list) => list,
            Faces::Polygons(_) => &[],
        }
    }

    /// The vertices so far.
    pub fn vertex_count(&self) -> usize {
        self.singles.len().max(self.doubles.len())
    }

    /// The faces so far: triangles, or polygons where these stay whole.
    pub fn face_count(&self) -> usize {
        match &self.faces {
            Faces::Triangles(list) => list.len(),
            Faces::Polygons(polygons) => polygons.ends.len(),
        }
    }

    /// The mesh, with the origin that its coordinates ask for.
    ///
    /// # Errors
    /// As [`IndexedMesh::new`], [`IndexedMesh::with_weights`] and [`IndexedMesh::with_attributes`].
    pub fn finish(mut self) -> Result<IndexedMesh> {
        let mut triangles = match std::mem::take(&mut self.faces) {
            Faces::Triangles(list) => list,
            Faces::Polygons(polygons) => polygons.iter().flat_map(fan).collect(),
        };
        check_sizes(self.vertex_count(), triangles.len())?;
        triangles.shrink_to_fit();
        let weights = std::mem::take(&mut self.weights);
        let mut attributes = std::mem::take(&mut self.attributes);
        if attributes.channels.is_empty() {
            attributes.corners = Vec::new();
        } else if attributes.corners.is_empty() {
            attributes.corners.clone_from(&triangles);
        }
        let mut groups = std::mem::take(&mut self.groups);
        if attributes.groups.is_empty() {
            // The reader gave them up.
            groups.clear();
        }
        let ends = groups.iter().skip(1).map(|&(begin, _)| begin);
        for (&(begin, group), end) in groups.iter().zip(ends.chain([triangles.len()])) {
            // What came before the first is of the first.
            attributes.group_of.resize(begin, group);
            attributes.group_of.resize(end, group);
        }
        let (origin, positions) = self.finish_positions();
        let mesh = IndexedMesh::with_origin(origin, positions, triangles)?;
        mesh.with_weights(weights)?.with_attributes(attributes)
    }

    /// The mesh with its polygons as they came.
    ///
    /// # Errors
    /// [`Error::InvalidMesh`] where a polygon names a vertex that is not there, or there are more than
    /// 2³¹−1 vertices.
    pub fn finish_polygons(mut self) -> Result<PolygonMesh> {
        let polygons = match std::mem::take(&mut self.faces) {
            Faces::Polygons(polygons) => polygons,
            Faces::Triangles(list) => {
                let mut polygons = Polygons::default();
                list.iter().for_each(|t| polygons.push(t));
                polygons
            }
        };
        check_sizes(self.vertex_count(), 0)?;
        let (origin, positions) = self.finish_positions();
        let n = positions.len();
        let outside = |polygon: &&[u32]| polygon.iter().any(|&v| v as usize >= n);
        if let Some(polygon) = polygons.iter().find(outside) {
            return Err(Error::InvalidMesh(format!(
                "a polygon uses vertices {polygon:?}; the mesh has {n} (counted from 0)"
            )));
        }
        Ok(PolygonMesh {
            origin,
            positions,
            polygons,
        })
    }

    /// The positions, relative to the origin that they ask for.
    fn finish_positions(mut self) -> (DVec3, Vec<Vec3>) {
        if self.doubles.is_empty() {
            self.singles.shrink_to_fit();
            return (DVec3::ZERO, self.singles);
        }
        let origin = origin_for(&self.doubles);
        let relative = |&p: &DVec3| (p - origin).as_vec3();
        (origin, self.doubles.iter().map(relative).collect())
    }
}

/// Zero, or a point near the middle of a mesh that lies far from zero, on a grid as coarse as the
/// mesh is large, so that subtracting it loses no bit of a coordinate.
fn origin_for(points: &[DVec3]) -> DVec3 {
    let Some((min, max)) = bounds(points.iter().copied()) else {
        return DVec3::ZERO;
    };
    let size = (max - min).max_element();
    let farthest = min.abs().max(max.abs()).max_element();
    if farthest <= FAR * size || !size.is_finite() {
        return DVec3::ZERO;
    }
    // The smallest power of two at or above the size, by its exponent bits; 1 for a single point.
    let grid = if size > 0.0 {
        f64::from_bits(((size.to_bits() >> 52) + 1) << 52)
    } else {
        1.0
    };
    let middle = min + (max - min) * 0.5;
    let origin = (middle / grid).round() * grid;
    if origin.is_finite() {
        origin
    } else {
        DVec3::ZERO
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2³¹−1 directed edges are three times as many as the most triangles, and one over: a triangle
    /// more is refused in words, before anything is counted in 32 bits.
    #[test]
    fn more_than_31_bits_can_number_is_an_error() {
        assert!(check_sizes(MAX_VERTICES, MAX_TRIANGLES).is_ok());
        let error = check_sizes(3, MAX_TRIANGLES + 1).unwrap_err().to_string();
        assert_eq!(
            error,
            "715827883 triangles have more than 2^31-1 directed edges; at most 715827882 fit"
        );
        let error = check_sizes(MAX_VERTICES + 1, 0).unwrap_err().to_string();
        assert_eq!(
            error,
            "2147483648 vertices; at most 2147483647 can be numbered"
        );
        assert!(check_sizes(usize::MAX, usize::MAX).is_err());
    }

    #[test]
    fn an_origin_that_is_not_finite_is_an_error() {
        for x in [f64::NAN, f64::INFINITY] {
            let error = IndexedMesh::with_origin(DVec3::splat(x), vec![], vec![]);
            assert!(error.unwrap_err().to_string().contains("not finite"));
        }
    }

    /// Left whole, polygons are what came, those of less than three corners left out; cut later, they
    /// are the triangles that they would have been at once.
    #[test]
    fn polygons_can_stay_whole() {
        let fill = |builder: &mut MeshBuilder| {
            (0..6).for_each(|i| {
                builder.push_single([i as f32, 0.0, 0.0]);
            });
            builder.push_polygon(&[0, 1, 2, 3]);
            builder.push_triangles([[3, 2, 4], [4, 2, 5]].into_iter());
            builder.push_polygon(&[1, 2]);
            builder.push_polygon(&[]);
            builder.push_polygon(&[5, 4, 3, 2, 1]);
            builder.push_triangle([0, 1, 5]);
        };
        let mut builder = MeshBuilder::of_polygons();
        fill(&mut builder);
        assert_eq!(builder.face_count(), 5);
        let whole = builder.finish_polygons().unwrap();
        let corners: Vec<&[u32]> = whole.polygons().collect();
        let expected: [&[u32]; 5] = [
            &[0, 1, 2, 3],
            &[3, 2, 4],
            &[4, 2, 5],
            &[5, 4, 3, 2, 1],
            &[0, 1, 5],
        ];
        assert_eq!(corners, expected);
        assert_eq!(whole.quads(), None);
        let mut builder = MeshBuilder::default();
        fill(&mut builder);
        assert_eq!(whole.fanned().unwrap(), builder.finish().unwrap());
    }

    #[test]
    fn only_quads_are_quads() {
        let mut builder = MeshBuilder::of_polygons();
        (0..4).for_each(|i| {
            builder.push_single([i as f32, 0.0, 0.0]);
        });
        builder.push_polygon(&[0, 1, 2, 3]);
        let quads = builder.finish_polygons().unwrap().quads();
        assert_eq!(quads, Some(vec![[0, 1, 2, 3]]));
        assert_eq!(PolygonMesh::default().quads(), None);
        let mut builder = MeshBuilder::of_polygons();
        builder.push_polygon(&[0, 1, 2, 3]);
        let error = builder.finish_polygons().unwrap_err().to_string();
        assert!(error.starts_with("a polygon uses vertices [0, 1, 2, 3]; the mesh has 0"));
    }

    /// A float file's coordinates keep their bits, also far from zero.
    #[test]
    fn singles_keep_their_bits() {
        let mut builder = MeshBuilder::default();
        let far = [1.0e7_f32, 0.1, -0.0];
        for _ in 0..3 {
            builder.push_double(far.map(f64::from));
        }
        builder.push_triangle([0, 1, 2]);
        let mesh = builder.finish().unwrap();
        assert_eq!(mesh.origin(), DVec3::ZERO);
        assert_eq!(
            mesh.positions()[2].to_array().map(f32::to_bits),
            far.map(f32::to_bits)
        );
    }

    /// Doubles a million sizes away from zero keep millimetres: single precision alone has a grid
    /// of half a unit there.
    #[test]
    fn far_doubles_get_an_origin() {
        let mut builder = MeshBuilder::default();
        let points = [
            [5.0e6, 4.0e5, 0.1],
            [5.0e6 + 0.001, 4.0e5, 0.1],
            [5.0e6, 4.0e5 + 0.7, 0.1],
        ];
        for p in points {
            builder.push_double(p);
        }
        builder.push_triangle([0, 1, 2]);
        let mesh = builder.finish().unwrap();
        assert_ne!(mesh.origin(), DVec3::ZERO);
        for (p, q) in mesh.points().zip(points) {
            assert!((p - DVec3::from(q)).length() < 1e-7, "{p} is not {q:?}");
        }
    }

    #[test]
    fn an_index_past_the_end_is_an_error() {
        let error = IndexedMesh::new(vec![Vec3::ZERO; 3], vec![[0, 1, 3]]).unwrap_err();
        assert!(
            error
                .to_string()
                .contains("triangle 0 uses vertices 0, 1, 3"),
            "{error}"
        );
    }

    /// A weight for each vertex or for none, and none that a cost cannot be multiplied by.
    #[test]
    fn weights_are_checked() {
        let square = || IndexedMesh::new(vec![Vec3::ZERO; 4], vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        for (weights, expected) in [
            (vec![1.0; 3], "3 weights for 4 vertices"),
            (vec![1.0, f32::NAN, 1.0, 1.0], "vertex 1 has the weight NaN"),
            (vec![1.0, 1.0, 1.0, -0.5], "vertex 3 has the weight -0.5"),
        ] {
            let error = square().with_weights(weights).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
        let weights = [0.0, 1.0, f32::INFINITY, 1.0];
        let weighted = square().with_weights(weights.into()).unwrap();
        assert_eq!(weighted.weights(), weights);
        assert_eq!(square().with_weights(vec![1.0; 4]).unwrap(), square());
    }

    #[test]
    fn double_sided_triangles_count_and_come_out_twice() {
        let mesh = IndexedMesh::new(vec![Vec3::ZERO; 4], vec![[0, 1, 2], [0, 2, 3]])
            .unwrap()
            .with_double_sided(vec![true, false])
            .unwrap();
        assert_eq!(mesh.triangle_count(), 3);
        let sides: Vec<_> = mesh.sides().collect();
        assert_eq!(sides, [[0, 1, 2], [0, 2, 1], [0, 2, 3]]);
    }
}
