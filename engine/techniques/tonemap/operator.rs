//! The operators.

use super::Settings;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How luminances become display luminances. L is the luminance of a pixel after [`Settings::exposure`], L_a its local adaptation,
/// which is L itself in [`Mode::Global`](super::Mode::Global).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Operator {
    /// Ashikhmin, "A tone mapping algorithm for high contrast images", 2002: L_d = TM(L_a) + TVI(TM(L_a)) / TVI(L_a) · (L − L_a),
    /// TM(L) = L_dmax · (C(L) − C(L_min)) / (C(L_max) − C(L_min)). Luminances are taken as cd/m².
    Ashikhmin,
    /// Reinhard, Stark, Shirley, Ferwerda, "Photographic tone reproduction for digital images", 2002. With l = key · L / log-average:
    /// global l (1 + l / white²) / (1 + l) (equation 4), local l / (1 + l_a) (equation 9), l_a by dodging and burning.
    Reinhard,
    /// Durand, Dorsey, "Fast bilateral filtering for the display of high-dynamic-range images", 2002. With B the base, the bilateral
    /// filter of log₁₀ L, and D = log₁₀ L − B the detail: log₁₀ L_d = γ (B − log₁₀ L_max) + `detail` · D,
    /// γ = log₁₀(`base_contrast`) / (log₁₀ L_max − log₁₀ L_min), at most 1, L_min
    /// being at least 10⁻⁴ L_max. L is taken as at least 10⁻⁶ L_max. Global: B = log₁₀ L.
    Bilateral,
    /// The values as they are, times 2^exposure.
    Linear,
    /// Extended Reinhard without a key: L (1 + L / white²) / (1 + L); `white` 0 is L_max.
    ReinhardGlobal,
    /// Stephen Hill's fit of the ACES reference rendering and output transforms for sRGB displays (BakingLab, 2015), per channel
    /// between its two matrices. No exposure factor is hidden in it.
    Aces,
    /// Troy Sobotka's AgX (2022), base look: inset matrix, log₂ from −12.47393 to 4.026069 onto 0 to 1, the sigmoid
    /// y = 1/2 + 2 (x − t) (1 + (4^p − |T|^−p) |x − t|^p)^(−1/p) with t = 20/33, p = 3 and T = t below t, p = 3.25 and T = 1 − t above,
    /// outset matrix (the inverse of the inset), and the power 2.2, which makes it linear.
    Agx,
    /// Khronos PBR Neutral (specification of 2024): colours below 0.76 keep hue and saturation.
    Neutral,
    /// Drago, Myszkowski, Annen, Chiba, "Adaptive logarithmic mapping for displaying high contrast scenes", 2003. With l = L / L_wa,
    /// L_wa = log-average / (1 + `bias` − 0.85)⁵: L_d = ln(1 + l) / (log₁₀(1 + l_max) · ln(2 + 8 (l / l_max)^(ln `bias` / ln 0.5))) (equation 4), 1 being
    /// white. Beyond l_max the last power stays 1. The paper's own transfer function of the display is left to the file.
    Drago,
    /// Reinhard, Devlin, "Dynamic range reduction inspired by photoreceptor physiology", 2005. Each channel I becomes I / (I + (f · I_a)^m), stretched
    /// so that the smallest and the largest value of the picture are black and white. f = exp(−`intensity`). With c = `chromatic` and
    /// a = `adaptation`: I_a = a (c I + (1 − c) L) + (1 − a) (c I_av + (1 − c) L_av), the means I_av and L_av being those of the picture.
    ReinhardDevlin,
    /// Fattal, Lischinski, Werman, "Gradient domain high dynamic range compression", 2002. With H = log₁₀ L, L being at least 10⁻⁶ L_max: gradients of H
    /// are multiplied by Φ, the product over the levels k of a pyramid of φ_k = (max(|∇H_k|, α_k / 10) / α_k)^(`beta` − 1),
    /// α_k = `alpha` · the mean of |∇H_k|. log₁₀ of the light has the gradients that are nearest to these (a Poisson equation); light
    /// from one percentile to the other is stretched from black to white (`clipped`).
    Fattal,
    /// Mantiuk, Myszkowski, Seidel, "A perceptual framework for contrast processing of high dynamic range images", 2006, contrast mapping. The contrasts G of
    /// neighbours at all levels of a pyramid of log₁₀ L, L being at least 10⁻⁶ L_max, have a response R = ∫ dG / ΔG, ΔG = 0.038737 max(G, log₁₀ 1.05)^0.537756,
    /// which is multiplied by `contrast_scale`. log₁₀ of the light has the contrasts Ĝ that are nearest to these (conjugate gradients), each with the weight
    /// 1 / (0.038737 max(Ĝ, 0.001)^0.537756). It becomes the display's codes (equation 26), the median half
    /// of white's, and L_d the power 2.2 of them.
    Mantiuk,
}

impl Operator {
    /// All, with the names that settings have for them.
    pub const ALL: [(&'static str, Self); 12] = [
        ("ashikhmin", Self::Ashikhmin),
        ("reinhard", Self::Reinhard),
        ("bilateral", Self::Bilateral),
        ("linear", Self::Linear),
        ("reinhard-global", Self::ReinhardGlobal),
        ("aces", Self::Aces),
        ("agx", Self::Agx),
        ("neutral", Self::Neutral),
        ("drago", Self::Drago),
        ("reinhard-devlin", Self::ReinhardDevlin),
        ("fattal", Self::Fattal),
        ("mantiuk", Self::Mantiuk),
    ];

    /// The name that settings have for it.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(_, o)| *o == self).map_or("", |(name, _)| name)
    }

    /// It has a local component beside a curve, and so the modes local and selective.
    pub fn has_local(self) -> bool {
        matches!(self, Self::Ashikhmin | Self::Reinhard | Self::Bilateral)
    }

    /// Solves one equation for all pixels of the picture, and so has the mode local and no other.
    pub fn solves(self) -> bool {
        matches!(self, Self::Fattal | Self::Mantiuk)
    }

    /// Its result depends on the luminances of the whole picture.
    pub fn needs_statistics(self, settings: &Settings) -> bool {
        self.has_local()
            || self.solves()
            || matches!(self, Self::Drago | Self::ReinhardDevlin)
            || (self == Self::ReinhardGlobal && settings.white == 0.0)
            || settings.normalize
    }
}
