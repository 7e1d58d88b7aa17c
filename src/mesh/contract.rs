//! The contraction of an edge that changes the topology for the simpler: pockets fall flat, gaps
//! close, what is left of a tiny component goes.

use smallvec::SmallVec;

use super::collapse::Collapse;
use super::link::Opposite;
use super::{EdgeId, EdgeStore, FaceId, Mesh, OppositeWord, VertexId};

/// What contracting an edge does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Contraction {
    removed: VertexId,
    kept: VertexId,
    /// The faces that go, ascending.
    dead: Vec<FaceId>,
    /// Of two faces that went with each other, the one.
    vanishing: Vec<FaceId>,
    /// The vertices whose surroundings change, both ends first.
    around: Vec<VertexId>,
}

impl Contraction {
    /// The faces that go, ascending.
    pub fn dead_faces(&self) -> &[FaceId] {
        &self.dead
    }

    /// The faces in whose place nothing is left: two came to lie on each other, and where the
    /// one stayed an edge would become a boundary.
    pub fn vanishing_faces(&self) -> &[FaceId] {
        &self.vanishing
    }

    /// The vertices whose surroundings change, but for the ends.
    pub fn around(&self) -> &[VertexId] {
        &self.around[2..]
    }
}

/// A face after the contraction.
#[derive(Clone, Copy, Debug)]
struct Triangle {
    face: FaceId,
    vertices: [VertexId; 3],
}

impl Triangle {
    fn has(&self, v: VertexId) -> bool {
        self.vertices.contains(&v)
    }

    /// The vertices behind and before `v`.
    fn beside(&self, v: VertexId) -> [VertexId; 2] {
        let i = self.vertices.iter().position(|&x| x == v).unwrap_or(0);
        [self.vertices[(i + 1) % 3], self.vertices[(i + 2) % 3]]
    }

    /// Whether the face runs along its edge from `a` to `b`.
    fn runs(&self, a: VertexId, b: VertexId) -> bool {
        self.beside(a)[0] == b
    }
}

impl<S: EdgeStore> Mesh<S> {
    /// What contracting `e` would do, where [`link_condition(e)`](Self::link_condition) forbids to
    /// collapse it: the faces at `e` go; of two faces that come to lie on each other one goes, or
    /// both where no other face is at one of their edges; edges that come to lie on each other become
    /// one. Nothing where an edge or a vertex would become non-manifold (or more so), or an edge a
    /// boundary, and at or beside a [busy](Self::is_busy) vertex.
    ///
    /// Costs a walk around both ends and around all of their neighbours.
    pub fn contraction(&self, e: EdgeId) -> Option<Contraction> {
        let [removed, kept] = self.edge_vertices(e);
        let mut ends = [removed, kept].into_iter();
        if ends.any(|v| self.is_busy(v) || self.neighbours(v).any(|x| self.is_busy(x))) {
            return None;
        }
        let rename = |v: VertexId| if v == removed { kept } else { v };
        let mut faces: Vec<FaceId> = self.vertex_faces(removed).collect();
        faces.extend(self.vertex_faces(kept));
        faces.sort_unstable();
        faces.dedup();
        let (mut dead, mut vanishing) = (Vec::new(), Vec::new());
        let mut living: Vec<Triangle> = Vec::new();
        for &face in &faces {
            let vertices = self.face_vertices(face);
            if vertices.contains(&removed) && vertices.contains(&kept) {
                dead.push(face);
            } else {
                let vertices = vertices.map(rename);
                living.push(Triangle { face, vertices });
            }
        }
        let side = |t: &Triangle| {
            let [a, b] = t.beside(kept);
            [a.min(b), a.max(b)]
        };
        living.sort_by_key(|t| (side(t), t.face));
        let mut rims = Vec::new();
        for pair in living.chunk_by(|a, b| side(a) == side(b)) {
            match *pair {
                [_] => {}
                [first, second] => {
                    let [a, b] = side(&first);
                    let beside = |x: VertexId| living.iter().filter(|t| t.has(x)).count() - 2;
                    let across = self.star_between(first.face, a, b).len() - 2;
                    let others = [beside(a), beside(b), across];
                    dead.push(second.face);
                    if others.contains(&0) {
                        dead.push(first.face);
                        vanishing.push(first.face);
                    }
                    rims.push((first.face, [a, b]));
                }
                _ => return None,
            }
        }
        dead.sort_unstable();
        let is_dead = |f: FaceId| dead.binary_search(&f).is_ok();
        living.retain(|t| !is_dead(t.face));

        let mut neighbours: Vec<VertexId> = self
            .neighbours(removed)
            .chain(self.neighbours(kept))
            .collect();
        neighbours.retain(|&x| x != removed && x != kept);
        neighbours.sort_unstable();
        neighbours.dedup();
        let is_cut = |v: &VertexId| self.vertex_edges(*v).into_iter().any(|e| self.is_cut(e));
        if [removed, kept].iter().chain(&neighbours).any(is_cut) {
            return None;
        }
        for &x in &neighbours {
            let before = [removed, kept].map(|v| self.faces_between(v, x));
            let after: SmallVec<[bool; 4]> = living
                .iter()
                .filter(|t| t.has(x))
                .map(|t| t.runs(kept, x))
                .collect();
            if !is_no_worse(&before, &after) {
                return None;
            }
        }
        for &(face, [a, b]) in &rims {
            let star = self.star_between(face, a, b);
            let after: SmallVec<[bool; 4]> = star
                .iter()
                .filter(|e| !is_dead(e.face()))
                .map(|&e| self.tail(e) == a)
                .collect();
            if !is_no_worse(&[star.len()], &after) {
                return None;
            }
        }
        let fans_before = self.fans(removed).count().max(self.fans(kept).count());
        if fans_of(kept, &living) > fans_before {
            return None;
        }
        for &x in &neighbours {
            let around: Vec<Triangle> = self
                .vertex_faces(x)
                .filter(|&f| !is_dead(f))
                .map(|face| Triangle {
                    face,
                    vertices: self.face_vertices(face).map(rename),
                })
                .collect();
            if fans_of(x, &around) > self.fans(x).count() {
                return None;
            }
        }
        let mut around = vec![removed, kept];
        around.extend(neighbours);
        Some(Contraction {
            removed,
            kept,
            dead,
            vanishing,
            around,
        })
    }

    /// Whether two faces run along `e` the same way: the surface is not orientable, and the fans
    /// that end there are one fan to everyone who does not care for orientation.
    fn is_cut(&self, e: EdgeId) -> bool {
        matches!(self.opposite(e), Opposite::NonManifold(_)) && self.edge_star(e).len() == 2
    }

    /// The directed edges of the edge between two corners of a face.
    fn star_between(&self, f: FaceId, a: VertexId, b: VertexId) -> SmallVec<[EdgeId; 2]> {
        let joins = |e: &EdgeId| {
            let ends = self.edge_vertices(*e);
            ends == [a, b] || ends == [b, a]
        };
        let edge = f.edges().into_iter().find(joins);
        edge.map(|e| self.edge_star(e)).unwrap_or_default()
    }

    /// The number of faces at the edge between two vertices, 0 where there is none.
    fn faces_between(&self, v: VertexId, x: VertexId) -> usize {
        self.vertex_faces(v)
            .filter(|&f| self.face_vertices(f).contains(&x))
            .count()
    }

    /// Does what [`contraction`](Self::contraction) said, on the mesh that it was asked of.
    pub fn contract(&mut self, contraction: &Contraction) -> Collapse {
        let Contraction {
            removed,
            kept,
            dead,
            around,
            ..
        } = contraction;
        let is_dead = |e: &EdgeId| dead.binary_search(&e.face()).is_ok();
        let mut outgoing: Vec<Vec<EdgeId>> = around.iter().map(|&v| self.take_fans(v)).collect();
        // Every row that lists an edge here is made anew.
        let sides = outgoing.iter().flatten().flat_map(|&e| [e, self.prev(e)]);
        for side in sides.collect::<Vec<_>>() {
            if let Opposite::NonManifold(_) = self.opposite(side) {
                for e in self.take_star(side) {
                    self.set_opposite(e, Opposite::Boundary);
                }
            }
        }
        outgoing.iter_mut().for_each(|o| o.retain(|e| !is_dead(e)));
        for e in dead.iter().flat_map(|f| f.edges()) {
            self.store.set_opposite_word(e, OppositeWord::DEAD);
        }
        self.live_faces -= dead.len();
        let moved = std::mem::take(&mut outgoing[0]);
        for &e in &moved {
            self.store.set_tail(e, *kept);
        }
        outgoing[1].extend(moved);
        let sides = outgoing.iter().flatten().flat_map(|&e| [e, self.prev(e)]);
        let mut named: Vec<([VertexId; 2], EdgeId)> = sides
            .map(|e| {
                let [a, b] = self.edge_vertices(e);
                ([a.min(b), a.max(b)], e)
            })
            .collect();
        named.sort_unstable();
        named.dedup();
        for edge in named.chunk_by(|a, b| a.0 == b.0) {
            let star: SmallVec<[EdgeId; 2]> = edge.iter().map(|&(_, e)| e).collect();
            self.link_edge(&star);
        }
        for (&v, outgoing) in around.iter().zip(&mut outgoing) {
            self.find_fans_among(v, outgoing);
        }
        Collapse {
            kept: *kept,
            removed: *removed,
            dead_faces: SmallVec::from_slice(dead),
            merged_edges: SmallVec::new(),
        }
    }
}

/// Whether an edge of which these many faces came together, and on which the faces left run this
/// way or that, is no more of a boundary and no less manifold than it was.
fn is_no_worse(faces_before: &[usize], runs: &[bool]) -> bool {
    match *runs {
        [] => true,
        [_] => faces_before.contains(&1),
        [a, b] => a != b,
        _ => faces_before.iter().any(|&n| n >= runs.len()),
    }
}

/// The number of fans that the faces around a vertex form.
fn fans_of(v: VertexId, faces: &[Triangle]) -> usize {
    let mut ends: Vec<(VertexId, bool, usize)> = Vec::with_capacity(2 * faces.len());
    for (i, t) in faces.iter().enumerate() {
        let [behind, before] = t.beside(v);
        ends.push((behind, true, i));
        ends.push((before, false, i));
    }
    ends.sort_unstable();
    let mut fan: Vec<usize> = (0..faces.len()).collect();
    fn root(fan: &mut [usize], mut i: usize) -> usize {
        while fan[i] != i {
            fan[i] = fan[fan[i]];
            i = fan[i];
        }
        i
    }
    let mut fans = faces.len();
    for edge in ends.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, false, i), (_, true, j)] = *edge {
            let (i, j) = (root(&mut fan, i), root(&mut fan, j));
            if i != j {
                fan[i] = j;
                fans -= 1;
            }
        }
    }
    fans
}
