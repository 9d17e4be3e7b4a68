//! Pictures of baked daylight: against the same sums on the CPU, frames against images, streamed against resident.

use std::path::Path;

use crate::{
    daylight_lab::{SKY_IMAGES, Studio, day, polar_day, stored},
    tracer_lab::{Stage, view},
};
use glam::{Vec3, vec3};
use lucerna::{
    bake::Digest,
    gpu::{Gpu, testing::with_gpu},
    scene::{Material, Scene, View},
    technique::{Bake, Settings as _},
    techniques::daylight::{
        Baked, Frames, Interpolation, PictureSettings, Settings, Sky, SkyLight, Stored, Weather, frames,
        steps::{Mixture, Steps},
    },
};

/// A floor that fills the picture.
fn scene() -> Scene {
    let mut stage = Stage::new();
    let white = stage.material(Material::diffuse("white", Vec3::splat(0.8)));
    stage.quad(white, vec3(-50.0, 0.0, -50.0), Vec3::Z * 100.0, Vec3::X * 100.0);
    stage.scene
}

fn eye() -> View {
    view(vec3(0.0, 5.0, 2.0), Vec3::ZERO, 40.0, [40, 24])
}

fn settings(time: &str, interpolation: Interpolation) -> PictureSettings {
    let daylight = Settings { time: time.into(), interpolation, ..Settings::default() };
    PictureSettings { daylight, ..PictureSettings::default() }
}

fn studio(gpu: &Gpu, baked: &Baked) -> Studio {
    Studio::new(gpu, scene(), eye(), baked)
}

/// Twin of `decode.comp`.
fn by_cpu(stored: &Stored, settings: &Settings, seconds: f64) -> Vec<[f32; 3]> {
    let plan = &stored.plan;
    let day = day(&plan.calendar);
    let sun = day.sun(seconds).direction(plan.calendar.north);
    let sky = Sky::new(Weather::default(), sun.map(f64::from)).unwrap();
    let (light, patches) = (sky.sun_irradiance(), sky.patches());
    let mixture = Steps::new(plan, 0, &plan.calendar.courses().unwrap()[0]).mixture(seconds, settings.interpolation);
    let mut out = vec![[0.0; 3]; (plan.extent[0] * plan.extent[1]) as usize];
    for (index, tile) in stored.tiles.iter().enumerate() {
        let [column, row, columns, _] = plan.tile(index as u32);
        let of_sky = tile.sky.mix(patches.iter().copied().enumerate());
        for texel in 0..tile.there() as usize {
            let at = |time: usize| tile.sun.decode(texel, &tile.sun.mix([(time, light)].into_iter()));
            let sun = match &mixture {
                Mixture::Sum(weights) => weights.iter().fold([0.0; 3], |sum: [f32; 3], of| {
                    let value = at(of.time);
                    std::array::from_fn(|c| sum[c] + of.weight * value[c])
                }),
                Mixture::Logarithms { times, alpha } => {
                    let [first, second] = times.map(at);
                    std::array::from_fn(|c| {
                        let least = (1e-4 * light[c]).max(1e-30);
                        let [a, b] = [first[c], second[c]].map(|value| (value.max(0.0) + least).ln());
                        (a + alpha * (b - a)).exp() - least
                    })
                }
            };
            let sky = tile.sky.decode(texel, &of_sky);
            let pixel = (row + texel as u32 / columns) * plan.extent[0] + column + texel as u32 % columns;
            out[pixel as usize] = std::array::from_fn(|c| (sun[c] + sky[c]).max(0.0));
        }
    }
    out
}

#[track_caller]
fn expect_close(found: &[[f32; 3]], wanted: &[[f32; 3]], slack: f32, what: &str) {
    assert_eq!(found.len(), wanted.len());
    let largest = wanted.iter().flatten().fold(0.0f32, |most, value| most.max(*value));
    assert!(largest > 0.1, "{what} is dark");
    for (pixel, (a, b)) in found.iter().zip(wanted).enumerate() {
        for c in 0..3 {
            assert!((a[c] - b[c]).abs() <= slack * (b[c] + 0.01 * largest), "{what}: pixel {pixel}: {a:?}, not {b:?}");
        }
    }
}

const ALL: [Interpolation; 4] =
    [Interpolation::Linear, Interpolation::CatmullRom, Interpolation::LogLinear, Interpolation::Nearest];

/// The frames of a bake in a folder.
fn in_frames(stored: &Stored, folder: &Path) -> Baked {
    let path = folder.join("lab.frames");
    frames::write(&path, stored, Digest::of(b"lab"), true, |_| true).unwrap();
    Baked::read(&path).unwrap()
}

#[test]
fn pictures_have_the_light_of_the_cpu_by_every_interpolation_from_images_and_from_frames() {
    with_gpu(|gpu| {
        let folder = tempfile::tempdir().unwrap();
        let stored = stored(&scene(), &eye(), polar_day(), 90.0, 17.0, 7);
        let (images, framed) = (Baked::new(stored.clone()), in_frames(&stored, folder.path()));
        let mut studios = [("images", studio(gpu, &images)), ("frames", studio(gpu, &framed))];
        // At a baked time, between two, and between the last of a day and the first of the next.
        for time in ["10:47", "09:00", "00:00:30"] {
            let seconds = day(&stored.plan.calendar).parse_time(time).unwrap();
            for how in ALL {
                let settings = settings(time, how);
                let wanted = by_cpu(&stored, &settings.daylight, seconds);
                for (name, studio) in &mut studios {
                    // Half floats of the picture, and once more of the frames.
                    expect_close(&studio.irradiance(&settings), &wanted, 4e-3, &format!("{name} {time} {how:?}"));
                }
            }
        }
    });
}

#[test]
fn at_its_own_time_a_picture_is_the_baked_frame_by_every_interpolation() {
    with_gpu(|gpu| {
        let stored = stored(&scene(), &eye(), polar_day(), 90.0, 17.0, 7);
        let mut studio = studio(gpu, &Baked::new(stored.clone()));
        let day = day(&stored.plan.calendar);
        for time in [0, 6, 15] {
            let label = day.label(stored.plan.times[time].seconds);
            let frame = studio.irradiance(&settings(&label, Interpolation::Nearest));
            for how in [Interpolation::Linear, Interpolation::CatmullRom] {
                assert!(studio.irradiance(&settings(&label, how)) == frame, "{label} {how:?}");
            }
            let logarithms = studio.irradiance(&settings(&label, Interpolation::LogLinear));
            expect_close(&logarithms, &frame, 2e-3, &label);
        }
    });
}

#[test]
fn streamed_pictures_are_the_resident_ones_bit_for_bit_in_both_directions_of_time() {
    with_gpu(|gpu| {
        let folder = tempfile::tempdir().unwrap();
        let stored = stored(&scene(), &eye(), polar_day(), 30.0, 17.0, 5);
        let streamed = in_frames(&stored, folder.path());
        assert!(streamed.stream.is_some());
        let resident = Baked { stream: None, ..streamed.clone() };
        let small = Baked { stream: Some(4), ..streamed.clone() };
        let (mut right, mut ours) = (studio(gpu, &resident), [studio(gpu, &streamed), studio(gpu, &small)]);
        for (minutes, how) in
            [(11.0, Interpolation::Linear), (-47.0, Interpolation::CatmullRom), (0.5, Interpolation::LogLinear)]
        {
            let mut settings = settings("22:40", how);
            settings.daylight.minutes = minutes;
            for frame in 0..12 {
                let (wanted, _) = right.frame(frame, &settings).unwrap();
                for studio in &mut ours {
                    let (found, numbers) = studio.frame(frame, &settings).unwrap();
                    assert!(found.layers == wanted.layers, "{how:?} frame {frame}");
                    let uploaded = numbers.iter().find(|(name, _)| *name == "steps_uploaded").unwrap().1;
                    assert!(uploaded <= 4.0, "{uploaded}");
                }
            }
        }
    });
}

#[test]
fn files_that_change_while_they_are_streamed_are_errors_that_name_the_file_and_the_step() {
    with_gpu(|gpu| {
        let folder = tempfile::tempdir().unwrap();
        let stored = stored(&scene(), &eye(), polar_day(), 30.0, 0.0, 5);
        let path = folder.path().join("lab.frames");
        let whole = |path: &Path| frames::write(path, &stored, Digest::of(b"lab"), true, |_| true).unwrap();
        for (what, text) in [("cut", "cut off"), ("other", "replaced"), ("zeros", "damaged")] {
            // Not overwritten by renaming, because the open file would then stay as it is.
            let _ = std::fs::remove_file(&path);
            whole(&path);
            let mut studio = studio(gpu, &Baked::read(&path).unwrap());
            let mut early = settings("01:10", Interpolation::Linear);
            early.daylight.minutes = 0.0;
            studio.frame(0, &early).unwrap();
            let length = std::fs::metadata(&path).unwrap().len();
            let file = std::fs::File::options().write(true).open(&path).unwrap();
            match what {
                "cut" => file.set_len(length / 2).unwrap(),
                "zeros" => {
                    file.set_len(length / 2).unwrap();
                    file.set_len(length).unwrap();
                }
                _ => {
                    // Frames of another bake of the same shape.
                    let other = folder.path().join("other.frames");
                    frames::write(&other, &stored, Digest::of(b"other"), true, |_| true).unwrap();
                    std::fs::write(&path, std::fs::read(other).unwrap()).unwrap();
                }
            }
            let error = studio.frame(0, &settings("20:10", Interpolation::Linear)).unwrap_err();
            let shown = error.to_string();
            assert!(shown.contains("lab.frames") && shown.contains(text), "{what}: {shown}");
            assert!(error.place().is_some_and(|place| place.starts_with("step 4")), "{what}: {shown}");
            assert_eq!(error.exit_code(), 3);
            // What was read before is still there.
            studio.frame(0, &early).unwrap();
        }
    });
}

#[test]
fn damaged_files_of_frames_are_refused_and_never_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let stored = stored(&scene(), &eye(), polar_day(), 90.0, 0.0, 2);
    let path = folder.path().join("lab.frames");
    let size = frames::write(&path, &stored, Digest::of(b"lab"), false, |_| true).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    assert_eq!(size, bytes.len() as u64);
    let (open, still) = Frames::open(&path).unwrap();
    assert_eq!((open.steps, open.texels), (16, 40 * 24));
    assert_eq!(still.plan, stored.plan);
    // The same bake gives the same bytes, and a stopped writer leaves no file.
    let twice = folder.path().join("twice.frames");
    frames::write(&twice, &stored, Digest::of(b"lab"), false, |_| true).unwrap();
    assert!(std::fs::read(&twice).unwrap() == bytes);
    let stopped = folder.path().join("stopped.frames");
    assert!(frames::write(&stopped, &stored, Digest::of(b"lab"), false, |done| done < 3).is_err() && !stopped.exists());
    let odd = folder.path().join("odd.frames");
    for length in (0..bytes.len()).step_by(bytes.len() / 61) {
        std::fs::write(&odd, &bytes[..length]).unwrap();
        let error = Frames::open(&odd).unwrap_err();
        assert!(error.exit_code() == 3 && error.to_string().contains("odd.frames"), "{length}: {error}");
    }
    let header = bytes.len() - 16 * (4 + frames::step_bytes(960) as usize + 32);
    for at in [8, 12, 17, 30, 57, 63, 200, header - 1] {
        let mut changed = bytes.clone();
        changed[at] ^= 0x41;
        std::fs::write(&odd, changed).unwrap();
        assert_eq!(Frames::open(&odd).unwrap_err().exit_code(), 3, "byte {at}");
    }
    let mut changed = bytes.clone();
    changed[header + 6000] ^= 1;
    std::fs::write(&odd, changed).unwrap();
    let (frames, _) = Frames::open(&odd).unwrap();
    let mut file = frames.reader().unwrap();
    let error = frames.read(&mut file, 1).unwrap_err();
    assert_eq!(error.place(), Some("step 1"));
    frames.read(&mut file, 2).unwrap();
}

#[test]
fn fetches_grow_with_the_images_and_not_with_the_steps_of_the_day() {
    with_gpu(|gpu| {
        let pixels = 40 * 24;
        for images in [5, 10, 20] {
            for interval in [90.0, 5.0] {
                let stored = stored(&scene(), &eye(), polar_day(), interval, 0.0, images);
                let mut studio = studio(gpu, &Baked::new(stored));
                for how in [Interpolation::Linear, Interpolation::CatmullRom, Interpolation::LogLinear] {
                    let (_, numbers) = studio.frame(0, &settings("09:01", how)).unwrap();
                    let wanted = f64::from(pixels * (images + SKY_IMAGES));
                    assert_eq!(numbers, [("fetches", wanted)], "{images} images, every {interval} min, {how:?}");
                }
            }
        }
    });
}

#[test]
fn the_papers_sky_is_one_image_that_the_height_of_the_sun_scales() {
    with_gpu(|gpu| {
        let stored = stored(&scene(), &eye(), polar_day(), 90.0, 0.0, 2);
        let highest = stored.plan.times.iter().max_by(|a, b| a.sun[1].total_cmp(&b.sun[1])).unwrap();
        let day = day(&stored.plan.calendar);
        let label = day.label(highest.seconds);
        let mut studio = studio(gpu, &Baked::new(stored.clone()));
        let mut at = |time: &str, sky: SkyLight| {
            let mut settings = settings(time, Interpolation::Linear);
            (settings.daylight.sky, settings.daylight.overcast) = (sky, 1.0);
            studio.irradiance(&settings)
        };
        // Under clouds there is no sun, so that all light is that of the sky.
        let noon = at(&label, SkyLight::Scaled);
        assert!(noon == at(&label, SkyLight::Patches));
        let later = day.sun(day.parse_time("21:00").unwrap()).direction(0.0)[1];
        let scaled: Vec<[f32; 3]> = noon.iter().map(|pixel| pixel.map(|c| c * later / highest.sun[1])).collect();
        expect_close(&at("21:00", SkyLight::Scaled), &scaled, 2e-3, "scaled");
        let paper = PictureSettings::paper().unwrap();
        assert!(paper.daylight.sky == SkyLight::Scaled && paper.validate().is_ok());
    });
}
