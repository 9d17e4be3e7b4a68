//! The path tracer for a side of the window: a picture that grows while it is looked at.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use lucerna::{
    Result,
    gpu::Gpu,
    tracer::{PictureSettings, Tracer},
};

use super::{
    painted::Painter,
    session::{Doing, Shared},
    wanted::{Shown, Shows, Wanted},
};
use crate::{args::Size, exposure, last_stage::Staged};

/// Time between two pictures of one that grows.
const EVERY: Duration = Duration::from_millis(400);
/// The sides are divided by this number while something moves.
const MOVING: u32 = 3;

/// Renders requests for the path tracer in one scene. Returns the first request for something else; `None` if the window closes.
///
/// # Errors
/// Any error of the path tracer.
pub(super) fn work(shared: &Shared, gpu: &Gpu, painter: &mut Painter, first: Wanted) -> Result<Option<Wanted>> {
    shared.does(Doing::Preparing("the path tracer".into(), None));
    let stage = first.stage.clone();
    let (pose, _) = first.placed(first.size)?;
    let mut tracer = Tracer::new(gpu, &stage.scene, &pose)?;
    let mut wanted = first.clone();
    // The last request is finished, so another look at it needs no paths.
    let mut finished: Option<Wanted> = None;
    loop {
        let again = finished.take().is_some_and(|before| before.same_light(&wanted));
        match grow(shared, painter, &mut tracer, &wanted, again) {
            Ok(done) => finished = done.then(|| wanted.clone()),
            Err(error) if error.kind() == lucerna::ErrorKind::DeviceLost => return Err(error),
            Err(error) => shared.fail(error),
        }
        wanted = match shared.next() {
            Some(next) if next.same_scene(&first) => next,
            other => return Ok(other),
        };
    }
}

/// Adds paths until there are enough, or a newer request is there. True: enough.
fn grow(shared: &Shared, painter: &mut Painter, tracer: &mut Tracer<'_>, wanted: &Wanted, again: bool) -> Result<bool> {
    let begun = Instant::now();
    let settings: Staged<PictureSettings> =
        Staged::recorded(&wanted.settings, &PictureSettings::default(), PictureSettings::validate)?;
    let part = |side: u32| if wanted.moving { side.div_ceil(MOVING) } else { side };
    let size = Size { width: part(wanted.size.width), height: part(wanted.size.height) };
    if !again {
        let (pose, view) = wanted.placed(size)?;
        tracer.set_pose(&pose);
        tracer.start(&view, &settings.technique.reference)?;
    }
    let whole = if wanted.moving { 1 } else { wanted.samples.max(1) };
    let mut samples = tracer.progress()?.samples;
    if !again {
        // One path a pixel first, so that there is a picture soon.
        tracer.run(1, |_| true)?;
    }
    loop {
        let progress = tracer.progress()?;
        let done = progress.samples >= whole as f64;
        if again || progress.samples > samples || done {
            samples = progress.samples;
            show(shared, painter, tracer, wanted, (samples, done && !wanted.moving, size == wanted.size), begun)?;
        }
        if done || shared.is_old() {
            return Ok(done && !wanted.moving);
        }
        shared.does(Doing::Rendering((progress.samples / whole as f64).min(1.0)));
        let since = Instant::now();
        tracer.run(whole, |_| since.elapsed() < EVERY && !shared.is_old())?;
    }
}

fn show(
    shared: &Shared,
    painter: &mut Painter,
    tracer: &Tracer<'_>,
    wanted: &Wanted,
    (samples, finished, whole): (f64, bool, bool),
    begun: Instant,
) -> Result<()> {
    let sums = tracer.sums()?;
    let layers = sums.layers();
    let ev = wanted.exposure.or_else(|| exposure::of_source(&wanted.stage.source));
    let ev = ev.unwrap_or_else(|| exposure::fitting(&layers));
    let is_light = wanted.shows == Shows::Picture;
    let pixels = painter.codes(wanted, &layers, is_light, ev)?;
    shared.show(Shown {
        number: 0,
        size: Size { width: layers.width, height: layers.height },
        pixels,
        layers: Arc::new(layers),
        exposure: ev,
        finished,
        whole,
        of: wanted.clone(),
        milliseconds: begun.elapsed().as_secs_f64() * 1e3,
        passes: Arc::default(),
        images: Arc::default(),
        notes: tracer.notes().iter().map(|note| format!("{}: {}", note.place, note.text)).collect(),
        samples,
        noise: Some(sums.relative_error()).filter(|error| error.is_finite()),
        at: Instant::now(),
    });
    Ok(())
}
