//! The commands of `daylight`: `bake` writes the input file of `render`, `export` and `frames`, and `info` describes it.

mod bake;
mod export;
mod frames;
mod info;
mod memory;
mod plan;
mod render;

pub use bake::{DayBakeArgs, bake};
pub use export::{DayExportArgs, export};
pub use frames::{DayFramesArgs, frames};
pub use info::{DayInfoArgs, info};
pub use plan::{DayOptions, KindArg, Planned, for_view};
pub use render::{DayArgs, render};
