//! The environment on the device: its texels, the irradiance for every normal, and its total vector.

use std::sync::Arc;

use ash::vk;

use super::{
    sky::Sky,
    spots::{self, Spot},
    suns,
};
use crate::{
    Result,
    gpu::{Gpu, ImageDesc, OwnedBuffer, OwnedImage},
    graph::{Buffer, Graph, Runner},
    scene::{Note, NoteKind},
    shaders::{consts::FIV_FLOATS, fiv, types},
};

/// Most texels that one invocation sums up.
const MOST_TEXELS: u32 = 24_576;

/// Format of the irradiance map.
const DIFMAP: vk::Format = vk::Format::R32G32B32A32_SFLOAT;

/// An environment on a device.
#[derive(Debug)]
pub struct Light {
    /// Texels along an edge.
    pub size: u32,
    /// `types::FivTexel`
    pub texels: OwnedBuffer,
    /// Irradiance for the normal of each texel, W/m² ([FIV 6]): a cube map for `cube_lookup` of fiv/fiv.glsl. It is that of the environment before
    /// `map_turn` and `map_factor`.
    pub difmap: Arc<OwnedImage>,
    /// Rotation of the environment about +Y since `difmap`, radians.
    pub map_turn: f32,
    /// Factor on the radiance of the environment since `difmap`.
    pub map_factor: f32,
    /// The fullsphere irradiance vector of the whole environment ([FIV 10]): x.rgb, y.rgb, z.rgb, W/m².
    pub total: [f32; FIV_FLOATS as usize],
    /// Numbers of the texels that are not black, without separated texels.
    pub lit: Vec<u32>,
    /// Separated texels. The fields above do not contain their light.
    pub suns: Vec<types::FivSun>,
    /// Bright parts of the environment.
    pub spots: Vec<Spot>,
    /// Hash of the cube map.
    pub hash: u64,
}

impl Light {
    /// Uploads the environment and computes its irradiance map and its total vector.
    ///
    /// # Errors
    /// `OutOfMemory`, `DeviceLost`.
    pub fn new(gpu: &Gpu, sky: &Sky) -> Result<Self> {
        Self::with(&mut Runner::new(gpu), sky)
    }

    /// As [`Self::new`], with an existing runner.
    pub(super) fn with(runner: &mut Runner, sky: &Sky) -> Result<Self> {
        let map = irradiance_map(runner, sky)?;
        Self::turned(runner, sky, &map, (0.0, 1.0))
    }

    /// As [`Self::with`], with the irradiance map of the environment before a rotation about +Y (radians) and a factor on its radiance. A normal
    /// that is rotated back finds its irradiance there, so that an environment which rotates needs no new map.
    pub(super) fn turned(
        runner: &mut Runner,
        sky: &Sky,
        map: &Arc<OwnedImage>,
        (map_turn, map_factor): (f32, f32),
    ) -> Result<Self> {
        let texels = sky.texels();
        let buffer = OwnedBuffer::with_contents(runner.gpu(), "fiv.sky", bytemuck::cast_slice(&texels))?;
        let mut graph = Graph::new("fiv environment");
        let handle = graph.import_buffer(&buffer);
        let fivs = graph.buffer("fiv.total", 4 * u64::from(FIV_FLOATS));
        let push = fiv::total::Push { count: texels.len() as u32 };
        graph.compute(fiv::total::Args { texels: handle, fivs, push }, 1);
        let token = graph.read_buffer(fivs);
        let sums: Vec<f32> = runner.run(graph)?.buffer(token);
        let mut total = [0.0; FIV_FLOATS as usize];
        total.iter_mut().zip(sums).for_each(|(to, from)| *to = from);
        Ok(Self {
            size: sky.size,
            texels: buffer,
            difmap: map.clone(),
            map_turn,
            map_factor,
            total,
            lit: sky.lit(),
            suns: suns::of(sky),
            spots: spots::spots(sky),
            hash: sky.hash(),
        })
    }

    /// The texels, and the numbers of the texels that are not black.
    pub(super) fn import(&self, graph: &mut Graph) -> (Buffer, Buffer) {
        let lit = if self.lit.is_empty() { &[0][..] } else { &self.lit };
        (graph.import_buffer(&self.texels), graph.buffer_from("fiv.lit", lit))
    }
}

/// Irradiance of the environment for the normal of each texel of a cube ([FIV 6]).
///
/// # Errors
/// `OutOfMemory`, `DeviceLost`.
pub(super) fn irradiance_map(runner: &mut Runner, sky: &Sky) -> Result<Arc<OwnedImage>> {
    let gpu = &runner.gpu().clone();
    let texels = sky.texels();
    let desc = ImageDesc::new(DIFMAP, sky.size, sky.size).cubes(1).also(vk::ImageUsageFlags::STORAGE);
    let difmap = OwnedImage::new(gpu, "fiv.difmap", desc)?;
    let mut graph = Graph::new("fiv irradiance");
    let (handle, image) = (graph.buffer_from("fiv.sky", &texels), graph.import_image(&difmap));
    let count = texels.len() as u32;
    graph.clear(image, [0.0; 4]);
    for first in (0..count).step_by(MOST_TEXELS as usize) {
        let push = fiv::difmap::Push { first, count: MOST_TEXELS.min(count - first) };
        graph.compute(fiv::difmap::Args { texels: handle, difmap: image, push }, [sky.size, sky.size, 6]);
    }
    runner.run(graph)?;
    Ok(Arc::new(difmap))
}

/// A note if the device cannot filter the irradiance map. Vulkan does not guarantee filtering for this format.
pub(super) fn unfiltered(gpu: &Gpu) -> Option<Note> {
    let filters = gpu.format_features(DIFMAP).contains(vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR);
    let text =
        "the device does not filter 32-bit images: each pixel takes the irradiance of the nearest of 6 · size² normals"
            .into();
    (!filters).then(|| Note { kind: NoteKind::Approximated, place: "fiv.size".into(), text })
}
