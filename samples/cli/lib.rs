//! What the executables share: command line, settings, the loop over frames, output names, messages, exit codes.

pub mod args;
pub mod camera;
pub mod config;
pub mod console;
pub mod pattern;
pub mod progress;
pub mod signals;
