import math

import numpy as np
import pytest

import planegrasp as pg
from planegrasp.body import FLAT_THICKNESS, BoxBody, body_behind
from planegrasp.boxes import box_face_pose
from planegrasp.errors import InvalidInputError
from planegrasp.geometry import RigidTransform, Rotation
from planegrasp.objects import ObjectModel, PlanarFace


def blank(rows=40, columns=60):
    return np.zeros((rows, columns, 3), np.uint8)


def assert_body(body, size, centre):
    np.testing.assert_allclose(body.size, size, atol=1e-12)
    np.testing.assert_allclose(body.centre, centre, atol=1e-12)


def test_corners_are_those_of_the_box():
    body = BoxBody((0.2, 0.4, 0.6), (1.0, 2.0, 3.0))
    np.testing.assert_allclose(body.corners[0], [0.9, 1.8, 2.7])
    np.testing.assert_allclose(body.corners[1], [0.9, 1.8, 3.3])
    np.testing.assert_allclose(body.corners[4], [1.1, 1.8, 2.7])
    assert_body(BoxBody.around(body.corners), body.size, body.centre)
    np.testing.assert_allclose(body.T_object_body.translation, body.centre)
    assert pg.BoxBody is BoxBody


@pytest.mark.parametrize("size", [(0.1, 0.0, 0.1), (0.1, -1.0, 0.1), (0.1, math.nan, 0.1)])
def test_a_size_must_be_positive(size):
    with pytest.raises(InvalidInputError, match="size of a body must be > 0 m"):
        BoxBody(size)


@pytest.mark.parametrize("size", [(0.1, 0.2), (0.1, 0.2, 0.3, 0.4)])
def test_a_size_has_three_lengths(size):
    with pytest.raises(InvalidInputError, match="three lengths"):
        BoxBody(size)


@pytest.mark.parametrize("centre", [(0.0, 0.0), (0.0, math.inf, 0.0)])
def test_a_centre_has_three_finite_numbers(centre):
    with pytest.raises(InvalidInputError, match="three finite numbers"):
        BoxBody((0.1, 0.1, 0.1), centre)


def test_a_flat_face_gets_a_thin_body_behind_it():
    model = ObjectModel.from_image("book", blank(), 0.3)
    assert model.body is None
    assert_body(model.outer_body, (0.3, 0.2, FLAT_THICKNESS), (0.0, 0.0, -FLAT_THICKNESS / 2))


def test_a_turned_face_has_its_body_behind_it_too():
    T = RigidTransform.from_components([0.0, 0.0, 1.0], Rotation.from_euler("y", math.pi / 2))
    face = PlanarFace("side", blank(), 0.3, None, T)
    # z of the face is the object's x, its x the object's -z.
    assert_body(body_behind([face], 0.02), (0.02, 0.2, 0.3), (-0.01, 0.0, 1.0))


@pytest.mark.parametrize("thickness", [0.0, -0.01, math.nan])
def test_a_thickness_must_be_positive(thickness):
    with pytest.raises(InvalidInputError, match="thickness must be > 0 m"):
        ObjectModel.from_image("book", blank(), 0.3, thickness=thickness)


def test_a_thickness_gives_the_body(photo):
    model = ObjectModel.from_image("book", blank(), 0.3, thickness=0.02)
    assert_body(model.body, (0.3, 0.2, 0.02), (0.0, 0.0, -0.01))
    corners = [(10, 10), (109, 10), (109, 59), (10, 59)]
    cut = ObjectModel.from_corners(
        "book", photo("coffee", width=200), corners, 0.2, 0.1, thickness=0.03
    )
    assert_body(cut.body, (0.2, 0.1, 0.03), (0.0, 0.0, -0.015))


def test_a_frame_with_a_thickness_gives_the_body(photo):
    camera = pg.PinholeCamera(200, 133, 200.0, 200.0, 99.5, 66.0)
    image = photo("coffee", width=200)
    frame = pg.RGBDFrame(image, np.full(image.shape[:2], 0.5, np.float32), camera)
    model = ObjectModel.from_frame(
        "book", frame, [(20, 20), (179, 20), (179, 109), (20, 109)], thickness=0.01
    )
    face = model.faces[0]
    assert_body(model.body, (face.width, face.height, 0.01), (0.0, 0.0, -0.005))


def test_a_box_is_its_own_body():
    size = (0.3, 0.2, 0.1)
    model = ObjectModel.box("tea", size, {"front": blank()})
    assert_body(model.body, size, (0.0, 0.0, 0.0))
    assert model.outer_body is model.body


def test_without_a_body_the_faces_of_a_box_give_it():
    size = (0.3, 0.2, 0.1)
    front = PlanarFace("front", blank(), 0.3, 0.2, box_face_pose(size, "front"))
    top = PlanarFace("top", blank(10, 30), 0.3, 0.1, box_face_pose(size, "top"))
    assert_body(ObjectModel("tea", (front, top)).outer_body, size, (0.0, 0.0, 0.0))
