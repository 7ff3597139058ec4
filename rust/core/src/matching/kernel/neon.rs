//! NEON (every arm64 processor): four distances a register.

use std::arch::aarch64::*;

use super::super::blocks::SIGN;
use super::{Lanes, QueryTile, TILE, TileDistances};

/// Registers that hold one column of a block.
const REGISTERS: usize = 8;
/// Registers that are worked on together: their sums, two each, and the operands fit the 32.
const HALF: usize = 4;
/// Queries that are worked on together.
const QUERIES: usize = 2;

/// Squared Euclidean distances.
#[target_feature(enable = "neon")]
pub fn euclidean(
    tile: &QueryTile,
    block: &[Lanes],
    norms: &Lanes,
    limits: &[i32; TILE],
    found: &mut TileDistances,
) {
    found.below = [0; TILE];
    for first in (0..TILE).step_by(QUERIES) {
        for half in (0..REGISTERS).step_by(HALF) {
            let mut dot = [[[vdupq_n_u32(0); 2]; HALF]; QUERIES];
            for (words, lanes) in tile.words.iter().zip(block) {
                let references: [uint8x16_t; HALF] =
                    std::array::from_fn(|i| unsigned(load(lanes, half + i)));
                for (query, dot) in dot.iter_mut().enumerate() {
                    let word = vreinterpretq_u8_u32(vdupq_n_u32(words[first + query]));
                    for (dot, reference) in dot.iter_mut().zip(references) {
                        *dot = add_products(*dot, word, reference);
                    }
                }
            }
            for (query, dot) in (first..).zip(dot) {
                for (register, dot) in (half..).zip(dot) {
                    let dot = vreinterpretq_s32_u32(vpaddq_u32(dot[0], dot[1]));
                    let alone = vaddq_s32(
                        vreinterpretq_s32_u32(load(norms, register)),
                        vdupq_n_s32(tile.norms[query]),
                    );
                    let distance = vsubq_s32(alone, vshlq_n_s32::<1>(dot));
                    store(distance, limits, query, register, found);
                }
            }
        }
    }
}

/// Adds up the products of bytes, those of the first and of the second two descriptors apart.
#[target_feature(enable = "neon")]
fn add_products(
    sum: [uint32x4_t; 2],
    query: uint8x16_t,
    references: uint8x16_t,
) -> [uint32x4_t; 2] {
    let low = vmull_u8(vget_low_u8(query), vget_low_u8(references));
    [
        vpadalq_u16(sum[0], low),
        vpadalq_u16(sum[1], vmull_high_u8(query, references)),
    ]
}

/// Numbers of differing bits.
#[target_feature(enable = "neon")]
pub fn hamming(tile: &QueryTile, block: &[Lanes], limits: &[i32; TILE], found: &mut TileDistances) {
    found.below = [0; TILE];
    for query in 0..TILE {
        let mut differing = [vdupq_n_u32(0); REGISTERS];
        for (words, lanes) in tile.words.iter().zip(block) {
            let word = vdupq_n_u32(words[query] ^ SIGN);
            for (register, sum) in differing.iter_mut().enumerate() {
                let bits = veorq_u32(word, load(lanes, register));
                let counts = vcntq_u8(vreinterpretq_u8_u32(bits));
                *sum = vpadalq_u16(*sum, vpaddlq_u8(counts));
            }
        }
        for (register, distance) in differing.into_iter().enumerate() {
            store(
                vreinterpretq_s32_u32(distance),
                limits,
                query,
                register,
                found,
            );
        }
    }
}

/// Bytes as they were before they were stored as signed ones.
#[target_feature(enable = "neon")]
fn unsigned(stored: uint32x4_t) -> uint8x16_t {
    vreinterpretq_u8_u32(veorq_u32(stored, vdupq_n_u32(SIGN)))
}

#[target_feature(enable = "neon")]
fn load(lanes: &Lanes, register: usize) -> uint32x4_t {
    let four = &lanes.0[4 * register..][..4];
    // SAFETY: `four` has the 16 bytes that are loaded.
    unsafe { vld1q_u32(four.as_ptr()) }
}

#[target_feature(enable = "neon")]
fn store(
    distance: int32x4_t,
    limits: &[i32; TILE],
    query: usize,
    register: usize,
    found: &mut TileDistances,
) {
    let row = &mut found.distance[query][4 * register..][..4];
    // SAFETY: `row` has the 16 bytes that are stored.
    unsafe { vst1q_s32(row.as_mut_ptr(), distance) };
    let below = vcltq_s32(distance, vdupq_n_s32(limits[query]));
    // SAFETY: four numbers are 16 bytes.
    let bits = unsafe { vld1q_u32([1, 2, 4, 8].as_ptr()) };
    found.below[query] |= vaddvq_u32(vandq_u32(below, bits)) << (4 * register);
}
