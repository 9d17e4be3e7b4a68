//! `lucerna devices`, and the choice of a device.

use lucerna::{
    Error, Result,
    gpu::{self, DeviceKind, GpuOptions, Listed},
};
use serde_json::{Value, json};

use crate::{args::DeviceArgs, signals::Interrupt};

impl DeviceArgs {
    /// The options from environment variables, overridden by the command line.
    pub fn options(&self) -> Result<GpuOptions> {
        let mut options = GpuOptions::from_env()?;
        if let Some(device) = &self.device {
            options.device = device.parse().map_err(|error: Error| error.at("--device"))?;
        }
        options.require_gpu |= self.require_gpu;
        if let Some(choice) = &self.ray_query {
            options.ray_query = choice.parse().map_err(|error: Error| error.at("--ray-query"))?;
        }
        options.stop = Some(Interrupt::stop());
        Ok(options)
    }
}

/// A list of all devices, one line each, with the features that unsuitable devices lack.
pub fn text(list: &[Listed]) -> String {
    let mut lines = Vec::new();
    for (index, device) in list.iter().enumerate() {
        let d = &device.description;
        lines.push(format!(
            "{index} {} ({}), {} {}, Vulkan {}",
            d.device, d.kind, d.driver, d.driver_info, d.api_version
        ));
        if !device.missing.is_empty() {
            lines.push(format!("  cannot be used, it lacks {}", device.missing.join(", ")));
        }
    }
    lines.join("\n")
}

/// The same as JSON.
pub fn json(list: &[Listed]) -> Value {
    let device = |(index, device): (usize, &Listed)| {
        let d = &device.description;
        json!({
            "index": index, "device": d.device, "kind": d.kind.to_string(), "driver": d.driver,
            "driver_info": d.driver_info, "api_version": d.api_version,
            "usable": device.missing.is_empty(), "missing": device.missing,
            "ray_query": device.facts.lacks_of_ray_query().is_empty(),
        })
    };
    Value::Array(list.iter().enumerate().map(device).collect())
}

/// All devices; with `require_gpu` an error unless one of them is a usable GPU.
pub fn list(require_gpu: bool) -> Result<Vec<Listed>> {
    let list = gpu::list_devices()?;
    let is_gpu = |d: &Listed| d.missing.is_empty() && d.description.kind != DeviceKind::Cpu;
    if require_gpu && !list.iter().any(is_gpu) {
        return Err(Error::new(lucerna::ErrorKind::NoDevice, "no usable GPU among the devices")
            .help("`lucerna devices` lists the devices and the features that they lack"));
    }
    Ok(list)
}
