use super::*;
use crate::experiment::file;

const TEXT: &str = r#"
title = "Test"
size = "40x30"
seed = 3
measures = ["mae"]

[[scene]]
name = "cornell"
builtin = "cornell"
cameras = ["0"]

[[technique]]
name = "isr"
kind = "isr"
layers = ["direct"]
repeat = 2
settings = { "isr.samples" = 24 }
"#;

/// Key of the only picture of an experiment.
fn key(text: &str, device: &str, needs: Option<&str>) -> String {
    let experiment = file::parse("test", None, text, false).unwrap();
    let folders = Folders::new(&experiment, None);
    let loaded = place::load(&experiment, &experiment.scenes[0], &folders).unwrap().unwrap();
    let step = Step { view: 0, method: 0, variant: Changes::new() };
    let needs = needs.map(str::to_owned);
    let (entry, method) = (&experiment.scenes[0], &experiment.methods[0]);
    let one = One { experiment: &experiment, entry, loaded: &loaded, method, step: &step, needs: &needs };
    one.describe(device).unwrap().1.name
}

#[test]
fn the_key_of_a_picture_follows_every_line_that_changes_it() {
    let same = key(TEXT, "gpu", None);
    assert_eq!(same, key(&TEXT.replace("Test", "Other").replace("\"mae\"", "\"psnr\""), "gpu", None));
    let mut names = vec![same, key(TEXT, "cpu", None), key(TEXT, "gpu", Some("3.7"))];
    for (from, to) in [
        ("seed = 3", "seed = 4"),
        ("40x30", "41x30"),
        ("cameras = [\"0\"]", "cameras = [\"0\"]\nlight = [\"0,1.5,0,2\"]"),
        ("\"direct\"", "\"indirect\""),
        ("repeat = 2", "repeat = 3"),
        ("= 24", "= 48"),
        ("builtin = \"cornell\"", "builtin = \"teapot\""),
    ] {
        let changed = TEXT.replace(from, to);
        assert_ne!(changed, TEXT, "{from}");
        names.push(key(&changed, "gpu", None));
    }
    let count = names.len();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), count, "two of the changes make no difference");
}
