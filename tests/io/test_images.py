"""Images come back exactly; every bad file is an error that names it and its fault."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from planegrasp.errors import DepthError, ImageError, InvalidInputError, SourceError
from planegrasp.io import read_color, read_depth, write_color, write_depth


@pytest.fixture
def color() -> np.ndarray:
    gradient = np.arange(60 * 80 * 3) % 251
    return gradient.reshape(60, 80, 3).astype(np.uint8)


@pytest.fixture
def depth() -> np.ndarray:
    metres = np.arange(60 * 80).reshape(60, 80).astype(np.float32) / 1000
    metres[0, :10] = 0
    return metres


def test_color_round_trip_keeps_channel_order(tmp_path, color):
    write_color(tmp_path / "new" / "a.png", color)
    np.testing.assert_array_equal(read_color(tmp_path / "new" / "a.png"), color)
    assert cv2.imread(str(tmp_path / "new" / "a.png"))[0, 1].tolist() == color[0, 1, ::-1].tolist()
    assert [p.name for p in (tmp_path / "new").iterdir()] == ["a.png"]


def test_grey_and_alpha_become_three_channels(tmp_path, color):
    cv2.imwrite(str(tmp_path / "grey.png"), color[:, :, 0])
    cv2.imwrite(str(tmp_path / "alpha.png"), np.dstack([color, color[:, :, 0]]))
    np.testing.assert_array_equal(read_color(tmp_path / "grey.png")[:, :, 2], color[:, :, 0])
    np.testing.assert_array_equal(read_color(tmp_path / "alpha.png"), color[:, :, ::-1])


@pytest.mark.parametrize("scale", [0.001, 0.0001, 0.0002])
def test_depth_round_trip(tmp_path, depth, scale):
    write_depth(tmp_path / "d.png", depth, scale)
    back = read_depth(tmp_path / "d.png", scale)
    assert back.dtype == np.float32
    np.testing.assert_allclose(back, depth, atol=scale * 1e-3)


def test_depth_array_is_metres_whatever_the_scale(tmp_path, depth):
    write_depth(tmp_path / "d.npy", depth)
    np.testing.assert_array_equal(read_depth(tmp_path / "d.npy", 0.5), depth)


def test_writing_no_measurement(tmp_path):
    write_depth(tmp_path / "d.png", np.array([[np.nan, np.inf, -1.0, 0.5]], np.float32))
    np.testing.assert_allclose(read_depth(tmp_path / "d.png"), [[0, 0, 0, 0.5]])


def test_depth_too_far_for_the_file_is_refused(tmp_path):
    with pytest.raises(DepthError, match=r"700 m does not fit 16 bits at 0\.001"):
        write_depth(tmp_path / "d.png", np.full((2, 2), 700.0, np.float32))
    assert not (tmp_path / "d.png").exists()


def test_a_failed_write_keeps_the_old_file(tmp_path, color):
    write_color(tmp_path / "a.png", color)
    with pytest.raises(ImageError):
        write_color(tmp_path / "a.png", color.astype(np.float32))
    np.testing.assert_array_equal(read_color(tmp_path / "a.png"), color)


@pytest.mark.parametrize("name", ["a.txt", "a"])
def test_unknown_format_is_refused(tmp_path, color, depth, name):
    with pytest.raises(InvalidInputError, match="format"):
        write_color(tmp_path / name, color)
    with pytest.raises(InvalidInputError, match=r"\.png"):
        write_depth(tmp_path / name, depth)


@pytest.mark.parametrize("read", [read_color, read_depth])
def test_missing_empty_folder_and_other_content(tmp_path, read):
    with pytest.raises(SourceError, match=r"there is no file .*gone\.png"):
        read(tmp_path / "gone.png")
    with pytest.raises(SourceError, match="is a folder"):
        read(tmp_path)
    (tmp_path / "empty.png").touch()
    with pytest.raises(SourceError, match=r"empty\.png is empty"):
        read(tmp_path / "empty.png")
    (tmp_path / "text.png").write_text("<html>404</html>")
    with pytest.raises(SourceError, match="not an image: it starts with b'<html>40'"):
        read(tmp_path / "text.png")


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".webp"])
@pytest.mark.parametrize("kept", [0.2, 0.5, 0.9, 0.99])
def test_truncated_image(tmp_path, color, suffix, kept):
    path = tmp_path / f"a{suffix}"
    write_color(path, cv2.resize(color, (640, 480)))
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * kept)])
    with pytest.raises(SourceError, match=rf"a\{suffix} is a truncated"):
        read_color(path)


def test_truncated_and_damaged_depth(tmp_path, depth):
    for name in ("d.png", "d.npy"):
        write_depth(tmp_path / name, depth)
        data = (tmp_path / name).read_bytes()
        (tmp_path / name).write_bytes(data[: len(data) // 2])
        with pytest.raises(SourceError, match=f"{name} is a truncated"):
            read_depth(tmp_path / name)


def test_colour_image_as_depth(tmp_path, color):
    write_color(tmp_path / "c.png", color)
    with pytest.raises(SourceError, match=r"not a depth image: .* has 3 of 8"):
        read_depth(tmp_path / "c.png")
    np.save(tmp_path / "i.npy", np.ones((2, 2), np.uint16))
    with pytest.raises(SourceError, match="uint16"):
        read_depth(tmp_path / "i.npy")


@pytest.mark.parametrize("scale", [0.0, -1.0, np.nan, np.inf])
def test_impossible_scale(tmp_path, depth, scale):
    with pytest.raises(InvalidInputError, match="depth_scale"):
        write_depth(tmp_path / "d.png", depth, scale)
    with pytest.raises(InvalidInputError, match="depth_scale"):
        read_depth(tmp_path / "d.png", scale)
