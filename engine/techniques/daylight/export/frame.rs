//! The irradiance of the texels of a bake at a time, by the processor.

use half::f16;

use super::super::{
    Course, Interpolation, Kind, Sky, Stored, Weather,
    atlas::{self, Texel, padding_sources},
    cube::FACES,
    steps::Steps,
};
use crate::{
    Error, Result,
    image::{Bc6h, encode_bc6h, level_extent},
};

/// The source of a texel that no surface is near.
pub const NOWHERE: u32 = u32::MAX;

/// The light at a time.
#[derive(Clone, Debug)]
pub struct Moment {
    /// Unit vector towards the sun.
    pub direction: [f32; 3],
    /// Irradiance of the sun at normal incidence, W/m².
    pub sun: [f32; 3],
    /// Radiance of each patch of the sky, W/(sr m²).
    pub patches: Vec<[f32; 3]>,
    /// The lit times of the bake around the time, and their weights.
    pub weights: Vec<(usize, f32)>,
    /// How bright each group of lamps burns, 0 to 1; empty: none burns.
    pub lamps: Vec<f32>,
}

impl Moment {
    /// The light of the line between two of the day's `steps`, with lamps that are off. `seconds`: after the begin of the day.
    ///
    /// # Errors
    /// `Usage` if the weather is impossible.
    pub fn new(course: &Course, steps: &Steps, seconds: f64, weather: Weather) -> Result<Self> {
        let shine = course.sun(seconds);
        let sky = Sky::new(weather, shine.direction.map(f64::from)).map_err(Error::usage)?;
        let clear = 1.0 - weather.overcast() as f32;
        let sun = shine.irradiance.map_or(sky.sun_irradiance(), |sun| sun.map(|channel| channel * clear));
        let weights = steps.mixture(seconds, Interpolation::Linear).linear();
        Ok(Self { direction: shine.direction, sun, patches: sky.patches(), weights, lamps: Vec::new() })
    }
}

/// The irradiance of each texel of a bake, W/m², row after row; 0 where no surface is.
pub fn irradiance(stored: &Stored, moment: &Moment) -> Vec<[f32; 3]> {
    let [width, height] = stored.plan.extent;
    let mut out = vec![[0.0; 3]; width as usize * height as usize];
    let of_sun = |(time, weight): &(usize, f32)| (*time, moment.sun.map(|channel| channel * weight));
    for (number, tile) in stored.tiles.iter().enumerate() {
        let sun = tile.sun.mix(moment.weights.iter().map(of_sun));
        let sky = tile.sky.mix(moment.patches.iter().copied().enumerate());
        let lamps = tile.lamps.mix(moment.lamps.iter().map(|share| [*share; 3]).enumerate());
        for (texel, [x, y]) in stored.plan.covered(number as u32, &tile.mask).enumerate() {
            let parts = [tile.sun.decode(texel, &sun), tile.sky.decode(texel, &sky), tile.lamps.decode(texel, &lamps)];
            let sum: [f32; 3] = std::array::from_fn(|channel| parts.iter().map(|part| part[channel]).sum());
            out[(y * width + x) as usize] = sum.map(|value: f32| value.max(0.0));
        }
    }
    out
}

/// For each texel the source of its light: itself on a surface; the nearest texel on a surface in the padding around charts, so that bilinear
/// filtering finds no dark texels; [`NOWHERE`] elsewhere. Numbers are row · width + column. The faces of a cube are padded each by itself.
pub fn sources(stored: &Stored) -> Vec<u32> {
    let [width, height] = stored.plan.extent;
    let side = match stored.plan.receivers {
        Kind::Cube { .. } => (width / FACES).max(1),
        _ => width.max(1),
    };
    let mut parts: Vec<Vec<Texel>> = vec![Vec::new(); width.div_ceil(side) as usize];
    let mut out = vec![NOWHERE; width as usize * height as usize];
    for (number, tile) in stored.tiles.iter().enumerate() {
        for [x, y] in stored.plan.covered(number as u32, &tile.mask) {
            parts[(x / side) as usize].push(Texel { x: x % side, y, ..Texel::default() });
            out[(y * width + x) as usize] = y * width + x;
        }
    }
    let padding = atlas::Settings::default().padding;
    for (part, texels) in (0..).zip(parts) {
        let of_whole = |texel: u32| texel / side * width + part * side + texel % side;
        for (texel, source) in padding_sources(side, height, padding, &texels) {
            out[of_whole(texel) as usize] = of_whole(source);
        }
    }
    out
}

/// The faces of a cube that lie beside one another, each by itself, in the order and with the axes of Vulkan, OpenGL and KTX: +X, -X, +Y, -Y, +Z, -Z
/// as seen from outside. So faces around the horizon are mirrored, those above and below are turned upside down.
pub fn faces(light: &[[f32; 3]], sources: &[u32], side: u32) -> Vec<(Vec<[f32; 3]>, Vec<u32>)> {
    let width = FACES * side;
    let face = |face: u32| {
        let upright = face / 2 != 1;
        let from = |x: u32, y: u32| match upright {
            true => y * width + face * side + side - 1 - x,
            false => (side - 1 - y) * width + face * side + x,
        };
        let texels = (0..side).flat_map(|y| (0..side).map(move |x| [x, y]));
        let there = |[x, y]: [u32; 2]| sources.get(from(x, y) as usize).copied().unwrap_or(NOWHERE);
        let colours = texels.clone().map(|at| light.get(there(at) as usize).copied().unwrap_or_default()).collect();
        // Each texel has its light already; what counts is whether it has any.
        let own = texels.map(|[x, y]| if there([x, y]) == NOWHERE { NOWHERE } else { y * side + x }).collect();
        (colours, own)
    };
    (0..FACES).map(face).collect()
}

/// The light with its padding filled. `width`: of a lightmap. The padding beside the texels of its charts continues the light of the last two of a row or
/// column, nearly as pictures do; all other padding shows the light of its source.
pub fn filled(light: &[[f32; 3]], sources: &[u32], width: Option<u32>) -> Vec<[f32; 3]> {
    let there = |source: u32| light.get(source as usize).copied();
    let shown = |texel: usize, source: &u32| {
        let near = there(*source)?;
        let by = i64::from(*source) - texel as i64;
        // Charts do not reach the borders of a lightmap, so three texels beside each other are in one row.
        let beside = width.is_some_and(|width| {
            by.abs() == i64::from(width) || by.abs() == 1 && source / width == texel as u32 / width
        });
        let far = u32::try_from(i64::from(*source) + by).ok().filter(|far| sources.get(*far as usize) == Some(far));
        let Some(far) = far.filter(|_| beside).and_then(there) else { return Some(near) };
        Some(std::array::from_fn(|i| (2.0 * near[i] - far[i]).clamp(0.5 * near[i], 2.0 * near[i])))
    };
    sources.iter().enumerate().map(|(texel, source)| shown(texel, source).unwrap_or_default()).collect()
}

/// The levels of an image, the largest first.
#[derive(Clone, Debug)]
pub struct Levels {
    pub extent: [u32; 2],
    pub levels: Vec<Vec<[f32; 3]>>,
}

/// All levels of a lightmap. A texel of a level is the mean of the four under it that have light, so charts do not darken at their rims.
/// Charts lie on blocks of 4×4 texels with as much between them: levels 1 and 2 mix no charts, smaller levels do.
pub fn levels(light: &[[f32; 3]], sources: &[u32], extent: [u32; 2]) -> Levels {
    // Texels that have no light count only where no other is.
    let mut level: Vec<[f32; 4]> = filled(light, sources, Some(extent[0]))
        .iter()
        .zip(sources)
        .map(|([r, g, b], source)| [*r, *g, *b, if *source == NOWHERE { 0.0 } else { 1.0 }])
        .collect();
    let mut out = Levels { extent, levels: Vec::new() };
    let mut size = extent;
    loop {
        out.levels.push(level.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect());
        if size == [1, 1] {
            return out;
        }
        let smaller = level_extent(size, 1);
        let mut next = Vec::with_capacity(smaller[0] as usize * smaller[1] as usize);
        for y in 0..smaller[1] {
            for x in 0..smaller[0] {
                let mut sum = [0.0f32; 4];
                for [dx, dy] in [[0, 0], [1, 0], [0, 1], [1, 1]] {
                    let at = [(2 * x + dx).min(size[0] - 1), (2 * y + dy).min(size[1] - 1)];
                    let [r, g, b, there] = level[(at[1] * size[0] + at[0]) as usize];
                    sum = [sum[0] + r * there, sum[1] + g * there, sum[2] + b * there, sum[3] + there];
                }
                let scale = if sum[3] > 0.0 { 1.0 / sum[3] } else { 0.0 };
                next.push([sum[0] * scale, sum[1] * scale, sum[2] * scale, f32::from(u8::from(sum[3] > 0.0))]);
            }
        }
        (level, size) = (next, smaller);
    }
}

impl Levels {
    /// The levels as bytes of 16-bit floats, four for each texel; the fourth is 1. Values too large for them become the largest one.
    pub fn halves(&self) -> Vec<Vec<u8>> {
        let half = |value: f32| f16::from_f32(value.min(f16::MAX.to_f32())).to_le_bytes();
        let texel = |[r, g, b]: &[f32; 3]| [*r, *g, *b, 1.0].map(half).concat();
        self.levels.iter().map(|level| level.iter().flat_map(texel).collect()).collect()
    }

    /// The levels as blocks of BC6H, and the root mean square of the error of the largest one relative to its mean.
    pub fn blocks(&self) -> (Vec<Vec<u8>>, f64) {
        let encoded = self.levels.iter().enumerate();
        let blocks: Vec<Bc6h> =
            encoded.map(|(number, level)| encode_bc6h(level, level_extent(self.extent, number), false)).collect();
        let largest = self.levels[0].as_flattened();
        let mean = largest.iter().map(|value| f64::from(*value)).sum::<f64>() / largest.len() as f64;
        let error = (blocks[0].square / largest.len() as f64).sqrt();
        (blocks.into_iter().map(|level| level.bytes).collect(), if mean > 0.0 { error / mean } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn padding_beside_a_chart_continues_its_light() {
        // Two rows of five texels. Surfaces: the second and third texel of the first row, and the first of the second row.
        let light = [
            [0.0; 3],
            [1.0, 3.0, 2.0],
            [1.5, 1.0, 2.0],
            [0.0; 3],
            [0.0; 3],
            [4.0; 3],
            [0.0; 3],
            [0.0; 3],
            [0.0; 3],
            [0.0; 3],
        ];
        let sources = [1, 1, 2, 2, 2, 5, 1, 2, 2, 5];
        let shown = filled(&light, &sources, Some(5));
        // 2 · 1 - 1.5; 2 · 3 - 1; 2 · 2 - 2, and the other way round 2 · 1.5 - 1; 2 · 1 - 3, but at least half; 2 · 2 - 2.
        assert_eq!([shown[0], shown[3]], [[0.5, 5.0, 2.0], [2.0, 0.5, 2.0]]);
        // Two texels away, with one texel on a surface only, in a diagonal, and at the end of the row before.
        assert_eq!([shown[4], shown[6], shown[8], shown[9]], [light[2], light[1], light[2], light[5]]);
        assert_eq!(shown[1..3], light[1..3]);
        assert_eq!(filled(&light, &sources, None)[0], light[1]);
    }

    #[test]
    fn levels_are_means_of_the_texels_with_light() {
        // Two texels of one surface in a corner, the rest nowhere.
        let (extent, own) = ([8, 4], [0u32, 1]);
        let mut light = vec![[0.0; 3]; 32];
        let mut sources = vec![NOWHERE; 32];
        for texel in own {
            light[texel as usize] = [2.0 + 2.0 * texel as f32, 1.0, 0.5];
            sources[texel as usize] = texel;
        }
        sources[8] = 1;
        let all = levels(&light, &sources, extent);
        assert_eq!(all.levels.iter().map(Vec::len).collect::<Vec<_>>(), [32, 8, 2, 1]);
        assert_eq!(all.levels[0][8], [4.0, 1.0, 0.5]);
        for level in &all.levels[1..] {
            assert!((level[0][0] - 10.0 / 3.0).abs() < 1e-6 && level[0][1] == 1.0, "{:?}", level[0]);
        }
        let bytes = all.halves();
        assert_eq!(bytes[3].len(), 8);
        assert_eq!(f16::from_le_bytes([bytes[3][6], bytes[3][7]]), f16::ONE);
    }
}
