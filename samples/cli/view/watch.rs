//! Looks whether the file of the scene changes.

use std::{
    fs,
    path::PathBuf,
    sync::{
        Arc, Weak,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, SystemTime},
};

use super::session::Wake;

/// Time between two looks.
const EVERY: Duration = Duration::from_millis(400);

/// A file that is looked after until this value is dropped.
#[derive(Debug)]
pub struct Watch(Arc<AtomicBool>);

/// What says that a file is another one.
type Stamp = Option<(SystemTime, u64)>;

fn stamp(file: &PathBuf) -> Stamp {
    let about = fs::metadata(file).ok()?;
    Some((about.modified().ok()?, about.len()))
}

impl Watch {
    /// Looks after a file from now on. Without a thread nothing is noticed, and Ctrl R still reads the scene again.
    pub fn start(file: PathBuf, wake: Wake) -> Self {
        let changed = Arc::new(AtomicBool::new(false));
        let weak = Arc::downgrade(&changed);
        let first = stamp(&file);
        let _ =
            std::thread::Builder::new().name("lucerna watches".into()).spawn(move || look(&file, first, &weak, &wake));
        Self(changed)
    }

    /// Whether the file has changed since the last question.
    pub fn changed(&self) -> bool {
        self.0.swap(false, Ordering::Relaxed)
    }
}

fn look(file: &PathBuf, first: Stamp, changed: &Weak<AtomicBool>, wake: &Wake) {
    let (mut told, mut before) = (first, first);
    loop {
        std::thread::sleep(EVERY);
        let Some(changed) = changed.upgrade() else { return };
        let now = stamp(file);
        // A file that is being written has another length in the next look. A file that is gone may come back.
        if now.is_some() && now != told && now == before {
            told = now;
            changed.store(true, Ordering::Relaxed);
            (wake.0)();
        }
        before = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::{sync::mpsc, time::Instant};

    #[test]
    fn a_file_that_changes_is_told_once_and_one_that_is_gone_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.glb");
        fs::write(&file, "a").unwrap();
        let (sender, receiver) = mpsc::channel();
        let watch = Watch::start(file.clone(), Wake(Arc::new(move || sender.send(()).unwrap_or_default())));
        assert!(!watch.changed());
        fs::remove_file(&file).unwrap();
        assert!(receiver.recv_timeout(3 * EVERY).is_err());
        fs::write(&file, "ab").unwrap();
        let begun = Instant::now();
        receiver.recv_timeout(Duration::from_secs(60)).unwrap();
        assert!(begun.elapsed() >= EVERY && watch.changed() && !watch.changed());
        assert!(receiver.recv_timeout(3 * EVERY).is_err());
    }
}
