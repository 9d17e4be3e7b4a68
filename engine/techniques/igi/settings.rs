//! The settings of instant global illumination, their defaults, and the paper's values.

use super::{super::allowed::wrong, raster};
use crate::{
    Error, Result,
    settings::{Described, described},
    shaders::consts::CACHE_CELLS,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Smallest side of a cache cell, as share of the scene's diagonal: a key has nine bits for each axis.
pub(super) const LEAST_CELL: f32 = 0.002;
/// Maximum of virtual lights per frame.
const MOST_LIGHTS: u32 = 10_000;

/// How rays are traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Visibility {
    /// By ray queries if the device has them, else in compute. CPU drivers use ray queries only if `LUCERNA_RAY_QUERY` is `on`.
    #[default]
    Auto,
    /// In a compute shader, through this library's own acceleration structures. Works on every device.
    Compute,
    /// By ray queries; an error of kind `Usage` on a device without them.
    Query,
    /// Three shadow maps for each virtual light, drawn by the rasteriser. Light paths, direct light, mirrors and glass use rays as
    /// with `Auto`.
    Raster,
}

impl Visibility {
    /// Whether rays are traced in compute on a device with or without ray queries.
    pub(super) fn in_compute(self, queries: bool) -> Result<bool> {
        match self {
            Self::Auto | Self::Raster => Ok(!queries),
            Self::Compute => Ok(true),
            Self::Query if queries => Ok(false),
            Self::Query => Err(Error::usage("the device has no ray queries, or they are switched off")
                .at("igi.visibility")
                .help("Choose visibility = \"compute\"; CPU drivers use ray queries only with LUCERNA_RAY_QUERY=on")),
        }
    }
}

/// How interleaved sampling assigns subsets of the virtual lights to the pixels of a tile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Pattern {
    /// The same assignment in every tile, as in the paper.
    #[default]
    Regular,
    /// Another assignment in every tile, so that no pattern repeats in the picture. The tile around a pixel may then contain a
    /// subset twice. Each subset has light paths in all directions; a subset of the regular 3 × 3 pattern has a ninth of the
    /// directions.
    Irregular,
}

/// Settings of the technique. [`Settings::validate`] checks the ranges given here.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Maximum of virtual point lights, and at least `bounces`. There are ⌊vpls / bounces⌋ light paths. A path that
    /// leaves the scene or ends on a black surface leaves fewer lights.
    #[schemars(range(min = 1, max = MOST_LIGHTS), extend("x-unit" = "lights", "x-needs" = {"indirect": {"const": true}}))]
    pub vpls: u32,
    /// Candidates for each virtual light: the number of light paths is multiplied by it. The frame draws its virtual lights
    /// among the candidates, with a probability that follows the light that they send to the view. 1: every virtual light is used,
    /// as in the paper.
    #[schemars(range(min = 1, max = 64), extend("x-needs" = {"indirect": {"const": true}}))]
    pub candidates: u32,
    /// Maximum of virtual lights along a path: the bounces of indirect light.
    #[schemars(range(min = 1, max = 8), extend("x-needs" = {"indirect": {"const": true}}))]
    pub bounces: u32,
    /// Visible points that measure the importance of the candidates. Each point traces a shadow ray to each candidate.
    /// If there are few points, a candidate that lights a small part of the view may look unimportant. Half of the probability
    /// follows the flux alone, so that such a candidate still is drawn.
    #[schemars(range(min = 1, max = 1024), extend("x-unit" = "points", "x-needs" = {"candidates": {"minimum": 2}}))]
    pub judges: u32,
    /// Bounding distance min_d of the geometry term, as share of the scene's diagonal: the diagonal of the bounding box of
    /// all surfaces except unlit ones, in the rest pose. A virtual light nearer than 0.8 min_d sends no light, beyond 1.2 min_d it
    /// sends all its light. 0: no bound.
    #[schemars(range(min = 0, max = 1), extend("x-needs" = {"indirect": {"const": true}}))]
    pub bound: f32,
    /// Virtual lights that each pixel picks from the light tree, with a probability that follows the light that they may
    /// send to it. The cost grows with the logarithm of `vpls`; the picture gets noise. The pixels of an interleaved tile share the
    /// picks. With four virtual lights or fewer for each pick, every pixel gathers from all lights. 0: always from all.
    #[schemars(range(min = 0, max = 1024), extend("x-unit" = "lights", "x-needs" = {"indirect": {"const": true}}))]
    pub picks: u32,
    /// Virtual lights proposed for each pick. One of the proposals is drawn, in proportion to the unoccluded light that it
    /// sends.
    #[schemars(range(min = 1, max = 16), extend("x-unit" = "lights", "x-needs" = {"picks": {"minimum": 1}}))]
    pub proposals: u32,
    /// Short rays per gathered pixel that add back the light that the bound removes. 0: this light is missing.
    #[schemars(range(min = 0, max = 64), extend("x-unit" = "rays", "x-needs" = {"bound": {"exclusiveMinimum": 0}}))]
    pub compensation: u32,
    /// Iterations of the filter that removes the noise of the compensated light, like [`Settings::direct_filter`] for direct light. 0: no filter; the
    /// light is right on average in every pixel.
    #[schemars(range(min = 0, max = 5), extend("x-unit" = "iterations", "x-needs" = {"compensation": {"minimum": 1}, "downsample": {"const": 1}}))]
    pub compensation_filter: u32,
    /// Side of a cell of the irradiance cache, as share of the scene's diagonal. The cache holds the light of virtual
    /// lights on surfaces that mirrors and glass show. 0: no cache; each of these surfaces gathers.
    #[schemars(range(min = 0.002, max = 0.2), extend("x-zero" = true, "x-needs" = {"indirect": {"const": true}, "specular": {"const": true}}))]
    pub cache: f32,
    /// Maximum of cache cells. If the frame needs more, it does not use the cache
    /// ([`Cache::note`](super::Cache::note)).
    #[schemars(range(min = 1, max = CACHE_CELLS), extend("x-unit" = "cells", "x-needs" = {"cache": {"exclusiveMinimum": 0}}))]
    pub cache_cells: u32,
    /// Shadow rays of virtual lights test the bounding boxes of triangles instead of the triangles.
    #[schemars(extend("x-needs" = {"indirect": {"const": true}}))]
    pub imperfect: bool,
    /// Pixels along the side of a coarse texel. Indirect light is gathered once for each coarse texel.
    #[schemars(range(min = 1, max = 4), extend("x-unit" = "pixels", "x-needs" = {"indirect": {"const": true}}))]
    pub downsample: u32,
    /// The pixel for which a coarse texel gathers changes from texel to texel, so that some texels hit a thin object. Otherwise it
    /// is the pixel in the middle of the texel.
    #[schemars(extend("x-needs" = {"downsample": {"minimum": 2}}))]
    pub scattered: bool,
    /// Side of the interleaving tiles; above 4 only with `fused`. The pixels of a tile share the virtual lights: each pixel
    /// gathers from one of side² subsets. Larger tiles allow more virtual lights for the same number of shadow rays per pixel.
    #[schemars(range(min = 1, max = 32), extend("x-unit" = "pixels", "x-needs" = {"indirect": {"const": true}}))]
    pub interleave: u32,
    /// Where the subsets of interleaved sampling lie.
    #[schemars(extend("x-needs" = {"interleave": {"minimum": 2}}))]
    pub pattern: Pattern,
    /// Sorts the virtual lights by position and normal before they are split into subsets, so that each subset has lights from
    /// every part of the scene. `picks` and `compensation` always sort them.
    #[schemars(extend("x-needs" = {"interleave": {"minimum": 2}}))]
    pub sorted: bool,
    /// One filter instead of two: the upsampling filter reads the interleaved texels, and the discontinuity buffer is not used.
    #[schemars(extend("x-needs" = {"interleave": {"minimum": 2}}))]
    pub fused: bool,
    /// Iterations of the edge-avoiding filter that smooths the coarse irradiance before upsampling. Its weights for normals
    /// and planes are those of the upsampling filter. The result is about a Gaussian with a standard deviation of 1, 2.2, 4.6, 9.2
    /// or 18 coarse texels. 0: no smoothing.
    #[schemars(range(min = 0, max = 5), extend("x-unit" = "iterations", "x-needs" = {"indirect": {"const": true}}))]
    pub smoothing: u32,
    /// Maximum ratio of a coarse texel's luminance to the mean of its neighbours on the same surface. Brighter texels are
    /// dimmed to this ratio before smoothing, because a virtual light close to a surface makes a speck that no filter hides. 0: no
    /// limit.
    #[schemars(range(min = 1, max = 1000), extend("x-zero" = true, "x-needs" = {"indirect": {"const": true}}))]
    pub despeckle: f32,
    /// Minimum share of the upsampling Gaussian that must fall on coarse texels with a matching normal and plane. With a
    /// smaller share a Gaussian three times as wide is tried. If this fails too, the pixel gathers from one subset; this happens on
    /// thin objects that no coarse texel hit. 0: never. Not with `picks`, and not with `visibility` `raster`.
    #[schemars(range(min = 0, max = 1), extend("x-needs" = {"indirect": {"const": true}}))]
    pub refine: f32,
    /// Standard deviation of the upsampling Gaussian, in coarse texels.
    #[schemars(range(min = 0.1, max = 4), extend("x-unit" = "texels", "x-needs" = {"indirect": {"const": true}}))]
    pub upsample_sigma: f32,
    /// Exponent of the cosine between normals in upsampling; the paper has 1.
    #[schemars(range(min = 0, max = 64), extend("x-needs" = {"indirect": {"const": true}}))]
    pub upsample_normal: f32,
    /// Distance of a coarse texel from the pixel's plane, relative to the pixel's depth, at which its weight falls to 0.6; 0: the
    /// weight does not depend on depth, as in the paper.
    #[schemars(range(min = 0, max = 1e6), extend("x-needs" = {"indirect": {"const": true}}))]
    pub upsample_range: f32,
    /// Maximum difference in depth, relative to the texel's depth, over which the discontinuity buffer averages interleaved texels.
    #[schemars(range(min = 0, max = 1e6), extend("x-needs" = {"fused": {"const": false}, "interleave": {"minimum": 2}}))]
    pub discontinuity_depth: f32,
    /// Minimum cosine between the normals of texels that the discontinuity buffer averages.
    #[schemars(range(min = -1, max = 1), extend("x-needs" = {"fused": {"const": false}, "interleave": {"minimum": 2}}))]
    pub discontinuity_normal: f32,
    /// Maximum of frames over which indirect light is averaged. Each frame has other virtual lights. 1: no average. 0: no
    /// history, and every frame uses the same random numbers.
    #[schemars(range(min = 0, max = 10000), extend("x-unit" = "frames", "x-needs" = {"indirect": {"const": true}}))]
    pub history: u32,
    /// Relative error of indirect light that is allowed because the average lags behind changing light.
    #[schemars(range(min = 0.001, max = 10), extend("x-needs" = {"history": {"minimum": 2}}))]
    pub history_lag: f32,
    /// Maximum distance from a surface of the last frame, relative to its depth, at which a pixel reuses that surface's light.
    #[schemars(range(min = 0, max = 1e6), extend("x-needs" = {"history": {"minimum": 2}}))]
    pub history_range: f32,
    /// How rays are traced. With `imperfect` the shadow rays of virtual lights are always traced in compute.
    pub visibility: Visibility,
    /// Side of the shadow maps of virtual lights.
    #[schemars(range(min = 16, max = 1024), extend("x-unit" = "texels", "x-needs" = {"indirect": {"const": true}, "visibility": {"const": "raster"}}))]
    pub raster_size: u32,
    /// Computes indirect light.
    pub indirect: bool,
    /// Mirrors, glass, and GGX highlights of direct light. If off, every surface reflects its diffuse part only.
    pub specular: bool,
    /// Maximum of mirrors and glass surfaces in a row, along camera rays and along light paths.
    #[schemars(range(min = 0, max = 16), extend("x-unit" = "surfaces", "x-needs" = {"specular": {"const": true}}))]
    pub specular_depth: u32,
    /// Shadow rays per pixel to emissive surfaces, and as many to the environment. Smooth surfaces have a quarter more for highlights of the
    /// environment. Each punctual light has one ray.
    #[schemars(range(min = 1, max = 4096), extend("x-unit" = "rays"))]
    pub direct_samples: u32,
    /// Iterations of the filter that removes the noise of direct light from emissive surfaces and from the environment. Pixels on the same
    /// surface share this light as far as their noise explains the difference. The filter reaches about 2, 6, 14, 30 or 62 pixels. 0: no filter; the
    /// light is right on average in every pixel.
    #[schemars(range(min = 0, max = 5), extend("x-unit" = "iterations"))]
    pub direct_filter: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            vpls: 180,
            candidates: 8,
            bounces: 4,
            judges: 96,
            bound: 0.1,
            picks: 0,
            proposals: 4,
            compensation: 8,
            compensation_filter: 4,
            cache: 0.0,
            cache_cells: CACHE_CELLS,
            imperfect: false,
            downsample: 1,
            scattered: false,
            interleave: 1,
            pattern: Pattern::Regular,
            sorted: false,
            fused: false,
            smoothing: 0,
            despeckle: 0.0,
            refine: 0.0,
            upsample_sigma: 0.6,
            upsample_normal: 8.0,
            upsample_range: 0.01,
            discontinuity_depth: 0.05,
            discontinuity_normal: 0.9,
            history: 0,
            history_lag: 0.1,
            history_range: 0.01,
            visibility: Visibility::Auto,
            raster_size: 256,
            indirect: true,
            specular: true,
            specular_depth: 6,
            direct_samples: 16,
            direct_filter: 3,
        }
    }
}

impl Settings {
    /// The paper's fastest variant: 180 virtual lights, boxes, a quarter of the resolution, tiles of 3×3. The paper states neither
    /// the number of bounces nor min_d; here it has two bounces, and a bound without compensation. It has point lights alone, and direct light
    /// without a filter.
    pub fn paper() -> Self {
        Self {
            candidates: 1,
            imperfect: true,
            downsample: 4,
            interleave: 3,
            upsample_normal: 1.0,
            upsample_range: 0.0,
            bounces: 2,
            bound: 0.02,
            compensation: 0,
            direct_filter: 0,
            ..Self::default()
        }
    }

    /// Number of light paths whose virtual lights are kept.
    pub fn paths(&self) -> u32 {
        (self.vpls / self.bounces.max(1)).max(1)
    }

    /// Whether the filter for the noise of compensated light runs.
    pub(super) fn filters_compensation(&self) -> bool {
        self.compensation_filter > 0 && self.downsample == 1
    }

    /// Whether receivers pick from `vpls` virtual lights. If there are few lights, gathering from all costs less and has no noise.
    pub fn picks_from(&self, vpls: u32) -> bool {
        self.picks > 0 && vpls > 4 * self.picks
    }

    /// Step of the irregular pattern: in round r a pixel of subset s gathers from subset (s + r·step) mod side². The step is about 0.62
    /// side², so that consecutive rounds are far apart. It has no common factor with side², so that a pixel gathers from every subset
    /// in turn. 0 for the regular pattern.
    pub(super) fn stride(&self) -> u32 {
        let subsets = self.interleave * self.interleave;
        if self.pattern == Pattern::Regular || subsets <= 1 {
            return 0;
        }
        let common = |mut a: u32, mut b: u32| {
            while b > 0 {
                (a, b) = (b, a % b);
            }
            a
        };
        (((633 * subsets) >> 10)..).find(|&stride| stride > 0 && common(stride, subsets) == 1).unwrap_or(1)
    }

    /// Picks per texel: the texels of an interleaving tile share [`Settings::picks`].
    pub fn texel_picks(&self) -> u32 {
        self.picks.div_ceil(self.interleave.max(1).pow(2))
    }

    /// The discontinuity buffer averages the texels of each tile.
    pub(super) fn joins(&self) -> bool {
        self.interleave > 1 && !self.fused
    }

    /// The coarse irradiance is smoothed or despeckled.
    pub(super) fn smooths(&self) -> bool {
        self.smoothing > 0 || self.despeckle > 0.0
    }

    /// The upsampling filter runs.
    pub(super) fn upsamples(&self) -> bool {
        self.downsample > 1 || (self.fused && self.interleave > 1)
    }

    /// Shadow rays per pixel to highlights of the environment on smooth surfaces.
    pub fn glossy_rays(&self) -> u32 {
        if self.specular { self.direct_samples.div_ceil(4) } else { 0 }
    }

    /// Short rays compensate the bound. Without a bound there is nothing to compensate.
    pub fn compensates(&self) -> bool {
        self.compensation > 0 && self.bound > 0.0
    }

    /// # Errors
    /// `Usage`, naming the key, the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        let raster = self.visibility == Visibility::Raster;
        let most = if raster { raster::MOST_LIGHTS } else { MOST_LIGHTS };
        if !(self.bounces..=most).contains(&self.vpls) {
            let why = match (raster, self.bounces) {
                (true, _) => {
                    ", at least one for each bounce of a path; with visibility = \"raster\" each virtual light takes three passes over the \
                     scene"
                }
                (false, 1) => "",
                (false, _) => ", because a path leaves one virtual light at each bounce",
            };
            return wrong("vpls", self.vpls, &format!("{} to {most}{why}", self.bounces));
        }
        if raster {
            raster::validate(self)?;
            if self.picks > 0 {
                let what = "picks need shadow rays, but visibility is \"raster\"";
                return Err(Error::usage(what).at("picks").help("Choose picks = 0 or visibility = \"compute\""));
            }
        }
        if self.interleave > 4 && (!self.fused || raster) {
            let allowed = "1 to 4, or 1 to 32 with fused = true and visibility other than \"raster\"";
            return wrong("interleave", self.interleave, allowed);
        }
        if self.refine > 0.0 && (self.picks > 0 || raster) {
            return wrong("refine", self.refine, "0 with picks or visibility = \"raster\"");
        }
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
        Settings { interleave: 32, fused: true, smoothing: 5, ..Settings::default() }.validate().unwrap();
        assert_eq!(Settings { vpls: 181, bounces: 2, ..Settings::default() }.paths(), 90);
    }

    #[test]
    fn an_irregular_subset_has_all_digits() {
        for interleave in 2..=32 {
            let settings = Settings { interleave, fused: true, pattern: Pattern::Irregular, ..Settings::default() };
            let (subsets, stride) = (interleave * interleave, settings.stride());
            let mut seen = vec![false; subsets as usize];
            (0..subsets).for_each(|round| seen[(round * stride % subsets) as usize] = true);
            assert!(seen.iter().all(|&s| s), "{interleave}: {stride} of {subsets}");
            let share = f64::from(stride) / f64::from(subsets);
            assert!(interleave < 4 || (share - 0.618).abs() < 0.06, "{interleave}: {share}");
            assert_eq!(Settings { pattern: Pattern::Regular, ..settings }.stride(), 0);
        }
        // These strides are part of the results that are compared from version to version.
        let stride = |interleave| Settings { interleave, pattern: Pattern::Irregular, ..Settings::default() }.stride();
        assert_eq!([1, 2, 3, 4, 6, 12].map(stride), [0, 3, 5, 9, 23, 89]);
    }

    #[test]
    fn an_error_names_key_value_and_what_is_allowed() {
        let message = |s: Settings| s.validate().unwrap_err().to_string();
        let error = message(Settings { vpls: 0, bounces: 1, ..Settings::default() });
        assert_eq!(error, "vpls: 0 is not allowed; allowed: 1 to 10000");
        let error = message(Settings { bound: f32::NAN, ..Settings::default() });
        assert_eq!(error, "bound: NaN or infinity is not allowed; allowed: 0 to 1");
        let error = message(Settings { vpls: 2, bounces: 3, ..Settings::default() });
        assert!(error.starts_with("vpls: 2 is not allowed; allowed: 3 to 10000"), "{error}");
        // The message gives the same range for a value below it and a value above it.
        let raster = Settings { visibility: Visibility::Raster, ..Settings::default() };
        for vpls in [0, 1, 2049] {
            let error = message(Settings { vpls, ..raster.clone() });
            assert!(error.starts_with(&format!("vpls: {vpls} is not allowed; allowed: 4 to 2048")), "{error}");
        }
        for cache in [0.3, 0.001, -1.0] {
            let error = message(Settings { cache, ..Settings::default() });
            assert_eq!(error, format!("cache: {cache} is not allowed; allowed: 0, or 0.002 to 0.2"));
        }
        Settings { cache: LEAST_CELL, ..Settings::default() }.validate().unwrap();
        for wrong in [
            Settings { bounces: 9, ..Settings::default() },
            Settings { downsample: 0, ..Settings::default() },
            Settings { picks: 1025, ..Settings::default() },
            Settings { compensation: 65, ..Settings::default() },
            Settings { cache: 0.001, ..Settings::default() },
            Settings { cache: f32::NAN, ..Settings::default() },
            Settings { cache_cells: 0, ..Settings::default() },
            Settings { visibility: Visibility::Raster, picks: 4, ..Settings::default() },
            Settings { interleave: 5, ..Settings::default() },
            Settings { interleave: 33, fused: true, ..Settings::default() },
            Settings { interleave: 9, fused: true, visibility: Visibility::Raster, ..Settings::default() },
            Settings { judges: 0, ..Settings::default() },
            Settings { smoothing: 6, ..Settings::default() },
            Settings { despeckle: 0.5, ..Settings::default() },
            Settings { despeckle: f32::NAN, ..Settings::default() },
            Settings { refine: 1.1, ..Settings::default() },
            Settings { refine: f32::NAN, ..Settings::default() },
            Settings { refine: 0.1, picks: 8, ..Settings::default() },
            Settings { refine: 0.1, visibility: Visibility::Raster, ..Settings::default() },
            Settings { specular_depth: 17, ..Settings::default() },
            Settings { direct_samples: 0, ..Settings::default() },
        ] {
            assert_eq!(wrong.validate().unwrap_err().exit_code(), 2, "{wrong:?}");
        }
    }
}
