"""Libraries so large that faces are proposed, from the features of a frame to the detections."""

from dataclasses import replace

import numpy as np
import pytest

from planegrasp.bench.scenes import CAMERA, facing_pose, rectangles
from planegrasp.bench.textures import backgrounds
from planegrasp.detector import Detector, DetectorConfig
from planegrasp.features.pruning import PruningConfig
from planegrasp.objects import ObjectModel
from planegrasp.rgbd import RGBDFrame
from planegrasp.simulation import render

# Faces of 3000 descriptors each, together more than 40 000.
FILLERS = 14


@pytest.fixture(scope="module")
def taught(photo):
    return ObjectModel.from_image("chelsea", photo("chelsea", width=300), 0.25)


@pytest.fixture(scope="module")
def detector(taught):
    """A photograph, and faces whose descriptors are like its own, their components rearranged."""
    config = DetectorConfig(pruning=PruningConfig(views=20))
    teacher = Detector([taught], config)
    ((_, features),) = prepared = teacher.prepared(taught)
    rng = np.random.default_rng(0)
    for number in range(FILLERS):
        plain = np.full((60, 60, 3), 128, np.uint8)
        ((reference, _),) = teacher.prepared(
            ObjectModel.from_image(f"filler-{number}", plain, 0.25)
        )
        rearranged = features.descriptors[:, rng.permutation(features.descriptors.shape[1])]
        prepared.append((reference, replace(features, descriptors=rearranged)))
    assert sum(len(features.points) for _, features in prepared) > 40_000
    return Detector.of(prepared, config)


@pytest.mark.parametrize(("tilt", "roll"), [(0, 0.0), (35, 2.0), (60, -1.0)])
def test_what_is_in_view_is_proposed_and_found(detector, taught, tilt, roll):
    pose = facing_pose(np.array([0.02, -0.01, 0.7]), np.radians(tilt), 0.4, roll)
    rng = np.random.default_rng(tilt)
    scene = render(rectangles(taught, pose), CAMERA, rng, background=backgrounds()[4])
    report = detector.explain(scene.frame)
    assert [d.name for d in report.detections] == ["chelsea"]
    np.testing.assert_allclose(report.detections[0].corners, scene.corners[0], atol=1.0)
    stages = {report.object: report.stage for report in report.faces}
    assert stages.pop("chelsea") == "found"
    # Nothing of the others agrees where they are.
    assert list(stages.values()).count("proposal") > FILLERS // 2


@pytest.mark.parametrize("image", ["plain", "foreign"])
def test_of_a_frame_that_shows_none_of_them_few_faces_or_none_are_looked_at(detector, image):
    color = np.full((480, 640, 3), 90, np.uint8)
    if image == "foreign":
        rng = np.random.default_rng(1)
        color = render([], CAMERA, rng, background=backgrounds()[2]).frame.color
    report = detector.explain(RGBDFrame(color, None, CAMERA))
    assert report.detections == ()
    assert len(report.faces) == FILLERS + 1
    proposal = [report for report in report.faces if report.stage == "proposal"]
    assert all("agree where it is" in report.reason for report in proposal)
    if image == "plain":
        assert len(proposal) == FILLERS + 1
    else:
        assert len(proposal) > FILLERS // 2
