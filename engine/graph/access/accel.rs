//! What builds of acceleration structures do, and what shaders do with them.

use super::Collector;
use crate::{
    gpu::INSTANCE_BYTES,
    graph::{
        accel::BottomBuild,
        handles::{Accel, Buffer},
        vocab::{Access, Layout, MistakeKind, Region, Resource, Scope, Stages, Usage, Use},
    },
};

impl Collector<'_> {
    /// Bytes `region` (all of them: `None`) of the buffer in which the structures lie.
    fn levels(&mut self, accel: Accel, region: Option<(u64, u64)>, scope: Scope, role: &str) {
        let bytes = self.graph.buffers[accel.index as usize].bytes;
        let (from, to) = region.unwrap_or((0, bytes));
        self.uses.push(Use {
            resource: Resource::Buffer(accel.index),
            region: Region::buffer(from..to.max(from + 1)),
            scope,
            layout: Layout::Buffer,
            usage: Usage::ACCEL,
            role: role.to_owned(),
        });
    }

    /// A shader traces rays through all levels.
    pub(super) fn traced(&mut self, accel: Accel, stages: Stages, role: &str) {
        if accel.is_none() {
            return self.mistake(MistakeKind::Shape, role, "a shader that traces by ray query has nothing to trace");
        }
        if self.own(accel.graph, "acceleration structure") {
            self.levels(accel, None, Scope { stages, access: Access::ACCEL_READ }, role);
        }
    }

    pub(super) fn build_bottoms(&mut self, accel: Accel, builds: &[BottomBuild], scratch: Buffer) {
        if !self.own(accel.graph, "acceleration structure") {
            return;
        }
        let Some(layout) = self.graph.accel_layout(accel) else { return };
        let name = self.graph.buffers[accel.index as usize].name.clone();
        let mut inputs: Vec<(Buffer, &str)> = Vec::new();
        // Parts that follow one another are one use.
        let mut parts: Vec<(u64, u64, Access)> = Vec::new();
        for build in builds {
            let Some((desc, level)) = layout.bottoms.get(build.bottom as usize) else {
                let what = format!("there is no bottom level {}, only {}", build.bottom, layout.bottoms.len());
                self.mistake(MistakeKind::Range, name.clone(), what);
                continue;
            };
            if build.refit && !desc.deforms {
                let what = format!("bottom level {} is refitted, but was not made to deform", build.bottom);
                self.mistake(MistakeKind::ReadOnly, name.clone(), what);
            }
            let vertices = (u64::from(build.first_vertex) + u64::from(desc.vertices)) * 12;
            let indices = (u64::from(build.first_index) + 3 * u64::from(desc.triangles)) * 4;
            for (buffer, end, role) in [(build.positions, vertices, "positions"), (build.indices, indices, "indices")] {
                if end > buffer.size {
                    let what = format!("`{role}` are read up to byte {end}, but it has {}", buffer.size);
                    self.mistake(MistakeKind::Range, self.buffer_name(buffer), what);
                }
                if !inputs.contains(&(buffer, role)) {
                    inputs.push((buffer, role));
                }
            }
            let access = Access::ACCEL_WRITE | if build.refit { Access::ACCEL_READ } else { Access::NONE };
            parts.push((level.range.start, level.range.end, access));
        }
        parts.sort_unstable_by_key(|p| p.0);
        let mut joined: Vec<(u64, u64, Access)> = Vec::new();
        for part in parts {
            match joined.last_mut() {
                Some(last) if last.1 == part.0 && last.2 == part.2 => last.1 = part.1,
                _ => joined.push(part),
            }
        }
        for (from, to, access) in joined {
            self.levels(accel, Some((from, to)), Scope { stages: Stages::ACCEL, access }, "bottom levels");
        }
        for (buffer, role) in inputs {
            self.buffer(buffer, Stages::ACCEL, Access::BUILD_INPUT, Usage::STORAGE, role);
        }
        self.buffer(scratch, Stages::ACCEL, Access::ACCEL_WRITE, Usage::STORAGE, "scratch");
    }

    pub(super) fn build_top(&mut self, accel: Accel, instances: Buffer, count: u32, scratch: Buffer) {
        if !self.own(accel.graph, "acceleration structure") {
            return;
        }
        let Some(layout) = self.graph.accel_layout(accel) else { return };
        if count > layout.instances || u64::from(count) * INSTANCE_BYTES > instances.size {
            let what = format!("{count} instances; it was made for {}", layout.instances);
            self.mistake(MistakeKind::Range, self.graph.buffers[accel.index as usize].name.clone(), what);
        }
        let top = (layout.top.range.start, layout.top.range.end);
        let scope = |access| Scope { stages: Stages::ACCEL, access };
        if top.0 > 0 {
            self.levels(accel, Some((0, top.0)), scope(Access::ACCEL_READ), "bottom levels");
        }
        self.levels(accel, Some(top), scope(Access::ACCEL_WRITE), "top level");
        self.buffer(instances, Stages::ACCEL, Access::BUILD_INPUT, Usage::STORAGE, "instances");
        self.buffer(scratch, Stages::ACCEL, Access::ACCEL_WRITE, Usage::STORAGE, "scratch");
    }
}
