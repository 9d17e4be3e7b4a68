//! Limits on the size of all vectors, checked before hours are spent on their computation.

use super::{Plan, Settings};
use crate::{Error, ErrorKind, Result, shaders::consts::FIV_FLOATS};

/// Most samples of a plan. With its header such a file is below the largest size that is read.
pub const MOST_SAMPLES: u64 = 1 << 27;

impl Plan {
    /// Bytes of all vectors.
    pub fn bytes(&self) -> u64 {
        self.samples().saturating_mul(4 * u64::from(FIV_FLOATS))
    }

    /// Checks the numbers of a plan by the rules of [`Settings::validate`].
    ///
    /// # Errors
    /// `Usage`, naming the key, the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        self.settings(&Settings::default()).validate()
    }

    /// Checks that a file can hold the vectors, and that a device with the limit `storage` on storage buffers (bytes)
    /// can use them.
    ///
    /// # Errors
    /// `Runtime`, naming the size found, the size allowed, and the settings that decide the size.
    pub fn fits(&self, storage: Option<u64>) -> Result<()> {
        let most = (MOST_SAMPLES * 4 * u64::from(FIV_FLOATS)).min(storage.unwrap_or(u64::MAX));
        if self.bytes() <= most {
            return Ok(());
        }
        let who = match storage {
            Some(storage) if storage == most => "the device allows",
            _ => "allowed are",
        };
        let (bytes, samples, occluders) = (self.bytes(), self.samples(), self.occluders.len());
        let what = format!("the vectors of {occluders} occluders, {samples} samples, have {bytes} bytes; {who} {most}");
        Err(Error::new(ErrorKind::Runtime, what)
            .at("fiv")
            .help("Take fewer samples (fiv.azimuths, fiv.polars, fiv.radii, fiv.turns) or fewer occluders"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::techniques::fiv::{plan::Kind, samples::Shells};

    #[test]
    fn what_is_too_large_is_refused_with_the_settings_that_decide_it() {
        let kind = Kind {
            name: "queen".into(),
            hash: "0".into(),
            radius: 1.0,
            shells: Shells { nearest: 1.0, farthest: 2.0 },
            triangles: 1,
            surface: 0,
            spacing: Default::default(),
        };
        let plan = |azimuths, count| Plan {
            occluders: vec![kind.clone(); count],
            ..Plan::new("sky", 1, &[], &Settings { azimuths, polars: 513, radii: 128, ..Settings::default() })
        };
        assert_eq!(plan(64, 1).bytes(), 64 * 513 * 128 * 36);
        plan(1024, 1).fits(None).unwrap();
        let text = plan(1024, 2).fits(None).unwrap_err().to_string();
        assert!(text.contains("2 occluders") && text.contains("4831838208") && text.contains("fiv.radii"), "{text}");
        let text = plan(64, 1).fits(Some(128 << 20)).unwrap_err().to_string();
        assert!(text.contains("the device allows 134217728"), "{text}");
        let wrong = Plan { split: 0, ..plan(64, 1) };
        assert!(wrong.validate().unwrap_err().to_string().contains("split"));
    }
}
