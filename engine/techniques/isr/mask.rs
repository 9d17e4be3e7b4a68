//! The radiation mask ρ_P of [ISR 25]: the share of the indirect light that a surface receives and sends, for each material.
//!
//! The dissertation keeps the mask in the alpha channel of the colours of its G-buffer (section 4.2) and does not say how an artist chooses it.
//! Here a setting names materials ([`super::Settings::mask`]).

use std::borrow::Cow;

use crate::{
    Error, Result,
    graph::Graph,
    resident::Handles,
    shaders::{consts::MATERIAL_RADIATION_SHIFT, types},
};

/// Names of an error's list at most.
const LISTED: usize = 12;

/// Masks of the materials of a scene, which [`Handles::material_names`] lists.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Masks {
    /// Index of the material, and its mask, 0 to 1. Of two entries for a material the later one counts.
    shares: Vec<(usize, f32)>,
}

impl Masks {
    /// `text`: `NAME=SHARE` with commas between the entries, or empty. A name ends at the last `=` of its entry. All materials of one name get the mask.
    ///
    /// # Errors
    /// `Usage` if an entry has no name or no share from 0 to 1, and if no material has the name.
    pub(super) fn by_names(names: &[String], text: &str) -> Result<Self> {
        let mut shares = Vec::new();
        for entry in text.split(',').map(str::trim).filter(|entry| !entry.is_empty()) {
            let (name, share) = entry.rsplit_once('=').map_or((entry, ""), |(name, share)| (name.trim(), share.trim()));
            let share: Option<f32> = share.parse().ok().filter(|share| (0.0..=1.0).contains(share));
            let Some(share) = share.filter(|_| !name.is_empty()) else {
                return Err(Error::usage(format!("'{entry}' is not a material with its share"))
                    .help("NAME=SHARE with commas between them, shares from 0 to 1, for instance floor=0.5, curtain=0")
                    .at("isr.mask"));
            };
            let before = shares.len();
            let named = names.iter().enumerate().filter(|(_, own)| own.trim() == name);
            shares.extend(named.map(|(index, _)| (index, share)));
            if shares.len() == before {
                return Err(unknown(names, name));
            }
        }
        Ok(Self { shares })
    }

    /// The scene of a frame with these masks.
    pub(super) fn applied<'a>(&self, graph: &mut Graph, handles: &'a Handles) -> Cow<'a, Handles> {
        if self.shares.is_empty() {
            return Cow::Borrowed(handles);
        }
        let mut materials: Vec<types::Material> = handles.material_table.to_vec();
        for &(index, share) in &self.shares {
            if let Some(material) = materials.get_mut(index) {
                // A share above 0 stays above 0.
                let kept = ((share * 255.0).round() as u32).max(u32::from(share > 0.0));
                let without = 255 - kept;
                material.flags =
                    material.flags & !(255 << MATERIAL_RADIATION_SHIFT) | without << MATERIAL_RADIATION_SHIFT;
            }
        }
        let mut handles = handles.clone();
        handles.materials = graph.buffer_from("isr.materials", &materials);
        handles.material_table = materials.into();
        Cow::Owned(handles)
    }
}

fn unknown(names: &[String], name: &str) -> Error {
    let mut names: Vec<&str> = names.iter().map(String::as_str).collect();
    names.retain(|name| !name.is_empty());
    names.sort_unstable();
    names.dedup();
    let some = names.iter().take(LISTED).map(|name| format!("'{name}'")).collect::<Vec<_>>().join(", ");
    let more = if names.len() > LISTED { format!(", and {} more", names.len() - LISTED) } else { String::new() };
    let listed = if some.is_empty() { "none with a name".to_owned() } else { format!("{some}{more}") };
    Error::usage(format!("the scene has no material '{name}'"))
        .help(format!("Materials: {listed}. `lucerna inspect --json` lists all"))
        .at("isr.mask")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names() -> Vec<String> {
        ["floor", "a=b", "floor", ""].map(str::to_owned).to_vec()
    }

    #[test]
    fn entries_give_shares_to_all_materials_of_a_name() {
        let masks = Masks::by_names(&names(), " floor = 0.5 ,a=b=0,, floor=1").unwrap();
        assert_eq!(masks.shares, [(0, 0.5), (2, 0.5), (1, 0.0), (0, 1.0), (2, 1.0)]);
        assert_eq!(Masks::by_names(&names(), " ").unwrap(), Masks::default());
    }

    #[test]
    fn errors_name_the_entry_and_the_materials() {
        for entry in ["floor", "floor=", "=1", "floor=2", "floor=-0.1", "floor=NaN", "floor=x"] {
            let error = Masks::by_names(&names(), entry).unwrap_err();
            assert!(error.exit_code() == 2 && error.to_string().contains(&format!("'{entry}'")), "{error}");
        }
        let text = Masks::by_names(&names(), "flor=1").unwrap_err().to_string();
        for part in ["isr.mask", "'flor'", "'a=b', 'floor'"] {
            assert!(text.contains(part), "{text}");
        }
        assert!(Masks::by_names(&[], "x=1").unwrap_err().to_string().contains("none with a name"));
    }
}
