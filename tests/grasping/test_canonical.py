"""Grasps adapt as the paper's equations 10 to 12 say; what cannot be a grasp says why."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import planegrasp as pg
from planegrasp.errors import GraspError, InvalidInputError, PlanegraspError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.grasping import CanonicalGrasp, check_unique

angles = st.tuples(*[st.floats(-math.pi, math.pi)] * 3)
places = st.tuples(*[st.floats(-5.0, 5.0)] * 3)
# At most 0.5 m along each axis: always within the 1 m that a grasp may have.
near = st.tuples(*[st.floats(-0.5, 0.5)] * 3)


def pose(translation, rotation_vector=(0.0, 0.0, 0.0)):
    return RigidTransform.from_components(translation, Rotation.from_rotvec(rotation_vector))


poses = st.builds(pose, places, angles)
T_OBJECT_GRIPPER = pose((0.06, -0.01, 0.02), (0.3, -2.0, 1.0))


@pytest.fixture
def grasp():
    return CanonicalGrasp("side", T_OBJECT_GRIPPER, 0.062)


def assert_same(a, b, atol=1e-12):
    np.testing.assert_allclose(a.as_matrix(), b.as_matrix(), rtol=0, atol=atol)


@given(T_base_object=poses, T_object_gripper=st.builds(pose, near, angles), motion=poses)
def test_the_gripper_moves_with_the_object(T_base_object, T_object_gripper, motion):
    T_base_gripper = T_base_object * T_object_gripper
    taught = CanonicalGrasp.teach("side", T_base_object, T_base_gripper, opening=0.05)
    assert_same(taught.adapt(T_base_object), T_base_gripper)
    # Whatever rigid motion moves the object moves the gripper likewise. 1e-12 of up to 10 m.
    assert_same(taught.adapt(motion * T_base_object), motion * T_base_gripper, 1e-11)


@given(T_base_object=poses, T_object_gripper=st.builds(pose, near, angles))
def test_equations_10_and_11_as_matrices(T_base_object, T_object_gripper):
    """By NumPy alone, given as 4×4 matrices."""
    A, G = T_base_object.as_matrix(), T_object_gripper.as_matrix()
    taught = CanonicalGrasp.teach("side", A, A @ G, opening=0.05)
    np.testing.assert_allclose(
        taught.T_object_gripper.as_matrix(), np.linalg.solve(A, A @ G), atol=1e-12
    )
    np.testing.assert_allclose(taught.adapt(A).as_matrix(), A @ G, atol=1e-12)


@given(T_base_object=poses)
def test_equation_12_agrees_with_scipy(T_base_object):
    grasp = CanonicalGrasp("side", T_OBJECT_GRIPPER, 0.062)
    phi, theta, psi = grasp.euler(T_base_object)
    rotation = T_base_object.rotation * T_OBJECT_GRIPPER.rotation
    # Near ±90° of pitch roll and yaw are ill-conditioned: compare the rotation, which is not.
    back = Rotation.from_euler("ZYX", (psi, theta, phi))
    assert (back.inv() * rotation).magnitude() < 1e-7
    if abs(theta) < math.radians(89):
        expected = rotation.as_euler("ZYX")[::-1]
        difference = np.array([phi, theta, psi]) - expected
        np.testing.assert_allclose(np.sin(difference / 2), 0.0, atol=1e-10)


def test_the_pregrasp_lies_back_along_the_approach():
    T = pose((1.0, 0.0, 0.0), (0.0, 0.0, math.pi / 2))
    grasp = CanonicalGrasp("side", np.eye(4), 0.05, pregrasp_distance=0.2)
    # The gripper's x is the base's y there.
    np.testing.assert_allclose(grasp.pregrasp(T).translation, [1.0, -0.2, 0.0], atol=1e-12)
    assert_same(
        RigidTransform.from_rotation(grasp.pregrasp(T).rotation),
        pose((0, 0, 0), (0, 0, math.pi / 2)),
    )
    down = replace(grasp, approach=(0.0, 0.0, -1.0))
    np.testing.assert_allclose(down.pregrasp(T).translation, [1.0, 0.0, 0.2], atol=1e-12)
    np.testing.assert_allclose(down.T_object_pregrasp.translation, [0.0, 0.0, 0.2], atol=1e-12)


def test_a_grasp_is_public_and_has_defaults(grasp):
    assert pg.CanonicalGrasp is CanonicalGrasp
    assert grasp.approach == (1.0, 0.0, 0.0)
    assert (grasp.pregrasp_distance, grasp.force) == (0.10, 40.0)


def test_an_approach_is_made_exactly_one_long(grasp):
    tilted = replace(grasp, approach=(0.7071, 0.7071, 0.0))
    assert np.linalg.norm(tilted.approach) == pytest.approx(1.0, abs=1e-15)


def test_a_gripper_that_opens_too_little_is_told_with_figures(grasp):
    assert grasp.why_too_wide(0.062) == ""
    assert grasp.why_too_wide(0.05) == (
        "needs the fingertips 62.0 mm apart, the gripper opens to 50.0 mm"
    )


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"opening": 0.0}, "opening must be > 0 and at most 1 m, got 0"),
        ({"opening": -0.05}, "opening must be > 0 and at most 1 m, got -0.05"),
        ({"opening": math.nan}, "opening must be > 0 and at most 1 m, got nan"),
        ({"opening": 62.0}, r"opening .* got 62: is it in millimetres \(0.062 m\)\?"),
        ({"pregrasp_distance": 0.0}, "pregrasp_distance must be > 0 and at most 1 m, got 0"),
        ({"pregrasp_distance": 100.0}, r"pregrasp_distance .*millimetres \(0.1 m\)"),
        ({"force": 0.0}, "force must be > 0 N and finite, got 0"),
        ({"force": math.inf}, "force must be > 0 N and finite, got inf"),
        ({"approach": (1.0, 1.0, 0.0)}, r"unit vector .*did you mean \[0.707107, 0.707107, 0.0\]"),
        ({"approach": (0.0, 0.0, 0.0)}, r"unit vector .* got \[0.0, 0.0, 0.0\]$"),
        ({"approach": (1.0, 0.0)}, r"unit vector of three numbers .* got \[1.0, 0.0\]$"),
        ({"approach": (math.nan, 0.0, 0.0)}, "unit vector"),
        ({"T_object_gripper": pose((0.0, 1.2, 0.0))}, r"1.2 m away from the object, at most 1 m"),
    ],
)
def test_what_cannot_be_a_grasp_is_refused(grasp, changes, message):
    with pytest.raises(GraspError, match=message) as caught:
        replace(grasp, **changes)
    assert str(caught.value).startswith("grasp 'side': ")
    assert isinstance(caught.value, PlanegraspError)


@pytest.mark.parametrize("name", ["side", "side/flipped", "side/z/flipped", "top-1"])
def test_names_and_names_of_variants_are_accepted(grasp, name):
    assert replace(grasp, name=name).name == name


@pytest.mark.parametrize("name", ["", "from the side", "/side", "side/", "a//b", "é", None, 3])
def test_other_names_are_refused(grasp, name):
    with pytest.raises(InvalidInputError, match="cannot be the name of a grasp"):
        replace(grasp, name=name)


SHEARED = np.eye(4) + np.outer([1, 0, 0, 0], [0, 0.2, 0, 0])


def test_a_matrix_that_is_not_rigid_is_named(grasp):
    with pytest.raises(InvalidInputError, match=r"T_object_gripper: .*must be a rotation"):
        replace(grasp, T_object_gripper=SHEARED)
    with pytest.raises(InvalidInputError, match=r"T_base_object: .*must be a rotation"):
        CanonicalGrasp.teach("side", SHEARED, np.eye(4), opening=0.05)
    with pytest.raises(InvalidInputError, match=r"T_base_gripper: .*must be a rotation"):
        CanonicalGrasp.teach("side", np.eye(4), SHEARED, opening=0.05)
    with pytest.raises(InvalidInputError, match=r"T_base_object: .*4×4 matrix, got shape \(3, 4\)"):
        grasp.adapt(np.eye(4)[:3])
    many = RigidTransform.from_translation(np.zeros((2, 3)))
    with pytest.raises(InvalidInputError, match=r"T_base_object: .*got shape \(2, 4, 4\)"):
        grasp.pregrasp(many)


T_BASE_OBJECT = pose((2.0, 0.3, 0.7), (0.2, 0.5, -1.0))
T_BASE_GRIPPER = T_BASE_OBJECT * T_OBJECT_GRIPPER


@pytest.mark.parametrize(
    ("T_base_object", "T_base_gripper", "what"),
    [
        (T_BASE_OBJECT.inv(), T_BASE_GRIPPER, "T_object_base was given as T_base_object"),
        (T_BASE_OBJECT, T_BASE_GRIPPER.inv(), "T_gripper_base was given as T_base_gripper"),
        (T_BASE_OBJECT.inv(), T_BASE_GRIPPER.inv(), "both were given inverted"),
    ],
)
def test_swapped_frames_are_recognised(T_base_object, T_base_gripper, what):
    with pytest.raises(GraspError, match=rf"m away .* frames swapped.* If {what}, it is 0.064"):
        CanonicalGrasp.teach("side", T_base_object, T_base_gripper, opening=0.05)


def test_frames_that_no_inverse_explains_are_not_called_inverted():
    far = pose((3.0, 0.0, 0.0)) * T_BASE_GRIPPER
    with pytest.raises(GraspError, match=r"away from the object.*Inverting one or both .* not"):
        CanonicalGrasp.teach("side", T_BASE_OBJECT, far, opening=0.05)


def test_names_must_be_unique(grasp):
    check_unique([grasp, replace(grasp, name="top")], "book")
    with pytest.raises(GraspError, match="'book' has two grasps named 'Side'"):
        check_unique([grasp, replace(grasp, name="Side")], "book")
    with pytest.raises(GraspError, match="of object 'book' must be CanonicalGrasp, got ndarray"):
        check_unique([grasp, np.eye(4)], "book")
