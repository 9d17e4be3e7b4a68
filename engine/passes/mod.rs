//! Passes that several techniques use: plain functions on handles.

pub mod ambient;
pub mod blur;
pub mod gbuffer;
pub mod shadow;
pub mod skybox;
