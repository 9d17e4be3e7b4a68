//! The work on one picture: its sums, and how far they are.

use std::{ops::Range, time::Duration};

use super::{Progress, Settings, Sums};
use crate::{
    Error, ErrorKind, Result,
    gpu::{BufferDesc, Gpu, OwnedBuffer},
    scene::View,
    shaders::consts,
};

/// Side of the blocks of pixels by which slots are ordered.
pub(super) const BLOCK: u32 = 8;
/// Slots of a block: one workgroup.
pub(super) const GRANULE: u32 = BLOCK * BLOCK;
/// Layers of the sums: six sums, and the rounding errors of the first three.
pub(super) const LAYERS: u32 = consts::PATH_SUMS + consts::PATH_EXACT_SUMS;

/// Bytes of a pixel in one layer.
const LAYER_TEXEL: u64 = 16;

/// The work on a picture.
#[derive(Debug)]
pub(super) struct Job {
    pub view: View,
    pub settings: Settings,
    /// The layers one after the other, each row by row. Shaders use them by their address.
    pub sums: OwnedBuffer,
    /// The rows of pixels that are traced, for which there are sums: whole blocks, except at the lower end of the picture.
    rows: Range<u32>,
    /// Finished slots, summed over all samples.
    pub done: u64,
    pub time: Duration,
}

impl Job {
    pub fn new(gpu: &Gpu, view: View, settings: Settings) -> Result<Self> {
        let rows = 0..view.extent[1];
        Self::of_rows(gpu, view, settings, rows)
    }

    /// The work on these rows alone, which are those of whole blocks.
    pub fn of_rows(gpu: &Gpu, view: View, settings: Settings, rows: Range<u32>) -> Result<Self> {
        let [width, height] = [view.extent[0], rows.end - rows.start];
        let most = gpu.caps().limits.image_2d;
        if width.max(height) > most {
            let what = format!("a picture of {width}×{height}; the device allows sides of {most}");
            return Err(Error::new(ErrorKind::Runtime, what));
        }
        let bytes = u64::from(LAYERS) * LAYER_TEXEL * u64::from(width) * u64::from(height);
        let sums = OwnedBuffer::new(gpu, "tracer.sums", BufferDesc::device(bytes))?;
        Ok(Self { view, settings, sums, rows, done: 0, time: Duration::ZERO })
    }

    /// Columns and rows of the pixels that are traced.
    pub fn extent(&self) -> [u32; 2] {
        [self.view.extent[0], self.rows.end - self.rows.start]
    }

    /// Number of the pixels that are traced.
    pub fn pixels(&self) -> u64 {
        let [width, height] = self.extent();
        u64::from(width) * u64::from(height)
    }

    /// The first row that is traced.
    pub fn first_row(&self) -> u32 {
        self.rows.start
    }

    /// Slots of one sample: the pixels, rounded up to whole blocks.
    pub fn slots(&self) -> u64 {
        // The number of slots of every image that a device supports fits into 64 bits.
        slots_of(self.extent()).unwrap_or(u64::MAX)
    }

    /// The slot of the first pixel that is traced.
    pub fn first_slot(&self) -> u64 {
        slots_of([self.view.extent[0], self.rows.start]).unwrap_or(u64::MAX)
    }

    /// Samples of every pixel.
    pub fn samples_done(&self) -> u64 {
        self.done / self.slots()
    }

    pub fn progress(&self) -> Progress {
        let [width, height] = self.extent().map(u64::from);
        let samples = self.done as f64 / self.slots() as f64;
        Progress { samples, paths: (samples * (width * height) as f64) as u64, time: self.time }
    }

    pub fn sums(&self) -> Result<Sums> {
        let [width, height] = self.extent();
        let layer = |layer| -> Result<Vec<[f32; 4]>> {
            // The first tile clears the sums.
            if self.done == 0 {
                return Ok(vec![[0.0; 4]; width as usize * height as usize]);
            }
            let bytes = LAYER_TEXEL * self.pixels();
            let range = bytes * u64::from(layer)..bytes * (u64::from(layer) + 1);
            Ok(self.sums.read_range(range)?.chunks_exact(16).map(bytemuck::pod_read_unaligned).collect())
        };
        let layers = (0..LAYERS).map(layer).collect::<Result<_>>()?;
        Ok(Sums::new([width, height], layers, self.done / self.slots(), self.done % self.slots()))
    }

    /// Replaces the sums.
    pub fn set_sums(&mut self, sums: &Sums) -> Result<()> {
        let mut offset = 0;
        for layer in sums.raw() {
            let bytes: &[u8] = bytemuck::cast_slice(layer);
            self.sums.upload(offset, bytes)?;
            offset += bytes.len() as u64;
        }
        self.done = sums.samples() * self.slots() + sums.begun();
        Ok(())
    }
}

/// Slots of one sample of a picture of this size; `None` on overflow.
pub(super) fn slots_of(extent: [u32; 2]) -> Option<u64> {
    let [width, height] = extent.map(|side| u64::from(side.div_ceil(BLOCK)));
    width.checked_mul(height)?.checked_mul(GRANULE.into())
}
