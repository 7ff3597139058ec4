//! Scenes with exact truth, for tests.
#![allow(clippy::unwrap_used)]

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector2, Vector3};

use crate::camera::Camera;
use crate::face::{Correspondence, Face};
use crate::plane_observation::inverse_plane;
use crate::random::SplitMix64;

/// Inverse-depth noise of a Kinect v1 [1/m]: 1.425e-3·z² m in depth (Khoshelham, Elberink 2012).
pub const KINECT_SIGMA: f64 = 1.425e-3;

/// A face of an object in front of a camera.
pub struct Scene {
    pub camera: Camera,
    pub T_camera_object: Isometry3<f64>,
    pub T_object_face: Isometry3<f64>,
    pub size: (f64, f64),
}

impl Scene {
    /// A 0.2 m square 0.7 m away, tilted [rad] about an axis in its plane.
    pub fn tilted(tilt: f64, azimuth: f64) -> Self {
        let frontal = UnitQuaternion::from_scaled_axis(Vector3::x() * std::f64::consts::PI);
        let axis = Vector3::new(azimuth.cos(), azimuth.sin(), 0.0);
        let rotation = UnitQuaternion::from_scaled_axis(axis * tilt) * frontal;
        Self {
            camera: Camera::new((640, 480), (525.0, 525.0), (319.5, 239.5), [0.0; 5]).unwrap(),
            T_camera_object: Isometry3::from_parts(Translation3::new(0.02, -0.03, 0.7), rotation),
            T_object_face: Isometry3::identity(),
            size: (0.2, 0.2),
        }
    }

    pub fn T_camera_face(&self) -> Isometry3<f64> {
        self.T_camera_object * self.T_object_face
    }

    /// The face seen without noise at these points [m].
    pub fn face(&self, points: &[Vector2<f64>]) -> Face {
        self.noisy_face(points, 0.0, 0)
    }

    /// The face seen with Gaussian noise [px] at these points [m].
    pub fn noisy_face(&self, points: &[Vector2<f64>], sigma: f64, seed: u64) -> Face {
        let mut random = SplitMix64::new(seed);
        let T = self.T_camera_face();
        let see = |p: &Vector2<f64>| Correspondence {
            face: *p,
            image: self
                .camera
                .project(T.rotation * p.push(0.0) + T.translation.vector)
                .unwrap()
                + Vector2::new(random.normal(), random.normal()) * sigma,
        };
        let points = points.iter().map(see).collect();
        let H = self.homography();
        Face::new(self.T_object_face, self.size, points, H).unwrap()
    }

    /// From face points [m] to pixels, exactly.
    pub fn homography(&self) -> Matrix3<f64> {
        let T = self.T_camera_face();
        let R = T.rotation.to_rotation_matrix();
        let c = &self.camera;
        let K = Matrix3::new(c.fx, 0.0, c.cx, 0.0, c.fy, c.cy, 0.0, 0.0, 1.0);
        let (r1, r2) = (R.matrix().column(0), R.matrix().column(1));
        K * Matrix3::from_columns(&[r1.into(), r2.into(), T.translation.vector])
    }

    /// Adds this face to a depth image [m] wherever it is nearer; noise sigma in inverse depth.
    pub fn render(&self, depth: &mut [f32], sigma: f64, seed: u64) {
        let mut random = SplitMix64::new(seed ^ 0xDEAD_BEEF);
        let T = self.T_camera_face();
        let q = inverse_plane(&T, &Vector3::z(), &Vector3::zeros());
        for v in 0..self.camera.height {
            for u in 0..self.camera.width {
                let pixel = Vector2::new(u as f64, v as f64);
                let Some(ray) = self.camera.ray(pixel) else {
                    continue;
                };
                let w = q.dot(&ray.push(1.0));
                let at = T.inverse_transform_point(&(ray.push(1.0) / w).into());
                let inside = at.x.abs() <= self.size.0 / 2.0 && at.y.abs() <= self.size.1 / 2.0;
                let known = f64::from(depth[v * self.camera.width + u]);
                if w > 0.0 && inside && (known == 0.0 || known > 1.0 / w) {
                    let noisy = 1.0 / (w + sigma * random.normal());
                    depth[v * self.camera.width + u] = noisy as f32;
                }
            }
        }
    }

    /// A depth image of this face alone.
    pub fn depth(&self, sigma: f64, seed: u64) -> Vec<f32> {
        let mut depth = vec![0.0; self.camera.width * self.camera.height];
        self.render(&mut depth, sigma, seed);
        depth
    }
}

/// count × count points that fill a width × height face.
pub fn grid(width: f64, height: f64, count: usize) -> Vec<Vector2<f64>> {
    let at = |i: usize, size: f64| size * ((i as f64 + 0.5) / count as f64 - 0.5);
    let row = |j: usize| (0..count).map(move |i| Vector2::new(at(i, width), at(j, height)));
    (0..count).flat_map(row).collect()
}

/// Angle [rad] and distance [m] between two poses.
pub fn pose_distance(a: &Isometry3<f64>, b: &Isometry3<f64>) -> (f64, f64) {
    (
        a.rotation.angle_to(&b.rotation),
        (a.translation.vector - b.translation.vector).norm(),
    )
}
