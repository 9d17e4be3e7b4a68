//! A Vulkan layer for tests. It fails chosen calls and lies about devices, as variables of the environment say:
//!
//! | variable | effect |
//! |---|---|
//! | `VKFAULT=vkCreateBuffer@3=OOM_DEVICE,…` | the third call fails; `@3+` the third and all later ones |
//! | `VKFAULT_HEAP_MB=100` | allocations beyond 100 MiB in all fail with out of device memory |
//! | `VKFAULT_NO_DEVICES=1` | no physical device is listed |
//! | `VKFAULT_API=1.2` | devices offer this version |
//! | `VKFAULT_HIDE_EXT=VK_KHR_x,…` | device extensions that are not offered |
//! | `VKFAULT_HIDE_FEATURE=dynamicRendering,…` | features that are not offered (the few of [`features`]) |
//! | `VKFAULT_HIDE_FORMAT=109,…` | formats (numbers of `VkFormat`) without any use |
//! | `VKFAULT_LIMIT=maxPushConstantsSize=64,…` | lowered limits (the few of [`limits`]) |
//! | `VKFAULT_REPORT=FILE` | each injected fault appends a line |
//!
//! Results: `OOM_DEVICE`, `OOM_HOST`, `DEVICE_LOST` (all later submits and waits of that process fail too, until a new device
//! is made), `TIMEOUT`, `INIT_FAILED`, `UNKNOWN`, `OUT_OF_DATE`, `SUBOPTIMAL`, `SURFACE_LOST`, `FEATURE`.
//!
//! Call counts begin anew with each instance.
#![allow(clippy::missing_safety_doc, clippy::undocumented_unsafe_blocks)]

mod chain;
mod lies;
mod rules;
mod wrap;

pub use lies::{features, limits};
