//! Dispatches of compute shaders.

use ash::vk;

use super::Commands;
use crate::vk::{BoundCompute, Buffer, ShaderParameters};

impl Commands {
    /// Dispatches `groups` workgroups; nothing is recorded where there are none.
    pub fn dispatch<P: ShaderParameters>(&self, bound: &BoundCompute, push: &P, groups: [u32; 3]) {
        self.dispatch_from(bound, push, [0; 3], groups);
    }

    /// Dispatches `groups` workgroups of a larger number, of which `first` is the first.
    pub fn dispatch_from<P: ShaderParameters>(
        &self,
        bound: &BoundCompute,
        push: &P,
        first: [u32; 3],
        groups: [u32; 3],
    ) {
        if groups.contains(&0) {
            return;
        }
        self.bind_compute(bound, push);
        let ([x, y, z], [width, height, depth]) = (first, groups);
        // SAFETY: a pipeline with its set and constants is bound, made for any first group.
        unsafe {
            self.device
                .raw
                .cmd_dispatch_base(self.raw(), x, y, z, width, height, depth);
        }
    }

    /// Dispatches as many workgroups as the device has written at byte `offset` of `counts`.
    pub fn dispatch_indirect<P: ShaderParameters>(
        &self,
        bound: &BoundCompute,
        push: &P,
        counts: &Buffer,
        offset: u64,
    ) {
        self.bind_compute(bound, push);
        self.hold(&counts.owner);
        // SAFETY: as above; the command lies within the buffer and was written by a pass.
        unsafe {
            self.device
                .raw
                .cmd_dispatch_indirect(self.raw(), counts.owner.raw, offset);
        }
    }

    fn bind_compute<P: ShaderParameters>(&self, bound: &BoundCompute, push: &P) {
        let BoundCompute { pipeline, set } = bound;
        let pipeline = &pipeline.owner;
        let bytes = pipeline.push_constants(push);
        pipeline.check_set(&set.owner);
        self.hold(&set.owner);
        let raw = &self.device.raw;
        // SAFETY: set and constants are those of the pipeline, as checked.
        unsafe {
            raw.cmd_bind_pipeline(self.raw(), vk::PipelineBindPoint::COMPUTE, pipeline.raw);
            raw.cmd_bind_descriptor_sets(
                self.raw(),
                vk::PipelineBindPoint::COMPUTE,
                pipeline.layout,
                0,
                &[set.owner.raw],
                &[],
            );
            if !bytes.is_empty() {
                raw.cmd_push_constants(
                    self.raw(),
                    pipeline.layout,
                    vk::ShaderStageFlags::COMPUTE,
                    0,
                    bytes,
                );
            }
        }
    }
}
