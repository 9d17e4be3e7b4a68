//! The list of cameras that a person keeps, as a file that `--camera` reads.

use std::path::{Path, PathBuf};

use egui::Ui;
use lucerna::{Error, ErrorKind, Result, image};

use super::{app::Viewer, fly::Fly, keys};
use crate::{
    record::Source,
    views::{NamedView, ViewList},
};

/// Kept cameras.
#[derive(Debug, Default)]
pub struct Cameras {
    list: Vec<NamedView>,
    /// There are changes that no file has.
    unsaved: bool,
}

impl Cameras {
    /// Keeps a camera, and returns its name.
    pub fn keep(&mut self, fly: &Fly) -> String {
        let name = self.free();
        self.list.push(NamedView::recorded(name.clone(), &fly.file()));
        self.unsaved = true;
        name
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
    pub fn read(&mut self, file: &Path) -> Result<usize> {
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
    pub fn write(&mut self, scene: &Source) -> Result<PathBuf> {
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
        viewer.fly = Some(Fly::from_file(&camera));
        viewer.moves();
    }
    if viewer.cameras.is_empty() {
        return;
    }
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
}
