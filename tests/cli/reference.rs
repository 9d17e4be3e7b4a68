//! `lucerna reference` from the outside: exit codes, the same bytes whatever happens on the way. Needs a device.

use std::{
    fs,
    path::Path,
    process::{Child, Stdio},
    time::{Duration, Instant},
};

use crate::support::{Ran, command, device, files, lucerna};
use lucerna::{image, scene::Limits};

const SMALL: [&str; 6] = ["reference", "--builtin", "cornell-area", "--size", "48x40", "-q"];

fn reference(more: &[&str]) -> Ran {
    lucerna(SMALL.iter().chain(more))
}

fn path(folder: &tempfile::TempDir, name: &str) -> String {
    folder.path().join(name).to_str().unwrap().to_owned()
}

#[test]
fn wrong_usage_is_exit_code_2() {
    lucerna(["reference"]).expect(2, &["no scene was given"]);
    for (arguments, part) in [
        (&["--spp", "0"][..], "--spp"),
        (&["--time-limit", "soon"], "10m"),
        (&["--target-error", "0"], "above zero"),
        (&["--bounces", "1001"], "0 to 1000"),
        (&["-D", "reference.bouncs=1"], "reference.bounces"),
        (&["-D", "reference.sources=moon"], "environment"),
        (&["-o", "x.tga"], ".exr"),
    ] {
        reference(arguments).expect(2, &[part]);
    }
    let printed = reference(&["--print-config", "--bounces", "3", "-D", "reference.diffuse_only=true"]).expect(0, &[]);
    for line in ["samples = 256", "bounces = 3", "diffuse_only = true", "strategy = \"mis\""] {
        assert!(printed.stdout.contains(line), "{line} is not in {}", printed.stdout);
    }
}

#[test]
fn a_picture_says_how_it_was_made_and_is_made_again() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (exr, indirect) = (path(&folder, "a.exr"), path(&folder, "b.exr"));
    let run = reference(&["--spp", "6", "--bounces", "2", "--seed", "5", "-o", &exr, "--json"]).expect(0, &[]);
    let json = run.json();
    assert_eq!((json["samples"].as_f64(), json["ended_by"].as_str()), (Some(6.0), Some("samples")));
    assert!(json["relative_error"].as_f64().is_some_and(|e| e > 0.0) && json["paths"] == 6 * 48 * 40);
    assert_eq!(files(folder.path()), ["a.exr"], "no state is left of what is done");
    let picture = image::read(&exr, &Limits::default()).unwrap();
    let names: Vec<&str> = picture.layers.iter().map(|l| l.name.as_str()).collect();
    for name in ["", "direct", "indirect", "emission", "albedo", "normal", "position", "depth", "samples", "variance"] {
        assert!(names.contains(&name), "{name:?} is not in {names:?}");
    }
    let layer = |name: &str| &picture.layer(name).unwrap().data;
    for i in 0..layer("").len() {
        let sum = layer("direct")[i] + layer("indirect")[i] + layer("emission")[i];
        assert!((layer("")[i] - sum).abs() <= 1e-5 * sum.abs() + 1e-7);
    }
    assert!(layer("samples").iter().all(|&n| n == 6.0));
    lucerna(["rerun", &exr]).expect(0, &[]);
    // Any layer can be the picture.
    reference(&["--spp", "6", "--bounces", "2", "--seed", "5", "--show", "indirect", "-o", &indirect]).expect(0, &[]);
    let shown = image::read(&indirect, &Limits::default()).unwrap();
    assert!(shown.layer("").unwrap().data == *layer("indirect"));
    lucerna(["rerun", &indirect]).expect(0, &[]);
}

#[test]
fn time_and_error_end_it_with_a_picture() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (exr, other) = (path(&folder, "a.exr"), path(&folder, "b.exr"));
    let run = reference(&["--spp", "1000000", "--time-limit", "0.5s", "-o", &exr, "--json"]).expect(8, &[]);
    assert_eq!(run.json()["ended_by"], "time");
    assert_eq!(files(folder.path()), ["a.exr", "a.exr.state"]);
    assert!(image::read(&exr, &Limits::default()).unwrap().layer("").unwrap().data.iter().all(|v| v.is_finite()));
    let run = reference(&["--spp", "1000000", "--target-error", "0.5", "-o", &other, "--json"]).expect(0, &[]);
    assert!(run.json()["ended_by"] == "error" && run.json()["relative_error"].as_f64().unwrap() <= 0.5);
    lucerna(["rerun", &other]).expect(0, &[]);
    // A state of other options is refused, and left alone.
    let refused = reference(&["--resume", "--bounces", "3", "-o", &exr]).expect(3, &["bounces was 8, now is 3"]);
    assert_eq!(refused.errors(), 1);
    // Nor does a run that is not to go on with it take its place: it may be worth hours.
    let state = path(&folder, "a.exr.state");
    let kept = fs::read(&state).unwrap();
    let picture = image::read(&exr, &Limits::default()).unwrap();
    let samples = picture.layer("samples").unwrap().data.iter().copied().fold(f32::INFINITY, f32::min);
    for more in [&["--spp", "2", "--overwrite"][..], &["--spp", "2", "--overwrite", "--time-limit", "0.1s"]] {
        let said = format!("{samples:.0} samples a pixel of 48×40");
        reference(&[more, &["-o", &exr]].concat()).expect(1, &["a.exr.state", &said, "--resume", "--restart"]);
        assert!(fs::read(&state).unwrap() == kept);
    }
    reference(&["--resume", "--restart", "-o", &exr]).expect(2, &["--restart"]);
    // Numbers that no run writes.
    let mut forged = kept.clone();
    forged[24..32].copy_from_slice(&u64::MAX.to_le_bytes());
    let end = forged.len() - 8;
    let check = checksum(&forged[..end]);
    forged[end..].copy_from_slice(&check.to_le_bytes());
    fs::write(&state, &forged).unwrap();
    reference(&["--resume", "-o", &exr]).expect(3, &["a.exr.state", "18446744073709551615 samples"]);
    fs::write(&state, b"lucerna tracer 1 and nothing else").unwrap();
    reference(&["--resume", "-o", &exr]).expect(3, &["a.exr.state", "checksum"]);
    reference(&["--spp", "2", "--overwrite", "-o", &exr]).expect(1, &["a.exr.state", "--restart"]);
    reference(&["--spp", "2", "--overwrite", "--restart", "-o", &exr]).expect(0, &[]);
    assert!(!Path::new(&state).exists());
}

/// That of a state: it notices damage and is no secret.
fn checksum(bytes: &[u8]) -> u64 {
    bytes.chunks(8).fold(0xcbf2_9ce4_8422_2325_u64, |hash, chunk| {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        (hash ^ u64::from_le_bytes(word)).wrapping_mul(0x0000_0100_0000_01b3).rotate_left(17)
    })
}

#[test]
fn a_picture_is_not_gone_on_with_by_another_way_to_trace_rays() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let exr = path(&folder, "a.exr");
    reference(&["--spp", "1000000", "--time-limit", "0.2s", "--ray-query", "off", "-o", &exr]).expect(8, &[]);
    let state = fs::read(path(&folder, "a.exr.state")).unwrap();
    let refused = reference(&["--resume", "--ray-query", "on", "-o", &exr]);
    if refused.code != 3 {
        assert!(refused.code != 0, "went on with a state of another way to trace rays");
        eprintln!("SKIPPED: the device has no ray queries: {}", refused.stderr);
        return;
    }
    refused.expect(3, &["ray_query was false, now is true"]);
    assert!(fs::read(path(&folder, "a.exr.state")).unwrap() == state, "the state is left alone");
}

fn begin(output: &str, spp: &str) -> Child {
    let mut command = command(env!("CARGO_BIN_EXE_lucerna"));
    command.args(SMALL).args(["--spp", spp, "-o", output, "--resume"]).env("LUCERNA_CHECKPOINT_SECONDS", "0.02");
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

fn wait_for(file: &str) {
    let begun = Instant::now();
    while !Path::new(file).exists() {
        assert!(begun.elapsed() < Duration::from_secs(300), "{file} does not appear");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn killed_and_run_again_it_ends_with_the_same_bytes() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (whole, broken) = (path(&folder, "whole.exr"), path(&folder, "broken.exr"));
    let state = format!("{broken}.state");
    reference(&["--spp", "200", "-o", &whole]).expect(0, &[]);
    let mut killed = 0;
    for _ in 0..3 {
        let mut child = begin(&broken, "200");
        wait_for(&state);
        // Some way on from there.
        std::thread::sleep(Duration::from_millis(30));
        killed += u32::from(child.try_wait().unwrap().is_none());
        let _ = child.kill();
        child.wait().unwrap();
        if !Path::new(&state).exists() {
            break;
        }
    }
    assert!(killed > 0, "it was always done before it could be killed");
    reference(&["--spp", "200", "-o", &broken, "--resume"]).expect(0, &[]);
    assert!(fs::read(&whole).unwrap() == fs::read(&broken).unwrap(), "not the same bytes");
    assert!(!Path::new(&state).exists());
}

#[test]
fn an_interrupt_leaves_a_picture_and_a_state() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let exr = path(&folder, "a.exr");
    let mut child = begin(&exr, "100000");
    wait_for(&format!("{exr}.state"));
    assert!(command("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(8));
    let picture = image::read(&exr, &Limits::default()).unwrap();
    assert!(picture.layer("samples").unwrap().data.iter().all(|&n| n >= 1.0));
    assert_eq!(files(folder.path()), ["a.exr", "a.exr.state"]);
}

#[test]
fn a_state_is_of_one_scene_one_time_and_one_seed() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let (scene, paint, exr) = (path(&folder, "a.obj"), path(&folder, "a.mtl"), path(&folder, "a.exr"));
    fs::write(&scene, "mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 4 3\n").unwrap();
    fs::write(&paint, "newmtl a\nKd 0.5 0.5 0.5\n").unwrap();
    let run = |more: &[&str]| lucerna(["reference", &scene, "--size", "24x20", "-q", "-o", &exr].iter().chain(more));
    run(&["--spp", "1000000", "--time-limit", "0.2s", "--seed", "3"]).expect(8, &[]);
    let state = fs::read(format!("{exr}.state")).unwrap();
    run(&["--resume"]).expect(3, &["settings.seed was 3, now is 0"]);
    run(&["--resume", "--seed", "3", "--time", "1"]).expect(3, &["time was 0.0, now is 1.0"]);
    fs::write(&paint, "newmtl a\nKd 0.5 0.5 0.4\n").unwrap();
    run(&["--resume", "--seed", "3"]).expect(3, &["scene was "]);
    assert!(fs::read(format!("{exr}.state")).unwrap() == state, "the state is left alone");
}
