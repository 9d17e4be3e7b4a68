//! Scenes made by code: no file to ship, the same every time, known in every number.
//!
//! ```
//! let scene = lucerna_scenes::load("cornell")?;
//! assert!(scene.cameras.len() >= 3);
//! # Ok::<(), lucerna::Error>(())
//! ```
//!
//! Texture coordinates are metres of surface in set 0. Solids are closed, wound counter-clockwise and have outward
//! normals. Each scene comes with the exposure ([`exposure`]) at which direct light with one bounce fills an 8-bit
//! picture well.

mod conference;
pub mod cornell;
mod environments;
mod figure;
pub mod furnace;
mod garage;
mod hall;
mod kit;
mod moving;
mod office;
mod parlour;
mod primitives;
mod shadows;
mod street;
mod teapot;
#[cfg(test)]
mod tests;

pub use environments::{ENVIRONMENTS, environment};

use lucerna::scene::Scene;
use lucerna::{Error, Result};

struct Entry {
    name: &'static str,
    description: &'static str,
    exposure: f32,
    build: fn() -> Scene,
}

const ENTRIES: &[Entry] = &[
    Entry {
        name: "cornell",
        description: "Cornell box by its published measurements; a spot light stands in for the area light",
        exposure: 2.0,
        build: cornell::build,
    },
    Entry {
        name: "cornell-area",
        description: "Cornell box by its published measurements, lit by its emissive rectangle",
        exposure: 2.0,
        build: cornell::build_area,
    },
    Entry {
        name: "furnace",
        description: "Closed box that emits and reflects evenly; every pixel tends to emission / (1 - albedo)",
        exposure: 1.0,
        build: furnace::build_box,
    },
    Entry {
        name: "furnace-sphere",
        description: "A sphere of albedo 0.5 under uniform light; it must show half that light",
        exposure: 1.0,
        build: furnace::build_sphere,
    },
    Entry {
        name: "primitives",
        description: "Coloured solids on a ground between two coloured walls, for colour bleeding",
        exposure: 0.0,
        build: primitives::build,
    },
    Entry {
        name: "teapot",
        description: "Utah teapot from its 32 Bezier patches, with cups on a table by coloured walls",
        exposure: 0.7,
        build: teapot::build,
    },
    Entry {
        name: "office",
        description: "Office for four: sun through blinds and a lamp, about 21 000 triangles",
        exposure: 1.3,
        build: office::build,
    },
    Entry {
        name: "conference",
        description: "Conference room for eighteen: four lamps, a mirror, chrome, glass, about 190 000 triangles",
        exposure: 0.3,
        build: conference::build,
    },
    Entry {
        name: "parlour",
        description: "Closed living room by one lamp, for light computed in advance: diffuse, a red and a green wall",
        exposure: 1.4,
        build: parlour::build,
    },
    Entry {
        name: "garage",
        description: "Garage with cars, racks and a workbench, its door open to daylight",
        exposure: 1.0,
        build: garage::build,
    },
    Entry {
        name: "hall",
        description: "Church-like hall: sun through eleven open windows, lamps, coloured cloth, about 190 000 triangles",
        exposure: 1.6,
        build: hall::build,
    },
    Entry {
        name: "street",
        description: "Western street: wooden buildings, hills, trees, grass and cacti, about 200 000 triangles",
        exposure: 0.5,
        build: street::build,
    },
    Entry {
        name: "figure",
        description: "Animated court: a walking skinned figure, a morphing sculpture, turning rings, a bouncing ball",
        exposure: 0.5,
        build: figure::build,
    },
    Entry {
        name: "shadows",
        description: "A hare, a tree and a chess queen on a ground under a grove; light from the environment alone",
        exposure: -0.8,
        build: shadows::build,
    },
    Entry {
        name: "shadows-moving",
        description: "Occluders that walk, tumble, change shape and sit still on a ground under a grove",
        exposure: -0.8,
        build: moving::build,
    },
];

/// Names of all built-in scenes.
pub const NAMES: &[&str] = &{
    let mut names = [""; ENTRIES.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = ENTRIES[i].name;
        i += 1;
    }
    names
};

/// Names of things that [`load`] makes too: one mesh without ground, light and camera, for [`lucerna::scene::ground::on_ground`].
pub const THINGS: &[&str] = &{
    let mut names = [""; shadows::THINGS.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = shadows::THINGS[i].name;
        i += 1;
    }
    names
};

/// One line about a built-in scene or thing, if there is one of this name.
pub fn description(name: &str) -> Option<&'static str> {
    let thing = || shadows::THINGS.iter().find(|thing| thing.name == name).map(|thing| thing.description);
    entry(name).map(|entry| entry.description).or_else(thing)
}

/// Exposure (stops, 2^EV on the radiance) that suits a built-in scene, if there is one of this name.
pub fn exposure(name: &str) -> Option<f32> {
    entry(name).map(|entry| entry.exposure)
}

/// Builds a scene, or a thing.
///
/// # Errors
/// [`lucerna::ErrorKind::Usage`] if there is no built-in scene of this name; the message lists those that exist and names
/// the nearest.
pub fn load(name: &str) -> Result<Scene> {
    if let Some(entry) = entry(name) {
        return Ok((entry.build)());
    }
    if let Some(thing) = shadows::thing(name) {
        return Ok(thing);
    }
    let list = [NAMES, THINGS].concat().join(", ");
    let nearest = NAMES.iter().chain(THINGS).map(|known| (distance(name, known), known)).min();
    let help = match nearest {
        Some((off, known)) if off <= 1 + known.len() / 3 => format!("Did you mean {known:?}? Built-in scenes: {list}"),
        _ => format!("Built-in scenes: {list}"),
    };
    Err(Error::usage(format!("there is no built-in scene {name:?}")).help(help))
}

fn entry(name: &str) -> Option<&'static Entry> {
    ENTRIES.iter().find(|entry| entry.name == name)
}

/// Levenshtein distance in characters, ASCII case ignored.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, to) in b.iter().enumerate() {
            let change = diagonal + usize::from(!from.eq_ignore_ascii_case(to));
            let best = change.min(row[j] + 1).min(row[j + 1] + 1);
            diagonal = std::mem::replace(&mut row[j + 1], best);
        }
    }
    row[b.len()]
}
