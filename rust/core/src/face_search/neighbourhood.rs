//! Candidates by where they lie in the frame.

use nalgebra::{Matrix2, Vector2};

use super::evidence::Match;

/// How far from a match its supporters may lie in the frame [px].
pub const RADIUS: f32 = 100.0;
/// A local map may be off by this share of the distance that it predicts over.
const TOLERANCE: f32 = 0.3;
/// Or by so many pixels.
const TOLERANCE_PX: f32 = 4.0;
/// Points of the reference that are closer than this are the same [px].
const SAME_POINT: f32 = 1e-6;
/// Points may lie as far out as numbers go; every cell has neighbours nevertheless.
const OUTERMOST: f64 = 1e15;
/// Candidates that are looked at side by side.
const LANES: usize = 8;

/// Candidates sorted by cells of the frame, as columns: most comparisons come to nothing, and are made
/// several at a time. Single precision is far finer than any of the tolerances.
pub struct Neighbourhood<'a> {
    /// Row and column of each one's cell, ascending.
    cells: Vec<(i64, i64)>,
    /// Places in the frame and on the reference, x and y.
    target: [Vec<f32>; 2],
    source: [Vec<f32>; 2],
    /// The candidates; those of one feature follow each other.
    pub matches: Vec<&'a Match>,
}

impl<'a> Neighbourhood<'a> {
    /// Of candidates that are sorted by feature.
    pub fn new(all: &'a [Match]) -> Self {
        let mut sorted: Vec<_> = all.iter().map(|m| (cell(m.points.target), m)).collect();
        sorted.sort_by_key(|one| one.0);
        let column = |value: fn(&Match) -> f64| {
            let values = sorted.iter().map(|one| value(one.1) as f32);
            // A group may begin with the last one.
            values.chain([f32::NAN; LANES - 1]).collect()
        };
        Self {
            cells: sorted.iter().map(|one| one.0).collect(),
            target: [column(|m| m.points.target.x), column(|m| m.points.target.y)],
            source: [column(|m| m.points.source.x), column(|m| m.points.source.y)],
            matches: sorted.iter().map(|one| one.1).collect(),
        }
    }

    /// Fills `found` with the numbers of those within the radius about a match that its local map puts
    /// where they are, but not of those of its own reference point.
    pub fn predicted(&self, one: &Match, map: &Matrix2<f32>, found: &mut Vec<u32>) {
        found.clear();
        let (row, column) = cell(one.points.target);
        for row in row - 1..=row + 1 {
            let begin = self.cells.partition_point(|&c| c < (row, column - 1));
            let end = self.cells.partition_point(|&c| c <= (row, column + 1));
            pulp::Arch::new().dispatch(Comparison {
                neighbourhood: self,
                range: begin..end,
                target: one.points.target.cast(),
                source: one.points.source.cast(),
                map,
                found,
            });
        }
    }
}

/// Candidates of neighbouring cells against what a match predicts, to be compiled for each instruction
/// set.
struct Comparison<'a> {
    neighbourhood: &'a Neighbourhood<'a>,
    range: std::ops::Range<usize>,
    target: Vector2<f32>,
    source: Vector2<f32>,
    map: &'a Matrix2<f32>,
    found: &'a mut Vec<u32>,
}

impl pulp::NullaryFnOnce for Comparison<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Neighbourhood { target, source, .. } = self.neighbourhood;
        for first in self.range.clone().step_by(LANES) {
            let lanes = |values: &[f32]| -> [f32; LANES] {
                std::array::from_fn(|lane| values[first..first + LANES][lane])
            };
            let [tx, ty, sx, sy] =
                [&target[0], &target[1], &source[0], &source[1]].map(|v| lanes(v));
            let mut is_predicted = [0_u8; LANES];
            for lane in 0..LANES {
                let (sx, sy) = (sx[lane] - self.source.x, sy[lane] - self.source.y);
                let (tx, ty) = (tx[lane] - self.target.x, ty[lane] - self.target.y);
                let (px, py) = (
                    self.map.m11 * sx + self.map.m12 * sy,
                    self.map.m21 * sx + self.map.m22 * sy,
                );
                let error = (px - tx) * (px - tx) + (py - ty) * (py - ty);
                let relative = TOLERANCE * TOLERANCE * (px * px + py * py);
                // Comparisons with NaN are false.
                let near = error < relative.max(TOLERANCE_PX * TOLERANCE_PX);
                let within = tx * tx + ty * ty <= RADIUS * RADIUS;
                let apart = sx * sx + sy * sy > SAME_POINT * SAME_POINT;
                is_predicted[lane] = u8::from(near & within & apart);
            }
            if is_predicted == [0; LANES] {
                continue;
            }
            let here = first..(first + LANES).min(self.range.end);
            let predicted = here.zip(is_predicted).filter(|one| one.1 != 0);
            self.found.extend(predicted.map(|one| one.0 as u32));
        }
    }
}

/// Row and column.
fn cell(point: Vector2<f64>) -> (i64, i64) {
    let side = f64::from(RADIUS);
    let cell = point.map(|v| (v / side).floor().clamp(-OUTERMOST, OUTERMOST) as i64);
    (cell.y, cell.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::homography::PointMatch;
    use crate::random::SplitMix64;

    #[test]
    fn what_is_predicted_is_what_the_definition_says() {
        let mut random = SplitMix64::new(6);
        let mut place = |side: f64| {
            let mut draw = || side * (2.0 * random.uniform() - 1.0);
            Vector2::new(draw(), draw())
        };
        let map = Matrix2::new(0.8, -0.3, 0.4, 1.1);
        // About the origin, so that cells have negative numbers, too; half of them near a prediction.
        let all: Vec<Match> = (0..307)
            .map(|i| {
                let source = place(250.0);
                let target = match i % 2 {
                    0 => place(400.0),
                    _ => map * source + place(40.0),
                };
                Match {
                    feature: i,
                    reference: i,
                    nearest: true,
                    ratio: 0.5,
                    points: PointMatch { source, target },
                }
            })
            .collect();
        let neighbourhood = Neighbourhood::new(&all);
        let (mut found, mut in_all, mut doubtful) = (Vec::new(), 0, 0);
        for one in &all {
            neighbourhood.predicted(one, &map.cast(), &mut found);
            let found: Vec<u32> = found
                .iter()
                .map(|&i| neighbourhood.matches[i as usize].feature)
                .collect();
            in_all += found.len();
            for other in &all {
                let between = other.points.source - one.points.source;
                let seen = other.points.target - one.points.target;
                let predicted = map * between;
                let allowed = (0.3 * predicted.norm()).max(4.0);
                let margins = [
                    (predicted - seen).norm() - allowed,
                    seen.norm() - f64::from(RADIUS),
                ];
                if margins.iter().any(|margin| margin.abs() < 1e-3) {
                    doubtful += 1;
                    continue;
                }
                let expected = margins.iter().all(|&m| m < 0.0) && one.feature != other.feature;
                assert_eq!(found.contains(&other.feature), expected);
            }
        }
        assert!(in_all > 300 && doubtful < 20, "{in_all} {doubtful}");
    }
}
