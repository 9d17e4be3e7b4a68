//! Operators that solve one equation for the whole picture: Fattal 2002 and Mantiuk 2006.
//!
//! Both choose the differences of log₁₀ L between neighbours ([`fattal`], [`mantiuk`]). [`solve`] finds the logarithm whose differences are nearest to
//! them, and [`display`] fits this logarithm to the display.

use super::{
    Operator, Settings,
    solve::{self, Edges, Of, Solution, Sum, Wanted},
    statistics::{self, BINS_BYTES, FOUND_BYTES, Rectangle},
};
use crate::{
    Error, Result,
    graph::{Buffer, Extent, Format, Graph, Image},
    shaders::{
        consts,
        tonemap::{attenuate, attenuated, contrast, fit, gradient, light, logarithm, octave, solve_mean},
    },
};

/// Pixels of the largest picture, 8192².
pub const MOST_PIXELS: u64 = 1 << 26;
/// Fattal: smallest side of a level of the pyramid beside the first.
const SMALLEST: u32 = 32;
/// Fattal: share of α below which gradients are not told apart. The paper has no such limit; without it the noise of an even sky, whose
/// gradients are small at all levels, would be made several times stronger.
const LEAST: f32 = 0.1;

/// Display luminance relative to white of every pixel, R32F, and the state of the solver.
///
/// # Errors
/// `Usage` if the picture is larger than [`MOST_PIXELS`].
pub fn display(
    graph: &mut Graph,
    luminance: Image,
    statistics: Buffer,
    settings: &Settings,
) -> Result<(Image, Buffer)> {
    let extent = graph.extent(luminance);
    check(extent.width, extent.height, settings)?;
    let logarithm = graph.image("tonemap.logarithm", Format::R32F, extent);
    graph.compute(logarithm::Args { luminance, statistics, logarithm }, extent);
    let wanted = match settings.operator {
        Operator::Mantiuk => mantiuk(graph, logarithm, settings),
        _ => fattal(graph, logarithm, settings),
    };
    let Solution { values, state } = solve::solve(graph, &wanted);
    Ok((fitted(graph, values, settings), state))
}

/// # Errors
/// As [`display`].
pub(super) fn check(width: u32, height: u32, settings: &Settings) -> Result<()> {
    if u64::from(width) * u64::from(height) <= MOST_PIXELS {
        return Ok(());
    }
    let name = settings.operator.name();
    Err(Error::usage(format!("a picture of {width}×{height} pixels; allowed with {name}: {MOST_PIXELS} pixels"))
        .at("operator")
        .help("Reduce the picture, or use another operator, such as bilateral"))
}

/// Attenuated gradients of a logarithm, section 4 of Fattal 2002.
///
/// Two things are not the paper's: the gradient between two pixels has the mean attenuation of both, so that mirrored pictures give mirrored
/// results, and gradients below a tenth of α are attenuated as a tenth of α is.
pub fn fattal(graph: &mut Graph, logarithm: Image, settings: &Settings) -> Wanted {
    let extent = graph.extent(logarithm);
    let goes_on = |e: Extent| e.width.min(e.height).div_ceil(2) >= SMALLEST;
    let extents = solve::extents(extent, goes_on);
    let (state, sums) = (solve::state(graph), solve::sums(graph, extent));
    let means = graph.buffer("tonemap.means", 4 * extents.len() as u64);
    let mut level = logarithm;
    let mut gradients = Vec::new();
    for (k, &extent) in extents.iter().enumerate() {
        if k > 0 {
            let coarse = graph.image(format!("tonemap.octave{k}"), Format::R32F, extent);
            graph.compute(octave::Args { fine: level, coarse }, extent);
            level = coarse;
        }
        let gradient = graph.image(format!("tonemap.gradient{k}"), Format::R32F, extent);
        let push = gradient::Push { scale: 0.5f32.powi(k as i32 + 1) };
        graph.compute(gradient::Args { logarithm: level, gradient, push }, extent);
        let mean = Sum { stage: consts::TONEMAP_SOLVE_MEAN, mean: k as u32, divisor: extent.pixels() as f32 };
        solve::dot(graph, Of::Values(gradient), [state, sums, means], &mean);
        gradients.push(gradient);
    }
    let mut coarse = None;
    for (k, &gradient) in gradients.iter().enumerate().rev() {
        let attenuation = graph.image(format!("tonemap.attenuation{k}"), Format::R32F, extents[k]);
        let push = attenuate::Push { alpha: settings.alpha, beta: settings.beta, least: LEAST, level: k as u32 };
        let spec = attenuate::Spec { has_coarse: coarse.is_some().into() };
        let args = attenuate::Args { gradient, coarse: coarse.unwrap_or(gradient), means, attenuation, push, spec };
        graph.compute(args, extents[k]);
        coarse = Some(attenuation);
    }
    let flow = Edges::new(graph, "flow", extent);
    // The last attenuation is that of the picture itself.
    let attenuation = coarse.unwrap_or(logarithm);
    graph.compute(attenuated::Args { logarithm, attenuation, across: flow.across, down: flow.down }, extent);
    Wanted { flows: vec![flow], weights: Vec::new() }
}

/// Scaled contrasts of all levels of a logarithm, sections 3 and 4 of Mantiuk 2006.
///
/// Not the paper's: its closed form of the response to a contrast (equation 14) is a power of it, and scaling a power would scale all
/// contrasts alike. The response here is the integral of one over the threshold of which that power is a fit, with a threshold that stays the
/// same below a contrast of 5 %, so that near the threshold the response is proportional.
pub fn mantiuk(graph: &mut Graph, logarithm: Image, settings: &Settings) -> Wanted {
    let extents = solve::extents(graph.extent(logarithm), |e| e.width.max(e.height) >= 4);
    let solve = solve::state(graph);
    let mut wanted = Wanted { flows: Vec::new(), weights: Vec::new() };
    let mut level = logarithm;
    for (k, &extent) in extents.iter().enumerate() {
        if k > 0 {
            let coarse = graph.image(format!("tonemap.mean{k}"), Format::R32F, extent);
            graph.compute(solve_mean::Args { fine: level, solve, coarse }, extent);
            level = coarse;
        }
        let [weights, flow] = ["weights", "flow"].map(|name| Edges::new(graph, &format!("{name}{k}"), extent));
        let args = contrast::Args {
            logarithm: level,
            across: weights.across,
            down: weights.down,
            flow_across: flow.across,
            flow_down: flow.down,
            push: contrast::Push { scale: settings.contrast_scale },
        };
        graph.compute(args, extent);
        wanted.weights.push(weights);
        wanted.flows.push(flow);
    }
    wanted
}

/// Fits the logarithm to the display: percentiles as [`Settings::clipped`] says.
fn fitted(graph: &mut Graph, logarithm: Image, settings: &Settings) -> Image {
    let extent = graph.extent(logarithm);
    let light = graph.image("tonemap.light", Format::R32F, extent);
    graph.compute(light::Args { logarithm, light }, extent);
    let ends = percentiles(graph, light, settings.clipped());
    let codes = settings.operator == Operator::Mantiuk;
    let middle = if codes { percentiles(graph, light, 50.0) } else { ends };
    let display = graph.image("tonemap.display", Format::R32F, extent);
    graph.compute(fit::Args { light, ends, middle, display, spec: fit::Spec { codes: codes.into() } }, extent);
    display
}

/// The bits of the values that so many percent are below, and above.
fn percentiles(graph: &mut Graph, light: Image, percent: f32) -> Buffer {
    let extent = graph.extent(light);
    let found = graph.buffer("tonemap.percentiles", FOUND_BYTES);
    let bins = graph.buffer("tonemap.bins", BINS_BYTES);
    graph.fill(found, 0);
    graph.fill(bins, 0);
    for shift in statistics::DIGITS {
        statistics::count_digits(graph, light, Rectangle::from(extent), found, bins, shift);
        statistics::select_digit(graph, found, bins, statistics::ranks(extent.pixels(), percent), shift);
    }
    found
}
