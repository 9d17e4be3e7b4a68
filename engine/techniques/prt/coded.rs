//! Lists of numbers as little-endian bytes, for units and files.

use half::f16;

use super::{
    links::Links,
    transfer::{Basis, Transfer},
    visibility::Visibility,
};
use crate::{Error, Result};

/// Writes lists with their lengths.
#[derive(Debug, Default)]
pub(super) struct Writer(pub Vec<u8>);

impl Writer {
    pub fn word(&mut self, value: u32) {
        self.0.extend(value.to_le_bytes());
    }

    pub fn float(&mut self, value: f32) {
        self.word(value.to_bits());
    }

    pub fn floats(&mut self, list: &[f32]) {
        self.word(list.len() as u32);
        list.iter().for_each(|value| self.float(*value));
    }

    pub fn halves(&mut self, list: &[f16]) {
        self.word(list.len() as u32);
        list.iter().for_each(|value| self.0.extend(value.to_le_bytes()));
    }

    pub fn words(&mut self, list: &[u32]) {
        self.word(list.len() as u32);
        list.iter().for_each(|value| self.word(*value));
    }

    pub fn shorts(&mut self, list: &[u16]) {
        self.word(list.len() as u32);
        list.iter().for_each(|value| self.0.extend(value.to_le_bytes()));
    }

    /// A bit for each number, and the numbers that are not 0.
    pub fn sparse(&mut self, list: &[f16]) {
        self.word(list.len() as u32);
        for eight in list.chunks(8) {
            let bits = eight.iter().enumerate().filter(|(_, value)| **value != f16::ZERO);
            self.0.push(bits.fold(0u8, |bits, (at, _)| bits | 1 << at));
        }
        list.iter().filter(|value| **value != f16::ZERO).for_each(|value| self.0.extend(value.to_le_bytes()));
    }
}

/// Reads the lists of a [`Writer`].
#[derive(Debug)]
pub(super) struct Reader<'a>(pub &'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, bytes: usize) -> Result<&'a [u8]> {
        let (taken, rest) =
            self.0.split_at_checked(bytes).ok_or_else(|| Error::input("a list is longer than the data"))?;
        self.0 = rest;
        Ok(taken)
    }

    pub fn word(&mut self) -> Result<u32> {
        let bytes = self.take(4)?;
        Ok(u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
    }

    pub fn float(&mut self) -> Result<f32> {
        let value = f32::from_bits(self.word()?);
        if value.is_finite() { Ok(value) } else { Err(Error::input("a number is not finite")) }
    }

    pub fn floats(&mut self) -> Result<Vec<f32>> {
        let count = self.word()? as usize;
        let bytes = self.take(count.saturating_mul(4))?;
        let list: Vec<f32> = bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        finite(list, f32::is_finite)
    }

    pub fn halves(&mut self) -> Result<Vec<f16>> {
        let count = self.word()? as usize;
        let bytes = self.take(count.saturating_mul(2))?;
        finite(bytes.chunks_exact(2).map(|b| f16::from_le_bytes([b[0], b[1]])).collect(), f16::is_finite)
    }

    pub fn words(&mut self) -> Result<Vec<u32>> {
        let count = self.word()? as usize;
        let bytes = self.take(count.saturating_mul(4))?;
        Ok(bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
    }

    pub fn shorts(&mut self) -> Result<Vec<u16>> {
        let count = self.word()? as usize;
        let bytes = self.take(count.saturating_mul(2))?;
        Ok(bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect())
    }

    pub fn sparse(&mut self) -> Result<Vec<f16>> {
        let count = self.word()? as usize;
        let bits = self.take(count.div_ceil(8))?;
        let there: usize = bits.iter().map(|bits| bits.count_ones() as usize).sum();
        let mut values = self.take(2 * there)?.chunks_exact(2).map(|b| f16::from_le_bytes([b[0], b[1]]));
        let next = |at: usize| match bits[at / 8] >> (at % 8) & 1 {
            1 => values.next().unwrap_or(f16::ZERO),
            _ => f16::ZERO,
        };
        finite((0..count).map(next).collect(), f16::is_finite)
    }

    pub fn end(&self) -> Result<()> {
        if self.0.is_empty() { Ok(()) } else { Err(Error::input("has something after its end")) }
    }
}

fn finite<T: Copy>(list: Vec<T>, is: impl Fn(T) -> bool) -> Result<Vec<T>> {
    if list.iter().all(|value| is(*value)) { Ok(list) } else { Err(Error::input("a number is not finite")) }
}

/// Checks the length of a list.
fn long(what: &str, found: usize, wanted: usize) -> Result<()> {
    if found == wanted {
        return Ok(());
    }
    Err(Error::input(format!("{found} numbers of {what}, {wanted} are needed")))
}

impl Visibility {
    pub(super) fn write(&self, out: &mut Writer) {
        out.word(self.vectors);
        out.float(self.error);
        out.halves(&self.mean);
        out.halves(&self.basis);
        out.halves(&self.coefficients);
    }

    /// Reads the distances of a cluster.
    pub(super) fn read(from: &mut Reader<'_>, samples: usize, directions: usize) -> Result<Self> {
        let (vectors, error) = (from.word()?, from.float()?);
        let out = Self { vectors, error, mean: from.halves()?, basis: from.halves()?, coefficients: from.halves()? };
        long("mean distances", out.mean.len(), directions)?;
        long("vectors of distances", out.basis.len(), directions.saturating_mul(vectors as usize))?;
        long("coefficients of distances", out.coefficients.len(), samples.saturating_mul(vectors as usize))?;
        Ok(out)
    }
}

impl Basis {
    pub(super) fn write(&self, out: &mut Writer) {
        out.word(u32::from(self.centred));
        out.floats(&self.sizes);
        out.halves(&self.values);
    }

    /// Reads the basis of a cluster.
    pub(super) fn read(from: &mut Reader<'_>, samples: usize, vectors: usize) -> Result<Self> {
        let centred = from.word()? == 1;
        let (sizes, values) = (from.floats()?, from.halves()?);
        long("sizes of vectors", sizes.len(), vectors)?;
        long("vectors of light", values.len(), samples.saturating_mul(vectors))?;
        Ok(Self { vectors: vectors as u32, values, sizes, centred })
    }
}

impl Transfer {
    pub(super) fn write(&self, out: &mut Writer) {
        out.word(self.rank);
        out.float(self.left);
        out.float(self.lost);
        out.floats(&self.rows);
        if self.rank > 0 || self.values.is_empty() {
            out.halves(&self.values)
        } else {
            out.sparse(&self.values)
        }
        self.links.write(out);
        out.words(&self.met);
    }

    /// Reads the transfer to a cluster. `all`: vectors of light; `senders`: samples of the bake; `kept`: rays of each sample.
    pub(super) fn read(
        from: &mut Reader<'_>,
        samples: usize,
        [all, senders, kept]: [usize; 3],
        low_rank: bool,
    ) -> Result<Self> {
        let (rank, left, lost, rows) = (from.word()?, from.float()?, from.float()?, from.floats()?);
        let values = if low_rank && rank == 0 || rank > 0 { from.halves()? } else { from.sparse()? };
        let links = Links::read(from, samples, senders)?;
        let out = Self { rank, rows, values, left, lost, links, met: from.words()? };
        long("samples that rays meet", out.met.len(), samples.saturating_mul(kept))?;
        long("rows of receivers", out.rows.len(), all.saturating_mul(rank as usize))?;
        let stride = if low_rank { rank as usize } else { all };
        long("transferred light", out.values.len(), samples.saturating_mul(stride))?;
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_come_back_and_cut_ones_are_refused() {
        let list: Vec<f16> = (0..21).map(|i| f16::from_f32(if i % 3 == 0 { i as f32 } else { 0.0 })).collect();
        let mut writer = Writer::default();
        writer.sparse(&list);
        writer.halves(&list);
        writer.floats(&[1.0, 2.0]);
        let mut reader = Reader(&writer.0);
        assert_eq!(reader.sparse().unwrap(), list);
        assert_eq!(reader.halves().unwrap(), list);
        assert_eq!(reader.floats().unwrap(), [1.0, 2.0]);
        reader.end().unwrap();
        for cut in 0..writer.0.len() {
            let mut reader = Reader(&writer.0[..cut]);
            let read = reader.sparse().and_then(|_| reader.halves()).and_then(|_| reader.floats());
            assert_eq!(read.unwrap_err().exit_code(), 3, "{cut}");
        }
        assert!(Reader(&[255; 12]).halves().is_err() && Reader(&[255; 12]).sparse().is_err());
    }
}
