//! Slow and obvious CPU versions of every tone mapping operator, written from the papers and from the documentation of the
//! settings, never from the shaders. All arithmetic is in 64 bits.

pub mod ashikhmin;
pub mod bilateral;
pub mod curves;
pub mod identify;
pub mod plane;
pub mod reinhard;
pub mod statistics;

#[cfg(test)]
mod tests;
