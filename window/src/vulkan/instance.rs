//! The Vulkan instance and its validation messages.

use super::surface;
use crate::error::{Error, vk_error};
use ash::{ext, khr, vk};
use std::ffi::{CStr, c_void};
use std::rc::Rc;
use std::sync::atomic::{AtomicU64, Ordering};
use winit::raw_window_handle::HasDisplayHandle;
use winit::window::Window;

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// The number of warnings and errors so far. A callback from C has no better place for it.
static MESSAGES: AtomicU64 = AtomicU64::new(0);

/// How many warnings and errors the validation layer has reported in this process.
///
/// A test asserts that this is zero. It stays zero when [`Options::validation`](crate::Options::validation) is off.
pub fn validation_messages() -> u64 {
    MESSAGES.load(Ordering::Relaxed)
}

/// An instance that can present to the display of a window.
pub struct Instance {
    pub raw: ash::Instance,
    pub surfaces: khr::surface::Instance,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    pub entry: ash::Entry,
}

impl Instance {
    pub fn new(window: &Window, validation: bool) -> Result<Rc<Self>, Error> {
        // SAFETY: the Vulkan loader is a trusted library of the system; loading it runs its initialisers only.
        let entry = unsafe { ash::Entry::load() }
            .map_err(|e| Error::NoDevice(format!("The Vulkan loader is not installed: {e}")))?;
        let display = window.display_handle().map_err(|e| Error::Window(format!("The window has no display: {e}")))?;
        let mut extensions = surface::extensions(display.as_raw())?;
        let mut layers = Vec::new();
        if validation {
            if !has_validation_layer(&entry)? {
                return Err(Error::NoDevice(
                    "The validation layer VK_LAYER_KHRONOS_validation is not installed.".to_owned(),
                ));
            }
            layers.push(VALIDATION_LAYER.as_ptr());
            extensions.push(ext::debug_utils::NAME.as_ptr());
        }
        let application =
            vk::ApplicationInfo::default().application_name(c"lucerna-window").api_version(vk::API_VERSION_1_3);
        let mut messages = messenger_info();
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions);
        if validation {
            info = info.push_next(&mut messages);
        }
        // SAFETY: everything that `info` points to lives until the end of this function.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|e| match e {
            vk::Result::ERROR_INCOMPATIBLE_DRIVER => Error::NoDevice("No Vulkan driver is installed.".to_owned()),
            vk::Result::ERROR_EXTENSION_NOT_PRESENT => {
                Error::NoDevice("The Vulkan drivers cannot present to this kind of display.".to_owned())
            }
            e => vk_error("vkCreateInstance", e),
        })?;
        let surfaces = khr::surface::Instance::new(&entry, &raw);
        let mut instance = Self { raw, surfaces, messenger: None, entry };
        if validation {
            let loader = ext::debug_utils::Instance::new(&instance.entry, &instance.raw);
            // SAFETY: the extension is enabled; the callback is a static function.
            let messenger = unsafe { loader.create_debug_utils_messenger(&messenger_info(), None) }
                .map_err(|e| vk_error("vkCreateDebugUtilsMessengerEXT", e))?;
            instance.messenger = Some((loader, messenger));
        }
        Ok(Rc::new(instance))
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let Some((loader, messenger)) = self.messenger.take() {
            // SAFETY: the messenger belongs to this instance, which still exists.
            unsafe { loader.destroy_debug_utils_messenger(messenger, None) };
        }
        // SAFETY: all objects made from the instance hold an `Rc` of it, so none is left.
        unsafe { self.raw.destroy_instance(None) };
    }
}

fn has_validation_layer(entry: &ash::Entry) -> Result<bool, Error> {
    // SAFETY: the call has no preconditions.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }
        .map_err(|e| vk_error("vkEnumerateInstanceLayerProperties", e))?;
    Ok(layers.iter().any(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION_LAYER)))
}

/// Messages about the use of Vulkan. The loader's own messages, such as one about a broken driver file, are left out.
fn messenger_info() -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR)
        .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE)
        .pfn_user_callback(Some(on_message))
}

/// Logs and counts a message.
///
/// # Safety
/// Only the Vulkan implementation calls it, with `data` either null or valid during the call.
unsafe extern "system" fn on_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _types: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    _user: *mut c_void,
) -> vk::Bool32 {
    MESSAGES.fetch_add(1, Ordering::Relaxed);
    // SAFETY: the caller passes null or a valid pointer.
    if let Some(data) = unsafe { data.as_ref() } {
        // SAFETY: the strings are null or end with a zero byte, as the specification says.
        let message = unsafe { data.message_as_c_str() };
        log::error!("Vulkan validation: {}", message.unwrap_or_default().to_string_lossy());
    }
    vk::FALSE
}
