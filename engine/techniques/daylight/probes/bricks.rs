//! Bricks of probes: units of a bake, and their bytes.

use glam::Vec3;
use half::f16;

use super::{
    DIRECTIONS, Gathered, Grid,
    distance::{Map, TEXELS},
};
use crate::{
    Error, Result,
    techniques::daylight::{
        Plan,
        layer::Layer,
        units::{self, Tile},
    },
};

/// Bytes of a probe besides its light.
const BYTES: usize = 12 + 4 * TEXELS;

/// The probes of a brick.
#[derive(Clone, Debug, PartialEq)]
pub struct Brick {
    /// World positions, metres, in the order of [`Grid::brick`].
    pub positions: Vec<Vec3>,
    pub(super) distances: Vec<Map>,
    /// The irradiance for [`DIRECTIONS`] normals of each probe, texel after texel. Probes inside solids have no light: their bits in the mask
    /// are not set.
    pub light: Tile,
}

impl Brick {
    /// Compresses the light of a brick.
    ///
    /// # Errors
    /// As [`units::compress`].
    pub fn compress(plan: &Plan, gathered: Gathered, skies: &[f32]) -> Result<Self> {
        let Gathered { positions, distances, light } = gathered;
        Ok(Self { positions, distances, light: units::compress(plan, &light, skies)? })
    }

    /// The probe has light: it is not inside a solid.
    pub fn valid(&self, probe: usize) -> bool {
        let texel = probe * DIRECTIONS;
        self.light.mask.get(texel / 32).is_some_and(|word| word >> (texel % 32) & 1 != 0)
    }

    /// The bytes of a unit: numbers with their low byte first.
    pub fn encode(&self) -> Vec<u8> {
        let mut out = Vec::new();
        for (position, map) in self.positions.iter().zip(&self.distances) {
            position.to_array().iter().for_each(|value| out.extend_from_slice(&value.to_le_bytes()));
            map.iter().flatten().for_each(|value| out.extend_from_slice(&value.to_le_bytes()));
        }
        out.extend_from_slice(&self.light.encode());
        out
    }

    /// Reads the bytes of a unit for a brick of `probes` probes.
    ///
    /// # Errors
    /// `Input` if they are not those of a brick of the plan.
    pub fn decode(bytes: &[u8], plan: &Plan, probes: usize) -> Result<Self> {
        if bytes.len() < probes * BYTES {
            return Err(Error::input("a brick of probes that is cut off"));
        }
        let (head, tail) = bytes.split_at(probes * BYTES);
        let (mut positions, mut distances) = (Vec::new(), Vec::new());
        for probe in head.chunks_exact(BYTES) {
            let (position, map) = probe.split_at(12);
            let float =
                |at: usize| f32::from_le_bytes([position[at], position[at + 1], position[at + 2], position[at + 3]]);
            let half = |at: usize| f16::from_le_bytes([map[at], map[at + 1]]);
            positions.push(Vec3::new(float(0), float(4), float(8)));
            distances.push(std::array::from_fn(|texel| [half(4 * texel), half(4 * texel + 2)]));
        }
        let finite = |map: &Map| map.iter().flatten().all(|value| value.is_finite());
        if !positions.iter().all(|position| position.is_finite()) || !distances.iter().all(finite) {
            return Err(Error::input("a probe with a place that is not finite"));
        }
        Ok(Self { positions, distances, light: Tile::decode(tail, plan, probes * DIRECTIONS, None)? })
    }
}

/// What the probes of a bake are within.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Summary {
    pub probes: u32,
    /// Probes that are not inside solids.
    pub valid: u32,
    /// Distance between neighbours along the axes, metres.
    pub spacing: [f32; 3],
    /// Bytes of the light and of the distances.
    pub bytes: u64,
    /// Mean number of images of a brick for the light of the sun.
    pub images: f64,
    /// The largest error of a step of the day in a brick (root mean square over its probes and all normals), relative to its mean.
    pub worst: f64,
    /// Median over bricks of the noise of the step with the most noise, relative to its mean.
    pub noise: f64,
}

/// Sums up the bricks of a grid.
pub fn summary(grid: &Grid, bricks: &[Brick]) -> Summary {
    let there = || bricks.iter().filter(|brick| brick.light.there() > 0);
    let mut noises: Vec<f64> = there().map(|brick| f64::from(brick.light.sun.noise)).collect();
    noises.sort_by(f64::total_cmp);
    let images: u64 = there().map(|brick| u64::from(brick.light.sun.images())).sum();
    Summary {
        probes: grid.probes(),
        valid: bricks.iter().map(|brick| brick.light.there() / DIRECTIONS as u32).sum(),
        spacing: grid.spacing,
        bytes: bricks
            .iter()
            .map(|b| b.light.layers().map(Layer::bytes).iter().sum::<u64>() + (BYTES * b.positions.len()) as u64)
            .sum(),
        images: images as f64 / there().count().max(1) as f64,
        worst: there().map(|brick| f64::from(brick.light.sun.worst)).fold(0.0, f64::max),
        noise: noises.get(noises.len() / 2).copied().unwrap_or(0.0),
    }
}
