//! The programs: their command lines, and what they do with them. The executables call `main` and nothing else.

pub mod daylight;
pub mod door;
pub mod fiv;
pub mod help;
pub mod igi;
pub mod isr;
pub mod lucerna;
mod pages;
pub mod prt;
pub mod suited;
pub mod tonemap;

use clap::{Command, CommandFactory};

/// The command lines of all programs.
fn all() -> Vec<Command> {
    let all = [
        lucerna::Arguments::command(),
        isr::Arguments::command(),
        igi::Arguments::command(),
        fiv::Arguments::command(),
        daylight::Arguments::command(),
        prt::Arguments::command(),
        tonemap::Arguments::command(),
    ];
    all.into_iter().map(help::arranged).collect()
}

/// Names of the programs that render a scene, which are the techniques of `lucerna render`, too.
pub const TECHNIQUES: [&str; 6] = ["isr", "igi", "fiv", "daylight", "prt", "reference"];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_line_is_sound() {
        all().into_iter().for_each(Command::debug_assert);
    }

    #[test]
    fn the_short_help_of_the_viewer_is_short() {
        let mut program = all().into_iter().find(|program| program.get_name() == "lucerna").unwrap().term_width(100);
        program.build();
        let short = program.find_subcommand_mut("view").unwrap().render_help().to_string();
        assert!(short.lines().count() <= 60 && short.contains("--against"), "{} lines\n{short}", short.lines().count());
    }

    #[test]
    fn the_short_help_of_a_render_is_short_and_its_parts_are_in_order() {
        for name in ["isr", "igi", "fiv", "daylight", "prt"] {
            let mut program = all().into_iter().find(|program| program.get_name() == name).unwrap().term_width(100);
            program.build();
            let render = program.find_subcommand_mut("render").unwrap();
            let short = render.render_help().to_string();
            assert!(short.lines().count() <= 60, "{name}: {} lines\n{short}", short.lines().count());
            let long = render.render_long_help().to_string();
            let places: Vec<usize> = [
                "\nOutput:",
                "\nPicture:",
                "\nTechnique:",
                "\nSettings:",
                "\nDevice:",
                "\nMessages:",
                "\nGround:",
                "\nExit codes:",
            ]
            .iter()
            .filter_map(|part| long.find(part))
            .collect();
            assert!(places.len() >= 7 && places.is_sorted(), "{name}: {places:?}\n{long}");
        }
    }
}
