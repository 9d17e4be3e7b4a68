//! Things on a ground under an environment, their shadows from irradiance vectors: computed once, then drawn while they move.
//!
//! `cargo run --release --example shadows -- OUTPUT.png`

use std::path::Path;

use glam::Vec3;
use lucerna::{
    Error, Result,
    gpu::{Gpu, GpuOptions},
    graph::{Graph, Runner},
    image::{self, Layers, WriteOptions},
    resident::Resident,
    scene::{Pose, View, ground},
    techniques::fiv::{Fiv, PictureSettings},
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
    let output = std::env::args().nth(1).ok_or_else(|| Error::usage("expected OUTPUT.png"))?;
    let things = [builtin::load("hare")?, builtin::load("queen")?];
    let mut scene = ground::on_ground(&things, &ground::Ground { copies: 2, ..Default::default() })?;
    scene.environment = Some(builtin::environment("area")?);

    let gpu = Gpu::new(GpuOptions::default())?;
    let mut resident = Resident::new(&gpu, &scene)?;
    let settings = PictureSettings::default();
    // Computes the vectors. `Stored::read` takes them from a file instead.
    let mut fiv = Fiv::new(&gpu, &scene, &resident, &settings.fiv, None, |done, all| {
        eprintln!("{done} of {all} vectors");
        true
    })?;

    // Occluders move at no cost. Here the first one floats.
    let mut pose = Pose::rest(&scene);
    if let Some(placed) = fiv.occluders().placed.first() {
        pose.world[placed.node as usize].w_axis += (0.3 * Vec3::Y).extend(0.0);
    }
    let mut graph = Graph::new("shadows");
    let handles = resident.frame_in(&mut graph, &scene, &pose);
    let view = View::of_camera(&scene, &pose, 0, [640, 480])?.fit_far(&handles.bounds());
    let picture = fiv.picture(&mut graph, &scene, &pose, &handles, &view, &settings)?;
    let total = graph.read_image(picture.outputs.total);
    let pixels = Runner::new(&gpu).run(graph)?.image(total).to_f32();
    let data = pixels.into_iter().flat_map(|[r, g, b, _]| [r, g, b]).collect();
    image::write(
        Path::new(&output),
        &Layers::rgb(640, 480, data),
        &WriteOptions { overwrite: true, ..Default::default() },
    )?;
    Ok(())
}
