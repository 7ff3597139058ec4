import numpy as np
import pytest

from planegrasp.errors import TeachingError
from planegrasp.geometry import PinholeCamera, Rotation
from planegrasp.objects import ObjectModel
from planegrasp.rgbd import RGBDFrame
from planegrasp.teaching.measure import measure_size

CAMERA = PinholeCamera(640, 480, 525.0, 525.0, 319.5, 239.5, (-0.1, 0.02))
WIDTH, HEIGHT = 0.20, 0.14
T = np.array([0.03, -0.02, 0.7])


def corners_3d(R, t=T):
    x, y = WIDTH / 2, HEIGHT / 2
    return np.array([[-x, y, 0], [x, y, 0], [x, -y, 0], [-x, -y, 0]]) @ R.T + t


def rotation(tilt, roll):
    return Rotation.from_euler("ZYX", [roll, tilt, 180.0], degrees=True).as_matrix()


def scene(R, rng=None, t=T, bulge=0.0):
    """Depth of the rectangle in front of a wall, with a Kinect's noise where `rng` is given."""
    v, u = np.mgrid[0:480, 0:640]
    rays = CAMERA.rays(np.column_stack([u.ravel(), v.ravel()]))
    depth = (R[:, 2] @ t) / (rays @ R[:, 2])
    on_face = (rays * depth[:, None] - t) @ R
    inside = (np.abs(on_face[:, 0]) < WIDTH / 2) & (np.abs(on_face[:, 1]) < HEIGHT / 2)
    depth += bulge * (2 * on_face[:, 0] / WIDTH) ** 2
    depth = np.where(inside, depth, 1.3)
    if rng is not None:
        disparity = 525.0 * 0.075 / depth + rng.normal(0, 0.1, depth.shape)
        depth = 525.0 * 0.075 / (np.round(disparity * 8) / 8)
    depth = depth.reshape(480, 640).astype(np.float32)
    if rng is not None:  # sensors see nothing, or a mixture, along depth edges
        edge = inside.reshape(480, 640)
        near = edge ^ np.roll(edge, 4, axis=1) | edge ^ np.roll(edge, 4, axis=0)
        depth[near & (rng.random(near.shape) < 0.7)] = 0
    return depth


def frame(depth):
    return RGBDFrame(np.zeros((480, 640, 3), np.uint8), depth, CAMERA, name="scene")


@pytest.mark.parametrize(("tilt", "roll"), [(0, 0), (30, 20), (-50, 100)])
def test_without_noise_the_size_is_exact(tilt, roll):
    R = rotation(tilt, roll)
    corners = CAMERA.project(corners_3d(R))
    assert measure_size(frame(scene(R)), corners) == pytest.approx((WIDTH, HEIGHT), rel=1e-4)


def test_a_kinects_noise_costs_less_than_a_percent():
    rng = np.random.default_rng(5)
    for _ in range(10):
        R = rotation(rng.uniform(-45, 45), rng.uniform(-180, 180))
        corners = CAMERA.project(corners_3d(R))
        size = measure_size(frame(scene(R, rng)), corners)
        assert size == pytest.approx((WIDTH, HEIGHT), rel=0.01)


def test_something_in_front_does_not_bend_the_plane():
    R = rotation(20, 0)
    corners = CAMERA.project(corners_3d(R))
    depth = scene(R, np.random.default_rng(1))
    x, y = corners.mean(axis=0).astype(int)
    depth[y - 80 : y + 80, x - 80 : x - 20] = 0.55
    assert measure_size(frame(depth), corners) == pytest.approx((WIDTH, HEIGHT), rel=0.01)


def test_taught_objects_have_the_measured_size():
    R = rotation(25, 5)
    model = ObjectModel.from_frame("book", frame(scene(R)), CAMERA.project(corners_3d(R)))
    face = model.faces[0]
    assert (face.width, face.height) == pytest.approx((WIDTH, HEIGHT), rel=1e-4)
    assert face.image.shape[0] / face.image.shape[1] == pytest.approx(HEIGHT / WIDTH, rel=0.02)


def test_no_depth_is_an_error():
    with pytest.raises(TeachingError, match="'scene' has no depth to measure"):
        measure_size(frame(None), CAMERA.project(corners_3d(rotation(0, 0))))


@pytest.mark.parametrize("share", [0.0, 0.1])
def test_too_little_depth_is_an_error_with_the_numbers(share):
    R = rotation(0, 0)
    depth = scene(R)
    depth[np.random.default_rng(0).random(depth.shape) > share] = 0
    with pytest.raises(TeachingError, match=r"only \d+ of \d+ pixels inside the corners"):
        measure_size(frame(depth), CAMERA.project(corners_3d(R)))


def test_a_bent_surface_is_refused():
    R = rotation(0, 0)
    with pytest.raises(TeachingError, match=r"scatters by .* mm about a plane"):
        measure_size(frame(scene(R, bulge=0.08)), CAMERA.project(corners_3d(R)))


@pytest.mark.parametrize(
    ("moved", "message"), [((0.06, 0.0), "side is"), ((0.0, 0.06), "not those of a rectangle")]
)
def test_corners_that_are_not_a_rectangle_are_refused(moved, message):
    R = rotation(10, 0)
    points = corners_3d(R)
    inwards = R @ np.array([moved[0], -moved[1], 0.0])
    points[0] += inwards
    if moved[1]:  # both left corners slide: a parallelogram
        points[3] += inwards
    with pytest.raises(TeachingError, match=message):
        measure_size(frame(scene(R)), CAMERA.project(points))
