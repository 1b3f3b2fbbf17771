//! An allocator that refuses what no input of ours may ask for. Without it the system ends the program, and nobody knows
//! which input it was.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::io::Write;

/// What one input may hold at once. Inputs have some hundred kilobytes.
const HELD_MAX: isize = 256 << 20;

thread_local! {
    /// Target and seed of this thread's input.
    static NOW: Cell<(&'static str, u64)> = const { Cell::new(("no target", 0)) };
    /// Bytes that this thread holds more than when the input began.
    static HELD: Cell<isize> = const { Cell::new(0) };
}

/// Says what this thread does from now on.
pub fn begin(target: &'static str, seed: u64) {
    NOW.set((target, seed));
    HELD.set(0);
}

/// The system's allocator up to a limit. Beyond it memory is refused, and standard error says to whom.
#[derive(Debug)]
pub struct Bounded;

impl Bounded {
    /// Whether this thread may hold so many bytes more.
    fn may(bytes: usize) -> bool {
        let held = HELD.get().saturating_add_unsigned(bytes);
        if held <= HELD_MAX {
            HELD.set(held);
            return true;
        }
        let (target, seed) = NOW.get();
        // Neither takes memory: nothing is built, and standard error has no buffer.
        let _ = writeln!(
            std::io::stderr(),
            "{target}, seed {seed}: asks for {bytes} bytes and would hold {held}"
        );
        false
    }
}

// SAFETY: every call goes to `System` with the arguments that came, so its promises hold; a null pointer is the answer that the
// trait gives for memory that cannot be had. The cells are constant and have no destructor, so that they can be used wherever
// memory is, and no call of theirs takes memory itself.
unsafe impl GlobalAlloc for Bounded {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if !Self::may(layout.size()) {
            return std::ptr::null_mut();
        }
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if !Self::may(layout.size()) {
            return std::ptr::null_mut();
        }
        // SAFETY: as the caller promises.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.set(HELD.get().saturating_sub_unsigned(layout.size()));
        // SAFETY: as the caller promises; the pointer came from `System`.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if !Self::may(size.saturating_sub(layout.size())) {
            return std::ptr::null_mut();
        }
        HELD.set(HELD.get().saturating_sub_unsigned(layout.size().saturating_sub(size)));
        // SAFETY: as the caller promises; the pointer came from `System`.
        unsafe { System.realloc(pointer, layout, size) }
    }
}
