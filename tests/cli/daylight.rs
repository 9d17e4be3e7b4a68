//! `daylight bake` and `daylight render` from the outside: days, paths of the sun, cubes, steps that are left out, and bad input.

use std::{
    fs,
    path::{Path, PathBuf},
};

use crate::support::{Ran, command, device, files, ran};
use lucerna::{image, scene::Limits};

struct Lab(tempfile::TempDir);

/// Settings that make a bake small.
const SMALL: [&str; 8] =
    ["-D", "bake.samples=8", "-D", "bake.bounces=2", "-D", "bake.density=0.5", "-D", "bake.lightmap=64"];
/// A bake for one view of 16×12 pixels.
const VIEW: [&str; 6] = ["--builtin", "primitives", "--kind", "view", "--size", "16x12"];

impl Lab {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn at(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, words: &[&str]) -> Ran {
        ran(command(env!("CARGO_BIN_EXE_daylight")).current_dir(self.0.path()).args(words))
    }

    /// Bakes the view into `out`.
    fn view(&self, out: &str, more: &[&str]) -> Ran {
        self.run(&[&["bake"][..], &VIEW, &SMALL, &["-o", out], more].concat())
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.at(name), text).unwrap();
    }

    /// The irradiance layer of a picture.
    fn irradiance(&self, out: &str, words: &[&str]) -> Vec<f32> {
        self.run(&[&["render"][..], words, &["--mode", "irradiance", "-o", out]].concat()).expect(0, &[]);
        let layers = image::read(self.at(out), &Limits::default()).unwrap();
        layers.layer("irradiance").or(layers.main()).unwrap().data.clone()
    }
}

fn mean(values: &[f32]) -> f64 {
    values.iter().map(|value| f64::from(*value)).sum::<f64>() / values.len() as f64
}

/// Root mean square of the difference, relative to the mean.
fn apart(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len());
    let square = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>() / a.len() as f64;
    square.sqrt() / mean(b)
}

#[test]
fn impossible_days_are_exit_code_2_and_say_what_is_possible() {
    let lab = Lab::new();
    for (words, parts) in [
        (&["--latitude", "91"][..], &["latitude is 91", "-90 to 90"][..]),
        (&["--longitude=-181"], &["longitude is -181", "-180 to 180"]),
        (&["--date", "2026-02-30"], &["2026-02-30", "year, month"]),
        (&["--timezone", "Mars/Olympus"], &["Mars/Olympus", "Europe/Copenhagen"]),
        (&["--date", "2026-03-29", "--from", "02:30"], &["--from", "02:30", "doesn't exist"]),
        (&["--from", "15:00", "--until", "09:00"], &["--until 09:00:00 is before --from 15:00:00"]),
        (&["--until", "9:00"], &["--until", "9:00", "two digits"]),
        (&["-D", "bake.interval=0.1"], &["14400 steps", "4096", "longer interval"]),
        (&["-D", "bake.interval=0.01"], &["bake.interval", "0.01"]),
        (&["-D", "bake.offset=5"], &["offset is 5", "interval of 5"]),
        (&["--dates", "2026-06-21,2026-06-21"], &["2026-06-21", "twice"]),
        (&["--dates", "2026-06-21", "--date", "2026-06-21"], &["--dates", "--date"]),
        (&["--sun-distance", "1"], &["--sun-distance is 1", "outside the scene"]),
        (&["--sun-distance", "nan"], &["--sun-distance"]),
        (&["-D", "bake.sun_masks=0.0001"], &["bake.sun_masks", "0.0001", "0.001"]),
        (&["-D", "bake.sun_masks=-1"], &["bake.sun_masks", "-1"]),
        (&["-D", "bake.sun_masks=0.001"], &["bake.sun_masks", "points for", "Choose at least"]),
        (&["-D", "bake.adaptive=sometimes"], &["sometimes", "paper", "middle"]),
        (&["--sun-path", "sun.csv", "--date", "2026-06-21"], &["--sun-path", "--date"]),
        (&["--sun-path", "sun.txt"], &["sun.txt", ".csv", ".toml"]),
    ] {
        lab.view("out.day", words).expect(2, parts);
    }
    let words =
        ["bake", "--builtin", "primitives", "-D", "bake.adaptive=middle", "-D", "bake.measure=pdiff", "-o", "out.day"];
    lab.run(&[&words[..], &SMALL, &["-D", "bake.lightmap=256"]].concat())
        .expect(2, &["bake.measure", "lightmap", "rms"]);
    assert_eq!(files(lab.0.path()), [""; 0]);
}

#[test]
fn paths_of_the_sun_that_cannot_be_read_name_file_and_line() {
    let lab = Lab::new();
    for (name, text, parts) in [
        (
            "a.csv",
            "time,azimuth,elevation\n06:00,90,0\n07:00,95,east\n",
            &["a.csv", "line 3", "`elevation`", "`east`"][..],
        ),
        ("b.csv", "time,azimuth\n06:00,90\n", &["b.csv", "line 1", "time,azimuth"]),
        ("c.csv", "", &["c.csv", "empty"]),
        ("d.csv", "time,x,y,z\n06:00,1,0,0\n05:00,1,0,0\n", &["d.csv", "line 3", "order"]),
        ("e.toml", "[[sun]]\ntime = \"06:00\"\nelevation = 3\n", &["e.toml", "line 1", "azimuth"]),
        ("f.toml", "[[sun]\n", &["f.toml", "line 1"]),
    ] {
        lab.write(name, text);
        lab.view("out.day", &["--sun-path", name]).expect(3, parts);
    }
    lab.view("out.day", &["--sun-path", "no.csv"]).expect(3, &["no.csv", "cannot be read"]);
    lab.write("turned.csv", "time,x,y,z\n06:00,1,0,0\n18:00,-1,1,0\n");
    lab.view("out.day", &["--sun-path", "turned.csv", "--north", "30"]).expect(2, &["--north", "directions"]);
}

#[test]
fn a_path_from_a_file_lights_bakes_and_pictures() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    // A lamp that goes on and off again: light from one side at 08:00, from above at 12:00, none after 16:00.
    lab.write(
        "lamp.csv",
        "time,x,y,z,red,green,blue\n08:00,1,1,0,20000,10000,0\n12:00,0,1,0,20000,10000,0\n16:00,0,1,0,0,0,0\n",
    );
    let path = ["--sun-path", "lamp.csv", "-D", "bake.interval=30", "--no-lamps"];
    let told = lab.view("lamp.day", &[&path[..], &["--json"]].concat()).expect(0, &[]).json();
    // From 08:00 to 15:30; at 16:00 the light is out.
    assert_eq!((&told["steps"], &told["lit"]), (&48.into(), &16.into()));
    let info = lab.run(&["info", "lamp.day"]).expect(0, &[]).stdout;
    assert!(info.contains("path of the sun with 3 times"), "{info}");
    let scene = ["--builtin", "primitives", "--size", "16x12", "--bake", "lamp.day", "-D", "daylight.overcast=0"];
    let at = |time: &str, mode: &str| {
        let out = format!("{mode}.exr");
        lab.run(&[&["render"][..], &scene, &["--time", time, "--mode", mode, "-o", &out, "--overwrite"]].concat())
            .expect(0, &[]);
        let layers = image::read(lab.at(&out), &Limits::default()).unwrap();
        let [r, g, b] = [0, 1, 2]
            .map(|c| mean(&layers.main().unwrap().data.iter().skip(c).step_by(3).copied().collect::<Vec<_>>()));
        [r, g, b]
    };
    let noon = at("12:00", "direct");
    assert!(noon[0] > 0.0, "{noon:?}");
    // Half of the irradiance at 14:00 from the same direction; all of it is gone at 17:00.
    let later = at("14:00", "direct")[0] / noon[0];
    assert!((later - 0.5).abs() < 0.02, "{later}");
    assert_eq!(at("17:00", "indirect"), [0.0; 3]);
    lab.run(&[
        "render",
        "--builtin",
        "primitives",
        "--size",
        "16x12",
        "--bake",
        "lamp.day",
        "--time",
        "25:00",
        "-o",
        "x.exr",
    ])
    .expect(2, &["25:00"]);
}

#[test]
fn a_bake_of_a_part_of_the_day_refuses_other_times() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let part = ["--from", "09:05", "--until", "11:00", "-D", "bake.interval=30", "--json"];
    let told = lab.view("part.day", &part).expect(0, &[]).json();
    // One step beside each end: 09:00 to 11:00, 11:00 is the last step before 11:30.
    assert_eq!(told["lit"], 5);
    let render = |time: &str, more: &[&str]| {
        let words = ["render", "--builtin", "primitives", "--size", "16x12", "--bake", "part.day", "--overwrite"];
        lab.run(&[&words[..], &["--time", time, "-o", "x-{frame}.exr"], more].concat())
    };
    render("09:05", &[]).expect(0, &[]);
    render("11:00", &[]).expect(0, &[]);
    render("11:01", &[]).expect(2, &["part.day", "11:01:00", "09:05:00", "11:00:00", "whole day"]);
    render("10:50", &["--minutes", "6", "--frames", "0..3"]).expect(2, &["frame 2", "11:02:00"]);
}

#[test]
fn days_with_few_steps_without_sun_and_with_a_change_of_clock_are_whole() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let day = |out: &str, words: &[&str]| lab.view(out, &[words, &["--json"]].concat()).expect(0, &[]).json();
    let one = day("one.day", &["-D", "bake.interval=720"]);
    assert_eq!((&one["steps"], &one["lit"]), (&2.into(), &1.into()));
    let night = ["--date", "2026-12-21", "--latitude", "80", "-D", "bake.interval=60"];
    let said = lab.view("night.day", &[&night[..], &["--json"]].concat()).expect(0, &["sun does not shine"]).json();
    assert_eq!((&said["steps"], &said["lit"]), (&24.into(), &0.into()));
    for (out, date, steps) in [("spring.day", "2026-03-29", 23), ("autumn.day", "2026-10-25", 25)] {
        let told = day(out, &["--date", date, "-D", "bake.interval=60"]);
        assert_eq!(told["steps"], steps, "{date}");
    }
    for (bake, time) in [("one.day", "12:00"), ("night.day", "12:00"), ("spring.day", "03:00"), ("autumn.day", "23:59")]
    {
        let words =
            ["render", "--builtin", "primitives", "--size", "16x12", "--bake", bake, "--time", time, "--overwrite"];
        lab.run(&[&words[..], &["-o", "x.exr"]].concat()).expect(0, &[]);
    }
    let spring = ["render", "--builtin", "primitives", "--size", "16x12", "--bake", "spring.day", "--time", "02:30"];
    lab.run(&[&spring[..], &["-o", "y.exr"]].concat()).expect(2, &["02:30", "doesn't exist"]);
}

#[test]
fn a_camera_that_turns_in_place_sees_the_light_of_a_view() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let scene = ["--builtin", "primitives"];
    let many = [
        "-D",
        "bake.samples=96",
        "-D",
        "bake.interval=180",
        "-D",
        "bake.tolerance=0.01",
        "--from",
        "11:00",
        "--until",
        "13:00",
    ];
    let size = ["--size", "40x30"];
    lab.run(&[&["bake"][..], &scene, &size, &many, &["--kind", "view", "-o", "view.day"]].concat()).expect(0, &[]);
    let cube = ["--kind", "cube", "-D", "bake.face=32", "-o", "cube.day"];
    lab.run(&[&["bake"][..], &scene, &many, &cube].concat()).expect(0, &["192×32"]);
    let info = lab.run(&["info", "cube.day"]).expect(0, &[]).stdout;
    assert!(info.contains("cube around camera"), "{info}");
    let shot = |bake: &str, out: &str| {
        lab.irradiance(out, &[&scene[..], &size, &["--bake", bake, "--time", "12:00"]].concat())
    };
    let (view, cube) = (shot("view.day", "view.exr"), shot("cube.day", "cube.exr"));
    let ratio = mean(&cube) / mean(&view);
    assert!((ratio - 1.0).abs() < 0.02, "{ratio}");
    let error = apart(&cube, &view);
    assert!(error < 0.2, "{error}");
    // Any size and angle of view, but only from this place.
    let other =
        ["render", "--builtin", "primitives", "--bake", "cube.day", "--time", "12:00", "--camera", "1", "-o", "o.exr"];
    lab.run(&other).expect(2, &["cube.day", "turns in place at", "lightmap"]);
}

#[test]
fn steps_that_are_left_out_are_the_same_for_all_shards_and_change_little() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let day = ["-D", "bake.interval=10", "-D", "bake.tile=8", "-D", "bake.samples=16"];
    let even = lab.view("even.day", &[&day[..], &["--json"]].concat()).expect(0, &[]).json();
    for (out, how) in [("middle.day", "bake.adaptive=middle"), ("paper.day", "bake.adaptive=paper")] {
        let words = [&day[..], &["-D", how, "-D", "bake.noticeable=0.05"]].concat();
        let told = lab.view(out, &[&words[..], &["--json"]].concat()).expect(0, &["lit steps are needed"]).json();
        let kept = told["adaptive"]["kept"].as_u64().unwrap();
        assert_eq!(told["adaptive"]["lit"], even["lit"]);
        assert_eq!(told["lit"], kept);
        assert!(kept >= 14 && kept < even["lit"].as_u64().unwrap(), "{how}: {kept}");
        let whole = fs::read(lab.at(out)).unwrap();
        for shard in ["2/2", "1/2"] {
            lab.view("shards.day", &[&words[..], &["--shard", shard]].concat()).expect(0, &[]);
        }
        lab.view("shards.day", &words).expect(0, &[]);
        assert!(fs::read(lab.at("shards.day")).unwrap() == whole, "{how}");
        fs::remove_file(lab.at("shards.day")).unwrap();
    }
    let shot = |bake: &str, out: &str| {
        lab.irradiance(out, &["--builtin", "primitives", "--size", "16x12", "--bake", bake, "--time", "10:10"])
    };
    let error = apart(&shot("middle.day", "a.exr"), &shot("even.day", "b.exr"));
    assert!(error < 0.15, "{error}");
    let pdiff = ["-D", "bake.adaptive=middle", "-D", "bake.measure=pdiff"];
    lab.view("pdiff.day", &[&day[..], &pdiff].concat()).expect(0, &["lit steps are needed"]);
}

#[test]
fn sun_masks_change_little_and_are_the_same_for_all_shards_and_with_steps_left_out() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let day = ["-D", "bake.interval=20", "-D", "bake.tile=8", "-D", "bake.samples=64", "-D", "bake.probes=3"];
    let masks = [&day[..], &["-D", "bake.sun_masks=0.1"]].concat();
    lab.view("exact.day", &day).expect(0, &[]);
    lab.view("masks.day", &masks).expect(0, &["sun masks of", "0.1 m apart", "bytes"]);
    let shot = |bake: &str, out: &str| {
        lab.irradiance(out, &["--builtin", "primitives", "--size", "16x12", "--bake", bake, "--time", "10:00"])
    };
    let (exact, found) = (shot("exact.day", "a.exr"), shot("masks.day", "b.exr"));
    let (error, light) = (apart(&found, &exact), mean(&found) / mean(&exact));
    println!("masks: {error:.3} off, {light:.4} of the light");
    assert!(error < 0.1 && (light - 1.0).abs() < 0.02, "{error} {light}");
    for adaptive in ["bake.adaptive=off", "bake.adaptive=every"] {
        let words = [&masks[..], &["-D", adaptive]].concat();
        lab.view("whole.day", &words).expect(0, &[]);
        let whole = fs::read(lab.at("whole.day")).unwrap();
        for shard in ["2/2", "1/2"] {
            lab.view("shards.day", &[&words[..], &["--shard", shard]].concat()).expect(0, &[]);
        }
        lab.view("shards.day", &words).expect(0, &[]);
        assert!(fs::read(lab.at("shards.day")).unwrap() == whole, "{adaptive}");
        ["whole.day", "shards.day"].iter().for_each(|name| fs::remove_file(lab.at(name)).unwrap());
    }
}

#[test]
fn several_days_in_one_file_are_as_the_days_alone() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let exact = ["-D", "bake.tolerance=0.01", "-D", "bake.noise_floor=false", "-D", "bake.filter=0"];
    let day = [&["-D", "bake.interval=60", "--json"][..], &exact].concat();
    let summer = lab.view("summer.day", &[&day[..], &["--date", "2026-06-21"]].concat()).expect(0, &[]).json();
    let winter = lab.view("winter.day", &[&day[..], &["--date", "2026-12-21"]].concat()).expect(0, &[]).json();
    let both = [&day[..], &["--dates", "2026-06-21,2026-12-21", "-D", "bake.adaptive=off"]].concat();
    let both = lab.view("both.day", &both).expect(0, &[]).json();
    let lit = |told: &serde_json::Value| told["lit"].as_u64().unwrap();
    assert_eq!(lit(&both), lit(&summer) + lit(&winter));
    assert!(lit(&winter) < lit(&summer));
    let shot = |bake: &str, out: &str, more: &[&str]| {
        let words = ["--builtin", "primitives", "--size", "16x12", "--bake", bake, "--time", "11:30"];
        lab.irradiance(out, &[&words[..], more].concat())
    };
    for (alone, date) in [("summer.day", "2026-06-21"), ("winter.day", "2026-12-21")] {
        let [a, b] =
            [shot(alone, &format!("{alone}.exr"), &[]), shot("both.day", &format!("{date}.exr"), &["--date", date])];
        assert!(apart(&b, &a) < 0.02, "{date}: {}", apart(&b, &a));
    }
    let other = ["render", "--builtin", "primitives", "--size", "16x12", "--bake", "both.day", "--date", "2026-03-20"];
    lab.run(&[&other[..], &["-o", "x.exr"]].concat()).expect(2, &["2026-03-20", "2026-06-21, 2026-12-21"]);
    let info = lab.run(&["info", "both.day"]).expect(0, &[]).stdout;
    assert!(info.contains("2026-06-21, 2026-12-21"), "{info}");
}

/// A glTF file of one square, with a second set of coordinates or without.
fn square(folder: &Path, name: &str, second: Option<[[f32; 2]; 4]>) {
    let corners: [[f32; 3]; 4] = [[-1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0]];
    let uvs = second.unwrap_or_default();
    let mut bytes: Vec<u8> = corners.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    bytes.extend(uvs.iter().flatten().flat_map(|value| value.to_le_bytes()));
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|value| value.to_le_bytes()));
    fs::write(folder.join(format!("{name}.bin")), &bytes).unwrap();
    let coordinates = if second.is_some() { r#","TEXCOORD_0":1,"TEXCOORD_1":1"# } else { "" };
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0{coordinates}}},"indices":2}}]}}],
        "buffers":[{{"uri":"{name}.bin","byteLength":{}}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":32}},{{"buffer":0,"byteOffset":80,"byteLength":12}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[-1,0,-1],"max":[1,0,1]}},
        {{"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"}},{{"bufferView":2,"componentType":5123,"count":6,"type":"SCALAR"}}]}}"#,
        bytes.len()
    );
    fs::write(folder.join(format!("{name}.gltf")), text).unwrap();
}

#[test]
fn scenes_without_surfaces_are_refused_and_coordinates_may_be_missing_or_useless() {
    let lab = Lab::new();
    lab.write(
        "empty.gltf",
        r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"name":"nothing"}]}"#,
    );
    lab.write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    for scene in ["empty.gltf", "points.obj"] {
        for kind in ["lightmap", "view", "cube"] {
            lab.run(&["bake", scene, "--kind", kind, "-o", "out.day"]).expect(3, &["surfaces"]);
        }
    }
    if !device() {
        return;
    }
    let flat = [[0.5; 2]; 4];
    let nan = [[0.0, 0.0], [f32::NAN, 1.0], [1.0, 1.0], [1.0, 0.0]];
    let whole = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
    let mut light = Vec::new();
    for (name, second) in [("none", None), ("flat", Some(flat)), ("nan", Some(nan)), ("whole", Some(whole))] {
        square(lab.0.path(), name, second);
        let (scene, out, picture) = (format!("{name}.gltf"), format!("{name}.day"), format!("{name}.exr"));
        let day = ["-D", "bake.interval=180", "-D", "bake.density=4", "-D", "bake.samples=64", "-o", &out];
        let baked = lab.run(&[&["bake", &scene][..], &day].concat());
        if name == "nan" && baked.code == 3 {
            baked.expect(3, &["nan.gltf"]);
            continue;
        }
        baked.expect(0, &[]);
        let shot = lab.irradiance(&picture, &[&scene, "--size", "16x12", "--bake", &out, "--time", "12:00"]);
        light.push(shot.iter().fold(0.0f32, |most, value| most.max(*value)));
    }
    // A lone square has the light of the whole sky at each of its points.
    assert!(light.len() >= 3 && light.iter().all(|most| (most / light[0] - 1.0).abs() < 0.05), "{light:?}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_fills_up_keeps_no_half_bake() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    std::os::unix::fs::symlink("/dev/full", lab.at("full.day")).unwrap();
    lab.view("full.day", &["-D", "bake.interval=180"]).expect(1, &["full.day", "No space left"]);
    // A disk that is full after some tiles: those that were done stay for the next try, and there is no bake.
    let script = "mount -t tmpfs -o size=128k tmpfs \"$0\" || exit 99; \"$@\"; code=$?; ls -A \"$0\"; exit $code";
    let root = command("id").arg("-u").output().is_ok_and(|id| id.stdout == b"0\n");
    let mut limited = command("unshare");
    limited.args(if root { &["-m"][..] } else { &["-Urm"] }).args(["sh", "-c", script]).arg(lab.0.path());
    limited.args([env!("CARGO_BIN_EXE_daylight"), "bake", "--builtin", "primitives", "--kind", "view"]);
    limited.args([
        "--size",
        "64x48",
        "-D",
        "bake.samples=4",
        "-D",
        "bake.interval=120",
        "-D",
        "bake.tile=16",
        "-q",
        "-o",
    ]);
    let Ok(output) = limited.arg(lab.at("big.day")).output() else {
        eprintln!("SKIPPED: there is no unshare");
        return;
    };
    let (said, left) = (String::from_utf8_lossy(&output.stderr), String::from_utf8_lossy(&output.stdout));
    if output.status.code() == Some(99) || said.contains("unshare") {
        eprintln!("SKIPPED: no file system can be mounted here: {said}");
        return;
    }
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("No space left") && said.contains("big.day"), "{said}");
    assert_eq!(left, "big.day.parts\n");
}
