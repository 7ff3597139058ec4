"""What is kept of a taught face, and when the cache may stand in for it."""

from dataclasses import replace

import numpy as np
import pytest

from planegrasp.features import ORB, SIFT, OpenCVSIFT
from planegrasp.features.oblique import FRONTAL, ObliqueConfig
from planegrasp.features.pruning import PruningConfig
from planegrasp.objects import ObjectModel
from planegrasp.references import prepare_face

FEW = PruningConfig(max_descriptors=80, views=10, max_tilt_deg=45.0)
SETTINGS = {
    "extractor": SIFT(),
    "oblique": FRONTAL,
    "pruning": FEW,
    "longest_side": 150,
    "same_place": 0.03,
}


@pytest.fixture(scope="module")
def model(photo):
    return ObjectModel.from_image("book", photo("coffee", width=300), 0.2)


def prepare(model, cache=None, **changes):
    """The descriptors of the model's face."""
    settings = {**SETTINGS, **changes}
    extractor, oblique = settings.pop("extractor"), settings.pop("oblique")
    _, features = prepare_face(model, model.faces[0], extractor, oblique, cache=cache, **settings)
    return features


def cached(cache):
    return sorted(path.name for path in cache.iterdir())


def test_points_lie_on_the_image_as_it_was_taught(model):
    kept = prepare(model)
    height, width = model.faces[0].image.shape[:2]
    assert np.all((kept.points > 0) & (kept.points < (width, height)))
    # Features of the shrunk image, but in pixels of the taught one.
    assert kept.points[:, 0].max() > 0.8 * width
    assert kept.radius == pytest.approx(0.03 * width)


def test_only_the_most_useful_are_kept(model):
    some = prepare(model)
    fewer = prepare(model, pruning=replace(FEW, max_descriptors=50))
    everything = prepare(model, pruning=replace(FEW, max_descriptors=0))
    assert len(fewer.points) == 50 < len(some.points) <= 80 < len(everything.points)
    np.testing.assert_array_equal(fewer.descriptors, some.descriptors[:50])


def test_vectors_of_floats_are_all_kept(model):
    floats = OpenCVSIFT()
    if prepare(model, extractor=floats).descriptors.dtype == np.uint8:
        pytest.skip("OpenCV's SIFT gives bytes")
    one = replace(FEW, max_descriptors=1)
    assert len(prepare(model, extractor=floats, pruning=one).points) > 100


def test_the_pruned_set_is_cached(model, tmp_path, monkeypatch):
    first = prepare(model, tmp_path)
    assert len(cached(tmp_path)) == 1
    monkeypatch.setattr(SIFT, "extract", lambda *_: pytest.fail("extracted again"))
    again = prepare(model, tmp_path)
    for name in ("points", "frames", "descriptors", "signs", "served"):
        np.testing.assert_array_equal(getattr(again, name), getattr(first, name))
    assert set(first.signs) == {-1, 1}
    assert first.served > 0


def test_other_settings_are_cached_apart(model, tmp_path):
    prepare(model, tmp_path)
    changes = [
        {"pruning": replace(FEW, max_descriptors=60)},
        {"pruning": replace(FEW, seed=1)},
        {"pruning": replace(FEW, views=4)},
        {"pruning": replace(FEW, noise=0.0)},
        {"oblique": ObliqueConfig(tilts=(1.0, 2.0))},
        {"longest_side": 100},
        {"extractor": ORB()},
    ]
    for number, change in enumerate(changes, start=2):
        prepare(model, tmp_path, **change)
        assert len(cached(tmp_path)) == number
    prepare(model, tmp_path)
    assert len(cached(tmp_path)) == len(changes) + 1
