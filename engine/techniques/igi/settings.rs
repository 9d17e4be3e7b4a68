//! What can be chosen in instant global illumination, and what the paper chose.

use super::{
    super::allowed::{within, wrong},
    raster,
};
use crate::{Error, Result, shaders::consts::CACHE_CELLS};
use serde::{Deserialize, Serialize};

/// Least side of a cell: keys have nine bits an axis.
pub(super) const LEAST_CELL: f32 = 0.002;
const MOST_CELL: f32 = 0.2;
/// Virtual lights of a frame.
const MOST_LIGHTS: u32 = 10_000;

/// How rays are traced.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Visibility {
    /// By ray queries where the device has them and is no CPU driver (there: where they are asked for), else in compute.
    #[default]
    Auto,
    /// Through our own trees in a compute shader, on any device.
    Compute,
    /// By ray queries; an error of kind `Usage` where the device has none.
    Query,
    /// Virtual lights by shadow maps that the rasteriser draws, three each. Everything else (paths of light, direct light, what mirrors
    /// and glass show) as with `Auto`.
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

/// Where the subsets of interleaved sampling lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pattern {
    /// The same in every tile (paper).
    #[default]
    Regular,
    /// In another order in every tile, so that no pattern repeats. The tile around a pixel may then have a subset twice. Each subset has
    /// light from all directions, where in the regular pattern with 3 × 3 it has a ninth of them.
    Irregular,
}

/// Settings of the technique.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Virtual point lights at most, 1 to 10,000 and no less than `bounces`. There are ⌊vpls / bounces⌋ paths of light; those that leave
    /// the scene, or end on something black, leave fewer.
    pub vpls: u32,
    /// Paths that are shot for each that virtual lights are kept of, 1 to 64: of what they leave, that is kept which matters to the view.
    /// 1: whatever they leave, as in the paper.
    pub candidates: u32,
    /// Virtual lights along a path at most, 1 to 8: bounces of indirect light.
    pub bounces: u32,
    /// Visible surfaces that candidates are judged by, 1 to 1024, a shadow ray for each from each. With few, what matters to a small part
    /// of the view is missed and counts as rarely as is safe.
    pub judges: u32,
    /// Bounding distance min_d of the geometry term, as share of the diagonal of the box around the scene at rest, without
    /// unlit surfaces, which light passes; 0 switches the bound off. Virtual lights nearer than 0.8 of it give nothing, from 1.2 of it on
    /// they give everything.
    pub bound: f32,
    /// Virtual lights that each pixel picks by what they may send to it, 1 to 1024, instead of gathering from all: cost grows with the
    /// logarithm of their number, for noise. Tiles of interleaved pixels share the picks. Where there are no more than four virtual lights for
    /// each pick, all are gathered. 0: all, no picks.
    pub picks: u32,
    /// Virtual lights proposed for each pick, 1 to 16: of these that is taken, at random, which sends more if nothing is in the way.
    pub proposals: u32,
    /// Short rays of each gathered pixel that put back the light which the bound takes, 0 to 64. 0: it is lost.
    pub compensation: u32,
    /// Side of the cells in which the light of virtual lights on what mirrors and glass show is kept, as share of the same diagonal,
    /// 0.002 to 0.2; 0: every surface that they show gathers for itself.
    pub cache: f32,
    /// Such cells at most, 1 to 131,072. With more, every surface gathers for itself ([`Cache::note`](super::Cache::note)).
    pub cache_cells: u32,
    /// Shadow rays of virtual lights test the boxes of triangles instead of triangles.
    pub imperfect: bool,
    /// Pixels along the side of a texel on which indirect light is gathered, 1 to 4.
    pub downsample: u32,
    /// The pixel that a texel stands for is not the one in the middle of those that it covers, but another one from texel to texel, so that
    /// thin things are met by some.
    pub scattered: bool,
    /// Side of the tiles of pixels that share the virtual lights, 1 to 4, with `fused` to 32: each pixel gathers from one of side² subsets.
    /// With more virtual lights in larger tiles each pixel has as many shadow rays as before, and its neighbours have others.
    pub interleave: u32,
    pub pattern: Pattern,
    /// Virtual lights are sorted by place and normal before tiles of pixels share them, so that each subset has some from every part of
    /// the scene. With `picks` and with `compensation` they are sorted anyway.
    pub sorted: bool,
    /// One filter instead of two: upsampling reads the interleaved texels themselves.
    pub fused: bool,
    /// Turns, 0 to 5, in which what was gathered is smoothed before it is upsampled, by the same weights for normals and distance from the
    /// plane: n turns are about a Gaussian of standard deviation 1, 2.2, 4.6, 9.2, 18 texels of the coarse picture. 0: none.
    pub smoothing: u32,
    /// A texel brighter than the mean of its neighbours on the same surface by more than this factor is dimmed to it before smoothing, 1 to
    /// 1000: few virtual lights near a surface make specks that no filter can hide. 0: none is.
    pub despeckle: f32,
    /// Where less than this share of the Gaussian of upsampling falls on texels that match in normal and plane one three times as wide is
    /// tried, and where that fails too the pixel gathers for itself, from one subset: thin things that no texel met. 0 to 1; 0: nowhere. Not
    /// with `picks`, nor with `visibility` `raster`.
    pub refine: f32,
    /// Standard deviation of the Gaussian of upsampling, texels of the coarse picture, 0.1 to 4.
    pub upsample_sigma: f32,
    /// Exponent of the cosine between normals in upsampling, 0 to 64; the paper has 1.
    pub upsample_normal: f32,
    /// Distance from the pixel's plane, relative to its depth, at which a coarse texel weighs 0.6; 0: depth does not count (paper).
    pub upsample_range: f32,
    /// Most difference of depth, relative to the texel's, over which interleaved texels are joined.
    pub discontinuity_depth: f32,
    /// Least cosine between their normals.
    pub discontinuity_normal: f32,
    /// Frames of a sequence whose indirect light counts, 0 to 10,000; the virtual lights of each are others. 1: none but the frame's own.
    /// 0: no history, and the same random numbers in every frame.
    pub history: u32,
    /// Relative error that indirect light may have because it changes faster than the history forgets, 0.001 to 10.
    pub history_lag: f32,
    /// Distance from a surface of the last frame, relative to its depth, within which it counts as the same.
    pub history_range: f32,
    /// For the shadow rays of virtual lights with `imperfect` always in compute.
    pub visibility: Visibility,
    /// Texels of a side of the shadow maps of virtual lights with `visibility` `raster`, 16 to 1024.
    pub raster_size: u32,
    /// Gather indirect light.
    pub indirect: bool,
    /// Mirrors, glass, and GGX highlights of direct light. Without, every surface reflects its diffuse part alone.
    pub specular: bool,
    /// Mirrors and glass one behind the other, 0 to 16, seen by the camera and passed by light.
    pub specular_depth: u32,
    /// Shadow rays a pixel for emissive surfaces, and as many for the environment, 1 to 4096. Other lights have one each.
    pub direct_samples: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            vpls: 180,
            candidates: 8,
            bounces: 2,
            judges: 96,
            bound: 0.02,
            picks: 0,
            proposals: 4,
            compensation: 0,
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
        }
    }
}

impl Settings {
    /// The paper's fastest variant: 180 virtual lights, boxes, a quarter of the resolution, tiles of 3×3. It states neither the
    /// bounces of a path nor min_d; taken here are the defaults.
    pub fn paper() -> Self {
        Self {
            candidates: 1,
            imperfect: true,
            downsample: 4,
            interleave: 3,
            upsample_normal: 1.0,
            upsample_range: 0.0,
            ..Self::default()
        }
    }

    /// Paths of light.
    pub fn paths(&self) -> u32 {
        (self.vpls / self.bounces.max(1)).max(1)
    }

    /// Surfaces pick from so many virtual lights. From few it costs less to gather from all, without noise.
    pub fn picks_from(&self, vpls: u32) -> bool {
        self.picks > 0 && vpls > 4 * self.picks
    }

    /// Subsets by which the virtual lights of an irregular subset move on from round to round: about the golden ratio of their number,
    /// and without a common factor, so that in the end a subset has had all of them. 0: the pattern is regular.
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

    /// Picks of a texel: pixels of a tile share them.
    pub fn texel_picks(&self) -> u32 {
        self.picks.div_ceil(self.interleave.max(1).pow(2))
    }

    /// The discontinuity buffer joins the pixels of tiles.
    pub(super) fn joins(&self) -> bool {
        self.interleave > 1 && !self.fused
    }

    /// What was gathered is smoothed.
    pub(super) fn smooths(&self) -> bool {
        self.smoothing > 0 || self.despeckle > 0.0
    }

    /// Pixels take light from texels around.
    pub(super) fn upsamples(&self) -> bool {
        self.downsample > 1 || (self.fused && self.interleave > 1)
    }

    /// Short rays put light back: there is a bound that takes some.
    pub fn compensates(&self) -> bool {
        self.compensation > 0 && self.bound > 0.0
    }

    /// # Errors
    /// `Usage`, naming the key, the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        let raster = self.visibility == Visibility::Raster;
        within([
            ("candidates", self.candidates, 1, 64),
            ("judges", self.judges, 1, 1024),
            ("bounces", self.bounces, 1, 8),
            ("picks", self.picks, 0, 1024),
            ("proposals", self.proposals, 1, 16),
            ("compensation", self.compensation, 0, 64),
            ("cache_cells", self.cache_cells, 1, CACHE_CELLS),
            ("downsample", self.downsample, 1, 4),
            ("interleave", self.interleave, 1, 32),
            ("smoothing", self.smoothing, 0, 5),
            ("history", self.history, 0, 10_000),
            ("specular_depth", self.specular_depth, 0, 16),
            ("direct_samples", self.direct_samples, 1, 4096),
            ("raster_size", self.raster_size, 16, 1024),
        ])?;
        let most = if raster { raster::MOST_LIGHTS } else { MOST_LIGHTS };
        if !(self.bounces..=most).contains(&self.vpls) {
            let why = match (raster, self.bounces) {
                (true, _) => {
                    ", one for each bounce of a path at least, and with visibility = \"raster\" three passes over the scene for each"
                }
                (false, 1) => "",
                (false, _) => ", for a path leaves one at each of its bounces",
            };
            return wrong("vpls", self.vpls, &format!("{} to {most}{why}", self.bounces));
        }
        if raster {
            raster::validate(self)?;
            if self.picks > 0 {
                let what = "picks need rays, and visibility is \"raster\"";
                return Err(Error::usage(what).at("picks").help("Choose picks = 0 or visibility = \"compute\""));
            }
        }
        if self.interleave > 4 && (!self.fused || raster) {
            let allowed = "1 to 4, up to 32 with fused = true and virtual lights by rays";
            return wrong("interleave", self.interleave, allowed);
        }
        if self.despeckle != 0.0 && !(1.0..=1000.0).contains(&self.despeckle) {
            return wrong("despeckle", self.despeckle, "0, or 1 to 1000");
        }
        if self.refine > 0.0 && (self.picks > 0 || raster) {
            return wrong("refine", self.refine, "0 with picks or visibility = \"raster\"");
        }
        if self.cache != 0.0 && !(LEAST_CELL..=MOST_CELL).contains(&self.cache) {
            return wrong("cache", self.cache, &format!("0, or {LEAST_CELL} to {MOST_CELL}"));
        }
        within([
            ("bound", self.bound, 0.0, 1.0),
            ("refine", self.refine, 0.0, 1.0),
            ("upsample_sigma", self.upsample_sigma, 0.1, 4.0),
            ("upsample_normal", self.upsample_normal, 0.0, 64.0),
            ("upsample_range", self.upsample_range, 0.0, 1e6),
            ("discontinuity_depth", self.discontinuity_depth, 0.0, 1e6),
            ("discontinuity_normal", self.discontinuity_normal, -1.0, 1.0),
            ("history_lag", self.history_lag, 0.001, 10.0),
            ("history_range", self.history_range, 0.0, 1e6),
        ])
    }
}

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
        // As it was where that was right.
        let stride = |interleave| Settings { interleave, pattern: Pattern::Irregular, ..Settings::default() }.stride();
        assert_eq!([1, 2, 3, 4, 6, 12].map(stride), [0, 3, 5, 9, 23, 89]);
    }

    #[test]
    fn an_error_names_key_value_and_what_is_allowed() {
        let message = |s: Settings| s.validate().unwrap_err().to_string();
        let error = message(Settings { vpls: 0, bounces: 1, ..Settings::default() });
        assert_eq!(error, "vpls: 0 is not allowed; allowed: 1 to 10000");
        let error = message(Settings { bound: f32::NAN, ..Settings::default() });
        assert_eq!(error, "bound: NaN is not allowed; allowed: 0 to 1");
        let error = message(Settings { vpls: 2, bounces: 3, ..Settings::default() });
        assert!(error.starts_with("vpls: 2 is not allowed; allowed: 3 to 10000"), "{error}");
        // The same range, whichever end is missed.
        let raster = Settings { visibility: Visibility::Raster, ..Settings::default() };
        for vpls in [0, 1, 2049] {
            let error = message(Settings { vpls, ..raster.clone() });
            assert!(error.starts_with(&format!("vpls: {vpls} is not allowed; allowed: 2 to 2048")), "{error}");
        }
        for cache in [0.3, 0.001, -1.0, f32::NAN] {
            let error = message(Settings { cache, ..Settings::default() });
            assert_eq!(error, format!("cache: {cache} is not allowed; allowed: 0, or 0.002 to 0.2"));
        }
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
