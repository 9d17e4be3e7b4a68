//! `data:` URIs (RFC 2397).

use crate::{Error, Result, scene::folder::percent_decode};

/// The bytes of a data URI and its media type.
#[derive(Debug)]
pub struct Data {
    pub mime: String,
    pub bytes: Vec<u8>,
}

/// Decodes `uri` if it is a data URI.
pub fn decode(uri: &str) -> Option<Result<Data>> {
    let scheme = uri.get(..5)?;
    scheme.eq_ignore_ascii_case("data:").then(|| body(&uri[5..]))
}

fn body(text: &str) -> Result<Data> {
    let (head, payload) = text.split_once(',').ok_or_else(|| Error::input("the data URI has no comma"))?;
    let (mime, base64) = match head.strip_suffix(";base64") {
        Some(mime) => (mime, true),
        None => (head, false),
    };
    let mime = mime.split(';').next().unwrap_or_default().to_ascii_lowercase();
    let bytes = if base64 { decode_base64(payload)? } else { percent_decode(payload.as_bytes()) };
    Ok(Data { mime, bytes })
}

/// Standard alphabet (RFC 4648, section 4); padding may be missing.
fn decode_base64(text: &str) -> Result<Vec<u8>> {
    let digits = text.trim_end_matches('=').as_bytes();
    if text.len() - digits.len() > 2 || digits.len() % 4 == 1 {
        return Err(Error::input("the data URI is cut off: its base64 text has the wrong length"));
    }
    let mut out = Vec::with_capacity(digits.len() / 4 * 3 + 3);
    for (i, chunk) in digits.chunks(4).enumerate() {
        let mut word = 0u32;
        for (j, &digit) in chunk.iter().enumerate() {
            let value = match digit {
                b'A'..=b'Z' => digit - b'A',
                b'a'..=b'z' => digit - b'a' + 26,
                b'0'..=b'9' => digit - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                _ => {
                    return Err(Error::input(format!(
                        "character {:?} at {} of the data URI is not base64",
                        digit as char,
                        i * 4 + j
                    )));
                }
            };
            word |= u32::from(value) << (18 - 6 * j);
        }
        out.extend_from_slice(&word.to_be_bytes()[1..chunk.len()]);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_of_rfc_4648() {
        for (text, want) in
            [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYg", "foob"), ("Zm9vYmFy", "foobar")]
        {
            assert_eq!(decode_base64(text).unwrap(), want.as_bytes());
        }
        assert!(decode_base64("Zm9vY").is_err());
        assert!(decode_base64("Zm*v").is_err());
    }

    #[test]
    fn media_type_and_encodings() {
        let data = decode("data:image/PNG;base64,Zm8=").unwrap().unwrap();
        assert_eq!((data.mime.as_str(), data.bytes.as_slice()), ("image/png", b"fo".as_slice()));
        assert_eq!(decode("data:,a%20b").unwrap().unwrap().bytes, b"a b");
        assert!(decode("data:;base64").unwrap().is_err());
        assert!(decode("box.bin").is_none());
        assert!(decode("dat❤").is_none());
    }
}
