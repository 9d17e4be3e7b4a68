//! Sizes before and after compression, and error against bytes.

use half::f16;
use lucerna::{
    Result,
    bake::pca::{self, Centre, Keep},
    techniques::daylight::{
        Texels,
        blocks::Layout,
        columns::{Columns, Measured},
        layer::{Aim, Layer},
    },
};

use super::day::{Day, Of, Rows};
use crate::{
    experiment::results::{Done, Results},
    report::{Axis, Plot, Section, Table},
};

/// Pixels of the paper's frames.
const PAPER_PIXELS: f64 = 800.0 * 600.0;
/// Vectors of the paper.
const VECTORS: f64 = 10.0;
/// Sides of tiles; 0 is the whole picture.
const SIDES: [usize; 4] = [0, 32, 16, 8];
/// Numbers of images of a tile.
const COUNTS: [usize; 8] = [1, 2, 4, 8, 12, 20, 32, 64];
/// Tolerances of the technique's own tiles, and their side.
const TOLERANCES: [f64; 5] = [0.3, 0.2, 0.1, 0.05, 0.02];
const TILE: usize = 32;
const MEGA: f64 = 1e6;

/// Bits of a stored value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Bits {
    Half,
    /// A signed byte, with one scale for each image of a tile.
    Byte,
}

impl Bits {
    const ALL: [Self; 2] = [Self::Half, Self::Byte];

    fn bytes(self) -> f64 {
        match self {
            Self::Half => 2.0,
            Self::Byte => 1.0,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Half => "16-bit floats",
            Self::Byte => "signed bytes",
        }
    }

    /// Values as they are read back.
    fn stored(self, values: &mut [f64]) {
        match self {
            Self::Half => values.iter_mut().for_each(|value| *value = f16::from_f64(*value).to_f64()),
            Self::Byte => {
                let step = values.iter().fold(0.0f64, |most, value| most.max(value.abs())) / 127.0;
                if step > 0.0 {
                    values.iter_mut().for_each(|value| *value = (*value / step).round() * step);
                }
            }
        }
    }
}

/// The pixels of the tiles of a day.
fn tiles(day: &Day, side: usize) -> Vec<Vec<usize>> {
    let side = if side == 0 { day.width.max(day.height) } else { side };
    let mut tiles = Vec::new();
    for y in (0..day.height).step_by(side) {
        for x in (0..day.width).step_by(side) {
            let rows = y..(y + side).min(day.height);
            let columns = x..(x + side).min(day.width);
            tiles.push(rows.flat_map(|y| columns.clone().map(move |x| y * day.width + x)).collect());
        }
    }
    tiles
}

/// For each number of images the sums of squared errors of each time, and the bytes, of a tile. Frames are weighted by their means.
fn compressed(rows: &Rows, bits: Bits) -> Result<Vec<(Vec<f64>, f64)>> {
    let times = rows.times;
    let weights: Vec<f64> = rows.sums().iter().map(|sum| if *sum > 0.0 { 1.0 / sum } else { 0.0 }).collect();
    let scale = rows.len() as f64;
    let weights: Vec<f64> = weights.iter().map(|weight| weight * scale).collect();
    let scaled: Vec<f32> = rows
        .iter()
        .flat_map(|row| row.iter().zip(&weights).map(|(value, weight)| (f64::from(*value) * weight) as f32))
        .collect();
    let most = COUNTS[COUNTS.len() - 1];
    let basis = pca::basis(&scaled, times, &vec![1.0; rows.len()], Centre::Origin, Keep::Count(most))?;
    let mut rest: Vec<f64> = scaled.iter().map(|value| f64::from(*value)).collect();
    let mut found = Vec::new();
    let mut images = 0;
    for wanted in COUNTS {
        while images < wanted.min(basis.len()) {
            let vector = basis.vector(images);
            let project = |row: &[f32]| row.iter().zip(vector).map(|(value, along)| f64::from(*value) * along).sum();
            let mut image: Vec<f64> = scaled.chunks_exact(times).map(project).collect();
            bits.stored(&mut image);
            for (row, value) in rest.chunks_exact_mut(times).zip(&image) {
                row.iter_mut().zip(vector).for_each(|(rest, along)| *rest -= value * along);
            }
            images += 1;
        }
        let mut squares = vec![0.0; times];
        for row in rest.chunks_exact(times) {
            for ((square, rest), weight) in squares.iter_mut().zip(row).zip(&weights) {
                *square += if *weight > 0.0 { (rest / weight).powi(2) } else { 0.0 };
            }
        }
        // Coefficients are 32-bit floats, and a byte image has its scale in them.
        let bytes = images as f64 * (bits.bytes() * scale + 4.0 * times as f64);
        found.push((squares, bytes));
    }
    Ok(found)
}

/// Bytes of a pixel, and the error of the worst frame, %, for each number of images.
fn curve(day: &Day, side: usize, bits: Bits, light: &[f64]) -> Result<Vec<(f64, f64)>> {
    let mut squares = vec![vec![0.0; day.len()]; COUNTS.len()];
    let mut bytes = vec![0.0; COUNTS.len()];
    for tile in tiles(day, side) {
        let rows = day.rows_of(Of::White, &tile);
        if rows.len() == 0 {
            continue;
        }
        for (at, (of_tile, more)) in compressed(&rows, bits)?.into_iter().enumerate() {
            squares[at].iter_mut().zip(of_tile).for_each(|(sum, square)| *sum += square);
            bytes[at] += more;
        }
    }
    let pixels = (day.width * day.height) as f64;
    Ok(bytes.iter().zip(&squares).map(|(bytes, squares)| (bytes / pixels, day.worst(squares, light))).collect())
}

/// What the images of the technique's own tiles may be, and its name.
const OWN: [(Texels, &str); 4] = [
    (Texels::Plain, "floats and bytes"),
    (Texels::Bc5, "BC5 and BC4"),
    (Texels::Bc6h, "BC6H"),
    (Texels::Blocks, "all blocks"),
];

/// The blocks of the tile of some rows.
fn layout(day: &Day, rows: &Rows) -> Layout {
    let pixels = || rows.places.iter().map(|(pixel, _)| [pixel % day.width, pixel / day.width]);
    let [left, top] = [0, 1].map(|axis| pixels().map(|at| at[axis]).min().unwrap_or(0) / TILE * TILE);
    let [columns, height] = [TILE.min(day.width - left), TILE.min(day.height - top)];
    let mut mask = vec![0u32; (columns * height).div_ceil(32)];
    for [x, y] in pixels() {
        let texel = (y - top) * columns + x - left;
        mask[texel / 32] |= 1 << (texel % 32);
    }
    Layout::new(&mask, [columns as u32, height as u32])
}

/// The same for the technique's own tiles at several tolerances.
fn own(day: &Day, light: &[f64], texels: Texels) -> Result<Vec<(f64, f64)>> {
    let mut points = Vec::new();
    let parts: Vec<Rows> = tiles(day, TILE).iter().map(|tile| day.rows_of(Of::White, tile)).collect();
    for tolerance in TOLERANCES {
        let (mut squares, mut bytes) = (vec![0.0; day.len()], 0);
        for rows in parts.iter().filter(|rows| rows.len() > 0) {
            let light = Measured { dimensions: rows.times, rows: &rows.values, noise: &[] };
            let (aim, columns) = (Aim { tolerance, most: rows.times }, Columns::Dimensions);
            let layer = match texels {
                Texels::Plain => Layer::compress(light, columns, aim)?,
                texels => Layer::in_these(light, columns, aim, (texels, &layout(day, rows)))?,
            };
            bytes += layer.bytes();
            for (t, square) in squares.iter_mut().enumerate() {
                let coefficients = layer.mix([(t, [1.0; 3])].into_iter());
                for texel in 0..rows.len() / 3 {
                    for (channel, found) in layer.decode(texel, &coefficients).into_iter().enumerate() {
                        let truth = rows.values[(3 * texel + channel) * rows.times + t];
                        *square += f64::from(found - truth).powi(2);
                    }
                }
            }
        }
        points.push((bytes as f64 / (day.width * day.height) as f64, day.worst(&squares, light)));
    }
    Ok(points)
}

pub(super) fn before_and_after(results: &Results, days: &[Day], runs: &[&Done]) -> Result<Section> {
    let mut section = Section::new("Section 3.2: size before and after");
    section.text(
        "The paper has 288 frames of 800×600 pixels of 24 bits (about 400 MB), 180 of them lit, and says that ten vectors save 94.5 %. That is the saving in \
         *numbers* of the lit frames. In bytes the projected images need more than 8 bits. Sizes at 800×600 are ours, calculated: the measured numbers of \
         lit frames, images and bytes per pixel times 480,000 pixels; no bake of this size was made.",
    );
    for (day, run) in days.iter().zip(runs) {
        let times = results.times(run)?;
        let (steps, lit, pixels) = (day.steps as f64, day.len() as f64, PAPER_PIXELS);
        let numbers = 3.0 * pixels * lit;
        let kept = VECTORS * (3.0 * pixels + lit);
        let frames = numbers;
        let vectors = 2.0 * VECTORS * 3.0 * pixels + 4.0 * VECTORS * lit;
        let of_bake = times.fact("bytes").map(|bytes| bytes / (day.width * day.height) as f64 * pixels);
        let raw = 2.0 * numbers;
        let percent = |after: f64, before: f64| 100.0 * (1.0 - after / before);
        let title = format!("{}, at 800×600", day.name);
        section.add(
            Table::figures(format!("size-{}", day.id), title)
                .figure("steps of the day", "", 288.0, steps)
                .figure("lit frames", "", 180.0, lit)
                .figure("all frames, 24 bits a pixel", "MB", 400.0, 3.0 * pixels * steps / MEGA)
                .figure("numbers saved by ten vectors", "%", 94.5, percent(kept, numbers))
                .figure(
                    "bytes saved by ten vectors of 16-bit floats against lit frames of 24 bits",
                    "%",
                    None,
                    percent(vectors, frames),
                )
                .figure("lit frames of 16-bit floats", "MB", None, raw / MEGA)
                .figure(
                    "this bake, sun and sky, all within its tolerance",
                    "MB",
                    None,
                    of_bake.map(|bytes| bytes / MEGA),
                )
                .figure(
                    "bytes saved by this bake against lit frames of 16-bit floats",
                    "%",
                    None,
                    of_bake.map(|b| percent(b, raw)),
                )
                .figure("images of a tile of this bake, mean", "", None, times.fact("images"))
                .figure(
                    "noise of the worst frame of the median tile",
                    "%",
                    None,
                    times.fact("noise").map(|n| 100.0 * n),
                )
                .figure(
                    "worst frame of a tile of this bake, RMS / mean",
                    "%",
                    None,
                    times.fact("worst tile").map(|w| 100.0 * w),
                ),
        );
    }
    Ok(section)
}

pub(super) fn error_and_bytes(days: &[Day]) -> Result<Section> {
    let mut section = Section::new("Beyond the paper: error against bytes");
    section.text(
        "Principal components of irradiance under a white sun, by the side of the tiles, the number of images and their bits. The error is that of the worst \
         frame of the day, over its mean. Frames are weighted by their means, so that dusk counts as much as noon. The technique's own tiles choose \
         images and bits by their tolerance (30, 20, 10, 5 and 2 % in each tile), and with blocks (`bake.format`) their error as it is decoded from the blocks.",
    );
    let columns =
        ["scene", "side of a tile", "values", "images of a tile", "bytes a pixel", "worst frame, RMS / mean (%)"];
    let mut table = Table::new("bytes", "Error of the worst frame and bytes", columns);
    for day in days {
        let light = day.rows(Of::White).sums();
        let (x, y) = (Axis::new("bytes a pixel").log(), Axis::new("worst frame, RMS / mean (%)").log());
        let mut plot = Plot::new(format!("bytes-{}", day.id), format!("{}: error against bytes", day.name), x, y);
        let raw = 6.0 * day.len() as f64;
        for side in SIDES {
            for bits in Bits::ALL {
                let points = curve(day, side, bits, &light)?;
                let of = if side == 0 { "whole picture".to_owned() } else { format!("{side}×{side}") };
                for (count, (bytes, worst)) in COUNTS.iter().zip(&points) {
                    table.push([
                        day.name.as_str().into(),
                        of.as_str().into(),
                        bits.name().into(),
                        (*count).into(),
                        (*bytes).into(),
                        (*worst).into(),
                    ]);
                }
                plot = plot.line(format!("{of}, {}", bits.name()), points);
            }
        }
        for (texels, name) in OWN {
            let points = own(day, &light, texels)?;
            for (tolerance, (bytes, worst)) in TOLERANCES.iter().zip(&points) {
                table.push([
                    day.name.as_str().into(),
                    format!("{TILE}×{TILE}").into(),
                    format!("{name}, within {:.0} %", 100.0 * tolerance).into(),
                    Option::<f64>::None.into(),
                    (*bytes).into(),
                    (*worst).into(),
                ]);
            }
            plot = plot.line(format!("the technique's tiles, {name}"), points);
        }
        section.add(plot.upright(raw, "all frames, 16-bit floats"));
    }
    section.add(table);
    Ok(section)
}
