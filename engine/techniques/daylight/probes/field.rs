//! The probes of a bake on a device, and the light that they give to objects.

use std::collections::VecDeque;

use super::{Grid, distance::Map};
use crate::{
    Result,
    gpu::{Gpu, OwnedBuffer},
    graph::{Buffer, Graph, Image},
    passes::gbuffer::GBuffer,
    scene::View,
    shaders::{
        consts,
        daylight::{probe_decode, probe_light},
        types,
    },
    techniques::daylight::{
        Stored,
        pictures::{Sources, coefficients, fits, packed},
        units::Tile,
    },
};

/// The probes on the device.
#[derive(Debug)]
pub struct Field {
    grid: Grid,
    tiles: OwnedBuffer,
    words: OwnedBuffer,
    probes: OwnedBuffer,
    distances: OwnedBuffer,
}

/// The light of a moment: the baked times with their weights, the colour of the sun, the radiance of the patches of the sky, and how bright each group
/// of lamps burns.
#[derive(Clone, Copy, Debug)]
pub struct Moment<'a> {
    pub weights: &'a [(usize, f32)],
    pub sun: [f32; 3],
    pub patches: &'a [[f32; 3]],
    pub lamps: &'a [[f32; 3]],
}

/// The images that change at the pixels of added objects and of glossy surfaces.
#[derive(Clone, Copy, Debug)]
pub struct Pixels {
    /// Above 0.5 at pixels of added objects, if there are any.
    pub mask: Option<Image>,
    /// Direct light with emission.
    pub direct: Image,
    pub total: Image,
    pub indirect: Image,
    pub irradiance: Image,
}

impl Field {
    /// Uploads the probes of a bake; `None` if it has none.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if the images are larger than the device's limits.
    pub fn new(gpu: &Gpu, stored: &Stored) -> Result<Option<Self>> {
        let Some(grid) = &stored.plan.probes else { return Ok(None) };
        let count = grid.probes() as usize;
        let mut probes = vec![types::DayProbe { position: [0.0; 3], near: u32::MAX }; count];
        let mut distances: Vec<Map> = vec![[[half::f16::ZERO; 2]; super::distance::TEXELS]; count];
        let mut valid = vec![false; count];
        for (index, brick) in stored.probes.iter().enumerate() {
            for (inside, at) in grid.brick(index as u32).into_iter().enumerate() {
                let number = grid.number(at) as usize;
                probes[number].position = brick.positions[inside].to_array();
                distances[number] = brick.distances[inside];
                valid[number] = brick.valid(inside);
            }
        }
        probes.iter_mut().zip(nearest(grid, &valid)).for_each(|(probe, near)| probe.near = near);
        let words_of =
            |map: &Map| map.map(|[mean, square]| u32::from(mean.to_bits()) | u32::from(square.to_bits()) << 16);
        let distances: Vec<u32> = distances.iter().flat_map(words_of).collect();
        let (tiles, words) = packed(stored.probes.iter().map(|brick| (&brick.light, 1)));
        fits(gpu, 4 * words.len() as u64)
            .map_err(|error| error.at("probes").help("Bake fewer probes, or use another device"))?;
        let upload = |name, bytes: &[u8]| OwnedBuffer::with_contents(gpu, name, bytes);
        Ok(Some(Self {
            grid: grid.clone(),
            tiles: upload("daylight.probe_tiles", bytemuck::cast_slice(&tiles))?,
            words: upload("daylight.probe_words", bytemuck::cast_slice(&words))?,
            probes: upload("daylight.probes", bytemuck::cast_slice(&probes))?,
            distances: upload("daylight.probe_distances", bytemuck::cast_slice(&distances))?,
        }))
    }

    /// The irradiance of all probes as harmonics: [`consts::PROBE_TERMS`] colours for each probe in the order of [`Grid::number`], W/m².
    pub fn decode<'a>(
        &self,
        graph: &mut Graph,
        tiles: impl Iterator<Item = &'a Tile> + Clone,
        moment: Moment<'_>,
    ) -> Buffer {
        let Moment { weights, sun, patches, lamps } = moment;
        let bytes = 12 * u64::from(consts::PROBE_TERMS) * u64::from(self.grid.probes());
        let light = graph.buffer("daylight.probe_light", bytes);
        let args = probe_decode::Args {
            grid: graph.uniform(&self.grid.on_device()),
            light,
            tiles: graph.import_buffer(&self.tiles),
            words: graph.import_buffer(&self.words),
            coefficients: graph.buffer_from(
                "daylight.probe_coefficients",
                &coefficients(tiles, &[weights.to_vec()], &Sources { sun, patches, lamps }),
            ),
        };
        graph.compute(args, self.grid.probes());
        light
    }

    /// Replaces the indirect light at the pixels of added objects, and of the gloss of all surfaces if it is `directed`. `light`: of [`Self::decode`]; `reflects`:
    /// REFLECT_ of daylight/reflect.glsl.
    pub fn shine(
        &self,
        graph: &mut Graph,
        gbuffer: &GBuffer,
        view: &View,
        light: Buffer,
        pixels: &Pixels,
        (reflects, directed): (u32, bool),
    ) {
        let Pixels { mask, direct, total, indirect, irradiance } = *pixels;
        let args = probe_light::Args {
            view: gbuffer.view,
            albedo: gbuffer.albedo,
            depth: gbuffer.depth,
            direct,
            specular: gbuffer.specular,
            normals: gbuffer.normal,
            mask: mask.unwrap_or(gbuffer.depth),
            total,
            indirect,
            irradiance,
            grid: graph.uniform(&self.grid.on_device()),
            probes: graph.import_buffer(&self.probes),
            distances: graph.import_buffer(&self.distances),
            light,
            spec: probe_light::Spec { reflects, added: mask.is_some().into(), directed: directed.into() },
        };
        graph.compute(args, view.extent);
    }
}

/// For each probe itself, or the nearest valid one by steps along the axes; `u32::MAX` if there is none.
fn nearest(grid: &Grid, valid: &[bool]) -> Vec<u32> {
    let mut near: Vec<u32> = (0..valid.len() as u32).map(|i| if valid[i as usize] { i } else { u32::MAX }).collect();
    let mut queue: VecDeque<u32> = near.iter().copied().filter(|number| *number != u32::MAX).collect();
    let steps = [1, grid.counts[0], grid.counts[0] * grid.counts[1]];
    while let Some(number) = queue.pop_front() {
        for (axis, step) in steps.into_iter().enumerate() {
            let along = number / step % grid.counts[axis];
            let below = (along > 0).then(|| number - step);
            let above = (along + 1 < grid.counts[axis]).then(|| number + step);
            for next in below.into_iter().chain(above) {
                if near[next as usize] == u32::MAX {
                    near[next as usize] = near[number as usize];
                    queue.push_back(next);
                }
            }
        }
    }
    near
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probes_inside_solids_take_the_light_of_their_neighbours() {
        let grid = Grid { origin: [0.0; 3], spacing: [1.0; 3], counts: [4, 2, 2] };
        let mut valid = vec![false; 16];
        assert_eq!(nearest(&grid, &valid), vec![u32::MAX; 16]);
        valid[0] = true;
        valid[15] = true;
        let near = nearest(&grid, &valid);
        assert_eq!((near[0], near[1], near[4], near[8], near[15], near[14], near[11]), (0, 0, 0, 0, 15, 15, 15));
        assert!(near.iter().all(|number| [0, 15].contains(number)));
    }
}
