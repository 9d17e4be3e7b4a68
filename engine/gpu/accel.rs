//! Acceleration structures for ray queries: one top level over instances, bottom levels over triangles, in one buffer.

use std::{
    fmt,
    ops::Range,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use ash::vk;

use super::{
    Gpu,
    buffer::{BufferDesc, OwnedBuffer, Place},
    device::Context,
    submit::Commands,
};
use crate::{Error, ErrorKind, Result};

/// Structures start at multiples of this many bytes in their buffer.
const OFFSET_ALIGNMENT: u64 = 256;
/// Bytes of a vertex position: three floats.
const VERTEX_STRIDE: u64 = 12;
/// Bytes of a `VkAccelerationStructureInstanceKHR`.
pub const INSTANCE_BYTES: u64 = 64;
/// Instances are numbered with 24 bits, and every device takes that many.
pub const MAX_INSTANCES: u32 = (1 << 24) - 1;

/// What a bottom level is to hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BottomDesc {
    /// At least one.
    pub triangles: u32,
    /// Vertices that its indices may name.
    pub vertices: u32,
    /// Its vertices will move: it can be refitted.
    pub deforms: bool,
}

/// A level in its buffer, and the scratch memory that building it takes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AccelLevel {
    /// Bytes in the buffer.
    pub range: Range<u64>,
    /// Bytes of scratch memory to build it.
    pub build_scratch: u64,
    /// Bytes of scratch memory to refit it.
    pub refit_scratch: u64,
}

/// Where everything of an [`OwnedAccel`] lies: all that planning needs to know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AccelLayout {
    /// Bytes of the buffer.
    pub bytes: u64,
    pub bottoms: Vec<(BottomDesc, AccelLevel)>,
    pub top: AccelLevel,
    /// Most instances of the top level.
    pub instances: u32,
    /// Scratch memory starts at multiples of it.
    pub scratch_alignment: u64,
}

/// One bottom level to build or refit from triangles in device memory.
#[derive(Clone, Copy, Debug)]
pub struct BottomInput {
    /// Number of the bottom level.
    pub bottom: u32,
    /// Addresses of the first vertex (three floats each) and of the first index (32 bits, from that vertex).
    pub vertices: vk::DeviceAddress,
    pub indices: vk::DeviceAddress,
    /// Keep the tree and move its boxes; only for one that deforms and was built.
    pub refit: bool,
    /// Address of its own part of the scratch memory.
    pub scratch: vk::DeviceAddress,
}

/// Acceleration structures with their memory. Clones share them; the last one frees them (after everything submitted with
/// [`Commands::keep`] is done).
#[derive(Clone)]
pub struct OwnedAccel(Arc<Inner>);

struct Inner {
    context: Arc<Context>,
    buffer: OwnedBuffer,
    layout: Arc<AccelLayout>,
    top: vk::AccelerationStructureKHR,
    /// With the address that instances name.
    bottoms: Vec<(vk::AccelerationStructureKHR, vk::DeviceAddress)>,
    built: AtomicBool,
}

impl fmt::Debug for OwnedAccel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Inner { buffer, layout, .. } = &*self.0;
        write!(f, "OwnedAccel(`{}`, {} bottom levels, {} bytes)", buffer.name(), layout.bottoms.len(), layout.bytes)
    }
}

impl Drop for Inner {
    fn drop(&mut self) {
        let Some(functions) = self.context.accel.as_ref().filter(|_| !self.context.abandoned()) else { return };
        for (raw, _) in self.bottoms.drain(..).chain([(self.top, 0)]) {
            // SAFETY: the last owner; submissions that use the structures keep a clone until they are done.
            unsafe { functions.destroy_acceleration_structure(raw, None) };
        }
    }
}

impl OwnedAccel {
    /// Structures of these sizes; nothing is built yet.
    ///
    /// # Errors
    /// `Runtime` on a device without ray queries ([`super::Caps::ray_query`]), or over [`MAX_INSTANCES`]; `OutOfMemory`.
    pub fn new(gpu: &Gpu, name: &str, bottoms: &[BottomDesc], instances: u32) -> Result<Self> {
        let context = &gpu.0;
        context.alive()?;
        let Some(functions) = &context.accel else {
            let what = format!("`{name}` needs ray queries, which are not on for {}", context.description.device);
            return Err(Error::new(ErrorKind::Runtime, what));
        };
        if instances > MAX_INSTANCES {
            let what = format!("`{name}` has {instances} instances; a ray query can tell {MAX_INSTANCES} apart");
            return Err(Error::new(ErrorKind::Runtime, what));
        }
        let layout = Arc::new(layout(context, functions, bottoms, instances));
        use vk::BufferUsageFlags as U;
        let desc = BufferDesc {
            size: layout.bytes,
            usage: U::ACCELERATION_STRUCTURE_STORAGE_KHR | U::SHADER_DEVICE_ADDRESS,
            place: Place::Device,
        };
        let buffer = OwnedBuffer::new(gpu, name, desc)?;
        let mut inner = Inner {
            context: Arc::clone(context),
            buffer,
            layout: Arc::clone(&layout),
            top: vk::AccelerationStructureKHR::null(),
            bottoms: Vec::with_capacity(bottoms.len()),
            built: AtomicBool::new(false),
        };
        // From here on `inner` cleans up.
        let make = |level: &AccelLevel, ty, buffer: &OwnedBuffer| {
            let info = vk::AccelerationStructureCreateInfoKHR::default()
                .buffer(buffer.raw())
                .offset(level.range.start)
                .size(level.range.end - level.range.start)
                .ty(ty);
            // SAFETY: the range lies in the buffer at an allowed offset; the buffer lives as long as the structure.
            let made = unsafe { functions.create_acceleration_structure(&info, None) };
            context.check(made, || format!("vkCreateAccelerationStructureKHR for `{name}`"))
        };
        for (number, (_, level)) in layout.bottoms.iter().enumerate() {
            let raw = make(level, vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL, &inner.buffer)?;
            context.name(raw, &format!("{name} bottom {number}"));
            let info = vk::AccelerationStructureDeviceAddressInfoKHR::default().acceleration_structure(raw);
            // SAFETY: made just now.
            let address = unsafe { functions.get_acceleration_structure_device_address(&info) };
            inner.bottoms.push((raw, address));
        }
        inner.top = make(&layout.top, vk::AccelerationStructureTypeKHR::TOP_LEVEL, &inner.buffer)?;
        context.name(inner.top, &format!("{name} top"));
        Ok(Self(Arc::new(inner)))
    }

    pub fn name(&self) -> &str {
        self.0.buffer.name()
    }

    /// Where everything lies.
    pub fn layout(&self) -> &Arc<AccelLayout> {
        &self.0.layout
    }

    /// The buffer in which all levels lie.
    pub fn buffer(&self) -> &OwnedBuffer {
        &self.0.buffer
    }

    /// The top level, for descriptors.
    pub fn raw(&self) -> vk::AccelerationStructureKHR {
        self.0.top
    }

    /// What an instance of bottom level `bottom` refers to it by; 0, which is never hit, if there is none of this number.
    pub fn address(&self, bottom: u32) -> vk::DeviceAddress {
        self.0.bottoms.get(bottom as usize).map_or(0, |b| b.1)
    }

    /// Every level was built once.
    pub fn is_built(&self) -> bool {
        self.0.built.load(Ordering::Acquire)
    }

    /// Every level was built by a submission that is done.
    pub fn set_built(&self) {
        self.0.built.store(true, Ordering::Release);
    }

    /// Records builds of bottom levels, which may run at the same time. The caller sees to barriers, keeps everything
    /// alive, and gives each input its own scratch memory of the size and alignment of the layout.
    pub fn record_bottoms(&self, commands: &mut Commands, inputs: &[BottomInput]) {
        let Some(functions) = &self.0.context.accel else { return };
        let inputs: Vec<_> =
            inputs.iter().filter_map(|i| Some((i, self.0.layout.bottoms.get(i.bottom as usize)?.0))).collect();
        let geometries: Vec<_> = inputs.iter().map(|(i, desc)| [triangles(desc, i.vertices, i.indices)]).collect();
        let ranges: Vec<_> = inputs
            .iter()
            .map(|(_, desc)| [vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(desc.triangles)])
            .collect();
        let infos: Vec<_> = inputs
            .iter()
            .zip(&geometries)
            .map(|((input, desc), geometry)| {
                let raw = self.0.bottoms[input.bottom as usize].0;
                let info = build_info(vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL, desc.deforms)
                    .geometries(geometry)
                    .dst_acceleration_structure(raw)
                    .scratch_data(vk::DeviceOrHostAddressKHR { device_address: input.scratch });
                if input.refit && desc.deforms {
                    info.mode(vk::BuildAccelerationStructureModeKHR::UPDATE).src_acceleration_structure(raw)
                } else {
                    info
                }
            })
            .collect();
        let ranges: Vec<&[_]> = ranges.iter().map(|r| r.as_slice()).collect();
        if !infos.is_empty() {
            // SAFETY: in recording; sizes are those the structures were made for; the rest is the caller's promise.
            unsafe { functions.cmd_build_acceleration_structures(commands.raw(), &infos, &ranges) };
        }
    }

    /// Records the build of the top level from `count` instances (`VkAccelerationStructureInstanceKHR`) at this address. As
    /// for [`Self::record_bottoms`].
    pub fn record_top(
        &self,
        commands: &mut Commands,
        instances: vk::DeviceAddress,
        count: u32,
        scratch: vk::DeviceAddress,
    ) {
        let Some(functions) = &self.0.context.accel else { return };
        let geometry = [boxes(instances)];
        let info = build_info(vk::AccelerationStructureTypeKHR::TOP_LEVEL, false)
            .geometries(&geometry)
            .dst_acceleration_structure(self.0.top)
            .scratch_data(vk::DeviceOrHostAddressKHR { device_address: scratch });
        let count = count.min(self.0.layout.instances);
        let range = [vk::AccelerationStructureBuildRangeInfoKHR::default().primitive_count(count)];
        // SAFETY: in recording; no more instances than the structure was made for; the rest is the caller's promise.
        unsafe { functions.cmd_build_acceleration_structures(commands.raw(), &[info], &[&range]) };
    }
}

/// The sizes of all levels, one after the other.
fn layout(
    context: &Context,
    functions: &ash::khr::acceleration_structure::Device,
    bottoms: &[BottomDesc],
    instances: u32,
) -> AccelLayout {
    let mut end = 0;
    let mut level = |info: vk::AccelerationStructureBuildGeometryInfoKHR<'_>, primitives: u32| {
        let mut sizes = vk::AccelerationStructureBuildSizesInfoKHR::default();
        let device = vk::AccelerationStructureBuildTypeKHR::DEVICE;
        // SAFETY: complete info with one geometry, and one count for it.
        unsafe { functions.get_acceleration_structure_build_sizes(device, &info, &[primitives], &mut sizes) };
        let start = end;
        end += sizes.acceleration_structure_size.max(1).next_multiple_of(OFFSET_ALIGNMENT);
        AccelLevel {
            range: start..end,
            build_scratch: sizes.build_scratch_size,
            refit_scratch: sizes.update_scratch_size,
        }
    };
    let bottoms = bottoms
        .iter()
        .map(|desc| {
            let geometry = [triangles(desc, 0, 0)];
            let info = build_info(vk::AccelerationStructureTypeKHR::BOTTOM_LEVEL, desc.deforms).geometries(&geometry);
            (*desc, level(info, desc.triangles))
        })
        .collect();
    let geometry = [boxes(0)];
    let top = level(build_info(vk::AccelerationStructureTypeKHR::TOP_LEVEL, false).geometries(&geometry), instances);
    let scratch_alignment = context.caps.limits.accel_scratch_alignment;
    AccelLayout { bytes: end, bottoms, top, instances, scratch_alignment }
}

fn build_info<'a>(
    ty: vk::AccelerationStructureTypeKHR,
    refits: bool,
) -> vk::AccelerationStructureBuildGeometryInfoKHR<'a> {
    use vk::BuildAccelerationStructureFlagsKHR as F;
    let flags = if refits { F::PREFER_FAST_TRACE | F::ALLOW_UPDATE } else { F::PREFER_FAST_TRACE };
    vk::AccelerationStructureBuildGeometryInfoKHR::default()
        .ty(ty)
        .flags(flags)
        .mode(vk::BuildAccelerationStructureModeKHR::BUILD)
}

/// Whether a triangle is opaque, its instance says.
fn triangles<'a>(
    desc: &BottomDesc,
    vertices: vk::DeviceAddress,
    indices: vk::DeviceAddress,
) -> vk::AccelerationStructureGeometryKHR<'a> {
    let triangles = vk::AccelerationStructureGeometryTrianglesDataKHR::default()
        .vertex_format(vk::Format::R32G32B32_SFLOAT)
        .vertex_data(vk::DeviceOrHostAddressConstKHR { device_address: vertices })
        .vertex_stride(VERTEX_STRIDE)
        .max_vertex(desc.vertices.saturating_sub(1))
        .index_type(vk::IndexType::UINT32)
        .index_data(vk::DeviceOrHostAddressConstKHR { device_address: indices });
    vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::TRIANGLES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { triangles })
}

fn boxes<'a>(instances: vk::DeviceAddress) -> vk::AccelerationStructureGeometryKHR<'a> {
    let instances = vk::AccelerationStructureGeometryInstancesDataKHR::default()
        .data(vk::DeviceOrHostAddressConstKHR { device_address: instances });
    vk::AccelerationStructureGeometryKHR::default()
        .geometry_type(vk::GeometryTypeKHR::INSTANCES)
        .geometry(vk::AccelerationStructureGeometryDataKHR { instances })
}
