//! Memory that outlives a graph: transient images and buffers for the next graph, and history.

use std::collections::HashMap;

use ash::vk;

use super::super::{
    Graph,
    format::{Class, Format, ImageDesc},
    pass::{Imported, Origin, Owner},
    plan::{Physical, Plan, Shape, Source},
    vocab::{Resource, Usage},
    vulkan,
};
use crate::{
    Error, ErrorKind, Result,
    gpu::{BufferDesc, Gpu, OwnedAccel, OwnedBuffer, OwnedImage},
};

/// Runs after which memory that no graph asked for is given back.
const PATIENCE: u64 = 8;

/// An image or buffer in memory.
#[derive(Clone, Debug)]
pub(super) enum Memory {
    Image(OwnedImage),
    Buffer(OwnedBuffer),
    Accel(OwnedAccel),
}

#[derive(Debug)]
struct Slot {
    shape: Shape,
    usage: Usage,
    memory: Memory,
    name: String,
    last_run: u64,
}

/// Both halves of a history.
#[derive(Debug)]
struct Pair {
    shape: Shape,
    halves: [Memory; 2],
    /// The half that holds the last frame.
    previous: usize,
    /// Nothing was ever written.
    fresh: bool,
}

/// Everything that a runner keeps.
#[derive(Debug, Default)]
pub(super) struct Pool {
    slots: Vec<Slot>,
    history: HashMap<String, Pair>,
    run: u64,
}

/// The format that the device has instead of `format`: one depth-stencil format for the other.
pub(super) fn device_format(gpu: &Gpu, format: Format) -> Format {
    match (format.class(), gpu.caps().depth_stencil_format) {
        (Class::DepthStencil, Some(instead)) => Format::from_vk(instead),
        _ => format,
    }
}

/// Uses that history images are made for, whatever the graph at hand does: another one may do more.
fn history_usage(gpu: &Gpu, format: Format) -> vk::ImageUsageFlags {
    use vk::{FormatFeatureFlags as F, ImageUsageFlags as U};
    let features = gpu.format_features(format.to_vk());
    let table = [
        (F::SAMPLED_IMAGE, U::SAMPLED),
        (F::STORAGE_IMAGE, U::STORAGE),
        (F::COLOR_ATTACHMENT, U::COLOR_ATTACHMENT),
        (F::DEPTH_STENCIL_ATTACHMENT, U::DEPTH_STENCIL_ATTACHMENT),
    ];
    let all = U::TRANSFER_SRC | U::TRANSFER_DST;
    table.iter().filter(|(f, _)| features.contains(*f)).fold(all, |all, (_, u)| all | *u)
}

fn make(gpu: &Gpu, name: &str, shape: Shape, usage: Usage, history: bool) -> Result<Memory> {
    Ok(match shape {
        Shape::Image(desc) => {
            let desc = ImageDesc { format: device_format(gpu, desc.format), ..desc };
            let flags = if history { history_usage(gpu, desc.format) } else { vulkan::image_usage(usage) };
            Memory::Image(OwnedImage::new(gpu, name, vulkan::image_desc(&desc, flags))?)
        }
        Shape::Buffer(bytes) if usage.contains(Usage::HOST) => {
            Memory::Buffer(OwnedBuffer::new(gpu, name, BufferDesc::readback(bytes))?)
        }
        Shape::Buffer(bytes) => Memory::Buffer(OwnedBuffer::new(gpu, name, BufferDesc::device(bytes))?),
    })
}

impl Pool {
    /// Memory for every physical resource of `plan`, in its order; and that which must be cleared first.
    pub fn acquire(&mut self, gpu: &Gpu, graph: &Graph, plan: &Plan) -> Result<(Vec<Memory>, Vec<Memory>)> {
        self.run += 1;
        let mut memory = Vec::with_capacity(plan.physical.len());
        let mut fresh = Vec::new();
        for physical in &plan.physical {
            let found = match &physical.source {
                Source::Pool => self.pooled(gpu, plan, physical)?,
                Source::History { key, next } => {
                    let pair = self.pair(gpu, key, physical.shape)?;
                    if pair.fresh && !next {
                        fresh.push(pair.halves[pair.previous].clone());
                    }
                    if pair.fresh && *next {
                        fresh.push(pair.halves[1 - pair.previous].clone());
                    }
                    pair.halves[if *next { 1 - pair.previous } else { pair.previous }].clone()
                }
                Source::Imported(_) => imported(graph, physical)?,
            };
            memory.push(found);
        }
        let run = self.run;
        self.slots.retain(|s| run - s.last_run <= PATIENCE);
        Ok((memory, fresh))
    }

    fn pooled(&mut self, gpu: &Gpu, plan: &Plan, physical: &Physical) -> Result<Memory> {
        let names: Vec<&str> = physical.occupants.iter().map(|r| plan.name(*r)).collect();
        let name = names.join(" / ");
        let run = self.run;
        let fits = |s: &&mut Slot| {
            let host = s.usage.contains(Usage::HOST) == physical.usage.contains(Usage::HOST);
            let buffer = matches!(physical.shape, Shape::Buffer(_));
            s.last_run < run && s.shape == physical.shape && host && (buffer || s.usage == physical.usage)
        };
        if let Some(slot) = self.slots.iter_mut().find(fits) {
            slot.last_run = run;
            if slot.name != name {
                match &slot.memory {
                    Memory::Image(image) => gpu.name(image.raw(), &name),
                    Memory::Buffer(buffer) => gpu.name(buffer.raw(), &name),
                    Memory::Accel(_) => {}
                }
                slot.name = name;
            }
            return Ok(slot.memory.clone());
        }
        let memory = make(gpu, &name, physical.shape, physical.usage, false)?;
        let slot = Slot { shape: physical.shape, usage: physical.usage, memory: memory.clone(), name, last_run: run };
        self.slots.push(slot);
        Ok(memory)
    }

    fn pair(&mut self, gpu: &Gpu, key: &str, shape: Shape) -> Result<&Pair> {
        if self.history.get(key).is_none_or(|p| p.shape != shape) {
            let halves = [
                make(gpu, &format!("{key} (even)"), shape, Usage::NONE, true)?,
                make(gpu, &format!("{key} (odd)"), shape, Usage::NONE, true)?,
            ];
            self.history.insert(key.to_owned(), Pair { shape, halves, previous: 0, fresh: true });
        }
        self.history.get(key).ok_or_else(|| Error::new(ErrorKind::Runtime, format!("history `{key}` is missing")))
    }

    /// After a graph ran: this frame's halves become last frame's.
    pub fn turn(&mut self, graph: &Graph) {
        let keys = graph
            .images
            .iter()
            .map(|i| &i.origin)
            .chain(graph.buffers.iter().map(|b| &b.origin))
            .filter_map(|o| if let Origin::History { key, next: true } = o { Some(key) } else { None });
        for key in keys {
            if let Some(pair) = self.history.get_mut(key) {
                pair.previous = 1 - pair.previous;
                pair.fresh = false;
            }
        }
    }

    /// Transient images and buffers kept.
    #[cfg(test)]
    pub fn len(&self) -> usize {
        self.slots.len()
    }

    /// Forgets all history: the next frame is a first one.
    pub fn forget(&mut self) {
        self.history.clear();
    }
}

fn imported(graph: &Graph, physical: &Physical) -> Result<Memory> {
    let (name, origin) = match physical.occupants.first() {
        Some(Resource::Image(i)) => (&graph.images[*i as usize].name, &graph.images[*i as usize].origin),
        Some(Resource::Buffer(i)) => (&graph.buffers[*i as usize].name, &graph.buffers[*i as usize].origin),
        None => return Err(Error::new(ErrorKind::Runtime, "a physical resource without use")),
    };
    match origin {
        Origin::Imported(Imported { owner: Owner::Image(image), rest, contents, .. }) => {
            let expected = if *contents { rest.to_vk() } else { vk::ImageLayout::UNDEFINED };
            if image.layout() != expected {
                let what = format!(
                    "image `{name}` was in layout {expected:?} when it was imported, now it is in {:?}",
                    image.layout()
                );
                return Err(
                    Error::new(ErrorKind::Runtime, what).help("Import images after the graphs that write them ran")
                );
            }
            Ok(Memory::Image(image.clone()))
        }
        Origin::Imported(Imported { owner: Owner::Buffer(buffer), .. }) => Ok(Memory::Buffer(buffer.clone())),
        Origin::Imported(Imported { owner: Owner::Accel(accel), .. }) => Ok(Memory::Accel(accel.clone())),
        _ => Err(Error::new(ErrorKind::Runtime, format!("`{name}` is only described; it cannot be run"))),
    }
}
