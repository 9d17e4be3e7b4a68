//! Settings of the technique, with the choices of the thesis.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{super::allowed::wrong, occluder_rotation::Axis, samples::Grid, suns};
use crate::{
    Error, Result,
    settings::{Described, described},
};

/// How the irradiance of a pixel is computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// From vectors that were computed before the first frame.
    #[default]
    Vectors,
    /// From vectors that each frame computes for the samples that its pixels look up. Occluders may rotate and deform,
    /// and the environment may rotate.
    Online,
    /// The irradiance of the environment without occluders.
    Unshadowed,
    /// One shadow ray to every texel of the environment. This slow method is the reference for the other methods.
    BruteForce,
}

/// How the share of an occluder in front of a receiver's plane is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Extent {
    /// By the extent of its vertices along the normal.
    #[default]
    Hull,
    /// By its bounding sphere, as in the thesis.
    Sphere,
}

/// How the irradiance is computed that an occluder hides if the receiver's plane cuts it (case B of the thesis).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Cut {
    /// normal · FIV plus the irradiance from behind the plane that the part behind the plane hides, because the dot
    /// product contains that irradiance with a negative sign.
    #[default]
    Light,
    /// normal · FIV times the share of the occluder's height in front of the plane, as in the thesis.
    Height,
}

/// Where the samples for an occluder's shadow on itself lie.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SelfSamples {
    /// On its surface, at the vertices of its triangles.
    #[default]
    Surface,
    /// On the spheres that also hold the samples of all other shadows, as in the thesis.
    Spheres,
}

/// How the mask of an occluder is computed for a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Masks {
    /// By one ray (or `split`² rays) from the sample to each texel.
    #[default]
    Rays,
    /// By lookups in orthographic depth images of the occluder, one image per ray direction. The number of rays does
    /// not depend on the number of samples. The edges of masks are off by up to a 128th of the radius. Rays are used
    /// instead if `size` · `split` is more than 44 or if surfaces are blended.
    Parallel,
}

/// How the irradiance that several occluders hide together is corrected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Shared {
    /// As `Filled`. In addition, no more light is subtracted from a bright part of the environment than this part
    /// sends.
    #[default]
    Lights,
    /// By the common area of their bounding discs, weighted by the mean share of each disc that the occluder fills.
    Filled,
    /// By the common area of their bounding discs, as in the thesis. This area is too large for occluders that are not
    /// balls.
    Discs,
}

/// The quantity that is interpolated between two spheres of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Interpolation {
    /// The vectors, as in the thesis.
    #[default]
    Linear,
    /// The vectors divided by the solid angle of the bounding sphere, approximately. The result is exact for a distant
    /// occluder. Near an occluder the irradiance of a small light may be subtracted more than once.
    SolidAngle,
}

/// Glossy reflection of surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Specular {
    /// All surfaces are diffuse.
    #[default]
    Off,
    /// Surfaces reflect the environment: a sum over its texels, scaled by the share of each cell of texels that
    /// occluders leave visible.
    Summed,
}

/// Settings of the technique.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Texels along an edge of the environment's cube.
    #[schemars(range(min = 8, max = 128), extend("multipleOf" = 8, "x-unit" = "texels", "x-decides" = "bake"))]
    pub size: u32,
    /// Samples along the azimuth.
    #[schemars(range(min = 3, max = 1024), extend("x-decides" = "bake", "x-needs" = {"method": {"enum": ["vectors", "online"]}}))]
    pub azimuths: u32,
    /// Samples along the polar angle, with both poles.
    #[schemars(range(min = 2, max = 513), extend("x-decides" = "bake", "x-needs" = {"method": {"enum": ["vectors", "online"]}}))]
    pub polars: u32,
    /// Spheres of samples.
    #[schemars(range(min = 2, max = 128), extend("x-decides" = "bake", "x-needs" = {"method": {"enum": ["vectors", "online"]}}))]
    pub radii: u32,
    /// Rotation samples about `turn_axis` for occluders that rotate. With 1 there are vectors for the pose at
    /// rest only.
    #[schemars(range(min = 1, max = 64), extend("x-decides" = "bake", "x-needs" = {"method": {"const": "vectors"}}))]
    pub turns: u32,
    /// Axis of the rotation samples, in world axes through the origins of the nodes: `x`, `y`, `z`, or three numbers
    /// with commas between them.
    #[schemars(extend("x-decides" = "bake", "x-needs" = {"turns": {"minimum": 2}}), with = "String")]
    pub turn_axis: Axis,
    /// Most texels of the environment that are separated from the vectors. Only texels that send at least a
    /// hundredth of all light each are separated, the brightest first. Their shadows have hard edges, from one shadow
    /// map per texel and occluder. This setting needs `method` vectors and occluders that do not rotate.
    #[schemars(range(min = 0, max = suns::MOST), extend("x-unit" = "texels", "x-decides" = "bake", "x-needs" = {"method": {"const": "vectors"}}))]
    pub suns: u32,
    /// Radius of the last sphere of samples, in radii of the occluder's bounding sphere. At greater
    /// distances the vectors of the last sphere are scaled by the solid angle of the occluder.
    #[schemars(range(min = 2, max = 1000), extend("x-unit" = "radii", "x-decides" = "bake", "x-needs" = {"method": {"enum": ["vectors", "online"]}}))]
    pub reach: f32,
    /// Samples are denser where the vectors have a high curvature. Without this setting directions are evenly spaced
    /// and radii grow by a constant factor, as in the thesis.
    #[schemars(extend("x-decides" = "bake", "x-needs" = {"method": {"const": "vectors"}}))]
    pub adaptive: bool,
    /// Rays along the edge of a texel of an occluder's mask.
    #[schemars(range(min = 1, max = 4), extend("x-unit" = "rays", "x-decides" = "bake", "x-needs" = {"method": {"enum": ["vectors", "online"]}}))]
    pub split: u32,
    /// How the mask of an occluder is found, which says what the occluder hides from a sample.
    #[schemars(extend("x-decides" = "bake", "x-needs" = {"method": {"const": "vectors"}}))]
    pub masks: Masks,
    /// Flat meshes cast shadows too.
    #[schemars(extend("x-decides" = "bake", "x-needs" = {"method": {"enum": ["vectors", "online"]}}))]
    pub flat: bool,
    /// If a scene has several occluders, those with a radius of more than this share of the scene's radius only receive
    /// shadows. An occluder that encloses the whole scene has the share 0.58.
    #[schemars(range(min = 0, max = 1), extend("x-decides" = "bake", "x-needs" = {"method": {"enum": ["vectors", "online"]}}))]
    pub largest: f32,
    /// Vectors are interpolated between the eight nearest samples. Without this setting the nearest sample is used.
    #[schemars(extend("x-needs" = {"method": {"enum": ["vectors", "online"]}}))]
    pub trilinear: bool,
    /// The quantity that is interpolated between two spheres of samples.
    #[schemars(extend("x-decides" = "bake", "x-needs" = {"method": {"enum": ["vectors", "online"]}}))]
    pub interpolation: Interpolation,
    /// The irradiance that an occluder hides is corrected if the receiver's plane cuts the occluder.
    #[schemars(extend("x-needs" = {"method": {"enum": ["vectors", "online"]}}))]
    pub partial: bool,
    /// Irradiance that an occluder hides if the receiver's plane cuts it.
    #[schemars(extend("x-needs" = {"partial": {"const": true}}))]
    pub cut: Cut,
    /// How much of an occluder lies in front of a receiver's plane.
    #[schemars(extend("x-needs" = {"partial": {"const": true}}))]
    pub extent: Extent,
    /// The irradiance that several occluders hide together is subtracted once.
    #[schemars(extend("x-needs" = {"method": {"enum": ["vectors", "online"]}}))]
    pub overlap: bool,
    /// Occluders that cannot hide more than this share of the environment's mean irradiance are left out. With
    /// 0 no occluder is left out.
    #[schemars(range(min = 0, max = 1), extend("x-needs" = {"method": {"enum": ["vectors", "online"]}}))]
    pub negligible: f32,
    /// Irradiance that several occluders hide together.
    #[schemars(extend("x-needs" = {"overlap": {"const": true}}))]
    pub shared: Shared,
    /// Occluders shadow themselves.
    #[schemars(extend("x-needs" = {"method": {"enum": ["vectors", "online"]}}))]
    pub self_shadow: bool,
    /// Where the vectors for an occluder's shadow on itself are taken.
    #[schemars(extend("x-decides" = "bake", "x-needs" = {"self_shadow": {"const": true}}))]
    pub self_samples: SelfSamples,
    /// Occluders cast shadows and are not drawn, as in the thesis' measurements (section 5.4) and in figure 27.
    pub hide_occluders: bool,
    /// Glossy reflection of the environment.
    pub specular: Specular,
    /// How irradiance is computed.
    pub method: Method,
    /// Rotation of the environment about +Y, counter-clockwise seen from above.
    #[schemars(range(min = -36000, max = 36000), extend("x-unit" = "°"))]
    pub rotation: f32,
    /// Additional rotation of the environment per second of a sequence. If the value is not
    /// 0, rotated environments are resampled from means of pixels, and their irradiance without shadows is looked up in that of the environment before the
    /// rotation, which is faster and has errors of some thousandths.
    #[schemars(range(min = -36000, max = 36000), extend("x-unit" = "°/s"))]
    pub turning: f32,
    /// Scale of the environment's radiance as a power of two.
    #[schemars(range(min = -30, max = 30), extend("x-unit" = "stops"))]
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
            hide_occluders: false,
            specular: Specular::default(),
            method: Method::Vectors,
            rotation: 0.0,
            turning: 0.0,
            exposure: 0.0,
        }
    }
}

impl Settings {
    /// The defaults with fewer samples and texels, for a picture in seconds: 1/68 of the rays.
    pub fn preview() -> Self {
        let Grid { azimuths, polars, radii } = Grid::of(24, 13, 12);
        Self { size: 16, azimuths, polars, radii, ..Self::default() }
    }

    /// The settings that need stored vectors ([`Method::Vectors`]): a change of one asks for them.
    pub fn of_stored_vectors(&self) -> impl PartialEq + use<> {
        (self.turns, self.suns, self.adaptive, self.masks)
    }

    /// The numbers of samples along the three coordinates.
    pub fn grid(&self) -> Grid {
        Grid { azimuths: self.azimuths, polars: self.polars, radii: self.radii }
    }

    /// Rotation (radians about +Y) and scale of the environment.
    pub fn light(&self) -> (f32, f32) {
        ((self.rotation % 360.0).to_radians(), self.exposure.exp2())
    }

    /// Most texels that are separated from the vectors.
    pub(super) fn apart(&self) -> u32 {
        if self.method == Method::Vectors { self.suns } else { 0 }
    }

    /// The settings with the rotation of the environment at a time of a sequence, seconds.
    #[must_use]
    pub fn after(&self, seconds: f64) -> Self {
        let rotation = f64::from(self.rotation) + f64::from(self.turning) * seconds;
        Self { rotation: (rotation % 360.0) as f32, ..self.clone() }
    }

    /// The value of the shader constant `PARTIAL`: 0 no correction, 1 [`Cut::Height`], 2 [`Cut::Light`].
    pub(super) fn partial_way(&self) -> u32 {
        match (self.partial, self.cut) {
            (false, _) => 0,
            (true, Cut::Height) => 1,
            (true, Cut::Light) => 2,
        }
    }

    /// Whether shadows of occluders on themselves come from samples on their surfaces.
    pub fn on_surface(&self) -> bool {
        self.self_samples == SelfSamples::Surface
    }

    /// Refuses settings that need vectors computed before the first frame.
    fn online(&self) -> Result<()> {
        let beforehand = [
            ("suns", self.suns > 0, "separated texels", "0"),
            ("turns", self.turns > 1, "rotation samples", "1, because this method follows every rotation"),
            ("masks", self.masks == Masks::Parallel, "masks from depth images", "rays"),
        ];
        beforehand.into_iter().filter(|(_, asked, ..)| *asked).try_for_each(|(key, _, what, allowed)| {
            wrong(key, format!("{what} with fiv.method=online"), &format!("{allowed}, or another method"))
        })
    }

    /// # Errors
    /// `Usage`, naming the key, the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        Self::description().check(self)?;
        if self.method == Method::Online && self.specular != Specular::Off {
            return wrong("specular", "glossy reflection with fiv.method=online", "off, or another method");
        }
        if self.suns > 0 && self.specular != Specular::Off {
            return wrong("specular", "glossy reflection with separated texels (fiv.suns)", "off, or fiv.suns=0");
        }
        if self.method == Method::Online {
            self.online()?;
        }
        if self.suns > 0 && self.turns > 1 {
            let error = Error::usage("texels can be separated for occluders at rest only").at("suns");
            return Err(error.help("Set fiv.suns or fiv.turns to its default"));
        }
        if self.negligible > 0.0 && (self.suns > 0 || self.specular != Specular::Off) {
            let error = Error::usage(
                "an occluder that is negligible for irradiance may hide a separated texel or a reflection",
            );
            return Err(error.at("negligible").help("Set fiv.negligible to 0, or leave out fiv.suns and fiv.specular"));
        }
        Ok(())
    }
}

described!(Settings);

#[cfg(test)]
mod tests {
    use super::*;

    fn keys_without_effect(settings: &Settings) -> Vec<String> {
        Settings::description().idle(settings).unwrap().into_iter().map(|idle| idle.key).collect()
    }

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
            // The same settings are valid for vectors computed before the first frame.
            let before = Settings { method: Method::Vectors, ..wrong };
            before.validate().unwrap();
            assert_eq!(keys_without_effect(&before), [""; 0]);
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
            assert_eq!(keys_without_effect(&idle), keys);
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
