//! Calls the reader of another crate on bytes that may be damaged. If that reader panics, the caller gets an error.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

thread_local! {
    /// This thread is behind the seam: its panics are told as errors, not on the terminal.
    static BEHIND: Cell<bool> = const { Cell::new(false) };
}

/// Does what may panic on damaged bytes. Whatever it was reading must be given up afterwards.
///
/// # Errors
/// The panic's message.
pub fn guarded<T>(read: impl FnOnce() -> T) -> Result<T, String> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let usual = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !BEHIND.get() {
                usual(info);
            }
        }));
    });
    let before = BEHIND.replace(true);
    let done = panic::catch_unwind(AssertUnwindSafe(read));
    BEHIND.set(before);
    done.map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or_default();
        format!("bytes that its reader cannot follow ({text})")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_behind_the_seam_is_an_error_before_it() {
        assert_eq!(guarded(|| 7), Ok(7));
        let error = guarded(|| [1, 2][std::hint::black_box(2)]).unwrap_err();
        assert!(error.contains("index out of bounds"), "{error}");
        let error = guarded(|| panic!("{} bytes", 3)).map(|(): ()| ()).unwrap_err();
        assert!(error.contains("3 bytes"), "{error}");
    }
}
