//! Soft shadows under an environment from fullsphere irradiance vectors (Michael 2010, chapter 3).
//!
//! The irradiance of a surface point is the irradiance of the whole environment, looked up by the normal, minus the
//! irradiance that occluders hide ([FIV 12]). The hidden irradiance comes from precomputed vectors. One vector per
//! colour channel is the sum of radiance × direction × solid angle over the part of the environment that the occluder
//! hides ([FIV 10]). The vectors of an occluder are stored for many positions of the occluder around a receiver, the
//! samples. The dot product of vector and normal is the hidden irradiance, if the whole occluder lies in front of the
//! receiver's plane.
//!
//! [`Sky`] is the environment as a cube map. [`Light`] is the cube map on the device with its irradiance. [`Occluders`]
//! finds the nodes of a scene that cast shadows. [`Plan`] computes vectors, [`Stored`] keeps vectors in files, and
//! [`Fiv`] draws pictures.
//!
//! Differences from the thesis, with reasons:
//! - Solid angles are exact, because the texels of a cube map differ by a factor of five. The thesis leaves the solid
//!   angle out of [FIV 10].
//! - Rays make the masks of occluders instead of rasterisation ([`cover`]).
//! - The factor 1/π is explicit: a surface of albedo ρ reflects ρ/π · E. The thesis includes 1/π in its reflectance
//!   factor ([FIV 3]).
//! - The bounding discs of the overlap correction have the radius sin α = R / ρ. This radius stays finite near an
//!   occluder.
//! - The extent of an occluder across the receiver's plane (cases A, B and C) is computed from its vertices and not
//!   from its bounding sphere ([`support_function`]). [`Extent::Sphere`] is the method of the thesis.
//! - The thesis scales the vector of an occluder that the receiver's plane cuts by the share of its height in front
//!   ([`Cut::Height`]). This vector is already too small, because the part behind the plane contributes with a negative
//!   sign. By default the contribution of the part behind the plane is estimated and added back ([`Cut::Light`]).
//! - Samples on the surface of an occluder give its shadow on itself ([`surface`]). [`SelfSamples::Spheres`] is the
//!   method of the thesis.
//! - Samples are denser where the vectors have a high curvature, if [`Settings::adaptive`] is set ([`spacing`]).
//! - The overlap correction takes into account how much of their bounding discs occluders fill ([`fill`]). It never
//!   subtracts a bright part of the environment twice ([`spots`]).
//! - The brightest texels can be separated from the vectors. Their shadows then have hard edges ([`suns`]).
//! - Surfaces may reflect the environment glossily ([`specular`]), and occluders may rotate ([`occluder_rotation`]).
//! - The thesis corrects the overlap of two occluders. [`crate::reference::fiv::shares`] has the extension to any
//!   number.

pub mod cover;
pub mod file;
pub mod fill;
mod hash;
pub mod light;
mod lighting;
mod limits;
mod negligible;
pub mod occluder;
pub mod occluder_rotation;
mod online;
mod online_occluders;
mod parallel;
mod picture;
pub mod plan;
mod posed_mesh;
mod prepared;
pub mod samples;
mod settings;
pub mod sky;
mod sky_rotation;
pub mod spacing;
pub mod specular;
pub mod spots;
mod state;
mod stored_occluders;
pub mod suns;
pub mod support_function;
pub mod surface;
mod technique;
mod tiles;
pub mod units;

pub use file::Stored;
pub use light::Light;
pub use occluder::{Occluder, Occluders, Placed};
pub use picture::{Outputs, Picture, PictureSettings};
pub use plan::Plan;
pub use settings::{Cut, Extent, Interpolation, Masks, Method, SelfSamples, Settings, Shared, Specular};
pub use sky::Sky;
pub use state::Fiv;
pub use technique::Baked;
