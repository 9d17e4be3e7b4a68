//! Notes about the parts of a scene that instant global illumination approximates or ignores, and about settings without effect.

use super::{PictureSettings, Settings, Visibility};
use crate::{
    passes::gbuffer::Blended,
    resident::told,
    scene::{AlphaMode, Environment, Material, Note, NoteKind, Scene},
    settings::idle_notes,
    tracer::tables,
};

/// Maximum of material names in a note.
const NAMED: usize = 3;
/// Maximum of emitted radiance in the G-buffer, W/(sr·m²): the largest 16-bit float.
const BRIGHTEST: f32 = 65504.0;

/// Notes about a scene and settings. `of_device`: [`Resident::notes`](crate::resident::Resident::notes). `frames`: number of
/// pictures of the sequence, 1 for a single picture.
pub fn notes(scene: &Scene, of_device: &[Note], settings: &PictureSettings, frames: u32) -> Vec<Note> {
    let PictureSettings { igi: settings, gbuffer, .. } = settings;
    // This technique traces glass, so the rasteriser's note about glass is wrong here. The notes about blending and about bright
    // environments get a more exact text below.
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
        Blended::Dithered => {
            "alpha blending is random: alpha is the probability that a pixel or a ray hits the surface"
        }
        Blended::Threshold => {
            "alpha blending uses a threshold for the camera only (gbuffer.blended); for shadows, indirect light and mirrors alpha is the \
             probability that a ray hits the surface"
        }
        Blended::Hidden => {
            "alpha-blended surfaces are hidden from the camera only (gbuffer.blended); for shadows, indirect light and mirrors alpha is \
             the probability that a ray hits the surface"
        }
    };
    say(Approximated, &|m| m.alpha == AlphaMode::Blend, blended);
    if specular {
        say(Ignored, &glass, "direct light does not pass through glass: glass casts the shadow of an opaque surface");
        say(Approximated, &|m| glass(m) && m.roughness >= 0.05, "rough glass is rendered as smooth glass");
        say(
            Ignored,
            &|m| glass(m) || mirror(m),
            "only virtual lights carry light that mirrors and glass cast onto other surfaces: caustics of direct light are missing",
        );
        say(
            Approximated,
            &|m| m.metallic > 0.5 && !m.is_mirror() && !m.unlit,
            "rough metals show highlights of direct light, but no reflections of other surfaces",
        );
    } else {
        say(Approximated, &glass, "with specular = false glass is opaque");
        say(Ignored, &|m| m.metallic > 0.5 && !m.unlit, "with specular = false metals reflect their diffuse part only");
    }
    if settings.imperfect {
        say(
            Approximated,
            &|m| m.alpha != AlphaMode::Opaque && !m.unlit,
            "with imperfect = true shadow rays of virtual lights ignore alpha: they test the boxes of triangles",
        );
    }
    say(
        Approximated,
        &|m| m.emissive.max_element() > BRIGHTEST && !m.unlit,
        "emission above 65504 W/(sr m²) is clamped to this value where the camera sees it directly; mirrors and lit surfaces receive all of it",
    );
    let burns = |number: u32| {
        scene.lights.get(number as usize).is_some_and(|light| (light.color * light.intensity).max_element() > 0.0)
    };
    let lit = scene.nodes.iter().any(|node| node.light.is_some_and(burns))
        || places(scene, &|m| m.emissive.max_element() > 0.0 && !m.unlit).is_some()
        || scene.environment.as_ref().is_some_and(shines);
    // A scene with only unlit materials needs no light.
    if !lit && places(scene, &|m| !m.unlit).is_some() {
        let text = "the scene has no light source: no light, no emissive surface, no environment".to_owned();
        out.push(Note { kind: Ignored, place: "scene".into(), text });
    }
    if of_device.iter().any(|note| note.text == told::BRIGHT_SKY) {
        let text = "radiance above 65504 W/(sr m²) is clamped to this value where the camera sees it directly; mirrors and lit surfaces receive all of it";
        out.push(Note { kind: Approximated, place: "environment".into(), text: text.to_owned() });
    }
    out.extend(unused(scene, settings, frames));
    out
}

/// Notes about settings that differ from their default but have no effect. The description of the settings has the conditions on other settings;
/// here are those on the scene, on the sequence and on several settings together. `frames` as in [`notes`].
fn unused(scene: &Scene, s: &Settings, frames: u32) -> Vec<Note> {
    let mut out = idle_notes("igi", s);
    let ignored = |key: &str, text: String| Note { kind: NoteKind::Ignored, place: format!("igi.{key}"), text };
    let default = Settings::default();
    let lit = scene.environment.as_ref().is_some_and(shines)
        || places(scene, &|m| m.emissive.max_element() > 0.0 && !m.unlit).is_some();
    let dull = s.specular && !tables::may_be_sharp(scene);
    let lights = s.paths() * s.bounces;
    let sparse = "downsample above 1, or fused = true with interleave above 1";
    let many = format!("vpls above {}, four for each pick; with {lights} every pixel gathers from all", 4 * s.picks);
    let even = s.indirect && !s.upsamples();
    // The key, whether it is set and has no effect, and the missing condition.
    for (key, idle, missing) in [
        (
            "specular_depth",
            s.specular_depth != default.specular_depth && dull,
            "mirrors or glass, and the scene has none",
        ),
        ("cache", s.cache != default.cache && dull && s.indirect, "mirrors or glass, and the scene has none"),
        (
            "direct_samples",
            s.direct_samples != default.direct_samples && !lit,
            "emissive surfaces or an environment, and the scene has none",
        ),
        (
            "direct_filter",
            s.direct_filter != default.direct_filter && s.direct_filter > 0 && !lit,
            "emissive surfaces or an environment, and the scene has none",
        ),
        ("picks", s.picks != default.picks && s.indirect && !s.picks_from(lights), &many),
        ("refine", s.refine != default.refine && even, sparse),
        ("upsample_sigma", s.upsample_sigma != default.upsample_sigma && even, sparse),
        ("upsample_normal", s.upsample_normal != default.upsample_normal && even && !s.smooths(), sparse),
        ("upsample_range", s.upsample_range != default.upsample_range && even && !s.smooths(), sparse),
        ("history", s.history != default.history && s.indirect && frames < 2, "a sequence of pictures (--frames)"),
        // The other values of `visibility` choose how all rays are traced, also those of direct light.
        ("visibility", s.visibility == Visibility::Raster && !s.indirect, "indirect = true"),
    ] {
        if idle {
            out.push(ignored(key, format!("has no effect: it needs {missing}")));
        }
    }
    if !s.indirect {
        return out;
    }
    if s.sorted && s.interleave > 1 && (s.picks > 0 || s.compensates()) {
        out.push(ignored("sorted", "has no effect: picks and compensation always sort the virtual lights".into()));
    }
    let subsets = s.interleave * s.interleave;
    if subsets > lights && !s.picks_from(lights) {
        let least = subsets.next_multiple_of(s.bounces.max(1));
        let none = subsets - lights;
        let text = format!(
            "{subsets} subsets share {lights} virtual lights: the pixels of {none} subsets have no virtual light; the minimum is vpls = {least}"
        );
        out.push(ignored("interleave", text));
    }
    out
}

/// Whether the environment emits light.
fn shines(environment: &Environment) -> bool {
    environment.scale > 0.0 && !environment.pixels.is_empty()
}

/// The used materials that satisfy `which`: the number and name of the first [`NAMED`], and how many more there are.
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
        note.to_string()
    }

    /// The notes of a sequence of two pictures.
    fn told(scene: &Scene, settings: &Settings) -> Vec<String> {
        let settings = PictureSettings { igi: settings.clone(), ..Default::default() };
        notes(scene, &[], &settings, 2).into_iter().map(text).collect()
    }

    #[test]
    fn supported_scenes_give_no_notes() {
        let mut plain = scene(vec![Material::diffuse("wall", Vec3::ONE), Material::emitter("lamp", Vec3::ONE)]);
        assert!(told(&plain, &Settings::default()).is_empty());
        // A material that no mesh uses.
        plain.materials.push(Material { transmission: 1.0, ..Material::diffuse("glass", Vec3::ONE) });
        assert!(told(&plain, &Settings::default()).is_empty());
        let dark = scene(vec![Material::diffuse("wall", Vec3::ONE)]);
        assert!(told(&dark, &Settings::default())[0].starts_with("scene: the scene has no light source"));
    }

    #[test]
    fn unsupported_materials_are_named() {
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
            "materials[0] \"frosted\": direct light does not pass",
            "materials[0] \"frosted\": rough glass",
            "materials[0] \"frosted\", materials[1] \"mirror\": only virtual lights carry light",
            "materials[2]: rough metals",
        ] {
            assert!(text.contains(part), "{part} is not in {text}");
        }
        let text = told(&all, &Settings { specular: false, ..Settings::default() }).join("\n");
        assert!(text.contains("glass is opaque") && text.contains("metals reflect their diffuse part only"), "{text}");
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
        assert!(said.len() == 3 && said[2].text.contains("where the camera sees it directly"), "{said:?}");
    }

    #[test]
    fn lights_without_intensity_do_not_count() {
        let dark =
            |scene: &Scene| told(scene, &Settings::default()).iter().any(|note| note.contains("no light source"));
        let mut room = scene(vec![Material::diffuse("wall", Vec3::ONE)]);
        // An emissive material that no mesh uses, a light that no node has, a light without intensity, then a light with intensity.
        room.materials.push(Material::emitter("lamp", Vec3::ONE));
        assert!(dark(&room));
        let kind = LightKind::Point { range: None };
        room.lights.push(Light { name: String::new(), kind, color: Vec3::ONE, intensity: 0.0 });
        assert!(dark(&room));
        room.nodes.push(Node { light: Some(0), ..Node::default() });
        assert!(dark(&room));
        room.lights[0].intensity = 1.0;
        assert!(!dark(&room));
        // An unlit sky dome is visible but lights no surface. A scene with only the sky dome has no surface to light.
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
        assert!(text.contains("materials[0] \"arc\": emission above") && !text.contains("leaf"), "{text}");
        let text = told(&all, &Settings { imperfect: true, ..Settings::default() }).join("\n");
        assert!(text.contains("materials[1] \"leaf\": with imperfect = true"), "{text}");
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
            (Settings { refine: 0.1, ..of() }, "igi.refine: has no effect: it needs downsample above 1"),
            (Settings { fused: true, ..of() }, "igi.fused: has no effect, because igi.interleave is 1"),
            (
                Settings { pattern: Pattern::Irregular, ..of() },
                "igi.pattern: has no effect, because igi.interleave is 1",
            ),
            (Settings { scattered: true, ..of() }, "igi.scattered: has no effect, because igi.downsample is 1"),
            (Settings { proposals: 2, ..of() }, "igi.proposals: has no effect, because igi.picks is 0"),
            (Settings { picks: 45, ..of() }, "igi.picks: has no effect: it needs vpls above 180"),
            (Settings { judges: 9, candidates: 1, ..of() }, "igi.judges: has no effect, because igi.candidates is 1"),
            (Settings { raster_size: 64, ..of() }, "igi.raster_size: has no effect, because igi.visibility is "),
            (Settings { cache: 0.1, ..of() }, "igi.cache: has no effect: it needs mirrors"),
            (Settings { sorted: true, ..of() }, "igi.sorted: has no effect, because igi.interleave is 1"),
            (
                Settings { sorted: true, interleave: 2, compensation: 1, ..of() },
                "igi.sorted: has no effect: picks and compensation",
            ),
            (Settings { specular_depth: 2, ..of() }, "igi.specular_depth: has no effect: it needs mirrors or glass"),
            (
                Settings { indirect: false, fused: true, vpls: 9, cache: 0.1, history: 4, ..of() },
                "igi.vpls, igi.cache, igi.fused, igi.history: have no effect, because igi.indirect is false",
            ),
            (
                Settings { indirect: false, visibility: Visibility::Raster, ..of() },
                "igi.visibility: has no effect: it needs indirect = true",
            ),
            (Settings { cache_cells: 9, ..of() }, "igi.cache_cells: has no effect, because igi.cache is 0"),
            (
                Settings { compensation: 1, bound: 0.0, ..of() },
                "igi.compensation: has no effect, because igi.bound is 0",
            ),
            (
                Settings { discontinuity_depth: 1.0, ..of() },
                "igi.discontinuity_depth: has no effect, because igi.interleave is 1",
            ),
            (
                Settings { history_lag: 1.0, history: 1, ..of() },
                "igi.history_lag: has no effect, because igi.history is 1",
            ),
            (Settings { upsample_sigma: 1.0, ..of() }, "igi.upsample_sigma: has no effect: it needs downsample"),
            (
                Settings { specular: false, specular_depth: 2, ..of() },
                "igi.specular_depth: has no effect, because igi.specular is false",
            ),
            (
                Settings { interleave: 14, fused: true, bounces: 3, ..of() },
                "the pixels of 16 subsets have no virtual light; the minimum is vpls = 198",
            ),
        ] {
            let found = told(&lit, &settings);
            assert!(found.len() == 1 && found[0].contains(note), "{note} is not in {found:?}");
        }
        // A scene with only a point light; then a single picture.
        let kind = LightKind::Point { range: None };
        let mut bulb = scene(vec![Material::diffuse("wall", Vec3::ONE)]);
        bulb.lights.push(Light { name: String::new(), kind, color: Vec3::ONE, intensity: 1.0 });
        bulb.nodes.push(Node { light: Some(0), ..Node::default() });
        let found = told(&bulb, &Settings { direct_samples: 4, ..of() });
        assert!(
            found.len() == 1 && found[0].starts_with("igi.direct_samples: has no effect: it needs emissive"),
            "{found:?}"
        );
        let igi = Settings { history: 32, ..of() };
        let found = notes(&lit, &[], &PictureSettings { igi, ..Default::default() }, 1);
        assert!(found.len() == 1 && found[0].text.contains("a sequence of pictures"), "{found:?}");
    }

    #[test]
    fn notes_tell_how_blending_differs_for_the_camera() {
        let veil = Material { alpha: AlphaMode::Blend, emissive: Vec3::ONE, ..Material::diffuse("veil", Vec3::ONE) };
        let all = scene(vec![veil]);
        for (blended, part) in [
            (Blended::Dithered, "that a pixel or a ray hits the surface"),
            (Blended::Threshold, "a threshold for the camera only"),
            (Blended::Hidden, "hidden from the camera only"),
        ] {
            let gbuffer = gbuffer::Settings { blended, ..Default::default() };
            let found = notes(&all, &[], &PictureSettings { gbuffer, ..Default::default() }, 1);
            assert!(found.len() == 1 && found[0].text.contains(part), "{found:?}");
        }
    }
}
