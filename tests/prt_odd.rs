//! Rooms that lights do not reach.

use crate::{prt_lab::small, tracer_lab::Stage};
use glam::{Vec3, vec3};
use lucerna::{
    Stop,
    gpu::testing::with_gpu,
    scene::Material,
    techniques::prt::{Bakery, Baking, starts},
};

#[test]
fn a_second_room_without_a_way_to_the_light_has_samples_and_the_inside_of_furniture_has_none() {
    with_gpu(|gpu| {
        let mut stage = Stage::new();
        let wall = stage.material(Material::diffuse("wall", Vec3::splat(0.5)));
        stage.cuboid(wall, vec3(-1.0, -1.0, -1.0), Vec3::ONE, true);
        stage.cuboid(wall, vec3(4.0, -1.0, -1.0), vec3(6.0, 1.0, 1.0), true);
        stage.cuboid(wall, vec3(-0.5, -0.7, -0.5), vec3(0.0, -0.2, 0.0), false);
        // A hollow cabinet behind the wall.
        stage.cuboid(wall, vec3(1.2, -0.2, -0.2), vec3(1.5, 0.1, 0.1), true);
        stage.point(vec3(0.2, 0.3, -0.1), Vec3::ONE);
        let mut places = starts(&stage.scene);
        let mut bakery = Bakery::new(gpu, &stage.scene).unwrap();
        let area = |bakery: &mut Bakery, places: &[Vec3]| {
            let baking = Baking { samples: 1000, ..small() };
            let found = bakery.sample(&baking, places, &Stop::default()).unwrap();
            let of = |far: bool| {
                let here = found.samples.iter().filter(|sample| (sample.position[0] > 3.0) == far);
                here.map(|sample| f64::from(sample.area)).sum::<f64>()
            };
            [of(false), of(true)]
        };
        assert_eq!(area(&mut bakery, &places)[1], 0.0);
        assert_eq!(bakery.rooms(&small(), &mut places, &Stop::default()).unwrap(), 1);
        assert!((places[1] - vec3(5.0, 0.0, 0.0)).abs().max_element() < 1.0, "{places:?}");
        // 24 m² each, and six sides of 0.25 m² of furniture in the first one.
        let [first, second] = area(&mut bakery, &places);
        assert!((first - 25.5).abs() < 0.5 && (second - 24.0).abs() < 0.2, "{first} {second}");
        assert_eq!(bakery.rooms(&small(), &mut places, &Stop::default()).unwrap(), 0);
    });
}
