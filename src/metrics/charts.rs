//! The charts of a texture, and their triangles that are turned over in it.

use std::cmp::Ordering;

use glam::DVec2;
use rayon::prelude::*;

use super::surface::Surface;
use crate::attributes::Channel;
use crate::mesh::{EdgeId, FaceId, Mesh, Small};

/// The charts of one set of texture coordinates: faces whose coordinates go on across their edges.
pub(super) struct Charts {
    /// How many there are.
    pub(super) count: usize,
    /// The triangles whose turn is the rarer one in their chart.
    pub(super) flipped_triangles: usize,
    /// Which way round each triangle runs in the texture; equal where it has no area there.
    turns: Vec<Ordering>,
}

impl Charts {
    /// The charts of a channel of texture coordinates, with the wedges of each triangle's corners.
    ///
    /// Linear time. Edges of three faces or more part charts, and those whose faces disagree in
    /// direction: beyond them a triangle runs the other way round.
    pub(super) fn of(mesh: &Mesh<Small>, corners: &[[u32; 3]], channel: &Channel) -> Self {
        let turns = corners.iter().map(|t| turn(t.map(|w| at(channel, w))));
        let turns: Vec<Ordering> = turns.collect();
        // The wedges at the tail and the head of an edge.
        let ends = |e: EdgeId| {
            let (corners, k) = (corners[e.face().index()], e.index() % 3);
            [corners[k], corners[(k + 1) % 3]].map(|w| at(channel, w))
        };
        let goes_on = |e: EdgeId, mate: EdgeId| {
            let ([tail, head], [other_head, other_tail]) = (ends(e), ends(mate));
            tail == other_tail && head == other_head
        };
        let mut seen = vec![false; corners.len()];
        let (mut count, mut flipped_triangles) = (0, 0);
        let mut waiting = Vec::new();
        for f in mesh.faces() {
            if std::mem::replace(&mut seen[f.index()], true) {
                continue;
            }
            count += 1;
            let (mut left, mut right) = (0, 0);
            waiting.push(f);
            while let Some(f) = waiting.pop() {
                match turns[f.index()] {
                    Ordering::Greater => left += 1,
                    Ordering::Less => right += 1,
                    Ordering::Equal => {}
                }
                let mates = f.edges().map(|e| mesh.mate(e).filter(|&m| goes_on(e, m)));
                let faces = mates.into_iter().flatten().map(EdgeId::face);
                waiting.extend(
                    faces.filter(|g: &FaceId| !std::mem::replace(&mut seen[g.index()], true)),
                );
            }
            flipped_triangles += left.min(right);
        }
        Self {
            count,
            flipped_triangles,
            turns,
        }
    }

    /// The triangles that run the other way round in the texture than every one of the reference's
    /// that is nearest to their centre, up to a tolerance.
    pub(super) fn turned_against(
        &self,
        surface: &Surface,
        reference: &Self,
        on: &Surface,
        tolerance: f64,
    ) -> usize {
        let triangles = surface.triangles();
        let is_turned = |(&name, &[a, b, c]): (&u32, &[glam::DVec3; 3])| {
            let turn = self.turns[name as usize];
            let center = (a + b + c) / 3.0;
            let Some(nearest) = on.triangles().nearest(center) else {
                return false;
            };
            let (mut agrees, mut disagrees) = (turn == Ordering::Equal, false);
            let within = nearest.distance_squared.sqrt() + tolerance;
            on.triangles().for_each_within(center, within, |there, _| {
                let there = reference.turns[there as usize];
                agrees |= there == turn;
                disagrees |= there == turn.reverse();
            });
            disagrees && !agrees
        };
        let pairs = triangles.names().par_iter().zip(triangles.corners());
        pairs.filter(|&pair| is_turned(pair)).count()
    }
}

/// The area that triangles take in the texture, however they are turned.
pub(super) fn area(corners: &[[u32; 3]], channel: &Channel) -> f64 {
    let areas = corners.iter().map(|t| {
        let [a, b, c] = t.map(|w| at(channel, w));
        (b - a).perp_dot(c - a).abs() / 2.0
    });
    areas.filter(|area| area.is_finite()).sum()
}

/// The texture coordinates of a wedge; 0 for a second one that the channel lacks.
fn at(channel: &Channel, wedge: u32) -> DVec2 {
    let mut row = channel.row(wedge as usize);
    let mut next = || row.next().unwrap_or(0.0);
    DVec2::new(next(), next())
}

/// Which way round a triangle runs: greater to the left, less to the right, equal where it is so thin
/// that rounding its corners to single precision might turn it.
fn turn([a, b, c]: [DVec2; 3]) -> Ordering {
    let (ab, ac) = (b - a, c - a);
    let doubled_area = ab.perp_dot(ac);
    let largest = a.abs().max(b.abs()).max(c.abs()).max_element();
    let longest = ab.length().max(ac.length()).max((c - b).length());
    let rounding = f64::from(f32::EPSILON) * largest * longest;
    if doubled_area.abs() > rounding {
        doubled_area.total_cmp(&0.0)
    } else {
        Ordering::Equal
    }
}
