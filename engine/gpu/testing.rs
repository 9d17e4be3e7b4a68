//! Tests on a device: [`with_gpu`] opens one with validation and fails on any message or leak.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::{Gpu, GpuOptions, RayQuery, Traversal, Validation};
use crate::ErrorKind;

/// One device test of a process runs at a time. The validation layer finds the device of each call in a table that has no lock (seen in
/// 1.3.239; Vulkan-ValidationLayers issue 4391): a call on one device crashes the process if another thread makes or destroys a device then.
fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    // A test that panicked has closed its device.
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Runs `body` on a device with validation and synchronisation validation, closes the device, and panics if validation,
/// loader or driver said anything that is not on the allow-list ([`super::ALLOWED`]), or if anything made from the device
/// is still alive. New memory is filled with NaN, so that a read of what was never written shows in the results.
///
/// Without a device or without the validation layer: panics if the variable `CI` is set, else skips loudly (no device) or
/// goes on without validation. `LUCERNA_DEVICE` chooses the device.
#[track_caller]
pub fn with_gpu(body: impl FnOnce(&Gpu)) {
    with_gpu_options(GpuOptions { poison: true, ..GpuOptions::default() }, body);
}

/// [`with_gpu`] with other options; validation is always on. The device comes from the environment.
#[track_caller]
pub fn with_gpu_options(options: GpuOptions, body: impl FnOnce(&Gpu)) {
    if let Err(text) = run(options, body) {
        panic!("{text}");
    }
}

/// [`with_gpu`] on a device with ray queries, CPU drivers too ([`RayQuery::On`]). Skips loudly where no device has them; also
/// under `CI`, for drivers that are older than ray queries are tested as well.
#[track_caller]
pub fn with_ray_query(body: impl FnOnce(&Gpu)) {
    let lacks = |d: &super::Listed| !d.missing.is_empty() || !d.facts.lacks_of_ray_query().is_empty();
    if super::list_devices().is_ok_and(|devices| devices.iter().all(lacks)) {
        eprintln!("SKIPPED: this test needs a Vulkan device with ray queries");
        return;
    }
    with_gpu_options(GpuOptions { poison: true, ray_query: RayQuery::On, ..GpuOptions::default() }, body);
}

/// As [`with_gpu_options`], but hands back what was wrong, so that the checks themselves can be tested.
#[doc(hidden)]
pub fn run(options: GpuOptions, body: impl FnOnce(&Gpu)) -> Result<(), String> {
    let _turn = turn();
    let ci = std::env::var_os("CI").is_some();
    for silencer in ["VK_LAYER_DISABLES", "VK_LAYER_MESSAGE_ID_FILTER"] {
        if std::env::var_os(silencer).is_some() {
            return Err(format!("{silencer} is set: it would hide validation messages"));
        }
    }
    let environment = GpuOptions::from_env().map_err(|e| e.to_string())?;
    let options = GpuOptions {
        device: environment.device,
        require_gpu: environment.require_gpu,
        ray_query: if options.ray_query == RayQuery::Auto { environment.ray_query } else { options.ray_query },
        traversal: if options.traversal == Traversal::Auto { environment.traversal } else { options.traversal },
        poison: options.poison || environment.poison,
        validation: if options.validation == Validation::GpuAssisted { options.validation } else { Validation::Sync },
        ..options
    };
    let gpu = match Gpu::new(options) {
        Ok(gpu) => gpu,
        Err(error) if error.kind() == ErrorKind::NoDevice && !ci => {
            eprintln!("SKIPPED: this test needs a Vulkan device: {error}");
            return Ok(());
        }
        Err(error) => return Err(error.to_string()),
    };
    if !gpu.validation_active() {
        if ci {
            return Err("the validation layer is not installed, and CI is set".into());
        }
        eprintln!("WARNING: this test runs without validation: VK_LAYER_KHRONOS_validation is not installed");
    }
    body(&gpu);
    let log = Arc::clone(gpu.log());
    let alive = Arc::downgrade(&gpu.0);
    drop(gpu);
    if alive.strong_count() > 0 {
        return Err(format!("{} things made from the device outlive the test", alive.strong_count()));
    }
    let unexpected = log.unexpected();
    if unexpected.is_empty() {
        return Ok(());
    }
    let lines: Vec<String> = unexpected.iter().take(20).map(ToString::to_string).collect();
    Err(format!("{} messages of Vulkan:\n{}", unexpected.len(), lines.join("\n")))
}
