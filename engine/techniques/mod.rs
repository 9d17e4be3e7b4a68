//! The papers' methods, one module each.

pub(crate) mod allowed;
pub mod fiv;
pub mod igi;
pub mod isr;
pub mod tonemap;
