//! The papers' methods, one module each.

pub(crate) mod allowed;
pub mod fiv;
pub mod igi;
pub mod isr;
pub mod tonemap;

use crate::settings::{Described, Description};

/// The techniques by their names in `-D igi.vpls=500`, with the description of their settings.
pub fn descriptions() -> [(&'static str, &'static Description); 4] {
    [
        ("isr", isr::Settings::description()),
        ("igi", igi::Settings::description()),
        ("fiv", fiv::Settings::description()),
        ("tonemap", tonemap::Settings::description()),
    ]
}
