//! Radiance .hdr (RGBE) files: all scan-line schemes, all orientations, the headers found in the wild.
//!
//! `PRIMARIES` are honoured, except the two that are written without a thought: Radiance's own default, whose equal-energy
//! white no program honours (such pixels are taken as Rec. 709), and zeros. XYZE files are converted.

use std::collections::BTreeMap;

use super::{Layer, Layers, Metadata, check_size, color::Chromaticities, zeroed};
use crate::{Error, Result, limits::Limits};

const MAGIC: [&[u8]; 2] = [b"#?RADIANCE", b"#?RGBE"];
/// Our metadata stands in comments of this prefix, broken where old readers would overrun their line buffers.
const COMMENT: &str = "# lucerna ";
const COMMENT_BYTES: usize = 1000;
const MAX_HEADER: usize = 1 << 20;

pub(super) fn sniff(bytes: &[u8]) -> bool {
    // Some programs put a line or two before the magic.
    MAGIC.iter().any(|magic| bytes.starts_with(magic))
        || bytes.starts_with(b"VIEW=")
        || bytes[..bytes.len().min(2048)].windows(8).any(|w| w == b"\nFORMAT=")
}

pub(super) fn encode(picture: &Layers, layer: &Layer) -> Result<Vec<u8>> {
    let pixels = layer.rgb_pixels().ok_or_else(|| {
        let channels = layer.channels.join(" ");
        Error::usage(format!("layer {:?} has the channels {channels}; .hdr files hold RGB or one channel", layer.name))
    })?;
    let mut out = b"#?RADIANCE\n".to_vec();
    if !picture.metadata.is_empty() {
        // ASCII, so any byte is the boundary of a character.
        let json = picture.metadata.to_json()?;
        for part in json.as_bytes().chunks(COMMENT_BYTES) {
            out.extend_from_slice(COMMENT.as_bytes());
            out.extend_from_slice(part);
            out.push(b'\n');
        }
    }
    out.extend_from_slice(b"FORMAT=32-bit_rle_rgbe\n\n");
    out.extend_from_slice(format!("-Y {} +X {}\n", picture.height, picture.width).as_bytes());
    let width = picture.width as usize;
    for row in pixels.chunks_exact(width) {
        let rgbe: Vec<[u8; 4]> = row.iter().map(|&pixel| to_rgbe(pixel)).collect();
        if !(8..0x8000).contains(&width) {
            out.extend_from_slice(rgbe.as_flattened());
            continue;
        }
        out.extend_from_slice(&[2, 2, (width >> 8) as u8, width as u8]);
        for component in 0..4 {
            let line: Vec<u8> = rgbe.iter().map(|pixel| pixel[component]).collect();
            run_lengths(&line, &mut out);
        }
    }
    Ok(out)
}

/// Runs of four and more as (128 + length, value), the rest as (length, values…).
fn run_lengths(line: &[u8], out: &mut Vec<u8>) {
    let run_at = |i: usize| line[i..].iter().take(127).take_while(|&&b| b == line[i]).count();
    let mut i = 0;
    while i < line.len() {
        let run = run_at(i);
        if run >= 4 {
            out.extend_from_slice(&[128 + run as u8, line[i]]);
            i += run;
            continue;
        }
        let start = i;
        while i < line.len() && i - start < 128 && run_at(i) < 4 {
            i += 1;
        }
        out.push((i - start) as u8);
        out.extend_from_slice(&line[start..i]);
    }
}

/// Shared-exponent encoding (Ward 1991), nearest mantissa. NaN and negative values become 0, infinity the largest value.
fn to_rgbe(pixel: [f32; 3]) -> [u8; 4] {
    let largest = 255.0 * 2f32.powi(119);
    // `max` drops NaN.
    let [r, g, b] = pixel.map(|value| value.max(0.0).min(largest));
    let brightest = r.max(g).max(b);
    // 2^-126: below, the exponent does not stand in the bits.
    if brightest < f32::MIN_POSITIVE {
        return [0; 4];
    }
    // brightest = m · 2^exponent, 0.5 ≤ m < 1, from the bits: exact where log2 is not.
    let mut exponent = ((brightest.to_bits() >> 23) as i32) - 126;
    let mantissas = |exponent: i32| {
        let scale = 2f64.powi(8 - exponent);
        [r, g, b].map(|value| (f64::from(value) * scale).round())
    };
    let mut codes = mantissas(exponent);
    if codes.iter().any(|&code| code > 255.0) {
        exponent += 1;
        codes = mantissas(exponent);
    }
    let [r, g, b] = codes.map(|code| code as u8);
    match u8::try_from(exponent + 128) {
        Ok(e) if e > 0 => [r, g, b, e],
        Ok(_) => [0; 4],
        Err(_) if exponent > 0 => [255, 255, 255, 255],
        Err(_) => [0; 4],
    }
}

/// Without the half step that Radiance adds: codes are written rounded here and by most programs.
fn from_rgbe([r, g, b, e]: [u8; 4]) -> [f32; 3] {
    if e == 0 {
        return [0.0; 3];
    }
    let scale = 2f64.powi(i32::from(e) - 136);
    [r, g, b].map(|code| (f64::from(code) * scale) as f32)
}

struct Header<'a> {
    xyze: bool,
    /// What pixels are divided by to give radiance: EXPOSURE · COLORCORR, each the product of all its lines.
    exposure: [f32; 3],
    /// Height of a pixel over its width, the product of all its lines.
    aspect: f32,
    /// Of the last `PRIMARIES` line, unless it says nothing.
    primaries: Option<Chromaticities>,
    json: String,
    variables: BTreeMap<String, String>,
    /// File axes: the slow one, the fast one.
    axes: [Axis; 2],
    pixels: &'a [u8],
}

#[derive(Clone, Copy)]
struct Axis {
    /// X when true, else Y.
    x: bool,
    /// Coordinates fall (`-`) as the file goes on.
    falling: bool,
    size: u32,
}

impl<'a> Header<'a> {
    fn parse(bytes: &'a [u8]) -> Result<Self> {
        let header_error = |what: String| Error::input(what).at("header");
        let mut header = Self {
            xyze: false,
            exposure: [1.0; 3],
            aspect: 1.0,
            primaries: None,
            json: String::new(),
            variables: BTreeMap::new(),
            axes: [Axis { x: false, falling: true, size: 0 }; 2],
            pixels: &[],
        };
        let (mut rest, mut line_number) = (bytes, 0);
        loop {
            if bytes.len() - rest.len() > MAX_HEADER {
                return Err(header_error(format!("longer than {MAX_HEADER} bytes")));
            }
            let end = rest.iter().take(MAX_HEADER).position(|&b| b == b'\n');
            let end = end.ok_or_else(|| header_error("ends without a line -Y HEIGHT +X WIDTH".into()))?;
            let line = rest[..end].strip_suffix(b"\r").unwrap_or(&rest[..end]);
            rest = &rest[end + 1..];
            line_number += 1;
            let line = String::from_utf8_lossy(line);
            if let Some(axes) = parse_resolution(&line).map_err(|e| e.at(format!("line {line_number}")))? {
                header.axes = axes;
                header.pixels = rest;
                return Ok(header);
            }
            if let Some(json) = line.strip_prefix(COMMENT) {
                header.json.push_str(json);
            } else if let Some((name, value)) = line.split_once('=').filter(|_| !line.starts_with('#')) {
                header.variable(name.trim(), value.trim()).map_err(|e| e.at(format!("line {line_number}")))?;
            }
        }
    }

    fn variable(&mut self, name: &str, value: &str) -> Result<()> {
        let numbers = || -> Option<Vec<f32>> { value.split_whitespace().map(|word| word.parse().ok()).collect() };
        let factors = |count: usize| {
            numbers().filter(|n| n.len() == count && n.iter().all(|f| f.is_normal() && *f > 0.0)).ok_or_else(|| {
                Error::input(format!(
                    "{name}={value} must be {}",
                    if count == 1 { "a positive number" } else { "three positive numbers" }
                ))
            })
        };
        match name {
            "FORMAT" => match value {
                "32-bit_rle_rgbe" => self.xyze = false,
                "32-bit_rle_xyze" => self.xyze = true,
                _ => return Err(Error::input(format!("the format {value:?} is neither 32-bit_rle_rgbe nor _xyze"))),
            },
            "PRIMARIES" => {
                let eight = numbers().and_then(|n| <[f32; 8]>::try_from(n).ok()).ok_or_else(|| {
                    Error::input(format!("{name}={value} must be 8 numbers: x and y of red, green, blue and white"))
                })?;
                self.primaries = primaries(eight);
            }
            "EXPOSURE" => {
                let factor = factors(1)?[0];
                self.exposure = self.exposure.map(|e| e * factor);
            }
            "PIXASPECT" => self.aspect *= factors(1)?[0],
            "COLORCORR" => {
                let factors = factors(3)?;
                self.exposure = std::array::from_fn(|i| self.exposure[i] * factors[i]);
            }
            _ => {}
        }
        if self.variables.len() < 1000 {
            self.variables.insert(name.to_owned(), value.to_owned());
        }
        Ok(())
    }

    fn metadata(&self) -> Result<Metadata> {
        if self.json.is_empty() {
            Ok(Metadata { extra: self.variables.clone(), ..Metadata::default() })
        } else {
            Metadata::from_json(&self.json)
        }
    }
}

/// Red, green, blue and white; `None` for Rec. 709, Radiance's default and zeros.
fn primaries(numbers: [f32; 8]) -> Option<Chromaticities> {
    const RADIANCE: [f32; 8] = [0.64, 0.33, 0.29, 0.6, 0.15, 0.06, 1.0 / 3.0, 1.0 / 3.0];
    let is = |other: [f32; 8]| numbers.iter().zip(other).all(|(a, b)| (a - b).abs() < 2e-3);
    if is(RADIANCE) || is([0.0; 8]) {
        return None;
    }
    let [[red, green], [blue, white]] = bytemuck::cast::<_, [[[f32; 2]; 2]; 2]>(numbers);
    Some(Chromaticities { red, green, blue, white })
}

/// `-Y 512 +X 768` and its seven siblings; `None` for other lines.
fn parse_resolution(line: &str) -> Result<Option<[Axis; 2]>> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [a, first, b, second] = words[..] else { return Ok(None) };
    let axis = |name: &str, size: &str| -> Option<Result<Axis>> {
        let (x, falling) = match name {
            "+X" => (true, false),
            "-X" => (true, true),
            "+Y" => (false, false),
            "-Y" => (false, true),
            _ => return None,
        };
        let size = size.parse().map_err(|_| Error::input(format!("{size:?} is no size")));
        Some(size.map(|size| Axis { x, falling, size }))
    };
    match (axis(a, first), axis(b, second)) {
        (Some(slow), Some(fast)) => {
            let axes = [slow?, fast?];
            if axes[0].x == axes[1].x {
                return Err(Error::input(format!("{line:?} names one axis twice")));
            }
            Ok(Some(axes))
        }
        _ => Ok(None),
    }
}

pub(super) fn metadata(bytes: &[u8]) -> Result<Metadata> {
    Header::parse(bytes)?.metadata()
}

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Layers> {
    let header = Header::parse(bytes)?;
    let [slow, fast] = header.axes;
    let (width, height) = if fast.x { (fast.size, slow.size) } else { (slow.size, fast.size) };
    let needed = check_size(width.into(), height.into(), 12, limits)?;
    // The densest scheme repeats a pixel 255 · 256^k times in 4 · (k + 1) bytes: a line takes at least 4 bytes.
    if header.pixels.len() < 4 * slow.size as usize {
        return Err(short(0, slow.size));
    }
    let to_rec709 = if header.xyze {
        let xyz = Chromaticities { red: [1.0, 0.0], green: [0.0, 1.0], blue: [0.0, 0.0], white: [1.0 / 3.0; 2] };
        xyz.rec709_from_rgb()?
    } else {
        let matrix = header.primaries.map(|primaries| primaries.rec709_from_rgb());
        matrix.transpose().map_err(|error| error.at("header.PRIMARIES"))?.flatten()
    };
    let mut data = zeroed(needed / 4)?;
    let mut line = vec![[0; 4]; fast.size as usize];
    let mut rest = header.pixels;
    for i in 0..slow.size {
        read_line(&mut rest, &mut line).ok_or_else(|| short(i, slow.size))?;
        for (j, &rgbe) in line.iter().enumerate() {
            let place = |axis: Axis, k: u32| if axis.falling { axis.size - 1 - k } else { k };
            let (along_slow, along_fast) = (place(slow, i), place(fast, j as u32));
            let (x, y) = if fast.x { (along_fast, along_slow) } else { (along_slow, along_fast) };
            let mut rgb = from_rgbe(rgbe);
            if let Some(matrix) = to_rec709 {
                rgb = (matrix * glam::Vec3::from_array(rgb)).to_array();
            }
            // File coordinates have Y up, the image has its top row first.
            let pixel = (height - 1 - y) as usize * width as usize + x as usize;
            for c in 0..3 {
                data[3 * pixel + c] = rgb[c] / header.exposure[c];
            }
        }
    }
    let layer = Layer { precision: super::Precision::Full, ..Layer::new("", &["R", "G", "B"], data) };
    let mut picture = Layers { metadata: header.metadata()?, ..Layers::new(width, height).with(layer) };
    // Two factors that cancel each other may leave a rounding.
    if (header.aspect - 1.0).abs() > 1e-5 {
        let aspect = header.aspect;
        picture.warnings.push(format!("its pixels are {aspect} times as high as wide, and are taken as squares"));
    }
    Ok(picture)
}

fn short(line: u32, lines: u32) -> Error {
    Error::input(format!("ends or is damaged in line {line} of {lines}")).at("pixels")
}

/// One scan line in the newer run-length scheme (a component after another), or the older one (pixels, (1, 1, 1, n)
/// repeats), of which flat pixels are a case. `None`: the data ends or does not fit.
fn read_line(rest: &mut &[u8], line: &mut [[u8; 4]]) -> Option<()> {
    let width = line.len();
    if let [2, 2, high @ 0..0x80, low, after @ ..] = *rest
        && (8..0x8000).contains(&width)
        && width == usize::from(*high) << 8 | usize::from(*low)
    {
        *rest = after;
        for component in 0..4 {
            let mut x = 0;
            while x < width {
                let (&code, tail) = rest.split_first()?;
                let count = usize::from(if code > 128 { code - 128 } else { code });
                if count == 0 || x + count > width {
                    return None;
                }
                let used = if code > 128 { 1 } else { count };
                let values = tail.get(..used)?;
                for (k, pixel) in line[x..x + count].iter_mut().enumerate() {
                    pixel[component] = values[if code > 128 { 0 } else { k }];
                }
                *rest = &tail[used..];
                x += count;
            }
        }
        return Some(());
    }
    let (mut x, mut shift) = (0, 0u32);
    while x < width {
        let (&pixel, tail) = rest.split_first_chunk::<4>()?;
        *rest = tail;
        if pixel[..3] == [1, 1, 1] {
            let count = usize::from(pixel[3]).checked_shl(shift).filter(|_| shift <= 24)?;
            let previous = *line.get(x.checked_sub(1)?)?;
            line.get_mut(x..x.checked_add(count)?)?.fill(previous);
            x += count;
            shift += 8;
        } else {
            line[x] = pixel;
            x += 1;
            shift = 0;
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_normal_code_survives_a_round_trip() {
        // The brightest mantissa of a normalised code is at least 128; with exponent 3 that is the smallest normal f32.
        for e in 3..=255u8 {
            for m in [128, 129, 200, 254, 255] {
                for other in [0, 1, 77, m] {
                    let code = [m, other, m / 2, e];
                    assert_eq!(to_rgbe(from_rgbe(code)), code);
                }
            }
        }
    }

    #[test]
    fn what_rgbe_cannot_hold() {
        assert_eq!(to_rgbe([f32::NAN, -1.0, 0.0]), [0; 4]);
        assert_eq!(to_rgbe([f32::INFINITY, 0.0, 0.0]), [255, 0, 0, 255]);
        assert_eq!(to_rgbe([f32::MAX; 3]), [255; 4]);
        assert_eq!(to_rgbe([1e-40; 3]), [0; 4]);
        // 255.7 of 256 rounds over the mantissa: the exponent must rise.
        assert_eq!(to_rgbe([255.7 / 256.0, 0.0, 0.0]), [128, 0, 0, 129]);
    }

    #[test]
    fn relative_error_is_within_half_a_code() {
        let mut x = 1e-30f32;
        while x < 1e30 {
            let y = from_rgbe(to_rgbe([x, 0.0, 0.0]))[0];
            assert!((y - x).abs() <= x / 256.0, "{x} became {y}");
            x *= 1.37;
        }
    }

    #[test]
    fn all_eight_orientations_give_one_image() {
        // Two columns, three rows; flat pixels, green counts x, blue counts rows from the top.
        for slow_x in [false, true] {
            for (slow_sign, fast_sign) in [('-', '+'), ('-', '-'), ('+', '+'), ('+', '-')] {
                let (slow, fast) = if slow_x { (("X", 2), ("Y", 3)) } else { (("Y", 3), ("X", 2)) };
                let mut file = format!(
                    "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{slow_sign}{} {} {fast_sign}{} {}\n",
                    slow.0, slow.1, fast.0, fast.1
                )
                .into_bytes();
                for i in 0..slow.1 {
                    for j in 0..fast.1 {
                        let along = |sign, k, size| if sign == '-' { size - 1 - k } else { k };
                        let (a, b) = (along(slow_sign, i, slow.1), along(fast_sign, j, fast.1));
                        let (x, y_up) = if slow_x { (a, b) } else { (b, a) };
                        file.extend([128, 10 * x, 10 * (2 - y_up), 128]);
                    }
                }
                let image = decode(&file, &Limits::default()).unwrap();
                assert_eq!((image.width, image.height), (2, 3));
                for (i, p) in image.layers[0].data.chunks(3).enumerate() {
                    let expected = [0.5, 10.0 * (i % 2) as f32 / 256.0, 10.0 * (i / 2) as f32 / 256.0];
                    assert_eq!(p, expected, "pixel {i} of {slow_sign}{} {fast_sign}{}", slow.0, fast.0);
                }
            }
        }
    }

    #[test]
    fn primaries_are_honoured_unless_they_say_nothing() {
        let pixel = |primaries: &str| {
            let file = format!("#?RADIANCE\nPRIMARIES={primaries}\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 1\n");
            decode(&[file.as_bytes(), &[128, 64, 32, 128]].concat(), &Limits::default())
                .map(|i| i.layers[0].data.clone())
        };
        let plain = [0.5, 0.25, 0.125];
        assert_eq!(pixel("0.6400 0.3300 0.2900 0.6000 0.1500 0.0600 0.3333 0.3333").unwrap(), plain);
        assert_eq!(pixel("0 0 0 0 0 0 0 0").unwrap(), plain);
        assert_eq!(pixel("0.64 0.33 0.3 0.6 0.15 0.06 0.3127 0.329").unwrap(), plain);
        // Rec. 2020 to Rec. 709 (ITU-R BT.2087, inverse of M2).
        let wide = pixel("0.708 0.292 0.170 0.797 0.131 0.046 0.3127 0.329").unwrap();
        let rows = [[1.6605, -0.5876, -0.0728], [-0.1246, 1.1329, -0.0083], [-0.0182, -0.1006, 1.1187]];
        for (value, row) in wide.iter().zip(rows) {
            let expected: f32 = row.iter().zip(plain).map(|(a, b)| a * b).sum();
            assert!((value - expected).abs() < 1e-3, "{wide:?}");
        }
        for bad in ["1 2 3", "a b c d e f g h", "0.1 0.1 0.2 0.2 0.3 0.3 0.3 0.3"] {
            assert!(pixel(bad).unwrap_err().to_string().contains("PRIMARIES"), "{bad}");
        }
    }

    #[test]
    fn exposure_lines_multiply_and_are_divided_out() {
        let file = b"#?RGBE\nEXPOSURE= 2.0\nEXPOSURE=4\nCOLORCORR=1 2 4\n\n-Y 1 +X 1\n\x80\x80\x80\x84";
        let image = decode(file, &Limits::default()).unwrap();
        assert_eq!(image.layers[0].data, [1.0, 0.5, 0.25]);
        let error = decode(b"#?RGBE\nEXPOSURE=0\n\n-Y 1 +X 1\n\x80\x80\x80\x84", &Limits::default()).unwrap_err();
        assert!(error.to_string().starts_with("line 2: EXPOSURE=0"), "{error}");
    }

    #[test]
    fn pixels_that_are_no_squares_are_told_of() {
        let warnings = |lines: &str| {
            let file = [format!("#?RADIANCE\n{lines}\n-Y 1 +X 1\n").as_bytes(), b"\x80\x80\x80\x84"].concat();
            decode(&file, &Limits::default()).map(|picture| picture.warnings)
        };
        assert_eq!(
            warnings("PIXASPECT=2\n").unwrap(),
            ["its pixels are 2 times as high as wide, and are taken as squares"]
        );
        assert!(
            warnings("PIXASPECT=1\n").unwrap().is_empty()
                && warnings("PIXASPECT=2\nPIXASPECT=0.5\n").unwrap().is_empty()
        );
        assert!(warnings("PIXASPECT=0\n").unwrap_err().to_string().contains("PIXASPECT=0"));
    }
}
