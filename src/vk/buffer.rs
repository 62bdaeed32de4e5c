//! Buffers with their memory.

use std::sync::{Arc, Mutex, RwLock};

use ash::vk;
use bytemuck::Pod;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use super::device::{MemoryRequest, Resource};
use super::held::Held;
use super::uploads::Content;
use super::{Device, lock};
use crate::error::{Error, Result};

/// What a buffer is for, besides being a storage buffer and a source or target of copies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BufferUse {
    /// Device memory, read and written by shaders.
    Storage,
    /// Device memory that also feeds vertices, indices or draw commands.
    Geometry,
    /// Device memory that shaders reach by its address: only the device's memory limits its size.
    Addressed,
    /// Device memory that shaders write as storage and read as texels of four words. Software
    /// devices read texels several times as fast as storage.
    Texels,
    /// The same, written by its address.
    AddressedTexels,
    /// Device memory that is read as texels of four words alone, so that it may be larger than the
    /// device's largest storage buffer.
    ReadTexels,
    /// Memory that the CPU writes once and the device copies from.
    Upload,
    /// Memory that the CPU writes repeatedly, and that shaders read or that feeds vertices and
    /// indices.
    Stream,
    /// Memory that the device writes and the CPU reads.
    Readback,
}

/// A buffer with its memory. A clone is another handle to the same buffer.
///
/// Descriptor sets that bind it and commands that record it keep it alive.
#[derive(Clone)]
pub struct Buffer {
    pub(super) owner: Arc<BufferOwner>,
}

pub(super) struct BufferOwner {
    pub(super) raw: vk::Buffer,
    /// As texels of four words; null for other uses, and where texels are read from storage.
    view: vk::BufferView,
    bytes: u64,
    usage: BufferUse,
    /// Locked by the CPU's accesses, which several handles may attempt at once.
    allocation: RwLock<Option<Allocation>>,
    /// The buffers whose addresses this one contains.
    referred: Mutex<Held>,
    /// What it is to hold, in this order, from the next submission on.
    pub(super) contents: Mutex<Vec<Content>>,
    pub(super) device: Arc<Device>,
}

/// Bytes that are allocated at least, so that an empty list still has a buffer to bind.
const LEAST_BYTES: u64 = 16;

/// Bytes of a texel of four words.
pub const TEXEL_BYTES: u64 = 16;

impl Buffer {
    /// # Errors
    /// A buffer that exceeds the device's memory, or its largest storage buffer.
    pub fn new(device: &Arc<Device>, name: &str, bytes: u64, usage: BufferUse) -> Result<Self> {
        let bytes = bytes.max(LEAST_BYTES);
        let limits = device.limits();
        let texels = usage.is_read_as_texels();
        if bytes > limits.max_storage_buffer_range && usage.is_bound_by_sets() {
            return Err(Error::DeviceMemory {
                device: device.name().to_owned(),
                what: format!("{name}, above the device's largest storage buffer"),
                bytes,
            });
        }
        if texels && bytes / TEXEL_BYTES > limits.max_texels {
            return Err(Error::DeviceMemory {
                device: device.name().to_owned(),
                what: format!("{name}, above the device's largest texel buffer"),
                bytes,
            });
        }
        let bytes = match texels {
            true => bytes.next_multiple_of(TEXEL_BYTES),
            false => bytes,
        };
        let info = vk::BufferCreateInfo::default()
            .size(bytes)
            .usage(usage.flags());
        // SAFETY: a plain creation on a live device.
        let raw = unsafe { device.raw.create_buffer(&info, None) }
            .map_err(device.error("creating a buffer"))?;
        let mut owner = BufferOwner {
            raw,
            view: vk::BufferView::null(),
            bytes,
            usage,
            allocation: RwLock::default(),
            referred: Mutex::default(),
            contents: Mutex::default(),
            device: Arc::clone(device),
        };
        device.set_name(raw, name);
        let allocation = device.allocate(&MemoryRequest {
            name,
            // SAFETY: the buffer is of this device.
            requirements: unsafe { device.raw.get_buffer_memory_requirements(raw) },
            location: usage.location(),
            of: Resource::Buffer(raw),
        })?;
        // SAFETY: the allocation meets this buffer's requirements and is bound once.
        let bound = unsafe {
            device
                .raw
                .bind_buffer_memory(raw, allocation.memory(), allocation.offset())
        };
        // Stored before the check, so that a failure frees it.
        owner.allocation = RwLock::new(Some(allocation));
        bound.map_err(device.error("binding a buffer's memory"))?;
        if texels && !limits.stored_texels {
            let info = vk::BufferViewCreateInfo::default()
                .buffer(raw)
                .format(vk::Format::R32G32B32A32_UINT)
                .range(vk::WHOLE_SIZE);
            // SAFETY: the buffer has its memory and is made for texels.
            owner.view = unsafe { device.raw.create_buffer_view(&info, None) }
                .map_err(device.error("viewing a buffer as texels"))?;
        }
        Ok(Self {
            owner: Arc::new(owner),
        })
    }

    /// The size in bytes; at least 16, whatever the caller requested.
    pub fn bytes(&self) -> u64 {
        self.owner.bytes
    }

    /// The device address of an [`BufferUse::Addressed`] buffer, for shaders.
    ///
    /// Commands cannot know which addresses a shader reads: the buffer that contains this one must
    /// [refer to](Self::refer_to) it.
    pub fn address(&self) -> u64 {
        assert!(
            self.owner.usage.has_address(),
            "only an addressed buffer has an address"
        );
        let info = vk::BufferDeviceAddressInfo::default().buffer(self.owner.raw);
        // SAFETY: the buffer is bound to memory, and was created for use by its address.
        unsafe { self.owner.device.raw.get_buffer_device_address(&info) }
    }

    /// Of a buffer that is read as texels.
    pub(super) fn view(&self) -> vk::BufferView {
        assert!(
            self.owner.usage.is_read_as_texels(),
            "only a buffer of texels is bound as such"
        );
        self.owner.view
    }

    /// Keeps `addressed` alive as long as this buffer, which contains its address.
    pub fn refer_to(&self, addressed: &Self) {
        assert!(
            addressed.owner.usage.has_address() && !self.owner.usage.has_address(),
            "addressed buffers are referred to by buffers of other kinds"
        );
        lock(&self.owner.referred).hold(&addressed.owner);
    }

    /// Writes `data` at byte `offset`. The buffer must be a [`BufferUse::Upload`] or
    /// [`BufferUse::Stream`] buffer that no submission reads.
    pub fn write<T: Pod>(&mut self, offset: u64, data: &[T]) {
        let source = bytemuck::cast_slice::<T, u8>(data);
        let offset = offset as usize;
        let mut allocation = (self.owner.allocation.write()).unwrap_or_else(|e| e.into_inner());
        let target = allocation
            .as_mut()
            .and_then(Allocation::mapped_slice_mut)
            .expect("only upload and stream buffers are written by the CPU");
        target[offset..offset + source.len()].copy_from_slice(source);
    }

    /// Changes what an [`BufferUse::Upload`] buffer holds, which no work under way may use.
    pub fn change<T: Pod, R>(&mut self, change: impl FnOnce(&mut [T]) -> R) -> R {
        let mut allocation = (self.owner.allocation.write()).unwrap_or_else(|e| e.into_inner());
        let target = allocation
            .as_mut()
            .and_then(Allocation::mapped_slice_mut)
            .expect("only upload and stream buffers are written by the CPU");
        let whole = self.owner.bytes as usize / size_of::<T>() * size_of::<T>();
        change(bytemuck::cast_slice_mut(&mut target[..whole]))
    }

    /// Shows what a [`BufferUse::Readback`] buffer holds, whose writes are done.
    pub fn look_at<T: Pod, R>(&self, look: impl FnOnce(&[T]) -> R) -> R {
        let allocation = (self.owner.allocation.read()).unwrap_or_else(|e| e.into_inner());
        let source = allocation
            .as_ref()
            .and_then(Allocation::mapped_slice)
            .expect("only readback buffers are read by the CPU");
        let whole = self.owner.bytes as usize / size_of::<T>() * size_of::<T>();
        look(bytemuck::cast_slice(&source[..whole]))
    }

    /// Reads `count` values from byte `offset`. The buffer must be a [`BufferUse::Readback`] buffer
    /// whose writes are done.
    pub fn read<T: Pod>(&self, offset: u64, count: usize) -> Vec<T> {
        let allocation = (self.owner.allocation.read()).unwrap_or_else(|e| e.into_inner());
        let source = allocation
            .as_ref()
            .and_then(Allocation::mapped_slice)
            .expect("only readback buffers are read by the CPU");
        let mut values = vec![T::zeroed(); count];
        let target = bytemuck::cast_slice_mut::<T, u8>(&mut values);
        let offset = offset as usize;
        target.copy_from_slice(&source[offset..offset + target.len()]);
        values
    }
}

impl BufferUse {
    fn flags(self) -> vk::BufferUsageFlags {
        use vk::BufferUsageFlags as F;
        let all = F::STORAGE_BUFFER | F::TRANSFER_SRC | F::TRANSFER_DST;
        match self {
            Self::Storage | Self::Upload | Self::Readback => all,
            Self::Geometry => all | F::VERTEX_BUFFER | F::INDEX_BUFFER | F::INDIRECT_BUFFER,
            Self::Stream => all | F::VERTEX_BUFFER | F::INDEX_BUFFER,
            Self::Addressed => all | F::SHADER_DEVICE_ADDRESS,
            Self::Texels | Self::ReadTexels => all | F::UNIFORM_TEXEL_BUFFER,
            Self::AddressedTexels => all | F::UNIFORM_TEXEL_BUFFER | F::SHADER_DEVICE_ADDRESS,
        }
    }

    fn location(self) -> MemoryLocation {
        match self {
            Self::Storage
            | Self::Geometry
            | Self::Addressed
            | Self::Texels
            | Self::AddressedTexels
            | Self::ReadTexels => MemoryLocation::GpuOnly,
            Self::Upload | Self::Stream => MemoryLocation::CpuToGpu,
            Self::Readback => MemoryLocation::GpuToCpu,
        }
    }

    /// Whether descriptor sets bind such buffers, which limits their size.
    fn is_bound_by_sets(self) -> bool {
        matches!(
            self,
            Self::Storage | Self::Geometry | Self::Stream | Self::Texels
        )
    }

    fn has_address(self) -> bool {
        matches!(self, Self::Addressed | Self::AddressedTexels)
    }

    fn is_read_as_texels(self) -> bool {
        matches!(
            self,
            Self::Texels | Self::AddressedTexels | Self::ReadTexels
        )
    }
}

impl Drop for BufferOwner {
    fn drop(&mut self) {
        // SAFETY: sets and commands that use the buffer or its view hold its owner, so none is
        // left.
        unsafe {
            self.device.raw.destroy_buffer_view(self.view, None);
            self.device.raw.destroy_buffer(self.raw, None);
        }
        let allocation = self.allocation.get_mut().unwrap_or_else(|e| e.into_inner());
        if let Some(allocation) = allocation.take() {
            self.device.free(allocation);
        }
    }
}
