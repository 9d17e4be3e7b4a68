//! Portable float map: `PF` (RGB) or `Pf` (grey), 32-bit floats, bottom row first. No metadata.

use super::{Layer, Layers, Precision, check_size};
use crate::{Error, Result, limits::Limits};

pub(super) fn encode(picture: &Layers, layer: &Layer) -> Result<Vec<u8>> {
    let grey = layer.channels.len() == 1;
    let pixels = layer.rgb_pixels().ok_or_else(|| {
        Error::usage(format!(
            "layer {:?} has the channels {}; PFM files hold RGB or one channel",
            layer.name,
            layer.channels.join(" ")
        ))
    })?;
    let mut out =
        format!("{}\n{} {}\n-1.0\n", if grey { "Pf" } else { "PF" }, picture.width, picture.height).into_bytes();
    for row in pixels.chunks_exact(picture.width as usize).rev() {
        for value in row.iter().flat_map(|pixel| if grey { &pixel[..1] } else { &pixel[..] }) {
            out.extend_from_slice(&value.to_le_bytes());
        }
    }
    Ok(out)
}

pub(super) fn decode(bytes: &[u8], limits: &Limits) -> Result<Layers> {
    let mut position = 0;
    let magic = token(bytes, &mut position)?;
    let channels: &[&str] = match magic {
        "PF" => &["R", "G", "B"],
        "Pf" => &["Y"],
        _ => return Err(Error::input(format!("{magic:?} is neither PF nor Pf")).at("header")),
    };
    let size = |text: &str| text.parse::<u32>().map_err(|_| Error::input(format!("{text:?} is no size")).at("header"));
    let width = size(token(bytes, &mut position)?)?;
    let height = size(token(bytes, &mut position)?)?;
    let text = token(bytes, &mut position)?;
    let scale = text
        .parse::<f32>()
        .ok()
        .filter(|scale| scale.is_finite() && *scale != 0.0)
        .ok_or_else(|| Error::input(format!("the scale {text:?} is not a number other than zero")).at("header"))?;
    let needed = check_size(width.into(), height.into(), 4 * channels.len() as u64, limits)?;
    // Exactly one white space character ends the header: the next byte may be data that looks like one.
    let data = bytes.get(position..).unwrap_or_default();
    if data.len() != needed {
        let found = data.len();
        return Err(Error::input(format!("{found} bytes of pixels where {width}×{height} need {needed}")).at("pixels"));
    }
    let little = scale < 0.0;
    let row_values = width as usize * channels.len();
    let mut values = Vec::with_capacity(needed / 4);
    for row in data.chunks_exact(row_values * 4).rev() {
        values.extend(
            row.as_chunks::<4>().0.iter().map(|&b| if little { f32::from_le_bytes(b) } else { f32::from_be_bytes(b) }),
        );
    }
    let layer = Layer { precision: Precision::Full, ..Layer::new("", channels, values) };
    Ok(Layers::new(width, height).with(layer))
}

/// The next word of the header and the one white space character after it.
fn token<'a>(bytes: &'a [u8], position: &mut usize) -> Result<&'a str> {
    let rest = bytes.get(*position..).unwrap_or_default();
    let length = rest.iter().take(64).position(u8::is_ascii_whitespace).filter(|&length| length > 0);
    let word = length.and_then(|length| std::str::from_utf8(&rest[..length]).ok());
    let word = word.ok_or_else(|| Error::input("must be: PF or Pf, width and height, scale").at("header"))?;
    *position += word.len() + 1;
    Ok(word)
}
