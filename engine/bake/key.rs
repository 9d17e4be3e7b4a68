//! The inputs that decide the bytes of a job, as named parts.

use std::fmt;

use serde::{Deserialize, Serialize};

/// The BLAKE3 hash of some bytes: the same bytes have the same digest on every machine.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Digest(pub [u8; 32]);

impl Digest {
    /// The digest of some bytes.
    pub fn of(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }

    /// Reads the 64 hexadecimal digits that [`fmt::Display`] writes.
    pub fn parse(text: &str) -> Option<Self> {
        let lower = |b: u8| matches!(b, b'0'..=b'9' | b'a'..=b'f');
        if text.len() != 64 || !text.bytes().all(lower) {
            return None;
        }
        let mut out = [0; 32];
        for (byte, at) in out.iter_mut().zip((0..64).step_by(2)) {
            *byte = u8::from_str_radix(text.get(at..at + 2)?, 16).ok()?;
        }
        Some(Self(out))
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")
    }
}

impl Serialize for Digest {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Digest {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Self::parse(&text).ok_or_else(|| serde::de::Error::custom("a digest has 64 hexadecimal digits"))
    }
}

/// Something that a job's bytes depend on: a scene, an environment, settings, a version, a device.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    pub name: String,
    pub digest: Digest,
    /// A description for messages. Equality depends on the digest alone.
    pub text: String,
}

impl Part {
    /// A part that is known by its bytes.
    pub fn of(name: &str, bytes: &[u8], text: String) -> Self {
        Self { name: name.to_owned(), digest: Digest::of(bytes), text }
    }

    /// Names the parts of `ours` that are others in `theirs`, or that are not there; `None`: there are none.
    pub fn difference(ours: &[Self], theirs: &[Self]) -> Option<String> {
        let same = |part: &Self| theirs.iter().any(|other| other.name == part.name && other.digest == part.digest);
        let names: Vec<&str> = ours.iter().filter(|part| !same(part)).map(|part| part.name.as_str()).collect();
        (!names.is_empty()).then(|| names.join(", "))
    }
}

/// All that decides the bytes of a job. Two jobs with equal keys have equal bytes.
///
/// ```
/// use lucerna::bake::Key;
/// let key = |size: u32| Key::new("daylight", 1).part("scene", b"all its bytes", "hall.glb").text("size", &size.to_string());
/// assert_eq!(key(8).digest(), key(8).digest());
/// assert_eq!(key(8).difference(&key(9)).unwrap(), "`size` is `9` instead of `8`");
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Key {
    parts: Vec<Part>,
}

impl Key {
    /// For jobs of a kind. `version` counts the changes of the code that computes its units: other code gives other bytes.
    pub fn new(kind: &str, version: u32) -> Self {
        Self { parts: Vec::new() }.text("kind", kind).text("version", &version.to_string())
    }

    /// Adds a part that is known by its bytes; messages show `text`.
    #[must_use]
    pub fn part(mut self, name: &str, bytes: &[u8], text: &str) -> Self {
        self.parts.push(Part::of(name, bytes, text.to_owned()));
        self
    }

    /// Adds a part that is a short text itself.
    #[must_use]
    pub fn text(self, name: &str, text: &str) -> Self {
        self.part(name, text.as_bytes(), text)
    }

    /// Adds the scene's parts, and each member of a plan as a part with its JSON text; members that are objects have a part for each of their own
    /// members.
    #[must_use]
    pub fn plan(mut self, scene: &[Part], plan: &serde_json::Value) -> Self {
        for part in scene {
            self = self.text(&format!("scene.{}", part.name), &part.digest.to_string());
        }
        for (name, value) in plan.as_object().into_iter().flatten().filter(|(name, _)| *name != "parts") {
            self = match value {
                serde_json::Value::Object(members) => members
                    .iter()
                    .fold(self, |key, (member, value)| key.text(&format!("{name}.{member}"), &value.to_string())),
                value => self.text(name, &value.to_string()),
            };
        }
        self
    }

    /// In the order in which they were added.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// The text of a part.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.parts.iter().find(|part| part.name == name).map(|part| part.text.as_str())
    }

    /// The kind of the job.
    pub fn kind(&self) -> &str {
        self.get("kind").unwrap_or_default()
    }

    /// The digest of all parts' names and digests.
    pub fn digest(&self) -> Digest {
        let mut bytes = Vec::new();
        for part in &self.parts {
            bytes.extend_from_slice(&(part.name.len() as u64).to_le_bytes());
            bytes.extend_from_slice(part.name.as_bytes());
            bytes.extend_from_slice(&part.digest.0);
        }
        Digest::of(&bytes)
    }

    /// Says in which parts `other` differs; `None`: in none.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let find = |key: &Self, name: &str| key.parts.iter().find(|part| part.name == name).cloned();
        let mut said = Vec::new();
        for ours in &self.parts {
            match find(other, &ours.name) {
                Some(theirs) if theirs.digest == ours.digest => {}
                Some(theirs) if theirs.text == ours.text => {
                    said.push(format!("`{}` (`{}`) has other contents", ours.name, short(&ours.text)));
                }
                Some(theirs) => {
                    let (ours_are, theirs_are) = different(&ours.text, &theirs.text);
                    said.push(format!("`{}` is `{theirs_are}` instead of `{ours_are}`", ours.name));
                }
                None => said.push(format!("`{}` is not said", ours.name)),
            }
        }
        let more = other.parts.iter().filter(|part| find(self, &part.name).is_none());
        said.extend(more.map(|part| format!("`{}` is `{}`, and is nothing here", part.name, short(&part.text))));
        (!said.is_empty()).then(|| said.join("; "))
    }
}

/// Characters of a part that a message shows.
const SHOWN: usize = 60;

fn short(text: &str) -> String {
    match text.char_indices().nth(SHOWN) {
        Some((at, _)) => format!("{}…", &text[..at]),
        None => text.to_owned(),
    }
}

/// Both texts from shortly before the place where they differ.
fn different(a: &str, b: &str) -> (String, String) {
    let same = a.chars().zip(b.chars()).take_while(|(a, b)| a == b).count();
    if a.chars().count().max(b.chars().count()) <= SHOWN || same < SHOWN / 2 {
        return (short(a), short(b));
    }
    let from = |text: &str| format!("…{}", short(&text.chars().skip(same - SHOWN / 3).collect::<String>()));
    (from(a), from(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digests_are_the_published_ones_and_read_back() {
        let empty = Digest::of(b"");
        assert_eq!(empty.to_string(), "af1349b9f5f9a1a6a0404dea36dcc9499bcb25c9adc112b7cc9a93cae41f3262");
        assert_eq!(Digest::parse(&empty.to_string()), Some(empty));
        for bad in ["", "af", &"g".repeat(64), &"A".repeat(64), &"é".repeat(32)] {
            assert_eq!(Digest::parse(bad), None);
        }
        let text = serde_json::to_string(&empty).unwrap();
        assert_eq!(serde_json::from_str::<Digest>(&text).unwrap(), empty);
        assert!(serde_json::from_str::<Digest>("\"af\"").is_err());
    }

    #[test]
    fn every_part_counts_and_what_differs_is_named() {
        let key = Key::new("fiv", 1).part("scene", b"1", "queen").text("size", "8");
        assert_eq!((key.kind(), key.get("size"), key.difference(&key)), ("fiv", Some("8"), None));
        let others = [
            (Key::new("prt", 1).part("scene", b"1", "queen").text("size", "8"), "`kind` is `prt` instead of `fiv`"),
            (Key::new("fiv", 2).part("scene", b"1", "queen").text("size", "8"), "`version` is `2` instead of `1`"),
            (Key::new("fiv", 1).part("scene", b"2", "queen").text("size", "8"), "`scene` (`queen`) has other contents"),
            (Key::new("fiv", 1).part("scene", b"1", "queen").text("size", "9"), "`size` is `9` instead of `8`"),
            (Key::new("fiv", 1).part("scene", b"1", "queen"), "`size` is not said"),
            (key.clone().text("seed", "3"), "`seed` is `3`, and is nothing here"),
        ];
        for (other, said) in others {
            assert_ne!(key.digest(), other.digest());
            assert_eq!(key.difference(&other).unwrap(), said);
        }
        // Names and contents do not run into each other.
        assert_ne!(Key::new("a", 1).text("bc", "d").digest(), Key::new("a", 1).text("b", "cd").digest());
        // The text is for readers alone.
        let renamed = Key::new("fiv", 1).part("scene", b"1", "king").text("size", "8");
        assert_eq!((key.digest(), key.difference(&renamed)), (renamed.digest(), None));
    }

    #[test]
    fn long_texts_are_shown_where_they_differ() {
        let long = |end: &str| format!("{}{end}", "é".repeat(500));
        let said = Key::new("k", 1).text("s", &long("1")).difference(&Key::new("k", 1).text("s", &long("2"))).unwrap();
        assert!(said.contains("é2` instead of") && said.chars().count() < 120, "{said}");
    }
}
