//! A built-in scene or a file by the CPU path tracer, to be held beside a technique's picture.
//!
//! `cargo run --release --example path_traced -- SCENE WIDTH HEIGHT SAMPLES BOUNCES OUTPUT`

use std::path::Path;

use lucerna::{
    Error, Result,
    image::{self, Layer, Layers, WriteOptions},
    reference::path,
    scene::{self, Pose, View, bvh::Bvh},
};
use lucerna_scenes as builtin;

fn main() -> std::process::ExitCode {
    match run() {
        Ok(()) => std::process::ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            std::process::ExitCode::from(error.exit_code())
        }
    }
}

fn run() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, numbers @ .., output] = &arguments[..] else { return Err(usage()) };
    let numbers: Vec<u32> = numbers.iter().map(|n| n.parse().map_err(|_| usage())).collect::<Result<_>>()?;
    let [width, height, samples, bounces] = numbers[..] else { return Err(usage()) };
    let scene = match builtin::NAMES.contains(&name.as_str()) {
        true => builtin::load(name)?,
        false => scene::load(name, &Default::default())?,
    };
    let pose = Pose::rest(&scene);
    let bvh = Bvh::build(&scene, &pose);
    let (low, high) = bvh.bounds().ok_or_else(|| Error::input("the scene has no surface"))?;
    let view = View::of_camera(&scene, &pose, 0, [width, height])?;
    let view = view.fit_far(&scene::Aabb { min: low, max: high });
    let light = path::trace(&scene, &pose, &bvh, &view, &path::Settings { samples, bounces, ..Default::default() });
    let rgb = |pixels: &[glam::Vec3]| pixels.iter().flat_map(|p| p.to_array()).collect::<Vec<f32>>();
    let mut picture = Layers::rgb(width, height, rgb(&light.total()));
    for (layer, pixels) in [("direct", &light.direct), ("indirect", &light.indirect), ("albedo", &light.albedo)] {
        picture = picture.with(Layer::new(layer, &["R", "G", "B"], rgb(pixels)));
    }
    let exposure_ev = builtin::exposure(name).unwrap_or(0.0);
    image::write(Path::new(output), &picture, &WriteOptions { exposure_ev, overwrite: true, ..Default::default() })?;
    Ok(())
}

fn usage() -> Error {
    Error::usage("expected SCENE WIDTH HEIGHT SAMPLES BOUNCES OUTPUT").help("For example: cornell 400 300 64 1 a.png")
}
