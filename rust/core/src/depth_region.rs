//! The depth pixels of one face: inside its projection, near where it must be, away from edges.

use nalgebra::{Vector2, Vector3};

use crate::camera::Camera;
use crate::depth_image::DepthImage;
use crate::quadrilateral::Quadrilateral;
use crate::robust::median;

/// Cells across the face in which one match vouches that the face, and nothing else, is seen.
const CELLS_ACROSS: f64 = 16.0;
/// A pixel is at a discontinuity when its inverse depth differs from a neighbour's by this many
/// times the median difference (about seven sigmas of a Gaussian) …
const JUMP_OVER_MEDIAN: f64 = 3.0;
/// … and by this share of itself beyond what the predicted slope explains.
const JUMP_SHARE: f64 = 0.005;

/// One depth measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthPixel {
    /// Its ray (x, y, 1).
    pub ray: Vector3<f64>,
    /// One over its depth [1/m].
    pub inverse_depth: f64,
    /// Whether a matched image point lies close by.
    pub near_match: bool,
}

/// The measurements of a face, thinned by a regular stride.
#[derive(Debug, Clone)]
pub struct Region {
    /// What was kept.
    pub pixels: Vec<DepthPixel>,
    /// How many image pixels each kept one stands for.
    pub pixels_per_sample: f64,
}

/// Which pixels belong to a face.
#[derive(Debug, Clone)]
pub struct RegionRule<'a> {
    /// Where the face is seen, undistorted pixels.
    pub outline: &'a Quadrilateral,
    /// Distance kept from the outline [px].
    pub erosion: f64,
    /// Predicted planes (q, see `plane_observation`); a pixel must lie near one of them.
    pub predictions: &'a [Vector3<f64>],
    /// Largest deviation from a prediction, as a share of the inverse depth.
    pub gate: f64,
    /// About how many pixels to keep.
    pub max_pixels: usize,
}

/// Gathers the pixels of a face; `matches` are its matched image points (undistorted pixels).
pub fn collect(
    camera: &Camera,
    depth: &DepthImage<'_>,
    rule: &RegionRule<'_>,
    matches: impl Iterator<Item = Vector2<f64>>,
) -> Region {
    let stride = (rule.outline.area() / rule.max_pixels.max(1) as f64)
        .sqrt()
        .ceil()
        .max(1.0);
    let step = stride as usize;
    let vouched = VouchedCells::new(rule.outline, matches);
    let mut pixels = Vec::new();
    let mut jumps = Vec::new();
    let (columns, rows) = observed_bounds(camera, rule.outline, depth);
    for v in rows.step_by(step) {
        for u in columns.clone().step_by(step) {
            let Some(z) = depth.at(u, v) else { continue };
            let Some(ray) = camera.ray(Vector2::new(u as f64, v as f64)) else {
                continue;
            };
            let undistorted = camera.to_pixel(ray);
            if rule.outline.depth_inside(undistorted) < rule.erosion {
                continue;
            }
            let ray = ray.push(1.0);
            let w = 1.0 / z;
            let near = |q: &&Vector3<f64>| (w / q.dot(&ray) - 1.0).abs() <= rule.gate;
            let Some(q) = rule.predictions.iter().find(near) else {
                continue;
            };
            pixels.push(DepthPixel {
                ray,
                inverse_depth: w,
                near_match: vouched.contains(undistorted),
            });
            jumps.push(jump(
                depth,
                (u, v),
                w,
                Vector2::new(q.x / camera.fx, q.y / camera.fy),
            ));
        }
    }
    let pixels = without_discontinuities(pixels, jumps);
    Region {
        pixels,
        pixels_per_sample: stride * stride,
    }
}

/// Columns and rows of the observed image that can show the outline.
fn observed_bounds(
    camera: &Camera,
    outline: &Quadrilateral,
    depth: &DepthImage<'_>,
) -> (std::ops::Range<usize>, std::ops::Range<usize>) {
    let corners = outline.corners();
    let (mut low, mut high) = outline.bounds();
    if camera.is_distorted() {
        // The lens bends straight edges: bound points along them, with a pixel to spare.
        let along = |i: usize, k: usize| corners[i].lerp(&corners[(i + 1) % 4], k as f64 / 8.0);
        let points = (0..4).flat_map(|i| (0..8).map(move |k| camera.observe(along(i, k))));
        let start = (
            Vector2::repeat(f64::INFINITY),
            Vector2::repeat(f64::NEG_INFINITY),
        );
        (low, high) = points.fold(start, |(a, b), p| (a.inf(&p), b.sup(&p)));
        low.add_scalar_mut(-1.0);
        high.add_scalar_mut(1.0);
    }
    // Float to integer conversion saturates: negative bounds become 0.
    let range =
        |a: f64, b: f64, size: usize| (a.ceil() as usize)..(b.floor() as usize + 1).min(size);
    (
        range(low.x, high.x, depth.width()),
        range(low.y, high.y, depth.height()),
    )
}

/// Largest difference of inverse depth from the four neighbours, less the predicted slope a pixel.
fn jump(depth: &DepthImage<'_>, (u, v): (usize, usize), w: f64, slope: Vector2<f64>) -> f64 {
    let neighbours = [
        (u.wrapping_sub(1), v, -slope.x),
        (u + 1, v, slope.x),
        (u, v.wrapping_sub(1), -slope.y),
        (u, v + 1, slope.y),
    ];
    let difference =
        |(u, v, step): (usize, usize, f64)| depth.at(u, v).map(|z| (1.0 / z - w - step).abs());
    neighbours
        .into_iter()
        .filter_map(difference)
        .fold(0.0, f64::max)
}

fn without_discontinuities(mut pixels: Vec<DepthPixel>, jumps: Vec<f64>) -> Vec<DepthPixel> {
    let typical = median(&mut jumps.clone()).unwrap_or(0.0);
    let mut jump = jumps.into_iter();
    pixels.retain(|pixel| {
        let limit = JUMP_OVER_MEDIAN * typical + JUMP_SHARE * pixel.inverse_depth;
        jump.next().is_some_and(|jump| jump <= limit)
    });
    pixels
}

/// A grid over the outline's bounds with the cells that hold a match.
struct VouchedCells {
    origin: Vector2<f64>,
    cell: f64,
    columns: usize,
    marked: Vec<bool>,
}

impl VouchedCells {
    fn new(outline: &Quadrilateral, matches: impl Iterator<Item = Vector2<f64>>) -> Self {
        let (low, high) = outline.bounds();
        let size = high - low;
        // No more cells than this across, however thin the outline is.
        let cell = (outline.area().sqrt() / CELLS_ACROSS)
            .max(4.0)
            .max(size.amax() / 256.0);
        let columns = (size.x / cell) as usize + 1;
        let rows = (size.y / cell) as usize + 1;
        let mut cells = Self {
            origin: low,
            cell,
            columns,
            marked: vec![false; columns * rows],
        };
        for point in matches {
            if let Some(marked) = cells.index(point).and_then(|i| cells.marked.get_mut(i)) {
                *marked = true;
            }
        }
        cells
    }

    fn index(&self, p: Vector2<f64>) -> Option<usize> {
        let at = (p - self.origin) / self.cell;
        let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < self.columns as f64;
        inside.then(|| at.y as usize * self.columns + at.x as usize)
    }

    fn contains(&self, p: Vector2<f64>) -> bool {
        self.index(p)
            .and_then(|i| self.marked.get(i))
            .copied()
            .unwrap_or(false)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::plane_observation::inverse_plane;
    use crate::synthetic::{Scene, grid};

    fn collected(scene: &Scene, depth: &[f32], max_pixels: usize) -> Region {
        let face = scene.face(&grid(0.2, 0.2, 4));
        let outline = Quadrilateral::new(face.corners().map(|c| face.to_image(c))).unwrap();
        let q = inverse_plane(&scene.T_camera_object, &Vector3::z(), &Vector3::zeros());
        let rule = RegionRule {
            outline: &outline,
            erosion: 3.0,
            predictions: &[q],
            gate: 0.15,
            max_pixels,
        };
        let image = DepthImage::new((640, 480), depth, &scene.camera).unwrap();
        collect(
            &scene.camera,
            &image,
            &rule,
            face.points.iter().map(|p| p.image),
        )
    }

    #[test]
    fn the_whole_eroded_face_is_taken_or_a_regular_share_of_it() {
        let scene = Scene::tilted(0.3, 0.5);
        let depth = scene.depth(0.0, 0);
        let all = collected(&scene, &depth, 1_000_000);
        let thinned = collected(&scene, &depth, 2000);
        assert_eq!(all.pixels_per_sample, 1.0);
        assert!(
            (19_000..22_000).contains(&all.pixels.len()),
            "{}",
            all.pixels.len()
        );
        let represented = thinned.pixels.len() as f64 * thinned.pixels_per_sample;
        assert!((represented / all.pixels.len() as f64 - 1.0).abs() < 0.05);
        let vouched = all.pixels.iter().filter(|pixel| pixel.near_match).count();
        // 16 matches in cells of 1/16 of the face's width.
        let share = vouched as f64 / all.pixels.len() as f64;
        assert!((0.04..0.09).contains(&share), "{share}");
    }

    #[test]
    fn every_ray_meets_the_plane_at_its_depth_also_through_a_lens() {
        let mut scene = Scene::tilted(0.5, -0.5);
        scene.camera.distortion = [-0.25, 0.08, 1e-3, -5e-4, 0.0];
        let depth = scene.depth(0.0, 0);
        let region = collected(&scene, &depth, 4000);
        let q = inverse_plane(&scene.T_camera_object, &Vector3::z(), &Vector3::zeros());
        assert!(region.pixels.len() > 1500);
        for pixel in &region.pixels {
            assert!((q.dot(&pixel.ray) - pixel.inverse_depth).abs() < 1e-6);
        }
    }

    #[test]
    fn pixels_far_from_the_prediction_and_at_jumps_are_left_out() {
        let scene = Scene::tilted(0.0, 0.0);
        let mut depth = scene.depth(0.0, 0);
        let before = collected(&scene, &depth, 1_000_000).pixels.len();
        // A 40 × 40 block 0.3 m nearer is beyond the gate, one 0.03 m nearer is not but jumps.
        let block = |depth: &mut [f32], u0: usize, nearer: f32| {
            for v in 180..220 {
                for u in u0..u0 + 40 {
                    depth[v * 640 + u] -= nearer;
                }
            }
        };
        block(&mut depth, 280, 0.3);
        block(&mut depth, 340, 0.03);
        let region = collected(&scene, &depth, 1_000_000);
        // 1600 pixels gone with the ring of 160 face pixels around them, and both rings of the other.
        let gone = before - region.pixels.len();
        assert_eq!(gone, (1600 + 160) + (160 + 156));
    }
}
