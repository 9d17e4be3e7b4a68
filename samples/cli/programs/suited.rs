//! `lucerna render`: a scene by a named technique, or by the one that suits it.

use std::{path::PathBuf, process::ExitCode};

use clap::{Args, Subcommand};
use lucerna::{
    Error, Result,
    technique::{Mode, Technique},
    techniques::{fiv::Fiv, igi::Igi, isr::Isr},
};

use super::{
    daylight::never,
    igi::{self, IgiArgs},
    isr::{self, IsrArgs},
};
use crate::{
    args::{RenderArgs, TalkArgs},
    daylight::{self, DayArgs},
    effects,
    fiv::{self, FivArgs},
    interior::is_room,
    prt::{self, PrtArgs},
    reference::{self, ReferenceArgs},
    render::{self, Given},
    stage::Stage,
};

/// Triangles up to which vectors are computed in little time on a CPU driver.
const FEW: usize = 100_000;

/// Options of `lucerna render`.
#[derive(Args, Debug)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_precedence_over_arg = true,
    subcommand_value_name = "TECHNIQUE",
    subcommand_help_heading = "Techniques"
)]
pub struct AnyArgs {
    #[command(subcommand)]
    technique: Option<By>,

    #[command(flatten)]
    common: RenderArgs,
}

#[derive(Subcommand, Debug)]
enum By {
    /// Image-space radiosity: fast, indirect light from what the camera sees
    #[command(args_override_self = true)]
    Isr(Box<IsrArgs>),
    /// Instant global illumination: virtual point lights, mirrors and glass by rays
    #[command(args_override_self = true)]
    Igi(Box<IgiArgs>),
    /// Soft shadows under an environment
    #[command(args_override_self = true, mut_arg("paper", |arg| arg.hide(true)))]
    Fiv(Box<FivArgs>),
    /// Light of a day, from the file of `lucerna bake daylight`
    #[command(args_override_self = true, mut_arg("time", |arg| arg.long("scene-time")), mut_arg("default_light", never))]
    Daylight(Box<DayArgs>),
    /// Lights that move in a room, from the file of `lucerna bake prt`
    #[command(args_override_self = true)]
    Prt(Box<PrtArgs>),
    /// Path tracing, for comparisons
    #[command(args_override_self = true)]
    Reference(Box<ReferenceArgs>),
}

impl AnyArgs {
    pub fn talk(&self) -> &TalkArgs {
        match &self.technique {
            None => &self.common.talk,
            Some(By::Isr(args)) => &args.common.talk,
            Some(By::Igi(args)) => &args.common.talk,
            Some(By::Fiv(args)) => &args.common.talk,
            Some(By::Daylight(args)) => &args.common.talk,
            Some(By::Prt(args)) => &args.common.talk,
            Some(By::Reference(args)) => &args.talk,
        }
    }

    /// Renders.
    ///
    /// # Errors
    /// Any error of the run. Its kind decides the exit code.
    pub fn run(self) -> Result<ExitCode> {
        let console = self.talk().console();
        match self.technique {
            None => chosen(self.common),
            Some(By::Isr(args)) => isr::render(&args),
            Some(By::Igi(args)) => igi::render(&args),
            Some(By::Fiv(args)) => fiv::render(&args, None),
            Some(By::Daylight(args)) => daylight::render(&args),
            Some(By::Prt(args)) => prt::render(&args),
            Some(By::Reference(args)) => reference::run(&args, console),
        }
    }
}

/// Options of `lucerna run`.
#[derive(Args, Debug)]
pub struct RunArgs {
    /// The pipeline: a .toml file (docs/effects.md)
    #[arg(value_name = "PIPELINE.toml")]
    pipeline: PathBuf,

    #[command(flatten)]
    pub common: RenderArgs,
}

impl RunArgs {
    /// Renders by the technique that the pipeline is made for.
    ///
    /// # Errors
    /// Any error of the run. Its kind decides the exit code.
    pub fn run(self) -> Result<ExitCode> {
        let Self { pipeline, mut common } = self;
        if common.settings.effects.is_some() {
            return Err(Error::usage("the pipeline is named already").at("--effects"));
        }
        let found = effects::read(&pipeline)?;
        common.settings.effects = Some(pipeline.clone());
        match found.technique.as_deref() {
            None => chosen(common),
            Some(Isr::NAME) => render::render(&common, &Given::<Isr>::by(&common, Mode::ALL[0])?),
            Some(Igi::NAME) => render::render(&common, &Given::<Igi>::by(&common, Mode::ALL[0])?),
            Some(Fiv::NAME) => fiv::render(&FivArgs { common, vectors: None, full: false }, None),
            Some(other) => Err(Error::usage(format!("a pipeline for {other} needs more options than `run` has"))
                .in_file(&pipeline)
                .help(format!("`lucerna render {other} --effects {}` has them", pipeline.display()))),
        }
    }
}

/// A technique that needs no bake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Suited {
    Isr,
    Igi,
    Fiv,
}

impl Suited {
    fn name(self) -> &'static str {
        match self {
            Self::Isr => Isr::NAME,
            Self::Igi => Igi::NAME,
            Self::Fiv => Fiv::NAME,
        }
    }
}

/// Renders by the technique that suits the scene.
fn chosen(common: RenderArgs) -> Result<ExitCode> {
    let stage = Stage::open(&common.stage)?;
    let (technique, why) = suited(&stage, common.frames.is_some());
    let name = technique.name();
    common
        .talk
        .console()
        .info(&format!("technique: {name}, because {why} (`lucerna render isr|igi|fiv SCENE` chooses another)"));
    match technique {
        Suited::Isr => render::render_on(Some(stage), &common, &Given::<Isr>::by(&common, Mode::ALL[0])?),
        Suited::Igi => render::render_on(Some(stage), &common, &Given::<Igi>::by(&common, Mode::ALL[0])?),
        Suited::Fiv => fiv::render(&FivArgs { common, vectors: None, full: false }, Some(stage)),
    }
}

/// Name of the technique that suits a still of a scene, and why it does.
pub fn by_name(stage: &Stage) -> (&'static str, &'static str) {
    let (technique, why) = suited(stage, false);
    (technique.name(), why)
}

/// The technique that suits a scene, and why it does. `sequence`: several frames are rendered.
fn suited(stage: &Stage, sequence: bool) -> (Suited, &'static str) {
    let scene = &stage.scene;
    let lamps = scene.nodes.iter().any(|node| node.light.is_some());
    if !lamps && scene.environment.is_none() {
        return (Suited::Igi, "only emissive surfaces light the scene");
    }
    let used = scene.nodes.iter().filter_map(|node| scene.meshes.get(node.mesh? as usize));
    let primitives: Vec<_> = used.flat_map(|mesh| &mesh.primitives).collect();
    let optical = |material: u32| {
        let material = &scene.materials[material as usize];
        material.transmission > 0.0 || (material.is_mirror() && material.metallic_roughness_texture.is_none())
    };
    if primitives.iter().any(|primitive| optical(primitive.material)) {
        return (Suited::Igi, "the scene has mirrors or glass");
    }
    if is_room(scene) {
        let why = if lamps {
            "lamps light a room, also from outside of the picture"
        } else {
            "the sky lights a room through its openings"
        };
        return (Suited::Igi, why);
    }
    let triangles: usize = primitives.iter().map(|primitive| primitive.indices.len() / 3).sum();
    // Metals take long with `fiv`.
    if !lamps && !sequence && triangles <= FEW && !fiv::has_metals(scene) {
        return (Suited::Fiv, "an environment alone lights the scene");
    }
    (Suited::Isr, "it is the quickest")
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser, Debug)]
    struct Line {
        #[command(flatten)]
        any: AnyArgs,
    }

    fn by(words: &str) -> (Suited, &'static str) {
        let line = Line::try_parse_from(["x"].into_iter().chain(words.split_whitespace())).unwrap();
        suited(&Stage::open(&line.any.common.stage).unwrap(), false)
    }

    #[test]
    fn the_scene_decides() {
        for (words, technique) in [
            ("--builtin furnace", Suited::Igi),
            ("--builtin conference", Suited::Igi),
            ("--builtin conference --environment grove", Suited::Igi),
            ("--builtin cornell", Suited::Isr),
            ("--builtin furnace-sphere", Suited::Fiv),
            ("--builtin furnace-sphere --light 0,3,0,9", Suited::Isr),
        ] {
            let (found, why) = by(words);
            assert_eq!(found, technique, "{words}: {why}");
        }
    }

    #[test]
    fn a_technique_may_be_named_and_has_its_own_options() {
        let line = Line::try_parse_from(["x", "isr", "a.glb", "--preset", "fast"]).unwrap();
        assert!(matches!(line.any.technique, Some(By::Isr(_))));
        let line = Line::try_parse_from(["x", "a.glb", "-o", "b.png"]).unwrap();
        assert!(line.any.technique.is_none() && line.any.common.output == ["b.png"]);
        // Options before a technique would be lost.
        assert!(Line::try_parse_from(["x", "--seed", "3", "isr", "a.glb"]).is_err());
    }
}
