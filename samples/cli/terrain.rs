//! `--terrain`: land from a height map.

use std::{fmt, path::Path, str::FromStr};

use glam::Vec3;
use lucerna::{
    Result,
    scene::{
        Limits, Scene,
        terrain::{self, HeightMap},
    },
};
use serde::{Deserialize, Serialize};

use crate::as_text::as_text;

/// A height map and its place: `FILE[@WIDTH[,HEIGHT[,ERROR[,X,Y,Z]]]]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Terrain {
    file: String,
    width: Option<f32>,
    height: Option<f32>,
    error: Option<f32>,
    middle: Vec3,
}

impl FromStr for Terrain {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "expected FILE[@WIDTH[,HEIGHT[,ERROR[,X,Y,Z]]]], like hills.png@2000,300".to_owned();
        // Names of files may contain the sign as well.
        let (file, numbers) = match text.rsplit_once('@') {
            Some((file, numbers))
                if numbers.split(',').next().is_some_and(|word| word.trim().parse::<f32>().is_ok()) =>
            {
                (file, numbers.split(',').collect())
            }
            _ => (text, Vec::new()),
        };
        if file.is_empty() {
            return Err(wrong());
        }
        let one = |word: &&str| {
            let number = word.trim().parse().ok().filter(|number: &f32| number.is_finite());
            number.ok_or_else(|| format!("'{word}' is not a number; {}", wrong()))
        };
        let numbers = numbers.iter().map(one).collect::<Result<Vec<f32>, String>>()?;
        if !matches!(numbers.len(), 0..=3 | 6) {
            return Err(format!("{} numbers after the @; {}", numbers.len(), wrong()));
        }
        let number = |index: usize| numbers.get(index).copied();
        let middle = numbers.get(3..6).map_or(Vec3::ZERO, Vec3::from_slice);
        let found = Self { file: file.to_owned(), width: number(0), height: number(1), error: number(2), middle };
        found.check().map_err(|error| error.to_string())?;
        Ok(found)
    }
}

impl fmt::Display for Terrain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, width, height, error, middle } = self;
        let mut numbers: Vec<f32> = [width, height, error].into_iter().map_while(|number| *number).collect();
        // The place follows only where all numbers before it are given.
        if numbers.len() == 3 {
            numbers.extend(middle.to_array());
        }
        let numbers: Vec<String> = numbers.iter().map(f32::to_string).collect();
        write!(f, "{file}")?;
        if numbers.is_empty() { Ok(()) } else { write!(f, "@{}", numbers.join(",")) }
    }
}

as_text!(Terrain);

impl Terrain {
    /// The height map.
    pub fn file(&self) -> &Path {
        Path::new(&self.file)
    }

    /// Checks the numbers that are given.
    fn check(&self) -> Result<()> {
        let Self { width, height, error, middle, .. } = *self;
        let given = terrain::Terrain {
            width: width.unwrap_or(1.0),
            height: height.unwrap_or(0.0),
            error: error.unwrap_or(0.0),
            middle,
        };
        given.check()
    }

    /// Adds the terrain to a scene.
    ///
    /// # Errors
    /// `Input` for a file that cannot be read or is no height map; `Usage` for numbers out of range.
    pub fn add(&self, scene: &mut Scene) -> Result<()> {
        let limits = Limits::default();
        let (map, notes) = HeightMap::read(self.file(), &limits).map_err(|error| error.at("--terrain"))?;
        scene.notes.extend(notes);
        let usual = terrain::Terrain::of(&map, self.width, self.height, self.error);
        let numbers = terrain::Terrain { middle: self.middle, ..usual };
        terrain::add(scene, &map, &numbers, &limits).map_err(|error| error.in_file(self.file()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terrains_are_read_and_written() {
        let read = |text: &str| text.parse::<Terrain>();
        for text in ["hills.png", "a@b.png", "hills.png@2000", "hills.png@2000,300", "a@b.png@20,-3,0.5,1,2,-3"] {
            let found = read(text).unwrap();
            assert_eq!(found.to_string(), text);
            assert_eq!(read(&found.to_string()).unwrap(), found);
        }
        let short = read("hills.png@2000,300,1").unwrap();
        assert_eq!(short.to_string(), "hills.png@2000,300,1,0,0,0");
        assert_eq!(read(&short.to_string()).unwrap(), short);
        assert_eq!(read("hills@2x.png").unwrap().file(), Path::new("hills@2x.png"));
        for (bad, said) in [
            ("", "expected FILE"),
            ("@20", "expected FILE"),
            ("a.png@1,2,3,4", "4 numbers"),
            ("a.png@1,x", "'x' is not a number"),
            ("a.png@0", "the width"),
            ("a.png@10,1e9", "the height"),
            ("a.png@10,1,-1", "the error"),
        ] {
            let error = read(bad).unwrap_err();
            assert!(error.contains(said), "{bad}: {error}");
        }
        let error = read("no/such.png").unwrap().add(&mut Scene::default()).unwrap_err();
        assert_eq!((error.exit_code(), error.place()), (3, Some("--terrain")), "{error}");
    }
}
