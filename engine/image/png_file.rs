//! PNG files: sRGB-encoded on disk, linear in memory; normals, depth and other numbers mapped straight.

use std::io::Cursor;

use image::metadata::Orientation;

use super::{
    Chromaticities, Layer, Layers, Metadata, Report, WriteOptions, check_size,
    encoding::{self, clamp},
    orientation, srgb, zeroed,
};
use crate::{Error, ErrorKind, Result, limits::Limits};

/// Keyword of the iTXt chunk with the metadata.
const KEYWORD: &str = "lucerna";
/// Keyword of the iTXt chunk that says what codes of numbers mean.
const MAPPING: &str = "lucerna mapping";

pub(super) fn encode(picture: &Layers, layer: &Layer, options: &WriteOptions, report: &mut Report) -> Result<Vec<u8>> {
    let colours = layer.colours().ok_or_else(|| {
        let channels = layer.channels.join(" ");
        Error::usage(format!("layer {:?} has the channels {channels}; PNG files hold RGB or one channel", layer.name))
    })?;
    let alpha = layer.channel("A").filter(|_| layer.channels.len() > 1);
    let grey = layer.channels.len() - usize::from(alpha.is_some()) == 1;
    let colours = &colours[..if grey { 1 } else { 3 }];
    report.alpha_left_out =
        !options.keep_alpha && alpha.is_some_and(|alpha| hides_light(layer, colours, alpha, options));
    let alpha = alpha.filter(|_| !report.alpha_left_out);
    let depth = match options.png_bits {
        8 => png::BitDepth::Eight,
        16 => png::BitDepth::Sixteen,
        bits => return Err(Error::usage(format!("{bits} bits a channel: PNG files are written with 8 or 16"))),
    };
    let mapping = Mapping::of(layer);
    let source = Samples { layer, colours, alpha, mapping, options };
    let samples = if depth == png::BitDepth::Eight { source.eight_bits() } else { source.sixteen_bits() };
    let fail = |error: png::EncodingError| Error::new(ErrorKind::Runtime, "PNG encoding failed").caused_by(error);
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, picture.width, picture.height);
    encoder.set_color(match (grey, alpha.is_some()) {
        (true, false) => png::ColorType::Grayscale,
        (true, true) => png::ColorType::GrayscaleAlpha,
        (false, false) => png::ColorType::Rgb,
        (false, true) => png::ColorType::Rgba,
    });
    encoder.set_depth(depth);
    // Seven times as fast as the default, for files of about the same size.
    encoder.set_compression(png::Compression::Fast);
    match mapping {
        Mapping::Colour => match options.gamma {
            None => encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric),
            Some(gamma) => encoder.set_source_gamma(png::ScaledFloat::new(1.0 / gamma)),
        },
        // Numbers, not colours: without a statement about colour, but with one about the numbers.
        Mapping::Affine { black, white } => {
            let text = format!("{}: value = {black} + code * {}", layer.name, white - black);
            encoder.add_itxt_chunk(MAPPING.to_owned(), text).map_err(fail)?;
        }
    }
    if !picture.metadata.is_empty() {
        encoder.add_itxt_chunk(KEYWORD.to_owned(), picture.metadata.to_json()?).map_err(fail)?;
    }
    let mut writer = encoder.write_header().map_err(fail)?;
    writer.write_image_data(&samples).map_err(fail)?;
    writer.finish().map_err(fail)?;
    Ok(out)
}

/// What a PNG file of eight bits would show on a screen: red, green and blue of each pixel, alpha left out.
pub(super) fn screen(layer: &Layer, options: &WriteOptions) -> Result<Vec<[u8; 3]>> {
    let colours = layer.colours().ok_or_else(|| {
        Error::usage(format!(
            "layer {:?} has the channels {}; a screen shows RGB or one channel",
            layer.name,
            layer.channels.join(" ")
        ))
    })?;
    let source = Samples { layer, colours: &colours, alpha: None, mapping: Mapping::of(layer), options };
    Ok(source.eight_bits().as_chunks::<3>().0.to_vec())
}

/// Share of the light of a picture that may lie where alpha is none: a pixel or two at the rim of a mask.
const HIDDEN: f64 = 0.01;

/// Whether a picture of premultiplied colour has light where alpha is 0 in eight bits, and no unassociated colour could show it. Where there is
/// a little alpha, colours end at 1 as those of opaque pixels do.
fn hides_light(layer: &Layer, colours: &[usize], alpha: usize, options: &WriteOptions) -> bool {
    let scale = options.exposure_ev.exp2();
    let (mut all, mut hidden) = (0.0, 0.0);
    for pixel in layer.data.chunks_exact(layer.channels.len()) {
        let light: f64 = colours.iter().map(|&channel| f64::from(clamp(pixel[channel] * scale))).sum();
        all += light;
        if encoding::eight_bits(clamp(pixel[alpha])) == 0 {
            hidden += light;
        }
    }
    hidden > HIDDEN * all
}

/// Where the samples of a file come from.
struct Samples<'a> {
    layer: &'a Layer,
    /// Positions of one or three channels.
    colours: &'a [usize],
    alpha: Option<usize>,
    mapping: Mapping,
    options: &'a WriteOptions,
}

impl Samples<'_> {
    /// Samples of a pixel.
    fn count(&self) -> usize {
        self.colours.len() + usize::from(self.alpha.is_some())
    }

    /// Each sample by `colour` from light in [0, 1], or by `number` from a code in [0, 1].
    fn fill<T: Copy + Default + Send>(
        &self,
        colour: impl Fn(f32) -> T + Sync,
        number: impl Fn(f32) -> T + Sync,
    ) -> Vec<T> {
        let scale = self.options.exposure_ev.exp2();
        let (channels, count) = (self.layer.channels.len(), self.count());
        let mut samples = vec![T::default(); self.layer.data.len() / channels * count];
        encoding::in_parts(&mut samples, count, |first, part| {
            let pixels = self.layer.data[first * channels..].chunks_exact(channels);
            for (out, pixel) in part.chunks_exact_mut(count).zip(pixels) {
                let alpha = self.alpha.map(|a| clamp(pixel[a]));
                let unassociate = match alpha {
                    Some(a) if a > 0.0 && a < 1.0 => scale / a,
                    _ => scale,
                };
                for (out, &c) in out.iter_mut().zip(self.colours) {
                    *out = match self.mapping {
                        Mapping::Colour => colour(clamp(pixel[c] * unassociate)),
                        Mapping::Affine { black, white } => number(clamp((pixel[c] - black) / (white - black))),
                    };
                }
                if let Some(a) = alpha {
                    out[count - 1] = number(clamp(a));
                }
            }
        });
        samples
    }

    fn eight_bits(&self) -> Vec<u8> {
        let codes = encoding::Codes::new(self.options.gamma);
        self.fill(|light| codes.of(light), encoding::eight_bits)
    }

    fn sixteen_bits(&self) -> Vec<u8> {
        let code = |code: f32| ((code * 65535.0 + 0.5) as u16).to_be_bytes();
        self.fill(|light| code(encoding::encode(light, self.options.gamma)), code).into_flattened()
    }
}

/// Depth from here on is that of the background, and must not stretch the range. Metres.
const SKY: f32 = 1e9;

/// How values become codes between 0 and 1.
#[derive(Clone, Copy)]
enum Mapping {
    /// sRGB, with exposure.
    Colour,
    /// Straight between two values, for what is no colour.
    Affine { black: f32, white: f32 },
}

impl Mapping {
    /// Normals from −1 to 1; depth from far (black) to near (white); other numbers from their smallest to their largest.
    fn of(layer: &Layer) -> Self {
        let depth = layer.name == "depth" || layer.channels == ["Z"];
        if layer.name == "normal" {
            return Self::Affine { black: -1.0, white: 1.0 };
        }
        if !depth && layer.channels.iter().all(|c| matches!(c.as_str(), "R" | "G" | "B" | "A" | "Y")) {
            return Self::Colour;
        }
        let finite = || layer.data.iter().copied().filter(|value| value.abs() < SKY);
        let (least, most) = (finite().fold(f32::INFINITY, f32::min), finite().fold(f32::NEG_INFINITY, f32::max));
        match (least < most, depth) {
            (false, _) => Self::Affine { black: 0.0, white: 1.0 },
            (true, true) => Self::Affine { black: most, white: least },
            (true, false) => Self::Affine { black: least, white: most },
        }
    }
}

fn open<'a>(bytes: &'a [u8], limits: &Limits) -> Result<png::Reader<Cursor<&'a [u8]>>> {
    let bytes_limit = usize::try_from(limits.max_alloc).unwrap_or(usize::MAX);
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), png::Limits { bytes: bytes_limit });
    decoder.set_transformations(png::Transformations::EXPAND);
    decoder.read_info().map_err(damaged)
}

fn damaged(error: png::DecodingError) -> Error {
    Error::input("PNG decoding failed").caused_by(error)
}

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Layers> {
    let mut reader = open(bytes, limits)?;
    let (width, height) = reader.info().size();
    let (colour, depth) = reader.output_color_type();
    let names: &[&str] = match colour {
        png::ColorType::Grayscale => &["Y"],
        png::ColorType::GrayscaleAlpha => &["Y", "A"],
        png::ColorType::Rgba => &["R", "G", "B", "A"],
        _ => &["R", "G", "B"],
    };
    let wide = depth == png::BitDepth::Sixteen;
    // The encoded bytes and the floats stand side by side.
    let per_pixel = names.len() as u64 * if wide { 6 } else { 5 };
    check_size(width.into(), height.into(), per_pixel, limits)?;
    let count = width as usize * height as usize * names.len();
    let size = reader.output_buffer_size().ok_or_else(|| Error::input("too large for this machine"))?;
    let mut encoded = vec![0; size];
    reader.next_frame(&mut encoded).map_err(damaged)?;
    let transfer = Transfer::of(reader.info());
    let mut data = zeroed(count)?;
    let alpha = names.iter().position(|&name| name == "A");
    for (i, value) in data.iter_mut().enumerate() {
        let code = if wide {
            f32::from(u16::from_be_bytes([encoded[2 * i], encoded[2 * i + 1]])) / 65535.0
        } else {
            f32::from(encoded[i]) / 255.0
        };
        *value = if Some(i % names.len()) == alpha { code } else { transfer.decode(code) };
    }
    drop(encoded);
    if let Some(alpha) = alpha {
        for pixel in data.chunks_exact_mut(names.len()) {
            let a = pixel[alpha];
            pixel[..alpha].iter_mut().for_each(|value| *value *= a);
        }
    }
    // Text chunks and EXIF data may stand after the pixels.
    let _ = reader.finish();
    let info = reader.info();
    let mut warnings = colour_warnings(info);
    if names.len() >= 3 {
        to_rec709(info, names.len(), &mut data, &mut warnings);
    }
    let metadata = text(info)?;
    let held =
        info.exif_metadata.as_deref().and_then(Orientation::from_exif_chunk).unwrap_or(Orientation::NoTransforms);
    let (data, [width, height]) = orientation::upright(data, [width, height], names.len(), held, limits)?;
    Ok(Layers { metadata, warnings, ..Layers::new(width, height).with(Layer::new("", names, data)) })
}

/// What the file says about its colours and is not followed.
fn colour_warnings(info: &png::Info<'_>) -> Vec<String> {
    let Some(points) = info.coding_independent_code_points.as_ref() else {
        return encoding::profile_warning(info.icc_profile.as_deref()).into_iter().collect();
    };
    // ITU-T H.273: Rec. 709 primaries, and the sRGB curve.
    if (points.color_primaries, points.transfer_function) == (1, 13) {
        return vec![];
    }
    let (primaries, transfer) = (points.color_primaries, points.transfer_function);
    vec![format!(
        "its cICP chunk (primaries {primaries}, transfer {transfer}) is not followed; its colours are taken as sRGB"
    )]
}

/// Converts colours of the primaries that a cHRM chunk names, unless a chunk that goes before it is there.
fn to_rec709(info: &png::Info<'_>, channels: usize, data: &mut [f32], warnings: &mut Vec<String>) {
    let stronger = info.srgb.is_some() || info.icc_profile.is_some() || info.coding_independent_code_points.is_some();
    let Some(given) = info.chrm_chunk.filter(|_| !stronger) else { return };
    let pair = |(x, y): (png::ScaledFloat, png::ScaledFloat)| [x.into_value(), y.into_value()];
    let primaries = Chromaticities {
        red: pair(given.red),
        green: pair(given.green),
        blue: pair(given.blue),
        white: pair(given.white),
    };
    match primaries.rec709_from_rgb() {
        Ok(None) => {}
        Ok(Some(matrix)) => {
            for pixel in data.chunks_exact_mut(channels) {
                let colour = matrix * glam::Vec3::from_slice(pixel);
                pixel[..3].copy_from_slice(&colour.to_array());
            }
        }
        Err(error) => warnings.push(format!("its primaries (cHRM) are not followed: {error}")),
    }
}

pub(super) fn metadata(bytes: &[u8], limits: &Limits) -> Result<Metadata> {
    let mut reader = open(bytes, limits)?;
    // Only files whose text stands after the pixels need those read.
    let before = text(reader.info())?;
    if !before.is_empty() {
        return Ok(before);
    }
    let _ = reader.finish();
    text(reader.info())
}

fn text(info: &png::Info<'_>) -> Result<Metadata> {
    for chunk in &info.utf8_text {
        if chunk.keyword == KEYWORD {
            let json = chunk.get_text().map_err(|error| Error::input("damaged text").caused_by(error).at("iTXt"))?;
            return Metadata::from_json(&json).map_err(|error| error.at("iTXt"));
        }
    }
    let mut metadata = Metadata::default();
    for chunk in &info.uncompressed_latin1_text {
        metadata.extra.insert(chunk.keyword.clone(), chunk.text.clone());
    }
    for chunk in &info.utf8_text {
        metadata.extra.insert(chunk.keyword.clone(), chunk.get_text().unwrap_or_default());
    }
    Ok(metadata)
}

/// How codes become light: sRGB unless the file says another gamma and not sRGB.
enum Transfer {
    Srgb,
    Gamma(f32),
}

impl Transfer {
    fn of(info: &png::Info<'_>) -> Self {
        match info.gama_chunk.map(|gamma| gamma.into_value()) {
            // 1/2.2 is how programs without an sRGB chunk say sRGB.
            Some(gamma) if info.srgb.is_none() && gamma > 0.01 && (gamma - 1.0 / 2.2).abs() > 0.005 => {
                Self::Gamma(1.0 / gamma)
            }
            _ => Self::Srgb,
        }
    }

    fn decode(&self, code: f32) -> f32 {
        match self {
            Self::Srgb => srgb::decode(code),
            Self::Gamma(exponent) => code.powf(*exponent),
        }
    }
}
