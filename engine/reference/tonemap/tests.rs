use super::plane::{Plane, gaussian};

#[test]
fn averages_along_both_axes_are_the_definition() {
    let plane = Plane::from_fn(13, 9, |x, y| ((x * 7 + y * 13) % 11) as f64 + 0.1);
    let weights = gaussian(1.7, 5);
    let averages = plane.averages(&weights);
    for y in 0..9 {
        for x in 0..13 {
            assert!((averages[(x, y)] - plane.average(x, y, &weights)).abs() < 1e-12);
        }
    }
}
