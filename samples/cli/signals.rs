//! Interruption on request, and signals that must not kill.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

/// Set by the first SIGINT or SIGTERM. The second one ends the program at once.
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Installs the handlers. Where that fails (or on other systems) signals keep their default meaning.
    pub fn install() -> Self {
        let interrupt = Self::default();
        #[cfg(unix)]
        {
            use signal_hook::{consts, flag};
            for (signal, code) in [(consts::SIGINT, 130), (consts::SIGTERM, 143)] {
                // The order matters: the second signal finds the flag already set.
                let _ = flag::register_conditional_shutdown(signal, code, interrupt.0.clone());
                let _ = flag::register(signal, interrupt.0.clone());
            }
            // A file-size limit then fails the write (EFBIG) instead of killing the program in the middle of it.
            let _ = flag::register(consts::SIGXFSZ, Arc::default());
        }
        interrupt
    }

    /// True from the first signal on.
    pub fn requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
