//! `--set`: materials that differ from those of the scene's file.

use std::{fmt, str::FromStr};

use glam::Vec3;
use lucerna::{
    Error, Result,
    scene::{Note, NoteKind, Scene},
};
use serde::{Deserialize, Serialize};

use crate::{as_text::as_text, config};

/// The only property that can be changed.
const PROPERTY: &str = ".albedo";

/// The albedo of a material: `MATERIAL.albedo=R,G,B`, or one number for a grey.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct Change {
    material: String,
    albedo: Vec3,
}

impl FromStr for Change {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            "expected MATERIAL.albedo=R,G,B or MATERIAL.albedo=GREY with numbers from 0 to 1, like wall.albedo=0.6,0.1,0.1".to_owned()
        };
        let (name, numbers) = text.rsplit_once('=').ok_or_else(wrong)?;
        let material = name.strip_suffix(PROPERTY).filter(|name| !name.is_empty()).ok_or_else(wrong)?;
        let one = |word: &str| word.trim().parse().ok().filter(|number: &f32| (0.0..=1.0).contains(number));
        let numbers: Vec<f32> = numbers.split(',').map(|word| one(word).ok_or_else(wrong)).collect::<Result<_, _>>()?;
        let albedo = match numbers[..] {
            [grey] => Vec3::splat(grey),
            [r, g, b] => Vec3::new(r, g, b),
            _ => return Err(wrong()),
        };
        Ok(Self { material: material.to_owned(), albedo })
    }
}

as_text!(Change);

impl fmt::Display for Change {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [r, g, b] = self.albedo.to_array();
        write!(f, "{}{PROPERTY}={r},{g},{b}", self.material)
    }
}

/// Changes the materials of a scene.
///
/// # Errors
/// `Usage` if there is no material of that name.
pub fn all(scene: &mut Scene, changes: &[Change]) -> Result<()> {
    for Change { material, albedo } in changes {
        let mut found = false;
        let mut textured = false;
        for one in scene.materials.iter_mut().filter(|one| one.name == *material) {
            one.base_color = albedo.extend(one.base_color.w);
            (found, textured) = (true, textured || one.base_color_texture.is_some());
        }
        if textured {
            let text = format!("the material `{material}` has a texture, which the albedo of --set multiplies");
            scene.notes.push(Note { kind: NoteKind::Approximated, place: "--set".into(), text });
        }
        if !found {
            let names: Vec<&str> = scene.materials.iter().map(|one| one.name.as_str()).collect();
            let hint = config::nearest(material, names.iter().copied());
            let hint = hint.map(|name| format!(" (did you mean '{name}'?)")).unwrap_or_default();
            let what = format!("there is no material '{material}'{hint}; there are: {}", names.join(", "));
            return Err(Error::usage(what).at("--set"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use lucerna::scene::Material;

    #[test]
    fn changes_are_read_written_and_applied() {
        let change: Change = "red wall.albedo=0.25,0.5,1".parse().unwrap();
        assert_eq!(change.to_string().parse::<Change>().unwrap(), change);
        let grey: Change = "floor.albedo=0.5".parse().unwrap();
        let mut scene = Scene::default();
        for name in ["red wall", "floor"] {
            scene.materials.push(Material::diffuse(name, Vec3::ZERO));
        }
        all(&mut scene, &[change, grey]).unwrap();
        assert_eq!(scene.materials[0].base_color.truncate(), Vec3::new(0.25, 0.5, 1.0));
        assert_eq!(scene.materials[1].base_color.truncate(), Vec3::splat(0.5));
        let error = all(&mut scene, &["flor.albedo=1".parse().unwrap()]).unwrap_err().to_string();
        assert!(error.contains("did you mean 'floor'"), "{error}");
        for odd in [
            "",
            "wall",
            "wall.albedo",
            "wall.albedo=2",
            "wall.albedo=1,1",
            ".albedo=1",
            "wall.ior=1",
            "wall.albedo=nan",
        ] {
            assert!(odd.parse::<Change>().is_err(), "{odd}");
        }
    }
}
