//! `--exposure auto`: how bright a picture is, as a camera would measure it.

use lucerna::techniques::tonemap::Operator;

/// What the measured luminance becomes.
const MIDDLE_GREY: f64 = 0.18;
/// Pixels brighter than this share of all do not count more than the darkest of them: lamps and the sun.
const LAMPS: f64 = 0.01;

/// Stops that make the picture's middle an 18 % grey: of 1, or for an operator that works in cd/m², of a screen's 100.
///
/// The middle is the geometric mean of the log-average, which shadows govern, and the mean, which lights govern. 0 for black pictures.
pub fn stops(pixels: &[[f32; 4]], operator: Operator) -> f32 {
    let luminance = pixels.iter().map(|[r, g, b, _]| 0.2126 * r + 0.7152 * g + 0.0722 * b);
    let mut lit: Vec<f32> = luminance.filter(|l| l.is_finite() && *l > 0.0).collect();
    if lit.is_empty() {
        return 0.0;
    }
    let bright = ((1.0 - LAMPS) * (lit.len() - 1) as f64) as usize;
    let most = *lit.select_nth_unstable_by(bright, f32::total_cmp).1;
    // Sums in an order that the selection does not decide.
    let values = || pixels.iter().map(|[r, g, b, _]| 0.2126 * r + 0.7152 * g + 0.0722 * b);
    let counted = || values().filter(|l| l.is_finite() && *l > 0.0).map(|l| f64::from(l.min(most)));
    let count = lit.len() as f64;
    let log_average = counted().map(f64::log2).sum::<f64>() / count;
    let average = (counted().sum::<f64>() / count).log2();
    let unit = if operator == Operator::Ashikhmin { 100.0 } else { 1.0 };
    // Tenths of a stop: nobody sees less.
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
