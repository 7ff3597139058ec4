import os
import stat

import numpy as np
import pytest

from planegrasp.library import ObjectLibrary
from planegrasp.library.feature_cache import feature_key, load, store
from planegrasp.objects import PlanarFace

ARRAYS = {
    "points": np.arange(20, dtype=np.float32).reshape(10, 2),
    "descriptors": np.random.default_rng(0).integers(0, 256, (10, 32), np.uint8),
    "none": np.zeros((0, 128), np.float32),
}


@pytest.fixture
def cache(tmp_path):
    return tmp_path / "cache"


def test_arrays_come_back_exactly(cache):
    store(cache, "key", ARRAYS)
    loaded = load(cache, "key")
    assert loaded.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        assert loaded[name].dtype == array.dtype
        np.testing.assert_array_equal(loaded[name], array)


def test_what_was_not_stored_is_absent(cache):
    assert load(cache, "key") is None
    store(cache, "key", ARRAYS)
    assert load(cache, "other") is None
    assert load(None, "key") is None


def test_every_truncation_is_absent_and_is_replaced(cache):
    store(cache, "key", ARRAYS)
    path = cache / "key.npz"
    whole = path.read_bytes()
    for length in range(0, len(whole), 37):
        path.write_bytes(whole[:length])
        assert load(cache, "key") is None
    store(cache, "key", ARRAYS)
    assert load(cache, "key") is not None


def test_no_damaged_byte_gives_other_arrays(cache):
    store(cache, "key", ARRAYS)
    path = cache / "key.npz"
    whole = path.read_bytes()
    refused = 0
    for position in range(0, len(whole), 7):
        damaged = bytearray(whole)
        damaged[position] ^= 0x41
        path.write_bytes(damaged)
        loaded = load(cache, "key")
        if loaded is None:
            refused += 1
            continue
        assert loaded.keys() == ARRAYS.keys()
        for name, array in ARRAYS.items():
            np.testing.assert_array_equal(loaded[name], array)
    assert refused > 50


def test_a_foreign_file_is_absent(cache):
    cache.mkdir()
    np.savez(cache / "key.npz", points=np.zeros(3))
    assert load(cache, "key") is None
    (cache / "key.npz").unlink()
    (cache / "key.npz").mkdir()
    assert load(cache, "key") is None
    store(cache, "key", ARRAYS)
    assert load(cache, "key") is None


@pytest.mark.filterwarnings("ignore")
def test_pickles_are_never_loaded(cache):
    cache.mkdir()
    np.savez(cache / "key.npz", points=np.array([{"a": 1}], dtype=object))
    assert load(cache, "key") is None


def test_storing_without_a_folder_does_nothing(tmp_path):
    store(None, "key", ARRAYS)
    store(tmp_path / "no" / "object" / "cache", "key", ARRAYS)
    assert not (tmp_path / "no").exists()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written_means_no_cache(tmp_path):
    tmp_path.chmod(stat.S_IRUSR | stat.S_IXUSR)
    try:
        store(tmp_path / "cache", "key", ARRAYS)
    finally:
        tmp_path.chmod(stat.S_IRWXU)
    assert load(tmp_path / "cache", "key") is None


def test_a_file_in_the_place_of_the_cache_means_no_cache(cache):
    cache.write_text("not a folder")
    store(cache, "key", ARRAYS)
    assert load(cache, "key") is None


def test_the_key_depends_on_image_and_settings(photo):
    face = PlanarFace("front", photo("coffee", width=100), 0.2)
    other = PlanarFace("front", photo("chelsea", width=100), 0.2)
    keys = {feature_key(face, "sift"), feature_key(face, "orb"), feature_key(other, "sift")}
    assert len(keys) == 3
    same_image = PlanarFace("back", photo("coffee", width=100), 0.5)
    assert feature_key(same_image, "sift") == feature_key(face, "sift")


def test_the_cache_of_a_stored_object_is_kept_beside_it(tmp_path, book):
    library = ObjectLibrary(tmp_path)
    library.add(book)
    library.save()
    store(library.cache_dir("book"), "key", ARRAYS)
    again = ObjectLibrary(tmp_path)
    assert load(again.cache_dir("book"), "key") is not None
