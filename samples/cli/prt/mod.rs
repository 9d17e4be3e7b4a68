//! The commands of `prt`: `bake` writes the input file of `render`, and `info` describes it.

mod bake;
mod info;
mod render;

pub use bake::{PrtBakeArgs, bake};
pub use info::{PrtInfoArgs, info};
pub use render::{PrtArgs, render};
