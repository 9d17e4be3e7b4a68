//! The base of the bilateral operator.

use super::{Local, Operator, Settings};
use crate::{
    Error, Result,
    graph::{Buffer, Extent, Format, Graph, Image},
    shaders::{
        tonemap::{base, blocks, logarithm},
        types::TonemapBilateral,
    },
};

/// Samples to each side that the literal way takes at most: 161² of them are within what one invocation may do.
const LITERAL_REACH: u32 = 80;
/// Values of a block that are looked at along each side, at most.
const BLOCK_SAMPLES: u32 = 64;

/// Side in pixels of the blocks that stand for their pixels in the filter of a picture; 1 where each stands for itself.
pub fn block_side(picture: Extent, settings: &Settings) -> u32 {
    match settings.local {
        Local::Literal | Local::Growing => 1,
        Local::Fast | Local::Pyramid => {
            (settings.bilateral(picture.width, picture.height).0 / 3.0).ceil().max(1.0) as u32
        }
    }
}

/// [`block_side`], or 1 for operators without blocks.
pub(super) fn block_side_of(picture: Extent, settings: &Settings) -> u32 {
    if settings.operator == Operator::Bilateral { block_side(picture, settings) } else { 1 }
}

/// Base luminance of every pixel, R32F. `picture`: extent of the whole picture, of which `luminance` may be a part that begins at a
/// multiple of [`block_side`].
///
/// # Errors
/// `Usage` if the filter is too wide for the literal way.
pub fn base(
    graph: &mut Graph,
    luminance: Image,
    statistics: Buffer,
    picture: Extent,
    settings: &Settings,
) -> Result<Image> {
    let extent = graph.extent(luminance);
    let Source { logarithm, blocks, bilateral } = source(graph, luminance, statistics, picture, settings)?;
    let base = graph.image("tonemap.base", Format::R32F, extent);
    graph.compute(base::Args { logarithm, blocks, base, push: base::Push { bilateral } }, extent);
    Ok(base)
}

/// What the filter reads.
pub(super) struct Source {
    pub logarithm: Image,
    pub blocks: Image,
    pub bilateral: TonemapBilateral,
}

/// Everything before the filter, as [`base`].
pub(super) fn source(
    graph: &mut Graph,
    luminance: Image,
    statistics: Buffer,
    picture: Extent,
    settings: &Settings,
) -> Result<Source> {
    let extent = graph.extent(luminance);
    let (sigma, reach) = settings.bilateral(picture.width, picture.height);
    if settings.local == Local::Literal && reach > LITERAL_REACH {
        let what =
            format!("literal, with spatial = {}, reaches {reach} pixels in a picture of {picture}", settings.spatial);
        return Err(Error::usage(format!("{what}; allowed: {LITERAL_REACH}"))
            .at("local")
            .help("Use local = fast, or a smaller `spatial`"));
    }
    let side = block_side(picture, settings);
    let logarithm = graph.image("tonemap.logarithm", Format::R32F, extent);
    graph.compute(logarithm::Args { luminance, statistics, logarithm }, extent);
    let blocks = if side == 1 {
        logarithm
    } else {
        let blocks = graph.image("tonemap.blocks", Format::RGBA32F, extent.div_ceil(side));
        let push = blocks::Push { side: side as i32, skip: side.div_ceil(BLOCK_SAMPLES) as i32 };
        graph.compute(blocks::Args { logarithm, blocks, push }, graph.extent(blocks));
        blocks
    };
    let exponent = |sigma: f32| -std::f32::consts::LOG2_E / (2.0 * sigma * sigma);
    let bilateral = TonemapBilateral {
        space: exponent(sigma),
        range: exponent(settings.range),
        reach: reach as i32,
        side: side as i32,
    };
    Ok(Source { logarithm, blocks, bilateral })
}
