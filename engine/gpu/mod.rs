//! The Vulkan layer: one open device ([`Gpu`]) and what is made from it.
//!
//! | want | use |
//! |---|---|
//! | open a device | [`Gpu::new`] with [`GpuOptions`] (`GpuOptions::from_env` reads `LUCERNA_DEVICE` and friends) |
//! | list devices | [`list_devices`] |
//! | images and buffers that outlive a frame | [`OwnedImage`], [`OwnedBuffer`]: cheap to clone, freed with the last clone |
//! | acceleration structures for ray queries | [`OwnedAccel`], where [`Caps::ray_query`] |
//! | record and run commands | [`Gpu::commands`] → [`Commands`] → [`Submission`]; waits are bounded and name the pass |
//! | pipelines, layouts | [`Gpu::compute_pipeline`], [`Gpu::raster_pipeline`]: cached, owned by the device |
//! | samplers | [`Gpu::sampler`] with the stock [`SamplerDesc`]s |
//! | descriptor sets of one frame | [`DescriptorArena`] |
//! | times of passes | [`Timestamps`] |
//! | how often their shaders start | [`Statistics`] |
//! | long work in short submissions | [`Tiles`] |
//! | what the device can do | [`Gpu::caps`] |
//! | tests | [`testing::with_gpu`] |
//!
//! Nothing here panics on what a driver answers. A lost device sets a latch: the first report names pass and device,
//! everything later fails at once with a reference to it.
#![allow(unsafe_code)]

mod accel;
mod buffer;
mod caps;
mod descriptors;
mod device;
mod exit;
mod facts;
mod fault;
mod format;
mod image;
mod image_desc;
mod instance;
mod loops;
mod memory;
mod modules;
mod options;
mod pipeline;
mod poison;
mod queries;
mod sampler;
mod select;
mod statistics;
mod submit;
pub mod testing;
mod tiles;
mod timestamps;
mod validation;

pub use accel::{AccelLayout, AccelLevel, BottomDesc, BottomInput, INSTANCE_BYTES, MAX_INSTANCES, OwnedAccel};
pub use buffer::{BufferDesc, OwnedBuffer, Place};
pub use caps::{Caps, Limits};
pub use descriptors::DescriptorArena;
pub use device::{Description, Gpu, Listed, list_devices};
pub use format::{Block, aspects, block};
pub use image::OwnedImage;
pub use image_desc::{ImageDesc, Region, ViewDesc};
pub use options::{DeviceChoice, ENVIRONMENT, GpuOptions, RayQuery, Traversal, Validation};
pub use pipeline::{Blend, Pipeline, RasterState, Stencil};
pub use sampler::SamplerDesc;
pub use select::{Choice, DeviceFacts, DeviceKind, Rejection, Requirements, Version, refusal, select};
pub use statistics::{Started, Statistics};
pub use submit::{Commands, Submission};
pub use tiles::Tiles;
pub use timestamps::Timestamps;
pub use validation::{ALLOWED, Allowed, Log, Message, Severity};
