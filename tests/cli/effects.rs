//! Passes in text from the outside: the shipped examples, their command lines, and pictures that are made again.

use std::{fs, path::PathBuf};

use crate::support::{device, lucerna, of_project};
use lucerna::{
    image::{self, Layers},
    scene::Limits,
};

fn shipped(name: &str) -> PathBuf {
    of_project(&format!("samples/effects/{name}.toml"))
}

/// A picture of the Cornell box by a pipeline, in linear light.
#[track_caller]
fn picture(words: &[&str]) -> Layers {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.exr");
    let common = ["--builtin", "cornell", "--size", "96x64", "--aa", "1", "--f32", "--exposure", "0", "-q", "-o"];
    lucerna(words.iter().chain(&common).chain(&[file.to_str().unwrap()])).expect(0, &[]);
    image::read(&file, &Limits::default()).unwrap()
}

fn pixels(layers: &Layers) -> Vec<[f32; 3]> {
    layers.layers[0].rgb_pixels().unwrap()
}

/// The largest difference of two pictures over their mean.
fn off(a: &[[f32; 3]], b: &[[f32; 3]]) -> f32 {
    let mean = a.iter().flatten().sum::<f32>() / a.len() as f32 / 3.0;
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) / mean
}

#[test]
fn each_example_changes_the_picture_and_leaves_it_where_it_has_no_strength() {
    if !device() {
        return;
    }
    let plain = pixels(&picture(&["render", "isr"]));
    let sum = |list: &[[f32; 3]]| list.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
    for (name, none) in [
        ("bloom", "effects.share=0"),
        ("depth-of-field", "effects.aperture=0"),
        ("edges", "effects.edges=false"),
        ("glass", "effects.glass=false"),
        ("isr", "effects.indirect=1"),
        ("motion-blur", "effects.turn=[0.0, 0.0]"),
        ("radial-blur", "effects.length=0"),
        ("sepia", "effects.strength=0"),
        ("ssao", "effects.strength=0"),
        ("tiles", "effects.tiles=false"),
    ] {
        let file = shipped(name);
        let file = file.to_str().unwrap();
        let mut of = vec!["run", file];
        // The example sets more samples than the default.
        if name == "isr" {
            of.extend(["-D", "isr.samples=48"]);
        }
        let changed = pixels(&picture(&of));
        assert!(changed.iter().flatten().all(|v| v.is_finite() && *v >= 0.0), "{name}");
        assert!(off(&plain, &changed) > 0.05, "{name} changes nothing");
        let energy = sum(&changed) / sum(&plain);
        assert!((0.6..1.7).contains(&energy), "{name}: {energy}");
        of.extend(["-D", none]);
        let same = pixels(&picture(&of));
        // Filtered reading at the middle of a pixel is exact to some bits, and a way of no length is found to some bits.
        assert!(off(&plain, &same) < 0.03, "{name} with {none}: {}", off(&plain, &same));
    }
}

#[test]
fn examples_do_what_they_say() {
    if !device() {
        return;
    }
    let of = |name: &str, more: &[&str]| {
        let file = shipped(name);
        pixels(&picture(&[&["run", file.to_str().unwrap()], more].concat()))
    };
    // Brown has one ratio of its colours.
    for [r, g, b] in of("sepia", &[]) {
        assert!(
            (r * 0.98 - g * 1.18).abs() < 2e-3 * r.max(0.1) && (b * 0.98 - g * 0.70).abs() < 2e-3 * g.max(0.1),
            "{r} {g} {b}"
        );
    }
    // All pixels of a tile without a joint are the same.
    let tiles = of("tiles", &["-D", "effects.joint=0", "-D", "effects.side=8"]);
    for (at, pixel) in tiles.iter().enumerate() {
        let (x, y) = (at % 96, at / 96);
        assert_eq!(*pixel, tiles[(y / 8 * 8) * 96 + x / 8 * 8]);
    }
    // Paper is white where there is no line, and lines are black.
    let lines = of("edges", &["-D", "effects.paper=1"]);
    assert!(lines.iter().filter(|pixel| **pixel == [1.0; 3]).count() > lines.len() / 2);
    assert!(lines.iter().any(|pixel| pixel[0] < 0.1));
    // Occlusion only darkens.
    let plain = pixels(&picture(&["render", "isr"]));
    let ssao = of("ssao", &[]);
    assert!(plain.iter().flatten().zip(ssao.iter().flatten()).all(|(a, b)| *b <= *a * 1.0001));
}

#[test]
fn a_picture_with_passes_is_made_again_as_long_as_the_files_are_the_same() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let copy = |name: &str| fs::copy(shipped("sepia").with_file_name(name), folder.path().join(name)).unwrap();
    copy("sepia.toml");
    copy("sepia.frag");
    let [pipeline, file] = ["sepia.toml", "a.png"].map(|name| folder.path().join(name).display().to_string());
    let size = ["--builtin", "cornell", "--size", "48x32", "-q"];
    lucerna([&["run", &pipeline][..], &size, &["-D", "effects.strength=0.25", "-o", &file]].concat()).expect(0, &[]);
    lucerna(["rerun", &file]).expect(0, &[]);
    let info = lucerna(["info", "--json", &file]).expect(0, &[]);
    assert!(info.stdout.contains("\"strength\": 0.25") && info.stdout.contains("sepia.toml"), "{}", info.stdout);
    // The same by another door, and with what --print-config has said.
    let printed = lucerna(["render", "isr", "--effects", &pipeline, "--print-config"]).expect(0, &[]);
    assert!(printed.stdout.contains("[effects]") && printed.stdout.contains("strength = 1.0"), "{}", printed.stdout);
    fs::write(
        folder.path().join("sepia.frag"),
        fs::read_to_string(folder.path().join("sepia.frag")).unwrap() + "\n// other\n",
    )
    .unwrap();
    lucerna(["rerun", &file]).expect(3, &["sepia.toml", "has changed since the picture was made"]);
}

#[test]
fn wrong_command_lines_and_files_are_told() {
    let sepia = shipped("sepia").display().to_string();
    let scene = ["--builtin", "cornell"];
    let run = |words: &[&str]| lucerna([&["run"], words, &scene].concat());
    run(&["missing.toml"]).expect(3, &["missing.toml"]);
    run(&[&sepia, "-D", "effects.strenght=1"]).expect(2, &["effects.strenght", "it has sepia, strength"]);
    run(&[&sepia, "-D", "effects.strength=7"]).expect(2, &["effects.strength", "0 to 1"]);
    run(&[&sepia, "--effects", &sepia]).expect(2, &["--effects", "named already"]);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("p.toml");
    let path = file.display().to_string();
    fs::write(&file, "[[pass]]\nshader = \"a.frag\"\nout = \"picture\"\n").unwrap();
    run(&[&path]).expect(3, &["p.toml", "line 1", "a.frag", "does not exist"]);
    fs::write(folder.path().join("a.frag"), "void main() {\n    oops;\n}\n").unwrap();
    run(&[&path]).expect(3, &["a.frag", "line 2", "'oops'"]);
    fs::write(&file, "technique = \"daylight\"\n[[pass]]\nstage = \"blur\"\nimage = \"picture\"\nout = \"picture\"\n")
        .unwrap();
    run(&[&path]).expect(2, &["p.toml", "lucerna render daylight --effects"]);
    fs::write(
        &file,
        "[settings]\nisr.sampels = 3\n[[pass]]\nstage = \"blur\"\nimage = \"picture\"\nout = \"picture\"\n",
    )
    .unwrap();
    lucerna(["render", "isr", "--effects", &path, "--builtin", "cornell"]).expect(3, &["p.toml", "isr.sampels"]);
    lucerna(["reference", "--effects", &path, "--builtin", "cornell"]).expect(3, &[]);
    fs::write(&file, "[[pass]]\nstage = \"blur\"\nimage = \"picture\"\nout = \"picture\"\n").unwrap();
    lucerna(["reference", "--effects", &path, "--builtin", "cornell"])
        .expect(2, &["--effects", "the path tracer has none"]);
}
