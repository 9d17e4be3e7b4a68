//! Published spectra of the box and their conversion to linear Rec. 709.

use glam::{DMat3, DVec3, Vec3};

/// Measured reflectance of the white paint, 400 to 700 nm in steps of 4 nm.
pub const WHITE: [f32; 76] = [
    0.343, 0.445, 0.551, 0.624, 0.665, 0.687, 0.708, 0.723, 0.715, 0.71, 0.745, 0.758, 0.739, 0.767, 0.777, 0.765,
    0.751, 0.745, 0.748, 0.729, 0.745, 0.757, 0.753, 0.75, 0.746, 0.747, 0.735, 0.732, 0.739, 0.734, 0.725, 0.721,
    0.733, 0.725, 0.732, 0.743, 0.744, 0.748, 0.728, 0.716, 0.733, 0.726, 0.713, 0.74, 0.754, 0.764, 0.752, 0.736,
    0.734, 0.741, 0.74, 0.732, 0.745, 0.755, 0.751, 0.744, 0.731, 0.733, 0.744, 0.731, 0.712, 0.708, 0.729, 0.73,
    0.727, 0.707, 0.703, 0.729, 0.75, 0.76, 0.751, 0.739, 0.724, 0.73, 0.74, 0.737,
];
/// Measured reflectance of the green paint, 400 to 700 nm in steps of 4 nm.
pub const GREEN: [f32; 76] = [
    0.092, 0.096, 0.098, 0.097, 0.098, 0.095, 0.095, 0.097, 0.095, 0.094, 0.097, 0.098, 0.096, 0.101, 0.103, 0.104,
    0.107, 0.109, 0.112, 0.115, 0.125, 0.14, 0.16, 0.187, 0.229, 0.285, 0.343, 0.39, 0.435, 0.464, 0.472, 0.476, 0.481,
    0.462, 0.447, 0.441, 0.426, 0.406, 0.373, 0.347, 0.337, 0.314, 0.285, 0.277, 0.266, 0.25, 0.23, 0.207, 0.186,
    0.171, 0.16, 0.148, 0.141, 0.136, 0.13, 0.126, 0.123, 0.121, 0.122, 0.119, 0.114, 0.115, 0.117, 0.117, 0.118, 0.12,
    0.122, 0.128, 0.132, 0.139, 0.144, 0.146, 0.15, 0.152, 0.157, 0.159,
];
/// Measured reflectance of the red paint, 400 to 700 nm in steps of 4 nm.
pub const RED: [f32; 76] = [
    0.04, 0.046, 0.048, 0.053, 0.049, 0.05, 0.053, 0.055, 0.057, 0.056, 0.059, 0.057, 0.061, 0.061, 0.06, 0.062, 0.062,
    0.062, 0.061, 0.062, 0.06, 0.059, 0.057, 0.058, 0.058, 0.058, 0.056, 0.055, 0.056, 0.059, 0.057, 0.055, 0.059,
    0.059, 0.058, 0.059, 0.061, 0.061, 0.063, 0.063, 0.067, 0.068, 0.072, 0.08, 0.09, 0.099, 0.124, 0.154, 0.192,
    0.255, 0.287, 0.349, 0.402, 0.443, 0.487, 0.513, 0.558, 0.584, 0.62, 0.606, 0.609, 0.651, 0.612, 0.61, 0.65, 0.638,
    0.627, 0.62, 0.63, 0.628, 0.642, 0.639, 0.657, 0.639, 0.635, 0.642,
];

/// Published emission of the lamp at 400, 500, 600 and 700 nm, relative units.
pub const EMISSION: [f32; 4] = [0.0, 8.0, 15.6, 18.4];

/// CIE standard illuminant D65, 400 to 700 nm in steps of 10 nm (ISO/CIE 11664-2), relative power.
const D65: [f64; 31] = [
    82.7549, 91.486, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923, 108.811, 109.354, 107.802, 104.79,
    107.689, 104.405, 104.046, 100.0, 96.3342, 95.788, 88.6856, 90.0062, 89.5991, 87.6987, 83.2886, 83.6992, 80.0268,
    80.2146, 82.2778, 78.2842, 69.7213, 71.6091,
];

/// Linear Rec. 709 albedo of a reflectance spectrum (400 to 700 nm in steps of 4 nm) under D65, scaled so that a perfect
/// white is exactly (1, 1, 1).
pub fn reflectance(spectrum: &[f32; 76]) -> Vec3 {
    let seen = |reflect: &dyn Fn(usize) -> f64| {
        (0..76).map(|i| observer(wavelength(i)) * reflect(i) * sample(&D65, 10.0, wavelength(i))).sum::<DVec3>()
    };
    let rgb = rec709_from_xyz() * seen(&|i| f64::from(spectrum[i]));
    (rgb / (rec709_from_xyz() * seen(&|_| 1.0))).as_vec3()
}

/// Radiance of the lamp in linear Rec. 709, W/(sr·m²): the published numbers are taken as spectral radiance in units in
/// which the constant spectrum 1 has luminance 1.
pub fn emission() -> Vec3 {
    let table = EMISSION.map(f64::from);
    let xyz: DVec3 = (0..76).map(|i| observer(wavelength(i)) * sample(&table, 100.0, wavelength(i))).sum();
    let white: f64 = (0..76).map(|i| observer(wavelength(i)).y).sum();
    (rec709_from_xyz() * (xyz / white)).max(DVec3::ZERO).as_vec3()
}

fn wavelength(index: usize) -> f64 {
    400.0 + 4.0 * index as f64
}

/// Linear interpolation in a table that starts at 400 nm.
fn sample(table: &[f64], step: f64, wavelength: f64) -> f64 {
    let at = ((wavelength - 400.0) / step).clamp(0.0, (table.len() - 1) as f64);
    let low = (at as usize).min(table.len() - 2);
    table[low] + (table[low + 1] - table[low]) * (at - low as f64)
}

/// CIE 1931 colour matching functions by the multi-lobe fit of Wyman, Sloan and Shirley, "Simple Analytic
/// Approximations to the CIE XYZ Color Matching Functions", JCGT 2(2), 2013.
fn observer(nm: f64) -> DVec3 {
    let lobe = |height: f64, centre: f64, left: f64, right: f64| {
        let t = (nm - centre) * if nm < centre { left } else { right };
        height * (-0.5 * t * t).exp()
    };
    DVec3::new(
        lobe(0.362, 442.0, 0.0624, 0.0374) + lobe(1.056, 599.8, 0.0264, 0.0323) + lobe(-0.065, 501.1, 0.049, 0.0382),
        lobe(0.821, 568.8, 0.0213, 0.0247) + lobe(0.286, 530.9, 0.0613, 0.0322),
        lobe(1.217, 437.0, 0.0845, 0.0278) + lobe(0.681, 459.0, 0.0385, 0.0725),
    )
}

/// IEC 61966-2-1.
fn rec709_from_xyz() -> DMat3 {
    DMat3::from_cols(
        DVec3::new(3.240_625_5, -0.968_930_7, 0.055_710_1),
        DVec3::new(-1.537_208, 1.875_756_1, -0.204_021_1),
        DVec3::new(-0.498_628_6, 0.041_517_5, 1.056_995_9),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn observer_and_matrix_give_the_values_that_other_renderers_ship() {
        // The sRGB numbers of the Cornell box in Mitsuba's scene files: equal-energy light, no adaptation.
        let white: f64 = (0..76).map(|i| observer(wavelength(i)).y).sum();
        for (spectrum, expected) in [
            (WHITE, DVec3::new(0.885_809, 0.698_859, 0.666_422)),
            (GREEN, DVec3::new(0.105_421, 0.377_98, 0.076_425)),
            (RED, DVec3::new(0.570_068, 0.043_013_5, 0.044_370_6)),
        ] {
            let xyz: DVec3 = (0..76).map(|i| observer(wavelength(i)) * f64::from(spectrum[i])).sum();
            let found = rec709_from_xyz() * (xyz / white);
            assert!((found - expected).abs().max_element() < 6e-3, "{found} is not {expected}");
        }
    }
}
