//! Local adaptation.

use super::Settings;
use crate::{
    Error, ErrorKind, Result,
    graph::{Buffer, Extent, Graph, Image},
};

/// Local adaptation of every pixel of `luminance`, R32F; of the bilateral operator, log₁₀ of the base. `picture`: extent of the whole
/// picture, of which `luminance` may be a part.
///
/// # Errors
/// `Usage` if the settings cannot serve a picture of this extent.
pub fn adaptation(
    _graph: &mut Graph,
    _luminance: Image,
    _statistics: Buffer,
    _picture: Extent,
    settings: &Settings,
) -> Result<Image> {
    let what = format!("local adaptation of {} is not there yet", settings.operator.name());
    Err(Error::new(ErrorKind::Usage, what).at("mode"))
}
