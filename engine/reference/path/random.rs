//! Random numbers and directions.

use glam::Vec3;

/// PCG (O'Neill 2014), one stream a pixel.
pub struct Random(u64);

impl Random {
    pub fn new(pixel: u32, seed: u32) -> Self {
        let mut random = Self((u64::from(seed) << 32 | u64::from(pixel)).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        random.next();
        random
    }

    /// In [0, 1).
    pub fn next(&mut self) -> f32 {
        let state = self.0;
        self.0 = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let word = (((state >> ((state >> 59) + 5)) ^ state).wrapping_mul(12_605_985_483_714_917_081) >> 32) as u32;
        (word >> 8) as f32 / (1 << 24) as f32
    }

    /// Leaves out so many numbers.
    pub fn skip(&mut self, count: u32) {
        for _ in 0..count {
            self.next();
        }
    }

    /// Number for [`hash_to_unit`], the same for all triangles along one ray.
    pub fn salt(&mut self) -> u32 {
        self.next().to_bits()
    }
}

/// In [0, 1), the same for one triangle along one ray.
pub fn hash_to_unit(triangle: u32, salt: u32) -> f32 {
    let mut h = triangle.wrapping_mul(0x85eb_ca6b) ^ salt;
    h = (h ^ h >> 16).wrapping_mul(0x7feb_352d);
    h = (h ^ h >> 15).wrapping_mul(0x846c_a68b);
    ((h ^ h >> 16) >> 8) as f32 / (1 << 24) as f32
}

/// A direction around `n` with density cos/π (Malley's method).
pub fn cosine_direction(n: Vec3, a: f32, b: f32) -> Vec3 {
    let (r, phi) = (a.sqrt(), std::f32::consts::TAU * b);
    let (x, y) = n.any_orthonormal_pair();
    (x * (r * phi.cos()) + y * (r * phi.sin()) + n * (1.0 - a).max(0.0).sqrt()).normalize()
}

/// A microfacet normal around `n` with density D · cos, D the GGX distribution of width α = √`a2`.
pub fn facet(n: Vec3, a2: f32, a: f32, b: f32) -> Vec3 {
    // Walter et al. 2007, eq. 35: tan²θ = α² a / (1 − a).
    let cosine = ((1.0 - a) / (1.0 + (a2 - 1.0) * a)).max(0.0).sqrt();
    let (sine, phi) = ((1.0 - cosine * cosine).max(0.0).sqrt(), std::f32::consts::TAU * b);
    let (x, y) = n.any_orthonormal_pair();
    (x * (sine * phi.cos()) + y * (sine * phi.sin()) + n * cosine).normalize()
}
