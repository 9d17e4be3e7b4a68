//! OpenEXR in.
use super::{Layers, Metadata};
use crate::{Error, Result, scene::Limits};
pub(super) fn decode(_: &[u8], _: &Limits) -> Result<Layers> {
    Err(Error::input("EXR files are not read yet"))
}
pub(super) fn metadata(_: &[u8]) -> Result<Metadata> {
    Err(Error::input("EXR files are not read yet"))
}
