//! Buffers that own their memory.

use std::{fmt, ops::Range, sync::Arc};

use ash::vk;
use gpu_allocator::{MemoryLocation, vulkan::Allocation};

use super::{Gpu, device::Context, memory::Owner, poison};
use crate::{Error, ErrorKind, Result};

/// Where a buffer's memory is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Place {
    /// Fast for the device, out of reach for the host.
    #[default]
    Device,
    /// The host writes, the device reads.
    Upload,
    /// The device writes, the host reads.
    Readback,
}

/// What buffer to make.
#[derive(Clone, Copy, Debug)]
pub struct BufferDesc {
    /// Bytes; zero is allowed.
    pub size: u64,
    pub usage: vk::BufferUsageFlags,
    pub place: Place,
}

impl BufferDesc {
    /// A buffer of `size` bytes on the device, for every use that the engine has.
    pub fn device(size: u64) -> Self {
        use vk::BufferUsageFlags as U;
        let usage = U::STORAGE_BUFFER
            | U::UNIFORM_BUFFER
            | U::INDEX_BUFFER
            | U::INDIRECT_BUFFER
            | U::TRANSFER_SRC
            | U::TRANSFER_DST;
        Self { size, usage, place: Place::Device }
    }

    /// A buffer that the host writes: copies, uniforms and storage read by the device.
    pub fn upload(size: u64) -> Self {
        use vk::BufferUsageFlags as U;
        let usage = U::TRANSFER_SRC | U::UNIFORM_BUFFER | U::STORAGE_BUFFER | U::INDEX_BUFFER | U::INDIRECT_BUFFER;
        Self { size, usage, place: Place::Upload }
    }

    /// A buffer that the host reads after a copy.
    pub fn readback(size: u64) -> Self {
        Self { size, usage: vk::BufferUsageFlags::TRANSFER_DST, place: Place::Readback }
    }
}

/// A buffer with its memory. Clones share it; the last one frees it (after everything submitted with
/// [`super::Commands::keep`] is done).
#[derive(Clone)]
pub struct OwnedBuffer(Arc<Inner>);

struct Inner {
    context: Arc<Context>,
    raw: vk::Buffer,
    /// Taken only by `drop`.
    allocation: Option<Allocation>,
    name: String,
    desc: BufferDesc,
}

impl fmt::Debug for OwnedBuffer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "OwnedBuffer(`{}`, {} bytes)", self.0.name, self.0.desc.size)
    }
}

impl Drop for Inner {
    fn drop(&mut self) {
        if self.context.abandoned() {
            // Threads of a CPU driver may still write here.
            std::mem::forget(self.allocation.take());
            return;
        }
        // SAFETY: the last owner; submissions that use the buffer keep a clone until they are done.
        unsafe { self.context.device.destroy_buffer(self.raw, None) };
        if let Some(allocation) = self.allocation.take() {
            self.context.free(allocation);
        }
    }
}

impl OwnedBuffer {
    /// A new buffer; contents undefined.
    ///
    /// # Errors
    /// `OutOfMemory`, naming the buffer; `Runtime` on other answers of the driver.
    pub fn new(gpu: &Gpu, name: &str, desc: BufferDesc) -> Result<Self> {
        let context = &gpu.0;
        context.alive()?;
        // Fills and copies go by words; a buffer of no bytes cannot be bound.
        let size = desc.size.max(16).next_multiple_of(4);
        // What shaders read, acceleration structures may be built from.
        let storage = desc.place == Place::Device && desc.usage.contains(vk::BufferUsageFlags::STORAGE_BUFFER);
        let rays = match (storage, context.caps.ray_query) {
            (false, _) => vk::BufferUsageFlags::empty(),
            (true, false) => vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS,
            (true, true) => {
                vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS
                    | vk::BufferUsageFlags::ACCELERATION_STRUCTURE_BUILD_INPUT_READ_ONLY_KHR
            }
        };
        let info = vk::BufferCreateInfo::default()
            .size(size)
            .usage(desc.usage | rays)
            .sharing_mode(vk::SharingMode::EXCLUSIVE);
        // SAFETY: `info` is complete; the device is alive.
        let raw = context
            .check(unsafe { context.device.create_buffer(&info, None) }, || format!("vkCreateBuffer for `{name}`"))?;
        let mut inner = Inner { context: Arc::clone(context), raw, allocation: None, name: name.to_owned(), desc };
        // From here on `inner` cleans up.
        // SAFETY: the buffer was just made.
        let requirements = unsafe { context.device.get_buffer_memory_requirements(raw) };
        let location = match desc.place {
            Place::Device => MemoryLocation::GpuOnly,
            Place::Upload => MemoryLocation::CpuToGpu,
            Place::Readback => MemoryLocation::GpuToCpu,
        };
        let allocation = context.allocate(name, Owner::Buffer(raw), requirements, location)?;
        // SAFETY: memory of this allocation is not bound elsewhere; size and alignment are those required.
        let bound = unsafe { context.device.bind_buffer_memory(raw, allocation.memory(), allocation.offset()) };
        inner.allocation = Some(allocation);
        context.check(bound, || format!("vkBindBufferMemory for `{name}`"))?;
        context.name(raw, name);
        let buffer = Self(Arc::new(inner));
        if context.options.poison && desc.usage.contains(vk::BufferUsageFlags::TRANSFER_DST) {
            poison::buffer(gpu, name, raw, size)?;
        }
        Ok(buffer)
    }

    /// A buffer on the device with `contents`; returns when they are there.
    ///
    /// # Errors
    /// As [`Self::new`], and `DeviceLost`.
    pub fn with_contents(gpu: &Gpu, name: &str, contents: &[u8]) -> Result<Self> {
        let buffer = Self::new(gpu, name, BufferDesc::device(contents.len() as u64))?;
        if !contents.is_empty() {
            buffer.upload(0, contents)?;
        }
        Ok(buffer)
    }

    /// Replaces the bytes from `offset` on through a staging buffer, and waits.
    ///
    /// # Errors
    /// `Runtime` if the range is empty or outside; `OutOfMemory`, `DeviceLost`.
    pub fn upload(&self, offset: u64, contents: &[u8]) -> Result<()> {
        let name = self.name();
        let size = contents.len() as u64;
        self.inside(offset, size)?;
        let gpu = Gpu(Arc::clone(&self.0.context));
        let staging = Self::new(&gpu, &format!("{name} (staging)"), BufferDesc::upload(size))?;
        staging.write(0, contents)?;
        let mut commands = gpu.commands(&format!("upload `{name}`"))?;
        commands.everything_barrier();
        let region = vk::BufferCopy::default().dst_offset(offset).size(size);
        // SAFETY: both buffers are large enough, and kept until the copy is done.
        unsafe { gpu.0.device.cmd_copy_buffer(commands.raw(), staging.raw(), self.raw(), &[region]) };
        commands.everything_barrier();
        commands.keep(staging);
        commands.keep(self.clone());
        commands.submit()?.wait()
    }

    /// The range is not empty and lies inside of the buffer.
    fn inside(&self, offset: u64, size: u64) -> Result<()> {
        if size == 0 || offset.checked_add(size).is_none_or(|end| end > self.size()) {
            let Inner { name, desc, .. } = &*self.0;
            let what =
                format!("{size} bytes at {offset} are empty or outside of buffer `{name}` of {} bytes", desc.size);
            return Err(Error::new(ErrorKind::Runtime, what));
        }
        Ok(())
    }

    /// Bytes, as asked for.
    pub fn size(&self) -> u64 {
        self.0.desc.size
    }

    pub fn desc(&self) -> &BufferDesc {
        &self.0.desc
    }

    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// The raw handle, valid as long as a clone lives.
    pub fn raw(&self) -> vk::Buffer {
        self.0.raw
    }

    /// Where it lies for the device; `None` unless it is on the device and shaders read it.
    pub fn address(&self) -> Option<vk::DeviceAddress> {
        let Inner { context, desc, raw, .. } = &*self.0;
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
        let has = desc.place == Place::Device && desc.usage.intersects(usage);
        let info = vk::BufferDeviceAddressInfo::default().buffer(*raw);
        // SAFETY: a living buffer that was made with a usage that has addresses, on a device with that feature.
        has.then(|| unsafe { context.device.get_buffer_device_address(&info) })
    }

    /// [`Self::address`] for shaders: the lower word, then the upper one; zero if there is none.
    pub fn address_words(&self) -> [u32; 2] {
        let address = self.address().unwrap_or(0);
        [address as u32, (address >> 32) as u32]
    }

    /// Writes `data` at `offset` bytes. The memory is coherent: a submission after this call sees it. The caller sees to it
    /// that the device is not using that range.
    ///
    /// # Errors
    /// `Runtime` if the buffer is not in [`Place::Upload`] or the range is outside.
    pub fn write(&self, offset: u64, data: &[u8]) -> Result<()> {
        let target = self.mapped(Place::Upload, offset, data.len())?;
        // SAFETY: `mapped` checked the range; the memory lives as long as `self`; `data` cannot overlap mapped memory that
        // nobody has a slice of.
        unsafe { std::ptr::copy_nonoverlapping(data.as_ptr(), target, data.len()) };
        Ok(())
    }

    /// Bytes `offset..offset + size` of a [`Place::Readback`] buffer, after the submission that fills it was waited for.
    ///
    /// # Errors
    /// `Runtime` if the buffer is not in [`Place::Readback`] or the range is outside.
    pub fn mapped_bytes(&self, offset: u64, size: usize) -> Result<Vec<u8>> {
        self.mapped_values(offset, size)
    }

    /// `count` values from `offset` bytes on, as [`OwnedBuffer::mapped_bytes`].
    ///
    /// # Errors
    /// As [`OwnedBuffer::mapped_bytes`].
    pub fn mapped_values<T: bytemuck::AnyBitPattern>(&self, offset: u64, count: usize) -> Result<Vec<T>> {
        let source = self.mapped(Place::Readback, offset, count.saturating_mul(size_of::<T>()))?;
        let mut values: Vec<T> = Vec::new();
        values
            .try_reserve_exact(count)
            .map_err(|_| Error::new(ErrorKind::OutOfMemory, format!("no host memory to read `{}`", self.0.name)))?;
        // SAFETY: `mapped` checked the range; the vector has room for `count` values, of which every byte is written; any bits are a value.
        unsafe {
            std::ptr::copy_nonoverlapping(source, values.as_mut_ptr().cast(), count * size_of::<T>());
            values.set_len(count);
        }
        Ok(values)
    }

    /// All contents, whatever the place; copies through a staging buffer if needed, and waits.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn read(&self) -> Result<Vec<u8>> {
        let size = self.size() as usize;
        if self.0.desc.place == Place::Readback || size == 0 {
            return if size == 0 { Ok(Vec::new()) } else { self.mapped_bytes(0, size) };
        }
        self.read_range(0..self.size())
    }

    /// These bytes of a buffer on the device; copies through a staging buffer, and waits.
    ///
    /// # Errors
    /// `Runtime` if the range is empty or outside; `OutOfMemory`, `DeviceLost`.
    pub fn read_range(&self, range: Range<u64>) -> Result<Vec<u8>> {
        let size = range.end.saturating_sub(range.start);
        self.inside(range.start, size)?;
        let gpu = Gpu(Arc::clone(&self.0.context));
        let staging = Self::new(&gpu, &format!("{} (readback)", self.0.name), BufferDesc::readback(size))?;
        let mut commands = gpu.commands(&format!("read `{}`", self.0.name))?;
        commands.everything_barrier();
        let region = vk::BufferCopy::default().src_offset(range.start).size(size);
        // SAFETY: both buffers are large enough, and kept until the copy is done.
        unsafe { gpu.0.device.cmd_copy_buffer(commands.raw(), self.raw(), staging.raw(), &[region]) };
        commands.everything_barrier();
        commands.keep(self.clone());
        commands.keep(staging.clone());
        commands.submit()?.wait()?;
        staging.mapped_bytes(0, size as usize)
    }

    fn mapped(&self, place: Place, offset: u64, size: usize) -> Result<*mut u8> {
        let Inner { name, desc, .. } = &*self.0;
        if desc.place != place {
            return Err(Error::new(
                ErrorKind::Runtime,
                format!("buffer `{name}` is in {:?}, not {place:?}", desc.place),
            ));
        }
        if offset.checked_add(size as u64).is_none_or(|end| end > desc.size) {
            return Err(Error::new(
                ErrorKind::Runtime,
                format!("{size} bytes at {offset} are outside of buffer `{name}` of {} bytes", desc.size),
            ));
        }
        let pointer = self.0.allocation.as_ref().and_then(Allocation::mapped_ptr);
        let pointer =
            pointer.ok_or_else(|| Error::new(ErrorKind::Runtime, format!("buffer `{name}` is not mapped")))?;
        // SAFETY: `offset` is inside the mapped range, checked above.
        Ok(unsafe { pointer.as_ptr().cast::<u8>().add(offset as usize) })
    }
}
