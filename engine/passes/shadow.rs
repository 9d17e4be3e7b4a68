//! Shadow maps of spot, point and directional lights: plain, percentage closer, or exponential (ISR dissertation,
//! section 4.6, [ISR 30] and listing 8; cascades as its section 4.7 proposes).

mod slots;

pub use slots::{Assignment, assign, local_maps, project};

use crate::settings::{Described, JsonSchema, described};
use crate::{Error, Result};
use crate::{
    graph::{Buffer, Depth, Draw, Extent, Format, Graph, Image, ImageDesc, Raster, Targets},
    resident::{Batches, Cutout, Handles},
    scene::{Note, NoteKind, View, cull::Frustum},
    shaders::{
        consts,
        passes::{shadow as opaque, shadow_blur as blur, shadow_cutout as cutout},
        types,
    },
};
use serde::{Deserialize, Serialize};

/// How the depth in a map is compared with the receiver's depth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// No shadows.
    Off,
    /// A comparison with one texel.
    Plain,
    /// Percentage closer filter of 3×3 texels.
    #[default]
    Pcf,
    /// Exponential: exp(−c (r − o)) on prefiltered depth.
    Exponential,
}

/// Settings of shadow maps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Settings {
    /// How the depth in a map is compared with the receiver's depth.
    pub kind: Kind,
    /// Side of each map.
    #[schemars(range(min = 16, max = 8192), extend("x-unit" = "texels", "x-needs" = {"kind": {"not": {"const": "off"}}}))]
    pub size: u32,
    /// Maps of a directional light.
    #[schemars(range(min = 1, max = 8), extend("x-needs" = {"kind": {"not": {"const": "off"}}}))]
    pub cascades: u32,
    /// Distribution of the cascades: 0 evenly spaced, 1 in geometric progression.
    #[schemars(range(min = 0, max = 1), extend("x-needs" = {"kind": {"not": {"const": "off"}}}))]
    pub split: f32,
    /// Distance from the camera after which directional lights cast no shadow; 0: as far as the scene reaches.
    #[schemars(range(min = 0, max = 1e9), extend("x-unit" = "m", "x-needs" = {"kind": {"not": {"const": "off"}}}))]
    pub distance: f32,
    /// c of [ISR 30], for depths from 0 (at the light) to 1 (at the light's range, or at the end of the scene).
    #[schemars(range(min = 0.001, max = 1e6), extend("x-needs" = {"kind": {"const": "exponential"}}))]
    pub exponent: f32,
    /// For lights that reach farther than this, c grows in proportion, so that no light leaks through thin walls in large scenes. 0: c is the
    /// same for all lights, as in the dissertation.
    #[schemars(range(min = 0, max = 1e9), extend("x-unit" = "m", "x-needs" = {"kind": {"const": "exponential"}}))]
    pub exponent_reach: f32,
    /// Minimum share of c at grazing angles. 0: c falls with the cosine, as in listing 8, which leaks light along walls.
    #[schemars(range(min = 0, max = 1), extend("x-needs" = {"kind": {"const": "exponential"}}))]
    pub grazing: f32,
    /// Standard deviation of the logarithmic Gaussian prefilter; 0: no filter.
    #[schemars(range(min = 0, max = 16), extend("x-unit" = "texels", "x-needs" = {"kind": {"const": "exponential"}}))]
    pub blur: f32,
    /// Offset of the receiver towards the light before the comparison.
    #[schemars(range(min = 0, max = 1000), extend("x-unit" = "texels", "x-needs" = {"kind": {"enum": ["plain", "pcf"]}}))]
    pub depth_bias: f32,
    /// Offset of the receiver along its normal at grazing angles. The default is the reach of the filter of `pcf`: with less, surfaces that a
    /// lamp grazes have stripes of their own shadow.
    #[schemars(range(min = 0, max = 1000), extend("x-unit" = "texels", "x-needs" = {"kind": {"not": {"const": "off"}}}))]
    pub normal_bias: f32,
    /// Reach of a filter over the picture that smooths the shadows of the first 16 lights, to each side. It stops at steps of about a
    /// hundredth of the depth and at creases. 0: no filter. The dissertation proposes such a filter (section 4.6); a filter that does not stop would carry shadows across silhouettes.
    #[schemars(range(min = 0, max = 32), extend("x-unit" = "pixels", "x-needs" = {"kind": {"not": {"const": "off"}}}))]
    pub screen_blur: u32,
}

described!(Settings);

impl Default for Settings {
    fn default() -> Self {
        Self {
            kind: Kind::default(),
            size: 1024,
            cascades: 4,
            split: 0.8,
            distance: 0.0,
            exponent: 90.0,
            exponent_reach: 3.0,
            grazing: 0.5,
            blur: 1.5,
            depth_bias: 1.0,
            normal_bias: 2.0,
            screen_blur: 0,
        }
    }
}

impl Settings {
    /// As in the dissertation: exponential with c = 90 everywhere, weakened by the cosine (listing 8), maps of 512².
    pub fn dissertation() -> Self {
        Self { kind: Kind::Exponential, size: 512, exponent_reach: 0.0, grazing: 0.0, ..Self::default() }
    }

    /// # Errors
    /// `Usage`, naming the key, the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        Self::description().check(self).map_err(|error: Error| error.at("shadow"))
    }
}

/// The resources that `lib/shadow.glsl` binds, and notes about lights without shadows.
#[derive(Clone, Debug)]
pub struct ShadowMaps {
    /// Block `Lights`: the scene's lights.
    pub lights: Buffer,
    /// Block `Shadows`.
    pub shadows: Buffer,
    /// Sampler `shadow_maps`: an array, one layer a slot.
    pub maps: Image,
    /// Number of lights, and the reach of the filter over the picture, pixels ([`Settings::screen_blur`]).
    pub screen_blur: (u32, u32),
    /// Lights without shadows because all [`consts::MAX_SHADOW_SLOTS`] maps are taken, and lights whose shadows are not filtered.
    pub notes: Vec<Note>,
}

/// Draws the shadow maps of all lights of the scene. Lights get maps in the order of the list, until all maps are taken.
pub fn draw(graph: &mut Graph, scene: &Handles, view: &View, settings: &Settings) -> ShadowMaps {
    draw_of(graph, scene, view, settings, |_| true)
}

/// The same for the lights that `casts` chooses. All other lights have no maps.
pub fn draw_of(
    graph: &mut Graph,
    scene: &Handles,
    view: &View,
    settings: &Settings,
    casts: impl Fn(&types::Light) -> bool,
) -> ShadowMaps {
    let settings = sane(settings);
    let assignment = match settings.kind {
        Kind::Off => Assignment::none(scene.moment.lights.len()),
        _ => assign(&scene.moment.lights, &scene.bounds(), view, &settings, casts),
    };
    let shadows = graph.buffer_from("shadow.slots", &block(&assignment, &settings));
    let screen_blur = if settings.kind == Kind::Off { 0 } else { settings.screen_blur };
    let notes = assignment.unshadowed.iter().map(|light| Note {
        kind: NoteKind::Ignored,
        place: format!("lights[{light}]"),
        text: format!("casts no shadow: all {} shadow maps are taken", consts::MAX_SHADOW_SLOTS),
    });
    let few = (screen_blur > 0 && scene.moment.lights.len() > consts::SHADOW_SCREENED as usize).then(|| Note {
        kind: NoteKind::Approximated,
        place: "shadow.screen_blur".into(),
        text: format!("only the shadows of the first {} lights are filtered", consts::SHADOW_SCREENED),
    });
    let notes = notes.chain(few).collect();
    let maps = graph.scope("shadow", |graph| maps(graph, scene, &assignment, shadows, &settings));
    ShadowMaps {
        lights: scene.lights,
        shadows,
        maps,
        screen_blur: (scene.moment.lights.len() as u32, screen_blur),
        notes,
    }
}

/// Settings without values that [`draw`], which has no errors, cannot use. Callers that need an error call [`Settings::validate`].
fn sane(settings: &Settings) -> Settings {
    let positive = |x: f32, or: f32| if x.is_finite() && x >= 0.0 { x } else { or };
    Settings {
        size: settings.size.clamp(16, 8192),
        cascades: settings.cascades.clamp(1, 8),
        split: positive(settings.split, 0.8).min(1.0),
        distance: positive(settings.distance, 0.0),
        exponent: positive(settings.exponent, 90.0).max(1e-3),
        exponent_reach: positive(settings.exponent_reach, 0.0),
        grazing: positive(settings.grazing, 0.0).min(1.0),
        blur: positive(settings.blur, 0.0).min(16.0),
        depth_bias: positive(settings.depth_bias, 0.0),
        normal_bias: positive(settings.normal_bias, 0.0),
        screen_blur: settings.screen_blur.min(32),
        ..*settings
    }
}

/// The bytes of block `Shadows`.
fn block(assignment: &Assignment, settings: &Settings) -> Vec<u32> {
    let header = types::ShadowSettings {
        kind: match settings.kind {
            Kind::Off => consts::SHADOW_OFF,
            Kind::Plain => consts::SHADOW_PLAIN,
            Kind::Pcf => consts::SHADOW_PCF,
            Kind::Exponential => consts::SHADOW_EXPONENTIAL,
        },
        depth_bias: settings.depth_bias,
        normal_bias: settings.normal_bias,
        size: settings.size as f32,
        grazing: settings.grazing,
    };
    let mut slots = vec![types::ShadowSlot::default(); consts::MAX_SHADOW_SLOTS as usize];
    slots[..assignment.slots.len()].copy_from_slice(&assignment.slots);
    let mut out = bytemuck::cast_slice(&[header]).to_vec();
    out.extend_from_slice(bytemuck::cast_slice(&slots));
    out.extend_from_slice(bytemuck::cast_slice(&assignment.lights));
    if assignment.lights.is_empty() {
        out.extend_from_slice(&[0, 0]);
    }
    out
}

fn maps(graph: &mut Graph, scene: &Handles, assignment: &Assignment, shadows: Buffer, settings: &Settings) -> Image {
    let count = assignment.slots.len() as u32;
    if count == 0 {
        let none = graph.image("shadow.none", Format::R32F, Extent::square(1));
        graph.clear(none, [1.0; 4]);
        return none.nearest();
    }
    let extent = Extent::square(settings.size);
    let depth = graph.image_with("shadow.depth", ImageDesc::new(Format::D32F, extent).layers(count));
    for (index, slot) in assignment.slots.iter().enumerate() {
        draw_slot(graph, scene, depth.layer(index as u32), slot, &format!("passes.shadow.map{index}"));
    }
    if settings.kind != Kind::Exponential {
        return depth.nearest();
    }
    let desc = ImageDesc::new(Format::R32F, extent).layers(count);
    let across = graph.image_with("shadow.exponential.across", desc);
    let filtered = graph.image_with("shadow.exponential", desc);
    let radius = (2.0 * settings.blur).ceil() as i32;
    for (from, to, step, from_hardware) in [(depth, across, [1, 0], 1), (across, filtered, [0, 1], 0)] {
        let args = blur::Args {
            filtered: to,
            lights: scene.lights,
            shadows,
            shadow_maps: from.nearest(),
            push: blur::Push { step, radius, deviation: settings.blur.max(1e-3), slots: count },
            spec: blur::Spec { from_hardware },
        };
        let name = if step == [1, 0] { "passes.shadow.blur.x" } else { "passes.shadow.blur.y" };
        graph.compute(args, [settings.size, settings.size, count]).named(name);
    }
    filtered.nearest()
}

fn draw_slot(graph: &mut Graph, scene: &Handles, layer: Image, slot: &types::ShadowSlot, name: &str) {
    let clip_from_world = slot.clip_from_world;
    let frustum = Frustum::from_clip(&glam::Mat4::from_cols_array_2d(&clip_from_world));
    let batches = Batches::of_casters(&scene.moment, Some(&frustum), glam::Vec3::ZERO);
    let visible = batches.visible_buffer(graph, "shadow.visible");
    let state = Raster::new();
    let args = opaque::Args {
        instances: scene.instances,
        visible,
        positions: scene.positions,
        push: opaque::Push { clip_from_world },
    };
    let (solid, holed): (Vec<_>, Vec<_>) = batches.list.iter().partition(|b| b.cutout == Cutout::Opaque);
    let calls: Vec<_> = solid.iter().flat_map(|b| b.calls.iter().copied()).collect();
    let targets = |load| Targets::new().depth(layer, load);
    let draw = Draw::indexed(scene.indices, calls);
    graph.raster(targets(Depth::Clear(0.0)), state, args, draw).named(name);
    if holed.is_empty() {
        return;
    }
    let args = cutout::Args {
        instances: scene.instances,
        visible,
        positions: scene.positions,
        uvs: scene.uvs,
        colors: scene.colors,
        materials: scene.materials,
        scene_textures: scene.textures,
        push: cutout::Push { clip_from_world, seed: graph.seed },
    };
    let calls: Vec<_> = holed.iter().flat_map(|b| b.calls.iter().copied()).collect();
    let draw = Draw::indexed(scene.indices, calls);
    graph.raster(targets(Depth::Keep), state, args, draw).named(format!("{name}.cutout"));
}
