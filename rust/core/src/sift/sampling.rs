//! Gradients at places of a level.

use super::gradient::{GradientPlane, ROUNDING, unpack};

/// Gradients of the pixels nearest to N places, along x and y; beyond the border they are 0.
#[inline(always)]
pub fn gradients<const N: usize>(
    plane: &GradientPlane,
    xs: &[f32; N],
    ys: &[f32; N],
) -> ([f32; N], [f32; N]) {
    let (right, bottom) = ((plane.width - 1) as f32, (plane.height - 1) as f32);
    let mut indices = [0u32; N];
    for ((index, &x), &y) in indices.iter_mut().zip(xs).zip(ys) {
        *index = nearest(y, bottom) * plane.width as u32 + nearest(x, right);
    }
    let mut words = [0u32; N];
    for (word, &index) in words.iter_mut().zip(&indices) {
        *word = plane.values[index as usize];
    }
    let (mut dx, mut dy) = ([0.0; N], [0.0; N]);
    for ((x, y), &word) in dx.iter_mut().zip(&mut dy).zip(&words) {
        (*x, *y) = unpack(word);
    }
    (dx, dy)
}

/// The integer in 0…`last` that is nearest to a coordinate; the border itself has no gradient.
#[inline(always)]
fn nearest(coordinate: f32, last: f32) -> u32 {
    let above = if coordinate > 0.0 { coordinate } else { 0.0 };
    let within = if above < last { above } else { last };
    (within + ROUNDING).to_bits() - ROUNDING.to_bits()
}

/// Direction of a vector in turns, 0 to 1 from x towards y, to 1e-5, and its length, to 1e-4 of it.
///
/// The polynomial of the direction is the minimax one of Hastings (Approximations for Digital
/// Computers, 1955), that of the length, √(1 + s) for s in 0…1, is through Chebyshev's points.
#[inline(always)]
pub fn polar(x: f32, y: f32) -> (f32, f32) {
    const PER_RADIAN: f32 = 0.5 / std::f32::consts::PI;
    let (ax, ay) = (x.abs(), y.abs());
    let (low, high) = if ax < ay { (ax, ay) } else { (ay, ax) };
    let a = low / (high + f32::MIN_POSITIVE);
    let s = a * a;
    let octant = polynomial(s, ARC_TANGENT) * a * PER_RADIAN;
    let quadrant = if ax < ay { 0.25 - octant } else { octant };
    let half = if x < 0.0 { 0.5 - quadrant } else { quadrant };
    let turns = if y < 0.0 { 1.0 - half } else { half };
    (turns, high * polynomial(s, ROOT))
}

/// Coefficients of atan(√s) / √s, highest power first.
const ARC_TANGENT: [f32; 6] = [
    -0.013_480_47,
    0.057_477_314,
    -0.121_239_07,
    0.195_635_92,
    -0.332_994_6,
    0.999_995_6,
];
/// Coefficients of √(1 + s), highest power first.
const ROOT: [f32; 4] = [0.024_161_11, -0.106_784_04, 0.496_816_74, 1.000_092];

/// By Horner's scheme, highest power first.
#[inline(always)]
fn polynomial<const N: usize>(s: f32, coefficients: [f32; N]) -> f32 {
    let mut sum = 0.0f32;
    for c in coefficients {
        sum = sum.mul_add(s, c);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_those_of_the_arc_tangent() {
        for i in 0..720 {
            let angle = (f64::from(i) + 0.3).to_radians() / 2.0;
            let (turns, length) = polar(5.0 * angle.cos() as f32, 5.0 * angle.sin() as f32);
            let found = f64::from(turns);
            let expected = angle / std::f64::consts::TAU;
            assert!((found - expected).abs() < 1e-5, "{i}: {found} {expected}");
            assert!((length - 5.0).abs() < 5e-4, "{i}: {length}");
        }
        assert_eq!(polar(0.0, 0.0), (0.0, 0.0));
    }

    #[test]
    fn places_take_the_nearest_pixel_and_nothing_beyond_the_border() {
        let mut values = vec![0; 20];
        values[7] = 5 << 16 | 3; // column 2 of row 1
        let plane = GradientPlane {
            width: 5,
            height: 4,
            values,
        };
        let (dx, dy) = gradients(
            &plane,
            &[2.4, 1.6, 2.6, -9.0, 99.0],
            &[0.6, 1.4, 1.0, 1.0, 1e6],
        );
        assert_eq!(dx, [3.0, 3.0, 0.0, 0.0, 0.0]);
        assert_eq!(dy, [5.0, 5.0, 0.0, 0.0, 0.0]);
    }
}
