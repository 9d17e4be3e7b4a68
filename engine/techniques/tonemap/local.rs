//! Local adaptation.

use super::{
    Local, Settings, bilateral,
    search::{Search, Tables},
};
use crate::{
    Result,
    graph::{Buffer, Extent, Format, Graph, Image},
    shaders::tonemap::{columns, literal, rows},
};

/// Local adaptation of every pixel of `luminance`, R32F; of the bilateral operator, the luminance of the base. `picture`: extent of the whole
/// picture, of which `luminance` may be a part.
///
/// # Errors
/// `Usage` if the settings cannot serve a picture of this extent.
pub fn adaptation(
    graph: &mut Graph,
    luminance: Image,
    statistics: Buffer,
    picture: Extent,
    settings: &Settings,
) -> Result<Image> {
    let Some(search) = Search::new(settings) else {
        return bilateral::base(graph, luminance, statistics, picture, settings);
    };
    let adaptation = graph.image("tonemap.adaptation", Format::R32F, graph.extent(luminance));
    let tables = search.tables(graph);
    match settings.local {
        Local::Literal => {
            let Tables { search, weights } = tables;
            let args = literal::Args { luminance, search, weights, statistics, adaptation };
            graph.compute(args, graph.extent(luminance));
        }
        Local::Fast => {
            for band in bands(graph, luminance, &search) {
                let rows = row_averages(graph, luminance, &search, tables, &band);
                column_averages(graph, luminance, &search, tables, rows, &band, statistics, adaptation);
            }
        }
    }
    Ok(adaptation)
}

/// Rows of an image that are done together, so that what lies between rows and columns stays small.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Band {
    /// First row whose averages along rows are needed.
    pub first: u32,
    /// Rows whose averages along rows are needed.
    pub count: u32,
    /// First row that comes out.
    pub begin: u32,
    /// Row after the last that comes out.
    pub end: u32,
    /// Where the averages along rows lie.
    pub rows: Buffer,
}

/// Bytes of averages along rows that are there at a time, unless a row has more.
const BAND_BYTES: u64 = 32 << 20;

/// Bands of rows, which share one buffer.
pub fn bands(graph: &mut Graph, luminance: Image, search: &Search) -> Vec<Band> {
    let extent = graph.extent(luminance);
    let reach = search.reach() as u32;
    let row_bytes = u64::from(extent.width) * 16 * search.groups() as u64;
    let fits = (BAND_BYTES / row_bytes.max(1)).min(1 << 20) as u32;
    // At least as much comes out as goes in beside it.
    let height = fits.saturating_sub(2 * reach).max(2 * reach).next_multiple_of(8);
    let most = extent.height.min(height + 2 * reach);
    let rows = graph.buffer("tonemap.rows", row_bytes * u64::from(most));
    let band = |begin: u32| {
        let end = (begin + height).min(extent.height);
        let first = begin.saturating_sub(reach);
        Band { first, count: (end + reach).min(extent.height) - first, begin, end, rows }
    };
    (0..extent.height).step_by(height as usize).map(band).collect()
}

fn radii(search: &Search) -> [u32; 6] {
    let mut radii = [0; 6];
    radii.iter_mut().zip(search.group_radii()).for_each(|(to, from)| *to = from);
    radii
}

/// Averages along the rows of a band, of all Gaussians: vec4 `[group][row][column]`.
pub fn row_averages(graph: &mut Graph, luminance: Image, search: &Search, tables: Tables, band: &Band) -> Buffer {
    let width = graph.extent(luminance).width;
    let [radius_0, radius_1, radius_2, radius_3, radius_4, radius_5] = radii(search);
    let groups = search.groups() as u32;
    let spec = rows::Spec { groups, radius_0, radius_1, radius_2, radius_3, radius_4, radius_5 };
    let push = rows::Push { first: band.first as i32, count: band.count as i32 };
    let args = rows::Args { luminance, weights: tables.weights, rows: band.rows, push, spec };
    graph.compute(args, [width.div_ceil(8), band.count]);
    band.rows
}

#[expect(clippy::too_many_arguments)]
fn column_averages(
    graph: &mut Graph,
    luminance: Image,
    search: &Search,
    tables: Tables,
    rows: Buffer,
    band: &Band,
    statistics: Buffer,
    adaptation: Image,
) {
    let width = graph.extent(luminance).width;
    let [radius_0, radius_1, radius_2, radius_3, radius_4, radius_5] = radii(search);
    let groups = search.groups() as u32;
    let spec = columns::Spec { groups, radius_0, radius_1, radius_2, radius_3, radius_4, radius_5 };
    let push = columns::Push {
        first: band.first as i32,
        count: band.count as i32,
        begin: band.begin as i32,
        end: band.end as i32,
    };
    let Tables { search, weights } = tables;
    let args = columns::Args { luminance, search, weights, rows, statistics, adaptation, push, spec };
    graph.compute(args, [width, (band.end - band.begin).div_ceil(8)]);
}
