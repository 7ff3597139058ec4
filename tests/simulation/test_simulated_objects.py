import numpy as np
import pytest

from planegrasp.simulation.objects import cracker_box, picture_book


@pytest.mark.parametrize(
    ("thing", "size", "printed"),
    [
        (cracker_box, (0.158, 0.210, 0.060), {"front", "back", "left", "right"}),
        (picture_book, (0.21, 0.28, 0.02), {"front", "back"}),
    ],
)
def test_things_have_the_papers_sizes(thing, size, printed):
    model = thing().model
    assert model.outer_body.size == pytest.approx(size)
    assert {face.name for face in model.faces} == printed
    front = model.face("front")
    assert (front.width, front.height) == pytest.approx(size[:2])
    assert front.T_object_face.translation == pytest.approx([0, 0, size[2] / 2])
    assert 0.1 < thing().mass < 1.0


def test_no_photograph_is_on_two_sides():
    faces = [*cracker_box().model.faces, *picture_book().model.faces]
    assert len({face.image_digest for face in faces}) == len(faces)


def test_photographs_are_not_stretched():
    for face in [*cracker_box().model.faces, *picture_book().model.faces]:
        rows, columns = face.image.shape[:2]
        assert np.isclose(columns / rows, face.width / face.height, rtol=0.01)
