//! Proof that the checks of `with_gpu` are alive: each deliberate mistake must be reported. If one stays silent, no other
//! device test proves anything. (A validation layer that is missing, or set up so that it overlooks shader accesses, would
//! otherwise let everything pass.)

use std::process::Command;

use ash::vk;
use lucerna::{
    gpu::{
        BufferDesc, DescriptorArena, Gpu, GpuOptions, OwnedBuffer,
        testing::{self, with_gpu},
    },
    shader::{Access, Binding, BindingKind, Shader, Stage, StageCode},
};

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

/// A compute shader that writes each of 64 words plus one to another buffer.
fn successor() -> &'static Shader {
    let source = "#version 460
        layout(local_size_x = 64) in;
        layout(binding = 0) readonly buffer From { uint from[]; };
        layout(binding = 1) writeonly buffer To { uint to[]; };
        void main() { to[gl_GlobalInvocationID.x] = from[gl_GlobalInvocationID.x] + 1u; }";
    let compiler = shaderc::Compiler::new().unwrap();
    let mut options = shaderc::CompileOptions::new().unwrap();
    options.set_target_env(shaderc::TargetEnv::Vulkan, shaderc::EnvVersion::Vulkan1_3 as u32);
    let code = compiler
        .compile_into_spirv(source, shaderc::ShaderKind::Compute, "successor.comp", "main", Some(&options))
        .unwrap();
    let spirv: &'static [u8] = code.as_binary_u8().to_vec().leak();
    let binding = |name, binding, access| Binding {
        name,
        binding,
        kind: BindingKind::Buffer,
        access,
        stages: &[Stage::Compute],
        count: 1,
    };
    Box::leak(Box::new(Shader {
        name: "test.successor",
        stages: Box::leak(Box::new([StageCode { stage: Stage::Compute, spirv }])),
        bindings: Box::leak(Box::new([binding("from", 0, Access::Read), binding("to", 1, Access::Write)])),
        push_size: 0,
        workgroup: [64, 1, 1],
        spec: &[],
        color_outputs: 0,
    }))
}

/// A chain of buffers, each the successor of the one before, beginning with zeros: as many steps in each submission as
/// `submissions` says, with or without barriers in between. Returns the last buffer.
fn successors(gpu: &Gpu, submissions: &[u32], barriers: bool) -> Vec<u8> {
    let steps: u32 = submissions.iter().sum();
    let buffers: Vec<OwnedBuffer> =
        (0..=steps).map(|i| OwnedBuffer::with_contents(gpu, &format!("words {i}"), &[0; 256]).unwrap()).collect();
    let pipeline = gpu.compute_pipeline(successor(), &[]).unwrap();
    let mut arena = DescriptorArena::new(gpu);
    let mut pairs = buffers.windows(2);
    let mut running = Vec::new();
    for count in submissions {
        let mut commands = gpu.commands("successors").unwrap();
        for pair in pairs.by_ref().take(*count as usize) {
            let set = arena.allocate("test.successor", pipeline.set_layout).unwrap();
            let infos: Vec<_> = pair
                .iter()
                .map(|buffer| [vk::DescriptorBufferInfo::default().buffer(buffer.raw()).range(vk::WHOLE_SIZE)])
                .collect();
            let writes: Vec<_> = infos
                .iter()
                .enumerate()
                .map(|(i, info)| {
                    vk::WriteDescriptorSet::default()
                        .dst_set(set)
                        .dst_binding(i as u32)
                        .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                        .buffer_info(info)
                })
                .collect();
            commands.begin_pass("test.successor");
            // SAFETY: in recording; everything bound lives until the submissions are waited for below.
            unsafe {
                let device = gpu.device();
                let raw = commands.raw();
                device.update_descriptor_sets(&writes, &[]);
                device.cmd_bind_pipeline(raw, pipeline.bind_point, pipeline.raw);
                device.cmd_bind_descriptor_sets(raw, pipeline.bind_point, pipeline.layout, 0, &[set], &[]);
                device.cmd_dispatch(raw, 1, 1, 1);
            }
            commands.end_pass();
            if barriers {
                commands.everything_barrier();
            }
        }
        running.push(commands.submit().unwrap());
    }
    for submission in running {
        submission.wait().unwrap();
    }
    buffers[steps as usize].read().unwrap()
}

#[test]
fn correct_use_is_silent() {
    with_gpu(|gpu| {
        let words = successors(gpu, &[3, 2], true);
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
        successors(gpu, &[2], false);
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
            successors(gpu, &[1, 1], false);
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
