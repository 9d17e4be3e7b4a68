//! Importance sampling of the environment: probabilities of cells whose solid angle is known exactly, as edges of intervals.

use crate::{
    Error, ErrorKind, Result,
    gpu::{Gpu, ImageDesc, OwnedImage, Region},
    scene::{Environment, environment::solid_angle},
    shaders::consts::ENVIRONMENT_EDGE_END,
};
use ash::vk;
use glam::Vec3;

/// Maximum of cells; in larger maps a cell is a group of texels.
const MOST_CELLS: u64 = 1 << 20;
/// Share of the samples that is uniform over all directions, so that every direction has a positive density.
const UNIFORM: f64 = 0.01;

/// Probabilities of cells of a latitude-longitude map.
#[derive(Debug)]
pub struct Importance {
    /// Columns and rows.
    pub cells: [u32; 2],
    /// Edges of intervals whose lengths are the probabilities, in units of 1 / [`ENVIRONMENT_EDGE_END`]: the rows, then the cells of each row.
    /// The device draws by the same integers, so the probabilities are exact. Behind the edges of each are as many numbers that say where to
    /// search (`lib/environment_sampling.glsl`).
    pub edges: Vec<u32>,
}

impl Importance {
    /// Probability of a cell.
    pub fn probability(&self, column: usize, row: usize) -> f64 {
        let [columns, rows] = self.cells.map(|count| count as usize);
        let share = |at: usize| f64::from(self.edges[at + 1] - self.edges[at]) / f64::from(ENVIRONMENT_EDGE_END);
        share(row) * share(2 * (rows + 1) + 2 * row * (columns + 1) + column)
    }
}

/// Adds the edges of intervals whose lengths are in proportion to the weights, which are positive, and the guides to them. No interval is empty.
fn add_edges(edges: &mut Vec<u32>, weights: &[f64]) {
    let first = edges.len();
    let total: f64 = weights.iter().sum();
    let (mut sum, mut last) = (0.0, 0);
    edges.push(0);
    for (i, weight) in weights.iter().enumerate() {
        sum += weight;
        let edge = (sum / total * f64::from(ENVIRONMENT_EDGE_END)).round() as u32;
        let rest = (weights.len() - 1 - i) as u32;
        last = if rest == 0 { ENVIRONMENT_EDGE_END } else { edge.clamp(last + 1, ENVIRONMENT_EDGE_END - rest) };
        edges.push(last);
    }
    add_guides(edges, first);
}

/// Adds as many numbers as there are edges from number `first` on. Number b is the interval of the least word whose upper 16 bits, times the
/// number of intervals, are at least b · 2¹⁶ (Chen and Asau, On Generating Random Variates from an Empirical Distribution, 1974).
fn add_guides(edges: &mut Vec<u32>, first: usize) {
    let count = edges.len() - first - 1;
    let mut interval = 0;
    for part in 0..count {
        let word = ((part << 16).div_ceil(count) as u32) << 15;
        while edges[first + interval + 1] <= word {
            interval += 1;
        }
        edges.push(interval as u32);
    }
    edges.push(count as u32 - 1);
}

/// The importance map of an environment; a single cell without one.
pub fn importance(environment: Option<&Environment>) -> Importance {
    let Some(env) = environment.filter(|e| !e.pixels.is_empty()) else {
        let mut edges = Vec::new();
        add_edges(&mut edges, &[1.0]);
        add_edges(&mut edges, &[1.0]);
        return Importance { cells: [1, 1], edges };
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
    let mut edges = Vec::with_capacity(2 * (rows + 1 + rows * (columns + 1)));
    add_edges(&mut edges, &weights.chunks_exact(columns).map(|row| row.iter().sum()).collect::<Vec<f64>>());
    for row in weights.chunks_exact(columns) {
        add_edges(&mut edges, row);
    }
    Importance { cells, edges }
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
        assert!((uniform.probability(0, 3) - angle(3)).abs() < 1e-7);
        env.pixels[2 * 16 + 5] = Vec3::new(0.0, 4.0, 0.0);
        let sun = importance(Some(&env));
        let p = |x: usize, y: usize| sun.probability(x, y) - UNIFORM * angle(y as u32);
        // 36 : 6 of the texel and its neighbour, weighted by solid angle.
        assert!((p(5, 2) / p(6, 2) - 6.0).abs() < 1e-3);
        assert!((p(5, 3) / p(5, 2) * angle(2) / angle(3) - 1.0 / 6.0).abs() < 1e-4);
        assert!(p(8, 2).abs() < 1e-9);
        let total: f64 = (0..128).map(|i| sun.probability(i % 16, i / 16)).sum();
        assert!((total - 1.0).abs() < 1e-12);
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
        assert_eq!(map.edges.len(), 2 * (376 + 751 * 375));
    }

    #[test]
    fn guides_lead_to_the_interval_of_each_word() {
        let even = vec![1.0; 1000];
        let steep: Vec<f64> = (0..300).map(|i| 0.9f64.powi(i)).collect();
        let peak: Vec<f64> = (0..777).map(|i| if i == 500 { 1e9 } else { 1.0 }).collect();
        for weights in [&even[..], &even[..1], &even[..3], &steep, &peak] {
            let mut edges = vec![7; 5];
            add_edges(&mut edges, weights);
            let (edges, guides) = edges[5..].split_at(weights.len() + 1);
            let near = edges.iter().flat_map(|&edge| [edge.saturating_sub(1), edge, edge + 1]);
            let spread = (0..5000u32).map(|i| i.wrapping_mul(0x9e37_79b9) >> 1);
            for word in near.chain(spread).filter(|&word| word < ENVIRONMENT_EDGE_END) {
                let interval = edges.partition_point(|&edge| edge <= word) as u32 - 1;
                let part = ((word >> 15) as usize * weights.len()) >> 16;
                assert!(guides[part] <= interval && interval <= guides[part + 1], "{word}: {interval} {part}");
            }
        }
    }
}
