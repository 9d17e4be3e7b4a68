//! Texels of a lightmap that are buried: those of a floor under a column that stands in it, of a wall where a stone of an arch lies on it, or of the part
//! of a wall that is in another wall. Their centres are dark, and their black would darken the pixels beside them. A part of such a texel may be in
//! view, so its light is gathered at another of its places ([`lightmap::TileTexels::places`](super::lightmap::TileTexels)). A texel without such a
//! place has no light in the bake.

use super::{Baking, Light, Plan, Sources, Transport};
use crate::{Result, shaders::types};

/// Paths that say whether a place is buried, at least.
const LEAST: u32 = 16;
/// Sixteenths of the paths of a buried place that begin inside of a solid or under an object, at least. A place beside a wall has some such paths, and on
/// the outside of an open shell nearly half of them may hit its inside.
const SIXTEENTHS: u64 = 15;
/// A texel moves to its nearest place if at most so many of [`LEAST`] paths are shut in there, else to the place with the fewest.
const FEW: u32 = 8;

/// The paths of a place whose first surface shuts it in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub(super) struct Shut {
    /// Paths that first meet the back of a one-sided surface, or a surface that touches the place.
    pub(super) surely: u32,
    /// The same, and paths that first meet the back of a two-sided surface.
    pub(super) perhaps: u32,
}

impl Shut {
    /// Whether the place is buried. Solids whose surfaces have two sides cannot be told from sheets, as curtains are; a place that sees only backs of
    /// such surfaces is buried if it is `dark` at all times.
    pub(super) fn is_buried(self, samples: u32, dark: bool) -> bool {
        let paths = if dark { self.perhaps } else { self.surely };
        samples >= LEAST && 16 * u64::from(paths) >= SIXTEENTHS * u64::from(samples)
    }
}

impl Transport {
    /// The light of a tile of a lightmap. `mask`: of the tile, without bits.
    pub(super) fn lightmap_tile(&mut self, plan: &Plan, tile: u32, mask: Vec<u32>) -> Result<Light> {
        let Sources::Lightmap(all) = &self.sources else { return Ok(Light { mask, ..Light::default() }) };
        let of_tile = all.tiles.get(tile as usize).map_or(&[][..], Vec::as_slice);
        let offsets: Vec<[f32; 2]> = of_tile.iter().map(|receiver| receiver.offset).collect();
        let (texels, hits): (Vec<u32>, Vec<types::Hit>) =
            of_tile.iter().map(|receiver| (receiver.texel, receiver.hit)).unzip();
        let first = plan.first_receiver(tile);
        let samples = plan.settings.samples;
        let count = hits.len();
        let (mut light, shut) = self.gather(plan, first, &hits)?;
        light.spots.iter_mut().zip(offsets).for_each(|(spot, offset)| spot.offset = offset);
        let mut buried: Vec<bool> =
            (0..count).map(|texel| shut[texel].is_buried(samples, light.is_dark(texel, count))).collect();
        let moved: Vec<usize> = (0..count).filter(|texel| buried[*texel]).collect();
        let wanted = moved.iter().map(|texel| (texels[*texel], !shut[*texel].is_buried(samples, false))).collect();
        let places = self.clear_places(plan, tile, wanted)?;
        let (moved, hits): (Vec<usize>, Vec<types::Hit>) =
            moved.into_iter().zip(places).filter_map(|(texel, place)| Some((texel, place?))).unzip();
        // Their paths are none of those of the texels of a tile.
        let (there, shut) = self.gather(plan, plan.first_receiver(plan.tile_count() + tile), &hits)?;
        let clear = |number: &usize| !shut[*number].is_buried(samples, there.is_dark(*number, hits.len()));
        let taken: Vec<(usize, usize)> = (0..hits.len()).filter(clear).map(|number| (moved[number], number)).collect();
        taken.iter().for_each(|(texel, _)| buried[*texel] = false);
        light.take(count, there, hits.len(), &taken);
        Ok(light.without_buried(&buried, &texels, mask))
    }

    /// For each of some texels of a tile a place that is not buried, if one is. `texels`: their numbers in the tile, and whether backs of two-sided
    /// surfaces bury them.
    fn clear_places(&mut self, plan: &Plan, tile: u32, texels: Vec<(u32, bool)>) -> Result<Vec<Option<types::Hit>>> {
        if texels.is_empty() {
            return Ok(Vec::new());
        }
        let Sources::Lightmap(all) = &self.sources else { return Ok(Vec::new()) };
        let places: Vec<Vec<types::Hit>> = texels.iter().map(|(texel, _)| all.places(tile, *texel)).collect();
        let most = all.tiles.get(tile as usize).map_or(1, Vec::len).max(1);
        let hits: Vec<types::Hit> = places.iter().flatten().copied().collect();
        let settings = Baking { samples: LEAST, bounces: 1, sun_masks: 0.0, ..plan.settings.clone() };
        let plan = Plan { settings, times: Vec::new(), lamps: Vec::new(), ..plan.clone() };
        let mut shut = Vec::with_capacity(hits.len());
        for part in hits.chunks(most) {
            shut.extend(self.gather(&plan, plan.first_receiver(tile), part)?.1);
        }
        let mut first = 0;
        let clear = places.into_iter().zip(texels).map(|(places, (_, two_sided))| {
            let of = &shut[first..first + places.len()];
            first += places.len();
            let open = |place: &usize| !of[*place].is_buried(LEAST, two_sided);
            let near = (0..places.len()).find(|place| of[*place].perhaps <= FEW);
            let best = || (0..places.len()).filter(open).min_by_key(|place| (of[*place].perhaps, of[*place].surely));
            near.or_else(best).map(|place| places[place])
        });
        Ok(clear.collect())
    }
}

impl Light {
    /// All rows of light and of noise.
    fn rows(&mut self) -> [&mut Vec<f32>; 6] {
        [&mut self.sun, &mut self.noise, &mut self.sky, &mut self.sky_noise, &mut self.lamps, &mut self.lamps_noise]
    }

    /// Whether no light reaches a texel of `count` at any time.
    pub(super) fn is_dark(&self, texel: usize, count: usize) -> bool {
        [&self.sun, &self.sky, &self.lamps].into_iter().all(|rows| {
            let row = rows.len() / count.max(1);
            rows[texel * row..(texel + 1) * row].iter().all(|value| *value == 0.0)
        })
    }

    /// Takes the light of some texels from other light. `count` and `other_count`: of texels; `taken`: numbers of texels here and there.
    fn take(&mut self, count: usize, mut other: Self, other_count: usize, taken: &[(usize, usize)]) {
        for (to, from) in self.rows().into_iter().zip(other.rows()) {
            let row = to.len() / count.max(1);
            debug_assert_eq!(row * other_count, from.len());
            for (texel, number) in taken {
                to[texel * row..(texel + 1) * row].copy_from_slice(&from[number * row..(number + 1) * row]);
            }
        }
        for (texel, number) in taken {
            self.spots[*texel] = other.spots[*number];
        }
    }

    /// The light without the texels that are `buried`. `texels`: the number of each texel in its tile; `mask`: of the tile, without bits.
    fn without_buried(mut self, buried: &[bool], texels: &[u32], mut mask: Vec<u32>) -> Self {
        for (texel, _) in texels.iter().zip(buried).filter(|(_, buried)| !**buried) {
            mask[*texel as usize / 32] |= 1 << (texel % 32);
        }
        for rows in self.rows() {
            let of_texel = rows.len() / buried.len().max(1);
            let kept = rows.chunks(of_texel.max(1)).zip(buried).filter(|(_, buried)| !**buried);
            *rows = kept.flat_map(|(row, _)| row.iter().copied()).collect();
        }
        let mut buried = buried.iter();
        self.spots.retain(|_| !buried.next().copied().unwrap_or(false));
        Self { mask, ..self }
    }
}
