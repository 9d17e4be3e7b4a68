//! The X server's view of the window, and what a window manager would do to it.

use std::time::{Duration, Instant};
use x11rb::connection::Connection;
use x11rb::protocol::xproto::{
    AtomEnum, ClientMessageEvent, ConnectionExt, EventMask, ImageFormat, MapState, PropMode, Window,
};
use x11rb::protocol::xproto::{
    BUTTON_PRESS_EVENT, BUTTON_RELEASE_EVENT, InputFocus, KEY_PRESS_EVENT, KEY_RELEASE_EVENT,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;

#[allow(dead_code)] // Each test uses a part of it.
pub struct Desktop {
    connection: RustConnection,
    window: Window,
}

/// Repeats a question until the answer is yes. The window system needs time for everything.
pub fn until(what: &str, mut question: impl FnMut() -> bool) {
    let start = Instant::now();
    while !question() {
        assert!(start.elapsed() < Duration::from_secs(20), "it never happened: {what}");
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[allow(dead_code)]
impl Desktop {
    /// Connects to the server and waits for the one window with this title.
    pub fn find(title: &str) -> Self {
        Self::find_on(None, title)
    }

    /// As [`Desktop::find`], on the server of this display; None: that of the environment.
    pub fn find_on(display: Option<&str>, title: &str) -> Self {
        let (connection, screen) = x11rb::connect(display).unwrap();
        let root = connection.setup().roots[screen].root;
        let mut desktop = Self { connection, window: 0 };
        until("the window appears", || {
            for window in desktop.connection.query_tree(root).unwrap().reply().unwrap().children {
                desktop.window = window;
                let shown = desktop.connection.get_window_attributes(window).unwrap().reply();
                if desktop.title() == title && shown.is_ok_and(|a| a.map_state == MapState::VIEWABLE) {
                    return true;
                }
            }
            false
        });
        desktop
    }

    fn atom(&self, name: &str) -> u32 {
        self.connection.intern_atom(false, name.as_bytes()).unwrap().reply().unwrap().atom
    }

    pub fn title(&self) -> String {
        let (name, kind) = (self.atom("_NET_WM_NAME"), self.atom("UTF8_STRING"));
        let reply = self.connection.get_property(false, self.window, name, kind, 0, 1000).unwrap().reply();
        reply.map(|r| String::from_utf8_lossy(&r.value).into_owned()).unwrap_or_default()
    }

    pub fn class(&self) -> String {
        let kind = AtomEnum::STRING;
        let reply = self.connection.get_property(false, self.window, AtomEnum::WM_CLASS, kind, 0, 1000);
        String::from_utf8_lossy(&reply.unwrap().reply().unwrap().value).into_owned()
    }

    /// The red, green and blue bytes of a part of the window. None if the part is not inside.
    pub fn picture(&self, [x, y]: [i16; 2], [width, height]: [u16; 2]) -> Option<Vec<[u8; 3]>> {
        let request =
            self.connection.get_image(ImageFormat::Z_PIXMAP, self.window, x, y, width, height, u32::MAX).unwrap();
        let data = request.reply().ok()?.data;
        Some(data.chunks_exact(4).map(|p| [p[2], p[1], p[0]]).collect())
    }

    /// Hides the window or shows it again, as a window manager does.
    pub fn minimise(&self, hide: bool) {
        self.say_hidden(hide);
        self.map(!hide);
    }

    /// Says that the window is hidden, or that it is not.
    pub fn say_hidden(&self, hide: bool) {
        let states: &[u32] = if hide { &[self.atom("_NET_WM_STATE_HIDDEN")] } else { &[] };
        let property = self.atom("_NET_WM_STATE");
        self.connection
            .change_property32(PropMode::REPLACE, self.window, property, AtomEnum::ATOM, states)
            .unwrap()
            .check()
            .unwrap();
    }

    /// Shows the window or takes it away.
    pub fn map(&self, show: bool) {
        if show {
            self.connection.map_window(self.window).unwrap().check().unwrap();
        } else {
            self.connection.unmap_window(self.window).unwrap().check().unwrap();
        }
    }

    /// Presses the window's close button.
    pub fn close(&self) {
        let (protocols, delete) = (self.atom("WM_PROTOCOLS"), self.atom("WM_DELETE_WINDOW"));
        let event = ClientMessageEvent::new(32, self.window, protocols, [delete, 0, 0, 0, 0]);
        self.connection.send_event(false, self.window, EventMask::NO_EVENT, event).unwrap().check().unwrap();
    }

    /// Moves the mouse to a place in the window.
    pub fn point(&self, x: i16, y: i16) {
        self.connection.warp_pointer(x11rb::NONE, self.window, 0, 0, 0, 0, x, y).unwrap().check().unwrap();
    }

    /// Gives the keyboard to the window, as a window manager does.
    pub fn focus(&self) {
        let now = x11rb::CURRENT_TIME;
        self.connection.set_input_focus(InputFocus::PARENT, self.window, now).unwrap().check().unwrap();
    }

    /// Presses or releases the key of this symbol (that of Latin-1 for a letter).
    pub fn key(&self, symbol: u32, down: bool) {
        let setup = self.connection.setup();
        let (first, last) = (setup.min_keycode, setup.max_keycode);
        let map = self.connection.get_keyboard_mapping(first, last - first + 1).unwrap().reply().unwrap();
        let columns = usize::from(map.keysyms_per_keycode);
        let found = map.keysyms.chunks(columns).position(|keys| keys.first() == Some(&symbol));
        let code = first + u8::try_from(found.expect("the keyboard has the key")).unwrap();
        self.fake(if down { KEY_PRESS_EVENT } else { KEY_RELEASE_EVENT }, code);
    }

    /// Presses and releases a key.
    pub fn hit(&self, symbol: u32) {
        self.key(symbol, true);
        self.key(symbol, false);
    }

    /// Presses or releases a button of the mouse: 1 is the left one.
    pub fn button(&self, button: u8, down: bool) {
        self.fake(if down { BUTTON_PRESS_EVENT } else { BUTTON_RELEASE_EVENT }, button);
    }

    fn fake(&self, kind: u8, detail: u8) {
        self.connection.xtest_fake_input(kind, detail, 0, x11rb::NONE, 0, 0, 0).unwrap().check().unwrap();
    }
}
