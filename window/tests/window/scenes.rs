//! What the windows do.

use crate::desktop::{Desktop, until};
use egui::{Color32, ColorImage, Pos2, Rect, TextureHandle, TextureOptions, ViewportCommand};
use lucerna_window::{App, Error, Options, Waker, run, validation_messages};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;

pub const ALL: &[(&str, fn())] = &[
    ("no_display", no_display),
    ("dead_display", no_display),
    ("no_device", no_device),
    ("app_error", app_error),
    ("pictures", pictures),
    ("resizes", resizes),
    ("minimised", minimised),
    ("calm", calm),
    ("keys", keys),
    ("closing", closing),
    ("two_losses", two_losses),
    ("three_losses", three_losses),
];

const TITLE: &str = "a window under test";
const SIDE: usize = 256;
const KEYS: u64 = 800;
/// Where the pictures are painted: nearest filtering, linear filtering, an `egui::Image`.
const PLACES: [[i16; 2]; 3] = [[37, 21], [301, 23], [41, 290]];

enum Order {
    Send(ViewportCommand),
    Whole(ColorImage),
    Part([usize; 2], ColorImage),
    CancelClose(bool),
}

/// What the app has seen.
#[derive(Clone, Default)]
struct Seen {
    frames: u64,
    size: [u32; 2],
    closed: bool,
    close_requests: u64,
    keys: u64,
}

struct Tested {
    orders: Receiver<Order>,
    seen: Arc<Mutex<Seen>>,
    textures: Vec<TextureHandle>,
    cancel: bool,
}

impl App for Tested {
    fn ui(&mut self, context: &egui::Context) {
        for order in self.orders.try_iter() {
            match order {
                Order::Send(command) => context.send_viewport_cmd(command),
                Order::CancelClose(cancel) => self.cancel = cancel,
                Order::Whole(image) => {
                    for texture in &mut self.textures {
                        texture.set(image.clone(), options_of(texture, context));
                    }
                }
                Order::Part(place, image) => {
                    for texture in &mut self.textures {
                        texture.set_partial(place, image.clone(), options_of(texture, context));
                    }
                }
            }
        }
        let close = context.input(|i| i.viewport().close_requested());
        if close && self.cancel {
            context.send_viewport_cmd(ViewportCommand::CancelClose);
        }
        let screen = context.content_rect();
        let painter = context.layer_painter(egui::LayerId::background());
        let uv = Rect::from_min_max(Pos2::ZERO, Pos2::new(1.0, 1.0));
        let rect = |i: usize| {
            let [x, y] = PLACES[i];
            Rect::from_min_size(Pos2::new(x.into(), y.into()), egui::Vec2::splat(SIDE as f32))
        };
        painter.image(self.textures[0].id(), rect(0), uv, Color32::WHITE);
        painter.image(self.textures[1].id(), rect(1), uv, Color32::WHITE);
        egui::Area::new("image".into()).fixed_pos(rect(2).min).show(context, |ui| {
            ui.add(egui::Image::new((self.textures[2].id(), rect(2).size())));
        });
        egui::Area::new("text".into()).fixed_pos([600.0, 20.0]).show(context, |ui| ui.label("Some text."));
        let mut seen = self.seen.lock().unwrap();
        seen.frames += 1;
        seen.size = [screen.width() as u32, screen.height() as u32];
        seen.close_requests += u64::from(close);
        let pressed = |event: &&egui::Event| matches!(event, egui::Event::Key { key: egui::Key::K, pressed: true, .. });
        seen.keys += context.input(|i| i.events.iter().filter(pressed).count()) as u64;
    }

    fn closing(&mut self) {
        self.seen.lock().unwrap().closed = true;
    }
}

fn options_of(texture: &TextureHandle, context: &egui::Context) -> TextureOptions {
    context.tex_manager().read().meta(texture.id()).unwrap().options
}

/// Noise: each byte value occurs, and no two neighbours are alike.
fn noise(size: [usize; 2], seed: u32) -> ColorImage {
    let mut state = seed;
    let mut byte = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    ColorImage::new(size, (0..size[0] * size[1]).map(|_| Color32::from_rgb(byte(), byte(), byte())).collect())
}

/// The other side of the window: the test itself, in a thread.
struct Test {
    desktop: Desktop,
    orders: Sender<Order>,
    seen: Arc<Mutex<Seen>>,
    waker: Waker,
    context: egui::Context,
}

impl Test {
    fn order(&self, order: Order) {
        self.orders.send(order).unwrap();
        self.waker.wake();
    }

    fn seen(&self) -> Seen {
        self.seen.lock().unwrap().clone()
    }

    /// Waits until the window shows an image at all places, exactly.
    fn shows(&self, image: &ColorImage) {
        let wanted: Vec<[u8; 3]> = image.pixels.iter().map(|p| [p.r(), p.g(), p.b()]).collect();
        for place in PLACES {
            until(&format!("the picture at {place:?} is exact"), || {
                self.desktop.picture(place, [SIDE as u16; 2]).is_some_and(|shown| shown == wanted)
            });
        }
    }
}

struct Log;

impl log::Log for Log {
    fn enabled(&self, _: &log::Metadata<'_>) -> bool {
        true
    }
    fn log(&self, record: &log::Record<'_>) {
        if record.level() <= log::Level::Warn && record.target().starts_with("lucerna_window") {
            eprintln!("{}: {}", record.level(), record.args());
        }
    }
    fn flush(&self) {}
}

fn options() -> Options {
    Options {
        title: TITLE.to_owned(),
        size: [700.0, 600.0],
        app_id: "lucerna-test".to_owned(),
        validation: true,
        any_thread: true,
        ..Options::default()
    }
}

/// Opens the window and runs the test beside it. The test must close the window.
fn with_window(options: Options, test: impl FnOnce(&Test) + Send + 'static) -> (Result<(), Error>, Seen) {
    log::set_logger(&Log).unwrap();
    log::set_max_level(log::LevelFilter::Warn);
    let seen = Arc::<Mutex<Seen>>::default();
    let (theirs, mut thread) = (seen.clone(), None);
    let result = run(options, |waker, context| {
        let (sender, orders) = channel();
        let filters = [TextureOptions::NEAREST, TextureOptions::LINEAR, TextureOptions::NEAREST];
        let load = |f| context.load_texture("noise", noise([SIDE; 2], 1), f);
        let textures = filters.into_iter().map(load).collect();
        let (context, seen) = (context.clone(), theirs.clone());
        thread = Some(std::thread::spawn(move || {
            // A failed test must end the process: the window would stay open for ever.
            let watched = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
                test(&Test { desktop: Desktop::find(TITLE), orders: sender, seen, waker, context });
            }));
            if watched.is_err() {
                std::process::exit(1);
            }
        }));
        Ok(Box::new(Tested { orders, seen: theirs, textures, cancel: false }))
    });
    thread.unwrap().join().unwrap();
    assert_eq!(validation_messages(), 0);
    let seen = seen.lock().unwrap().clone();
    (result, seen)
}

fn no_display() {
    let result = run(options(), |_, _| panic!("There is no window."));
    assert!(matches!(result, Err(Error::NoDisplay(_))), "{result:?}");
    println!("       {}", result.unwrap_err());
}

fn no_device() {
    let options = Options { device: Some("no such device".to_owned()), ..options() };
    let result = run(options, |_, _| panic!("There is no device."));
    assert!(matches!(result, Err(Error::NoDevice(_))), "{result:?}");
    println!("       {}", result.unwrap_err());
}

fn app_error() {
    let result = run(options(), |_, _| Err("no such file".into()));
    assert!(matches!(result, Err(Error::App(_))), "{result:?}");
    assert_eq!(validation_messages(), 0);
}

fn pictures() {
    let (result, seen) = with_window(options(), |test| {
        let mut image = noise([SIDE; 2], 1);
        test.shows(&image);
        assert_eq!(test.desktop.class(), "lucerna-test\0lucerna-test\0");
        for seed in 2..40 {
            image = noise([SIDE; 2], seed);
            test.order(Order::Whole(image.clone()));
        }
        test.shows(&image);
        for seed in 0..50 {
            let (x, y) = (seed as usize * 3, 200 - seed as usize * 4);
            let part = noise([17, 50], 100 + seed);
            for (i, pixel) in part.pixels.iter().enumerate() {
                image.pixels[(y + i / 17) * SIDE + x + i % 17] = *pixel;
            }
            test.order(Order::Part([x, y], part));
        }
        test.shows(&image);
        test.order(Order::Send(ViewportCommand::Title("another title".to_owned())));
        until("the title changes", || test.desktop.title() == "another title");
        test.order(Order::Send(ViewportCommand::Close));
    });
    result.unwrap();
    assert!(seen.closed);
}

fn resizes() {
    let (result, _) = with_window(options(), |test| {
        for i in 0..100u32 {
            let size = [600 + (i * 37) % 300, 560 + (i * 53) % 200];
            let points = egui::Vec2::new(size[0] as f32, size[1] as f32);
            test.order(Order::Send(ViewportCommand::InnerSize(points)));
            until(&format!("the size is {size:?}"), || test.seen().size == size);
        }
        test.shows(&noise([SIDE; 2], 1));
        // So many sizes at once that the swapchain is out of date when it is used.
        for i in 0..100 {
            let points = egui::Vec2::new(600.0 + (i * 7 % 13) as f32, 560.0 + (i * 5 % 11) as f32);
            test.order(Order::Send(ViewportCommand::InnerSize(points)));
        }
        test.order(Order::Send(ViewportCommand::Fullscreen(true)));
        test.order(Order::Send(ViewportCommand::Fullscreen(false)));
        test.order(Order::Send(ViewportCommand::InnerSize(egui::Vec2::new(1.0, 1.0))));
        until("the window is tiny", || test.seen().size == [1, 1]);
        test.order(Order::Send(ViewportCommand::InnerSize(egui::Vec2::new(650.0, 570.0))));
        until("the last size is there", || test.seen().size == [650, 570]);
        test.shows(&noise([SIDE; 2], 1));
        test.order(Order::Send(ViewportCommand::Close));
    });
    result.unwrap();
}

fn minimised() {
    let (result, _) = with_window(options(), |test| {
        test.shows(&noise([SIDE; 2], 1));
        for round in 0..3 {
            test.order(Order::Send(ViewportCommand::Minimized(true)));
            test.desktop.minimise(true);
            // The app runs now and then, however often it is woken, and its changes are not lost.
            let (before, start) = (test.seen().frames, std::time::Instant::now());
            let image = noise([SIDE; 2], 50 + round);
            for _ in 0..100 {
                test.order(Order::Whole(image.clone()));
                std::thread::sleep(Duration::from_millis(10));
            }
            let passes = test.seen().frames - before;
            let most = start.elapsed().as_millis() as u64 / 100 + 5;
            assert!((2..=most).contains(&passes), "{passes} passes, at most {most} are calm");
            if round == 0 {
                test.order(Order::Send(ViewportCommand::Minimized(false)));
            }
            // Either comes first, depending on the window manager.
            test.desktop.say_hidden(round == 1);
            test.desktop.map(true);
            std::thread::sleep(Duration::from_millis(300));
            test.desktop.say_hidden(false);
            test.shows(&image);
        }
        test.order(Order::Send(ViewportCommand::Close));
    });
    result.unwrap();
}

/// The processor time of this process in seconds.
fn processor_seconds() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<&str> = text.rsplit(')').next().unwrap().split_whitespace().collect();
    (fields[11].parse::<f64>().unwrap() + fields[12].parse::<f64>().unwrap()) / 100.0
}

fn calm() {
    let (result, _) = with_window(options(), |test| {
        test.shows(&noise([SIDE; 2], 1));
        std::thread::sleep(Duration::from_secs(1));
        let (frames, busy) = (test.seen().frames, processor_seconds());
        std::thread::sleep(Duration::from_secs(3));
        let (frames, busy) = (test.seen().frames - frames, processor_seconds() - busy);
        println!("       idle for 3 s: {frames} frames, {busy:.2} s of processor time");
        assert!(frames == 0 && busy < 0.06, "{frames} frames, {busy} s");
        let asks: [(&str, &dyn Fn()); 4] = [
            ("a wake", &|| test.waker.wake()),
            ("a request of another thread", &|| test.context.request_repaint()),
            ("a delay", &|| test.context.request_repaint_after(Duration::from_millis(300))),
            ("the mouse", &|| test.desktop.point(50, 60)),
        ];
        for (what, ask) in asks {
            let before = test.seen().frames;
            ask();
            until(what, || test.seen().frames > before);
            std::thread::sleep(Duration::from_millis(700));
            let frames = test.seen().frames - before;
            println!("       {what}: {frames} frames");
            assert!(frames <= 6, "{what} made {frames} frames");
        }
        test.order(Order::Send(ViewportCommand::Close));
    });
    result.unwrap();
}

/// A key that is pressed while the display takes a picture is heard at once. The driver's thread and the event loop both read messages of
/// the X server then, and busy cores change which is the first. With one connection for both, 17 of 24,000 keys waited for the next event,
/// so this number of keys finds the fault in about two runs of five.
fn keys() {
    let (result, _) = with_window(options(), |test| {
        test.shows(&noise([SIDE; 2], 1));
        test.desktop.focus();
        let done = Arc::new(AtomicBool::new(false));
        let busy = || {
            let done = done.clone();
            std::thread::spawn(move || while !done.load(Ordering::Relaxed) {})
        };
        let threads: Vec<_> = (0..3).map(|_| busy()).collect();
        for round in 1..=KEYS {
            test.waker.wake();
            std::thread::sleep(Duration::from_micros(8_000 + round * 7919 % 4_000));
            test.desktop.hit(u32::from('k'));
            until("the key is heard", || test.seen().keys == round);
        }
        done.store(true, Ordering::Relaxed);
        threads.into_iter().for_each(|thread| thread.join().unwrap());
        test.order(Order::Send(ViewportCommand::Close));
    });
    result.unwrap();
}

fn closing() {
    let (result, seen) = with_window(options(), |test| {
        test.order(Order::CancelClose(true));
        test.desktop.close();
        until("the app hears of the close button", || test.seen().close_requests == 1);
        let frames = test.seen().frames;
        test.waker.wake();
        until("the window lives", || test.seen().frames > frames);
        assert!(!test.seen().closed);
        test.order(Order::CancelClose(false));
        test.desktop.minimise(true);
        test.desktop.close();
        until("the app closes", || test.seen().closed);
        test.waker.wake();
        test.context.request_repaint();
    });
    result.unwrap();
    assert!(seen.closed);
}

fn two_losses() {
    let options = Options { lose_at: vec![3, 4, 7], ..options() };
    let (result, _) = with_window(options, |test| {
        let mut image = noise([SIDE; 2], 1);
        for step in 0..20 {
            let part = noise([SIDE, 2], step);
            image.pixels[step as usize * 512..][..512].copy_from_slice(&part.pixels);
            test.order(Order::Part([0, step as usize * 2], part));
            std::thread::sleep(Duration::from_millis(30));
        }
        test.shows(&image);
        test.order(Order::Send(ViewportCommand::Close));
    });
    result.unwrap();
}

fn three_losses() {
    let options = Options { lose_at: vec![3, 4, 5], ..options() };
    let (result, seen) = with_window(options, |test| {
        until("the window fails", || {
            test.waker.wake();
            test.seen().closed
        });
    });
    let lost = ash::vk::Result::ERROR_DEVICE_LOST;
    assert!(matches!(result, Err(Error::Vulkan { result, .. }) if result == lost), "{result:?}");
    assert!(seen.closed);
}
