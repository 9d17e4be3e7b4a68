//! JPEG files in: 8-bit sRGB codes, read only.

use std::io::Cursor;

use image::{ImageDecoder, codecs::jpeg::JpegDecoder};

use super::{Layer, Layers, check_size, srgb};
use crate::{Error, Result, scene::Limits};

/// The first bytes of every JPEG file.
pub(super) fn sniff(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0xff, 0xd8, 0xff])
}

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Layers> {
    let damaged = |error: image::ImageError| Error::input("damaged or not served").caused_by(error);
    let decoder = JpegDecoder::new(Cursor::new(bytes)).map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    // Decoded as RGB codes and as three numbers a pixel.
    check_size(width.into(), height.into(), 3 * 5, limits)?;
    let codes = image::DynamicImage::from_decoder(decoder).map_err(damaged)?.into_rgb8();
    let data = codes.into_raw().into_iter().map(srgb::decode_u8).collect();
    Ok(Layers::new(width, height).with(Layer::new("", &["R", "G", "B"], data)))
}
