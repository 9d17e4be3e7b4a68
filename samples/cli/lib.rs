//! What the executables share: command line, settings, the loop over frames, output names, messages, exit codes.

pub mod args;
pub mod camera;
pub mod config;
pub mod console;
pub mod devices;
pub mod exposure;
pub mod fingerprint;
pub mod framing;
pub mod gbuffer_layers;
pub mod info;
pub mod inspect;
pub mod lights;
pub mod outputs;
pub mod pattern;
pub mod program;
pub mod progress;
pub mod record;
pub mod render;
pub mod rerun;
pub mod run;
pub mod shown;
pub mod signals;
pub mod source;
pub mod stage;
pub mod timings;
pub mod world;
