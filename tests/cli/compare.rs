//! `lucerna compare` from the outside: tables, JSON, maps, thresholds and every exit code.

use std::path::Path;

use crate::support::{Ran, command, files, lucerna, ran};
use lucerna::image::{self, Layer, Layers, WriteOptions, srgb};

const SIDE: u32 = 24;

/// A picture of one grey with one brighter pixel, as light.
fn write(folder: &Path, name: &str, grey: f32, side: u32) -> String {
    let mut data = vec![grey; (side * side * 3) as usize];
    data[0] = grey * 1.5;
    let direct = Layer::new("direct", &["R", "G", "B"], vec![grey * 0.5; data.len()]);
    let path = folder.join(name);
    let layers = Layers::rgb(side, side, data).with(direct);
    image::write(&path, &layers, &WriteOptions { f32: true, ..WriteOptions::default() }).unwrap();
    path.to_str().unwrap().to_owned()
}

fn compare(arguments: &[&str]) -> Ran {
    lucerna(std::iter::once("compare").chain(arguments.iter().copied()))
}

fn value(json: &serde_json::Value, test: usize, measure: &str) -> f64 {
    json["tests"][test]["measures"][measure]["value"].as_f64().unwrap()
}

#[test]
fn a_table_and_the_same_numbers_as_json() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b, c] = [("a.exr", 0.5), ("b.exr", 0.25), ("c.exr", 1.0)].map(|(n, v)| write(folder.path(), n, v, SIDE));
    let text = compare(&[&a, &b]).expect(0, &[]).stdout;
    for part in ["24×24", "mae ↓", "ssim ↑", "hdr-flip", "exposures from"] {
        assert!(text.contains(part), "{part} is not in:\n{text}");
    }
    let table = compare(&[&a, &b, &c, "-m", "mae,psnr"]).expect(0, &[]).stdout;
    assert!(table.lines().any(|line| line.contains("b.exr") && line.contains("0.25")), "{table}");
    let json = compare(&[&a, &b, &c, "-m", "mae,psnr", "--json"]).expect(0, &[]).json();
    let mae = |from: f64| (from - 0.5).abs() * (1.0 + 0.5 / (3.0 * 24.0 * 24.0));
    assert!((value(&json, 0, "mae") - mae(0.25)).abs() < 1e-6 && (value(&json, 1, "mae") - mae(1.0)).abs() < 1e-6);
    let b_psnr = -20.0 * f64::from(srgb::encode(0.5) - srgb::encode(0.25)).log10();
    assert!((value(&json, 0, "psnr") - b_psnr).abs() < 0.01, "{json}");
    assert_eq!(json["measures"][1]["unit"], "dB");
    // Equal images: infinite, which JSON cannot hold.
    let same = compare(&[&a, &a, "-m", "psnr,ssim", "--json"]).expect(0, &[]).json();
    let psnr = &same["tests"][0]["measures"]["psnr"];
    assert!(psnr["value"].is_null() && psnr["infinite"] == true && psnr["note"].as_str().unwrap().contains("equal"));
    assert_eq!(value(&same, 0, "ssim"), 1.0);
}

#[test]
fn pictures_come_from_standard_input() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = [("a.exr", 0.5), ("b.exr", 0.25)].map(|(n, v)| write(folder.path(), n, v, SIDE));
    let piped = |arguments: &[&str]| {
        ran(command(env!("CARGO_BIN_EXE_lucerna")).args(arguments).stdin(std::fs::File::open(&b).unwrap()))
    };
    let measured = |json: &serde_json::Value| value(json, 0, "mae");
    let from_file = compare(&[&a, &b, "-m", "mae", "--json"]).expect(0, &[]).json();
    let from_pipe = piped(&["compare", &a, "-", "-m", "mae", "--json"]).expect(0, &[]).json();
    assert_eq!(measured(&from_pipe), measured(&from_file));
    // Words with a hyphen come after `--`.
    let layer = piped(&["compare", "-m", "mae", "--json", "--", &format!("{a}:direct"), "-:direct"]);
    let layer = layer.expect(0, &[]).json();
    assert!((measured(&layer) - 0.125).abs() < 1e-6, "{layer}");
    let twice = piped(&["compare", "-", "-", "-m", "mae"]);
    twice.expect(2, &["standard input (-) is named twice"]);
    let text = piped(&["info", "-"]).expect(0, &[]).stdout;
    assert!(text.starts_with("standard input\n  24×24"), "{text}");
    let wrong = ran(command(env!("CARGO_BIN_EXE_lucerna")).args(["info", "-"]).stdin(std::process::Stdio::null()));
    wrong.expect(3, &["standard input"]);
}

#[test]
fn layers_crops_and_baselines() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = [("a.exr", 0.5), ("b.exr", 0.4)].map(|(n, v)| write(folder.path(), n, v, SIDE));
    let direct = format!("{b}:direct");
    // MS-SSIM needs a larger image: `all` leaves it out, its name is answered with the size.
    let json = compare(&[&a, &b, "-m", "all", "--baseline", &direct, "--json"]).expect(0, &[]).json();
    assert_eq!(json["measures"].as_array().unwrap().len(), 16);
    assert!(json["tests"][0]["measures"]["vdp"]["details"]["adaptation"].as_f64().unwrap() > 1.0);
    compare(&[&a, &b, "-m", "ms-ssim"]).expect(3, &["b.exr", "ms-ssim needs at least 176"]);
    let json = compare(&[&a, &b, "-m", "gain,fq,improved", "--baseline", &direct, "--json"]).expect(0, &[]).json();
    // Errors 0.1 against 0.3.
    assert!((value(&json, 0, "gain") - 66.6).abs() < 0.2 && value(&json, 0, "fq") == -1.0, "{json}");
    assert_eq!(value(&json, 0, "improved"), 100.0);
    let layer = compare(&[&a, &b, "-m", "mae", "--layer", "direct", "--json"]).expect(0, &[]).json();
    assert!((value(&layer, 0, "mae") - 0.05).abs() < 1e-6);
    // Without the bright pixel.
    let crop = compare(&[&a, &b, "-m", "mae", "--crop", "8x4+1+0", "--json"]).expect(0, &[]).json();
    assert!((value(&crop, 0, "mae") - 0.1).abs() < 1e-6 && crop["width"] == 8);
    compare(&[&a, &b, "-m", "gain"]).expect(2, &["--baseline"]);
    compare(&[&a, &b, "--layer", "indirect"]).expect(3, &["a.exr", "no layer 'indirect'", "'direct'"]);
    compare(&[&a, &b, "--crop", "30x4+0+0"]).expect(2, &["a.exr", "24×24"]);
}

#[test]
fn thresholds_and_exit_codes() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = [("a.exr", 0.5), ("b.exr", 0.4)].map(|(n, v)| write(folder.path(), n, v, SIDE));
    let small = write(folder.path(), "small.exr", 0.5, 12);
    let over =
        compare(&[&a, &b, "--fail-over", "mae=0.05,psnr=60"]).expect(7, &["mae is 0.1", "above 0.05", "below 60"]);
    assert!(over.stdout.contains("mae") && over.errors() == 1);
    compare(&[&a, &b, "--fail-over", "mae=0.2"]).expect(0, &[]);
    compare(&[&a, &b, "--warn-over", "mae=0.05"]).expect(0, &["warning", "mae"]);
    // The document is there before the verdict.
    let json = compare(&[&a, &b, "--fail-over", "mae=0.05", "--json"]).expect(7, &[]).json();
    assert_eq!(json["over"].as_array().unwrap().len(), 1);
    for (arguments, code) in [
        (&[a.as_str(), &a][..], 0),
        (&[&a, &b, "--warn-over", "mae=0.05", "--fail-over", "mae=0.2"], 1),
        (&[&a, &b], 2),
        (&[&a, &b, "--fail-over", "mae=0.2"], 0),
        (&[&a, &small], 3),
        (&[&a, "no/such.exr"], 4),
    ] {
        compare(&[arguments, &["--idiff-codes"]].concat()).expect(code, &[]);
    }
    compare(&[&a, &small]).expect(3, &["small.exr", "12×12", "24×24"]);
    compare(&[&a, "no/such.exr"]).expect(3, &["no/such.exr"]);
    for (arguments, part) in [
        (&["-m", "ssmi"][..], "ssim"),
        (&["--fail-over", "mae"], "METRIC=VALUE"),
        (&["--fail-over", "mea=1"], "mae"),
        (&["--fail-over", "mae=nan"], "finite"),
        (&["--crop", "12"], "WIDTHxHEIGHT+X+Y"),
        (&["--exposure", "bright"], "auto"),
        (&["--ppd", "0"], "pixels_per_degree"),
        (&["--map-style", "magma"], "--map"),
    ] {
        compare(&[&[a.as_str(), &b], arguments].concat()).expect(2, &[part]);
    }
    compare(&[&a]).expect(2, &["TEST"]);
}

#[test]
fn what_is_not_comparable_is_refused_or_said() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = [("a.exr", 0.5), ("b.png", 0.25)].map(|(n, v)| write(folder.path(), n, v, SIDE));
    // Light beside screen codes.
    compare(&[&a, &b]).expect(3, &["a.exr", "b.png", "--exposure"]);
    let shown = compare(&[&a, &b, "-m", "mae,flip", "--exposure", "-1", "--json"]).expect(0, &["exposed by -1 stops"]);
    assert!(value(&shown.json(), 0, "mae") < 1e-3, "half of 0.5 is 0.25: {}", shown.stdout);
    // NaN.
    let mut data = vec![0.5; (SIDE * SIDE * 3) as usize];
    (data[0], data[4]) = (0.75, f32::NAN);
    let path = folder.path().join("nan.pfm");
    image::write(&path, &Layers::rgb(SIDE, SIDE, data), &WriteOptions::default()).unwrap();
    let nan = path.to_str().unwrap();
    compare(&[&a, nan]).expect(3, &["nan.pfm", "1 samples", "(1, 0), G"]);
    let mended = compare(&[&a, nan, "--nan-as", "0.5", "-m", "mae", "--json"]).expect(0, &["taken as 0.5"]).json();
    assert_eq!(value(&mended, 0, "mae"), 0.0);
    std::fs::write(folder.path().join("text.png"), "no image").unwrap();
    compare(&[&a, folder.path().join("text.png").to_str().unwrap()]).expect(3, &["text.png"]);
}

#[test]
fn jpeg_files_are_read() {
    // 8×8 grey of code 128, made by hand: quantisation of 1, no coefficients but DC.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("grey.jpg");
    std::fs::write(&path, grey_jpeg()).unwrap();
    let grey = folder.path().join("grey.png");
    image::write(&grey, &Layers::rgb(8, 8, vec![srgb::decode_u8(128); 192]), &WriteOptions::default()).unwrap();
    let json = compare(&[grey.to_str().unwrap(), path.to_str().unwrap(), "-m", "mae", "--json"]).expect(0, &[]).json();
    assert_eq!(value(&json, 0, "mae"), 0.0);
    std::fs::write(&path, &grey_jpeg()[..40]).unwrap();
    compare(&[grey.to_str().unwrap(), path.to_str().unwrap()]).expect(3, &["grey.jpg"]);
}

/// A baseline JPEG of one grey block whose coefficients are all 0: code 128.
fn grey_jpeg() -> Vec<u8> {
    let mut bytes = vec![0xff, 0xd8];
    bytes.extend([0xff, 0xdb, 0, 67, 0]);
    bytes.extend([1; 64]);
    bytes.extend([0xff, 0xc0, 0, 11, 8, 0, 8, 0, 8, 1, 1, 0x11, 0]);
    // One code of one bit in both tables: category 0, and end of block.
    for class in [0x00, 0x10] {
        bytes.extend([0xff, 0xc4, 0, 20, class, 1]);
        bytes.extend([0; 15]);
        bytes.push(0);
    }
    bytes.extend([0xff, 0xda, 0, 8, 1, 1, 0, 0, 63, 0, 0b0011_1111, 0xff, 0xd9]);
    bytes
}

#[test]
fn maps_are_written_whole_and_say_their_scale() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = [("a.exr", 0.5), ("b.exr", 0.4)].map(|(n, v)| write(folder.path(), n, v, SIDE));
    let maps = folder.path().join("maps");
    let arguments = ["-m", "mae,ssim", "--map", maps.to_str().unwrap(), "--map-style", "magma,exr,negative"];
    let with = |more: &[&str]| compare(&[&[a.as_str(), &b], &arguments[..], more].concat());
    with(&[]).expect(0, &[]);
    let names = ["b-mae.exr", "b-mae.png", "b-negative.png", "b-ssim.exr", "b-ssim.png"];
    assert_eq!(files(&maps), names);
    let read = |name: &str| image::read(maps.join(name), &Default::default()).unwrap();
    let numbers = read("b-mae.exr");
    assert!((numbers.layers[0].data[5] - 0.1).abs() < 1e-6 && numbers.layers[0].channels == ["Y"]);
    let picture = read("b-mae.png");
    assert!(
        picture.metadata.extra["scale"].contains("magma from 0 to")
            || picture.metadata.extra["scale"].contains("magma from 0")
    );
    assert_eq!(picture.metadata.extra["measure"], "mae");
    let negative = read("b-negative.png").layers[0].data[10];
    let expected = 1.0 - (srgb::encode(0.5) - srgb::encode(0.4));
    assert!((srgb::encode(negative) - expected).abs() < 1.0 / 255.0, "{negative}");
    with(&[]).expect(1, &["b-mae.png", "overwritten"]);
    with(&["--overwrite"]).expect(0, &[]);
    assert_eq!(files(&maps), names);
}

#[test]
fn the_same_numbers_whatever_the_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = [("a.exr", 0.5), ("b.exr", 0.4)].map(|(n, v)| write(folder.path(), n, v, SIDE));
    let with = |n: &str| {
        compare(&[&a, &b, "-m", "mae,rel-mse,pearson,ssim,flip,hdr-flip,pdiff", "--json", "--threads", n])
            .expect(0, &[])
            .stdout
    };
    assert_eq!(with("1"), with("3"));
}
