//! Which squares of the frame are compared.

use nalgebra::Vector2;

use super::AlignmentReference;
use super::view::View;
use crate::GrayImage;

/// Side of a tile \[px\].
pub const SIDE: usize = 8;
/// Pixels of a tile.
pub const PIXELS: usize = SIDE * SIDE;

/// Strata along each side of the reference: tiles are taken from all of them.
const STRATA: usize = 4;
/// Tiles reach at most this far beyond the outline \[px\] with their centre inside of it.
const INSET: f64 = 2.0;

/// A candidate tile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tile {
    /// Column of its first pixel.
    pub x: usize,
    /// Row of its first pixel.
    pub y: usize,
    stratum: usize,
    texture: f32,
}

impl Tile {
    /// Its centre \[px\].
    pub fn centre(&self) -> Vector2<f64> {
        let half = (SIDE as f64 - 1.0) / 2.0;
        Vector2::new(self.x as f64 + half, self.y as f64 + half)
    }
}

/// Fills `tiles` with at most `limit` tiles of the face, the most textured of each part of it; part by
/// part, the most textured of each first.
///
/// Their places are `step` pixels apart; where that is less than a side they overlap.
pub fn choose(
    view: &View,
    reference: &AlignmentReference,
    frame: &GrayImage,
    step: usize,
    limit: usize,
    tiles: &mut Vec<Tile>,
) {
    tiles.clear();
    let [columns, rows] = [0, 1].map(|axis| {
        let length = [frame.width(), frame.height()][axis];
        range(view.outline.map(|corner| corner[axis]), length)
    });
    for y in rows.clone().step_by(step) {
        for x in columns.clone().step_by(step) {
            tiles.extend(candidate(view, reference, x, y));
        }
    }
    tiles.sort_unstable_by(|a, b| {
        (a.stratum.cmp(&b.stratum))
            .then(b.texture.total_cmp(&a.texture))
            .then((a.y, a.x).cmp(&(b.y, b.x)))
    });
    if tiles.len() > limit {
        thin_out(tiles, limit);
    }
}

/// First pixels of tiles that lie in the image with a pixel around them.
fn range(corners: [f64; 4], length: usize) -> std::ops::Range<usize> {
    let low = corners.iter().copied().fold(f64::INFINITY, f64::min);
    let high = corners.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    // Saturating casts: what lies outside becomes an empty range.
    let first = (low.ceil().max(1.0)) as usize;
    let beyond = (high.floor().max(0.0) as usize).min(length.saturating_sub(1));
    first..(beyond + 1).saturating_sub(SIDE)
}

fn candidate(view: &View, reference: &AlignmentReference, x: usize, y: usize) -> Option<Tile> {
    let mut tile = Tile {
        x,
        y,
        stratum: 0,
        texture: 0.0,
    };
    let centre = tile.centre();
    let inside = (0..4).all(|i| {
        let (a, b) = (view.outline[i], view.outline[(i + 1) % 4]);
        let side = b - a;
        side.perp(&(centre - a)) > INSET * side.norm()
    });
    if !inside {
        return None;
    }
    let point = view.reference_point(centre)?;
    let stratum =
        |value: f64, length: f64| ((value / length * STRATA as f64) as usize).min(STRATA - 1);
    tile.stratum =
        stratum(point.y, reference.height()) * STRATA + stratum(point.x, reference.width());
    tile.texture = reference.texture_at(point.x, point.y);
    Some(tile)
}

/// Keeps the first tiles of each stratum, an equal number of each as far as it has them.
fn thin_out(tiles: &mut Vec<Tile>, limit: usize) {
    let mut counts = [0; STRATA * STRATA];
    for tile in tiles.iter() {
        counts[tile.stratum] += 1;
    }
    let quota = quota(&counts, limit);
    let mut taken = [0; STRATA * STRATA];
    tiles.retain(|tile| {
        taken[tile.stratum] += 1;
        taken[tile.stratum] <= quota
    });
}

/// The largest number a stratum with which the sum stays within the limit.
fn quota(counts: &[usize], limit: usize) -> usize {
    let mut quota = 0;
    while counts.iter().map(|&n| n.min(quota + 1)).sum::<usize>() <= limit {
        quota += 1;
    }
    quota
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;

    /// Tiles of a face of 12 × 9 of them, as large as they are in the frame.
    fn chosen(limit: usize) -> Vec<Tile> {
        let (width, height) = (12 * SIDE + 8, 9 * SIDE + 8);
        let pixels: Vec<u8> = (0..width * height).map(|i| (i * i % 251) as u8).collect();
        let image = GrayImage::new(width, height, &pixels).unwrap();
        let reference = AlignmentReference::new(image).unwrap();
        let H = Matrix3::new_translation(&Vector2::new(50.0, 40.0));
        let view = View::new(&reference, &H).unwrap();
        let frame = vec![0; 320 * 240];
        let frame = GrayImage::new(320, 240, &frame).unwrap();
        let mut tiles = Vec::new();
        choose(&view, &reference, &frame, SIDE, limit, &mut tiles);
        tiles
    }

    #[test]
    fn every_third_tile_is_of_every_part_of_the_face() {
        for limit in [1000, 64] {
            let tiles = chosen(limit);
            assert!(tiles.len() > 50 && tiles.len() <= limit);
            let mut strata: Vec<usize> = tiles.iter().step_by(3).map(|t| t.stratum).collect();
            strata.dedup();
            assert_eq!(strata, (0..STRATA * STRATA).collect::<Vec<_>>(), "{limit}");
        }
    }

    #[test]
    fn the_most_textured_stay() {
        let (all, some) = (chosen(1000), chosen(48));
        for stratum in 0..STRATA * STRATA {
            let of = |tiles: &[Tile]| -> Vec<Tile> {
                let tiles = tiles.iter().filter(|tile| tile.stratum == stratum);
                tiles.copied().collect()
            };
            let (all, some) = (of(&all), of(&some));
            assert!(all.is_sorted_by(|a, b| a.texture >= b.texture));
            assert_eq!(some, all[..some.len()]);
            assert_eq!(some.len(), 3);
        }
    }
}
