//! A keypoint budget that is spread over the image.

use crate::Keypoint;

/// Cells along the longer side of the image.
const CELLS: usize = 16;

/// Chooses keypoints; keeps its memory from image to image.
#[derive(Debug, Default)]
pub struct Budget {
    cells: Vec<u32>,
    ranks: Vec<u32>,
    order: Vec<u32>,
}

impl Budget {
    /// Indices, ascending, of at most `budget` keypoints: the strongest of each cell of a grid.
    /// 0 keeps all.
    ///
    /// Keeping the strongest of the whole image instead would let a busy background crowd out a
    /// weakly textured object. `size`: width and height of the image [px].
    pub fn spread(
        &mut self,
        keypoints: &[Keypoint],
        budget: usize,
        size: (usize, usize),
    ) -> &[u32] {
        self.order.clear();
        self.order.extend(0..keypoints.len() as u32);
        if budget == 0 || keypoints.len() <= budget {
            return &self.order;
        }
        self.rank(keypoints, size);
        let (ranks, order) = (&self.ranks, &mut self.order);
        // Low ranks are kept everywhere first.
        order.sort_unstable_by(|&a, &b| {
            let rank = |i: u32| ranks[i as usize];
            rank(a).cmp(&rank(b)).then(stronger(keypoints, a, b))
        });
        order.truncate(budget);
        order.sort_unstable();
        order
    }

    /// Ranks each keypoint within its cell, the strongest first.
    fn rank(&mut self, keypoints: &[Keypoint], (width, height): (usize, usize)) {
        let side = width.max(height) as f32 / CELLS as f32;
        let columns = (width as f32 / side).ceil() as u32;
        // `as` saturates: what lies left of the image is in its first column.
        let cell = |k: &Keypoint| (k.y / side) as u32 * columns + (k.x / side) as u32;
        self.cells.clear();
        self.cells.extend(keypoints.iter().map(cell));
        let cells = &self.cells;
        self.order.sort_unstable_by(|&a, &b| {
            let cell = |i: u32| cells[i as usize];
            cell(a).cmp(&cell(b)).then(stronger(keypoints, a, b))
        });
        self.ranks.clear();
        self.ranks.resize(keypoints.len(), 0);
        for pair in self.order.windows(2) {
            let (before, at) = (pair[0] as usize, pair[1] as usize);
            if cells[before] == cells[at] {
                self.ranks[at] = self.ranks[before] + 1;
            }
        }
    }
}

/// Strongest first; of equals, the one that comes first.
fn stronger(keypoints: &[Keypoint], a: u32, b: u32) -> std::cmp::Ordering {
    let response = |i: u32| keypoints[i as usize].response;
    response(b).total_cmp(&response(a)).then(a.cmp(&b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keypoint(x: f32, y: f32, response: f32) -> Keypoint {
        Keypoint {
            x,
            y,
            scale: 4.0,
            angle: 0.0,
            response,
            sign: 0,
        }
    }

    /// A crowd of strong keypoints in a corner, ten weak ones along the opposite side.
    fn crowded() -> Vec<Keypoint> {
        let crowd = (0..1000).map(|i| keypoint((i % 30) as f32, (i / 40) as f32, 100.0 + i as f32));
        let few = (0..10).map(|i| keypoint(64.0 * i as f32 + 3.0, 470.0, 1.0));
        crowd.chain(few).collect()
    }

    #[test]
    fn a_budget_that_is_not_reached_keeps_all() {
        let mut budget = Budget::default();
        for limit in [0, 1010, 2000] {
            assert_eq!(budget.spread(&crowded(), limit, (640, 480)).len(), 1010);
        }
    }

    #[test]
    fn a_crowd_does_not_take_the_place_of_the_few() {
        let keypoints = crowded();
        let mut budget = Budget::default();
        let kept = budget.spread(&keypoints, 50, (640, 480));
        assert_eq!(kept.len(), 50);
        assert!(kept.is_sorted());
        assert!((1000..1010).all(|i| kept.contains(&i)));
        // Of a crowd within one cell, the strongest.
        let kept = budget.spread(&keypoints, 12, (640, 480));
        assert!(kept.contains(&999));
    }

    #[test]
    fn an_image_of_one_row_has_cells_too() {
        let row: Vec<Keypoint> = (0..9).map(|i| keypoint(i as f32, 0.0, i as f32)).collect();
        assert_eq!(Budget::default().spread(&row, 3, (9, 1)), [6, 7, 8]);
    }
}
