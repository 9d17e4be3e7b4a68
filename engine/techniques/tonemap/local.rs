//! Local adaptation.

use super::{
    Local, Settings, bilateral, pyramid,
    search::{Search, Tables},
};
use crate::{
    Result,
    graph::{Buffer, Extent, Format, Graph, Image},
    shaders::tonemap::{columns, literal, rows},
};

/// Local adaptation of every pixel of `luminance`, R32F; of the bilateral operator, the luminance of the base. `picture`: extent of the whole
/// picture, of which `luminance` may be a part. `importance`: what is 0 there need not be computed.
///
/// # Errors
/// `Usage` if the settings cannot serve a picture of this extent.
pub fn adaptation(
    graph: &mut Graph,
    luminance: Image,
    importance: Option<Image>,
    statistics: Buffer,
    picture: Extent,
    settings: &Settings,
) -> Result<Image> {
    let Some(search) = Search::new(settings) else {
        return bilateral::base(graph, luminance, statistics, picture, settings);
    };
    let adaptation = graph.image("tonemap.adaptation", Format::R32F, graph.extent(luminance));
    match settings.local {
        Local::Literal | Local::Growing => {
            let Tables { search, weights } = search.tables(graph);
            let spec = literal::Spec { growing: (settings.local == Local::Growing).into() };
            let args = literal::Args { luminance, search, weights, statistics, adaptation, spec };
            graph.compute(args, graph.extent(luminance));
        }
        Local::Fast => fast(graph, luminance, importance, statistics, &search, adaptation),
        Local::Pyramid => pyramid::adapt(graph, luminance, importance, statistics, settings, &search, adaptation)?,
    }
    Ok(adaptation)
}

/// Rows of an image that are done together, so that what lies between rows and columns stays small.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Band {
    /// First row whose averages along rows are needed.
    first: u32,
    /// Rows whose averages along rows are needed.
    count: u32,
    /// First row that comes out.
    begin: u32,
    /// Row after the last that comes out.
    end: u32,
}

/// Bytes of averages along rows that are there at a time, unless a few rows have more.
const BAND_BYTES: u64 = 32 << 20;
/// Rows of an image that every device can have.
const IMAGE_ROWS: u32 = 4096;
/// Pixels that one invocation has: `SPAN` of tonemap/span.glsl.
const SPAN: u32 = 8;

/// Bands of an image of `extent`, of which each needs `reach` rows more on either side, for so many groups of Gaussians.
fn bands(extent: Extent, reach: u32, groups: u32) -> Vec<Band> {
    let row_bytes = u64::from(extent.width.max(1)) * 16 * u64::from(groups);
    let fits = (BAND_BYTES / row_bytes).min(u64::from(IMAGE_ROWS / groups)) as u32;
    // At least about as much comes out as goes in beside it.
    let height = (fits.saturating_sub(2 * reach).max(2 * reach) / SPAN * SPAN).max(SPAN);
    let band = |begin: u32| {
        let end = (begin + height).min(extent.height);
        let first = begin.saturating_sub(reach);
        Band { first, count: (end + reach).min(extent.height) - first, begin, end }
    };
    (0..extent.height).step_by(height as usize).map(band).collect()
}

/// Averages along rows, then along columns, band by band.
fn fast(
    graph: &mut Graph,
    luminance: Image,
    importance: Option<Image>,
    statistics: Buffer,
    search: &Search,
    adaptation: Image,
) {
    let extent = graph.extent(luminance);
    let (groups, radius) = (search.groups() as u32, search.group_radii());
    let bands = bands(extent, search.reach() as u32, groups);
    let most = bands.iter().map(|band| band.count).max().unwrap_or(1);
    let rows = graph.image("tonemap.rows", Format::RGBA32F, Extent::new(extent.width, most * groups));
    let kernels = graph.uniform(&search.kernels());
    let search = search.tables(graph).search;
    for band in bands {
        let [first, count, begin, end] = [band.first, band.count, band.begin, band.end].map(|row| row as i32);
        let push = rows::Push { first, count, groups, radius };
        graph.compute(rows::Args { luminance, kernels, rows, push }, [extent.width.div_ceil(SPAN), band.count]);
        let push = columns::Push { first, count, begin, end, groups, radius };
        let args = columns::Args {
            luminance,
            search,
            kernels,
            rows,
            statistics,
            importance: importance.unwrap_or(luminance),
            adaptation,
            push,
            spec: columns::Spec { has_map: importance.is_some().into() },
        };
        graph.compute(args, [extent.width, (band.end - band.begin).div_ceil(SPAN)]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_cover_each_row_once_with_what_they_need() {
        for (width, height, reach, groups) in
            [(1, 1, 20, 4), (1, 16384, 33, 3), (16384, 16384, 32, 6), (512, 768, 20, 4)]
        {
            let bands = bands(Extent::new(width, height), reach, groups);
            let mut next = 0u32;
            for band in &bands {
                assert_eq!((band.begin, band.first), (next, next.saturating_sub(reach)));
                assert_eq!(band.first + band.count, (band.end + reach).min(height));
                assert!(band.count * groups <= IMAGE_ROWS, "{band:?}");
                next = band.end;
            }
            assert_eq!(next, height);
        }
    }
}
