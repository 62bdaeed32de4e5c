//! Pictures of what single sources see.

use super::drawing::Drawing;
use super::{Method, Solver};
use crate::constants::NONE;
use crate::error::Result;
use crate::passes::batch::BatchSize;

/// What one source sees.
#[derive(Debug, Clone)]
pub struct ItemPicture {
    pub source: u32,
    /// Pixels a side of a face.
    pub face: u32,
    /// Triangles by their place in the input, or [`NONE`], `[row][column]` of a column of N × 3N
    /// pixels; see [`crate::math::hemicube::face_rectangle`].
    pub items: Vec<u32>,
}

impl Solver {
    /// The source of each triangle, by its place in the input; of one that is cut into several the
    /// first, and [`NONE`] of one that never shoots.
    pub fn source_of_triangles(&self) -> Vec<u32> {
        let mut of_element = vec![NONE; self.problem.elements.len()];
        for (s, source) in self.problem.sources.list.iter().enumerate().rev() {
            if source.is_surface() {
                of_element[source.members()].fill(s as u32);
            }
        }
        self.problem.elements.to_input_order(&of_element)
    }

    /// Draws the item buffer of a source.
    ///
    /// # Errors
    /// A device that lacks the memory or fails.
    pub fn item_picture(&self, source: u32) -> Result<ItemPicture> {
        assert!(
            (source as usize) < self.problem.sources.list.len(),
            "a source of this scene"
        );
        let settings = &self.problem.settings;
        let first;
        let scene = match &self.method {
            Method::Shots(shots) => &shots.scene,
            Method::Rows(spine) => {
                first = spine.team.first();
                &first.scene
            }
        };
        let (device, face) = (&self.device, settings.hemicube);
        let size = BatchSize {
            slots: 1,
            face,
            list_room: None,
        };
        let (drawing, batch) = Drawing::new(device, scene, settings.culling, &size)?;
        let drawn = drawing.draw(device, &batch, source)?;
        let input = &self.problem.elements.input_index;
        let of_input = |item: u32| input.get(item as usize).copied().unwrap_or(NONE);
        Ok(ItemPicture {
            source,
            face,
            items: drawn.into_iter().map(of_input).collect(),
        })
    }
}
