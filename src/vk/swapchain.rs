//! Swapchains: the images of a window, one of which is shown at a time.

use std::sync::Arc;

use ash::{khr, vk};

use super::{Commands, Device, Image, Surface};
use crate::error::{Error, Result};

/// What became of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shown {
    Yes,
    /// It was shown, and the images no longer fit the window well: make a new swapchain.
    Misfit,
    /// None of the images was free in time: make a new swapchain.
    Late,
    /// The window has another size: make a new swapchain.
    Stale,
    /// The surface is lost: make a new surface and a new swapchain.
    Lost,
}

impl Shown {
    /// Whether the frame can be seen.
    pub fn is_seen(self) -> bool {
        matches!(self, Self::Yes | Self::Misfit)
    }
}

/// The images of a window, into which frames are copied.
pub struct Swapchain {
    raw: vk::SwapchainKHR,
    loader: khr::swapchain::Device,
    images: Vec<vk::Image>,
    /// Signalled when an image may be written; one frame is under way at a time.
    free: vk::Semaphore,
    /// `[image]`, signalled when it has been written.
    written: Vec<vk::Semaphore>,
    size: (u32, u32),
    format: vk::Format,
    device: Arc<Device>,
    /// The surface, until the swapchain is destroyed.
    _surface: Arc<Surface>,
}

/// Formats of one byte a channel that hold sRGB codes, each with the format that frames are drawn
/// in: a copy keeps the codes.
const FORMATS: [(vk::Format, vk::Format); 4] = [
    (vk::Format::B8G8R8A8_UNORM, vk::Format::B8G8R8A8_UNORM),
    (vk::Format::R8G8B8A8_UNORM, vk::Format::R8G8B8A8_UNORM),
    (vk::Format::B8G8R8A8_SRGB, vk::Format::B8G8R8A8_UNORM),
    (vk::Format::R8G8B8A8_SRGB, vk::Format::R8G8B8A8_UNORM),
];

/// A format of a window's images, and the format that frames are drawn in.
struct WindowFormat {
    shown: vk::SurfaceFormatKHR,
    drawn: vk::Format,
}

/// Nanoseconds until a frame is given up because the window frees no image. The window handles its
/// events between attempts.
const PATIENCE: u64 = 100_000_000;

impl Swapchain {
    /// For a window of `width` × `height` pixels; none while it has no area. `before` is the
    /// window's last swapchain, whose frames are done.
    ///
    /// # Errors
    /// A surface that is lost or does not support 8-bit sRGB.
    pub fn new(
        device: &Arc<Device>,
        surface: &Arc<Surface>,
        (width, height): (u32, u32),
        before: Option<Self>,
    ) -> Result<Option<Self>> {
        let capabilities = surface.capabilities(device)?;
        let extent = extent(&capabilities, (width, height));
        if extent.width == 0 || extent.height == 0 {
            return Ok(None);
        }
        let format = surface.format(device)?;
        let wanted = capabilities.min_image_count + 1;
        let count = match capabilities.max_image_count {
            0 => wanted,
            most => wanted.min(most),
        };
        let opaque = vk::CompositeAlphaFlagsKHR::OPAQUE;
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(surface.raw)
            .min_image_count(count)
            .image_format(format.shown.format)
            .image_color_space(format.shown.color_space)
            .image_extent(extent)
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::TRANSFER_DST)
            .pre_transform(capabilities.current_transform)
            .composite_alpha(if capabilities.supported_composite_alpha.contains(opaque) {
                opaque
            } else {
                vk::CompositeAlphaFlagsKHR::INHERIT
            })
            .present_mode(vk::PresentModeKHR::FIFO)
            .clipped(true)
            .old_swapchain(before.as_ref().map_or(vk::SwapchainKHR::null(), |b| b.raw));
        let loader = khr::swapchain::Device::new(&device.instance.raw, &device.raw);
        // SAFETY: surface and old swapchain are alive, and the frames of the old one are done.
        let raw = unsafe { loader.create_swapchain(&info, None) }
            .map_err(device.error("creating a swapchain"))?;
        drop(before);
        let mut swapchain = Self {
            raw,
            loader,
            images: Vec::new(),
            free: vk::Semaphore::null(),
            written: Vec::new(),
            size: (extent.width, extent.height),
            format: format.drawn,
            device: Arc::clone(device),
            _surface: Arc::clone(surface),
        };
        device.set_name(raw, "window");
        swapchain.find_images()?;
        Ok(Some(swapchain))
    }

    /// Lists the images, and makes the semaphores for them.
    fn find_images(&mut self) -> Result<()> {
        let device = &self.device;
        // SAFETY: a plain query on the swapchain.
        self.images = unsafe { self.loader.get_swapchain_images(self.raw) }
            .map_err(device.error("asking for the window's images"))?;
        self.free = semaphore(device, "window image free")?;
        for &image in &self.images {
            device.set_name(image, "window image");
            self.written
                .push(semaphore(device, "window image written")?);
        }
        Ok(())
    }

    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// The format that frames are drawn in.
    pub fn format(&self) -> vk::Format {
        self.format
    }

    /// Submits what `record` records, which leaves `image` to be copied from, shows the image and
    /// waits until the device is done with it.
    ///
    /// # Errors
    /// A device that fails.
    pub fn show(
        &mut self,
        image: &Image,
        record: impl FnOnce(&Commands) -> Result<()>,
    ) -> Result<Shown> {
        assert_eq!(image.size(), self.size, "a frame has the window's size");
        let device = &self.device;
        // SAFETY: the semaphore is free: the last frame that waited for it is done.
        let next = unsafe {
            self.loader
                .acquire_next_image(self.raw, PATIENCE, self.free, vk::Fence::null())
        };
        let (index, suboptimal) = match next {
            Ok(found) => found,
            Err(e) => return shown(device, e),
        };
        let place = index as usize;
        let mut commands = Commands::record(device, "frame", |cmd| {
            record(cmd)?;
            self.copy(cmd, image, self.images[place]);
            Ok(())
        })?;
        commands.submit_between(&[self.free], &[self.written[place]])?;
        let (semaphores, swapchains, indices) = ([self.written[place]], [self.raw], [index]);
        let info = vk::PresentInfoKHR::default()
            .wait_semaphores(&semaphores)
            .swapchains(&swapchains)
            .image_indices(&indices);
        let presented = {
            let queue = device.queue();
            // SAFETY: the image was acquired and is written before the semaphore is signalled; the
            // queue is locked.
            unsafe { self.loader.queue_present(*queue, &info) }
        };
        commands.wait()?;
        match presented {
            Ok(also) if also || suboptimal => Ok(Shown::Misfit),
            Ok(_) => Ok(Shown::Yes),
            Err(e) => shown(device, e),
        }
    }

    fn copy(&self, cmd: &Commands, image: &Image, to: vk::Image) {
        use vk::ImageLayout as L;
        let layers = vk::ImageSubresourceLayers::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .layer_count(1);
        let regions = [vk::ImageCopy::default()
            .src_subresource(layers)
            .dst_subresource(layers)
            .extent(vk::Extent3D {
                width: self.size.0,
                height: self.size.1,
                depth: 1,
            })];
        self.transition(cmd, to, L::UNDEFINED, L::TRANSFER_DST_OPTIMAL);
        cmd.hold(&image.owner);
        // SAFETY: the render pass left the image to be copied from; both have this size and
        // formats of four bytes.
        unsafe {
            self.device.raw.cmd_copy_image(
                cmd.raw(),
                image.owner.raw,
                L::TRANSFER_SRC_OPTIMAL,
                to,
                L::TRANSFER_DST_OPTIMAL,
                &regions,
            );
        }
        self.transition(cmd, to, L::TRANSFER_DST_OPTIMAL, L::PRESENT_SRC_KHR);
    }

    fn transition(
        &self,
        cmd: &Commands,
        image: vk::Image,
        old: vk::ImageLayout,
        new: vk::ImageLayout,
    ) {
        let copies = vk::PipelineStageFlags2::ALL_TRANSFER;
        let barriers = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(copies)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(copies)
            .dst_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .old_layout(old)
            .new_layout(new)
            .image(image)
            .subresource_range(
                vk::ImageSubresourceRange::default()
                    .aspect_mask(vk::ImageAspectFlags::COLOR)
                    .level_count(1)
                    .layer_count(1),
            )];
        let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
        // SAFETY: the image is acquired, and in the layout `old` or its content may be lost.
        unsafe { self.device.raw.cmd_pipeline_barrier2(cmd.raw(), &info) };
    }
}

impl Surface {
    fn capabilities(&self, device: &Device) -> Result<vk::SurfaceCapabilitiesKHR> {
        let physical = device.candidate().raw;
        // SAFETY: a plain query on a live surface of the device's instance.
        unsafe {
            self.loader
                .get_physical_device_surface_capabilities(physical, self.raw)
        }
        .map_err(device.error("asking for the window's size"))
    }

    /// The first of [`FORMATS`] that the surface supports.
    fn format(&self, device: &Device) -> Result<WindowFormat> {
        let physical = device.candidate().raw;
        // SAFETY: a plain query on a live surface of the device's instance.
        let formats = unsafe {
            self.loader
                .get_physical_device_surface_formats(physical, self.raw)
        }
        .map_err(device.error("asking for the window's formats"))?;
        let found = FORMATS.iter().find_map(|&(shown, drawn)| {
            let shown = *formats.iter().find(|f| f.format == shown)?;
            Some(WindowFormat { shown, drawn })
        });
        found.ok_or_else(|| {
            let name = device.name();
            Error::Display(format!("the window takes no 8-bit sRGB on {name}"))
        })
    }
}

/// The size of a swapchain's images; a wish where the window adopts the size of what is shown.
fn extent(capabilities: &vk::SurfaceCapabilitiesKHR, (width, height): (u32, u32)) -> vk::Extent2D {
    let (least, most) = (capabilities.min_image_extent, capabilities.max_image_extent);
    match capabilities.current_extent.width {
        u32::MAX => vk::Extent2D {
            width: width.clamp(least.width, most.width.max(least.width)),
            height: height.clamp(least.height, most.height.max(least.height)),
        },
        _ => capabilities.current_extent,
    }
}

/// What became of a frame, by an answer other than success.
fn shown(device: &Device, answer: vk::Result) -> Result<Shown> {
    match answer {
        vk::Result::ERROR_OUT_OF_DATE_KHR => Ok(Shown::Stale),
        vk::Result::TIMEOUT | vk::Result::NOT_READY => Ok(Shown::Late),
        vk::Result::ERROR_SURFACE_LOST_KHR => Ok(Shown::Lost),
        e => Err(device.error("showing a frame")(e)),
    }
}

fn semaphore(device: &Device, name: &str) -> Result<vk::Semaphore> {
    // SAFETY: a plain creation on a live device.
    let semaphore = unsafe {
        device
            .raw
            .create_semaphore(&vk::SemaphoreCreateInfo::default(), None)
    }
    .map_err(device.error("creating a semaphore"))?;
    device.set_name(semaphore, name);
    Ok(semaphore)
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        // Presentation still waits for semaphores when the frame's fence is signalled.
        let _ = self.device.wait_idle();
        // SAFETY: the device uses nothing of the swapchain; null handles are allowed.
        unsafe {
            self.device.raw.destroy_semaphore(self.free, None);
            for &semaphore in &self.written {
                self.device.raw.destroy_semaphore(semaphore, None);
            }
            self.loader.destroy_swapchain(self.raw, None);
        }
    }
}
