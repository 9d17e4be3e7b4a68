//! The commands of `prt`: `bake` writes the input file of `render`, `info` describes it, and `check` measures its error.

mod bake;
mod check;
mod info;
mod memory;
mod render;

pub use bake::{PrtBakeArgs, bake};
pub use check::{PrtCheckArgs, check};
pub(crate) use memory::available;

pub use info::{PrtInfoArgs, info};
pub use render::{PrtArgs, render};
