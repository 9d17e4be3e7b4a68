//! `lucerna reproduce` with the experiments of precomputed transfer and of all methods as they are shipped, in a small box with small bakes; and their
//! mistakes. Needs a device (it says so when there is none).

use crate::{
    experiment_lab::{number, rows, run},
    support::device,
};
use serde_json::Value;
use std::{collections::BTreeMap, fs};
use toml::{Table, Value as Toml};

const SHIPPED: &str = include_str!("../../samples/experiments/prt.toml");
const YARDSTICK: &str = include_str!("../../samples/experiments/yardstick.toml");
/// Lamps in the box, and one of those of the shipped file in their place.
const LAMPS: [&str; 2] = ["0.28,0.4,0.25,0.2", "0.15,0.3,0.1,0.2"];

/// Settings of small bakes.
const SMALL: [(&str, i64); 5] = [
    ("bake.samples", 1200),
    ("bake.cluster", 200),
    ("bake.directions", 200),
    ("bake.rays", 256),
    ("bake.examples", 150),
];

/// A shipped file for one scene: its methods for `kept`, with small bakes and few paths.
fn small(shipped: &str, kept: &str, paths: i64) -> Table {
    let mut file: Table = toml::from_str(shipped).unwrap();
    file.insert("size".into(), Toml::String("32x24".into()));
    file.remove("quick");
    let scene = "name = 'box'\nbuiltin = 'cornell'\ncameras = ['0']";
    file.insert("scene".into(), Toml::Array(vec![Toml::Table(toml::from_str(scene).unwrap())]));
    for list in ["technique", "reference"] {
        let methods = file[list].as_array_mut().unwrap();
        methods.retain_mut(|method| {
            let method = method.as_table_mut().unwrap();
            method.remove("scenes").is_none_or(|scenes| scenes.as_array().unwrap().contains(&kept.into()))
        });
        for method in methods {
            let method = method.as_table_mut().unwrap();
            method.remove("repeat");
            let kind = method["kind"].as_str().unwrap().to_owned();
            let settings = method["settings"].as_table_mut().unwrap();
            match kind.as_str() {
                "prt" => settings.extend(SMALL.map(|(key, value)| (key.to_owned(), Toml::Integer(value)))),
                "prt-truth" | "tracer" if settings.contains_key("samples") => {
                    settings.insert("samples".into(), Toml::Integer(paths));
                }
                _ => {}
            }
            if settings.contains_key("lamp") {
                settings.insert("lamp".into(), LAMPS[0].into());
            }
            let matrix = method.get_mut("matrix").map(|matrix| matrix.as_table_mut().unwrap());
            for (key, values) in matrix.into_iter().flat_map(|matrix| matrix.iter_mut()) {
                let list = values.as_array_mut().unwrap();
                match key.as_str() {
                    "lamp" => *list = LAMPS.map(Toml::from).to_vec(),
                    "picture.prt.vector" => *list = vec![Toml::Integer(0), Toml::Integer(1)],
                    "bake.cluster" => *list = vec![Toml::Integer(100)],
                    "bake.directions" => *list = vec![Toml::Integer(100)],
                    "cut.visibility" => *list = vec![Toml::Integer(5), Toml::Integer(100)],
                    "cut.light" | "cut.receivers" => *list = vec![Toml::Integer(4), Toml::Integer(24)],
                    _ => {}
                }
            }
        }
    }
    file
}

#[test]
fn the_shipped_experiment_gives_all_its_tables() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let file = small(SHIPPED, "parlour", 128);
    run(folder.path(), &file, &[]).expect(0, &["wrote"]);
    let read = |name: &str| fs::read(folder.path().join("out").join(name)).unwrap();
    let bytes = read("report.json");
    let report: Value = serde_json::from_slice(&bytes).unwrap();
    assert_eq!(report["warnings"], serde_json::json!([]));

    // A fifth of the coefficients stays with the paper's settings, all of them with the defaults.
    let sizes = rows(&report, "sizes");
    let of = |quantity: &str, side: &str| {
        sizes
            .iter()
            .find(|row| row["quantity"].as_str().unwrap().starts_with(quantity))
            .map(|row| number(row, side))
            .unwrap()
    };
    let (paper, ours) = ("the paper's settings", "the default bake");
    assert!((of("coefficients kept", paper) - 20.0).abs() < 0.5 && of("coefficients kept", ours) > 99.0);
    assert_eq!([of("vectors of light, d₂", paper), of("vectors of light, d₂", ours)], [10.0, 24.0]);
    assert!((600.0..1600.0).contains(&of("samples", ours)), "{sizes:?}");

    // The energy of the defaults is that of the path tracer, and equation 10 loses light.
    let means = rows(&report, "means");
    let row = |technique: &str| means.iter().find(|row| row["technique"] == technique).unwrap();
    let energies = rows(&report, "means-energy");
    let energy_of =
        |technique: &str, part: &str| number(energies.iter().find(|row| row["technique"] == technique).unwrap(), part);
    for part in ["direct", "indirect", "total"] {
        let energy = energy_of("ours", part);
        assert!((0.93..1.07).contains(&energy), "{part}: {energy}");
    }
    assert!(number(row("ours"), "indirect, blocks (%)") < 10.0, "{means:?}");
    let [with, without] = ["paper", "paper, equation 10"].map(|name| energy_of(name, "indirect"));
    assert!(without < 0.9 * with, "{with} {without}");
    // Twenty-five points on a sphere make soft shadows, which samples know better than sharp ones.
    assert!(number(row("ours, area"), "shadow, pixels (%)") < 1.2 * number(row("ours"), "shadow, pixels (%)"));

    // No light is exactly none around zero; around the mean the room glows.
    let darkness = rows(&report, "darkness");
    let share = |technique: &str| {
        number(darkness.iter().find(|row| row["technique"] == technique).unwrap(), "share of the light (%)")
    };
    assert_eq!(share("ours"), 0.0);
    assert!(share("paper") > 0.01, "{darkness:?}");

    // More vectors cost more, and the least error is on the front and is a preset.
    let study = rows(&report, "study");
    assert_eq!(study.len(), 8 + 2);
    let all = |row: &BTreeMap<String, Value>| number(row, "total (%)");
    let best = study.iter().min_by(|a, b| all(a).total_cmp(&all(b))).unwrap();
    assert!(best["front"] == "yes" && best["preset"].as_str().unwrap().contains("exact"), "{best:?}");
    for column in ["memory (MB)", "products (10⁶)"] {
        assert!(number(&study[0], column) < number(&study[7], column), "{study:?}");
    }
    assert!(all(&study[7]) < all(&study[0]), "{study:?}");

    let presets = rows(&report, "presets");
    assert_eq!(
        presets.iter().map(|row| row["preset"].as_str().unwrap()).collect::<Vec<_>>(),
        ["exact", "small", "fast"]
    );
    assert_eq!(number(&presets[0], "error (%)"), all(best));

    // The noise of the reference falls in blocks.
    let noise = &rows(&report, "noise")[0];
    assert!(number(noise, "indirect, blocks") < 0.5 * number(noise, "indirect, pixels"), "{noise:?}");

    // Nothing is baked or rendered again, and the report has the same bytes.
    let planned = run(folder.path(), &file, &["--dry-run", "--json"]).expect(0, &[]).json();
    assert!(planned.as_array().unwrap().iter().all(|run| run["there"] == true), "{planned}");
    run(folder.path(), &file, &[]).expect(0, &["wrote"]);
    assert!(read("report.json") == bytes);
}

#[test]
fn a_bake_is_read_again_and_a_damaged_one_is_made_again() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut file = small(SHIPPED, "parlour", 16);
    file["technique"].as_array_mut().unwrap().truncate(1);
    file["reference"].as_array_mut().unwrap().truncate(1);
    let bakes = || -> Vec<_> {
        let all = fs::read_dir(folder.path().join("out/shared")).unwrap().map(|entry| entry.unwrap().path());
        all.filter(|path| path.extension().is_some_and(|extension| extension == "prt")).collect()
    };
    let pictures = || {
        let all = fs::read_dir(folder.path().join("out/runs")).unwrap().map(|entry| entry.unwrap().path());
        let mut all: Vec<_> = all.filter(|path| path.extension().is_some_and(|e| e == "exr")).collect();
        all.sort();
        all.iter().map(|path| fs::read(path).unwrap()).collect::<Vec<_>>()
    };
    run(folder.path(), &file, &[]).expect(0, &["wrote"]);
    let (first, before) = (fs::read(&bakes()[0]).unwrap(), pictures());
    let written = fs::metadata(&bakes()[0]).unwrap().modified().unwrap();
    fs::remove_dir_all(folder.path().join("out/runs")).unwrap();
    run(folder.path(), &file, &[]).expect(0, &["wrote"]);
    assert_eq!(fs::metadata(&bakes()[0]).unwrap().modified().unwrap(), written);
    assert!(pictures() == before);
    fs::write(&bakes()[0], &first[..first.len() / 2]).unwrap();
    fs::remove_dir_all(folder.path().join("out/runs")).unwrap();
    run(folder.path(), &file, &[]).expect(0, &["damaged", "wrote"]);
    assert!(fs::read(&bakes()[0]).unwrap() == first && pictures() == before);
    assert_eq!(fs::read_dir(folder.path().join("out/shared")).unwrap().count(), 2);
}

#[test]
fn the_yardstick_has_every_method_of_a_room() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let file = small(YARDSTICK, "parlour", 256);
    run(folder.path(), &file, &[]).expect(0, &["wrote"]);
    let read = |name: &str| -> Value {
        serde_json::from_slice(&fs::read(folder.path().join("out").join(name)).unwrap()).unwrap()
    };
    let (report, times) = (read("report.json"), read("times.json"));
    let errors = rows(&report, "errors");
    let of = |method: &str| {
        errors.iter().filter(|row| row["method"].as_str().unwrap().starts_with(method)).collect::<Vec<_>>()
    };
    for method in ["isr", "igi, exact", "igi, interleaved", "igi, by importance", "prt", "path tracer"] {
        let rows = of(method);
        assert!(!rows.is_empty(), "{method}");
        for row in rows {
            // Image-space radiosity has the light of one scattering from what is in the picture.
            let least = if method == "isr" { 0.1 } else { 0.5 };
            assert!((least..1.3).contains(&number(row, "indirect light, energy")), "{row:?}");
            assert!(number(row, "indirect light, error (%)") > 1.0, "{row:?}");
        }
    }
    let traced: Vec<f64> = of("path tracer").iter().map(|row| number(row, "indirect light, error (%)")).collect();
    assert!(traced.is_sorted_by(|a, b| a > b), "{traced:?}");
    assert!(number(of("prt")[0], "indirect light, error (%)") < traced[0]);
    for row in rows(&times, "times") {
        let bake = row["method"].as_str().unwrap().starts_with("prt");
        assert!(number(&row, "picture (ms)") > 0.0 && (row["bake (s)"].is_number() == bake), "{row:?}");
    }
}

#[test]
fn wrong_lamps_modes_and_settings_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for (list, key, value, parts) in [
        ("technique", "lamp", Toml::String("1,2".into()), &["'ours'", "lamp is '1,2'"][..]),
        ("technique", "show", Toml::String("photons".into()), &["'ours'", "show is 'photons'", "clusters"]),
        ("technique", "cut.light", Toml::Integer(25), &["'ours'", "cut.light is 25", "0 to 24"]),
        ("technique", "bake.rays", Toml::Integer(1), &["'ours'", "rays"]),
        ("reference", "radius", Toml::Integer(-1), &["'truth'", "radius"]),
        ("reference", "samples", Toml::Integer(0), &["'truth'", "samples is 0"]),
    ] {
        let mut wrong = small(SHIPPED, "parlour", 16);
        let method = wrong[list][0].as_table_mut().unwrap();
        method["settings"].as_table_mut().unwrap().insert(key.into(), value);
        if key == "lamp" {
            method.remove("matrix");
        }
        run(folder.path(), &wrong, &["--dry-run"]).expect(3, parts);
    }
}
