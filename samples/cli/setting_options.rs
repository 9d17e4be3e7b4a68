//! Options of their own for settings: `--white 4` for `-D tonemap.white=4`. They are made from the description of the settings, where
//! `x-option` marks a key.

use std::marker::PhantomData;

use clap::{
    Arg, ArgMatches, Command,
    builder::{PossibleValue, PossibleValuesParser, ValueParser},
};
use lucerna::settings::{Choice, Described, Key, Kind};

use crate::args::finite;

/// The options of the settings `S`, with the values that were given.
#[derive(Debug)]
pub struct SettingOptions<S> {
    /// Keys and values in the form of `-D`, without the group.
    given: Vec<String>,
    settings: PhantomData<S>,
}

impl<S> Clone for SettingOptions<S> {
    fn clone(&self) -> Self {
        Self { given: self.given.clone(), settings: PhantomData }
    }
}

impl<S> Default for SettingOptions<S> {
    fn default() -> Self {
        Self { given: Vec::new(), settings: PhantomData }
    }
}

impl<S> SettingOptions<S> {
    /// The given options as texts of `-D`.
    pub fn defines(&self, group: &str) -> Vec<String> {
        self.given.iter().map(|given| format!("{group}.{given}")).collect()
    }
}

fn name(key: &Key) -> String {
    key.name.replace('_', "-")
}

/// The first paragraph, in one line.
fn paragraph(doc: &str) -> String {
    doc.split("\n\n").next().unwrap_or_default().replace('\n', " ")
}

fn option(key: &'static Key, heading: &'static str) -> Arg {
    let parser: ValueParser = match &key.kind {
        Kind::Choice(choices) => {
            // Docs that are formulas do not fit into a help text.
            let short = choices.iter().all(|choice| paragraph(&choice.doc).len() < 150);
            let value = |choice: &Choice| {
                let value = PossibleValue::new(choice.name.clone());
                if short { value.help(paragraph(&choice.doc)) } else { value }
            };
            PossibleValuesParser::new(choices.iter().map(value)).into()
        }
        Kind::Switch => PossibleValuesParser::new(["true", "false"]).into(),
        Kind::Whole => clap::value_parser!(u32).into(),
        Kind::Number => ValueParser::new(finite),
        Kind::Clock | Kind::Text => ValueParser::string(),
    };
    let help = paragraph(&key.doc);
    let help = match &key.default {
        serde_json::Value::Null => help,
        serde_json::Value::String(default) => format!("{help} [default: {default}]"),
        default => format!("{help} [default: {default}]"),
    };
    let value = key.name.to_uppercase();
    let names_value = !matches!(key.kind, Kind::Choice(_) | Kind::Switch);
    let arg = Arg::new(key.name.as_str()).long(name(key)).value_parser(parser).help(help).help_heading(heading);
    let arg = arg.allow_negative_numbers(true);
    if names_value { arg.value_name(value) } else { arg }
}

impl<S: Described + 'static> clap::Args for SettingOptions<S> {
    fn augment_args(command: Command) -> Command {
        let keys = S::description().keys.iter();
        keys.filter_map(|key| Some(option(key, key.option.as_deref()?))).fold(command, Command::arg)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<S: Described + 'static> clap::FromArgMatches for SettingOptions<S> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let given = S::description().keys.iter().filter(|key| key.option.is_some()).filter_map(|key| {
            // Numbers are written as settings have them: options also allow `.5` and `08`.
            let value = match &key.kind {
                Kind::Whole => matches.get_one::<u32>(&key.name)?.to_string(),
                Kind::Number => format!("{:?}", matches.get_one::<f64>(&key.name)?),
                _ => matches.get_one::<String>(&key.name)?.clone(),
            };
            Some(format!("{}={value}", key.name))
        });
        Ok(Self { given: given.collect(), settings: PhantomData })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use lucerna::techniques::tonemap::Settings;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        look: SettingOptions<Settings>,
    }

    #[test]
    fn options_are_definitions_and_wrong_values_are_refused() {
        let given = |words: &[&str]| {
            let line = Line::try_parse_from(["line"].iter().chain(words));
            line.map(|line| line.look.defines("tonemap"))
        };
        assert_eq!(given(&[]).unwrap(), [""; 0]);
        assert_eq!(
            given(&["--white", "-4.5", "--operator", "reinhard", "--bad-values=error"]).unwrap(),
            ["tonemap.operator=reinhard", "tonemap.white=-4.5", "tonemap.bad_values=error"]
        );
        assert_eq!(given(&["--key", ".18", "--detail", "2."]).unwrap(), ["tonemap.key=0.18", "tonemap.detail=2.0"]);
        for wrong in [&["--white", "nan"][..], &["--white", "x"], &["--operator", "gamma"], &["--radius", "3"]] {
            assert!(given(wrong).is_err(), "{wrong:?}");
        }
    }
}
