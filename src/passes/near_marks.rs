//! Marks the near elements of each source of a batch, whose form factors are found on the host, so
//! that no other pass looks for them. Shaders: `near_marks.comp`, `near_marks_relief.comp`: bits
//! alone, that need no twin.

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::NearBuffers;
use super::groups;
use super::shaders::{near_marks, near_marks_relief};
use crate::error::Result;
use crate::vk::{BoundCompute, Buffer, BufferUse, Commands, ComputePipeline, Device};

/// Of elements without relief, or of those with one.
pub struct NearMarks {
    /// One bit an element, `[slot][word]`.
    pub marks: Buffer,
    /// None where no element is near a source.
    bound: Option<BoundCompute>,
    parameters: near_marks::Parameters,
    size: [u32; 3],
}

impl NearMarks {
    /// For the `element_count` elements of a kind; `relief`: of those with one.
    pub fn new(
        device: &Arc<Device>,
        batch: &Batch,
        near: &NearBuffers,
        element_count: u32,
        relief: bool,
    ) -> Result<Self> {
        let words = u64::from(batch.slot_count) * u64::from(element_count.div_ceil(32));
        let marks = Buffer::new(device, "near marks", 4 * words.max(1), BufferUse::Storage)?;
        let (slots, starts, factors) = (&batch.slots, &near.starts, &near.factors);
        let near_marks = &marks;
        let bound = match (near.most, relief) {
            (0, _) => None,
            (_, false) => {
                let pipeline = ComputePipeline::new(device, "near marks", &near_marks::SHADER)?;
                Some(pipeline.bind(&near_marks::Bindings {
                    slots,
                    starts,
                    factors,
                    near_marks,
                })?)
            }
            (_, true) => {
                let shader = &near_marks_relief::SHADER;
                let pipeline = ComputePipeline::new(device, "near marks of relief", shader)?;
                let bindings = near_marks_relief::Bindings {
                    slots,
                    starts,
                    factors,
                    near_marks,
                };
                Some(pipeline.bind(&bindings)?)
            }
        };
        Ok(Self {
            bound,
            parameters: near_marks::Parameters { element_count },
            size: [groups(near.most), batch.slot_count, 1],
            marks,
        })
    }

    /// Forgets the marks of the last batch; before a barrier of transfers.
    pub fn clear(&self, cmd: &Commands) {
        cmd.fill(&self.marks, 0);
    }

    pub fn record(&self, cmd: &Commands) {
        if let Some(bound) = &self.bound {
            cmd.dispatch(bound, &self.parameters, self.size);
        }
    }
}
