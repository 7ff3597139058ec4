import cv2
import numpy as np
import pytest

from planegrasp._core import Appearance
from planegrasp.bench.scenes import CAMERA, facing_pose, rectangles
from planegrasp.bench.textures import OBJECTS, backgrounds
from planegrasp.errors import InvalidInputError
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
    """A face's appearance, a rendered view of it, the true homography and the face's size."""

    def make(name="astronaut", tilt=30.0, others=()):
        image = photo(name, width=300)
        T = facing_pose(np.array([0.0, 0.0, 0.7]), np.radians(tilt), 0.4, 0.2)
        face = rectangles(ObjectModel.from_image(name, image, 0.25), T)
        rng = np.random.default_rng(0)
        rendering = render([*face, *others(T)] if others else face, CAMERA, rng,
                           background=backgrounds()[4])  # fmt: skip
        size = image.shape[1::-1]
        H = homography(size, rendering.corners[0])
        return Appearance(gray(image)), gray(rendering.frame.color), H, size

    return make


@pytest.mark.parametrize("name", OBJECTS)
def test_a_true_view_agrees(seen, name):
    reference, frame, H, _ = seen(name)
    assert reference.agreement(frame, H) >= 0.9


@pytest.mark.parametrize("tilt", [0.0, 50.0, 70.0])
def test_oblique_views_agree(seen, tilt):
    reference, frame, H, _ = seen(tilt=tilt)
    assert reference.agreement(frame, H) >= (0.9 if tilt < 60 else 0.6)


@pytest.mark.parametrize("name", OBJECTS)
def test_other_faces_at_the_same_place_do_not(seen, photo, name):
    reference, frame, H, size = seen(name)
    true = reference.agreement(frame, H)
    wrong = []
    for other in set(OBJECTS) - {name}:
        image = photo(other, width=300)
        # The same outline, whatever the other's aspect ratio.
        same_outline = np.diag([1.0, size[1] / len(image), 1.0])
        wrong.append(Appearance(gray(image)).agreement(frame, H @ same_outline))
    assert np.mean(wrong) < 0.3
    # Two dark, smooth photographs may have cells in common.
    assert max(wrong) < true - 0.4


@pytest.mark.parametrize("shift", [(40, 0), (0, -40), (150, 100)])
def test_the_wrong_place_does_not(seen, shift):
    reference, frame, H, _ = seen()
    moved = np.array([[1, 0, shift[0]], [0, 1, shift[1]], [0, 0, 1.0]]) @ H
    assert reference.agreement(frame, moved) < 0.2


def test_the_face_upside_down_does_not(seen):
    reference, frame, H, (width, height) = seen()
    turned = H @ np.array([[-1, 0, width], [0, -1, height], [0, 0, 1.0]])
    assert reference.agreement(frame, turned) < 0.2


def test_what_is_hidden_is_not_seen(seen):
    def cover(T):
        """A grey board over the left 40 % of the face, just before it."""
        pose = T * type(T).from_translation([-0.125 + 0.05, 0.0, 0.001])
        return [Rectangle(np.full((8, 8, 3), 90, np.uint8), 0.1, 0.3, pose)]

    reference, frame, H, _ = seen(others=cover)
    all_seen, unhidden, same_place, _ = seen()
    whole = all_seen.agreement(unhidden, same_place)
    # 40 % of six columns of cells: two are hidden wholly, the third for the most part.
    assert whole - reference.agreement(frame, H) == pytest.approx(0.4, abs=0.12)


def test_what_lies_outside_of_the_image_is_not_seen(photo):
    image = gray(photo("astronaut", width=300))
    # The right half only is in the frame.
    H = np.array([[1.0, 0, -150], [0, 1, 0], [0, 0, 1]])
    frame = np.zeros((400, 600), np.uint8)
    frame[:300, :150] = image[:300, 150:]
    assert Appearance(image).agreement(frame, H) == pytest.approx(0.5, abs=0.06)


@pytest.mark.parametrize(("gain", "bias"), [(0.4, 0), (0.5, 120), (1.0, -20), (1.3, -30)])
def test_lighting_does_not_matter(seen, gain, bias):
    reference, frame, H, _ = seen()
    lit = np.clip(gain * frame.astype(float) + bias, 0, 255).astype(np.uint8)
    assert reference.agreement(lit, H) >= reference.agreement(frame, H) - 0.1


def test_uneven_lighting_does_not_matter(seen):
    reference, frame, H, _ = seen()
    shade = np.linspace(0.3, 1.0, frame.shape[1])
    assert reference.agreement((frame * shade).astype(np.uint8), H) >= 0.85


def test_a_negative_does_not_agree(seen):
    reference, frame, H, _ = seen()
    assert reference.agreement(255 - frame, H) < 0.1


def test_a_reference_without_texture_agrees_with_nothing():
    plain = Appearance(np.full((50, 60), 77, np.uint8))
    assert plain.agreement(np.full((480, 640), 77, np.uint8), np.eye(3)) == 0.0


def test_only_textured_cells_are_asked():
    rng = np.random.default_rng(0)
    image = np.full((240, 240), 128, np.uint8)
    image[:, :120] = cv2.resize(rng.integers(0, 256, (24, 12)).astype(np.uint8), (120, 240))
    frame = np.full((480, 640), 50, np.uint8)
    frame[:240, :120] = image[:, :120]  # of the plain half there is nothing
    assert Appearance(image).agreement(frame, np.eye(3)) >= 0.95


def test_the_image_is_compared_without_a_shift_of_half_a_pixel():
    # A pattern two of whose pixels are one sample: half a sample off decorrelates it.
    rng = np.random.default_rng(1)
    pattern = rng.integers(0, 256, (96, 96)).astype(np.uint8)
    big = cv2.resize(pattern, (384, 384), interpolation=cv2.INTER_LINEAR)
    reference = Appearance(pattern)
    H = np.array([[4.0, 0, -0.5], [0, 4.0, -0.5], [0, 0, 1]])  # edges to pixel centres

    def similarity(dx):
        moved = H.copy()
        moved[0, 2] += dx
        return reference.agreement(big, moved)

    # About symmetric: as far to the left as to the right.
    assert similarity(0.0) == 1.0
    left, right = ([similarity(s * d) for d in np.arange(2, 12, 1.0)] for s in (-1, 1))
    assert np.mean(left) == pytest.approx(np.mean(right), abs=0.1)
    assert min(left) < 0.5


def plain_opencv(image, frame, H):
    """The same measure, by OpenCV's filters."""
    side, cells = 96, 6
    reference = cv2.resize(image, (side, side), interpolation=cv2.INTER_AREA)
    height, width = image.shape
    scale = np.diag([width / side, height / side, 1.0])
    half = np.array([[1, 0, 0.5], [0, 1, 0.5], [0, 0, 1.0]])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    warped = cv2.warpPerspective(frame, H @ scale @ half, (side, side), flags=flags)
    size = side // cells
    a, b = (
        cv2.GaussianBlur(i.astype(np.float32), (0, 0), 1.5)
        .reshape(cells, size, cells, size)
        .swapaxes(1, 2)
        .reshape(cells**2, size**2)
        for i in (reference, warped)
    )
    a, b = (i - i.mean(axis=1, keepdims=True) for i in (a, b))
    correlation = (a * b).sum(axis=1) / np.maximum(
        np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1), 1e-6
    )
    return np.mean(correlation[a.std(axis=1) >= 6] >= 0.5)


@pytest.mark.parametrize("shift", [0, 6, 12, 30])
@pytest.mark.parametrize("name", OBJECTS)
def test_it_is_what_opencv_s_filters_give(seen, photo, name, shift):
    reference, frame, H, _ = seen(name, tilt=50.0)
    moved = np.array([[1, 0, shift], [0, 1, 0], [0, 0, 1.0]]) @ H
    expected = plain_opencv(gray(photo(name, width=300)), frame, moved)
    # A cell at a threshold may fall to either side: one of up to 36, of few where most are plain.
    assert reference.agreement(frame, moved) == pytest.approx(expected, abs=0.06)


@pytest.mark.parametrize("shape", [(1, 1), (5, 400), (2000, 3)])
def test_references_of_odd_sizes_will_do(shape):
    image = np.random.default_rng(0).integers(0, 256, shape).astype(np.uint8)
    assert 0.0 <= Appearance(image).agreement(image, np.eye(3)) <= 1.0


@pytest.mark.parametrize("H", [np.zeros((3, 3)), np.full((3, 3), np.nan), np.full((3, 3), 1e300)])
def test_a_homography_to_nowhere_shows_nothing(seen, H):
    reference, frame, _, _ = seen()
    assert reference.agreement(frame, H) == 0.0


@pytest.mark.parametrize(
    ("gray_shape", "frame_shape", "H_shape", "message"),
    [
        ((0, 5), (9, 9), (3, 3), r"reference height must be > 0"),
        ((5, 0), (9, 9), (3, 3), r"reference width must be > 0"),
        ((5, 5, 3), (9, 9), (3, 3), r"gray must be H×W, got shape \[5, 5, 3\]"),
        ((5, 5), (9, 9, 3), (3, 3), r"frame must be H×W"),
        ((5, 5), (9, 9), (2, 3), r"homography must be 3×3, got shape \[2, 3\]"),
    ],
)
def test_arrays_of_other_shapes_are_refused(gray_shape, frame_shape, H_shape, message):
    with pytest.raises(InvalidInputError, match=message):
        Appearance(np.zeros(gray_shape, np.uint8)).agreement(
            np.zeros(frame_shape, np.uint8), np.zeros(H_shape)
        )


def test_an_empty_frame_shows_nothing():
    image = np.random.default_rng(0).integers(0, 256, (50, 50)).astype(np.uint8)
    assert Appearance(image).agreement(np.zeros((0, 0), np.uint8), np.eye(3)) == 0.0
