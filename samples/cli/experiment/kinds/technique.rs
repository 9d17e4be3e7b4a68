//! The kinds that are techniques of the engine.

use lucerna::{
    Result,
    graph::Runner,
    technique::{Ready, Settings, Shot, Technique},
};
use serde_json::Value;

use super::{Job, Kind, Rendered, Warm, on_device, read};
use crate::{config, experiment::file::Changes, render};

/// Maximum number of preparations of a technique for one scene that stay in memory. Variants often alternate between two.
const KEPT: usize = 2;

/// The kind of a technique.
pub(super) const fn of<T: Technique + 'static>() -> Kind {
    Kind {
        name: T::NAME,
        description: T::ABOUT,
        on_device: true,
        of_images: false,
        settings: settings::<T>,
        render: picture::<T>,
        available: || Ok(String::new()),
    }
}

fn settings<T: Technique>(paper: bool, changes: &Changes) -> Result<Value> {
    let base = if paper { render::paper::<T>()? } else { T::Settings::default() };
    let settings: T::Settings = config::with(&base, changes)?;
    settings.validate()?;
    config::to_value(&settings)
}

/// A technique that is prepared for a scene, and the settings that it is prepared by.
struct Kept<T: Technique> {
    by: T::Settings,
    ready: Ready<T>,
    runner: Runner,
}

pub(super) fn picture<T: Technique + 'static>(warm: &mut Warm<'_>, job: &Job<'_>) -> Result<Option<Rendered>> {
    let settings: T::Settings = read(job.settings)?;
    let (scene, pose, by) = (warm.scene, warm.pose, T::prepared_by(&settings));
    let gpu = warm.gpu;
    let list: &mut Vec<Kept<T>> = warm.keep(T::NAME, |_, _, _| Ok(Vec::new()))?;
    let index = match list.iter().position(|kept| kept.by == by) {
        Some(index) => index,
        None => {
            // The oldest is dropped before the next is made, so that memory never holds more.
            list.truncate(KEPT - 1);
            let ready = match Ready::new(gpu, scene, &by, None, &mut |_, _| !job.interrupt.requested()) {
                Err(_) if job.interrupt.requested() => return Ok(None),
                ready => ready?,
            };
            list.insert(0, Kept { by, ready, runner: Runner::new(gpu) });
            0
        }
    };
    let Kept { ready, runner, .. } = &mut list[index];
    on_device(runner, job, T::NAME, |graph| ready.frame(graph, (scene, pose), job.view, Shot::default(), &settings))
}
