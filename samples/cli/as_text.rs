//! Option values that files hold in the form of the command line.

/// Reads and writes a type by its `FromStr` and `Display`, for `#[serde(into = "String", try_from = "String")]`.
macro_rules! as_text {
    ($kind:ty) => {
        impl TryFrom<String> for $kind {
            type Error = String;

            fn try_from(text: String) -> Result<Self, String> {
                text.parse()
            }
        }

        impl From<$kind> for String {
            fn from(value: $kind) -> Self {
                value.to_string()
            }
        }
    };
}
pub(crate) use as_text;
