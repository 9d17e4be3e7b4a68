//! What a caller asks of [`super::Gpu::new`], from code, the command line or the environment.

use std::{str::FromStr, time::Duration};

use crate::{Error, Result, Stop};

/// Which device to open.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The first suitable one, in the order discrete, integrated, virtual, other, CPU.
    #[default]
    Auto,
    /// The position in [`super::list_devices`].
    Index(usize),
    /// The first suitable one whose name or UUID contains this text, ignoring case.
    Name(String),
    /// A CPU driver (lavapipe, SwiftShader).
    Cpu,
}

impl FromStr for DeviceChoice {
    type Err = Error;

    /// `auto`, `cpu`, a number (position in the list of devices), or part of a device name or UUID.
    fn from_str(text: &str) -> Result<Self> {
        let text = text.trim();
        Ok(match text.to_ascii_lowercase().as_str() {
            "" => {
                return Err(
                    Error::usage("an empty device choice").help("Write auto, cpu, an index, or part of a name or UUID")
                );
            }
            "auto" => Self::Auto,
            "cpu" => Self::Cpu,
            lower => match lower.parse() {
                Ok(index) => Self::Index(index),
                Err(_) => Self::Name(text.to_owned()),
            },
        })
    }
}

/// How much the Khronos validation layer checks. Everything but `Off` needs the layer; without it a warning is logged,
/// and [`super::Gpu::validation_active`] is false.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Validation {
    /// No layer. Costs nothing.
    #[default]
    Off,
    /// Correct use of the interface.
    Core,
    /// `Core`, and missing barriers, also between shader accesses and (as far as the layer can) between submits.
    Sync,
    /// `Core`, and shaders instrumented for accesses out of bounds. Slow.
    GpuAssisted,
}

impl FromStr for Validation {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text.trim().to_ascii_lowercase().as_str() {
            "off" | "0" => Ok(Self::Off),
            "core" | "1" => Ok(Self::Core),
            "sync" => Ok(Self::Sync),
            "gpu" | "gpu-assisted" => Ok(Self::GpuAssisted),
            other => Err(Error::usage(format!("validation `{other}` is not known"))
                .help("Allowed are off, core, sync and gpu-assisted")),
        }
    }
}

/// Whether shaders may trace by hardware ray queries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RayQuery {
    /// Where the device has them, and is no CPU driver: those emulate them, slower than our own traversal.
    #[default]
    Auto,
    /// On every device, CPU drivers too; refuse devices without them.
    On,
    /// Never: rays are traced in compute on every device.
    Off,
}

impl FromStr for RayQuery {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text.trim().to_ascii_lowercase().as_str() {
            "auto" => Ok(Self::Auto),
            "on" | "1" => Ok(Self::On),
            "off" | "0" => Ok(Self::Off),
            other => {
                Err(Error::usage(format!("ray query `{other}` is not known")).help("Allowed are auto, on and off"))
            }
        }
    }
}

/// How traversals of trees in compute choose the next node (`lib/trace_order.glsl`). Both ways find the same hits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Traversal {
    /// Ordered on CPU drivers, where it is faster; grouped on GPUs, where it has not been measured.
    #[default]
    Auto,
    /// Nodes sorted by the time at which the ray enters them; the top of the stack is in registers.
    Ordered,
    /// Groups of slots in the order of the ray's octant; a stack of one word a level.
    Grouped,
}

impl FromStr for Traversal {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text.trim().to_ascii_lowercase().as_str() {
            "auto" => Ok(Self::Auto),
            "ordered" => Ok(Self::Ordered),
            "grouped" => Ok(Self::Grouped),
            other => {
                Err(Error::usage(format!("traversal `{other}` is not known"))
                    .help("Allowed are auto, ordered and grouped"))
            }
        }
    }
}

/// How to open a device.
#[derive(Clone, Debug)]
pub struct GpuOptions {
    pub device: DeviceChoice,
    /// Refuse CPU drivers.
    pub require_gpu: bool,
    pub validation: Validation,
    pub ray_query: RayQuery,
    pub traversal: Traversal,
    /// Log validation messages as warnings as they come (at most ten of one kind).
    pub print_messages: bool,
    /// After this time a wait logs a warning that names the pass in flight, once per doubling.
    pub soft_limit: Duration,
    /// After this time a wait gives up and the device counts as lost. `None`: ten minutes on CPU drivers, one minute else.
    pub hard_limit: Option<Duration>,
    /// Fill every new buffer and image with `0x7FC0DEAD` (a NaN), so that reads of uninitialised memory show. For tests.
    pub poison: bool,
    /// Asks everything that this device does to stop; none: waits are not cut into slices to look for it.
    pub stop: Option<Stop>,
    /// Instance extensions that a window needs, as its library lists them. Not empty: the device also gets
    /// `VK_KHR_swapchain`.
    pub window_extensions: Vec<String>,
}

impl Default for GpuOptions {
    fn default() -> Self {
        Self {
            device: DeviceChoice::Auto,
            require_gpu: false,
            validation: Validation::Off,
            ray_query: RayQuery::Auto,
            traversal: Traversal::Auto,
            print_messages: true,
            soft_limit: Duration::from_secs(10),
            hard_limit: None,
            poison: false,
            stop: None,
            window_extensions: Vec::new(),
        }
    }
}

/// The variables that [`GpuOptions::from_env`] reads, with their meaning; for `--help` and documentation.
pub const ENVIRONMENT: [(&str, &str); 7] = [
    ("LUCERNA_DEVICE", "auto, cpu, an index, or part of a device name or UUID"),
    ("LUCERNA_REQUIRE_GPU", "1: refuse CPU drivers"),
    ("LUCERNA_VALIDATION", "off, core, sync or gpu-assisted"),
    ("LUCERNA_RAY_QUERY", "auto (GPUs that have it), on (CPU drivers too; refuse devices without) or off"),
    (
        "LUCERNA_TRAVERSAL",
        "auto (ordered on CPU drivers), ordered or grouped: how rays in compute choose the next node",
    ),
    ("LUCERNA_WAIT_LIMIT", "seconds after which a wait for the device gives up"),
    ("LUCERNA_POISON", "1: fill new device memory with NaN"),
];

impl GpuOptions {
    /// The defaults, changed by the variables of [`ENVIRONMENT`].
    ///
    /// # Errors
    /// `Usage`, naming the variable, if one of them has a value that is not allowed.
    pub fn from_env() -> Result<Self> {
        Self::from_variables(|name| std::env::var(name).ok().filter(|value| !value.is_empty()))
    }

    fn from_variables(variable: impl Fn(&str) -> Option<String>) -> Result<Self> {
        let mut options = Self::default();
        if let Some(value) = variable("LUCERNA_DEVICE") {
            options.device = value.parse().map_err(|e: Error| e.at("LUCERNA_DEVICE"))?;
        }
        if let Some(value) = variable("LUCERNA_REQUIRE_GPU") {
            options.require_gpu = switch(&value).map_err(|e| e.at("LUCERNA_REQUIRE_GPU"))?;
        }
        if let Some(value) = variable("LUCERNA_VALIDATION") {
            options.validation = value.parse().map_err(|e: Error| e.at("LUCERNA_VALIDATION"))?;
        }
        if let Some(value) = variable("LUCERNA_RAY_QUERY") {
            options.ray_query = value.parse().map_err(|e: Error| e.at("LUCERNA_RAY_QUERY"))?;
        }
        if let Some(value) = variable("LUCERNA_TRAVERSAL") {
            options.traversal = value.parse().map_err(|e: Error| e.at("LUCERNA_TRAVERSAL"))?;
        }
        if let Some(value) = variable("LUCERNA_WAIT_LIMIT") {
            options.hard_limit = Some(seconds(&value).map_err(|e| e.at("LUCERNA_WAIT_LIMIT"))?);
        }
        if let Some(value) = variable("LUCERNA_POISON") {
            options.poison = switch(&value).map_err(|e| e.at("LUCERNA_POISON"))?;
        }
        Ok(options)
    }
}

fn switch(value: &str) -> Result<bool> {
    match value.trim() {
        "0" | "false" | "off" => Ok(false),
        "1" | "true" | "on" => Ok(true),
        other => Err(Error::usage(format!("`{other}` is neither 0 nor 1"))),
    }
}

fn seconds(value: &str) -> Result<Duration> {
    let wrong = || Error::usage(format!("`{value}` is not a positive number of seconds"));
    let number: f64 = value.trim().parse().map_err(|_| wrong())?;
    Duration::try_from_secs_f64(number).ok().filter(|limit| !limit.is_zero()).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn device_choices_are_read() {
        assert_eq!("auto".parse::<DeviceChoice>().unwrap(), DeviceChoice::Auto);
        assert_eq!("CPU".parse::<DeviceChoice>().unwrap(), DeviceChoice::Cpu);
        assert_eq!("2".parse::<DeviceChoice>().unwrap(), DeviceChoice::Index(2));
        assert_eq!("H200".parse::<DeviceChoice>().unwrap(), DeviceChoice::Name("H200".into()));
        assert!("".parse::<DeviceChoice>().is_err());
    }

    #[test]
    fn a_wrong_variable_is_named() {
        for (name, bad) in [
            ("LUCERNA_REQUIRE_GPU", "maybe"),
            ("LUCERNA_VALIDATION", "loud"),
            ("LUCERNA_RAY_QUERY", "maybe"),
            ("LUCERNA_TRAVERSAL", "fast"),
            ("LUCERNA_WAIT_LIMIT", "-1"),
            ("LUCERNA_WAIT_LIMIT", "1e300"),
            ("LUCERNA_POISON", "2"),
        ] {
            let error = GpuOptions::from_variables(|n| (n == name).then(|| bad.to_owned())).unwrap_err();
            assert_eq!(error.exit_code(), 2);
            assert!(error.to_string().contains(name), "{error}");
        }
        let options = GpuOptions::from_variables(|n| (n == "LUCERNA_WAIT_LIMIT").then(|| "2.5".to_owned())).unwrap();
        assert_eq!(options.hard_limit, Some(Duration::from_millis(2500)));
    }
}
