//! Pictures in main memory, of any size.

use super::{
    BadCounts, Input, Light, Local, Mode, Operator, Output, Settings, Tonemap, bilateral, clean, identify, keep, map,
    pyramid, receptor, settle,
    statistics::{self, Rectangle, Sums},
    whole,
};
use crate::{
    Error, Result,
    gpu::{Gpu, ImageDesc, OwnedBuffer, OwnedImage, Region},
    graph::{Buffer, Extent, Format, Frame, Graph, Image, Pixels, Runner},
    shaders::types::{TonemapSolve, TonemapStatistics},
};

/// Pixels of the largest picture that is done in one piece.
const WHOLE: u64 = 1 << 24;
/// Side of the tiles of larger ones, without what they share with others.
const TILE: u32 = 2048;

/// Tone mapping of pictures in main memory; keeps the device warm and, in sequences, the adaptation.
#[derive(Debug)]
pub struct Still {
    tonemap: Tonemap,
    runner: Runner,
    tile: Option<u32>,
}

/// A tone mapped picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Mapped {
    /// Display-referred linear Rec. 709, alpha as it was.
    pub pixels: Vec<[f32; 4]>,
    /// What the picture had of bad values.
    pub bad: BadCounts,
    pub statistics: TonemapStatistics,
    /// Selective: number of important pixels.
    pub important: Option<u64>,
    /// Fattal and Mantiuk: |b − Ax| / |b| of the equation that was solved, in f32 as the device has it, and the steps that it took.
    pub residual: Option<(f32, u32)>,
}

/// Tone maps one picture: `width · height` linear Rec. 709 pixels, premultiplied, top row first; `mask`: as many values, over 0.5 where
/// a pixel is important whatever its luminance.
///
/// # Errors
/// As [`Still::map`].
pub fn apply(
    gpu: &Gpu,
    width: u32,
    height: u32,
    pixels: &[[f32; 4]],
    mask: Option<&[f32]>,
    settings: &Settings,
) -> Result<Mapped> {
    Still::new(gpu, settings)?.map(width, height, pixels.to_vec(), mask, None)
}

/// A part of a picture: what is computed from it, and what is read for that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Tile {
    /// First column and row, columns and rows that come out of it.
    core: [u32; 4],
    /// The same of what goes into it.
    whole: [u32; 4],
}

impl Tile {
    /// Tiles of `side`² pixels with `apron` more on each side where the picture has them, and up to `grid` − 1 more to the left and
    /// above, so that what goes in begins at a multiple of `grid`.
    fn all(width: u32, height: u32, side: u32, apron: u32, grid: u32) -> Vec<Self> {
        let cuts = |size: u32| -> Vec<(u32, u32, u32, u32)> {
            let starts = (0..size).step_by(side.max(1) as usize);
            starts
                .map(|first| {
                    let length = side.min(size - first);
                    let from = first.saturating_sub(apron) / grid.max(1) * grid.max(1);
                    let to = first.saturating_add(length).saturating_add(apron).min(size);
                    (first, length, from, to - from)
                })
                .collect()
        };
        let columns = cuts(width);
        let rows = cuts(height);
        let tile = |&(y, h, wy, wh): &(u32, u32, u32, u32), &(x, w, wx, ww): &(u32, u32, u32, u32)| Self {
            core: [x, y, w, h],
            whole: [wx, wy, ww, wh],
        };
        rows.iter().flat_map(|row| columns.iter().map(move |column| tile(row, column))).collect()
    }

    /// The core, as pixels of the whole.
    fn part(&self) -> Rectangle {
        let first = [0, 1].map(|i| (self.core[i] - self.whole[i]) as i32);
        Rectangle { first, last: [0, 1].map(|i| first[i] + self.core[i + 2] as i32 - 1) }
    }

    fn extent(&self) -> Extent {
        Extent::new(self.whole[2], self.whole[3])
    }
}

impl Still {
    /// Ready for pictures.
    ///
    /// # Errors
    /// As [`Tonemap::new`].
    pub fn new(gpu: &Gpu, settings: &Settings) -> Result<Self> {
        Ok(Self { tonemap: Tonemap::new(gpu, settings)?, runner: Runner::new(gpu), tile: None })
    }

    /// Cuts pictures larger than `side`² into tiles of that side, instead of what suits the device. The result does not depend on it.
    #[must_use]
    pub fn tiles(self, side: u32) -> Self {
        Self { tile: Some(side.max(1)), ..self }
    }

    /// Settings and adaptation.
    pub fn tonemap(&mut self) -> &mut Tonemap {
        &mut self.tonemap
    }

    /// Tone maps one picture, as [`apply`]. `dt`: seconds since the one before, for sequences.
    ///
    /// # Errors
    /// `Usage` if numbers of pixels and extent do not match, `Input` if the policy for bad values says so, `OutOfMemory`, `DeviceLost`.
    pub fn map(
        &mut self,
        width: u32,
        height: u32,
        mut pixels: Vec<[f32; 4]>,
        mask: Option<&[f32]>,
        dt: Option<f32>,
    ) -> Result<Mapped> {
        let count = u64::from(width) * u64::from(height);
        let wrong = |what: String| Err(Error::usage(what));
        if count == 0 || count > u64::from(u32::MAX) {
            return wrong(format!("a picture of {width}×{height} pixels; allowed: 1 to {} pixels", u32::MAX));
        }
        if pixels.len() as u64 != count {
            return wrong(format!("{} pixels for a picture of {width}×{height}", pixels.len()));
        }
        if mask.is_some_and(|m| m.len() as u64 != count) {
            return wrong(format!("a mask of {} values for a picture of {width}×{height}", mask.map_or(0, <[_]>::len)));
        }
        let bad = clean(width, &mut pixels, self.tonemap.settings.bad_values)?;
        let limit = self.runner.gpu().caps().limits.image_2d;
        let fits = self.tile.map_or(count <= WHOLE, |side| width <= side && height <= side);
        let source = Source { width, pixels: &pixels, mask };
        let whole = self.tonemap.settings.operator.solves();
        if whole {
            whole::check(width, height, &self.tonemap.settings)?;
            if width > limit || height > limit {
                return wrong(format!("a picture of {width}×{height} pixels; allowed by the device: {limit}×{limit}"));
            }
        }
        let fits = (fits || whole) && width <= limit && height <= limit;
        let Developed { pixels, statistics, important, residual } = if fits {
            let tile = Tile { core: [0, 0, width, height], whole: [0, 0, width, height] };
            let mut graph = Graph::new("tonemap");
            let input = self.input(&mut graph, &source, &tile)?;
            let output = self.tonemap.frame(&mut graph, input, dt)?;
            let (mapped, found) = (graph.read_image(output.mapped), graph.read_buffer(output.statistics));
            let important = output.important.map(|map| graph.read_image(map));
            let solve = output.solve.map(|state| graph.read_buffer(state));
            let mut frame = self.runner.run(&graph)?;
            Developed {
                pixels: frame.take_floats(mapped),
                statistics: statistics_of(&frame.buffer(found)),
                important: important.map(|map| marked(&frame.image(map), &tile)),
                residual: solve.map(|state| left(&frame.buffer(state))),
            }
        } else if settle::goes_on(&self.tonemap.settings, dt) {
            let what = format!(
                "adapt_local is {}, and a frame of {width}×{height} pixels is mapped in tiles",
                self.tonemap.settings.adapt_local
            );
            return Err(Error::usage(what).help(format!("Use 0, or frames of at most {WHOLE} pixels")));
        } else if keep::goes_on(&self.tonemap.settings, dt) {
            let keep = self.tonemap.settings.keep_map;
            let what = format!("keep_map is {keep}, and a frame of {width}×{height} pixels is mapped in tiles");
            let help = format!("Use 1, or frames of at most {WHOLE} pixels");
            return Err(Error::usage(what).at("tonemap.keep_map").help(help));
        } else {
            self.tiled(width, height, &source, dt)?
        };
        Ok(Mapped { pixels, bad, statistics, important, residual })
    }

    /// Statistics over all tiles first, then the operator on each.
    fn tiled(&mut self, width: u32, height: u32, source: &Source<'_>, dt: Option<f32>) -> Result<Developed> {
        let settings = self.tonemap.settings.clone();
        let gpu = self.runner.gpu().clone();
        let picture = Extent::new(width, height);
        let apron = settings.reach(width, height);
        let of_map = if settings.mode() == Mode::Selective { identify::grid(&settings) } else { 1 };
        let of_blocks = if apron > 0 { bilateral::block_side_of(picture, &settings) } else { 1 };
        // A multiple of all.
        let grid = of_map * of_blocks * if settings.local == Local::Pyramid { pyramid::GRID } else { 1 };
        let limit = gpu.caps().limits.image_2d.saturating_sub(2 * apron + grid).max(1);
        let side = self.tile.unwrap_or(TILE).min(limit);
        let owned = |name: &str, bytes: u64| OwnedBuffer::with_contents(&gpu, name, &vec![0; bytes as usize]);
        let sums = owned("tonemap.sums", statistics::SUMS_BYTES)?;
        let found = owned("tonemap.found", statistics::FOUND_BYTES)?;
        let bins = owned("tonemap.bins", statistics::BINS_BYTES)?;
        let result = &self.tonemap.statistics.clone();

        let plain = Tile::all(width, height, side, 0, 1);
        // The first turn has no digit: it takes minimum, maximum and logarithms.
        let digits: &[u32] = if settings.percentile > 0.0 { &statistics::DIGITS } else { &[] };
        for (turn, digit) in std::iter::once(None).chain(digits.iter().copied().map(Some)).enumerate() {
            for (i, tile) in plain.iter().enumerate() {
                let mut graph = Graph::new("tonemap statistics");
                let input = self.input(&mut graph, &Source { mask: None, ..*source }, tile)?;
                let sums = graph.import_buffer(&sums);
                if turn == 0 && i == 0 {
                    statistics::empty_sums(&mut graph, sums);
                }
                // Turns for digits add to sums that nobody reads any more.
                let scratch = if turn == 0 { sums } else { scratch_sums(&mut graph) };
                let luminance = statistics::luminance(&mut graph, input.color, tile.part(), scratch, &settings);
                let last = i + 1 == plain.len();
                if let Some(shift) = digit {
                    let (found, bins) = (graph.import_buffer(&found), graph.import_buffer(&bins));
                    statistics::count_digits(&mut graph, luminance, tile.part(), found, bins, shift);
                    if last {
                        let ranks = statistics::ranks(picture.pixels(), settings.percentile);
                        statistics::select_digit(&mut graph, found, bins, ranks, shift);
                    }
                }
                if last && turn == digits.len() {
                    let found = graph.import_buffer(&found);
                    let from = Sums { sums, found };
                    let statistics = graph.import_buffer(result);
                    statistics::finish(&mut graph, from, statistics, dt, &settings);
                }
                self.runner.run(&graph)?;
            }
        }

        // The receptors of Reinhard and Devlin first have sums, then a range.
        let receptor = owned("tonemap.receptor", receptor::BYTES)?;
        let known = |graph: &mut Graph| receptor::Known {
            sums: graph.import_buffer(&sums),
            receptor: graph.import_buffer(&receptor),
            statistics: graph.import_buffer(result),
            pixels: picture.pixels(),
        };
        let has_receptors = settings.operator == Operator::ReinhardDevlin;
        for turn in if has_receptors { 0..2 } else { 0..0 } {
            for (i, tile) in plain.iter().enumerate() {
                let mut graph = Graph::new("tonemap receptors");
                let input = self.input(&mut graph, &Source { mask: None, ..*source }, tile)?;
                let known = known(&mut graph);
                if turn == 0 && i == 0 {
                    receptor::empty(&mut graph, known.receptor);
                }
                let pass = if turn == 0 { receptor::sums } else { receptor::range };
                pass(&mut graph, input.color, tile.part(), &known, &settings);
                self.runner.run(&graph)?;
            }
        }

        let mut pixels = vec![[0.0; 4]; picture.pixels() as usize];
        let (mut statistics, mut important) = (TonemapStatistics::default(), None);
        for tile in Tile::all(width, height, side, apron, grid) {
            let mut graph = Graph::new("tonemap tile");
            let input = self.input(&mut graph, source, &tile)?;
            let unused = scratch_sums(&mut graph);
            let luminance = statistics::luminance(&mut graph, input.color, tile.extent().into(), unused, &settings);
            let known = known(&mut graph);
            let receptor = has_receptors.then_some(known);
            let light =
                Light { luminance, statistics: known.statistics, receptor, picture, last: None, map: keep::Map::Found };
            let output: Output = map(&mut graph, &input, &light, &settings)?;
            let (mapped, found) = (graph.read_image(output.mapped), graph.read_buffer(output.statistics));
            let map = output.important.map(|map| graph.read_image(map));
            let mut frame: Frame = self.runner.run(&graph)?;
            statistics = statistics_of(&frame.buffer(found));
            if let Some(map) = map {
                *important.get_or_insert(0) += marked(&frame.image(map), &tile);
            }
            let mapped = frame.take_floats(mapped);
            let [x, y, w, h] = tile.core.map(|v| v as usize);
            let [from_x, from_y, stride, _] = tile.whole.map(|v| v as usize);
            for row in 0..h {
                let from = (y - from_y + row) * stride + x - from_x;
                let to = (y + row) * width as usize + x;
                pixels[to..to + w].copy_from_slice(&mapped[from..from + w]);
            }
        }
        Ok(Developed { pixels, statistics, important, residual: None })
    }

    fn input(&self, graph: &mut Graph, source: &Source<'_>, tile: &Tile) -> Result<Input> {
        let gpu = self.runner.gpu();
        let color =
            upload(gpu, graph, "tonemap.input", Format::RGBA32F, tile.extent(), &source.cut(source.pixels, tile))?;
        let mask = match source.mask {
            Some(mask) => {
                Some(upload(gpu, graph, "tonemap.mask", Format::R32F, tile.extent(), &source.cut(mask, tile))?)
            }
            None => None,
        };
        Ok(Input { color, mask })
    }
}

/// What comes from the device.
struct Developed {
    pixels: Vec<[f32; 4]>,
    statistics: TonemapStatistics,
    important: Option<u64>,
    residual: Option<(f32, u32)>,
}

/// Relative residual of a solution, and its steps.
fn left(found: &[TonemapSolve]) -> (f32, u32) {
    found.first().map_or((f32::NAN, 0), |state| (state.residual, state.steps))
}

/// Number of important pixels in the core of a tile. `map`: R32F of the whole tile.
fn marked(map: &Pixels, tile: &Tile) -> u64 {
    let [x, y, w, h] = tile.core.map(|v| v as usize);
    let [from_x, from_y, stride, _] = tile.whole.map(|v| v as usize);
    let rows = (0..h).map(|row| 4 * ((y - from_y + row) * stride + x - from_x));
    // A pixel is 0, or 1, whose bytes are not all 0.
    let in_row = |from: usize| map.bytes[from..from + 4 * w].chunks_exact(4).filter(|v| **v != [0; 4]).count();
    rows.map(in_row).sum::<usize>() as u64
}

/// A picture with the width of its rows.
#[derive(Clone, Copy)]
struct Source<'a> {
    width: u32,
    pixels: &'a [[f32; 4]],
    mask: Option<&'a [f32]>,
}

impl Source<'_> {
    fn cut<'v, T: Copy>(&self, values: &'v [T], tile: &Tile) -> std::borrow::Cow<'v, [T]> {
        let [x, y, w, h] = tile.whole.map(|v| v as usize);
        let width = self.width as usize;
        if w == width {
            return values[y * width..(y + h) * width].into();
        }
        (y..y + h).flat_map(|row| &values[row * width + x..row * width + x + w]).copied().collect()
    }
}

fn scratch_sums(graph: &mut Graph) -> Buffer {
    let sums = graph.buffer("tonemap.unused-sums", statistics::SUMS_BYTES);
    statistics::empty_sums(graph, sums);
    sums
}

fn statistics_of(found: &[TonemapStatistics]) -> TonemapStatistics {
    found.first().copied().unwrap_or_default()
}

fn upload<T: bytemuck::NoUninit>(
    gpu: &Gpu,
    graph: &mut Graph,
    name: &str,
    format: Format,
    extent: Extent,
    values: &[T],
) -> Result<Image> {
    let desc = ImageDesc::new(format.to_vk(), extent.width, extent.height);
    let region = Region { mip: 0, layer: 0, bytes: bytemuck::cast_slice(values) };
    Ok(graph.import_image(&OwnedImage::with_contents(gpu, name, desc, &[region])?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_each_pixel_once_and_know_their_surroundings() {
        let cases = [(1, 1, 4, 3, 1), (10, 7, 4, 3, 1), (8, 8, 4, 0, 1), (5, 9, 1, 2, 4), (100, 3, 64, 20, 8)];
        for (width, height, side, apron, grid) in cases {
            let mut seen = vec![0; (width * height) as usize];
            for tile in Tile::all(width, height, side, apron, grid) {
                let [x, y, w, h] = tile.core;
                let [wx, wy, ww, wh] = tile.whole;
                for row in y..y + h {
                    for column in x..x + w {
                        seen[(row * width + column) as usize] += 1;
                    }
                }
                let least = |first: u32| first.saturating_sub(apron);
                assert!(wx <= least(x) && wx + grid > least(x) && wx.is_multiple_of(grid));
                assert!(wy <= least(y) && wy + grid > least(y) && wy.is_multiple_of(grid));
                assert_eq!((wx + ww, wy + wh), ((x + w + apron).min(width), (y + h + apron).min(height)));
                let part = tile.part();
                assert_eq!(part.last[0] - part.first[0] + 1, w as i32);
                assert!(part.last[1] < wh as i32 && part.first[0] >= 0);
            }
            assert!(seen.iter().all(|n| *n == 1));
        }
    }
}
