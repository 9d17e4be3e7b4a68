//! The techniques behind `isr`, `igi` and `fiv`: their command lines, and how they declare a frame.

pub mod fiv;
pub mod igi;
pub mod isr;
