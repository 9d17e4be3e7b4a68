//! The environment on the device: its texels, the irradiance for every normal, and its total vector.

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
    /// Irradiance for the normal of each texel, W/m² ([FIV 6]): a cube map for `cube_lookup` of fiv/fiv.glsl.
    pub difmap: OwnedImage,
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
        let gpu = &runner.gpu().clone();
        let texels = sky.texels();
        let buffer = OwnedBuffer::with_contents(gpu, "fiv.sky", bytemuck::cast_slice(&texels))?;
        let desc = ImageDesc::new(DIFMAP, sky.size, sky.size).cubes(1).also(vk::ImageUsageFlags::STORAGE);
        let difmap = OwnedImage::new(gpu, "fiv.difmap", desc)?;
        let mut graph = Graph::new("fiv environment");
        let (handle, image) = (graph.import_buffer(&buffer), graph.import_image(&difmap));
        let count = texels.len() as u32;
        graph.clear(image, [0.0; 4]);
        for first in (0..count).step_by(MOST_TEXELS as usize) {
            let push = fiv::difmap::Push { first, count: MOST_TEXELS.min(count - first) };
            graph.compute(fiv::difmap::Args { texels: handle, difmap: image, push }, [sky.size, sky.size, 6]);
        }
        let fivs = graph.buffer("fiv.total", 4 * u64::from(FIV_FLOATS));
        graph.compute(fiv::total::Args { texels: handle, fivs, push: fiv::total::Push { count } }, 1);
        let token = graph.read_buffer(fivs);
        let sums: Vec<f32> = runner.run(graph)?.buffer(token);
        let mut total = [0.0; FIV_FLOATS as usize];
        total.iter_mut().zip(sums).for_each(|(to, from)| *to = from);
        Ok(Self {
            size: sky.size,
            texels: buffer,
            difmap,
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

/// A note if the device cannot filter the irradiance map. Vulkan does not guarantee filtering for this format.
pub(super) fn unfiltered(gpu: &Gpu) -> Option<Note> {
    let filters = gpu.format_features(DIFMAP).contains(vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR);
    let text =
        "the device does not filter 32-bit images: each pixel takes the irradiance of the nearest of 6 · size² normals"
            .into();
    (!filters).then(|| Note { kind: NoteKind::Approximated, place: "fiv.size".into(), text })
}
