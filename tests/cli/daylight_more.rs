//! `daylight` from the outside: bakes that are killed, a reader in another language, lamps by name, memory, objects that are added, and light that
//! adds up.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    time::{Duration, Instant},
};

use crate::support::{Ran, command, device, files, of_project, ran};
use lucerna::{
    image::{self, Layers},
    scene::Limits,
    techniques::daylight::Stored,
};

struct Lab(tempfile::TempDir);

/// A lightmap of a room with probes and sun masks, in about twenty units.
const BAKE: [&str; 20] = [
    "--builtin",
    "primitives",
    "-D",
    "bake.samples=16",
    "-D",
    "bake.bounces=2",
    "-D",
    "bake.density=1",
    "-D",
    "bake.tile=16",
    "-D",
    "bake.interval=60",
    "-D",
    "bake.probes=3",
    "-D",
    "bake.probe_samples=16",
    "-D",
    "bake.sun_masks=0.2",
    "--kind",
    "atlas",
];

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

    fn bake(&self, out: &str, more: &[&str]) -> Ran {
        self.run(&[&["bake"][..], &BAKE, &["-o", out], more].concat())
    }

    /// Starts the bake and kills it as soon as so many units are there.
    fn killed(&self, out: &str, more: &[&str], units: usize) {
        let words = [&["bake"][..], &BAKE, &["-q", "-o", out], more].concat();
        let program = env!("CARGO_BIN_EXE_daylight");
        let mut child = command(program).current_dir(self.0.path()).args(words).spawn().unwrap();
        let parts = self.at(&format!("{out}.parts"));
        let begun = Instant::now();
        while count(&parts) < units {
            assert!(child.try_wait().unwrap().is_none(), "{out} ended before it was killed");
            assert!(begun.elapsed() < Duration::from_secs(300), "{units} units of {out} never appeared");
            std::thread::sleep(Duration::from_millis(1));
        }
        let _ = child.kill();
        child.wait().unwrap();
    }

    /// All layers of a picture.
    fn picture(&self, out: &str, words: &[&str]) -> Layers {
        self.run(&[&["render"][..], words, &["-o", out]].concat()).expect(0, &[]);
        image::read(self.at(out), &Limits::default()).unwrap()
    }
}

fn count(parts: &Path) -> usize {
    if parts.exists() { files(parts).iter().filter(|name| name.ends_with(".unit")).count() } else { 0 }
}

fn of<'a>(layers: &'a Layers, name: &str) -> &'a [f32] {
    &layers.layer(name).unwrap_or_else(|| panic!("no layer {name:?}")).data
}

#[test]
fn a_bake_with_masks_and_probes_that_is_killed_in_any_number_of_shards_has_the_same_bytes() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let told = ["the bake needs about", "GB of device memory", "sun masks of", "wrote whole.day"];
    lab.bake("whole.day", &[]).expect(0, &told);
    let whole = fs::read(lab.at("whole.day")).unwrap();
    for (shards, kills) in [(1, &[1, 4][..]), (2, &[2, 5]), (5, &[1, 4])] {
        let out = format!("{shards}.day");
        let shard = |number: usize| format!("{}/{shards}", number % shards + 1);
        for (number, units) in kills.iter().enumerate() {
            lab.killed(&out, &["--shard", &shard(number)], *units);
            assert!(!lab.at(&out).exists());
        }
        for number in (0..shards).rev() {
            let again = lab.bake(&out, &["--shard", &shard(number)]);
            // What was done before a kill is not done again.
            let killed = number < kills.len().min(shards);
            again.expect(0, if killed { &["goes on after", "is done"] } else { &["is done"] });
        }
        lab.bake(&out, &[]).expect(0, &["wrote"]);
        assert!(fs::read(lab.at(&out)).unwrap() == whole, "{shards} shards");
        assert!(!lab.at(&format!("{out}.parts")).exists());
    }
}

#[test]
fn a_reader_without_packages_finds_the_light_that_the_engine_decodes() {
    let python = Command::new("python3").arg("--version").output();
    if python.is_err() {
        assert!(std::env::var_os("CI").is_none(), "python3 is not installed");
        println!("skipped: python3 is not installed");
        return;
    }
    if !device() {
        return;
    }
    let lab = Lab::new();
    let small = ["-D", "bake.samples=16", "-D", "bake.bounces=2", "-D", "bake.interval=120", "-D", "bake.probes=0"];
    let place = ["--builtin", "hall", "--size", "40x18", "--kind", "view", "-o", "a.day"];
    lab.run(&[&["bake"][..], &place, &small].concat()).expect(0, &[]);
    let stored = Stored::read(&lab.at("a.day")).unwrap();
    let reader = of_project("samples/daylight/read_day.py");
    for (kind, number) in [("sun", 3), ("sky", 145), ("lamps", 0)] {
        let words = [kind, &number.to_string()];
        let out = Command::new("python3").arg(&reader).arg(lab.at("a.day")).args(words).output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let text = String::from_utf8(out.stdout).unwrap();
        let mut lines = text.lines();
        let (mut texels, mut lit) = (0, 0);
        for (index, tile) in stored.tiles.iter().enumerate() {
            let layer = match kind {
                "sun" => &tile.sun,
                "sky" => &tile.sky,
                _ => &tile.lamps,
            };
            let coefficients = layer.mix([(number, [1.0; 3])].into_iter());
            for (texel, [x, y]) in stored.plan.covered(index as u32, &tile.mask).enumerate() {
                let numbers: Vec<f64> =
                    lines.next().unwrap().split(' ').map(|number| number.parse().unwrap()).collect();
                assert_eq!(numbers[..2], [f64::from(x), f64::from(y)]);
                for (found, wanted) in numbers[2..].iter().zip(layer.decode(texel, &coefficients)) {
                    let wanted = f64::from(wanted);
                    assert!((found - wanted).abs() < 1e-5 + 1e-4 * wanted.abs(), "{kind}: {found}, not {wanted}");
                    lit += usize::from(wanted > 1e-3);
                }
                texels += 1;
            }
        }
        assert!(lines.next().is_none() && texels > 600 && lit > 100, "{kind}: {texels} texels, {lit} lit values");
    }
    for (words, said) in [(&["sun", "99"][..], "0 to"), (&["sun", "x"], "usage"), (&["wind", "0"], "usage")] {
        let out = Command::new("python3").arg(&reader).arg(lab.at("a.day")).args(words).output().unwrap();
        let text = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(!out.status.success() && text.contains(said), "{words:?}: {text}");
    }
}

#[test]
fn lamps_by_name_burn_by_themselves_and_light_adds_up() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let small = ["-D", "bake.samples=16", "-D", "bake.bounces=2", "-D", "bake.interval=120", "-D", "bake.probes=0"];
    let place = ["--builtin", "hall", "--size", "24x18"];
    let lamps = ["--lamp", "lamp 1", "--lamp", "lamp 2", "--kind", "view", "-o", "hall.day"];
    let bake = [&["bake"][..], &place, &small, &lamps].concat();
    lab.run(&bake).expect(0, &[]);
    let names = lab.run(&["info", "hall.day", "--json"]).expect(0, &[]).json().to_string();
    assert!(names.contains("lamp 1") && names.contains("lamp 2"), "{names}");
    let night = |which: &str, out: &str| {
        let burning = format!("daylight.lamps={which}");
        let words = [&place[..], &["--bake", "hall.day", "--time", "23:00", "-D", &burning]].concat();
        of(&lab.picture(out, &words), "irradiance").iter().map(|v| f64::from(*v)).sum::<f64>()
    };
    let [one, other, both, none] = [
        night("off,lamp 1=on", "one.exr"),
        night("off,lamp 2=on", "other.exr"),
        night("on", "both.exr"),
        night("off", "none.exr"),
    ];
    assert!(one > none && other > none, "{one} {other} {none}");
    assert!((one + other - both - none).abs() < 1e-3 * both, "{one} + {other} is not {both} with {none}");
    // By day the picture is the sum of its layers.
    let words = [&place[..], &["--bake", "hall.day", "--time", "12:00"]].concat();
    let layers = lab.picture("day.exr", &words);
    let main = layers.main().unwrap();
    let channels = main.channels.len();
    let (direct, indirect) = (of(&layers, "direct"), of(&layers, "indirect"));
    let mut lit = 0;
    for pixel in 0..direct.len() / 3 {
        for c in 0..3 {
            let [total, sun, rest] = [main.data[channels * pixel + c], direct[3 * pixel + c], indirect[3 * pixel + c]];
            assert!((total - sun - rest).abs() <= 2e-3 * total.abs().max(1e-3), "{total} is not {sun} + {rest}");
            lit += usize::from(sun > 0.0 && rest > 0.0);
        }
    }
    assert!(lit > 0);
}

#[test]
fn an_object_that_is_added_casts_a_shadow_of_the_sun() {
    if !device() {
        return;
    }
    let lab = Lab::new();
    let small = ["-D", "bake.samples=4", "-D", "bake.bounces=1", "-D", "bake.interval=120", "-D", "bake.probes=0"];
    let place = ["--builtin", "primitives", "--size", "96x72"];
    lab.run(&[&["bake"][..], &place, &small, &["--kind", "view", "-o", "a.day"]].concat()).expect(0, &[]);
    let shot = |out: &str, more: &[&str]| {
        let words = [&place[..], &["--bake", "a.day", "--time", "09:00", "-D", "daylight.gloss=false"], more].concat();
        lab.picture(out, &words)
    };
    let add = ["--add", "builtin:pot@0.2,0,1.6,3,20", "-D", "daylight.added=screen"];
    let [without, with] = [shot("without.exr", &[]), shot("with.exr", &add)];
    let light = |layers: &Layers, pixel: usize| of(layers, "direct")[3 * pixel..3 * pixel + 3].iter().sum::<f32>();
    let (depths, before) = (of(&with, "depth"), of(&without, "depth"));
    let (mut shadow, mut object, mut brighter) = (0, 0, 0);
    for pixel in 0..depths.len() {
        if (depths[pixel] - before[pixel]).abs() > 1e-3 * before[pixel] {
            object += 1;
        } else if light(&without, pixel) > 0.0 && light(&with, pixel) < 0.1 * light(&without, pixel) {
            shadow += 1;
        } else {
            brighter += usize::from(light(&with, pixel) > 1.01 * light(&without, pixel) + 1e-6);
        }
    }
    println!("{object} pixels of the object, {shadow} in its shadow, {brighter} brighter");
    // The shadow map has a little larger texels, so that the edges of other shadows move.
    assert!(brighter < shadow / 4, "{brighter}");
    assert!(object > 100 && shadow > 40, "{object} and {shadow} pixels");
}
