from dataclasses import asdict

import cv2
import numpy as np
import pytest

from planegrasp import _core
from planegrasp.alignment import AlignmentConfig, align, prepare_alignment
from planegrasp.bench.occlusion import occluder
from planegrasp.bench.scenes import CAMERA, random_pose, rectangles
from planegrasp.bench.textures import random_background, texture
from planegrasp.detector import Detector, DetectorConfig
from planegrasp.errors import InvalidInputError
from planegrasp.features.pruning import PruningConfig
from planegrasp.homography import apply_homography, reference_corners
from planegrasp.objects import ObjectModel
from planegrasp.simulation import render


def gray_of(color):
    return cv2.cvtColor(color, cv2.COLOR_RGB2GRAY)


def worst_corner(found, true, face):
    corners = reference_corners(*reversed(face.image.shape[:2]))
    difference = apply_homography(found, corners) - apply_homography(true, corners)
    return np.linalg.norm(difference, axis=1).max()


def scene(photo, name, tilt, hidden=0.0):
    """A frame, the true homography and one whose corners are about a pixel off."""
    rng = np.random.default_rng([tilt, int(10 * hidden)])
    model = ObjectModel.from_image(name, photo(name, width=300), 0.25)
    T = random_pose(rng, np.radians(tilt))
    shown = rectangles(model, T)
    if hidden:
        shown = [*shown, occluder(shown[0], hidden, rng)]
    frame = render(shown, CAMERA, rng).frame
    face = model.faces[0]
    R = T.rotation.as_matrix()
    true = CAMERA.matrix @ np.column_stack([R[:, 0], R[:, 1], T.translation]) @ face.face_from_edge
    corners = reference_corners(*reversed(face.image.shape[:2]))
    off = apply_homography(true, corners) + rng.uniform(-1.0, 1.0, (4, 2))
    start = cv2.getPerspectiveTransform(corners.astype(np.float32), off.astype(np.float32))
    return face, gray_of(frame.color), true, start


@pytest.mark.parametrize("name", ["astronaut", "coffee", "rocket"])
@pytest.mark.parametrize("tilt", [0, 45, 65])
def test_corners_are_found_to_a_fraction_of_a_pixel(photo, name, tilt):
    face, frame, true, start = scene(photo, name, tilt)
    found = align(prepare_alignment(gray_of(face.image)), frame, start)
    assert found is not None
    assert found.accepted
    assert found.score_after > found.score_before
    assert worst_corner(start, true, face) > 0.5
    # Sensor noise moves the corners by hundredths of a pixel; the weak texture's by more.
    assert worst_corner(found.homography, true, face) < (0.25 if name == "rocket" else 0.1)


def test_a_third_rendering_comes_nearer_where_the_start_is_pixels_off(photo):
    errors = []
    for name, tilt in (("astronaut", 0), ("coffee", 0), ("coffee", 45)):
        face, frame, true, _ = scene(photo, name, tilt)
        reference, rng = prepare_alignment(gray_of(face.image)), np.random.default_rng(1)
        for by in rng.uniform(-3.0, 3.0, (16, 2)):
            start = np.array([[1.0, 0.0, by[0]], [0.0, 1.0, by[1]], [0.0, 0.0, 1.0]]) @ true
            found = [align(reference, frame, start, AlignmentConfig(renderings=n)) for n in (2, 3)]
            errors.append([worst_corner(one.homography, true, face) for one in found])
    twice, three_times = np.mean(errors, axis=0)
    # What remains of 0.05 px is the frame's noise, the same in both.
    assert three_times < 0.95 * twice


@pytest.mark.parametrize("tilt", [0, 45])
def test_what_hides_a_third_of_the_face_does_not_pull(photo, tilt):
    face, frame, true, start = scene(photo, "astronaut", tilt, hidden=0.33)
    found = align(prepare_alignment(gray_of(face.image)), frame, start)
    assert found is not None
    assert found.accepted
    assert worst_corner(found.homography, true, face) < 0.2


def test_the_information_is_that_of_the_error(photo):
    """The corners' error in its own sigmas: eight of them, squared, are about eight in sum."""
    face, frame, true, start = scene(photo, "astronaut", 45)
    found = align(prepare_alignment(gray_of(face.image)), frame, start)
    assert found is not None
    corners = reference_corners(*reversed(face.image.shape[:2]))
    error = (apply_homography(found.homography, corners) - apply_homography(true, corners)).ravel()
    assert 0.5 < error @ found.information @ error < 80.0


def test_the_alignment_does_not_move_a_face_by_a_period_of_its_texture():
    """A checkerboard with a picture in one corner: matches know the corner, the rest is alike."""
    board = 60 + 140 * ((np.indices((300, 400)) // 20).sum(axis=0) % 2)
    board[20:80, 20:80] = cv2.resize(
        gray_of(texture("coffee")), (60, 60), None, 0, 0, cv2.INTER_AREA
    )
    image = np.repeat(board.astype(np.uint8)[:, :, None], 3, axis=2)
    model = ObjectModel.from_image("board", image, 0.25)
    detector = Detector([model], DetectorConfig(pruning=PruningConfig(views=40)))
    offsets = []
    for number in range(24, 32):
        rng = np.random.default_rng([1, number])
        tilt, distance = np.radians(rng.uniform(0, 65)), rng.uniform(1.0, 2.2)
        T = random_pose(rng, tilt, distance)
        background = random_background(rng)
        frame = render(rectangles(model, T), CAMERA, rng, background=background).frame
        for found in detector.detect(frame):
            face = found.faces[0]
            off = apply_homography(face.homography, face.reference_points) - face.image_points
            offsets.append(np.median(np.linalg.norm(off, axis=1)))
    assert len(offsets) >= 4
    # A period is 5 to 11 px long here, an inlier at most 3 px off.
    assert np.max(offsets) < 3.0


def test_another_frame_is_no_evidence(photo):
    face, _, _, start = scene(photo, "astronaut", 0)
    other = cv2.resize(gray_of(photo("chelsea")), (640, 480))
    assert align(prepare_alignment(gray_of(face.image)), other, start) is None


def test_a_motion_beyond_the_limit_leaves_the_start(photo):
    face, frame, _, start = scene(photo, "astronaut", 45)
    found = align(
        prepare_alignment(gray_of(face.image)), frame, start, AlignmentConfig(max_motion=0.1)
    )
    assert found is not None
    assert not found.accepted
    np.testing.assert_allclose(found.homography, start / start[2, 2], rtol=1e-12)


@pytest.mark.parametrize(
    "start", [np.full((3, 3), np.nan), np.zeros((3, 3)), np.diag([-1.0, 1.0, 1.0])]
)
def test_impossible_starts_are_no_evidence(photo, start):
    gray = gray_of(photo("coffee", width=160))
    assert align(prepare_alignment(gray), gray, start) is None


def test_arrays_of_other_shapes_are_refused(photo):
    gray = gray_of(photo("coffee", width=160))
    reference = prepare_alignment(gray)
    with pytest.raises(InvalidInputError, match="H×W"):
        prepare_alignment(photo("coffee", width=160))
    with pytest.raises(InvalidInputError, match="≥ 8 px"):
        prepare_alignment(gray[:5].copy())
    with pytest.raises(InvalidInputError, match="3×3"):
        align(reference, gray, np.eye(4))
    with pytest.raises(InvalidInputError, match="contiguous"):
        align(reference, gray.T, np.eye(3))


def test_the_defaults_are_the_cores():
    assert asdict(AlignmentConfig()) == _core.AlignmentSettings.defaults()


@pytest.mark.parametrize(
    "bad",
    [
        {"max_tiles": 0},
        {"min_tiles": -1},
        {"max_motion": 0.0},
        {"start_sigma": float("nan")},
        {"min_correlation": 1.0},
        {"displacement_floor": "wide"},
    ],
)
def test_settings_out_of_range_are_refused(bad):
    with pytest.raises(InvalidInputError):
        AlignmentConfig(**bad)
