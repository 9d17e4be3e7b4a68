//! Reinhard and Devlin, "Dynamic range reduction inspired by photoreceptor physiology", 2005.

use super::plane::luminance_of;

/// Statistics of a picture, and the settings of the operator.
#[derive(Clone, Copy, Debug)]
pub struct Receptor {
    /// Means of the channels.
    pub mean: [f64; 3],
    /// f, before the exponential.
    pub intensity: f64,
    /// m.
    pub contrast: f64,
    /// c.
    pub chromatic: f64,
    /// a.
    pub adaptation: f64,
}

/// m from the key of the picture; minimum, maximum and log-average of luminance.
pub fn contrast(min: f64, max: f64, log_average: f64) -> f64 {
    let (low, high) = (min.max(1e-6 * max).max(1e-30).ln(), max.max(1e-30).ln());
    let key = if high > low { ((high - log_average.ln()) / (high - low)).clamp(0.0, 1.0) } else { 0.0 };
    0.3 + 0.7 * key.powf(1.4)
}

impl Receptor {
    /// Responses of the three channels, 0 to 1.
    pub fn response(&self, pixel: [f32; 3]) -> [f64; 3] {
        let [luminance, world] = [luminance_of(pixel), luminance(self.mean)];
        std::array::from_fn(|i| {
            let light = f64::from(pixel[i]);
            let local = self.chromatic * light + (1.0 - self.chromatic) * luminance;
            let global = self.chromatic * self.mean[i] + (1.0 - self.chromatic) * world;
            let adapted = self.adaptation * local + (1.0 - self.adaptation) * global;
            if light > 0.0 { light / (light + ((-self.intensity).exp() * adapted).powf(self.contrast)) } else { 0.0 }
        })
    }
}

fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Stretches the responses of a picture from 0 to 1. A single response above 0 is white.
pub fn stretched(responses: &[[f64; 3]]) -> Vec<[f32; 3]> {
    let all = responses.iter().flatten();
    let (low, high) = all.fold((f64::INFINITY, 0.0f64), |(low, high), &v| (low.min(v), high.max(v)));
    let shown = |v: f64| {
        let one = if v > 0.0 { 1.0 } else { 0.0 };
        (if high > low { (v - low) / (high - low) } else { one }) as f32
    };
    responses.iter().map(|pixel| pixel.map(shown)).collect()
}
