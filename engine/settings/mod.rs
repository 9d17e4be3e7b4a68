//! The one description of a settings type, from which everything else that knows keys is derived: checks of ranges, keys without effect,
//! differences, the commented TOML of `--print-config`, tables of the documentation, the JSON schema for other programs.
//!
//! A settings type is a plain struct that derives [`schemars::JsonSchema`]. The description of a key stands at its field:
//!
//! * the doc comment says what the key does; the docs of an enum's variants say what each value does;
//! * `#[schemars(range(min = 1, max = 64))]` is the range of a number, ends included;
//! * `extend("enum" = [24, 48, 80])` lists the numbers that are allowed, `extend("multipleOf" = 8)` allows multiples only,
//!   `extend("x-zero" = true)` allows 0 beside the range;
//! * `extend("x-unit" = "W/(sr·m²)")` is the unit;
//! * `extend("x-decides" = "bake")` marks a key that what is computed beforehand depends on; other keys decide pictures alone;
//! * `extend("x-option" = "Look")` gives a key a command line option of its own, under this heading;
//! * `extend("x-needs" = {"picks": {"minimum": 1}})` are conditions on other keys, written as schemas; without them the key has no effect.
//!
//! The default is that of the type's `Default`.

mod description;
mod notes;
mod schema;
mod text;

pub use description::{Allowed, Choice, Decides, Description, Difference, Idle, Key, Kind};
pub use notes::idle_notes;
pub use schemars::JsonSchema;

/// A settings type with its description.
pub trait Described: serde::Serialize + Default + JsonSchema + Sized {
    /// The description; made once.
    fn description() -> &'static Description;
}

/// Gives a settings type its [`Described`].
macro_rules! described {
    ($settings:ty) => {
        impl $crate::settings::Described for $settings {
            fn description() -> &'static $crate::settings::Description {
                static DESCRIPTION: std::sync::LazyLock<$crate::settings::Description> =
                    std::sync::LazyLock::new($crate::settings::Description::of::<$settings>);
                &DESCRIPTION
            }
        }
    };
}
pub(crate) use described;

#[cfg(test)]
mod tests;
