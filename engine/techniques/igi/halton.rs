//! The Halton sequence (Halton 1960), from which light paths take their quasi-random numbers as in the paper. The host computes it.

/// Bases of the sequence, one for each dimension.
const PRIMES: [u32; 24] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71, 73, 79, 83, 89];

/// Number of dimensions.
pub const DIMENSIONS: usize = PRIMES.len();

/// Radical inverse: the digits of `index` in `base`, mirrored at the radix point. In [0, 1). The value is exact but for one final
/// rounding.
pub fn radical_inverse(base: u32, index: u32) -> f64 {
    let (base, mut rest) = (u64::from(base.max(2)), u64::from(index));
    // The denominator is at most 2³² · base and fits into 64 bits, so that integer arithmetic is exact.
    let (mut mirrored, mut scale) = (0u64, 1u64);
    while rest > 0 {
        mirrored = mirrored * base + rest % base;
        scale *= base;
        rest /= base;
    }
    mirrored as f64 / scale as f64
}

/// The first `paths` points of the sequence, row by row: `paths` × `dimensions` numbers in [0, 1). The first point has index 1, because
/// the point with index 0 is 0 in every dimension. A seed other than 0 adds an offset to each dimension, modulo 1 (Cranley and
/// Patterson 1976); the mean over all seeds is then unbiased. Dimensions beyond [`DIMENSIONS`] repeat the last base.
pub fn table(paths: u32, dimensions: usize, seed: u32) -> Vec<f32> {
    table_from(0, paths, dimensions, seed)
}

/// Like [`table`], but the first point has index `first` + 1. Indices wrap around at 2³².
pub fn table_from(first: u32, paths: u32, dimensions: usize, seed: u32) -> Vec<f32> {
    let shifts: Vec<f64> = (0..dimensions).map(|dimension| shift(seed, dimension as u32)).collect();
    let mut out = Vec::with_capacity(paths as usize * dimensions);
    for path in 0..paths {
        for (dimension, shift) in shifts.iter().enumerate() {
            let base = PRIMES[dimension.min(DIMENSIONS - 1)];
            let value = (radical_inverse(base, first.wrapping_add(path).wrapping_add(1)) + shift).fract() as f32;
            // Rounding to 32 bits may yield 1, which is outside of the range.
            out.push(value.min(1.0 - f32::EPSILON / 2.0));
        }
    }
    out
}

/// Offset between the first points of consecutive frames: the smallest number from `paths` on that has no common factor with the bases
/// of the first `dimensions`. Path i of all frames then uses every digit in each base, and every combination of digits in several bases:
/// its points over the frames are as evenly distributed as the sequence. With an offset of 720, for example, the first four binary digits
/// of path i would be the same in all frames.
pub fn step(paths: u32, dimensions: usize) -> u32 {
    let bases = &PRIMES[..dimensions.min(DIMENSIONS)];
    (paths..).find(|step| *step > 0 && bases.iter().all(|base| step % base != 0)).unwrap_or(paths)
}

/// Offset of the Cranley-Patterson rotation for a dimension, in [0, 1); 0 for seed 0.
pub fn shift(seed: u32, dimension: u32) -> f64 {
    if seed == 0 {
        return 0.0;
    }
    // SplitMix64 (Steele, Lea and Flood 2014).
    let mut z = (u64::from(seed) << 32 | u64::from(dimension)).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ z >> 31) >> 11) as f64 / (1u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_values_are_exact() {
        let first = |base, values: &[(u32, u32)]| {
            for (i, (a, b)) in values.iter().enumerate() {
                assert_eq!(radical_inverse(base, i as u32), f64::from(*a) / f64::from(*b), "number {i} of base {base}");
            }
        };
        first(2, &[(0, 1), (1, 2), (1, 4), (3, 4), (1, 8), (5, 8), (3, 8), (7, 8), (1, 16)]);
        first(3, &[(0, 1), (1, 3), (2, 3), (1, 9), (4, 9), (7, 9), (2, 9), (5, 9), (8, 9), (1, 27)]);
        first(5, &[(0, 1), (1, 5), (2, 5), (3, 5), (4, 5), (1, 25)]);
        // The extremes: 32 ones in base 2, and the largest digit of the largest base.
        assert_eq!(radical_inverse(2, u32::MAX), f64::from(u32::MAX) / 4294967296.0);
        assert_eq!(radical_inverse(89, 88), 88.0 / 89.0);
        let row = &table(2, 4, 0)[4..];
        assert_eq!(row, [0.25, 2.0 / 3.0, 2.0 / 5.0, 2.0 / 7.0]);
    }

    #[test]
    fn every_elementary_box_holds_its_share() {
        // Of 2^a 3^b consecutive points, exactly one lies in each box of 2^-a × 3^-b, for any first point. In three dimensions the
        // boxes are 2^-a × 3^-b × 5^-c.
        for (a, b, c) in [(1u32, 1u32, 0u32), (3, 2, 0), (5, 1, 0), (2, 4, 0), (3, 2, 1), (2, 1, 2)] {
            let sides = [2u32.pow(a), 3u32.pow(b), 5u32.pow(c)];
            let count: u32 = sides.iter().product();
            for start in [0u32, 1, 17, 100_000] {
                let mut hits = vec![0u32; count as usize];
                for i in start..start + count {
                    let cell = |k: usize| {
                        // Integer arithmetic on the mirrored digits avoids the rounding of their quotient.
                        let (base, digits) = ([2u32, 3, 5][k], [a, b, c][k]);
                        let (mut rest, mut out) = (i, 0);
                        for _ in 0..digits {
                            out = out * base + rest % base;
                            rest /= base;
                        }
                        let value = radical_inverse(base, i) * f64::from(sides[k]);
                        assert!((value - 1e-9).floor() as i64 <= i64::from(out) && value < f64::from(out) + 1.0 + 1e-9);
                        out
                    };
                    hits[((cell(2) * sides[1] + cell(1)) * sides[0] + cell(0)) as usize] += 1;
                }
                assert!(hits.iter().all(|&h| h == 1), "2^{a} 3^{b} 5^{c} from {start}: {hits:?}");
            }
        }
    }

    #[test]
    fn a_path_comes_by_every_elementary_box_over_the_frames() {
        for (paths, dimensions) in [(1u32, 6), (16, 6), (720, 8), (90, 8), (30_030, 20), (640_000, 20)] {
            let step = step(paths, dimensions);
            assert!(step >= paths && step - paths < 200, "{paths}: {step}");
            // Boxes of five binary digits, of three ternary digits, and of both.
            for box_count in [32u32, 27, 32 * 27] {
                for path in [0, paths - 1] {
                    let mut seen = vec![false; box_count as usize];
                    (0..box_count).for_each(|frame| seen[((frame * step + path) % box_count) as usize] = true);
                    assert!(seen.iter().all(|&s| s), "{paths} paths, path {path}: some of {box_count} are never met");
                }
            }
        }
        assert_eq!((step(720, 8), step(0, 4)), (727, 1));
        // Indices wrap around at 2^32.
        assert_eq!(table_from(u32::MAX - 1, 3, 1, 0)[1..], [0.0, 0.5]);
    }

    #[test]
    fn seeds_turn_and_numbers_stay_below_one() {
        assert_eq!((shift(0, 3), table(0, 4, 1).len()), (0.0, 0));
        let (plain, turned) = (table(500, 6, 0), table(500, 6, 9));
        for i in 0..plain.len() {
            assert!((0.0..1.0).contains(&turned[i]));
            let apart = (f64::from(turned[i]) - f64::from(plain[i]) - shift(9, i as u32 % 6)).rem_euclid(1.0);
            assert!(!(1e-6..=1.0 - 1e-6).contains(&apart), "{apart}");
        }
        assert_ne!(table(4, 2, 1), table(4, 2, 2));
        // Consecutive parts of the table are the whole table.
        assert_eq!([table_from(0, 3, 4, 5), table_from(3, 7, 4, 5)].concat(), table(10, 4, 5));
    }
}
