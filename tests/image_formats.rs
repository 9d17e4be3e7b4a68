//! Images survive their files: exact where the format is exact, within its step where it is not.

use std::path::{Path, PathBuf};

use half::f16;
use lucerna::image::{self, Format, Layer, Layers, Metadata, Precision, WriteOptions};

const WIDTH: u32 = 37;
const HEIGHT: u32 = 23;

/// Numbers over many orders of magnitude, the same in every run.
fn values(seed: u64, count: usize) -> Vec<f32> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut next = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    (0..count).map(|_| next() * 2f32.powf(next() * 24.0 - 12.0)).collect()
}

fn frame() -> Layers {
    let pixels = (WIDTH * HEIGHT) as usize;
    let full = |name: &str, channels: &[&str], seed| Layer {
        precision: Precision::Full,
        ..Layer::new(name, channels, values(seed, pixels * channels.len()))
    };
    Layers::new(WIDTH, HEIGHT)
        .with(full("", &["R", "G", "B", "A"], 1))
        .with(full("direct", &["R", "G", "B"], 2))
        .with(full("indirect", &["R", "G", "B"], 3))
        .with(full("occlusion", &["Y"], 4))
        .with(full("albedo", &["R", "G", "B"], 5))
        .with(full("normal", &["X", "Y", "Z"], 6))
        .with(full("depth", &["Z"], 7))
}

fn metadata() -> Metadata {
    Metadata {
        program: "isr render".into(),
        version: "0.1.0".into(),
        revision: Some("0123abc".into()),
        scene: "Zürich — hall".into(),
        scene_hash: "00ff".into(),
        camera: "main".into(),
        technique: "isr".into(),
        seed: 7,
        device: "llvmpipe".into(),
        driver: "Mesa 25.0.7".into(),
        config: serde_json::json!({"isr": {"samples": 48, "blur": "bilateral"}}),
        world_to_camera: Some(std::array::from_fn(|i| i as f32 * 0.25)),
        world_to_ndc: Some(std::array::from_fn(|i| 3.0 - i as f32)),
        ..Metadata::default()
    }
}

fn bytes(format: Format, picture: &Layers, options: &WriteOptions) -> Vec<u8> {
    image::encode(format, picture, options).unwrap().0
}

fn round_trip(format: Format, picture: &Layers, options: &WriteOptions) -> Layers {
    image::decode(&bytes(format, picture, options), &Default::default()).unwrap()
}

#[test]
fn exr_keeps_every_layer_bit_by_bit() {
    let mut picture = frame();
    // What must not be lost either.
    picture.layers[0].data[..5].copy_from_slice(&[f32::NAN, f32::INFINITY, -1.5, -0.0, 1e-42]);
    let back = round_trip(Format::Exr, &picture, &WriteOptions::default());
    assert_eq!((back.width, back.height), (WIDTH, HEIGHT));
    let names = |p: &Layers| {
        p.layers.iter().map(|l| (l.name.clone(), l.channels.join(""))).collect::<std::collections::BTreeSet<_>>()
    };
    assert_eq!(names(&back), names(&picture));
    assert_eq!(back.layers[0].name, "");
    assert_eq!(back.layer("total").unwrap().channels, ["R", "G", "B", "A"]);
    for layer in &picture.layers {
        let found = back.layer(&layer.name).unwrap();
        assert_eq!(found.channels, layer.channels);
        let same = found.data.iter().zip(&layer.data).all(|(a, b)| a.to_bits() == b.to_bits());
        assert!(same && found.data.len() == layer.data.len(), "{}", layer.name);
    }
}

/// The names in the file are those that other programs look for.
#[test]
fn exr_channel_names_are_layer_dot_channel() {
    let file = bytes(Format::Exr, &frame(), &WriteOptions::default());
    let meta = exr::meta::MetaData::read_from_buffered(&file[..], true).unwrap();
    assert_eq!(meta.headers.len(), 1);
    let names: Vec<String> = meta.headers[0].channels.list.iter().map(|c| c.name.to_string()).collect();
    let expected = [
        "A",
        "B",
        "G",
        "R",
        "Z",
        "albedo.B",
        "albedo.G",
        "albedo.R",
        "direct.B",
        "direct.G",
        "direct.R",
        "indirect.B",
        "indirect.G",
        "indirect.R",
        "normal.X",
        "normal.Y",
        "normal.Z",
        "occlusion.Y",
    ];
    assert_eq!(names, expected);
    assert!(meta.headers[0].shared_attributes.chromaticities.is_some());
}

#[test]
fn exr_halves_are_the_nearest_and_overflow_is_counted() {
    let data = values(9, (WIDTH * HEIGHT * 3) as usize);
    let mut picture = Layers::rgb(WIDTH, HEIGHT, data.clone());
    let back = round_trip(Format::Exr, &picture, &WriteOptions::default());
    for (found, given) in back.layers[0].data.iter().zip(&data) {
        let half = f16::from_f32(*given);
        // No other half is nearer.
        for neighbour in [f16::from_bits(half.to_bits() + 1), f16::from_bits(half.to_bits().saturating_sub(1))] {
            assert!((found - given).abs() <= (neighbour.to_f32() - given).abs(), "{given} became {found}");
        }
    }
    picture.layers[0].data[4] = 1e6;
    picture.layers[0].data[5] = -1e6;
    let (file, report) = image::encode(Format::Exr, &picture, &WriteOptions::default()).unwrap();
    assert_eq!((report.overflow, report.negative), (2, 1));
    let back = image::decode(&file, &Default::default()).unwrap();
    assert_eq!(back.layers[0].data[4..6], [65504.0, -65504.0]);
    let exact = round_trip(Format::Exr, &picture, &WriteOptions { f32: true, ..WriteOptions::default() });
    assert_eq!(exact.layers[0].data, picture.layers[0].data);
}

#[test]
fn pfm_is_exact() {
    for layer in ["", "occlusion", "normal"] {
        let picture = frame();
        let options = WriteOptions { layer: Some(layer.into()), ..WriteOptions::default() };
        let back = round_trip(Format::Pfm, &picture, &options);
        assert_eq!(back.layers[0].rgb_pixels(), picture.layer(layer).unwrap().rgb_pixels());
    }
    // The format's own words: bottom row first, a negative scale for little endian.
    let picture = Layers::rgb(1, 2, vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let file = bytes(Format::Pfm, &picture, &WriteOptions::default());
    assert_eq!(&file[..12], b"PF\n1 2\n-1.0\n");
    assert_eq!(file[12..16], 4f32.to_le_bytes());
    let big_endian = [&b"Pf 2 1 1.0\n"[..], &0.5f32.to_be_bytes(), &7f32.to_be_bytes()].concat();
    assert_eq!(image::decode(&big_endian, &Default::default()).unwrap().layers[0].data, [0.5, 7.0]);
}

#[test]
fn hdr_is_within_half_a_step_of_the_brightest_channel() {
    let picture = frame();
    let back = round_trip(Format::Hdr, &picture, &WriteOptions::default());
    let (found, given) = (back.layers[0].rgb_pixels().unwrap(), picture.layers[0].rgb_pixels().unwrap());
    for (f, g) in found.iter().zip(&given) {
        let brightest = g.iter().copied().fold(0.0, f32::max);
        for c in 0..3 {
            // A mantissa of 128 at least: half a step is 1/256 of the brightest.
            assert!((f[c] - g[c]).abs() <= brightest / 256.0, "{g:?} became {f:?}");
        }
    }
    // Once through, nothing changes any more.
    assert_eq!(round_trip(Format::Hdr, &back, &WriteOptions::default()).layers, back.layers);
}

/// Runs and single values are both packed; a plain picture is much smaller than its pixels.
#[test]
fn hdr_lines_are_run_length_coded() {
    let plain = bytes(Format::Hdr, &Layers::rgb(1000, 10, vec![0.5; 30_000]), &WriteOptions::default());
    assert!(plain.len() < 1000, "{} bytes", plain.len());
    let narrow = Layers::rgb(5, 3, values(2, 45));
    let back = round_trip(Format::Hdr, &narrow, &WriteOptions::default());
    assert_eq!((back.width, back.height), (5, 3));
}

/// Every 8-bit code stands for the linear value of IEC 61966-2-1, and is what that value is written as.
#[test]
fn png_follows_the_srgb_table_exactly() {
    let linear = |code: u32| {
        let c = f64::from(code) / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    };
    let codes: Vec<u32> = (0..256).collect();
    let picture = Layers::rgb(256, 1, codes.iter().flat_map(|&c| [linear(c) as f32; 3]).collect());
    let file = bytes(Format::Png, &picture, &WriteOptions::default());
    let mut reader = png::Decoder::new(std::io::Cursor::new(&file)).read_info().unwrap();
    assert!(reader.info().srgb.is_some());
    let mut samples = vec![0; 768];
    reader.next_frame(&mut samples).unwrap();
    assert!(samples.iter().enumerate().all(|(i, &s)| usize::from(s) == i / 3), "{samples:?}");
    // Half way to the next code falls to either side of it.
    for code in 0..255 {
        let middle = {
            let c = (f64::from(code) + 0.5) / 255.0;
            if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
        };
        let found = [0.9999, 1.0001].map(|f| image::srgb::encode_u8((middle * f) as f32));
        assert_eq!(found.map(u32::from), [code, code + 1]);
    }
    let back = image::decode(&file, &Default::default()).unwrap();
    for (code, pixel) in back.layers[0].data.chunks(3).enumerate() {
        assert!((f64::from(pixel[0]) - linear(code as u32)).abs() < 1e-6);
    }
}

#[test]
fn png_exposure_alpha_and_odd_values() {
    let sample = |picture: &Layers, options: &WriteOptions| {
        let file = bytes(Format::Png, picture, options);
        let mut reader = png::Decoder::new(std::io::Cursor::new(&file)).read_info().unwrap();
        let mut out = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut out).unwrap();
        out
    };
    let grey = Layers::rgb(1, 1, vec![0.18; 3]);
    let stop = WriteOptions { exposure_ev: 1.0, ..WriteOptions::default() };
    assert_eq!(sample(&grey, &WriteOptions::default()), [118; 3]);
    assert_eq!(sample(&grey, &stop), [image::srgb::encode_u8(0.36); 3]);
    // Premultiplied in memory, unassociated in the file.
    let glass = Layers::rgba(1, 1, vec![0.25, 0.0, 0.0, 0.5]);
    assert_eq!(sample(&glass, &WriteOptions::default()), [image::srgb::encode_u8(0.5), 0, 0, 128]);
    let odd = Layers::rgb(1, 1, vec![f32::NAN, f32::INFINITY, -1.0]);
    assert_eq!(sample(&odd, &WriteOptions::default()), [0, 255, 0]);
    let (_, report) = image::encode(Format::Png, &odd, &WriteOptions::default()).unwrap();
    assert_eq!((report.nan, report.infinite, report.negative), (1, 1, 1));
    assert_eq!(report.first.as_deref(), Some(r#"layer "", pixel (0, 0), channel R"#));
    // 16 bits.
    let wide = WriteOptions { png_bits: 16, ..WriteOptions::default() };
    assert_eq!(sample(&grey, &wide)[..2], image::srgb::encode_u16(0.18).to_be_bytes());
}

#[test]
fn png_maps_normals_and_depth_straight() {
    let picture = Layers::new(2, 1)
        .with(Layer::new("normal", &["X", "Y", "Z"], vec![0.0, 0.0, 1.0, -1.0, 0.2, 0.0]))
        .with(Layer::new("depth", &["Z"], vec![2.0, f32::INFINITY]));
    let codes = |layer: &str, picture: &Layers| {
        let options = WriteOptions { layer: Some(layer.into()), ..WriteOptions::default() };
        let file = bytes(Format::Png, picture, &options);
        let mut reader = png::Decoder::new(std::io::Cursor::new(&file)).read_info().unwrap();
        let text = reader.info().utf8_text[0].get_text().unwrap();
        let mut out = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut out).unwrap();
        (out, text)
    };
    assert_eq!(codes("normal", &picture).0, [128, 128, 255, 0, 153, 128]);
    // Near is white, far is black, the sky is black.
    let depth = Layers::new(5, 1).with(Layer::new("depth", &["Z"], vec![2.0, 6.0, 4.0, f32::INFINITY, 1e10]));
    let (found, text) = codes("depth", &depth);
    assert_eq!(found, [255, 0, 128, 0, 0]);
    assert_eq!(text, "depth: value = 6 + code * -4");
}

fn temporary(name: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    (folder, path)
}

#[test]
fn metadata_comes_back_from_every_format() {
    for name in ["p.exr", "p.png", "p.hdr", "p.pfm"] {
        let (_folder, path) = temporary(name);
        let picture = Layers { metadata: metadata(), ..frame() };
        image::write(&path, &picture, &WriteOptions::default()).unwrap();
        assert_eq!(image::metadata(&path).unwrap(), metadata(), "{name}");
        assert_eq!(image::read(&path, &Default::default()).unwrap().metadata, metadata(), "{name}");
        // The picture itself is still what any reader expects.
        assert_eq!(image::read(&path, &Default::default()).unwrap().width, WIDTH);
    }
}

#[test]
fn exr_metadata_is_in_plain_attributes_too() {
    let picture = Layers { metadata: metadata(), ..frame() };
    let file = bytes(Format::Exr, &picture, &WriteOptions::default());
    let meta = exr::meta::MetaData::read_from_buffered(&file[..], true).unwrap();
    let header = &meta.headers[0];
    assert_eq!(header.own_attributes.world_to_camera, metadata().world_to_camera);
    let attribute = |name: &str| {
        header
            .own_attributes
            .other
            .get(&exr::meta::attribute::Text::new_or_panic(name))
            .map(|v| v.to_text().unwrap().to_string())
    };
    assert_eq!(attribute("lucerna.technique").as_deref(), Some("isr"));
    assert_eq!(attribute("lucerna.seed").as_deref(), Some("7"));
    assert_eq!(attribute("lucerna.driver").as_deref(), Some("Mesa 25.0.7"));
    // The pixels are found behind the longer header.
    let back = image::decode(&file, &Default::default()).unwrap();
    assert_eq!(back.layer("direct").unwrap().data, frame().layer("direct").unwrap().data);
}

#[test]
fn the_same_picture_gives_the_same_bytes() {
    let picture = Layers { metadata: metadata(), ..frame() };
    for format in [Format::Exr, Format::Png, Format::Hdr, Format::Pfm, Format::Jpeg] {
        let options = WriteOptions::default();
        assert_eq!(bytes(format, &picture, &options), bytes(format, &picture, &options), "{format:?}");
    }
}

#[test]
fn text_beside_a_pfm_does_not_speak_for_another_image() {
    let (_folder, path) = temporary("p.pfm");
    let options = WriteOptions { overwrite: true, ..WriteOptions::default() };
    image::write(&path, &Layers { metadata: metadata(), ..frame() }, &options).unwrap();
    std::fs::write(&path, b"Pf 1 1 -1.0\n\0\0\0\0").unwrap();
    let error = image::metadata(&path).unwrap_err().to_string();
    assert!(error.contains("p.pfm.json: belongs to another image"), "{error}");
    // The pixels are read all the same.
    let picture = image::read(&path, &Default::default()).unwrap();
    assert!(picture.metadata.is_empty() && picture.layers[0].data == [0.0]);
}

#[test]
fn pictures_that_cannot_be_written_are_named() {
    let short = Layers::rgb(2, 2, vec![0.0; 11]);
    let error = image::encode(Format::Exr, &short, &WriteOptions::default()).unwrap_err().to_string();
    assert!(error.contains("11 values where 12 are needed"), "{error}");
    let twice = frame().with(Layer::new("direct", &["R"], vec![0.0; (WIDTH * HEIGHT) as usize]));
    assert!(image::encode(Format::Exr, &twice, &WriteOptions::default()).is_err());
    let options = WriteOptions { layer: Some("specular".into()), ..WriteOptions::default() };
    let error = image::encode(Format::Png, &frame(), &options).unwrap_err().to_string();
    assert!(error.contains("no layer \"specular\"") && error.contains("\"direct\""), "{error}");
    let error = image::write(Path::new("x.tga"), &frame(), &WriteOptions::default()).unwrap_err();
    assert_eq!(error.exit_code(), 2);
    assert!(error.to_string().contains(".exr, .hdr, .pfm, .png or .jpg"), "{error}");
}

/// Codes by a power instead of the sRGB curve: the PNG file says it, and so reads back as the light that went in.
#[test]
fn a_gamma_of_the_users_choice() {
    let picture = Layers::rgb(5, 1, [0.0, 0.01, 0.18, 0.5, 1.0].iter().flat_map(|&v| [v; 3]).collect());
    for gamma in [1.0, 1.8, 2.6] {
        let options = WriteOptions { gamma: Some(gamma), png_bits: 16, ..WriteOptions::default() };
        let back = round_trip(Format::Png, &picture, &options);
        for (a, b) in picture.layers[0].data.iter().zip(&back.layers[0].data) {
            assert!((a - b).abs() < 1e-3, "{gamma}: {a} {b}");
        }
        let srgb = bytes(Format::Png, &picture, &WriteOptions { png_bits: 16, ..WriteOptions::default() });
        assert!(bytes(Format::Png, &picture, &options) != srgb);
    }
}

#[test]
fn colours_by_other_names_are_colours() {
    let values: Vec<f32> = (0..24).map(|i| i as f32 / 8.0).collect();
    for names in [["r", "g", "b", "a"], ["red", "green", "blue", "alpha"]] {
        let picture = Layers::new(3, 2).with(Layer::new("beauty", &names, values.clone()));
        let (file, _) = image::encode(Format::Exr, &picture, &WriteOptions::default()).unwrap();
        let read = image::decode(&file, &lucerna::scene::Limits::default()).unwrap();
        let layer = read.main().unwrap();
        assert_eq!(layer.channels, ["R", "G", "B", "A"]);
        assert_eq!(layer.data, values);
    }
    // What is no three colours keeps its names.
    let picture = Layers::new(3, 2).with(Layer::new("uv", &["r", "g"], values[..12].to_vec()));
    let (file, _) = image::encode(Format::Exr, &picture, &WriteOptions::default()).unwrap();
    assert_eq!(image::decode(&file, &lucerna::scene::Limits::default()).unwrap().layers[0].channels, ["g", "r"]);
}
