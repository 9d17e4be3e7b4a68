//! Leaving a process while threads of a CPU driver still work on what was given up.

use std::sync::Once;

/// From now on the process ends without running the exit handlers of C libraries: those of a driver (LLVM's, say) take away
/// what its threads are still using, and the process would die of a segmentation fault after its last message instead of
/// ending with its exit code.
pub(crate) fn skip_foreign_handlers() {
    static ONCE: Once = Once::new();
    ONCE.call_once(register);
}

#[cfg(all(target_os = "linux", target_env = "gnu"))]
fn register() {
    use std::ffi::{c_int, c_void};

    unsafe extern "C" {
        fn on_exit(handler: extern "C" fn(c_int, *mut c_void), argument: *mut c_void) -> c_int;
        fn _exit(status: c_int) -> !;
    }

    extern "C" fn leave(status: c_int, _: *mut c_void) {
        // SAFETY: ends the process at once; Rust's own buffers are flushed before exit handlers run.
        unsafe { _exit(status) }
    }

    // SAFETY: the handler needs nothing. Handlers run in reverse order, so that this one comes before those of drivers that
    // were loaded earlier. If it cannot be registered, nothing is worse than before.
    unsafe { on_exit(leave, std::ptr::null_mut()) };
}

#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn register() {}
