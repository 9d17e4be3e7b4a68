//! Pictures of other programs: hidden colours, orientation, primaries, profiles.

use std::borrow::Cow;

use ::image::{DynamicImage, RgbImage, metadata::Orientation};
use lucerna::image::{self, Format, Layers, WriteOptions, srgb};

fn read(bytes: &[u8]) -> Layers {
    image::decode(bytes, &Default::default()).unwrap()
}

/// A PNG file of another program, with `info` changed before it is written.
fn png(
    colour: png::ColorType,
    [width, height]: [u32; 2],
    codes: &[u8],
    change: impl Fn(&mut png::Info<'_>),
) -> Vec<u8> {
    let mut out = Vec::new();
    let mut info = png::Info::with_size(width, height);
    (info.color_type, info.bit_depth) = (colour, png::BitDepth::Eight);
    change(&mut info);
    let mut writer = png::Encoder::with_info(&mut out, info).unwrap().write_header().unwrap();
    writer.write_image_data(codes).unwrap();
    writer.finish().unwrap();
    out
}

/// PNG files hold unassociated colour, so that of a pixel of alpha 0 is not to be seen.
#[test]
fn colour_that_alpha_hides_is_black() {
    let codes = [255, 255, 255, 0, 255, 0, 0, 255, 255, 255, 255, 51, 0, 0, 0, 0];
    let picture = read(&png(png::ColorType::Rgba, [4, 1], &codes, |_| {}));
    let fifth = 0.2;
    let expected = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, fifth, fifth, fifth, fifth, 0.0, 0.0, 0.0, 0.0];
    let layer = picture.main().unwrap();
    assert!(layer.data.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{:?}", layer.data);
    assert_eq!(layer.channels, ["R", "G", "B", "A"]);
    let grey = read(&png(png::ColorType::GrayscaleAlpha, [2, 1], &[200, 0, 255, 255], |_| {}));
    assert_eq!(grey.main().unwrap().data, [0.0, 0.0, 1.0, 1.0]);
    // The same with measures.
    let seen = lucerna::measure::Picture::from_layers(&picture, None).unwrap();
    assert_eq!(seen.pixels[0], [0.0; 3]);
}

/// A flame has light and no alpha (openexr-images' CandleGlass: 88 % of the pixels): viewers of a PNG file with its alpha would show black.
#[test]
fn light_that_alpha_would_hide_is_written_as_seen_over_black() {
    let flame = Layers::rgba(3, 1, vec![0.8, 0.4, 0.1, 0.0, 0.2, 0.2, 0.2, 1.0, 0.0, 0.0, 0.0, 0.0]);
    let (file, report) = image::encode(Format::Png, &flame, &WriteOptions::default()).unwrap();
    assert!(report.alpha_left_out);
    let back = read(&file);
    let layer = back.main().unwrap();
    assert_eq!(layer.channels, ["R", "G", "B"]);
    for (i, (found, expected)) in layer.data.chunks(3).zip([[0.8, 0.4, 0.1], [0.2; 3], [0.0; 3]]).enumerate() {
        let near = |(a, b): (&f32, &f32)| srgb::encode_u8(*a) == srgb::encode_u8(*b);
        assert!(found.iter().zip(&expected).all(near), "{i}: {found:?} {expected:?}");
    }
    // Glass, black holes and bright edges keep their alpha, and so does a glow of one pixel among many. EXR files keep alpha always.
    let mut edge = [0.5, 0.5, 0.5, 1.0].repeat(200);
    edge.extend([0.6, 0.6, 0.6, 0.5].repeat(100));
    edge.extend([0.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.5, 0.5, 0.0]);
    let edge = Layers::rgba(303, 1, edge);
    let (file, report) = image::encode(Format::Png, &edge, &WriteOptions::default()).unwrap();
    assert!(!report.alpha_left_out);
    assert_eq!(read(&file).main().unwrap().channels, ["R", "G", "B", "A"]);
    let (file, report) = image::encode(Format::Exr, &flame, &WriteOptions::default()).unwrap();
    assert!(!report.alpha_left_out);
    assert_eq!(read(&file).main().unwrap().data[3], 0.0);
}

/// An EXIF block of the one tag 0112, in either byte order.
fn exif(orientation: u8, big: bool) -> Vec<u8> {
    let short = |v: u16| if big { v.to_be_bytes() } else { v.to_le_bytes() };
    let long = |v: u32| if big { v.to_be_bytes() } else { v.to_le_bytes() };
    let mut out = if big { b"MM".to_vec() } else { b"II".to_vec() };
    out.extend(short(42));
    out.extend(long(8));
    out.extend([short(1), short(0x0112), short(3)].concat());
    out.extend(long(1));
    out.extend([short(orientation.into()), short(0)].concat());
    out.extend(long(0));
    out
}

#[test]
fn photographs_are_upright_whichever_way_the_camera_was_held() {
    // Tiles of 16 pixels, which JPEG keeps apart: an upright picture of 2×3 tiles, all different.
    let colours: [[u8; 3]; 6] = [[250, 20, 20], [20, 250, 20], [20, 20, 250], [240, 240, 30], [30, 240, 240], [128; 3]];
    let upright = RgbImage::from_fn(32, 48, |x, y| ::image::Rgb(colours[(x / 16 + 2 * (y / 16)) as usize]));
    for code in 1..=8 {
        let orientation = Orientation::from_exif(code).unwrap();
        // As the file has it: the one picture that becomes the upright one, by the `image` crate's own turns.
        let stored = (1..=8)
            .map(|turn| {
                let mut stored = DynamicImage::ImageRgb8(upright.clone());
                stored.apply_orientation(Orientation::from_exif(turn).unwrap());
                stored
            })
            .find(|stored| {
                let mut back = stored.clone();
                back.apply_orientation(orientation);
                back.into_rgb8() == upright
            })
            .unwrap()
            .into_rgb8();
        let (width, height) = stored.dimensions();
        let mut files = Vec::new();
        for big in [true, false] {
            files.push(png(png::ColorType::Rgb, [width, height], stored.as_raw(), |info| {
                info.exif_metadata = Some(Cow::Owned(exif(code, big)));
            }));
            let mut jpeg = Vec::new();
            ::image::codecs::jpeg::JpegEncoder::new_with_quality(&mut jpeg, 95).encode_image(&stored).unwrap();
            let block = [&b"Exif\0\0"[..], &exif(code, big)].concat();
            let length = (block.len() as u16 + 2).to_be_bytes();
            jpeg.splice(2..2, [&[0xff, 0xe1][..], &length, &block].concat());
            files.push(jpeg);
        }
        for (kind, file) in files.iter().enumerate() {
            let picture = read(file);
            assert_eq!((picture.width, picture.height), (32, 48), "orientation {code}, file {kind}");
            for (i, pixel) in picture.main().unwrap().data.chunks(3).enumerate() {
                let expected = upright.get_pixel(i as u32 % 32, i as u32 / 32).0;
                let near = |(a, b): (&f32, u8)| srgb::encode_u8(*a).abs_diff(b) < 12;
                assert!(pixel.iter().zip(expected).all(near), "orientation {code}, file {kind}, {i}: {pixel:?}");
            }
        }
    }
}

#[test]
fn primaries_of_a_png_are_converted_and_profiles_are_told() {
    let code = |file: &[u8]| read(file).main().unwrap().data.clone();
    let pair = |x, y| (png::ScaledFloat::new(x), png::ScaledFloat::new(y));
    let wide = png::SourceChromaticities {
        white: pair(0.3127, 0.3290),
        red: pair(0.708, 0.292),
        green: pair(0.170, 0.797),
        blue: pair(0.131, 0.046),
    };
    let codes = [255, 255, 255, 255, 0, 0];
    let file = png(png::ColorType::Rgb, [2, 1], &codes, |info| info.source_chromaticities = Some(wide));
    // Rec. 2020's red in Rec. 709 (ITU-R BT.2087).
    let expected = [1.0, 1.0, 1.0, 1.6605, -0.1246, -0.0182];
    assert!(code(&file).iter().zip(expected).all(|(a, b)| (a - b).abs() < 2e-3), "{:?}", code(&file));
    assert!(read(&file).warnings.is_empty());
    // The sRGB chunk goes before.
    let marked = png(png::ColorType::Rgb, [2, 1], &codes, |info| {
        info.source_chromaticities = Some(wide);
        info.srgb = Some(png::SrgbRenderingIntent::Perceptual);
    });
    assert_eq!(code(&marked), [1.0, 1.0, 1.0, 1.0, 0.0, 0.0]);

    let profile = |text: &'static [u8]| {
        png(png::ColorType::Rgb, [2, 1], &codes, |info| info.icc_profile = Some(Cow::Borrowed(text)))
    };
    let warnings = |file: &[u8]| read(file).warnings;
    assert!(warnings(&profile(b"desc sRGB IEC61966-2.1")).is_empty());
    assert_eq!(warnings(&profile(b"desc Display P3")).len(), 1);
}
