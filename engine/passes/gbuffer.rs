//! The G-buffer: attributes of the nearest visible surface of every pixel, in one pass over the culled scene
//! (ISR dissertation, section 4.2: CLR, NRM, DPT), and further attributes of physical materials.

use crate::settings::{JsonSchema, described};
use crate::{
    graph::{
        Compare, Cull, Depth, Extent, Format, Graph, Image, ImageDesc, Load, Raster, Stencil, StencilLoad, Targets,
        Uniform,
    },
    resident::{Batches, Cutout, Handles},
    scene::{View, cull::Frustum},
    shaders::{
        passes::{gbuffer as shader, gbuffer_behind as behind_shader, gbuffer_eyes as eyes_shader},
        types,
    },
};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// How normals are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Normals {
    /// The dissertation's: 8 bits a component, decoded as 2c/255 − 1.
    Bytes,
    /// Octahedral, 16 bits a component.
    #[default]
    Octahedral,
}

/// Treatment of alpha-blended surfaces. A G-buffer holds one surface per pixel, so it cannot hold them together with the surface behind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Blended {
    /// Each pixel shows the surface with probability alpha. Only the graph's seed changes the pattern.
    #[default]
    Dithered,
    /// The surface is shown where alpha is at least one half.
    Threshold,
    /// Not drawn.
    Hidden,
}

/// Settings of the G-buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Settings {
    /// How normals are stored.
    pub normals: Normals,
    /// Treatment of alpha-blended surfaces. A G-buffer holds one surface per pixel, so it cannot hold them together with the surface behind.
    pub blended: Blended,
    /// Textures are read at the mip level that fits the pixel's size. Off: always at the finest level, like a path tracer without ray
    /// differentials reads them. This makes pictures comparable with such a path tracer.
    pub mips: bool,
    /// Frustum culling, which does not change the picture.
    pub culling: bool,
}

described!(Settings);

impl Default for Settings {
    fn default() -> Self {
        Self { normals: Normals::default(), blended: Blended::default(), mips: true, culling: true }
    }
}

/// Full-resolution images; encodings in `lib/gbuffer.glsl`.
#[derive(Clone, Copy, Debug)]
pub struct GBuffer {
    /// sRGB8: (1 − metallic) · base colour (linear when sampled); alpha: radiation mask, 1 ordinary, 0 unlit, or what `isr.mask` gives to a material.
    pub albedo: Image,
    /// World normal; read it with `decode_normal`.
    pub normal: Image,
    /// R32F: eye distance / far; background exactly 1.
    pub depth: Image,
    /// RGBA8: reflectance at normal incidence; alpha: roughness.
    pub specular: Image,
    /// RGBA16F: emitted radiance, W/(sr·m²); alpha: accessibility from the occlusion texture.
    pub emission: Image,
    /// Depth with stencil: 1 geometry, 0 background. Reversed depth.
    pub hardware: Image,
    /// The view for which the G-buffer was drawn.
    pub view: Uniform<types::View>,
    /// The settings with which it was drawn.
    pub settings: Settings,
}

/// Draws the scene as `view` sees it.
pub fn draw(graph: &mut Graph, scene: &Handles, view: &View, settings: &Settings) -> GBuffer {
    one(graph, scene, view, &batches(scene, &[view], settings), settings, Of::View)
}

/// The next layer of a depth peeling: the nearest surface behind the linear depths `nearer` (R32F, same extent). Back faces of single-sided
/// surfaces are drawn, with the normal of their front.
pub fn draw_behind(graph: &mut Graph, scene: &Handles, view: &View, settings: &Settings, nearer: Image) -> GBuffer {
    one(graph, scene, view, &batches(scene, &[view], settings), settings, Of::Behind(nearer))
}

/// Draws the scene as two eyes see it, both views of the same extent. `multiview`: in one pass over the scene, only with
/// [`Caps::multiview`](crate::gpu::Caps::multiview); otherwise in two, with the same pixels.
pub fn draw_eyes(
    graph: &mut Graph,
    scene: &Handles,
    views: [&View; 2],
    settings: &Settings,
    multiview: bool,
) -> [GBuffer; 2] {
    let batches = batches(scene, &views, settings);
    if !multiview {
        return views.map(|view| one(graph, scene, view, &batches, settings, Of::View));
    }
    let both = empty(graph, scene, views[0], 2, settings);
    let eyes = graph.uniform(&types::Eyes { views: views.map(View::uniform) });
    surfaces(graph, scene, &both, &batches, settings, Of::Eyes(eyes));
    let of_eye = |eye: u32, view| GBuffer {
        albedo: both.albedo.layer(eye),
        normal: both.normal.layer(eye),
        depth: both.depth.layer(eye),
        specular: both.specular.layer(eye),
        emission: both.emission.layer(eye),
        hardware: both.hardware.layer(eye),
        view,
        settings: *settings,
    };
    let right = graph.uniform(&views[1].uniform());
    [of_eye(0, both.view), of_eye(1, right)]
}

/// The surfaces that a pass over the scene draws.
#[derive(Clone, Copy, Debug)]
enum Of {
    /// The nearest ones of one view.
    View,
    /// The nearest ones of one view behind these linear depths.
    Behind(Image),
    /// The nearest ones of two views, each into a layer of its own.
    Eyes(Uniform<types::Eyes>),
}

/// The surfaces of one view.
fn one(graph: &mut Graph, scene: &Handles, view: &View, batches: &Batches, settings: &Settings, of: Of) -> GBuffer {
    let gbuffer = empty(graph, scene, view, 1, settings);
    surfaces(graph, scene, &gbuffer, batches, settings, of);
    gbuffer
}

/// Images of so many layers, without contents.
fn empty(graph: &mut Graph, scene: &Handles, view: &View, layers: u32, settings: &Settings) -> GBuffer {
    let normal_format = match settings.normals {
        Normals::Bytes => Format::RGBA8,
        Normals::Octahedral => Format::RG16,
    };
    let mut image = |name: &str, format: Format| {
        graph.image_with(name, ImageDesc::new(format, Extent::from(view.extent)).layers(layers))
    };
    GBuffer {
        albedo: image("gbuffer.albedo", Format::RGBA8Srgb),
        normal: image("gbuffer.normal", normal_format),
        depth: image("gbuffer.depth", Format::R32F),
        specular: image("gbuffer.specular", Format::RGBA8),
        emission: image("gbuffer.emission", Format::RGBA16F),
        hardware: image("gbuffer.hardware", scene.depth_stencil),
        view: graph.uniform(&view.uniform()),
        settings: *settings,
    }
}

/// The draws for some views, near the middle of their cameras first.
fn batches(scene: &Handles, views: &[&View], settings: &Settings) -> Batches {
    let frusta: Vec<Frustum> = views.iter().filter(|_| settings.culling).map(|view| Frustum::new(view)).collect();
    let middle = views.iter().map(|view| view.position).sum::<Vec3>() / views.len() as f32;
    Batches::of_views(&scene.moment, &frusta, middle)
}

fn surfaces(graph: &mut Graph, scene: &Handles, gbuffer: &GBuffer, batches: &Batches, settings: &Settings, of: Of) {
    let visible = batches.visible_buffer(graph, "gbuffer.visible");
    let drawn = batches.list.iter().filter(|b| b.cutout != Cutout::Blend || settings.blended != Blended::Hidden);
    let drawn: Vec<_> = drawn.collect();
    graph.scope("gbuffer", |graph| {
        // Without draws an empty pass still clears the images.
        for index in 0..drawn.len().max(1) {
            let batch = drawn.get(index);
            let cutout = match batch.map(|b| b.cutout) {
                None | Some(Cutout::Opaque) => 0,
                Some(Cutout::Mask) => 1,
                Some(Cutout::Blend) if settings.blended == Blended::Dithered => 2,
                Some(Cutout::Blend) => 3,
            };
            let octahedral = u32::from(settings.normals == Normals::Octahedral);
            let sharp = u32::from(!settings.mips);
            let sided = batch.map_or_else(Default::default, |b| b.sided.cull());
            let seed = graph.seed;
            let draw =
                batch.map_or_else(|| crate::graph::Draw::indexed(scene.indices, Vec::new()), |batch| batch.draw(scene));
            let targets = targets(gbuffer, index == 0);
            // Of coplanar surfaces the first one drawn is visible. Rays choose the same surface (lib/trace_compute.glsl).
            let state = Raster::new().depth_compare(Compare::Greater).stencil(Stencil::write(1));
            // The generated types have the same fields.
            macro_rules! args {
                ($shader:ident, $view:ident: $value:expr $(, $more:ident)?) => {
                    $shader::Args {
                        $view: $value,
                        instances: scene.instances,
                        visible,
                        positions: scene.positions,
                        normals: scene.normals,
                        tangents: scene.tangents,
                        uvs: scene.uvs,
                        colors: scene.colors,
                        $($more,)?
                        materials: scene.materials,
                        scene_textures: scene.textures,
                        push: $shader::Push { seed },
                        spec: $shader::Spec { cutout, octahedral, sharp },
                    }
                };
            }
            let state = if matches!(of, Of::Behind(_)) { state.cull(Cull::None) } else { state.cull(sided) };
            let pass = match of {
                Of::View => graph.raster(targets, state, args!(shader, view: gbuffer.view), draw),
                Of::Behind(nearer) => {
                    graph.raster(targets, state, args!(behind_shader, view: gbuffer.view, nearer), draw)
                }
                Of::Eyes(eyes) => graph.raster(targets.views(), state, args!(eyes_shader, eyes: eyes), draw),
            };
            if let Some(batch) = batch {
                pass.named(format!("passes.gbuffer.{:?}.{:?}", batch.cutout, batch.sided).to_lowercase());
            }
        }
    });
}

fn targets(gbuffer: &GBuffer, first: bool) -> Targets {
    let load = |value| if first { Load::Clear(value) } else { Load::Keep };
    let targets = Targets::new()
        .color(gbuffer.albedo, load([0.0; 4]))
        .color(gbuffer.normal, load([0.5, 0.5, 0.5, 0.0]))
        .color(gbuffer.depth, load([1.0; 4]))
        .color(gbuffer.specular, load([0.0, 0.0, 0.0, 1.0]))
        .color(gbuffer.emission, load([0.0, 0.0, 0.0, 1.0]));
    if first {
        targets.depth(gbuffer.hardware, Depth::Clear(0.0)).stencil(StencilLoad::Clear(0))
    } else {
        targets.depth(gbuffer.hardware, Depth::Keep).stencil(StencilLoad::Keep)
    }
}
