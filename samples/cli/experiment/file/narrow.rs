//! A part of an experiment, chosen on the command line: some of its scenes, or pictures of another size.

use std::fmt;

use lucerna::{Error, Result};
use serde::{Deserialize, Serialize};

use super::Experiment;
use crate::{args::Size, config, shell};

/// What is left of an experiment, and what is changed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Narrowed {
    /// Size of all pictures, WIDTHxHEIGHT.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<String>,
    /// The scenes that are left; empty: all.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub scenes: Vec<String>,
}

impl Narrowed {
    pub fn new(size: Option<Size>, scenes: &[String]) -> Self {
        Self { size: size.map(|size| size.to_string()), scenes: scenes.to_vec() }
    }

    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

/// The options of the command line that narrow an experiment so.
impl fmt::Display for Narrowed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let size = self.size.iter().flat_map(|size| ["--size", size]);
        let scenes = self.scenes.iter().flat_map(|scene| ["--scene", scene]);
        f.write_str(&shell::line(size.chain(scenes)))
    }
}

impl Experiment {
    /// The part of a whole experiment.
    ///
    /// # Errors
    /// `Usage` if a scene is unknown; `Input` if the size cannot be read.
    pub fn narrow(mut self, narrowed: &Narrowed) -> Result<Self> {
        if let Some(size) = &narrowed.size {
            self.size = size.parse().map_err(|what| Error::input(format!("size: {what}")))?;
            self.scenes.iter_mut().for_each(|scene| scene.sizes.clear());
        }
        let names: Vec<&str> = self.scenes.iter().map(|scene| scene.name.as_str()).collect();
        if let Some(wanted) = narrowed.scenes.iter().find(|wanted| !names.contains(&wanted.as_str())) {
            let hint = config::nearest(wanted, names.iter().copied()).map(|name| format!(" (did you mean '{name}'?)"));
            let mode = if self.quick { " in its quick mode" } else { "" };
            let what = format!("--scene: the experiment has no scene '{wanted}'{mode}{}", hint.unwrap_or_default());
            return Err(Error::usage(what).help(format!("Name one of {}", names.join(", "))));
        }
        if !narrowed.scenes.is_empty() {
            self.scenes.retain(|scene| narrowed.scenes.contains(&scene.name));
        }
        self.narrowed = narrowed.clone();
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::file;

    #[test]
    fn a_part_of_an_experiment_has_the_scenes_and_the_size_that_were_asked_for() {
        let whole = || file::open("isr", false).unwrap();
        let scene = whole().scenes.last().unwrap().name.clone();
        let asked = Narrowed::new(Some(Size { width: 40, height: 30 }), std::slice::from_ref(&scene));
        assert_eq!(asked.to_string(), format!("--size 40x30 --scene {scene}"));
        let part = whole().narrow(&asked).unwrap();
        assert_eq!((part.size.to_string(), part.scenes.len(), &part.scenes[0].name), ("40x30".into(), 1, &scene));
        assert!(part.scenes[0].sizes.is_empty() && part.narrowed == asked);
        // The manifest keeps it.
        let kept: Narrowed = serde_json::from_value(config::to_value(&asked).unwrap()).unwrap();
        assert_eq!(kept, asked);
        let none = Narrowed::new(None, &[]);
        assert!(none.is_empty() && whole().narrow(&none).unwrap().scenes.len() == whole().scenes.len());
        let error = whole().narrow(&Narrowed::new(None, &[format!("{scene}x")])).unwrap_err().to_string();
        assert!(error.contains("did you mean") && error.contains(&scene), "{error}");
    }
}
