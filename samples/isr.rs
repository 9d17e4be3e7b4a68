//! `isr`: image-space radiosity. A frame is declared in [`compose`].

use std::process::ExitCode;

use clap::{Parser, Subcommand, ValueEnum};
use lucerna::{
    Result,
    graph::Graph,
    passes::{
        ambient::Irradiance,
        direct::{self, Lights},
        gbuffer, shadow, skybox,
    },
    scene::resident::Resident,
    techniques::isr::{self, PictureSettings, Preset},
};
use lucerna_samples::{
    args::RenderArgs,
    gbuffer_layers, program,
    render::{self, Input, Technique},
    shown::Shown,
};

/// Image-space radiosity: one bounce of indirect light and ambient occlusion from what the camera sees.
#[derive(Parser, Debug)]
#[command(name = "isr", version, max_term_width = 120)]
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

    /// Start from choices that go together: fast, balanced or best; -D and --settings win over it
    #[arg(long, value_name = "NAME", help_heading = "Technique", conflicts_with = "paper")]
    preset: Option<Preset>,

    /// What the picture shows
    #[arg(long, value_enum, default_value_t, help_heading = "Technique")]
    mode: Mode,
}

#[derive(ValueEnum, Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Mode {
    /// Direct and indirect light
    #[default]
    Isr,
    /// Direct light only; nothing is gathered
    Direct,
    /// Indirect light alone
    Indirect,
    /// Ambient occlusion alone: 1 open, 0 occluded
    Occlusion,
}

fn main() -> ExitCode {
    let Command::Render(render) = Arguments::parse().command;
    program::run(render.common.talk.console(), || run(&render))
}

fn run(render: &Render) -> Result<ExitCode> {
    let base = match render.preset {
        _ if render.common.paper => PictureSettings::paper(),
        Some(preset) => PictureSettings { isr: preset.settings(), ..PictureSettings::default() },
        None => PictureSettings::default(),
    };
    let mode = match render.mode {
        Mode::Isr => "isr",
        Mode::Direct => "direct",
        Mode::Indirect => "indirect",
        Mode::Occlusion => "occlusion",
    };
    let technique = Technique { name: "isr", mode: Some(mode), radiance: render.mode != Mode::Occlusion };
    render::render(
        technique,
        &render.common,
        &base,
        PictureSettings::validate,
        |gpu, scene, _| {
            let ambient = scene.environment.as_ref().map(Irradiance::of).unwrap_or_default();
            Ok((Resident::new(gpu, scene)?, ambient))
        },
        |graph, (resident, ambient), input, settings| compose(graph, resident, ambient, input, settings, render.mode),
    )
}

/// Declares one frame.
fn compose(
    graph: &mut Graph,
    resident: &mut Resident,
    ambient: &Irradiance,
    input: &Input<'_>,
    settings: &PictureSettings,
    mode: Mode,
) -> Result<Shown> {
    let scene = resident.frame_in(graph, input.scene, input.pose);
    let view = input.view.fit_far(&scene.bounds());
    let (shown, gbuffer, shadows) = if mode == Mode::Direct {
        let gbuffer = gbuffer::draw(graph, &scene, &view, &settings.gbuffer);
        let shadows = shadow::draw(graph, &scene, &view, &settings.shadow);
        let lit = direct::light(graph, &gbuffer, Lights::from(&shadows), &settings.isr.direct());
        skybox::draw(graph, &scene, &gbuffer, settings.background.into(), lit.direct);
        (Shown::new(lit.direct), gbuffer, shadows)
    } else {
        let picture = isr::picture(graph, &scene, &view, ambient.clone(), settings)?;
        let out = picture.outputs;
        let shown = match mode {
            Mode::Indirect => Shown::new(out.indirect),
            Mode::Occlusion => Shown::grey(out.occlusion),
            Mode::Isr | Mode::Direct => Shown::new(out.total),
        };
        let shown = shown.color("direct", out.direct).color("indirect", out.indirect);
        (shown.layer("occlusion", &["Y"], out.occlusion, |pixel| pixel), picture.gbuffer, picture.shadows)
    };
    let notes = [resident.notes(), &shadows.notes].concat();
    Ok(gbuffer_layers::add(shown, &gbuffer, &view).seen_by(view).noting(notes))
}
