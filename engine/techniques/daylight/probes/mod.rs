//! Probes: the baked irradiance at points in space, for objects that are added at run time and for the directions of gloss.
//!
//! A probe is a receiver in space. Its paths start in all directions; their light is summed as spherical harmonics of bands 0 to 2. The file
//! holds the irradiance for twelve normals, the corners of an icosahedron. They span the same functions as the nine harmonics, and sums over
//! them are exact integrals over the sphere (the corners are a spherical 5-design), so the tolerance of a tile holds for the mean over all
//! normals. So light of probes is compressed like texels: [`Brick::light`] is a [`Tile`] with twelve texels for each probe.

mod bricks;
mod distance;
mod field;
mod grid;
mod harmonics;
mod transport;

pub use bricks::{Brick, Summary, summary};
pub use field::{Field, Moment, Pixels};
pub use grid::Grid;
pub use harmonics::{DIRECTIONS, convolved, harmonics, irradiance, lobe};
pub use transport::Gathered;

#[cfg(doc)]
use super::units::Tile;
