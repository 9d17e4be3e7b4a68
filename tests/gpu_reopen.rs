//! Devices that are opened again and again in one process. A program of its own: no other test has a device at the same time. Mesa's drivers stay in memory by
//! themselves; NVIDIA's does not.

use lucerna::gpu::testing::with_gpu;

/// Shared libraries of drivers that are in memory.
fn drivers() -> Vec<String> {
    let maps = std::fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let mut found: Vec<String> =
        maps.lines().filter_map(|line| line.split_once('/')).map(|(_, path)| path.into()).collect();
    found.retain(|path: &String| {
        let name = path.rsplit('/').next().unwrap_or_default();
        name.starts_with("libvulkan_") || name.starts_with("libGLX_")
    });
    found.sort();
    found.dedup();
    found
}

#[test]
fn drivers_stay_in_memory_between_devices() {
    let mut seen = Vec::new();
    let mut opened = 0;
    // NVIDIA's driver 580 cannot be loaded more than 25 times.
    for _ in 0..40 {
        with_gpu(|_| {
            opened += 1;
            seen = drivers();
        });
        if opened > 1 {
            assert_eq!(drivers(), seen, "after device {opened}");
        }
    }
    assert!(opened == 0 || opened == 40, "{opened} of 40 devices were opened");
}
