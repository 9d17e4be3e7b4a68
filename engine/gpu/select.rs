//! Device choice as a pure function over facts, so that it is tested without a driver.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
};

use super::options::DeviceChoice;
use crate::{Error, ErrorKind};

/// What sort of device it is, in the order in which [`DeviceChoice::Auto`] prefers them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    Discrete,
    Integrated,
    Virtual,
    Other,
    Cpu,
}

impl fmt::Display for DeviceKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Discrete => "discrete GPU",
            Self::Integrated => "integrated GPU",
            Self::Virtual => "virtual GPU",
            Self::Other => "other device",
            Self::Cpu => "CPU",
        })
    }
}

/// A Vulkan version as (major, minor, patch).
pub type Version = (u32, u32, u32);

/// Everything that device choice looks at.
#[derive(Clone, Debug)]
pub struct DeviceFacts {
    /// As the driver calls it.
    pub name: String,
    pub kind: DeviceKind,
    /// Hexadecimal digits in lower case, in groups as usual: `6d657361-3235-2e30-2e37-2d3200000000`. Stays the same from run
    /// to run; tells two devices of the same name apart.
    pub uuid: String,
    pub api_version: Version,
    pub driver_name: String,
    /// Version text of the driver, as free as drivers write it.
    pub driver_info: String,
    /// Names of the core features it has, in the spelling of the specification.
    pub features: BTreeSet<&'static str>,
    pub extensions: BTreeSet<String>,
    /// Limits by their names in the specification.
    pub limits: BTreeMap<&'static str, u64>,
    /// Uses of formats it has, as `FORMAT use`.
    pub formats: BTreeSet<String>,
    /// It has a queue that draws, computes and copies.
    pub has_queue: bool,
}

impl DeviceFacts {
    /// `part`, ignoring case, is part of the name or of the UUID.
    pub fn is_called(&self, part: &str) -> bool {
        let part = part.to_lowercase();
        self.name.to_lowercase().contains(&part) || self.uuid.contains(&part)
    }
}

/// Extensions and features that ray queries take.
const RAY_QUERY: ([&str; 3], [&str; 2]) = (
    ["VK_KHR_acceleration_structure", "VK_KHR_deferred_host_operations", "VK_KHR_ray_query"],
    ["accelerationStructure", "rayQuery"],
);

impl DeviceFacts {
    /// What it lacks of what ray queries take; empty: it has them.
    pub fn lacks_of_ray_query(&self) -> Vec<String> {
        let (extensions, features) = RAY_QUERY;
        let lacking = extensions.iter().filter(|e| !self.extensions.contains(**e)).map(|e| format!("lacks {e}"));
        lacking
            .chain(features.iter().filter(|f| !self.features.contains(*f)).map(|f| format!("lacks feature {f}")))
            .collect()
    }
}

/// What a device must have.
#[derive(Clone, Debug)]
pub struct Requirements {
    pub api_version: Version,
    pub features: Vec<&'static str>,
    pub extensions: Vec<&'static str>,
    /// Smallest value of each limit.
    pub limits: Vec<(&'static str, u64)>,
    pub formats: Vec<&'static str>,
}

impl Requirements {
    /// The same, and ray queries.
    #[must_use]
    pub fn and_ray_query(mut self) -> Self {
        self.extensions.extend(RAY_QUERY.0);
        self.features.extend(RAY_QUERY.1);
        self
    }

    /// What all of the engine needs.
    pub fn baseline() -> Self {
        Self {
            api_version: (1, 3, 0),
            features: vec![
                "dynamicRendering",
                "synchronization2",
                "maintenance4",
                "scalarBlockLayout",
                "bufferDeviceAddress",
                "independentBlend",
                "fragmentStoresAndAtomics",
                "subgroupBallot",
            ],
            extensions: Vec::new(),
            limits: vec![
                ("maxImageDimension2D", 4096),
                ("maxImageArrayLayers", 256),
                ("maxPushConstantsSize", 128),
                ("maxColorAttachments", 4),
                ("maxStorageBufferRange", 1 << 27),
                ("maxPerStageDescriptorStorageBuffers", 8),
                ("maxPerStageDescriptorSampledImages", 16),
                ("maxPerStageDescriptorStorageImages", 4),
                ("maxComputeWorkGroupInvocations", 128),
                ("maxComputeSharedMemorySize", 16 << 10),
            ],
            formats: vec![
                "R32G32B32A32_SFLOAT sampled",
                "R32G32B32A32_SFLOAT storage",
                "R32G32B32A32_SFLOAT color",
                "R16G16B16A16_SFLOAT color",
                "D32_SFLOAT depth",
                "D32_SFLOAT sampled",
            ],
        }
    }
}

/// Why a device was not taken.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rejection {
    /// `2: llvmpipe (CPU)`
    pub device: String,
    /// One line for each missing item; never empty.
    pub missing: Vec<String>,
}

/// The device to take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Index into the facts.
    pub index: usize,
}

/// Takes the best device that `choice` allows and that meets `needs`; ties go to the first listed.
///
/// # Errors
/// One [`Rejection`] for each device, in order, with everything that it lacks.
pub fn select(
    devices: &[DeviceFacts],
    needs: &Requirements,
    choice: &DeviceChoice,
    require_gpu: bool,
) -> Result<Choice, Vec<Rejection>> {
    let rejections: Vec<Rejection> = devices
        .iter()
        .enumerate()
        .map(|(index, device)| Rejection {
            device: format!("{index}: {} ({})", device.name, device.kind),
            missing: missing(index, device, needs, choice, require_gpu),
        })
        .collect();
    let best = (0..devices.len()).filter(|&i| rejections[i].missing.is_empty()).min_by_key(|&i| devices[i].kind);
    best.map(|index| Choice { index }).ok_or(rejections)
}

fn missing(
    index: usize,
    device: &DeviceFacts,
    needs: &Requirements,
    choice: &DeviceChoice,
    require_gpu: bool,
) -> Vec<String> {
    let mut missing = Vec::new();
    match choice {
        DeviceChoice::Auto => {}
        DeviceChoice::Index(wanted) if *wanted != index => {
            missing.push(format!("is not device {wanted}, which was asked for"))
        }
        DeviceChoice::Name(part) if !device.is_called(part) => {
            missing.push(format!("has not `{part}` in its name or UUID ({}), which was asked for", device.uuid));
        }
        DeviceChoice::Cpu if device.kind != DeviceKind::Cpu => {
            missing.push("is not a CPU driver, which was asked for".into())
        }
        _ => {}
    }
    if !missing.is_empty() {
        // What else a device lacks that nobody asked for is noise.
        return missing;
    }
    if require_gpu && device.kind == DeviceKind::Cpu {
        missing.push("is a CPU driver, and a GPU is required".into());
    }
    let version = |(major, minor, patch): Version| format!("{major}.{minor}.{patch}");
    if device.api_version < needs.api_version {
        missing.push(format!("offers Vulkan {}, needs {}", version(device.api_version), version(needs.api_version)));
    }
    if !device.has_queue {
        missing.push("lacks a queue that draws and computes".into());
    }
    missing.extend(needs.extensions.iter().filter(|e| !device.extensions.contains(**e)).map(|e| format!("lacks {e}")));
    missing
        .extend(needs.features.iter().filter(|f| !device.features.contains(*f)).map(|f| format!("lacks feature {f}")));
    missing.extend(needs.formats.iter().filter(|f| !device.formats.contains(**f)).map(|f| format!("lacks format {f}")));
    for (limit, least) in &needs.limits {
        let has = device.limits.get(limit).copied().unwrap_or(0);
        if has < *least {
            missing.push(format!("needs {limit} >= {least}, has {has}"));
        }
    }
    missing
}

/// The error for "no device", with one line for each device and missing item.
pub fn refusal(rejections: &[Rejection], choice: &DeviceChoice) -> Error {
    let mut what = String::from("no suitable Vulkan device");
    for rejection in rejections {
        for item in &rejection.missing {
            what += &format!("\n  {} {item}", rejection.device);
        }
    }
    if !rejections.is_empty() {
        what.push('\n');
    }
    let help = match choice {
        DeviceChoice::Auto => "Update the driver, or install a CPU driver (Debian: mesa-vulkan-drivers)".to_owned(),
        DeviceChoice::Index(_) | DeviceChoice::Name(_) | DeviceChoice::Cpu => {
            "Choose another device (`--device`, LUCERNA_DEVICE), or `auto`".to_owned()
        }
    };
    Error::new(ErrorKind::NoDevice, what).help(help)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn device(name: &str, kind: DeviceKind) -> DeviceFacts {
        let needs = Requirements::baseline();
        DeviceFacts {
            name: name.into(),
            kind,
            uuid: format!("00112233-4455-6677-8899-{:012x}", name.len()),
            api_version: (1, 3, 230),
            driver_name: "test".into(),
            driver_info: "1".into(),
            features: needs.features.iter().copied().collect(),
            extensions: BTreeSet::new(),
            limits: needs.limits.iter().copied().collect(),
            formats: needs.formats.iter().map(|f| (*f).to_owned()).collect(),
            has_queue: true,
        }
    }

    fn three() -> Vec<DeviceFacts> {
        vec![
            device("llvmpipe", DeviceKind::Cpu),
            device("Integrated One", DeviceKind::Integrated),
            device("Big GPU", DeviceKind::Discrete),
        ]
    }

    fn pick(devices: &[DeviceFacts], choice: DeviceChoice, require_gpu: bool) -> Result<usize, Vec<Rejection>> {
        select(devices, &Requirements::baseline(), &choice, require_gpu).map(|c| c.index)
    }

    #[test]
    fn auto_prefers_discrete_then_integrated_then_cpu() {
        let mut devices = three();
        assert_eq!(pick(&devices, DeviceChoice::Auto, false), Ok(2));
        devices.pop();
        assert_eq!(pick(&devices, DeviceChoice::Auto, false), Ok(1));
        devices.pop();
        assert_eq!(pick(&devices, DeviceChoice::Auto, false), Ok(0));
    }

    #[test]
    fn a_better_kind_that_lacks_something_is_passed_over() {
        let mut devices = three();
        devices[2].features.remove("synchronization2");
        assert_eq!(pick(&devices, DeviceChoice::Auto, false), Ok(1));
    }

    #[test]
    fn explicit_choices_win_over_preference() {
        assert_eq!(pick(&three(), DeviceChoice::Cpu, false), Ok(0));
        assert_eq!(pick(&three(), DeviceChoice::Index(1), false), Ok(1));
        assert_eq!(pick(&three(), DeviceChoice::Name("big".into()), false), Ok(2));
        assert_eq!(pick(&three(), DeviceChoice::Name("8899-00000000000E".into()), false), Ok(1));
        assert_eq!(pick(&three(), DeviceChoice::Name("8899-000000000007".into()), false), Ok(2));
    }

    #[test]
    fn an_explicit_choice_never_falls_back_to_another_device() {
        let mut devices = three();
        devices[0].features.clear();
        let rejections = pick(&devices, DeviceChoice::Cpu, false).unwrap_err();
        assert_eq!(rejections.len(), 3);
        assert!(rejections[0].missing.iter().any(|m| m == "lacks feature synchronization2"));
        assert_eq!(pick(&three(), DeviceChoice::Index(9), false).unwrap_err().len(), 3);
        assert_eq!(pick(&three(), DeviceChoice::Name("voodoo".into()), false).unwrap_err().len(), 3);
    }

    #[test]
    fn ray_query_needs_every_extension_and_feature() {
        let mut all = device("Tracer", DeviceKind::Discrete);
        assert_eq!(all.lacks_of_ray_query().len(), 5);
        let needs = Requirements::baseline().and_ray_query();
        all.extensions = needs.extensions.iter().map(|e| (*e).to_owned()).collect();
        all.features = needs.features.iter().copied().collect();
        assert_eq!(all.lacks_of_ray_query(), [""; 0]);
        for extension in RAY_QUERY.0 {
            let mut one = all.clone();
            one.extensions.remove(extension);
            assert_eq!(one.lacks_of_ray_query(), [format!("lacks {extension}")]);
        }
        for feature in RAY_QUERY.1 {
            let mut one = all.clone();
            one.features.remove(feature);
            assert_eq!(one.lacks_of_ray_query(), [format!("lacks feature {feature}")]);
            // Demanded, it decides between devices; the baseline does without.
            let devices = [one, device("llvmpipe", DeviceKind::Cpu), all.clone()];
            let choose = |needs: &Requirements| select(&devices, needs, &DeviceChoice::Auto, false).map(|c| c.index);
            assert_eq!((choose(&needs), choose(&Requirements::baseline())), (Ok(2), Ok(0)));
            let rejections = select(&devices[..2], &needs, &DeviceChoice::Auto, false).unwrap_err();
            assert_eq!(rejections[0].missing, [format!("lacks feature {feature}")]);
            assert_eq!(rejections[1].missing.len(), 5);
        }
    }

    #[test]
    fn require_gpu_refuses_cpu_drivers() {
        assert_eq!(
            pick(&three()[..1], DeviceChoice::Auto, true).unwrap_err()[0].missing,
            ["is a CPU driver, and a GPU is required"]
        );
        assert_eq!(pick(&three(), DeviceChoice::Auto, true), Ok(2));
    }

    #[test]
    fn the_refusal_has_a_line_for_each_device_and_missing_item() {
        let mut devices = three();
        devices[0].limits.insert("maxStorageBufferRange", 1000);
        devices[0].features.remove("maintenance4");
        devices[1].api_version = (1, 1, 5);
        devices[1].formats.remove("D32_SFLOAT depth");
        devices[2].has_queue = false;
        let rejections = pick(&devices, DeviceChoice::Auto, false).unwrap_err();
        let error = refusal(&rejections, &DeviceChoice::Auto);
        assert_eq!(error.exit_code(), 4);
        let text = error.to_string();
        for line in [
            "0: llvmpipe (CPU) lacks feature maintenance4",
            "0: llvmpipe (CPU) needs maxStorageBufferRange >= 134217728, has 1000",
            "1: Integrated One (integrated GPU) offers Vulkan 1.1.5, needs 1.3.0",
            "1: Integrated One (integrated GPU) lacks format D32_SFLOAT depth",
            "2: Big GPU (discrete GPU) lacks a queue that draws and computes",
        ] {
            assert!(text.lines().any(|l| l.trim() == line), "{line}\nnot in\n{text}");
        }
    }

    #[test]
    fn no_device_at_all_is_refused_without_a_panic() {
        assert_eq!(pick(&[], DeviceChoice::Auto, false), Err(Vec::new()));
        assert_eq!(refusal(&[], &DeviceChoice::Auto).exit_code(), 4);
    }
}
