//! Cuts long work into submissions that no watchdog kills.
//!
//! Operating systems reset a GPU that works for seconds on one submission (2 s by default on Windows), and nothing else is
//! drawn meanwhile. Work that may take long (bakes, reference renderings) goes in tiles: the first ones are small, and their
//! measured times decide the size of the next.

use std::{ops::Range, time::Duration};

/// Plans the tiles of `total` items of work.
///
/// ```
/// use lucerna::gpu::Tiles;
/// use std::time::Duration;
/// let mut tiles = Tiles::new(1_000_000, 64);
/// while let Some(tile) = tiles.next_tile() {
///     // … submit the items `tile` and wait …
///     # let _ = tile;
///     tiles.took(Duration::from_millis(8));
/// }
/// ```
#[derive(Clone, Debug)]
pub struct Tiles {
    total: u64,
    begun: u64,
    /// Items of the next tile, a multiple of `granule`.
    size: u64,
    /// Items of the last tile.
    last: u64,
    granule: u64,
    most: u64,
    aim: Duration,
}

/// What a tile should take.
const AIM: Duration = Duration::from_millis(30);
/// A tile is at most this many times as large as the one before.
const GROWTH: u64 = 4;

impl Tiles {
    /// Tiles of `total` items, each a multiple of `granule` items (a workgroup) except perhaps the last; the first is one
    /// granule.
    pub fn new(total: u64, granule: u32) -> Self {
        let granule = u64::from(granule.max(1));
        Self { total, begun: 0, size: granule, last: 0, granule, most: u64::MAX / 2, aim: AIM }
    }

    /// No tile has more than `items` (but at least one granule): for limits of dispatch sizes, or of loop turns.
    #[must_use]
    pub fn at_most(mut self, items: u64) -> Self {
        self.most = items.max(self.granule);
        self
    }

    /// What a tile should take, instead of 30 ms.
    #[must_use]
    pub fn aim(mut self, aim: Duration) -> Self {
        self.aim = aim;
        self
    }

    /// The first tile has about `items` items: a size that suited work of the same kind before ([`Tiles::size`]).
    #[must_use]
    pub fn first(mut self, items: u64) -> Self {
        self.size = (items.min(self.most) / self.granule * self.granule).max(self.granule);
        self
    }

    /// Goes on after `items` that an earlier run has done.
    #[must_use]
    pub fn after(mut self, items: u64) -> Self {
        self.begun = items.min(self.total);
        self
    }

    /// The next tile; `None` when all are begun.
    pub fn next_tile(&mut self) -> Option<Range<u64>> {
        if self.begun == self.total {
            return None;
        }
        let begin = self.begun;
        self.last = self.size.min(self.total - begin);
        self.begun += self.last;
        Some(begin..self.begun)
    }

    /// Says how long the last tile took, from submission to completion.
    pub fn took(&mut self, time: Duration) {
        let nanos = time.as_nanos().max(1);
        let ideal = u128::from(self.last.max(1)) * self.aim.as_nanos() / nanos;
        let next = u64::try_from(ideal).unwrap_or(u64::MAX).min(self.last.saturating_mul(GROWTH)).min(self.most);
        self.size = (next / self.granule * self.granule).max(self.granule);
    }

    /// Items that the next tile is to have.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// Share of the items begun so far, 0 to 1.
    pub fn progress(&self) -> f64 {
        if self.total == 0 { 1.0 } else { self.begun as f64 / self.total as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: Duration = Duration::from_millis(100);

    /// Runs a plan on a device that takes `nanos(item)` for each item; gives the tiles and the longest time.
    fn run(mut tiles: Tiles, nanos: impl Fn(u64) -> u64) -> (Vec<Range<u64>>, Duration) {
        let mut all = Vec::new();
        let mut longest = Duration::ZERO;
        while let Some(tile) = tiles.next_tile() {
            let time = Duration::from_nanos(tile.clone().map(&nanos).sum());
            longest = longest.max(time);
            tiles.took(time);
            all.push(tile);
        }
        assert_eq!(tiles.progress(), 1.0);
        (all, longest)
    }

    fn check_cover(tiles: &[Range<u64>], total: u64) {
        let mut at = 0;
        for tile in tiles {
            assert_eq!(tile.start, at);
            assert!(tile.end > tile.start);
            at = tile.end;
        }
        assert_eq!(at, total);
    }

    #[test]
    fn every_item_is_in_one_tile_and_no_tile_takes_long() {
        for nanos in [1, 100, 10_000, 700_000] {
            let (tiles, longest) = run(Tiles::new(100_003, 64), |_| nanos);
            check_cover(&tiles, 100_003);
            assert!(longest <= LIMIT, "{longest:?} at {nanos} ns an item");
            assert!(tiles.iter().rev().skip(1).all(|t| (t.end - t.start) % 64 == 0));
            // Not needlessly many either: work of a second is done in some tens of submissions.
            let whole = Duration::from_nanos(100_003 * nanos);
            assert!(tiles.len() as f64 <= whole.as_secs_f64() / AIM.as_secs_f64() * 1.2 + 12.0, "{}", tiles.len());
        }
    }

    #[test]
    fn items_that_grow_dearer_make_tiles_smaller() {
        // From 10 µs to 10 ms an item.
        let nanos = |i: u64| 10_000 * 2_u64.pow((i / 2_000) as u32);
        let (tiles, longest) = run(Tiles::new(20_000, 1), nanos);
        check_cover(&tiles, 20_000);
        // A tile over a step cannot know of it; the aim leaves room for that.
        assert!(longest <= LIMIT, "{longest:?}");
        let last = tiles.iter().rev().nth(1).unwrap();
        assert!(last.end - last.start <= 10, "{last:?}");
    }

    #[test]
    fn limits_and_resumption_hold() {
        let (tiles, _) = run(Tiles::new(1000, 8).at_most(100).after(120), |_| 1);
        assert_eq!(tiles[0], 120..128);
        assert_eq!(tiles.last().unwrap().end, 1000);
        assert!(tiles.iter().all(|t| t.end - t.start <= 100));
        assert_eq!(run(Tiles::new(1000, 8).at_most(100).first(4000), |_| 1).0[0], 0..96);
        assert_eq!(Tiles::new(1000, 8).first(3).size(), 8);
        assert_eq!(run(Tiles::new(0, 8), |_| 1).0, []);
        assert_eq!(run(Tiles::new(5, 8).after(9), |_| 1).0, []);
    }
}
