//! Bitwise comparison of a picture with the picture that was made again.

use std::path::Path;

use lucerna::{
    Error, ErrorKind, Result,
    image::{Layers, Metadata},
};
use serde::Serialize;

/// The result of the comparison.
#[derive(Debug, Serialize)]
pub struct Comparison {
    /// Every byte of the file is the same.
    pub same_file: bool,
    /// Every sample has the same bits.
    pub same_pixels: bool,
    /// Number of samples with different bits.
    pub different: u64,
    pub samples: u64,
    /// Largest difference of two samples; `null` if one of them is not a number.
    pub largest: Option<f32>,
    /// Layer, channel and pixel of the largest difference.
    pub place: Option<String>,
    /// Differences in the metadata: device, driver, version, …
    pub metadata: Vec<String>,
}

impl Comparison {
    /// As text for terminals.
    pub fn text(&self, path: &Path) -> String {
        let mut lines = vec![match (self.same_file, self.same_pixels) {
            (true, _) => format!("{}: identical, every byte of the file", path.display()),
            (false, true) => format!("{}: identical, every bit of {} samples", path.display(), self.samples),
            (false, false) => {
                let largest = self.largest.map_or("not a number".into(), |largest| largest.to_string());
                let count = format!("{} of {} samples differ", self.different, self.samples);
                format!("{}: {count}, the largest difference is {largest}", path.display())
            }
        }];
        lines.extend(self.place.iter().map(|place| format!("  {place}")));
        lines.extend(self.metadata.iter().map(|what| format!("  {what}")));
        lines.join("\n")
    }

    /// Returns an error with exit code 7 if the pictures differ by more than `tolerance`; without a tolerance, if any bit differs.
    pub fn verdict(&self, path: &Path, tolerance: Option<f32>) -> Result<()> {
        let close = tolerance.is_some_and(|allowed| self.largest.is_some_and(|largest| largest <= allowed));
        if self.same_pixels || close {
            return Ok(());
        }
        let allowed = tolerance.map_or("the same bits".into(), |allowed| format!("a difference of {allowed}"));
        let what = format!("is another picture when rendered again; allowed is {allowed}");
        Err(Error::new(ErrorKind::Comparison, what).in_file(path))
    }
}

/// Compares two pictures.
pub(super) fn compare(old: &Layers, new: &Layers, same_file: bool) -> Comparison {
    let mut result = Comparison {
        same_file,
        same_pixels: false,
        different: 0,
        samples: 0,
        largest: Some(0.0),
        place: None,
        metadata: differences(&old.metadata, &new.metadata),
    };
    let shape = |l: &Layers| {
        (l.width, l.height, l.layers.iter().map(|l| (l.name.clone(), l.channels.clone())).collect::<Vec<_>>())
    };
    if shape(old) != shape(new) {
        result.metadata.push("size or layers".into());
        result.largest = None;
        return result;
    }
    for (a, b) in old.layers.iter().zip(&new.layers) {
        for (i, (x, y)) in a.data.iter().zip(&b.data).enumerate() {
            result.samples += 1;
            if x.to_bits() == y.to_bits() {
                continue;
            }
            result.different += 1;
            let difference = (x - y).abs();
            if result.largest.is_some_and(|largest| difference.is_nan() || difference > largest) {
                let (pixel, channel) = (i / a.channels.len(), &a.channels[i % a.channels.len()]);
                let (column, row) = (pixel % old.width as usize, pixel / old.width as usize);
                let layer = if a.name.is_empty() { "picture" } else { &a.name };
                result.place = Some(format!("{layer} {channel} at ({column}, {row}): {x} became {y}"));
                result.largest = difference.is_finite().then_some(difference);
            }
        }
    }
    result.same_pixels = result.different == 0;
    result
}

fn differences(old: &Metadata, new: &Metadata) -> Vec<String> {
    let field = |name: &str, old: &str, new: &str| (old != new).then(|| format!("{name}: {old:?} became {new:?}"));
    let print = |metadata: &Metadata| metadata.config["fingerprint"].as_str().unwrap_or_default().to_owned();
    [
        field("version", &old.version, &new.version),
        field("revision", old.revision.as_deref().unwrap_or(""), new.revision.as_deref().unwrap_or("")),
        field("device", &old.device, &new.device),
        field("driver", &old.driver, &new.driver),
        field("shader compiler", &old.shader_compiler, &new.shader_compiler),
        field("scene (fingerprint)", &print(old), &print(new)),
    ]
    .into_iter()
    .flatten()
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_largest_difference_and_names_its_place() {
        let old = Layers::rgb(2, 1, vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        let mut new = old.clone();
        assert!(compare(&old, &new, true).same_pixels);
        new.layers[0].data[1] = 1.5;
        new.layers[0].data[5] = 4.0;
        let result = compare(&old, &new, false);
        assert_eq!((result.different, result.largest, result.same_pixels), (2, Some(1.0), false));
        assert_eq!(result.place.as_deref(), Some("picture B at (1, 0): 5 became 4"));
        assert!(
            result.verdict(Path::new("a"), Some(1.0)).is_ok() && result.verdict(Path::new("a"), Some(0.9)).is_err()
        );
        new.layers[0].data[0] = f32::NAN;
        let broken = compare(&old, &new, false);
        assert_eq!(broken.largest, None);
        assert_eq!(broken.verdict(Path::new("a"), Some(1e9)).unwrap_err().exit_code(), 7);
        assert!(!compare(&old, &Layers::rgb(1, 1, vec![0.0; 3]), false).same_pixels);
    }
}
