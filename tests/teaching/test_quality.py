import cv2
import numpy as np
import pytest

from planegrasp.errors import DuplicateObjectError, TeachingError
from planegrasp.features import make_extractor
from planegrasp.library import ObjectLibrary
from planegrasp.objects import ObjectModel
from planegrasp.teaching.preview import draw_preview
from planegrasp.teaching.quality import assess
from planegrasp.teaching.teach import teach


def rgb(gray):
    return np.repeat(np.asarray(gray, np.uint8)[:, :, None], 3, axis=2)


def checkerboard():
    return rgb((np.indices((400, 600)) // 40).sum(axis=0) % 2 * 255)


def tiles(photo):
    return np.tile(photo("astronaut", width=100), (4, 4, 1))


UNUSABLE = {
    "plain": rgb(np.full((400, 600), 128)),
    "noise-free page": rgb(np.full((400, 600), 255)),
    "gradient": rgb(np.tile(np.linspace(0, 255, 600), (400, 1))),
    "checkerboard": checkerboard(),
}


@pytest.mark.parametrize("name", ["astronaut", "coffee", "chelsea", "immunohistochemistry"])
def test_detailed_photographs_score_high(photo, name):
    quality = assess(photo(name))
    assert quality.usable
    assert quality.score >= 70


@pytest.mark.parametrize("name", ["rocket", "retina"])
def test_weak_photographs_score_clearly_lower_with_a_reason(photo, name):
    quality = assess(photo(name))
    assert quality.usable
    assert 20 <= quality.score <= assess(photo("coffee")).score - 10
    assert quality.reasons


@pytest.mark.parametrize("name", UNUSABLE)
def test_what_cannot_be_recognised_is_unusable(name):
    quality = assess(UNUSABLE[name])
    assert not quality.usable
    assert quality.score == 0
    assert quality.reasons


@pytest.mark.parametrize("make", [lambda photo: checkerboard(), tiles], ids=["checker", "tiles"])
def test_repetition_is_called_so(photo, make):
    quality = assess(make(photo))
    assert not quality.usable
    assert quality.figures["repetition"] > 0.9
    assert any(reason.startswith("repetitive: ") for reason in quality.reasons)


def test_no_features_are_called_so():
    assert assess(UNUSABLE["plain"]).reasons[0].startswith("no features")


def test_blur_lowers_the_score_and_is_called_so(photo):
    sharp = photo("astronaut")
    scores = [assess(cv2.GaussianBlur(sharp, (0, 0), s)).score for s in (0.5, 2, 4, 8)]
    assert scores == sorted(scores, reverse=True)
    assert scores[-1] < 40
    reasons = assess(cv2.GaussianBlur(sharp, (0, 0), 4)).reasons
    assert any(reason.startswith("blurred: ") for reason in reasons)
    assert not any(reason.startswith("blurred") for reason in assess(sharp).reasons)


def test_low_contrast_lowers_the_score_and_is_called_so(photo):
    faint = (0.1 * photo("astronaut") + 100).astype(np.uint8)
    quality = assess(faint)
    assert quality.score < 50
    assert any("low contrast: grey levels span 2" in reason for reason in quality.reasons)


def test_few_pixels_lower_the_score_and_are_called_so(photo):
    quality = assess(photo("astronaut", width=80))
    assert quality.score < 40
    assert any("low resolution: 80×80 pixels" in reason for reason in quality.reasons)
    assert not assess(photo("astronaut", width=32)).usable


def test_texture_in_one_corner_is_called_clustered(photo):
    image = rgb(np.full((1000, 1000), 250))
    image[50:350, 50:350] = photo("astronaut", width=300)
    quality = assess(image)
    assert quality.score < 30
    # The photograph is 9 % of the image, its pixels touch 5×5 of the 12×12 cells: 17 %.
    assert quality.figures["coverage"] < 0.2
    assert any(reason.startswith("clustered: ") for reason in quality.reasons)


def test_the_verdict_does_not_depend_on_the_size_of_a_large_photo(photo):
    image = photo("astronaut")
    large = cv2.resize(image, None, fx=3, fy=3, interpolation=cv2.INTER_CUBIC)
    assert assess(large).score == pytest.approx(assess(image).score, abs=10)


def test_the_verdict_is_repeatable(photo):
    first, second = assess(photo("rocket")), assess(photo("rocket"))
    assert (first.score, first.figures) == (second.score, second.figures)


@pytest.mark.parametrize("name", ["orb", "akaze"])
def test_bit_string_features_can_be_judged_too(photo, name):
    extractor = make_extractor(name)
    assert assess(photo("coffee"), extractor).usable
    assert not assess(checkerboard(), extractor).usable


def test_coverage_is_the_share_of_the_face_with_texture(photo):
    image = photo("astronaut").copy()
    image[:, 246:] = 128
    figures = assess(image).figures
    assert 0.3 < figures["coverage"] <= 0.5


def test_teaching_saves_what_is_good(tmp_path, book):
    verdicts = teach(ObjectLibrary(tmp_path / "objects"), book)
    assert verdicts["front"].usable
    assert ObjectLibrary(tmp_path / "objects").names == ("book",)


def test_teaching_refuses_what_cannot_work_and_changes_nothing(tmp_path):
    library = ObjectLibrary(tmp_path / "objects")
    with pytest.raises(TeachingError, match=r"face 'front' of 'page' cannot be (.|\n)*no features"):
        teach(library, ObjectModel.from_image("page", UNUSABLE["plain"], 0.2))
    assert len(library) == 0
    assert not (tmp_path / "objects").exists()


def test_teaching_does_not_replace_unasked(book):
    library = ObjectLibrary()
    teach(library, book)
    with pytest.raises(DuplicateObjectError):
        teach(library, book)
    teach(library, book, replace=True)


def test_the_preview_shows_the_face_enlarged_with_its_features(photo):
    image = photo("coffee", width=160)
    preview = draw_preview(image)
    assert min(preview.shape[:2]) >= 400
    zoom = preview.shape[0] // image.shape[0]
    changed = np.any(preview[::zoom, ::zoom] != image, axis=2)
    assert 0.01 < changed.mean() < 0.6
