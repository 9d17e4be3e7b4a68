//! The commands of `daylight`: `bake` writes the input file of `render` and `export`, and `info` describes it.

mod bake;
mod export;
mod info;
mod plan;
mod render;

pub use bake::{DayBakeArgs, bake};
pub use export::{DayExportArgs, export};
pub use info::{DayInfoArgs, info};
pub use render::{DayArgs, render};
