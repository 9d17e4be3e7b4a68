//! What instant global illumination shows of a scene by something simpler, or not at all.

use super::{Pattern, Settings, Visibility};
use crate::{
    reference::tracer::tables,
    scene::{AlphaMode, Material, Note, NoteKind, Scene},
};

/// Names of materials in a note at most.
const NAMED: usize = 3;
/// Emission of the G-buffer is cut there, W/(sr·m²).
const BRIGHTEST: f32 = 65504.0;

/// What of a scene these settings cannot serve. `of_device`: [`Resident::notes`](crate::scene::resident::Resident::notes).
pub fn notes(scene: &Scene, of_device: &[Note], settings: &Settings) -> Vec<Note> {
    // What the rasteriser says of glass does not hold here, and what it says of blending is said below.
    let other = |note: &&Note| {
        note.place != "materials" || !(note.text.contains("transmission") || note.text.contains("blending"))
    };
    let mut out: Vec<Note> = of_device.iter().filter(other).cloned().collect();
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
    if settings.imperfect {
        say(
            Approximated,
            &|m| m.alpha != AlphaMode::Opaque && !m.unlit,
            "with imperfect visibility the boxes of triangles are solid to the light of virtual lights, holes and all",
        );
    }
    say(
        Approximated,
        &|m| m.emissive.max_element() > BRIGHTEST && !m.unlit,
        "emission over 65504 W/(sr m²) is cut there where it is seen directly, not where it lights and in mirrors",
    );
    let burns = |number: u32| {
        scene.lights.get(number as usize).is_some_and(|light| (light.color * light.intensity).max_element() > 0.0)
    };
    let shines = scene.nodes.iter().any(|node| node.light.is_some_and(burns))
        || places(scene, &|m| m.emissive.max_element() > 0.0 || m.unlit).is_some()
        || scene.environment.as_ref().is_some_and(|e| e.scale > 0.0 && !e.pixels.is_empty());
    if !shines && !scene.meshes.is_empty() {
        let text = "nothing shines: there is no light, no emissive surface, no environment".to_owned();
        out.push(Note { kind: Ignored, place: "scene".into(), text });
    }
    out.extend(unused(scene, settings));
    out
}

/// Settings that were chosen and do nothing, with what they need.
fn unused(scene: &Scene, s: &Settings) -> Vec<Note> {
    let plain = Settings::default();
    let mut out = Vec::new();
    let mut say = |key: &str, idle: bool, text: String| {
        if idle {
            out.push(Note { kind: NoteKind::Ignored, place: format!("igi.{key}"), text });
        }
    };
    let needs = |what: &str| format!("does nothing: it needs {what}");
    if s.cache > 0.0 && s.specular && !tables::has_sharp(scene) {
        say("cache", true, needs("mirrors or glass, and the scene has none"));
    }
    say("cache", s.cache > 0.0 && !s.specular, needs("specular = true"));
    say("cache_cells", s.cache_cells != plain.cache_cells && s.cache == 0.0, needs("cache above 0"));
    say("specular_depth", s.specular_depth != plain.specular_depth && !s.specular, needs("specular = true"));
    if !s.indirect {
        return out;
    }
    let upsamples = s.downsample > 1 || (s.fused && s.interleave > 1);
    let joins = s.interleave > 1 && !s.fused;
    let smooths = s.smoothing > 0 || s.despeckle > 0.0;
    let sparse = || needs("downsample above 1, or fused = true with interleave above 1");
    say("judges", s.judges != plain.judges && s.candidates == 1, needs("candidates above 1"));
    say("proposals", s.proposals != plain.proposals && s.picks == 0, needs("picks above 0"));
    let lights = s.paths() * s.bounces;
    let few = s.picks > 0 && !s.picks_from(lights);
    let more = format!("vpls above {}, four for each pick; from {lights} all are gathered", 4 * s.picks);
    say("picks", few, needs(&more));
    say("compensation", s.compensation > 0 && s.bound == 0.0, needs("bound above 0, which takes light"));
    say("scattered", s.scattered && s.downsample == 1, needs("downsample above 1"));
    say("fused", s.fused && s.interleave == 1, needs("interleave above 1"));
    say("pattern", s.pattern == Pattern::Irregular && s.interleave == 1, needs("interleave above 1"));
    let subsets = s.interleave * s.interleave;
    if subsets > lights && (s.picks == 0 || few) {
        let least = subsets.next_multiple_of(s.bounces.max(1));
        let none = subsets - lights;
        let text = format!(
            "{subsets} subsets share {lights} virtual lights: pixels of {none} of them gather from none; vpls = {least} is the least for one each"
        );
        say("interleave", true, text);
    }
    say("refine", s.refine > 0.0 && !upsamples, sparse());
    say("upsample_sigma", s.upsample_sigma != plain.upsample_sigma && !upsamples, sparse());
    let weighs = upsamples || smooths;
    say("upsample_normal", s.upsample_normal != plain.upsample_normal && !weighs, sparse());
    say("upsample_range", s.upsample_range != plain.upsample_range && !weighs, sparse());
    let apart = || needs("interleave above 1 without fused");
    say("discontinuity_depth", s.discontinuity_depth != plain.discontinuity_depth && !joins, apart());
    say("discontinuity_normal", s.discontinuity_normal != plain.discontinuity_normal && !joins, apart());
    let past = || needs("history above 1");
    say("history_lag", s.history_lag != plain.history_lag && s.history < 2, past());
    say("history_range", s.history_range != plain.history_range && s.history < 2, past());
    let maps = s.visibility == Visibility::Raster;
    say("raster_size", s.raster_size != plain.raster_size && !maps, needs("visibility = \"raster\""));
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
    use crate::scene::{Light, LightKind, Mesh, Node, Primitive};
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
    fn notes_of_the_device_stay_but_for_glass_and_blending() {
        let note =
            |place: &str, text: &str| Note { kind: NoteKind::Approximated, place: place.into(), text: text.into() };
        let of_device = [
            note("materials", "surfaces with transmission are drawn opaque"),
            note("materials", "alpha blending is dithered"),
            note("materials", "something else"),
            note("textures", ""),
        ];
        assert_eq!(notes(&Scene::default(), &of_device, &Settings::default()), of_device[2..]);
    }

    #[test]
    fn lamps_that_give_no_light_are_none() {
        let dark = |scene: &Scene| told(scene, &Settings::default()).iter().any(|note| note.contains("nothing shines"));
        let mut room = scene(vec![Material::diffuse("wall", Vec3::ONE)]);
        // An emissive material that nothing has, a lamp that no node carries, then one without intensity, then a light.
        room.materials.push(Material::emitter("lamp", Vec3::ONE));
        assert!(dark(&room));
        let kind = LightKind::Point { range: None };
        room.lights.push(Light { name: String::new(), kind, color: Vec3::ONE, intensity: 0.0 });
        assert!(dark(&room));
        room.nodes.push(Node { light: Some(0), ..Node::default() });
        assert!(dark(&room));
        room.lights[0].intensity = 1.0;
        assert!(!dark(&room));
    }

    #[test]
    fn masks_and_bright_lamps_are_named() {
        let leaf = Material { alpha: AlphaMode::Mask { cutoff: 0.5 }, ..Material::diffuse("leaf", Vec3::ONE) };
        let all = scene(vec![Material::emitter("arc", Vec3::splat(1e5)), leaf]);
        let text = told(&all, &Settings::default()).join("\n");
        assert!(text.contains("materials[0] \"arc\": emission over") && !text.contains("leaf"), "{text}");
        let text = told(&all, &Settings { imperfect: true, ..Settings::default() }).join("\n");
        assert!(text.contains("materials[1] \"leaf\": with imperfect visibility"), "{text}");
    }

    #[test]
    fn settings_that_do_nothing_are_named_with_what_they_need() {
        let lit = scene(vec![Material::emitter("lamp", Vec3::ONE)]);
        for settings in
            [Settings::default(), Settings::paper(), Settings { indirect: false, fused: true, ..Settings::default() }]
        {
            assert!(told(&lit, &settings).is_empty(), "{:?}", told(&lit, &settings));
        }
        let of = Settings::default;
        for (settings, note) in [
            (Settings { refine: 0.1, ..of() }, "igi.refine: does nothing: it needs downsample above 1"),
            (Settings { fused: true, ..of() }, "igi.fused: does nothing: it needs interleave above 1"),
            (Settings { pattern: Pattern::Irregular, ..of() }, "igi.pattern: does nothing: it needs interleave"),
            (Settings { scattered: true, ..of() }, "igi.scattered: does nothing: it needs downsample"),
            (Settings { proposals: 2, ..of() }, "igi.proposals: does nothing: it needs picks"),
            (Settings { picks: 45, ..of() }, "igi.picks: does nothing: it needs vpls above 180"),
            (Settings { judges: 9, candidates: 1, ..of() }, "igi.judges: does nothing: it needs candidates"),
            (Settings { raster_size: 64, ..of() }, "igi.raster_size: does nothing: it needs visibility"),
            (Settings { cache: 0.1, ..of() }, "igi.cache: does nothing: it needs mirrors"),
            (Settings { cache_cells: 9, ..of() }, "igi.cache_cells: does nothing: it needs cache"),
            (Settings { compensation: 1, bound: 0.0, ..of() }, "igi.compensation: does nothing: it needs bound"),
            (
                Settings { discontinuity_depth: 1.0, ..of() },
                "igi.discontinuity_depth: does nothing: it needs interleave",
            ),
            (Settings { history_lag: 1.0, history: 1, ..of() }, "igi.history_lag: does nothing: it needs history"),
            (Settings { upsample_sigma: 1.0, ..of() }, "igi.upsample_sigma: does nothing: it needs downsample"),
            (
                Settings { specular: false, specular_depth: 2, ..of() },
                "igi.specular_depth: does nothing: it needs specular",
            ),
            (
                Settings { interleave: 14, fused: true, bounces: 3, ..of() },
                "pixels of 16 of them gather from none; vpls = 198",
            ),
        ] {
            let found = told(&lit, &settings);
            assert!(found.len() == 1 && found[0].contains(note), "{note} is not in {found:?}");
        }
    }
}
