//! The commands of `daylight`: `bake` writes the input file of `render`, and `info` describes it.

mod bake;
mod info;
mod plan;
mod render;

pub use bake::{DayBakeArgs, bake};
pub use info::{DayInfoArgs, info};
pub use plan::{DayOptions, Planned, of_view};
pub use render::{DayArgs, render};
