"""A drawn gripper is where a camera would see it."""

import numpy as np
import pytest

from planegrasp.geometry import PinholeCamera, RigidTransform, Rotation
from planegrasp.viz.gripper import draw_gripper, gripper_lines

CAMERA = PinholeCamera(640, 480, 500.0, 500.0, 319.5, 239.5)
# Its x to the right in the image, its fingers apart vertically.
T_CAMERA_GRIPPER = RigidTransform.from_translation([0.0, 0.0, 0.5])
COLOR = (255, 176, 0)


def drawn(T, opening=0.08):
    image = np.zeros((480, 640, 3), np.uint8)
    draw_gripper(image, CAMERA, T, opening, COLOR)
    return np.argwhere((image == COLOR).all(axis=2))


def test_the_fingers_are_as_far_apart_as_it_opens():
    pixels = drawn(T_CAMERA_GRIPPER)
    tips = pixels[np.abs(pixels[:, 1] - 335) < 3][
        :, 0
    ]  # near x = 0.016 m, of which the tips end at 0.02
    apart = tips.max() - tips.min()
    # 0.08 m at 0.5 m are 80 pixels, and the line is 4 wide.
    assert apart == pytest.approx(80, abs=6)
    narrow = drawn(T_CAMERA_GRIPPER, 0.04)
    tips = narrow[np.abs(narrow[:, 1] - 335) < 3][:, 0]
    assert tips.max() - tips.min() == pytest.approx(40, abs=6)


def test_the_wrist_is_behind_and_the_tips_are_before_the_origin():
    pixels = drawn(T_CAMERA_GRIPPER)
    points = np.vstack(gripper_lines(0.08))
    assert points[:, 0].max() == pytest.approx(0.02)
    left, right = 319.5 + 1000 * points[:, 0].min(), 319.5 + 1000 * points[:, 0].max()
    assert pixels[:, 1].min() == pytest.approx(left, abs=5)
    assert pixels[:, 1].max() == pytest.approx(right, abs=5)


def test_nothing_behind_the_camera_is_drawn():
    turned = RigidTransform.from_components([0, 0, -0.5], Rotation.identity())
    assert not len(drawn(turned))
