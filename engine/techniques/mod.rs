//! The papers' methods, one module each.

pub(crate) mod allowed;
pub mod daylight;
pub mod fiv;
pub mod igi;
pub mod isr;
pub mod prt;
pub mod tonemap;

use crate::{
    passes,
    settings::{Described, Description},
    technique::Technique,
    tracer::Reference,
};

/// Code that is the same for all techniques, for [`visit`].
pub trait Visitor {
    type Output;

    fn visit<T: Technique + 'static>(self) -> Self::Output;
}

/// Makes [`NAMES`], [`visit`] and the descriptions from one list of the techniques that render scenes.
macro_rules! techniques {
    ($($technique:ty,)*) => {
        /// Names of the techniques that render scenes.
        pub const NAMES: &[&str] = &[$(<$technique as Technique>::NAME),*];

        /// Calls the visitor with the technique of this name. `None` if there is none.
        pub fn visit<V: Visitor>(name: &str, visitor: V) -> Option<V::Output> {
            $(if name == <$technique as Technique>::NAME {
                return Some(visitor.visit::<$technique>());
            })*
            None
        }

        /// The techniques by their names in `-D igi.vpls=500`, with the description of their settings; then the bakes of `daylight` and `prt`, the passes
        /// before techniques and the tone mapping after them.
        pub fn descriptions() -> Vec<(&'static str, &'static Description)> {
            vec![
                $((<$technique as Technique>::NAME, <$technique as Technique>::description()),)*
                ("bake", daylight::Baking::description()),
                ("room", prt::Baking::description()),
                ("gbuffer", passes::gbuffer::Settings::description()),
                ("shadow", passes::shadow::Settings::description()),
                ("tonemap", tonemap::Settings::description()),
            ]
        }
    };
}

techniques! {
    isr::Isr,
    igi::Igi,
    fiv::Fiv,
    daylight::Daylight,
    prt::Prt,
    Reference,
}
