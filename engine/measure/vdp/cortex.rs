//! The channels of the visual cortex: five octaves in six orientations, and what lies below (Watson 1987, as Daly has it).

use std::f64::consts::PI;

/// Octave bands with orientation.
pub(super) const OCTAVES: usize = 5;
/// Orientations, 30° apart.
pub(super) const ORIENTATIONS: usize = 6;

/// One channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channel {
    /// The octave (0: the finest, up to the limit of the pixels) and the orientation.
    Oriented(usize, usize),
    /// Everything below the octaves.
    Base,
}

/// All 31.
pub(super) fn channels() -> Vec<Channel> {
    let oriented = (0..OCTAVES).flat_map(|k| (0..ORIENTATIONS).map(move |l| Channel::Oriented(k, l)));
    oriented.chain([Channel::Base]).collect()
}

impl Channel {
    /// The largest frequency of the channel; as all here in units of half a cycle a pixel.
    pub(super) fn limit(self) -> f64 {
        match self {
            Self::Oriented(0, _) => f64::INFINITY,
            Self::Oriented(k, _) => edge(half(k - 1)),
            Self::Base => edge(half(OCTAVES - 1)),
        }
    }

    /// Gain at a frequency and an angle in radians. All channels add up to 1.
    pub(super) fn gain(self, frequency: f64, angle: f64) -> f64 {
        match self {
            Self::Oriented(k, l) => {
                let octave = octave(k, frequency);
                if octave == 0.0 { 0.0 } else { octave * fan(l, angle) }
            }
            Self::Base => base(frequency),
        }
    }
}

/// Where the low-pass filter below octave `k` has fallen to a half.
fn half(k: usize) -> f64 {
    0.5_f64.powi(k as i32 + 1)
}

/// Where it has fallen to nothing: its slope is two thirds of that frequency wide.
fn edge(half: f64) -> f64 {
    half * (1.0 + 1.0 / 3.0)
}

fn mesa(half: f64, frequency: f64) -> f64 {
    let width = 2.0 / 3.0 * half;
    let low = half - width / 2.0;
    if frequency <= low {
        1.0
    } else if frequency >= half + width / 2.0 {
        0.0
    } else {
        0.5 * (1.0 + (PI * (frequency - low) / width).cos())
    }
}

fn base(frequency: f64) -> f64 {
    let limit = edge(half(OCTAVES - 1));
    let sigma = limit / 3.0;
    if frequency < limit { (-frequency * frequency / (2.0 * sigma * sigma)).exp() } else { 0.0 }
}

fn octave(k: usize, frequency: f64) -> f64 {
    let above = if k == 0 { 1.0 } else { mesa(half(k - 1), frequency) };
    let below = if k + 1 == OCTAVES { base(frequency) } else { mesa(half(k), frequency) };
    above - below
}

fn fan(l: usize, angle: f64) -> f64 {
    let width = PI / ORIENTATIONS as f64;
    let centre = l as f64 * width - PI / 2.0;
    // Orientation: half a turn is the same.
    let turned = (angle - centre).rem_euclid(PI);
    let distance = turned.min(PI - turned);
    if distance < width { 0.5 * (1.0 + (PI * distance / width).cos()) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_add_up_to_one_everywhere() {
        let channels = channels();
        assert_eq!(channels.len(), 31);
        for i in 0..60 {
            for j in 0..24 {
                let (frequency, angle) = (f64::from(i) / 40.0, f64::from(j) * PI / 12.0 - PI);
                let sum: f64 = channels.iter().map(|c| c.gain(frequency, angle)).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{frequency} {angle}: {sum}");
                let beyond = channels.iter().filter(|c| frequency > c.limit() && c.gain(frequency, angle) != 0.0);
                assert_eq!(beyond.count(), 0);
            }
        }
    }
}
