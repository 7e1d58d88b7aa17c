//! A surface as flat arrays, without connectivity: what is handed from stage to stage.

use glam::Vec3;

use super::curves::Curves;
use super::geometry::{Geometry, Room};
use super::surface::Surface;
use super::wedges::FlatWedges;
use crate::indexed_mesh::Parts;
use crate::mesh::{Compaction, EdgeStore, FaceId, Mesh};

/// What is known of a face beside its vertices, in one byte.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FaceFlags(u8);

impl FaceFlags {
    const DOUBLE_SIDED: u8 = 1;
    const TURNED: u8 = 2;
    /// Of the edge at the first corner; the next two bits are the other edges'.
    const CREASE: u8 = 4;

    /// What lists with one element a face, or directed edge, or none at all, say of face `f`.
    fn of(f: FaceId, double_sided: &[bool], turned: &[bool], creases: &[bool]) -> Self {
        let flag = |flags: &[bool], i: usize, bit: u8| {
            if flags.get(i) == Some(&true) { bit } else { 0 }
        };
        let of_face = flag(double_sided, f.index(), Self::DOUBLE_SIDED)
            | flag(turned, f.index(), Self::TURNED);
        let edges = f.edges().into_iter().enumerate();
        Self(edges.fold(of_face, |bits, (k, e)| {
            bits | flag(creases, e.index(), Self::CREASE << k)
        }))
    }

    /// Whether the face counts as two.
    pub fn is_double_sided(self) -> bool {
        self.0 & Self::DOUBLE_SIDED != 0
    }

    /// Whether the face was turned round to agree with its neighbours.
    pub fn is_turned(self) -> bool {
        self.0 & Self::TURNED != 0
    }
}

/// Positions, triangles and what is carried along: one element a vertex or a face, or none at all
/// where nothing is to be said.
#[derive(Debug, Default)]
pub struct Flat<V> {
    /// Where the vertices are.
    pub positions: Vec<Vec3>,
    /// Three vertices each.
    pub triangles: Vec<[u32; 3]>,
    /// The vertices that must not move.
    pub locked: Vec<bool>,
    /// What the cost is multiplied by around each vertex.
    pub weights: Vec<f32>,
    /// How far each vertex may be from the original, in the unit box.
    pub deviation: Vec<f32>,
    /// What a cost model knows of each vertex.
    pub states: Vec<V>,
    /// What is known of the faces.
    pub flags: Vec<FaceFlags>,
    /// What the corners and faces carry.
    pub wedges: FlatWedges,
    /// Whether creases are kept, though there may be none.
    pub creased: bool,
    /// Whether they may shift sideways.
    pub may_shift: bool,
}

/// The largest weight, relative to the middle one: large enough to leave a vertex for the last, and
/// small enough for what it multiplies to stay finite in single precision.
const LARGEST_WEIGHT: f32 = 1e20;

impl<V> Flat<V> {
    /// The arrays of a mesh.
    pub fn of(parts: Parts) -> Self {
        let flags = if parts.double_sided.is_empty() {
            Vec::new()
        } else {
            let faces = (0..parts.triangles.len()).map(FaceId::new);
            faces
                .map(|f| FaceFlags::of(f, &parts.double_sided, &[], &[]))
                .collect()
        };
        let mut flat = Self {
            positions: parts.positions,
            triangles: parts.triangles,
            locked: Vec::new(),
            weights: Vec::new(),
            deviation: Vec::new(),
            states: Vec::new(),
            flags,
            wedges: FlatWedges::default(),
            creased: false,
            may_shift: false,
        };
        flat.weigh(parts.weights);
        flat
    }

    /// Weighs the vertices: one weight each, or none. Infinite ones lock; of the others only the
    /// ratios count. The middle one becomes 1, the weight that the costs' tie-break is made for.
    fn weigh(&mut self, mut weights: Vec<f32>) {
        let is_proper = |w: &f32| *w > 0.0 && w.is_finite();
        let mut proper: Vec<f32> = weights.iter().copied().filter(is_proper).collect();
        let half = proper.len() / 2;
        let middle = if proper.is_empty() {
            1.0
        } else {
            *proper.select_nth_unstable_by(half, f32::total_cmp).1
        };
        for (v, weight) in weights.iter_mut().enumerate() {
            if weight.is_infinite() {
                self.locked.resize(self.positions.len(), false);
                self.locked[v] = true;
                *weight = 1.0;
            } else {
                *weight = (*weight / middle).min(LARGEST_WEIGHT);
            }
        }
        if weights.iter().any(|&w| w != 1.0) {
            self.weights = weights;
        }
    }

    /// The triangles, double-sided ones counted as two.
    pub fn triangle_count(&self) -> usize {
        let double = self.flags.iter().filter(|f| f.is_double_sided()).count();
        self.triangles.len() + double
    }

    /// One flag a face or directed edge: which of them has a bit; nothing where none has, unless all
    /// are wanted.
    fn unpacked(&self, faces: usize, bits: &[u8], all: bool) -> Vec<bool> {
        let any = bits.iter().fold(0, |any, bit| any | bit);
        if !all && self.flags.iter().all(|f| f.0 & any == 0) {
            return Vec::new();
        }
        let of_face = |f: &FaceFlags| {
            let f = *f;
            bits.iter().map(move |bit| f.0 & bit != 0)
        };
        let mut unpacked: Vec<bool> = self.flags.iter().flat_map(of_face).collect();
        unpacked.resize(bits.len() * faces, false);
        unpacked
    }

    /// The surface of these arrays over a mesh built from their triangles, and the states.
    ///
    /// `room` is the one of the whole. `turned` says which faces were turned round for the mesh.
    pub fn into_surface<S: EdgeStore>(
        self,
        mesh: Mesh<S>,
        room: Room,
        turned: &[bool],
    ) -> (Surface<S>, Vec<V>) {
        let faces = mesh.face_slots();
        let mut was_turned = self.unpacked(faces, &[FaceFlags::TURNED], !turned.is_empty());
        for (was, now) in was_turned.iter_mut().zip(turned) {
            *was ^= now;
        }
        let [a, b, c] = [0, 1, 2].map(|k| FaceFlags::CREASE << k);
        let mut creases = self.unpacked(faces, &[a, b, c], self.creased);
        // Turned round, a face has its edges the other way round behind its first corner, too.
        let edges = creases.chunks_exact_mut(3).zip(turned);
        edges
            .filter(|(_, turned)| **turned)
            .for_each(|(edges, _)| edges.swap(0, 2));
        let double_sided = self.unpacked(faces, &[FaceFlags::DOUBLE_SIDED], false);
        let surface = Surface {
            locked: self.locked,
            double_sided,
            curves: Curves::of(&mesh, creases, self.may_shift),
            weights: self.weights,
            lost: 0.0,
            turned: was_turned,
            geometry: Geometry::with_deviations(self.positions, &self.deviation, room),
            wedges: self.wedges.into_wedges(&mesh, turned),
            mesh,
            seam: Vec::new(),
        };
        (surface, self.states)
    }
}

impl<S: EdgeStore> Surface<S> {
    /// What is known of a face.
    pub fn flags(&self, f: FaceId) -> FaceFlags {
        FaceFlags::of(f, &self.double_sided, &self.turned, self.curves.creases())
    }

    /// The arrays of what is left.
    pub fn into_flat<V>(self) -> Flat<V> {
        let flags = if self.has_flags() {
            self.mesh.faces().map(|f| self.flags(f)).collect()
        } else {
            Vec::new()
        };
        let (creased, may_shift) = (self.curves.are_kept(), self.curves.may_shift());
        let wedges = self.wedges.into_flat(&self.mesh);
        let Self {
            mut mesh,
            geometry,
            mut locked,
            mut weights,
            ..
        } = self;
        let vertices = mesh.compact().vertices;
        let mut positions: Vec<Vec3> = geometry.positions().collect();
        let mut deviation: Vec<f32> = geometry.deviations().collect();
        drop(geometry);
        Compaction::retain(&vertices, &mut positions);
        Compaction::retain(&vertices, &mut locked);
        Compaction::retain(&vertices, &mut weights);
        Compaction::retain(&vertices, &mut deviation);
        Flat {
            positions,
            triangles: mesh.triangles(),
            locked,
            weights,
            deviation,
            states: Vec::new(),
            flags,
            wedges,
            creased,
            may_shift,
        }
    }
}
