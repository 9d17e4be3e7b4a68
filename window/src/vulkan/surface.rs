//! The window's surface.
//!
//! Under X11 on Linux it has a connection of its own to the X server. A driver that presents reads the connection of its surface in a thread: it waits
//! there for messages about its pictures, and puts the other messages aside in memory. If that connection were the event loop's, which
//! sleeps until the connection's socket can be read, a key or a click that this thread had put aside would wait until the next event.

use super::instance::Instance;
use crate::error::{Error, vk_error};
use ash::vk;
use std::ffi::c_char;
use std::rc::Rc;
use std::sync::Arc;
use winit::raw_window_handle::{HasDisplayHandle, HasWindowHandle, RawDisplayHandle};
use winit::window::Window;

/// The instance extensions that presenting to a display needs.
pub fn extensions(display: RawDisplayHandle) -> Result<Vec<*const c_char>, Error> {
    #[cfg(target_os = "linux")]
    if let RawDisplayHandle::Xlib(_) = display {
        return Ok(vec![ash::khr::surface::NAME.as_ptr(), ash::khr::xcb_surface::NAME.as_ptr()]);
    }
    let extensions = ash_window::enumerate_required_extensions(display)
        .map_err(|e| vk_error("vkEnumerateInstanceExtensionProperties", e))?;
    Ok(extensions.to_vec())
}

/// The part of a window that Vulkan presents to. It keeps the window alive.
pub struct Surface {
    // The order matters: fields are dropped from first to last, and the window outlives the driver's connection.
    pub raw: vk::SurfaceKHR,
    pub instance: Rc<Instance>,
    #[cfg(target_os = "linux")]
    _connection: Option<x11::Connection>,
    pub window: Arc<Window>,
}

impl Surface {
    pub fn new(instance: &Rc<Instance>, window: &Arc<Window>) -> Result<Rc<Self>, Error> {
        let no_handle = |e| Error::Window(format!("The window has no handle: {e}"));
        let display = window.display_handle().map_err(no_handle)?.as_raw();
        let handle = window.window_handle().map_err(no_handle)?.as_raw();
        #[cfg(target_os = "linux")]
        if let Some(id) = x11::window(handle) {
            let (raw, connection) = x11::create(instance, id)?;
            let (instance, window) = (instance.clone(), window.clone());
            return Ok(Rc::new(Self { raw, instance, _connection: Some(connection), window }));
        }
        // SAFETY: the surface holds the window, so both handles stay valid as long as the surface.
        let raw = unsafe { ash_window::create_surface(&instance.entry, &instance.raw, display, handle, None) }
            .map_err(|e| vk_error("vkCreateSurfaceKHR", e))?;
        Ok(Rc::new(Self {
            raw,
            instance: instance.clone(),
            #[cfg(target_os = "linux")]
            _connection: None,
            window: window.clone(),
        }))
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        // SAFETY: swapchains hold an `Rc` of the surface, so none is left.
        unsafe { self.instance.surfaces.destroy_surface(self.raw, None) };
    }
}

#[cfg(target_os = "linux")]
mod x11 {
    use super::{Error, Instance, vk, vk_error};
    use winit::raw_window_handle::RawWindowHandle;
    use x11rb::xcb_ffi::XCBConnection;

    /// The driver's connection to the X server.
    pub type Connection = XCBConnection;

    /// The window's number at the X server.
    pub fn window(handle: RawWindowHandle) -> Option<u32> {
        match handle {
            RawWindowHandle::Xlib(handle) => u32::try_from(handle.window).ok(),
            _ => None,
        }
    }

    /// Makes a surface with a connection of its own to the server that `DISPLAY` names, which is the event loop's, too.
    pub fn create(instance: &Instance, window: u32) -> Result<(vk::SurfaceKHR, Connection), Error> {
        let (connection, _) = XCBConnection::connect(None)
            .map_err(|e| Error::Window(format!("A second connection to the X server is not possible: {e}")))?;
        let info =
            vk::XcbSurfaceCreateInfoKHR::default().connection(connection.get_raw_xcb_connection()).window(window);
        let surfaces = ash::khr::xcb_surface::Instance::new(&instance.entry, &instance.raw);
        // SAFETY: the extension is enabled; the caller keeps the window and the connection as long as the surface.
        let raw =
            unsafe { surfaces.create_xcb_surface(&info, None) }.map_err(|e| vk_error("vkCreateXcbSurfaceKHR", e))?;
        Ok((raw, connection))
    }
}
