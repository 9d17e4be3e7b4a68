//! Rotation and scale of the environment in a frame, and the light on the device that follows from them.

use std::sync::Arc;

use super::{Light, Method, Settings, Sky, light, sky_rotation::RotatingSky};
use crate::{Result, gpu::OwnedImage, graph::Runner, scene::Environment};

/// Rotation and scale of the environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lighting {
    /// Rotation about +Y, radians, with the environment's own rotation.
    turn: f32,
    /// Scale of radiance, with the environment's own scale.
    factor: f32,
    /// The environment is resampled pixel by pixel, because its rotation stays the same from picture to picture.
    still: bool,
}

impl Lighting {
    pub(super) fn of(environment: &Environment, settings: &Settings) -> Self {
        let (turn, factor) = settings.light();
        let turn = environment.rotation + turn;
        // All methods must have the light that precomputed vectors were computed for.
        let still = settings.method == Method::Vectors || settings.turning == 0.0 || turn == environment.rotation;
        Self { turn, factor: environment.scale * factor, still }
    }

    /// The environment with this rotation and scale, and its light on the device. `unturned`: the irradiance of the environment without them, which is
    /// found if it is needed and not known yet. `apart`: most texels that are separated.
    pub(super) fn light(
        self,
        runner: &mut Runner,
        environment: &Environment,
        (rotating_sky, unturned): (&mut RotatingSky, &mut Option<Arc<OwnedImage>>),
        apart: u32,
    ) -> Result<(Sky, Light)> {
        if self.still {
            let sky = rotating_sky.sky(environment, (self.turn, self.factor), true)?.apart(apart);
            let light = Light::with(runner, &sky)?;
            return Ok((sky, light));
        }
        let map = match unturned {
            Some(map) => map,
            // Before the rotation of the frame, which stays in the cache. Only stored vectors, which never turn, have separated texels.
            None => {
                debug_assert_eq!(apart, 0);
                let sky = rotating_sky.sky(environment, (0.0, 1.0), false)?;
                unturned.insert(light::irradiance_map(runner, &sky)?)
            }
        };
        let sky = rotating_sky.sky(environment, (self.turn, self.factor), false)?;
        let light = Light::turned(runner, &sky, map, (self.turn, self.factor))?;
        Ok((sky, light))
    }
}
