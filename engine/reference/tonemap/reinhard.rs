//! Reinhard, Stark, Shirley and Ferwerda, "Photographic tone reproduction for digital images", 2002.

use super::plane::{Average, Plane, gaussian};
use crate::techniques::tonemap::Settings;

/// The paper's equation 4: luminance scaled by key / log-average, to a value of which `white` and more becomes 1.
pub fn global(scaled: f64, white: f64) -> f64 {
    scaled * (1.0 + scaled / (white * white)) / (1.0 + scaled)
}

/// Dodging and burning: centre and surround of growing size, equations 5 to 9.
#[derive(Clone, Copy, Debug)]
pub struct Scales {
    /// Number of scales, 8 in the paper.
    pub count: usize,
    /// Key value a of equation 2.
    pub key: f64,
    /// Sharpening φ of equation 7, 8 in the paper.
    pub phi: f64,
    /// Largest activity ε of equation 8, 0.05 in the paper.
    pub epsilon: f64,
}

impl Scales {
    /// As the settings say.
    pub fn of(settings: &Settings) -> Self {
        let Settings { scales, key, phi, epsilon, .. } = *settings;
        Self { count: scales as usize, key: f64::from(key), phi: f64::from(phi), epsilon: f64::from(epsilon) }
    }

    /// Scale s of a step.
    pub fn scale(step: usize) -> f64 {
        1.6f64.powi(step as i32)
    }

    /// Equation 5: exp(−r² / (α s)²) with α = 1 / (2 √2) is a Gaussian of σ = s / 4. It reaches 3σ.
    pub fn weights(scale: f64) -> Vec<f64> {
        let sigma = scale / 4.0;
        gaussian(sigma, (3.0 * sigma).ceil() as usize)
    }

    /// V1 at the largest scale whose activity stays under ε, of each pixel of scaled luminance. `average` computes the averages.
    pub fn adaptation(&self, scaled: &Plane, average: Average) -> Plane {
        let of = |step| average(scaled, Self::scale(step) / 4.0, &Self::weights(Self::scale(step)));
        let blurred: Vec<Plane> = (0..=self.count).map(of).collect();
        Plane::from_fn(scaled.width, scaled.height, |x, y| {
            let mut level = blurred[0][(x, y)];
            for step in 0..self.count {
                let (centre, surround) = (blurred[step][(x, y)], blurred[step + 1][(x, y)]);
                let scale = Self::scale(step);
                let activity = (centre - surround) / (2f64.powf(self.phi) * self.key / (scale * scale) + centre);
                if activity.abs() >= self.epsilon {
                    break;
                }
                level = centre;
            }
            level
        })
    }
}

/// Equation 9: a pixel of scaled luminance seen at the adaptation `level`.
pub fn local(scaled: f64, level: f64) -> f64 {
    scaled / (1.0 + level)
}
