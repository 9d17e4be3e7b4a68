//! Ashikhmin, "A tone mapping algorithm for high contrast images", 2002, as restated by Michael 2010, section 4.3.

use super::plane::{Average, Plane, gaussian};
use crate::techniques::tonemap::{Local, Settings};

/// Perceptual capacity C of luminance in cd/m²: how many just noticeable differences lie below it. The integral of
/// 1 / TVI, with the four pieces of the paper's threshold against intensity. The paper gives what the pieces begin with by four digits,
/// 2.4483, 16.5630 and 32.0693, with steps of 0.02, 0.00002 and −0.00003 between them; here the pieces meet.
pub fn capacity(luminance: f64) -> f64 {
    let first = 0.0034 / 0.0014;
    let second = first + (1.0 / 0.0034f64).ln() / 0.4027;
    let third = second + 6.2444 / 0.4027;
    if luminance < 0.0034 {
        luminance / 0.0014
    } else if luminance < 1.0 {
        first + (luminance / 0.0034).ln() / 0.4027
    } else if luminance < 7.2444 {
        second + (luminance - 1.0) / 0.4027
    } else {
        third + (luminance / 7.2444).ln() / 0.0556
    }
}

/// The same with what the paper gives the pieces to begin with, and its steps; up to 0.2 % apart from [`capacity`] in a display luminance.
/// For comparison with other programs.
pub fn published_capacity(luminance: f64) -> f64 {
    if luminance < 0.0034 {
        luminance / 0.0014
    } else if luminance < 1.0 {
        2.4483 + (luminance / 0.0034).ln() / 0.4027
    } else if luminance < 7.2444 {
        16.5630 + (luminance - 1.0) / 0.4027
    } else {
        32.0693 + (luminance / 7.2444).ln() / 0.0556
    }
}

/// Threshold against intensity, the just noticeable difference at a luminance: 1 / C′.
pub fn threshold(luminance: f64) -> f64 {
    if luminance < 0.0034 {
        0.0014
    } else if luminance < 1.0 {
        0.4027 * luminance
    } else if luminance < 7.2444 {
        0.4027
    } else {
        0.0556 * luminance
    }
}

/// The global curve: world luminance [`Curve::low`] to [`Curve::high`] onto display luminance 0 to [`Curve::display`].
#[derive(Clone, Copy, Debug)]
pub struct Curve {
    /// Luminance that becomes black, cd/m².
    pub low: f64,
    /// Luminance that becomes the display's largest, cd/m².
    pub high: f64,
    /// Largest luminance of the display, L_dmax, cd/m².
    pub display: f64,
    /// C.
    pub capacity: fn(f64) -> f64,
}

impl Curve {
    /// TM: display luminance of an adaptation luminance. A picture of one luminance is as bright as the display can be.
    pub fn map(&self, luminance: f64) -> f64 {
        let (low, high) = ((self.capacity)(self.low), (self.capacity)(self.high));
        if high <= low {
            return self.display;
        }
        self.display * ((self.capacity)(luminance) - low) / (high - low)
    }

    /// L_d: display luminance of a pixel of `luminance` seen at the adaptation `level`.
    pub fn display(&self, luminance: f64, level: f64) -> f64 {
        let mapped = self.map(level);
        mapped + threshold(mapped) / threshold(level) * (luminance - level)
    }
}

/// How local adaptation is found.
#[derive(Clone, Copy, Debug)]
pub struct Search {
    /// Largest radius, pixels.
    pub largest: usize,
    /// Largest contrast |G_s − G_2s| / G_s of a neighbourhood that counts as even.
    pub contrast: f64,
    /// Windows of equal weights in place of Gaussians: [`Local::Growing`].
    pub windows: bool,
}

impl Search {
    /// As the settings say.
    pub fn of(settings: &Settings) -> Self {
        Self {
            largest: settings.radius as usize,
            contrast: f64::from(settings.contrast),
            windows: settings.local == Local::Growing,
        }
    }

    /// G_s: σ = s/2, s pixels to each side.
    pub fn weights(radius: usize) -> Vec<f64> {
        gaussian(radius as f64 / 2.0, radius)
    }

    /// Weights of distances 0 to the radius along one axis.
    fn own_weights(&self, radius: usize) -> Vec<f64> {
        if self.windows { vec![1.0 / (2 * radius + 1) as f64; radius + 1] } else { Self::weights(radius) }
    }

    /// Local adaptation of every pixel: the average over the largest neighbourhood that is still even. A pixel whose
    /// smallest neighbourhood is not even adapts to that smallest one. `average` computes the averages.
    pub fn adaptation(&self, luminance: &Plane, average: Average) -> Plane {
        let of = |s| average(luminance, s as f64 / 2.0, &self.own_weights(s));
        let averages: Vec<Plane> = (1..=2 * self.largest).map(of).collect();
        let at = |s: usize, x: usize, y: usize| averages[s - 1][(x, y)];
        Plane::from_fn(luminance.width, luminance.height, |x, y| {
            let mut level = at(1, x, y);
            for s in 1..=self.largest {
                let (inner, outer) = (at(s, x, y), at(2 * s, x, y));
                if (inner - outer).abs() >= self.contrast * inner {
                    break;
                }
                level = inner;
            }
            level
        })
    }
}
