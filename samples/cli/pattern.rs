//! Output names with placeholders: `{scene} {camera} {technique} {frame:04} {layer}`.

use lucerna::{Error, Result};

/// A parsed output name. `{{` and `}}` are braces.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pattern {
    text: String,
    pieces: Vec<Piece>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Piece {
    Text(String),
    Scene,
    Camera,
    Technique,
    /// Digits to pad to.
    Frame(usize),
    Layer,
}

/// The values of the placeholders.
#[derive(Clone, Copy, Debug)]
pub struct Values<'a> {
    pub scene: &'a str,
    pub camera: &'a str,
    pub technique: &'a str,
    pub frame: u32,
    pub layer: &'a str,
}

const ALLOWED: &str = "allowed are {scene}, {camera}, {technique}, {frame}, {frame:04} and {layer}";

impl Pattern {
    /// Reads `text`; an unknown placeholder or a lone brace is a usage error.
    pub fn parse(text: &str) -> Result<Self> {
        let wrong = |what: String| Err(Error::usage(format!("output '{text}': {what}; {ALLOWED}")));
        let mut pieces = Vec::new();
        let mut literal = String::new();
        let mut rest = text;
        while let Some(at) = rest.find(['{', '}']) {
            let (before, from_brace) = rest.split_at(at);
            literal.push_str(before);
            if from_brace.starts_with("{{") || from_brace.starts_with("}}") {
                literal.push_str(&from_brace[..1]);
                rest = &from_brace[2..];
                continue;
            }
            let Some(end) = from_brace.find('}').filter(|_| from_brace.starts_with('{')) else {
                return wrong("a brace stands alone (write {{ or }} for a brace)".into());
            };
            let name = &from_brace[1..end];
            let piece = match name.split_once(':') {
                None if name == "scene" => Piece::Scene,
                None if name == "camera" => Piece::Camera,
                None if name == "technique" => Piece::Technique,
                None if name == "frame" => Piece::Frame(1),
                None if name == "layer" => Piece::Layer,
                Some(("frame", width)) => match width.parse() {
                    Ok(width @ 1..=9) => Piece::Frame(width),
                    _ => return wrong(format!("'{{{name}}}' needs a width from 1 to 9")),
                },
                _ => return wrong(format!("unknown placeholder '{{{name}}}'")),
            };
            if !literal.is_empty() {
                pieces.push(Piece::Text(std::mem::take(&mut literal)));
            }
            pieces.push(piece);
            rest = &from_brace[end + 1..];
        }
        literal.push_str(rest);
        if !literal.is_empty() {
            pieces.push(Piece::Text(literal));
        }
        Ok(Self { text: text.to_owned(), pieces })
    }

    /// The name with the values filled in. Path separators in values become `-`, so that values never add a folder.
    pub fn fill(&self, values: &Values<'_>) -> String {
        let mut out = String::new();
        for piece in &self.pieces {
            match piece {
                Piece::Text(text) => out.push_str(text),
                Piece::Scene => out.push_str(&file_part(values.scene)),
                Piece::Camera => out.push_str(&file_part(values.camera)),
                Piece::Technique => out.push_str(&file_part(values.technique)),
                Piece::Layer => out.push_str(&file_part(values.layer)),
                Piece::Frame(width) => out.push_str(&format!("{:0width$}", values.frame, width = *width)),
            }
        }
        out
    }

    /// The pattern as the user wrote it.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// True if different frames get different names.
    pub fn has_frame(&self) -> bool {
        self.pieces.iter().any(|piece| matches!(piece, Piece::Frame(_)))
    }

    /// True if different layers get different names.
    pub fn has_layer(&self) -> bool {
        self.pieces.contains(&Piece::Layer)
    }
}

/// A name as part of a file name: without separators, spaces and leading dots, and never empty.
pub fn file_part(name: &str) -> String {
    let clean: String = name
        .chars()
        .map(|c| if c.is_alphanumeric() || matches!(c, '.' | '_' | '-' | '+') { c } else { '-' })
        .take(100)
        .collect();
    let clean = clean.trim_start_matches(['.', '-']).trim_end_matches('-');
    if clean.is_empty() { "unnamed".into() } else { clean.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VALUES: Values<'_> =
        Values { scene: "cornell", camera: "front/left", technique: "isr", frame: 7, layer: "indirect" };

    #[test]
    fn fills_every_placeholder() {
        let pattern = Pattern::parse("out/{scene}_{camera}-{technique}.{frame:04}.{layer}.exr").unwrap();
        assert_eq!(pattern.fill(&VALUES), "out/cornell_front-left-isr.0007.indirect.exr");
        assert!(pattern.has_frame() && pattern.has_layer());
        let plain = Pattern::parse("a{{b}}{frame}.png").unwrap();
        assert_eq!(plain.fill(&VALUES), "a{b}7.png");
        assert!(!plain.has_layer());
    }

    #[test]
    fn refuses_what_it_does_not_know_and_says_what_it_does() {
        for bad in ["{frames}.png", "{frame:x}.png", "{frame:0}.png", "{", "a}b", "{scene", "{}"] {
            let error = Pattern::parse(bad).unwrap_err();
            assert_eq!(error.exit_code(), 2, "{bad}");
            assert!(error.to_string().contains("{frame:04}"), "{error}");
        }
    }

    #[test]
    fn values_cannot_leave_the_folder() {
        assert_eq!(file_part("../../etc/passwd"), "etc-passwd");
        assert_eq!(file_part(".."), "unnamed");
        assert_eq!(file_part("Kamera Süd"), "Kamera-Süd");
    }
}
