//! The one loop: the cheapest edge, again and again, until a target is reached.

use glam::Vec3;
use rayon::prelude::*;

use super::cost::{Cost, Evaluation, LANES};
use super::options::Topology;
use super::queue::{Age, Candidate, Queue};
use super::report::{Blocked, StopReason, Tally};
use super::surface::{Loss, Merged, Plan, Surface, Way};
use crate::error::{Error, Result};
use crate::mesh::{Disks, EdgeId, EdgeStore, FaceId, Mesh, Opposite, VertexId};
use crate::progress::{self, COLLAPSE, Meter};

/// When the loop stops.
#[derive(Clone, Copy, Debug)]
pub struct Stop {
    /// At this many triangles, double-sided ones counted as two, or just below.
    pub triangles: usize,
    /// Before an estimated error above this, in the unit box.
    pub max_error: Option<f64>,
    /// Before a cost above this.
    pub max_cost: f32,
}

/// Why the loop came to a halt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Halt {
    /// The number of triangles is reached.
    Target,
    /// What is left costs this or more.
    Cost(f32),
    /// No candidate is left.
    Empty,
}

/// What it takes to evaluate a face's edges, in units of work.
pub const EVALUATION: usize = 6;

/// The faces whose edges are evaluated at a time, in parallel; fewer are left to one thread.
const BLOCK_FACES: usize = 1 << 16;

/// The faces whose edges are worth a thread.
const PART_FACES: usize = 1 << 10;

/// A candidate that costs this many times what it did waits for its new turn. 1 to 1.15 differ by
/// chance alone.
const RISE: f32 = 1.05;

/// Why a candidate cannot be collapsed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rejection {
    Link,
    Flip,
    Error,
}

/// A part of the surface that hangs together with nothing else.
struct Component {
    /// What it costs to remove it.
    loss: Loss,
    /// The slots of its faces, and maybe some that were used again elsewhere.
    faces: Vec<FaceId>,
}

/// The components of a surface that may be removed.
#[derive(Default)]
struct Components {
    /// The cheapest last, and the dearest, which stays, left out.
    removable: Vec<Component>,
    /// Where among them the component of each face stands; [`STAYS`] for the dearest.
    of_face: Vec<u32>,
}

/// No component.
const STAYS: u32 = u32::MAX;

impl Components {
    fn of<S: EdgeStore>(surface: &Surface<S>) -> Self {
        let components = surface.mesh.components().into_iter();
        let mut removable: Vec<Component> = components
            .map(|faces| Component {
                loss: surface.loss(&faces),
                faces,
            })
            .collect();
        removable.sort_by(|a, b| {
            let by_price = b.loss.price.total_cmp(&a.loss.price);
            by_price.then(a.faces[0].cmp(&b.faces[0]))
        });
        if !removable.is_empty() {
            removable.remove(0);
        }
        let mut of_face = vec![STAYS; surface.mesh.face_slots()];
        for (i, component) in removable.iter().enumerate() {
            for f in &component.faces {
                of_face[f.index()] = i as u32;
            }
        }
        Self { removable, of_face }
    }

    /// The slot of `face` is used again, in the component of `beside`.
    fn move_face(&mut self, face: FaceId, beside: FaceId) {
        let Some(&component) = self.of_face.get(beside.index()) else {
            return;
        };
        self.of_face[face.index()] = component;
        if let Some(component) = self.removable.get_mut(component as usize) {
            component.faces.push(face);
        }
    }

    /// Takes out the cheapest, with its faces as they are now.
    fn pop<S: EdgeStore>(&mut self, mesh: &Mesh<S>) -> Option<Component> {
        let mut component = self.removable.pop()?;
        let number = self.removable.len() as u32;
        let is_here = |f: &FaceId| self.of_face[f.index()] == number && mesh.is_live_face(*f);
        component.faces.retain(is_here);
        component.faces.sort_unstable();
        component.faces.dedup();
        Some(component)
    }
}

/// A surface being decimated under one cost.
pub struct Greedy<S, C, Q> {
    surface: Surface<S>,
    cost: C,
    queue: Q,
    /// The number of collapses before each vertex's surroundings last changed.
    changed_at: Vec<u32>,
    /// The vertices whose surroundings changed last; kept for its memory.
    changed: Vec<VertexId>,
    /// The edges to evaluate after a collapse; kept for its memory.
    edges: Vec<EdgeId>,
    /// The edges that were popped and are to be evaluated.
    pending: Vec<EdgeId>,
    /// What they cost, as it was.
    pending_cost: f32,
    triangles: usize,
    stop: Stop,
    topology: Topology,
    /// What may be removed; nothing where the topology stays.
    components: Components,
    /// Dead slots, to be used again where a pinch needs some.
    free_faces: Vec<FaceId>,
    free_vertices: Vec<VertexId>,
    /// Boundary edges at gaps that could have been closed, had there been a dead face.
    waiting: Vec<EdgeId>,
    tally: Tally,
}

impl<S: EdgeStore, C: Cost<S>, Q: Queue> Greedy<S, C, Q> {
    /// Evaluates every edge, in parallel. Counting goes on from `tally`. Told to a meter:
    /// [`EVALUATION`] units a face slot.
    pub fn new(
        surface: Surface<S>,
        cost: C,
        topology: Topology,
        tally: Tally,
        meter: &mut Meter,
    ) -> progress::Result<Self> {
        let mut greedy = Self {
            cost,
            queue: Q::for_edges(3 * surface.mesh.face_slots()),
            changed_at: vec![0; surface.mesh.vertex_slots()],
            changed: Vec::new(),
            edges: Vec::new(),
            pending: Vec::with_capacity(LANES),
            pending_cost: 0.0,
            triangles: surface.triangles(),
            stop: Stop {
                triangles: 0,
                max_error: None,
                max_cost: f32::INFINITY,
            },
            topology,
            components: match topology {
                Topology::Preserve => Components::default(),
                Topology::Simplify => Components::of(&surface),
            },
            surface,
            free_faces: Vec::new(),
            free_vertices: Vec::new(),
            waiting: Vec::new(),
            tally,
        };
        greedy.tally.rejected_lock += greedy.locked_edges();
        greedy.queue_all(false, meter)?;
        Ok(greedy)
    }

    /// Queues every edge, or only those that can be collapsed now; evaluated in parallel where they are
    /// many. Whether there is one.
    fn queue_all(&mut self, only_possible: bool, meter: &mut Meter) -> progress::Result<bool> {
        let slots = self.surface.mesh.face_slots();
        let evaluate = |greedy: &Self, first: usize, found: &mut Vec<Candidate>| {
            let (surface, mesh) = (&greedy.surface, &greedy.surface.mesh);
            // Half of the edges have another name, at random: no branch would foresee which.
            let mut names = vec![EdgeId::new(0); 3 * PART_FACES + 1];
            let mut count = 0;
            for f in (first..slots.min(first + PART_FACES)).map(FaceId::new) {
                if mesh.is_live_face(f) {
                    for e in f.edges() {
                        names[count] = e;
                        count += usize::from(mesh.is_canonical(e));
                    }
                }
            }
            names.truncate(count);
            let (cost, may_fill) = (&greedy.cost, greedy.may_simplify());
            evaluate_all(surface, cost, may_fill, names.into_iter(), |candidate| {
                found.push(candidate);
            });
            if only_possible {
                found.retain(|c| greedy.is_possible(c.edge));
            }
        };
        let mut is_any = false;
        let mut queue = |queue: &mut Q, found: &mut Vec<Candidate>| {
            is_any |= !found.is_empty();
            let found = found.drain(..);
            found.for_each(|candidate| queue.push(candidate, Age::UpToDate));
        };
        if slots <= BLOCK_FACES {
            let mut found = Vec::with_capacity(2 * PART_FACES);
            for first in (0..slots).step_by(PART_FACES) {
                evaluate(self, first, &mut found);
                queue(&mut self.queue, &mut found);
                meter.work(EVALUATION * PART_FACES)?;
            }
            return Ok(is_any);
        }
        // In blocks, so that no second copy of all candidates is held.
        for first in (0..slots).step_by(BLOCK_FACES) {
            let last = slots.min(first + BLOCK_FACES);
            let greedy = &*self;
            let parts = (first..last).into_par_iter().step_by(PART_FACES);
            let parts = parts.map(|first| {
                let mut found = Vec::with_capacity(2 * PART_FACES);
                evaluate(greedy, first, &mut found);
                found
            });
            let parts: Vec<Vec<Candidate>> = parts.collect();
            for mut part in parts {
                queue(&mut self.queue, &mut part);
            }
            meter.work(EVALUATION * (last - first))?;
        }
        Ok(is_any)
    }

    /// Collapses until a target is reached or nothing is left to collapse.
    ///
    /// Told to a meter: [`COLLAPSE`] units a triangle that goes. `check` verifies the mesh after every
    /// collapse.
    ///
    /// # Errors
    /// [`Error::Internal`] where `check` finds something wrong, [`Error::Cancelled`].
    pub fn run(
        &mut self,
        stop: Stop,
        check: bool,
        meter: &mut Meter,
    ) -> Result<(StopReason, Option<Blocked>)> {
        loop {
            match self.advance(stop, check, meter)? {
                Halt::Target => return Ok((StopReason::Target, None)),
                Halt::Empty | Halt::Cost(_) => {}
            }
            if !self.revive(meter)? {
                if self.components.removable.is_empty() {
                    return Ok(self.blocked(meter)?);
                }
                self.remove_component();
            }
        }
    }

    /// Collapses until a target is reached or no candidate is left.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    pub fn advance(&mut self, stop: Stop, check: bool, meter: &mut Meter) -> Result<Halt> {
        self.stop = stop;
        let exact_below = self.cost.exact_below();
        let halt = loop {
            if self.triangles <= stop.triangles {
                break Halt::Target;
            }
            let candidate = match self.next() {
                Ok(candidate) => candidate,
                Err(halt) => break halt,
            };
            meter.detour(COLLAPSE)?;
            let e = candidate.edge;
            if self
                .components
                .removable
                .last()
                .is_some_and(|c| c.loss.price < candidate.cost)
            {
                self.queue.push(candidate, Age::UpToDate);
                self.remove_component();
                continue;
            }
            if self.fill(&candidate) {
                continue;
            }
            let Some(Evaluation { cost, position }) = self.evaluate(e) else {
                continue;
            };
            if cost as f32 > candidate.cost * RISE {
                self.queue_at(e, cost);
                continue;
            }
            let disks = self.surface.mesh.disks(e);
            match self.way(e, disks.as_ref(), position) {
                Err(Rejection::Link) => {
                    self.tally.rejected_link += 1;
                    self.pinch(&candidate);
                }
                Err(Rejection::Flip) => self.tally.rejected_flip += 1,
                Err(Rejection::Error) => self.tally.rejected_error += 1,
                Ok(Plan {
                    way: Way::Contract(_, loss),
                    ..
                }) if loss.price > candidate.cost => {
                    self.queue_at(e, loss.price.into());
                }
                Ok(plan) => {
                    let merged = self.collapse(e, position, &plan);
                    if check {
                        self.surface.check().map_err(|wrong| {
                            Error::Internal(format!("after {:?}: {wrong}", merged.collapse))
                        })?;
                        meter.detour(4 * self.surface.mesh.face_slots())?;
                    }
                    self.cost
                        .after_collapse(&self.surface, &merged, &mut self.changed);
                    let faces = self.surface.mesh.face_count();
                    let faces_before = faces + merged.collapse.dead_faces.len();
                    if faces < exact_below && faces_before >= exact_below {
                        self.queue_all(false, meter)?;
                    } else {
                        if C::IS_LAZY {
                            self.complete(&merged, &plan.way, candidate.cost);
                        }
                        self.reconsider();
                    }
                    meter.work(COLLAPSE * merged.collapse.dead_faces.len())?;
                }
            }
        };
        self.note_bytes();
        Ok(halt)
    }

    /// The next candidate whose edge is alive and goes by no other name; of lazy costs, one that
    /// costs as much as it is said to.
    #[inline]
    fn next(&mut self) -> std::result::Result<Candidate, Halt> {
        loop {
            let popped = self.queue.pop();
            // What waits for its evaluation comes before what costs more than it did.
            let limit = if self.pending.is_empty() {
                self.stop.max_cost
            } else {
                self.pending_cost
            };
            let (candidate, age) = match popped {
                Some((candidate, age)) if candidate.cost <= limit => (candidate, age),
                _ => {
                    if let Some((candidate, age)) = popped {
                        self.queue.push(candidate, age);
                    }
                    if self.pending.is_empty() {
                        return Err(popped.map_or(Halt::Empty, |(c, _)| Halt::Cost(c.cost)));
                    }
                    self.evaluate_pending();
                    continue;
                }
            };
            let e = candidate.edge;
            debug_assert!(self.surface.mesh.is_live_face(e.face()), "{e:?} is dead");
            if !C::IS_LAZY && self.goes_by_another_name(e) {
                continue;
            }
            if age == Age::UpToDate {
                return Ok(candidate);
            }
            self.pending.push(e);
            self.pending_cost = candidate.cost;
            if self.pending.len() == LANES {
                self.evaluate_pending();
            }
        }
    }

    /// Evaluates the edges that were popped, and queues them at what they cost now.
    #[inline]
    fn evaluate_pending(&mut self) {
        let may_fill = self.may_simplify();
        let (surface, queue) = (&self.surface, &mut self.queue);
        // Some may have gone since.
        let pending = self.pending.drain(..);
        let live = pending.filter(|e| surface.mesh.is_live_face(e.face()));
        evaluate_all(surface, &self.cost, may_fill, live, |candidate| {
            queue.push(candidate, Age::UpToDate);
        });
    }

    /// Outdates the candidates of the edges at a merged vertex, and queues those that have none, at the
    /// cost of now, which is a lower bound. At a busy one that stayed only of the edges that it gained:
    /// what the others cost more now they say when they are popped.
    #[inline]
    fn complete(&mut self, merged: &Merged, way: &Way, cost: f32) {
        let mut edges = std::mem::take(&mut self.edges);
        let (mesh, queue) = (&self.surface.mesh, &mut self.queue);
        // Edges that became one go by one name from now on; all others keep theirs.
        for &e in &merged.collapse.merged_edges {
            if let Opposite::Edge(o) = mesh.opposite(e) {
                let (name, other) = (e.min(o), e.max(o));
                if queue.contains(name) {
                    queue.remove(other);
                } else {
                    queue.rename(other, name);
                }
            }
        }
        let mut outdate = |e| {
            let name = mesh.canonical(e);
            if !queue.outdate(name) {
                edges.push(name);
            }
        };
        if let Some(gained) = &merged.gained {
            gained.iter().copied().for_each(outdate);
        } else if let Way::Collapse(Some(disks)) = way {
            disks.spokes().into_iter().for_each(outdate);
        } else {
            for start in mesh.fans(merged.collapse.kept) {
                let mut end = None;
                for e in mesh.fan(start) {
                    outdate(e);
                    end = Some(mesh.prev(e));
                }
                let end = end.filter(|&end| mesh.mate(end).is_none());
                end.into_iter().for_each(&mut outdate);
            }
        }
        for edge in edges.drain(..) {
            if self.surface.held(edge) != [true; 2] {
                self.queue.push(Candidate { cost, edge }, Age::OutOfDate);
            }
        }
        self.edges = edges;
    }

    /// What was counted so far.
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// The surface as it is now.
    pub fn surface(&self) -> &Surface<S> {
        &self.surface
    }

    /// The triangles left, double-sided ones counted as two.
    pub fn triangles(&self) -> usize {
        self.triangles
    }

    /// The surface, what its cost model knows, and what was counted.
    pub fn into_parts(self) -> (Surface<S>, C, Tally) {
        (self.surface, self.cost, self.tally)
    }

    #[inline]
    fn evaluate(&self, e: EdgeId) -> Option<Evaluation> {
        self.cost.evaluate(&self.surface, e, self.surface.held(e))
    }

    /// Queues edges at what they cost.
    #[inline]
    fn queue_now(&mut self, edges: impl Iterator<Item = EdgeId>) {
        let may_fill = self.may_simplify();
        let queue = &mut self.queue;
        evaluate_all(&self.surface, &self.cost, may_fill, edges, |candidate| {
            queue.push(candidate, Age::UpToDate);
        });
    }

    /// Whether the topology may change here: not where creases are to be kept.
    fn may_simplify(&self) -> bool {
        self.topology == Topology::Simplify && !self.surface.curves.are_kept()
    }

    /// Whether the largest error leaves room for a loss.
    fn is_within_error(&self, loss: Loss) -> bool {
        self.stop.max_error.is_none_or(|limit| loss.reach <= limit)
    }

    /// What closing the gap at the head of a boundary edge costs, where the topology may change.
    fn fill_price(&self, e: EdgeId) -> Option<f64> {
        if self.may_simplify() {
            self.surface.fill_price(e)
        } else {
            None
        }
    }

    fn queue_at(&mut self, edge: EdgeId, cost: f64) {
        let cost = cost as f32;
        self.queue.push(Candidate { cost, edge }, Age::UpToDate);
    }

    /// Whether `e` is not the name of its edge, and the edge has a candidate by its name: its costs
    /// are followed there.
    #[inline]
    fn goes_by_another_name(&self, e: EdgeId) -> bool {
        let name = self.surface.mesh.canonical(e);
        name != e && self.queue.contains(name)
    }

    /// How `e` can be collapsed to `position`, with what the mesh says of its
    /// [disks](crate::mesh::Mesh::disks), or why it cannot.
    #[inline]
    fn way<'a>(
        &self,
        e: EdgeId,
        disks: Option<&'a Disks>,
        position: Vec3,
    ) -> std::result::Result<Plan<'a>, Rejection> {
        let mesh = &self.surface.mesh;
        let keeps_topology = match disks {
            Some(disks) => disks.link_condition(),
            None => mesh.link_condition(e),
        };
        let way = if keeps_topology && self.surface.curves.stay_apart(mesh, e) {
            Way::Collapse(disks)
        } else {
            self.contraction(e).ok_or(Rejection::Link)?
        };
        let deviation = self
            .surface
            .deviation_after(e, &way, position)
            .ok_or(Rejection::Flip)?;
        if self
            .stop
            .max_error
            .is_some_and(|limit| f64::from(deviation) > limit)
        {
            return Err(Rejection::Error);
        }
        let carried = self.cost.carried(&self.surface, e, position);
        if self.surface.wedges.keeps_charts(mesh, e, &carried) {
            Ok(Plan {
                way,
                deviation,
                carried,
            })
        } else {
            Err(Rejection::Flip)
        }
    }

    /// The contraction of `e`, where the topology may change; none that would leave nothing.
    fn contraction(&self, e: EdgeId) -> Option<Way<'static>> {
        if !self.may_simplify() {
            return None;
        }
        let contraction = self.surface.mesh.contraction(e)?;
        let dead = contraction.dead_faces().iter();
        let dead: usize = dead.map(|&f| self.surface.sides(f)).sum();
        let loss = self.surface.loss(contraction.vanishing_faces());
        let may = dead < self.triangles && self.is_within_error(loss);
        may.then_some(Way::Contract(contraction, loss))
    }

    /// Removes the cheapest component, unless that would overshoot the target or the error.
    fn remove_component(&mut self) {
        let Some(component) = self.components.pop(&self.surface.mesh) else {
            return;
        };
        let faces = component.faces;
        let triangles: usize = faces.iter().map(|&f| self.surface.sides(f)).sum();
        let has_locked = |f: &FaceId| {
            let vertices = self.surface.mesh.face_vertices(*f);
            vertices.into_iter().any(|v| self.surface.is_locked(v))
        };
        let is_allowed = !faces.is_empty()
            && triangles < self.triangles
            && self.triangles + 1 >= self.stop.triangles + triangles
            && self.is_within_error(component.loss)
            && !faces.iter().any(has_locked);
        if is_allowed {
            self.surface.mesh.remove_component(&faces);
            for e in faces.iter().flat_map(|f| f.edges()) {
                self.queue.remove(e);
            }
            self.surface.lost = self.surface.lost.max(component.loss.reach);
            self.triangles -= triangles;
            self.tally.removed_components += 1;
        }
    }

    /// Closes the gap at the head of a boundary edge by one face, where that costs no more than the
    /// candidate. Whether it did.
    fn fill(&mut self, candidate: &Candidate) -> bool {
        let e = candidate.edge;
        let price = self.fill_price(e).map(|price| price as f32);
        if price.is_none_or(|price| price > candidate.cost) {
            return false;
        }
        let Some(&face) = self.free_faces.last() else {
            self.waiting.push(e);
            return false;
        };
        let around = self.surface.fill(e, face);
        self.components.move_face(face, e.face());
        self.free_faces.pop();
        self.triangles += 1;
        self.tally.filled_faces += 1;
        self.cost
            .after_change(&self.surface, around.map(|v| [v, v]), &mut self.changed);
        self.reconsider();
        true
    }

    /// Where a handle stands in the way of a candidate, pinches it off if that costs no more than the
    /// candidate does; else the candidate waits until its turn comes at that price.
    fn pinch(&mut self, candidate: &Candidate) {
        let ([.., a, b], [.., x, y, z]) = (&self.free_faces[..], &self.free_vertices[..]) else {
            return;
        };
        if !self.may_simplify() || !self.cost.moves_vertices() {
            return;
        }
        let mesh = &self.surface.mesh;
        let is_free =
            |edges: &&[EdgeId; 3]| !edges.iter().any(|&e| self.surface.is_locked(mesh.tail(e)));
        let loops = mesh.open_loops(candidate.edge);
        let losses = loops.iter().filter(is_free);
        let Some((loss, &edges)) = losses
            .map(|edges| (self.surface.pinch_loss(edges), edges))
            .min_by(|a, b| a.0.price.total_cmp(&b.0.price))
        else {
            return;
        };
        if !self.is_within_error(loss) {
            return;
        }
        if loss.price > candidate.cost {
            self.queue_at(candidate.edge, loss.price.into());
            return;
        }
        if !mesh.is_around_handle(&edges) {
            return;
        }
        let [u, v, w] = edges.map(|e| mesh.tail(e));
        let (caps, vertices) = ([*a, *b], [*x, *y, *z]);
        if self.surface.pinch(&edges, caps, vertices).is_none() {
            return;
        }
        for cap in caps {
            self.components.move_face(cap, edges[0].face());
        }
        self.free_faces.truncate(self.free_faces.len() - 2);
        self.free_vertices.truncate(self.free_vertices.len() - 3);
        self.surface.lost = self.surface.lost.max(loss.reach);
        self.triangles += 2;
        self.tally.pinched_handles += 1;
        let [x, y, z] = vertices;
        let cut = [[u, x], [v, y], [w, z]];
        self.cost
            .after_change(&self.surface, cut, &mut self.changed);
        self.reconsider();
    }

    fn collapse(&mut self, e: EdgeId, position: Vec3, plan: &Plan) -> Merged {
        let mesh = &self.surface.mesh;
        if mesh.non_manifold_edge_count() + mesh.multi_fan_vertex_count() > 0 {
            let ends = mesh.edge_vertices(e);
            let apexes = mesh.edge_star(e).into_iter().map(|d| mesh.apex(d));
            let mut touched = ends.into_iter().chain(apexes);
            if touched.any(|v| mesh.is_non_manifold_vertex(v)) {
                self.tally.collapses_non_manifold += 1;
            }
        }
        if let Way::Contract(_, loss) = &plan.way {
            self.tally.contractions += 1;
            self.surface.lost = self.surface.lost.max(loss.reach);
        }
        let merged = self.surface.collapse(e, position, plan);
        if self.topology == Topology::Simplify {
            self.free_faces.extend(&merged.collapse.dead_faces);
            self.free_vertices.push(merged.collapse.removed);
            for e in std::mem::take(&mut self.waiting) {
                if self.surface.mesh.is_live_face(e.face()) {
                    let name = self.surface.mesh.canonical(e);
                    self.queue_now(std::iter::once(name));
                }
            }
        }
        for &dead in &merged.collapse.dead_faces {
            self.triangles -= self.surface.sides(dead);
            dead.edges().into_iter().for_each(|e| self.queue.remove(e));
        }
        self.tally.collapses += 1;
        merged
    }

    /// Evaluates the edges at the changed vertices, each once.
    fn reconsider(&mut self) {
        if self.changed.is_empty() {
            return;
        }
        let mut edges = std::mem::take(&mut self.edges);
        edges.clear();
        let now = self.tally.collapses as u32;
        for &v in &self.changed {
            self.changed_at[v.index()] = now;
        }
        let mesh = &self.surface.mesh;
        for &v in &self.changed {
            for start in mesh.fans(v) {
                let mut end = None;
                for e in mesh.fan(start) {
                    edges.extend(self.name_at(v, mesh.head(e), e, now));
                    end = Some(mesh.prev(e)).filter(|&before| mesh.mate(before).is_none());
                }
                if let Some(end) = end {
                    edges.extend(self.name_at(v, mesh.tail(end), end, now));
                }
            }
        }
        self.queue_now(edges.drain(..));
        self.edges = edges;
    }

    /// The name of the edge from the changed vertex `v` to `other`, unless it is `other`'s turn (both
    /// changed) or another directed edge's (several at `v`).
    fn name_at(&self, v: VertexId, other: VertexId, e: EdgeId, now: u32) -> Option<EdgeId> {
        let is_others_turn = self.changed_at[other.index()] == now && other < v;
        let name = self.surface.mesh.canonical(e);
        let is_once = name == e || self.surface.mesh.mate(e).is_some();
        (!is_others_turn && is_once).then_some(name)
    }

    /// Puts what can be collapsed after all back into the queue: what was refused once and has not
    /// been evaluated since, because no cost around it changed. Whether there is anything.
    fn revive(&mut self, meter: &mut Meter) -> progress::Result<bool> {
        self.queue_all(true, meter)
    }

    /// Whether an edge can be collapsed as things are.
    fn is_possible(&self, e: EdgeId) -> bool {
        let evaluation = self.evaluate(e);
        evaluation.is_some_and(|evaluation| self.way(e, None, evaluation.position).is_ok())
    }

    /// Why nothing is left to collapse: the reason of every edge that is left.
    fn blocked(&self, meter: &mut Meter) -> progress::Result<(StopReason, Option<Blocked>)> {
        let mut blocked = Blocked {
            lock: self.locked_edges(),
            ..Blocked::default()
        };
        for e in self.surface.mesh.edges() {
            meter.detour(EVALUATION)?;
            let Some(Evaluation { position, .. }) = self.evaluate(e) else {
                continue;
            };
            match self.way(e, None, position) {
                Err(Rejection::Link) => blocked.link += 1,
                Err(Rejection::Flip) => blocked.flip += 1,
                Err(Rejection::Error) => blocked.error += 1,
                Ok(_) => debug_assert!(false, "{e:?} was left although it could be collapsed"),
            }
        }
        let reason = if blocked.error > 0 {
            StopReason::MaxError
        } else {
            StopReason::Blocked
        };
        Ok((reason, Some(blocked)))
    }

    /// The edges that no collapse is asked of, since both ends are held.
    fn locked_edges(&self) -> usize {
        let nothing_is = self.surface.locked.is_empty() && !self.surface.curves.are_kept();
        if nothing_is || !self.surface.seam.is_empty() {
            return 0;
        }
        let is_held = |&e: &EdgeId| self.surface.held(e) == [true; 2];
        self.surface.mesh.edges().filter(is_held).count()
    }

    /// Notes the bytes held now, where they are the most so far.
    fn note_bytes(&mut self) {
        let bytes = self.queue.bytes()
            + self.cost.bytes()
            + self.surface.carried_bytes()
            + self.changed_at.capacity() * size_of::<u32>();
        self.tally.working_bytes = self.tally.working_bytes.max(bytes);
    }
}

/// Gives the candidates of edges, in any order. Where gaps may be filled, an edge costs no more than that.
#[inline]
fn evaluate_all<S: EdgeStore, C: Cost<S>>(
    surface: &Surface<S>,
    cost: &C,
    may_fill: bool,
    edges: impl Iterator<Item = EdgeId>,
    mut give: impl FnMut(Candidate),
) {
    let mut give = |edge: EdgeId, cost: f32| {
        let price = may_fill.then(|| surface.fill_price(edge)).flatten();
        let cost = price.map_or(cost, |price| (price as f32).min(cost));
        if cost.is_finite() {
            give(Candidate { cost, edge });
        }
    };
    let mut batch = [EdgeId::new(0); LANES];
    let mut count = 0;
    for e in edges {
        match surface.held(e) {
            [false, false] => {
                batch[count] = e;
                count += 1;
            }
            [true, true] => give(e, f32::NAN),
            held => {
                let evaluation = cost.evaluate(surface, e, held);
                let cost = evaluation.map_or(f32::NAN, |evaluation| evaluation.cost as f32);
                give(e, cost);
            }
        }
        if count == LANES {
            let costs = cost.costs(surface, &batch);
            (0..LANES).for_each(|i| give(batch[i], costs[i]));
            count = 0;
        }
    }
    if count > 0 {
        let first = batch[0];
        batch[count..].fill(first);
        let costs = cost.costs(surface, &batch);
        (0..count).for_each(|i| give(batch[i], costs[i]));
    }
}
