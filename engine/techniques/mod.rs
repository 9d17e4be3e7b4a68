//! techniques
