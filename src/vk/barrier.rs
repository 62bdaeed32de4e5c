//! The table of pipeline stages between which barriers stand, with what each reads and writes.

use ash::vk;

/// A kind of work on the device. A barrier orders everything of one kind before everything of
/// another.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// Compute shaders reading and writing buffers and images, and fetches of indirect
    /// dispatches.
    Compute,
    /// Fetching draw commands, indices and vertices, and shaders of a draw reading buffers.
    Draw,
    /// Colour and depth attachments.
    Attachment,
    /// Copies and fills.
    Transfer,
    /// The CPU reading what was written.
    Host,
}

impl Stage {
    pub(super) fn masks(self) -> (vk::PipelineStageFlags2, vk::AccessFlags2) {
        use vk::{AccessFlags2 as A, PipelineStageFlags2 as S};
        match self {
            Self::Compute => (
                S::COMPUTE_SHADER | S::DRAW_INDIRECT,
                A::SHADER_STORAGE_READ
                    | A::SHADER_STORAGE_WRITE
                    | A::SHADER_SAMPLED_READ
                    | A::INDIRECT_COMMAND_READ,
            ),
            Self::Draw => (
                S::DRAW_INDIRECT
                    | S::INDEX_INPUT
                    | S::VERTEX_INPUT
                    | S::VERTEX_SHADER
                    | S::FRAGMENT_SHADER,
                A::INDIRECT_COMMAND_READ
                    | A::INDEX_READ
                    | A::VERTEX_ATTRIBUTE_READ
                    | A::SHADER_STORAGE_READ
                    | A::SHADER_SAMPLED_READ,
            ),
            Self::Attachment => (
                S::COLOR_ATTACHMENT_OUTPUT | S::EARLY_FRAGMENT_TESTS | S::LATE_FRAGMENT_TESTS,
                A::COLOR_ATTACHMENT_READ
                    | A::COLOR_ATTACHMENT_WRITE
                    | A::DEPTH_STENCIL_ATTACHMENT_READ
                    | A::DEPTH_STENCIL_ATTACHMENT_WRITE,
            ),
            Self::Transfer => (S::ALL_TRANSFER, A::TRANSFER_READ | A::TRANSFER_WRITE),
            Self::Host => (S::HOST, A::HOST_READ),
        }
    }
}
