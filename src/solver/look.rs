//! Looks at single sources, for a person's eyes.

use glam::Vec3;

use super::Solver;
use crate::constants::{KIND_POINT, NONE};
use crate::error::Result;
use crate::hemicube::pixel_count;
use crate::passes::batch::Batch;
use crate::passes::buffers::write;
use crate::passes::cull::Cull;
use crate::passes::item_buffer::ItemBuffer;
use crate::passes::types::Slot;
use crate::vk::{Buffer, BufferUse, Commands, Stage};

/// What one source sees.
#[derive(Debug, Clone)]
pub struct ItemPicture {
    pub source: u32,
    /// Pixels a side of a face.
    pub face: u32,
    /// Triangles by their place in the input, or [`NONE`], `[row][column]` of a column of N × 3N pixels; see
    /// [`crate::hemicube::face_rectangle`].
    pub items: Vec<u32>,
}

impl Solver {
    /// The source of each triangle, by its place in the input; of one that is cut into several the first, and [`NONE`] of one
    /// that never shoots.
    pub fn source_of_triangles(&self) -> Vec<u32> {
        let mut of_element = vec![NONE; self.elements.len()];
        for (s, source) in self.sources.list.iter().enumerate().rev() {
            if source.kind != KIND_POINT {
                let first = source.first_element as usize;
                of_element[first..first + source.element_count as usize].fill(s as u32);
            }
        }
        self.elements.to_input_order(&of_element)
    }

    /// Draws the item buffer of a source.
    ///
    /// # Errors
    /// A device that lacks the memory or fails.
    pub fn item_picture(&self, source: u32) -> Result<ItemPicture> {
        assert!(
            (source as usize) < self.sources.list.len(),
            "a source of this scene"
        );
        let (device, scene) = (&self.device, &self.scene);
        let face = self.settings.hemicube;
        let item_buffer = ItemBuffer::new(device)?;
        let batch = Batch::drawing(device, &item_buffer.pass, scene, (face, None), (1, 0))?;
        let slot = Slot {
            emitted: Vec3::ONE,
            source,
            reflected: Vec3::ZERO,
            scale: 1.0,
        };
        write(device, &batch.slots, &[slot])?;
        let cull = Cull::new(device, self.settings.culling)?;
        let sets = (cull.bind(scene, &batch)?, item_buffer.bind(&batch)?);
        let pixels = pixel_count(face);
        let bytes = 4 * pixels as u64;
        let readback = Buffer::new(device, "item picture", bytes, BufferUse::Readback)?;
        Commands::run(device, "item picture", |cmd| {
            item_buffer.record(cmd, &sets.1, (&cull, &sets.0), (scene, &batch), || {});
            cmd.copy_shader_image_to_buffer(&batch.hemicubes().items, &readback);
            cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
            Ok(())
        })?;
        let input = &self.elements.input_index;
        let items: Vec<u32> = readback.read(0, pixels);
        let of_input = |item: u32| input.get(item as usize).copied().unwrap_or(NONE);
        Ok(ItemPicture {
            source,
            face,
            items: items.into_iter().map(of_input).collect(),
        })
    }
}
