//! The thread that renders what a side of the window wants. The newest request counts; older ones are dropped.
//!
//! While something moves, pictures are quick: one for each request, and smaller ones where a whole one takes long. At rest a still follows that `render`
//! would write, bit by bit. A request interrupts a still, and quick pictures that take more than a second.

use std::{
    sync::{
        Arc, Condvar, Mutex, MutexGuard,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread::JoinHandle,
    time::{Duration, Instant},
};

use lucerna::{
    Error, ErrorKind, Result, Stop,
    gpu::{Gpu, GpuOptions},
};

use super::{
    file,
    painted::Painter,
    still, truth,
    wanted::{Shown, Wanted},
};

/// A quick picture that takes longer may be interrupted by the next request.
const PATIENCE: Duration = Duration::from_secs(1);

/// Numbers of pictures, of all sessions.
static NUMBERS: AtomicU64 = AtomicU64::new(0);

/// What the thread does.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Doing {
    #[default]
    Nothing,
    /// Opens the device, or prepares a technique. Finished and whole number of units, if they are known.
    Preparing(String, Option<(u64, u64)>),
    /// Renders, with the share that is done.
    Rendering(f64),
}

/// A thread that renders.
#[derive(Debug)]
pub struct Session {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

/// What the thread and the window share.
#[derive(Debug)]
pub(super) struct Shared {
    state: Mutex<State>,
    changed: Condvar,
    /// Asks the device to stop.
    stop: Arc<AtomicBool>,
    waker: Wake,
}

/// Tells the window that there is something new.
#[derive(Clone)]
pub struct Wake(pub Arc<dyn Fn() + Send + Sync>);

impl std::fmt::Debug for Wake {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Wake")
    }
}

#[derive(Debug, Default)]
struct State {
    /// The newest request, until the thread takes it.
    wanted: Option<Wanted>,
    /// The request that the thread has taken, and how often it was tried again after the device was lost.
    now: Option<Wanted>,
    tries: u32,
    shown: Option<Arc<Shown>>,
    failed: Option<Arc<Error>>,
    doing: Doing,
    /// Device and driver.
    device: String,
    /// When the present picture was begun.
    begun: Option<Instant>,
    /// A request interrupts the present work at once.
    fine: bool,
    /// Nothing is wanted any more.
    resting: bool,
    closing: bool,
}

impl Session {
    /// Starts the thread. `name`: for debuggers.
    ///
    /// # Errors
    /// `Runtime` if the system gives no thread.
    pub fn start(name: &str, options: GpuOptions, waker: Wake) -> Result<Self> {
        let stop = Arc::new(AtomicBool::new(false));
        let shared = Arc::new(Shared { state: Mutex::default(), changed: Condvar::new(), stop: stop.clone(), waker });
        let options = GpuOptions { stop: Some(Stop::by(stop)), ..options };
        let (name, of_thread) = (format!("lucerna {name}"), shared.clone());
        let thread = std::thread::Builder::new().name(name).spawn(move || of_thread.work(&options));
        let thread = thread.map_err(|error| {
            Error::new(ErrorKind::Runtime, "no thread for the picture could be started").caused_by(error)
        })?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Asks for a picture. A request that is not begun yet is dropped.
    pub fn ask(&self, wanted: Wanted) {
        let mut state = self.shared.lock();
        let late = state.begun.is_some_and(|begun| begun.elapsed() > PATIENCE);
        // Work that the new request needs goes on: preparations, and a quick picture while the camera or a lamp still moves. The path tracer looks for
        // requests after each tile, and keeps its paths if nobody interrupts a tile.
        let useful = state.now.as_ref().is_some_and(|now| {
            let prepares = matches!(state.doing, Doing::Preparing(..));
            now.same_scene(&wanted) && (prepares || now.is_truth() || (now.moving && wanted.moving))
        });
        if state.fine || (late && !useful) {
            self.shared.stop.store(true, Ordering::Relaxed);
        }
        state.wanted = Some(wanted);
        state.resting = false;
        drop(state);
        self.shared.changed.notify_all();
    }

    /// Ends the present work, and drops the request that is not begun. The path tracer keeps its paths.
    pub fn rest(&self) {
        let mut state = self.shared.lock();
        state.wanted = None;
        state.resting = true;
        if !state.now.as_ref().is_some_and(Wanted::is_truth) {
            self.shared.stop.store(true, Ordering::Relaxed);
        }
    }

    /// The newest picture.
    pub fn shown(&self) -> Option<Arc<Shown>> {
        self.shared.lock().shown.clone()
    }

    /// What the thread does, and why the last request failed.
    pub fn status(&self) -> (Doing, Option<Arc<Error>>) {
        let state = self.shared.lock();
        (state.doing.clone(), state.failed.clone())
    }

    /// Device and driver; empty until the device is open.
    pub fn device(&self) -> String {
        self.shared.lock().device.clone()
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.shared.lock().closing = true;
        self.shared.stop.store(true, Ordering::Relaxed);
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            // A panic of the thread was reported by the hook of the program.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Waits for the next request; `None`: the window closes.
    pub fn next(&self) -> Option<Wanted> {
        let mut state = self.lock();
        (state.begun, state.fine) = (None, false);
        if state.wanted.is_none() && std::mem::take(&mut state.doing) != Doing::Nothing {
            (self.waker.0)();
        }
        loop {
            if state.closing {
                return None;
            }
            if let Some(wanted) = state.wanted.take() {
                // From here on only a newer request stops the device.
                self.stop.store(false, Ordering::Relaxed);
                state.begun = Some(Instant::now());
                state.failed = None;
                (state.now, state.tries) = (Some(wanted.clone()), 0);
                return Some(wanted);
            }
            state = self.changed.wait(state).unwrap_or_else(|poisoned| poisoned.into_inner());
        }
    }

    /// A newer request waits, or the window closes.
    pub fn is_old(&self) -> bool {
        let state = self.lock();
        state.closing || state.resting || state.wanted.is_some()
    }

    /// A request for another technique or scene waits, or the window closes.
    pub fn is_for_another(&self, first: &Wanted) -> bool {
        let state = self.lock();
        state.closing || state.wanted.as_ref().is_some_and(|wanted| !wanted.same_scene(first))
    }

    /// The request to render on a new device: the present one once more, or the next one.
    fn retry(&self) -> Option<Wanted> {
        let mut state = self.lock();
        if state.closing || state.resting || state.wanted.is_some() || state.tries > 0 {
            drop(state);
            return self.next();
        }
        state.tries += 1;
        state.failed = None;
        state.begun = Some(Instant::now());
        self.stop.store(false, Ordering::Relaxed);
        state.now.clone()
    }

    /// From here on a request interrupts the work at once. False: there is one already.
    pub fn may_be_interrupted(&self) -> bool {
        let mut state = self.lock();
        state.fine = true;
        !state.closing && !state.resting && state.wanted.is_none()
    }

    /// Says what the thread does.
    pub fn does(&self, doing: Doing) {
        let changed = {
            let mut state = self.lock();
            std::mem::replace(&mut state.doing, doing.clone()) != doing
        };
        if changed {
            (self.waker.0)();
        }
    }

    /// Names device and driver.
    pub fn is_on(&self, device: String) {
        self.lock().device = device;
    }

    /// Gives a picture to the window, with a number that no other picture has.
    pub fn show(&self, shown: Shown) {
        let shown = Shown { number: NUMBERS.fetch_add(1, Ordering::Relaxed) + 1, ..shown };
        self.lock().shown = Some(Arc::new(shown));
        (self.waker.0)();
    }

    /// Reports the failure of a request, unless a newer one is the reason.
    pub fn fail(&self, error: Error) {
        let asked = self.stop.load(Ordering::Relaxed);
        if error.kind() == ErrorKind::Interrupted || (asked && error.kind() == ErrorKind::DeviceLost) {
            return;
        }
        self.lock().failed = Some(Arc::new(error));
        (self.waker.0)();
    }

    /// Renders requests until the window closes. A lost device is opened again for the next request.
    fn work(&self, options: &GpuOptions) {
        let mut next = self.next();
        while let Some(wanted) = next {
            self.does(Doing::Preparing("the device".into(), None));
            let gpu = match Gpu::new(options.clone()) {
                Ok(gpu) => gpu,
                Err(error) => {
                    self.fail(error);
                    next = self.next();
                    continue;
                }
            };
            self.is_on(gpu.describe().to_string());
            next = self.work_on(&gpu, wanted);
        }
    }

    /// Renders requests on a device until it is lost. Returns the request that is to be rendered on a new one.
    fn work_on(&self, gpu: &Gpu, first: Wanted) -> Option<Wanted> {
        let mut painter = Painter::new(gpu);
        let mut wanted = first;
        loop {
            let result = if wanted.file.is_some() {
                file::work(self, &mut painter, wanted)
            } else if wanted.is_truth() {
                truth::work(self, gpu, &mut painter, wanted)
            } else {
                still::work(self, gpu, &mut painter, wanted)
            };
            wanted = match result {
                Ok(next) => next?,
                Err(error) => {
                    self.fail(error);
                    // A device that was stopped within a long pass is lost, too.
                    if gpu.is_lost() {
                        return self.retry();
                    }
                    self.next()?
                }
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use clap::Parser;

    use super::*;
    use crate::{
        args::Size,
        stage::{Stage, StageArgs},
        view::{
            live,
            wanted::{Look, Shows, TRUTH},
        },
    };

    #[derive(Parser, Debug)]
    struct Line {
        #[command(flatten)]
        stage: StageArgs,
    }

    #[test]
    fn paths_are_kept_when_the_exposure_changes_and_when_the_side_rests() {
        let options = GpuOptions::from_env().unwrap();
        if let Err(error) = Gpu::new(options.clone()) {
            assert!(std::env::var_os("CI").is_none(), "no Vulkan device and CI is set: {error}");
            eprintln!("SKIPPED: this test needs a device: {error}");
            return;
        }
        let args = Line::try_parse_from(["x", "--builtin", "cornell"]).unwrap().stage;
        let stage = Arc::new(Stage::open(&args).unwrap());
        let wanted = Wanted {
            camera: stage.placed.clone(),
            stage,
            technique: TRUTH,
            file: None,
            mode: "total".into(),
            settings: Arc::new(live::about(TRUTH).unwrap().settings),
            bake: None,
            size: Size { width: 160, height: 120 },
            seconds: 0.0,
            moved: BTreeMap::new(),
            shows: Shows::Picture,
            pictures: 1,
            edges: false,
            samples: 1 << 20,
            moving: false,
            exposure: Some(0.0),
            look: Look::Light(None),
        };
        let session = Session::start("test", options, Wake(Arc::new(|| {}))).unwrap();
        // Waits for a picture with more paths than `before` and this exposure.
        let more = |before: f64, exposure: f64| {
            let begun = Instant::now();
            loop {
                let shown = session.shown().filter(|shown| shown.exposure == exposure);
                if let Some(shown) = shown.filter(|shown| shown.samples > before) {
                    return shown.samples;
                }
                assert!(begun.elapsed() < Duration::from_secs(120), "{:?}", session.status());
                std::thread::sleep(Duration::from_millis(5));
            }
        };
        session.ask(wanted.clone());
        let first = more(8.0, 0.0);
        // Later than the time after which other work is interrupted.
        std::thread::sleep(PATIENCE);
        session.ask(Wanted { exposure: Some(1.0), ..wanted.clone() });
        let second = more(0.0, 1.0);
        assert!(second > first, "{second} paths after {first}");
        session.rest();
        std::thread::sleep(Duration::from_millis(500));
        session.ask(Wanted { exposure: Some(2.0), ..wanted });
        let third = more(0.0, 2.0);
        assert!(third >= second, "{third} paths after {second}");
    }
}
