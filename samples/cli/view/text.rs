//! Pipelines in text in the window: a pipeline is read again when one of its files changes, its switches have keys, and a mistake leaves the last good
//! version.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::{Arc, mpsc},
};

use lucerna::{
    Result,
    effects::{Pipeline, Values},
};
use serde_json::Value;

use super::{app::Viewer, files::answered, session::Wake, side::Side, wanted::TRUTH, watch::Watch};
use crate::{config, effects};

/// A pipeline that follows a side.
pub(super) struct Followed {
    pub pipeline: Arc<Pipeline>,
    watches: Vec<Watch>,
    /// The mistake in the files as they are now.
    pub mistake: Option<String>,
    /// The defaults of the version before this one.
    before: Option<Values>,
}

/// A pipeline that a thread reads and compiles, which takes longer than a frame of the window.
pub(super) struct Compiling {
    path: PathBuf,
    /// From before the reading, so that no change is missed.
    watches: Vec<Watch>,
    receiver: mpsc::Receiver<Result<Arc<Pipeline>>>,
}

impl Followed {
    /// A pipeline that was read already.
    pub fn new(pipeline: Arc<Pipeline>, wake: &Wake) -> Self {
        let watches = watched(&pipeline.path, wake);
        Self { pipeline, watches, mistake: None, before: None }
    }

    /// Whether a file has changed since the last question.
    fn is_old(&self) -> bool {
        // All are asked: each forgets that it has changed.
        self.watches.iter().filter(|watch| watch.changed()).count() > 0
    }

    /// The settings of a side with this pipeline in them; `None`: they have it already. Values that were changed by hand stay as they are.
    fn in_settings(&self, settings: &Value) -> Option<Value> {
        let mut all = settings.as_object()?.clone();
        let before = all.get(effects::GROUP).filter(|group| !group.is_null());
        let text = |key: &str| before.and_then(|group| group.get(key)).and_then(Value::as_str).unwrap_or_default();
        if text("digest") == self.pipeline.digest() {
            return None;
        }
        let mut own = effects::Settings::of(&self.pipeline);
        let same = text("pipeline") == own.pipeline;
        for (name, value) in own.values.iter_mut().filter(|_| same) {
            let old = self.before.as_ref().and_then(|before| before.get(name));
            if let Some(found) = before.and_then(|group| group.get(name)).filter(|found| Some(*found) != old)
                && self.pipeline.check(&BTreeMap::from([(name.clone(), found.clone())])).is_ok()
            {
                *value = found.clone();
            }
        }
        if !same {
            // What the file says of the technique is where it begins.
            let begins = serde_json::to_value(&self.pipeline.settings).unwrap_or_default();
            for (group, values) in begins.as_object().into_iter().flatten() {
                match (all.get_mut(group), values) {
                    (Some(Value::Object(known)), Value::Object(values)) => {
                        for (key, value) in values {
                            known.get_mut(key).into_iter().for_each(|known| known.clone_from(value));
                        }
                    }
                    (None | Some(Value::Null), values) if group == "tonemap" => {
                        all.insert(group.clone(), values.clone());
                    }
                    _ => (),
                }
            }
        }
        all.insert(effects::GROUP.to_owned(), config::to_value(&own).ok()?);
        Some(Value::Object(all))
    }
}

fn watched(path: &Path, wake: &Wake) -> Vec<Watch> {
    Pipeline::files_of(path).into_iter().map(|file| Watch::start(file, wake.clone())).collect()
}

/// Whether passes may follow what a side shows.
fn has_passes(side: &Side) -> bool {
    side.technique != TRUTH && side.file.is_none()
}

/// Lets the pipeline of a file follow side A as soon as it is compiled.
pub(super) fn follow(viewer: &mut Viewer, path: PathBuf) {
    let watches = watched(&path, &viewer.wake);
    let of_thread = path.clone();
    let compiled = viewer.on_thread(move || effects::read(&of_thread));
    viewer.compiling = compiled.map(|receiver| Compiling { path, watches, receiver });
}

/// Takes a pipeline that was compiled. The same file again stays at its side.
fn take(viewer: &mut Viewer) {
    let Some(answer) = viewer.compiling.as_ref().and_then(|compiling| answered(&compiling.receiver)) else { return };
    let Some(Compiling { path, watches, .. }) = viewer.compiling.take() else { return };
    let known = viewer.followed.as_mut().filter(|followed| followed.pipeline.path == path);
    match (answer, known) {
        (Ok(pipeline), Some(followed)) => {
            let before = Some(followed.pipeline.defaults());
            *followed = Followed { pipeline, watches, mistake: None, before };
            viewer.say(format!("{} was read again", path.display()));
        }
        (Ok(pipeline), None) => {
            let side = if has_passes(&viewer.sides[0]) { "A" } else { "A as soon as A shows a technique" };
            viewer.say(format!("{} follows {side}", pipeline.title));
            viewer.followed = Some(Followed { pipeline, watches, mistake: None, before: None });
            viewer.followed_side = 0;
        }
        (Err(error), Some(followed)) => {
            followed.mistake = Some(error.to_string());
            // A faulty version may name other files.
            followed.watches = watches;
        }
        (Err(error), None) => viewer.trouble = Some(error.to_string()),
    }
}

/// Puts the passes into the settings of their side, in each frame of the window: another technique begins without them.
pub(super) fn keep(viewer: &mut Viewer) {
    take(viewer);
    // One pipeline at a time: another one that was dropped is not replaced. The watches stay unread until then.
    let idle = viewer.compiling.is_none();
    if let Some(followed) = viewer.followed.as_ref().filter(|followed| idle && followed.is_old()) {
        let path = followed.pipeline.path.clone();
        follow(viewer, path);
    }
    let Some(followed) = &viewer.followed else { return };
    viewer.descriptions.of_effects(&followed.pipeline);
    let side = &mut viewer.sides[viewer.followed_side];
    if has_passes(side) {
        for (settings, is_default) in [(&mut side.settings, false), (&mut side.defaults, true)] {
            if let Some(mut found) = followed.in_settings(settings) {
                if is_default {
                    // What is not at its default is marked by the panel.
                    let own = effects::Settings::of(&followed.pipeline);
                    found[effects::GROUP] = config::to_value(&own).unwrap_or_default();
                }
                *settings = Arc::new(found);
            }
        }
    }
}

/// Switches the constant of a key. False: no pipeline has this key.
pub(super) fn switched(viewer: &mut Viewer, key: &str) -> bool {
    let Some(followed) = &viewer.followed else { return false };
    let side = &mut viewer.sides[viewer.followed_side];
    let Some(constant) = followed.pipeline.constants.iter().find(|constant| constant.key.as_deref() == Some(key))
    else {
        return false;
    };
    let mut settings = (*side.settings).clone();
    if let Some(value) = settings.get_mut(effects::GROUP).and_then(|group| group.get_mut(&constant.name)) {
        *value = Value::Bool(value.as_bool() != Some(true));
        let text = format!("{} {}", constant.name, if *value == true { "on" } else { "off" });
        side.settings = Arc::new(settings);
        viewer.say(text);
    } else {
        viewer.say(format!("{} switches passes, but this side has none", constant.name));
    }
    true
}

/// The words of a command that make the passes of a side.
pub(super) fn words(side: &Side) -> Vec<String> {
    let Some(group) = side.settings.get(effects::GROUP).filter(|_| has_passes(side)) else { return Vec::new() };
    let Some(file) = group.get("pipeline").and_then(Value::as_str) else { return Vec::new() };
    let mut out = vec!["--effects".to_owned(), file.to_owned()];
    let defaults = side.defaults.get(effects::GROUP);
    for (name, value) in group.as_object().into_iter().flatten() {
        if name != "pipeline" && name != "digest" && defaults.and_then(|group| group.get(name)) != Some(value) {
            out.extend(["-D".to_owned(), format!("{}.{name}={value}", effects::GROUP)]);
        }
    }
    out
}
