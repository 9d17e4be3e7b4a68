//! OpenEXR files of odd kinds, written by OpenEXR itself: `golden/exr/README.md` says what is in them.

use crate::common;
use std::path::PathBuf;

use half::f16;
use lucerna::{
    Error,
    image::{self, Layers},
    scene::Limits,
};

const SIZE: [u32; 2] = [53, 37];

fn path(name: &str) -> PathBuf {
    common::root().join("tests/golden/exr").join(name)
}

fn read(name: &str) -> Result<Layers, Error> {
    image::read(path(name), &Limits::default())
}

/// What was written: R G B.
fn colour(x: u32, y: u32) -> [f32; 3] {
    let (x, y) = (x as f32, y as f32);
    let red = 0.2 + 3.2 * (0.5 + 0.5 * (0.2 * x).sin()) * (0.5 + 0.5 * (0.15 * y).cos());
    let blue = 0.05 + 30.0 * (-((x - 20.0).powi(2) + (y - 15.0).powi(2)) / 60.0).exp();
    [red, 0.1 + 2.0 * (x / 53.0).powi(2), blue].map(|value| f16::from_f32(value).to_f32())
}

/// Largest difference of a layer's channels to the written ones, relative to the value plus 0.01.
fn worst(layers: &Layers, layer: &str, channels: &[&str], expected: impl Fn(u32, u32) -> Vec<f32>) -> f32 {
    assert_eq!([layers.width, layers.height], SIZE);
    let layer = layers.layer(layer).unwrap_or_else(|| panic!("no layer {layer:?} in {layers:?}"));
    assert_eq!(layer.channels, channels);
    let mut worst = 0f32;
    for (i, pixel) in layer.data.chunks_exact(channels.len()).enumerate() {
        let expected = expected(i as u32 % SIZE[0], i as u32 / SIZE[0]);
        for (a, b) in pixel.iter().zip(expected) {
            worst = worst.max((a - b).abs() / (b.abs() + 0.01));
        }
    }
    worst
}

#[test]
fn lossy_dct_compression_decodes_as_openexr_does_it() {
    for name in ["dwaa", "dwab"] {
        let (ours, theirs) = (read(&format!("{name}.exr")).unwrap(), read(&format!("{name}-expected.exr")).unwrap());
        assert_eq!(ours.layers.len(), 2);
        for (a, b) in ours.layers.iter().zip(&theirs.layers) {
            assert_eq!((&a.name, &a.channels), (&b.name, &b.channels));
            // The inverse transforms add in another order; halves then differ in their last places.
            let difference = |(x, y): (&f32, &f32)| (x - y).abs() / (y.abs() + 0.01);
            let worst = a.data.iter().zip(&b.data).map(difference).fold(0.0, f32::max);
            assert!(worst < 4e-3, "{name} {:?}: {worst}", a.name);
        }
        // And it is the picture that went in. Alpha and depth are stored without loss.
        assert!(worst(&ours, "depth", &["Z"], |x, y| vec![1.0 + 0.5 * x as f32 + y as f32]) == 0.0);
        let with_alpha = |x, y: u32| {
            let alpha = f16::from_f32((1.2 - y as f32 / 37.0).clamp(0.0, 1.0)).to_f32();
            [&colour(x, y)[..], &[alpha]].concat()
        };
        let lossy = worst(&ours, "", &["R", "G", "B", "A"], with_alpha);
        assert!(lossy > 0.0 && lossy < 0.15, "{name}: {lossy}");
    }
}

#[test]
fn parts_become_layers_and_the_first_colours_are_the_picture() {
    let parts = read("parts.exr").unwrap();
    let rgb = ["R", "G", "B"];
    assert!(worst(&parts, "left", &rgb, |x, y| colour(x, y).to_vec()) < 1e-3);
    assert!(
        worst(&parts, "right", &rgb, |x, y| {
            let [r, g, b] = colour(x, y);
            vec![b, r, g]
        }) < 1e-3
    );
    assert!(worst(&parts, "depth", &["Z"], |x, y| vec![1.0 + 0.5 * x as f32 + y as f32]) == 0.0);
    assert_eq!(parts.main().unwrap().name, "left");
}

#[test]
fn tiles_and_luminance_alone() {
    assert!(worst(&read("tiled.exr").unwrap(), "", &["R", "G", "B"], |x, y| colour(x, y).to_vec()) < 1e-3);
    let grey = read("y.exr").unwrap();
    assert!(worst(&grey, "", &["Y"], |x, y| vec![colour(x, y)[1]]) < 0.03);
    let pixel = grey.main().unwrap().rgb_pixels().unwrap()[52];
    assert!(pixel[0] > 1.9 && pixel == [pixel[0]; 3], "{pixel:?}");
}

/// Luminance with chroma at half resolution, reconstructed and mended at saturated pixels as OpenEXR's own reader does it, up to the borders.
#[test]
fn chroma_is_reconstructed_as_openexr_does_it() {
    let (ours, theirs) = (read("yca.exr").unwrap(), read("yca-expected.exr").unwrap());
    let [ours, theirs] = [&ours, &theirs].map(|picture| picture.main().unwrap());
    assert_eq!((&ours.channels, ours.data.len()), (&theirs.channels, 4 * 16 * 12));
    for (i, (a, b)) in ours.data.chunks(4).zip(theirs.data.chunks(4)).enumerate() {
        // The reader rounds to halves after each of its four steps: 2⁻¹¹ of the pixel's largest value each.
        let most = b[..3].iter().fold(0.0f32, |most, v| most.max(*v)) / 512.0;
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= most), "({}, {}): {a:?} {b:?}", i % 16, i / 16);
    }
}

#[test]
fn what_is_not_read_is_refused_with_the_reason() {
    let reasons = [
        ("deep.exr", "deep pixels"),
        ("htj2k.exr", "compression 11 (HTJ2K32) is not read"),
        ("htj2k256.exr", "compression 10 (HTJ2K256) is not read"),
        ("lj2k.exr", "compression 12 (LJ2K) is not read"),
        ("zstd.exr", "compression 13 (ZSTD) is not read"),
        ("zstd-second.exr", "compression 13 (ZSTD) is not read"),
    ];
    for (name, reason) in reasons {
        let error = read(name).unwrap_err();
        assert_eq!(error.exit_code(), 3);
        let text = error.to_string();
        assert!(text.contains(name) && text.contains(reason) && text.contains("oiiotool"), "{error}");
        assert!(!text.contains("damaged"), "{error}");
    }
    // A number that no version knows yet.
    let mut newer = std::fs::read(path("zstd.exr")).unwrap();
    let mark = b"compression\0compression\0\x01\0\0\0";
    let at = newer.windows(mark.len()).position(|window| window == mark).unwrap() + mark.len();
    newer[at] = 42;
    let error = image::decode(&newer, &Limits::default()).unwrap_err().to_string();
    assert!(error.contains("compression 42 (newer than what is known here)"), "{error}");
}
