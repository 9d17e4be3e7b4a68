//! The command line that makes the picture of a side.

use super::{
    fly::Fly,
    panel,
    side::Side,
    wanted::{Look, Shows, TRUTH},
};
use crate::{args::Size, record::Source, stage::StageArgs};

/// What both sides have in common.
#[derive(Debug)]
pub struct Common<'a> {
    pub args: &'a StageArgs,
    pub source: &'a Source,
    /// `None`: camera number `camera` of the scene.
    pub fly: Option<&'a Fly>,
    pub camera: usize,
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
    let mut out: Vec<String> = Vec::new();
    let mut say = |words: &[&str]| out.extend(words.iter().map(|&word| word.to_owned()));
    if truth {
        say(&["reference"])
    } else {
        say(&["render", side.technique])
    }
    scene(common, &mut say);
    say(&["--size", &common.size.to_string()]);
    match common.fly {
        Some(fly) => say(&["--camera", &fly.numbers()]),
        None => say(&["--camera", &common.camera.to_string()]),
    }
    if common.seconds != 0.0 {
        say(&["--time", &common.seconds.to_string()]);
    }
    let light = side.shows == Shows::Picture;
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
    if let Some((first, _)) = side.about.modes.first()
        && side.mode != *first
    {
        say(&[if truth { "--show" } else { "--mode" }, &side.mode]);
    }
    if truth {
        say(&["--spp", &side.samples.to_string()]);
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
    for change in panel::changes(&side.settings, &side.about.settings) {
        // The number of samples of a frame is for sequences of the path tracer.
        if !(truth && change.starts_with("samples=")) {
            say(&["-D", &change]);
        }
    }
    Some(out)
}

fn scene(common: &Common<'_>, say: &mut impl FnMut(&[&str])) {
    let StageArgs { scene, environment, light, sun, default_light, .. } = common.args;
    match common.source {
        Source::File(file) => say(&[file]),
        Source::Builtin(name) => say(&["--builtin", name]),
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
    for light in light {
        say(&["--light", &light.to_string()]);
    }
    if let Some(sun) = sun {
        say(&["--sun", &sun.to_string()]);
    }
    if *default_light != crate::default_light::DefaultLight::Auto {
        use clap::ValueEnum;
        if let Some(value) = default_light.to_possible_value() {
            say(&["--default-light", value.get_name()]);
        }
    }
}

/// Words as a shell reads them.
pub fn quoted(words: &[String]) -> String {
    let plain =
        |word: &str| !word.is_empty() && word.chars().all(|c| c.is_ascii_alphanumeric() || "-_./=,:+@%".contains(c));
    let quote = |word: &String| if plain(word) { word.clone() } else { format!("'{}'", word.replace('\'', r"'\''")) };
    words.iter().map(quote).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_quoted_where_a_shell_would_break_them() {
        let words = ["a.glb", "my scene.glb", "it's", "-D", "isr.samples=80", ""].map(str::to_owned);
        assert_eq!(quoted(&words), r"a.glb 'my scene.glb' 'it'\''s' -D isr.samples=80 ''");
    }
}
