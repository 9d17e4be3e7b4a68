//! Every malformed, hostile and odd file of the asset collection, and scene files made here to do harm: the outcome that
//! `tests/malformed.tsv` says, without panic, in under five seconds, with under one GiB of memory at any time.
//!
//! A line of the table: folder, file, outcome (`ok` or the kind of the error), and part of the message, or of a note where the
//! file is read.

mod common;
#[path = "common/gltf.rs"]
#[allow(dead_code)]
mod gltf;
#[path = "common/hostile.rs"]
mod hostile;

use libtest_mimic::{Arguments, Failed, Trial};
use lucerna::{
    Error, image,
    scene::{Limits, LoadOptions, load, texture},
};
use std::{
    alloc::{GlobalAlloc, Layout, System},
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::atomic::{AtomicUsize, Ordering::Relaxed},
    sync::mpsc,
    time::Duration,
};

/// Time on the processor; the machine may be busy with other things.
const TIME: Duration = Duration::from_secs(5);
const HANG: Duration = Duration::from_secs(120);
const MEMORY: usize = 1 << 30;

/// The system's allocator, counting.
struct Counting;

static USED: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);
static PANICS: AtomicUsize = AtomicUsize::new(0);

impl Counting {
    fn more(size: usize) {
        let used = USED.fetch_add(size, Relaxed) + size;
        PEAK.fetch_max(used, Relaxed);
    }
}

// SAFETY: all requests go to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        Self::more(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        Self::more(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        USED.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // Both blocks may exist for a moment.
        Self::more(size);
        USED.fetch_sub(layout.size(), Relaxed);
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// What reading a file gave: `ok` with its notes, or the error.
struct Outcome {
    kind: String,
    text: String,
}

fn outcome(result: Result<String, Error>) -> Outcome {
    match result {
        Ok(text) => Outcome { kind: "ok".into(), text },
        Err(error) => Outcome { kind: format!("{:?}", error.kind()).to_lowercase(), text: error.to_string() },
    }
}

fn extension(path: &Path) -> String {
    path.extension().and_then(|extension| extension.to_str()).unwrap_or_default().to_lowercase()
}

fn is_scene(path: &Path) -> bool {
    ["gltf", "glb", "obj", "txt", "bin"].contains(&extension(path).as_str())
}

/// Reads a file by the way that its folder and extension call for.
fn read(path: &Path) -> Outcome {
    if is_scene(path) {
        return outcome(load(path, &LoadOptions::default()).map(|scene| {
            // Using it must be safe too.
            scene.validate().expect("a loaded scene is valid");
            scene.notes.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
        }));
    }
    if ["png", "jpg", "jpeg", "webp", "bmp", "tga"].contains(&extension(path).as_str()) {
        let bytes = std::fs::read(path).unwrap();
        let decoded = texture::decode(&bytes, None, &Limits::default());
        return outcome(decoded.map(|texture| format!("{}×{}", texture.width, texture.height)));
    }
    outcome(image::read(path, &Limits::default()).map(|image| format!("{}×{}", image.width, image.height)))
}

/// Reads a file that was made here.
fn check_made(case: hostile::Case) -> Result<(), Failed> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(case.file);
    std::fs::write(&path, &case.content).unwrap();
    drop(case.content);
    match case.expected {
        "ok" => check(path, Some(("ok".into(), String::new()))),
        part => check(path, Some(("input".into(), part.into()))),
    }
}

fn check(path: PathBuf, expected: Option<(String, String)>) -> Result<(), Failed> {
    let panics = PANICS.load(Relaxed);
    let before = USED.load(Relaxed);
    PEAK.store(before, Relaxed);
    let held = forget_peak();
    let (sender, receiver) = mpsc::channel();
    let file = path.clone();
    let reader = std::thread::spawn(move || {
        let outcome = read(&file);
        sender.send((outcome, processor_time()))
    });
    let (outcome, time) = match receiver.recv_timeout(HANG) {
        Ok(done) => done,
        Err(mpsc::RecvTimeoutError::Timeout) => return Err("hangs".into()),
        Err(mpsc::RecvTimeoutError::Disconnected) => return Err("panicked".into()),
    };
    // Its memory must be gone before the next file is read.
    let _ = reader.join();
    let process = status("VmHWM:").zip(held).map_or(0, |(peak, held)| peak.saturating_sub(held));
    let peak = PEAK.load(Relaxed).saturating_sub(before);
    if time.is_some_and(|time| time > TIME) {
        return Err(format!("took {time:?}").into());
    }
    if peak.max(process) > MEMORY {
        return Err(format!("took {} MiB, {} MiB of the process", peak >> 20, process >> 20).into());
    }
    if PANICS.load(Relaxed) != panics {
        return Err("a panic was caught inside".into());
    }
    let found = format!("{}\t{}", outcome.kind, outcome.text);
    match expected {
        None => Err(format!("is not in the table: {found}").into()),
        Some((kind, part)) if kind != outcome.kind || !outcome.text.contains(&part) => {
            Err(format!("expected {kind}\t{part}, found {found}").into())
        }
        Some((kind, _)) if is_scene(&path) && kind != "ok" && !outcome.text.starts_with(&*path.to_string_lossy()) => {
            Err(format!("the error does not begin with the file: {found}").into())
        }
        Some(_) => Ok(()),
    }
}

/// Time that the current thread was on the processor; Linux only.
fn processor_time() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split_whitespace().next()?.parse().ok().map(Duration::from_nanos)
}

fn table() -> BTreeMap<String, (String, String)> {
    let lines = include_str!("malformed.tsv").lines().filter(|line| !line.starts_with('#') && !line.is_empty());
    lines
        .map(|line| {
            let mut cells = line.splitn(4, '\t');
            let mut next = || cells.next().unwrap_or_default();
            let file = Path::new(next()).join(next()).to_string_lossy().into_owned();
            (file, (next().to_owned(), next().to_owned()))
        })
        .collect()
}

/// The files to read: all but what belongs to another one, and the expected reports beside the validator's cases.
fn inputs(assets: &Path) -> Vec<String> {
    let manifest: serde_json::Value =
        serde_json::from_slice(&std::fs::read(assets.join("manifest.json")).unwrap()).unwrap();
    let files = manifest["files"].as_array().unwrap().iter();
    files
        .filter(|entry| entry["role"] == "main")
        .filter_map(|entry| entry["file"].as_str()?.strip_prefix("malformed/"))
        .filter(|file| !file.ends_with(".report.json"))
        .map(str::to_owned)
        .collect()
}

fn main() {
    let mut arguments = Arguments::from_args();
    // Memory is counted for the process as a whole.
    arguments.test_threads = Some(1);
    let default = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        PANICS.fetch_add(1, Relaxed);
        default(info);
    }));
    let mut trials = vec![];
    for case in hostile::cases() {
        trials.push(Trial::test(format!("made/{}", case.name), move || check_made(case)));
    }
    if let Some(assets) = common::assets() {
        let mut table = table();
        for file in inputs(&assets) {
            let path = assets.join("malformed").join(&file);
            let expected = table.remove(&file);
            trials.push(Trial::test(file, move || check(path, expected)));
        }
        trials.push(Trial::test("every_line_of_the_table_has_a_file", move || match table.keys().next() {
            None => Ok(()),
            Some(file) => Err(format!("{file} is in the table only").into()),
        }));
    }
    libtest_mimic::run(&arguments, trials).exit();
}

/// Starts the system's peak of this process anew and gives the bytes that it holds now. Memory of foreign code is not
/// counted by the allocator, but by the system; what the system's allocator keeps from files before is not this file's.
/// Nothing where the system does not offer it.
fn forget_peak() -> Option<usize> {
    std::fs::write("/proc/self/clear_refs", "5").ok()?;
    status("VmRSS:")
}

/// A line of the process's status in bytes; Linux only.
fn status(name: &str) -> Option<usize> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.trim().strip_suffix(" kB")?.parse::<usize>().ok().map(|kib| kib << 10)
}
