//! What is asked of the baker for overlays: sources, and the item buffer of one.

use super::Viewer;
use super::layout::KeptTexture;
use crate::constants::NONE;
use crate::solver::ItemPicture;
use crate::view::orders::Order;
use crate::view::switches::Switches;

/// Overlays received so far.
#[derive(Default)]
pub(super) struct Overlays {
    /// `[triangle]` of the input.
    pub sources: Vec<u32>,
    /// Number of lists of sources received so far.
    pub lists: u64,
    /// The last order.
    pub asked: Option<Asked>,
    pub items: Option<ItemPicture>,
    pub slots_picture: KeptTexture,
    pub items_picture: KeptTexture,
}

/// An order for overlays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Asked {
    /// [`Overlays::lists`] at the time.
    list: u64,
    /// Whose item buffer; None for the list of sources.
    source: Option<u32>,
}

impl Viewer {
    /// Orders the sources where they are to be shown and there are none yet, and the item buffer of
    /// the chosen element's source.
    pub(super) fn ask_sources(&mut self) {
        let Switches { sources, items, .. } = self.switches;
        let chosen = self.input.chosen.filter(|_| items);
        if !sources && chosen.is_none() {
            return;
        }
        let source = chosen.and_then(|e| self.overlays.sources.get(e as usize).copied());
        let wanted = Asked {
            list: self.overlays.lists,
            source,
        };
        if self.overlays.asked == Some(wanted)
            || (source.is_none() && !self.overlays.sources.is_empty())
        {
            return;
        }
        self.overlays.asked = Some(wanted);
        match source {
            // The bake under way reports them.
            None if self.is_baking() => {}
            None => self.baker.order(Order::Sources),
            Some(NONE) => {
                self.overlays.items = None;
                self.say("the element neither emits nor reflects: no source".into());
            }
            Some(source) => self.baker.order(Order::Items { source }),
        }
    }
}
