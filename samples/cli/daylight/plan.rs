//! The plan of a bake: the day, the surfaces, and their texels.

use std::{path::PathBuf, str::FromStr};

use glam::Vec3;
use lucerna::{
    Error, Result,
    gpu::Gpu,
    scene::{Aabb, Scene, View},
    techniques::daylight::{
        Adaptive, Backs, Baking, Calendar, Cells, Course, Day, Group, Kind, Lit, MOST_TIMES, NEXT_DAY, Plan, Sources,
        SunPath, SunPoint, Transport, Weather, adaptive, cube, digest, lamps,
        lightmap::{self, Corners},
        parts,
        probes::Grid,
    },
};
use serde::{Deserialize, Serialize};

use crate::{
    scene_bounds,
    stage::{Stage, StageArgs},
};

/// Least distance of a sun that is a point, in radii of the scene.
const NEAREST: f32 = 1.25;

/// The day and the place of a bake.
#[derive(clap::Args, Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DayOptions {
    /// Date of the day
    #[arg(long, value_name = "YYYY-MM-DD", default_value = "2026-06-21", help_heading = "Day")]
    pub date: String,

    /// Several days in one file, for seasons; `daylight render --date` chooses
    #[arg(long, value_name = "YYYY-MM-DD,…", value_delimiter = ',', conflicts_with = "date", help_heading = "Day")]
    #[serde(skip)]
    pub dates: Vec<String>,

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

    /// Path of the sun in place of date and place: columns `time,azimuth,elevation` or `time,x,y,z`, then perhaps `red,green,blue` (W/m²); or
    /// tables `[[sun]]` with `time`, `azimuth` and `elevation` or `direction`, and perhaps `irradiance`
    #[arg(
        long,
        value_name = "FILE.csv|.toml",
        conflicts_with_all = ["date", "dates", "latitude", "longitude", "timezone"],
        help_heading = "Day"
    )]
    #[serde(skip)]
    pub sun_path: Option<PathBuf>,

    /// The sun is a point that is so far from the middle of the scene, as in the paper: its direction is another one at each surface
    #[arg(long, value_name = "METRES", help_heading = "Day")]
    #[serde(skip)]
    pub sun_distance: Option<f32>,

    /// First local time that needs light
    #[arg(long, value_name = "HH:MM", help_heading = "Day")]
    #[serde(skip)]
    pub from: Option<String>,

    /// Last local time that needs light
    #[arg(long, value_name = "HH:MM", help_heading = "Day")]
    #[serde(skip)]
    pub until: Option<String>,

    /// Bake the lamps of this name as a group that can be switched: a light, its node, or an emissive material; `*` at an end stands for any
    /// text; may be given more than once. Without it all lamps are one group
    #[arg(long, value_name = "NAME", help_heading = "Bake")]
    #[serde(skip)]
    pub lamp: Vec<String>,

    /// Bake no lamps
    #[arg(long, conflicts_with = "lamp", help_heading = "Bake")]
    #[serde(skip)]
    pub no_lamps: bool,

    /// The box in which probes stand, two opposite corners in metres [default: the box around the scene]
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", allow_hyphen_values = true, help_heading = "Bake")]
    #[serde(skip)]
    pub probe_box: Option<BoxArg>,
}

impl DayOptions {
    /// # Errors
    /// `Usage` for an impossible day, `Input` for a file that cannot be read.
    fn calendar(&self, scene: &Scene) -> Result<(Calendar, Vec<Course>)> {
        let mut calendar = match &self.sun_path {
            Some(file) => {
                let path = SunPath::read(file)?;
                if self.north != 0.0 && !path.has_angles() {
                    let what = "--north turns azimuths, and the path of the sun has directions";
                    return Err(Error::usage(what).help("Leave --north out"));
                }
                Calendar { path: Some(path), north: self.north, ..Calendar::default() }
            }
            None => Calendar {
                date: self.dates.first().unwrap_or(&self.date).clone(),
                dates: self.dates.iter().skip(1).cloned().collect(),
                zone: self.timezone.clone(),
                latitude: self.latitude,
                longitude: self.longitude,
                north: self.north,
                ..Calendar::default()
            },
        };
        let courses = calendar.courses().map_err(Error::usage)?;
        calendar.point = self.sun_distance.map(|distance| point(scene, distance)).transpose()?;
        let spans = courses.iter().map(|course| self.span(course)).collect::<Result<Vec<_>>>()?;
        calendar.span = spans[0];
        if spans.iter().any(|span| *span != spans[0]) {
            let what = "--from and --until are different moments on days with and without a change of the clock";
            return Err(Error::usage(what).help("Bake these days apart, or the whole days"));
        }
        Ok((calendar, courses))
    }

    /// First and last time that needs light.
    fn span(&self, course: &Course) -> Result<Option<[f64; 2]>> {
        if self.from.is_none() && self.until.is_none() {
            return Ok(None);
        }
        let time = |name: &str, text: &Option<String>, other: f64| match text {
            Some(text) => course.parse_time(text).map_err(|what| Error::usage(what).at(name)),
            None => Ok(other),
        };
        let from = time("--from", &self.from, 0.0)?;
        let until = time("--until", &self.until, course.length())?;
        if from > until {
            let what = format!("--until {} is before --from {}", course.label(until), course.label(from));
            return Err(Error::usage(what).help("A bake is of one day; exchange them, or bake twice"));
        }
        Ok(Some([from, until]))
    }
}

/// A sun at a distance from the middle of the scene.
fn point(scene: &Scene, distance: f32) -> Result<SunPoint> {
    let bounds = scene_bounds::over_animations(scene)
        .ok_or_else(|| Error::input("the scene has no surfaces, so there is nothing to bake"))?;
    let least = NEAREST * bounds.half().length();
    if !(distance >= least && distance <= 1e9) {
        let what = format!("--sun-distance is {distance}, {least:.3} to 1000000000 m are allowed for this scene");
        return Err(Error::usage(what).help("The sun must be outside the scene"));
    }
    Ok(SunPoint { centre: bounds.centre().to_array(), distance })
}

/// The steps of a day that have light, of those within the span of the calendar and next to it.
fn lit(steps: &[f64], calendar: &Calendar, (day, course): (usize, &Course), baking: &Baking) -> Vec<Lit> {
    // A step more on each side, so that the light at the ends of the span is between two steps.
    let beside = 60.0 * baking.interval;
    let within =
        |seconds: f64| calendar.span.is_none_or(|[from, until]| from - beside < seconds && seconds < until + beside);
    let shining = steps.iter().filter(|seconds| within(**seconds)).map(|&seconds| (seconds, course.sun(seconds)));
    shining
        .filter(|(_, sun)| sun.is_lit())
        .map(|(seconds, sun)| Lit { seconds: seconds + NEXT_DAY * day as f64, sun: sun.direction })
        .collect()
}

/// A box: two opposite corners, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoxArg(Aabb);

impl FromStr for BoxArg {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let wrong = || "expected X,Y,Z,X,Y,Z: two opposite corners of a box that is not flat, metres".to_owned();
        let one = |word: &str| word.trim().parse().ok().filter(|number: &f32| number.is_finite());
        let numbers: Vec<f32> = text.split(',').map(|word| one(word).ok_or_else(wrong)).collect::<Result<_, _>>()?;
        let [a, b, c, d, e, f] = numbers[..] else { return Err(wrong()) };
        let (from, to) = (Vec3::new(a, b, c), Vec3::new(d, e, f));
        let around = Aabb { min: from.min(to), max: from.max(to) };
        if (around.max - around.min).min_element() > 0.0 { Ok(Self(around)) } else { Err(wrong()) }
    }
}

impl Default for DayOptions {
    /// The defaults of the options, without lamps.
    fn default() -> Self {
        Self {
            date: "2026-06-21".into(),
            latitude: 55.5,
            longitude: 10.0,
            timezone: "Europe/Copenhagen".into(),
            dates: Vec::new(),
            north: 0.0,
            sun_path: None,
            sun_distance: None,
            from: None,
            until: None,
            lamp: Vec::new(),
            no_lamps: true,
            probe_box: None,
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum KindArg {
    /// All surfaces, for a free camera
    // `atlas` is another common word for it.
    #[value(alias = "atlas")]
    Lightmap,
    /// The pixels of the camera, for this camera and size alone
    View,
    /// The surfaces around the camera, which turns in place: six faces of `bake.face` texels
    Cube,
}

/// The plan of a command line, and the texels.
pub struct Planned {
    pub plan: Plan,
    pub sources: Sources,
    pub corners: Corners,
    /// The lit backs of a lightmap, and the transport that the search has made.
    pub backs: Backs,
    pub notes: Vec<String>,
}

/// The surfaces of a bake, and their texels.
pub(super) struct Receivers {
    kind: Kind,
    extent: [u32; 2],
    sources: Sources,
    corners: Corners,
    backs: Backs,
    notes: Vec<String>,
}

impl Receivers {
    pub(super) fn of_view(camera: &str, view: &View) -> Self {
        let kind = Kind::View {
            camera: camera.to_owned(),
            view_from_world: view.view_from_world.to_cols_array(),
            clip_from_view: view.clip_from_view.to_cols_array(),
        };
        let sources = Sources::View(Box::new(*view));
        Self::of_pixels(kind, view.extent, sources)
    }

    fn around(camera: &str, view: &View, baking: &Baking) -> Result<Self> {
        if view.is_orthographic() {
            let what = format!("the camera {camera} has parallel rays, and one that turns in place needs perspective");
            return Err(Error::usage(what).help("Choose another one with --camera"));
        }
        let (position, near) = (view.position, view.near);
        let kind = Kind::Cube { camera: camera.to_owned(), position: position.to_array(), near };
        let sources = Sources::Cube(Box::new(cube::views(position, near, baking.face)));
        let extent = [cube::FACES * baking.face, baking.face];
        Ok(Self::of_pixels(kind, extent, sources))
    }

    fn of_pixels(kind: Kind, extent: [u32; 2], sources: Sources) -> Self {
        Self { kind, extent, sources, corners: Corners::default(), backs: Backs::none(), notes: Vec::new() }
    }

    fn of_lightmap(gpu: &Gpu, scene: &Scene, baking: &Baking, groups: &[Group]) -> Result<Self> {
        let backs = Backs::lit(gpu, scene, groups, baking)?;
        let unwrapped = lightmap::unwrap(scene, baking, backs.lit.as_deref())?;
        let corners = unwrapped.lightmap.corners.clone();
        let (covered, on_backs) = (unwrapped.receivers.len() as u64, unwrapped.on_backs());
        let kind = Kind::Lightmap { charts: unwrapped.charts, covered, backs: on_backs, corners: digest(&corners) };
        let extent = unwrapped.lightmap.extent;
        let side = if baking.tile == 0 { extent[0].max(extent[1]) } else { baking.tile };
        let sources = Sources::Lightmap(Box::new(unwrapped.by_tile(side.max(1))));
        let mut notes: Vec<String> = unwrapped.notes.iter().map(|note| format!("lightmap: {note}")).collect();
        if on_backs > 0 {
            notes.push(format!(
                "{on_backs} of {covered} texels are on the backs of two-sided surfaces; -D bake.backs=false leaves them out"
            ));
        }
        Ok(Self { kind, extent, sources, corners, backs, notes })
    }
}

/// Plans the bake of a scene.
///
/// # Errors
/// `Usage` for an impossible day or lightmap; `Input` if the scene has no surfaces.
pub fn plan(
    gpu: impl FnOnce() -> Result<Gpu>,
    options: &DayOptions,
    kind: KindArg,
    baking: &Baking,
    stage: &Stage,
    args: &StageArgs,
) -> Result<Planned> {
    planned(options, baking, &stage.scene, |groups| match kind {
        KindArg::View => {
            let (_, view) = stage.at(args.time, args.size)?;
            Ok(Receivers::of_view(&stage.placed.name, &view))
        }
        KindArg::Cube => {
            let (_, view) = stage.at(args.time, args.size)?;
            Receivers::around(&stage.placed.name, &view, baking)
        }
        KindArg::Lightmap => Receivers::of_lightmap(&gpu()?, &stage.scene, baking, groups),
    })
}

/// Plans the bake for a view: of its pixels, or so that the view is one of many.
///
/// # Errors
/// As `plan`.
pub fn for_view(
    gpu: &Gpu,
    options: &DayOptions,
    kind: KindArg,
    baking: &Baking,
    scene: &Scene,
    camera: &str,
    view: &View,
) -> Result<Planned> {
    planned(options, baking, scene, |groups| match kind {
        KindArg::View => Ok(Receivers::of_view(camera, view)),
        KindArg::Cube => Receivers::around(camera, view, baking),
        KindArg::Lightmap => Receivers::of_lightmap(gpu, scene, baking, groups),
    })
}

/// The plan for the surfaces that `receivers` makes for groups of lamps.
///
/// # Errors
/// As `plan`.
pub(super) fn planned(
    options: &DayOptions,
    baking: &Baking,
    scene: &Scene,
    receivers: impl FnOnce(&[Group]) -> Result<Receivers>,
) -> Result<Planned> {
    if lightmap::triangles(scene).iter().all(|count| *count == 0) {
        return Err(Error::input("the scene has no surfaces, so there is nothing to bake"));
    }
    let (calendar, courses) = options.calendar(scene)?;
    let (mut steps, mut times) = (0, Vec::new());
    for (day, course) in courses.iter().enumerate() {
        let of_day = course.steps(baking.interval, baking.offset).map_err(Error::usage)?;
        steps += of_day.len();
        if steps > MOST_TIMES {
            let days = match courses.len() {
                1 => "the day has".to_owned(),
                days => format!("{} of {days} days have", day + 1),
            };
            let what = format!("{days} {steps} steps, at most {MOST_TIMES} are allowed");
            return Err(Error::usage(what).at("bake.interval").help("Choose a longer interval"));
        }
        times.extend(lit(&of_day, &calendar, (day, course), baking));
    }
    let lamps = if options.no_lamps { Vec::new() } else { lamps::groups(scene, &options.lamp)? };
    let probes = match (baking.probes > 0.0, options.probe_box) {
        (true, given) => {
            let around = given.map(|corners| corners.0).or_else(|| Grid::around(scene, baking.probes));
            around.map(|around| Grid::new(&around, baking.probes, baking.most_probes))
        }
        (false, Some(_)) => {
            let error = Error::usage("a box for probes, and bake.probes is 0").at("--probe-box");
            return Err(error.help("Give a distance with -D bake.probes=1, or leave the box out"));
        }
        (false, None) => None,
    };
    // Where steps are left out, the number of times is known later.
    if baking.adaptive == Adaptive::Off {
        Cells::new(scene, baking, times.len())?;
    }
    let Receivers { kind, extent, sources, corners, backs, mut notes } = receivers(&lamps)?;
    if calendar.point.is_some() && baking.disc {
        notes.push("a sun at a distance is a point: bake.disc has no effect".into());
    }
    let plan = Plan {
        scene: scene.name.clone(),
        parts: parts(scene),
        receivers: kind,
        extent,
        probes,
        calendar,
        steps: steps as u32,
        times,
        weather: Weather::default(),
        lamps,
        settings: baking.clone(),
    };
    plan.check_whole()?;
    Ok(Planned { plan, sources, corners, backs, notes })
}

/// Leaves out the steps that interpolation replaces ([`adaptive`]), and says so in a line for the user; `None` if all steps are wanted.
///
/// # Errors
/// As [`Transport::sparse`].
pub fn thin_out(plan: &mut Plan, transport: &mut Transport) -> Result<Option<(String, serde_json::Value)>> {
    if plan.settings.adaptive == Adaptive::Off || plan.times.is_empty() {
        return Ok(None);
    }
    let seconds: Vec<f64> = plan.times.iter().map(|time| time.seconds).collect();
    let chosen = adaptive::choose(&transport.sparse(plan)?, &seconds, &plan.settings)?;
    let courses = plan.calendar.courses().map_err(Error::input)?;
    let worst = plan.times[chosen.worst_step];
    let worst = courses[worst.day()].label(worst.seconds % NEXT_DAY);
    plan.times = chosen.kept.iter().map(|step| plan.times[*step]).collect();
    transport.follow(plan)?;
    let said = format!(
        "{} of {} lit steps are needed; the worst of the others is off by {:.2} %, at {worst} (interpolated, by {} paths of few texels)",
        chosen.kept.len(),
        seconds.len(),
        100.0 * chosen.worst,
        plan.settings.samples.min(adaptive::SPARSE_PATHS),
    );
    let json = serde_json::json!({
        "lit": seconds.len(),
        "kept": chosen.kept.len(),
        "worst": chosen.worst,
        "worst_at": worst,
    });
    Ok(Some((said, json)))
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
        assert_eq!(Options::parse_from(["daylight", "--no-lamps"]).day, DayOptions::default());
    }
}
