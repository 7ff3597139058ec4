//! AVX2, for dot products also AVX-VNNI (Alder Lake, Zen 5 and later): eight distances a register.

use std::arch::x86_64::*;

use super::super::blocks::SIGN;
use super::{Lanes, QueryTile, TILE, TileDistances};

/// Registers that hold one column of a block.
const REGISTERS: usize = 4;
/// Queries and registers that are worked on together: their sums, the operands and the constants
/// fit the sixteen registers.
const QUERIES: usize = 4;
const HALF: usize = 2;

/// The loops of a squared Euclidean distance around one step `dot += word · references`, which is
/// given the sum, the query's bytes and the references'.
macro_rules! euclidean {
    ($tile:ident, $block:ident, $norms:ident, $limits:ident, $found:ident, $step:ident) => {
        let norms = load($norms);
        for first in (0..TILE).step_by(QUERIES) {
            for half in (0..REGISTERS).step_by(HALF) {
                let mut dot = [[_mm256_setzero_si256(); HALF]; QUERIES];
                for (words, lanes) in $tile.words.iter().zip($block) {
                    let references = load_half(lanes, half);
                    for (query, dot) in dot.iter_mut().enumerate() {
                        let word = _mm256_set1_epi32(words[first + query] as i32);
                        dot[0] = $step(dot[0], word, references[0]);
                        dot[1] = $step(dot[1], word, references[1]);
                    }
                }
                for (query, dot) in (first..).zip(dot) {
                    let offset = _mm256_set1_epi32($tile.offset(query));
                    for (register, dot) in (half..).zip(dot) {
                        let alone = _mm256_add_epi32(norms[register], offset);
                        let distance = _mm256_sub_epi32(alone, _mm256_slli_epi32(dot, 1));
                        store(distance, $limits, query, register, $found);
                    }
                }
            }
        }
    };
}

/// Squared Euclidean distances.
#[target_feature(enable = "avx2")]
pub fn euclidean(
    tile: &QueryTile,
    block: &[Lanes],
    norms: &Lanes,
    limits: &[i32; TILE],
    found: &mut TileDistances,
) {
    found.below = [0; TILE];
    if tile.wide {
        euclidean!(tile, block, norms, limits, found, add_wide_products);
    } else {
        euclidean!(tile, block, norms, limits, found, add_products);
    }
}

/// Squared Euclidean distances by AVX-VNNI.
#[target_feature(enable = "avx2,avxvnni")]
pub fn euclidean_vnni(
    tile: &QueryTile,
    block: &[Lanes],
    norms: &Lanes,
    limits: &[i32; TILE],
    found: &mut TileDistances,
) {
    found.below = [0; TILE];
    euclidean!(tile, block, norms, limits, found, _mm256_dpbusd_avx_epi32);
}

/// Adds up q·r of four bytes each, with q ≤ 127: pairs of products are within ±127·128·2 then,
/// which 16 bits hold.
#[target_feature(enable = "avx2")]
fn add_products(sum: __m256i, query: __m256i, references: __m256i) -> __m256i {
    let pairs = _mm256_maddubs_epi16(query, references);
    _mm256_add_epi32(sum, _mm256_madd_epi16(pairs, _mm256_set1_epi16(1)))
}

/// The same for any q, its low seven bits and its highest bit apart.
#[target_feature(enable = "avx2")]
fn add_wide_products(sum: __m256i, query: __m256i, references: __m256i) -> __m256i {
    let low = _mm256_and_si256(query, _mm256_set1_epi8(0x7f));
    let high = _mm256_and_si256(_mm256_srli_epi16(query, 7), _mm256_set1_epi8(1));
    let pairs = _mm256_maddubs_epi16(high, references);
    let sum = _mm256_add_epi32(sum, _mm256_madd_epi16(pairs, _mm256_set1_epi16(128)));
    add_products(sum, low, references)
}

/// Numbers of differing bits, by looking half a byte up at a time (Muła, Kurz and Lemire 2018).
#[target_feature(enable = "avx2")]
pub fn hamming(tile: &QueryTile, block: &[Lanes], limits: &[i32; TILE], found: &mut TileDistances) {
    found.below = [0; TILE];
    for query in 0..TILE {
        let mut differing = [_mm256_setzero_si256(); REGISTERS];
        for (words, lanes) in tile.words.iter().zip(block) {
            let word = _mm256_set1_epi32((words[query] ^ SIGN) as i32);
            for (sum, references) in differing.iter_mut().zip(load(lanes)) {
                let bits = count_bits(_mm256_xor_si256(word, references));
                *sum = add_products(*sum, bits, _mm256_set1_epi8(1));
            }
        }
        for (register, distance) in differing.into_iter().enumerate() {
            store(distance, limits, query, register, found);
        }
    }
}

/// Number of bits of each byte.
#[target_feature(enable = "avx2")]
fn count_bits(bytes: __m256i) -> __m256i {
    let counts = _mm256_broadcastsi128_si256(_mm_setr_epi8(
        0, 1, 1, 2, 1, 2, 2, 3, 1, 2, 2, 3, 2, 3, 3, 4,
    ));
    let nibble = _mm256_set1_epi8(0x0f);
    let low = _mm256_and_si256(bytes, nibble);
    let high = _mm256_and_si256(_mm256_srli_epi16(bytes, 4), nibble);
    _mm256_add_epi8(
        _mm256_shuffle_epi8(counts, low),
        _mm256_shuffle_epi8(counts, high),
    )
}

#[target_feature(enable = "avx2")]
fn load(lanes: &Lanes) -> [__m256i; REGISTERS] {
    let (a, b) = (load_half(lanes, 0), load_half(lanes, HALF));
    [a[0], a[1], b[0], b[1]]
}

#[target_feature(enable = "avx2")]
fn load_half(lanes: &Lanes, first: usize) -> [__m256i; HALF] {
    let half = &lanes.0[first * 8..][..8 * HALF];
    let pointer = half.as_ptr().cast::<__m256i>();
    // SAFETY: `half` has 64 bytes, and unaligned loads ask for no more.
    unsafe {
        [
            _mm256_loadu_si256(pointer),
            _mm256_loadu_si256(pointer.add(1)),
        ]
    }
}

#[target_feature(enable = "avx2")]
fn store(
    distance: __m256i,
    limits: &[i32; TILE],
    query: usize,
    register: usize,
    found: &mut TileDistances,
) {
    let below = _mm256_cmpgt_epi32(_mm256_set1_epi32(limits[query]), distance);
    let bits = _mm256_movemask_ps(_mm256_castsi256_ps(below)) as u32;
    found.below[query] |= bits << (8 * register);
    let row = &mut found.distance[query][8 * register..][..8];
    // SAFETY: `row` has 32 bytes, and unaligned stores ask for no more.
    unsafe { _mm256_storeu_si256(row.as_mut_ptr().cast(), distance) }
}
