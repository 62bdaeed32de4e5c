//! Strong emitters are few, carry most of the light and cast the sharp shadows: a loop of its own shoots their emission before the
//! others, with rays or finer hemicubes for what they see, and keeps their form factors for what they reflect later.

use std::sync::Arc;

use super::batch::{BatchLoop, OnDevice, Passes, Rule};
use super::devices::Parts;
use super::{EmitterShadows, Settings, Visibility};
use crate::constants::NONE;
use crate::error::Result;
use crate::passes::batch::{Batch, Hemicubes, Sight};
use crate::passes::occluder_tree::{OccluderTree, shadow_occluders};
use crate::sources::{Source, least_strong};
use crate::vk::Device;

/// Sources of a batch that draws, at most: their faces are large.
const SLOTS: u32 = 4;

/// The loop, if there is anything for it to find. `slots`: those of the other loop, whose form factors lie in the same buffers.
pub(super) fn new(
    device: &Arc<Device>,
    settings: &Settings,
    passes: &Arc<Passes>,
    on: &OnDevice<'_>,
    (parts, slots): (&Parts<'_>, u32),
    kept: Option<&Visibility>,
) -> Result<Option<BatchLoop>> {
    let sources = &parts.sources.list;
    let least = least_strong(sources, &settings.grouping);
    let is_kept = |i: usize, source: &Source| {
        let row = kept.and_then(|kept| kept.rows.get(i));
        source.area > 0.0 && row.is_some_and(|row| row.chunk != NONE)
    };
    let strong = |(i, s): (usize, &Source)| s.emitted_power() >= least && !is_kept(i, s);
    if least == 0.0 || !sources.iter().enumerate().any(strong) {
        return Ok(None);
    }
    let batch = match settings.emitter_shadows() {
        EmitterShadows::Rays => {
            let occluders = shadow_occluders(parts.elements, parts.connections, parts.occluders);
            let tree = OccluderTree::new(device, occluders)?;
            Batch::new(device, (slots, 0), Sight::Rays(tree))?
        }
        EmitterShadows::Hemicubes(face) => {
            let face = face.min(device.limits().max_image_side / 6 * 2);
            if face <= settings.hemicube {
                return Ok(None);
            }
            let slots = Hemicubes::fitting_slots(device, on.scene, face, slots.min(SLOTS));
            let pass = &passes.item_buffer.pass;
            Batch::drawing(
                device,
                pass,
                on.scene,
                (face, settings.list_room),
                (slots, 0),
            )?
        }
    };
    let rule = Rule {
        shots: settings.shots,
        stop_power: 0.0,
        least_emitted: least as f32,
    };
    BatchLoop::new(device, passes, batch, on, rule, None).map(Some)
}
