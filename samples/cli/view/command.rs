//! The command line that makes the picture of a side.

use std::collections::BTreeMap;

use lucerna::scene::Scene;

use super::{
    fly::Fly,
    live, panel,
    side::Side,
    text,
    wanted::{Look, Shows, TRUTH},
};
use crate::{
    args::Size,
    config::SettingsArgs,
    default_light::DefaultLight,
    lamps::{self, Lamp, Put},
    record::Source,
    stage::StageArgs,
};

/// What both sides have in common.
#[derive(Debug)]
pub struct Common<'a> {
    pub args: &'a StageArgs,
    pub source: &'a Source,
    /// `None`: camera number `camera` of the scene.
    pub fly: Option<&'a Fly>,
    pub camera: usize,
    /// Words that name the camera, in the place of its number.
    pub named_camera: Option<&'a str>,
    /// Device of the window's command line.
    pub device: Option<&'a str>,
    /// Lamps that were moved in the window.
    pub moved: &'a BTreeMap<usize, Put>,
    /// The scene.
    pub scene: &'a Scene,
    /// Default lights were added.
    pub default_light: bool,
    pub size: Size,
    pub seconds: f64,
    pub exposure: f64,
    pub look: Look,
}

/// The words of the command without the name of the program and without an output. `None` if no command makes this picture.
pub fn words(common: &Common<'_>, side: &Side) -> Option<Vec<String>> {
    if side.file.is_some() || common.look == Look::FalseColour || matches!(side.shows, Shows::Layer(_)) {
        return None;
    }
    let truth = side.technique == TRUTH;
    if truth && side.shows != Shows::Picture {
        return None;
    }
    let mut out: Vec<String> = Vec::new();
    let mut say = |words: &[&str]| out.extend(words.iter().map(|&word| word.to_owned()));
    if truth {
        say(&["reference"])
    } else {
        say(&["render", side.technique])
    }
    scene(common, side.technique, &mut say);
    say(&["--size", &common.size.to_string()]);
    match common.fly {
        Some(fly) => say(&["--camera", &fly.numbers()]),
        None => say(&["--camera", common.named_camera.unwrap_or(&common.camera.to_string())]),
    }
    if common.seconds != 0.0 {
        say(&[if side.technique == "daylight" { "--scene-time" } else { "--time" }, &common.seconds.to_string()]);
    }
    let light = side.is_light();
    if light {
        say(&["--exposure", &common.exposure.to_string()]);
    }
    if let Shows::Image(name) = &side.shows {
        say(&["--view", name]);
    }
    let developed = side.settings.get("tonemap").is_some_and(|tonemap| !tonemap.is_null());
    if let Look::Light(curve) = common.look
        && light
        && !developed
    {
        say(&["--operator", curve.map_or("linear", |curve| curve.name())]);
    }
    if let Some(first) = side.about.modes.first()
        && side.mode != first.name
    {
        say(&[if truth { "--show" } else { "--mode" }, &side.mode]);
    }
    if truth {
        say(&["--spp", &side.samples.to_string()]);
    } else if side.has_edges() {
        say(&["--aa", "edges"]);
    } else if light {
        say(&["--aa", &side.pictures.to_string()]);
    }
    if let Some(bake) = &side.bake {
        say(&[if side.technique == "fiv" { "--vectors" } else { "--bake" }, &bake.display().to_string()]);
    }
    if side.technique == "fiv" && side.bake.is_none() {
        // Its settings below are then those against the defaults.
        say(&["--full"]);
    }
    let passes = text::words(side);
    passes.iter().for_each(|word| say(&[word]));
    // What the file of the passes says of the technique is a default, too.
    let begun = passes.get(1).and_then(|file| {
        let args = SettingsArgs { effects: Some(file.into()), ..SettingsArgs::default() };
        live::with(side.technique, &side.about.settings, &args).ok()
    });
    for change in panel::changes(&side.settings, begun.as_ref().unwrap_or(&side.about.settings)) {
        if change.starts_with("effects.") {
            continue;
        }
        // The number of samples of a frame is for sequences of the path tracer.
        if !(truth && change.starts_with("samples=")) {
            say(&["-D", &change]);
        }
    }
    if let Some(device) = common.device {
        say(&["--device", device]);
    }
    Some(out)
}

fn scene(common: &Common<'_>, technique: &str, say: &mut impl FnMut(&[&str])) {
    let StageArgs { scene, environment, light, sun, default_light, .. } = common.args;
    match common.source {
        Source::File(file) => say(&[file]),
        Source::Builtin(name) => say(&["--builtin", name]),
        Source::Terrain => (),
    }
    if let Some(terrain) = &scene.terrain {
        say(&["--terrain", &terrain.to_string()]);
    }
    if let Some(unit) = scene.unit {
        say(&["--unit", &unit.to_string()]);
    }
    if scene.ground.ground {
        say(&["--ground"]);
        // The options have the names of the fields.
        let options = serde_json::to_value(&scene.ground.options).unwrap_or_default();
        for (name, value) in options.as_object().into_iter().flatten() {
            let list = value.as_array().cloned().unwrap_or_else(|| vec![value.clone()]);
            for value in list {
                let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
                say(&[&format!("--{name}"), &text]);
            }
        }
    }
    for added in &scene.add {
        say(&["--add", &added.to_string()]);
    }
    for change in &scene.set {
        say(&["--set", &change.to_string()]);
    }
    if let Some(environment) = environment {
        say(&["--environment", &environment.display().to_string()]);
    }
    if let Some(turn) = common.args.turn {
        say(&["--turn", &turn.to_string()]);
    }
    for light in light {
        say(&["--light", &light.to_string()]);
    }
    if let Some(sun) = sun {
        say(&["--sun", &sun.to_string()]);
    }
    // Those of the window win over those of its command line.
    let numbers = lamps::nodes(common.scene);
    let here = |node: usize| common.moved.contains_key(&node);
    for lamp in &common.args.put {
        if !lamps::find(common.scene, &lamp.lamp).is_ok_and(here) {
            say(&["--put", &lamp.to_string()]);
        }
    }
    for (node, put) in common.moved {
        if let Some(number) = numbers.iter().position(|of| of == node) {
            say(&["--put", &Lamp { lamp: number.to_string(), put: *put }.to_string()]);
        }
    }
    // What was decided: another camera might decide otherwise, and a black picture would get a lamp. Baked daylight has its own light.
    if *default_light != DefaultLight::Never && technique != "daylight" {
        say(&["--default-light", if common.default_light { "always" } else { "never" }]);
    } else if technique != "daylight" {
        say(&["--default-light", "never"]);
    }
}

/// Frames a second of a sequence that is written.
pub const FPS: f64 = 25.0;

/// The command of a sequence in the place of that of a picture: the camera flies along a path. `path`: as `--camera-path` has it.
pub fn on_path(words: Vec<String>, path: &str, frames: u32) -> Vec<String> {
    let mut out = Vec::new();
    let mut words = words.into_iter();
    while let Some(word) = words.next() {
        match word.as_str() {
            "--camera" => {
                words.next();
                out.extend(["--camera-path".to_owned(), path.to_owned()]);
            }
            // An animation begins with the flight.
            "--time" | "--scene-time" => {
                words.next();
            }
            _ => out.push(word),
        }
    }
    // The window's sun stands still, but that of a sequence would move with each frame.
    if out.get(1).is_some_and(|technique| technique == "daylight")
        && !out.iter().any(|word| word.starts_with("daylight.minutes="))
    {
        out.extend(["-D".to_owned(), "daylight.minutes=0".to_owned()]);
    }
    out.extend(["--frames".to_owned(), format!("0..{frames}"), "--fps".to_owned(), FPS.to_string()]);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sequence_has_the_path_in_the_place_of_camera_and_time_and_a_sun_that_stands_still() {
        let words = |text: &str| -> Vec<String> { text.split(' ').map(str::to_owned).collect() };
        let flown = |text: &str| on_path(words(text), "l.toml,2", 51).join(" ");
        assert_eq!(
            flown("render isr a.glb --camera 1,2,3,4,5,6 --time 0.5 --aa 8"),
            "render isr a.glb --camera-path l.toml,2 --aa 8 --frames 0..51 --fps 25"
        );
        assert_eq!(
            flown("render daylight a.glb --camera 0 --scene-time 1 --bake a.day"),
            "render daylight a.glb --camera-path l.toml,2 --bake a.day -D daylight.minutes=0 --frames 0..51 --fps 25"
        );
        let moving = "render daylight a.glb --camera 0 -D daylight.minutes=10";
        assert!(!flown(moving).contains("minutes=0 ") && flown(moving).contains("minutes=10"));
    }

    /// The program reads the command of each technique in each mode, for light, a layer and an image.
    #[test]
    fn every_command_is_one_that_the_program_reads() {
        let line = |args: &[&str]| {
            #[derive(clap::Parser, Debug)]
            struct Line {
                #[command(flatten)]
                view: crate::view::ViewArgs,
            }
            <Line as clap::Parser>::try_parse_from(args).unwrap().view
        };
        let plain = line(&["view", "--builtin", "office", "--light", "0,1,2,3", "--sun", "-40,30"]);
        let ground = line(&[
            "view",
            "a b.glb",
            "--unit",
            "0.01",
            "--ground",
            "--copies",
            "2",
            "--beside",
            "c.glb",
            "--default-light",
            "never",
        ]);
        let fly = Fly::from_file(&crate::camera::in_numbers("-1,2,-3,-4,5,-6,50,0.01").unwrap().unwrap());
        let scene = lucerna_scenes::load("cornell").unwrap();
        let moved = BTreeMap::from([(lamps::nodes(&scene)[0], Put::At(glam::Vec3::new(-0.5, 1e-9, 3.25)))]);
        let mut count = 0;
        for (args, source) in [(&plain, Source::Builtin("office".into())), (&ground, Source::File("a b.glb".into()))] {
            for technique in lucerna::techniques::NAMES {
                let mut side = Side::new("A", technique);
                if side.about.baked {
                    side.bake = Some("a.bake".into());
                }
                for mode in side.about.modes.clone() {
                    side.mode = mode.name.to_owned();
                    for shows in [Shows::Picture, Shows::Image("gbuffer.albedo".into())] {
                        side.shows = shows;
                        let common = Common {
                            args: &args.stage,
                            source: &source,
                            fly: Some(&fly).filter(|_| count % 2 == 0),
                            camera: 1,
                            named_camera: None,
                            device: Some("cpu"),
                            moved: &moved,
                            scene: &scene,
                            default_light: count % 3 == 0,
                            size: Size { width: 64, height: 48 },
                            seconds: 0.5,
                            exposure: -1.5,
                            look: Look::Light(Some(lucerna::techniques::tonemap::Operator::Agx)),
                        };
                        let Some(words) = words(&common, &side) else {
                            assert!(*technique == TRUTH && side.shows != Shows::Picture);
                            continue;
                        };
                        let line = ["lucerna"]
                            .into_iter()
                            .map(str::to_owned)
                            .chain(words.clone())
                            .chain(["-o".into(), "a.png".into()]);
                        let read = <crate::programs::lucerna::Arguments as clap::Parser>::try_parse_from(line);
                        assert!(read.is_ok(), "{words:?}: {}", read.unwrap_err());
                        // The time of the scene, not that of the day.
                        let time = if *technique == "daylight" { "--scene-time" } else { "--time" };
                        assert!(words.windows(2).any(|pair| pair == [time, "0.5"]), "{words:?}");
                        count += 1;
                    }
                }
            }
        }
        assert!(count > 20, "{count}");
    }
}
