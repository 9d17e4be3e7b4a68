//! The frame around `main`: errors become one line and an exit code, panics too.

use std::process::ExitCode;

use lucerna::{Error, ErrorKind, Result};

use crate::{
    console::Console,
    notes,
    signals::{self, Interrupt},
};

/// Exit code: the program was stopped before all work was done, but a part of the output is complete.
pub const STOPPED_EARLY: u8 = 8;
/// Exit code: SIGINT stopped the program before any output was written.
pub const INTERRUPTED: u8 = 130;

/// Runs a program's body. Exit codes: the body's exit code on success, else [`Error::exit_code`].
pub fn run(console: Console, body: impl FnOnce() -> Result<ExitCode>) -> ExitCode {
    Interrupt::catch(console);
    notes::show(console);
    std::panic::set_hook(Box::new(move |info| {
        let place = info.location().map(|at| format!(" at {}:{}", at.file(), at.line())).unwrap_or_default();
        let payload = info.payload();
        let text = payload.downcast_ref::<&str>().copied().or(payload.downcast_ref::<String>().map(String::as_str));
        let text = text.unwrap_or("no message");
        console.error(&Error::new(
            lucerna::ErrorKind::Runtime,
            format!(
                "internal error{place}: {text}. This is a bug in lucerna; please report it with the command you ran"
            ),
        ));
        if std::env::var_os("RUST_BACKTRACE").is_some_and(|v| v != "0") {
            eprintln!("{}", std::backtrace::Backtrace::force_capture());
        }
    }));
    match std::panic::catch_unwind(std::panic::AssertUnwindSafe(body)) {
        Ok(Ok(code)) => {
            signals::let_it_be_said();
            code
        }
        Ok(Err(error)) => match signals::stopped().filter(|_| by_request(&error)) {
            Some(code) => {
                signals::let_it_be_said();
                ExitCode::from(code)
            }
            None => {
                console.error(&error);
                ExitCode::from(error.exit_code())
            }
        },
        Err(_) => ExitCode::from(1),
    }
}

/// Whether the error is the consequence of a request to stop. A device that was interrupted in its work reports further errors.
pub fn by_request(error: &Error) -> bool {
    matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::DeviceLost)
}

/// The version, for `--version` and for the metadata of pictures.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The git revision of the build, if it was built in a checkout; with `+` if files were edited since.
pub fn revision() -> Option<&'static str> {
    option_env!("LUCERNA_REVISION").filter(|revision| !revision.is_empty())
}
