//! What goes wrong around a device becomes an error that says where and what to do: no panic, no hang, no leak.
//!
//! Each case starts this program anew as a child with the fault in its environment: a layer (`tests/fault-layer`) that fails
//! chosen calls or lies about devices, or a broken loader or driver. The child does small work and exits as the
//! executables do.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use gpu_common::fault::{self, Case, each, every_call, have_device, options};

use lucerna::{
    Error, ErrorKind, Result,
    gpu::{self, BufferDesc, DescriptorArena, Gpu, GpuOptions, OwnedBuffer, Tiles, Validation, testing},
    shader::Shader,
};

mod gpu_common;

/// Everything a child does, in one place: `main` of the child.
fn child(task: &str) -> Result<()> {
    let (task, argument) = task.split_once(':').unwrap_or((task, ""));
    match task {
        "work" => whole_program(),
        "long" => long_dispatch(),
        "tiled" => tiled_dispatch(),
        "capabilities" => capabilities(),
        "harness" => {
            testing::run(GpuOptions::default(), |_| {}).map_err(|text| Error::new(ErrorKind::Comparison, text))
        }
        "each" => {
            every_call(argument, work);
            Ok(())
        }
        other => Err(Error::usage(format!("no task {other}"))),
    }
}

/// A bit of everything, checked.
fn work(gpu: &Gpu) -> Result<()> {
    let words = gpu_common::successors(gpu, &[2, 1], true)?;
    assert!(words.chunks(4).all(|word| word == [3, 0, 0, 0]), "{words:?}");
    let rgba: Vec<u8> = (0..9 * 4 * 4).map(|i| i as u8).collect();
    assert_eq!(gpu_common::show(gpu, 9, 4, &rgba)?, rgba);
    frames(gpu)
}

/// Two frames of a graph: upload, uniform block, history, compute, raster with depth, levels, readback.
fn frames(gpu: &Gpu) -> Result<()> {
    use lucerna::{
        graph::*,
        shaders::{test::*, types::Bias},
    };
    let extent = Extent::new(8, 4);
    let mut runner = Runner::new(gpu);
    for frame in 1..3 {
        let mut graph = Graph::new("faulty frame");
        let (given, out) = (graph.buffer_from("given", &[frame; 64]), graph.buffer("out", 256));
        let bias = graph.uniform(&Bias { count: 64, bias: 1 });
        graph.compute(twice::Args { values: given, values_out: out, bias, spec: twice::Spec::default() }, 64);
        let (previous, next) = graph.history("history", Format::RGBA32F, extent);
        graph.compute(advance::Args { previous, next }, extent);
        let drawn = graph.image_with("drawn", ImageDesc::new(Format::RGBA32F, extent).mips(2));
        let depth = graph.image("depth", Format::D32F, extent);
        let targets = Targets::new().color(drawn.mip(0), Load::Discard).depth(depth, Depth::Clear(0.0));
        graph.raster(targets, Raster::new(), show::Args { image: next }, Draw::fullscreen_at(0.5));
        graph.mips(drawn);
        let (out, drawn) = (graph.read_buffer(out), graph.read_image(drawn.mip(1)));
        let result = runner.run(graph)?;
        assert_eq!(result.buffer::<u32>(out), [2 * frame + 1; 64]);
        assert!(result.image(drawn).to_f32().iter().all(|p| p[0] == frame as f32));
    }
    Ok(())
}

/// Opens, works, closes, and holds against it what validation said.
fn whole_program() -> Result<()> {
    let gpu = Gpu::new(options()?)?;
    let log = Arc::clone(gpu.log());
    let device = gpu.describe().to_string();
    let result = work(&gpu);
    drop(gpu);
    let said: Vec<String> = log.unexpected().iter().map(ToString::to_string).collect();
    assert!(said.is_empty(), "{said:#?}\nafter {result:?}");
    println!("worked on {device}");
    result
}

/// No loop longer than old CPU drivers run (65 535 turns), so that many threads are needed to take long.
fn slow() -> &'static Shader {
    gpu_common::compute(
        "test.slow",
        "#version 460
        layout(local_size_x = 64) in;
        layout(binding = 0) readonly buffer From { uint from[]; };
        layout(binding = 1) writeonly buffer To { uint to[]; };
        void main() {
            uint x = from[gl_LocalInvocationIndex] + gl_WorkGroupID.x;
            for (uint i = 0u; i < 60000u; ++i) { x = (x ^ (x >> 7)) * 747796405u + i; }
            if (x == 12345u) to[0] = x;
        }",
    )
}

/// Workgroups of work that takes many seconds on two cores, and some tenths of a second on a hundred.
const LONG: u32 = 60_000;
/// Workgroups of work that takes a second or some on two cores.
const TILED: u64 = 800;

/// The long work in tiles: no submission takes long, so no watchdog bites.
fn tiled_dispatch() -> Result<()> {
    let gpu = Gpu::new(GpuOptions { validation: Validation::Off, ..GpuOptions::from_env()? })?;
    let from = OwnedBuffer::with_contents(&gpu, "from", &[1; 256])?;
    let to = OwnedBuffer::new(&gpu, "to", BufferDesc::device(256))?;
    let pipeline = gpu.compute_pipeline(slow(), &[])?;
    let mut arena = DescriptorArena::new(&gpu);
    let mut tiles = Tiles::new(TILED, 1);
    let begun = Instant::now();
    let (mut count, mut longest) = (0, Duration::ZERO);
    while let Some(tile) = tiles.next_tile() {
        arena.reset()?;
        let set = arena.allocate("test.slow", pipeline.set_layout)?;
        let mut commands = gpu.commands("tile")?;
        gpu_common::dispatch(&mut commands, "test.slow", pipeline, set, [&from, &to], (tile.end - tile.start) as u32);
        let begun = Instant::now();
        commands.submit()?.wait()?;
        longest = longest.max(begun.elapsed());
        tiles.took(begun.elapsed());
        count += 1;
    }
    println!("{count} tiles in {:?}, longest {longest:?}", begun.elapsed());
    Ok(())
}

/// Work that takes seconds on a CPU driver, in a named pass.
fn long_dispatch() -> Result<()> {
    let gpu = Gpu::new(GpuOptions { validation: Validation::Off, ..GpuOptions::from_env()? })?;
    let slow = slow();
    let from = OwnedBuffer::with_contents(&gpu, "from", &[1; 256])?;
    let to = OwnedBuffer::new(&gpu, "to", BufferDesc::device(256))?;
    let pipeline = gpu.compute_pipeline(slow, &[])?;
    let quick = gpu.compute_pipeline(gpu_common::successor(), &[])?;
    let mut arena = DescriptorArena::new(&gpu);
    let mut commands = gpu.commands("frame 7")?;
    let set = arena.allocate("test.quick", quick.set_layout)?;
    gpu_common::dispatch(&mut commands, "test.quick", quick, set, [&from, &to], 1);
    commands.everything_barrier();
    let set = arena.allocate("test.slow", pipeline.set_layout)?;
    gpu_common::dispatch(&mut commands, "test.slow", pipeline, set, [&from, &to], LONG);
    commands.everything_barrier();
    let set = arena.allocate("test.quick", quick.set_layout)?;
    gpu_common::dispatch(&mut commands, "test.after", quick, set, [&from, &to], 1);
    commands.keep((from, to, arena));
    let first = commands.submit()?.wait();
    assert_eq!(gpu.is_lost(), first.is_err());
    if let Err(first) = &first {
        // Nothing more is tried, and what is said refers to the first report.
        let later = gpu.commands("frame 8").unwrap_err();
        assert_eq!(later.exit_code(), first.exit_code());
        assert!(later.to_string().contains("test.slow"), "{later}");
    }
    first
}

/// Prints what the device can do beyond the baseline.
fn capabilities() -> Result<()> {
    let gpu = Gpu::new(options()?)?;
    let caps = gpu.caps();
    println!("anisotropy {}", caps.sampler_anisotropy.is_some());
    println!("float atomics {}", caps.float_atomic_add);
    println!("depth clamp {}", caps.depth_clamp);
    println!("depth stencil {:?}", caps.depth_stencil_format);
    println!("alignment {}", caps.limits.storage_alignment);
    println!("push {}", caps.limits.push_bytes);
    work(&gpu)
}

/// Children come here; for others it does nothing.
#[test]
fn child_process() {
    fault::child_process(child);
}

// Row 1.
#[test]
fn without_a_loader_it_says_what_to_install() {
    let case = Case::new("work").file("libvulkan.so.1", "not a library").file("libvulkan.so", "not a library");
    let folder = case.folder.path().to_path_buf();
    let outcome = case.env("LD_LIBRARY_PATH", folder).run();
    outcome.fails_with(4, &["Vulkan loader could not be loaded", "libvulkan1", "LD_LIBRARY_PATH="]);
}

// Row 2.
#[test]
fn without_a_driver_it_says_what_to_install() {
    let case = Case::new("work");
    let missing = case.path("missing.json");
    let outcome = case.env("VK_DRIVER_FILES", &missing).env("VK_ICD_FILENAMES", &missing).run();
    outcome.fails_with(4, &["no Vulkan driver", "mesa-vulkan-drivers", "VK_DRIVER_FILES="]);
}

// Row 3.
#[test]
fn a_broken_driver_manifest_is_no_want_of_memory() {
    let case = Case::new("work").file("broken.json", "{ \"ICD\": ");
    let broken = case.path("broken.json");
    let outcome = case.env("VK_DRIVER_FILES", &broken).env("VK_ICD_FILENAMES", &broken).run();
    outcome.fails_with(4, &["no Vulkan driver", "mesa-vulkan-drivers", "broken.json"]);
}

// Row 4.
#[test]
fn a_driver_without_hardware_is_no_device() {
    if have_device() {
        let outcome = Case::new("work").layer(&[("VKFAULT", "vkEnumeratePhysicalDevices@1+=INIT_FAILED")]).run();
        outcome.fails_with(4, &["no Vulkan driver could list its devices", "mesa-vulkan-drivers"]);
        // Mesa's layer that sorts devices does not survive having none from another layer.
        let outcome = Case::new("work").env("NODEVICE_SELECT", "1").layer(&[("VKFAULT_NO_DEVICES", "1")]).run();
        outcome.fails_with(4, &["none of them has a device", "mesa-vulkan-drivers"]);
    }
}

// Row 5.
#[test]
fn an_unsuitable_device_is_refused_with_each_missing_item() {
    if have_device() {
        let outcome = Case::new("work")
            .layer(&[
                ("VKFAULT_HIDE_FEATURE", "synchronization2,scalarBlockLayout"),
                ("VKFAULT_LIMIT", "maxStorageBufferRange=1000"),
                // D32_SFLOAT
                ("VKFAULT_HIDE_FORMAT", "126"),
            ])
            .run();
        outcome.fails_with(
            4,
            &[
                "no suitable Vulkan device",
                "lacks feature synchronization2\n",
                "lacks feature scalarBlockLayout\n",
                "needs maxStorageBufferRange >= 134217728, has 1000\n",
                "lacks format D32_SFLOAT depth\n",
            ],
        );
        let outcome = Case::new("work").layer(&[("VKFAULT_API", "1.2")]).run();
        outcome.fails_with(4, &["offers Vulkan 1.2.0, needs 1.3.0"]);
        let outcome = Case::new("work").env("LUCERNA_DEVICE", "no such device").run();
        outcome.fails_with(4, &["has not `no such device` in its name"]);
    }
}

// Row 6.
#[test]
fn optional_abilities_may_be_missing() {
    if have_device() {
        let whole = Case::new("capabilities").run();
        whole.succeeds();
        let poor = Case::new("capabilities")
            .layer(&[
                ("VKFAULT_HIDE_EXT", "VK_EXT_shader_atomic_float"),
                ("VKFAULT_HIDE_FEATURE", "samplerAnisotropy,depthClamp"),
                // D32_SFLOAT_S8_UINT
                ("VKFAULT_HIDE_FORMAT", "130"),
                (
                    "VKFAULT_LIMIT",
                    "minStorageBufferOffsetAlignment=256,maxPushConstantsSize=128,nonCoherentAtomSize=256",
                ),
            ])
            .run();
        poor.succeeds();
        for line in ["anisotropy false", "float atomics false", "depth clamp false", "alignment 256", "push 128"] {
            assert!(poor.out.contains(line), "no `{line}` in {poor:#?}");
        }
        assert!(!poor.out.contains("D32_SFLOAT_S8"), "{poor:#?}");
    }
}

// Row 7.
#[test]
fn a_missing_validation_layer_warns_and_fails_in_ci() {
    if have_device() {
        let program = Case::new("work").env("VK_LAYER_PATH", "/nowhere").env_remove("VK_INSTANCE_LAYERS").run();
        program.succeeds();
        assert!(program.err.contains("VK_LAYER_KHRONOS_validation is not installed"), "{program:#?}");
        let ci = Case::new("harness").env("VK_LAYER_PATH", "/nowhere").env("CI", "1").run();
        ci.fails_with(7, &["the validation layer is not installed, and CI is set"]);
    }
}

// Row 7, the other half: no device under CI.
#[test]
fn no_device_fails_in_ci_and_is_skipped_loudly_elsewhere() {
    let case = |ci: bool| {
        let case = Case::new("harness");
        let missing = case.path("missing.json");
        let case = case.env("VK_DRIVER_FILES", &missing).env("VK_ICD_FILENAMES", &missing);
        if ci { case.env("CI", "1") } else { case.env_remove("CI") }.run()
    };
    case(true).fails_with(7, &["no Vulkan driver"]);
    let skipped = case(false);
    skipped.succeeds();
    assert!(skipped.err.contains("SKIPPED"), "{skipped:#?}");
}

// Row 8.
#[test]
fn device_memory_that_ran_out_is_an_error_with_sizes() {
    if have_device() {
        let outcome = Case::new("work").layer(&[("VKFAULT", "vkAllocateMemory@1=OOM_DEVICE")]).run();
        outcome.succeeds();
        let outcome = Case::new("work").layer(&[("VKFAULT", "vkAllocateMemory@1+=OOM_DEVICE")]).run();
        outcome.fails_with(5, &["no memory for `", "asked for", "in use on", "Use a smaller image"]);
        let outcome = Case::new("work").layer(&[("VKFAULT_HEAP_MB", "1")]).run();
        outcome.succeeds();
        let outcome = Case::new("work").layer(&[("VKFAULT_HEAP_MB", "0")]).run();
        outcome.fails_with(5, &["no memory for `"]);
    }
}

// Row 9.
#[test]
fn host_memory_that_ran_out_is_an_error() {
    if have_device() {
        let outcome = Case::new("work").layer(&[("VKFAULT", "vkAllocateMemory@1+=OOM_HOST")]).run();
        outcome.fails_with(5, &["no memory for `"]);
        let outcome = Case::new("work").layer(&[("VKFAULT", "vkCreateDevice=OOM_HOST")]).run();
        outcome.fails_with(5, &["host memory ran out in vkCreateDevice"]);
    }
}

// Row 10.
#[test]
fn a_pipeline_that_cannot_be_made_names_its_shader() {
    if have_device() {
        for (rule, parts) in [
            ("vkCreateComputePipelines=UNKNOWN", ["vkCreateComputePipelines for shader `test.successor`", ""]),
            ("vkCreateGraphicsPipelines=UNKNOWN", ["vkCreateGraphicsPipelines for shader `test.show`", ""]),
            ("vkCreateShaderModule@2=UNKNOWN", ["vkCreateShaderModule for the Vertex stage of shader `test.show`", ""]),
            ("vkAllocateDescriptorSets=UNKNOWN", ["vkAllocateDescriptorSets for `test.successor`", ""]),
            ("vkCreateImageView=UNKNOWN", ["vkCreateImageView of `picture`", ""]),
        ] {
            Case::new("work").layer(&[("VKFAULT", rule)]).run().fails_with(1, &parts);
        }
    }
}

// Row 11.
#[test]
fn a_device_lost_at_submit_or_wait_names_the_pass() {
    if have_device() {
        let outcome = Case::new("work").layer(&[("VKFAULT", "vkQueueSubmit2@5=DEVICE_LOST")]).run();
        outcome.fails_with(6, &["vkQueueSubmit2 of `successors`, pass", "`test.successor`"]);
        let outcome = Case::new("work").layer(&[("VKFAULT", "vkWaitForFences@5=DEVICE_LOST")]).run();
        outcome.fails_with(6, &["vkWaitForFences for `successors`, ", "pass `test.successor`"]);
    }
}

// Row 11, as a driver reports it: Mesa gives the device up when a wait takes longer.
#[test]
fn a_device_that_the_driver_gives_up_names_the_pass() {
    if have_device() {
        let outcome = Case::new("long").env("MESA_VK_MAX_TIMEOUT", "1000").run();
        if outcome.code != Some(0) || is_mesa() {
            outcome
                .fails_with(6, &["device was lost in vkWaitForFences for `frame 7`", "in pass `test.slow` (2 of 3)"]);
        }
    }
}

// Row 13: the same work in tiles passes under the same watchdog.
#[test]
fn long_work_in_tiles_is_not_given_up() {
    if have_device() {
        let outcome = Case::new("tiled").env("MESA_VK_MAX_TIMEOUT", "1000").run();
        outcome.succeeds();
        println!("{}", outcome.out);
    }
}

// Row 12.
#[test]
fn a_wait_that_never_ends_is_given_up_and_names_the_pass() {
    if have_device() {
        let outcome =
            Case::new("work").layer(&[("VKFAULT", "vkWaitForFences@5+=TIMEOUT")]).env("LUCERNA_WAIT_LIMIT", "2").run();
        outcome.fails_with(6, &["the device did not finish `successors` within ", "pass `test.successor`"]);
        // Once is no fault.
        Case::new("work").layer(&[("VKFAULT", "vkWaitForFences@5=TIMEOUT")]).run().succeeds();
    }
}

// Row 12 without a layer: the device really works longer than the limit.
#[test]
fn a_pass_longer_than_the_limit_is_given_up_by_name() {
    if have_device() && is_cpu() {
        let outcome = Case::new("long").env("LUCERNA_WAIT_LIMIT", "1").run();
        outcome.fails_with(6, &["the device did not finish `frame 7` within ", " s, in pass `test.slow` (2 of 3)"]);
    }
}

fn is_mesa() -> bool {
    gpu::list_devices().is_ok_and(|list| list.iter().all(|d| d.description.driver.contains("llvmpipe")))
}

fn is_cpu() -> bool {
    gpu::list_devices().is_ok_and(|list| list.iter().all(|d| d.description.kind == gpu::DeviceKind::Cpu))
}

// The n-th failure loop (rows 8 to 11): every call of each function fails once, and from then on.
#[test]
fn every_allocation_may_fail() {
    each(&["vkAllocateMemory OOM_DEVICE", "vkAllocateMemory OOM_HOST", "vkMapMemory OOM_HOST"]);
}

#[test]
fn every_creation_of_a_resource_may_fail() {
    each(&[
        "vkCreateBuffer OOM_DEVICE",
        "vkBindBufferMemory OOM_DEVICE",
        "vkCreateImage OOM_HOST",
        "vkBindImageMemory OOM_DEVICE",
        "vkCreateImageView OOM_HOST",
        "vkCreateSampler OOM_DEVICE",
        "vkCreateQueryPool OOM_HOST",
    ]);
}

#[test]
fn every_creation_for_pipelines_may_fail() {
    each(&[
        "vkCreateShaderModule OOM_HOST",
        "vkCreateDescriptorSetLayout OOM_HOST",
        "vkCreatePipelineLayout OOM_HOST",
        "vkCreatePipelineCache OOM_HOST",
        "vkCreateComputePipelines OOM_DEVICE",
        "vkCreateGraphicsPipelines OOM_DEVICE",
        "vkCreateDescriptorPool OOM_HOST",
        "vkAllocateDescriptorSets UNKNOWN",
    ]);
}

#[test]
fn every_step_of_a_submission_may_fail() {
    each(&[
        "vkCreateCommandPool OOM_HOST",
        "vkAllocateCommandBuffers OOM_HOST",
        "vkBeginCommandBuffer OOM_HOST",
        "vkEndCommandBuffer OOM_DEVICE",
        "vkCreateFence OOM_HOST",
        "vkQueueSubmit2 OOM_HOST",
    ]);
}

#[test]
fn the_device_may_be_lost_at_every_submit_and_wait() {
    each(&["vkQueueSubmit2 DEVICE_LOST", "vkWaitForFences DEVICE_LOST", "vkGetQueryPoolResults DEVICE_LOST"]);
}
