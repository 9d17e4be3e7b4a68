//! A filter against the noise of the frames of a day.

use glam::Vec3;
use lucerna::scene::View;

/// Exponent of the cosine between two normals.
const SHARPNESS: i32 = 16;
/// Distance from a pixel's plane, relative to its depth, at which another pixel weighs 1/e.
const THICKNESS: f32 = 0.01;

/// What tells surfaces apart.
pub(super) struct Surfaces {
    /// Position relative to the camera, metres, and normal; `None` without a surface.
    pixels: Vec<Option<(Vec3, Vec3)>>,
    size: [usize; 2],
}

impl Surfaces {
    /// `normals`: in world space, three values a pixel; `depths`: metres along the line of sight, 0 or less or infinite without a surface.
    pub(super) fn new(view: &View, normals: &[f32], depths: &[f32]) -> Self {
        let [width, height] = view.extent.map(|side| side as usize);
        let [right, up, forward] = view.axes();
        let scale = view.clip_from_view;
        let half = [scale.x_axis.x, scale.y_axis.y].map(|size| 1.0 / size.abs());
        let pixel = |(at, (normal, depth)): (usize, (&[f32], &f32))| {
            let normal = Vec3::from_slice(normal);
            if normal == Vec3::ZERO || !depth.is_finite() || *depth <= 0.0 {
                return None;
            }
            let u = 2.0 * ((at % width) as f32 + 0.5) / width as f32 - 1.0;
            let v = 1.0 - 2.0 * ((at / width) as f32 + 0.5) / height as f32;
            let aside = u * half[0] * right + v * half[1] * up;
            let position = if view.is_orthographic() { aside + *depth * forward } else { *depth * (aside + forward) };
            Some((position, normal))
        };
        let pixels = normals.chunks_exact(3).zip(depths).enumerate().map(pixel).collect();
        Self { pixels, size: [width, height] }
    }

    /// The weighted means of `radius` pixels to each side, for frames of three values a pixel, one after the other. All frames have the same
    /// weights, so that light still adds up.
    pub(super) fn filter(&self, frames: &[f32], radius: u32) -> Vec<f32> {
        let [width, height] = self.size;
        let one = 3 * width * height;
        let mut out = frames.to_vec();
        for at in 0..width * height {
            let weights = self.weights(at, radius as usize);
            if weights.is_empty() {
                continue;
            }
            for (frame, out) in frames.chunks_exact(one).zip(out.chunks_exact_mut(one)) {
                for channel in 0..3 {
                    out[3 * at + channel] =
                        weights.iter().map(|(other, weight)| weight * frame[3 * other + channel]).sum();
                }
            }
        }
        out
    }

    /// Pixels around one and their weights, whose sum is 1; empty without a surface.
    fn weights(&self, at: usize, radius: usize) -> Vec<(usize, f32)> {
        let [width, height] = self.size;
        let Some(Some((centre, normal))) = self.pixels.get(at) else { return Vec::new() };
        let (x, y) = (at % width, at / width);
        let sigma = 0.5 * radius.max(1) as f32;
        let thickness = THICKNESS * centre.length();
        let mut weights = Vec::new();
        for row in y.saturating_sub(radius)..(y + radius + 1).min(height) {
            for column in x.saturating_sub(radius)..(x + radius + 1).min(width) {
                let Some((position, other)) = self.pixels[row * width + column] else { continue };
                let [dx, dy] = [column.abs_diff(x), row.abs_diff(y)].map(|steps| steps as f32 / sigma);
                let plane = normal.dot(position - *centre) / thickness;
                let weight =
                    (-0.5 * (dx * dx + dy * dy) - plane * plane).exp() * normal.dot(other).max(0.0).powi(SHARPNESS);
                if weight > 1e-4 {
                    weights.push((row * width + column, weight));
                }
            }
        }
        let sum: f32 = weights.iter().map(|(_, weight)| weight).sum();
        weights.iter_mut().for_each(|(_, weight)| *weight /= sum);
        weights
    }
}

#[cfg(test)]
mod tests {
    use glam::Mat4;
    use lucerna::scene::{Camera, Projection};

    use super::*;

    /// A wall in front of the camera; the right half is a metre behind the left one, or turned.
    fn wall(turned: bool) -> Surfaces {
        let projection = Projection::Perspective { yfov: 1.0, aspect: None, znear: 0.1, zfar: Some(100.0) };
        let view = View::new(&Camera { name: String::new(), projection }, Mat4::IDENTITY, [16, 8]);
        let right = |at: usize| at % 16 >= 8;
        let normal = |at: usize| if right(at) && turned { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] };
        let normals: Vec<f32> = (0..128).flat_map(normal).collect();
        let depths: Vec<f32> = (0..128).map(|at| if right(at) && !turned { 4.0 } else { 3.0 }).collect();
        Surfaces::new(&view, &normals, &depths)
    }

    #[test]
    fn light_does_not_cross_steps_and_edges_and_noise_falls() {
        for turned in [false, true] {
            let surfaces = wall(turned);
            let noise = |at: usize| ((at * 7919 + 13) % 101) as f32 / 101.0 - 0.5;
            let even = |at: usize| if at % 16 < 8 { 1.0 } else { 5.0 };
            let frames: Vec<f32> = (0..3 * 128).map(|i| even(i / 3)).collect();
            for (at, value) in surfaces.filter(&frames, 3).iter().enumerate() {
                assert!((value - even(at / 3)).abs() < 1e-3, "{turned} {at} {value}");
            }
            let noisy: Vec<f32> = (0..3 * 128).map(|i| even(i / 3) + noise(i)).collect();
            let rest = surfaces.filter(&noisy, 3);
            let square = |list: &[f32]| list.iter().enumerate().map(|(i, v)| (v - even(i / 3)).powi(2)).sum::<f32>();
            assert!(square(&rest) < 0.2 * square(&noisy));
        }
    }

    #[test]
    fn light_adds() {
        let surfaces = wall(true);
        let frame = |seed: usize| (0..3 * 128).map(|i| ((i * seed) % 17) as f32).collect::<Vec<f32>>();
        let (a, b) = (frame(5), frame(11));
        let both: Vec<f32> = a.iter().zip(&b).map(|(a, b)| a + 2.0 * b).collect();
        let stack = surfaces.filter(&[a, b, both].concat(), 2);
        for i in 0..3 * 128 {
            assert!((stack[i] + 2.0 * stack[384 + i] - stack[768 + i]).abs() < 1e-3);
        }
    }
}
