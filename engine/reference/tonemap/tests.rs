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

/// Luminances over thirteen decades, the borders of the pieces among them.
fn luminances() -> impl Iterator<Item = f64> {
    (0..=1300).map(|i| 10f64.powf(f64::from(i) * 0.01 - 7.0)).chain([0.0034, 1.0, 7.2444])
}

#[test]
fn capacity_is_continuous_and_the_integral_of_one_over_the_threshold() {
    use super::ashikhmin::{capacity, threshold};
    for border in [0.0034, 1.0, 7.2444] {
        let step = capacity(border * (1.0 + 1e-12)) - capacity(border * (1.0 - 1e-12));
        // The paper rounds its constants to four places: 0.0034 / 0.0014 = 2.42857 against 2.4483.
        assert!(step.abs() < 0.021, "C jumps by {step} at {border}");
    }
    for l in luminances() {
        let h = l * 1e-6;
        if [0.0034, 1.0, 7.2444].iter().all(|border: &f64| (border - l).abs() > 2.0 * h) {
            let slope = (capacity(l + h) - capacity(l - h)) / (2.0 * h);
            assert!((slope * threshold(l) - 1.0).abs() < 1e-6, "TVI is not 1 / C' at {l}: {slope}");
        }
    }
    let rising: Vec<f64> = { let mut l: Vec<f64> = luminances().collect(); l.sort_by(f64::total_cmp); l };
    assert!(rising.windows(2).all(|p| capacity(p[0]) < capacity(p[1]) || p[0] == p[1]), "C does not rise");
}
