//! Suns that are points: baked light against the path tracer with a point light at the same place.

use crate::{
    daylight_lab::lights,
    daylight_light::{baking, eye, plan, stage},
    tracer_lab::{Stage, render},
};
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::testing::with_gpu,
    scene::LightKind,
    techniques::daylight::{Baking, Sources, SunPoint},
    tracer::{Filter, Settings},
};

#[test]
fn a_sun_at_a_distance_has_the_light_of_a_point_light_there() {
    with_gpu(|gpu| {
        let (scene, view) = (stage(), eye());
        let point = SunPoint { centre: [0.0, 1.0, 0.0], distance: 5.0 };
        let mut plan = plan(&scene, &view, Baking { samples: 384, ..baking() });
        plan.calendar.point = Some(point);
        plan.times.remove(1);
        plan.validate().unwrap();
        let tiles = lights(gpu, &scene, &plan, Sources::View(Box::new(view)));
        let settings =
            Settings { bounces: 16, roulette: 16, diffuse_only: true, filter: Filter::Centre, ..Settings::default() };
        for (time, lit) in plan.times.iter().enumerate() {
            let mut stage = Stage { scene: scene.clone() };
            let place = Mat4::from_translation(Vec3::from(point.position(lit.sun)));
            stage.light(LightKind::Point { range: None }, Vec3::ONE, point.distance * point.distance, place);
            let layers = render(gpu, &stage.scene, &view, &settings, 256);
            let of = |name: &str| layers.layer(name).unwrap().data.clone();
            let (indirect, albedo) = (of("indirect"), of("albedo"));
            let (mut wanted, mut found) = (Vec3::ZERO, Vec3::ZERO);
            for pixel in indirect.chunks_exact(3) {
                wanted += vec3(pixel[0], pixel[1], pixel[2]);
            }
            for (index, light) in tiles.iter().enumerate() {
                for (number, [x, y]) in plan.covered(index as u32, &light.mask).enumerate() {
                    let pixel = 3 * (y * plan.extent[0] + x) as usize;
                    for channel in 0..3 {
                        let irradiance = light.sun[(3 * number + channel) * plan.times.len() + time];
                        found[channel] += irradiance * albedo[pixel + channel] / std::f32::consts::PI;
                    }
                }
            }
            let ratio = found / wanted;
            assert!((ratio - 1.0).abs().max_element() < 0.02, "time {time}: {ratio}");
        }
    });
}

#[test]
fn impossible_suns_and_spans_are_refused() {
    let (scene, view) = (stage(), eye());
    for distance in [0.0, -3.0, f32::NAN, f32::INFINITY] {
        let mut plan = plan(&scene, &view, baking());
        plan.calendar.point = Some(SunPoint { centre: [0.0; 3], distance });
        assert!(plan.validate().unwrap_err().to_string().contains("distance"), "{distance}");
    }
    for span in [[5.0, 4.0], [-1.0, 4.0], [0.0, 1e6], [f64::NAN, 5.0]] {
        let mut plan = plan(&scene, &view, baking());
        plan.calendar.span = Some(span);
        assert!(plan.validate().is_err(), "{span:?}");
    }
}
