//! The state of an unfinished picture as bytes, with which another process can continue it.

use super::{
    Sums,
    job::{Job, LAYERS, slots_of},
};
use crate::{Error, ErrorKind, Result, gpu::Gpu, image};
use serde_json::{Value, json};
use std::path::Path;

/// First bytes of a state.
const MAGIC: &[u8; 16] = b"lucerna tracer 1";
/// Bytes of the magic and of the four numbers after it.
const NUMBERS: usize = 16 + 4 * 8;
/// Maximum of bytes of the text, which usually has some thousands.
const MOST_TEXT: u64 = 1 << 24;
/// Maximum of samples per pixel: their indices have 32 bits.
const MOST_SAMPLES: u64 = u32::MAX as u64;

/// The state of an unfinished picture in host memory.
#[derive(Clone, Debug)]
pub struct State {
    /// All data on which the picture depends.
    about: Value,
    sums: Sums,
}

/// The header of a state.
#[derive(Clone, Debug, PartialEq)]
pub struct Head {
    /// Width and height, pixels.
    pub extent: [u32; 2],
    /// Samples of every pixel, at most 2³² − 1.
    pub samples: u64,
    /// Number of slots that have one sample more; less than the number of slots.
    begun: u64,
    about: Value,
    /// Offset of the pixels, bytes.
    body: usize,
    /// Bytes of the pixels.
    bytes: u64,
}

fn broken(what: &str) -> Error {
    Error::input(format!("is no state of a reference picture: {what}"))
}

impl Head {
    /// Decodes the header from the start of a state. Refuses numbers that no run writes, even if the checksum is right.
    fn decode(bytes: &[u8]) -> Result<Self> {
        let mut rest = bytes.strip_prefix(MAGIC).ok_or_else(|| broken("it begins differently"))?;
        let mut number = || -> Result<u64> {
            let (head, tail) = rest.split_first_chunk::<8>().ok_or_else(|| broken("it ends early"))?;
            rest = tail;
            Ok(u64::from_le_bytes(*head))
        };
        let (length, samples, begun, layers) = (number()?, number()?, number()?, number()?);
        if length > MOST_TEXT {
            return Err(broken(&format!("a text of {length} bytes, at most {MOST_TEXT} are read")));
        }
        let text = rest.get(..length as usize).ok_or_else(|| broken("it ends early"))?;
        let about: Value = serde_json::from_slice(text).map_err(|error| broken("its text").caused_by(error))?;
        let side = |i: usize| about["extent"][i].as_u64().and_then(|v| u32::try_from(v).ok()).unwrap_or(0);
        let extent = [side(0), side(1)];
        let [width, height] = extent.map(u64::from);
        let bytes = width.checked_mul(height).and_then(|pixels| pixels.checked_mul(16 * u64::from(LAYERS)));
        let (Some(bytes), Some(slots)) = (bytes.filter(|bytes| *bytes > 0), slots_of(extent)) else {
            return Err(broken(&format!("its size: {width}×{height} pixels")));
        };
        if layers != u64::from(LAYERS) {
            return Err(broken(&format!("{layers} images, {LAYERS} are needed")));
        }
        if samples > MOST_SAMPLES || begun >= slots {
            let what =
                format!("{samples} samples a pixel and {begun} begun; there can be {MOST_SAMPLES} and {}", slots - 1);
            return Err(broken(&what));
        }
        Ok(Self { extent, samples, begun, about, body: NUMBERS + length as usize, bytes })
    }
}

impl State {
    /// Reads the header of a state file. Does not read the pixels and does not check the checksum.
    ///
    /// # Errors
    /// `Input` if the file cannot be read or has no valid header.
    pub fn glance(path: impl AsRef<Path>) -> Result<Head> {
        let path = path.as_ref();
        let bytes = image::read_head_checked(path, NUMBERS as u64 + MOST_TEXT)?;
        Head::decode(&bytes).map_err(|error| error.in_file(path))
    }

    /// Maximum of bytes of the state of a picture of this size.
    pub fn most_bytes([width, height]: [u32; 2]) -> u64 {
        let pixels = u64::from(width).saturating_mul(height.into()).saturating_mul(16 * u64::from(LAYERS));
        pixels.saturating_add(NUMBERS as u64 + MOST_TEXT + 8)
    }

    /// Samples of every pixel.
    pub fn samples(&self) -> u64 {
        self.sums.samples()
    }

    /// The sums of all finished paths.
    pub fn sums(&self) -> &Sums {
        &self.sums
    }

    /// Encodes the state. The same state gives the same bytes.
    ///
    /// # Errors
    /// `Runtime` if `about` cannot be written.
    pub fn encode(&self) -> Result<Vec<u8>> {
        let about = serde_json::to_vec(&self.about)
            .map_err(|error| Error::new(ErrorKind::Runtime, "the state cannot be written").caused_by(error))?;
        let raw = self.sums.raw();
        let pixels: usize = raw.iter().map(|layer| size_of_val(layer.as_slice())).sum();
        let mut out = Vec::with_capacity(NUMBERS + about.len() + pixels + 8);
        out.extend(MAGIC);
        for number in [about.len() as u64, self.sums.samples(), self.sums.begun(), raw.len() as u64] {
            out.extend(number.to_le_bytes());
        }
        out.extend(about);
        for layer in raw {
            out.extend_from_slice(bytemuck::cast_slice(layer));
        }
        let check = checksum(&out);
        out.extend(check.to_le_bytes());
        Ok(out)
    }

    /// Decodes a state.
    ///
    /// # Errors
    /// `Input` if the bytes are not a complete and valid state.
    pub fn decode(bytes: &[u8]) -> Result<Self> {
        if !bytes.starts_with(MAGIC) {
            return Err(broken("it begins differently"));
        }
        let (body, check) = bytes.split_last_chunk::<8>().ok_or_else(|| broken("it ends early"))?;
        if checksum(body) != u64::from_le_bytes(*check) {
            return Err(broken("its checksum is wrong"));
        }
        // Anybody can compute the checksum, so the contents are not trusted.
        let Head { extent, samples, begun, about, body: start, bytes: length } = Head::decode(body)?;
        let pixels = &body[start..];
        if pixels.len() as u64 != length {
            return Err(broken(&format!("{} bytes of pixels, by its header {length}", pixels.len())));
        }
        let bytes_each = length / u64::from(LAYERS);
        let layers = pixels
            .chunks_exact(bytes_each as usize)
            .map(|layer| layer.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect())
            .collect();
        Ok(Self { about, sums: Sums::new(extent, layers, samples, begun) })
    }
}

impl Job {
    /// All data on which the bits of a picture depend.
    pub fn about(&self, gpu: &Gpu, about: &Value) -> Result<Value> {
        let device = gpu.describe();
        let settings = serde_json::to_value(&self.settings)
            .map_err(|error| Error::new(ErrorKind::Runtime, "the settings cannot be written").caused_by(error))?;
        Ok(json!({
            "about": about,
            "settings": settings,
            "extent": self.view.extent,
            "camera": self.view.clip_from_world.to_cols_array().map(f32::to_bits),
            "device": device.device,
            "driver": format!("{} {}", device.driver, device.driver_info).trim(),
            // Ray queries and compute shaders find hits at edges that differ in their last bits.
            "ray_query": gpu.caps().ray_query,
        }))
    }

    pub fn save(&self, gpu: &Gpu, about: &Value) -> Result<State> {
        Ok(State { about: self.about(gpu, about)?, sums: self.sums()? })
    }

    pub fn restore(&mut self, gpu: &Gpu, state: &State, about: &Value) -> Result<()> {
        let now = self.about(gpu, about)?;
        let mut differences = Vec::new();
        differ("", &state.about, &now, &mut differences);
        if !differences.is_empty() {
            let what = format!("is the state of another picture: {}", differences.join("; "));
            return Err(Error::input(what).help("Start again, or give the options of that picture"));
        }
        self.set_sums(&state.sums)
    }
}

/// Appends the names of the values that differ, with both values if they are short.
fn differ(name: &str, old: &Value, new: &Value, out: &mut Vec<String>) {
    if let (Value::Object(a), Value::Object(b)) = (old, new) {
        let keys: std::collections::BTreeSet<&String> = a.keys().chain(b.keys()).collect();
        for key in keys {
            let name = if name.is_empty() { key.clone() } else { format!("{name}.{key}") };
            differ(&name, a.get(key).unwrap_or(&Value::Null), b.get(key).unwrap_or(&Value::Null), out);
        }
    } else if old != new {
        let name = name.strip_prefix("about.").unwrap_or(name);
        let (old, new) = (old.to_string(), new.to_string());
        out.push(if old.len() + new.len() < 160 { format!("{name} was {old}, now is {new}") } else { name.to_owned() });
    }
}

/// FNV-1a over words of eight bytes: detects a truncated or damaged file.
fn checksum(bytes: &[u8]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    for chunk in bytes.chunks(8) {
        let mut word = [0; 8];
        word[..chunk.len()].copy_from_slice(chunk);
        hash = (hash ^ u64::from_le_bytes(word)).wrapping_mul(0x0000_0100_0000_01b3).rotate_left(17);
    }
    hash
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state() -> State {
        let layers = (0..9).map(|i| vec![[i as f32, 1.5, -2.0, f32::MIN_POSITIVE]; 6]).collect();
        State {
            about: json!({ "extent": [3, 2], "settings": { "bounces": 1 } }),
            sums: Sums::new([3, 2], layers, 7, 5),
        }
    }

    #[test]
    fn comes_back_and_damage_is_noticed() {
        let bytes = state().encode().unwrap();
        let back = State::decode(&bytes).unwrap();
        assert_eq!((back.about, back.sums), (state().about, state().sums));
        for length in [0, 10, 16, 40, bytes.len() - 1] {
            assert_eq!(State::decode(&bytes[..length]).unwrap_err().exit_code(), 3, "{length} bytes");
        }
        for at in (0..bytes.len()).step_by(7) {
            let mut broken = bytes.clone();
            broken[at] ^= 4;
            assert!(State::decode(&broken).is_err(), "byte {at}");
        }
    }

    /// A state with a changed number and a correct checksum.
    fn forged(number: usize, value: u64) -> Vec<u8> {
        let mut bytes = state().encode().unwrap();
        bytes[16 + 8 * number..24 + 8 * number].copy_from_slice(&value.to_le_bytes());
        let end = bytes.len() - 8;
        let check = checksum(&bytes[..end]);
        bytes[end..].copy_from_slice(&check.to_le_bytes());
        bytes
    }

    #[test]
    fn numbers_that_no_run_writes_are_refused() {
        // 3×2 pixels are one block of 64 slots.
        for (number, value, part) in [
            (0, u64::MAX, "text of 18446744073709551615 bytes"),
            (0, 1 << 23, "ends early"),
            (1, u64::MAX, "18446744073709551615 samples"),
            (1, 1 << 32, "there can be 4294967295"),
            (2, 64, "64 begun; there can be 4294967295 and 63"),
            (3, 8, "8 images, 9 are needed"),
            (3, u64::MAX, "images"),
        ] {
            let error = State::decode(&forged(number, value)).unwrap_err();
            assert!(error.exit_code() == 3 && error.to_string().contains(part), "{error} without {part:?}");
        }
        let most = State::decode(&forged(1, u32::MAX.into())).unwrap();
        assert_eq!(most.samples(), u64::from(u32::MAX));
        for extent in [json!([0, 2]), json!([u32::MAX, u32::MAX]), json!([3]), json!("x")] {
            let bytes = State { about: json!({ "extent": extent }), ..state() }.encode().unwrap();
            assert!(State::decode(&bytes).unwrap_err().to_string().contains("size"), "{extent}");
        }
        let bytes = State { about: json!({ "extent": [3, 3] }), ..state() }.encode().unwrap();
        assert!(State::decode(&bytes).unwrap_err().to_string().contains("bytes of pixels"));
    }

    #[test]
    fn a_glance_reads_the_head_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.state");
        std::fs::write(&path, &state().encode().unwrap()[..200]).unwrap();
        let head = State::glance(&path).unwrap();
        assert_eq!((head.extent, head.samples), ([3, 2], 7));
        assert!(State::most_bytes(head.extent) >= state().encode().unwrap().len() as u64);
        std::fs::write(&path, "nothing of the kind").unwrap();
        let error = State::glance(&path).unwrap_err();
        assert!(error.exit_code() == 3 && error.to_string().contains("a.state"), "{error}");
    }

    #[test]
    fn differences_are_named() {
        let mut out = Vec::new();
        let new = json!({ "extent": [3, 2], "settings": { "bounces": 2, "seed": 1 } });
        differ("", &state().about, &new, &mut out);
        assert_eq!(out, ["settings.bounces was 1, now is 2", "settings.seed was null, now is 1"]);
    }
}
