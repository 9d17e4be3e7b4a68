//! Passes whose invocations loop over many items, cut into dispatches.

/// The items over which each invocation of a pass loops, such as light sources: for [`Graph::compute_over`](super::Graph::compute_over).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Items {
    count: u32,
    rays: u64,
    turns: u64,
}

impl Items {
    /// `count` items. Each takes the time of one ray and one loop iteration, unless [`Self::rays`] and [`Self::turns`] say more.
    pub fn new(count: u32) -> Self {
        Self { count, rays: 1, turns: 1 }
    }

    /// Number of rays that all invocations together trace for one item, or an estimate of their time in rays.
    #[must_use]
    pub fn rays(self, rays: u64) -> Self {
        Self { rays: rays.max(1), ..self }
    }

    /// Number of loop iterations that one item takes in an invocation. It matters for drivers that end long loops
    /// ([`crate::gpu::Gpu::loop_limit`]).
    #[must_use]
    pub fn turns(self, turns: u64) -> Self {
        Self { turns: turns.max(1), ..self }
    }

    /// Rays of all items.
    pub(super) fn all_rays(&self) -> u64 {
        self.rays.saturating_mul(self.count.max(1).into())
    }
}

/// The limits of one dispatch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Approximate number of rays.
    pub rays: u64,
    /// Loop iterations of one invocation. `None`: any number.
    pub turns: Option<u64>,
}

/// The loop of a pass in a graph.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Over {
    pub items: Items,
    /// Byte offsets of the first item and of the number of items in the push constants.
    pub range: [usize; 2],
}

/// One dispatch of a pass with a loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Piece {
    pub first: u32,
    pub count: u32,
    pub rays: u64,
}

impl Over {
    /// The dispatches. They depend on the limits alone and not on measured times, so the sums that the invocations build from them are the
    /// same in each run.
    pub fn pieces(self, limits: Limits) -> impl Iterator<Item = Piece> {
        let Items { count, rays, turns } = self.items;
        let long = limits.turns.map_or(u64::MAX, |most| most / turns);
        let each = (limits.rays / rays).min(long).clamp(1, u32::MAX.into()) as u32;
        (0..count.max(1)).step_by(each as usize).map(move |first| {
            let count = each.min(count - first.min(count));
            Piece { first, count, rays: rays.saturating_mul(count.into()) }
        })
    }

    /// The push constants `push` of a piece.
    pub fn set(self, push: &mut [u8], piece: Piece) {
        for (offset, value) in self.range.into_iter().zip([piece.first, piece.count]) {
            if let Some(bytes) = push.get_mut(offset..offset + 4) {
                bytes.copy_from_slice(&value.to_ne_bytes());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pieces(items: Items, rays: u64, turns: Option<u64>) -> Vec<(u32, u32)> {
        let over = Over { items, range: [0, 4] };
        over.pieces(Limits { rays, turns }).map(|piece| (piece.first, piece.count)).collect()
    }

    #[test]
    fn dispatches_hold_every_item_once_and_stay_below_both_limits() {
        assert_eq!(pieces(Items::new(10), 100, None), [(0, 10)]);
        assert_eq!(pieces(Items::new(10).rays(25), 100, None), [(0, 4), (4, 4), (8, 2)]);
        assert_eq!(pieces(Items::new(10).rays(25).turns(30), 100, Some(100)), [(0, 3), (3, 3), (6, 3), (9, 1)]);
        // An item above a limit has a dispatch of its own.
        assert_eq!(pieces(Items::new(2).rays(u64::MAX), 100, None), [(0, 1), (1, 1)]);
        assert_eq!(pieces(Items::new(2).turns(101), 100, Some(100)), [(0, 1), (1, 1)]);
        // A pass without items still writes its images.
        assert_eq!(pieces(Items::new(0), 100, None), [(0, 0)]);
        assert_eq!(pieces(Items::new(u32::MAX), u64::MAX, None), [(0, u32::MAX)]);
    }

    #[test]
    fn the_push_constants_name_the_range() {
        let over = Over { items: Items::new(9), range: [4, 12] };
        let mut push = [7u8; 16];
        over.set(&mut push, Piece { first: 3, count: 5, rays: 5 });
        let words: [u32; 4] = bytemuck::cast(push);
        assert_eq!(words, [0x0707_0707, 3, 0x0707_0707, 5]);
    }
}
