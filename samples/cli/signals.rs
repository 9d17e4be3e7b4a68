//! Signals: interruption on request, without incomplete files.
//!
//! The first SIGINT or SIGTERM requests a stop. A thread tells the user at once; the engine stops between two submissions, and loops stop when
//! they check the request. Complete output is kept. Some code cannot check, for example a driver that compiles, or a foreign decoder. After
//! 1.6 s (`PATIENCE`) the thread therefore ends the process, without leaving incomplete files. A second signal does so at once.

use std::{
    sync::{
        Arc, OnceLock,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    time::{Duration, Instant},
};

use lucerna::{Stop, image};

use crate::{console::Console, program::STOPPED_EARLY};

/// Time in which a program may stop by itself after a request. It is longer than the time that a device gets
/// ([`lucerna::gpu::Submission::wait`]), and together with the time for ending the process it is below two seconds.
const PATIENCE: Duration = Duration::from_millis(1600);
/// Interval at which the thread that ends the process checks whether the program is still saving data.
const LOOK: Duration = Duration::from_millis(20);

/// A request to stop, set by the first SIGINT or SIGTERM. Clones share their state.
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<State>);

#[derive(Debug, Default)]
struct State {
    requested: Arc<AtomicBool>,
    signal: Arc<AtomicUsize>,
    /// The program checks for requests and stops by itself. Otherwise the first signal ends it at once.
    listens: AtomicBool,
    /// Some requested output is complete.
    kept: AtomicBool,
    /// Number of writers of data that must not be lost.
    saving: AtomicUsize,
    /// The message about the first signal was printed.
    said: AtomicBool,
    /// The process is being ended. One more signal ends it at once, without waiting for writers.
    ending: Arc<AtomicBool>,
}

/// A guard for writing data that must not be lost. While it lives, only one more signal ends the process.
#[derive(Debug)]
pub struct Saving(Arc<State>);

impl Drop for Saving {
    fn drop(&mut self) {
        self.0.saving.fetch_sub(1, Ordering::AcqRel);
    }
}

/// The request whose signal handlers are installed.
static INSTALLED: OnceLock<Interrupt> = OnceLock::new();

impl Interrupt {
    /// Installs the handlers, once per process. If this fails, and on other systems, signals keep their default meaning.
    pub fn catch(console: Console) {
        let interrupt = Self::default();
        if INSTALLED.set(interrupt.clone()).is_ok() {
            interrupt.handle(console);
        }
    }

    /// Declares that the program from now on checks for requests itself. Without handlers ([`Interrupt::catch`]) there are no requests.
    pub fn install() -> Self {
        let interrupt = INSTALLED.get().cloned().unwrap_or_default();
        interrupt.0.listens.store(true, Ordering::Release);
        interrupt
    }

    /// The request, in the form that devices check.
    pub fn stop() -> Stop {
        INSTALLED.get().map_or_else(Stop::default, |interrupt| Stop::by(Arc::clone(&interrupt.0.requested)))
    }

    #[cfg(unix)]
    fn handle(&self, console: Console) {
        use signal_hook::{consts, flag, low_level::pipe};
        use std::os::unix::net::UnixStream;

        // With a handler a file-size limit makes the write fail (EFBIG), instead of killing the program during the write.
        let _ = flag::register(consts::SIGXFSZ, Arc::default());
        let Ok((heard, told)) = UnixStream::pair() else { return };
        let state = Arc::clone(&self.0);
        let thread = std::thread::Builder::new().name("signals".into());
        // Without the thread signals would have no effect.
        if thread.spawn(move || watch(&state, heard, console)).is_err() {
            return;
        }
        for signal in [consts::SIGINT, consts::SIGTERM] {
            // Handlers run in the order of their registration: when the thread reads the byte, all other flags are set.
            let _ = flag::register_conditional_shutdown(signal, exit_code(signal), Arc::clone(&self.0.ending));
            let _ = flag::register_usize(signal, Arc::clone(&self.0.signal), signal as usize);
            let _ = flag::register(signal, Arc::clone(&self.0.requested));
            let _ = told.try_clone().map(|told| pipe::register(signal, told));
        }
    }

    #[cfg(not(unix))]
    fn handle(&self, _console: Console) {}

    /// True from the first signal on.
    pub fn requested(&self) -> bool {
        self.0.requested.load(Ordering::Acquire)
    }

    /// Declares that some requested output is complete. If the process is ended now, the exit code says "stopped early".
    pub fn keep(&self) {
        self.0.kept.store(true, Ordering::Release);
    }

    /// A guard for writing data that must not be lost.
    #[must_use]
    pub fn saving(&self) -> Saving {
        self.0.saving.fetch_add(1, Ordering::AcqRel);
        Saving(Arc::clone(&self.0))
    }

    /// The exit code that shells expect after this signal: 130 for SIGINT, 143 for SIGTERM.
    pub fn exit_code(&self) -> u8 {
        exit_code(self.0.signal.load(Ordering::Acquire) as i32) as u8
    }
}

/// The exit code after a request to stop; `None` without a request.
pub fn stopped() -> Option<u8> {
    INSTALLED.get().filter(|interrupt| interrupt.requested()).map(|interrupt| interrupt.0.end_code())
}

/// Waits until the message about the first signal is printed, if there was a signal. Otherwise a program that ends at once would print
/// nothing.
pub fn let_it_be_said() {
    let Some(Interrupt(state)) = INSTALLED.get() else { return };
    let begun = Instant::now();
    let waits = || state.requested.load(Ordering::Acquire) && !state.said.load(Ordering::Acquire);
    while waits() && begun.elapsed() < Duration::from_millis(200) {
        std::thread::sleep(Duration::from_millis(2));
    }
}

impl State {
    fn end_code(&self) -> u8 {
        match self.kept.load(Ordering::Acquire) {
            true => STOPPED_EARLY,
            false => exit_code(self.signal.load(Ordering::Acquire) as i32) as u8,
        }
    }

    /// Ends the process without leaving incomplete files.
    #[cfg(unix)]
    fn end(&self) -> ! {
        self.ending.store(true, Ordering::Release);
        image::leave_nothing_unfinished();
        signal_hook::low_level::exit(self.end_code().into())
    }

    /// Prints that the signal was received. Runs in its own thread, because printing blocks if nobody reads stderr, and signals must still
    /// end the program.
    fn say(self: &Arc<Self>, console: Console) {
        let state = Arc::clone(self);
        let _ = std::thread::Builder::new().spawn(move || {
            console.info("stopping; complete output is kept (signal again to stop now)");
            state.said.store(true, Ordering::Release);
        });
    }
}

/// Reads a byte for each signal.
#[cfg(unix)]
fn watch(state: &Arc<State>, heard: std::os::unix::net::UnixStream, console: Console) {
    use std::io::{ErrorKind, Read};

    let mut byte = [0];
    let mut heard = heard;
    if heard.read_exact(&mut byte).is_err() {
        return;
    }
    if !state.listens.load(Ordering::Acquire) {
        state.end();
    }
    let begun = Instant::now();
    state.say(console);
    loop {
        let left = PATIENCE.saturating_sub(begun.elapsed()).max(LOOK);
        if heard.set_read_timeout(Some(left)).is_err() {
            return;
        }
        match heard.read_exact(&mut byte) {
            Ok(()) => state.end(),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(_) => return,
        }
        if begun.elapsed() >= PATIENCE && state.saving.load(Ordering::Acquire) == 0 {
            state.end();
        }
    }
}

fn exit_code(signal: i32) -> i32 {
    128 + if signal == 0 { 2 } else { signal }
}
