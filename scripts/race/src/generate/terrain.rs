//! A noisy height field.

use glam::DVec3;

use super::Surface;
use super::noise::Noise;
use crate::random::Random;

/// The height of the coarsest hills, in sides of the square.
const HILL: f64 = 0.12;

/// How far a point lies from its place in the grid, in cells: sideways, and up or down.
const JITTER: [f64; 2] = [0.2, 0.05];

/// A unit square of two triangles a cell.
pub fn terrain(triangles: usize, seed: u64) -> Surface {
    let cells = (triangles as f64 / 2.0).sqrt().round() as u32;
    let cell = 1.0 / f64::from(cells);
    let noise = Noise {
        seed,
        frequency: 4.0,
        octaves: 9,
        gain: 0.45,
    };
    let mut random = Random::new(seed);
    let mut surface = Surface::default();
    for row in 0..=cells {
        for column in 0..=cells {
            let sideways = DVec3::new(random.signed(), random.signed(), 0.0) * JITTER[0];
            let place = (DVec3::new(column.into(), row.into(), 0.0) + sideways) * cell;
            let height = HILL * noise.at(place) + JITTER[1] * cell * random.signed();
            surface.positions.push(place + DVec3::Z * height);
        }
    }
    for row in 0..cells {
        for column in 0..cells {
            let v = row * (cells + 1) + column;
            let [right, up, diagonal] = [v + 1, v + cells + 1, v + cells + 2];
            surface.triangles.push([v, right, diagonal]);
            surface.triangles.push([v, diagonal, up]);
        }
    }
    surface
}
