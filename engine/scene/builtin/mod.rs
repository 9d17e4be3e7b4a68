//! Scenes made by code: no file to ship, the same on every machine, known in every number.
//!
//! ```
//! let scene = lucerna::scene::builtin::build("cornell")?;
//! assert!(scene.cameras.len() >= 3);
//! # Ok::<(), lucerna::Error>(())
//! ```
//!
//! Lights are chosen so that direct light with one bounce is well exposed at EV 0. Texture coordinates are metres of
//! surface in set 0. Solids are closed, wound counter-clockwise and have outward normals.

pub mod cornell;
pub mod furnace;
mod kit;
mod primitives;
mod teapot;

use super::Scene;
use crate::{Error, Result};

struct Entry {
    name: &'static str,
    description: &'static str,
    build: fn() -> Scene,
}

const ENTRIES: &[Entry] = &[
    Entry {
        name: "cornell",
        description: "Cornell box with its published measurements and area light",
        build: cornell::build,
    },
    Entry {
        name: "cornell-spot",
        description: "Cornell box whose area light is replaced by a spot light of the same axial intensity",
        build: cornell::build_with_spot,
    },
    Entry {
        name: "furnace",
        description: "White furnace: a sphere of albedo 0.5 under uniform light; it must show half that light",
        build: furnace::build_sphere,
    },
    Entry {
        name: "furnace-box",
        description: "Closed box that emits and reflects evenly; every pixel tends to emission / (1 - albedo)",
        build: furnace::build_box,
    },
    Entry {
        name: "primitives",
        description: "Coloured solids on a ground between two coloured walls, for colour bleeding",
        build: primitives::build,
    },
    Entry {
        name: "teapot",
        description: "Utah teapot from its 32 Bezier patches, on a table by a coloured wall",
        build: teapot::build,
    },
];

/// Names of all built-in scenes.
pub fn names() -> &'static [&'static str] {
    const NAMES: [&str; ENTRIES.len()] = {
        let mut names = [""; ENTRIES.len()];
        let mut i = 0;
        while i < names.len() {
            names[i] = ENTRIES[i].name;
            i += 1;
        }
        names
    };
    &NAMES
}

/// One line about a built-in scene, if there is one of this name.
pub fn description(name: &str) -> Option<&'static str> {
    ENTRIES.iter().find(|entry| entry.name == name).map(|entry| entry.description)
}

/// Builds a scene.
///
/// # Errors
/// [`crate::ErrorKind::Usage`] if there is no built-in scene of this name; the message lists those that exist.
pub fn build(name: &str) -> Result<Scene> {
    match ENTRIES.iter().find(|entry| entry.name == name) {
        Some(entry) => Ok((entry.build)()),
        None => Err(Error::usage(format!("there is no built-in scene {name:?}"))
            .help(format!("Built-in scenes are: {}", names().join(", ")))),
    }
}
