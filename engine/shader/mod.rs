//! shader
