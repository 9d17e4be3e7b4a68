//! What the executables share: command line, settings, the loop over frames, output names, messages, exit codes.

pub mod args;
pub mod camera;
pub mod config;
pub mod console;
pub mod fingerprint;
pub mod framing;
pub mod inspect;
pub mod pattern;
pub mod progress;
pub mod signals;
pub mod world;
