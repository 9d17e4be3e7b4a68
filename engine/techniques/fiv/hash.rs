//! Hashes that identify the inputs of a file and detect damaged files. They give no security.

/// A 64-bit hash over words.
#[derive(Clone, Debug)]
pub(crate) struct Hash(u64);

impl Hash {
    pub fn new() -> Self {
        Self(0x9E37_79B9_7F4A_7C15)
    }

    pub fn word(&mut self, word: u64) {
        self.0 = (self.0 ^ word).wrapping_mul(0xD6E8_FEB8_6659_FD93);
        self.0 ^= self.0 >> 32;
    }

    pub fn floats(&mut self, values: &[f32]) {
        values.iter().for_each(|value| self.word(value.to_bits().into()));
    }

    /// Includes the number of bytes, so that bytes after the end change the hash.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.word(bytes.len() as u64);
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.word(u64::from_le_bytes(word));
        }
    }

    pub fn finish(&self) -> u64 {
        self.0
    }
}
