//! Positions of an occluder for which vectors are computed: concentric spheres around the receiver (Michael 2010,
//! section 3.3.2).
//!
//! The thesis writes sizes as (ϑ, φ, ϱ) = 128×65×30. The first number counts azimuths. The second, odd number counts
//! polar angles and includes both poles. The azimuth here goes around +Y (0 over −Z, towards +X), and the polar angle
//! is the angle to +Y.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};

use super::super::allowed::within;
use crate::Result;

/// Numbers of samples along the three coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Grid {
    /// Azimuths, without the one at 2π, which equals the one at 0.
    pub azimuths: u32,
    /// Polar angles from +Y to −Y, both included.
    pub polars: u32,
    /// Spheres.
    pub radii: u32,
}

impl Grid {
    /// The sets of samples of the thesis' table 2, the smallest first.
    pub const THESIS: [Self; 5] = [
        Self::of(32, 17, 15),
        Self::of(64, 33, 15),
        Self::of(64, 33, 30),
        Self::of(128, 65, 30),
        Self::of(256, 129, 30),
    ];

    /// A grid in the order in which the thesis writes the numbers.
    pub const fn of(azimuths: u32, polars: u32, radii: u32) -> Self {
        Self { azimuths, polars, radii }
    }

    /// Number of samples.
    pub fn count(&self) -> u32 {
        self.azimuths * self.polars * self.radii
    }

    /// Number of a sample. The azimuth changes fastest, then the polar angle, then the radius.
    pub fn index(&self, azimuth: u32, polar: u32, radius: u32) -> u32 {
        (radius * self.polars + polar) * self.azimuths + azimuth
    }

    /// Numbers of the azimuth, the polar angle and the radius of a sample.
    pub fn place(&self, index: u32) -> [u32; 3] {
        let ring = index / self.azimuths;
        [index % self.azimuths, ring % self.polars, ring / self.polars]
    }

    /// Unit vector from the receiver to the occluder. At the poles all azimuths have the same direction.
    pub fn direction(&self, azimuth: u32, polar: u32) -> DVec3 {
        if polar == 0 || polar + 1 >= self.polars {
            return if polar == 0 { DVec3::Y } else { DVec3::NEG_Y };
        }
        let theta = PI * f64::from(polar) / f64::from(self.polars - 1);
        let phi = TAU * f64::from(azimuth) / f64::from(self.azimuths);
        DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos())
    }

    /// # Errors
    /// `Usage`, naming the number, the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        within([("azimuths", self.azimuths, 3, 1024), ("polars", self.polars, 2, 513), ("radii", self.radii, 2, 128)])
    }
}

impl std::fmt::Display for Grid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}×{}×{}", self.azimuths, self.polars, self.radii)
    }
}

/// Radii of the spheres, which grow by a constant factor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Shells {
    /// Radius of the first sphere, metres.
    pub nearest: f32,
    /// Radius of the last sphere, metres.
    pub farthest: f32,
}

impl Shells {
    /// Radius of one of `count` spheres, metres.
    pub fn radius(&self, count: u32, sphere: u32) -> f64 {
        let (near, far) = (f64::from(self.nearest), f64::from(self.farthest));
        if sphere == 0 {
            near
        } else if sphere + 1 >= count {
            far
        } else {
            near * (far / near).powf(f64::from(sphere) / f64::from(count - 1))
        }
    }

    /// Number of spheres per factor e of the radius.
    pub fn steps(&self, count: u32) -> f64 {
        f64::from(count - 1) / (f64::from(self.farthest) / f64::from(self.nearest)).ln()
    }

    /// As [`Self::offset`], rounded as on the device.
    pub fn point(&self, grid: &Grid, index: u32) -> Vec3 {
        let [azimuth, polar, sphere] = grid.place(index);
        grid.direction(azimuth, polar).as_vec3() * self.radius(grid.radii, sphere) as f32
    }

    /// Offset of the occluder's centre from the receiver, metres.
    pub fn offset(&self, grid: &Grid, index: u32) -> DVec3 {
        let [azimuth, polar, sphere] = grid.place(index);
        grid.direction(azimuth, polar) * self.radius(grid.radii, sphere)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_and_places_are_the_same_thing() {
        let grid = Grid::of(8, 5, 3);
        for i in 0..grid.count() {
            let [a, p, r] = grid.place(i);
            assert!(a < 8 && p < 5 && r < 3);
            assert_eq!(grid.index(a, p, r), i);
        }
        assert_eq!(Grid::THESIS.map(|g| g.count()), [8160, 31680, 63360, 249_600, 990_720]);
        // Nine floats each: the megabytes of table 2.
        let megabytes = Grid::THESIS.map(|g| f64::from(g.count()) * 36.0 / f64::from(1 << 20));
        for (ours, thesis) in megabytes.into_iter().zip([0.28, 1.08, 2.17, 8.56, 34.0]) {
            assert!((ours - thesis).abs() < 0.02, "{ours} instead of {thesis}");
        }
    }

    #[test]
    fn spheres_grow_evenly_and_poles_are_one_place() {
        let (grid, shells) = (Grid::of(16, 9, 15), Shells { nearest: 0.25, farthest: 16.0 });
        let radii: Vec<f64> = (0..15).map(|r| shells.radius(15, r)).collect();
        assert_eq!((radii[0], radii[14]), (0.25, 16.0));
        for pair in radii.windows(2) {
            assert!((pair[1] / pair[0] - 64f64.powf(1.0 / 14.0)).abs() < 1e-12);
        }
        assert!((shells.steps(15) * (radii[5] / radii[4]).ln() - 1.0).abs() < 1e-12);
        for azimuth in 0..16 {
            assert_eq!(grid.direction(azimuth, 0), DVec3::Y);
            assert_eq!(grid.direction(azimuth, 8), DVec3::NEG_Y);
            for polar in 0..9 {
                assert!((grid.direction(azimuth, polar).length() - 1.0).abs() < 1e-12);
            }
        }
        assert!((grid.direction(0, 4) - DVec3::NEG_Z).length() < 1e-12);
        assert!((grid.direction(4, 4) - DVec3::X).length() < 1e-12);
    }

    #[test]
    fn sets_that_cannot_be_interpolated_are_refused() {
        for (grid, key) in
            [(Grid::of(2, 5, 5), "azimuths"), (Grid::of(8, 1, 5), "polars"), (Grid::of(8, 5, 1), "radii")]
        {
            let error = grid.validate().unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(key), "{error}");
        }
        Grid::THESIS.iter().for_each(|g| g.validate().unwrap());
    }
}
