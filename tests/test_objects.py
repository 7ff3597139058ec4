import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planegrasp.boxes import SIDES, box_face_pose, box_face_size
from planegrasp.checks import check_name
from planegrasp.errors import ImageError, InvalidInputError, SourceError
from planegrasp.geometry import RigidTransform, edge_from_pixel
from planegrasp.io.images import write_color
from planegrasp.objects import ObjectModel, PlanarFace

SIZE = (0.2, 0.15, 0.1)


def blank(rows=40, columns=60):
    return np.zeros((rows, columns, 3), np.uint8)


def homogeneous(points):
    return np.column_stack([points, np.ones(len(points))])


@pytest.mark.parametrize("name", ["book", "Book-2", "a", "_x", "v1.2", "0", "-"])
def test_names_that_can_be_folders_are_accepted(name):
    assert check_name(name) == name


@pytest.mark.parametrize(
    "name", ["", ".", "..", ".hidden", "end.", "a/b", "a\\b", "a b", "é", "a\n", "x" * 101, None, 3]
)
def test_other_names_are_refused_with_the_rule(name):
    with pytest.raises(InvalidInputError, match=r"letters \(a-z\), digits"):
        check_name(name)


def test_height_follows_from_the_aspect_ratio():
    assert PlanarFace("front", blank(40, 60), 0.3).height == pytest.approx(0.2)


@pytest.mark.parametrize("width", [0.0, -0.21, float("nan"), float("inf")])
def test_a_width_that_is_not_positive_and_finite_is_refused(width):
    with pytest.raises(InvalidInputError, match=r"width of face 'front' must be > 0 m"):
        PlanarFace("front", blank(), width)


def test_a_height_that_is_not_positive_is_refused():
    with pytest.raises(InvalidInputError, match="height"):
        PlanarFace("front", blank(), 0.2, 0.0)


def test_a_turned_image_is_noticed():
    with pytest.raises(InvalidInputError, match="is the image turned"):
        PlanarFace("front", blank(40, 60), 0.2, 0.45)


@pytest.mark.parametrize("image", [np.zeros((4, 4), np.uint8), np.zeros((4, 4, 3), np.float32)])
def test_an_image_that_is_not_rgb_bytes_is_refused(image):
    with pytest.raises(ImageError):
        PlanarFace("front", image, 0.2)


def test_a_face_does_not_change_with_the_array_it_was_made_of():
    image = blank()
    face = PlanarFace("front", image, 0.2)
    digest = face.image_digest
    image[:] = 255
    assert face.image_digest == digest
    with pytest.raises(ValueError, match="read-only"):
        face.image[0, 0] = 1


def test_the_digest_tells_images_apart_by_shape_too():
    assert (
        PlanarFace("f", blank(40, 60), 0.2).image_digest
        != PlanarFace("f", blank(60, 40), 0.2).image_digest
    )


@given(
    rows=st.integers(1, 2000),
    columns=st.integers(1, 2000),
    width=st.floats(0.01, 10),
    stretch=st.floats(0.55, 1.8),
)
def test_corners_of_the_image_are_corners_of_the_face(rows, columns, width, stretch):
    image = np.broadcast_to(np.zeros(3, np.uint8), (rows, columns, 3))
    face = PlanarFace("front", image, width, stretch * width * rows / columns)
    mapped = homogeneous(face.edge_corners) @ face.face_from_edge.T
    np.testing.assert_allclose(mapped[:, 2], 1.0)
    np.testing.assert_allclose(mapped[:, :2], face.object_corners[:, :2], atol=1e-9)


def test_centre_right_and_top_of_the_image_lie_where_the_paper_says():
    face = PlanarFace("front", blank(40, 60), 0.3, 0.2)
    image_points = np.array([[30, 20, 1], [60, 20, 1], [30, 0, 1]])  # eq. 3
    on_face = (image_points @ face.face_from_edge.T)[:, :2]
    np.testing.assert_allclose(on_face, [[0, 0], [0.15, 0], [0, 0.1]], atol=1e-12)


def test_the_first_pixel_lies_half_a_pixel_inside_of_the_corner():
    face = PlanarFace("front", blank(40, 60), 0.3, 0.2)
    centre = np.append(edge_from_pixel([0, 0]), 1.0)
    pixel = 0.3 / 60
    expected = [-0.15 + pixel / 2, 0.1 - pixel / 2, 1.0]
    np.testing.assert_allclose(face.face_from_edge @ centre, expected)
    np.testing.assert_allclose(face.edge_from_face @ face.face_from_edge, np.eye(3), atol=1e-12)


def test_corners_in_the_object_follow_the_face():
    turned = RigidTransform.from_components([1.0, 2.0, 3.0], box_face_pose(SIZE, "right").rotation)
    face = PlanarFace("side", blank(10, 10), 0.2, None, turned)
    np.testing.assert_allclose(face.object_corners[0], [1.0, 2.1, 3.1])


@pytest.mark.parametrize("count", [0, 7])
def test_an_object_has_one_to_six_faces(count):
    faces = tuple(PlanarFace(f"f{i}", blank(), 0.2) for i in range(count))
    with pytest.raises(InvalidInputError, match=f"has {count} faces: it needs 1 to 6"):
        ObjectModel("book", faces)


def test_face_names_must_differ_in_more_than_case():
    faces = (PlanarFace("front", blank(), 0.2), PlanarFace("Front", blank(), 0.2))
    with pytest.raises(InvalidInputError, match="two faces named"):
        ObjectModel("book", faces)


def test_with_face_adds_or_replaces(carton):
    back = PlanarFace("back", blank(100, 150), 0.15)
    assert [f.name for f in carton.with_face(back).faces] == ["front", "top", "back"]
    front = PlanarFace("front", blank(100, 150), 0.15)
    replaced = carton.with_face(front)
    assert replaced.face("front") is front
    assert len(replaced.faces) == 2
    assert replaced.priority == carton.priority


def test_an_unknown_face_is_named_with_the_known_ones(carton):
    with pytest.raises(InvalidInputError, match="no face 'back'; it has: front, top"):
        carton.face("back")


def test_an_image_file_is_read(tmp_path, photo):
    image = photo("chelsea", width=90)
    write_color(tmp_path / "cat.png", image)
    model = ObjectModel.from_image("cat", tmp_path / "cat.png", 0.2, face="label", priority=2)
    np.testing.assert_array_equal(model.faces[0].image, image)
    assert (model.faces[0].name, model.priority) == ("label", 2)


def test_a_missing_image_file_is_named(tmp_path):
    with pytest.raises(SourceError, match=r"nothing\.png"):
        ObjectModel.from_image("cat", tmp_path / "nothing.png", 0.2)


@pytest.fixture
def sides():
    made = {}
    for side in SIDES:
        width, height = box_face_size(SIZE, side)
        image = blank(round(1000 * height), round(1000 * width))
        made[side] = PlanarFace(side, image, width, height, box_face_pose(SIZE, side))
    return made


def test_every_side_of_a_box_lies_on_the_box_and_faces_outwards(sides):
    for side, face in sides.items():
        np.testing.assert_allclose(np.abs(face.object_corners), np.tile(np.array(SIZE) / 2, (4, 1)))
        T = face.T_object_face
        normal = T.rotation.apply([0.0, 0.0, 1.0])
        assert normal @ T.translation == pytest.approx(np.linalg.norm(T.translation)), side


def test_the_six_sides_of_a_box_lie_apart(sides):
    centres = {tuple(np.round(face.T_object_face.translation, 9)) for face in sides.values()}
    assert len(centres) == 6


@pytest.mark.parametrize(
    ("side", "edge", "other", "other_edge"),
    [
        ("top", (3, 2), "front", (0, 1)),
        ("bottom", (0, 1), "front", (3, 2)),
        ("right", (0, 3), "front", (1, 2)),
        ("left", (1, 2), "front", (0, 3)),
        ("back", (0, 3), "right", (1, 2)),
    ],
)
def test_sides_are_upright_as_the_box_unfolds(sides, side, edge, other, other_edge):
    np.testing.assert_allclose(
        sides[side].object_corners[list(edge)],
        sides[other].object_corners[list(other_edge)],
        atol=1e-12,
    )


def test_a_box_is_made_of_its_photos(carton):
    assert [face.name for face in carton.faces] == ["front", "top"]
    np.testing.assert_allclose(carton.face("top").T_object_face.translation, [0, 0.05, 0])


def test_an_unknown_side_is_refused():
    with pytest.raises(InvalidInputError, match="no side 'lid'; its sides are front"):
        ObjectModel.box("carton", SIZE, {"lid": blank()})


def test_a_photo_that_contradicts_the_boxs_size_is_refused():
    with pytest.raises(InvalidInputError, match="is the image turned"):
        ObjectModel.box("carton", (0.3, 0.1, 0.1), {"front": blank(60, 40)})


def test_a_box_has_a_size_in_three_directions():
    with pytest.raises(InvalidInputError, match="must be > 0 m"):
        ObjectModel.box("carton", (0.3, 0.0, 0.1), {"front": blank()})
