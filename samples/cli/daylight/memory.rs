//! The memory that a bake needs.

use std::fmt;

use lucerna::{
    Error, Result,
    techniques::daylight::{Kind, Plan, Transport},
};

/// Bytes that a bake needs besides the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Memory {
    /// Bytes of the device for the tile with the most texels.
    pub device: u64,
    /// Bytes of the machine for one tile, which a shard needs.
    pub tile: u64,
    /// Bytes of the machine, for light of few and of many vectors, when all tiles are filtered and compressed.
    pub machine: [u64; 2],
}

/// Vectors of a kind of light: few, and many. Their number follows from the light, so both figures are estimates.
const VECTORS: [u64; 2] = [4, 128];
/// Bytes of a texel besides its coefficients: its surface, and what the filter compares, with copies that the filter makes.
const BYTES_PER_TEXEL: u64 = 32 + 2 * 64 + 32 + 52;
/// Bytes of a vector's coefficients at a texel: three colours, mean and noise, 16 bits.
const BYTES_PER_VECTOR: u64 = 12;

impl Memory {
    /// `of_tiles`: texels of each tile of a lightmap; `None`: all texels of the plan's tiles are on surfaces.
    pub fn new(plan: &Plan, of_tiles: Option<&[u64]>) -> Self {
        let of_tile = |tile: u32| {
            let [_, _, columns, rows] = plan.tile(tile);
            u64::from(columns) * u64::from(rows)
        };
        let tiles: Vec<u64> = match of_tiles {
            Some(tiles) => tiles.to_vec(),
            None => (0..plan.tile_count()).map(of_tile).collect(),
        };
        let (most, all) = (tiles.iter().copied().max().unwrap_or(0), tiles.iter().sum::<u64>());
        let dimensions = plan.dimensions();
        let device = Transport::bytes_of_tile(plan, most);
        // Means and noise of all times, as numbers of 32 and of 64 bits.
        let tile = dimensions.iter().map(|count| most * 3 * 2 * 12 * *count as u64).sum();
        let machine = VECTORS.map(|vectors| {
            let coefficients: u64 = dimensions.iter().map(|count| vectors.min(*count as u64)).sum();
            all * (BYTES_PER_TEXEL + BYTES_PER_VECTOR * coefficients) + tile
        });
        Self { device, tile, machine }
    }

    /// Refuses a bake, or with `shard` a part of it, that needs more than `free` bytes of the machine at least; `None`: unknown.
    ///
    /// # Errors
    /// `Usage` with both numbers, and what makes the bake smaller.
    pub fn expect_free(&self, plan: &Plan, shard: bool, free: Option<u64>) -> Result<()> {
        let least = if shard { self.tile } else { self.machine[0] };
        let Some(free) = free.filter(|free| *free < least) else { return Ok(()) };
        let (key, help) = match plan.receivers {
            Kind::Lightmap { .. } => ("bake.density", "Choose fewer texels along a metre, or a larger bake.interval"),
            Kind::Cube { .. } => ("bake.face", "Choose smaller faces, or a larger bake.interval"),
            Kind::View { .. } => ("--size", "Choose a smaller picture, or a larger bake.interval"),
        };
        let what = format!("the bake needs at least {least} bytes of memory, {free} are free");
        Err(Error::usage(what).at(key).help(help))
    }
}

impl fmt::Display for Memory {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let gigabytes = |bytes: u64| bytes as f64 / 1e9;
        let (device, [few, many]) = (gigabytes(self.device), self.machine.map(gigabytes));
        write!(
            f,
            "the bake needs about {device:.2} GB of device memory, and {few:.2} to {many:.2} GB of main memory, besides the scene"
        )
    }
}

#[cfg(test)]
mod tests {
    use lucerna::{
        scene::{Pose, View},
        techniques::daylight::Baking,
    };

    use super::*;
    use crate::daylight::{
        DayOptions,
        plan::{Receivers, planned},
    };

    fn plan(size: u32) -> Plan {
        let scene = lucerna_scenes::load("cornell").unwrap();
        let view = View::of_camera(&scene, &Pose::rest(&scene), 0, [size, size]).unwrap();
        planned(&DayOptions::default(), &Baking::default(), &scene, |_| Ok(Receivers::of_view("0", &view)))
            .unwrap()
            .plan
    }

    #[test]
    fn the_machine_needs_more_for_more_texels_and_the_device_needs_one_tile() {
        let [small, large] = [64, 256].map(|size| Memory::new(&plan(size), None));
        assert_eq!(small.device, large.device);
        // A tile of 32×32 texels: vertices of its paths, and sums of even and odd samples of all times.
        let times = plan(64).times.len() as u64;
        assert!(small.device > 1024 * 48 * times && small.device < 1 << 30, "{}", small.device);
        assert!(small.machine[0] < small.machine[1] && large.machine[0] > small.machine[0]);
        assert!(large.machine[0] > 256 * 256 * (BYTES_PER_TEXEL + BYTES_PER_VECTOR * 8));
        // Tiles of a lightmap may have few texels on surfaces.
        assert!(Memory::new(&plan(64), Some(&[3, 5])).device < small.device);
    }

    #[test]
    fn more_than_the_free_memory_is_refused_with_both_numbers() {
        let plan = plan(256);
        let memory = Memory::new(&plan, None);
        let [least, _] = memory.machine;
        memory.expect_free(&plan, false, Some(least)).unwrap();
        memory.expect_free(&plan, false, None).unwrap();
        // A shard has one tile at a time.
        memory.expect_free(&plan, true, Some(memory.tile)).unwrap();
        let error = memory.expect_free(&plan, false, Some(least - 1)).unwrap_err();
        assert_eq!(error.exit_code(), 2);
        let text = error.to_string();
        for part in [&format!("{least} bytes"), &format!("{} are free", least - 1), "smaller picture", "--size"] {
            assert!(text.contains(part), "{part}: {text}");
        }
    }
}
