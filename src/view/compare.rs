//! What a view is compared to.

use std::sync::Arc;

use super::detailer::Wanted;
use super::snapshot::Snapshot;
use super::surface_pass::SurfacePass;
use super::switches::Switches;
use super::tracer::Tracer;

/// What stands on the left of the line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Against {
    /// The light and the switches as they were.
    Held,
    Traced,
}

/// The left side of a comparison.
pub enum Left {
    Held(Box<Held>),
    Traced(Box<Traced>),
}

/// A state of the view that is kept.
pub struct Held {
    pub snapshot: Arc<Snapshot>,
    pub switches: Switches,
    pub surfaces: SurfacePass,
    pub name: String,
}

/// The view by the path tracer.
pub struct Traced {
    pub tracer: Tracer,
    /// What was last asked of it.
    pub wanted: Option<Wanted>,
    /// Rms difference from the detailed picture over its mean: `[seconds, difference]`.
    pub differences: Vec<[f64; 2]>,
    /// How far the tracer is.
    pub progress: String,
}

impl Left {
    pub fn against(&self) -> Against {
        match self {
            Self::Held(_) => Against::Held,
            Self::Traced(_) => Against::Traced,
        }
    }

    pub fn name(&self) -> &str {
        match self {
            Self::Held(held) => &held.name,
            Self::Traced(_) => "path tracer",
        }
    }
}

/// Where the two sides meet, as a share of the window's width.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line(f32);

/// Points within which the line is pressed.
const NEAR: f32 = 6.0;

impl Default for Line {
    fn default() -> Self {
        Self(0.6)
    }
}

impl Line {
    /// Moves it to a pixel of a window of this width.
    pub fn move_to(&mut self, x: f32, width: u32) {
        self.0 = (x / width.max(1) as f32).clamp(0.02, 0.98);
    }

    /// The pixel's column.
    pub fn column(self, width: u32) -> u32 {
        (self.0 * width as f32).round() as u32
    }

    pub fn is_at(self, x: f32, width: u32, scale: f32) -> bool {
        (x - self.0 * width as f32).abs() <= NEAR * scale
    }
}
