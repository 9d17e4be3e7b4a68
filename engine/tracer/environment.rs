//! Importance sampling of the environment: a table of probabilities over cells whose solid angle is known exactly.

use crate::{
    Error, ErrorKind, Result,
    gpu::{Gpu, ImageDesc, OwnedImage, Region},
    scene::{Environment, environment::solid_angle},
    shaders::types::AliasEntry,
};
use ash::vk;
use glam::Vec3;

/// Maximum of cells; in larger maps a cell is a group of texels.
const MOST_CELLS: u64 = 1 << 20;
/// Share of the samples that is uniform over all directions, so that every direction has a positive density.
const UNIFORM: f64 = 0.01;

/// Probabilities of cells of a latitude-longitude map, row by row.
#[derive(Debug)]
pub struct Importance {
    /// Columns and rows.
    pub cells: [u32; 2],
    pub columns: Vec<AliasEntry>,
}

/// The importance map of an environment; a single cell without one.
pub fn importance(environment: Option<&Environment>) -> Importance {
    let Some(env) = environment.filter(|e| !e.pixels.is_empty()) else {
        return Importance { cells: [1, 1], columns: super::alias::table(&[1.0]) };
    };
    let (w, h) = (env.width as usize, env.height as usize);
    let light = spread(&env.pixels.iter().map(|&p| strength(p)).collect::<Vec<_>>(), w, h);
    let mut group = 1;
    while (w as u64).div_ceil(group) * (h as u64).div_ceil(group) > MOST_CELLS {
        group *= 2;
    }
    let cells = [w, h].map(|side| (side as u64 / group).max(1) as u32);
    let [columns, rows] = cells.map(|c| c as usize);
    let mut weights = vec![0.0; columns * rows];
    for (y, row) in light.chunks_exact(w).enumerate() {
        let angle = solid_angle(env.width, env.height, y as u32);
        for (x, value) in row.iter().enumerate() {
            weights[y * rows / h * columns + x * columns / w] += value * angle;
        }
    }
    let total: f64 = weights.iter().sum();
    let sphere = 4.0 * std::f64::consts::PI;
    for (y, row) in weights.chunks_exact_mut(columns).enumerate() {
        let even = solid_angle(cells[0], cells[1], y as u32) / sphere;
        for weight in row {
            let share = if total > 0.0 { *weight / total } else { even };
            *weight = (1.0 - UNIFORM) * share + UNIFORM * even;
        }
    }
    Importance { cells, columns: super::alias::table(&weights) }
}

/// The environment's radiance in full precision; black without one.
///
/// # Errors
/// `Runtime` if the map is larger than the device's images; `OutOfMemory`, `DeviceLost`.
pub fn radiance_map(gpu: &Gpu, environment: Option<&Environment>) -> Result<OwnedImage> {
    let (name, format) = ("environment radiance", vk::Format::R32G32B32A32_SFLOAT);
    let upload = |width, height, texels: &[[f32; 4]]| {
        let bytes = bytemuck::cast_slice(texels);
        OwnedImage::with_contents(
            gpu,
            name,
            ImageDesc::new(format, width, height),
            &[Region { mip: 0, layer: 0, bytes }],
        )
    };
    let Some(env) = environment.filter(|e| !e.pixels.is_empty()) else { return upload(1, 1, &[[0.0; 4]]) };
    let most = gpu.caps().limits.image_2d;
    if env.width > most || env.height > most {
        let what = format!("environment is {}×{}; the device allows sides of {most}", env.width, env.height);
        return Err(Error::new(ErrorKind::Runtime, what).at(format!("environment `{}`", env.name)));
    }
    let texels: Vec<[f32; 4]> = env.pixels.iter().map(|p| p.extend(1.0).to_array()).collect();
    upload(env.width, env.height, &texels)
}

/// Sum of the colour channels, independent of their order.
pub fn strength(color: Vec3) -> f64 {
    let mut c = color.to_array().map(|x| f64::from(x.max(0.0)));
    c.sort_by(f64::total_cmp);
    c[0] + c[1] + c[2]
}

/// Mean of the bilinearly interpolated map over each texel: the kernel (1, 6, 1) / 8 along both axes, across the seam and the poles.
fn spread(values: &[f64], w: usize, h: usize) -> Vec<f64> {
    let mut rows = vec![0.0; w * h];
    for (y, row) in values.chunks_exact(w).enumerate() {
        for x in 0..w {
            rows[y * w + x] = (row[(x + w - 1) % w] + 6.0 * row[x] + row[(x + 1) % w]) / 8.0;
        }
    }
    let mut out = vec![0.0; w * h];
    for y in 0..h {
        for x in 0..w {
            let beyond = |row: usize| rows[row * w + (x + w / 2) % w];
            let above = if y == 0 { beyond(0) } else { rows[(y - 1) * w + x] };
            let below = if y + 1 == h { beyond(h - 1) } else { rows[(y + 1) * w + x] };
            out[y * w + x] = (above + 6.0 * rows[y * w + x] + below) / 8.0;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_as_probable_as_their_light() {
        let mut env = Environment::constant(Vec3::ZERO);
        (env.width, env.height) = (16, 8);
        env.pixels = vec![Vec3::ZERO; 128];
        let uniform = importance(Some(&env));
        let angle = |y: u32| solid_angle(16, 8, y) / (4.0 * std::f64::consts::PI);
        assert!((f64::from(uniform.columns[3 * 16].probability) - angle(3)).abs() < 1e-7);
        env.pixels[2 * 16 + 5] = Vec3::new(0.0, 4.0, 0.0);
        let sun = importance(Some(&env));
        let p = |x: usize, y: usize| f64::from(sun.columns[y * 16 + x].probability) - UNIFORM * angle(y as u32);
        // 36 : 6 of the texel and its neighbour, weighted by solid angle.
        assert!((p(5, 2) / p(6, 2) - 6.0).abs() < 1e-3);
        assert!((p(5, 3) / p(5, 2) * angle(2) / angle(3) - 1.0 / 6.0).abs() < 1e-4);
        assert!(p(8, 2).abs() < 1e-9);
        let total: f64 = sun.columns.iter().map(|c| f64::from(c.probability)).sum();
        assert!((total - 1.0).abs() < 1e-5);
    }

    #[test]
    fn light_reaches_over_the_pole_and_the_seam() {
        let mut values = vec![0.0; 8 * 4];
        values[0] = 1.0;
        let out = spread(&values, 8, 4);
        assert!((out.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(out[7] > 0.0 && out[4] > 0.0, "{out:?}");
    }

    #[test]
    fn large_maps_are_grouped() {
        let (width, height) = (3000, 1500);
        let env = Environment { width, height, pixels: vec![Vec3::ONE; 4_500_000], ..Environment::constant(Vec3::ONE) };
        let map = importance(Some(&env));
        assert_eq!(map.cells, [750, 375]);
        assert_eq!(map.columns.len(), 750 * 375);
    }
}
