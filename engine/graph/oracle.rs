//! An independent check of a plan, by brute force: for every cell of every physical resource, every pair of accesses of
//! which one writes must be ordered by a chain of barriers on that very cell, what is written must be available and visible
//! where it is used next, every use must find its layout and its contents.
//!
//! It shares no code with the planner but the plain data. It is stricter than Vulkan in one point: a barrier on one resource
//! orders nothing on another, so that each barrier must be there for its own reason.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    plan::{Barrier, Physical, Plan, Shape, Source},
    vocab::{Access, Layout, Region, Resource, Scope, Stages, Usage, Use},
};

/// Something that happens to a cell.
enum Event<'a> {
    Use { who: String, scope: Scope, resource: Option<Resource>, layout: Option<Layout> },
    Barrier(&'a Barrier),
}

impl Event<'_> {
    fn only_reads(&self) -> bool {
        matches!(self, Self::Use { scope, .. } if scope.access.writes().is_empty())
    }
}

/// Every objection to `plan`; none: it is right.
pub fn check(plan: &Plan) -> Vec<String> {
    let mut objections = Vec::new();
    for happenings in all(plan) {
        objections.extend(happenings.check());
    }
    lifetimes(plan, &mut objections);
    for barrier in &plan.barriers {
        if barrier.before > plan.passes.len() || barrier.physical >= plan.physical.len() {
            objections.push(format!("{barrier:?} is nowhere"));
        }
    }
    objections
}

/// Every objection to what `plan` does with the physical resource `index`.
pub fn check_one(plan: &Plan, index: usize) -> Vec<String> {
    all(plan).get(index).map_or_else(Vec::new, Happenings::check)
}

/// What happens to each physical resource: one look at every use and barrier of the plan.
fn all(plan: &Plan) -> Vec<Happenings<'_>> {
    let each =
        plan.physical.iter().map(|physical| Happenings { plan, physical, uses: Vec::new(), barriers: Vec::new() });
    let mut all: Vec<Happenings<'_>> = each.collect();
    for (number, pass) in plan.passes.iter().enumerate() {
        for u in &pass.uses {
            if let Some(happenings) = plan.physical_of(u.resource).and_then(|physical| all.get_mut(physical)) {
                happenings.uses.push((number, u));
            }
        }
    }
    for barrier in plan.barriers.iter().filter(|barrier| barrier.before <= plan.passes.len()) {
        if let Some(happenings) = all.get_mut(barrier.physical) {
            happenings.barriers.push(barrier);
        }
    }
    all.iter_mut().for_each(|happenings| happenings.barriers.sort_by_key(|barrier| barrier.before));
    all
}

/// Uses of a physical resource with the numbers of their passes, and its barriers, both in order.
struct Happenings<'a> {
    plan: &'a Plan,
    physical: &'a Physical,
    uses: Vec<(usize, &'a Use)>,
    barriers: Vec<&'a Barrier>,
}

impl<'a> Happenings<'a> {
    fn check(&self) -> Vec<String> {
        let mut objections = Vec::new();
        for cell in self.cells() {
            let events = self.timeline(&cell);
            let place = format!("{} {cell:?}", self.plan.name(self.physical.occupants[0]));
            hazards(&events, &place, &mut objections);
            contents(&events, self.physical, &place, &mut objections);
        }
        objections
    }

    /// Regions inside of which every use and barrier covers all or nothing.
    fn cells(&self) -> Vec<Region> {
        let (a_end, b_end) = match self.physical.shape {
            Shape::Image(desc) => (desc.mips.into(), desc.layers.into()),
            Shape::Buffer(bytes) => (bytes.max(1), 1),
        };
        let (mut a, mut b) = (BTreeSet::from([0, a_end]), BTreeSet::from([0, b_end]));
        let uses = self.uses.iter().map(|(_, u)| &u.region);
        for region in uses.chain(self.barriers.iter().map(|b| &b.region)) {
            a.extend([region.a.0, region.a.1]);
            b.extend([region.b.0, region.b.1]);
        }
        let pairs = |cuts: BTreeSet<u64>| {
            let cuts: Vec<u64> = cuts.into_iter().collect();
            cuts.windows(2).map(|w| (w[0], w[1])).collect::<Vec<_>>()
        };
        let columns = pairs(b);
        pairs(a).into_iter().flat_map(|a| columns.iter().map(move |b| Region { a, b: *b })).collect()
    }

    /// What happens to a cell, in order: earlier frames, barriers and passes, whoever comes after.
    fn timeline(&self, cell: &Region) -> Vec<Event<'a>> {
        let earlier = Scope { stages: Stages::ALL, access: Access::WRITES };
        let mut events =
            vec![Event::Use { who: "earlier frames".into(), scope: earlier, resource: None, layout: None }];
        let mut barriers = self.barriers.iter().filter(|b| b.region.overlaps(cell)).peekable();
        let mut used = false;
        for (number, u) in self.uses.iter().filter(|(_, u)| u.region.overlaps(cell)) {
            while let Some(barrier) = barriers.next_if(|b| b.before <= *number) {
                events.push(Event::Barrier(barrier));
            }
            used = true;
            events.push(Event::Use {
                who: format!("`{}` as `{}`", self.plan.passes[*number].name, u.role),
                scope: u.scope,
                resource: Some(u.resource),
                layout: Some(u.layout),
            });
        }
        events.extend(barriers.map(|barrier| Event::Barrier(barrier)));
        if self.physical.usage.contains(Usage::HOST) && used {
            let scope = Scope { stages: Stages::HOST, access: Access::HOST_READ };
            let (who, resource) = ("the host".into(), Some(self.physical.occupants[0]));
            events.push(Event::Use { who, scope, resource, layout: None });
        }
        events
    }
}

/// Follows what one access of one stage did through later barriers. `made`: it wrote, with this access.
struct Flow {
    /// The stage it happened in.
    origin: Stages,
    write: Access,
    /// Stages that come after it by a chain of barriers.
    after: Stages,
    /// What it wrote has been made available.
    available: bool,
    /// What it wrote is visible to these accesses in these stages.
    visible: Vec<Scope>,
}

impl Flow {
    fn pass(&mut self, barrier: &Barrier) {
        if !barrier.src.stages.intersects(self.origin) && !barrier.src.stages.intersects(self.after) {
            return;
        }
        if barrier.src.stages.intersects(self.origin) && barrier.src.access.contains(self.write) {
            self.available = true;
        }
        self.after |= barrier.dst.stages;
        if self.available {
            self.visible.push(barrier.dst);
        }
    }

    fn ordered(&self, stages: Stages) -> bool {
        self.after.contains(stages)
    }

    fn seen_by(&self, stages: Stages, access: Access) -> bool {
        self.visible.iter().any(|v| v.stages.contains(stages) && v.access.contains(access))
    }
}

/// Every pair of accesses of which one writes.
fn hazards(events: &[Event], place: &str, objections: &mut Vec<String>) {
    // All that can come into conflict with a read: a reader need not look at the readers after it.
    let writing: Vec<&Event> = events.iter().filter(|event| !event.only_reads()).collect();
    let mut written = 0;
    for (i, first) in events.iter().enumerate() {
        written += usize::from(!first.only_reads());
        match first {
            Event::Use { who, scope, .. } => {
                for stage in scope.stages.each() {
                    for access in scope.access.each() {
                        let write = access.and(Access::WRITES);
                        let flow =
                            Flow { origin: stage, write, after: Stages::NONE, available: false, visible: Vec::new() };
                        if write.is_empty() {
                            follow(flow, who, writing[written..].iter().copied(), place, objections);
                        } else {
                            follow(flow, who, events[i + 1..].iter(), place, objections);
                        }
                    }
                }
            }
            // A change of layout writes the cell, between the halves of its barrier.
            Event::Barrier(b) if b.from != b.to => {
                let flow = Flow {
                    origin: Stages::NONE,
                    write: Access::STORAGE_WRITE,
                    after: b.dst.stages,
                    available: true,
                    visible: vec![b.dst],
                };
                follow(flow, "the change of layout", events[i + 1..].iter(), place, objections);
            }
            Event::Barrier(_) => {}
        }
    }
}

fn follow<'a>(
    mut flow: Flow,
    who: &str,
    later: impl Iterator<Item = &'a Event<'a>>,
    place: &str,
    objections: &mut Vec<String>,
) {
    for event in later {
        match event {
            Event::Barrier(b) => {
                let reaches = b.src.stages.intersects(flow.origin) || b.src.stages.intersects(flow.after);
                let made = flow.write.is_empty()
                    || flow.available
                    || (b.src.stages.intersects(flow.origin) && b.src.access.contains(flow.write));
                if b.from != b.to && !(reaches && made) {
                    objections.push(format!("{place}: {who} races with the change to {:?} for {}", b.to, b.name));
                }
                flow.pass(b);
            }
            Event::Use { who: then, scope, .. } => {
                let writes = !scope.access.writes().is_empty();
                if flow.write.is_empty() && !writes {
                    continue;
                }
                for stage in scope.stages.each() {
                    if !flow.ordered(stage) {
                        objections.push(format!("{place}: {who} and {then} ({stage:?}) are not ordered"));
                    } else if !flow.write.is_empty() {
                        for access in scope.access.each().filter(|a| !flow.seen_by(stage, *a)) {
                            objections.push(format!("{place}: what {who} wrote is not visible to {then} ({access:?})"));
                        }
                    }
                }
            }
        }
        // A later write that comes after this access, in turn, orders everything behind it.
        if let Event::Use { scope, .. } = event
            && !scope.access.writes().is_empty()
        {
            return;
        }
        if matches!(event, Event::Barrier(b) if b.from != b.to) {
            return;
        }
    }
}

/// Layouts, and whether there is anything to read.
fn contents(events: &[Event], physical: &Physical, place: &str, objections: &mut Vec<String>) {
    let buffer = matches!(physical.shape, Shape::Buffer(_));
    let mut layout = match (physical.rest, physical.contents, &physical.source) {
        _ if buffer => Layout::Buffer,
        (Some(rest), true, _) | (Some(rest), false, Source::History { .. }) => rest,
        _ => Layout::Undefined,
    };
    // Whose data is in there.
    let mut owner = (physical.contents && physical.source != Source::Pool).then(|| physical.occupants[0]);
    for event in events {
        match event {
            Event::Barrier(b) => {
                if b.from == Layout::Undefined {
                    owner = None;
                } else if b.from != layout {
                    objections.push(format!("{place}: a barrier expects {:?}, but it is in {layout:?}", b.from));
                }
                layout = b.to;
            }
            Event::Use { who, scope, resource: Some(resource), layout: wanted } => {
                if wanted.is_some_and(|w| w != layout) {
                    objections.push(format!("{place}: {who} needs {wanted:?}, but it is in {layout:?}"));
                }
                if !scope.access.reads().is_empty() && owner != Some(*resource) {
                    objections.push(format!("{place}: {who} reads what nobody wrote"));
                }
                if !scope.access.writes().is_empty() {
                    owner = Some(*resource);
                }
            }
            Event::Use { .. } => {}
        }
    }
    if let Some(rest) = physical.rest
        && layout != rest
    {
        objections.push(format!("{place}: left in {layout:?}, not in {rest:?}"));
    }
}

/// Two logical resources in one memory must not be in use together.
fn lifetimes(plan: &Plan, objections: &mut Vec<String>) {
    let mut lives: BTreeMap<Resource, (usize, usize)> = BTreeMap::new();
    for (number, pass) in plan.passes.iter().enumerate() {
        for u in &pass.uses {
            lives.entry(u.resource).or_insert((number, number)).1 = number;
        }
    }
    for physical in &plan.physical {
        let lives = physical.occupants.iter().filter_map(|r| Some((*lives.get(r)?, *r)));
        let mut lives: Vec<((usize, usize), Resource)> = lives.collect();
        lives.sort_unstable();
        // Those that have begun, as long as they may go on.
        let mut alive: Vec<((usize, usize), Resource)> = Vec::new();
        for ((first, last), resource) in lives {
            alive.retain(|((_, end), _)| *end >= first);
            for (_, other) in &alive {
                objections.push(format!("{} and {} are in use together", plan.name(resource), plan.name(*other)));
            }
            alive.push(((first, last), resource));
        }
        let host = physical.usage.contains(Usage::HOST);
        if (host || physical.source != Source::Pool) && physical.occupants.len() != 1 {
            objections.push(format!("{} shares its memory", plan.name(physical.occupants[0])));
        }
    }
}
