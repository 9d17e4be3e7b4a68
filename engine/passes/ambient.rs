//! Diffuse light of a distant environment: its irradiance as a function of the normal.
//!
//! Nine spherical-harmonic coefficients (Ramamoorthi and Hanrahan, "An Efficient Representation for Irradiance Environment Maps",
//! SIGGRAPH 2001) are the usual form. They are within 1 % of the mean; on photographed skies single normals are 8 % too dark to
//! 14 % too bright, and colours shift. So the irradiance itself is stored, at the nodes of a finely divided octahedron, linear between them.

use crate::{
    graph::{Buffer, Graph},
    scene::{Environment, Scene},
    shaders::consts::{AMBIENT_STEPS, AMBIENT_SUNS},
};
use glam::{DVec3, Vec3};
use std::{f64::consts::PI, num::NonZero, sync::Arc};

/// Nodes along a side of the table: both halves of the octahedron, unfolded to a square.
const SIDE: usize = 2 * AMBIENT_STEPS as usize + 1;
/// Columns and rows of the cells into which the environment's light is summed before it is integrated for each node.
const CELLS: [usize; 2] = [128, 64];
/// Vectors in the table for the bright lights.
const SUNS: usize = 3 * AMBIENT_SUNS as usize;
/// Minimum share of the environment's light that makes a cell a bright light.
const BRIGHT: f64 = 0.01;

/// Irradiance in W/m² as a function of the normal. Default: no environment.
///
/// At a node the value is exact except for cells (2.8°) that the node's horizon cuts. Between nodes it is interpolated linearly. The error is
/// at most 0.3 % on five photographed environments, among them a room lit through its windows.
///
/// A cell with a hundredth of all light or more, such as the sun's, would cause a large error near the horizon. The brightest of these cells
/// are stored and summed separately.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Irradiance {
    /// Irradiance (W/m²) at each node, row by row; then for each bright light its direction times its irradiance (W/m²) in red, green and
    /// blue. Empty without an environment.
    table: Arc<[Vec3]>,
}

/// The irradiance of the scene's environment; zero without one.
impl From<&Scene> for Irradiance {
    fn from(scene: &Scene) -> Self {
        scene.environment.as_ref().map(Self::of).unwrap_or_default()
    }
}

impl Irradiance {
    /// The irradiance of a constant radiance L (W/(sr·m²)) from all directions: π·L on every plane.
    pub fn constant(radiance: Vec3) -> Self {
        Self::from_table(vec![std::f32::consts::PI * radiance; SIDE * SIDE], &[])
    }

    /// Integrates all pixels of a latitude-longitude image with its rotation and scale.
    pub fn of(environment: &Environment) -> Self {
        let mut cells = cells(environment);
        let suns = cells.take_suns();
        let mut nodes = vec![Vec3::ZERO; SIDE * SIDE];
        parallel(&mut nodes, SIDE, |row, nodes| {
            for (column, node) in nodes.iter_mut().enumerate() {
                *node = received(&cells, direction(column, row).as_vec3());
            }
        });
        Self::from_table(nodes, &suns)
    }

    fn from_table(mut nodes: Vec<Vec3>, suns: &[[Vec3; 3]]) -> Self {
        nodes.extend(suns.iter().flatten());
        nodes.resize(SIDE * SIDE + SUNS, Vec3::ZERO);
        Self { table: nodes.into() }
    }

    /// Irradiance (W/m²) on a plane with unit normal `n`.
    pub fn at(&self, n: Vec3) -> Vec3 {
        let (steps, a) = (AMBIENT_STEPS as f32, n.abs());
        let sum = a.element_sum();
        let (x, y) = if n.y < 0.0 { (1.0 - a.z / sum, 1.0 - a.x / sum) } else { (a.x / sum, a.z / sum) };
        let base = [x, y].map(|q| (q * steps).floor().clamp(0.0, steps - 1.0));
        let f = [x * steps - base[0], y * steps - base[1]];
        let outer = f[0] + f[1] > 1.0;
        let far = f32::from(u8::from(outer));
        let weights = match outer {
            true => [f[0] + f[1] - 1.0, 1.0 - f[1], 1.0 - f[0]],
            false => [1.0 - f[0] - f[1], f[0], f[1]],
        };
        let offsets = [[far, far], [1.0, 0.0], [0.0, 1.0]];
        let node = |[dx, dy]: [f32; 2]| {
            let place = |q: f32, sign: f32| (steps + q.copysign(if sign < 0.0 { -1.0 } else { 1.0 })) as usize;
            let index = place(base[1] + dy, n.z) * SIDE + place(base[0] + dx, n.x);
            self.table.get(index).copied().unwrap_or_default()
        };
        let smooth: Vec3 = weights.into_iter().zip(offsets).map(|(weight, offset)| weight * node(offset)).sum();
        let suns = self.table.get(SIDE * SIDE..).unwrap_or_default().chunks_exact(3);
        smooth + suns.map(|sun| Vec3::new(n.dot(sun[0]), n.dot(sun[1]), n.dot(sun[2])).max(Vec3::ZERO)).sum::<Vec3>()
    }

    /// The buffer of `lib/ambient.glsl`.
    pub fn upload(&self, graph: &mut Graph) -> Buffer {
        match self.table.is_empty() {
            true => graph.buffer_from("ambient", &vec![[0.0f32; 3]; SIDE * SIDE + SUNS]),
            false => graph.buffer_from("ambient", &self.table),
        }
    }
}

/// Unit normal of a node.
fn direction(column: usize, row: usize) -> DVec3 {
    let q = [column, row].map(|i| i as f64 / f64::from(AMBIENT_STEPS) - 1.0);
    let (a, b) = (q[0].abs(), q[1].abs());
    let y = 1.0 - a - b;
    let (x, z) = if y < 0.0 { (1.0 - b, 1.0 - a) } else { (a, b) };
    DVec3::new(x.copysign(q[0]), y, z.copysign(q[1])).normalize()
}

/// The light of each cell and channel, ∫ L ω dω: its direction times the irradiance (W/m²) on a plane that faces it.
struct Cells {
    /// x, y and z of red, of green, of blue.
    parts: [[Vec<f32>; 3]; 3],
}

impl Cells {
    /// Removes and returns the brightest cells with at least [`BRIGHT`] of all light.
    fn take_suns(&mut self) -> Vec<[Vec3; 3]> {
        let vector = |cells: &Self, i: usize| cells.parts.each_ref().map(|[x, y, z]| Vec3::new(x[i], y[i], z[i]));
        let strength = |i: usize| vector(self, i).iter().map(|v| f64::from(v.length())).sum::<f64>();
        let mut list: Vec<(usize, f64)> = (0..CELLS[0] * CELLS[1]).map(|i| (i, strength(i))).collect();
        let least = BRIGHT * list.iter().map(|(_, strength)| strength).sum::<f64>();
        list.retain(|(_, strength)| *strength > 0.0 && *strength >= least);
        list.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        list.truncate(AMBIENT_SUNS as usize);
        let suns = list.iter().map(|(i, _)| vector(self, *i)).collect();
        for (i, _) in list {
            self.parts.iter_mut().flatten().for_each(|axis| axis[i] = 0.0);
        }
        suns
    }
}

/// Sums the image into cells, exact for piecewise constant pixels. An image that is coarser than the cells is interpolated bilinearly, as
/// shaders read it.
fn cells(environment: &Environment) -> Cells {
    let size = [environment.width.max(1) as usize, environment.height.max(1) as usize];
    let finer = [size[0], size[1]].iter().zip(CELLS).map(|(&have, wanted)| wanted.div_ceil(have)).collect::<Vec<_>>();
    let (width, height) = (size[0] * finer[0], size[1] * finer[1]);
    let radiance = |x: usize, y: usize| match (finer[0], finer[1]) {
        (1, 1) => environment.pixels.get(y * width + x).copied().unwrap_or_default(),
        _ => environment.bilinear(glam::Vec2::new(
            ((x as f64 + 0.5) / width as f64) as f32,
            ((y as f64 + 0.5) / height as f64) as f32,
        )),
    };
    // ∫ sin φ dφ and ∫ cos φ dφ over each column, φ from −Z towards +X; the rotation turns −Z towards −X.
    let azimuth = |x: usize| 2.0 * PI * (x as f64 / width as f64 - 0.5) - f64::from(environment.rotation);
    let columns: Vec<(f64, f64)> = (0..width)
        .map(|x| {
            let (a, b) = (azimuth(x), azimuth(x + 1));
            (a.cos() - b.cos(), b.sin() - a.sin())
        })
        .collect();
    let across = 2.0 * PI / width as f64;
    let mut sums = vec![[DVec3::ZERO; 3]; CELLS[0] * CELLS[1]];
    parallel(&mut sums, CELLS[0], |cell_row, sums| {
        for y in cell_row * height / CELLS[1]..(cell_row + 1) * height / CELLS[1] {
            // ∫ sin² θ dθ and ∫ sin θ cos θ dθ over the row.
            let (a, b) = (PI * y as f64 / height as f64, PI * (y + 1) as f64 / height as f64);
            let flat = 0.5 * (b - a) - 0.25 * ((2.0 * b).sin() - (2.0 * a).sin());
            let up = 0.5 * (b.sin().powi(2) - a.sin().powi(2)) * across;
            for (x, (sine, cosine)) in columns.iter().enumerate() {
                let light = radiance(x, y).as_dvec3();
                let area = DVec3::new(flat * sine, up, -flat * cosine);
                for (sum, light) in sums[x * CELLS[0] / width].iter_mut().zip(light.to_array()) {
                    *sum += light * area;
                }
            }
        }
    });
    let scale = f64::from(environment.scale);
    let part = |channel: usize, axis: usize| sums.iter().map(|sum| (sum[channel][axis] * scale) as f32).collect();
    Cells { parts: [0, 1, 2].map(|channel| [0, 1, 2].map(|axis| part(channel, axis))) }
}

/// Irradiance (W/m²) on a plane with unit normal `n`: the sum over the cells in front of the plane.
fn received(cells: &Cells, n: Vec3) -> Vec3 {
    let channel = |[x, y, z]: &[Vec<f32>; 3]| {
        let rows = x.chunks_exact(CELLS[0]).zip(y.chunks_exact(CELLS[0])).zip(z.chunks_exact(CELLS[0]));
        let row = |((x, y), z): ((&[f32], &[f32]), &[f32])| {
            // Eight partial sums, which compilers keep in one vector register.
            let mut sums = [0.0f32; 8];
            for ((x, y), z) in x.chunks_exact(8).zip(y.chunks_exact(8)).zip(z.chunks_exact(8)) {
                for k in 0..8 {
                    sums[k] += (x[k] * n.x + y[k] * n.y + z[k] * n.z).max(0.0);
                }
            }
            f64::from(sums.iter().sum::<f32>())
        };
        rows.map(row).sum::<f64>() as f32
    };
    Vec3::from_array([0, 1, 2].map(|k| channel(&cells.parts[k])))
}

/// Fills `out` row by row on all cores: `row` gets the number of a row and its `stride` values.
fn parallel<T: Send>(out: &mut [T], stride: usize, row: impl Fn(usize, &mut [T]) + Sync) {
    let cores = std::thread::available_parallelism().map_or(1, NonZero::get).clamp(1, 64);
    let each = (out.len() / stride).div_ceil(cores).max(1);
    std::thread::scope(|scope| {
        for (part, values) in out.chunks_mut(each * stride).enumerate() {
            let row = &row;
            scope.spawn(move || {
                values.chunks_mut(stride).enumerate().for_each(|(i, values)| row(part * each + i, values))
            });
        }
    });
}

#[cfg(test)]
mod tests;
