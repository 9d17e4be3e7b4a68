use lucerna::techniques::isr::{AreaLights, PictureSettings, Preset, Settings};
use lucerna_scenes as builtin;

use super::{
    Errors, page,
    rows::{Parts, Row},
};
use crate::experiment::{file, kinds};

#[test]
fn the_experiment_has_as_many_views_as_the_dissertation() {
    let experiment = file::open("isr", false).unwrap();
    assert!(experiment.scenes.len() >= 8);
    let (mut views, mut groups) = (0, [0; 2]);
    for scene in &experiment.scenes {
        let recorded = scene.builtin.as_ref().map_or(0, |name| builtin::load(name).unwrap().cameras.len());
        let count = scene.random + if scene.recorded { recorded } else { 0 };
        assert!(count >= 16, "{}: {count}", scene.name);
        views += count;
        groups[usize::from(scene.group == "complex")] += count;
        assert!(!scene.sky, "{}: the reference would have light that direct light has not", scene.name);
    }
    assert!(views >= 227 && groups.iter().all(|count| *count >= 80), "{views} views: {groups:?}");
    let quick = file::open("isr", true).unwrap();
    assert!(quick.scenes.len() == experiment.scenes.len() && quick.size.width < experiment.size.width);
    let povray: Vec<_> = experiment.methods.iter().filter(|method| method.kind == "povray").collect();
    assert!(povray.iter().all(|m| m.most_views.unwrap_or(99) * experiment.scenes.len() >= 12) && !povray.is_empty());
}

#[test]
fn the_presets_of_the_experiment_are_those_of_the_program() {
    let experiment = file::open("isr", false).unwrap();
    for (name, preset) in Preset::ALL {
        let method = experiment.methods.iter().find(|method| method.name == name).unwrap();
        let settings = kinds::find("isr").unwrap().effective(method, &Default::default()).unwrap();
        let settings: PictureSettings = serde_json::from_value(settings).unwrap();
        let of_the_image = Settings { specular: false, area_lights: AreaLights::Image, ..preset.settings() };
        assert_eq!(settings.isr, of_the_image, "{name}");
    }
}

#[test]
fn errors_of_known_pixels() {
    // Reference 1; direct light 0.5 and 1; with indirect light 0.75 and 1.5.
    let (reference, direct, total) = ([[1.0; 3]; 2], [[0.5; 3], [1.0; 3]], [[0.75; 3], [1.5; 3]]);
    let errors = Errors::of(&reference, &direct, &total, 1.0);
    assert!((errors.direct - 0.25).abs() < 1e-6 && (errors.technique - 0.375).abs() < 1e-6);
    assert_eq!((errors.better, errors.worse), (1, 1));
    // sRGB: 0.5 is 188 of 255, 0.75 is 225; what is above white is white.
    assert!((errors.direct_codes - 33.5).abs() < 1e-6, "{}", errors.direct_codes);
    assert!((errors.technique_codes - 15.0).abs() < 1e-6, "{}", errors.technique_codes);
}

#[test]
fn the_figures_stand_beside_the_dissertations() {
    let row = |scene: &str, complex, direct, technique| Row {
        scene: scene.into(),
        view: "v".into(),
        complex,
        direct,
        technique,
        direct_codes: direct,
        technique_codes: technique,
        direct_correlation: 0.8,
        correlation: 0.9,
        better: 9,
        worse: 1,
        pixels: 10,
        found: 0.4,
        indirect_better: 6,
        indirect_worse: 1,
        reached: 8,
        parts: Parts::default(),
    };
    let rows = [row("a", false, 1.0, 0.9), row("b", true, 1.0, 0.8), row("b", true, 1.0, 1.2)];
    let section = page::figures(&rows, &[], &[]);
    let table = section
        .blocks
        .iter()
        .find_map(|block| match block {
            crate::report::Block::Table(table) if table.id == "figures-lit" => Some(table),
            _ => None,
        })
        .unwrap();
    let ours = |quantity: &str| {
        let row = table.rows.iter().find(|row| row[0] == quantity.into()).unwrap_or_else(|| panic!("{quantity}"));
        match row[3] {
            crate::report::Cell::Number(value) => value,
            _ => panic!("{quantity} is no number"),
        }
    };
    for (quantity, expected) in [
        ("views", 3.0),
        ("views with a positive gain", 200.0 / 3.0),
        ("gain, mean", 10.0 / 3.0),
        ("gain, median", 10.0),
        ("gain, simple scenes, most", 10.0),
        ("gain, complex scenes, least", -20.0),
        ("pixels improved", 90.0),
        ("pixels whose indirect light alone is nearer than none", 60.0),
        ("pixels that no indirect light reaches in the reference", 20.0),
    ] {
        assert!((ours(quantity) - expected).abs() < 1e-9, "{quantity}: {}", ours(quantity));
    }
}
