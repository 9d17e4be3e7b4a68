//! Maps as image files.

use std::{
    collections::HashSet,
    path::{Path, PathBuf},
};

use lucerna::{
    Error, ErrorKind, Result,
    image::{self, Layers, Metadata, WriteOptions, srgb},
    measure::{Measure, Measured, Options, Pair, develop},
};

use super::{
    CompareArgs,
    args::MapStyle,
    input::{Images, split},
};
use crate::program;

/// The folder for maps, if any.
pub(super) struct Folder<'a> {
    args: &'a CompareArgs,
    path: Option<PathBuf>,
    /// The first part of the files' names, one for each test.
    stems: Vec<String>,
}

impl<'a> Folder<'a> {
    /// Makes the folder and checks, before the comparison, that no existing file would be overwritten without permission.
    ///
    /// # Errors
    /// `Output` if a map cannot be written.
    pub fn prepare(args: &'a CompareArgs, images: &Images, measures: &[Measure]) -> Result<Self> {
        let stems = stems(&images.tests.iter().map(|t| t.name.as_str()).collect::<Vec<_>>());
        let folder = Self { args, path: args.map.clone(), stems };
        let Some(path) = &folder.path else { return Ok(folder) };
        std::fs::create_dir_all(path)
            .map_err(|error| Error::new(ErrorKind::Output, "cannot be made").in_file(path).caused_by(error))?;
        for stem in &folder.stems {
            for (_, _, name) in folder.names(path, stem, measures) {
                image::probe_output(&name, args.overwrite)?;
            }
        }
        Ok(folder)
    }

    /// Style, measure (for styles that show a measure) and file of each map.
    fn names(&self, path: &Path, stem: &str, measures: &[Measure]) -> Vec<(MapStyle, Option<usize>, PathBuf)> {
        let mut names = Vec::new();
        for style in &self.args.map_style {
            match style {
                MapStyle::Magma | MapStyle::Exr => {
                    let extension = if *style == MapStyle::Exr { "exr" } else { "png" };
                    names.extend(
                        measures
                            .iter()
                            .enumerate()
                            .map(|(i, measure)| (*style, Some(i), path.join(format!("{stem}-{measure}.{extension}")))),
                    );
                }
                MapStyle::Difference => names.push((*style, None, path.join(format!("{stem}-difference.png")))),
                MapStyle::Negative => names.push((*style, None, path.join(format!("{stem}-negative.png")))),
            }
        }
        names
    }

    /// Writes the maps of a test and returns their names.
    ///
    /// # Errors
    /// `Output`: the named file was not written; the files before it are complete.
    pub fn write(&self, test: usize, pair: &Pair<'_>, values: &[Measured], options: &Options) -> Result<Vec<String>> {
        let Some(path) = &self.path else { return Ok(Vec::new()) };
        let measures: Vec<Measure> = values.iter().map(|v| v.measure).collect();
        let write = WriteOptions { overwrite: self.args.overwrite, f32: true, ..WriteOptions::default() };
        let mut written = Vec::new();
        for (style, measure, name) in self.names(path, &self.stems[test], &measures) {
            let mut layers = match (style, measure) {
                (MapStyle::Magma, Some(i)) => values[i].map.picture(),
                (MapStyle::Exr, Some(i)) => values[i].map.layers(),
                _ => difference(pair, options, style == MapStyle::Negative),
            };
            layers.metadata = self.metadata(test, measure.map(|i| &values[i]));
            image::write(&name, &layers, &write)?;
            written.push(name.to_string_lossy().into_owned());
        }
        Ok(written)
    }

    fn metadata(&self, test: usize, measured: Option<&Measured>) -> Metadata {
        let mut extra = std::collections::BTreeMap::new();
        extra.insert("reference".to_owned(), self.args.reference.clone());
        extra.insert("test".to_owned(), self.args.tests[test].clone());
        if let Some(measured) = measured {
            let [low, high] = measured.map.range;
            extra.insert("measure".to_owned(), measured.measure.name().to_owned());
            extra.insert("value".to_owned(), measured.value.to_string());
            extra.insert("meaning".to_owned(), measured.map.meaning.to_owned());
            extra.insert("scale".to_owned(), format!("magma from {low} (darkest) to {high} (brightest)"));
        } else {
            extra.insert("meaning".to_owned(), "|R-T| of screen values, or 1 minus |R-T|".to_owned());
        }
        Metadata {
            program: "lucerna compare".into(),
            version: program::VERSION.into(),
            revision: program::revision().map(str::to_owned),
            extra,
            ..Metadata::default()
        }
    }
}

/// Codes of |R − T|, or their negative: the difference images of Imalyzer.
fn difference(pair: &Pair<'_>, options: &Options, negative: bool) -> Layers {
    let stops = options.display.stops(pair.reference);
    let show = |picture| develop(picture, stops, options.display.curve).pixels;
    let (reference, test) = (show(pair.reference), show(pair.test));
    let code = |r: f32, t: f32| {
        let difference = (srgb::encode(r) - srgb::encode(t)).abs();
        srgb::decode(if negative { 1.0 - difference } else { difference })
    };
    let data = reference.as_flattened().iter().zip(test.as_flattened()).map(|(r, t)| code(*r, *t)).collect();
    Layers::rgb(pair.reference.width, pair.reference.height, data)
}

/// File names without folder and extension, made different by numbers where they are the same.
fn stems(names: &[&str]) -> Vec<String> {
    let mut seen = HashSet::new();
    let stem = |name: &&str| {
        let (file, layer) = split(name);
        let stem = Path::new(file).file_stem().map_or("image".into(), |s| s.to_string_lossy().into_owned());
        let stem = layer.map_or(stem.clone(), |layer| format!("{stem}-{layer}"));
        let mut unique = stem.clone();
        let mut number = 2;
        while !seen.insert(unique.clone()) {
            unique = format!("{stem}-{number}");
            number += 1;
        }
        unique
    };
    names.iter().map(stem).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maps_of_different_images_have_different_names() {
        assert_eq!(stems(&["a/x.exr", "b/x.exr", "c.exr:direct", "x.png"]), ["x", "x-2", "c-direct", "x-3"]);
    }
}
