//! What can be chosen.

use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// Which lights there are. Those left out neither light nor show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sources {
    #[default]
    All,
    /// Point, spot and directional lights.
    Punctual,
    /// Emissive surfaces, and unlit ones.
    Emissive,
    /// The sky.
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

/// Where in its pixel a ray goes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Filter {
    /// Anywhere: the pixel is the mean over its square.
    #[default]
    Box,
    /// Through the centre, as a rasteriser's.
    Centre,
}

/// How light that has an extent is found. Only [`Strategy::Mis`] is meant for pictures; the others check it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Strategy {
    /// By both of the others, each weighted by how well it does (multiple importance sampling, power heuristic).
    #[default]
    Mis,
    /// By sampling the lights.
    Lights,
    /// By following scattered rays.
    Bsdf,
}

/// What to trace. The same settings give the same bits on the same device.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Settings {
    /// Scatterings after the first surface: 0 is direct light, 1 what one pass of image-space radiosity models. At most 1000.
    pub bounces: u32,
    /// Mirrors and glass that a path may meet, beside `bounces`. At most 1000.
    pub specular_bounces: u32,
    /// Scatterings before a path may be ended at random (Russian roulette).
    pub roulette: u32,
    /// Every surface reflects as Lambert's law alone has it: no gloss, no mirrors, no glass.
    pub diffuse_only: bool,
    pub sources: Sources,
    pub filter: Filter,
    pub strategy: Strategy,
    /// Of all random numbers.
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

/// More would only be waiting: what is left of the light is far below rounding.
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
