//! RGB primaries: conversion of what a file says about its colours to Rec. 709.

use glam::{DMat3, DVec3, Mat3, Vec3};

use crate::{Error, Result};

/// CIE 1931 xy of the primaries and of white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chromaticities {
    pub red: [f32; 2],
    pub green: [f32; 2],
    pub blue: [f32; 2],
    pub white: [f32; 2],
}

/// ITU-R BT.709 primaries with D65: what every image of the engine is in.
pub const REC_709: Chromaticities =
    Chromaticities { red: [0.64, 0.33], green: [0.30, 0.60], blue: [0.15, 0.06], white: [0.3127, 0.3290] };

impl Chromaticities {
    /// `xyz_from_rgb`, with Y = 1 for RGB = (1, 1, 1). SMPTE RP 177.
    fn xyz_from_rgb(&self) -> Result<DMat3> {
        let xyz = |[x, y]: [f32; 2]| DVec3::new(f64::from(x), f64::from(y), 1.0 - f64::from(x) - f64::from(y));
        let primaries = DMat3::from_cols(xyz(self.red), xyz(self.green), xyz(self.blue));
        let white = xyz(self.white) / f64::from(self.white[1]);
        let gains = primaries.inverse() * white;
        if primaries.determinant().abs() > 1e-6 && gains.is_finite() && gains.cmpne(DVec3::ZERO).all() {
            Ok(primaries * DMat3::from_diagonal(gains))
        } else {
            Err(Error::input(format!("primaries that span no colours: {self:?}")).at("chromaticities"))
        }
    }

    /// Weights of R, G and B in luminance Y.
    pub fn luminance_weights(&self) -> Result<Vec3> {
        Ok(self.xyz_from_rgb()?.row(1).as_vec3())
    }

    /// The matrix to linear Rec. 709, without adaptation of white (as OpenEXR's own viewers do it). `None`: they are
    /// Rec. 709 within the precision of the attribute.
    pub fn rec709_from_rgb(&self) -> Result<Option<Mat3>> {
        let flat = |c: &Self| [c.red, c.green, c.blue, c.white];
        let same =
            flat(self).as_flattened().iter().zip(flat(&REC_709).as_flattened()).all(|(a, b)| (a - b).abs() < 2e-4);
        if same {
            return Ok(None);
        }
        Ok(Some((REC_709.xyz_from_rgb()?.inverse() * self.xyz_from_rgb()?).as_mat3()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rec_709_weights_are_the_published_ones() {
        let weights = REC_709.luminance_weights().unwrap();
        assert!((weights - Vec3::new(0.2126, 0.7152, 0.0722)).abs().max_element() < 1e-4, "{weights}");
        assert_eq!(REC_709.rec709_from_rgb().unwrap(), None);
    }

    #[test]
    fn xyz_to_rec_709_is_the_published_matrix() {
        let xyz = Chromaticities { red: [1.0, 0.0], green: [0.0, 1.0], blue: [0.0, 0.0], white: [1.0 / 3.0; 2] };
        let m = xyz.rec709_from_rgb().unwrap().unwrap();
        // IEC 61966-2-1.
        let rows = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]];
        for (i, row) in rows.iter().enumerate() {
            assert!((m.row(i) - Vec3::from_array(*row)).abs().max_element() < 2e-3, "{m}");
        }
    }

    #[test]
    fn primaries_on_a_line_are_refused() {
        let flat = Chromaticities { red: [0.1, 0.1], green: [0.2, 0.2], blue: [0.3, 0.3], white: [0.3, 0.3] };
        assert!(flat.rec709_from_rgb().is_err());
        assert!(Chromaticities { white: [0.3, 0.0], ..REC_709 }.rec709_from_rgb().is_err());
        assert!(Chromaticities { red: [f32::NAN; 2], ..REC_709 }.rec709_from_rgb().is_err());
    }
}
