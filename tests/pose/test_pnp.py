"""Pose without depth: exact, ambiguous where it is, and as OpenCV's IPPE says."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pose_scenes import CAMERA, Scene, errors, medians, taught_too_small, tilted

from planegrasp import _core
from planegrasp._convert import to_core_camera
from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation
from planegrasp.pose import PnPConfig, PnPEstimator
from planegrasp.pose._convert import to_core_face

ESTIMATOR = PnPEstimator()


@settings(deadline=None, max_examples=60)
@given(
    tilt=st.floats(0, 75),
    azimuth=st.floats(0, 360),
    roll=st.floats(0, 360),
    distance=st.floats(0.3, 3.0),
)
def test_exact_points_give_the_exact_pose(tilt, azimuth, roll, distance):
    T = tilted(tilt, azimuth, roll, distance)
    scene = Scene(T, pixel_noise=0.0, points=20, seed=3, background=10.0)
    estimate = ESTIMATOR.estimate(scene.observations(), scene.frame_without_depth())
    rotation, translation = errors(estimate.T_camera_object, T)
    # Far and frontal a rotation changes a pixel only in second order: rounding of 1e-13 px in a
    # face of 35 px gives a root of it.
    assert rotation < np.degrees(1e-6)
    assert translation < 1e-3
    assert estimate.reprojection_rms < 1e-6
    assert estimate.depth_pixels == 0


def test_distorted_images_give_the_same_pose():
    camera = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5, (-0.28, 0.09, 1e-3, -7e-4, -0.02))
    T = tilted(40, 30, 20, 0.5)
    scene = Scene(T, camera=camera, pixel_noise=0.0)
    estimate = ESTIMATOR.estimate(scene.observations(), scene.frame_without_depth())
    rotation, translation = errors(estimate.T_camera_object, T)
    assert rotation < np.degrees(1e-6)
    assert translation < 1e-3


@pytest.mark.parametrize(("tilt", "azimuth", "roll"), [(10, 20, 0), (35, 200, 70), (65, -60, 190)])
def test_both_planar_solutions_agree_with_opencv(tilt, azimuth, roll):
    scene = Scene(tilted(tilt, azimuth, roll), pixel_noise=0.0, points=40)
    face = scene.observations()[0]
    # OpenCV finds its homography itself, from the same exact points.
    object_points = np.column_stack([face.face_points, np.zeros(len(face.face_points))])
    _, rotations, translations, _ = cv2.solvePnPGeneric(
        object_points, face.image_points, CAMERA.matrix, None, flags=cv2.SOLVEPNP_IPPE
    )
    ours = _core.planar_poses(to_core_face(face), to_core_camera(CAMERA))
    assert len(rotations) == len(ours) == 2
    for T, rotation, translation in zip(ours, rotations, translations, strict=True):
        theirs = RigidTransform.from_components(
            translation.ravel(), Rotation.from_rotvec(rotation.ravel())
        )
        difference = errors(RigidTransform.from_matrix(T), theirs)
        assert difference[0] < 1e-4
        assert difference[1] < 1e-3


@pytest.mark.parametrize("seed", range(5))
def test_a_small_noisy_nearly_frontal_face_is_ambiguous_and_one_of_both_is_right(seed):
    T = tilted(14, 50)
    scene = Scene(T, width=0.04, height=0.04, points=25, seed=seed)
    estimate = ESTIMATOR.estimate(scene.observations(), scene.frame_without_depth())
    assert estimate.ambiguous
    assert estimate.alternative is not None
    both = (estimate.T_camera_object, estimate.alternative)
    assert min(errors(candidate, T)[0] for candidate in both) < 12


@pytest.mark.parametrize("seed", range(5))
def test_a_large_tilted_face_is_not_ambiguous(seed):
    T = tilted(40, 50)
    scene = Scene(T, seed=seed)
    estimate = ESTIMATOR.estimate(scene.observations(), scene.frame_without_depth())
    assert not estimate.ambiguous
    assert errors(estimate.T_camera_object, T)[0] < 1.5


def test_noise_of_half_a_pixel_costs_what_theory_says():
    # 200 points over 150 px at 0.5 px: scale to 0.06 % of 0.7 m, 0.4 mm (one sigma); tilt by
    # foreshortening at 30-45° to about 0.2°. Twice that bounds the median generously.
    pairs = []
    for seed in range(40):
        T = tilted(30 + seed % 16, 40 * seed, 70 * seed)
        scene = Scene(T, seed=seed)
        estimate = ESTIMATOR.estimate(scene.observations(), scene.frame_without_depth())
        pairs.append(errors(estimate.T_camera_object, T))
    rotation, translation = medians(pairs)
    assert rotation < 0.4
    assert translation < 0.8


def test_wrong_matches_are_weighed_down():
    T = tilted(35, 50)
    scene = Scene(T, seed=1)
    face = scene.observations()[0]
    clean = ESTIMATOR.estimate([face], scene.frame_without_depth())
    face.image_points[::8] += (6.0, -4.0)
    spoilt = ESTIMATOR.estimate([face], scene.frame_without_depth())
    assert errors(spoilt.T_camera_object, clean.T_camera_object)[0] < 0.5
    assert spoilt.reprojection_rms > 2


def test_two_faces_settle_what_one_leaves_ambiguous():
    side = RigidTransform.from_components([0.02, 0.0, -0.02], Rotation.from_euler("y", 90, True))
    T = tilted(20, 90)
    both = (RigidTransform.identity(), side)
    counted = 0
    for seed in range(6):
        scene = Scene(T, faces=both, width=0.04, height=0.04, points=25, seed=seed)
        front, right = scene.observations()
        assert len(right.face_points) >= 10
        together = ESTIMATOR.estimate([front, right], scene.frame_without_depth())
        counted += ESTIMATOR.estimate([front], scene.frame_without_depth()).ambiguous
        assert not together.ambiguous
        assert errors(together.T_camera_object, T)[0] < 4
    assert counted >= 3


def test_the_covariance_says_how_large_the_errors_are():
    squared = []
    for seed in range(200):
        T = tilted(30, 40 * seed, 70 * seed)
        scene = Scene(T, seed=seed, points=80)
        size_error = scene.rng.normal(0, ESTIMATOR.config.size_sigma)
        faces = [taught_too_small(face, size_error) for face in scene.observations()]
        estimate = ESTIMATOR.estimate(faces, scene.frame_without_depth())
        error = estimate.T_camera_object.inv() * T
        local = np.concatenate([error.translation, error.rotation.as_rotvec()])
        squared.append(local @ np.linalg.solve(estimate.covariance, local))
    # Chi-squared with six degrees of freedom has the mean 6; over 200 draws its mean has a
    # deviation of 0.25. Cauchy's weights make the covariance about 15 % wide.
    assert 4.3 < np.mean(squared) < 7.0


class TestSettings:
    def test_a_given_pixel_sigma_scales_the_covariance(self):
        scene = Scene(tilted(40, 50))
        faces, frame = scene.observations(), scene.frame_without_depth()
        narrow = PnPEstimator(PnPConfig(pixel_sigma=0.5)).estimate(faces, frame)
        wide = PnPEstimator(PnPConfig(pixel_sigma=5.0)).estimate(faces, frame)
        ratio = wide.covariance[3, 3] / narrow.covariance[3, 3]
        assert 50 < ratio < 100  # 100 for a quadratic loss; Cauchy's flattens at 0.5 px

    def test_the_floor_bounds_the_covariance_of_noise_free_points(self):
        scene = Scene(tilted(40, 50), pixel_noise=0.0)
        faces, frame = scene.observations(), scene.frame_without_depth()
        low = PnPEstimator(PnPConfig(pixel_sigma_floor=0.01)).estimate(faces, frame)
        high = PnPEstimator(PnPConfig(pixel_sigma_floor=0.1)).estimate(faces, frame)
        ratio = high.covariance[3, 3] / low.covariance[3, 3]
        assert ratio == pytest.approx(100, rel=1e-3)

    def test_the_uncertain_size_makes_the_distance_uncertain(self):
        T = tilted(0, distance=0.7)
        scene = Scene(T)
        faces, frame = scene.observations(), scene.frame_without_depth()
        deviations = []
        for size_sigma in (0.0, 0.02):
            estimator = PnPEstimator(PnPConfig(size_sigma=size_sigma))
            deviations.append(np.sqrt(estimator.estimate(faces, frame).covariance[2, 2]))
        assert deviations[0] < 0.001
        assert deviations[1] == pytest.approx(0.014, rel=0.1)

    def test_the_odds_decide_what_is_ambiguous(self):
        scene = Scene(tilted(14, 50), width=0.06, height=0.06, points=60, seed=2)
        faces, frame = scene.observations(), scene.frame_without_depth()
        strict = PnPEstimator(PnPConfig(ambiguity_odds=0.999)).estimate(faces, frame)
        lenient = PnPEstimator(PnPConfig(ambiguity_odds=1e-12)).estimate(faces, frame)
        assert (strict.ambiguous, lenient.ambiguous) == (False, True)
