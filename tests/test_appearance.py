import cv2
import numpy as np
import pytest

from planegrasp.appearance import agreement, prepare_appearance
from planegrasp.bench.scenes import CAMERA, facing_pose, rectangles
from planegrasp.bench.textures import OBJECTS, backgrounds
from planegrasp.homography import reference_corners
from planegrasp.objects import ObjectModel
from planegrasp.simulation import Rectangle, render


def gray(image):
    return cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)


def homography(size, corners):
    source = reference_corners(*size).astype(np.float32)
    return cv2.getPerspectiveTransform(source, np.asarray(corners, np.float32))


@pytest.fixture(scope="module")
def seen(photo):
    """A face's appearance, a rendered view of it and the true homography."""

    def make(name="astronaut", tilt=30.0, others=()):
        image = photo(name, width=300)
        T = facing_pose(np.array([0.0, 0.0, 0.7]), np.radians(tilt), 0.4, 0.2)
        face = rectangles(ObjectModel.from_image(name, image, 0.25), T)
        rng = np.random.default_rng(0)
        rendering = render([*face, *others(T)] if others else face, CAMERA, rng,
                           background=backgrounds()[4])  # fmt: skip
        H = homography(image.shape[1::-1], rendering.corners[0])
        return prepare_appearance(gray(image)), gray(rendering.frame.color), H, rendering

    return make


@pytest.mark.parametrize("name", OBJECTS)
def test_a_true_view_agrees(seen, name):
    reference, frame, H, _ = seen(name)
    assert agreement(reference, frame, H) >= 0.9


@pytest.mark.parametrize("tilt", [0.0, 50.0, 70.0])
def test_oblique_views_agree(seen, tilt):
    reference, frame, H, _ = seen(tilt=tilt)
    assert agreement(reference, frame, H) >= (0.9 if tilt < 60 else 0.6)


@pytest.mark.parametrize("name", OBJECTS)
def test_other_faces_at_the_same_place_do_not(seen, photo, name):
    reference, frame, H, _ = seen(name)
    true = agreement(reference, frame, H)
    wrong = []
    for other in set(OBJECTS) - {name}:
        image = photo(other, width=300)
        # The same outline, whatever the other's aspect ratio.
        same_outline = np.diag([1.0, reference.size[1] / len(image), 1.0])
        wrong.append(agreement(prepare_appearance(gray(image)), frame, H @ same_outline))
    assert np.mean(wrong) < 0.3
    # Two dark, smooth photographs may have cells in common.
    assert max(wrong) < true - 0.4


@pytest.mark.parametrize("shift", [(40, 0), (0, -40), (150, 100)])
def test_the_wrong_place_does_not(seen, shift):
    reference, frame, H, _ = seen()
    moved = np.array([[1, 0, shift[0]], [0, 1, shift[1]], [0, 0, 1.0]]) @ H
    assert agreement(reference, frame, moved) < 0.2


def test_the_face_upside_down_does_not(seen):
    reference, frame, H, _ = seen()
    width, height = reference.size
    turned = H @ np.array([[-1, 0, width], [0, -1, height], [0, 0, 1.0]])
    assert agreement(reference, frame, turned) < 0.2


def test_what_is_hidden_is_not_seen(seen):
    def cover(T):
        """A grey board over the left 40 % of the face, just before it."""
        pose = T * type(T).from_translation([-0.125 + 0.05, 0.0, 0.001])
        return [Rectangle(np.full((8, 8, 3), 90, np.uint8), 0.1, 0.3, pose)]

    reference, frame, H, _ = seen(others=cover)
    whole = agreement(*seen()[:3])
    # 40 % of six columns of cells: two are hidden wholly, the third for the most part.
    assert whole - agreement(reference, frame, H) == pytest.approx(0.4, abs=0.12)


def test_what_lies_outside_of_the_image_is_not_seen(photo):
    image = gray(photo("astronaut", width=300))
    # The right half only is in the frame.
    H = np.array([[1.0, 0, -150], [0, 1, 0], [0, 0, 1]])
    frame = np.zeros((400, 600), np.uint8)
    frame[:300, :150] = image[:300, 150:]
    assert agreement(prepare_appearance(image), frame, H) == pytest.approx(0.5, abs=0.06)


@pytest.mark.parametrize(("gain", "bias"), [(0.4, 0), (0.5, 120), (1.0, -20), (1.3, -30)])
def test_lighting_does_not_matter(seen, gain, bias):
    reference, frame, H, _ = seen()
    lit = np.clip(gain * frame.astype(float) + bias, 0, 255).astype(np.uint8)
    assert agreement(reference, lit, H) >= agreement(reference, frame, H) - 0.1


def test_uneven_lighting_does_not_matter(seen):
    reference, frame, H, _ = seen()
    shade = np.linspace(0.3, 1.0, frame.shape[1])
    assert agreement(reference, (frame * shade).astype(np.uint8), H) >= 0.85


def test_a_negative_does_not_agree(seen):
    reference, frame, H, _ = seen()
    assert agreement(reference, 255 - frame, H) < 0.1


def test_a_reference_without_texture_agrees_with_nothing():
    plain = prepare_appearance(np.full((50, 60), 77, np.uint8))
    assert agreement(plain, np.full((480, 640), 77, np.uint8), np.eye(3)) == 0.0


def test_only_textured_cells_are_asked():
    rng = np.random.default_rng(0)
    image = np.full((240, 240), 128, np.uint8)
    image[:, :120] = cv2.resize(rng.integers(0, 256, (24, 12)).astype(np.uint8), (120, 240))
    frame = np.full((480, 640), 50, np.uint8)
    frame[:240, :120] = image[:, :120]  # of the plain half there is nothing
    assert agreement(prepare_appearance(image), frame, np.eye(3)) >= 0.95


def test_the_image_is_compared_without_a_shift_of_half_a_pixel():
    # A pattern two of whose pixels are one sample: half a sample off decorrelates it.
    rng = np.random.default_rng(1)
    pattern = rng.integers(0, 256, (96, 96)).astype(np.uint8)
    big = cv2.resize(pattern, (384, 384), interpolation=cv2.INTER_LINEAR)
    reference = prepare_appearance(pattern)
    H = np.array([[4.0, 0, -0.5], [0, 4.0, -0.5], [0, 0, 1]])  # edges to pixel centres

    def similarity(dx):
        moved = H.copy()
        moved[0, 2] += dx
        return agreement(reference, big, moved)

    # About symmetric: as far to the left as to the right.
    assert similarity(0.0) == 1.0
    left, right = ([similarity(s * d) for d in np.arange(2, 12, 1.0)] for s in (-1, 1))
    assert np.mean(left) == pytest.approx(np.mean(right), abs=0.1)
    assert min(left) < 0.5
