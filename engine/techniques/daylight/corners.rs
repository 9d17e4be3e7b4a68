//! Where the triangles of a scene are in a lightmap.

use glam::Vec2;

/// Parts of a texel in which corners are stored.
const PARTS: f32 = 16.0;
/// The place of a back that has none.
pub(super) const NOWHERE: [u16; 6] = [u16::MAX; 6];
/// Bytes of the corners of a front in a file.
const OF_FRONT: u64 = 12;
/// Bytes of the corners of a back, with the number of its triangle.
const OF_BACK: u64 = 16;

/// The corners of triangles in sixteenths of a texel: x and y of three corners.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Corners {
    /// All triangles of instance 0, then of instance 1, and so on.
    pub fronts: Vec<[u16; 6]>,
    /// The numbers of the triangles whose backs have texels of their own, ascending, and the corners of their backs; other backs have no light. `None`:
    /// the backs of all two-sided triangles show the light of the fronts.
    pub backs: Option<Vec<(u32, [u16; 6])>>,
}

impl Corners {
    pub fn is_empty(&self) -> bool {
        self.fronts.is_empty()
    }

    /// Whether any back has texels of its own.
    pub fn has_backs(&self) -> bool {
        self.backs.as_ref().is_some_and(|backs| !backs.is_empty())
    }

    /// The corners of all fronts, and then of all backs if any has texels, as the device reads them (`daylight/place.vert`).
    pub(super) fn listed(&self) -> Vec<[u16; 6]> {
        let mut all = self.fronts.clone();
        if let Some(backs) = self.backs.as_ref().filter(|backs| !backs.is_empty()) {
            all.resize(2 * self.fronts.len(), NOWHERE);
            for (triangle, corners) in backs {
                all[self.fronts.len() + *triangle as usize] = *corners;
            }
        }
        all
    }

    /// The bytes in a file: six numbers of 16 bits for each front, and for each back the number of its triangle, 32 bits, before such numbers.
    pub(super) fn encode(&self) -> Vec<u8> {
        let mut out = Vec::new();
        self.fronts.iter().flatten().for_each(|number| out.extend(number.to_le_bytes()));
        for (triangle, corners) in self.backs.iter().flatten() {
            out.extend(triangle.to_le_bytes());
            corners.iter().for_each(|number| out.extend(number.to_le_bytes()));
        }
        out
    }

    /// The number of those bytes.
    pub(super) fn bytes(fronts: u64, backs: Option<u64>) -> u64 {
        fronts.saturating_mul(OF_FRONT).saturating_add(backs.unwrap_or(0).saturating_mul(OF_BACK))
    }

    /// Reads those bytes. `fronts`, `backs`: their numbers.
    ///
    /// # Errors
    /// A sentence that names the first number that is impossible.
    pub(super) fn decode(bytes: &[u8], fronts: u64, backs: Option<u64>) -> Result<Self, String> {
        let numbers = |bytes: &[u8]| std::array::from_fn(|i| u16::from_le_bytes([bytes[2 * i], bytes[2 * i + 1]]));
        let (of_fronts, of_backs) = bytes.split_at((OF_FRONT * fronts).min(bytes.len() as u64) as usize);
        let back = |bytes: &[u8; OF_BACK as usize]| {
            let [a, b, c, d, ..] = *bytes;
            (u32::from_le_bytes([a, b, c, d]), numbers(&bytes[4..]))
        };
        let out = Self {
            fronts: of_fronts.chunks_exact(OF_FRONT as usize).map(numbers).collect(),
            backs: backs.map(|_| of_backs.as_chunks().0.iter().map(back).collect()),
        };
        out.check().map(|()| out)
    }

    /// Checks places and numbers of triangles.
    ///
    /// # Errors
    /// A sentence that names the first one that is impossible.
    fn check(&self) -> Result<(), String> {
        let (count, backs) = (self.fronts.len() as u32, self.backs.as_deref().unwrap_or_default());
        if let Some((triangle, _)) = backs.iter().find(|(triangle, _)| *triangle >= count) {
            return Err(format!("has a place for the back of triangle {triangle}, of {count}"));
        }
        if let Some(pair) = backs.windows(2).find(|pair| pair[0].0 >= pair[1].0) {
            return Err(format!("has the back of triangle {} after that of {}", pair[1].0, pair[0].0));
        }
        let mut sides = self.fronts.iter().chain(backs.iter().map(|(_, corners)| corners));
        match sides.position(|corners| *corners == NOWHERE) {
            Some(at) => Err(format!("has no place for triangle {at}, fronts before backs")),
            None => Ok(()),
        }
    }
}

/// Corners as they are stored.
pub(super) fn sixteenths([a, b, c]: [Vec2; 3]) -> [u16; 6] {
    if !a.is_finite() {
        return NOWHERE;
    }
    [a.x, a.y, b.x, b.y, c.x, c.y].map(|value| (value * PARTS).round().clamp(0.0, 65535.0) as u16)
}

/// Corners in texels; infinite for a back without texels.
pub fn position(corners: [u16; 6]) -> [Vec2; 3] {
    if corners == NOWHERE {
        return [Vec2::INFINITY; 3];
    }
    let at = |i: usize| Vec2::new(f32::from(corners[2 * i]), f32::from(corners[2 * i + 1])) / PARTS;
    [at(0), at(1), at(2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_come_back_and_impossible_triangles_are_named() {
        let place = |at: u16| [at, 0, at + 16, 0, at, 16];
        let backs = vec![(0, place(112)), (2, place(144))];
        let corners = Corners { fronts: vec![place(16), place(48), place(80)], backs: Some(backs) };
        let bytes = corners.encode();
        assert_eq!(bytes.len() as u64, Corners::bytes(3, Some(2)));
        assert_eq!(Corners::decode(&bytes, 3, Some(2)).as_ref(), Ok(&corners));
        assert_eq!(corners.listed()[3..], [place(112), NOWHERE, place(144)]);
        for backs in [None, Some(Vec::new())] {
            let without = Corners { backs, ..corners.clone() };
            assert_eq!(without.listed().len(), 3);
            let count = without.backs.as_ref().map(|_| 0);
            assert_eq!(Corners::decode(&without.encode(), 3, count), Ok(without));
        }
        let error = |fronts: &[[u16; 6]], backs: &[(u32, [u16; 6])]| {
            let wrong = Corners { fronts: fronts.to_vec(), backs: Some(backs.to_vec()) };
            Corners::decode(&wrong.encode(), fronts.len() as u64, Some(backs.len() as u64)).unwrap_err()
        };
        let fronts = &corners.fronts;
        assert!(error(fronts, &[(3, place(112))]).contains("back of triangle 3, of 3"));
        for wrong in [[2, 0], [1, 1]] {
            let said = error(fronts, &wrong.map(|triangle| (triangle, place(112))));
            assert!(said.contains(&format!("triangle {} after that of {}", wrong[1], wrong[0])), "{said}");
        }
        assert!(error(&[place(16), NOWHERE], &[]).contains("no place for triangle 1"));
        assert!(error(fronts, &[(1, NOWHERE)]).contains("no place for triangle 3"));
    }

    #[test]
    fn places_are_stored_in_sixteenths_of_a_texel() {
        let corners = [Vec2::new(4.0, 8.5), Vec2::new(4091.0, 8.5), Vec2::new(4.0, 9.0625)];
        assert_eq!(position(sixteenths(corners)), corners);
        assert_eq!(sixteenths([Vec2::INFINITY; 3]), NOWHERE);
        assert!(!position(NOWHERE)[0].is_finite());
    }
}
