//! Proof that the checks of `with_gpu` are alive: each deliberate mistake must be reported. If one stays silent, no other
//! device test proves anything. (A validation layer that is missing, or set up so that it overlooks shader accesses, would
//! otherwise let everything pass.)

use std::process::Command;

use ash::vk;
use gpu_common::successors;
use lucerna::gpu::{
    BufferDesc, DescriptorArena, Gpu, GpuOptions, OwnedBuffer, Validation,
    testing::{self, with_gpu},
};

mod gpu_common;

/// What `with_gpu` says about `body`; `None`: skipped, as there is no device or no layer (never with `CI` set).
fn complaint(body: impl FnOnce(&Gpu)) -> Option<String> {
    let mut ran = false;
    let options = GpuOptions { print_messages: false, ..GpuOptions::default() };
    let result = testing::run(options, |gpu| {
        ran = gpu.validation_active();
        body(gpu);
    });
    ran.then(|| result.err().unwrap_or_default())
}

#[track_caller]
fn must_say(expected: &str, body: impl FnOnce(&Gpu)) {
    match complaint(body) {
        Some(text) => assert!(text.contains(expected), "no `{expected}` in:\n{text}"),
        None => assert!(std::env::var_os("CI").is_none(), "skipped under CI"),
    }
}

#[test]
fn correct_use_is_silent() {
    with_gpu(|gpu| {
        let words = successors(gpu, &[3, 2], true).unwrap();
        assert!(words.chunks(4).all(|word| word == [5, 0, 0, 0]), "{words:?}");
    });
}

#[test]
fn a_wrong_call_is_reported() {
    must_say("VUID-", |gpu| {
        let buffer = OwnedBuffer::new(gpu, "words", BufferDesc::device(64)).unwrap();
        let commands = gpu.commands("wrong").unwrap();
        // SAFETY: not a valid call (an offset that is no multiple of four), which is the point; drivers round.
        unsafe { gpu.device().cmd_fill_buffer(commands.raw(), buffer.raw(), 2, 4, 0) };
    });
}

#[test]
fn a_missing_barrier_between_dispatches_is_reported() {
    must_say("SYNC-HAZARD", |gpu| {
        successors(gpu, &[2], false).unwrap();
    });
}

#[test]
fn a_missing_barrier_between_fill_and_copy_is_reported() {
    must_say("SYNC-HAZARD", |gpu| {
        let from = OwnedBuffer::new(gpu, "from", BufferDesc::device(64)).unwrap();
        let to = OwnedBuffer::new(gpu, "to", BufferDesc::device(64)).unwrap();
        let mut commands = gpu.commands("fill and copy").unwrap();
        // SAFETY: inside of both buffers, which are kept.
        unsafe {
            gpu.device().cmd_fill_buffer(commands.raw(), from.raw(), 0, 64, 1);
            let region = vk::BufferCopy::default().size(64);
            gpu.device().cmd_copy_buffer(commands.raw(), from.raw(), to.raw(), &[region]);
        }
        commands.keep((from, to));
        commands.submit().unwrap().wait().unwrap();
    });
}

#[test]
fn a_vulkan_object_left_behind_is_reported() {
    must_say("VUID-vkDestroyDevice-device-", |gpu| {
        // SAFETY: plain creation.
        unsafe { gpu.device().create_fence(&vk::FenceCreateInfo::default(), None) }.unwrap();
    });
}

#[test]
fn a_buffer_that_outlives_the_test_is_reported() {
    let mut leaked = None;
    must_say("outlive the test", |gpu| {
        leaked = Some(OwnedBuffer::new(gpu, "leaked", BufferDesc::device(64)).unwrap());
    });
    // Its end would destroy the device while the next test runs; the layer does not bear that (`testing`).
    std::mem::forget(leaked);
}

#[test]
fn a_forgotten_buffer_is_reported() {
    must_say("outlive the test", |gpu| {
        std::mem::forget(OwnedBuffer::new(gpu, "forgotten", BufferDesc::device(64)).unwrap());
    });
}

/// Layers before 1.3.270 check across submissions only if a variable asks for it, so this test starts itself anew with it.
#[test]
fn a_missing_barrier_between_submissions_is_reported() {
    const INSIDE: &str = "LUCERNA_TEST_INSIDE";
    if std::env::var_os(INSIDE).is_some() {
        must_say("SYNC-HAZARD", |gpu| {
            successors(gpu, &[1, 1], false).unwrap();
        });
        return;
    }
    let status = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "a_missing_barrier_between_submissions_is_reported", "--nocapture"])
        .env(INSIDE, "1")
        .env(
            "VK_LAYER_ENABLES",
            "VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT:\
             VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT",
        )
        .env("VK_VALIDATION_SYNCVAL_SHADER_ACCESSES_HEURISTIC", "1")
        .status()
        .unwrap();
    assert!(status.success());
}

#[test]
fn variables_that_silence_the_layer_are_refused() {
    if std::env::var_os("LUCERNA_TEST_SILENCED").is_some() {
        let error = testing::run(GpuOptions::default(), |_| {}).unwrap_err();
        assert!(error.contains("VK_LAYER_MESSAGE_ID_FILTER"), "{error}");
        return;
    }
    let status = Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "variables_that_silence_the_layer_are_refused"])
        .env("LUCERNA_TEST_SILENCED", "1")
        .env("VK_LAYER_MESSAGE_ID_FILTER", "VUID-x")
        .status()
        .unwrap();
    assert!(status.success());
}

#[test]
fn an_access_out_of_bounds_is_reported_by_gpu_assisted_validation() {
    let mut text = None;
    let options = GpuOptions { validation: Validation::GpuAssisted, print_messages: false, ..GpuOptions::default() };
    let result = testing::run(options, |gpu| {
        text = gpu.validation_active().then(String::new);
        // One word too few for 64 threads.
        let from = OwnedBuffer::with_contents(gpu, "from", &[0; 252]).unwrap();
        let to = OwnedBuffer::new(gpu, "to", BufferDesc::device(256)).unwrap();
        let pipeline = gpu.compute_pipeline(gpu_common::successor(), &[]).unwrap();
        let mut arena = DescriptorArena::new(gpu);
        let set = arena.allocate("test.successor", pipeline.set_layout).unwrap();
        let mut commands = gpu.commands("out of bounds").unwrap();
        gpu_common::dispatch(&mut commands, "test.successor", pipeline, set, [&from, &to], 1);
        commands.keep((from, to, arena));
        commands.submit().unwrap().wait().unwrap();
    });
    if text.is_some() {
        let text = result.unwrap_err();
        assert!(text.contains("VUID-vkCmdDispatch-"), "{text}");
    }
}
