//! Acceleration structures in a graph: importing, building and refitting them.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::{
    Graph,
    handles::{Accel, Buffer},
    pass::{Imported, Origin, Owner, Work},
    vocab::{Layout, Usage},
};
use crate::gpu::{AccelLayout, INSTANCE_BYTES, OwnedAccel};

/// Most scratch memory, in bytes, that the bottom levels of one pass take together, unless a single one takes more.
const SCRATCH_BYTES: u64 = 64 << 20;

/// One bottom level to build or refit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BottomBuild {
    /// Its number.
    pub bottom: u32,
    /// Three floats for each vertex.
    pub positions: Buffer,
    pub first_vertex: u32,
    /// 32 bits for each; 0 is `first_vertex`.
    pub indices: Buffer,
    pub first_index: u32,
    /// Keep the tree and move its boxes: cheaper, but the tree gets worse the further things moved since it was built. Only
    /// for one that [deforms](crate::gpu::BottomDesc::deforms) and was built.
    pub refit: bool,
}

/// An instance of a bottom level in the top level: 64 bytes, as Vulkan lays them out.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct TopInstance {
    /// Rows of `world_from_object`.
    world_from_object: [[f32; 4]; 3],
    /// Number in the low 24 bits, mask in the high 8.
    number_mask: u32,
    /// Flags in the high 8 bits.
    flags: u32,
    bottom: u64,
}

impl TopInstance {
    const CULL_DISABLE: u32 = 1 << 24;
    const OPAQUE: u32 = 4 << 24;
    const NO_OPAQUE: u32 = 8 << 24;

    /// Front faces are those whose vertices run counter-clockwise in the object's own, right-handed space, as everywhere in
    /// the engine: what Vulkan calls clockwise is meant in a left-handed one.
    ///
    /// Instance `number` (`gl_InstanceCustomIndex`, 24 bits) of the bottom level at `address`
    /// ([`OwnedAccel::address`]). Rays with a bit in common with `mask` see it.
    pub fn new(address: u64, world_from_object: &glam::Mat4, number: u32, mask: u8) -> Self {
        let rows = world_from_object.transpose();
        Self {
            world_from_object: [rows.x_axis.to_array(), rows.y_axis.to_array(), rows.z_axis.to_array()],
            number_mask: (number & 0x00ff_ffff) | u32::from(mask) << 24,
            flags: 0,
            bottom: address,
        }
    }

    /// Rays that leave out back faces see both of its.
    #[must_use]
    pub fn double_sided(self, yes: bool) -> Self {
        Self { flags: self.flags | if yes { Self::CULL_DISABLE } else { 0 }, ..self }
    }

    /// Its triangles stop rays as they are (or the shader decides about each).
    #[must_use]
    pub fn opaque(self, yes: bool) -> Self {
        Self { flags: self.flags | if yes { Self::OPAQUE } else { Self::NO_OPAQUE }, ..self }
    }
}

impl Graph {
    /// Acceleration structures that outlive the graph, which keeps them alive. If they were never built, passes must build
    /// all of them first. Importing them twice gives the same handle.
    pub fn import_accel(&mut self, accel: &OwnedAccel) -> Accel {
        let same = |o: &Origin| matches!(o, Origin::Imported(Imported { owner: Owner::Accel(a), .. }) if a.raw() == accel.raw());
        if let Some(index) = self.buffers.iter().position(|b| same(&b.origin)) {
            return Accel { graph: self.id, index: index as u32 };
        }
        let owner = Owner::Accel(accel.clone());
        self.add_accel(accel.name(), accel.layout(), accel.is_built(), owner)
    }

    /// Acceleration structures that someone else owns, known only by their layout: for planning without a device.
    pub fn import_accel_described(&mut self, name: &str, layout: &Arc<AccelLayout>, built: bool) -> Accel {
        self.add_accel(name, layout, built, Owner::Described)
    }

    fn add_accel(&mut self, name: &str, layout: &Arc<AccelLayout>, contents: bool, owner: Owner) -> Accel {
        let buffer = self.import_buffer_described(name, layout.bytes);
        let entry = &mut self.buffers[buffer.index as usize];
        entry.origin = Origin::Imported(Imported { rest: Layout::Buffer, contents, usage: Some(Usage::ACCEL), owner });
        entry.accel = Some(Arc::clone(layout));
        Accel { graph: self.id, index: buffer.index }
    }

    /// Builds or refits bottom levels, in as many passes as keep scratch memory in bounds.
    pub fn build_bottoms(&mut self, accel: Accel, builds: &[BottomBuild]) {
        let Some(layout) = self.accel_layout(accel) else { return };
        let mut batches: Vec<(u64, Vec<BottomBuild>)> = Vec::new();
        for build in builds {
            let bytes = bottom_scratch(&layout, build);
            match batches.last_mut() {
                Some((used, batch)) if *used + bytes <= SCRATCH_BYTES => {
                    *used += bytes;
                    batch.push(*build);
                }
                _ => batches.push((bytes, vec![*build])),
            }
        }
        let name = self.buffers[accel.index as usize].name.clone();
        for (bytes, builds) in batches {
            let scratch = self.buffer(format!("{name} scratch"), bytes + layout.scratch_alignment);
            let verb = if builds.iter().all(|b| b.refit) { "refit" } else { "build" };
            self.pass(format!("{verb} {name} bottoms"), Work::BuildBottoms { accel, builds, scratch });
        }
    }

    /// Builds the top level from these instances of bottom levels.
    pub fn build_top(&mut self, accel: Accel, instances: &[TopInstance]) {
        let Some(layout) = self.accel_layout(accel) else { return };
        let name = self.buffers[accel.index as usize].name.clone();
        let count = instances.len() as u32;
        let instances = if instances.is_empty() { &[TopInstance::zeroed()] } else { instances };
        let instances = self.buffer_from(format!("{name} instances"), instances);
        let scratch = self.buffer(format!("{name} scratch"), layout.top.build_scratch + layout.scratch_alignment);
        self.pass(format!("build {name} top"), Work::BuildTop { accel, instances, count, scratch });
    }

    pub(super) fn accel_layout(&self, accel: Accel) -> Option<Arc<AccelLayout>> {
        let entry = self.buffers.get(accel.index as usize).filter(|_| accel.graph == self.id)?;
        entry.accel.clone()
    }
}

/// Scratch bytes of one build, from one multiple of the alignment to another.
pub(super) fn bottom_scratch(layout: &AccelLayout, build: &BottomBuild) -> u64 {
    let level = layout.bottoms.get(build.bottom as usize).map(|b| &b.1);
    let bytes = level.map_or(0, |l| if build.refit { l.refit_scratch } else { l.build_scratch });
    bytes.max(1).next_multiple_of(layout.scratch_alignment.max(1))
}

const _: () = assert!(size_of::<TopInstance>() as u64 == INSTANCE_BYTES);
