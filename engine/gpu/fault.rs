//! Vulkan results as errors, and the latch that a lost device sets.

use std::sync::{
    OnceLock,
    atomic::{AtomicBool, Ordering},
};

use ash::vk;

use crate::{Error, ErrorKind};

/// Set once, by the first report of a lost device. Everything later only repeats that report.
#[derive(Debug, Default)]
pub(crate) struct Latch {
    lost: AtomicBool,
    report: OnceLock<String>,
}

impl Latch {
    pub fn is_set(&self) -> bool {
        self.lost.load(Ordering::Acquire)
    }

    /// Sets the latch; the first report wins. Returns the error to hand out.
    pub fn set(&self, report: String) -> Error {
        let first = self.report.set(report).is_ok();
        self.lost.store(true, Ordering::Release);
        if first { self.first() } else { self.error() }
    }

    fn first(&self) -> Error {
        Error::new(ErrorKind::DeviceLost, self.report.get().map_or("", String::as_str)).help(LOST_HELP)
    }

    /// The error of an operation that was not tried because the device is lost.
    pub fn error(&self) -> Error {
        let report = self.report.get().map_or("", String::as_str);
        Error::new(ErrorKind::DeviceLost, format!("the device was lost before: {report}")).help(LOST_HELP)
    }
}

const LOST_HELP: &str =
    "Lower the resolution or the sample counts, or choose another device; if it happens again, update the driver";

/// Bytes for people: `512 B`, `3.5 MiB`.
pub(crate) fn bytes(count: u64) -> String {
    const UNITS: [&str; 5] = ["B", "KiB", "MiB", "GiB", "TiB"];
    let mut value = count as f64;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    if unit == 0 || value >= 100.0 {
        format!("{value:.0} {}", UNITS[unit])
    } else {
        format!("{value:.1} {}", UNITS[unit])
    }
}

/// The error for `result` of a call that `operation` describes. A lost device goes through [`Latch::set`] instead.
pub(crate) fn failed(operation: &str, result: vk::Result) -> Error {
    match result {
        vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
            Error::new(ErrorKind::OutOfMemory, format!("host memory ran out in {operation}")).help(MEMORY_HELP)
        }
        vk::Result::ERROR_OUT_OF_DEVICE_MEMORY
        | vk::Result::ERROR_OUT_OF_POOL_MEMORY
        | vk::Result::ERROR_FRAGMENTED_POOL => {
            Error::new(ErrorKind::OutOfMemory, format!("device memory ran out in {operation}")).help(MEMORY_HELP)
        }
        other => Error::new(ErrorKind::Runtime, format!("{operation} failed: {}", describe(other))),
    }
}

pub(crate) const MEMORY_HELP: &str = "Use a smaller image, a smaller scene, or a device with more memory";

fn describe(result: vk::Result) -> String {
    match result {
        vk::Result::ERROR_UNKNOWN => "unknown error of the driver".into(),
        vk::Result::ERROR_FEATURE_NOT_PRESENT => "a feature is not present".into(),
        vk::Result::ERROR_FORMAT_NOT_SUPPORTED => "a format is not supported".into(),
        other => format!("{other:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_report_of_a_loss_wins() {
        let latch = Latch::default();
        assert!(!latch.is_set());
        let first = latch.set("in pass `isr.gather`".into());
        let second = latch.set("in pass `other`".into());
        assert!(latch.is_set());
        assert_eq!(first.exit_code(), 6);
        assert!(first.to_string().starts_with("in pass `isr.gather`"));
        assert!(second.to_string().contains("was lost before: in pass `isr.gather`"));
    }

    #[test]
    fn results_map_to_exit_codes() {
        assert_eq!(failed("vkX", vk::Result::ERROR_OUT_OF_HOST_MEMORY).exit_code(), 5);
        assert_eq!(failed("vkX", vk::Result::ERROR_OUT_OF_DEVICE_MEMORY).exit_code(), 5);
        assert_eq!(failed("vkX", vk::Result::ERROR_UNKNOWN).exit_code(), 1);
        assert!(failed("vkX", vk::Result::ERROR_UNKNOWN).to_string().contains("vkX"));
    }

    #[test]
    fn bytes_read_well() {
        assert_eq!(bytes(17), "17 B");
        assert_eq!(bytes(3 << 19), "1.5 MiB");
        assert_eq!(bytes(256 << 20), "256 MiB");
    }
}
