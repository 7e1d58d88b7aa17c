//! Chunks: pieces of the surface that fit in the cache, decimated one by one under one threshold.
//!
//! Each chunk is a small mesh of its own, on which the same loop runs as on a whole one. Vertices
//! with faces in several chunks are the seam: no edge at them collapses. What a collapse may cost is
//! the same in all chunks, so that triangles stay where the surface needs them; a pilot finds it:
//! some of the chunks, spread over the mesh, go up in cost together until their inner vertices are
//! as few as they should be. A second round, with chunks cut elsewhere, thins out the seams under
//! the same threshold. What is left is for the loop over the whole mesh, to the exact target.
//!
//! The cut depends on the mesh alone and the chunks do not know each other, so the result does not
//! depend on the number of threads.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::cost::Cost;
use super::cut::Cut;
use super::flat::{FaceFlags, Flat};
use super::geometry::Room;
use super::greedy::{EVALUATION, Greedy, Halt, Stop};
use super::options::{Chunks, Options, Topology};
use super::queue::Buckets;
use super::report::Tally;
use super::surface::Surface;
use super::wedges::FlatWedges;
use crate::clean::{rename, renumbered, retain};
use crate::error::Result;
use crate::mesh::{EdgeStore, FaceId, Mesh, Outgoing, VertexId, build};
use crate::progress::{self, COLLAPSE, Meter, unheard};

/// Below so many faces the whole mesh is as quick.
const WORTHWHILE_FACES: usize = 50_000;

/// The vertices of a chunk, at least and at most. A chunk's mesh and all that goes with it then take
/// half a megabyte to one, which is what the second cache of a processor holds.
const CHUNK_VERTICES: Range<usize> = 4096..8192;

/// Where chunks are asked for, the mesh has so many times as many faces at least.
const SEVERAL: usize = 4;

/// Where more than this share of the faces in the pilot's chunks meet a neighbour that runs the other
/// way round, the whole is oriented first.
const DISORIENTED: f64 = 0.005;

/// Chunks leave this share of what is to go to the loop over the whole mesh, which needs room to
/// choose; but no more than exceeds the target by the second share.
const LEFT_OVER: f64 = 0.05;
const MOST_ABOVE_TARGET: f64 = 0.25;

/// A pair of rounds leaves at least this share of the faces, or the seams would be too dense
/// between what is left inside.
const LEAST_DENSITY: f64 = 0.08;

/// Where chunks would leave more than this share, they are not worth the partition.
const WORTHWHILE: f64 = 0.9;

/// The pilot: this share of the chunks, and at least so many.
const PILOT_SHARE: f64 = 0.12;
const PILOT_CHUNKS: usize = 16;

/// A seam disturbs what is within so many edges of it, as long as they are in the end: vertices next
/// to it stay, and so others go. Counted in, they would drive the threshold up: 12 to 17 % of rms at
/// 70 000 to 100 000 triangles.
const DISTURBED: f64 = 1.5;

/// The triangles that a collapse removes, at most, but at a non-manifold edge: two, both double-sided.
const MOST_AT_ONCE: usize = 4;

/// The pilot's threshold rises by this factor at least: an eighth of an octave.
const FINEST_STEP: f64 = 1.09;
/// And by this one at most.
const COARSEST_STEP: f64 = 4.0;

/// Once less than this share is left, a threshold that rises this many times over and leaves more than
/// this share of that is as high as it should be: the rest cannot collapse.
const BEGUN: f64 = 0.9;
const HOPELESS: f32 = 32.0;
const STUCK: f64 = 0.97;

/// The chunks whose results wait to be counted, at most, and of which each thread takes so many: a
/// word about them comes every 100 000 triangles a thread.
const BATCH: usize = 64;
const BATCH_OF_THREAD: usize = 8;

/// The work that a chunk takes beside its collapses, in units a face: it is gathered, built and
/// evaluated.
const BEGINNING: usize = 2 + build::UNITS + EVALUATION;
/// And what a round takes for all: the cut, and putting together what is left.
const ROUND: usize = 5;

/// All rounds see about so many times the faces that there are at first.
const ROUNDS: f64 = 1.3;

/// The second round's grid lies this share of the box elsewhere.
const SHIFT: f32 = 0.29;

/// How a mesh is decimated in chunks.
pub struct Sizes {
    /// The share of the faces that chunks leave.
    density: f64,
    /// The vertices of a chunk, at least and at most.
    vertices: Range<usize>,
}

/// The triangles that chunks leave of so many on the way to a target.
pub fn left_by_chunks(triangles: usize, target: usize) -> f64 {
    let collapsed = triangles.saturating_sub(target) as f64;
    let target = target as f64;
    target + (LEFT_OVER * collapsed).min(MOST_ABOVE_TARGET * target)
}

impl Sizes {
    /// The sizes for a mesh of so many faces, double-sided ones counted as two in `triangles`, of
    /// which chunks [leave](left_by_chunks) some; nothing where they are not worth it.
    pub fn of(chunks: Chunks, faces: usize, triangles: usize, left: f64) -> Option<Self> {
        let (least_faces, vertices) = match chunks {
            Chunks::Off => return None,
            Chunks::Auto => (WORTHWHILE_FACES, CHUNK_VERTICES),
            Chunks::Triangles(triangles) => {
                let most = (triangles / 2).max(2);
                (SEVERAL.saturating_mul(triangles), most / 2..most)
            }
        };
        let density = (left / triangles as f64).max(LEAST_DENSITY);
        let is_worthwhile = faces >= least_faces && density <= WORTHWHILE;
        is_worthwhile.then_some(Self { density, vertices })
    }

    /// The most bytes held beside the input's arrays while a mesh is decimated in these chunks: what
    /// sorting it takes, or the pilot's meshes and what is left of all chunks, twice while they are
    /// put together. `bytes` is what a triangle takes in decimation.
    pub fn bytes(&self, vertices: usize, triangles: usize, bytes: usize) -> usize {
        /// Of the vertices, those on seams in the first round, about.
        const ON_SEAM: f64 = 0.1;
        /// What is left, per triangle: itself, half a vertex and its state, and the same again.
        const LEFT_BYTES: f64 = 70.0;
        let sorting = 32 * vertices;
        let piloted = (PILOT_CHUNKS * 2 * self.vertices.end).min(triangles);
        let piloted = piloted.max((PILOT_SHARE * triangles as f64) as usize);
        let left = (self.density + ON_SEAM).min(1.0) * triangles as f64;
        let rounds = 8 * vertices + piloted * bytes + (left * LEFT_BYTES) as usize;
        sorting.max(rounds).max((left * bytes as f64) as usize)
    }
}

/// What decimation in chunks goes by.
pub struct Chunked<'a> {
    pub options: &'a Options,
    /// The target of the whole; `max_cost` is not looked at.
    pub stop: Stop,
    /// The room of the whole.
    pub room: Room,
}

/// What decimation in chunks did.
#[derive(Clone, Copy, Debug, Default)]
pub struct Done {
    pub tally: Tally,
    /// Chunks, over all rounds.
    pub chunks: usize,
    /// Rounds.
    pub rounds: usize,
    /// Non-manifold edges of the input.
    pub non_manifold_edges_in: usize,
    /// Whether nothing was done, since the faces do not agree with their neighbours.
    pub is_disoriented: bool,
}

impl Done {
    /// Notes the bytes held now, where they are the most so far.
    fn note_bytes(&mut self, bytes: usize) {
        self.tally.working_bytes = self.tally.working_bytes.max(bytes);
    }
}

impl Chunked<'_> {
    fn sizes<V>(&self, flat: &Flat<V>, left: f64) -> Option<Sizes> {
        let (faces, triangles) = (flat.triangles.len(), flat.triangle_count());
        Sizes::of(self.options.chunks, faces, triangles, left)
    }

    fn left<V>(&self, flat: &Flat<V>) -> f64 {
        left_by_chunks(flat.triangle_count(), self.stop.triangles)
    }

    /// Whether chunks are worth it.
    pub fn is_worthwhile<V>(&self, flat: &Flat<V>) -> bool {
        self.sizes(flat, self.left(flat)).is_some()
    }

    /// The work that [`reduce`](Self::reduce) takes, about, in units.
    pub fn work<V>(&self, flat: &Flat<V>) -> usize {
        let faces = flat.triangle_count() as f64;
        let seen = (ROUNDS * faces) as usize;
        (ROUND + BEGINNING) * seen + COLLAPSE * (faces - self.left(flat)) as usize
    }

    /// Decimates towards the target, not below it; as far as it is worth it.
    ///
    /// # Errors
    /// As [`Greedy::advance`].
    pub fn reduce<S: EdgeStore, C: Cost<S>>(
        &self,
        flat: &mut Flat<C::State>,
        meter: &mut Meter,
    ) -> Result<Done> {
        let mut done = Done::default();
        let left = self.left(flat);
        while let Some(Sizes { density, vertices }) = self.sizes(flat, left) {
            let faces = flat.triangle_count();
            let until = Until::Density(density);
            let max_cost = self.round::<S, C>(flat, until, &vertices, &mut done, meter)?;
            if done.is_disoriented {
                break;
            }
            self.round::<S, C>(flat, Until::Cost(max_cost), &vertices, &mut done, meter)?;
            if flat.triangle_count() as f64 > WORTHWHILE * faces as f64 {
                break;
            }
        }
        Ok(done)
    }

    /// Cuts, decimates every chunk, and puts the results together. The threshold.
    fn round<S: EdgeStore, C: Cost<S>>(
        &self,
        flat: &mut Flat<C::State>,
        until: Until,
        chunk_vertices: &Range<usize>,
        done: &mut Done,
        meter: &mut Meter,
    ) -> Result<f32> {
        let is_first = done.rounds == 0;
        let shift = if done.rounds.is_multiple_of(2) {
            0.0
        } else {
            SHIFT
        };
        let cut = Cut::new(flat, shift, chunk_vertices, meter)?;
        let mut triangles = flat.triangle_count();
        let mut outcomes: Vec<Option<Outcome<C::State>>> = Vec::new();
        outcomes.resize_with(cut.len(), || None);
        let (options, room, stop) = (self.options, self.room, self.stop);
        let begin = |chunk| Chunk::<S, C>::begin(options, room, flat, &cut, chunk, is_first);
        let at_a_time = (BATCH_OF_THREAD * rayon::current_num_threads()).min(BATCH);
        let max_cost = match until {
            Until::Cost(max_cost) => max_cost,
            Until::Density(density) => {
                let pilots = pilots(cut.len());
                let mut chunks: Vec<Chunk<S, C>> = Vec::with_capacity(pilots.len());
                for pilots in pilots.chunks(at_a_time) {
                    let first = chunks.len();
                    chunks.par_extend(pilots.par_iter().map(|&k| begin(k)));
                    let begun = chunks[first..].iter().map(|c| c.triangles_before);
                    meter.work(BEGINNING * begun.sum::<usize>())?;
                }
                let faces: usize = chunks.iter().map(|c| c.greedy.triangles()).sum();
                let conflicts: usize = chunks.iter().map(|c| c.singular.conflicts).sum();
                if conflicts as f64 > DISORIENTED * faces as f64 {
                    done.is_disoriented = true;
                    return Ok(0.0);
                }
                let budget = triangles.saturating_sub(self.stop.triangles);
                let max_cost = self.advance_together(&mut chunks, density, budget, meter)?;
                let piloted: usize = chunks.iter().map(Chunk::bytes).sum();
                done.note_bytes(piloted + cut.bytes());
                let ended: Vec<_> = chunks.into_par_iter().map(Chunk::end).collect();
                for (k, outcome) in pilots.into_iter().zip(ended) {
                    triangles -= outcome.removed_triangles;
                    outcomes[k] = Some(outcome);
                }
                max_cost
            }
        };
        done.rounds += 1;
        done.chunks += cut.len();
        let rest: Vec<usize> = (0..cut.len()).filter(|&k| outcomes[k].is_none()).collect();
        let mut rest = &rest[..];
        while !rest.is_empty() {
            // No batch may take the whole below the target, whatever it removes.
            let budget = triangles.saturating_sub(self.stop.triangles);
            let mut faces = 0;
            let fits = |k: &&usize| {
                faces += 2 * cut.faces(**k).map(|range| range.len()).sum::<usize>();
                faces <= budget
            };
            let batch = rest.iter().take(at_a_time).take_while(fits).count().max(1);
            let (now, later) = rest.split_at(batch);
            rest = later;
            let ended: Vec<Outcome<C::State>> = now
                .par_iter()
                .map(|&k| {
                    let mut chunk = begin(k);
                    let least = chunk.triangles_before.saturating_sub(budget);
                    chunk.advance(options.check, stop, max_cost, least)?;
                    Ok(chunk.end())
                })
                .collect::<Result<_>>()?;
            for (&k, outcome) in now.iter().zip(ended) {
                triangles -= outcome.removed_triangles;
                let faces = outcome.triangles.len() + outcome.removed_triangles;
                meter.work(BEGINNING * faces + COLLAPSE * outcome.removed_triangles)?;
                outcomes[k] = Some(outcome);
            }
        }
        // Each had its turn.
        let outcomes: Vec<_> = outcomes.into_iter().flatten().collect();
        for outcome in &outcomes {
            done.tally.add(&outcome.tally);
        }
        let left: usize = outcomes.iter().map(Outcome::bytes).sum();
        done.note_bytes(left + cut.bytes());
        let non_manifold_edges = assemble::<S, C>(
            self.options,
            self.room,
            flat,
            &cut,
            outcomes,
            is_first,
            meter,
        )?;
        if is_first {
            done.non_manifold_edges_in = non_manifold_edges;
        }
        Ok(max_cost)
    }

    /// Lets chunks go up in cost together, until so small a share of their inner vertices is left.
    /// The threshold that they have reached; infinite where nothing is left to collapse.
    fn advance_together<S: EdgeStore, C: Cost<S>>(
        &self,
        chunks: &mut [Chunk<S, C>],
        density: f64,
        budget: usize,
        meter: &mut Meter,
    ) -> Result<f32> {
        let rings = (DISTURBED / density.sqrt()).ceil() as usize;
        let deep: Vec<Vec<VertexId>> = chunks.par_iter().map(|c| c.deep(rings)).collect();
        let all: usize = deep.iter().map(Vec::len).sum();
        let (check, stop) = (self.options.check, self.stop);
        let triangles =
            |chunks: &[Chunk<S, C>]| -> usize { chunks.iter().map(|c| c.greedy.triangles()).sum() };
        let before = triangles(chunks);
        let mut max_cost = 0.0f32;
        // Where progress was last: the threshold, and what was left.
        let mut last = (0.0f32, 1.0f64);
        loop {
            // What is left to remove, shared out anew at every step, so that it stops no chunk that has
            // more to remove at this cost than others.
            let now = triangles(chunks);
            let budget = budget.saturating_sub(before - now) / chunks.len().max(1);
            if budget <= MOST_AT_ONCE {
                return Ok(max_cost);
            }
            let halts: Vec<Halt> = chunks
                .par_iter_mut()
                .map(|chunk| {
                    let least = chunk.greedy.triangles().saturating_sub(budget);
                    chunk.advance(check, stop, max_cost, least)
                })
                .collect::<Result<_>>()?;
            let left = triangles(chunks);
            meter.work(COLLAPSE * (now - left))?;
            meter.detour(chunks.len())?;
            if halts.contains(&Halt::Target) && left < now {
                continue;
            }
            let next = halts.iter().filter_map(|halt| match halt {
                Halt::Cost(next) => Some(*next),
                Halt::Target | Halt::Empty => None,
            });
            let Some(next) = next.reduce(f32::min) else {
                return Ok(f32::INFINITY);
            };
            let left: usize = chunks
                .iter()
                .zip(&deep)
                .map(|(c, deep)| c.left_of(deep))
                .sum();
            let left = left as f64 / all.max(1) as f64;
            if left <= density {
                return Ok(max_cost);
            }
            if left < STUCK * last.1 {
                last = (max_cost, left);
            } else if left < BEGUN && max_cost > HOPELESS * last.0 {
                // What is left is blocked: more would only be taken from where it should stay.
                return Ok(last.0);
            }
            let step = (left / density).clamp(FINEST_STEP, COARSEST_STEP);
            max_cost = next.max((f64::from(max_cost) * step) as f32);
        }
    }
}

/// How far a round goes.
#[derive(Clone, Copy, Debug)]
enum Until {
    /// Until so small a share of the vertices that are not on a seam is left.
    Density(f64),
    /// Until a collapse costs more.
    Cost(f32),
}

/// Which chunks find the threshold, spread evenly over all.
fn pilots(chunks: usize) -> Vec<usize> {
    let count = ((PILOT_SHARE * chunks as f64).ceil() as usize)
        .max(PILOT_CHUNKS)
        .min(chunks);
    (0..count)
        .map(|i| (2 * i + 1) * chunks / (2 * count))
        .collect()
}

/// A piece of the surface and its mesh.
struct Chunk<S: EdgeStore, C: Cost<S>> {
    greedy: Greedy<S, C, Buckets>,
    /// The vertices by their numbers in the whole: those of the chunk, then others.
    vertices: Vec<u32>,
    /// The chunk's own vertices.
    own: usize,
    /// Of these, the ones that are on no seam.
    inner: usize,
    triangles_before: usize,
    /// The wedges by their numbers in the whole.
    wedges: Vec<u32>,
    /// Whether anything is said of the faces of the whole.
    has_flags: bool,
    singular: Singular,
}

/// What is left of a chunk.
struct Outcome<V> {
    /// By the vertices' numbers in the whole.
    triangles: Vec<[u32; 3]>,
    flags: Vec<FaceFlags>,
    /// What is carried, and the wedges' numbers in the whole.
    wedges: (FlatWedges, Vec<u32>),
    /// Inner vertices that are left, ascending.
    kept: Vec<Kept<V>>,
    /// The chunk's own vertices that were kept out of it, although all of their faces are in it.
    held: Vec<u32>,
    /// What the chunk's faces add to the states of the other vertices.
    of_seam: Vec<(u32, V)>,
    singular: Singular,
    removed_triangles: usize,
    tally: Tally,
}

impl<V> Outcome<V> {
    /// The bytes held.
    fn bytes(&self) -> usize {
        self.triangles.capacity() * size_of::<[u32; 3]>()
            + self.wedges.0.bytes()
            + self.wedges.1.capacity() * size_of::<u32>()
            + self.kept.capacity() * size_of::<Kept<V>>()
            + self.of_seam.capacity() * size_of::<(u32, V)>()
            + self.singular.rim.capacity() * size_of::<RimEdge>()
    }
}

/// A vertex that is left.
struct Kept<V> {
    vertex: u32,
    position: Vec3,
    deviation: f32,
    weight: f32,
    is_locked: bool,
    state: V,
}

/// What a chunk says of boundaries and non-manifold edges before it is decimated.
#[derive(Default)]
struct Singular {
    /// Edges along the seam that have no mate in the chunk. Whether they have one elsewhere shows
    /// when all are together.
    rim: Vec<RimEdge>,
    /// Non-manifold edges that are not on the seam.
    non_manifold_edges: usize,
    /// Of these, the ones at which two neighbours do not agree.
    conflicts: usize,
}

/// An edge between two vertices on the seam by their numbers in the whole, the smaller first, and
/// whether it runs that way.
///
/// In one word, so that they are sorted quickly: 31 bits each for the vertices, one for the way.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct RimEdge(u64);

impl RimEdge {
    fn between(tail: u32, head: u32) -> Self {
        let (small, large) = (tail.min(head), tail.max(head));
        Self(u64::from(small) << 32 | u64::from(large) << 1 | u64::from(tail < head))
    }

    fn ends(self) -> [u32; 2] {
        [(self.0 >> 32) as u32, self.0 as u32 >> 1]
    }

    /// Whether both are the same edge, whichever way.
    fn is_beside(&self, other: &Self) -> bool {
        self.0 >> 1 == other.0 >> 1
    }
}

impl<S: EdgeStore, C: Cost<S>> Chunk<S, C> {
    /// Builds the mesh of a chunk and queues its edges; on any thread, so that nobody is told.
    fn begin(
        options: &Options,
        room: Room,
        flat: &Flat<C::State>,
        cut: &Cut,
        chunk: usize,
        is_first: bool,
    ) -> Self {
        let range = cut.vertices(chunk);
        let (begin, own) = (range.start, range.len());
        let faces: usize = cut.faces(chunk).map(|range| range.len()).sum();
        let mut triangles: Vec<[u32; 3]> = Vec::with_capacity(faces);
        for range in cut.faces(chunk) {
            triangles.extend_from_slice(&flat.triangles[range]);
        }
        let is_own = |v: u32| range.contains(&(v as usize));
        let corners = triangles.as_flattened().iter().copied();
        let mut others: Vec<u32> = corners.filter(|&v| !is_own(v)).collect();
        others.sort_unstable();
        others.dedup();
        for v in triangles.as_flattened_mut() {
            *v = if is_own(*v) {
                *v - begin as u32
            } else {
                let other = others.binary_search(v).expect("it was collected");
                (own + other) as u32
            };
        }
        let mut vertices: Vec<u32> = Vec::with_capacity(own + others.len());
        vertices.extend(range.clone().map(|v| v as u32));
        vertices.append(&mut others);
        let ranges: Vec<Range<usize>> = cut.faces(chunk).collect();
        let (carried, wedges) = flat.wedges.gather(ranges.into_iter());
        let gathered = Flat {
            wedges: carried,
            positions: gather(&flat.positions, &vertices),
            locked: gather(&flat.locked, &vertices),
            weights: gather(&flat.weights, &vertices),
            deviation: gather(&flat.deviation, &vertices),
            states: gather(&flat.states, &vertices),
            creased: flat.creased,
            may_shift: flat.may_shift,
            flags: if flat.flags.is_empty() {
                Vec::new()
            } else {
                let ranges = cut.faces(chunk);
                ranges
                    .flat_map(|range| flat.flags[range].iter().copied())
                    .collect()
            },
            triangles: Vec::new(),
        };
        let mesh = Mesh::<S>::from_triangles(vertices.len(), &triangles);
        drop(triangles);
        let (mut surface, states) = gathered.into_surface(mesh, room, &[]);
        surface.seam = (0..vertices.len())
            .map(|v| v >= own || cut.is_shared(begin + v))
            .collect();
        let (cost, singular) = if is_first {
            let cost = unheard(|meter| C::new(&surface, options, meter));
            (cost, singular(&surface, &vertices))
        } else {
            let cost = unheard(|meter| C::with_states(&surface, options, states, meter));
            (cost, Singular::default())
        };
        // Neighbours that do not agree wait until the whole is oriented.
        for e in surface.mesh.same_way_pairs() {
            for v in surface.mesh.edge_vertices(e) {
                surface.seam[v.index()] = true;
            }
        }
        let inner = surface.seam.iter().filter(|&&on_seam| !on_seam).count();
        let greedy = unheard(|meter| {
            Greedy::new(surface, cost, Topology::Preserve, Tally::default(), meter)
        });
        Self {
            triangles_before: greedy.triangles(),
            greedy,
            vertices,
            own,
            inner,
            wedges,
            has_flags: !flat.flags.is_empty(),
            singular,
        }
    }

    /// The vertices that are more than so many edges away from the seam, or as many as there are.
    fn deep(&self, rings: usize) -> Vec<VertexId> {
        let surface = self.greedy.surface();
        let mesh = &surface.mesh;
        let mut is_near: Vec<bool> = (0..mesh.vertex_slots())
            .map(|v| surface.is_on_seam(VertexId::new(v)))
            .collect();
        let mut last: Vec<VertexId> = Vec::new();
        let mut next: Vec<VertexId> = mesh.vertices().filter(|v| is_near[v.index()]).collect();
        for _ in 0..rings {
            if next.is_empty() {
                break;
            }
            last.clear();
            for x in next.iter().flat_map(|&v| mesh.neighbours(v)) {
                if !std::mem::replace(&mut is_near[x.index()], true) {
                    last.push(x);
                }
            }
            std::mem::swap(&mut last, &mut next);
        }
        // Where none is farther away, the last ring is deep.
        let deepest = if next.is_empty() { &last } else { &next };
        let mut beyond = deepest.iter().flat_map(|&v| mesh.neighbours(v));
        if beyond.all(|x| is_near[x.index()]) {
            let deepest = deepest.iter().filter(|&&v| !surface.is_on_seam(v));
            deepest.for_each(|v| is_near[v.index()] = false);
        }
        mesh.vertices().filter(|v| !is_near[v.index()]).collect()
    }

    /// How many of these vertices are left.
    fn left_of(&self, vertices: &[VertexId]) -> usize {
        let mesh = &self.greedy.surface().mesh;
        vertices
            .iter()
            .filter(|&&v| mesh.outgoing(v) != Outgoing::None)
            .count()
    }

    /// Collapses what costs no more, down to a number of triangles at the least.
    fn advance(&mut self, check: bool, stop: Stop, max_cost: f32, least: usize) -> Result<Halt> {
        let stop = Stop {
            triangles: least + MOST_AT_ONCE,
            max_cost,
            ..stop
        };
        self.greedy.advance(stop, check, &mut Meter::unheard())
    }

    /// The bytes that the chunk holds.
    fn bytes(&self) -> usize {
        self.greedy.surface().mesh_bytes()
            + self.greedy.tally().working_bytes
            + self.vertices.capacity() * size_of::<u32>()
    }

    /// What is left.
    fn end(self) -> Outcome<C::State> {
        let removed_triangles = self.triangles_before - self.greedy.triangles();
        let (surface, cost, tally) = self.greedy.into_parts();
        let mesh = &surface.mesh;
        let number = |v: VertexId| self.vertices[v.index()];
        let mut outcome = Outcome {
            triangles: mesh
                .faces()
                .map(|f| mesh.face_vertices(f).map(number))
                .collect(),
            flags: Vec::new(),
            wedges: (FlatWedges::default(), self.wedges),
            kept: Vec::with_capacity(self.inner - tally.collapses),
            held: Vec::new(),
            of_seam: Vec::new(),
            singular: self.singular,
            removed_triangles,
            tally,
        };
        if self.has_flags {
            outcome.flags = mesh.faces().map(|f| surface.flags(f)).collect();
        }
        let is_stateless = size_of::<C::State>() == 0;
        for (v, state) in cost.into_states().into_iter().enumerate() {
            let id = VertexId::new(v);
            if surface.is_on_seam(id) {
                if v < self.own {
                    outcome.held.push(number(id));
                }
                if !is_stateless {
                    outcome.of_seam.push((number(id), state));
                }
            } else if mesh.outgoing(id) != Outgoing::None {
                outcome.kept.push(Kept {
                    vertex: number(id),
                    position: surface.geometry.position(id),
                    deviation: surface.geometry.deviation(id),
                    weight: surface.weight(id) as f32,
                    is_locked: surface.is_locked(id),
                    state,
                });
            }
        }
        let Surface { mesh, wedges, .. } = surface;
        outcome.wedges.0 = wedges.into_flat(&mesh);
        outcome
    }
}

/// The singular edges of a chunk whose vertices have these numbers in the whole.
fn singular<S: EdgeStore>(surface: &Surface<S>, vertices: &[u32]) -> Singular {
    let mesh = &surface.mesh;
    let mut singular = Singular::default();
    for e in mesh
        .faces()
        .flat_map(FaceId::edges)
        .filter(|&e| mesh.mate(e).is_none())
    {
        if surface.is_rim(e) {
            let [a, b] = mesh.edge_vertices(e).map(|v| vertices[v.index()]);
            singular.rim.push(RimEdge::between(a, b));
        } else if !mesh.is_boundary(e) && mesh.is_canonical(e) {
            singular.non_manifold_edges += 1;
            singular.conflicts += usize::from(mesh.edge_star(e).len() == 2);
        }
    }
    singular
}

/// Puts what is left of the chunks in the place of the whole; the number of non-manifold edges that
/// the whole had, in the first round. Told to a meter: a unit a triangle that is left.
fn assemble<S: EdgeStore, C: Cost<S>>(
    options: &Options,
    room: Room,
    flat: &mut Flat<C::State>,
    cut: &Cut,
    mut outcomes: Vec<Outcome<C::State>>,
    is_first: bool,
    meter: &mut Meter,
) -> progress::Result<usize> {
    let mut rim: Vec<RimEdge> = Vec::new();
    let mut non_manifold_edges = 0;
    for outcome in &mut outcomes {
        rim.append(&mut outcome.singular.rim);
        non_manifold_edges += outcome.singular.non_manifold_edges;
    }
    rim.par_sort_unstable();
    let edges = || rim.chunk_by(RimEdge::is_beside);
    let is_singular = |edge: &&[RimEdge]| !matches!(edge, [a, b] if a != b);
    non_manifold_edges += edges()
        .filter(is_singular)
        .filter(|edge| edge.len() > 1)
        .count();

    let mut alive = vec![true; flat.positions.len()];
    flat.deviation.resize(flat.positions.len(), 0.0);
    let left = outcomes.iter().map(|o| o.triangles.len()).sum();
    let mut triangles: Vec<[u32; 3]> = Vec::with_capacity(left);
    let mut flags = Vec::new();
    let mut carried = FlatWedges {
        layout: flat.wedges.layout.clone(),
        ..FlatWedges::default()
    };
    for (k, outcome) in outcomes.iter_mut().enumerate() {
        let (part, wedges) = std::mem::take(&mut outcome.wedges);
        carried.append(&part, &wedges);
        flat.wedges.take_values(&part, &wedges);
        meter.work(outcome.triangles.len())?;
        triangles.append(&mut outcome.triangles);
        flags.append(&mut outcome.flags);
        for v in cut.vertices(k) {
            alive[v] = cut.is_shared(v);
        }
        for &v in &outcome.held {
            alive[v as usize] = true;
        }
        for kept in &outcome.kept {
            let v = kept.vertex as usize;
            alive[v] = true;
            flat.positions[v] = kept.position;
            flat.deviation[v] = kept.deviation;
            if let Some(weight) = flat.weights.get_mut(v) {
                *weight = kept.weight;
            }
            if let Some(locked) = flat.locked.get_mut(v) {
                *locked = kept.is_locked;
            }
        }
    }
    let renamed = renumbered(&alive);
    rename(&renamed, &mut triangles);
    meter.detour(triangles.len())?;
    let lines: Vec<(u32, C::State)> = edges()
        .filter(is_singular)
        .flat_map(|edge| {
            let [a, b] = edge[0].ends();
            let [p, q] = [a, b].map(|v| flat.positions[v as usize].as_dvec3() * room.scale());
            let weight = |v: u32| flat.weights.get(v as usize).map_or(1.0, |&w| f64::from(w));
            [a, b].map(|v| {
                let line = C::line(options, q - p, edge.len() == 1, weight(v));
                (renamed[v as usize], line)
            })
        })
        .collect();
    retain(&alive, &mut flat.positions);
    retain(&alive, &mut flat.locked);
    retain(&alive, &mut flat.weights);
    retain(&alive, &mut flat.deviation);
    meter.detour(alive.len())?;
    if is_first {
        flat.states = vec![C::State::default(); flat.positions.len()];
    } else {
        retain(&alive, &mut flat.states);
    }
    for outcome in outcomes {
        meter.detour(outcome.kept.len())?;
        for kept in outcome.kept {
            flat.states[renamed[kept.vertex as usize] as usize] = kept.state;
        }
        for (v, part) in outcome.of_seam.iter().filter(|_| is_first) {
            C::join(&mut flat.states[renamed[*v as usize] as usize], part);
        }
    }
    for (v, line) in &lines {
        C::join(&mut flat.states[*v as usize], line);
    }
    flat.triangles = triangles;
    flat.flags = flags;
    carried.values = std::mem::take(&mut flat.wedges.values);
    carried.drop_unused();
    flat.wedges = carried;
    Ok(non_manifold_edges)
}

fn gather<T: Clone>(values: &[T], ids: &[u32]) -> Vec<T> {
    if values.is_empty() {
        Vec::new()
    } else {
        ids.iter().map(|&v| values[v as usize].clone()).collect()
    }
}
