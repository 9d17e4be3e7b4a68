//! Lamps in baked daylight: closed forms, groups, and the path tracer.

use crate::{
    daylight_lab::{baked, lights},
    daylight_light::{eye, plan, stage},
    tracer_lab::{Stage, matt, render, view},
};
use glam::{Mat4, Vec3, vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    scene::{LightKind, Material, Scene, View},
    techniques::daylight::{Baking, Group, Light, Plan, Sources},
};

fn baking(samples: u32) -> Baking {
    Baking { samples, bounces: 16, roulette: 16, disc: false, diffuse_only: true, ..Baking::default() }
}

fn group(name: &str, lights: &[u32], materials: &[u32]) -> Group {
    Group { name: name.into(), lights: lights.into(), materials: materials.into() }
}

fn with_lamps(scene: &Scene, view: &View, samples: u32, lamps: Vec<Group>) -> Plan {
    Plan { lamps, ..plan(scene, view, baking(samples)) }
}

fn tiles(gpu: &Gpu, scene: &Scene, view: &View, plan: &Plan) -> Vec<Light> {
    lights(gpu, scene, plan, Sources::View(Box::new(*view)))
}

#[test]
fn point_lights_give_the_closed_form_each_in_its_group() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let black = stage.material(Material::diffuse("black", Vec3::ZERO));
        stage.quad(black, vec3(-3.0, 0.0, -3.0), Vec3::Z * 6.0, Vec3::X * 6.0);
        let places = [vec3(-1.0, 1.5, 0.2), vec3(0.8, 0.7, -0.5), vec3(0.0, 2.0, 0.0)];
        let powers = [vec3(1.0, 2.0, 3.0), vec3(0.5, 0.1, 0.2), vec3(100.0, 100.0, 100.0)];
        places.into_iter().zip(powers).for_each(|(at, power)| stage.point(at, power));
        let eye = view(vec3(0.0, 3.0, 3.0), Vec3::ZERO, 40.0, [24, 18]);
        // The third light is in no group.
        let lamps = vec![group("right", &[1], &[]), group("left", &[0], &[])];
        let plan = with_lamps(&stage.scene, &eye, 256, lamps);
        // Each path chooses one lamp, so sums over the floor are compared.
        let (mut texels, mut sums) = (0, [[Vec3::ZERO; 2]; 2]);
        for light in tiles(gpu, &stage.scene, &eye, &plan) {
            for (texel, spot) in light.spots.iter().enumerate() {
                texels += 1;
                for (group, lamp) in [1, 0].into_iter().enumerate() {
                    let way = places[lamp] - Vec3::from(spot.position);
                    let found = |channel: usize| light.lamps[(3 * texel + channel) * 2 + group];
                    sums[group][0] += Vec3::from_array(std::array::from_fn(found));
                    sums[group][1] += powers[lamp] * (way.y / way.length().powi(3));
                }
            }
        }
        for (group, [found, wanted]) in sums.into_iter().enumerate() {
            assert!((found / wanted - 1.0).abs().max_element() < 0.01, "group {group}: {found}, not {wanted}");
        }
        assert!(texels > 300);
    });
}

#[test]
fn a_closed_box_that_glows_has_its_emission_over_one_less_its_albedo_after_compression() {
    with_gpu(|gpu| {
        let (albedo, emission) = (vec3(0.5, 0.3, 0.7), vec3(0.2, 1.0, 0.4));
        let mut stage = Stage::new();
        let glowing = stage.material(Material { emissive: emission, ..Material::diffuse("glowing", albedo) });
        stage.cuboid(glowing, Vec3::splat(-1.0), Vec3::ONE, true);
        let eye = view(vec3(0.1, -0.2, 0.8), vec3(0.0, 0.1, -1.0), 60.0, [32, 32]);
        let plan = with_lamps(&stage.scene, &eye, 128, vec![group("walls", &[], &[glowing])]);
        for tile in baked(gpu, &stage.scene, plan, Sources::View(Box::new(eye))).tiles {
            let coefficients = tile.lamps.mix([(0, [1.0; 3])].into_iter());
            let texels = tile.there() as usize;
            let mut sum = Vec3::ZERO;
            for texel in 0..texels {
                sum += Vec3::from(tile.lamps.decode(texel, &coefficients)) / texels as f32;
            }
            let wanted = std::f32::consts::PI * emission / (Vec3::ONE - albedo);
            assert!((sum / wanted - 1.0).abs().max_element() < 0.02, "{sum}, not {wanted}");
            // Neither sun nor sky reaches into the box.
            assert_eq!((tile.sun.images(), tile.sky.images()), (0, 0));
        }
    });
}

#[test]
fn lamps_have_the_light_of_the_path_tracer() {
    with_gpu(|gpu| {
        let mut stage = Stage { scene: stage() };
        let lamp = stage.emitter(vec3(4.0, 3.0, 2.0));
        stage.quad(lamp, vec3(-1.5, 1.6, -1.0), Vec3::X * 0.4, Vec3::Z * 0.4);
        let spot = LightKind::Spot { range: None, inner: 0.3, outer: 0.6 };
        // Spots shine along -Z of their node; this one shines down.
        let down = Mat4::from_translation(vec3(1.0, 2.0, 0.5)) * Mat4::from_rotation_x(-std::f32::consts::FRAC_PI_2);
        stage.light(spot, Vec3::ONE, 3.0, down);
        let eye = eye();
        let lamps = vec![group("all", &[0], &[lamp])];
        let plan = with_lamps(&stage.scene, &eye, 256, lamps);
        let truth = render(gpu, &stage.scene, &eye, &matt(16), 512);
        let of = |name: &str| truth.layer(name).unwrap().data.clone();
        let (direct, indirect, albedo) = (of("direct"), of("indirect"), of("albedo"));
        let (mut found, mut wanted) = ([0.0f64; 3], [0.0f64; 3]);
        for (index, light) in tiles(gpu, &stage.scene, &eye, &plan).iter().enumerate() {
            for (number, [x, y]) in plan.covered(index as u32, &light.mask).enumerate() {
                let pixel = (y * plan.extent[0] + x) as usize;
                for channel in 0..3 {
                    let at = 3 * pixel + channel;
                    let irradiance = light.lamps[3 * number + channel];
                    found[channel] += f64::from(irradiance * albedo[at] / std::f32::consts::PI);
                    wanted[channel] += f64::from(direct[at] + indirect[at]);
                }
            }
        }
        for channel in 0..3 {
            let ratio = found[channel] / wanted[channel];
            assert!((ratio - 1.0).abs() < 0.02, "channel {channel}: {ratio}");
        }
    });
}
