//! `tonemap` from the outside: the exposure that is found, alpha, marked pixels, and tone mapping as the last stage of other programs.

use std::{fs, path::Path};

use crate::{
    support::{self, device},
    tonemap::{name, ramp, read, tonemap, write},
};
use lucerna::image::{self, Layers, srgb};

/// The last stage of techniques is the same operator: the light that stays beside its picture gives it again.
#[test]
fn last_stage_of_every_technique() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let picture = name(folder, "a.exr");
    let scene = ["--builtin", "cornell", "--size", "48x32", "-q", "--f32"];
    let look = ["-D", "tonemap.operator=reinhard", "-D", "tonemap.mode=global", "-D", "tonemap.exposure=1"];
    support::isr([&["render", "-o", &picture, "--exposure", "0.5"], &scene[..], &look].concat()).expect(0, &[]);
    let reference = name(folder, "r.exr");
    let arguments = [
        "reference",
        "--builtin",
        "cornell",
        "--size",
        "48x32",
        "-q",
        "--spp",
        "4",
        "-o",
        &reference,
        "--exposure",
        "0.5",
    ];
    support::lucerna([&arguments[..], &look].concat()).expect(0, &[]);
    for file in [&picture, &reference] {
        let (light, again) = (format!("{file}:light"), format!("{file}.again.exr"));
        let same = ["--operator", "reinhard", "--mode", "global", "--exposure", "1.5", "--f32", "-q"];
        tonemap(&[&[light.as_str(), "-o", &again], &same[..]].concat()).expect(0, &[]);
        let (a, b) = (read(Path::new(file)), read(Path::new(&again)));
        let (a, b) = (&a.layer("").unwrap().data, &b.layers[0].data);
        assert!(a.iter().any(|&v| v > 0.05));
        for (x, y) in a.iter().zip(b) {
            // The light beside it may be in 16 bits.
            assert!((x - y).abs() < 2e-3 * (y + 0.1), "{file}: {x} {y}");
        }
        // And the picture says enough to be made again, bit by bit.
        support::lucerna(["rerun", file, "-q"]).expect(0, &[]);
    }
    let none = name(folder, "o.png");
    let occlusion = [&["render", "-o", &none, "--mode", "occlusion"], &scene[..], &look].concat();
    support::isr(occlusion).expect(2, &["tonemap: tone mapping needs radiance, but the picture of this mode of isr"]);
    support::isr(["render", "--builtin", "cornell", "-o", &none, "-D", "tonemap.operatr=agx"])
        .expect(2, &["tonemap.operator"]);
}

/// Inserts `whiteLuminance` into the header of an EXR file of scan lines.
fn state_white(path: &str, white: f32) {
    let file = fs::read(path).unwrap();
    let attribute = [&b"whiteLuminance\0float\0"[..], &4u32.to_le_bytes(), &white.to_le_bytes()].concat();
    // Name, type and size of each attribute, then its value; an empty name ends the header.
    let mut at = 8;
    while file[at] != 0 {
        let text = |from: usize| from + file[from..].iter().position(|&b| b == 0).unwrap() + 1;
        let size = text(text(at));
        at = size + 4 + u32::from_le_bytes(file[size..size + 4].try_into().unwrap()) as usize;
    }
    // The table of the positions of the chunks follows, and ends where the first chunk begins.
    let position = |from: usize| u64::from_le_bytes(file[from..from + 8].try_into().unwrap());
    let end = position(at + 1) as usize;
    let table = (at + 1..end).step_by(8).flat_map(|from| (position(from) + attribute.len() as u64).to_le_bytes());
    let table: Vec<u8> = table.collect();
    fs::write(path, [&file[..8], &attribute, &file[8..=at], &table, &file[end..]].concat()).unwrap();
}

#[test]
fn the_exposure_is_measured_unless_the_file_or_the_user_says_it() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let input = write(folder, "ramp.exr", &ramp(64, 8, false));
    let stated = write(folder, "white.exr", &ramp(64, 8, false));
    state_white(&stated, 200.0);
    let out = name(folder, "a.png");
    let exposure = |input: &str, more: &[&str], messages: &[&str]| {
        let ran = tonemap(&[&[input, "-o", &out, "--overwrite", "--json"], more].concat()).expect(0, messages);
        ran.json()["pictures"][0]["exposure"].as_f64().unwrap()
    };
    let linear = ["--operator", "linear"];
    let measured = exposure(&input, &linear, &["ramp.exr: exposure", "measured; --exposure 0"]);
    assert!((-3.0..0.0).contains(&measured), "{measured}");
    let cd = exposure(&input, &[], &["measured"]);
    assert!((cd - measured - 100f64.log2()).abs() < 0.1, "{cd}");
    assert!((exposure(&input, &["--operator", "linear", "--exposure", "auto+1"], &[]) - measured - 1.0).abs() < 1e-5);
    for more in
        [&["--exposure", "0"][..], &["--paper"], &["-D", "tonemap.normalize=true"], &["-D", "tonemap.exposure=0"]]
    {
        assert_eq!(exposure(&input, more, &[]), 0.0, "{more:?}");
    }
    assert_eq!(exposure(&input, &["--paper", "--exposure", "auto"], &[]), cd);
    // The luminance of white counts for the operator that works in cd/m².
    let absolute = exposure(&stated, &[], &["white.exr: exposure +7.64 EV (the file states white as 200 cd/m²)"]);
    assert!((absolute - 200f64.log2()).abs() < 1e-5);
    assert_eq!(exposure(&stated, &linear, &["measured"]), measured);
    assert_eq!(exposure(&stated, &["--exposure", "0"], &[]), 0.0);
}

#[test]
fn the_share_of_marked_pixels_is_told_and_does_not_depend_on_the_exposure() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let input = write(folder, "ramp.exr", &ramp(64, 8, false));
    let out = name(folder, "a.png");
    let share = |more: &[&str]| {
        let arguments = [&[input.as_str(), "-o", &out, "--overwrite", "--json"], more].concat();
        let ran = tonemap(&arguments).expect(0, &[]);
        (ran.json()["pictures"][0]["share_marked"].clone(), ran.stderr.contains("% of the pixels are marked as detail"))
    };
    let selective = |exposure| share(&["--mode", "selective", "--exposure", exposure]);
    let (marked, told) = selective("0");
    assert!(told && (0.05..0.9).contains(&marked.as_f64().unwrap()), "{marked}");
    assert_eq!(selective("9"), (marked.clone(), true));
    // The thesis' threshold counts in the unit of the picture.
    let thesis = |exposure| share(&["--mode", "selective", "--paper", "--exposure", exposure]).0.as_f64().unwrap();
    assert!(thesis("0") + 0.1 < thesis("9"));
    assert_eq!(share(&["--mode", "local"]), (serde_json::Value::Null, false));
}

/// A flame that shines where alpha is 0, in half of the picture.
#[test]
fn alpha_is_kept_dropped_or_over_a_colour() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let pixels = [[0.5, 0.25, 0.0, 0.0], [0.25, 0.25, 0.25, 1.0]];
    let input = write(folder, "flame.exr", &Layers::rgba(2, 1, pixels.as_flattened().to_vec()));
    let run = |more: &[&str], file: &str, messages: &[&str]| {
        let out = name(folder, file);
        let common = [input.as_str(), "-o", &out, "--operator", "linear", "--exposure", "0", "--overwrite", "--json"];
        let ran = tonemap(&[&common[..], more].concat()).expect(0, messages);
        let layer = read(Path::new(&out)).layers[0].clone();
        (layer.channels.len(), layer.data, ran)
    };
    let near = |a: &[f32], b: &[f32]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 3e-3);
    let shines = "50.0 % of the pixels";
    let (channels, data, ran) = run(&[], "a.png", &["alpha is left out", shines]);
    assert!(channels == 3 && near(&data, &[0.5, 0.25, 0.0, 0.25, 0.25, 0.25]), "{data:?}");
    assert_eq!(ran.json()["pictures"][0]["share_hidden_by_alpha"], 0.5);
    let (channels, data, _) = run(&["--alpha", "keep"], "a.png", &["alpha hides light in", shines, "--alpha drop"]);
    assert!(channels == 4 && near(&data, &[0.0, 0.0, 0.0, 0.0, 0.25, 0.25, 0.25, 1.0]), "{data:?}");
    let (channels, data, ran) = run(&["--alpha", "drop"], "a.png", &[]);
    assert!(channels == 3 && near(&data[..3], &[0.5, 0.25, 0.0]) && !ran.stderr.contains("warning"), "{}", ran.stderr);
    let (channels, data, _) = run(&["--alpha", "over:#0000ff"], "a.png", &[]);
    assert!(channels == 3 && near(&data, &[0.5, 0.25, 1.0, 0.25, 0.25, 0.25]), "{data:?}");
    // An EXR file keeps both, without a warning, and says what was done.
    let (channels, data, ran) = run(&["--alpha", "keep"], "a.exr", &[]);
    assert!(channels == 4 && near(&data, pixels.as_flattened()) && !ran.stderr.contains("warning"), "{}", ran.stderr);
    let (_, _, _) = run(&["--alpha", "over:grey"], "b.png", &[]);
    assert_eq!(image::metadata(folder.join("b.png")).unwrap().config["alpha"], "over:#808080");
    support::lucerna(["rerun", &name(folder, "b.png"), "-q"]).expect(0, &[]);
    support::lucerna(["rerun", &name(folder, "a.png"), "-q"]).expect(0, &[]);
}

/// .png files of renders have a film-like curve; other files keep the light.
#[test]
fn rendered_files_for_screens_have_a_curve() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let at = |file: &str| name(folder, file);
    let scene = ["render", "--builtin", "cornell", "--size", "32x24", "-q", "--aa", "1", "--exposure", "1"];
    let render = |more: &[&str]| support::isr([&scene[..], more].concat());
    render(&["-o", &at("a.png"), "-o", &at("a.exr"), "-o", &at("b.jpg"), "--f32"]).expect(0, &[]);
    render(&["-o", &at("linear.png"), "--operator", "linear"]).expect(0, &[]);
    render(&["-o", &at("agx.png"), "--operator", "agx"]).expect(0, &[]);
    render(&["-o", &at("layer-{layer}.png")]).expect(0, &[]);
    let light = read(&folder.join("a.exr"));
    let light = light.main().unwrap().rgb_pixels().unwrap();
    let codes = |file: &str| -> Vec<u8> {
        let pixels = read(&folder.join(file)).main().unwrap().rgb_pixels().unwrap();
        pixels.into_iter().flatten().map(srgb::encode_u8).collect()
    };
    let by = |curve: fn([f64; 3]) -> [f64; 3], scale: f32| -> Vec<u8> {
        let shown = light.iter().flat_map(|p| curve(p.map(|v| f64::from(v * scale))));
        shown.map(|v| srgb::encode_u8((v as f32).clamp(0.0, 1.0))).collect()
    };
    use lucerna::reference::tonemap::curves;
    let near = |a: Vec<u8>, b: Vec<u8>| a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| a.abs_diff(*b) <= 1);
    assert!(near(codes("a.png"), by(curves::aces, 2f32.powf(1.737))));
    assert!(near(codes("agx.png"), by(curves::agx, 2.0)));
    let linear = by(|p| p, 2.0);
    assert!(near(codes("linear.png"), linear.clone()) && !near(codes("a.png"), linear.clone()));
    assert!(near(codes("layer-picture.png"), linear.clone()));
    let paper = at("paper.png");
    render(&["-o", &paper, "--paper"]).expect(0, &[]);
    assert!(image::metadata(&paper).unwrap().config.get("operator").is_none());
    for file in ["a.png", "a.exr", "linear.png", "agx.png"] {
        support::lucerna(["rerun", &at(file), "-q"]).expect(0, &[]);
    }
    for (more, part) in [
        (&["--operator", "aces", "-D", "tonemap.operator=agx"][..], "use -D tonemap.operator"),
        (&["--operator", "aces", "--mode", "occlusion"], "are no light"),
        (&["--operator", "ashikhmin"], "reinhard-global"),
    ] {
        render(&[&["-o", &at("no.png")], more].concat()).expect(2, &[part]);
    }
}
