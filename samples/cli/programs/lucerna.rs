//! `lucerna`: one door to everything: pictures of scenes, bakes, tone mapping, comparisons, experiments, and what is in files.

use std::{path::PathBuf, process::ExitCode};

use clap::{Parser, Subcommand};
use clap_complete::Shell;
use lucerna::Result;
use lucerna_scenes as builtin;

use crate::{
    args::TalkArgs,
    bake::{self, BakeCommand, JoinArgs},
    compare::{self, CompareArgs},
    console::{self, Console},
    devices,
    experiment::command::{self as experiment, ReportArgs, ReproduceArgs},
    export_gltf::{self, ExportGltfArgs},
    export_pov::{self, ExportPovArgs},
    info, inspect, listed, program,
    programs::{
        help, pages,
        suited::{AnyArgs, RunArgs},
    },
    reference::{self, ReferenceArgs},
    rerun::{self, RerunArgs},
    settings_list,
    source::SceneArgs,
    tonemap::TonemapArgs,
    view::{self, ViewArgs},
    views::{self, command::ViewsArgs},
};

/// Renders scenes, develops, compares and explains pictures, bakes light, runs experiments.
///
/// `lucerna model.glb` renders a scene. `isr`, `igi`, `fiv`, `daylight` and `prt` are short names of `lucerna render` with this technique, `tonemap` of
/// `lucerna tonemap`.
#[derive(Parser, Debug)]
#[command(name = "lucerna", version, max_term_width = 120)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Render a scene into images, by the technique that suits it or by a named one
    #[command(args_override_self = true)]
    Render(Box<AnyArgs>),
    /// Render a scene by a pipeline in text: a TOML file with shaders beside it
    #[command(args_override_self = true)]
    Run(Box<RunArgs>),
    /// Open a window: every technique live, beside the path tracer
    #[command(args_override_self = true)]
    View(Box<ViewArgs>),
    /// Say what is in a scene, and what of it is not supported
    Inspect {
        #[command(flatten)]
        scene: Box<SceneArgs>,
        #[command(flatten)]
        talk: TalkArgs,
        /// Print one JSON document
        #[arg(long)]
        json: bool,
    },
    /// Say what is in an image and how it was made
    Info {
        /// .exr, .png, .hdr, .pfm or .jpg; folders and patterns ('out/*.exr') stand for their images, `-` for
        /// standard input
        #[arg(required = true, value_name = "IMAGE")]
        images: Vec<String>,
        #[command(flatten)]
        talk: TalkArgs,
        /// Print one JSON document
        #[arg(long)]
        json: bool,
    },
    /// Make a reference picture by path tracing: samples, time or an error decide when it is done
    #[command(args_override_self = true)]
    Reference(Box<ReferenceArgs>),
    /// Make a picture again from what it says about itself, in memory, and compare the bits
    Rerun(RerunArgs),
    /// Write a scene and a view as a POV-Ray file, and render it where `povray` is installed
    ExportPov(Box<ExportPovArgs>),
    /// Write a scene as one glTF 2.0 file, for other programs
    ExportGltf(Box<ExportGltfArgs>),
    /// Measure how far images are from a reference
    Compare(Box<CompareArgs>),
    /// Develop HDR pictures for a screen: EXR, .hdr, PFM to PNG, JPEG, EXR (also as the program `tonemap`)
    #[command(args_override_self = true)]
    Tonemap(Box<TonemapArgs>),
    /// List the Vulkan devices, and what the unsuitable ones lack
    Devices {
        /// Fail unless one of them is a usable GPU
        #[arg(long)]
        require_gpu: bool,
        #[command(flatten)]
        talk: TalkArgs,
        /// Print one JSON document
        #[arg(long)]
        json: bool,
    },
    /// Write a list of views of a scene: its own cameras, and random ones that show something
    Views(Box<ViewsArgs>),
    /// Run an experiment and write its report
    Reproduce(Box<ReproduceArgs>),
    /// Write the report of an experiment again, from the pictures that are there
    Report(ReportArgs),
    /// List all settings of the techniques (-D KEY=VALUE): what they do, their values, units, defaults, and what they need
    Settings {
        /// One technique alone
        #[arg(value_parser = clap::builder::PossibleValuesParser::new(settings_list::names()))]
        technique: Option<String>,
        /// Print one JSON document: the schema of the settings
        #[arg(long, conflicts_with = "form")]
        json: bool,
        #[arg(long, value_enum, default_value_t, value_name = "FORM")]
        form: settings_list::Form,
        #[command(flatten)]
        talk: TalkArgs,
    },
    /// Compute light once for many pictures; look into the units of such a computation, and spread one over machines
    #[command(subcommand)]
    Bake(BakeCommand),
    /// Join what shards of a long computation have computed, into one folder or into the file that it is for
    Merge(JoinArgs),
    /// Print completions of all programs for a shell: source <(lucerna completions bash)
    Completions { shell: Shell },
    /// Write man pages of all programs into a folder
    Man {
        folder: PathBuf,
        /// Replace existing pages
        #[arg(long)]
        overwrite: bool,
        #[command(flatten)]
        talk: TalkArgs,
    },
    /// List the built-in scenes, and the things that can be put on a ground (--ground)
    List {
        #[command(flatten)]
        talk: TalkArgs,
        /// Print one JSON document
        #[arg(long)]
        json: bool,
    },
}

impl Command {
    fn console(&self) -> Console {
        match self {
            Self::Render(args) => args.talk().console(),
            Self::View(args) => args.talk.console(),
            Self::Run(args) => args.common.talk.console(),
            Self::Completions { .. } => Console::new(false, 0),
            Self::Man { talk, .. } => talk.console(),
            Self::Views(args) => args.talk.console(),
            Self::Reproduce(args) => args.talk.console(),
            Self::Report(args) => args.talk.console(),
            Self::Bake(command) => command.talk().console(),
            Self::Merge(args) => args.talk.console(),
            Self::Compare(args) => args.talk.console(),
            Self::Tonemap(args) => args.talk.console(),
            Self::Reference(args) => args.talk.console(),
            Self::Rerun(args) => args.talk.console(),
            Self::Inspect { talk, .. }
            | Self::Info { talk, .. }
            | Self::Devices { talk, .. }
            | Self::Settings { talk, .. }
            | Self::List { talk, .. } => talk.console(),
            Self::ExportPov(args) => args.talk.console(),
            Self::ExportGltf(args) => args.talk.console(),
        }
    }
}

/// The program.
pub fn main() -> ExitCode {
    let command = help::parse::<Arguments>().command;
    let console = command.console();
    program::run(console, || run(command, console))
}

fn run(command: Command, console: Console) -> Result<ExitCode> {
    match command {
        // Commands that choose their exit code themselves.
        Command::Render(args) => return args.run(),
        Command::View(args) => return view::run(*args),
        Command::Run(args) => return args.run(),
        Command::Reproduce(args) => return experiment::reproduce(&args, console),
        Command::Compare(mut args) => {
            args.tests = listed::expanded(&args.tests)?;
            return compare::run(&args, console);
        }
        Command::Tonemap(args) => return super::tonemap::run(*args, console),
        Command::Reference(args) => return reference::run(&args, console),
        Command::Rerun(args) => return rerun::run(&args, console),
        Command::Bake(command) => return command.run(),
        Command::Merge(args) => return bake::join(&args, console),
        Command::Inspect { scene, json, .. } => {
            let (scene, _) = scene.open()?;
            let summary = inspect::summary(&scene);
            match json {
                true => console::print_json(&console::to_json(&summary)?),
                false => console::print(&summary.text()),
            }?;
        }
        Command::Info { images, json, .. } => info::run(&images, json)?,
        Command::ExportPov(args) => export_pov::run(&args)?,
        Command::ExportGltf(args) => export_gltf::run(&args)?,
        Command::Devices { require_gpu, json, .. } => {
            let list = devices::list(require_gpu)?;
            match json {
                true => console::print_json(&devices::json(&list)),
                false => console::print(&devices::text(&list)),
            }?;
        }
        Command::Settings { technique, json, form, .. } => {
            let form = if json { settings_list::Form::Json } else { form };
            settings_list::print(technique.as_deref(), form)?;
        }
        Command::Completions { shell } => pages::completions(shell)?,
        Command::Man { folder, overwrite, .. } => pages::man(&folder, overwrite, console)?,
        Command::Views(args) => views::command::run(&args, console)?,
        Command::Report(args) => experiment::report(&args, console)?,
        Command::List { json, .. } => {
            let all = builtin::NAMES.iter().chain(builtin::THINGS);
            let list: Vec<(&str, &str)> =
                all.map(|&name| (name, builtin::description(name).unwrap_or_default())).collect();
            if json {
                let kind = |name: &str| if builtin::THINGS.contains(&name) { "thing" } else { "scene" };
                let entry = |(name, text): &(&str, &str)| serde_json::json!({ "name": name, "kind": kind(name), "description": text });
                console::print_json(&list.iter().map(entry).collect())?;
                return Ok(ExitCode::SUCCESS);
            }
            let width = list.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
            let lines: Vec<String> = list.iter().map(|(name, text)| format!("{name:width$}  {text}")).collect();
            console::print(&lines.join("\n"))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}
