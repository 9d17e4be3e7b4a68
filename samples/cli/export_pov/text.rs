//! Numbers, vectors and comments in a scene file, and the formulas for its lights.

use glam::Vec3;

/// Distance at which POV-Ray's `fade_power 2` begins, in units of the file. Its attenuation 2 / (1 + (d/f)²) is the inverse
/// square but for a share (f/d)².
pub const FADE: f64 = 1e-3;

/// `<x,y,z>`; values that are not finite become 0.
pub fn vector(v: Vec3) -> String {
    let [x, y, z] = v.to_array().map(number);
    format!("<{x},{y},{z}>")
}

/// The shortest text that reads back as the same number; POV-Ray knows no other values than finite ones.
pub fn number(x: f32) -> String {
    let x = if x.is_finite() { x + 0.0 } else { 0.0 };
    if x != 0.0 && (x.abs() < 1e-4 || x.abs() >= 1e7) { format!("{x:e}") } else { format!("{x}") }
}

/// Text that stays within a line comment.
pub fn comment(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// Number of units per metre: a power of ten such that the scene is at least 10 units large. POV-Ray ignores hits within a thousandth of a
/// unit, because it takes them for the surface itself.
pub fn units_per_metre(diagonal: f32) -> f32 {
    let mut units = 1.0;
    while diagonal * units < 10.0 && units < 1e6 {
        units *= 10.0;
    }
    units
}

/// Colour of a light with `fade_distance` [`FADE`] and `fade_power 2` that has `intensity` W/sr.
///
/// POV-Ray reflects pigment · diffuse · colour · attenuation · cos θ, without 1/π. Ours is ρ/π · I/d² · cos θ, with d in metres:
/// colour · 2 f² / d_u² = I / (π d²) gives colour = I u² / (2 π f²), u units a metre.
pub fn fading(intensity: Vec3, units: f32) -> Vec3 {
    let factor = f64::from(units).powi(2) / (2.0 * std::f64::consts::PI * FADE * FADE);
    intensity * factor as f32
}

/// Colour of a light that does not fade and gives `irradiance` W/m² on a facing plane.
pub fn parallel(irradiance: Vec3) -> Vec3 {
    irradiance / std::f32::consts::PI
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_finite_and_read_back() {
        for x in [0.0f32, -0.0, 1.5, -3.25e-9, 1e30, 0.1, 123456.78, f32::MIN_POSITIVE] {
            assert_eq!(number(x).parse::<f32>(), Ok(x), "{x}");
        }
        assert_eq!(vector(Vec3::new(f32::NAN, f32::INFINITY, 1.0)), "<0,0,1>");
        assert_eq!(comment("a\n#include \"x\""), "a #include \"x\"");
    }

    #[test]
    fn the_fade_is_the_inverse_square() {
        for (units, metres) in [(1.0f32, 2.0f64), (100.0, 0.05)] {
            let colour = f64::from(fading(Vec3::splat(7.0), units).x);
            let attenuation = 2.0 / (1.0 + (metres * f64::from(units) / FADE).powi(2));
            let wanted = 7.0 / (std::f64::consts::PI * metres * metres);
            assert!((colour * attenuation / wanted - 1.0).abs() < 1e-6);
        }
    }
}
