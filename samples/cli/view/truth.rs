//! The path tracer for a side of the window: a picture that grows while it is looked at.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use lucerna::{
    Result,
    gpu::Gpu,
    image::Layer,
    techniques::tonemap,
    tracer::{PictureSettings, Tracer},
};

use super::{
    live,
    painted::{Painter, Values},
    session::{Doing, Shared},
    wanted::{Shown, Shows, Wanted},
};
use crate::{
    args::Size,
    exposure,
    last_stage::{self, Staged},
    reference,
};

/// Time between two pictures of one that grows.
const EVERY: Duration = Duration::from_millis(400);
/// The sides are divided by this number while something moves.
const MOVING: u32 = 3;

/// The paths that were begun, for this request.
type Begun = Option<Wanted>;

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
    let mut begun: Begun = None;
    let mut matte = None;
    loop {
        let mut growing = Growing { shared, gpu, painter, tracer: &mut tracer, matte: &mut matte };
        let result = growing.grow(&wanted, &mut begun);
        if let Err(error) = result {
            begun = None;
            if gpu.is_lost() {
                return Err(error);
            }
            shared.fail(error);
        }
        wanted = match shared.next() {
            Some(next) if next.same_scene(&first) => next,
            other => return Ok(other),
        };
    }
}

/// Whether the paths of one request are those of another one: both may be shown in different ways, and with different numbers of paths.
fn same_paths(before: &Wanted, now: &Wanted) -> bool {
    let shown =
        Wanted { samples: before.samples, shows: before.shows.clone(), mode: before.mode.clone(), ..now.clone() };
    before.same_light(&shown)
}

/// The matte of the important objects, with their names and the size that it is for.
type Matte = Option<((String, u32, u32), Option<Layer>)>;

/// A picture that grows.
struct Growing<'a, 's> {
    shared: &'a Shared,
    gpu: &'a Gpu,
    painter: &'a mut Painter,
    tracer: &'a mut Tracer<'s>,
    matte: &'a mut Matte,
}

impl Growing<'_, '_> {
    /// Adds paths until there are enough, or a newer request is there.
    fn grow(&mut self, wanted: &Wanted, begun: &mut Begun) -> Result<()> {
        let since_request = Instant::now();
        let settings: Staged<PictureSettings> =
            Staged::recorded(&wanted.settings, &PictureSettings::default(), PictureSettings::validate)?;
        let part = |side: u32| if wanted.moving { side.div_ceil(MOVING) } else { side };
        let size = Size { width: part(wanted.size.width), height: part(wanted.size.height) };
        if !begun.as_ref().is_some_and(|before| same_paths(before, wanted)) {
            *begun = None;
            *self.matte = None;
            let (pose, view) = wanted.placed(size)?;
            self.tracer.set_pose(&pose);
            self.tracer.start(&view, &settings.technique.reference)?;
            // One path a pixel first, so that there is a picture soon.
            self.tracer.run(1, |_| true)?;
            *begun = Some(wanted.clone());
        }
        let whole = if wanted.moving { 1 } else { wanted.samples.max(1) };
        let mut shown = None;
        loop {
            let progress = self.tracer.progress()?;
            let done = progress.samples >= whole as f64;
            if shown.is_none_or(|shown| progress.samples > shown) {
                shown = Some(progress.samples);
                let state = (progress.samples, size == wanted.size);
                self.show(wanted, settings.tonemap.as_ref(), state, since_request)?;
            }
            if done || self.shared.is_old() {
                return Ok(());
            }
            self.shared.does(Doing::Rendering((progress.samples / whole as f64).min(1.0)));
            let since = Instant::now();
            let shared = self.shared;
            self.tracer.run(whole, |_| since.elapsed() < EVERY && !shared.is_old())?;
        }
    }

    fn show(
        &mut self,
        wanted: &Wanted,
        tonemap: Option<&tonemap::Settings>,
        (samples, whole): (f64, bool),
        begun: Instant,
    ) -> Result<()> {
        let sums = self.tracer.sums()?;
        let mut layers = sums.layers();
        reference::show(live::mode(&wanted.mode), &mut layers);
        let ev = wanted.exposure.or_else(|| exposure::of_source(&wanted.stage.source));
        let ev = ev.unwrap_or_else(|| if tonemap.is_some() { 0.0 } else { exposure::fitting(&layers) });
        if let Some(tonemap) = tonemap {
            let of = (tonemap.important.clone(), layers.width, layers.height);
            if self.matte.as_ref().is_none_or(|(by, _)| *by != of) {
                let (pose, view) = wanted.placed(Size { width: layers.width, height: layers.height })?;
                let matte = last_stage::matte(self.gpu, (&wanted.stage.scene, &pose), &view, Some(tonemap))?;
                *self.matte = Some((of, matte));
            }
            layers.layers.extend(self.matte.as_ref().and_then(|(_, matte)| matte.clone()));
            last_stage::still(self.gpu, tonemap, ev, &mut layers)?;
        }
        let values = Values::of(wanted, wanted.shows == Shows::Picture);
        let pixels = self.painter.codes(wanted, &layers, values, ev)?;
        self.shared.show(Shown {
            number: 0,
            size: Size { width: layers.width, height: layers.height },
            pixels,
            layers: Arc::new(layers),
            exposure: ev,
            fresh: true,
            whole,
            of: wanted.clone(),
            milliseconds: begun.elapsed().as_secs_f64() * 1e3,
            passes: Arc::default(),
            images: Arc::default(),
            notes: self.tracer.notes().iter().map(ToString::to_string).collect(),
            samples,
            noise: Some(sums.relative_error()).filter(|error| error.is_finite()),
            at: Instant::now(),
        });
        Ok(())
    }
}
