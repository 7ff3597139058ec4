"""The measurement of times runs and says what it measured; how long anything takes is no test."""

import numpy as np
import pytest

from planegrasp.bench import speed
from planegrasp.bench.opencv_pipeline import OpenCVPipeline
from planegrasp.bench.scenes import CAMERA, corner_error, photograph, view
from planegrasp.features import make_extractor
from planegrasp.rgbd import RGBDFrame


@pytest.fixture(scope="module")
def result():
    calls = []
    settings = speed.SpeedSettings(frames=2, max_tilt_deg=20.0, photographs=("coffee",))
    made = speed.run(3, settings, lambda: calls.append(None))
    assert len(calls) == settings.steps == 4
    return made


def test_every_stage_is_compared_with_each_number_of_threads(result):
    for stage in ("extract", "match", "homography", "pose", "frame"):
        for threads in ("1_thread", "all_threads"):
            assert 0 < result.figures[f"{stage}.ratio_{threads}"] < np.inf
    assert [(row["threads"], row["stage"]) for row in result.rows] == [
        (threads, stage) for threads in ("1", "all") for stage in speed.STAGES
    ]


def test_both_find_the_face_and_say_so(result):
    for threads in ("1_thread", "all_threads"):
        assert result.figures[f"recall_{threads}"] == 1.0
        assert result.figures[f"opencv_recall_{threads}"] == 1.0
        assert result.figures[f"keypoints_{threads}"] > 100
        assert result.figures[f"opencv_keypoints_{threads}"] > 100


@pytest.fixture(scope="module")
def pipeline():
    return OpenCVPipeline(photograph("coffee"), make_extractor("opencv-sift"))


def test_the_peer_finds_the_face_with_its_pose(pipeline):
    rng = np.random.default_rng(0)
    T, rendering = view(photograph("coffee"), rng, np.radians(20))
    found = pipeline.detect(rendering.frame)
    assert corner_error(found.corners, rendering.corners[0]) < 2.0
    off = np.linalg.inv(found.T_camera_object) @ T.as_matrix()
    assert np.linalg.norm(off[:3, 3]) < 0.01
    assert np.degrees(np.arccos((np.trace(off[:3, :3]) - 1) / 2)) < 5
    assert found.keypoints > 100
    assert set(found.seconds) == {"extract", "match", "homography", "pose"}


def test_the_peer_says_where_it_finds_nothing(pipeline):
    nothing = RGBDFrame(np.full((480, 640, 3), 128, np.uint8), None, CAMERA)
    found = pipeline.detect(nothing)
    assert (found.keypoints, found.corners, found.T_camera_object) == (0, None, None)
