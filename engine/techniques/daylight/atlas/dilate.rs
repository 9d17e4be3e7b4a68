//! The padding around the charts.

use super::raster::Texel;

/// Gives a source for every uncovered texel within `padding` texels of a covered one.
///
/// A pair holds the index of the padding texel and the index of the nearest covered texel; the index of a texel is
/// `y * width + x`. The pairs are sorted by the first index. Between equal distances the smaller source index wins. The
/// reach is a square of `padding` texels in each direction, and the distance is the distance of the texel centres.
pub fn padding_sources(width: u32, height: u32, padding: u32, covered: &[Texel]) -> Vec<(u32, u32)> {
    const FREE: u32 = u32::MAX;
    let index = |x: u32, y: u32| (y * width + x) as usize;
    // A covered texel is its own source.
    let mut source = vec![FREE; width as usize * height as usize];
    for texel in covered {
        source[index(texel.x, texel.y)] = index(texel.x, texel.y) as u32;
    }
    let distance = |x: u32, y: u32, from: u32| {
        let (dx, dy) = (x.abs_diff(from % width), y.abs_diff(from / width));
        u64::from(dx).pow(2) + u64::from(dy).pow(2)
    };
    let mut filled = Vec::new();
    for texel in covered {
        let own = index(texel.x, texel.y) as u32;
        let rows = |reach: u32| texel.y.saturating_sub(reach)..=(texel.y.saturating_add(reach)).min(height - 1);
        let columns = |reach: u32| texel.x.saturating_sub(reach)..=(texel.x.saturating_add(reach)).min(width - 1);
        let is_covered = |x: u32, y: u32| source[index(x, y)] == index(x, y) as u32;
        // Only a texel at the rim of the coverage is the nearest one for any free texel.
        if rows(1).all(|y| columns(1).all(|x| is_covered(x, y))) {
            continue;
        }
        for y in rows(padding) {
            for x in columns(padding) {
                let here = index(x, y);
                let old = source[here];
                if old == here as u32 {
                    continue;
                }
                if old == FREE {
                    filled.push(here as u32);
                    source[here] = own;
                } else if (distance(x, y, own), own) < (distance(x, y, old), old) {
                    source[here] = own;
                }
            }
        }
    }
    filled.sort_unstable();
    filled.into_iter().map(|target| (target, source[target as usize])).collect()
}
