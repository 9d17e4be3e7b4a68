//! What instant global illumination shows of a scene by something simpler, or not at all.

use super::{PictureSettings, Settings, Visibility};
use crate::{
    passes::gbuffer::Blended,
    reference::tracer::tables,
    scene::{AlphaMode, Environment, Material, Note, NoteKind, Scene, resident::told},
};

/// Names of materials in a note at most.
const NAMED: usize = 3;
/// Emission of the G-buffer is cut there, W/(sr·m²).
const BRIGHTEST: f32 = 65504.0;

/// What of a scene these settings cannot serve, and what of the settings does nothing. `of_device`:
/// [`Resident::notes`](crate::scene::resident::Resident::notes). `frames`: pictures of the sequence, 1 for one alone.
pub fn notes(scene: &Scene, of_device: &[Note], settings: &PictureSettings, frames: u32) -> Vec<Note> {
    let PictureSettings { igi: settings, gbuffer, .. } = settings;
    // What the rasteriser says of glass does not hold here; what it says of blending and of a bright sky is said below.
    let other = |note: &&Note| ![told::TRANSMISSION, told::BLENDING, told::BRIGHT_SKY].contains(&note.text.as_str());
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
    let blended = match gbuffer.blended {
        Blended::Dithered => "alpha blending is by chance: a pixel or a ray meets the surface or passes it",
        Blended::Threshold => {
            "alpha blending is by threshold for the camera alone (gbuffer.blended); rays meet the surface or pass it by chance: shadows, \
             indirect light, mirrors"
        }
        Blended::Hidden => {
            "alpha blending is hidden from the camera alone (gbuffer.blended); rays meet the surface or pass it by chance: shadows, \
             indirect light, mirrors"
        }
    };
    say(Approximated, &|m| m.alpha == AlphaMode::Blend, blended);
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
    let lit = scene.nodes.iter().any(|node| node.light.is_some_and(burns))
        || places(scene, &|m| m.emissive.max_element() > 0.0 && !m.unlit).is_some()
        || scene.environment.as_ref().is_some_and(shines);
    // Where all is unlit there is nothing to shine on.
    if !lit && places(scene, &|m| !m.unlit).is_some() {
        let text = "nothing shines: there is no light, no emissive surface, no environment".to_owned();
        out.push(Note { kind: Ignored, place: "scene".into(), text });
    }
    if of_device.iter().any(|note| note.text == told::BRIGHT_SKY) {
        let text =
            "radiance over 65504 W/(sr m²) is cut there where it is seen directly, not where it lights and in mirrors";
        out.push(Note { kind: Approximated, place: "environment".into(), text: text.to_owned() });
    }
    out.extend(unused(scene, settings, frames));
    out
}

/// A setting: its key; whether it was chosen; what it needs to do something, if that is missing.
type Use = (&'static str, bool, Option<String>);

/// Settings that were chosen and do nothing, with what they need. `frames` as in [`notes`].
fn unused(scene: &Scene, s: &Settings, frames: u32) -> Vec<Note> {
    let ignored = |key: &str, text: String| Note { kind: NoteKind::Ignored, place: format!("igi.{key}"), text };
    let idle = |(key, chosen, missing): Use| {
        missing.filter(|_| chosen).map(|what| ignored(key, format!("does nothing: it needs {what}")))
    };
    let mut out: Vec<Note> = of_all_light(scene, s).into_iter().filter_map(idle).collect();
    let of_indirect = of_indirect_light(scene, s, frames);
    if !s.indirect {
        let chosen: Vec<&str> = of_indirect.into_iter().filter(|(_, chosen, _)| *chosen).map(|(key, ..)| key).collect();
        if !chosen.is_empty() {
            out.push(ignored("indirect", format!("with indirect = false these do nothing: {}", chosen.join(", "))));
        }
        return out;
    }
    out.extend(of_indirect.into_iter().filter_map(idle));
    if s.sorted && (s.picks > 0 || s.compensates()) {
        out.push(ignored("sorted", "does nothing: with picks or compensation virtual lights are sorted anyway".into()));
    }
    let (lights, subsets) = (s.paths() * s.bounces, s.interleave * s.interleave);
    if subsets > lights && !s.picks_from(lights) {
        let least = subsets.next_multiple_of(s.bounces.max(1));
        let none = subsets - lights;
        let text = format!(
            "{subsets} subsets share {lights} virtual lights: pixels of {none} of them gather from none; vpls = {least} is the least for one each"
        );
        out.push(ignored("interleave", text));
    }
    out
}

/// What something needs that is not there.
fn unless(there: bool, what: &str) -> Option<String> {
    (!there).then(|| what.to_owned())
}

/// Key, and whether it was chosen.
macro_rules! chosen {
    ($settings:ident . $key:ident) => {
        (stringify!($key), $settings.$key != Settings::default().$key)
    };
}

/// Uses of settings, each with what it needs.
macro_rules! uses {
    ($settings:ident, $($key:ident: $missing:expr,)*) => {
        vec![$({ let (key, chosen) = chosen!($settings.$key); (key, chosen, $missing) },)*]
    };
}

/// What has to do with direct light or with mirrors.
fn of_all_light(scene: &Scene, s: &Settings) -> Vec<Use> {
    let sharp = || unless(tables::may_be_sharp(scene), "mirrors or glass, and the scene has none");
    let lit = scene.environment.as_ref().is_some_and(shines)
        || places(scene, &|m| m.emissive.max_element() > 0.0 && !m.unlit).is_some();
    uses!(s,
        specular_depth: unless(s.specular, "specular = true").or_else(sharp),
        direct_samples: unless(lit, "emissive surfaces or an environment, and the scene has none"),
    )
}

/// What does nothing without indirect light.
fn of_indirect_light(scene: &Scene, s: &Settings, frames: u32) -> Vec<Use> {
    let lights = s.paths() * s.bounces;
    let sparse = || unless(s.upsamples(), "downsample above 1, or fused = true with interleave above 1");
    let weighs = || if s.smooths() { None } else { sparse() };
    let tiles = || unless(s.interleave > 1, "interleave above 1");
    let apart = || unless(s.joins(), "interleave above 1 without fused");
    let past = || unless(s.history > 1, "history above 1");
    let sharp = || unless(tables::may_be_sharp(scene), "mirrors or glass, and the scene has none");
    let many = format!("vpls above {}, four for each pick; from {lights} all are gathered", 4 * s.picks);
    let mut out = uses!(s,
        vpls: None,
        candidates: None,
        bounces: None,
        judges: unless(s.candidates > 1, "candidates above 1"),
        bound: None,
        picks: unless(s.picks_from(lights), &many),
        proposals: unless(s.picks > 0, "picks above 0"),
        compensation: unless(s.bound > 0.0, "bound above 0, which takes light"),
        cache: unless(s.specular, "specular = true").or_else(sharp),
        cache_cells: unless(s.cache > 0.0, "cache above 0"),
        imperfect: None,
        downsample: None,
        scattered: unless(s.downsample > 1, "downsample above 1"),
        interleave: None,
        pattern: tiles(),
        sorted: tiles(),
        fused: tiles(),
        smoothing: None,
        despeckle: None,
        refine: sparse(),
        upsample_sigma: sparse(),
        upsample_normal: weighs(),
        upsample_range: weighs(),
        discontinuity_depth: apart(),
        discontinuity_normal: apart(),
        history: unless(frames > 1, "a sequence of pictures (--frames), each with those before it"),
        history_lag: past(),
        history_range: past(),
        raster_size: unless(s.visibility == Visibility::Raster, "visibility = \"raster\""),
    );
    // Its other values are how all rays are traced.
    out.push(("visibility", s.visibility == Visibility::Raster, None));
    out
}

fn shines(environment: &Environment) -> bool {
    environment.scale > 0.0 && !environment.pixels.is_empty()
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
    use crate::{
        passes::gbuffer,
        scene::{Light, LightKind, Mesh, Node, Primitive},
        techniques::igi::Pattern,
    };
    use glam::Vec3;

    fn scene(materials: Vec<Material>) -> Scene {
        let primitives = (0..materials.len() as u32).map(|material| Primitive { material, ..Primitive::default() });
        let meshes = vec![Mesh { primitives: primitives.collect(), ..Mesh::default() }];
        Scene { materials, meshes, ..Scene::default() }
    }

    fn text(note: Note) -> String {
        format!("{}: {}", note.place, note.text)
    }

    /// Of a sequence.
    fn told(scene: &Scene, settings: &Settings) -> Vec<String> {
        let settings = PictureSettings { igi: settings.clone(), ..Default::default() };
        notes(scene, &[], &settings, 2).into_iter().map(text).collect()
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
            note("materials", super::told::TRANSMISSION),
            note("materials", super::told::BLENDING),
            note("materials", "something else of transmission or blending"),
            note("textures", ""),
            note("environment", super::told::BRIGHT_SKY),
        ];
        let said = notes(&Scene::default(), &of_device, &PictureSettings::default(), 1);
        assert_eq!(said[..2], of_device[2..4]);
        assert!(said.len() == 3 && said[2].text.contains("cut there where it is seen directly"), "{said:?}");
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
        // A sky that is seen and lights nothing; alone it has nothing to light.
        room.lights[0].intensity = 0.0;
        let sky = || Material { unlit: true, ..Material::emitter("sky", Vec3::ONE) };
        room.materials[1] = sky();
        room.meshes[0].primitives.push(Primitive { material: 1, ..Primitive::default() });
        assert!(dark(&room));
        assert!(!dark(&scene(vec![sky()])));
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
        for settings in [
            Settings::default(),
            Settings::paper(),
            Settings { indirect: false, direct_samples: 4, visibility: Visibility::Compute, ..Settings::default() },
            Settings { history: 32, history_lag: 0.2, ..Settings::default() },
        ] {
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
            (Settings { sorted: true, ..of() }, "igi.sorted: does nothing: it needs interleave above 1"),
            (
                Settings { sorted: true, interleave: 2, compensation: 1, ..of() },
                "igi.sorted: does nothing: with picks or compensation",
            ),
            (Settings { specular_depth: 2, ..of() }, "igi.specular_depth: does nothing: it needs mirrors or glass"),
            (
                Settings { indirect: false, fused: true, vpls: 9, cache: 0.1, history: 4, ..of() },
                "igi.indirect: with indirect = false these do nothing: vpls, cache, fused, history",
            ),
            (
                Settings { indirect: false, visibility: Visibility::Raster, ..of() },
                "igi.indirect: with indirect = false these do nothing: visibility",
            ),
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
        // Lit by a point alone; and a picture without others before it.
        let kind = LightKind::Point { range: None };
        let mut bulb = scene(vec![Material::diffuse("wall", Vec3::ONE)]);
        bulb.lights.push(Light { name: String::new(), kind, color: Vec3::ONE, intensity: 1.0 });
        bulb.nodes.push(Node { light: Some(0), ..Node::default() });
        let found = told(&bulb, &Settings { direct_samples: 4, ..of() });
        assert!(
            found.len() == 1 && found[0].starts_with("igi.direct_samples: does nothing: it needs emissive"),
            "{found:?}"
        );
        let igi = Settings { history: 32, ..of() };
        let found = notes(&lit, &[], &PictureSettings { igi, ..Default::default() }, 1);
        assert!(found.len() == 1 && found[0].text.contains("a sequence of pictures"), "{found:?}");
    }

    #[test]
    fn what_blending_is_for_the_camera_alone_is_said() {
        let veil = Material { alpha: AlphaMode::Blend, emissive: Vec3::ONE, ..Material::diffuse("veil", Vec3::ONE) };
        let all = scene(vec![veil]);
        for (blended, part) in [
            (Blended::Dithered, "a pixel or a ray meets the surface or passes it"),
            (Blended::Threshold, "by threshold for the camera alone"),
            (Blended::Hidden, "hidden from the camera alone"),
        ] {
            let gbuffer = gbuffer::Settings { blended, ..Default::default() };
            let found = notes(&all, &[], &PictureSettings { gbuffer, ..Default::default() }, 1);
            assert!(found.len() == 1 && found[0].text.contains(part), "{found:?}");
        }
    }
}
