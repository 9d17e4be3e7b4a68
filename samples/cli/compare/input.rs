//! The images of a comparison: files, layers, crops, NaN, HDR beside LDR.

use std::path::Path;

use lucerna::{
    Error, Result,
    measure::{self, Picture},
    scene::Limits,
};

use super::CompareArgs;
use crate::{
    console::Console,
    piped::{self, PIPE, STDIN},
};

/// An error that ends the comparison.
pub(super) struct Stop {
    pub error: Error,
    /// The images have different sizes, for which idiff has its own exit code.
    pub sizes_differ: bool,
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self { error, sizes_differ: false }
    }
}

/// An image, and its name on the command line.
pub(super) struct Image {
    pub name: String,
    pub picture: Picture,
}

/// All pictures of a run, ready to be compared.
pub(super) struct Images {
    pub reference: Image,
    pub tests: Vec<Image>,
    pub baseline: Option<Image>,
    pub notes: Vec<String>,
    /// HDR images were converted to screen codes, because other images are screen codes.
    pub developed: bool,
}

impl Images {
    /// Reads all images and converts them to comparable values.
    ///
    /// # Errors
    /// `Input` for files that cannot be read, for missing layers, and for HDR images compared with screen codes without an exposure.
    pub fn read(args: &CompareArgs, console: Console) -> Result<Self, Stop> {
        let all = std::iter::once(&args.reference).chain(&args.tests).chain(&args.baseline);
        piped::once(all.map(|name| split(name).0))?;
        let mut notes = Vec::new();
        let mut one = |name: &String| read(name, args, &mut notes);
        let reference = one(&args.reference)?;
        let tests = args.tests.iter().map(&mut one).collect::<Result<Vec<_>>>()?;
        let baseline = args.baseline.as_ref().map(&mut one).transpose()?;
        let mut images = Self { reference, tests, baseline, notes, developed: false };
        images.common_ground(args)?;
        images.crop(args)?;
        for note in &images.notes {
            console.warning(note);
        }
        Ok(images)
    }

    fn each(&mut self) -> impl Iterator<Item = &mut Image> {
        std::iter::once(&mut self.reference).chain(&mut self.tests).chain(&mut self.baseline)
    }

    /// Converts HDR images to screen codes if other images are screen codes. This needs an exposure from the user.
    fn common_ground(&mut self, args: &CompareArgs) -> Result<()> {
        let (mut light, mut codes) = (None, None);
        for image in self.each() {
            let first = if image.picture.display_referred { &mut codes } else { &mut light };
            first.get_or_insert_with(|| image.name.clone());
        }
        let (Some(light), Some(codes)) = (light, codes) else { return Ok(()) };
        let Some(stops) = args.exposure.0 else {
            return Err(Error::input(format!("{light} is an HDR image, but {codes} holds screen values"))
                .help("Give the exposure of the HDR image with --exposure EV (and --tone-curve); with 0, a value of 1 is white"));
        };
        let curve = args.tone_curve.curve();
        for image in self.each().filter(|image| !image.picture.display_referred) {
            image.picture = measure::develop(&image.picture, stops, curve);
        }
        let note =
            format!("HDR images ({light} and others) are exposed by {stops} stops and compared as screen values");
        self.notes.push(note);
        self.developed = true;
        Ok(())
    }

    fn crop(&mut self, args: &CompareArgs) -> Result<()> {
        let Some((size, origin)) = args.crop else { return Ok(()) };
        for image in self.each() {
            image.picture = image.picture.crop(origin, size).map_err(|error| error.in_file(&image.name))?;
        }
        Ok(())
    }
}

fn read(name: &str, args: &CompareArgs, notes: &mut Vec<String>) -> Result<Image> {
    let (file, own) = split(name);
    let layer = own.or(args.layer.as_deref());
    let tell = |what: &String| notes.push(format!("{name}: {what}"));
    let mut picture = match file == PIPE {
        true => piped::bytes(Limits::default().max_file)
            .and_then(|bytes| Picture::decode_telling(&bytes, layer, tell))
            .map_err(|error| error.in_file(STDIN))?,
        false => Picture::read_telling(file, layer, tell)?,
    };
    if let Some(value) = args.nan_as {
        let count = picture.replace_non_finite(value as f32);
        if count > 0 {
            notes.push(format!("{name}: {count} samples were NaN or infinite and are taken as {value}"));
        }
    }
    Ok(Image { name: name.to_owned(), picture })
}

/// Splits `FILE:LAYER`. An existing file with a colon in its name is not split.
pub(crate) fn split(name: &str) -> (&str, Option<&str>) {
    if Path::new(name).exists() {
        return (name, None);
    }
    match name.rsplit_once(':') {
        // Not the drive of `C:\picture.exr`.
        Some((file, layer)) if !layer.contains(['/', '\\']) && (file.len() > 1 || file == PIPE) => (file, Some(layer)),
        _ => (name, None),
    }
}
