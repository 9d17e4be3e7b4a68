//! `--add`: objects that stand in the scene besides what its file has.

use std::{fmt, path::Path, str::FromStr};

use glam::Vec3;
use lucerna::{
    Result,
    scene::{
        LoadOptions, Scene,
        added::{self, MOST_SCALE, Standing},
    },
};
use serde::{Deserialize, Serialize};

use crate::{as_text::as_text, source};

/// Before the name of a built-in scene or object.
const BUILT_IN: &str = "builtin:";

/// An object and its place: `FILE@X,Y,Z[,SCALE[,TURN]]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Added {
    /// A file, or a built-in scene or object after `builtin:`.
    what: String,
    foot: Vec3,
    scale: f32,
    /// Degrees.
    turn: f32,
}

impl FromStr for Added {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            "expected FILE@X,Y,Z[,SCALE[,TURN]] or builtin:NAME@X,Y,Z[,SCALE[,TURN]], like pot.glb@1,0,-2,0.5,90"
                .to_owned()
        };
        // Names of files may contain the sign as well.
        let (what, numbers) = text.rsplit_once('@').ok_or_else(wrong)?;
        if what.is_empty() || what == BUILT_IN {
            return Err(wrong());
        }
        let one = |word: &str| {
            let number = word.trim().parse().ok().filter(|number: &f32| number.is_finite());
            number.ok_or_else(|| format!("'{word}' is not a number; {}", wrong()))
        };
        let numbers = numbers.split(',').map(one).collect::<Result<Vec<f32>, String>>()?;
        let (foot, scale, turn) = match numbers[..] {
            [x, y, z] => ([x, y, z], 1.0, 0.0),
            [x, y, z, scale] => ([x, y, z], scale, 0.0),
            [x, y, z, scale, turn] => ([x, y, z], scale, turn),
            _ => return Err(format!("{} numbers after the @; {}", numbers.len(), wrong())),
        };
        if !(1.0 / MOST_SCALE..=MOST_SCALE).contains(&scale) {
            return Err(format!("the scale is {scale}; allowed: {} to {MOST_SCALE}", 1.0 / MOST_SCALE));
        }
        Ok(Self { what: what.to_owned(), foot: Vec3::from(foot), scale, turn })
    }
}

impl fmt::Display for Added {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { what, foot: Vec3 { x, y, z }, scale, turn } = self;
        write!(f, "{what}@{x},{y},{z},{scale},{turn}")
    }
}

as_text!(Added);

impl Added {
    /// The file that is read; `None` for built-in objects.
    pub fn file(&self) -> Option<&Path> {
        (!self.what.starts_with(BUILT_IN)).then(|| Path::new(&self.what))
    }

    fn add(&self, scene: &mut Scene, options: &LoadOptions) -> Result<()> {
        let (object, _) = source::open(self.file(), self.what.strip_prefix(BUILT_IN), options)?;
        let standing = Standing { foot: self.foot, scale: self.scale, turn: self.turn };
        added::add(scene, object, &standing).map_err(|error| match self.file() {
            Some(file) => error.in_file(file),
            None => error,
        })
    }
}

/// Adds all objects in order.
///
/// # Errors
/// `Input` for a file that cannot be read or has no triangles, `Usage` for a built-in object that does not exist.
pub fn all(scene: &mut Scene, list: &[Added], options: &LoadOptions) -> Result<()> {
    list.iter().try_for_each(|one| one.add(scene, options).map_err(|error| error.at("--add")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_read_and_written() {
        let read = |text: &str| text.parse::<Added>();
        let full = read("a@b,c.glb@1,-0.5,2e-1,0.25,-90").unwrap();
        assert_eq!(full.file(), Some(Path::new("a@b,c.glb")));
        assert_eq!((full.foot, full.scale, full.turn), (Vec3::new(1.0, -0.5, 0.2), 0.25, -90.0));
        assert_eq!(read(&full.to_string()).unwrap(), full);
        let short = read("builtin:pot@0, 0, 0").unwrap();
        assert_eq!((short.file(), short.scale, short.turn), (None, 1.0, 0.0));
        assert_eq!(read(&short.to_string()).unwrap(), short);
        for (bad, said) in [
            ("pot.glb", "expected FILE@"),
            ("@1,2,3", "expected FILE@"),
            ("builtin:@1,2,3", "expected FILE@"),
            ("pot.glb@1,2", "2 numbers"),
            ("pot.glb@1,2,3,4,5,6", "6 numbers"),
            ("pot.glb@1,2,x", "'x' is not a number"),
            ("pot.glb@1,2,nan", "'nan' is not a number"),
            ("pot.glb@1,2,3,0", "the scale is 0"),
            ("pot.glb@1,2,3,-1", "the scale is -1"),
        ] {
            let error = read(bad).unwrap_err();
            assert!(error.contains(said), "{bad}: {error}");
        }
    }

    #[test]
    fn missing_objects_are_named() {
        let mut scene = Scene::default();
        for (text, code, said) in [("no/such.glb@0,0,0", 3, "no/such.glb"), ("builtin:kettle@0,0,0", 2, "kettle")] {
            let error = all(&mut scene, &[text.parse().unwrap()], &LoadOptions::default()).unwrap_err();
            assert_eq!((error.exit_code(), error.place()), (code, Some("--add")), "{error}");
            assert!(error.to_string().contains(said), "{error}");
        }
    }
}
