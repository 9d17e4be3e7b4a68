//! `tonemap` from the outside: formats, names, sequences, pipes, policies, exit codes, the same bytes each time.

use std::{
    fs,
    io::Write,
    path::Path,
    process::{Output, Stdio},
};

use crate::support::{Ran, asset, command, device, files, ran};
use lucerna::{
    image::{self, Format, Layer, Layers, WriteOptions, srgb},
    scene::Limits,
};

const PROGRAM: &str = env!("CARGO_BIN_EXE_tonemap");

pub(crate) fn tonemap(arguments: &[&str]) -> Ran {
    ran(command(PROGRAM).args(arguments))
}

pub(crate) fn read(path: &Path) -> Layers {
    image::read(path, &Limits::default()).unwrap()
}

/// A ramp over five decades, with alpha where asked.
pub(crate) fn ramp(width: u32, height: u32, alpha: bool) -> Layers {
    let light = |i: u32| 1e-3 * 10f32.powf(5.0 * (i % width) as f32 / width as f32);
    let data = (0..width * height).flat_map(|i| {
        let l = light(i);
        let a = (i / width) as f32 / height as f32;
        if alpha { vec![l * a, 0.5 * l * a, 0.25 * l * a, a] } else { vec![l, 0.5 * l, 0.25 * l] }
    });
    if alpha { Layers::rgba(width, height, data.collect()) } else { Layers::rgb(width, height, data.collect()) }
}

pub(crate) fn write(folder: &Path, name: &str, picture: &Layers) -> String {
    let path = folder.join(name);
    image::write(&path, picture, &WriteOptions { f32: true, ..WriteOptions::default() }).unwrap();
    path.display().to_string()
}

pub(crate) fn name(folder: &Path, name: &str) -> String {
    folder.join(name).display().to_string()
}

#[test]
fn codes_of_files_are_what_the_operator_gave() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let input = write(folder, "ramp.exr", &ramp(64, 8, false));
    let out = |file: &str| name(folder, file);
    let (png8, png16, exr, jpg, pfm) = (out("a.png"), out("b.png"), out("a.exr"), out("a.jpg"), out("a.pfm"));
    let common = ["--operator", "linear", "--exposure", "-1", "-q"];
    let first = ["-o", &png8, "-o", &exr, "-o", &jpg, "-o", &pfm, "--f32", "--quality", "100"];
    tonemap(&[&[input.as_str()], &common[..], &first].concat()).expect(0, &[]);
    tonemap(&[&[input.as_str()], &common[..], &["-o", &png16, "--bits", "16", "--gamma", "1.8"]].concat())
        .expect(0, &[]);

    let light = read(Path::new(&input)).layers[0].data.clone();
    let half: Vec<f32> = light.iter().map(|v| v * 0.5).collect();
    // Linear files hold the light, also what is over white; codes are cut.
    for file in [&exr, &pfm] {
        let data = read(Path::new(file)).layers[0].data.clone();
        assert!(data.len() == half.len() && data.iter().zip(&half).all(|(a, b)| (a - b).abs() <= 1e-6 * b), "{file}");
    }
    let codes: Vec<u8> = read(Path::new(&png8)).layers[0].data.iter().map(|&v| srgb::encode_u8(v)).collect();
    let expected: Vec<u8> = half.iter().map(|&v| srgb::encode_u8(v)).collect();
    assert_eq!(codes, expected);
    // The file says its gamma, and so reads back as light.
    for (a, b) in read(Path::new(&png16)).layers[0].data.iter().zip(&half) {
        assert!((a - b.min(1.0)).abs() < 1e-4 + 1e-3 * b, "{a} {b}");
    }
    let jpeg = read(Path::new(&jpg));
    let mean = |v: &[f32]| v.iter().map(|&x| f64::from(srgb::encode(x.clamp(0.0, 1.0)))).sum::<f64>() / v.len() as f64;
    assert!((mean(&jpeg.layers[0].data) - mean(&half)).abs() < 0.01);
    // They say how they were made.
    for file in [&png8, &exr, &jpg] {
        let metadata = image::metadata(file).unwrap();
        assert_eq!(metadata.technique, "linear-global");
        assert_eq!(metadata.config["settings"]["tonemap"]["exposure"], -1.0);
    }
}

#[test]
fn alpha_is_kept_and_the_same_command_gives_the_same_bytes() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let input = write(folder, "ramp.exr", &ramp(32, 16, true));
    let alpha = |picture: &Layers| picture.layers[0].data.iter().skip(3).step_by(4).copied().collect::<Vec<f32>>();
    let run = |kind: &str| {
        let files = ["png", "exr"].map(|end| name(folder, &format!("{kind}.{end}")));
        tonemap(&[
            &input,
            "-o",
            &files[0],
            "-o",
            &files[1],
            "--operator",
            "reinhard",
            "--mode",
            "global",
            "--bits",
            "16",
        ])
        .expect(0, &[]);
        files
    };
    let (a, b) = (run("a"), run("b"));
    let original = alpha(&ramp(32, 16, true));
    for (file, again) in a.iter().zip(&b) {
        assert_eq!(fs::read(file).unwrap(), fs::read(again).unwrap(), "{file}");
        let kept = alpha(&read(Path::new(file)));
        assert!(kept.iter().zip(&original).all(|(x, y)| (x - y).abs() < 1e-3), "{file}");
    }
}

#[test]
fn bad_samples_are_counted_and_fall_under_the_policy() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut picture = ramp(16, 4, false);
    picture.layers[0].data[0] = f32::NAN;
    picture.layers[0].data[7] = f32::INFINITY;
    picture.layers[0].data[20] = -1.0;
    let input = write(folder, "bad.exr", &picture);
    let (out, json) = (name(folder, "a.exr"), |ran: &Ran| ran.json()["pictures"][0]["bad_samples"].clone());
    let common = [input.as_str(), "--operator", "linear", "--exposure", "0", "-o", &out, "--overwrite", "--f32"];
    let ran = tonemap(&[&common[..], &["--json"]].concat()).expect(0, &["1 NaN, 1 infinite, 1 negative; taken as 0"]);
    assert_eq!(json(&ran), serde_json::json!({ "nan": 1, "infinite": 1, "negative": 1, "first": [0, 0] }));
    let data = read(Path::new(&out)).layers[0].data.clone();
    assert_eq!([data[0], data[7], data[20]], [0.0; 3]);
    tonemap(&[&common[..], &["--bad-values", "clamp"]].concat()).expect(0, &[]);
    let brightest =
        picture.layers[0].data.iter().skip(1).step_by(3).copied().filter(|v| v.is_finite()).fold(0.0, f32::max);
    assert_eq!(read(Path::new(&out)).layers[0].data[7], brightest);
    let mut dark = ramp(16, 4, false);
    dark.layers[0].data[30..36].fill(-0.5);
    let dark = write(folder, "dark.exr", &dark);
    tonemap(&[dark.as_str(), "-o", &out, "--overwrite"]).expect(0, &["dark.exr: 2 pixels have light below 0"]);
    fs::remove_file(&out).unwrap();
    let refused = tonemap(&[&common[..], &["--bad-values", "error"]].concat());
    refused.expect(3, &["bad.exr: pixel (0, 0)", "1 samples are not a number, 1 infinite, 1 negative"]);
    assert!(!Path::new(&out).exists());
}

#[test]
fn a_batch_goes_on_after_a_picture_that_fails() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (a, c) = (write(folder, "a.exr", &ramp(8, 8, false)), write(folder, "c.hdr", &ramp(9, 7, false)));
    let b = name(folder, "b.exr");
    fs::write(&b, b"not a picture").unwrap();
    let depth = write(folder, "d.exr", &Layers::new(4, 4).with(Layer::new("motion", &["X", "Y"], vec![0.5; 32])));
    let out = name(folder, "out/");
    fs::create_dir(&out).unwrap();
    let ran = tonemap(&[&a, &b, &c, &depth, "-o", &out, "--operator", "aces", "--json"]);
    let ran = ran.expect(3, &["b.exr: no image format", "the channels X Y are no colours"]);
    assert_eq!(ran.errors(), 2);
    let json = ran.json();
    assert_eq!(json["pictures"].as_array().unwrap().len(), 2);
    assert_eq!((&json["failed"][0]["exit_code"], &json["complete"]), (&3.into(), &false.into()));
    assert_eq!(files(Path::new(&out)), ["a.png", "c.png"]);
    assert_eq!(read(&Path::new(&out).join("c.png")).width, 9);
}

/// A white step in a dark room: with adaptation the first bright frame is not yet what it becomes, in a batch it is.
#[test]
fn sequences_adapt_and_batches_do_not() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for frame in 0..6u32 {
        let scale = if frame < 2 { 1.0 } else { 50.0 };
        let mut picture = ramp(32, 8, false);
        picture.layers[0].data.iter_mut().for_each(|v| *v *= scale);
        write(folder, &format!("f-{frame:03}.exr"), &picture);
    }
    let pattern = name(folder, "f-###.exr");
    let run = |out: &str, extra: &[&str]| {
        let target = name(folder, out);
        let ran = tonemap(
            &[
                &[pattern.as_str(), "-o", &target, "--operator", "reinhard", "--mode", "global", "--f32", "--json"],
                extra,
            ]
            .concat(),
        );
        ran.expect(0, &[]).json()["pictures"].as_array().unwrap().clone()
    };
    let mean = |file: &str| {
        let data = read(&folder.join(file)).layers[0].data.clone();
        data.iter().sum::<f32>() / data.len() as f32
    };
    let frames = run("s-{frame:03}.exr", &[]);
    assert_eq!(frames.len(), 6);
    let log_average = |i: usize| frames[i]["luminance"]["log_average"].as_f64().unwrap();
    assert!(log_average(0) == log_average(1) && log_average(1) < log_average(2) && log_average(2) < log_average(5));
    assert_eq!(mean("s-000.exr"), mean("s-001.exr"));
    assert!(mean("s-002.exr") > mean("s-005.exr") && mean("s-005.exr") > mean("s-000.exr"));
    // Each for itself: the operator does not see the factor.
    let list: Vec<String> = (0..6).map(|i| name(folder, &format!("f-{i:03}.exr"))).collect();
    let target = name(folder, "b-{name}.exr");
    let mut arguments: Vec<&str> = list.iter().map(String::as_str).collect();
    arguments.extend(["-o", &target, "--operator", "reinhard", "--mode", "global", "--f32", "-q"]);
    tonemap(&arguments).expect(0, &[]);
    assert!((mean("b-f-000.exr") / mean("b-f-005.exr") - 1.0).abs() < 1e-3);
    // --frames chooses, and a frame that is not there ends the sequence.
    let ran = tonemap(&[&pattern, "-o", &name(folder, "t-%02d.png"), "--frames", "4..8", "--operator", "agx", "-q"]);
    ran.expect(3, &["f-006.exr"]);
    assert!(folder.join("t-04.png").exists() && folder.join("t-05.png").exists() && !folder.join("t-07.png").exists());
}

#[test]
fn pipes() {
    if !device() {
        return;
    }
    let (pfm, _) = image::encode(Format::Pfm, &ramp(16, 8, false), &WriteOptions::default()).unwrap();
    let run = |format: &str, bytes: &[u8]| -> Output {
        let mut child = command(PROGRAM)
            .args(["-", "-o", "-", "--operator", "neutral", "--format", format])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        child.stdin.take().unwrap().write_all(bytes).unwrap();
        child.wait_with_output().unwrap()
    };
    for (format, expected) in [("png", Format::Png), ("exr", Format::Exr), ("jpg", Format::Jpeg), ("pfm", Format::Pfm)]
    {
        let output = run(format, &pfm);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(Format::sniff(&output.stdout), Some(expected));
        assert_eq!(image::decode(&output.stdout, &Limits::default()).unwrap().width, 16);
    }
    let broken = run("png", b"PF\n4 4\n-1\nshort");
    assert_eq!(broken.status.code(), Some(3));
    assert!(broken.stdout.is_empty() && String::from_utf8_lossy(&broken.stderr).contains("standard input"));
}

/// All of this is known before a device is opened.
#[test]
fn wrong_usage_names_what_is_allowed() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let (a, b) = (write(folder, "a.exr", &ramp(4, 4, false)), write(folder, "b.exr", &ramp(4, 4, false)));
    let out = name(folder, "o.png");
    for (arguments, part) in [
        (vec![&*a, "-o", &*out, "--operator", "ward"], "ashikhmin"),
        (vec![&a, "-o", &out, "--operator", "aces", "--mode", "local"], "allowed: global"),
        (vec![&a, "-o", &out, "-D", "tonemap.radios=4"], "tonemap.radius"),
        (vec![&a, "-o", &out, "-D", "tonemap.radius=99"], "tonemap.radius: 99 is not allowed; allowed: 1 to 16"),
        (vec![&a, "-o", &out, "--exposure", "bright"], "auto"),
        (vec![&a, "-o", &out, "--gamma", "0"], "srgb"),
        (vec![&a, "-o", &out, "--alpha", "over:sky"], "over:white"),
        (vec![&a, "-o", &out, "-D", "tonemap.contrast_limit=0.5"], "tonemap.contrast_limit: 0.5 is not allowed"),
        (vec![&a, "-o", &out, "--quality", "0"], "1..=100"),
        (vec![&a, "-o", "o.gif"], ".exr, .hdr, .pfm, .png or .jpg"),
        (vec![&a, "-o", "{nmae}.png"], "{name}"),
        (vec![&a, &b, "-o", &out], "several pictures"),
        (vec![&a, &b, "-o", "-"], "standard output"),
        (vec![&a, "-o", "-", "--json"], "standard output"),
        (vec![&a, "-o", &a, "--overwrite"], "is one of the inputs"),
        (vec![&a, "-o", &out, "--frames", "0..3"], "numbered sequences"),
        (vec![&a], "--output"),
    ] {
        tonemap(&arguments).expect(2, &[part]);
        assert!(!Path::new(&out).exists());
    }
    fs::write(&out, b"mine").unwrap();
    tonemap(&[&a, "-o", &out]).expect(1, &["exists already"]);
    assert_eq!(fs::read(&out).unwrap(), b"mine");
    let config = tonemap(&[&a, "--print-config", "--operator", "reinhard", "--white", "2", "-D", "tonemap.white=3"])
        .expect(0, &[]);
    assert!(
        config.stdout.contains("operator = \"reinhard\"") && config.stdout.contains("white = 3.0"),
        "{}",
        config.stdout
    );
}

/// Odd pictures: the answer is stated, nothing is written for what is refused.
#[test]
fn smallest_and_emptiest_pictures() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let grey =
        |width: u32, height: u32, value: f32| Layers::rgb(width, height, vec![value; (width * height * 3) as usize]);
    let mut hot = grey(9, 9, 0.1);
    hot.layers[0].data[120..123].fill(1e6);
    let list = [
        ("one.exr", grey(1, 1, 0.5)),
        ("black.exr", grey(5, 4, 0.0)),
        ("flat.exr", grey(4, 5, 0.25)),
        ("row.exr", grey(300, 1, 0.25)),
        ("hot.exr", hot),
    ]
    .map(|(file, picture)| write(folder, file, &picture));
    for operator in [
        "ashikhmin",
        "reinhard",
        "bilateral",
        "linear",
        "reinhard-global",
        "aces",
        "agx",
        "neutral",
        "drago",
        "reinhard-devlin",
        "fattal",
        "mantiuk",
    ] {
        let mode = if ["fattal", "mantiuk"].contains(&operator) { "local" } else { "global" };
        let target = name(folder, &format!("{operator}-{{name}}.exr"));
        let mut arguments: Vec<&str> = list.iter().map(String::as_str).collect();
        arguments.extend(["-o", &target, "--operator", operator, "--mode", mode, "-q"]);
        tonemap(&arguments).expect(0, &[]);
        let result = |file: &str| read(&folder.join(format!("{operator}-{file}.exr"))).layers[0].data.clone();
        for file in ["one", "black", "flat", "row", "hot"] {
            let data = result(file);
            assert!(data.iter().all(|v| v.is_finite() && *v > -1e-3), "{operator} {file}");
            // What is all the same stays so.
            assert!(file == "hot" || data.chunks(3).all(|p| p == &data[..3]), "{operator} {file}");
        }
        if ["ashikhmin", "reinhard", "bilateral", "reinhard-global", "drago", "reinhard-devlin", "fattal"]
            .contains(&operator)
        {
            // The brightest luminance is white, also if it is the only one.
            let white = |file: &str| result(file).iter().all(|v| (v - 1.0).abs() < 1e-3);
            assert!(white("one") && white("flat") && white("row"), "{operator}: {:?}", &result("flat")[..3]);
        }
        assert!(result("black").iter().all(|v| *v <= 1e-3), "{operator}: {:?}", &result("black")[..3]);
    }
    fs::write(folder.join("none.hdr"), b"#?RADIANCE\n\n-Y 0 +X 4\n").unwrap();
    let (none, out) = (name(folder, "none.hdr"), name(folder, "none.png"));
    tonemap(&[&none, "-o", &out]).expect(3, &["none.hdr: an image of 4×0 pixels"]);
    assert!(!Path::new(&out).exists());
}

/// Files of which a picture can be made, but not the one that was meant.
#[test]
fn what_is_odd_about_a_file_is_told() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let jpeg = image::encode(Format::Jpeg, &ramp(64, 64, false), &WriteOptions::default()).unwrap().0;
    let cut = name(folder, "cut ü 1.jpg");
    fs::write(&cut, &jpeg[..jpeg.len() * 3 / 4]).unwrap();
    let dark = write(folder, "dark.pfm", &Layers::rgb(4, 3, vec![-1.0; 36]));
    let out = name(folder, "out/");
    fs::create_dir(&out).unwrap();
    let told = tonemap(&[&cut, &dark, "-o", &out, "--operator", "linear"]);
    told.expect(
        0,
        &["cut ü 1.jpg: the file ends before its picture does", "dark.pfm: nothing in the picture is brighter"],
    );
    assert_eq!(files(Path::new(&out)), ["cut ü 1.png", "dark.png"]);
}

/// A frame that is missing takes its time all the same.
#[test]
fn a_sequence_with_a_gap_goes_on_adapting_meanwhile() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (file, scale) in [("a-1", 1.0), ("a-2", 9.0), ("a-3", 9.0), ("b-1", 1.0), ("b-3", 9.0)] {
        let mut picture = ramp(16, 4, false);
        picture.layers[0].data.iter_mut().for_each(|v| *v *= scale);
        write(folder, &format!("{file}.exr"), &picture);
    }
    let last = |series: &str, messages: &[&str]| {
        let (input, out) = (name(folder, &format!("{series}-#.exr")), name(folder, &format!("{series}#.png")));
        let ran = tonemap(&[&input, "-o", &out, "--operator", "reinhard", "--mode", "global", "--json"]);
        let json = ran.expect(0, messages).json();
        json["pictures"].as_array().unwrap().last().unwrap()["luminance"]["log_average"].as_f64().unwrap()
    };
    let (whole, gap) = (last("a", &[]), last("b", &["1 numbers between 1 and 3 are missing"]));
    assert!((whole / gap - 1.0).abs() < 1e-4, "{whole} {gap}");
}

/// Every HDR image of the collection is developed.
#[test]
fn the_collection_is_developed() {
    let Some(folder) = asset("hdr") else { return };
    if !device() {
        return;
    }
    let out = tempfile::tempdir().unwrap();
    let small = [
        "formats/old-rle.hdr",
        "formats/rgbr4x4.hdr",
        "formats/overexposed_gradient.exr",
        "displaywindow/t12.exr",
        "testimages/stripes.exr",
        "testimages/AllHalfValues.exr",
        "Rec709_YC.exr",
        "XYZ.exr",
    ];
    let inputs: Vec<String> = small.iter().map(|file| folder.join(file).display().to_string()).collect();
    let target = name(out.path(), "{frame}.png");
    let mut arguments: Vec<&str> = inputs.iter().map(String::as_str).collect();
    arguments.extend([
        "-o",
        &target,
        "--operator",
        "reinhard",
        "--mode",
        "global",
        "--json",
        "--bad-values",
        "neighbour",
    ]);
    let json = tonemap(&arguments).expect(0, &["AllHalfValues.exr: samples: "]).json();
    let size =
        |i: usize| (json["pictures"][i]["width"].as_u64().unwrap(), json["pictures"][i]["height"].as_u64().unwrap());
    assert_eq!((size(0), size(3), size(7)), ((551, 276), (400, 100), (610, 406)));
    assert_eq!(json["pictures"][5]["bad_samples"]["nan"], 3 * 2 * 1023);
    // The same photograph, as luminance with chroma and as XYZ.
    let pixels = |i: usize| read(&out.path().join(format!("{i}.png"))).layers[0].data.clone();
    let mut differences: Vec<f32> = pixels(6).iter().zip(pixels(7)).map(|(a, b)| (a - b).abs()).collect();
    differences.sort_by(f32::total_cmp);
    assert!(differences[differences.len() / 2] < 0.01, "{}", differences[differences.len() / 2]);
}
