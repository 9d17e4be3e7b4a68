//! Work on several threads whose results do not depend on how many there are.

use std::num::NonZero;

/// As many as the machine has, unless told.
pub(super) fn threads(wanted: Option<usize>) -> usize {
    wanted.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, NonZero::get)).clamp(1, 64)
}

/// Fills `out` row by row: `row` gets the number of a row and its `stride` values.
pub(super) fn rows<T: Send>(threads: usize, out: &mut [T], stride: usize, row: impl Fn(usize, &mut [T]) + Sync) {
    rows_with(threads, out, stride, || (), |(), y, values| row(y, values));
}

/// As [`rows`], with something that each thread makes for itself, such as room to work in.
pub(super) fn rows_with<T: Send, S>(
    threads: usize,
    out: &mut [T],
    stride: usize,
    start: impl Fn() -> S + Sync,
    row: impl Fn(&mut S, usize, &mut [T]) + Sync,
) {
    let stride = stride.max(1);
    let count = out.len() / stride;
    let each = count.div_ceil(threads.max(1)).max(1);
    std::thread::scope(|scope| {
        for (part, values) in out.chunks_mut(each * stride).enumerate() {
            let (start, row) = (&start, &row);
            let mut work = move || {
                let mut own = start();
                for (i, values) in values.chunks_exact_mut(stride).enumerate() {
                    row(&mut own, part * each + i, values);
                }
            };
            // The last part (or the only one) needs no thread of its own.
            if (part + 1) * each >= count { work() } else { drop(scope.spawn(work)) }
        }
    });
}

/// As [`rows`], `height` rows at a time (the last band may have fewer): `band` gets the number of its first row.
pub(super) fn bands<T: Send>(
    threads: usize,
    out: &mut [T],
    stride: usize,
    height: usize,
    band: impl Fn(usize, &mut [T]) + Sync,
) {
    let (stride, height) = (stride.max(1), height.max(1));
    let count = (out.len() / stride).div_ceil(height);
    let each = count.div_ceil(threads.max(1)).max(1) * height;
    std::thread::scope(|scope| {
        for (part, values) in out.chunks_mut(each * stride).enumerate() {
            let band = &band;
            scope.spawn(move || {
                for (i, values) in values.chunks_mut(height * stride).enumerate() {
                    band(part * each + i * height, values);
                }
            });
        }
    });
}

/// `count` results in order.
pub(super) fn list<T: Send + Default>(threads: usize, count: usize, one: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let mut out: Vec<T> = std::iter::repeat_with(T::default).take(count).collect();
    rows(threads, &mut out, 1, |i, slot| slot[0] = one(i));
    out
}

/// Sum over pixels: each row by itself, then the rows in order.
pub(super) fn sum<const N: usize>(
    threads: usize,
    [width, height]: [usize; 2],
    pixel: impl Fn(usize) -> [f64; N] + Sync,
) -> [f64; N]
where
    [f64; N]: Default,
{
    let add = |total: [f64; N], value: [f64; N]| std::array::from_fn(|k| total[k] + value[k]);
    let rows = list(threads, height, |y| (y * width..(y + 1) * width).map(&pixel).fold([0.0; N], add));
    rows.into_iter().fold([0.0; N], add)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_once_whatever_the_number_of_threads() {
        for threads in [1, 2, 3, 7, 64] {
            for count in [0, 1, 2, 5, 13] {
                let mut out = vec![0; count * 3];
                rows(threads, &mut out, 3, |y, row| row.iter_mut().for_each(|v| *v += y + 1));
                let expected: Vec<usize> = (1..=count).flat_map(|y| [y; 3]).collect();
                assert_eq!(out, expected);
                assert_eq!(list(threads, count, |i| i), (0..count).collect::<Vec<_>>());
            }
            let total = sum(threads, [17, 11], |i| [1.0 / (i as f64 + 1.0)]);
            assert_eq!(total, sum(1, [17, 11], |i| [1.0 / (i as f64 + 1.0)]));
        }
    }
}
