//! The sRGB transfer function (IEC 61966-2-1), in this one place for the whole engine.

/// Linear to encoded, both in [0, 1]. Values outside continue the curve; negative values are mirrored.
pub fn encode(linear: f32) -> f32 {
    let x = linear.abs();
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    encoded.copysign(linear)
}

/// Encoded to linear; the inverse of [`encode`].
pub fn decode(encoded: f32) -> f32 {
    let x = encoded.abs();
    let linear = if x <= 0.040_45 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) };
    linear.copysign(encoded)
}

/// Linear to the nearest 8-bit code; clamps to [0, 1], NaN becomes 0.
pub fn encode_u8(linear: f32) -> u8 {
    // `as` saturates and turns NaN into 0.
    (encode(linear.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8
}

/// Linear to the nearest 16-bit code; clamps to [0, 1], NaN becomes 0.
pub fn encode_u16(linear: f32) -> u16 {
    (encode(linear.clamp(0.0, 1.0)) * 65535.0 + 0.5) as u16
}

/// 8-bit code to linear.
pub fn decode_u8(code: u8) -> f32 {
    decode(f32::from(code) / 255.0)
}

/// 16-bit code to linear.
pub fn decode_u16(code: u16) -> f32 {
    decode(f32::from(code) / 65535.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        // IEC 61966-2-1: mid grey 0.5 encoded is 0.21404 linear; 18 % grey is code 118.
        assert!((decode(0.5) - 0.214_041_14).abs() < 1e-6);
        assert_eq!(encode_u8(0.18), 118);
        assert_eq!((encode_u8(0.0), encode_u8(1.0)), (0, 255));
        assert_eq!((encode_u8(-3.0), encode_u8(7.0), encode_u8(f32::NAN)), (0, 255, 0));
        assert_eq!((encode_u16(f32::NAN), encode_u16(f32::INFINITY)), (0, 65535));
    }

    #[test]
    fn all_codes_survive_a_round_trip() {
        assert!((0..=255).all(|code| encode_u8(decode_u8(code)) == code));
        assert!((0..=65535).all(|code| encode_u16(decode_u16(code)) == code));
    }

    #[test]
    fn encoding_rises_and_the_two_pieces_meet() {
        let values: Vec<f32> = (0..=4096).map(|i| encode(i as f32 / 4096.0)).collect();
        assert!(values.windows(2).all(|pair| pair[0] < pair[1]));
        assert!((encode(0.003_130_9) - encode(0.003_130_7)).abs() < 1e-5);
    }
}
