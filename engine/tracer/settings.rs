//! Settings of the path tracer.

use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// Which light sources are used. The others neither light surfaces nor are visible.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sources {
    #[default]
    All,
    /// Point, spot and directional lights.
    Punctual,
    /// Emissive and unlit surfaces.
    Emissive,
    /// The environment.
    Environment,
}

impl Sources {
    pub(super) fn punctual(self) -> bool {
        matches!(self, Self::All | Self::Punctual)
    }

    pub(super) fn emissive(self) -> bool {
        matches!(self, Self::All | Self::Emissive)
    }

    pub(super) fn environment(self) -> bool {
        matches!(self, Self::All | Self::Environment)
    }
}

/// Position of a camera ray within its pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Filter {
    /// Random, uniform over the pixel: the picture is box-filtered.
    #[default]
    Box,
    /// The pixel's centre, as in rasterisation.
    Centre,
}

/// Sampling strategy for lights with an extent. [`Strategy::Mis`] is meant for pictures; the others are for tests.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Strategy {
    /// Both light and BSDF sampling, combined by multiple importance sampling with the power heuristic.
    #[default]
    Mis,
    /// Light sampling only.
    Lights,
    /// BSDF sampling only.
    Bsdf,
}

/// Settings of a picture. The same settings give bit-identical results on the same device.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Maximum of scatterings after the first surface, 0 to 1000. 0: direct light only; 1: the light that one pass of image-space
    /// radiosity models.
    pub bounces: u32,
    /// Maximum of mirrors and glass surfaces along a path, in addition to `bounces`, 0 to 1000.
    pub specular_bounces: u32,
    /// Number of scatterings before Russian roulette begins.
    pub roulette: u32,
    /// Every surface is Lambertian: without gloss, mirrors and glass.
    pub diffuse_only: bool,
    pub sources: Sources,
    pub filter: Filter,
    pub strategy: Strategy,
    /// Seed of all random numbers.
    pub seed: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            bounces: 8,
            specular_bounces: 8,
            roulette: 4,
            diffuse_only: false,
            sources: Sources::All,
            filter: Filter::Box,
            strategy: Strategy::Mis,
            seed: 0,
        }
    }
}

/// Maximum of bounces. After as many bounces the light is far below the rounding error.
const MOST_BOUNCES: u32 = 1000;

impl Settings {
    /// # Errors
    /// `Usage` if a setting is out of its range.
    pub fn validate(&self) -> Result<()> {
        for (name, value) in [("bounces", self.bounces), ("specular_bounces", self.specular_bounces)] {
            if value > MOST_BOUNCES {
                return Err(Error::usage(format!("{value}; at most {MOST_BOUNCES} are allowed")).at(name));
            }
        }
        Ok(())
    }
}
