//! Numbers and maps of two sides, computed beside the window.

use std::{
    sync::{Arc, Condvar, Mutex, MutexGuard},
    thread::JoinHandle,
};

use lucerna::{
    Error, ErrorKind, Result,
    image::{Layers, srgb},
    measure::{Exposure, Measure, Options, Pair, Picture},
};

use super::{painted, session::Wake, wanted::Shown};

/// A map of two pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MapOf {
    /// FLIP of what a screen shows.
    #[default]
    Flip,
    /// Relative squared error of the light.
    RelativeError,
}

impl MapOf {
    fn measure(self) -> Measure {
        match self {
            Self::Flip => Measure::Flip,
            Self::RelativeError => Measure::RelMse,
        }
    }
}

/// A picture to measure.
#[derive(Clone, Debug)]
pub enum Pictured {
    Light(Arc<Layers>),
    /// As the screen shows it.
    Screen(Arc<Shown>),
}

impl Pictured {
    fn picture(&self) -> Result<Picture> {
        match self {
            Self::Light(layers) => Picture::from_layers(layers, None),
            Self::Screen(shown) => {
                let pixels = shown.pixels.iter().map(|codes| codes.map(srgb::decode_u8)).collect();
                Picture::new(shown.size.width, shown.size.height, pixels)
            }
        }
    }
}

/// What is measured: B is the reference.
#[derive(Clone, Debug)]
pub struct Question {
    pub a: Pictured,
    pub b: Pictured,
    /// Numbers of the pictures.
    pub of: [u64; 2],
    pub map: Option<MapOf>,
    /// EV at which FLIP looks at both.
    pub exposure: f64,
}

impl Question {
    fn is(&self, other: &Self) -> bool {
        self.of == other.of && self.map == other.map && self.exposure == other.exposure
    }
}

/// How far A is from B.
#[derive(Clone, Debug)]
pub struct Answer {
    /// Numbers of the pictures.
    pub of: [u64; 2],
    /// Relative mean squared error, and FLIP: as `lucerna compare` has them.
    pub rel_mse: f64,
    pub flip: f64,
    /// Sum of the light of A over that of B.
    pub energy: f64,
    /// The map, its width and height, and its codes, row by row from the upper left corner.
    pub map: Option<(MapOf, [u32; 2], Vec<[u8; 3]>)>,
}

/// A thread that measures. The newest question counts.
#[derive(Debug)]
pub struct Measuring {
    shared: Arc<(Mutex<State>, Condvar)>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug, Default)]
struct State {
    next: Option<Question>,
    last: Option<Question>,
    answer: Option<Arc<Answer>>,
    failed: Option<String>,
    closing: bool,
}

fn lock(state: &Mutex<State>) -> MutexGuard<'_, State> {
    state.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

impl Measuring {
    /// Starts the thread.
    ///
    /// # Errors
    /// `Runtime` if the system gives no thread.
    pub fn start(waker: Wake) -> Result<Self> {
        let shared = Arc::new((Mutex::new(State::default()), Condvar::new()));
        let of_thread = shared.clone();
        let thread =
            std::thread::Builder::new().name("lucerna measures".into()).spawn(move || work(&of_thread, &waker));
        let thread = thread.map_err(|error| {
            Error::new(ErrorKind::Runtime, "no thread for measures could be started").caused_by(error)
        })?;
        Ok(Self { shared, thread: Some(thread) })
    }

    /// Asks, unless the same was asked last.
    pub fn ask(&self, question: Question) {
        let mut state = lock(&self.shared.0);
        if state.last.as_ref().is_some_and(|last| last.is(&question)) {
            return;
        }
        state.last = Some(question.clone());
        state.next = Some(question);
        self.shared.1.notify_all();
    }

    /// The newest answer, or why there is none.
    pub fn answer(&self) -> (Option<Arc<Answer>>, Option<String>) {
        let state = lock(&self.shared.0);
        (state.answer.clone(), state.failed.clone())
    }
}

impl Drop for Measuring {
    fn drop(&mut self) {
        lock(&self.shared.0).closing = true;
        self.shared.1.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn work(shared: &(Mutex<State>, Condvar), waker: &Wake) {
    loop {
        let mut state = lock(&shared.0);
        let question = loop {
            if state.closing {
                return;
            }
            match state.next.take() {
                Some(question) => break question,
                None => state = shared.1.wait(state).unwrap_or_else(|poisoned| poisoned.into_inner()),
            }
        };
        drop(state);
        let answer = answer(&question);
        let mut state = lock(&shared.0);
        match answer {
            Ok(answer) => (state.answer, state.failed) = (Some(Arc::new(answer)), None),
            Err(error) => (state.answer, state.failed) = (None, Some(error.to_string())),
        }
        drop(state);
        (waker.0)();
    }
}

/// Measures A against B.
///
/// # Errors
/// `Input` for pictures of different sizes.
pub fn answer(question: &Question) -> Result<Answer> {
    let (a, b) = (question.a.picture()?, question.b.picture()?);
    let pair = Pair::new(&b, &a)?;
    // One thread, because the other ones render.
    let mut options = Options { threads: Some(1), ..Options::default() };
    options.display.exposure = Exposure::Stops(question.exposure);
    let (rel_mse, flip) = (Measure::RelMse.of(&pair, &options)?, Measure::Flip.of(&pair, &options)?);
    let sum = |picture: &Picture| picture.pixels.iter().flatten().map(|value| f64::from(*value)).sum::<f64>();
    let map = question.map.map(|of| {
        let map = if of.measure() == Measure::Flip { &flip.map } else { &rel_mse.map };
        (of, [map.width, map.height], painted::of_map(&map.values, map.range))
    });
    Ok(Answer { of: question.of, rel_mse: rel_mse.value, flip: flip.value, energy: sum(&a) / sum(&b), map })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(value: f32, width: u32) -> Pictured {
        Pictured::Light(Arc::new(Layers::rgb(width, 16, vec![value; (width * 16 * 3) as usize])))
    }

    #[test]
    fn numbers_are_those_of_the_measures() {
        let question =
            Question { a: grey(0.4, 16), b: grey(0.5, 16), of: [1, 2], map: Some(MapOf::RelativeError), exposure: 0.0 };
        let found = answer(&question).unwrap();
        assert!((found.energy - 0.8).abs() < 1e-6);
        // (0.1)² / (0.5² + 0.01), in each channel.
        assert!((found.rel_mse - 0.01 / 0.26).abs() < 1e-4, "{}", found.rel_mse);
        assert!(found.flip > 0.01 && found.flip < 0.5);
        assert_eq!(found.map.unwrap().2.len(), 256);
        assert!(answer(&Question { b: grey(0.5, 8), ..question }).is_err());
    }

    #[test]
    fn the_newest_question_is_answered() {
        let measuring = Measuring::start(Wake(Arc::new(|| {}))).unwrap();
        for number in 0..20 {
            let of = [number, 0];
            measuring.ask(Question { a: grey(0.4, 64), b: grey(0.5, 64), of, map: None, exposure: 0.0 });
        }
        let begun = std::time::Instant::now();
        while measuring.answer().0.is_none_or(|answer| answer.of != [19, 0]) {
            assert!(begun.elapsed().as_secs() < 60);
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
    }
}
