//! `--exposure auto`: an exposure from the picture's brightness, like that of a camera.

use lucerna::techniques::tonemap::Operator;

/// Luminance to which the middle of the picture is mapped.
const MIDDLE_GREY: f64 = 0.18;
/// Share of the brightest pixels, such as lamps and the sun. Their luminance is clamped to the darkest of them.
const LAMPS: f64 = 0.01;

/// The exposure, in stops, that maps the picture's middle to 18 % of white. White is 1, or 100 cd/m² for an operator that works in cd/m². 0
/// for black pictures.
///
/// The middle is the geometric mean of two values: the log-average, which depends mostly on the shadows, and the mean, which depends mostly on
/// the lights.
pub fn stops(pixels: &[[f32; 4]], operator: Operator) -> f32 {
    let luminance = pixels.iter().map(|[r, g, b, _]| 0.2126 * r + 0.7152 * g + 0.0722 * b);
    let mut lit: Vec<f32> = luminance.filter(|l| l.is_finite() && *l > 0.0).collect();
    if lit.is_empty() {
        return 0.0;
    }
    let bright = ((1.0 - LAMPS) * (lit.len() - 1) as f64) as usize;
    let most = *lit.select_nth_unstable_by(bright, f32::total_cmp).1;
    // The sums go over the pixels in their order, because the selection has reordered `lit`.
    let values = || pixels.iter().map(|[r, g, b, _]| 0.2126 * r + 0.7152 * g + 0.0722 * b);
    let counted = || values().filter(|l| l.is_finite() && *l > 0.0).map(|l| f64::from(l.min(most)));
    let count = lit.len() as f64;
    let log_average = counted().map(f64::log2).sum::<f64>() / count;
    let average = (counted().sum::<f64>() / count).log2();
    let unit = if operator == Operator::Ashikhmin { 100.0 } else { 1.0 };
    // Rounded to tenths of a stop; smaller differences are not visible.
    (((MIDDLE_GREY * unit).log2() - 0.5 * (log_average + average)) * 10.0).round() as f32 / 10.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_cards_and_lamps() {
        let grey = |value: f32| [value, value, value, 1.0];
        assert_eq!(stops(&[grey(0.18); 50], Operator::Agx), 0.0);
        assert_eq!(stops(&[grey(0.18 * 8.0); 50], Operator::Agx), -3.0);
        assert!((stops(&[grey(18.0); 50], Operator::Ashikhmin)).abs() < 0.05);
        assert_eq!(stops(&[grey(0.0), grey(f32::NAN), grey(-1.0)], Operator::Linear), 0.0);
        // A lamp in the picture does not make the rest dark.
        let mut room = vec![grey(0.18); 1000];
        room[500] = grey(1e6);
        assert_eq!(stops(&room, Operator::Agx), 0.0);
    }
}
