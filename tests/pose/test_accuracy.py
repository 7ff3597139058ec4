"""What the pose must reach: a 0.2 m face at 0.7 m, f = 525 px, a Kinect v1's depth noise."""

from __future__ import annotations

import numpy as np
import pytest
from pose_scenes import Scene, cover_of, errors, medians, tilted

from planegrasp.errors import PoseError
from planegrasp.pose import make_pose_estimator

SEEDS = 40


def poses():
    rng = np.random.default_rng(20240601)
    for seed in range(SEEDS):
        yield seed, tilted(rng.uniform(0, 45), rng.uniform(0, 360), rng.uniform(0, 360))


@pytest.mark.parametrize(
    ("name", "rotation_limit", "translation_limit"), [("fused", 0.15, 1.0), ("pnp", 0.5, 1.0)]
)
def test_medians_from_0_to_45_degrees(name, rotation_limit, translation_limit):
    estimator = make_pose_estimator(name)
    pairs = []
    for seed, T in poses():
        scene = Scene(T, seed=seed)
        result = estimator.estimate(scene.observations(), scene.frame())
        pairs.append(errors(result.T_camera_object, T))
    assert len(pairs) == SEEDS
    rotation, translation = medians(pairs)
    assert rotation <= rotation_limit
    assert translation <= translation_limit


@pytest.mark.parametrize("nearer", [0.01, 0.02, 0.05, 0.1, 0.3])
def test_medians_with_40_percent_hidden(nearer):
    estimator = make_pose_estimator("fused")
    pairs = []
    for seed, T in poses():
        scene = Scene(T, covers=(cover_of(T, 0.4, nearer),), seed=seed)
        result = estimator.estimate(scene.observations(), scene.frame())
        pairs.append(errors(result.T_camera_object, T))
    assert medians(pairs)[0] <= 0.4


def test_fused_beats_the_three_look_ups_by_far():
    fused, three = [], []
    for seed, T in poses():
        scene = Scene(T, seed=seed, margin=0.004)
        faces, frame = scene.observations(), scene.frame()
        fused.append(errors(make_pose_estimator("fused").estimate(faces, frame).T_camera_object, T))
        try:
            result = make_pose_estimator("three_point").estimate(faces, frame)
        except PoseError:
            continue
        three.append(errors(result.T_camera_object, T))
    assert medians(fused)[0] < 0.2 * medians(three)[0]
