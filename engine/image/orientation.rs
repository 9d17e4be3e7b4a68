//! How a photograph was held: the EXIF orientation of JPEG and PNG files.

use image::metadata::Orientation;

use super::{check_size, zeroed};
use crate::{Result, limits::Limits};

/// Pixels of `channels` values as they are stored become those of the upright picture, with its width and height.
///
/// EXIF 2.32, tag 0112 says which sides of the upright picture the first row and the first column are.
pub(super) fn upright(
    stored: Vec<f32>,
    [width, height]: [u32; 2],
    channels: usize,
    orientation: Orientation,
    limits: &Limits,
) -> Result<(Vec<f32>, [u32; 2])> {
    let code = orientation.to_exif();
    if code == 1 {
        return Ok((stored, [width, height]));
    }
    // Beside the stored pixels.
    check_size(width.into(), height.into(), 8 * channels as u64, limits)?;
    // From 5 on rows are upright columns.
    let size = if code >= 5 { [height, width] } else { [width, height] };
    let from_right = matches!(code, 2 | 3 | 6 | 7);
    let from_below = matches!(code, 3 | 4 | 7 | 8);
    let mut out = zeroed(stored.len())?;
    let [across, down] = size.map(|s| s as usize);
    for (i, pixel) in stored.chunks_exact(channels).enumerate() {
        let (column, row) = (i % width as usize, i / width as usize);
        let (x, y) = if code >= 5 { (row, column) } else { (column, row) };
        let x = if from_right { across - 1 - x } else { x };
        let y = if from_below { down - 1 - y } else { y };
        out[(y * across + x) * channels..][..channels].copy_from_slice(pixel);
    }
    Ok((out, size))
}
