//! Value noise: random numbers on the integer lattice, smoothly interpolated between.

use glam::DVec3;

use crate::random;

/// Noise of several sizes.
#[derive(Clone, Copy)]
pub struct Noise {
    pub seed: u64,
    /// The lattice cells a unit of length, in the coarsest octave; each further one has twice as many.
    pub frequency: f64,
    pub octaves: u64,
    /// An octave's height beside that of the one before.
    pub gain: f64,
}

impl Noise {
    /// The noise at `p`, about −1 to 1.
    pub fn at(&self, p: DVec3) -> f64 {
        let (mut scale, mut height, mut sum) = (self.frequency, 1.0, 0.0);
        for octave in 0..self.octaves {
            // A shift, or all octaves would have lattice points at the origin.
            let shift = 0.37 * octave as f64;
            sum += height * value(self.seed.wrapping_add(octave), p * scale + shift);
            scale *= 2.0;
            height *= self.gain;
        }
        sum
    }
}

/// One octave, with a lattice cell of 1 and a continuous second derivative.
fn value(seed: u64, p: DVec3) -> f64 {
    let cell = p.floor();
    let t = p - cell;
    let w = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let corner = |dx: i32, dy: i32, dz: i32| {
        random::at(
            seed,
            [cell.x as i32 + dx, cell.y as i32 + dy, cell.z as i32 + dz],
        )
    };
    let lerp = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let along_x = |dy, dz| lerp(corner(0, dy, dz), corner(1, dy, dz), w.x);
    let along_y = |dz| lerp(along_x(0, dz), along_x(1, dz), w.y);
    lerp(along_y(0), along_y(1), w.z)
}
