//! Settings of bakes and of pictures.

use serde::{Deserialize, Serialize};

use super::{Adaptive, Comparison, Texels, Weather};
use crate::{
    Error, Result,
    passes::{gbuffer, shadow},
    settings::{Described, JsonSchema, described},
    technique,
};

/// Settings that decide the bytes of a bake.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Baking {
    /// Paths of each texel.
    #[schemars(range(min = 2, max = 1_048_576))]
    pub samples: u32,
    /// Maximum of scatterings between the sun and a texel.
    #[schemars(range(min = 1, max = 16))]
    pub bounces: u32,
    /// Number of scatterings before Russian roulette begins. Roulette may end a path that carries less than a quarter of its first light.
    #[schemars(range(min = 0, max = 16))]
    pub roulette: u32,
    /// Maximum of mirrors and glass surfaces along a path.
    #[schemars(range(min = 0, max = 64))]
    pub specular_bounces: u32,
    /// Every surface is Lambertian: without gloss, mirrors and glass. If off, gloss is taken as diffuse, so that its energy is kept.
    pub diffuse_only: bool,
    /// Time between two steps of the day.
    #[schemars(range(min = 0.1, max = 720), extend("x-unit" = "min"))]
    pub interval: f64,
    /// Time of the first step after midnight.
    #[schemars(range(min = 0, max = 720), extend("x-unit" = "min"))]
    pub offset: f64,
    /// How the steps are chosen. Light between the chosen steps is interpolated.
    pub adaptive: Adaptive,
    /// How frames are compared to choose steps.
    pub measure: Comparison,
    /// Difference of two frames that is noticeable: a share of the mean for `rms`, of the pixels for `pdiff`.
    #[schemars(range(min = 0, max = 1))]
    pub noticeable: f64,
    /// Longest time between two chosen steps.
    #[schemars(range(min = 0.1, max = 1440), extend("x-unit" = "min"))]
    pub longest: f64,
    /// The sun is a disc of its true size. If off, the sun is a point, as in the paper.
    pub disc: bool,
    /// Distance between points on surfaces at which the visibility of the sun is computed once for all paths and used for the light that surfaces
    /// reflect; 0: each vertex of each path sends a shadow ray to each position of the sun. Masks are faster for large bakes. Shadows in the
    /// reflected light are then as coarse as this distance.
    #[schemars(range(min = 0.001, max = 1000), extend("x-zero" = true, "x-unit" = "m"))]
    pub sun_masks: f32,
    /// Maximum of the error of a step of the day in a tile (root mean square), relative to its mean. It decides the number of images.
    #[schemars(range(min = 0.0001, max = 1))]
    pub tolerance: f64,
    /// The tolerance is for the light without its noise, which the two halves of the samples show. If off, it is for the light with its noise, and
    /// noise needs images, too.
    pub noise_floor: bool,
    /// Radius of the filter that takes means over texels of one surface whose light differs by no more than its noise; 0: no filter.
    #[schemars(range(min = 0, max = 16), extend("x-unit" = "texels"))]
    pub filter: u32,
    /// Maximum of images of a tile; 0: as many as the tolerance needs.
    #[schemars(range(min = 0, max = 4096))]
    pub images: u32,
    /// Values of the images of texels. Blocks are a quarter to a sixth of 16-bit floats. An image is in blocks only if the tolerance holds after they
    /// are decoded; else it is as `plain`. Images of probes are always plain.
    pub format: Texels,
    /// Side of a tile, texels. Each tile has its own images. 0: one tile for the whole picture, as in the paper.
    #[schemars(range(min = 4, max = 128), extend("x-zero" = true, "x-unit" = "texels"))]
    pub tile: u32,
    /// Texels along a metre of a surface, for lightmaps.
    #[schemars(range(min = 0.01, max = 1000), extend("x-unit" = "1/m"))]
    pub density: f32,
    /// For lightmaps: backs of two-sided surfaces have texels of their own where light reaches them. If off, backs show the light of the fronts, and
    /// the lightmap is smaller.
    pub backs: bool,
    /// Side of a face, for a camera that turns in place.
    #[schemars(range(min = 8, max = 4096), extend("x-unit" = "texels"))]
    pub face: u32,
    /// Maximum side of a lightmap.
    #[schemars(range(min = 64, max = 4092), extend("x-unit" = "texels"))]
    pub lightmap: u32,
    /// Distance between probes, which light objects that are added at run time; 0: no probes. It is larger where there would be too many.
    #[schemars(range(min = 0, max = 1000), extend("x-unit" = "m"))]
    pub probes: f32,
    /// Maximum number of probes.
    #[schemars(range(min = 8, max = 1_048_576))]
    pub most_probes: u32,
    /// Paths of each probe.
    #[schemars(range(min = 2, max = 1_048_576))]
    pub probe_samples: u32,
    /// Seed of all random numbers.
    #[schemars(range(min = 0, max = 4_294_967_295_u32))]
    pub seed: u32,
}

described!(Baking);

impl Default for Baking {
    fn default() -> Self {
        Self {
            samples: 64,
            bounces: 6,
            roulette: 1,
            specular_bounces: 8,
            diffuse_only: false,
            interval: 5.0,
            offset: 0.0,
            adaptive: Adaptive::default(),
            measure: Comparison::default(),
            noticeable: 0.02,
            longest: 60.0,
            disc: true,
            sun_masks: 0.0,
            tolerance: 0.02,
            noise_floor: true,
            filter: 5,
            images: 0,
            format: Texels::default(),
            tile: 32,
            density: 8.0,
            backs: true,
            face: 256,
            lightmap: 4092,
            probes: 2.0,
            most_probes: 4096,
            probe_samples: 256,
            seed: 0,
        }
    }
}

impl Baking {
    /// The paper's choices: a sun without a size, and 20 images for the whole picture, whatever their error. The paper takes the mean image
    /// away before; here components are around zero, so that no light stays exactly no light, and the mean is one of the images.
    pub fn paper() -> Self {
        Self {
            disc: false,
            tile: 0,
            images: 20,
            tolerance: 1e-4,
            noise_floor: false,
            filter: 0,
            probes: 0.0,
            ..Self::default()
        }
    }

    /// # Errors
    /// `Usage`, naming the key, the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        Self::description().check(self).map_err(|error: Error| error.at("bake"))
    }
}

/// How the light between two steps of the day is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Interpolation {
    /// The line between the two steps, as in the paper.
    #[default]
    Linear,
    /// A curve through four steps (Catmull and Rom 1974).
    CatmullRom,
    /// The line between the logarithms of the light. A picture decodes both steps and joins them at each pixel, which costs as many
    /// fetches of images and twice the sums. Black has no logarithm, so a ten-thousandth of the sun's irradiance is added before and taken
    /// away after.
    LogLinear,
    /// The nearest step.
    Nearest,
}

/// The indirect light of objects that are added at run time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Added {
    /// From the probes around the point.
    #[default]
    Probes,
    /// That of the surface behind the object at the same pixel, as in the paper; none before the sky.
    Screen,
}

/// Where gloss finds the directions of the baked light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Reflections {
    /// From the probes around the point, if the bake has any: gloss reflects their light along the mirrored direction, by as much as the surface has of their
    /// irradiance. They know no detail smaller than a quarter of the sphere.
    #[default]
    Probes,
    /// Nowhere: gloss reflects as much as of light from everywhere alike.
    Even,
}

/// How images in blocks reach a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Sampling {
    /// Textures on GPUs that can sample blocks, decoded elsewhere: CPU drivers gain nothing by textures, and Mesa's rounds BC4 and BC5 to 8 bits.
    #[default]
    Auto,
    /// Textures of blocks, a quarter to a sixth of the memory.
    Textures,
    /// Decoded to 16-bit floats when the bake is read.
    Decoded,
}

/// How the light of the sky is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SkyLight {
    /// By the radiance of each patch of the sky at the time.
    #[default]
    Patches,
    /// The light of the sky under the day's highest sun, scaled by the height of the sun, as the paper scales one image. The paper names no
    /// function of the height; this one is the sine of the elevation.
    Scaled,
    /// Surfaces have no light of the sky. It is shown behind the scene all the same.
    None,
}

/// Settings of pictures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Date of the pictures, for bakes of several days: one of the bake's dates; empty: its first.
    #[schemars(regex(pattern = r"^([0-9]{4}-[0-9]{2}-[0-9]{2})?$"))]
    pub date: String,
    /// Local time of the first frame: hours and minutes.
    #[schemars(regex(pattern = r"^[0-2][0-9]:[0-5][0-9](:[0-5][0-9])?$"), extend("x-kind" = "clock"))]
    pub time: String,
    /// Time between two frames.
    #[schemars(range(min = -1440, max = 1440), extend("x-unit" = "min"))]
    pub minutes: f64,
    /// How the light between two steps of the day is found.
    pub interpolation: Interpolation,
    /// The indirect light of objects that are added at run time.
    pub added: Added,
    /// Where gloss finds the directions of the baked light.
    pub reflections: Reflections,
    /// How the light of the sky is found.
    pub sky: SkyLight,
    /// How images of the bake that are in blocks reach a picture.
    pub blocks: Sampling,
    /// Direct light of the sun has highlights, and surfaces reflect the baked light by their gloss, too (`reflections`). If off, direct light is by Lambert's law alone, and metals reflect the baked light as diffuse surfaces of their colour. A bake with
    /// `diffuse_only` is shown as if off.
    pub gloss: bool,
    /// Haze of the air: 1 is clear mountain air, 10 is thick haze.
    #[schemars(range(min = 1, max = 10))]
    pub turbidity: f64,
    /// Mean albedo of the land around the scene, for the light of the sky.
    #[schemars(range(min = 0, max = 1))]
    pub ground_albedo: f64,
    /// Share of the sky that clouds cover: 0 is clear, 1 is overcast without a sun.
    #[schemars(range(min = 0, max = 1))]
    pub overcast: f64,
    /// When lamps burn: `dusk` (while the sun is low), `on`, `off`, or hours (`18:30-06:00`); for single groups `NAME=…`, separated by commas.
    pub lamps: String,
    /// Elevation of the sun below which lamps with the schedule `dusk` burn; they fade over one degree.
    #[schemars(range(min = -18, max = 90), extend("x-unit" = "°"))]
    pub dusk: f64,
    /// Factor on the light of sun and sky.
    #[schemars(range(min = 0, max = 1000))]
    pub strength: f32,
}

described!(Settings);

impl Default for Settings {
    fn default() -> Self {
        let weather = Weather::default();
        Self {
            date: String::new(),
            time: "12:00".into(),
            minutes: 5.0,
            interpolation: Interpolation::default(),
            added: Added::default(),
            reflections: Reflections::default(),
            sky: SkyLight::default(),
            blocks: Sampling::default(),
            gloss: true,
            turbidity: weather.turbidity(),
            ground_albedo: weather.ground_albedo(),
            overcast: weather.overcast(),
            lamps: "dusk".into(),
            dusk: 3.0,
            strength: 1.0,
        }
    }
}

impl Settings {
    /// The weather.
    ///
    /// # Errors
    /// `Usage`, naming the value found and the values allowed.
    pub fn weather(&self) -> Result<Weather> {
        Weather::new(self.turbidity, self.ground_albedo, self.overcast)
            .map_err(|what| Error::usage(what).at("daylight"))
    }
}

/// Settings of all stages of a picture.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PictureSettings {
    pub daylight: Settings,
    pub gbuffer: gbuffer::Settings,
    pub shadow: shadow::Settings,
}

impl technique::Settings for PictureSettings {
    /// Linear interpolation, one image of the sky, and a plain shadow map. The paper's Phong shading has no numbers for highlights, so only
    /// its diffuse part is left.
    fn paper() -> Option<Self> {
        Some(Self {
            daylight: Settings {
                interpolation: Interpolation::Linear,
                sky: SkyLight::Scaled,
                gloss: false,
                ..Settings::default()
            },
            shadow: shadow::Settings { kind: shadow::Kind::Plain, cascades: 1, ..shadow::Settings::default() },
            ..Self::default()
        })
    }

    fn validate(&self) -> Result<()> {
        Settings::description().check(&self.daylight).map_err(|error: Error| error.at("daylight"))?;
        self.shadow.validate()
    }
}
