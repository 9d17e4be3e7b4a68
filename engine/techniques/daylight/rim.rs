//! The light at the centres of a lightmap's texels. The centre of a texel at the rim of a chart may be outside of the chart: its light is gathered at
//! the nearest point of the chart. Pictures interpolate between centres, so the light there is extrapolated. Else the light would be up to half of
//! a texel's change off at seams.

use super::listed::{Listed, dot};

/// Columns and rows around a texel whose light says how the light changes. The next chart is farther away.
pub const REACH: i64 = 2;
/// Added to the squares of distances, so that the change across a chart that is as narrow as a texel is 0.
const NARROW: f32 = 0.05;
/// Least cosine between the normals of two texels whose light is compared.
const LEAST_COSINE: f32 = 0.5;

/// The light at the centre of a texel as weights of texels around it, by the plane through its own light that is the nearest to theirs. None: its
/// light was gathered at the centre.
pub fn at_centre(listed: &Listed, of: u32) -> Option<Vec<(u32, f32)>> {
    let texel = &listed.texels[of as usize];
    let [x, y] = texel.offset;
    if [x, y] == [0.0; 2] {
        return None;
    }
    let mut around = Vec::new();
    let [mut xx, mut xy, mut yy] = [NARROW, 0.0, NARROW];
    for way in (-REACH..=REACH).flat_map(|row| (-REACH..=REACH).map(move |column| [column, row])) {
        let Some(other) = listed.beside(texel, way).filter(|other| *other != of) else { continue };
        let q = &listed.texels[other as usize];
        let cosine = dot(q.normal, texel.normal);
        // A degenerate triangle has no normal.
        if cosine.is_nan() || cosine < LEAST_COSINE {
            continue;
        }
        let [dx, dy] = [way[0] as f32 + q.offset[0] - x, way[1] as f32 + q.offset[1] - y];
        let weight = (-0.5 * (dx * dx + dy * dy)).exp();
        (xx, xy, yy) = (xx + weight * dx * dx, xy + weight * dx * dy, yy + weight * dy * dy);
        around.push((other, [dx, dy], weight));
    }
    let determinant = xx * yy - xy * xy;
    let change = [(xy * y - yy * x) / determinant, (xy * x - xx * y) / determinant];
    let mut out: Vec<(u32, f32)> = around
        .into_iter()
        .map(|(other, [dx, dy], weight)| (other, weight * (change[0] * dx + change[1] * dy)))
        .collect();
    // In a chart as narrow as a texel, the light would be extrapolated much farther than it is known, with its noise.
    let extent: f32 = out.iter().map(|(_, weight)| weight.abs()).sum();
    out.iter_mut().for_each(|(_, weight)| *weight /= extent.max(1.0));
    let others: f32 = out.iter().map(|(_, weight)| weight).sum();
    out.push((of, 1.0 - others));
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::techniques::daylight::listed::Texel;

    /// Texels of a chart that covers `from` to `to` in texels, their surface a plane with texels of 1 m.
    fn chart(from: [f32; 2], to: [f32; 2]) -> Listed {
        let mut texels = Vec::new();
        for row in from[1] as u32..to[1].ceil() as u32 {
            for column in from[0] as u32..to[0].ceil() as u32 {
                let centre = [column as f32 + 0.5, row as f32 + 0.5];
                let at = [0, 1].map(|i| centre[i].clamp(from[i], to[i]));
                let offset = [at[0] - centre[0], at[1] - centre[1]];
                texels.push((([column, row], [at[0], at[1], 0.0]), offset));
            }
        }
        let texel = |((place, position), offset)| Texel::at(place, position, [0.0, 0.0, 1.0], offset);
        Listed::of(texels.into_iter().map(texel).collect(), [16, 16])
    }

    #[test]
    fn light_that_changes_evenly_has_its_value_at_the_centres() {
        let listed = chart([3.7, 4.3], [9.2, 8.4]);
        let mut moved = 0;
        for (of, texel) in (0..).zip(&listed.texels) {
            let light = |[x, y, _]: [f32; 3]| 2.0 + 0.1 * x - 0.05 * y;
            let Some(weights) = at_centre(&listed, of) else { continue };
            let found: f32 = weights.iter().map(|(q, w)| w * light(listed.texels[*q as usize].position)).sum();
            let [x, y, z] = texel.position;
            let wanted = light([x - texel.offset[0], y - texel.offset[1], z]);
            let extent: f32 = weights.iter().map(|(_, weight)| weight.abs()).sum();
            assert!((found - wanted).abs() < 0.003 && extent <= 3.0, "{texel:?}: {found}, {wanted}, {extent}");
            moved += 1;
        }
        // Rows 4 to 8 and columns 3 to 9; the centres of columns 3 and 9 and of row 8 are outside.
        assert_eq!((listed.texels.len(), moved), (35, 15));
    }

    #[test]
    fn charts_as_narrow_as_a_texel_take_at_most_as_much_from_others_as_their_own() {
        for (from, to) in [([3.4, 3.4], [3.45, 3.45]), ([3.98, 3.0], [5.02, 9.0]), ([3.1, 3.1], [3.2, 9.0])] {
            let listed = chart(from, to);
            for of in 0..listed.texels.len() as u32 {
                let weights = at_centre(&listed, of).unwrap_or_else(|| vec![(of, 1.0)]);
                let others: f32 = weights.iter().filter(|(q, _)| *q != of).map(|(_, weight)| weight.abs()).sum();
                let sum: f32 = weights.iter().map(|(_, weight)| weight).sum();
                assert!(others <= 1.0001 && (sum - 1.0).abs() < 1e-4, "{from:?} to {to:?}: {weights:?}");
            }
        }
    }
}
