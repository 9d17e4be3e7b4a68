//! Image-space radiosity in double precision: the terms of the dissertation's equations, and each pass as a plain loop.
//!
//! Nothing here is meant to be fast. The shaders are tested against it, and it is tested against closed forms.

use super::isr_scene::{Buffers, Eye};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// Form factor [ISR 6]: the share of what leaves a differential patch at `p` that arrives at the area `d_area` (m²) at `x`.
/// Unbounded as the two touch.
pub fn form_factor(p: DVec3, p_normal: DVec3, x: DVec3, x_normal: DVec3, d_area: f64) -> f64 {
    let line = x - p;
    let direction = line.normalize_or_zero();
    let cos_p = p_normal.dot(direction).max(0.0);
    let cos_x = x_normal.dot(-direction).max(0.0);
    if cos_p * cos_x == 0.0 { 0.0 } else { cos_p * cos_x * d_area / (PI * line.length_squared()) }
}

/// Occlusion [ISR 26] without the factor 2π/N: how much a sphere of `radius` at `x` hides from `p`.
pub fn occlusion(p: DVec3, normal: DVec3, x: DVec3, radius: f64, bias: f64) -> f64 {
    let distance = p.distance(x);
    if distance < 1e-6 {
        return 0.0;
    }
    let sine = (radius / distance).clamp(0.0, 1.0);
    (1.0 - (1.0 - sine.powi(2)).sqrt()) * (normal.dot((x - p) / distance) - bias).max(0.0)
}

/// Attenuation [ISR 16] of the dissertation's spherical lights; both arguments in metres.
pub fn paper_attenuation(distance: f64, light_radius: f64) -> f64 {
    (1.0 - (distance / light_radius).powi(2)).clamp(0.0, 1.0)
}

/// Sum of all light [ISR 29]. `accessibility` = 1 − accumulated occlusion, clamped to 0..1.
pub fn sum(direct: DVec3, accessibility: f64, indirect: DVec3, k_ssao: f64, k_isr: f64) -> DVec3 {
    direct * (accessibility + 1.0 - k_ssao).clamp(0.0, 1.0) + indirect * k_isr
}

/// Where the samples of a gather lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pattern {
    /// Square grid of `(2n + 1)²` points without its centre.
    Grid,
    /// `8k` points on the k-th of n square rings; ring radii grow with the given power.
    Rings { spread: f64 },
}

/// Offset in texels and the area in texels² of each of `samples` (24, 48, 80, 120, 168, 224) samples within `reach` texels.
/// `jitter`: position within the cell, 0..1 each; `None`: the middle.
pub fn samples(pattern: Pattern, samples: usize, reach: f64, jitter: Option<DVec2>) -> Vec<(DVec2, f64)> {
    let rings = ((((samples + 1) as f64).sqrt() - 1.0) / 2.0).round() as i32;
    let n = f64::from(rings);
    // Each sample moves on within its cell by a fixed irrational step.
    let step = DVec2::new(0.754_877_666_2, 0.618_033_988_7);
    let place = |i: usize| match jitter {
        Some(jitter) => (jitter + step * i as f64).fract(),
        None => DVec2::splat(0.5),
    };
    let mut found = Vec::new();
    match pattern {
        Pattern::Grid => {
            let spacing = reach / n;
            for y in -rings..=rings {
                for x in -rings..=rings {
                    if (x, y) != (0, 0) {
                        let at = DVec2::new(f64::from(x), f64::from(y)) + place(found.len()) - 0.5;
                        found.push((at * spacing, spacing * spacing));
                    }
                }
            }
        }
        Pattern::Rings { spread } => {
            for k in 1..=rings {
                let k_f = f64::from(k);
                // Area inside the square of half width reach · m^spread, and its growth with m.
                let inside = |m: f64| 4.0 * reach.powi(2) * m.powf(2.0 * spread);
                let growth = |m: f64| 8.0 * reach.powi(2) * spread * m.powf(2.0 * spread - 1.0);
                for q in 0..8 * k {
                    let within = place(found.len());
                    let m = (k_f - 1.0 + within.y) / n;
                    let ring_area =
                        if jitter.is_some() { growth(m) / n } else { inside(k_f / n) - inside((k_f - 1.0) / n) };
                    // Walk along the rim of the unit square: 8 units long, from (1, -1) up, left, down, right.
                    let walked = (f64::from(q) + within.x) / k_f;
                    let along = walked % 2.0 - 1.0;
                    let rim = match (walked / 2.0) as u32 {
                        0 => DVec2::new(1.0, along),
                        1 => DVec2::new(-along, 1.0),
                        2 => DVec2::new(-1.0, -along),
                        _ => DVec2::new(along, -1.0),
                    };
                    found.push((rim * reach * m.powf(spread), ring_area / f64::from(8 * k)));
                }
            }
        }
    }
    found
}

/// The place within a cell that texel (x, y) uses: multiples of t⁻¹ … t⁻⁴, with t⁵ = t + 1.
pub fn jitter(x: usize, y: usize) -> DVec2 {
    let mut t: f64 = 1.0;
    for _ in 0..100 {
        t = (1.0 + t).powf(0.2);
    }
    let step = |power: i32| t.powi(-power);
    (x as f64 * DVec2::new(step(1), step(2)) + y as f64 * DVec2::new(step(3), step(4))).fract()
}

/// What one sample of the sum stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Estimator {
    /// The sum [ISR 25]: (2π/N) · F, with the footprint of one texel in F.
    Paper,
    /// The same with the footprint of the sample's whole cell in F.
    PaperCells,
    /// F with the footprint of the sample's whole cell; at most [`MOST`] in total.
    Area,
}

/// Bound on the sum of form factors of one texel. True ones sum to at most one, but a single estimate scatters about it: a
/// bound of one would take light away on average, none would leave bright specks where few cells cover a near sender.
pub const MOST: f64 = 2.0;

/// What a gather needs to know.
#[derive(Clone, Copy, Debug)]
pub struct Gather {
    pub estimator: Estimator,
    pub pattern: Pattern,
    pub samples: usize,
    pub jitter: bool,
    /// Coarse texels.
    pub reach: f64,
    /// Coarse texels.
    pub occlusion_reach: f64,
    /// Sides of the sample's cell.
    pub occluder_radius: f64,
    pub occlusion_bias: f64,
    /// Places between receiver and sender at which the depth buffer is asked for something in between; 0: all senders are visible.
    pub visibility_steps: usize,
    /// Of what hides a sender, relative to its depth.
    pub thickness: f64,
}

/// The distance along the axis, over `far`, at which the line between two points crosses the line of sight of the place `t` of the
/// way between their images: by halving the line, with nothing but the projection.
pub fn depth_between(eye: &Eye, from: DVec3, to: DVec3, t: f64) -> f64 {
    let seen = |p: DVec3| {
        let local = p - eye.position;
        let z = local.dot(eye.forward);
        (DVec2::new(local.dot(eye.right), local.dot(eye.up)) / z, z / eye.far)
    };
    let (start, end) = (seen(from).0, seen(to).0);
    let way = end - start;
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..30 {
        let middle = 0.5 * (low + high);
        if (seen(from.lerp(to, middle)).0 - start).dot(way) < t * way.length_squared() {
            low = middle;
        } else {
            high = middle;
        }
    }
    seen(from.lerp(to, low)).1
}

/// Whether the depth buffer shows something between the surfaces of two texels: as far before the line between them as a thing of the
/// settings' thickness may be, and no nearer to it than rounding.
fn hidden(eye: &Eye, buffers: &Buffers, settings: &Gather, from: (usize, usize), to: (usize, usize)) -> bool {
    let place = |(x, y): (usize, usize)| DVec2::new(x as f64, y as f64);
    let (p, q) = (buffers.position(eye, from.0, from.1), buffers.position(eye, to.0, to.1));
    (1..=settings.visibility_steps).any(|i| {
        let t = i as f64 / (settings.visibility_steps + 1) as f64;
        let at = place(from).lerp(place(to), t).round();
        let at = (at.x as usize, at.y as usize);
        let shown = buffers.depth[buffers.at(at.0, at.1)];
        let line = depth_between(eye, p, q, t);
        at != from && at != to && shown < 0.98 * line && shown > (0.98 - settings.thickness) * line
    })
}

/// Gathered radiance of a white receiver (rgb) and accumulated occlusion (w) for every texel.
pub fn gather(eye: &Eye, buffers: &Buffers, settings: &Gather) -> Vec<(DVec3, f64)> {
    let mut result = Vec::new();
    for y in 0..buffers.height {
        for x in 0..buffers.width {
            result.push(gather_texel(eye, buffers, settings, x, y));
        }
    }
    result
}

/// [`gather`] for one texel.
pub fn gather_texel(eye: &Eye, buffers: &Buffers, settings: &Gather, x: usize, y: usize) -> (DVec3, f64) {
    let here = buffers.at(x, y);
    if buffers.depth[here] >= 1.0 {
        return (DVec3::ZERO, 0.0);
    }
    let p = buffers.position(eye, x, y);
    let n = buffers.normal[here].normalize();
    let jitter = settings.jitter.then(|| jitter(x, y));
    let count = settings.samples as f64;
    let others = |reach: f64| {
        samples(settings.pattern, settings.samples, reach, jitter).into_iter().filter_map(move |(offset, area)| {
            let at = DVec2::new(x as f64, y as f64) + offset.round();
            let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < buffers.width as f64 && at.y < buffers.height as f64;
            let (sx, sy) = (at.x as usize, at.y as usize);
            (inside && (sx, sy) != (x, y) && buffers.depth[buffers.at(sx, sy)] < 1.0).then_some((sx, sy, area))
        })
    };
    let mut light = DVec3::ZERO;
    let mut factors = 0.0;
    for (sx, sy, area) in others(settings.reach) {
        let sender = buffers.at(sx, sy);
        let (q, q_normal) = (buffers.position(eye, sx, sy), buffers.normal[sender].normalize());
        let texel = buffers.footprint(eye, sx, sy);
        let factor = match settings.estimator {
            // [ISR 25]
            Estimator::Paper => 2.0 * PI / count * form_factor(p, n, q, q_normal, texel),
            Estimator::PaperCells => 2.0 * PI / count * form_factor(p, n, q, q_normal, texel * area),
            Estimator::Area => {
                let r2 = p.distance_squared(q);
                let bounded = PI * r2 / (PI * r2 + texel);
                form_factor(p, n, q, q_normal, texel * area) * bounded
            }
        };
        if factor > 0.0 && hidden(eye, buffers, settings, (x, y), (sx, sy)) {
            continue;
        }
        light += factor * buffers.mask[sender] * buffers.sender[sender];
        factors += factor;
    }
    if settings.estimator == Estimator::Area {
        light /= (factors / MOST).max(1.0);
    }
    let mut hidden = 0.0;
    for (sx, sy, area) in others(settings.occlusion_reach) {
        let z = buffers.depth[buffers.at(sx, sy)];
        let radius = settings.occluder_radius * (area * buffers.facing_area(eye, z)).sqrt();
        // [ISR 26]
        hidden += 2.0 * PI / count * occlusion(p, n, buffers.position(eye, sx, sy), radius, settings.occlusion_bias);
    }
    (light * buffers.mask[here], hidden)
}

/// The sum of the area estimator over every texel of the image as a sender: what more and more samples converge to.
pub fn gather_all(eye: &Eye, buffers: &Buffers, x: usize, y: usize) -> DVec3 {
    let (p, n) = (buffers.position(eye, x, y), buffers.normal[buffers.at(x, y)].normalize());
    let mut light = DVec3::ZERO;
    for sy in 0..buffers.height {
        for sx in 0..buffers.width {
            let i = buffers.at(sx, sy);
            if (sx, sy) != (x, y) && buffers.depth[i] < 1.0 {
                let q = buffers.position(eye, sx, sy);
                let texel = buffers.footprint(eye, sx, sy);
                light += form_factor(p, n, q, buffers.normal[i].normalize(), texel) * buffers.sender[i];
            }
        }
    }
    light
}

/// The 2 × 2 mean of a row-major image; texels beyond an odd border repeat the border. `takes` chooses among the four by
/// their depth and the nearest of the four.
pub fn downsample<T>(
    width: usize,
    height: usize,
    depth: &[f64],
    value: impl Fn(usize) -> T,
    takes: impl Fn(f64, f64) -> bool,
) -> Vec<T>
where
    T: std::ops::Add<Output = T> + std::ops::Div<f64, Output = T>,
{
    let mut result = Vec::new();
    for y in (0..height).step_by(2) {
        for x in (0..width).step_by(2) {
            let (right, below) = ((x + 1).min(width - 1), (y + 1).min(height - 1));
            let four = [y * width + x, y * width + right, below * width + x, below * width + right];
            let nearest = four.iter().map(|&i| depth[i]).fold(f64::INFINITY, f64::min);
            let taken: Vec<T> = four.iter().filter(|&&i| takes(depth[i], nearest)).map(|&i| value(i)).collect();
            let count = taken.len() as f64;
            if let Some(total) = taken.into_iter().reduce(|a, b| a + b) {
                result.push(total / count);
            }
        }
    }
    result
}

/// Gaussian blur of a row-major image with the two-dimensional kernel (the shader uses that it separates).
pub fn gaussian(width: usize, height: usize, image: &[f64], radius: i64, sigma: f64) -> Vec<f64> {
    let clamp = |at: i64, size: usize| at.clamp(0, size as i64 - 1) as usize;
    let mut result = Vec::new();
    for y in 0..height as i64 {
        for x in 0..width as i64 {
            let (mut sum, mut weights) = (0.0, 0.0);
            for dy in -radius..=radius {
                for dx in -radius..=radius {
                    let w = (-((dx * dx + dy * dy) as f64) / (2.0 * sigma * sigma)).exp();
                    sum += w * image[clamp(y + dy, height) * width + clamp(x + dx, width)];
                    weights += w;
                }
            }
            result.push(sum / weights);
        }
    }
    result
}

/// Bilateral upsampling [ISR 27] with weights normalised by [ISR 28], for one pixel between four coarse samples, each with value and distance in depth; (x, y) in 0..1 from
/// the first. `None` stands for background. If the best share of the largest weight 1/ε is below 1 %, the nearest in depth.
pub fn upsample(samples: [Option<(f64, f64)>; 4], x: f64, y: f64, epsilon: f64) -> f64 {
    let bilinear = [(1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y];
    let weighted: Vec<(f64, f64, f64)> = samples
        .iter()
        .zip(bilinear)
        .filter_map(|(sample, b)| sample.map(|(value, off)| (value, off, b / (epsilon + off))))
        .collect();
    let total: f64 = weighted.iter().map(|w| w.2).sum();
    if total * epsilon < 0.01 {
        return weighted.iter().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0.0, |w| w.0);
    }
    weighted.iter().map(|w| w.0 * w.2).sum::<f64>() / total
}
