//! Surfaces of windows.

use std::any::Any;
use std::ffi::CStr;
use std::sync::Arc;

use ash::{khr, vk};
use winit::raw_window_handle::{HasDisplayHandle, HasWindowHandle};

use super::Instance;
use super::instance::{Candidate, graphics_family};
use crate::error::{Error, Result};

/// The surface of a window, which keeps the window open.
pub struct Surface {
    pub(super) raw: vk::SurfaceKHR,
    pub(super) loader: khr::surface::Instance,
    instance: Arc<Instance>,
    /// The window, until the surface is destroyed.
    _window: Arc<dyn Any + Send + Sync>,
}

impl Instance {
    /// Loads Vulkan for windows on a display.
    ///
    /// # Errors
    /// As [`Instance::new`]; a display that Vulkan has no surface for.
    pub fn for_display(validation: bool, display: &impl HasDisplayHandle) -> Result<Arc<Self>> {
        let no_surface = |e: &dyn std::fmt::Display| {
            Error::Display(format!("Vulkan has no surface for this display: {e}"))
        };
        let handle = display.display_handle().map_err(|e| no_surface(&e))?;
        let names = ash_window::enumerate_required_extensions(handle.as_raw())
            .map_err(|e| no_surface(&e))?;
        let names: Vec<_> = names
            .iter()
            // SAFETY: the names are constants of the crate that lists them.
            .map(|&name| unsafe { CStr::from_ptr(name) })
            .collect();
        Self::with_extensions(validation, &names)
    }
}

impl Surface {
    /// # Errors
    /// A window or a display that Vulkan cannot draw on.
    pub fn new<W>(instance: &Arc<Instance>, window: &Arc<W>) -> Result<Self>
    where
        W: HasDisplayHandle + HasWindowHandle + Any + Send + Sync,
    {
        let failed = |e: &dyn std::fmt::Display| {
            Error::Display(format!("the window has no Vulkan surface: {e}"))
        };
        let display = window.display_handle().map_err(|e| failed(&e))?.as_raw();
        let handle = window.window_handle().map_err(|e| failed(&e))?.as_raw();
        // SAFETY: the handles are of a live window, which the surface keeps.
        let raw = unsafe {
            ash_window::create_surface(&instance.entry, &instance.raw, display, handle, None)
        }
        .map_err(|e| failed(&e))?;
        Ok(Self {
            raw,
            loader: khr::surface::Instance::new(&instance.entry, &instance.raw),
            instance: Arc::clone(instance),
            _window: Arc::clone(window) as Arc<dyn Any + Send + Sync>,
        })
    }

    /// Whether a device can show pictures here.
    pub fn fits(&self, candidate: &Candidate) -> bool {
        let instance = &self.instance.raw;
        // SAFETY: plain queries on a device of the surface's own instance.
        unsafe {
            let queues = instance.get_physical_device_queue_family_properties(candidate.raw);
            let extensions = instance
                .enumerate_device_extension_properties(candidate.raw)
                .unwrap_or_default();
            let shows = graphics_family(&queues).is_some_and(|family| {
                self.loader
                    .get_physical_device_surface_support(candidate.raw, family, self.raw)
                    .unwrap_or(false)
            });
            shows
                && extensions
                    .iter()
                    .any(|e| e.extension_name_as_c_str() == Ok(khr::swapchain::NAME))
        }
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        // SAFETY: a swapchain holds its surface, so none is left.
        unsafe { self.loader.destroy_surface(self.raw, None) };
    }
}
