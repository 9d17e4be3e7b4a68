//! Notes on the light and the surfaces of a scene that a bake leaves out or simplifies.

use glam::Vec3;

use crate::{
    passes::shadow,
    scene::{LightKind, Material, Note, NoteKind, Scene},
};

/// Names in a note at most.
const MOST_NAMES: usize = 5;

/// Notes on surfaces that a bake takes as simpler ones: mirrors, glass, surfaces that light does not see, and those that move.
pub fn simplified(scene: &Scene) -> Vec<Note> {
    let named = |what: &str, is: &dyn Fn(&Material) -> bool| named(scene, what, is);
    let mut notes = Vec::new();
    notes.extend(named("glass stops light, and reflects it as a diffuse surface", &|m| m.transmission > 0.0));
    notes.extend(named("mirrors reflect light as diffuse surfaces", &|m| m.is_mirror()));
    notes.extend(named("unlit surfaces neither stop nor reflect light", &|m| m.unlit));
    if scene.animations.iter().any(|of| of.channels.iter().any(|c| moves(scene, c.node))) {
        notes.push(note("animations", "surfaces that move are baked where they rest; in shadow maps they move".into()));
    }
    notes
}

/// A note if the scene has no light that is transferred.
pub fn unlit(scene: &Scene) -> Option<Note> {
    let lit = scene.lights.iter().any(|light| light.kind != LightKind::Directional && light.intensity > 0.0);
    let text = "the scene has no point or spot light: pictures are black without --light X,Y,Z,INTENSITY";
    (!lit).then(|| note("lights", text.into()))
}

/// Notes on all that a picture leaves out or simplifies.
pub(super) fn left_out(scene: &Scene) -> Vec<Note> {
    let mut notes = Vec::new();
    let suns =
        scene.lights.iter().filter(|light| light.kind == LightKind::Directional && light.intensity > 0.0).count();
    if suns > 0 {
        let suns = if suns == 1 { "a sun is".into() } else { format!("{suns} suns are") };
        notes.push(note("lights", format!("{suns} off: only point and spot lights are transferred")));
    }
    notes.extend(unlit(scene));
    if scene.environment.is_some() {
        notes.push(note("environment", "the environment is shown, but lights nothing".into()));
    }
    notes.extend(named(scene, "some surfaces glow, but they light nothing", &|m| m.emissive != Vec3::ZERO && !m.unlit));
    notes.extend(simplified(scene));
    notes
}

/// A note if shadow maps have settings of their own, although there are no maps.
pub(super) fn idle_maps(settings: &shadow::Settings) -> Vec<Note> {
    let changed = *settings != shadow::Settings::default();
    changed.then(|| note("shadow", "has no effect, because shadows are by the samples".into())).into_iter().collect()
}

fn note(place: &str, text: String) -> Note {
    Note { kind: NoteKind::Ignored, place: place.into(), text }
}

/// A note on the materials of a kind; `None`: there is none.
fn named(scene: &Scene, what: &str, is: &dyn Fn(&Material) -> bool) -> Option<Note> {
    let all = scene.materials.iter().enumerate().filter(|(_, material)| is(material));
    let names: Vec<String> = all
        .map(|(number, material)| match material.name.as_str() {
            "" => format!("material {number}"),
            name => name.into(),
        })
        .collect();
    let more = names.len().saturating_sub(MOST_NAMES);
    let list = names[..names.len() - more].join(", ");
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    (!names.is_empty()).then(|| note("materials", format!("{what}: {list}{rest}")))
}

/// Whether a node or one of its children has a mesh.
fn moves(scene: &Scene, node: u32) -> bool {
    scene.nodes.iter().enumerate().filter(|(_, of)| of.mesh.is_some()).any(|(number, _)| {
        let mut at = Some(number as u32);
        while let Some(here) = at {
            if here == node {
                return true;
            }
            at = scene.nodes.get(here as usize).and_then(|node| node.parent);
        }
        false
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Light;

    #[test]
    fn materials_are_named_and_many_are_counted() {
        let glass = |name: &str| Material { transmission: 1.0, name: name.into(), ..Material::default() };
        let mut scene = Scene { materials: vec![Material::default(), glass("pane"), glass("")], ..Scene::default() };
        let texts = |scene: &Scene| simplified(scene).into_iter().map(|note| note.text).collect::<Vec<_>>();
        assert_eq!(texts(&scene), ["glass stops light, and reflects it as a diffuse surface: pane, material 2"]);
        scene.materials.extend((0..6).map(|i| glass(&i.to_string())));
        assert!(texts(&scene)[0].ends_with("pane, material 2, 0, 1, 2 and 3 more"), "{:?}", texts(&scene));
        scene.materials = vec![Material { unlit: true, emissive: Vec3::ONE, ..glass("lamp") }];
        assert_eq!(left_out(&scene).len(), 3);
    }

    #[test]
    fn scenes_whose_lights_are_not_transferred_are_named() {
        let light = |kind: LightKind, intensity: f32| Light { name: String::new(), kind, color: Vec3::ONE, intensity };
        let of = |lights: &[Light]| unlit(&Scene { lights: lights.to_vec(), ..Scene::default() }).is_some();
        let [sun, lamp, off] = [
            light(LightKind::Directional, 1.0),
            light(LightKind::Point { range: None }, 1.0),
            light(LightKind::Point { range: None }, 0.0),
        ];
        let suns = std::slice::from_ref(&sun);
        assert!(of(&[]) && of(suns) && of(&[sun.clone(), off]) && !of(&[sun, lamp]));
        let texts: Vec<String> =
            left_out(&Scene { lights: vec![light(LightKind::Directional, 1.0)], ..Scene::default() })
                .into_iter()
                .map(|note| note.text)
                .collect();
        assert!(texts[0].starts_with("a sun is off") && texts[1].contains("pictures are black"), "{texts:?}");
    }
}
