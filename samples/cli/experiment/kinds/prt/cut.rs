//! Bakes of which only the first vectors are used.
//!
//! The vectors of a bake are ordered by the share that they describe, and the first ones do not depend on the number of those after them. So a bake
//! with many vectors also has the pictures of bakes with fewer. Two things are not exactly those of a bake of its own: the iterations that find the
//! vectors stop at a small error, and the vectors of the receivers were chosen for the light of all vectors.

use half::f16;
use lucerna::{
    Error, Result,
    techniques::prt::{Baking, Stored},
};
use serde::{Deserialize, Serialize};

/// Numbers of vectors that are used; 0: all.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(super) struct Cut {
    /// Vectors of distances, d₁ of the paper.
    pub visibility: u32,
    /// Vectors of direct light, d₂ of the paper.
    pub light: u32,
    /// Vectors of the receivers.
    pub receivers: u32,
}

impl Cut {
    /// # Errors
    /// `Usage` if the bake has fewer vectors.
    pub fn validate(&self, bake: &Baking) -> Result<()> {
        let list = [
            ("visibility", self.visibility, bake.visibility),
            ("light", self.light, bake.light),
            ("receivers", self.receivers, bake.receivers),
        ];
        match list.into_iter().find(|(_, cut, most)| cut > most) {
            Some((name, cut, most)) => {
                Err(Error::usage(format!("cut.{name} is {cut}, allowed are 0 to {most}, the bake's vectors")))
            }
            None => Ok(()),
        }
    }

    /// The bake with these vectors.
    pub fn of(&self, stored: &Stored) -> Stored {
        let mut out = stored.clone();
        if self.visibility > 0 {
            self.distances(&mut out);
        }
        if self.receivers > 0 {
            self.receiving(&mut out);
        }
        if self.light > 0 {
            self.light(stored, &mut out);
        }
        out
    }

    fn distances(&self, out: &mut Stored) {
        out.plan.settings.visibility = self.visibility;
        for visibility in &mut out.visibility {
            let (all, kept) = (visibility.vectors as usize, visibility.vectors.min(self.visibility) as usize);
            visibility.basis = firsts(&visibility.basis, all, kept);
            visibility.coefficients = firsts(&visibility.coefficients, all, kept);
            visibility.vectors = kept as u32;
        }
    }

    fn receiving(&self, out: &mut Stored) {
        out.plan.settings.receivers = self.receivers;
        let vectors = out.plan.all_vectors();
        for transfer in &mut out.transfers {
            let (all, kept) = (transfer.rank as usize, transfer.rank.min(self.receivers) as usize);
            transfer.values = firsts(&transfer.values, all, kept);
            transfer.rows.truncate(kept * vectors);
            transfer.rank = kept as u32;
        }
    }

    /// Drops vectors of light with what they send.
    fn light(&self, before: &Stored, out: &mut Stored) {
        out.plan.settings.light = self.light;
        let all = before.plan.all_vectors();
        // For each vector of all clusters, whether it stays.
        let mut stays = vec![false; all];
        for (cluster, basis) in out.bases.iter_mut().enumerate() {
            let (first, stride) = (before.plan.first_vector(cluster), basis.vectors as usize);
            let kept = out.plan.vectors(cluster).min(stride);
            let mean = basis.centred.then(|| stride - 1);
            let of_light = kept - usize::from(basis.centred);
            let mine = &mut stays[first..first + stride];
            mine.iter_mut().enumerate().for_each(|(at, stays)| *stays = at < of_light || Some(at) == mean);
            basis.values = chosen(&basis.values, mine);
            basis.sizes = chosen(&basis.sizes, mine);
            basis.vectors = kept as u32;
        }
        for transfer in &mut out.transfers {
            transfer.rows = chosen(&transfer.rows, &stays);
            if transfer.rank == 0 {
                transfer.values = chosen(&transfer.values, &stays);
            }
        }
    }
}

/// The first `kept` of each `all` numbers.
fn firsts(list: &[f16], all: usize, kept: usize) -> Vec<f16> {
    list.chunks_exact(all.max(1)).flat_map(|row| row[..kept.min(row.len())].iter().copied()).collect()
}

/// The numbers that stay, of rows as long as `stays`.
fn chosen<T: Copy>(list: &[T], stays: &[bool]) -> Vec<T> {
    list.iter().zip(stays.iter().cycle()).filter(|(_, stays)| **stays).map(|(value, _)| *value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_keep_their_first_numbers() {
        let list: Vec<f16> = (0..6).map(|i| f16::from_f32(i as f32)).collect();
        assert_eq!(firsts(&list, 3, 2), [0.0, 1.0, 3.0, 4.0].map(f16::from_f32));
        assert_eq!(chosen(&[1, 2, 3, 4, 5, 6], &[true, false, true]), [1, 3, 4, 6]);
    }
}
