//! A resource cut into cells along every level, layer or byte at which some use begins or ends.

use std::collections::HashMap;

use super::vocab::Region;

/// The cells of a physical resource.
pub(super) struct Grid {
    a: Vec<u64>,
    b: Vec<u64>,
}

impl Grid {
    /// `whole`, cut along the borders of `regions`.
    pub fn new<'a>(whole: &Region, regions: impl Iterator<Item = &'a Region>) -> Self {
        let (mut a, mut b) = (vec![whole.a.0, whole.a.1], vec![whole.b.0, whole.b.1]);
        for r in regions {
            a.extend([r.a.0, r.a.1]);
            b.extend([r.b.0, r.b.1]);
        }
        for cuts in [&mut a, &mut b] {
            cuts.sort_unstable();
            cuts.dedup();
        }
        Self { a, b }
    }

    /// Cells.
    pub fn len(&self) -> usize {
        (self.a.len() - 1) * self.columns()
    }

    /// Cells side by side.
    fn columns(&self) -> usize {
        self.b.len() - 1
    }

    /// Numbers of the cells of `region`.
    pub fn cells(&self, region: &Region) -> impl Iterator<Item = usize> + use<> {
        let at = |cuts: &[u64], v: u64| cuts.partition_point(|c| *c < v);
        let (a0, a1) = (at(&self.a, region.a.0), at(&self.a, region.a.1));
        let (b0, b1) = (at(&self.b, region.b.0), at(&self.b, region.b.1));
        let columns = self.columns();
        (a0..a1).flat_map(move |a| (b0..b1).map(move |b| a * columns + b))
    }

    /// `cells` (ascending) as few rectangles.
    pub fn rectangles(&self, cells: &[usize]) -> Vec<Region> {
        let columns = self.columns();
        let mut runs: Vec<(usize, usize, usize)> = Vec::new();
        for cell in cells {
            let (a, b) = (cell / columns, cell % columns);
            match runs.last_mut() {
                Some((row, _, end)) if *row == a && *end == b => *end = b + 1,
                _ => runs.push((a, b, b + 1)),
            }
        }
        // (first row, end row, first column, end column)
        let mut boxes: Vec<(usize, usize, usize, usize)> = Vec::new();
        // By where they end and their columns.
        let mut open: HashMap<(usize, usize, usize), usize> = HashMap::new();
        for (row, begin, end) in runs {
            let number = open.remove(&(row, begin, end)).unwrap_or_else(|| {
                boxes.push((row, row, begin, end));
                boxes.len() - 1
            });
            boxes[number].1 = row + 1;
            open.insert((row + 1, begin, end), number);
        }
        boxes
            .iter()
            .map(|(r0, r1, c0, c1)| Region { a: (self.a[*r0], self.a[*r1]), b: (self.b[*c0], self.b[*c1]) })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_come_back_as_few_rectangles() {
        let part = |a: (u64, u64), b: (u64, u64)| Region { a, b };
        let grid = Grid::new(&part((0, 4), (0, 6)), [part((1, 2), (0, 6)), part((0, 4), (2, 3))].iter());
        assert_eq!(grid.len(), 9, "three rows of three");
        let all: Vec<usize> = grid.cells(&part((0, 4), (0, 6))).collect();
        assert_eq!(grid.rectangles(&all), [part((0, 4), (0, 6))]);
        let column: Vec<usize> = grid.cells(&part((0, 4), (2, 3))).collect();
        assert_eq!(grid.rectangles(&column), [part((0, 4), (2, 3))]);
        // An L: the upper row, and the first cell of the next.
        let mut corner: Vec<usize> = grid.cells(&part((0, 1), (0, 6))).collect();
        corner.extend(grid.cells(&part((1, 2), (0, 2))));
        assert_eq!(grid.rectangles(&corner), [part((0, 1), (0, 6)), part((1, 2), (0, 2))]);
    }
}
