//! Passes that several techniques use: plain functions on handles.

pub mod ambient;
pub mod bilateral;
pub mod blur;
pub mod compose;
pub mod direct;
pub mod downsample;
pub mod edges;
pub mod gbuffer;
pub mod matte;
pub mod motion;
pub mod shadow;
pub mod skybox;
pub mod temporal;
