//! An independent check of a plan, by brute force: for every cell of every physical resource, every pair of accesses of
//! which one writes must be ordered by a chain of barriers on that very cell, what is written must be available and visible
//! where it is used next, every use must find its layout and its contents.
//!
//! It shares no code with the planner but the plain data. It is stricter than Vulkan in one point: a barrier on one resource
//! orders nothing on another, so that each barrier must be there for its own reason.

use std::collections::BTreeSet;

use super::{
    plan::{Barrier, Physical, Plan, Shape, Source},
    vocab::{Access, Layout, Region, Resource, Scope, Stages, Usage},
};

/// Something that happens to a cell.
enum Event<'a> {
    Use { who: String, scope: Scope, resource: Option<Resource>, layout: Option<Layout> },
    Barrier(&'a Barrier),
}

/// Every objection to `plan`; none: it is right.
pub fn check(plan: &Plan) -> Vec<String> {
    let mut objections = Vec::new();
    for index in 0..plan.physical.len() {
        objections.extend(check_one(plan, index));
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
    let mut objections = Vec::new();
    let physical = &plan.physical[index];
    for cell in cells(plan, index, physical) {
        let events = timeline(plan, index, physical, &cell);
        let place = format!("{} {cell:?}", plan.name(physical.occupants[0]));
        hazards(&events, &place, &mut objections);
        contents(&events, physical, &place, &mut objections);
    }
    objections
}

/// Regions inside of which every use and barrier covers all or nothing.
fn cells(plan: &Plan, index: usize, physical: &Physical) -> Vec<Region> {
    let (a_end, b_end) = match physical.shape {
        Shape::Image(desc) => (desc.mips.into(), desc.layers.into()),
        Shape::Buffer(bytes) => (bytes.max(1), 1),
    };
    let (mut a, mut b) = (BTreeSet::from([0, a_end]), BTreeSet::from([0, b_end]));
    let uses = plan.passes.iter().flat_map(|p| &p.uses).filter(|u| physical.occupants.contains(&u.resource));
    let barriers = plan.barriers.iter().filter(|b| b.physical == index);
    for region in uses.map(|u| &u.region).chain(barriers.map(|b| &b.region)) {
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
fn timeline<'a>(plan: &'a Plan, index: usize, physical: &Physical, cell: &Region) -> Vec<Event<'a>> {
    let earlier = Scope { stages: Stages::ALL, access: Access::WRITES };
    let mut events = vec![Event::Use { who: "earlier frames".into(), scope: earlier, resource: None, layout: None }];
    let barriers = |events: &mut Vec<Event<'a>>, before: usize| {
        let here = plan.barriers.iter().filter(|b| b.before == before && b.physical == index);
        events.extend(here.filter(|b| b.region.overlaps(cell)).map(Event::Barrier));
    };
    let mut used = false;
    for (number, pass) in plan.passes.iter().enumerate() {
        barriers(&mut events, number);
        for u in &pass.uses {
            if plan.physical_of(u.resource) == Some(index) && u.region.overlaps(cell) {
                used = true;
                events.push(Event::Use {
                    who: format!("`{}` as `{}`", pass.name, u.role),
                    scope: u.scope,
                    resource: Some(u.resource),
                    layout: Some(u.layout),
                });
            }
        }
    }
    barriers(&mut events, plan.passes.len());
    if physical.usage.contains(Usage::HOST) && used {
        let scope = Scope { stages: Stages::HOST, access: Access::HOST_READ };
        events.push(Event::Use { who: "the host".into(), scope, resource: Some(physical.occupants[0]), layout: None });
    }
    events
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
    for (i, first) in events.iter().enumerate() {
        match first {
            Event::Use { who, scope, .. } => {
                for stage in scope.stages.each() {
                    for access in scope.access.each() {
                        let write = access.and(Access::WRITES);
                        let flow =
                            Flow { origin: stage, write, after: Stages::NONE, available: false, visible: Vec::new() };
                        follow(flow, who, &events[i + 1..], place, objections);
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
                follow(flow, "the change of layout", &events[i + 1..], place, objections);
            }
            Event::Barrier(_) => {}
        }
    }
}

fn follow(mut flow: Flow, who: &str, later: &[Event], place: &str, objections: &mut Vec<String>) {
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
    let life = |resource: Resource| {
        let used = |p: &super::plan::PlannedPass| p.uses.iter().any(|u| u.resource == resource);
        let first = plan.passes.iter().position(used);
        let last = plan.passes.iter().rposition(used);
        first.zip(last)
    };
    for physical in &plan.physical {
        for (i, a) in physical.occupants.iter().enumerate() {
            for b in &physical.occupants[..i] {
                if let (Some((a0, a1)), Some((b0, b1))) = (life(*a), life(*b))
                    && a0 <= b1
                    && b0 <= a1
                {
                    objections.push(format!("{} and {} are in use together", plan.name(*a), plan.name(*b)));
                }
            }
        }
        let host = physical.usage.contains(Usage::HOST);
        if (host || physical.source != Source::Pool) && physical.occupants.len() != 1 {
            objections.push(format!("{} shares its memory", plan.name(physical.occupants[0])));
        }
    }
}
