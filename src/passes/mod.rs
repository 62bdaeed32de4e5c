//! GPU passes: one a file, named as its shader and as its CPU twin in [`crate::reference`]. Passes
//! know `vk` and mathematics, never each other; only the solver orders them.

pub mod batch;
pub mod bin_pixels;
pub mod bin_shots;
pub mod buffers;
pub mod couple;
pub mod cull;
pub mod form_factors;
pub mod fresh_rows;
pub mod gather;
pub mod item_buffer;
pub mod keep;
pub mod kept_rows;
pub mod light_rows;
pub mod measure;
pub mod measure_relief;
pub mod near_marks;
pub mod near_rows;
pub mod near_to_relief;
pub mod occluder_tree;
pub mod pass_parts;
pub mod receiver_blocks;
pub mod relief;
pub mod relief_buffers;
pub mod relief_hits;
pub mod relief_overdraw;
pub mod relief_rays;
pub mod relief_visibility;
pub mod scene_data;
pub mod send_relief;
pub mod shade;
pub mod shadow_rays;
pub mod shoot;
pub mod shot_light;
pub mod types;
pub mod unshot;
pub mod words;

use crate::constants::GROUP;
use crate::vk::Commands;
use fresh_rows::{FreshRows, RowShape};

/// The shaders, each in a module with its words, its bindings and its push constants by name,
/// which the build writes from the GLSL.
pub mod shaders {
    use crate::vk::Interface;

    /// One module, to be checked against the SPIR-V.
    pub struct Compiled {
        pub name: &'static str,
        /// A compute shader, or a fragment and a vertex shader.
        pub stages: &'static [&'static [u32]],
        pub interface: Interface,
    }

    include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
}

/// Workgroups for one invocation an item.
fn groups(items: u32) -> u32 {
    items.div_ceil(GROUP)
}

/// Elements times sources whose form factors a part of a submission finds, at most: 0.1 s and more by
/// lavapipe's two cores.
pub const PART_PAIRS: u64 = 1 << 17;

/// Into how many pieces a step of so much work is cut, where a part takes so much at most.
fn pieces(work: u64, most: u64) -> u32 {
    work.div_ceil(most).max(1) as u32
}

/// Elements times sources that a part keeps or couples, over those whose form factors it finds.
const KEEP_RATE: u64 = 32;

/// Records a pass over all elements of fresh rows for the slots of one part after another: `each`
/// gets the first, and how many there are.
fn by_slots(cmd: &Commands, rows: &FreshRows, slots: u32, mut each: impl FnMut(u32, u32)) {
    let RowShape { plain, meso } = rows.shape;
    let work = u64::from(plain.count + meso.count).max(1);
    let step = (KEEP_RATE * rows.part_pairs / work).clamp(1, slots.max(1).into()) as u32;
    for first in (0..slots).step_by(step as usize) {
        if first > 0 {
            cmd.part();
        }
        each(first, step.min(slots - first));
    }
}

/// Cuts what is recorded into parts, so that no submission is long enough for a driver to end it.
struct Parts {
    most: u64,
    recorded: u64,
}

impl Parts {
    /// Of so much work at most, but for what a single step takes.
    fn of(most: u64) -> Self {
        Self { most, recorded: 0 }
    }

    /// Before a step with so much work.
    fn step(&mut self, cmd: &Commands, work: u64) {
        if self.recorded > 0 && self.recorded + work > self.most {
            cmd.part();
            self.recorded = 0;
        }
        self.recorded += work;
    }
}
