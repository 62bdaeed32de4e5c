//! A Vulkan layer that lets one call fail. tests/faults/main.rs compiles it and puts it between the
//! program and its driver.
//!
//! `MESOLUX_FAULT="vkCreateBuffer 3 -2"`: the third call of vkCreateBuffer gives
//! `VK_ERROR_OUT_OF_DEVICE_MEMORY` and is not passed on; `3+`: and so do all after it. After
//! `VK_ERROR_DEVICE_LOST` (−4) the device stays lost. The fault makes the file of
//! `MESOLUX_FAULT_MADE=FILE`; `MESOLUX_FAULT_CALLS=FILE` writes the name of each call to a file.
//!
//! Arguments are integers and pointers, which registers and the stack hold alike; all are passed on
//! as words.

use std::ffi::{CStr, c_char, c_void};
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::SeqCst};

type Proc = *const c_void;
type GetProc = unsafe extern "C" fn(usize, *const c_char) -> Proc;

const INITIALIZATION_FAILED: i32 = -3;
const DEVICE_LOST: i32 = -4;
/// `VkStructureType`s of the loader's links in the chains of `vkCreateInstance`, `vkCreateDevice`.
const INSTANCE_LINK: u32 = 47;
const DEVICE_LINK: u32 = 48;

struct Fault {
    name: String,
    /// From 1.
    call: usize,
    /// Whether all calls from there on fail.
    on: bool,
    result: i32,
}

fn fault() -> Option<&'static Fault> {
    static FAULT: OnceLock<Option<Fault>> = OnceLock::new();
    let read = || {
        let text = std::env::var("MESOLUX_FAULT").ok()?;
        let mut words = text.split(' ');
        let (name, call) = (words.next()?, words.next()?);
        Some(Fault {
            name: name.into(),
            call: call.trim_end_matches('+').parse().ok()?,
            on: call.ends_with('+'),
            result: words.next()?.parse().ok()?,
        })
    };
    FAULT.get_or_init(read).as_ref()
}

fn calls() -> Option<&'static File> {
    static CALLS: OnceLock<Option<File>> = OnceLock::new();
    let open = || {
        let path = std::env::var_os("MESOLUX_FAULT_CALLS")?;
        (OpenOptions::new().append(true).create(true).open(path)).ok()
    };
    CALLS.get_or_init(open).as_ref()
}

static LOST: AtomicBool = AtomicBool::new(false);

/// What a call is to return in place of being made, if anything.
fn fails(name: &str, count: &AtomicUsize) -> Option<i32> {
    if let Some(mut calls) = calls() {
        let _ = calls.write_all(format!("{name}\n").as_bytes());
    }
    let call = 1 + count.fetch_add(1, SeqCst);
    if LOST.load(SeqCst) && name.starts_with("vkQueue") {
        return Some(DEVICE_LOST);
    }
    let fault = fault().filter(|fault| fault.name == name)?;
    if call != fault.call && !(fault.on && call > fault.call) {
        return None;
    }
    LOST.fetch_or(fault.result == DEVICE_LOST, SeqCst);
    if let Some(path) = std::env::var_os("MESOLUX_FAULT_MADE") {
        let _ = File::create(path);
    }
    Some(fault.result)
}

/// Wrappers by the number of their arguments, and a table of them by name.
macro_rules! wrappers {
    ($($name:ident($($argument:ident)*);)*) => {
        $(#[allow(non_snake_case)]
        mod $name {
            use super::*;
            pub static NEXT: AtomicUsize = AtomicUsize::new(0);
            static COUNT: AtomicUsize = AtomicUsize::new(0);
            pub unsafe extern "C" fn call($($argument: usize),*) -> i32 {
                if let Some(result) = fails(stringify!($name), &COUNT) {
                    return result;
                }
                type Call = unsafe extern "C" fn($(wrappers!(@word $argument)),*) -> i32;
                let next: Call = unsafe { std::mem::transmute(NEXT.load(SeqCst)) };
                unsafe { next($($argument),*) }
            }
        })*

        /// The wrapper of a function, where there is one, which passes calls on to `next`.
        fn wrapped(name: &str, next: Proc) -> Proc {
            match name {
                $(stringify!($name) => {
                    $name::NEXT.store(next as usize, SeqCst);
                    $name::call as *const () as Proc
                })*
                _ => next,
            }
        }
    };
    (@word $argument:ident) => { usize };
}

wrappers! {
    vkAcquireNextImageKHR(a b c d e f);
    vkAllocateCommandBuffers(a b c);
    vkAllocateDescriptorSets(a b c);
    vkAllocateMemory(a b c d);
    vkBeginCommandBuffer(a b);
    vkBindBufferMemory(a b c d);
    vkBindImageMemory(a b c d);
    vkCreateBuffer(a b c d);
    vkCreateBufferView(a b c d);
    vkCreateCommandPool(a b c d);
    vkCreateComputePipelines(a b c d e f);
    vkCreateDebugUtilsMessengerEXT(a b c d);
    vkCreateDescriptorPool(a b c d);
    vkCreateDescriptorSetLayout(a b c d);
    vkCreateFence(a b c d);
    vkCreateFramebuffer(a b c d);
    vkCreateGraphicsPipelines(a b c d e f);
    vkCreateImage(a b c d);
    vkCreateImageView(a b c d);
    vkCreatePipelineLayout(a b c d);
    vkCreateQueryPool(a b c d);
    vkCreateRenderPass(a b c d);
    vkCreateSampler(a b c d);
    vkCreateSemaphore(a b c d);
    vkCreateShaderModule(a b c d);
    vkCreateSwapchainKHR(a b c d);
    vkCreateWaylandSurfaceKHR(a b c d);
    vkCreateXcbSurfaceKHR(a b c d);
    vkCreateXlibSurfaceKHR(a b c d);
    vkDeviceWaitIdle(a);
    vkEndCommandBuffer(a);
    vkEnumerateDeviceExtensionProperties(a b c d);
    vkEnumeratePhysicalDevices(a b c);
    vkGetPhysicalDeviceSurfaceCapabilitiesKHR(a b c);
    vkGetPhysicalDeviceSurfaceFormatsKHR(a b c d);
    vkGetPhysicalDeviceSurfaceSupportKHR(a b c d);
    vkGetQueryPoolResults(a b c d e f g h);
    vkGetSwapchainImagesKHR(a b c d);
    vkMapMemory(a b c d e f);
    vkQueuePresentKHR(a b);
    vkQueueSubmit(a b c d);
    vkQueueSubmit2(a b c d);
    vkQueueWaitIdle(a);
    vkResetFences(a b c);
    vkSetDebugUtilsObjectNameEXT(a b);
    vkWaitForFences(a b c d e);
    vkWaitSemaphores(a b c);
}

static NEXT_OF_INSTANCE: AtomicUsize = AtomicUsize::new(0);
static NEXT_OF_DEVICE: AtomicUsize = AtomicUsize::new(0);

/// The start of every `Vk…CreateInfo`.
#[repr(C)]
struct Chained {
    kind: u32,
    next: *mut Chained,
}

/// `VkLayerInstanceCreateInfo` and `VkLayerDeviceCreateInfo`.
#[repr(C)]
struct LinkInfo {
    chained: Chained,
    /// 0: it holds a link.
    function: u32,
    link: *mut Link,
}

#[repr(C)]
struct Link {
    next: *mut Link,
    of_instance: GetProc,
    /// Of a device in the chain of a device.
    of_device: GetProc,
}

/// Takes this layer's link out of a chain.
unsafe fn link(info: *const Chained, kind: u32) -> Option<&'static Link> {
    unsafe {
        let mut at = (*info).next;
        while !at.is_null() {
            let found = at.cast::<LinkInfo>();
            if (*at).kind == kind && (*found).function == 0 {
                let link: &'static Link = &*(*found).link;
                (*found).link = link.next;
                return Some(link);
            }
            at = (*at).next;
        }
        None
    }
}

unsafe extern "C" fn create_instance(info: *const Chained, allocator: usize, out: usize) -> i32 {
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    type Call = unsafe extern "C" fn(*const Chained, usize, usize) -> i32;
    if let Some(result) = fails("vkCreateInstance", &COUNT) {
        return result;
    }
    let Some(link) = (unsafe { link(info, INSTANCE_LINK) }) else {
        return INITIALIZATION_FAILED;
    };
    NEXT_OF_INSTANCE.store(link.of_instance as usize, SeqCst);
    let next = unsafe { (link.of_instance)(0, c"vkCreateInstance".as_ptr()) };
    let next: Call = unsafe { std::mem::transmute(next) };
    unsafe { next(info, allocator, out) }
}

unsafe extern "C" fn create_device(
    device: usize,
    info: *const Chained,
    allocator: usize,
    out: usize,
) -> i32 {
    static COUNT: AtomicUsize = AtomicUsize::new(0);
    type Call = unsafe extern "C" fn(usize, *const Chained, usize, usize) -> i32;
    if let Some(result) = fails("vkCreateDevice", &COUNT) {
        return result;
    }
    let Some(link) = (unsafe { link(info, DEVICE_LINK) }) else {
        return INITIALIZATION_FAILED;
    };
    NEXT_OF_DEVICE.store(link.of_device as usize, SeqCst);
    let next = unsafe { (link.of_instance)(0, c"vkCreateDevice".as_ptr()) };
    let next: Call = unsafe { std::mem::transmute(next) };
    unsafe { next(device, info, allocator, out) }
}

unsafe fn next(of: &AtomicUsize, handle: usize, name: *const c_char) -> Proc {
    match of.load(SeqCst) {
        0 => std::ptr::null(),
        next => {
            let next: GetProc = unsafe { std::mem::transmute(next) };
            unsafe { next(handle, name) }
        }
    }
}

unsafe extern "C" fn of_instance(instance: usize, name: *const c_char) -> Proc {
    let text = unsafe { CStr::from_ptr(name) }.to_string_lossy();
    match &*text {
        "vkGetInstanceProcAddr" => return of_instance as *const () as Proc,
        "vkGetDeviceProcAddr" => return of_device as *const () as Proc,
        "vkCreateInstance" => return create_instance as *const () as Proc,
        "vkCreateDevice" => return create_device as *const () as Proc,
        _ => {}
    }
    let found = unsafe { next(&NEXT_OF_INSTANCE, instance, name) };
    let is_of_instance = text.starts_with("vkEnumerate")
        || text.starts_with("vkGetPhysicalDevice")
        || text.ends_with("SurfaceKHR")
        || text.ends_with("MessengerEXT");
    match is_of_instance && !found.is_null() {
        true => wrapped(&text, found),
        false => found,
    }
}

unsafe extern "C" fn of_device(device: usize, name: *const c_char) -> Proc {
    let text = unsafe { CStr::from_ptr(name) }.to_string_lossy();
    if text == "vkGetDeviceProcAddr" {
        return of_device as *const () as Proc;
    }
    let found = unsafe { next(&NEXT_OF_DEVICE, device, name) };
    match found.is_null() {
        true => found,
        false => wrapped(&text, found),
    }
}

/// `VkNegotiateLayerInterface`.
#[repr(C)]
pub struct Negotiation {
    kind: u32,
    next: *mut c_void,
    version: u32,
    of_instance: Option<GetProc>,
    of_device: Option<GetProc>,
    of_physical_device: Option<GetProc>,
}

/// # Safety
/// As the loader calls it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn vkNegotiateLoaderLayerInterfaceVersion(with: *mut Negotiation) -> i32 {
    let with = unsafe { &mut *with };
    with.version = with.version.min(2);
    with.of_instance = Some(of_instance);
    with.of_device = Some(of_device);
    with.of_physical_device = None;
    0
}
