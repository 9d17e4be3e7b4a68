//! What can be chosen in tone mapping.

use super::super::allowed::wrong;
use super::{Operator, identify};
use crate::{
    Result,
    settings::{Described, described},
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which pixels get local adaptation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Mode {
    /// One curve for the whole picture: every pixel adapts to itself.
    Global,
    /// The curve adapts to the neighbourhood of each pixel.
    Local,
    /// Local only where there is detail (Michael 2010, section 4.4).
    Selective,
}

impl Mode {
    /// The name that settings have for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Global => "global",
            Self::Local => "local",
            Self::Selective => "selective",
        }
    }
}

/// How local adaptation is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Local {
    /// Exact averages.
    ///
    /// Ashikhmin, Reinhard: the averages along rows and then along columns, which is the same sum in another order (relative difference of
    /// an average under 10⁻⁵). Bilateral: from blocks of pixels, as [`Settings::spatial`] says.
    Fast,
    /// Several times faster than fast, with nearly the same result.
    ///
    /// Ashikhmin, Reinhard: small averages as [`Local::Fast`], large ones from halved pictures. An approximation; the search among the
    /// averages is that of the definition, at every pixel. Bilateral: as [`Local::Fast`].
    ///
    /// Level 0 is L. A pixel of level l + 1 is the mean of 2 × 2 of level l; sizes are halved and rounded up, and what is missing at the end is
    /// the last row or column once more. With w_d the weights of a Gaussian along one axis at d = −r, …, r, divided by their sum, and
    /// v = Σ w_d d² pixels², its average comes from level 0 for v < 1.5, from level 1 for v < 9, else from level 2. From level 0 it is the
    /// definition's. From level l = 1, 2 it is as follows.
    /// * Means and reading have a variance of their own: a_1 = 1/4 + 3/4, a_2 = 5/4 + 11/4. The rest is a Gaussian narrowed by
    ///   q = √((v − a_l) / v): g(x) = exp(−x² / 2(qσ)²) for |x| ≤ q (r + 1/2), else 0.
    /// * Its weight at D pixels of the level is the mean of g at the 64 places x = 2^l (D − 1/2 + (i + 1/2) / 64), i = 0, …, 63,
    ///   divided by the sum over all D.
    /// * The level is averaged with these along rows and columns, its edges repeated.
    /// * The pixel at x reads that at (x + 1/2) / 2^l − 1/2, bilinearly between pixels of the level, its edges repeated.
    ///
    /// On photographs the averages differ from the definition's by up to 4 % at the mean, and pictures by 0.4 to 5 % RMS, 0.1 to 1.2 % at the
    /// mean and a FLIP of 0.003 to 0.016: single pixels beside edges, for which another average is chosen, without halos or blocks.
    Pyramid,
    /// Ashikhmin: windows of equal weights that grow until one is uneven, a shader's search from pixel to pixel.
    ///
    /// The mean over 2s + 1 pixels to the side stands for the Gaussian average of radius s. Windows grow ring by ring, each sample is read once, and the
    /// search ends at the first window that is not even, so that pixels beside edges take less time. The thesis' operator takes 2.7 to 6.2 times the time of the global
    /// one, and thousands of samples take far more. Its text (4.3.1) asks for an average over *some neighbourhood*.
    Growing,
    /// The definition, far slower: every sample of every neighbourhood of every pixel.
    Literal,
}

/// What makes a pixel important.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Identify {
    /// Magnitude of the Sobel gradient √(Gx² + Gy²) of L, weights 1 2 1 unscaled.
    Sobel,
    /// Centre against surround at several scales.
    Saliency,
}

/// In what unit [`Settings::threshold`] counts for [`Identify::Sobel`]. Saliency is a ratio and has no unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ThresholdUnit {
    /// Log-averages of the picture's luminance: exposure and the unit of the file do not change which pixels are marked.
    LogAverage,
    /// Luminance after the exposure, as in the thesis.
    Luminance,
}

/// How the work on unimportant pixels is avoided. All give the same picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Mark {
    /// A branch in the fragment shader.
    Branch,
    /// Tiles without important pixels are not drawn.
    Tiles,
    /// The map as depth, and early depth tests.
    EarlyZ,
    /// A list of the important pixels, dispatched indirectly.
    Compact,
}

/// What becomes of NaN, infinite and negative values before anything else.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum BadValues {
    /// NaN and infinity become 0, negative values 0.
    Zero,
    /// NaN becomes 0, infinity the largest finite value of its channel in the picture, negative values 0.
    Clamp,
    /// A pixel with NaN or infinity becomes the mean of the good ones among its 8 neighbours (0 without any), negative values 0.
    Neighbour,
    /// They are an error.
    Error,
}

/// All choices.
///
/// Definitions that all operators share: luminance is 0.2126 R + 0.7152 G + 0.0722 B of linear Rec. 709, after the exposure; below 10⁻³⁰ it is
/// 0, above 10¹⁸ it is 10¹⁸. Colour is scaled by L_d / L; alpha is kept. Samples outside of the image are those of its edge.
/// The log-average is exp of the mean of ln(10⁻⁶ + L) over the pixels that are not black (the papers count them: a black background then
/// makes everything else too bright); 10⁻⁶ if all are. The brightest luminance of a picture is white to the global operators, also where it
/// is the only one: a picture of one luminance is white by Ashikhmin's and the bilateral operator (0 counts as its L_min) and by Reinhard's
/// global curve without [`Settings::white`]; by Reinhard's local one it is key / (1 + key). A black picture stays black. A display luminance below 0 is 0; the result is relative to the display's white, and may be over 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Tone mapping operator: how luminances become display luminances.
    #[schemars(extend("x-option" = "Look"))]
    pub operator: Operator,
    /// Which pixels get local adaptation. Left out: local if the operator supports it.
    #[schemars(extend("x-option" = "Look"))]
    pub mode: Option<Mode>,
    /// Stops (EV) before the operator: values are multiplied by 2^exposure.
    #[schemars(range(min = -40, max = 40), extend("x-unit" = "stops"))]
    pub exposure: f32,
    /// Divides luminance by its log-average before the exposure, for pictures in no known unit.
    pub normalize: bool,
    /// Percent of the darkest and of the brightest pixels that may be lost; 0: none, so that one hot pixel decides.
    ///
    /// With n luminances in ascending order, L_min is number ⌈n · percentile/100⌉ (at least 1) and L_max number n + 1 − that; with 0 they are the
    /// true minimum and maximum.
    #[schemars(extend("x-option" = "Look"))]
    #[schemars(range(min = 0, max = 49), extend("x-unit" = "percent"))]
    pub percentile: f32,
    /// Ashikhmin: luminance of the screen's white L_dmax, cd/m².
    #[schemars(extend("x-option" = "Look"))]
    #[schemars(range(min = 1, max = 1e5), extend("x-unit" = "cd/m²", "x-needs" = {"operator": {"const": "ashikhmin"}}))]
    pub display: f32,
    /// Ashikhmin: largest radius s of the averages G_s, pixels. G_s: weights exp(−d² / 2σ²) with σ = s/2 along each axis, s pixels
    /// to each side, divided by their sum.
    #[schemars(range(min = 1, max = 16), extend("x-unit" = "pixels", "x-needs" = {"operator": {"const": "ashikhmin"}, "mode": {"not": {"const": "global"}}}))]
    pub radius: u32,
    /// Ashikhmin: s grows from 1 as long as |G_s − G_2s| < contrast · G_s; L_a is the last G_s for which that held, or G_1.
    #[schemars(range(min = 0, max = 1e6), extend("x-needs" = {"operator": {"const": "ashikhmin"}, "mode": {"not": {"const": "global"}}}))]
    pub contrast: f32,
    /// Reinhard: brightness of the middle; the log-average becomes this value. 0.18 is normal, 0.36 for bright scenes such as snow, 0.09 for dark
    /// ones.
    #[schemars(extend("x-option" = "Look"))]
    #[schemars(range(min = 1e-6, max = 1e6), extend("x-needs" = {"operator": {"const": "reinhard"}}))]
    pub key: f32,
    /// Drago: how much dark light is brightened; 0.85 is the paper's, lower values compress less and are darker.
    #[schemars(extend("x-option" = "Look"))]
    #[schemars(range(min = 0.5, max = 1), extend("x-needs" = {"operator": {"const": "drago"}}))]
    pub bias: f32,
    /// Reinhard-devlin: f, how bright the picture becomes; 0 is the paper's.
    #[schemars(extend("x-option" = "Look"))]
    #[schemars(range(min = -8, max = 8), extend("x-needs" = {"operator": {"const": "reinhard-devlin"}}))]
    pub intensity: f32,
    /// Reinhard-devlin: contrast m. Left out: 0.3 + 0.7 k^1.4 by the key of the picture, k = ln(L_max / log-average) / ln(L_max / L_min),
    /// L_min being at least 10⁻⁶ L_max; 0.3 where that is 0 / 0.
    #[schemars(range(min = 0.1, max = 1), extend("x-needs" = {"operator": {"const": "reinhard-devlin"}}))]
    pub receptor_contrast: Option<f32>,
    /// Reinhard-devlin: c, share of each channel's own light in what it adapts to; the rest is luminance. 0 keeps colours, 1 takes a colour cast away.
    #[schemars(extend("x-option" = "Look"))]
    #[schemars(range(min = 0, max = 1), extend("x-needs" = {"operator": {"const": "reinhard-devlin"}}))]
    pub chromatic: f32,
    /// Reinhard-devlin: a, share of the pixel's own light in what it adapts to; the rest is the mean of the picture. 1 compresses most,
    /// and leaves little contrast in pictures of a wide range.
    #[schemars(extend("x-option" = "Look"))]
    #[schemars(range(min = 0, max = 1), extend("x-needs" = {"operator": {"const": "reinhard-devlin"}}))]
    pub adaptation: f32,
    /// Fattal: the gradient that stays as it is, as a share of the mean gradient of its level; larger ones become smaller.
    #[schemars(range(min = 1e-3, max = 10), extend("x-needs" = {"operator": {"const": "fattal"}}))]
    pub alpha: f32,
    /// Fattal: strength of the compression; 1 is none, 0.8 to 0.9 are the paper's.
    #[schemars(extend("x-option" = "Look"))]
    #[schemars(range(min = 0.5, max = 1), extend("x-needs" = {"operator": {"const": "fattal"}}))]
    pub beta: f32,
    /// Mantiuk: factor of the response to contrasts; 1 leaves them; the lower it is, the more is left of weak contrasts beside strong ones.
    #[schemars(extend("x-option" = "Look"))]
    #[schemars(range(min = 0.01, max = 1), extend("x-needs" = {"operator": {"const": "mantiuk"}}))]
    pub contrast_scale: f32,
    /// Fattal and Mantiuk: percent of the darkest and of the brightest pixels of the result that the display may lose. Left out: 0.5 for fattal, 0.1 for
    /// mantiuk. Counted as in [`Settings::percentile`]. Fattal: they are black and white. Mantiuk: the one that is farther from the median is.
    #[schemars(range(min = 0, max = 49), extend("x-unit" = "percent", "x-needs" = {"operator": {"enum": ["fattal", "mantiuk"]}}))]
    pub clipped: Option<f32>,
    /// Reinhard and reinhard-global: the light that becomes pure white; 0: the brightest of the picture.
    ///
    /// Reinhard: in units of l. Extended Reinhard: in units of L. 0 depends on [`Settings::percentile`].
    #[schemars(extend("x-option" = "Look"))]
    #[schemars(range(min = 0, max = 1e18), extend("x-needs" = {"operator": {"enum": ["reinhard", "reinhard-global"]}}))]
    pub white: f32,
    /// Reinhard: scales s of dodging and burning. s = 1.6^i for i = 0, 1, …; V_i is the Gaussian average of σ = s/4, ⌈3σ⌉ pixels
    /// to each side, of l. l_a is V_i of the largest i < scales before |V_i − V_(i+1)| / (2^phi · key / s² + V_i) ≥ epsilon, or V_0.
    #[schemars(range(min = 1, max = 8), extend("x-needs" = {"operator": {"const": "reinhard"}, "mode": {"not": {"const": "global"}}}))]
    pub scales: u32,
    /// Reinhard: sharpening φ.
    #[schemars(range(min = 0, max = 32), extend("x-needs" = {"operator": {"const": "reinhard"}, "mode": {"not": {"const": "global"}}}))]
    pub phi: f32,
    /// Reinhard: largest activity ε.
    #[schemars(range(min = 0, max = 1e6), extend("x-needs" = {"operator": {"const": "reinhard"}, "mode": {"not": {"const": "global"}}}))]
    pub epsilon: f32,
    /// Bilateral: σ in space, share of the longer side; at least half a pixel. Weights are exp(−d² / 2σ²) of the distance, the filter
    /// reaches ⌈2σ⌉ pixels along each axis; literal: at most 80 pixels. Fast: a block of ⌈σ/3⌉² pixels that the reach touches stands for
    /// its pixels by two samples at its centre, the mean of the logarithms up to the block's mean and the mean of those above it, each
    /// with the weight of the number of its pixels; the pixel itself is added once more. The same as literal up to σ = 3.
    #[schemars(range(min = 0, max = 0.25), extend("x-needs" = {"operator": {"const": "bilateral"}, "mode": {"not": {"const": "global"}}}))]
    pub spatial: f32,
    /// Bilateral: σ of log₁₀ L.
    #[schemars(range(min = 1e-3, max = 1e3), extend("x-needs" = {"operator": {"const": "bilateral"}, "mode": {"not": {"const": "global"}}}))]
    pub range: f32,
    /// Bilateral: contrast of the base on the display.
    #[schemars(range(min = 1, max = 1e6), extend("x-needs" = {"operator": {"const": "bilateral"}}))]
    pub base_contrast: f32,
    /// Bilateral: strength of fine detail; 1 leaves it.
    #[schemars(extend("x-option" = "Look"))]
    #[schemars(range(min = 0, max = 16), extend("x-needs" = {"operator": {"const": "bilateral"}, "mode": {"not": {"const": "global"}}}))]
    pub detail: f32,
    /// Ashikhmin, Reinhard, bilateral, reinhard-global, drago, fattal and mantiuk: strength of colours; 1 keeps their ratios, as in most papers; 0 is grey.
    /// Left out: 0.7 for ashikhmin and bilateral, 0.85 for reinhard and drago, 0.5 for fattal, 0.6 for mantiuk, 1 for reinhard-global.
    ///
    /// The exponent of the ratios of colour to luminance (Tumblin and Turk 1999). An operator that compresses luminance and keeps the ratios makes
    /// dark places look too colourful.
    #[schemars(extend("x-option" = "Look"))]
    #[schemars(range(min = 0, max = 4), extend("x-needs" = {"operator": {"enum": ["ashikhmin", "reinhard", "bilateral", "reinhard-global", "drago", "fattal", "mantiuk"]}}))]
    pub saturation: Option<f32>,
    /// Local operators: largest ratio of a pixel's luminance to its local adaptation, either way; beyond it the pixel follows the global curve, so
    /// that edges get no halos. 1: global; 1e6: no limit, as in the papers. Left out: 1.2 for ashikhmin, no limit for the others.
    ///
    /// L_a is limited to L / limit … L · limit (bilateral: the base B). Not in the papers.
    #[schemars(extend("x-option" = "Local and selective operators"))]
    #[schemars(range(min = 1, max = 1e6), extend("x-needs" = {"operator": {"enum": ["ashikhmin", "reinhard", "bilateral"]}, "mode": {"not": {"const": "global"}}}))]
    pub contrast_limit: Option<f32>,
    #[schemars(extend("x-needs" = {"operator": {"enum": ["ashikhmin", "reinhard", "bilateral"]}, "mode": {"not": {"const": "global"}}}))]
    /// How local adaptation is computed.
    #[schemars(extend("x-option" = "Local and selective operators"))]
    pub local: Local,
    /// Selective: the measure of detail.
    #[schemars(extend("x-option" = "Local and selective operators"))]
    #[schemars(extend("x-needs" = {"mode": {"const": "selective"}}))]
    pub identify: Identify,
    /// Selective: threshold of the measure; a lower threshold marks more pixels. Left out: for sobel 2 log-averages, or 0.1 with the unit luminance; 0.4
    /// for saliency (0 to 1).
    ///
    /// The thesis names 0.1 of the picture's unit for Sobel, and no threshold for saliency. Two log-averages are 3 to 40 % of a photograph. For saliency
    /// 0.1 would be four fifths of a photograph, 0.4 is a quarter to a third.
    #[schemars(extend("x-option" = "Local and selective operators"))]
    #[schemars(range(min = 0, max = 1e18), extend("x-needs" = {"mode": {"const": "selective"}}))]
    pub threshold: Option<f32>,
    /// Selective: the unit of the threshold for sobel.
    #[schemars(extend("x-needs" = {"mode": {"const": "selective"}, "identify": {"const": "sobel"}}))]
    pub threshold_unit: ThresholdUnit,
    /// Selective: identification on the picture reduced so many times.
    #[schemars(extend("enum" = [1, 2, 4], "x-needs" = {"mode": {"const": "selective"}}))]
    pub identify_scale: u32,
    /// Selective: how unimportant pixels are skipped; the picture does not depend on it.
    #[schemars(extend("x-option" = "Local and selective operators"))]
    #[schemars(extend("x-needs" = {"mode": {"const": "selective"}}))]
    pub mark: Mark,
    /// Selective: frames of a sequence for which a map of important pixels is used; with 1 each frame finds its own.
    ///
    /// The thesis proposes to use maps again in the next frames (6.3.2). Where something moves, an older map has its edges at their old place.
    #[schemars(range(min = 1, max = 240), extend("x-unit" = "frames", "x-needs" = {"mode": {"const": "selective"}}))]
    pub keep_map: u32,
    /// Selective: names of nodes and materials of the scene, with commas between them, whose pixels are important whatever their luminance. The
    /// children of a named node are important too. Only renderers of scenes use it; empty: none.
    ///
    /// The thesis proposes to let pixels be important by what they show, for instance the main character of a game (6.3.2).
    #[schemars(extend("x-needs" = {"mode": {"const": "selective"}}))]
    pub important: String,
    /// Treatment of NaN, infinite and negative samples, before anything else.
    #[schemars(extend("x-option" = "Input"))]
    pub bad_values: BadValues,
    /// Seconds in which adaptation to a brighter picture comes within 1/e, in sequences; 0: at once.
    #[schemars(range(min = 0, max = 3600), extend("x-unit" = "s"))]
    pub adapt_up: f32,
    /// The same to a darker one.
    #[schemars(range(min = 0, max = 3600), extend("x-unit" = "s"))]
    pub adapt_down: f32,
    /// Adaptation changes by at most so many stops a second; 0: no limit. What is left of a way of w stops after t seconds does not depend
    /// on the number of frames: dw/dt = −min(w / adapt_…, adapt_limit).
    #[schemars(range(min = 0, max = 1e6), extend("x-unit" = "stops/s"))]
    pub adapt_limit: f32,
    /// Seconds in which the local adaptation of a pixel comes within 1/e of that of the frame, in sequences; 0: at once.
    ///
    /// The thesis interpolates it between frames (4.4.2.2), against flicker where the map of important pixels changes. Moving objects then leave trails.
    #[schemars(range(min = 0, max = 3600), extend("x-unit" = "s", "x-needs" = {"operator": {"enum": ["ashikhmin", "reinhard", "bilateral"]}, "mode": {"not": {"const": "global"}}}))]
    pub adapt_local: f32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            operator: Operator::Ashikhmin,
            mode: None,
            exposure: 0.0,
            normalize: false,
            percentile: 0.0,
            display: 100.0,
            radius: 10,
            contrast: 0.5,
            key: 0.18,
            bias: 0.85,
            intensity: 0.0,
            receptor_contrast: None,
            chromatic: 0.0,
            adaptation: 0.9,
            alpha: 0.1,
            beta: 0.9,
            contrast_scale: 0.3,
            clipped: None,
            white: 0.0,
            scales: 8,
            phi: 8.0,
            epsilon: 0.05,
            spatial: 0.02,
            range: 0.4,
            base_contrast: 5.0,
            detail: 1.0,
            saturation: None,
            contrast_limit: None,
            local: Local::Fast,
            identify: Identify::Sobel,
            threshold: None,
            threshold_unit: ThresholdUnit::LogAverage,
            identify_scale: 1,
            mark: Mark::EarlyZ,
            keep_map: 1,
            important: String::new(),
            bad_values: BadValues::Zero,
            adapt_up: 0.4,
            adapt_down: 1.2,
            adapt_limit: 6.0,
            adapt_local: 0.0,
        }
    }
}

/// A [`Settings::contrast_limit`] from which there is no limit.
pub const NO_LIMIT: f32 = 1e6;

impl Settings {
    /// The settings of the papers: colours keep their ratios, no limit of contrast, the threshold counts in the picture's unit.
    pub fn paper() -> Self {
        Self {
            saturation: Some(1.0),
            contrast_limit: Some(NO_LIMIT),
            threshold_unit: ThresholdUnit::Luminance,
            ..Self::default()
        }
    }

    /// The saturation that is used.
    pub fn saturation(&self) -> f32 {
        self.saturation.unwrap_or(match self.operator {
            Operator::Ashikhmin | Operator::Bilateral => 0.7,
            Operator::Reinhard | Operator::Drago => 0.85,
            Operator::Fattal => 0.5,
            Operator::Mantiuk => 0.6,
            _ => 1.0,
        })
    }

    /// The contrast limit that is used; `None`: no limit.
    pub fn contrast_limit(&self) -> Option<f32> {
        let usual = if self.operator == Operator::Ashikhmin { 1.2 } else { NO_LIMIT };
        Some(self.contrast_limit.unwrap_or(usual)).filter(|limit| *limit < NO_LIMIT && !self.operator.solves())
    }

    /// The mode that is used.
    pub fn mode(&self) -> Mode {
        let local = self.operator.has_local() || self.operator.solves();
        self.mode.unwrap_or(if local { Mode::Local } else { Mode::Global })
    }

    /// The share of clipped pixels that is used, percent.
    pub fn clipped(&self) -> f32 {
        self.clipped.unwrap_or(if self.operator == Operator::Fattal { 0.5 } else { 0.1 })
    }

    /// The threshold that is used.
    pub fn threshold(&self) -> f32 {
        self.threshold.unwrap_or(match (self.identify, self.threshold_unit) {
            (Identify::Sobel, ThresholdUnit::LogAverage) => 2.0,
            (Identify::Sobel, ThresholdUnit::Luminance) => 0.1,
            (Identify::Saliency, _) => 0.4,
        })
    }

    /// σ in pixels and reach to each side of the bilateral filter of a picture.
    pub fn bilateral(&self, width: u32, height: u32) -> (f32, u32) {
        let sigma = (self.spatial * width.max(height) as f32).max(0.5);
        (sigma, (2.0 * sigma).ceil() as u32)
    }

    /// Pixels around a pixel that its result depends on, beside the statistics.
    pub fn reach(&self, width: u32, height: u32) -> u32 {
        let identification = if self.mode() == Mode::Selective { identify::reach(self) } else { 0 };
        let local = match (self.mode(), self.operator) {
            (Mode::Global, _) => 0,
            (_, Operator::Ashikhmin | Operator::Reinhard) if self.local == Local::Pyramid => {
                let search = super::search::Search::new(self);
                let averages = search.as_ref().map(super::pyramid::averages).unwrap_or_default();
                averages.iter().map(|average| average.reach() as u32).max().unwrap_or(0)
            }
            (_, Operator::Ashikhmin) => 2 * self.radius,
            (_, Operator::Reinhard) => (0.75 * 1.6f32.powi(self.scales as i32)).ceil() as u32,
            // Blocks that the filter touches are needed whole.
            (_, Operator::Bilateral) => {
                self.bilateral(width, height).1 + super::bilateral::block_side((width, height).into(), self)
            }
            _ => 0,
        };
        local.max(identification)
    }

    /// # Errors
    /// `Usage`, naming the key, the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        let name = self.operator.name();
        match self.mode {
            Some(mode) if self.operator.solves() && mode != Mode::Local => {
                let allowed = format!("local, for the operator {name} works on the picture as a whole");
                return wrong("mode", mode.name(), &allowed);
            }
            _ if self.local == Local::Growing
                && self.mode() != Mode::Global
                && self.operator != Operator::Ashikhmin =>
            {
                return wrong(
                    "local",
                    "growing",
                    "fast, literal and pyramid, for growing windows are of the operator ashikhmin alone",
                );
            }
            Some(mode) if !self.operator.solves() && !self.operator.has_local() && mode != Mode::Global => {
                let allowed = format!("global, for the operator {name} is a curve without local component");
                return wrong("mode", mode.name(), &allowed);
            }
            _ => {}
        }
        Self::description().check(self)
    }
}

described!(Settings);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_curves_are_global() {
        for (name, operator) in Operator::ALL {
            let settings = Settings { operator, ..Settings::default() };
            settings.validate().unwrap();
            assert_eq!(operator.name(), name);
            assert_eq!(settings.mode() == Mode::Global, !operator.has_local() && !operator.solves());
            let parsed: Settings = toml::from_str(&format!("operator = \"{name}\"")).unwrap();
            assert_eq!(parsed, settings);
        }
    }

    #[test]
    fn an_error_names_key_value_and_what_is_allowed() {
        let message = |s: Settings| s.validate().unwrap_err().to_string();
        let curve = Settings { operator: Operator::Aces, mode: Some(Mode::Local), ..Settings::default() };
        let wanted =
            "mode: local is not allowed; allowed: global, for the operator aces is a curve without local component";
        assert_eq!(message(curve), wanted);
        for mode in [Mode::Global, Mode::Selective] {
            let whole = Settings { operator: Operator::Fattal, mode: Some(mode), ..Settings::default() };
            let wanted = "is not allowed; allowed: local, for the operator fattal works on the picture as a whole";
            assert_eq!(message(whole), format!("mode: {} {wanted}", mode.name()));
        }
        let wanted = "exposure: NaN or infinity is not allowed; allowed: -40 to 40";
        assert_eq!(message(Settings { exposure: f32::NAN, ..Settings::default() }), wanted);
        let wanted = "radius: 17 is not allowed; allowed: 1 to 16";
        assert_eq!(message(Settings { radius: 17, ..Settings::default() }), wanted);
        assert!(toml::from_str::<Settings>("radios = 3").unwrap_err().to_string().contains("radius"));
    }
}
