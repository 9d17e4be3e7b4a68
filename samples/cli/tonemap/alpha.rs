//! `--alpha`: what becomes of a picture's alpha.
//!
//! Colours are premultiplied: they are the light that is seen over black, and a pixel of alpha 0 may shine (flames, glows). A PNG file shows at
//! most as much light as its alpha.

use std::{fmt, str::FromStr};

use lucerna::image::srgb;

/// A choice of `--alpha`. Without one, alpha is kept, but left out of .png files in which it would hide more than a hundredth of the light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Alpha {
    /// Files that can hold alpha have it.
    Keep,
    /// The light as it is seen over black, without alpha.
    Drop,
    /// The picture over this colour, codes of sRGB, without alpha.
    Over([u8; 3]),
}

const ALLOWED: &str = "expected keep, drop or over:COLOUR, such as over:white or over:#336699";

impl FromStr for Alpha {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "keep" => return Ok(Self::Keep),
            "drop" => return Ok(Self::Drop),
            _ => {}
        }
        let colour = text.strip_prefix("over").and_then(|rest| rest.strip_prefix([':', ' ', '=']));
        colour.and_then(colour_of).map(Self::Over).ok_or_else(|| ALLOWED.into())
    }
}

impl fmt::Display for Alpha {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Keep => f.write_str("keep"),
            Self::Drop => f.write_str("drop"),
            Self::Over([r, g, b]) => write!(f, "over:#{r:02x}{g:02x}{b:02x}"),
        }
    }
}

/// `white`, `grey`, `black`, `#rgb` or `#rrggbb`.
fn colour_of(text: &str) -> Option<[u8; 3]> {
    match text {
        "white" => return Some([255; 3]),
        "grey" | "gray" => return Some([128; 3]),
        "black" => return Some([0; 3]),
        _ => {}
    }
    let digits: Vec<u8> =
        text.strip_prefix('#')?.chars().map(|c| c.to_digit(16).map(|d| d as u8)).collect::<Option<_>>()?;
    match digits[..] {
        [r, g, b] => Some([17 * r, 17 * g, 17 * b]),
        [a, b, c, d, e, f] => Some([16 * a + b, 16 * c + d, 16 * e + f]),
        _ => None,
    }
}

impl Alpha {
    /// The picture has alpha afterwards. `pixels`: display-referred linear light, premultiplied.
    pub(super) fn apply(choice: Option<Self>, pixels: &mut [[f32; 4]]) -> bool {
        if let Some(Self::Over(colour)) = choice {
            let behind = colour.map(srgb::decode_u8);
            for pixel in pixels {
                let through = 1.0 - pixel[3].clamp(0.0, 1.0);
                (0..3).for_each(|c| pixel[c] += through * behind[c]);
            }
        }
        matches!(choice, None | Some(Self::Keep))
    }
}

/// Number of pixels that a PNG file with alpha shows darker than they are over black, by at least one code of 8 bits.
pub(super) fn hidden(pixels: &[[f32; 4]]) -> u64 {
    let code = |light: f32| srgb::encode_u8(light.clamp(0.0, 1.0));
    let hides = |pixel: &&[f32; 4]| {
        let alpha = pixel[3].clamp(0.0, 1.0);
        pixel[..3].iter().any(|&light| light > alpha && code(light) > code(alpha))
    };
    pixels.iter().filter(hides).count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn choices_are_read_and_written() {
        for (text, alpha, again) in [
            ("keep", Alpha::Keep, "keep"),
            ("drop", Alpha::Drop, "drop"),
            ("over:white", Alpha::Over([255; 3]), "over:#ffffff"),
            ("over grey", Alpha::Over([128; 3]), "over:#808080"),
            ("over:#1a2b3c", Alpha::Over([26, 43, 60]), "over:#1a2b3c"),
            ("over=#f08", Alpha::Over([255, 0, 136]), "over:#ff0088"),
        ] {
            assert_eq!(text.parse(), Ok(alpha));
            assert_eq!(alpha.to_string(), again);
        }
        for wrong in ["", "over", "over:", "overwhite", "over:#12", "over:#gggggg", "over:#ü12", "white", "Keep"] {
            assert_eq!(wrong.parse::<Alpha>(), Err(ALLOWED.to_owned()), "{wrong}");
        }
    }

    #[test]
    fn over_a_colour_and_hidden_light() {
        let picture =
            [[0.5, 0.25, 0.0, 1.0], [0.2, 0.2, 0.2, 0.5], [0.7, 0.1, 0.0, 0.0], [0.0; 4], [2.0, 0.0, 0.0, 1.0]];
        let mut over = picture;
        assert!(!Alpha::apply(Some(Alpha::Over([255, 0, 0])), &mut over));
        assert_eq!(over.map(|p| p[0]), [0.5, 0.7, 1.7, 1.0, 2.0]);
        assert_eq!(over.map(|p| p[1]), picture.map(|p| p[1]));
        for (choice, keeps) in [(None, true), (Some(Alpha::Keep), true), (Some(Alpha::Drop), false)] {
            let mut same = picture;
            assert_eq!((Alpha::apply(choice, &mut same), same), (keeps, picture));
        }
        // The flame alone: opaque pixels over white are clipped with alpha or without it.
        assert_eq!(hidden(&picture), 1);
    }
}
