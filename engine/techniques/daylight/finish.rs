//! From the gathered light of all tiles to the tiles of a file: filter, light at the centres of texels, and compression.

use std::{
    collections::{BTreeMap, HashMap},
    thread,
};

use super::{
    Plan, Texels,
    blocks::Layout,
    columns::Measured,
    filter::Filter,
    gathered::Gathered,
    listed::Listed,
    rim,
    units::{self, Tile},
};
use crate::{Error, ErrorKind, Result};

/// Memory of all threads together at most, about.
const MOST_BYTES: u64 = 4 << 30;

/// Finishes all tiles. `told` hears the number of finished tiles, and an error of it ends the work. Tiles do not depend on the number of threads.
///
/// # Errors
/// As [`units::layer`]; the errors of `told`.
pub fn tiles(plan: &Plan, gathered: &[Gathered], mut told: impl FnMut(usize) -> Result<()>) -> Result<Vec<Tile>> {
    let skies = units::skies(plan)?;
    let radius = plan.settings.filter;
    let spots = || gathered.iter().flat_map(|tile| &tile.spots);
    let listed = (radius > 0 && spots().next().is_some() || spots().any(|spot| spot.offset != [0.0; 2]))
        .then(|| Listed::new(plan, gathered));
    let filter = listed.as_ref().filter(|_| radius > 0).map(|listed| Filter::new(plan, gathered, listed, radius));
    let mixing = listed.as_ref().map(|listed| Mixing { listed, filter: filter.as_ref() });
    let mixing = mixing.as_ref();
    let mut out = Vec::with_capacity(gathered.len());
    let threads = thread::available_parallelism().map_or(1, usize::from).min(16);
    // Both halves of the texels around a tile, and their means: numbers of 32 bits.
    let side = u64::from(plan.side() + 2 * (radius + rim::REACH as u32));
    let dimensions = plan.dimensions().into_iter().max().unwrap_or(1) as u64;
    // The neighbours of a texel lie in a disc.
    let neighbours = u64::from(3 * (radius + 2) * (radius + 2)) * size_of::<Neighbour>() as u64;
    let threads =
        threads.min((MOST_BYTES / (side * side * (dimensions * 3 * 4 * 4 + neighbours)).max(1)).max(1) as usize);
    for first in (0..gathered.len()).step_by(threads) {
        let last = (first + threads).min(gathered.len());
        let done: Vec<Result<Tile>> = thread::scope(|scope| {
            let skies = &skies;
            let handles: Vec<_> =
                (first..last).map(|index| scope.spawn(move || tile(plan, gathered, mixing, index, skies))).collect();
            let lost = || Err(Error::new(ErrorKind::Runtime, "a thread that compresses a tile ended early"));
            handles.into_iter().map(|handle| handle.join().unwrap_or_else(|_| lost())).collect()
        });
        for tile in done {
            out.push(tile?);
        }
        told(out.len())?;
    }
    Ok(out)
}

/// One tile.
fn tile(plan: &Plan, gathered: &[Gathered], mixing: Option<&Mixing<'_>>, index: usize, skies: &[f32]) -> Result<Tile> {
    let dimensions = plan.dimensions();
    let columns = units::kinds(skies);
    let lit = &gathered[index];
    let [_, _, width, height] = plan.tile(index as u32);
    let layout = (plan.settings.format != Texels::Plain).then(|| Layout::new(&lit.mask, [width, height]));
    let mut layers = Vec::new();
    let near = mixing.map(|mixing| (mixing.listed, mixing.of_tile(index)));
    let mut errors = Vec::new();
    for (which, columns) in columns.into_iter().enumerate() {
        let row = 3 * dimensions[which];
        let [mut mean, mut noise] = [(); 2].map(|()| vec![0.0f32; row * lit.spots.len()]);
        match &near {
            None => {
                for (texel, (mean, noise)) in
                    mean.chunks_exact_mut(row.max(1)).zip(noise.chunks_exact_mut(row.max(1))).enumerate()
                {
                    lit.layers[which].restore(texel, mean, noise);
                }
            }
            Some((listed, near)) => mix(gathered, listed, near, (which, row), [&mut mean, &mut noise]),
        }
        let exact = !plan.settings.noise_floor;
        let measured = Measured { dimensions: dimensions[which], rows: &mean, noise: if exact { &[] } else { &noise } };
        let layer = units::layer(plan, measured, columns, layout.as_ref())?;
        if which == 0 {
            errors = units::errors(&layer, measured);
        }
        layers.push(layer);
    }
    let mut layers = layers.into_iter();
    let (Some(sun), Some(sky), Some(lamps)) = (layers.next(), layers.next(), layers.next()) else {
        return Err(Error::new(ErrorKind::Runtime, "a tile without its three kinds of light"));
    };
    Ok(Tile { sun, sky, lamps, mask: lit.mask.clone(), light: errors })
}

/// A neighbour of a texel in the whole bake, and its weights in the two halves of the samples.
type Neighbour = (u32, [f32; 2]);

/// Decides which texels' light a texel shows.
struct Mixing<'a> {
    listed: &'a Listed,
    filter: Option<&'a Filter<'a>>,
}

impl Mixing<'_> {
    /// The neighbours of a texel whose mean is its light without noise.
    fn filtered(&self, texel: u32) -> Vec<Neighbour> {
        self.filter.map_or_else(|| vec![(texel, [1.0; 2])], |filter| filter.weights(texel))
    }

    /// The neighbours of all texels of a tile.
    fn of_tile(&self, tile: usize) -> Vec<Vec<Neighbour>> {
        let own = self.listed.of_tile(tile);
        let filtered: Vec<Vec<Neighbour>> = own.clone().map(|texel| self.filtered(texel)).collect();
        let mut beyond: HashMap<u32, Vec<Neighbour>> = HashMap::new();
        let mut extrapolated = Vec::new();
        for texel in own.clone() {
            let Some(around) = rim::at_centre(self.listed, texel) else { continue };
            let mut sum: BTreeMap<u32, [f32; 2]> = BTreeMap::new();
            for (other, share) in around {
                let near = match own.contains(&other) {
                    true => &filtered[(other - own.start) as usize],
                    false => &*beyond.entry(other).or_insert_with(|| self.filtered(other)),
                };
                for (near, weights) in near {
                    let sum = sum.entry(*near).or_default();
                    sum.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += share * *weight);
                }
            }
            extrapolated.push((texel, sum.into_iter().collect()));
        }
        let mut near = filtered;
        extrapolated.into_iter().for_each(|(texel, of_texel)| near[(texel - own.start) as usize] = of_texel);
        near
    }
}

/// Weighted means of the two halves of the samples, as mean and noise. `which`: the kind of light; `row`: numbers of a texel.
fn mix(
    gathered: &[Gathered],
    listed: &Listed,
    near: &[Vec<Neighbour>],
    (which, row): (usize, usize),
    out: [&mut Vec<f32>; 2],
) {
    // The halves of the texels that are neighbours, each restored once.
    let mut known: HashMap<u32, usize> = HashMap::new();
    let mut halves: Vec<f32> = Vec::new();
    let mut noise = vec![0.0; row];
    for &(texel, _) in near.iter().flatten() {
        known.entry(texel).or_insert_with(|| {
            let at = halves.len();
            halves.resize(at + 2 * row, 0.0);
            let (first, second) = halves[at..].split_at_mut(row);
            let of = &listed.texels[texel as usize];
            gathered[of.tile as usize].layers[which].restore(of.number as usize, first, &mut noise);
            for ((first, second), noise) in first.iter_mut().zip(second).zip(&noise) {
                (*first, *second) = (*first + noise, *first - noise);
            }
            at
        });
    }
    let [means, noises] = out;
    let (mut first, mut second) = (vec![0.0f32; row], vec![0.0f32; row]);
    for ((near, mean), noise) in
        near.iter().zip(means.chunks_exact_mut(row.max(1))).zip(noises.chunks_exact_mut(row.max(1)))
    {
        first.fill(0.0);
        second.fill(0.0);
        for (texel, [a, b]) in near {
            let Some(&at) = known.get(texel) else { continue };
            first.iter_mut().zip(&halves[at..at + row]).for_each(|(sum, value)| *sum += a * value);
            second.iter_mut().zip(&halves[at + row..at + 2 * row]).for_each(|(sum, value)| *sum += b * value);
        }
        for (((mean, noise), a), b) in mean.iter_mut().zip(noise).zip(&first).zip(&second) {
            (*mean, *noise) = (0.5 * (a + b), 0.5 * (a - b));
        }
    }
}
