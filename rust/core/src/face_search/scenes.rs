//! Matches of a face with exact truth, for tests.
#![allow(clippy::unwrap_used)]

use nalgebra::{Matrix2, Matrix3, Rotation3, Vector2, Vector3};

use super::evidence::{Evidence, ImageFeatures};
use super::face::SearchedFace;
use super::settings::SearchSettings;
use crate::matching::Candidates;
use crate::random::SplitMix64;
use crate::{Camera, GrayImage};

pub const WIDTH: usize = 400;
pub const HEIGHT: usize = 300;

/// The defaults of `planegrasp.homography.HomographyConfig`.
pub fn settings() -> SearchSettings {
    SearchSettings {
        min_matches: 10,
        max_ratio: 0.8,
        max_loose_ratio: 0.9,
        threshold: 3.0,
        iterations: 5000,
        min_inliers: 8,
        min_coverage: 0.03,
        min_side: 8.0,
        max_stretch: 1.6,
        aspect_sigma: 0.02,
        min_agreement: 0.3,
        min_doubtful_tiles: 0.0,
    }
}

pub fn camera() -> Camera {
    Camera::new((640, 480), (525.0, 525.0), (319.5, 239.5), [0.0; 5]).unwrap()
}

/// From edge coordinates to metres on a face 0.2 m wide and 0.15 m high.
pub fn face_from_edge() -> Matrix3<f64> {
    let pixel = 0.2 / WIDTH as f64;
    Matrix3::new(
        pixel, 0.0, -0.1, //
        0.0, -pixel, 0.075, //
        0.0, 0.0, 1.0,
    )
}

/// A face of that size with these keypoints and their frames (row by row), all black.
pub fn face(points: &[Vector2<f64>], frames: Vec<[f32; 4]>) -> SearchedFace {
    let black = vec![0; WIDTH * HEIGHT];
    let image = GrayImage::new(WIDTH, HEIGHT, &black).unwrap();
    let points = points.iter().map(|p| [p.x as f32, p.y as f32]).collect();
    SearchedFace::new(image, face_from_edge(), points, frames).unwrap()
}

/// A face whose keypoints have the frames of pixels.
pub fn plain_face(points: &[Vector2<f64>]) -> SearchedFace {
    face(points, vec![[1.0, 0.0, 0.0, 1.0]; points.len()])
}

/// The homography of that face 0.6 m away, tilted and rolled [°], scaled to H[2, 2] = 1.
pub fn view(tilt: f64, roll: f64) -> Matrix3<f64> {
    let turn = |axis, degrees: f64| Rotation3::from_axis_angle(&axis, degrees.to_radians());
    let R = turn(Vector3::z_axis(), roll)
        * turn(Vector3::y_axis(), tilt)
        * turn(Vector3::x_axis(), 180.0);
    let (x, y) = (R.matrix().column(0), R.matrix().column(1));
    let plane = Matrix3::from_columns(&[x.into(), y.into(), Vector3::new(0.02, -0.01, 0.6)]);
    let H = camera().inverse_matrix().try_inverse().unwrap() * plane * face_from_edge();
    H / H[(2, 2)]
}

/// A face with pixel frames that was taught so many times too high.
pub fn face_taught(points: &[Vector2<f64>], higher: f64) -> SearchedFace {
    let black = vec![0; WIDTH * HEIGHT];
    let image = GrayImage::new(WIDTH, HEIGHT, &black).unwrap();
    let stretch = Matrix3::from_diagonal(&Vector3::new(1.0, higher, 1.0));
    let frames = vec![[1.0, 0.0, 0.0, 1.0]; points.len()];
    let points = points.iter().map(|p| [p.x as f32, p.y as f32]).collect();
    SearchedFace::new(image, stretch * face_from_edge(), points, frames).unwrap()
}

/// Where a homography puts a point.
pub fn mapped(H: &Matrix3<f64>, point: Vector2<f64>) -> Vector2<f64> {
    let p = H * point.push(1.0);
    p.xy() / p.z
}

/// Points all over a rectangle, exact in single precision as those of the index.
pub fn points(count: usize, width: f64, height: f64, seed: u64) -> Vec<Vector2<f64>> {
    let mut random = SplitMix64::new(seed);
    let mut draw = |side: f64| f64::from((random.uniform() * side) as f32);
    (0..count)
        .map(|_| Vector2::new(draw(width), draw(height)))
        .collect()
}

/// Features at these points whose own frames are those of pixels.
pub fn features(points: &[Vector2<f64>]) -> ImageFeatures {
    ImageFeatures {
        points: points.to_vec(),
        scales: vec![1.0; points.len()],
        angles: vec![0.0; points.len()],
    }
}

/// Feature i looks like keypoint i of the first face only.
pub fn one_each(points: &[Vector2<f64>], ratio: &[f32]) -> Evidence {
    let count = points.len();
    let candidates = Candidates {
        k: 1,
        face: vec![0; count],
        reference: (0..count as u32).collect(),
        distance: vec![0.1; count],
        ratio: ratio.to_vec(),
    };
    Evidence::new(&candidates, features(points), 1).unwrap()
}

/// The frame, row by row, of a keypoint that a feature in a pixel's frame sees mapped like this.
pub fn frame_seen_as(map: &Matrix2<f64>) -> [f32; 4] {
    let frame = map.try_inverse().unwrap();
    [frame[(0, 0)], frame[(0, 1)], frame[(1, 0)], frame[(1, 1)]].map(|v| v as f32)
}
