//! Shared by the executables.
