//! `lucerna reproduce` with the experiment of instant global illumination as it is shipped, at a size of a few pixels; and its mistakes.
//! Needs a device (it says so when there is none).

use crate::{
    experiment_lab::{rows, run},
    support::device,
};
use serde_json::Value;
use std::fs;
use toml::{Table, Value as Toml};

const SHIPPED: &str = include_str!("../../samples/experiments/igi.toml");
const PIXELS: f64 = 24.0 * 18.0;
const COUNTS: [i64; 3] = [30, 90, 180];

/// The shipped file with all its techniques and their settings, in the small box instead of the rooms.
fn small() -> Table {
    let mut file: Table = toml::from_str(SHIPPED).unwrap();
    file.insert("size".into(), Toml::String("24x18".into()));
    file.remove("quick");
    let scene = "name = 'room'\nbuiltin = 'cornell'\ncameras = ['0']";
    file.insert("scene".into(), Toml::Array(vec![Toml::Table(toml::from_str(scene).unwrap())]));
    for technique in file["technique"].as_array_mut().unwrap() {
        let technique = technique.as_table_mut().unwrap();
        if technique.contains_key("scenes") {
            technique.insert("scenes".into(), Toml::Array(vec![Toml::String("room".into())]));
        }
        if matches!(technique["name"].as_str(), Some("all" | "picked")) {
            let counts = Toml::Array([30, 300].map(Toml::Integer).to_vec());
            technique.insert("matrix".into(), Toml::Table(Table::from_iter([("igi.vpls".into(), counts)])));
        }
        technique.insert("repeat".into(), Toml::Integer(1));
    }
    let reference = file["reference"][0]["settings"].as_table_mut().unwrap();
    reference.insert("samples".into(), Toml::Integer(16));
    file
}

#[test]
fn the_shipped_experiment_gives_all_its_tables() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let file = small();
    run(folder.path(), &file, &[]).expect(0, &["wrote"]);
    let read = |name: &str| -> Value {
        serde_json::from_slice(&fs::read(folder.path().join("out").join(name)).unwrap()).unwrap()
    };
    let (report, times) = (read("report.json"), read("times.json"));
    assert_eq!(report["warnings"], serde_json::json!([]));

    // Figure 4: both kinds of surfaces, with shares of the whole.
    let figure = rows(&times, "figure-4");
    let found: Vec<(&str, &str)> =
        figure.iter().map(|row| (row["surfaces"].as_str().unwrap(), row["virtual lights"].as_str().unwrap())).collect();
    assert_eq!(
        found,
        [("all", "30"), ("all", "90"), ("all", "180"), ("diffuse", "30"), ("diffuse", "90"), ("diffuse", "180")]
    );
    // Figure 5: every variant.
    let figure_5 = rows(&times, "figure-5");
    let labels: Vec<&str> = figure_5.iter().map(|row| row["variant"].as_str().unwrap()).collect();
    let own = ["exact", "exact, specular", "mirrors", "mirrors, cache", "all", "picked"];
    let techniques: Vec<&str> =
        file["technique"].as_array().unwrap().iter().map(|technique| technique["name"].as_str().unwrap()).collect();
    for name in techniques.iter().filter(|name| !own.contains(name)) {
        assert!(labels.contains(name), "{name} is not in {labels:?}");
    }
    for row in figure.iter().chain(&figure_5) {
        let shares: Vec<f64> =
            row.iter().filter(|(column, _)| column.ends_with("(%)")).filter_map(|(_, v)| v.as_f64()).collect();
        // A device without a clock for passes has none.
        if !shares.is_empty() {
            assert_eq!(shares.len(), 5, "{row:?}");
            assert!((shares.iter().sum::<f64>() - 100.0).abs() < 1e-6, "{row:?}");
        }
    }

    // Errors: the light of each variant is about that of the reference (a coarse picture has 6 × 5 texels here); to itself the exact one has none.
    let errors = rows(&report, "errors");
    let diffuse = |name: &&&str| !name.ends_with("specular") && !own[2..].contains(name);
    assert_eq!(errors.len(), techniques.iter().filter(diffuse).count(), "{errors:?}");
    for row in &errors {
        let light = row["light"].as_f64().unwrap();
        assert!((0.5..1.6).contains(&light), "{row:?}");
        for measure in ["rel. MSE", "FLIP", "PDiff"] {
            assert!(row[&format!("{measure} to reference")].as_f64().unwrap() > 0.0, "{row:?}");
            assert_eq!(row[&format!("{measure} to exact")].is_null(), row["variant"] == "exact, vpls = 180", "{row:?}");
        }
    }

    // Rays: as many as follow from the settings, and no more are counted.
    let rays = rows(&report, "rays");
    for count in COUNTS {
        let label = format!("exact, vpls = {count}");
        let row = rays.iter().find(|row| row["variant"].as_str() == Some(label.as_str())).unwrap();
        assert!((row["shooting"].as_f64().unwrap() - count as f64 * 1e-6).abs() < 1e-12, "{row:?}");
        assert!((row["gathering"].as_f64().unwrap() - PIXELS * count as f64 * 1e-6).abs() < 1e-12, "{row:?}");
        assert!(row["choosing"].is_null() && row["compensation"].is_null(), "{row:?}");
        // One lamp.
        assert!((row["direct"].as_f64().unwrap() - PIXELS * 1e-6).abs() < 1e-12, "{row:?}");
    }
    for row in &rays {
        if let Some(counted) = row["gathering, counted"].as_f64() {
            assert!(counted > 0.0 && counted <= row["gathering"].as_f64().unwrap(), "{row:?}");
        } else {
            assert_eq!(row["variant"], "raster");
        }
    }

    // Pairs.
    let pairs = rows(&report, "successors");
    assert_eq!(pairs.len(), file["parameters"]["beside"].as_table().unwrap().len());
    assert_eq!(rows(&report, "many").len(), 4);
    assert_eq!(rows(&report, "cache").len(), 1);
}

#[test]
fn techniques_that_are_not_there_and_settings_out_of_range_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let mut wrong = small();
    let beside = wrong["parameters"]["beside"].as_table_mut().unwrap();
    beside.insert("raster".into(), Toml::String("exakt".into()));
    let parts = ["e.toml", "parameters.beside.\"raster\"", "'exakt'", "did you mean 'exact'", "compensated"];
    run(folder.path(), &wrong, &["--dry-run"]).expect(3, &parts);
    let mut wrong = small();
    wrong["parameters"]["beside"].as_table_mut().unwrap().insert("rastr".into(), Toml::String("exact".into()));
    run(folder.path(), &wrong, &["--dry-run"]).expect(3, &["'rastr'", "did you mean 'raster'"]);
    let mut wrong = small();
    wrong["parameters"].as_table_mut().unwrap().insert("beside".into(), Toml::Integer(3));
    run(folder.path(), &wrong, &["--dry-run"]).expect(3, &["parameters.beside", "no table"]);

    let mut wrong = small();
    let settings = wrong["technique"][1]["settings"].as_table_mut().unwrap();
    settings.insert("igi.vpls".into(), Toml::Integer(0));
    run(folder.path(), &wrong, &["--dry-run"]).expect(3, &["'imperfect'", "igi.vpls: 0", "1 to 10000"]);
}
