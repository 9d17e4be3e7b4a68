//! The plan of a bake: the day, the surfaces, and their texels.

use lucerna::{
    Error, Result,
    scene::Scene,
    techniques::daylight::{
        Baking, Calendar, Day, Kind, Lit, MOST_TIMES, Plan, Sources, Weather, digest, lightmap, parts,
    },
};

use crate::stage::{Stage, StageArgs};

/// Elevation at which the sun has set: its radius below the horizon, degrees.
const SET: f64 = -0.2665;

/// The day and the place of a bake.
#[derive(clap::Args, Clone, Debug)]
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

/// Plans the bake of a scene.
///
/// # Errors
/// `Usage` for an impossible day or lightmap; `Input` if the scene has no surfaces.
pub fn plan(options: &DayOptions, kind: KindArg, baking: &Baking, stage: &Stage, args: &StageArgs) -> Result<Planned> {
    let day = Day::new(&options.date, &options.timezone, options.latitude, options.longitude).map_err(Error::usage)?;
    let steps = day.steps(baking.interval, baking.offset).map_err(Error::usage)?;
    if steps.len() > MOST_TIMES {
        let what = format!("the day has {} steps, at most {MOST_TIMES} are allowed", steps.len());
        return Err(Error::usage(what).at("bake.interval").help("Choose a longer interval"));
    }
    let lit = steps.iter().filter(|seconds| day.sun(**seconds).elevation > SET);
    let times = lit.map(|&seconds| Lit { seconds, sun: day.sun(seconds).direction(options.north) }).collect();
    let scene: &Scene = &stage.scene;
    if scene.meshes.is_empty() {
        return Err(Error::input("the scene has no surfaces, so there is nothing to bake"));
    }
    let (receivers, extent, sources, corners, notes) = match kind {
        KindArg::View => {
            let (_, view) = stage.at(args.time, args.size)?;
            let receivers = Kind::View {
                camera: stage.placed.name.clone(),
                view_from_world: view.view_from_world.to_cols_array(),
                clip_from_view: view.clip_from_view.to_cols_array(),
            };
            (receivers, view.extent, Sources::View(Box::new(view)), Vec::new(), Vec::new())
        }
        KindArg::Lightmap => {
            let unwrapped = lightmap::unwrap(scene, baking)?;
            let corners = unwrapped.lightmap.corners.clone();
            let receivers = Kind::Lightmap {
                charts: unwrapped.charts,
                covered: unwrapped.receivers.len() as u64,
                corners: digest(&corners),
            };
            let extent = unwrapped.lightmap.extent;
            let side = if baking.tile == 0 { extent[0].max(extent[1]) } else { baking.tile };
            let sources = Sources::Lightmap(unwrapped.by_tile(side.max(1)));
            (receivers, extent, sources, corners, unwrapped.notes)
        }
    };
    let plan = Plan {
        scene: scene.name.clone(),
        parts: parts(scene),
        receivers,
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
    plan.check_whole()?;
    Ok(Planned { plan, sources, corners, notes })
}
