//! The pixels that measures compare.

use crate::{
    Error, Result,
    image::{self, Layer, Layers},
};

/// A linear Rec. 709 image of three channels, top row first.
#[derive(Clone, PartialEq)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    /// `width · height` pixels.
    pub pixels: Vec<[f32; 3]>,
    /// The file held codes of a screen (PNG, JPEG): white is 1, and no exposure is needed to show it.
    pub display_referred: bool,
}

impl std::fmt::Debug for Picture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let range = if self.display_referred { "display-referred" } else { "scene-referred" };
        write!(f, "Picture({}×{}, {range})", self.width, self.height)
    }
}

impl Picture {
    /// # Errors
    /// `Usage` unless there are `width · height` pixels, and at least one.
    pub fn new(width: u32, height: u32, pixels: Vec<[f32; 3]>) -> Result<Self> {
        let wanted = u64::from(width) * u64::from(height);
        if wanted == 0 || pixels.len() as u64 != wanted {
            let found = pixels.len();
            return Err(Error::usage(format!("an image of {width}×{height} has {wanted} pixels, not {found}")));
        }
        Ok(Self { width, height, pixels, display_referred: false })
    }

    /// From a function of column and row. A size of zero becomes one pixel.
    pub fn from_fn(width: u32, height: u32, mut pixel: impl FnMut(u32, u32) -> [f32; 3]) -> Self {
        let (width, height) = (width.max(1), height.max(1));
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| pixel(x, y)).collect();
        Self { width, height, pixels, display_referred: false }
    }

    /// A layer of an image, by name; `None` or `""` or `total`: the picture. One channel stands for all three, `X Y Z`
    /// are taken as three numbers. Alpha is left out: colour is premultiplied, so every pixel is seen over black.
    ///
    /// # Errors
    /// `Input` if there is no such layer (naming those there are), or if it has neither one nor three channels.
    pub fn from_layers(image: &Layers, layer: Option<&str>) -> Result<Self> {
        let name = layer.unwrap_or("");
        let found = if name.is_empty() { image.main() } else { image.layer(name) };
        let Some(found) = found else {
            let names: Vec<String> = image.layers.iter().map(|l| format!("'{}'", shown(l))).collect();
            return Err(Error::input(format!("no layer '{name}'; there are {}", names.join(", "))));
        };
        let pixels = found.rgb_pixels().ok_or_else(|| {
            let channels = found.channels.join(" ");
            Error::input(format!("layer '{}' has the channels {channels}; one or three are compared", shown(found)))
        })?;
        Self::new(image.width, image.height, pixels)
    }

    /// A layer of an image file of any format that is read; PNG and JPEG files are display-referred.
    ///
    /// # Errors
    /// As [`image::decode`] and [`from_layers`](Self::from_layers), naming the file.
    pub fn read(path: impl AsRef<std::path::Path>, layer: Option<&str>) -> Result<Self> {
        Self::read_telling(path, layer, |_| {})
    }

    /// As [`read`](Self::read); what is wrong with the file, though it could be read ([`Layers::warnings`]), goes to `tell`.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn read_telling(
        path: impl AsRef<std::path::Path>,
        layer: Option<&str>,
        tell: impl FnMut(&String),
    ) -> Result<Self> {
        let path = path.as_ref();
        let bytes = image::read_file_checked(path, crate::scene::Limits::default().max_file)?;
        Self::decode_telling(&bytes, layer, tell).map_err(|error| error.in_file(path))
    }

    /// As [`read_telling`](Self::read_telling), from the bytes of a file.
    ///
    /// # Errors
    /// As [`read`](Self::read), without the name of a file.
    pub fn decode_telling(bytes: &[u8], layer: Option<&str>, tell: impl FnMut(&String)) -> Result<Self> {
        let layers = image::decode(bytes, &crate::scene::Limits::default())?;
        layers.warnings.iter().for_each(tell);
        let picture = Self::from_layers(&layers, layer)?;
        Ok(Self { display_referred: image::is_display_referred(bytes), ..picture })
    }

    /// The rectangle of `size` whose first pixel is `origin`.
    ///
    /// # Errors
    /// `Usage` if it is empty or reaches out of the picture.
    pub fn crop(&self, origin: [u32; 2], size: [u32; 2]) -> Result<Self> {
        let [x, y] = origin.map(u64::from);
        let [w, h] = size.map(u64::from);
        if w == 0 || h == 0 || x + w > self.width.into() || y + h > self.height.into() {
            let (width, height) = (self.width, self.height);
            return Err(Error::usage(format!("a crop of {w}×{h} at ({x}, {y}) is not inside {width}×{height} pixels")));
        }
        let rows = self.pixels.chunks_exact(self.width as usize).skip(y as usize).take(h as usize);
        let pixels = rows.flat_map(|row| &row[x as usize..(x + w) as usize]).copied().collect();
        Ok(Self { width: size[0], height: size[1], pixels, display_referred: self.display_referred })
    }

    /// Puts `value` wherever a sample is NaN or infinite and returns how many there were.
    pub fn replace_non_finite(&mut self, value: f32) -> u64 {
        let bad = self.pixels.as_flattened_mut().iter_mut().filter(|v| !v.is_finite());
        bad.map(|v| *v = value).count() as u64
    }

    /// The first sample that is not finite: column, row, channel.
    fn first_non_finite(&self) -> Option<(usize, usize, usize)> {
        let i = self.pixels.as_flattened().iter().position(|v| !v.is_finite())?;
        let (pixel, width) = (i / 3, self.width as usize);
        Some((pixel % width, pixel / width, i % 3))
    }
}

fn shown(layer: &Layer) -> &str {
    if layer.name.is_empty() { "total" } else { &layer.name }
}

/// A reference and the image that is held against it; measures of three images also have a baseline.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    pub reference: &'a Picture,
    pub test: &'a Picture,
    /// The image that `test` should be better than: for [`Measure::Fq`](super::Measure), `Gain` and `Improved`.
    pub baseline: Option<&'a Picture>,
}

impl<'a> Pair<'a> {
    /// # Errors
    /// `Input` if the sizes differ, or if a sample of either is NaN or infinite ([`Picture::replace_non_finite`]).
    pub fn new(reference: &'a Picture, test: &'a Picture) -> Result<Self> {
        check("reference", reference, reference)?;
        check("test", reference, test)?;
        Ok(Self { reference, test, baseline: None })
    }

    /// With the image that `test` should be better than.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_baseline(self, baseline: &'a Picture) -> Result<Self> {
        check("baseline", self.reference, baseline)?;
        Ok(Self { baseline: Some(baseline), ..self })
    }

    pub(super) fn width(&self) -> usize {
        self.reference.width as usize
    }

    pub(super) fn height(&self) -> usize {
        self.reference.height as usize
    }
}

fn check(role: &str, reference: &Picture, image: &Picture) -> Result<()> {
    let size = |p: &Picture| [p.width, p.height];
    if size(reference) != size(image) {
        let ([rw, rh], [w, h]) = (size(reference), size(image));
        return Err(Error::input(format!("{w}×{h} pixels, the reference has {rw}×{rh}"))
            .at(role)
            .help("Images are compared pixel by pixel and never scaled; render both in one size, or crop"));
    }
    if let Some((x, y, channel)) = image.first_non_finite() {
        let bad = image.pixels.as_flattened().iter().filter(|v| !v.is_finite()).count();
        let name = ["R", "G", "B"][channel];
        return Err(Error::input(format!("{bad} samples are NaN or infinite, the first in pixel ({x}, {y}), {name}"))
            .at(role)
            .help("No measure of such an image means anything; mend it, or choose a value for these samples"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_compared_is_refused_and_named() {
        let black = Picture::from_fn(4, 3, |_, _| [0.0; 3]);
        let wide = Picture::from_fn(5, 3, |_, _| [0.0; 3]);
        let error = Pair::new(&black, &wide).unwrap_err();
        assert!(error.exit_code() == 3 && error.to_string().contains("5×3") && error.to_string().contains("4×3"));
        let mut broken = black.clone();
        broken.pixels[6][1] = f32::NAN;
        broken.pixels[7][2] = f32::INFINITY;
        let error = Pair::new(&black, &broken).unwrap_err().to_string();
        assert!(error.contains("2 samples") && error.contains("(2, 1), G"), "{error}");
        assert!(
            Pair::new(&black, &black).unwrap().with_baseline(&broken).unwrap_err().to_string().contains("baseline")
        );
        assert_eq!(broken.replace_non_finite(0.0), 2);
        assert_eq!(broken, black);
        assert!(Picture::new(2, 2, vec![[0.0; 3]; 3]).is_err() && Picture::new(0, 0, vec![]).is_err());
    }

    #[test]
    fn layers_and_crops() {
        let pixels: Vec<[f32; 3]> = (0..6).map(|i| [i as f32, 0.0, 0.0]).collect();
        let image = Layers::rgb(3, 2, pixels.concat()).with(Layer::new("depth", &["Z"], vec![2.0; 6]));
        let picture = Picture::from_layers(&image, Some("total")).unwrap();
        assert_eq!(picture.pixels, pixels);
        assert_eq!(Picture::from_layers(&image, Some("depth")).unwrap().pixels, [[2.0; 3]; 6]);
        let missing = Picture::from_layers(&image, Some("indirect")).unwrap_err().to_string();
        assert!(missing.contains("'total', 'depth'"), "{missing}");
        let crop = picture.crop([1, 1], [2, 1]).unwrap();
        assert_eq!(crop.pixels, [[4.0, 0.0, 0.0], [5.0, 0.0, 0.0]]);
        for (origin, size) in [([2, 0], [2, 1]), ([0, 0], [0, 1]), ([u32::MAX, 0], [1, 1])] {
            assert_eq!(picture.crop(origin, size).unwrap_err().exit_code(), 2);
        }
    }
}
