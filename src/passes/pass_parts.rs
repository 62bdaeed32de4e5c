//! A render pass that is cut where its draws are more than a part of a submission takes.

use std::ops::Range;

use crate::vk::{Commands, Framebuffer, RenderPass};

/// Triangles of a part of a submission, at most: 0.1 s by lavapipe's two cores.
pub const PART_TRIANGLES: u32 = 1 << 14;

/// Where something is drawn, and in which parts.
#[derive(Clone, Copy)]
pub struct PassParts<'a> {
    /// The first clears what the second goes on with, see [`RenderPass::in_parts`].
    pub passes: [&'a RenderPass; 2],
    pub framebuffer: &'a Framebuffer,
    /// Samples across and down, in the left top of the framebuffer.
    pub size: (u32, u32),
    /// What colour is cleared to.
    pub clear: [u32; 4],
    /// Triangles of a part, at most; one at least.
    pub triangles: u32,
}

/// A render pass under way.
pub struct PartedPass<'a> {
    cmd: &'a Commands,
    parts: PassParts<'a>,
    /// Triangles that the present part may still draw.
    left: u32,
    /// Left, top, width and height that draws are clipped to.
    clip: [u32; 4],
}

impl<'a> PartedPass<'a> {
    /// Begins the first part.
    pub fn begin(cmd: &'a Commands, parts: PassParts<'a>) -> Self {
        let pass = Self {
            cmd,
            parts,
            left: parts.triangles.max(1),
            clip: [0, 0, parts.size.0, parts.size.1],
        };
        pass.begin_render_pass(0);
        pass
    }

    fn begin_render_pass(&self, pass: usize) {
        let PassParts {
            passes,
            framebuffer,
            size: (width, height),
            clear,
            ..
        } = self.parts;
        self.cmd.begin_render_pass(passes[pass], framebuffer, clear);
        self.cmd.viewport(0, 0, width, height);
        let [left, top, width, height] = self.clip;
        self.cmd.scissor(left, top, width, height);
    }

    /// For draws that are too few to be cut.
    pub fn commands(&self) -> &'a Commands {
        self.cmd
    }

    /// Clips the draws that follow to a rectangle of the framebuffer: left, top, width, height.
    pub fn clip(&mut self, clip: [u32; 4]) {
        self.clip = clip;
        let [left, top, width, height] = clip;
        self.cmd.scissor(left, top, width, height);
    }

    /// Draws runs of triangles, three indices each, with what `bind` binds: at first, and again in
    /// each part that begins.
    pub fn draw(&mut self, runs: impl IntoIterator<Item = Range<u32>>, bind: impl Fn(&Commands)) {
        let mut is_bound = false;
        for mut run in runs {
            while !run.is_empty() {
                if self.left == 0 {
                    self.next_part();
                    is_bound = false;
                }
                if !is_bound {
                    bind(self.cmd);
                    is_bound = true;
                }
                let count = (run.end - run.start).min(self.left);
                self.cmd.draw_indexed(3 * run.start, 3 * count);
                self.left -= count;
                run.start += count;
            }
        }
    }

    fn next_part(&mut self) {
        self.cmd.end_render_pass();
        self.cmd.part();
        self.begin_render_pass(1);
        self.left = self.parts.triangles.max(1);
    }

    pub fn end(self) {
        self.cmd.end_render_pass();
    }
}
