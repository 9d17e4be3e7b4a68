//! The division of the sphere of directions into 145 sky patches and one ground patch.
//!
//! The sky patches are those of P. Tregenza ("Subdivision of the sky hemisphere for luminance measurements", Lighting
//! Research and Technology 19, 1987): seven rows of 12° altitude with 30, 30, 24, 24, 18, 12 and 6 patches, and one cap
//! from 84° to the zenith. The frame is right-handed with +Y up. The azimuth runs clockwise as seen from above, from -Z
//! over +X. The first patch of each row is centred on -Z. Patches are numbered from the lowest row upwards and
//! clockwise in each row, so 0 to 29 is the lowest row and 144 is the cap. Patch 145 is everything below the horizon.
//!
//! # Formula
//! For a unit direction d with d.y ≥ 0, the row r is the number of entries of [`ROW_SINES`] that d.y reaches. The
//! column is ⌊n a / 2π + ½⌋ mod n with n = `ROW_COUNTS[r]` and a = atan2(d.x, -d.z). In GLSL:
//!
//! ```glsl
//! int patch_of(vec3 d) {
//!     if (!(d.y >= 0.0)) return 145;
//!     int row = 0;
//!     while (row < 7 && d.y >= ROW_SINES[row]) row++;
//!     int n = ROW_COUNTS[row];
//!     if (n == 1) return 144;
//!     int column = int(floor(atan(d.x, -d.z) * (float(n) / 6.2831853) + 0.5));
//!     return ROW_STARTS[row] + (column + n) % n;
//! }
//! ```

use std::f64::consts::{FRAC_PI_2, TAU};

/// The number of patches: 145 for the sky and one for the ground.
pub const PATCHES: usize = 146;

/// The index of the patch that holds all directions below the horizon.
pub const GROUND_PATCH: usize = 145;

/// The number of patches in each row, from the horizon to the zenith.
pub const ROW_COUNTS: [usize; 8] = [30, 30, 24, 24, 18, 12, 6, 1];

/// The index of the first patch in each row.
pub const ROW_STARTS: [usize; 8] = [0, 30, 60, 84, 108, 126, 138, 144];

/// The sines of the altitudes 12°, 24°, ..., 84° between the rows.
pub const ROW_SINES: [f32; 7] =
    [0.207_911_69, 0.406_736_64, 0.587_785_25, 0.743_144_8, 0.866_025_4, 0.951_056_54, 0.994_521_9];

/// The index of the patch that a direction of any length belongs to. A direction of length zero, or one that isn't
/// finite, belongs to the ground patch.
pub fn patch_of(direction: [f32; 3]) -> usize {
    let [x, y, z] = direction;
    let y = y / (x * x + y * y + z * z).sqrt();
    if y.is_nan() || y < 0.0 {
        return GROUND_PATCH;
    }
    let row = ROW_SINES.iter().take_while(|&&sine| y >= sine).count();
    let count = ROW_COUNTS[row];
    if count == 1 {
        return ROW_STARTS[row];
    }
    let column = (x.atan2(-z) * (count as f32 / std::f32::consts::TAU) + 0.5).floor() as i32;
    ROW_STARTS[row] + column.rem_euclid(count as i32) as usize
}

/// The solid angle of a patch in steradians. The sum over all patches is 4π.
///
/// # Panics
/// Panics if `patch` is not less than [`PATCHES`].
pub fn patch_solid_angle(patch: usize) -> f64 {
    if patch == GROUND_PATCH {
        return TAU;
    }
    let (row, _) = row_and_column(patch);
    let (low, high) = row_range(row);
    (high.sin() - low.sin()) * TAU / ROW_COUNTS[row] as f64
}

/// The mean of the sine of the altitude over a sky patch, weighted by solid angle.
///
/// # Panics
/// Panics if `patch` is not a sky patch.
pub(super) fn mean_sine(patch: usize) -> f64 {
    let (low, high) = row_range(row_and_column(patch).0);
    0.5 * (low.sin() + high.sin())
}

/// The unit direction at the centre of a patch: the middle of its altitudes and azimuths, the zenith for the cap, and
/// the nadir for the ground.
///
/// # Panics
/// Panics if `patch` is not less than [`PATCHES`].
pub fn patch_direction(patch: usize) -> [f32; 3] {
    if patch == GROUND_PATCH {
        return [0.0, -1.0, 0.0];
    }
    let (row, column) = row_and_column(patch);
    if ROW_COUNTS[row] == 1 {
        return [0.0, 1.0, 0.0];
    }
    let (low, high) = row_range(row);
    let azimuth = column as f64 * TAU / ROW_COUNTS[row] as f64;
    direction((0.5 * (low + high)).sin(), azimuth).map(|value| value as f32)
}

/// The midpoints of a grid of cells of equal solid angle in a sky patch, as unit directions. The grid has `rows` rows of
/// altitude and `columns` columns of azimuth.
///
/// # Panics
/// Panics if `patch` is not a sky patch.
pub fn patch_samples(patch: usize, [rows, columns]: [usize; 2]) -> impl Iterator<Item = [f64; 3]> {
    let (row, column) = row_and_column(patch);
    let (low, high) = row_range(row);
    let (low, high) = (low.sin(), high.sin());
    let width = TAU / ROW_COUNTS[row] as f64;
    let position = |i: usize, cells: usize| (i as f64 + 0.5) / cells as f64;
    (0..rows * columns).map(move |i| {
        let sine = low + (high - low) * position(i / columns, rows);
        direction(sine, (column as f64 - 0.5 + position(i % columns, columns)) * width)
    })
}

/// The row and the column of a sky patch.
fn row_and_column(patch: usize) -> (usize, usize) {
    assert!(patch < GROUND_PATCH, "The patch {patch} isn't a sky patch; sky patches are 0 to 144.");
    let row = ROW_STARTS.iter().take_while(|&&start| patch >= start).count() - 1;
    (row, patch - ROW_STARTS[row])
}

/// The lowest and the highest altitude of a row in radians.
fn row_range(row: usize) -> (f64, f64) {
    let low = (12.0 * row as f64).to_radians();
    (low, if row == 7 { FRAC_PI_2 } else { (12.0 * (row + 1) as f64).to_radians() })
}

/// The unit direction with a sine of the altitude and an azimuth in radians.
fn direction(sine: f64, azimuth: f64) -> [f64; 3] {
    let cosine = (1.0 - sine * sine).max(0.0).sqrt();
    [cosine * azimuth.sin(), sine, -cosine * azimuth.cos()]
}
