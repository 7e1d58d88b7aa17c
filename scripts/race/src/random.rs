//! Numbers that look random and are the same on every machine (SplitMix64, Steele et al. 2014).

/// A sequence of numbers, another for each seed.
pub struct Random(u64);

impl Random {
    /// The sequence of `seed`.
    pub fn new(seed: u64) -> Self {
        Self(mix(seed))
    }

    /// A number from 0 to `n` − 1.
    pub fn below(&mut self, n: usize) -> usize {
        // The high half of the product: of no more bias than n / 2^64.
        ((u128::from(self.next()) * n as u128) >> 64) as usize
    }

    /// A number from −1 to 1.
    pub fn signed(&mut self) -> f64 {
        signed(self.next())
    }

    /// Puts `values` in an order of which each is as likely as any (Fisher & Yates 1938).
    pub fn shuffle<T>(&mut self, values: &mut [T]) {
        for i in (1..values.len()).rev() {
            values.swap(i, self.below(i + 1));
        }
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(STEP);
        mix(self.0)
    }
}

/// A number from −1 to 1 that belongs to a point of the integer lattice.
pub fn at(seed: u64, point: [i32; 3]) -> f64 {
    let bits = point.iter().fold(seed, |bits, &x| {
        mix(bits.wrapping_add(STEP) ^ x as u32 as u64)
    });
    signed(bits)
}

/// 2^64 over the golden ratio.
const STEP: u64 = 0x9E37_79B9_7F4A_7C15;

fn mix(bits: u64) -> u64 {
    let bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    bits ^ (bits >> 31)
}

fn signed(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}
