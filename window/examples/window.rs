//! A text, a slider, and a picture that a thread changes 30 times a second.

use lucerna_window::{App, Options, Waker, run};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

const SIDE: usize = 512;

/// What the thread and the window share.
#[derive(Default)]
struct Shared {
    image: Mutex<Option<egui::ColorImage>>,
    stop: AtomicBool,
}

struct Example {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    texture: egui::TextureHandle,
    size: f32,
}

impl App for Example {
    fn ui(&mut self, context: &egui::Context) {
        let image = self.shared.image.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(image) = image {
            self.texture.set(image, egui::TextureOptions::NEAREST);
        }
        egui::CentralPanel::default().show(context, |ui| {
            ui.heading("A picture that changes");
            ui.add(egui::Slider::new(&mut self.size, 64.0..=1024.0).text("Size"));
            ui.image((self.texture.id(), egui::Vec2::splat(self.size / context.pixels_per_point())));
        });
    }

    fn closing(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            eprintln!("The thread has panicked.");
        }
    }
}

/// Makes pictures until it is told to stop.
fn make_pictures(shared: &Shared, waker: &Waker) {
    let mut step = 0;
    while !shared.stop.load(Ordering::Relaxed) {
        let pixel = |i: usize| {
            let (x, y) = (i % SIDE, i / SIDE);
            egui::Color32::from_rgb((x + step) as u8, (y + step) as u8, (x ^ y) as u8)
        };
        let image = egui::ColorImage::new([SIDE, SIDE], (0..SIDE * SIDE).map(pixel).collect());
        *shared.image.lock().unwrap_or_else(PoisonError::into_inner) = Some(image);
        waker.wake();
        step += 1;
        std::thread::sleep(Duration::from_millis(33));
    }
}

fn main() -> Result<(), lucerna_window::Error> {
    let options = Options { title: "lucerna-window".to_owned(), size: [700.0, 640.0], ..Options::default() };
    run(options, |waker, context| {
        let shared = Arc::<Shared>::default();
        let theirs = shared.clone();
        let thread = std::thread::Builder::new().spawn(move || make_pictures(&theirs, &waker))?;
        let black = egui::ColorImage::filled([SIDE, SIDE], egui::Color32::BLACK);
        let texture = context.load_texture("picture", black, egui::TextureOptions::NEAREST);
        Ok(Box::new(Example { shared, thread: Some(thread), texture, size: SIDE as f32 }))
    })
}
