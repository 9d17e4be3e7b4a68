//! A deterministic skyline packer for rectangles.

/// A rectangle to place, in blocks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Item {
    /// The width in blocks.
    pub(super) width: u32,
    /// The height in blocks.
    pub(super) height: u32,
}

/// The place of a rectangle, in blocks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Place {
    /// The left edge.
    pub(super) x: u32,
    /// The top edge.
    pub(super) y: u32,
    /// Whether the rectangle is turned by 90 degrees.
    pub(super) turned: bool,
}

/// A finished packing, in blocks.
pub(super) struct Packing {
    /// The used width.
    pub(super) width: u32,
    /// The used height.
    pub(super) height: u32,
    /// The place of every rectangle, in the order of the input.
    pub(super) places: Vec<Place>,
}

impl Packing {
    /// Gives the longer side.
    pub(super) fn side(&self) -> u32 {
        self.width.max(self.height)
    }
}

/// Packs rectangles into an area that is as square as possible.
///
/// It tries several widths. `limit` is the largest wanted side in blocks; the result is larger if nothing fits.
pub(super) fn pack(items: &[Item], limit: u32) -> Packing {
    let order = placing_order(items);
    let area: u64 = items.iter().map(|item| u64::from(item.width) * u64::from(item.height)).sum();
    let longest = items.iter().map(|item| item.width.max(item.height)).max().unwrap_or(1);
    let side = (area as f64).sqrt();
    // A large input packs well with every width.
    let steps: &[f64] =
        if items.len() > 20_000 { &[1.02, 1.06] } else { &[1.0, 1.02, 1.04, 1.07, 1.1, 1.15, 1.2, 1.3] };
    let mut widths: Vec<u32> = steps.iter().map(|step| ((side * step).ceil() as u32).max(longest).max(1)).collect();
    widths.dedup();
    let mut best: Option<Packing> = None;
    let better = |new: &Packing, old: &Option<Packing>| {
        let rank = |p: &Packing| (p.side(), u64::from(p.width) * u64::from(p.height));
        old.as_ref().is_none_or(|old| rank(new) < rank(old))
    };
    for &width in &widths {
        let packing = skyline(items, &order, width);
        if better(&packing, &best) {
            best = Some(packing);
        }
    }
    let best = best.expect("at least one width is tried");
    if best.side() > limit && longest <= limit && !widths.contains(&limit) {
        let packing = skyline(items, &order, limit);
        if packing.side() < best.side() {
            return packing;
        }
    }
    best
}

/// Gives the order of placing: the longest rectangles first.
fn placing_order(items: &[Item]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..items.len() as u32).collect();
    order.sort_by_key(|&index| {
        let item = items[index as usize];
        let (long, short) = (item.width.max(item.height), item.width.min(item.height));
        (std::cmp::Reverse(long), std::cmp::Reverse(short), index)
    });
    order
}

/// One step of the skyline: everything above `y` is free from `x` for `width`.
#[derive(Clone, Copy)]
struct Step {
    x: u32,
    y: u32,
    width: u32,
}

/// Places rectangles at the lowest possible height, then as far left as possible.
fn skyline(items: &[Item], order: &[u32], width: u32) -> Packing {
    let mut steps = vec![Step { x: 0, y: 0, width }];
    let mut places = vec![Place::default(); items.len()];
    let (mut used_width, mut used_height) = (0, 0);
    for &index in order {
        let item = items[index as usize];
        let upright = lowest(&steps, item.width, item.height);
        let turned = if item.width == item.height { None } else { lowest(&steps, item.height, item.width) };
        let (fit, is_turned) = match (upright, turned) {
            (Some(a), Some(b)) if b < a => (b, true),
            (Some(a), _) => (a, false),
            (None, Some(b)) => (b, true),
            (None, None) => unreachable!("a width below the longest side is never tried"),
        };
        let (w, h) = if is_turned { (item.height, item.width) } else { (item.width, item.height) };
        let (top, _, first) = fit;
        let x = steps[first].x;
        places[index as usize] = Place { x, y: top - h, turned: is_turned };
        used_width = used_width.max(x + w);
        used_height = used_height.max(top);
        raise(&mut steps, first, w, top);
    }
    Packing { width: used_width, height: used_height, places }
}

/// Finds the place with the lowest top edge: the top edge, the wasted area below, the first step.
fn lowest(steps: &[Step], width: u32, height: u32) -> Option<(u32, u64, usize)> {
    let end = steps.last().map_or(0, |step| step.x + step.width);
    let mut best: Option<(u32, u64, usize)> = None;
    for (first, step) in steps.iter().enumerate() {
        if step.x + width > end {
            break;
        }
        if best.is_some_and(|(top, ..)| step.y + height > top) {
            continue;
        }
        let mut y = step.y;
        for under in &steps[first..] {
            if under.x >= step.x + width {
                break;
            }
            y = y.max(under.y);
            if best.is_some_and(|(top, ..)| y + height > top) {
                break;
            }
        }
        if best.is_some_and(|(top, ..)| y + height > top) {
            continue;
        }
        let mut waste = 0;
        for under in &steps[first..] {
            let covered = (step.x + width).min(under.x + under.width).saturating_sub(under.x);
            if covered == 0 {
                break;
            }
            waste += u64::from(covered) * u64::from(y - under.y);
        }
        let fit = (y + height, waste, first);
        if best.is_none_or(|old| fit < old) {
            best = Some(fit);
        }
    }
    best
}

/// Raises the skyline to `top` for `width` from the step `first` on.
fn raise(steps: &mut Vec<Step>, first: usize, width: u32, top: u32) {
    let x = steps[first].x;
    let end = x + width;
    let mut last = first;
    while last < steps.len() && steps[last].x + steps[last].width <= end {
        last += 1;
    }
    if let Some(cut) = steps.get_mut(last)
        && cut.x < end
    {
        cut.width -= end - cut.x;
        cut.x = end;
    }
    steps.splice(first..last, [Step { x, y: top, width }]);
    // Neighbours of equal height become one step.
    if first + 1 < steps.len() && steps[first + 1].y == top {
        steps[first].width += steps[first + 1].width;
        steps.remove(first + 1);
    }
    if first > 0 && steps[first - 1].y == top {
        steps[first - 1].width += steps[first].width;
        steps.remove(first);
    }
}
