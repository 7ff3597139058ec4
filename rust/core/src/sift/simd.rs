//! Loads and stores of SIMD vectors at any place of a row.

use pulp::Simd;

/// The vector that begins at `x`.
#[inline(always)]
pub fn load<S: Simd>(row: &[f32], x: usize) -> S::f32s {
    S::as_simd_f32s(&row[x..x + S::F32_LANES]).0[0]
}

/// Writes the vector that begins at `x`.
#[inline(always)]
pub fn store<S: Simd>(row: &mut [f32], x: usize, value: S::f32s) {
    S::as_mut_simd_f32s(&mut row[x..x + S::F32_LANES]).0[0] = value;
}
