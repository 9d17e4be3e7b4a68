//! The weather of a day, and the direct beam of the sun after its way through the atmosphere.
//!
//! # Units
//! Colours are linear Rec.709 (primaries of ITU-R BT.709, white point D65). Their luminance channel is Y = 0.2126 R +
//! 0.7152 G + 0.0722 B. Values are photopic quantities on a broadband-like scale: one factor scales them such that
//! the sun outside the atmosphere has Y = 1361 W/m², the total solar irradiance (G. Kopp, J. Lean, Geophysical
//! Research Letters 38, 2011; IAU 2015 resolution B3). Y is therefore a luminance or an illuminance that is divided
//! by one constant luminous efficacy, [`luminous_efficacy`] (about 94 lm/W). Y times that efficacy gives lux or
//! cd/m²; the sun outside the atmosphere has 128 klx. Y isn't the power over the whole solar spectrum: the infrared
//! part of the beam and the low infrared part of the blue sky aren't modelled, so Y of the clear sky is above its
//! broadband irradiance.

use serde::{Deserialize, Serialize};

/// The angular radius of the sun in radians: half of 0.533 degrees.
pub const SUN_ANGULAR_RADIUS: f64 = 0.2665 * std::f64::consts::PI / 180.0;

/// The total solar irradiance at the mean distance from the sun, in W/m². The yearly change of the distance (±3.4 % in
/// irradiance) is left out.
pub const SOLAR_CONSTANT: f64 = 1361.0;

/// The peak luminous efficacy of radiation in lm/W, at 555 nm.
const PEAK_EFFICACY: f64 = 683.0;

/// The first wavelength and the step of the tables, in micrometres.
const FIRST_WAVELENGTH: f64 = 0.38;
const WAVELENGTH_STEP: f64 = 0.01;

/// The spectral radiance of the sun outside the atmosphere from 380 nm to 750 nm in W/(cm² µm sr) (A. Preetham,
/// P. Shirley, B. Smits, "A Practical Analytic Model for Daylight", SIGGRAPH 1999, table 2).
const SUN_RADIANCE: [f64; 38] = [
    1655.9, 1623.37, 2112.75, 2588.82, 2582.91, 2423.23, 2676.05, 2965.83, 3054.54, 3005.75, 3066.37, 2883.04, 2871.21,
    2782.5, 2710.06, 2723.36, 2636.13, 2550.38, 2506.02, 2531.16, 2535.59, 2513.42, 2463.15, 2417.32, 2368.53, 2321.21,
    2282.77, 2233.98, 2197.02, 2152.67, 2109.79, 2072.83, 2024.04, 1987.08, 1942.72, 1907.24, 1862.89, 1825.92,
];

/// The absorption coefficient of ozone in 1/cm at the same wavelengths (same table).
const OZONE_ABSORPTION: [f64; 38] = [
    0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.003, 0.006, 0.009, 0.014, 0.021, 0.03, 0.04, 0.048, 0.063, 0.075, 0.085,
    0.103, 0.12, 0.12, 0.115, 0.125, 0.12, 0.105, 0.09, 0.079, 0.067, 0.057, 0.048, 0.036, 0.028, 0.023, 0.018, 0.014,
    0.011, 0.01, 0.009,
];

/// The amount of ozone in cm at standard temperature and pressure (same paper, appendix A.1).
const OZONE_AMOUNT: f64 = 0.35;

/// The weather of a day.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Weather {
    turbidity: f64,
    ground_albedo: f64,
    overcast: f64,
}

impl Default for Weather {
    /// A clear day: turbidity 3, ground albedo 0.3, no clouds.
    fn default() -> Weather {
        Weather { turbidity: 3.0, ground_albedo: 0.3, overcast: 0.0 }
    }
}

impl Weather {
    /// Makes a weather.
    ///
    /// - `turbidity`: the haze, from 1 (pure air) to 10 (strong haze).
    /// - `ground_albedo`: the diffuse reflectance of the ground, from 0 to 1.
    /// - `overcast`: the share of the CIE overcast sky, from 0 (clear) to 1 (overcast).
    ///
    /// # Errors
    /// A value outside its range is an error.
    pub fn new(turbidity: f64, ground_albedo: f64, overcast: f64) -> Result<Weather, String> {
        if !(1.0..=10.0).contains(&turbidity) {
            return Err(format!(
                "The turbidity is {turbidity}, but it must be from 1 (pure air) to 10 (strong haze). Use 3 for a clear \
                 day."
            ));
        }
        if !(0.0..=1.0).contains(&ground_albedo) {
            return Err(format!(
                "The ground albedo is {ground_albedo}, but it must be from 0 to 1. Use 0.2 for grass and 0.8 for fresh \
                 snow."
            ));
        }
        if !(0.0..=1.0).contains(&overcast) {
            return Err(format!(
                "The overcast share is {overcast}, but it must be from 0 (clear) to 1 (overcast). Use 0 for a clear sky."
            ));
        }
        Ok(Weather { turbidity, ground_albedo, overcast })
    }

    /// The turbidity, from 1 to 10.
    pub fn turbidity(&self) -> f64 {
        self.turbidity
    }

    /// The albedo of the ground, from 0 to 1.
    pub fn ground_albedo(&self) -> f64 {
        self.ground_albedo
    }

    /// The share of the overcast sky, from 0 to 1.
    pub fn overcast(&self) -> f64 {
        self.overcast
    }
}

/// The irradiance of the direct beam on a surface perpendicular to the sun, for an apparent elevation of the sun's
/// centre in degrees. The unit is that of the module.
///
/// The value is the clear beam ([`clear_beam`]) times the share of the disc above the horizon ([`visible_share`])
/// times (1 - overcast). It is 0 for an elevation of -0.2665° or less.
pub fn sun_irradiance(weather: Weather, elevation: f64) -> [f32; 3] {
    let share = visible_share(elevation) * (1.0 - weather.overcast);
    clear_beam(weather.turbidity, elevation).map(|value| (value * share) as f32)
}

/// The share of the area of the sun's disc above the horizon, for an elevation of its centre in degrees.
///
/// With x = elevation / radius in [-1, 1] the share is (arccos(-x) + x √(1 - x²)) / π.
pub fn visible_share(elevation: f64) -> f64 {
    let x = (elevation.to_radians() / SUN_ANGULAR_RADIUS).clamp(-1.0, 1.0);
    ((-x).acos() + x * (1.0 - x * x).sqrt()) / std::f64::consts::PI
}

/// The irradiance of the whole disc in a clear sky on a surface perpendicular to the sun, linear Rec.709 in the unit of
/// the module, for a turbidity from 1 to 10 and an apparent elevation in degrees. Elevations below -0.2665° give the
/// value at -0.2665°.
///
/// The spectrum from 380 nm to 750 nm is attenuated at each wavelength λ (µm) by exp(-m τ(λ)), where m is the relative
/// air mass and τ = τR + τA + τO (Preetham et al. 1999, appendix A.1):
/// - molecules: τR = 0.008735 λ^-4.08,
/// - aerosol: τA = β λ^-1.3 with β = 0.04608 T - 0.04586 (Ångström),
/// - ozone: τO = 0.35 cm times the absorption coefficient.
///
/// Water vapour and mixed gases absorb outside the photopic range and are left out. The air mass is that of F. Kasten
/// and A. Young (Applied Optics 28, 1989): m = 1 / (sin h + 0.50572 (h + 6.07995)^-1.6364), h in degrees. Channels
/// that leave the gamut of Rec.709 at a low sun are clamped to 0.
pub fn clear_beam(turbidity: f64, elevation: f64) -> [f64; 3] {
    let h = elevation.clamp(-SUN_ANGULAR_RADIUS.to_degrees(), 90.0);
    let mass = 1.0 / (h.to_radians().sin() + 0.50572 * (h + 6.07995).powf(-1.6364));
    let beta = 0.04608 * turbidity - 0.04586;
    let xyz = integrate(|i, wavelength| {
        let rayleigh = 0.008735 * wavelength.powf(-4.08);
        let aerosol = beta * wavelength.powf(-1.3);
        (-mass * (rayleigh + aerosol + OZONE_AMOUNT * OZONE_ABSORPTION[i])).exp()
    });
    let scale = photopic_scale();
    xyz_to_rec709(xyz).map(|value| (value * scale).max(0.0))
}

/// The factor from a photopic quantity ∫ E(λ) ȳ(λ) dλ, in W/m², to the unit of the module: [`SOLAR_CONSTANT`] divided
/// by that integral over the sun outside the atmosphere. It is about 7.26.
pub fn photopic_scale() -> f64 {
    SOLAR_CONSTANT / integrate(|_, _| 1.0)[1]
}

/// The luminous efficacy in lm/W that turns Y of the module's unit into lux or cd/m²: 683 lm/W divided by
/// [`photopic_scale`].
pub fn luminous_efficacy() -> f64 {
    PEAK_EFFICACY / photopic_scale()
}

/// The tristimulus values X, Y, Z in W/m² of the sun's spectrum times a transmittance that is given for each index and
/// wavelength (µm). The solid angle of the disc turns radiance into irradiance.
fn integrate(transmittance: impl Fn(usize, f64) -> f64) -> [f64; 3] {
    let solid_angle = std::f64::consts::TAU * (1.0 - SUN_ANGULAR_RADIUS.cos());
    let mut xyz = [0.0; 3];
    for (i, radiance) in SUN_RADIANCE.iter().enumerate() {
        let wavelength = FIRST_WAVELENGTH + WAVELENGTH_STEP * i as f64;
        // 1 W/cm² is 10⁴ W/m², and the step is in micrometres as the radiance is.
        let power = radiance * 1e4 * solid_angle * WAVELENGTH_STEP * transmittance(i, wavelength);
        for (sum, response) in xyz.iter_mut().zip(colour_matching(wavelength * 1000.0)) {
            *sum += power * response;
        }
    }
    xyz
}

/// The colour matching functions of the CIE 1931 standard observer at a wavelength in nm, by the fit of C. Wyman,
/// P. Sloan and P. Shirley ("Simple Analytic Approximations to the CIE XYZ Color Matching Functions", JCGT 2(2), 2013,
/// equation 4).
fn colour_matching(wavelength: f64) -> [f64; 3] {
    let lobe = |mean: f64, below: f64, above: f64| {
        let t = (wavelength - mean) * if wavelength < mean { below } else { above };
        (-0.5 * t * t).exp()
    };
    [
        0.362 * lobe(442.0, 0.0624, 0.0374) + 1.056 * lobe(599.8, 0.0264, 0.0323) - 0.065 * lobe(501.1, 0.0490, 0.0382),
        0.821 * lobe(568.8, 0.0213, 0.0247) + 0.286 * lobe(530.9, 0.0613, 0.0322),
        1.217 * lobe(437.0, 0.0845, 0.0278) + 0.681 * lobe(459.0, 0.0385, 0.0725),
    ]
}

/// Linear Rec.709 from XYZ (IEC 61966-2-1).
fn xyz_to_rec709([x, y, z]: [f64; 3]) -> [f64; 3] {
    [3.2406 * x - 1.5372 * y - 0.4986 * z, -0.9689 * x + 1.8758 * y + 0.0415 * z, 0.0557 * x - 0.2040 * y + 1.0570 * z]
}
