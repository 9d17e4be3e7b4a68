//! Precomputed radiance transfer for lights that move inside a room ("Precomputed Illumination for Virtual Reality Scenarios", Leonhardt and Bohn).
//!
//! [`Bakery`] puts samples on all surfaces and traces rays between them. [`units`] are the stages of a bake: visibility, transport, light of
//! examples, bases, transfer. [`Stored`] is the file. At run time [`Prt`] finds the direct light at the samples, transfers this light, and
//! spreads the sum over the picture.

mod baked;
mod bakery;
mod cap;
pub mod check;
mod clusters;
mod coded;
mod components;
mod eyes;
mod file;
mod grid;
mod left_out;
mod links;
mod on_device;
mod pixels;
mod plan;
mod rooms;
mod samples;
mod sampling;
mod settings;
pub mod solve;
mod splats;
mod spread;
mod technique;
mod transfer;
mod tree;
pub mod units;
mod vertices;
mod visibility;

pub use baked::Baked;
pub use bakery::Bakery;
pub use cap::Cap;
pub use file::{Stored, Summary};
pub use grid::{Grid, Nearby};
pub use left_out::{simplified, unlit};
pub use links::Links;
pub use on_device::points_of_lights;
pub use plan::{MOST_SAMPLES, MOST_VECTORS, Plan, Starts, parts, starts};
pub use sampling::Sampled;
pub use settings::{Baking, Direct, PictureSettings, Settings, Spread};
pub use technique::{Mode, Prt};
pub use tree::Tree;
