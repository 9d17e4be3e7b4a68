//! `lucerna reproduce` with the experiment of baked daylight as it is shipped, at a size of a few pixels and with few times; and its mistakes.
//! Needs a device (it says so when there is none).

use crate::{
    experiment_lab::{number, rows, run},
    support::{device, lucerna},
};
use serde_json::Value;
use std::fs;
use toml::{Table, Value as Toml};

const SHIPPED: &str = include_str!("../../samples/experiments/daylight.toml");
const TIMES: [&str; 2] = ["09:45", "16:00"];

/// The shipped file with all its techniques in a small open scene, a step each forty minutes, and few paths.
fn small() -> Table {
    let mut file: Table = toml::from_str(SHIPPED).unwrap();
    file.insert("size".into(), Toml::String("24x18".into()));
    file.remove("quick");
    let scene = "name = 'things'\nbuiltin = 'primitives'\ncameras = ['0']";
    file.insert("scene".into(), Toml::Array(vec![Toml::Table(toml::from_str(scene).unwrap())]));
    for list in ["technique", "reference"] {
        for method in file[list].as_array_mut().unwrap() {
            let method = method.as_table_mut().unwrap();
            let settings = method["settings"].as_table_mut().unwrap();
            if settings.contains_key("bake.samples") {
                settings.insert("bake.samples".into(), Toml::Integer(16));
                settings.insert("bake.interval".into(), Toml::Integer(40));
            } else {
                settings.insert("samples".into(), Toml::Integer(64));
            }
            let matrix = method.get_mut("matrix").into_iter().flat_map(|m| m.as_table_mut().unwrap().iter_mut());
            for values in matrix.filter(|(key, _)| key.ends_with(".time")) {
                *values.1 = Toml::Array(TIMES.map(|time| Toml::String(time.into())).to_vec());
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
    let file = small();
    run(folder.path(), &file, &[]).expect(0, &["wrote"]);
    let read = |name: &str| fs::read(folder.path().join("out").join(name)).unwrap();
    let bytes = read("report.json");
    let report: Value = serde_json::from_slice(&bytes).unwrap();
    assert_eq!(report["warnings"], serde_json::json!([]));

    // The paper's row, then four ways to centre.
    let variance = rows(&report, "variance");
    assert_eq!(variance.len(), 5);
    for row in &variance[1..] {
        let [five, ten, twenty] = ["5 (%)", "10 (%)", "20 (%)"].map(|column| number(row, column));
        assert!(50.0 < five && five <= ten && ten <= twenty && twenty <= 100.0 + 1e-6, "{row:?}");
        let lit = number(row, "lit frames");
        assert!((20.0..=24.0).contains(&lit), "{row:?}");
        assert!(number(row, "vectors for 95 %") <= number(row, "for 98.6 %"), "{row:?}");
    }

    // More vectors restore more of the frame.
    let restored = rows(&report, "frame-121");
    assert_eq!(restored.len(), 6);
    for pair in restored.chunks(2) {
        assert_eq!([0, 1].map(|i| number(&pair[i], "vectors")), [10.0, 20.0]);
        for column in ["share (%)", "RMS / mean (%)", "worst frame, RMS / mean (%)"] {
            let [ten, twenty] = [0, 1].map(|i| number(&pair[i], column));
            assert!(if column == "share (%)" { ten <= twenty } else { ten >= twenty }, "{column}: {pair:?}");
        }
        assert!(number(&pair[1], "share (%)") > 99.0, "{pair:?}");
    }

    // The numbers that follow from the paper's sizes alone.
    let size = rows(&report, "size-things-front");
    let ours = |what: &str| size.iter().find(|row| row["quantity"] == what).map(|row| number(row, "ours")).unwrap();
    assert_eq!(ours("steps of the day"), 36.0);
    let lit = ours("lit frames");
    assert!((ours("numbers saved by ten vectors") - 100.0 * (1.0 - 10.0 / lit)).abs() < 0.01);

    // Each test keeps the ends and the middle at least, and what the second keeps is judged by the true frame.
    let adaptive = rows(&report, "adaptive");
    assert_eq!(adaptive.len(), 3);
    for row in &adaptive[1..] {
        let (kept, lit) = (number(row, "frames needed"), number(row, "lit frames"));
        assert!((3.0..=lit).contains(&kept), "{row:?}");
        assert!((number(row, "saved (%)") - 100.0 * (1.0 - kept / lit)).abs() < 1e-9, "{row:?}");
        assert!(number(row, "shortest (min)") >= 40.0 - 1e-6, "{row:?}");
    }

    // Twice the interval, more error.
    let interpolation = rows(&report, "interpolation");
    let linear: Vec<f64> = interpolation
        .iter()
        .filter(|row| row["interpolation"] == "linear")
        .map(|row| number(row, "median RMS / mean (%)"))
        .collect();
    assert!(linear.len() >= 3 && linear[0] < linear[2], "{linear:?}");

    // The technique beside the path tracer: sixteen paths a texel have the energy within some per cent.
    let elements = rows(&report, "elements");
    let [row] = &elements[..] else { panic!("{elements:?}") };
    let shares = ["direct (%)", "indirect (%)", "sky, scaled (%)"].map(|column| number(row, column));
    assert!(shares.iter().all(|share| (0.1..90.0).contains(share)), "{row:?}");
    // The picture is the sum of its elements, rounded to 16 bits.
    assert!((number(row, "sum (%)") - 100.0).abs() < 0.2, "{row:?}");
    assert!((number(row, "sky by patches / scaled") - 1.0).abs() < 0.1, "{row:?}");

    let beside = rows(&report, "beside");
    assert_eq!(beside.len(), 4 * TIMES.len());
    for row in &beside {
        for column in ["energy", "energy, baked"] {
            // Without gloss nothing but noise is left.
            let diffuse = row["day"].as_str().unwrap().contains("diffuse");
            let near = if diffuse { 0.97..1.03 } else { 0.85..1.15 };
            assert!(near.contains(&number(row, column)), "{row:?}");
        }
    }

    // A pot after the bake, with light of probes and of the pixels behind it: each picture in three parts.
    let added = rows(&report, "added");
    assert_eq!(added.len(), 2 * TIMES.len() * 3);
    for from in ["probes", "screen"] {
        let of = |part: &str| {
            let mut found = added.clone();
            found.retain(|row| row["part of the picture"] == part && row["indirect light of the object"] == from);
            found
        };
        assert_eq!(of("the object").len(), TIMES.len());
        for row in &of("the object") {
            assert!((10.0..200.0).contains(&number(row, "pixels")), "{row:?}");
            assert!((0.3..3.0).contains(&number(row, "all light")), "{row:?}");
        }
        // Far from the pot the light is as without it.
        for row in &of("the rest") {
            assert!((0.85..1.15).contains(&number(row, "all light")), "{row:?}");
        }
    }

    // More images, less error, more bytes; floats are at least as exact as bytes.
    let sizes = rows(&report, "bytes");
    let of = |side: &str, values: &str| -> Vec<(f64, f64)> {
        let chosen = sizes.iter().filter(|row| row["side of a tile"] == side && row["values"] == values);
        chosen.map(|row| (number(row, "bytes a pixel"), number(row, "worst frame, RMS / mean (%)"))).collect()
    };
    for side in ["whole picture", "32×32", "16×16", "8×8"] {
        let (floats, signed) = (of(side, "16-bit floats"), of(side, "signed bytes"));
        assert!(floats.len() == 8 && signed.len() == 8);
        assert!(floats.windows(2).all(|pair| pair[0].0 <= pair[1].0 && pair[0].1 >= 0.999 * pair[1].1), "{floats:?}");
        // The rounding of a byte may by chance make an error a little smaller.
        assert!(signed.iter().zip(&floats).all(|(a, b)| a.0 <= b.0 && a.1 >= 0.95 * b.1), "{signed:?} {floats:?}");
    }

    // Nothing is rendered again, and the report has the same bytes.
    let planned = run(folder.path(), &file, &["--dry-run", "--json"]).expect(0, &[]).json();
    assert!(planned.as_array().unwrap().iter().all(|run| run["there"] == true), "{planned}");
    run(folder.path(), &file, &[]).expect(0, &["wrote"]);
    assert!(read("report.json") == bytes);
}

#[test]
fn a_cube_and_a_lightmap_have_the_light_of_the_view() {
    if !device() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out");
    lucerna(["reproduce", "daylight-kinds", "--quick", "-o", output.to_str().unwrap()]).expect(0, &["wrote"]);
    let report: Value = serde_json::from_slice(&fs::read(output.join("report.json")).unwrap()).unwrap();
    let beside = rows(&report, "beside");
    let of = |what: &str| -> Vec<f64> {
        beside.iter().filter(|row| row["day"] == what).map(|row| number(row, "energy, baked")).collect()
    };
    let view = of("the day of the experiment");
    assert!(view.len() == 2 && view.iter().all(|energy| (0.9..1.05).contains(energy)), "{view:?}");
    for what in ["the same day, from a cube", "the same day, from a lightmap"] {
        let found = of(what);
        assert!(
            found.len() == 2 && found.iter().zip(&view).all(|(a, b)| (a / b - 1.0).abs() < 0.03),
            "{what}: {found:?}, {view:?}"
        );
    }
}

#[test]
fn wrong_days_times_and_settings_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for (list, key, value, parts) in [
        ("technique", "day.date", Toml::String("2026-02-30".into()), &["'frames'", "2026-02-30"][..]),
        ("technique", "day.latitude", Toml::Integer(91), &["'frames'", "91"]),
        ("technique", "bake.samples", Toml::Integer(1), &["'frames'", "bake.samples: 1"]),
        ("reference", "tracer.bounces", Toml::Integer(-1), &["'day, truth'", "bounces"]),
        ("reference", "samples", Toml::Integer(0), &["'day, truth'", "samples is 0"]),
        ("reference", "object.builtin", Toml::String("kettle".into()), &["'day, truth'", "kettle"]),
    ] {
        let mut wrong = small();
        wrong[list][0]["settings"].as_table_mut().unwrap().insert(key.into(), value);
        run(folder.path(), &wrong, &["--dry-run"]).expect(3, parts);
    }
    let mut wrong = small();
    let matrix = wrong["technique"][1]["matrix"].as_table_mut().unwrap();
    matrix.insert("picture.daylight.time".into(), Toml::Array(vec![Toml::String("25:00".into())]));
    run(folder.path(), &wrong, &["--dry-run"]).expect(3, &["'day'", "25:00"]);
}
