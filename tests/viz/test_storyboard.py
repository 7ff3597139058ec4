"""The storyboard: pictures are where they belong, and in which shape."""

import numpy as np
import pytest

from planegrasp.errors import InvalidInputError
from planegrasp.viz.storyboard import storyboard


def plain(value, rows=50, columns=80):
    return np.full((rows, columns, 3), value, np.uint8)


def test_each_picture_is_in_its_place():
    stories = [
        ("first", [[plain(10), plain(20)], [plain(30), plain(40)]]),
        ("second", [[plain(50), plain(60)], [plain(70), plain(80)]]),
    ]
    board = storyboard(stories, ("before", "after"), ("near", "far"), cell=(160, 100), gap=8)
    assert board.shape[1] == 2 * (160 + 8) + 8
    # Down the middle of each column, away from the labels: paper, and the pictures in order.
    for column, values in ((0, (10, 30, 50, 70)), (1, (20, 40, 60, 80))):
        line = board[:, 8 + column * 168 + 155, 0]
        seen = [v for v in dict.fromkeys(line.tolist()) if v in range(10, 90)]
        assert seen == list(values)
        assert [int((line == v).sum()) for v in values] == [100] * 4


def test_the_middle_of_another_shape_is_kept():
    picture = plain(200, 100, 100)
    picture[:20], picture[80:] = 0, 0
    board = storyboard([("", [[picture]])], ("",), ("",), cell=(100, 60), gap=5)
    # What is left of 100 rows are the middle 60: none of the black bands.
    assert (board[-35, 30:100] == 200).all()
    assert int((board[:, 100, 0] == 200).sum()) == 60


@pytest.mark.parametrize("rows", [[[plain(1)]], [[plain(1)], [plain(1)]]])
def test_missing_pictures_are_an_error(rows):
    with pytest.raises(InvalidInputError, match="needs 1 rows of 2 pictures"):
        storyboard([("a", rows)], ("one", "two"), ("view",))
