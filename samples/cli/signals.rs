//! Interruption on request, and signals that must not kill.
//!
//! The first SIGINT or SIGTERM asks: a thread says so at once, the engine ends between two submissions, loops end where they look, and
//! what is complete is kept. Not everything can look: a driver that compiles, a foreign decoder. After 1.6 s (`PATIENCE`) that thread ends the
//! process, with nothing half written. A second signal does the same at once.

use std::{
    sync::{
        Arc, OnceLock,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    time::{Duration, Instant},
};

use lucerna::{Stop, image};

use crate::{console::Console, program::STOPPED_EARLY};

/// How long a program may take to end by itself once it was asked to: more than a device is given
/// ([`lucerna::gpu::Submission::wait`]), and together with what ending takes under two seconds.
const PATIENCE: Duration = Duration::from_millis(1600);
/// How often the thread that ends the process looks whether the program is still writing what it saves.
const LOOK: Duration = Duration::from_millis(20);

/// Set by the first SIGINT or SIGTERM. Clones are the same one.
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<State>);

#[derive(Debug, Default)]
struct State {
    requested: Arc<AtomicBool>,
    signal: Arc<AtomicUsize>,
    /// The program ends by itself where it can; otherwise the first signal ends it at once.
    listens: AtomicBool,
    /// Something that was asked for is complete.
    kept: AtomicBool,
    /// Writers of what must not be lost.
    saving: AtomicUsize,
    /// The first signal was answered.
    said: AtomicBool,
    /// The process is being ended: one more signal ends it without any care.
    ending: Arc<AtomicBool>,
}

/// What must not be lost is being written as long as this lives: the process is not ended meanwhile, but by one more signal.
#[derive(Debug)]
pub struct Saving(Arc<State>);

impl Drop for Saving {
    fn drop(&mut self) {
        self.0.saving.fetch_sub(1, Ordering::AcqRel);
    }
}

/// The one whose handlers are installed.
static INSTALLED: OnceLock<Interrupt> = OnceLock::new();

impl Interrupt {
    /// Installs the handlers, once in a process. Where that fails (or on other systems) signals keep their default meaning.
    pub fn catch(console: Console) {
        let interrupt = Self::default();
        if INSTALLED.set(interrupt.clone()).is_ok() {
            interrupt.handle(console);
        }
    }

    /// From now on the program looks itself whether it shall stop. Without handlers ([`Interrupt::catch`]) it is never asked to.
    pub fn install() -> Self {
        let interrupt = INSTALLED.get().cloned().unwrap_or_default();
        interrupt.0.listens.store(true, Ordering::Release);
        interrupt
    }

    /// For devices.
    pub fn stop() -> Stop {
        INSTALLED.get().map_or_else(Stop::default, |interrupt| Stop::by(Arc::clone(&interrupt.0.requested)))
    }

    #[cfg(unix)]
    fn handle(&self, console: Console) {
        use signal_hook::{consts, flag, low_level::pipe};
        use std::os::unix::net::UnixStream;

        // A file-size limit then fails the write (EFBIG) instead of killing the program in the middle of it.
        let _ = flag::register(consts::SIGXFSZ, Arc::default());
        let Ok((heard, told)) = UnixStream::pair() else { return };
        let state = Arc::clone(&self.0);
        let thread = std::thread::Builder::new().name("signals".into());
        // Without the thread nobody would answer.
        if thread.spawn(move || watch(&state, heard, console)).is_err() {
            return;
        }
        for signal in [consts::SIGINT, consts::SIGTERM] {
            // In the order of the calls: whoever reads the byte finds everything else set.
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

    /// Something that was asked for is complete: if the process is ended it has stopped early, not in vain.
    pub fn keep(&self) {
        self.0.kept.store(true, Ordering::Release);
    }

    /// Guards the writing of what must not be lost.
    #[must_use]
    pub fn saving(&self) -> Saving {
        self.0.saving.fetch_add(1, Ordering::AcqRel);
        Saving(Arc::clone(&self.0))
    }

    /// What a shell expects of a program that this signal ended: 130 for SIGINT, 143 for SIGTERM.
    pub fn exit_code(&self) -> u8 {
        exit_code(self.0.signal.load(Ordering::Acquire) as i32) as u8
    }
}

/// How the program ends if it fails because it was asked to stop; `None`: it was not asked.
pub fn stopped() -> Option<u8> {
    INSTALLED.get().filter(|interrupt| interrupt.requested()).map(|interrupt| interrupt.0.end_code())
}

/// Waits until the first signal was answered, if there was one: a program that ends at once must not end without a word.
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

    /// Ends the process with nothing half written.
    #[cfg(unix)]
    fn end(&self) -> ! {
        self.ending.store(true, Ordering::Release);
        image::leave_nothing_unfinished();
        signal_hook::low_level::exit(self.end_code().into())
    }

    /// Says that the signal was heard. In a thread of its own: who does not read what a program says must still be able to end it.
    fn say(self: &Arc<Self>, console: Console) {
        let state = Arc::clone(self);
        let _ = std::thread::Builder::new().spawn(move || {
            console.aside("stopping; what is complete is kept (again to stop now)");
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
