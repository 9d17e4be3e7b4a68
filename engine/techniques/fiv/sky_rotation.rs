//! An environment that rotates: its cube map for any rotation without a pass over all pixels.
//!
//! A rotation shifts the columns of a latitude-longitude image and keeps its rows. The texels of the cube map are
//! therefore cut once into wedges of azimuth. Each column has prefix sums of radiance from the top down. The light of a
//! wedge between two latitudes is then a difference of two prefix sums in each of the few columns that overlap the
//! wedge. Environments that do not rotate are resampled pixel by pixel, as by [`Sky::new`].
//!
//! The difference of two prefix sums has the rounding errors of both. With 1024 rows and a pixel of 10¹⁴ times the
//! radiance of the texels below this pixel, these texels are off by half a percent in a cube map of 32 texels to a
//! side. At 10¹⁵ the error is a sixth. From 10¹⁶ on the texels are noise. The mean irradiance stays correct, but
//! shadows of such a pixel do not.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::sky::{self, Sky, Sums};
use crate::{Result, scene::Environment};

/// Largest numbers of columns and rows. Finer images are averaged to these sizes. A column is a sixteenth of a texel's
/// edge with 32 texels to a side.
const COLUMNS: usize = 2048;
const ROWS: usize = 1024;

/// Cube maps of an environment for all rotations.
#[derive(Debug)]
pub struct RotatingSky {
    size: u32,
    /// The result of the pixel-by-pixel method for its last rotation (radians).
    exact: Option<(f32, Sums)>,
    turned: Option<Table>,
    /// The result of the table for its last rotation (radians).
    last: Option<(f32, Sums)>,
}

impl RotatingSky {
    /// Creates an empty cache. `size`: texels along an edge of the cube.
    pub fn new(size: u32) -> Self {
        Self { size, exact: None, turned: None, last: None }
    }

    /// Clears the cache, because the next environment may be different.
    pub fn forget(&mut self) {
        *self = Self::new(self.size);
    }

    /// The cube map of the environment with the rotation `rotation` (radians) and the scale `scale` instead of its own.
    /// `still`: use the slow pixel-by-pixel method. The result does not depend on earlier calls. `environment` must be
    /// the same in all calls since [`RotatingSky::forget`].
    ///
    /// # Errors
    /// As [`Sky::new`].
    pub fn sky(&mut self, environment: &Environment, (rotation, scale): (f32, f32), still: bool) -> Result<Sky> {
        sky::usable(environment, rotation, scale)?;
        let kept = if still { &mut self.exact } else { &mut self.last };
        let sums = match kept.take().filter(|(of, _)| *of == rotation) {
            Some((_, sums)) => sums,
            None if still => Sums::of(Some(environment), rotation, self.size)?,
            None => {
                let table = self.turned.get_or_insert_with(|| Table::of(environment, self.size));
                table.sums(f64::from(rotation))
            }
        };
        let sky = sums.sky(scale);
        *kept = Some((rotation, sums));
        Ok(sky)
    }
}

/// Wedges of the cube map and prefix sums of the image.
#[derive(Debug)]
struct Table {
    size: u32,
    repaired: u64,
    rows: usize,
    /// Azimuths at which columns begin and the last column ends, as parts of a full turn.
    edges: Vec<f64>,
    /// Prefix sums for each column at each edge of its rows: radiance × differences of the sine of the latitude, from
    /// the top down.
    above: Vec<DVec3>,
    wedges: Vec<Wedge>,
    /// Solid angle of each texel as the sum over the wedges, sr.
    angles: Vec<f64>,
}

/// The part of the sphere between two azimuths, radians.
#[derive(Debug)]
struct Wedge {
    begin: f64,
    end: f64,
    /// Intersections with texels from the top down.
    runs: Vec<Run>,
}

/// The intersection of a wedge with a texel.
#[derive(Clone, Copy, Debug)]
struct Run {
    texel: u32,
    /// Row of the image at the lower end of the intersection.
    row: u32,
    /// Fraction of this row above the lower end.
    part: f64,
}

impl Table {
    fn of(env: &Environment, size: u32) -> Self {
        let (width, height) = (env.width as usize, env.height as usize);
        let (columns, rows) = (width.min(COLUMNS), height.min(ROWS));
        let sine = |row: usize| if row == height { -1.0 } else { (PI * row as f64 / height as f64).cos() };
        let mut repaired = 0;
        let mut above = vec![DVec3::ZERO; columns * (rows + 1)];
        let first = |column: usize| column * width / columns;
        for (column, above) in above.chunks_exact_mut(rows + 1).enumerate() {
            let share = 1.0 / (first(column + 1) - first(column)) as f64;
            let mut sum = DVec3::ZERO;
            for row in 0..rows {
                for from in row * height / rows..(row + 1) * height / rows {
                    let mut light = DVec3::ZERO;
                    for pixel in &env.pixels[from * width + first(column)..from * width + first(column + 1)] {
                        let (radiance, odd) = sky::clean(*pixel);
                        light += radiance;
                        repaired += u64::from(odd);
                    }
                    sum += light * (share * (sine(from) - sine(from + 1)));
                }
                above[row + 1] = sum;
            }
        }
        let sines: Vec<f64> = (0..=rows).map(|row| sine(row * height / rows)).collect();
        let mut angles = vec![0.0; 6 * size as usize * size as usize];
        // The wedges are as narrow as the columns.
        let wedges = sky::wedges(COLUMNS as u32, 0.0, size)
            .into_iter()
            .map(|(begin, end)| Wedge { begin, end, runs: runs(&sines, size, (begin, end), &mut angles) })
            .collect();
        let edges = (0..=columns).map(|column| first(column) as f64 / width as f64).collect();
        Self { size, repaired, rows, edges, above, wedges, angles }
    }

    /// The sums of all texels for a rotation by `rotation` radians.
    fn sums(&self, rotation: f64) -> Sums {
        let mut light = vec![DVec3::ZERO; self.angles.len()];
        let mut shares = Vec::new();
        for wedge in &self.wedges {
            self.columns(wedge, rotation, &mut shares);
            let mut before = DVec3::ZERO;
            for run in &wedge.runs {
                let mut now = DVec3::ZERO;
                for (first, share) in &shares {
                    let [from, to] = [0, 1].map(|next| self.above[first + run.row as usize + next]);
                    now += (from + (to - from) * run.part) * *share;
                }
                // Both prefix sums are equal in black parts. Rounding must not make negative light there.
                light[run.texel as usize] += (now - before).max(DVec3::ZERO);
                before = now;
            }
        }
        let texels = light.into_iter().zip(self.angles.iter().copied()).collect();
        Sums { size: self.size, texels, repaired: self.repaired }
    }

    /// For each column that overlaps a wedge: the start of the column in `above`, and the width of the overlap,
    /// radians.
    fn columns(&self, wedge: &Wedge, rotation: f64, shares: &mut Vec<(usize, f64)>) {
        shares.clear();
        let count = self.edges.len() - 1;
        let mut at = ((wedge.begin + rotation) / TAU + 0.5).rem_euclid(1.0);
        let mut left = (wedge.end - wedge.begin) / TAU;
        let mut column = self.edges.partition_point(|edge| *edge <= at).clamp(1, count) - 1;
        while left > 0.0 {
            let here = left.min((self.edges[column + 1] - at).max(0.0));
            if here > 0.0 {
                shares.push((column * (self.rows + 1), here * TAU));
            }
            left -= here;
            column = (column + 1) % count;
            at = self.edges[column];
            // A wedge is never wider than a full turn.
            if shares.len() > count {
                break;
            }
        }
    }
}

/// The texels along the meridian in the middle of a wedge. Adds the solid angle of each intersection to `angles`.
fn runs(sines: &[f64], size: u32, (begin, end): (f64, f64), angles: &mut [f64]) -> Vec<Run> {
    let middle = 0.5 * (begin + end);
    let (x, z) = (middle.sin(), -middle.cos());
    let mut cuts = sky::rows(x, z, size);
    cuts.extend([1.0, -1.0]);
    cuts.sort_by(|a, b| b.total_cmp(a));
    let last = sines.len() - 2;
    let mut out: Vec<Run> = Vec::new();
    for pair in cuts.windows(2).filter(|p| p[0] > p[1]) {
        let sine = 0.5 * (pair[0] + pair[1]);
        let cosine = (1.0 - sine * sine).max(0.0).sqrt();
        let texel = sky::texel(size, DVec3::new(x * cosine, sine, z * cosine));
        angles[texel as usize] += (end - begin) * (pair[0] - pair[1]);
        let row = sines.partition_point(|edge| *edge >= pair[1]).clamp(1, last + 1) - 1;
        let part = ((sines[row] - pair[1]) / (sines[row] - sines[row + 1])).clamp(0.0, 1.0);
        let run = Run { texel, row: row as u32, part };
        match out.last_mut() {
            Some(same) if same.texel == texel => *same = run,
            _ => out.push(run),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::builtin;

    /// Mean difference of two cube maps relative to the mean of the first.
    fn apart(a: &Sky, b: &Sky) -> f32 {
        let mean = a.radiance.iter().copied().sum::<Vec3>().element_sum() / a.radiance.len() as f32;
        let off = a.radiance.iter().zip(&b.radiance).map(|(a, b)| (*a - *b).abs().element_sum());
        off.sum::<f32>() / a.radiance.len() as f32 / mean.max(1e-30)
    }

    fn exact(env: &Environment, rotation: f32, size: u32) -> Sky {
        Sky::new(Some(&Environment { rotation, ..env.clone() }), size).unwrap()
    }

    #[test]
    fn at_rest_it_is_the_sky_to_the_last_bit_and_turned_nearly() {
        for (name, size) in [("grove", 32), ("areas", 16), ("point", 8)] {
            let env = Environment { rotation: 0.3, scale: 0.7, ..builtin::environment(name).unwrap() };
            let mut rotating = RotatingSky::new(size);
            let first = rotating.sky(&env, (env.rotation, env.scale), true).unwrap();
            assert!(first == Sky::new(Some(&env), size).unwrap());
            for rotation in [0.0, 0.301, 2.0, -3.0, 9.5] {
                let (witness, found) =
                    (exact(&env, rotation, size), rotating.sky(&env, (rotation, env.scale), false).unwrap());
                let off = apart(&witness, &found);
                eprintln!("{name} at {rotation}: {off:.2e} apart, from the first {:.2e}", apart(&first, &found));
                // The wedges of the witness are up to twice as wide, so light near the edges of texels may fall into a
                // neighbouring texel.
                assert!(off < 2e-2, "{name} {rotation}: {off}");
                for normal in [DVec3::Y, DVec3::X, DVec3::new(0.6, 0.64, -0.48)] {
                    let [a, b] = [&witness, &found].map(|sky| crate::reference::fiv::irradiance(sky, normal));
                    assert!((a - b).length() < 2e-3 * a.length() + 1e-6, "{name} {rotation}: {a} {b}");
                }
                // Black parts stay black for every rotation.
                assert!(found.radiance.iter().all(|r| r.min_element() >= 0.0));
                let lit = |sky: &Sky| sky.lit().len() as f32;
                assert!(lit(&found) <= 1.1 * lit(&witness) + 8.0, "{name}: {} {}", lit(&found), lit(&witness));
            }
            assert!(rotating.sky(&env, (env.rotation, env.scale), true).unwrap() == first);
            assert!(rotating.sky(&env, (2.0, env.scale), true).unwrap() == exact(&env, 2.0, size));
        }
    }

    #[test]
    fn a_turn_does_not_depend_on_those_before_and_a_factor_is_one() {
        let env = builtin::environment("grove").unwrap();
        let [mut long, mut short] = [0, 1].map(|_| RotatingSky::new(16));
        for rotation in [0.1, 0.0, 4.0] {
            long.sky(&env, (rotation, 2.0), rotation == 0.0).unwrap();
        }
        let sky = short.sky(&env, (1.5, 1.0), false).unwrap();
        assert!(long.sky(&env, (1.5, 1.0), false).unwrap() == sky);
        let twice = short.sky(&env, (1.5, 2.0), false).unwrap();
        assert!(sky.radiance.iter().zip(&twice.radiance).all(|(a, b)| *a * 2.0 == *b));
        assert_eq!(short.sky(&env, (f32::NAN, 1.0), false).unwrap_err().exit_code(), 3);
    }

    #[test]
    fn pictures_of_all_sizes_keep_their_power_and_count_what_is_repaired() {
        for (width, height) in [(1, 1), (2, 1), (7, 5), (3000, 1500), (2049, 1025)] {
            let mut pixels = vec![Vec3::new(1.0, 0.5, 2.0); width * height];
            if width > 2 {
                pixels[width + 1] = Vec3::new(f32::NAN, 0.5, 2.0);
            }
            let (width, height) = (width as u32, height as u32);
            let env = Environment { width, height, pixels, ..Environment::constant(Vec3::ONE) };
            let mut rotating = RotatingSky::new(16);
            let sky = rotating.sky(&env, (1.0, 1.0), false).unwrap();
            assert_eq!(sky.repaired, u64::from(width > 2));
            let even = |r: &Vec3| (r.y - 0.5).abs() < 1e-6 && (r.z - 2.0).abs() < 1e-6;
            assert!(sky.radiance.iter().all(even), "{width}x{height}: {:?}", sky.radiance.iter().find(|r| !even(r)));
            assert!(apart(&exact(&env, 1.0, 16), &sky) < 1e-3);
        }
    }
}
