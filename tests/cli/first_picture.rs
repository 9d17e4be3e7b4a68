//! The first picture of a stranger's file is not black: lights that are added before and after a picture, and what is said about them.

use std::{fs, path::Path};

use crate::support::{self, Ran, device, lucerna};
use lucerna::{image, scene::Limits};

/// A wall of 2 m whose front looks along +Z.
const WALL: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n";

fn write(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

fn isr(scene: &str, output: &str, more: &[&str]) -> Ran {
    support::isr(["render", scene, "--size", "48x36", "--overwrite", "-o", output].iter().chain(more))
}

/// Mean of all channels of a picture.
fn mean(path: &str) -> f32 {
    let layers = image::read(path, &Limits::default()).unwrap();
    let data = &layers.main().unwrap().data;
    data.iter().sum::<f32>() / data.len() as f32
}

#[test]
fn a_picture_that_would_be_black_is_made_again_with_a_light_and_that_is_said() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let wall = write(folder.path(), "wall.obj", WALL);
    let output = folder.path().join("a.exr").to_str().unwrap().to_owned();
    // The lamp of the user is behind the wall.
    let lamp = ["--light", "0,0,-2,5"];
    let said = isr(&wall, &output, &lamp).expect(0, &["would be black", "--default-light always"]);
    assert_eq!(said.stderr.matches("would be black").count(), 1, "{}", said.stderr);
    assert!(mean(&output) > 0.05, "{}", mean(&output));
    lucerna(["rerun", "-q", &output]).expect(0, &[]);
    // A user who wants no other light gets none, and is told that the picture is black.
    let dark = [&lamp[..], &["--default-light", "never"]].concat();
    let said = isr(&wall, &output, &dark).expect(0, &["the picture is black"]);
    assert!(!said.stderr.contains("would be black") && mean(&output) == 0.0, "{}", said.stderr);
    let json = isr(&wall, &output, &[&lamp[..], &["--json"]].concat()).expect(0, &[]).json();
    assert!(json["notes"].to_string().contains("would be black"), "{json}");
    assert_eq!(json["complete"], true);
}

#[test]
fn a_camera_in_a_closed_box_gets_a_lamp_beside_it() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let corners = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n";
    // Faces look inwards and outwards.
    let inwards = "f 1 2 3 4\nf 6 5 8 7\nf 5 1 4 8\nf 2 6 7 3\nf 4 3 7 8\nf 5 6 2 1\n";
    let outwards = "f 4 3 2 1\nf 7 8 5 6\nf 8 4 1 5\nf 3 7 6 2\nf 8 7 3 4\nf 1 2 6 5\n";
    // 1 m is too small for a room, which would get a lamp at once.
    let text = format!("{corners}{inwards}{outwards}");
    let scene = write(folder.path(), "box.obj", &text);
    let camera = write(folder.path(), "c.toml", "position = [0.3, 0, 0.3]\ntarget = [0, 0, -0.5]\nyfov_degrees = 60");
    let output = folder.path().join("a.exr").to_str().unwrap().to_owned();
    let more = ["--unit", "0.5", "--camera", &camera, "--light", "0,9,0,5"];
    let said = isr(&scene, &output, &more).expect(0, &["a lamp beside the camera (--light "]);
    assert!(mean(&output) > 0.01, "{}: {}", mean(&output), said.stderr);
    lucerna(["rerun", "-q", &output]).expect(0, &[]);
}

#[test]
fn a_small_glowing_part_does_not_keep_the_sun_away() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), "m.mtl", "newmtl grey\nKd 0.5 0.5 0.5\nnewmtl glow\nKd 0 0 0\nKe 1 1 1\n");
    let part = "usemtl glow\nv 0.8 0.8 0.01\nv 0.9 0.8 0.01\nv 0.9 0.9 0.01\nf 5 6 7\n";
    let scene = write(folder.path(), "a.obj", &format!("mtllib m.mtl\nusemtl grey\n{WALL}{part}"));
    let output = folder.path().join("a.exr").to_str().unwrap().to_owned();
    isr(&scene, &output, &[]).expect(0, &["light too little of the picture: a sun and a sky were added"]);
    assert!(mean(&output) > 0.05, "{}", mean(&output));
    // A large lamp over the wall lights it.
    let lamp = "usemtl glow\nv -1 1.5 1\nv 1 1.5 1\nv 1 1.5 0\nv -1 1.5 0\nf 8 7 6 5\n";
    let scene = write(folder.path(), "b.obj", &format!("mtllib m.mtl\nusemtl grey\n{WALL}{lamp}"));
    let said = isr(&scene, &output, &[]).expect(0, &["only emissive surfaces light the scene"]);
    assert!(!said.stderr.contains("were added"), "{}", said.stderr);
}
