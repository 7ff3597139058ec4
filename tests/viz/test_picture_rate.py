"""Which images are shown."""

import pytest

from planegrasp.viz.picture_rate import PictureRate


@pytest.mark.parametrize(
    ("rate", "stamps", "shown"),
    [
        (None, [0.0, 0.01, 0.02], [True, True, True]),
        (0.0, [0.0, 1.0], [False, False]),
        (10.0, [0.0, 0.05, 0.0999, 0.15, 0.21], [True, False, True, False, True]),
        (10.0, [5.0, 4.99, 5.0], [True, True, False]),
        (10.0, [None, None, 1.0, None], [True, True, True, True]),
    ],
)
def test_rates(rate, stamps, shown):
    pictures = PictureRate(rate)
    assert [pictures.is_due(stamp) for stamp in stamps] == shown


def test_restart():
    pictures = PictureRate(1.0)
    assert [pictures.is_due(0.0), pictures.is_due(0.1)] == [True, False]
    pictures.restart()
    assert pictures.is_due(0.2)
