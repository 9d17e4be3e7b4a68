//! The pixels of objects that were added at run time.

use crate::{
    graph::{Cull, Depth, Draw, DrawCall, Format, Graph, Image, Load, Raster, Targets},
    passes::{
        direct::{self, Direct, Lights},
        gbuffer::GBuffer,
        shadow,
    },
    resident::{self, Handles},
    scene::{Note, View},
    shaders::{
        daylight::{added, added_lamps},
        types,
    },
};

/// Draws a mask: 1 where the G-buffer shows an instance of a node from `first` on.
pub(super) fn mask(graph: &mut Graph, handles: &Handles, view: &View, gbuffer: &GBuffer, first: u32) -> Image {
    let mask = graph.image("daylight.added", Format::R8, view.extent);
    let depth = graph.image("daylight.added.depth", Format::D32F, view.extent);
    let args = added::Args {
        view: gbuffer.view,
        instances: handles.instances,
        indices: handles.indices,
        positions: handles.positions,
        depth: gbuffer.depth,
    };
    let calls = handles.moment.instances.iter().enumerate();
    let calls =
        calls.filter(|(_, instance)| instance.node >= first && instance.indices > 0).map(|(number, instance)| {
            DrawCall { first_vertex: 0, vertices: instance.indices, first_instance: number as u32, instances: 1 }
        });
    let targets = Targets::new().color(mask, Load::Clear([0.0; 4])).depth(depth, Depth::Clear(0.0));
    // Sides that the G-buffer does not show are at another depth.
    graph.raster(targets, Raster::new().cull(Cull::None), args, Draw::calls(calls.collect()));
    mask
}

/// Adds the light of point and spot lamps to `direct` at the pixels of added objects, with shadow maps. The light of emissive surfaces is that of the
/// probes. Returns notes about lamps without shadows.
pub(super) fn shine(
    graph: &mut Graph,
    handles: &Handles,
    lamps: Vec<types::Light>,
    (view, gbuffer): (&View, &GBuffer),
    [mask, direct]: [Image; 2],
    (settings, gloss): (&shadow::Settings, bool),
) -> Vec<Note> {
    let mut moment = (*handles.moment).clone();
    let lights = graph.buffer_from("daylight.lamps", &resident::lights_bytes(&lamps));
    moment.lights = lamps;
    let handles = Handles { lights, moment: moment.into(), ..handles.clone() };
    graph.scope("lamps", |graph| {
        let shadows = shadow::draw(graph, &handles, view, settings);
        // The emission of the objects is in the direct light already.
        let emission = graph.image("none", Format::RGBA16F, view.extent);
        graph.clear(emission, [0.0; 4]);
        let dark = GBuffer { emission, ..*gbuffer };
        let choices = Direct { specular: gloss, ..Direct::default() };
        let lit = direct::light(graph, &dark, Lights::from(&shadows), &choices);
        graph.compute(added_lamps::Args { mask, lamps: lit.direct, direct }, view.extent);
        shadows.notes
    })
}

/// The lamps that burn, as lights of the device. `burning`: how bright each group burns; `groups`: the group of each light.
pub(super) fn burning(
    lights: &[types::Light],
    groups: impl Iterator<Item = Option<usize>>,
    burning: &[[f32; 3]],
) -> Vec<types::Light> {
    let share = |group: Option<usize>| group.and_then(|group| burning.get(group)).map_or(0.0, |share| share[0]);
    let lit = lights.iter().zip(groups.map(share)).filter(|(_, share)| *share > 0.0);
    lit.enumerate()
        .map(|(number, (light, share))| types::Light {
            intensity: light.intensity.map(|channel| channel * share),
            index: number as u32,
            ..*light
        })
        .collect()
}

/// The scene of a frame without the instances of nodes from `first` on.
pub(super) fn without(handles: &Handles, first: u32) -> Handles {
    let mut moment = (*handles.moment).clone();
    // Numbers of instances stay, so they are hidden and not removed.
    moment.instances.iter_mut().filter(|instance| instance.node >= first).for_each(|instance| instance.indices = 0);
    Handles { moment: moment.into(), ..handles.clone() }
}
