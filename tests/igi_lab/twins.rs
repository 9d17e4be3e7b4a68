//! CPU implementations of the filters of instant global illumination, in 64 bits, written from the descriptions of the filters.

use glam::{DMat4, DVec3, DVec4, dvec2, dvec3};
use lucerna::{
    reference::isr_scene::{Buffers, Eye},
    techniques::igi::Settings,
};

pub type Texels = Vec<[f32; 4]>;

fn color(texel: [f32; 4]) -> DVec3 {
    dvec3(texel[0].into(), texel[1].into(), texel[2].into())
}

/// The pixel for which a coarse texel gathers: in its middle, or scattered.
pub fn pixel_of(buffers: &Buffers, (x, y): (usize, usize), s: &Settings) -> (usize, usize) {
    let factor = s.downsample as usize;
    let (a, b) = if s.scattered { ((y + 2 * x) % factor, (x + 2 * y) % factor) } else { (factor / 2, factor / 2) };
    ((x * factor + a).min(buffers.width - 1), (y * factor + b).min(buffers.height - 1))
}

fn place(eye: &Eye, buffers: &Buffers, (x, y): (usize, usize)) -> DVec3 {
    let (u, v) = buffers.uv(eye, x, y);
    eye.position_at(u, v, buffers.depth[buffers.at(x, y)])
}

/// Irradiance of a pixel by joint bilateral upsampling; `None` on the background, and if the weights are too small for a mean.
pub fn upsampled(eye: &Eye, buffers: &Buffers, coarse: &Texels, s: &Settings, (x, y): (usize, usize)) -> Option<DVec3> {
    let factor = s.downsample as usize;
    let (columns, rows) = (buffers.width.div_ceil(factor), buffers.height.div_ceil(factor));
    let own = buffers.at(x, y);
    let (z, n) = (buffers.depth[own], buffers.normal[own].normalize());
    if z >= 1.0 {
        return None;
    }
    let p = place(eye, buffers, (x, y));
    let middle = |i: usize| (i as f64 - (factor / 2) as f64) / factor as f64;
    let centre = dvec2(middle(x), middle(y));
    let sigma = f64::from(s.upsample_sigma);
    let reach = (2.2 * sigma - 0.5).ceil().max(1.0);
    let (mut sum, mut weights, mut all) = (DVec3::ZERO, 0.0, 0.0);
    for row in 0..rows {
        for column in 0..columns {
            let texel = dvec2(column as f64, row as f64);
            if (texel - (centre + 0.5).floor()).abs().max_element() > reach {
                continue;
            }
            let there = pixel_of(buffers, (column, row), s);
            let i = buffers.at(there.0, there.1);
            if buffers.depth[i] >= 1.0 {
                continue;
            }
            let cosine = n.dot(buffers.normal[i].normalize()).max(1e-12);
            let mut weight = cosine.powf(f64::from(s.upsample_normal));
            // At the border the pixel in the middle may be outside of the picture; the texel's position does not change.
            let apart = match s.scattered {
                true => (dvec2(there.0 as f64, there.1 as f64) - dvec2(x as f64, y as f64)) / factor as f64,
                false => texel - centre,
            };
            let near = (-0.5 * apart.length_squared() / (sigma * sigma)).exp();
            all += near;
            weight *= near;
            if s.upsample_range > 0.0 {
                let off = n.dot(place(eye, buffers, there) - p) / (z * eye.far * f64::from(s.upsample_range));
                weight *= (-0.5 * off * off).exp();
            }
            sum += weight * color(coarse[row * columns + column]);
            weights += weight;
        }
    }
    // Smaller weights are near the limit, where rounding decides, or below the range of 32 bits.
    (weights > 2e-4 * all && weights > 1e-30).then(|| sum / weights)
}

/// The discontinuity buffer at a texel of every `downsample`-th pixel.
pub fn joined(buffers: &Buffers, interleaved: &Texels, s: &Settings, (x, y): (usize, usize)) -> DVec3 {
    let factor = s.downsample as usize;
    let (columns, rows) = (buffers.width.div_ceil(factor), buffers.height.div_ceil(factor));
    let surface = |texel: (usize, usize)| {
        let (u, v) = pixel_of(buffers, texel, s);
        let i = buffers.at(u, v);
        (buffers.depth[i], buffers.normal[i])
    };
    let (z, n) = surface((x, y));
    if z >= 1.0 {
        return DVec3::ZERO;
    }
    let tile = s.interleave as i64;
    let (mut sum, mut count) = (DVec3::ZERO, 0.0);
    for v in (y as i64 - (tile - 1) / 2)..(y as i64 - (tile - 1) / 2 + tile) {
        for u in (x as i64 - (tile - 1) / 2)..(x as i64 - (tile - 1) / 2 + tile) {
            if !(0..columns as i64).contains(&u) || !(0..rows as i64).contains(&v) {
                continue;
            }
            let (there, normal) = surface((u as usize, v as usize));
            let near = there < 1.0 && (there - z).abs() <= f64::from(s.discontinuity_depth) * z;
            if near && n.normalize().dot(normal.normalize()) >= f64::from(s.discontinuity_normal) {
                sum += color(interleaved[v as usize * columns + u as usize]);
                count += 1.0;
            }
        }
    }
    sum / count
}

/// One iteration of smoothing at a texel of every `downsample`-th pixel, with texels `stride` apart.
pub fn smoothed(
    eye: &Eye,
    buffers: &Buffers,
    coarse: &[DVec3],
    s: &Settings,
    stride: i64,
    (x, y): (usize, usize),
) -> DVec3 {
    let factor = s.downsample as usize;
    let (columns, rows) = (buffers.width.div_ceil(factor) as i64, buffers.height.div_ceil(factor) as i64);
    let seen = |x: i64, y: i64| {
        let pixel = pixel_of(buffers, (x as usize, y as usize), s);
        let i = buffers.at(pixel.0, pixel.1);
        (buffers.depth[i] < 1.0).then(|| (place(eye, buffers, pixel), buffers.normal[i].normalize(), buffers.depth[i]))
    };
    let (x, y) = (x as i64, y as i64);
    let Some((p, n, z)) = seen(x, y) else { return DVec3::ZERO };
    let (mut sum, mut weights) = (DVec3::ZERO, 0.0);
    for (b, row) in [1.0, 4.0, 6.0, 4.0, 1.0].into_iter().enumerate() {
        for (a, column) in [1.0, 4.0, 6.0, 4.0, 1.0].into_iter().enumerate() {
            let (u, v) = (x + (a as i64 - 2) * stride, y + (b as i64 - 2) * stride);
            if !(0..columns).contains(&u) || !(0..rows).contains(&v) {
                continue;
            }
            let Some((at, normal, _)) = seen(u, v) else { continue };
            let mut weight = row * column * n.dot(normal).max(1e-12).powf(f64::from(s.upsample_normal));
            if s.upsample_range > 0.0 {
                let off = n.dot(at - p) / (z * eye.far * f64::from(s.upsample_range));
                weight *= (-0.5 * off * off).exp();
            }
            sum += weight * coarse[(v * columns + u) as usize];
            weights += weight;
        }
    }
    sum / weights
}

/// The pixel shows a surface that light falls on.
pub fn is_lit(buffers: &Buffers, i: usize) -> bool {
    buffers.depth[i] < 1.0 && buffers.mask[i] > 0.5
}

/// Light after `iterations` of the filter for its noise; alpha: variance. `noisy`: alpha is the difference between halves of the samples. `rare`: a
/// larger difference of the pixel itself is its variance. `None` where there is no lit surface.
pub fn soft(eye: &Eye, buffers: &Buffers, noisy: &Texels, iterations: u32, rare: bool) -> Vec<Option<DVec4>> {
    let [sharpness, range, contrast] = [16.0, 0.01, 2.0];
    let (columns, rows) = (buffers.width as i64, buffers.height as i64);
    let cell = |i: usize| (i as i64 % columns, i as i64 / columns);
    let count = buffers.depth.len();
    let luminance = |c: DVec4| c.truncate().dot(dvec3(0.2126, 0.7152, 0.0722));
    let surface = |i: usize| {
        let (x, y) = cell(i);
        (place(eye, buffers, (x as usize, y as usize)), buffers.normal[i].normalize(), buffers.depth[i])
    };
    // Pixels of the surface around pixel `i`, with their offset in pixels divided by `step`.
    let around = |i: usize, step: i64| {
        let (x, y) = cell(i);
        let offsets = (-2..=2).flat_map(|b| (-2..=2).map(move |a| (a, b)));
        offsets.filter_map(move |(a, b): (i64, i64)| {
            let (u, v) = (x + a * step, y + b * step);
            let inside = (0..columns).contains(&u) && (0..rows).contains(&v);
            let other = (v * columns + u) as usize;
            (inside && is_lit(buffers, other)).then_some((other, a, b))
        })
    };
    let mut light: Vec<Option<DVec4>> = (0..count)
        .map(|i| {
            if !is_lit(buffers, i) {
                return None;
            }
            let (p, n, z) = surface(i);
            let (mut sum, mut weights) = (0.0, 0.0);
            for (other, ..) in around(i, 2) {
                let (q, m, _) = surface(other);
                let off = n.dot(q - p) / (z * eye.far * range);
                let weight = n.dot(m).max(1e-12).powf(sharpness) * (-0.5 * off * off).exp();
                sum += weight * f64::from(noisy[other][3]).powi(2);
                weights += weight;
            }
            let least = if rare { f64::from(noisy[i][3]).powi(2) } else { 0.0 };
            Some(color(noisy[i]).extend((sum / weights).max(least)))
        })
        .collect();
    for turn in 0..iterations {
        let step = |i: usize| {
            let own = light[i]?;
            let (p, n, z) = surface(i);
            let (mut out, mut kept) = (DVec4::ZERO, 1.0);
            for (other, a, b) in around(i, 1 << turn).filter(|(other, ..)| *other != i) {
                let there = light[other]?;
                let (q, m, far) = surface(other);
                let kernel = |k: i64| [6.0, 4.0, 1.0][k.unsigned_abs() as usize];
                // The mean of both distances to the other's plane, relative to the mean of the depths.
                let off = 0.5 * (n + m).dot(q - p) / (0.5 * (z + far) * eye.far * range);
                let differs = (luminance(there) - luminance(own)).abs() / (contrast * (own.w + there.w).sqrt() + 1e-20);
                let weight = kernel(a) * kernel(b) / 256.0
                    * n.dot(m).max(1e-12).powf(sharpness)
                    * (-0.5 * off * off - differs).exp();
                out += (there.truncate() * weight).extend(there.w * weight * weight);
                kept -= weight;
            }
            Some(out + (own.truncate() * kept).extend(own.w * kept * kept))
        };
        light = (0..count).map(step).collect();
    }
    light
}

/// The data of the history, for [`blended`].
pub struct Past<'a> {
    pub eye: &'a Eye,
    pub clip_from_world: DMat4,
    pub buffers: &'a Buffers,
    /// Alpha: number of frames.
    pub irradiance: &'a Texels,
    /// Relative change per frame; alpha: its magnitude.
    pub trend: &'a Texels,
    /// World position in the last frame; alpha 0: the surface did not move.
    pub motion: &'a Texels,
    /// For each probe its normal (`None`: no surface), and the light of the same paths in the last frame and in this one.
    pub probes: Vec<(Option<DVec3>, DVec3, DVec3)>,
    pub columns: usize,
    pub side: usize,
}

/// The blended irradiance of a pixel with its number of frames, and the trend of the light.
pub fn blended(
    eye: &Eye,
    buffers: &Buffers,
    fresh: &Texels,
    past: &Past<'_>,
    s: &Settings,
    (x, y): (usize, usize),
) -> (DVec4, DVec4) {
    let own = buffers.at(x, y);
    if buffers.depth[own] >= 1.0 {
        return Default::default();
    }
    let n = buffers.normal[own].normalize();
    let was = match past.motion[own] {
        moved if moved[3] > 0.0 => color(moved),
        _ => place(eye, buffers, (x, y)),
    };
    let fresh = color(fresh[own]);
    let clip = past.clip_from_world * was.extend(1.0);
    let then = past.buffers;
    let at = dvec2(
        (0.5 + 0.5 * clip.x / clip.w) * then.width as f64 - 0.5,
        (0.5 - 0.5 * clip.y / clip.w) * then.height as f64 - 0.5,
    );
    let (mut sum, mut trend, mut weights) = (DVec4::ZERO, DVec4::ZERO, 0.0);
    if clip.w > 0.0 {
        for v in 0..then.height {
            for u in 0..then.width {
                // The weight of bilinear interpolation.
                let weight = (1.0 - (u as f64 - at.x).abs()).max(0.0) * (1.0 - (v as f64 - at.y).abs()).max(0.0);
                let i = then.at(u, v);
                if weight == 0.0 || then.depth[i] >= 1.0 || past.irradiance[i][3] <= 0.0 {
                    continue;
                }
                let normal = then.normal[i].normalize();
                let distance = past.eye.forward.dot(was - past.eye.position);
                let off = normal.dot(place(past.eye, then, (u, v)) - was).abs();
                if normal.dot(n) < 0.9 || off > f64::from(s.history_range) * distance {
                    continue;
                }
                sum += weight * color(past.irradiance[i]).extend(past.irradiance[i][3].into());
                trend += weight * color(past.trend[i]).extend(past.trend[i][3].into());
                weights += weight;
            }
        }
    }
    if weights <= 0.01 {
        return (fresh.extend(1.0), DVec4::ZERO);
    }
    let trend = trend / weights;
    let (mut old, count) = ((sum / weights).truncate(), sum.w / weights);
    let (mut apart, mut growth, mut light) = (0.0, DVec3::ZERO, DVec3::ZERO);
    let place = (at + 0.5) / past.side as f64 - 0.5;
    for (i, (normal, was, is)) in past.probes.iter().enumerate() {
        let probe = dvec2((i % past.columns) as f64, (i / past.columns) as f64);
        let Some(normal) = normal else { continue };
        if (probe - (place + 0.5).floor()).abs().max_element() > 2.0 {
            continue;
        }
        let weight = (-0.5 * (probe - place).length_squared()).exp() * (0.1 + 0.9 * n.dot(*normal).max(0.0));
        apart += weight * (*is - *was).abs().element_sum();
        growth += weight * (*is - *was);
        light += weight * is.max(*was);
    }
    let mut share = (1.0 / (count + 1.0)).max(1.0 / f64::from(s.history));
    let size = apart / light.element_sum();
    let mut next = DVec4::ZERO;
    if light.element_sum() > 0.0 && size > 1e-4 {
        next = trend + ((growth / light).extend(size) - trend) / 8.0;
        let mut drift = size;
        if size <= 3.0 * trend.w {
            let step = next.truncate().clamp(DVec3::splat(-0.5), DVec3::splat(0.5));
            // The change is relative to the larger of both values: growth divides by 1 - g, loss multiplies by 1 + g.
            let along = |x: f64, g: f64| if g > 0.0 { x / (1.0 - g) } else { x * (1.0 + g) };
            old = dvec3(along(old.x, step.x), along(old.y, step.y), along(old.z, step.z));
            drift = 0.35 * step.abs().max_element();
        }
        let lag = f64::from(s.history_lag);
        share = share.max(drift / (drift + lag * (1.0 - drift)));
    }
    ((old + (fresh - old) * share).extend((1.0 / share).min(f64::from(s.history))), next)
}
