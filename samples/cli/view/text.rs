//! Passes in text in the window: they are read again when a file changes, their switches have keys, and a mistake leaves the last good ones.

use std::{collections::BTreeMap, path::Path, sync::Arc};

use lucerna::effects::Pipeline;
use serde_json::Value;

use super::{app::Viewer, session::Wake, side::Side, wanted::TRUTH, watch::Watch};
use crate::{config, effects};

/// A pipeline that follows side A.
pub(super) struct Followed {
    pub pipeline: Arc<Pipeline>,
    watches: Vec<Watch>,
    /// The mistake in the files as they are now.
    pub mistake: Option<String>,
}

impl Followed {
    pub fn new(pipeline: Arc<Pipeline>, wake: &Wake) -> Self {
        let watches = pipeline.files().iter().map(|file| Watch::start(file.clone(), wake.clone())).collect();
        Self { pipeline, watches, mistake: None }
    }

    /// Reads the files again if one of them has changed.
    fn renew(&mut self, wake: &Wake) {
        // All are asked: each forgets that it has changed.
        if self.watches.iter().filter(|watch| watch.changed()).count() == 0 {
            return;
        }
        match effects::read(&self.pipeline.path) {
            Ok(pipeline) => *self = Self::new(pipeline, wake),
            Err(error) => self.mistake = Some(error.to_string()),
        }
    }

    /// The settings of a side with this pipeline in them. Values that the pipeline still has stay as they are.
    fn in_settings(&self, settings: &Value) -> Option<Value> {
        let mut all = settings.as_object()?.clone();
        let before = all.get(effects::GROUP);
        if before.is_some_and(|group| group.get("digest").and_then(Value::as_str) == Some(self.pipeline.digest())) {
            return None;
        }
        let mut own = effects::Settings::of(&self.pipeline);
        for (name, value) in &mut own.values {
            if let Some(before) = before.and_then(|group| group.get(name))
                && self.pipeline.check(&BTreeMap::from([(name.clone(), before.clone())])).is_ok()
            {
                *value = before.clone();
            }
        }
        all.insert(effects::GROUP.to_owned(), config::to_value(&own).ok()?);
        Some(Value::Object(all))
    }
}

/// Whether passes may follow what a side shows.
fn has_passes(side: &Side) -> bool {
    side.technique != TRUTH && side.file.is_none()
}

/// Lets the passes of a file follow side A.
pub(super) fn follow(viewer: &mut Viewer, file: &Path) {
    match effects::read(file) {
        Ok(pipeline) => {
            viewer.say(format!("{} follows A", pipeline.title));
            viewer.followed = Some(Followed::new(pipeline, &viewer.wake));
        }
        Err(error) => viewer.trouble = Some(error.to_string()),
    }
}

/// Puts the passes into the settings of A, in each frame of the window: another technique begins without them.
pub(super) fn keep(viewer: &mut Viewer) {
    let Some(followed) = &mut viewer.followed else { return };
    let before = followed.pipeline.digest().to_owned();
    followed.renew(&viewer.wake);
    viewer.descriptions.of_effects(&followed.pipeline);
    if followed.pipeline.digest() != before {
        viewer.message =
            Some((format!("{} was read again", followed.pipeline.path.display()), std::time::Instant::now()));
    }
    let side = &mut viewer.sides[0];
    if has_passes(side) {
        // What is not at its default is marked by the panel.
        let defaults = serde_json::json!({ effects::GROUP: config::to_value(&effects::Settings::of(&followed.pipeline)).unwrap_or_default() });
        for (settings, only) in [(&mut side.settings, None), (&mut side.defaults, Some(defaults))] {
            if let Some(mut found) = followed.in_settings(settings) {
                if let Some(only) = only {
                    found[effects::GROUP] = only[effects::GROUP].clone();
                }
                *settings = Arc::new(found);
            }
        }
    }
}

/// Switches the constant of a key. False: no pipeline has this key.
pub(super) fn switched(viewer: &mut Viewer, key: &str) -> bool {
    let Some(followed) = &viewer.followed else { return false };
    let side = &mut viewer.sides[0];
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
