//! What the validation layer, the loader and the driver say, collected for each instance.

use std::{
    collections::HashMap,
    ffi::{CStr, c_char, c_void},
    fmt,
    sync::Mutex,
};

use ash::vk;

use super::select::Version;

/// How serious a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    Warning,
    Error,
}

/// One message of the validation layer, the loader or the driver.
#[derive(Clone, Debug)]
pub struct Message {
    pub severity: Severity,
    /// `VUID-…`, `SYNC-HAZARD-…`, or whatever the sender uses.
    pub id: String,
    pub text: String,
    /// Names of the objects concerned, as far as they have one.
    pub objects: Vec<String>,
}

impl fmt::Display for Message {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = match self.severity {
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        write!(f, "{severity} {}: {}", self.id, self.text)?;
        if !self.objects.is_empty() {
            write!(f, " [objects: {}]", self.objects.join(", "))?;
        }
        Ok(())
    }
}

/// A message that is known and harmless, so that it fails no test.
#[derive(Clone, Copy, Debug)]
pub struct Allowed {
    /// The message's id begins with this.
    pub id: &'static str,
    /// The message's text contains this.
    pub text: &'static str,
    /// First and last validation layer version (patch of 1.3, or 1.4 as 1.4 itself) that says it; `None`: any.
    pub layers: Option<(Version, Version)>,
    /// Part of the driver's name; empty: any.
    pub driver: &'static str,
    pub reason: &'static str,
}

/// The whole allow-list. Every entry says why.
pub const ALLOWED: &[Allowed] = &[
    Allowed {
        id: "Loader Message",
        text: "",
        layers: None,
        driver: "",
        reason: "the loader speaks about drivers and layers of the machine, not about our calls",
    },
    Allowed {
        id: "WARNING-GPU-Assisted-Validation",
        text: "",
        layers: None,
        driver: "",
        reason: "the layer describes its own settings",
    },
    Allowed {
        id: "VALIDATION-SETTINGS",
        text: "",
        layers: None,
        driver: "",
        reason: "the layer describes its own settings",
    },
    Allowed {
        id: "",
        text: "lvp is not a conformant vulkan implementation",
        layers: None,
        driver: "llvmpipe",
        reason: "printed at start by development builds of lavapipe",
    },
];

/// Messages of one instance. Outlives it, so that what is said while it is torn down is read too.
#[derive(Debug)]
pub struct Log {
    print: bool,
    state: Mutex<State>,
}

#[derive(Debug, Default)]
struct State {
    messages: Vec<Message>,
    counts: HashMap<String, u32>,
    layer: (u32, u32, u32),
    driver: String,
}

/// Messages kept in memory; more are only counted.
const MAX_KEPT: usize = 1000;
/// Messages of one id that are printed.
const MAX_PRINTED: u32 = 10;

impl Log {
    pub(crate) fn new(print: bool) -> Self {
        Self { print, state: Mutex::default() }
    }

    fn state(&self) -> std::sync::MutexGuard<'_, State> {
        // A panic elsewhere must not hide messages.
        self.state.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    pub(crate) fn set_layer(&self, version: (u32, u32, u32)) {
        self.state().layer = version;
    }

    pub(crate) fn set_driver(&self, name: &str) {
        name.clone_into(&mut self.state().driver);
    }

    pub(crate) fn push(&self, message: Message) {
        let mut state = self.state();
        let known = allowed(&message, state.layer, &state.driver);
        let count = state.counts.entry(message.id.clone()).or_insert(0);
        *count += 1;
        if self.print && !known && *count <= MAX_PRINTED {
            log::warn!("vulkan {message}");
            if *count == MAX_PRINTED {
                log::warn!("vulkan: no more of {} is printed", message.id);
            }
        }
        if state.messages.len() < MAX_KEPT {
            state.messages.push(message);
        }
    }

    /// Everything said so far (the first thousand messages), allowed or not.
    pub fn messages(&self) -> Vec<Message> {
        self.state().messages.clone()
    }

    /// Everything said so far that is not on the allow-list.
    pub fn unexpected(&self) -> Vec<Message> {
        let state = self.state();
        state.messages.iter().filter(|m| !allowed(m, state.layer, &state.driver)).cloned().collect()
    }

    /// What the loader said, for errors about instances and devices that could not be made.
    pub(crate) fn loader_messages(&self) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for message in
            self.state().messages.iter().filter(|m| m.id == "Loader Message" && m.severity == Severity::Error)
        {
            if !lines.contains(&message.text) && lines.len() < 6 {
                lines.push(message.text.clone());
            }
        }
        lines
    }
}

fn allowed(message: &Message, layer: (u32, u32, u32), driver: &str) -> bool {
    ALLOWED.iter().any(|entry| {
        message.id.starts_with(entry.id)
            && message.text.contains(entry.text)
            && entry.layers.is_none_or(|(first, last)| layer >= first && layer <= last)
            && driver.contains(entry.driver)
    })
}

/// The messenger that fills `log`. `log` must stay alive as long as the messenger or the instance.
pub(crate) fn messenger_info(log: &Log) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR)
        .message_type(
            vk::DebugUtilsMessageTypeFlagsEXT::GENERAL
                | vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION
                | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
        )
        .pfn_user_callback(Some(receive))
        .user_data(std::ptr::from_ref(log).cast_mut().cast())
}

/// Called from C, perhaps on a driver's thread: must not panic, must return false.
unsafe extern "system" fn receive(
    severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kinds: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    log: *mut c_void,
) -> vk::Bool32 {
    if data.is_null() || log.is_null() {
        return vk::FALSE;
    }
    // SAFETY: the specification guarantees valid data during the call; `log` is the pointer given in `messenger_info`,
    // which the instance keeps alive.
    let (data, log) = unsafe { (&*data, &*log.cast::<Log>().cast_const()) };
    // SAFETY: strings of the callback data are null or terminated.
    let text = |pointer: *const c_char| unsafe {
        if pointer.is_null() { String::new() } else { CStr::from_ptr(pointer).to_string_lossy().into_owned() }
    };
    let objects = if data.p_objects.is_null() {
        Vec::new()
    } else {
        // SAFETY: `p_objects` has `object_count` entries.
        unsafe { std::slice::from_raw_parts(data.p_objects, data.object_count as usize) }
            .iter()
            .map(|object| text(object.p_object_name))
            .filter(|name| !name.is_empty())
            .collect()
    };
    log.push(Message {
        severity: if severity.contains(vk::DebugUtilsMessageSeverityFlagsEXT::ERROR) {
            Severity::Error
        } else {
            Severity::Warning
        },
        id: text(data.p_message_id_name),
        text: text(data.p_message),
        objects,
    });
    vk::FALSE
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(id: &str, text: &str) -> Message {
        Message { severity: Severity::Error, id: id.into(), text: text.into(), objects: vec![] }
    }

    #[test]
    fn only_listed_messages_are_allowed() {
        let log = Log::new(false);
        log.push(message("Loader Message", "driver x skipped"));
        log.push(Message { severity: Severity::Warning, ..message("Loader Message", "a layer was added") });
        log.push(message("VUID-vkCmdDispatch-None-02706", "out of bounds"));
        assert_eq!(log.messages().len(), 3);
        assert_eq!(log.unexpected().len(), 1);
        assert_eq!(log.loader_messages(), ["driver x skipped"]);
    }

    #[test]
    fn an_entry_for_a_driver_holds_for_that_driver_only() {
        let log = Log::new(false);
        log.push(message("x", "lvp is not a conformant vulkan implementation"));
        log.set_driver("NVIDIA");
        assert_eq!(log.unexpected().len(), 1);
        log.set_driver("llvmpipe");
        assert_eq!(log.unexpected().len(), 0);
    }

    #[test]
    fn memory_for_messages_is_bounded() {
        let log = Log::new(false);
        for _ in 0..5000 {
            log.push(message("a", "b"));
        }
        assert_eq!(log.messages().len(), MAX_KEPT);
    }
}
