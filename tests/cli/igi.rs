//! `igi render` from the outside: settings and what is wrong with them, layers, the same picture again. Needs a device (each test
//! says so when there is none).

mod support;

use lucerna::{image, scene::Limits};
use support::{command, device, lucerna, ran};

const SMALL: [&str; 6] = ["render", "--builtin", "cornell", "--size", "32x24", "-q"];

fn igi(more: &[&str]) -> support::Ran {
    ran(command(env!("CARGO_BIN_EXE_igi")).args(SMALL.iter().chain(more)))
}

#[test]
fn wrong_settings_are_refused_and_named() {
    for (arguments, part) in [
        (&["-D", "igi.vpls=0"][..], "1 to 10000"),
        (&["-D", "igi.bounces=9"], "1 to 8"),
        (&["-D", "igi.downsample=5"], "1 to 4"),
        (&["-D", "igi.bound=-1"], "0 to 1"),
        (&["-D", "igi.visibility=\"rays\""], "compute"),
        (&["-D", "igi.vlps=4"], "did you mean 'igi.vpls'"),
        (&["--mode", "occlusion"], "indirect"),
    ] {
        igi(arguments).expect(2, &[part]);
    }
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
    igi(&["-D", "igi.vpls=30", "-D", "igi.downsample=2", "--seed", "3", "--f32", "-o", name]).expect(0, &[]);
    let layers = image::read(&path, &Limits::default()).unwrap();
    let data = |name: &str| layers.layer(name).unwrap_or_else(|| panic!("no layer {name:?}")).data.clone();
    let (total, direct, indirect) = (data(""), data("direct"), data("indirect"));
    assert!(indirect.iter().any(|v| *v > 0.0));
    for ((total, direct), indirect) in total.iter().zip(&direct).zip(&indirect) {
        assert!((total - direct - indirect).abs() <= 1e-5 * total.abs() + 1e-7, "{total} {direct} {indirect}");
    }
    lucerna(["rerun", name]).expect(0, &[]);
}
