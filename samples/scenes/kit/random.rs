//! Deterministic choices: an integer hash, a small generator, value noise. Same numbers on every machine.

use glam::Vec2;

/// Integer hash with good avalanche (the output permutation of PCG-RXS-M-XS 32, O'Neill 2014).
pub(crate) fn hash(value: u32) -> u32 {
    let state = value.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// A stream of pseudo-random numbers.
#[derive(Clone, Debug)]
pub(crate) struct Random(u32);

impl Random {
    /// A stream that depends on the seed only.
    pub fn new(seed: u32) -> Self {
        Self(hash(seed ^ 0x9e37_79b9))
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x6d2b_79f5);
        (hash(self.0) >> 8) as f32 / (1 << 24) as f32
    }

    /// Uniform in [low, high).
    pub fn range(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }

    /// Uniform in 0..count; 0 if there is nothing to choose from.
    pub fn index(&mut self, count: usize) -> usize {
        ((self.unit() * count as f32) as usize).min(count.saturating_sub(1))
    }
}

/// Value noise in [0, 1], smooth, with lattice points at integers that repeat after `period` (0: never).
pub(crate) fn value_noise(p: Vec2, period: i32, seed: u32) -> f32 {
    let cell = p.floor();
    let f = p - cell;
    let f = f * f * (Vec2::splat(3.0) - 2.0 * f);
    let corner = |dx: i32, dy: i32| {
        let wrap = |c: i32| if period > 0 { c.rem_euclid(period) } else { c };
        let (x, y) = (wrap(cell.x as i32 + dx), wrap(cell.y as i32 + dy));
        (hash(hash(hash(seed) ^ x as u32) ^ y as u32) >> 8) as f32 / (1 << 24) as f32
    };
    let low = corner(0, 0) + (corner(1, 0) - corner(0, 0)) * f.x;
    let high = corner(0, 1) + (corner(1, 1) - corner(0, 1)) * f.x;
    low + (high - low) * f.y
}

/// Sum of `octaves` of value noise, each half as strong and twice as fine; in [0, 1], mean about one half.
pub(crate) fn fbm(p: Vec2, period: i32, octaves: u32, seed: u32) -> f32 {
    let (mut sum, mut weight) = (0.0, 0.0);
    for octave in 0..octaves {
        let (scale, amplitude) = ((1 << octave) as f32, 0.5f32.powi(octave as i32));
        sum += amplitude * value_noise(p * scale, period << octave, seed.wrapping_add(octave));
        weight += amplitude;
    }
    if weight > 0.0 { sum / weight } else { 0.5 }
}
