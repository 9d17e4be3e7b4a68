//! All samples of all occluders in one row, so that any part of it can be computed anywhere and at any time.

use std::ops::Range;

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::{
    Settings,
    cover::Cover,
    light::Light,
    occluder::Occluder,
    samples::{Grid, Shells},
};
use crate::{Result, gpu::Gpu, graph::Runner, shaders::consts::FIV_FLOATS};

/// Points of one run of the device: the finest grain of progress.
const BATCH: u32 = 4096;

/// What is known of an occluder's vectors without the vectors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kind {
    pub name: String,
    /// Of the geometry, in hexadecimal digits.
    pub hash: String,
    /// Of the bounding sphere, metres.
    pub radius: f32,
    #[serde(flatten)]
    pub shells: Shells,
    pub triangles: u64,
}

/// What is to be computed. Everything that decides the numbers is in it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Name of the environment.
    pub environment: String,
    /// Of its texels, in hexadecimal digits.
    pub environment_hash: String,
    /// Texels along an edge of it.
    pub size: u32,
    /// Rays along the edge of a texel.
    pub split: u32,
    /// Radius of the last spheres, in radii of the bounding spheres.
    pub reach: f32,
    #[serde(flatten)]
    pub grid: Grid,
    pub occluders: Vec<Kind>,
}

impl Plan {
    /// For these occluders under this environment.
    pub fn new(environment: &str, hash: u64, occluders: &[Occluder], settings: &Settings) -> Self {
        let kind = |o: &Occluder| Kind {
            name: o.name.clone(),
            hash: format!("{:016x}", o.hash),
            radius: o.radius,
            shells: o.shells(settings.reach),
            triangles: o.triangles as u64,
        };
        Self {
            environment: environment.to_owned(),
            environment_hash: format!("{hash:016x}"),
            size: settings.size,
            split: settings.split,
            reach: settings.reach,
            grid: settings.grid(),
            occluders: occluders.iter().map(kind).collect(),
        }
    }

    /// These settings with what of them decides these numbers.
    pub fn settings(&self, over: &Settings) -> Settings {
        let Grid { azimuths, polars, radii } = self.grid;
        let (size, split, reach) = (self.size, self.split, self.reach);
        Settings { size, split, reach, azimuths, polars, radii, ..over.clone() }
    }

    /// How another plan differs in what decides the numbers, in words; `None`: it does not.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let plain = |of: &Self| (of.size, of.split, of.grid);
        if plain(self) != plain(other) {
            let say = |of: &Self| format!("{} samples, {} texels, {} rays along one", of.grid, of.size, of.split);
            return Some(format!("{} instead of {}", say(other), say(self)));
        }
        if self.environment_hash != other.environment_hash {
            let say = |of: &Self| format!("environment `{}` ({})", of.environment, of.environment_hash);
            return Some(format!("{} instead of {}", say(other), say(self)));
        }
        if self.occluders.len() != other.occluders.len() {
            return Some(format!("{} occluders instead of {}", other.occluders.len(), self.occluders.len()));
        }
        let same = |(a, b): &(&Kind, &Kind)| a.hash == b.hash && a.shells == b.shells;
        let (a, b) = self.occluders.iter().zip(&other.occluders).find(|pair| !same(pair))?;
        let say =
            |k: &Kind| format!("occluder `{}` ({}, {} m to {} m)", k.name, k.hash, k.shells.nearest, k.shells.farthest);
        Some(format!("{} instead of {}", say(b), say(a)))
    }

    /// Samples of all occluders.
    pub fn samples(&self) -> u64 {
        self.occluders.len() as u64 * u64::from(self.grid.count())
    }

    /// The samples of part `index` of `count` even parts.
    pub fn part(&self, index: u64, count: u64) -> Range<u64> {
        let at = |i: u64| (u128::from(self.samples()) * u128::from(i) / u128::from(count.max(1))) as u64;
        at(index)..at(index + 1)
    }

    /// Computes the vectors of some samples, nine floats each. Each sample's numbers are the same whichever others are computed with it.
    /// After every few thousand `done` hears how far it is and gets what is new; it says whether to go on.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if an occluder is larger than the device's limits; whatever `done` fails with.
    pub fn compute(
        &self,
        gpu: &Gpu,
        light: &Light,
        occluders: &[Occluder],
        range: Range<u64>,
        mut done: impl FnMut(u64, &[f32]) -> Result<bool>,
    ) -> Result<()> {
        let each = u64::from(self.grid.count());
        let mut runner = Runner::new(gpu);
        for (number, (occluder, kind)) in occluders.iter().zip(&self.occluders).enumerate() {
            let begin = number as u64 * each;
            let (first, last) = (range.start.max(begin), range.end.min(begin + each));
            if first >= last {
                continue;
            }
            let mut cover = Cover::new(gpu, occluder)?;
            for start in (first..last).step_by(BATCH as usize) {
                let end = last.min(start + u64::from(BATCH));
                let point = |sample: u64| -kind.shells.point(&self.grid, (sample - begin) as u32);
                let points: Vec<Vec3> = (start..end).map(point).collect();
                let (fivs, _) = cover.run(&mut runner, light, &points, self.split)?;
                debug_assert_eq!(fivs.len(), points.len() * FIV_FLOATS as usize);
                if !done(end, &fivs)? {
                    return Ok(());
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_all_of_it_and_none_twice() {
        let kind = Kind {
            name: String::new(),
            hash: String::new(),
            radius: 1.0,
            shells: Shells { nearest: 1.0, farthest: 2.0 },
            triangles: 1,
        };
        let settings = Settings::default();
        let plan = Plan { occluders: vec![kind; 3], ..Plan::new("sky", 1, &[], &settings) };
        assert_eq!(plan.samples(), 3 * 63_360);
        for count in [1, 2, 7, 1000] {
            let parts: Vec<_> = (0..count).map(|i| plan.part(i, count)).collect();
            assert_eq!((parts[0].start, parts[count as usize - 1].end), (0, plan.samples()));
            parts.windows(2).for_each(|p| assert_eq!(p[0].end, p[1].start));
        }
    }
}
