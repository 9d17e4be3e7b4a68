//! Frames that are asked for from outside of the event loop.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use winit::event_loop::EventLoopProxy;

/// What other threads send to the window's thread.
#[derive(Clone, Copy, Debug)]
pub enum Event {
    /// A [`Waker`] wants a frame.
    Wake,
    /// egui wants a frame at this time, unless it has begun another after `pass`.
    Repaint { at: Instant, pass: u64 },
}

/// Wakes the window from any thread: it draws a frame soon.
///
/// A wake is cheap. Many wakes before the window gets to its next frame make one frame. After the window has closed they
/// do nothing.
#[derive(Clone, Debug)]
pub struct Waker {
    proxy: EventLoopProxy<Event>,
    /// Whether an event is on its way. It keeps the queue short.
    pending: Arc<AtomicBool>,
}

impl Waker {
    pub(crate) fn new(proxy: EventLoopProxy<Event>) -> Self {
        Self { proxy, pending: Arc::default() }
    }

    /// Asks for a frame.
    ///
    /// What the calling thread has written before is seen by that frame, if it was written under a lock or by an atomic.
    pub fn wake(&self) {
        // An error says that the window has closed. Nobody is left to wake.
        if !self.pending.swap(true, Ordering::AcqRel) && self.proxy.send_event(Event::Wake).is_err() {
            log::debug!("The window was woken after it had closed.");
        }
    }

    /// The event has arrived: the next wake must send another.
    pub(crate) fn arrived(&self) {
        self.pending.store(false, Ordering::Release);
    }
}

const _: () = {
    const fn shared_by_threads<T: Clone + Send + Sync>() {}
    shared_by_threads::<Waker>();
};
