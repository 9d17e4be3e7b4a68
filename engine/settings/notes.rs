//! Notes about settings without effect.

use super::Described;
use crate::scene::{Note, NoteKind};

/// Notes about the keys that are not at their default and have no effect: one for each condition that is not met. `group`: name of the settings
/// in files and on the command line.
pub fn idle_notes<S: Described>(group: &str, settings: &S) -> Vec<Note> {
    let mut reasons: Vec<(String, Vec<String>)> = Vec::new();
    for idle in S::description().idle(settings).unwrap_or_default() {
        let key = format!("{group}.{}", idle.key);
        match reasons.iter_mut().find(|(because, _)| *because == idle.because) {
            Some((_, keys)) => keys.push(key),
            None => reasons.push((idle.because, vec![key])),
        }
    }
    let note = |(because, keys): (String, Vec<String>)| {
        let have = if keys.len() == 1 { "has" } else { "have" };
        let text = format!("{have} no effect, because {group}.{because}");
        Note { kind: NoteKind::Ignored, place: keys.join(", "), text }
    };
    reasons.into_iter().map(note).collect()
}
