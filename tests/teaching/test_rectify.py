import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planegrasp.errors import CameraError, InvalidInputError, TeachingError
from planegrasp.geometry import PinholeCamera, Rotation
from planegrasp.objects import ObjectModel
from planegrasp.teaching.rectify import estimate_aspect, rectify

CAMERA = PinholeCamera(640, 480, 525.0, 530.0, 319.5, 239.5)
FISHY = PinholeCamera(640, 480, 525.0, 530.0, 319.5, 239.5, (-0.25, 0.06, 0.001, -0.002))
WIDTH, HEIGHT = 0.24, 0.18
SQUARE = [[100, 100], [300, 100], [300, 260], [100, 260]]


def pattern(x, y):
    """A smooth texture of the face, x and y in metres from its centre: grey levels 0 … 255."""
    waves = np.sin(140 * x + 20 * y) + np.sin(90 * y - 60 * x + 1) + np.sin(170 * y + 2)
    return 127.5 + 40.0 * waves


def pose(tilt=35.0, roll=10.0):
    R = Rotation.from_euler("ZYX", [roll, tilt, 160.0], degrees=True).as_matrix()
    return R, np.array([0.02, -0.01, 0.6])


def face_corners(R, t, width=WIDTH, height=HEIGHT):
    x, y = width / 2, height / 2
    return np.array([[-x, y, 0], [x, y, 0], [x, -y, 0], [-x, -y, 0]]) @ R.T + t


def take_photo(camera, R, t):
    """An exact photo of the pattern on the plane of the face: no resampling is involved."""
    v, u = np.mgrid[0 : camera.height, 0 : camera.width]
    rays = camera.rays(np.column_stack([u.ravel(), v.ravel()]))
    depth = (R[:, 2] @ t) / (rays @ R[:, 2])
    on_face = (rays * depth[:, None] - t) @ R
    grey = pattern(on_face[:, 0], on_face[:, 1]).reshape(camera.height, camera.width)
    return np.repeat(np.rint(grey).astype(np.uint8)[:, :, None], 3, axis=2)


def shift_against_pattern(image, width, height, offset=0.5):
    """Least-squares shift (px) of the image against the pattern, and the remaining RMS (grey)."""
    rows, columns = image.shape[:2]
    pitch_x, pitch_y = width / columns, height / rows

    def ideal(dx=0.0, dy=0.0):
        x = (np.arange(columns) + offset + dx) * pitch_x - width / 2
        y = height / 2 - (np.arange(rows) + offset + dy) * pitch_y
        return pattern(*np.meshgrid(x, y))

    inner = np.s_[3:-3, 3:-3]
    error = (image[:, :, 0].astype(float) - ideal())[inner].ravel()
    gradients = [(ideal(dx=0.1) - ideal(dx=-0.1)) / 0.2, (ideal(dy=0.1) - ideal(dy=-0.1)) / 0.2]
    A = np.column_stack([g[inner].ravel() for g in gradients])
    shift = np.linalg.lstsq(A, error, rcond=None)[0]
    return shift, float(np.sqrt(np.mean(error**2)))


@pytest.mark.parametrize("camera", [CAMERA, FISHY], ids=["pinhole", "lens"])
@pytest.mark.parametrize(("tilt", "roll"), [(0, 0), (35, 10), (-50, 80), (55, 200)])
def test_a_photo_is_straightened_to_a_fraction_of_a_pixel(camera, tilt, roll):
    R, t = pose(tilt, roll)
    corners = camera.project(face_corners(R, t))
    model = ObjectModel.from_corners(
        "book", take_photo(camera, R, t), corners, WIDTH, HEIGHT, camera=camera
    )
    face = model.faces[0]
    shift, rms = shift_against_pattern(face.image, face.width, face.height)
    assert np.abs(shift).max() < 0.03
    assert rms < 1.5
    # The same measurement finds half a pixel where there is one.
    wrong, _ = shift_against_pattern(face.image, face.width, face.height, offset=0.0)
    assert wrong == pytest.approx([0.5, 0.5], abs=0.06)


def test_without_the_camera_the_lens_stays_in_the_picture():
    R, t = pose()
    photo, corners = take_photo(FISHY, R, t), FISHY.project(face_corners(R, t))
    straight = rectify(photo, corners, WIDTH, HEIGHT, FISHY)
    bent = rectify(photo, corners, WIDTH, HEIGHT)
    rms = [shift_against_pattern(r.image, WIDTH, HEIGHT)[1] for r in (straight, bent)]
    assert rms[1] > 3 * rms[0]


def test_a_rectified_photograph_is_the_photograph(photo):
    original = photo("chelsea")
    rows, columns = original.shape[:2]
    edges = np.array(
        [[-0.5, -0.5], [columns - 0.5, -0.5], [columns - 0.5, rows - 0.5], [-0.5, rows - 0.5]]
    )
    corners = np.array([[80.0, 60.0], [860.0, 110.0], [800.0, 640.0], [120.0, 560.0]])
    H = cv2.getPerspectiveTransform(edges.astype(np.float32), corners.astype(np.float32))
    scene = cv2.warpPerspective(
        original, H, (960, 720), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )
    result = rectify(scene, corners, 0.3, 0.3 * rows / columns).image
    again = cv2.resize(result, (columns, rows), interpolation=cv2.INTER_AREA)
    error = np.abs(again.astype(float) - original)[5:-5, 5:-5]
    assert error.mean() < 2.0


def test_the_result_is_as_fine_as_the_photo():
    R, t = Rotation.from_euler("x", np.pi).as_matrix(), np.array([0.0, 0.0, 0.6])
    corners = CAMERA.project(face_corners(R, t))
    image = rectify(take_photo(CAMERA, R, t), corners, WIDTH, HEIGHT, CAMERA).image
    assert image.shape[1] == pytest.approx(525 * WIDTH / 0.6, abs=3)
    assert image.shape[0] / image.shape[1] == pytest.approx(HEIGHT / WIDTH, rel=0.01)


def test_a_large_photo_is_shrunk_without_aliasing():
    fine = (np.indices((400, 5200)).sum(axis=0) % 2 * 255).astype(np.uint8)
    photo = np.repeat(fine[:, :, None], 3, axis=2)
    corners = [[-0.5, -0.5], [5199.5, -0.5], [5199.5, 399.5], [-0.5, 399.5]]
    image = rectify(photo, corners, 5.2, 0.4).image
    assert image.shape[:2] == (154, 2000)
    # Sampling the checkerboard without averaging gives a standard deviation of 127.
    assert image.std() < 20


def test_corners_are_taken_as_printed_not_as_seen(photo):
    upright = photo("coffee", width=300)
    turned = np.ascontiguousarray(np.rot90(upright, -1))
    h, w = turned.shape[:2]
    # Printed top-left is now at the top right of the photo.
    corners = [[w - 0.5, -0.5], [w - 0.5, h - 0.5], [-0.5, h - 0.5], [-0.5, -0.5]]
    np.testing.assert_allclose(rectify(turned, corners, 0.3).image, upright, atol=1)


@given(
    tilt=st.floats(-60, 60),
    roll=st.floats(-180, 180),
    height=st.floats(0.08, 0.5),
    lens=st.booleans(),
)
def test_the_camera_makes_the_aspect_ratio_exact(tilt, roll, height, lens):
    camera = FISHY if lens else CAMERA
    R, t = pose(tilt, roll)
    corners = camera.project(face_corners(R, 2 * t, height=height))
    assert estimate_aspect(corners, camera) == pytest.approx(height / WIDTH, rel=1e-5)


def test_without_the_camera_the_aspect_ratio_is_that_of_the_sides():
    assert estimate_aspect(SQUARE) == pytest.approx(160 / 200)
    R, t = pose(50.0, 0.0)
    corners = CAMERA.project(face_corners(R, t))
    # Foreshortened across: it must come out too high, which is what the camera is for.
    assert estimate_aspect(corners) > 1.3 * HEIGHT / WIDTH


@pytest.mark.parametrize(
    ("corners", "message"),
    [
        ([SQUARE[i] for i in (1, 0, 3, 2)], "counter-clockwise"),
        ([SQUARE[i] for i in (0, 2, 1, 3)], "not a convex quadrilateral"),
        ([[100, 100], [300, 100], [150, 150], [100, 260]], "not a convex quadrilateral"),
        ([[100, 100], [200, 100], [300, 100], [100, 260]], "not a convex quadrilateral"),
        ([[100, 100], [100, 100], [300, 260], [100, 260]], "shortest side .* 0.0 pixels"),
        ([[100, 100], [115, 100], [115, 115], [100, 115]], "at least 24 are needed"),
        (
            [[100, 100], [700, 100], [700, 260], [100, 260]],
            "top-right corner .* outside of the 640",
        ),
        ([[-9, 100], [300, 100], [300, 260], [100, 260]], "top-left corner .* outside"),
    ],
)
def test_corners_that_cannot_be_a_face_are_refused(corners, message):
    with pytest.raises(TeachingError, match=message):
        ObjectModel.from_corners("book", np.zeros((480, 640, 3), np.uint8), corners, 0.2)


@pytest.mark.parametrize(
    "corners", [SQUARE[:3], [[0, 0, 1]] * 4, [[np.nan, 0], *SQUARE[1:]], np.zeros(8)]
)
def test_corners_are_four_finite_points(corners):
    with pytest.raises(InvalidInputError, match="4×2 finite pixels"):
        rectify(np.zeros((480, 640, 3), np.uint8), corners, 0.2)


@pytest.mark.parametrize(("width", "height"), [(0.0, None), (-1.0, 0.2), (0.2, -0.1)])
def test_sizes_must_be_positive(width, height):
    with pytest.raises(InvalidInputError, match="must be > 0 m"):
        rectify(np.zeros((480, 640, 3), np.uint8), SQUARE, width, height)


def test_a_camera_for_other_images_is_refused():
    with pytest.raises(CameraError, match="for 640×480 images, this photo is 320×240"):
        rectify(np.zeros((240, 320, 3), np.uint8), SQUARE, 0.2, camera=CAMERA)
