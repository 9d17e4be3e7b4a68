//! Images, buffers, submissions and timestamps on a device with validation.

use crate::gpu_common;
use ash::vk;
use lucerna::gpu::{self, BufferDesc, ImageDesc, OwnedBuffer, OwnedImage, Region, Timestamps, testing::with_gpu};

#[test]
fn buffers_keep_their_contents() {
    with_gpu(|gpu| {
        for size in [0_usize, 1, 4, 1023, 1 << 20] {
            let bytes: Vec<u8> = (0..size).map(|i| (i * 7 + i / 251) as u8).collect();
            let buffer = OwnedBuffer::with_contents(gpu, "numbers", &bytes).unwrap();
            assert_eq!(buffer.size(), size as u64);
            assert_eq!(buffer.read().unwrap(), bytes);
        }
    });
}

#[test]
fn images_keep_every_level_and_layer() {
    with_gpu(|gpu| {
        let desc = ImageDesc::new(vk::Format::R8G8B8A8_UNORM, 37, 19).mips(6).layers(3);
        let contents: Vec<(u32, u32, Vec<u8>)> = (0..6)
            .flat_map(|mip| (0..3).map(move |layer| (mip, layer)))
            .map(|(mip, layer)| {
                let size = desc.level_bytes(mip).unwrap();
                (mip, layer, (0..size).map(|i| (i * 13 + u64::from(mip * 3 + layer) * 31) as u8).collect())
            })
            .collect();
        let regions: Vec<Region<'_>> =
            contents.iter().map(|(mip, layer, bytes)| Region { mip: *mip, layer: *layer, bytes }).collect();
        let image = OwnedImage::with_contents(gpu, "levels", desc, &regions).unwrap();
        for (mip, layer, bytes) in &contents {
            assert_eq!(&image.read(*mip, *layer).unwrap(), bytes, "mip {mip} layer {layer}");
        }
    });
}

#[test]
fn images_of_other_formats_and_shapes_keep_their_contents() {
    with_gpu(|gpu| {
        let descs = [
            ImageDesc::new(vk::Format::R32G32B32A32_SFLOAT, 5, 3),
            ImageDesc::new(vk::Format::R16G16B16A16_SFLOAT, 5, 3).depth(4),
            ImageDesc::new(vk::Format::R8_UNORM, 8, 8).cubes(1),
            ImageDesc::new(vk::Format::D32_SFLOAT, 9, 5),
            ImageDesc::new(vk::Format::BC7_UNORM_BLOCK, 9, 5),
        ];
        for desc in descs {
            if !gpu.format_features(desc.format).contains(vk::FormatFeatureFlags::SAMPLED_IMAGE) {
                continue;
            }
            let size = desc.level_bytes(0).unwrap();
            // 0x3c: all formats read it as finite numbers, so that nothing is normalised on the way.
            let bytes: Vec<u8> = (0..size).map(|i| if i % 4 == 3 { 0x3c } else { (i % 61) as u8 }).collect();
            let last = desc.layers - 1;
            let region = Region { mip: 0, layer: last, bytes: &bytes };
            let image = OwnedImage::with_contents(gpu, "shape", desc, &[region]).unwrap();
            assert_eq!(image.read(0, last).unwrap(), bytes, "{desc:?}");
            image.view(image.whole()).unwrap();
        }
    });
}

#[test]
fn what_is_outside_of_an_image_or_buffer_is_refused() {
    with_gpu(|gpu| {
        let upload = OwnedBuffer::new(gpu, "small", BufferDesc::upload(8)).unwrap();
        assert!(upload.write(4, &[0; 5]).unwrap_err().to_string().contains("`small`"));
        assert!(upload.write(u64::MAX, &[0; 5]).is_err());
        assert!(upload.mapped_bytes(0, 4).is_err(), "not for reading");
        let desc = ImageDesc::new(vk::Format::R8_UNORM, 4, 4);
        let image = OwnedImage::new(gpu, "tiny", desc).unwrap();
        assert!(image.read(0, 0).unwrap_err().to_string().contains("never written"));
        assert!(image.upload(&[Region { mip: 0, layer: 0, bytes: &[0; 15] }]).is_err());
        assert!(image.upload(&[Region { mip: 1, layer: 0, bytes: &[0; 4] }]).is_err());
        assert!(image.view(gpu::ViewDesc { layers: 2, ..image.whole() }).is_err());
        for bad in [
            ImageDesc::new(vk::Format::R8_UNORM, 0, 4),
            ImageDesc::new(vk::Format::R8_UNORM, 4, 4).mips(4),
            ImageDesc::new(vk::Format::R8_UNORM, 1 << 20, 4),
            ImageDesc::new(vk::Format::R8_UNORM, 4, 5).cubes(1),
            ImageDesc::new(vk::Format::R8_UNORM, 4, 4).layers(1 << 20),
        ] {
            let error = OwnedImage::new(gpu, "impossible", bad).unwrap_err();
            assert!(error.to_string().contains("`impossible`"), "{error}");
        }
    });
}

#[test]
fn submissions_run_in_order_and_timestamps_grow() {
    with_gpu(|gpu| {
        let buffer = OwnedBuffer::new(gpu, "words", BufferDesc::device(64)).unwrap();
        let stamps = Timestamps::new(gpu, 4).unwrap();
        let mut commands = gpu.commands("frame 0").unwrap();
        stamps.reset(&mut commands);
        stamps.write(&mut commands, 0, vk::PipelineStageFlags2::TOP_OF_PIPE);
        commands.begin_pass("fill");
        // SAFETY: the buffer is kept until the commands are done.
        unsafe { gpu.device().cmd_fill_buffer(commands.raw(), buffer.raw(), 0, 64, 0x0102_0304) };
        commands.end_pass();
        commands.everything_barrier();
        commands.begin_pass("fill again");
        // SAFETY: as above.
        unsafe { gpu.device().cmd_fill_buffer(commands.raw(), buffer.raw(), 4, 4, 7) };
        commands.end_pass();
        stamps.write(&mut commands, 1, vk::PipelineStageFlags2::BOTTOM_OF_PIPE);
        commands.keep(buffer.clone());
        commands.submit().unwrap().wait().unwrap();
        let bytes = buffer.read().unwrap();
        let words: Vec<u32> = bytes.chunks(4).map(|b| u32::from_le_bytes(b.try_into().unwrap())).collect();
        assert_eq!(words[..3], [0x0102_0304, 7, 0x0102_0304]);
        let times = stamps.read().unwrap();
        assert_eq!(times.len(), 4);
        assert_eq!(times[2..], [None, None]);
        if gpu.caps().timestamp_period.is_some() {
            assert_eq!(times[0], Some(0.0));
            assert!(times[1].unwrap() > 0.0 && times[1].unwrap() < 60_000.0, "{times:?}");
        }
    });
}

#[test]
fn samplers_are_shared() {
    with_gpu(|gpu| {
        use lucerna::gpu::SamplerDesc;
        let first = gpu.sampler(SamplerDesc::LINEAR).unwrap();
        assert_eq!(first, gpu.sampler(SamplerDesc::LINEAR).unwrap());
        let others = [
            SamplerDesc::NEAREST,
            SamplerDesc::REPEAT,
            SamplerDesc::NEAREST_REPEAT,
            SamplerDesc::TRILINEAR,
            SamplerDesc::SHADOW,
        ];
        for other in others {
            assert_ne!(first, gpu.sampler(other).unwrap());
        }
    });
}

#[test]
fn a_drawn_image_is_the_same_image() {
    with_gpu(|gpu| {
        let rgba: Vec<u8> = (0..7 * 5 * 4).map(|i| (i * 7 % 256) as u8).collect();
        assert_eq!(gpu_common::show(gpu, 7, 5, &rgba).unwrap(), rgba);
    });
}

#[test]
fn a_shader_of_the_wrong_sort_is_refused() {
    with_gpu(|gpu| {
        let error = gpu.compute_pipeline(&lucerna::shaders::test::show::SHADER, &[]).unwrap_err();
        assert!(error.to_string().starts_with("shader `test.show` is no compute shader"), "{error}");
        let error = gpu.compute_pipeline(gpu_common::successor(), &[1]).unwrap_err();
        assert!(
            error.to_string().contains("1 specialisation constants were given to shader `test.successor`, it has 0"),
            "{error}"
        );
    });
}

#[test]
fn poisoned_memory_shows() {
    use lucerna::gpu::{GpuOptions, testing::with_gpu_options};
    with_gpu_options(GpuOptions { poison: true, ..GpuOptions::default() }, |gpu| {
        let words = OwnedBuffer::new(gpu, "never written", BufferDesc::device(10)).unwrap().read().unwrap();
        assert_eq!(words, [0xAD, 0xDE, 0xC0, 0x7F, 0xAD, 0xDE, 0xC0, 0x7F, 0xAD, 0xDE]);
        for format in [
            vk::Format::R32G32B32A32_SFLOAT,
            vk::Format::R16G16_SFLOAT,
            vk::Format::B10G11R11_UFLOAT_PACK32,
            vk::Format::R32_UINT,
            vk::Format::R8G8B8A8_UNORM,
            vk::Format::D32_SFLOAT,
            vk::Format::BC7_UNORM_BLOCK,
        ] {
            if gpu.format_features(format).contains(vk::FormatFeatureFlags::SAMPLED_IMAGE) {
                let image =
                    OwnedImage::new(gpu, "never written", ImageDesc::new(format, 4, 4).layers(2).mips(2)).unwrap();
                if format == vk::Format::BC7_UNORM_BLOCK {
                    // Cannot be filled, and must not be tried.
                    continue;
                }
                // What a pass that forgets to write would leave.
                image.set_layout(vk::ImageLayout::TRANSFER_DST_OPTIMAL);
                let bytes = image.read(1, 1);
                if format == vk::Format::R32G32B32A32_SFLOAT {
                    let bytes = bytes.unwrap();
                    assert!(bytes.chunks(4).all(|b| f32::from_le_bytes(b.try_into().unwrap()).is_nan()), "{bytes:?}");
                }
            }
        }
    });
}

#[test]
fn eight_threads_may_use_one_device() {
    fn shared<T: Send + Sync>() {}
    shared::<gpu::Gpu>();
    shared::<OwnedBuffer>();
    shared::<OwnedImage>();
    with_gpu(|gpu| {
        std::thread::scope(|scope| {
            for thread in 0..8_u8 {
                scope.spawn(move || {
                    for round in 0..64_u8 {
                        let bytes = vec![thread * 32 + round % 32; 777];
                        let buffer = OwnedBuffer::with_contents(gpu, "mine", &bytes).unwrap();
                        let desc = ImageDesc::new(vk::Format::R8_UNORM, 21, 37);
                        let region = Region { mip: 0, layer: 0, bytes: &bytes };
                        let image = OwnedImage::with_contents(gpu, "mine", desc, &[region]).unwrap();
                        image.view(image.whole()).unwrap();
                        gpu.sampler(gpu::SamplerDesc::TRILINEAR).unwrap();
                        assert_eq!(buffer.read().unwrap(), bytes);
                        assert_eq!(image.read(0, 0).unwrap(), bytes);
                    }
                });
            }
        });
    });
}

#[test]
fn the_loop_limit_of_old_cpu_drivers_is_found() {
    with_gpu(|gpu| {
        let limit = gpu.loop_limit().unwrap();
        assert_eq!(limit, gpu.loop_limit().unwrap());
        let driver = gpu.describe();
        if driver.driver_info.contains("Mesa 22.") {
            let limit = limit.expect("Mesa 22 stops loops early");
            assert!((60_000..=65_536).contains(&limit), "{limit}");
        } else if driver.driver_info.contains("Mesa 25.") {
            assert_eq!(limit, None);
        }
        println!("loop limit {limit:?} on {driver}");
    });
}
