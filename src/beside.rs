//! Two things done at once.

use std::panic::resume_unwind;
use std::thread::scope;

/// What both give; `other` runs on a thread of its own.
///
/// Unlike `rayon::join` it takes up no other work while it waits, which may ask for what it holds,
/// and `own` need not be `Send`.
pub fn beside<A, B: Send>(own: impl FnOnce() -> A, other: impl FnOnce() -> B + Send) -> (A, B) {
    scope(|scope| {
        let other = scope.spawn(other);
        let own = own();
        (
            own,
            other.join().unwrap_or_else(|panic| resume_unwind(panic)),
        )
    })
}
