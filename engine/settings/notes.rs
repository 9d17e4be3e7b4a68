//! Notes about settings without effect.

use super::Described;
use crate::scene::{Note, NoteKind};

/// A note for each key that is not at its default and has no effect, with the condition that is not met. `group`: name of the settings in
/// files and on the command line.
pub fn idle_notes<S: Described>(group: &str, settings: &S) -> Vec<Note> {
    let idle = S::description().idle(settings).unwrap_or_default().into_iter();
    idle.map(|idle| Note {
        kind: NoteKind::Ignored,
        place: format!("{group}.{}", idle.key),
        text: format!("has no effect, because {group}.{}", idle.because),
    })
    .collect()
}
