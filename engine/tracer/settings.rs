//! Settings of the path tracer.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{
    Error, Result,
    settings::{Described, described},
    shaders::consts,
};

/// Which light sources are used. The others neither light surfaces nor are visible.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Sources {
    #[default]
    /// All light sources.
    All,
    /// Point, spot and directional lights.
    Punctual,
    /// Emissive and unlit surfaces.
    Emissive,
    /// The environment.
    Environment,
}

impl Sources {
    pub(super) fn punctual(self) -> bool {
        matches!(self, Self::All | Self::Punctual)
    }

    pub(super) fn emissive(self) -> bool {
        matches!(self, Self::All | Self::Emissive)
    }

    pub(super) fn environment(self) -> bool {
        matches!(self, Self::All | Self::Environment)
    }
}

/// Position of a camera ray within its pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Filter {
    /// Random, uniform over the pixel: the picture is box-filtered.
    #[default]
    Box,
    /// The pixel's centre, as in rasterisation.
    Centre,
}

/// Sampling strategy for lights with an extent. [`Strategy::Mis`] is meant for pictures; the others are for tests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Strategy {
    /// Both light and BSDF sampling, combined by multiple importance sampling with the power heuristic.
    #[default]
    Mis,
    /// Light sampling only.
    Lights,
    /// BSDF sampling only.
    Bsdf,
}

/// The random numbers that choose the directions of paths.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Points {
    /// Scrambled Sobol points, which need fewer samples for the same error. The estimated error is then too large.
    #[default]
    Sobol,
    /// Independent random numbers.
    Random,
}

/// Settings of a picture. The same settings give bit-identical results on the same device.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Maximum of scatterings after the first surface. 0: direct light only; 1: the light that one pass of image-space radiosity models.
    #[schemars(extend("x-option" = "Quality"))]
    // After as many bounces the light is far below the rounding error.
    #[schemars(range(min = 0, max = 1000))]
    pub bounces: u32,
    /// Maximum of mirrors and glass surfaces along a path, in addition to `bounces`.
    #[schemars(range(min = 0, max = 1000))]
    pub specular_bounces: u32,
    /// Number of scatterings before Russian roulette begins. Roulette may end a path that carries less than a quarter of its first light.
    #[schemars(range(min = 0, max = 1000))]
    pub roulette: u32,
    /// Every surface is Lambertian: without gloss, mirrors and glass.
    pub diffuse_only: bool,
    /// The light sources that are used.
    pub sources: Sources,
    /// Position of a camera ray within its pixel.
    pub filter: Filter,
    /// Sampling of lights that have an extent.
    pub strategy: Strategy,
    /// The random numbers that choose the directions of paths.
    pub points: Points,
    /// The planned number of samples per pixel, rounded up to a power of two. If a picture has as many samples, the errors of
    /// neighbouring pixels have opposite signs (blue noise). 0: no plan; the pixels are independent, and any number of samples is as
    /// good.
    #[schemars(range(min = 0, max = 65536), extend("x-needs" = {"points": {"const": "sobol"}}))]
    pub planned: u32,
    /// Seed of all random numbers.
    #[schemars(extend("x-option" = "Picture"))]
    #[schemars(range(min = 0, max = 4_294_967_295_u32))]
    pub seed: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            bounces: 8,
            specular_bounces: 8,
            roulette: 0,
            diffuse_only: false,
            sources: Sources::All,
            filter: Filter::Box,
            strategy: Strategy::Mis,
            points: Points::Sobol,
            planned: 0,
            seed: 0,
        }
    }
}

impl Settings {
    /// # Errors
    /// `Usage`, naming the key, the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        Self::description().check(self)
    }

    /// `plan` of `lib/points.glsl`.
    pub(super) fn plan(&self) -> u32 {
        match (self.points, self.planned) {
            (Points::Random, _) => consts::POINTS_RANDOM,
            (Points::Sobol, 0) => consts::POINTS_APART,
            (Points::Sobol, planned) => planned.next_power_of_two().ilog2(),
        }
    }
}

described!(Settings);

/// The settings of a frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PictureSettings {
    /// Paths per pixel that a frame adds, 1 to 65536. Frames of the same pose, view and settings add to one picture.
    pub samples: u32,
    pub reference: Settings,
}

impl Default for PictureSettings {
    fn default() -> Self {
        Self { samples: 16, reference: Settings::default() }
    }
}

/// Maximum of paths per pixel in one frame.
const MOST_SAMPLES: u32 = 1 << 16;

impl PictureSettings {
    /// # Errors
    /// `Usage`, naming the key, the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        if !(1..=MOST_SAMPLES).contains(&self.samples) {
            let what = format!("{} is not allowed; allowed: 1 to {MOST_SAMPLES}", self.samples);
            return Err(Error::usage(what).at("samples"));
        }
        self.reference.validate().map_err(|error| error.at("reference"))
    }
}
