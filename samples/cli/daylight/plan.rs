//! The plan of a bake: the day, the surfaces, and their texels.

use lucerna::{
    Error, Result,
    scene::{Scene, View},
    techniques::daylight::{
        Baking, Calendar, Day, Kind, Lit, MOST_TIMES, Plan, Sources, Weather, digest, lightmap, parts,
    },
};
use serde::{Deserialize, Serialize};

use crate::stage::{Stage, StageArgs};

/// Elevation at which the sun has set: its radius below the horizon, degrees.
const SET: f64 = -0.2665;

/// The day and the place of a bake.
#[derive(clap::Args, Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DayOptions {
    /// Date of the day
    #[arg(long, value_name = "YYYY-MM-DD", default_value = "2026-06-21", help_heading = "Day")]
    pub date: String,

    /// Degrees, positive in the north
    #[arg(long, value_name = "DEGREES", default_value_t = 55.5, allow_negative_numbers = true, help_heading = "Day")]
    pub latitude: f64,

    /// Degrees, positive in the east
    #[arg(long, value_name = "DEGREES", default_value_t = 10.0, allow_negative_numbers = true, help_heading = "Day")]
    pub longitude: f64,

    /// Time zone: a name, or an offset such as +01:00
    #[arg(long, value_name = "ZONE", default_value = "Europe/Copenhagen", help_heading = "Day")]
    pub timezone: String,

    /// Turn of the north from -Z, degrees, clockwise as seen from above
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true, help_heading = "Day")]
    pub north: f32,
}

impl Default for DayOptions {
    /// The defaults of the options.
    fn default() -> Self {
        Self {
            date: "2026-06-21".into(),
            latitude: 55.5,
            longitude: 10.0,
            timezone: "Europe/Copenhagen".into(),
            north: 0.0,
        }
    }
}

impl DayOptions {
    /// The civil day.
    ///
    /// # Errors
    /// `Usage` for an impossible date, zone or place.
    pub fn day(&self) -> Result<Day> {
        Day::new(&self.date, &self.timezone, self.latitude, self.longitude).map_err(Error::usage)
    }
}

/// The surfaces that a bake holds light for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum KindArg {
    /// All surfaces, for a free camera
    Lightmap,
    /// The pixels of the camera, for this camera and size alone
    View,
}

/// The plan of a command line, and the texels.
pub struct Planned {
    pub plan: Plan,
    pub sources: Sources,
    pub corners: Vec<[u16; 6]>,
    pub notes: Vec<String>,
}

/// The surfaces of a bake, and their texels.
struct Receivers {
    kind: Kind,
    extent: [u32; 2],
    sources: Sources,
    corners: Vec<[u16; 6]>,
    notes: Vec<String>,
}

impl Receivers {
    fn of_view(camera: &str, view: &View) -> Self {
        let kind = Kind::View {
            camera: camera.to_owned(),
            view_from_world: view.view_from_world.to_cols_array(),
            clip_from_view: view.clip_from_view.to_cols_array(),
        };
        let sources = Sources::View(Box::new(*view));
        Self { kind, extent: view.extent, sources, corners: Vec::new(), notes: Vec::new() }
    }

    fn of_lightmap(scene: &Scene, baking: &Baking) -> Result<Self> {
        let unwrapped = lightmap::unwrap(scene, baking)?;
        let corners = unwrapped.lightmap.corners.clone();
        let kind = Kind::Lightmap {
            charts: unwrapped.charts,
            covered: unwrapped.receivers.len() as u64,
            corners: digest(&corners),
        };
        let sources = Sources::Lightmap(unwrapped.by_tile(baking.tile));
        Ok(Self { kind, extent: unwrapped.lightmap.extent, sources, corners, notes: unwrapped.notes })
    }
}

/// Plans the bake of a scene.
///
/// # Errors
/// `Usage` for an impossible day or lightmap; `Input` if the scene has no surfaces.
pub fn plan(options: &DayOptions, kind: KindArg, baking: &Baking, stage: &Stage, args: &StageArgs) -> Result<Planned> {
    planned(options, baking, &stage.scene, || match kind {
        KindArg::View => {
            let (_, view) = stage.at(args.time, args.size)?;
            Ok(Receivers::of_view(&stage.placed.name, &view))
        }
        KindArg::Lightmap => Receivers::of_lightmap(&stage.scene, baking),
    })
}

/// Plans the bake of the pixels of a view.
///
/// # Errors
/// As [`plan`].
pub fn of_view(options: &DayOptions, baking: &Baking, scene: &Scene, camera: &str, view: &View) -> Result<Planned> {
    planned(options, baking, scene, || Ok(Receivers::of_view(camera, view)))
}

fn planned(
    options: &DayOptions,
    baking: &Baking,
    scene: &Scene,
    receivers: impl FnOnce() -> Result<Receivers>,
) -> Result<Planned> {
    let day = options.day()?;
    let steps = day.steps(baking.interval, baking.offset).map_err(Error::usage)?;
    if steps.len() > MOST_TIMES {
        let what = format!("the day has {} steps, at most {MOST_TIMES} are allowed", steps.len());
        return Err(Error::usage(what).at("bake.interval").help("Choose a longer interval"));
    }
    let lit = steps.iter().filter(|seconds| day.sun(**seconds).elevation > SET);
    let times = lit.map(|&seconds| Lit { seconds, sun: day.sun(seconds).direction(options.north) }).collect();
    if scene.meshes.is_empty() {
        return Err(Error::input("the scene has no surfaces, so there is nothing to bake"));
    }
    let Receivers { kind, extent, sources, corners, notes } = receivers()?;
    let plan = Plan {
        scene: scene.name.clone(),
        parts: parts(scene),
        receivers: kind,
        extent,
        calendar: Calendar {
            date: options.date.clone(),
            zone: options.timezone.clone(),
            latitude: options.latitude,
            longitude: options.longitude,
            north: options.north,
        },
        steps: steps.len() as u32,
        times,
        weather: Weather::default(),
        settings: baking.clone(),
    };
    Ok(Planned { plan, sources, corners, notes })
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Options {
        #[command(flatten)]
        day: DayOptions,
    }

    #[test]
    fn the_defaults_are_those_of_the_options() {
        assert_eq!(Options::parse_from(["daylight"]).day, DayOptions::default());
    }
}
