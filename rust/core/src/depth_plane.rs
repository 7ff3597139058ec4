//! The plane that the depth image shows where a face is seen.

use nalgebra::{Isometry3, Vector2, Vector3};

use crate::camera::Camera;
use crate::correlation::samples_per_measurement;
use crate::depth_image::DepthImage;
use crate::depth_region::{RegionRule, collect};
use crate::error::InputError;
use crate::face::Face;
use crate::plane::{FittedPlane, Noise, fit};
use crate::plane_consensus::least_median;
use crate::plane_observation::{PlaneObservation, inverse_plane};
use crate::quadrilateral::Quadrilateral;

/// Seed of the consensus: the same frame always gives the same plane.
const SEED: u64 = 0x9E37;
/// A plane that fewer of the gated pixels agree with is a chance find.
const MIN_INLIER_SHARE: f64 = 0.3;

/// How depth is used.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthConfig {
    /// Standard deviation of a pixel's inverse depth [1/m]; `None` estimates it from the residuals.
    /// A Kinect v1 has 1.425e-3 (Khoshelham and Elberink 2012); stereo has σ_disparity / (f·B).
    pub sigma: Option<f64>,
    /// The estimate does not go below this [1/m].
    pub sigma_floor: f64,
    /// Standard deviation of the relative bias that all depths of a frame share.
    pub bias_sigma: f64,
    /// Pixels over which the noise is correlated: that many count as one measurement.
    pub correlation_area: f64,
    /// Pixels farther from the reprojection's prediction than this share of the depth are not
    /// of the face.
    pub gate: f64,
    /// Distance kept from the face's outline [px].
    pub erosion: f64,
    /// Depth pixels used of each face, about.
    pub max_pixels: usize,
    /// Fewer than this many agreeing pixels of a face are not used.
    pub min_pixels: usize,
    /// Faces seen more obliquely than this contribute no depth [rad].
    pub max_view_angle: f64,
}

impl Default for DepthConfig {
    fn default() -> Self {
        Self {
            sigma: None,
            sigma_floor: 2e-4,
            bias_sigma: 0.01,
            correlation_area: 4.0,
            gate: 0.15,
            erosion: 3.0,
            max_pixels: 4000,
            min_pixels: 30,
            max_view_angle: 80f64.to_radians(),
        }
    }
}

impl DepthConfig {
    /// Refuses settings without meaning.
    pub fn check(&self) -> Result<(), InputError> {
        let require = |ok: bool, name, value, valid| match ok {
            true => Ok(()),
            false => Err(InputError::OutOfRange { name, value, valid }),
        };
        let positive = |name, value: f64| {
            require(
                value.is_finite() && value > 0.0,
                name,
                value,
                "> 0 and finite",
            )
        };
        positive("depth sigma", self.sigma.unwrap_or(1.0))?;
        positive("depth sigma_floor", self.sigma_floor)?;
        positive("depth bias_sigma", self.bias_sigma)?;
        let area = self.correlation_area;
        require(
            area >= 1.0 && area.is_finite(),
            "correlation_area",
            area,
            "≥ 1 px² and finite",
        )?;
        require(
            self.gate > 0.0 && self.gate < 1.0,
            "depth gate",
            self.gate,
            "between 0 and 1",
        )?;
        let erosion = self.erosion;
        require(
            erosion >= 0.0 && erosion.is_finite(),
            "erosion",
            erosion,
            "≥ 0 px and finite",
        )?;
        require(
            self.min_pixels >= 3,
            "min_pixels",
            self.min_pixels as f64,
            "≥ 3",
        )?;
        let enough = self.max_pixels >= self.min_pixels;
        require(enough, "max_pixels", self.max_pixels as f64, "≥ min_pixels")?;
        let angle = self.max_view_angle;
        let right_angle = std::f64::consts::FRAC_PI_2;
        let valid = "> 0 and < π/2 rad";
        require(
            angle > 0.0 && angle < right_angle,
            "max_view_angle",
            angle,
            valid,
        )
    }

    fn noise(&self) -> Noise {
        self.sigma
            .map_or(Noise::AtLeast(self.sigma_floor), Noise::Known)
    }
}

/// Measures the plane of a face that is about where one of `poses` (T_camera_object, the likeliest
/// first) puts it; `None` where depth does not show one.
pub fn observe(
    face: &Face,
    poses: &[Isometry3<f64>],
    camera: &Camera,
    depth: &DepthImage<'_>,
    config: &DepthConfig,
) -> Option<PlaneObservation> {
    let normal = face.T_object_face.rotation * Vector3::z();
    let point = face.T_object_face.translation.vector;
    let predictions: Vec<Vector3<f64>> = poses
        .iter()
        .map(|T| inverse_plane(T, &normal, &point))
        .collect();
    let region = collect(
        camera,
        depth,
        &RegionRule {
            outline: &outline(face, poses.first()?, camera)?,
            erosion: config.erosion,
            predictions: &predictions,
            gate: config.gate,
            max_pixels: config.max_pixels,
        },
        face.points.iter().map(|point| point.image),
    );
    let (start, start_sigma) = least_median(&region.pixels, SEED)?;
    let plane = fit(&region.pixels, start, start_sigma, config.noise())?;
    let needed = (region.pixels.len() as f64 * MIN_INLIER_SHARE).max(config.min_pixels as f64);
    let centre = poses.first()? * nalgebra::Point3::from(point);
    if (plane.inliers as f64) < needed || view_angle(&plane, &centre.coords) > config.max_view_angle
    {
        return None;
    }
    // Noise that is alike in neighbouring pixels: as configured, or as the residuals show.
    let configured = config.correlation_area / region.pixels_per_sample;
    let shown = samples_per_measurement(&region.pixels, &plane.inverse_plane, plane.sigma);
    let independent = 1.0 / shown.max(configured);
    Some(PlaneObservation {
        normal,
        point,
        inverse_plane: plane.inverse_plane,
        information: plane.information * independent,
        pixels: plane.inliers,
    })
}

fn outline(
    face: &Face,
    T_camera_object: &Isometry3<f64>,
    camera: &Camera,
) -> Option<Quadrilateral> {
    let project = |corner: Vector2<f64>| {
        let p = T_camera_object.rotation * face.to_object(corner);
        camera.project(p + T_camera_object.translation.vector)
    };
    let [a, b, c, d] = face.corners().map(project);
    Quadrilateral::new([a?, b?, c?, d?])
}

/// Angle [rad] between a plane's normal and the ray to a point.
fn view_angle(plane: &FittedPlane, point: &Vector3<f64>) -> f64 {
    let cosine = plane
        .inverse_plane
        .normalize()
        .dot(&point.normalize())
        .abs();
    cosine.min(1.0).acos()
}
