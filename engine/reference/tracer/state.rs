//! The state of a picture in the making as bytes, to go on in another process.

use super::{Sums, work::Job};
use crate::{Error, ErrorKind, Result, gpu::Gpu};
use serde_json::{Value, json};

/// First bytes of a state.
const MAGIC: &[u8; 16] = b"lucerna tracer 1";

/// A picture in the making, outside of the device.
#[derive(Clone, Debug)]
pub struct State {
    /// What the picture depends on.
    about: Value,
    sums: Sums,
}

impl State {
    /// Samples that every pixel has.
    pub fn samples(&self) -> u64 {
        self.sums.samples()
    }

    /// As bytes; the same state gives the same bytes.
    ///
    /// # Errors
    /// `Runtime` if `about` cannot be written.
    pub fn encode(&self) -> Result<Vec<u8>> {
        let about = serde_json::to_vec(&self.about)
            .map_err(|error| Error::new(ErrorKind::Runtime, "the state cannot be written").caused_by(error))?;
        let mut out = MAGIC.to_vec();
        let raw = self.sums.raw();
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

    /// From bytes.
    ///
    /// # Errors
    /// `Input` if they are not a whole state.
    pub fn decode(bytes: &[u8]) -> Result<Self> {
        let broken = |what: &str| Error::input(format!("is no state of a reference picture: {what}"));
        let rest = bytes.strip_prefix(MAGIC).ok_or_else(|| broken("it begins differently"))?;
        let (body, check) = bytes.split_last_chunk::<8>().ok_or_else(|| broken("it ends early"))?;
        if checksum(body) != u64::from_le_bytes(*check) {
            return Err(broken("its checksum is wrong"));
        }
        let mut rest = &rest[..rest.len().saturating_sub(8)];
        let mut number = || -> Result<u64> {
            let (head, tail) = rest.split_first_chunk::<8>().ok_or_else(|| broken("it ends early"))?;
            rest = tail;
            Ok(u64::from_le_bytes(*head))
        };
        let (length, samples, begun, count) = (number()?, number()?, number()?, number()?);
        let length =
            usize::try_from(length).ok().filter(|&l| l <= rest.len()).ok_or_else(|| broken("it ends early"))?;
        let (about, pixels) = rest.split_at(length);
        let about: Value = serde_json::from_slice(about).map_err(|error| broken("its text").caused_by(error))?;
        let side = |i: usize| about["extent"][i].as_u64().and_then(|v| u32::try_from(v).ok());
        let extent = [side(0), side(1)].map(|s| s.unwrap_or(0));
        let bytes_each = u64::from(extent[0]) * u64::from(extent[1]) * 16;
        if bytes_each == 0 || bytes_each.checked_mul(count) != Some(pixels.len() as u64) {
            return Err(broken("its size"));
        }
        let layers = pixels
            .chunks_exact(bytes_each as usize)
            .map(|layer| layer.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect())
            .collect();
        Ok(Self { about, sums: Sums::new(extent, layers, samples, begun) })
    }
}

impl Job {
    /// What the bits of a picture depend on.
    fn about(&self, gpu: &Gpu, about: &Value) -> Result<Value> {
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
            // Hits at edges differ in their last bits.
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
            return Err(Error::input(what).help("Start anew, or give the options that it was begun with"));
        }
        self.set_sums(&state.sums)
    }
}

/// Names of what differs, with both values where they are short.
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

/// FNV-1a over words of eight bytes: notices a torn or damaged file.
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

    #[test]
    fn differences_are_named() {
        let mut out = Vec::new();
        let new = json!({ "extent": [3, 2], "settings": { "bounces": 2, "seed": 1 } });
        differ("", &state().about, &new, &mut out);
        assert_eq!(out, ["settings.bounces was 1, now is 2", "settings.seed was null, now is 1"]);
    }
}
