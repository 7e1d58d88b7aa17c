//! A statue on a plinth: nearly all triangles in one part, and most of the area in the other.

use std::collections::HashMap;

use glam::DVec3;

use super::Surface;
use super::geodesic::geodesic;
use super::noise::Noise;

/// The statue's share of the triangles.
const STATUE: f64 = 0.98;

/// The triangles an area on the statue beside those on the plinth.
const DENSITY_RATIO: f64 = 100.0;

/// The plinth's height, in sides of its square.
const HEIGHT: f64 = 0.6;

/// Two closed parts that touch.
pub fn plinth(triangles: usize, seed: u64) -> Surface {
    let count = (STATUE * triangles as f64) as usize;
    let mut surface = statue(count, seed);
    let lowest = surface.positions.iter().map(|p| p.z).fold(0.0, f64::min);
    let area = surface.area() * DENSITY_RATIO * (1.0 - STATUE) / STATUE;
    let side = (area / (2.0 + 4.0 * HEIGHT)).sqrt();
    // A little up, so that the statue does not stand on a point.
    let top = DVec3::Z * (lowest + 0.1);
    let first = surface.positions.len() as u32;
    let block = block(side, area / ((triangles - count) as f64 / 2.0));
    surface
        .positions
        .extend(block.positions.iter().map(|&p| p + top));
    surface
        .triangles
        .extend(block.triangles.iter().map(|t| t.map(|v| v + first)));
    surface
}

fn statue(triangles: usize, seed: u64) -> Surface {
    let mut surface = geodesic(triangles);
    let bumps = Noise {
        seed,
        frequency: 1.7,
        octaves: 7,
        gain: 0.5,
    };
    for p in &mut surface.positions {
        let radius = 1.0 + 0.3 * bumps.at(*p);
        *p *= radius * DVec3::new(1.0, 0.8, 1.5);
    }
    surface
}

/// A block under the middle of its top, with cells of about `cell_area`, of two triangles each.
fn block(side: f64, cell_area: f64) -> Surface {
    let cells = |length: f64| (length / cell_area.sqrt()).round().max(1.0) as u32;
    let size = [cells(side), cells(side), cells(side * HEIGHT)];
    let mut block = Surface::default();
    let mut ids = HashMap::new();
    let mut id = |place: [u32; 3]| {
        *ids.entry(place).or_insert_with(|| {
            let [u, v, w] = [0, 1, 2].map(|axis| f64::from(place[axis]) / f64::from(size[axis]));
            let p = DVec3::new(u - 0.5, v - 0.5, (w - 1.0) * HEIGHT) * side;
            block.positions.push(p);
            block.positions.len() as u32 - 1
        })
    };
    for axis in 0..3 {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        for wall in [0, size[axis]] {
            for i in 0..size[next] {
                for j in 0..size[last] {
                    let [a, b, c, d] = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[di, dj]| {
                        let mut place = [wall; 3];
                        (place[next], place[last]) = (i + di, j + dj);
                        id(place)
                    });
                    // The first of two opposite walls looks the other way.
                    block.triangles.extend(if wall > 0 {
                        [[a, b, c], [a, c, d]]
                    } else {
                        [[a, c, b], [a, d, c]]
                    });
                }
            }
        }
    }
    block
}
