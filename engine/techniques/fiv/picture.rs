//! The passes of a frame, from a scene on the device to the final picture.

use std::{collections::HashMap, sync::Arc};

use serde::{Deserialize, Serialize};

use super::{
    Extent as Reach, Fiv, Interpolation, Method, Placed, SelfSamples, Settings, Shared, Specular, online::Seen,
    online_occluders::FrameOccluders, specular::Shadows, spots::Spot, suns, tiles::Tiles,
};
use crate::{
    Error, Result,
    graph::{Buffer, Depth, Extent, Format, Graph, Image, Items, Load, Raster, Targets},
    passes::{
        gbuffer::{self, GBuffer},
        skybox,
    },
    resident::{Batches, Handles},
    scene::{Note, Pose, Scene, View, cull::Frustum},
    shaders::{self, consts::FIV_SPOTS, types},
};

/// Most boxes that brute force tests before a ray is traced. For more boxes the acceleration structure is faster.
const MOST_BOXES: usize = 8;
/// Marks a missing occluder, vector or table.
const NONE: u32 = u32::MAX;

/// Settings of all stages.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PictureSettings {
    pub fiv: Settings,
    pub gbuffer: gbuffer::Settings,
}

impl PictureSettings {
    /// # Errors
    /// `Usage`, naming the key with its group, the value found and the values allowed.
    pub fn validate(&self) -> Result<()> {
        self.fiv.validate().map_err(|error| error.at("fiv"))
    }
}

/// Images of a frame, at full resolution.
#[derive(Clone, Copy, Debug)]
pub struct Outputs {
    /// Reflected and emitted light with the environment behind, W/(sr·m²).
    pub total: Image,
    /// Irradiance of the visible surfaces, W/m²; 0 on the background.
    pub irradiance: Image,
    /// Glossily reflected radiance, W/(sr·m²), if the settings ask for glossy reflection.
    pub specular: Option<Image>,
}

/// A picture and the stages before it.
#[derive(Clone, Debug)]
pub struct Picture {
    pub gbuffer: GBuffer,
    /// The scene that the G-buffer shows, if occluders are hidden.
    pub receivers: Option<Handles>,
    pub outputs: Outputs,
    /// Approximations of this frame.
    pub notes: Vec<Note>,
}

/// Per-pixel inputs of the passes.
struct Pixels<'a> {
    gbuffer: &'a GBuffer,
    identity: Image,
    occluders: Buffer,
    /// Bits of the occluders that may affect each tile, and words per tile.
    near: (Buffer, u32),
    irradiance: Image,
}

impl Fiv {
    /// Declares a frame: G-buffer, irradiance, reflected light and sky. `handles` belong to this graph and to `pose`.
    /// The settings that decide the vectors must be those of [`Fiv::new`]. Each picture may choose the parts of the
    /// method (`trilinear`, `partial`, `cut`, `extent`, `overlap`, `shared`, `negligible`, `self_shadow`), whether occluders are drawn
    /// (`hide_occluders`), the light (`rotation`, `exposure`) and [`Method::Unshadowed`]. With precomputed vectors, pictures can switch `self_shadow`
    /// off but not on.
    ///
    /// Precomputed vectors are valid for the environment that [`Fiv::new`] was given. Other methods use the environment
    /// that `scene` has now, and they read all its pixels to detect a change. The sky behind the scene is the
    /// environment of `handles`. If the rotation differs from that of the last picture, the environment is resampled:
    /// pixel by pixel, or, if `turning` is not 0, from means of pixels, which is much faster and nearly exact.
    ///
    /// # Errors
    /// `Usage` if a setting is out of its range, if a setting needs data that [`Fiv::new`] did not prepare, or if
    /// vectors are precomputed and the environment has another size or other pixels (a thousand pixels are compared).
    pub fn picture(
        &mut self,
        graph: &mut Graph,
        scene: &Scene,
        pose: &Pose,
        handles: &Handles,
        view: &View,
        settings: &PictureSettings,
    ) -> Result<Picture> {
        let settings = &PictureSettings { fiv: self.prepared.picture(&settings.fiv)?, ..settings.clone() };
        self.follow(scene, &settings.fiv)?;
        let receivers = settings.fiv.hide_occluders.then(|| self.without_occluders(handles));
        let drawn = receivers.as_ref().unwrap_or(handles);
        let gbuffer = gbuffer::draw(graph, drawn, view, &settings.gbuffer);
        let extent = graph.extent(gbuffer.depth);
        let outputs = graph.scope("fiv", |graph| {
            let (irradiance, shadows) = match (settings.fiv.method, &self.rays) {
                (Method::BruteForce, Some(_)) => (self.truth(graph, handles, &gbuffer), None),
                _ => {
                    let (irradiance, shadows) =
                        self.irradiance(graph, (scene, pose, (handles, drawn)), view, &gbuffer, &settings.fiv)?;
                    (irradiance, Some(shadows))
                }
            };
            let total = graph.image("fiv.radiance", Format::RGBA32F, extent);
            let (albedo, depth, emission) = (gbuffer.albedo, gbuffer.depth, gbuffer.emission);
            let args = shaders::fiv::compose::Args {
                view: gbuffer.view,
                albedo,
                normal: gbuffer.normal,
                depth,
                surface: gbuffer.specular,
                emission,
                irradiance,
                total,
                spec: shaders::fiv::compose::Spec { layered: (settings.fiv.specular == Specular::Summed).into() },
            };
            graph.compute(args, extent);
            let specular = match settings.fiv.specular {
                Specular::Off => None,
                Specular::Summed => {
                    let shadows = shadows.as_ref();
                    Some(self.specular(graph, (pose, handles), &gbuffer, &settings.fiv, shadows, total)?)
                }
            };
            Ok::<_, Error>(Outputs { total, irradiance, specular })
        })?;
        let mut behind = handles.clone();
        let moment = Arc::make_mut(&mut behind.moment);
        let (turn, factor) = settings.fiv.light();
        moment.environment_rotation += turn;
        moment.environment_scale *= factor;
        skybox::draw(graph, &behind, &gbuffer, glam::Vec3::ZERO, outputs.total);
        let notes = if settings.fiv.method == Method::Vectors {
            self.turned(scene, pose, &handles.moment.instances)
        } else {
            Vec::new()
        };
        Ok(Picture { gbuffer, receivers, outputs, notes })
    }

    /// The scene without the instances that are occluders, for passes that draw.
    fn without_occluders(&self, handles: &Handles) -> Handles {
        let mut drawn = handles.clone();
        let hidden = |node: u32| self.occluders.placed.iter().any(|placed| placed.node == node);
        for instance in Arc::make_mut(&mut drawn.moment).instances.iter_mut().filter(|i| hidden(i.node)) {
            // The numbers of the instances stay those of the device's list.
            instance.indices = 0;
        }
        drawn
    }

    /// Irradiance of the environment minus the irradiance that occluders hide ([FIV 12]). `drawn`: the scene as passes draw it.
    fn irradiance(
        &mut self,
        graph: &mut Graph,
        (scene, pose, (handles, drawn)): (&Scene, &Pose, (&Handles, &Handles)),
        view: &View,
        gbuffer: &GBuffer,
        settings: &Settings,
    ) -> Result<(Image, Shadows)> {
        let extent = graph.extent(gbuffer.depth);
        let irradiance = graph.image("fiv.irradiance", Format::RGBA32F, extent);
        graph.clear(irradiance, [0.0; 4]);
        let deforming = self.deforming(pose, &handles.moment.instances);
        let in_frame = match (settings.method, &self.online) {
            (Method::Online, Some(online)) => online.in_frame(scene, pose, &self.occluders),
            (Method::Vectors, _) => self.stored(pose, &deforming),
            _ => FrameOccluders::default(),
        };
        let count = in_frame.list.len() as u32;
        let stored = graph.import_buffer(&self.fivs);
        let owners = self.owners((pose, &deforming), &in_frame.nodes, &handles.moment.instances, settings);
        let any = !in_frame.nodes.is_empty();
        let (identity, own) = identity(graph, drawn, view, gbuffer, (&owners, stored, any));
        let mut list = in_frame.list.clone();
        if settings.extent == Reach::Sphere {
            list.iter_mut().for_each(|occluder| occluder.reach = NONE);
        }
        let kinds: HashMap<u32, u32> = self.occluders.placed.iter().map(|placed| (placed.node, placed.kind)).collect();
        for (number, (occluder, node)) in list.iter_mut().zip(&in_frame.nodes).enumerate() {
            let fill = kinds.get(node).map_or(1.0, |&kind| self.fill(kind));
            occluder.cut_fill = (fill * in_frame.fills.get(number).copied().unwrap_or(1.0)).min(1.0);
            occluder.fill = if settings.shared == Shared::Discs { 1.0 } else { occluder.cut_fill };
        }
        list.resize(list.len().max(1), types::FivOccluder::default());
        let occluders = graph.buffer_from("fiv.occluders", &list);
        let matter = self.matter(settings)?.map(|table| graph.import_buffer(table));
        let negligible = matter.is_some();
        let matter = matter.unwrap_or_else(|| graph.buffer_from("fiv.matter", &[0f32]));
        let tiles = Tiles::new(graph, gbuffer, (occluders, count), (matter, negligible), settings, self.limited);
        let fivs = match &mut self.online {
            Some(online) if count > 0 => {
                let seen = Seen { gbuffer, identity, occluders, own, near: (tiles.near, tiles.words) };
                online.vectors(graph, (&self.occluders, pose), &in_frame, &self.light, &seen, settings)?
            }
            _ => stored,
        };
        let shared = settings.overlap && settings.shared == Shared::Lights && count > 1 && !self.light.spots.is_empty();
        let total = self.light.total;
        let whole = types::FivWhole {
            x: [total[0], total[1], total[2]],
            y: [total[3], total[4], total[5]],
            z: [total[6], total[7], total[8]],
            occluders: count,
            spots: if shared { self.light.spots.len() as u32 } else { 0 },
            negligible: settings.negligible,
            turn: [self.light.map_turn.cos(), self.light.map_turn.sin()],
            factor: self.light.map_factor,
        };
        let whole = graph.uniform(&whole);
        let mut spots: Vec<_> = self.light.spots.iter().map(Spot::packed).collect();
        spots.resize(FIV_SPOTS as usize, types::FivSpot::default());
        let spots = graph.buffer_from("fiv.spots", &spots);
        // Only several calls need to pass these sums on.
        let kept = if shared && tiles.each < count { extent.pixels() * 12 * u64::from(FIV_SPOTS) } else { 4 };
        let taken = graph.buffer("fiv.taken", kept);
        graph.fill(taken, 0);
        let difmap = graph.import_image(&self.light.difmap);
        let mut reaches = graph.import_buffer(&self.reaches);
        if !in_frame.reaches.is_empty() {
            let moved = graph.buffer_from("fiv.reaches.moved", &in_frame.reaches);
            let all = graph.buffer("fiv.reaches.all", reaches.size + moved.size);
            graph.copy_buffer(reaches, all.range(0..reaches.size));
            graph.copy_buffer(moved, all.range(reaches.size..all.size));
            reaches = all;
        }
        let own_way = match (settings.self_shadow, settings.self_samples) {
            (false, _) => 0,
            (_, SelfSamples::Spheres) => 1,
            (_, SelfSamples::Surface) => 2,
        };
        for first in (0..count.max(1)).step_by(tiles.each as usize) {
            let number = tiles.each.min(count.saturating_sub(first));
            let pairs = tiles.pairs(graph, (first, number), settings);
            let args = shaders::fiv::light::Args {
                view: gbuffer.view,
                normal: gbuffer.normal,
                depth: gbuffer.depth,
                identity,
                difmap: difmap.as_cube(),
                occluders,
                fivs,
                irradiance,
                whole,
                own,
                reaches,
                near: tiles.near,
                pairs,
                spots,
                taken,
                matter,
                push: shaders::fiv::light::Push { first, count: number, words: tiles.words },
                spec: shaders::fiv::light::Spec {
                    partial: settings.partial_way(),
                    overlap: settings.overlap.into(),
                    own: own_way,
                    trilinear: settings.trilinear.into(),
                    scaled: (settings.trilinear && settings.interpolation == Interpolation::SolidAngle).into(),
                    spots: shared.into(),
                    negligible: negligible.into(),
                    held: if self.on_cpu { tiles.held(settings) } else { 1 },
                },
            };
            graph.compute(args, extent);
        }
        let pixels = Pixels { gbuffer, identity, occluders, near: (tiles.near, tiles.words), irradiance };
        self.suns(graph, &in_frame, &pixels, settings.self_shadow);
        Ok((irradiance, Shadows { identity, occluders, fivs, near: (tiles.near, tiles.words), count }))
    }

    /// Adds the light of separated texels.
    fn suns(&self, graph: &mut Graph, in_frame: &FrameOccluders, pixels: &Pixels<'_>, own: bool) {
        let count = self.light.suns.len() as u32;
        if count == 0 {
            return;
        }
        // Texels are separated only for precomputed vectors, for which all occluders are in the list in their order.
        let shade = |(placed, occluder): (&Placed, &types::FivOccluder)| {
            let own = own && occluder.self_shadows != 0 && occluder.turned == 0;
            types::FivShade { map: placed.kind * count * suns::FLOATS, own: own.into() }
        };
        let mut shades: Vec<_> = self.occluders.placed.iter().zip(&in_frame.list).map(shade).collect();
        shades.resize(shades.len().max(1), types::FivShade::default());
        let shades = graph.buffer_from("fiv.shades", &shades);
        let suns = graph.buffer_from("fiv.sunlight", &self.light.suns);
        let depths = graph.import_buffer(&self.maps);
        let Pixels { gbuffer, identity, occluders, near: (near, words), irradiance } = *pixels;
        // One dispatch per texel, because each may loop over all occluders.
        for sun in 0..count {
            let args = shaders::fiv::suns::Args {
                view: gbuffer.view,
                normal: gbuffer.normal,
                depth: gbuffer.depth,
                identity,
                occluders,
                shades,
                depths,
                suns,
                near,
                irradiance,
                push: shaders::fiv::suns::Push { sun, words },
            };
            graph.compute(args, graph.extent(irradiance));
        }
    }

    /// Irradiance by one shadow ray to every texel that is not black ([FIV 6] with visibility).
    fn truth(&mut self, graph: &mut Graph, handles: &Handles, gbuffer: &GBuffer) -> Image {
        let extent = graph.extent(gbuffer.depth);
        let irradiance = graph.image("fiv.truth", Format::RGBA32F, extent);
        graph.clear(irradiance, [0.0; 4]);
        let Some(rays) = &mut self.rays else { return irradiance };
        if self.light.lit.is_empty() {
            return irradiance;
        }
        let turns = rays.most_turns();
        let rays_of = rays.frame(graph, handles);
        let (texels, lit) = self.light.import(graph);
        let boxes = boxes(handles);
        let around = boxes.len() as u32 / 2;
        let boxes = graph.buffer_from("fiv.boxes", if boxes.is_empty() { &[[0.0; 3]] } else { &boxes[..] });
        let args = crate::rays::traced!(
            shaders::fiv::truth::Args {
                view: gbuffer.view,
                normal: gbuffer.normal,
                depth: gbuffer.depth,
                texels,
                lit,
                irradiance,
                boxes,
                push: shaders::fiv::truth::Push {
                    size: self.light.size,
                    around,
                    seed: graph.seed,
                    ..Default::default()
                },
            },
            rays_of
        );
        let texels = Items::new(self.light.lit.len() as u32).rays(extent.pixels()).turns(turns);
        graph.compute_over(args, extent, texels);
        irradiance
    }
}

/// Corners of boxes around all instances that block light. Empty if there are too many.
fn boxes(handles: &Handles) -> Vec<[f32; 3]> {
    let casting = || handles.moment.instances.iter().filter(|instance| instance.casts);
    if casting().count() > MOST_BOXES {
        return Vec::new();
    }
    let all = handles.bounds();
    // Rounding must not lose a surface that touches a side of the box.
    let grown = 1e-6 * all.max.abs().max(all.min.abs()).max_element();
    casting().flat_map(|i| [(i.bounds.min - grown).to_array(), (i.bounds.max + grown).to_array()]).collect()
}

/// Draws the number of the visible occluder plus one (0: none) with its linear depth, and the irradiance that reaches
/// the pixel past its own occluder. `any`: there are occluders.
fn identity(
    graph: &mut Graph,
    handles: &Handles,
    view: &View,
    gbuffer: &GBuffer,
    (owners, fivs, any): (&[types::FivOwner], Buffer, bool),
) -> (Image, Image) {
    let extent = Extent::from(view.extent);
    let identity = graph.image("fiv.identity", Format::RG32F, extent);
    let own = graph.image("fiv.own", Format::RGBA32F, if any { extent } else { Extent::new(1, 1) });
    if !any {
        graph.clear(identity, [0.0; 4]);
        graph.clear(own, [0.0; 4]);
        return (identity, own);
    }
    let depth = graph.image("fiv.identity.depth", Format::D32F, extent);
    let owners = graph.buffer_from("fiv.owners", owners);
    let batches = Batches::new(&handles.moment, Some(&Frustum::new(view)), view.position);
    let visible = batches.visible_buffer(graph, "fiv.visible");
    for index in 0..batches.list.len().max(1) {
        let batch = batches.list.get(index);
        let first = index == 0;
        let load = || if first { Load::Clear([0.0; 4]) } else { Load::Keep };
        let targets = Targets::new()
            .color(identity, load())
            .color(own, load())
            .depth(depth, if first { Depth::Clear(0.0) } else { Depth::Keep });
        let args = shaders::fiv::identity::Args {
            view: gbuffer.view,
            instances: handles.instances,
            visible,
            positions: handles.positions,
            owners,
            fivs,
            normal: gbuffer.normal,
            depth: gbuffer.depth,
        };
        let state = Raster::new().cull(batch.map_or_else(Default::default, |b| b.sided.cull()));
        let none = || crate::graph::Draw::indexed(handles.indices, Vec::new());
        graph.raster(targets, state, args, batch.map_or_else(none, |b| b.draw(handles)));
    }
    (identity, own)
}
