//! The radiance of a physical sky with a clear part, an overcast part and the ground below the horizon.
//!
//! The frame is right-handed with +Y up. The unit is that of the module `beam`: linear Rec.709, broadband-like W/m² for
//! irradiance and W/(m² sr) for radiance. The sun's disc isn't part of the radiance; it is a light of its own, see
//! [`sun_irradiance`].
//!
//! # The clear sky
//! The clear part is the model of L. Hosek and A. Wilkie ("An Analytic Model for Full Spectral Sky-Dome Radiance", ACM
//! Transactions on Graphics 31(4), 2012) in the RGB form of the crate `hw-skymodel`. The luminance channel of its
//! output is taken as ∫ L(λ) ȳ(λ) dλ in W/(m² sr), that is tristimulus values of the authors' spectral radiance without
//! the factor 683 lm/W. The data carries no statement of its unit. This reading is the one of other renderers, and it
//! gives plausible values: a horizontal illuminance of 19 klx for turbidity 3, ground albedo 0.3 and a sun at 60°. The
//! output is multiplied by [`photopic_scale`] (about 7.26), which is the same factor that the direct beam has. The sun
//! and the sky are therefore consistent as photopic quantities. They share the turbidity, but they are independent fits.
//! For that sun, Y of the direct beam is 932 W/m² and diffuse / global is 0.20. Negative values of the fit are clamped
//! to 0.
//!
//! The model depends on the cube root of the elevation, which has an infinite slope at 0. The model therefore gets an
//! elevation of at least [`MIN_MODEL_ELEVATION`]. Below the horizon the sky at that elevation, towards the azimuth of the
//! sun, is scaled by [`twilight`]. Near sunrise and sunset the model is brighter than measured skies: its illuminance at
//! elevation 0 is about 2.5 klx, where the source of the twilight formula has 0.76 klx.
//!
//! # The overcast sky
//! The overcast part is the CIE overcast sky: L = Lz (1 + 2 sin γ) / 3 at altitude γ (CIE S 011, type 16; P. Moon,
//! D. Spencer, 1942). Its horizontal irradiance is E = 7π/9 Lz. E is a quarter of Y of the global horizontal irradiance
//! of the clear sky at the same sun, which is the formula of F. Kasten and G. Czeplak (Solar Energy 24, 1980)
//! G = G0 (1 - 0.75 (N/8)^3.4) at full cloud cover N = 8. Its colour is that of D65, so the three channels are equal.
//!
//! # The mixture
//! The radiance is (1 - o) clear + o overcast with o the overcast share of the weather. The direct beam is scaled by
//! (1 - o). The ground reflects diffusely: L = albedo / π times the global horizontal irradiance.

use super::beam::{Weather, clear_beam, photopic_scale, sun_irradiance, visible_share};
use super::patch::{GROUND_PATCH, PATCHES, ROW_STARTS, mean_sine, patch_direction, patch_samples, patch_solid_angle};
use hw_skymodel::rgb::{Channel, SkyParams, SkyState};
use std::f64::consts::PI;

/// The lowest elevation of the sun, in degrees, that the clear sky model is evaluated at.
pub const MIN_MODEL_ELEVATION: f64 = 0.1;

/// The elevation of the sun, in degrees, at which the light of the sky reaches 0: the end of civil twilight.
pub const TWILIGHT_END: f64 = -6.0;

/// The cosine of the angle around the sun, 30°, within which patches are integrated with many points.
const NEAR_SUN: f64 = 0.866_025_403_784_438_6;

/// The share of the clear-sky irradiance that a fully clouded sky passes (Kasten and Czeplak 1980).
const OVERCAST_TRANSMITTANCE: f64 = 0.25;

/// A sky for one weather and one position of the sun.
#[derive(Clone, Debug)]
pub struct Sky {
    weather: Weather,
    /// The elevation of the sun in degrees.
    elevation: f64,
    /// The clear sky model, or `None` when twilight has ended.
    model: Option<SkyState>,
    /// The unit vector towards the sun, raised to the lowest elevation of the model.
    model_sun: [f64; 3],
    /// The factor on the model's output: the photopic scale times the twilight.
    model_scale: f64,
    sun: [f32; 3],
    integrals: Clear,
    overcast_zenith: f64,
    diffuse_horizontal: [f64; 3],
    global_horizontal: [f64; 3],
    patches: Vec<[f32; 3]>,
}

/// The integrals of the clear part of a sky.
#[derive(Clone, Debug, Default)]
struct Clear {
    /// The mean radiance of each sky patch.
    patches: Vec<[f64; 3]>,
    /// The irradiance of the sky on a horizontal surface.
    diffuse: [f64; 3],
    /// The irradiance of the sun and the sky on a horizontal surface.
    global: [f64; 3],
}

impl Sky {
    /// Makes the sky for a weather and a direction towards the sun (any length, Y up). The direction has the apparent
    /// elevation, as `Sun::direction` of the module `day` gives it.
    ///
    /// # Errors
    /// A direction of length zero and a direction that isn't finite are errors.
    pub fn new(weather: Weather, sun_direction: [f64; 3]) -> Result<Sky, String> {
        let [x, y, z] = sun_direction;
        let horizontal = x.hypot(z);
        let length = horizontal.hypot(y);
        if !(length.is_finite() && length > 0.0) {
            return Err(format!(
                "The direction towards the sun is [{x}, {y}, {z}], but it must be finite and longer than 0. Give a \
                 vector with +Y up, for example [0, 1, 0]."
            ));
        }
        let elevation = y.atan2(horizontal).to_degrees();
        // The azimuth doesn't matter at the zenith; -Z stands for it.
        let (side, depth) = if horizontal > 0.0 { (x / horizontal, z / horizontal) } else { (0.0, -1.0) };
        let model_elevation = elevation.max(MIN_MODEL_ELEVATION).to_radians();
        let (sine, cosine) = model_elevation.sin_cos();
        let fade = twilight(elevation);
        let model = if fade > 0.0 { Some(model(weather, model_elevation)?) } else { None };
        let mut sky = Sky {
            weather,
            elevation,
            model,
            model_sun: [side * cosine, sine, depth * cosine],
            model_scale: photopic_scale() * fade,
            sun: sun_irradiance(weather, elevation),
            integrals: Clear::default(),
            overcast_zenith: 0.0,
            diffuse_horizontal: [0.0; 3],
            global_horizontal: [0.0; 3],
            patches: vec![[0.0; 3]; PATCHES],
        };
        sky.integrals = sky.integrate();
        sky.mix();
        Ok(sky)
    }

    /// The same sky with another overcast share, 0 to 1: what [`Sky::new`] gives for that weather, without integrating
    /// the clear part again.
    ///
    /// # Errors
    /// A share outside its range is an error.
    pub fn with_overcast(&self, overcast: f64) -> Result<Sky, String> {
        let weather = Weather::new(self.weather.turbidity(), self.weather.ground_albedo(), overcast)?;
        let elevation = self.elevation;
        let mut sky = Sky { weather, sun: sun_irradiance(weather, elevation), ..self.clone() };
        sky.mix();
        Ok(sky)
    }

    /// The radiance from a direction (any length, pointing away from the observer) in linear Rec.709, without the sun's
    /// disc. A direction of length zero, or one that isn't finite, gives the ground.
    pub fn radiance(&self, direction: [f32; 3]) -> [f32; 3] {
        let [x, y, z] = direction.map(f64::from);
        let length = (x * x + y * y + z * z).sqrt();
        let direction = [x / length, y / length, z / length];
        if direction[1].is_nan() || direction[1] < 0.0 {
            return self.ground();
        }
        self.mixed(self.clear(direction), direction[1]).map(|value| value as f32)
    }

    /// The radiance of the ground: albedo / π times the global horizontal irradiance.
    pub fn ground(&self) -> [f32; 3] {
        self.global_horizontal.map(|value| (self.weather.ground_albedo() / PI * value) as f32)
    }

    /// The irradiance of the direct beam on a surface perpendicular to the sun; see [`sun_irradiance`].
    pub fn sun_irradiance(&self) -> [f32; 3] {
        self.sun
    }

    /// The irradiance of the sky, without the sun, on a horizontal surface.
    pub fn diffuse_horizontal(&self) -> [f32; 3] {
        self.diffuse_horizontal.map(|value| value as f32)
    }

    /// The irradiance of the sun and the sky on a horizontal surface.
    pub fn global_horizontal(&self) -> [f32; 3] {
        self.global_horizontal.map(|value| value as f32)
    }

    /// The mean radiance of each patch of the module `patch`, [`PATCHES`] values. The mean is that of a grid of cells of
    /// equal solid angle: 12 × 12 where the centre of the patch is within 30° of the sun, else 12 of altitude × 4 of
    /// azimuth in the lowest row, where the haze brightens towards the horizon, and 4 × 4 elsewhere. A channel differs from
    /// the mean of a fine grid by at most 0.5 % of the patch's luminance, and all patches together carry the energy of the
    /// model to 0.1 %. A horizontal irradiance that is computed
    /// from the patches differs by up to 4 % when a low sun is in haze, because a patch has one radiance for 12° of altitude.
    pub fn patches(&self) -> Vec<[f32; 3]> {
        self.patches.clone()
    }

    /// The rows of altitude and the columns of azimuth of the grid that a patch is integrated with.
    fn grid(&self, patch: usize) -> [usize; 2] {
        let centre = patch_direction(patch).map(f64::from);
        let along: f64 = (0..3).map(|i| centre[i] * self.model_sun[i]).sum();
        if along > NEAR_SUN {
            [12, 12]
        } else if patch < ROW_STARTS[1] {
            [12, 4]
        } else {
            [4, 4]
        }
    }

    /// Integrates the clear part.
    fn integrate(&self) -> Clear {
        let mut patches = vec![[0.0; 3]; GROUND_PATCH];
        let mut diffuse = [0.0; 3];
        for (patch, mean) in patches.iter_mut().enumerate() {
            let grid = self.grid(patch);
            let points = (grid[0] * grid[1]) as f64;
            let weight = patch_solid_angle(patch) / points;
            for direction in patch_samples(patch, grid) {
                let radiance = self.clear(direction);
                for channel in 0..3 {
                    mean[channel] += radiance[channel] / points;
                    diffuse[channel] += radiance[channel] * direction[1] * weight;
                }
            }
        }
        let beam = clear_beam(self.weather.turbidity(), self.elevation);
        let projected = visible_share(self.elevation) * self.elevation.to_radians().sin().max(0.0);
        Clear { patches, diffuse, global: [0, 1, 2].map(|i| diffuse[i] + beam[i] * projected) }
    }

    /// Mixes the clear part and the overcast part: the irradiances and the patches.
    fn mix(&mut self) {
        let overcast = OVERCAST_TRANSMITTANCE * luminance(self.integrals.global);
        self.overcast_zenith = overcast * 9.0 / (7.0 * PI);
        let share = self.weather.overcast();
        let mixed = |clear: [f64; 3]| clear.map(|value| (1.0 - share) * value + share * overcast);
        self.diffuse_horizontal = mixed(self.integrals.diffuse);
        self.global_horizontal = mixed(self.integrals.global);
        for patch in 0..GROUND_PATCH {
            self.patches[patch] = self.mixed(self.integrals.patches[patch], mean_sine(patch)).map(|value| value as f32);
        }
        self.patches[GROUND_PATCH] = self.ground();
    }

    /// The radiance of the clear part for a unit direction above the horizon.
    fn clear(&self, direction: [f64; 3]) -> [f64; 3] {
        let Some(model) = &self.model else { return [0.0; 3] };
        let chord = (0..3).map(|i| (direction[i] - self.model_sun[i]).powi(2)).sum::<f64>().sqrt();
        let gamma = (2.0 * (0.5 * chord).min(1.0).asin()) as f32;
        let theta = direction[1].clamp(0.0, 1.0).acos() as f32;
        [Channel::R, Channel::G, Channel::B]
            .map(|channel| f64::from(model.radiance(theta, gamma, channel)).max(0.0) * self.model_scale)
    }

    /// The mixture of a clear radiance and the overcast radiance at an altitude with the given sine.
    fn mixed(&self, clear: [f64; 3], sine: f64) -> [f64; 3] {
        let share = self.weather.overcast();
        let overcast = self.overcast_zenith * (1.0 + 2.0 * sine) / 3.0;
        clear.map(|value| (1.0 - share) * value + share * overcast)
    }
}

/// The factor on the sky's light for an elevation of the sun in degrees: 1 from the horizon up, 0 from
/// [`TWILIGHT_END`] down.
///
/// With f(h) = exp(0.607 h - 0.0491 h²), the factor is (f(h) - f(-6)) / (1 - f(-6)). The function f fits the twilight
/// illuminance of P. Janiczek and J. DeYoung ("Computer Programs for Sun and Moon Illuminance", US Naval Observatory
/// Circular 171, 1987), relative to its value of 759 lx at the horizon: 0.104 at -3° and 0.0045 at -6°. The subtraction
/// makes the factor reach 0 at the end of civil twilight, so later twilight is dark.
pub fn twilight(elevation: f64) -> f64 {
    let curve = |h: f64| (0.607 * h - 0.0491 * h * h).exp();
    let end = curve(TWILIGHT_END);
    (curve(elevation.clamp(TWILIGHT_END, 0.0)) - end) / (1.0 - end)
}

/// The luminance channel Y of a linear Rec.709 colour.
pub fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// The state of the clear sky model for an elevation in radians.
fn model(weather: Weather, elevation: f64) -> Result<SkyState, String> {
    SkyState::new(&SkyParams {
        elevation: (elevation as f32).clamp(0.0, std::f32::consts::FRAC_PI_2),
        turbidity: weather.turbidity() as f32,
        albedo: [weather.ground_albedo() as f32; 3],
    })
    .map_err(|error| format!("The clear sky model refused its parameters: {error}."))
}
