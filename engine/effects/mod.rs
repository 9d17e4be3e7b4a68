//! Post-processing pipelines in text: passes after a technique, described by a TOML file and shaders beside it, compiled while the program runs.
//!
//! [`Pipeline::read`] reads the file, compiles the shaders with the compiler that built the engine's own, and reads their interfaces. [`Pipeline::frame`]
//! declares the passes in a graph, so they get the same plan, barriers and checks as passes in Rust. A binding is found by its name: an image of the
//! pipeline, an image of the technique's graph, or what the pass names for it. Push constants are the constants of the file, by their names too.
//! `docs/effects.md` is the guide.
//!
//! ```toml
//! title = "Sepia"
//!
//! [constants.strength]
//! default = 1.0
//! least = 0.0
//! most = 1.0
//!
//! [[pass]]
//! shader = "sepia.frag"   # samples `picture`, writes one colour
//! out = "picture"
//! ```

mod file;
mod frame;
mod program;
#[cfg(test)]
mod tests;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde_json::Value;

use crate::{
    Error, Result,
    settings::{Allowed, Decides, Description, Key, Kind},
};
use program::Program;

/// The name by which passes read the picture so far, and by which they write the next one.
pub const PICTURE: &str = "picture";

/// Values of constants by their names.
pub type Values = BTreeMap<String, Value>;

/// A constant of a pipeline: a setting with a name, which shaders read as a push constant.
#[derive(Clone, Debug, PartialEq)]
pub struct Constant {
    pub name: String,
    pub doc: String,
    pub unit: String,
    /// A number, a whole number, a switch, or a list of 2 to 4 numbers.
    pub default: Value,
    /// The smallest and the largest number allowed.
    pub range: [Option<f64>; 2],
    /// The key of the viewer that turns a switch on and off, as `F6`.
    pub key: Option<String>,
}

/// Passes that follow a technique.
#[derive(Clone, Debug)]
pub struct Pipeline {
    /// The file.
    pub path: PathBuf,
    pub title: String,
    pub doc: String,
    /// The technique that the pipeline is made for.
    pub technique: Option<String>,
    /// Settings of the technique and of tone mapping, as a settings file has them.
    pub settings: toml::Table,
    /// In the order of the file.
    pub constants: Vec<Constant>,
    images: BTreeMap<String, OwnImage>,
    passes: Vec<Pass>,
    /// All files that were read, with those that shaders include.
    files: Vec<PathBuf>,
    digest: String,
}

/// An image that the pipeline declares.
#[derive(Clone, Debug)]
struct OwnImage {
    format: crate::graph::Format,
    size: Size,
    mips: bool,
    history: bool,
}

#[derive(Clone, Copy, Debug)]
enum Size {
    /// Of the picture's size.
    Share(f64),
    Pixels([u32; 2]),
}

#[derive(Clone, Debug)]
struct Pass {
    name: String,
    /// Line in the file.
    line: usize,
    work: Work,
    /// Images by the names of bindings.
    bind: BTreeMap<String, Source>,
    /// Images that are written, by location.
    out: Vec<String>,
    /// Values in the place of constants.
    values: Values,
    /// Switches that must be on, or off.
    when: Vec<(String, bool)>,
}

#[derive(Clone, Debug)]
enum Work {
    Shader(Program),
    /// Smaller levels of an image.
    Mips,
    /// A Gaussian of so many texels to each side.
    Blur(Number),
    /// An image scaled to the size of another one.
    Scale,
}

/// A number, or the name of a constant.
#[derive(Clone, Debug)]
enum Number {
    Fixed(f64),
    Constant(String),
}

/// What a binding reads.
#[derive(Clone, Debug)]
struct Source {
    image: String,
    sampler: crate::graph::Sampler,
    mip: Option<u32>,
}

impl Source {
    fn plain(image: &str) -> Self {
        Self { image: image.to_owned(), sampler: crate::graph::Sampler::Linear, mip: None }
    }
}

impl Pipeline {
    /// Reads a pipeline and compiles its shaders.
    ///
    /// # Errors
    /// `Input`, naming file, line, what was found and what is allowed; for a shader the compiler's message with file and line.
    pub fn read(path: &Path) -> Result<Self> {
        file::read(path)
    }

    /// The file, the shaders and what they include.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// Digest of the contents of all files, as hexadecimal digits.
    pub fn digest(&self) -> &str {
        &self.digest
    }

    /// The digest that the pipeline of a file would have. Nothing is compiled.
    ///
    /// # Errors
    /// `Input` if a file cannot be read.
    pub fn digest_of(path: &Path) -> Result<String> {
        file::digest(path)
    }

    /// The files that a pipeline is made of, as far as its texts name them; also with mistakes in it, and also those that are not there.
    pub fn files_of(path: &Path) -> Vec<PathBuf> {
        file::gathered(path).map_or_else(|_| vec![path.to_owned()], |all| all.into_keys().collect())
    }

    /// The defaults of all constants.
    pub fn defaults(&self) -> Values {
        self.constants.iter().map(|constant| (constant.name.clone(), constant.default.clone())).collect()
    }

    /// The constant of this name.
    pub fn constant(&self, name: &str) -> Option<&Constant> {
        self.constants.iter().find(|constant| constant.name == name)
    }

    /// Checks values: each is a constant of the pipeline, of its type and in its range.
    ///
    /// # Errors
    /// `Usage`, naming the constant, the value and what is allowed.
    pub fn check(&self, values: &Values) -> Result<()> {
        for (name, value) in values {
            let Some(constant) = self.constant(name) else {
                let known: Vec<&str> = self.constants.iter().map(|constant| constant.name.as_str()).collect();
                let what = format!("the pipeline {} has no such constant", self.path.display());
                let allowed =
                    if known.is_empty() { "it has none".into() } else { format!("it has {}", known.join(", ")) };
                return Err(Error::usage(format!("{what}; {allowed}")).at(name));
            };
            constant.check(value).map_err(|error| error.at(name))?;
        }
        Ok(())
    }

    /// The constants as settings, for panels and help texts.
    pub fn description(&self) -> Description {
        let key = |constant: &Constant| Key {
            name: constant.name.clone(),
            doc: constant.doc.clone(),
            kind: match &constant.default {
                Value::Bool(_) => Kind::Switch,
                Value::Number(number) if number.is_f64() => Kind::Number,
                Value::Number(_) => Kind::Whole,
                _ => Kind::Text,
            },
            optional: false,
            default: constant.default.clone(),
            allowed: match constant.range {
                [None, None] => Allowed::All,
                [least, most] => Allowed::Range {
                    least: least.unwrap_or(f64::from(f32::MIN)),
                    most: most.unwrap_or(f64::from(f32::MAX)),
                    multiple_of: None,
                    or_zero: false,
                },
            },
            unit: constant.unit.clone(),
            decides: Decides::Picture,
            option: None,
            needs: Vec::new(),
        };
        Description::of_keys(self.doc.clone(), self.constants.iter().map(key).collect())
    }
}

impl Constant {
    /// Checks that a value has the type of the constant and lies in its range.
    fn check(&self, value: &Value) -> Result<()> {
        let wrong = |allowed: &str| Error::usage(format!("{value} is not allowed; allowed: {allowed}"));
        match (&self.default, value) {
            (Value::Bool(_), Value::Bool(_)) => Ok(()),
            (Value::Bool(_), _) => Err(wrong("true, false")),
            (Value::Array(of), Value::Array(found)) if of.len() == found.len() => {
                found.iter().try_for_each(|value| self.number(value))
            }
            (Value::Array(of), _) => Err(wrong(&format!("a list of {} numbers", of.len()))),
            (Value::Number(of), Value::Number(found)) if !of.is_f64() && found.is_f64() => Err(wrong("whole numbers")),
            (_, value) => self.number(value),
        }
    }

    fn number(&self, value: &Value) -> Result<()> {
        let [least, most] = self.range;
        let inside = |n: f64| least.is_none_or(|least| n >= least) && most.is_none_or(|most| n <= most);
        let whole = !(self.default.is_f64() || self.default.is_array());
        let fits = |n: f64| {
            n.abs() <= f64::from(f32::MAX)
                && (self.default.is_f64() || self.default.is_array() || i32::try_from(n as i64).is_ok())
        };
        if value.as_f64().is_some_and(|n| n.is_finite() && inside(n) && fits(n)) {
            return Ok(());
        }
        let allowed = match (least, most) {
            (None, None) if whole => "whole numbers of 32 bits".to_owned(),
            (None, None) => "numbers".to_owned(),
            (Some(least), None) => format!("numbers from {least}"),
            (None, Some(most)) => format!("numbers up to {most}"),
            (Some(least), Some(most)) => format!("{least} to {most}"),
        };
        Err(Error::usage(format!("{value} is not allowed; allowed: {allowed}")))
    }
}
