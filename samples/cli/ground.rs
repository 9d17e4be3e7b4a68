//! `--ground`: one or several copies of the scene, and of other scenes, on a plain ground.

use std::path::{Path, PathBuf};

use lucerna::{
    Result,
    scene::{
        Scene,
        ground::{self, Ground},
    },
};
use lucerna_scenes as builtin;
use serde::{Deserialize, Serialize};

use crate::{args::finite, args::positive, source};

/// `--ground` and its further options.
#[derive(clap::Args, Clone, Debug, Default, PartialEq)]
pub struct GroundArgs {
    /// Put the scene on a plain ground, with three cameras: front, above, ground (which sees only the ground)
    #[arg(long, help_heading = "Ground")]
    pub ground: bool,

    #[command(flatten)]
    pub options: GroundOptions,
}

/// Arrangement of the objects on the ground, for the command line and for experiment files.
#[derive(clap::Args, Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GroundOptions {
    /// Number of copies of each scene [default: 1]
    #[arg(long, value_name = "N", requires = "ground", help_heading = "Ground")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub copies: Option<u32>,

    /// Another scene, which alternates with the first one: a file, or a built-in scene or object (hare, queen, tree, pot); may be given more
    /// than once
    #[arg(long, value_name = "SCENE", requires = "ground", help_heading = "Ground")]
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub beside: Vec<PathBuf>,

    /// Scale each object to this height, metres [default: unscaled]
    #[arg(long, value_name = "METRES", requires = "ground", value_parser = positive, help_heading = "Ground")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height: Option<f64>,

    /// Share of an object's height below the ground; an object with a negative share floats [default: 0]
    #[arg(long, value_name = "SHARE", requires = "ground", value_parser = finite, allow_negative_numbers = true, help_heading = "Ground")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sunk: Option<f64>,

    /// Distance between neighbours, in widths of the widest object [default: 0.4]
    #[arg(long, value_name = "WIDTHS", requires = "ground", value_parser = finite, allow_negative_numbers = true, help_heading = "Ground")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gap: Option<f64>,

    /// Height of the ground's waves, in heights of the highest object [default: 0]
    #[arg(long, value_name = "HEIGHTS", requires = "ground", value_parser = finite, help_heading = "Ground")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub waves: Option<f64>,

    /// Phase of the waves, 0 to 1 [default: 0]
    #[arg(long, value_name = "SHARE", requires = "ground", value_parser = finite, help_heading = "Ground")]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phase: Option<f64>,
}

impl GroundArgs {
    /// Puts a scene on the ground if `--ground` is given.
    ///
    /// # Errors
    /// As [`GroundOptions::place`].
    pub fn place(&self, scene: Scene, unit: Option<f64>) -> Result<Scene> {
        if self.ground { self.options.place(scene, unit, |path| Ok(path.to_path_buf())) } else { Ok(scene) }
    }
}

impl GroundOptions {
    /// Puts a scene on the ground. `found`: resolves the path of a file.
    ///
    /// # Errors
    /// `Usage` for numbers out of range, `Input` for files that cannot be read and scenes without triangles.
    pub fn place(&self, scene: Scene, unit: Option<f64>, found: impl Fn(&Path) -> Result<PathBuf>) -> Result<Scene> {
        let defaults = Ground::default();
        let number = |value: Option<f64>, default: f32| value.map_or(default, |value| value as f32);
        let ground = Ground {
            copies: self.copies.unwrap_or(defaults.copies),
            height: self.height.map(|height| height as f32),
            sunk: number(self.sunk, defaults.sunk),
            gap: number(self.gap, defaults.gap),
            waves: number(self.waves, defaults.waves),
            phase: number(self.phase, defaults.phase),
        };
        // Checked before the files are read, which may take long.
        ground.check(1 + self.beside.len())?;
        let mut things = vec![scene];
        for path in &self.beside {
            let options = source::in_unit(unit);
            let (thing, _) = match built_in(path) {
                Some(name) => source::open(None, Some(name), &options)?,
                None => source::open(Some(&found(path)?), None, &options)?,
            };
            things.push(thing);
        }
        ground::on_ground(&things, &ground)
    }

    /// The files to read.
    pub fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.beside.iter().filter(|path| built_in(path).is_none())
    }
}

/// The path as the name of a built-in scene or object, if it is one.
fn built_in(path: &Path) -> Option<&str> {
    path.to_str().filter(|name| builtin::description(name).is_some())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_from_files_and_from_code_stand_in_turns() {
        let options: GroundOptions =
            serde_json::from_value(serde_json::json!({ "copies": 2, "beside": ["tree"], "height": 0.5 })).unwrap();
        let hare = builtin::load("hare").unwrap();
        let scene = options.place(hare, None, |path| Ok(path.to_path_buf())).unwrap();
        let names: Vec<&str> = scene.nodes.iter().filter(|n| n.mesh.is_some()).map(|n| n.name.as_str()).collect();
        assert_eq!(names, ["ground", "hare", "tree", "hare", "tree"]);
        assert_eq!(options.files().count(), 0);
        let missing = GroundOptions { beside: vec!["no/such.obj".into()], ..options };
        assert_eq!(missing.files().count(), 1);
        let error = missing.place(builtin::load("hare").unwrap(), None, |p| Ok(p.to_path_buf())).unwrap_err();
        assert_eq!(error.exit_code(), 3);
    }
}
