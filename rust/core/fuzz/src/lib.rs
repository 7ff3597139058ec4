//! Small inputs that the fuzz targets share.
#![allow(non_snake_case)]

use arbitrary::{Arbitrary, Result, Unstructured};
use nalgebra::Matrix3;
use planegrasp_core::homography::PointMatch;
use planegrasp_core::{GrayImage, Keypoint};

/// An image of at most 96 × 96 pixels, also one without any.
#[derive(Debug, Clone)]
pub struct Picture {
    width: usize,
    height: usize,
    pixels: Vec<u8>,
}

impl Picture {
    /// One that is this large: a few bytes repeat all over it.
    pub fn of_size(u: &mut Unstructured<'_>, width: usize, height: usize) -> Result<Self> {
        let count = u.int_in_range(0..=600)?;
        let bytes = u.bytes(count.min(u.len()))?;
        // Repeated with a drift, rows differ and edges appear at every scale.
        let drift = u.int_in_range(0..=3)?;
        let pixel = |i: usize| {
            let byte = *bytes.get(i % bytes.len().max(1)).unwrap_or(&128);
            byte.wrapping_add((drift * (i / bytes.len().max(1))) as u8)
        };
        Ok(Self {
            width,
            height,
            pixels: (0..width * height).map(pixel).collect(),
        })
    }

    /// The image as the core takes it.
    pub fn gray(&self) -> GrayImage<'_> {
        GrayImage::new(self.width, self.height, &self.pixels).expect("width × height pixels")
    }

    /// Asserts that keypoints are finite and lie in the image.
    pub fn assert_holds(&self, keypoints: &[Keypoint]) {
        for k in keypoints {
            let values = [k.x, k.y, k.scale, k.angle, k.response];
            assert!(values.iter().all(|value| value.is_finite()), "{k:?}");
            let inside = |value: f32, length: usize| value >= -1.0 && value <= length as f32;
            assert!(inside(k.x, self.width) && inside(k.y, self.height), "{k:?}");
            assert!(k.scale > 0.0, "{k:?}");
        }
    }
}

impl<'a> Arbitrary<'a> for Picture {
    fn arbitrary(u: &mut Unstructured<'a>) -> Result<Self> {
        let width = u.int_in_range(0..=96)?;
        let height = u.int_in_range(0..=96)?;
        Self::of_size(u, width, height)
    }
}

/// Any number: mostly one as pixels have, sometimes an extreme one.
#[derive(Debug, Clone, Copy)]
pub struct Number(pub f64);

impl<'a> Arbitrary<'a> for Number {
    fn arbitrary(u: &mut Unstructured<'a>) -> Result<Self> {
        let number = match u.int_in_range(0_u8..=15)? {
            0 => f64::from_bits(u.arbitrary()?),
            1 => f64::from(f32::from_bits(u.arbitrary()?)),
            2 => 0.0,
            3..=7 => f64::from(u.arbitrary::<i16>()?) / 64.0,
            _ => f64::from(u.arbitrary::<i8>()?),
        };
        Ok(Self(number))
    }
}

impl Number {
    /// Two numbers.
    pub fn pair<T: From<[f64; 2]>>(pair: [Self; 2]) -> T {
        pair.map(|number| number.0).into()
    }
}

/// A homography: near the identity with a shift, or anything.
#[derive(Debug, Clone)]
pub struct Homography(pub Matrix3<f64>);

impl<'a> Arbitrary<'a> for Homography {
    fn arbitrary(u: &mut Unstructured<'a>) -> Result<Self> {
        if u.ratio(1, 4)? {
            let entries: [Number; 9] = u.arbitrary()?;
            return Ok(Self(Matrix3::from_iterator(entries.map(|n| n.0))));
        }
        let small = |u: &mut Unstructured<'_>, unit: f64| -> Result<f64> {
            Ok(f64::from(u.arbitrary::<i8>()?) * unit)
        };
        let mut H = Matrix3::identity();
        for (place, unit) in [(0, 0.01), (1, 0.01), (3, 0.01), (4, 0.01)] {
            H[(place / 3, place % 3)] += small(u, unit)?;
        }
        H[(0, 2)] = small(u, 0.5)?;
        H[(1, 2)] = small(u, 0.5)?;
        H[(2, 0)] = small(u, 1e-4)?;
        H[(2, 1)] = small(u, 1e-4)?;
        Ok(Self(H))
    }
}

/// Matches, some of which a homography may explain.
#[derive(Debug, Clone)]
pub struct Matches(pub Vec<PointMatch>);

impl<'a> Arbitrary<'a> for Matches {
    fn arbitrary(u: &mut Unstructured<'a>) -> Result<Self> {
        let H = u.arbitrary::<Homography>()?.0;
        let count = u.int_in_range(0..=40)?;
        let one = |u: &mut Unstructured<'a>| -> Result<PointMatch> {
            let source = Number::pair(u.arbitrary()?);
            if u.ratio(1, 3)? {
                let target = Number::pair(u.arbitrary()?);
                return Ok(PointMatch { source, target });
            }
            let mapped = H * nalgebra::Vector2::push(&source, 1.0);
            let target = mapped.xy() / mapped.z;
            Ok(PointMatch { source, target })
        };
        (0..count).map(|_| one(u)).collect::<Result<_>>().map(Self)
    }
}
