//! The open window.

use crate::textures::Textures;
use crate::vulkan::{Instance, Picture, Presenter, Shown};
use crate::{App, Error, Options, error};
use egui::{ViewportCommand, ViewportId, ViewportInfo};
use egui_winit::ActionRequested;
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::dpi::LogicalSize;
use winit::event::WindowEvent;
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

/// So many losses of the device in a row are an error.
const MOST_LOSSES: u32 = 3;
/// A hidden window lets its app run so often at most. Nothing else slows it: there is no display to wait for.
const HIDDEN_PAUSE: Duration = Duration::from_millis(100);
/// A hidden window looks so often whether it is shown again. A window manager may first show it and then say so.
const HIDDEN_LOOK: Duration = Duration::from_secs(1);

/// A CPU driver paints with the threads that the program computes with. It therefore paints so seldom at most.
/// The app still runs for each input.
const CPU_PAUSE: Duration = Duration::from_millis(45);

/// A window with all that belongs to it.
pub struct Live {
    // The order matters: fields are dropped from first to last.
    pub app: Option<Box<dyn App>>,
    /// Whether the window is to close.
    pub ended: bool,
    presenter: Option<Presenter>,
    instance: Rc<Instance>,
    winit: egui_winit::State,
    window: Arc<Window>,
    info: ViewportInfo,
    context: egui::Context,
    textures: Textures,
    device: Option<String>,
    /// When the next frame is due.
    next: Option<Instant>,
    last: Instant,
    /// When the last frame was painted; none before the first.
    painted: Option<Instant>,
    hidden: bool,
    losses: u32,
    frames: u64,
    lose_at: Vec<u64>,
}

impl Live {
    pub fn open(event_loop: &ActiveEventLoop, options: &Options, context: egui::Context) -> Result<Self, Error> {
        let size = LogicalSize::new(options.size[0].max(1.0), options.size[1].max(1.0));
        let attributes = Window::default_attributes().with_title(&options.title).with_inner_size(size);
        #[cfg(target_os = "linux")]
        let attributes = {
            // The name holds for X11 too.
            use winit::platform::wayland::WindowAttributesExtWayland;
            attributes.with_name(&options.app_id, &options.app_id)
        };
        let window = event_loop
            .create_window(attributes)
            .map_err(|e| Error::Window(format!("The window cannot be opened: {}", error::without_place(&e))))?;
        let window = Arc::new(window);
        let instance = Instance::new(&window, options.validation)?;
        let presenter = Presenter::new(&instance, &window, options.device.as_deref())?;
        let winit = egui_winit::State::new(
            context.clone(),
            ViewportId::ROOT,
            &window,
            Some(window.scale_factor() as f32),
            window.theme(),
            Some(presenter.max_texture_side()),
        );
        let mut info = ViewportInfo::default();
        egui_winit::update_viewport_info(&mut info, &context, &window, true);
        window.request_redraw();
        Ok(Self {
            app: None,
            ended: false,
            presenter: Some(presenter),
            instance,
            winit,
            window,
            info,
            context,
            textures: Textures::default(),
            device: options.device.clone(),
            next: None,
            last: Instant::now(),
            painted: None,
            hidden: false,
            losses: 0,
            frames: 0,
            lose_at: options.lose_at.clone(),
        })
    }

    /// Answers an event of the window.
    pub fn event(&mut self, event: &WindowEvent) -> Result<(), Error> {
        if let WindowEvent::RedrawRequested = event {
            return self.frame();
        }
        let response = self.winit.on_window_event(&self.window, event);
        match event {
            WindowEvent::CloseRequested => {
                self.info.events.push(egui::ViewportEvent::Close);
                // The app decides in this pass. A hidden window gets no redraw, so the pass comes at once.
                self.last = self.last.checked_sub(HIDDEN_PAUSE).unwrap_or(self.last);
                return self.frame();
            }
            WindowEvent::Destroyed => self.ended = true,
            WindowEvent::Resized(_) | WindowEvent::Occluded(false) => self.ask(Duration::ZERO),
            _ if response.repaint => self.ask(Duration::ZERO),
            _ => {}
        }
        Ok(())
    }

    /// Asks for a frame after a delay.
    pub fn ask(&mut self, delay: Duration) {
        let now = Instant::now();
        let Some(mut at) = now.checked_add(delay) else { return };
        if self.hidden {
            at = at.max(self.last + HIDDEN_PAUSE);
        }
        self.next = Some(self.next.map_or(at, |next| next.min(at)));
    }

    /// When the event loop must wake by itself. A frame that is due is asked for here.
    pub fn due(&mut self, now: Instant) -> Option<Instant> {
        if self.next.is_some_and(|next| next <= now) {
            self.next = None;
            self.window.request_redraw();
        }
        self.next
    }

    /// Lets the app save its state. The window closes when this value is dropped.
    pub fn close(&mut self) {
        if let Some(app) = &mut self.app {
            app.closing();
        }
    }

    /// Runs the app once and shows the result.
    fn frame(&mut self) -> Result<(), Error> {
        let Some(mut app) = self.app.take() else { return Ok(()) };
        self.hidden = self.window.is_minimized() == Some(true) || self.window.inner_size().width == 0;
        if self.hidden && self.last.elapsed() < HIDDEN_PAUSE {
            self.app = Some(app);
            self.ask(Duration::ZERO);
            return Ok(());
        }
        self.last = Instant::now();
        self.next = None;
        egui_winit::update_viewport_info(&mut self.info, &self.context, &self.window, false);
        let mut input = self.winit.take_egui_input(&self.window);
        input.viewports.insert(ViewportId::ROOT, self.info.clone());
        let output = self.context.run(input, |context| app.ui(context));
        self.app = Some(app);
        let closing = self.info.close_requested();
        self.info.events.clear();
        self.winit.handle_platform_output(&self.window, output.platform_output);
        for (id, delta) in output.textures_delta.set {
            self.textures.set(id, delta);
        }
        let early = self.is_early();
        let shown = if self.hidden || early.is_some() {
            Ok(())
        } else {
            self.painted = Some(Instant::now());
            let primitives = self.context.tessellate(output.shapes, output.pixels_per_point);
            self.show(&primitives, output.pixels_per_point)
        };
        for id in output.textures_delta.free {
            self.textures.free(id);
        }
        shown?;
        if let Some(left) = early.filter(|_| !self.hidden) {
            self.ask(left);
        }
        if self.hidden {
            self.ask(HIDDEN_LOOK);
        }
        let Some(view) = output.viewport_output.get(&ViewportId::ROOT) else { return Ok(()) };
        self.obey(&view.commands, closing);
        self.ask(view.repaint_delay);
        Ok(())
    }

    /// The time until the window paints again, if it is too early now.
    fn is_early(&self) -> Option<Duration> {
        let slow = self.presenter.as_ref().is_some_and(Presenter::is_cpu);
        let since = self.painted.filter(|_| slow)?.elapsed();
        CPU_PAUSE.checked_sub(since).filter(|left| !left.is_zero())
    }

    fn obey(&mut self, commands: &[ViewportCommand], closing: bool) {
        self.ended |= closing && !commands.contains(&ViewportCommand::CancelClose);
        if commands.is_empty() {
            return;
        }
        let mut actions = Vec::new();
        let commands = commands.iter().cloned();
        egui_winit::process_viewport_commands(&self.context, &mut self.info, commands, &self.window, &mut actions);
        for action in actions {
            let events = &mut self.winit.egui_input_mut().events;
            match action {
                ActionRequested::Cut => events.push(egui::Event::Cut),
                ActionRequested::Copy => events.push(egui::Event::Copy),
                ActionRequested::Paste => {
                    if let Some(text) = self.winit.clipboard_text() {
                        self.winit.egui_input_mut().events.push(egui::Event::Paste(text));
                    }
                }
                ActionRequested::Screenshot(_) => log::warn!("A window cannot take a picture of itself."),
            }
        }
        // The commands change the window, and the app wants to see that. Some window systems send no event for it.
        self.ask(Duration::ZERO);
    }

    /// Draws. A lost device is made anew, with all textures.
    fn show(&mut self, primitives: &[egui::ClippedPrimitive], pixels_per_point: f32) -> Result<(), Error> {
        let clear = self.context.style().visuals.panel_fill.to_array().map(|c| f32::from(c) / 255.0);
        let picture = Picture { primitives, pixels_per_point, clear };
        loop {
            match self.draw(&picture) {
                Ok(Shown::Yes) => self.losses = 0,
                Ok(Shown::NoArea) => self.hidden = true,
                Ok(Shown::Stale) => self.ask(Duration::ZERO),
                // A display keeps the images of a window that nobody sees.
                Ok(Shown::Busy) => self.hidden = true,
                Err(error) if error.is_loss() && self.losses + 1 < MOST_LOSSES => {
                    self.losses += 1;
                    log::warn!("{error}. The window makes a new device.");
                    // The old surface must be gone before the window gets another.
                    self.presenter = None;
                    self.textures.upload_all();
                    continue;
                }
                Err(error) => return Err(error),
            }
            return Ok(());
        }
    }

    fn draw(&mut self, picture: &Picture<'_>) -> Result<Shown, Error> {
        let presenter = match &mut self.presenter {
            Some(presenter) => presenter,
            none => none.insert(Presenter::new(&self.instance, &self.window, self.device.as_deref())?),
        };
        self.frames += 1;
        let shown = presenter.draw(picture, &mut self.textures)?;
        if self.lose_at.contains(&self.frames) {
            return Err(Error::Vulkan { call: "vkQueueSubmit2", result: ash::vk::Result::ERROR_DEVICE_LOST });
        }
        Ok(shown)
    }
}
