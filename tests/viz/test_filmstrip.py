"""Grids of images."""

from __future__ import annotations

import numpy as np
import pytest

from planegrasp.errors import ImageError, InvalidInputError
from planegrasp.viz import filmstrip


def plain(height, width, value):
    return np.full((height, width, 3), value, np.uint8)


def test_images_lie_in_reading_order():
    strip = filmstrip(
        [plain(30, 40, 10), plain(60, 80, 20), plain(30, 40, 30)], cell_width=40, gap=5, columns=2
    )
    assert strip.shape == (3 * 5 + 2 * 30, 3 * 5 + 2 * 40, 3)
    np.testing.assert_array_equal(strip[5:35, 5:45], 10)
    np.testing.assert_array_equal(strip[5:35, 50:90], 20)
    np.testing.assert_array_equal(strip[40:70, 5:45], 30)
    np.testing.assert_array_equal(strip[40:70, 50:], 255)


def test_captions_are_written_below_and_cut():
    plainly = filmstrip([plain(60, 80, 0)], cell_width=80)
    strip = filmstrip([plain(60, 80, 0)], ["a caption far longer than its image"], cell_width=80)
    extra = len(strip) - len(plainly)
    assert extra > 10
    band = strip[-extra - 12 : -12]
    assert band.min() < 80, "no text"
    np.testing.assert_array_equal(strip[:, -12:], 255)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([],), "at least one image"),
        (([plain(2, 2, 0)], ["a", "b"]), "1 images but 2 captions"),
    ],
)
def test_wrong_arguments(arguments, message):
    with pytest.raises(InvalidInputError, match=message):
        filmstrip(*arguments)
    with pytest.raises(InvalidInputError, match="got -1"):
        filmstrip([plain(2, 2, 0)], columns=-1)
    with pytest.raises(ImageError):
        filmstrip([np.zeros((2, 2), np.uint8)])
