//! Images of other programs are read as they were meant.

use crate::common;
use std::path::{Path, PathBuf};

use half::f16;
use lucerna::{
    image::{self, Format, Layers, WriteOptions},
    scene::Limits,
};

/// Column, row, luminance and red of a few pixels of Flowers.exr.
const FLOWERS: [(usize, usize, f32, f32); 6] = [
    (0, 0, 1.125, 1.01445),
    (200, 100, 0.84375, 0.734058),
    (392, 366, 0.145508, 0.133509),
    (500, 640, 0.457031, 0.397615),
    (782, 732, 1.22656, 1.12056),
    (100, 600, 0.664062, 0.679606),
];

fn read(folder: &Path, name: &str) -> Layers {
    image::read(folder.join("hdr").join(name), &Limits::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn pixels(picture: &Layers) -> Vec<[f32; 3]> {
    picture.main().unwrap().rgb_pixels().unwrap()
}

/// Median over pixels and channels of the difference relative to the brighter value.
fn difference(a: &Layers, b: &Layers) -> f32 {
    assert_eq!((a.width, a.height), (b.width, b.height));
    let relative = |x: f32, y: f32| (x - y).abs() / x.abs().max(y.abs()).max(1e-6);
    let mut all: Vec<f32> =
        pixels(a).iter().zip(pixels(b)).flat_map(|(p, q)| (0..3).map(move |c| relative(p[c], q[c]))).collect();
    all.sort_by(f32::total_cmp);
    all[all.len() / 2]
}

#[test]
fn every_half_value_is_read_exactly() {
    let Some(assets) = common::assets() else { return };
    let picture = read(&assets, "testimages/AllHalfValues.exr");
    let values = pixels(&picture);
    let mut seen = vec![false; 1 << 16];
    let mut nan = 0;
    for value in values.iter().flatten() {
        let half = f16::from_f32(*value);
        nan += usize::from(value.is_nan());
        assert!(value.is_nan() || half.to_f32().to_bits() == value.to_bits(), "{value} is no half");
        seen[usize::from(half.to_bits())] = true;
    }
    let finite = (0..=u16::MAX).filter(|&bits| f16::from_bits(bits).is_finite());
    assert_eq!(finite.filter(|&bits| !seen[usize::from(bits)]).count(), 0);
    assert_eq!(nan, 3 * 2 * 1023);
}

/// The same photograph with Rec. 709 primaries and as CIE XYZ, which the file's chromaticities say.
#[test]
fn primaries_of_the_file_are_converted() {
    let Some(assets) = common::assets() else { return };
    let found = difference(&read(&assets, "XYZ.exr"), &read(&assets, "Rec709.exr"));
    assert!(found < 2e-3, "{found}");
}

/// The same photograph as luminance and chroma at half resolution, in both spaces.
#[test]
fn luminance_and_chroma_become_colour() {
    let Some(assets) = common::assets() else { return };
    let full = read(&assets, "Rec709.exr");
    for name in ["Rec709_YC.exr", "XYZ_YC.exr"] {
        let picture = read(&assets, name);
        assert_eq!(picture.main().unwrap().channels, ["R", "G", "B"], "{name}");
        let found = difference(&picture, &full);
        assert!(found < 0.015, "{name}: {found}");
    }
    // The same in squares of 4×4 samples (B44). The luminance and red of pixels that have their own chroma, as OpenEXR 3.5.3 reads them.
    let flowers = pixels(&read(&assets, "Flowers.exr"));
    for (x, y, luminance, red) in FLOWERS {
        let [r, g, b] = flowers[y * 784 + x];
        let found = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        assert!(
            (found - luminance).abs() < 2e-3 * luminance && (r - red).abs() < 2e-3 * luminance,
            "({x}, {y}): {found} {r}"
        );
    }
}

/// The same picture as EXR and as .hdr.
#[test]
fn two_formats_of_one_picture_agree() {
    let Some(assets) = common::assets() else { return };
    let (exr, hdr) =
        (read(&assets, "formats/overexposed_gradient.exr"), read(&assets, "formats/overexposed_gradient.hdr"));
    for (a, b) in pixels(&exr).iter().zip(pixels(&hdr)) {
        let brightest = a.iter().copied().fold(0.0, f32::max);
        assert!((0..3).all(|c| (a[c] - b[c]).abs() <= brightest / 120.0), "{a:?} {b:?}");
    }
}

/// Two exports of the memorial church, one of them 0.358 times as bright and with a VIEW line before everything else.
#[test]
fn headers_in_the_wild_are_read() {
    let Some(assets) = common::assets() else { return };
    let (mut a, b) = (read(&assets, "memorial_o876.hdr"), read(&assets, "memorial_view_header.hdr"));
    assert_eq!((a.width, a.height), (512, 768));
    a.layers[0].data.iter_mut().for_each(|value| *value *= 0.3585);
    assert!(difference(&a, &b) < 0.02, "{}", difference(&a, &b));
    assert!(b.metadata.extra.contains_key("VIEW"));
    // Old run lengths, and none at all.
    assert_eq!(read(&assets, "formats/old-rle.hdr").width, 551);
    assert_eq!(read(&assets, "formats/rgbr4x4.hdr").layers[0].data.len(), 48);
}

/// What lies outside of the display window is not seen, what the data window leaves out is black.
#[test]
fn the_image_is_the_display_window() {
    let Some(assets) = common::assets() else { return };
    let whole = read(&assets, "displaywindow/t01.exr");
    assert_eq!((whole.width, whole.height), (400, 300));
    for name in ["t05", "t08", "t12"] {
        let path = assets.join(format!("hdr/displaywindow/{name}.exr"));
        let picture = image::read(&path, &Limits::default()).unwrap();
        let meta = exr::meta::MetaData::read_from_file(&path, false).unwrap();
        let (header, display) = (&meta.headers[0], meta.headers[0].shared_attributes.display_window);
        assert_eq!((picture.width as usize, picture.height as usize), (display.size.0, display.size.1));
        // All these files have the pixels of the first one, elsewhere.
        let data = header.own_attributes.layer_position;
        let offset = (data.0 - display.position.0, data.1 - display.position.1);
        let (ours, theirs) = (pixels(&picture), pixels(&whole));
        let mut inside = 0;
        for y in 0..picture.height as i32 {
            for x in 0..picture.width as i32 {
                let (dx, dy) = (x - offset.0, y - offset.1);
                let covered = (0..400).contains(&dx) && (0..300).contains(&dy);
                let expected = if covered { theirs[(dy * 400 + dx) as usize] } else { [0.0; 3] };
                assert_eq!(ours[(y * picture.width as i32 + x) as usize], expected, "{name}: ({x}, {y})");
                inside += i32::from(covered);
            }
        }
        // The window of the last one lies above all pixels.
        assert_eq!(inside > 0, name != "t12", "{name}");
    }
}

fn all(folder: &Path, into: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            all(&path, into);
        } else if path.extension().is_some_and(|e| e == "hdr" || e == "exr") {
            into.push(path);
        }
    }
}

/// Every image of the collection is read; those of moderate size, written as our EXR with 32 bits, come back bit by bit.
#[test]
fn the_collection_survives_our_files() {
    let Some(assets) = common::assets() else { return };
    let mut files = Vec::new();
    all(&assets.join("hdr"), &mut files);
    let mut read = 0;
    for path in files.into_iter() {
        let picture = image::read(&path, &Limits::default()).unwrap_or_else(|error| panic!("{error}"));
        // The larger ones tell nothing more about writing, but take half a minute.
        if std::fs::metadata(&path).unwrap().len() > 500_000 {
            continue;
        }
        let options = WriteOptions { f32: true, ..WriteOptions::default() };
        let (bytes, _) = image::encode(Format::Exr, &picture, &options).unwrap();
        let back = image::decode(&bytes, &Limits::default()).unwrap();
        for (a, b) in picture.layers.iter().zip(&back.layers) {
            let same =
                a.data.iter().zip(&b.data).all(|(x, y)| x.to_bits() == y.to_bits() || (x.is_nan() && y.is_nan()));
            assert!(same && a.channels == b.channels, "{}: {a:?} {b:?}", path.display());
        }
        read += 1;
    }
    assert!(read >= 15, "{read}");
}

/// Every image: size of the display window, channels, and the mean of its finite green values as OpenEXR 3.5.3 or pfstools 2.2 read
/// it (not for those that we take to other primaries, or whose windows differ).
const TABLE: &[(&str, u32, u32, &str, Option<f64>)] = &[
    ("Bonita.exr", 550, 832, "RGB", Some(0.559464)),
    ("Cannon.exr", 780, 566, "RGB", Some(0.359306)),
    ("Desk.exr", 644, 874, "RGBA", Some(6.04835)),
    ("Flowers.exr", 784, 734, "RGB", None),
    ("MtTamWest.exr", 1214, 732, "RGBA", Some(0.354169)),
    ("Rec709.exr", 610, 406, "RGB", Some(0.277788)),
    ("Rec709_YC.exr", 610, 406, "RGB", None),
    ("StillLife.exr", 1240, 846, "RGBA", Some(0.0781079)),
    ("Tree.exr", 928, 906, "RGBA", None),
    ("XYZ.exr", 610, 406, "RGB", None),
    ("XYZ_YC.exr", 610, 406, "RGB", None),
    ("displaywindow/t01.exr", 400, 300, "RGB", Some(0.00918333)),
    ("displaywindow/t05.exr", 340, 260, "RGB", None),
    ("displaywindow/t08.exr", 501, 401, "RGB", None),
    ("displaywindow/t12.exr", 400, 100, "RGB", None),
    ("formats/overexposed_gradient.exr", 20, 12, "RGBA", Some(0.721594)),
    ("testimages/AllHalfValues.exr", 256, 256, "RGB", Some(0.0)),
    ("testimages/BrightRings.exr", 800, 800, "RGB", Some(27.5853)),
    ("testimages/BrightRingsNanInf.exr", 800, 800, "RGB", Some(27.5856)),
    ("testimages/GammaChart.exr", 800, 800, "RGB", Some(0.175781)),
    ("testimages/GrayRampsHorizontal.exr", 800, 800, "Y", Some(0.642926)),
    ("testimages/SquaresSwirls.exr", 1000, 1000, "RGB", Some(18.4687)),
    ("testimages/WideColorGamut.exr", 800, 800, "RGB", Some(0.962274)),
    ("testimages/WideFloatRange.exr", 500, 500, "G", None),
    ("testimages/stripes.exr", 100, 50, "RGBA", Some(0.469992)),
    ("Bottles_Small.hdr", 912, 688, "RGB", Some(0.187294)),
    ("formats/image1.hdr", 128, 85, "RGB", Some(0.448697)),
    ("formats/old-rle.hdr", 551, 276, "RGB", None),
    ("formats/overexposed_gradient.hdr", 20, 12, "RGB", Some(0.717619)),
    ("formats/rgbr4x4.hdr", 4, 4, "RGB", Some(0.274902)),
    ("memorial_o876.hdr", 512, 768, "RGB", Some(0.822679)),
    ("memorial_view_header.hdr", 512, 768, "RGB", Some(0.294866)),
];

#[test]
fn every_image_of_the_collection_is_what_other_programs_see() {
    let Some(assets) = common::assets() else { return };
    let mut files = Vec::new();
    all(&assets.join("hdr"), &mut files);
    for &(name, width, height, channels, mean) in TABLE {
        let picture = read(&assets, name);
        let layer = picture.main().unwrap();
        assert_eq!((picture.width, picture.height, &*layer.channels.concat()), (width, height, channels), "{name}");
        let green = pixels(&picture).into_iter().map(|p| f64::from(p[1])).filter(|v| v.is_finite());
        let (sum, count) = green.fold((0.0, 0.0), |(sum, count), v| (sum + v, count + 1.0));
        if let Some(mean) = mean {
            // Programs differ in half a code of .hdr files.
            let allowed = if name.ends_with(".hdr") { 6e-3 } else { 1e-5 };
            assert!((sum / count - mean).abs() <= allowed * mean.abs(), "{name}: {} {mean}", sum / count);
        }
    }
    // Nothing is left out.
    assert_eq!(files.len(), TABLE.len());
}
