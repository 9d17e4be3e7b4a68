//! `daylight export` from the outside: what the files hold, by readers of their own; and what is refused.

use std::{fs, path::Path};

use glam::{Vec2, Vec3, vec3};
use half::f16;
use lucerna::{
    image::{self, Layers},
    scene::{Limits, LoadOptions, Scene, load},
    techniques::daylight::{
        Baking, Calendar, Kind, Lit, Plan, Sky, Stored, Weather, digest,
        layer::Layer,
        lightmap::{self, Corners, Receiver},
        parts,
        units::Tile,
    },
};
use serde_json::{Value, json};

use crate::{
    daylight_export_more::{apart, padded},
    support::{Ran, command, device, files, ran},
};

pub fn daylight(arguments: &[&str]) -> Ran {
    ran(command(env!("CARGO_BIN_EXE_daylight")).args(arguments))
}

/// A folder with a floor of 2×2 m, and files of baked light that were made by hand.
pub struct Lab(tempfile::TempDir);

impl Lab {
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let corners: [[f32; 3]; 4] = [[-1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0]];
        let normals = [[0.0f32, 1.0, 0.0]; 4];
        let mut bytes: Vec<u8> = corners.iter().chain(&normals).flatten().flat_map(|v| v.to_le_bytes()).collect();
        bytes.extend([0u32, 1, 2, 0, 2, 3].iter().flat_map(|index| index.to_le_bytes()));
        fs::write(folder.path().join("floor.bin"), &bytes).unwrap();
        let accessor = |view: u32, count: u32, of: &str, component: u32| {
            json!({ "bufferView": view, "componentType": component, "count": count, "type": of,
                "min": if view == 0 { json!([-1, 0, -1]) } else { json!(null) },
                "max": if view == 0 { json!([1, 0, 1]) } else { json!(null) } })
        };
        let mut document = json!({
            "asset": { "version": "2.0" },
            "scene": 0,
            "scenes": [{ "nodes": [0, 1] }],
            "nodes": [{ "mesh": 0 }, { "name": "eye", "camera": 0, "translation": [0, 1, 3] }],
            "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.8, "znear": 0.1 } }],
            "materials": [{ "pbrMetallicRoughness": { "baseColorFactor": [0.5, 0.5, 0.5, 1], "metallicFactor": 0 } }],
            "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "NORMAL": 1 }, "indices": 2, "material": 0 }] }],
            "accessors": [accessor(0, 4, "VEC3", 5126), accessor(1, 4, "VEC3", 5126), accessor(2, 6, "SCALAR", 5125)],
            "bufferViews": [
                { "buffer": 0, "byteOffset": 0, "byteLength": 48 },
                { "buffer": 0, "byteOffset": 48, "byteLength": 48 },
                { "buffer": 0, "byteOffset": 96, "byteLength": 24 },
            ],
            "buffers": [{ "byteLength": 120, "uri": "floor.bin" }],
        });
        for accessor in document["accessors"].as_array_mut().unwrap() {
            accessor.as_object_mut().unwrap().retain(|_, value| !value.is_null());
        }
        fs::write(folder.path().join("floor.gltf"), document.to_string()).unwrap();
        Self(folder)
    }

    fn at(&self, name: &str) -> String {
        self.0.path().join(name).display().to_string()
    }

    pub fn scene(&self) -> Scene {
        let mut scene = load(self.at("floor.gltf"), &LoadOptions::default()).unwrap();
        scene.name = "floor".into();
        scene
    }

    /// A bake of the floor in which each texel has this irradiance under an overcast sky at noon, and no light of the sun.
    pub fn even(&self, name: &str, irradiance: f32) -> Stored {
        let scene = self.scene();
        let settings = Baking { density: 4.0, tile: 8, ..Baking::default() };
        let unwrapped = lightmap::unwrap(&scene, &settings, None).unwrap();
        let sun = vec3(0.0, 0.8, 0.6);
        let plan = Plan {
            scene: scene.name.clone(),
            parts: parts(&scene),
            receivers: Kind::Lightmap {
                charts: unwrapped.charts,
                covered: unwrapped.receivers.len() as u64,
                backs: 0,
                corners: digest(&unwrapped.lightmap.corners),
            },
            extent: unwrapped.lightmap.extent,
            calendar: Calendar {
                date: "2026-06-21".into(),
                zone: "UTC".into(),
                latitude: 50.0,
                longitude: 0.0,
                ..Calendar::default()
            },
            probes: None,
            lamps: Vec::new(),
            steps: 2,
            times: [0.45, 0.55].map(|part| Lit { seconds: 86_400.0 * part, sun: sun.to_array() }).into(),
            weather: Weather::default(),
            settings: settings.clone(),
        };
        let day = lucerna::techniques::daylight::Day::new("2026-06-21", "UTC", 50.0, 0.0).unwrap();
        let overcast = Weather::new(3.0, 0.3, 1.0).unwrap();
        let noon = day.sun(43_200.0).direction(0.0);
        let zenith = Sky::new(overcast, noon.map(f64::from)).unwrap().patches()[144];
        // The cap of the sky alone gives all of it; an overcast sky is grey.
        let along = irradiance / zenith[0];
        let [times, patches, _] = plan.dimensions();
        let of_tile = |texels: &[Receiver], number: usize| {
            let [_, _, columns, rows] = plan.tile(number as u32);
            let mut mask = vec![0u32; (columns * rows).div_ceil(32) as usize];
            texels.iter().for_each(|Receiver { texel, .. }| mask[*texel as usize / 32] |= 1 << (texel % 32));
            let one = u32::from(f16::ONE.to_bits());
            let mut table = vec![0.0; patches];
            table[144] = along;
            let there = !texels.is_empty();
            let none = Layer {
                dimensions: times as u32,
                wide: 0,
                narrow: 0,
                table: Vec::new(),
                words: Vec::new(),
                blocks: None,
                worst: 0.0,
                worst_dimension: 0,
                hidden: 0,
                noise: 0.0,
            };
            let sky = Layer {
                dimensions: patches as u32,
                wide: u32::from(there),
                table: if there { table } else { Vec::new() },
                words: [one | one << 16, one].repeat(texels.len()),
                ..none.clone()
            };
            let lamps = Layer { dimensions: 0, ..none.clone() };
            Tile { sun: none, sky, lamps, mask, light: vec![[0.0; 2]; times] }
        };
        let tiles =
            unwrapped.by_tile(settings.tile).tiles.iter().enumerate().map(|(n, texels)| of_tile(texels, n)).collect();
        let stored = Stored { plan, tiles, probes: Vec::new(), corners: unwrapped.lightmap.corners };
        fs::write(self.at(name), stored.encode().unwrap()).unwrap();
        stored
    }

    fn export(&self, bake: &str, out: &str, more: &[&str]) -> Ran {
        let (scene, bake, out) = (self.at("floor.gltf"), self.at(bake), self.at(out));
        let words = ["export", &scene, "--bake", &bake, "-o", &out];
        daylight(&[&words[..], more].concat())
    }
}

pub fn pixels(path: impl AsRef<Path>) -> Layers {
    image::read(path, &Limits::default()).unwrap()
}

pub fn json_of(path: impl AsRef<Path>) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// The document of a .glb file.
fn document(path: impl AsRef<Path>) -> Value {
    let bytes = fs::read(path).unwrap();
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).unwrap()
}

/// The largest level of a KTX 2.0 file: format, columns, rows, bytes.
pub fn ktx2(path: impl AsRef<Path>) -> (u32, usize, usize, Vec<u8>) {
    let bytes = fs::read(path).unwrap();
    assert_eq!(&bytes[..12], b"\xabKTX 20\xbb\r\n\x1a\n");
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let (begin, length) = (word(80) as usize, word(88) as usize);
    (word(12), word(20) as usize, word(24) as usize, bytes[begin..begin + length].to_vec())
}

/// The numbers of a KTX 2.0 file, whatever their kind.
pub fn numbers(path: impl AsRef<Path>) -> (usize, Vec<f32>) {
    let (format, columns, _, bytes) = ktx2(path);
    let values = match format {
        38 => bytes.iter().map(|b| f32::from(b.cast_signed()) / 127.0).collect(),
        97 => bytes.as_chunks::<2>().0.iter().map(|b| f16::from_le_bytes(*b).to_f32()).collect(),
        100 => bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect(),
        other => panic!("format {other}"),
    };
    (columns, values)
}

/// An irradiance of π on a surface of albedo ρ gives a radiance of ρ: π / π · ρ.
#[test]
fn a_floor_of_irradiance_pi_reads_pi_in_all_files() {
    let lab = Lab::new();
    let stored = lab.even("even.day", std::f32::consts::PI);
    let [width, height] = stored.plan.extent;
    let said = lab.export("even.day", "out", &["--overcast", "1", "--json"]).expect(0, &["TEXCOORD_1", "wrote"]);
    let folder = Path::new(&lab.at("out")).to_owned();
    let names = ["daylight.json", "lightmap-1200.exr", "lightmap-1200.hdr", "lightmap-1200.ktx2", "moments.ktx2"];
    let rest = ["scene.glb", "sky-00.ktx2", "sky-table.ktx2", "sources.ktx2"];
    assert_eq!(files(&folder), [&names[..], &rest].concat());
    let sizes = said.json();
    assert_eq!(sizes["files"].as_array().unwrap().len(), 9);
    let table = json_of(folder.join("daylight.json"));
    assert_eq!((&table["width"], &table["height"], &table["version"]), (&json!(width), &json!(height), &json!(1)));
    let (format, columns, _, raw) = ktx2(folder.join("sources.ktx2"));
    assert_eq!((format, columns), (98, width as usize));
    let sources: Vec<u32> = raw.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b)).collect();
    let own = sources.iter().enumerate().filter(|(texel, source)| *texel as u32 == **source).count() as u64;
    let Kind::Lightmap { covered, .. } = stored.plan.receivers else { panic!() };
    assert_eq!(own, covered);
    let near = sources.iter().filter(|source| **source != u32::MAX).count();
    assert!(near > own as usize, "nothing was padded");
    let (_, halves) = numbers(folder.join("lightmap-1200.ktx2"));
    let radiance = Path::new("lightmap-1200.hdr");
    for (name, tolerance) in [(Path::new("lightmap-1200.exr"), 1e-3), (radiance, 8e-3)] {
        let layers = pixels(folder.join(name));
        let light = layers.main().unwrap().rgb_pixels().unwrap();
        for (texel, source) in sources.iter().enumerate() {
            let wanted = if *source == u32::MAX { 0.0 } else { std::f32::consts::PI };
            for (channel, value) in light[texel].iter().enumerate() {
                assert!((value - wanted).abs() <= tolerance * wanted, "{name:?}, texel {texel}: {value}");
                assert!((halves[4 * texel + channel] - wanted).abs() <= 1e-3 * wanted);
            }
        }
    }
    // The last level holds the mean over the texels with light.
    let bytes = fs::read(folder.join("lightmap-1200.ktx2")).unwrap();
    let levels = u32::from_le_bytes(bytes[40..44].try_into().unwrap()) as usize;
    assert_eq!(levels, 32 - width.max(height).leading_zeros() as usize);
    let begin = u64::from_le_bytes(bytes[80 + 24 * (levels - 1)..][..8].try_into().unwrap()) as usize;
    let last = f16::from_le_bytes(bytes[begin..begin + 2].try_into().unwrap()).to_f32();
    assert!((last - std::f32::consts::PI).abs() < 4e-3, "{last}");
}

#[test]
fn the_scene_has_the_lightmap_as_a_second_set_of_coordinates() {
    let lab = Lab::new();
    let stored = lab.even("even.day", 1.0);
    lab.export("even.day", "out", &["--overcast", "1", "--time", "07:40,12:00", "-q"]).expect(0, &[]);
    let folder = Path::new(&lab.at("out")).to_owned();
    let document = document(folder.join("scene.glb"));
    let used = document["extensionsUsed"].as_array().unwrap();
    assert!(used.contains(&json!("MOZ_lightmap")) && used.contains(&json!("MOZ_texture_rgbe")), "{used:?}");
    assert!(document["extensionsRequired"].is_null());
    let lightmap = &document["materials"][0]["extensions"]["MOZ_lightmap"];
    assert_eq!((&lightmap["texCoord"], &lightmap["intensity"]), (&json!(1), &json!(1.0)));
    let texture = &document["textures"][lightmap["index"].as_u64().unwrap() as usize];
    let source = texture["extensions"]["MOZ_texture_rgbe"]["source"].as_u64().unwrap() as usize;
    assert_eq!(document["images"][source]["uri"], "lightmap-0740.hdr");
    assert!(folder.join("lightmap-0740.hdr").is_file() && folder.join("lightmap-1200.ktx2").is_file());
    // Our reader has no radiance pictures in glTF and needs none.
    let before = lab.scene();
    let after = load(folder.join("scene.glb"), &LoadOptions::default());
    let after = after.unwrap_or_else(|error| panic!("{error}"));
    let [a, b] = [&before, &after].map(|scene| &scene.meshes[0].primitives[0]);
    assert_eq!(a.indices.len(), b.indices.len());
    let [width, height] = stored.plan.extent.map(|side| side as f32);
    for (triangle, corners) in stored.corners.fronts.iter().enumerate() {
        for (corner, wanted) in lightmap::position(*corners).into_iter().enumerate() {
            let [p, q] = [a, b].map(|primitive| primitive.indices[3 * triangle + corner] as usize);
            assert!(a.positions[p].distance(b.positions[q]) < 1e-6);
            assert!(b.uvs[1][q].distance(wanted / Vec2::new(width, height)) < 1e-6);
        }
    }
    let low = b.positions.iter().copied().fold(Vec3::INFINITY, Vec3::min);
    assert!((low - vec3(-1.0, 0.0, -1.0)).length() < 1e-5);
}

/// A two-sided floor under an overcast sky: the light of its back is what the ground below the horizon sends up.
#[test]
fn a_back_with_texels_is_a_primitive_that_faces_the_other_way() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let text = fs::read_to_string(lab.at("floor.gltf")).unwrap();
    fs::write(lab.at("floor.gltf"), text.replace("\"materials\":[{", "\"materials\":[{\"doubleSided\":true,")).unwrap();
    let small = ["-D", "bake.samples=256", "-D", "bake.density=4", "-D", "bake.interval=120", "-D", "bake.probes=0"];
    let (scene, bake) = (lab.at("floor.gltf"), lab.at("floor.day"));
    daylight(&[&["bake", &scene, "-o", &bake][..], &small].concat())
        .expect(0, &["64 of 128 texels are on the backs of two-sided surfaces", "bake.backs=false"]);
    // Each shard searches for the backs by itself.
    let shards = lab.at("shards.day");
    for shard in [&["--shard", "2/2"][..], &["--shard", "1/2"], &[]] {
        daylight(&[&["bake", &scene, "-q", "-o", &shards][..], &small, shard].concat()).expect(0, &[]);
    }
    assert!(fs::read(&shards).unwrap() == fs::read(&bake).unwrap());
    assert!(daylight(&["info", &bake]).expect(0, &[]).stdout.contains("128 texels on surfaces, 64 of them on backs"));
    lab.export("floor.day", "out", &["--overcast", "1", "--time", "12:00"]).expect(0, &["TEXCOORD_1"]);
    let folder = Path::new(&lab.at("out")).to_owned();
    let scene = load(folder.join("scene.glb"), &LoadOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    assert!(scene.materials.iter().all(|material| !material.double_sided));
    let [front, back] = &scene.meshes[0].primitives[..] else {
        panic!("{} primitives", scene.meshes[0].primitives.len())
    };
    let layers = pixels(folder.join("lightmap-1200.exr"));
    let (light, width) = (layers.main().unwrap().rgb_pixels().unwrap(), layers.width as f32);
    let [above, below] = [(front, Vec3::Y), (back, Vec3::NEG_Y)].map(|(primitive, up)| {
        for triangle in primitive.indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|corner| primitive.positions[triangle[corner] as usize]);
            assert!((b - a).cross(c - a).normalize().distance(up) < 1e-5);
        }
        assert!(primitive.normals.iter().all(|normal| normal.distance(up) < 1e-5));
        // The mean of the four texels in the middle.
        let place = primitive.uvs[1].iter().sum::<Vec2>() / primitive.uvs[1].len() as f32;
        let [x, y] = [place.x * width, place.y * layers.height as f32].map(|at| at.round() as usize);
        let at = |(x, y): (usize, usize)| light[y * layers.width as usize + x][1];
        [(x - 1, y - 1), (x, y - 1), (x - 1, y), (x, y)].map(at).iter().sum::<f32>() / 4.0
    });
    let albedo = Weather::default().ground_albedo() as f32;
    // The tolerance of 2 % is for the mean of both sides, which are in one tile.
    assert!(above > 0.0 && (below / above / albedo - 1.0).abs() < 0.06, "{below} of {above}");
}

/// A real bake, rebuilt from the pages, the coefficients and the light from outside by the page's own words.
#[test]
fn the_pages_and_the_table_rebuild_the_lightmaps() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let (bake, out) = (lab.at("primitives.day"), lab.at("out"));
    let small = ["-D", "bake.samples=16", "-D", "bake.density=6", "-D", "bake.interval=60", "-D", "bake.tile=32"];
    daylight(&[&["bake", "--builtin", "primitives", "-q", "-o", &bake][..], &small].concat()).expect(0, &[]);
    let words = ["export", "--builtin", "primitives", "--bake", &bake, "-o", &out];
    daylight(&[&words[..], &["--time", "09:30,04:20", "--all", "--no-lamps"]].concat()).expect(0, &["lightmap-*.exr"]);
    let folder = Path::new(&out);
    // Each node has a mesh of its own, and all of it lies in the lightmap.
    let scene = load(folder.join("scene.glb"), &LoadOptions::default()).unwrap();
    assert_eq!(scene.meshes.len(), scene.nodes.iter().filter(|node| node.mesh.is_some()).count());
    let mut uvs = scene.meshes.iter().flat_map(|mesh| &mesh.primitives).flat_map(|primitive| &primitive.uvs[1]);
    assert!(uvs.all(|uv| uv.min_element() > 0.0 && uv.max_element() < 1.0));
    let table = json_of(folder.join("daylight.json"));
    let whole = |value: &Value| value.as_u64().unwrap() as usize;
    let [width, height] = [&table["width"], &table["height"]].map(whole);
    let times: Vec<f64> = table["times"].as_array().unwrap().iter().map(|time| time.as_f64().unwrap()).collect();
    let maps = table["lightmaps"].as_array().unwrap();
    // 09:30 is between two steps, 04:20 before the first one; the others are the steps.
    assert_eq!(maps.len(), 2 + times.len());
    assert!(maps[2..].iter().all(|map| map["ktx2"].is_null()));
    let (moment_columns, moments) = numbers(folder.join("moments.ktx2"));
    let read: Vec<Read> = table["layers"].as_array().unwrap().iter().map(|layer| Read::new(folder, layer)).collect();
    let mut wide_and_narrow = [false; 2];
    for map in maps.iter().step_by(3) {
        let seconds = map["seconds"].as_f64().unwrap();
        let about = &table["moments"];
        let row = (seconds - about["first_seconds"].as_f64().unwrap()) / 60.0;
        assert_eq!(row.fract(), 0.0);
        let outside = |column: usize, channel: usize| moments[4 * (row as usize * moment_columns + column) + channel];
        // A summer day: after the last step it is night until the first one.
        assert_eq!(table["nights"], serde_json::json!([times.len() - 1]));
        let next = times.iter().position(|time| *time > seconds);
        let weights = match next {
            Some(0) => vec![(0, 1.0)],
            None => vec![(times.len() - 1, 1.0)],
            Some(next) => {
                let part = ((seconds - times[next - 1]) / (times[next] - times[next - 1])) as f32;
                vec![(next - 1, 1.0 - part), (next, part)]
            }
        };
        let mut light = vec![0.0f32; 3 * width * height];
        for tile in table["tiles"].as_array().unwrap() {
            let [x, y, columns, rows] = ["x", "y", "width", "height"].map(|key| whole(&tile[key]));
            for layer in &read {
                let of_tile = &tile[&layer.name];
                for (image, spot) in of_tile["images"].as_array().unwrap().iter().enumerate() {
                    let [page, left, top] = [&spot[0], &spot[1], &spot[2]].map(whole);
                    let (page_columns, values) = &layer.pages[page];
                    wide_and_narrow[usize::from(layer.narrow[page])] = true;
                    let along = |column: usize| layer.table[(whole(&of_tile["row"]) + image) * layer.columns + column];
                    for channel in 0..3 {
                        let sum: f32 = match layer.of_times {
                            true => weights.iter().map(|(time, w)| along(*time) * w * outside(146, channel)).sum(),
                            false => (0..146).map(|patch| along(patch) * outside(patch, channel)).sum(),
                        };
                        for (dx, dy) in (0..rows).flat_map(|dy| (0..columns).map(move |dx| (dx, dy))) {
                            let value = values[4 * ((top + dy) * page_columns + left + dx) + channel];
                            light[3 * ((y + dy) * width + x + dx) + channel] += sum * value;
                        }
                    }
                }
            }
        }
        // Rounding to 16 bits in the lightmap, in the light from outside, and in nothing else.
        let relative = apart(folder, &map["exr"], &padded(folder, &table, &light));
        assert!(light.iter().any(|value| *value > 0.0) && relative < 1e-3, "{}: {relative}", map["exr"]);
    }
    assert_eq!(wide_and_narrow, [true; 2], "both kinds of pages are there");
}

/// A layer of an export.
pub struct Read {
    pub name: String,
    of_times: bool,
    pub columns: usize,
    pub table: Vec<f32>,
    pub pages: Vec<(usize, Vec<f32>)>,
    /// Of each page whether it has signed bytes.
    narrow: Vec<bool>,
}

impl Read {
    pub fn new(folder: &Path, layer: &Value) -> Self {
        let names = || layer["pages"].as_array().unwrap().iter().map(|name| folder.join(name.as_str().unwrap()));
        let (columns, table) = numbers(folder.join(layer["table"].as_str().unwrap()));
        assert_eq!(layer["columns"], columns);
        Self {
            name: layer["name"].as_str().unwrap().to_owned(),
            of_times: layer["dimensions"] == "times",
            columns,
            table,
            pages: names().map(numbers).collect(),
            narrow: names().map(|name| ktx2(name).0 == 38).collect(),
        }
    }
}

#[test]
fn blocks_are_an_eighth_of_the_size_and_say_their_error() {
    let lab = Lab::new();
    let stored = lab.even("even.day", 100.0);
    let said = lab.export("even.day", "out", &["--format", "bc6h"]).expect(0, &["BC6H, error"]);
    let error: f64 = said.stderr.split("BC6H, error ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(error < 3.0, "{error}");
    let (format, columns, rows, bytes) = ktx2(Path::new(&lab.at("out")).join("lightmap-1200.ktx2"));
    assert_eq!((format, [columns, rows]), (143, stored.plan.extent.map(|side| side as usize)));
    assert_eq!(bytes.len(), columns * rows);
}

#[test]
fn the_same_command_writes_the_same_bytes() {
    let lab = Lab::new();
    lab.even("even.day", 2.0);
    for out in ["a", "b"] {
        lab.export("even.day", out, &["-q"]).expect(0, &[]);
    }
    let [a, b] = ["a", "b"].map(|out| Path::new(&lab.at(out)).to_owned());
    assert_eq!(files(&a), files(&b));
    assert!(files(&a).iter().all(|name| fs::read(a.join(name)).unwrap() == fs::read(b.join(name)).unwrap()));
}

#[test]
fn what_cannot_be_exported_is_refused_and_named() {
    let lab = Lab::new();
    let stored = lab.even("even.day", 1.0);
    // Calls.
    lab.export("even.day", "out", &["--time", "25:00"]).expect(2, &["25:00", "--time"]);
    lab.export("even.day", "out", &["--turbidity", "11"]).expect(2, &["11", "from 1"]);
    lab.export("even.day", "out", &["--overcast", "-0.5"]).expect(2, &[]);
    lab.export("missing.day", "out", &[]).expect(3, &["missing.day"]);
    assert!(!Path::new(&lab.at("out")).exists(), "a refused call leaves no folder");
    // Another scene.
    let bake = lab.at("even.day");
    daylight(&["export", "--builtin", "teapot", "--bake", &bake, "-o", &lab.at("out")])
        .expect(3, &["even.day", "other geometry"]);
    // A bake of what one camera sees.
    let receivers = Kind::View { camera: "eye".into(), view_from_world: [0.0; 16], clip_from_view: [0.0; 16] };
    let seen = Stored { plan: Plan { receivers, ..stored.plan.clone() }, corners: Corners::default(), ..stored };
    fs::write(lab.at("view.day"), seen.encode().unwrap()).unwrap();
    lab.export("view.day", "out", &[]).expect(3, &["view.day", "one camera", "--kind lightmap or --kind cube"]);
    // Files that are not whole.
    let whole = fs::read(&bake).unwrap();
    fs::write(lab.at("cut.day"), &whole[..whole.len() - 40]).unwrap();
    lab.export("cut.day", "out", &[]).expect(3, &["cut.day", "cut off"]);
    // Files of another version, and of another kind.
    let older = [&whole[..8], &[1], &whole[9..]].concat();
    fs::write(lab.at("older.day"), older).unwrap();
    lab.export("older.day", "out", &[]).expect(3, &["older.day", "has version 1; version 3 can be read"]);
    lab.export("floor.gltf", "out", &[]).expect(3, &["floor.gltf", "is not a file of baked daylight", "daylight bake"]);
    // Folders.
    lab.export("even.day", "floor.gltf/out", &[]).expect(1, &["floor.gltf/out"]);
    lab.export("even.day", "floor.gltf", &[]).expect(1, &["floor.gltf"]);
    fs::create_dir(lab.at("full")).unwrap();
    fs::write(lab.at("full/notes.txt"), "mine").unwrap();
    lab.export("even.day", "full", &[]).expect(1, &["full", "--overwrite"]);
    assert_eq!(files(Path::new(&lab.at("full"))), ["notes.txt"]);
    lab.export("even.day", "full", &["--overwrite", "-q"]).expect(0, &[]);
    lab.export("even.day", "full", &["--overwrite", "-q"]).expect(0, &[]);
    assert_eq!(fs::read(lab.at("full/notes.txt")).unwrap(), b"mine");
    assert!(Path::new(&lab.at("full/daylight.json")).is_file());
}
