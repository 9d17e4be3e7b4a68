//! How Luminance HDR 2.6.1 finds local adaptation for Ashikhmin's operator, where that differs from the paper: with a pyramid in place of
//! Gaussians, and another end of its search. With this in place of the twin's, both agree, which shows that nothing else differs.

use lucerna::reference::tonemap::plane::Plane;

/// The weights of the pyramid (Burt and Adelson 1983, a = 0.4) along one axis.
const WEIGHTS: [f64; 5] = [0.05, 0.25, 0.4, 0.25, 0.05];

/// Half the size by the 5 × 5 kernel.
fn half(fine: &Plane) -> Plane {
    Plane::from_fn(fine.width / 2, fine.height / 2, |x, y| {
        let (x, y) = (2 * x as isize - 2, 2 * y as isize - 2);
        let row = |j: isize| (0..5).map(|i| WEIGHTS[i as usize] * fine.clamped(x + i, y + j)).sum::<f64>();
        (0..5).map(|j| WEIGHTS[j as usize] * row(j)).sum()
    })
}

/// A level of Ashikhmin's pyramid: its samples, and how many of them there are to a pixel.
struct Level {
    plane: Plane,
    per_pixel: f64,
}

impl Level {
    /// Bilinear at a pixel; along the last row and column, only along it.
    fn read(&self, x: usize, y: usize) -> f64 {
        let last = [self.plane.width - 1, self.plane.height - 1];
        let place = [x, y].map(|p| p as f64 * self.per_pixel);
        let [i, j] = place.map(|p| p as usize);
        let (u, v) = (place[0].fract(), place[1].fract());
        let (i, u) = if i < last[0] { (i, u) } else { (last[0], 0.0) };
        let (j, v) = if j < last[1] { (j, v) } else { (last[1], 0.0) };
        let at = |i: usize, j: usize| self.plane[(i.min(last[0]), j.min(last[1]))];
        (1.0 - v) * ((1.0 - u) * at(i, j) + u * at(i + 1, j)) + v * ((1.0 - u) * at(i, j + 1) + u * at(i + 1, j + 1))
    }
}

/// The nearest sample to the upper left; what should be of the last row or column is the last corner's.
fn nearest(plane: &Plane, x: f64, y: f64) -> f64 {
    let (x, y, w, h) = (x as usize, y as usize, plane.width, plane.height);
    match (x + 1 < w, y + 1 < h) {
        (true, true) => plane[(x, y)],
        (true, false) if y >= h => plane[(x, h - 1)],
        (false, true) if x >= w => plane[(w - 1, y)],
        _ => plane[(w - 1, h - 1)],
    }
}

/// Averages of "kernel sizes" 1 to 20: 1 is the image, 5, 10 and 20 are levels of a pyramid, the others lie between them.
fn levels(luminance: &Plane) -> Vec<Level> {
    let mut made = vec![(1usize, luminance.clone())];
    for size in [5, 10, 20] {
        made.push((size, half(&made.last().unwrap().1)));
    }
    let mut levels = Vec::new();
    for (k, pair) in made.windows(2).enumerate() {
        let [(small, fine), (large, coarse)] = pair else { unreachable!() };
        for size in *small..*large {
            let share = 1.0 - 0.5 * (size - small) as f64 / (large - small) as f64;
            let extent = [fine.width, fine.height].map(|n| (n as f64 * share) as usize);
            let plane = if size == *small {
                fine.clone()
            } else {
                Plane::from_fn(extent[0], extent[1], |x, y| {
                    let top = nearest(coarse, (x as f64 / (2.0 * share)).floor(), (y as f64 / (2.0 * share)).floor());
                    let bottom = nearest(fine, (x as f64 / share).floor(), (y as f64 / share).floor());
                    (1.0 - share) * top + share * bottom
                })
            };
            levels.push(Level { plane, per_pixel: share * 0.5f64.powi(k as i32) });
        }
    }
    let (_, last) = made.pop().unwrap();
    levels.push(Level { plane: last, per_pixel: 0.125 });
    levels
}

/// Local adaptation of its Ashikhmin: the first average that is not even, where the paper has the last that is.
pub fn ashikhmin(luminance: &Plane, contrast: f64) -> Plane {
    let levels = levels(luminance);
    assert_eq!(levels.len(), 20);
    Plane::from_fn(luminance.width, luminance.height, |x, y| {
        let mut level = 0.0;
        for s in 1..=10 {
            level = levels[s - 1].read(x, y);
            if (level - levels[2 * s - 1].read(x, y)).abs() >= contrast * level {
                break;
            }
        }
        level
    })
}
