//! A smooth surface that is densely meshed at one end and coarsely at the other.

use glam::DVec3;

use super::Surface;
use super::geodesic::geodesic;
use super::noise::Noise;

/// The triangles an area at one end beside the other.
const RATIO: f64 = 100.0;

/// A lumpy ball: a sphere on which the triangles are drawn from one pole to the other without a
/// change of their angles (a Möbius map), with a few low bumps.
pub fn density(triangles: usize, seed: u64) -> Surface {
    let mut surface = geodesic(triangles);
    let bumps = Noise {
        seed,
        frequency: 1.1,
        octaves: 2,
        gain: 0.3,
    };
    for p in &mut surface.positions {
        let direction = drawn_up(*p);
        let radius = 1.0 + 0.25 * bumps.at(direction);
        *p = direction * radius * DVec3::new(1.0, 1.0, 1.5);
    }
    surface
}

/// The sphere's dilatation by λ from the south pole: lengths are λ times as large there and 1/λ
/// times at the north pole, areas λ² times and 1/λ² times.
fn drawn_up(p: DVec3) -> DVec3 {
    let (north, south) = ((1.0 + p.z) * RATIO.sqrt(), 1.0 - p.z);
    let sideways = 2.0 * RATIO.powf(0.25);
    DVec3::new(sideways * p.x, sideways * p.y, north - south) / (north + south)
}
