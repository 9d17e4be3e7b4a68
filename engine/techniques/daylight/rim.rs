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
    let others: f32 = out.iter().map(|(_, weight)| weight).sum();
    out.push((of, 1.0 - others));
    Some(out)
}
