//! The list of cameras that a person keeps, as a file that `--camera` and `--camera-path` read, and flights through them.

use std::path::{Path, PathBuf};

use egui::Ui;
use lucerna::{Error, ErrorKind, image};

use super::{app::Viewer, command::FPS, fly::Fly, keys};
use crate::{
    camera::CameraFile,
    path::{self, CameraPath},
    record::Source,
    views::{NamedView, ViewList},
};

/// Kept cameras.
#[derive(Debug)]
pub struct Cameras {
    list: Vec<NamedView>,
    /// There are changes that no file has.
    unsaved: bool,
    /// Time from each to the next of a flight, seconds.
    seconds: f64,
    /// Time of the flight that goes on.
    flight: Option<f64>,
}

impl Default for Cameras {
    fn default() -> Self {
        Self { list: Vec::new(), unsaved: false, seconds: path::SECONDS, flight: None }
    }
}

impl Cameras {
    /// Keeps a camera, and returns its name.
    pub fn keep(&mut self, fly: &Fly) -> String {
        let name = self.free();
        self.list.push(NamedView::recorded(name.clone(), &fly.file()));
        self.unsaved = true;
        name
    }

    /// Keeps the views of a path.
    pub fn keep_path(&mut self, path: &CameraPath) {
        for view in &path.views {
            let name = self.free();
            self.list.push(NamedView::recorded(name, view));
        }
        self.seconds = path.seconds;
    }

    /// The flight through all cameras; `None`: it takes two.
    fn path(&self) -> Option<CameraPath> {
        let path = CameraPath { views: self.list.iter().map(NamedView::camera).collect(), seconds: self.seconds };
        path.check().is_ok().then_some(path)
    }

    /// The camera of the flight after further `seconds`. `None`: none flies.
    pub fn fly_on(&mut self, seconds: f64) -> Option<CameraFile> {
        let now = self.flight? + seconds;
        let path = self.path();
        self.flight = path.as_ref().filter(|path| now < path.end()).map(|_| now);
        path.map(|path| path.at(now))
    }

    /// Begins a flight, or ends it.
    fn toggle(&mut self) {
        self.flight = if self.flight.is_some() { None } else { Some(0.0) };
    }

    /// Ends the flight.
    pub fn land(&mut self) {
        self.flight = None;
    }

    /// The first name that no camera has.
    fn free(&self) -> String {
        let taken = |name: &String| self.list.iter().any(|view| view.name == *name);
        (1..).map(|number| format!("view-{number:03}")).find(|name| !taken(name)).unwrap_or_default()
    }

    /// Adds the cameras of a file. Those whose names are taken get others.
    ///
    /// # Errors
    /// As [`ViewList::read`].
    pub fn read(&mut self, file: &Path) -> lucerna::Result<usize> {
        let list = ViewList::read(file)?.views;
        let count = list.len();
        self.unsaved |= !self.list.is_empty();
        for mut view in list {
            if self.list.iter().any(|kept| kept.name == view.name) {
                view.name = self.free();
            }
            self.list.push(view);
        }
        Ok(count)
    }

    /// Writes all cameras into a new file, and returns its name.
    ///
    /// # Errors
    /// `Output` if it cannot be written.
    pub fn write(&mut self, scene: &Source) -> lucerna::Result<PathBuf> {
        let name = match scene {
            Source::File(name) | Source::Builtin(name) => name.as_str(),
            Source::Terrain => "terrain",
        };
        let list = ViewList { scene: name.to_owned(), seed: 0, views: self.list.clone() };
        let text = toml::to_string(&list)
            .map_err(|error| Error::new(ErrorKind::Runtime, "the cameras are not TOML").caused_by(error))?;
        let stem =
            Path::new(name).file_stem().map_or_else(|| "scene".into(), |stem| stem.to_string_lossy().into_owned());
        let file = keys::free(&stem, "views", "toml");
        image::write_atomic(&file, text.as_bytes(), false)?;
        self.unsaved = false;
        Ok(file)
    }

    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }
}

/// Keeps the camera of the window.
pub fn keep(viewer: &mut Viewer) {
    if let Some(fly) = viewer.as_flying() {
        let name = viewer.cameras.keep(&fly);
        viewer.say(format!("kept {name}"));
    }
}

/// Begins a flight through the kept cameras, or ends it.
pub fn fly(viewer: &mut Viewer) {
    if viewer.cameras.path().is_none() {
        viewer.say("a flight takes two kept cameras (K)");
    } else {
        viewer.cameras.toggle();
    }
}

/// The list in the panel.
pub fn rows(viewer: &mut Viewer, ui: &mut Ui) {
    let (mut chosen, mut dropped) = (None, None);
    for (index, view) in viewer.cameras.list.iter().enumerate() {
        ui.horizontal(|ui| {
            if ui.selectable_label(false, &view.name).on_hover_text("Go there").clicked() {
                chosen = Some(view.camera());
            }
            if ui.small_button("✖").on_hover_text("Remove this camera").clicked() {
                dropped = Some(index);
            }
        });
    }
    if let Some(index) = dropped {
        viewer.cameras.list.remove(index);
    }
    if let Some(camera) = chosen {
        viewer.cameras.land();
        viewer.fly = Some(Fly::from_file(&camera));
        viewer.moves();
    }
    if viewer.cameras.is_empty() {
        return;
    }
    flight(viewer, ui);
    let name = if viewer.cameras.unsaved { "Write the list •" } else { "Write the list" };
    let button = ui
        .button(name)
        .on_hover_text("As a .toml file: --camera FILE#NAME renders one, and the file may be dropped here");
    if button.clicked()
        && let Some(stage) = viewer.stage.clone()
    {
        match viewer.cameras.write(&stage.source) {
            Ok(file) => viewer.say(format!("wrote {}", file.display())),
            Err(error) => viewer.trouble = Some(error.to_string()),
        }
    }
}

/// A flight through the list, and its pictures as files.
fn flight(viewer: &mut Viewer, ui: &mut Ui) {
    if viewer.cameras.path().is_none() {
        return;
    }
    ui.horizontal(|ui| {
        let cameras = &mut viewer.cameras;
        let button = ui.button(if cameras.flight.is_some() { "⏹ Fly" } else { "▶ Fly" });
        if button.on_hover_text("Fly through the cameras of the list (G)").clicked() {
            cameras.toggle();
        }
        let seconds = egui::DragValue::new(&mut cameras.seconds).speed(0.05).range(0.05..=600.0).suffix(" s");
        ui.add(seconds.clamp_existing_to_range(false)).on_hover_text("From each camera to the next");
        if viewer.writing.as_ref().is_some_and(|writing| writing.sequence) {
            if ui.button("⏹ Record").on_hover_text("Stop writing the sequence").clicked() {
                viewer.writing = None;
            }
            return;
        }
        let record = ui.button("Record").on_hover_text(format!(
            "Write the flight as .png files, {FPS} a second, by a command that is copied, too. It ends with the window"
        ));
        if record.clicked() {
            match recorded(viewer) {
                Ok(text) => ui.ctx().copy_text(text),
                Err(why) => viewer.say(format!("not written: {why}")),
            }
        }
    });
}

/// Writes the list of cameras, and has the command of side A write the pictures of the flight. Returns the command, or why there is none.
fn recorded(viewer: &mut Viewer) -> Result<String, String> {
    let words = keys::for_sequence(viewer)?;
    let (Some(path), Some(stage)) = (viewer.cameras.path(), viewer.stage.clone()) else {
        return Err("a flight takes a scene and two kept cameras".into());
    };
    let list = viewer.cameras.write(&stage.source).map_err(|error| error.to_string())?;
    let named = path::Named { list: list.display().to_string(), seconds: path.seconds };
    Ok(keys::sequence(viewer, words, &named.to_string(), frames(path.end())))
}

/// Frames of a flight that takes so long: the last one is at its end or later.
fn frames(seconds: f64) -> u32 {
    (seconds * FPS - 1e-6).max(0.0).ceil() as u32 + 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_the_first_that_are_free() {
        let fly = Fly::from_file(&crate::camera::in_numbers("0,1,2,0,0,0").unwrap().unwrap());
        let mut cameras = Cameras::default();
        assert_eq!([cameras.keep(&fly), cameras.keep(&fly)], ["view-001", "view-002"]);
        cameras.list.remove(0);
        assert_eq!(cameras.keep(&fly), "view-001");
        let found = Fly::from_file(&cameras.list[1].camera());
        assert!(found.file().position.abs_diff_eq(fly.file().position, 1e-6));
        assert!(found.target().abs_diff_eq(fly.target(), 1e-5));
    }

    #[test]
    fn a_flight_begins_at_the_first_camera_and_ends_at_the_last() {
        let fly = |text: &str| Fly::from_file(&crate::camera::in_numbers(text).unwrap().unwrap());
        let mut cameras = Cameras::default();
        cameras.keep(&fly("0,1,2,0,0,0"));
        assert!(cameras.path().is_none() && cameras.fly_on(0.1).is_none());
        cameras.keep(&fly("4,1,2,4,0,0"));
        cameras.flight = Some(0.0);
        let steps: Vec<f32> = std::iter::from_fn(|| cameras.fly_on(0.25)).map(|camera| camera.position.x).collect();
        assert!(steps.len() == 8 && steps.windows(2).all(|two| two[0] < two[1]), "{steps:?}");
        assert!((steps[7] - 4.0).abs() < 1e-5);
        assert_eq!([frames(2.0), frames(0.05), frames(0.2), frames(0.0)], [51, 3, 6, 1]);
        let mut again = Cameras::default();
        again.keep_path(&cameras.path().unwrap());
        assert_eq!(again.path(), cameras.path());
    }
}
