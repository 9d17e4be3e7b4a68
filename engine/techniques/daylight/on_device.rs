//! The light of a bake on the device: the tiles with their images and, with frames, the light of the sun step by step.

use std::time::Duration;

use super::{
    Baked,
    pages::BlockPages,
    pictures::{fits, packed},
    steps::Mixture,
    stream::Stream,
};
use crate::{
    Result,
    gpu::{Gpu, OwnedBuffer},
    graph::{Buffer, Graph},
};

/// Frames that a picture mixes at most.
const MOST_FRAMES: usize = 4;

/// The light of a bake on the device.
#[derive(Debug)]
pub(super) struct OnDevice {
    gpu: Gpu,
    tiles: OwnedBuffer,
    words: OwnedBuffer,
    pages: BlockPages,
    frames: Option<FrameStore>,
}

/// The frames on the device.
#[derive(Debug)]
enum FrameStore {
    Resident(Vec<OwnedBuffer>),
    /// The reader, and the last steps that pictures needed.
    Streamed(Stream, Vec<(usize, OwnedBuffer)>),
}

/// The frames of a picture.
pub(super) struct Frames {
    /// Four; what is not needed is any buffer.
    pub buffers: [Buffer; MOST_FRAMES],
    /// Steps that the picture needed and that were not on the device.
    pub uploaded: usize,
    /// How long the picture waited for the disk.
    pub waited: Duration,
}

impl OnDevice {
    /// # Errors
    /// `Runtime` if the images are larger than the device's limit; `Input` for damaged frames; `OutOfMemory`.
    pub fn new(gpu: &Gpu, baked: &Baked) -> Result<Self> {
        let stored = &baked.stored;
        let columns = |index: usize| stored.plan.tile(index as u32)[2];
        let (tiles, words) = packed(stored.tiles.iter().enumerate().map(|(index, tile)| (tile, columns(index))));
        let fits = |bytes: u64| {
            fits(gpu, bytes).map_err(|error| baked.blamed(error.help("Bake fewer texels, or use another device")))
        };
        fits(4 * words.len() as u64)?;
        let mut frames = None;
        if let Some(file) = &baked.frames {
            fits(file.step_bytes())?;
            frames = Some(match baked.stream {
                Some(ring) => FrameStore::Streamed(Stream::new(file, ring)?, Vec::new()),
                None => {
                    let mut reader = file.reader()?;
                    let steps = (0..file.steps as usize).map(|step| {
                        let light = file.read(&mut reader, step)?;
                        OwnedBuffer::with_contents(gpu, &format!("daylight.frame {step}"), &light)
                    });
                    FrameStore::Resident(steps.collect::<Result<_>>()?)
                }
            });
        }
        Ok(Self {
            gpu: gpu.clone(),
            tiles: OwnedBuffer::with_contents(gpu, "daylight.tiles", bytemuck::cast_slice(&tiles))?,
            words: OwnedBuffer::with_contents(gpu, "daylight.words", bytemuck::cast_slice(&words))?,
            pages: BlockPages::new(gpu, baked).map_err(|error| baked.blamed(error))?,
            frames,
        })
    }

    /// The textures of images in blocks.
    pub fn pages(&self) -> &BlockPages {
        &self.pages
    }

    pub fn tiles(&self, graph: &mut Graph) -> Buffer {
        graph.import_buffer(&self.tiles)
    }

    pub fn words(&self, graph: &mut Graph) -> Buffer {
        graph.import_buffer(&self.words)
    }

    /// Whether the light of the sun is in frames.
    pub fn has_frames(&self) -> bool {
        self.frames.is_some()
    }

    /// The frames that a mixture needs, in its order. `upcoming`: steps of the next pictures.
    ///
    /// # Errors
    /// As [`Stream::fetch`]; `OutOfMemory`.
    pub fn frames(
        &mut self,
        graph: &mut Graph,
        mixture: &Mixture,
        upcoming: impl Iterator<Item = usize>,
    ) -> Result<Frames> {
        let needed: Vec<usize> = mixture.times().take(MOST_FRAMES).collect();
        let (mut uploaded, mut waited) = (0, Duration::ZERO);
        let owned: Vec<OwnedBuffer> = match &mut self.frames {
            None => Vec::new(),
            Some(FrameStore::Resident(all)) => needed.iter().filter_map(|step| all.get(*step).cloned()).collect(),
            Some(FrameStore::Streamed(stream, there)) => {
                let fetched = stream.fetch(&needed, upcoming)?;
                waited = fetched.waited;
                for (step, light) in needed.iter().zip(&fetched.steps) {
                    if there.iter().any(|(s, _)| s == step) {
                        continue;
                    }
                    uploaded += 1;
                    // The graph of an earlier picture may still hold a buffer, but it has run.
                    match there.iter_mut().find(|(s, _)| !needed.contains(s)) {
                        Some((s, buffer)) => {
                            // Of no step until the upload has succeeded.
                            *s = usize::MAX;
                            buffer.upload(0, light)?;
                            *s = *step;
                        }
                        None => {
                            let name = format!("daylight.frame slot {}", there.len());
                            there.push((*step, OwnedBuffer::with_contents(&self.gpu, &name, light)?));
                        }
                    }
                }
                let of = |step: &usize| there.iter().find(|(s, _)| s == step).map(|(_, buffer)| buffer.clone());
                needed.iter().filter_map(of).collect()
            }
        };
        let other = graph.import_buffer(&self.words);
        let buffers = std::array::from_fn(|i| owned.get(i).map_or(other, |buffer| graph.import_buffer(buffer)));
        Ok(Frames { buffers, uploaded, waited })
    }
}
