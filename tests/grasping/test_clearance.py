"""A grasp is checked against the object's body: by hand, and against linear programmes."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from planegrasp.body import BoxBody
from planegrasp.errors import GraspError, InvalidInputError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.grasping import CanonicalGrasp, GripperShape, check_against_body

BOX = BoxBody((0.158, 0.210, 0.060))
# From the right: the gripper's x is the object's -x, its y (the fingers) the object's z.
FACING_LEFT = Rotation.from_matrix(np.column_stack([[-1, 0, 0], [0, 0, 1], [0, 1, 0]]))


def grasp_at(x, y=0.0, z=0.0, opening=0.062):
    T = RigidTransform.from_components([x, y, z], FACING_LEFT)
    return CanonicalGrasp("side", T, opening)


def test_fingertips_around_the_box_are_fine():
    check_against_body(grasp_at(0.06), BOX)
    check_against_body(grasp_at(0.06, y=0.08), BOX)
    # The fingertips just reach it: 0.015 m in front of the gripper's origin.
    check_against_body(grasp_at(0.079 + 0.014), BOX)


@pytest.mark.parametrize(
    ("grasp", "message"),
    [
        # 0.079 is the box's right side.
        (grasp_at(0.179), "nothing between the fingertips: the object is 100.0 mm away"),
        (grasp_at(0.079 + 0.016), "nothing between the fingertips: the object is 16.0 mm away"),
        (grasp_at(0.0, y=0.2), "nothing between the fingertips: the object is 95.0 mm away"),
        # The object is beside the fingers, not between them.
        (grasp_at(0.06, z=0.065), "nothing between the fingertips: the object is 35.0 mm away"),
        (grasp_at(0.06, opening=0.05), r"too narrow: the object is 60.0 mm wide .* are 50.0 mm"),
        # 30 mm of half a box, 31 mm of half an opening: 9 mm remain of 10.
        (grasp_at(0.06, z=0.010), r"right \(-y\) fingertip 9.0 mm inside of the object"),
        (grasp_at(0.06, z=-0.010), r"left \(\+y\) fingertip 9.0 mm inside .* than 62.0 mm"),
        # The palm's front is 60 mm behind the gripper's origin.
        (grasp_at(0.0), "palm 19.0 mm inside of the object: .* move it back"),
        (grasp_at(-0.05), "palm 69.0 mm inside of the object"),
    ],
)
def test_what_is_wrong_is_said_with_figures(grasp, message):
    with pytest.raises(GraspError, match=message) as caught:
        check_against_body(grasp, BOX)
    assert str(caught.value).startswith("grasp 'side' ")


def test_a_palm_wholly_inside_of_the_object_is_noticed():
    block = BoxBody((1.0, 0.5, 0.5))
    with pytest.raises(GraspError, match=r"palm 120\.0 mm inside"):
        check_against_body(grasp_at(0.0, opening=0.6), block)


def test_measured_poses_may_be_off_by_the_tolerance():
    check_against_body(grasp_at(0.06, z=0.0025), BOX)
    strict = GripperShape(tolerance=0.0)
    with pytest.raises(GraspError, match=r"fingertip 1\.5 mm inside"):
        check_against_body(grasp_at(0.06, z=0.0025), BOX, strict)
    check_against_body(grasp_at(0.06), BOX, strict)


def test_the_shape_of_the_gripper_counts():
    grasp = grasp_at(0.06)
    # A palm that reaches to 15 mm behind the fingertips' middle cuts 4 mm into the box.
    with pytest.raises(GraspError, match=r"palm 4\.0 mm inside"):
        check_against_body(grasp, BOX, GripperShape(palm_front=-0.015, finger_back=-0.01))
    # A lower palm passes beside the edge of the box's top, a higher one does not.
    edge = grasp_at(0.0, y=0.12)
    tall = GripperShape(finger_half_height=0.02, palm_half_height=0.014)
    check_against_body(edge, BOX, tall)
    with pytest.raises(GraspError, match="palm"):
        check_against_body(edge, BOX, replace(tall, palm_half_height=0.016))


@pytest.mark.parametrize(
    "changes",
    [
        {"palm_half_width": 0.0},
        {"finger_half_height": -0.01},
        {"tolerance": -0.001},
        {"palm_front": -0.2},
        {"finger_front": -0.03},
        {"palm_front": -0.01},
        {"palm_half_height": float("nan")},
    ],
)
def test_an_impossible_gripper_is_refused(changes):
    with pytest.raises(InvalidInputError, match="got GripperShape"):
        GripperShape(**changes)


def body_constraints(grasp, body):
    """A·p ≤ b for points p of the body in the gripper's frame."""
    R = grasp.T_object_gripper.rotation.as_matrix()
    offset = grasp.T_object_gripper.translation - np.array(body.centre)
    half = np.array(body.size) / 2
    return np.vstack([R, -R]), np.concatenate([half - offset, half + offset])


def extreme(grasp, body, limits, direction):
    """Largest direction·p over the body within limits along x, y, z, or None without a point."""
    A, b = body_constraints(grasp, body)
    done = linprog(-np.array(direction), A_ub=A, b_ub=b, bounds=limits)
    return -done.fun if done.status == 0 else None


def verdict_by_linear_programmes(grasp, body, shape):
    """What is wrong, by an independent method."""
    half = grasp.opening / 2
    fingers = [
        (shape.finger_back, shape.finger_front),
        (None, None),
        (-shape.finger_half_height, shape.finger_half_height),
    ]
    high = extreme(grasp, body, fingers, (0, 1, 0))
    if high is None:
        return "nothing between"
    low = -extreme(grasp, body, fingers, (0, -1, 0))
    if low > half or high < -half:
        return "nothing between"
    if high - low > grasp.opening + 2 * shape.tolerance:
        return "too narrow"
    if max(high - half, -half - low) > shape.tolerance:
        return "left" if high - half > shape.tolerance else "right"
    palm = [
        (shape.palm_back, shape.palm_front),
        (-shape.palm_half_width, shape.palm_half_width),
        (-shape.palm_half_height, shape.palm_half_height),
    ]
    back = extreme(grasp, body, palm, (-1, 0, 0))
    cut = back is not None and shape.palm_front + back > shape.tolerance
    return "palm" if cut else "fine"


@given(
    translation=st.tuples(*[st.floats(-0.15, 0.15)] * 3),
    rotation=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    size=st.tuples(*[st.floats(0.005, 0.25)] * 3),
    opening=st.floats(0.01, 0.3),
)
def test_verdicts_agree_with_linear_programmes(translation, rotation, size, opening):
    T = RigidTransform.from_components(translation, Rotation.from_rotvec(rotation))
    grasp = CanonicalGrasp("side", T, opening)
    body = BoxBody(size, (0.01, -0.02, 0.03))
    shape = GripperShape()
    # Where a verdict turns within a hundredth of a millimetre, either is right.
    expected = {
        verdict_by_linear_programmes(
            grasp, BoxBody(tuple(np.array(size) + change), body.centre), shape
        )
        for change in (-2e-5, 0.0, 2e-5)
    }
    try:
        check_against_body(grasp, body, shape)
        found = "fine"
    except GraspError as error:
        found = next(
            word
            for word in ("nothing between", "too narrow", "left (+y)", "right (-y)", "palm")
            if word in str(error)
        ).split(" (")[0]
    assert found in expected


def test_the_programmes_meet_every_verdict():
    """Else the comparison above would say little."""
    rng = np.random.default_rng(0)
    seen = set()
    for _ in range(400):
        T = RigidTransform.from_components(
            rng.uniform(-0.15, 0.15, 3), Rotation.from_rotvec(rng.uniform(-3, 3, 3))
        )
        grasp = CanonicalGrasp("side", T, rng.uniform(0.01, 0.3))
        body = BoxBody(tuple(rng.uniform(0.005, 0.25, 3)), (0.01, -0.02, 0.03))
        seen.add(verdict_by_linear_programmes(grasp, body, GripperShape()))
    assert seen == {"nothing between", "too narrow", "left", "right", "palm", "fine"}
