//! `lucerna`: what is in a scene or an image, which devices there are, the same picture once more.

use std::{path::PathBuf, process::ExitCode};

use clap::{Parser, Subcommand};
use lucerna::Result;
use lucerna_samples::{
    args::TalkArgs,
    bake::{self, BakeCommand, JoinArgs},
    compare::{self, CompareArgs},
    console::{self, Console},
    devices,
    experiment::command::{self as experiment, ReportArgs, ReproduceArgs},
    export_gltf::{self, ExportGltfArgs},
    export_pov::{self, ExportPovArgs},
    info, inspect, program,
    reference::{self, ReferenceArgs},
    rerun::{self, RerunArgs},
    settings_list,
    source::SceneArgs,
    tonemap::{self, TonemapArgs},
    views::{self, command::ViewsArgs},
};
use lucerna_scenes as builtin;

/// Looks into scenes and images, lists devices and built-in scenes, makes pictures again.
#[derive(Parser, Debug)]
#[command(name = "lucerna", version, max_term_width = 120)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Say what is in a scene, and what of it is not supported
    Inspect {
        #[command(flatten)]
        scene: SceneArgs,
        #[command(flatten)]
        talk: TalkArgs,
        /// Print one JSON document
        #[arg(long)]
        json: bool,
    },
    /// Say what is in an image and how it was made
    Info {
        /// .exr, .png, .hdr, .pfm or .jpg
        image: PathBuf,
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
    /// Look into the units of a long computation, and spread one over machines
    #[command(subcommand)]
    Bake(BakeCommand),
    /// Join what shards of a long computation have computed, into one folder or into the file that it is for
    Merge(JoinArgs),
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

fn main() -> ExitCode {
    let command = Arguments::parse().command;
    let console = command.console();
    program::run(console, || match &command {
        // Those that choose their exit code themselves.
        Command::Reproduce(args) => experiment::reproduce(args, console),
        Command::Compare(args) => compare::run(args, console),
        Command::Tonemap(args) => tonemap::run(args, console),
        Command::Reference(args) => reference::run(args, console),
        Command::Rerun(args) => rerun::run(args, console),
        Command::Bake(command) => command.run(),
        Command::Merge(args) => bake::join(args, console),
        _ => serve(command, console).map(|()| ExitCode::SUCCESS),
    })
}

fn serve(command: Command, console: Console) -> Result<()> {
    match command {
        Command::Inspect { scene, json, .. } => {
            let (scene, _) = scene.open()?;
            let summary = inspect::summary(&scene);
            match json {
                true => console::print_json(&console::to_json(&summary)?),
                false => console::print(&summary.text()),
            }
        }
        Command::Info { image, json, .. } => {
            let layers = info::read(&image)?;
            match json {
                true => console::print_json(&info::json(&layers)),
                false => console::print(&info::text(&image, &layers)),
            }
        }
        Command::ExportPov(args) => export_pov::run(&args),
        Command::ExportGltf(args) => export_gltf::run(&args),
        Command::Devices { require_gpu, json, .. } => {
            let list = devices::list(require_gpu)?;
            match json {
                true => console::print_json(&devices::json(&list)),
                false => console::print(&devices::text(&list)),
            }
        }
        Command::Settings { technique, json, form, .. } => {
            let form = if json { settings_list::Form::Json } else { form };
            settings_list::print(technique.as_deref(), form)
        }
        Command::Compare(args) => compare::run(&args, console).map(drop),
        Command::Tonemap(args) => tonemap::run(&args, console).map(drop),
        Command::Reference(args) => reference::run(&args, console).map(drop),
        Command::Rerun(args) => rerun::run(&args, console).map(drop),
        Command::Bake(command) => command.run().map(drop),
        Command::Merge(args) => bake::join(&args, console).map(drop),
        Command::Views(args) => views::command::run(&args, console),
        // It chooses its exit code itself.
        Command::Reproduce(args) => experiment::reproduce(&args, console).map(|_| ()),
        Command::Report(args) => experiment::report(&args, console),
        Command::List { json, .. } => {
            let all = builtin::NAMES.iter().chain(builtin::THINGS);
            let list: Vec<(&str, &str)> =
                all.map(|&name| (name, builtin::description(name).unwrap_or_default())).collect();
            if json {
                let kind = |name: &str| if builtin::THINGS.contains(&name) { "thing" } else { "scene" };
                let entry = |(name, text): &(&str, &str)| serde_json::json!({ "name": name, "kind": kind(name), "description": text });
                return console::print_json(&list.iter().map(entry).collect());
            }
            let width = list.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
            let lines: Vec<String> = list.iter().map(|(name, text)| format!("{name:width$}  {text}")).collect();
            console::print(&lines.join("\n"))
        }
    }
}
