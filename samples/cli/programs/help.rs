//! The help of the programs: the order of its parts, the short form (`-h`), exit codes.

use std::process;

use clap::{Arg, Command, Parser};

use super::door;
use crate::console::Console;

/// The parts of a help text, in their order. Parts that are not named here are between those of the technique and the settings.
const ORDER: [&str; 7] = ["Output", "Picture", "Technique", "Settings", "Device", "Messages", "Ground"];
/// Place of the parts that are not named, in [`ORDER`].
const OTHERS: usize = 3;

/// Options of `render` and `view` in the short help, with their short texts.
const SHORT: &[(&str, &str)] = &[
    ("scene", "Scene file: .gltf, .glb or .obj"),
    ("builtin", "A built-in scene (`lucerna list`)"),
    ("output", "Image to write: .exr (all layers), .png, .jpg, .hdr, .pfm"),
    ("overwrite", "Overwrite existing images"),
    ("json", "Print one JSON document about the run"),
    ("size", "Width and height in pixels"),
    ("camera", "Camera of the scene, or a .toml file"),
    ("environment", "Light from around: .hdr, .exr, or a built-in one"),
    ("light", "Add a point light: metres, W/sr"),
    ("exposure", "Multiply colours by 2^EV"),
    ("frames", "Render frames A to B-1"),
    ("aa", "Smooth edges: the mean of N pictures; edges: one picture"),
    ("preset", "Settings preset: fast, balanced or best"),
    ("mode", "What the picture shows (--help lists all)"),
    ("bake", "File of `bake`"),
    ("vectors", "File of `fiv precompute`"),
    ("full", "Compute all vectors"),
    ("clock", "Local time of the first frame"),
    ("technique", "Technique of side A (default: the one that suits the scene)"),
    ("compare", "How A and the path tracer are shown: one, split, …"),
    ("against", "Picture file beside A"),
    ("window", "Size of the window in points"),
    ("spp", "Paths per pixel of the path tracer"),
    ("define", "Set one setting (`lucerna settings` lists all)"),
    ("print_config", "Print the settings in effect, then stop"),
    ("paper", "Use the paper's settings as defaults"),
    ("device", "Device by index or name (`lucerna devices`)"),
    ("verbose", "Print more messages"),
    ("quiet", "Print only warnings and errors"),
    ("ground", "Put the scene on a plain ground"),
];

/// The exit codes, at the end of every help.
const EXIT_CODES: &str = "Exit codes: 0 success; 1 failure; 2 wrong usage; 3 input unreadable or not supported;
  4 no suitable device; 5 out of memory; 6 device lost; 7 comparison over its threshold;
  8 stopped early, with complete output; 130, 143 stopped before any output";

/// Reads the command line of a program. Prints help or an error and ends the process where clap does.
pub fn parse<T: Parser>() -> T {
    let mut command = arranged(T::command());
    let words = door::meant(&command, std::env::args_os().collect()).unwrap_or_else(|error| {
        Console::new(false, 0).error(&error);
        process::exit(error.exit_code().into())
    });
    let mut matches = command.clone().get_matches_from(words);
    T::from_arg_matches_mut(&mut matches).unwrap_or_else(|error| error.format(&mut command).exit())
}

/// A command whose help has its parts in order, a short form for `render`, and exit codes at its end; its subcommands too.
pub fn arranged(command: Command) -> Command {
    let name = command.get_name().to_owned();
    part(command, &name)
}

/// The same for a command that is called as `path`.
fn part(command: Command, path: &str) -> Command {
    let mut sorted: Vec<Arg> = command.get_arguments().cloned().collect();
    // The sort is stable: options of one part keep their order.
    sorted.sort_by_key(rank);
    let has = |id: &str| sorted.iter().any(|arg| arg.get_id() == id);
    let (renders, views, needs_bake) = (has("scene") && has("list_passes"), has("against"), has("bake"));
    let mut sorted = sorted.into_iter();
    // As many go in as come out.
    let mut command = command.mut_args(|arg| sorted.next().unwrap_or(arg));
    if renders || views {
        command = command.mut_args(shortened);
    }
    if command.get_after_help().is_none() {
        let examples = match (renders, views) {
            (true, _) => examples(path, needs_bake),
            (false, true) => format!("Examples:\n  {path} model.glb\n  {path} --builtin parlour --compare split\n\n"),
            (false, false) => String::new(),
        };
        command = command.after_help(format!("{examples}{EXIT_CODES}"));
    }
    let names: Vec<String> = command.get_subcommands().map(|sub| sub.get_name().to_owned()).collect();
    names.into_iter().fold(command, |command, name| {
        let path = format!("{path} {name}");
        command.mut_subcommand(name, |sub| part(sub, &path))
    })
}

fn rank(arg: &Arg) -> usize {
    let Some(heading) = arg.get_help_heading() else { return 0 };
    // Twice, so that other parts have a place between two named ones.
    ORDER.iter().position(|known| *known == heading).map_or(2 * OTHERS, |place| 2 * place + 1)
}

fn shortened(arg: Arg) -> Arg {
    let Some((_, text)) = SHORT.iter().find(|(id, _)| arg.get_id() == id) else { return arg.hide_short_help(true) };
    match arg.get_long_help().or(arg.get_help()).cloned() {
        Some(long) => arg.help(*text).long_help(long),
        None => arg.help(*text),
    }
}

fn examples(path: &str, needs_bake: bool) -> String {
    let bake = if needs_bake { " --bake FILE" } else { "" };
    format!("Examples:\n  {path} model.glb{bake} -o a.png\n  {path} --builtin office{bake} --size 800x600 -o a.exr\n\n")
}
