//! What can be chosen in image-space radiosity, and what the dissertation chose.

use crate::{
    Error, Result,
    passes::direct::Direct,
    settings::{Described, described},
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What a pixel sends to others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Sender {
    /// Its colour, as in the dissertation: no light needed, and none considered.
    Albedo,
    /// The direct light that it reflects diffusely, and what it emits.
    Lit,
}

/// What one sample of the gather stands for.
///
/// The paper's estimator [ISR 25] sums (2π/N)·F over N samples. The area integral that it stands for is the sum of F alone, F the form factor to
/// the whole [`Patch`] that a sample represents. So the dissertation's sum is 2π/N of the true irradiance from within reach
/// (0.26, 0.13, 0.08 for 24, 48, 80 samples), and with single texels as patches 2π/(N s²), s the spacing of the grid in texels:
/// more samples make it darker, and `k_isr` balances it for one choice only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Estimator {
    /// The estimator [ISR 25] as written.
    Paper,
    /// F to the footprint of the whole cell of the image that a sample represents: converges to the one-bounce irradiance from
    /// all senders in reach, whatever N, reach and resolution.
    Area,
}

/// The area dA in the form factor of [`Estimator::Paper`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Patch {
    /// The footprint of one texel of the buffers.
    Pixel,
    /// The footprint of the cell of the grid around the sample: what "N samples, each covering a solid angle of 2π/N"
    /// amounts to. The same where the grid takes every texel.
    Cell,
}

/// Where the samples lie around the pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Pattern {
    /// A square grid without its centre, as in the dissertation.
    Grid,
    /// As many samples on square rings that grow with `spread`: denser near the pixel.
    Rings,
}

/// Size of the buffers on which light is gathered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Resolution {
    /// Half width and height, as in the dissertation.
    Half,
    /// The size of the picture.
    Full,
}

impl Resolution {
    /// Pixels along the side of a coarse texel.
    pub fn factor(self) -> u32 {
        match self {
            Self::Half => 2,
            Self::Full => 1,
        }
    }
}

/// How four texels become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Downsample {
    /// Their mean, as in the dissertation; at a silhouette it lies between the surfaces.
    Mean,
    /// The mean of those on the nearest surface.
    DepthAware,
}

/// Filter of the gathered light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Blur {
    /// Light as it was gathered.
    None,
    /// The same weights everywhere, as in the dissertation.
    Gaussian,
    /// Stops at depth steps and creases.
    Bilateral,
}

/// What tells surfaces apart when coarse light is brought to full resolution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Upsample {
    /// Difference of linear depth / far [ISR 27].
    Depth,
    /// Normal, and distance from the pixel's plane relative to its depth: steep surfaces are one surface, creases part them.
    Plane,
}

/// What the receiver does with gathered light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Receiver {
    /// ρ_P is the radiation mask, as in the dissertation: receivers are white.
    Mask,
    /// ρ_P is the albedo.
    Albedo,
}

/// What occlusion darkens.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Occlude {
    /// Direct light, as in [ISR 29].
    Direct,
    /// Light of the environment only, where it comes without rays: direct light and rays have their own shadows.
    Ambient,
}

/// How punctual lights fall off and how surfaces reflect them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LightLaw {
    /// Attenuation [ISR 16] and k_dl: colours relative to the brightest light times `light_power`, no π.
    Paper,
    /// W/sr over squared distance, ρ/π.
    Physical,
}

/// The way in which light of the sky and of glowing surfaces reaches the surfaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum AreaLights {
    /// The sky lights every surface, times accessibility. Glowing surfaces send light if the picture shows them.
    Image,
    /// Rays find the part of the sky and of the glowing surfaces that a surface sees, also of those outside of the picture. Surfaces send this light on.
    Rays,
}

/// All choices. `Default` is physically lit; [`Settings::paper`] is the dissertation's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// What a pixel sends to other pixels.
    #[schemars(extend("x-needs" = {"indirect": {"const": true}}))]
    pub sender: Sender,
    /// What one sample of the gather stands for.
    #[schemars(extend("x-needs" = {"indirect": {"const": true}}))]
    pub estimator: Estimator,
    /// The area dA in the form factor of the paper's estimator.
    #[schemars(extend("x-needs" = {"estimator": {"const": "paper"}}))]
    pub patch: Patch,
    /// Where the samples lie around the pixel.
    pub pattern: Pattern,
    /// Samples of the gather around each pixel.
    #[schemars(extend("enum" = [24, 48, 80, 120, 168, 224]))]
    pub samples: u32,
    /// How far senders are looked for, in the full image; 0: three quarters of its longer side.
    #[schemars(range(min = 0, max = 16384), extend("x-unit" = "pixels", "x-needs" = {"indirect": {"const": true}}))]
    pub reach: f32,
    /// Exponent of the radii of rings; 1 is uniform.
    #[schemars(range(min = 1, max = 4), extend("x-needs" = {"pattern": {"const": "rings"}}))]
    pub spread: f32,
    /// Moves samples within their cells, differently from texel to texel; the blur averages.
    pub jitter: bool,
    /// A sample sends the mean radiance around it, over a quarter of the side of its cell, instead of that of one texel: less noise
    /// where senders are small and bright, and light of the wrong surface where surfaces meet.
    #[schemars(extend("x-needs" = {"indirect": {"const": true}}))]
    pub prefilter: bool,
    /// Depth-buffer tests between receiver and sender. 0: every sender in the image counts, as in the dissertation.
    #[schemars(range(min = 0, max = 16), extend("x-needs" = {"indirect": {"const": true}}))]
    pub visibility_steps: u32,
    /// Thickness that a surface in the depth buffer is taken to have, relative to its depth.
    #[schemars(range(min = 0, max = 1), extend("x-needs" = {"visibility_steps": {"minimum": 1}}))]
    pub thickness: f32,
    /// Diffuse bounces after the direct light. Each takes a gather, and the views of `border`, `layers` and `cameras` then gather
    /// from each other and from the picture: their surfaces send on what they got.
    #[schemars(range(min = 1, max = 4), extend("x-needs" = {"indirect": {"const": true}}))]
    pub bounces: u32,
    /// A number of samples for each pixel by its depth: one step more (up to 80) where it is nearer than half the mean depth of the
    /// picture, one less where it is farther than one and a half of it.
    #[schemars(extend("x-needs" = {"indirect": {"const": true}}))]
    pub samples_by_depth: bool,
    /// Surfaces around the picture send too: share of its width and height by which a further view is wider and higher, half of it on each
    /// side. 0: none.
    #[schemars(range(min = 0, max = 4), extend("x-needs" = {"indirect": {"const": true}}))]
    pub border: f32,
    /// Layers of surfaces behind each other that send and block light; 1: the visible one alone.
    #[schemars(range(min = 1, max = 4), extend("x-needs" = {"indirect": {"const": true}}))]
    pub layers: u32,
    /// Further views that look for senders: backwards, from the far side of the scene, from the left, from the right.
    #[schemars(range(min = 0, max = 4), extend("x-needs" = {"indirect": {"const": true}}))]
    pub cameras: u32,
    /// Pixels of the picture along the side of a texel of the views of `border`, `layers` and `cameras`.
    #[schemars(range(min = 1, max = 16), extend("x-unit" = "pixels"))]
    pub sender_scale: u32,
    /// Samples in each of these views.
    #[schemars(range(min = 8, max = 96))]
    pub sender_samples: u32,
    /// Size of the buffers on which light is gathered.
    pub resolution: Resolution,
    /// How four texels become one.
    #[schemars(extend("x-needs" = {"resolution": {"const": "half"}}))]
    pub downsample: Downsample,
    /// Gather light.
    pub indirect: bool,
    /// Gather occlusion.
    pub occlusion: bool,
    /// How far occluders are looked for, in the full image.
    #[schemars(range(min = 1, max = 16384), extend("x-unit" = "pixels", "x-needs" = {"occlusion": {"const": true}}))]
    pub occlusion_reach: f32,
    /// Radius of the sphere that a sample stands for in [ISR 26], in sides of its cell.
    #[schemars(range(min = 0, max = 16), extend("x-needs" = {"occlusion": {"const": true}}))]
    pub occluder_radius: f32,
    /// Subtracted from the cosine of [ISR 26], against flat surfaces that occlude themselves by rounded normals.
    #[schemars(range(min = 0, max = 1), extend("x-needs" = {"occlusion": {"const": true}}))]
    pub occlusion_bias: f32,
    /// Filter of the gathered light.
    pub blur: Blur,
    /// Reach of the blur to each side, in the coarse buffers; the standard deviation is half of it.
    #[schemars(range(min = 0, max = 16), extend("x-unit" = "texels", "x-needs" = {"blur": {"not": {"const": "none"}}}))]
    pub blur_radius: u32,
    /// Distance from a texel's plane, relative to its depth, at which another weighs 0.6.
    #[schemars(range(min = 1e-6, max = 1e6), extend("x-needs" = {"blur": {"const": "bilateral"}}))]
    pub blur_range: f32,
    /// What tells surfaces apart when coarse light is brought to full resolution.
    #[schemars(extend("x-needs" = {"resolution": {"const": "half"}}))]
    pub upsample: Upsample,
    /// ε of [ISR 27], in the unit that `upsample` compares.
    #[schemars(range(min = 1e-9, max = 1), extend("x-needs" = {"resolution": {"const": "half"}}))]
    pub upsample_epsilon: f32,
    /// What the receiver does with gathered light.
    #[schemars(extend("x-needs" = {"indirect": {"const": true}}))]
    pub receiver: Receiver,
    /// Radiation masks of materials, `NAME=SHARE` with commas between them, for instance `floor=0.5, curtain=0`: the share of the indirect light that
    /// surfaces of a material receive and send, 0 to 1 in steps of 1/255 [ISR 25]. Empty: 1 for all. Direct light, and light of the sky and of glowing
    /// surfaces, arrives in full. Masks act where light is gathered, so the blur mixes those of coplanar surfaces. Names with a comma cannot be given.
    #[schemars(extend("x-needs" = {"indirect": {"const": true}}))]
    pub mask: String,
    /// Power of indirect light. The area estimator needs no balancing: 1.
    #[schemars(range(min = 0, max = 1000), extend("x-needs" = {"indirect": {"const": true}}))]
    pub k_isr: f32,
    /// Power of occlusion: light is multiplied by accessibility + 1 − k_ssao, at most 1 [ISR 29]. With 1 this is
    /// accessibility itself; with the dissertation's 0.5, light is darkened only where more than half is occluded.
    #[schemars(range(min = 0, max = 1), extend("x-needs" = {"occlusion": {"const": true}}))]
    pub k_ssao: f32,
    /// What occlusion darkens.
    #[schemars(extend("x-needs" = {"occlusion": {"const": true}}))]
    pub occlude: Occlude,
    /// How punctual lights fall off and how surfaces reflect them.
    pub light_law: LightLaw,
    /// Radius l_r of lights without a range; 0: the far distance of the camera.
    #[schemars(range(min = 0, max = 1e9), extend("x-unit" = "m", "x-needs" = {"light_law": {"const": "paper"}}))]
    pub light_radius: f32,
    /// l_pow of the brightest light.
    #[schemars(range(min = 0, max = 1e9), extend("x-needs" = {"light_law": {"const": "paper"}}))]
    pub light_power: f32,
    /// Light of the environment: on matt surfaces, and blurred on metals. The dissertation has none.
    pub environment: bool,
    /// The way in which light of the sky and of glowing surfaces reaches the surfaces.
    pub area_lights: AreaLights,
    /// Rays of each texel of the coarse buffers to the sky, and as many to glowing surfaces.
    #[schemars(range(min = 2, max = 64), extend("x-needs" = {"area_lights": {"const": "rays"}}))]
    pub area_rays: u32,
    /// Brightness of the surfaces that the picture does not show, relative to those that it shows to the receiver. They are where rays meet surfaces. Light
    /// that is scattered more often than `bounces` times is estimated as in a closed room, by the same share. 0: they are dark. Has no effect
    /// with `border`, `layers` and `cameras`, which look for these surfaces.
    #[schemars(range(min = 0, max = 1), extend("x-needs" = {"area_lights": {"const": "rays"}}))]
    pub unseen: f32,
    /// Direct light is reflected by GGX facets over the matt base; otherwise by Lambert's law alone.
    pub specular: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            sender: Sender::Lit,
            estimator: Estimator::Area,
            patch: Patch::Cell,
            pattern: Pattern::Rings,
            samples: 48,
            reach: 0.0,
            spread: 1.5,
            jitter: true,
            prefilter: true,
            visibility_steps: 4,
            thickness: 0.1,
            bounces: 1,
            samples_by_depth: false,
            border: 0.0,
            layers: 1,
            cameras: 0,
            sender_scale: 4,
            sender_samples: 48,
            resolution: Resolution::Half,
            downsample: Downsample::DepthAware,
            indirect: true,
            occlusion: true,
            occlusion_reach: 64.0,
            occluder_radius: 1.5,
            occlusion_bias: 0.05,
            blur: Blur::Bilateral,
            blur_radius: 8,
            blur_range: 0.01,
            upsample: Upsample::Plane,
            upsample_epsilon: 1e-3,
            receiver: Receiver::Albedo,
            mask: String::new(),
            k_isr: 1.0,
            k_ssao: 1.0,
            occlude: Occlude::Ambient,
            light_law: LightLaw::Physical,
            light_radius: 0.0,
            light_power: 1.0,
            environment: true,
            area_lights: AreaLights::Rays,
            area_rays: 4,
            unseen: 0.75,
            specular: true,
        }
    }
}

/// Choices that go together, from cheap to near the reference. What each costs and gains: `samples/isr/README.md`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Half of the samples, and light passes through what stands between.
    Fast,
    /// With surfaces around the picture and behind the viewer.
    Balanced,
    /// With everything that senders can be found by.
    Best,
}

impl Preset {
    /// All, with the names that `FromStr` takes.
    pub const ALL: [(&str, Self); 3] = [("fast", Self::Fast), ("balanced", Self::Balanced), ("best", Self::Best)];

    /// The defaults with the choices of the preset.
    pub fn settings(self) -> Settings {
        let base = Settings::default();
        match self {
            Self::Fast => Settings { samples: 24, visibility_steps: 0, ..base },
            Self::Balanced => Settings { border: 1.0, cameras: 1, sender_samples: 24, ..base },
            Self::Best => Settings {
                samples: 80,
                visibility_steps: 8,
                thickness: 0.3,
                border: 1.0,
                layers: 3,
                cameras: 3,
                sender_scale: 2,
                sender_samples: 64,
                ..base
            },
        }
    }
}

impl std::str::FromStr for Preset {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        Self::ALL.iter().find(|(name, _)| *name == text).map(|(_, preset)| *preset).ok_or_else(|| {
            let names: Vec<&str> = Self::ALL.iter().map(|(name, _)| *name).collect();
            Error::usage(format!("no preset '{text}'; there are {}", names.join(", ")))
        })
    }
}

impl Settings {
    /// The dissertation's choices. It states neither the reach of its grid, nor dA, nor the radius of its occluders; taken
    /// here are 32 of its 1024 pixels, the cells of the grid, and spheres as wide as three cells.
    pub fn paper() -> Self {
        Self {
            sender: Sender::Albedo,
            estimator: Estimator::Paper,
            pattern: Pattern::Grid,
            reach: 32.0,
            spread: 1.0,
            jitter: false,
            prefilter: false,
            visibility_steps: 0,
            blur_radius: 4,
            downsample: Downsample::Mean,
            occlusion_reach: 32.0,
            occluder_radius: 1.5,
            occlusion_bias: 0.0,
            blur: Blur::Gaussian,
            upsample: Upsample::Depth,
            receiver: Receiver::Mask,
            k_isr: 0.5,
            k_ssao: 0.5,
            occlude: Occlude::Direct,
            light_law: LightLaw::Paper,
            environment: false,
            area_lights: AreaLights::Image,
            specular: false,
            ..Self::default()
        }
    }

    /// The choices of direct light.
    pub fn direct(&self) -> Direct {
        Direct {
            paper_law: self.light_law == LightLaw::Paper,
            specular: self.specular,
            light_radius: self.light_radius,
            light_power: self.light_power,
            ..Direct::default()
        }
    }

    /// Surfaces that the picture does not show send light ([`Self::unseen`]).
    pub(super) fn fills(&self) -> bool {
        let looks = self.border > 0.0 || self.layers > 1 || self.cameras > 0;
        self.unseen > 0.0 && !looks && self.indirect && self.sender == Sender::Lit
    }

    /// # Errors
    /// `Usage`, naming the key, the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        Self::description().check(self)
    }
}

described!(Settings);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_and_the_papers_choices_are_valid() {
        Settings::default().validate().unwrap();
        Settings::paper().validate().unwrap();
        for (name, preset) in Preset::ALL {
            preset.settings().validate().unwrap();
            assert_eq!(name.parse::<Preset>().unwrap(), preset);
        }
        assert!("bets".parse::<Preset>().unwrap_err().to_string().contains("fast, balanced, best"));
    }

    #[test]
    fn senders_out_of_range_are_refused() {
        for wrong in [
            Settings { border: 4.5, ..Settings::default() },
            Settings { layers: 0, ..Settings::default() },
            Settings { cameras: 5, ..Settings::default() },
            Settings { sender_scale: 0, ..Settings::default() },
            Settings { sender_samples: 97, ..Settings::default() },
        ] {
            assert_eq!(wrong.validate().unwrap_err().exit_code(), 2, "{wrong:?}");
        }
    }

    #[test]
    fn an_error_names_key_value_and_what_is_allowed() {
        let message = |s: Settings| s.validate().unwrap_err().to_string();
        let error = message(Settings { samples: 50, ..Settings::default() });
        assert_eq!(error, "samples: 50 is not allowed; allowed: 24, 48, 80, 120, 168, 224");
        let error = message(Settings { k_ssao: f32::NAN, ..Settings::default() });
        assert_eq!(error, "k_ssao: NaN or infinity is not allowed; allowed: 0 to 1");
        let error = message(Settings { bounces: 0, ..Settings::default() });
        assert_eq!(error, "bounces: 0 is not allowed; allowed: 1 to 4");
    }

    #[test]
    fn unknown_keys_are_refused_and_missing_ones_default() {
        let settings: Settings =
            toml::from_str("samples = 80\nsender = \"albedo\"\ndownsample = \"depth-aware\"").unwrap();
        assert_eq!(settings, Settings { samples: 80, sender: Sender::Albedo, ..Settings::default() });
        let error = toml::from_str::<Settings>("smaples = 80").unwrap_err().to_string();
        assert!(error.contains("smaples") && error.contains("samples"), "{error}");
    }
}
