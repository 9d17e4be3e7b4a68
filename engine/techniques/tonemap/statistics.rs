//! Minimum, maximum, log-average and percentiles of luminance.

use super::Settings;
use crate::{
    graph::{Buffer, Extent, Format, Graph, Image},
    shaders::{
        consts,
        tonemap::{finish, histogram, luminance, select},
    },
};

/// A part of an image: first pixel, and last pixel inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rectangle {
    pub first: [i32; 2],
    pub last: [i32; 2],
}

impl From<Extent> for Rectangle {
    fn from(extent: Extent) -> Self {
        Self { first: [0, 0], last: [extent.width as i32 - 1, extent.height as i32 - 1] }
    }
}

impl Rectangle {
    /// Width and height.
    pub(super) fn size(&self) -> [u32; 2] {
        [0, 1].map(|i| (self.last[i] - self.first[i] + 1).max(0) as u32)
    }
}

/// Bytes of the sums that [`luminance()`] adds to.
pub const SUMS_BYTES: u64 = 20;
/// Bytes of what is known of two percentiles.
pub const FOUND_BYTES: u64 = 16;
/// Bytes of the bins of one digit.
pub const BINS_BYTES: u64 = 4 * 2048;
/// Bytes of `types::TonemapStatistics`.
pub const STATISTICS_BYTES: u64 = size_of::<crate::shaders::types::TonemapStatistics>() as u64;

/// Sums of no pixels.
pub fn empty_sums(graph: &mut Graph, sums: Buffer) {
    graph.fill(sums.range(0..4), u32::MAX);
    graph.fill(sums.range(4..SUMS_BYTES), 0);
}

/// Luminance of `color` (R32F), and adds those of the pixels of `part` to `sums`.
pub fn luminance(graph: &mut Graph, color: Image, part: Rectangle, sums: Buffer, settings: &Settings) -> Image {
    let extent = graph.extent(color);
    let luminance = graph.image("tonemap.luminance", Format::R32F, extent);
    let push = luminance::Push { first: part.first, last: part.last, exposure: settings.exposure.exp2() };
    graph.compute(
        luminance::Args { color, luminance, sums, push },
        [extent.width, extent.height.div_ceil(consts::TONEMAP_ROWS)],
    );
    luminance
}

/// Position of the digits of a selection, in the order in which they are found.
pub const DIGITS: [u32; 3] = [20, 10, 0];

/// Counts the digits of the pixels of `part` at one of [`DIGITS`]. `bins` is zero before the first part.
pub fn count_digits(graph: &mut Graph, luminance: Image, part: Rectangle, found: Buffer, bins: Buffer, shift: u32) {
    let [width, height] = part.size();
    let push = histogram::Push { first: part.first, last: part.last, shift };
    graph.compute(histogram::Args { luminance, found, bins, push }, [width, height.div_ceil(64)]);
}

/// Goes on to the next digit of the values at `ranks`, and empties the bins.
pub fn select_digit(graph: &mut Graph, found: Buffer, bins: Buffer, ranks: [u32; 2], shift: u32) {
    let push = select::Push { ranks, shift };
    graph.compute(select::Args { found, bins, push }, 1);
}

/// Places of L_min and L_max among `pixels` luminances in ascending order, counted from 0.
pub fn ranks(pixels: u64, percentile: f32) -> [u32; 2] {
    let least = (pixels as f64 * f64::from(percentile) / 100.0).ceil().max(1.0) as u64;
    [least - 1, pixels.saturating_sub(least)].map(|rank| rank.min(pixels.saturating_sub(1)) as u32)
}

/// What [`finish()`] starts from.
#[derive(Clone, Copy, Debug)]
pub struct Sums {
    pub sums: Buffer,
    pub found: Buffer,
}

/// Turns sums into statistics. `dt`: seconds since the last frame, whose adaptation `statistics` holds; `None`: none.
pub fn finish(graph: &mut Graph, from: Sums, statistics: Buffer, dt: Option<f32>, settings: &Settings) {
    let dt = dt.filter(|dt| dt.is_finite()).map(|dt| dt.max(0.0));
    let push = finish::Push {
        percentiles: (settings.percentile > 0.0).into(),
        normalize: settings.normalize.into(),
        adapt: dt.is_some().into(),
        dt: dt.unwrap_or(0.0),
        up: settings.adapt_up,
        down: settings.adapt_down,
        // None at all would be a division by zero.
        limit: if settings.adapt_limit > 0.0 { settings.adapt_limit } else { 1e9 },
        exposure: settings.exposure.exp2(),
    };
    graph.compute(finish::Args { sums: from.sums, found: from.found, statistics, push }, 1);
}

/// Luminance and statistics of a whole image; the sums stay in the buffer that comes last.
pub fn whole(
    graph: &mut Graph,
    color: Image,
    statistics: Buffer,
    dt: Option<f32>,
    settings: &Settings,
) -> (Image, Buffer) {
    let part = Rectangle::from(graph.extent(color));
    let pixels = graph.extent(color).pixels();
    let sums = graph.buffer("tonemap.sums", SUMS_BYTES);
    let found = graph.buffer("tonemap.found", FOUND_BYTES);
    empty_sums(graph, sums);
    graph.fill(found, 0);
    let luminance = luminance(graph, color, part, sums, settings);
    if settings.percentile > 0.0 {
        let bins = graph.buffer("tonemap.bins", BINS_BYTES);
        graph.fill(bins, 0);
        for shift in DIGITS {
            count_digits(graph, luminance, part, found, bins, shift);
            select_digit(graph, found, bins, ranks(pixels, settings.percentile), shift);
        }
    }
    finish(graph, Sums { sums, found }, statistics, dt, settings);
    (luminance, sums)
}
