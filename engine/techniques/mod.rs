//! The papers' methods, one module each.
