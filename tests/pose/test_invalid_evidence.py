"""Evidence that cannot give a pose is refused with a typed error that says what is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pose_scenes import Scene, tilted

from planegrasp.errors import InvalidInputError, PlanegraspError, PoseError
from planegrasp.pose import (
    POSE_ESTIMATORS,
    FaceObservation,
    FusedConfig,
    FusedEstimator,
    PnPConfig,
    make_pose_estimator,
)

SCENE = Scene(tilted(30), margin=0.02)
FRAME = SCENE.frame()
FACE = SCENE.observations()[0]

every_estimator = pytest.mark.parametrize("name", list(POSE_ESTIMATORS))
with_points = pytest.mark.parametrize("name", ["fused", "pnp"])


@every_estimator
def test_estimators_are_made_by_name(name):
    estimator = make_pose_estimator(name)
    assert estimator.name == name
    assert estimator.estimate([FACE], FRAME).T_camera_object is not None


def test_an_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(InvalidInputError, match="'epnp': choose one of fused, pnp, three_point"):
        make_pose_estimator("epnp")


@every_estimator
def test_no_face(name):
    with pytest.raises(InvalidInputError, match="at least one face"):
        make_pose_estimator(name).estimate([], FRAME)


@with_points
@pytest.mark.parametrize("count", [0, 3])
def test_too_few_points(name, count):
    few = replace(
        FACE, face_points=FACE.face_points[:count], image_points=FACE.image_points[:count]
    )
    with pytest.raises(PoseError, match=f"at least 4 correspondences on one face, got {count}"):
        make_pose_estimator(name).estimate([few], FRAME)


@with_points
def test_points_on_a_line(name):
    along = np.linspace(-0.08, 0.08, 30)[:, None] * [0.6, 0.8]
    seen = SCENE.camera.project(SCENE.T_camera_object.apply(np.pad(along, ((0, 0), (0, 1)))))
    line = replace(FACE, face_points=along, image_points=seen)
    with pytest.raises(PoseError, match="lie on a line"):
        make_pose_estimator(name).estimate([line], FRAME)


@every_estimator
def test_a_mirrored_homography(name):
    mirrored = replace(FACE, homography=FACE.homography @ np.diag([-1.0, 1.0, 1.0]))
    with pytest.raises(PoseError, match="mirrors the face"):
        make_pose_estimator(name).estimate([mirrored], FRAME)


@every_estimator
def test_a_homography_that_puts_the_face_behind_the_camera(name):
    H = FACE.homography.copy()
    H[2, :2] = (15.0, 0.0)
    with pytest.raises(PoseError, match="behind the camera"):
        make_pose_estimator(name).estimate([replace(FACE, homography=H)], FRAME)


@every_estimator
@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"face_points": FACE.face_points * np.nan}, "face points and image points must be finite"),
        ({"image_points": FACE.image_points + np.inf}, "must be finite"),
        ({"homography": FACE.homography * np.nan}, "homography must be finite"),
        ({"homography": np.eye(2)}, r"homography must be 3×3, got shape \[2, 2\]"),
        ({"face_points": FACE.face_points[:-1]}, "must pair up, got 199 and 200"),
        ({"face_points": np.zeros((200, 3))}, r"face_points must be N×2, got shape \[200, 3\]"),
        ({"image_points": np.zeros(200)}, r"image_points must be N×2, got shape \[200\]"),
        ({"image_points": [["a", "b"]]}, "image_points must be an array of numbers"),
        ({"width": 0.0}, "face width must be > 0 m and finite, got 0"),
        ({"height": float("nan")}, "face height"),
    ],
)
def test_arrays_that_cannot_be_worked_with(name, change, message):
    with pytest.raises(InvalidInputError, match=message):
        make_pose_estimator(name).estimate([replace(FACE, **change)], FRAME)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"pixel_sigma": 0.0}, "pixel_sigma must be > 0"),
        ({"pixel_sigma_floor": -1.0}, "pixel_sigma_floor must be > 0 px and finite, got -1"),
        ({"size_sigma": -0.01}, "size_sigma must be ≥ 0 and < 1, got -0.01"),
        ({"ambiguity_odds": 2.0}, "ambiguity_odds must be between 0 and 1, got 2"),
        ({"depth_sigma": float("nan")}, "sigma must be > 0"),
        ({"depth_sigma_floor": 0.0}, "sigma_floor must be > 0"),
        ({"depth_bias_sigma": 0.0}, "bias_sigma must be > 0"),
        ({"correlation_area": 0.5}, "correlation_area must be ≥ 1"),
        ({"depth_gate": 1.5}, "gate must be between 0 and 1"),
        ({"erosion": -1.0}, "erosion must be ≥ 0"),
        ({"max_depth_pixels": -5}, "max_depth_pixels must be ≥ 0, got -5"),
        ({"max_depth_pixels": 10}, "max_pixels must be ≥ min_pixels, got 10"),
        ({"min_depth_pixels": 1}, "min_pixels must be ≥ 3, got 1"),
        ({"max_view_angle": 1.6}, "max_view_angle must be > 0 and < π/2 rad, got 1.6"),
    ],
)
def test_settings_without_meaning(settings, message):
    with pytest.raises(InvalidInputError, match=message):
        FusedConfig(**settings)
    if set(settings) <= set(PnPConfig.__dataclass_fields__):
        with pytest.raises(InvalidInputError, match=message):
            PnPConfig(**settings)


def test_python_and_the_core_have_the_same_defaults():
    from dataclasses import asdict

    from planegrasp import _core

    assert asdict(FusedConfig()) == _core.FusedSettings.defaults()
    assert asdict(PnPConfig()) == _core.PnPSettings.defaults()


finite = st.floats(-1e3, 1e3)
anything = st.floats(allow_nan=True, allow_infinity=True)


@settings(deadline=None, max_examples=200)
@given(
    homography=arrays(np.float64, (3, 3), elements=finite | anything),
    face_points=arrays(np.float64, (6, 2), elements=finite),
    image_points=arrays(np.float64, (6, 2), elements=finite | anything),
    depth=st.sampled_from([0.0, 0.1, 0.7, 1e-30, 1e30, np.nan, -1.0]),
)
def test_no_evidence_however_absurd_makes_more_than_a_typed_error(
    homography, face_points, image_points, depth
):
    face = FaceObservation(FACE.T_object_face, 0.2, 0.2, face_points, image_points, homography)
    image = np.full((480, 640), depth, np.float32)
    frame = replace(FRAME, depth=None)
    object.__setattr__(frame, "depth", image)  # past the frame's own check
    for name in POSE_ESTIMATORS:
        try:
            estimate = make_pose_estimator(name).estimate([face], frame)
        except PlanegraspError:
            continue
        assert np.all(np.isfinite(estimate.T_camera_object.as_matrix()))


@settings(deadline=None, max_examples=50)
@given(depth=arrays(np.float32, (48, 64), elements=st.floats(width=32)))
def test_absurd_depth_does_not_lose_the_pose(depth):
    scene = Scene(tilted(30), pixel_noise=0.1)
    frame = replace(scene.frame_without_depth())
    image = np.repeat(np.repeat(depth, 10, 0), 10, 1)
    object.__setattr__(frame, "depth", np.ascontiguousarray(image))
    estimate = FusedEstimator().estimate(scene.observations(), frame)
    assert (
        np.degrees((estimate.T_camera_object.inv() * scene.T_camera_object).rotation.magnitude())
        < 3
    )
