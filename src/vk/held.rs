//! What command buffers, descriptor sets and framebuffers keep alive.

use std::collections::HashMap;
use std::sync::Arc;

/// Owners of Vulkan objects, by address: each is held once, however often it is used.
#[derive(Default)]
pub(super) struct Held(HashMap<usize, Arc<dyn Send + Sync>>);

impl Held {
    pub(super) fn hold<T: Send + Sync + 'static>(&mut self, owner: &Arc<T>) {
        self.0
            .entry(Arc::as_ptr(owner).addr())
            .or_insert_with(|| Arc::clone(owner) as Arc<dyn Send + Sync>);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_owner_is_held_once() {
        let (first, second) = (Arc::new(1), Arc::new(1));
        let mut held = Held::default();
        for _ in 0..1000 {
            held.hold(&first);
            held.hold(&second);
        }
        assert_eq!(Arc::strong_count(&first), 2);
        assert_eq!(Arc::strong_count(&second), 2);
        drop(held);
        assert_eq!(Arc::strong_count(&first), 1);
    }
}
