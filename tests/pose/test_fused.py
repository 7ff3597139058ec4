"""Pose from reprojection and depth: exact, robust against covers, honest about depth's bias."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pose_scenes import (
    Rectangle,
    Scene,
    cover_of,
    errors,
    medians,
    taught_too_small,
    tilted,
)

from planegrasp.errors import PoseError
from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation
from planegrasp.pose import FusedConfig, FusedEstimator, PnPEstimator

ESTIMATOR = FusedEstimator()
SMALL_CAMERA = PinholeCamera(320, 240, 262.5, 262.5, 159.5, 119.5)  # quick to render
SIDE = RigidTransform.from_components([0.1, 0.0, -0.1], Rotation.from_euler("y", 90, True))


def estimate(scene: Scene, config: FusedConfig | None = None, **depth):
    faces = scene.observations()
    return FusedEstimator(config or FusedConfig()).estimate(faces, scene.frame(**depth))


@settings(deadline=None, max_examples=40)
@given(
    tilt=st.floats(0, 75),
    azimuth=st.floats(0, 360),
    roll=st.floats(0, 360),
    distance=st.floats(0.4, 1.5),
)
def test_exact_evidence_gives_the_exact_pose(tilt, azimuth, roll, distance):
    T = tilted(tilt, azimuth, roll, distance)
    scene = Scene(T, pixel_noise=0.0, points=30)
    result = estimate(scene, depth=scene.exact_depth())
    rotation, translation = errors(result.T_camera_object, T)
    # Depth is float32: 6e-8 of it, over the face's extent about 1e-6 rad at the most.
    assert rotation < np.degrees(2e-6)
    assert translation < 2e-3
    assert result.depth_pixels > 100


def test_a_lens_changes_nothing():
    camera = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5, (-0.28, 0.09, 1e-3, -7e-4, -0.02))
    T = RigidTransform.from_components([0.15, -0.1, 0.6], tilted(35, 30, 20).rotation)
    scene = Scene(T, camera=camera, pixel_noise=0.0)
    result = estimate(scene, depth=scene.exact_depth())
    rotation, translation = errors(result.T_camera_object, T)
    assert rotation < np.degrees(2e-6)
    assert translation < 2e-3
    # Read without the lens the same depth is a bent surface: what the test would notice.
    flat = Scene(T, pixel_noise=0.0)
    wrong = ESTIMATOR.estimate(flat.observations(), flat.frame(scene.exact_depth()))
    assert errors(wrong.T_camera_object, T)[1] > 0.05


def test_the_same_evidence_gives_the_same_answer():
    scene = Scene(tilted(30), covers=(cover_of(tilted(30), 0.4, 0.05),))
    faces, frame = scene.observations(), scene.frame()
    first, second = (ESTIMATOR.estimate(faces, frame) for _ in range(2))
    assert np.array_equal(first.T_camera_object.as_matrix(), second.T_camera_object.as_matrix())
    assert np.array_equal(first.covariance, second.covariance)


@pytest.mark.parametrize("estimator", [FusedEstimator(), PnPEstimator()])
def test_several_objects_get_the_poses_that_they_get_alone(estimator):
    scene = Scene(tilted(30, 40, 50))
    frame, faces = scene.frame(), scene.observations()
    fewer = [
        replace(f, face_points=f.face_points[:9], image_points=f.image_points[:9]) for f in faces
    ]
    hopeless = [
        replace(f, face_points=f.face_points[:2], image_points=f.image_points[:2]) for f in faces
    ]
    behind = [replace(f, homography=f.homography @ np.diag([-1.0, 1.0, 1.0])) for f in faces]
    results = estimator.estimate_all([faces, hopeless, behind, fewer], frame)
    for observations, result in ((faces, results[0]), (fewer, results[3])):
        alone = estimator.estimate(observations, frame)
        np.testing.assert_array_equal(
            result.T_camera_object.as_matrix(), alone.T_camera_object.as_matrix()
        )
        np.testing.assert_array_equal(result.covariance, alone.covariance)
    for observations, error in ((hopeless, results[1]), (behind, results[2])):
        assert isinstance(error, PoseError)
        with pytest.raises(PoseError, match=re.escape(str(error))):
            estimator.estimate(observations, frame)
    assert estimator.estimate_all([], frame) == []


@pytest.mark.parametrize("seed", range(5))
def test_depth_settles_what_the_image_leaves_ambiguous(seed):
    T = tilted(14, 50)
    scene = Scene(T, width=0.05, height=0.05, points=25, seed=seed)
    faces = scene.observations()
    assert ESTIMATOR.estimate(faces, scene.frame_without_depth()).ambiguous
    result = ESTIMATOR.estimate(faces, scene.frame())
    assert not result.ambiguous
    # 35 px across, about 800 depth pixels: 2.4e-3 / √(800 / 4) / 0.019 · 0.7 = 0.4° (one sigma).
    assert errors(result.T_camera_object, T)[0] < 1.5


@pytest.mark.parametrize("seed", range(5))
def test_weak_depth_still_chooses_between_the_two_planar_solutions(seed):
    T = tilted(20, 50)
    scene = Scene(T, width=0.05, height=0.05, points=25, seed=seed)
    noisy = 1.0 / (1.0 / scene.exact_depth() + scene.rng.normal(0, 0.02, (480, 640)))
    result = estimate(scene, depth=noisy)
    assert result.depth_pixels > 0
    assert errors(result.T_camera_object, T)[0] < 10


class TestWithoutUsableDepth:
    SCENE = Scene(tilted(35, 20), seed=4)
    FACES = SCENE.observations()
    EXPECTED = PnPEstimator().estimate(FACES, SCENE.frame_without_depth())

    def assert_falls_back(self, depth):
        frame = self.SCENE.frame_without_depth()
        if depth is not None:
            frame = replace(frame, depth=depth.astype(np.float32))
        result = ESTIMATOR.estimate(self.FACES, frame)
        assert result.depth_pixels == 0
        expected = self.EXPECTED.T_camera_object.as_matrix()
        assert np.array_equal(result.T_camera_object.as_matrix(), expected)
        assert np.array_equal(result.covariance, self.EXPECTED.covariance)

    def test_none(self):
        self.assert_falls_back(None)

    def test_all_zero(self):
        self.assert_falls_back(np.zeros((480, 640)))

    def test_only_the_background(self):
        self.assert_falls_back(np.full((480, 640), 1.5))

    def test_too_few_pixels(self):
        depth = np.zeros((480, 640))
        depth[230:235, 320:325] = self.SCENE.exact_depth()[230:235, 320:325]
        self.assert_falls_back(depth)

    def test_a_plane_that_contradicts_the_image(self):
        # 20° off at the right distance: the depth of something else.
        other = Scene(tilted(15, 20), width=0.6, height=0.6)
        self.assert_falls_back(other.exact_depth())

    def test_half_of_the_pixels_missing_is_still_usable(self):
        depth = self.SCENE.exact_depth()
        depth[self.SCENE.rng.random(depth.shape) < 0.5] = 0
        result = ESTIMATOR.estimate(self.FACES, self.SCENE.frame(depth))
        assert result.depth_pixels > 500


@pytest.mark.parametrize("nearer", [0.02, 0.05, 0.1, 0.3])
def test_a_cover_with_its_own_depth_does_not_bend_the_pose(nearer):
    pairs = []
    for seed in range(12):
        T = tilted(4 * seed, 77 * seed, 31 * seed)
        scene = Scene(T, covers=(cover_of(T, 0.4, nearer),), seed=seed)
        result = estimate(scene)
        assert result.depth_pixels > 300
        pairs.append(errors(result.T_camera_object, T))
    rotation, translation = medians(pairs)
    assert rotation < 0.15
    assert translation < 1.0
    assert max(pair[0] for pair in pairs) < 0.5


def test_a_slanted_hand_over_most_of_the_face_does_not_win_over_the_matches():
    T = tilted(25, 40)
    slant = RigidTransform.from_components([0.0, -0.04, 0.03], Rotation.from_euler("x", 20, True))
    hand = Rectangle(T * slant, 0.3, 0.12)
    pairs = []
    for seed in range(8):
        scene = Scene(T, covers=(hand,), seed=seed, points=300)
        pairs.append(errors(estimate(scene).T_camera_object, T))
    assert medians(pairs)[0] < 0.2


def test_two_faces_are_better_than_one():
    T = tilted(35, 80)
    one, two = [], []
    for seed in range(20):
        scene = Scene(T, faces=(RigidTransform.identity(), SIDE), seed=seed, points=60)
        faces, frame = scene.observations(), scene.frame()
        assert all(len(face.face_points) > 50 for face in faces)
        single, both = (ESTIMATOR.estimate(some, frame) for some in (faces[:1], faces))
        assert np.trace(both.covariance) < np.trace(single.covariance)
        assert both.depth_pixels > single.depth_pixels
        one.append(errors(single.T_camera_object, T))
        two.append(errors(both.T_camera_object, T))
    assert medians(two)[0] < medians(one)[0]
    assert medians(two)[1] < medians(one)[1]
    # A side face alone gives the pose of the object, not that of the face.
    alone = ESTIMATOR.estimate(faces[1:], frame)
    assert errors(alone.T_camera_object, T)[0] < 0.5


@pytest.mark.parametrize("bias", [0.98, 1.02])
def test_a_biased_depth_camera_shares_the_blame_with_the_size_and_does_not_bend_the_tilt(bias):
    rotations, shares = [], []
    for seed in range(12):
        T = tilted(10 + 3 * seed, 77 * seed)
        result = estimate(Scene(T, seed=seed), bias=bias)
        assert result.depth_pixels > 500
        rotations.append(errors(result.T_camera_object, T)[0])
        followed = result.T_camera_object.translation[2] / T.translation[2] - 1
        shares.append(followed / (bias - 1))
        deviation = np.sqrt(np.trace(result.covariance[:3, :3]))
        assert abs(followed) * 0.7 < 3 * deviation
    assert np.median(rotations) < 0.15
    # 1.5 % for the taught size against 1 % for depth: 2.25 / 3.25 of the disagreement.
    assert np.median(shares) == pytest.approx(2.25 / 3.25, abs=0.1)


@pytest.mark.parametrize("error", [-0.03, 0.03])
def test_a_badly_measured_face_is_found_at_the_distance_that_depth_says_mostly(error):
    T = tilted(30)
    scene = Scene(T, seed=1)
    faces = [taught_too_small(face, error) for face in scene.observations()]
    fused = ESTIMATOR.estimate(faces, scene.frame())
    pnp = PnPEstimator().estimate(faces, scene.frame())
    assert errors(fused.T_camera_object, T)[0] < 0.2
    assert errors(pnp.T_camera_object, T)[1] > 18  # 3 % of 0.7 m
    assert errors(fused.T_camera_object, T)[1] < 8


def test_a_face_at_grazing_angle_uses_no_depth():
    T = RigidTransform.from_components([0.0, 0.0, 0.5], tilted(82).rotation)
    scene = Scene(T, pixel_noise=0.2, points=300)
    assert estimate(scene).depth_pixels == 0


@pytest.mark.parametrize("tilt", [5, 40])
def test_the_covariance_says_how_large_the_errors_are(tilt):
    # The simulated noise is independent from pixel to pixel, which the settings then have to say.
    config = FusedConfig(correlation_area=1.0)
    squared = []
    for seed in range(200):
        T = tilted(tilt, 40 * seed, 70 * seed)
        scene = Scene(T, camera=SMALL_CAMERA, seed=seed, points=80, pixel_noise=0.3)
        size_error = scene.rng.normal(0, config.size_sigma)
        faces = [taught_too_small(face, size_error) for face in scene.observations()]
        frame = scene.frame(bias=1 + scene.rng.normal(0, config.depth_bias_sigma))
        result = FusedEstimator(config).estimate(faces, frame)
        error = result.T_camera_object.inv() * T
        local = np.concatenate([error.translation, error.rotation.as_rotvec()])
        squared.append(local @ np.linalg.solve(result.covariance, local))
    # Chi-squared with six degrees of freedom has the mean 6; over 200 draws its mean has a
    # deviation of 0.25. Robust weights make the covariance about 15 % wide.
    assert 4.3 < np.mean(squared) < 7.0


def test_depth_makes_the_tilt_of_a_frontal_face_certain():
    scene = Scene(tilted(3), seed=1)
    faces = scene.observations()
    with_depth = ESTIMATOR.estimate(faces, scene.frame()).covariance
    without = ESTIMATOR.estimate(faces, scene.frame_without_depth()).covariance
    assert np.sqrt(with_depth[3, 3]) < 0.2 * np.sqrt(without[3, 3])


class TestSettings:
    T = tilted(35, 20)

    def difference(self, **settings):
        """Of the covariance's trace and of the depth pixels, changed over default."""
        scene = Scene(self.T, seed=1)
        faces, frame = scene.observations(), scene.frame()
        default = ESTIMATOR.estimate(faces, frame)
        changed = FusedEstimator(FusedConfig(**settings)).estimate(faces, frame)
        tilt = changed.covariance[3, 3] / default.covariance[3, 3]
        return tilt, changed.depth_pixels / default.depth_pixels

    def test_depth_sigma(self):
        assert self.difference(depth_sigma=0.01)[0] > 5

    def test_depth_sigma_floor(self):
        assert self.difference(depth_sigma_floor=0.01)[0] > 5

    def test_correlation_area(self):
        # At the default stride each depth pixel stands for 9, so 90 leave a tenth of them.
        assert 3 < self.difference(correlation_area=90.0)[0] < 11

    def test_max_depth_pixels(self):
        assert self.difference(max_depth_pixels=500)[1] < 0.3

    def test_min_depth_pixels(self):
        assert self.difference(min_depth_pixels=4000)[1] == 0

    def test_erosion(self):
        assert self.difference(erosion=30.0)[1] < 0.6

    def test_max_view_angle(self):
        assert self.difference(max_view_angle=np.radians(30))[1] == 0

    def test_depth_gate(self):
        scene = Scene(self.T, seed=1)
        narrow = estimate(scene, FusedConfig(depth_gate=0.03), bias=1.06)
        assert narrow.depth_pixels == 0
        assert estimate(scene, bias=1.06).depth_pixels > 500

    def test_size_sigma(self):
        # Exact, the taught size keeps depth's bias out of the distance.
        scene = Scene(self.T, seed=1)
        exact = estimate(scene, FusedConfig(size_sigma=0.0), bias=1.02)
        assert errors(exact.T_camera_object, self.T)[1] < 2.0
        assert errors(estimate(scene, bias=1.02).T_camera_object, self.T)[1] > 7

    def test_depth_bias_sigma(self):
        # Few points leave the distance to depth: trusted fully it follows, else hardly.
        T = tilted(35, 20, distance=1.2)
        scene = Scene(T, width=0.1, height=0.1, points=12, pixel_noise=0.5, seed=1)
        faces, frame = scene.observations(), scene.frame(bias=1.02)
        trusting = FusedEstimator(FusedConfig(depth_bias_sigma=1e-4)).estimate(faces, frame)
        doubting = FusedEstimator(FusedConfig(depth_bias_sigma=0.05)).estimate(faces, frame)
        z = [r.T_camera_object.translation[2] for r in (trusting, doubting)]
        assert z[0] > z[1] + 0.005
        assert doubting.covariance[2, 2] > 2 * trusting.covariance[2, 2]

    def test_pixel_settings_and_odds_reach_the_core(self):
        assert self.difference(pixel_sigma=5.0) != self.difference()
        assert self.difference(pixel_sigma_floor=5.0) != self.difference()
        scene = Scene(tilted(14, 50), width=0.06, height=0.06, points=60, seed=2)
        faces, frame = scene.observations(), scene.frame_without_depth()
        for odds, ambiguous in ((0.999, False), (1e-12, True)):
            config = FusedConfig(ambiguity_odds=odds)
            assert FusedEstimator(config).estimate(faces, frame).ambiguous is ambiguous


def test_frames_share_their_scale_s_error_and_nothing_else():
    """Where size and depth are exact, the whole covariance is noise; else only along the ray."""
    T = tilted(35, 30, 20)
    scene = Scene(T)
    exact = estimate(scene, FusedConfig(size_sigma=0.0), depth=scene.exact_depth())
    np.testing.assert_allclose(exact.noise_covariance, exact.covariance)
    unsure = estimate(scene, depth=scene.exact_depth())
    shared = unsure.covariance - unsure.noise_covariance
    along = T.rotation.inv().apply(T.translation)
    sigma = np.sqrt(along @ shared[:3, :3] @ along) / (along @ along)
    # Both priors, 1.5 % and 1 %, as one: 0.83 %.
    assert sigma == pytest.approx(0.015 * 0.01 / np.hypot(0.015, 0.01), rel=0.02)
    np.testing.assert_allclose(shared[:3, :3], sigma**2 * np.outer(along, along), atol=1e-8)
    np.testing.assert_allclose(shared[3:], 0.0, atol=1e-15)
    assert np.linalg.eigvalsh(unsure.noise_covariance).min() > 0
