//! The list of all samples of all occluders. Any part of the list can be computed anywhere and at any time.

use std::ops::Range;

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::{
    Settings,
    cover::Cover,
    light::Light,
    occluder::Occluder,
    occluder_rotation::{self, Axis},
    samples::{Grid, Shells},
    settings::{Interpolation, Masks, SelfSamples},
    spacing::{self, Spacing},
    surface::{Own, Place},
};
use crate::{Result, gpu::Gpu, graph::Runner, shaders::consts::FIV_FLOATS};

/// Points of one run of the device, which is also the finest step of progress.
const BATCH: u32 = 4096;

/// Description of the vectors of one kind of occluder, without the vectors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kind {
    pub name: String,
    /// Hash of the geometry, in hexadecimal digits.
    pub hash: String,
    /// Radius of the bounding sphere, metres.
    pub radius: f32,
    #[serde(flatten)]
    pub shells: Shells,
    pub triangles: u64,
    /// Number of samples on the surface.
    pub surface: u32,
    /// Spacing of the samples around the occluder.
    #[serde(default, rename = "paces")]
    pub spacing: Spacing,
}

impl Kind {
    /// Offset of the occluder's centre from the receiver, metres.
    pub fn offset(&self, grid: &Grid, index: u32) -> DVec3 {
        self.spacing.offset(grid, &self.shells, index)
    }
}

/// Everything that decides the values of the vectors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Name of the environment.
    pub environment: String,
    /// Hash of the environment's texels, in hexadecimal digits.
    pub environment_hash: String,
    /// Texels along an edge of the environment's cube map.
    pub size: u32,
    /// Rays along the edge of a texel.
    pub split: u32,
    /// How masks are made.
    #[serde(default)]
    pub masks: Masks,
    /// Radius of the last sphere of samples, in radii of the bounding sphere.
    pub reach: f32,
    #[serde(flatten)]
    pub grid: Grid,
    /// Whether there are samples on surfaces. They follow the samples around each occluder.
    pub surface: bool,
    /// Rotation samples. Each of them has all other samples.
    pub turns: u32,
    /// Most separated texels.
    #[serde(default)]
    pub suns: u32,
    /// Axis of the rotation samples.
    #[serde(default)]
    pub turn_axis: Axis,
    pub occluders: Vec<Kind>,
}

impl Plan {
    /// The plan for these occluders under an environment with this name and hash.
    pub fn new(environment: &str, hash: u64, occluders: &[Occluder], settings: &Settings) -> Self {
        let surface = settings.self_shadow && settings.on_surface();
        let kind = |o: &Occluder| Kind {
            name: o.name.clone(),
            hash: format!("{:016x}", o.hash),
            radius: o.radius,
            shells: o.shells(settings.reach),
            triangles: o.triangles as u64,
            surface: if surface { o.own.iter().map(Own::count).sum() } else { 0 },
            spacing: Spacing::default(),
        };
        Self {
            environment: environment.to_owned(),
            environment_hash: format!("{hash:016x}"),
            size: settings.size,
            split: settings.split,
            masks: settings.masks,
            reach: settings.reach,
            grid: settings.grid(),
            surface,
            turns: settings.turns,
            suns: settings.suns,
            turn_axis: settings.turn_axis,
            occluders: occluders.iter().map(kind).collect(),
        }
    }

    /// Computes the spacing of the samples of the occluders that `which` selects by their number in the plan, if the
    /// settings ask for adaptive spacing.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if an occluder is larger than the device's limits.
    pub fn adapt(
        &mut self,
        gpu: &Gpu,
        light: &Light,
        occluders: &[Occluder],
        settings: &Settings,
        which: impl Fn(usize) -> bool,
    ) -> Result<()> {
        if !settings.adaptive {
            return Ok(());
        }
        let scaled = settings.interpolation == Interpolation::SolidAngle;
        let mut runner = Runner::new(gpu);
        for (number, (kind, occluder)) in self.occluders.iter_mut().zip(occluders).enumerate() {
            if which(number) {
                let mut cover = Cover::new(gpu, occluder)?;
                let place = (&self.grid, &kind.shells);
                kind.spacing = spacing::choose(&mut cover, &mut runner, light, place, (kind.radius, scaled))?;
            }
        }
        Ok(())
    }

    /// The settings `over` with the values of this plan in all keys that decide the vectors.
    pub fn settings(&self, over: &Settings) -> Settings {
        let Grid { azimuths, polars, radii } = self.grid;
        let (size, split, masks, reach) = (self.size, self.split, self.masks, self.reach);
        let (turns, turn_axis, suns) = (self.turns, self.turn_axis, self.suns);
        let self_samples = match (self.surface, over.self_shadow) {
            (true, _) => SelfSamples::Surface,
            (false, true) => SelfSamples::Spheres,
            // Without shadows of occluders on themselves this key has no effect.
            (false, false) => over.self_samples,
        };
        // A plan without occluders has no spacing.
        let adaptive = match self.occluders.is_empty() {
            true => over.adaptive,
            false => self.occluders.iter().any(|kind| kind.spacing != Spacing::default()),
        };
        let out = Settings { size, split, masks, reach, azimuths, polars, radii, ..over.clone() };
        Settings { turns, turn_axis, suns, self_samples, adaptive, ..out }
    }

    /// The difference of another plan that changes the vectors, in words. `None` if there is none.
    pub fn difference(&self, other: &Self) -> Option<String> {
        // A single rotation sample has no axis.
        let axis = |of: &Self| Some(of.turn_axis).filter(|_| of.turns > 1);
        let plain = |of: &Self| (of.size, of.split, of.grid, of.turns, of.suns, axis(of));
        if plain(self) != plain(other) {
            let say = |of: &Self| {
                let about = axis(of).map_or(String::new(), |axis| format!(" about {axis}"));
                let Self { grid, turns, size, split, suns, .. } = of;
                format!(
                    "{grid} samples, {turns} turns{about}, {size} texels to a side, {split} rays along a texel, {suns} separated texels"
                )
            };
            return Some(format!("{} instead of {}", say(other), say(self)));
        }
        if self.masks != other.masks {
            return Some(format!("masks by {:?} instead of {:?}", other.masks, self.masks));
        }
        if self.environment_hash != other.environment_hash {
            let say = |of: &Self| format!("environment `{}` ({})", of.environment, of.environment_hash);
            return Some(format!("{} instead of {}", say(other), say(self)));
        }
        if self.occluders.len() != other.occluders.len() {
            return Some(format!("{} occluders instead of {}", other.occluders.len(), self.occluders.len()));
        }
        if self.surface != other.surface {
            let say = |of: &Self| if of.surface { "with samples on surfaces" } else { "without samples on surfaces" };
            return Some(format!("{} instead of {}", say(other), say(self)));
        }
        let same = |(a, b): &(&Kind, &Kind)| {
            (&a.hash, &a.shells, a.surface, &a.spacing) == (&b.hash, &b.shells, b.surface, &b.spacing)
        };
        let (a, b) = self.occluders.iter().zip(&other.occluders).find(|pair| !same(pair))?;
        let say = |k: &Kind| {
            let Kind { name, hash, shells, surface, .. } = k;
            format!(
                "occluder `{name}` ({hash}, {} m to {} m, {surface} samples on its surface)",
                shells.nearest, shells.farthest
            )
        };
        if say(a) == say(b) {
            return Some(format!(
                "the samples around occluder `{}` have another spacing (fiv.adaptive, fiv.interpolation, or another device)",
                a.name
            ));
        }
        Some(format!("{} instead of {}", say(b), say(a)))
    }

    /// Number of samples of all occluders.
    pub fn samples(&self) -> u64 {
        self.first(self.occluders.len())
    }

    /// The first sample of an occluder. Each of its rotation samples has first the samples around the occluder, then
    /// the samples on its surface.
    pub fn first(&self, occluder: usize) -> u64 {
        self.occluders.iter().take(occluder).map(|kind| self.of_turn(kind) * u64::from(self.turns)).sum()
    }

    /// [`Self::first`] of all occluders, followed by [`Self::samples`].
    pub(super) fn firsts(&self) -> Vec<u64> {
        let mut at = 0;
        let next = |kind: &Kind| {
            at += self.of_turn(kind) * u64::from(self.turns);
            at
        };
        std::iter::once(0).chain(self.occluders.iter().map(next)).collect()
    }

    /// Number of samples of one rotation sample of an occluder.
    pub fn of_turn(&self, kind: &Kind) -> u64 {
        u64::from(self.grid.count()) + u64::from(kind.surface)
    }

    /// The samples of part `index` of `count` equal parts.
    pub fn part(&self, index: u64, count: u64) -> Range<u64> {
        let at = |i: u64| (u128::from(self.samples()) * u128::from(i) / u128::from(count.max(1))) as u64;
        at(index)..at(index + 1)
    }

    /// Computes the vectors of a range of samples, nine floats each. The values of a sample do not depend on the range.
    /// After every few thousand samples `done` receives the number of the next sample and the new vectors. It returns
    /// whether to go on.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`; `Runtime` if an occluder is larger than the device's limits; whatever `done` fails with.
    pub fn compute(
        &self,
        gpu: &Gpu,
        light: &Light,
        occluders: &[Occluder],
        range: Range<u64>,
        done: impl FnMut(u64, &[f32]) -> Result<bool>,
    ) -> Result<()> {
        self.compute_with(&mut OnDevice::new(gpu), light, occluders, range, done)
    }

    /// As [`Self::compute`], for ranges one after the other: what the last one had on the device is used again.
    ///
    /// # Errors
    /// As [`Self::compute`].
    pub fn compute_with<'a>(
        &self,
        on_device: &mut OnDevice<'a>,
        light: &Light,
        occluders: &'a [Occluder],
        range: Range<u64>,
        mut done: impl FnMut(u64, &[f32]) -> Result<bool>,
    ) -> Result<()> {
        let firsts = self.firsts();
        let all = occluders.iter().zip(&self.occluders).zip(firsts.windows(2)).enumerate();
        for (number, ((occluder, kind), ends)) in all {
            let (first, mut at, last) = (ends[0], range.start.max(ends[0]), range.end.min(ends[1]));
            if at >= last {
                continue;
            }
            let (cover, runner) = on_device.occluder(number, occluder, self)?;
            let places = occluder.places();
            while at < last {
                let of_turn = self.of_turn(kind);
                let turn = (at - first) / of_turn;
                let begin = first + turn * of_turn;
                let border = begin + u64::from(self.grid.count());
                let end = last.min(at + u64::from(BATCH)).min(if at < border { border } else { begin + of_turn });
                let matrix = occluder_rotation::matrix(turn as u32, self.turns, self.turn_axis).as_mat3();
                cover.turn(matrix);
                let fivs = if at < border {
                    let point = |sample: u64| {
                        let number = (sample - begin) as u32;
                        if kind.spacing == Spacing::default() {
                            -kind.shells.point(&self.grid, number)
                        } else {
                            -kind.offset(&self.grid, number).as_vec3()
                        }
                    };
                    let points: Vec<Vec3> = (at..end).map(point).collect();
                    around(cover, runner, light, &points, self.split)?
                } else {
                    let places = places.get((at - border) as usize..(end - border) as usize).unwrap_or_default();
                    let turned = |p: &Place| Place { point: matrix * p.point, normal: matrix * p.normal };
                    let places: Vec<Place> = places.iter().map(turned).collect();
                    cover.run_own(runner, light, &places, self.split)?.0
                };
                debug_assert_eq!(fivs.len() as u64, (end - at) * u64::from(FIV_FLOATS));
                if !done(end, &fivs)? {
                    return Ok(());
                }
                at = end;
            }
        }
        Ok(())
    }
}

/// What computing vectors has on the device: the last occluder.
#[derive(Debug)]
pub struct OnDevice<'a> {
    gpu: Gpu,
    runner: Runner,
    occluder: Option<(usize, Cover<'a>)>,
}

impl<'a> OnDevice<'a> {
    pub fn new(gpu: &Gpu) -> Self {
        Self { gpu: gpu.clone(), runner: Runner::new(gpu), occluder: None }
    }

    fn occluder(
        &mut self,
        number: usize,
        occluder: &'a Occluder,
        plan: &Plan,
    ) -> Result<(&mut Cover<'a>, &mut Runner)> {
        let cover = match self.occluder.take() {
            Some(last) if last.0 == number => last,
            _ => {
                let mut cover = Cover::new(&self.gpu, occluder)?;
                if plan.masks == Masks::Parallel {
                    cover.look_up(&self.gpu, plan.size, plan.split)?;
                }
                (number, cover)
            }
        };
        Ok((&mut self.occluder.insert(cover).1, &mut self.runner))
    }
}

/// Vectors of the occluder for `points`. Equal neighbours (all azimuths at the poles) are computed once.
fn around(cover: &mut Cover, runner: &mut Runner, light: &Light, points: &[Vec3], split: u32) -> Result<Vec<f32>> {
    let mut unique = points.to_vec();
    unique.dedup();
    let (fivs, _) = cover.run(runner, light, &unique, split)?;
    let floats = FIV_FLOATS as usize;
    let (mut out, mut at) = (Vec::with_capacity(points.len() * floats), 0);
    for (i, point) in points.iter().enumerate() {
        at += usize::from(i > 0 && points[i - 1] != *point);
        out.extend_from_slice(&fivs[floats * at..floats * (at + 1)]);
    }
    Ok(out)
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
            surface: 100,
            spacing: Spacing::default(),
        };
        let settings = Settings::default();
        let plan = Plan { occluders: vec![kind; 3], ..Plan::new("sky", 1, &[], &settings) };
        assert_eq!((plan.samples(), plan.first(1)), (3 * 63_460, 63_460));
        assert_eq!(plan.firsts(), [0, 1, 2, 3].map(|kind| plan.first(kind)));
        for count in [1, 2, 7, 1000] {
            let parts: Vec<_> = (0..count).map(|i| plan.part(i, count)).collect();
            assert_eq!((parts[0].start, parts[count as usize - 1].end), (0, plan.samples()));
            parts.windows(2).for_each(|p| assert_eq!(p[0].end, p[1].start));
        }
    }
}
