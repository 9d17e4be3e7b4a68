//! Settings of bakes and of pictures.

use serde::{Deserialize, Serialize};

use super::MOST_VECTORS;
use crate::{
    Error, Result,
    passes::{gbuffer, shadow},
    settings::{Described, JsonSchema, described},
    shaders::consts::MAX_SHADOW_SLOTS,
    technique,
};

/// Settings that decide the bytes of a bake.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Baking {
    /// Samples on all surfaces that light reaches, about.
    #[schemars(range(min = 16, max = 1_000_000))]
    pub samples: u32,
    /// Least distance of samples in the narrowest gaps, as a share of that on open surfaces; 1: the same everywhere. The distance shrinks where less than
    /// two distances of samples are free above the surface.
    #[schemars(range(min = 0.1, max = 1))]
    pub gaps: f64,
    /// Samples of a cluster, about.
    #[schemars(range(min = 8, max = 4096))]
    pub cluster: u32,
    /// Directions above a sample in which the distance to the nearest surface is stored.
    #[schemars(range(min = 16, max = 16384))]
    pub directions: u32,
    /// Vectors that describe the distances of a cluster: d₁ of the paper.
    #[schemars(range(min = 1, max = 256))]
    pub visibility: u32,
    /// Vectors that describe the direct light of a cluster: d₂ of the paper.
    #[schemars(range(min = 1, max = 64))]
    pub light: u32,
    /// Point lights at random places in the free space, whose light the vectors are made for.
    #[schemars(range(min = 16, max = 4096))]
    pub examples: u32,
    /// Rays that gather the light of one scattering at a sample.
    #[schemars(range(min = 16, max = 65536))]
    pub rays: u32,
    /// Vectors that describe the light that a cluster receives; 0: every coefficient of every sample, as in the paper.
    #[schemars(range(min = 0, max = 256))]
    pub receivers: u32,
    /// A sample is linked to another one that fills at least this share of its hemisphere, weighted by the cosine, and that at least four of its rays
    /// meet: the light of that sample arrives as is, without vectors. 0: there are no links, as in the paper.
    #[schemars(range(min = 0, max = 1))]
    pub links: f64,
    /// Rays of each sample that are kept: the light along them gives the directional coefficients with which glossy surfaces reflect transferred light. At most
    /// `rays` are there. 0: glossy surfaces reflect it evenly, as diffuse ones do.
    #[schemars(range(min = 0, max = 1024))]
    pub directional: u32,
    /// Share of the coefficients that are kept, the largest of each cluster; all smaller ones become 0.
    #[schemars(range(min = 0.01, max = 1), extend("x-needs" = {"receivers": {"const": 0}}))]
    pub keep: f64,
    /// Direct light is described around the mean of the examples, as in the paper. A room then glows with the light off. If off, around zero, by
    /// examples of equal weight, and the mean over a cluster is exact.
    pub centred: bool,
    /// Seed of all random numbers.
    #[schemars(range(min = 0, max = 4_294_967_295_u32))]
    pub seed: u32,
}

described!(Baking);

impl Default for Baking {
    fn default() -> Self {
        Self {
            samples: 45_000,
            gaps: 0.4,
            cluster: 1000,
            directions: 2016,
            visibility: 50,
            light: 24,
            examples: 1000,
            rays: 512,
            receivers: 48,
            links: 0.0035,
            directional: 64,
            keep: 1.0,
            centred: false,
            seed: 0,
        }
    }
}

impl Baking {
    /// The paper's choices: ten vectors of light around the mean of the examples, and a fifth of all coefficients between clusters and samples.
    pub fn paper() -> Self {
        Self {
            gaps: 1.0,
            light: 10,
            receivers: 0,
            links: 0.0,
            directional: 0,
            keep: 0.2,
            centred: true,
            ..Self::default()
        }
    }

    /// Rays of each sample that are kept.
    pub(super) fn kept_rays(&self) -> usize {
        self.directional.min(self.rays) as usize
    }

    /// # Errors
    /// `Usage`, naming the key, the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        Self::description().check(self).map_err(|error: Error| error.at("room"))?;
        // Far too many vectors are refused before minutes of work; the samples decide about all others.
        let clusters = (self.samples / self.cluster).max(1) as usize;
        let vectors = clusters * (self.light as usize + usize::from(self.centred));
        if vectors <= MOST_VECTORS {
            return Ok(());
        }
        let what = format!(
            "{} samples in clusters of {} have about {vectors} vectors of light, at most {MOST_VECTORS} are possible",
            self.samples, self.cluster
        );
        Err(too_many_vectors(what))
    }
}

/// The error for more vectors than [`MOST_VECTORS`].
pub(super) fn too_many_vectors(what: String) -> Error {
    let error = Error::usage(what).at("room.cluster");
    error.help("Choose larger clusters, fewer samples or fewer vectors (room.light)")
}

/// How the direct light of a picture is shadowed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Direct {
    /// By shadow maps, if the lights are points and if there are maps for all of them (64: six for a point light, one for a narrow spot light); else by samples.
    #[default]
    Auto,
    /// By the visibility of the samples, as in the paper: soft shadows at the distance of the samples.
    Samples,
    /// By shadow maps, at the pixels and at the samples. Lights are points.
    Maps,
}

/// How the light of the samples reaches the pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Spread {
    /// Each pixel takes the mean over the samples around it.
    #[default]
    Gather,
    /// Samples are drawn as discs on their surfaces, as in the paper.
    Splats,
    /// Each vertex takes the mean over the samples around it, and pixels interpolate: for finely divided meshes.
    Vertices,
}

/// Settings of pictures.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// How the direct light is shadowed.
    pub direct: Direct,
    /// Points that stand for a light.
    #[schemars(range(min = 1, max = 256), extend("x-needs" = {"direct": {"enum": ["auto", "samples"]}}))]
    pub points: u32,
    /// Radius of lights: their points are on a sphere.
    #[schemars(range(min = 0, max = 100), extend("x-unit" = "m", "x-needs" = {"direct": {"enum": ["auto", "samples"]}, "points": {"minimum": 2}}))]
    pub radius: f32,
    /// A light that is farther away than the stored distance by less than this share of it is visible.
    #[schemars(range(min = 0, max = 1), extend("x-needs" = {"direct": {"enum": ["auto", "samples"]}}))]
    pub bias: f32,
    /// Distance of that kind, in addition to the share, in distances of samples.
    #[schemars(range(min = 0, max = 100), extend("x-needs" = {"direct": {"enum": ["auto", "samples"]}}))]
    pub bias_distance: f32,
    /// Standard deviation of the Gaussian weights of samples in a pixel, in distances of samples.
    #[schemars(range(min = 0.3, max = 1))]
    pub splat: f32,
    /// How the light of the samples reaches the pixels.
    pub spread: Spread,
    /// Least distance of splats on the picture: farther away, one splat stands for several samples of a plane. 0: each sample has its own.
    #[schemars(range(min = 0, max = 64), extend("x-unit" = "px", "x-needs" = {"spread": {"const": "splats"}}))]
    pub splat_pixels: f32,
    /// Distance of two eyes: left and right view side by side, each of the picture's size, with the camera between them. Both look straight ahead. 0: one view.
    #[schemars(range(min = 0, max = 10), extend("x-unit" = "m"))]
    pub eyes: f32,
    /// Both eyes are drawn in one pass over the surfaces where the device can (multiview), elsewhere in two. Off: always in two. Same pixels.
    #[schemars(extend("x-needs" = {"eyes": {"exclusiveMinimum": 0}}))]
    pub multiview: bool,
    /// Surfaces have highlights. If off, Lambert's law alone.
    pub gloss: bool,
    /// Glossy surfaces reflect transferred light by its directions, if the bake has directional coefficients (`room.directional`). If off, they reflect it
    /// evenly, with all its energy.
    #[schemars(extend("x-needs" = {"gloss": {"const": true}}))]
    pub directional: bool,
    /// Scatterings of the light: all of them, or one.
    pub bounces: bool,
    /// Scatterings of light that links carry sample by sample; vectors describe the light of all further scatterings. 0: links carry the light that
    /// vectors describe.
    #[schemars(range(min = 0, max = 16))]
    pub linked: u32,
    /// With a bake around the mean of the examples: the light that the mean itself transfers is there. The paper's equation 10 leaves this light out.
    pub mean: bool,
    /// Factor on the light of all lights.
    #[schemars(range(min = 0, max = 1000))]
    pub strength: f32,
    /// Basis vector whose transfer the mode `transfer` shows: its number among all vectors of all clusters.
    #[schemars(range(min = 0, max = 1_000_000))]
    pub vector: u32,
}

described!(Settings);

impl Settings {
    /// The settings with `auto` decided. `maps`: shadow maps that all lights need; `None`: shadow maps are off.
    pub(super) fn decided(&self, maps: Option<u32>) -> Self {
        let points = self.radius == 0.0 || self.points == 1;
        let direct = match self.direct {
            Direct::Auto if points && maps.is_some_and(|maps| maps <= MAX_SHADOW_SLOTS) => Direct::Maps,
            Direct::Auto => Direct::Samples,
            chosen => chosen,
        };
        Self { direct, ..self.clone() }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            direct: Direct::default(),
            points: 1,
            radius: 0.0,
            bias: 0.06,
            bias_distance: 1.0,
            splat: 0.6,
            spread: Spread::default(),
            splat_pixels: 2.0,
            eyes: 0.0,
            multiview: true,
            gloss: true,
            directional: true,
            bounces: true,
            linked: 3,
            mean: true,
            strength: 1.0,
            vector: 0,
        }
    }
}

/// Settings of all stages of a picture.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PictureSettings {
    pub prt: Settings,
    pub gbuffer: gbuffer::Settings,
    pub shadow: shadow::Settings,
}

impl technique::Settings for PictureSettings {
    /// Diffuse surfaces and shadows by the samples, without the transfer of the mean (equation 10).
    fn paper() -> Option<Self> {
        let prt = Settings { direct: Direct::Samples, gloss: false, mean: false, ..Settings::default() };
        Some(Self { prt, ..Self::default() })
    }

    fn validate(&self) -> Result<()> {
        Settings::description().check(&self.prt).map_err(|error: Error| error.at("prt"))?;
        self.shadow.validate()
    }
}
