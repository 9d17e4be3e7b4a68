//! One door: `lucerna render`, files in the place of commands, misspelt names, help, completions and man pages.

use crate::support::{command, device, files, isr, lucerna, ran};

#[test]
fn the_technique_is_chosen_and_named() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (chosen, named, short) = (path("a.png"), path("b.png"), path("c.png"));
    let small = ["--builtin", "cornell", "--size", "48x40", "-o"];
    lucerna(["render"].iter().chain(&small).chain(&[chosen.as_str()])).expect(0, &["technique: isr, because"]);
    lucerna(["render", "isr"].iter().chain(&small).chain(&[named.as_str()])).expect(0, &[]);
    isr(small.iter().chain(&[short.as_str()])).expect(0, &[]);
    let bytes = |name: &str| std::fs::read(name).unwrap();
    assert!(bytes(&chosen) == bytes(&named) && bytes(&named) == bytes(&short));
    lucerna(["rerun", "-q", &chosen]).expect(0, &[]);
    // Only igi has mirrors.
    let mirrors = ["render", "--builtin", "conference", "--list-passes", "-o", "x.png"];
    lucerna(mirrors).expect(0, &["technique: igi, because"]);
}

#[test]
fn a_wrong_word_gets_the_right_one() {
    lucerna(["render", "irs", "a.glb"]).expect(2, &["did you mean 'isr'"]);
    lucerna(["office"]).expect(2, &["lucerna render --builtin office"]);
    lucerna(["a.exr"]).expect(2, &["lucerna info", "lucerna tonemap"]);
    isr(["a.exr", "-o", "b.png"]).expect(2, &["lucerna tonemap"]);
    isr(["no/such/model.glb"]).expect(3, &["no/such/model.glb"]);
    lucerna(["no/such/model.glb"]).expect(3, &["no/such/model.glb"]);
    lucerna(["render", "isr", "--builtin", "cornel"]).expect(2, &["Did you mean \"cornell\""]);
    isr(["render", "--builtin", "cornell", "--sizee", "4x4"]).expect(2, &["--size"]);
    isr(["render", "--builtin", "cornell", "--preset", "bets"]).expect(2, &["'best'"]);
    isr(["render", "--print-config", "-D", "sampels=3"]).expect(2, &["of isr", "did you mean 'isr.samples'"]);
    isr(["render", "--print-config", "-D", "igi.vpls=3"]).expect(2, &["it is a setting of igi"]);
    isr(["render", "--builtin", "cornell", "--environment", "groove"]).expect(3, &["Did you mean \"grove\""]);
}

#[test]
fn a_command_that_prints_its_settings_needs_no_name_for_a_file() {
    for (kind, key) in [("prt", "samples = "), ("daylight", "interval = ")] {
        let printed = lucerna(["bake", kind, "--builtin", "parlour", "--print-config"]).expect(0, &[]).stdout;
        assert!(printed.contains(key), "{kind}: {printed}");
        lucerna(["bake", kind, "--builtin", "parlour"]).expect(2, &["--output"]);
    }
}

#[test]
fn completions_and_man_pages_cover_all_programs() {
    for shell in ["bash", "zsh", "fish"] {
        let text = lucerna(["completions", shell]).expect(0, &[]).stdout;
        for part in ["lucerna", "isr", "igi", "fiv", "daylight", "prt", "tonemap", "default-light"] {
            assert!(text.contains(part), "{shell}: {part}");
        }
    }
    let text = lucerna(["completions", "bash"]).stdout;
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("lucerna.bash");
    std::fs::write(&script, &text).unwrap();
    let output = command("bash").arg("-n").arg(&script).output();
    assert!(output.is_ok_and(|output| output.status.success()), "bash cannot read its completions");
    lucerna(["completions", "bsh"]).expect(2, &["bash"]);
    let pages = folder.path().join("man");
    let pages = pages.to_str().unwrap();
    lucerna(["man", pages]).expect(0, &["pages"]);
    let names = files(pages.as_ref());
    for name in ["lucerna.1", "lucerna-render-isr.1", "lucerna-bake-prt.1", "isr-render.1", "tonemap.1"] {
        assert!(names.contains(&name.to_owned()), "{name}: {names:?}");
    }
    let page = std::fs::read_to_string(folder.path().join("man/isr-render.1")).unwrap();
    assert!(page.starts_with(".ie") && page.contains("Exit codes") && page.contains("default\\-light"), "{page}");
    lucerna(["man", pages]).expect(1, &["exists"]);
    lucerna(["man", pages, "--overwrite"]).expect(0, &[]);
}

#[test]
fn several_pictures_are_told_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    for (name, value) in [("a.pfm", 0.25), ("b.pfm", 0.5), ("c.exr", 0.5)] {
        let layers = lucerna::image::Layers::rgb(2, 2, vec![value; 12]);
        lucerna::image::write(std::path::Path::new(&path(name)), &layers, &Default::default()).unwrap();
    }
    let list = lucerna(["info", "--json", &path("*.pfm")]).expect(0, &[]).json();
    assert_eq!((list.as_array().unwrap().len(), list[1]["info"]["width"].as_u64()), (2, Some(2)));
    let all = lucerna(["info", &path("")]).expect(0, &[]).stdout;
    assert!(["a.pfm", "b.pfm", "c.exr"].iter().all(|name| all.contains(name)), "{all}");
    let table = lucerna(["compare", "--json", "-m", "mae", &path("c.exr"), &path("*.pfm")]).expect(0, &[]).json();
    assert_eq!(table["tests"].as_array().map(Vec::len), Some(2), "{table}");
    let out = path("out/");
    let mut tonemap = command(env!("CARGO_BIN_EXE_tonemap"));
    if device() {
        ran(tonemap.args([&path(""), "-o", &format!("{out}{{name}}.png")])).expect(0, &[]);
        assert_eq!(files(out.as_ref()), ["a.png", "b.png", "c.png"]);
    }
}
