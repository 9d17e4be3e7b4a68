//! Answers the events of the window system.

use crate::live::Live;
use crate::waker::{Event, Waker};
use crate::{App, Error, Options};
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoopProxy};
use winit::window::WindowId;

/// The event loop's state. `M` makes the app when the window is there.
pub struct Handler<M> {
    options: Options,
    make: Option<M>,
    context: egui::Context,
    waker: Waker,
    live: Option<Live>,
    error: Option<Error>,
}

impl<M> Handler<M>
where
    M: FnOnce(Waker, &egui::Context) -> Result<Box<dyn App>, Box<dyn std::error::Error + Send + Sync>>,
{
    pub fn new(options: Options, make: M, proxy: EventLoopProxy<Event>) -> Self {
        let context = egui::Context::default();
        let repaints = proxy.clone();
        context.set_request_repaint_callback(move |info| {
            if let Some(at) = Instant::now().checked_add(info.delay) {
                let event = Event::Repaint { at, pass: info.current_cumulative_pass_nr };
                if repaints.send_event(event).is_err() {
                    log::debug!("A frame was asked for after the window had closed.");
                }
            }
        });
        Self { options, make: Some(make), context, waker: Waker::new(proxy), live: None, error: None }
    }

    /// The result, after the event loop has ended.
    pub fn finish(self) -> Result<(), Error> {
        self.error.map_or(Ok(()), Err)
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<(), Error> {
        let Some(make) = self.make.take() else { return Ok(()) };
        let mut live = Live::open(event_loop, &self.options, self.context.clone())?;
        live.app = Some(make(self.waker.clone(), &self.context).map_err(Error::App)?);
        self.live = Some(live);
        Ok(())
    }

    /// Ends the event loop on an error or when the app has let the window close.
    fn follow(&mut self, event_loop: &ActiveEventLoop, result: Result<(), Error>) {
        if let Err(error) = result {
            self.error.get_or_insert(error);
            event_loop.exit();
        } else if self.live.as_ref().is_some_and(|live| live.ended) {
            event_loop.exit();
        }
    }
}

impl<M> ApplicationHandler<Event> for Handler<M>
where
    M: FnOnce(Waker, &egui::Context) -> Result<Box<dyn App>, Box<dyn std::error::Error + Send + Sync>>,
{
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        let opened = self.open(event_loop);
        self.follow(event_loop, opened);
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _id: WindowId, event: WindowEvent) {
        if let Some(live) = &mut self.live
            && !event_loop.exiting()
        {
            let result = live.event(&event);
            self.follow(event_loop, result);
        }
    }

    fn user_event(&mut self, _event_loop: &ActiveEventLoop, event: Event) {
        if let Event::Wake = event {
            self.waker.arrived();
        }
        let Some(live) = &mut self.live else { return };
        match event {
            Event::Wake => live.ask(Duration::ZERO),
            Event::Repaint { at, pass } => {
                // A request from before the last pass has been answered by that pass.
                if pass + 1 >= self.context.cumulative_pass_nr() {
                    live.ask(at.saturating_duration_since(Instant::now()));
                }
            }
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let Some(live) = &mut self.live else { return };
        event_loop.set_control_flow(match live.due(Instant::now()) {
            Some(at) => ControlFlow::WaitUntil(at),
            None => ControlFlow::Wait,
        });
    }

    fn exiting(&mut self, _event_loop: &ActiveEventLoop) {
        // The window, the surface and the clipboard need the event loop's connection to the display: they go first.
        if let Some(mut live) = self.live.take() {
            live.close();
        }
    }
}
