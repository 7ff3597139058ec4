import numpy as np
import pytest

from planegrasp.errors import CameraError, DepthError, ImageError
from planegrasp.geometry import PinholeCamera
from planegrasp.rgbd import RGBDFrame

CAMERA = PinholeCamera(width=6, height=4, fx=5.0, fy=5.0, cx=2.5, cy=1.5)


def color(height=4, width=6):
    return np.zeros((height, width, 3), np.uint8)


def depth(value=0.7, dtype=np.float32):
    return np.full((4, 6), value, dtype)


def test_a_good_frame_keeps_its_values():
    image = np.arange(72, dtype=np.uint8).reshape(4, 6, 3)
    measured = np.linspace(0.5, 5, 24, dtype=np.float32).reshape(4, 6)
    frame = RGBDFrame(image, measured, CAMERA, name="a", timestamp=1.5)
    np.testing.assert_array_equal(frame.color, image)
    np.testing.assert_array_equal(frame.depth, measured)
    assert frame.depth.dtype == np.float32
    assert frame.has_depth


def test_depth_may_be_missing():
    assert not RGBDFrame(color(), None, CAMERA).has_depth


def test_depth_that_is_all_zero_counts_as_no_depth():
    frame = RGBDFrame(color(), depth(0.0), CAMERA)
    assert not frame.has_depth


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, -0.7])
def test_a_measurement_that_cannot_be_becomes_none(bad):
    measured = depth()
    measured[1, 2] = bad
    frame = RGBDFrame(color(), measured, CAMERA)
    assert frame.depth[1, 2] == 0
    assert np.count_nonzero(frame.depth == np.float32(0.7)) == 23
    assert measured[1, 2] == bad or np.isnan(measured[1, 2])  # the caller's array is not touched


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1.0])
def test_depth_with_only_bad_measurements_is_no_depth(bad):
    assert not RGBDFrame(color(), depth(bad), CAMERA).has_depth


@pytest.mark.parametrize("shape", [(6, 4), (8, 12), (4, 6, 1), (24,), (0, 0)])
def test_depth_of_another_size_is_refused_with_both_sizes(shape):
    with pytest.raises(DepthError, match="aligned to colour, 6×4, got shape") as caught:
        RGBDFrame(color(), np.ones(shape, np.float32), CAMERA)
    assert str(shape) in str(caught.value)


def test_millimetres_by_mistake_are_named():
    with pytest.raises(DepthError, match="median is 700: that looks like millimetres"):
        RGBDFrame(color(), depth(700.0), CAMERA)


@pytest.mark.parametrize("at", [(0, 0), (1, 2)])
def test_millimetres_are_noticed_among_missing_measurements(at):
    measured = depth(0.0)
    measured[at] = 400.0
    with pytest.raises(DepthError, match="millimetres"):
        RGBDFrame(color(), measured, CAMERA)


def test_the_far_end_of_a_room_is_not_taken_for_millimetres():
    assert RGBDFrame(color(), depth(20.0), CAMERA).has_depth


@pytest.mark.parametrize("dtype", [np.uint16, np.int32, np.bool_])
def test_depth_of_integers_is_refused_with_how_to_convert(dtype):
    with pytest.raises(DepthError, match=r"float32 metres, got .*astype\(np.float32\) / 1000"):
        RGBDFrame(color(), depth(1, dtype), CAMERA)


def test_double_precision_depth_is_converted():
    frame = RGBDFrame(color(), depth(0.7, np.float64), CAMERA)
    assert frame.depth.dtype == np.float32


@pytest.mark.parametrize("size", [(6, 4), (4, 7), (3, 6)])
def test_a_camera_of_another_size_is_refused_with_both_sizes(size):
    height, width = size
    with pytest.raises(CameraError, match=f"for 6×4 images, this image is {width}×{height}"):
        RGBDFrame(color(height, width), None, CAMERA)


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (np.zeros((4, 6), np.uint8), r"H×W×3 \(RGB\), got shape \(4, 6\)"),
        (np.zeros((4, 6, 4), np.uint8), r"got shape \(4, 6, 4\)"),
        (np.zeros((4, 6, 3), np.float32), "uint8 .*got float32"),
        (np.zeros((0, 6, 3), np.uint8), "empty"),
    ],
)
def test_colour_that_is_not_rgb_bytes_is_refused(image, message):
    with pytest.raises(ImageError, match=message):
        RGBDFrame(image, None, CAMERA)


def test_views_of_other_arrays_become_contiguous():
    image = np.zeros((4, 6, 6), np.uint8)[..., ::2]
    measured = np.ones((4, 12), np.float32)[:, ::2]
    frame = RGBDFrame(image, measured, CAMERA)
    assert frame.color.flags.c_contiguous
    assert frame.depth.flags.c_contiguous
