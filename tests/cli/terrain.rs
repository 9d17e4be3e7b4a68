//! `--terrain` from the outside: land from a height map, alone and around a scene, in every command.

use std::path::Path;

use crate::support::{device, isr, lucerna};

/// A map of `side` × `side` 16-bit heights.
fn hills(path: &Path, side: u32) {
    let height = |x: f64, y: f64| 0.5 + 0.3 * (9.0 * x).sin() * (6.0 * y + 1.0).cos() + 0.2 * (x - y);
    let codes = (0..side * side).map(|i| {
        let at = |k: u32| f64::from(k) / f64::from(side - 1);
        (height(at(i % side), at(i / side)).clamp(0.0, 1.0) * 65535.0).round() as u16
    });
    let bytes: Vec<u8> = codes.flat_map(u16::to_be_bytes).collect();
    let mut encoder = png::Encoder::new(std::fs::File::create(path).unwrap(), side, side);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
}

#[test]
fn wrong_terrains_are_refused_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("hills.png");
    hills(&map, 9);
    let map = map.to_str().unwrap();
    let land = |text: &str| lucerna(["inspect", "--terrain", text]);
    for numbers in ["0", "10,1e9", "10,1,-1", "10,1,0,2", "10,x"] {
        land(&format!("{map}@{numbers}")).expect(2, &["--terrain", "FILE[@WIDTH"]);
    }
    land("no/such.png").expect(3, &["no/such.png", "--terrain"]);
    let text = folder.path().join("text.png");
    std::fs::write(&text, "no picture").unwrap();
    land(text.to_str().unwrap()).expect(3, &["text.png"]);
    lucerna(["inspect", "--builtin", "cornell", "--ground", "--terrain", map]).expect(2, &["--ground", "--terrain"]);
}

#[test]
fn land_is_a_scene_of_its_own_and_part_of_others() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    hills(at("hills.png").as_ref(), 65);
    let map = at("hills.png");
    let triangles = |words: &[&str]| {
        let json = lucerna([&["inspect", "--json"], words].concat()).expect(0, &[]).json();
        json["counts"]["triangles"].as_u64().unwrap_or_else(|| panic!("{json}"))
    };
    // A smaller error takes more triangles, up to those of all samples.
    let [coarse, fine] = [1.0, 0.0].map(|error| triangles(&["--terrain", &format!("{map}@64,10,{error}")]));
    assert!(coarse > 2 && 8 * coarse < fine && fine <= 2 * 64 * 64, "{coarse} {fine}");
    let alone = triangles(&["--builtin", "hare"]);
    assert_eq!(triangles(&["--builtin", "hare", "--terrain", &format!("{map}@64,10,1")]), alone + coarse);
    if !device() {
        return;
    }
    let common = ["render", "--terrain", &map, "--size", "64x48"];
    isr([&common[..], &["-o", &at("a.png")]].concat()).expect(0, &[]);
    isr([&common[..], &["--set", "terrain.albedo=0.7", "-o", &at("b.png")]].concat()).expect(0, &[]);
    let [first, second] = ["a.png", "b.png"].map(|name| std::fs::read(at(name)).unwrap());
    assert_ne!(first, second);
    // The record of the picture has the land, and finds that its file was changed.
    lucerna(["rerun", &at("b.png")]).expect(0, &[]);
    hills(at("hills.png").as_ref(), 64);
    let ran = lucerna(["rerun", &at("b.png")]);
    assert_ne!(ran.code, 0, "another scene was taken for the same");
}
