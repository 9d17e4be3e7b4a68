//! A bake in forms that other programs read: the irradiance of a lightmap at a time, its principal components as images, and the scene with
//! coordinates in the lightmap. `docs/daylight-export.md` describes the files.

mod frame;
mod pages;
mod unwrapped;

pub use frame::{Levels, Moment, NOWHERE, faces, filled, irradiance, levels, sources};
pub use pages::{Page, Pages, Spot, layers};
pub use unwrapped::{Unwrapping, unwrapped};
