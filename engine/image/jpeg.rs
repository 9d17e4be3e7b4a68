//! JPEG files: 8-bit sRGB codes, without alpha.

use std::io::Cursor;

use image::{
    ExtendedColorType, ImageDecoder, codecs::jpeg::JpegDecoder, codecs::jpeg::JpegEncoder, metadata::Orientation,
};

use super::{Layer, Layers, Metadata, WriteOptions, check_size, encoding, orientation, srgb};
use crate::{Error, ErrorKind, Result, limits::Limits};

/// Longest side that the format holds, pixels.
const MAX_SIDE: u32 = 65535;
/// Our metadata stands in comment segments that begin so.
const COMMENT: &[u8] = b"lucerna ";
/// Bytes of text in one comment; a segment holds at most 65533.
const COMMENT_BYTES: usize = 60_000;

/// The first bytes of every JPEG file.
pub(super) fn sniff(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0xff, 0xd8, 0xff])
}

/// Colour with full chroma resolution; what alpha leaves out is black.
pub(super) fn encode(picture: &Layers, layer: &Layer, options: &WriteOptions) -> Result<Vec<u8>> {
    let quality = options.jpeg_quality;
    if !(1..=100).contains(&quality) {
        return Err(Error::usage(format!("a quality of {quality}: JPEG files are written with 1 to 100")));
    }
    let (width, height) = (picture.width, picture.height);
    if width > MAX_SIDE || height > MAX_SIDE {
        return Err(Error::usage(format!("{width}×{height} pixels: JPEG files hold at most {MAX_SIDE} a side"))
            .help("Write a .png or .exr file"));
    }
    let pixels = layer.rgb_pixels().ok_or_else(|| {
        let channels = layer.channels.join(" ");
        Error::usage(format!("layer {:?} has the channels {channels}; JPEG files hold RGB or one channel", layer.name))
    })?;
    let scale = options.exposure_ev.exp2();
    let (codes_of, values) = (encoding::Codes::new(options.gamma), pixels.as_flattened());
    let mut codes = vec![0; values.len()];
    encoding::in_parts(&mut codes, 3, |first, part| {
        for (code, value) in part.iter_mut().zip(&values[3 * first..]) {
            *code = codes_of.of(encoding::clamp(value * scale));
        }
    });
    let mut out = Vec::new();
    JpegEncoder::new_with_quality(&mut out, quality)
        .encode(&codes, width, height, ExtendedColorType::Rgb8)
        .map_err(|error| Error::new(ErrorKind::Runtime, "JPEG encoding failed").caused_by(error))?;
    if !picture.metadata.is_empty() {
        insert_comments(&mut out, picture.metadata.to_json()?.as_bytes());
    }
    Ok(out)
}

/// After the start mark and the JFIF segment, which must be the first.
fn insert_comments(file: &mut Vec<u8>, text: &[u8]) {
    let at = match file[..] {
        [_, _, 0xff, 0xe0, high, low, ..] => 4 + usize::from(u16::from_be_bytes([high, low])),
        _ => 2,
    };
    let mut segments = Vec::new();
    for part in text.chunks(COMMENT_BYTES) {
        segments.extend_from_slice(&[0xff, 0xfe]);
        segments.extend_from_slice(&((2 + COMMENT.len() + part.len()) as u16).to_be_bytes());
        segments.extend_from_slice(COMMENT);
        segments.extend_from_slice(part);
    }
    file.splice(at..at, segments);
}

/// What our comments say; nothing for files of others.
pub(super) fn metadata(bytes: &[u8]) -> Result<Metadata> {
    let mut json = Vec::new();
    let mut rest = bytes.get(2..).unwrap_or_default();
    // Segments up to the start of the scan.
    while let [0xff, kind, high, low, after @ ..] = rest {
        let length = usize::from(u16::from_be_bytes([*high, *low]));
        let Some(body) = length.checked_sub(2).and_then(|length| after.get(..length)) else { break };
        if *kind == 0xda {
            break;
        }
        if let (0xfe, Some(text)) = (*kind, body.strip_prefix(COMMENT)) {
            json.extend_from_slice(text);
        }
        rest = &after[body.len()..];
    }
    if json.is_empty() {
        return Ok(Metadata::default());
    }
    Metadata::from_json(&String::from_utf8_lossy(&json)).map_err(|error| error.at("comment"))
}

/// Whether a JPEG file ends before its picture does, in whose place decoders put grey: there is no end mark after the start of the first
/// scan. Bytes 255 of pixels are followed by 0, so that they are no mark.
pub fn is_cut(bytes: &[u8]) -> bool {
    let mut rest = bytes.get(2..).unwrap_or_default();
    while let [0xff, kind, high, low, after @ ..] = rest {
        if *kind == 0xda {
            return !after.windows(2).any(|mark| mark == [0xff, 0xd9]);
        }
        let length = usize::from(u16::from_be_bytes([*high, *low]));
        let Some(tail) = length.checked_sub(2).and_then(|length| after.get(length..)) else { return true };
        rest = tail;
    }
    // Fill bytes or segments that are not known here: the decoder knows them better.
    false
}

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Layers> {
    let damaged = |error: image::ImageError| Error::input("damaged or not served").caused_by(error);
    let mut decoder = JpegDecoder::new(Cursor::new(bytes)).map_err(damaged)?;
    let (width, height) = decoder.dimensions();
    // Decoded as RGB codes and as three numbers a pixel.
    check_size(width.into(), height.into(), 3 * 5, limits)?;
    // A damaged EXIF segment or profile says nothing; the picture is still there.
    let held = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let profile = decoder.icc_profile().unwrap_or_default();
    let codes = image::DynamicImage::from_decoder(decoder).map_err(damaged)?.into_rgb8();
    let data = codes.into_raw().into_iter().map(srgb::decode_u8).collect();
    let (data, [width, height]) = orientation::upright(data, [width, height], 3, held, limits)?;
    // Text that is damaged does not make the picture unreadable; `metadata` says what is wrong with it.
    let metadata = metadata(bytes).unwrap_or_default();
    let mut warnings: Vec<String> = encoding::profile_warning(profile.as_deref()).into_iter().collect();
    if is_cut(bytes) {
        warnings.push("the file ends before its picture does; the rest is grey".into());
    }
    Ok(Layers { metadata, warnings, ..Layers::new(width, height).with(Layer::new("", &["R", "G", "B"], data)) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(side: u32) -> Layers {
        let value = |i: u32| 0.5 + 0.4 * (i as f32 * 0.01).sin();
        Layers::rgb(side, side, (0..side * side * 3).map(value).collect())
    }

    #[test]
    fn a_file_that_ends_early_is_told() {
        let (file, _) = crate::image::encode(crate::image::Format::Jpeg, &wave(64), &WriteOptions::default()).unwrap();
        let whole = decode(&file, &Limits::default()).unwrap();
        assert!(whole.warnings.is_empty());
        let more = decode(&[&file[..], b"maker's notes"].concat(), &Limits::default()).unwrap();
        assert_eq!(more, whole);
        let cut = decode(&file[..file.len() * 3 / 4], &Limits::default()).unwrap();
        assert_eq!(cut.warnings, ["the file ends before its picture does; the rest is grey"]);
    }

    #[test]
    fn codes_come_back_within_what_the_quality_allows() {
        let picture = wave(64);
        let error = |quality: u8| {
            let options = WriteOptions { jpeg_quality: quality, ..WriteOptions::default() };
            let bytes = encode(&picture, &picture.layers[0], &options).unwrap();
            let back = decode(&bytes, &Limits::default()).unwrap();
            let codes = |layers: &Layers| layers.layers[0].data.iter().map(|&v| srgb::encode_u8(v)).collect::<Vec<_>>();
            let differences = codes(&picture).into_iter().zip(codes(&back)).map(|(a, b)| u32::from(a.abs_diff(b)));
            (f64::from(differences.sum::<u32>()) / f64::from(64 * 64 * 3), bytes.len())
        };
        let ((fine, large), (coarse, small)) = (error(100), error(10));
        assert!(fine < 1.0 && coarse > fine && small < large, "{fine} {coarse}, {large} {small} bytes");
    }

    #[test]
    fn metadata_longer_than_a_segment_comes_back() {
        let metadata = Metadata { scene: "x".repeat(150_000), ..Metadata::default() };
        let picture = Layers { metadata, ..wave(16) };
        let bytes = encode(&picture, &picture.layers[0], &WriteOptions::default()).unwrap();
        assert_eq!(super::metadata(&bytes).unwrap(), picture.metadata);
        assert_eq!(decode(&bytes, &Limits::default()).unwrap().metadata, picture.metadata);
    }

    #[test]
    fn what_the_format_cannot_hold_is_refused() {
        let wide = Layers::rgb(65536, 1, vec![0.0; 3 * 65536]);
        let error = encode(&wide, &wide.layers[0], &WriteOptions::default()).unwrap_err();
        assert!(error.to_string().contains("at most 65535 a side"), "{error}");
        let options = WriteOptions { jpeg_quality: 0, ..WriteOptions::default() };
        assert!(encode(&wave(8), &wave(8).layers[0], &options).is_err());
    }
}
