//! Without intrinsics: loops over lanes that the compiler vectorises with what the target has.

use super::{Lanes, QueryTile, ROWS, TILE, TileDistances};

/// Squared Euclidean distances.
pub fn euclidean(
    tile: &QueryTile,
    block: &[Lanes],
    norms: &Lanes,
    limits: &[i32; TILE],
    found: &mut TileDistances,
) {
    for query in 0..TILE {
        let mut dot = [0; ROWS];
        for (words, lanes) in tile.words.iter().zip(block) {
            for (byte, value) in words[query].to_le_bytes().into_iter().enumerate() {
                let (value, up) = (i32::from(value), 24 - 8 * byte);
                for (dot, lane) in dot.iter_mut().zip(lanes.0) {
                    *dot += value * ((lane << up) as i32 >> 24);
                }
            }
        }
        let distance = &mut found.distance[query];
        for ((distance, dot), norm) in distance.iter_mut().zip(dot).zip(norms.0) {
            *distance = tile.offset(query) + norm as i32 - 2 * dot;
        }
        found.below[query] = below(distance, limits[query]);
    }
}

/// Numbers of differing bits.
pub fn hamming(tile: &QueryTile, block: &[Lanes], limits: &[i32; TILE], found: &mut TileDistances) {
    for query in 0..TILE {
        let distance = &mut found.distance[query];
        *distance = [0; ROWS];
        for (words, lanes) in tile.words.iter().zip(block) {
            let word = words[query] ^ super::super::blocks::SIGN;
            for (distance, lane) in distance.iter_mut().zip(lanes.0) {
                *distance += (word ^ lane).count_ones() as i32;
            }
        }
        found.below[query] = below(distance, limits[query]);
    }
}

/// Bits of the distances below a limit.
fn below(distance: &[i32; ROWS], limit: i32) -> u32 {
    let bits = distance.iter().enumerate();
    bits.fold(0, |bits, (row, &d)| bits | u32::from(d < limit) << row)
}
