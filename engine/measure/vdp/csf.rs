//! What the eye sees before and after the retina: response to light, and contrast sensitivity (Daly 1993).

/// Response to a luminance in cd/m², relative to its maximum: L/(L + 12.6 L^0.63).
pub(super) fn response(luminance: f64) -> f64 {
    luminance / (luminance + 12.6 * luminance.powf(0.63))
}

/// d ln R/d ln L: by how much a small contrast of luminance is smaller as a contrast of responses.
pub(super) fn response_slope(luminance: f64) -> f64 {
    let half = 12.6 * luminance.powf(0.63);
    (1.0 - 0.63) * half / (luminance + half)
}

/// Contrast sensitivity of an observer who is adapted to a luminance.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sensitivity {
    /// 0.801 (1 + 0.7/l)^−0.2.
    a: f64,
    /// 0.3 (1 + 100/l)^0.15.
    b: f64,
    /// Of the image, square degrees.
    area: f64,
    /// 0.856 d^0.14, d the viewing distance in metres.
    accommodation: f64,
}

/// Peak sensitivity.
const PEAK: f64 = 250.0;
/// Of the frequency scale.
const EPSILON: f64 = 0.9;
/// Sensitivity to oblique gratings beside upright ones.
const OBLIQUE: f64 = 0.78;
/// Viewing distance, metres.
const DISTANCE: f64 = 0.7;

impl Sensitivity {
    /// For an adaptation luminance in cd/m² and an image of `area` square degrees.
    pub(super) fn new(luminance: f64, area: f64) -> Self {
        Self {
            a: 0.801 * (1.0 + 0.7 / luminance).powf(-0.2),
            b: 0.3 * (1.0 + 100.0 / luminance).powf(0.15),
            area,
            accommodation: 0.856 * DISTANCE.powf(0.14),
        }
    }

    /// 1 over the contrast of a grating that is just seen, at `cycles` per degree and an angle in radians.
    pub(super) fn at(&self, cycles: f64, angle: f64) -> f64 {
        if cycles <= 0.0 {
            return 0.0;
        }
        let oblique = (1.0 + OBLIQUE) / 2.0 + (1.0 - OBLIQUE) / 2.0 * (4.0 * angle).cos();
        PEAK * self.one(cycles / (self.accommodation * oblique)).min(self.one(cycles))
    }

    fn one(&self, cycles: f64) -> f64 {
        let size = (3.23 * (cycles * cycles * self.area).powf(-0.3)).powi(5) + 1.0;
        let falling = self.b * EPSILON * cycles;
        size.powf(-0.2) * self.a * EPSILON * cycles * (-falling).exp() * (1.0 + 0.06 * falling.exp()).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensitivity_has_the_known_shape() {
        let day = Sensitivity::new(100.0, 16.0);
        let frequencies: Vec<f64> = (1..600).map(|i| i as f64 / 10.0).collect();
        let peak = frequencies.iter().copied().max_by(|a, b| day.at(*a, 0.0).total_cmp(&day.at(*b, 0.0))).unwrap();
        // A few cycles a degree, with a sensitivity of some hundreds.
        assert!((2.0..6.0).contains(&peak) && (150.0..260.0).contains(&day.at(peak, 0.0)), "{peak}");
        assert!(day.at(50.0, 0.0) < 3.0 && day.at(0.2, 0.0) < 40.0);
        // Less light: less sensitive, and the peak lies lower.
        let night = Sensitivity::new(0.1, 16.0);
        let dim = frequencies.iter().copied().max_by(|a, b| night.at(*a, 0.0).total_cmp(&night.at(*b, 0.0))).unwrap();
        assert!(dim < peak && night.at(8.0, 0.0) < 0.5 * day.at(8.0, 0.0));
        // Oblique gratings are seen less.
        assert!(day.at(16.0, std::f64::consts::FRAC_PI_4) < 0.9 * day.at(16.0, 0.0));
        assert_eq!(day.at(0.0, 0.0), 0.0);
    }

    #[test]
    fn response_is_compressive() {
        for l in [0.1, 1.0, 10.0, 100.0, 1000.0] {
            let slope = (response(l * 1.001) / response(l)).ln() / 1.001_f64.ln();
            assert!((slope - response_slope(l)).abs() < 1e-3 && slope < 0.37, "{l}");
        }
        assert!(response(1e9) > 0.99);
    }
}
