//! What instant global illumination shows of a scene by something simpler, or not at all.

use super::Settings;
use crate::scene::{AlphaMode, Material, Note, NoteKind, Scene};

/// Names of materials in a note at most.
const NAMED: usize = 3;

/// What of a scene these settings cannot serve. `of_device`: [`Resident::notes`](crate::scene::resident::Resident::notes).
pub fn notes(scene: &Scene, of_device: &[Note], settings: &Settings) -> Vec<Note> {
    // What the rasteriser says of materials does not hold for rays.
    let mut out: Vec<Note> = of_device.iter().filter(|note| note.place != "materials").cloned().collect();
    let mut say = |kind: NoteKind, which: &dyn Fn(&Material) -> bool, text: &str| {
        if let Some(place) = places(scene, which) {
            out.push(Note { kind, place, text: text.to_owned() });
        }
    };
    let specular = settings.specular;
    let glass = |m: &Material| m.transmission > 0.0 && !m.unlit;
    let mirror = |m: &Material| m.is_mirror() && !m.unlit;
    use NoteKind::{Approximated, Ignored};
    say(
        Approximated,
        &|m| m.alpha == AlphaMode::Blend,
        "alpha blending is by chance: a pixel or a ray meets the surface or passes it",
    );
    if specular {
        say(Ignored, &glass, "lamps do not shine through glass: it casts the shadow of an opaque surface");
        say(Approximated, &|m| glass(m) && m.roughness >= 0.05, "rough glass is shown smooth");
        say(
            Ignored,
            &|m| glass(m) || mirror(m),
            "light that mirrors and glass throw comes by virtual lights alone: caustics of lamps are missing",
        );
        say(
            Approximated,
            &|m| m.metallic > 0.5 && !m.is_mirror() && !m.unlit,
            "metals that are no mirrors show highlights of direct light and reflect nothing else",
        );
    } else {
        say(Approximated, &glass, "without specular, glass is opaque");
        say(Ignored, &|m| m.metallic > 0.5 && !m.unlit, "without specular, metals are as dark as their diffuse part");
    }
    let shines = !scene.lights.is_empty()
        || scene.materials.iter().any(|m| m.emissive.max_element() > 0.0)
        || scene.environment.as_ref().is_some_and(|e| e.scale > 0.0 && !e.pixels.is_empty());
    if !shines && !scene.meshes.is_empty() {
        let text = "nothing shines: there is no light, no emissive surface, no environment".to_owned();
        out.push(Note { kind: Ignored, place: "scene".into(), text });
    }
    out
}

/// The materials in use that something holds of, the first ones by number and name.
fn places(scene: &Scene, which: &dyn Fn(&Material) -> bool) -> Option<String> {
    let used = |number: usize| {
        scene.meshes.iter().flat_map(|mesh| &mesh.primitives).any(|primitive| primitive.material as usize == number)
    };
    let all = scene.materials.iter().enumerate();
    let all: Vec<_> = all.filter(|&(number, material)| which(material) && used(number)).collect();
    let name = |&(number, material): &(usize, &Material)| match material.name.as_str() {
        "" => format!("materials[{number}]"),
        name => format!("materials[{number}] {name:?}"),
    };
    let named: Vec<String> = all.iter().take(NAMED).map(name).collect();
    match all.len() {
        0 => None,
        n if n > NAMED => Some(format!("{} and {} more", named.join(", "), n - NAMED)),
        _ => Some(named.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Mesh, Primitive};
    use glam::Vec3;

    fn scene(materials: Vec<Material>) -> Scene {
        let primitives = (0..materials.len() as u32).map(|material| Primitive { material, ..Primitive::default() });
        let meshes = vec![Mesh { primitives: primitives.collect(), ..Mesh::default() }];
        Scene { materials, meshes, ..Scene::default() }
    }

    fn told(scene: &Scene, settings: &Settings) -> Vec<String> {
        notes(scene, &[], settings).into_iter().map(|note| format!("{}: {}", note.place, note.text)).collect()
    }

    #[test]
    fn nothing_is_said_of_what_is_served() {
        let mut plain = scene(vec![Material::diffuse("wall", Vec3::ONE), Material::emitter("lamp", Vec3::ONE)]);
        assert!(told(&plain, &Settings::default()).is_empty());
        // Not in use.
        plain.materials.push(Material { transmission: 1.0, ..Material::diffuse("glass", Vec3::ONE) });
        assert!(told(&plain, &Settings::default()).is_empty());
        // In the dark.
        let dark = scene(vec![Material::diffuse("wall", Vec3::ONE)]);
        assert!(told(&dark, &Settings::default())[0].starts_with("scene: nothing shines"));
    }

    #[test]
    fn what_is_not_served_is_named() {
        let of = |name: &str| Material { emissive: Vec3::ONE, ..Material::diffuse(name, Vec3::ONE) };
        let all = scene(vec![
            Material { transmission: 0.5, roughness: 0.3, ..of("frosted") },
            Material { metallic: 1.0, roughness: 0.0, ..of("mirror") },
            Material { metallic: 1.0, roughness: 0.4, ..of("") },
            Material { alpha: AlphaMode::Blend, ..of("veil") },
        ]);
        let text = told(&all, &Settings::default()).join("\n");
        for part in [
            "materials[3] \"veil\": alpha blending",
            "materials[0] \"frosted\": lamps do not shine",
            "materials[0] \"frosted\": rough glass",
            "materials[0] \"frosted\", materials[1] \"mirror\": light that mirrors",
            "materials[2]: metals that are no mirrors",
        ] {
            assert!(text.contains(part), "{part} is not in {text}");
        }
        let text = told(&all, &Settings { specular: false, ..Settings::default() }).join("\n");
        assert!(text.contains("glass is opaque") && text.contains("metals are as dark"), "{text}");
        let many = scene((0..5).map(|_| Material { transmission: 1.0, ..of("pane") }).collect());
        assert!(told(&many, &Settings::default())[0].contains("and 2 more"));
    }

    #[test]
    fn notes_of_the_device_stay_but_for_materials() {
        let note = |place: &str| Note { kind: NoteKind::Approximated, place: place.into(), text: String::new() };
        let found = notes(&Scene::default(), &[note("materials"), note("textures")], &Settings::default());
        assert_eq!(found, [note("textures")]);
    }
}
