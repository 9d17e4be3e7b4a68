//! `igi`: instant global illumination. A frame is declared in [`compose`].

use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};
use lucerna::{
    Result,
    graph::Graph,
    scene::resident::Resident,
    techniques::igi::{self, Igi, PictureSettings},
};
use lucerna_samples::{
    args::RenderArgs,
    gbuffer_layers, program,
    render::{self, Input, Technique},
    shown::Shown,
};

/// Instant global illumination: direct light by shadow rays, indirect light by ray-traced virtual point lights.
#[derive(Parser, Debug)]
#[command(name = "igi", version, max_term_width = 120)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Render a scene into images
    #[command(args_override_self = true)]
    Render(Box<Render>),
}

#[derive(clap::Args, Debug)]
struct Render {
    #[command(flatten)]
    common: RenderArgs,

    /// What the picture shows
    #[arg(long, value_enum, default_value_t, help_heading = "Technique")]
    mode: Mode,
}

#[derive(ValueEnum, Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Mode {
    /// Direct and indirect light
    #[default]
    Igi,
    /// Direct light alone
    Direct,
    /// Indirect light alone
    Indirect,
}

fn main() -> ExitCode {
    let Command::Render(render) = Arguments::parse().command;
    program::run(render.common.talk.console(), || run(&render))
}

fn run(render: &Render) -> Result<ExitCode> {
    let base = if render.common.paper { PictureSettings::paper() } else { PictureSettings::default() };
    let mode = match render.mode {
        Mode::Igi => "igi",
        Mode::Direct => "direct",
        Mode::Indirect => "indirect",
    };
    let technique = Technique { name: "igi", mode: Some(mode), radiance: true };
    render::render(
        technique,
        &render.common,
        &base,
        PictureSettings::validate,
        |gpu, scene, settings| {
            let resident = Resident::new(gpu, scene)?;
            let igi = Igi::new(gpu, scene, &resident, &settings.igi)?;
            Ok((resident, igi))
        },
        |graph, (resident, igi), input, settings| compose(graph, resident, igi, input, settings, render.mode),
    )
}

/// Declares one frame.
fn compose(
    graph: &mut Graph,
    resident: &mut Resident,
    igi: &mut Igi,
    input: &Input<'_>,
    settings: &PictureSettings,
    mode: Mode,
) -> Result<Shown> {
    let scene = resident.frame_in(graph, input.scene, input.pose);
    let view = input.view.fit_far(&scene.bounds());
    // Nobody looks at indirect light then.
    let direct = mode == Mode::Direct && !input.layers;
    let served = PictureSettings {
        igi: igi::Settings { indirect: settings.igi.indirect && !direct, ..settings.igi.clone() },
        ..settings.clone()
    };
    let picture = igi.picture(graph, input.scene, input.pose, &scene, &view, &served)?;
    let out = picture.outputs;
    let shown = match mode {
        Mode::Igi => Shown::new(out.total),
        Mode::Direct => Shown::new(out.direct),
        Mode::Indirect => Shown::new(out.indirect),
    };
    let shown = shown.color("direct", out.direct).color("indirect", out.indirect);
    // What mirrors and glass show.
    let shown = match out.sharp {
        Some(sharp) => shown.color("specular", sharp),
        None => shown,
    };
    let shown = match out.cache {
        Some(cache) => shown.remarking(cache.list.range(0..4), move |count| cache.note(count)),
        None => shown,
    };
    Ok(gbuffer_layers::add(shown, &picture.gbuffer, &view).seen_by(view).noting(igi::notes(
        input.scene,
        resident.notes(),
        settings,
        input.frames,
    )))
}
