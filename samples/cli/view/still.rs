//! Pictures of a technique: quick ones while something moves, then a still.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use lucerna::{Result, gpu::Gpu, graph::Report, image::Layers};

use super::{
    live::{self, Live, Made, Take},
    painted::{Painter, Values},
    session::{Doing, Shared},
    wanted::{PassTime, Shown, Shows, Wanted},
};
use crate::{args::Size, exposure};

/// Time that a quick picture should take.
const AIM: f64 = 0.07;
/// A still that takes longer has a quick picture before it.
const LONG: f64 = 0.25;
/// The sides of quick pictures are divided by at most this number.
const SMALLEST: f64 = 8.0;
/// They are divided by this number while the time of a picture is not known.
const UNKNOWN: f64 = 4.0;
/// Side of the shadow maps of quick pictures at least, texels, and by how much it is divided at most.
const LEAST_SHADOW: u64 = 256;
const MOST_SHADOW: u32 = 4;

/// The time of the pictures of one technique in one scene.
#[derive(Debug, Default)]
struct Rate {
    /// Time of a pixel, seconds; `None` before the first picture.
    pixel: Option<f64>,
}

impl Rate {
    /// The time of a picture, seconds.
    fn whole(&self, size: Size) -> Option<f64> {
        self.pixel.map(|pixel| pixel * f64::from(size.width) * f64::from(size.height))
    }

    /// By how much the sides of a quick picture are divided.
    fn divisor(&self, asked: Size) -> u32 {
        // Whole numbers, so that the size does not change with every picture.
        self.whole(asked).map_or(UNKNOWN, |whole| (whole / AIM).sqrt().ceil().clamp(1.0, SMALLEST)) as u32
    }

    /// The size of a quick picture.
    #[cfg(test)]
    fn size(&self, asked: Size) -> Size {
        divided(asked, self.divisor(asked))
    }

    fn took(&mut self, time: Duration, size: Size) {
        let pixel = time.as_secs_f64() / (f64::from(size.width) * f64::from(size.height));
        // The first picture makes pipelines, so a later one that is quicker counts at once.
        self.pixel =
            Some(self.pixel.map_or(pixel, |before| if pixel < before { pixel } else { 0.5 * (pixel + before) }));
    }
}

fn divided(size: Size, by: u32) -> Size {
    Size { width: size.width.div_ceil(by), height: size.height.div_ceil(by) }
}

/// The request for a quick picture. Shadow maps take as long in a small picture as in a large one, so they are smaller, too.
fn quick(wanted: &Wanted, by: u32) -> Wanted {
    let mut settings = (*wanted.settings).clone();
    if let Some(size) = settings.pointer_mut("/shadow/size")
        && let Some(texels) = size.as_u64()
    {
        let fewer = texels / u64::from(by.min(MOST_SHADOW));
        *size = fewer.max(LEAST_SHADOW.min(texels)).into();
    }
    let edges = wanted.edges && matches!(wanted.shows, Shows::Image(_));
    Wanted { settings: Arc::new(settings), edges, ..wanted.clone() }
}

/// Light that may be painted again in another way.
struct Light {
    of: Wanted,
    layers: Arc<Layers>,
    size: Size,
    passes: Arc<Vec<PassTime>>,
    images: Arc<Vec<String>>,
    notes: Vec<String>,
    milliseconds: f64,
    ev: f64,
    finished: bool,
}

impl Light {
    fn of(live: &dyn Live, wanted: &Wanted, size: Size, made: Made, begun: Instant) -> Self {
        let fitting =
            || if live.is_light(wanted) && !wanted.is_developed() { exposure::fitting(&made.layers) } else { 0.0 };
        let ev = chosen(live, wanted).unwrap_or_else(fitting);
        Self {
            of: wanted.clone(),
            size,
            passes: Arc::new(times(&made.report)),
            images: Arc::new(made.images),
            notes: made.notes.iter().map(ToString::to_string).collect(),
            milliseconds: begun.elapsed().as_secs_f64() * 1e3,
            ev,
            layers: Arc::new(made.layers),
            finished: false,
        }
    }
}

/// The exposure of a request: that of the user, or the one of the scene's lights.
fn chosen(live: &dyn Live, wanted: &Wanted) -> Option<f64> {
    wanted.exposure.or_else(|| live.exposure(&wanted.stage))
}

fn times(report: &Report) -> Vec<PassTime> {
    let time = |pass: &lucerna::graph::PassTime| {
        let name = pass.scope.iter().chain([&pass.name]).map(String::as_str).collect::<Vec<_>>().join(" / ");
        Some(PassTime { name, milliseconds: pass.gpu_ms? })
    };
    report.passes.iter().filter_map(time).collect()
}

/// Renders requests for one technique in one scene. Returns the first request for something else; `None` if the window closes.
///
/// # Errors
/// Any error of the technique.
pub(super) fn work(shared: &Shared, gpu: &Gpu, painter: &mut Painter, first: Wanted) -> Result<Option<Wanted>> {
    let preparing = |units| Doing::Preparing(first.technique.to_owned(), units);
    shared.does(preparing(None));
    let mut told = |done: u64, all: u64| {
        shared.does(preparing(Some((done, all))));
        !shared.is_for_another(&first)
    };
    let mut live = live::of(gpu, &first, &mut told)?;
    let (mut rate, mut kept) = (Rate::default(), None::<Light>);
    let mut wanted = first.clone();
    loop {
        // Another look at the same light needs no new light.
        let again =
            kept.take().filter(|light| light.finished && light.of.same_light(&wanted) && same_tone(&light.of, &wanted));
        let result = match again {
            Some(mut light) => {
                light.ev = chosen(live.as_ref(), &wanted).unwrap_or(light.ev);
                light.of = wanted.clone();
                paint(shared, painter, live.as_ref(), &light, false).map(|()| Some(light))
            }
            None => picture(shared, painter, live.as_mut(), &wanted, &mut rate),
        };
        match result {
            Ok(light) => kept = light,
            // A lost device needs a new start.
            Err(error) if gpu.is_lost() => return Err(error),
            Err(error) => shared.fail(error),
        }
        wanted = match shared.next() {
            Some(next) if next.same_scene(&first) => next,
            other => return Ok(other),
        };
    }
}

/// The tone mapping of the settings has the exposure inside, so another exposure needs another picture.
fn same_tone(before: &Wanted, now: &Wanted) -> bool {
    before.exposure == now.exposure || !now.is_developed()
}

/// Renders one request. Returns the still, if there is one.
fn picture(
    shared: &Shared,
    painter: &mut Painter,
    live: &mut dyn Live,
    wanted: &Wanted,
    rate: &mut Rate,
) -> Result<Option<Light>> {
    let mean = wanted.pictures > 1 && live.is_light(wanted);
    let long = rate.whole(wanted.size).is_none_or(|time| time > LONG);
    shared.does(Doing::Rendering(0.0));
    if wanted.moving || long {
        let by = rate.divisor(wanted.size);
        let quick = quick(wanted, by);
        let light = one(shared, live, &quick, (divided(wanted.size, by), false), rate)?;
        paint(shared, painter, live, &Light { of: wanted.clone(), ..light }, true)?;
    }
    if wanted.moving || !shared.may_be_interrupted() {
        return Ok(None);
    }
    if mean {
        // Sharp before it is smooth.
        let light = one(shared, live, wanted, (wanted.size, false), rate)?;
        paint(shared, painter, live, &light, true)?;
    }
    let light = if mean {
        let begun = Instant::now();
        let (pose, view) = wanted.placed(wanted.size)?;
        let go_on = || !shared.is_for_another(wanted);
        let take =
            Take { pose: &pose, view, layers: true, exposure: chosen(live, wanted).unwrap_or(0.0), go_on: &go_on };
        let made = live.mean(wanted, &take, &mut |share| shared.does(Doing::Rendering(share)))?;
        Light::of(live, wanted, wanted.size, made, begun)
    } else {
        one(shared, live, wanted, (wanted.size, true), rate)?
    };
    let light = Light { finished: true, ..light };
    // A smooth picture is the mean of many, whose time is not that of one.
    paint(shared, painter, live, &light, !mean)?;
    Ok(Some(light))
}

/// One picture, with all layers or with the light alone.
fn one(
    shared: &Shared,
    live: &mut dyn Live,
    wanted: &Wanted,
    (size, layers): (Size, bool),
    rate: &mut Rate,
) -> Result<Light> {
    let begun = Instant::now();
    let (pose, view) = wanted.placed(size)?;
    // The list of images is that of a picture with all layers, whose smooth edges are images of their own.
    let layers = layers || matches!(wanted.shows, Shows::Layer(_) | Shows::Image(_));
    let go_on = || !shared.is_for_another(wanted);
    let take = Take { pose: &pose, view, layers, exposure: chosen(live, wanted).unwrap_or(0.0), go_on: &go_on };
    let made = live.single(wanted, &take)?;
    rate.took(begun.elapsed(), size);
    Ok(Light::of(live, wanted, size, made, begun))
}

/// Shows light to the window.
fn paint(shared: &Shared, painter: &mut Painter, live: &dyn Live, light: &Light, fresh: bool) -> Result<()> {
    let values = Values::of(&light.of, live.is_light(&light.of));
    let pixels = painter.codes(&light.of, &light.layers, values, light.ev)?;
    let [width, height] = [light.layers.width, light.layers.height];
    shared.show(Shown {
        number: 0,
        size: Size { width, height },
        pixels,
        layers: light.layers.clone(),
        exposure: light.ev,
        fresh,
        whole: light.size == light.of.size,
        of: light.of.clone(),
        milliseconds: light.milliseconds,
        passes: light.passes.clone(),
        images: light.images.clone(),
        notes: light.notes.clone(),
        samples: 0.0,
        noise: None,
        at: Instant::now(),
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quick_pictures_are_smaller_where_whole_ones_take_long() {
        let size = Size { width: 800, height: 600 };
        let mut rate = Rate::default();
        assert_eq!(rate.size(size), Size { width: 200, height: 150 });
        // Pipelines were made.
        rate.took(Duration::from_secs(2), rate.size(size));
        assert_eq!(rate.size(size), Size { width: 100, height: 75 });
        rate.took(Duration::from_micros(4000), Size { width: 100, height: 75 });
        assert_eq!(rate.size(size), Size { width: 400, height: 300 });
        for _ in 0..8 {
            rate.took(Duration::from_millis(20), Size { width: 400, height: 300 });
        }
        assert!(rate.size(size).width >= 400);
        rate.took(Duration::from_millis(10), size);
        assert_eq!(rate.size(size), size);
    }
}
