//! Declaring resources and passes.

use std::{
    collections::{HashMap, HashSet},
    sync::atomic::{AtomicU32, Ordering},
};

use bytemuck::{NoUninit, Pod};

use super::{
    Graph,
    args::{Args, ComputeArgs, RangedArgs, RasterArgs},
    format::{Extent, Format, ImageDesc, Threads},
    handles::{Buffer, BufferRead, GraphId, Image, ImageRead, Sampler, Uniform, UniformSlice},
    over::{Items, Over},
    pass::{Bound, BufferEntry, Groups, ImageEntry, Imported, Origin, Owner, Pass, ReadEntry, ReadWhat, Work},
    raster::{Draw, Raster, Targets},
    vocab::{Layout, Resource},
};

/// Uniform blocks start at multiples of this: the largest alignment a Vulkan device may ask for.
const UNIFORM_ALIGNMENT: usize = 256;

/// A pass just declared.
#[derive(Debug)]
pub struct PassRef<'g> {
    graph: &'g mut Graph,
    index: usize,
}

impl PassRef<'_> {
    /// Names it, instead of by its shader. A name used before gets `#2`, `#3`…
    pub fn named(self, name: impl Into<String>) -> Self {
        let pass = &mut self.graph.passes[self.index];
        self.graph.pass_names.free(&pass.name);
        pass.name = self.graph.pass_names.take(name.into());
        self
    }

    /// Counts how often its shaders start ([`PassTime::started`](super::PassTime::started)), where the device can
    /// ([`crate::gpu::Caps::pipeline_statistics`]).
    pub fn counted(self) -> Self {
        self.graph.passes[self.index].counted = true;
        self
    }

    /// Says that it traces about `rays` rays, or works as long as that takes. Long graphs are handed to the device in parts by it, so
    /// that no watchdog takes the whole for a device that hangs.
    pub fn rays(self, rays: u64) -> Self {
        self.graph.passes[self.index].rays = rays;
        self
    }

    /// Says that its compute shader reads and writes a buffer by its address ([`crate::gpu::OwnedBuffer::address_words`]), not through a binding. Such a
    /// buffer may be larger than bindings may be.
    pub fn writing(self, buffer: Buffer) -> Self {
        self.graph.passes[self.index].addressed.push((buffer, true));
        self
    }

    /// Says that its compute shader reads a buffer by its address, not through a binding.
    pub fn reading(self, buffer: Buffer) -> Self {
        self.graph.passes[self.index].addressed.push((buffer, false));
        self
    }

    /// Notes its loop.
    fn over(self, items: Items, range: [usize; 2]) -> Self {
        let pass = &mut self.graph.passes[self.index];
        pass.rays = items.all_rays();
        if let Work::Compute { over, .. } = &mut pass.work {
            *over = Some(Over { items, range });
        }
        self
    }

    /// The name it has in reports and messages.
    pub fn name(&self) -> &str {
        &self.graph.passes[self.index].name
    }
}

/// Names that are taken. A graph may have thousands of passes of one shader.
#[derive(Clone, Debug, Default)]
pub(super) struct Names {
    taken: HashSet<String>,
    /// By name: all numbers from 2 up to below this one are taken.
    next: HashMap<String, u32>,
}

impl Names {
    /// `name`, or the first of `name#2`, `name#3`… that is free.
    fn take(&mut self, name: String) -> String {
        if self.taken.insert(name.clone()) {
            return name;
        }
        let next = self.next.entry(name.clone()).or_insert(2);
        loop {
            let candidate = format!("{name}#{next}");
            *next = next.saturating_add(1);
            if self.taken.insert(candidate.clone()) || *next == u32::MAX {
                return candidate;
            }
        }
    }

    /// Lets a name be taken again.
    fn free(&mut self, name: &str) {
        self.taken.remove(name);
        let Some((base, number)) = name.rsplit_once('#') else { return };
        if let (Some(next), Ok(number)) = (self.next.get_mut(base), number.parse::<u32>())
            && number >= 2
        {
            *next = number.min(*next);
        }
    }
}

impl Graph {
    /// No passes yet. The name is for messages.
    pub fn new(name: &'static str) -> Self {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        Self {
            frame: 0,
            seed: 0,
            id: GraphId { id: NEXT.fetch_add(1, Ordering::Relaxed), name },
            image_names: Names::default(),
            buffer_names: Names::default(),
            pass_names: Names::default(),
            images: Vec::new(),
            buffers: Vec::new(),
            uniforms: Vec::new(),
            passes: Vec::new(),
            reads: Vec::new(),
            scope: Vec::new(),
        }
    }

    /// The name given to [`Graph::new`].
    pub fn name(&self) -> &'static str {
        self.id.name
    }

    /// An image of one level and one layer that lives in this graph; undefined until a pass writes it.
    pub fn image(&mut self, name: impl Into<String>, format: Format, extent: impl Into<Extent>) -> Image {
        self.image_with(name, ImageDesc::new(format, extent.into()))
    }

    /// An image that lives in this graph; undefined until a pass writes it.
    pub fn image_with(&mut self, name: impl Into<String>, desc: ImageDesc) -> Image {
        self.add_image(name.into(), desc, Origin::Transient)
    }

    /// The image of the last frame and that of this frame, both of `name`. The former is zero in the first frame, and
    /// whenever format or extent changed; the latter is undefined until a pass writes it.
    pub fn history(&mut self, name: impl Into<String>, format: Format, extent: impl Into<Extent>) -> (Image, Image) {
        self.history_with(name, ImageDesc::new(format, extent.into()))
    }

    /// As [`Graph::history`], with levels and layers.
    pub fn history_with(&mut self, name: impl Into<String>, desc: ImageDesc) -> (Image, Image) {
        let key = name.into();
        let previous =
            self.add_image(format!("{key}.previous"), desc, Origin::History { key: key.clone(), next: false });
        let next = self.add_image(key.clone(), desc, Origin::History { key, next: true });
        (previous, next)
    }

    pub(super) fn add_image(&mut self, name: String, desc: ImageDesc, origin: Origin) -> Image {
        let name = self.image_names.take(name);
        self.images.push(ImageEntry { name, desc, origin });
        self.whole_image((self.images.len() - 1) as u32)
    }

    /// All levels and layers of an image.
    pub(super) fn whole_image(&self, index: u32) -> Image {
        let desc = self.images[index as usize].desc;
        Image {
            graph: self.id,
            index,
            mip: 0,
            mips: desc.mips,
            layer: 0,
            layers: desc.layers,
            cube: desc.cube,
            sampler: Sampler::Linear,
        }
    }

    /// A buffer of `bytes` bytes that lives in this graph; undefined until a pass writes it.
    pub fn buffer(&mut self, name: impl Into<String>, bytes: u64) -> Buffer {
        self.add_buffer(name.into(), bytes, None, false)
    }

    /// A buffer with these contents at the start of the graph.
    pub fn buffer_from<T: NoUninit>(&mut self, name: impl Into<String>, contents: &[T]) -> Buffer {
        let bytes: &[u8] = bytemuck::cast_slice(contents);
        self.add_buffer(name.into(), bytes.len() as u64, Some(bytes.to_vec()), false)
    }

    /// As [`Graph::history`], for buffers.
    pub fn history_buffer(&mut self, name: impl Into<String>, bytes: u64) -> (Buffer, Buffer) {
        let key = name.into();
        let previous = self.add_buffer(format!("{key}.previous"), bytes, None, false);
        let next = self.add_buffer(key.clone(), bytes, None, false);
        for (buffer, next) in [(previous, false), (next, true)] {
            self.buffers[buffer.index as usize].origin = Origin::History { key: key.clone(), next };
        }
        (previous, next)
    }

    /// An image that someone else owns, known only by its description: for planning without a device.
    pub fn import_image_described(&mut self, name: impl Into<String>, desc: ImageDesc) -> Image {
        let rest = Layout::ShaderRead;
        let imported = Imported { rest, contents: true, usage: None, owner: Owner::Described };
        self.add_image(name.into(), desc, Origin::Imported(imported))
    }

    /// A buffer that someone else owns, known only by its size: for planning without a device.
    pub fn import_buffer_described(&mut self, name: impl Into<String>, bytes: u64) -> Buffer {
        let buffer = self.add_buffer(name.into(), bytes, None, false);
        let imported = Imported { rest: Layout::Buffer, contents: true, usage: None, owner: Owner::Described };
        self.buffers[buffer.index as usize].origin = Origin::Imported(imported);
        buffer
    }

    fn add_buffer(&mut self, name: String, bytes: u64, contents: Option<Vec<u8>>, host: bool) -> Buffer {
        let name = self.buffer_names.take(name);
        self.buffers.push(BufferEntry { name, bytes, origin: Origin::Transient, contents, host, accel: None });
        Buffer { graph: self.id, index: (self.buffers.len() - 1) as u32, offset: 0, size: bytes }
    }

    /// A uniform block with this value.
    pub fn uniform<T: Pod>(&mut self, value: &T) -> Uniform<T> {
        let offset = self.uniforms.len().next_multiple_of(UNIFORM_ALIGNMENT);
        self.uniforms.resize(offset, 0);
        self.uniforms.extend_from_slice(bytemuck::bytes_of(value));
        Uniform::new(UniformSlice { graph: self.id, offset: offset as u32, size: size_of::<T>() as u32 })
    }

    #[track_caller]
    fn entry(&self, image: Image) -> &ImageEntry {
        assert!(
            image.graph == self.id,
            "an image of graph `{}` was used in graph `{}`; handles are valid for one graph",
            image.graph.name,
            self.id.name
        );
        &self.images[image.index as usize]
    }

    /// Extent of the first level that the handle covers.
    ///
    /// # Panics
    /// If the image belongs to another graph.
    #[track_caller]
    pub fn extent(&self, image: Image) -> Extent {
        self.entry(image).desc.extent.mip(image.mip)
    }

    /// What the whole image is.
    ///
    /// # Panics
    /// If the image belongs to another graph.
    #[track_caller]
    pub fn desc(&self, image: Image) -> ImageDesc {
        self.entry(image).desc
    }

    /// The name of an image, for `--view` and `--dump`.
    ///
    /// # Panics
    /// If the image belongs to another graph.
    #[track_caller]
    pub fn image_name(&self, image: Image) -> &str {
        &self.entry(image).name
    }

    /// Runs a compute shader with at least this many threads; the shader discards those outside.
    pub fn compute<A: ComputeArgs>(&mut self, args: A, threads: impl Into<Threads>) -> PassRef<'_> {
        let size = A::SHADER.workgroup;
        let threads = threads.into().0;
        let groups = [0, 1, 2].map(|i| threads[i].div_ceil(size[i].max(1)));
        self.pass(A::SHADER.name, Work::Compute { bound: bound(&args), groups: Groups::Direct(groups), over: None })
    }

    /// As [`Graph::compute`], for a shader whose invocations loop over many items. The runner cuts the pass into as many dispatches as
    /// watchdogs and drivers that limit loops ask for; each has other `first` and `count` in its push constants, whose values in `args` have
    /// no effect. The shader adds its items to the values that the dispatch before wrote; with `first == 0` it may begin with zero. Without
    /// items it runs once, with `count == 0`. A pass that is [counted](PassRef::counted) is one submission, however long.
    pub fn compute_over<A: RangedArgs>(&mut self, args: A, threads: impl Into<Threads>, items: Items) -> PassRef<'_> {
        let pass = self.compute(args, threads);
        pass.over(items, A::RANGE)
    }

    /// As [`Graph::compute_over`], with the group counts (three `u32`) that lie at `offset` in `groups`.
    pub fn compute_indirect_over<A: RangedArgs>(
        &mut self,
        args: A,
        (groups, offset): (Buffer, u64),
        items: Items,
    ) -> PassRef<'_> {
        let pass = self.compute_indirect(args, groups, offset);
        pass.over(items, A::RANGE)
    }

    /// Runs a compute shader with the group counts (three `u32`) that lie at `offset` in `groups`.
    pub fn compute_indirect<A: ComputeArgs>(&mut self, args: A, groups: Buffer, offset: u64) -> PassRef<'_> {
        let groups = Groups::Indirect { buffer: groups, offset };
        self.pass(A::SHADER.name, Work::Compute { bound: bound(&args), groups, over: None })
    }

    /// Draws with a vertex shader and (if there is one) a fragment shader.
    pub fn raster<A: RasterArgs>(&mut self, targets: Targets, state: Raster, args: A, draw: Draw) -> PassRef<'_> {
        self.pass(A::SHADER.name, Work::Raster { bound: bound(&args), targets, state, draw })
    }

    /// Sets every pixel. Integer formats take the value rounded; depth the first component, stencil the second.
    pub fn clear(&mut self, image: Image, value: [f32; 4]) -> PassRef<'_> {
        let name = format!("clear {}", self.short_name(image));
        self.pass(name, Work::Clear { image, value })
    }

    /// Sets every four bytes.
    pub fn fill(&mut self, buffer: Buffer, value: u32) -> PassRef<'_> {
        let name = format!("fill {}", self.short_buffer_name(buffer));
        self.pass(name, Work::Fill { buffer, value })
    }

    /// Copies all levels and layers of `from` to those of `to`: same format and extent.
    pub fn copy(&mut self, from: Image, to: Image) -> PassRef<'_> {
        let name = format!("copy {}", self.short_name(from));
        self.pass(name, Work::CopyImage { from, to })
    }

    /// Copies bytes: as many as both ranges have.
    pub fn copy_buffer(&mut self, from: Buffer, to: Buffer) -> PassRef<'_> {
        let name = format!("copy {}", self.short_buffer_name(from));
        self.pass(name, Work::CopyBuffer { from, to })
    }

    /// Scales one level of `from` into one level of `to`, with linear filtering (nearest for integers and depth) and
    /// conversion of the format. As many layers in both.
    pub fn blit(&mut self, from: Image, to: Image) -> PassRef<'_> {
        let name = format!("blit {}", self.short_name(from));
        self.pass(name, Work::Blit { from, to })
    }

    /// Makes the levels of `image` after its first, each from the one before, by a box filter.
    pub fn mips(&mut self, image: Image) {
        let name = format!("mips {}", self.short_name(image));
        for level in 1..image.mips {
            self.pass(name.clone(), Work::Blit { from: image.mip(level - 1), to: image.mip(level) });
        }
    }

    /// Puts a label around the passes that `body` declares.
    pub fn scope<R>(&mut self, name: impl Into<String>, body: impl FnOnce(&mut Graph) -> R) -> R {
        self.scope.push(name.into());
        let result = body(self);
        self.scope.pop();
        result
    }

    /// Promises the pixels that `image` (one level, its layers) has at this point of the graph.
    pub fn read_image(&mut self, image: Image) -> ImageRead {
        let (name, desc) = match self.images.get(image.index as usize) {
            Some(entry) if image.graph == self.id => {
                let extent = entry.desc.extent.mip(image.mip);
                let depth = (entry.desc.depth >> image.mip.min(31)).max(1);
                let layers = image.layers;
                (entry.name.clone(), ImageDesc { extent, depth, mips: 1, layers, ..entry.desc })
            }
            // The pass below is a mistake that the plan reports.
            _ => ("?".to_owned(), ImageDesc::new(Format::R8, Extent::square(1))),
        };
        let to = self.add_buffer(format!("read {name}"), desc.bytes().next_multiple_of(4), None, true);
        self.pass(format!("read {name}"), Work::ReadImage { from: image, to });
        self.reads.push(ReadEntry { to, what: ReadWhat::Image { name, desc, format: desc.format } });
        ImageRead { graph: self.id, index: (self.reads.len() - 1) as u32 }
    }

    /// Promises the bytes that `buffer` has at this point of the graph.
    pub fn read_buffer(&mut self, buffer: Buffer) -> BufferRead {
        let name = format!("read {}", self.short_buffer_name(buffer));
        let to = self.add_buffer(name.clone(), buffer.size, None, true);
        self.pass(name, Work::ReadBuffer { from: buffer, to });
        self.reads.push(ReadEntry { to, what: ReadWhat::Buffer });
        BufferRead { graph: self.id, index: (self.reads.len() - 1) as u32 }
    }

    /// How many passes were declared.
    pub fn pass_count(&self) -> usize {
        self.passes.len()
    }

    /// All bytes of a buffer.
    pub(super) fn whole_buffer(&self, index: u32) -> Buffer {
        Buffer { graph: self.id, index, offset: 0, size: self.buffers[index as usize].bytes }
    }

    pub(super) fn resource_name(&self, resource: Resource) -> String {
        match resource {
            Resource::Image(i) => self.images[i as usize].name.clone(),
            Resource::Buffer(i) => self.buffers[i as usize].name.clone(),
        }
    }

    pub(super) fn short_name(&self, image: Image) -> &str {
        match self.images.get(image.index as usize) {
            Some(entry) if image.graph == self.id => &entry.name,
            _ => "?",
        }
    }

    pub(super) fn short_buffer_name(&self, buffer: Buffer) -> &str {
        match self.buffers.get(buffer.index as usize) {
            Some(entry) if buffer.graph == self.id => &entry.name,
            _ => "?",
        }
    }

    pub(super) fn pass(&mut self, name: impl Into<String>, work: Work) -> PassRef<'_> {
        let name = self.pass_names.take(name.into());
        self.passes.push(Pass {
            name,
            scope: self.scope.clone(),
            counted: false,
            rays: 0,
            addressed: Vec::new(),
            work,
        });
        let index = self.passes.len() - 1;
        PassRef { graph: self, index }
    }
}

fn bound<A: Args>(args: &A) -> Bound {
    let mut resources = Vec::new();
    let shader = args.variant(&mut resources);
    Bound { shader, resources, push: args.push().to_vec(), spec: args.spec() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What it was before: each candidate beside all that are taken.
    fn slow(name: &str, taken: &[String]) -> String {
        let free = |candidate: &String| !taken.contains(candidate);
        let numbered = (2u32..).map(|n| format!("{name}#{n}"));
        std::iter::once(name.to_owned()).chain(numbered).find(free).unwrap()
    }

    #[test]
    fn names_are_the_first_that_are_free() {
        let (mut names, mut taken) = (Names::default(), Vec::<String>::new());
        let mut state = 7u32;
        for step in 0..400 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let name = ["a", "b", "a#3", "a#2#2", "b#x", "#2"][(state >> 16) as usize % 6];
            let expected = slow(name, &taken);
            assert_eq!(names.take(name.to_owned()), expected, "step {step}");
            taken.push(expected);
            // Some are given back, of the late and of the early ones.
            if state >> 28 < 5 {
                let gone = taken.swap_remove((state >> 8) as usize % taken.len());
                names.free(&gone);
            }
        }
    }

    #[test]
    fn thousands_of_passes_of_one_name_are_declared() {
        // Each beside all before it, a hundred thousand would not end.
        let mut graph = Graph::new("many");
        let buffer = graph.buffer("b", 4);
        for _ in 0..100_000 {
            graph.fill(buffer, 0);
        }
        assert_eq!(graph.fill(buffer, 0).name(), "fill b#100001");
        assert_eq!(graph.fill(buffer, 0).named("fill b#7").name(), "fill b#7#2");
        assert_eq!(graph.fill(buffer, 0).name(), "fill b#100002");
    }
}
