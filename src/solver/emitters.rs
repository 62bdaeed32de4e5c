//! Finer hemicubes for strong emitters. They are few, carry most of the light and cast the sharp shadows: a loop of its own
//! shoots their emission before the others, and keeps their form factors for what they reflect later.

use std::sync::Arc;

use super::batch::{BatchLoop, OnDevice, Passes, Rule};
use super::{Settings, Visibility};
use crate::constants::NONE;
use crate::error::Result;
use crate::passes::buffers::Batch;
use crate::sources::Source;
use crate::vk::Device;

/// The weakest emitters that are drawn finely, as a share of [`crate::sources::Grouping::max_power`]. Groups that are cut for
/// their power are stronger. It bounds their number, 512 by default, also where everything glows; each of many weak lamps has
/// errors of its own, which even out.
const LEAST: f64 = 0.25;

/// Sources of a batch, at most: their faces are large.
const SLOTS: u32 = 4;

/// The loop, if there is anything for it to draw.
pub(super) fn new(
    device: &Arc<Device>,
    settings: &Settings,
    passes: &Arc<Passes>,
    on: &OnDevice<'_>,
    (sources, kept): (&[Source], Option<&Visibility>),
) -> Result<Option<BatchLoop>> {
    let face = settings
        .emitter_face()
        .min(device.limits().max_image_side / 6 * 2);
    let power: f64 = sources.iter().map(Source::emitted_power).sum();
    let least = LEAST * settings.grouping.max_power * power;
    let is_kept = |i: usize, source: &Source| {
        let row = kept.and_then(|kept| kept.rows.get(i));
        source.area > 0.0 && row.is_some_and(|row| row.chunk != NONE)
    };
    let strong = |(i, s): (usize, &Source)| s.emitted_power() >= least && !is_kept(i, s);
    if face <= settings.hemicube || power == 0.0 || !sources.iter().enumerate().any(strong) {
        return Ok(None);
    }
    // No more than the other loop has, whose form factors lie in the same buffers.
    let wanted = settings.batch.min(on.scene.source_count).clamp(1, SLOTS);
    let slots = Batch::fitting_slots(device, on.scene, face, wanted);
    let batch = Batch::new(device, &passes.item_buffer.pass, on.scene, face, (slots, 0))?;
    let rule = Rule {
        shots: settings.shots,
        stop_power: 0.0,
        least_emitted: least as f32,
    };
    BatchLoop::new(device, passes, batch, on, rule, None).map(Some)
}
