//! The options that all commands have that bake a file.

use std::path::PathBuf;

use lucerna::Result;
use serde::{Serialize, de::DeserializeOwned};

use super::UnitsArgs;
use crate::{
    args::{DeviceArgs, TalkArgs},
    config::{self, SettingsArgs},
    console,
    progress::ProgressMode,
    settings_list,
};

/// Output, units, settings, device and messages of a command that bakes a file.
#[derive(clap::Args, Clone, Debug)]
pub struct BakeArgs {
    /// File to write
    // A command that only prints its settings writes no file.
    #[arg(
        short,
        long,
        value_name = "FILE",
        required = false,
        required_unless_present = "print_config",
        default_value_if("print_config", "true", "unused"),
        help_heading = "Output"
    )]
    pub output: PathBuf,

    /// Replace the file if it exists
    #[arg(long, help_heading = "Output")]
    pub overwrite: bool,

    /// Print one JSON document about the run on stdout
    #[arg(long, help_heading = "Output")]
    pub json: bool,

    #[command(flatten)]
    pub units: UnitsArgs,

    #[command(flatten)]
    pub settings: SettingsArgs,

    #[command(flatten)]
    pub device: DeviceArgs,

    #[command(flatten)]
    pub talk: TalkArgs,

    /// How progress is shown on stderr
    #[arg(long, value_enum, default_value_t, value_name = "HOW", help_heading = "Messages")]
    pub progress: ProgressMode,
}

impl BakeArgs {
    /// The settings in effect. `None`: the command is to print them, and has printed them.
    ///
    /// # Errors
    /// The errors of `validate`, which name the settings file if its settings are the cause.
    pub fn keys<K: Serialize + DeserializeOwned>(
        &self,
        base: &K,
        validate: impl Fn(&K) -> Result<()>,
    ) -> Result<Option<K>> {
        let keys = self.settings.effective(base)?;
        self.settings.blamed(validate(&keys), || validate(&self.settings.file_alone().effective(base)?))?;
        if self.settings.print_config {
            console::print(settings_list::with_docs(&config::to_toml(&keys)?).trim_end())?;
            return Ok(None);
        }
        Ok(Some(keys))
    }
}
