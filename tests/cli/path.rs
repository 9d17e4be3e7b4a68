//! `--camera-path`: a camera that flies through the views of a list.

use crate::support::{device, files, isr, lucerna};

const LIST: &str = r#"
scene = "cornell"
seed = 0
[[view]]
name = "a"
origin = "recorded"
position = [0.0, 0.27, 1.0]
target = [0.0, 0.27, 0.0]
yfov_degrees = 40.0
znear = 0.05
[[view]]
name = "b"
origin = "recorded"
position = [0.1, 0.3, 0.8]
target = [0.0, 0.2, 0.0]
yfov_degrees = 50.0
znear = 0.05
"#;

#[test]
fn wrong_paths_are_refused_and_named() {
    let folder = tempfile::tempdir().unwrap();
    let one = folder.path().join("one.toml");
    std::fs::write(&one, LIST.split("[[view]]\nname = \"b\"").next().unwrap()).unwrap();
    let fly = |path: &str| {
        isr(["render", "--builtin", "cornell", "--frames", "0..2", "-o", "x{frame}.png", "--camera-path", path])
    };
    fly(one.to_str().unwrap()).expect(3, &["one.toml", "2 to 10000 views", "--camera-path"]);
    fly("no/such.toml").expect(3, &["no/such.toml"]);
    fly("list.toml,0").expect(2, &["--camera-path"]);
    isr(["render", "--builtin", "cornell", "--camera", "0", "--camera-path", "a.toml", "-o", "x.png"])
        .expect(2, &["--camera-path"]);
}

#[test]
fn a_flight_begins_at_one_view_and_ends_at_the_other() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(at("list.toml"), LIST).unwrap();
    let common = ["render", "--builtin", "cornell", "--size", "32x24", "--exposure", "0", "--aa", "1"];
    let flight = ["--camera-path", &format!("{},0.5", at("list.toml")), "--fps", "4", "--frames", "0..3"];
    isr([&common[..], &flight, &["-o", &at("f{frame}.exr")]].concat()).expect(0, &[]);
    assert_eq!(files(folder.path()), ["f0.exr", "f1.exr", "f2.exr", "list.toml"]);
    for (name, frame) in [("a", "f0.exr"), ("b", "f2.exr")] {
        let one = at(&format!("{name}.exr"));
        isr([&common[..], &["--camera", &format!("{}#{name}", at("list.toml")), "-o", &one]].concat()).expect(0, &[]);
        lucerna(["compare", &one, &at(frame), "-m", "rel-mse", "--fail-over", "rel-mse=0"]).expect(0, &[]);
    }
    lucerna(["compare", &at("a.exr"), &at("f1.exr"), "-m", "rel-mse", "--fail-over", "rel-mse=1e-3"]).expect(7, &[]);
    // The record has the flight itself, not the name of its file.
    std::fs::remove_file(at("list.toml")).unwrap();
    lucerna(["rerun", &at("f1.exr")]).expect(0, &[]);
}
