//! Local adaptation from averages of halved pictures ([`Local::Pyramid`](super::Local::Pyramid)).

use super::{
    Operator, Settings,
    search::{Kernel, Search},
};
use crate::{
    Error, Result,
    graph::{Extent, Graph, Image},
    shaders::{
        tonemap::{halve, level, pyramid},
        types::TonemapChoice,
    },
};

/// Smallest variance, in pixels², of a Gaussian whose average comes from level 1 and from level 2.
pub const VARIANCE: [f64; 2] = [1.5, 9.0];
/// Variance that means of 2^l × 2^l pixels add, and that reading them bilinearly adds at the mean over the pixels of one of theirs.
const ADDED: [f64; 2] = [0.25 + 0.75, 1.25 + 2.75];
/// Places at which a Gaussian is looked at across one pixel of a level.
const PLACES: i32 = 64;
/// Pixels of a level that one invocation averages.
const BLOCK: [u32; 2] = [8, 4];
/// A tile has the same levels and the same blocks as the whole picture if it begins at multiples of this.
pub const GRID: u32 = 8;
/// Bytes of a buffer that every device can bind.
const BUFFER_BYTES: u64 = 1 << 27;

/// A Gaussian average as the pyramid has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Average {
    /// 0: full size; 1, 2: halved so many times.
    pub level: usize,
    /// Weights on the level of distances 0 to the radius, in pixels of the level; those of both sides together 1.
    pub weights: Kernel,
}

impl Average {
    /// Of a Gaussian of `sigma` whose weights at full size are `weights`.
    pub fn new(sigma: f64, weights: &Kernel) -> Self {
        let variance = 2.0 * weights.iter().enumerate().map(|(d, w)| (d * d) as f64 * w).sum::<f64>();
        let level = VARIANCE.iter().filter(|least| variance >= **least).count();
        if level == 0 {
            return Self { level, weights: weights.clone() };
        }
        let side = f64::from(1 << level);
        let narrowed = ((variance - ADDED[level - 1]) / variance).sqrt();
        let (sigma, reach) = (sigma * narrowed, (weights.len() as f64 - 0.5) * narrowed);
        let share = |d: usize| -> f64 {
            let place = |i: i32| (d as f64 - 0.5 + (f64::from(i) + 0.5) / f64::from(PLACES)) * side;
            let weight = |x: f64| if x.abs() <= reach { (-x * x / (2.0 * sigma * sigma)).exp() } else { 0.0 };
            (0..PLACES).map(place).map(weight).sum()
        };
        let mut weights: Kernel = (0..).map(share).take_while(|w| *w > 0.0).collect();
        let sum = 2.0 * weights.iter().sum::<f64>() - weights[0];
        weights.iter_mut().for_each(|w| *w /= sum);
        Self { level, weights }
    }

    /// Pixels to each side on which the average of a pixel depends.
    pub fn reach(&self) -> usize {
        let radius = self.weights.len() - 1;
        if self.level == 0 { radius } else { (radius + 2) << self.level }
    }
}

/// All averages of a search, in the order of its Gaussians.
pub fn averages(search: &Search) -> Vec<Average> {
    search.gaussians.iter().zip(&search.sigmas).map(|(weights, sigma)| Average::new(*sigma, weights)).collect()
}

/// Samples that one pixel takes: products of weight and sample. Blocks of pixels share the averages along the rows that they see; those of
/// halved pictures are shared out among the pixels of one of theirs, and are read by four samples.
pub fn samples(search: &Search) -> f64 {
    let of = |average: &Average| {
        let (taps, rows) = ((2 * average.weights.len() - 1) as f64, if average.level == 0 { 2.0 } else { 4.0 });
        let seen = taps - 1.0 + rows;
        let block = seen / rows * taps + seen;
        if average.level == 0 { block } else { block / f64::from(1 << (2 * average.level)) + 4.0 }
    };
    averages(search).iter().map(of).sum()
}

/// Writes local adaptation of every pixel to `adaptation`, with `importance` at least of those blocks in which that has a pixel that is not 0.
///
/// # Errors
/// `Usage` if the picture is larger than devices must be able to serve in one piece.
pub(super) fn adapt(
    graph: &mut Graph,
    luminance: Image,
    importance: Option<Image>,
    statistics: crate::graph::Buffer,
    settings: &Settings,
    search: &Search,
    adaptation: Image,
) -> Result<()> {
    let extent = graph.extent(luminance);
    let sizes = [extent.div_ceil(2), extent.div_ceil(2).div_ceil(2)];
    let averages = averages(search);
    let of_level = |level: usize| -> Vec<Kernel> {
        averages.iter().filter(|a| a.level == level).map(|a| a.weights.clone()).collect()
    };
    let kernels = [of_level(0), of_level(1), of_level(2)];
    let bytes = |i: usize| 4 * sizes[i].pixels() * kernels[i + 1].len() as u64;
    if bytes(0).max(bytes(1)).max(4 * extent.pixels()) > BUFFER_BYTES {
        let (w, h) = (extent.width, extent.height);
        return Err(Error::usage(format!(
            "a picture of {w}×{h} pixels in one piece; allowed: about 33 million pixels"
        ))
        .at("local = \"pyramid\"")
        .help("Use local = \"fast\""));
    }
    let levels = [0, 1].map(|i| graph.buffer(format!("tonemap.level{}", i + 1), 4 * sizes[i].pixels()));
    let full = graph.buffer("tonemap.level0", 4 * extent.pixels());
    let args = halve::Args { luminance, full, half: levels[0], quarter: levels[1], statistics };
    graph.compute(args, [sizes[1].width, sizes[1].height]);
    let planes = [0, 1].map(|i| {
        let kernels = &kernels[i + 1];
        if kernels.is_empty() {
            // Nothing is read from it.
            return levels[i];
        }
        let averages = graph.buffer(format!("tonemap.level{}.averages", i + 1), bytes(i));
        let mut push = level::Push { size: [sizes[i].width as i32, sizes[i].height as i32], ..level::Push::default() };
        for (radius, kernel) in push.radius.iter_mut().zip(kernels) {
            *radius = kernel.len() as i32 - 1;
        }
        let args = level::Args {
            level: levels[i],
            kernels: graph.uniform(&Search::kernels_of(kernels)),
            averages,
            push,
            spec: level::Spec { radius: push.radius.into_iter().max().unwrap_or(0) },
        };
        let blocks = [sizes[i].width.div_ceil(BLOCK[0]), sizes[i].height.div_ceil(BLOCK[1])];
        graph.compute(args, [blocks[0], blocks[1], kernels.len() as u32]);
        averages
    });
    let mut choice = TonemapChoice { slope: search.slope as f32, ..TonemapChoice::default() };
    for (offset, step) in choice.offset.iter_mut().zip(&search.steps) {
        *offset = step.offset as f32;
    }
    let spec = pyramid::Spec {
        full: kernels[0].len() as u32,
        halved: kernels[1].len() as u32,
        radius: kernels[0].iter().map(|k| k.len() as i32 - 1).max().unwrap_or(0),
        steps: search.steps.len() as u32,
        next: (settings.operator == Operator::Reinhard).into(),
        has_map: importance.is_some().into(),
    };
    let args = pyramid::Args {
        full,
        kernels: graph.uniform(&Search::kernels_of(&kernels[0])),
        half: planes[0],
        quarter: planes[1],
        choice: graph.uniform(&choice),
        statistics,
        importance: importance.unwrap_or(luminance),
        adaptation,
        spec,
    };
    graph.compute(args, Extent::new(extent.width.div_ceil(8), extent.height.div_ceil(2)));
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn search(operator: Operator, radius: u32) -> Search {
        Search::new(&Settings { operator, radius, ..Settings::default() }).unwrap()
    }

    #[test]
    fn work_does_not_grow_with_the_radius_as_that_of_the_exact_ways() {
        for radius in 1..=16 {
            let search = search(Operator::Ashikhmin, radius);
            assert!(samples(&search) <= 320.0, "{radius}: {}", samples(&search));
            // Each average has at most a dozen samples and what reading it takes, whatever its radius.
            for (average, weights) in averages(&search).iter().zip(&search.gaussians) {
                let taps = 2 * average.weights.len() - 1;
                assert!(taps <= [5, 9, 19][average.level], "{} of {}: {taps}", weights.len() - 1, average.level);
            }
        }
        let of = |radius| samples(&search(Operator::Ashikhmin, radius));
        assert!(of(16) < 2.0 * of(8), "{} {}", of(16), of(8));
    }

    #[test]
    fn averages_keep_their_mean_and_variance() {
        for search in [search(Operator::Ashikhmin, 16), search(Operator::Reinhard, 1)] {
            let mut levels = Vec::new();
            for (average, weights) in averages(&search).iter().zip(&search.gaussians) {
                let sum = |w: &Kernel| 2.0 * w.iter().sum::<f64>() - w[0];
                assert!((sum(&average.weights) - 1.0).abs() < 1e-12);
                let variance = |w: &Kernel| 2.0 * w.iter().enumerate().map(|(d, w)| (d * d) as f64 * w).sum::<f64>();
                let wanted = variance(weights);
                let (side, added) = (f64::from(1 << average.level), [0.0, 1.0, 4.0][average.level]);
                let found = side * side * variance(&average.weights) + added;
                // A pixel's own extent, side² / 12, is in its weights.
                let most = 0.02 * wanted + if average.level > 0 { side * side / 12.0 } else { 0.0 };
                assert!((found - wanted).abs() <= most, "{wanted}: {found}");
                levels.push(average.level);
            }
            assert!(levels.is_sorted() && levels.last() == Some(&2), "{levels:?}");
            // What the shader of the search is made for.
            assert!(levels.iter().filter(|l| **l == 0).count() <= 4);
        }
    }
}
