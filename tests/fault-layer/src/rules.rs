//! When a call fails.

use std::{
    collections::HashMap,
    io::Write,
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
};

use ash::vk;

static COUNTS: Mutex<Option<HashMap<String, u64>>> = Mutex::new(None);
static SIZES: Mutex<Option<HashMap<u64, u64>>> = Mutex::new(None);
static HEAP: AtomicU64 = AtomicU64::new(0);
static LOST: AtomicBool = AtomicBool::new(false);

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A new instance: counts begin anew.
pub fn begin() {
    *lock(&COUNTS) = None;
}

/// A new device is not lost.
pub fn revive() {
    LOST.store(false, Ordering::SeqCst);
}

/// The result that this call of `name` must fail with; `may_lose`: it fails once the device is lost.
pub fn failure(name: &str, may_lose: bool) -> Option<vk::Result> {
    if may_lose && LOST.load(Ordering::SeqCst) {
        return Some(vk::Result::ERROR_DEVICE_LOST);
    }
    let mut counts = lock(&COUNTS);
    let count = counts.get_or_insert_default().entry(name.to_owned()).or_insert(0);
    *count += 1;
    let count = *count;
    drop(counts);
    let rules = std::env::var("VKFAULT").unwrap_or_default();
    let result = rules.split(',').find_map(|rule| matching(rule, name, count))?;
    if result == vk::Result::ERROR_DEVICE_LOST {
        LOST.store(true, Ordering::SeqCst);
    }
    report(&format!("{name} call {count}: {result:?}"));
    Some(result)
}

fn matching(rule: &str, name: &str, count: u64) -> Option<vk::Result> {
    let (call, result) = rule.split_once('=')?;
    let (function, at) = call.split_once('@').unwrap_or((call, "1"));
    let (at, sticky) = at.strip_suffix('+').map_or((at, false), |at| (at, true));
    let at: u64 = at.parse().ok()?;
    (function == name && (count == at || sticky && count > at)).then(|| result_of(result))
}

fn result_of(name: &str) -> vk::Result {
    match name {
        "OOM_DEVICE" => vk::Result::ERROR_OUT_OF_DEVICE_MEMORY,
        "OOM_HOST" => vk::Result::ERROR_OUT_OF_HOST_MEMORY,
        "DEVICE_LOST" => vk::Result::ERROR_DEVICE_LOST,
        "TIMEOUT" => vk::Result::TIMEOUT,
        "INIT_FAILED" => vk::Result::ERROR_INITIALIZATION_FAILED,
        "OUT_OF_DATE" => vk::Result::ERROR_OUT_OF_DATE_KHR,
        "SUBOPTIMAL" => vk::Result::SUBOPTIMAL_KHR,
        "SURFACE_LOST" => vk::Result::ERROR_SURFACE_LOST_KHR,
        "FEATURE" => vk::Result::ERROR_FEATURE_NOT_PRESENT,
        _ => vk::Result::ERROR_UNKNOWN,
    }
}

fn report(line: &str) {
    if let Some(path) = std::env::var_os("VKFAULT_REPORT")
        && let Ok(mut file) = std::fs::File::options().create(true).append(true).open(path)
    {
        let _ = writeln!(file, "{line}");
    }
}

/// Whether `size` more bytes fit into the budget.
pub fn fits(size: u64) -> bool {
    let Some(budget) = std::env::var("VKFAULT_HEAP_MB").ok().and_then(|mb| mb.parse::<u64>().ok()) else { return true };
    let fits = HEAP.load(Ordering::SeqCst) + size <= budget << 20;
    if !fits {
        report(&format!("heap budget of {budget} MiB exceeded by {size} bytes"));
    }
    fits
}

pub fn allocated(memory: u64, size: u64) {
    HEAP.fetch_add(size, Ordering::SeqCst);
    lock(&SIZES).get_or_insert_default().insert(memory, size);
}

pub fn freed(memory: u64) {
    if let Some(size) = lock(&SIZES).get_or_insert_default().remove(&memory) {
        HEAP.fetch_sub(size, Ordering::SeqCst);
    }
}
