//! The Vulkan instance: loader, layers, messages; and clear errors when there is none.

use std::{
    ffi::CString,
    fmt::Write as _,
    sync::{
        Arc,
        atomic::{AtomicU32, Ordering},
    },
};

use ash::{ext, khr, vk};

use super::{
    options::{ENVIRONMENT, GpuOptions, Validation},
    validation::{Log, messenger_info},
};
use crate::{Error, ErrorKind, Result};

pub(crate) const VALIDATION_LAYER: &std::ffi::CStr = c"VK_LAYER_KHRONOS_validation";

/// Owns the loader, the instance and its messenger.
pub(crate) struct Instance {
    pub raw: ash::Instance,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    /// Read by the messenger, also while the instance is destroyed.
    pub log: Arc<Log>,
    /// `VK_EXT_debug_utils` is on: names and labels can be given.
    pub debug_utils: bool,
    /// Version of the validation layer if it is on.
    pub layer: Option<(u32, u32, u32)>,
    /// The loader library: must outlive all else.
    pub entry: ash::Entry,
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: devices hold an `Arc` of this, so none is left; nothing else was made from the instance.
        unsafe {
            if let Some((functions, messenger)) = self.messenger.take() {
                functions.destroy_debug_utils_messenger(messenger, None);
            }
            self.raw.destroy_instance(None);
        }
    }
}

impl Instance {
    /// # Errors
    /// `NoDevice` if there is no loader or no driver at all, with what to install and the variables in effect.
    pub fn new(options: &GpuOptions) -> Result<Arc<Self>> {
        // SAFETY: loads a system library; nothing of ours depends on what its initialisers do.
        let entry = unsafe { ash::Entry::load() }.map_err(|cause| {
            Error::new(ErrorKind::NoDevice, format!("the Vulkan loader could not be loaded: {cause}")).help(hint(
                "Install the Vulkan loader (Debian: libvulkan1) and a driver (without a GPU: mesa-vulkan-drivers)",
            ))
        })?;
        let log = Arc::new(Log::new(options.print_messages));

        // SAFETY: plain queries of the loader.
        let version = unsafe { entry.try_enumerate_instance_version() }.ok().flatten().unwrap_or(vk::API_VERSION_1_0);
        if version < vk::API_VERSION_1_3 {
            let (major, minor) = (vk::api_version_major(version), vk::api_version_minor(version));
            return Err(Error::new(
                ErrorKind::NoDevice,
                format!("the Vulkan loader offers {major}.{minor}, needs 1.3"),
            )
            .help(hint("Update the Vulkan loader (Debian: libvulkan1)")));
        }
        // SAFETY: plain queries of the loader.
        let (extensions, layers) = unsafe {
            (
                entry.enumerate_instance_extension_properties(None).unwrap_or_default(),
                entry.enumerate_instance_layer_properties().unwrap_or_default(),
            )
        };
        let offers = |list: &[vk::ExtensionProperties], name: &std::ffi::CStr| {
            list.iter().any(|e| e.extension_name_as_c_str().is_ok_and(|n| n == name))
        };

        let layer = layers.iter().find(|l| l.layer_name_as_c_str().is_ok_and(|n| n == VALIDATION_LAYER));
        let layer = layer.filter(|_| options.validation != Validation::Off);
        if layer.is_none() && options.validation != Validation::Off {
            log::warn!(
                "validation was asked for, but the layer VK_LAYER_KHRONOS_validation is not installed \
                 (Debian: vulkan-validationlayers); running without"
            );
        }
        let layer_version = layer.map(|l| version_of(l.spec_version));
        log.set_layer(layer_version.unwrap_or_default());
        // SAFETY: plain query of the loader.
        let layer_extensions = layer.map_or_else(Vec::new, |_| unsafe {
            entry.enumerate_instance_extension_properties(Some(VALIDATION_LAYER)).unwrap_or_default()
        });

        let mut names: Vec<CString> = Vec::new();
        let debug_utils =
            offers(&extensions, ext::debug_utils::NAME) || offers(&layer_extensions, ext::debug_utils::NAME);
        if debug_utils {
            names.push(ext::debug_utils::NAME.into());
        }
        let mut flags = vk::InstanceCreateFlags::empty();
        if offers(&extensions, khr::portability_enumeration::NAME) {
            names.push(khr::portability_enumeration::NAME.into());
            flags |= vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR;
        }
        for name in &options.window_extensions {
            let name = CString::new(name.as_str())
                .map_err(|_| Error::usage(format!("`{}` is no extension name", name.escape_default())))?;
            if !offers(&extensions, &name) {
                return Err(Error::new(
                    ErrorKind::NoDevice,
                    format!("the Vulkan loader and its drivers lack {name:?}"),
                )
                .help("A window cannot be served on this system; render to a file instead"));
            }
            names.push(name);
        }
        let layer_settings = offers(&layer_extensions, ext::layer_settings::NAME);
        let validation_features = !layer_settings && offers(&layer_extensions, ext::validation_features::NAME);
        if layer.is_some() && layer_settings {
            names.push(ext::layer_settings::NAME.into());
        } else if validation_features {
            names.push(ext::validation_features::NAME.into());
        }

        let application = vk::ApplicationInfo::default()
            .application_name(c"lucerna")
            .engine_name(c"lucerna")
            .api_version(vk::API_VERSION_1_3);
        let name_pointers: Vec<_> = names.iter().map(|n| n.as_ptr()).collect();
        let layer_pointers: Vec<_> = layer.iter().map(|_| VALIDATION_LAYER.as_ptr()).collect();
        let mut messenger = messenger_info(&log);
        let on = vk::TRUE;
        let settings = layer_setting_names(options.validation)
            .iter()
            .map(|name| {
                let mut setting = vk::LayerSettingEXT::default()
                    .layer_name(VALIDATION_LAYER)
                    .setting_name(name)
                    .ty(vk::LayerSettingTypeEXT::BOOL32)
                    .values(bytemuck::bytes_of(&on));
                // `values` counts bytes; the count is in values.
                setting.value_count = 1;
                setting
            })
            .collect::<Vec<_>>();
        let mut settings = vk::LayerSettingsCreateInfoEXT::default().settings(&settings);
        let enabled = enabled_features(options.validation);
        let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(enabled);
        let mut info = vk::InstanceCreateInfo::default()
            .flags(flags)
            .application_info(&application)
            .enabled_extension_names(&name_pointers)
            .enabled_layer_names(&layer_pointers);
        if debug_utils {
            info = info.push_next(&mut messenger);
        }
        if layer.is_some() && layer_settings {
            info = info.push_next(&mut settings);
        } else if validation_features && !enabled.is_empty() {
            info = info.push_next(&mut features);
        }
        // SAFETY: everything that `info` points to is alive; `log` is kept by the instance made here.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|result| no_instance(result, &log))?;

        let mut instance = Self { raw, messenger: None, log, debug_utils, layer: layer_version, entry };
        if debug_utils {
            let functions = ext::debug_utils::Instance::new(&instance.entry, &instance.raw);
            // SAFETY: the extension is on, and `log` outlives the messenger.
            match unsafe { functions.create_debug_utils_messenger(&messenger_info(&instance.log), None) } {
                Ok(handle) => instance.messenger = Some((functions, handle)),
                Err(vk::Result::ERROR_OUT_OF_HOST_MEMORY) => {
                    return Err(Error::new(
                        ErrorKind::OutOfMemory,
                        "host memory ran out in vkCreateDebugUtilsMessengerEXT",
                    ));
                }
                Err(result) => {
                    return Err(Error::new(
                        ErrorKind::Runtime,
                        format!("vkCreateDebugUtilsMessengerEXT failed: {result}"),
                    ));
                }
            }
        }
        static MADE: AtomicU32 = AtomicU32::new(0);
        if MADE.fetch_add(1, Ordering::Relaxed) == 1 {
            keep_drivers(&instance.entry);
        }
        Ok(Arc::new(instance))
    }
}

/// Keeps the drivers in memory until the process ends, by an instance that is never destroyed. The loader unloads all drivers with the last instance, and
/// a driver that is loaded anew takes storage of threads that the C library does not get back: NVIDIA's driver cannot be loaded a 26th time ("cannot
/// allocate memory in static TLS block", driver 580). A process with one instance does not need this.
fn keep_drivers(entry: &ash::Entry) {
    let application = vk::ApplicationInfo::default().api_version(vk::API_VERSION_1_3);
    let info = vk::InstanceCreateInfo::default().application_info(&application);
    // SAFETY: everything that `info` points to is alive; neither the instance nor the loader is ever unloaded.
    if unsafe { entry.create_instance(&info, None) }.is_ok() {
        std::mem::forget(entry.clone());
    }
}

/// (major, minor, patch) of a packed version.
pub(crate) fn version_of(packed: u32) -> (u32, u32, u32) {
    (vk::api_version_major(packed), vk::api_version_minor(packed), vk::api_version_patch(packed))
}

/// Settings of layers that offer `VK_EXT_layer_settings` (1.3.270 and later). Since 1.3.290 synchronisation validation
/// sees shader accesses only with the heuristic on.
fn layer_setting_names(validation: Validation) -> &'static [&'static std::ffi::CStr] {
    match validation {
        Validation::Off | Validation::Core => &[],
        Validation::Sync => &[c"validate_sync", c"syncval_shader_accesses_heuristic"],
        Validation::GpuAssisted => &[c"gpuav_enable"],
    }
}

/// The same for older layers.
fn enabled_features(validation: Validation) -> &'static [vk::ValidationFeatureEnableEXT] {
    match validation {
        Validation::Off | Validation::Core => &[],
        Validation::Sync => &[vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION],
        Validation::GpuAssisted => &[
            vk::ValidationFeatureEnableEXT::GPU_ASSISTED,
            vk::ValidationFeatureEnableEXT::GPU_ASSISTED_RESERVE_BINDING_SLOT,
        ],
    }
}

fn no_instance(result: vk::Result, log: &Log) -> Error {
    let what = match result {
        vk::Result::ERROR_INCOMPATIBLE_DRIVER => {
            "no Vulkan driver was found (vkCreateInstance: incompatible driver)".to_owned()
        }
        // The loader says this when no driver could be loaded, as with a broken manifest; hardly ever for want of memory.
        vk::Result::ERROR_OUT_OF_HOST_MEMORY => {
            "no Vulkan driver could be loaded (vkCreateInstance: the loader reports \
             out of host memory, which it also does when the manifest file of a driver or layer is malformed)"
                .to_owned()
        }
        vk::Result::ERROR_INITIALIZATION_FAILED => {
            "no Vulkan driver could be initialised (vkCreateInstance)".to_owned()
        }
        vk::Result::ERROR_LAYER_NOT_PRESENT => "a requested Vulkan layer is missing (vkCreateInstance)".to_owned(),
        other => format!("no Vulkan instance could be made (vkCreateInstance: {other})"),
    };
    no_driver(what, log)
}

/// "No driver" in all its forms.
pub(crate) fn no_driver(mut what: String, log: &Log) -> Error {
    for line in log.loader_messages() {
        let _ = write!(what, "\n  loader: {}", line.trim().trim_end_matches(['.', '!']));
    }
    Error::new(ErrorKind::NoDevice, what).help(hint(
        "Install a Vulkan driver (Debian: mesa-vulkan-drivers, which also has one that needs no GPU), or point VK_DRIVER_FILES at one",
    ))
}

/// `advice`, and the environment variables in effect that decide about loader, drivers and layers.
pub(crate) fn hint(advice: &str) -> String {
    const FOREIGN: [&str; 14] = [
        "VK_DRIVER_FILES",
        "VK_ICD_FILENAMES",
        "VK_ADD_DRIVER_FILES",
        "VK_LOADER_DRIVERS_SELECT",
        "VK_LOADER_DRIVERS_DISABLE",
        "VK_INSTANCE_LAYERS",
        "VK_LAYER_PATH",
        "VK_ADD_LAYER_PATH",
        "VK_LOADER_LAYERS_ENABLE",
        "VK_LOADER_LAYERS_DISABLE",
        "VK_LAYER_ENABLES",
        "VK_LAYER_DISABLES",
        "MESA_VK_DEVICE_SELECT",
        "LD_LIBRARY_PATH",
    ];
    let set: Vec<String> = FOREIGN
        .into_iter()
        .chain(ENVIRONMENT.map(|(name, _)| name))
        .filter_map(|name| std::env::var_os(name).map(|value| format!("{name}={}", value.to_string_lossy())))
        .collect();
    if set.is_empty() {
        format!("{advice}. None of the variables that choose drivers or layers is set")
    } else {
        format!("{advice}. Variables in effect: {}", set.join(" "))
    }
}
