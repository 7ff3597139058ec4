"""Variants hold the same object in a way that looks the same."""

import math
from dataclasses import replace

import numpy as np
import pytest

from planegrasp.errors import GraspError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.grasping import CanonicalGrasp, symmetric_variants

# The gripper reaches for the object's centre from above its y, with a lean, off the middle.
T = RigidTransform.from_components(
    [0.02, 0.08, 0.01], Rotation.from_euler("xyz", [10.0, 20.0, -80.0], degrees=True)
)
CENTRE = (0.0, 0.01, -0.015)


@pytest.fixture
def grasp():
    return CanonicalGrasp("side", T, 0.062, approach=(0.8, 0.0, 0.6))


def names(grasps):
    return [grasp.name for grasp in grasps]


def test_without_a_symmetry_there_is_the_grasp_alone(grasp):
    assert symmetric_variants(grasp, flip=False) == [grasp]


def test_a_flipped_gripper_is_where_it_was_and_moves_as_it_did(grasp):
    same, flipped = symmetric_variants(grasp)
    assert same is grasp
    assert flipped.name == "side/flipped"
    a, b = grasp.T_object_gripper, flipped.T_object_gripper
    np.testing.assert_allclose(b.translation, a.translation, atol=1e-15)
    x, y, z = np.eye(3)
    np.testing.assert_allclose(b.rotation.apply(x), a.rotation.apply(x), atol=1e-15)
    np.testing.assert_allclose(b.rotation.apply(y), -a.rotation.apply(y), atol=1e-15)
    np.testing.assert_allclose(b.rotation.apply(z), -a.rotation.apply(z), atol=1e-15)
    np.testing.assert_allclose(
        flipped.T_object_pregrasp.translation, grasp.T_object_pregrasp.translation, atol=1e-15
    )
    assert (flipped.opening, flipped.force) == (grasp.opening, grasp.force)


@pytest.mark.parametrize(
    ("axis", "signs"), [("x", (1, -1, -1)), ("y", (-1, 1, -1)), ("z", (-1, -1, 1))]
)
def test_an_axis_of_the_object_goes_through_its_centre(grasp, axis, signs):
    _, turned = symmetric_variants(grasp, flip=False, axes=axis, centre=CENTRE)
    assert turned.name == f"side/{axis}"
    expected = np.array(CENTRE) + np.array(signs) * (T.translation - CENTRE)
    np.testing.assert_allclose(turned.T_object_gripper.translation, expected, atol=1e-15)
    R = np.diag(np.array(signs, float)) @ T.rotation.as_matrix()
    np.testing.assert_allclose(turned.T_object_gripper.rotation.as_matrix(), R, atol=1e-15)


def test_two_axes_imply_the_third(grasp):
    found = symmetric_variants(grasp, axes=["z", "x"], centre=CENTRE)
    assert names(found) == [
        "side", "side/flipped", "side/x", "side/x/flipped",
        "side/y", "side/y/flipped", "side/z", "side/z/flipped",
    ]  # fmt: skip
    # A group: turning any of them about any of the axes gives one of them again.
    for variant in found:
        again = symmetric_variants(variant, axes="xyz", centre=CENTRE)
        for other in again:
            distances = [
                (other.T_object_gripper.inv() * one.T_object_gripper).as_exp_coords()
                for one in found
            ]
            assert min(map(np.linalg.norm, distances)) < 1e-12


def test_duplicates_are_dropped(grasp):
    # Along z through the centre: turning the object about z is turning the gripper.
    down = RigidTransform.from_components([0.0, 0.0, 0.1], Rotation.from_euler("y", math.pi / 2))
    straight = replace(grasp, T_object_gripper=down, approach=(1.0, 0.0, 0.0))
    assert names(symmetric_variants(straight, axes="z")) == ["side", "side/flipped"]
    assert names(symmetric_variants(straight, axes="z", flip=False)) == ["side", "side/z"]
    # The same pose with another way there is another grasp.
    slanted = replace(straight, approach=(0.8, 0.0, 0.6))
    assert len(symmetric_variants(slanted, axes="z")) == 4
    shifted = replace(
        straight, T_object_gripper=RigidTransform.from_translation([0.001, 0, 0]) * down
    )
    assert len(symmetric_variants(shifted, axes="z")) == 4


def test_another_axis_is_refused(grasp):
    with pytest.raises(GraspError, match="about its x, y or z, not 'w'"):
        symmetric_variants(grasp, axes=["x", "w"])
