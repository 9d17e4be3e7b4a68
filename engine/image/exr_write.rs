//! OpenEXR out.
use super::{Layers, Report};
use crate::{Error, Result};
pub(super) fn channel_name(layer: &str, channel: &str) -> String {
    format!("{layer}.{channel}")
}
pub(super) fn encode(_: &Layers, _: bool, _: &mut Report) -> Result<Vec<u8>> {
    Err(Error::input("EXR files are not written yet"))
}
