//! Images and swapchain of the window's frames.

use std::sync::Arc;
use std::time::{Duration, Instant};

use winit::window::Window;

use super::DeviceChoice;
use crate::error::{Error, Result};
use crate::passes::pass_parts::{PartedPass, PassParts};
use crate::solver::choose_device;
use crate::vk::{
    Attachment, Buffer, BufferUse, Device, Format, Framebuffer, Image, ImageUse, Instance,
    RenderPass, Shown, Stage, Surface, Swapchain,
};

/// Triangles of a part of a frame, at most: they follow no rays.
const FRAME_TRIANGLES: u32 = 1 << 17;

/// A window with its device, and its images while it has an area.
pub struct Screen {
    swapchain: Option<Swapchain>,
    target: Option<Target>,
    surface: Option<Arc<Surface>>,
    /// Of a frame: the first, and those of further parts.
    passes: [RenderPass; 2],
    format: Format,
    /// Since when the window has refused every frame.
    refused: Option<Instant>,
    device: Arc<Device>,
    instance: Arc<Instance>,
    window: Arc<Window>,
}

/// A window that refuses every frame for so long is not going to show one.
const PATIENCE: Duration = Duration::from_secs(10);

/// A frame before it is copied to the window.
struct Target {
    framebuffer: Framebuffer,
    colour: Image,
}

/// A frame that was read back: 8-bit sRGB codes, `[row][column][channel]`.
pub struct Captured {
    pub size: (u32, u32),
    pub codes: Vec<u8>,
}

impl Screen {
    /// # Errors
    /// A display without a Vulkan surface; a device that does not exist or cannot present to this
    /// display.
    pub fn new(window: &Arc<Window>, size: (u32, u32), choice: &DeviceChoice) -> Result<Self> {
        let instance = Instance::for_display(choice.validation, window.as_ref())?;
        let surface = Arc::new(Surface::new(&instance, window)?);
        let wanted = choice.wanted.as_deref();
        let best = choose_device(&instance, wanted)?;
        let candidate = match (surface.fits(&best), wanted) {
            (true, _) => best,
            (false, None) => {
                let others = instance.candidates()?.into_iter();
                let mut others = others.filter(|c| c.missing.is_empty() && surface.fits(c));
                others.next().ok_or_else(|| {
                    Error::Display("no Vulkan device can show pictures on this display".into())
                })?
            }
            (false, Some(_)) => {
                return Err(Error::Display(format!(
                    "device {} cannot show pictures on this display",
                    best.name
                )));
            }
        };
        let device = Device::new(&instance, &candidate)?;
        let swapchain = Swapchain::new(&device, &surface, size, None)?;
        let format = swapchain
            .as_ref()
            .map_or(Format::B8G8R8A8_UNORM, Swapchain::format);
        let passes = RenderPass::in_parts(&device, "window", Attachment::copied(format))?;
        Ok(Self {
            swapchain,
            target: None,
            surface: Some(surface),
            passes,
            format,
            refused: None,
            device,
            instance,
            window: Arc::clone(window),
        })
    }

    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    pub fn pass(&self) -> &RenderPass {
        &self.passes[0]
    }

    /// Drops the surface as if the system had lost it; the next frame makes a new one.
    pub fn lose(&mut self) {
        self.swapchain = None;
        self.surface = None;
    }

    /// Makes images of the window's size if there are none. Returns their size; None while the
    /// window has no area.
    ///
    /// # Errors
    /// A device or a display that fails.
    pub fn fit(&mut self, size: (u32, u32), recreate: bool) -> Result<Option<(u32, u32)>> {
        if size.0 == 0 || size.1 == 0 {
            // A minimised window refuses nothing.
            self.refused = None;
            return Ok(None);
        }
        if self.surface.is_none() {
            self.swapchain = None;
            self.surface = Some(Arc::new(Surface::new(&self.instance, &self.window)?));
        }
        if let Some(surface) = &self.surface
            && (recreate || self.swapchain.is_none())
        {
            let before = self.swapchain.take();
            self.swapchain = Swapchain::new(&self.device, surface, size, before)?;
        }
        let Some(swapchain) = &self.swapchain else {
            return Ok(None);
        };
        if swapchain.format() != self.format {
            return Err(Error::Display(
                "the window has changed its format: open it again".into(),
            ));
        }
        let size = swapchain.size();
        if self.target.as_ref().is_none_or(|t| t.colour.size() != size) {
            self.target = None;
            self.target = Some(Target::new(
                &self.device,
                &self.passes[0],
                self.format,
                size,
            )?);
        }
        Ok(Some(size))
    }

    /// Draws a frame with the commands that `record` adds to the render pass, and shows it; with
    /// `capture`, reads it back. Call it after [`Self::fit`] has returned a size.
    ///
    /// # Errors
    /// A device that fails; a window that refuses every frame for ten seconds.
    pub fn show(
        &mut self,
        capture: bool,
        record: impl FnOnce(&mut PartedPass<'_>),
    ) -> Result<(Shown, Option<Captured>)> {
        let (Some(swapchain), Some(target)) = (&mut self.swapchain, &self.target) else {
            return Ok((Shown::Stale, None));
        };
        let (width, height) = target.colour.size();
        let bytes = u64::from(width) * u64::from(height) * 4;
        let readback = match capture {
            true => {
                let name = "window readback";
                Some(Buffer::new(&self.device, name, bytes, BufferUse::Readback)?)
            }
            false => None,
        };
        let shown = swapchain.show(&target.colour, |cmd| {
            let parts = PassParts {
                passes: self.passes.each_ref(),
                framebuffer: &target.framebuffer,
                size: (width, height),
                clear: [0; 4],
                triangles: FRAME_TRIANGLES,
            };
            let mut pass = PartedPass::begin(cmd, parts);
            record(&mut pass);
            pass.end();
            if let Some(readback) = &readback {
                cmd.copy_image_to_buffer(&target.colour, readback);
                cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
            }
            Ok(())
        })?;
        match shown {
            Shown::Yes | Shown::Misfit | Shown::Late => self.refused = None,
            Shown::Stale | Shown::Lost => self.refuse(shown)?,
        }
        // An abandoned frame has drawn nothing.
        let readback = readback.filter(|_| shown.is_seen());
        let captured = readback.map(|readback| {
            let blue_first = self.format == Format::B8G8R8A8_UNORM;
            let texels: Vec<[u8; 4]> = readback.read(0, (bytes / 4) as usize);
            let codes = texels.iter().flat_map(|&[a, b, c, _]| match blue_first {
                true => [c, b, a],
                false => [a, b, c],
            });
            Captured {
                size: (width, height),
                codes: codes.collect(),
            }
        });
        Ok((shown, captured))
    }

    fn refuse(&mut self, shown: Shown) -> Result<()> {
        if shown == Shown::Lost {
            self.lose();
        }
        let since = *self.refused.get_or_insert_with(Instant::now);
        match since.elapsed() > PATIENCE {
            true => Err(Error::Display(format!(
                "the window has refused every frame for {} s",
                PATIENCE.as_secs()
            ))),
            false => Ok(()),
        }
    }
}

impl Target {
    fn new(
        device: &Arc<Device>,
        pass: &RenderPass,
        format: Format,
        size: (u32, u32),
    ) -> Result<Self> {
        let colour = Image::new(device, "window frame", size, format, ImageUse::ColourTarget)?;
        let depth = Image::new(
            device,
            "window depth",
            size,
            Format::D32_SFLOAT,
            ImageUse::DepthTarget,
        )?;
        Ok(Self {
            framebuffer: Framebuffer::new(device, "window frame", pass, &colour, &depth)?,
            colour,
        })
    }
}
