//! A picture as a job of [`crate::bake`]. A unit is a band: some rows of the picture with all samples. Its bytes are the sums over samples of
//! these rows, 32-bit floats, low byte first. The samples of a pixel are summed in the same order in any band, so the joined picture has the
//! bits of one that is traced as a whole.

use std::ops::Range;

use serde_json::Value;

use super::{
    Sums, Tracer,
    job::{BLOCK, Job as Work, LAYERS, slots_of},
};
use crate::{
    Error, ErrorKind, Result,
    bake::{Job, Key, Stage, Store, UnitId},
};

/// The name of such jobs.
pub const KIND: &str = "reference";
/// Increased whenever the path tracer changes its pictures.
const VERSION: u32 = 1;
/// About the minimum of slots of a band: fewer do not occupy a GPU.
const LEAST: u64 = 1 << 14;
/// Maximum of bands.
const MOST: u64 = 64;
/// Bytes of a pixel in all sums.
const BYTES: u64 = 16 * LAYERS as u64;

/// The bands of a picture: rows of pixels, from the top.
pub fn of([width, height]: [u32; 2]) -> Vec<Range<u32>> {
    let blocks = u64::from(height.div_ceil(BLOCK));
    let slots = slots_of([width, height]).unwrap_or(u64::MAX);
    let count = (slots / LEAST).clamp(1, MOST.min(blocks.max(1)));
    let row = |band: u64| ((blocks * band / count) as u32).saturating_mul(BLOCK).min(height);
    (0..count).map(|band| row(band)..row(band + 1)).collect()
}

impl Tracer<'_> {
    /// The job of the picture that [`Self::start`] has begun, with `samples` paths per pixel. `about`: further data on which the picture
    /// depends (scene, …), an object.
    ///
    /// # Errors
    /// `Usage` before [`Self::start`].
    pub fn bands(&self, samples: u64, about: &Value) -> Result<Job> {
        let picture = self.job()?;
        let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        let mut key = Key::new(KIND, VERSION).text("samples", &samples.to_string());
        let all = picture.about(self.kernel.gpu(), about)?;
        for (name, value) in all.as_object().into_iter().flatten() {
            match value {
                Value::Object(parts) => {
                    for (part, value) in parts {
                        key = key.text(&format!("{name}.{part}"), &text(value));
                    }
                }
                value => key = key.text(name, &text(value)),
            }
        }
        let width = u64::from(picture.view.extent[0]);
        let paths = |rows: &Range<u32>| samples.saturating_mul(width * u64::from(rows.end - rows.start));
        Job::new(key, vec![Stage::new("bands", of(picture.view.extent).iter().map(paths).collect())])
    }

    /// Traces a band of the picture that [`Self::start`] has begun; its bytes. Samples that the picture had are dropped.
    ///
    /// # Errors
    /// As [`Tracer::run`]; `Interrupted` if `go_on` returned false before the last sample; `Usage` if the picture has no such band.
    pub fn band(&mut self, unit: UnitId, samples: u64, mut go_on: impl FnMut() -> bool) -> Result<Vec<u8>> {
        let (view, settings) = (self.job()?.view, self.job()?.settings.clone());
        let none = || Error::usage(format!("the picture has no band {}", unit.index));
        let rows = of(view.extent).into_iter().nth(unit.index as usize).ok_or_else(none)?;
        // The sums of the whole picture are not needed while there are those of the band.
        self.job = None;
        self.job = Some(Work::of_rows(self.kernel.gpu(), view, settings.clone(), rows)?);
        let traced = self.run(samples, |_| go_on()).and_then(|progress| Ok((progress, self.sums()?)));
        self.job = None;
        self.job = Some(Work::new(self.kernel.gpu(), view, settings)?);
        let (progress, sums) = traced?;
        if progress.samples < samples as f64 {
            return Err(Error::new(ErrorKind::Interrupted, "stopped on request"));
        }
        Ok(sums.raw().iter().flat_map(|layer| bytemuck::cast_slice(layer).to_vec()).collect())
    }

    /// Puts the picture together from a job whose units are all there.
    ///
    /// # Errors
    /// `Input`, naming the file, if a unit is missing or damaged; `Usage` before [`Self::start`].
    pub fn join(&mut self, store: &Store, samples: u64) -> Result<()> {
        let extent = self.job()?.view.extent;
        let mut layers = vec![Vec::new(); LAYERS as usize];
        for (unit, rows) in store.job().units().zip(of(extent)) {
            let payload = store.open_unit(unit)?;
            payload.verify()?;
            let wanted = BYTES * u64::from(extent[0]) * u64::from(rows.end - rows.start);
            if payload.len() != wanted {
                let what = format!("has {} bytes, {wanted} are needed", payload.len());
                return Err(Error::input(what).in_file(store.path(unit)).help("Remove the file, and it is made anew"));
            }
            let bytes = payload.bytes()?;
            for (layer, part) in layers.iter_mut().zip(bytes.chunks_exact(bytes.len() / LAYERS as usize)) {
                layer.extend(part.chunks_exact(16).map(bytemuck::pod_read_unaligned::<[f32; 4]>));
            }
        }
        self.job_mut()?.set_sums(&Sums::new(extent, layers, samples, 0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bands_are_all_rows_once_in_whole_blocks() {
        for extent in [[1, 1], [24, 20], [640, 480], [641, 479], [4096, 2160], [16384, 16384], [65536, 8], [1, 65536]] {
            let bands = of(extent);
            assert!((1..=MOST as usize).contains(&bands.len()), "{extent:?}: {} bands", bands.len());
            assert!(bands[0].start == 0 && bands.last().unwrap().end == extent[1], "{extent:?}: {bands:?}");
            assert!(bands.iter().all(|rows| rows.start < rows.end && rows.start % BLOCK == 0), "{bands:?}");
            assert!(bands.windows(2).all(|pair| pair[0].end == pair[1].start), "{extent:?}: {bands:?}");
        }
        assert_eq!(of([640, 480]).len(), 18);
    }
}
