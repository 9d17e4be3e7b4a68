//! From declared passes to barriers and physical resources: pure data, no device.
//!
//! Each physical resource is cut into cells along the levels, layers or bytes that its uses name. The uses of a cell form
//! *epochs*: one write, or a run of reads in one layout. Between two epochs lies one barrier, before the first pass of the
//! later one and for all its stages; reads of one epoch need none among themselves. Equal barriers of neighbouring cells
//! are merged. Everything that earlier frames did counts as one write by every stage before the first pass, so that the
//! first barrier of each resource is there too, at the very start, where it costs nothing.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, HashMap};

use super::{
    Graph,
    access::Collector,
    format::ImageDesc,
    grid::Grid,
    pass::{Origin, Pass, Work},
    vocab::{Access, Layout, Mistake, MistakeKind, Region, Resource, Scope, Stages, Usage, Use},
};

/// What every stage of earlier frames did.
pub(super) const EARLIER: Scope = Scope { stages: Stages::ALL, access: Access::WRITES };
/// What any stage of later frames may do.
const LATER: Scope = Scope { stages: Stages::ALL, access: Access::EVERYTHING };

/// What a physical resource is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shape {
    Image(ImageDesc),
    /// Bytes.
    Buffer(u64),
}

/// Where the memory of a physical resource comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Source {
    /// A pool; contents are lost between graphs.
    Pool,
    /// One half of the pair of this name.
    History { key: String, next: bool },
    /// Given by the caller: number of the logical image or buffer.
    Imported(u32),
}

/// An image or buffer in memory, used by one logical resource or by several, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Physical {
    pub shape: Shape,
    pub usage: Usage,
    pub source: Source,
    /// Layout before and after the graph; `None`: undefined before, anything after.
    pub rest: Option<Layout>,
    /// It holds data at the start.
    pub contents: bool,
    /// The logical resources, in the order of use.
    pub occupants: Vec<Resource>,
}

/// Makes what `src` did to a region available and visible to `dst`, and changes its layout.
#[derive(Clone, Debug, PartialEq)]
pub struct Barrier {
    /// The pass it comes before; the number of passes: at the end.
    pub before: usize,
    /// Number of the physical resource.
    pub physical: usize,
    /// Name of the logical resource that is used next.
    pub name: String,
    pub region: Region,
    pub src: Scope,
    pub dst: Scope,
    pub from: Layout,
    pub to: Layout,
}

/// A pass and what it uses.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPass {
    pub name: String,
    /// Labels around it, outermost first.
    pub scope: Vec<String>,
    pub uses: Vec<Use>,
}

/// Passes, physical resources and barriers of a graph.
#[derive(Clone, Debug)]
pub struct Plan {
    pub graph: String,
    pub passes: Vec<PlannedPass>,
    pub physical: Vec<Physical>,
    /// Sorted by the pass they come before.
    pub barriers: Vec<Barrier>,
    /// Things that are no mistake but look like one.
    pub warnings: Vec<String>,
    /// Physical resource of each logical image; `None`: unused.
    pub images: Vec<Option<usize>>,
    /// Physical resource of each logical buffer; `None`: unused.
    pub buffers: Vec<Option<usize>>,
    names: BTreeMap<Resource, String>,
    /// The contents of buffers, uploaded before the first declared pass.
    pub(super) upload: Option<Pass>,
}

/// The epoch that a cell is in.
#[derive(Clone)]
struct Cell {
    scope: Scope,
    layout: Layout,
    owner: Option<Resource>,
    contents: bool,
    /// Nothing in this graph has touched it.
    untouched: bool,
    /// Its barrier, in the list of the physical resource.
    barrier: Option<usize>,
}

struct CellBarrier {
    cell: usize,
    before: usize,
    owner: Resource,
    src: Scope,
    dst: Scope,
    from: Layout,
    to: Layout,
}

impl Shape {
    pub(super) fn whole(&self) -> Region {
        match self {
            Shape::Image(desc) => Region::image(0..desc.mips, 0..desc.layers),
            Shape::Buffer(bytes) => Region::buffer(0..(*bytes).max(1)),
        }
    }
}

impl Plan {
    /// Whether the other plan has the same passes, resources and barriers.
    pub(super) fn does_the_same(&self, other: &Self) -> bool {
        (&self.passes, &self.physical, &self.barriers) == (&other.passes, &other.physical, &other.barriers)
    }

    /// Plans `graph`.
    ///
    /// # Errors
    /// Every mistake found, each with pass and resource.
    pub fn new(graph: &Graph) -> Result<Self, Vec<Mistake>> {
        let upload = upload_pass(graph);
        let mut mistakes = Vec::new();
        let mut passes = Vec::with_capacity(graph.passes.len() + 1);
        for pass in upload.iter().chain(&graph.passes) {
            let collected = Collector::collect(graph, pass);
            mistakes.extend(collected.mistakes);
            passes.push(PlannedPass { name: pass.name.clone(), scope: pass.scope.clone(), uses: collected.uses });
        }
        let mut names = BTreeMap::new();
        for (i, image) in graph.images.iter().enumerate() {
            names.insert(Resource::Image(i as u32), image.name.clone());
        }
        for (i, buffer) in graph.buffers.iter().enumerate() {
            names.insert(Resource::Buffer(i as u32), buffer.name.clone());
        }
        let mut plan = Self {
            graph: graph.name().to_owned(),
            passes,
            physical: Vec::new(),
            barriers: Vec::new(),
            warnings: Vec::new(),
            images: vec![None; graph.images.len()],
            buffers: vec![None; graph.buffers.len()],
            names,
            upload,
        };
        mistakes.extend(shapes(graph));
        plan.place(graph);
        let touches = plan.touches();
        for (physical, touches) in touches.iter().enumerate() {
            plan.synchronise(graph, (physical, touches), &mut mistakes);
        }
        plan.barriers.sort_by_key(|b| b.before);
        plan.warn(graph);
        if mistakes.is_empty() { Ok(plan) } else { Err(mistakes) }
    }

    /// The name of a logical resource.
    pub fn name(&self, resource: Resource) -> &str {
        self.names.get(&resource).map_or("?", String::as_str)
    }

    /// The physical resource of a logical one; `None`: unused.
    pub fn physical_of(&self, resource: Resource) -> Option<usize> {
        match resource {
            Resource::Image(i) => self.images.get(i as usize).copied().flatten(),
            Resource::Buffer(i) => self.buffers.get(i as usize).copied().flatten(),
        }
    }

    /// The barriers right before pass `index` (the number of passes: at the end).
    pub fn barriers_before(&self, index: usize) -> &[Barrier] {
        let begin = self.barriers.partition_point(|b| b.before < index);
        let end = self.barriers.partition_point(|b| b.before <= index);
        &self.barriers[begin..end]
    }

    /// The same plan without one barrier, for tests: [`super::oracle::check`] must object.
    #[must_use]
    pub fn without_barrier(&self, index: usize) -> Self {
        let mut plan = self.clone();
        plan.barriers.remove(index);
        plan
    }

    /// What is written and never read. Depth is read by its own tests.
    fn warn(&mut self, graph: &Graph) {
        let mut read = vec![false; graph.images.len()];
        for u in self.passes.iter().flat_map(|p| &p.uses).filter(|u| u.reads()) {
            if let Resource::Image(i) = u.resource {
                read[i as usize] = true;
            }
        }
        for (i, image) in graph.images.iter().enumerate() {
            let kept = !matches!(image.origin, Origin::Transient) || image.desc.format.is_depth();
            // What no pass uses has no place.
            if self.images[i].is_some() && !kept && !read[i] {
                self.warnings.push(format!("image `{}` is written and never read", image.name));
            }
        }
    }

    /// Gives every used logical resource a physical one; those of equal shape that are never in use together share.
    fn place(&mut self, graph: &Graph) {
        let mut lives: BTreeMap<Resource, (usize, usize, Usage)> = BTreeMap::new();
        let passes = self.passes.len();
        for (index, pass) in self.passes.iter().enumerate() {
            for u in &pass.uses {
                let life = lives.entry(u.resource).or_insert((index, index, Usage::NONE));
                life.1 = index;
                life.2 |= u.usage;
            }
        }
        let mut order: Vec<_> = lives.into_iter().collect();
        order.sort_by_key(|(resource, (first, ..))| (*first, *resource));
        // Those of a pool, by what they can serve.
        let mut shared: HashMap<(Shape, bool), Shared> = HashMap::new();
        for (resource, (first, last, mut usage)) in order {
            let (shape, origin, host) = match resource {
                Resource::Image(i) => {
                    let entry = &graph.images[i as usize];
                    (Shape::Image(entry.desc), &entry.origin, false)
                }
                Resource::Buffer(i) => {
                    let entry = &graph.buffers[i as usize];
                    (Shape::Buffer(entry.bytes), &entry.origin, entry.host)
                }
            };
            let last = if host { passes } else { last };
            if host {
                usage |= Usage::HOST;
            }
            let mut pool = matches!(origin, Origin::Transient).then(|| shared.entry((shape, host)).or_default());
            let free = pool.as_mut().and_then(|pool| pool.free_at(first));
            let physical = free.unwrap_or_else(|| {
                let (source, rest, contents) = match (origin, resource) {
                    (Origin::Transient, _) => (Source::Pool, None, false),
                    (Origin::History { key, next }, Resource::Image(_)) => {
                        (Source::History { key: key.clone(), next: *next }, Some(Layout::General), !next)
                    }
                    (Origin::History { key, next }, Resource::Buffer(_)) => {
                        (Source::History { key: key.clone(), next: *next }, Some(Layout::Buffer), !next)
                    }
                    (Origin::Imported(i), Resource::Image(n) | Resource::Buffer(n)) => {
                        (Source::Imported(n), Some(i.rest), i.contents)
                    }
                };
                let usage = Usage::NONE;
                self.physical.push(Physical { shape, usage, source, rest, contents, occupants: Vec::new() });
                self.physical.len() - 1
            });
            if let Some(pool) = pool {
                pool.busy.push(Reverse((last, physical)));
            }
            self.physical[physical].usage |= usage;
            self.physical[physical].occupants.push(resource);
            match resource {
                Resource::Image(i) => self.images[i as usize] = Some(physical),
                Resource::Buffer(i) => self.buffers[i as usize] = Some(physical),
            }
        }
    }

    /// The uses of each physical resource, in order, as numbers of the pass and of the use in it.
    fn touches(&self) -> Vec<Vec<(usize, usize)>> {
        let mut touches = vec![Vec::new(); self.physical.len()];
        for (number, pass) in self.passes.iter().enumerate() {
            for (i, u) in pass.uses.iter().enumerate() {
                if let Some(physical) = self.physical_of(u.resource) {
                    touches[physical].push((number, i));
                }
            }
        }
        touches
    }

    /// The barriers of one physical resource, and reads of what was never written.
    fn synchronise(
        &mut self,
        graph: &Graph,
        (index, touches): (usize, &[(usize, usize)]),
        mistakes: &mut Vec<Mistake>,
    ) {
        let physical = &self.physical[index];
        let whole = physical.shape.whole();
        let buffer = matches!(physical.shape, Shape::Buffer(_));
        let touches: Vec<(usize, &Use)> =
            touches.iter().map(|(number, i)| (*number, &self.passes[*number].uses[*i])).collect();
        let grid = Grid::new(&whole, touches.iter().map(|(_, u)| &u.region));
        // An imported image without contents has no layout yet.
        let layout = match (physical.rest, physical.contents, &physical.source) {
            _ if buffer => Layout::Buffer,
            (None, ..) | (_, false, Source::Imported(_)) => Layout::Undefined,
            (Some(rest), ..) => rest,
        };
        let owner = (physical.source != Source::Pool).then(|| physical.occupants[0]);
        let start = Cell { scope: EARLIER, layout, owner, contents: physical.contents, untouched: true, barrier: None };
        let mut cells = vec![start; grid.len()];
        let mut list: Vec<CellBarrier> = Vec::new();
        for (number, u) in &touches {
            let mut unwritten = false;
            for c in grid.cells(&u.region) {
                let cell = &mut cells[c];
                if cell.owner != Some(u.resource) {
                    cell.owner = Some(u.resource);
                    cell.contents = false;
                    if !buffer {
                        cell.layout = Layout::Undefined;
                    }
                }
                unwritten |= u.reads() && !cell.contents;
                let step = Step { pass: *number, scope: u.scope, layout: u.layout, owner: u.resource };
                advance(cell, c, &step, &mut list);
                cell.contents |= u.writes();
            }
            if unwritten {
                mistakes.push(Mistake {
                    kind: MistakeKind::ReadBeforeWrite,
                    graph: graph.name().to_owned(),
                    pass: self.passes[*number].name.clone(),
                    resource: self.name(u.resource).to_owned(),
                    what: format!("`{}` reads {}, which no earlier pass wrote", u.role, part(&u.region, buffer)),
                });
            }
        }
        let end = self.passes.len();
        for (c, cell) in cells.iter_mut().enumerate() {
            let owner = cell.owner.unwrap_or(physical.occupants[0]);
            if physical.usage.contains(Usage::HOST) && !cell.untouched {
                let scope = Scope { stages: Stages::HOST, access: Access::HOST_READ };
                advance(cell, c, &Step { pass: end, scope, layout: cell.layout, owner }, &mut list);
            } else if let Some(rest) = physical.rest
                && rest != cell.layout
            {
                advance(cell, c, &Step { pass: end, scope: LATER, layout: rest, owner }, &mut list);
            }
        }
        let merged = self.merge(index, &grid, &list);
        self.barriers.extend(merged);
    }

    fn merge(&self, physical: usize, grid: &Grid, list: &[CellBarrier]) -> Vec<Barrier> {
        let mut groups: BTreeMap<_, Vec<usize>> = BTreeMap::new();
        for b in list {
            groups.entry((b.before, b.src, b.dst, b.from, b.to, b.owner)).or_default().push(b.cell);
        }
        let mut merged = Vec::new();
        for ((before, src, dst, from, to, owner), mut cells) in groups {
            cells.sort_unstable();
            for region in grid.rectangles(&cells) {
                let name = self.name(owner).to_owned();
                merged.push(Barrier { before, physical, name, region, src, dst, from, to });
            }
        }
        merged
    }
}

/// Physical resources of a pool that are alike.
#[derive(Default)]
struct Shared {
    /// By the last pass of their occupant, then by their number.
    busy: BinaryHeap<Reverse<(usize, usize)>>,
    free: BinaryHeap<Reverse<usize>>,
}

impl Shared {
    /// The one of the lowest number that nobody uses from pass `first` on. Asked for passes in ascending order.
    fn free_at(&mut self, first: usize) -> Option<usize> {
        while let Some(Reverse((_, physical))) = self.busy.peek().filter(|Reverse((last, _))| *last < first) {
            self.free.push(Reverse(*physical));
            self.busy.pop();
        }
        self.free.pop().map(|Reverse(physical)| physical)
    }
}

/// A use of one cell.
struct Step {
    pass: usize,
    scope: Scope,
    layout: Layout,
    owner: Resource,
}

/// Moves a cell on to `step`: into its epoch if that only reads, else behind a barrier.
fn advance(cell: &mut Cell, number: usize, step: &Step, list: &mut Vec<CellBarrier>) {
    let reads_on = cell.scope.access.writes().is_empty() && step.scope.access.writes().is_empty();
    if reads_on && cell.layout == step.layout {
        cell.scope.stages |= step.scope.stages;
        cell.scope.access |= step.scope.access;
        if let Some(barrier) = cell.barrier {
            list[barrier].dst = cell.scope;
        }
        return;
    }
    list.push(CellBarrier {
        cell: number,
        before: if cell.untouched { 0 } else { step.pass },
        owner: step.owner,
        src: Scope { access: cell.scope.access.writes(), ..cell.scope },
        dst: step.scope,
        from: cell.layout,
        to: step.layout,
    });
    cell.barrier = Some(list.len() - 1);
    cell.scope = step.scope;
    cell.layout = step.layout;
    cell.untouched = false;
}

fn part(region: &Region, buffer: bool) -> String {
    if buffer {
        format!("bytes {}..{}", region.a.0, region.a.1)
    } else {
        format!("levels {}..{} and layers {}..{}", region.a.0, region.a.1, region.b.0, region.b.1)
    }
}

fn upload_pass(graph: &Graph) -> Option<Pass> {
    let filled = graph.buffers.iter().enumerate().filter(|(_, b)| b.contents.is_some());
    let buffers: Vec<_> = filled.map(|(i, _)| graph.whole_buffer(i as u32)).collect();
    (!buffers.is_empty()).then(|| Pass {
        name: "upload".into(),
        scope: Vec::new(),
        counted: false,
        rays: 0,
        addressed: Vec::new(),
        work: Work::Upload { buffers },
    })
}

/// Descriptions that no image can have.
fn shapes(graph: &Graph) -> Vec<Mistake> {
    let wrong = |d: &ImageDesc| {
        let largest = d.extent.width.max(d.extent.height).max(d.depth);
        let levels = if largest == 0 { 0 } else { 32 - largest.leading_zeros() };
        d.extent.width == 0
            || d.extent.height == 0
            || d.depth == 0
            || d.layers == 0
            || !(1..=levels).contains(&d.mips)
            || (d.cube && (!d.layers.is_multiple_of(6) || d.extent.width != d.extent.height))
    };
    let bad = graph.images.iter().filter(|i| wrong(&i.desc));
    bad.map(|i| Mistake {
        kind: MistakeKind::Shape,
        graph: graph.name().to_owned(),
        pass: "-".into(),
        resource: i.name.clone(),
        what: format!(
            "{} × {} with {} levels and {} layers cannot be; sides from 1, levels down to 1×1, square cubes of 6 layers",
            i.desc.extent, i.desc.depth, i.desc.mips, i.desc.layers
        ),
    })
    .collect()
}
