"""A grasp that is shown against the one that was meant."""

from dataclasses import replace

import numpy as np
import pytest

from planegrasp.body import BoxBody
from planegrasp.detector import Detector, DetectorConfig
from planegrasp.errors import TeachingError
from planegrasp.geometry import rotation_angle
from planegrasp.grasping import check_against_body
from planegrasp.objects import ObjectModel
from planegrasp.simulation.showing import SIDES, hold_at, show_grasp


@pytest.mark.parametrize("side", SIDES)
def test_what_is_recorded_is_what_was_shown(pr2, carton_thing, carton_detector, side):
    shown = show_grasp(pr2, carton_thing, carton_detector, side)
    grasp = shown.grasp(side)
    ideal = hold_at(carton_thing.model.outer_body, side)
    off = grasp.T_object_gripper.translation - ideal.translation
    assert np.linalg.norm(off) < 0.0005
    assert rotation_angle(grasp.T_object_gripper.rotation, ideal.rotation) < np.radians(0.3)
    assert grasp.name == side
    assert grasp.opening == pytest.approx(0.95 * 0.09)
    # It is the camera that says where the object is: near the truth, not there.
    assert shown.T_base_object.as_matrix() != pytest.approx(shown.T_base_object_true.as_matrix())
    check_against_body(grasp, carton_thing.model.outer_body)


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("centre", [(0.0, 0.0, 0.0), (0.01, -0.02, -0.0025)])
def test_an_object_is_taken_where_its_body_is(side, centre):
    body = BoxBody((0.2, 0.3, 0.05), centre)
    T = hold_at(body, side)
    axis = 0 if side in ("side", "left") else 1
    local = T.translation - np.array(centre)
    # 30 mm inside of the edge, in the middle of it; towards the middle, fingers along its depth.
    assert abs(local[axis]) == pytest.approx(body.size[axis] / 2 - 0.03)
    assert np.delete(local, axis) == pytest.approx([0.0, 0.0])
    assert T.rotation.apply([1, 0, 0])[axis] == pytest.approx(-np.sign(local[axis]))
    np.testing.assert_allclose(T.rotation.apply([0, 1, 0]), [0, 0, 1], atol=1e-12)
    assert np.sign(local[axis]) == {"side": 1, "top": 1, "left": -1, "bottom": -1}[side]


def test_a_flat_object_is_taken_by_the_body_behind_its_face(photo):
    flat = ObjectModel.from_image("card", photo("coffee", width=160), width=0.2)
    # A sheet of 5 mm behind the face, whose middle is 2.5 mm behind it.
    assert hold_at(flat.outer_body, "side").translation == pytest.approx([0.07, 0.0, -0.0025])


def test_an_unknown_side_is_refused():
    with pytest.raises(TeachingError, match="at side, top, left, bottom, not 'back'"):
        hold_at(BoxBody((0.2, 0.3, 0.05)), "back")


def test_what_does_not_fit_between_the_fingers_is_refused(pr2, carton_thing, carton_detector):
    with pytest.raises(TeachingError, match=r"is 60 mm deep, .* fingers that are 55 mm apart"):
        show_grasp(pr2, carton_thing, carton_detector, opening=0.055)


def test_what_the_camera_does_not_see_is_refused(pr2, carton_thing, book):
    knows_another = Detector([book], DetectorConfig(extractor="orb"))
    with pytest.raises(TeachingError, match="the camera does not see 'cracker-box'"):
        show_grasp(pr2, carton_thing, knows_another)


def test_a_robot_without_gripper_shows_nothing(pr2, carton_thing, carton_detector):
    with pytest.raises(TeachingError, match="a robot without gripper"):
        show_grasp(replace(pr2, gripper=None), carton_thing, carton_detector)
