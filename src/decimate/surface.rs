//! A mesh being decimated: connectivity, geometry and what is carried along.

use glam::{DVec3, Vec3};

use super::curves::Curves;
use super::geometry::Geometry;
use super::options::{AttributeUse, Boundary, Options};
use super::rules;
use super::wedges::{Carried, Wedges};
use crate::mesh::{Collapse, Contraction, Disks, EdgeId, EdgeStore, FaceId, Mesh, VertexId};
use crate::progress::{self, BLOCK, Meter};

/// A collapse, and where its ends were.
pub struct Merged {
    /// What happened to the mesh.
    pub collapse: Collapse,
    /// The positions before of the vertex that is gone and of the one that is left.
    pub from: [Vec3; 2],
    /// The vertices around that may have lost faces, too, where it was no mere collapse.
    pub around: Vec<VertexId>,
    /// Where the vertex that is left is busy and stayed where it was: those of its edges that were
    /// the other's, and those that became one with one of them. All else around it is as it was.
    pub gained: Option<Vec<EdgeId>>,
}

/// How an edge is collapsed.
pub enum Way<'a> {
    /// With all its faces; where it lies between two disks, with what lies around it.
    Collapse(Option<&'a Disks>),
    /// As this says, which changes the topology and costs so much.
    Contract(Contraction, Loss),
}

/// How an edge is collapsed, and what of it was found out beforehand.
pub struct Plan<'a> {
    pub way: Way<'a>,
    /// What [`Surface::deviation_after`] said.
    pub deviation: f32,
    /// What the wedges of both ends become.
    pub carried: Carried,
}

/// What a change of the topology costs.
#[derive(Clone, Copy, Debug, Default)]
pub struct Loss {
    /// As the cost of a collapse.
    pub price: f32,
    /// How far from the original it may leave something, in the unit box.
    pub reach: f64,
}

/// A mesh being decimated and all that is carried along by its slots.
pub struct Surface<S> {
    /// Which triangles meet where.
    pub mesh: Mesh<S>,
    /// Where the vertices are, and an estimate of how far each is from the original.
    pub geometry: Geometry,
    /// One flag a vertex that must not move, or nothing where all may.
    pub locked: Vec<bool>,
    /// One flag a face that counts as two, or nothing where none does.
    pub double_sided: Vec<bool>,
    /// One flag a face that was turned round to agree with its neighbours, or nothing where none was.
    pub turned: Vec<bool>,
    /// The curves that are kept.
    pub curves: Curves,
    /// What the corners and faces carry.
    pub wedges: Wedges,
    /// What the cost is multiplied by around each vertex, or nothing where by 1.
    pub weights: Vec<f32>,
    /// One flag a vertex that has faces elsewhere, so that no edge at it collapses here, or nothing
    /// where all faces are here.
    pub seam: Vec<bool>,
    /// How far what was removed altogether may have been from what is left, in the unit box.
    pub lost: f64,
}

impl<S: EdgeStore> Surface<S> {
    /// Whether the vertex must not move.
    #[inline]
    pub fn is_locked(&self, v: VertexId) -> bool {
        self.locked.get(v.index()) == Some(&true)
    }

    /// Whether the vertex has faces elsewhere.
    #[inline]
    pub fn is_on_seam(&self, v: VertexId) -> bool {
        self.seam.get(v.index()) == Some(&true)
    }

    /// Whether the edge may have faces elsewhere.
    #[inline]
    pub fn is_rim(&self, e: EdgeId) -> bool {
        !self.seam.is_empty() && self.mesh.edge_vertices(e).map(|v| self.is_on_seam(v)) == [true; 2]
    }

    /// Whether anything is to be said of faces beside their vertices.
    pub fn has_flags(&self) -> bool {
        !(self.double_sided.is_empty() && self.turned.is_empty()) || self.curves.are_kept()
    }

    /// Locks a vertex.
    pub fn lock(&mut self, v: VertexId) {
        self.locked.resize(self.mesh.vertex_slots(), false);
        self.locked[v.index()] = true;
    }

    /// Locks the boundary and marks creases, where that is asked for, and attribute seams and borders of
    /// groups; how many edges these have. Needs the whole surface.
    pub fn prepare(&mut self, options: &Options, meter: &mut Meter) -> progress::Result<usize> {
        if options.boundary == Boundary::Lock {
            self.lock_boundary();
            meter.detour(self.mesh.face_slots())?;
        }
        if let Some(degrees) = options.feature_angle_degrees {
            self.mark_creases(degrees, meter)?;
        }
        if options.attributes == AttributeUse::Optimize {
            self.wedges.smooth(&self.mesh);
        }
        let seam_edges = self.mark_attribute_seams(options.attributes);
        meter.detour(self.mesh.face_slots())?;
        Ok(seam_edges)
    }

    /// Marks the borders of groups as creases, and attribute seams unless attributes are but carried.
    /// They may shift sideways, unless other creases are kept, too. How many edges it marks.
    fn mark_attribute_seams(&mut self, usage: AttributeUse) -> usize {
        let (mesh, wedges) = (&self.mesh, &self.wedges);
        if wedges.is_empty() && wedges.groups.is_empty() {
            return 0;
        }
        let is_kept = |e: EdgeId| match usage {
            AttributeUse::Optimize => wedges.is_seam(mesh, e) || wedges.is_border(mesh, e),
            AttributeUse::Carry | AttributeUse::Ignore => wedges.is_border(mesh, e),
        };
        let edges = mesh.faces().flat_map(FaceId::edges);
        let kept: Vec<EdgeId> = edges.filter(|&e| is_kept(e)).collect();
        if !kept.is_empty() {
            let may_shift = !self.curves.are_kept();
            let mut creases = self.curves.creases().to_vec();
            creases.resize(3 * mesh.face_slots(), false);
            kept.iter().for_each(|e| creases[e.index()] = true);
            self.curves = Curves::of(mesh, creases, may_shift);
        }
        // Each from both sides.
        kept.len() / 2
    }

    /// Locks the vertices on boundary edges.
    fn lock_boundary(&mut self) {
        let mut locked = std::mem::take(&mut self.locked);
        locked.resize(self.mesh.vertex_slots(), false);
        for e in self.mesh.edges().filter(|&e| self.mesh.is_boundary(e)) {
            for v in self.mesh.edge_vertices(e) {
                locked[v.index()] = true;
            }
        }
        self.locked = locked;
    }

    /// The triangles that a face counts as: two where it is double-sided.
    #[inline]
    pub fn sides(&self, f: FaceId) -> usize {
        1 + usize::from(self.double_sided.get(f.index()) == Some(&true))
    }

    /// The triangles, double-sided ones counted as two.
    pub fn triangles(&self) -> usize {
        if self.double_sided.is_empty() {
            self.mesh.face_count()
        } else {
            self.mesh.faces().map(|f| self.sides(f)).sum()
        }
    }

    /// The weight of a vertex.
    #[inline]
    pub fn weight(&self, v: VertexId) -> f64 {
        self.weights.get(v.index()).map_or(1.0, |&w| f64::from(w))
    }

    /// Whether the edge is kept as part of a curve that is neither boundary nor non-manifold.
    #[inline]
    pub fn is_crease(&self, e: EdgeId) -> bool {
        self.curves.is_crease(e)
    }

    /// Marks the edges at which the surface turns by more than `degrees` as creases.
    fn mark_creases(&mut self, degrees: f64, meter: &mut Meter) -> progress::Result<()> {
        let (mesh, geometry) = (&self.mesh, &self.geometry);
        let flattest = degrees.to_radians().cos();
        let is_sharp = |e: EdgeId| {
            mesh.mate(e).is_some_and(|o| {
                let normals = [e, o].map(|e| geometry.normal(mesh, e));
                let lengths = normals[0].length() * normals[1].length();
                lengths > 0.0 && normals[0].dot(normals[1]) < flattest * lengths
            })
        };
        let mut creases = vec![false; 3 * mesh.face_slots()];
        for f in mesh.faces() {
            for e in f.edges() {
                creases[e.index()] = is_sharp(e);
            }
            if f.index() % BLOCK == 0 {
                meter.detour(2 * BLOCK)?;
            }
        }
        self.curves = Curves::of(&self.mesh, creases, false);
        Ok(())
    }

    /// Which ends of `e` stay where they are if it collapses, tail first.
    #[inline]
    pub fn held(&self, e: EdgeId) -> [bool; 2] {
        let ends = self.mesh.edge_vertices(e);
        if !self.seam.is_empty() && (self.is_on_seam(ends[0]) | self.is_on_seam(ends[1])) {
            return [true; 2];
        }
        if self.locked.is_empty() && !self.curves.are_kept() {
            return [false; 2];
        }
        self.held_by_lock_or_curve(e)
    }

    fn held_by_lock_or_curve(&self, e: EdgeId) -> [bool; 2] {
        let mut held = self.curves.held(&self.mesh, e);
        for (held, v) in held.iter_mut().zip(self.mesh.edge_vertices(e)) {
            *held |= self.is_locked(v);
        }
        held
    }

    /// Moves the ends of `e` to one position, as one vertex, which takes over what both carried.
    pub fn collapse(&mut self, e: EdgeId, position: Vec3, plan: &Plan) -> Merged {
        let merging = self.curves.before_collapse(&self.mesh, e);
        let gained = match &plan.way {
            Way::Collapse(None) => self.gained_if_busy(e, position),
            _ => None,
        };
        let (collapse, around) = match &plan.way {
            Way::Collapse(disks) => (self.mesh.collapse_between(e, *disks), Vec::new()),
            Way::Contract(contraction, _) => {
                debug_assert!(
                    merging.is_none(),
                    "curves are kept where the topology is not"
                );
                let around = contraction.around().to_vec();
                (self.mesh.contract(contraction), around)
            }
        };
        let gained = gained.map(|mut gained| {
            gained.retain(|e| self.mesh.is_live_face(e.face()));
            gained.extend(&collapse.merged_edges);
            gained
        });
        let from = [collapse.removed, collapse.kept].map(|v| self.geometry.position(v));
        self.geometry.set_position(collapse.kept, position);
        if self.is_locked(collapse.removed) {
            self.lock(collapse.kept);
        }
        if !self.weights.is_empty() {
            let of_removed = self.weights[collapse.removed.index()];
            let of_kept = &mut self.weights[collapse.kept.index()];
            *of_kept = of_kept.max(of_removed);
        }
        if let Some(merging) = merging {
            self.curves.after_collapse(&self.mesh, &collapse, &merging);
        }
        if !self.wedges.is_empty() {
            self.wedges.adopt(&self.mesh, collapse.kept, &plan.carried);
        }
        self.geometry.set_deviation(collapse.kept, plan.deviation);
        Merged {
            collapse,
            from,
            around,
            gained,
        }
    }

    /// Where the vertex that the collapse of `e` leaves is busy and stays where it is: the edges that
    /// the other one has, each once.
    fn gained_if_busy(&self, e: EdgeId, position: Vec3) -> Option<Vec<EdgeId>> {
        let [removed, kept] = self.mesh.collapse_ends(e);
        let stays = self.geometry.position(kept) == position && self.mesh.is_busy(kept);
        stays.then(|| self.mesh.vertex_edges(removed).into_vec())
    }

    /// What pinching the loop costs: the two caps' area times the squared length of the longest side,
    /// as if all of both were that far from the original.
    pub fn pinch_loss(&self, edges: &[EdgeId; 3]) -> Loss {
        let [a, b, c] = edges.map(|e| self.geometry.vector(Vec3::ZERO, self.mesh.tail(e)));
        let longest = (b - a)
            .length_squared()
            .max((c - b).length_squared())
            .max((a - c).length_squared());
        Loss {
            price: ((b - a).cross(c - a).length() * longest) as f32,
            reach: longest.sqrt(),
        }
    }

    /// Cuts along a loop and caps both sides; the right one takes the dead `caps` and `vertices`, a
    /// thousandth of the way to its neighbours, so that both sides stay apart in a file. Nothing
    /// where single precision cannot tell them apart.
    pub fn pinch(
        &mut self,
        edges: &[EdgeId; 3],
        caps: [FaceId; 2],
        vertices: [VertexId; 3],
    ) -> Option<()> {
        const APART: f64 = 1e-3;
        let tails = edges.map(|e| self.mesh.tail(e));
        let mut places = [Vec3::ZERO; 3];
        for (i, leaving) in self.mesh.right_of_loop(edges).iter().enumerate() {
            let here = self.geometry.position(tails[i]);
            let at = |&e: &EdgeId| self.geometry.position(self.mesh.apex(e)).as_dvec3();
            let mean = leaving.iter().map(at).sum::<DVec3>() / leaving.len() as f64;
            places[i] = (here.as_dvec3() + (mean - here.as_dvec3()) * APART).as_vec3();
            if places[i] == here || !places[i].is_finite() {
                return None;
            }
        }
        self.mesh.pinch(edges, caps, vertices);
        if !self.wedges.is_empty() {
            vertices
                .into_iter()
                .for_each(|v| self.wedges.part(&self.mesh, v));
            caps.into_iter()
                .for_each(|f| self.wedges.adopt_face(&self.mesh, f));
        }
        for cap in caps {
            self.revive(cap, edges[0].face());
        }
        for ((old, new), place) in tails.into_iter().zip(vertices).zip(places) {
            self.geometry.set_position(new, place);
            let deviation = self.geometry.deviation(old);
            self.geometry.set_deviation(new, deviation);
            if !self.weights.is_empty() {
                self.weights[new.index()] = self.weights[old.index()];
            }
            if let Some(locked) = self.locked.get_mut(new.index()) {
                *locked = false;
            }
        }
        Some(())
    }

    /// The price of a face between the boundary edge `e` and the one behind it, where that closes a
    /// gap: the face's area times its squared width. Nothing where the gap is wide against the edges,
    /// or the face would lie on its neighbours.
    pub fn fill_price(&self, e: EdgeId) -> Option<f64> {
        /// The width of a gap against the shorter edge beside it.
        const WIDE: f64 = 0.5;
        let next = self.mesh.fill_condition(e)?;
        let v = self.geometry.position(self.mesh.head(e));
        let to_a = self.geometry.vector(v, self.mesh.tail(e));
        let to_b = self.geometry.vector(v, self.mesh.head(next));
        let shorter = to_a.length().min(to_b.length());
        let normal = to_a.cross(to_b);
        let is_beside = |e| self.geometry.normal(&self.mesh, e).dot(normal) > 0.0;
        let may = (to_a - to_b).length() <= WIDE * shorter && is_beside(e) && is_beside(next);
        let width = normal.length() / to_a.length().max(to_b.length());
        may.then_some(normal.length() / 2.0 * width * width)
    }

    /// Puts the dead `face` between the boundary edge `e` and the one behind it; its vertices.
    pub fn fill(&mut self, e: EdgeId, face: FaceId) -> [VertexId; 3] {
        self.revive(face, e.face());
        let around = self.mesh.fill(e, face);
        if !self.wedges.is_empty() {
            self.wedges.adopt_face(&self.mesh, face);
        }
        around
    }

    /// Gives a face that was dead what `beside` carries.
    fn revive(&mut self, face: FaceId, beside: FaceId) {
        let turned = self.turned.get(beside.index()) == Some(&true);
        if let Some(flag) = self.turned.get_mut(face.index()) {
            *flag = turned;
        }
        if let Some(double) = self.double_sided.get_mut(face.index()) {
            *double = false;
        }
        if !self.wedges.groups.is_empty() {
            self.wedges.groups[face.index()] = self.wedges.groups[beside.index()];
        }
    }

    /// Flips `e`, which must be no crease.
    pub fn flip(&mut self, e: EdgeId) {
        let sides = self.mesh.flip(e);
        if !self.wedges.is_empty() {
            self.wedges.flip(&self.mesh, e, &sides);
        }
        self.curves.after_flip(sides);
    }

    /// The deviation that the merged vertex would have, or nothing where a face would turn: a
    /// memoryless cost forgets, so each vertex carries the sum of what its collapses moved away from
    /// the planes at hand.
    #[inline]
    pub fn deviation_after(&self, e: EdgeId, way: &Way, position: Vec3) -> Option<f32> {
        let [v, w] = self.mesh.edge_vertices(e);
        let deviation = self.geometry.deviation(v).max(self.geometry.deviation(w));
        let moved = match way {
            Way::Collapse(Some(disks)) => {
                rules::distance_from_disks(&self.geometry, disks, position)
            }
            _ => rules::distance_from_star(&self.mesh, &self.geometry, e, position),
        };
        Some(deviation + moved?)
    }

    /// The largest estimated distance from the original, in the unit box.
    pub fn max_deviation(&self) -> f64 {
        let deviations = self.mesh.vertices().map(|v| self.geometry.deviation(v));
        f64::from(deviations.fold(0.0, f32::max)).max(self.lost)
    }

    /// What it costs that these faces go without a trace: their area times the squared diagonal of
    /// the box around them, as if all of it went that far.
    pub fn loss(&self, faces: &[FaceId]) -> Loss {
        if faces.is_empty() {
            return Loss::default();
        }
        let (mut min, mut max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let mut area = 0.0;
        for f in faces {
            area += self.geometry.normal(&self.mesh, f.edges()[0]).length() / 2.0;
            for v in self.mesh.face_vertices(*f) {
                min = min.min(self.geometry.position(v));
                max = max.max(self.geometry.position(v));
            }
        }
        let diagonal = (max.as_dvec3() - min.as_dvec3()) * self.geometry.scale();
        let reach = diagonal.length();
        Loss {
            price: (area * reach * reach) as f32,
            reach,
        }
    }

    /// Whether the mesh and what is known of its curves are sound. Linear time.
    ///
    /// # Errors
    /// What is wrong.
    pub fn check(&self) -> Result<(), String> {
        self.mesh.check()?;
        self.curves.check(&self.mesh)
    }

    /// The bytes of connectivity and positions.
    pub fn mesh_bytes(&self) -> usize {
        self.mesh.bytes() + self.geometry.position_bytes()
    }

    /// The bytes of what is carried along.
    pub fn carried_bytes(&self) -> usize {
        self.locked.capacity()
            + self.seam.capacity()
            + self.double_sided.capacity()
            + self.curves.bytes()
            + self.wedges.bytes()
            + self.weights.capacity() * size_of::<f32>()
            + self.geometry.deviation_bytes()
    }
}
