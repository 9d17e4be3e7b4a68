//! Collects what a user must know about a scene, without letting a hostile file fill memory with it.

use super::{Note, NoteKind};

const MOST: usize = 256;

/// Notes in the order in which they came, each once.
#[derive(Debug, Default)]
pub(crate) struct Notes {
    notes: Vec<Note>,
    dropped: usize,
}

impl Notes {
    pub fn ignored(&mut self, place: impl Into<String>, text: impl Into<String>) {
        self.push(NoteKind::Ignored, place.into(), text.into());
    }

    pub fn approximated(&mut self, place: impl Into<String>, text: impl Into<String>) {
        self.push(NoteKind::Approximated, place.into(), text.into());
    }

    pub fn repaired(&mut self, place: impl Into<String>, text: impl Into<String>) {
        self.push(NoteKind::Repaired, place.into(), text.into());
    }

    fn push(&mut self, kind: NoteKind, place: String, text: String) {
        let note = Note { kind, place, text };
        if self.notes.contains(&note) {
            return;
        }
        if self.notes.len() < MOST {
            self.notes.push(note);
        } else {
            self.dropped += 1;
        }
    }

    pub fn finish(mut self) -> Vec<Note> {
        if self.dropped > 0 {
            self.notes.push(Note {
                kind: NoteKind::Ignored,
                place: "notes".into(),
                text: format!("{} more notes are not listed", self.dropped),
            });
        }
        self.notes
    }
}
