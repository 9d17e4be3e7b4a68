//! Surfaces that send light without being in the picture: the dissertation's future work (chapter 6).
//!
//! Small additional views are drawn and lit like the frame: a wider one of the same camera ([`Settings::border`]), what lies behind
//! the visible surfaces ([`Settings::layers`], depth peeling), and other cameras ([`Settings::cameras`]). Each pixel then gathers from
//! them as from the frame. No surface counts twice: what the frame shows is the frame's, and what several of the others show is
//! shared between them in proportion to their texels on it (the balance heuristic of Veach and Guibas 1995).
//!
//! For further bounces ([`Settings::bounces`]) these views gather too: each from all of them and from a small picture of the frame.

use super::{AreaLights, Sender, Settings, Surroundings};
use crate::{
    graph::{Buffer, Extent, Format, Graph, Image, ImageDesc, Uniform},
    passes::{
        direct::{self, Direct, Lights},
        downsample::Coarse,
        gbuffer::{self, GBuffer},
        shadow,
    },
    resident::Handles,
    scene::{Camera, Projection, View},
    shaders::{self, types},
};
use glam::{Mat4, Vec3};

/// Vertical angle of view of the further cameras, radians.
const YFOV: f32 = 1.75;
/// Most views: one around the frame, three layers, four cameras, and the frame itself.
const MOST: usize = 9;

/// Views of one size in one set of array images, a layer each.
#[derive(Clone, Copy, Debug)]
pub struct Senders {
    /// Radiance times mask, and the mask; with levels.
    pub radiance: Image,
    pub normal: Image,
    /// Linear depth / far.
    pub depth: Image,
    /// Block of `SenderView`.
    pub views: Buffer,
    /// Views that the frame gathers from.
    pub count: u32,
    /// What each view receives light with; after those that the frame gathers from, the frame's own small picture, if there are
    /// further bounces.
    receivers: [Option<Receiver>; MOST],
    /// Linear depth of the layers behind the visible one, for telling what hides senders; the picture of each is wider than the
    /// frame's by 1 + [`Settings::border`].
    pub behind: [Option<Image>; 3],
}

/// A view to gather from.
#[derive(Clone, Copy, Debug)]
pub struct SenderView {
    pub gbuffer: GBuffer,
    /// What its surfaces send, W/(sr·m²).
    pub color: Image,
    pub uniform: types::View,
    /// Half width of the square in the middle from which nothing is taken, as share of the picture's: what the frame shows.
    pub hole: f32,
}

/// A view as a place where light arrives.
#[derive(Clone, Copy, Debug)]
struct Receiver {
    view: Uniform<types::View>,
    albedo: Image,
}

/// Buffers of the view that gathers.
struct Gathering {
    view: Uniform<types::View>,
    factor: f32,
    albedo: Image,
    normal: Image,
    depth: Image,
    /// What it has gathered from its own picture; `None`: nothing, the views are all that it gathers from.
    before: Option<Image>,
    /// The first so many views send.
    count: u32,
}

impl Senders {
    /// Puts at most eight views of one extent together; `None` if there are none. `frame`: the frame's own picture in that extent, for
    /// the light that the views get from it; needed where there are further bounces.
    pub fn pack(graph: &mut Graph, views: &[SenderView], frame: Option<SenderView>) -> Option<Self> {
        let extent = graph.extent(views.first()?.gbuffer.depth);
        let own = views.len().min(MOST - 1);
        let views: Vec<SenderView> = views[..own].iter().copied().chain(frame).collect();
        let count = views.len() as u32;
        // Array images of one layer are no arrays.
        let layers = count.max(2);
        let desc = |format| ImageDesc::new(format, extent).layers(layers);
        let mut senders = Self {
            radiance: graph.image_with("isr.senders.radiance", desc(Format::RGBA16F).all_mips()),
            normal: graph.image_with("isr.senders.normal", desc(Format::RGBA16F)),
            depth: graph.image_with("isr.senders.depth", desc(Format::R32F)),
            views: graph.buffer_from(
                "isr.senders.views",
                &views.iter().map(|v| types::SenderView { view: v.uniform, hole: v.hole }).collect::<Vec<_>>(),
            ),
            count: own as u32,
            receivers: [None; MOST],
            behind: [None; 3],
        };
        for (receiver, view) in senders.receivers.iter_mut().zip(&views) {
            *receiver = Some(Receiver { view: view.gbuffer.view, albedo: view.gbuffer.albedo });
        }
        for layer in 0..layers {
            let view = &views[layer.min(count - 1) as usize];
            let args = shaders::isr::pack::Args {
                albedo: view.gbuffer.albedo,
                normal: view.gbuffer.normal,
                depth: view.gbuffer.depth,
                color: view.color,
                their_radiance: senders.radiance.layer(layer).mip(0),
                their_normal: senders.normal.layer(layer),
                their_depth: senders.depth.layer(layer),
            };
            graph.compute(args, extent);
        }
        graph.mips(senders.radiance);
        senders.radiance = senders.radiance.trilinear();
        Some(senders)
    }

    /// Adds their light to `gathered` (rgb for a white receiver).
    pub(super) fn gather(
        &self,
        graph: &mut Graph,
        frame: &GBuffer,
        coarse: &Coarse,
        gathered: Image,
        settings: &Settings,
    ) -> Image {
        let frame = Gathering {
            view: frame.view,
            factor: settings.resolution.factor() as f32,
            albedo: coarse.albedo,
            normal: coarse.normal,
            depth: coarse.depth,
            before: Some(gathered),
            count: self.count,
        };
        self.gather_in(graph, &frame, settings)
    }

    /// What the views send after one bounce more than `self`: `first` is what they sent before any.
    pub(super) fn bounce(&self, graph: &mut Graph, first: &Self, settings: &Settings) -> Self {
        let extent = graph.extent(self.depth);
        let layers = graph.desc(self.radiance).layers;
        let desc = ImageDesc::new(Format::RGBA16F, extent).layers(layers).all_mips();
        let radiance = graph.image_with("isr.senders.bounced", desc);
        let count = self.receivers.iter().flatten().count() as u32;
        for layer in 0..layers {
            let number = layer.min(count - 1);
            let Some(receiver) = self.receivers[number as usize] else { continue };
            let gathering = Gathering {
                view: receiver.view,
                factor: 1.0,
                albedo: receiver.albedo,
                normal: self.normal.layer(number),
                depth: self.depth.layer(number),
                before: None,
                count,
            };
            let gathered = self.gather_in(graph, &gathering, settings);
            let args = shaders::isr::bounce::Args {
                sender: first.radiance.layer(number),
                albedo: receiver.albedo,
                gathered,
                next: radiance.layer(layer).mip(0),
                spec: shaders::isr::bounce::Spec { premultiplied: 1 },
            };
            graph.compute(args, extent);
        }
        graph.mips(radiance);
        Self { radiance: radiance.trilinear(), ..*self }
    }

    fn gather_in(&self, graph: &mut Graph, receiver: &Gathering, settings: &Settings) -> Image {
        let extent = graph.extent(receiver.depth);
        let mut gathered = receiver.before.unwrap_or(receiver.depth);
        for number in 0..receiver.count {
            let next = graph.image("isr.gathered.more", Format::RGBA16F, extent);
            let args = shaders::isr::gather_view::Args {
                view: receiver.view,
                albedo: receiver.albedo,
                normal: receiver.normal,
                depth: receiver.depth,
                before: gathered,
                sender_views: self.views,
                their_radiance: self.radiance,
                their_normal: self.normal,
                their_depth: self.depth,
                gathered: next,
                push: shaders::isr::gather_view::Push {
                    factor: receiver.factor,
                    thickness: settings.thickness,
                    number,
                    count: receiver.count,
                },
                spec: shaders::isr::gather_view::Spec {
                    samples: settings.sender_samples,
                    visibility_steps: settings.visibility_steps,
                    prefilter: settings.prefilter.into(),
                    jitter: settings.jitter.into(),
                    gathered: receiver.before.is_some().into(),
                },
            };
            graph.compute(args, extent);
            gathered = next;
        }
        gathered
    }
}

/// Draws and lights the additional views that the settings ask for; `None` if they ask for none.
pub fn draw(
    graph: &mut Graph,
    scene: &Handles,
    view: &View,
    (frame_lights, surroundings): (Lights, &Surroundings),
    gbuffers: &gbuffer::Settings,
    shadows: &shadow::Settings,
    settings: &Settings,
) -> Option<Senders> {
    if settings.border <= 0.0 && settings.layers <= 1 && settings.cameras == 0 {
        return None;
    }
    let lights = lights(graph, scene, frame_lights, shadows);
    let extent = Extent::from(view.extent).div_ceil(settings.sender_scale);
    let size = [extent.width, extent.height];
    let area = surroundings.area.filter(|_| settings.area_lights == AreaLights::Rays);
    let ambient = area.map(|_| surroundings.ambient.upload(graph));
    let lit = |graph: &mut Graph, gbuffer: GBuffer, view: &View, hole: f32| {
        let direct = Direct { specular: false, glow: area.is_none(), ..settings.direct() };
        let color = match settings.sender {
            Sender::Albedo => gbuffer.albedo,
            Sender::Lit => {
                let lit = direct::light(graph, &gbuffer, lights, &direct).diffuse;
                match area.zip(ambient) {
                    Some((area, ambient)) => area.added(graph, lit, &gbuffer, ambient, settings),
                    None => lit,
                }
            }
        };
        SenderView { gbuffer, color, uniform: view.uniform(), hole }
    };
    let mut views = Vec::new();
    let mut behind = [None; 3];
    if settings.border > 0.0 || settings.layers > 1 {
        let wider = 1.0 + settings.border;
        let around = view.wider(wider, size);
        let mut layer = gbuffer::draw(graph, scene, &around, gbuffers);
        if settings.border > 0.0 {
            // A little less than the frame: the shares of the surfaces decide at its edge.
            views.push(lit(graph, layer, &around, 0.96 / wider));
        }
        for index in 1..settings.layers as usize {
            layer = gbuffer::draw_behind(graph, scene, &around, gbuffers, layer.depth);
            behind[index - 1] = Some(layer.depth);
            views.push(lit(graph, layer, &around, 0.0));
        }
    }
    for camera in cameras(scene, view, settings.cameras, size) {
        let seen = gbuffer::draw(graph, scene, &camera, gbuffers);
        views.push(lit(graph, seen, &camera, 0.0));
    }
    let frame = (settings.bounces > 1).then(|| {
        let small = view.wider(1.0, size);
        let seen = gbuffer::draw(graph, scene, &small, gbuffers);
        lit(graph, seen, &small, 0.0)
    });
    Senders::pack(graph, &views, frame).map(|senders| Senders { behind, ..senders })
}

/// The frame's lights; where one is directional, with shadow maps that reach over the whole scene instead of what the frame shows.
fn lights(graph: &mut Graph, scene: &Handles, frame: Lights, shadows: &shadow::Settings) -> Lights {
    let suns = scene.moment.lights.iter().any(|light| light.kind == shaders::consts::LIGHT_DIRECTIONAL);
    if !suns || shadows.kind == shadow::Kind::Off {
        return Lights { screen_blur: (0, 0), ..frame };
    }
    let bounds = scene.bounds();
    let radius = bounds.half().length().clamp(1e-3, 1e6);
    let projection = Projection::Orthographic { xmag: radius, ymag: radius, znear: 0.0, zfar: 2.0 * radius };
    let from = Mat4::from_translation(bounds.centre() + Vec3::Z * radius);
    let all = View::new(&Camera { name: String::new(), projection }, from, [64, 64]);
    let settings = shadow::Settings { cascades: 1, distance: 0.0, screen_blur: 0, ..*shadows };
    Lights::from(&graph.scope("isr.senders", |graph| shadow::draw(graph, scene, &all, &settings)))
}

/// Further cameras: behind the viewer looking back; from the far side of the scene towards the viewer; and from both sides of what
/// lies between.
fn cameras(scene: &Handles, view: &View, count: u32, extent: [u32; 2]) -> Vec<View> {
    let [right, up, forward] = view.axes();
    let bounds = scene.bounds();
    let eye = view.position;
    // How far the scene reaches from `from` along `direction`, nine tenths of it.
    let reach = |from: Vec3, direction: Vec3| {
        let exit = (0..3).filter(|&axis| direction[axis].abs() > 1e-6).map(|axis| {
            let side = if direction[axis] > 0.0 { bounds.max[axis] } else { bounds.min[axis] };
            (side - from[axis]) / direction[axis]
        });
        0.9 * exit.fold(f32::INFINITY, f32::min).clamp(0.0, 2.0 * bounds.half().length())
    };
    let middle = eye + forward * (0.5 * reach(eye, forward));
    let places = [
        (eye, -forward),
        (eye + forward * reach(eye, forward), -forward),
        (middle - right * reach(middle, -right), right),
        (middle + right * reach(middle, right), -right),
    ];
    let look = |(from, along): (Vec3, Vec3)| {
        let back = -along;
        let world = Mat4::from_cols(
            up.cross(back).normalize_or(right).extend(0.0),
            up.extend(0.0),
            back.extend(0.0),
            from.extend(1.0),
        );
        let projection = Projection::Perspective { yfov: YFOV, aspect: None, znear: view.near.max(1e-3), zfar: None };
        View::new(&Camera { name: String::new(), projection }, world, extent).fit_far(&bounds)
    };
    places.into_iter().take(count as usize).map(look).collect()
}
