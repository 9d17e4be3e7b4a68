//! Soft shadows under an environment from fullsphere irradiance vectors (Michael 2010, chapter 3).
//!
//! The irradiance of a surface is that of the whole environment, looked up by its normal, without what occluders hide. What an occluder
//! hides is kept as one vector a colour channel, the sum of radiance × direction × solid angle over the part of the environment behind
//! it, for many places of the occluder around the receiver; its dot product with the normal is the irradiance that is missing, if the
//! occluder lies in front of the receiver's plane.
//!
//! [`Sky`] is the environment as a cube, [`Light`] the same on the device with its irradiance; [`Occluders`] finds what casts
//! shadows in a scene; [`Plan`] computes vectors, [`Stored`] keeps them in files; [`Fiv`] draws.
//!
//! Where this differs from the thesis, and why:
//! - Solid angles are exact: texels of a cube differ by a factor of five. The thesis writes none (eq. 10).
//! - Masks are made by rays instead of rasterising ([`cover`]).
//! - 1/π is explicit: a surface of albedo ρ reflects ρ/π · E; the thesis folds it into its factor (eq. 3).
//! - The discs of the overlap correction have sin α = R / ρ as radius, so that they stay finite near an occluder.
//! - How far an occluder reaches over the receiver's plane (cases A, B, C) is asked of its corners, not of its bounding sphere
//!   ([`support`]); [`Extent::Sphere`] is the thesis' way.
//! - What an occluder that the receiver's plane cuts hides is its vector and what the part behind hides of the light from behind
//!   ([`Cut::Light`]). The thesis makes the vector smaller, though it is too small already: [`Cut::Height`].
//! - An occluder's shadow on itself comes from samples on its surface ([`surface`]); [`SelfSamples::Spheres`] is the thesis' way.
//! - Samples lie where what is hidden bends, if [`Settings::adaptive`] ([`pace`]).
//! - What overlapping occluders share is less where they do not fill their bounding discs ([`fill`]), and no bright part of the
//!   environment is taken away twice ([`spots`]).
//! - The brightest texels can be kept out of the vectors and get hard shadows ([`suns`]).
//! - Surfaces may reflect the environment glossily ([`specular`]), and occluders may turn ([`turn`]).
//! - More than two overlapping occluders: see [`crate::reference::fiv::shares`].

mod body;
pub mod cover;
pub mod file;
pub mod fill;
mod hash;
pub mod light;
mod negligible;
pub mod occluder;
mod online;
mod online_standing;
pub mod pace;
mod parallel;
mod picture;
pub mod plan;
mod ready;
mod room;
pub mod samples;
mod settings;
pub mod sky;
pub mod specular;
pub mod spots;
mod stage;
mod stored_standing;
pub mod suns;
pub mod support;
pub mod surface;
mod tiles;
pub mod turn;
mod turning;
pub mod units;

pub use file::Stored;
pub use light::Light;
pub use occluder::{Occluder, Occluders, Placed};
pub use picture::{Outputs, Picture, PictureSettings};
pub use plan::Plan;
pub use settings::{Cut, Extent, Interpolation, Masks, Method, SelfSamples, Settings, Shared, Specular};
pub use sky::Sky;
pub use stage::Fiv;
