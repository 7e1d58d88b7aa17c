//! The attributes of a surface's corners, while it is decimated.
//!
//! A directed edge is a corner: that of its tail in its face. It names a wedge, a row of numbers. Where
//! two faces at an edge have different wedges at a vertex, the edge is a crease of the surface, so that
//! collapses go along it and never across it.

use std::ops::Range;
use std::sync::Arc;

use glam::Vec3;
use smallvec::{SmallVec, smallvec};

use super::options::{AttributeUse, Options};
use super::surface::Surface;
use crate::attributes::{Attributes, Channel, Kind, Values};
use crate::mesh::{EdgeId, EdgeStore, FaceId, Mesh, VertexId, turn_round};

/// Normals at an edge that differ by less are taken for one: what programs call smooth by default.
const SMOOTH_DEGREES: f64 = 30.0;

/// Where normals alone part the corners at more than this share of the edges, they say nothing but the
/// directions of the faces, and none is kept apart: else little could collapse. Between the two halves
/// of a box's sides they are one.
const FACETED: f64 = 0.9;

/// The wedge of no corner.
const NONE: u32 = u32::MAX;

/// What the numbers of a wedge are.
#[derive(Debug, Default, PartialEq)]
pub struct Layout {
    /// What is done with them.
    pub usage: AttributeUse,
    /// Where the numbers of each channel stand, and what they are.
    parts: Vec<(Kind, Range<usize>)>,
    /// By what a number's error is multiplied, in the unit box.
    pub scales: Vec<f64>,
    /// What a number may be.
    bounds: Vec<(f32, f32)>,
}

impl Layout {
    /// The numbers of a wedge.
    pub fn width(&self) -> usize {
        self.scales.len()
    }

    fn parts_of(&self, kind: Kind) -> impl Iterator<Item = Range<usize>> + '_ {
        let parts = self.parts.iter().filter(move |part| part.0 == kind);
        parts.map(|part| part.1.clone())
    }

    /// The layout of a mesh's attributes. `texture_scale` is the length on the surface, in the unit
    /// box, of a unit of each texture coordinate channel, in their order; `left` is how many triangles are
    /// to be.
    fn of(attributes: &Attributes, options: &Options, left: usize, texture_scale: &[f64]) -> Self {
        let mut layout = Self {
            usage: options.attributes,
            ..Self::default()
        };
        let mut texture_scale = texture_scale.iter();
        for channel in &attributes.channels {
            let begin = layout.scales.len();
            let unit = match channel.kind {
                Kind::Normal => 1.0,
                Kind::Color => channel.components[0].number.range().map_or(1.0, |r| r.1),
                Kind::TextureCoordinate => 1.0 / texture_scale.next().copied().unwrap_or(0.0),
                Kind::Scalar => span(channel),
            };
            let scale = options.attribute_weights.of(channel.kind, left) / unit;
            let scale = if scale.is_finite() { scale } else { 0.0 };
            for component in &channel.components {
                layout.scales.push(scale);
                let (least, most) = match (component.number.range(), channel.kind) {
                    (Some((least, most)), _) => (least as f32, most as f32),
                    (None, Kind::Color) => color_bounds(channel),
                    (None, _) => (f32::NEG_INFINITY, f32::INFINITY),
                };
                layout.bounds.push((least, most));
            }
            layout
                .parts
                .push((channel.kind, begin..layout.scales.len()));
        }
        layout
    }

    /// Makes numbers what they should be: normals of unit length, all within their bounds.
    fn mend(&self, row: &mut [f32]) {
        for part in self.parts_of(Kind::Normal) {
            let normal = &mut row[part];
            let length = normal.iter().map(|x| x * x).sum::<f32>().sqrt();
            if length > 0.0 && length.is_finite() {
                normal.iter_mut().for_each(|x| *x /= length);
            }
        }
        for (x, &(least, most)) in row.iter_mut().zip(&self.bounds) {
            *x = x.clamp(least, most);
        }
    }
}

/// How far a channel's finite numbers are apart.
fn span(channel: &Channel) -> f64 {
    let numbers = (0..channel.values.len()).map(|i| channel.values.get(i));
    let finite = numbers.filter(|x| x.is_finite());
    let (least, most) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
        (a.min(x), b.max(x))
    });
    most - least
}

/// Colours are 0 to 1, or as far beyond as the mesh itself goes.
fn color_bounds(channel: &Channel) -> (f32, f32) {
    let numbers = (0..channel.values.len()).map(|i| channel.values.get(i) as f32);
    numbers.fold((0.0, 1.0), |(least, most): (f32, f32), x| {
        (least.min(x), most.max(x))
    })
}

/// Attributes as flat arrays; all empty where nothing is carried.
#[derive(Clone, Debug, Default)]
pub struct FlatWedges {
    /// The wedges of each triangle's corners.
    pub corners: Vec<[u32; 3]>,
    /// The numbers of the wedges, side by side.
    pub values: Vec<f32>,
    /// The group of each triangle.
    pub groups: Vec<u32>,
    /// What the numbers are.
    pub layout: Arc<Layout>,
}

impl FlatWedges {
    /// The attributes of a mesh with these positions, brought into the unit box by `scale`, of which so
    /// many triangles are to be `left`.
    pub fn of(
        attributes: &Attributes,
        (positions, triangles): (&[Vec3], &[[u32; 3]]),
        scale: f64,
        left: usize,
        options: &Options,
    ) -> Self {
        if options.attributes == AttributeUse::Ignore {
            return Self::default();
        }
        let texture = attributes.channels.iter();
        let texture = texture.filter(|c| c.kind == Kind::TextureCoordinate);
        let scales: Vec<f64> = texture
            .map(|channel| {
                texture_scale(channel, &attributes.corners, positions, triangles) * scale
            })
            .collect();
        let layout = Layout::of(attributes, options, left, &scales);
        let wedges = attributes.wedge_count();
        let mut values = Vec::with_capacity(wedges * layout.width());
        for wedge in 0..wedges {
            let numbers = attributes.channels.iter().flat_map(|c| c.row(wedge));
            values.extend(numbers.map(|x| x as f32));
        }
        Self {
            corners: attributes.corners.clone(),
            values,
            groups: attributes.group_of.clone(),
            layout: Arc::new(layout),
        }
    }

    /// Gives a mesh's attributes the numbers that are here now.
    pub fn write_to(mut self, attributes: &mut Attributes) {
        self.drop_unused();
        let width = self.layout.width();
        for (channel, (_, part)) in attributes.channels.iter_mut().zip(&self.layout.parts) {
            channel.values = Values::of(&channel.components);
            for row in self.values.chunks_exact(width) {
                for (component, &x) in channel.components.iter().zip(&row[part.clone()]) {
                    // What no collapse changed is what it was.
                    channel.values.push(component.number.nearest(x.into()));
                }
            }
        }
        attributes.corners = self.corners;
        attributes.group_of = self.groups;
    }

    /// Whether nothing is carried by corners.
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// Whether nothing is carried at all.
    pub fn is_nothing(&self) -> bool {
        self.corners.is_empty() && self.groups.is_empty()
    }

    /// What these ranges of triangles carry, by wedges numbered afresh, and what number each had.
    pub fn gather(&self, ranges: impl Iterator<Item = Range<usize>> + Clone) -> (Self, Vec<u32>) {
        let mut gathered = Self {
            layout: self.layout.clone(),
            ..Self::default()
        };
        if !self.groups.is_empty() {
            let groups = ranges.clone().flat_map(|range| &self.groups[range]);
            gathered.groups.extend(groups);
        }
        if self.is_empty() {
            return (gathered, Vec::new());
        }
        let corners = ranges.flat_map(|range| &self.corners[range]);
        gathered.corners.extend(corners);
        let mut wedges = gathered.corners.as_flattened().to_vec();
        wedges.sort_unstable();
        wedges.dedup();
        for wedge in gathered.corners.as_flattened_mut() {
            *wedge = wedges.binary_search(wedge).expect("it was collected") as u32;
        }
        let width = self.layout.width();
        for &wedge in &wedges {
            gathered.values.extend(self.row(wedge, width));
        }
        (gathered, wedges)
    }

    fn row(&self, wedge: u32, width: usize) -> &[f32] {
        &self.values[wedge as usize * width..][..width]
    }

    /// Adds triangles of a chunk, with the numbers of its wedges; `wedges` are theirs here.
    pub fn append(&mut self, part: &FlatWedges, wedges: &[u32]) {
        let renamed = part.corners.iter().map(|t| t.map(|w| wedges[w as usize]));
        self.corners.extend(renamed);
        self.groups.extend(&part.groups);
    }

    /// Takes over the numbers of a chunk's wedges.
    pub fn take_values(&mut self, part: &FlatWedges, wedges: &[u32]) {
        let width = self.layout.width();
        for (row, &wedge) in part.values.chunks_exact(width.max(1)).zip(wedges) {
            self.values[wedge as usize * width..][..width].copy_from_slice(row);
        }
    }

    /// Keeps the wedges that a corner names, in their order.
    pub fn drop_unused(&mut self) {
        let width = self.layout.width();
        if width == 0 {
            return;
        }
        let mut new = vec![NONE; self.values.len() / width];
        for &wedge in self.corners.as_flattened() {
            new[wedge as usize] = 0;
        }
        let mut used = 0;
        for (wedge, new) in new.iter_mut().enumerate().filter(|(_, new)| **new != NONE) {
            *new = used as u32;
            self.values
                .copy_within(wedge * width..(wedge + 1) * width, used * width);
            used += 1;
        }
        self.values.truncate(used * width);
        self.values.shrink_to_fit();
        for wedge in self.corners.as_flattened_mut() {
            *wedge = new[*wedge as usize];
        }
    }

    /// The bytes that the arrays hold.
    pub fn bytes(&self) -> usize {
        self.corners.capacity() * size_of::<[u32; 3]>()
            + self.values.capacity() * size_of::<f32>()
            + self.groups.capacity() * size_of::<u32>()
    }

    /// The corners of a mesh's surface with so many vertices.
    pub fn into_wedges<S: EdgeStore>(mut self, mesh: &Mesh<S>, turned: &[bool]) -> Wedges {
        turn_round(&mut self.corners, turned);
        let mut wedges = Wedges {
            at: self.corners.into_flattened(),
            values: self.values,
            groups: self.groups,
            is_split: Vec::new(),
            layout: self.layout,
        };
        wedges.find_split(mesh);
        wedges
    }
}

/// The length on the surface of a unit of texture: the root of how much larger the triangles are on the
/// surface than in the texture, together.
fn texture_scale(
    channel: &Channel,
    corners: &[[u32; 3]],
    positions: &[Vec3],
    triangles: &[[u32; 3]],
) -> f64 {
    let (mut on_surface, mut in_texture) = (0.0, 0.0);
    for (triangle, wedges) in triangles.iter().zip(corners) {
        let [a, b, c] = triangle.map(|v| positions[v as usize].as_dvec3());
        let area = (b - a).cross(c - a).length();
        let [a, b, c] = wedges.map(|wedge| {
            let mut row = channel.row(wedge as usize);
            [row.next().unwrap_or(0.0), row.next().unwrap_or(0.0)]
        });
        let texture_area = signed_area(a, b, c).abs();
        if area.is_finite() && texture_area.is_finite() {
            on_surface += area;
            in_texture += texture_area;
        }
    }
    (on_surface / in_texture).sqrt()
}

/// Twice the area of a triangle in a texture, negative where it runs clockwise.
fn signed_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// The attributes of a surface's corners and faces; all empty where nothing is carried.
#[derive(Debug, Default)]
pub struct Wedges {
    /// The wedge of each directed edge's tail in its face.
    pub at: Vec<u32>,
    /// The numbers of the wedges, side by side.
    pub values: Vec<f32>,
    /// The group of each face.
    pub groups: Vec<u32>,
    /// One flag a vertex whose corners have several wedges.
    is_split: Vec<bool>,
    /// What the numbers are.
    pub layout: Arc<Layout>,
}

/// Wedges of the ends of an edge that become one if it collapses, and the numbers it has then.
#[derive(Clone, Debug, PartialEq)]
pub struct Joined {
    /// The wedges.
    pub members: Members,
    /// The numbers.
    pub values: SmallVec<[f32; 8]>,
}

/// Wedges of the ends of an edge, and whether each is at the head.
pub type Members = SmallVec<[(u32, bool); 4]>;

/// Wedges of the tail and the head of an edge, by two that become one or one that stays.
pub type Pairs = SmallVec<[[Option<u32>; 2]; 4]>;

impl Joined {
    fn has(&self, wedge: u32) -> bool {
        has(&self.members, wedge)
    }
}

fn has(members: &Members, wedge: u32) -> bool {
    members.iter().any(|member| member.0 == wedge)
}

/// All wedges of the vertex that is left of an edge; a list that takes little room where it is empty.
pub type Carried = Vec<Joined>;

impl Wedges {
    /// Whether nothing is carried by corners.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.at.is_empty()
    }

    /// The numbers of a wedge.
    pub fn row(&self, wedge: u32) -> &[f32] {
        let width = self.layout.width();
        &self.values[wedge as usize * width..][..width]
    }

    /// The number of wedges that there is room for.
    pub fn count(&self) -> usize {
        self.values.len() / self.layout.width().max(1)
    }

    /// The bytes that the arrays hold.
    pub fn bytes(&self) -> usize {
        (self.at.capacity() + self.values.capacity() + self.groups.capacity()) * size_of::<u32>()
            + self.is_split.capacity()
    }

    fn find_split<S: EdgeStore>(&mut self, mesh: &Mesh<S>) {
        if self.is_empty() {
            return;
        }
        let mut first = vec![NONE; mesh.vertex_slots()];
        let mut is_split = vec![false; mesh.vertex_slots()];
        for e in mesh.faces().flat_map(FaceId::edges) {
            let (v, wedge) = (mesh.tail(e).index(), self.at[e.index()]);
            if first[v] == NONE {
                first[v] = wedge;
            }
            is_split[v] |= first[v] != wedge;
        }
        self.is_split = is_split;
    }

    /// Whether the corners of a vertex may have several wedges.
    #[inline(always)]
    pub fn has_several(&self, v: VertexId) -> bool {
        self.is_split[v.index()]
    }

    /// The wedges at a vertex.
    pub fn at_vertex<S: EdgeStore>(&self, mesh: &Mesh<S>, v: VertexId) -> SmallVec<[u32; 4]> {
        let mut wedges = SmallVec::new();
        if !self.is_split[v.index()] {
            wedges.extend(mesh.fans(v).next().map(|e| self.at[e.index()]));
            return wedges;
        }
        for e in mesh.outgoing_edges(v) {
            let wedge = self.at[e.index()];
            if !wedges.contains(&wedge) {
                wedges.push(wedge);
            }
        }
        wedges
    }

    /// Whether the corners on both sides of an edge differ at one of its ends.
    pub fn is_seam<S: EdgeStore>(&self, mesh: &Mesh<S>, e: EdgeId) -> bool {
        let Some(o) = mesh.mate(e) else {
            return false;
        };
        !self.is_empty() && self.pairs_across(mesh, e, o).iter().any(|[a, b]| a != b)
    }

    /// Whether the faces on both sides of an edge are of different groups.
    pub fn is_border<S: EdgeStore>(&self, mesh: &Mesh<S>, e: EdgeId) -> bool {
        let group = |e: EdgeId| self.groups[e.face().index()];
        !self.groups.is_empty() && mesh.mate(e).is_some_and(|o| group(e) != group(o))
    }

    /// The wedges on both sides of an edge, at its tail and at its head.
    fn pairs_across<S: EdgeStore>(&self, mesh: &Mesh<S>, e: EdgeId, o: EdgeId) -> [[u32; 2]; 2] {
        let at = |e: EdgeId| self.at[e.index()];
        [[at(e), at(mesh.next(o))], [at(mesh.next(e)), at(o)]]
    }

    /// The wedges of the tail and the head of an edge, where each has but one.
    #[inline]
    pub fn only_at_ends<S: EdgeStore>(&self, mesh: &Mesh<S>, e: EdgeId) -> Option<[u32; 2]> {
        let is_split = mesh.edge_vertices(e).map(|v| self.is_split[v.index()]);
        let wedges = [e, mesh.next(e)].map(|corner| self.at[corner.index()]);
        (is_split == [false; 2]).then_some(wedges)
    }

    /// The wedges of the tail and the head that become one if an edge collapses, pair by pair; those
    /// that stay what they are without another. Nothing where more than two become one.
    pub fn pairs<S: EdgeStore>(&self, mesh: &Mesh<S>, e: EdgeId) -> Option<Pairs> {
        let [tails, heads] = mesh.edge_vertices(e).map(|v| self.at_vertex(mesh, v));
        let mut pairs: Pairs = tails.iter().map(|&tail| [Some(tail), None]).collect();
        for d in mesh.edge_star(e) {
            let mut corners = [d, mesh.next(d)];
            if mesh.tail(d) != mesh.tail(e) {
                corners.reverse();
            }
            let [tail, head] = corners.map(|corner| Some(self.at[corner.index()]));
            let pair = pairs.iter_mut().find(|pair| pair[0] == tail);
            let pair = pair.expect("every corner at an end was listed");
            if pair[1].is_some_and(|other| Some(other) != head) {
                return None;
            }
            pair[1] = head;
        }
        for head in heads.into_iter().map(Some) {
            match pairs.iter().filter(|pair| pair[1] == head).count() {
                0 => pairs.push([None, head]),
                1 => {}
                _ => return None,
            }
        }
        Some(pairs)
    }

    /// The wedges of the ends of an edge, those side by side that become one if it collapses: they have
    /// a corner each in a face at the edge.
    pub fn joined_by<S: EdgeStore>(&self, mesh: &Mesh<S>, e: EdgeId) -> SmallVec<[Members; 2]> {
        if let Some([tail, head]) = self.only_at_ends(mesh, e) {
            return smallvec![smallvec![(tail, false), (head, true)]];
        }
        if let Some(pairs) = self.pairs(mesh, e) {
            let members = |[tail, head]: [Option<u32>; 2]| {
                let [tail, head] = [tail.map(|w| (w, false)), head.map(|w| (w, true))];
                tail.into_iter().chain(head).collect()
            };
            return pairs.into_iter().map(members).collect();
        }
        let mut classes: SmallVec<[Members; 2]> = SmallVec::new();
        for (v, is_head) in mesh.edge_vertices(e).into_iter().zip([false, true]) {
            for wedge in self.at_vertex(mesh, v) {
                classes.push(smallvec![(wedge, is_head)]);
            }
        }
        for d in mesh.edge_star(e) {
            let corners = [d, mesh.next(d)].map(|corner| self.at[corner.index()]);
            let class_of = |classes: &[Members], wedge: u32| {
                let class = classes.iter().position(|class| has(class, wedge));
                class.expect("every corner at an end was listed")
            };
            let [a, b] = corners.map(|wedge| class_of(&classes, wedge));
            if a != b {
                let (first, second) = (a.min(b), a.max(b));
                let other = classes.remove(second);
                classes[first].extend(other);
            }
        }
        classes
    }

    /// Lets the corners of the vertex that is left have the wedges that its ends' have become.
    pub fn adopt<S: EdgeStore>(&mut self, mesh: &Mesh<S>, kept: VertexId, carried: &[Joined]) {
        let width = self.layout.width();
        for joined in carried {
            let row = &mut self.values[joined.members[0].0 as usize * width..][..width];
            row.copy_from_slice(&joined.values);
            self.layout.mend(row);
        }
        let wedge_of = |wedge: u32| {
            let joined = carried.iter().find(|joined| joined.has(wedge));
            joined.map_or(wedge, |joined| joined.members[0].0)
        };
        for e in mesh.outgoing_edges(kept) {
            self.at[e.index()] = wedge_of(self.at[e.index()]);
        }
        self.is_split[kept.index()] = carried.len() > 1;
    }

    /// Adds to the numbers of a wedge, where that gives numbers.
    pub fn shift(&mut self, wedge: u32, steps: impl Iterator<Item = f64>) {
        let width = self.layout.width();
        let row = &mut self.values[wedge as usize * width..][..width];
        for (x, step) in row.iter_mut().zip(steps) {
            let moved = (f64::from(*x) + step) as f32;
            if moved.is_finite() {
                *x = moved;
            }
        }
        self.layout.mend(row);
    }

    /// Gives the corners of a face those wedges that the faces beside it have there.
    pub fn adopt_face<S: EdgeStore>(&mut self, mesh: &Mesh<S>, f: FaceId) {
        for e in f.edges() {
            let across = mesh.mate(e).map(|o| mesh.next(o));
            let beside = || mesh.mate(mesh.prev(e));
            if let Some(corner) = across.or_else(beside) {
                self.at[e.index()] = self.at[corner.index()];
            }
        }
        for v in mesh.face_vertices(f) {
            self.is_split[v.index()] = true;
        }
    }

    /// Gives the corners of a vertex that was cut from another wedges of their own.
    pub fn part<S: EdgeStore>(&mut self, mesh: &Mesh<S>, v: VertexId) {
        self.is_split[v.index()] = true;
        for wedge in self.at_vertex(mesh, v) {
            let copy = self.count() as u32;
            self.values
                .extend_from_within(wedge as usize * self.layout.width()..);
            self.values
                .truncate((copy as usize + 1) * self.layout.width());
            for e in mesh.outgoing_edges(v) {
                if self.at[e.index()] == wedge {
                    self.at[e.index()] = copy;
                }
            }
        }
    }

    /// The places in a texture of a face's corners.
    fn places(&self, corners: [EdgeId; 3], part: &Range<usize>) -> [[f64; 2]; 3] {
        corners.map(|corner| place(self.row(self.at[corner.index()]), part))
    }

    /// Whether no face that stays turns over in a texture if `e` collapses.
    #[inline]
    pub fn keeps_charts<S: EdgeStore>(
        &self,
        mesh: &Mesh<S>,
        e: EdgeId,
        carried: &[Joined],
    ) -> bool {
        if self.is_empty() {
            return true;
        }
        let ends = mesh.edge_vertices(e);
        let new_row = |wedge: u32| {
            let joined = carried.iter().find(|joined| joined.has(wedge));
            joined.map(|joined| &joined.values[..])
        };
        self.layout
            .parts_of(Kind::TextureCoordinate)
            .filter(|part| part.len() > 1)
            .all(|part| {
                ends.iter().zip([ends[1], ends[0]]).all(|(&v, other)| {
                    mesh.outgoing_edges(v).all(|corner| {
                        let (next, prev) = (mesh.next(corner), mesh.prev(corner));
                        if mesh.head(corner) == other || mesh.tail(prev) == other {
                            return true;
                        }
                        let [a, b, c] = self.places([corner, next, prev], &part);
                        let new = new_row(self.at[corner.index()]);
                        let moved = new.map_or(a, |row| place(row, &part));
                        let (before, after) = (signed_area(a, b, c), signed_area(moved, b, c));
                        before == 0.0 || before * after > 0.0
                    })
                })
            })
    }

    /// Whether both faces at a smooth edge run the same way in a texture if it is flipped.
    pub fn flip_keeps_charts<S: EdgeStore>(&self, mesh: &Mesh<S>, e: EdgeId, o: EdgeId) -> bool {
        self.is_empty()
            || self
                .layout
                .parts_of(Kind::TextureCoordinate)
                .filter(|part| part.len() > 1)
                .all(|part| {
                    let [a, b, c] = self.places([e, mesh.next(e), mesh.prev(e)], &part);
                    let [.., d] = self.places([o, mesh.next(o), mesh.prev(o)], &part);
                    let before = [signed_area(a, b, c), signed_area(b, a, d)];
                    let after = [signed_area(d, c, a), signed_area(c, d, b)];
                    before[0] * after[0] > 0.0 && before[1] * after[1] > 0.0
                })
    }

    /// Follows the flip of `e`, of whose four sides each is given before and after.
    pub fn flip<S: EdgeStore>(&mut self, mesh: &Mesh<S>, e: EdgeId, sides: &[(EdgeId, EdgeId); 4]) {
        let before = sides.map(|(old, _)| self.at[old.index()]);
        for ((_, new), wedge) in sides.iter().zip(before) {
            self.at[new.index()] = wedge;
        }
        // The flipped edge runs between the other two corners, each of which is its neighbour's, too.
        for d in mesh.edge_star(e) {
            let corner = mesh
                .mate(d)
                .map(|o| mesh.next(o))
                .expect("a flipped edge has two faces");
            self.at[d.index()] = self.at[corner.index()];
        }
    }

    /// Takes normals at a vertex that differ little for one, so that what is smooth in all else is
    /// smooth.
    pub fn smooth<S: EdgeStore>(&mut self, mesh: &Mesh<S>) {
        let normals: Vec<Range<usize>> = self.layout.parts_of(Kind::Normal).collect();
        if normals.is_empty() || self.is_empty() {
            return;
        }
        let is_normal = |i: usize| normals.iter().any(|part| part.contains(&i));
        let differ_in_normals_alone = |[a, b]: [u32; 2]| {
            let (a, b) = (self.row(a), self.row(b));
            (0..a.len()).all(|i| is_normal(i) || a[i].to_bits() == b[i].to_bits())
        };
        let least = SMOOTH_DEGREES.to_radians().cos();
        let cosine = |[a, b]: [u32; 2]| {
            let (a, b) = (self.row(a), self.row(b));
            let of_part = |part: &Range<usize>| {
                let products = a[part.clone()].iter().zip(&b[part.clone()]);
                products
                    .map(|(x, y)| f64::from(*x) * f64::from(*y))
                    .sum::<f64>()
            };
            normals.iter().map(of_part).fold(f64::INFINITY, f64::min)
        };
        let (mut edges, mut parted) = (0, 0);
        let mut pairs: Vec<([u32; 2], f64)> = Vec::new();
        for e in mesh.faces().flat_map(FaceId::edges) {
            let Some(o) = mesh.mate(e).filter(|&o| e < o) else {
                continue;
            };
            edges += 1;
            let across = self.pairs_across(mesh, e, o);
            let across = across.into_iter().filter(|[a, b]| a != b);
            let across = across.filter(|&pair| differ_in_normals_alone(pair));
            let begin = pairs.len();
            pairs.extend(across.map(|pair| (pair, cosine(pair))));
            parted += usize::from(pairs.len() > begin);
        }
        let is_faceted = f64::from(parted as u32) > FACETED * f64::from(edges as u32);
        let mut root: Vec<u32> = (0..self.count() as u32).collect();
        for ([a, b], cosine) in pairs {
            if is_faceted || cosine >= least {
                let [a, b] = [a, b].map(|wedge| find(&mut root, wedge));
                root[a.max(b) as usize] = a.min(b);
            }
        }
        let width = self.layout.width();
        let mut sums: Vec<f64> = vec![0.0; self.values.len()];
        let mut members = vec![0; root.len()];
        for wedge in 0..root.len() as u32 {
            let to = find(&mut root, wedge) as usize;
            members[to] += 1;
            for i in 0..width {
                sums[to * width + i] += f64::from(self.row(wedge)[i]);
            }
        }
        let layout = self.layout.clone();
        let rows = self
            .values
            .chunks_exact_mut(width)
            .zip(sums.chunks_exact(width));
        for ((row, sum), _) in rows.zip(&members).filter(|(_, members)| **members > 1) {
            for i in (0..width).filter(|&i| is_normal(i)) {
                row[i] = sum[i] as f32;
            }
            layout.mend(row);
        }
        for wedge in &mut self.at {
            // Of a dead face a corner may name none.
            if (*wedge as usize) < root.len() {
                *wedge = find(&mut root, *wedge);
            }
        }
        self.find_split(mesh);
    }

    /// What is left as flat arrays.
    pub fn into_flat<S: EdgeStore>(self, mesh: &Mesh<S>) -> FlatWedges {
        let mut flat = FlatWedges {
            values: self.values,
            layout: self.layout,
            ..FlatWedges::default()
        };
        if !self.at.is_empty() {
            let corners = mesh.faces().map(|f| f.edges().map(|e| self.at[e.index()]));
            flat.corners = corners.collect();
        }
        if !self.groups.is_empty() {
            flat.groups = mesh.faces().map(|f| self.groups[f.index()]).collect();
        }
        flat
    }
}

/// The place that a row names in a texture.
fn place(row: &[f32], part: &Range<usize>) -> [f64; 2] {
    [row[part.start].into(), row[part.start + 1].into()]
}

/// The representative of a set of wedges.
fn find(root: &mut [u32], wedge: u32) -> u32 {
    let mut at = wedge;
    while root[at as usize] != at {
        root[at as usize] = root[root[at as usize] as usize];
        at = root[at as usize];
    }
    at
}

impl<S: EdgeStore> Surface<S> {
    /// The wedges of the vertex that is left of an edge between its ends, by where it is on the way
    /// from tail to head; those at one end only stay what they are.
    pub fn interpolated(&self, e: EdgeId, position: Vec3) -> Carried {
        let [v, w] = self.mesh.edge_vertices(e);
        let along = self.geometry.between(v, w);
        let way =
            (position.as_dvec3() - self.geometry.position(v).as_dvec3()) * self.geometry.scale();
        let t = along.dot(way) / along.length_squared();
        let t = if t.is_finite() {
            t.clamp(0.0, 1.0)
        } else {
            0.0
        };
        let carry = |members: Members| {
            let mean = |i: usize, is_head: bool| {
                let at_end = members.iter().filter(|m| m.1 == is_head);
                let at_end = at_end.map(|m| f64::from(self.wedges.row(m.0)[i]));
                let (sum, count) = at_end.fold((0.0, 0.0), |(s, n), x| (s + x, n + 1.0));
                (count > 0.0).then_some(sum / count)
            };
            let numbers = 0..self.wedges.layout.width();
            let values = numbers.map(|i| match (mean(i, false), mean(i, true)) {
                (Some(a), Some(b)) => (a + (b - a) * t) as f32,
                (a, b) => a.or(b).unwrap_or(0.0) as f32,
            });
            Joined {
                values: values.collect(),
                members,
            }
        };
        let joined = self.wedges.joined_by(&self.mesh, e);
        joined.into_iter().map(carry).collect()
    }
}
