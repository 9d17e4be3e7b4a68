//! Keys, and the page that explains them.

use std::{
    path::PathBuf,
    process::{Command, Stdio},
    sync::Arc,
};

use egui::{Context, Key, Modifiers};
use glam::Vec3;
use serde_json::json;

use super::{
    app::{Compare, Viewer, Writing},
    cameras,
    command::{self, Common},
    text,
};
use crate::shell;

/// What keys and the mouse do.
pub const HELP: [(&str, &str); 27] = [
    ("Drag", "look around; on a lamp: move the lamp; on the line: move the line"),
    ("Alt drag, middle drag", "orbit around the point in the middle of the picture"),
    ("Shift drag", "pan: move parallel to the picture"),
    ("Wheel", "dolly in and out; with Ctrl: speed of flying"),
    ("Double click", "turn to the surface under the mouse"),
    ("W A S D, Q E", "fly; with Shift: four times as fast"),
    ("R", "back to the scene's camera, and lamps to their places"),
    ("N", "the scene's next camera"),
    ("K", "keep the camera in the list of cameras"),
    ("G", "fly through the cameras of the list, or stop"),
    ("Enter", "play or stop the animation"),
    ("C", "the next way to compare A and B"),
    ("Space", "B, as long as it is held"),
    ("Z", "exchange A and B"),
    ("X", "false colour"),
    ("+ −, 0", "exposure up and down by half a stop; automatic exposure"),
    ("P, Shift P", "write the picture of A as .png, as .exr"),
    ("Ctrl C", "copy the command that makes the picture of A"),
    ("Ctrl R", "read the scene again"),
    ("Tab", "show or hide the panels"),
    ("F1", "this page"),
    ("F2", "isr, with exponential shadow maps"),
    ("F3", "isr"),
    ("F4", "direct light, with exponential shadow maps"),
    ("F5", "direct light"),
    ("F10", "the path tracer"),
    ("F6 … F9, F11, F12", "switches of the post-processing pipeline, as its file names them (--effects)"),
];

/// Seconds of a frame at most, for flying: after a pause the camera must not jump.
const LONGEST: f32 = 0.1;

/// Acts on the keys of a frame.
pub fn pressed(viewer: &mut Viewer, context: &Context) {
    // A key that is held repeats, and a desktop's own keys come with Alt.
    let hit = |key: Key| {
        context.input(|input| {
            input.events.iter().any(|event| {
                matches!(event, egui::Event::Key { key: of, pressed: true, repeat: false, modifiers, .. }
                    if *of == key && !modifiers.alt && !modifiers.command && !modifiers.shift)
            })
        })
    };
    if hit(Key::F1) {
        viewer.help = !viewer.help;
    }
    if hit(Key::Tab) {
        viewer.panels = !viewer.panels;
        // Tab would give the keyboard to the first widget.
        context.memory_mut(|memory| memory.move_focus(egui::FocusDirection::None));
    }
    // Keys are for the picture, unless text is edited.
    if let Some(id) = context.memory(|memory| memory.focused()) {
        if egui::TextEdit::load_state(context, id).is_some() {
            viewer.flipped = false;
            return;
        }
        // Space and Enter would press a button that has the keyboard.
        context.memory_mut(|memory| memory.surrender_focus(id));
    }
    if viewer.help && hit(Key::Escape) {
        viewer.help = false;
    }
    // Copying is an event of its own.
    let copies = context.input(|input| input.events.iter().any(|event| matches!(event, egui::Event::Copy)));
    if copies {
        copy(viewer, context);
    }
    if context.input_mut(|input| input.consume_key(Modifiers::COMMAND, Key::R)) {
        let args = viewer.newest_args();
        viewer.read(args);
    }
    if context.input_mut(|input| input.consume_key(Modifiers::SHIFT, Key::P)) {
        screenshot(viewer, "exr");
    }
    if hit(Key::P) {
        screenshot(viewer, "png");
    }
    if hit(Key::C) {
        let at = Compare::ALL.iter().position(|(compare, _)| *compare == viewer.compare).unwrap_or(0);
        viewer.compare = Compare::ALL[(at + 1) % Compare::ALL.len()].0;
    }
    if hit(Key::Z) {
        viewer.sides.swap(0, 1);
        viewer.followed_side = 1 - viewer.followed_side;
    }
    if hit(Key::X) {
        viewer.false_colour = !viewer.false_colour;
    }
    if hit(Key::R) {
        viewer.cameras.land();
        viewer.fly = None;
        viewer.moved.clear();
        viewer.moves();
    }
    if hit(Key::N)
        && let Some(stage) = &viewer.stage
        && !stage.scene.cameras.is_empty()
    {
        let next =
            if viewer.fly.is_some() || viewer.named_camera.is_some() { viewer.camera } else { viewer.camera + 1 };
        viewer.camera = next % stage.scene.cameras.len();
        viewer.cameras.land();
        (viewer.fly, viewer.named_camera) = (None, None);
    }
    if hit(Key::K) {
        cameras::keep(viewer);
    }
    if hit(Key::G) {
        cameras::fly(viewer);
    }
    if hit(Key::Enter) {
        viewer.playing = !viewer.playing;
    }
    // On many keyboards the plus needs Shift.
    let plus = context.input_mut(|input| input.consume_key(Modifiers::SHIFT, Key::Plus));
    let brighter = plus || hit(Key::Plus) || hit(Key::Equals);
    if brighter {
        viewer.exposure = Some(viewer.ev() + 0.5);
    }
    if hit(Key::Minus) {
        viewer.exposure = Some(viewer.ev() - 0.5);
    }
    if hit(Key::Num0) {
        viewer.exposure = None;
    }
    viewer.flipped = context.input(|input| input.key_down(Key::Space));
    for (key, mode, shadow) in [
        (Key::F2, "isr", "exponential"),
        (Key::F3, "isr", "pcf"),
        (Key::F4, "direct", "exponential"),
        (Key::F5, "direct", "pcf"),
    ] {
        if hit(key) {
            let side = &mut viewer.sides[0];
            if side.technique != "isr" {
                side.start_with("isr");
            }
            side.mode = mode.to_owned();
            let mut settings = (*side.settings).clone();
            settings["shadow"]["kind"] = json!(shadow);
            side.settings = Arc::new(settings);
            viewer.named = true;
        }
    }
    for (key, name) in
        [(Key::F6, "F6"), (Key::F7, "F7"), (Key::F8, "F8"), (Key::F9, "F9"), (Key::F11, "F11"), (Key::F12, "F12")]
    {
        if hit(key) && !text::switched(viewer, name) {
            viewer.say(format!(
                "{name} is a key of post-processing pipelines, but none has it: drop one on the window, or begin with --effects"
            ));
        }
    }
    if hit(Key::F10) {
        viewer.sides[0].start_with(super::wanted::TRUTH);
        viewer.named = true;
    }
    flies(viewer, context);
}

fn flies(viewer: &mut Viewer, context: &Context) {
    let (way, fast, seconds) = context.input(|input| {
        if input.modifiers.command || input.modifiers.ctrl {
            return (Vec3::ZERO, false, 0.0);
        }
        let along = |more: Key, less: Key| f32::from(input.key_down(more)) - f32::from(input.key_down(less));
        let way = Vec3::new(along(Key::D, Key::A), along(Key::E, Key::Q), along(Key::W, Key::S));
        (way, input.modifiers.shift, input.stable_dt.min(LONGEST))
    });
    if way == Vec3::ZERO {
        return;
    }
    if let Some(fly) = viewer.flying() {
        fly.fly(way, seconds * if fast { 4.0 } else { 1.0 });
        viewer.moves();
        context.request_repaint();
    }
}

/// The command of side A, or why there is none.
fn words(viewer: &Viewer) -> Result<Vec<String>, String> {
    let Some(stage) = &viewer.stage else { return Err("there is no scene".into()) };
    let common = Common {
        args: &viewer.args,
        source: &stage.source,
        fly: viewer.fly.as_ref(),
        camera: viewer.camera,
        named_camera: viewer.named_camera.as_ref().map(|(_, words)| words.as_str()),
        device: viewer.device.as_deref(),
        moved: &viewer.moved,
        scene: &stage.scene,
        default_light: stage.default_light,
        size: viewer.size_of_side(),
        seconds: viewer.seconds,
        exposure: viewer.ev(),
        look: viewer.look(),
    };
    command::words(&common, &viewer.sides[0])
        .ok_or_else(|| "no command makes this picture: it shows a file, a layer or false colour".into())
}

/// Copies the command of side A.
pub fn copy(viewer: &mut Viewer, context: &Context) {
    match words(viewer) {
        Ok(words) => {
            let text = format!("lucerna {}", shell::line(&words));
            context.copy_text(text.clone());
            viewer.say(format!("copied: {text}"));
        }
        Err(why) => viewer.say(format!("not copied: {why}")),
    }
}

/// Writes the picture of side A by its command, in another process, so that the file has the metadata and the bytes of `render`.
pub fn screenshot(viewer: &mut Viewer, extension: &str) {
    if viewer.writing.is_some() {
        viewer.say("a picture is being written already");
        return;
    }
    let words = match words(viewer) {
        Ok(words) => words,
        Err(why) => {
            viewer.say(format!("not written: {why}"));
            return;
        }
    };
    let file = free(&stem(viewer), viewer.sides[0].technique, extension);
    write(viewer, words, file, false);
}

/// The command of side A for a sequence, or why there is none.
pub fn for_sequence(viewer: &Viewer) -> Result<Vec<String>, String> {
    if viewer.writing.is_some() {
        return Err("a picture is being written already".into());
    }
    let words = words(viewer)?;
    if words.first().is_some_and(|word| word == "render") {
        Ok(words)
    } else {
        Err("the path tracer writes single pictures; choose another technique for side A".into())
    }
}

/// Has a command of [`for_sequence`] write the pictures of a camera that flies along `path`, and returns the whole command.
pub fn sequence(viewer: &mut Viewer, words: Vec<String>, path: &str, frames: u32) -> String {
    let words = command::on_path(words, path, frames);
    let stem = stem(viewer);
    let name = |number: u32, frame: &str| PathBuf::from(format!("{stem}-flight-{number:03}-{frame}.png"));
    let free = (1..10_000).find(|&number| !name(number, "0000").exists()).unwrap_or(10_000);
    let file = name(free, "{frame:04}");
    let output = ["-o".to_owned(), file.display().to_string()];
    let text = format!("lucerna {}", shell::line([&words[..], &output].concat()));
    write(viewer, words, file, true);
    text
}

fn stem(viewer: &Viewer) -> String {
    let name = viewer.stage.as_ref().map_or_else(|| "scene".to_owned(), |stage| stage.scene.name.clone());
    name.chars().map(|c| if c.is_alphanumeric() || "-_".contains(c) { c } else { '_' }).collect()
}

/// Starts a command that writes a file, or a sequence of files.
fn write(viewer: &mut Viewer, words: Vec<String>, file: PathBuf, sequence: bool) {
    let started = tempfile::tempfile().and_then(|said| {
        let mut command = Command::new(std::env::current_exe()?);
        command.args(words).arg("-q").arg("-o").arg(&file).stdout(Stdio::null()).stderr(said.try_clone()?);
        Ok((command.spawn()?, said))
    });
    match started {
        Ok((child, said)) => {
            viewer.say(format!("writing {}", file.display()));
            viewer.writing = Some(Writing { file, child, said, sequence });
        }
        Err(error) => viewer.trouble = Some(format!("the picture could not be written: {error}")),
    }
}

/// The first name that no file has.
pub fn free(scene: &str, what: &str, extension: &str) -> PathBuf {
    let name = |number: u32| PathBuf::from(format!("{scene}-{what}-{number:03}.{extension}"));
    (1..10_000).map(name).find(|file| !file.exists()).unwrap_or_else(|| name(10_000))
}

/// The page of keys.
pub fn help(viewer: &mut Viewer, context: &Context) {
    let mut open = viewer.help;
    egui::Window::new("Keys and mouse")
        .open(&mut open)
        .resizable(false)
        .collapsible(false)
        .anchor(egui::Align2::CENTER_CENTER, [0.0, 0.0])
        .show(context, |ui| {
            egui::Grid::new("keys").num_columns(2).spacing([24.0, 5.0]).show(ui, |ui| {
                for (key, what) in HELP {
                    ui.strong(key);
                    ui.label(what);
                    ui.end_row();
                }
            });
        });
    viewer.help = open;
}
