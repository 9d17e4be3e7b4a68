//! The error of a bake: light that the bake transfers, beside light by following paths, for lights that the bake has not seen.

use glam::Vec3;
use serde::Serialize;

use super::{
    Bakery, Plan, Settings, Stored,
    on_device::{OnDevice, scattering},
    samples::Triangles,
};
use crate::{
    Error, Result, Stop,
    gpu::Gpu,
    graph::{Graph, Items, Runner},
    rays::traced,
    resident::lights_bytes,
    scene::{Scene, nearest::distance_of_origin},
    shaders::{consts, prt::check, types::Light},
};

/// The extent of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CheckOptions {
    /// Lights at places in the free space, evenly distributed.
    pub lights: u32,
    /// Samples at which light is compared: each one stands for the same area.
    pub samples: u32,
    /// Paths that are followed from each of these samples, rounded up to four equal parts.
    pub paths: u32,
    pub seed: u32,
}

impl Default for CheckOptions {
    fn default() -> Self {
        Self { lights: 40, samples: 400, paths: 512, seed: 0 }
    }
}

/// Light of a bake beside the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RelativeError {
    /// Root mean square of the error over that of the truth, over all samples and colours. The noise of the truth is taken away.
    pub error: f64,
    /// The same without the twentieth of the samples whose error is largest. One half of the paths finds these samples, and the other half gives the error of all
    /// other samples, so that noise does not choose.
    pub trimmed: f64,
    /// Sum of the light over that of the truth.
    pub energy: f64,
}

/// The errors of a light; `None`: the truth is dark, or too noisy to tell.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LightErrors {
    /// Metres.
    pub place: [f32; 3],
    /// Distance to the nearest surface, metres.
    pub distance_to_surface: f32,
    /// Light before any scattering.
    pub direct: Option<RelativeError>,
    /// Light after at least one scattering.
    pub indirect: Option<RelativeError>,
    /// The same with exact direct light, instead of the light by the stored distances.
    pub transferred: Option<RelativeError>,
}

/// One in so many samples is left out of the trimmed error.
const WORST: usize = 20;

/// Means of the paths of a sample, one for each part of them.
type Parts = [f64; consts::PRT_CHECK_PARTS as usize];

/// Squares of a sample, each of two estimates that do not depend on each other, so that noise is not in their sums.
#[derive(Clone, Copy, Default)]
struct Squares {
    /// Of the error and of the truth, by all paths.
    all: [f64; 2],
    /// Of the error, by the first half of the paths, with their noise.
    first: f64,
    /// Of the error and of the truth, by the second half.
    second: [f64; 2],
}

/// Sums from which a [`RelativeError`] follows.
#[derive(Default)]
struct Sums {
    samples: Vec<Squares>,
    found: f64,
    truth: f64,
}

impl Sums {
    /// Adds the light of a sample in some colours, each with its truth.
    fn add(&mut self, colours: impl IntoIterator<Item = (f64, Parts)>) {
        let mut of = Squares::default();
        for (found, [a, b, c, d]) in colours {
            let (first, second) = (0.5 * (a + b), 0.5 * (c + d));
            let pairs = [(&mut of.all, [first, second]), (&mut of.second, [c, d])];
            for (square, [one, other]) in pairs {
                square[0] += (found - one) * (found - other);
                square[1] += one * other;
            }
            of.first += (found - first).powi(2);
            self.found += found;
            self.truth += 0.5 * (first + second);
        }
        self.samples.push(of);
    }

    fn error(mut self) -> Option<RelativeError> {
        let relative = |list: &[Squares], squares: fn(&Squares) -> [f64; 2]| {
            let [off, square] = [0, 1].map(|of| list.iter().map(|sample| squares(sample)[of]).sum::<f64>());
            (square > 0.0).then(|| (off.max(0.0) / square).sqrt())
        };
        let error = relative(&self.samples, |sample| sample.all).filter(|_| self.truth > 0.0)?;
        self.samples.sort_by(|a, b| a.first.total_cmp(&b.first));
        let kept = self.samples.len() - self.samples.len() / WORST;
        let trimmed = relative(&self.samples[..kept], |sample| sample.second).unwrap_or(error);
        Some(RelativeError { error, trimmed, energy: self.found / self.truth })
    }
}

/// Light at some samples by following paths.
struct Truth {
    /// Light after light for each sample.
    direct: Vec<f32>,
    /// Light after light for all parts of the paths of each sample.
    indirect: Vec<[f32; 3]>,
}

/// Compares the light that a bake transfers with light by following paths, for points of 1 W/sr as lights. The scene's own lights are off. `settings`:
/// of the pictures, but for the strength and the radius of lights, and always with shadows by the samples; the truth knows `gloss` alone, and always has all
/// scatterings.
///
/// # Errors
/// `Input` if the light of all scatterings is not finite; `Usage` if there is nothing to compare; `OutOfMemory`, `DeviceLost`, `Interrupted`.
pub fn check(
    gpu: &Gpu,
    scene: &Scene,
    stored: &Stored,
    settings: &Settings,
    options: CheckOptions,
    stop: &Stop,
) -> Result<Vec<LightErrors>> {
    let CheckOptions { lights, samples, paths, .. } = options;
    for (name, value) in [("lights", lights), ("samples", samples), ("paths", paths)] {
        if value == 0 {
            return Err(Error::usage("is 0, a check needs at least 1").at(name));
        }
    }
    let settings = Settings { strength: 1.0, radius: 0.0, ..settings.clone() };
    let plan = &stored.plan;
    let mut bakery = Bakery::new(gpu, scene)?;
    bakery.upload(plan, &stored.samples)?;
    let places = bakery.places(plan, lights)?;
    let count = places.len();
    let chosen = chosen(stored, samples);
    let truth = bakery.follow(&chosen, &places, settings.gloss, options)?;
    stop.check()?;
    let mut exact = Vec::with_capacity(stored.samples.len() * count);
    for cluster in 0..plan.clusters.len() {
        exact.extend(bakery.lit(plan, cluster, &places, 0.0)?);
        stop.check()?;
    }
    let (albedos, solved) = scattering(gpu, scene, stored, &settings)?;
    let light = OnDevice::with(gpu, stored, &albedos, &solved)?;
    let triangles = Triangles::new(scene).list;
    let mut runner = Runner::new(gpu);
    let mut out = Vec::with_capacity(count);
    for (number, place) in places.iter().enumerate() {
        stop.check()?;
        let [direct, indirect] = transferred(&mut runner, &light, plan, *place, &settings)?;
        let of_light: Vec<[f32; 3]> = exact.iter().skip(number).step_by(count).map(|e| [*e; 3]).collect();
        let by_exact = solved.indirect(stored, &albedos, &of_light);
        let mut sums = [(); 3].map(|()| Sums::default());
        for (row, sample) in chosen.iter().enumerate() {
            let sample = *sample as usize;
            sums[0].add([(
                f64::from(direct[sample][0]),
                [f64::from(truth.direct[row * count + number]); consts::PRT_CHECK_PARTS as usize],
            )]);
            let part = |part: usize| truth.indirect[(consts::PRT_CHECK_PARTS as usize * row + part) * count + number];
            let scale = 1.0 / f64::from(paths.div_ceil(consts::PRT_CHECK_PARTS));
            for (sums, found) in sums[1..].iter_mut().zip([&indirect, &by_exact]) {
                let colour = |channel: usize| {
                    let truth: Parts = std::array::from_fn(|of| f64::from(part(of)[channel]) * scale);
                    (f64::from(found[sample][channel].max(0.0)), truth)
                };
                sums.add([0, 1, 2].map(colour));
            }
        }
        let at = Vec3::from(*place);
        let distances = triangles.iter().map(|(triangle, _)| distance_of_origin(triangle.map(|corner| corner - at)));
        let [direct, indirect, transferred] = sums.map(|sums| sums.error());
        let distance_to_surface = distances.fold(f32::INFINITY, f32::min);
        out.push(LightErrors { place: *place, distance_to_surface, direct, indirect, transferred });
    }
    Ok(out)
}

/// Numbers of samples that stand for equal areas.
fn chosen(stored: &Stored, count: u32) -> Vec<u32> {
    let whole: f64 = stored.samples.iter().map(|sample| f64::from(sample.area)).sum();
    let each = whole / f64::from(count);
    let mut sum = 0.0;
    let mut out = Vec::with_capacity(count as usize);
    for (number, sample) in stored.samples.iter().enumerate() {
        sum += f64::from(sample.area);
        while out.len() < count as usize && (out.len() as f64 + 0.5) * each < sum {
            out.push(number as u32);
        }
    }
    out
}

/// Direct and indirect irradiance at all samples by a light of 1 W/sr at each of these places, as pictures with shadows by the samples have them, W/m².
/// `settings`: of the pictures; the strength of lights counts, and so do their radius and their points.
///
/// # Errors
/// `Input` if the light of all scatterings is not finite; `OutOfMemory`, `DeviceLost`, `Interrupted`.
pub fn at_samples(
    gpu: &Gpu,
    scene: &Scene,
    stored: &Stored,
    settings: &Settings,
    places: &[[f32; 3]],
) -> Result<Vec<[Vec<[f32; 3]>; 2]>> {
    let light = OnDevice::new(gpu, scene, stored, settings)?;
    let mut runner = Runner::new(gpu);
    places.iter().map(|place| transferred(&mut runner, &light, &stored.plan, *place, settings)).collect()
}

/// Direct and indirect irradiance at all samples by a light of 1 W/sr, as a picture has them, W/m².
fn transferred(
    runner: &mut Runner,
    light: &OnDevice,
    plan: &Plan,
    place: [f32; 3],
    settings: &Settings,
) -> Result<[Vec<[f32; 3]>; 2]> {
    let mut graph = Graph::new("prt.check");
    let one =
        Light { position: place, kind: consts::LIGHT_POINT, intensity: [1.0; 3], spot_offset: 1.0, ..Light::default() };
    let lights = graph.buffer_from("scene.lights", &lights_bytes(&[one]));
    let lit = light.light(&mut graph, plan, (lights, 1), None, settings);
    let read = [lit.direct, lit.irradiances].map(|buffer| graph.read_buffer(buffer));
    let frame = runner.run(&graph)?;
    Ok(read.map(|read| frame.buffer(read)))
}

impl Bakery {
    /// Light at the chosen samples by following paths, from lights of 1 W/sr.
    fn follow(&mut self, chosen: &[u32], places: &[[f32; 3]], gloss: bool, options: CheckOptions) -> Result<Truth> {
        let (rows, lights) = (chosen.len() as u32, places.len() as u32);
        let each = u64::from(rows) * u64::from(lights);
        let mut graph = Graph::new("prt.follow");
        let handles = self.resident.frame_in(&mut graph, &self.scene, &self.pose);
        let rays = self.rays.frame(&mut graph, &handles);
        let direct = graph.buffer("prt.direct", 4 * each);
        let parts = consts::PRT_CHECK_PARTS;
        let indirect = graph.buffer("prt.indirect", u64::from(parts) * 12 * each);
        graph.fill(indirect, 0);
        let paths = options.paths.div_ceil(parts);
        let args = traced!(
            check::Args {
                samples: graph.import_buffer(self.uploaded()?),
                chosen: graph.buffer_from("prt.chosen", chosen),
                places: graph.buffer_from("prt.places", places),
                direct,
                indirect,
                push: check::Push { first: 0, count: paths, chosen_of: rows, lights, seed: options.seed },
                spec: check::Spec { gloss: gloss.into() },
            },
            rays,
            handles
        );
        // Some scatterings, with a ray to each light.
        let of_path = 6 * (1 + u64::from(lights));
        let items =
            Items::new(paths).rays(u64::from(parts * rows) * of_path).turns(of_path * (self.rays.most_turns() + 16));
        graph.compute_over(args, parts * rows, items);
        let (direct, indirect) = (graph.read_buffer(direct), graph.read_buffer(indirect));
        let frame = self.runner.run(&graph)?;
        Ok(Truth { direct: frame.buffer(direct), indirect: frame.buffer(indirect) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn darkness_has_no_error() {
        let mut sums = Sums::default();
        sums.add([(0.1, [0.0; 4])]);
        assert_eq!(sums.error(), None);
    }

    #[test]
    fn noise_of_the_truth_is_no_error() {
        let mut sums = Sums::default();
        // Sequences that do not depend on each other, in [-1, 1).
        let noise = |i: u64, step: f64| 2.0 * (i as f64 * step).fract() - 1.0;
        for i in 0..100_000u64 {
            let truth = 2.0 + (i as f64).sin();
            sums.add([(1.1 * truth, [5f64, 3.0, 2.0, 7.0].map(|step| truth + noise(i, step.sqrt())))]);
        }
        let found = sums.error().unwrap();
        assert!((found.error - 0.1).abs() < 0.01 && (found.energy - 1.1).abs() < 0.01, "{found:?}");
        // Samples of little noise are taken for good ones, and so are those of little error.
        assert!((found.trimmed - 0.1).abs() < 0.01, "{found:?}");
    }

    #[test]
    fn one_sample_in_twenty_is_left_out_of_the_trimmed_error() {
        let mut sums = Sums::default();
        for i in 0..40 {
            let off = if i % 20 == 7 { 1.0 } else { 0.1 };
            sums.add([0.5, 1.0].map(|truth| (truth * (1.0 + off), [truth; 4])));
        }
        let found = sums.error().unwrap();
        assert!(
            (found.trimmed - 0.1).abs() < 1e-9 && (found.error - (0.01f64 * 0.95 + 0.05).sqrt()).abs() < 1e-9,
            "{found:?}"
        );
    }
}
