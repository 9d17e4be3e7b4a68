//! Daylight: indirect light for every time of day, baked once, compressed, and lit live ("Realtime global illumination using compressed
//! pre-computed indirect illumination textures", Bahnsen et al., WSCG 2012).
//!
//! [`Transport`] follows paths from the texels of a bake, shared by all times of the day. [`layer::Layer`] compresses the light of a tile by
//! principal components, as many as the [tolerance](Baking::tolerance) needs. [`units`] makes the tiles units of a job, and [`Stored`] is the
//! file. At run time [`Daylight`] draws direct light with shadow maps and adds the baked light of the time.

pub mod adaptive;
mod added;
pub mod atlas;
mod backs;
mod baked;
mod balance;
pub mod beam;
pub mod blocks;
mod buried;
mod civil;
pub mod columns;
mod compress;
mod corners;
pub mod course;
pub mod cube;
pub mod day;
pub mod export;
mod file;
mod filter;
pub mod finish;
pub mod frames;
pub mod gathered;
mod image_values;
pub mod lamps;
pub mod layer;
mod light;
pub mod lightmap;
mod listed;
mod masks;
mod on_device;
mod pages;
pub mod patch;
mod pictures;
mod places;
mod plan;
pub mod probes;
mod rim;
mod settings;
pub mod sky;
pub mod steps;
mod stream;
mod suns;
mod technique;
mod transport;
pub mod units;

pub use adaptive::{Adaptive, Comparison};
pub use backs::Backs;
pub use baked::Baked;
pub use beam::Weather;
pub use blocks::Texels;
pub use course::{Course, Shine, SunPath};
pub use day::{Day, Place, Sun};
pub use file::{Stored, Summary};
pub use frames::Frames;
pub use light::Light;
pub use masks::Cells;
pub use plan::{Calendar, Group, Kind, Lit, MOST_TIMES, NEXT_DAY, Plan, SunPoint, digest, parts};
pub use settings::{Added, Baking, Interpolation, PictureSettings, Reflections, Sampling, Settings, SkyLight};
pub use sky::Sky;
pub use technique::{Daylight, Mode};
pub use transport::{Sources, Transport};
