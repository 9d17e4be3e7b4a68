//! `igi render` from the outside: settings and what is wrong with them, layers, the same picture again. Needs a device (each test
//! says so when there is none).

use crate::support;
use crate::support::{command, device, files, lucerna, ran};
use lucerna::{image, scene::Limits};

const SMALL: [&str; 6] = ["render", "--builtin", "cornell", "--size", "32x24", "-q"];

fn igi(more: &[&str]) -> support::Ran {
    ran(command(env!("CARGO_BIN_EXE_igi")).args(SMALL.iter().chain(more)))
}

#[test]
fn wrong_settings_are_refused_and_named() {
    for (arguments, part) in [
        (&["-D", "igi.vpls=0"][..], "4 to 10000"),
        (&["-D", "igi.bounces=9"], "1 to 8"),
        (&["-D", "igi.downsample=5"], "1 to 4"),
        (&["-D", "igi.bound=-1"], "0 to 1"),
        (&["-D", "igi.history=10001"], "0 to 10000"),
        (&["-D", "igi.history_lag=0"], "0.001 to 10"),
        (&["-D", "igi.visibility=\"rays\""], "compute"),
        (&["-D", "igi.visibility=raster", "-D", "igi.raster_size=8"], "16 to 1024"),
        (&["-D", "igi.vlps=4"], "did you mean 'igi.vpls'"),
        (&["--mode", "occlusion"], "indirect"),
    ] {
        igi(arguments).expect(2, &[part]);
    }
    // Before anything is read, and also where they are only to be printed.
    let before = ["render", "no-such.glb", "-D", "igi.vpls=0"];
    ran(command(env!("CARGO_BIN_EXE_igi")).args(before)).expect(2, &["igi.vpls: 0", "4 to 10000"]);
    igi(&["--print-config", "-D", "background=[0.0,-1.0,0.0]"]).expect(2, &["background[1]: -1", "not below 0"]);
    // In a file: its name, and the code of wrong input.
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("s.toml");
    std::fs::write(&file, "[igi]\nvpls = 0\n").unwrap();
    igi(&["--settings", file.to_str().unwrap()]).expect(3, &["s.toml: igi.vpls: 0", "4 to 10000"]);
    let shown = igi(&["--paper", "--print-config"]).expect(0, &[]).stdout;
    for line in ["downsample = 4", "interleave = 3", "imperfect = true", "candidates = 1"] {
        assert!(shown.contains(line), "{line} is not in {shown}");
    }
}

#[test]
fn layers_sum_to_the_picture_and_it_can_be_made_again() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.exr");
    let name = path.to_str().unwrap();
    let options = ["-D", "igi.vpls=30", "-D", "igi.downsample=2", "--seed", "3", "--f32", "-o", name];
    igi(&options).expect(0, &[]);
    let layers = image::read(&path, &Limits::default()).unwrap();
    let data = |name: &str| layers.layer(name).unwrap_or_else(|| panic!("no layer {name:?}")).data.clone();
    let (total, direct, indirect) = (data(""), data("direct"), data("indirect"));
    assert!(indirect.iter().any(|v| *v > 0.0));
    for ((total, direct), indirect) in total.iter().zip(&direct).zip(&indirect) {
        assert!((total - direct - indirect).abs() <= 1e-5 * total.abs() + 1e-7, "{total} {direct} {indirect}");
    }
    lucerna(["rerun", name]).expect(0, &[]);
}

#[test]
fn a_sequence_with_a_moving_lamp_is_numbered_and_each_frame_can_be_made_again() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let pattern = folder.path().join("lamp-{frame:03}.exr").to_string_lossy().into_owned();
    let film = ["--frames", "0..4", "--fps", "10", "--light", "-0.5,0.6,0.3,3,0.5,0.6,0.3,1"];
    let settings = ["-D", "igi.vpls=24", "-D", "igi.direct_samples=1", "-D", "igi.history=8"];
    igi(&[&film[..], &settings, &["-o", &pattern]].concat()).expect(0, &[]);
    assert_eq!(files(folder.path()), ["lamp-000.exr", "lamp-001.exr", "lamp-002.exr", "lamp-003.exr"]);
    let frame = |number: u32| folder.path().join(format!("lamp-{number:03}.exr"));
    let light = |number: u32| image::read(frame(number), &Limits::default()).unwrap().layer("").unwrap().data.clone();
    assert_ne!(light(0), light(3));
    // With all frames before it, on which it builds.
    lucerna(["rerun", frame(2).to_str().unwrap()]).expect(0, &[]);

    // Frames that run more than once change nothing.
    let pattern = folder.path().join("again-{frame}.exr").to_string_lossy().into_owned();
    igi(&[&film[..], &settings, &["--repeat", "2", "-o", &pattern]].concat()).expect(0, &[]);
    let again = image::read(folder.path().join("again-3.exr"), &Limits::default()).unwrap();
    assert_eq!(again.layer("").unwrap().data, light(3));

    // Time that is over after the first frame: what is there is whole, and the code says that some are missing.
    let late = tempfile::tempdir().unwrap();
    let pattern = late.path().join("{frame}.png").to_string_lossy().into_owned();
    let ran =
        igi(&[&film[..], &settings, &["--time-limit", "0.001s", "--json", "-o", &pattern]].concat()).expect(8, &[]);
    assert_eq!(files(late.path()), ["0.png"]);
    assert_eq!(ran.json()["complete"], false);
    igi(&["--time-limit", "soon"]).expect(2, &["10m"]);
}

#[test]
fn what_is_not_shown_is_said() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let name = folder.path().join("picture.png");
    let small = ["render", "--builtin", "conference", "--size", "8x6", "-D", "igi.vpls=4", "-D", "igi.candidates=1"];
    let ran = ran(command(env!("CARGO_BIN_EXE_igi")).args(small).arg("-o").arg(&name)).expect(0, &[]);
    for part in ["\"glass\": direct light does not pass through glass", "caustics of direct light are missing"] {
        assert!(ran.stderr.contains(part), "{part} is not in {}", ran.stderr);
    }
    // Not of glass alone, which is shown as glass.
    assert!(!ran.stderr.contains("drawn opaque"), "{}", ran.stderr);
}

#[test]
fn too_many_lights_for_maps_are_refused_and_the_most_named() {
    igi(&["-D", "igi.visibility=raster", "-D", "igi.vpls=5000"]).expect(2, &["igi.vpls: 5000", "4 to 2048"]);
}

#[test]
fn direct_light_alone_gathers_nothing_unless_layers_are_written() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    for (picture, times, gathers) in [("a.png", "a.csv", false), ("b.exr", "b.csv", true)] {
        let more = ["--mode", "direct", "-D", "igi.vpls=8", "-o", &at(picture), "--timings", &at(times)];
        igi(&more).expect(0, &[]);
        let passes = std::fs::read_to_string(at(times)).unwrap();
        assert!(passes.contains("igi.direct") && passes.contains("igi.gather") == gathers, "{picture}: {passes}");
    }
}
