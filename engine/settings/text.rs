//! A description for people: ranges in words, TOML with comments, tables in Markdown.

use super::{Allowed, Description, Key, Kind, description::plain};
use serde_json::Value;
use std::fmt::{self, Display, Formatter};

/// Width of comments in TOML, characters.
const WIDTH: usize = 100;

impl Display for Allowed {
    fn fmt(&self, to: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::All => to.write_str("any"),
            Self::Listed(all) => {
                let all: Vec<String> = all.iter().map(ToString::to_string).collect();
                to.write_str(&all.join(", "))
            }
            Self::Range { least, most, multiple_of, or_zero } => {
                if *or_zero {
                    to.write_str("0, or ")?;
                }
                if let Some(step) = multiple_of {
                    write!(to, "multiples of {step} from ")?;
                }
                write!(to, "{} to {}", number(*least), number(*most))
            }
        }
    }
}

/// Large and small numbers as powers of ten.
fn number(value: f64) -> String {
    let power = format!("{value:e}");
    // All digits of a whole number are shorter than a power of ten with as many.
    let plain = value == 0.0 || (1e-4..1e6).contains(&value.abs()) || (value.fract() == 0.0 && power.len() > 8);
    if plain { value.to_string() } else { power }
}

impl Key {
    /// The values that are allowed, in words; empty where the kind says it.
    pub fn values(&self) -> String {
        match &self.kind {
            Kind::Switch => "true, false".to_owned(),
            Kind::Choice(all) => all.iter().map(|choice| choice.name.as_str()).collect::<Vec<_>>().join(", "),
            Kind::Clock => "00:00 to 23:59".to_owned(),
            Kind::Text => String::new(),
            Kind::Whole | Kind::Number => match &self.allowed {
                Allowed::All => String::new(),
                range if self.unit.is_empty() => range.to_string(),
                range => format!("{range} {}", self.unit),
            },
        }
    }

    /// What the key needs to have an effect, in words; empty: nothing.
    pub fn needs(&self) -> String {
        let condition = |(key, schema): &(String, Value)| format!("{key} {}", condition(schema));
        self.needs.iter().map(condition).collect::<Vec<_>>().join(", ")
    }

    /// The docs, and for a choice what each word means: lines without an end mark.
    fn lines(&self) -> Vec<String> {
        let mut lines: Vec<String> = paragraphs(&self.doc).collect();
        if let Kind::Choice(all) = &self.kind {
            let documented = all.iter().filter(|choice| !choice.doc.is_empty());
            lines.extend(documented.flat_map(|choice| {
                let mut doc = paragraphs(&choice.doc);
                doc.next().map(|first| format!("{}: {first}", choice.name)).into_iter().chain(doc).collect::<Vec<_>>()
            }));
        }
        lines
    }
}

fn condition(schema: &Value) -> String {
    let rules = schema.as_object().into_iter().flatten();
    let said = rules.map(|(rule, with)| match rule.as_str() {
        "const" => format!("= {}", plain(with)),
        "enum" => {
            let words: Vec<String> = with.as_array().into_iter().flatten().map(plain).collect();
            format!("= {}", words.join(" or "))
        }
        "minimum" => format!("at least {with}"),
        "exclusiveMinimum" => format!("above {with}"),
        "not" => format!("not {}", condition(with)),
        other => other.to_owned(),
    });
    said.collect::<Vec<_>>().join(" and ")
}

/// Paragraphs of docs, each as one line, without Markdown's links.
fn paragraphs(doc: &str) -> impl Iterator<Item = String> {
    doc.split("\n\n").filter(|paragraph| !paragraph.trim().is_empty()).map(|paragraph| {
        let line = paragraph.split_whitespace().collect::<Vec<_>>().join(" ");
        line.replace("[`", "`").replace("`]", "`").replace("Settings::", "").replace("Self::", "")
    })
}

impl Key {
    /// What a person has to know who writes the key into a TOML file, as comment lines of at most 100 characters.
    pub fn comment(&self) -> Vec<String> {
        let mut about = self.lines();
        about.extend(
            Some(self.values()).filter(|values| !values.is_empty()).map(|values| format!("Allowed: {values}.")),
        );
        about.extend(Some(self.needs()).filter(|needs| !needs.is_empty()).map(|needs| format!("Needs {needs}.")));
        about.iter().flat_map(|line| wrapped(line)).map(|line| format!("# {line}")).collect()
    }
}

impl Description {
    /// The table of the keys in Markdown: key, values, default, what the key does.
    pub fn table(&self) -> String {
        let mut out = "| key | values | default | |\n|---|---|---|---|\n".to_owned();
        for key in &self.keys {
            let mut about = key.lines().join(" ");
            if !key.needs.is_empty() {
                about.push_str(&format!(" Needs {}.", key.needs()));
            }
            let cell = |text: &str| text.trim().replace('|', "\\|");
            let (values, default) = (key.values(), plain(&key.default));
            out.push_str(&format!("| `{}` | {} | {} | {} |\n", key.name, cell(&values), cell(&default), cell(&about)));
        }
        out
    }
}

/// A line in pieces of at most [`WIDTH`] characters, but for longer words.
fn wrapped(line: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in line.split(' ') {
        let last = lines.last_mut().expect("there is one");
        if !last.is_empty() && last.chars().count() + 1 + word.chars().count() > WIDTH {
            lines.push(word.to_owned());
        } else {
            last.push_str(if last.is_empty() { "" } else { " " });
            last.push_str(word);
        }
    }
    lines
}
