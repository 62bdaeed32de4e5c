//! A thin, safe layer over Vulkan: it knows nothing of radiosity. All `unsafe` of the crate stands here.
//!
//! Owners free what they own when dropped and hold the device alive. Barriers are written where stages meet, through
//! [`Stage`].

mod barrier;
mod buffer;
mod commands;
mod compute;
mod descriptors;
mod device;
mod graphics;
mod image;
mod instance;
#[cfg(feature = "window")]
mod surface;
#[cfg(feature = "window")]
mod swapchain;
mod timestamps;

pub use barrier::Stage;
pub use buffer::{Buffer, BufferUse};
pub use commands::Commands;
pub use compute::ComputePipeline;
pub use descriptors::{Bind, Binding, DescriptorLayout, DescriptorSet};
pub use device::{Device, Limits, left};
pub use graphics::{
    AfterPass, Attachment, Framebuffer, GraphicsPipeline, GraphicsState, RenderPass,
    VertexAttribute,
};
pub use image::{Image, ImageUse, Sampler};
pub use instance::{Candidate, Instance, validation_log, validation_messages};
#[cfg(feature = "window")]
pub use surface::Surface;
#[cfg(feature = "window")]
pub use swapchain::{Shown, Swapchain};
pub use timestamps::Timestamps;

pub use ash::vk::Format;
