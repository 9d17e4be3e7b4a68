//! The papers' methods, one module each.

pub mod igi;
pub mod isr;
pub mod tonemap;
