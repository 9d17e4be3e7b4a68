//! Pictures from standard input: the name `-`.

use std::io::Read;

use lucerna::{Error, Result};

/// Standard input or output as a file name.
pub const PIPE: &str = "-";
/// Name of standard input in messages.
pub const STDIN: &str = "standard input";

/// All bytes of standard input.
///
/// # Errors
/// `Input` if it cannot be read, or holds more than `most` bytes.
pub fn bytes(most: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    std::io::stdin()
        .lock()
        .take(most + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| Error::input("cannot be read").caused_by(error))?;
    if bytes.len() as u64 > most {
        return Err(Error::input(format!("more than {most} bytes")));
    }
    Ok(bytes)
}

/// # Errors
/// `Usage` if `names` has standard input twice, because it can be read only once.
pub fn once<'a>(names: impl IntoIterator<Item = &'a str>) -> Result<()> {
    match names.into_iter().filter(|name| *name == PIPE).count() {
        0 | 1 => Ok(()),
        _ => Err(Error::usage("standard input (-) is named twice").help("Write one of the pictures into a file")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn standard_input_is_read_once() {
        once(["a.exr", "-"]).unwrap();
        assert_eq!(once(["-", "a.exr", "-"]).unwrap_err().exit_code(), 2);
    }
}
