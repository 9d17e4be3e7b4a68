//! The image files of a run. Their names follow patterns and are checked before the work starts; files are written as a whole or not at all.

use std::{collections::HashSet, path::Path};

use lucerna::{
    Error, ErrorKind, Result,
    image::{self, Format, Layers, Metadata, Report, WriteOptions},
};

use crate::pattern::{Pattern, Values};

/// Note for a file with [`image::Report::alpha_left_out`].
pub const ALPHA_LEFT_OUT: &str =
    "alpha is left out, because it would hide light (a PNG pixel with alpha 0 shows no light); an .exr file keeps both";
/// The default file name of a picture.
pub const SINGLE: &str = "{scene}-{camera}-{technique}.png";
/// Standard output as a file name.
const STDOUT: &str = "-";

/// The image files of a run.
#[derive(Debug)]
pub struct Outputs {
    targets: Vec<(Pattern, Format)>,
    /// Instead of files: the format of the picture that is kept in memory, and the last picture.
    memory: Option<(Format, Option<Fresh>)>,
    options: WriteOptions,
}

/// A picture in memory, with the contents of the file that `render` would write.
#[derive(Clone, Debug)]
pub struct Fresh {
    pub bytes: Vec<u8>,
    /// The metadata in the file, or in a second file if the format holds no metadata.
    pub metadata: Metadata,
}

impl Fresh {
    /// The bytes that [`image::write`] writes, and a report about unusual values.
    ///
    /// # Errors
    /// As [`image::encode`].
    pub fn new(format: Format, layers: &Layers, options: &WriteOptions) -> Result<(Self, image::Report)> {
        let (bytes, report) = image::encode(format, layers, options)?;
        Ok((Self { bytes, metadata: layers.metadata.clone() }, report))
    }
}

impl Outputs {
    /// Parses the names of `-o`. Without names there is one PNG file, named after scene, camera and technique.
    ///
    /// # Errors
    /// `Usage` for invalid names, and for names that are the same for several frames.
    pub fn new(names: &[String], frames: usize, options: WriteOptions) -> Result<Self> {
        let default = match frames {
            1 => SINGLE,
            _ => "{scene}-{camera}-{technique}-{frame:04}.png",
        };
        let given: Vec<&str> =
            if names.is_empty() { vec![default] } else { names.iter().map(String::as_str).collect() };
        let mut targets = Vec::new();
        for name in given {
            let pattern = Pattern::parse(name)?;
            if frames > 1 && !pattern.has_frame() {
                let what = format!("output '{name}': {frames} frames would overwrite each other");
                return Err(Error::usage(what).help("Put {frame:04} into the name"));
            }
            let format = if name == STDOUT { Format::Exr } else { Format::from_path(Path::new(name))? };
            targets.push((pattern, format));
        }
        Ok(Self { targets, memory: None, options })
    }

    /// Writes no file: keeps the last picture in memory, as the bytes of its file.
    pub fn in_memory(format: Format, options: WriteOptions) -> Self {
        Self { targets: Vec::new(), memory: Some((format, None)), options }
    }

    /// The picture that was kept in memory.
    pub fn fresh(self) -> Option<Fresh> {
        self.memory.and_then(|(_, fresh)| fresh)
    }

    /// From now on PNG files are written with the radiance times 2^`ev`.
    pub fn expose(&mut self, ev: f64) {
        self.options.exposure_ev = ev as f32;
    }

    /// True if a file holds layers.
    pub fn wants_layers(&self) -> bool {
        let in_memory = self.memory.as_ref().is_some_and(|(format, _)| *format == Format::Exr);
        in_memory || self.targets.iter().any(|(pattern, format)| *format == Format::Exr || pattern.has_layer())
    }

    /// True if a file is for screens and shows the picture: a .png or .jpg file without `{layer}` in its name.
    pub fn wants_screen(&self) -> bool {
        let in_memory = self.memory.as_ref().is_some_and(|(format, _)| is_for_screens(*format));
        in_memory || self.targets.iter().any(|(pattern, format)| is_for_screens(*format) && !pattern.has_layer())
    }

    /// True if the image goes to standard output.
    pub fn uses_stdout(&self) -> bool {
        self.targets.iter().any(|(pattern, _)| pattern.text() == STDOUT)
    }

    /// Checks that the files of a frame can be written: their folders are made, and no file exists, unless overwriting is allowed.
    ///
    /// # Errors
    /// `Usage` if two files have one name, `Output` if one cannot be written.
    pub fn probe(&self, values: &Values<'_>, layers: &[&str]) -> Result<()> {
        let mut seen = HashSet::new();
        for (pattern, _) in &self.targets {
            let each: &[&str] = if pattern.has_layer() { layers } else { &[""] };
            for &layer in each {
                let name = pattern.fill(&Values { layer, ..*values });
                if !seen.insert(name.clone()) {
                    return Err(Error::usage(format!("output '{name}' is named twice")));
                }
                if name != STDOUT {
                    image::probe_output(Path::new(&name), self.options.overwrite)?;
                }
            }
        }
        Ok(())
    }

    /// Writes the files of a frame. `shown`: the picture of files for screens with the exposure applied, if they do not show `layers`. Returns the names
    /// of the files and reports about unusual values.
    ///
    /// # Errors
    /// `Output`: the named file was not written; the files before it are complete.
    pub fn write(
        &mut self,
        values: &Values<'_>,
        layers: &Layers,
        shown: Option<&Layers>,
    ) -> Result<Vec<(String, Report)>> {
        let mut written = Vec::new();
        let exposed = WriteOptions { exposure_ev: 0.0, ..self.options.clone() };
        let choose = |format: Format| match shown {
            Some(shown) if is_for_screens(format) => (shown, &exposed),
            _ => (layers, &self.options),
        };
        if let Some((format, last)) = &mut self.memory {
            let (picture, options) = choose(*format);
            let (fresh, report) = Fresh::new(*format, picture, options)?;
            *last = Some(fresh);
            written.push(("(in memory)".to_owned(), report_of(layers, picture, report)));
        }
        for (pattern, format) in &self.targets {
            if !pattern.has_layer() {
                let (picture, options) = choose(*format);
                let (name, report) = write_one(&pattern.fill(values), *format, picture, options)?;
                written.push((name, report_of(layers, picture, report)));
                continue;
            }
            for layer in &layers.layers {
                let shown = if layer.name.is_empty() { "picture" } else { &layer.name };
                let single = Layers {
                    layers: vec![layer.clone()],
                    metadata: layers.metadata.clone(),
                    ..Layers::new(layers.width, layers.height)
                };
                let name = pattern.fill(&Values { layer: shown, ..*values });
                written.push(write_one(&name, *format, &single, &self.options)?);
            }
        }
        Ok(written)
    }
}

fn is_for_screens(format: Format) -> bool {
    matches!(format, Format::Png | Format::Jpeg)
}

/// The report about a written file. A picture for screens has lost the values that are not finite, so `layers` tell about them.
fn report_of(layers: &Layers, picture: &Layers, written: Report) -> Report {
    match layers.main() {
        Some(main) if !std::ptr::eq(layers, picture) => {
            Report { alpha_left_out: written.alpha_left_out, ..Report::count(&[main], layers.width) }
        }
        _ => written,
    }
}

fn write_one(name: &str, format: Format, layers: &Layers, options: &WriteOptions) -> Result<(String, Report)> {
    if name == STDOUT {
        use std::io::Write;
        let (bytes, report) = image::encode(format, layers, options)?;
        let mut out = std::io::stdout().lock();
        out.write_all(&bytes)
            .and_then(|()| out.flush())
            .map_err(|error| Error::new(ErrorKind::Output, "could not write to standard output").caused_by(error))?;
        return Ok((name.to_owned(), report));
    }
    let report = image::write(Path::new(name), layers, options)?;
    Ok((name.to_owned(), report))
}

#[cfg(test)]
mod tests {
    use lucerna::image::Layer;

    use super::*;

    const VALUES: Values<'_> = Values { scene: "s", camera: "c", technique: "t", frame: 3, layer: "" };

    fn picture() -> Layers {
        Layers::rgb(2, 1, vec![0.5; 6]).with(Layer::new("depth", &["Z"], vec![1.0, 2.0]))
    }

    fn outputs(names: &[&str], frames: usize) -> Result<Outputs> {
        let names: Vec<String> = names.iter().map(|&n| n.to_owned()).collect();
        Outputs::new(&names, frames, WriteOptions::default())
    }

    #[test]
    fn names_are_checked_before_the_work() {
        for (names, frames) in [(["a.png"], 2), (["a.tga"], 1), (["a"], 1), (["{oops}.png"], 1)] {
            assert_eq!(outputs(&names, frames).unwrap_err().exit_code(), 2, "{names:?}");
        }
        assert_eq!(outputs(&["a.exr", "a.exr"], 1).unwrap().probe(&VALUES, &[]).unwrap_err().exit_code(), 2);
        // A file has the name of the folder.
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "").unwrap();
        let under = file.join("deep/a.exr").to_string_lossy().into_owned();
        let refused = outputs(&[&under], 1).unwrap().probe(&VALUES, &[]).unwrap_err();
        assert!(refused.exit_code() == 1 && refused.to_string().contains("file/deep"), "{refused}");
    }

    #[test]
    fn a_file_for_each_layer() {
        let folder = tempfile::tempdir().unwrap();
        let name = folder.path().join("x-{layer}-{frame:03}.pfm").to_string_lossy().into_owned();
        let written = outputs(&[&name], 2).unwrap().write(&VALUES, &picture(), None).unwrap();
        let mut files: Vec<String> =
            std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        files.sort();
        assert_eq!(files, ["x-depth-003.pfm", "x-picture-003.pfm"]);
        assert_eq!(written.len(), 2);
    }
}
