//! A thin, safe layer over Vulkan, without knowledge of radiosity. Only this module contains
//! `unsafe` code.
//!
//! Every object is a handle to an owner, which frees its Vulkan objects in `Drop` and keeps the
//! device alive. A descriptor set holds the owners of what it binds, a command buffer those of what
//! it records: objects may be dropped in any order and at any time, and are freed once no
//! submission can use them. Barriers are written where stages meet, through [`Stage`].
#![allow(unsafe_code)]

mod barrier;
mod buffer;
mod commands;
mod compute;
mod descriptors;
mod device;
mod graphics;
mod held;
mod image;
mod instance;
mod pipeline;
mod render_pass;
mod sampler;
mod shader;
mod stored_texels;
#[cfg(feature = "window")]
mod surface;
#[cfg(feature = "window")]
mod swapchain;
mod timestamps;
mod uploads;

use std::sync::{Mutex, MutexGuard, RwLock, RwLockReadGuard, RwLockWriteGuard};

pub use barrier::Stage;
pub use buffer::{Buffer, BufferUse, TEXEL_BYTES};
pub use commands::Commands;
pub use compute::{BoundCompute, ComputePipeline};
pub use descriptors::{Bind, Binding, DescriptorSet, Sampled};
pub use device::{Device, Left, Limits, PartTimes, left};
pub use graphics::{Blending, GraphicsPipeline, GraphicsState, Sides, VertexAttribute};
pub use image::{Image, ImageUse};
pub use instance::{Candidate, Instance, SOFTWARE, validation_log, validation_messages};
pub use render_pass::{AfterPass, Attachment, Framebuffer, RenderPass};
pub use sampler::Sampler;
pub use shader::{
    ComputeShader, GraphicsShaders, Interface, ShaderBinding, ShaderBindings, ShaderParameter,
    ShaderParameters,
};
pub use stored_texels::stored_texels;
#[cfg(feature = "window")]
pub use surface::Surface;
#[cfg(feature = "window")]
pub use swapchain::{Shown, Swapchain};
pub use timestamps::Timestamps;

pub use ash::vk::Format;

/// To name an object, the loader walks lists of all instances and devices without a lock of its
/// own: no other thread may create or destroy one meanwhile.
static LISTS: RwLock<()> = RwLock::new(());

/// While instances or devices are made or destroyed.
fn change_lists() -> RwLockWriteGuard<'static, ()> {
    LISTS.write().unwrap_or_else(|e| e.into_inner())
}

/// While the loader walks its lists.
fn walk_lists() -> RwLockReadGuard<'static, ()> {
    LISTS.read().unwrap_or_else(|e| e.into_inner())
}

/// Locks a mutex whose content is valid even after a panic of another thread.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|e| e.into_inner())
}
