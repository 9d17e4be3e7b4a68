//! `--aa`: stills with smooth edges, as means of pictures whose pixels look at different places around their middles.

use std::{fs, path::Path};

use crate::support::{Ran, command, device, isr, lucerna, ran};
use lucerna::{
    image::{self, Layers},
    scene::Limits,
};

fn path(folder: &tempfile::TempDir, name: &str) -> String {
    folder.path().join(name).to_str().unwrap().to_owned()
}

/// Light of unseen surfaces is off: its noise has nothing to do with edges.
fn room<'a>(more: &[&'a str]) -> Ran {
    let all: Vec<&'a str> = ["render", "--builtin", "cornell", "--size", "96x80", "-q", "-D", "isr.unseen=0"]
        .into_iter()
        .chain(more.iter().copied())
        .collect();
    isr(all)
}

fn read(name: &str) -> Layers {
    image::read(name, &Limits::default()).unwrap()
}

fn sum(layers: &Layers) -> f64 {
    layers.main().unwrap().data.iter().map(|value| f64::from(*value)).sum()
}

fn config(name: &str) -> serde_json::Value {
    image::metadata(Path::new(name)).unwrap().config
}

#[test]
fn a_still_is_the_mean_of_eight_and_its_edges_are_smooth() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let [usual, one, eight, many] = [None, Some("1"), Some("8"), Some("64")].map(|count| {
        let name = path(&folder, &format!("{}.exr", count.unwrap_or("usual")));
        let options: Vec<&str> = count.map_or(vec!["-o", &name], |count| vec!["-o", &name, "--aa", count]);
        room(&options).expect(0, &[]);
        name
    });
    assert!(fs::read(&usual).unwrap() == fs::read(&eight).unwrap());
    let flip = |test: &str| {
        let report = lucerna(["compare", "-q", "-m", "flip", "--json", &many, test]).expect(0, &[]).json();
        report["tests"][0]["measures"]["flip"]["value"].as_f64().unwrap_or_else(|| panic!("{report}"))
    };
    let [of_one, of_eight] = [flip(&one), flip(&eight)];
    assert!(of_eight < 0.02 && of_eight < 0.5 * of_one, "{of_eight} {of_one}");
    let [one_picture, mean, best] = [&one, &eight, &many].map(|name| read(name));
    assert!((sum(&mean) / sum(&best) - 1.0).abs() < 5e-3);
    for exact in ["normal", "depth"] {
        assert!(one_picture.layer(exact).unwrap().data == mean.layer(exact).unwrap().data, "{exact}");
    }
    assert!(one_picture.layer("direct").unwrap().data != mean.layer("direct").unwrap().data);
    // The file says so, and can be made again.
    let [of_one, of_eight] = [config(&one), config(&eight)];
    assert_eq!(of_eight["aa"], serde_json::json!({ "count": 8, "filter": "box" }));
    let exact = of_eight["exact"].to_string();
    assert!(exact.contains("normal") && exact.contains("depth") && !exact.contains("direct"), "{exact}");
    assert!(of_one.get("aa").is_none() && of_one.get("exact").is_none(), "{of_one}");
    let report = lucerna(["rerun", "--json", "-q", &eight]).expect(0, &[]).json();
    assert_eq!(report["same_file"], true, "{report}");
}

/// Where one picture takes a CPU driver seconds, its light serves the places inside the pixels.
#[test]
fn a_still_that_takes_long_is_one_picture_with_smooth_edges() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let [usual, one, edges, many] = [None, Some("1"), Some("edges"), Some("16")].map(|aa| {
        let name = path(&folder, &format!("{}.exr", aa.unwrap_or("usual")));
        let aa: Vec<&str> = aa.map_or(vec![], |aa| vec!["--aa", aa]);
        // Indirect light has noise, which has nothing to do with edges.
        let of = ["render", "igi", "--builtin", "cornell", "--size", "96x80", "-q", "--mode", "direct", "-o", &name];
        lucerna([&of[..], &aa].concat()).expect(0, &[]);
        name
    });
    let devices = lucerna(["devices", "--json"]).expect(0, &[]).json();
    if devices.as_array().unwrap().iter().all(|device| device["kind"] == "CPU") {
        assert!(fs::read(&usual).unwrap() == fs::read(&edges).unwrap());
    }
    let flip = |test: &str| {
        let report = lucerna(["compare", "-q", "-m", "flip", "--json", &many, test]).expect(0, &[]).json();
        report["tests"][0]["measures"]["flip"]["value"].as_f64().unwrap_or_else(|| panic!("{report}"))
    };
    let [of_one, of_edges] = [flip(&one), flip(&edges)];
    println!("FLIP: {of_edges} with smooth edges, {of_one} without");
    assert!(of_edges < 0.6 * of_one, "{of_edges} {of_one}");
    let [plain, smooth, best] = [&one, &edges, &many].map(|name| read(name));
    assert!((sum(&smooth) / sum(&best) - 1.0).abs() < 1e-2);
    // All layers of colours change with the picture, and only they.
    for layer in &plain.layers {
        let same = layer.data == smooth.layer(&layer.name).unwrap().data;
        let dark = layer.data.iter().all(|value| *value == 0.0);
        assert!(same == (dark || layer.channels != ["R", "G", "B"]), "{}", layer.name);
    }
    let about = config(&edges);
    assert_eq!(about["aa"], serde_json::json!({ "count": 1, "filter": "box", "edges": true }));
    let exact = about["exact"].to_string();
    assert!(exact.contains("normal") && exact.contains("depth") && !exact.contains("direct"), "{exact}");
    let report = lucerna(["rerun", "--json", "-q", &edges]).expect(0, &[]).json();
    assert_eq!(report["same_file"], true, "{report}");
}

#[test]
fn filters_keep_the_light_and_tone_mapping_comes_after_the_mean() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let made = |name: &str, more: &[&str]| {
        let name = path(&folder, name);
        room(&[&["-o", &name, "--f32", "--aa", "5"], more].concat()).expect(0, &[]);
        (read(&name), name)
    };
    let (even, _) = made("box.exr", &[]);
    for filter in ["tent", "blackman-harris"] {
        let (other, name) = made(&format!("{filter}.exr"), &["--aa-filter", filter]);
        assert!(
            (sum(&other) / sum(&even) - 1.0).abs() < 5e-3 && other.main().unwrap().data != even.main().unwrap().data
        );
        assert_eq!(config(&name)["aa"]["filter"], filter);
    }
    let (mapped, name) = made("mapped.exr", &["-D", "tonemap.operator=reinhard"]);
    assert_eq!(mapped.layer("light").unwrap().data, even.main().unwrap().data);
    assert!(mapped.main().unwrap().data != even.main().unwrap().data);
    let report = lucerna(["rerun", "--json", "-q", &name]).expect(0, &[]).json();
    assert_eq!(report["same_file"], true, "{report}");
}

#[test]
fn papers_and_images_of_the_graph_have_single_pictures() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let name = path(&folder, "a-{frame}.exr");
    let first = path(&folder, "a-0.exr");
    for more in [
        &["--paper"][..],
        &["--paper", "--frames", "0..2"],
        &["--view", "gbuffer.normal"],
        &["--mode", "occlusion", "--frames", "0..2"],
    ] {
        let ran = room(&[&["-o", &name, "--overwrite", "--json"], more].concat()).expect(0, &[]);
        assert_eq!(ran.json()["aa"], serde_json::json!({ "count": 1, "filter": "box" }), "{more:?}");
        assert!(config(&first).get("aa").is_none(), "{more:?}");
    }
    let ran = room(&["-o", &name, "--overwrite", "--json", "--paper", "--aa", "3"]).expect(0, &[]).json();
    assert_eq!((&ran["aa"]["count"], ran["frames"][0]["runs"].as_array().unwrap().len()), (&3.into(), 3));
    for (wrong, parts) in [
        (&["--aa", "0"][..], &["--aa", "1..=1024"][..]),
        (&["--aa", "2", "--view", "gbuffer.normal"], &["--aa", "--view"]),
        (&["--aa", "2", "--list-passes"], &["--aa", "--list-passes"]),
        (&["--aa-filter", "gauss"], &["box", "tent", "blackman-harris"]),
        (&["--aa", "2", "--mode", "occlusion"], &["--aa", "occlusion"]),
        (&["--aa", "temporal", "--mode", "occlusion"], &["--aa", "occlusion"]),
        (&["--aa", "edges", "--mode", "occlusion"], &["--aa", "occlusion"]),
        (&["--aa", "Temporal"], &["--aa", "1..=1024, edges or temporal"]),
        (&["--aa", "2", "--aa-frames", "4"], &["--aa-frames", "temporal"]),
        (&["--aa", "edges", "--aa-frames", "4"], &["--aa-frames", "temporal"]),
        (&["--aa", "temporal", "--aa-frames", "0"], &["--aa-frames", "1..=256"]),
    ] {
        room(wrong).expect(2, parts);
    }
}

/// A sequence has single pictures unless asked otherwise. Averaged over time, its later frames have smoother edges at the cost of single pictures.
#[test]
fn a_sequence_is_averaged_over_time_and_its_frames_can_be_made_again() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let sequence = |name: &str, more: &[&str]| {
        let name = path(&folder, &format!("{name}-{{frame}}.exr"));
        let report = room(&[&["-o", &name, "--frames", "4..16", "--json"], more].concat()).expect(0, &[]).json();
        ([4, 15].map(|frame| name.replace("{frame}", &frame.to_string())), report)
    };
    let (usual, report) = sequence("usual", &["--aa", "temporal"]);
    assert_eq!(report["aa"], serde_json::json!({ "count": 1, "filter": "box", "temporal": 8 }));
    let (asked, _) = sequence("asked", &["--aa-frames", "8"]);
    let (more, _) = sequence("more", &["--aa-frames", "16"]);
    let (single, report) = sequence("single", &[]);
    assert_eq!(report["aa"], serde_json::json!({ "count": 1, "filter": "box" }));
    let (best, _) = sequence("best", &["--aa", "64"]);
    assert!(usual.iter().zip(&asked).all(|(a, b)| fs::read(a).unwrap() == fs::read(b).unwrap()));
    let flip = |test: &str| {
        let report = lucerna(["compare", "-q", "-m", "flip", "--json", &best[1], test]).expect(0, &[]).json();
        report["tests"][0]["measures"]["flip"]["value"].as_f64().unwrap_or_else(|| panic!("{report}"))
    };
    let [of_usual, of_more, of_single] = [&usual, &more, &single].map(|files| flip(&files[1]));
    println!("FLIP: {of_usual}, {of_more} of 16 frames, {of_single} of single pictures");
    assert!(of_usual < 0.6 * of_single && of_more < 0.6 * of_single, "{of_usual} {of_more} {of_single}");
    // The light of one frame; the mean over frames is nearer (tests/temporal.rs).
    assert!((sum(&read(&usual[1])) / sum(&read(&best[1])) - 1.0).abs() < 2e-2);
    // The file says so: its layers are those of the frame alone. The matrices are those of the middles.
    let meta = |name: &str| image::metadata(Path::new(name)).unwrap();
    let about = meta(&usual[1]);
    assert_eq!(about.config["aa"]["temporal"], 8);
    let exact = about.config["exact"].to_string();
    assert!(["normal", "depth", "direct", "indirect"].iter().all(|name| exact.contains(name)), "{exact}");
    assert_eq!(about.world_to_ndc, meta(&single[1]).world_to_ndc);
    assert!(read(&usual[1]).layer("depth").unwrap().data != read(&single[1]).layer("depth").unwrap().data);
    // Frame 15 follows from all frames from 4 on.
    for file in [&usual[0], &usual[1], &more[1]] {
        let report = lucerna(["rerun", "--json", "-q", file]).expect(0, &[]).json();
        assert_eq!(report["same_file"], true, "{file}: {report}");
    }
    // Repeated runs for times change nothing.
    let (again, _) = sequence("again", &["--aa", "temporal", "--repeat", "2"]);
    assert!(read(&again[1]).main().unwrap().data == read(&usual[1]).main().unwrap().data);
}

/// The light of earlier frames goes on from the picture at the middles of the pixels.
#[test]
fn frames_of_a_sequence_with_history_can_be_made_again() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let name = path(&folder, "i-{frame}.exr");
    let all = ["render", "--builtin", "cornell", "--size", "48x40", "-q", "--frames", "0..3", "--aa", "2", "-o", &name];
    let more = ["-D", "igi.vpls=64", "-D", "igi.history=4"];
    ran(command(env!("CARGO_BIN_EXE_igi")).args(all.into_iter().chain(more))).expect(0, &[]);
    let last = path(&folder, "i-2.exr");
    let report = lucerna(["rerun", "--json", "-q", &last]).expect(0, &[]).json();
    assert_eq!(report["same_file"], true, "{report}");
}
