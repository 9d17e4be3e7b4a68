//! Daylight: indirect light for every time of day, baked once, compressed, and lit live ("Realtime global illumination using compressed
//! pre-computed indirect illumination textures", Bahnsen et al., WSCG 2012).
//!
//! [`Transport`] follows paths from the texels of a bake, shared by all times of the day. [`layer::Layer`] compresses the light of a tile by
//! principal components, as many as the [tolerance](Baking::tolerance) needs. [`units`] makes the tiles units of a job, and [`Stored`] is the
//! file. At run time [`Daylight`] draws direct light with shadow maps and adds the baked light of the time.

pub mod atlas;
pub mod beam;
mod civil;
pub mod day;
pub mod export;
mod file;
pub mod layer;
pub mod lightmap;
pub mod patch;
mod plan;
mod settings;
pub mod sky;
mod technique;
mod transport;
pub mod units;

pub use beam::Weather;
pub use day::{Day, Place, Sun};
pub use file::{Stored, Summary};
pub use plan::{Calendar, Kind, Lit, MOST_TIMES, Plan, digest, parts};
pub use settings::{Baking, Interpolation, PictureSettings, Settings};
pub use sky::Sky;
pub use technique::{Baked, Daylight, Mode};
pub use transport::{Light, Sources, Transport};
