//! The error of a bake: light that the bake transfers, beside light by following paths, for lights that the bake has not seen.

use glam::Vec3;
use serde::Serialize;

use super::{
    Bakery, Plan, Settings, Stored,
    on_device::{self, OnDevice},
    samples::Triangles,
    solve,
};
use crate::{
    Error, Result, Stop,
    gpu::Gpu,
    graph::{Graph, Items, Runner},
    rays::traced,
    resident::lights_bytes,
    scene::Scene,
    shaders::{consts, prt::check, types::Light},
};

/// The extent of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// Lights at places in the free space, evenly distributed.
    pub lights: u32,
    /// Samples at which light is compared: each one stands for the same area.
    pub samples: u32,
    /// Paths that are followed from each of these samples.
    pub paths: u32,
    pub seed: u32,
}

impl Default for Extent {
    fn default() -> Self {
        Self { lights: 40, samples: 400, paths: 512, seed: 0 }
    }
}

/// Light of a bake beside the truth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Difference {
    /// Root mean square of the error over that of the truth, over all samples and colours. The noise of the truth is taken away.
    pub error: f64,
    /// Sum of the light over that of the truth.
    pub ratio: f64,
}

/// A light of the check.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct OfLight {
    /// Metres.
    pub place: [f32; 3],
    /// Distance to the nearest surface, metres.
    pub away: f32,
    /// Light before any scattering.
    pub direct: Difference,
    /// Light after at least one scattering.
    pub indirect: Difference,
    /// The same with exact direct light, instead of the light by the stored distances.
    pub transferred: Difference,
}

/// Sums from which a [`Difference`] follows.
#[derive(Default)]
struct Sums {
    off: f64,
    square: f64,
    found: f64,
    truth: f64,
}

impl Sums {
    /// Adds a value, and two independent estimates of its truth.
    fn add(&mut self, found: f64, [a, b]: [f64; 2]) {
        self.off += (found - a) * (found - b);
        self.square += a * b;
        self.found += found;
        self.truth += 0.5 * (a + b);
    }

    fn difference(&self) -> Difference {
        if self.square <= 0.0 || self.truth <= 0.0 {
            // Nothing is lit.
            return Difference { error: if self.found > 0.0 { f64::INFINITY } else { 0.0 }, ratio: 1.0 };
        }
        Difference { error: (self.off.max(0.0) / self.square).sqrt(), ratio: self.found / self.truth }
    }
}

/// Light at some samples by following paths.
struct Truth {
    /// Light after light for each sample.
    direct: Vec<f32>,
    /// Light after light for both halves of the paths of each sample.
    indirect: Vec<[f32; 3]>,
}

/// Compares the light that a bake transfers with light by following paths. `settings`: of the pictures; the truth knows `gloss` alone. The scene's
/// own lights are off.
///
/// # Errors
/// As [`solve::solve`]; `OutOfMemory`, `DeviceLost`; `Usage` if there is nothing to compare; `Interrupted`.
pub fn check(
    gpu: &Gpu,
    scene: &Scene,
    stored: &Stored,
    settings: &Settings,
    extent: Extent,
    stop: &Stop,
) -> Result<Vec<OfLight>> {
    let Extent { lights, samples, paths, .. } = extent;
    if [lights, samples, paths].contains(&0) {
        return Err(Error::usage("a check needs at least one light, one sample and one path"));
    }
    let plan = &stored.plan;
    let mut bakery = Bakery::new(gpu, scene)?;
    bakery.upload(plan, &stored.samples)?;
    let places = bakery.places(plan, lights)?;
    let count = places.len();
    let chosen = chosen(stored, samples);
    let truth = bakery.follow(&chosen, &places, settings.gloss, extent)?;
    stop.check()?;
    let mut exact = Vec::with_capacity(stored.samples.len() * count);
    for cluster in 0..plan.clusters.len() {
        exact.extend(bakery.lit(plan, cluster, &places, 0.0)?);
        stop.check()?;
    }
    let light = OnDevice::new(gpu, scene, stored, settings)?;
    let on_samples = crate::gpu::OwnedBuffer::with_contents(gpu, "prt.samples", bytemuck::cast_slice(&stored.samples))?;
    let albedos = on_device::albedos(gpu, scene, &on_samples, stored.samples.len() as u32, settings.gloss)?;
    let solved = solve::solve(stored, &albedos, settings.bounces, settings.mean)?;
    let triangles = Triangles::new(scene).list;
    let mut runner = Runner::new(gpu);
    let mut out = Vec::with_capacity(count);
    for (number, place) in places.iter().enumerate() {
        stop.check()?;
        let [direct, indirect] = transferred(&mut runner, &light, plan, *place, settings)?;
        let of_light: Vec<[f32; 3]> =
            exact.iter().skip(number).step_by(count).map(|e| [e * settings.strength; 3]).collect();
        let by_exact = solved.indirect(stored, &albedos, &of_light);
        let mut sums = [(); 3].map(|()| Sums::default());
        for (row, sample) in chosen.iter().enumerate() {
            let sample = *sample as usize;
            let e = f64::from(truth.direct[row * count + number] * settings.strength);
            sums[0].add(f64::from(direct[sample][0]), [e; 2]);
            let half = |half: usize| truth.indirect[(2 * row + half) * count + number];
            let scale = f64::from(settings.strength) / f64::from(paths.div_ceil(2));
            for channel in 0..3 {
                let both = [0, 1].map(|of| f64::from(half(of)[channel]) * scale);
                sums[1].add(f64::from(indirect[sample][channel].max(0.0)), both);
                sums[2].add(f64::from(by_exact[sample][channel].max(0.0)), both);
            }
        }
        let at = Vec3::from(*place);
        let away = triangles.iter().map(|(triangle, _)| distance(triangle, at)).fold(f32::INFINITY, f32::min);
        let [direct, indirect, transferred] = sums.map(|sums| sums.difference());
        out.push(OfLight { place: *place, away, direct, indirect, transferred });
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
    let lit = light.light(&mut graph, plan, (lights, 1), settings);
    let read = [lit.direct, lit.irradiances].map(|buffer| graph.read_buffer(buffer));
    let frame = runner.run(&graph)?;
    Ok(read.map(|read| frame.buffer(read)))
}

impl Bakery {
    /// Light at the chosen samples by following paths, from lights of 1 W/sr.
    fn follow(&mut self, chosen: &[u32], places: &[[f32; 3]], gloss: bool, extent: Extent) -> Result<Truth> {
        let (rows, lights) = (chosen.len() as u32, places.len() as u32);
        let each = u64::from(rows) * u64::from(lights);
        let mut graph = Graph::new("prt.follow");
        let handles = self.resident.frame_in(&mut graph, &self.scene, &self.pose);
        let rays = self.rays.frame(&mut graph, &handles);
        let direct = graph.buffer("prt.direct", 4 * each);
        let indirect = graph.buffer("prt.indirect", 2 * 12 * each);
        graph.fill(indirect, 0);
        let paths = extent.paths.div_ceil(2);
        let args = traced!(
            check::Args {
                samples: graph.import_buffer(self.uploaded()?),
                chosen: graph.buffer_from("prt.chosen", chosen),
                places: graph.buffer_from("prt.places", places),
                direct,
                indirect,
                push: check::Push { first: 0, count: paths, chosen_of: rows, lights, seed: extent.seed },
                spec: check::Spec { gloss: gloss.into() },
            },
            rays,
            handles
        );
        // Some scatterings, with a ray to each light.
        let of_path = 6 * (1 + u64::from(lights));
        let items =
            Items::new(paths).rays(2 * u64::from(rows) * of_path).turns(of_path * (self.rays.most_turns() + 16));
        graph.compute_over(args, 2 * rows, items);
        let (direct, indirect) = (graph.read_buffer(direct), graph.read_buffer(indirect));
        let frame = self.runner.run(&graph)?;
        Ok(Truth { direct: frame.buffer(direct), indirect: frame.buffer(indirect) })
    }
}

/// Distance of a point to a triangle (Ericson, Real-Time Collision Detection, 2005, section 5.1.5).
fn distance([a, b, c]: &[Vec3; 3], p: Vec3) -> f32 {
    let (ab, ac, ap) = (*b - *a, *c - *a, p - *a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ap.length();
    }
    let bp = p - *b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return bp.length();
    }
    let cp = p - *c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return cp.length();
    }
    let share = |of: f32, rest: f32| of / (of + rest);
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (ap - ab * share(d1, -d3)).length();
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (ap - ac * share(d2, -d6)).length();
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return (bp - (*c - *b) * share(d4 - d3, d5 - d6)).length();
    }
    let normal = ab.cross(ac);
    (ap.dot(normal) / normal.length()).abs()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_to_a_triangle_are_those_of_its_nearest_point() {
        let triangle = [Vec3::ZERO, Vec3::X * 2.0, Vec3::Y];
        let nearest = |p: Vec3| {
            let points = (0..=200).flat_map(|i| (0..=200 - i).map(move |j| (i as f32 / 200.0, j as f32 / 200.0)));
            points.map(|(u, v)| p.distance(triangle[1] * u + triangle[2] * v)).fold(f32::INFINITY, f32::min)
        };
        for p in (0..125).map(|i| Vec3::new((i % 5) as f32, (i / 5 % 5) as f32, (i / 25) as f32) - 1.7) {
            assert!((distance(&triangle, p) - nearest(p)).abs() < 0.02, "{p}");
        }
    }

    #[test]
    fn noise_of_the_truth_is_no_error() {
        let mut sums = Sums::default();
        // SplitMix64, in [-1, 1).
        let noise = |i: u64| {
            let mut z = (i + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        };
        for i in 0..100_000u64 {
            let truth = 2.0 + (i as f64).sin();
            sums.add(1.1 * truth, [truth + noise(2 * i), truth + noise(2 * i + 1)]);
        }
        let found = sums.difference();
        assert!((found.error - 0.1).abs() < 0.01 && (found.ratio - 1.1).abs() < 0.01, "{found:?}");
    }
}
