//! Interruption on request, and signals that must not kill.

use std::sync::{
    Arc,
    atomic::{AtomicBool, AtomicUsize, Ordering},
};

/// Set by the first SIGINT or SIGTERM. The second one ends the program at once.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    requested: Arc<AtomicBool>,
    signal: Arc<AtomicUsize>,
}

impl Interrupt {
    /// Installs the handlers. Where that fails (or on other systems) signals keep their default meaning.
    pub fn install() -> Self {
        let interrupt = Self::default();
        #[cfg(unix)]
        {
            use signal_hook::{consts, flag};
            for signal in [consts::SIGINT, consts::SIGTERM] {
                // The order matters: the second signal finds the flag already set.
                let _ = flag::register_conditional_shutdown(signal, exit_code(signal), interrupt.requested.clone());
                let _ = flag::register_usize(signal, interrupt.signal.clone(), signal as usize);
                let _ = flag::register(signal, interrupt.requested.clone());
            }
            // A file-size limit then fails the write (EFBIG) instead of killing the program in the middle of it.
            let _ = flag::register(consts::SIGXFSZ, Arc::default());
        }
        interrupt
    }

    /// True from the first signal on.
    pub fn requested(&self) -> bool {
        self.requested.load(Ordering::Relaxed)
    }

    /// What a shell expects of a program that this signal ended: 130 for SIGINT, 143 for SIGTERM.
    pub fn exit_code(&self) -> u8 {
        exit_code(self.signal.load(Ordering::Relaxed) as i32) as u8
    }
}

fn exit_code(signal: i32) -> i32 {
    128 + if signal == 0 { 2 } else { signal }
}
