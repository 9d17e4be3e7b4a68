//! The one error type of the engine: what failed, where, what was found and allowed, what to do about it.

use std::{
    fmt,
    path::{Path, PathBuf},
};

/// Result of everything in the engine that the outside world can make fail.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What a caller can act on. Each kind has its own process exit code ([`Error::exit_code`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ErrorKind {
    /// The program was called in a way it cannot serve (unknown name, impossible combination of options).
    Usage,
    /// An input file is unreadable, malformed, over a limit, or asks for something that is not supported.
    Input,
    /// There is no Vulkan loader, no driver, or no device that meets the requirements.
    NoDevice,
    /// Host or device memory ran out.
    OutOfMemory,
    /// The device was lost, or a wait never ended.
    DeviceLost,
    /// A comparison was over its threshold.
    Comparison,
    /// An output could not be written. Nothing of it was left behind.
    Output,
    /// It was asked to stop before it was done ([`crate::Stop`]).
    Interrupted,
    /// Anything else that failed while running.
    Runtime,
}

/// What failed (`what`), on which file (`file`) and at which place in it (`place`), caused by what (`source`), and
/// what the reader can do (`help`).
///
/// Displays on one line as `FILE: PLACE: WHAT. HELP`, with the cause after a colon.
#[derive(Debug)]
pub struct Error(Box<Inner>);

#[derive(Debug)]
struct Inner {
    kind: ErrorKind,
    file: Option<PathBuf>,
    place: Option<String>,
    what: String,
    help: Option<String>,
    source: Option<Box<dyn std::error::Error + Send + Sync>>,
}

impl Error {
    /// A new error; `what` says what was found and what is allowed, without a final full stop.
    pub fn new(kind: ErrorKind, what: impl Into<String>) -> Self {
        Self(Box::new(Inner { kind, file: None, place: None, what: what.into(), help: None, source: None }))
    }

    /// Malformed or unsupported input.
    pub fn input(what: impl Into<String>) -> Self {
        Self::new(ErrorKind::Input, what)
    }

    /// A call that cannot be served.
    pub fn usage(what: impl Into<String>) -> Self {
        Self::new(ErrorKind::Usage, what)
    }

    /// Names the file (the outermost caller wins only if no file is named yet).
    #[must_use]
    pub fn in_file(mut self, file: impl AsRef<Path>) -> Self {
        self.0.file.get_or_insert_with(|| file.as_ref().to_path_buf());
        self
    }

    /// Names the place: `meshes[3].primitives[0].indices`, a line, or a pass. Called from the inside out, each call
    /// puts its part in front: `at("indices")` then `at("meshes[3]")` reads `meshes[3].indices`.
    #[must_use]
    pub fn at(mut self, place: impl AsRef<str>) -> Self {
        let place = place.as_ref();
        self.0.place = Some(match self.0.place.take() {
            Some(inner) if inner.starts_with('[') => format!("{place}{inner}"),
            Some(inner) => format!("{place}.{inner}"),
            None => place.to_owned(),
        });
        self
    }

    /// The same of another kind: what is wrong with a call is wrong with a file where the file says it.
    #[must_use]
    pub fn of_kind(mut self, kind: ErrorKind) -> Self {
        self.0.kind = kind;
        self
    }

    /// What the reader can do about it: a full sentence without its final full stop.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.0.help = Some(help.into());
        self
    }

    /// The error below this one.
    #[must_use]
    pub fn caused_by(mut self, source: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> Self {
        self.0.source = Some(source.into());
        self
    }

    /// What a caller can act on.
    pub fn kind(&self) -> ErrorKind {
        self.0.kind
    }

    /// The file it happened in, if it is about a file.
    pub fn file(&self) -> Option<&Path> {
        self.0.file.as_deref()
    }

    /// The place inside the file, or the pass, if known.
    pub fn place(&self) -> Option<&str> {
        self.0.place.as_deref()
    }

    /// What was found and what is allowed.
    pub fn what(&self) -> &str {
        &self.0.what
    }

    /// The process exit code that the executables use for this kind of error.
    pub fn exit_code(&self) -> u8 {
        match self.0.kind {
            ErrorKind::Runtime | ErrorKind::Output => 1,
            ErrorKind::Usage => 2,
            ErrorKind::Input => 3,
            ErrorKind::NoDevice => 4,
            ErrorKind::OutOfMemory => 5,
            ErrorKind::DeviceLost => 6,
            ErrorKind::Comparison => 7,
            // As a shell says it of a program that SIGINT ended.
            ErrorKind::Interrupted => 130,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.0.file {
            write!(f, "{}: ", file.display())?;
        }
        if let Some(place) = &self.0.place {
            write!(f, "{place}: ")?;
        }
        f.write_str(&self.0.what)?;
        if let Some(source) = &self.0.source {
            write!(f, ": {source}")?;
        }
        if let Some(help) = &self.0.help {
            write!(f, ". {help}.")?;
        }
        Ok(())
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.0.source.as_ref().map(|s| s.as_ref() as _)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_as_one_line_that_names_file_place_and_remedy() {
        let error = Error::input("index 999999 (at 2) but POSITION has 3 vertices")
            .at("indices")
            .at("primitives[0]")
            .at("meshes[3]")
            .in_file("hall.gltf")
            .help("The file is not valid glTF; re-export it");
        assert_eq!(
            error.to_string(),
            "hall.gltf: meshes[3].primitives[0].indices: index 999999 (at 2) but POSITION has 3 vertices. \
             The file is not valid glTF; re-export it."
        );
        assert_eq!(error.exit_code(), 3);
    }
}
