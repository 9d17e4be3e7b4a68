//! Light of the sky and of glowing surfaces by rays, against closed forms and against paths.

use glam::{Mat4, Vec3};
use lucerna::{
    gpu::{Gpu, testing::with_gpu},
    graph::{Graph, Runner},
    passes::ambient::Irradiance,
    reference::path,
    resident::Resident,
    scene::{Environment, Material, Pose, Scene, View, bvh::Bvh},
    techniques::isr::{Area, AreaLights, Blur, PictureSettings, Settings, Surroundings, picture},
};
use lucerna_scenes as builtin;

use crate::scene_kit::{PI, mesh, place, square, view};

const EXTENT: [u32; 2] = [48, 48];

/// All light of a picture, and its indirect part.
fn render(gpu: &Gpu, scene: &Scene, view: &View, settings: &Settings) -> [Vec<Vec3>; 2] {
    let mut resident = Resident::new(gpu, scene).unwrap();
    let mut area = Area::new(gpu, scene, &resident, &Settings::default()).unwrap().unwrap();
    let mut graph = Graph::new("isr.area");
    graph.seed = 7;
    let pose = Pose::rest(scene);
    let handles = resident.frame_in(&mut graph, scene, &pose);
    let frame = area.frame(&mut graph, scene, &pose, &handles);
    let surroundings = Surroundings { ambient: Irradiance::from(scene), area: Some(frame) };
    let settings = PictureSettings { isr: settings.clone(), ..Default::default() };
    let view = view.fit_far(&handles.bounds());
    let out = picture(&mut graph, &handles, &view, surroundings, &settings).unwrap().outputs;
    let tokens = [out.total, out.indirect].map(|image| graph.read_image(image));
    let frame = Runner::new(gpu).run(&graph).unwrap();
    tokens.map(|token| frame.image(token).to_f32().iter().map(|c| Vec3::new(c[0], c[1], c[2])).collect())
}

/// Rays alone: no light from surface to surface, no filter.
fn bare() -> Settings {
    Settings { indirect: false, occlusion: false, blur: Blur::None, area_rays: 64, ..Settings::default() }
}

fn white() -> Material {
    Material { ior: 1.0, double_sided: true, ..Material::diffuse("white", Vec3::ONE) }
}

/// A sky of 1 W/(sr·m²) in all directions.
fn even_sky() -> Option<Environment> {
    let [width, height] = [16, 8];
    let pixels = vec![Vec3::ONE; (width * height) as usize];
    Some(Environment { name: String::new(), width, height, pixels, rotation: 0.0, scale: 1.0 })
}

fn mean(pixels: &[Vec3]) -> Vec3 {
    pixels.iter().sum::<Vec3>() / pixels.len() as f32
}

/// A floor in the plane y = 0. [`patch`] is a view from above of a patch of it, 0.35 m wide, `x` metres from the middle.
fn floor(scene: &mut Scene, half: f32) {
    let floor = mesh(scene, square(), white());
    place(scene, floor, Mat4::from_scale(Vec3::splat(half)));
}

fn patch(x: f32) -> View {
    view(Vec3::new(x, 0.3, 0.0), Vec3::new(x, 0.0, 0.0), EXTENT)
}

/// Mean over the middle third of a picture, 0.12 m wide in a [`patch`].
fn middle(pixels: &[Vec3]) -> Vec3 {
    let rows = pixels.chunks_exact(EXTENT[0] as usize).skip(16).take(16);
    mean(&rows.flat_map(|row| &row[16..32]).copied().collect::<Vec<_>>())
}

#[test]
fn masks_hold_for_light_of_surfaces_that_the_picture_does_not_show() {
    let scene = builtin::load("cornell").unwrap();
    with_gpu(|gpu| {
        let view = View::of_camera(&scene, &Pose::rest(&scene), 0, EXTENT).unwrap();
        let light = |mask: &str| {
            let settings = Settings { mask: mask.into(), ..Settings::default() };
            render(gpu, &scene, &view, &settings)[1].clone()
        };
        let whole = mean(&light(""));
        assert!(whole.min_element() > 0.0);
        let none = light("white=0,red=0,green=0");
        assert!(none.iter().all(|pixel| *pixel == Vec3::ZERO), "{}", mean(&none));
        let ones = mean(&light("white=1,red=1,green=1")) / whole;
        assert!((ones - 1.0).abs().max_element() < 0.02, "{ones}");
        // Received and sent light have the factor; light that is scattered more often has it more often.
        let some = mean(&light("white=0.4,red=0.4,green=0.4")) / whole;
        println!("0.4 leaves {some} of the light");
        assert!(some.max_element() < 0.17 && some.min_element() > 0.06, "{some}");
        // A flat wall receives no light of the picture, which shows the wall alone: all comes from surfaces beside the picture.
        let wall = crate::scene_kit::view(Vec3::new(0.28, 0.3, 0.4), Vec3::new(0.28, 0.3, 0.559), EXTENT);
        let [whole, some] = ["", "white=0.4"].map(|mask| {
            let settings = Settings { mask: mask.into(), ..Settings::default() };
            mean(&render(gpu, &scene, &wall, &settings)[1])
        });
        println!("0.4 leaves {} of {whole} on a wall", some / whole);
        assert!((some / whole).max_element() < 0.17 && (some / whole).min_element() > 0.03, "{some} of {whole}");
    });
}

#[test]
fn a_plate_under_the_open_sky_has_no_noise() {
    let mut scene = Scene { environment: even_sky(), ..Scene::default() };
    floor(&mut scene, 20.0);
    with_gpu(|gpu| {
        let [_, light] = render(gpu, &scene, &patch(0.0), &Settings { area_rays: 2, ..Settings::default() });
        for pixel in light {
            assert!((pixel - 1.0).abs().max_element() < 2e-3, "{pixel}");
        }
    });
}

#[test]
fn a_long_wall_hides_its_part_of_the_sky() {
    with_gpu(|gpu| {
        for distance in [0.4f32, 1.0, 3.0] {
            let mut scene = Scene { environment: even_sky(), ..Scene::default() };
            floor(&mut scene, 400.0);
            // 1 m high and 800 m long, across the x axis.
            let wall = mesh(&mut scene, square(), white());
            let turned = Mat4::from_rotation_z(0.5 * PI) * Mat4::from_scale(Vec3::new(0.5, 1.0, 400.0));
            place(&mut scene, wall, Mat4::from_translation(Vec3::new(0.0, 0.5, 0.0)) * turned);
            let [_, light] = render(gpu, &scene, &patch(distance), &bare());
            let exact = 0.5 * (1.0 + distance / (1.0 + distance * distance).sqrt());
            let found = middle(&light);
            println!("{distance} m: {found}, exact {exact}");
            assert!((found / exact - 1.0).abs().max_element() < 0.01, "{distance} m: {found}, exact {exact}");
        }
    });
}

/// Six walls of a cube of side 2 around the origin, which look inside.
fn cube(scene: &mut Scene) {
    let wall = mesh(scene, square(), white());
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        for side in [-1.0, 1.0] {
            let turned = glam::Quat::from_rotation_arc(Vec3::Y, -side * axis);
            place(scene, wall, Mat4::from_rotation_translation(turned, side * axis));
        }
    }
}

#[test]
fn no_sky_in_a_closed_cube() {
    let mut scene = Scene { environment: even_sky(), ..Scene::default() };
    cube(&mut scene);
    let view = view(Vec3::new(0.3, 0.2, 0.8), Vec3::new(-1.0, -0.6, -1.0), EXTENT);
    with_gpu(|gpu| {
        let [total, _] = render(gpu, &scene, &view, &Settings::default());
        assert!(total.iter().all(|pixel| *pixel == Vec3::ZERO), "{}", mean(&total));
        let open = Settings { area_lights: AreaLights::Image, ..Settings::default() };
        let [total, _] = render(gpu, &scene, &view, &open);
        assert!(mean(&total).min_element() > 0.2, "without rays the sky is everywhere: {}", mean(&total));
    });
}

/// Form factor from the point below the middle of a square of side 2 at distance `h` to the square (Howell, configuration B-3, four times).
fn below_the_middle(h: f32) -> f32 {
    let a = 1.0 / h;
    let root = (1.0 + a * a).sqrt();
    4.0 / PI * (a / root) * (a / root).atan()
}

#[test]
fn a_lamp_outside_of_the_picture_gives_its_form_factor() {
    with_gpu(|gpu| {
        for height in [0.5f32, 2.0] {
            let mut scene = Scene::default();
            floor(&mut scene, 20.0);
            let glow = Material { emissive: Vec3::new(3.0, 2.0, 1.0), ..Material::diffuse("lamp", Vec3::ZERO) };
            let lamp = mesh(&mut scene, square(), glow);
            place(&mut scene, lamp, Mat4::from_translation(Vec3::Y * height) * Mat4::from_rotation_x(PI));
            let [_, light] = render(gpu, &scene, &patch(0.0), &bare());
            let exact = Vec3::new(3.0, 2.0, 1.0) * below_the_middle(height);
            let found = middle(&light);
            println!("{height} m: {found}, exact {exact}");
            assert!((found / exact - 1.0).abs().max_element() < 0.01, "{height} m: {found}, exact {exact}");
        }
    });
}

#[test]
fn a_ceiling_above_a_lamp_is_lit_by_the_floor() {
    let scene = builtin::load("cornell-area").unwrap();
    let pose = Pose::rest(&scene);
    let view = View::of_camera(&scene, &pose, 0, [120, 90]).unwrap();
    let bvh = Bvh::build(&scene, &pose);
    let traced = |bounces| {
        let paths = path::Settings { samples: 200, bounces, diffuse_only: true, every: 2, ..Default::default() };
        path::trace(&scene, &pose, &bvh, &view, &paths)
    };
    // Paths of one scattering find the lamp's light, those of two the light that other surfaces send.
    let (first, truth) = (traced(1), traced(2));
    let none = |light: Vec3| light == Vec3::ZERO;
    // The ceiling is in the uppermost rows; in lower ones paths may miss the small lamp by chance.
    let kept: Vec<usize> = (0..18 * 120)
        .filter(|&pixel| none(first.direct[pixel]) && none(first.indirect[pixel]) && !none(truth.indirect[pixel]))
        .collect();
    assert!(kept.len() > 40, "{}", kept.len());
    let expected: Vec3 = kept.iter().map(|&pixel| truth.indirect[pixel]).sum();
    with_gpu(|gpu| {
        // One scattering, as the paths have.
        let base = Settings { specular: false, unseen: 0.0, ..Settings::default() };
        let share = |settings: &Settings| {
            let [_, light] = render(gpu, &scene, &view, settings);
            kept.iter().map(|&pixel| light[pixel]).sum::<Vec3>() / expected
        };
        let by_rays = share(&base);
        let in_the_picture = share(&Settings { area_lights: AreaLights::Image, ..base.clone() });
        println!("by rays {by_rays}, in the picture {in_the_picture}");
        assert!(by_rays.min_element() > 0.3 && by_rays.max_element() < 1.2, "{by_rays}");
        assert!(in_the_picture.max_element() < 0.5 * by_rays.min_element(), "{in_the_picture}");
    });
}

#[test]
fn a_furnace_has_the_light_of_all_scatterings() {
    // Walls that emit 1 W/(sr·m²) and reflect a half: 1 / (1 - 0.5) everywhere, of which the picture shows a part of the walls.
    let mut scene = Scene::default();
    let half =
        Material { ior: 1.0, emissive: Vec3::ONE, double_sided: true, ..Material::diffuse("wall", Vec3::splat(0.5)) };
    let wall = mesh(&mut scene, square(), half);
    for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
        for side in [-1.0, 1.0] {
            let turned = glam::Quat::from_rotation_arc(Vec3::Y, -side * axis);
            place(&mut scene, wall, Mat4::from_rotation_translation(turned, side * axis));
        }
    }
    let view = view(Vec3::new(0.3, 0.2, 0.8), Vec3::new(-1.0, -0.6, -1.0), EXTENT);
    with_gpu(|gpu| {
        let light = |unseen: f32| {
            let settings = Settings { unseen, specular: false, area_rays: 64, ..Settings::default() };
            mean(&render(gpu, &scene, &view, &settings)[0])
        };
        let [all, none] = [1.0, 0.0].map(light);
        println!("all {all}, none {none}");
        assert!((all - 2.0).abs().max_element() < 0.06, "{all}");
        assert!(none.max_element() < 1.9, "emission, one scattering by rays, and a part of the second: {none}");
    });
}
