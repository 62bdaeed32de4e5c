//! The logical device, its queue and its memory.

use std::collections::BTreeMap;
use std::ffi::CString;
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{
    Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc,
};
use gpu_allocator::{AllocationSizes, MemoryLocation};

use super::instance::{Candidate, Instance, graphics_family};
use super::pipeline::Pipelines;
use super::uploads::Uploads;
use super::{TEXEL_BYTES, change_lists, lock, walk_lists};
use crate::error::{Error, Result};

/// A device with one queue for graphics and compute.
pub struct Device {
    pub(super) raw: ash::Device,
    queue: Mutex<vk::Queue>,
    pub(super) family: u32,
    allocator: Mutex<ManuallyDrop<Allocator>>,
    names: Option<ext::debug_utils::Device>,
    candidate: Candidate,
    limits: Limits,
    pub(super) uploads: Mutex<Uploads>,
    pub(super) pipelines: Pipelines,
    /// Submissions so far.
    pub(super) submissions: AtomicU64,
    part_times: Mutex<Option<PartTimes>>,
    #[cfg_attr(not(feature = "window"), allow(dead_code))] // read by swapchains only
    pub(super) instance: Arc<Instance>,
}

/// Memory for a buffer or an image.
pub(super) struct MemoryRequest<'a> {
    pub(super) name: &'a str,
    pub(super) requirements: vk::MemoryRequirements,
    pub(super) location: MemoryLocation,
    pub(super) of: Resource,
}

/// How long the parts of submissions take, by the name of their commands: how many there were, and
/// the longest.
#[derive(Debug, Clone, Default)]
pub struct PartTimes(pub BTreeMap<String, (u64, Duration)>);

/// What memory is for.
#[derive(Clone, Copy)]
pub(super) enum Resource {
    Buffer(vk::Buffer),
    Image(vk::Image),
}

/// A device whose texel buffers hold less, 256 MiB, reads texels from storage.
const FEW_TEXELS: u32 = 1 << 24;

/// What the passes size themselves by.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    pub max_storage_buffer_range: u64,
    /// Texels of a buffer that is read as such.
    pub max_texels: u64,
    /// Whether shaders read texels from storage, since texel buffers hold too few.
    pub stored_texels: bool,
    pub max_image_side: u32,
    /// Of a dispatch, along x.
    pub max_workgroups: u32,
    pub subgroup_size: u32,
    /// Fractional bits of a rasterised vertex's position, in pixels.
    pub subpixel_bits: u32,
    /// Nanoseconds of one timestamp tick.
    pub timestamp_period: f64,
    /// Memory of the largest heap.
    pub heap_bytes: u64,
}

impl Device {
    /// # Errors
    /// A candidate that lacks what this program needs; a device that fails.
    pub fn new(instance: &Arc<Instance>, candidate: &Candidate) -> Result<Arc<Self>> {
        if !candidate.missing.is_empty() {
            return Err(Error::Device(format!(
                "device {} ({}) lacks {}",
                candidate.index,
                candidate.name,
                candidate.missing.join(", ")
            )));
        }
        let raw_instance = &instance.raw;
        // SAFETY: plain queries on a device of this instance.
        let (queues, properties) = unsafe {
            (
                raw_instance.get_physical_device_queue_family_properties(candidate.raw),
                raw_instance.get_physical_device_properties(candidate.raw),
            )
        };
        let Some(family) = graphics_family(&queues) else {
            return Err(Error::Device(format!(
                "device {} has no graphics queue",
                candidate.name
            )));
        };
        let _lists = change_lists();
        let raw = create(instance, candidate, family)?;
        let allocator = match allocator(instance, candidate, &raw) {
            Ok(allocator) => allocator,
            Err(e) => {
                // SAFETY: nothing has been made from the device yet.
                unsafe { raw.destroy_device(None) };
                return Err(e);
            }
        };
        // SAFETY: the device was created with one queue of this family.
        let queue = unsafe { raw.get_device_queue(family, 0) };
        DEVICES.fetch_add(1, Ordering::Relaxed);
        let names = instance
            .debug_utils
            .then(|| ext::debug_utils::Device::new(raw_instance, &raw));
        Ok(Arc::new(Self {
            raw,
            queue: Mutex::new(queue),
            family,
            allocator: Mutex::new(ManuallyDrop::new(allocator)),
            names,
            limits: Limits::new(candidate, &properties.limits),
            candidate: candidate.clone(),
            part_times: Mutex::default(),
            uploads: Mutex::default(),
            pipelines: Pipelines::default(),
            submissions: AtomicU64::new(0),
            instance: Arc::clone(instance),
        }))
    }

    /// What the device is and can do.
    pub fn candidate(&self) -> &Candidate {
        &self.candidate
    }

    pub fn name(&self) -> &str {
        &self.candidate.name
    }

    /// Measures each part of what is submitted from now on, one at a time: for tests, since it is
    /// slow.
    pub fn time_parts(&self) {
        *lock(&self.part_times) = Some(PartTimes::default());
    }

    /// What was measured since [`Self::time_parts`].
    pub fn timed_parts(&self) -> PartTimes {
        lock(&self.part_times).clone().unwrap_or_default()
    }

    pub(super) fn times_parts(&self) -> bool {
        lock(&self.part_times).is_some()
    }

    pub(super) fn add_part(&self, name: &str, time: Duration) {
        if let Some(PartTimes(times)) = &mut *lock(&self.part_times) {
            let (count, longest) = times.entry(name.to_owned()).or_default();
            *count += 1;
            *longest = time.max(*longest);
        }
    }

    /// Pipelines that were made; what is made of the same shaders and state is one.
    pub fn pipelines(&self) -> usize {
        self.pipelines.count()
    }

    /// Submissions to the queue since the device was made.
    pub fn submissions(&self) -> u64 {
        self.submissions.load(Ordering::Relaxed)
    }

    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Bytes in live buffers and images.
    pub fn allocated_bytes(&self) -> u64 {
        self.allocator().generate_report().total_allocated_bytes
    }

    fn allocator(&self) -> MutexGuard<'_, ManuallyDrop<Allocator>> {
        lock(&self.allocator)
    }

    pub(super) fn allocate(&self, request: &MemoryRequest<'_>) -> Result<Allocation> {
        let requirements = request.requirements;
        let mut desc = AllocationCreateDesc {
            name: request.name,
            requirements,
            location: request.location,
            linear: matches!(request.of, Resource::Buffer(_)),
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let mut allocator = self.allocator();
        let found = allocator.allocate(&desc).or_else(|_| {
            // Where there is no room for a block of many, there may be for it alone.
            desc.allocation_scheme = match request.of {
                Resource::Buffer(buffer) => AllocationScheme::DedicatedBuffer(buffer),
                Resource::Image(image) => AllocationScheme::DedicatedImage(image),
            };
            allocator.allocate(&desc)
        });
        found.map_err(|_| Error::DeviceMemory {
            device: self.name().to_owned(),
            what: request.name.to_owned(),
            bytes: requirements.size,
        })
    }

    pub(super) fn free(&self, allocation: Allocation) {
        // Freeing fails only for allocations of another allocator.
        let _ = self.allocator().free(allocation);
    }

    /// The queue, which one thread uses at a time.
    pub(super) fn queue(&self) -> MutexGuard<'_, vk::Queue> {
        lock(&self.queue)
    }

    pub(super) fn error(&self, what: &'static str) -> impl FnOnce(vk::Result) -> Error {
        let device = self.candidate.name.clone();
        move |source| Error::Vulkan {
            device,
            what,
            source,
        }
    }

    /// Sets the name of an object that validation messages and debuggers show.
    pub(super) fn set_name(&self, handle: impl vk::Handle, name: &str) {
        let (Some(names), Ok(name)) = (&self.names, CString::new(name)) else {
            return;
        };
        let info = vk::DebugUtilsObjectNameInfoEXT::default()
            .object_handle(handle)
            .object_name(&name);
        let _lists = walk_lists();
        // SAFETY: the handle belongs to this device. A name that cannot be set is no loss.
        let _ = unsafe { names.set_debug_utils_object_name(&info) };
    }

    /// Waits until the queue is idle.
    pub fn wait_idle(&self) -> Result<()> {
        let _queue = self.queue();
        // SAFETY: the queue's lock keeps other threads from submitting meanwhile.
        unsafe { self.raw.device_wait_idle() }.map_err(self.error("waiting for the device"))
    }
}

/// A device with one queue of a family, and the features that this program uses.
fn create(instance: &Instance, candidate: &Candidate, family: u32) -> Result<ash::Device> {
    let priorities = [1.0];
    let queue_infos = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(family)
        .queue_priorities(&priorities)];
    let mut f12 = vk::PhysicalDeviceVulkan12Features::default()
        .scalar_block_layout(true)
        .buffer_device_address(true)
        .shader_buffer_int64_atomics(candidate.int64_atomics);
    let mut f13 = vk::PhysicalDeviceVulkan13Features::default()
        .synchronization2(true)
        .shader_demote_to_helper_invocation(true)
        .maintenance4(true)
        .subgroup_size_control(true)
        .compute_full_subgroups(true);
    let features = vk::PhysicalDeviceFeatures::default()
        .full_draw_index_uint32(true)
        .shader_int64(candidate.int64_atomics);
    let extensions = match instance.presents {
        true => vec![khr::swapchain::NAME.as_ptr()],
        false => Vec::new(),
    };
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queue_infos)
        .enabled_extension_names(&extensions)
        .enabled_features(&features)
        .push_next(&mut f12)
        .push_next(&mut f13);
    // SAFETY: `info` and its chain outlive the call; `Instance::candidates` checked every feature.
    unsafe { instance.raw.create_device(candidate.raw, &info, None) }.map_err(|source| {
        Error::Vulkan {
            device: candidate.name.clone(),
            what: "creating the device",
            source,
        }
    })
}

fn allocator(instance: &Instance, candidate: &Candidate, raw: &ash::Device) -> Result<Allocator> {
    Allocator::new(&AllocatorCreateDesc {
        instance: instance.raw.clone(),
        device: raw.clone(),
        physical_device: candidate.raw,
        debug_settings: Default::default(),
        buffer_device_address: true,
        // Blocks grow as more are needed, so that a small scene takes little.
        allocation_sizes: AllocationSizes::new(4 << 20, 4 << 20)
            .with_max_device_memblock_size(256 << 20)
            .with_max_host_memblock_size(64 << 20),
    })
    .map_err(|e| Error::Device(format!("{}: allocator: {e}", candidate.name)))
}

impl Limits {
    fn new(candidate: &Candidate, limits: &vk::PhysicalDeviceLimits) -> Self {
        let stored_texels = limits.max_texel_buffer_elements < FEW_TEXELS;
        Self {
            max_storage_buffer_range: candidate.max_storage_buffer_range,
            max_texels: match stored_texels {
                true => candidate.max_storage_buffer_range / TEXEL_BYTES,
                false => limits.max_texel_buffer_elements.into(),
            },
            stored_texels,
            max_image_side: candidate.max_image_side,
            max_workgroups: candidate.max_workgroups,
            subgroup_size: candidate.subgroup_size,
            subpixel_bits: limits.sub_pixel_precision_bits.clamp(4, 16),
            timestamp_period: f64::from(limits.timestamp_period),
            heap_bytes: candidate.heap_bytes,
        }
    }
}

/// Bytes in buffers and images that were not freed before their device; anything but 0 is a leak.
static LEFT_BYTES: AtomicU64 = AtomicU64::new(0);

/// Live devices of this process; every object keeps its device alive.
static DEVICES: AtomicU64 = AtomicU64::new(0);

/// What is left in this process when everything should be freed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Left {
    /// Devices that some object still holds.
    pub devices: u64,
    /// Bytes in buffers and images that were not freed before their device.
    pub bytes: u64,
}

/// What is left when everything should be freed; anything but `None` is a leak.
pub fn left() -> Option<Left> {
    let left = Left {
        devices: DEVICES.load(Ordering::Relaxed),
        bytes: LEFT_BYTES.load(Ordering::Relaxed),
    };
    (left.devices != 0 || left.bytes != 0).then_some(left)
}

impl Drop for Device {
    fn drop(&mut self) {
        LEFT_BYTES.fetch_add(self.allocated_bytes(), Ordering::Relaxed);
        DEVICES.fetch_sub(1, Ordering::Relaxed);
        let _lists = change_lists();
        // SAFETY: every object of the device holds it by `Arc`, so none is left; the allocator is
        // dropped before the device.
        unsafe {
            let _ = self.raw.device_wait_idle();
            self.pipelines.destroy(&self.raw);
            ManuallyDrop::drop(self.allocator.get_mut().unwrap_or_else(|e| e.into_inner()));
            self.raw.destroy_device(None);
        }
    }
}
