//! Image-space radiosity (the ISR dissertation, chapters 3 to 5): one bounce of diffuse light and ambient occlusion from what
//! the G-buffer of a frame holds, without precomputed light.
//!
//! [`frame`] declares every pass after G-buffer and shadow maps; [`picture`] declares those too. What it computes: the light
//! that visible surfaces reflect onto visible surfaces. Surfaces outside the image, behind others or turned away send nothing:
//! in the Cornell box about half of all one-bounce light comes from what the camera sees, and `tests/isr_reference.rs`
//! measures how much of that half arrives. Whether something stands between sender and receiver is guessed from the depth
//! buffer ([`Settings::visibility_steps`]), or not asked, as in the dissertation.
//!
//! Where this differs from the dissertation by default, and why:
//! - [`Estimator::Area`] sums form factors to the whole cells that samples stand for, which converges to the irradiance;
//!   the dissertation's sum does not ([`Estimator`] has the factor). So `k_isr` is 1 and not 0.5.
//! - The sender is direct light as the surface reflects it, averaged from full resolution, and not the albedo
//!   ([`Sender`]). It has no highlights.
//! - Samples lie on rings that are denser near the pixel, moved from texel to texel, and averaged by a bilateral blur.
//! - The receiver's albedo tints what it gathers; the dissertation adds it as it is ([`Receiver`]).
//! - Light of the sky and of glowing surfaces comes by rays ([`AreaLights`]): walls and lamps outside of the image decide about it. The dissertation has point lights
//!   alone, and no ray. Without rays the sky lights every surface, and occlusion darkens only its light ([`Occlude`]).
//! - Where rays meet surfaces that the image does not show, they send a share of the light of those that it shows ([`Settings::unseen`]), and further
//!   scatterings are estimated as in a closed room. In the dissertation these surfaces are dark.
//! - Further bounces ([`Settings::bounces`]) gather again in the same frame; nothing is kept from frame to frame.
//!
//! The dissertation's future work is there too, switched off by default: surfaces beyond the border of the picture, behind others, or
//! turned away ([`senders`]), full resolution, and numbers of samples that follow the depth ([`Settings::samples_by_depth`]).

mod area;
mod mask;
mod picture;
pub mod senders;
mod settings;
mod technique;
mod unseen;

pub use area::{Area, AreaFrame, Surroundings};
pub use picture::{Picture, PictureSettings, picture};
pub use settings::{
    AreaLights, Blur, Downsample, Estimator, LightLaw, Occlude, Patch, Pattern, Preset, Receiver, Resolution, Sender,
    Settings, Upsample,
};
pub use technique::{Isr, Mode};

use crate::{
    Result,
    graph::{Format, Graph, Image, ImageDesc},
    passes::{
        ambient::Irradiance,
        bilateral, blur,
        compose::{self, Compose},
        direct::{self, Direct},
        downsample,
        gbuffer::GBuffer,
    },
    shaders,
};

/// Images of a frame, at full resolution unless stated. Radiance in W/(sr·m²).
#[derive(Clone, Copy, Debug)]
pub struct Outputs {
    /// Sum of all light [ISR 29]; alpha 1 on geometry, 0 on background, where rgb is 0 until a sky is drawn.
    pub total: Image,
    /// Direct light with emission.
    pub direct: Image,
    /// Gathered light and light of the environment and of glowing surfaces, as they enter the sum.
    pub indirect: Image,
    /// R32F: 1 open, 0 occluded.
    pub occlusion: Image,
    /// The coarse result before the blur: rgb radiance of a white receiver, a accumulated occlusion.
    pub gathered: Image,
    /// And after it.
    pub blurred: Image,
}

/// Everything a frame starts from.
#[derive(Clone, Debug)]
pub struct Inputs {
    pub gbuffer: GBuffer,
    pub lights: direct::Lights,
    /// Light of the environment and of glowing surfaces; default none.
    pub surroundings: Surroundings,
    /// Surfaces beside those of the frame that send light ([`senders::draw`]).
    pub senders: Option<senders::Senders>,
}

/// Declares direct light, downsampling, gathering, blur, upsampling and sum.
///
/// # Errors
/// `Usage` if a setting is out of its range ([`Settings::validate`]).
pub fn frame(graph: &mut Graph, inputs: &Inputs, settings: &Settings) -> Result<Outputs> {
    settings.validate()?;
    let g = inputs.gbuffer;
    let view = g.view;
    let extent = graph.extent(g.depth);
    let factor = settings.resolution.factor();

    let area = inputs.surroundings.area.filter(|_| settings.area_lights == AreaLights::Rays);
    let area = area.filter(|area| area.has_lights() || settings.fills());
    let direct = Direct { glow: area.is_none(), ..settings.direct() };
    let lit = direct::light(graph, &g, inputs.lights, &direct);

    let aware = settings.downsample == Downsample::DepthAware;
    let coarse = downsample::gbuffer(graph, &g, factor, aware);
    let sender = match settings.sender {
        Sender::Albedo => coarse.albedo,
        Sender::Lit => downsample::color(graph, lit.diffuse, &g, factor, aware),
    };

    let none = Irradiance::default();
    let ambient = if settings.environment { &inputs.surroundings.ambient } else { &none }.upload(graph);
    let filter = |graph: &mut Graph, gathered: Image| match settings.blur {
        Blur::None => gathered,
        _ if settings.blur_radius == 0 => gathered,
        Blur::Gaussian => blur::gaussian(graph, gathered, settings.blur_radius),
        Blur::Bilateral => {
            bilateral::blur(graph, gathered, &coarse, view, factor, settings.blur_radius, settings.blur_range)
        }
    };
    let by_rays = area.map(|area| {
        let found = area.light(graph, &g, &coarse, ambient, settings);
        found.map(|image| filter(graph, image))
    });
    let sender = match by_rays.filter(|_| settings.sender == Sender::Lit && settings.indirect) {
        Some(light) => AreaFrame::sent(graph, sender, &coarse, light, ambient),
        None => sender,
    };

    let mean_depth = if settings.samples_by_depth {
        let desc = ImageDesc::new(Format::RGBA16F, graph.extent(coarse.depth)).all_mips();
        let moments = graph.image_with("isr.mean-depth", desc);
        graph.compute(
            shaders::isr::mean_depth::Args { depth: coarse.depth, moments: moments.mip(0) },
            graph.extent(moments),
        );
        graph.mips(moments);
        moments
    } else {
        coarse.depth
    };
    let behind = inputs.senders.map(|s| s.behind).unwrap_or_default();
    let gather = |graph: &mut Graph, sender: Image| {
        let [gathered, seen] =
            ["isr.gathered", "isr.seen"].map(|name| graph.image(name, Format::RGBA16F, graph.extent(coarse.depth)));
        let longer = extent.width.max(extent.height) as f32;
        let reach = if settings.reach > 0.0 { settings.reach } else { 0.75 * longer };
        let filtered = if settings.prefilter {
            let desc = ImageDesc::new(Format::RGBA16F, graph.extent(coarse.depth)).all_mips();
            let filtered = graph.image_with("isr.filtered", desc);
            let args = shaders::isr::premultiply::Args { sender, premultiplied: filtered.mip(0) };
            graph.compute(args, graph.extent(filtered));
            graph.mips(filtered);
            filtered.trilinear()
        } else {
            sender
        };
        let push = shaders::isr::gather::Push {
            reach: reach / factor as f32,
            occlusion_reach: settings.occlusion_reach / factor as f32,
            occluder_radius: settings.occluder_radius,
            occlusion_bias: settings.occlusion_bias,
            spread: settings.spread,
            thickness: settings.thickness,
            factor: factor as f32,
            peeled_scale: 1.0 + settings.border,
        };
        let spec = shaders::isr::gather::Spec {
            samples: settings.samples,
            area_estimator: (settings.estimator == Estimator::Area).into(),
            rings: (settings.pattern == Pattern::Rings).into(),
            jitter: settings.jitter.into(),
            indirect: settings.indirect.into(),
            occlusion: settings.occlusion.into(),
            visibility_steps: settings.visibility_steps,
            paper_cells: (settings.patch == Patch::Cell).into(),
            prefilter: settings.prefilter.into(),
            by_depth: settings.samples_by_depth.into(),
            peeled: behind.iter().flatten().count() as u32,
        };
        let args = shaders::isr::gather::Args {
            view,
            sender,
            albedo: coarse.albedo,
            normal: coarse.normal,
            depth: coarse.depth,
            gathered,
            seen,
            filtered,
            mean_depth,
            peeled: behind.map(|layer| layer.unwrap_or(coarse.depth)),
            push,
            spec,
        };
        graph.compute(args, graph.extent(gathered));
        (gathered, seen)
    };

    let first = inputs.senders.filter(|_| settings.indirect);
    let mut senders = first;
    let masked = !settings.mask.trim().is_empty();
    let unseen = by_rays.filter(|_| settings.fills());
    let unseen = unseen.map(|light| unseen::Unseen::new(graph, sender, &coarse, light, masked));
    // Filtered, with the light of surfaces that the picture does not show.
    let filled = |graph: &mut Graph, gathered: Image, seen: Image, scatterings: u32| {
        let gathered = filter(graph, gathered);
        match unseen {
            Some(unseen) => {
                let seen = filter(graph, seen);
                unseen.filled(graph, gathered, seen, settings.unseen, scatterings)
            }
            None => gathered,
        }
    };
    let (mut gathered, mut seen) = gather(graph, sender);
    if let Some(senders) = senders {
        gathered = senders.gather(graph, &g, &coarse, gathered, settings);
    }
    let scatterings = |bounce: u32| if bounce == settings.bounces { bounce } else { 0 };
    let mut blurred = filled(graph, gathered, seen, scatterings(1));
    for bounce in 2..=settings.bounces {
        let next = graph.image("isr.sender", Format::RGBA16F, graph.extent(coarse.depth));
        let args = shaders::isr::bounce::Args {
            sender,
            albedo: coarse.albedo,
            gathered: blurred,
            next,
            spec: shaders::isr::bounce::Spec::default(),
        };
        graph.compute(args, graph.extent(next));
        (gathered, seen) = gather(graph, next);
        senders = senders.zip(first).map(|(senders, first)| senders.bounce(graph, &first, settings));
        if let Some(senders) = senders {
            gathered = senders.gather(graph, &g, &coarse, gathered, settings);
        }
        blurred = filled(graph, gathered, seen, scatterings(bounce));
    }

    let choices = Compose {
        factor,
        plane: settings.upsample == Upsample::Plane,
        epsilon: settings.upsample_epsilon,
        tint: settings.receiver == Receiver::Albedo,
        occlude_ambient: settings.occlude == Occlude::Ambient,
        k_ssao: settings.k_ssao,
        k_isr: settings.k_isr,
        area: by_rays.map(|light| [light.sky, light.lamps]),
    };
    let composed = compose::sum(graph, &g, ambient, lit.direct, blurred, &coarse, &choices);
    Ok(Outputs {
        total: composed.total,
        direct: lit.direct,
        indirect: composed.indirect,
        occlusion: composed.accessibility,
        gathered,
        blurred,
    })
}
