//! AVX-512 with VNNI and VPOPCNTDQ (Ice Lake, Zen 4 and later): sixteen distances a register.

use std::arch::x86_64::*;

use super::super::blocks::SIGN;
use super::{Lanes, QueryTile, TILE, TileDistances};

/// Squared Euclidean distances.
#[target_feature(enable = "avx512f,avx512vnni")]
pub fn euclidean(
    tile: &QueryTile,
    block: &[Lanes],
    norms: &Lanes,
    limits: &[i32; TILE],
    found: &mut TileDistances,
) {
    let mut dot = [[_mm512_setzero_si512(); 2]; TILE];
    for (words, lanes) in tile.words.iter().zip(block) {
        let references = load(lanes);
        for (dot, word) in dot.iter_mut().zip(words) {
            let word = _mm512_set1_epi32(*word as i32);
            dot[0] = _mm512_dpbusd_epi32(dot[0], word, references[0]);
            dot[1] = _mm512_dpbusd_epi32(dot[1], word, references[1]);
        }
    }
    let norms = load(norms);
    for (query, dot) in dot.into_iter().enumerate() {
        let offset = _mm512_set1_epi32(tile.offset(query));
        let distance = [0, 1].map(|half| {
            let twice = _mm512_slli_epi32(dot[half], 1);
            _mm512_sub_epi32(_mm512_add_epi32(norms[half], offset), twice)
        });
        store(distance, limits, query, found);
    }
}

/// Numbers of differing bits.
#[target_feature(enable = "avx512f,avx512vpopcntdq")]
pub fn hamming(tile: &QueryTile, block: &[Lanes], limits: &[i32; TILE], found: &mut TileDistances) {
    let mut differing = [[_mm512_setzero_si512(); 2]; TILE];
    for (words, lanes) in tile.words.iter().zip(block) {
        let references = load(lanes);
        for (differing, word) in differing.iter_mut().zip(words) {
            let word = _mm512_set1_epi32((word ^ SIGN) as i32);
            for (differing, reference) in differing.iter_mut().zip(references) {
                let bits = _mm512_popcnt_epi32(_mm512_xor_si512(word, reference));
                *differing = _mm512_add_epi32(*differing, bits);
            }
        }
    }
    for (query, distance) in differing.into_iter().enumerate() {
        store(distance, limits, query, found);
    }
}

#[target_feature(enable = "avx512f")]
fn load(lanes: &Lanes) -> [__m512i; 2] {
    let pointer = lanes.0.as_ptr().cast::<__m512i>();
    // SAFETY: `Lanes` are 128 bytes, aligned to 64.
    unsafe {
        [
            _mm512_load_si512(pointer),
            _mm512_load_si512(pointer.add(1)),
        ]
    }
}

#[target_feature(enable = "avx512f")]
fn store(distance: [__m512i; 2], limits: &[i32; TILE], query: usize, found: &mut TileDistances) {
    let limit = _mm512_set1_epi32(limits[query]);
    let below = distance.map(|d| u32::from(_mm512_cmplt_epi32_mask(d, limit)));
    found.below[query] = below[0] | below[1] << 16;
    let row = found.distance[query].as_mut_ptr().cast::<__m512i>();
    // SAFETY: a query's row of distances is 128 bytes, and unaligned stores ask for no more.
    unsafe {
        _mm512_storeu_si512(row, distance[0]);
        _mm512_storeu_si512(row.add(1), distance[1]);
    }
}
