//! `isr`: image-space radiosity. The whole pipeline of a frame stands in [`compose`].

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
    techniques::isr,
};
use lucerna_samples::{
    args::RenderArgs,
    gbuffer_layers, program,
    render::{self, Input, Technique},
    shown::Shown,
};
use serde::{Deserialize, Serialize};

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

/// All settings, by the passes that they belong to.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
struct Settings {
    isr: isr::Settings,
    gbuffer: gbuffer::Settings,
    shadow: shadow::Settings,
}

impl Settings {
    /// The dissertation's choices.
    fn paper() -> Self {
        let defaults = Self::default();
        Self {
            isr: isr::Settings::paper(),
            gbuffer: gbuffer::Settings { normals: gbuffer::Normals::Bytes, ..defaults.gbuffer },
            shadow: shadow::Settings::dissertation(),
        }
    }
}

fn main() -> ExitCode {
    let Command::Render(render) = Arguments::parse().command;
    program::run(render.common.talk.console(), || run(&render))
}

fn run(render: &Render) -> Result<ExitCode> {
    let base = if render.common.paper { Settings::paper() } else { Settings::default() };
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
        |gpu, scene, _| {
            let ambient = scene.environment.as_ref().map(Irradiance::of).unwrap_or_default();
            Ok((Resident::new(gpu, scene)?, ambient))
        },
        |graph, (resident, ambient), input, settings| compose(graph, resident, *ambient, input, settings, render.mode),
    )
}

fn direct_choices(settings: &isr::Settings) -> direct::Direct {
    direct::Direct {
        paper_law: settings.light_law == isr::LightLaw::Paper,
        specular: settings.specular,
        light_radius: settings.light_radius,
        light_power: settings.light_power,
    }
}

/// Declares one frame.
fn compose(
    graph: &mut Graph,
    resident: &mut Resident,
    ambient: Irradiance,
    input: &Input<'_>,
    settings: &Settings,
    mode: Mode,
) -> Result<Shown> {
    let scene = resident.frame_in(graph, input.scene, input.pose);
    let view = input.view.fit_far(&scene.bounds());
    let gbuffer = gbuffer::draw(graph, &scene, &view, &settings.gbuffer);
    let maps = shadow::draw(graph, &scene, &view, &settings.shadow);
    let lights = Lights { lights: maps.lights, shadows: maps.shadows, shadow_maps: maps.maps };
    let sky = |graph: &mut Graph, target| skybox::draw(graph, &scene, &gbuffer, glam::Vec3::ZERO, target);

    let shown = if mode == Mode::Direct {
        let lit = direct::light(graph, &gbuffer, lights, &direct_choices(&settings.isr));
        sky(graph, lit.direct);
        Shown::new(lit.direct)
    } else {
        let out = isr::frame(graph, &isr::Inputs { gbuffer, lights, ambient }, &settings.isr)?;
        sky(graph, out.total);
        let shown = match mode {
            Mode::Indirect => Shown::new(out.indirect),
            Mode::Occlusion => Shown::grey(out.occlusion),
            Mode::Isr | Mode::Direct => Shown::new(out.total),
        };
        shown.color("direct", out.direct).color("indirect", out.indirect).layer(
            "occlusion",
            &["Y"],
            out.occlusion,
            |pixel| pixel,
        )
    };
    let notes = [resident.notes(), &maps.notes].concat();
    Ok(gbuffer_layers::add(shown, &gbuffer, &view).seen_by(view).noting(notes))
}
