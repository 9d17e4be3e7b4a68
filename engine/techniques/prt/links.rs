//! Links: pairs of samples that see much of each other. Their light is transferred as is, not by vectors.
//!
//! Vectors describe smooth light well. The light of a bright spot beside a sample is not smooth, and few vectors cannot describe such a spot at every
//! place. A link carries it as the rays have met it, and vectors carry the light of all other pairs (a sparse matrix beside one of low rank). The paper has no links.

use super::coded::{Reader, Writer};
use crate::{Error, Result};

/// The links of the samples of a cluster: for each sample the samples that fill much of its hemisphere.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Links {
    /// The first link of each sample, and the end of all; empty if no sample of the cluster has links.
    pub starts: Vec<u32>,
    /// Numbers of the samples that send light, ascending for each receiver.
    pub senders: Vec<u32>,
    /// Rays of the receiver that meet the sender.
    pub rays: Vec<u16>,
}

impl Links {
    /// The links of a sample: the sender, and the share of the receiver's hemisphere that it fills, weighted by the cosine. `rays`: of each sample.
    pub fn of(&self, sample: usize, rays: u32) -> impl Iterator<Item = (usize, f32)> + '_ {
        let bound = |at: usize| self.starts.get(at).copied().unwrap_or(0) as usize;
        let range = bound(sample)..bound(sample + 1);
        let scale = 1.0 / rays as f32;
        self.senders[range.clone()]
            .iter()
            .zip(&self.rays[range])
            .map(move |(sender, met)| (*sender as usize, f32::from(*met) * scale))
    }

    /// Bytes in files.
    pub fn bytes(&self) -> u64 {
        4 * self.starts.len() as u64 + 6 * self.senders.len() as u64
    }

    /// Adds the links of the next sample: `seen` are the samples that its rays meet, sorted. Calls `rest` with each other sample, and with the number
    /// of rays that meet this one. `least`: rays of a link.
    pub(super) fn add(&mut self, seen: &[u32], least: usize, mut rest: impl FnMut(usize, usize)) {
        if self.starts.is_empty() {
            self.starts.push(0);
        }
        for same in seen.chunk_by(|a, b| a == b) {
            match u16::try_from(same.len()) {
                Ok(rays) if same.len() >= least && same[0] < crate::shaders::consts::PRT_LOST => {
                    self.senders.push(same[0]);
                    self.rays.push(rays);
                }
                _ => rest(same[0] as usize, same.len()),
            }
        }
        self.starts.push(self.senders.len() as u32);
    }

    pub(super) fn write(&self, out: &mut Writer) {
        out.words(&self.starts);
        out.words(&self.senders);
        out.shorts(&self.rays);
    }

    /// Reads the links of a cluster. `samples`: of the cluster; `all`: of the bake.
    pub(super) fn read(from: &mut Reader<'_>, samples: usize, all: usize) -> Result<Self> {
        let out = Self { starts: from.words()?, senders: from.words()?, rays: from.shorts()? };
        let count = out.senders.len();
        if out == Self::default() {
            return Ok(out);
        }
        let whole = [out.starts.first(), out.starts.last()] == [Some(&0), Some(&(count as u32))];
        let rising = out.starts.windows(2).all(|pair| pair[0] <= pair[1]);
        let known = out.senders.iter().all(|sender| (*sender as usize) < all);
        if !whole || !rising || !known || out.starts.len() != samples + 1 || out.rays.len() != count {
            return Err(Error::input("its links are not those of its samples"));
        }
        Ok(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn links() -> (Links, Vec<(usize, usize)>) {
        let mut links = Links::default();
        let mut rest = Vec::new();
        let lost = crate::shaders::consts::PRT_LOST;
        links.add(&[1, 1, 1, 4, 4, 7, lost, lost, lost], 3, |sample, rays| rest.push((sample, rays)));
        links.add(&[], 3, |sample, rays| rest.push((sample, rays)));
        links.add(&[0, 2, 2, 2, 2, 2], 3, |sample, rays| rest.push((sample, rays)));
        (links, rest)
    }

    #[test]
    fn every_ray_is_in_a_link_or_in_the_rest() {
        let (links, rest) = links();
        assert_eq!(links.starts, [0, 1, 1, 2]);
        assert_eq!(links.of(0, 10).collect::<Vec<_>>(), [(1, 0.3)]);
        assert_eq!(links.of(1, 10).count(), 0);
        assert_eq!(links.of(2, 10).collect::<Vec<_>>(), [(2, 0.5)]);
        let lost = crate::shaders::consts::PRT_LOST as usize;
        assert_eq!(rest, [(4, 2), (7, 1), (lost, 3), (0, 1)]);
    }

    #[test]
    fn links_come_back_and_wrong_ones_are_refused() {
        let (links, _) = links();
        let written = |links: &Links| {
            let mut out = Writer::default();
            links.write(&mut out);
            out.0
        };
        let read = |bytes: &[u8], samples: usize, all: usize| Links::read(&mut Reader(bytes), samples, all);
        let bytes = written(&links);
        assert_eq!(read(&bytes, 3, 8).unwrap(), links);
        let none = Links::default();
        assert_eq!(read(&written(&none), 3, 8).unwrap(), none);
        assert_eq!(none.of(2, 10).count(), 0);
        assert!(read(&bytes, 3, 2).is_err() && read(&bytes, 4, 8).is_err());
        for wrong in [
            Links { starts: vec![0, 2, 1, 2], ..links.clone() },
            Links { starts: vec![0, 1, 1, 1], ..links.clone() },
            Links { rays: vec![3], ..links.clone() },
        ] {
            assert_eq!(read(&written(&wrong), 3, 8).unwrap_err().exit_code(), 3);
        }
    }
}
