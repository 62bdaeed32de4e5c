//! The instance, its validation messages, and the devices it offers.

use std::ffi::{CStr, FromBytesUntilNulError, c_void};
use std::sync::{Arc, Mutex, OnceLock};

use ash::{ext, vk};

use super::change_lists;
use crate::error::{Error, Result};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Messages of warning severity or above that the validation layer has sent in this process.
static VALIDATION_MESSAGES: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// An instance that is never destroyed, so that drivers stay loaded until the process ends: some
/// run code as threads end, and crash where that code is gone. None where there is no Vulkan.
static ANCHOR: OnceLock<Option<(ash::Instance, ash::Entry)>> = OnceLock::new();

fn anchor() -> Option<(ash::Instance, ash::Entry)> {
    // SAFETY: the loader is a well-behaved system library, which is never unloaded here.
    let entry = unsafe { ash::Entry::load() }.ok()?;
    let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
    let info = vk::InstanceCreateInfo::default().application_info(&application);
    let _lists = change_lists();
    // SAFETY: every pointer in `info` outlives the call.
    let raw = unsafe { entry.create_instance(&info, None) }.ok()?;
    Some((raw, entry))
}

/// The number of validation messages (warnings and errors) in this process; anything but 0 is a
/// bug.
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
    pub(super) entry: ash::Entry,
}

/// A physical device and what this program can do on it.
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
    /// Of a dispatch, along x.
    pub max_workgroups: u32,
    pub subgroup_size: u32,
    rank: u8,
}

/// The kind of a device that computes on the cores of its host.
pub const SOFTWARE: &str = "software";

/// The layers and extensions of this machine.
struct Installed {
    layers: Vec<vk::LayerProperties>,
    extensions: Vec<vk::ExtensionProperties>,
}

impl Installed {
    fn query(entry: &ash::Entry) -> Self {
        // SAFETY: plain queries on a loaded entry.
        let (layers, extensions) = unsafe {
            (
                entry.enumerate_instance_layer_properties(),
                entry.enumerate_instance_extension_properties(None),
            )
        };
        Self {
            layers: layers.unwrap_or_default(),
            extensions: extensions.unwrap_or_default(),
        }
    }

    fn has_extension(&self, name: &CStr) -> bool {
        let mut extensions = self.extensions.iter();
        extensions.any(|e| e.extension_name_as_c_str() == Ok(name))
    }

    fn check(&self, validation: bool, wanted: &[&CStr]) -> Result<()> {
        let mut layers = self.layers.iter();
        if validation && !layers.any(|l| l.layer_name_as_c_str() == Ok(VALIDATION_LAYER)) {
            return Err(Error::Device(
                "validation was asked for, but VK_LAYER_KHRONOS_validation is not installed \
                 (Debian: vulkan-validationlayers)"
                    .into(),
            ));
        }
        match wanted.iter().find(|name| !self.has_extension(name)) {
            None => Ok(()),
            Some(missing) => Err(Error::Display(format!(
                "Vulkan has no surface for this display: {} is missing",
                missing.to_string_lossy()
            ))),
        }
    }
}

impl Instance {
    /// Loads Vulkan. With `validation`, a missing layer is an error: a silent run must mean that
    /// the layer checked it.
    ///
    /// # Errors
    /// No Vulkan; no validation layer.
    pub fn new(validation: bool) -> Result<Arc<Self>> {
        Self::with_extensions(validation, &[])
    }

    /// With the extensions that a window's surface needs, if any.
    pub(super) fn with_extensions(validation: bool, wanted: &[&CStr]) -> Result<Arc<Self>> {
        ANCHOR.get_or_init(anchor);
        // SAFETY: the loader is a well-behaved system library, which `Self` unloads last.
        let entry = unsafe { ash::Entry::load() }.map_err(|e| {
            Error::Device(format!(
                "no Vulkan loader: {e}; on Debian install libvulkan1 and mesa-vulkan-drivers"
            ))
        })?;
        let installed = Installed::query(&entry);
        installed.check(validation, wanted)?;
        let debug_utils = validation || installed.has_extension(ext::debug_utils::NAME);
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
        // In the chain, the messenger also receives messages about this call. Synchronisation is
        // checked too.
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
        let lists = change_lists();
        // SAFETY: every pointer in `info` outlives the call.
        let raw = unsafe { entry.create_instance(&info, None) }
            .map_err(|e| Error::Device(format!("Vulkan instance: {e}")))?;
        drop(lists);
        let mut instance = Self {
            raw,
            debug_utils,
            presents: !wanted.is_empty(),
            messenger: None,
            entry,
        };
        if validation {
            instance.listen()?;
        }
        Ok(Arc::new(instance))
    }

    /// Receives the messages of the validation layer.
    fn listen(&mut self) -> Result<()> {
        let _lists = change_lists();
        let loader = ext::debug_utils::Instance::new(&self.entry, &self.raw);
        // SAFETY: the extension is enabled, and the callback is a plain function.
        let messenger = unsafe { loader.create_debug_utils_messenger(&messenger_info(), None) }
            .map_err(|e| Error::Device(format!("Vulkan debug messenger: {e}")))?;
        self.messenger = Some((loader, messenger));
        Ok(())
    }

    /// Every physical device, best first: those that can run this program, then by kind, discrete
    /// GPUs before integrated ones before software. `Candidate::index` is the loader's own order.
    ///
    /// # Errors
    /// Devices that cannot be listed.
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
        // SAFETY: plain queries on a device of this instance.
        let (base, memory, queues) = unsafe {
            (
                self.raw.get_physical_device_properties(raw),
                self.raw.get_physical_device_memory_properties(raw),
                self.raw.get_physical_device_queue_family_properties(raw),
            )
        };
        let mut support = match base.api_version {
            vk::API_VERSION_1_3.. => self.support(raw),
            _ => Support::missing("Vulkan 1.3"),
        };
        if graphics_family(&queues).is_none() {
            support.missing.push("a queue with graphics and compute");
        }
        let (kind, rank) = match base.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => ("discrete GPU", 0),
            vk::PhysicalDeviceType::INTEGRATED_GPU => ("integrated GPU", 1),
            vk::PhysicalDeviceType::VIRTUAL_GPU => ("virtual GPU", 2),
            vk::PhysicalDeviceType::CPU => (SOFTWARE, 4),
            _ => ("other", 3),
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
            driver: support.driver,
            missing: support.missing,
            int64_atomics: support.int64_atomics,
            heap_bytes: memory
                .memory_heaps_as_slice()
                .iter()
                .map(|h| h.size)
                .max()
                .unwrap_or(0),
            max_storage_buffer_range: u64::from(base.limits.max_storage_buffer_range),
            max_image_side: base.limits.max_image_dimension2_d,
            max_workgroups: base.limits.max_compute_work_group_count[0],
            subgroup_size: support.subgroup_size,
            rank,
        }
    }

    /// What a device of Vulkan 1.3 supports.
    fn support(&self, raw: vk::PhysicalDevice) -> Support {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
        let mut properties = vk::PhysicalDeviceProperties2::default()
            .push_next(&mut driver)
            .push_next(&mut subgroup);
        let mut f12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut f13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut features = vk::PhysicalDeviceFeatures2::default()
            .push_next(&mut f12)
            .push_next(&mut f13);
        // SAFETY: Vulkan 1.3 knows every struct of the chains.
        unsafe {
            self.raw
                .get_physical_device_properties2(raw, &mut properties);
            self.raw.get_physical_device_features2(raw, &mut features);
        }
        let base = features.features;
        let needed = [
            (base.full_draw_index_uint32 != 0, "fullDrawIndexUint32"),
            (f12.scalar_block_layout != 0, "scalarBlockLayout"),
            (f12.buffer_device_address != 0, "bufferDeviceAddress"),
            (f13.synchronization2 != 0, "synchronization2"),
            (
                f13.shader_demote_to_helper_invocation != 0,
                "shaderDemoteToHelperInvocation",
            ),
            (
                f13.maintenance4 != 0,
                "maintenance4 (LocalSizeId in compute shaders)",
            ),
            (f13.subgroup_size_control != 0, "subgroupSizeControl"),
            (f13.compute_full_subgroups != 0, "computeFullSubgroups"),
            (
                has_votes(&subgroup),
                "subgroup vote and ballot in compute and fragment shaders",
            ),
        ];
        let missing = needed.into_iter().filter(|(has, _)| !has);
        Support {
            driver: format!(
                "{} {}",
                text(driver.driver_name_as_c_str()),
                text(driver.driver_info_as_c_str())
            ),
            missing: missing.map(|(_, name)| name).collect(),
            int64_atomics: base.shader_int64 != 0 && f12.shader_buffer_int64_atomics != 0,
            subgroup_size: subgroup.subgroup_size,
        }
    }
}

/// What a device supports beyond the first version of Vulkan.
struct Support {
    driver: String,
    missing: Vec<&'static str>,
    int64_atomics: bool,
    subgroup_size: u32,
}

impl Support {
    /// A device so old that nothing else is known of it.
    fn missing(what: &'static str) -> Self {
        Self {
            driver: String::new(),
            missing: vec![what],
            int64_atomics: false,
            subgroup_size: 0,
        }
    }
}

fn has_votes(subgroup: &vk::PhysicalDeviceSubgroupProperties<'_>) -> bool {
    use vk::SubgroupFeatureFlags as F;
    let stages = vk::ShaderStageFlags::COMPUTE | vk::ShaderStageFlags::FRAGMENT;
    subgroup
        .supported_operations
        .contains(F::BASIC | F::VOTE | F::BALLOT)
        && subgroup.supported_stages.contains(stages)
}

/// A string of Vulkan; empty where it is malformed.
fn text(text: std::result::Result<&CStr, FromBytesUntilNulError>) -> String {
    text.map_or_else(
        |_| String::new(),
        |text| text.to_string_lossy().into_owned(),
    )
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
        let _lists = change_lists();
        // SAFETY: everything made from the instance holds it by `Arc`, so nothing is left. The
        // library is unloaded with the fields, after this.
        unsafe {
            if let Some((loader, messenger)) = &self.messenger {
                loader.destroy_debug_utils_messenger(*messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}
