//! Selective tone mapping, first step: which pixels are important (thesis 4.4.2.1).
//!
//! | [`Identify`] | a pixel is important where |
//! |---|---|
//! | `sobel` | √(x² + y²) > threshold · unit; x and y are the luminance filtered by the kernels (1 2 1)ᵀ (−1 0 1) and their transpose, not normalised; and over 10⁻⁴ of the mean luminance of the pixels that they weigh, below which a step of a bright place would be rounding |
//! | `saliency` | the mean of \|C − S\| / (C + S) (0 where both are 0) over the six pairs of a centre level c = 0, 1, 2 and a surround level c + 3, c + 4 is > threshold |
//! | a mask | its red channel is over 0.5, whatever else is found (objects that matter by what they are, thesis 6.3.2) |
//!
//! Luminance is that of the operator: after exposure and normalisation. The unit is the log-average of the whole picture's luminance
//! ([`ThresholdUnit::LogAverage`]), so that neither the exposure nor the unit of the picture change which pixels are important (but for the 10⁻⁶ of the
//! log-average); a threshold of 2 means a step of half the log-average along an edge of one pixel. The thesis has the unit of the picture
//! ([`ThresholdUnit::Luminance`]): its threshold of 0.1 means a step of 0.025. Samples beyond the border are those of the border.
//!
//! The levels of saliency: G₀ is the luminance, G₍ₖ₊₁₎ is Gₖ filtered by (1 3 3 1) / 8 in both directions between its pixels, every
//! second sample, sizes halved and rounded up; read bilinearly at ((x + ½) / 2ᵏ − ½). This is the intensity channel of Itti and
//! Koch (Vision Research 40, 2000) as the thesis cites it, with relative contrast in place of their normalisation of maps, which needs the whole picture
//! and would see only the sun of an HDR one. The thesis says neither which program made its saliency maps nor over which value they count;
//! [`Settings::threshold`] for saliency is ours.
//!
//! At reduced size f, both work on the luminance averaged over boxes of f × f pixels (those at the right and lower border average what lies
//! inside), and pixel (x, y) takes the answer of (⌊x / f⌋, ⌊y / f⌋). The mask stays at full size.

use super::{Identify, Settings, ThresholdUnit};
use crate::{
    graph::{Buffer, Extent, Format, Graph, Image},
    shaders::tonemap::{octave, saliency, shrink, sobel, spread},
};

/// Levels of the pyramid of saliency.
const LEVELS: usize = 7;

/// Pixels around a pixel on which its importance depends.
pub fn reach(settings: &Settings) -> u32 {
    let factor = settings.identify_scale.max(1);
    match settings.identify {
        // The next box.
        Identify::Sobel => 2 * factor,
        // 64 for two samples of level 6, 63 for the first of the pixels in it and 32 for half of a sample.
        Identify::Saliency => 160 * factor,
    }
}

/// A part of a picture has the same boxes and levels as the whole if it begins at multiples of this.
pub fn grid(settings: &Settings) -> u32 {
    let factor = settings.identify_scale.max(1);
    match settings.identify {
        Identify::Sobel => factor,
        Identify::Saliency => factor << (LEVELS - 1),
    }
}

/// The map of important pixels of `luminance` (R32F): 1 or 0, R32F, of the same size. `statistics` hold the log-average of the whole picture and the
/// factor of normalisation; `mask` has the size of `luminance` (others are cut or count as 0 outside).
pub fn importance(
    graph: &mut Graph,
    luminance: Image,
    statistics: Buffer,
    mask: Option<Image>,
    settings: &Settings,
) -> Image {
    let extent = graph.extent(luminance);
    let factor = settings.identify_scale.max(1);
    if factor == 1 {
        return found(graph, luminance, statistics, mask, settings);
    }
    let size = Extent::new(extent.width.div_ceil(factor), extent.height.div_ceil(factor));
    let small = graph.image("tonemap.small", Format::R32F, size);
    graph.compute(shrink::Args { luminance, small, push: shrink::Push { factor } }, size);
    let found = found(graph, small, statistics, None, settings);
    spread(graph, found, factor, extent, mask)
}

/// A map at full size, with the pixels of a mask.
pub fn masked(graph: &mut Graph, map: Image, mask: Image) -> Image {
    spread(graph, map, 1, graph.extent(map), Some(mask))
}

/// A map that was found at a size reduced by `factor`, at full size.
fn spread(graph: &mut Graph, small: Image, factor: u32, extent: Extent, mask: Option<Image>) -> Image {
    let importance = graph.image("tonemap.importance", Format::R32F, extent);
    let args = spread::Args {
        small,
        mask: mask.unwrap_or(small),
        importance,
        push: spread::Push { factor },
        spec: spread::Spec { has_mask: mask.is_some().into() },
    };
    graph.compute(args, extent);
    importance
}

/// The map at the size of `luminance`.
fn found(graph: &mut Graph, luminance: Image, statistics: Buffer, mask: Option<Image>, settings: &Settings) -> Image {
    let extent = graph.extent(luminance);
    let threshold = settings.threshold();
    let has_mask = mask.is_some().into();
    let mask = mask.unwrap_or(luminance);
    match settings.identify {
        Identify::Sobel => {
            let importance = graph.image("tonemap.importance", Format::R32F, extent);
            let relative = (settings.threshold_unit == ThresholdUnit::LogAverage).into();
            let (push, spec) = (sobel::Push { threshold }, sobel::Spec { has_mask, relative });
            graph.compute(sobel::Args { luminance, statistics, mask, importance, push, spec }, extent);
            importance
        }
        Identify::Saliency => {
            let mut levels = [luminance; LEVELS];
            for k in 1..LEVELS {
                let fine = levels[k - 1];
                let size = graph.extent(fine).div_ceil(2);
                levels[k] = graph.image(format!("tonemap.octave{k}"), Format::R32F, size);
                graph.compute(octave::Args { fine, coarse: levels[k] }, size);
            }
            let importance = graph.image("tonemap.importance", Format::R32F, extent);
            let (push, spec) = (saliency::Push { threshold }, saliency::Spec { has_mask });
            graph.compute(saliency::Args { levels, mask, importance, push, spec }, extent);
            importance
        }
    }
}
