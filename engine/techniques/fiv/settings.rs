//! What can be chosen, and what the thesis chose.

use serde::{Deserialize, Serialize};

use super::{
    super::allowed::{within, wrong},
    occluder_rotation::Axis,
    samples::Grid,
    sky::SIDES,
    suns,
};
use crate::{Error, Result};

/// How irradiance is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// From stored vectors.
    #[default]
    Vectors,
    /// From vectors computed in each frame where pixels look them up: occluders may turn and deform, the environment may turn.
    Online,
    /// Without occluders.
    Unshadowed,
    /// By a shadow ray to every texel of the environment: slow, and what the others are measured against.
    BruteForce,
}

/// By what it is told how much of an occluder lies in front of a receiver's plane.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Extent {
    /// By how far its corners reach along the normal.
    #[default]
    Hull,
    /// By its bounding sphere, as in the thesis.
    Sphere,
}

/// What an occluder that the receiver's plane cuts hides.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Cut {
    /// Its vector along the normal, and what its part behind the plane hides of the light from behind, which the vector has
    /// subtracted: nothing where no light comes from there.
    #[default]
    Light,
    /// Of its vector the share of its height in front, as in the thesis.
    Height,
}

/// Where the vectors for an occluder's shadow on itself are taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SelfSamples {
    /// On its surface: at the corners of its triangles.
    #[default]
    Surface,
    /// On the spheres of all other shadows, as in the thesis.
    Spheres,
}

/// How it is found what an occluder hides from a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Masks {
    /// By rays from the sample.
    #[default]
    Rays,
    /// From pictures of the occluder along the directions of the rays: the cost of tracing is the same for any number of samples, edges of
    /// masks are off by up to a 128th of the radius. Rays, where `size` · `split` is more than 44 or surfaces are blended.
    Parallel,
}

/// What several occluders hide together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shared {
    /// As `Filled`; and of each bright part of the environment no more than it sends.
    #[default]
    Lights,
    /// What their bounding discs have in common, by how much each of them is filled on average.
    Filled,
    /// What their bounding discs have in common, as in the thesis: too much for bodies that are no balls.
    Discs,
}

/// What is interpolated between two spheres of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Interpolation {
    /// Vectors, as in the thesis.
    #[default]
    Linear,
    /// Vectors over the solid angle of the occluder's bounding sphere, nearly. Exact far away; near an occluder a small light may be
    /// taken away more than once.
    SolidAngle,
}

/// What surfaces reflect glossily.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Specular {
    /// Nothing: they are matt.
    #[default]
    Off,
    /// The environment, a sum over its texels, by the share that occluders leave of its cells.
    Summed,
}

/// Settings of the technique.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Texels along an edge of the environment's cube: multiples of 8, 8 to 128.
    pub size: u32,
    /// Samples around, 3 to 1024.
    pub azimuths: u32,
    /// Samples from pole to pole, 2 to 513.
    pub polars: u32,
    /// Spheres of samples, 2 to 128.
    pub radii: u32,
    /// Samples of turns about an axis, 1 to 64, for occluders that turn so; 1: those at rest only.
    pub turns: u32,
    /// What they turn about, in world axes through their nodes' origins: `x`, `y`, `z`, or three numbers with commas between them.
    pub turn_axis: Axis,
    /// The brightest texels of the environment are kept out of the vectors, so many at most, 0 to 16, of those of which each sends at least
    /// a hundredth of all light: their shadows have hard edges, from a map of each occluder for each. Not for occluders that turn, and
    /// only where vectors are computed beforehand.
    pub suns: u32,
    /// Radius of the last sphere, in radii of the occluder's bounding sphere, 2 to 1000. Farther away what is hidden shrinks with the
    /// solid angle.
    pub reach: f32,
    /// Samples lie closer to each other where what is hidden bends; without, directions lie evenly and radii grow by a constant factor, as
    /// in the thesis.
    pub adaptive: bool,
    /// Rays along the edge of a texel of an occluder's mask, 1 to 4.
    pub split: u32,
    pub masks: Masks,
    /// Flat occluders cast shadows too.
    pub flat: bool,
    /// Where there are several occluders, those of more than this share of the scene's radius only receive shadows, 0 to 1. One that holds
    /// all others has 0.58.
    pub largest: f32,
    /// Vectors are interpolated between samples; without, the nearest is taken.
    pub trilinear: bool,
    pub interpolation: Interpolation,
    /// Occluders cut by the receiver's plane are corrected for what lies behind it.
    pub partial: bool,
    pub cut: Cut,
    pub extent: Extent,
    /// What several occluders hide is taken away once.
    pub overlap: bool,
    /// Occluders are left out where they cannot hide more than this share of the environment's mean irradiance, 0 to 1; 0: nowhere.
    pub negligible: f32,
    pub shared: Shared,
    /// Occluders shadow themselves.
    pub self_shadow: bool,
    pub self_samples: SelfSamples,
    pub specular: Specular,
    pub method: Method,
    /// The environment turns by this angle about +Y, degrees counter-clockwise seen from above, -36000 to 36000.
    pub rotation: f32,
    /// And by so much more each second of a sequence, degrees, -36000 to 36000. Where it is not 0 the light of other turns than the
    /// scene's comes from means of pixels, which takes less time and is off by some thousandths.
    pub turning: f32,
    /// Factor on the environment's light as a power of two, -30 to 30.
    pub exposure: f32,
}

impl Default for Settings {
    fn default() -> Self {
        let grid = Grid::of(64, 33, 30);
        Self {
            size: 32,
            azimuths: grid.azimuths,
            polars: grid.polars,
            radii: grid.radii,
            turns: 1,
            turn_axis: Axis::Y,
            suns: 0,
            reach: 16.0,
            adaptive: true,
            split: 1,
            masks: Masks::default(),
            flat: false,
            largest: 0.5,
            trilinear: true,
            interpolation: Interpolation::default(),
            partial: true,
            cut: Cut::default(),
            extent: Extent::default(),
            overlap: true,
            negligible: 0.0,
            shared: Shared::default(),
            self_shadow: true,
            self_samples: SelfSamples::default(),
            specular: Specular::default(),
            method: Method::Vectors,
            rotation: 0.0,
            turning: 0.0,
            exposure: 0.0,
        }
    }
}

impl Settings {
    /// Where samples are taken.
    pub fn grid(&self) -> Grid {
        Grid { azimuths: self.azimuths, polars: self.polars, radii: self.radii }
    }

    /// Turn (radians about +Y) and factor that the environment gets.
    pub fn light(&self) -> (f32, f32) {
        ((self.rotation % 360.0).to_radians(), self.exposure.exp2())
    }

    /// Texels of the environment that are kept apart at most.
    pub(super) fn apart(&self) -> u32 {
        if self.method == Method::Vectors { self.suns } else { 0 }
    }

    /// As they are `seconds` into a sequence.
    #[must_use]
    pub fn after(&self, seconds: f64) -> Self {
        let rotation = f64::from(self.rotation) + f64::from(self.turning) * seconds;
        Self { rotation: (rotation % 360.0) as f32, ..self.clone() }
    }

    /// How shaders know what is done with occluders that are cut.
    pub(super) fn partial_way(&self) -> u32 {
        match (self.partial, self.cut) {
            (false, _) => 0,
            (true, Cut::Height) => 1,
            (true, Cut::Light) => 2,
        }
    }

    /// Samples on the occluders' surfaces are wanted.
    pub fn on_surface(&self) -> bool {
        self.self_samples == SelfSamples::Surface
    }

    /// What vectors of a frame cannot have.
    fn online(&self) -> Result<()> {
        let beforehand = [
            ("suns", self.suns > 0, "lights kept apart", "0"),
            ("turns", self.turns > 1, "samples of turns", "1: vectors of a frame follow all turns"),
            ("masks", self.masks == Masks::Parallel, "masks from pictures along rays", "rays"),
        ];
        beforehand.into_iter().filter(|(_, asked, ..)| *asked).try_for_each(|(key, _, what, allowed)| {
            wrong(key, format!("{what} with fiv.method=online"), &format!("{allowed}, or another method"))
        })
    }

    /// The keys that are not at their defaults and change nothing, with why.
    pub fn idle(&self) -> Vec<(&'static str, &'static str)> {
        let by = Self::default();
        let vectors = self.method == Method::Vectors;
        let shadows = vectors || self.method == Method::Online;
        let unused = "fiv.method uses no vectors";
        // Key, whether it is not at its default, whether it counts, and why it would not.
        let keys = [
            ("azimuths", self.azimuths != by.azimuths, shadows, unused),
            ("polars", self.polars != by.polars, shadows, unused),
            ("radii", self.radii != by.radii, shadows, unused),
            ("turns", self.turns != by.turns, vectors, unused),
            ("turn_axis", self.turn_axis != by.turn_axis, vectors && self.turns > 1, "fiv.turns is 1"),
            ("suns", self.suns != by.suns, vectors, unused),
            ("reach", self.reach != by.reach, shadows, unused),
            ("adaptive", self.adaptive != by.adaptive, vectors, "vectors of a frame lie evenly whatever it says"),
            ("split", self.split != by.split, shadows, unused),
            ("masks", self.masks != by.masks, vectors, unused),
            ("flat", self.flat != by.flat, shadows, unused),
            ("largest", self.largest != by.largest, shadows, unused),
            ("trilinear", self.trilinear != by.trilinear, shadows, unused),
            ("interpolation", self.interpolation != by.interpolation, shadows, unused),
            ("partial", self.partial != by.partial, shadows, unused),
            ("cut", self.cut != by.cut, shadows && self.partial, "fiv.partial is off"),
            ("extent", self.extent != by.extent, shadows && self.partial, "fiv.partial is off"),
            ("overlap", self.overlap != by.overlap, shadows, unused),
            ("shared", self.shared != by.shared, shadows && self.overlap, "fiv.overlap is off"),
            ("negligible", self.negligible != by.negligible, shadows, unused),
            ("self_shadow", self.self_shadow != by.self_shadow, shadows, unused),
            (
                "self_samples",
                self.self_samples != by.self_samples,
                shadows && self.self_shadow,
                "fiv.self_shadow is off",
            ),
        ];
        let idle = keys.into_iter().filter(|(_, changed, counts, _)| *changed && !counts);
        idle.map(|(key, .., why)| (key, if shadows { why } else { unused })).collect()
    }

    /// # Errors
    /// `Usage`, naming the key, the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        if !SIDES.contains(&self.size) || !self.size.is_multiple_of(8) {
            let (what, least, most) = (self.size, SIDES.start(), SIDES.end());
            let what = format!("{what} is not allowed; allowed: multiples of 8 from {least} to {most}");
            return Err(Error::usage(what).at("size"));
        }
        self.grid().validate()?;
        within([("reach", self.reach, 2.0, 1000.0), ("largest", self.largest, 0.0, 1.0)])?;
        within([("negligible", self.negligible, 0.0, 1.0)])?;
        within([("rotation", self.rotation, -36e3, 36e3), ("turning", self.turning, -36e3, 36e3)])?;
        if self.method == Method::Online && self.specular != Specular::Off {
            return wrong("specular", "glossy reflection with fiv.method=online", "off, or another method");
        }
        if self.suns > 0 && self.specular != Specular::Off {
            return wrong("specular", "glossy reflection with lights kept apart (fiv.suns)", "off, or fiv.suns=0");
        }
        if self.method == Method::Online {
            self.online()?;
        }
        within([("exposure", self.exposure, -30.0, 30.0)])?;
        within([("split", self.split, 1, 4), ("turns", self.turns, 1, 64), ("suns", self.suns, 0, suns::MOST)])?;
        if self.suns > 0 && self.turns > 1 {
            let error = Error::usage("lights can be kept apart for occluders at rest only").at("suns");
            return Err(error.help("Set fiv.suns or fiv.turns to its default"));
        }
        if self.negligible > 0.0 && (self.suns > 0 || self.specular != Specular::Off) {
            let error = Error::usage(
                "what is negligible for irradiance may hide lights that are kept apart, or seen in surfaces",
            );
            return Err(error.at("negligible").help("Set fiv.negligible to 0, or leave out fiv.suns and fiv.specular"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_nothing_is_refused_or_named() {
        let online = Settings { method: Method::Online, ..Settings::default() };
        for (wrong, key) in [
            (Settings { suns: 4, ..online.clone() }, "suns"),
            (Settings { turns: 8, ..online.clone() }, "turns"),
            (Settings { masks: Masks::Parallel, ..online.clone() }, "masks"),
        ] {
            let error = wrong.validate().unwrap_err();
            assert!(error.exit_code() == 2 && error.place() == Some(key), "{error}");
            // It is for vectors computed beforehand.
            let before = Settings { method: Method::Vectors, ..wrong };
            before.validate().unwrap();
            assert_eq!(before.idle(), []);
        }
        let good = Settings::default();
        let x = Axis::new(glam::Vec3::X).unwrap();
        for (idle, keys) in [
            (good.clone(), &[][..]),
            (Settings { turn_axis: x, ..good.clone() }, &["turn_axis"]),
            (Settings { turn_axis: x, turns: 2, ..good.clone() }, &[]),
            (Settings { partial: false, cut: Cut::Height, extent: Extent::Sphere, ..good.clone() }, &["cut", "extent"]),
            (Settings { overlap: false, shared: Shared::Discs, ..good.clone() }, &["shared"]),
            (Settings { self_shadow: false, self_samples: SelfSamples::Spheres, ..good.clone() }, &["self_samples"]),
            (
                Settings { method: Method::BruteForce, size: 16, suns: 3, negligible: 0.1, ..good.clone() },
                &["suns", "negligible"],
            ),
            (Settings { reach: 8.0, ..online.clone() }, &[]),
            (Settings { adaptive: false, ..online.clone() }, &["adaptive"]),
        ] {
            assert_eq!(idle.idle().iter().map(|(key, _)| *key).collect::<Vec<_>>(), keys);
        }
    }

    #[test]
    fn an_error_names_key_value_and_what_is_allowed() {
        Settings::default().validate().unwrap();
        let good = Settings::default();
        for (wrong, parts) in [
            (Settings { size: 33, ..good.clone() }, ["size", "33", "multiples of 8"]),
            (Settings { azimuths: 0, ..good.clone() }, ["azimuths", "0", "3 to 1024"]),
            (Settings { reach: f32::NAN, ..good.clone() }, ["reach", "NaN", "2 to 1000"]),
            (Settings { split: 5, ..good.clone() }, ["split", "5", "1 to 4"]),
        ] {
            let error = wrong.validate().unwrap_err();
            assert_eq!(error.exit_code(), 2);
            parts.iter().for_each(|part| assert!(error.to_string().contains(part), "{error}"));
        }
    }
}
