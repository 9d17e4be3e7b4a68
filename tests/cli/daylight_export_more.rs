//! `daylight export` of lamps, of several days, of a part of a day, and of cubes: rebuilt from the files by the words of docs/daylight-export.md.

use std::{fs, path::Path};

use glam::{Vec2, Vec3};
use half::f16;
use lucerna::{
    scene::Node,
    techniques::daylight::{
        Stored, cube,
        export::{Unwrapping, unwrapped},
        lightmap,
    },
};
use serde_json::{Value, json};

use crate::{
    daylight_export::{Lab, Read, daylight, json_of, ktx2, numbers, pixels},
    support::{device, files},
};

/// A small bake.
fn bake(scene: &str, out: &Path, more: &[&str]) {
    let words = ["bake", "--builtin", scene, "-q", "-o", out.to_str().unwrap()];
    let small = ["-D", "bake.samples=8", "-D", "bake.density=4", "-D", "bake.interval=60", "-D", "bake.probes=0"];
    daylight(&[&words[..], &small, &["-D", "bake.filter=0", "-D", "bake.face=16"], more].concat()).expect(0, &[]);
}

fn export(scene: &str, bake: &Path, out: &Path, more: &[&str]) -> Value {
    let words = ["export", "--builtin", scene, "--bake", bake.to_str().unwrap(), "-q", "-o", out.to_str().unwrap()];
    daylight(&[&words[..], more].concat()).expect(0, &[]);
    json_of(out.join("daylight.json"))
}

fn whole(value: &Value) -> usize {
    value.as_u64().unwrap() as usize
}

/// The brightness of a switch at a time.
fn burning(switch: &Value, seconds: f64) -> f32 {
    let points: Vec<[f64; 2]> = serde_json::from_value(switch.clone()).unwrap();
    let next = points.iter().position(|point| point[0] > seconds).unwrap_or(points.len() - 1).max(1);
    let [a, b] = [points[next - 1], points[next]];
    (a[1] + (b[1] - a[1]) * ((seconds - a[0]) / (b[0] - a[0])).clamp(0.0, 1.0)) as f32
}

/// The irradiance of all texels at a time of a day, three numbers each.
fn rebuilt(folder: &Path, day: &Value, seconds: f64) -> Vec<f32> {
    let table = json_of(folder.join("daylight.json"));
    let [width, height] = [&table["width"], &table["height"]].map(whole);
    let about = &day["moments"];
    let (columns, moments) = numbers(folder.join(about["file"].as_str().unwrap()));
    let row = (seconds - about["first_seconds"].as_f64().unwrap()) / about["step_seconds"].as_f64().unwrap();
    let lit = row >= 0.0 && row <= about["rows"].as_f64().unwrap() - 1.0;
    assert!(!lit || row.fract() == 0.0);
    let outside = |column: usize, channel: usize| match lit {
        true => moments[4 * (row as usize * columns + column) + channel],
        false => 0.0,
    };
    let times: Vec<f64> = serde_json::from_value(day["times"].clone()).unwrap();
    let nights: Vec<usize> = serde_json::from_value(day["nights"].clone()).unwrap();
    let (count, length) = (times.len(), day["day"]["seconds"].as_f64().unwrap());
    let next = times.iter().position(|time| *time > seconds).unwrap_or(count);
    let [before, after] = [(next + count - 1) % count, next % count];
    let begin = times[before] - if next == 0 { length } else { 0.0 };
    let end = times[after] + if next == count { length } else { 0.0 };
    let mut part = (seconds - begin) / (end - begin);
    if nights.contains(&before) {
        part = part.round();
    }
    let first = day["first_column"].as_u64().unwrap_or(0) as usize;
    let weights = [(first + before, 1.0 - part as f32), (first + after, part as f32)];
    let shares: Vec<f32> =
        day["switches"].as_array().into_iter().flatten().map(|switch| burning(switch, seconds)).collect();
    let mut light = vec![0.0f32; 3 * width * height];
    for layer in table["layers"].as_array().unwrap() {
        if layer["table"].is_null() {
            continue;
        }
        let read = Read::new(folder, layer);
        for tile in table["tiles"].as_array().unwrap() {
            let [x, y, columns, rows] = ["x", "y", "width", "height"].map(|key| whole(&tile[key]));
            let of_tile = &tile[&read.name];
            for (image, spot) in of_tile["images"].as_array().unwrap().iter().enumerate() {
                let [page, left, top] = [&spot[0], &spot[1], &spot[2]].map(whole);
                let (page_columns, values) = &read.pages[page];
                let along = |column: usize| read.table[(whole(&of_tile["row"]) + image) * read.columns + column];
                for channel in 0..3 {
                    let sum: f32 = match layer["dimensions"].as_str().unwrap() {
                        "times" => weights.iter().map(|(time, w)| along(*time) * w * outside(146, channel)).sum(),
                        "patches" => (0..146).map(|patch| along(patch) * outside(patch, channel)).sum(),
                        "lamps" => shares.iter().enumerate().map(|(group, share)| along(group) * share).sum(),
                        other => panic!("{other}"),
                    };
                    for (dx, dy) in (0..rows).flat_map(|dy| (0..columns).map(move |dx| (dx, dy))) {
                        let value = values[4 * ((top + dy) * page_columns + left + dx) + channel];
                        light[3 * ((y + dy) * width + x + dx) + channel] += sum * value;
                    }
                }
            }
        }
    }
    padded(folder, &table, &light)
}

/// The light with the padding of step 5 of the page of the format.
pub fn padded(folder: &Path, table: &Value, light: &[f32]) -> Vec<f32> {
    let (_, _, _, raw) = ktx2(folder.join(table["sources"].as_str().unwrap()));
    let sources: Vec<i64> = raw.as_chunks::<4>().0.iter().map(|b| i64::from(u32::from_le_bytes(*b))).collect();
    let value = |texel: i64, channel: usize| light[3 * texel as usize + channel].max(0.0);
    let across = table["width"].as_i64().unwrap();
    sources
        .iter()
        .zip(0..)
        .flat_map(|(&near, texel)| {
            let far = 2 * near - texel;
            let beside = (near - texel).abs() == across || (near - texel).abs() == 1 && near / across == texel / across;
            let continues = table["kind"] != "cube" && beside && sources.get(far as usize) == Some(&far);
            std::array::from_fn::<f32, 3, _>(|channel| match near {
                _ if near == i64::from(u32::MAX) => 0.0,
                _ if !continues => value(near, channel),
                _ => {
                    let own = value(near, channel);
                    (2.0 * own - value(far, channel)).clamp(0.5 * own, 2.0 * own)
                }
            })
        })
        .collect()
}

/// Root mean square of the difference from a picture of the export, relative to its mean.
pub fn apart(folder: &Path, exr: &Value, light: &[f32]) -> f64 {
    let written = pixels(folder.join(exr.as_str().unwrap())).main().unwrap().rgb_pixels().unwrap();
    let written = written.as_flattened();
    assert_eq!(written.len(), light.len());
    let square: f64 = written.iter().zip(light).map(|(a, b)| f64::from(a - b).powi(2)).sum();
    let sum: f64 = written.iter().map(|value| f64::from(*value)).sum();
    assert!(sum > 0.0, "{exr} is dark");
    (square / light.len() as f64).sqrt() / (sum / light.len() as f64)
}

#[test]
fn lamps_are_a_layer_of_their_own_that_rebuilds_the_night() {
    if !device() {
        return;
    }
    let lab = tempfile::tempdir().unwrap();
    let at = |name: &str| lab.path().join(name);
    bake("cornell", &at("lamps.day"), &[]);
    bake("cornell", &at("none.day"), &["--no-lamps"]);
    let times = ["--time", "12:00,23:00,02:00"];
    let table = export("cornell", &at("lamps.day"), &at("lamps"), &times);
    assert_eq!((&table["version"], table["lamps"].as_array().unwrap().len()), (&json!(2), 1));
    assert_eq!(table["lamps"][0]["name"], "lamps");
    // The lamp is a spot light, so no surface glows.
    assert_eq!(table["lamps"][0]["materials"], json!([]));
    let shares: Vec<&Value> = table["lightmaps"].as_array().unwrap().iter().map(|map| &map["lamps"]).collect();
    assert_eq!(shares, [&json!([0.0]), &json!([1.0]), &json!([1.0])]);
    for map in table["lightmaps"].as_array().unwrap() {
        let light = rebuilt(&at("lamps"), &table, map["seconds"].as_f64().unwrap());
        let relative = apart(&at("lamps"), &map["exr"], &light);
        assert!(relative < 1e-3, "{}: {relative}", map["exr"]);
    }
    // Lamps that are off change no byte of a lightmap, and an export without them is that of a bake without them.
    export("cornell", &at("lamps.day"), &at("without"), &[&times[..], &["--no-lamps"]].concat());
    let none = export("cornell", &at("none.day"), &at("none"), &times);
    assert_eq!(none["version"], 1);
    assert_eq!(files(&at("without")), files(&at("none")));
    for name in files(&at("none")) {
        let [a, b, c] = ["without", "none", "lamps"].map(|folder| fs::read(at(folder).join(&name)).unwrap());
        assert!(a == b, "{name}");
        assert_eq!(a == c, !(name.contains("2300") || name.contains("0200") || name == "daylight.json"), "{name}");
    }
    // Dusk is a ramp, and hours are jumps.
    let of = |more: &[&str]| {
        let table = export("cornell", &at("lamps.day"), &at("hours"), &[more, &["--overwrite"]].concat());
        table["switches"][0].clone()
    };
    let dusk = &table["switches"][0];
    let light = |seconds: f64| f64::from(burning(dusk, seconds));
    assert!((0..86_400).step_by(60).any(|second| (0.1..0.9).contains(&light(f64::from(second)))), "{dusk}");
    let hours = of(&["--lamps", "18:30-06:00"]);
    for (seconds, share) in [(0.0, 1.0), (21_599.0, 1.0), (21_600.1, 0.0), (66_599.0, 0.0), (66_600.1, 1.0)] {
        assert_eq!(burning(&hours, seconds), share, "{seconds}: {hours}");
    }
    assert_eq!(of(&["--lamps", "off"]), json!([[0.0, 0.0], [86_400.0, 0.0]]));
    assert_eq!(of(&["--lamps", "lamps=on"]), json!([[0.0, 1.0], [86_400.0, 1.0]]));
    let bad = |more: &[&str]| {
        let (bake, out) = (at("lamps.day"), at("bad"));
        let words = ["export", "--builtin", "cornell", "--bake", bake.to_str().unwrap(), "-o", out.to_str().unwrap()];
        daylight(&[&words[..], more].concat())
    };
    bad(&["--lamps", "sometimes"]).expect(2, &["sometimes", "--lamps"]);
    bad(&["--lamps", "hall=on"]).expect(2, &["hall", "lamps"]);
    bad(&["--dusk", "91"]).expect(2, &["91"]);
    bad(&["--lamps", "on", "--no-lamps"]).expect(2, &["--no-lamps"]);
    assert!(!at("bad").exists());
}

#[test]
fn several_days_are_in_one_table() {
    if !device() {
        return;
    }
    let lab = tempfile::tempdir().unwrap();
    let at = |name: &str| lab.path().join(name);
    bake("primitives", &at("year.day"), &["--dates", "2026-06-21,2026-12-21"]);
    let table = export("primitives", &at("year.day"), &at("out"), &["--time", "12:00,09:30"]);
    let days = table["days"].as_array().unwrap();
    assert_eq!((table["version"].clone(), days.len()), (json!(2), 2));
    assert_eq!((&table["day"], &table["times"]), (&days[0]["day"], &days[0]["times"]));
    assert_eq!(days[1]["first_column"], days[0]["times"].as_array().unwrap().len());
    let there = files(&at("out"));
    for name in ["lightmap-2026-12-21-0930.exr", "lightmap-2026-06-21-1200.hdr", "moments-2026-12-21.ktx2"] {
        assert!(there.iter().any(|found| found == name), "{there:?}");
    }
    let maps = table["lightmaps"].as_array().unwrap();
    assert_eq!(maps.len(), 4);
    for map in maps {
        let day = days.iter().find(|day| day["day"]["date"] == map["date"]).unwrap();
        let relative = apart(&at("out"), &map["exr"], &rebuilt(&at("out"), day, map["seconds"].as_f64().unwrap()));
        assert!(relative < 1e-3, "{}: {relative}", map["exr"]);
    }
    // One day of them, with all its steps.
    let one = export("primitives", &at("year.day"), &at("one"), &["--date", "2026-12-21", "--all"]);
    let maps = one["lightmaps"].as_array().unwrap();
    assert!(
        maps.iter().all(|map| map["date"] == "2026-12-21") && maps.len() >= days[1]["times"].as_array().unwrap().len()
    );
    assert_eq!(one["days"].as_array().unwrap().len(), 2);
    let (bake, out) = (at("year.day"), at("bad"));
    let words = ["export", "--builtin", "primitives", "--bake", bake.to_str().unwrap(), "-o", out.to_str().unwrap()];
    daylight(&[&words[..], &["--date", "2026-03-20"]].concat())
        .expect(2, &["2026-03-20", "2026-06-21, 2026-12-21", "--date"]);
}

#[test]
fn a_part_of_a_day_has_no_light_outside() {
    if !device() {
        return;
    }
    let lab = tempfile::tempdir().unwrap();
    let at = |name: &str| lab.path().join(name);
    bake("primitives", &at("part.day"), &["--from", "10:00", "--until", "14:00"]);
    let table = export("primitives", &at("part.day"), &at("out"), &["--time", "10:00,12:30"]);
    assert_eq!((&table["version"], &table["span"]), (&json!(2), &json!([36_000.0, 50_400.0])));
    assert_eq!((&table["moments"]["first_seconds"], &table["moments"]["rows"]), (&json!(36_000), &json!(241)));
    for map in table["lightmaps"].as_array().unwrap() {
        let light = rebuilt(&at("out"), &table, map["seconds"].as_f64().unwrap());
        let relative = apart(&at("out"), &map["exr"], &light);
        assert!(relative < 1e-3, "{}: {relative}", map["exr"]);
    }
    assert!(rebuilt(&at("out"), &table, 32_400.0).iter().all(|value| *value == 0.0));
    let (bake, out) = (at("part.day"), at("bad"));
    let words = ["export", "--builtin", "primitives", "--bake", bake.to_str().unwrap(), "-o", out.to_str().unwrap()];
    daylight(&[&words[..], &["--time", "09:00"]].concat())
        .expect(2, &["09:00", "from 10:00:00 until 14:00:00", "--time"]);
}

/// The direction of a texel of a cube map by the table of the Vulkan specification ("Cube Map Face Selection").
fn of_cube_map(face: usize, [x, y]: [usize; 2], side: usize) -> Vec3 {
    let [s, t] = [x, y].map(|at| 2.0 * (at as f32 + 0.5) / side as f32 - 1.0);
    [
        Vec3::new(1.0, -t, -s),
        Vec3::new(-1.0, -t, s),
        Vec3::new(s, 1.0, t),
        Vec3::new(s, -1.0, -t),
        Vec3::new(s, -t, 1.0),
        Vec3::new(-s, -t, -1.0),
    ][face]
}

#[test]
fn a_cube_is_a_cube_map_with_the_axes_of_vulkan() {
    if !device() {
        return;
    }
    let lab = tempfile::tempdir().unwrap();
    let at = |name: &str| lab.path().join(name);
    bake("primitives", &at("turn.day"), &["--kind", "cube"]);
    let table = export("primitives", &at("turn.day"), &at("out"), &["--time", "09:00"]);
    assert_eq!((&table["version"], &table["kind"]), (&json!(2), &json!("cube")));
    assert_eq!(table["position"].as_array().unwrap().len(), 3);
    assert!(table["scene"]["texcoord"].is_null());
    assert_eq!(
        files(&at("out")).iter().filter(|name| name.starts_with("lightmap")).collect::<Vec<_>>(),
        ["lightmap-0900.exr", "lightmap-0900.ktx2"]
    );
    let map = &table["lightmaps"][0];
    let relative = apart(&at("out"), &map["exr"], &rebuilt(&at("out"), &table, map["seconds"].as_f64().unwrap()));
    assert!(relative < 1e-3, "{relative}");
    let bytes = fs::read(at("out/lightmap-0900.ktx2")).unwrap();
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let (side, faces, levels) = (word(20) as usize, word(36), word(40));
    assert_eq!((side, faces, levels), (16, 6, 5));
    let begin = u64::from_le_bytes(bytes[80..88].try_into().unwrap()) as usize;
    let strip = pixels(at("out/lightmap-0900.exr")).main().unwrap().rgb_pixels().unwrap();
    let mut different = 0;
    for face in 0..6 {
        for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
            let texel = begin + 8 * ((face * side + y) * side + x);
            let light = |c: usize| f16::from_le_bytes([bytes[texel + 2 * c], bytes[texel + 2 * c + 1]]).to_f32();
            let (there, place) = cube::face(of_cube_map(face, [x, y], side));
            assert_eq!(there, face);
            let [column, row] = (place * side as f32).to_array().map(|at| at as usize);
            assert!((place * side as f32 - Vec2::new(column as f32, row as f32) - 0.5).length() < 1e-3);
            let wanted = strip[row * 6 * side + face * side + column];
            assert_eq!([light(0), light(1), light(2)], wanted);
            different += usize::from(wanted[0] != strip[y * 6 * side + face * side + x][0]);
        }
    }
    assert!(different > 100, "all faces are symmetric, which says nothing");
    // Blocks of all faces.
    let blocks = export("primitives", &at("turn.day"), &at("blocks"), &["--time", "09:00", "--format", "bc6h"]);
    let name = blocks["lightmaps"][0]["ktx2"].as_str().unwrap();
    let bytes = fs::read(at("blocks").join(name)).unwrap();
    let length = u64::from_le_bytes(bytes[88..96].try_into().unwrap()) as usize;
    assert_eq!(length, 6 * side * side);
}

#[test]
fn backs_of_glass_stay_on_its_own_primitive() {
    let lab = Lab::new();
    let stored = lab.even("even.day", 1.0);
    for (transmission, primitives) in [(0.0, 2), (1.0, 1)] {
        let mut scene = lab.scene();
        scene.materials[0].double_sided = true;
        scene.materials[0].transmission = transmission;
        // A second mesh of another material, whose back has no light.
        scene.materials.push(scene.materials[0].clone());
        scene.meshes.push(scene.meshes[0].clone());
        scene.meshes[1].primitives[0].material = scene.materials.len() as u32 - 1;
        scene.nodes.push(Node { mesh: Some(1), ..Node::default() });
        let lit = [true, true, false, false];
        let corners = lightmap::unwrap(&scene, &stored.plan.settings, Some(&lit)).unwrap().lightmap.corners;
        assert_eq!(corners.backs.as_ref().unwrap().len(), 2);
        let Unwrapping { scene: out, uv_set, .. } = unwrapped(&scene, &Stored { corners, ..stored.clone() }).unwrap();
        assert_eq!(out.meshes[0].primitives.len(), primitives);
        assert_eq!((out.meshes[1].primitives.len(), uv_set), (1, 1));
        let sides: Vec<bool> = out.materials.iter().map(|material| material.double_sided).collect();
        assert_eq!((sides[0], sides[sides.len() - 1]), (transmission > 0.0, true));
    }
}
