//! The path tracer under the sun and the sky of a time.

use glam::Vec3;
use lucerna::{
    Error, Result,
    image::{Layer, Layers},
    techniques::daylight::Sky,
    tracer::{self, Tracer},
};

use super::{Job, OfTruth, Rendered, Times, Warm, dark, lit};

/// Paths of the picture of the sun's direct light. It has no noise but that of surfaces that are partly there.
const OF_DIRECT: u32 = 4;

/// Layers as those of baked daylight: `direct` is the light that surfaces have from the sun directly, and the sky behind the scene; `indirect` is
/// all other light, that of the sky in mirrors included.
pub(super) fn picture(warm: &mut Warm<'_>, job: &Job<'_>, settings: OfTruth) -> Result<Option<Rendered>> {
    let OfTruth { day, daylight, samples, mut tracer, object } = settings;
    tracer.seed = tracer.seed.wrapping_add(job.seed);
    let civil = day.day()?;
    let seconds = civil.parse_time(&daylight.time).map_err(Error::usage)?;
    let sun = Vec3::from(civil.sun(seconds).direction(day.north));
    let sky = Sky::new(daylight.weather()?, sun.as_dvec3().to_array()).map_err(Error::usage)?;
    let (scene, pose) = lit(dark(&object.added_to(warm.scene, job.view)?), sun, &sky, daylight.strength);
    let mut running = Tracer::new(warm.gpu, &scene, &pose)?;
    running.start(job.view, &tracer)?;
    let progress = running.run(samples.into(), |_| !job.interrupt.requested())?;
    if job.interrupt.requested() {
        return Ok(None);
    }
    let all = running.layers()?;
    let at_once = tracer::Settings { bounces: 0, specular_bounces: 0, ..tracer };
    let of_sun = tracer::Settings { sources: tracer::Sources::Punctual, ..at_once.clone() };
    let of_sun = running.render(job.view, &of_sun, OF_DIRECT)?;
    let seen = running.render(job.view, &at_once, OF_DIRECT)?;
    let total = pixels(&all, "");
    let direct = sums(&pixels(&of_sun, "direct"), &pixels(&seen, "emission"), 1.0);
    let indirect = sums(&total, &direct, -1.0);
    let [width, height] = job.view.extent;
    let layers = Layers::new(width, height)
        .with(Layer::rgb("", &total))
        .with(Layer::rgb("direct", &direct))
        .with(Layer::rgb("indirect", &indirect));
    let times = Times { wall: vec![progress.time.as_secs_f64() * 1e3], ..Times::default() };
    Ok(Some(Rendered { layers, times }))
}

fn pixels(layers: &Layers, name: &str) -> Vec<[f32; 3]> {
    let data = layers.layer(name).map_or(&[][..], |layer| layer.data.as_slice());
    data.chunks_exact(3).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect()
}

fn sums(a: &[[f32; 3]], b: &[[f32; 3]], weight: f32) -> Vec<[f32; 3]> {
    a.iter().zip(b).map(|(a, b)| std::array::from_fn(|channel| a[channel] + weight * b[channel])).collect()
}
