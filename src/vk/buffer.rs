//! Buffers with their memory.

use std::sync::Arc;

use ash::vk;
use bytemuck::Pod;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use super::Device;
use crate::error::{Error, Result};

/// What a buffer is for, beside being a storage buffer and a source or target of copies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BufferUse {
    /// Device memory, read and written by shaders.
    Storage,
    /// Device memory that also feeds vertices, indices or draw commands.
    Geometry,
    /// Device memory that shaders reach by its address: no larger limit than the device's memory.
    Addressed,
    /// Memory that the CPU writes once and the device copies from.
    Upload,
    /// Memory that the CPU writes again and again, and that shaders read or that feeds vertices and indices.
    Stream,
    /// Memory that the device writes and the CPU reads.
    Readback,
}

pub struct Buffer {
    pub(super) raw: vk::Buffer,
    allocation: Option<Allocation>,
    bytes: u64,
    device: Arc<Device>,
}

impl Buffer {
    /// At least one byte is always allocated, so that an empty list still has a buffer to bind.
    pub fn new(device: &Arc<Device>, name: &str, bytes: u64, usage: BufferUse) -> Result<Self> {
        let bytes = bytes.max(16);
        let mut flags = vk::BufferUsageFlags::STORAGE_BUFFER
            | vk::BufferUsageFlags::TRANSFER_SRC
            | vk::BufferUsageFlags::TRANSFER_DST;
        if usage == BufferUse::Geometry {
            flags |= vk::BufferUsageFlags::VERTEX_BUFFER
                | vk::BufferUsageFlags::INDEX_BUFFER
                | vk::BufferUsageFlags::INDIRECT_BUFFER;
        }
        if usage == BufferUse::Stream {
            flags |= vk::BufferUsageFlags::VERTEX_BUFFER | vk::BufferUsageFlags::INDEX_BUFFER;
        }
        if usage == BufferUse::Addressed {
            flags |= vk::BufferUsageFlags::SHADER_DEVICE_ADDRESS;
        }
        if bytes > device.limits().max_storage_buffer_range
            && matches!(
                usage,
                BufferUse::Storage | BufferUse::Geometry | BufferUse::Stream
            )
        {
            return Err(Error::DeviceMemory {
                device: device.name().to_owned(),
                what: format!("{name}, above the device's largest storage buffer"),
                bytes,
            });
        }
        let info = vk::BufferCreateInfo::default().size(bytes).usage(flags);
        // SAFETY: a plain creation on a live device.
        let raw = unsafe { device.raw.create_buffer(&info, None) }
            .map_err(device.error("creating a buffer"))?;
        let mut buffer = Self {
            raw,
            allocation: None,
            bytes,
            device: Arc::clone(device),
        };
        device.set_name(raw, name);
        // SAFETY: the buffer is of this device.
        let requirements = unsafe { device.raw.get_buffer_memory_requirements(raw) };
        let allocation = device
            .allocator()
            .allocate(&AllocationCreateDesc {
                name,
                requirements,
                location: match usage {
                    BufferUse::Storage | BufferUse::Geometry | BufferUse::Addressed => {
                        MemoryLocation::GpuOnly
                    }
                    BufferUse::Upload | BufferUse::Stream => MemoryLocation::CpuToGpu,
                    BufferUse::Readback => MemoryLocation::GpuToCpu,
                },
                linear: true,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            })
            .map_err(|_| Error::DeviceMemory {
                device: device.name().to_owned(),
                what: name.to_owned(),
                bytes,
            })?;
        // SAFETY: the allocation was made for this buffer's requirements and is bound once.
        unsafe {
            device
                .raw
                .bind_buffer_memory(raw, allocation.memory(), allocation.offset())
        }
        .map_err(device.error("binding a buffer's memory"))?;
        buffer.allocation = Some(allocation);
        Ok(buffer)
    }

    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Where an [`BufferUse::Addressed`] buffer lies, for shaders.
    pub fn address(&self) -> u64 {
        let info = vk::BufferDeviceAddressInfo::default().buffer(self.raw);
        // SAFETY: the buffer is bound, and made with an address unless the caller is wrong, which validation tells.
        unsafe { self.device.raw.get_buffer_device_address(&info) }
    }

    /// Writes `data` at byte `offset`. The buffer must be an [`BufferUse::Upload`] or [`BufferUse::Stream`] buffer that no
    /// submission reads.
    pub fn write<T: Pod>(&mut self, offset: u64, data: &[T]) {
        let source = bytemuck::cast_slice::<T, u8>(data);
        let offset = offset as usize;
        let target = self
            .allocation
            .as_mut()
            .and_then(|a| a.mapped_slice_mut())
            .expect("only upload and stream buffers are written by the CPU");
        target[offset..offset + source.len()].copy_from_slice(source);
    }

    /// Reads `count` values from byte `offset`. The buffer must be a [`BufferUse::Readback`] buffer whose writes are
    /// done.
    pub fn read<T: Pod>(&self, offset: u64, count: usize) -> Vec<T> {
        let source = self
            .allocation
            .as_ref()
            .and_then(|a| a.mapped_slice())
            .expect("only readback buffers are read by the CPU");
        let mut values = vec![T::zeroed(); count];
        let target = bytemuck::cast_slice_mut::<T, u8>(&mut values);
        let offset = offset as usize;
        target.copy_from_slice(&source[offset..offset + target.len()]);
        values
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        if let Some(allocation) = self.allocation.take() {
            // Freeing fails for foreign allocations only.
            let _ = self.device.allocator().free(allocation);
        }
        // SAFETY: whoever recorded the buffer waits for the submission before dropping it.
        unsafe { self.device.raw.destroy_buffer(self.raw, None) };
    }
}
