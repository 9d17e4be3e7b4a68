//! The commands of `daylight`: `bake` writes the input file of `render`, `info` describes it, and `frames` makes uncompressed frames of it.

mod bake;
mod frames;
mod info;
mod plan;
mod render;

pub use bake::{DayBakeArgs, bake};
pub use frames::{DayFramesArgs, frames};
pub use info::{DayInfoArgs, info};
pub use render::{DayArgs, render};
