//! Objects whose pixels are important to selective tone mapping (`tonemap.important`).

use lucerna::{
    image::{self, Layers, srgb},
    scene::Limits,
};

use crate::support::{Ran, device, lucerna};

const SELECTIVE: [&str; 4] = ["-D", "tonemap.operator=ashikhmin", "-D", "tonemap.mode=selective"];

fn path(folder: &tempfile::TempDir, name: &str) -> String {
    folder.path().join(name).to_str().unwrap().to_owned()
}

fn render(words: &[&str], output: &str, more: &[&str]) -> Ran {
    let scene = ["--builtin", "cornell", "--size", "96x80", "-q", "-o", output];
    lucerna(words.iter().chain(&scene).chain(&SELECTIVE).chain(more).copied())
}

fn read(name: &str) -> Layers {
    image::read(name, &Limits::default()).unwrap()
}

/// The values of a picture and of the matte.
fn values(picture: &Layers) -> (Vec<[f32; 3]>, Vec<bool>) {
    let matte = picture.layer("chosen").map(|layer| layer.data.iter().map(|v| *v > 0.5).collect());
    (picture.main().unwrap().rgb_pixels().unwrap(), matte.unwrap_or_default())
}

#[test]
fn pixels_of_named_objects_are_important_and_the_picture_is_made_again() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    // A threshold that no edge reaches, so that names alone decide.
    let no_edges = ["-D", "tonemap.threshold=1e18"];
    let named = ["-D", "tonemap.threshold=1e18", "-D", "tonemap.important=short block,tall block"];
    let kinds = [(&["render", "isr"][..], "1"), (&["render", "isr"], "4"), (&["reference"], "")];
    for (number, (words, aa)) in kinds.into_iter().enumerate() {
        let aa: Vec<&str> = if aa.is_empty() { vec!["--spp", "4"] } else { vec!["--aa", aa] };
        let [none, some, all] = ["none", "some", "all"].map(|name| path(&folder, &format!("{name}{number}.exr")));
        render(words, &none, &[&no_edges[..], &aa].concat()).expect(0, &[]);
        render(words, &some, &[&named[..], &aa].concat()).expect(0, &[]);
        render(words, &all, &[&["-D", "tonemap.mode=local"][..], &aa].concat()).expect(0, &[]);
        let [(none, no_matte), (chosen, matte), (all, _)] = [&none, &some, &all].map(|name| values(&read(name)));
        assert!(no_matte.is_empty());
        let marked = matte.iter().filter(|v| **v).count();
        assert!((1000..3500).contains(&marked), "{words:?}: {marked} of {} pixels", matte.len());
        // Local adaptation where the object is, the global curve elsewhere.
        for i in 0..matte.len() {
            let wanted = if matte[i] { all[i] } else { none[i] };
            assert_eq!(chosen[i], wanted, "{words:?} {aa:?} pixel {i}");
        }
        assert!((0..matte.len()).any(|i| matte[i] && all[i] != none[i]), "{words:?}: both adaptations are the same");
        lucerna(["rerun", &some]).expect(0, &[]);
        // A picture without layers has the same pixels.
        let png = path(&folder, &format!("some{number}.png"));
        render(words, &png, &[&named[..], &aa].concat()).expect(0, &[]);
        lucerna(["rerun", &png]).expect(0, &[]);
        let shown = values(&read(&png)).0;
        let apart = |a: f32, b: f32| (srgb::encode(a.clamp(0.0, 1.0)) - srgb::encode(b)).abs();
        let most = chosen.as_flattened().iter().zip(shown.as_flattened()).map(|(a, b)| apart(*a, *b));
        assert!(most.fold(0.0, f32::max) < 1.5 / 255.0, "{words:?}: the file without layers has another picture");
    }
}

#[test]
fn unknown_names_and_photographs_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let output = path(&folder, "a.exr");
    if device() {
        for words in [&["render", "isr"][..], &["reference"]] {
            let ran = render(words, &output, &["-D", "tonemap.important=short block,tall block,bal"]);
            ran.expect(2, &["tonemap.important", "'bal'", "Materials: "]);
        }
    }
    if device() {
        let ran = lucerna([
            "render",
            "isr",
            "--builtin",
            "cornell",
            "--size",
            "32x32",
            "-q",
            "-o",
            &output,
            "-D",
            "tonemap.important=floor",
        ]);
        ran.expect(2, &["tonemap.important", "tonemap.mode=selective"]);
        let ran = render(&["render", "isr"], &output, &["-D", "tonemap.important= , "]);
        ran.expect(2, &["tonemap.important", "has no name"]);
    }
    let ran = lucerna(["tonemap", "none.exr", "-o", &output, "-D", "tonemap.important=wall", "-q"]);
    ran.expect(2, &["tonemap.important", "--mask"]);
    assert!(!std::path::Path::new(&output).exists());
}
