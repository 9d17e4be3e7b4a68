//! The papers' methods, one module each.

pub mod isr;
pub mod tonemap;
