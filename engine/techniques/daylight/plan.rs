//! All that decides the bytes of a bake: scene, receivers, times, settings.

use glam::{Mat4, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::{Adaptive, Baking, Comparison, Course, SunPath, Weather, cube, lightmap::Corners, probes::Grid};
use crate::{
    Error, ErrorKind, Result,
    bake::{Digest, Part},
    scene::{LightKind, Scene, View, cull::Aabb},
    shaders::{
        consts::{self, DAY_VERTICES, SKY_PATCHES},
        types,
    },
};

/// Times of a bake at most.
pub const MOST_TIMES: usize = 4096;
/// Days of a bake at most.
pub const MOST_DAYS: usize = 366;
/// From the begin of a day of a bake to that of the next one in its list of times, seconds. No day is as long.
pub const NEXT_DAY: f64 = 172_800.0;
/// Texels of a bake at most.
pub const MOST_TEXELS: u64 = 1 << 28;

/// Texels times times of a bake with one tile at most: a device has to hold 24 bytes for each, and every device allows buffers of 128 MiB.
pub const MOST_WHOLE: u64 = (128 << 20) / 24;

/// The surfaces that a bake holds light for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Kind {
    /// The surfaces that one camera sees at the centres of its pixels.
    View {
        /// Name of the camera, for messages.
        camera: String,
        /// Column after column.
        view_from_world: [f32; 16],
        /// Column after column.
        clip_from_view: [f32; 16],
    },
    /// All surfaces: a lightmap for a free camera.
    Lightmap {
        charts: u32,
        /// Texels on surfaces, those included that are left out because they are inside of solids.
        covered: u64,
        /// Those on backs of two-sided surfaces.
        backs: u64,
        /// Digest of the corners of all triangles.
        corners: Digest,
    },
    /// The surfaces around one point: six faces beside each other, for a camera that turns in place ([`super::cube`]).
    Cube {
        /// Name of the camera, for messages.
        camera: String,
        /// Metres.
        position: [f32; 3],
        /// Nearest distance along the axis of a face that is seen, metres.
        near: f32,
    },
}

/// The days and the place of a bake.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Calendar {
    /// Year, month and day: `2026-06-21`.
    pub date: String,
    /// Further days of the same place.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub dates: Vec<String>,
    /// Name of the time zone, or its offset: `Europe/Copenhagen`, `+01:00`.
    pub zone: String,
    /// Degrees, positive in the north.
    pub latitude: f64,
    /// Degrees, positive in the east.
    pub longitude: f64,
    /// Degrees from -Z to the north, clockwise as seen from above.
    pub north: f32,
    /// A path from a file. Date, zone and place are then empty.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub path: Option<SunPath>,
    /// The sun is a point near the scene.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point: Option<SunPoint>,
    /// First and last moment for which the bake has light, seconds after the begin of the day; `None`: the whole day.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub span: Option<[f64; 2]>,
}

/// A sun at a distance, as in the paper (section 3.1): a point light on a sphere around the scene. The paper does not say how its light falls
/// off. Here it falls off with the square of the distance, and it has the irradiance of the sun at the centre of the sphere.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SunPoint {
    /// Metres.
    pub centre: [f32; 3],
    /// From the centre, metres.
    pub distance: f32,
}

impl SunPoint {
    /// The place of the sun in a unit direction from the centre, metres.
    pub fn position(&self, sun: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|i| self.centre[i] + self.distance * sun[i])
    }
}

impl Calendar {
    /// The dates of all days.
    pub fn dates(&self) -> impl Iterator<Item = &str> {
        std::iter::once(&self.date).chain(&self.dates).map(String::as_str)
    }

    /// The courses of the sun of all days, in order.
    ///
    /// # Errors
    /// A sentence that says what is impossible.
    pub fn courses(&self) -> Result<Vec<Course>, String> {
        if self.dates.len() >= MOST_DAYS {
            return Err(format!("{} days, at most {MOST_DAYS} are allowed", self.dates.len() + 1));
        }
        if let Some(path) = &self.path {
            return match self.dates.is_empty() {
                true => Ok(vec![Course::path(path, self.north)?]),
                false => Err("a path of the sun and further days".into()),
            };
        }
        let mut courses = Vec::new();
        for (number, date) in self.dates().enumerate() {
            if self.dates().take(number).any(|other| other == date) {
                return Err(format!("the date {date} is there twice"));
            }
            courses.push(Course::almanac(date, self)?);
        }
        Ok(courses)
    }

    /// The sun as a light: `sun` is the unit vector towards it, `light` its irradiance at normal incidence (at a distance: at the centre of its
    /// path), W/m². `bounds`: of everything that it lights.
    pub(super) fn light(&self, sun: Vec3, light: [f32; 3], bounds: &Aabb) -> types::Light {
        let directional = types::Light {
            kind: consts::LIGHT_DIRECTIONAL,
            direction: (-sun).to_array(),
            intensity: light,
            spot_offset: 1.0,
            ..types::Light::default()
        };
        let Some(point) = self.point else { return directional };
        let position = Vec3::from(point.position(sun.to_array()));
        // A spot light that lights everything evenly: its one shadow map has more texels on the scene than those of a light to all sides.
        let cosine = |corner: Vec3| (corner - position).normalize_or(-sun).dot(-sun);
        let least = bounds.corners().into_iter().map(cosine).fold(1.0, f32::min);
        let (inner, outer) = (least - 1e-4, (1.05 * least.clamp(-1.0, 1.0).acos() + 0.02).min(3.0).cos());
        let scale = 1.0 / (inner - outer).max(1e-4);
        types::Light {
            kind: consts::LIGHT_SPOT,
            position: position.to_array(),
            intensity: light.map(|channel| channel * point.distance * point.distance),
            spot_scale: scale,
            spot_offset: -outer * scale,
            ..directional
        }
    }
}

/// A time of the day at which the sun shines.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lit {
    /// Seconds after the begin of the day, and [`NEXT_DAY`] for each day of the bake before it.
    pub seconds: f64,
    /// Unit vector towards the sun.
    pub sun: [f32; 3],
}

/// Lamps that are switched together: point and spot lights, and emissive surfaces.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Group {
    pub name: String,
    /// Numbers of lights of the scene.
    pub lights: Vec<u32>,
    /// Numbers of emissive materials.
    pub materials: Vec<u32>,
}

impl Lit {
    /// Number of its day.
    pub fn day(&self) -> usize {
        (self.seconds / NEXT_DAY).max(0.0) as usize
    }
}

/// The plan of a bake.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Name of the scene, for messages.
    pub scene: String,
    /// Digests of the parts of the scene that decide the light.
    pub parts: Vec<Part>,
    pub receivers: Kind,
    /// Columns and rows of texels.
    pub extent: [u32; 2],
    /// `None`: no probes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub probes: Option<Grid>,
    pub calendar: Calendar,
    /// Steps of the day, seconds: as asked for, with the dark ones.
    pub steps: u32,
    /// The lit steps, in order.
    pub times: Vec<Lit>,
    /// The weather whose skies are within the tolerance, beside those of the clearest and the haziest air and overcast ones.
    pub weather: Weather,
    /// Groups of lamps, which can be switched.
    pub lamps: Vec<Group>,
    pub settings: Baking,
}

impl Plan {
    /// Columns and rows of tiles.
    pub fn tiles(&self) -> [u32; 2] {
        self.extent.map(|texels| texels.div_ceil(self.side()))
    }

    /// Side of a tile, texels.
    pub fn side(&self) -> u32 {
        match self.settings.tile {
            0 => self.extent[0].max(self.extent[1]).max(1),
            side => side,
        }
    }

    /// The texels of a tile: column, row, columns, rows.
    pub fn tile(&self, index: u32) -> [u32; 4] {
        let side = self.side();
        let columns = self.tiles()[0].max(1);
        let corner = [index % columns * side, index / columns * side];
        let size = [0, 1].map(|axis| side.min(self.extent[axis].saturating_sub(corner[axis])));
        [corner[0], corner[1], size[0], size[1]]
    }

    /// Columns and rows, in the whole bake, of the texels of a tile whose bits in its mask are set, in the order of their light.
    pub fn covered(&self, index: u32, mask: &[u32]) -> impl Iterator<Item = [u32; 2]> {
        let [column, row, columns, rows] = self.tile(index);
        let there = |texel: &u32| mask.get(*texel as usize / 32).is_some_and(|word| word >> (texel % 32) & 1 != 0);
        (0..columns * rows).filter(there).map(move |texel| [column + texel % columns, row + texel / columns])
    }

    /// Number of tiles; the units of a bake are the tiles and then the bricks of probes.
    pub fn tile_count(&self) -> u32 {
        self.tiles().iter().product()
    }

    /// Number of bricks of probes.
    pub fn brick_count(&self) -> u32 {
        self.probes.as_ref().map_or(0, Grid::bricks)
    }

    /// Number of the first receiver of a tile in the whole bake.
    pub fn first_receiver(&self, index: u32) -> u32 {
        index.wrapping_mul(self.side().wrapping_mul(self.side()))
    }

    /// Checks the numbers.
    ///
    /// # Errors
    /// `Input`, saying which number is impossible.
    pub fn validate(&self) -> Result<()> {
        let wrong = |what: String| Err(Error::input(what));
        let texels = u64::from(self.extent[0]) * u64::from(self.extent[1]);
        if texels == 0 || texels > MOST_TEXELS {
            return wrong(format!("{}×{} texels; 1 to {MOST_TEXELS} are allowed", self.extent[0], self.extent[1]));
        }
        self.probes.iter().try_for_each(|grid| grid.validate().map_err(|error| error.at("probes")))?;
        if self.times.len() > MOST_TIMES {
            return wrong(format!("{} times; at most {MOST_TIMES} are allowed", self.times.len()));
        }
        let unit = |v: &[f32; 3]| (v.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-3;
        if self.times.iter().any(|time| !time.seconds.is_finite() || !unit(&time.sun)) {
            return wrong("a time whose sun has no direction".into());
        }
        if self.times.windows(2).any(|pair| pair[0].seconds >= pair[1].seconds) {
            return wrong("times that are not in order".into());
        }
        let courses = self.calendar.courses().map_err(Error::input)?;
        if let Some(time) = self.times.iter().find(|time| time.seconds < 0.0 || time.day() >= courses.len()) {
            return wrong(format!("a time at {} seconds, which is in no day of the bake", time.seconds));
        }
        if let Some(point) = self.calendar.point
            && !(point.centre.iter().all(|part| part.is_finite()) && (1e-3..=1e9).contains(&point.distance))
        {
            return wrong(format!("a sun at a distance of {} m; 0.001 to 1000000000 m are allowed", point.distance));
        }
        if let Some([from, until]) = self.calendar.span
            && !(0.0 <= from && from <= until && until <= NEXT_DAY)
        {
            return wrong(format!("light from {from} to {until} seconds of a day"));
        }
        if let Kind::Cube { position, near, .. } = &self.receivers {
            cube::check_extent(self.extent)?;
            if !position.iter().chain([near]).all(|number| number.is_finite()) {
                return wrong("a camera whose place is not finite".into());
            }
        }
        self.check_whole().map_err(|error| error.of_kind(ErrorKind::Input))?;
        let Weather { .. } =
            Weather::new(self.weather.turbidity(), self.weather.ground_albedo(), self.weather.overcast())
                .map_err(Error::input)?;
        self.settings.validate()?;
        match (&self.receivers, self.settings.adaptive, self.settings.measure) {
            (_, Adaptive::Off, _) | (_, _, Comparison::Rms) | (Kind::View { .. } | Kind::Cube { .. }, _, _) => Ok(()),
            (Kind::Lightmap { .. }, _, Comparison::Pdiff) => {
                let what = "`pdiff` compares pictures, and the texels of a lightmap are none";
                Err(Error::usage(what).at("bake.measure").help("Choose `rms`"))
            }
        }
    }

    /// Checks that a tile for the whole picture is not too large for devices.
    ///
    /// # Errors
    /// `Usage`, saying how many texels are allowed.
    pub fn check_whole(&self) -> Result<()> {
        let texels = u64::from(self.extent[0]) * u64::from(self.extent[1]);
        let most = MOST_WHOLE / self.dimensions().into_iter().max().unwrap_or(1).max(1) as u64;
        if self.settings.tile != 0 || texels <= most {
            return Ok(());
        }
        let what = format!("0: one tile of {texels} texels; with so many times at most {most} are allowed");
        let error = Error::usage(what).at("bake.tile");
        Err(error.help("Choose a smaller picture, a longer interval, or tiles: bake.tile=64"))
    }

    /// The times of a day.
    pub fn of_day(&self, day: usize) -> std::ops::Range<usize> {
        self.times.partition_point(|time| time.day() < day)..self.times.partition_point(|time| time.day() <= day)
    }

    /// Number of dimensions of the layers: times, patches of the sky, groups of lamps.
    pub fn dimensions(&self) -> [usize; 3] {
        [self.times.len(), SKY_PATCHES as usize, self.lamps.len()]
    }

    /// Says in which part `scene` differs from the scene of the bake; `None`: in none.
    pub fn difference(&self, scene: &Scene) -> Option<String> {
        Part::difference(&self.parts, &parts(scene))
    }

    /// Checks that these are the corners of the lightmap; none for other bakes.
    ///
    /// # Errors
    /// `Input` if they are others.
    pub fn check_corners(&self, corners: &Corners) -> Result<()> {
        let wanted = match &self.receivers {
            Kind::View { .. } | Kind::Cube { .. } => Digest::of(&[]),
            Kind::Lightmap { corners, .. } => *corners,
        };
        match digest(corners) == wanted {
            true => Ok(()),
            false => Err(Error::input("the corners of its lightmap are not those of its plan")),
        }
    }

    /// Checks that a view is the one of a bake for one view, or that it is at the place of a cube.
    ///
    /// # Errors
    /// `Usage` if it is another one.
    pub fn check_view(&self, view: &View) -> Result<()> {
        if let Kind::Cube { camera, position, .. } = &self.receivers {
            return cube::check_view(view, camera, (*position).into());
        }
        let Kind::View { camera, view_from_world, clip_from_view } = &self.receivers else { return Ok(()) };
        let near = |a: Mat4, b: &[f32; 16]| {
            let size = b.iter().fold(1.0f32, |most, x| most.max(x.abs()));
            a.to_cols_array().iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-4 * size)
        };
        // The depth range of the projection follows the scene's bounds.
        let mut projection = view.shifted(Vec2::ZERO).clip_from_view.to_cols_array();
        for at in [10, 14] {
            projection[at] = clip_from_view[at];
        }
        let projection = Mat4::from_cols_array(&projection);
        let help = |with: &str| {
            format!("Render with {with}, bake this view, or bake the surfaces for all views (--kind lightmap)")
        };
        if view.extent != self.extent {
            let [width, height] = self.extent;
            let found = view.extent;
            let what = format!("the picture has {}×{} pixels, the bake {width}×{height}", found[0], found[1]);
            return Err(Error::usage(what).help(help(&format!("--size {width}x{height}"))));
        }
        if !near(view.view_from_world, view_from_world) || !near(projection, clip_from_view) {
            let what = format!("the bake is for the camera `{camera}` alone, and this is another view");
            return Err(Error::usage(what).help(help("that camera")));
        }
        Ok(())
    }
}

/// Digest of the corners of a lightmap.
pub fn digest(corners: &Corners) -> Digest {
    Digest::of(&corners.encode())
}

impl Baking {
    /// Maximum of scatterings, which the arrays of vertices limit.
    pub(super) fn vertices(&self) -> u32 {
        self.bounces.min(DAY_VERTICES)
    }
}

/// Digests of the parts of a scene on which baked light depends. Suns and environment are none of them: the bake brings its own.
pub fn parts(scene: &Scene) -> Vec<Part> {
    let mut geometry = Vec::new();
    for primitive in scene.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        let mut floats = |values: &[f32]| geometry.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        primitive.positions.iter().for_each(|v| floats(&v.to_array()));
        primitive.normals.iter().for_each(|v| floats(&v.to_array()));
        primitive.tangents.iter().for_each(|v| floats(&v.to_array()));
        primitive.uvs.iter().flatten().for_each(|v| floats(&v.to_array()));
        primitive.colors.iter().for_each(|v| floats(&v.to_array()));
        geometry.extend(primitive.indices.iter().flat_map(|index| index.to_le_bytes()));
        geometry.extend(primitive.material.to_le_bytes());
    }
    let placed =
        |node: &crate::scene::Node| format!("{:?} {:?} {:?} {:?}", node.parent, node.local, node.mesh, node.weights);
    let nodes: String = scene.nodes.iter().map(|node| placed(node) + "\n").collect();
    let lamps: Vec<_> = scene.lights.iter().filter(|l| !matches!(l.kind, LightKind::Directional)).collect();
    let texels: Vec<u8> = scene.textures.iter().flat_map(|t| t.rgba.iter().flatten().copied()).collect();
    vec![
        Part::of("geometry", &geometry, format!("{} meshes", scene.meshes.len())),
        Part::of("nodes", nodes.as_bytes(), format!("{} nodes", scene.nodes.len())),
        Part::of(
            "materials",
            format!("{:?}", scene.materials).as_bytes(),
            format!("{} materials", scene.materials.len()),
        ),
        Part::of("textures", &texels, format!("{} textures", scene.textures.len())),
        Part::of("lamps", format!("{lamps:?}").as_bytes(), format!("{} lamps", lamps.len())),
    ]
}
