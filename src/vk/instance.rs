//! The instance, its validation messages, and the devices it offers.

use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

use ash::{ext, vk};

use crate::error::{Error, Result};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Messages of warning severity or above that the validation layer has sent in this process.
static VALIDATION_MESSAGES: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// How many validation messages (warnings and errors) this process has seen; 0 is the only good answer.
pub fn validation_messages() -> usize {
    validation_log().len()
}

/// The messages themselves.
pub fn validation_log() -> Vec<String> {
    VALIDATION_MESSAGES
        .lock()
        .unwrap_or_else(|e| e.into_inner())
        .clone()
}

pub struct Instance {
    pub(super) raw: ash::Instance,
    pub(super) debug_utils: bool,
    /// Whether devices of this instance are to show pictures on windows.
    pub(super) presents: bool,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    // Last: the library is unloaded after everything made from it.
    pub(super) entry: ash::Entry,
}

/// A physical device and what this program could do on it.
#[derive(Debug, Clone)]
pub struct Candidate {
    pub(super) raw: vk::PhysicalDevice,
    pub index: usize,
    pub name: String,
    pub kind: &'static str,
    pub api: (u32, u32, u32),
    pub driver: String,
    /// What is missing for this program to run at all; empty when it can.
    pub missing: Vec<&'static str>,
    /// 64-bit integer atomics on buffers, which the `pixel` estimator needs.
    pub int64_atomics: bool,
    pub heap_bytes: u64,
    pub max_storage_buffer_range: u64,
    pub max_image_side: u32,
    pub subgroup_size: u32,
    rank: u8,
}

impl Instance {
    /// Loads Vulkan. With `validation`, a missing layer is an error: a silent run must mean that it was watched.
    pub fn new(validation: bool) -> Result<Arc<Self>> {
        Self::with_extensions(validation, &[])
    }

    /// With the extensions that a window's surface needs, if any.
    pub(super) fn with_extensions(validation: bool, wanted: &[&CStr]) -> Result<Arc<Self>> {
        // SAFETY: the loader is a well-behaved system library; nothing of it is used after `_entry` is dropped.
        let entry = unsafe { ash::Entry::load() }.map_err(|e| {
            Error::Device(format!(
                "no Vulkan loader: {e}; on Debian install libvulkan1 and mesa-vulkan-drivers"
            ))
        })?;
        // SAFETY: plain queries on a loaded entry.
        let (layers, extensions) = unsafe {
            (
                entry
                    .enumerate_instance_layer_properties()
                    .unwrap_or_default(),
                entry
                    .enumerate_instance_extension_properties(None)
                    .unwrap_or_default(),
            )
        };
        let has_layer = layers
            .iter()
            .any(|l| l.layer_name_as_c_str() == Ok(VALIDATION_LAYER));
        if validation && !has_layer {
            return Err(Error::Device(
                "validation was asked for, but VK_LAYER_KHRONOS_validation is not installed \
                 (Debian: vulkan-validationlayers)"
                    .into(),
            ));
        }
        let debug_utils = validation
            || extensions
                .iter()
                .any(|e| e.extension_name_as_c_str() == Ok(ext::debug_utils::NAME));
        if let Some(missing) = wanted.iter().find(|name| {
            !extensions
                .iter()
                .any(|e| e.extension_name_as_c_str() == Ok(**name))
        }) {
            return Err(Error::Display(format!(
                "Vulkan has no surface for this display: {} is missing",
                missing.to_string_lossy()
            )));
        }
        let mut extension_names: Vec<_> = wanted.iter().map(|name| name.as_ptr()).collect();
        if debug_utils {
            extension_names.push(ext::debug_utils::NAME.as_ptr());
        }
        let layer_names = [VALIDATION_LAYER.as_ptr()];
        let application = vk::ApplicationInfo::default()
            .application_name(c"mesolux")
            .engine_name(c"mesolux")
            .api_version(vk::API_VERSION_1_3);
        let mut messenger_info = messenger_info();
        // The layer's own checks of this very call need the messenger in the chain; synchronisation is checked too.
        let checks = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features =
            vk::ValidationFeaturesEXT::default().enabled_validation_features(&checks);
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_extension_names(&extension_names);
        if validation {
            info = info
                .enabled_layer_names(&layer_names)
                .push_next(&mut features)
                .push_next(&mut messenger_info);
        }
        // SAFETY: every pointer in `info` outlives the call.
        let raw = unsafe { entry.create_instance(&info, None) }
            .map_err(|e| Error::Device(format!("Vulkan instance: {e}")))?;
        let mut instance = Self {
            raw,
            debug_utils,
            presents: !wanted.is_empty(),
            messenger: None,
            entry,
        };
        if validation {
            let loader = ext::debug_utils::Instance::new(&instance.entry, &instance.raw);
            // SAFETY: the extension is enabled, and the callback is a plain function.
            let messenger =
                unsafe { loader.create_debug_utils_messenger(&self::messenger_info(), None) }
                    .map_err(|e| Error::Device(format!("Vulkan debug messenger: {e}")))?;
            instance.messenger = Some((loader, messenger));
        }
        Ok(Arc::new(instance))
    }

    /// Every physical device, best first: fit ones before unfit, discrete GPUs before integrated before software.
    /// `Candidate::index` is the loader's own order.
    pub fn candidates(&self) -> Result<Vec<Candidate>> {
        // SAFETY: a plain query.
        let devices = unsafe { self.raw.enumerate_physical_devices() }
            .map_err(|e| Error::Device(format!("Vulkan devices cannot be listed: {e}")))?;
        let mut candidates: Vec<_> = devices
            .into_iter()
            .enumerate()
            .map(|(index, raw)| self.candidate(index, raw))
            .collect();
        candidates.sort_by_key(|c| (!c.missing.is_empty(), c.rank, c.index));
        Ok(candidates)
    }

    fn candidate(&self, index: usize, raw: vk::PhysicalDevice) -> Candidate {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
        // SAFETY: plain queries on a device of this instance; a driver older than a chained struct leaves it as it is.
        let (base, memory, queues) = unsafe {
            (
                self.raw.get_physical_device_properties(raw),
                self.raw.get_physical_device_memory_properties(raw),
                self.raw.get_physical_device_queue_family_properties(raw),
            )
        };
        let mut missing = Vec::new();
        let mut int64_atomics = false;
        if base.api_version < vk::API_VERSION_1_3 {
            missing.push("Vulkan 1.3");
        } else {
            let mut properties = vk::PhysicalDeviceProperties2::default()
                .push_next(&mut driver)
                .push_next(&mut subgroup);
            let mut f12 = vk::PhysicalDeviceVulkan12Features::default();
            let mut f13 = vk::PhysicalDeviceVulkan13Features::default();
            let mut features = vk::PhysicalDeviceFeatures2::default()
                .push_next(&mut f12)
                .push_next(&mut f13);
            // SAFETY: the device is of Vulkan 1.3, so that every struct of the chains is known to it.
            unsafe {
                self.raw
                    .get_physical_device_properties2(raw, &mut properties);
                self.raw.get_physical_device_features2(raw, &mut features);
            }
            let base_features = features.features;
            let needed_operations = vk::SubgroupFeatureFlags::BASIC
                | vk::SubgroupFeatureFlags::VOTE
                | vk::SubgroupFeatureFlags::BALLOT;
            for (has, name) in [
                (
                    base_features.geometry_shader != 0,
                    "geometryShader (gl_PrimitiveID in fragment shaders)",
                ),
                (
                    base_features.full_draw_index_uint32 != 0,
                    "fullDrawIndexUint32",
                ),
                (f12.scalar_block_layout != 0, "scalarBlockLayout"),
                (f12.buffer_device_address != 0, "bufferDeviceAddress"),
                (f13.synchronization2 != 0, "synchronization2"),
                (
                    f13.maintenance4 != 0,
                    "maintenance4 (LocalSizeId in compute shaders)",
                ),
                (f13.subgroup_size_control != 0, "subgroupSizeControl"),
                (f13.compute_full_subgroups != 0, "computeFullSubgroups"),
                (
                    subgroup.supported_operations.contains(needed_operations)
                        && subgroup
                            .supported_stages
                            .contains(vk::ShaderStageFlags::COMPUTE),
                    "subgroup vote and ballot in compute",
                ),
                (
                    graphics_family(&queues).is_some(),
                    "a queue with graphics and compute",
                ),
            ] {
                if !has {
                    missing.push(name);
                }
            }
            int64_atomics = base_features.shader_int64 != 0 && f12.shader_buffer_int64_atomics != 0;
        }
        let (kind, rank) = match base.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => ("discrete GPU", 0),
            vk::PhysicalDeviceType::INTEGRATED_GPU => ("integrated GPU", 1),
            vk::PhysicalDeviceType::VIRTUAL_GPU => ("virtual GPU", 2),
            vk::PhysicalDeviceType::CPU => ("software", 4),
            _ => ("other", 3),
        };
        let text = |s: std::result::Result<&CStr, _>| {
            s.map_or_else(
                |_| String::new(),
                |s: &CStr| s.to_string_lossy().into_owned(),
            )
        };
        let v = base.api_version;
        Candidate {
            raw,
            index,
            name: text(base.device_name_as_c_str()),
            kind,
            api: (
                vk::api_version_major(v),
                vk::api_version_minor(v),
                vk::api_version_patch(v),
            ),
            driver: format!(
                "{} {}",
                text(driver.driver_name_as_c_str()),
                text(driver.driver_info_as_c_str())
            ),
            missing,
            int64_atomics,
            heap_bytes: memory
                .memory_heaps_as_slice()
                .iter()
                .map(|h| h.size)
                .max()
                .unwrap_or(0),
            max_storage_buffer_range: u64::from(base.limits.max_storage_buffer_range),
            max_image_side: base.limits.max_image_dimension2_d,
            subgroup_size: subgroup.subgroup_size,
            rank,
        }
    }
}

pub(super) fn graphics_family(queues: &[vk::QueueFamilyProperties]) -> Option<u32> {
    let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    queues
        .iter()
        .position(|q| q.queue_flags.contains(wanted) && q.timestamp_valid_bits > 0)
        .map(|i| i as u32)
}

fn messenger_info() -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(
            vk::DebugUtilsMessageSeverityFlagsEXT::WARNING
                | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
        )
        .message_type(
            vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
        )
        .pfn_user_callback(Some(on_message))
}

unsafe extern "system" fn on_message(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    _: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes a valid struct whose message, if any, is a C string.
    let text = unsafe { data.as_ref().and_then(|d| d.message_as_c_str()) }
        .map_or_else(String::new, |t| t.to_string_lossy().into_owned());
    tracing::error!(?severity, "validation: {text}");
    VALIDATION_MESSAGES
        .lock()
        .unwrap_or_else(|e| e.into_inner())
        .push(text);
    vk::FALSE
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: everything made from the instance holds it by `Arc`, so nothing is left.
        unsafe {
            if let Some((loader, messenger)) = &self.messenger {
                loader.destroy_debug_utils_messenger(*messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}
