//! The one loop: the cheapest edge, again and again, until a target is reached.

use std::ops::ControlFlow;

use glam::Vec3;
use rayon::prelude::*;

use super::cost::{Cost, Evaluation};
use super::geometry::Geometry;
use super::queue::{Candidate, Queue};
use super::report::{Blocked, StopReason, Tally};
use super::rules;
use crate::error::{Error, Result};
use crate::mesh::{Collapse, EdgeId, EdgeStore, FaceId, Mesh, VertexId};

/// When the loop stops.
#[derive(Clone, Copy, Debug)]
pub struct Stop {
    /// At this many triangles, double-sided ones counted as two, or just below.
    pub triangles: usize,
    /// Before an estimated error above this, in the unit box.
    pub max_error: Option<f64>,
}

/// The faces whose edges are evaluated at a time, in parallel.
const BLOCK_FACES: usize = 1 << 16;

/// Why a candidate cannot be collapsed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rejection {
    Link,
    Flip,
    Error,
}

/// A mesh being decimated: connectivity, geometry and what is carried along, under one cost.
pub struct Greedy<'a, S, C, Q> {
    mesh: &'a mut Mesh<S>,
    geometry: &'a mut Geometry,
    cost: C,
    queue: Q,
    /// One flag a vertex that must not move, or nothing where all may.
    locked: Vec<bool>,
    /// One flag a face that counts as two, or nothing where none does.
    double_sided: &'a [bool],
    /// An estimate of how far each vertex is from the original, in the unit box.
    deviation: Vec<f32>,
    /// The number of collapses before each vertex's surroundings last changed.
    changed_at: Vec<u32>,
    /// The edges to evaluate after a collapse; kept for its memory.
    edges: Vec<EdgeId>,
    triangles: usize,
    max_error: Option<f64>,
    tally: Tally,
}

impl<'a, S: EdgeStore, C: Cost<S>, Q: Queue> Greedy<'a, S, C, Q> {
    /// Evaluates every edge, in parallel.
    pub fn new(
        mesh: &'a mut Mesh<S>,
        geometry: &'a mut Geometry,
        cost: C,
        locked: Vec<bool>,
        double_sided: &'a [bool],
    ) -> Self {
        let slots = mesh.vertex_slots();
        let triangles = mesh.face_count() + double_sided.iter().filter(|&&d| d).count();
        let mut greedy = Self {
            mesh,
            geometry,
            cost,
            queue: Q::from_candidates(Vec::new()),
            locked,
            double_sided,
            deviation: vec![0.0; slots],
            changed_at: vec![0; slots],
            edges: Vec::new(),
            triangles,
            max_error: None,
            tally: Tally::default(),
        };
        let this = &greedy;
        // In blocks, so that no second copy of all candidates is held.
        let mut candidates: Vec<Candidate> = Vec::with_capacity(3 * this.mesh.face_count() / 2);
        let slots = this.mesh.face_slots();
        for first in (0..slots).step_by(BLOCK_FACES) {
            let block: Vec<Candidate> = (first..slots.min(first + BLOCK_FACES))
                .into_par_iter()
                .map(FaceId::new)
                .filter(|&f| this.mesh.is_live_face(f))
                .flat_map_iter(|f| f.edges().into_iter())
                .filter(|&e| this.mesh.canonical(e) == e)
                .filter_map(|e| this.candidate(e))
                .collect();
            candidates.extend(block);
        }
        greedy.tally.rejected_lock = greedy.locked_edges();
        greedy.queue = Q::from_candidates(candidates);
        greedy
    }

    /// Collapses until a target is reached or nothing is left to collapse.
    ///
    /// `progress` is told the triangles left, now and then, and may stop the loop. `check` verifies
    /// the mesh after every collapse.
    ///
    /// # Errors
    /// [`Error::Internal`] where `check` finds something wrong.
    pub fn run(
        &mut self,
        stop: Stop,
        check: bool,
        progress: &mut dyn FnMut(usize) -> ControlFlow<()>,
    ) -> Result<(StopReason, Option<Blocked>)> {
        self.max_error = stop.max_error;
        let mut changed = Vec::new();
        self.note_bytes();
        while self.triangles > stop.triangles {
            let Some(candidate) = self.queue.pop() else {
                return Ok(self.blocked());
            };
            if !self.is_fresh(&candidate) {
                continue;
            }
            let e = candidate.edge;
            let Some(Evaluation { position, .. }) = self.evaluate(e) else {
                continue;
            };
            match self.rejection(e, position) {
                Some(Rejection::Link) => self.tally.rejected_link += 1,
                Some(Rejection::Flip) => self.tally.rejected_flip += 1,
                Some(Rejection::Error) => self.tally.rejected_error += 1,
                None => {
                    let collapse = self.collapse(e, position);
                    if check {
                        self.mesh.check().map_err(|wrong| {
                            Error::Internal(format!("after {collapse:?}: {wrong}"))
                        })?;
                    }
                    self.cost
                        .after_collapse(self.mesh, self.geometry, &collapse, &mut changed);
                    self.reconsider(&changed);
                    if self.tally.collapses.is_multiple_of(1024)
                        && progress(self.triangles).is_break()
                    {
                        return Ok((StopReason::Cancelled, None));
                    }
                }
            }
        }
        Ok((StopReason::Target, None))
    }

    /// The triangles left, double-sided ones counted as two.
    pub fn triangles(&self) -> usize {
        self.triangles
    }

    /// What was counted so far.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// The largest estimated distance of a live vertex from the original, in the unit box.
    pub fn max_deviation(&self) -> f64 {
        let deviations = self.mesh.vertices().map(|v| self.deviation[v.index()]);
        f64::from(deviations.fold(0.0, f32::max))
    }

    fn is_locked(&self, v: VertexId) -> bool {
        self.locked.get(v.index()).copied().unwrap_or(false)
    }

    fn evaluate(&self, e: EdgeId) -> Option<Evaluation> {
        let held = self.mesh.edge_vertices(e).map(|v| self.is_locked(v));
        self.cost.evaluate(self.mesh, self.geometry, e, held)
    }

    fn candidate(&self, edge: EdgeId) -> Option<Candidate> {
        let cost = self.evaluate(edge)?.cost as f32;
        Some(Candidate {
            cost,
            edge,
            evaluated_at: self.tally.collapses as u32,
        })
    }

    /// Whether nothing around the edge has changed since it was evaluated.
    fn is_fresh(&self, candidate: &Candidate) -> bool {
        let e = candidate.edge;
        let unchanged = |v: VertexId| self.changed_at[v.index()] <= candidate.evaluated_at;
        self.mesh.is_live_face(e.face()) && self.mesh.edge_vertices(e).into_iter().all(unchanged)
    }

    fn rejection(&self, e: EdgeId, position: Vec3) -> Option<Rejection> {
        if !self.mesh.link_condition(e) {
            Some(Rejection::Link)
        } else if rules::turns_a_face(self.mesh, self.geometry, e, position) {
            Some(Rejection::Flip)
        } else if self
            .max_error
            .is_some_and(|limit| self.deviation_after(e, position) > limit)
        {
            Some(Rejection::Error)
        } else {
            None
        }
    }

    /// The deviation that the merged vertex would have: a memoryless cost forgets, so each vertex
    /// carries the sum of what its collapses moved away from the planes at hand.
    fn deviation_after(&self, e: EdgeId, position: Vec3) -> f64 {
        let [v, w] = self
            .mesh
            .edge_vertices(e)
            .map(|v| self.deviation[v.index()]);
        f64::from(v.max(w)) + rules::distance_from_star(self.mesh, self.geometry, e, position)
    }

    fn collapse(&mut self, e: EdgeId, position: Vec3) -> Collapse {
        let ends = self.mesh.edge_vertices(e);
        let star = self.mesh.edge_star(e);
        let apexes = star.iter().map(|&d| self.mesh.apex(d));
        let mut touched = ends.into_iter().chain(apexes);
        if touched.any(|v| self.mesh.is_non_manifold_vertex(v)) {
            self.tally.collapses_non_manifold += 1;
        }
        let deviation = self.deviation_after(e, position);
        let collapse = self.mesh.collapse(e);
        self.geometry.set_position(collapse.kept, position);
        if self.is_locked(collapse.removed) {
            self.locked[collapse.kept.index()] = true;
        }
        self.deviation[collapse.kept.index()] = deviation as f32;
        let sides = |f: &FaceId| {
            if self.double_sided.get(f.index()) == Some(&true) {
                2
            } else {
                1
            }
        };
        self.triangles -= collapse.dead_faces.iter().map(sides).sum::<usize>();
        self.tally.collapses += 1;
        collapse
    }

    /// Evaluates every edge at the changed vertices, each once.
    fn reconsider(&mut self, changed: &[VertexId]) {
        let now = self.tally.collapses as u32;
        for &v in changed {
            self.changed_at[v.index()] = now;
        }
        let mut edges = std::mem::take(&mut self.edges);
        edges.clear();
        for &v in changed {
            for start in self.mesh.fans(v) {
                let mut end = start;
                for e in self.mesh.fan(start) {
                    edges.extend(self.name_at(v, self.mesh.head(e), e, now));
                    end = self.mesh.prev(e);
                }
                if self.mesh.mate(start).is_none() {
                    edges.extend(self.name_at(v, self.mesh.tail(end), end, now));
                }
            }
        }
        for &e in &edges {
            if let Some(candidate) = self.candidate(e) {
                self.queue.push(candidate);
            }
        }
        self.edges = edges;
        // Stale candidates stay in the queue until they outnumber the fresh ones.
        if self.queue.len() > 3 * self.mesh.face_count() + 1024 {
            self.note_bytes();
            let mut queue = std::mem::replace(&mut self.queue, Q::from_candidates(Vec::new()));
            queue.retain(|candidate| self.is_fresh(candidate));
            self.queue = queue;
        }
    }

    /// The name of the edge from the changed vertex `v` to `other`, unless it is `other`'s turn (both
    /// changed) or another directed edge's (several at `v`).
    fn name_at(&self, v: VertexId, other: VertexId, e: EdgeId, now: u32) -> Option<EdgeId> {
        let is_others_turn = self.changed_at[other.index()] == now && other < v;
        let name = self.mesh.canonical(e);
        let is_once = name == e || self.mesh.mate(e).is_some();
        (!is_others_turn && is_once).then_some(name)
    }

    /// Why nothing is left to collapse: the reason of every edge that is left.
    fn blocked(&self) -> (StopReason, Option<Blocked>) {
        let mut blocked = Blocked {
            lock: self.locked_edges(),
            ..Blocked::default()
        };
        for e in self.mesh.edges() {
            let Some(Evaluation { position, .. }) = self.evaluate(e) else {
                continue;
            };
            match self.rejection(e, position) {
                Some(Rejection::Link) => blocked.link += 1,
                Some(Rejection::Flip) => blocked.flip += 1,
                Some(Rejection::Error) => blocked.error += 1,
                None => debug_assert!(false, "{e:?} was left although it could be collapsed"),
            }
        }
        let reason = if blocked.error > 0 {
            StopReason::MaxError
        } else {
            StopReason::Blocked
        };
        (reason, Some(blocked))
    }

    fn locked_edges(&self) -> usize {
        if self.locked.is_empty() {
            return 0;
        }
        let both = |&e: &EdgeId| {
            self.mesh
                .edge_vertices(e)
                .into_iter()
                .all(|v| self.is_locked(v))
        };
        self.mesh.edges().filter(both).count()
    }

    /// Notes the bytes held now, where they are the most so far.
    fn note_bytes(&mut self) {
        let bytes = self.queue.bytes()
            + self.cost.bytes()
            + self.deviation.capacity() * size_of::<f32>()
            + self.changed_at.capacity() * size_of::<u32>();
        self.tally.working_bytes = self.tally.working_bytes.max(bytes);
    }
}
