//! What happens where there is no memory for the program's own data: one line and exit code 2, as
//! for every other error. Rust's own answer is to abort, or to panic in a thread of a pool.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;
use std::sync::atomic::{AtomicBool, Ordering};

#[global_allocator]
static ALLOCATOR: Allocator = Allocator;

/// The system's allocator, which ends the program rather than to fail.
struct Allocator;

// SAFETY: every call is passed on to the system's allocator as it came.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller promises.
        found(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller promises.
        found(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as the caller promises.
        found(unsafe { System.realloc(block, layout, size) }, size)
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(block, layout) }
    }
}

fn found(block: *mut u8, bytes: usize) -> *mut u8 {
    if block.is_null() {
        end(bytes);
    }
    block
}

#[cold]
fn end(bytes: usize) -> ! {
    static ENDS: AtomicBool = AtomicBool::new(false);
    if ENDS.swap(true, Ordering::SeqCst) {
        // Another thread is writing the line.
        loop {
            std::thread::park();
        }
    }
    // Without an allocation, and without a lock that this thread may hold.
    let mut line = [0; 80];
    let mut rest = &mut line[..];
    let _ = writeln!(rest, "mesolux: out of memory: no room for {bytes} bytes");
    let left = rest.len();
    let _ = rustix::io::write(std::io::stderr(), &line[..80 - left]);
    // No destructors: those of drivers would meet threads that go on.
    signal_hook::low_level::exit(2)
}
